"""Verbatim copies in a path: runs of whole postures, and n-grams of the states of joints, limbs and the body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionmind._typing import Int32s, Ints, States
from motionmind.body.limbs import sided_parts
from motionmind.corpus.corpus import Corpus

MAX_NGRAM = 5  # states in the longest n-grams


@dataclass(frozen=True, eq=False)
class Phrasebook:
    """The n-grams of a corpus's N postures, and where each whole posture occurs.

    Attributes:
        groups: the body parts of each size, "joint", "limb" (the trunk is one) and "body", as lists of joints.
        grams: for n from 1 on, the n-grams of all parts, each with the number of its clip, or -1 if several have it.
        places: the postures at which each whole posture occurs.
        clip_of: the clip of each posture [N].
    """

    groups: dict[str, list[list[int]]]
    grams: list[dict[bytes, int]]
    places: dict[bytes, list[int]]
    clip_of: Ints

    def copied(self, path: States, size: str, n: int, besides: int | None = None) -> float:
        """Return the share of a path's n-grams that the corpus has, over all body parts of one size.

        Args:
            path: states [T + 1, L].
            size: "joint", "limb" or "body".
            n: states in a sequence, 1 to `MAX_NGRAM`.
            besides: a clip that does not count, such as the source of the path.

        Returns:
            A share from 0 to 1; NaN for a path of fewer than `n` postures.
        """
        found = [
            clip is not None and clip != besides
            for part in self.groups[size]
            for clip in map(self.grams[n - 1].get, _grams(path, part, n))
        ]
        return float(np.mean(found)) if found else float("nan")

    def runs(self, path: States, besides: int | None = None) -> list[int]:
        """Return the lengths, in postures, of the maximal runs of whole postures that a path copies from one clip.

        A run has the clip's postures in the clip's order; facing does not count.

        Args:
            path: states [T + 1, L].
            besides: a clip that does not count, such as the source of the path.

        Returns:
            Lengths in the order of the runs' ends.
        """
        lengths: list[int] = []
        ends: dict[int, int] = {}  # length of the longest run that ends in each posture of the corpus
        for posture in _grams(path, self.groups["body"][0], 1):
            ends = {
                place: 1 + (ends.get(place - 1, 0) if self.clip_of[place] == self.clip_of[place - 1] else 0)
                for place in self.places.get(posture, ())
                if self.clip_of[place] != besides
            }
            lengths.append(max(ends.values(), default=0))
        return [now for now, after in zip(lengths, [*lengths[1:], 0], strict=True) if now and after <= now]


def learn_phrases(corpus: Corpus, states: Int32s) -> Phrasebook:
    """Collect the n-grams of a corpus.

    Args:
        corpus: the corpus.
        states: the states of its postures [N, L].
    """
    joints = list(range(len(corpus.skeleton)))
    parts = [part.tolist() for part in sided_parts(corpus.skeleton).values()]
    groups = {"joint": [[joint] for joint in joints], "limb": parts, "body": [joints]}
    grams: list[dict[bytes, int]] = [{} for _ in range(MAX_NGRAM)]
    places: dict[bytes, list[int]] = {}
    for number, clip in enumerate(corpus.clips):
        own = np.asarray(states[clip.start : clip.stop])
        for place, posture in enumerate(_grams(own, joints, 1), start=clip.start):
            places.setdefault(posture, []).append(place)
        for n, known in enumerate(grams, start=1):
            for part in {tuple(part): None for parts in groups.values() for part in parts}:
                for gram in _grams(own, part, n):
                    known[gram] = number if known.get(gram, number) == number else -1
    clip_of = np.repeat(np.arange(len(corpus.clips)), [len(clip) for clip in corpus.clips])
    return Phrasebook(groups, grams, places, clip_of)


def _grams(path: States, part: Sequence[int], n: int) -> list[bytes]:
    """List the n-grams of a body part in a path, each headed by the joints of the part."""
    own = np.ascontiguousarray(path[:, list(part)], dtype=np.int32)
    head = np.array(part, dtype=np.int32).tobytes()
    width = own.shape[1] * own.itemsize
    flat = own.tobytes()
    return [head + flat[start * width : (start + n) * width] for start in range(len(own) - n + 1)]
