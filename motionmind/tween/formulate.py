"""Formulating a request: two postures and their request, as states and costs that the search reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.motion import Posture
from motionmind.errors import MotionMindError
from motionmind.footing.course import Course
from motionmind.grammar.coordination import Coordination
from motionmind.grammar.grammar import Grammar
from motionmind.grammar.progression import fit_progression
from motionmind.grammar.schemes import Weights
from motionmind.learned.model import LearnedCorpus
from motionmind.search.length import fewest_moves, fewest_moves_between
from motionmind.search.problem import Model, Problem, Rules, Via
from motionmind.search.solve import MAX_CHAIN_STATES
from motionmind.synthesis.timeline import usual
from motionmind.tween.constraints import Constraint, constraints_of, restrict
from motionmind.tween.ends import Ends, bring
from motionmind.tween.guide import find_detour, make_guide
from motionmind.tween.modes import find_place
from motionmind.tween.options import MAX_MOVES
from motionmind.tween.pacing import UsualTime, tolls, usual_times
from motionmind.tween.problem import build_model, lift_to_moves
from motionmind.tween.reaches import resolve_reaches, resolve_stays
from motionmind.tween.request import TweenRequest
from motionmind.tween.travel import course_between, route_between
from motionmind.tween.whole_body import nearest_posture
from motionmind.walks.passages import Place


@dataclass(frozen=True, eq=False)
class Formulation:
    """A request in the search's terms.

    Attributes:
        ends: the postures A and B, and the body's velocity there.
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
        route: the path over the floor from A to B [P, 2], metres; None for any.
        course: the same with times and facings; None for any.
    """

    ends: Ends
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
    route: Floats | None
    course: Course | None

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
        """Whether staying is best: A equals B, at rest, and the request asks nothing between."""
        request = self.request
        moves = request.fixes_length or request.via or request.unlike or request.reach or request.along
        return not moves and self.ends.rest_in_one_posture


def formulate(learned: LearnedCorpus, ends: Ends, request: TweenRequest) -> Formulation:
    """Assign states to the postures, and build the constrained problem from the corpus's grammar.

    Raises:
        SkeletonError: a posture to pass through has another skeleton than the corpus, or lacks a joint; or a reach
            or stay names no joint.
        NoPathError: a held joint has different states in A and B.
        MotionMindError: the request does not suit the corpus, for instance its duration is too long.
    """
    search = request.search
    resolve_reaches(learned.corpus.skeleton, request.reach)  # raises before the search
    resolve_stays(learned.corpus.skeleton, request.stay)
    shortest, longest = _move_range(learned, request)
    rules = Rules(search.beta, search.tau, shortest, longest, search.nodes(len(learned.space)))
    through = tuple(bring(learned.corpus, via, f"via {n}") for n, (via, *_) in enumerate(request.vias, start=1))
    postures = (ends.a, *through, ends.b)
    orientations = learned.corpus.to_chains(np.stack([posture.rotations for posture in postures]))
    states, nearest = learned.space.assign(orientations), None
    if search.whole_body:
        nearest = nearest_posture(learned.corpus, ends.a.rotations), nearest_posture(learned.corpus, ends.b.rotations)
        joints = len(ends.a.skeleton)
        states[:, :joints] = learned.states[list(nearest), :joints]
    snap_degrees = learned.space.distance(orientations, states)
    start, *passing, goal = states.astype(np.int64)
    moves = [move for _, move, _ in request.vias]

    constraints = constraints_of(learned.space, start, goal, request.pin, request.hold, request.avoid)
    by_moves, factor = search.coordination == "progression", search.coordination_factor
    bridge_price = None if search.strict else search.bridge_price
    model = _grammar_model(learned.grammar, search.weights, 0.0 if by_moves else factor, bridge_price, request.novelty)
    problem = Problem(restrict(model, constraints), start, goal, rules, tuple(map(Via, passing, moves)))
    problem, usual_moves = _with_enough_moves(problem, request, usual(learned.grammar.transitions))
    searched, coordination = problem, learned.grammar.coordination
    if by_moves:
        searched, coordination = _lifted(learned, problem, factor)
    route = route_between(ends.a, ends.b, request.along)
    detour, place = None, find_place(learned.corpus, request.passage) if request.passage else None
    if request.kappa:
        rows = problem.model.starts[:-1].repeat(np.diff(searched.model.starts)) + searched.model.place
        stops = ends.stops(learned.corpus)
        if request.paced and request.length is not None and place is None:
            detour = find_detour(learned, (ends.a, ends.b), stops, request.length, route)
        length, lively = request.length, request.liveliness
        guide = make_guide(learned, stops, request.kappa, length, rows, detour, lively, place)
        searched = replace(searched, guide=guide)
    times = usual_times(learned, postures, route)
    if request.paced:
        searched = replace(searched, tolls=tolls(learned, times, problem.rules.longest))
    return Formulation(
        ends,
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
        route,
        course_between(ends.a, ends.b, request.along, float(request.length or 0.0)),
    )


def _with_enough_moves(problem: Problem, request: TweenRequest, usual_s: float) -> tuple[Problem, int | None]:
    """Allow as many moves as B needs if a duration alone gives too few; return the problem, and that too small number.

    The number is None if it is large enough. A move usually takes `usual_s` seconds.
    """
    rules, search = problem.rules, request.search
    if request.length is None or request.moves is not None or search.whole_body:
        return problem, None
    if any(seconds is not None for _, _, seconds in request.vias):
        return _with_timed_vias(problem, request, usual_s), None
    if request.unlike:
        return problem, None
    fewest = fewest_moves(replace(problem, rules=replace(rules, longest=max(rules.longest, search.max_moves))))
    if fewest is None or fewest <= rules.longest:
        return problem, None
    return replace(problem, rules=replace(rules, shortest=fewest, longest=fewest)), rules.longest


def _with_timed_vias(problem: Problem, request: TweenRequest, usual_s: float) -> Problem:
    """Return the problem in which timed vias are passed after the moves that fit their times.

    Each segment between times has moves of the usual length, or as many as it needs; so has the last one.
    """
    longest = max(problem.rules.longest, request.search.max_moves)
    needed = fewest_moves_between(replace(problem, rules=replace(problem.rules, shortest=1, longest=longest)))
    if needed is None:
        return problem  # the search will say why
    times = [*(seconds for _, _, seconds in request.vias), request.length]
    vias: list[Via] = []
    moves, fewest, begins = 0, 0, 0.0
    for i, (need, seconds) in enumerate(zip(needed, times, strict=True)):
        fewest += need
        if seconds is not None:
            moves += max(fewest, round((seconds - begins) / usual_s))
            fewest, begins = 0, seconds
        if i < len(problem.vias):
            via = problem.vias[i]
            vias.append(via if seconds is None else via._replace(move=moves))
    return replace(problem, rules=replace(problem.rules, shortest=moves, longest=moves), vias=tuple(vias))


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
    if request.length is None:
        return request.move_range if theirs is None else (theirs, theirs)
    seconds = usual(learned.grammar.transitions)
    longest = MAX_MOVES * seconds
    if not 1.0 / request.fps <= request.length <= longest:
        raise MotionMindError(
            f"duration must be a number of seconds from a frame's {1.0 / request.fps:g} to {longest:g}, not "
            f"{request.length}"
        )
    if theirs is not None:
        return theirs, theirs
    if request.moves is not None:
        return request.move_range
    nearest = max(1, round(request.length / seconds))
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
