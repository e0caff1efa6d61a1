"""How near the truth, how fast and how steady the movement is that a method makes of windows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.harness import Row
from experiments.inbetween.rivals import Made, slerp
from experiments.inbetween.run import INNER, Window, power
from experiments.likeness.classify import CLASSIFIERS, UNKNOWN, Sample, folds_of, lenient, told_apart
from experiments.likeness.features import LOW_M, cuts, features, feet_of, joints_of, of_upper_body
from experiments.likeness.filled import Filled
from experiments.likeness.windows import POSTURES, Case
from experiments.material import FPS
from motionmind._typing import Bools, Floats
from motionmind.geometry import rotations as rot
from motionmind.metrics.inbetween import l2q, npss, seen
from motionmind.metrics.smoothness import angular_speed

MOVING_GROUPS = ("arms", "spine", "head", "legs")
AnyFloats = NDArray[Any]
PRACTICE_EVERY = 2  # cases: to make what is learned from takes most of the time
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

    @cached_property
    def folds(self) -> dict[str, int]:
        """The fold of each family that has pieces."""
        return folds_of([c.family for c in self.cases if c.given == POSTURES for _ in cuts(c.frames)])

    def practice(self, fold: int) -> Bools:
        """Which cases to learn from before a fold is tested [C]: every second one with pieces, of other folds."""
        out = np.zeros(len(self.cases), dtype=bool)
        for key in dict.fromkeys((c.given, c.family, c.frames) for c in self.cases):
            ks = [k for k, c in enumerate(self.cases) if (c.given, c.family, c.frames) == key]
            if cuts(key[2]) and self.folds.get(key[1]) != fold:
                out[ks[::PRACTICE_EVERY]] = True
        return out

    def alike(self, filled: Filled) -> Iterator[Alike]:
        """Yield the cases that were filled, those of the same length and with the same given together."""
        row = np.cumsum(filled.found) - 1
        for key in dict.fromkeys((case.given, case.frames) for case in self.cases):
            ks = [k for k, c in enumerate(self.cases) if (c.given, c.frames) == key and filled.found[k]]
            if ks:
                real = [self.windows[k].real for k in ks]
                made = _stacked([filled.rotations[row[k]] for k in ks], [filled.root[row[k]] for k in ks])
                danced = _stacked([one.rotations for one in real], [one.root for one in real])
                yield Alike(*key, ks, made, danced, self.floor[ks])


class Alike(NamedTuple):
    """Cases of the same length with the same given.

    Attributes:
        given: what is given.
        frames: steps from the first frame to the last.
        ks: their places among all cases.
        made: rotations [B, T, J, 4] and root [B, T, 3] that a method made, both rounded to single precision.
        danced: the truth, rounded alike.
        floor: height of the floor in each [B], metres.
    """

    given: str
    frames: int
    ks: list[int]
    made: Made
    danced: Made
    floor: Floats


def _stacked(rotations: Sequence[AnyFloats], root: Sequence[AnyFloats]) -> Made:
    turned, moved = (np.stack(one).astype(np.float32).astype(float) for one in (rotations, root))
    return rot.normalise(turned), moved


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
    for one in truth.alike(filled):
        ks = one.ks
        turned, lines = zip(*(slerp(truth.windows[k].ends(one.given)) for k in ks), strict=True)
        ways: list[Made] = [one.made, one.danced, (np.stack(turned), np.stack(lines))]
        made, danced, straight = (seen(skeleton, *way, *one.danced)[0][INNER] for way in ways)
        out["l2q"][ks], out["slerp"][ks] = l2q(danced, made), l2q(danced, straight)
        out["npss"][ks] = [npss(danced[[k]], made[[k]]) for k in range(len(ks))]
        out["power"][ks] = [power(danced[[k]]) for k in range(len(ks))]
        for end, (rotations, root) in {"": one.made, " danced": one.danced}.items():
            speed = angular_speed(rotations, FPS)
            for group in MOVING_GROUPS:
                out[group + end][ks] = speed[..., joints_of(skeleton, group)].mean(axis=(1, 2))
            out["bounce" + end][ks] = root[..., 1].std(axis=1)
            heights, speeds = feet_of(skeleton, rotations, root, one.floor)
            out["low" + end][ks] = (heights < LOW_M).mean(axis=(1, 2))
            out["slid" + end][ks] = (speeds * (heights < LOW_M)).mean(axis=(1, 2))
    return out


# --- rows -------------------------------------------------------------------------------------------------------------


def rows_of(name: str, kind: str, truth: Truth, filled: Filled, practised: Sequence[Filled] | None = None) -> list[Row]:
    """Return a row for each take, length and what is given, of what a method made of a dancer's windows.

    Measures are means over windows. The classifiers' areas are of all pieces of what is given, so the same in its rows.

    Args:
        name: the dancer.
        kind: the method.
        truth: what was danced.
        filled: what the method made.
        practised: what it made without a fold's families, for each fold, to learn from; None for a lenient test.
    """
    found, areas = measured(truth, filled), areas_of(truth, filled, practised)
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


def areas_of(truth: Truth, filled: Filled, practised: Sequence[Filled] | None) -> dict[str, Row]:
    """Return how well each classifier tells a method's pieces from the dancer's, by what is given."""
    out = {}
    for given in dict.fromkeys(case.given for case in truth.cases):
        tested, names = pieces_of(truth, filled, given)
        fold = np.array([truth.folds[family] for family in tested.families], dtype=np.int64)
        same = np.array_equal(tested.danced, tested.made)
        learned = [pieces_of(truth, one, given)[0] for one in practised] if practised else lenient(tested, fold)
        row: Row = {"pieces": len(fold), "lenient": int(practised is None)}
        for body in BODIES:
            kept = np.array([body == "whole" or of_upper_body(name) for name in names], dtype=bool)
            for classifier, make in CLASSIFIERS.items():
                area = UNKNOWN
                if not same:
                    shown = [Sample(one.danced[:, kept], one.made[:, kept], one.families) for one in (tested, *learned)]
                    area = told_apart(shown[0], fold, shown[1:], make)
                key = f"{body} {classifier}"
                row |= {key: area.value, f"{key} low": area.low, f"{key} high": area.high}
        out[given] = row
    return out


def pieces_of(truth: Truth, filled: Filled, given: str) -> tuple[Sample, list[str]]:
    """Return the pieces that a method made of what is given, and the names of their features."""
    skeleton = truth.windows[0].piece.skeleton
    made, danced, families, names = [np.empty((0, 0))], [np.empty((0, 0))], [], []
    for one in truth.alike(filled):
        if one.given == given and cuts(one.frames):
            for parts, way in ((made, one.made), (danced, one.danced)):
                found = features(skeleton, *way, one.floor)
                names = list(found)
                parts.append(np.stack(list(found.values()), axis=1))
            families += [truth.cases[k].family for k in one.ks for _ in cuts(one.frames)]
    first = 1 if families else 0
    return Sample(np.concatenate(danced[first:]), np.concatenate(made[first:]), families), names
