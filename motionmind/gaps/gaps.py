"""Find the gaps of a corpus: the worst-connected joint graphs, and the transitions that would most help its tweens."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import msgspec
import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.arguments import check_function, check_integer, check_mapping, check_type
from motionmind.body.motion import Posture
from motionmind.errors import MotionMindError
from motionmind.gaps.candidates import choose_candidates
from motionmind.gaps.sample import Solved, draw_pairs, solve_pairs
from motionmind.gaps.transition import Transition, states_of, with_transitions
from motionmind.geometry import rotations as rot
from motionmind.learned.model import LearnedCorpus
from motionmind.learned.summary import joined_pairs

N_TRIED = 4  # candidates that are solved exactly for each recommended transition
OnProgress = Callable[[int, int], None]  # called with grammars tried, and grammars in all, at most


class Energy(msgspec.Struct, frozen=True):
    """Means over a sample of tweens: the cost of the cheapest path and its lower bound, nats, and its bridges."""

    cost: float
    lower_bound: float
    bridges: float


class JointGap(msgspec.Struct, frozen=True):
    """The gaps of a joint graph.

    Attributes:
        joint: the joint.
        states: number of its states.
        apart: share of the sample's pairs that attested moves cannot join.
        bridges: bridges of a tween, on average.
    """

    joint: str
    states: int
    apart: float
    bridges: float


class Place(msgspec.Struct, frozen=True):
    """A posture of the corpus.

    Attributes:
        corpus: the corpus of its clip.
        clip: the clip.
        mirrored: whether left and right are exchanged.
        posture: its index in the clip, from 0.
        seconds: its time in the recording.
        near: the nearest named posture; "" if there is none.
        degrees: mean over joints of the angle to it.
    """

    corpus: str
    clip: str
    mirrored: bool
    posture: int
    seconds: float
    near: str
    degrees: float


class Recommended(msgspec.Struct, frozen=True):
    """A transition to record.

    Attributes:
        begin: its first posture.
        end: its last posture.
        joints: joints with a move that no clip attests.
        energy: energy of the sample once this transition and all before it are recorded.
        postures: indices of both postures in the corpus.
    """

    begin: Place
    end: Place
    joints: list[str]
    energy: Energy
    postures: tuple[int, int]


class Gaps(msgspec.Struct, frozen=True):
    """The gaps of a corpus.

    Attributes:
        corpus: its name.
        pairs: number of random pairs of postures in the sample.
        seed: seed of their random choice.
        energy: energy of the sample.
        joints: the joint graphs, the worst first.
        transitions: transitions to record, in this order.

    >>> from motionmind import Engine
    >>> from motionmind.gaps import find_gaps
    >>> gaps = find_gaps(Engine.load("macarena"), pairs=4, count=1)
    >>> gaps.pairs, len(gaps.joints)
    (4, 24)
    """

    corpus: str
    pairs: int
    seed: int
    energy: Energy
    joints: list[JointGap]
    transitions: list[Recommended]


def find_gaps(
    learned: LearnedCorpus,
    pairs: int = 100,
    count: int = 3,
    seed: int = 0,
    *,
    named: Mapping[str, Posture] | None = None,
    on_progress: OnProgress | None = None,
) -> Gaps:
    """Find the worst-connected joint graphs, and the transitions that would lower a sample's cost most.

    Transitions are chosen one by one: for each of the `N_TRIED` most promising, learn the grammar again with it and
    solve the sample again; the best transition stays.

    Args:
        learned: the learned corpus.
        pairs: number of random pairs of postures to join.
        count: number of transitions to recommend; fewer if no other helps.
        seed: seed of the random choice.
        named: postures by name, on any skeleton.
        on_progress: called before each grammar is tried.

    Raises:
        MotionMindError: a number is out of its range, or the corpus has a single posture.

    >>> from motionmind import Engine
    >>> from motionmind.gaps import find_gaps
    >>> gaps = find_gaps(Engine.load("macarena"), pairs=4, count=1)
    >>> all(one.energy.cost < gaps.energy.cost for one in gaps.transitions)
    True
    """
    check_type("learned", learned, LearnedCorpus, wanted="a learned corpus, such as an Engine")
    check_mapping("named", named, or_none=True)
    check_function("on_progress", on_progress, or_none=True)
    for name, value, least, most in (("pairs", pairs, 1, 10_000), ("count", count, 0, 100)):
        check_integer(name, value)
        if not least <= value <= most:
            raise MotionMindError(f"{name} must be from {least} to {most}, not {value}")
    check_integer("seed", seed)
    sample = draw_pairs(learned.corpus, pairs, seed)
    first = best = solve_pairs(learned, sample)
    current, taken, found = learned, list[Transition](), list[Recommended]()
    for number in range(count):
        chosen: tuple[Transition, LearnedCorpus, Solved] | None = None
        longest = max(1, int(best.moves.max()))
        for at, candidate in enumerate(choose_candidates(current, sample, longest, N_TRIED, seed)):
            if on_progress:
                on_progress(number * N_TRIED + at, count * N_TRIED)
            tried = with_transitions(learned, [*taken, candidate])
            solved = solve_pairs(tried, sample)
            if _cost(solved) < _cost(chosen[2] if chosen else best):
                chosen = candidate, tried, solved
        if chosen is None:
            break
        transition, tried, best = chosen
        found.append(_recommend(current, transition, best, named or {}))
        taken.append(transition)
        current = tried
    return Gaps(learned.corpus.name, pairs, seed, _energy(first), _joint_gaps(learned, sample, first), found)


def _cost(solved: Solved) -> float:
    """Return the mean cost, rounded: rounding errors of sums must not decide."""
    return round(float(solved.costs.mean()), 9)


def _energy(solved: Solved) -> Energy:
    bridges = float(solved.bridged.sum(axis=1).mean())
    return Energy(float(solved.costs.mean()), float(solved.bounds.mean()), bridges)


def _joint_gaps(learned: LearnedCorpus, sample: Ints, solved: Solved) -> list[JointGap]:
    """Return the joint graphs, the worst first: by the share of unjoined pairs, then by bridges."""
    graph = learned.grammar.transitions
    apart = 1.0 - joined_pairs(learned.grammar, np.asarray(learned.states), sample).mean(axis=0)
    bridges = solved.bridged.mean(axis=0)
    gaps = [
        JointGap(joint, int(size), float(alone), float(bridged))
        for joint, size, alone, bridged in zip(learned.grammar.chains, graph.sizes(), apart, bridges, strict=True)
    ]
    return sorted(gaps, key=lambda gap: (-gap.apart, -gap.bridges, gap.joint))


def _recommend(
    learned: LearnedCorpus, transition: Transition, solved: Solved, named: Mapping[str, Posture]
) -> Recommended:
    """Describe a transition that the learned corpus lacks."""
    edges = learned.grammar.transitions.edges(states_of(learned, transition))[0]
    joints = [joint for joint, edge in zip(learned.grammar.chains, edges, strict=True) if edge < 0]
    begin, end = (_place(learned, posture, named) for posture in transition)
    return Recommended(begin, end, joints, _energy(solved), (transition.begin, transition.end))


def _place(learned: LearnedCorpus, posture: int, named: Mapping[str, Posture]) -> Place:
    """Describe a posture of the corpus by its clip and time, and by the nearest named posture."""
    corpus = learned.corpus
    clip = corpus.clip_of(posture)
    near = {
        name: float(np.degrees(rot.angle(_upright(corpus.rotations[posture]), _upright(one.rotations)).mean()))
        for name, one in named.items()
        if corpus.skeleton.difference(one.skeleton) is None
    }
    name = min(near, key=lambda name: (round(near[name], 6), name), default="")
    return Place(
        clip.corpus or corpus.name,
        clip.name,
        clip.mirrored,
        posture - clip.start,
        float(corpus.times[posture]),
        name,
        near.get(name, 0.0),
    )


def _upright(rotations: Floats) -> Floats:
    """Turn local rotations [J, 4] so that the body faces +Z."""
    out = np.array(rotations)
    out[0] = rot.mul(rot.about_vertical(-rot.heading(out[0])), out[0])
    return out
