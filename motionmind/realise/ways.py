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
from numpy.typing import NDArray

from motionmind.jit import jit
from motionmind.skeleton import Skeleton

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ALIKE = 0.2  # radians a joint (root mean square) within which postures of a part are of one kind
NEAR = 0.11  # the same, standard deviation: how near a walk's ends are to the postures that are given
CLOSELY = 0.13  # the same: how closely a walk follows a path that it is to follow
STRAIGHT_ON = 0.7  # share of steps after which a walk goes straight on as its clip does
ANYWHERE = 0.003  # share after which it goes on from any posture, so that some walk joins any two


def fork_of(skeleton: Skeleton) -> list[int]:
    """The joints from the root to the first fork, where a rig's own root or two may lie above the pelvis."""
    out = [0]
    while len(children := skeleton.children(out[-1])) == 1:
        out += children
    return out


def limbs_of(skeleton: Skeleton) -> list[list[int]]:
    """The joints of each limb, outward: a leaf and what leads to it from the last fork, as a leg, an arm, neck and
    head."""
    chains = []
    for end in (joint for joint in range(1, len(skeleton)) if not skeleton.children(joint)):
        chain = [end]
        while (above := skeleton.parents[chain[0]]) > 0 and len(skeleton.children(above)) == 1:
            chain.insert(0, above)
        chains.append(chain)
    return chains


def limb_of_points(skeleton: Skeleton) -> Ints:
    """To which of `limbs_of` each joint belongs, then each tip [2 J]; to one more, the trunk, what belongs to none."""
    limbs = limbs_of(skeleton)
    out = np.full(len(skeleton), len(limbs), dtype=np.int64)
    for number, limb in enumerate(limbs):
        out[limb] = number
    return np.concatenate([out, out])


def parts_of(skeleton: Skeleton) -> tuple[Ints, ...]:
    """The joints of parts of a body, each joint in one of each size: the whole; what carries it, and what is carried
    (if anything is); the trunk, which is what is left, and the limbs.

    What carries the body is its root, down to the first fork, and the limbs that hang there: pelvis and legs.
    """
    chains, above = limbs_of(skeleton), fork_of(skeleton)
    every = list(range(len(skeleton)))
    carrying = [*above, *(joint for chain in chains if skeleton.parents[chain[0]] == above[-1] for joint in chain)]
    carried = [joint for joint in every if joint not in carrying]
    trunk = [joint for joint in every if not any(joint in chain for chain in chains)]
    found = (every, carrying, carried, trunk, *chains)
    return tuple(np.array(part, dtype=np.int64) for part in found if part)


def kinds_of(skeleton: Skeleton, orientations: Floats) -> NDArray[np.int32]:
    """Which kind each part of a body is of in lanes' orientations [N, L, 4]: [N, P], parts as in `parts_of`, kinds from
    0.

    In the order of the postures one founds a kind unless a founder lies within ALIKE; then each joins the nearest.
    """
    parts = parts_of(skeleton)
    out = np.empty((len(orientations), len(parts)), dtype=np.int32)
    for part, joints in enumerate(parts):
        out[:, part] = _kinds(np.ascontiguousarray(orientations[:, joints]), len(joints) * ALIKE**2)
    return out


@jit
def _kinds(orientations: Floats, within: float) -> Ints:
    founders = np.empty(len(orientations), np.int64)
    out = np.empty(len(orientations), np.int64)
    count = 0
    for late in (False, True):
        for i in range(len(orientations)):
            least = np.inf
            for k in range(count):
                distance = squared(orientations[i], orientations[founders[k]])
                if distance < least:
                    least, out[i] = distance, k
            if not late and least > within:
                founders[count] = i
                count += 1
    return out


@jit
def squared(a: Floats, b: Floats) -> float:
    """Sum over joints of 4 sin^2 of half the angle between rotations [m, 4]: its square, where it is small."""
    total = 0.0
    for j in range(len(a)):
        cosine = a[j, 0] * b[j, 0] + a[j, 1] * b[j, 1] + a[j, 2] * b[j, 2] + a[j, 3] * b[j, 3]
        total += 4.0 * max(1.0 - cosine * cosine, 0.0)
    return total


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
def likely(begins: Ints, ends: Ints, shares: Floats, kinds: NDArray[np.int32], near: Floats) -> Floats:
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
def _mixed(mass: Floats, kinds: NDArray[np.int32], sizes: Ints) -> Floats:
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
