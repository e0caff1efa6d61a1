"""The grammar of a corpus, in the flat arrays from which searches build their costs."""

from __future__ import annotations

from dataclasses import dataclass

from motionmind._typing import Floats, Int32s, Ints
from motionmind.executors.here import this_process
from motionmind.executors.team import Team
from motionmind.grammar.bridges import Bridges, find_bridges
from motionmind.grammar.coordination import Coordination, learn_coordination
from motionmind.grammar.transitions import Transitions, count_transitions


@dataclass(frozen=True, eq=False)
class Grammar:
    """The transitions of each chain, the bridges between its states, and the coordination of chains.

    Attributes:
        chains: names [L]: the skeleton's joints, then "facing" if the body's heading is a chain of its own.
        centres: orientation of each state of each chain [G, 4].
        transitions: the joint graphs.
        bridges: unattested moves between neighbouring states.
        coordination: P(state of a joint | state of its parent), from the corpus's counts.
    """

    chains: tuple[str, ...]
    centres: Floats
    transitions: Transitions
    bridges: Bridges
    coordination: Coordination


def learn(
    chains: tuple[str, ...],
    parents: Ints,
    centres: Floats,
    states: Int32s,
    sizes: Ints,
    begins: Ints,
    seconds: Floats,
    *,
    ends: Ints | None = None,
    weights: Floats | None = None,
    posture_weights: Floats | None = None,
    team: Team | None = None,
) -> Grammar:
    """Learn a grammar from N postures of a corpus, with L chains and M moves between postures.

    Args:
        chains: names [L]; a last one called "facing" is pooled over the headings that it turns from, and has no
            coordination.
        parents: parent chain [L], or -1.
        centres: orientation of each state, chain after chain [sum of sizes, 4].
        states: state of each chain in each posture [N, L]; every state of a joint occurs.
        sizes: number of states in each chain [L].
        begins: the posture that each move leads from [M].
        seconds: duration of each move [M].
        ends: the posture that each move leads to [M]; None for the next one.
        weights: weight of each move [M]; None for 1.
        posture_weights: weight of each posture [N]; None for 1.
        team: threads, one job per chain; None for the current thread.
    """
    team = team or this_process()
    joints = len(chains) - (chains[-1] == "facing")
    transitions = count_transitions(
        states,
        sizes,
        begins,
        seconds,
        joints if joints < len(chains) else None,
        ends=ends,
        weights=weights,
        posture_weights=posture_weights,
        team=team,
    )
    coordination = learn_coordination(chains[:joints], parents, states, sizes, posture_weights, team)
    return Grammar(chains, centres, transitions, find_bridges(centres, transitions, team), coordination)
