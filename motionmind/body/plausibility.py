"""Plausibility: things that a viewer sees in movement and that bodies do not do, frame by frame.

Each of `SEEN` is greater the worse it is, and NaN in frames to which it does not apply:

- `balance`: how far outside of its support the centre of mass is, metres, while one limb bears alone and the body is
  hardly accelerated (`motionmind.body.support`);
- `bounce`: vertical acceleration of the centre of mass, metres a second squared, up or down;
- `flight`: the share of gravity that a body in the air lacks: 0 on the parabola of free fall, 1 where it floats, and
  less than 0 where it falls too fast;
- `crossed_limbs`: how deep limbs are in each other, metres (`motionmind.body.capsules`).

Of a body whose masses are not known, only the last is; of one whose thickness is not known, not even that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.capsules import penetration
from motionmind.body.contact import CONTACT_FPS, lowest_height
from motionmind.body.motion import Motion
from motionmind.body.rates import check_size
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import find_support
from motionmind.geometry.splines import natural_spline, rotation_spline

SEEN = ("balance", "bounce", "flight", "crossed_limbs")
GRAVITY_MPS2 = 9.81  # metres a second squared
CALM_MPS2 = 2.0  # metres a second squared: level acceleration up to which a body should be in balance
FALLING_RATIO = 0.5  # share of gravity: a body off the floor that falls faster is in the air


def implausibility(skeleton: Skeleton, rotations: Floats, root: Floats, fps: float, floor: float = 0.0) -> Floats:
    """Return how implausible movement is in each frame [T, 4], in the order and the units of `SEEN`.

    Args:
        skeleton: the body.
        rotations: local rotations [T, J, 4].
        root: positions of the root [T, 3], metres.
        fps: frames a second.
        floor: height of the floor, metres.
    """
    out = np.full((len(rotations), len(SEEN)), np.nan)
    support = find_support(skeleton, rotations, root, fps, floor)
    if support.mass is not None and support.overhang is not None and len(rotations) > 2:
        accelerations = fps**2 * np.diff(support.mass, 2, axis=0)
        calm = np.zeros(len(rotations), dtype=bool)
        calm[1:-1] = np.hypot(accelerations[:, 0], accelerations[:, 2]) < CALM_MPS2
        alone = support.bears.sum(axis=1) == 1
        out[:, 0] = np.where(calm & alone, support.overhang, np.nan)
        out[1:-1, 1] = np.abs(accelerations[:, 1])
        out[:, 2] = _lack_of_gravity(support.mass[:, 1], support.airborne, fps)
    depths = penetration(skeleton, rotations)
    if depths:
        out[:, 3] = np.max([*depths.values()], axis=0)
    return out


def floor_of(skeleton: Skeleton, rotations: Floats, root: Floats) -> float:
    """Return the height of the floor under movement that need not touch it, metres: 0, or the body's lowest point."""
    return min(0.0, float(lowest_height(skeleton, rotations, root).min()))


def greatest(values: Floats) -> Floats:
    """Return the maximum of each column of values [T, M], NaN where all are NaN."""
    most = np.where(np.isnan(values), -np.inf, values).max(axis=0, initial=-np.inf)
    return np.where(np.isfinite(most), most, np.nan)


def at_rate(motion: Motion) -> Motion:
    """Resample movement to 30 frames per second: interpolate coarser movement by splines, thin finer movement."""
    if motion.fps >= CONTACT_FPS or len(motion) < 2:
        return motion.resample(CONTACT_FPS)
    start, keys = motion.times[0], motion.times
    steps = np.floor((keys[-1] - start) * CONTACT_FPS + 1e-3)
    check_size(steps + 1.0, len(motion.skeleton), motion.name)
    times = start + np.arange(steps + 1) / CONTACT_FPS
    rotations, root = rotation_spline(keys, motion.rotations, times), natural_spline(keys, motion.root, times)
    return replace(motion, rotations=rotations, root=root, times=times, insertions=(), keyframed=False)


def _lack_of_gravity(heights: Floats, airborne: Bools, fps: float) -> Floats:
    """Return the share of gravity that the mass lacks in each frame in the air [T]; NaN elsewhere.

    Fit a parabola to each flight: accelerations of single frames are mostly noise.
    """
    out = np.full(len(heights), np.nan)
    steps = np.diff(np.concatenate([[False], airborne, [False]]).astype(np.int8))
    for begin, end in zip(np.flatnonzero(steps == 1), np.flatnonzero(steps == -1), strict=True):
        if end - begin >= 3:  # a parabola needs three frames
            times = np.arange(end - begin) / fps
            acceleration = 2.0 * np.polynomial.polynomial.polyfit(times - times.mean(), heights[begin:end], 2)[2]
            out[begin:end] = 1.0 + acceleration / GRAVITY_MPS2
    return out
