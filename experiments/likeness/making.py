"""Filling all windows of a dancer: to be measured, and to learn from what is made without a fold's families."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import click
import numpy as np

from experiments.inbetween.run import keep_apart, lesson_of
from experiments.likeness.filled import Filled, Method, fill
from experiments.likeness.measure import Truth
from motionmind._typing import Bools


@dataclass(frozen=True)
class Maker:
    """Fills the cases of a dancer.

    Attributes:
        data: the folder of recordings.
        name: the dancer.
        together: the families of takes, in the order in which cases come.
        truth: the cases.
        report: whether to write a line for each family to standard error.
    """

    data: str | None
    name: str
    together: Sequence[Sequence[str]]
    truth: Truth
    report: bool = False

    def fill(self, methods: dict[str, Method]) -> dict[str, Filled]:
        """Return what methods make of each case when they have learned all takes but those of its family."""
        everything = np.ones(len(self.truth.cases), dtype=bool)
        return self._filled(methods, everything, ()) if methods else {}

    def practise(self, methods: dict[str, Method]) -> dict[str, list[Filled]]:
        """Return what methods make, for each fold, of cases of other folds when they have not learned that fold either.

        Otherwise what a classifier learns to call made would be copied from the families on which it is tested, and it
        would take their own movement for made.
        """
        out: dict[str, list[Filled]] = {kind: [] for kind in methods}
        for fold in range(max(self.truth.folds.values(), default=-1) + 1) if methods else ():
            tested = [take for takes in self.together if self.truth.folds.get(takes[0]) == fold for take in takes]
            for kind, filled in self._filled(methods, self.truth.practice(fold), tested).items():
                out[kind].append(filled)
        return out

    def _filled(self, methods: dict[str, Method], wanted: Bools, untaught: Sequence[str]) -> dict[str, Filled]:
        """Fill the cases that are wanted [C]; besides their families, some more takes are not learned from."""
        parts: dict[str, list[Filled]] = {kind: [] for kind in methods}
        cases, windows = self.truth.cases, self.truth.windows
        for takes in self.together:
            ks = [k for k, case in enumerate(cases) if case.family == takes[0]]
            if not wanted[ks].any():
                for part in parts.values():
                    part.append(Filled.nothing(len(ks)))
                continue
            began = perf_counter()
            left_out = tuple(dict.fromkeys((*takes, *untaught)))
            lesson = lesson_of(self.data, (self.name,), left_out)
            keep_apart(lesson.engine.corpus, left_out)
            learned = perf_counter()
            for kind, method in methods.items():
                filled = fill(method, lesson, [windows[k] for k in ks], [cases[k] for k in ks], wanted[ks])
                parts[kind].append(filled)
            if self.report:
                spent = f"learned {learned - began:.1f} s, filled {perf_counter() - learned:.1f} s"
                without = f"{takes[0]}, {len(left_out)} takes left out" if untaught else takes[0]
                click.echo(f"{self.name} {without}: {wanted[ks].sum()} windows, {spent}", err=True)
        return {kind: Filled.joined(found) for kind, found in parts.items()}
