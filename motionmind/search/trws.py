"""A lower bound on the cost of a trellis, and on the cost to go from any partial path: tree-reweighted messages.

Source: Kolmogorov, "Convergent tree-reweighted message passing for energy minimization", IEEE TPAMI 28(10), 2006.
Variables are ordered by move, then by chain. Each carries gamma = 1 / max(edges in, edges out); a sweep visits all in
order, or in reverse, and sends from variable a along each edge (a, b) that leads on

    M(a -> b)(x_b) = min over x_a of  gamma_a * theta_a(x_a) - M(b -> a)(x_a) + theta_ab(x_a, x_b)

where theta_a is the variable's own cost plus all messages to it, less its minimum. What is taken out so that theta and
messages have the minimum 0 are the *constants* of the variable; after a backward sweep their sum is a lower bound.

Then, for values chosen for all variables up to i, the cost of the rest is at least

    h = sum of M(b -> a)(x_a) over edges with a chosen and b not  +  sum of the constants of the variables after i.

Proof, from the last variable back: for an unchosen b the backward messages that b sent are minima over x_b of
gamma_b * theta_b - M(a -> b) + theta_ab, one for each of its n <= 1 / gamma_b edges in. As theta_b >= 0, the sum of
gamma_b * theta_b over them is at most theta_b, which is b's own cost plus the messages into b (those from before
cancel with the M(a -> b) that are taken off) less b's constant. So they add up to at most b's own cost, its edges in,
the messages that came back to b, less its constants; and so on to the last. Whatever the forward messages were.

In other words the energy is shared out among chains that run along the order, whose least costs add up to the bound;
theta is the sum, over the chains through a variable, of what each costs more than its least with a given value there.
So when the backward sweep comes to a variable, theta plus the bound as it then stands bounds all paths *through* each
position. (It then stands at: the constants of the forward sweep before the variable, the minima of theta from it on,
and the constants of the messages sent back so far, but for those to variables before it, where the forward sweep's
stand.) Where that is no less than the cost of a path already known, the position can be taken out of its domain, which
makes the next bounds tighter: reduced-cost fixing, as in linear programming.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.jit import jit
from motionmind.search.trellis import Trellis


class Messages(NamedTuple):
    """Messages of a trellis, P positions and U coupling rows, and what the backward sweep took out.

    Attributes:
        down_row: to each position from its chain's variable one move before [P].
        up_row: to each position from its chain's variable one move after [P].
        down_col: to each position from its parent variable [P].
        up_col: to each position of its parent variable from a variable, by coupling row [U].
        constants: taken out at each variable by the backward sweep [n].
        before: taken out at each variable by the forward sweep [n].
        ahead: a position's own cost plus all messages to it from later variables, less its variable's constant [P]:
            what assigning it adds to f, but for its edges in and what they had promised.
        through: a lower bound on the cost of every path through a position [P].
    """

    down_row: Floats
    up_row: Floats
    down_col: Floats
    up_col: Floats
    constants: Floats
    before: Floats
    ahead: Floats
    through: Floats


def no_messages(trellis: Trellis) -> Messages:
    """Messages of zero: the bound they give is the sum of each variable's minimum."""
    count = len(trellis.dom)
    return Messages(
        np.zeros(count),
        np.zeros(count),
        np.zeros(count),
        np.zeros(trellis.up_ptr[-1]),
        np.zeros(len(trellis.dom_ptr) - 1),
        np.zeros(len(trellis.dom_ptr) - 1),
        np.zeros(count),
        np.zeros(count),
    )


@jit
def _ahead(trellis: Trellis, m: Messages, i: int) -> None:
    """A variable's own cost and all that later variables sent to it, into `ahead`."""
    chains, chain = trellis.chains, i % trellis.chains
    first, last = trellis.dom_ptr[i], trellis.dom_ptr[i + 1]
    for p in range(first, last):
        m.ahead[p] = trellis.unary[p] + m.up_row[p]
    if i >= chains:
        for child in range(chain + 1, chains):
            if trellis.parents[child] == chain:
                base = trellis.up_ptr[i - chain + child]
                for p in range(first, last):
                    m.ahead[p] += m.up_col[base + p - first]


@jit
def _theta(trellis: Trellis, m: Messages, i: int) -> Floats:
    """The variable's own cost plus all messages to it, their minimum (its constant) taken out."""
    first, last = trellis.dom_ptr[i], trellis.dom_ptr[i + 1]
    _ahead(trellis, m, i)
    theta = np.empty(last - first)
    for p in range(first, last):
        theta[p - first] = m.ahead[p] + m.down_row[p] + m.down_col[p]
    least = np.min(theta)
    m.constants[i] = least
    return np.asarray(theta - least)


@jit
def _gamma(trellis: Trellis, i: int) -> float:
    """1 / max(edges in, edges out) of a variable."""
    chains, chain = trellis.chains, i % trellis.chains
    edges_in = 0 if i < chains else 1 if trellis.parents[chain] < 0 else 2
    edges_out = 1 if i < chains * trellis.moves else 0
    if i >= chains:
        for child in range(chain + 1, chains):
            if trellis.parents[child] == chain:
                edges_out += 1
    return 1.0 / max(edges_in, edges_out, 1)


@jit
def forward(trellis: Trellis, m: Messages) -> None:
    """One sweep from the first variable to the last: each sends to its chain's next move and to its children."""
    chains = trellis.chains
    for i in range(len(trellis.dom_ptr) - 1):
        chain = i % chains
        first, last = trellis.dom_ptr[i], trellis.dom_ptr[i + 1]
        theta = _gamma(trellis, i) * _theta(trellis, m, i)
        m.before[i] = m.constants[i]
        if i < chains * trellis.moves:
            begin, end = trellis.dom_ptr[i + chains], trellis.dom_ptr[i + chains + 1]
            for x in range(begin, end):
                m.down_row[x] = np.inf
            for p in range(first, last):
                value = theta[p - first] - m.up_row[p]
                for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
                    x = trellis.row_to[e]
                    m.down_row[x] = min(m.down_row[x], value + trellis.row_cost[e])
            m.before[i] += _settle(m.down_row, begin, end)
        if i >= chains:
            for child in range(chain + 1, chains):
                if trellis.parents[child] == chain:
                    below = i - chain + child
                    begin, end, base = trellis.dom_ptr[below], trellis.dom_ptr[below + 1], trellis.up_ptr[below]
                    values = theta - m.up_col[base : base + last - first]
                    best = np.argmin(values)
                    m.down_col[begin:end] = values[best]
                    order = np.empty(0, np.int64)
                    for q in range(trellis.col_ptr[base + best], trellis.col_ptr[base + best + 1]):
                        if (
                            trellis.col_cost[q] > 0.0
                        ):  # the best of all costs more here: go on to those that may do better
                            x = trellis.col_to[q]
                            order = np.argsort(values) if len(order) == 0 else order
                            m.down_col[x] = np.inf
                            for other in order:
                                if values[other] >= m.down_col[x]:
                                    break
                                m.down_col[x] = min(m.down_col[x], values[other] + correction(trellis, base + other, x))
                    for k in range(last - first):
                        for q in range(trellis.col_ptr[base + k], trellis.col_ptr[base + k + 1]):
                            x = trellis.col_to[q]
                            m.down_col[x] = min(m.down_col[x], values[k] + trellis.col_cost[q])
                    m.before[i] += _settle(m.down_col, begin, end)


@jit
def backward(trellis: Trellis, m: Messages) -> float:
    """One sweep from the last variable to the first; the lower bound that it proves."""
    chains = trellis.chains
    bound, earlier, later = 0.0, np.sum(m.before), 0.0
    sent = np.zeros(len(trellis.dom_ptr) - 1)  # constants of the messages that have been sent to each variable
    for i in range(len(trellis.dom_ptr) - 2, -1, -1):
        chain = i % chains
        first, last = trellis.dom_ptr[i], trellis.dom_ptr[i + 1]
        theta = _theta(trellis, m, i)
        earlier -= m.before[i]
        later += m.constants[i] + sent[i]
        for p in range(first, last):
            m.through[p] = earlier + theta[p - first] + later
        theta *= _gamma(trellis, i)
        if i >= chains:
            before = i - chains
            for p in range(trellis.dom_ptr[before], trellis.dom_ptr[before + 1]):
                least = np.inf
                for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
                    x = trellis.row_to[e]
                    least = min(least, trellis.row_cost[e] + theta[x - first] - m.down_row[x])
                m.up_row[p] = least
            settled = _settle(m.up_row, trellis.dom_ptr[before], trellis.dom_ptr[before + 1])
            m.constants[i] += settled
            sent[before] += settled
            if trellis.parents[chain] >= 0:
                values = theta - m.down_col[first:last]
                best, order = np.argmin(values), np.empty(0, np.int64)
                for u in range(trellis.up_ptr[i], trellis.up_ptr[i + 1]):
                    value = values[best]
                    if correction(trellis, u, first + best) > 0.0:
                        order = np.argsort(values) if len(order) == 0 else order
                        value = np.inf
                        for other in order:
                            if values[other] >= value:
                                break
                            value = min(value, values[other] + correction(trellis, u, first + other))
                    for q in range(trellis.col_ptr[u], trellis.col_ptr[u + 1]):
                        value = min(value, values[trellis.col_to[q] - first] + trellis.col_cost[q])
                    m.up_col[u] = value
                settled = _settle(m.up_col, trellis.up_ptr[i], trellis.up_ptr[i + 1])
                m.constants[i] += settled
                sent[i - chain + trellis.parents[chain]] += settled
        for p in range(first, last):
            m.ahead[p] -= m.constants[i]
        bound += m.constants[i]
    return bound


@jit
def _settle(message: Floats, begin: int, end: int) -> float:
    """Take its minimum out of a message and return it."""
    least = np.inf
    for x in range(begin, end):
        least = min(least, message[x])
    for x in range(begin, end):
        message[x] -= least
    return least


@jit
def correction(trellis: Trellis, u: int, x: int) -> float:
    """What the coupling of position `x` in coupling row `u` is listed with; 0 for a pair that is not listed."""
    low, high = trellis.col_ptr[u], trellis.col_ptr[u + 1]
    while low < high:
        middle = (low + high) // 2
        if trellis.col_to[middle] < x:
            low = middle + 1
        else:
            high = middle
    return float(trellis.col_cost[low]) if low < trellis.col_ptr[u + 1] and trellis.col_to[low] == x else 0.0


@jit
def step(trellis: Trellis, m: Messages, i: int, before: int, above: int, e: int) -> float:
    """What f grows by when variable i takes the position that edge `e` leads to.

    `before` is the position of its chain one move earlier, `above` that of its parent variable (-1 without one): the
    cost of the position and of its edges in, plus what later variables have sent back to it, less what its edges in
    had promised and the variable's constant. At least 0 but for rounding.
    """
    x = trellis.row_to[e]
    grown = float(trellis.row_cost[e] + m.ahead[x] - m.up_row[before])
    if above >= 0:
        u = trellis.up_ptr[i] + above - trellis.dom_ptr[i - i % trellis.chains + trellis.parents[i % trellis.chains]]
        grown += correction(trellis, u, x) - m.up_col[u]
    return grown


@jit
def descend(trellis: Trellis, m: Messages, path: Ints, start: int) -> float:
    """Complete `path` [n] (positions) from variable `start` on, by the least growth of f each time; the sum of it.

    It never fails: every position of a domain leads on along its chain, and couplings forbid nothing.
    """
    chains = trellis.chains
    grown = 0.0
    for i in range(start, len(trellis.dom_ptr) - 1):
        parent, before = trellis.parents[i % chains], path[i - chains]
        above = path[i - i % chains + parent] if parent >= 0 else -1
        least = np.inf
        for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
            value = step(trellis, m, i, before, above, e)
            if value < least:
                least, path[i] = value, trellis.row_to[e]
        grown += least
    return grown


@jit
def tighten(trellis: Trellis, m: Messages, path: Ints, sweeps: int, enough: float) -> tuple[float, float]:
    """Run up to `sweeps` pairs of sweeps; the bound, and the cost of the best path met on the way.

    The path is written to `path` [n] (positions). Stops when the bound reaches that cost or `enough`.
    """
    chains = trellis.chains
    trial = np.zeros(len(path), np.int64)
    for chain in range(chains):
        path[chain] = trial[chain] = trellis.dom_ptr[chain]
    bound, cost = -np.inf, np.inf
    for _ in range(sweeps):
        forward(trellis, m)
        bound = backward(trellis, m)
        found = bound + descend(trellis, m, trial, chains)
        if found < cost:
            cost = found
            path[:] = trial
        if bound >= min(cost, enough) - 1e-9:
            break
    return bound, cost


@jit
def prune(trellis: Trellis, m: Messages, below: float) -> tuple[Trellis, Messages]:
    """The trellis without the positions that no path cheaper than `below` goes through, and the messages of the rest.

    A domain is left empty where there is no such path at all.
    """
    kept = reachable(trellis, m.through, below)
    held = np.flatnonzero(kept)
    rows = _coupled(trellis, kept)
    return subset(trellis, kept), Messages(
        m.down_row[held], m.up_row[held], m.down_col[held], m.up_col[rows],
        m.constants.copy(), m.before.copy(), m.ahead[held], m.through[held],
    )  # fmt: skip


@jit
def reachable(trellis: Trellis, through: Floats, below: float) -> Bools:
    """The positions [P] that a path cheaper than `below` may go through, each of which leads on and is led to.

    `through` [P] is a lower bound on the cost of all paths through each.
    """
    kept = through < below
    for i in range(len(trellis.dom_ptr) - 2 - trellis.chains, -1, -1):  # what leads nowhere
        for p in range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]):
            leads = False
            for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1]):
                leads = leads or kept[trellis.row_to[e]]
            kept[p] = kept[p] and leads
    led_to = np.zeros(len(kept), np.bool_)
    led_to[: trellis.dom_ptr[trellis.chains]] = True
    for p in range(len(kept)):  # what nothing leads to
        kept[p] = kept[p] and led_to[p]
        if kept[p]:
            led_to[trellis.row_to[trellis.row_ptr[p] : trellis.row_ptr[p + 1]]] = True
    return kept


@jit
def _coupled(trellis: Trellis, kept: Bools) -> Ints:
    """The coupling rows of the positions that are kept."""
    coupled = np.zeros(trellis.up_ptr[-1], np.bool_)
    for i in range(len(trellis.dom_ptr) - 1):
        if trellis.up_ptr[i + 1] > trellis.up_ptr[i]:
            above = i - i % trellis.chains + trellis.parents[i % trellis.chains]
            coupled[trellis.up_ptr[i] : trellis.up_ptr[i + 1]] = kept[
                trellis.dom_ptr[above] : trellis.dom_ptr[above + 1]
            ]
    return np.flatnonzero(coupled)


@jit
def subset(trellis: Trellis, kept: Bools) -> Trellis:
    """The trellis of the positions that are kept."""
    chains, variables = trellis.chains, len(trellis.dom_ptr) - 1
    number = np.cumsum(kept).astype(np.int32) - 1  # of each kept position among them
    held, rows = np.flatnonzero(kept), _coupled(trellis, kept)
    dom_ptr = np.zeros(variables + 1, np.int64)
    up_ptr = np.zeros(variables + 1, np.int64)
    for i in range(variables):
        dom_ptr[i + 1] = dom_ptr[i] + np.sum(kept[trellis.dom_ptr[i] : trellis.dom_ptr[i + 1]])
        up_ptr[i + 1] = up_ptr[i]
        if trellis.up_ptr[i + 1] > trellis.up_ptr[i]:
            above = i - i % chains + trellis.parents[i % chains]
            up_ptr[i + 1] += dom_ptr[above + 1] - dom_ptr[above]
    row_ptr, row_to, row_cost = _subset(held, trellis.row_ptr, trellis.row_to, trellis.row_cost, kept, number)
    col_ptr, col_to, col_cost = _subset(rows, trellis.col_ptr, trellis.col_to, trellis.col_cost, kept, number)
    return Trellis(
        chains, trellis.moves, trellis.parents, dom_ptr, trellis.dom[held], trellis.unary[held],
        row_ptr, row_to, row_cost, up_ptr, col_ptr, col_to, col_cost,
    )  # fmt: skip


@jit
def _subset(
    rows: Ints, ptr: Ints, to: Int32s, cost: Floats, kept: Bools, number: Int32s
) -> tuple[Ints, Int32s, Floats]:
    """The listed entries of some rows whose ends are kept, renumbered."""
    out_ptr = np.zeros(len(rows) + 1, np.int64)
    for k in range(len(rows)):
        out_ptr[k + 1] = out_ptr[k] + np.sum(kept[to[ptr[rows[k]] : ptr[rows[k] + 1]]])
    out_to, out_cost = np.empty(out_ptr[-1], np.int32), np.empty(out_ptr[-1])
    count = 0
    for row in rows:
        for e in range(ptr[row], ptr[row + 1]):
            if kept[to[e]]:
                out_to[count], out_cost[count] = number[to[e]], cost[e]
                count += 1
    return out_ptr, out_to, out_cost
