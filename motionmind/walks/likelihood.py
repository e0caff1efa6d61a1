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

from motionmind._typing import Bools, Floats, Ints
from motionmind.jit import jit, read_only

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
AT_ONCE = 32  # moments that are read side by side: memory is waited for as for one of them
_BLOCK = 256  # moments whose distances are measured at a time: their sums are in the processor's own memory
ANYWHERE = 0.006  # share of steps after which it goes on from any posture: some walk joins any two


def squared_distances(orientations: Floats, members: Ints, parts: int, postures: Floats) -> Floats:
    """Return the squared distances of parts of the body from postures, means over their joints [P, K, N], radians^2.

    Args:
        orientations: of all chains in the corpus's N moments, the joints' first [N, L, 4].
        members: the parts that each joint is in [J, 3].
        parts: how many parts there are.
        postures: orientations of the joints that distances are measured from [K, J, 4].
    """
    out = _sums_of_squares(read_only(orientations), members, parts, postures)
    out /= np.bincount(members.ravel(), minlength=parts)[:, None, None]
    return out


@jit
def _sums_of_squares(orientations: Floats, members: Ints, parts: int, postures: Floats) -> Floats:
    """Return the squared distances of `squared_distances`, sums over the parts' joints [P, K, N]."""
    out, shown, own = np.zeros((parts, len(postures), len(orientations))), np.empty((4, _BLOCK)), np.empty(_BLOCK)
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
    return out


@jit
def show(orientations: Floats, moments: Ints, part: Ints) -> Floats:
    """Return what some moments show of a part of the body [m, n, 4].

    Args:
        orientations: of all chains in the corpus's N moments [N, L, 4].
        moments: some of them [n].
        part: the joints of the part [m].
    """
    out = np.empty((len(part), len(moments), 4))
    for first in range(0, len(moments), AT_ONCE):
        here = moments[first : first + AT_ONCE]
        for i in range(len(here)):  # so that the memory of all is on its way before that of the first is waited for
            touched = 0.0
            for j in range(0, len(part), 2):
                touched += orientations[here[i], part[j], 0]
            out[0, first + i, 0] = touched
        for j in range(len(part)):
            for i in range(len(here)):
                for c in range(4):
                    out[j, first + i, c] = orientations[here[i], part[j], c]
    return out


@jit
def distances_of(shown: Floats, postures: Floats) -> Floats:
    """Return squared distances of moments from postures, means over the joints of a part [K, n], radians^2.

    Args:
        shown: what the moments show of the part [m, n, 4].
        postures: of the part [K, m, 4].
    """
    joints, count, _ = shown.shape
    out, own = np.zeros((len(postures), count)), np.empty((4, AT_ONCE))
    for first in range(0, count, AT_ONCE):
        many = min(AT_ONCE, count - first)
        for j in range(joints):
            for i in range(many):
                for c in range(4):
                    own[c, i] = shown[j, first + i, c]
            for k in range(len(postures)):
                x, y, z, w = postures[k, j]
                sums = out[k, first : first + many]
                for i in range(many):  # as `squared_turn`
                    cosine = own[0, i] * x + own[1, i] * y + own[2, i] * z + own[3, i] * w
                    sums[i] += 4.0 * max(1.0 - cosine * cosine, 0.0)
    return np.asarray(out / joints)


def squared_differences(rates: Floats, rate: Floats) -> Floats:
    """Return the squared difference of each of a part's angular velocities [N, m, 3] from one of them [m, 3], mean over
    joints [N]."""
    columns = ((rates - rate) ** 2).reshape(len(rates), -1).T
    return np.asarray(sum(columns, np.zeros(len(rates))) / len(rate))  # one after another


def variance_at_ends(nearest: float) -> float:
    """Return the variance of a walk's end about the given posture, radians^2.

    Args:
        nearest: distance of the corpus's nearest moment from the posture, radians a joint.
    """
    least, most = ENDS_WITHIN
    return min(max(OF_NEAREST * nearest, least), most) ** 2


def nearest_to_ends(off: Floats) -> tuple[float, float]:
    """Return the distances of the nearest moments from both ends, radians a joint.

    Args:
        off: squared distances of moments from the first posture, and from the last, and others [K, n], radians^2.
    """
    first, last = np.sqrt(off[:2].min(axis=1)).tolist()
    return first, last


def in_variances(off: Floats, of_first: float, of_last: float) -> Floats:
    """Return squared distances of moments in units of their variances [K, n].

    Args:
        off: squared distances from the first posture, from the last, and from those of a path [K, n], radians^2.
        of_first, of_last: variances of walks' ends about the given postures, radians^2.
    """
    variances = np.full((len(off), 1), FOLLOWS_WITHIN**2)
    variances[:2, 0] = of_first, of_last
    return np.asarray(off / variances)


def likelihoods(squares: Floats) -> Floats:
    """Return exp(-squares / 2) for each of some moments, over that of the likeliest [K, n].

    Args:
        squares: squared distances in units of a variance [K, n].
    """
    exponents = 0.5 * squares
    np.subtract(exponents.min(axis=1, keepdims=True), exponents, out=exponents)
    return np.exp(exponents, out=exponents)


def share_of_others(likely: Floats, near: tuple[Bools, Bools], weights: Floats) -> float:
    """Return the share of walks that begin or end in moments that are not near, at the end where it is greater.

    Args:
        likely: likelihoods [K, n], the first for the first posture, and the next for the last.
        near: which moments are near the first and the last [n].
        weights: of the moments [n].
    """
    share = 0.0
    for k in range(2):
        likely_at = weights * likely[k]
        every, others = (float(of.cumsum()[-1]) for of in (likely_at, np.where(near[k], 0.0, likely_at)))
        share = max(share, others / every)
    return share


@jit
def by_step(likely: Floats, count: int) -> Floats:
    """Return likelihoods of moments by the steps' ends [S + 1, n], 1 where there is nothing to be near to.

    Args:
        likely: those at the first and at the last, then at every other between, or none of these [K, n].
        count: S + 1.
    """
    out = np.ones((count, likely.shape[1]))
    for k in range(len(likely)):
        step = 2 * (k - 1) if k > 1 else k * (count - 1)
        for i in range(likely.shape[1]):  # assigning whole rows compiles for seconds, for an error message
            out[step, i] = likely[k, i]
    return out
