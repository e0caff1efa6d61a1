"""Restyling: what is kept of recordings danced in ballet's style, or their own, beside an eased slerp."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from time import process_time
from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import corpus, engine, recorded, recordings
from motionmind import Motion
from motionmind.geometry import rotations as rot
from motionmind.metrics.figures import at_rate
from motionmind.metrics.smoothness import angular_jerk
from motionmind.transcription.restyling import Restyled, measured, restyle

RECORDINGS = ("cmu-05", "cmu-135", "indian", "cmu-29")
CLIPS = (2, 5)  # of each
SECONDS = 6.0  # of each clip, from its middle
SETTINGS = (("ballet", 0.5), ("ballet", 1.0), ("own", 0.5))
METHODS = ("recording", "eased slerp", "restyle")


def jobs(setting: Setting) -> list[dict[str, Any]]:
    if setting.quick:
        return [{"data": None, "by": "karate", "number": 0, "seconds": 1.0, "style": "ballet", "shortest": 0.5}]
    return [
        {
            "data": str(setting.data),
            "by": by,
            "number": number,
            "seconds": SECONDS,
            "style": style,
            "shortest": shortest,
        }
        for by in recorded(setting.data, *RECORDINGS)
        for style, shortest in SETTINGS
        for number in CLIPS
    ]


def work(data: str | None, by: str, number: int, seconds: float, style: str, shortest: float) -> list[Row]:
    """Restyle a clip, and measure it, the recording and an eased slerp through the same postures."""
    clip = _clip(data, by, number, seconds)
    corpus_of = engine(data, by if style == "own" else style)
    began = process_time()
    found = restyle(clip, corpus_of, shortest=shortest)
    took = (process_time() - began) / found.motion.times[-1]
    rows = []
    for method, motion in zip(METHODS, (found.source, _eased(found), found.motion), strict=True):
        result = replace(found, motion=motion)
        rows.append(
            {
                "by": by,
                "clip": clip.name,
                "style": style,
                "shortest": shortest,
                "method": method,
                "postures": len(found.keys) / float(found.motion.times[-1]),
                "at_keys": float(result.degrees[found.keys].max()),
                "place": float(result.centimetres[found.keys].max()),
                "between": float(np.median(result.degrees)),
                "path": float(np.percentile(result.centimetres, 95.0)),
                **measured(motion, corpus_of),
                "jerk": float(angular_jerk(motion.rotations, motion.fps).mean()),
                "optimal": float(np.mean([link.status == "optimal" for link in found.links])),
                "faster": float(np.mean([bool(link.faster) for link in found.links])),
                "cost": found.cost / float(found.motion.times[-1]),
                "seconds": float(took),
            }
        )
    return rows


def _clip(data: str | None, by: str, number: int, seconds: float) -> Motion:
    """Return the middle of a clip, at 30 frames a second."""
    if data is None:
        whole = corpus(None, by)
        motion = replace(at_rate(whole.recording(whole.clips[number])), keyframed=False)
    else:
        motion = at_rate(recordings(data, by)[number])
    frames = round(seconds * motion.fps)
    start = max((len(motion) - frames) // 2, 0)
    return motion.slice(start, start + frames + 1)


def _eased(found: Restyled) -> Motion:
    """Return the kept postures joined by slerp, each stretch of least jerk (Flash and Hogan, 1985)."""
    rotations, root = found.source.rotations.copy(), found.source.root.copy()
    for start, end in pairwise(found.keys):
        part = np.linspace(0.0, 1.0, end - start + 1)
        share = (part**3 * (10.0 - 15.0 * part + 6.0 * part**2))[:, None]
        rotations[start : end + 1] = rot.slerp(rotations[start][None], rotations[end][None], share)
        root[start : end + 1] = root[start] + share * (root[end] - root[start])
    return replace(found.source, rotations=rotations, root=root)


def chart(rows: list[Row]) -> str:
    panels = []
    for by in dict.fromkeys(row["by"] for row in rows):
        panel = Panel(f"{by} in ballet", "attested, %", "feet slide, cm a frame", joined=False)
        for method in METHODS:
            found = [row for row in rows if (row["by"], row["method"]) == (by, method) and row["style"] == "ballet"]
            panel.series[method] = [(100.0 * row["attested"], row["slide"]) for row in found]
        panels.append(panel)
    return svg(panels, columns=2)


def _of(rows: list[Row], group: tuple[str, str, float], method: str) -> list[Row]:
    return [row for row in rows if (row["by"], row["style"], row["shortest"]) == group and row["method"] == method]


def _mean(rows: list[Row], key: str) -> float:
    return float(np.mean([row[key] for row in rows]))


def tell(rows: list[Row]) -> str:
    groups = list(dict.fromkeys((row["by"], row["style"], row["shortest"]) for row in rows))
    lines = [
        {"group": group, "method": method, "rows": _of(rows, group, method)} for group in groups for method in METHODS
    ]
    columns: dict[str, Callable[[Row], object]] = {
        "recordings": lambda r: r["group"][0],
        "corpus": lambda r: r["group"][1],
        "shortest, s": lambda r: f"{r['group'][2]:g}",
        "movement": lambda r: r["method"],
        "clips": lambda r: len(r["rows"]),
        "postures a second": lambda r: f"{_mean(r['rows'], 'postures'):.1f}",
        "off at postures, degrees": lambda r: f"{max(row['at_keys'] for row in r['rows']):.1f}",
        "between, degrees": lambda r: f"{_mean(r['rows'], 'between'):.1f}",
        "pelvis in 95 %, cm": lambda r: f"{_mean(r['rows'], 'path'):.1f}",
        "attested, %": lambda r: f"{100.0 * _mean(r['rows'], 'attested'):.0f}",
        "slide, cm a frame": lambda r: f"{_mean(r['rows'], 'slide'):.3f}",
        "skating, %": lambda r: f"{100.0 * _mean(r['rows'], 'skating'):.0f}",
        "jerk, rad/s^3": lambda r: f"{_mean(r['rows'], 'jerk'):.0f}",
    }
    took, optimal, faster = (_mean(rows, key) for key in ("seconds", "optimal", "faster"))
    return (
        f"{markdown(columns, lines)}\n\n{optimal:.0%} of the tweens are optimal; {faster:.0%} have a body part that is "
        f"faster than anything in the corpus. A second of dance takes {took:.1f} s of processor time."
    )
