"""Learning from a corpus: its states, grammar, carriage, pace and limits of plausibility."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from motionmind._typing import Floats, States
from motionmind.corpus.corpus import FACING, Corpus
from motionmind.discretize import Discretization, StateSpace
from motionmind.discretize.protocol import ByJoint
from motionmind.discretize.states import nearest
from motionmind.errors import CorpusError
from motionmind.executors.workshop import Workshop
from motionmind.geometry import rotations as rot
from motionmind.grammar.grammar import Grammar
from motionmind.grammar.grammar import learn as learn_grammar
from motionmind.learned.carriage import Carriage, learn_carriage
from motionmind.learned.pace import Pace, learn_pace
from motionmind.learned.plausibility import Plausibility, learn_plausibility

MOST_STATES_LEARNED = 50_000  # of a joint: a search among them takes some 6 GB
MOST_FACINGS = 10_000  # each of which makes all turns that any makes


@dataclass(frozen=True, eq=False)
class Learned:
    """The result of learning from a corpus of N postures, with L chains.

    Attributes:
        corpus: the movement that was learned from.
        space: the states of each chain.
        states: states of the corpus's postures [N, L].
        grammar: joint graphs, bridges and coordination.
        carriage: how the corpus's bodies hold themselves, travel and stand.
        pace: how long they take for how far a way.
        plausibility: what their movement shows a viewer at most.
    """

    corpus: Corpus
    space: StateSpace
    states: States
    grammar: Grammar
    carriage: Carriage
    pace: Pace
    plausibility: Plausibility


def learn(corpus: Corpus, discretization: Discretization, workshop: Workshop | None = None) -> Learned:
    """Learn from a corpus.

    Args:
        corpus: the movement.
        discretization: how orientations become states; only states with a posture in them are kept.
        workshop: threads, and room for large arrays; None for this thread and memory. What is learned is the same.

    Raises:
        CorpusError: a joint has more than MOST_STATES_LEARNED states, or the facing more than MOST_FACINGS.
        OSError: the workshop's disk is full.
    """
    joints = corpus.skeleton.names
    # Tolerances do not depend on the postures, so one shows them, and faulty settings, before all are compared.
    tolerances = discretization.fit(joints, corpus.to_chains(corpus.rotations[:1])[:, : len(joints)]).tolerances
    if corpus.facing == "free":
        _check_facing(corpus, float(tolerances[0]))
    if isinstance(discretization, ByJoint):
        return _learn(corpus, partial(discretization.fit_joint, joints), workshop)
    whole = discretization.fit(joints, corpus.to_chains(corpus.rotations)[:, : len(joints)])
    return _learn(corpus, lambda joint, _: whole.alone(joint), workshop)


def learn_in(corpus: Corpus, space: StateSpace, workshop: Workshop | None = None) -> Learned:
    """Learn from a corpus in states that are known, those of them with a posture in them.

    Args:
        corpus: the movement.
        space: the states of each chain, as they were learned from a corpus on the same joints, facing alike.
        workshop: as of `learn`.
    """
    return _learn(corpus, lambda joint, _: space.alone(joint), workshop)


def _learn(corpus: Corpus, fit: Callable[[int, Floats], StateSpace], workshop: Workshop | None) -> Learned:
    """Learn from a corpus; `fit` gives the states of a joint, of its index and its orientations [N, 4]."""
    workshop = workshop or Workshop()
    states = workshop.empty((len(corpus), len(corpus.chains)), np.int32)

    def visit(joint: int) -> StateSpace:
        orientations = corpus.chain(joint)
        smaller, states[:, joint] = _keep_visited(fit(joint, orientations), orientations)
        return smaller

    space = StateSpace.joined(list(workshop.map(visit, range(len(corpus.skeleton)))))
    _check_size(corpus, space)
    if corpus.facing == "free":
        space, states[:, -1] = _with_facing(space, corpus.chain(len(corpus.skeleton)))
    return learn_from_states(corpus, space, states, workshop)


def outside(corpus: Corpus, space: StateSpace) -> tuple[float, str, float]:
    """Return the share of a corpus's orientations that are in no state of their joint, for they are farther from all of
    them than its tolerance; the joint that is farthest, and by how many degrees.

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
    """Learn from a corpus whose postures have states.

    Args:
        corpus: the movement.
        space: the states of each chain.
        states: states of the corpus's postures [N, L].
        workshop: as of `learn`.
    """
    workshop = workshop or Workshop()
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
    # One calls NumPy for little at a time, and the other compiled loops for long, which leave the interpreter free.
    pace, carriage = workshop.both(partial(learn_pace, corpus), partial(learn_carriage, corpus, workshop))
    return Learned(corpus, space, states, grammar, carriage, pace, learn_plausibility(corpus, pace.fastest))


def _keep_visited(space: StateSpace, orientations: Floats) -> tuple[StateSpace, States]:
    """Return the state space of one joint without states that no posture is in, and the states [N] in it of its
    orientations [N, 4].

    Nothing is known of a state without postures.
    """
    states = space.assign(orientations[:, None])[:, 0]
    seen = np.unique(states)
    labels = [[space.labels[0][s] for s in seen] if space.labels[0] else []]
    smaller = StateSpace.of_joints(
        space.names, [space.of(0)[seen]], kind=space.kind, tolerances=space.tolerances, labels=labels
    )
    return smaller, np.searchsorted(seen, states).astype(np.int32)


def _check_size(corpus: Corpus, space: StateSpace) -> None:
    """Raise a CorpusError if a search among a joint's states would take too much memory."""
    largest = int(np.argmax(space.sizes))
    if space.sizes[largest] > MOST_STATES_LEARNED:
        raise CorpusError(
            f"corpus {corpus.name!r}: {space.names[largest]} has {space.sizes[largest]} states within "
            f"{space.tolerances[largest]:g} degrees, and a joint can have {MOST_STATES_LEARNED}; "
            "give it a coarser tolerance"
        )


def _check_facing(corpus: Corpus, tolerance: float) -> None:
    """Raise a CorpusError if the circle has too many states for a root of this tolerance, degrees."""
    if _facings(tolerance) > MOST_FACINGS:
        raise CorpusError(
            f"corpus {corpus.name!r}: the facing has {_facings(tolerance)} states within {tolerance:g} degrees, and "
            f"can have {MOST_FACINGS}; give {corpus.skeleton.names[0]} a coarser tolerance"
        )


def _facings(tolerance: float) -> int:
    """Return the number of the facing's states for a root of this tolerance, degrees."""
    return max(8, round(360.0 / tolerance))


def _with_facing(space: StateSpace, turns: Floats) -> tuple[StateSpace, States]:
    """Return the state space with a chain for the facing, and the states [N] in it of the corpus's turns [N, 4].

    The facing's states are equal steps of a circle, about as wide as the root's tolerance.
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
