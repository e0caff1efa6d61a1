"""The search beside networkx's A* on the explicit product graph, for bodies small enough to have one.

    python experiments/search/product.py PATH/TO/cmu-05 [--setting 5,15] [--pairs 12] [--seed 0] [--limit 300000]

Bodies of two to five chains are cut out of the recordings, and learned as bodies of their own. A node of the product is
a move and the states of all chains, an edge each way to move all of them at once. It is made as the search comes to it,
so that only what is expanded takes time and memory; after `limit` edges networkx is stopped. Its heuristic is what each
chain costs on its own in the moves that are left, summed: it is consistent, and no less than per-joint Dijkstra. The
same problems are given to toulbar2, for which whole bodies are too much at 10 postures a second and 5 degrees.
"""

import argparse
from collections.abc import Iterator
from itertools import pairwise, product
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import networkx as nx
import numpy as np
from bench import RULES, Ends, joinable, moves_of, toulbar2, written

from motionmind import Engine, Motion, Skeleton, own_skeleton, read_motion
from motionmind.discretize import make_discretization
from motionmind.grammar.grammar import Grammar
from motionmind.search import solve
from motionmind.search.problem import Model, Problem, Rules, costs_to_go, with_waits
from motionmind.tween.problem import build_model

JOINTS = ("pelvis", "left_hip", "left_knee", "left_ankle")  # beside them the facing is a chain
SAME = 1e-6  # nats
WRITTEN = 1e-3  # nats; what is written for toulbar2 is rounded to 1e-6 each

Node = tuple[int, tuple[int, ...]]  # moves made, and the state of each chain
Ways = dict[Node, dict[str, float]]


class LimitError(Exception):
    """More edges were made than is allowed."""


class Product(dict[Node, Ways]):
    """Edges out of the nodes of the product graph, worked out each time that they are asked for.

    Attributes:
        first, last: the nodes to go from and to.
        expanded, made: how often it was asked, and how many edges it made.
    """

    def __init__(self, model: Model, ends: Ends, moves: int, limit: int) -> None:
        super().__init__()
        (start, goal), held = ends, with_waits(model, ends[1], RULES.wait)
        self.first, self.last = (0, tuple(start.tolist())), (moves, tuple(goal.tolist()))
        self._to_go, self._parents = costs_to_go(held, goal, moves), model.parents.tolist()
        self._model, self._starts, self._limit = held, model.starts.tolist(), limit
        self.expanded = self.made = 0
        self._discounts = {}
        for chain in range(len(self._parents)):
            for state, row in enumerate(range(model.pair_starts[chain], model.pair_starts[chain + 1])):
                for q in range(model.pair_ptr[row], model.pair_ptr[row + 1]):
                    self._discounts[chain, state, int(model.pair_states[q])] = float(model.pair_costs[q])

    def __missing__(self, node: Node) -> Ways:
        self.expanded += 1
        if node == self.last:
            return {}
        move, states = node
        ways = {}
        for step in product(*(self._steps(chain, state, move) for chain, state in enumerate(states))):
            then, costs = zip(*step, strict=True)
            total = sum(costs)
            for chain, parent in enumerate(self._parents):
                if parent >= 0:
                    total += self._discounts.get((chain, then[parent], then[chain]), 0.0)
            ways[move + 1, then] = {"weight": total}
            self.made += 1
            if self.made > self._limit:
                raise LimitError
        return ways

    def _steps(self, chain: int, state: int, move: int) -> list[tuple[int, float]]:
        """Where a chain can go, and at which cost, if the goal can still be reached from there."""
        m, first, steps = self._model, self._starts[chain], []
        for e in range(m.indptr[first + state], m.indptr[first + state + 1]):
            row = first + m.targets[e]
            if self._to_go[self.last[0] - move - 1, row] < np.inf:
                steps.append((int(m.targets[e]), float(m.costs[e] + m.unary[row])))
        return steps

    def heuristic(self, node: Node, _: Node) -> float:
        move, states = node
        rest = self._to_go[self.last[0] - move]
        return float(sum(rest[first + state] for first, state in zip(self._starts[:-1], states, strict=True)))


def best(model: Model, ends: Ends, moves: int, limit: int) -> tuple[float | None, int, int]:
    """The least cost without tau that networkx finds, None if it comes to the limit; nodes expanded, and edges made."""
    ways = Product(model, ends, moves, limit)
    graph = nx.DiGraph()
    graph.add_nodes_from((ways.first, ways.last))
    graph._adj = ways
    try:
        path = nx.astar_path(graph, ways.first, ways.last, ways.heuristic)
    except LimitError:
        return None, ways.expanded, ways.made
    again = Product(model, ends, moves, np.iinfo(np.int64).max)
    return sum(again[a][b]["weight"] for a, b in pairwise(path)), ways.expanded, ways.made


def cut_out(motion: Motion, joints: tuple[str, ...]) -> Motion:
    """A motion of some joints alone, of which the first is the root and each hangs from the one before."""
    body = motion.skeleton
    kept = [body.names.index(joint) for joint in joints]
    offsets = np.where(np.arange(len(kept))[:, None] > 0, body.offsets[kept], 0.0)
    small = Skeleton("part", joints, tuple(range(-1, len(kept) - 1)), offsets)
    return Motion(small, motion.rotations[:, kept], motion.root, motion.times, motion.name)


class Compared(NamedTuple):
    """Seconds here and there, nodes that networkx expanded and edges that it made, and whether the optimum of each is
    the same: None where there was none within the limits."""

    ours: float
    theirs: float
    expanded: int
    made: int
    by_networkx: bool | None
    by_toulbar2: bool | None


def compare(model: Model, pairs: list[Ends], limit: int, grammar: Grammar) -> Iterator[Compared]:
    """Each pair's problem in the number of moves that is best."""
    for ends in pairs:
        moves = moves_of(solve.solve(Problem(model, *ends, RULES)))
        rules = Rules(RULES.wait, RULES.per_move, moves, moves, RULES.node_budget)
        problem = Problem(model, *ends, rules)
        began = perf_counter()
        ours = solve.solve(problem)
        seconds = perf_counter() - began
        assert ours.status == "optimal"
        began = perf_counter()
        cost, expanded, made = best(model, ends, moves, limit)
        theirs = perf_counter() - began
        outside = toulbar2(written(problem, moves, grammar))[1]
        by_networkx = None if cost is None else abs(cost + RULES.per_move * moves - ours.cost) < SAME
        by_toulbar2 = None if outside is None else abs(outside - ours.cost) < WRITTEN
        yield Compared(seconds, theirs, expanded, made, by_networkx, by_toulbar2)


def verdicts(answers: list[bool | None]) -> str:
    return "; ".join(str(sum(answer is verdict for answer in answers)) for verdict in (True, False, None))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--setting", default="5,15", help="postures a second, degrees")
    parser.add_argument("--pairs", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--limit", type=int, default=300_000)
    options = parser.parse_args()
    rate, tolerance = map(float, options.setting.split(","))
    clips = [own_skeleton(read_motion(file)) for file in sorted(options.folder.glob("*.bvh"))]
    print(
        "| chains | networkx: same optimum; another; none | toulbar2 | nodes | edges | networkx / here: median, most |"
    )
    print("|---|---|---|---|---|---|")
    for count in range(1, len(JOINTS) + 1):
        part = [cut_out(clip, JOINTS[:count]) for clip in clips]
        book = make_discretization("codebook", tolerance)
        engine = Engine.fit(part, name="part", rate=rate, skip=1, discretization=book)
        model, states = build_model(engine.grammar, "conditional", 1.0, 1.0), np.asarray(engine.states)
        grammar = engine.grammar
        list(compare(model, list(joinable(model, states, 2, options.seed + 1)), 1000, grammar))  # compiled, or loaded
        rows = list(compare(model, list(joinable(model, states, options.pairs, options.seed)), options.limit, grammar))
        ratio = np.array([row.theirs / row.ours for row in rows])
        nodes, edges = np.median([(row.expanded, row.made) for row in rows], axis=0)
        print(f"| {len(grammar.chains)} | {verdicts([row.by_networkx for row in rows])}", end=" | ")
        print(f"{verdicts([row.by_toulbar2 for row in rows])} | {nodes:,.0f} | {edges:,.0f}", end=" | ")
        print(f"{np.median(ratio):,.1f}, {ratio.max():,.0f} |", flush=True)


if __name__ == "__main__":
    main()
