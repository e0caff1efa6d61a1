"""Settings in which A* expands more than a straight walk to the goal, and its proof when memory is short.

    python experiments/search/expansions.py [PATH/TO/cmu-05] [--pairs 8] [--seed 0] [--quick]

Problems are those of `Engine.tween`, guided and paced, between random postures of bundled ballet and, at several rates
and tolerances, of recordings learned as in bench.py. A straight walk expands moves x chains nodes. --quick takes two
pairs of ballet and little effort.
"""

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from heuristics import learn

from motionmind import Engine, Posture, TweenRequest
from motionmind.search import astar, bounding
from motionmind.search.diverse import solve_diverse
from motionmind.search.problem import Problem
from motionmind.search.solve import Certificate, feasible, solve
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS
from motionmind.tween.ends import bring_ends
from motionmind.tween.formulate import formulate

EXPANSIONS = 200_000
NODES = (1_000, 10_000, 100_000, 10_000_000)  # the last is never full: an expansion makes about eight nodes
QUICK_EXPANSIONS, QUICK_NODES = 5_000, (300, 1_000, 10_000_000)

Ask = Callable[[Engine, np.random.Generator], dict[str, Any]]


class Case(NamedTuple):
    """A setting: the corpus, "ballet" or postures a second and degrees; and what is asked of each pair.

    Attributes:
        corpus: the corpus.
        name: what the case is called.
        ask: the options of a request.
        sweeps: of messages at most; None for all bounds, else there are no pair chains either.
        differs: whether the answer is the second of two alternatives.
    """

    corpus: str
    name: str
    ask: Ask
    sweeps: int | None = None
    differs: bool = False


def options(**chosen: Any) -> Ask:
    return lambda engine, rng: chosen


def pin(engine: Engine, rng: np.random.Generator) -> dict[str, Any]:
    return {"pin": {str(rng.choice(engine.corpus.chains)): "A"}}


def via(engine: Engine, rng: np.random.Generator) -> dict[str, Any]:
    return {"via": [random_posture(engine, rng)]}


ASKED: dict[str, Ask] = {
    "defaults": options(),
    "novelty 0.5": options(novelty=0.5),
    "novelty 1": options(novelty=1.0),
    "printed weights": options(weights="printed"),
    "kappa 0.1": options(guide=0.1),
    "kappa 0": options(guide=0.0),
    "a pin": pin,
    "a via": via,
    "progression": options(coordination="progression"),
}
CASES = [
    *(Case(corpus, name, ask) for corpus in ("ballet", "5,15", "10,10", "10,5") for name, ask in ASKED.items()),
    *(Case(corpus, "an alternative", options(), differs=True) for corpus in ("ballet", "5,15", "10,10")),
    *(Case("20,4", name, ASKED[name]) for name in ("defaults", "novelty 0.5", "progression")),
    *(Case(corpus, "messages alone", options(), 160) for corpus in ("ballet", "5,15", "10,10")),
    Case("5,15", "8 sweeps of messages", options(), 8),
    Case("ballet", "1 sweep of messages", options(), 1),
]
FORGETFUL = [  # of these the optimum is known for most pairs, from all bounds or from A* with memory enough
    Case("ballet", "1 sweep of messages", options(), 1),
    Case("5,15", "8 sweeps of messages", options(), 8),
    Case("10,5", "novelty 0.5", ASKED["novelty 0.5"]),
]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--pairs", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args()
    pairs, expansions, nodes = asked.pairs, EXPANSIONS, NODES
    if asked.quick:
        pairs, expansions, nodes = 2, QUICK_EXPANSIONS, QUICK_NODES

    @lru_cache(maxsize=1)
    def engine(corpus: str) -> Engine:
        if corpus == "ballet":
            return learn(None, 0.0, 0.0)
        return learn(asked.folder, *map(float, corpus.split(",")))

    def known(cases: list[Case]) -> list[Case]:
        """Those whose corpus there is, each corpus learned once."""
        corpora = ["ballet"] if asked.quick or asked.folder is None else dict.fromkeys(case.corpus for case in cases)
        return [case for corpus in corpora for case in cases if case.corpus == corpus]

    tell_expansions(known(CASES), engine, pairs, asked.seed, expansions)
    print()
    tell_memory(known(FORGETFUL), engine, pairs, asked.seed, expansions, nodes)


# --- problems ---------------------------------------------------------------------------------------------------------


def random_posture(engine: Engine, rng: np.random.Generator) -> Posture:
    number = int(rng.integers(len(engine.corpus)))
    return Posture(engine.corpus.skeleton, engine.corpus.rotations[number], engine.corpus.root[number])


class Posed(NamedTuple):
    """A problem, and the path that its answer is to differ from, if any."""

    problem: Problem
    other: Certificate | None
    differ: float

    def solve(self, expansions: int) -> Certificate:
        problem = replace(self.problem, rules=replace(self.problem.rules, node_budget=expansions))
        return solve_diverse(problem, [self.other.path], self.differ) if self.other else solve(problem)


def posed(case: Case, engine: Engine, pairs: int, seed: int) -> Iterator[Posed]:
    """Problems of random pairs of postures; pairs without any path, as under a pin, are drawn anew."""
    rng = np.random.default_rng(seed)
    while pairs > 0:
        a, b = random_posture(engine, rng), random_posture(engine, rng)
        request = TweenRequest.of(**case.ask(engine, rng))
        found = formulate(engine, bring_ends(engine.corpus, a, b), request)
        if not feasible(found.searched):
            continue
        other = None
        if case.differs:
            other = solve(found.searched)
            found = formulate(engine, bring_ends(engine.corpus, a, b), replace(request, unlike=(other,)))
        pairs -= 1
        yield Posed(found.searched, other, request.differ)


@contextmanager
def bounded(case: Case, problem: Problem) -> Iterator[Problem]:
    """The problem with no more sweeps than the case allows."""
    most = bounding.MAX_STATE_PAIRS
    if case.sweeps is not None:
        problem, bounding.MAX_STATE_PAIRS = replace(problem, rules=replace(problem.rules, sweeps=case.sweeps)), 0
    try:
        yield problem
    finally:
        bounding.MAX_STATE_PAIRS = most


class Walk(NamedTuple):
    """One search by A*: moves x chains, and what came of it."""

    straight: int
    found: astar.Found


@contextmanager
def listening(nodes: int | None = None) -> Iterator[list[Walk]]:
    """Collect the searches by A*, each with at most so many nodes in memory."""
    walks, search = [], astar.search

    def searched(trellis: Any, heuristic: Any, cost: float, slack: float, path: Any, budget: int, *rest: Any) -> Any:
        found = search(trellis, heuristic, cost, slack, path, budget if nodes is None else nodes, *rest)
        walks.append(Walk(len(path) - trellis.chains, found))
        return found

    astar.search = searched
    try:
        yield walks
    finally:
        astar.search = search


# --- expansions -------------------------------------------------------------------------------------------------------


class Effort(NamedTuple):
    """What one answer took."""

    moves: int
    chains: int
    more: bool  # whether a search expanded more than moves x chains
    ratio: float  # expansions over moves x chains of all its searches
    peak_nodes: int
    proven: bool
    gap: float
    proven_by_bounds: bool  # proven with a budget of one node
    same: bool  # whether cost and bound are the same with a budget of one node


def effort(case: Case, one: Posed, expansions: int) -> Effort:
    with bounded(case, one.problem) as problem:
        one = one._replace(problem=problem)
        with listening() as walks:
            answer = one.solve(expansions)
        alone = one.solve(1)
    straight = sum(walk.straight for walk in walks)
    return Effort(
        moves=len(answer.path) - 1,
        chains=answer.path.shape[1],
        more=any(walk.found.expansions > walk.straight for walk in walks),
        ratio=sum(walk.found.expansions for walk in walks) / straight if straight else 0.0,
        peak_nodes=answer.peak_nodes,
        proven=answer.status == "optimal",
        gap=gap(answer.cost, answer.lower_bound),
        proven_by_bounds=alone.status == "optimal",
        same=abs(alone.cost - answer.cost) <= OPTIMAL_WITHIN_NATS
        and abs(alone.lower_bound - answer.lower_bound) <= OPTIMAL_WITHIN_NATS,
    )


def gap(cost: float, lower_bound: float) -> float:
    return (cost - lower_bound) / cost if cost else 0.0


def tell_expansions(cases: list[Case], engine: Callable[[str], Engine], pairs: int, seed: int, expansions: int) -> None:
    """Print a row for each case in which A* expanded more than a straight walk, then the names of the others."""
    print("| | pairs, moves | expanded more | expansions / (moves x chains): median, most", end=" | ")
    print("nodes held at most, memory | proven by bounds alone | proven | gap of the rest: median, most |")
    print("|---|---|---|---|---|---|---|---|")
    straight: dict[str, list[str]] = {}
    count = same = 0
    for case in cases:
        rows = [effort(case, one, expansions) for one in posed(case, engine(case.corpus), pairs, seed)]
        if not any(row.more for row in rows):
            straight.setdefault(case.corpus, []).append(case.name)
            count, same = count + len(rows), same + sum(row.same for row in rows)
            continue
        moves, ratios = [row.moves for row in rows], [row.ratio for row in rows]
        peak, gaps = max(row.peak_nodes for row in rows), [row.gap for row in rows if not row.proven]
        megabytes = peak / astar.node_capacity(1_000_000, rows[0].chains)
        print(f"| {case.corpus}: {case.name} | {len(rows)}, {min(moves)} to {max(moves)}", end=" | ")
        print(f"{sum(row.more for row in rows)} | {np.median(ratios):,.1f}, {max(ratios):,.1f}", end=" | ")
        print(f"{peak:,}, {megabytes:.1f} MB | {sum(row.proven_by_bounds for row in rows)}", end=" | ")
        print(f"{len(rows) - len(gaps)} | {spread(gaps)} |", flush=True)
    print("\nstraight: " + "; ".join(f"{corpus}: {', '.join(names)}" for corpus, names in straight.items()))
    print(f"{count} pairs; the same cost and bound with a budget of one node: {same}")


def spread(gaps: list[float]) -> str:
    return f"{np.median(gaps):.2%}, {max(gaps):.2%}" if gaps else ""


# --- memory -----------------------------------------------------------------------------------------------------------


class Remembered(NamedTuple):
    """An answer with so much memory, and nodes that were forgotten on the way."""

    cost: float
    lower_bound: float
    forgotten: int


def remembered(case: Case, one: Posed, expansions: int, nodes: int) -> Remembered:
    with bounded(case, one.problem) as problem, listening(nodes) as walks:
        answer = one._replace(problem=problem).solve(expansions)
    return Remembered(answer.cost, answer.lower_bound, sum(walk.found.forgotten for walk in walks))


def optimum(one: Posed, answers: list[Remembered], expansions: int) -> float:
    """The least cost, proven by one of the answers or with all bounds; NaN if it is not known."""
    proven = [answer.cost for answer in answers if answer.cost - answer.lower_bound <= OPTIMAL_WITHIN_NATS]
    best = one.solve(expansions)
    if best.status == "optimal":
        proven.append(best.cost)
    assert not proven or max(proven) - min(proven) <= 2 * OPTIMAL_WITHIN_NATS, "two optima"
    return min(proven, default=np.nan)


def tell_memory(
    cases: list[Case],
    engine: Callable[[str], Engine],
    pairs: int,
    seed: int,
    expansions: int,
    budgets: tuple[int, ...],
) -> None:
    """Print a row for each case and each number of nodes that memory holds."""
    print("| | nodes that memory holds | it filled, of pairs | nodes forgotten: median, most | proven", end=" | ")
    print("gap of the rest: median, most | bound above a known optimum | bound less than in less memory |")
    print("|---|---|---|---|---|---|---|---|")
    for case in cases:
        problems = list(posed(case, engine(case.corpus), pairs, seed))
        table = [[remembered(case, one, expansions, nodes) for nodes in budgets] for one in problems]
        best = [optimum(one, row, expansions) for one, row in zip(problems, table, strict=True)]
        for k, nodes in enumerate(budgets):
            column = [row[k] for row in table]
            forgotten = [answer.forgotten for answer in column]
            open_gaps = [answer.cost - answer.lower_bound > OPTIMAL_WITHIN_NATS for answer in column]
            gaps = [gap(*answer[:2]) for answer, is_open in zip(column, open_gaps, strict=True) if is_open]
            above = sum(
                answer.lower_bound > least + OPTIMAL_WITHIN_NATS for answer, least in zip(column, best, strict=True)
            )
            less = sum(row[k].lower_bound < row[k - 1].lower_bound - OPTIMAL_WITHIN_NATS for row in table) if k else 0
            print(f"| {case.corpus}: {case.name} | {nodes:,} | {sum(map(bool, forgotten))} of {pairs}", end=" | ")
            print(f"{np.median(forgotten):,.0f}, {max(forgotten):,} | {len(column) - len(gaps)}", end=" | ")
            print(f"{spread(gaps)} | {above} of {int(np.isfinite(best).sum())} | {less} |", flush=True)


if __name__ == "__main__":
    main()
