"""In-betweening held-out clips: how near the truth, how smooth and how steady on its feet a tween is."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import FPS, RECORDED, movement, recorded, without
from motionmind import Engine, Motion, NoPathError, Posture
from motionmind._typing import Floats
from motionmind.geometry import rotations as rot
from motionmind.metrics import (
    StyleClassifier,
    angular_jerk,
    find_floor,
    fit_style_classifier,
    foot_slide,
    l2p,
    l2q,
    npss,
    position_spread,
    seen,
    skating,
)
from motionmind.realise.realise import realise

Made = tuple[Floats, Floats]  # rotations [T, J, 4], root [T, 3]

GAPS = (0.6, 1.2, 2.0, 4.0)  # seconds
WINDOWS = 300  # a gap
LONGEST = 60  # moves
BUDGET = 2_000
KINDS = ("danced", "hold A", "slerp", "spline", "whole bodies", "path", "mean")


def jobs(setting: Setting) -> list[dict[str, Any]]:
    """Return a job for each odd sequence, with its windows; the engine was tuned on windows of the even ones."""
    data = str(setting.data) if setting.data else None
    name = next(iter(recorded(data, "cmu-05")), "karate")
    out = []
    for seconds in GAPS[:2] if setting.quick else GAPS:
        frames = round(seconds * FPS)
        sequences = {key: pieces for key, pieces in movement(data, name, frames).items() if kept_apart(key)}
        places = [
            (sequence, piece, start)
            for sequence, pieces in sequences.items()
            for piece, motion in enumerate(pieces)
            for start in range(len(motion) - frames)
        ]
        rng = np.random.default_rng(round(10 * seconds))
        count = 4 if setting.quick else WINDOWS
        drawn = [places[k] for k in np.sort(rng.permutation(len(places))[:count])]
        for sequence in sequences:
            mine = [[piece, start] for key, piece, start in drawn if key == sequence]
            if mine:
                out.append({"data": data, "name": name, "sequence": sequence, "seconds": seconds, "windows": mine})
    return out


def kept_apart(sequence: str) -> bool:
    """Return whether a sequence was left out of all tuning: odd-numbered recordings, and names of odd length."""
    found = re.search(r"(\d+)$", sequence)
    return (int(found[1]) if found else len(sequence)) % 2 == 1


def work(data: str | None, name: str, sequence: str, seconds: float, windows: list[list[int]]) -> list[Row]:
    """Fill the windows of one sequence with what was learned from the others, and measure each method's result."""
    frames = round(seconds * FPS)
    engine, who, spread = _engine(data, name, sequence), judge(data, name, frames), _spread(data, name, frames)
    out = []
    for piece, start in windows:
        whole = movement(data, name, frames)[sequence][piece]
        real = whole.slice(start, start + frames + 1)
        floor = find_floor(whole.skeleton, whole.rotations, whole.root)
        truth, places = seen(real.skeleton, real.rotations, real.root, real.rotations, real.root)
        for kind, (rotations, root) in made(engine, real, seconds):
            turned, put = seen(real.skeleton, rotations, root, real.rotations, real.root)
            out.append(
                {
                    "corpus": name,
                    "sequence": sequence,
                    "seconds": seconds,
                    "window": f"{piece}:{start}",
                    "kind": kind,
                    "l2q": l2q(truth[1:-1], turned[1:-1]),
                    "l2p": l2p(places[1:-1], put[1:-1], spread),
                    "npss": npss(truth[None, 1:-1], turned[None, 1:-1]),
                    "power": _power(truth[1:-1]),
                    "jerk": angular_jerk(rotations, FPS).mean(),
                    "skating": skating(real.skeleton, rotations, root, floor),
                    "slide": foot_slide(real.skeleton, rotations, root, floor),
                    "taken": int(who.takes(rotations[:frames], name, sequence)),
                }
            )
    return out


def made(engine: Engine, real: Motion, seconds: float) -> Iterator[tuple[str, Made]]:
    """Yield the real movement between the ends of `real`, then each method's, with the method's name."""
    a, b = real.posture(0), real.posture(-1)
    share = np.linspace(0.0, 1.0, len(real))[:, None]
    line = a.root + share * (b.root - a.root)
    yield "danced", (real.rotations, real.root)
    yield "hold A", (np.repeat(a.rotations[None], len(real), axis=0), np.repeat(a.root[None], len(real), axis=0))
    yield "slerp", (rot.slerp(a.rotations[None], b.rotations[None], share), line)
    # With nothing known but two postures a rotation spline is SLERP with another clock: at rest at both ends.
    ease = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    yield "spline", (rot.slerp(a.rotations[None], b.rotations[None], ease), a.root + ease * (b.root - a.root))
    try:
        whole = engine.tween(a, b, duration=seconds, moves=(1, LONGEST), posturewise=True, fps=FPS).motion
        yield "whole bodies", (whole.rotations, whole.root)
    except NoPathError:
        pass  # the table says how many there are
    tween = _tween(engine, a, b, seconds)
    yield "mean", (tween.motion.rotations, tween.motion.root)
    within = np.radians(engine.space.tolerances[: len(a.skeleton)])
    path, _ = realise(tween.path, a, b, engine.corpus, engine.grammar, engine.carriage, FPS, seconds, within=within)
    yield "path", (path.rotations, path.root)


def _tween(engine: Engine, a: Posture, b: Posture, seconds: float) -> Any:
    """Return a tween in the usual number of moves or, if none exists, in as few as it needs."""
    try:
        return engine.tween(a, b, duration=seconds, node_budget=BUDGET, fps=FPS)
    except NoPathError:
        least = max(1, round(seconds * 5.0))
        return engine.tween(a, b, duration=seconds, moves=(least, LONGEST), node_budget=BUDGET, fps=FPS)


@lru_cache(maxsize=1)
def _engine(data: str | None, name: str, sequence: str) -> Engine:
    return without(data, name, sequence)


@lru_cache(maxsize=4)
def judge(data: str | None, name: str, frames: int) -> StyleClassifier:
    """Return a classifier that tells the corpus from others by windows of its movement."""
    names = [name, *recorded(data, *(other for other in RECORDED if other != name))] if name in RECORDED else []
    return fit_style_classifier(
        {
            one: {key: [piece.rotations for piece in pieces] for key, pieces in movement(data, one, frames).items()}
            for one in names or ["karate", "ballet"]
        },
        frames,
    )


@lru_cache(maxsize=4)
def _spread(data: str | None, name: str, frames: int) -> Floats:
    """Return the unit of L2P: the spread of positions in all windows that lie half their length apart, metres.

    A coordinate that hardly changes, as across the hips of a body seen from its root, counts as if it spread by a
    millimetre.
    """
    windows = []
    for pieces in movement(data, name, frames).values():
        for piece in pieces:
            for start in range(0, len(piece) - frames, frames // 2):
                part = piece.slice(start, start + frames + 1)
                windows.append(seen(part.skeleton, part.rotations, part.root, part.rotations, part.root)[1])
    return np.maximum(position_spread(np.stack(windows)), 1e-3)


def _power(rotations: Floats) -> float:
    """Return a window's weight in NPSS: the sum of squares of all Fourier coefficients' real parts."""
    flips = np.sum(rotations[1:] * rotations[:-1], axis=-1, keepdims=True) < 0.0
    sign = np.concatenate([np.ones((1, *flips.shape[1:])), np.cumprod(np.where(flips, -1.0, 1.0), axis=0)])
    return float(np.sum(np.fft.fft(rotations * sign, axis=0).real ** 2))


# --- the report -------------------------------------------------------------------------------------------------------


def summary(rows: list[Row]) -> list[Row]:
    """Return a row for each gap and method: means; NPSS weighted by power; jerk beside the range of real movement."""
    out = []
    for seconds in dict.fromkeys(row["seconds"] for row in rows):
        here = [row for row in rows if row["seconds"] == seconds]
        danced = np.sort([row["jerk"] for row in here if row["kind"] == "danced"])
        for kind in KINDS:
            mine = [row for row in here if row["kind"] == kind]
            if not mine:
                continue
            known = {row["window"] + row["sequence"] for row in mine}
            slerp = [row for row in here if row["kind"] == "slerp" and row["window"] + row["sequence"] in known]
            jerk = np.array([row["jerk"] for row in mine])
            low, high = np.quantile(danced, [0.05, 0.95])
            out.append(
                {
                    "seconds": seconds,
                    "kind": kind,
                    "windows": len(mine),
                    **{key: float(np.mean([row[key] for row in mine])) for key in MEANS},
                    "npss": _npss(mine),
                    "jerk": float(np.median(jerk)),
                    "usual": float(np.mean((jerk >= low) & (jerk <= high))),
                    "gain": 1.0 - sum(row["l2q"] for row in mine) / max(sum(row["l2q"] for row in slerp), 1e-12),
                    "low": float(low),
                    "high": float(high),
                }
            )
    return out


MEANS = ("l2q", "l2p", "skating", "slide", "taken")


def _npss(rows: list[Row]) -> float:
    return float(np.average([row["npss"] for row in rows], weights=[row["power"] for row in rows]))


def chart(rows: list[Row]) -> str:
    panels = []
    found = summary(rows)
    for title, key in (
        ("L2Q", "l2q"),
        ("NPSS", "npss"),
        ("median jerk, rad/s3", "jerk"),
        ("frames in which a foot skates", "skating"),
        ("taken for the corpus", "taken"),
        ("L2P", "l2p"),
    ):
        panel = Panel(title, "seconds between A and B", "", log=True)
        for kind in KINDS:
            if key in ("l2q", "l2p", "npss") and kind == "danced":
                continue
            panel.series[kind] = [(row["seconds"], row[key]) for row in found if row["kind"] == kind]
        panels.append(panel)
    return svg(panels, columns=3)


def tell(rows: list[Row]) -> str:
    columns: dict[str, Callable[[Row], object]] = {
        "s": lambda r: f"{r['seconds']:g}",
        "": lambda r: r["kind"],
        "windows": lambda r: r["windows"],
        "L2Q": lambda r: f"{r['l2q']:.3f}",
        "below SLERP's": lambda r: f"{r['gain']:.1%}",
        "L2P": lambda r: f"{r['l2p']:.2f}",
        "NPSS": lambda r: f"{r['npss']:.3f}",
        "jerk, rad/s³": lambda r: f"{r['jerk']:.0f} ({r['low']:.0f} to {r['high']:.0f})",
        "jerk is usual": lambda r: f"{r['usual']:.0%}",
        "skating": lambda r: f"{r['skating']:.1%}",
        "slide, cm": lambda r: f"{r['slide']:.2f}",
        "taken for the corpus": lambda r: f"{r['taken']:.0%}",
    }
    return markdown(columns, summary(rows))
