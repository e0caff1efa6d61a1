"""Cleaning: recordings damaged on purpose and repaired, beside the original and beside a Butterworth filter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.signal import butter, sosfiltfilt
from scipy.stats import t as student

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import corpus, recorded, recordings
from motionmind import Motion
from motionmind._typing import Floats
from motionmind.body.contact import find_floor, foot_slide
from motionmind.clean.cleaning import clean_motion
from motionmind.corpus.flips import find_flips, repair_flips
from motionmind.geometry import rotations as rot
from motionmind.metrics.figures import at_rate
from motionmind.metrics.smoothness import angular_jerk

TUNED = "cmu-05"
RECORDINGS = (TUNED, "indian", "cmu-16", "bandai")
FRAMES = 600  # of each recording, from its middle
MOST = 12  # recordings of each corpus
JITTER = {"none": 0.0, "jitter 0.1°": 0.1, "jitter 0.3°": 0.3, "jitter 1°": 1.0, "jitter 3°": 3.0}  # about each axis
ROOT_MM = 3.0  # of the root along each axis, a degree of the joints
DAMAGES = (*JITTER, "spikes", "flips", "slide", "floor", "all")
METHODS = ("damaged", "Butterworth 6 Hz", "Butterworth 10 Hz", "clean, without feet", "clean")


def jobs(setting: Setting) -> list[dict[str, Any]]:
    data = str(setting.data) if setting.data else None
    if setting.quick:
        return [{"data": None, "by": "ballet", "number": 0, "frames": 120}]
    names = recorded(data, *((TUNED,) if setting.tuning else RECORDINGS))
    assert data is not None or not names
    return [
        {"data": data, "by": by, "number": number, "frames": FRAMES}
        for by in names
        for number in range(min(len(recordings(data or "", by)), MOST))
    ] or [{"data": None, "by": "ballet", "number": number, "frames": FRAMES} for number in range(4)]


def work(data: str | None, by: str, number: int, frames: int) -> list[Row]:
    """Damage a recording in each way, repair it by each method, and compare it with the original."""
    original = _original(data, by, number, frames)
    rows: list[Row] = []
    for kind, damage in enumerate(DAMAGES):
        damaged = _damaged(original, damage, np.random.default_rng([number, kind]))
        for method in METHODS:
            repaired, is_bounded = _repaired(damaged, method)
            rows.append(
                {
                    "by": by,
                    "clip": original.name,
                    "damage": damage,
                    "method": method,
                    **_measured(original, repaired),
                    "bounded": is_bounded,
                }
            )
    return rows


def _original(data: str | None, by: str, number: int, frames: int) -> Motion:
    """Return part of a recording with its own flips repaired and its floor at 0."""
    if data is None:
        whole = corpus(None, by)
        motion = replace(at_rate(whole.recording(whole.clips[number])), keyframed=False)
    else:
        motion = recordings(data, by)[number]
    start = max((len(motion) - frames) // 2, 0)
    motion = motion.slice(start, start + frames)
    motion = repair_flips(motion).motion if find_flips(motion) else motion
    floor = find_floor(motion.skeleton, motion.rotations, motion.root, heels=True)
    return replace(motion, root=motion.root - np.array([0.0, floor, 0.0]))


def _damaged(motion: Motion, damage: str, rng: np.random.Generator) -> Motion:
    rotations, root = motion.rotations.copy(), motion.root.copy()
    degrees = JITTER.get(damage, 1.0 if damage == "all" else 0.0)
    if damage in ("flips", "all"):
        rotations = _flipped(motion, rotations, rng)
    if damage in ("spikes", "all"):
        hit = rng.random(rotations.shape[:2]) < 5e-4
        hit[:2] = hit[-2:] = False
        axes = rng.standard_normal((hit.sum(), 3))
        axes *= (np.radians(rng.uniform(60.0, 150.0, hit.sum())) / rot.norm(axes))[:, None]
        rotations[hit] = rot.mul(rotations[hit], rot.exp(axes))
    if degrees > 0.0:
        noise = np.radians(degrees) * rng.standard_normal((*rotations.shape[:2], 3))
        rotations = rot.mul(rotations, rot.exp(noise))
        root += 1e-3 * ROOT_MM * degrees * rng.standard_normal(root.shape)
    if damage in ("slide", "all"):  # 2 cm to and fro, at 4 to 6 cm a second
        phase = rng.uniform(0.0, 2.0 * np.pi, 2)
        root[:, [0, 2]] += 0.02 * np.sin(2.0 * np.pi * motion.times[:, None] / np.array([2.2, 3.1]) + phase)
    if damage in ("floor", "all"):
        root[:, 1] += 0.05
    return replace(motion, rotations=rotations, root=root)


def _flipped(motion: Motion, rotations: Floats, rng: np.random.Generator) -> Floats:
    """Turn six joints of limbs by half a turn about their bones, for a quarter of a second each."""
    skeleton, out = motion.skeleton, rotations.copy()
    joints = [joint for joint in range(1, len(skeleton)) if len(skeleton.children(joint)) == 1]
    length = max(2, round(0.25 * motion.fps))
    for joint in rng.choice(joints, 6):
        bone = skeleton.offsets[skeleton.children(int(joint))[0]]
        start = int(rng.integers(2, max(3, len(motion) - length - 2)))
        half = np.append(bone / np.linalg.norm(bone), 0.0)
        out[start : start + length, joint] = rot.mul(out[start : start + length, joint], half)
    return out


def _repaired(motion: Motion, method: str) -> tuple[Motion, bool]:
    """Return a damaged motion repaired, and whether no joint is farther from it than the report says."""
    if method == "damaged":
        return motion, True
    if method.startswith("Butterworth"):
        sections = butter(2, float(method.split()[1]) / (0.5 * motion.fps), output="sos")
        turned, root = (sosfiltfilt(sections, one, axis=0) for one in (rot.continuous(motion.rotations), motion.root))
        return replace(motion, rotations=rot.normalise(turned), root=root), True
    cleaning = clean_motion(motion, without=["feet"] if method != "clean" else [])
    far = 1000.0 * rot.norm(cleaning.motion.positions() - motion.positions()).max(axis=0)
    stated = np.array([joint.mm for joint in cleaning.summary().joints])
    return cleaning.motion, bool((far <= stated + 1e-6).all())


def _measured(original: Motion, repaired: Motion) -> Row:
    """Compare a repaired motion with the original; errors in mm, the slide of feet in cm a frame at 30 a second."""
    off = 1000.0 * rot.norm(repaired.positions() - original.positions())
    jerk = angular_jerk(repaired.rotations, repaired.fps).mean() / angular_jerk(original.rotations, original.fps).mean()
    seen = repaired.resample(30.0)
    floor = find_floor(seen.skeleton, seen.rotations, seen.root)
    return {
        "error": float(np.sqrt((off**2).mean())),
        "greatest": float(off.max()),
        "jerk": float(jerk),
        "slide": foot_slide(seen.skeleton, seen.rotations, seen.root, floor),
    }


# --- what is told -----------------------------------------------------------------------------------------------------


def interval(rows: list[Row], key: str) -> str:
    """The mean over sequences, with half of its 95 % interval."""
    values = np.array([row[key] for row in rows])
    if len(values) < 2:
        return f"{values.mean():.3g}"
    half = student.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values))
    return f"{values.mean():.3g} ± {half:.2g}"


def chart(rows: list[Row]) -> str:
    panels = []
    for by in dict.fromkeys(row["by"] for row in rows):
        panel = Panel(by, "jitter, degrees", "error, mm", log=True)
        for method in METHODS:
            panel.series[method] = [
                (degrees, float(np.mean([row["error"] for row in _of(rows, by, damage, method)])))
                for damage, degrees in JITTER.items()
                if degrees
            ]
        panels.append(panel)
    return svg(panels)


def _of(rows: list[Row], by: str, damage: str, method: str) -> list[Row]:
    return [row for row in rows if (row["by"], row["damage"], row["method"]) == (by, damage, method)]


def tell(rows: list[Row]) -> str:
    parts = []
    for by in dict.fromkeys(row["by"] for row in rows):
        groups = [
            {"damage": damage, "method": method, "rows": found}
            for damage in DAMAGES
            for method in METHODS
            if (found := _of(rows, by, damage, method))
        ]
        clips = len({row["clip"] for row in rows if row["by"] == by})
        heading = f"### {by}, {clips} recordings" + ", on which constants were chosen" * (by == TUNED)
        columns: dict[str, Callable[[Row], object]] = {
            "damage": lambda r: r["damage"],
            "method": lambda r: r["method"],
            "error, mm RMS": lambda r: interval(r["rows"], "error"),
            "greatest, mm": lambda r: interval(r["rows"], "greatest"),
            "jerk over the original's": lambda r: interval(r["rows"], "jerk"),
            "slide, cm a frame": lambda r: interval(r["rows"], "slide"),
        }
        parts.append(f"{heading}\n\n{markdown(columns, groups)}")
    broken = sum(not row["bounded"] for row in rows)
    checked = sum(row["method"].startswith("clean") for row in rows)
    parts.append(f"Recordings in which a joint is farther from the damaged one than reported: {broken} of {checked}.")
    return "\n\n".join(parts)
