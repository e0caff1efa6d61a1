"""Reaches: joints at given places at given times, and joints that stay in their places, as a term of the solve."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from motionmind._typing import Floats, Indices
from motionmind.body.ik import chain_to
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.solver.kinematics import Rows, State
from motionmind.solver.system import Normal

LEAVES_S = 0.3  # before B in which a joint that stayed from A on leaves its place, at least
LEAVES_S_PER_M = 1.5  # and for each metre that it has to go
STAYS_M = 0.01  # distance of its place in B up to which it need not leave
LEAN_M = 0.4  # by which the body may bring a limb nearer to its place


class Reach(NamedTuple):
    """A place for a joint at one time.

    Attributes:
        joint: index of the joint.
        place: its position [3], metres.
        seconds: time from the first frame.
    """

    joint: int
    place: Floats
    seconds: float

    def scaled(self, by: float) -> Reach:
        """Return the reach of a body `by` times as large."""
        return self._replace(place=by * self.place)


class Stay(NamedTuple):
    """A part of a movement in which a joint and its children keep their places.

    The place is the one at the beginning of that part; the one in B, if the part begins later than A and ends in B.

    Attributes:
        joint: index of the joint.
        begins: share of the movement's time at which it begins.
        ends: share at which it ends, more than `begins`.
    """

    joint: int
    begins: float
    ends: float

    def frames(self, places: Floats, times: Floats) -> tuple[int, Indices]:
        """Return the frame of the place, and all frames between A and B in which the joint keeps it.

        Args:
            places: positions of the joint [N, 3], metres.
            times: times of the frames [N], seconds, from 0 on.
        """
        last, long = len(times) - 1, float(times[-1])
        to_b = self.ends == 1.0
        anchor = last if to_b and self.begins > 0.0 else int(np.searchsorted(times, self.begins * long - 1e-9))
        away, ends = float(np.linalg.norm(places[-1] - places[anchor])), self.ends * long
        if to_b and away > STAYS_M:
            ends = max(long - max(LEAVES_S, LEAVES_S_PER_M * away), 0.5 * long)
        within = (times >= self.begins * long - 1e-9) & (times <= ends + 1e-9)
        within[[0, -1]] = False
        return anchor, np.flatnonzero(within)

    def reaches(self, skeleton: Skeleton, places: Floats, times: Floats) -> Iterator[Reach]:
        """Yield a reach for each joint and frame, at the places of a reference [N, J, 3], metres."""
        anchor, frames = self.frames(places[:, self.joint], times)
        for joint in (self.joint, *skeleton.children(self.joint)):
            for frame in frames:
                yield Reach(joint, places[anchor, joint], float(times[frame]))


@dataclass
class Reaches:
    """Bring joints to places, each at one time: within the pull that limits, feet and balance withstand.

    A time between two frames counts their positions in proportion.

    Attributes:
        first: frame at or before each reach [R].
        shares: weights of that frame and the next [R, 2].
        joints: the joints [R].
        places: their places [R, 3], metres.
        sd: standard deviation of each coordinate, metres.
        reach: distance beyond which the pull is constant, metres.
    """

    unit: ClassVar[str] = ""

    first: Indices
    shares: Floats
    joints: Indices
    places: Floats
    sd: float
    reach: float

    @cached_property
    def _rows(self) -> Rows:
        """Three rows for each reach."""
        count = 3 * len(self.first)
        points, offsets = np.tile(np.repeat(self.joints, 3)[:, None], 2), np.tile([0, 1], (count, 1))
        directions, shares = np.tile(np.eye(3), (len(self.first), 1)), np.repeat(self.shares, 3, axis=0)
        return Rows(np.repeat(self.first, 3), directions, points, offsets, shares)

    def _off(self, state: State) -> Floats:
        around = state.places[self.first[:, None] + [0, 1], self.joints[:, None]]
        return np.asarray(np.einsum("rk,rkx->rx", self.shares, around) - self.places)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        off = self._off(state)
        eased = np.sqrt(1.0 + np.sum((off / self.reach) ** 2, axis=1))
        normal.cost += float(np.sum(2.0 * (self.reach / self.sd) ** 2 * (eased - 1.0)))
        self._rows.add(state, normal, off.reshape(-1), np.repeat(self.sd**-2.0 / eased, 3))

    def residuals(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.residuals`."""
        return np.zeros(len(state.x))


def reaches_in(reaches: Sequence[Reach], frames: slice, fps: float, sd: float, pull: float) -> Reaches | None:
    """Return the term of the reaches between two frames of a slice; None for none.

    Args:
        reaches: the reaches of the whole movement.
        frames: slice of its frames.
        fps: frames a second.
        sd: standard deviation of each coordinate, metres.
        pull: distance beyond which the pull is constant, metres.
    """
    at = np.array([fps * one.seconds for one in reaches])
    first = np.floor(at + 1e-6).astype(np.int64)
    here = np.flatnonzero((first >= frames.start) & (first + 1 < frames.stop))
    if not len(here):
        return None
    share = np.maximum(at - first, 0.0)[here]
    joints, places = np.array([one.joint for one in reaches]), np.stack([one.place for one in reaches])
    shares = np.stack([1.0 - share, share], axis=1)
    return Reaches(first[here] - frames.start, shares, joints[here], places[here], sd, pull)


def within_workspace(skeleton: Skeleton, reach: Reach, places: Floats) -> Reach:
    """Return a reach towards the same place, no farther from its limb's first joint than the limb and a lean reach.

    The pull towards a place metres away would upset the solve.

    Args:
        skeleton: the body.
        reach: the reach.
        places: positions of the joints in the reference at that time [J, 3], metres.
    """
    first, *others = *chain_to(skeleton, reach.joint), reach.joint
    far = LEAN_M + float(rot.norm(skeleton.offsets[others]).sum())
    away = reach.place - places[first]
    return reach._replace(place=places[first] + away * min(1.0, far / max(float(np.linalg.norm(away)), 1e-9)))


def joints_towards(skeleton: Skeleton, reaches: Sequence[Reach]) -> tuple[set[int], set[int]]:
    """Return the joints that move the joint of any reach, and those of its limb among them, without collarbones."""
    every: set[int] = set()
    limbs: set[int] = set()
    for reach in reaches:
        chain = chain_to(skeleton, reach.joint)
        limbs |= set(chain[len(chain) > 2 :])
        joint = reach.joint
        while (joint := skeleton.parents[joint]) >= 0:
            every.add(joint)
    return every, limbs
