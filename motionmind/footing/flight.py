"""Flights: intervals in the air, in which the centre of mass falls freely.

A flight of height H lasts 2 sqrt(2 H / g). The body passes a given posture in the air at the top of its flight, unless
the posture has a velocity. Before take-off and after landing the body's height is free: least squares of its
acceleration bend the legs as deeply as the push needs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import STANCE_HEIGHT_M, Posed
from motionmind.body.plausibility import FALLING_RATIO, GRAVITY_MPS2
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import mass_of, size_of
from motionmind.body.tempo import runs_of

FLIGHT_CERTAIN_SHARE = 0.5  # of corpus walks in the air, above which a given posture is in the air
FLIGHT_POSSIBLE_SHARE = 0.05  # the same, above which a movement may be in the air
SHORTEST_PUSH_OFF_S = 0.25  # or landing


class Flight(NamedTuple):
    """An interval in the air, from the last frame on the floor before it to the first after it.

    A flight that begins or ends in a given posture has that frame instead.

    Attributes:
        start: first frame.
        end: last frame.
        rates: vertical velocities at both, m/s; None on the floor, or if unknown.
    """

    start: int
    end: int
    rates: tuple[float | None, float | None]


def find_flights(
    aloft: Floats,
    leaps: Floats,
    standing: Floats,
    masses: Floats,
    hovering: tuple[bool, bool],
    rates: tuple[float | None, float | None],
    gravity: float,
    fps: float,
) -> list[Flight]:
    """Return the flights of a movement, in order.

    Args:
        aloft: share of the corpus walks that are in the air [N], 0 to 1.
        leaps: height of their lowest points above the floor there [N], metres.
        standing: height of the centre of mass if the lowest point were on the floor [N], metres.
        masses: its height in the first and in the last frame [2], metres.
        hovering: whether the first and the last posture are in the air.
        rates: its vertical velocities there, m/s; None where unknown.
        gravity: m/s^2.
        fps: frames a second.
    """
    last = len(aloft) - 1
    lands, rises = 0, last
    first = second = None
    push = SHORTEST_PUSH_OFF_S * fps
    if hovering[0]:
        lands, rate = _time_of_fall(
            standing, masses[0], None if rates[0] is None else -rates[0], last - push, gravity, fps
        )
        first = Flight(0, lands, (-rate, None))
    if hovering[1]:
        back, rate = _time_of_fall(standing[::-1], masses[1], rates[1], last - push, gravity, fps)
        rises = last - back
        second = Flight(rises, last, (None, rate))
    if first and second and lands + push > rises:
        return [Flight(0, last, (None, None))]
    out = [first] if first else []
    begin, end = lands + push, rises - push
    for start, stop in runs_of(aloft > FLIGHT_POSSIBLE_SHARE):
        if (start == 0 and hovering[0]) or (stop > last and hovering[1]):
            continue
        share, frames = aloft[start:stop], np.arange(start, stop)
        height = float(share @ leaps[start:stop] / share.sum())
        seconds = min(2.0 * np.sqrt(2.0 * height / gravity), 0.8)  # no longer flight
        # Walks jump at different times: this is the expected number of flights in this interval.
        count = round(share.sum() / (seconds * fps))
        middles = np.interp((np.arange(count) + 0.5) / max(count, 1), np.cumsum(share) / share.sum(), frames)
        for middle in middles:
            half = min(0.5 * seconds * fps, 0.5 * (end - begin))
            top = float(np.clip(middle, begin + half, max(end - half, begin + half)))
            # The inner rounding keeps rounding errors from deciding ties midway between two frames.
            flight = Flight(round(round(top - half, 6)), round(round(top + half, 6)), (None, None))
            # No flight is shorter than 0.15 s.
            if half >= 0.5 * 0.15 * fps and flight.end - flight.start > 2:
                out.append(flight)
                begin = flight.end + push
    return [*out, second] if second else out


def _time_of_fall(
    standing: Floats, mass: float, rate: float | None, longest: float, gravity: float, fps: float
) -> tuple[int, float]:
    """Return the number of frames since take-off of a body in the air, and its upward velocity now, m/s.

    Args:
        standing: height of the centre of mass if the body stood [N], metres, backwards from the frame in the air.
        mass: its height in the air, metres.
        rate: its upward velocity there, m/s; None for the top of the flight, or as near it as the time and a take-off
            in a whole frame allow.
        longest: maximum number of frames.
        gravity: m/s^2.
        fps: frames a second.
    """
    seconds = np.arange(len(standing)) / fps
    free = rate is None
    if rate is None:
        rise = max(mass - float(standing.min()), 0.01)
        most = max(longest, 2.0) / fps
        rate = max(rise / most - 0.5 * gravity * most, 0.0)
    below = np.flatnonzero(mass - rate * seconds[1:] - 0.5 * gravity * seconds[1:] ** 2 <= standing[1:])
    if not len(below):
        return len(standing) - 1, rate
    first = int(below[0]) + 1
    if not free:
        return first, rate
    # Take off in a whole frame: of the two around that time, the one whose velocity is nearer.
    either = [max(first - 1, 1), first]
    rates = (mass - standing[either]) / seconds[either] - 0.5 * gravity * seconds[either]
    nearest = int(np.abs(rates - rate).argmin())
    # Too near the floor, or over a much higher posture, no whole frame fits.
    if abs(rates[nearest] - rate) > gravity / fps:
        return first, rate
    return int(either[nearest]), float(rates[nearest])


def flying_frames(flights: list[Flight], hovering: tuple[bool, bool], count: int) -> Bools:
    """Return whether nothing supports the body in each frame [count]; `hovering` gives the first and the last frame."""
    out = np.zeros(count, dtype=np.bool_)
    for flight in flights:
        out[flight.start + 1 : flight.end] = True
    if flights:
        out[[0, -1]] = hovering
    return out


def find_falls(skeleton: Skeleton, posed: Posed, given: Bools, fps: float) -> tuple[Floats, list[tuple[int, int]]]:
    """Return the centre of mass [N, 3], metres, and the falls: the first frame of each and the frame after its last.

    Without known masses there are no falls, and the root stands in for the centre of mass.

    Args:
        skeleton: the body.
        posed: the movement.
        given: frames that must not change, the first and the last among them [N].
        fps: frames a second.
    """
    low = posed.lowest
    off_floor = low > low.min() + STANCE_HEIGHT_M * size_of(skeleton)
    up = ~given & off_floor
    mass = mass_of(skeleton, posed) if up.any() else None
    if mass is None:
        return posed.places[:, 0], []
    fall = np.zeros(len(low))
    fall[1:-1] = -(fps**2) * np.diff(mass[:, 1], 2) / GRAVITY_MPS2
    # A fall may be slower for 0.1 s, as when the legs draw up.
    return mass, _falls(fall, up, (bool(off_floor[0]), bool(off_floor[-1])), round(0.1 * fps))


def _falls(fall: Floats, up: Bools, in_air: tuple[bool, bool], pauses: int) -> list[tuple[int, int]]:
    """Return the first frame of each fall and the frame after its last.

    A pause, a slower part of a fall, lies between two falls, or between a fall and an end in the air.

    Args:
        fall: downward acceleration of the centre of mass [N], in units of gravity.
        up: whether the body is off the floor in a frame that may change [N].
        in_air: whether it is off the floor in the first and in the last frame, which may not change.
        pauses: largest number of frames in a pause.
    """
    fast = up & (fall > FALLING_RATIO)
    whole = fast.copy()
    for start, stop in runs_of(~fast):
        inner = slice(max(start, 1), min(stop, len(fast) - 1))
        between = (start > 0 or in_air[0]) and (stop < len(fast) or in_air[1])
        if between and inner.stop - inner.start <= pauses:
            whole[inner] = np.all(up[inner] & (fall[inner] > -FALLING_RATIO))
    out = []
    for start, stop in runs_of(whole):
        # A trembling body falls no faster than that on average: then pauses separate its falls.
        parts = [(0, stop - start)] if fall[start:stop].mean() > FALLING_RATIO else runs_of(fast[start:stop])
        out += [(start + first, start + last) for first, last in parts if last - first > 1]
    return out
