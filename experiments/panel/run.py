"""The panel of 1998: abrupt transitions of chaotic variations, how many are solved, in how many moves, how awkward."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import RATE, corpus, engine, part, recorded
from motionmind import Engine, Motion, NoPathError, Piece
from motionmind._typing import Bools, Floats
from motionmind.chaos import find_flow
from motionmind.chaos.reorder import itinerary
from motionmind.discretize import make_discretization
from motionmind.metrics.figures import at_rate
from motionmind.metrics.smoothness import angular_jerk, angular_speed
from motionmind.variation.seams import judge_transitions

FLOWS, NUDGES, LENGTH = ("lorenz", "rossler"), (0.1, 0.3, 1.0), 200
RULES: dict[str, dict[str, Any]] = {
    "whole body": {"whole_body": True},
    "strict": {"strict": True},
    "bridged": {},
}
BUDGET = 20_000
FPS = 30.0
RARE = 99.0  # percentile of the corpus's own frames
STILL = 0.01  # rad/s: what a joint that never moves in a recording turns by rounding alone is less


def jobs(setting: Setting) -> list[dict[str, Any]]:
    data = str(setting.data) if setting.data else None
    by = ["adagio alone"] if setting.quick else ["adagio alone", "ballet", *recorded(data, "cmu-05")]
    return [
        {"data": data, "by": one, "rule": rule, "most": 4 if setting.quick else 60, "seed": 0}
        for one in by
        for rule in RULES
    ]


def work(data: str | None, by: str, rule: str, most: int, seed: int) -> list[Row]:
    """Join some abrupt transitions under one rule, one row each."""
    found, pieces = material(data, by)
    own = usual(found)
    pairs = [(piece, pair) for piece in pieces for pair in leaps(len(piece))]
    order = np.random.default_rng(seed).permutation(len(pairs))
    out: list[Row] = []
    for number in order:
        piece, pair = pairs[number]
        (transition,) = judge_transitions(piece, [pair], found, whole_body=False)
        if not transition.is_abrupt:
            continue
        row: Row = {
            "by": by,
            "rule": rule,
            "start": pair[0],
            "end": pair[1],
            "reverse": int(pair[1] < pair[0]),
            "solved": 0,
            "moves": float("nan"),
            "own_path": abs(pair[1] - pair[0]),
            "bridges": 0,
            "awkward": 0,
            "own_awkward": own.awkward,
        }
        try:
            tween = found.tween(*piece.ends(*pair), node_budget=BUDGET, fps=FPS, **RULES[rule])
        except NoPathError:
            pass
        else:
            row |= {"solved": 1, "moves": float(tween.moves), "bridges": len(tween.bridges)}
            row["awkward"] = int(awkward(tween.motion, tween.motion.insertions[0].times, own.speed, own.jerk).sum())
        out.append(row)
        if len(out) == most:
            break
    return out


@lru_cache(maxsize=2)
def material(data: str | None, by: str) -> tuple[Engine, list[Piece]]:
    """An engine, and the pieces that it is to smooth: the adagio of 68 postures, or all recordings."""
    if by == "cmu-05":
        found = engine(data, by)
        clips = found.corpus.clips
        return found, [Piece.of(found.corpus.motion(clip), RATE) for clip in clips if len(clip) > 20]
    whole = corpus(None, "ballet")
    (number,) = [n for n, clip in enumerate(whole.clips) if clip.name == "adagio"]
    piece = Piece.of(whole.motion(whole.clips[number]), facing=whole.facing)
    if by == "ballet":
        return engine(None, "ballet"), [piece]
    return Engine.learn(part(whole, [number]), make_discretization("ballet")), [piece]


def leaps(count: int) -> list[tuple[int, int]]:
    """List the pairs of postures between which variations of a piece of so many postures leave its order, once each."""
    found: dict[tuple[int, int], None] = {}
    for flow in FLOWS:
        for nudge in NUDGES:
            indices = itinerary(find_flow(flow), count, LENGTH, nudge=nudge).indices.tolist()
            found |= {(i, k): None for i, k in pairwise(indices) if k not in (i, i + 1)}
    return list(found)


@dataclass(frozen=True)
class Usual:
    """The speed and the jerk [J] that each joint of a corpus exceeds in one frame of a hundred, and how many in a
    hundred of the corpus's own moves count as awkward by these."""

    speed: Floats
    jerk: Floats
    awkward: float


@lru_cache(maxsize=2)
def usual(found: Engine) -> Usual:
    whole = found.corpus
    clips = [at_rate(whole.recording(clip)) for clip in whole.clips]
    speed = np.percentile(np.concatenate([angular_speed(clip.rotations, FPS) for clip in clips]), RARE, axis=0)
    speed = np.maximum(speed, STILL)
    long = [clip.rotations for clip in clips if len(clip) > 3]
    jerk = np.percentile(np.concatenate([angular_jerk(q, FPS) for q in long]), RARE, axis=0)
    own = [
        awkward(motion, whole.times[clip.start : clip.stop], speed, jerk)
        for motion, clip in zip(clips, whole.clips, strict=True)
    ]
    return Usual(speed, jerk, 100.0 * float(np.concatenate(own).mean()))


def awkward(motion: Motion, moves: Floats, speed: Floats, jerk: Floats) -> Bools:
    """Tell, for each move, whether some joint exceeds both its `speed` and its `jerk` [J]."""
    if len(motion) < 4:
        return np.zeros(len(moves) - 1, dtype=bool)

    def has(values: Floats, most: Floats, frames: int) -> Bools:
        """Tell whether each joint exceeds its limit within each move [T, J]; a value is of so many frames."""
        at = np.searchsorted(moves, motion.times[: len(values)] + 0.5 * frames / FPS, side="right") - 1
        out = np.zeros((len(moves) - 1, values.shape[1]), dtype=bool)
        np.logical_or.at(out, at.clip(0, len(out) - 1), values > most)
        return out

    fast = has(angular_speed(motion.rotations, FPS), speed, 1)
    return np.any(fast & has(angular_jerk(motion.rotations, FPS), jerk, 3), axis=1)


# --- what is told -----------------------------------------------------------------------------------------------------


def means(rows: list[Row]) -> list[Row]:
    out = []
    for by, rule in dict.fromkeys((row["by"], row["rule"]) for row in rows):
        mine = [row for row in rows if (row["by"], row["rule"]) == (by, rule)]
        solved = [row for row in mine if row["solved"]]
        back = [row for row in mine if row["reverse"]]
        lengths = [row["moves"] for row in solved] or [float("nan")]
        ahead = [row for row in solved if not row["reverse"]]
        out.append(
            {
                "by": by,
                "rule": rule,
                "abrupt": len(mine),
                "solved": len(solved) / len(mine),
                "reverse": sum(row["solved"] for row in back) / len(back) if back else float("nan"),
                "back": len(back),
                "median": float(np.median(lengths)),
                "least": min(lengths),
                "most": max(lengths),
                "shorter": float(np.mean([row["moves"] < row["own_path"] for row in ahead])) if ahead else float("nan"),
                "awkward": 100.0 * sum(row["awkward"] for row in solved) / max(sum(row["moves"] for row in solved), 1),
                "own_awkward": mine[0]["own_awkward"],
                "bridges": float(np.mean([row["bridges"] for row in solved])) if solved else float("nan"),
            }
        )
    return out


def chart(rows: list[Row]) -> str:
    panels = []
    for by in dict.fromkeys(row["by"] for row in rows):
        panel = Panel(f"by {by}", "postures apart in the piece", "moves of the tween", joined=False)
        for rule in RULES:
            panel.series[rule] = [
                (row["own_path"], row["moves"]) for row in rows if (row["by"], row["rule"]) == (by, rule)
            ]
        panels.append(panel)
    return svg(panels)


def tell(rows: list[Row]) -> str:
    return markdown(
        {
            "learned from": lambda r: r["by"],
            "rule": lambda r: r["rule"],
            "abrupt": lambda r: r["abrupt"],
            "solved": lambda r: f"{r['solved']:.0%}",
            "in reverse order": lambda r: f"{r['reverse']:.0%} of {r['back']}",
            "moves": lambda r: f"{r['least']:.0f} to {r['most']:.0f}, median {r['median']:.0f}",
            "shorter than the piece's own way": lambda r: f"{r['shorter']:.0%}",
            "awkward in 100 moves": lambda r: f"{r['awkward']:.1f}",
            "of the corpus's own": lambda r: f"{r['own_awkward']:.1f}",
            "bridges": lambda r: f"{r['bridges']:.1f}",
        },
        means(rows),
    )
