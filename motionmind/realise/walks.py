"""Walks through a corpus from one posture to another, part by part of the body.

A walk of a part goes through the corpus's postures, from one to the next as they followed in the clips. Now and then
it goes over to another posture of the same *cluster*, one that holds the part much alike, and continues from there. A
walk is more likely the nearer its ends are to the two given postures. Given those ends and the number of moves,
`motionmind.realise.marginals` computes how likely each of the corpus's postures is at each move, exactly. The mean over
walks (`motionmind.realise.mean_walk`) is the movement from which the corpus's own differs least in the square.

Walks of the whole body keep its joints together, but whole bodies recur seldom; limbs recur often, but do not know of
each other. They err differently, and the mean over walks of parts of all sizes errs less than that of any one size.

The constants were chosen on other windows than those that experiments/inbetween reports.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.geometry.distances import squared_distance
from motionmind.jit import jit

ENDS_WITHIN = 0.11  # radians a joint, standard deviation: how near a walk's ends are to the given postures
FOLLOWS_WITHIN = 0.13  # the same: how closely a walk follows a given path
STRAIGHT_ON = 0.7  # share of steps after which a walk goes straight on as its clip does
ANYWHERE = 0.003  # share of steps after which it goes on from any posture: some walk joins any two


@jit
def nearness(orientations: Floats, posture: Floats, width: float) -> Floats:
    """Return exp(-d^2 / 2 width^2) for each of a part's orientations, divided by that of the nearest [N].

    Args:
        orientations: of the part's m joints in the corpus's postures [N, m, 4].
        posture: orientations that distances d are measured from [m, 4]; d is in radians, root mean square over joints.
        width: standard deviation, radians.
    """
    out = np.empty(len(orientations))
    for i in range(len(orientations)):
        out[i] = squared_distance(orientations[i], posture)
    return np.exp((out.min() - out) / (2.0 * len(posture) * width**2))  # type: ignore[no-any-return]


@jit
def mix_clusters(mass: Floats, clusters: Int32s, sizes: Ints) -> Floats:
    """Return weights [N] after a share has gone over to postures of the same cluster, and a little to any posture.

    The operation is its own transpose, and so serves passes forward and backward.

    Args:
        mass: weights of the postures [N].
        clusters: cluster of each posture [N].
        sizes: number of postures in each cluster [K].
    """
    pooled = np.zeros(len(sizes))
    for i in range(len(mass)):
        pooled[clusters[i]] += mass[i]
    whole = ANYWHERE * mass.sum() / len(mass)
    over = 1.0 - STRAIGHT_ON - ANYWHERE
    out = np.empty_like(mass)
    for i in range(len(mass)):
        out[i] = STRAIGHT_ON * mass[i] + over * pooled[clusters[i]] / sizes[clusters[i]] + whole
    return out
