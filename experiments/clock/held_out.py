"""False alarms and detection on recordings on which the bounds were not chosen: an automatic rule chooses them.

The rule takes the tightest bounds that question no recording, and no part of one, at its right rate, and widens them by
a margin. It chooses them on half of the people, and they are tried on the other half, and the reverse.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from experiments.harness import Row, markdown
from motionmind._typing import Floats
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.body.tempo import Bounds, Signs, question_signs

MARGINS = (0.0, 0.1, 0.25, 0.5)
N_DRAWS = 4_000  # of families, for an interval
SIGNS = ("flight", "fall", "cadence", "pull_low", "pull_high", "pull", "leg")


def signs_row(signs: Signs | None) -> Row:
    """Return signs as plain values, NaN where there are none."""
    if signs is None:
        return dict.fromkeys(SIGNS, np.nan)
    values = (signs.flight, signs.fall, signs.cadence, *signs.pulls, signs.pull, signs.leg)
    return dict(zip(SIGNS, values, strict=True))


def signs_of(row: Row) -> Signs:
    return Signs(
        row["flight"], row["fall"], row["cadence"], (row["pull_low"], row["pull_high"]), row["pull"], row["leg"]
    )


def choose_bounds(rows: Sequence[Row], margin: float) -> Bounds:
    """Return the tightest bounds that question none of the rows at their right rate, widened by a share of each."""
    right = [row for row in rows if row["speed"] == 1.0]

    def least(key: str) -> float:
        return min((row[key] for row in right if np.isfinite(row[key])), default=0.0) / (1.0 + margin)

    def most(key: str) -> float:
        return max((row[key] for row in right if np.isfinite(row[key])), default=np.inf) * (1.0 + margin)

    # Nothing falls slower than gravity for long, whatever the recordings show.
    fall = max(most("fall"), GRAVITY_MPS2)
    return Bounds((least("flight"), most("flight")), fall, most("cadence"), (least("pull_high"), most("pull_low")))


def held_out(rows: list[Row]) -> str:
    """Return the tables of false alarms and detection on held-out halves; "" with fewer than two people."""
    people = list(dict.fromkeys(_person(row) for row in rows))
    if len(people) < 2:
        return ""
    halves = people[::2], people[1::2]
    ways = [(halves[0], halves[1]), (halves[1], halves[0])]
    lines = [
        {"tuned": " ".join(tuned), "margin": margin, "rows": questioned(rows, [(tuned, others)], margin)}
        for margin in MARGINS
        for tuned, others in ways
    ]
    splits = [
        (list(half), [one for one in people if one not in half]) for half in combinations(people, len(people) // 2)
    ]
    lines += [
        {"tuned": f"each of {len(splits)} halves", "margin": margin, "rows": questioned(rows, splits, margin)}
        for margin in MARGINS
    ]
    columns: dict[str, Callable[[Row], object]] = {
        "bounds chosen on": lambda r: r["tuned"],
        "widened by": lambda r: f"{r['margin']:.0%}",
        "recordings held out": lambda r: len({row["recording"] for row in r["rows"]}),
        "questioned at the right rate, %": lambda r: share(r["rows"], "whole", 1.0),
        "parts, %": lambda r: share(r["rows"], "part", 1.0),
    }
    for speed in sorted({row["speed"] for row in rows} - {1.0}):
        title = f"{speed:g} times too fast" if speed > 1.0 else f"{1.0 / speed:g} times too slow"
        columns[f"{title}, %"] = lambda r, speed=speed: share(r["rows"], "whole", speed)
    chosen = [f"on {' '.join(tuned)}: {_described(choose_bounds(_of(rows, tuned), 0.0))}" for tuned, _ in ways]
    worst = "; ".join(
        f"{100.0 * max(_alarms(rows, split, margin) for split in splits):.0f} % with a margin of {margin:.0%}"
        for margin in MARGINS
    )
    return (
        f"### Bounds chosen by rule on half of the people, tried on the other\n\n{markdown(columns, lines)}\n\n"
        f"Recordings questioned at the right rate in the worst of the {len(splits)} halves: {worst}.\n\n"
        f"Bounds without a margin, {'; '.join(chosen)}. Shipped: {_described(Bounds())}."
    )


def questioned(rows: list[Row], splits: Sequence[tuple[list[str], list[str]]], margin: float) -> list[Row]:
    """Return the rows of held-out people, once a split, with `hit`: questioned, and at a wrong rate the right way."""
    out = []
    for tuned, others in splits:
        bounds = choose_bounds(_of(rows, tuned), margin)
        for row in _of(rows, others):
            found = question_signs(signs_of(row), bounds)
            wanted = "" if row["speed"] == 1.0 else "slow" if row["speed"] < 1.0 else "fast"
            out.append(row | {"hit": bool(found) and wanted in found})
    return out


def _alarms(rows: list[Row], split: tuple[list[str], list[str]], margin: float) -> float:
    """Return the share of held-out recordings that are questioned at their right rate."""
    found = questioned(rows, [split], margin)
    return float(np.mean([row["hit"] for row in found if row["speed"] == 1.0 and row["of"] == "whole"]))


def share(rows: list[Row], kind: str, speed: float) -> str:
    """Return the share of hits, %, with its 95 % interval over families: takes of one phrase are not independent."""
    found = [row for row in rows if row["of"] == kind and row["speed"] == speed]
    names = list(dict.fromkeys((row["group"], row["family"]) for row in found))
    place = {name: number for number, name in enumerate(names)}
    at = np.array([place[row["group"], row["family"]] for row in found])
    hits = np.bincount(at, [row["hit"] for row in found])
    counts = np.bincount(at).astype(float)
    low, high = _interval(hits, counts)
    return f"{100.0 * hits.sum() / counts.sum():.1f} ({100.0 * low:.1f} to {100.0 * high:.1f})"


def _interval(hits: Floats, counts: Floats) -> tuple[float, float]:
    """Return the quantiles of the share over draws of families; with no hits or hits alone, by the rule of three."""
    if not hits.any():
        return 0.0, min(3.0 / len(hits), 1.0)
    if np.array_equal(hits, counts):
        return max(1.0 - 3.0 / len(hits), 0.0), 1.0
    draws = np.random.default_rng(0).integers(len(hits), size=(N_DRAWS, len(hits)))
    low, high = np.quantile(hits[draws].sum(axis=1) / counts[draws].sum(axis=1), [0.025, 0.975])
    return float(low), float(high)


def _person(row: Row) -> str:
    return str(row["group"]).partition(" ")[0]


def _of(rows: Sequence[Row], people: Sequence[str]) -> list[Row]:
    return [row for row in rows if _person(row) in people]


def _described(bounds: Bounds) -> str:
    low, high = bounds.flight
    return (
        f"flights {low:.2g} to {high:.2g} g, falls {bounds.fall:.2g} m/s2, cadence {bounds.cadence:.2g}, "
        f"steps {bounds.pull[0]:.2g} to {bounds.pull[1]:.2g} g"
    )
