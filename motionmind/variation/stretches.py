"""Orders of a piece's postures near a trajectory, in long enough stretches of the piece.

The order of the nearest sites (`motionmind.chaos.reorder`) may depart from the piece at every step. The cost of an
order here is its distance from the trajectory plus a charge for the insertions at its seams:

    sum over n of (|y[n] - x[order[n]]| - min over i of |y[n] - x[i]|) / scale + charge * sum over seams of seconds

Dynamic programming over the points finds the cheapest order whose stretches (runs of the piece) are long enough. Its
state is the posture that a long enough stretch has reached. The scale is the root mean square distance of the sites
from their mean. A seam leads to one of the sites nearest to its point.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from motionmind._typing import Bools, Ints, Singles
from motionmind.chaos.reorder import Itinerary
from motionmind.errors import MotionMindError
from motionmind.jit import jit

_N_LANDINGS = 32  # nearest sites at a point to which a seam may lead
_CONTINUE_CODE, _STAY_CODE = -1, -2  # steps without a seam; other values number a landing


def cheapest_order(course: Itinerary, seconds: Singles, charge: float, stretch: int) -> Ints:
    """Find the cheapest order of a piece's N postures along a trajectory of L points (see the module).

    The order stays in a posture only where the nearest site stays too.

    Args:
        course: the sites [N, d] and the trajectory [L, d].
        seconds: seconds of the insertion from each posture to each other [N, N].
        charge: the price of a second.
        stretch: the least number of postures in each stretch.

    Returns:
        Postures [L].

    Raises:
        MotionMindError: there are no such stretches.
    """
    away, landings, stays = _measure(course)
    order = _follow(away, landings, stays, np.ascontiguousarray(seconds.T), charge, stretch)
    if not len(order):
        raise MotionMindError(
            f"there is no variation of {away.shape[0]} postures in stretches of {stretch} at least: the piece has "
            f"{away.shape[1]}"
        )
    return order


@lru_cache(maxsize=1)  # a search for a price asks again and again
def _measure(course: Itinerary) -> tuple[Singles, Ints, Bools]:
    """Return the distances, landings and stays of a trajectory, as `_follow` takes them."""
    middle = course.sites - course.sites.mean(axis=0)
    scale = max(float(np.sqrt(np.sum(middle**2) / len(middle))), np.finfo(float).tiny)
    away = np.empty((len(course.points), len(course.sites)), dtype=np.float32)
    for n, point in enumerate(course.points):
        far = np.sqrt(np.sum((course.sites - point) ** 2, axis=1))
        away[n] = (far - far[course.indices[n]]) / scale
    landings = np.argsort(away, axis=1, kind="stable")[:, :_N_LANDINGS].copy()
    return away, landings, np.concatenate([[False], np.diff(course.indices) == 0])


@jit
def _follow(away: Singles, landings: Ints, stays: Bools, into: Singles, charge: float, stretch: int) -> Ints:
    """Return the cheapest order [L]; empty [0] if there is none.

    Args:
        away: distance of each posture's site from each point [L, N].
        landings: postures to which a seam may lead at each point [L, K].
        stays: whether an order may stay in its posture at a point [L].
        into: seconds of the insertion to each posture from each other [N, N]; the inner loop reads a row.
        charge, stretch: as in `cheapest_order`.
    """
    length, count = away.shape
    tried = landings.shape[1]
    best = np.full(count, np.inf)  # of orders that end at a posture, and may leave it
    after = np.full(count, np.inf)
    landed = np.full((length, tried), np.inf)  # of orders whose last stretch begins at a point with a landing
    left = np.full((length, tried), -1, dtype=np.int32)  # the posture that it leaps from
    steps = np.full((length, count), _CONTINUE_CODE, dtype=np.int8)
    for n in range(length):
        for j in range(tried):
            k = landings[n, j]
            if n == 0:
                landed[n, j] = 0.0
                continue
            for i in range(count):
                if best[i] < landed[n, j] and i != k and i + 1 != k:
                    cost = best[i] + charge * into[k, i]
                    if cost < landed[n, j]:
                        landed[n, j], left[n, j] = cost, i
        after[:] = np.inf
        for i in range(count):
            if i > 0:
                after[i] = best[i - 1] + away[n, i]
            if stays[n] and best[i] + away[n, i] < after[i]:
                after[i], steps[n, i] = best[i] + away[n, i], _STAY_CODE
        begin = n - stretch + 1
        if begin >= 0:
            for j in range(tried):
                first = landings[begin, j]
                cost, last = landed[begin, j], first + stretch - 1
                if last < count and cost < np.inf:
                    for m in range(stretch):
                        cost += away[begin + m, first + m]
                    if cost < after[last]:
                        after[last], steps[n, last] = cost, j
        best, after = after, best
    order = np.empty(length, dtype=np.int64)
    k = int(np.argmin(best))
    if best[k] == np.inf:
        return order[:0]
    n = length - 1
    while n >= 0:
        step = steps[n, k]
        if step < 0:
            order[n] = k
            n -= 1
            k -= step == _CONTINUE_CODE
        else:
            for m in range(stretch):
                order[n - m] = k - m
            n -= stretch
            k = left[n + 1, step]
    return order
