"""Find the cheapest path that differs enough from earlier paths, with a lower bound on all such paths.

The difference of two paths of T moves is the share of the (T - 1) L states between the ends that are not the same.
This constraint couples all states of a path, so relax it: each chain that agrees with path k at a move costs mu_k nats
(one more cost of states by move), and the allowed agreement is refunded. For mu >= 0

    D(mu) = min over x of  E(x) + sum over k of mu_k (agree_k(x) - allowed)

is a lower bound on the cost of every path that agrees with each path k in at most `allowed` states. Every such path
that is found or made on the way gives an upper bound. D is concave, and each path x bounds it from above by a linear
function of mu (a *cut*); the next mu to try maximises the minimum of the cuts.

Sources: Fisher, "The Lagrangian relaxation method for solving integer programming problems", Management Science 27(1),
1981; Batra, Yadollahpour, Guzman-Rivera and Shakhnarovich, "Diverse M-best solutions in Markov random fields", ECCV
2012; Kelley, "The cutting-plane method for solving convex programs", J. SIAM 8(4), 1960; for one earlier path it is the
method of Handler and Zang, "A dual algorithm for the constrained shortest path problem", Networks 10(4), 1980.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from time import perf_counter
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.errors import InfeasibleError
from motionmind.jit import jit
from motionmind.search.costs import path_cost
from motionmind.search.polish import minimise_chain, minimise_move
from motionmind.search.problem import Problem, places
from motionmind.search.solve import Certificate, Progress, Status, Watch, solve
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS, SAME_COST_NATS
from motionmind.search.trellis import Trellis, locate, segment_trellises, states_of

MAX_PRICE_ROUNDS = 30  # ballet takes 6 for one earlier path, 22 for three
PRICE_FACTORS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0)  # by which prices are scaled to improve a path


class TooSimilarError(InfeasibleError):
    """No path was found that differs enough from all earlier paths.

    Attributes:
        most: no path differs from each earlier path by more than this share.
    """

    def __init__(self, most: float) -> None:
        super().__init__(f"no path was found that differs enough: at most {most:.3f} of the states can differ")
        self.most = most


def difference(path: Int32s, other: Int32s) -> float:
    """Return the share of states between the ends that differ in two paths [T + 1, L]; 0 if there are none."""
    return float((path[1:-1] != other[1:-1]).mean()) if len(path) > 2 else 0.0


def solve_diverse(
    problem: Problem, earlier: Sequence[Int32s], share: float, watch: Watch | None = None, within: float = 0.0
) -> Certificate:
    """Find the cheapest path that differs by at least a share from each of the earlier paths.

    Args:
        problem: what to solve, in a given number of moves T.
        earlier: places of the earlier paths [T + 1, L] each, at least one.
        share: least difference, from 0 to 1.
        watch: as for `solve`; its costs are those of paths that differ enough.
        within: stop once the cost is proven to be at most this share above the least.

    Returns:
        The certificate, with cost and bound of the problem itself, without prices. Its status is "optimal" if they
        agree to 1e-6 nats; else "bounded", and the gap includes the relaxation's duality gap.

    Raises:
        InfeasibleError: no path satisfies the problem.
        TooSimilarError: no path was found that differs enough.
    """
    began = perf_counter()
    search = _Search(problem, earlier, share, watch, within)
    search.run()
    best, seconds = search.best, search.seconds
    seconds["search"] += perf_counter() - began - sum(seconds.values())
    status: Status = "bounded"
    if best.cost - search.lower_bound <= OPTIMAL_WITHIN_NATS:
        status = "optimal"
    elif search.ended:
        status = "interrupted"
    effort = search.expansions, search.peak_nodes, seconds
    return Certificate(best.states, best.cost, search.lower_bound, status, *effort, best.passed)


class _Path(NamedTuple):
    """A path: its states [T + 1, L], the moves at which it passes the vias, and its cost in nats."""

    states: Int32s
    passed: tuple[int, ...]
    cost: float


class _Cut(NamedTuple):
    """An upper bound on D, `cost + mu @ excess`, in nats; `excess` counts agreeing states beyond the allowed [K]."""

    cost: float
    excess: Floats


class _Search:
    """The state of one search.

    Attributes:
        best: the best path that differs enough; its cost is infinite before there is one.
        lower_bound: no path that differs enough costs less, nats.
        ended: whether the watcher stopped the search.
    """

    def __init__(
        self, problem: Problem, earlier: Sequence[Int32s], share: float, watch: Watch | None, within: float
    ) -> None:
        model, moves, chains = problem.model, problem.rules.longest, len(problem.model.parents)
        budget = max(problem.rules.node_budget // MAX_PRICE_ROUNDS, 1)
        self._problem = replace(problem, rules=replace(problem.rules, node_budget=budget))
        self._earlier, self._watch, self._within = np.stack(earlier), watch, within
        self._n_inner_states = max(moves - 1, 0) * chains
        self._allowed = float(np.floor((1.0 - share) * self._n_inner_states + 1e-9))  # with a margin for rounding
        chain_of_row = np.repeat(np.arange(chains), np.diff(model.starts))
        self._agreeing = (self._earlier[:, :, chain_of_row] == model.place).astype(np.float64)  # [K, T + 1, G]
        self._agreeing[:, [0, -1]] = 0.0
        timed = problem.timed_costs(moves)
        self._timed = np.zeros_like(self._agreeing[0]) if timed is None else timed
        self.best, self.lower_bound = _Path(np.zeros((0, chains), dtype=np.int32), (), np.inf), -np.inf
        self.ended, self.expansions, self.peak_nodes = False, 0, 0
        self.seconds = {"problem": 0.0, "bound": 0.0, "search": 0.0}

    def run(self) -> None:
        """Try prices until the bound cannot rise, is near enough to the best path, or the watcher stops the search."""
        prices = np.zeros(len(self._earlier))
        self._take(self._find_different(), prices)
        cuts = [_Cut(self.best.cost, self._excess(self.best.states))]
        for _ in range(MAX_PRICE_ROUNDS):
            found, refund = self._solve(prices), float(prices.sum()) * self._allowed
            excess = self._excess(found.path)
            self._take(found, prices)
            self.lower_bound = min(max(self.lower_bound, found.lower_bound - refund), self.best.cost)
            cuts.append(_Cut(found.cost - refund - float(prices @ excess), excess))
            cuts.append(_Cut(self.best.cost, self._excess(self.best.states)))
            prices, promised = _maximise_cuts(cuts)
            if self.ended or min(promised, self.best.cost) - self.lower_bound <= OPTIMAL_WITHIN_NATS:
                return
            if self.best.cost - self.lower_bound <= self._within * self.lower_bound:
                return

    def _excess(self, states: Int32s) -> Floats:
        """Return the number of states that agree with each earlier path, less the allowed number [K]."""
        same = places(self._problem.model, states)[1:-1] == self._earlier[:, 1:-1]
        return np.asarray(same.sum(axis=(1, 2)) - self._allowed, dtype=np.float64)

    def _solve(self, prices: Floats) -> Certificate:
        """Solve the problem with a price on agreement with each earlier path [K]."""
        timed = self._timed + np.tensordot(prices, self._agreeing, 1)
        found = solve(_with_timed_costs(self._problem, timed), self._report if self._watch else None)
        self.expansions += found.expansions
        self.peak_nodes = max(self.peak_nodes, found.peak_nodes)
        for part, seconds in found.seconds.items():
            self.seconds[part] += seconds
        return found

    def _report(self, so_far: Progress) -> bool:
        if self._watch is not None and not self.ended:
            so_far = Progress(self.best.cost, self.lower_bound, self.expansions + so_far.expansions)
            self.ended = bool(self._watch(so_far))
        return self.ended

    def _find_different(self) -> Certificate:
        """Find a path that differs enough, at any cost.

        Without costs and couplings, chains move independently, and one solve gives the least weighted agreement, a
        lower bound on the greatest agreement with any earlier path. Weights grow exponentially with the excess
        agreement (multiplicative weights), at a rate of 4.
        """
        model, rules = self._problem.model, self._problem.rules
        free = {name: np.zeros_like(getattr(model, name)) for name in ("costs", "unary", "alone")}
        model = model._replace(parents=np.full_like(model.parents, -1), **free)
        rules = replace(rules, per_move=0.0, wait=rules.wait if np.isinf(rules.wait) else 0.0)
        alone = replace(self._problem, model=model, rules=rules)
        weights, least = np.full(len(self._earlier), 1.0 / len(self._earlier)), 0.0
        for _ in range(MAX_PRICE_ROUNDS):
            found = solve(_with_timed_costs(alone, np.tensordot(weights, self._agreeing, 1)))
            excess = self._excess(found.path)
            if self._n_inner_states > 0 and np.all(excess <= 0.0):
                return found
            least = max(least, found.lower_bound)
            if self._n_inner_states == 0 or least > self._allowed + OPTIMAL_WITHIN_NATS:
                break
            weights *= np.exp(4.0 * excess / self._n_inner_states)
            weights /= weights.sum()
        raise TooSimilarError(1.0 - least / self._n_inner_states if self._n_inner_states > 0 else 0.0)

    def _take(self, found: Certificate, prices: Floats) -> None:
        """Make a path differ enough and improve it; keep it if it is the best."""
        problem, path = _with_timed_costs(self._problem, self._timed), found.path.copy()
        stops, chains, cost = [0, *found.passed, len(path) - 1], path.shape[1], problem.rules.per_move * (len(path) - 1)
        excess = self._excess(path)
        for trellis, (first, last) in zip(segment_trellises(problem, stops), pairwise(stops), strict=True):
            chosen = locate(trellis, path[first : last + 1])
            chosen[:chains] = trellis.dom_ptr[:chains]  # a via, at which the segment before may arrive
            variable = np.repeat(np.arange(len(chosen)), np.diff(trellis.dom_ptr))
            rows = problem.model.starts[variable % chains] + trellis.dom
            agreeing = self._agreeing[:, first + variable // chains, rows]
            allowed = agreeing[:, chosen].sum(axis=1) - excess
            cost += _improve(trellis, chosen, agreeing, allowed, prices)
            excess = agreeing[:, chosen].sum(axis=1) - allowed
            path[first + 1 : last + 1] = states_of(trellis, chosen)[1:]
        if np.all(excess <= 0.0) and cost < self.best.cost:
            self.best = _Path(path, found.passed, cost)


def _with_timed_costs(problem: Problem, timed: Floats) -> Problem:
    """Return the problem with other costs of states by move, nats [T + 1, G]."""
    return replace(problem, guide=lambda _: timed[1:-1])


def _improve(trellis: Trellis, chosen: Ints, agreeing: Floats, allowed: Floats, prices: Floats) -> float:
    """Improve a path of positions [n] in place, and return its cost in nats.

    Polish it at rising prices until it agrees with each earlier path in no more states than allowed. Then replace one
    chain or move after another by the cheapest at other prices, if that is cheaper and allowed.

    Args:
        trellis: the problem.
        chosen: the path.
        agreeing: 1 where a position agrees with an earlier path, else 0 [K, P].
        allowed: number of states that may agree [K].
        prices: nats for each agreeing state [K].
    """

    def excess(path: Ints) -> float:
        return float(np.maximum(agreeing[:, path].sum(axis=1) - allowed, 0.0).sum())

    trial, everywhere, parts = chosen.copy(), np.ones(len(trellis.dom), dtype=np.bool_), trellis.chains + trellis.moves

    def replacements(factors: Sequence[float]) -> Iterator[int]:
        """Write one replacement after another to `trial`, and yield its number: at each factor, chains, then moves."""
        for row, factor in enumerate(factors):
            dearer = trellis._replace(unary=trellis.unary + factor * prices @ agreeing)
            part = _replace_next(dearer, chosen, 0, everywhere, trial)
            while part < parts:
                yield row * parts + part
                part = _replace_next(dearer, chosen, part + 1, everywhere, trial)

    surplus = excess(chosen)
    for _ in replacements([1.2**k for k in range(1, 12)]):
        if surplus == 0.0:
            break
        if (less := excess(trial)) < surplus:
            chosen[:], surplus = trial, less
    cost, before, last = path_cost(trellis, chosen), np.inf, len(PRICE_FACTORS) * parts
    while cost < before - SAME_COST_NATS:
        before = cost
        for number in replacements(PRICE_FACTORS):
            if number > last and cost == before:  # the rest were tried since the path last changed
                break
            if excess(trial) <= surplus and (least := path_cost(trellis, trial)) < cost:
                chosen[:], cost, last = trial, least, number
    return cost


@jit
def _replace_next(trellis: Trellis, path: Ints, first: int, everywhere: Bools, trial: Ints) -> int:
    """Copy a path [n] to `trial`, and replace by the cheapest the first chain or move, from `first` on, that changes.

    Return the number of the replaced chain (from 0) or move (from L), or L + T if none changes.
    """
    for part in range(first, trellis.chains + trellis.moves):
        trial[:] = path
        if part < trellis.chains:
            minimise_chain(trellis, trial, part, everywhere)
        else:
            minimise_move(trellis, trial, part - trellis.chains + 1, everywhere)
        for i in range(len(path)):
            if trial[i] != path[i]:
                return part
    return trellis.chains + trellis.moves


def _maximise_cuts(cuts: Sequence[_Cut]) -> tuple[Floats, float]:
    """Return the prices [K] that maximise the minimum of the cuts, and that maximum in nats."""
    from scipy.optimize import linprog  # slow to import

    excess = np.stack([cut.excess for cut in cuts])
    count = excess.shape[1]
    found = linprog(
        np.append(np.zeros(count), -1.0),
        np.column_stack([-excess, np.ones(len(cuts))]),
        [cut.cost for cut in cuts],
        bounds=[(0.0, None)] * count + [(None, None)],
    )
    return found.x[:-1], float(found.x[-1])
