"""The earliest search in the papers, as a baseline: whole postures of a corpus, in their recorded order.

Nodes are whole bodies (states of all chains at once), and edges are the corpus's moves between them. Both cost the same
as in the search that moves chains independently, so this is a restriction of that search and finds no cheaper path.
Chains outside the nodes (the facing, which no tree couples) move independently.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.corpus.corpus import FACING, Corpus
from motionmind.errors import InfeasibleError
from motionmind.geometry import rotations as rot
from motionmind.search.problem import Model, Problem, Rules, costs_to_go
from motionmind.search.solve import Certificate
from motionmind.search.watcher import Stopwatch


class Bodies(NamedTuple):
    """Whole bodies and the moves between them.

    Attributes:
        states: states of the first K chains, each body once [P, K].
        of: the body of each posture of the corpus [N].
        indptr: moves from each body [P + 1]; `targets` from `indptr[body]` to `indptr[body + 1]`.
        targets: the body that a move leads to [M].
    """

    states: Int32s
    of: Ints
    indptr: Ints
    targets: Ints

    @property
    def sources(self) -> Ints:
        """The body that each move leaves [M]."""
        return np.repeat(np.arange(len(self.states)), np.diff(self.indptr))


def find_bodies(states: Int32s, begins: Ints, ends: Ints) -> Bodies:
    """Collect the bodies of postures with `states` [N, K], and the moves from postures `begins` [M] to `ends` [M]."""
    bodies, of = np.unique(states, axis=0, return_inverse=True)
    of = of.reshape(-1).astype(np.int64)
    sources, targets = np.unique(np.stack([of[begins], of[ends]]), axis=1)
    indptr = np.concatenate([[0], np.cumsum(np.bincount(sources, minlength=len(bodies)))])
    return Bodies(bodies, of, indptr.astype(np.int64), targets)


def solve_whole_body(problem: Problem, bodies: Bodies) -> Certificate:
    """Find the cheapest path through whole bodies over all numbers of moves.

        V[0, goal] = 0,   V[k, p] = min over moves p -> q of  cost(p, q) + V[k - 1, q]

    with the costs of the model. It is exact: no path through whole bodies costs less.

    Args:
        problem: a problem without vias whose start and goal are bodies; its restrictions are ignored.
        bodies: whole bodies of the first K chains.

    Raises:
        InfeasibleError: no sequence of bodies leads from start to goal within the rules.
    """
    start, goal, rules = problem.start, problem.goal, problem.rules
    clock, count = Stopwatch("problem", "bound", "search"), bodies.states.shape[1]
    model = problem.model_with_waits()
    costs = _costs(model, bodies)
    to_go = costs_to_go(model, goal, rules.longest)
    alone = to_go[:, model.starts[count:-1] + start[count:]].sum(axis=1) + rules.per_move * np.arange(len(to_go))
    clock.lap("problem")
    a, b = _body(bodies, start[:count]), _body(bodies, goal[:count])
    value, best, moves = _values(bodies, costs, alone, a, b, rules)
    if not np.isfinite(best):
        raise InfeasibleError("no path through whole bodies satisfies the problem")
    path = np.empty((moves + 1, len(start)), dtype=np.int32)
    path[0], body = start, a
    for k in range(moves, 0, -1):
        edges = np.arange(bodies.indptr[body], bodies.indptr[body + 1])
        body = int(bodies.targets[edges[np.argmin(costs[edges] + value[k - 1][bodies.targets[edges]])]])
        path[moves - k + 1, :count] = bodies.states[body]
        for chain in range(count, len(start)):
            row = model.starts[chain] + path[moves - k, chain]
            edges = np.arange(model.indptr[row], model.indptr[row + 1])
            left = to_go[k - 1, model.starts[chain] + model.targets[edges]]
            path[moves - k + 1, chain] = model.targets[edges[np.argmin(model.costs[edges] + left)]]
    clock.lap("search")
    return Certificate(path, best, best, "optimal", 0, 0, clock.seconds)


def _values(
    bodies: Bodies, costs: Floats, alone: Floats, a: int, b: int, rules: Rules
) -> tuple[list[Floats], float, int]:
    """Return V up to the last number of moves that may matter, the least cost from body a to b, and its moves.

    `alone` is the cost of the moves themselves and of all chains outside the bodies, by number of moves [longest + 1].
    """
    rows = np.flatnonzero(np.diff(bodies.indptr))
    value = [np.where(np.arange(len(bodies.states)) == b, 0.0, np.inf)]
    best, moves, least = np.inf, 0, min(float(costs.min(initial=0.0)), 0.0)
    for k in range(1, rules.longest + 1):
        value.append(np.full(len(bodies.states), np.inf))
        through = costs + value[-2][bodies.targets]
        value[-1][rows] = np.minimum.reduceat(through, bodies.indptr[rows]) if len(rows) else np.inf
        if k >= rules.shortest and value[-1][a] + alone[k] < best:
            best, moves = float(value[-1][a] + alone[k]), k
        # Lower bound on any longer path: its last k moves plus the earlier ones.
        if value[-1].min() + rules.per_move * k + least * (rules.longest - k) >= best or np.isinf(value[-1].min()):
            break
    return value, best, moves


def _body(bodies: Bodies, states: Ints) -> int:
    """Return the body with these states [K]."""
    return int(np.flatnonzero((bodies.states == states).all(axis=1))[0])


def _costs(model: Model, bodies: Bodies) -> Floats:
    """Return the cost of each move [M] in nats: its chains' moves plus the body that it leads to."""
    sources, states = bodies.sources, bodies.states.astype(np.int64)
    span = int(np.diff(model.starts).max())
    edges = np.repeat(np.arange(len(model.indptr) - 1), np.diff(model.indptr)) * span + model.targets
    pairs = np.repeat(np.arange(len(model.pair_ptr) - 1), np.diff(model.pair_ptr)) * span + model.pair_states
    costs, stand = np.zeros(len(sources)), np.zeros(len(states))
    for chain in range(states.shape[1]):
        rows, parent = model.starts[chain] + states[:, chain], model.parents[chain]
        costs += model.costs[np.searchsorted(edges, rows[sources] * span + states[bodies.targets, chain])]
        stand += model.unary[rows]
        if parent >= 0:  # a body was seen, and so were its pairs
            stand += model.pair_costs[
                np.searchsorted(pairs, (model.pair_starts[chain] + states[:, parent]) * span + states[:, chain])
            ]
    return np.asarray(costs + stand[bodies.targets])


def nearest_posture(corpus: Corpus, rotations: Floats) -> int:
    """Return the number of the corpus's posture nearest to `rotations` [J, 4], ignoring its facing if that is free.

    The nearest posture has the least sum of squared angles between joints.
    """
    count = len(corpus.skeleton)
    angles = rot.angle(corpus.to_chains(corpus.rotations)[:, :count], corpus.to_chains(rotations)[:count])
    return int(np.argmin(np.sum(angles**2, axis=1)))


def diagnose_whole_body(corpus: Corpus, bodies: Bodies, near: tuple[int, int], rules: Rules) -> str:
    """Explain why no whole postures join the corpus's postures nearest to A and B, and name the nearest pair."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import shortest_path

    (a, b), (start, goal) = near, bodies.of[list(near)]
    count, shape = len(bodies.targets), (len(bodies.states), len(bodies.states))
    graph = csr_array((np.ones(count), bodies.targets, bodies.indptr), shape=shape)
    ahead = shortest_path(graph, unweighted=True, indices=start)
    back = shortest_path(graph.T.tocsr(), unweighted=True, indices=goal)
    within = f"at most {rules.longest} move{'s' * (rules.longest != 1)}"
    first = f"no path from A to B in {within} through whole postures (without whole-body joints move on their own):"
    ends = f"{_place(corpus, a)}, nearest to A, and {_place(corpus, b)}, nearest to B"
    if np.isfinite(ahead[goal]) and start != goal:
        needs = f"{ahead[goal]:.0f} moves lie between {ends}"
        if ahead[goal] <= rules.longest:
            needs += f", but not in the requested number, or the {FACING} cannot turn far enough in them"
        return f"{first}\n  {needs}"
    # One posture of each body is enough to measure distances.
    one = np.unique(bodies.of, return_index=True)[1]
    found, led = one[np.isfinite(ahead)], one[np.isfinite(back)]
    joints = corpus.to_chains(corpus.rotations)[:, : len(corpus.skeleton)]
    some, others = (which[:: 1 + len(which) // 4000] for which in (found, led))  # to compare at most 4000 of each
    # The sum over joints of (q . p)^2 = cos^2 of half the angle is a product of one factor from each posture.
    squares = [(q[..., :, None] * q[..., None, :]).reshape(len(q), -1) for q in (joints[some], joints[others])]
    i, k = np.unravel_index(int(np.argmax(squares[0] @ squares[1].T)), (len(some), len(others)))
    degrees = np.degrees(rot.angle(joints[some[i]], joints[others[k]])).mean()
    return (
        f"{first}\n  {_place(corpus, a)}, nearest to A, leads to {len(found)} postures, and {len(led)} lead to "
        f"{_place(corpus, b)}, nearest to B, with none in common; the nearest are "
        f"{_place(corpus, some[i])} and {_place(corpus, others[k])}, {degrees:.1f} degrees a joint apart"
    )


def _place(corpus: Corpus, posture: int) -> str:
    clip = corpus.clip_of(posture)
    return f"posture {posture - clip.start} of {clip.label}"
