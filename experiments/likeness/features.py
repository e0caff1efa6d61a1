"""What a classifier sees of a second of movement: features of smoothed motion, none of them a place, a time or a name.

Recorded movement carries noise of recording, and made movement the noise of what it copies. So all movement is smoothed
alike before anything is measured (`smooth`), and neither jerk nor frequencies above 4 Hz nor reversals of velocity
count: about three quarters of the reversals of recorded arms are of axes that turn by less than 0.02 rad/s.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from experiments.material import FPS
from motionmind._typing import Bools, Floats
from motionmind.body.contact import find_feet
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot

PIECE = 30  # frames, steps of a piece that a classifier sees: 1 s
SIGMA = 1.0  # frames: a Gaussian that halves amplitudes at 5.6 Hz
LOW_M = 0.05  # height above the floor below which a foot's end is low
STILL_M_S = 0.05  # level speed below which a low foot's end stands
QUICK_HZ = (2, 4)  # the first and the last frequency of quick movement
SLOW_RAD_S = 0.01  # speed, and thirty times that acceleration, below which logarithms tell no difference

GROUPS = {
    "spine": ("lumbar", "thorax"),
    "head": ("cervical", "atlantal"),
    "arms": ("clavicle", "shoulder", "elbow"),
    "hands": ("wrist", "fingers"),
    "legs": ("hip", "knee"),
    "feet": ("ankle", "toes"),
    "pelvis": ("pelvis",),
}
UPPER = ("spine", "head", "arms", "hands")


def joints_of(skeleton: Skeleton, group: str) -> list[int]:
    """Return the joints of a group on human23, of both sides."""
    return [
        k for k, name in enumerate(skeleton.names) if name.removeprefix("left_").removeprefix("right_") in GROUPS[group]
    ]


class Turning(NamedTuple):
    """How joints turn in N pieces.

    Attributes:
        velocity: angular velocity in each joint's own frame [N, T, j, 3], rad/s.
        speed: its magnitude [N, T, j].
        acceleration: magnitude of its change [N, T - 1, j], rad/s^2.
    """

    velocity: Floats
    speed: Floats
    acceleration: Floats


class Travel(NamedTuple):
    """How the root and the feet move in N pieces.

    Attributes:
        height: height of the root above the floor [N, T + 1], metres.
        velocity: velocity of the root [N, T, 3], m/s.
        acceleration: its change [N, T - 1, 3], m/s^2.
        feet: heights of both ends of the feet above the floor [N, T, 2 feet], metres.
        sliding: their level speed [N, T, 2 feet], m/s.
    """

    height: Floats
    velocity: Floats
    acceleration: Floats
    feet: Floats
    sliding: Floats


# --- the list ---------------------------------------------------------------------------------------------------------

OF_TURNING: dict[str, Callable[[Turning], Floats]] = {
    "speed": lambda x: _log(_mean(x.speed), SLOW_RAD_S),
    "top speed": lambda x: _log(_top(x.speed), SLOW_RAD_S),
    "acceleration": lambda x: _log(_mean(x.acceleration), FPS * SLOW_RAD_S),
    "top acceleration": lambda x: _log(_top(x.acceleration), FPS * SLOW_RAD_S),
    "acceleration per speed": lambda x: (
        _log(_mean(x.acceleration), FPS * SLOW_RAD_S) - _log(_mean(x.speed), SLOW_RAD_S)
    ),
    "unevenness": lambda x: x.speed.mean(axis=2).std(axis=1) / (_mean(x.speed) + SLOW_RAD_S),
    "straightness": lambda x: np.mean(
        np.linalg.norm(x.velocity.mean(axis=1), axis=-1) / (x.speed.mean(axis=1) + SLOW_RAD_S), axis=-1
    ),
    "quick share": lambda x: _quick_share(x.velocity),
}  # of each group of joints

OF_TRAVEL: dict[str, Callable[[Travel], Floats]] = {
    "root level speed": lambda x: _log(_mean(_level(x.velocity)), STILL_M_S),
    "root level acceleration": lambda x: _log(_mean(_level(x.acceleration)), FPS * STILL_M_S),
    "root level top acceleration": lambda x: _log(_top(_level(x.acceleration)), FPS * STILL_M_S),
    "root vertical speed": lambda x: _log(_mean(abs(x.velocity[..., 1])), STILL_M_S),
    "root vertical acceleration": lambda x: _log(_mean(abs(x.acceleration[..., 1])), FPS * STILL_M_S),
    "root vertical top acceleration": lambda x: _log(_top(abs(x.acceleration[..., 1])), FPS * STILL_M_S),
    "root height range": lambda x: _log(np.ptp(x.height, axis=1), LOW_M),
    "feet low": lambda x: _share(x.feet < LOW_M),
    "feet low and still": lambda x: _share((x.feet < LOW_M) & (x.sliding < STILL_M_S)),
    "feet low, speed": lambda x: _log(low_speed(x.feet, x.sliding, axis=(1, 2)), STILL_M_S),
    "feet lowest": lambda x: x.feet.min(axis=(1, 2)),
    "feet lowest, spread": lambda x: x.feet.min(axis=2).std(axis=1),
    "feet height": lambda x: _mean(x.feet),
}

PAIRED = ("arms", "legs")  # groups of which the correlation of left and right counts


def features(skeleton: Skeleton, rotations: Floats, root: Floats, floor: Floats) -> dict[str, Floats]:
    """Return all features of the pieces of windows, by name [N].

    Args:
        skeleton: the body.
        rotations: local rotations of windows of the same length [B, T, J, 4].
        root: positions of the root [B, T, 3], metres.
        floor: height of the floor in each [B], metres.
    """
    smoothed = smooth(rotations, root)
    turned, moved = (cut(one) for one in smoothed)
    floor = np.repeat(floor, len(cuts(rotations.shape[1] - 1)))
    turning = {group: turning_of(turned[..., joints_of(skeleton, group), :]) for group in GROUPS}
    out = {f"{group} {name}": of(x) for group, x in turning.items() for name, of in OF_TURNING.items()}
    travel = travel_of(skeleton, turned, moved, floor)
    out |= {name: of(travel) for name, of in OF_TRAVEL.items()}
    speeds = {group: x.speed.mean(axis=2) for group, x in turning.items()}
    out["upper body together"] = _together([speeds[group] for group in UPPER])
    out["whole body together"] = _together(list(speeds.values()))
    for group in PAIRED:
        half = turning[group].speed.shape[2] // 2  # joints on the left come before those on the right
        sides = turning[group].speed[..., :half], turning[group].speed[..., half:]
        out[f"{group} left and right together"] = _together([side.mean(axis=2) for side in sides])
    return out


def of_upper_body(name: str) -> bool:
    """Return whether a feature is of spine, head, arms and hands alone."""
    return name.split(maxsplit=1)[0] in (*UPPER, "upper")


# --- signals ----------------------------------------------------------------------------------------------------------


def smooth(rotations: Floats, root: Floats) -> tuple[Floats, Floats]:
    """Smooth windows [B, T, J, 4], [B, T, 3] with a Gaussian; beyond its ends a window goes on as its mirror image."""
    flips = np.sum(rotations[:, 1:] * rotations[:, :-1], axis=-1, keepdims=True) < 0.0
    sign = np.cumprod(np.where(flips, -1.0, 1.0), axis=1)
    steady = np.concatenate([rotations[:, :1], rotations[:, 1:] * sign], axis=1)
    return rot.normalise(_gaussian(steady)), _gaussian(root)


def _gaussian(x: Floats) -> Floats:
    margin = int(np.ceil(4.0 * SIGMA))
    around = [(0, 0), (margin, margin)] + [(0, 0)] * (x.ndim - 2)
    padded = np.pad(x, around, mode="reflect", reflect_type="odd")  # which keeps the velocity at the ends
    return np.asarray(gaussian_filter1d(padded, SIGMA, axis=1)[:, margin:-margin])


def cuts(frames: int) -> list[int]:
    """Return where pieces of 1 s begin in a window, as many as fit, in its middle."""
    count = frames // PIECE
    return [(frames - count * PIECE) // 2 + k * PIECE for k in range(count)]


def cut(x: Floats) -> Floats:
    """Cut windows [B, T, ...] into their pieces [N, 31, ...], those of a window together."""
    pieces = np.stack([x[:, start : start + PIECE + 1] for start in cuts(x.shape[1] - 1)], axis=1)
    return pieces.reshape(-1, *pieces.shape[2:])


def turning_of(rotations: Floats) -> Turning:
    velocity = rot.log(rot.inv_mul(rotations[:, :-1], rotations[:, 1:])) * FPS
    acceleration = np.linalg.norm(np.diff(velocity, axis=1), axis=-1) * FPS
    return Turning(velocity, np.linalg.norm(velocity, axis=-1), acceleration)


def travel_of(skeleton: Skeleton, rotations: Floats, root: Floats, floor: Floats) -> Travel:
    velocity = np.diff(root, axis=1) * FPS
    feet, sliding = feet_of(skeleton, rotations, root, floor)
    return Travel(root[..., 1] - floor[:, None], velocity, np.diff(velocity, axis=1) * FPS, feet, sliding)


def feet_of(skeleton: Skeleton, rotations: Floats, root: Floats, floor: Floats) -> tuple[Floats, Floats]:
    """Return heights above the floor, metres, and level speeds, m/s, of both ends of the feet [B, T - 1, 2 feet]."""
    feet = np.array(find_feet(skeleton))
    ends = skeleton.positions_and_tips(rotations, root)[:, :, np.concatenate([feet, feet + len(skeleton)])]
    return ends[:, 1:, :, 1] - floor[:, None, None], _level(np.diff(ends, axis=1)) * FPS


def low_speed(heights: Floats, speeds: Floats, axis: tuple[int, ...]) -> Floats:
    """Return the mean speed of low feet over some axes, 0 where none is low."""
    low = heights < LOW_M
    return np.asarray(np.sum(speeds * low, axis=axis) / np.maximum(low.sum(axis=axis), 1))


# --- arithmetic -------------------------------------------------------------------------------------------------------


def _mean(x: Floats) -> Floats:
    return np.asarray(x.reshape(len(x), -1).mean(axis=1))


def _share(x: Bools) -> Floats:
    return np.asarray(x.reshape(len(x), -1).mean(axis=1))


def _top(x: Floats) -> Floats:
    return np.asarray(x.reshape(len(x), -1).max(axis=1))


def _log(x: Floats, unit: float) -> Floats:
    """Return log(x + unit): a ratio where x is large, a difference where it is small beside the unit."""
    return np.asarray(np.log(x + unit))


def _level(x: Floats) -> Floats:
    return np.asarray(np.hypot(x[..., 0], x[..., 2]))


def _quick_share(velocity: Floats) -> Floats:
    """Return the share of quick frequencies in the power of velocities [N, T, j, 3] up to the highest of them."""
    power = (np.abs(np.fft.rfft(velocity, axis=1)) ** 2).sum(axis=(2, 3))  # one second: frequencies in Hz
    first, last = QUICK_HZ
    rest = (velocity.shape[1] * SLOW_RAD_S) ** 2
    return np.asarray(power[:, first : last + 1].sum(axis=1) / (power[:, : last + 1].sum(axis=1) + rest))


def _together(speeds: list[Floats]) -> Floats:
    """Return the mean correlation of speeds [N, T] of several groups; what hardly changes correlates with nothing."""
    x = np.stack(speeds, axis=1)
    x = x - x.mean(axis=2, keepdims=True)
    length = np.linalg.norm(x, axis=2) + np.sqrt(x.shape[2]) * SLOW_RAD_S
    correlation = np.einsum("nat,nbt->nab", x, x) / (length[:, :, None] * length[:, None, :])
    one, other = np.triu_indices(x.shape[1], 1)
    return np.asarray(correlation[:, one, other].mean(axis=1))
