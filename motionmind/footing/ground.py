"""Setting a movement on the floor: who bears the body and where, the root's trajectory, and legs that reach the floor.

Rotations come from the mean of walks; where the body is follows from what bears it. Each foot gets *stances*, with
places on the floor (`motionmind.footing.footfalls`). The root is carried by what bears, smoothly, and so that its
weight stays over the support (`motionmind.footing.root`). The legs then reach for the places
(`motionmind.footing.feet`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import Posed, lowest_height, pose
from motionmind.body.limits import within_limits
from motionmind.body.skeleton import Skeleton, remembered
from motionmind.body.support import size_of
from motionmind.footing.balance import GRAVITY
from motionmind.footing.carrying import Allowed, Carried, Ends, carry, foot_heights
from motionmind.footing.corrections import Correction
from motionmind.footing.departures import fade_at_ends
from motionmind.footing.feet import (
    Foot,
    bend_legs,
    ease_knees,
    find_free_feet,
    softness,
)
from motionmind.footing.flight import EVER, SURELY
from motionmind.footing.knees import cover
from motionmind.footing.root import root_trajectory, stand, steps_easily
from motionmind.geometry.splines import natural_spline
from motionmind.walks.minimal import departure

SPREADS = 0.03, 0.04  # metres, standard deviation: how high walks are that stand at a given posture, and that are aloft
LEAPS = 0.18  # metres above those that stand from which it is in the air, though no walk is
UNEVEN = 0.015  # metres by which feet that stand are above the floor of a recording
SINKS = 0.003  # metres by which a part may be under the floor, but for rounding


class Stance(NamedTuple):
    """The stance of a corpus's bodies, and their travel, along a movement, at its T moves and midway between them.

    Attributes:
        half_steps: times [2 T + 1], seconds.
        clearance: height of the lowest point above the floor [2 T + 1], metres.
        trust: how far that is to be trusted, and not the way from one given height to the next [2 T + 1], from 0 to 1.
        stands: how firmly each limb, and last the trunk, stands where it is low [2 T + 1, limbs + 1], from 0 to 1.
        aloft: share of them that are in the air [2 T + 1], from 0 to 1.
        leaps: height of their lowest points above the floor there [2 T + 1], metres.
        drift: their displacement in each half step [2 T, 3], metres.
        overhang: how far beyond its support the centre of mass may be, metres.
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
        """Return the same of a body of another size."""
        lengths = ("clearance", "leaps", "drift", "overhang")
        return self._replace(**{name: by * getattr(self, name) for name in lengths})


class Given(NamedTuple):
    """The given postures of a movement, by their heights, and its two ends.

    Attributes:
        low: height of the lowest point above 0 of the given postures, metres, by the number of moves that lead there;
            with the first and the last.
        ends: the first and the last position of the root [3], metres.
        rates: its first and its last velocity [3], metres a second; None where unknown.
    """

    low: Mapping[int, float]
    ends: tuple[Floats, Floats]
    rates: tuple[Floats | None, Floats | None]

    def scaled(self, by: float) -> Given:
        """Return the same of a body of another size."""
        first, last = self.rates
        return Given(
            {move: by * height for move, height in self.low.items()},
            (by * self.ends[0], by * self.ends[1]),
            (None if first is None else by * first, None if last is None else by * last),
        )


def ends_in_air(stance: Stance, low: Mapping[int, float], size: float) -> tuple[Bools, Floats]:
    """Return whether the first and the last posture of a body are in the air [2], and how high they are [2], metres.

    Args:
        stance: how the corpus's bodies hold themselves along its movement; no matter in how much time.
        low: height of the lowest point above 0 of the given postures, metres, as of `Given`.
        size: of the body (`motionmind.body.support.size_of`).
    """
    small, ends = stance.scaled(1.0 / size), _of_ends(low) / size
    hovering = _hovering(small, ends)
    floor = _floor_under(stance.half_steps, small.clearance, ends, hovering)
    return hovering, size * (ends - floor[[0, -1]])


def _of_ends(low: Mapping[int, float]) -> Floats:
    """Return the heights of the first and of the last posture [2], of all that are given."""
    first, *_, last = low.values()
    return np.array([first, last])


def floors_at_ends(stance: Stance, low: Mapping[int, float], size: float) -> tuple[float, float]:
    """Return the heights of the floor under the first and the last posture, metres; see `ends_in_air`."""
    first, last = _of_ends(low) - ends_in_air(stance, low, size)[1]
    return float(first), float(last)


def set_on_floor(
    skeleton: Skeleton,
    rotations: Floats,
    plain: Floats,
    times: Floats,
    stance: Stance,
    given: Given,
    allowed: Allowed,
    without: Collection[Correction] = (),
) -> tuple[Floats, Floats]:
    """Return a movement that its feet carry: local rotations [N, J, 4] and positions of the root [N, 3], metres.

    Bodies of all sizes are set down as one as large as a person, on whom the constants were chosen.

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        plain: the same without fine detail, by which feet find their places.
        times: of the frames [N], seconds.
        stance: how the corpus's bodies hold themselves and travel along it.
        given: its ends, and how high the given postures are.
        allowed: what it may change, and how fast it may be.
        without: corrections to leave out.
    """
    size = size_of(skeleton)
    by = 1.0 / size
    turned, root = _set_down(
        _as_large_as_a_person(skeleton),
        rotations,
        plain,
        times,
        stance.scaled(by),
        given.scaled(by),
        allowed.scaled(by),
        GRAVITY / size,
        without,
    )
    root *= size
    root[0], root[-1] = given.ends
    return turned, root


@remembered
def _as_large_as_a_person(skeleton: Skeleton) -> Skeleton:
    """Return a body of the same proportions."""
    size = size_of(skeleton)
    return replace(skeleton, offsets=skeleton.offsets / size, tips=skeleton.tips / size)


def _set_down(
    skeleton: Skeleton,
    rotations: Floats,
    plain: Floats,
    times: Floats,
    stance: Stance,
    given: Given,
    allowed: Allowed,
    gravity: float,
    without: Collection[Correction],
) -> tuple[Floats, Floats]:
    """Return what `set_on_floor` does, of a body as large as a person, where gravity is as given."""
    half_steps, through, rates = stance.half_steps, 2 * np.array(list(given.low)), given.rates
    lows = _of_ends(given.low)
    hovering = _hovering(stance, lows)
    aloft = stance.aloft.copy()
    aloft[[0, -1]] = np.where(hovering, 1.0, aloft[[0, -1]])
    under = _floor_under(half_steps, stance.clearance, lows, hovering)
    at_half_steps = stance.clearance + under
    evenly = np.interp(half_steps, half_steps[through], list(given.low.values()))
    at_half_steps = evenly + stance.trust * (at_half_steps - evenly)
    at_half_steps[through] = evenly[through]
    heights, floor = _eased(half_steps, at_half_steps, times), np.interp(times, half_steps, under)
    places = np.concatenate([np.zeros((1, 3)), np.cumsum(stance.drift, axis=0)])
    middles = 0.5 * (times[1:] + times[:-1])
    held = np.stack([np.interp(middles, half_steps, limb) for limb in stance.stands.T], axis=1)
    drifts = np.diff(natural_spline(half_steps, places, times), axis=0)
    clear = np.maximum(heights - floor, 0.0)
    fps, feet = 1.0 / (times[1] - times[0]), find_free_feet(skeleton, allowed.fixed)
    posed, fine = pose(skeleton, rotations), not np.array_equal(plain, rotations)
    smooth = pose(skeleton, plain) if fine else posed
    easily = steps_easily(foot_heights(skeleton, posed, feet), fps)
    root = root_trajectory(skeleton, posed, clear, held, drifts, *given.ends, times[-1], easily)
    root = stand(skeleton, rotations, _with_rates(root, times, rates), heights)
    root[0], root[-1] = given.ends
    first, last = rates  # what is in the air goes on as it goes; elsewhere what stands says how high it is
    fallen = 0.5 * gravity / fps**2
    if hovering[0] and first is not None:
        root[1, 1] = root[0, 1] + first[1] / fps - fallen
    if hovering[1] and last is not None:
        root[-2, 1] = root[-1, 1] - last[1] / fps - fallen
    firm = np.stack([np.interp(times, half_steps, limb) for limb in stance.stands.T], axis=1)
    aloft, leaps = (np.interp(times, half_steps, one) for one in (aloft, stance.leaps))
    frames, rotations = fps * half_steps[through], rotations.copy()
    for number, (start, end) in enumerate(pairwise(frames)):
        # Rounded: a posture that falls on a frame but for rounding errors keeps that frame.
        part = slice(int(np.ceil(start - 1e-6)), int(end + 1e-6) + 1)
        if part.stop - part.start < 3:
            continue
        rate = rates[0] if number == 0 else None, rates[1] if number == len(frames) - 2 else None
        known = Ends(
            aloft[part],
            leaps[part],
            (rate[0] is not None, rate[1] is not None),
            (number > 0 or rate[0] is not None, number < len(frames) - 2 or rate[1] is not None),
            (None if rate[0] is None else float(rate[0][1]), None if rate[1] is None else float(rate[1][1])),
        )
        own = posed.part(part)
        carried = carry(
            skeleton,
            own,
            smooth.part(part) if fine else own,
            root[part],
            floor[part],
            firm[part],
            feet,
            known,
            stance.overhang,
            allowed,
            gravity,
            fps,
            without,
        )
        rotations[part], root[part] = _reach_floor(
            skeleton, own, carried, floor[part], feet, allowed, fine, known.moving, fps
        )
        sunk = np.maximum(floor[part] - lowest_height(skeleton, rotations[part], root[part]) - SINKS, 0.0)
        root[part, 1] += cover(sunk, fps) * fade_at_ends(len(sunk), (True, True), fps)
    return rotations, root


def _reach_floor(
    skeleton: Skeleton,
    posed: Posed,
    carried: Carried,
    floor: Floats,
    feet: list[Foot],
    allowed: Allowed,
    fine: bool,
    moving: tuple[bool, bool],
    fps: float,
) -> tuple[Floats, Floats]:
    """Return rotations whose legs are where they should be, within their limits, and the root.

    A foot that the limits of its joints turn is lifted or lowered by as much as that takes it off its height. Knees
    bend no faster than they can, and with the movement's own fine detail.
    """
    rotations, soft = posed.rotations, softness(carried.holds)
    joints, fades = [joint for foot in feet for joint in foot.leg], fade_at_ends(len(rotations), moving, fps)
    out, root = rotations.copy(), carried.root
    if not joints:
        return out, root
    planted = bend_legs(skeleton, posed, feet, carried.off, soft)
    out[1:-1, joints] = within_limits(skeleton, planted, rotations[[0, -1]], allowed.loose, joints)[1:-1, joints]
    missing = carried.heights - foot_heights(skeleton, pose(skeleton, out, root), feet)
    off = carried.off + missing[..., None] * np.array([0.0, 1.0, 0.0]) * fades[:, None, None]
    room = carried.heights - floor[:, None] + SINKS
    eased, shift = ease_knees(
        skeleton,
        posed,
        feet,
        off,
        carried.holds,
        fades * carried.bound,
        room,
        fine,
        carried.staying,
        moving,
        allowed.fastest,
        fps,
    )
    planted = bend_legs(skeleton, posed, feet, eased, np.zeros(soft.shape))
    out[1:-1, joints] = within_limits(skeleton, planted, rotations[[0, -1]], allowed.loose, joints)[1:-1, joints]
    return out, root + shift


def _with_rates(root: Floats, times: Floats, rates: tuple[Floats | None, Floats | None]) -> Floats:
    """Return positions of the root [N, 3] that leave the first and arrive at the last with the given level velocities.

    Feet that stand near an end do not know how the body passes it, and may carry it elsewhere.
    """
    steps, level = np.diff(root, axis=0) / (times[1] - times[0]), np.array([1.0, 0.0, 1.0])
    first, last = (
        None if rate is None else level * (rate - step) for rate, step in zip(rates, steps[[0, -1]], strict=True)
    )
    return np.asarray(root + departure(times, first, last))


def _hovering(stance: Stance, ends: Floats) -> Bools:
    """Return whether the first and the last posture are in the air [2], from their lowest points' heights [2], metres.

    They are where most walks are in the air; and where some are, and by its height above the floor under the other end
    it is likelier one of these than one of those that stand: in the crouch of a jump much of a corpus stands. And they
    are where they are higher than any step.
    """
    aloft, leaps, clearance = stance.aloft[[0, -1]], stance.leaps[[0, -1]], stance.clearance[[0, -1]]
    surely = aloft > SURELY
    standing = np.maximum(clearance - aloft * leaps, 0.0) / np.maximum(1.0 - aloft, 1e-9)
    floor = np.where(surely, np.minimum(ends, 0.0), np.maximum(np.minimum(ends, 0.0), ends - clearance))[::-1]
    taller, lower = ends - floor - standing, leaps - (ends - floor)
    stands = (1.0 - aloft) / SPREADS[0] * np.exp(-0.5 * (np.maximum(taller, 0.0) / SPREADS[0]) ** 2)
    flies = aloft / SPREADS[1] * np.exp(-0.5 * (np.maximum(lower, 0.0) / SPREADS[1]) ** 2)
    as_high = (flies > stands) & (taller > np.abs(lower))  # what is far from both may be on a floor of its own
    return np.asarray(surely | ((aloft > EVER) & as_high) | (taller > LEAPS))


def _floor_under(half_steps: Floats, clearance: Floats, ends: Floats, hovering: Bools) -> Floats:
    """Return the floor's height at the half steps [2 T + 1], metres: 0, or as the `ends`' lowest points [2] show.

    A recording's own zero is often off: where an end is below 0 so is its floor, and where it is higher than bodies
    that stand so are in the corpus, its floor is higher. What these have their feet above the floor, up to UNEVEN, is
    the floor's too: a body that stands there would sink as it leaves the end. An end in the air, `hovering` [2], shows
    nothing of its floor, which is then the other's.
    """
    above = np.maximum(np.minimum(ends, 0.0), ends - np.maximum(clearance[[0, -1]] - UNEVEN, 0.0))
    above = np.where(hovering, np.minimum(ends, 0.0 if hovering.all() else above[::-1]), above)
    return np.asarray(np.interp(half_steps, half_steps[[0, -1]], above))


def _eased(times: Floats, values: Floats, at: Floats) -> Floats:
    """Return values [N] that pass through keys without overshoot: a cubic ease in and out on each piece."""
    i = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    s = (at - times[i]) / (times[i + 1] - times[i])
    return np.asarray(values[i] + (values[i + 1] - values[i]) * s * s * (3.0 - 2.0 * s))
