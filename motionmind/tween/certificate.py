"""The certificate in detail: what each joint's move costs, where it was seen, and which moves no clip attests."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from motionmind._typing import Floats, Int32s
from motionmind.corpus.corpus import Corpus
from motionmind.discretize import StateSpace
from motionmind.geometry import rotations as rot
from motionmind.grammar.coordination import Coordination
from motionmind.grammar.grammar import Grammar
from motionmind.search.problem import Problem, places


@dataclass(frozen=True, eq=False)
class CostBreakdown:
    """The cost of a path of T moves of L chains, taken apart: all but `likelihood`, `degrees` and names add up to it.

    Attributes:
        moves: nats for each chain's move, bridge or wait [T, L].
        coordination: nats for the state that each chain arrives in, or the move that it makes, beside its parent's:
            lambda * -log P [T, L].
        guide: nats for the state that each chain arrives in, for its departure from what walks expect; 0 in the last
            move [T, L].
        per_move: tau, nats for each move.
        likelihood: P(state arrived in | state left), as the corpus counts it; 0 where it attests no such move [T, L].
        degrees: the angle between the two states [T, L].
        names: names of the states of each posture [T + 1][L].
    """

    moves: Floats
    coordination: Floats
    guide: Floats
    per_move: float
    likelihood: Floats
    degrees: Floats
    names: tuple[tuple[str, ...], ...]

    @property
    def total(self) -> float:
        """The cost of the path, nats."""
        return float(self.moves.sum() + self.coordination.sum() + self.guide.sum()) + self.per_move * len(self.moves)


def break_down_cost(
    path: Int32s,
    problem: Problem,
    grammar: Grammar,
    space: StateSpace,
    network: Coordination,
    factor: float,
) -> CostBreakdown:
    """Return the cost of a path, taken apart.

    Args:
        path: states of the problem [T + 1, L].
        problem: the problem that was searched, whose costs come from the grammar.
        grammar: what was learned.
        space: the states of each chain.
        network: how the chains' states of the problem coordinate.
        factor: factor of the network's -log P in the problem's costs.
    """
    held, graph = problem.model_with_waits(), grammar.transitions
    at = places(problem.model, path)
    shape = (len(path) - 1, len(grammar.chains))
    moves, together, guide = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    edges, timed = graph.edges(at), problem.timed_costs(len(path) - 1)
    likelihood = np.where(edges >= 0, np.exp(-graph.weights("conditional")[edges]), 0.0)
    if timed is not None:
        guide[:] = np.take_along_axis(timed[1:], problem.model.starts[:-1] + path[1:], axis=1)
    for t, chain in np.ndindex(*shape):
        before, after, parent = int(path[t, chain]), int(path[t + 1, chain]), int(network.parents[chain])
        row = held.starts[chain] + before
        first, last = held.indptr[row], held.indptr[row + 1]
        moves[t, chain] = held.costs[first + np.searchsorted(held.targets[first:last], after)]
        if parent >= 0:
            together[t, chain] = factor * network.cost(chain, int(path[t + 1, parent]), after, held.starts)
    orientations = space.decode(at)
    degrees = np.degrees(rot.angle(orientations[:-1], orientations[1:]))
    names = tuple(tuple(space.label(chain, int(state)) for chain, state in enumerate(row)) for row in at)
    return CostBreakdown(moves, together, guide, problem.rules.per_move, likelihood, degrees, names)


@dataclass(frozen=True)
class Bridge:
    """A move of a joint that the corpus does not attest.

    Attributes:
        joint: the joint's name.
        move: number of the move, from 0.
        degrees: angle between the two states.
        price: nats.

    >>> from motionmind import Bridge
    >>> Bridge("left_hip", move=2, degrees=12.5, price=12.5).price
    12.5
    """

    joint: str
    move: int
    degrees: float
    price: float


@dataclass(frozen=True)
class Wait:
    """A move that a joint spends waiting at its goal for the others.

    Attributes:
        joint: the joint's name.
        move: number of the move, from 0.
        price: nats.

    >>> from motionmind import Wait
    >>> Wait("left_wrist", move=3, price=1.0).joint
    'left_wrist'
    """

    joint: str
    move: int
    price: float


@dataclass(frozen=True)
class Source:
    """A place in a corpus that attests a joint's move.

    Attributes:
        clip: the clip's name.
        posture: number of the posture in the clip from which the move starts.
        corpus: the corpus that the clip comes from.
        mirrored: whether the clip was learned with left and right exchanged.
        reversed: whether the clip was learned backwards: the move leads to the posture before.
        seconds: that posture's time in its recording.
        reconstructed: whether the joint was not recorded right there, and was interpolated when the corpus was built.

    >>> from motionmind import Source
    >>> Source("plies", posture=12, corpus="ballet", seconds=4.8).clip
    'plies'
    """

    clip: str
    posture: int
    corpus: str = ""
    mirrored: bool = False
    reversed: bool = False
    seconds: float = 0.0
    reconstructed: bool = False


def trace_path(
    path: Int32s, grammar: Grammar, corpus: Corpus, weights: Floats, wait: float, bridge_price: float
) -> tuple[float, tuple[Bridge, ...], tuple[Wait, ...], tuple[tuple[Source | None, ...], ...]]:
    """Trace each move of a path to the corpus.

    Args:
        path: states of the grammar's chains [T + 1, L].
        grammar: what was learned.
        corpus: what it was learned from.
        weights: of the grammar's transitions, in the scheme that was searched [E], nats.
        wait: nats for each move that a chain waits at its goal.
        bridge_price: nats for each degree of a bridge.

    Returns:
        The share of moves that are attested, the bridges, the waits, and the sources [T][L], as in `Tween`.
    """
    graph = grammar.transitions
    bridges, waits, sources = [], [], []
    for move, ((before, after), edges) in enumerate(zip(pairwise(path), graph.edges(path), strict=True)):
        row: list[Source | None] = []
        for chain, joint in enumerate(grammar.chains):
            edge = edges[chain]
            seen = (int(graph.attests[edge]), int(graph.arrives[edge])) if edge >= 0 else None
            row.append(source_of(corpus, *seen, joint) if seen else None)
            holds_goal = before[chain] == after[chain] == path[-1, chain]
            if holds_goal and (edge < 0 or wait < weights[edge]):
                waits.append(Wait(joint, move, wait))
            elif edge < 0:
                degrees = grammar.bridges.span(graph.starts[chain] + before[chain], after[chain])
                bridges.append(Bridge(joint, move, degrees, bridge_price * degrees))
        sources.append(tuple(row))
    attested = [source is not None for row in sources for source in row]
    return float(np.mean(attested)) if attested else 1.0, tuple(bridges), tuple(waits), tuple(sources)


def source_of(corpus: Corpus, posture: int, to: int, joint: str = "") -> Source:
    """Return the place in a corpus where a move leads from posture `posture` to posture `to`, by their numbers.

    Args:
        corpus: the corpus.
        posture: number of the posture.
        to: number of the posture that follows.
        joint: the joint that moves; "" for the whole body.
    """
    clip, times = corpus.clip_of(posture), sorted(corpus.times[[posture, to]].tolist())
    return Source(
        clip.name,
        posture - clip.start,
        clip.corpus or corpus.name,
        clip.mirrored,
        to < posture,
        float(corpus.times[posture]),
        clip.is_reconstructed(joint, *times),
    )


def gap_of(cost: float, lower_bound: float) -> float:
    """Return the share of a cost that is not proven to be needed: 0 where the bound meets it. Both in nats."""
    return 0.0 if cost <= lower_bound else (cost - lower_bound) / abs(cost)
