"""Posterior marginals of walks: the exact probability of each of a corpus's samples at each step, given both ends.

The forward-backward algorithm computes them. Source: Rabiner, "A tutorial on hidden Markov models", Proc. IEEE 77(2)
(1989), section III.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.jit import jit
from motionmind.walks.likelihood import P_CONTINUE, P_TELEPORT


@jit
def posterior_marginals(
    begins: Ints, ends: Ints, shares: Floats, clusters: Int32s, weights: Floats, near: Floats
) -> Floats:
    """Return the probability that a walk is in each sample at each step [S + 1, N]; rows sum to 1.

    The probability of a walk is proportional to the product of the weight of its first sample, the shares of its
    steps, the probability of the jump (or none) after each step, and the likelihoods of its samples.

    Args:
        begins: sample from which each of the corpus's steps leads [M].
        ends: sample to which it leads [M].
        shares: probability of each step, given the sample that it leaves [M].
        clusters: cluster of each sample [N].
        weights: of the samples [N], above 0.
        near: likelihood of each sample at each step [S + 1, N].
    """
    over = (1.0 - P_CONTINUE - P_TELEPORT) / np.bincount(clusters, weights)
    anywhere = P_TELEPORT / weights.sum()
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

    Mixing keeps the share P_CONTINUE of the mass in each sample. Each sample also receives its weight times
    (over[k] * mass in its cluster k + anywhere * total mass).
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
            out[t, i] = near[t, i] * (P_CONTINUE * came[i] + weights[i] * shared[clusters[i]])
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
    """Multiply rows [S + 1, N] by beta, with beta[t] = mixed(beta[t + 1] * near[t + 1]) moved back by a step, and scale
    each to sum 1."""
    back, on, weighs = np.ones(near.shape[1]), np.empty(near.shape[1]), np.empty(near.shape[1])
    pooled = np.empty((4, len(over)))
    for t in range(len(near) - 2, -1, -1):
        for i in range(len(on)):
            on[i] = back[i] * near[t + 1, i]
            weighs[i] = weights[i] * on[i]
        whole = anywhere * _pool(weighs, clusters, pooled)
        shared = over * pooled[0]
        for i in range(len(on)):
            on[i] = P_CONTINUE * on[i] + shared[clusters[i]] + whole
        back[:] = 0.0
        for m in range(len(begins)):
            back[begins[m]] += shares[m] * on[ends[m]]
        _scale(back)
        for i in range(len(back)):
            out[t, i] *= back[i]
        _scale(out[t])


@jit
def _pool(values: Floats, clusters: Int32s, pooled: Floats) -> float:
    """Write the sums of values [N] by cluster [N] to pooled[0] of [4, K], and return the total.

    Consecutive samples are mostly in one cluster. Four separate sums keep their additions independent.
    """
    pooled[:] = 0.0
    for i in range(len(values)):
        pooled[i % 4, clusters[i]] += values[i]
    for k in range(1, 4):
        for cluster in range(pooled.shape[1]):  # a row assignment takes seconds to compile
            pooled[0, cluster] += pooled[k, cluster]
    return float(pooled[0].sum())


@jit
def _scale(row: Floats) -> None:
    """Scale a row to sum 1; four separate sums add it up, as in `_pool`."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    last = len(row) - len(row) % 4
    for i in range(0, last, 4):
        a, b, c, d = a + row[i], b + row[i + 1], c + row[i + 2], d + row[i + 3]
    for i in range(last, len(row)):
        a += row[i]
    share = 1.0 / (a + b + c + d)
    for i in range(len(row)):
        row[i] *= share
