"""Windows that were danced, filled by who has not seen them: whether legs cross and feet skate as the dancer's did.

    python experiments/wince/windows.py [--every 0.5] [--of indian] [--data PATH/TO/shared/data]

Windows, and what is learned for them, are those of `experiments.inbetween`: no take of a window's family is learned
from. Intervals (95 %) come from 4,000 draws of families.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

from experiments.harness import HERE, markdown
from experiments.inbetween.rivals import Made, slerp
from experiments.inbetween.run import DANCERS, GAPS, GIVEN, Window, lesson_of, tween, windows_of
from experiments.material import FPS, families, movement
from motionmind import NoPathError
from motionmind._typing import Floats
from motionmind.body.capsules import legs_depth
from motionmind.body.contact import skating

CROSSED = 0.03  # metres that legs are in each other
MADE_BY = ("danced", "motionmind", "slerp")
DRAWS = 4000


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--every", type=float, default=0.5, help="seconds from one window to the next")
    parser.add_argument("--of", nargs="+", default=list(DANCERS), choices=DANCERS, help="dancers")
    parser.add_argument("--data", default=str(HERE.parent.parent / "shared" / "data"), help="recorded movement")
    asked = parser.parse_args()
    rows = []
    for name in asked.of:
        for seconds, found in seen_in_windows(asked.data, name, round(asked.every * FPS)).items():
            crossed, skates = found[:, 1:4], found[:, 5:8]
            rows.append(
                {
                    "windows of": name,
                    "seconds": seconds,
                    "windows": len(found),
                    **{f"legs over 3 cm: {by}": f"{100 * crossed[:, k].mean():.1f} %" for k, by in enumerate(MADE_BY)},
                    "ends alone": f"{100 * found[:, 4].mean():.1f} %",
                    **{
                        f"skates over danced: {by}": _ratio(found[:, 0], skates[:, k], skates[:, 0])
                        for k, by in enumerate(MADE_BY)
                        if k
                    },
                }
            )
    print(markdown({column: lambda row, column=column: row[column] for column in rows[0]}, rows))


def seen_in_windows(data: str, name: str, stride: int) -> dict[float, Floats]:
    """Return what is seen in each window of a dancer, by its length in seconds [windows, 8].

    The number of its family; whether legs cross in what each of MADE_BY made of it, and in its given ends; and the
    share of its frames that skate in what each made.
    """
    found: dict[float, list[list[float]]] = {}
    for family, takes in enumerate(families(data, name)):
        lesson = lesson_of(data, (name,), takes)
        for seconds in GAPS:
            frames = round(seconds * FPS)
            for take, number, start in windows_of(data, name, takes, frames, stride):
                window = Window(movement(data, name, frames)[take][number], start, frames)
                ends = window.ends(GIVEN[0])
                try:
                    own, _ = tween(lesson.engine, ends, seconds)
                except NoPathError:
                    continue
                made = (window.real.rotations, window.real.root), own, slerp(ends)
                found.setdefault(seconds, []).append([family, *_seen(window, made)])
    return {seconds: np.array(rows, dtype=np.float64) for seconds, rows in found.items()}


def _seen(window: Window, made: Sequence[Made]) -> list[float]:
    body = window.real.skeleton
    depths = [legs_depth(body, rotations) for rotations, _ in made]
    crossed = [float(depth.max() > CROSSED) for depth in depths]
    skates = [float(np.mean(skating(body, *one, window.floor))) for one in made]
    return [*crossed, float(depths[0][[0, -1]].max() > CROSSED), *skates]


def _ratio(family: Floats, made: Floats, danced: Floats) -> str:
    """Return how often feet skate over how often they did, with its interval."""
    numbers = np.unique(family)
    sums = np.array([[made[family == one].sum(), danced[family == one].sum()] for one in numbers])
    drawn = np.random.default_rng(0).integers(len(numbers), size=(DRAWS, len(numbers)))
    above, below = sums[drawn].sum(axis=1).T
    low, high = np.percentile(above / np.maximum(below, 1e-9), [2.5, 97.5])
    return f"{made.sum() / max(danced.sum(), 1e-9):.2f} ({low:.2f} to {high:.2f})"


if __name__ == "__main__":
    main()
