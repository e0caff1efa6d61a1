"""What a path is charged for, joint by joint and move by move."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.corpus.corpus import Corpus
from motionmind.discretize import StateSpace
from motionmind.geometry import rotations as rot
from motionmind.grammar.coordination import Coordination
from motionmind.grammar.grammar import Grammar
from motionmind.search.problem import Model, Rules, places, with_waits
from motionmind.search.solve import Certificate


@dataclass(frozen=True, eq=False)
class CostBreakdown:
    """The cost of a path of T moves of L chains, taken apart: `moves`, `coordination` and `per_move` for each move add
    up to it.

    Attributes:
        moves: nats for each chain's move, bridge or wait [T, L].
        coordination: nats for the state that each chain arrives in, or the move that it makes, beside its parent's:
            lambda * -log P [T, L].
        per_move: tau, nats for each move.
        likelihood: P(state arrived in | state left), as the corpus counts it; 0 where it attests no such move [T, L].
        degrees: the angle between the two states [T, L].
        names: what people call the states of each posture, [T + 1][L].
    """

    moves: Floats
    coordination: Floats
    per_move: float
    likelihood: Floats
    degrees: Floats
    names: tuple[tuple[str, ...], ...]

    @property
    def total(self) -> float:
        """The cost of the path, nats."""
        return float(self.moves.sum() + self.coordination.sum()) + self.per_move * len(self.moves)


def break_down_cost(
    path: Int32s,
    model: Model,
    goal: Ints,
    rules: Rules,
    grammar: Grammar,
    space: StateSpace,
    net: Coordination,
    lambda_: float,
) -> CostBreakdown:
    """What `path` [T + 1, L] costs in a model that was made of a grammar, with the factor `lambda_` of `net`."""
    held, graph, at = with_waits(model, goal, rules.wait), grammar.transitions, places(model, path)
    probability = np.exp(-graph.weights("conditional"))
    shape = (len(path) - 1, len(grammar.chains))
    moves, together, likelihood = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for t, chain in np.ndindex(*shape):
        before, after, parent = int(path[t, chain]), int(path[t + 1, chain]), int(net.parents[chain])
        row = held.starts[chain] + before
        first, last = held.indptr[row], held.indptr[row + 1]
        moves[t, chain] = held.costs[first + np.searchsorted(held.targets[first:last], after)]
        if parent >= 0:
            together[t, chain] = lambda_ * net.cost(chain, int(path[t + 1, parent]), after, held.starts)
        edge = graph.edge(chain, int(at[t, chain]), int(at[t + 1, chain]))
        likelihood[t, chain] = probability[edge] if edge >= 0 else 0.0
    orientations = space.decode(at)
    degrees = np.degrees(rot.angle(orientations[:-1], orientations[1:]))
    names = tuple(tuple(space.label(chain, int(state)) for chain, state in enumerate(row)) for row in at)
    return CostBreakdown(moves, together, rules.per_move, likelihood, degrees, names)


@dataclass(frozen=True)
class Bridge:
    """A move of a joint that the corpus does not attest: `move` counts from 0, `price` is in nats."""

    joint: str
    move: int
    degrees: float
    price: float


@dataclass(frozen=True)
class Wait:
    """A move that a joint spends waiting at its goal for the others, at `price` nats."""

    joint: str
    move: int
    price: float


@dataclass(frozen=True)
class Source:
    """Where a move of a joint was seen.

    Attributes:
        clip: the clip's name.
        posture: the number of the posture there from which it was made.
        corpus: the corpus that the clip comes from.
        mirrored: whether it was seen with left and right exchanged.
        reversed: whether it was seen played backwards: it leads to the posture before.
        seconds: that posture's time in its recording.
    """

    clip: str
    posture: int
    corpus: str = ""
    mirrored: bool = False
    reversed: bool = False
    seconds: float = 0.0


def trace_path(
    certificate: Certificate, grammar: Grammar, corpus: Corpus, weights: Floats, wait: float, bridge_price: float
) -> tuple[float, tuple[Bridge, ...], tuple[Wait, ...], tuple[tuple[Source | None, ...], ...]]:
    """What a path is made of: the share attested, bridges, waits, and sources, as in Tween.

    `weights` [E] are those of the grammar's transitions in the scheme that was searched.
    """
    graph, path = grammar.transitions, certificate.path
    bridges, waits, sources = [], [], []
    for move, (before, after) in enumerate(pairwise(path)):
        row: list[Source | None] = []
        for chain, joint in enumerate(grammar.chains):
            edge = graph.edge(chain, before[chain], after[chain])
            row.append(source_of(corpus, int(graph.attests[edge]), int(graph.arrives[edge])) if edge >= 0 else None)
            holds_goal = before[chain] == after[chain] == path[-1, chain]
            if holds_goal and (edge < 0 or wait < weights[edge]):
                waits.append(Wait(joint, move, wait))
            elif edge < 0:
                degrees = grammar.bridges.span(graph.starts[chain] + before[chain], after[chain])
                bridges.append(Bridge(joint, move, degrees, bridge_price * degrees))
        sources.append(tuple(row))
    attested = [source is not None for row in sources for source in row]
    return float(np.mean(attested)) if attested else 1.0, tuple(bridges), tuple(waits), tuple(sources)


def source_of(corpus: Corpus, posture: int, to: int) -> Source:
    """The place in a corpus where a move leads from one of its postures `to` another."""
    clip = corpus.clip_of(posture)
    return Source(
        clip.name,
        posture - clip.start,
        clip.corpus or corpus.name,
        clip.mirrored,
        to < posture,
        float(corpus.times[posture]),
    )
