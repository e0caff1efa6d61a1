"""Formulating a request: two postures and their request, as states and costs that the search reads."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.human import human23
from motionmind.body.motion import Motion, Posture, Velocity
from motionmind.corpus.clip import JointFlip
from motionmind.corpus.flips import find_flips
from motionmind.errors import MotionMindError, MotionMindWarning, SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.grammar.coordination import Coordination
from motionmind.grammar.grammar import Grammar
from motionmind.grammar.progression import fit_progression
from motionmind.grammar.schemes import Weights
from motionmind.learned.model import LearnedCorpus
from motionmind.realise.timeline import usual
from motionmind.retarget.joint_mapping import joint_mapping
from motionmind.retarget.retarget import to_human23
from motionmind.search.length import fewest_moves
from motionmind.search.problem import Model, Problem, Rules, Via
from motionmind.search.solve import MAX_CHAIN_STATES
from motionmind.tween.constraints import Constraint, constraints_of, restrict
from motionmind.tween.guide import find_detour, make_guide
from motionmind.tween.modes import find_place
from motionmind.tween.options import MAX_MOVES
from motionmind.tween.pacing import UsualTime, tolls, usual_times
from motionmind.tween.problem import build_model, lift_to_moves
from motionmind.tween.request import TweenRequest
from motionmind.tween.whole_body import nearest_posture
from motionmind.walks.passages import Place

_Movement = TypeVar("_Movement", Motion, Posture)

_SAME_POSTURE = 1.0  # degrees: tolerance for the rounding of files, between a posture and the frames that end in it


@dataclass(frozen=True, eq=False)
class Formulation:
    """A request in the search's terms.

    Attributes:
        a: posture A on the corpus's skeleton.
        b: posture B on the corpus's skeleton.
        leaving: the body's velocity at A, on the corpus's skeleton; None if unknown.
        arriving: the body's velocity at B, in the same form.
        before: seconds of the movement before A that shows `leaving`; None for none.
        after: seconds of the movement after B that shows `arriving`; None for none.
        through: postures to pass through on the corpus's skeleton, in order.
        request: the request.
        snap_degrees: angle between the orientations of A, the postures to pass through and B, and their states
            [2 + K, L].
        nearest: the corpus's postures nearest to A and B, for a search of whole postures; None for a search of joints.
        constraints: the pins, held joints and states to avoid.
        model: the costs before any constraint.
        problem: the constrained problem over states of joints.
        searched: the problem to search: `problem`, or the same with moves in place of states, where joints coordinate
            by their moves.
        coordination: the network in the costs of `searched`.
        times: the corpus's usual time from each stop to the next [1 + K].
        usual_moves: number of moves of the corpus's usual length in the given duration, if too few to reach B, so that
            the tween makes more; else None.
        detours: whether movement that the corpus shows after postures like A and before ones like B fills spare time.
        place: where the passage to follow begins; None for any passage.
    """

    a: Posture
    b: Posture
    leaving: Velocity | None
    arriving: Velocity | None
    before: float | None
    after: float | None
    through: tuple[Posture, ...]
    request: TweenRequest
    snap_degrees: Floats
    nearest: tuple[int, int] | None
    constraints: Sequence[Constraint]
    model: Model
    problem: Problem
    searched: Problem
    coordination: Coordination
    times: tuple[UsualTime, ...]
    usual_moves: int | None
    detours: bool
    place: Place | None

    @property
    def wished(self) -> Bools:
        """Whether the request restricts each chain beyond the ends and the length, which the motion should show [L]."""
        request = self.request
        if request.unlike or request.search.sample or request.novelty or not request.kappa:
            return np.ones(len(self.constrained), dtype=np.bool_)
        return self.constrained

    @property
    def constrained(self) -> Bools:
        """Whether each chain has a state that the constraints forbid between A and B [L]."""
        chains = self.problem.model.starts[:-1]
        allowed = np.logical_and.reduce([constraint.allowed for constraint in self.constraints], axis=0)
        return np.add.reduceat(~np.broadcast_to(allowed, self.problem.model.allowed.shape), chains) > 0

    @property
    def stays(self) -> bool:
        """Whether staying is best: A equals B to within rounding, is at rest, and the request asks nothing between."""
        request, moving = self.request, self.leaving is not None or self.arriving is not None
        return not (request.fixes_length or request.via or request.unlike or moving) and _same(self.a, self.b)


def formulate(
    learned: LearnedCorpus,
    a: Posture,
    b: Posture,
    request: TweenRequest,
    before: Motion | None = None,
    after: Motion | None = None,
) -> Formulation:
    """Bring the postures onto the corpus's skeleton and states, and build the constrained problem from its grammar.

    Raises:
        SkeletonError: a posture or a movement has another skeleton than the corpus, or lacks a joint.
        NoPathError: a held joint has different states in A and B.
        MotionMindError: the request does not suit the corpus, for instance its duration is too long; the movement
            before A does not end in A, the one after B does not begin in B, or one of them has a single frame, which
            shows no velocity.
    """
    shortest, longest = _move_range(learned, request)
    rules = Rules(request.search.beta, request.search.tau, shortest, longest, request.search.nodes(len(learned.space)))
    a, b = _on_skeleton(learned, a, "posture A"), _on_skeleton(learned, b, "posture B")
    before = None if before is None else _leading_to(learned, a, before)
    after = None if after is None else _following(learned, b, after)
    leaving = None if before is None else Velocity.at_end(before)
    arriving = None if after is None else Velocity.at_start(after)
    vias = [(_on_skeleton(learned, via, f"via {n}"), move) for n, (via, move) in enumerate(request.vias, start=1)]
    through = tuple(via for via, _ in vias)
    joints = len(a.skeleton)
    orientations = learned.corpus.to_chains(np.stack([posture.rotations for posture in (a, *through, b)]))
    states, nearest = learned.space.assign(orientations), None
    if request.search.whole_body:
        nearest = nearest_posture(learned.corpus, a.rotations), nearest_posture(learned.corpus, b.rotations)
        states[:, :joints] = learned.states[list(nearest), :joints]
    snap_degrees = learned.space.distance(orientations, states)
    start, *passing, goal = states.astype(np.int64)

    constraints = constraints_of(learned.space, start, goal, request.pin, request.hold, request.avoid)
    by_moves = request.search.coordination == "progression"
    factor = request.search.coordination_factor
    bridge_price = None if request.search.strict else request.search.bridge_price
    model = _grammar_model(
        learned.grammar, request.search.weights, 0.0 if by_moves else factor, bridge_price, request.novelty
    )
    problem = Problem(
        restrict(model, constraints),
        start,
        goal,
        rules,
        tuple(Via(state, None if move is None else int(move)) for state, (_, move) in zip(passing, vias, strict=True)),
    )
    usual_moves = None
    if request.duration is not None and request.moves is None and not (request.unlike or request.search.whole_body):
        most = max(longest, request.search.max_moves)
        fewest = fewest_moves(replace(problem, rules=replace(rules, longest=most)))
        if fewest is not None and fewest > longest:
            usual_moves, longest = longest, fewest
            rules = replace(rules, shortest=fewest, longest=fewest)
            problem = replace(problem, rules=rules)
    searched, coordination = problem, learned.grammar.coordination
    if by_moves:
        searched, coordination = _lifted(learned, problem, factor)
    detour, place = None, find_place(learned.corpus, request.passage) if request.passage else None
    if request.kappa:
        rows = problem.model.starts[:-1].repeat(np.diff(searched.model.starts)) + searched.model.place
        if request.paced and request.duration is not None and place is None:
            detour = find_detour(learned, (a, b), (leaving, arriving), request.duration)
        ends, velocities = (a, b), (leaving, arriving)
        length, lively = request.duration, request.liveliness
        guide = make_guide(learned, ends, velocities, request.kappa, length, rows, detour, lively, place)
        searched = replace(searched, guide=guide)
    times = usual_times(learned, (a, *through, b))
    if request.paced:
        searched = replace(searched, tolls=tolls(learned, times, longest))
    return Formulation(
        a,
        b,
        leaving,
        arriving,
        _seconds(before),
        _seconds(after),
        through,
        request,
        snap_degrees,
        nearest,
        constraints,
        model,
        problem,
        searched,
        coordination,
        times,
        usual_moves,
        detour is not None,
        place,
    )


@lru_cache(maxsize=1)
def _grammar_model(
    grammar: Grammar, weights: Weights, coordination: float, bridge_price: float | None, novelty: float
) -> Model:
    """Call `build_model`, and cache its result for further requests with the same arguments."""
    return build_model(grammar, weights, coordination, bridge_price, novelty)


def _move_range(learned: LearnedCorpus, request: TweenRequest) -> tuple[int, int]:
    """Return the least and greatest number of moves.

    They come from the request, from the tweens to differ from, or from the duration divided by the corpus's usual
    length of a move.
    """
    theirs = len(request.unlike[0].path) - 1 if request.unlike else None
    if request.duration is None:
        return request.move_range if theirs is None else (theirs, theirs)
    seconds = usual(learned.grammar.transitions)
    longest = MAX_MOVES * seconds
    if not 1.0 / request.fps <= request.duration <= longest:
        raise MotionMindError(
            f"duration must be a number of seconds from a frame's {1.0 / request.fps:g} to {longest:g}, not "
            f"{request.duration}"
        )
    if theirs is not None:
        return theirs, theirs
    if request.moves is not None:
        return request.move_range
    nearest = max(1, round(request.duration / seconds))
    return nearest, nearest


def _lifted(learned: LearnedCorpus, problem: Problem, factor: float) -> tuple[Problem, Coordination]:
    """Return the same problem over moves instead of states, and the network over moves."""
    held = problem.model_with_waits()
    count = np.diff(held.starts) + np.diff(held.indptr[held.starts])  # of each chain's states
    if count.max() > MAX_CHAIN_STATES:
        joint = learned.grammar.chains[int(count.argmax())]
        raise MotionMindError(
            f"coordination progression: {joint} has {count.max()} states and moves, and the search takes up to "
            f"{MAX_CHAIN_STATES}; build the corpus with a coarser tolerance for it, or ask for strict"
        )
    moves = learned.corpus.moves
    network = fit_progression(
        learned.grammar.coordination.parents,
        held.starts,
        held.indptr,
        held.targets,
        learned.states,
        moves.begins,
        moves.ends,
        moves.weights,
    )
    rules = replace(problem.rules, wait=np.inf)  # waits at the goal are moves by now
    return replace(problem, model=lift_to_moves(held, network, factor), rules=rules), network


def _leading_to(learned: LearnedCorpus, a: Posture, before: Motion) -> Motion | None:
    """Return the movement before posture A on the corpus's skeleton.

    Drop everything before the last flip of a joint, since A is as given. If a joint flips right before A, warn and
    return None.
    """
    before = _on_skeleton(learned, before, "the movement before A")
    _check_posture(before.posture(-1), a, "the movement before A does not end in A")
    if flips := find_flips(before):
        before = before.slice(flips[-1].frame, len(before))
        if len(before) == 1:
            _warn_of(flips[-1], "before A")
            return None
    return before


def _following(learned: LearnedCorpus, b: Posture, after: Motion) -> Motion | None:
    """Return the movement after posture B on the corpus's skeleton, in the same way."""
    after = _on_skeleton(learned, after, "the movement after B")
    _check_posture(after.posture(0), b, "the movement after B does not begin in B")
    if flips := find_flips(after):
        after = after.slice(0, flips[0].frame)
        if len(after) == 1:
            _warn_of(flips[0], "after B")
            return None
    return after


def _warn_of(flip: JointFlip, which: str) -> None:
    """Warn that a flip leaves nothing of the movement before A or after B."""
    message = f"the movement {which} shows no velocity: {flip.joint} flips by {flip.degrees:.0f} degrees in a frame"
    warnings.warn(message, MotionMindWarning, stacklevel=5)


def _seconds(motion: Motion | None) -> float | None:
    """Return the duration of a motion in seconds; None for None."""
    return None if motion is None else float(motion.times[-1] - motion.times[0])


def _check_posture(found: Posture, expected: Posture, fault: str) -> None:
    """Check that two postures agree, wherever they stand; else a MotionMindError gives `fault` and the worst joint."""
    degrees = np.degrees(rot.angle(found.rotations, expected.rotations))
    worst = int(degrees.argmax())
    if degrees[worst] > _SAME_POSTURE:
        raise MotionMindError(f"{fault}: {found.skeleton.names[worst]} is {degrees[worst]:.3g} degrees off there")


def _on_skeleton(learned: LearnedCorpus, movement: _Movement, which: str) -> _Movement:
    """Return a posture or a motion on the corpus's joints; SkeletonError names the difference."""
    skeleton = learned.corpus.skeleton
    if human23().difference(skeleton) is None and joint_mapping(movement.skeleton) is not None:
        movement = to_human23(movement)
    difference = skeleton.difference(movement.skeleton)
    if difference is not None:
        raise SkeletonError(f"{which} is on another skeleton than corpus {learned.corpus.name!r}: {difference}")
    return movement


def _same(a: Posture, b: Posture) -> bool:
    """Return whether two postures are equal to within rounding."""
    return bool(np.all(rot.angle(a.rotations, b.rotations) < 1e-6) and np.all(np.abs(a.root - b.root) < 1e-6))
