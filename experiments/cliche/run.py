"""How long are paths, and how much of a cliche, as novelty grows?"""

from __future__ import annotations

from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import engine, pairs, posture, recorded
from motionmind.metrics.paths import arrival_spread, learn_habits

BUDGET = 20_000  # nodes; what is not proven by then is as good as it matters here
SHOWN = (0.0, 0.5, 1.0)


def jobs(setting: Setting) -> list[dict[str, Any]]:
    data = str(setting.data) if setting.data else None
    if setting.quick:
        made = [("karate", "")]
    else:
        made = [("ballet", ""), ("ballet", "codebook"), ("ballet", "quaternion"), ("karate", ""), ("medley", "")]
        made += [(name, kind) for name in recorded(data, "cmu-05") for kind in ("codebook", "quaternion", "euler")]
    steps, count = (3, 3) if setting.quick else (11, 40)
    return [
        {"data": data, "corpus": name, "kind": kind, "novelty": float(novelty), "count": count, "seed": 0}
        for name, kind in made
        for novelty in np.linspace(0.0, 1.0, steps).round(3)
    ]


def work(data: str | None, corpus: str, kind: str, novelty: float, count: int, seed: int) -> list[Row]:
    """Make tweens between the same pairs of postures of a corpus, all with one novelty."""
    found = engine(data, corpus, kind)
    habits = learn_habits(found.grammar)
    moves, spread, bridged, unattested = [], [], [], []
    cliches, frequency, likely = [], [], []
    made: set[tuple[int, int, int]] = set()
    for a, b in pairs(found.corpus, count, seed):
        tween = found.tween(posture(found.corpus, a), posture(found.corpus, b), novelty=novelty, node_budget=BUDGET)
        path = tween.path
        moves.append(tween.moves)
        spread.append(arrival_spread(path))
        bridged.append(len(tween.bridges))
        unattested.append(1.0 - tween.attested)
        cliches.append(habits.cliches(path))
        frequency.append(habits.percentiles(path))
        likely.append(habits.log_likelihoods(path))
        for before, after in zip(path[:-1, : habits.joints], path[1:, : habits.joints], strict=True):
            changed = np.flatnonzero(before != after)
            made.update(zip(changed.tolist(), before[changed].tolist(), after[changed].tolist(), strict=True))
    graph = habits.transitions
    chain = np.searchsorted(graph.starts, graph.sources, side="right") - 1
    there = np.count_nonzero(~habits.is_hold & (chain < habits.joints))
    own = [np.asarray(found.states[clip.start : clip.stop]) for clip in found.corpus.clips]
    return [
        {
            "corpus": corpus,
            "discretization": kind or "its own",
            "novelty": novelty,
            "tweens": count,
            "moves": np.mean(moves),
            "arrival_spread": np.mean(spread),
            "cliche_rate": np.concatenate(cliches).mean(),
            "own_cliche_rate": np.concatenate([habits.cliches(path) for path in own]).mean(),
            "frequency": np.concatenate(frequency).mean(),
            "log_likelihood": np.concatenate(likely).mean(),
            "own_log_likelihood": np.concatenate([habits.log_likelihoods(path) for path in own]).mean(),
            "variety": len(made) / there,
            "unattested": np.mean(unattested),
            "bridges": np.mean(bridged),
        }
    ]


def chart(rows: list[Row]) -> str:
    def panel(title: str, x: str, y: str) -> Panel:
        out = Panel(title, x.replace("_", " "), y.replace("_", " "))
        for row in rows:
            out.series.setdefault(_name(row), []).append((row[x], row[y]))
        return out

    return svg(
        [
            panel("Cliche", "novelty", "cliche_rate"),
            panel("Length", "novelty", "moves"),
            panel("Variety", "novelty", "variety"),
            panel("Likelihood against cliche", "log_likelihood", "cliche_rate"),
            panel("Likelihood against variety", "log_likelihood", "variety"),
            panel("How unevenly joints arrive", "novelty", "arrival_spread"),
        ]
    )


def tell(rows: list[Row]) -> str:
    nearest = {row["novelty"] for row in rows}
    shown = [min(nearest, key=lambda novelty: abs(novelty - wanted)) for wanted in SHOWN]
    return markdown(
        {
            "corpus": lambda r: r["corpus"],
            "states": lambda r: r["discretization"],
            "novelty": lambda r: f"{r['novelty']:g}",
            "moves": lambda r: f"{r['moves']:.1f}",
            "arrival spread": lambda r: f"{r['arrival_spread']:.2f}",
            "cliche rate": lambda r: f"{r['cliche_rate']:.0%}",
            "the corpus's": lambda r: f"{r['own_cliche_rate']:.0%}",
            "frequency": lambda r: f"{r['frequency']:.0f}",
            "nats a transition": lambda r: f"{r['log_likelihood']:.2f}",
            "the corpus's own": lambda r: f"{r['own_log_likelihood']:.2f}",
            "variety": lambda r: f"{r['variety']:.1%}",
            "bridges": lambda r: f"{r['bridges']:.1f}",
        },
        [row for row in rows if row["novelty"] in shown],
    )


def _name(row: Row) -> str:
    return f"{row['corpus']}, {row['discretization']}"
