"""Few of a corpus's moments that stand for all of them in the walks of a part of the body.

The sums over all walks (`motionmind.realise.marginals`) take time in proportion to the corpus. Of a large corpus they
are taken over a few thousand moments, which are found by the tree of the part (`motionmind.learned.neighbours`):

- those nearest to the first posture, where walks begin, and those that follow on them in the clips; those nearest to
  the last, where walks end, and those that lead there; those nearest to each posture of a path to follow;
- for all others, one moment of each of a few hundred balls into which the tree is cut: they are the smaller, the nearer
  to the path that walks are to follow.

What is nearest stands for itself. All else that is chosen in a ball stands for the rest of it, and has its weight. So
the weights add up to those of the corpus. A step to a moment that is not chosen leads to one that stands for its ball:
no walk is lost.
"""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints, Singles
from motionmind.geometry.distances import squared_distance
from motionmind.jit import jit
from motionmind.learned.carriage import Carriage
from motionmind.learned.neighbours import INSIDE, Neighbours, find_near
from motionmind.realise.steps import follow, steps_at
from motionmind.realise.walks import FOLLOWS_WITHIN

SPLITS = 640  # balls that are cut in two
ENDS = 96  # moments near each end, with those that follow on them or lead to them
ALONG = 8  # steps for which these are followed
NEAREST, BY_PATH = 24, 16  # of those at the ends, that are followed half the way; moments near each posture of a path
PATH_LEAVES = 12  # of a tree that are searched for these
EVERYWHERE = 0.01  # of what following a path counts, what any ball does


class Chosen(NamedTuple):
    """Few of the corpus's moments for the walks of one part of the body, and the steps between them.

    Attributes:
        moments: their numbers, rising [n]; all of them where they are a slice.
        weights: of the moments [n].
        begins: which of them each step leads from [m].
        ends: which it leads to [m].
        shares: share of each step among those that leave the same moment [m].
        clusters: their clusters, numbered from 0 [n].
        near: which of them are near the first posture and the last, where walks begin and end [n] each; None for all.
    """

    moments: Ints | slice
    weights: Floats
    begins: Ints
    ends: Ints
    shares: Floats
    clusters: Int32s
    near: tuple[Bools, Bools] | None


def all_of(carriage: Carriage, number: int) -> Chosen:
    """Return all of the corpus's moments, for the walks of the part of that number."""
    clusters = np.ascontiguousarray(carriage.clusters[:, number])
    steps = carriage.begins, carriage.ends, carriage.shares
    return Chosen(slice(None), carriage.weights, *steps, clusters, None)


def choose(trees: Neighbours, number: int, carriage: Carriage, ends: Floats, path: Floats | None, steps: int) -> Chosen:
    """Choose moments for the walks of one part of the body.

    Args:
        trees: of the corpus.
        number: of the part.
        carriage: the corpus's moments.
        ends: orientations of the joints in both given postures [2, J, 4].
        path: those that walks are to follow [K, J, 4], or None.
        steps: of a walk.
    """
    part, shown = trees.parts[number], carriage.orientations
    near, _ = find_near(trees, number, shown, ends, ENDS)
    middle = ends[:0] if path is None else path
    by_path, _ = find_near(trees, number, shown, middle, BY_PATH, PATH_LEAVES)
    nodes = _cut(
        np.ascontiguousarray(middle[:, part]),
        trees.bounds,
        trees.centres_of(number),
        trees.radii[number],
        trees.weights[number],
    )
    moments, weights, begins, leads, shares, clusters, first, last = _assemble(
        near,
        by_path.ravel(),
        steps // 2 + 1,
        trees.bounds[nodes],
        trees.weights[number][nodes],
        trees.order[number],
        trees.ranks[number],
        carriage.begins,
        carriage.ends,
        carriage.shares,
        carriage.weights,
        carriage.clusters[:, number],
    )
    return Chosen(moments, weights, begins, leads, shares, clusters, (first, last))


@jit
def _assemble(
    near: Ints,
    by_path: Ints,
    halfway: int,
    bounds: Int32s,
    balls: Floats,
    order: Int32s,
    ranks: Int32s,
    begins: Ints,
    ends: Ints,
    shares: Floats,
    counts: Floats,
    clusters: Int32s,
) -> tuple[Ints, Floats, Ints, Ints, Floats, Int32s, Bools, Bools]:
    """Return the fields of `Chosen` but the last, which is parted in two.

    Args:
        near: moments near each end, the nearest first [2, n].
        by_path: those near the path's postures.
        halfway: steps for which those nearest to the ends are followed.
        bounds: where the balls begin and end in the tree's order [B, 2], rising.
        balls: their weights [B].
        order, ranks: of the tree [N].
        begins, ends, shares: of the corpus's steps [2 M].
        counts: weights of its moments [N].
        clusters: of its moments [N].
    """
    postures = len(counts) - len(begins) // 2
    singles = np.unique(np.concatenate((near.ravel(), by_path)))
    runs = [
        singles,
        order[(bounds[:, 0] + bounds[:, 1]) // 2].astype(np.int64),
        follow(by_path, True, 2, begins, ends, postures),
    ]
    for end in range(2):
        runs.append(follow(near[end], end == 0, ALONG, begins, ends, postures))
        runs.append(follow(near[end, :NEAREST], end == 0, halfway, begins, ends, postures))
    total = 0
    for run in runs:
        total += len(run)
    every, total = np.empty(total, np.int64), 0
    for run in runs:
        every[total : total + len(run)] = run
        total += len(run)
    moments = np.unique(every)
    starts = bounds[:, 0].copy()

    ball, alone = np.empty(len(moments), np.int64), np.zeros(len(moments), np.bool_)
    alone[np.searchsorted(moments, singles)] = True
    shared, rest = np.zeros(len(balls)), balls.copy()
    for k in range(len(moments)):
        ball[k] = np.searchsorted(starts, ranks[moments[k]], side="right") - 1
        if not alone[k]:
            shared[ball[k]] += counts[moments[k]]
    for k in range(len(moments)):
        if alone[k] and shared[ball[k]] > 0.0:
            rest[ball[k]] -= counts[moments[k]]
    # Where none but what is near was chosen of a ball, that stands for what is left of it.
    for k in range(len(moments)):
        if alone[k] and shared[ball[k]] == 0.0:
            alone[k] = False
            for n in range(k, len(moments)):
                if ball[n] == ball[k]:
                    alone[n] = False
                    shared[ball[k]] += counts[moments[n]]
    weights, stands = np.empty(len(moments)), np.empty(len(balls), np.int64)
    for k in range(len(moments) - 1, -1, -1):
        weights[k] = counts[moments[k]]
        if not alone[k]:
            weights[k] *= rest[ball[k]] / shared[ball[k]]
            stands[ball[k]] = k

    leave, lead, steps = steps_at(moments, True, begins, ends, postures)
    goal = np.empty(len(lead), np.int64)
    for k in range(len(lead)):
        at = np.searchsorted(moments, lead[k])
        if at < len(moments) and moments[at] == lead[k]:
            goal[k] = at
        else:
            goal[k] = stands[np.searchsorted(starts, ranks[lead[k]], side="right") - 1]
    own = clusters[moments]
    named = np.searchsorted(np.unique(own), own).astype(np.int32)
    first, last = np.zeros(len(moments), np.bool_), np.zeros(len(moments), np.bool_)
    first[np.searchsorted(moments, near[0])] = True
    last[np.searchsorted(moments, near[1])] = True
    return moments, weights, leave, goal, shares[steps], named, first, last


@jit
def _cut(path: Floats, bounds: Int32s, centres: Singles, radii: Floats, weights: Floats) -> Ints:
    """Cut a tree into balls that are the smaller, the more they matter: return their nodes in its order [n].

    Args:
        path: the part in the postures to follow [K, m, 4].
        bounds, centres, radii, weights: of the nodes.
    """
    heap, leaves = [(-1.0, 0)], [0][:0]
    for _ in range(SPLITS):
        if not heap:
            break
        _, node = heapq.heappop(heap)
        if 2 * node + 2 >= len(bounds):
            leaves.append(node)
            continue
        for child in (2 * node + 1, 2 * node + 2):
            worth = EVERYWHERE
            for k in range(len(path)):
                away = np.sqrt(squared_distance(centres[child], path[k]) / path.shape[1])
                worth += np.exp(-(max(away - INSIDE * radii[child], 0.0) ** 2) / (2.0 * FOLLOWS_WITHIN**2))
            heapq.heappush(heap, (-weights[child] * worth * radii[child] ** 2, child))
    for _, node in heap:
        leaves.append(node)
    nodes = np.array(leaves, np.int64)
    return nodes[np.argsort(bounds[nodes, 0])]
