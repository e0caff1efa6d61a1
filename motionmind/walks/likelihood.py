"""Walks through a corpus from one posture to another, part by part of the body.

A walk of a part goes through the corpus's postures, from one to the next as they followed in the clips. Now and then
it goes over to another posture of the same *cluster*, one that holds the part much alike, and continues from there;
where corpora are mixed, it goes to those that weigh more. A
walk is more likely the nearer its ends are to the two given postures, and its velocities there to those given, if they
are. Given those ends and the number of moves,
`motionmind.walks.marginals` computes how likely each of the corpus's postures is at each move, exactly. The mean over
walks (`motionmind.walks.mean_walk`) is the movement from which the corpus's own differs least in the square.

Walks of the whole body keep its joints together, but whole bodies recur seldom; limbs recur often, but do not know of
each other. They err differently, and the mean over walks of parts of all sizes errs less than that of any one size.

experiments/inbetween says on which windows the constants were chosen, and what the choice is worth on other people.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.jit import jit

# How near a walk's ends are to the given postures, radians a joint, standard deviation: the least and the greatest, and
# between them a share of the distance of the corpus's nearest posture. Where movement recurs the nearest know best.
ENDS_WITHIN = 0.03, 0.09
OF_NEAREST = 0.75
LEAVES_WITHIN = 1.0  # radians a second a joint, the same: how near its velocities there are to the given ones
TURNS_WITHIN = 1.0  # radians a second, the same of the body's turning
TRAVELS_WITHIN = 0.5  # metres a second, the same of its travel
FOLLOWS_WITHIN = 0.35  # radians a joint, the same: how closely a walk follows a given path
SIZES = (0.25, 0.25, 0.5)  # weights of the walks of the whole body, of its half, and of the limb that a joint is in
STRAIGHT_ON = 0.6  # share of steps after which a walk goes straight on as its clip does
_BLOCK = 256  # moments whose distances are measured at a time: their sums are in the processor's own memory
ANYWHERE = 0.006  # share of steps after which it goes on from any posture: some walk joins any two


@jit
def squared_distances(orientations: Floats, members: Ints, parts: int, postures: Floats) -> Floats:
    """Return the squared distances of parts of the body from postures, means over their joints [P, K, N], radians^2.

    Args:
        orientations: of all chains in the corpus's N moments, the joints' first [N, L, 4].
        members: the parts that each joint is in [J, 3].
        parts: how many parts there are.
        postures: orientations of the joints that distances are measured from [K, J, 4].
    """
    out, sizes = np.zeros((parts, len(postures), len(orientations))), np.bincount(members.ravel(), minlength=parts)
    shown, own = np.empty((4, _BLOCK)), np.empty(_BLOCK)
    for first in range(0, len(orientations), _BLOCK):
        count = min(_BLOCK, len(orientations) - first)
        for joint in range(len(members)):
            for i in range(count):  # side by side, so that several are measured at once
                for c in range(4):
                    shown[c, i] = orientations[first + i, joint, c]
            for k in range(len(postures)):
                x, y, z, w = postures[k, joint]
                for i in range(count):  # as `squared_turn`
                    cosine = shown[0, i] * x + shown[1, i] * y + shown[2, i] * z + shown[3, i] * w
                    own[i] = 4.0 * max(1.0 - cosine * cosine, 0.0)
                for part in members[joint]:
                    sums = out[part, k, first : first + count]
                    for i in range(count):
                        sums[i] += own[i]
    for part in range(parts):
        out[part] /= sizes[part]
    return out


@jit
def squared_differences(rates: Floats, rate: Floats) -> Floats:
    """Return the squared difference of each of a part's angular velocities [N, m, 3] from one of them [m, 3], mean over
    joints [N]."""
    out = np.zeros(len(rates))
    for i in range(len(rates)):
        for j in range(len(rate)):
            for k in range(3):
                out[i] += (rates[i, j, k] - rate[j, k]) ** 2
    return out / len(rate)


def variance_at_ends(nearest: float) -> float:
    """Return the variance of a walk's end about the given posture, radians^2.

    Args:
        nearest: distance of the corpus's nearest moment from the posture, radians a joint.
    """
    least, most = ENDS_WITHIN
    return min(max(OF_NEAREST * nearest, least), most) ** 2


def write_likelihood(out: Floats, *terms: Floats) -> None:
    """Write exp(-sum of terms / 2) for each of the corpus's moments, over that of the likeliest [..., N].

    Args:
        out: where to.
        terms: squared distances in units of a variance [..., N] each.
    """
    np.multiply(0.5, sum(terms[1:], start=terms[0]), out=out)
    np.subtract(out.min(axis=-1, keepdims=True), out, out=out)
    np.exp(out, out=out)
