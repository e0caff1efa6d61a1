"""The ways that a corpus knows from one posture to another, part by part of the body, and their mean.

A part's way is a walk through the corpus's postures: from one to the next as they followed in the clips; now and then
it goes over to another posture of the same *kind*, that is, one that holds the part much alike, and goes on as from
there. A walk is the likelier the nearer its ends are to the two postures that are given. Given those ends and the
number of moves, how likely each of the corpus's postures is at each move is found exactly, by passing messages forward
and backward (Rabiner, "A tutorial on hidden Markov models", Proc. IEEE 77(2), 1989, section III). Its mean is the
movement from which the corpus's own differs least in the square.

Ways of the whole body keep its joints together, but whole bodies recur seldom; limbs recur often, but do not know of
each other. They err differently, and the mean over ways of all sizes errs less than that of any.

The constants were chosen on other windows than those that experiments/inbetween reports.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.geometry.distances import squared
from motionmind.jit import jit

ENDS_WITHIN = 0.11  # the same, standard deviation: how near a walk's ends are to the postures that are given
FOLLOWS_WITHIN = 0.13  # the same: how closely a walk follows a path that it is to follow
STRAIGHT_ON = 0.7  # share of steps after which a walk goes straight on as its clip does
ANYWHERE = 0.003  # share after which it goes on from any posture, so that some walk joins any two


@jit
def nearness(orientations: Floats, posture: Floats, width: float) -> Floats:
    """exp(-d^2 / 2 width^2) of each of a part's orientations [N, m, 4], over that of the nearest to `posture` [m, 4].

    d is in radians, root mean square over the joints.
    """
    out = np.empty(len(orientations))
    for i in range(len(orientations)):
        out[i] = squared(orientations[i], posture)
    return np.exp((out.min() - out) / (2.0 * len(posture) * width**2))  # type: ignore[no-any-return]


@jit
def posterior_marginals(begins: Ints, ends: Ints, shares: Floats, kinds: Int32s, near: Floats) -> Floats:
    """How likely a walk is in each posture at each move [T + 1, N]; rows sum to 1.

    Args:
        begins: postures from which the corpus's moves lead [M].
        ends: and to which [M].
        shares: of those that leave one posture, adding up to 1 [M].
        kinds: of the postures [N].
        near: a weight of each posture at each move [T + 1, N].
    """
    sizes = np.bincount(kinds)
    forward, backward = near.copy(), np.ones_like(near)
    forward[0] /= forward[0].sum()
    for t in range(1, len(near)):
        came = np.zeros(near.shape[1])
        for m in range(len(begins)):
            came[ends[m]] += shares[m] * forward[t - 1, begins[m]]
        forward[t] *= _mixed(came, kinds, sizes)
        forward[t] /= forward[t].sum()
    backward[-1] = 1.0
    for t in range(len(near) - 2, -1, -1):
        on = _mixed(backward[t + 1] * near[t + 1], kinds, sizes)
        backward[t] = 0.0
        for m in range(len(begins)):
            backward[t, begins[m]] += shares[m] * on[ends[m]]
        backward[t] /= backward[t].sum()
    forward *= backward
    for t in range(len(near)):
        forward[t] /= forward[t].sum()
    return forward


@jit
def _mixed(mass: Floats, kinds: Int32s, sizes: Ints) -> Floats:
    """Weights [N] after some have gone over to postures of their kind, and few to any; it is its own transpose."""
    pooled = np.zeros(len(sizes))
    for i in range(len(mass)):
        pooled[kinds[i]] += mass[i]
    whole = ANYWHERE * mass.sum() / len(mass)
    over = 1.0 - STRAIGHT_ON - ANYWHERE
    out = np.empty_like(mass)
    for i in range(len(mass)):
        out[i] = STRAIGHT_ON * mass[i] + over * pooled[kinds[i]] / sizes[kinds[i]] + whole
    return out


@jit
def mean_rotations(likely: Floats, orientations: Floats, about: Floats) -> Floats:
    """Mean [T + 1, m, 4] of orientations [N, m, 4] with weights [T + 1, N], on the side of `about` [T + 1, m, 4].

    The normalised mean of quaternions of one sign, which is within a few thousandths of the mean rotation where they
    lie within a right angle (Gramkow, "On averaging rotations", IJCV 42, 2001).
    """
    out = np.zeros_like(about)
    for t in range(len(likely)):
        for i in range(likely.shape[1]):
            weight = likely[t, i]
            if weight < 1e-6:
                continue
            for j in range(about.shape[1]):
                side = 0.0
                for k in range(4):
                    side += about[t, j, k] * orientations[i, j, k]
                signed = -weight if side < 0.0 else weight
                for k in range(4):
                    out[t, j, k] += signed * orientations[i, j, k]
        for j in range(about.shape[1]):
            length = np.sqrt(np.sum(out[t, j] ** 2))
            if length > 1e-6:
                out[t, j] /= length
            else:
                out[t, j] = about[t, j]
    return out
