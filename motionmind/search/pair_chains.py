"""A tighter bound: the grid cut into strips of two lanes, each with its least cost exact.

Messages along single edges cannot see around a cycle: they let a variable be half one value and half another. Two
lanes that are coupled, a *strip*, are a chain of pairs of states, whose least cost dynamic programming finds. Every
lane but the first makes a strip with its parent (with the first lane, where it has none). Couplings belong to one
strip each; what a lane costs on its own, in its states and along its edges, is shared out among the strips that it
is in. Whatever the shares are, the strips' least costs add up to a lower bound of the grid's.

The shares are made better by coordinate ascent. Each strip asks for every position of a variable what it costs at
least with that position: the least of so_far + to_go. Shares are then moved so that the strips of the variable all ask
the same, their mean. That never lowers the bound, for n strips that ask the mean m(x) cost n min m(x) together, and
before they cost the sum of their minima, which is at most that. The same is done for the edges between a variable and
its lane's next. Sweeps forward and back do so along the moves, as with messages, so that so_far is up to date where
the sweep goes forward, and to_go where it goes back.

With values chosen for all variables up to one, what the strips still cost at least bounds the cost to go, and it
grows consistently along a path (`step`): this is the estimate that A* searches by. And what the strips of a variable
ask for a position, with the least costs of the others, bounds all paths through it.

Sources: Komodakis, Paragios and Tziritas, "MRF energy minimization and beyond via dual decomposition", IEEE TPAMI
33(3), 2011; Kolmogorov, "A new look at reweighted message passing", IEEE TPAMI 37(5), 2015 (the averaging in order).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, Ints
from motionmind.jit import jit
from motionmind.search.trellis import Grid
from motionmind.search.trws import Messages, subset, worth


class Strips(NamedTuple):
    """Shares and tables of the strips of a grid with at least two lanes.

    The strip of a lane has at each move a table of pairs, (position of the lane above, position of the lane), that is
    listed under the variable i of the lane. Pairs are numbered by indices into the two domains, the lane's own fastest.

    Attributes:
        above: the other lane of each lane's strip [L]; the first lane has no strip of its own.
        kid_ptr: lanes that a lane is above of, `kids[kid_ptr[lane] : kid_ptr[lane + 1]]` [L + 1].
        kids: [L - 1].
        pair_ptr: first pair of variable i [n + 1].
        stand: a strip's share of what a pair costs at its move [Q].
        so_far: the least that a strip costs up to a pair, with it [Q].
        to_go: the least that it costs after a pair [Q].
        half_ptr: first entry of variable i in `half` [n + 1].
        half: the least that a strip costs once the lane above has moved to i's move and the lane itself has not:
            by (position of the lane above at the move, position of the lane one move before).
        own: share of the edge's cost that the lane's own strip bears [R].
        led_ptr: first entry of variable i in `led` [n + 1].
        led: share that the strip of variable i bears of the edges of the variable above it, in their order.
    """

    above: Ints
    kid_ptr: Ints
    kids: Ints
    pair_ptr: Ints
    stand: Floats
    so_far: Floats
    to_go: Floats
    half_ptr: Ints
    half: Floats
    own: Floats
    led_ptr: Ints
    led: Floats


@jit
def pairs(grid: Grid) -> int:
    """How many pairs the strips of a grid list: what their memory and a sweep's time grow with."""
    count = 0
    for i in range(len(grid.dom_ptr) - 1):
        if i % grid.lanes > 0:
            count += _size(grid, i) * _size(grid, _above(grid, i))
    return count


@jit
def cut(grid: Grid, m: Messages) -> Strips:
    """The strips of a grid, its costs as messages have shifted them shared out evenly."""
    lanes = grid.lanes
    s = _room(grid)
    theta, edge = _shifted(grid, m)
    for i in range(len(grid.dom_ptr) - 1):
        lane = i % lanes
        if lane == 0:
            continue
        a = _above(grid, i)
        mine, theirs = 1.0 / len(_strips_of(s, lane)), 1.0 / len(_strips_of(s, s.above[lane]))
        for e in range(grid.row_ptr[grid.dom_ptr[i]], grid.row_ptr[grid.dom_ptr[i + 1]]):
            s.own[e] = mine * edge[e]
        first = grid.row_ptr[grid.dom_ptr[a]]
        for k in range(s.led_ptr[i + 1] - s.led_ptr[i]):
            s.led[s.led_ptr[i] + k] = theirs * edge[first + k]
        coupled = grid.up_ptr[i + 1] > grid.up_ptr[i]
        for p in range(_size(grid, a)):
            base = s.pair_ptr[i] + p * _size(grid, i) - grid.dom_ptr[i]
            for x in range(grid.dom_ptr[i], grid.dom_ptr[i + 1]):
                s.stand[base + x] = theirs * theta[grid.dom_ptr[a] + p] + mine * theta[x]
                if coupled:
                    s.stand[base + x] -= m.up_col[grid.up_ptr[i] + p] + m.down_col[x]
            if coupled:
                for q in range(grid.col_ptr[grid.up_ptr[i] + p], grid.col_ptr[grid.up_ptr[i] + p + 1]):
                    s.stand[base + grid.col_to[q]] += grid.col_cost[q]
    _look_ahead(grid, s)
    return s


@jit
def sweep(grid: Grid, s: Strips, through: Floats) -> float:
    """One sweep forward and one back; the lower bound that they prove.

    Writes to `through` [P] a lower bound on the cost of every path through each position.
    """
    lanes = grid.lanes
    for t in range(grid.moves + 1):
        for i in range(t * lanes + 1, (t + 1) * lanes):
            _push(grid, s, i)
        for i in range(t * lanes, (t + 1) * lanes):
            _agree_at(grid, s, i)
        if t < grid.moves:
            for i in range(t * lanes, (t + 1) * lanes):
                _agree_along(grid, s, i)
    least = np.zeros(lanes)
    for t in range(grid.moves, -1, -1):
        if t < grid.moves:
            for i in range((t + 1) * lanes - 1, t * lanes - 1, -1):
                _agree_along(grid, s, i)
            for i in range(t * lanes + 1, (t + 1) * lanes):
                _pull(grid, s, i + lanes)
        for i in range((t + 1) * lanes - 1, t * lanes - 1, -1):
            _agree_at(grid, s, i)
        begin, end = grid.dom_ptr[t * lanes], grid.dom_ptr[(t + 1) * lanes]
        through[begin:end] = 0.0
        for i in range(t * lanes + 1, (t + 1) * lanes):
            a = _above(grid, i)
            asked = _asked_at(grid, s, i, i)
            least[i % lanes] = np.min(asked)
            through[grid.dom_ptr[i] : grid.dom_ptr[i + 1]] += asked - least[i % lanes]
            through[grid.dom_ptr[a] : grid.dom_ptr[a + 1]] += _asked_at(grid, s, i, a) - least[i % lanes]
        through[begin:end] += np.sum(least)
    return float(np.sum(least))


@jit
def proven(s: Strips) -> float:
    """The lower bound: the least that the strips cost from the start on."""
    bound = 0.0
    for lane in range(1, len(s.above)):
        bound += s.stand[s.pair_ptr[lane]] + s.to_go[s.pair_ptr[lane]]
    return bound


@jit
def narrow(grid: Grid, s: Strips, through: Floats, below: float) -> tuple[Grid, Strips]:
    """The grid without the positions that no path cheaper than `below` goes through, and its strips.

    A domain is left empty where there is no such path at all; then the strips mean nothing.
    """
    kept = worth(grid, through, below)
    smaller = subset(grid, kept)
    fewer = _room(smaller)
    if np.any(np.diff(smaller.dom_ptr) == 0):
        return smaller, fewer
    edges = np.zeros(len(grid.row_to), np.bool_)
    for p in range(len(kept)):
        for e in range(grid.row_ptr[p], grid.row_ptr[p + 1]):
            edges[e] = kept[p] and kept[grid.row_to[e]]
    stand, led = np.zeros(len(s.stand), np.bool_), np.zeros(len(s.led), np.bool_)
    for i in range(len(grid.dom_ptr) - 1):
        if i % grid.lanes > 0:
            a, size = _above(grid, i), _size(grid, i)
            for p in range(_size(grid, a)):
                if kept[grid.dom_ptr[a] + p]:
                    base = s.pair_ptr[i] + p * size
                    stand[base : base + size] = kept[grid.dom_ptr[i] : grid.dom_ptr[i + 1]]
            first, last = grid.row_ptr[grid.dom_ptr[a]], grid.row_ptr[grid.dom_ptr[a + 1]]
            led[s.led_ptr[i] : s.led_ptr[i + 1]] = edges[first:last]
    fewer.stand[:], fewer.own[:], fewer.led[:] = s.stand[stand], s.own[edges], s.led[led]
    _look_ahead(smaller, fewer)
    return smaller, fewer


@jit
def step(grid: Grid, s: Strips, i: int, frontier: NDArray[np.uint16], e: int) -> float:
    """What the cost so far and the bound on the rest grow by when variable i takes the position that edge `e` leads to.

    `frontier` is the last choice in each lane [L], as an index into its domain: at this move for lanes before i's, one
    move before for all others. At least 0 but for rounding.
    """
    lane = i % grid.lanes
    b = i - grid.lanes
    before, x = frontier[lane], grid.row_to[e] - grid.dom_ptr[i]
    grown = 0.0
    if lane > 0:
        above = frontier[s.above[lane]]
        k = s.pair_ptr[i] + above * _size(grid, i) + x
        grown += s.own[e] + s.stand[k] + s.to_go[k] - s.half[s.half_ptr[i] + above * _size(grid, b) + before]
    for k in range(s.kid_ptr[lane], s.kid_ptr[lane + 1]):
        c = b - lane + s.kids[k]
        size, y = _size(grid, c), frontier[s.kids[k]]
        grown += s.led[s.led_ptr[c] + e - grid.row_ptr[grid.dom_ptr[b]]]
        grown += s.half[s.half_ptr[c + grid.lanes] + x * size + y] - s.to_go[s.pair_ptr[c] + before * size + y]
    return grown


@jit
def descend(grid: Grid, s: Strips, path: Ints) -> None:
    """Write to `path` [n] (positions) the path that takes the least growth each time."""
    lanes = grid.lanes
    frontier = np.zeros(lanes, np.uint16)
    path[:lanes] = grid.dom_ptr[:lanes]
    for i in range(lanes, len(path)):
        before, least = path[i - lanes], np.inf
        for e in range(grid.row_ptr[before], grid.row_ptr[before + 1]):
            grown = step(grid, s, i, frontier, e)
            if grown < least:
                least, path[i] = grown, grid.row_to[e]
        frontier[i % lanes] = path[i] - grid.dom_ptr[i]


# --- shares ----------------------------------------------------------------------------------------------------------


@jit
def _agree_at(grid: Grid, s: Strips, i: int) -> None:
    """Move shares of the positions of variable i so that its strips ask the same for each."""
    members = _strips_of(s, i % grid.lanes)
    if len(members) < 2 or _size(grid, i) < 2:
        return
    first = i - i % grid.lanes
    asked = np.empty((len(members), _size(grid, i)))
    for k in range(len(members)):
        asked[k] = _asked_at(grid, s, first + members[k], i)
    mean = np.sum(asked, axis=0) / len(members)
    for k in range(len(members)):
        j, more = first + members[k], mean - asked[k]
        size = _size(grid, j)
        for p in range(_size(grid, _above(grid, j))):
            base = s.pair_ptr[j] + p * size
            for x in range(size):
                s.stand[base + x] += more[x] if j == i else more[p]
                s.so_far[base + x] += more[x] if j == i else more[p]


@jit
def _agree_along(grid: Grid, s: Strips, i: int) -> None:
    """Move shares of the edges out of variable i so that its strips ask the same for each."""
    members = _strips_of(s, i % grid.lanes)
    if len(members) < 2 or (_size(grid, i) < 2 and _size(grid, i + grid.lanes) < 2):
        return
    first = i - i % grid.lanes
    begin, end = grid.row_ptr[grid.dom_ptr[i]], grid.row_ptr[grid.dom_ptr[i + 1]]
    asked = np.empty((len(members), end - begin))
    for k in range(len(members)):
        j = first + members[k]
        asked[k] = _asked_along_own(grid, s, j) if j == i else _asked_along_led(grid, s, j)
    mean = np.sum(asked, axis=0) / len(members)
    for k in range(len(members)):
        j, more = first + members[k], mean - asked[k]
        if j == i:
            s.own[begin:end] += more
        else:
            s.led[s.led_ptr[j] : s.led_ptr[j + 1]] += more


@jit
def _asked_at(grid: Grid, s: Strips, j: int, i: int) -> Floats:
    """The least that the strip of variable j costs with each position of variable i, which is j or the one above it."""
    size = _size(grid, j)
    asked = np.full(_size(grid, i), np.inf)
    for p in range(_size(grid, _above(grid, j))):
        base = s.pair_ptr[j] + p * size
        for x in range(size):
            k = x if j == i else p
            asked[k] = min(asked[k], s.so_far[base + x] + s.to_go[base + x])
    return asked


@jit
def _asked_along_own(grid: Grid, s: Strips, j: int) -> Floats:
    """The least that the strip of variable j costs with each edge out of j."""
    a, after = _above(grid, j), j + grid.lanes
    was, size = _size(grid, j), _size(grid, after)
    moved = np.full((_size(grid, a + grid.lanes), was), np.inf)  # so_far and an edge of the lane above
    for p in range(grid.dom_ptr[a], grid.dom_ptr[a + 1]):
        base = s.pair_ptr[j] + (p - grid.dom_ptr[a]) * was
        for e in range(grid.row_ptr[p], grid.row_ptr[p + 1]):
            to, cost = grid.row_to[e] - grid.dom_ptr[a + grid.lanes], _led(grid, s, j, e)
            for x in range(was):
                moved[to, x] = min(moved[to, x], s.so_far[base + x] + cost)
    first = grid.row_ptr[grid.dom_ptr[j]]
    asked = np.full(grid.row_ptr[grid.dom_ptr[j + 1]] - first, np.inf)
    for p in range(len(moved)):
        base = s.pair_ptr[after] + p * size - grid.dom_ptr[after]
        for x in range(was):
            for e in range(grid.row_ptr[grid.dom_ptr[j] + x], grid.row_ptr[grid.dom_ptr[j] + x + 1]):
                k = base + grid.row_to[e]
                asked[e - first] = min(asked[e - first], moved[p, x] + s.stand[k] + s.to_go[k])
    return asked + s.own[first : first + len(asked)]


@jit
def _asked_along_led(grid: Grid, s: Strips, j: int) -> Floats:
    """The least that the strip of variable j costs with each edge out of the variable above j."""
    a, after = _above(grid, j), j + grid.lanes
    size = _size(grid, after)
    first = grid.row_ptr[grid.dom_ptr[a]]
    asked = np.full(grid.row_ptr[grid.dom_ptr[a + 1]] - first, np.inf)
    for p in range(grid.dom_ptr[a], grid.dom_ptr[a + 1]):
        moved = _moved(grid, s, j, p - grid.dom_ptr[a])
        for e in range(grid.row_ptr[p], grid.row_ptr[p + 1]):
            base = s.pair_ptr[after] + (grid.row_to[e] - grid.dom_ptr[a + grid.lanes]) * size
            for x in range(size):
                asked[e - first] = min(asked[e - first], moved[x] + s.stand[base + x] + s.to_go[base + x])
    return asked + s.led[s.led_ptr[j] : s.led_ptr[j + 1]]


# --- tables ----------------------------------------------------------------------------------------------------------


@jit
def _push(grid: Grid, s: Strips, i: int) -> None:
    """so_far of variable i from that one move before: first its lane moves, then the lane above."""
    lanes = grid.lanes
    first, last, size = s.pair_ptr[i], s.pair_ptr[i + 1], _size(grid, i)
    s.so_far[first:last] = s.stand[first:last]
    if i < lanes:
        return
    a, least = _above(grid, i - lanes), np.full(last - first, np.inf)
    for p in range(grid.dom_ptr[a], grid.dom_ptr[a + 1]):
        moved = _moved(grid, s, i - lanes, p - grid.dom_ptr[a])
        for e in range(grid.row_ptr[p], grid.row_ptr[p + 1]):
            base, cost = (grid.row_to[e] - grid.dom_ptr[a + lanes]) * size, _led(grid, s, i - lanes, e)
            for x in range(size):
                least[base + x] = min(least[base + x], moved[x] + cost)
    s.so_far[first:last] += least


@jit
def _moved(grid: Grid, s: Strips, j: int, p: int) -> Floats:
    """The least so_far with index p above variable j, and an edge of j's lane, by where the edge leads."""
    after = j + grid.lanes
    moved = np.full(_size(grid, after), np.inf)
    base = s.pair_ptr[j] + p * _size(grid, j) - grid.dom_ptr[j]
    for x in range(grid.dom_ptr[j], grid.dom_ptr[j + 1]):
        for e in range(grid.row_ptr[x], grid.row_ptr[x + 1]):
            to = grid.row_to[e] - grid.dom_ptr[after]
            moved[to] = min(moved[to], s.so_far[base + x] + s.own[e])
    return moved


@jit
def _pull(grid: Grid, s: Strips, i: int) -> None:
    """half of variable i, and with it to_go of its lane's variable one move before."""
    b = i - grid.lanes
    a, was, size = _above(grid, b), _size(grid, b), _size(grid, i)
    for p in range(_size(grid, a + grid.lanes)):
        base = s.pair_ptr[i] + p * size
        rest = s.stand[base : base + size] + s.to_go[base : base + size]
        for x in range(was):
            least = np.inf
            for e in range(grid.row_ptr[grid.dom_ptr[b] + x], grid.row_ptr[grid.dom_ptr[b] + x + 1]):
                least = min(least, s.own[e] + rest[grid.row_to[e] - grid.dom_ptr[i]])
            s.half[s.half_ptr[i] + p * was + x] = least
    s.to_go[s.pair_ptr[b] : s.pair_ptr[b + 1]] = np.inf
    for p in range(grid.dom_ptr[a], grid.dom_ptr[a + 1]):
        base = s.pair_ptr[b] + (p - grid.dom_ptr[a]) * was
        for e in range(grid.row_ptr[p], grid.row_ptr[p + 1]):
            half = s.half_ptr[i] + (grid.row_to[e] - grid.dom_ptr[a + grid.lanes]) * was
            cost = _led(grid, s, b, e)
            for x in range(was):
                s.to_go[base + x] = min(s.to_go[base + x], cost + s.half[half + x])


@jit
def _look_ahead(grid: Grid, s: Strips) -> None:
    """All of half and to_go."""
    for i in range(len(grid.dom_ptr) - 2, grid.lanes, -1):
        if i % grid.lanes > 0:
            _pull(grid, s, i)


@jit
def _led(grid: Grid, s: Strips, j: int, e: int) -> float:
    """The share that the strip of variable j bears of edge `e` out of the variable above j."""
    return float(s.led[s.led_ptr[j] + e - grid.row_ptr[grid.dom_ptr[_above(grid, j)]]])


@jit
def _size(grid: Grid, i: int) -> int:
    return int(grid.dom_ptr[i + 1] - grid.dom_ptr[i])


@jit
def _above(grid: Grid, i: int) -> int:
    """The variable above i in its strip: its parent's, or the first lane's."""
    lane = i % grid.lanes
    return int(i - lane + max(grid.parents[lane], 0))


@jit
def _strips_of(s: Strips, lane: int) -> Ints:
    """The lanes whose strips a lane is in: its own but for the first, and those of its kids."""
    kids = s.kids[s.kid_ptr[lane] : s.kid_ptr[lane + 1]]
    return kids if lane == 0 else np.append(kids, lane)


@jit
def _room(grid: Grid) -> Strips:
    """Strips of a grid with all shares and tables 0."""
    lanes, variables = grid.lanes, len(grid.dom_ptr) - 1
    above = np.maximum(grid.parents, 0)
    kid_ptr = np.zeros(lanes + 1, np.int64)
    for lane in range(1, lanes):
        kid_ptr[above[lane] + 1 :] += 1
    kids = 1 + np.argsort(above[1:], kind="mergesort")
    pair_ptr, half_ptr, led_ptr = np.zeros((3, variables + 1), np.int64)
    for i in range(variables):
        pair_ptr[i + 1], half_ptr[i + 1], led_ptr[i + 1] = pair_ptr[i], half_ptr[i], led_ptr[i]
        if i % lanes > 0:
            a = _above(grid, i)
            pair_ptr[i + 1] += _size(grid, a) * _size(grid, i)
            half_ptr[i + 1] += _size(grid, a) * _size(grid, i - lanes) if i >= lanes else 0
            led_ptr[i + 1] += grid.row_ptr[grid.dom_ptr[a + 1]] - grid.row_ptr[grid.dom_ptr[a]]
    count = pair_ptr[-1]
    return Strips(
        above, kid_ptr, kids, pair_ptr, np.zeros(count), np.zeros(count), np.zeros(count),
        half_ptr, np.zeros(half_ptr[-1]), np.zeros(len(grid.row_to)), led_ptr, np.zeros(led_ptr[-1]),
    )  # fmt: skip


@jit
def _shifted(grid: Grid, m: Messages) -> tuple[Floats, Floats]:
    """Costs of positions [P], all messages to them added, and of edges along lanes [R], the same taken off."""
    theta, edge = grid.unary + m.down_row + m.up_row + m.down_col, grid.row_cost.copy()
    for i in range(len(grid.dom_ptr) - 1):
        if grid.up_ptr[i + 1] > grid.up_ptr[i]:
            a = _above(grid, i)
            theta[grid.dom_ptr[a] : grid.dom_ptr[a + 1]] += m.up_col[grid.up_ptr[i] : grid.up_ptr[i + 1]]
    for p in range(len(theta)):
        for e in range(grid.row_ptr[p], grid.row_ptr[p + 1]):
            edge[e] -= m.up_row[p] + m.down_row[grid.row_to[e]]
    return theta, edge
