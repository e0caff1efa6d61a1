"""Likelihood of corpus walks from one posture to another, separately for each body part.

A walk of a body part visits the corpus's samples in the order of the clips. Now and then it jumps to another sample of
the same *cluster*, which holds the part in a similar posture, and continues from there; in mixed corpora, samples of
more weight attract more jumps. A walk is likelier the nearer its ends are to the two given postures, and its end
velocities to the given ones, if any. Given the ends and the number of moves, `motionmind.walks.marginals` computes
the exact probability of each sample at each step. The mean over walks (`motionmind.walks.mean_walk`) is the movement
of least mean squared difference from them.

Walks of the whole body keep its joints coordinated, but whole-body postures seldom recur. Postures of single limbs
recur often, but their walks ignore the other limbs. Their errors differ, and the mean over parts of all sizes has a
smaller error than any one size.

experiments/inbetween names the windows on which the constants were chosen, and reports their effect on other people.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.jit import jit, read_only

# Standard deviations (SD) of a walk's end about the given joint velocities, turning rate and travel velocity.
END_VELOCITY_SD_RADPS = 1.0
END_TURN_SD_RADPS = 1.0
END_TRAVEL_SD_MPS = 0.5
PATH_SD_RAD = 0.35  # per joint, about a given path
BODY_PART_WEIGHTS = (0.25, 0.25, 0.5)  # walks of the whole body, of a joint's half of it, and of the joint's limb
P_CONTINUE = 0.6  # a walk continues in its clip after a step
P_TELEPORT = 0.006  # a walk jumps to any posture after a step, so some walk joins any two
N_INTERLEAVED = 32  # samples read side by side, so that their memory latencies overlap
N_SAMPLES_PER_BLOCK = 256  # their sums fit the processor's cache


def squared_distances(orientations: Floats, members: Ints, parts: int, postures: Floats) -> Floats:
    """Return squared distances between samples and postures by body part, means over its joints [P, K, N], radians^2.

    Args:
        orientations: of all joint chains in the corpus's N samples, joints first [N, L, 4].
        members: the parts that each joint belongs to [J, 3].
        parts: number of parts.
        postures: orientations of the joints in K postures [K, J, 4].
    """
    out = _sums_of_squares(read_only(orientations), members, parts, postures)
    out /= np.bincount(members.ravel(), minlength=parts)[:, None, None]
    return out


@jit
def _sums_of_squares(orientations: Floats, members: Ints, parts: int, postures: Floats) -> Floats:
    """Return the distances of `squared_distances` as sums over joints, not means [P, K, N]."""
    out, shown, own = (
        np.zeros((parts, len(postures), len(orientations))),
        np.empty((4, N_SAMPLES_PER_BLOCK)),
        np.empty(N_SAMPLES_PER_BLOCK),
    )
    for first in range(0, len(orientations), N_SAMPLES_PER_BLOCK):
        count = min(N_SAMPLES_PER_BLOCK, len(orientations) - first)
        for joint in range(len(members)):
            for i in range(count):  # contiguous, for vector instructions
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
def gather_orientations(orientations: Floats, samples: Ints, part: Ints) -> Floats:
    """Gather the orientations of a body part's joints in some samples [m, n, 4].

    Args:
        orientations: of all joint chains in the corpus's N samples [N, L, 4].
        samples: indices of samples [n].
        part: the joints of the part [m].
    """
    out = np.empty((len(part), len(samples), 4))
    for first in range(0, len(samples), N_INTERLEAVED):
        here = samples[first : first + N_INTERLEAVED]
        for i in range(len(here)):  # prefetch: request the memory of all before waiting for the first
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
def part_distances(shown: Floats, postures: Floats) -> Floats:
    """Return squared distances between samples and postures, means over a part's joints [K, n], radians^2.

    Args:
        shown: orientations of the part's joints in the samples, from `gather_orientations` [m, n, 4].
        postures: of the part [K, m, 4].
    """
    joints, count, _ = shown.shape
    out, own = np.zeros((len(postures), count)), np.empty((4, N_INTERLEAVED))
    for first in range(0, count, N_INTERLEAVED):
        many = min(N_INTERLEAVED, count - first)
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


def squared_rate_differences(rates: Floats, rate: Floats) -> Floats:
    """Return squared differences between a part's angular velocities [N, m, 3] and `rate` [m, 3], means over joints
    [N]."""
    columns = ((rates - rate) ** 2).reshape(len(rates), -1).T
    return np.asarray(sum(columns, np.zeros(len(rates))) / len(rate))  # in a fixed order


def end_variance(nearest: float) -> float:
    """Return the variance of a walk's end about the given posture, radians^2.

    The standard deviation is 0.75 times the distance of the nearest sample, between 0.03 and 0.09 radians per joint:
    where movement recurs, the nearest samples predict best.

    Args:
        nearest: distance of the corpus's nearest sample from the posture, radians per joint.
    """
    return min(max(0.75 * nearest, 0.03), 0.09) ** 2


def nearest_distances(off: Floats) -> tuple[float, float]:
    """Return the distance of the nearest sample from each end, radians per joint.

    Args:
        off: squared distances from the first posture, the last, and any others [K, n], radians^2.
    """
    first, last = np.sqrt(off[:2].min(axis=1)).tolist()
    return first, last


def divide_by_variances(off: Floats, of_first: float, of_last: float) -> Floats:
    """Divide squared distances of samples by their variances [K, n].

    Args:
        off: squared distances from the first posture, the last, and those of a path [K, n], radians^2.
        of_first, of_last: variances of walks' ends about the given postures, radians^2.
    """
    variances = np.full((len(off), 1), PATH_SD_RAD**2)
    variances[:2, 0] = of_first, of_last
    return np.asarray(off / variances)


def likelihoods(squares: Floats) -> Floats:
    """Return exp(-squares / 2) for each sample, relative to the likeliest [K, n].

    Args:
        squares: squared distances in units of a variance [K, n].
    """
    exponents = 0.5 * squares
    np.subtract(exponents.min(axis=1, keepdims=True), exponents, out=exponents)
    return np.exp(exponents, out=exponents)


def share_left_out(likely: Floats, near: tuple[Bools, Bools], weights: Floats) -> float:
    """Return the share of walks that begin (or end, if that is more) in a sample not near the given posture.

    Args:
        likely: likelihoods [K, n]; row 0 is for the first posture, row 1 for the last.
        near: which samples are near the first and the last posture [n].
        weights: of the samples [n].
    """
    share = 0.0
    for k in range(2):
        likely_at = weights * likely[k]
        every, others = (float(of.cumsum()[-1]) for of in (likely_at, np.where(near[k], 0.0, likely_at)))
        share = max(share, others / every)
    return share


@jit
def arrange_by_step(likely: Floats, count: int) -> Floats:
    """Arrange likelihoods of samples by step end [S + 1, n]; 1 where no posture is given.

    Args:
        likely: at the first and the last end, then, with a path, at every second end between [K, n].
        count: S + 1.
    """
    out = np.ones((count, likely.shape[1]))
    for k in range(len(likely)):
        step = 2 * (k - 1) if k > 1 else k * (count - 1)
        for i in range(likely.shape[1]):  # a row assignment takes seconds to compile
            out[step, i] = likely[k, i]
    return out
