"""The mean of all walks through a corpus between given postures: a movement's postures at its moves and midway."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.limbs import parts_of
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.jit import jit
from motionmind.learned.carriage import Carriage
from motionmind.realise.marginals import posterior_marginals
from motionmind.realise.walks import ENDS_WITHIN, FOLLOWS_WITHIN, nearness


def mean_walk(
    skeleton: Skeleton, carriage: Carriage, stops: Mapping[int, Floats], half_steps: Floats, path: Floats | None
) -> tuple[Floats, Floats]:
    """Return the mean over walks from each stop to the next, and how likely each of the corpus's moments is.

    Walks of parts of all sizes count alike. The moments, by which the body travels and stands, are those of walks of
    the whole and of the part that carries it. The mean comes near the stops but not to them: its offsets there are
    subtracted along the walk in proportion to time.

    Args:
        skeleton: the body.
        carriage: the corpus's N moments and its steps between them.
        stops: orientations of the joints, or of all chains, that the walk passes [L, 4], by the number of moves that
            lead there; increasing, with the first and the last.
        half_steps: times of the moves and midway between them [2 T + 1], seconds.
        path: orientations to follow at the moves [T + 1, J, 4], or None.

    Returns:
        Orientations [2 T + 1, J, 4], and probabilities of the moments [2 T + 1, N].
    """
    joints = len(skeleton)
    poses = np.empty((len(half_steps), joints, 4))
    moments = np.empty((len(half_steps), len(carriage.weights)))
    parts = parts_of(skeleton)
    for start, end in pairwise(stops):
        here, ends = slice(2 * start, 2 * end + 1), np.stack([stops[start], stops[end]])[:, :joints]
        share = ((half_steps[here] - half_steps[2 * start]) / (half_steps[2 * end] - half_steps[2 * start]))[:, None]
        between = path[start + 1 : end] if path is not None and end > start + 1 else None
        poses[here], moments[here] = _mean_between(parts, carriage, ends, share, between)
    for move, chains in stops.items():
        poses[2 * move] = chains[:joints]
    return poses, moments


def _mean_between(
    parts: tuple[Ints, ...], carriage: Carriage, ends: Floats, share: Floats, path: Floats | None
) -> tuple[Floats, Floats]:
    """Return the mean over walks from ends[0] to ends[1] [2, J, 4] in S steps, and the moments' probabilities.

    Args:
        parts: of the body, as in `parts_of`.
        carriage: the corpus's N moments and its steps between them.
        ends: orientations at both ends [2, J, 4].
        share: of the time that has passed at each step [S + 1, 1], from 0 to 1.
        path: orientations to follow at every other step between [S / 2 - 1, J, 4], or None.

    Returns:
        Orientations [S + 1, J, 4], probabilities [S + 1, N].
    """
    straight = rot.slerp(ends[:1], ends[1:], share)
    groups = _joints_by_parts(parts, ends.shape[1])
    shared = {number for numbers in groups for number in numbers[:-1]}
    poses = np.empty_like(straight)
    marginals: dict[int, Floats] = {}
    sums: dict[tuple[int, ...], Floats] = {}
    for number, part in enumerate(parts):
        marginals[number] = _part_marginals(number, part, carriage, ends, len(share), path)
        for numbers, joints in groups.items():
            if numbers[-1] != number:
                continue
            if numbers[:-1] not in sums:
                sums[numbers[:-1]] = np.sum([marginals[n] for n in numbers[:-1]], axis=0)
            weights = (sums[numbers[:-1]] + marginals[number]) / len(numbers)
            about = np.ascontiguousarray(straight[:, joints])
            shown = np.ascontiguousarray(carriage.orientations[:, joints])
            off = rot.log(rot.inv_mul(about, mean_rotations(weights, shown, about)))
            off -= (1.0 - share)[..., None] * off[:1] + share[..., None] * off[-1:]
            poses[:, joints] = rot.mul(about, rot.exp(off))
        if number not in shared:
            del marginals[number]  # a large corpus's are large
    return poses, 0.5 * (marginals[0] + marginals[1])


def _part_marginals(
    number: int, part: Ints, carriage: Carriage, ends: Floats, count: int, path: Floats | None
) -> Floats:
    """Return the posterior marginals [count, N] of walks of one part of the body; arguments as in `_mean_between`."""
    shown = np.ascontiguousarray(carriage.orientations[:, part])
    near = np.ones((count, len(carriage.weights)))
    if path is not None:
        near[2:-2:2] = [nearness(shown, posture, FOLLOWS_WITHIN) for posture in path[:, part]]
    near[0], near[-1] = (nearness(shown, posture, ENDS_WITHIN) for posture in ends[:, part])
    near[0] *= carriage.weights
    clusters = np.ascontiguousarray(carriage.clusters[:, number])
    return posterior_marginals(carriage.begins, carriage.ends, carriage.shares, clusters, near)


def _joints_by_parts(parts: tuple[Ints, ...], joints: int) -> dict[tuple[int, ...], list[int]]:
    """Return groups of joints by the numbers of the parts that they are in, one of each size."""
    groups: dict[tuple[int, ...], list[int]] = {}
    for joint in range(joints):
        groups.setdefault(tuple(number for number, part in enumerate(parts) if joint in part), []).append(joint)
    return groups


@jit
def mean_rotations(weights: Floats, orientations: Floats, about: Floats) -> Floats:
    """Return weighted means [S, m, 4] of orientations, in the hemisphere of `about`.

    The mean is the normalised sum of quaternions of one sign, which is within a few thousandths of the mean rotation
    where they lie within a right angle. Source: Gramkow, "On averaging rotations", IJCV 42 (2001).

    Args:
        weights: of the orientations in each mean [S, N].
        orientations: of m joints [N, m, 4].
        about: orientations that choose each quaternion's sign, and stand in for a mean of length 0 [S, m, 4].
    """
    out = np.zeros_like(about)
    for t in range(len(weights)):
        for i in range(weights.shape[1]):
            weight = weights[t, i]
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
