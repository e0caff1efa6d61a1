"""Posterior marginals of walks: how likely each of a corpus's postures is at each move, given both ends.

Computed exactly, by passing messages forward and backward. Source: Rabiner, "A tutorial on hidden Markov models",
Proc. IEEE 77(2) (1989), section III.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.jit import jit
from motionmind.realise.walks import mix_clusters


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
    sums = np.bincount(clusters, weights).astype(np.float64)
    out = _forward_messages(begins, ends, shares, clusters, weights, sums, near)
    out *= _backward_messages(begins, ends, shares, clusters, weights, sums, near)
    for t in range(len(near)):
        out[t] /= out[t].sum()
    return out


@jit
def _forward_messages(
    begins: Ints, ends: Ints, shares: Floats, clusters: Int32s, weights: Floats, sums: Floats, near: Floats
) -> Floats:
    """Return alpha [S + 1, N] with alpha[t] = near[t] * mix(alpha[t - 1] moved on by a step), rows scaled to sum 1."""
    forward = near.copy()
    forward[0] *= weights
    forward[0] /= forward[0].sum()
    for t in range(1, len(near)):
        came = np.zeros(near.shape[1])
        for m in range(len(begins)):
            came[ends[m]] += shares[m] * forward[t - 1, begins[m]]
        forward[t] *= weights * mix_clusters(came / weights, clusters, weights, sums)
        forward[t] /= forward[t].sum()
    return forward


@jit
def _backward_messages(
    begins: Ints, ends: Ints, shares: Floats, clusters: Int32s, weights: Floats, sums: Floats, near: Floats
) -> Floats:
    """Return beta [S + 1, N] with beta[t] = mix(beta[t + 1] * near[t + 1]) moved back by a step, rows summing to 1."""
    backward = np.ones_like(near)
    for t in range(len(near) - 2, -1, -1):
        on = mix_clusters(backward[t + 1] * near[t + 1], clusters, weights, sums)
        backward[t] = 0.0
        for m in range(len(begins)):
            backward[t, begins[m]] += shares[m] * on[ends[m]]
        backward[t] /= backward[t].sum()
    return backward
