"""Few of a corpus's moments that stand for all of them in the walks of a part of the body.

The sums over all walks (`motionmind.walks.marginals`) take time in proportion to the corpus. Of a large corpus they
are taken over a few thousand moments, which are found by the tree of the part (`motionmind.learned.neighbours`):

- those nearest to the first posture, others among the thousand that are near it, and those that follow on them in the
  clips; as many near the last, and those that lead there;
- for all others, one moment of each of a few hundred balls into which the tree is cut.

What is nearest stands for itself. All else that is chosen in a ball stands for the rest of it, and has its weight. So
the weights add up to those of the corpus, and walks begin and end wherever they would. A step to a moment that is not
chosen leads to one that stands for its ball: no walk is lost. A path to follow makes no difference to what is chosen:
walks of the guide and those of the motion are over the same moments.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from functools import lru_cache
from typing import Concatenate, Generic, NamedTuple, ParamSpec, TypeVar
from weakref import WeakKeyDictionary, ref

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.learned.carriage import Carriage
from motionmind.learned.nearest import find_near
from motionmind.learned.neighbours import Neighbours
from motionmind.walks.likelihood import distances_of, show
from motionmind.walks.steps import follow, steps_at

SPLITS = 384  # balls that are cut in two
ENDS = 64  # moments near each end, with those that follow on them or lead to them
NEAREST = 8  # of these, that are the nearest; the others are spread evenly, from near to far,
AMONG = 1024  # over so many: of a large corpus hundreds are as near as the nearest, and what they do next differs
ALONG = 12  # steps for which these are followed, at most: 1.2 s of a corpus of five postures a second
KEPT = 32  # look-ups of parts that are kept: of a body of 16 parts those from stop to stop, twice
HARDLY = 1e-200  # of the likeliest moment: sums of such chances might be 0


class Chosen(NamedTuple):
    """Few of the corpus's moments for the walks of one part of the body, and the steps between them.

    Attributes:
        moments: their numbers, rising [n]; all of them where they are a slice.
        weights: of the moments [n].
        begins: which of them each step leads from [m].
        ends: which it leads to [m].
        shares: share of each step among those that leave the same moment [m].
        clusters: their clusters, numbered from 0 [n].
        near: which of them are near the first posture and the last, and stand there for themselves [n] each; None for
            all.
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


class Found(NamedTuple):
    """The moments of one part's walks between two postures, and what they show of it.

    Attributes:
        chosen: the moments.
        shown: what these show of the part [m, n, 4].
        off: their squared distances there from both postures [2, n], radians^2.
    """

    chosen: Chosen
    shown: Floats
    off: Floats


def _chosen(carriage: Carriage, number: int, near: Ints, nearest: Ints, balls: _Balls, steps: int) -> Chosen:
    """Return the moments chosen for the walks of a part.

    Args:
        carriage: all moments.
        number: of the part.
        near: moments near both ends, which are followed [2, n].
        nearest: those of them that stand for themselves [2, m].
        balls: of the part's tree.
        steps: for which the moments are followed.
    """
    chain = carriage.begins, carriage.ends, len(carriage.weights) - len(carriage.turn)
    ways = [follow(near[k], k == 0, steps, *chain) for k in range(2)]
    moments = np.unique(np.concatenate([near.ravel(), balls.middles, *ways]))
    weights, stands = _shares(moments, nearest.ravel(), balls, carriage.weights)
    begins, leads, which = steps_at(moments, True, *chain)
    goals = np.minimum(np.searchsorted(moments, leads), len(moments) - 1)
    others = np.flatnonzero(moments[goals] != leads)  # steps to what is not chosen lead to what stands for its ball
    goals[others] = stands[_balls_of(leads[others], balls)]
    clusters = np.unique(carriage.clusters[moments, number], return_inverse=True)[1].astype(np.int32)
    both = _among(moments, nearest[0]), _among(moments, nearest[1])
    return Chosen(moments, weights, begins, goals, carriage.shares[which], clusters, both)


def steps_on(chosen: Chosen, near: Floats) -> tuple[Ints, Ints, Floats]:
    """Return the steps of walks, as `posterior_marginals` takes them, of which some lead on from where walks begin.

    Of many performances of a dance, all moments near its last posture end clips. Then walks stay where a clip ends for
    a step, after which they may go over to another.

    Args:
        chosen: the moments, and the corpus's steps between them.
        near: how likely walks begin in each moment [n].
    """
    if near[chosen.begins].max(initial=0.0) > HARDLY:
        return chosen.begins, chosen.ends, chosen.shares
    leads = np.zeros(len(near), dtype=np.bool_)
    leads[chosen.begins] = True
    ends = np.flatnonzero(~leads)
    begins, goals = (np.concatenate([of, ends]) for of in (chosen.begins, chosen.ends))
    return begins, goals, np.concatenate([chosen.shares, np.ones(len(ends))])


def merged(some: Ints, others: Ints) -> Ints:
    """Return numbers that are among either of two, each of them rising."""
    return np.union1d(some, others)


_Owner = TypeVar("_Owner")
_Asked = ParamSpec("_Asked")
_Found = TypeVar("_Found")


class _Kept(Generic[_Owner, _Asked, _Found]):
    """A function whose last results for each first argument are kept for as long as that is in use, and no longer."""

    def __init__(self, function: Callable[Concatenate[_Owner, _Asked], _Found]) -> None:
        self._function = function
        self._kept: WeakKeyDictionary[_Owner, Callable[_Asked, _Found]] = WeakKeyDictionary()

    def __call__(self, owner: _Owner, /, *asked: _Asked.args, **named: _Asked.kwargs) -> _Found:
        if owner not in self._kept:
            self._kept[owner] = self._keeping(ref(owner))
        return self._kept[owner](*asked, **named)

    def _keeping(self, owner: ref[_Owner]) -> Callable[_Asked, _Found]:
        """Return the function for an owner that what is kept does not keep in use."""

        def look(*asked: _Asked.args, **named: _Asked.kwargs) -> _Found:
            here = owner()
            assert here is not None
            return self._function(here, *asked, **named)

        kept: Callable[_Asked, _Found] = lru_cache(maxsize=KEPT)(look)  # type: ignore[assignment]
        return kept

    def cache_clear(self) -> None:
        self._kept.clear()


def choose(carriage: Carriage, number: int, ends: Floats, steps: int) -> Found:
    """Choose moments for the walks of one part of the body, and look at them.

    Args:
        carriage: the corpus's moments, with trees.
        number: of the part.
        ends: orientations of the joints in both given postures [2, J, 4].
        steps: of a walk.
    """
    return _found(carriage, number, ends.tobytes(), min(steps, ALONG))


@_Kept  # of all parts; the guide of a search and its motion ask for the same
def _found(carriage: Carriage, number: int, ends: bytes, steps: int) -> Found:
    """Return what `choose` does; the moments near the ends are followed for so many steps."""
    trees = carriage.trees
    assert trees is not None
    postures, part = np.frombuffer(ends).reshape(2, -1, 4), trees.parts[number]
    ranked = find_near(trees, number, carriage.orientations, postures, AMONG)
    apart = np.linspace(NEAREST, ranked.shape[1] - 1, max(ENDS - NEAREST, 0))
    ranks = np.unique(np.concatenate([np.arange(NEAREST), apart]).astype(int).clip(max=ranked.shape[1] - 1))
    near, nearest, balls = ranked[:, ranks], np.ascontiguousarray(ranked[:, :NEAREST]), _balls(trees, number)
    chosen = _chosen(carriage, number, near, nearest, balls, steps)
    assert isinstance(chosen.moments, np.ndarray)
    shown = show(carriage.orientations, chosen.moments, part)
    return Found(chosen, shown, distances_of(shown, np.ascontiguousarray(postures[:, part])))


class _Balls(NamedTuple):
    """The balls that a part's tree is cut into, in its order.

    Attributes:
        starts: where they begin in that order [B].
        weights: sums of their moments' weights [B].
        middles: a moment of each [B].
        ranks: where each of the corpus's moments is in that order [N].
    """

    starts: Int32s
    weights: Floats
    middles: Ints
    ranks: Int32s


@_Kept
def _balls(trees: Neighbours, number: int) -> _Balls:
    """Return the balls that a part's tree is cut into."""
    nodes = _cut(trees.bounds, trees.radii[number], trees.weights[number])
    starts, order = np.ascontiguousarray(trees.bounds[nodes, 0]), trees.order[number]
    middles = order[trees.bounds[nodes].sum(axis=1) // 2].astype(np.int64)
    return _Balls(starts, trees.weights[number][nodes], middles, trees.ranks[number])


def _among(moments: Ints, some: Ints) -> Bools:
    """Return which of moments, that rise, are among some of them [n]."""
    out = np.zeros(len(moments), np.bool_)
    out[np.searchsorted(moments, some)] = True
    return out


def _shares(moments: Ints, singles: Ints, balls: _Balls, counts: Floats) -> tuple[Floats, Ints]:
    """Return the weights of chosen moments [n], and the first of them that stands for each ball [B].

    Args:
        moments: their numbers, rising [n].
        singles: those of them that stand for themselves.
        balls: of the part's tree.
        counts: weights of all moments [N].
    """
    ball, own, alone = _balls_of(moments, balls), counts[moments], _among(moments, singles)
    shared = np.bincount(ball[~alone], own[~alone], len(balls.weights))
    # Where none but what is near was chosen of a ball, that stands for what is left of it.
    alone &= shared[ball] > 0.0
    shared, rest = np.bincount(ball[~alone], own[~alone], len(balls.weights)), balls.weights.copy()
    np.subtract.at(rest, ball[alone], own[alone])
    stand, here = np.flatnonzero(~alone), ball[~alone]
    own[stand] *= rest[here] / shared[here]
    stands = np.empty(len(balls.weights), np.int64)
    stands[here[::-1]] = stand[::-1]
    return own, stands


def _balls_of(moments: Ints, balls: _Balls) -> Ints:
    """Return the ball that each moment is in [n]."""
    return np.searchsorted(balls.starts, balls.ranks[moments], side="right") - 1


def _cut(bounds: Int32s, radii: Floats, weights: Floats) -> Ints:
    """Cut a tree into balls, of which none is much wider or heavier: return their nodes in its order [n].

    Args:
        bounds, radii, weights: of the nodes.
    """
    heap, nodes, keys = [(-1.0, 0)], [], (-weights * radii**2).tolist()
    for _ in range(SPLITS):
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
