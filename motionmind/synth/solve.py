"""Damped Gauss-Newton over a whole movement, whatever its terms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.geometry import rotations as rot
from motionmind.synth.kinematics import Body, Freedom, State
from motionmind.synth.one_sided import OneSided
from motionmind.synth.system import Normal
from motionmind.synth.terms import Term

MAX_ITERATIONS_PER_PLAN = 4  # iterations after which the terms are planned again at the latest
DIAGONAL_DAMPING = 0.3  # added to the diagonal, so that unknowns without rows stay
MAX_STEP_M_RAD = 0.6  # metres and radians: largest change of an unknown in an iteration
STEP_SHRINK_RATIO = 0.4  # factor that shortens a step after which the sum of squares is too great
MAX_RISE_RATIO = 1.2  # factor by which a step may raise the sum of squares: limbs that meet push only from then on
MAX_STEP_TRIES = 3  # step lengths tried
MIN_GAIN_SHARE = 0.01  # share of the sum of squares: an iteration that gains less is the last
CONVERGED_M_RAD = 0.004  # metres and radians: an iteration that changes every unknown by less is the last


class Problem(NamedTuple):
    """A movement to solve for.

    Attributes:
        body: the body.
        freedom: its degrees of freedom.
        reference: local rotations [N, J, 4].
        root: positions of the root [N, 3], metres.
        fixed: frames that do not change [N].
    """

    body: Body
    freedom: Freedom
    reference: Floats
    root: Floats
    fixed: Bools

    def state(self, x: Floats) -> State:
        """Return the movement at the unknowns [N, n]."""
        return State(self.body, self.freedom, self.reference, self.root, x)


def solve(
    problem: Problem,
    terms: Sequence[Term],
    x: Floats,
    replan: Callable[[State], bool] = lambda state: False,
    iterations: int = 12,
) -> State:
    """Return a movement that minimises the sum of squares of the terms, within a number of iterations.

    Args:
        problem: the movement.
        terms: its terms.
        x: initial unknowns [N, n]; those of fixed frames stay.
        replan: may change the terms, given the movement so far; called every few iterations and where it has settled.
            Returns whether it did.
        iterations: maximum number.
    """
    best = state = problem.state(x)
    normal, farthest = _linearised(state, terms), 1.0
    least = normal.cost
    for number in range(iterations):
        cost = normal.cost
        step = normal.step(DIAGONAL_DAMPING, problem.fixed)
        broken = [term.foresee(state, step, normal) for term in terms if isinstance(term, OneSided)]
        if any(broken):
            normal.expand(state.mass_jacobian)
            step = normal.step(DIAGONAL_DAMPING, problem.fixed)
        # The root counts as a whole: which way the body faces must not matter.
        greatest = float(max(rot.norm(step[:, :3]).max(), np.abs(step[:, 3:]).max(initial=0.0)))
        share = min(1.0, 2.0 * farthest, MAX_STEP_M_RAD / max(greatest, CONVERGED_M_RAD))
        for _ in range(MAX_STEP_TRIES):
            there = problem.state(state.x + share * step)
            normal = _linearised(there, terms)
            if normal.cost <= MAX_RISE_RATIO * cost:
                break
            share *= STEP_SHRINK_RATIO
        state, farthest = there, share
        if normal.cost < least:
            best, least = state, normal.cost
        settled = share * greatest < CONVERGED_M_RAD or (
            share == 1.0 and 0.0 <= cost - normal.cost < MIN_GAIN_SHARE * cost
        )
        if (settled or number % MAX_ITERATIONS_PER_PLAN == MAX_ITERATIONS_PER_PLAN - 1) and replan(best):
            state = best
            normal = _linearised(state, terms)
            least = normal.cost  # of other terms
        elif settled:
            break
    return best


def _linearised(state: State, terms: Sequence[Term]) -> Normal:
    normal = Normal(*state.x.shape)
    for term in terms:
        term.add(state, normal)
    normal.expand(state.mass_jacobian)
    return normal
