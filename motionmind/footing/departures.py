"""Departures of feet from the tracks that the movement has them on: into their places, and smoothly over the floor."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.footing.footfalls import Stance
from motionmind.footing.knees import cover
from motionmind.footing.least_squares import factorise, substitute
from motionmind.geometry import rotations as rot
from motionmind.jit import jit

SETTLES = 0.3  # seconds in which a foot that hovers where it is given comes down to the floor
FADES = 0.15  # seconds in which a foot that passes an end, with a velocity of its own, comes to its place
BENDS = 0.25  # seconds in which a departure of a swinging foot from the movement's own track begins and ends
SLIDES = 1.85  # seconds: how much a foot that is low in a step is kept from sliding, beside its smoothness
RISES = 0.33  # share of a step in which it lifts the foot, and in which it lowers it
LIFT = 0.105  # metres to which a step lifts a foot that the movement does not lift; chosen on cmu-05 and cmu-16
FLICKS = 1.7, 12.0  # times as fast as the corpus's knees, and radians a second, at which a step bends a knee at most
NEAREST = 0.4  # of a leg's length: this near to its hip a foot swings past it
PUSHES = 2.0  # metres a second by which a foot is kept away from its hip, beside where it stands
FAR = 0.3  # metres that a foot must go to be lifted so far


def departure(
    places: Floats,
    track: Floats,
    height: Floats,
    stances: list[Stance],
    leg: float,
    knee: float,
    fps: float,
    moving: tuple[bool, bool],
) -> Floats:
    """Return a foot's displacement from the movement's own track [N, 3], metres: 0 in the first and the last frame.

    Where the foot stands it is what keeps it in its place, on the floor; between two places it is as smooth as can be,
    and tends to 0. A foot that swings is kept above the floor, lifted the more the farther it goes, and moves level the
    less the lower it is.

    Args:
        places: of the foot where it stands [N, 2], metres, level.
        track: where the movement has it [N, 2], metres.
        height: of its lowest point above the floor [N], metres.
        stances: when it stands.
        leg: length of the leg, metres.
        knee: how fast the corpus's bodies bend its knee, radians a second: a quick step is lifted the less.
        fps: frames a second.
        moving: whether the foot's velocity is given in the first and in the last frame.
    """
    out = _departure(
        np.ascontiguousarray(places),
        np.ascontiguousarray(track),
        np.ascontiguousarray(height),
        np.array([(stance.start, stance.end) for stance in stances], dtype=np.int64).reshape(-1, 2),
        leg,
        min(FLICKS[0] * knee, FLICKS[1]),
        fps,
        moving,
    )
    return out * fade_at_ends(len(places), moving, fps)[:, None]


def clear_of_hip(off: Floats, leg: Floats, length: float, stances: list[Stance], fps: float) -> Floats:
    """Return a foot's displacement [N, 3], metres, with which it swings past its hip and not through it.

    Beside its hip a leg turns about at once. So it is pushed along as the movement has it, until it is as far as that,
    or NEAREST.

    Args:
        off: its displacement before.
        leg: from hip to foot as the movement has it [N, 3], metres.
        length: of the leg, metres.
        stances: when it stands.
        fps: frames a second.
    """
    own, there = rot.norm(leg), leg + off
    least = np.minimum(NEAREST * length, own)
    short = rot.norm(there) < least
    for stance in stances:
        short[stance.start : stance.end + 1] = False
    if not short.any():
        return off
    along = leg / np.maximum(own, 1e-9)[:, None]
    ahead = np.einsum("nk,nk->n", there, along)
    room = np.maximum(ahead**2 + least**2 - np.einsum("nk,nk->n", there, there), 0.0)
    push, frames = cover(np.where(short, np.sqrt(room) - ahead, 0.0), fps), np.arange(len(off))
    for stance in stances:
        away = np.maximum(np.maximum(stance.start - frames, frames - stance.end), 0)
        push = np.minimum(push, PUSHES * away / fps)
    return np.asarray(off + push[:, None] * along)


@jit
def _departure(
    places: Floats,
    track: Floats,
    height: Floats,
    stances: Ints,
    leg: float,
    flicks: float,
    fps: float,
    moving: tuple[bool, bool],
) -> Floats:
    """Return what `departure` does, but for its fading: `stances` are the first and the last frame of each [K, 2].

    A step bends a knee by so many radians a second at most.
    """
    count, last = len(places), len(places) - 1
    wanted, stands, lift, slides = np.zeros((3, count)), np.zeros(count), np.zeros(count), np.zeros(last)
    at = track.copy()
    for start, end in stances:
        for t in range(start, end + 1):
            wanted[0, t], wanted[2, t] = places[t, 0] - track[t, 0], places[t, 1] - track[t, 1]
            # It stands on the floor, but as it is given at an end nearby.
            for edge in (0, last):
                if edge in (start, end):
                    wanted[1, t] += height[edge] * _eased(1.0 - abs(t - edge) / (SETTLES * fps))
            wanted[1, t] -= height[t]
            stands[t], at[t] = 1.0, places[t]
    for k in range(len(stances) + 1):
        begin = stances[k - 1, 1] if k > 0 else 0
        end = stances[k, 0] if k < len(stances) else last
        # A foot that is given in the air steps, too, but for one that is given on its way.
        on_its_way = (begin == 0 and moving[0]) or (end == last and moving[1])
        if end - begin < 2 or on_its_way or len(stances) == 0:
            continue
        far = np.sqrt((at[end, 0] - at[begin, 0]) ** 2 + (at[end, 1] - at[begin, 1]) ** 2)
        highest = _lift(end - begin, far, leg, flicks, fps)
        for t in range(begin, end + 1):
            lift[t] = highest * _eased(min(t - begin, end - t) / ((end - begin) * RISES))
        most = max(lift[begin : end + 1].max(), 1e-9)
        for t in range(begin, end):
            up = min(max(lift[t], height[t]) / most, 1.0) + min(max(lift[t + 1], height[t + 1]) / most, 1.0)
            slides[t] = (1.0 - 0.5 * up) ** 2
    out = _bend(wanted, track, stands, slides, fps)
    for t in range(count):
        if stands[t] == 0.0:
            # A smooth maximum of where it is and how far it is to be lifted.
            above, soft = height[t] + out[t, 1] - lift[t], 0.1 * lift[t] + 1e-4
            if above <= 30.0 * soft:
                out[t, 1] += soft * np.log1p(np.exp(above / soft)) - above
    return out


@jit
def _eased(s: float) -> float:
    """Return a smooth step from 0, where `s` is at most 0, to 1, where it is at least 1."""
    s = min(max(s, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


@jit
def _lift(frames: int, far: float, leg: float, flicks: float, fps: float) -> float:
    """Return how far a step lifts a foot, metres.

    The shorter and the quicker a step, the less: by what a knee bends from straight in the time that it rises.

    Args:
        frames: that the step takes.
        far: how far it takes the foot, metres.
        leg: length of the leg, metres.
        flicks: how fast its knee bends at most, radians a second.
        fps: frames a second.
    """
    bend = min(flicks * RISES * frames / (1.5 * fps), np.pi)
    return float(min(leg * (1.0 - np.cos(0.5 * bend)), LIFT) * min(far / FAR, 1.0))


@jit
def _bend(wanted: Floats, track: Floats, stands: Floats, slides: Floats, fps: float) -> Floats:
    """Return departures [N, 3] that are as wanted where a foot stands, smooth, and elsewhere near 0.

    They minimise sum_t 1e6 s^2 |d - wanted|^2 + (1 - s) |d|^2 + BENDS^4 |d''|^2 + SLIDES^2 l |d' + track'|^2, with s
    how much it stands, and l how low it is in a step. They are 0, and depart smoothly, at both ends.

    Args:
        wanted: displacements of a foot that stands [3, N], metres.
        track: the movement's own, level [N, 2], metres.
        stands: how much it stands [N], from 0 to 1.
        slides: how much it is to move level as little as it can [N - 1], from 0 to 1.
        fps: frames a second.
    """
    count, bend = len(track), (BENDS * fps) ** 4
    matrix, right = np.zeros((count, 3)), np.empty((3, count))
    for t in range(count):
        firm = 1e6 * stands[t] ** 2
        matrix[t, 0] = firm + 1.0 - stands[t]
        for axis in range(3):
            right[axis, t] = firm * wanted[axis, t]
    for t in range(count - 2):
        for one, weight in enumerate((1.0, -2.0, 1.0)):
            for other, factor in enumerate((1.0, -2.0, 1.0)):
                if other <= one:
                    matrix[t + one, one - other] += bend * weight * factor
    for t in range(count - 1):
        still = slides[t] * (SLIDES * fps) ** 2
        matrix[t, 0] += still
        matrix[t + 1, 0] += still
        matrix[t + 1, 1] -= still
        for axis in (0, 2):
            moves = still * (track[t + 1, axis // 2] - track[t, axis // 2])
            right[axis, t] += moves
            right[axis, t + 1] -= moves
    for end, beside in ((0, 1), (count - 1, count - 2)):
        matrix[end, 0] += 1e12
        matrix[beside, 0] += bend
        right[:, end] = 0.0
    factorise(matrix)
    for axis in range(3):
        substitute(matrix, right[axis])
    return right.T.copy()


def fade_at_ends(count: int, moving: tuple[bool, bool], fps: float) -> Floats:
    """Return a curve [count] that is 0 at both ends, and elsewhere 1; where the end moves it rises smoothly."""
    out, frames = np.ones(count), np.arange(count)
    out[[0, -1]] = 0.0
    for moves, away in ((moving[0], frames), (moving[1], frames[::-1])):
        if moves:
            s = np.minimum(away / (FADES * fps), 1.0)
            out *= s * s * (3.0 - 2.0 * s)
    return out
