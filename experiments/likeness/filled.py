"""Movement that methods make of windows, kept in files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.inbetween.rivals import Made, hermite, slerp
from experiments.inbetween.run import Lesson, Window, tween
from experiments.likeness.windows import MOVING, POSTURES, Case
from motionmind import NoPathError
from motionmind._typing import Bools, Floats

RIVALS = ("danced", "slerp", "nearest segment", "hermite")

Method = Callable[[Lesson, Window, Case], tuple[Made, float]]  # also the share of joint-moves on the path


@dataclass(frozen=True, eq=False)
class Filled:
    """What one method makes of some cases.

    Attributes:
        found: whether it fills each case [C].
        rotations: local rotations of the filled cases, [T, J, 4] each, in single precision.
        root: positions of the root, [T, 3] each, metres, in single precision.
        followed: share of joint-moves within tolerance of the path [C], NaN without a path.
        spent: time that each case took [C], seconds.
    """

    found: Bools
    rotations: list[NDArray[np.float32]]
    root: list[NDArray[np.float32]]
    followed: Floats
    spent: Floats

    def save(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(
            path,
            found=self.found,
            lengths=np.array([len(one) for one in self.root], dtype=np.int64),
            rotations=np.concatenate(self.rotations or [np.zeros((0, 1, 4), np.float32)]),
            root=np.concatenate(self.root or [np.zeros((0, 3), np.float32)]),
            followed=self.followed,
            spent=self.spent,
        )

    @classmethod
    def load(cls, path: Path) -> Filled:
        with np.load(path) as kept:
            ends = np.cumsum(kept["lengths"])
            rotations, root = (np.split(kept[key], ends)[:-1] for key in ("rotations", "root"))
            return cls(kept["found"], rotations, root, kept["followed"], kept["spent"])

    def split(self, count: int) -> list[Filled]:
        """Undo `joined` of so many parts of the same number of cases."""
        size = len(self.found) // count
        ends = np.cumsum(self.found)[size - 1 :: size]
        return [
            Filled(
                self.found[k * size : (k + 1) * size],
                self.rotations[(ends[k - 1] if k else 0) : ends[k]],
                self.root[(ends[k - 1] if k else 0) : ends[k]],
                self.followed[k * size : (k + 1) * size],
                self.spent[k * size : (k + 1) * size],
            )
            for k in range(count)
        ]

    @classmethod
    def nothing(cls, count: int) -> Filled:
        """Return what fills none of so many cases."""
        return cls(np.zeros(count, dtype=bool), [], [], np.full(count, np.nan), np.zeros(count))

    @classmethod
    def joined(cls, parts: Sequence[Filled]) -> Filled:
        """Join what was made of consecutive cases."""
        return cls(
            np.concatenate([part.found for part in parts]),
            [one for part in parts for one in part.rotations],
            [one for part in parts for one in part.root],
            np.concatenate([part.followed for part in parts]),
            np.concatenate([part.spent for part in parts]),
        )


def fill(method: Method, lesson: Lesson, windows: Sequence[Window], cases: Sequence[Case], wanted: Bools) -> Filled:
    """Fill the wanted cases of one family by a method [C].

    Cases that the method does not serve or finds no path through stay open.
    """
    filled = Filled.nothing(len(cases))
    found, rotations, root, followed, spent = (
        filled.found,
        filled.rotations,
        filled.root,
        filled.followed,
        filled.spent,
    )
    for k, (window, case) in enumerate(zip(windows, cases, strict=True)):
        if not wanted[k]:
            continue
        began = perf_counter()
        try:
            (turned, moved), followed[k] = method(lesson, window, case)
        except NoPathError:
            continue
        spent[k], found[k] = perf_counter() - began, True
        rotations.append(turned.astype(np.float32))
        root.append(moved.astype(np.float32))
    return filled


# --- methods ----------------------------------------------------------------------------------------------------------


def serves(kind: str, case: Case) -> bool:
    """Return whether a rival fills cases of that sort; the engine and the truth fill all."""
    return {"slerp": POSTURES, "nearest segment": POSTURES, "hermite": MOVING}.get(kind, case.given) == case.given


def copies(kind: str) -> bool:
    """Return whether a method makes its movement of what it has learned: all but the truth and interpolation."""
    return kind not in ("danced", "slerp", "hermite")


def rival(kind: str) -> Method:
    """Return the truth, or one of the ways that are compared with the engine's."""

    def make(lesson: Lesson, window: Window, case: Case) -> tuple[Made, float]:
        if not serves(kind, case):
            raise NoPathError(f"{kind} does not fill windows with {case.given}")
        if kind == "danced":
            return (window.real.rotations, window.real.root), np.nan
        if kind == "nearest segment":
            segments = lesson.segments(case.frames)
            if not len(segments.starts):
                raise NoPathError(f"no segment is {case.seconds:g} s long")
            return segments.nearest(window.ends(case.given), 1), np.nan
        return {"slerp": slerp, "hermite": hermite}[kind](window.ends(case.given)), np.nan

    return make


def engine(options: dict[str, Any]) -> Method:
    """Return the engine's way with some options of `Engine.tween`."""

    def make(lesson: Lesson, window: Window, case: Case) -> tuple[Made, float]:
        made, path = tween(lesson.engine, window.ends(case.given), case.seconds, **options)
        return made, path.get("followed", np.nan)

    return make
