"""Two-class classifiers of pieces, and how well they tell the classes apart on families that they have not seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from motionmind._typing import Floats, Ints

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


def folds_of(families: Sequence[str]) -> Ints:
    """Return the fold of each piece: whole families, the largest first, each into the fold that has fewest pieces."""
    names, sizes = np.unique(families, return_counts=True)
    filled = np.zeros(min(FOLDS, len(names)), dtype=np.int64)
    fold = {}
    for k in np.argsort(-sizes, kind="stable"):
        fold[names[k]] = int(filled.argmin())
        filled[fold[names[k]]] += sizes[k]
    return np.array([fold[family] for family in families])


def told_apart(danced: Floats, made: Floats, families: Sequence[str], classifier: Callable[[], Any]) -> Auc:
    """Return how well a classifier tells pieces made from the dancer's, in families that it has not learned from.

    Args:
        danced: features of the dancer's pieces [N, F].
        made: features of what a method made of the same pieces [N, F].
        families: the family of each piece [N].
        classifier: makes a new one.
    """
    fold = folds_of(families)
    if fold.max(initial=0) < 1:
        return UNKNOWN
    both = np.stack([danced, made])
    scores = np.empty(both.shape[:2])
    for k in range(fold.max() + 1):
        learned = both[:, fold != k].reshape(-1, both.shape[2])
        model = classifier().fit(learned, np.repeat([0, 1], len(learned) // 2))
        tested = both[:, fold == k]
        scores[:, fold == k] = model.predict_proba(tested.reshape(-1, both.shape[2]))[:, 1].reshape(2, -1)
    return auc_over_families(scores[0], scores[1], families)


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
