"""How near the truth, how fast and how steady the movement is that a method makes of windows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.harness import Row
from experiments.inbetween.rivals import slerp
from experiments.inbetween.run import INNER, Window, power
from experiments.likeness.classify import CLASSIFIERS, UNKNOWN, told_apart
from experiments.likeness.features import LOW_M, features, feet_of, joints_of, of_upper_body
from experiments.likeness.filled import Filled
from experiments.likeness.windows import Case
from experiments.material import FPS
from motionmind._typing import Floats
from motionmind.metrics import angular_speed, l2q, npss, seen

MOVING_GROUPS = ("arms", "spine", "head", "legs")
BODIES = ("upper", "whole")
MEASURES = ("l2q", "slerp", "npss", "power", "followed", "spent")
COMPARED = (*MOVING_GROUPS, "bounce", "low", "slid")  # each beside the truth's, in the same windows
AREAS = tuple(f"{body} {classifier}" for body in BODIES for classifier in CLASSIFIERS)


@dataclass(frozen=True, eq=False)
class Truth:
    """The dancer's own movement in some cases, to measure by.

    Attributes:
        cases: which windows.
        windows: the windows themselves.
        floor: height of the floor in each [C], metres.
    """

    cases: list[Case]
    windows: list[Window]
    floor: Floats

    @classmethod
    def of(cls, cases: list[Case], windows: list[Window]) -> Truth:
        floors = {id(window.piece): window for window in windows}
        floor = {piece: window.floor for piece, window in floors.items()}
        return cls(cases, windows, np.array([floor[id(window.piece)] for window in windows]))

    def alike(self, filled: Filled) -> Iterator[tuple[list[int], Floats, Floats, Floats, Floats]]:
        """Yield the cases of each length and kind that were filled, with rotations and roots made, and danced."""
        row = np.cumsum(filled.found) - 1
        for key in dict.fromkeys((case.given, case.frames) for case in self.cases):
            ks = [k for k, c in enumerate(self.cases) if (c.given, c.frames) == key and filled.found[k]]
            if ks:
                real = [self.windows[k].real for k in ks]
                yield (
                    ks,
                    np.stack([filled.rotations[row[k]] for k in ks]),
                    np.stack([filled.root[row[k]] for k in ks]),
                    np.stack([one.rotations for one in real]),
                    np.stack([one.root for one in real]),
                )


def measured(truth: Truth, filled: Filled) -> dict[str, Floats]:
    """Return all measures of what a method made of each case [C], NaN where it made nothing.

    `arms`, `spine`, `head` and `legs` are mean angular speeds, rad/s; `bounce` is the standard deviation of the root's
    height, metres; `low` is the share of ends of feet within 5 cm of the floor, and `slid` their summed level speed,
    m/s, over the number of all ends. Each of these has a counterpart, " danced", of the truth.
    """
    names = (*MEASURES, *COMPARED, *(f"{name} danced" for name in COMPARED))
    out = {name: np.full(len(truth.cases), np.nan) for name in names}
    out["followed"], out["spent"] = filled.followed, np.where(filled.found, filled.spent, np.nan)
    skeleton = truth.windows[0].piece.skeleton
    for ks, rotations, root, real, real_root in truth.alike(filled):
        turned, _ = seen(skeleton, rotations, root, real, real_root)
        danced, _ = seen(skeleton, real, real_root, real, real_root)
        ways = [slerp(truth.windows[k].ends(truth.cases[k].given)) for k in ks]
        straight, _ = seen(skeleton, *(np.stack(one) for one in zip(*ways, strict=True)), real, real_root)
        turned, danced, straight = turned[INNER], danced[INNER], straight[INNER]
        out["l2q"][ks], out["slerp"][ks] = l2q(danced, turned), l2q(danced, straight)
        out["npss"][ks] = [npss(danced[[k]], turned[[k]]) for k in range(len(ks))]
        out["power"][ks] = [power(danced[[k]]) for k in range(len(ks))]
        for end, (q, place) in {"": (rotations, root), " danced": (real, real_root)}.items():
            speed = angular_speed(q, FPS)
            for group in MOVING_GROUPS:
                out[group + end][ks] = speed[..., joints_of(skeleton, group)].mean(axis=(1, 2))
            out["bounce" + end][ks] = place[..., 1].std(axis=1)
            heights, speeds = feet_of(skeleton, q, place, truth.floor[ks])
            out["low" + end][ks] = (heights < LOW_M).mean(axis=(1, 2))
            out["slid" + end][ks] = (speeds * (heights < LOW_M)).mean(axis=(1, 2))
    return out


# --- rows -------------------------------------------------------------------------------------------------------------


def rows_of(name: str, kind: str, truth: Truth, filled: Filled) -> list[Row]:
    """Return a row for each take, length and what is given, of what a method made of a dancer's windows.

    Measures are means over windows. The classifiers' areas are of all pieces of what is given, so the same in its rows.
    """
    found, areas = measured(truth, filled), areas_of(truth, filled)
    groups: dict[tuple[str, str, str, float], list[int]] = {}
    for k, case in enumerate(truth.cases):
        if filled.found[k]:
            groups.setdefault((case.given, case.family, case.take, case.seconds), []).append(k)
    out = []
    for (given, family, take, seconds), ks in groups.items():
        row: Row = {"corpus": name, "given": given, "kind": kind, "family": family, "take": take, "seconds": seconds}
        row["windows"] = len(ks)
        for key, values in found.items():
            row[key] = float(_weighted(values[ks], found["power"][ks] if key == "npss" else np.ones(len(ks))))
        out.append(row | areas[given])
    return out


def _weighted(values: Floats, weights: Floats) -> float:
    """Return the mean of the values that are known."""
    known = np.isfinite(values)
    return float(np.average(values[known], weights=weights[known])) if known.any() else float("nan")


def areas_of(truth: Truth, filled: Filled) -> dict[str, dict[str, float]]:
    """Return how well each classifier tells a method's pieces from the dancer's, by what is given."""
    out = {}
    for given in dict.fromkeys(case.given for case in truth.cases):
        made, danced, families = pieces_of(truth, filled, given)
        row = {}
        for body in BODIES:
            kept = [name for name in made if body == "whole" or of_upper_body(name)]
            x, y = (
                np.stack([one[name] for name in kept], axis=1) if kept else np.empty((0, 0)) for one in (danced, made)
            )
            for classifier, make in CLASSIFIERS.items():
                same = not len(x) or np.array_equal(x, y)
                area = UNKNOWN if same else told_apart(x, y, families, make)
                key = f"{body} {classifier}"
                row |= {key: area.value, f"{key} low": area.low, f"{key} high": area.high}
        row["pieces"] = len(families)
        out[given] = row
    return out


def pieces_of(truth: Truth, filled: Filled, given: str) -> tuple[dict[str, Floats], dict[str, Floats], Sequence[str]]:
    """Return features of the pieces that a method made and of those danced, and the family of each."""
    skeleton = truth.windows[0].piece.skeleton
    parts: tuple[list[dict[str, Floats]], list[dict[str, Floats]]] = [], []
    families: list[str] = []
    for ks, rotations, root, real, real_root in truth.alike(filled):
        if truth.cases[ks[0]].given == given and truth.cases[ks[0]].seconds > 1.0:
            floor = truth.floor[ks]
            # Both in single precision, as what was made is kept.
            real, real_root = real.astype(np.float32).astype(float), real_root.astype(np.float32).astype(float)
            parts[0].append(features(skeleton, rotations, root, floor))
            parts[1].append(features(skeleton, real, real_root, floor))
            count = len(next(iter(parts[0][-1].values()))) // len(ks)
            families += [truth.cases[k].family for k in ks for _ in range(count)]
    made, danced = (
        {key: np.concatenate([part[key] for part in one]) for key in one[0]} if one else {} for one in parts
    )
    return made, danced, families
