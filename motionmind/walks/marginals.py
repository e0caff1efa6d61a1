"""Posterior marginals of walks: how likely each of a corpus's postures is at each move, given both ends.

Computed exactly, by passing messages forward and backward. Source: Rabiner, "A tutorial on hidden Markov models",
Proc. IEEE 77(2) (1989), section III.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.jit import jit
from motionmind.walks.likelihood import ANYWHERE, STRAIGHT_ON


@jit
def posterior_marginals(
    begins: Ints, ends: Ints, shares: Floats, clusters: Int32s, weights: Floats, near: Floats
) -> Floats:
    """Return the probability that a walk is in each posture at each step [S + 1, N]; rows sum to 1.

    The chance of a walk is proportional to the product of the weight of its first posture, the shares of its steps, the
    mixing after each, and the nearness of its postures.

    Args:
        begins: postures from which the corpus's steps lead [M].
        ends: postures that they lead to [M].
        shares: share of each step among those that leave the same posture [M]; they add up to 1.
        clusters: cluster of each posture [N].
        weights: of the postures [N], above 0.
        near: a weight of each posture at each step [S + 1, N].
    """
    over = (1.0 - STRAIGHT_ON - ANYWHERE) / np.bincount(clusters, weights)
    anywhere = ANYWHERE / weights.sum()
    out = _forward_messages(begins, ends, shares, clusters, weights, over, anywhere, near)
    _times_backward_messages(out, begins, ends, shares, clusters, weights, over, anywhere, near)
    return out


@jit
def _forward_messages(
    begins: Ints,
    ends: Ints,
    shares: Floats,
    clusters: Int32s,
    weights: Floats,
    over: Floats,
    anywhere: float,
    near: Floats,
) -> Floats:
    """Return alpha [S + 1, N] with alpha[t] = near[t] * mixed(alpha[t - 1] moved on by a step), rows scaled to sum 1.

    Of mass that comes to posture i, the share STRAIGHT_ON stays; over[k] of that in cluster k, and `anywhere` of all,
    goes to each posture in proportion to its weight.
    """
    out = np.empty_like(near)
    came, pooled = weights.copy(), np.empty((4, len(over)))
    for i in range(len(came)):
        out[0, i] = near[0, i] * came[i]
    _scale(out[0])
    for t in range(1, len(near)):
        came[:] = 0.0
        for m in range(len(begins)):
            came[ends[m]] += shares[m] * out[t - 1, begins[m]]
        whole = anywhere * _pool(came, clusters, pooled)
        shared = over * pooled[0] + whole
        for i in range(len(came)):
            out[t, i] = near[t, i] * (STRAIGHT_ON * came[i] + weights[i] * shared[clusters[i]])
        _scale(out[t])
    return out


@jit
def _times_backward_messages(
    out: Floats,
    begins: Ints,
    ends: Ints,
    shares: Floats,
    clusters: Int32s,
    weights: Floats,
    over: Floats,
    anywhere: float,
    near: Floats,
) -> None:
    """Multiply rows [S + 1, N] by beta with beta[t] = mixed(beta[t + 1] * near[t + 1]) moved back by a step, and scale
    them to sum 1."""
    back, on, weighs = np.ones(near.shape[1]), np.empty(near.shape[1]), np.empty(near.shape[1])
    pooled = np.empty((4, len(over)))
    for t in range(len(near) - 2, -1, -1):
        for i in range(len(on)):
            on[i] = back[i] * near[t + 1, i]
            weighs[i] = weights[i] * on[i]
        whole = anywhere * _pool(weighs, clusters, pooled)
        shared = over * pooled[0]
        for i in range(len(on)):
            on[i] = STRAIGHT_ON * on[i] + shared[clusters[i]] + whole
        back[:] = 0.0
        for m in range(len(begins)):
            back[begins[m]] += shares[m] * on[ends[m]]
        _scale(back)
        for i in range(len(back)):
            out[t, i] *= back[i]
        _scale(out[t])


@jit
def _pool(values: Floats, clusters: Int32s, pooled: Floats) -> float:
    """Write the sums of values [N] in clusters [N] to pooled[0] [4, K], and return the sum of all.

    Neighbours are mostly in one cluster. They are added to different sums: one addition need not wait for another.
    """
    pooled[:] = 0.0
    for i in range(len(values)):
        pooled[i % 4, clusters[i]] += values[i]
    for k in range(1, 4):
        for cluster in range(pooled.shape[1]):  # assigning whole rows compiles for seconds, for an error message
            pooled[0, cluster] += pooled[k, cluster]
    return float(pooled[0].sum())


@jit
def _scale(row: Floats) -> None:
    """Scale a row to sum 1; it is added up in four sums, as in `_pool`."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    last = len(row) - len(row) % 4
    for i in range(0, last, 4):
        a, b, c, d = a + row[i], b + row[i + 1], c + row[i + 2], d + row[i + 3]
    for i in range(last, len(row)):
        a += row[i]
    share = 1.0 / (a + b + c + d)
    for i in range(len(row)):
        row[i] *= share
