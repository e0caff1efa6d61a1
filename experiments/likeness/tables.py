"""What was found, in tables and a chart."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, markdown
from experiments.likeness.filled import RIVALS, copies
from experiments.likeness.measure import AREAS, MOVING_GROUPS
from experiments.likeness.windows import POSTURES
from motionmind._typing import Floats

DRAWS = 4_000  # of families, for an interval


def chart(rows: list[Row]) -> str:
    """A panel for each dancer: how far below SLERP the error of each method is, and how well it is told apart."""
    panels = []
    for name in _each(rows, "corpus"):
        panel = Panel(
            f"{name}: told apart, and error", "L2Q below SLERP's, %, all lengths", "AUC, upper body", joined=False
        )
        for group in _groups([row for row in rows if row["corpus"] == name], "given", "kind"):
            if group[0]["kind"] != "danced":
                panel.series[_method(group[0])] = [(100.0 * gain(group), group[0]["upper linear"])]
        panels.append(panel)
    return svg(panels, columns=2)


def tell(rows: list[Row]) -> str:
    """README's tables."""
    parts = ["### Told apart: area under the ROC curve", _areas(rows)]
    parts += ["### L2Q below SLERP's, %", _gains(rows)]
    parts += ["### Beside the dancer", _compared(rows), "### L2Q below SLERP's, take by take, %"]
    for name in _each(rows, "corpus"):
        parts += [
            f"`{name}`, two postures; the number of windows in brackets.",
            takes([r for r in rows if r["corpus"] == name]),
        ]
    return "\n\n".join(parts)


def board(rows: list[Row]) -> str:
    """One table for comparing labels of one dancer at a glance: a line for each method."""
    gaps = _each(rows, "seconds")
    columns: dict[str, Callable[[list[Row]], object]] = {
        "given": lambda g: g[0]["given"],
        "method": lambda g: g[0]["kind"],
    }
    columns |= _columns("L2Q {:g} s", gaps, lambda gap, g: _percent(gain(_at(g, gap))))
    columns["L2Q all"] = lambda g: _percent(gain(g))
    if len(labels := [kind for kind in _each(rows, "kind") if kind not in RIVALS]) > 1:
        base = [row for row in rows if row["kind"] == labels[0]]
        columns[f"beside {labels[0]}"] = lambda g: "" if g[0]["kind"] in (*RIVALS, labels[0]) else _beside(g, base)
    columns["NPSS"] = lambda g: f"{mean(g, 'npss', 'power'):.2f}"
    columns |= _columns("{}", AREAS, lambda area, g: _area(g[0], area))
    columns |= _columns("{}", (*MOVING_GROUPS, "bounce"), lambda name, g: f"{ratio(g, name):.2f}")
    columns["low feet"] = lambda g: f"{low_feet(g):.2f}"
    columns["followed"] = lambda g: _percent(mean(g, "followed"))
    columns["windows"] = lambda g: sum(row["windows"] for row in g)
    columns["ms"] = lambda g: f"{1000 * mean(g, 'spent'):.0f}"
    groups = [group for group in _groups(rows, "given", "kind") if group[0]["kind"] != "danced"]
    lines = [{name: of(group) for name, of in columns.items()} for group in groups]
    return markdown(_columns("{}", columns, lambda name, line: line[name]), lines)


def board_of_takes(rows: list[Row]) -> str:
    """L2Q below SLERP's of each take over all lengths, a column for each method; two postures."""
    rows = [row for row in rows if row["given"] == POSTURES and row["kind"] not in ("danced", "slerp")]
    columns: dict[str, Callable[[Row], object]] = {
        "take": lambda r: r["take"],
        "windows": lambda r: r["windows"],
        "danced arms, rad/s": lambda r: f"{r['arms']:.2f}",
    }
    columns |= _columns("{}", _each(rows, "kind"), lambda kind, r: _percent(r[kind]))
    lines = []
    for group in _groups(rows, "take"):
        kinds = _groups(group, "kind")
        line = {"take": group[0]["take"], "windows": sum(row["windows"] for row in kinds[0])}
        line["arms"] = mean(kinds[0], "arms danced")
        lines.append(dict.fromkeys(_each(rows, "kind"), np.nan) | line | {one[0]["kind"]: gain(one) for one in kinds})
    return markdown(columns, lines)


# --- sums -------------------------------------------------------------------------------------------------------------


def gain(rows: Sequence[Row]) -> float:
    """Return how far the sum of L2Q over windows is below SLERP's in the same windows, as a share."""
    own, base = (sum(row["windows"] * row[key] for row in rows) for key in ("l2q", "slerp"))
    return float(1.0 - own / base) if rows else float("nan")


def interval(rows: Sequence[Row]) -> tuple[float, float]:
    """Return the 95 % interval of a gain over draws of families: windows of a family are not independent."""
    names = [row["family"] for row in rows]
    weights = np.array([row["windows"] for row in rows], dtype=float)
    own, base = (weights * [row[key] for row in rows] for key in ("l2q", "slerp"))
    sums = np.array([[x[[name == one for name in names]].sum() for x in (own, base)] for one in dict.fromkeys(names)])
    draws = sums[np.random.default_rng(0).integers(len(sums), size=(DRAWS, len(sums)))].sum(axis=1)
    low, high = np.quantile(1.0 - draws[:, 0] / draws[:, 1], [0.025, 0.975])
    return float(low), float(high)


def beside(rows: Sequence[Row], base: Sequence[Row]) -> tuple[float, float, float]:
    """Return how much less L2Q than another method's a method's is in the same windows, as a share of SLERP's.

    Returns:
        The share, and its 95 % interval over draws of families, which is narrower than that of either gain.
    """
    others = {_windows(row): row for row in base}
    pairs = [(row, others[_windows(row)]) for row in rows if _windows(row) in others]
    if not pairs:
        return np.nan, np.nan, np.nan
    joined = [row | {"l2q": row["slerp"] + row["l2q"] - other["l2q"]} for row, other in pairs]
    return gain(joined), *interval(joined)


def _windows(row: Row) -> tuple[object, ...]:
    return tuple(row[key] for key in ("given", "take", "seconds", "windows"))


def ratio(rows: Sequence[Row], name: str) -> float:
    """Return a measure's sum over windows in relation to the truth's."""
    own, danced = (sum(row["windows"] * row[key] for row in rows) for key in (name, f"{name} danced"))
    return float(own / danced) if danced else float("nan")


def low_feet(rows: Sequence[Row]) -> float:
    """Return the mean level speed of low feet in relation to the truth's."""
    low = ratio(rows, "low")
    return ratio(rows, "slid") / low if low else float("nan")


def mean(rows: Sequence[Row], key: str, weight: str | None = None) -> float:
    """Return a measure's mean over the windows that have it, weighted by `weight` if that names a measure."""
    weights: Floats = np.array([row["windows"] * (row[weight] if weight else 1.0) for row in rows])
    values = np.array([row[key] for row in rows], dtype=float)
    known = np.isfinite(values)
    return float(np.average(values[known], weights=weights[known])) if known.any() else float("nan")


# --- tables -----------------------------------------------------------------------------------------------------------


def _areas(rows: list[Row]) -> str:
    columns: dict[str, Callable[[Row], object]] = _named()
    columns["pieces"] = lambda r: r["pieces"]
    columns |= _columns("{}", AREAS, lambda area, r: _area(r, area, spread=True))
    return markdown(columns, [group[0] for group in _methods(rows)])


def _gains(rows: list[Row]) -> str:
    gaps = _each(rows, "seconds")
    columns = _named() | _columns("{:g} s", gaps, lambda gap, r: _spread(_at(r["rows"], gap)))
    groups = [group for group in _methods(rows) if group[0]["kind"] != "slerp"]
    return markdown(columns, [group[0] | {"rows": group} for group in groups])


def _compared(rows: list[Row]) -> str:
    """Each measure in relation to the dancer's own, 1 for as much; ratios of sums over windows."""
    columns = _named()
    columns |= _columns("{}", (*MOVING_GROUPS, "bounce"), lambda name, r: f"{ratio(r['rows'], name):.2f}")
    columns["low feet's speed"] = lambda r: f"{low_feet(r['rows']):.2f}"
    columns["NPSS"] = lambda r: f"{mean(r['rows'], 'npss', 'power'):.3f}"
    columns["follows its path"] = lambda r: _percent(mean(r["rows"], "followed"), " %")
    return markdown(columns, [group[0] | {"rows": group} for group in _methods(rows)])


def takes(rows: list[Row]) -> str:
    """A line for each take, and the engine's gain at each length."""
    rows = [row for row in rows if row["given"] == POSTURES and row["kind"] not in RIVALS]
    several = len(_each(rows, "kind")) > 1
    gaps = _each(rows, "seconds")
    columns: dict[str, Callable[[Row], object]] = {"take": lambda r: r["take"]}
    if several:
        columns["method"] = lambda r: r["kind"]
    columns["arms danced, rad/s"] = lambda r: f"{mean(r['rows'], 'arms danced'):.2f}"
    columns |= _columns("{:g} s", gaps, lambda gap, r: _counted(_at(r["rows"], gap)))
    return markdown(columns, [group[0] | {"rows": group} for group in _groups(rows, "take", "kind")])


def _columns(title: str, keys: Iterable[Any], of: Callable[[Any, Any], object]) -> dict[str, Callable[[Any], object]]:
    """Return a column for each key, which shows what `of` returns of the key and a line."""
    return {title.format(key): partial(of, key) for key in keys}


def _named() -> dict[str, Callable[[Row], object]]:
    return {"": lambda r: r["corpus"], "given": lambda r: r["given"], "method": lambda r: r["kind"]}


def _methods(rows: list[Row]) -> list[list[Row]]:
    return [group for group in _groups(rows, "corpus", "given", "kind") if group[0]["kind"] != "danced"]


def _method(row: Row) -> str:
    return str(row["kind"]) if row["given"] == POSTURES else f"{row['kind']}, {row['given']}"


def _area(row: Row, area: str, spread: bool = False) -> str:
    if not np.isfinite(row[area]):
        return ""
    value = f"{row[area]:.2f}" + ("~" if row["lenient"] and copies(str(row["kind"])) else "")
    return value + (f" ({row[f'{area} low']:.2f} to {row[f'{area} high']:.2f})" if spread else "")


def _spread(rows: list[Row]) -> str:
    if not rows:
        return ""
    if len(_each(rows, "family")) == 1:
        return f"{100 * gain(rows):.1f} (one family)"
    low, high = interval(rows)
    return f"{100 * gain(rows):.1f} ({100 * low:.1f} to {100 * high:.1f})"


def _beside(rows: list[Row], base: list[Row]) -> str:
    share, low, high = beside(rows, base)
    return f"{100 * share:+.1f} ({100 * low:+.1f} to {100 * high:+.1f})" if np.isfinite(share) else ""


def _counted(rows: list[Row]) -> str:
    return f"{_percent(gain(rows))} ({sum(row['windows'] for row in rows)})" if rows else ""


def _percent(share: float, unit: str = "") -> str:
    return f"{round(100 * share, 1) + 0.0:.1f}{unit}" if np.isfinite(share) else ""


def _at(rows: Sequence[Row], seconds: float) -> list[Row]:
    return [row for row in rows if row["seconds"] == seconds]


def _each(rows: Sequence[Row], key: str) -> list[Any]:
    found = list(dict.fromkeys(row[key] for row in rows))
    return sorted(found) if key == "seconds" else found


def _groups(rows: Sequence[Row], *keys: str) -> list[list[Row]]:
    """Group rows that have the same values of some keys, in the order in which each value comes first."""
    out: dict[tuple[object, ...], list[Row]] = {}
    for row in rows:
        out.setdefault(tuple(row[key] for key in keys), []).append(row)
    order = [_each(rows, key) for key in keys]
    return [out[key] for key in sorted(out, key=lambda one: [order[k].index(value) for k, value in enumerate(one)])]
