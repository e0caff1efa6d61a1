"""How much of a path is copied: runs of whole postures, and sequences of n states of a joint, a limb, the body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionmind._typing import Int32s, Ints, States
from motionmind.body.limbs import sided_parts
from motionmind.corpus.corpus import Corpus

LONGEST = 5  # states that n-grams have at most
_SEVERAL = -1  # in place of the one clip that has an n-gram


@dataclass(frozen=True, eq=False)
class Phrasebook:
    """What a corpus says word by word.

    Attributes:
        groups: the joints of each part of the body that is looked at: "joint", "limb" (the trunk is one) and
            "body".
        grams: the sequences of states of each part, and the clip that has each, or that several have.
        places: in which of the corpus's postures each whole posture occurs.
        clip_of: the clip of each posture [N].
    """

    groups: dict[str, list[list[int]]]
    grams: list[dict[bytes, int]]
    places: dict[bytes, list[int]]
    clip_of: Ints

    def copied(self, path: States, size: str, n: int, besides: int | None = None) -> float:
        """Share of the sequences of `n` states in a path that the corpus has, the mean over parts of a `size`.

        Args:
            path: states [T + 1, L].
            size: "joint", "limb" or "body".
            n: states in a sequence, from 1.
            besides: a clip of the corpus that does not count; the one that the path is from.

        NaN for a path of fewer than `n` postures.
        """
        found = [
            clip is not None and clip != besides
            for part in self.groups[size]
            for clip in map(self.grams[n - 1].get, _grams(path, part, n))
        ]
        return float(np.mean(found)) if found else float("nan")

    def runs(self, path: States, besides: int | None = None) -> list[int]:
        """Lengths in postures of the runs of whole postures, wherever they face, that the path has from one clip of
        the corpus in its order: of those that cannot be longer, in the order of their ends."""
        lengths: list[int] = []
        ends: dict[int, int] = {}  # how long the longest run is that ends in a posture of the corpus
        for posture in _grams(path, self.groups["body"][0], 1):
            ends = {
                place: 1 + (ends.get(place - 1, 0) if self.clip_of[place] == self.clip_of[place - 1] else 0)
                for place in self.places.get(posture, ())
                if self.clip_of[place] != besides
            }
            lengths.append(max(ends.values(), default=0))
        return [now for now, after in zip(lengths, [*lengths[1:], 0], strict=True) if now and after <= now]


def find_phrases(corpus: Corpus, states: Int32s) -> Phrasebook:
    """What a corpus, with its postures' states [N, L], says word by word."""
    joints = list(range(len(corpus.skeleton)))
    parts = [part.tolist() for part in sided_parts(corpus.skeleton).values()]
    groups = {"joint": [[joint] for joint in joints], "limb": parts, "body": [joints]}
    grams: list[dict[bytes, int]] = [{} for _ in range(LONGEST)]
    places: dict[bytes, list[int]] = {}
    for number, clip in enumerate(corpus.clips):
        own = np.asarray(states[clip.start : clip.stop])
        for place, posture in enumerate(_grams(own, joints, 1), start=clip.start):
            places.setdefault(posture, []).append(place)
        for n, known in enumerate(grams, start=1):
            for part in {tuple(part): None for parts in groups.values() for part in parts}:
                for gram in _grams(own, part, n):
                    known[gram] = number if known.get(gram, number) == number else _SEVERAL
    clip_of = np.repeat(np.arange(len(corpus.clips)), [len(clip) for clip in corpus.clips])
    return Phrasebook(groups, grams, places, clip_of)


def _grams(path: States, part: Sequence[int], n: int) -> list[bytes]:
    """All sequences of `n` states of a part of the body in a path, each with what part it is of."""
    own = np.ascontiguousarray(path[:, list(part)], dtype=np.int32)
    head = np.array(part, dtype=np.int32).tobytes()
    width = own.shape[1] * own.itemsize
    flat = own.tobytes()
    return [head + flat[start * width : (start + n) * width] for start in range(len(own) - n + 1)]
