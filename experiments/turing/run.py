"""A Turing test in a box: how many raters it takes to tell a difference, by simulated raters."""

from __future__ import annotations

from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.turing.analyse import judged
from motionmind._typing import Bools, Floats

FILMS = 20
RATER, FILM, REST = 0.5, 0.4, 0.8  # standard deviations, in points, of raters, films, and all else
CERTAIN = 0.05


def jobs(setting: Setting) -> list[dict[str, Any]]:
    tests = 40 if setting.quick else 1000
    return [
        {"raters": raters, "difference": difference, "tests": tests, "seed": 0}
        for difference in (0.0, 0.25, 0.5, 0.75, 1.0)
        for raters in ((5, 20) if setting.quick else (5, 10, 20, 40, 80))
    ]


def work(raters: int, difference: float, tests: int, seed: int) -> list[Row]:
    """Estimate how often a true difference is detected with simulated raters, and how large it then seems."""
    rng = np.random.default_rng([seed, raters, round(100 * difference)])
    made = np.arange(FILMS) % 2 == 1
    verdicts = [judged(simulated(rng, raters, made, difference), made) for _ in range(tests)]
    return [
        {
            "raters": raters,
            "difference": difference,
            "tests": tests,
            "told": np.mean([verdict.p < CERTAIN for verdict in verdicts]),
            "seen": np.mean([verdict.difference for verdict in verdicts]),
            "eta": np.mean([verdict.eta for verdict in verdicts]),
        }
    ]


def simulated(rng: np.random.Generator, raters: int, made: Bools, difference: float) -> Floats:
    """Simulate ratings from 1 to 5 [raters, films] of raters who rate films that were `made` so many points lower."""
    liked = 3.2 + RATER * rng.normal(size=(raters, 1)) + FILM * rng.normal(size=len(made)) - difference * made
    return np.clip(np.round(liked + REST * rng.normal(size=(raters, len(made)))), 1.0, 5.0)


def chart(rows: list[Row]) -> str:
    panels = [Panel(f"{title} (simulated)", "raters", y, log=True) for title, y in TITLES.items()]
    for panel in panels:
        for row in rows:
            panel.series.setdefault(f"{row['difference']:g} points apart", []).append((row["raters"], row[panel.y]))
    return svg(panels)


TITLES = {"Told apart": "told", "Difference that is seen": "seen", "Partial eta squared": "eta"}


def tell(rows: list[Row]) -> str:
    lines = markdown(
        {
            "points apart": lambda r: f"{r['difference']:g}",
            "raters": lambda r: r["raters"],
            "told apart (p < 0.05)": lambda r: f"{r['told']:.0%}",
            "difference seen": lambda r: f"{r['seen']:.2f}",
            "partial eta squared": lambda r: f"{r['eta']:.2f}",
        },
        rows,
    )
    return f"**Simulated raters**, nobody's answers: {rows[0]['tests']} tests a row, {FILMS} films.\n\n{lines}"
