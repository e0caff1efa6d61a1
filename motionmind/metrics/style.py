"""Whether movement is in the style of a corpus: a classifier of how joints move, wherever they are.

Where joints are tells corpora apart at once, but so it does of movement between their postures that nobody would make.
So there is nothing of it here: only how fast each joint turns, and how fast that changes. Corpora are told apart by
linear discriminants (Fisher, "The use of multiple measurements in taxonomic problems", Annals of Eugenics 7:179, 1936)
with the spread that they share, shrunk towards its diagonal (Friedman, "Regularized discriminant analysis", JASA
84:165, 1989). Movement is taken for a corpus if that is the nearest, and no further off than 95 % of the corpus's own
movement is, judged by what was learned without the sequence that it comes from.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from motionmind._typing import Floats
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot

Sequences = Mapping[str, Sequence[Floats]]  # the unbroken pieces [T, J, 4] of each sequence, at 30 frames a second

RATE = 30.0
WINDOW = 18  # frames, 0.6 s; each begins half a window after the one before
_STEP = 2  # frames over which speed and its change are taken
_STILL = 0.2, 2.0  # rad/s, rad/s^2: much less is hardly seen
_SHRINKAGE = 0.3
_OWN = 0.95  # of a corpus's own movement is taken for it, if no other corpus is nearer


def features(rotations: Floats) -> Floats:
    """What is seen of movement [T, J, 4] at 30 frames a second, in each window [W, 2 J]: the logarithms of the root
    mean square of each joint's angular velocity, rad/s, and of its angular acceleration, rad/s^2.

    Both are differences over two frames, so that the noise of recordings, which is from frame to frame, decides less.
    """
    seconds = _STEP / RATE
    velocity = rot.log(rot.inv_mul(rotations[:-_STEP], rotations[_STEP:])) / seconds
    change = (velocity[_STEP:] - velocity[:-_STEP]) / seconds
    starts = range(0, len(rotations) - WINDOW + 1, WINDOW // 2)
    pairs = (velocity, WINDOW - _STEP), (change, WINDOW - 2 * _STEP)
    found = [[np.mean(np.sum(x[s : s + n] ** 2, axis=-1), axis=0) for x, n in pairs] for s in starts]
    size = np.sqrt(np.array(found).reshape(len(starts), 2, rotations.shape[1]))
    return np.asarray(np.log(size + np.array(_STILL)[:, None]).reshape(len(starts), 2 * rotations.shape[1]))


@dataclass(frozen=True, eq=False)
class Styles:
    """Corpora told apart by how joints move.

    Attributes:
        names: of the corpora [C].
        means: of what is seen of each [C, F].
        precision: the inverse of the covariance within corpora [F, F].
    """

    names: tuple[str, ...]
    means: Floats
    precision: Floats

    def distances(self, rotations: Floats) -> Floats:
        """How far movement [T, J, 4] is from each corpus [C]: the mean over its windows of the squared Mahalanobis
        distance to the corpus's mean."""
        off = features(rotations)[:, None] - self.means
        return np.asarray(np.einsum("wcf,fg,wcg->c", off, self.precision, off) / len(off))


def learn_styles(rows: Mapping[str, Floats]) -> Styles:
    """The discriminants of the `features` of corpora [W, F], each of which counts as much as another."""
    means = np.stack([seen.mean(axis=0) for seen in rows.values()])
    spread = np.mean([np.cov(seen.T, bias=True) for seen in rows.values()], axis=0)
    shrunk = (1.0 - _SHRINKAGE) * spread + _SHRINKAGE * np.diag(np.diag(spread))
    # A joint that never moves has no spread, and what moves it then is as far off as can be told.
    return Styles(tuple(rows), means, np.linalg.inv(shrunk + 1e-6 * np.eye(len(shrunk))))


@dataclass(frozen=True, eq=False)
class StyleClassifier:
    """Who says, of movement of so many frames, whether it would be taken for a corpus's.

    Attributes:
        corpora: the movement to tell apart.
        frames: how long what is judged is.
        without: what was learned without each sequence.
        limits: how far off at most what is taken for each corpus is.
    """

    corpora: Mapping[str, Sequences]
    frames: int
    without: Mapping[tuple[str, str], Styles]
    limits: Mapping[str, float]

    def takes(self, rotations: Floats, corpus: str, sequence: str) -> bool:
        """Whether movement [frames, J, 4] that stands for a part of a corpus's sequence is taken for the corpus's."""
        styles = self.without[corpus, sequence]
        nearest = styles.names[int(styles.distances(rotations).argmin())]
        return nearest == corpus and self.distance(rotations, corpus, sequence) <= 1.0

    def distance(self, rotations: Floats, corpus: str, sequence: str) -> float:
        """How far such movement is from how the corpus's joints move: 1 for the most that is taken for it."""
        styles = self.without[corpus, sequence]
        return float(styles.distances(rotations)[styles.names.index(corpus)] / self.limits[corpus])

    def held_out(self, corpus: str) -> Iterator[tuple[str, Floats]]:
        """A corpus's own movement, with its sequence, in pieces of as many frames [frames, J, 4]."""
        for sequence, pieces in self.corpora[corpus].items():
            for piece in pieces:
                for start in range(0, len(piece) - self.frames + 1, self.frames):
                    yield sequence, piece[start : start + self.frames]

    def table(self, seed: int) -> dict[str, dict[str, float]]:
        """Of each corpus how much is taken for it: of what was "held out", and, between the same two postures, of the
        "slerp", and of a "shuffle": the same frames in an order that is drawn by `seed`."""
        rng, out = np.random.default_rng(seed), {}
        for corpus in self.corpora:
            taken: dict[str, list[bool]] = {"held out": [], "slerp": [], "shuffle": []}
            for sequence, real in self.held_out(corpus):
                order = np.concatenate([[0], 1 + rng.permutation(self.frames - 2), [self.frames - 1]])
                share = np.linspace(0.0, 1.0, self.frames)[:, None]
                kinds = {"held out": real, "slerp": rot.slerp(real[:1], real[-1:], share), "shuffle": real[order]}
                for kind, rotations in kinds.items():
                    taken[kind].append(self.takes(rotations, corpus, sequence))
            out[corpus] = {kind: float(np.mean(found)) for kind, found in taken.items()}
        return out


def fit_style_classifier(corpora: Mapping[str, Sequences], frames: int) -> StyleClassifier:
    """A judge of movement of so many frames, at 30 a second.

    Raises:
        MotionMindError: a corpus has no second sequence to learn from, or nothing as long, or what is judged is shorter
            than a window.
    """
    if frames < WINDOW:
        raise MotionMindError(f"style is seen in {WINDOW} frames at {RATE:g} a second or more, not in {frames}")
    rows = {
        corpus: {name: np.concatenate([features(piece) for piece in pieces]) for name, pieces in sequences.items()}
        for corpus, sequences in corpora.items()
    }
    without = {
        (corpus, name): learn_styles(
            {key: _all(key, found, None if key != corpus else name) for key, found in rows.items()}
        )
        for corpus, sequences in rows.items()
        for name in sequences
    }
    judge = StyleClassifier(corpora, frames, without, dict.fromkeys(corpora, np.inf))
    limits = {}
    for corpus in corpora:
        own = [
            styles.distances(piece)[styles.names.index(corpus)]
            for name, piece in judge.held_out(corpus)
            for styles in [without[corpus, name]]
        ]
        if not own:
            raise MotionMindError(f"style: {corpus} has no clip of {frames} frames at {RATE:g} a second")
        limits[corpus] = float(np.quantile(own, _OWN))
    return StyleClassifier(corpora, frames, without, limits)


def _all(corpus: str, sequences: Mapping[str, Floats], left_out: str | None) -> Floats:
    found = [rows for name, rows in sequences.items() if name != left_out and len(rows)]
    if not found:
        raise MotionMindError(f"style: {corpus} needs two sequences at least, each of {WINDOW} frames or more")
    return np.concatenate(found)
