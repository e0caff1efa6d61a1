"""A tighter bound: the trellis cut into pair chains of two chains, each with its least cost exact.

Messages along single edges cannot see around a cycle: they let a variable be half one value and half another. Two
chains that are coupled, a *pair chain*, are a chain of pairs of states, whose least cost dynamic programming finds.
Every chain but the first makes a pair chain with its parent (with the first chain, where it has none). Couplings belong
to one pair chain each; what a chain costs on its own, in its states and along its edges, is shared out among the pair
chains that it is in. Whatever the shares are, the pair chains' least costs add up to a lower bound of the trellis's.

The shares are made better by coordinate ascent. Each pair chain asks for every position of a variable what it costs at
least with that position: the least of so_far + to_go. Shares are then moved so that the pair chains of the variable all
    ask
the same, their mean. That never lowers the bound, for n pair chains that ask the mean m(x) cost n min m(x) together,
and before they cost the sum of their minima, which is at most that. The same is done for the edges between a variable
and its chain's next. Sweeps forward and back do so along the moves, as with messages, so that so_far is up to date
where the sweep goes forward, and to_go where it goes back.

With values chosen for all variables up to one, what the pair chains still cost at least bounds the cost to go, and it
grows consistently along a path (`step`): this is the estimate that A* searches by. And what the pair chains of a
variable ask for a position, with the least costs of the others, bounds all paths through it.

Sources: Komodakis, Paragios and Tziritas, "MRF energy minimization and beyond via dual decomposition", IEEE TPAMI
33(3), 2011; Kolmogorov, "A new look at reweighted message passing", IEEE TPAMI 37(5), 2015 (the averaging in order).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, Ints
from motionmind.jit import jit
from motionmind.search.trellis import Trellis
from motionmind.search.trws import Messages, reachable, subset


class PairChains(NamedTuple):
    """Shares and tables of the pair chains of a trellis with at least two chains.

    The pair chain of a chain has at each move a table of pairs, (position of the chain above, position of the chain),
    that is listed under the variable i of the chain. Pairs are numbered by indices into the two domains, the chain's
    own fastest.

    Attributes:
        above: the other chain of each chain's pair chain [L]; the first chain has no pair chain of its own.
        kid_ptr: chains that a chain is above of, `kids[kid_ptr[chain] : kid_ptr[chain + 1]]` [L + 1].
        kids: [L - 1].
        pair_ptr: first pair of variable i [n + 1].
        stand: a pair chain's share of what a pair costs at its move [Q].
        so_far: the least that a pair chain costs up to a pair, with it [Q].
        to_go: the least that it costs after a pair [Q].
        half_ptr: first entry of variable i in `half` [n + 1].
        half: the least that a pair chain costs once the chain above has moved to i's move and the chain itself has not:
            by (position of the chain above at the move, position of the chain one move before).
        own: share of the edge's cost that the chain's own pair chain bears [R].
        led_ptr: first entry of variable i in `led` [n + 1].
        led: share that the pair chain of variable i bears of the edges of the variable above it, in their order.
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
def pairs(trellis: Trellis) -> int:
    """How many pairs the pair chains of a trellis list: what their memory and a sweep's time grow with."""
    count = 0
    for i in range(len(trellis.dom_ptr) - 1):
        if i % trellis.chains > 0:
            count += _size(trellis, i) * _size(trellis, _above(trellis, i))
    return count


@jit
def cut(trellis: Trellis, m: Messages) -> PairChains:
    """The pair chains of a trellis, its costs as messages have shifted them shared out evenly."""
    chains = trellis.chains
    s = _room(trellis)
    theta, edge = _shifted(trellis, m)
    for i in range(len(trellis.dom_ptr) - 1):
        chain = i % chains
        if chain == 0:
            continue
        a = _above(trellis, i)
        mine, theirs = 1.0 / len(_pair_chains_of(s, chain)), 1.0 / len(_pair_chains_of(s, s.above[chain]))
        for e in range(trellis.row_ptr[trellis.dom_ptr[i]], trellis.row_ptr[trellis.dom_ptr[i + 1]]):
            s.own[e] = mine * edge[e]
        first = trellis.row_ptr[trellis.dom_ptr[a]]
        for k in range(s.led_ptr[i + 1] - s.led_ptr[i]):
            s.led[s.led_ptr[i] + k] = theirs * edge[first + k]
        coupled = trellis.up_ptr[i + 1] > trellis.up_ptr[i]
        for p in range(_size(trellis, a)):
            base = s.pair_ptr[i] + p * _size(trellis, i) - trellis.dom_ptr[i]
            for x in range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]):
                s.stand[base + x] = theirs * theta[trellis.dom_ptr[a] + p] + mine * theta[x]
                if coupled:
                    s.stand[base + x] -= m.up_col[trellis.up_ptr[i] + p] + m.down_col[x]
            if coupled:
                for q in range(trellis.col_ptr[trellis.up_ptr[i] + p], trellis.col_ptr[trellis.up_ptr[i] + p + 1]):
                    s.stand[base + trellis.col_to[q]] += trellis.col_cost[q]
    _look_ahead(trellis, s)
    return s


@jit
def sweep(trellis: Trellis, s: PairChains, through: Floats) -> float:
    """One sweep forward and one back; the lower bound that they prove.

    Writes to `through` [P] a lower bound on the cost of every path through each position.
    """
    chains = trellis.chains
    for t in range(trellis.moves + 1):
        for i in range(t * chains + 1, (t + 1) * chains):
            _push(trellis, s, i)
        for i in range(t * chains, (t + 1) * chains):
            _agree_at(trellis, s, i)
        if t < trellis.moves:
            for i in range(t * chains, (t + 1) * chains):
                _agree_along(trellis, s, i)
    least = np.zeros(chains)
    for t in range(trellis.moves, -1, -1):
        if t < trellis.moves:
            for i in range((t + 1) * chains - 1, t * chains - 1, -1):
                _agree_along(trellis, s, i)
            for i in range(t * chains + 1, (t + 1) * chains):
                _pull(trellis, s, i + chains)
        for i in range((t + 1) * chains - 1, t * chains - 1, -1):
            _agree_at(trellis, s, i)
        begin, end = trellis.dom_ptr[t * chains], trellis.dom_ptr[(t + 1) * chains]
        through[begin:end] = 0.0
        for i in range(t * chains + 1, (t + 1) * chains):
            a = _above(trellis, i)
            asked = _asked_at(trellis, s, i, i)
            least[i % chains] = np.min(asked)
            through[trellis.dom_ptr[i] : trellis.dom_ptr[i + 1]] += asked - least[i % chains]
            through[trellis.dom_ptr[a] : trellis.dom_ptr[a + 1]] += _asked_at(trellis, s, i, a) - least[i % chains]
        through[begin:end] += np.sum(least)
    return float(np.sum(least))


@jit
def proven(s: PairChains) -> float:
    """The lower bound: the least that the pair chains cost from the start on."""
    bound = 0.0
    for chain in range(1, len(s.above)):
        bound += s.stand[s.pair_ptr[chain]] + s.to_go[s.pair_ptr[chain]]
    return bound


@jit
def prune(trellis: Trellis, s: PairChains, through: Floats, below: float) -> tuple[Trellis, PairChains]:
    """The trellis without the positions that no path cheaper than `below` goes through, and its pair_chains.

    A domain is left empty where there is no such path at all; then the pair chains mean nothing.
    """
    kept = reachable(trellis, through, below)
    smaller = subset(trellis, kept)
    fewer = _room(smaller)
    if np.any(np.diff(smaller.dom_ptr) == 0):
        return smaller, fewer
    edges = np.zeros(len(trellis.row_to), np.bool_)
    for p in range(len(kept)):
        for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
            edges[e] = kept[p] and kept[trellis.row_to[e]]
    stand, led = np.zeros(len(s.stand), np.bool_), np.zeros(len(s.led), np.bool_)
    for i in range(len(trellis.dom_ptr) - 1):
        if i % trellis.chains > 0:
            a, size = _above(trellis, i), _size(trellis, i)
            for p in range(_size(trellis, a)):
                if kept[trellis.dom_ptr[a] + p]:
                    base = s.pair_ptr[i] + p * size
                    stand[base : base + size] = kept[trellis.dom_ptr[i] : trellis.dom_ptr[i + 1]]
            first, last = trellis.row_ptr[trellis.dom_ptr[a]], trellis.row_ptr[trellis.dom_ptr[a + 1]]
            led[s.led_ptr[i] : s.led_ptr[i + 1]] = edges[first:last]
    fewer.stand[:], fewer.own[:], fewer.led[:] = s.stand[stand], s.own[edges], s.led[led]
    _look_ahead(smaller, fewer)
    return smaller, fewer


@jit
def step(trellis: Trellis, s: PairChains, i: int, frontier: NDArray[np.uint16], e: int) -> float:
    """What the cost so far and the bound on the rest grow by when variable i takes the position that edge `e` leads to.

    `frontier` is the last choice in each chain [L], as an index into its domain: at this move for chains before i's,
    one move before for all others. At least 0 but for rounding.
    """
    chain = i % trellis.chains
    b = i - trellis.chains
    before, x = frontier[chain], trellis.row_to[e] - trellis.dom_ptr[i]
    grown = 0.0
    if chain > 0:
        above = frontier[s.above[chain]]
        k = s.pair_ptr[i] + above * _size(trellis, i) + x
        grown += s.own[e] + s.stand[k] + s.to_go[k] - s.half[s.half_ptr[i] + above * _size(trellis, b) + before]
    for k in range(s.kid_ptr[chain], s.kid_ptr[chain + 1]):
        c = b - chain + s.kids[k]
        size, y = _size(trellis, c), frontier[s.kids[k]]
        grown += s.led[s.led_ptr[c] + e - trellis.row_ptr[trellis.dom_ptr[b]]]
        grown += s.half[s.half_ptr[c + trellis.chains] + x * size + y] - s.to_go[s.pair_ptr[c] + before * size + y]
    return grown


@jit
def descend(trellis: Trellis, s: PairChains, path: Ints) -> None:
    """Write to `path` [n] (positions) the path that takes the least growth each time."""
    chains = trellis.chains
    frontier = np.zeros(chains, np.uint16)
    path[:chains] = trellis.dom_ptr[:chains]
    for i in range(chains, len(path)):
        before, least = path[i - chains], np.inf
        for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
            grown = step(trellis, s, i, frontier, e)
            if grown < least:
                least, path[i] = grown, trellis.row_to[e]
        frontier[i % chains] = path[i] - trellis.dom_ptr[i]


# --- shares ----------------------------------------------------------------------------------------------------------


@jit
def _agree_at(trellis: Trellis, s: PairChains, i: int) -> None:
    """Move shares of the positions of variable i so that its pair chains ask the same for each."""
    members = _pair_chains_of(s, i % trellis.chains)
    if len(members) < 2 or _size(trellis, i) < 2:
        return
    first = i - i % trellis.chains
    asked = np.empty((len(members), _size(trellis, i)))
    for k in range(len(members)):
        asked[k] = _asked_at(trellis, s, first + members[k], i)
    mean = np.sum(asked, axis=0) / len(members)
    for k in range(len(members)):
        j, more = first + members[k], mean - asked[k]
        size = _size(trellis, j)
        for p in range(_size(trellis, _above(trellis, j))):
            base = s.pair_ptr[j] + p * size
            for x in range(size):
                s.stand[base + x] += more[x] if j == i else more[p]
                s.so_far[base + x] += more[x] if j == i else more[p]


@jit
def _agree_along(trellis: Trellis, s: PairChains, i: int) -> None:
    """Move shares of the edges out of variable i so that its pair chains ask the same for each."""
    members = _pair_chains_of(s, i % trellis.chains)
    if len(members) < 2 or (_size(trellis, i) < 2 and _size(trellis, i + trellis.chains) < 2):
        return
    first = i - i % trellis.chains
    begin, end = trellis.row_ptr[trellis.dom_ptr[i]], trellis.row_ptr[trellis.dom_ptr[i + 1]]
    asked = np.empty((len(members), end - begin))
    for k in range(len(members)):
        j = first + members[k]
        asked[k] = _asked_along_own(trellis, s, j) if j == i else _asked_along_led(trellis, s, j)
    mean = np.sum(asked, axis=0) / len(members)
    for k in range(len(members)):
        j, more = first + members[k], mean - asked[k]
        if j == i:
            s.own[begin:end] += more
        else:
            s.led[s.led_ptr[j] : s.led_ptr[j + 1]] += more


@jit
def _asked_at(trellis: Trellis, s: PairChains, j: int, i: int) -> Floats:
    """The least that the pair chain of variable j costs with each position of variable i, which is j or the one above
    it."""
    size = _size(trellis, j)
    asked = np.full(_size(trellis, i), np.inf)
    for p in range(_size(trellis, _above(trellis, j))):
        base = s.pair_ptr[j] + p * size
        for x in range(size):
            k = x if j == i else p
            asked[k] = min(asked[k], s.so_far[base + x] + s.to_go[base + x])
    return asked


@jit
def _asked_along_own(trellis: Trellis, s: PairChains, j: int) -> Floats:
    """The least that the pair chain of variable j costs with each edge out of j."""
    a, after = _above(trellis, j), j + trellis.chains
    was, size = _size(trellis, j), _size(trellis, after)
    moved = np.full((_size(trellis, a + trellis.chains), was), np.inf)  # so_far and an edge of the chain above
    for p in range(trellis.dom_ptr[a], trellis.dom_ptr[a + 1]):
        base = s.pair_ptr[j] + (p - trellis.dom_ptr[a]) * was
        for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
            to, cost = trellis.row_to[e] - trellis.dom_ptr[a + trellis.chains], _led(trellis, s, j, e)
            for x in range(was):
                moved[to, x] = min(moved[to, x], s.so_far[base + x] + cost)
    first = trellis.row_ptr[trellis.dom_ptr[j]]
    asked = np.full(trellis.row_ptr[trellis.dom_ptr[j + 1]] - first, np.inf)
    for p in range(len(moved)):
        base = s.pair_ptr[after] + p * size - trellis.dom_ptr[after]
        for x in range(was):
            for e in range(trellis.row_ptr[trellis.dom_ptr[j] + x], trellis.row_ptr[trellis.dom_ptr[j] + x + 1]):
                k = base + trellis.row_to[e]
                asked[e - first] = min(asked[e - first], moved[p, x] + s.stand[k] + s.to_go[k])
    return asked + s.own[first : first + len(asked)]


@jit
def _asked_along_led(trellis: Trellis, s: PairChains, j: int) -> Floats:
    """The least that the pair chain of variable j costs with each edge out of the variable above j."""
    a, after = _above(trellis, j), j + trellis.chains
    size = _size(trellis, after)
    first = trellis.row_ptr[trellis.dom_ptr[a]]
    asked = np.full(trellis.row_ptr[trellis.dom_ptr[a + 1]] - first, np.inf)
    for p in range(trellis.dom_ptr[a], trellis.dom_ptr[a + 1]):
        moved = _moved(trellis, s, j, p - trellis.dom_ptr[a])
        for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
            base = s.pair_ptr[after] + (trellis.row_to[e] - trellis.dom_ptr[a + trellis.chains]) * size
            for x in range(size):
                asked[e - first] = min(asked[e - first], moved[x] + s.stand[base + x] + s.to_go[base + x])
    return asked + s.led[s.led_ptr[j] : s.led_ptr[j + 1]]


# --- tables ----------------------------------------------------------------------------------------------------------


@jit
def _push(trellis: Trellis, s: PairChains, i: int) -> None:
    """so_far of variable i from that one move before: first its chain moves, then the chain above."""
    chains = trellis.chains
    first, last, size = s.pair_ptr[i], s.pair_ptr[i + 1], _size(trellis, i)
    s.so_far[first:last] = s.stand[first:last]
    if i < chains:
        return
    a, least = _above(trellis, i - chains), np.full(last - first, np.inf)
    for p in range(trellis.dom_ptr[a], trellis.dom_ptr[a + 1]):
        moved = _moved(trellis, s, i - chains, p - trellis.dom_ptr[a])
        for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
            base, cost = (trellis.row_to[e] - trellis.dom_ptr[a + chains]) * size, _led(trellis, s, i - chains, e)
            for x in range(size):
                least[base + x] = min(least[base + x], moved[x] + cost)
    s.so_far[first:last] += least


@jit
def _moved(trellis: Trellis, s: PairChains, j: int, p: int) -> Floats:
    """The least so_far with index p above variable j, and an edge of j's chain, by where the edge leads."""
    after = j + trellis.chains
    moved = np.full(_size(trellis, after), np.inf)
    base = s.pair_ptr[j] + p * _size(trellis, j) - trellis.dom_ptr[j]
    for x in range(trellis.dom_ptr[j], trellis.dom_ptr[j + 1]):
        for e in range(trellis.row_ptr[x], trellis.row_ptr[x + 1]):
            to = trellis.row_to[e] - trellis.dom_ptr[after]
            moved[to] = min(moved[to], s.so_far[base + x] + s.own[e])
    return moved


@jit
def _pull(trellis: Trellis, s: PairChains, i: int) -> None:
    """half of variable i, and with it to_go of its chain's variable one move before."""
    b = i - trellis.chains
    a, was, size = _above(trellis, b), _size(trellis, b), _size(trellis, i)
    for p in range(_size(trellis, a + trellis.chains)):
        base = s.pair_ptr[i] + p * size
        rest = s.stand[base : base + size] + s.to_go[base : base + size]
        for x in range(was):
            least = np.inf
            for e in range(trellis.row_ptr[trellis.dom_ptr[b] + x], trellis.row_ptr[trellis.dom_ptr[b] + x + 1]):
                least = min(least, s.own[e] + rest[trellis.row_to[e] - trellis.dom_ptr[i]])
            s.half[s.half_ptr[i] + p * was + x] = least
    s.to_go[s.pair_ptr[b] : s.pair_ptr[b + 1]] = np.inf
    for p in range(trellis.dom_ptr[a], trellis.dom_ptr[a + 1]):
        base = s.pair_ptr[b] + (p - trellis.dom_ptr[a]) * was
        for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
            half = s.half_ptr[i] + (trellis.row_to[e] - trellis.dom_ptr[a + trellis.chains]) * was
            cost = _led(trellis, s, b, e)
            for x in range(was):
                s.to_go[base + x] = min(s.to_go[base + x], cost + s.half[half + x])


@jit
def _look_ahead(trellis: Trellis, s: PairChains) -> None:
    """All of half and to_go."""
    for i in range(len(trellis.dom_ptr) - 2, trellis.chains, -1):
        if i % trellis.chains > 0:
            _pull(trellis, s, i)


@jit
def _led(trellis: Trellis, s: PairChains, j: int, e: int) -> float:
    """The share that the pair chain of variable j bears of edge `e` out of the variable above j."""
    return float(s.led[s.led_ptr[j] + e - trellis.row_ptr[trellis.dom_ptr[_above(trellis, j)]]])


@jit
def _size(trellis: Trellis, i: int) -> int:
    return int(trellis.dom_ptr[i + 1] - trellis.dom_ptr[i])


@jit
def _above(trellis: Trellis, i: int) -> int:
    """The variable above i in its pair chain: its parent's, or the first chain's."""
    chain = i % trellis.chains
    return int(i - chain + max(trellis.parents[chain], 0))


@jit
def _pair_chains_of(s: PairChains, chain: int) -> Ints:
    """The chains whose pair chains a chain is in: its own but for the first, and those of its kids."""
    kids = s.kids[s.kid_ptr[chain] : s.kid_ptr[chain + 1]]
    return kids if chain == 0 else np.append(kids, chain)


@jit
def _room(trellis: Trellis) -> PairChains:
    """PairChains of a trellis with all shares and tables 0."""
    chains, variables = trellis.chains, len(trellis.dom_ptr) - 1
    above = np.maximum(trellis.parents, 0)
    kid_ptr = np.zeros(chains + 1, np.int64)
    for chain in range(1, chains):
        kid_ptr[above[chain] + 1 :] += 1
    kids = 1 + np.argsort(above[1:], kind="mergesort")
    pair_ptr, half_ptr, led_ptr = np.zeros((3, variables + 1), np.int64)
    for i in range(variables):
        pair_ptr[i + 1], half_ptr[i + 1], led_ptr[i + 1] = pair_ptr[i], half_ptr[i], led_ptr[i]
        if i % chains > 0:
            a = _above(trellis, i)
            pair_ptr[i + 1] += _size(trellis, a) * _size(trellis, i)
            half_ptr[i + 1] += _size(trellis, a) * _size(trellis, i - chains) if i >= chains else 0
            led_ptr[i + 1] += trellis.row_ptr[trellis.dom_ptr[a + 1]] - trellis.row_ptr[trellis.dom_ptr[a]]
    count = pair_ptr[-1]
    return PairChains(
        above, kid_ptr, kids, pair_ptr, np.zeros(count), np.zeros(count), np.zeros(count),
        half_ptr, np.zeros(half_ptr[-1]), np.zeros(len(trellis.row_to)), led_ptr, np.zeros(led_ptr[-1]),
    )  # fmt: skip


@jit
def _shifted(trellis: Trellis, m: Messages) -> tuple[Floats, Floats]:
    """Costs of positions [P], all messages to them added, and of edges along chains [R], the same taken off."""
    theta, edge = trellis.unary + m.down_row + m.up_row + m.down_col, trellis.row_cost.copy()
    for i in range(len(trellis.dom_ptr) - 1):
        if trellis.up_ptr[i + 1] > trellis.up_ptr[i]:
            a = _above(trellis, i)
            theta[trellis.dom_ptr[a] : trellis.dom_ptr[a + 1]] += m.up_col[trellis.up_ptr[i] : trellis.up_ptr[i + 1]]
    for p in range(len(theta)):
        for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
            edge[e] -= m.up_row[p] + m.down_row[trellis.row_to[e]]
    return theta, edge
