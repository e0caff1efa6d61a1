"""Controls: orders of a piece by chance or by a simpler mapping, to compare with a chaotic variation.

- `shuffle`: the postures in random order.
- `chunks`: the chunks of a chaotic order in random order, which keeps as much of the piece.
- `quadrants`: the postures of each body part in an independent random order, after Merce Cunningham. The composed
  postures form a new piece (`Piece.composed`), in its own order.
- `dabby`: the postures along a chaotic trajectory, by Dabby's mapping of one coordinate.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import msgspec
import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.arguments import check_text
from motionmind.body.contact import lowest_height
from motionmind.chaos.baselines import chunk_shuffled, dabby, quadrants, shuffled
from motionmind.chaos.reorder import Itinerary, reorder, runs
from motionmind.errors import MotionMindError, suggestion
from motionmind.variation.arguments import check_whole
from motionmind.variation.orders import ORDERS, RANDOM, REFUSED, By, ControlName
from motionmind.variation.piece import Piece


class Control(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The control that gave a variation its order.

    Attributes:
        by: its name.
        seed: the seed of its random numbers; None if nothing is random.
    """

    by: ControlName
    seed: Annotated[int, msgspec.Meta(ge=0)] | None = None

    @property
    def is_random(self) -> bool:
        """Whether its order is random."""
        return self.by in RANDOM

    @property
    def needs_trajectory(self) -> bool:
        """Whether its order comes from a trajectory."""
        return "flow" not in REFUSED[self.by]

    def of_piece(self, piece: Piece) -> tuple[Piece, Ints]:
        """Return the piece, composed if by quadrants, and its order [N], for a control without a trajectory."""
        rng, count = np.random.default_rng(self.seed), len(piece)
        if self.by == "shuffle":
            return piece, shuffled(count, rng)
        return compose_postures(piece, quadrants(piece.motion.skeleton, count, rng)), np.arange(count)

    def of_trajectory(self, found: Itinerary, order: Ints) -> Ints:
        """Return the order [L] of a control with a trajectory.

        Args:
            found: the trajectory, and the sites of the piece.
            order: the chaotic order, within the limits if any [L].
        """
        if self.by == "dabby":
            return dabby(found.sites, found.points)
        return chunk_shuffled(runs(order), np.random.default_rng(self.seed))


def control_of(by: By, seed: int) -> Control | None:
    """Return the control of a name, with its seed if it is random; None for the attractor's own order.

    Raises:
        MotionMindError: there is no such order, or the seed is out of its range.
        WrongTypeError: an argument is of another type.
    """
    check_text("by", by)
    if by not in ORDERS:
        raise MotionMindError(f"no order by {by!r}{suggestion(by, ORDERS)}")
    seed = check_whole("seed", seed, 0, 2**63 - 1)  # JSON readers know 64-bit integers
    return None if by == "attractor" else Control(by, seed if by in RANDOM else None)


def map_points(control: Control | None, sites: Floats, points: Floats) -> Ints:
    """Map each point of a trajectory [M, d] to the posture whose cell contains it [M].

    Args:
        control: the control that maps the points; None for the nearest site.
        sites: the sites of the postures [N, d].
        points: the points.
    """
    return reorder(sites, points) if control is None else dabby(sites, points)


def compose_postures(piece: Piece, sources: Ints) -> Piece:
    """Compose postures of joints from several postures of a piece.

    The root position comes with the root joint. The lowest point keeps its height in that source posture; otherwise
    other legs would sink into the floor or hover.

    Args:
        piece: the piece, N postures.
        sources: the source posture of each joint [N, J].

    Returns:
        The composed postures at the times of the piece's own; its credits are the piece's.
    """
    motion, frames = piece.motion, piece.frames[sources]
    rotations = motion.rotations[frames, np.arange(len(motion.skeleton))]
    root = motion.root[frames[:, 0]]
    own = lowest_height(motion.skeleton, motion.rotations[frames[:, 0]], root)
    root[:, 1] += own - lowest_height(motion.skeleton, rotations, root)
    composed = replace(
        motion,
        rotations=rotations,
        root=root,
        times=motion.times[piece.frames],
        insertions=(),
        keyframed=True,
        recorded=motion.credits if motion.insertions else motion.recorded,
    )
    return Piece(composed, np.arange(len(piece)), piece.facing, composed=True)
