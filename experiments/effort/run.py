"""Effort: Laban's factors of four dancers, in windows of two seconds, and how they depend on the frame rate."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import FPS, movement, recorded
from motionmind import Motion
from motionmind._typing import Floats
from motionmind.metrics.effort import EFFORT, MassPoints, flow_effort, measure_effort, points_of, time_effort

RECORDINGS = ("cmu-05", "cmu-135", "indian", "cmu-29")
WINDOW_S = 2.0
STRONG, SLOW = "cmu-135", "cmu-29"  # karate, and a slow mover


def jobs(setting: Setting) -> list[dict[str, Any]]:
    data = str(setting.data) if setting.data else None
    names = [] if setting.quick else recorded(data, *RECORDINGS)
    return [{"data": data if names else None, "by": by} for by in names or ["ballet"]]


def work(data: str | None, by: str) -> list[Row]:
    """Measure the unbroken pieces of each recording, window by window, and by how much the rate matters."""
    rows: list[Row] = []
    for clip, pieces in movement(data, by, round(WINDOW_S * FPS)).items():
        for piece in pieces:
            if piece.times[-1] - piece.times[0] < WINDOW_S:
                continue
            time, flow = _over_half_the_rate(piece)
            known = {"by": by, "clip": clip, "time_rate": time, "flow_rate": flow}
            rows += [known | row for row in measure_effort(piece, window=WINDOW_S)]
    return rows


def _over_half_the_rate(piece: Motion) -> tuple[float, float]:
    """Return time and flow at 30 frames a second over those at 15."""
    whole, (half, shares) = points_of(piece), points_of(piece.resample(0.5 * FPS))
    coarse = MassPoints(half, shares)
    return (
        time_effort(whole, FPS) / time_effort(coarse, 0.5 * FPS),
        flow_effort(whole, FPS) / flow_effort(coarse, 0.5 * FPS),
    )


# --- what is told -----------------------------------------------------------------------------------------------------


def _values(rows: list[Row], by: str, name: str) -> Floats:
    values = np.array([row[name] for row in rows if row["by"] == by and row[name] is not None], dtype=np.float64)
    return values[~np.isnan(values)]


def chart(rows: list[Row]) -> str:
    panels = []
    for name in ("weight_effort", "time_effort", "flow_effort", "directness", "extension", "arms_phase"):
        panel = Panel(name.replace("_", " "), EFFORT[name][0] or "share", "share of windows below")
        for by in dict.fromkeys(row["by"] for row in rows):
            values = np.sort(_values(rows, by, name))
            shares = np.linspace(0.0, 1.0, 21)
            panel.series[by] = list(zip(np.quantile(values, shares).tolist(), shares.tolist(), strict=True))
        panels.append(panel)
    return svg(panels)


def _spread(rows: list[Row], by: str, name: str) -> str:
    values = _values(rows, by, name)
    low, middle, high = np.percentile(values, (5.0, 50.0, 95.0))
    return f"{middle:.3g} ({low:.3g} to {high:.3g})"


def _share_above(rows: list[Row], name: str) -> str:
    """Return the share of pairs of windows in which the strong one has more than the slow one."""
    strong, slow = (_values(rows, by, name) for by in (STRONG, SLOW))
    return f"{100.0 * (strong[:, None] > slow).mean():.0f} %" if len(strong) and len(slow) else "-"


def tell(rows: list[Row]) -> str:
    names = list(dict.fromkeys(row["by"] for row in rows))
    columns: dict[str, Callable[[Row], object]] = {"": lambda r: r["name"].replace("_", " ")}
    for by in names:
        windows = sum(row["by"] == by for row in rows)
        columns[f"{by}, {windows} windows"] = lambda r, by=by: _spread(rows, by, r["name"])
    columns[f"{STRONG} above {SLOW}"] = lambda r: _share_above(rows, r["name"])
    figures = markdown(columns, [{"name": name} for name in EFFORT])
    rates = markdown(
        {
            "": lambda r: r["by"],
            "time": lambda r: f"{np.median(_values(rows, r['by'], 'time_rate')):.2f}",
            "flow": lambda r: f"{np.median(_values(rows, r['by'], 'flow_rate')):.2f}",
        },
        [{"by": by} for by in names],
    )
    return f"Median (5th to 95th percentile):\n\n{figures}\n\nAt 30 frames per second over 15, median:\n\n{rates}"
