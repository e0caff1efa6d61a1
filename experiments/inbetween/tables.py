"""What a run of in-betweening found, in tables and a chart."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, markdown
from motionmind._typing import Floats

KINDS = (
    "danced",
    "slerp",
    "spline",
    "hermite",
    "nearest segment",
    "mean of eight",
    "GenMM",
    "whole bodies",
    "no guide",
    "motionmind",
)
SHOWN = "motionmind"  # whose results are listed take by take
DRAWS = 4_000  # of families, for an interval
MEANS = ("l2q", "l2p", "jerk", "usual", "skating", "slide", "taken", "off_path", "followed")


def chart(rows: list[Row]) -> str:
    """A panel for each dancer: how far below SLERP's the L2Q of each method is at each gap."""
    panels = []
    for name in _each(rows, "corpus"):
        panel = Panel(f"{name}: L2Q below SLERP's, %", "seconds between A and B", "", log=True)
        mine = [row for row in rows if row["corpus"] == name and _usual(row)]
        for kind in KINDS[2:]:
            if found := [row for row in mine if row["kind"] == kind]:
                points = [together(group) for group in _groups(found, "seconds")]
                panel.series[kind] = [(row["seconds"], 100.0 * row["gain"]) for row in points]
        panels.append(panel)
    return svg(panels, columns=2)


def tell(rows: list[Row]) -> str:
    usual = [row for row in rows if _usual(row)]
    foreign = [row for row in rows if row["teachers"] != row["corpus"]]
    moving = [row for row in rows if row["given"] != "two postures"]
    parts = ["### Windows", _windows(usual)]
    parts += ["### L2Q below SLERP's, %: two postures, learned from the dancer's other takes", _gains(usual)]
    if moving:
        parts += ["### The same with frames known beyond the ends", _gains(moving)]
    if foreign:
        parts += ["### The same as at first, learned from the other dancers alone", _gains(foreign)]
    for name in _each(usual, "corpus"):
        parts += [f"### {name}: all measures", _measures([row for row in usual if row["corpus"] == name])]
        parts += [_takes([row for row in usual if row["corpus"] == name and row["kind"] == SHOWN])]
    return "\n\n".join(parts)


def together(rows: Sequence[Row]) -> Row:
    """Return the means over windows of all that takes of one dancer, gap and method found.

    The `gain` is how far the sum of L2Q over windows is below SLERP's in the same windows, from `least` to `most` in 95
    of 100 draws of families with replacement: windows of a family are not independent.
    """
    weights = np.array([row["windows"] for row in rows], dtype=float)
    out = dict(rows[0]) | {key: _mean([row[key] for row in rows], weights) for key in MEANS}
    out["npss"] = _mean([row["npss"] for row in rows], np.array([row["power"] for row in rows]))
    out["windows"] = int(weights.sum())
    own, base = (weights * [row[key] for row in rows] for key in ("l2q", "slerp"))
    names = [row["family"] for row in rows]
    sums = np.array([[x[[name == one for name in names]].sum() for x in (own, base)] for one in dict.fromkeys(names)])
    draws = sums[np.random.default_rng(0).integers(len(sums), size=(DRAWS, len(sums)))].sum(axis=1)
    out["gain"] = 1.0 - sums[:, 0].sum() / sums[:, 1].sum()
    out["least"], out["most"] = np.quantile(1.0 - draws[:, 0] / draws[:, 1], [0.025, 0.975])
    out["families"] = len(sums)
    return out


def _mean(values: Sequence[float], weights: Floats) -> float:
    """Return a weighted mean of the values that are there."""
    found = np.array(values, dtype=float)
    known = np.isfinite(found)
    return float(np.average(found[known], weights=weights[known])) if known.any() else float("nan")


# --- tables -----------------------------------------------------------------------------------------------------------


def _gains(rows: list[Row]) -> str:
    """A row for each dancer, what is given and method, a column for each gap."""
    columns: dict[str, Callable[[Row], object]] = {"": _dancer}
    if len(_each(rows, "given")) > 1:
        columns["given"] = lambda r: r["given"]
    columns |= {" ": lambda r: r["kind"]}
    gaps = _each(rows, "seconds")
    columns |= {f"{gap:g} s": lambda r, gap=gap: _interval(r["found"].get(gap)) for gap in gaps}
    lines = []
    for group in _groups(rows, "corpus", "given", "kind"):
        if group[0]["kind"] not in ("danced", "slerp"):
            found = {one[0]["seconds"]: together(one) for one in _groups(group, "seconds")}
            lines.append(group[0] | {"found": found})
    return markdown(columns, lines)


def _interval(row: Row | None) -> str:
    if row is None:
        return ""
    spread = f"{100 * row['least']:.1f} to {100 * row['most']:.1f}" if row["families"] > 1 else "one family"
    return f"{100 * row['gain']:.1f} ({spread})"


def _windows(rows: list[Row]) -> str:
    """A row for each dancer: how many takes, families, windows and disjoint windows there are at each gap."""
    columns: dict[str, Callable[[Row], object]] = {"": _dancer}
    for gap in _each(rows, "seconds"):
        columns[f"{gap:g} s"] = lambda r, gap=gap: r["found"].get(gap, "")
    lines = []
    for group in _groups([row for row in rows if row["kind"] == "slerp"], "corpus"):
        found = {}
        for one in _groups(group, "seconds"):
            count = [sum(row[key] for row in one) for key in ("windows", "disjoint")]
            kept = len(_each(one, "family"))
            found[one[0]["seconds"]] = (
                f"{count[0]}, of them {count[1]} disjoint, in {kept} families of {len(one)} takes"
            )
        lines.append(group[0] | {"found": found})
    return markdown(columns, lines)


def _measures(rows: list[Row]) -> str:
    columns: dict[str, Callable[[Row], object]] = {
        "s": lambda r: f"{r['seconds']:g}",
        "": lambda r: r["kind"],
        "windows": lambda r: r["windows"],
        "L2Q": lambda r: f"{r['l2q']:.3f}",
        "below SLERP's, %": _interval,
        "L2P": lambda r: f"{r['l2p']:.2f}",
        "NPSS": lambda r: f"{r['npss']:.3f}",
        "jerk, rad/s³": lambda r: f"{r['jerk']:.0f}",
        "jerk is usual": lambda r: f"{r['usual']:.0%}",
        "skating": lambda r: f"{r['skating']:.1%}",
        "slide, cm": lambda r: f"{r['slide']:.2f}",
        "taken for the dancer": lambda r: f"{r['taken']:.0%}",
        "off its path": lambda r: f"{r['off_path']:.1f}°" if np.isfinite(r["off_path"]) else "",
        "follows it": lambda r: f"{r['followed']:.0%}" if np.isfinite(r["followed"]) else "",
    }
    return markdown(columns, [together(group) for group in _groups(rows, "seconds", "kind")])


def _takes(rows: list[Row]) -> str:
    """A row for each take: L2Q below SLERP's at each gap; and a sentence that names the worst."""
    gaps = _each(rows, "seconds")
    columns: dict[str, Callable[[Row], object]] = {"take": lambda r: r["take"]}
    columns |= {f"{gap:g} s": lambda r, gap=gap: r["found"].get(gap, "") for gap in gaps}
    lines = [
        group[0] | {"found": {one["seconds"]: f"{100 * _gain(one):.1f} ({one['windows']})" for one in group}}
        for group in _groups(rows, "take")
    ]
    worst = [min((row for row in rows if row["seconds"] == gap), key=_gain) for gap in gaps]
    named = ", ".join(f"{row['take']} at {row['seconds']:g} s ({100 * _gain(row):.1f})" for row in worst)
    said = f"L2Q of {SHOWN} below SLERP's, %, take by take, and the number of windows. The worst: {named}."
    return f"{said}\n\n{markdown(columns, lines)}"


def _gain(row: Row) -> float:
    return 1.0 - float(row["l2q"]) / float(row["slerp"])


def _dancer(row: Row) -> str:
    return f"{row['corpus']}, where constants were chosen" if row["tuned"] else str(row["corpus"])


def _usual(row: Row) -> bool:
    return bool(row["given"] == "two postures" and row["teachers"] == row["corpus"])


def _each(rows: Sequence[Row], key: str) -> list[object]:
    return list(dict.fromkeys(row[key] for row in rows))


def _groups(rows: Sequence[Row], *keys: str) -> list[list[Row]]:
    """Group rows that have the same values of some keys, in the order of their first; gaps and kinds in their own."""
    out: dict[tuple[object, ...], list[Row]] = {}
    for row in rows:
        out.setdefault(tuple(row[key] for key in keys), []).append(row)
    found = list(out.values())
    for key in reversed(keys):
        if key == "seconds":
            found.sort(key=lambda group: group[0]["seconds"])
        elif key == "kind":
            found.sort(key=lambda group: KINDS.index(group[0]["kind"]))
        else:
            order = _each(rows, key)
            found.sort(key=lambda group, key=key, order=order: order.index(group[0][key]))
    return found
