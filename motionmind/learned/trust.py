"""Trust: the share of the walks' departure from the minimal movement that a corpus can predict.

Corpus walks depart from the minimal movement between two postures (`motionmind.walks.minimal`). The correct share of
the departure depends on the distance of both postures from the corpus's nearest ones, relative to the displacement
between them and to the spread of the corpus's postures. `motionmind.walks.evidence` measures it by leave-one-out
reconstruction of the corpus's clips. This module fits the share of least error as a table, and interpolates in it.

It also holds the decay time of end velocities, which varies as much between corpora: slow dancers keep moving longer.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from motionmind._typing import Floats

ZERO_DISPLACEMENT_RAD = 1e-3  # per joint: zero, apart from the rounding of files
DISTANCE_RATIOS = np.array([0.0, 0.25, 0.5, 1.0, 2.0])  # of the distance from the corpus to the displacement


@dataclass(frozen=True, eq=False)
class Trust:
    """The share of the walks' departure to keep, and the decay time of end velocities.

    Attributes:
        table: share at each of `DISTANCE_RATIOS` [5], from 0 to 1.
        lasts: greatest time for which a velocity at an end has an effect [1], seconds.
        spread: distance between two random postures of the corpus, by body part [P], RMS radians per joint; at this
            distance from every posture the share is 0. Infinity if unknown.
    """

    table: Floats
    lasts: Floats
    spread: Floats

    def shares(self, off: Floats, ways: Floats) -> Floats:
        """Return the share to keep by body part [P], from 0 to 1.

        Args:
            off: mean distance of both ends from the corpus's nearest posture of each part [P], radians per joint.
            ways: displacement from one end to the other [P], radians per joint.
        """
        return counts(off, ways, self.spread) @ self.table


def counts(off: Floats, ways: Floats, spread: Floats) -> Floats:
    """Return the weight of each table entry in the share of each body part [P, 5].

    The share is interpolated linearly between entries in w / (w + d), where d is the distance from the corpus and w the
    displacement; it is 0 at w = 0. It is multiplied by 1 - (d / spread)^2, or 0 beyond the spread. Arguments are those
    of `Trust.shares`.
    """
    nearness = np.where(ways < ZERO_DISPLACEMENT_RAD, 0.0, ways / np.maximum(ways + off, ZERO_DISPLACEMENT_RAD))
    knots = np.append(1.0 / (1.0 + DISTANCE_RATIOS), 0.0)[::-1]  # increasing
    before = np.clip(np.searchsorted(knots, nearness, side="right") - 1, 0, len(knots) - 2)
    along = (nearness - knots[before]) / (knots[before + 1] - knots[before])
    out, parts = np.zeros((len(ways), len(knots))), np.arange(len(ways))
    out[parts, before], out[parts, before + 1] = 1.0 - along, along
    fades = np.maximum(1.0 - (off / spread) ** 2, 0.0)
    return np.asarray(fades[:, None] * out[:, :0:-1])


# --- fitting ----------------------------------------------------------------------------------------------------------

# Strengths of the prior, relative to the mean diagonal of A; from almost none to the prior alone.
PRIOR_STRENGTHS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, np.inf)
N_STANDARD_ERRORS = 2.0  # by which a table must beat one nearer to the prior: 95 %


class Squares(NamedTuple):
    """Squared errors in some windows, as a quadratic function of the table.

    With x_k the walks' departures, each joint's times the weight of table entry k for it, y the true departures and c
    the table, the squared error is c'Ac - 2 b'c + q.

    Attributes:
        inner: A, sums of <x_k, x_l> [5, 5].
        along: b, sums of <x_k, y> [5].
        whole: q, the sum of <y, y>.
    """

    inner: Floats
    along: Floats
    whole: float

    @classmethod
    def summed(cls, some: Iterable[Squares]) -> Self:
        """Return the sum over windows."""
        inner, along, whole = zip(*some, strict=True)
        return cls(np.sum(inner, axis=0), np.sum(along, axis=0), sum(whole))

    def error(self, table: Floats) -> float:
        """Return the squared error of a table [5]."""
        return float(table @ self.inner @ table - 2.0 * table @ self.along + self.whole)

    def fitted(self, prior: Floats, strength: float) -> Floats:
        """Return the table [5] of least error, with a ridge penalty of the given strength about a prior table."""
        if np.isinf(strength):
            return prior
        ridge = max(strength * float(np.trace(self.inner)) / len(prior), np.finfo(float).tiny) * np.eye(len(prior))
        return np.clip(np.linalg.solve(self.inner + ridge, self.along + ridge @ prior), 0.0, 1.0)


def fit_table(families: Sequence[Squares], prior: Floats) -> Floats:
    """Return the table [5] for a corpus: a ridge regression about a prior table.

    It takes the greatest strength whose error, on families left out of the fit, is within N_STANDARD_ERRORS standard
    errors over families of the least error. So a corpus departs from the prior only if its clips agree.
    Source: Hastie, Tibshirani, Friedman, "The elements of statistical learning" (2009), sections 3.4.1 and 7.10.

    Args:
        families: squared errors per family of independent clips.
        prior: table to use without evidence [5].
    """
    if len(families) < 2:
        return prior
    rest = [Squares.summed(one for one in families if one is not left) for left in families]
    errors = np.array(
        [
            [left.error(others.fitted(prior, strength)) for strength in PRIOR_STRENGTHS]
            for left, others in zip(families, rest, strict=True)
        ]
    )
    worse = errors - errors[:, [errors.sum(axis=0).argmin()]]
    doubt = N_STANDARD_ERRORS * np.sqrt(len(worse)) * worse.std(axis=0, ddof=1)
    strength = PRIOR_STRENGTHS[np.flatnonzero(worse.sum(axis=0) <= doubt)[-1]]
    return Squares.summed(families).fitted(prior, strength)


# Fitted to cmu-05, cmu-16, cmu-29 and cmu-135 (mocap.cs.cmu.edu) together, with equal weights:
# python experiments/trust/prior.py
PRIOR_TRUST = Trust(np.array([1.0, 1.0, 0.35, 0.13, 0.01]), np.array([0.45]), np.array(np.inf))
