"""Style of movement: a classifier of how joints move, wherever they are.

Joint positions tell corpora apart at once, but would also accept implausible movement between a corpus's own postures.
So the features are only how fast each joint turns, and how fast that changes. Linear discriminants separate the
corpora (Fisher, "The use of multiple measurements in taxonomic problems", Annals of Eugenics
7:179, 1936) with a common covariance, shrunk towards its diagonal (Friedman, "Regularized discriminant analysis", JASA
84:165, 1989). A corpus accepts movement if it is the nearest corpus, and as near as 95 % of its own movement; each
sequence of that is measured against the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from motionmind._typing import Floats
from motionmind.body.contact import CONTACT_FPS
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot

Sequences = Mapping[str, Sequence[Floats]]  # the unbroken pieces [T, J, 4] of each sequence, at 30 frames a second

WINDOW_FRAMES = 18  # 0.6 s; each begins half a window after the one before


def features(rotations: Floats) -> Floats:
    """Return the features of movement in each window [W, 2 J].

    They are the logarithms of the root mean square of each joint's angular velocity, rad/s, and of its angular
    acceleration, rad/s^2. Both are differences over two frames, which damps the frame-to-frame noise of recordings.

    Args:
        rotations: local rotations [T, J, 4] at 30 frames a second.
    """
    step = 2  # frames
    seconds = step / CONTACT_FPS
    velocity = rot.log(rot.inv_mul(rotations[:-step], rotations[step:])) / seconds
    change = (velocity[step:] - velocity[:-step]) / seconds
    starts = range(0, len(rotations) - WINDOW_FRAMES + 1, WINDOW_FRAMES // 2)
    pairs = (velocity, WINDOW_FRAMES - step), (change, WINDOW_FRAMES - 2 * step)
    found = [[np.mean(np.sum(x[s : s + n] ** 2, axis=-1), axis=0) for x, n in pairs] for s in starts]
    size = np.sqrt(np.array(found).reshape(len(starts), 2, rotations.shape[1]))
    visible = np.array([[0.2], [2.0]])  # rad/s, rad/s^2: much less is hardly visible
    return np.asarray(np.log(size + visible).reshape(len(starts), 2 * rotations.shape[1]))


@dataclass(frozen=True, eq=False)
class Styles:
    """Linear discriminants of C corpora by how their joints move.

    Attributes:
        names: names of the corpora [C].
        means: mean features of each [C, F].
        precision: the inverse of the covariance within corpora [F, F].
    """

    names: tuple[str, ...]
    means: Floats
    precision: Floats

    def distances(self, rotations: Floats) -> Floats:
        """Return the distance of movement from each corpus [C].

        It is the mean over windows of the squared Mahalanobis distance to the corpus's mean.

        Args:
            rotations: local rotations [T, J, 4] at 30 frames a second.
        """
        off = features(rotations)[:, None] - self.means
        return np.asarray(np.einsum("wcf,fg,wcg->c", off, self.precision, off) / len(off))


def learn_styles(rows: Mapping[str, Floats]) -> Styles:
    """Learn discriminants from the `features` [W, F] of each corpus, by name; all corpora weigh the same."""
    means = np.stack([seen.mean(axis=0) for seen in rows.values()])
    spread = np.mean([np.cov(seen.T, bias=True) for seen in rows.values()], axis=0)
    shrinkage = 0.3
    shrunk = (1.0 - shrinkage) * spread + shrinkage * np.diag(np.diag(spread))
    # A joint that never moves has no spread; movement of that joint is then very far off.
    return Styles(tuple(rows), means, np.linalg.inv(shrunk + 1e-6 * np.eye(len(shrunk))))


@dataclass(frozen=True, eq=False)
class StyleClassifier:
    """A classifier of the style of movement of a fixed length.

    Attributes:
        corpora: the movement to learn from.
        frames: the length of the movement to classify.
        without: discriminants learned without one sequence, by corpus and sequence.
        limits: the greatest distance that each corpus accepts.
    """

    corpora: Mapping[str, Sequences]
    frames: int
    without: Mapping[tuple[str, str], Styles]
    limits: Mapping[str, float]

    def takes(self, rotations: Floats, corpus: str, sequence: str) -> bool:
        """Tell whether a corpus accepts movement.

        Args:
            rotations: local rotations [frames, J, 4].
            corpus: the corpus.
            sequence: the sequence that the movement replaces a part of, left out of the training data.
        """
        styles = self.without[corpus, sequence]
        nearest = styles.names[int(styles.distances(rotations).argmin())]
        return nearest == corpus and self.distance(rotations, corpus, sequence) <= 1.0

    def distance(self, rotations: Floats, corpus: str, sequence: str) -> float:
        """Return the distance of movement [frames, J, 4] from a corpus, arguments as for `takes`: 1 at its limit."""
        styles = self.without[corpus, sequence]
        return float(styles.distances(rotations)[styles.names.index(corpus)] / self.limits[corpus])

    def held_out(self, corpus: str) -> Iterator[tuple[str, Floats]]:
        """Yield a corpus's own movement in pieces [frames, J, 4], each with the name of its sequence."""
        for sequence, pieces in self.corpora[corpus].items():
            for piece in pieces:
                for start in range(0, len(piece) - self.frames + 1, self.frames):
                    yield sequence, piece[start : start + self.frames]

    def table(self, seed: int) -> dict[str, dict[str, float]]:
        """Return the accepted shares of each corpus's "held out" movement, and of two fakes of it.

        The fakes have the same first and last postures: the "slerp" between them, and a random "shuffle" of the frames.

        Args:
            seed: seed of the random orders.
        """
        rng, out = np.random.default_rng(seed), {}
        for corpus in self.corpora:
            taken: dict[str, list[bool]] = {"held out": [], "slerp": [], "shuffle": []}
            for sequence, real in self.held_out(corpus):
                order = np.concatenate([[0], 1 + rng.permutation(self.frames - 2), [self.frames - 1]])
                share = np.linspace(0.0, 1.0, self.frames)[:, None]
                versions = {"held out": real, "slerp": rot.slerp(real[:1], real[-1:], share), "shuffle": real[order]}
                for kind, rotations in versions.items():
                    taken[kind].append(self.takes(rotations, corpus, sequence))
            out[corpus] = {kind: float(np.mean(found)) for kind, found in taken.items()}
        return out


def fit_style_classifier(corpora: Mapping[str, Sequences], frames: int) -> StyleClassifier:
    """Fit a classifier of movement of a number of frames, at 30 a second.

    Args:
        corpora: sequences of each corpus, as unbroken pieces [T, J, 4].
        frames: the length of the movement to classify.

    Raises:
        MotionMindError: a corpus has no second sequence to learn from, or none of that length, or the length is less
            than a window.
    """
    if frames < WINDOW_FRAMES:
        raise MotionMindError(f"style needs {WINDOW_FRAMES} frames or more, at {CONTACT_FPS:g} a second, not {frames}")
    rows = {
        corpus: {name: np.concatenate([features(piece) for piece in pieces]) for name, pieces in sequences.items()}
        for corpus, sequences in corpora.items()
    }
    without = {
        (corpus, name): learn_styles(
            {key: _gather(key, found, None if key != corpus else name) for key, found in rows.items()}
        )
        for corpus, sequences in rows.items()
        for name in sequences
    }
    classifier = StyleClassifier(corpora, frames, without, dict.fromkeys(corpora, np.inf))
    limits = {}
    for corpus in corpora:
        own = [
            styles.distances(piece)[styles.names.index(corpus)]
            for name, piece in classifier.held_out(corpus)
            for styles in [without[corpus, name]]
        ]
        if not own:
            raise MotionMindError(f"style: {corpus} has no clip of {frames} frames at {CONTACT_FPS:g} a second")
        limits[corpus] = float(np.quantile(own, 0.95))
    return StyleClassifier(corpora, frames, without, limits)


def _gather(corpus: str, sequences: Mapping[str, Floats], left_out: str | None) -> Floats:
    found = [rows for name, rows in sequences.items() if name != left_out and len(rows)]
    if not found:
        raise MotionMindError(f"style: {corpus} needs two sequences or more, each of {WINDOW_FRAMES} frames or more")
    return np.concatenate(found)
