"""Travel of a request: where B stands, the path drawn to there, and how near the motion keeps to both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion, Posture
from motionmind.footing.course import Course
from motionmind.geometry import rotations as rot
from motionmind.geometry.polylines import length_of, offsets_to, places_along
from motionmind.tween.options import is_timed

NEAR_PATH_M = 0.1  # up to which distance a body is on its path, and B at its place
TURNED_DEG = 1.0  # up to which B faces as it should
MAX_ROUTE_POINTS = 256  # of a path that the solve follows; a finer one is sampled evenly
SAME_POINT_M = 1e-6  # points of a path that are nearer to each other count as one


class Travelled(msgspec.Struct, frozen=True):
    """Travel to a place, or along a path.

    Attributes:
        place: where the movement ends, x and z, metres.
        facing: where it faces there, degrees to the left of the audience.
        distance: distance from the requested place, metres.
        degrees: angle from the requested facing.
        length: length of the path from A, metres.
        off: greatest distance from the path, or of a point of the path from the body's own, metres; null if none was
            drawn.
        seconds: when, from the start.
    """

    place: tuple[float, float]
    facing: float
    distance: float
    degrees: float
    length: float
    off: float | None
    seconds: float | None

    @property
    def is_met(self) -> bool:
        """Whether it comes to the place, and keeps to the path, within NEAR_PATH_M."""
        return self.distance <= NEAR_PATH_M and self.degrees <= TURNED_DEG and (self.off or 0.0) <= NEAR_PATH_M

    def __str__(self) -> str:
        """Return the travel in words."""
        x, z = (round(value, 2) + 0.0 for value in self.place)
        words = f"{self.length:.1f} m to {x:g}, {z:g} m, facing {round(self.facing) + 0:g} degrees"
        if self.distance > NEAR_PATH_M or self.degrees > TURNED_DEG:
            words += f": {100.0 * self.distance:.0f} cm and {self.degrees:.0f} degrees from there"
        return words if self.off is None else f"{words}; up to {100.0 * self.off:.0f} cm off the path"


def stand_at(posture: Posture, to: Sequence[float]) -> tuple[Posture, Floats]:
    """Return a posture at a place on the floor, and the rotation [4] that turns it there.

    Args:
        posture: the posture; its height stays.
        to: x and z, metres, and its facing, degrees to the left of the audience; without one it faces as it does.
    """
    x, z = to[:2]
    turn = np.radians(to[2]) - rot.heading(posture.rotations[0]) if len(to) > 2 else 0.0
    turned, rotations = rot.about_vertical(np.asarray(turn)), posture.rotations.copy()
    rotations[0] = rot.mul(turned, rotations[0])
    return replace(posture, rotations=rotations, root=np.array([x, posture.root[1], z])), turned


def destination(to: Sequence[float] | None, along: Sequence[Sequence[float]] | None) -> Sequence[float] | None:
    """Return where B stands: the place of the request, or the end of the path; None for where it stands already."""
    return to if to is not None or along is None or is_timed(along) else along[-1]


def course_between(a: Posture, b: Posture, along: Sequence[Sequence[float]] | None, length: float) -> Course | None:
    """Return the course from A by the timed points of a path to B in `length` seconds; None for points without times.

    Facings turn the shorter way from each to the next.
    """
    if along is None or not is_timed(along):
        return None
    points = np.asarray(along, dtype=np.float64)
    headings = [rot.heading(a.rotations[0]), *np.radians(points[:, 3]), rot.heading(b.rotations[0])]
    places = np.concatenate([a.root[None, [0, 2]], points[:, :2], b.root[None, [0, 2]]])
    return Course(np.array([0.0, *points[:, 2], length]), places, np.unwrap(headings))


def route_between(a: Posture, b: Posture, along: Sequence[Sequence[float]] | None) -> Floats | None:
    """Return the path from A by the drawn points to B [P, 2], metres, each point once; None if none is drawn."""
    if along is None:
        return None
    points = np.array([a.root[[0, 2]], *(point[:2] for point in along), b.root[[0, 2]]], dtype=np.float64)
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1) > SAME_POINT_M
    kept = points[np.concatenate([[True], apart])]
    if len(kept) > MAX_ROUTE_POINTS:
        return places_along(kept, np.linspace(0.0, 1.0, MAX_ROUTE_POINTS))
    return kept if len(kept) > 1 else np.repeat(kept, 2, axis=0)


def find_travelled(
    motion: Motion, to: Sequence[float] | None, along: Sequence[Sequence[float]] | None, route: Floats | None
) -> Travelled | None:
    """Measure how near a motion keeps to its path and its place; None if neither was requested."""
    if to is None and along is None:
        return None
    wanted = destination(to, along) or motion.root[-1, [0, 2]].tolist()
    path, facing = motion.root[:, [0, 2]], float(np.degrees(rot.heading(motion.rotations[-1, 0])))
    turned = wanted[2] - facing if len(wanted) > 2 else 0.0
    off, seconds = None, None
    if along is not None and is_timed(along):
        points = np.asarray(along, dtype=np.float64)
        far = np.linalg.norm(motion.at(points[:, 2]).root[:, [0, 2]] - points[:, :2], axis=1)
        off, seconds = float(far.max()), float(points[int(far.argmax()), 2])
    elif route is not None:
        far = np.linalg.norm(offsets_to(route, path), axis=1)
        frame, off = int(far.argmax()), float(far.max())
        missed = places_along(route, np.linspace(0.0, 1.0, MAX_ROUTE_POINTS))
        short = np.linalg.norm(offsets_to(path, missed), axis=1) if len(path) > 1 else np.zeros(1)
        if short.max() > off:  # a part of the path that the body leaves out
            off = float(short.max())
            frame = int(np.linalg.norm(path - missed[int(short.argmax())], axis=1).argmin())
        seconds = float(motion.times[frame] - motion.times[0])
    x, z = map(float, path[-1])
    return Travelled(
        (x, z),
        facing,
        float(np.hypot(x - wanted[0], z - wanted[1])),
        abs(float(np.degrees(np.angle(np.exp(1j * np.radians(turned)))))),
        length_of(path[[0, -1]] if route is None else route),
        off,
        seconds,
    )
