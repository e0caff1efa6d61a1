"""The report of a cleaning: what each step changed, and how far each joint is from where it was recorded."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.clean.jitter import Filtered
from motionmind.geometry import rotations as rot

# Smaller changes are rounding. Files round to 1e-6 degrees and 1e-8 m, which adds up along a chain of bones.
_UNCHANGED_M, _UNCHANGED_RAD = 1e-9, 1e-8
_ROUNDING_MM, _ROUNDING_DEG = 1e-3, 1e-4


class StepReport(msgspec.Struct, frozen=True):
    """The changes of one step.

    Attributes:
        step: the step: one of `STEPS`.
        frames: number of frames that it changed.
        joints: number of joints whose rotation it changed.
        greatest_mm: how far it moved any joint.
        mean_mm: the mean over the frames that it changed and all joints.
        greatest_degrees: how far it turned any joint against its parent.
        mean_degrees: the mean over the joints and frames that it turned.
        about: what it did, in words.
    """

    step: str
    frames: int
    joints: int
    greatest_mm: float
    mean_mm: float
    greatest_degrees: float
    mean_degrees: float
    about: str


class JitterReport(msgspec.Struct, frozen=True):
    """The jitter of a joint's rotation or of the root's position.

    Attributes:
        noise: its standard deviation.
        cut_off_hz: the 5th, 50th and 95th percentile over time of the filter's cut-off; null if it was left alone.
    """

    noise: float
    cut_off_hz: tuple[float, float, float] | None


class JointReport(msgspec.Struct, frozen=True):
    """The change of a joint over all steps; upper bounds, rounded up.

    Attributes:
        joint: the joint.
        mm: its greatest distance from where it was recorded.
        degrees: the greatest angle from its recorded rotation against its parent.
        jitter: its jitter, degrees about each axis; null without the filter.
    """

    joint: str
    mm: float
    degrees: float
    jitter: JitterReport | None = None


class StanceReport(msgspec.Struct, frozen=True):
    """Frames in which a point of a foot stands in one place.

    Attributes:
        joint: the joint that carries the point.
        point: "joint", "tip" or "heel".
        first: the first frame, from 0.
        last: the last frame.
        held: whether the point stays within a millimetre of its place.
    """

    joint: str
    point: str
    first: int
    last: int
    held: bool


class CleanReport(msgspec.Struct, frozen=True):
    """The report of a cleaning.

    Attributes:
        recording: the recording's name.
        frames: its number of frames.
        fps: its frames a second.
        steps: the steps that were taken.
        joints: the changes of all joints.
        stances: the contacts of feet that were locked.
        floor_mm: height at which the floor was found; null if it was not looked for.
        root: jitter of the root's position, mm along each axis; null without the filter.
        gaps: the gaps that are left: their first and last frames.
    """

    recording: str
    frames: int
    fps: float
    steps: list[StepReport]
    joints: list[JointReport]
    stances: list[StanceReport]
    floor_mm: float | None = None
    root: JitterReport | None = None
    gaps: list[tuple[int, int]] = []


def jitter_report(filtered: Filtered, number: int, unit: float) -> JitterReport:
    """Report the jitter of a joint, in multiples of 1 / `unit` radians or metres."""
    cut_offs = filtered.cut_offs[:, number]
    finite = cut_offs[np.isfinite(cut_offs)]
    noise = float(f"{unit * filtered.noise[number]:.3g}")
    if not len(finite):
        return JitterReport(noise, None)
    low, middle, high = (float(f"{value:.3g}") for value in np.percentile(finite, (5.0, 50.0, 95.0)))
    return JitterReport(noise, (low, middle, high))


def moved(before: Motion, after: Motion) -> Floats:
    """Return how far each joint is from one motion to another in each frame [T, J], metres."""
    return rot.norm(after.positions() - before.positions())


def step_report(step: str, before: Motion, after: Motion, far: Floats, about: str) -> StepReport:
    """Report the change from a motion to another, made by a step that moved joints `far` [T, J], metres."""
    turned = np.asarray(rot.angle(before.rotations, after.rotations))
    is_turned = turned > _UNCHANGED_RAD
    frames = (far > _UNCHANGED_M).any(axis=1) | is_turned.any(axis=1)
    return StepReport(
        step,
        int(frames.sum()),
        int(is_turned.any(axis=0).sum()),
        round_up(1000.0 * float(far.max()), 2, _ROUNDING_MM),
        float(f"{1000.0 * far[frames].mean() if frames.any() else 0.0:.3g}"),
        round_up(math.degrees(float(turned.max())), 3, _ROUNDING_DEG),
        float(f"{math.degrees(float(turned[is_turned].mean())) if is_turned.any() else 0.0:.3g}"),
        about,
    )


def joint_bounds(before: Motion, after: Motion) -> list[tuple[float, float]]:
    """Return upper bounds of the change of each joint: its distance, mm, and its turn against its parent, degrees."""
    far = 1000.0 * moved(before, after).max(axis=0)
    turned = np.degrees(rot.angle(before.rotations, after.rotations)).max(axis=0)
    return [
        (round_up(float(mm), 2, _ROUNDING_MM), round_up(float(degrees), 3, _ROUNDING_DEG))
        for mm, degrees in zip(far, turned, strict=True)
    ]


def round_up(value: float, digits: int, margin: float) -> float:
    """Return an upper bound of a value and a margin, with so many decimals; 0 for rounding errors."""
    return 0.0 if value < 1e-6 else math.ceil((value + margin) * 10**digits) / 10**digits
