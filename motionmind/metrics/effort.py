"""Effort-like descriptors of movement, its quantity and extension, and the phase between left and right limbs.

Larboulette and Gibet, "A review of computable expressive descriptors of human motion", MOCO (2015), collect the
formulas of weight, time, space and flow, named after Laban's four factors of effort. They are kinematics of points and
know nothing about intention: a movement that looks strong may be slow, and held tension has no speed.
Points are the centres of mass of the body's segments, weighted by their masses; where masses are unknown, the joints,
all weighted alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats
from motionmind.arguments import check_real, check_type
from motionmind.body.contact import CONTACT_FPS
from motionmind.body.limbs import TRUNK, sided_parts, stem_of
from motionmind.body.mirror import find_sides
from motionmind.body.motion import Motion
from motionmind.body.noticeable import NOTICEABLE_M
from motionmind.body.plausibility import at_rate
from motionmind.body.skeleton import Skeleton, remembered
from motionmind.body.support import masses_of
from motionmind.errors import MotionMindError, SkeletonError
from motionmind.geometry import rotations as rot

MIN_EFFORT_FRAMES = 5  # a jerk by central differences needs as many
EFFORT: Mapping[str, tuple[str, str]] = {
    "weight_effort": ("m^2/s^2", "peak of the mean squared speed of the body's mass: strong, or light"),
    "time_effort": ("m/s^2", "mean acceleration of the body's mass: sudden, or sustained"),
    "space_effort": ("", "length of paths over the distance from their start to their end: indirect, or direct (1)"),
    "flow_effort": ("m/s^3", "mean jerk of the body's mass: bound, or free"),
    "directness": ("", "distance from start to end over the length of the paths, of the whole body: 0 to 1"),
    "quantity_of_motion": ("m/s", "mean speed of the body's mass"),
    "extension": ("", "mean distance of the joints from their centre, in heights of the body: small if contracted"),
    "arms_synchrony": ("", "phase locking of left and right arm: 0 to 1"),
    "arms_phase": ("deg", "mean phase between left and right arm: 0 as mirror images, 180 in alternation"),
    "legs_synchrony": ("", "phase locking of left and right leg: 0 to 1"),
    "legs_phase": ("deg", "mean phase between left and right leg: 0 as mirror images, 180 in alternation"),
}


def measure_effort(motion: Motion, *, window: float | None = None) -> list[dict[str, float]]:
    """Measure effort-like descriptors of a movement, over its whole length or in windows.

    Movement is measured at 30 frames a second: accelerations and jerks of recordings depend on the rate. Weight is a
    peak and space compares paths with distances, so both depend on the length measured; compare equally long windows.

    Args:
        motion: on any skeleton.
        window: length of consecutive windows, seconds; None for one row. The rest of the movement, shorter than a
            window, is left out.

    Returns:
        A row a window, which `pandas.DataFrame` reads: "start" and "end", seconds, and the descriptors of `EFFORT`; NaN
        where one is undefined, as the phase of limbs that rest, infinite space where every point ends where it began.

    Raises:
        MotionMindError: the movement is shorter than a window, or than five frames at 30 a second; or the window is.

    >>> from motionmind import Engine
    >>> from motionmind.metrics import measure_effort
    >>> corpus = Engine.load("ballet").corpus
    >>> rows = measure_effort(corpus.motion(corpus.clips[0]), window=2.0)
    >>> rows[0]["start"], rows[0]["end"], 0.0 <= rows[0]["directness"] <= 1.0
    (0.0, 2.0, True)
    """
    check_type("motion", motion, Motion)
    check_real("window", window, or_none=True)
    if window is not None and not (MIN_EFFORT_FRAMES - 1) / CONTACT_FPS <= window < np.inf:
        raise MotionMindError(f"a window must be {(MIN_EFFORT_FRAMES - 1) / CONTACT_FPS:.2f} s or more, not {window:g}")
    name = motion.name or "the movement"
    sampled = at_rate(motion)
    steps = len(sampled) - 1 if window is None else round(window * CONTACT_FPS)
    if steps < MIN_EFFORT_FRAMES - 1 or steps > len(sampled) - 1:
        seconds = (len(sampled) - 1) / CONTACT_FPS
        raise MotionMindError(f"{name} lasts {seconds:.2f} s, and effort needs {least_duration(window):.2f} s")
    rows = []
    for start in range(0, len(sampled) - steps, steps):
        part = sampled.slice(start, start + steps + 1)
        times = part.times - motion.times[0]
        rows.append({"start": float(times[0]), "end": float(times[-1])} | effort_of(part))
    return rows


def least_duration(window: float | None) -> float:
    """Return how long a movement must last to have a row, seconds."""
    return max((MIN_EFFORT_FRAMES - 1) / CONTACT_FPS, round((window or 0.0) * CONTACT_FPS) / CONTACT_FPS)


def effort_of(motion: Motion) -> dict[str, float]:
    """Return the descriptors of `EFFORT` of movement at 30 frames a second, NaN where undefined."""
    body, points = motion.skeleton, points_of(motion)
    joints = body.positions(motion.rotations, motion.root)
    arms, legs = pair_phases(motion.skeleton, joints, motion.rotations[:, 0])
    return dict(
        zip(
            EFFORT,
            (
                weight_effort(points, CONTACT_FPS),
                time_effort(points, CONTACT_FPS),
                space_effort(points),
                flow_effort(points, CONTACT_FPS),
                directness(points),
                quantity_of_motion(points, CONTACT_FPS),
                extension(joints) / body.height if body.height > 0.0 else float("nan"),
                *arms,
                *legs,
            ),
            strict=True,
        )
    )


class MassPoints(NamedTuple):
    """Moving points of a body.

    Attributes:
        places: positions [T, K, 3], metres, evenly spaced in time.
        shares: weight of each [K]; they sum to 1.
    """

    places: Floats
    shares: Floats


def points_of(motion: Motion) -> MassPoints:
    """Return the centres of mass of the body's segments, weighted by mass; the joints where masses are unknown."""
    body, masses = motion.skeleton, masses_of(motion.skeleton)
    joints = body.positions(motion.rotations, motion.root)
    if masses is None:
        return MassPoints(joints, np.full(len(body), 1.0 / len(body)))
    return MassPoints(joints + rot.mul_vec(body.global_rotations(motion.rotations), masses.centres), masses.shares)


def weight_effort(points: MassPoints, fps: float) -> float:
    """Return the greatest of all frames' weighted mean squared speed, m^2/s^2; half of it is energy per kilogram."""
    return float((_speeds(points, fps) ** 2 @ points.shares).max())


def time_effort(points: MassPoints, fps: float) -> float:
    """Return the mean over time of the points' weighted mean acceleration, m/s^2."""
    x = points.places
    return float(np.mean(rot.norm(x[2:] - 2.0 * x[1:-1] + x[:-2]) * fps**2 @ points.shares))


def flow_effort(points: MassPoints, fps: float) -> float:
    """Return the mean over time of the points' weighted mean jerk, m/s^3; NaN for fewer than five frames."""
    x = points.places
    if len(x) < MIN_EFFORT_FRAMES:
        return float("nan")
    return float(np.mean(rot.norm(x[4:] - 2.0 * x[3:-1] + 2.0 * x[1:-3] - x[:-4]) * fps**3 / 2.0 @ points.shares))


def space_effort(points: MassPoints) -> float:
    """Return the weighted mean of the length of each point's path over the distance between its ends, 1 or more.

    Points that never move are left out: NaN if none does. Infinite if a point returns to where it began, but for
    rounding.
    """
    paths, distances = _ways(points)
    moved = (paths > 0.0) & (points.shares > 0.0)
    if not moved.any():
        return float("nan")
    if np.any(distances[moved] < 1e-9 * paths[moved]):
        return float("inf")
    return float(np.average(paths[moved] / distances[moved], weights=points.shares[moved]))


def directness(points: MassPoints) -> float:
    """Return the weighted distance between the ends of all paths over their weighted length, 0 to 1; NaN at rest."""
    paths, distances = _ways(points)
    total = float(paths @ points.shares)
    return float(distances @ points.shares) / total if total > 0.0 else float("nan")


def quantity_of_motion(points: MassPoints, fps: float) -> float:
    """Return the mean over time of the points' weighted mean speed, m/s."""
    return float(np.mean(_speeds(points, fps) @ points.shares))


def extension(joints: Floats) -> float:
    """Return the mean distance of joints [T, J, 3] from their centre, metres.

    PyEyesWeb, the Python library of the group of Camurri, calls it the density of points and takes it for a contraction
    index of bodies in space. The first such index was of silhouettes: Camurri, Lagerlof and Volpe, "Recognizing emotion
    from dance movement", Int. J. Human-Computer Studies 59:213 (2003).
    """
    return float(rot.norm(joints - joints.mean(axis=1, keepdims=True)).mean())


def phase_locking(one: Floats, other: Floats) -> complex:
    """Return the mean of exp(i d) of the phase difference d between two signals [T], each with a mean of 0.

    Its size is the phase-locking value of Lachaux, Rodriguez, Martinerie and Varela, "Measuring phase synchrony in
    brain signals", Human Brain Mapping 8:194 (1999): 1 if the difference is constant, about 0 if the signals are
    unrelated and long. Its angle is the mean difference. Phases are of the analytic signals.
    """
    a, b = _analytic(one), _analytic(other)
    return complex(np.mean(np.exp(1j * (np.angle(a) - np.angle(b)))))


def pair_phases(skeleton: Skeleton, joints: Floats, facing: Floats) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the synchrony, and the phase in degrees, of a body's arms, then of its legs; NaN where undefined.

    The end of a limb moves relative to the root, in the direction that the body faces. The right one is reflected to
    the left; both signals are along the axis of their greatest movement. Limbs that move less than 1 cm have no phase.
    Of several pairs, as an insect's legs, synchrony is the mean.

    Args:
        skeleton: the body.
        joints: positions of its joints [T, J, 3], metres.
        facing: orientation of the root [T, 4].
    """
    found: tuple[list[complex], list[complex]] = [], []
    turn = rot.inv(rot.about_vertical(rot.heading(facing)))[:, None]
    for left, right, axis, is_leg in _pairs(skeleton):
        ends = rot.mul_vec(turn, joints[:, [left, right]] - joints[:, :1])
        ends[:, 1, axis] *= -1.0
        ends -= ends.mean(axis=0)
        if np.sqrt((ends**2).sum(axis=-1).mean(axis=0)).min() >= NOTICEABLE_M:
            both = ends.reshape(-1, 3)
            along = ends @ np.linalg.eigh(both.T @ both)[1][:, -1]
            found[is_leg].append(phase_locking(along[:, 0], along[:, 1]))
    arms, legs = (
        (float(np.mean(np.abs(some))), float(np.degrees(np.abs(np.angle(np.sum(some)))))) if some else (np.nan, np.nan)
        for some in found
    )
    return arms, legs


@remembered
def _pairs(skeleton: Skeleton) -> tuple[tuple[int, int, int, bool], ...]:
    """Return the ends of each pair of limbs, the axis that tells their sides, and whether they are legs."""
    try:
        sides = find_sides(skeleton)
    except SkeletonError:
        return ()
    stem, pairs = stem_of(skeleton), []
    for name, limb in sided_parts(skeleton).items():
        end = int(limb[-1])
        if name != TRUNK and end < sides.partners[end]:
            is_leg = skeleton.parents[limb[0]] == stem[-1]
            pairs.append((end, int(sides.partners[end]), sides.world, bool(is_leg)))
    return tuple(pairs)


def _speeds(points: MassPoints, fps: float) -> Floats:
    """Return the speeds of points by central differences [T - 2, K], m/s."""
    return rot.norm(points.places[2:] - points.places[:-2]) * fps / 2.0


def _ways(points: MassPoints) -> tuple[Floats, Floats]:
    """Return the length of each point's path, and the distance between its ends [K], metres."""
    x = points.places
    return rot.norm(np.diff(x, axis=0)).sum(axis=0), rot.norm(x[-1] - x[0])


def _analytic(signal: Floats) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    """Return the analytic signal of a real signal [T]: its spectrum without negative frequencies, doubled."""
    count = len(signal)
    factors = np.zeros(count)
    factors[0] = 1.0
    factors[1 : (count + 1) // 2] = 2.0
    if count % 2 == 0:
        factors[count // 2] = 1.0
    return np.asarray(np.fft.ifft(np.fft.fft(signal) * factors))
