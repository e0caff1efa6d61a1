"""A transition to record: one move between two postures of a corpus; and the grammar with it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from motionmind._typing import Ints, States
from motionmind.corpus.corpus import FACING
from motionmind.grammar.grammar import learn
from motionmind.learned.model import LearnedCorpus
from motionmind.synthesis.timeline import usual


class Transition(NamedTuple):
    """A move from posture `begin` of a corpus to its posture `end`, by index.

    If the facing is free, the body keeps its heading.
    """

    begin: int
    end: int


def with_transitions(learned: LearnedCorpus, transitions: list[Transition]) -> LearnedCorpus:
    """Learn the grammar of a corpus again as if each transition had been recorded as a clip.

    These clips have the greatest weight of a clip, and their moves the usual duration. Only the grammar changes:
    states, movement, posture statistics and pace stay.
    """
    if not transitions:
        return learned
    corpus, moves = learned.corpus, learned.corpus.moves
    states = np.concatenate([np.asarray(learned.states), *(states_of(learned, one) for one in transitions)])
    begins: Ints = len(corpus) + 2 * np.arange(len(transitions))
    ones = np.ones(len(transitions))
    grammar = learn(
        corpus.chains,
        corpus.chain_parents,
        learned.space.centres,
        states,
        learned.space.sizes,
        np.concatenate([moves.begins, begins]),
        np.concatenate([moves.seconds, ones * usual(learned.grammar.transitions)]),
        ends=np.concatenate([moves.ends, begins + 1]),
        weights=np.concatenate([moves.weights, ones]),
        posture_weights=np.concatenate([corpus.weights, ones, ones]),
    )
    return replace(learned, grammar=grammar)


def states_of(learned: LearnedCorpus, transition: Transition) -> States:
    """Return the states of a transition's two postures [2, L]."""
    states = np.array(learned.states[[transition.begin, transition.end]])
    if learned.corpus.chains[-1] == FACING:
        states[1, -1] = states[0, -1]
    return states
