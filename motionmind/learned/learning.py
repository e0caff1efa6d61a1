"""Learning from a corpus: its states, grammar, posture statistics, pace and plausibility limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from motionmind._typing import Floats, States
from motionmind.corpus.corpus import FACING, Corpus
from motionmind.corpus.kept import Kept
from motionmind.discretize.protocol import ByJoint, Discretization
from motionmind.discretize.states import StateSpace, nearest
from motionmind.errors import CorpusError
from motionmind.executors.workshop import Workshop
from motionmind.geometry import rotations as rot
from motionmind.grammar.grammar import Grammar
from motionmind.grammar.grammar import learn as learn_grammar
from motionmind.learned.gauge import Gauge
from motionmind.learned.pace import Pace, measure_pace, refit_pace
from motionmind.learned.plausibility import Plausibility, learn_plausibility
from motionmind.learned.posture_statistics import PostureStatistics, learn_posture_statistics
from motionmind.walks.evidence import learn_trust

MAX_STATES_LEARNED = 50_000  # per joint: a search among them takes about 6 GB
MAX_FACINGS = 10_000  # every facing shares the transitions of all others


@dataclass(frozen=True, eq=False)
class Learned:
    """The result of learning from a corpus of N postures, with L joint chains.

    Attributes:
        corpus: the movement learned from.
        space: the states of each chain.
        states: states of the corpus's postures [N, L].
        grammar: joint graphs, bridges and coordination.
        statistics: posture statistics: orientations, travel and support.
        pace: speeds, and durations by displacement.
        plausibility: limits of plausible movement.
        gauge: measurements of pace per clip.
    """

    corpus: Corpus
    space: StateSpace
    states: States
    grammar: Grammar
    statistics: PostureStatistics
    pace: Pace
    plausibility: Plausibility
    gauge: Gauge


def learn(corpus: Corpus, discretization: Discretization, workshop: Workshop | None = None) -> Learned:
    """Learn from a corpus.

    Args:
        corpus: the movement.
        discretization: maps orientations to states; states without a posture are dropped.
        workshop: threads, and room for large arrays; None for the current thread and memory. It never changes results.

    Raises:
        CorpusError: a joint has more than MAX_STATES_LEARNED states, or the facing more than MAX_FACINGS.
        OSError: the workshop's disk is full.
    """
    joints = corpus.skeleton.names
    # Tolerances do not depend on the postures: fitting to one reveals them, and faulty settings, before the long fit.
    tolerances = discretization.fit(joints, corpus.to_chains(corpus.rotations[:1])[:, : len(joints)]).tolerances
    if corpus.facing == "free":
        _check_facing(corpus, float(tolerances[0]))
    if isinstance(discretization, ByJoint):
        return _learn(Kept.none(corpus), partial(discretization.fit_joint, joints), workshop)
    whole = discretization.fit(joints, corpus.to_chains(corpus.rotations)[:, : len(joints)])
    return _learn(Kept.none(corpus), lambda joint, _: whole.alone(joint), workshop)


def learn_in(corpus: Corpus, space: StateSpace, workshop: Workshop | None = None) -> Learned:
    """Learn from a corpus in known states; states without a posture are dropped.

    Args:
        corpus: the movement.
        space: the states of each chain, learned from a corpus with the same joints and kind of facing.
        workshop: as in `learn`.
    """
    return _learn(Kept.none(corpus), lambda joint, _: space.alone(joint), workshop)


def learn_changed(before: Learned, kept: Kept, workshop: Workshop | None = None) -> Learned:
    """Learn from a changed corpus in the states of an earlier one: the same as `learn_in`, to the last bit.

    States and measurements of kept clips are reused. Only new clips are discretized and measured, and whatever depends
    on all clips is refitted.

    Args:
        before: result for the earlier corpus.
        kept: the clips shared with it (`motionmind.corpus.kept`).
        workshop: as in `learn`.
    """
    if kept.before is None:
        return learn_in(kept.corpus, before.space, workshop)
    return _learn(kept, lambda joint, _: before.space.alone(joint), workshop, before)


def _learn(
    kept: Kept, fit: Callable[[int, Floats], StateSpace], workshop: Workshop | None, before: Learned | None = None
) -> Learned:
    """Learn from a corpus; `fit` maps a joint's index and its orientations in new clips [n, 4] to its states.

    Results in `before` for kept clips are reused.
    """
    workshop, corpus = workshop or Workshop(), kept.corpus
    states = workshop.empty((len(corpus), len(corpus.chains)), np.int32)

    def visit(joint: int) -> StateSpace:
        orientations = kept.new.chain(joint) if kept.new else np.zeros((0, 4))
        whole, found = fit(joint, orientations), np.empty(len(corpus), dtype=np.int32)
        old = before.states[:, joint] if before else None
        kept.join(old, whole.assign(orientations[:, None])[:, 0], kept.postures, found)
        smaller, states[:, joint] = _keep_visited(whole, found)
        return smaller

    space = StateSpace.joined(list(workshop.map(visit, range(len(corpus.skeleton)))))
    _check_size(corpus, space)
    if corpus.facing == "free":
        space, states[:, -1] = _with_facing(space, corpus.chain(len(corpus.skeleton)))
    return _learn_all(kept, space, states, workshop, before)


def outside(corpus: Corpus, space: StateSpace) -> tuple[float, str, float]:
    """Return the share of a corpus's orientations farther from every state of their joint than its tolerance; the joint
    that exceeds its tolerance most, and by how many degrees.

    Args:
        corpus: the movement.
        space: states of its chains.
    """
    joints = len(corpus.skeleton)
    count, worst, farthest = 0, 0, 0.0
    for joint in range(joints):
        _, cosines = nearest(corpus.chain(joint), space.of(joint))
        degrees = np.degrees(2.0 * np.arccos(np.clip(cosines, 0.0, 1.0)))
        count += int(np.sum(degrees > space.tolerances[joint] + 1e-3))
        if degrees.max() - space.tolerances[joint] > farthest:
            worst, farthest = joint, float(degrees.max() - space.tolerances[joint])
    return count / (len(corpus) * joints), space.names[worst], farthest


def learn_from_states(corpus: Corpus, space: StateSpace, states: States, workshop: Workshop | None = None) -> Learned:
    """Learn from a corpus whose states are given.

    Args:
        corpus: the movement.
        space: the states of each chain.
        states: states of the corpus's postures [N, L].
        workshop: as in `learn`.
    """
    return _learn_all(Kept.none(corpus), space, states, workshop or Workshop())


def _learn_all(
    kept: Kept, space: StateSpace, states: States, workshop: Workshop, before: Learned | None = None
) -> Learned:
    """Learn from a corpus whose states are given; reuse results in `before` for kept clips."""
    corpus = kept.corpus
    moves = corpus.moves
    grammar = learn_grammar(
        corpus.chains,
        corpus.chain_parents,
        space.centres,
        states,
        space.sizes,
        moves.begins,
        moves.seconds,
        ends=moves.ends,
        weights=moves.weights,
        posture_weights=corpus.weights,
        team=workshop.team,
    )
    statistics_before, gauge_before = (before.statistics, before.gauge) if before else (None, None)

    def pace_of() -> tuple[Gauge, Pace]:
        gauge = measure_pace(kept, gauge_before, workshop)
        return gauge, refit_pace(corpus, gauge)

    # These overlap well: one makes many short NumPy calls, the other long compiled loops without the interpreter lock.
    (gauge, pace), statistics = workshop.both(
        pace_of, partial(learn_posture_statistics, corpus, workshop, kept, statistics_before)
    )
    statistics = replace(statistics, trust=learn_trust(corpus, statistics, workshop))
    plausibility = learn_plausibility(corpus, pace.fastest)
    return Learned(corpus, space, states, grammar, statistics, pace, plausibility, gauge)


def _keep_visited(space: StateSpace, states: States) -> tuple[StateSpace, States]:
    """Drop one joint's states that no posture visits; return the smaller space and the states [N] renumbered in it."""
    seen = np.unique(states)
    labels = [[space.labels[0][s] for s in seen] if space.labels[0] else []]
    smaller = StateSpace.of_joints(
        space.names, [space.of(0)[seen]], kind=space.kind, tolerances=space.tolerances, labels=labels
    )
    return smaller, np.searchsorted(seen, states).astype(np.int32)


def _check_size(corpus: Corpus, space: StateSpace) -> None:
    """Raise a CorpusError if a search among a joint's states would take too much memory."""
    largest = int(np.argmax(space.sizes))
    if space.sizes[largest] > MAX_STATES_LEARNED:
        raise CorpusError(
            f"corpus {corpus.name!r}: {space.names[largest]} has {space.sizes[largest]} states within "
            f"{space.tolerances[largest]:g} degrees, and a joint can have {MAX_STATES_LEARNED}; "
            "give it a coarser tolerance"
        )


def _check_facing(corpus: Corpus, tolerance: float) -> None:
    """Raise a CorpusError if the circle has too many states for a root of this tolerance, degrees."""
    if _facings(tolerance) > MAX_FACINGS:
        raise CorpusError(
            f"corpus {corpus.name!r}: the facing has {_facings(tolerance)} states within {tolerance:g} degrees, and "
            f"can have {MAX_FACINGS}; give {corpus.skeleton.names[0]} a coarser tolerance"
        )


def _facings(tolerance: float) -> int:
    """Return the number of the facing's states for a root of this tolerance, degrees."""
    return max(8, round(360.0 / tolerance))


def _with_facing(space: StateSpace, turns: Floats) -> tuple[StateSpace, States]:
    """Add a joint chain for the facing to a state space; return it with the facing states [N] of the turns [N, 4].

    The facing's states divide the circle evenly, into steps about as wide as the root's tolerance.
    """
    count = _facings(float(space.tolerances[0]))
    ring = rot.canonical(rot.about_vertical(np.arange(count) * 2.0 * np.pi / count))
    wider = StateSpace.of_joints(
        (*space.names, FACING),
        [*(space.of(joint) for joint in range(len(space))), ring],
        kind=space.kind,
        tolerances=np.append(space.tolerances, 360.0 / count),
        labels=(*space.labels, ()),
    )
    steps = np.round(rot.heading(turns) / (2.0 * np.pi / count)).astype(np.int32) % count
    return wider, steps
