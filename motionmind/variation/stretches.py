"""Orders of a piece's postures near a trajectory, in long enough stretches of the piece.

The order of the nearest sites (`motionmind.chaos.reorder`) may depart from the piece at every step. The cost of an
order here is its distance from the trajectory plus a charge for the insertions at its seams:

    sum over n of (|y[n] - x[order[n]]| - min over i of |y[n] - x[i]|) / scale + charge * sum over seams of seconds

Dynamic programming over the points finds the cheapest order whose stretches (runs of the piece) are long enough. Its
state is the posture that a long enough stretch has reached. The scale is the root mean square distance of the sites
from their mean. A seam leads to one of the sites nearest to its point.
"""

from __future__ import annotations

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
    count, length = len(course.sites), len(course.points)
    middle = course.sites - course.sites.mean(axis=0)
    scale = max(float(np.sqrt(np.sum(middle**2) / count)), np.finfo(float).tiny)
    away = np.empty((length, count), dtype=np.float32)
    for n, point in enumerate(course.points):
        far = np.sqrt(np.sum((course.sites - point) ** 2, axis=1))
        away[n] = (far - far[course.indices[n]]) / scale
    landings = np.argsort(away, axis=1, kind="stable")[:, :_N_LANDINGS]
    stays = np.concatenate([[False], np.diff(course.indices) == 0])
    order = _follow(away, landings, stays, seconds, charge, stretch)
    if not len(order):
        raise MotionMindError(
            f"there is no variation of {length} postures in stretches of {stretch} at least: the piece has {count}"
        )
    return order


@jit
def _follow(away: Singles, landings: Ints, stays: Bools, seconds: Singles, charge: float, stretch: int) -> Ints:
    """Return the cheapest order [L]; empty [0] if there is none.

    Args:
        away: distance of each posture's site from each point [L, N].
        landings: postures to which a seam may lead at each point [L, K].
        stays: whether an order may stay in its posture at a point [L].
        seconds, charge, stretch: as in `cheapest_order`.
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
                if i != k and i + 1 != k:
                    cost = best[i] + charge * seconds[i, k]
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
