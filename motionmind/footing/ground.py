"""The ground under a movement: its floor, which ends are in the air, and where the feet alone put the root."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import Posed
from motionmind.body.skeleton import Skeleton
from motionmind.footing.course import Course
from motionmind.footing.feet import Foot
from motionmind.footing.flight import FLIGHT_CERTAIN_SHARE, FLIGHT_POSSIBLE_SHARE
from motionmind.footing.root import root_trajectory, stand, steps_easily
from motionmind.footing.shape import lowest, points_of_feet
from motionmind.geometry.splines import natural_spline
from motionmind.walks.minimal import departure


class Stance(NamedTuple):
    """Stance and travel of a corpus's bodies along a movement, at its T moves and midway between them.

    Attributes:
        half_steps: times [2 T + 1], seconds.
        clearance: height of the lowest point above the floor [2 T + 1], metres.
        trust: weight of that against interpolation between the given heights [2 T + 1], 0 to 1.
        stands: firmness of each limb, and last of the trunk, where it is low [2 T + 1, limbs + 1], 0 to 1.
        aloft: share of bodies in the air [2 T + 1], 0 to 1.
        leaps: height of their lowest points above the floor [2 T + 1], metres.
        drift: displacement in each half step [2 T, 3], metres.
        overhang: allowed distance of the centre of mass from the support, metres.
    """

    half_steps: Floats
    clearance: Floats
    trust: Floats
    stands: Floats
    aloft: Floats
    leaps: Floats
    drift: Floats
    overhang: float

    def scaled(self, by: float) -> Stance:
        """Return the stance for a body `by` times as large."""
        lengths = ("clearance", "leaps", "drift", "overhang")
        return self._replace(**{name: by * getattr(self, name) for name in lengths})


class Given(NamedTuple):
    """The heights of the given postures of a movement, and its two ends.

    Attributes:
        low: height of the lowest point above 0 of the given postures, metres, by the number of moves that lead there;
            with the first and the last.
        ends: the first and the last position of the root [3], metres.
        rates: its first and its last velocity [3], m/s; None where unknown.
        route: points x, z of the path that the root follows over the floor from the first end to the last [P, 2],
            metres; None for any path.
        course: where it is at which time, in place of a route; None for any.
    """

    low: Mapping[int, float]
    ends: tuple[Floats, Floats]
    rates: tuple[Floats | None, Floats | None]
    route: Floats | None = None
    course: Course | None = None

    def scaled(self, by: float) -> Given:
        """Return the same for a body `by` times as large."""
        first, last = self.rates
        return Given(
            {move: by * height for move, height in self.low.items()},
            (by * self.ends[0], by * self.ends[1]),
            (None if first is None else by * first, None if last is None else by * last),
            None if self.route is None else by * self.route,
            self.course and self.course.scaled(by),
        )


def ends_in_air(stance: Stance, low: Mapping[int, float], size: float) -> tuple[Bools, Floats]:
    """Return whether the first and the last posture are in the air [2], and their heights above the floor [2], metres.

    Args:
        stance: stances of the corpus's bodies along the movement, on any clock.
        low: heights of the given postures, metres, as in `Given`.
        size: size of the body (`motionmind.body.support.size_of`).
    """
    small, ends = stance.scaled(1.0 / size), _of_ends(low) / size
    hovering = _hovering(small, ends)
    floor = _floor_under(stance.half_steps, small.clearance, ends, hovering)
    return hovering, size * (ends - floor[[0, -1]])


def _of_ends(low: Mapping[int, float]) -> Floats:
    """Return the heights of the first and the last of the given postures [2]."""
    first, *_, last = low.values()
    return np.array([first, last])


class Ground(NamedTuple):
    """The ground under each of N frames.

    Attributes:
        root: positions at which the feet alone put the root [N, 3], metres.
        floor: height of the floor [N], metres.
        firm: firmness of each limb, and last of the trunk, where it is low [N, limbs + 1], 0 to 1.
        aloft: share of the corpus walks that are in the air [N], 0 to 1.
        leaps: height of their lowest points above the floor there [N], metres.
    """

    root: Floats
    floor: Floats
    firm: Floats
    aloft: Floats
    leaps: Floats

    def part(self, frames: slice) -> Ground:
        """Return the ground of a slice of the frames."""
        return Ground(*(known[frames] for known in self))


class Stretch(NamedTuple):
    """A movement of N frames between two given postures.

    Attributes:
        frames: slice of the whole movement.
        posed: the movement relative to its root.
        ground: the ground under it.
        moving: whether the velocity is given at the first and at the last frame; if not, low feet rest there.
        passing: whether the body passes these frames at any velocity; if not, a foot in the air there takes its time.
        rates: vertical velocities of the root there, m/s; None where unknown.
    """

    frames: slice
    posed: Posed
    ground: Ground
    moving: tuple[bool, bool]
    passing: tuple[bool, bool]
    rates: tuple[float | None, float | None]


def find_ground(
    skeleton: Skeleton, posed: Posed, times: Floats, stance: Stance, given: Given, feet: list[Foot], gravity: float
) -> Ground:
    """Find the ground under a movement of a body the size of a person.

    Args:
        skeleton: the body.
        posed: the movement relative to its root, of N frames.
        times: times of the frames [N], seconds.
        stance: stance and travel of the corpus's bodies along it.
        given: its ends, and the heights of the given postures.
        feet: feet that may be placed.
        gravity: m/s^2.
    """
    half_steps, through, fps = stance.half_steps, 2 * np.array(list(given.low)), 1.0 / (times[1] - times[0])
    lows = _of_ends(given.low)
    hovering = _hovering(stance, lows)
    under = _floor_under(half_steps, stance.clearance, lows, hovering)
    evenly = np.interp(half_steps, half_steps[through], list(given.low.values()))
    high = evenly + stance.trust * (stance.clearance + under - evenly)
    high[through] = evenly[through]
    heights, floor = _eased(half_steps, high, times), np.interp(times, half_steps, under)
    places = np.concatenate([np.zeros((1, 3)), np.cumsum(stance.drift, axis=0)])
    drifts = np.diff(natural_spline(half_steps, places, times), axis=0)
    held = _at(0.5 * (times[1:] + times[:-1]), half_steps, stance.stands)
    easily = steps_easily(lowest(posed.places, points_of_feet(skeleton, posed.joints, feet)), fps)
    clear = np.maximum(heights - floor, 0.0)
    way = given.route, given.course
    root = root_trajectory(skeleton, posed, clear, held, drifts, given.ends, times[-1], easily, *way)
    root = stand(skeleton, posed.rotations, _with_rates(root, times, given.rates), heights)
    root[0], root[-1] = given.ends
    for end, beside, sign in ((0, 1, 1.0), (-1, -2, -1.0)):  # a body in the air keeps its velocity
        rate = given.rates[end]
        if hovering[end] and rate is not None:
            root[beside, 1] = root[end, 1] + sign * rate[1] / fps - 0.5 * gravity / fps**2
    aloft = stance.aloft.copy()
    aloft[[0, -1]] = np.where(hovering, 1.0, aloft[[0, -1]])
    firm, air = _at(times, half_steps, stance.stands), _at(times, half_steps, np.stack([aloft, stance.leaps], axis=1))
    return Ground(root, floor, firm, air[:, 0], air[:, 1])


def _at(times: Floats, known: Floats, values: Floats) -> Floats:
    """Interpolate values [K, M] at K times linearly at others [N, M]."""
    return np.stack([np.interp(times, known, column) for column in values.T], axis=1)


def _with_rates(root: Floats, times: Floats, rates: tuple[Floats | None, Floats | None]) -> Floats:
    """Return positions of the root [N, 3] with the given level velocities at both ends.

    Feet in stance near an end do not determine how the body passes it.
    """
    steps, level = np.diff(root, axis=0) / (times[1] - times[0]), np.array([1.0, 0.0, 1.0])
    first, last = (
        None if rate is None else level * (rate - step) for rate, step in zip(rates, steps[[0, -1]], strict=True)
    )
    return np.asarray(root + departure(times, first, last))


def _hovering(stance: Stance, ends: Floats) -> Bools:
    """Return whether the first and the last posture are in the air [2], from their lowest points' heights [2], metres.

    A posture is in the air if most corpus walks are there, or if it is higher than any step. Much of a corpus stands
    in the crouch of a jump, so a posture is also in the air if some walks are there and its height above the floor
    under the other end makes flight likelier than stance.
    """
    aloft, leaps, clearance = stance.aloft[[0, -1]], stance.leaps[[0, -1]], stance.clearance[[0, -1]]
    surely = aloft > FLIGHT_CERTAIN_SHARE
    standing = np.maximum(clearance - aloft * leaps, 0.0) / np.maximum(1.0 - aloft, 1e-9)
    floor = np.where(surely, np.minimum(ends, 0.0), np.maximum(np.minimum(ends, 0.0), ends - clearance))[::-1]
    taller, lower = ends - floor - standing, leaps - (ends - floor)
    stance_sd, flight_sd, leap = 0.03, 0.04, 0.18  # m: of walks' heights; and the least height of an unseen leap
    stands = (1.0 - aloft) / stance_sd * np.exp(-0.5 * (np.maximum(taller, 0.0) / stance_sd) ** 2)
    flies = aloft / flight_sd * np.exp(-0.5 * (np.maximum(lower, 0.0) / flight_sd) ** 2)
    as_high = (flies > stands) & (taller > np.abs(lower))  # a posture far from both may be on a floor of its own
    return np.asarray(surely | ((aloft > FLIGHT_POSSIBLE_SHARE) & as_high) | (taller > leap))


def _floor_under(half_steps: Floats, clearance: Floats, ends: Floats, hovering: Bools) -> Floats:
    """Return the floor's height at the half steps [2 T + 1], metres: 0, or as the `ends`' lowest points [2] show.

    A recording's own zero is often off. An end below 0 has a floor as low; an end higher than the corpus's bodies in
    such a stance has a higher floor. That floor includes up to 0.015 m of the height of their feet above it, or a body
    would sink as it leaves the end. An end in the air (`hovering` [2]) does not show its floor and takes the other's.
    """
    above = np.maximum(np.minimum(ends, 0.0), ends - np.maximum(clearance[[0, -1]] - 0.015, 0.0))
    above = np.where(hovering, np.minimum(ends, 0.0 if hovering.all() else above[::-1]), above)
    return np.asarray(np.interp(half_steps, half_steps[[0, -1]], above))


def _eased(times: Floats, values: Floats, at: Floats) -> Floats:
    """Interpolate keys [N] without overshoot: ease in and out of each with a cubic."""
    i = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    s = (at - times[i]) / (times[i + 1] - times[i])
    return np.asarray(values[i] + (values[i + 1] - values[i]) * s * s * (3.0 - 2.0 * s))
