"""The certificate in detail: the cost and source of each joint's move, and the moves that no clip attests."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.corpus import FACING, Corpus
from motionmind.credits.credit import Credit, add_up
from motionmind.discretize.states import StateSpace
from motionmind.geometry import rotations as rot
from motionmind.grammar.coordination import Coordination
from motionmind.grammar.grammar import Grammar
from motionmind.grammar.rows import searchsorted_rows
from motionmind.search.problem import Problem, places
from motionmind.tween.changes import describe_changes
from motionmind.tween.problem import TRANSITION, WAIT, kinds_of


@dataclass(frozen=True, eq=False)
class CostBreakdown:
    """The parts of a path's cost, T moves of L chains: `moves`, `coordination`, `guide` and `per_move` add up to it.

    Attributes:
        moves: nats for each chain's move, bridge or wait [T, L].
        coordination: nats for each chain's new state, or its move, given its parent's: lambda * -log P [T, L].
        guide: nats for the departure of each chain's new state from the orientation that corpus walks expect; 0 in the
            last move [T, L].
        per_move: tau, nats for each move.
        likelihood: P(next state | state), as counted in the corpus; 0 where it attests no such move [T, L].
        degrees: the angle between the two states [T, L].
        names: names of the states of each posture [T + 1][L].
        changes: each chain's move in words: the new state's name, or the direction if it has none; "" if still [T][L].
    """

    moves: Floats
    coordination: Floats
    guide: Floats
    per_move: float
    likelihood: Floats
    degrees: Floats
    names: tuple[tuple[str, ...], ...]
    changes: tuple[tuple[str, ...], ...]

    @property
    def total(self) -> float:
        """The cost of the path, nats."""
        return float(self.moves.sum() + self.coordination.sum() + self.guide.sum()) + self.per_move * len(self.moves)


def break_down_cost(
    path: Int32s,
    problem: Problem,
    grammar: Grammar,
    space: StateSpace,
    skeleton: Skeleton,
    network: Coordination,
    factor: float,
) -> CostBreakdown:
    """Break down the cost of a path.

    Args:
        path: states of the problem [T + 1, L].
        problem: the problem that was searched, whose costs come from the grammar.
        grammar: the learned grammar.
        space: the states of each chain.
        skeleton: the body.
        network: the coordination network over the problem's states.
        factor: factor of the network's -log P in the problem's costs.
    """
    held, graph = problem.model_with_waits(), grammar.transitions
    at = places(problem.model, path)
    before, after = path[:-1], path[1:]
    together, guide = np.zeros(after.shape), np.zeros(after.shape)
    edges, timed = graph.edges(at), problem.timed_costs(len(after))
    likelihood = np.where(edges >= 0, np.exp(-graph.weights("conditional")[edges]), 0.0)
    if timed is not None:
        guide[:] = np.take_along_axis(timed[1:], problem.model.starts[:-1] + after, axis=1)
    moves = held.costs[searchsorted_rows(held.indptr, held.targets, held.starts[:-1] + before, after)]
    children = np.flatnonzero(network.parents >= 0)
    above = after[:, network.parents[children]]
    together[:, children] = factor * network.cost(children, above, after[:, children], held.starts)
    orientations = space.decode(at)
    degrees = np.degrees(rot.angle(orientations[:-1], orientations[1:]))
    names = tuple(tuple(space.label(chain, state) for chain, state in enumerate(row)) for row in at.tolist())
    changes = describe_changes(space, skeleton, at, orientations)
    return CostBreakdown(moves, together, guide, problem.rules.per_move, likelihood, degrees, names, changes)


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
    """A move during which a joint waits at its goal for the others.

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
        posture: number, within the clip, of the posture where the move starts.
        corpus: the corpus that the clip comes from.
        mirrored: whether the clip was learned with left and right exchanged.
        reversed: whether the clip was learned backwards: the move leads to the posture before.
        seconds: that posture's time in its recording.
        reconstructed: whether the joint's recording has a gap there, interpolated when the corpus was built.

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
        grammar: the learned grammar.
        corpus: the corpus behind the grammar.
        weights: weights of the grammar's transitions in the scheme of the search [E], nats.
        wait: nats for each move that a chain waits at its goal.
        bridge_price: nats for each degree of a bridge.

    Returns:
        The share of attested moves, the bridges, the waits, and the sources [T][L], as in `Tween`.
    """
    graph = grammar.transitions
    edges, holds_goal = graph.edges(path), (path[:-1] == path[1:]) & (path[1:] == path[-1])
    kinds = kinds_of(edges, holds_goal, weights, wait)
    attested, bridges, waits = edges >= 0, [], []
    for move, chain in np.argwhere(kinds != TRANSITION).tolist():
        joint = grammar.chains[chain]
        if kinds[move, chain] == WAIT:
            waits.append(Wait(joint, move, wait))
        else:
            degrees = grammar.bridges.span(graph.starts[chain] + path[move, chain], path[move + 1, chain])
            bridges.append(Bridge(joint, move, degrees, bridge_price * degrees))
    seen, joints = edges[attested], [grammar.chains[chain] for chain in np.nonzero(attested)[1]]
    found = iter(sources_of(corpus, graph.attests[seen], graph.arrives[seen], joints))
    sources = tuple(tuple(next(found) if known else None for known in row) for row in attested.tolist())
    return float(np.mean(attested)) if attested.size else 1.0, tuple(bridges), tuple(waits), sources


def sources_of(corpus: Corpus, postures: Ints | Int32s, to: Ints | Int32s, joints: Sequence[str]) -> list[Source]:
    """Return the places in a corpus that attest moves between numbered postures.

    Args:
        corpus: the corpus.
        postures: number of each move's first posture [n].
        to: number of each move's last posture [n].
        joints: the joint that moves [n]; "" for the whole body.
    """
    clips, times = np.searchsorted(corpus.columns.starts, postures, side="right") - 1, corpus.times[[postures, to]]
    columns = (column.tolist() for column in (clips, postures, to, times[0], times.min(axis=0), times.max(axis=0)))
    out = []
    for number, posture, other, seconds, first, last, joint in zip(*columns, joints, strict=True):
        clip = corpus.clips[number]
        whence, reconstructed = clip.corpus or corpus.name, clip.is_reconstructed(joint, first, last)
        start, is_reversed = posture - clip.start, other < posture
        out.append(Source(clip.name, start, whence, clip.mirrored, is_reversed, seconds, reconstructed))
    return out


def sources_followed(
    sources: tuple[tuple[Source | None, ...], ...], followed: Bools
) -> tuple[tuple[Source | None, ...], ...]:
    """Return the sources [T][L] of the moves that the motion follows at both ends [T + 1, L]; None for the others."""
    seen = followed[:-1] & followed[1:]
    return tuple(
        tuple(source if shown else None for source, shown in zip(row, shows, strict=True))
        for row, shows in zip(sources, seen, strict=True)
    )


def mark_motion(motion: Motion, bridges: Sequence[Bridge], found: tuple[Credit, ...]) -> Motion:
    """Attach credits to a tween's motion and mark its bridged joints; the root for the facing, which it turns."""
    (insertion,) = motion.insertions
    root = motion.skeleton.names[0]
    named = ((root if bridge.joint == FACING else bridge.joint, bridge.move) for bridge in bridges)
    return replace(motion, insertions=(replace(insertion, bridged=tuple(dict.fromkeys(named)), credits=found),))


def gap_of(cost: float, lower_bound: float) -> float:
    """Return the optimality gap as a share of the cost: 0 where the bound (nats) meets the cost (nats)."""
    return 0.0 if cost <= lower_bound else (cost - lower_bound) / abs(cost)


def credit_tween(
    corpus: Corpus, sources: Sequence[Iterable[Source | None]], detail: Sequence[Source], times: Floats
) -> tuple[Credit, ...]:
    """Credit each clip in a tween with the time that the joints spend in moves that the clip attests.

    The passage that the tween follows counts as one more joint. The engine gets the time of unattested moves.

    Args:
        corpus: the corpus that was searched.
        sources: a place that attests each joint's move, or None [T][L].
        detail: places of the passage, at equal intervals of the tween.
        times: times of the moves [T + 1], seconds.

    Returns:
        The credits, the largest first; none where nothing moves.
    """
    seconds = np.diff(times)
    shares: list[tuple[Source | None, float]]
    shares = [(source, float(lasts)) for row, lasts in zip(sources, seconds, strict=True) for source in row]
    shares += [(source, float(seconds.sum()) / len(detail)) for source in detail]
    spent: dict[tuple[str, str] | None, float] = {}  # by corpus and clip; None for the engine
    for source, share in shares:
        clip = None if source is None else (source.corpus, source.clip)
        spent[clip] = spent.get(clip, 0.0) + share
    return add_up(_credit(corpus, clip, share) for clip, share in spent.items())


def _credit(corpus: Corpus, clip: tuple[str, str] | None, share: float) -> Credit:
    """Return a credit of this share for a clip, given as (corpus, name), or for the engine if `clip` is None."""
    if clip is None:
        return Credit(share)
    return replace(corpus.credit_of(corpus.clips_named(*clip)[-1]), share=share)
