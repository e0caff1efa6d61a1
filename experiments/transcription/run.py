"""Transcription: how far a score is off its recording, beside postures at an even rate."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import corpus, families, recorded, recordings
from motionmind._typing import Floats, Ints
from motionmind.body.motion import Motion
from motionmind.body.support import find_support
from motionmind.bundled import bundled
from motionmind.geometry import rotations as rot
from motionmind.notation.read import read_score
from motionmind.transcription import transcribe
from motionmind.transcription.bones import deviations
from motionmind.transcription.following import Following
from motionmind.transcription.recorded import Recorded, prepare

RECORDINGS = ("cmu-05", "cmu-135", "indian", "cmu-29")
TOLERANCES_DEG = (6.0, 12.0)
TURNING_DEG_S = 90.0
UNWRITTEN_DEG = 2.0  # angles are whole degrees, whose rounding is off by 1
PARTS = ("legs", "arms", "torso", "head")
METHODS = ("transcribe", "fewest, joined", "even, joined")
N_RESAMPLES = 2000  # of sequences, for an interval


def jobs(setting: Setting) -> list[dict[str, Any]]:
    if setting.quick:
        return [{"data": None, "by": "karate", "number": 0, "tolerance": 12.0}]
    data = str(setting.data) if setting.data else None
    return [
        {"data": data, "by": by, "number": number, "tolerance": tolerance}
        for by in recorded(data, *RECORDINGS)
        for number in range(len(recordings(data or "", by)))
        for tolerance in TOLERANCES_DEG
    ]


def work(data: str | None, by: str, number: int, tolerance: float) -> list[Row]:
    """Transcribe a clip; compare its score, its postures joined, and as many evenly spaced ones, with the recording."""
    if data is None:
        whole = corpus(None, by)
        clip, sequence = whole.recording(whole.clips[number]), whole.clips[number].name
    else:
        clip = recordings(data, by)[number]
        sequence = next(family[0] for family in families(data, by) if clip.name in family)
    recording, found = prepare(clip, tolerance), transcribe(clip, tolerance, repeats=False)
    count = len(recording.root)
    even = np.unique(np.round(np.linspace(0.0, count - 1.0, len(found.keys))).astype(np.int64))
    off = {
        "transcribe": _measured(found.deviation.degrees, found.deviation.centimetres) | {"followed": ""},
        "fewest, joined": _joined(recording, found.keys, tolerance),
        "even, joined": _joined(recording, even, tolerance),
    }
    known = {
        "by": by,
        "clip": clip.name,
        "sequence": sequence,
        "tolerance": tolerance,
        "seconds": float(found.recording.times[-1]),
        **{f"unwritten_{part}": _high(found.deviation.unwritten[part]) for part in PARTS},
        "unwritten_joint": _least_written(recording),
        **_supported(recording),
        **_named(clip, tolerance),
    }
    rate = len(found.keys) / float(found.recording.times[-1])
    return [known | {"method": method, "postures": rate} | off[method] for method in METHODS]


def _named(clip: Motion, tolerance: float) -> Row:
    """Return the shares of positions that have names in ballet; only at the wider tolerance, where more fit."""
    if tolerance < max(TOLERANCES_DEG):
        return {f"named_{part}": "" for part in PARTS}
    scores = [read_score(bundled("corpora") / "ballet" / f"{name}.score") for name in ("barre", "centre", "allegro")]
    found = transcribe(clip, tolerance, repeats=False, vocabulary=scores)
    return {f"named_{part}": share for part, share in found.recognized.items()}


def _joined(recording: Recorded, keys: Ints, tolerance: float) -> Row:
    """Measure postures at keys, each bone turning evenly between them, and the share of frames within the tolerance."""
    at = np.arange(len(recording.root))
    move = np.clip(np.searchsorted(keys, at, side="right") - 1, 0, len(keys) - 2)
    first, last = keys[move], keys[move + 1]
    share = ((at - first) / (last - first))[:, None]
    turned, bones, root = recording.written.turned(), recording.bones, recording.root
    between = bones.directions(rot.slerp(turned[first], turned[last], share))
    off = deviations(between, bones.directions(recording.motion.rotations))
    place = root[first] + share * (root[last] - root[first])
    following = Following(recording, tolerance)
    inside = np.setdiff1d(at, keys)  # a key is followed as far as it can be written
    followed = following.follows(following.poses, first[inside], last[inside], inside)
    degrees = {part: off[:, own].max(axis=1) for part, own in bones.layers.items()}
    lost = np.count_nonzero(~followed) / len(at)
    return _measured(degrees, 100.0 * rot.norm(place - recording.motion.root)) | {"followed": 1.0 - lost}


def _measured(degrees: Mapping[str, Sequence[float] | Floats], centimetres: Sequence[float] | Floats) -> Row:
    return {part: _high(degrees[part]) for part in PARTS} | {"pelvis": _high(centimetres)}


def _high(values: Sequence[float] | Floats) -> float:
    return float(np.percentile(values, 95.0))


def _least_written(recording: Recorded) -> str:
    """Return the joint whose bone is farthest off, written at best; "" if all are within `UNWRITTEN_DEG`."""
    bones = recording.bones
    off = deviations(bones.directions(recording.writable), bones.directions(recording.motion.rotations))
    high = np.percentile(off, 95.0, axis=0)
    worst = int(high.argmax())
    return bones.body.skeleton.names[bones.joints[worst]].split("_")[-1] if high[worst] > UNWRITTEN_DEG else ""


def _supported(recording: Recorded) -> Row:
    """Return the share of frames in which no leg bears, in which the body turns, too, and in which it is in the air.

    It turns if its pelvis turns by `TURNING_DEG_S`.
    """
    motion, none = recording.motion, ~recording.bears.any(axis=1)
    heading = np.unwrap(rot.heading(motion.rotations[:, 0]))
    turns = np.abs(np.degrees(np.gradient(heading))) * motion.fps > TURNING_DEG_S
    air = find_support(motion.skeleton, motion.rotations, motion.root, motion.fps).airborne
    return {"unsupported": float(none.mean()), "turning": float((none & turns).mean()), "aloft": float(air.mean())}


# --- what is told -----------------------------------------------------------------------------------------------------


def interval(rows: list[Row], key: str, unit: float = 1.0) -> str:
    """The median over clips, and its 95 % interval, over sequences drawn again; one sequence has none."""
    values = np.array([unit * row[key] for row in rows])
    names = [row["sequence"] for row in rows]
    groups = [values[[name == sequence for name in names]] for sequence in dict.fromkeys(names)]
    middle = f"{np.median(values):.1f}"
    if len(groups) < 2:
        return middle
    drawn = np.random.default_rng(0).integers(len(groups), size=(N_RESAMPLES, len(groups)))
    medians = [np.median(np.concatenate([groups[number] for number in one])) for one in drawn]
    low, high = np.percentile(medians, [2.5, 97.5])
    return f"{middle} ({low:.1f} to {high:.1f})"


def _counted(rows: list[Row], key: str) -> str:
    found = Counter(row[key] or "none" for row in rows)
    return ", ".join(f"{word} {count}" for word, count in found.most_common())


def chart(rows: list[Row]) -> str:
    panels = []
    for by in dict.fromkeys(row["by"] for row in rows):
        panel = Panel(f"{by}, a clip a dot", "postures a second", "worst part in 95 %, degrees", joined=False)
        for tolerance in dict.fromkeys(row["tolerance"] for row in rows):
            for method in METHODS[::2]:
                panel.series[f"{method}, {tolerance:g} degrees"] = [
                    (row["postures"], max(row[part] for part in PARTS)) for row in _of(rows, by, tolerance, method)
                ]
        panels.append(panel)
    return svg(panels, columns=2)


def _of(rows: list[Row], by: str, tolerance: float, method: str) -> list[Row]:
    return [row for row in rows if (row["by"], row["tolerance"], row["method"]) == (by, tolerance, method)]


def tell(rows: list[Row]) -> str:
    tolerances, names = (list(dict.fromkeys(row[key] for row in rows)) for key in ("tolerance", "by"))
    groups = [
        {"by": by, "tolerance": tolerance, "method": method, "rows": _of(rows, by, tolerance, method)}
        for by in names
        for tolerance in tolerances
        for method in METHODS
    ]

    def column(key: str, unit: float = 1.0) -> Callable[[Row], object]:
        return lambda r: interval(r["rows"], key, unit)

    parts = {part: column(part) for part in PARTS}
    columns: dict[str, Callable[[Row], object]] = {
        "recordings": lambda r: r["by"],
        "clips": lambda r: len(r["rows"]),
        "tolerance": lambda r: f"{r['tolerance']:g}",
        "movement": lambda r: r["method"],
        "postures a second": column("postures"),
        **{f"{part}, degrees": cell for part, cell in parts.items()},
        "pelvis, cm": column("pelvis"),
        "followed, % of frames": lambda r: (
            "" if r["rows"][0]["followed"] == "" else interval(r["rows"], "followed", 100.0)
        ),
    }
    unwritten: dict[str, Callable[[Row], object]] = {
        "recordings": lambda r: r["by"],
        **{f"{part}, degrees": column(f"unwritten_{part}") for part in PARTS},
        "worst joint, clips": lambda r: _counted(r["rows"], "unwritten_joint"),
        "no leg bears, % of frames": column("unsupported", 100.0),
        "and the body turns, %": column("turning", 100.0),
        "in the air, %": column("aloft", 100.0),
    }
    named: dict[str, Callable[[Row], object]] = {
        "recordings": lambda r: r["by"],
        **{f"{part}, %": column(f"named_{part}", 100.0) for part in PARTS},
    }
    once = [group for group in groups if (group["tolerance"], group["method"]) == (tolerances[0], METHODS[0])]
    wide = [group for group in groups if (group["tolerance"], group["method"]) == (tolerances[-1], METHODS[0])]
    return (
        f"{markdown(columns, groups)}\n\nWhat cannot be written:\n\n{markdown(unwritten, once)}\n\n"
        f"Positions with names in ballet, at {tolerances[-1]:g} degrees:\n\n{markdown(named, wide)}"
    )
