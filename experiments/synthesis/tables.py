"""Tables of what `experiments.synthesis.measure` found, with intervals; several files are shown side by side.

    python -m experiments.synthesis.tables OLD.json [NEW.json ...]

Intervals (95 %) come from 2,000 draws of pairs or windows. Of several files only what all of them made counts, and each
is compared with the first on the same draws: ! marks a difference whose interval excludes 0.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from experiments.harness import Row, markdown
from experiments.wince.dancers import MEASURES
from experiments.wince.run import LIFTED
from motionmind._typing import Floats, Ints

DRAWS = 2_000
EVERY = ("far", "one leg", "jump")
POSTURES, MOVING = "two postures", "moving ends"


class Column(NamedTuple):
    """A figure: a ratio of sums over rows, or a percentile of all their values.

    Attributes:
        name: its heading.
        kinds: the kinds of pairs, or what is given of windows.
        of: a row's numerator and denominator, or its values where `percent` is a number.
        over: the dancers' own, to divide by; "" for none.
        percent: percentile of the values; None for a ratio.
        show: how it is written.
    """

    name: str
    kinds: tuple[str, ...]
    of: Callable[[Row], Any]
    over: str = ""
    percent: float | None = None
    show: str = ".2f"


def _share(name: str, key: str, beyond: float = 0.5) -> Column:
    return Column(name, ("far",), lambda row: (row[key] > beyond, 1.0), show=".0%")


def _lean(name: str, key: str) -> Column:
    # Nothing is known where the dancers do not show what is usual.
    return Column(name, ("far",), lambda row: (row[key], np.isfinite(row[f"own_{key}"])), show=".0%")


PAIRS = (
    Column("feet's speed", ("far",), lambda row: (row["slid"], row["low"]), "own_feet"),
    Column("skating", ("far",), lambda row: (row["skates"], 1.0), "own_skates"),
    Column("bounce", ("far",), lambda row: row["bounce"], "own_bounce", 99.0),
    Column("bounce on the floor", ("far",), lambda row: row["grounded"], "own_grounded", 99.0),
    _share("beyond in any", "any"),
    *(_share(f"beyond: {measure}", measure, 1.0) for measure in MEASURES),
    _share("legs over 3 cm", "crossed"),
    _lean("leans", "leans"),
    _lean("leans at rest", "rests"),
    Column("standing feet rise", ("one leg",), lambda r: (r["rise"] > LIFTED, np.isfinite(r["rise"])), show=".0%"),
    Column("falls in the air", ("far", "jump"), lambda row: (row["falls"], row["airborne"]), show=".0%"),
    Column("proven optimal", ("far",), lambda row: (row["proven"], 1.0), show=".0%"),
    Column("followed", ("far",), lambda row: (row["followed"], row["joint-moves"]), show=".1%"),
    Column("attested", ("far",), lambda row: (row["attested"], 1.0), show=".1%"),
    Column("attested moves", ("far",), lambda row: (row["attested moves"], row["moves"]), show=".1%"),
    Column("eased: attested", ("far",), lambda row: (row["eased attested"], 1.0), show=".1%"),
    Column(
        "eased: attested moves", ("far",), lambda row: (row["eased attested moves"], row["eased moves"]), show=".1%"
    ),
    Column("ms", EVERY, lambda row: [row["ms"]], percent=50.0, show=".0f"),
    Column("seconds", ("far",), lambda row: (row["seconds"], 1.0)),
)
WINDOWS = (
    Column("L2Q, two postures", (POSTURES,), lambda row: (row["l2q"], 1.0), show=".3f"),
    Column("L2Q, moving ends", (MOVING,), lambda row: (row["l2q"], 1.0), show=".3f"),
    Column("L2Q over SLERP's", (POSTURES,), lambda row: (row["l2q"], row["slerp"]), show=".3f"),
    Column("NPSS, two postures", (POSTURES,), lambda row: (row["npss"] * row["power"], row["power"]), show=".3f"),
    Column("NPSS, moving ends", (MOVING,), lambda row: (row["npss"] * row["power"], row["power"]), show=".3f"),
    # The speed of low feet is the ratio of two ratios: `over` names the truth's.
    Column("windows: feet", (POSTURES, MOVING), lambda row: (row["slid"], row["low"]), "danced"),
    Column("windows: bounce", (POSTURES, MOVING), lambda row: (row["bounce"], row["bounce danced"])),
    Column("windows: followed", (POSTURES, MOVING), lambda row: _known(row["followed"]), show=".1%"),
)


def _known(value: float) -> tuple[float, float]:
    return (value, 1.0) if np.isfinite(value) else (0.0, 0.0)


def main() -> None:
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    print(report({Path(name).stem: json.loads(Path(name).read_text()) for name in sys.argv[1:]}))


def report(files: dict[str, dict[str, Any]]) -> str:
    """Return a table for each dancer, a column for each file, by its label."""
    first = next(iter(files.values()))
    return "\n\n".join(
        f"## {name}\n\n{_table({label: found[name] for label, found in files.items()})}"
        for name in first
        if all(name in found for found in files.values())
    )


def _table(files: dict[str, Row]) -> str:
    rows = []
    for columns, part, key in ((PAIRS, "pairs", "pair"), (WINDOWS, "windows", "window")):
        common = set.intersection(*({row[key] for row in found[part]} for found in files.values()))
        kept = {label: [row for row in found[part] if row[key] in common] for label, found in files.items()}
        rows += [_line(column, kept, files) for column in columns] if common else []
    for given, body in ((given, body) for given in (POSTURES, MOVING) for body in ("upper", "whole")):
        for classifier in ("linear", "boosted"):
            key = f"{body} {classifier}"
            if all(given in found["auc"] for found in files.values()):
                shown = {label: _auc(found["auc"][given], key) for label, found in files.items()}
                rows.append({"": f"AUC, {given}, {key}"} | shown)
    columns = {heading: lambda row, heading=heading: row[heading] for heading in rows[0]} if rows else {}
    return markdown(columns, rows)


def _auc(row: Row, key: str) -> str:
    return f"{row[key]:.2f} ({row[f'{key} low']:.2f} to {row[f'{key} high']:.2f})"


def _line(column: Column, kept: dict[str, list[Row]], files: dict[str, Row]) -> Row:
    """Return the figures of all files, as text."""
    out: Row = {"": column.name}
    first: Floats | None = None
    for label, rows in kept.items():
        mine = [row for row in rows if row.get("kind", row.get("given")) in column.kinds]
        draws = np.random.default_rng(0).integers(max(len(mine), 1), size=(DRAWS, len(mine)))
        draws = np.concatenate([np.arange(len(mine))[None], draws])
        found = _drawn(column, mine, draws) / float(files[label].get(column.over, 1.0))
        text = "none"
        if np.isfinite(found[0]):
            low, high = np.nanpercentile(found[1:], [2.5, 97.5])
            text = f"{found[0]:{column.show}} ({low:{column.show}} to {high:{column.show}})"
            if first is None:
                first = found
            elif np.prod(np.nanpercentile((found - first)[1:], [2.5, 97.5])) > 0.0:
                text += " !"
        out[label] = text
    return out


def _drawn(column: Column, rows: list[Row], draws: Ints) -> Floats:
    """Return the figure of each draw of rows [D]; NaN where nothing is known."""
    if not rows:
        return np.full(len(draws), np.nan)
    if column.percent is not None:
        values = [np.array(column.of(row), dtype=float) for row in rows]
        return np.array([np.percentile(np.concatenate([values[k] for k in draw]), column.percent) for draw in draws])
    parts = np.array([column.of(row) for row in rows], dtype=float)
    if column.over == "danced":
        own = np.array([(row["slid danced"], row["low danced"]) for row in rows], dtype=float)
        parts = np.stack([parts[:, 0], parts[:, 1], own[:, 0], own[:, 1]], axis=1)
    sums = parts[draws].sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = sums[:, 0] / sums[:, 1]
        return ratio / (sums[:, 2] / sums[:, 3]) if column.over == "danced" else ratio


if __name__ == "__main__":
    main()
