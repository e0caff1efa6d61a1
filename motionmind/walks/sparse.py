"""Sparse walks: a subset of a corpus's samples that represents all of them in the walks of a body part.

Sums over all walks (`motionmind.walks.marginals`) take time in proportion to the number of samples. In a large corpus
they run over a few thousand samples, found with the tree of the part (`motionmind.learned.neighbours`):

- the samples nearest to the first posture, a selection of the thousand near it, and their successors in the clips; as
  many near the last posture, and their predecessors;
- for the rest, one sample from each of a few hundred balls into which the tree is cut.

The nearest samples represent only themselves. The other chosen samples of a ball share the weight of the rest of it, so
the weights add up to those of the corpus, and walks may begin and end anywhere. A step to a sample that was not chosen
leads to a representative of its ball: no walk is lost. The choice ignores any path to follow, so the guide's walks and
those of the motion run over the same samples.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from functools import lru_cache
from typing import Concatenate, Generic, NamedTuple, ParamSpec, TypeVar
from weakref import WeakKeyDictionary, ref

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.learned.nearest import find_near
from motionmind.learned.neighbours import Neighbours
from motionmind.learned.posture_statistics import PostureStatistics
from motionmind.walks.likelihood import gather_orientations, part_distances
from motionmind.walks.steps import follow, steps_at

# Near each end, N_END_SAMPLES are chosen and followed along their clips: the nearest, and others at evenly spaced ranks
# among the neighbours. In a large corpus hundreds are about as near, and their continuations differ.
N_END_SAMPLES = 64
N_NEAREST_END_SAMPLES = 8
N_END_NEIGHBORS = 1024


class Chosen(NamedTuple):
    """The samples chosen for the walks of one body part, and the steps between them.

    Attributes:
        samples: indices of the samples, increasing [n]; a slice means all.
        weights: of the samples [n].
        begins: position in `samples` that each step leads from [m].
        ends: position that it leads to [m].
        shares: probability of each step, given the sample that it leaves [m].
        clusters: cluster of each sample, numbered from 0 [n].
        near: masks of the samples nearest to the first posture and to the last, which represent only themselves, [n]
            each; None where all samples were chosen.
    """

    samples: Ints | slice
    weights: Floats
    begins: Ints
    ends: Ints
    shares: Floats
    clusters: Int32s
    near: tuple[Bools, Bools] | None


def all_samples(statistics: PostureStatistics, number: int) -> Chosen:
    """Return all of the corpus's samples, for the walks of a part given by its index."""
    clusters = np.ascontiguousarray(statistics.clusters[:, number])
    steps = statistics.begins, statistics.ends, statistics.shares
    return Chosen(slice(None), statistics.weights, *steps, clusters, None)


class ChosenPart(NamedTuple):
    """The samples of one part's walks between two postures, and the part's orientations in them.

    Attributes:
        chosen: the samples.
        shown: orientations of the part's joints in them [m, n, 4].
        off: squared distances of the part from both postures [2, n], radians^2.
    """

    chosen: Chosen
    shown: Floats
    off: Floats


def _chosen(statistics: PostureStatistics, number: int, near: Ints, nearest: Ints, balls: _Balls, steps: int) -> Chosen:
    """Return the samples chosen for the walks of a part.

    Args:
        statistics: all samples.
        number: index of the part.
        near: samples near both ends, to follow along their clips [2, n].
        nearest: the nearest of them, which represent only themselves [2, m].
        balls: of the part's tree.
        steps: number of steps to follow them.
    """
    chain = statistics.begins, statistics.ends, len(statistics.weights) - len(statistics.turn)
    followed = [follow(near[k], k == 0, steps, *chain) for k in range(2)]
    samples = np.unique(np.concatenate([near.ravel(), balls.middles, *followed]))
    weights, representatives = _share_weights(samples, nearest.ravel(), balls, statistics.weights)
    begins, leads, which = steps_at(samples, True, *chain)
    goals = np.minimum(np.searchsorted(samples, leads), len(samples) - 1)
    others = np.flatnonzero(samples[goals] != leads)  # steps to samples not chosen lead to their ball's representative
    goals[others] = representatives[_balls_of(leads[others], balls)]
    clusters = np.unique(statistics.clusters[samples, number], return_inverse=True)[1].astype(np.int32)
    both = _mask_of(samples, nearest[0]), _mask_of(samples, nearest[1])
    return Chosen(samples, weights, begins, goals, statistics.shares[which], clusters, both)


def steps_from(chosen: Chosen, near: Floats) -> tuple[Ints, Ints, Floats]:
    """Return the steps of walks for `posterior_marginals`, so that some step leaves the samples where walks begin.

    In many performances of one dance, every sample near its last posture may end its clip. Then let a walk stay at the
    end of a clip for one step, after which it may jump to another.

    Args:
        chosen: the samples, and the corpus's steps between them.
        near: likelihood that a walk begins in each sample [n].
    """
    if near[chosen.begins].max(initial=0.0) > 1e-200:  # sums of smaller likelihoods might be 0
        return chosen.begins, chosen.ends, chosen.shares
    leads = np.zeros(len(near), dtype=np.bool_)
    leads[chosen.begins] = True
    ends = np.flatnonzero(~leads)
    begins, goals = (np.concatenate([of, ends]) for of in (chosen.begins, chosen.ends))
    return begins, goals, np.concatenate([chosen.shares, np.ones(len(ends))])


_Owner = TypeVar("_Owner")
_Asked = ParamSpec("_Asked")
_Found = TypeVar("_Found")


class _CachedPerOwner(Generic[_Owner, _Asked, _Found]):
    """A function that caches its last 32 results per first argument, for that argument's lifetime.

    For a body of 16 parts these are the choices for two pairs of stops.
    """

    def __init__(self, function: Callable[Concatenate[_Owner, _Asked], _Found]) -> None:
        self._function = function
        self._caches: WeakKeyDictionary[_Owner, Callable[_Asked, _Found]] = WeakKeyDictionary()

    def __call__(self, owner: _Owner, /, *asked: _Asked.args, **named: _Asked.kwargs) -> _Found:
        if owner not in self._caches:
            self._caches[owner] = self._cached_for(ref(owner))
        return self._caches[owner](*asked, **named)

    def _cached_for(self, owner: ref[_Owner]) -> Callable[_Asked, _Found]:
        """Return the cached function for an owner, without keeping the owner alive."""

        def look(*asked: _Asked.args, **named: _Asked.kwargs) -> _Found:
            here = owner()
            assert here is not None
            return self._function(here, *asked, **named)

        kept: Callable[_Asked, _Found] = lru_cache(maxsize=32)(look)  # type: ignore[assignment]
        return kept

    def cache_clear(self) -> None:
        self._caches.clear()


def choose(statistics: PostureStatistics, number: int, ends: Floats, steps: int) -> ChosenPart:
    """Choose samples for the walks of one body part, and measure their distances from the ends.

    Args:
        statistics: the corpus's samples, with trees.
        number: index of the part.
        ends: orientations of the joints in both given postures [2, J, 4].
        steps: number of steps in a walk.
    """
    return _choose_cached(statistics, number, ends.tobytes(), min(steps, 12))  # 1.2 s at five postures per second


@_CachedPerOwner  # the guide of a search and its motion need the same samples
def _choose_cached(statistics: PostureStatistics, number: int, ends: bytes, steps: int) -> ChosenPart:
    """Implement `choose`, with hashable arguments; follow the samples near the ends for `steps` steps."""
    trees = statistics.trees
    assert trees is not None
    postures, part = np.frombuffer(ends).reshape(2, -1, 4), trees.parts[number]
    ranked = find_near(trees, number, statistics.orientations, postures, N_END_NEIGHBORS)
    apart = np.linspace(N_NEAREST_END_SAMPLES, ranked.shape[1] - 1, max(N_END_SAMPLES - N_NEAREST_END_SAMPLES, 0))
    ranks = np.unique(
        np.concatenate([np.arange(N_NEAREST_END_SAMPLES), apart]).astype(int).clip(max=ranked.shape[1] - 1)
    )
    near, nearest, balls = (
        ranked[:, ranks],
        np.ascontiguousarray(ranked[:, :N_NEAREST_END_SAMPLES]),
        _balls(trees, number),
    )
    chosen = _chosen(statistics, number, near, nearest, balls, steps)
    assert isinstance(chosen.samples, np.ndarray)
    shown = gather_orientations(statistics.orientations, chosen.samples, part)
    return ChosenPart(chosen, shown, part_distances(shown, np.ascontiguousarray(postures[:, part])))


class _Balls(NamedTuple):
    """The balls into which a part's tree is cut, in the tree's order.

    Attributes:
        starts: rank of each ball's first sample [B].
        weights: total weight of each ball's samples [B].
        middles: one sample of each ball [B].
        ranks: rank of each of the corpus's samples [N].
    """

    starts: Int32s
    weights: Floats
    middles: Ints
    ranks: Int32s


@_CachedPerOwner
def _balls(trees: Neighbours, number: int) -> _Balls:
    """Return the balls into which a part's tree is cut."""
    nodes = _cut_tree(trees.bounds, trees.radii[number], trees.weights[number])
    starts, order = np.ascontiguousarray(trees.bounds[nodes, 0]), trees.order[number]
    middles = order[trees.bounds[nodes].sum(axis=1) // 2].astype(np.int64)
    return _Balls(starts, trees.weights[number][nodes], middles, trees.ranks[number])


def _mask_of(samples: Ints, some: Ints) -> Bools:
    """Return a mask over increasing `samples` of those in `some`, a subset [n]."""
    out = np.zeros(len(samples), np.bool_)
    out[np.searchsorted(samples, some)] = True
    return out


def _share_weights(samples: Ints, singles: Ints, balls: _Balls, counts: Floats) -> tuple[Floats, Ints]:
    """Return the weights of the chosen samples [n], and the position of the first that represents each ball [B].

    Args:
        samples: indices of the chosen samples, increasing [n].
        singles: the chosen samples that represent only themselves.
        balls: of the part's tree.
        counts: weights of all samples [N].
    """
    ball, own, alone = _balls_of(samples, balls), counts[samples], _mask_of(samples, singles)
    shared = np.bincount(ball[~alone], own[~alone], len(balls.weights))
    # If only near samples were chosen from a ball, they represent the rest of it, too.
    alone &= shared[ball] > 0.0
    shared, rest = np.bincount(ball[~alone], own[~alone], len(balls.weights)), balls.weights.copy()
    np.subtract.at(rest, ball[alone], own[alone])
    standing, here = np.flatnonzero(~alone), ball[~alone]
    own[standing] *= rest[here] / shared[here]
    representatives = np.empty(len(balls.weights), np.int64)
    representatives[here[::-1]] = standing[::-1]
    return own, representatives


def _balls_of(samples: Ints, balls: _Balls) -> Ints:
    """Return the ball of each sample [n]."""
    return np.searchsorted(balls.starts, balls.ranks[samples], side="right") - 1


def _cut_tree(bounds: Int32s, radii: Floats, weights: Floats) -> Ints:
    """Cut a tree into balls of similar width and weight; return their nodes in the tree's order [n].

    Args:
        bounds, radii, weights: of the nodes.
    """
    heap, nodes, keys = [(-1.0, 0)], [], (-weights * radii**2).tolist()
    for _ in range(384):  # splits
        if not heap:
            break
        _, node = heapq.heappop(heap)
        if 2 * node + 2 >= len(bounds):
            nodes.append(node)
            continue
        for child in (2 * node + 1, 2 * node + 2):
            heapq.heappush(heap, (keys[child], child))
    nodes += [node for _, node in heap]
    return np.array(sorted(nodes, key=bounds[:, 0].__getitem__), np.int64)
