"""Damped Gauss-Newton over a whole movement, for any terms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.geometry import rotations as rot
from motionmind.solver.kinematics import Body, Freedom, State
from motionmind.solver.one_sided import OneSided
from motionmind.solver.system import Normal
from motionmind.solver.terms import Term

MAX_ITERATIONS_PER_PLAN = 4
DAMPING_WEIGHT = 0.3  # on the diagonal, so that unknowns without rows stay
CONVERGED_M_RAD = 0.004  # an iteration that changes every unknown by less is the last


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
        replan: may change the terms, given the movement so far, and returns whether it did; called every
            MAX_ITERATIONS_PER_PLAN iterations and on convergence.
        iterations: maximum number.
    """
    best = state = problem.state(x)
    normal, farthest = _linearised(state, terms), 1.0
    least = normal.cost
    for number in range(iterations):
        cost = normal.cost
        step = normal.step(DAMPING_WEIGHT, problem.fixed)
        broken = [term.foresee(state, step, normal) for term in terms if isinstance(term, OneSided)]
        if any(broken):
            normal.expand(state.mass_jacobian)
            step = normal.step(DAMPING_WEIGHT, problem.fixed)
        # Take the length of the root's step, which does not depend on the direction in which the body faces.
        greatest = float(max(rot.norm(step[:, :3]).max(), np.abs(step[:, 3:]).max(initial=0.0)))
        # No unknown changes by more than 0.6 m or rad.
        share = min(1.0, 2.0 * farthest, 0.6 / max(greatest, CONVERGED_M_RAD))
        for _ in range(
            3
        ):  # shorten a step that raises the sum of squares; not slightly, because limbs push as they meet
            there = problem.state(state.x + share * step)
            normal = _linearised(there, terms)
            if normal.cost <= 1.2 * cost:
                break
            share *= 0.4
        state, farthest = there, share
        if normal.cost < least:
            best, least = state, normal.cost
        gains_little = share == 1.0 and 0.0 <= cost - normal.cost < 0.01 * cost
        settled = share * greatest < CONVERGED_M_RAD or gains_little
        if (settled or number % MAX_ITERATIONS_PER_PLAN == MAX_ITERATIONS_PER_PLAN - 1) and replan(best):
            state = best
            normal = _linearised(state, terms)
            least = normal.cost  # of the new terms
        elif settled:
            break
    return best


def _linearised(state: State, terms: Sequence[Term]) -> Normal:
    """Return the normal equations of the terms, linearised at a state."""
    normal = Normal(*state.x.shape)
    for term in terms:
        term.add(state, normal)
    normal.expand(state.mass_jacobian)
    return normal
