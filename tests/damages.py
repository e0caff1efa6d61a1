"""Movement without jitter, and ways to damage it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from bundled_clips import ballet_clip

from motionmind._typing import Floats
from motionmind.body.contact import find_floor
from motionmind.body.motion import Motion
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline, rotation_spline


@cache
def recording(fps: float = 60.0, name: str = "adagio", seconds: float = 6.0) -> Motion:
    """A bundled clip as a camera of so many frames a second would see it: smooth, with its floor at 0."""
    keys = ballet_clip(name)
    times = np.arange(round(min(seconds, float(keys.times[-1])) * fps)) / fps
    rotations, root = rotation_spline(keys.times, keys.rotations, times), natural_spline(keys.times, keys.root, times)
    root[:, 1] -= find_floor(keys.skeleton, rotations, root, heels=True)
    return Motion(keys.skeleton, rotations, root, times, name)


def noisy(motion: Motion, degrees: float, seed: int = 0) -> Motion:
    """The motion with white noise of all joints about each axis."""
    rng = np.random.default_rng(seed)
    noise = np.radians(degrees) * rng.standard_normal((*motion.rotations.shape[:2], 3))
    return replace(motion, rotations=rot.mul(motion.rotations, rot.exp(noise)))


def sliding(motion: Motion, metres: float = 0.02, seconds: float = 2.3) -> Motion:
    """The motion of a body that drifts to and fro."""
    phase = 2.0 * np.pi * motion.times / seconds
    return replace(motion, root=motion.root + metres * np.stack([np.sin(phase), 0.0 * phase, np.cos(phase)], axis=1))


def spiked(motion: Motion, joint: str, frame: int, degrees: float = 120.0) -> Motion:
    """The motion with a joint turned far in one frame."""
    rotations = motion.rotations.copy()
    at = frame, motion.skeleton.index(joint)
    rotations[at] = rot.mul(rotations[at], rot.from_axis_angle([0.6, 0.0, 0.8], np.radians(degrees)))
    return replace(motion, rotations=rotations)


def raised(motion: Motion, metres: float) -> Motion:
    """The motion higher up."""
    return replace(motion, root=motion.root + np.array([0.0, metres, 0.0]))


def backwards(motion: Motion) -> Motion:
    """The motion in reverse."""
    return replace(motion, rotations=motion.rotations[::-1], root=motion.root[::-1])


def apart(a: Motion, b: Motion) -> Floats:
    """How far each joint of one motion is from that of another [T, J], metres."""
    return rot.norm(a.positions() - b.positions())
