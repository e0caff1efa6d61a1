"""A duration of its own: how long movements take, beside what dancers took, and beside how far it is."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import engine, families, movement, pairs, posture, recorded, without
from motionmind import Engine, Motion, NoPathError, Posture
from motionmind.learned.pace import LONGEST_WINDOW_S, SHORTEST_WINDOW_S, find_still, way_between, way_of
from motionmind.learned.sampled import SAMPLED_FPS

RECORDINGS = ("cmu-05", "indian", "cmu-16", "cmu-135", "bandai")
BUDGET = 20_000
RULES: dict[str, dict[str, Any]] = {"own": {}, "without pace": {"without": ["pace"]}}


def jobs(setting: Setting) -> list[dict[str, Any]]:
    data = str(setting.data) if setting.data else None
    by = ["ballet"] if setting.quick else ["ballet", *recorded(data, *RECORDINGS)]
    most, few = (3, 8) if setting.quick else (12, 120)
    held = [
        {"data": data, "by": one, "family": number, "most": most, "seed": 0}
        for one in by
        for number in range(1 if setting.quick else len(families(data, one)))
    ]
    return [*held, *({"data": data, "by": one, "family": -1, "most": few, "seed": 1} for one in by)]


def work(data: str | None, by: str, family: int, most: int, seed: int) -> list[Row]:
    """Make tweens between still moments of a family of recordings, learned without it; or between random postures."""
    found, ends = _random(data, by, most, seed) if family < 0 else _danced(data, by, family, most, seed)
    rows: list[Row] = []
    for a, b, danced in ends:
        way = way_between(a, b)
        for rule, asked in RULES.items():
            row: Row = {
                "by": by,
                "rule": rule,
                "danced": danced,
                "seconds": float("nan"),
                "moves": 0,
                "turned": float(np.degrees(way.joints.mean())),
                "travelled": float(way.travel) * a.skeleton.height,
                "faced": float(np.degrees(way.turn)),
                "ms": float("nan"),
            }
            try:
                tween = found.tween(a, b, node_budget=BUDGET, **asked)
            except NoPathError:
                pass
            else:
                spent = sum(tween.seconds[step] for step in ("problem", "bound", "search"))
                row |= {"seconds": float(tween.motion.times[-1]), "moves": tween.moves, "ms": 1000.0 * spent}
            rows.append(row)
    return rows


def _random(data: str | None, by: str, count: int, seed: int) -> tuple[Engine, list[tuple[Posture, Posture, float]]]:
    """Return an engine of all recordings, and random pairs of their postures, at their recorded places."""
    found = engine(data, by)
    whole = found.corpus
    return found, [(posture(whole, i), posture(whole, k), float("nan")) for i, k in pairs(whole, count, seed) if i != k]


def _danced(
    data: str | None, by: str, family: int, most: int, seed: int
) -> tuple[Engine, list[tuple[Posture, Posture, float]]]:
    """Return an engine without a family of recordings, and pairs of its still moments with the seconds between."""
    windows = windows_of(data, by, family)
    chosen = np.random.default_rng([seed, family]).permutation(len(windows))[:most]
    ends = [(clip.posture(i), clip.posture(k), (k - i) / SAMPLED_FPS) for clip, i, k in (windows[n] for n in chosen)]
    return without(data, by, families(data, by)[family][0]), ends


def windows_of(data: str | None, by: str, family: int) -> list[tuple[Motion, int, int]]:
    """Return the windows of a family of recordings: a clip, and two frames of it at which it is still."""
    out = []
    for take in families(data, by)[family]:
        for piece in movement(data, by, 1).get(take, []):
            clip = piece.resample(SAMPLED_FPS)
            still = find_still(way_of(clip).joints.mean(axis=1)) if len(clip) > 1 else []
            out += [
                (clip, i, k)
                for i, k in combinations(still, 2)
                if SHORTEST_WINDOW_S <= (k - i) / SAMPLED_FPS <= LONGEST_WINDOW_S
            ]
    return out


# --- what is told -----------------------------------------------------------------------------------------------------


def means(rows: list[Row]) -> list[Row]:
    out = []
    for by, rule in dict.fromkeys((row["by"], row["rule"]) for row in rows):
        mine = [row for row in rows if (row["by"], row["rule"]) == (by, rule) and row["moves"]]
        danced = [row for row in mine if row["danced"] == row["danced"]]
        far = [row for row in mine if row["danced"] != row["danced"]]
        out.append(
            {
                "by": by,
                "rule": rule,
                "windows": len(danced),
                "ratio": _median([row["seconds"] / row["danced"] for row in danced]),
                "agrees": _spearman(danced, "danced"),
                "pairs": len(far),
                "median": _median([row["seconds"] for row in far]),
                "travelled": _spearman(far, "travelled"),
                "turned": _spearman(far, "turned"),
                "ms": _median([row["ms"] for row in far]),
            }
        )
    return out


def _median(values: list[float]) -> float:
    return float(np.median(values)) if values else float("nan")


def _spearman(rows: list[Row], key: str) -> float:
    """Spearman's correlation of seconds with something."""
    if len(rows) < 3:
        return float("nan")
    return float(spearmanr([row["seconds"] for row in rows], [row[key] for row in rows])[0])


def chart(rows: list[Row]) -> str:
    panels = []
    for by in dict.fromkeys(row["by"] for row in rows):
        panel = Panel(f"by {by}", "metres apart", "seconds", joined=False)
        for rule in RULES:
            far = [row for row in rows if (row["by"], row["rule"]) == (by, rule) and row["danced"] != row["danced"]]
            panel.series[rule] = [(row["travelled"], row["seconds"]) for row in far if row["moves"]]
        panels.append(panel)
    return svg(panels)


def tell(rows: list[Row]) -> str:
    return markdown(
        {
            "learned from": lambda r: r["by"],
            "rule": lambda r: r["rule"],
            "windows": lambda r: r["windows"],
            "own duration over danced": lambda r: f"{r['ratio']:.2f}",
            "Spearman of both": lambda r: f"{r['agrees']:.2f}",
            "random pairs": lambda r: r["pairs"],
            "seconds": lambda r: f"{r['median']:.2f}",
            "Spearman with travel": lambda r: f"{r['travelled']:.2f}",
            "with turning": lambda r: f"{r['turned']:.2f}",
            "search, ms": lambda r: f"{r['ms']:.0f}",
        },
        means(rows),
    )
