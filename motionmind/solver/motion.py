"""Synthesis: from a reference movement to one that its feet carry, exact in the given postures.

`motionmind.solver.plan` plans stances and flights. `motionmind.solver.solve` then solves one least-squares problem over
the root and the joints of all frames. Its terms (`motionmind.solver.terms`) state properties of the movement, and
`WEIGHTS` their standard deviations, chosen for a body the size of a person: every body is scaled to that size.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.capsules import capsules_of
from motionmind.body.contact import pose
from motionmind.body.legs import find_hinge, find_legs
from motionmind.body.limbs import limbs_of
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.body.skeleton import Skeleton, remembered
from motionmind.body.support import size_of
from motionmind.footing.corrections import Correction
from motionmind.footing.feet import find_free_feet
from motionmind.footing.ground import Given, Stance, Stretch, find_ground
from motionmind.footing.smoothing import smoothstep
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline
from motionmind.solver.collision import Collision
from motionmind.solver.kinematics import Freedom, State, body_of
from motionmind.solver.one_sided import BOUND_TOLERANCE, UP, Balance, Floor, Limits
from motionmind.solver.plan import Plan, plan_contacts
from motionmind.solver.reaches import Reach, Stay, joints_towards, reaches_in, within_workspace
from motionmind.solver.residual import Residual
from motionmind.solver.route import Route
from motionmind.solver.solve import Problem, solve
from motionmind.solver.speed_bounds import Speed, Travel
from motionmind.solver.terms import Ballistic, Contacts, Smoothness, Term, Track
from motionmind.solver.weights import WEIGHTS, Weights

MOTIONLESS_RAD = 2e-3  # a joint that leaves its first orientation by less does not move
MAX_FREE_JOINTS = 48  # the time of a solve is cubic in their number; people have 13, stick insects 23
LEGS_PASS_S = 0.12  # before legs meet and after they part, in which the plane between them turns; chosen on cmu-05
N_WINDOW_FRAMES = 400  # solved at once
N_OVERLAP_FRAMES = 60  # at the end of a window, which the next window solves again


class Bounds(NamedTuple):
    """The bounds of a movement.

    Attributes:
        fixed: joints that must not change [J].
        wished: joints that a request constrains: they stay close to the reference [J].
        loose: joints without limits [J].
        touches: overlap allowed to the pairs of `Capsules.pairs` [P], metres.
        fastest: greatest speeds of the joints [J], rad/s, the first of the root's tilt; None for no bound.
        turns: greatest speed of the root about the vertical, rad/s.
        travels: greatest level speed of the root, m/s; infinite for no bound.
        rises: greatest speed at which it rises or sinks, m/s; infinite for no bound.
        pushes: greatest acceleration of the root in stance, m/s^2; infinite for no bound.
    """

    fixed: Bools
    wished: Bools
    loose: Bools
    touches: Floats
    fastest: Floats | None
    turns: float
    travels: float
    rises: float
    pushes: float

    def scaled(self, by: float) -> Bounds:
        """Return the bounds of a body `by` times as large."""
        travels, rises, pushes = (by * most for most in (self.travels, self.rises, self.pushes))
        return self._replace(touches=by * self.touches, travels=travels, rises=rises, pushes=pushes)


class Synthesis(NamedTuple):
    """A synthesised movement.

    Attributes:
        rotations: local rotations [N, J, 4].
        root: positions of the root [N, 3], metres.
        freedom: the degrees of freedom of the solve.
        x: their unknowns [N, n].
        falls: degree to which the body would fall without each foot [N, feet], 0 to 1.
        residuals: largest residual of each term.
    """

    rotations: Floats
    root: Floats
    freedom: Freedom
    x: Floats
    falls: Floats
    residuals: tuple[Residual, ...]

    def at(self, times: Floats, then: Floats) -> Synthesis:
        """Return this movement at `then` [M], to start a solve on a slower clock; `times` [N] are its own, seconds."""
        falls = np.zeros((len(then), self.falls.shape[1]))
        for foot, own in enumerate(self.falls.T):
            falls[:, foot] = np.interp(then, times, own)
        return self._replace(x=natural_spline(times, self.x, then), falls=falls)


def solve_motion(
    skeleton: Skeleton,
    reference: Floats,
    times: Floats,
    stance: Stance,
    given: Given,
    bounds: Bounds,
    without: Collection[Correction] = (),
    before: Synthesis | None = None,
    weights: Weights = WEIGHTS,
    reaches: Sequence[Reach] = (),
    stays: Sequence[Stay] = (),
) -> Synthesis:
    """Return the movement near a reference that its feet carry, exact in the given postures.

    Args:
        skeleton: the body.
        reference: local rotations of the reference [N, J, 4].
        times: times of the frames [N], seconds, evenly spaced.
        stance: stances and travel of the corpus's bodies along it.
        given: its ends, and the heights of the given postures.
        bounds: its bounds.
        without: terms to leave out (`motionmind.footing.corrections`).
        before: movement to start from (`Synthesis.at`); None for the reference.
        weights: standard deviations of the terms.
        reaches: places for joints at given times.
        stays: joints that keep their places for a while.
    """
    size = size_of(skeleton)
    by, person = 1.0 / size, _as_large_as_a_person(skeleton)
    lengths = stance.scaled(by), given.scaled(by), bounds.scaled(by)
    wanted = [reach.scaled(by) for reach in reaches]
    scene = _Scene(person, reference, times, *lengths, GRAVITY_MPS2 / size, without, weights, before, wanted, stays)
    x = scene.solve()
    state = scene.problem(slice(0, len(times))).state(x)
    root = size * state.root
    root[0], root[-1] = given.ends
    residuals = tuple(
        Residual(term, size * most if unit in ("cm", "m/s^2") else most, unit, float(times[frame]))
        for term, (most, unit, frame) in scene.residuals.items()
    )
    return Synthesis(rot.normalise(state.rotations), root, scene.freedom, x, scene.falls(), residuals)


class _Scene:
    """A movement of N frames to synthesise: its input, its plans and its residuals."""

    def __init__(
        self,
        skeleton: Skeleton,
        reference: Floats,
        times: Floats,
        stance: Stance,
        given: Given,
        bounds: Bounds,
        gravity: float,
        without: Collection[Correction],
        weights: Weights,
        before: Synthesis | None,
        reaches: Sequence[Reach],
        stays: Sequence[Stay],
    ) -> None:
        self.before = before
        self.skeleton, self.reference, self.given, self.bounds = skeleton, reference, given, bounds
        self.gravity, self.without, self.weights, self.overhang = gravity, without, weights, stance.overhang
        self.fps, self.feet = 1.0 / (times[1] - times[0]), find_free_feet(skeleton, bounds.fixed)
        self.posed = pose(skeleton, reference)
        self.ground = find_ground(skeleton, self.posed, times, stance, given, self.feet, gravity)
        self.body = body_of(skeleton)
        places = self.posed.places + self.ground.root[:, None]
        reaches = [*reaches, *(reach for stay in stays for reach in stay.reaches(skeleton, places, times))]
        self.reaches = []
        for reach in reaches:
            frame = min(round(self.fps * reach.seconds), len(times) - 1)
            self.reaches.append(within_workspace(skeleton, reach, places[frame]))
        # Keep the degrees of freedom: on another clock a joint that hardly moves may seem still.
        self.reaching, self.reaching_limbs = joints_towards(skeleton, reaches)
        reaching = self.reaching, self.reaching_limbs
        self.freedom = before.freedom if before else _freedom(skeleton, bounds.fixed, reference, *reaching)
        self.stops = self.fps * stance.half_steps[2 * np.array(list(given.low))]
        moving = given.rates[0] is not None, given.rates[1] is not None
        self.fixed = np.zeros(len(times), dtype=np.bool_)
        # Postures fix the frames around them; a posture within rounding errors of a frame fixes that frame.
        self.fixed[np.floor(self.stops + 1e-6).astype(int)] = True
        self.fixed[np.ceil(self.stops - 1e-6).astype(int)] = True
        self.fixed[[1, -2]] |= moving
        self.plans: list[Plan] = []
        self.residuals: dict[str, tuple[float, str, int]] = {}

    def problem(self, frames: slice) -> Problem:
        """Return the problem of a slice of the frames."""
        reference, root = self.reference[frames], self.ground.root[frames]
        return Problem(self.body, self.freedom, reference, root, self.fixed[frames].copy())

    def solve(self) -> Floats:
        """Return the unknowns [N, n], and record the residuals."""
        count = len(self.reference)
        x = np.zeros((count, self.freedom.unknowns)) if self.before is None else self.before.x.copy()
        self.plans = list(self._planned(x))
        if not self.plans:
            return x
        stride = N_WINDOW_FRAMES - N_OVERLAP_FRAMES
        starts = [0, *range(stride, count - N_OVERLAP_FRAMES, stride)]
        iterations, replans = (16, 2) if self.before is None else (10, 0)
        for begin in starts:
            frames = slice(begin, min(begin + N_WINDOW_FRAMES, count))
            problem = self.problem(frames)
            if begin:
                problem.fixed[:2] = True
            terms = self._terms(frames, self.ground.root[frames] + x[frames, :3])
            state = solve(problem, terms, x[frames], self._replanner(frames, terms, replans), iterations)
            x[frames] = state.x
            # The next window solves the rest again.
            last = count if frames.stop == count else frames.stop - N_OVERLAP_FRAMES
            for term in terms:
                off, name = term.residuals(state)[: last - begin], type(term).__name__
                worst = int(np.argmax(off))
                if term.unit and off[worst] > self.residuals.get(name, (BOUND_TOLERANCE,))[0]:
                    self.residuals[name] = float(off[worst]), term.unit, begin + worst
        return x

    def falls(self) -> Floats:
        """Return the degree to which the body would fall without each foot in the last plan [N, feet]."""
        out = np.zeros((len(self.reference), len(self.feet)))
        for plan in self.plans:
            if plan.falls is not None:
                out[plan.stretch.frames] = plan.falls
        return out

    def _planned(self, x: Floats) -> Iterator[Plan]:
        """Plan each stretch between two given postures."""
        state = self.problem(slice(0, len(x))).state(np.zeros_like(x))
        mass = state.mass - state.root if self.body.has_masses else np.zeros_like(state.root)
        ground, rates, last = self.ground, self.given.rates, len(self.stops) - 2
        for number, (begin, end) in enumerate(pairwise(self.stops)):
            part = slice(int(np.ceil(begin - 1e-6)), int(end + 1e-6) + 1)
            if part.stop - part.start < 3:
                continue
            rate = rates[0] if number == 0 else None, rates[1] if number == last else None
            stretch = Stretch(
                part,
                self.posed.part(part),
                ground.part(part),
                (rate[0] is not None, rate[1] is not None),
                (number > 0 or rate[0] is not None, number < last or rate[1] is not None),
                (None if rate[0] is None else float(rate[0][1]), None if rate[1] is None else float(rate[1][1])),
            )
            falls = None if self.before is None else self.before.falls[part]
            fixed = self.overhang, self.gravity, self.fps, "flight" not in self.without
            plan = plan_contacts(self.skeleton, stretch, mass[part], self.feet, *fixed, falls)
            plan.reach_with_feet(self.reaches)
            yield plan

    def _terms(self, frames: slice, root: Floats) -> list[Term]:
        """Return the terms of a slice of the frames, with the root near these positions [M, 3]."""
        w, bounds, fps = self.weights, self.bounds, self.fps
        flying = np.zeros(len(self.reference), dtype=np.bool_)
        for plan in self.plans:
            flying[plan.stretch.frames] |= plan.flying
        flying = flying[frames]
        sds, runs = _sds(self.skeleton, self.freedom, bounds.wished, fps, w, self.reaching_limbs)
        floor = self.ground.floor[frames]
        push = w.push_level, w.push_vertical if "bounce" not in self.without else np.inf
        terms: list[Term] = [
            Track(np.broadcast_to(sds, (len(root), len(sds)))),
            Smoothness(runs),
            Ballistic(fps, flying[1:-1], self.gravity, push, w.falls),
            self._contacts(frames, root),
            Floor(floor, w.floor),
        ]
        if self.reaches and (reaches := reaches_in(self.reaches, frames, fps, w.reach, w.reach_pull)):
            terms.append(reaches)
        if self.given.route is not None:
            terms.append(Route(self.given.route, w.route, w.route_pull))
        if self.given.course is not None:
            places = self.given.course.at(np.arange(len(self.reference))[frames] / fps)
            terms.append(Route(places, w.route, w.route_pull, is_timed=True))
        if len(self.freedom.joints):
            terms.append(Limits(self.reference[self.fixed], bounds.loose, w.limits))
        if self.body.has_masses and "balance" not in self.without:
            away = np.arange(len(self.reference)) / (0.5 * fps)  # a body given out of balance regains it in 0.5 s
            near = 1.0 - smoothstep(np.stack([away, away[::-1]]))
            balance = self._touches(frames), floor, self.overhang, w.room, near[:, frames], self.gravity, fps, w.balance
            terms.append(Balance(*balance))
        if "limbs" not in self.without and len(capsules_of(self.skeleton).names):
            usual = np.maximum(bounds.touches, w.touches)
            terms.append(Collision(usual, w.collision, max(1, round(LEGS_PASS_S * fps))))
        if bounds.fastest is not None:
            terms.append(Speed(bounds.fastest, bounds.turns, fps, w.speed))
        for axes, most in ((1.0 - UP, bounds.travels), (UP, bounds.rises)):
            if np.isfinite(most):
                terms.append(Travel(1, axes, most, flying[1:] | flying[:-1], fps, w.travel))
        if np.isfinite(bounds.pushes):
            terms.append(Travel(2, np.ones(3), bounds.pushes, flying[1:-1], fps, w.pushes))
        return terms

    def _replanner(self, frames: slice, terms: list[Term], times: int) -> Callable[[State], bool]:
        """Return the callback that plans steps again from the current movement, `times` times, and updates terms."""
        balance = [term for term in terms if isinstance(term, Balance)]
        steps, left = balance and "steps" not in self.without, times

        def replan(state: State) -> bool:
            nonlocal left
            left -= 1
            if left < 0:
                return False
            for plan in self.plans:
                part = plan.stretch.frames
                if steps and frames.start <= part.start and part.stop <= frames.stop:
                    here = slice(part.start - frames.start, part.stop - frames.start)
                    plan.replan_steps(state.root[here], state.mass[here])
            for at, term in enumerate(terms):
                if isinstance(term, Contacts):
                    terms[at] = self._contacts(frames, state.root)
            for term in balance:
                term.touches = self._touches(frames)
            for term in terms:
                if isinstance(term, Collision):
                    term.separate(state)
            return True

        return replan

    def _contacts(self, frames: slice, root: Floats) -> Contacts:
        """Return the contacts of a slice of the frames, with the root near these positions [M, 3]."""
        whole = self.ground.root.copy()
        whole[frames] = root
        found = [plan.contacts(whole[plan.stretch.frames], "steps" not in self.without) for plan in self.plans]
        return Contacts.joined(found, [plan.stretch.frames.start for plan in self.plans], len(whole)).part(frames)

    def _touches(self, frames: slice) -> Bools:
        """Return which points support the body in a slice of the frames [M, P]."""
        out = np.zeros((len(self.reference), len(self.body.owners)), dtype=np.bool_)
        for plan in self.plans:
            out[plan.stretch.frames] = plan.phases.touching(plan.shape)
        return out[frames]


def _freedom(
    skeleton: Skeleton,
    fixed: Bools,
    reference: Floats,
    reaching: Collection[int] = (),
    limbs: Collection[int] = (),
) -> Freedom:
    """Return the degrees of freedom of a solve: legs down to the foot, and other joints with a long reach.

    A fixed joint has none, nor has a joint that the reference does not turn, outside the legs and the `reaching` ones.
    Joints of reaching `limbs` have a reach of any length.
    Knees and elbows are hinges. If more than MAX_FREE_JOINTS qualify, those with the shortest reach keep the reference.
    """
    moves = rot.angle(reference, reference[:1]).max(axis=0) > MOTIONLESS_RAD
    joints, axes, legs, reach = [], [], _in_legs(skeleton), _reach(skeleton)
    # The first joint of a long limb is a collarbone.
    chosen = reach > 0.3  # m
    chosen[[limb[0] for limb in limbs_of(skeleton) if len(limb) > 3]] = False
    chosen[list(limbs)] = True
    free = [
        joint
        for joint in range(len(skeleton))
        if (legs[joint] <= 1 if joint in legs else chosen[joint])
        and not fixed[joint]
        and (moves[joint] or joint in legs or joint in reaching)
    ]
    for joint in sorted(sorted(free, key=lambda joint: -reach[joint])[:MAX_FREE_JOINTS]):
        is_hinge = legs.get(joint) == 0 or skeleton.names[joint].endswith("elbow")
        hinge = find_hinge(skeleton, joint) if is_hinge else None
        own = np.eye(3) if hinge is None else hinge[None]
        joints += [joint] * len(own)
        axes.append(own)
    return Freedom(np.array(joints, dtype=np.int64), np.concatenate([np.zeros((0, 3)), *axes]))


def _sds(
    skeleton: Skeleton, freedom: Freedom, wished: Bools, fps: float, weights: Weights, reaching: Collection[int]
) -> tuple[Floats, Floats]:
    """Return standard deviations of the unknowns (`Track`) and of their second differences (`Smoothness`) [n]."""
    legs, limbs = _in_legs(skeleton), {joint for limb in limbs_of(skeleton) for joint in limb}
    level, vertical, seconds = weights.root_level, weights.root_height, [weights.root_s] * 3
    sds = [level, vertical, level]
    for joint in freedom.joints.tolist():
        if joint in legs:
            own, slow = (weights.hip, weights.knee, weights.foot)[min(legs[joint], 1) + 1], weights.legs_s
        elif joint in limbs or joint in reaching:
            own, slow = weights.arm, weights.reach_s if joint in reaching else weights.arms_s
        else:
            own, slow = weights.pelvis if joint == 0 else weights.trunk, weights.trunk_s
        # Legs may leave the states that a request constrains, so that feet can stand.
        sds.append(weights.wished if wished[joint] and joint not in legs else own)
        seconds.append(slow)
    return np.array(sds), np.array(sds) / (np.array(seconds) * fps) ** 2


@remembered
def _as_large_as_a_person(skeleton: Skeleton) -> Skeleton:
    """Scale a body to the size of a person."""
    size = size_of(skeleton)
    return replace(skeleton, offsets=skeleton.offsets / size, tips=skeleton.tips / size)


@remembered
def _in_legs(skeleton: Skeleton) -> dict[int, int]:
    """Return the joints of the legs, with the number of joints from the knee down to each, -1 above the knee."""
    legs = find_legs(skeleton)[1]
    return {joint: max(place - knee, -1) for leg, knee in legs for place, joint in enumerate(leg)}


@remembered
def _reach(skeleton: Skeleton) -> Floats:
    """Return the distance from each joint to the farthest point that it carries, at rest [J], metres."""
    above = body_of(skeleton).ancestors
    far = np.linalg.norm(skeleton.rest - skeleton.rest[: len(skeleton), None], axis=-1)
    carried = np.concatenate([above, above]).T  # joints, then their tips, as in `rest`
    return np.asarray(np.where(carried, far, 0.0).max(axis=1))
