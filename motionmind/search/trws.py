"""Tree-reweighted messages: a lower bound on the cost of a trellis, and on the cost to go from any partial path.

Source: Kolmogorov, "Convergent tree-reweighted message passing for energy minimization", IEEE TPAMI 28(10), 2006
(TRW-S). Variables are ordered by move, then by chain. Each has gamma = 1 / max(edges in, edges out); a sweep visits all
in order, or in reverse, and sends from variable a along each edge (a, b) that leads on

    M(a -> b)(x_b) = min over x_a of  gamma_a * theta_a(x_a) - M(b -> a)(x_a) + theta_ab(x_a, x_b)

where theta_a is the variable's own cost plus all messages to it, less its minimum. The minima subtracted from theta and
from messages are the *constants* of the variable; after a backward sweep their sum is a lower bound.

Then, with values chosen for all variables up to i, the cost of the rest is at least

    h = sum of M(b -> a)(x_a) over edges with a chosen and b not  +  sum of the constants of the variables after i.

Proof, from the last variable back: for an unchosen b the backward messages that b sent are minima over x_b of
gamma_b * theta_b - M(a -> b) + theta_ab, one for each of its n <= 1 / gamma_b edges in. As theta_b >= 0, the sum of
gamma_b * theta_b over them is at most theta_b, which is b's own cost plus the messages into b, less b's constant; the
messages from before cancel with the M(a -> b) that are subtracted. So the n messages add up to at most b's own cost,
its edges in, and the messages that came back to b, less its constants; and so on to the last variable. The proof holds
for any forward messages.

In other words, the energy is shared among chains that run along the order, whose least costs add up to the bound.
Theta is the sum, over the chains through a variable, of each chain's excess over its least cost with a given value.
So when the backward sweep reaches a variable, theta plus the current bound bounds all paths *through* each position.
The current bound adds up the forward sweep's constants before the variable, the minima of theta from it on, and the
constants of the messages sent back so far. For messages to earlier variables the forward sweep's constants count
instead. If the bound through a position is at least the cost of a known path, the position can leave its domain, which
tightens the next bounds: reduced-cost fixing, as in linear programming.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.jit import jit
from motionmind.search.tolerances import SAME_COST_NATS
from motionmind.search.trellis import Trellis, correction, coupling_rows, reachable, subset


class Messages(NamedTuple):
    """Messages in nats of a trellis with n variables, P positions and U coupling rows, and the bounds they give.

    Attributes:
        down_row: to each position from its chain's variable one move before [P].
        up_row: to each position from its chain's variable one move after [P].
        down_col: to each position from its parent variable [P].
        up_col: from each variable to the positions of its parent variable, by coupling row [U].
        constants: subtracted at each variable by the backward sweep [n].
        before: subtracted at each variable by the forward sweep [n].
        ahead: a position's own cost plus all messages to it from later variables, less its variable's constant [P]:
            the growth of f when choosing it, apart from its edges in and their earlier messages.
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
    """Return messages of zero; the bound they give is the sum of each variable's minimum."""
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
def _ahead(trellis: Trellis, messages: Messages, i: int) -> None:
    """Write to `ahead` the cost of each position of variable i plus all messages to it from later variables."""
    chains, chain = trellis.chains, i % trellis.chains
    first, last = trellis.dom_ptr[i], trellis.dom_ptr[i + 1]
    for p in range(first, last):
        messages.ahead[p] = trellis.unary[p] + messages.up_row[p]
    if i >= chains:
        for child in range(chain + 1, chains):
            if trellis.parents[child] == chain:
                base = trellis.up_ptr[i - chain + child]
                for p in range(first, last):
                    messages.ahead[p] += messages.up_col[base + p - first]


@jit
def _theta(trellis: Trellis, messages: Messages, i: int) -> Floats:
    """Return theta of variable i: its cost plus all messages to it, less their minimum, which becomes its constant."""
    first, last = trellis.dom_ptr[i], trellis.dom_ptr[i + 1]
    _ahead(trellis, messages, i)
    theta, least = np.empty(last - first), np.inf
    for p in range(first, last):
        theta[p - first] = messages.ahead[p] + messages.down_row[p] + messages.down_col[p]
        least = min(least, theta[p - first])
    messages.constants[i] = least
    for k in range(len(theta)):
        theta[k] -= least
    return theta


@jit
def _gamma(trellis: Trellis, i: int) -> float:
    """Return 1 / max(edges in, edges out) of a variable."""
    chains, chain = trellis.chains, i % trellis.chains
    edges_in = 0 if i < chains else 1 if trellis.parents[chain] < 0 else 2
    edges_out = 1 if i < chains * trellis.moves else 0
    if i >= chains:
        for child in range(chain + 1, chains):
            if trellis.parents[child] == chain:
                edges_out += 1
    return 1.0 / max(edges_in, edges_out, 1)


@jit
def forward(trellis: Trellis, messages: Messages) -> None:
    """Sweep from the first variable to the last; each sends to its chain's next move and to its children."""
    chains = trellis.chains
    for i in range(len(trellis.dom_ptr) - 1):
        chain = i % chains
        theta = _theta(trellis, messages, i)
        theta *= _gamma(trellis, i)
        messages.before[i] = messages.constants[i]
        if i < chains * trellis.moves:
            messages.before[i] += _send_ahead(trellis, messages, i, theta)
        if i >= chains:
            for child in range(chain + 1, chains):
                if trellis.parents[child] == chain:
                    messages.before[i] += _send_down(trellis, messages, i - chain + child, theta)


@jit
def _send_ahead(trellis: Trellis, messages: Messages, i: int, theta: Floats) -> float:
    """Send from variable i, whose share is theta, to its chain's next move; return the constant subtracted.

    Unsigned positions, here and below, spare Numba the check for negative indices: half the time of the inner loops.
    """
    first, begin, end = trellis.dom_ptr[i], trellis.dom_ptr[i + trellis.chains], trellis.dom_ptr[i + trellis.chains + 1]
    messages.down_row[begin:end] = np.inf
    for p in range(first, trellis.dom_ptr[i + 1]):
        value = theta[p - first] - messages.up_row[p]
        for e in range(np.uint64(trellis.row_ptr[p]), np.uint64(trellis.row_ptr[p + 1])):
            x = np.uint64(trellis.row_to[e])
            messages.down_row[x] = min(messages.down_row[x], value + trellis.row_cost[e])
    return _normalise(messages.down_row, begin, end)


@jit
def _send_down(trellis: Trellis, messages: Messages, child: int, theta: Floats) -> float:
    """Send to variable `child` from its parent, whose share is theta; return the constant subtracted."""
    begin, end, base = trellis.dom_ptr[child], trellis.dom_ptr[child + 1], trellis.up_ptr[child]
    values = theta - messages.up_col[base : base + len(theta)]
    best = np.argmin(values)
    messages.down_col[begin:end] = values[best]
    for q in range(trellis.col_ptr[base + best], trellis.col_ptr[base + best + 1]):
        if trellis.col_cost[q] > 0.0:  # the overall best costs more here, so others may do better
            x, least = trellis.col_to[q], np.inf
            for k in range(len(values)):
                if values[k] < least:
                    least = min(least, values[k] + correction(trellis, base + k, x))
            messages.down_col[x] = least
    for k in range(len(values)):
        for q in range(np.uint64(trellis.col_ptr[base + k]), np.uint64(trellis.col_ptr[base + k + 1])):
            x = np.uint64(trellis.col_to[q])
            messages.down_col[x] = min(messages.down_col[x], values[k] + trellis.col_cost[q])
    return _normalise(messages.down_col, begin, end)


@jit
def backward(trellis: Trellis, messages: Messages) -> float:
    """Sweep from the last variable to the first, and return the lower bound that this proves, in nats."""
    chains = trellis.chains
    bound, earlier, later = 0.0, np.sum(messages.before), 0.0
    sent = np.zeros(len(trellis.dom_ptr) - 1)  # constants of the messages that have been sent to each variable
    for i in range(len(trellis.dom_ptr) - 2, -1, -1):
        chain = i % chains
        first, last = trellis.dom_ptr[i], trellis.dom_ptr[i + 1]
        theta = _theta(trellis, messages, i)
        earlier -= messages.before[i]
        later += messages.constants[i] + sent[i]
        for p in range(first, last):
            messages.through[p] = earlier + theta[p - first] + later
        theta *= _gamma(trellis, i)
        if i >= chains:
            least = _send_back(trellis, messages, i, theta)
            messages.constants[i] += least
            sent[i - chains] += least
            if trellis.parents[chain] >= 0:
                least = _send_up(trellis, messages, i, theta)
                messages.constants[i] += least
                sent[i - chain + trellis.parents[chain]] += least
        for p in range(first, last):
            messages.ahead[p] -= messages.constants[i]
        bound += messages.constants[i]
    return bound


@jit
def _send_back(trellis: Trellis, messages: Messages, i: int, theta: Floats) -> float:
    """Send from variable i, whose share is theta, to its chain's move before; return the constant subtracted."""
    first, begin, end = (
        np.uint64(trellis.dom_ptr[i]), trellis.dom_ptr[i - trellis.chains], trellis.dom_ptr[i - trellis.chains + 1],
    )  # fmt: skip
    for p in range(begin, end):
        least = np.inf
        for e in range(np.uint64(trellis.row_ptr[p]), np.uint64(trellis.row_ptr[p + 1])):
            x = np.uint64(trellis.row_to[e])
            least = min(least, trellis.row_cost[e] + theta[x - first] - messages.down_row[x])
        messages.up_row[p] = least
    return _normalise(messages.up_row, begin, end)


@jit
def _send_up(trellis: Trellis, messages: Messages, i: int, theta: Floats) -> float:
    """Send from variable i, whose share is theta, to its parent; return the constant subtracted."""
    first, begin, end = np.uint64(trellis.dom_ptr[i]), trellis.up_ptr[i], trellis.up_ptr[i + 1]
    values = theta - messages.down_col[trellis.dom_ptr[i] : trellis.dom_ptr[i + 1]]
    best = np.uint64(np.argmin(values))
    for u in range(begin, end):
        least, more = np.inf, 0.0  # the correction for the overall best
        for q in range(np.uint64(trellis.col_ptr[u]), np.uint64(trellis.col_ptr[u + 1])):
            k = np.uint64(trellis.col_to[q]) - first
            least = min(least, values[k] + trellis.col_cost[q])
            if k == best:
                more = trellis.col_cost[q]
        if more > 0.0:  # others may do better
            for other in range(len(values)):
                if values[other] < least:
                    least = min(least, values[other] + correction(trellis, u, trellis.dom_ptr[i] + other))
        else:
            least = min(least, values[best])
        messages.up_col[u] = least
    return _normalise(messages.up_col, begin, end)


@jit
def _normalise(message: Floats, begin: int, end: int) -> float:
    """Subtract the minimum from a message, and return it."""
    least = np.inf
    for x in range(begin, end):
        least = min(least, message[x])
    for x in range(begin, end):
        message[x] -= least
    return least


@jit
def step(trellis: Trellis, messages: Messages, i: int, before: int, above: int, e: int) -> float:
    """Return the growth of f in nats when variable i takes the position that edge `e` leads to.

    f grows by the cost of the position and its edges in, plus the messages from later variables, less the messages
    along its edges in and the variable's constant. The growth is at least 0 up to rounding.

    Args:
        trellis: the problem.
        messages: those after a backward sweep.
        i: the variable.
        before: position of its chain one move earlier.
        above: position of its parent variable, -1 without one.
        e: an edge from `before`.
    """
    x = trellis.row_to[e]
    grown = float(trellis.row_cost[e] + messages.ahead[x] - messages.up_row[before])
    if above >= 0:
        u = trellis.up_ptr[i] + above - trellis.dom_ptr[i - i % trellis.chains + trellis.parents[i % trellis.chains]]
        grown += correction(trellis, u, x) - messages.up_col[u]
    return grown


@jit
def descend(trellis: Trellis, messages: Messages, path: Ints, start: int) -> float:
    """Complete a path of positions by the least growth of f at each variable, and return the sum of the growths.

    Greedy descent never fails: every position of a domain leads on along its chain, and couplings forbid nothing.

    Args:
        trellis: the problem.
        messages: those after a backward sweep.
        path: positions [n], chosen up to variable `start`; completed in place.
        start: the first variable to choose.
    """
    chains = trellis.chains
    grown = 0.0
    for i in range(start, len(trellis.dom_ptr) - 1):
        parent = trellis.parents[i % chains]
        above = path[i - i % chains + parent] - trellis.dom_ptr[i - i % chains + parent] if parent >= 0 else -1
        least, path[i] = _least_step(trellis, messages, i, path[i - chains], above)
        grown += least
    return grown


@jit
def _least_step(trellis: Trellis, messages: Messages, i: int, before: int, above: int) -> tuple[float, int]:
    """Return the least growth of f at variable i, as `step` defines it, and the position with that growth.

    Args:
        trellis: the problem.
        messages: those after a backward sweep.
        i: the variable.
        before: position of its chain one move earlier.
        above: index of its parent variable's position in its domain, -1 without one.
    """
    least, best, u = np.inf, -1, trellis.up_ptr[i] + above
    q, last = (trellis.col_ptr[u], trellis.col_ptr[u + 1]) if above >= 0 else (0, 0)
    for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
        x = trellis.row_to[e]
        grown = float(trellis.row_cost[e] + messages.ahead[x] - messages.up_row[before])
        while q < last and trellis.col_to[q] < x:  # merge: both lists are sorted
            q += 1
        if above >= 0:
            grown += (trellis.col_cost[q] if q < last and trellis.col_to[q] == x else 0.0) - messages.up_col[u]
        if grown < least:
            least, best = grown, x
    return least, best


@jit
def tighten(trellis: Trellis, messages: Messages, path: Ints, sweeps: int, enough: float) -> tuple[float, float]:
    """Sweep forward and back, up to `sweeps` times, until the bound reaches the cost of a path, or `enough`.

    Args:
        trellis: the problem.
        messages: updated in place.
        path: receives the best path of positions met on the way [n].
        sweeps: pairs of sweeps.
        enough: nats.

    Returns:
        The lower bound, and the cost of that path, in nats.
    """
    chains = trellis.chains
    trial = np.zeros(len(path), np.int64)
    for chain in range(chains):
        path[chain] = trial[chain] = trellis.dom_ptr[chain]
    bound, cost = -np.inf, np.inf
    for _ in range(sweeps):
        forward(trellis, messages)
        bound = backward(trellis, messages)
        found = bound + descend(trellis, messages, trial, chains)
        if found < cost:
            cost = found
            for i in range(len(path)):
                path[i] = trial[i]
        if bound >= min(cost, enough) - SAME_COST_NATS:
            break
    return bound, cost


def prune(trellis: Trellis, messages: Messages, below: float, in_place: bool) -> tuple[Trellis, Messages]:
    """Remove the positions that no path cheaper than `below` nats goes through; return the rest with its messages.

    If there is no such path, a domain is left empty.

    Args:
        trellis: the whole trellis.
        messages: those after a backward sweep.
        below: nats.
        in_place: whether to overwrite the whole trellis; it survives only if a domain is left empty.
    """
    kept = reachable(trellis, messages.through, below)
    held = np.flatnonzero(kept)
    rows = coupling_rows(trellis, kept)
    fewest = np.diff(np.searchsorted(held, trellis.dom_ptr)).min()  # positions left in the smallest domain
    return subset(trellis, kept, rows, in_place and bool(fewest > 0)), Messages(
        messages.down_row[held], messages.up_row[held], messages.down_col[held], messages.up_col[rows],
        messages.constants.copy(), messages.before.copy(), messages.ahead[held], messages.through[held],
    )  # fmt: skip
