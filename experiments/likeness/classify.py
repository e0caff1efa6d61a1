"""Two-class classifiers of pieces, and how well they tell the classes apart on families that they have not seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints

FOLDS = 5  # at most
DRAWS = 2_000  # of families, for an interval


class Auc(NamedTuple):
    """The area under the ROC curve, 0.5 for no difference, and its 95 % interval over families."""

    value: float
    low: float
    high: float


UNKNOWN = Auc(np.nan, np.nan, np.nan)


def linear() -> Any:
    """Logistic regression of standardised features; they are correlated, so the ridge is strong."""
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    return make_pipeline(StandardScaler(), LogisticRegression(C=0.3, max_iter=500))


def boosted() -> Any:
    """Boosted trees: small ones, since there are a few hundred pieces."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    return HistGradientBoostingClassifier(
        max_iter=80, learning_rate=0.06, max_leaf_nodes=8, l2_regularization=1.0, early_stopping=False, random_state=0
    )


CLASSIFIERS: dict[str, Callable[[], Any]] = {"linear": linear, "boosted": boosted}


def folds_of(families: Sequence[str]) -> dict[str, int]:
    """Return the fold of each family, given the family of each piece.

    Families are taken the largest first, each into the fold that has fewest pieces.
    """
    names, sizes = np.unique(families, return_counts=True)
    filled = np.zeros(min(FOLDS, len(names)), dtype=np.int64)
    fold: dict[str, int] = {}
    for k in np.argsort(-sizes, kind="stable"):
        fold[str(names[k])] = int(filled.argmin())
        filled[filled.argmin()] += sizes[k]
    return fold


class Sample(NamedTuple):
    """Pieces of both classes.

    Attributes:
        danced: features of the dancer's pieces [N, F].
        made: features of what a method made of the same pieces [N, F].
        families: the family of each piece [N].
    """

    danced: Floats
    made: Floats
    families: list[str]

    def of(self, features: Bools) -> Sample:
        """Return the same pieces with some of their features."""
        return Sample(self.danced[:, features], self.made[:, features], self.families)

    def part(self, kept: Bools) -> Sample:
        return Sample(self.danced[kept], self.made[kept], [self.families[k] for k in np.flatnonzero(kept)])


def told_apart(tested: Sample, fold: Ints, practice: Sequence[Sample], classifier: Callable[[], Any]) -> Auc:
    """Return how well a classifier tells pieces made from the dancer's, in families that it has not learned from.

    Args:
        tested: the pieces to tell.
        fold: the fold of each of them [N].
        practice: the pieces to learn from before each fold is tested.
        classifier: makes a new one.
    """
    if len(practice) < 2:
        return UNKNOWN
    scores = np.full((2, len(fold)), np.nan)
    for k, learned in enumerate(practice):
        here = fold == k
        if not here.any():
            continue
        classes = np.repeat([0, 1], [len(learned.danced), len(learned.made)])
        model = classifier().fit(np.concatenate([learned.danced, learned.made]), classes)
        for score, pieces in zip(scores, (tested.danced, tested.made), strict=True):
            score[here] = model.predict_proba(pieces[here])[:, 1]
    return auc_over_families(scores[0], scores[1], tested.families)


def lenient(tested: Sample, fold: Ints) -> list[Sample]:
    """Return the pieces of all other folds for each fold, as they were made: what they copy may be of that fold."""
    return [tested.part(fold != k) for k in range(fold.max(initial=0) + 1)]


def auc_over_families(danced: Floats, made: Floats, families: Sequence[str]) -> Auc:
    """Return how often a made piece's score [N] is above a dancer's [N]; ties count half.

    The interval comes from draws of families with replacement.
    """
    names, member = np.unique(families, return_inverse=True)
    above = (made[:, None] > danced) + 0.5 * (made[:, None] == danced)
    one = np.eye(len(names))[member]
    wins, sizes = one.T @ above @ one, one.sum(axis=0)  # by family of the made piece, and of the dancer's
    drawn = np.random.default_rng(0).multinomial(len(names), np.full(len(names), 1 / len(names)), size=DRAWS)
    values = np.einsum("df,fg,dg->d", drawn, wins, drawn) / (drawn @ sizes) ** 2
    return Auc(wins.sum() / len(danced) ** 2, *np.quantile(values, [0.025, 0.975]))
