"""Where the body goes: carried by its feet where they stand, as the corpus's bodies travel where none does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionmind import rotations as rot
from motionmind.corpus.corpus import Corpus
from motionmind.notation.anatomy import SIDES
from motionmind.realise.limits import anatomy_of, find_loose
from motionmind.realise.ways import kinds_of, limb_of_points, limbs_of
from motionmind.skeleton import Skeleton

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

GRIP = 0.015  # metres above the floor at which a foot's hold on it has fallen to 1/e
SLIP = 0.15  # what the corpus's own travel weighs beside a foot that stands
BEARS = 4  # power of how much limbs stand by which they bear the body: of two feet the one that stands the surer
SLIDES = 0.3  # metres a second at which a limb that touches the floor stands no more than half


@dataclass(frozen=True, eq=False)
class Carriage:
    """How a corpus's bodies hold themselves, travel and stand, in its postures and midway between them.

    There are N moments: the postures, then the middle of each of the M moves. A step is half a move, two in each.

    Attributes:
        orientations: of the lanes [N, L, 4].
        weights: what each moment counts [N].
        begins: moments from which the steps lead [2 M].
        ends: the moment that each leads to [2 M].
        shares: of each step among those that leave the same moment [2 M].
        kinds: of which kind each part of each moment is [N, P], as `motionmind.realise.ways` says.
        turn: turn about the vertical in each half of each move [M], radians.
        travel: displacement of the root in it, metres, in the body's heading midway [M, 3].
        clearance: height of the lowest point above the clip's floor [N], metres, at least 0. The floor is where the
            lowest point is in the lowest twentieth of the clip: a recording's own zero is often off.
        stands: how still the lowest point of each limb, and last of the trunk, is [N, limbs + 1]: 1 where it does not
            move level, 0 where it moves fast. A foot may be low and slide, as dancers' feet do.
        loose: which joints do not keep to their limits in the corpus [J].
    """

    orientations: Floats
    weights: Floats
    begins: Ints
    ends: Ints
    shares: Floats
    kinds: NDArray[np.int32]
    turn: Floats
    travel: Floats
    clearance: Floats
    stands: Floats
    loose: Bools


def learn_carriage(corpus: Corpus) -> Carriage:
    """How the bodies of a corpus hold themselves, travel and stand."""
    low = lowest(corpus.skeleton, corpus.rotations, corpus.root)
    floor = [np.quantile(low[clip.start : clip.stop], 0.05) for clip in corpus.clips]
    clearance = np.maximum(low - np.repeat(floor, [clip.stop - clip.start for clip in corpus.clips]), 0.0)
    begins, ends, weights = corpus.moves.begins, corpus.moves.ends, corpus.moves.weights
    shares = weights / np.bincount(begins, weights, len(corpus))[begins]
    heading = rot.heading(corpus.rotations[:, 0])
    turned = np.angle(np.exp(1j * (heading[ends] - heading[begins])))
    moved = rot.mul_vec(rot.about_vertical(-heading[begins] - 0.5 * turned), corpus.root[ends] - corpus.root[begins])
    lanes = corpus.to_lanes(corpus.rotations)
    orientations = np.concatenate([lanes, rot.normalise(rot.slerp(lanes[begins], lanes[ends], 0.5))])
    middles = len(corpus) + np.arange(len(begins))
    return Carriage(
        orientations,
        np.concatenate([corpus.weights, weights]),
        np.concatenate([begins, middles]),
        np.concatenate([middles, ends]),
        np.concatenate([shares, np.ones(len(begins))]),
        kinds_of(corpus.skeleton, orientations),
        0.5 * turned,
        0.5 * moved,
        np.concatenate([clearance, 0.5 * (clearance[begins] + clearance[ends])]),
        _stands(corpus),
        find_loose(corpus.skeleton, corpus.rotations),
    )


def _stands(corpus: Corpus) -> Floats:
    """How still limbs and trunk are, as in Carriage: 1 / (1 + (v / SLIDES)^2) of the level speed v of the point that is
    lowest in a move; in a posture the mean of the moves there."""
    begins, ends = corpus.moves.begins, corpus.moves.ends
    places = corpus.skeleton.positions_and_tips(corpus.rotations, corpus.root)
    limb = limb_of_points(corpus.skeleton)
    out = np.ones((len(corpus) + len(begins), len(limbs_of(corpus.skeleton)) + 1))
    counts = np.maximum(np.bincount(np.concatenate([begins, ends]), minlength=len(corpus)), 1)
    for number in range(out.shape[1]):
        points = places[:, limb == number]
        if not points.shape[1]:
            continue  # all joints are of limbs
        lowest = np.argmin(points[begins, :, 1] + points[ends, :, 1], axis=1)
        moved = points[ends, lowest] - points[begins, lowest]
        speed = np.hypot(moved[:, 0], moved[:, 2]) / corpus.moves.seconds
        still = 1.0 / (1.0 + (speed / SLIDES) ** 2)
        out[len(corpus) :, number] = still
        sums = np.bincount(begins, still, len(corpus)) + np.bincount(ends, still, len(corpus))
        out[: len(corpus), number] = sums / counts
    return out


def carry(
    skeleton: Skeleton, rotations: Floats, clearance: Floats, stands: Floats, drift: Floats, a: Floats, b: Floats
) -> Floats:
    """Positions [N, 3] of the root from `a` [3] to `b` [3], level; heights are as `stand` makes them.

    From each frame to the next the points of the body that stand near the floor are to stay, and the root is to go by
    `drift`: the displacements v minimise sum_p w_p |v + v_p|^2 + SLIP |v - drift|^2, with v_p how point p moves seen
    from the root and w_p = exp(-height / GRIP) stands^BEARS of its limb, under the condition that they add up to b - a.
    So v = (SLIP drift - sum_p w_p v_p + l) / (SLIP + sum_p w_p), with one l for all: what is missing to `b` is made up
    where the body stands least.

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        clearance: height of the lowest point above the floor [N], metres.
        stands: how much each limb, and last the trunk, stands from each frame to the next [N - 1, limbs + 1], 0 to 1.
        drift: how far the corpus's bodies would travel from each frame to the next [N - 1, 3].
        a: first position of the root.
        b: last position.
    """
    points = skeleton.positions_and_tips(rotations, np.zeros((len(rotations), 3)))
    height = points[..., 1] - points[..., 1].min(axis=-1, keepdims=True) + clearance[:, None]
    hold = np.exp(-np.maximum(height[1:], height[:-1]) / GRIP) * stands[:, limb_of_points(skeleton)] ** BEARS
    weight = SLIP + hold.sum(axis=1)
    steps = (SLIP * drift - np.einsum("np,npk->nk", hold, np.diff(points, axis=0))) / weight[:, None]
    slack = (1.0 / weight) / np.sum(1.0 / weight)
    steps += slack[:, None] * (b - a - steps.sum(axis=0))
    return np.asarray(a + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]))


def stand(skeleton: Skeleton, rotations: Floats, root: Floats, clearance: Floats) -> Floats:
    """Root positions [N, 3] that put each posture's lowest point `clearance` [N] metres above y = 0."""
    lifted = root.copy()
    lifted[:, 1] += clearance - lowest(skeleton, rotations, root)
    return lifted


def lowest(skeleton: Skeleton, rotations: Floats, root: Floats) -> Floats:
    """Heights [...] of the lowest joint, tip or heel of postures with local rotations [..., J, 4] and root [..., 3]."""
    return np.asarray(lows(skeleton, rotations, root).min(axis=-1))


def lows(skeleton: Skeleton, rotations: Floats, root: Floats) -> Floats:
    """The same for each limb, and last for the trunk [..., limbs + 1]; infinite where all joints are of limbs.

    Heels are known of bodies with an anatomy, whose proportions they are given in.
    """
    heights, limb = skeleton.positions_and_tips(rotations, root)[..., 1], limb_of_points(skeleton)
    anatomy = anatomy_of(skeleton)
    if anatomy is not None and anatomy.leg is not None:
        heel = np.array(anatomy.leg.heel) * skeleton.height / anatomy.skeleton.height
        ankles = [anatomy.named(anatomy.leg.ankle, side) for side in SIDES]
        turned = skeleton.global_rotations(rotations)[..., ankles, :]
        heels = np.stack([heel, heel * np.array([-1.0, 1.0, 1.0])])
        heights = np.concatenate([heights, heights[..., ankles] + rot.mul_vec(turned, heels)[..., 1]], axis=-1)
        limb = np.concatenate([limb, limb[ankles]])
    count = len(limbs_of(skeleton)) + 1
    out = np.full((*heights.shape[:-1], count), np.inf)
    for number in range(count):
        out[..., number] = heights[..., limb == number].min(axis=-1, initial=np.inf)
    return out
