"""Toy bodies: problems written as dense tables, and their optima by brute force over all joint states.

What is here knows `Model` only as a form to translate into; the optima come from the dense tables and the sum of
products that the model's definition prints, not from the search's trellis.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise, product
from typing import Any

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.errors import InfeasibleError
from motionmind.search.cfn import Ingredients
from motionmind.search.problem import Model, Problem, Rules, Via, costs_to_go
from motionmind.search.solve import Certificate, Watch, solve
from motionmind.search.trellis import Trellis, build_trellis
from motionmind.search.trws import Messages, no_messages


@dataclass(frozen=True, eq=False)
class Toy:
    """A body of a few chains, dense; one is itself alone, so that what many tests ask of it is kept.

    Attributes:
        parents: parent chain [L], or -1.
        edges: cost of a move of each chain, infinity where there is none, L arrays of [S, S].
        children, above: the parts of a coupling that separate, of the chain's state and of its parent's.
        corrections: what pairs cost beyond that, most often less, L arrays of [states of the parent, S].
        start, goal: states [L].
        wait, per_move: beta and tau.
    """

    parents: tuple[int, ...]
    edges: tuple[Floats, ...]
    children: tuple[Floats, ...]
    above: tuple[Floats, ...]
    corrections: tuple[Floats, ...]
    start: tuple[int, ...]
    goal: tuple[int, ...]
    wait: float
    per_move: float

    @property
    def sizes(self) -> tuple[int, ...]:
        return tuple(len(table) for table in self.edges)

    def coupling(self, chain: int) -> Floats:
        """Cost of standing together [states of the parent, states of the chain]."""
        return self.above[chain][:, None] + self.children[chain][None, :] + self.corrections[chain]

    def moves(self, chain: int) -> Floats:
        """Cost of a chain's moves, waiting at the goal among them [S, S]."""
        costs, goal = self.edges[chain].copy(), self.goal[chain]
        costs[goal, goal] = min(costs[goal, goal], self.wait)
        return costs

    @cached_property
    def model(self) -> Model:
        """The same as the search reads it."""
        starts = np.concatenate([[0], np.cumsum(self.sizes)]).astype(np.int64)
        rows = [np.flatnonzero(np.isfinite(row)) for table in self.edges for row in table]
        costs = [row[np.isfinite(row)] for table in self.edges for row in table]
        unary, alone = np.zeros(starts[-1]), np.zeros(starts[-1])
        pair_starts, pairs, corrections = [0], [], []
        for chain, parent in enumerate(self.parents):
            mine = slice(starts[chain], starts[chain + 1])
            if parent >= 0:
                unary[mine] += self.children[chain]
                unary[starts[parent] : starts[parent + 1]] += self.above[chain]
                alone[mine] = self.coupling(chain).min(axis=0)
                pairs += [np.flatnonzero(row) for row in self.corrections[chain]]
                corrections += [row[row != 0.0] for row in self.corrections[chain]]
            pair_starts.append(len(pairs))
        return Model(
            starts,
            np.array(self.parents, dtype=np.int64),
            _pointer(rows),
            np.concatenate([*rows, []]).astype(np.int32),
            np.concatenate([*costs, []]).astype(np.float64),
            unary,
            alone,
            np.array(pair_starts, dtype=np.int64),
            _pointer(pairs),
            np.concatenate([*pairs, []]).astype(np.int32),
            np.concatenate([*corrections, []]).astype(np.float64),
            np.ones(starts[-1], dtype=bool),
            np.concatenate([np.arange(size) for size in self.sizes]).astype(np.int32),
        )

    def ends(self) -> tuple[Ints, Ints]:
        return np.array(self.start, dtype=np.int64), np.array(self.goal, dtype=np.int64)

    def rules(self, shortest: int, longest: int, node_budget: int = 100_000, sweeps: int = 60) -> Rules:
        return Rules(self.wait, self.per_move, shortest, longest, node_budget, sweeps)

    def problem(
        self, rules: Rules, vias: Sequence[Via] = (), guide: Callable[[int], Floats] | None = None, **changes: Any
    ) -> Problem:
        """The problem from start to goal; `changes` are made to the model, such as in what is allowed."""
        return Problem(self.model._replace(**changes), *self.ends(), rules, vias, guide)

    def ingredients(self, problem: Problem) -> Ingredients:
        """What the costs of one of its problems are made of; edges are of one kind or the other, whatever they cost."""
        kind = np.random.default_rng(len(self.model.costs)).integers(2, size=len(problem.model_with_waits().costs))
        coupled = [own * (parent >= 0) for own, parent in zip(self.children, self.parents, strict=True)]
        return Ingredients(("one", "other"), kind, np.concatenate(coupled), np.concatenate(self.above))

    def cost(self, path: Int32s, guide: Floats | None = None) -> float:
        """Cost of a path of states [T + 1, L], summed as it is defined; infinite where it breaks a rule.

        `guide` [T - 1, G] is what states cost besides on the way.
        """
        if tuple(path[0]) != self.start or tuple(path[-1]) != self.goal:
            return np.inf
        total = self.per_move * (len(path) - 1)
        if guide is not None:
            total += sum(guide[t, self.rows(states)].sum() for t, states in enumerate(path[1:-1]))
        for before, after in pairwise(path):
            for chain, parent in enumerate(self.parents):
                total += self.moves(chain)[before[chain], after[chain]]
                if parent >= 0:
                    total += self.coupling(chain)[after[parent], after[chain]]
        return float(total)

    def rows(self, states: Ints | Int32s) -> Ints:
        """Rows of the model that hold states [..., L] of all chains."""
        return np.concatenate([[0], np.cumsum(self.sizes)])[:-1] + states

    def joint_states(self) -> Ints:
        """All states of the whole body [product of sizes, L]."""
        return np.array(list(product(*map(range, self.sizes))))

    def _tables(self) -> tuple[Floats, Floats]:
        """What the body as a whole pays for a move [N, N] and for standing somewhere [N]."""
        joint = self.joint_states()
        stand = np.zeros(len(joint))
        move = np.zeros((len(joint), len(joint)))
        for chain, parent in enumerate(self.parents):
            move += self.moves(chain)[joint[:, chain][:, None], joint[:, chain][None, :]]
            if parent >= 0:
                stand += self.coupling(chain)[joint[:, parent], joint[:, chain]]
        return move, stand

    def so_far(self, longest: int) -> Floats:
        """Least cost from the start to each joint state in exactly t moves, without tau [longest + 1, N]."""
        move, stand = self._tables()
        value = [np.where((self.joint_states() == self.start).all(axis=1), 0.0, np.inf)]
        for _ in range(longest):
            value.append((value[-1][:, None] + move).min(axis=0) + stand)
        return np.array(value)

    def to_go(self, longest: int) -> Floats:
        """Least cost from each joint state to the goal in exactly t moves, without tau [longest + 1, N]."""
        move, stand = self._tables()
        value = [np.where((self.joint_states() == self.goal).all(axis=1), 0.0, np.inf)]
        for _ in range(longest):
            value.append((move + stand + value[-1]).min(axis=1))
        return np.array(value)

    def optima(self, longest: int) -> Floats:
        """Least cost of exactly T moves, for T = 0 .. longest, over all joint states [longest + 1]."""
        return _optima(self, longest)

    def scaled(self, factor: float) -> Toy:
        """The same body with all costs multiplied."""

        def times(tables: tuple[Floats, ...]) -> tuple[Floats, ...]:
            return tuple(table * factor for table in tables)

        return replace(
            self,
            edges=times(self.edges),
            children=times(self.children),
            above=times(self.above),
            corrections=times(self.corrections),
            wait=self.wait * factor,
            per_move=self.per_move * factor,
        )


@lru_cache(maxsize=2_000)
def _optima(toy: Toy, longest: int) -> Floats:
    at_goal = (toy.joint_states() == toy.goal).all(axis=1)
    return toy.so_far(longest)[:, at_goal][:, 0] + toy.per_move * np.arange(longest + 1)


@lru_cache(maxsize=2_000)
def random_toy(
    seed: int, *, most: int = 5, states: int = 4, frustrated: bool = False, even: bool = False, dear: bool = False
) -> Toy:
    """A random body of 1 to `most` chains: any forest, sparse moves with dead ends, couplings with discounts.

    Args:
        seed: what it is drawn from.
        most: chains at most; at most 256 joint states come of it.
        states: states a chain at most.
        frustrated: couplings far stronger than moves, which leaves a gap between bound and optimum.
        even: all costs multiples of a tenth, so that many paths cost the same but for rounding.
        dear: of the pairs that couplings list many cost more than others.
    """
    rng = np.random.default_rng(seed)
    chains = int(rng.integers(1, most + 1))
    sizes = [int(rng.integers(1, states + 1)) for _ in range(chains)]
    while np.prod(sizes) > 256:
        sizes[int(np.argmax(sizes))] -= 1
    parents = tuple(int(rng.integers(-1, chain)) if chain else -1 for chain in range(chains))

    def draw(high: float, shape: tuple[int, ...] | int) -> Floats:
        return rng.integers(0, 6, shape) * (high / 5.0) if even else rng.uniform(0.0, high, shape)

    edges, children, above, corrections = [], [], [], []
    for size, parent in zip(sizes, parents, strict=True):
        table = draw(2.0, (size, size))
        table[rng.random((size, size)) > (0.85 if frustrated else rng.uniform(0.4, 0.9))] = np.inf
        edges.append(table)
        size_above = sizes[parent] if parent >= 0 else 0
        strength = 6.0 if frustrated else 2.0
        children.append(draw(1.0, size))
        above.append(draw(1.0, size_above))
        table = -draw(strength, (size_above, size)) * (rng.random((size_above, size)) < rng.uniform(0.3, 0.7))
        corrections.append(table * rng.choice([-1.0, 1.0], table.shape) if dear else table)
    return Toy(
        parents,
        tuple(edges),
        tuple(children),
        tuple(above),
        tuple(corrections),
        tuple(int(rng.integers(size)) for size in sizes),
        tuple(int(rng.integers(size)) for size in sizes),
        wait=float(draw(1.5, 1)[0]),
        per_move=float(draw(1.0, 1)[0]),
    )


def best(
    toy: Toy, moves: Sequence[int], allowed: Bools, vias: Sequence[Via], guide: Callable[[int], Floats] | None = None
) -> float:
    """Least cost over all joint states, for numbers of moves, with `allowed` [G] on the way and vias passed in order.

    value[k, n]: of the ways so far to joint state n, past k vias; no two are passed at once, nor at either end.
    """
    joint = toy.joint_states()
    move, stand = toy._tables()
    rows = toy.rows(joint)
    inner = np.where(allowed[rows].all(axis=1), 0.0, np.inf)
    at_goal = (joint == toy.goal).all(axis=1)
    least = np.inf
    for last in moves:
        value = np.full((len(vias) + 1, len(joint)), np.inf)
        value[0] = np.where((joint == toy.start).all(axis=1), 0.0, np.inf)
        for t in range(1, last + 1):
            value = (value[:, :, None] + move).min(axis=1) + stand
            if t < last:
                value += inner
                if guide is not None:
                    value += guide(last)[t - 1][rows].sum(axis=1)
                for k in range(len(vias), 0, -1):
                    if vias[k - 1].move in (None, t):
                        here = (joint == vias[k - 1].states).all(axis=1)
                        value[k, here] = np.minimum(value[k, here], value[k - 1, here])
        least = min(least, value[-1, at_goal][0] + toy.per_move * last)
    return least


def noisy_messages(trellis: Trellis, seed: int, noise: float) -> Messages:
    """Forward messages at random: with what is then sent back they bound, but poorly, and leave A* much to do."""
    rng = np.random.default_rng(seed)
    messages = no_messages(trellis)
    messages.down_row[:] = rng.uniform(0.0, noise, len(trellis.dom))
    messages.down_row[: trellis.dom_ptr[trellis.chains]] = 0.0
    for i in range(len(trellis.dom_ptr) - 1):
        if trellis.up_ptr[i + 1] > trellis.up_ptr[i]:
            here = slice(trellis.dom_ptr[i], trellis.dom_ptr[i + 1])
            messages.down_col[here] = rng.uniform(0.0, noise, here.stop - here.start)
    return messages


def trellis_of(toy: Toy, moves: int, below: float = np.inf) -> Trellis:
    """The trellis of exactly `moves` moves."""
    problem = toy.problem(toy.rules(moves, moves))
    model = problem.model_with_waits()
    return build_trellis(model, problem.start, moves, costs_to_go(model, problem.goal, moves), below)


def solution(problem: Problem, watch: Watch | None = None) -> Certificate | None:
    """The certificate of a problem; None where it is infeasible."""
    try:
        return solve(problem, watch)
    except InfeasibleError:
        return None


def _pointer(rows: list[Ints]) -> Ints:
    return np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64)


def evaluate(text: str, states: np.ndarray, chains: Sequence[str]) -> float:
    """Cost of a path of states, or of the places that moves lead to, in a cost function network."""
    return sum(costs_by_function(text, states, chains).values())


def costs_by_function(text: str, states: np.ndarray, chains: Sequence[str]) -> dict[str, float]:
    """What each function of a cost function network costs on a path [T + 1, L], by the format's own definition."""
    network = json.loads(text)
    chosen = {}
    for name, values in network["variables"].items():
        chain, _, move = name.removesuffix("_on").rpartition("_")
        t, j = int(move), list(chains).index(chain)
        before, after = states[max(t - 1, 0), j], states[t, j]
        chosen[name] = values.index(f"s{after}" if f"s{after}" in values else f"s{before}_s{after}")
    out = {}
    for name, function in network["functions"].items():
        at, costs = [chosen[variable] for variable in function["scope"]], function["costs"]
        if len(at) == 2:
            listed = dict(zip(zip(costs[0::3], costs[1::3], strict=True), costs[2::3], strict=True))
            out[name] = listed.get(tuple(at), function["defaultcost"])
        else:
            out[name] = costs[at[0] if at else 0]
    return out
