"""Trajectories of flows by the fourth-order Runge-Kutta method with a fixed step, and whether they are chaotic.

A flow's largest Lyapunov exponent is the rate at which neighbouring trajectories part; that it is positive is what
makes the flow chaotic. It is found by Benettin's method: two trajectories, the second brought back to a small distance
from the first, along the direction that it has, after every step; the mean of the logarithms by which the distance
grew. Every trajectory is held against it, by a sequential test: it is taken for chaotic as soon as the distance has
grown e^20-fold in all, and refused if it has not within 200,000 steps. On a fixed point it shrinks, around a limit
cycle it stays within a factor, and where motion only shears it grows as time does, which takes 5e8 turns to get there.

Source: Benettin, Galgani and Strelcyn, "Kolmogorov entropy and numerical experiments", Phys. Rev. A 14:2338 (1976).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from motionmind._typing import Floats
from motionmind.chaos.flows import Field, Flow
from motionmind.errors import MotionMindError
from motionmind.jit import either, jit, pointer

Loop = Callable[..., tuple[Any, Any]]
Step = Callable[[Floats, float, tuple[float, ...], Floats, Floats], None]

_FAR = 1e9  # farther from the origin than any attractor: the trajectory has left for infinity
_APART = 1e-8  # how far Benettin's second trajectory is put from the first, against 1 + |x|
_ENOUGH = 20.0  # nats that the distance must grow by in a chaotic flow
_PATIENCE = 200_000  # steps within which it must
_LONG = 10_000  # steps in which what nears a fixed point comes to stand still
_STILL = 1e-9  # of the speed at the flow's own start: what is slower stands still


def trajectory(
    flow: Flow,
    start: ArrayLike | None = None,
    *,
    count: int,
    every: int = 11,
    step: float | None = None,
    transient: int | None = None,
) -> Floats:
    """Points [count, d] of the trajectory from a start, `every` steps apart; the transient's end is the first.

    Args:
        flow: what to follow.
        start: where it begins [d]; the flow's own start where None.
        count: points, 1 at least.
        every: one of so many steps is kept. To skip m points is `every = m + 1`: Chaos 8:800 skips 10, CU-CS-844-97
            takes each tenth, so skips 9.
        step: of the integration, in the flow's units of time; the flow's own where None.
        transient: steps that are dropped before the first point; the flow's own where None.

    Raises:
        MotionMindError: an argument is out of range, the trajectory leaves for infinity, or it settles: on a fixed
            point, or into an orbit that neighbours do not leave (see above).
    """
    if count < 1:
        raise MotionMindError(f"a trajectory has 1 point at least, not {count}")
    if every < 1:
        raise MotionMindError(f"a trajectory's points are 1 step apart at least, not {every}")
    run = _Run.of(flow, start, step, transient)
    begin = run.settled()
    run.check(begin)
    return run.follow(begin, count, every)


def largest_exponent(
    flow: Flow,
    start: ArrayLike | None = None,
    *,
    steps: int = 1_000_000,
    step: float | None = None,
    transient: int | None = None,
) -> float:
    """The flow's largest Lyapunov exponent by Benettin's method, in nats per unit of time (1 bit is 0.693 nats).

    With a million steps, some ten thousand turns, it is within about one percent for the flows here.

    Raises:
        MotionMindError: an argument is out of range, or the trajectory leaves for infinity.
    """
    if steps < 1:
        raise MotionMindError(f"an exponent needs 1 step at least, not {steps}")
    run = _Run.of(flow, start, step, transient)
    growth, used = run.growth(run.settled(), steps, np.inf)
    return growth / (used * run.step)


@dataclass(frozen=True, eq=False)
class _Run:
    """A flow from a start with a step, its arguments checked; `compiled` is None where its field cannot be."""

    flow: Flow
    compiled: Step | None
    start: Floats
    step: float
    transient: int

    @classmethod
    def of(cls, flow: Flow, start: ArrayLike | None, step: float | None, transient: int | None) -> _Run:
        d = len(flow.start)
        try:
            begin = np.array(flow.start if start is None else start, dtype=np.float64)
            step = flow.step if step is None else float(step)
        except (TypeError, ValueError):
            raise MotionMindError(
                f"{flow.name} takes {d} numbers to start at and one for its step, not {start!r} and {step!r}"
            ) from None
        transient = flow.transient if transient is None else transient
        if begin.shape != (d,) or not np.isfinite(begin).all():
            raise MotionMindError(f"{flow.name} starts at {d} finite numbers, not at {start!r}")
        if not 0.0 < step < np.inf:
            raise MotionMindError(f"the step of {flow.name} must be a positive number, not {step}")
        if isinstance(transient, bool) or not isinstance(transient, int | np.integer) or transient < 0:
            raise MotionMindError(
                f"the transient of {flow.name} is a whole number of steps, 0 at least, not {transient!r}"
            )
        # Compiled code would read past the end of an array without a word, so the field is tried as it is.
        try:
            shape = np.shape(flow.field(begin.copy(), *flow.parameters.values()))
        except (TypeError, IndexError, ValueError, ArithmeticError) as error:
            raise MotionMindError(f"{flow.name}: its field fails at {_written(begin)}: {error}") from error
        if shape != (d,):
            raise MotionMindError(f"{flow.name}: its field gives an array {list(shape)} at a point [{d}], not [{d}]")
        return cls(flow, _compiled(flow.field, len(flow.parameters)), begin, step, transient)

    @property
    def parameters(self) -> tuple[float, ...]:
        return tuple(self.flow.parameters.values())

    def settled(self) -> Floats:
        """Where the transient ends [d]."""
        return self.follow(self.start, 2, self.transient)[1] if self.transient else self.start

    def follow(self, start: Floats, count: int, every: int) -> Floats:
        points, kept = self._call(_follow, _follow_compiled, start, count, every)
        if kept < count:
            raise self._diverged(kept * every)
        return np.asarray(points)

    def growth(self, start: Floats, steps: int, enough: float) -> tuple[float, int]:
        """Nats by which neighbours part, and in how many steps."""
        growth, used = self._call(_part, _part_compiled, start, steps, enough)
        if np.isnan(growth):
            raise self._diverged(used)
        return float(growth), int(used)

    def _call(self, loop: Loop, compiled_loop: Loop, start: Floats, *rest: float) -> tuple[Any, Any]:
        if self.compiled:
            return compiled_loop(self.compiled, self.parameters, start, self.step, *rest)
        try:
            with np.errstate(all="ignore"):  # compiled code goes on with infinity, too
                return loop(_step_of(self.flow.field), self.parameters, start, self.step, *rest)
        except (ArithmeticError, ValueError) as error:
            raise MotionMindError(f"{self.flow.label}: its field fails after {_written(start)}: {error}") from error

    def check(self, start: Floats) -> None:
        """MotionMindError unless the flow is chaotic where it begins; with tiny steps that would take long to see.

        Neighbours part on the way to a fixed point, too, if it is a saddle: so it is also seen where that leads.
        """
        run = replace(self, step=max(self.step, self.flow.step))
        growth, used = run.growth(start, _PATIENCE, _ENOUGH)
        if growth < _ENOUGH:
            raise MotionMindError(
                f"{self.flow.label} is not chaotic from {_written(self.start)}: in {used} steps of {run.step:g} "
                f"neighbours of its trajectory part by {growth:.3g} nats, an exponent of "
                f"{growth / (used * run.step):.3g}, where {_ENOUGH:g} nats would show that it is positive; it settles "
                "on a fixed point or an orbit"
            )
        end = run.follow(start, 2, _LONG)[1]
        if run.speed(end) <= _STILL * run.speed(np.array(self.flow.start)):
            raise MotionMindError(
                f"{self.flow.label} settles from {_written(self.start)}: it comes to stand still at {_written(end)}; "
                "a start that is not on the way to a fixed point would move"
            )

    def speed(self, point: Floats) -> float:
        return float(np.linalg.norm(self.flow.field(point.copy(), *self.parameters)))

    def _diverged(self, steps: int) -> MotionMindError:
        return MotionMindError(
            f"{self.flow.label} diverges from {_written(self.start)}: within {steps} step{'s' * (steps != 1)} of "
            f"{self.step:g} it is farther than {_FAR:g} from the origin; a start nearer to "
            f"{_written(self.flow.start)} or a smaller step may stay on the attractor"
        )


def _written(point: Sequence[float] | Floats) -> str:
    return f"({', '.join(f'{x:.6g}' for x in point)})"


# --- compiled, or as they are -----------------------------------------------------------------------------------------


@cache
def _compiled(field: Field, parameters: int) -> Step | None:
    """A step of the field, with so many parameters, as a pointer; None where numba cannot compile it.

    Only those of our own fields are kept on disk, where what they are compiled from is known.
    """
    from numba import types
    from numba.core.errors import NumbaError

    point, number = types.float64[::1], types.float64
    values = types.Tuple([number] * parameters)  # type: ignore[no-untyped-call]
    plain = getattr(field, "py_func", field)
    if not isinstance(plain, FunctionType):
        return None
    try:
        signature = types.void(point, number, values, point, point)
        step: Step = pointer(_step_of(either(plain)), signature, keep=plain.__module__ == Flow.__module__)
        return step
    except NumbaError:
        return None


def _step_of(field: Field) -> Step:
    """One step of length h, for which x [d] moves on; y and total [d] are room to work in."""

    def step(x: Floats, h: float, parameters: tuple[float, ...], y: Floats, total: Floats) -> None:
        k = field(x, *parameters)
        for i in range(len(x)):
            total[i] = k[i]
            y[i] = x[i] + 0.5 * h * k[i]
        k = field(y, *parameters)
        for i in range(len(x)):
            total[i] += 2.0 * k[i]
        for i in range(len(x)):
            y[i] = x[i] + 0.5 * h * k[i]
        k = field(y, *parameters)
        for i in range(len(x)):
            total[i] += 2.0 * k[i]
        for i in range(len(x)):
            y[i] = x[i] + h * k[i]
        k = field(y, *parameters)
        for i in range(len(x)):
            x[i] += h / 6.0 * (total[i] + k[i])

    return step


@either
def _near(x: Floats) -> bool:
    """Whether a point is where an attractor can be; one that is not a number is not."""
    near = True
    for i in range(len(x)):
        near = near and abs(x[i]) < _FAR
    return near


def _follow(
    step: Step, parameters: tuple[float, ...], start: Floats, h: float, count: int, every: int
) -> tuple[Floats, int]:
    """Points [count, d] from `start` on, `every` steps apart, and how many there are: fewer where it diverged."""
    d = len(start)
    x, y, total = start.copy(), np.empty(d), np.empty(d)
    points = np.empty((count, d))
    points[0] = x
    for n in range(1, count):
        for _ in range(every):
            step(x, h, parameters, y, total)
        if not _near(x):
            return points, n
        points[n] = x
    return points, count


def _part(
    step: Step, parameters: tuple[float, ...], start: Floats, h: float, steps: int, enough: float
) -> tuple[float, int]:
    """Nats by which a neighbour of `start` parts from its trajectory within `steps`, or as soon as they are `enough`.

    Also the number of steps made; nan where the trajectory diverged.
    """
    d = len(start)
    x, other, y, total = start.copy(), start.copy(), np.empty(d), np.empty(d)
    apart = _APART * (1.0 + np.sqrt(np.sum(x * x)))
    for i in range(d):
        other[i] += apart / np.sqrt(d)
    grown = 0.0
    for n in range(steps):
        step(x, h, parameters, y, total)
        step(other, h, parameters, y, total)
        if not (_near(x) and _near(other)):
            return np.nan, n + 1
        square = 0.0
        for i in range(d):
            square += (other[i] - x[i]) ** 2
        distance = np.sqrt(square)
        if distance == 0.0:  # they have met, to the last digit: as far as numbers go, nothing parts here
            return -np.inf, n + 1
        grown += np.log(distance / apart)
        if grown >= enough:
            return grown, n + 1
        for i in range(d):
            other[i] = x[i] + (other[i] - x[i]) * (apart / distance)
    return grown, steps


_follow_compiled, _part_compiled = jit(_follow), jit(_part)
