"""How varied movement is that is made of one clip alone, and how much of the clip is left."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.inbetween.genmm import Examples, freely
from experiments.material import FPS, RATE, RECORDED, corpus, part, recorded
from experiments.variety.measures import CLOSELY, coverage, distances, global_diversity, local_diversity
from motionmind import Engine, Motion, Piece, vary
from motionmind.chaos.flows import FLOWS
from motionmind.chaos.trajectories import trajectory
from motionmind.discretize import make_discretization
from motionmind.metrics.figures import at_rate
from motionmind.metrics.smoothness import angular_jerk

SAMPLES = 10  # of each method, from each clip
RECORDING = ("cmu-05", "05_12")  # the dancer's longest without a fault
TIMES = 2  # as long as the clip is what is made of it
BUDGET = 2_000
KINDS = ("vary", "GenMM")


def jobs(setting: Setting) -> list[dict[str, Any]]:
    """Return a job for each clip: those of the bundled ballet, or its shortest in a quick run, and a recording."""
    data = str(setting.data) if setting.data else None
    ballet = corpus(None, "ballet").clips
    if setting.quick:
        ballet = (min(ballet, key=len),)
    clips = [("ballet", clip.name) for clip in ballet]
    clips += [RECORDING] if recorded(data, RECORDING[0]) else []
    samples = 1 if setting.quick else SAMPLES
    return [
        {"data": data, "name": name, "clip": clip, "kind": kind, "samples": samples}
        for name, clip in (clips[:1] if setting.quick else clips)
        for kind in KINDS
    ]


def work(data: str | None, name: str, clip: str, kind: str, samples: int) -> list[Row]:
    """Make movement of a clip, and measure it beside the clip."""
    example, engine = learned_from(data, name, clip)
    out = []
    for sample in range(samples):
        if kind == "vary":
            made = varied(example, engine, sample).rotations
        else:
            made, _ = freely(Examples.of([example]), TIMES * len(example), sample)
        off = distances(made, example.rotations)
        out.append(
            {
                "corpus": name,
                "clip": clip,
                "kind": kind,
                "sample": sample,
                "frames": len(made),
                "coverage": coverage(off),
                "closely": coverage(off, CLOSELY),
                "global": global_diversity(off),
                "local": local_diversity(off),
                "jerk": angular_jerk(made, FPS).mean(),
                "own_jerk": angular_jerk(example.rotations, FPS).mean(),
            }
        )
    return out


@lru_cache(maxsize=1)
def learned_from(data: str | None, name: str, clip: str) -> tuple[Motion, Engine]:
    """Return a clip, 30 frames a second, and an engine that has seen nothing else."""
    whole = corpus(data, name)
    number = next(number for number, one in enumerate(whole.clips) if one.name == clip)
    engine = Engine.learn(part(whole, [number]), make_discretization("codebook", 15.0))
    return at_rate(whole.recording(whole.clips[number])), engine


def varied(example: Motion, engine: Engine, sample: int) -> Motion:
    """Return a variation of a clip's postures, 5 a second, from a start on the Lorenz attractor of its own."""
    starts = trajectory(FLOWS["lorenz"], count=sample + 1, every=2_000)
    piece = Piece.of(example, rate=RATE)
    length = TIMES * len(piece.frames)
    variation = vary(piece, engine, start=starts[sample], nudge=0.1, length=length, alternatives=1, node_budget=BUDGET)
    made = at_rate(variation.motion())
    return made.slice(0, min(TIMES * len(example), len(made)))  # insertions have made it longer


# --- the report -------------------------------------------------------------------------------------------------------


def summary(rows: list[Row]) -> list[Row]:
    """Return the means of each corpus and method, and how far the means of its clips are spread."""
    out = []
    for name in dict.fromkeys(row["corpus"] for row in rows):
        for kind in KINDS:
            mine = [row for row in rows if (row["corpus"], row["kind"]) == (name, kind)]
            found = {"corpus": name, "kind": kind, "clips": len({row["clip"] for row in mine}), "samples": len(mine)}
            for key in ("coverage", "closely", "global", "local", "jerk", "own_jerk"):
                found[key] = float(np.mean([row[key] for row in mine]))
            out.append(found)
    return out


def chart(rows: list[Row]) -> str:
    panels = []
    for title, key in (("local diversity", "local"), ("global diversity", "global")):
        panel = Panel(title, "closely covered, %", "", joined=False)
        for name in dict.fromkeys(row["corpus"] for row in rows):
            for kind in KINDS:
                mine = [row for row in rows if (row["corpus"], row["kind"]) == (name, kind)]
                panel.series[f"{kind}, {name}"] = [(100.0 * row["closely"], row[key]) for row in mine]
        panels.append(panel)
    return svg(panels, columns=2)


def tell(rows: list[Row]) -> str:
    columns: dict[str, Callable[[Row], object]] = {
        "": lambda r: f"{r['corpus']}, a recording" if r["corpus"] in RECORDED else f"bundled {r['corpus']}",
        "clips": lambda r: r["clips"],
        " ": lambda r: r["kind"],
        "samples": lambda r: r["samples"],
        "coverage": lambda r: f"{r['coverage']:.1%}",
        "closely covered": lambda r: f"{r['closely']:.1%}",
        "global diversity": lambda r: f"{r['global']:.2f}",
        "local diversity": lambda r: f"{r['local']:.2f}",
        "jerk, rad/s³ (the clip's)": lambda r: f"{r['jerk']:.0f} ({r['own_jerk']:.0f})",
    }
    return markdown(columns, summary(rows))
