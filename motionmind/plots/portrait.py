"""A variation on its attractor: both trajectories, the sites of postures, and their cells.

A point of the flow belongs to the site that is nearest in all coordinates, or that Dabby's mapping gives. The Voronoi
diagram of the sites projected to the page is a different partition: a point in one of its cells may belong to another
site. So the picture shows the cells where the map applies, on the attractor. Of its thin sheets, the one nearest to the
viewer shows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import takewhile

import numpy as np

from motionmind._typing import Floats, Int16s, Ints
from motionmind.chaos.flows import Flow, find_flow
from motionmind.chaos.trajectories import trajectory
from motionmind.errors import MotionMindError
from motionmind.jit import jit
from motionmind.render.solids import EMPTY_CODE
from motionmind.variation.controls import map_points
from motionmind.variation.course import Course
from motionmind.variation.review import Cut, Seam
from motionmind.variation.variation import Variation

MAX_CELLS = 10_000  # postures of a piece or of a variation: a picture has no room for more
MAX_STEPS = 200_000  # of a trajectory: each is a line
N_SHEET_STEPS = 2_000_000  # of the trajectory that fills the attractor


@dataclass(frozen=True, eq=False)
class Portrait:
    """A variation on its attractor.

    Attributes:
        variation: the variation, with its edits up to the first that moves postures.
        course: the course of its trajectories.
        flow: the flow.
        every: integration steps from one posture to the next.
        piece: the piece's trajectory, every step [(N - 1) every + 1, d], in the flow's coordinates.
        other: the variation's trajectory, every step [(L - 1) every + 1, d].
    """

    variation: Variation
    course: Course
    flow: Flow
    every: int
    piece: Floats
    other: Floats

    @property
    def sites(self) -> Floats:
        """The points of the piece's postures [N, d]."""
        return self.piece[:: self.every]

    @property
    def points(self) -> Floats:
        """The points of the variation's postures [L, d]."""
        return self.other[:: self.every]

    @property
    def order(self) -> Ints:
        """The posture of the piece at each point [L]: that of its cell or, under limits, of a cell nearby."""
        return self.variation.first_order

    def postures_at(self, points: Floats) -> Ints:
        """Return the posture in whose cell each point [M, d] is [M]."""
        return map_points(self.variation.control, self.sites, points)

    @property
    def parting(self) -> int | None:
        """The first point at which the variation leaves the piece, 0 if it begins elsewhere; None if it never does."""
        first = 0 if self.order[0] else min(self.jumps, default=len(self.sites))
        return first if first < len(self.sites) else None

    @cached_property
    def jumps(self) -> dict[int, Seam]:
        """The seams, by the point whose posture does not follow its predecessor in the piece."""
        return {seam.at + 1: seam for seam in self.variation.seams}

    @cached_property
    def axes(self) -> tuple[int, int, tuple[int, ...]]:
        """Indices of the coordinates shown to the right and up, and of those left out, at least one."""
        names = list(self.flow.dimensions)
        best = {"lorenz": ("x", "z"), "chua": ("x", "z")}.get(self.flow.name, names[:2])
        across, up = (names.index(name) for name in best)
        return across, up, tuple(i for i in range(len(names)) if i not in (across, up))

    def seen(self, points: Floats) -> Floats:
        """Return the two coordinates of points [..., d] that the picture shows [..., 2]."""
        return np.asarray(points[..., self.axes[:2]])

    def in_space(self, points: Floats) -> Floats:
        """Return the coordinates of points [..., d] to the right, up and towards the viewer [..., 3]."""
        return np.concatenate([self.seen(points), self._towards * points[..., self.axes[2][:1]]], axis=-1)

    @cached_property
    def sheets(self) -> Floats:
        """Points all over the attractor, along one trajectory [N_SHEET_STEPS, d]."""
        return trajectory(self.flow, self.piece[-1], count=N_SHEET_STEPS, every=1, step=self.course.step, transient=0)

    def cells(self, corner: Floats, scale: float, width: int, height: int) -> Int16s:
        """Find the posture whose cell each pixel is in.

        Args:
            corner: the picture's upper left corner [2], in the coordinates shown.
            scale: pixels to a unit of these.
            width, height: size of the picture, pixels.

        Returns:
            Numbers of postures [height, width]; EMPTY beside the attractor.
        """
        from scipy.ndimage import binary_erosion, gaussian_filter

        across, up, left_out = self.axes
        along = self.sheets[:, [across, up, *left_out]]
        along[:, :2] = (along[:, :2] - corner) * [scale, -scale]
        gap = 3  # pixels: half the width of the widest gap between strands that belongs to the attractor
        y, x = np.mgrid[-gap : gap + 1, -gap : gap + 1]
        disc = y * y + x * x <= gap * gap
        hidden = _nearest(along, self._towards, width, height)
        hidden = _spread(hidden, self._towards, np.argwhere(disc) - gap)
        covered = binary_erosion(~np.isnan(hidden[..., 0]), disc)
        # Few strands of the trajectory reach the fringe; details of its outline below 4 pixels are chance.
        covered = (gaussian_filter(covered.astype(np.float32), 4.0) > 0.5) & ~np.isnan(hidden[..., 0])
        rows, columns = np.nonzero(covered)
        at = np.empty((len(rows), along.shape[1]))
        at[:, across], at[:, up] = (corner + (np.stack([columns, rows], axis=1) + 0.5) / [scale, -scale]).T
        at[:, left_out] = hidden[rows, columns]
        postures = np.full((height, width), EMPTY_CODE, dtype=np.int16)
        postures[rows, columns] = self.postures_at(at)
        return postures

    @property
    def _towards(self) -> float:
        """1 if greater values of the first coordinate left out are nearer, else -1; axes are right-handed."""
        across, up, left_out = self.axes
        return 1.0 if len(left_out) != 1 or (up - across) % 3 == 1 else -1.0


def portrait_of(variation: Variation) -> Portrait:
    """Compute a variation's trajectories again from its course.

    The first edit that moves postures, and all later ones, are left out: they follow no trajectory.

    Args:
        variation: the variation.

    Raises:
        MotionMindError: it follows no trajectory, its flow is unknown (see `motionmind.chaos.flows`), its course is
            invalid, its trajectories give another order on this machine, or it has too many postures to draw.
    """
    course = variation.course
    if course is None or (variation.control is not None and variation.control.is_random):
        raise MotionMindError(f"a variation by {variation.by} is random, and has no trajectory to draw")
    most = max(len(variation.piece), len(variation.order))
    if most > MAX_CELLS:
        raise MotionMindError(f"a picture of an attractor shows {MAX_CELLS} postures at most, not {most}")
    if most * (course.skip + 1) > MAX_STEPS:
        raise MotionMindError(
            f"a picture of an attractor shows {MAX_STEPS} steps at most, not {most * (course.skip + 1)}: "
            f"{most} postures, {course.skip + 1} steps each"
        )
    variation = replace(variation, edits=tuple(takewhile(lambda edit: not isinstance(edit, Cut), variation.edits)))
    flow, every = find_flow(course.flow, **course.parameters), course.skip + 1
    if course.skip < 0 or len(course.nudge) != len(flow.start):
        raise MotionMindError(
            f"a course of {flow.name} needs a nudge of {len(flow.start)} numbers and a skip of 0 or more, "
            f"not {len(course.nudge)} numbers and {course.skip}"
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
    portrait = Portrait(variation, course, flow, every, piece, other)
    if not np.array_equal(portrait.postures_at(portrait.points), variation.order):
        raise MotionMindError(
            f"the trajectories of {flow.label} give another order here than this variation has: it comes from another "
            "flow of that name, or from a machine that rounds otherwise; vary the piece again to draw it"
        )
    return portrait


@jit
def _nearest(along: Floats, towards: float, width: int, height: int) -> Floats:
    """Find, for each pixel that a trajectory passes, the coordinates left out where it is nearest to the viewer.

    Args:
        along: the trajectory [N, d]: column and row, in pixels, and the coordinates left out.
        towards: 1 if greater values of the first of these are nearer, else -1.
        width, height: size of the picture, pixels.

    Returns:
        The coordinates left out [H, W, d - 2]; nan elsewhere.
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
    """Spread to each pixel the nearest values [H, W, d - 2] among those at the row and column offsets `disc` [K, 2]."""
    height, width, _ = shown.shape
    spread = np.full_like(shown, np.nan)
    for row in range(height):
        for column in range(width):
            best, best_y, best_x = -np.inf, -1, -1
            for k in range(len(disc)):
                y, x = row + disc[k, 0], column + disc[k, 1]
                if 0 <= y < height and 0 <= x < width and towards * shown[y, x, 0] > best:
                    best, best_y, best_x = towards * shown[y, x, 0], y, x
            if best_y >= 0:
                spread[row, column] = shown[best_y, best_x]
    return spread
