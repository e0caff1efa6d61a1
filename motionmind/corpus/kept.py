"""Find the clips that a corpus shares with an earlier state of it, whose measurements can be reused."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Ints
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.changing import of_clips
from motionmind.corpus.clip import Clip
from motionmind.corpus.corpus import Corpus
from motionmind.executors.workshop import Workshop

MOVEMENT = ("rotations", "root", "times", "detail")


class Run(NamedTuple):
    """A contiguous range of entries to copy from one array to another.

    Attributes:
        is_new: whether the entries belong to new clips, not to kept ones.
        source: their range in the array of the new clips, or of the earlier corpus.
        target: their range in the array of the whole corpus.
    """

    is_new: bool
    source: slice
    target: slice


@dataclass(frozen=True, eq=False)
class Kept:
    """The C clips of a corpus, split into kept clips, which an earlier corpus also has, and new ones.

    Attributes:
        corpus: the corpus.
        before: the earlier corpus; None if all clips are new.
        numbers: index of each clip in the earlier corpus, or -1 [C].
        new: a corpus of the new clips alone, in their order; None if there are none.
    """

    corpus: Corpus
    before: Corpus | None
    numbers: Ints
    new: Corpus | None

    @classmethod
    def none(cls, corpus: Corpus) -> Kept:
        """Return a corpus with all clips new."""
        return cls(corpus, None, np.full(len(corpus.clips), -1), corpus)

    @classmethod
    def find(cls, corpus: Corpus, before: Corpus, workshop: Workshop | None = None) -> Kept:
        """Find the clips of an earlier corpus in one of another, on the same joints.

        A clip is kept if its name, repairs and movement are the same, to the last bit; its weight may differ. No clip
        is kept if the body has another size, or the corpus another `facing`.

        Args:
            corpus: the corpus.
            before: the earlier corpus.
            workshop: room for the movement of the new clips; None for memory.
        """
        if corpus.facing != before.facing or not _is_same_body(corpus.skeleton, before.skeleton):
            return cls.none(corpus)
        known = {_key(clip): number for number, clip in enumerate(before.clips)}
        numbers = np.full(len(corpus.clips), -1)
        new = []
        for place, clip in enumerate(corpus.clips):
            number = known.get(_key(clip), -1)
            if number >= 0 and _is_same(corpus, clip, before, before.clips[number]):
                numbers[place] = number
            else:
                new.append((corpus, clip))
        return cls(corpus, before, numbers, of_clips(corpus, new, workshop) if new else None)

    @cached_property
    def places(self) -> Ints:
        """Index of each clip in the earlier corpus, or of a new clip among the new clips [C]."""
        is_new = self.numbers < 0
        return np.where(is_new, np.cumsum(is_new) - 1, self.numbers)

    @cached_property
    def postures(self) -> list[Run]:
        """The ranges of the clips' postures."""
        old, new = self.before, self.new
        return self.runs(old.columns.starts if old else None, new.columns.starts if new else None)

    @cached_property
    def moves(self) -> list[Run]:
        """The ranges of the clips' moves: all moves forwards, then all moves backwards."""
        old, new = self.before, self.new
        return self.runs(old.moves.firsts if old else None, new.moves.firsts if new else None, rounds=2)

    def runs(self, old: Ints | None, new: Ints | None, rounds: int = 1) -> list[Run]:
        """Return the ranges of the clips' entries, in arrays that list all clips once or more times.

        Args:
            old: first entry of each clip in each round, then the number of entries, in the array of the earlier corpus
                [rounds * its clips + 1].
            new: the same for the new clips.
            rounds: number of times that the arrays list all clips.
        """
        is_new, bounds = np.tile(self.numbers < 0, rounds), np.zeros((2, rounds * len(self.numbers)), dtype=np.int64)
        for firsts, chosen in ((old, ~is_new), (new, is_new)):
            if firsts is not None:
                clips = np.arange(rounds)[:, None] * ((len(firsts) - 1) // rounds) + self.places
                bounds[:, chosen] = firsts[clips.ravel()[chosen]], firsts[clips.ravel()[chosen] + 1]
        targets = np.concatenate([[0], np.cumsum(bounds[1] - bounds[0])])
        goes_on = (is_new[1:] == is_new[:-1]) & (bounds[0, 1:] == bounds[1, :-1])
        first = np.flatnonzero(np.append(True, ~goes_on))
        last = np.append(first[1:], len(is_new)) - 1
        return [
            Run(bool(is_new[a]), slice(bounds[0, a], bounds[1, b]), slice(targets[a], targets[b + 1]))
            for a, b in zip(first, last, strict=True)
        ]

    def join(self, old: NDArray[Any] | None, new: NDArray[Any] | None, runs: list[Run], out: NDArray[Any]) -> None:
        """Write an array of the corpus, `out`, from the arrays of the earlier corpus and of the new clips, if given."""
        for is_new, source, target in runs:
            if (whole := new if is_new else old) is not None:
                out[target] = whole[source]


def _key(clip: Clip) -> tuple[str, str, bool]:
    return clip.corpus, clip.name, clip.mirrored


def _is_same_body(one: Skeleton, other: Skeleton) -> bool:
    return one.difference(other) is None and all(
        np.array_equal(getattr(one, name), getattr(other, name)) for name in ("offsets", "tips")
    )


def _is_same(one: Corpus, clip: Clip, other: Corpus, known: Clip) -> bool:
    """Return whether two clips of two corpora are the same, apart from their range and weight."""
    if replace(clip, start=known.start, stop=known.stop, weight=known.weight) != known or len(clip) != len(known):
        return False
    here, there = slice(clip.start, clip.stop), slice(known.start, known.stop)
    return all(np.array_equal(getattr(one, name)[here], getattr(other, name)[there]) for name in MOVEMENT)
