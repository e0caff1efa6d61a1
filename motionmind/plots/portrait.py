"""What a variation looks like on its attractor: both trajectories, the sites, and the cells in which postures live.

The map from points to postures is three-dimensional: a point belongs to the site that is nearest in all coordinates.
The Voronoi diagram of sites that are projected onto a page is another partition, in which points that are seen in one
cell may belong to another. So cells are drawn where the map is used: on the attractor itself. It lies in thin sheets;
where some are behind one another, the one nearest to the viewer is seen, as with any surface.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import takewhile

import numpy as np

from motionmind._typing import Floats, Int16s, Ints
from motionmind.chaos.flows import Flow, flow_of
from motionmind.chaos.reorder import reorder
from motionmind.chaos.trajectories import trajectory
from motionmind.errors import MotionMindError
from motionmind.jit import jit
from motionmind.render.solids import EMPTY
from motionmind.variation.review import Cut, Seam
from motionmind.variation.variation import Variation

MOST = 10_000  # postures of a piece or of a variation: more cells than a picture has room for
MOST_STEPS = 200_000  # of a trajectory, lines each
SHEETS = 2_000_000  # steps of the trajectory that shows where the attractor is
_USUAL = {"lorenz": ("x", "z"), "chua": ("x", "z")}  # in which coordinates a flow is best seen, if not the first two
_SOFT = 4.0  # pixels: what of the attractor's outline is finer is chance
_GAP = 3  # pixels, at least half a gap between strands of the trajectory that is not one of the attractor


@dataclass(frozen=True, eq=False)
class Portrait:
    """A variation on its attractor.

    Attributes:
        variation: as the trajectory gave it, with what was edited before postures were moved.
        flow: whose attractor it is.
        every: steps of the integration from one posture to the next.
        piece: the piece's trajectory, all its steps [(N - 1) every + 1, d].
        other: the variation's [(L - 1) every + 1, d].
    """

    variation: Variation
    flow: Flow
    every: int
    piece: Floats
    other: Floats

    @property
    def sites(self) -> Floats:
        """Where the piece's postures lie [N, d]."""
        return self.piece[:: self.every]

    @property
    def points(self) -> Floats:
        """Where the variation's are read [L, d]."""
        return self.other[:: self.every]

    @property
    def order(self) -> Ints:
        """The posture of the piece that comes at each point [L]."""
        return self.variation.order

    @property
    def parting(self) -> int | None:
        """The first point at which it jumps, while the piece goes on; None where it stays with it to its end."""
        first = min(self.jumps, default=len(self.sites))
        return first if first < len(self.sites) else None

    @cached_property
    def jumps(self) -> dict[int, Seam]:
        """The seams, by the point at which the posture comes that does not follow in the piece."""
        return {seam.at + 1: seam for seam in self.variation.seams}

    @cached_property
    def axes(self) -> tuple[int, int, tuple[int, ...]]:
        """Which coordinates go to the right and up, and which are left out, one at least: chaos takes three."""
        names = list(self.flow.dimensions)
        across, up = (names.index(name) for name in _USUAL.get(self.flow.name, names[:2]))
        return across, up, tuple(i for i in range(len(names)) if i not in (across, up))

    def seen(self, points: Floats) -> Floats:
        """Where points [..., d] are in the picture [..., 2], in the flow's coordinates."""
        return np.asarray(points[..., self.axes[:2]])

    def in_space(self, points: Floats) -> Floats:
        """The same, and towards the viewer [..., 3]."""
        return np.concatenate([self.seen(points), self._towards * points[..., self.axes[2][:1]]], axis=-1)

    @cached_property
    def sheets(self) -> Floats:
        """Points all over the attractor [SHEETS, d], along one trajectory."""
        return trajectory(
            self.flow, self.piece[-1], count=SHEETS, every=1, step=self.variation.course.step, transient=0
        )

    def cells(self, corner: Floats, scale: float, width: int, height: int) -> Int16s:
        """The posture whose cell each pixel of the attractor is in [height, width]; EMPTY beside the attractor.

        Args:
            corner: the picture's upper left corner [2], in the flow's coordinates.
            scale: pixels to a unit of these.
            width, height: of the picture, pixels.
        """
        from scipy.ndimage import binary_erosion, gaussian_filter

        across, up, left_out = self.axes
        along = self.sheets[:, [across, up, *left_out]]
        along[:, :2] = (along[:, :2] - corner) * [scale, -scale]
        y, x = np.mgrid[-_GAP : _GAP + 1, -_GAP : _GAP + 1]
        disc = y * y + x * x <= _GAP * _GAP
        hidden = _nearest(along, self._towards, width, height)
        hidden = _spread(hidden, self._towards, np.argwhere(disc) - _GAP)
        there = binary_erosion(~np.isnan(hidden[..., 0]), disc)
        # The fringe, where few strands of the trajectory come, is made as smooth as the attractor is.
        there = (gaussian_filter(there.astype(np.float32), _SOFT) > 0.5) & ~np.isnan(hidden[..., 0])
        rows, columns = np.nonzero(there)
        at = np.empty((len(rows), along.shape[1]))
        at[:, across], at[:, up] = (corner + (np.stack([columns, rows], axis=1) + 0.5) / [scale, -scale]).T
        at[:, left_out] = hidden[rows, columns]
        found = np.full((height, width), EMPTY, dtype=np.int16)
        found[rows, columns] = reorder(self.sites, at)
        return found

    @property
    def _towards(self) -> float:
        """1 where more of the first coordinate that is left out is nearer, else -1: space is right-handed."""
        across, up, left_out = self.axes
        return 1.0 if len(left_out) != 1 or (up - across) % 3 == 1 else -1.0


def portrait_of(variation: Variation) -> Portrait:
    """A variation on its attractor, which is found again from its course.

    Edits from the first on that moves postures are left out: what follows no trajectory any more is not on it.

    Raises:
        MotionMindError: its flow is not one of `motionmind.chaos.flows`, its course is none, its trajectories give
            another order here, or it has more postures than can be drawn.
    """
    course = variation.course
    most = max(len(variation.piece), len(variation.order))
    if most > MOST:
        raise MotionMindError(f"a picture of an attractor shows {MOST} postures at most, not {most}")
    if most * (course.skip + 1) > MOST_STEPS:
        raise MotionMindError(
            f"a picture of an attractor shows {MOST_STEPS} steps at most, not {most * (course.skip + 1)}: "
            f"{most} postures, {course.skip + 1} steps each"
        )
    variation = replace(variation, edits=tuple(takewhile(lambda edit: not isinstance(edit, Cut), variation.edits)))
    flow, every = flow_of(course.flow, **course.parameters), course.skip + 1
    if course.skip < 0 or len(course.nudge) != len(flow.start):
        raise MotionMindError(
            f"a course of {flow.name} has a nudge of {len(flow.start)} numbers and skips 0 points or more, "
            f"not {len(course.nudge)} numbers and {course.skip} points"
        )
    piece = trajectory(
        flow,
        course.start,
        count=(len(variation.piece) - 1) * every + 1,
        every=1,
        step=course.step,
        transient=course.transient,
    )
    begin = piece[0] + np.array(course.nudge)
    other = trajectory(
        flow, begin, count=(len(variation.order) - 1) * every + 1, every=1, step=course.step, transient=0
    )
    found = Portrait(variation, flow, every, piece, other)
    if not np.array_equal(reorder(found.sites, found.points), variation.order):
        raise MotionMindError(
            f"the trajectories of {flow.label} give another order here than this variation has: it was made by another "
            "flow of that name, or where numbers round otherwise; vary the piece anew to see it"
        )
    return found


@jit
def _nearest(along: Floats, towards: float, width: int, height: int) -> Floats:
    """The coordinates that are left out [H, W, d - 2] where a trajectory passes, nearest to the viewer; else nan.

    Args:
        along: the trajectory [N, d]: column and row, in pixels, and the coordinates that are left out.
        towards: 1 where more of the first of these is nearer, else -1.
        width, height: of the picture.
    """
    d = along.shape[1]
    shown = np.full((height, width, d - 2), np.nan)
    for n in range(len(along) - 1):
        across, down = along[n + 1, 0] - along[n, 0], along[n + 1, 1] - along[n, 1]
        pixels = int(np.hypot(across, down)) + 1
        for k in range(pixels):
            share = k / pixels
            column, row = int(np.floor(along[n, 0] + share * across)), int(np.floor(along[n, 1] + share * down))
            if 0 <= column < width and 0 <= row < height:
                depth = (1.0 - share) * along[n, 2] + share * along[n + 1, 2]
                if not towards * shown[row, column, 0] >= towards * depth:
                    for i in range(2, d):
                        shown[row, column, i - 2] = (1.0 - share) * along[n, i] + share * along[n + 1, i]
    return shown


@jit
def _spread(shown: Floats, towards: float, disc: Ints) -> Floats:
    """What is nearest to the viewer about each pixel [H, W, d - 2], among those that are off by the rows and columns
    of `disc` [K, 2]."""
    height, width, _ = shown.shape
    found = np.full_like(shown, np.nan)
    for row in range(height):
        for column in range(width):
            best, best_y, best_x = -np.inf, -1, -1
            for k in range(len(disc)):
                y, x = row + disc[k, 0], column + disc[k, 1]
                if 0 <= y < height and 0 <= x < width and towards * shown[y, x, 0] > best:
                    best, best_y, best_x = towards * shown[y, x, 0], y, x
            if best_y >= 0:
                found[row, column] = shown[best_y, best_x]
    return found
