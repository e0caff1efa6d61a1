"""Trajectories of flows by the fourth-order Runge-Kutta method with a fixed step, and a test that they are chaotic.

One step of length h from x takes

    k1 = f(x), k2 = f(x + h/2 k1), k3 = f(x + h/2 k2), k4 = f(x + h k3),  x + h/6 (k1 + 2 k2 + 2 k3 + k4).

A flow's largest Lyapunov exponent is the rate at which neighbouring trajectories diverge; a flow is chaotic if it is
positive. Benettin's method follows two trajectories and, after every step, brings the second back to a small distance
d0 from the first along their difference. With d_n the distance after the n-th step, the exponent after N steps is

    (1 / (N h)) sum over n of log(d_n / d0).

Every trajectory must pass a sequential test: it counts as chaotic once the sum reaches 20 nats, and is refused if that
takes more than 200,000 steps. Near a fixed point the distance shrinks, around a limit cycle it stays within a factor,
and under mere shear it grows linearly in time, which would take 5e8 turns to pass.

Source: Benettin, Galgani and Strelcyn, "Kolmogorov entropy and numerical experiments", Phys. Rev. A 14:2338 (1976).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
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

_MAX_DISTANCE = 1e9  # from the origin, in the flow's coordinates: beyond it, a trajectory has left for infinity


def trajectory(
    flow: Flow,
    start: ArrayLike | None = None,
    *,
    count: int,
    every: int = 11,
    step: float | None = None,
    transient: int | None = None,
) -> Floats:
    """Follow a flow's trajectory from a start; the first point is the end of the transient.

    Args:
        flow: the flow.
        start: the start [d]; None for the flow's own.
        count: points, 1 at least.
        every: steps from each point to the next; `every = m + 1` skips m points. Bradley and Stuart, Chaos 8:800
            (1998), skip 10; their report CU-CS-844-97 (1997) keeps every tenth, so skips 9.
        step: the step of the integration, in the flow's units of time; None for the flow's own.
        transient: steps to drop before the first point; None for the flow's own.

    Returns:
        Points [count, d] in the flow's coordinates.

    Raises:
        MotionMindError: an argument is out of range, the trajectory diverges to infinity, or it settles: on a fixed
            point, or into an orbit that neighbours do not leave (see above).
    """
    if count < 1:
        raise MotionMindError(f"count must be 1 or more, not {count}")
    if every < 1:
        raise MotionMindError(f"every must be 1 or more, not {every}")
    run = _Run.of(flow, start, step, transient)
    return run.follow(_cached(_first_point, run), count, every)


def largest_exponent(
    flow: Flow,
    start: ArrayLike | None = None,
    *,
    steps: int = 1_000_000,
    step: float | None = None,
    transient: int | None = None,
) -> float:
    """Estimate the flow's largest Lyapunov exponent by Benettin's method.

    With a million steps, some ten thousand turns, it is within about one percent for the flows here.

    Args:
        flow: the flow.
        start: see `trajectory`, as for `step` and `transient`.
        steps: steps of the integration.

    Returns:
        Nats per unit of the flow's time (1 bit is 0.693 nats).

    Raises:
        MotionMindError: an argument is out of range, or the trajectory diverges to infinity.
    """
    if steps < 1:
        raise MotionMindError(f"steps must be 1 or more, not {steps}")
    exponent: float = _cached(_exponent, _Run.of(flow, start, step, transient), steps)
    return exponent


@dataclass(frozen=True, eq=False)
class _Run:
    """A flow with a start and a step, all checked; `compiled` is None if numba cannot compile its field."""

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
                f"the transient of {flow.name} must be a whole number of steps, 0 or more, not {transient!r}"
            )
        # Compiled code would silently read past the end of an array, so the field is first called uncompiled.
        try:
            shape = np.shape(flow.field(begin.copy(), *flow.parameters.values()))
        except (TypeError, IndexError, ValueError, ArithmeticError) as error:
            raise MotionMindError(f"{flow.name}: its field fails at {_format_point(begin)}: {error}") from error
        if shape != (d,):
            raise MotionMindError(f"{flow.name}: its field gives an array {list(shape)} at a point [{d}], not [{d}]")
        return cls(flow, _compiled(flow.field, len(flow.parameters)), begin, step, transient)

    @property
    def parameters(self) -> tuple[float, ...]:
        return tuple(self.flow.parameters.values())

    @property
    def _key(self) -> tuple[object, ...]:
        numbers = (*self.parameters, *self.flow.start, self.flow.step, *self.start, self.step)
        return self.flow.field, np.array(numbers).tobytes(), len(self.parameters), self.transient

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Run) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    def end_of_transient(self) -> Floats:
        """Return the point at which the transient ends [d]."""
        return self.follow(self.start, 2, self.transient)[1] if self.transient else self.start

    def follow(self, start: Floats, count: int, every: int) -> Floats:
        """Compute points [count, d] from `start` on, `every` steps apart."""
        points, kept = self._call(_follow, _follow_compiled, start, count, every)
        if kept < count:
            raise self._diverged(kept * every)
        return np.asarray(points)

    def growth(self, start: Floats, steps: int, enough: float) -> tuple[float, int]:
        """Return the nats by which neighbours of `start` diverge, and the number of steps."""
        growth, used = self._call(_diverge, _diverge_compiled, start, steps, enough)
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
            raise MotionMindError(
                f"{self.flow.label}: its field fails after {_format_point(start)}: {error}"
            ) from error

    def check(self, start: Floats) -> None:
        """Raise MotionMindError unless the flow is chaotic from `start`.

        The test takes the flow's own step or a longer one: tiny steps would take long. Neighbours diverge also on the
        way to a saddle point, so the trajectory must not come to rest either.
        """
        run = replace(self, step=max(self.step, self.flow.step))
        enough = 20.0  # nats
        growth, used = run.growth(start, 200_000, enough)
        if growth < enough:
            raise MotionMindError(
                f"{self.flow.label} is not chaotic from {_format_point(self.start)}: in {used} steps of {run.step:g} "
                f"neighbours of its trajectory part by {growth:.3g} nats, an exponent of "
                f"{growth / (used * run.step):.3g}, where {enough:g} nats would show that it is positive; it settles "
                "on a fixed point or an orbit"
            )
        end = run.follow(start, 2, 10_000)[1]  # a trajectory that nears a fixed point rests after so many steps
        if run.speed(end) <= 1e-9 * run.speed(np.array(self.flow.start)):
            raise MotionMindError(
                f"{self.flow.label} settles from {_format_point(self.start)}: it comes to rest at "
                f"{_format_point(end)}; choose a start that does not lead to a fixed point"
            )

    def speed(self, point: Floats) -> float:
        """Return the norm of the rate of change at a point [d]."""
        return float(np.linalg.norm(self.flow.field(point.copy(), *self.parameters)))

    def _diverged(self, steps: int) -> MotionMindError:
        return MotionMindError(
            f"{self.flow.label} diverges from {_format_point(self.start)}: within {steps} step{'s' * (steps != 1)} of "
            f"{self.step:g} it is farther than {_MAX_DISTANCE:g} from the origin; a start nearer to "
            f"{_format_point(self.flow.start)} or a smaller step may stay on the attractor"
        )


def _first_point(run: _Run) -> Floats:
    """Return the first point of a trajectory [d], and check that the flow is chaotic from there."""
    begin = run.end_of_transient()
    run.check(begin)
    return begin


def _exponent(run: _Run, steps: int) -> float:
    """Return the largest Lyapunov exponent over a number of steps, nats per unit of the flow's time."""
    growth, used = run.growth(run.end_of_transient(), steps, np.inf)
    return growth / (used * run.step)


# A search for a nudge makes some hundred runs.
_kept = {function: lru_cache(4096)(function) for function in (_first_point, _exponent)}


def _cached(function: Callable[..., Any], run: _Run, *rest: int) -> Any:
    """Call a function of a run, or return its cached result; varying a piece repeats the same runs.

    A field that is not compiled may have changed, so its runs are not cached.
    """
    return (_kept[function] if run.compiled else function)(run, *rest)


def _format_point(point: Sequence[float] | Floats) -> str:
    return f"({', '.join(f'{x:.6g}' for x in point)})"


# --- compiled or not --------------------------------------------------------------------------------------------------


@cache
def _compiled(field: Field, parameters: int) -> Step | None:
    """Compile a step of a field with a number of parameters to a pointer; None if numba cannot compile it.

    Only steps of this package's own fields are cached on disk: their source is known.
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
    """Return a function that advances x [d] by one Runge-Kutta step of length h; y and total [d] are scratch arrays."""

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
def _is_bounded(x: Floats) -> bool:
    """Return whether a point [d] is near enough to the origin for an attractor; NaN is not."""
    bounded = True
    for i in range(len(x)):
        bounded = bounded and abs(x[i]) < _MAX_DISTANCE
    return bounded


def _follow(
    step: Step, parameters: tuple[float, ...], start: Floats, h: float, count: int, every: int
) -> tuple[Floats, int]:
    """Return points [count, d] from `start` on, `every` steps apart, and how many are valid before it diverged."""
    d = len(start)
    x, y, total = start.copy(), np.empty(d), np.empty(d)
    points = np.empty((count, d))
    points[0] = x
    for n in range(1, count):
        for _ in range(every):
            step(x, h, parameters, y, total)
        if not _is_bounded(x):
            return points, n
        points[n] = x
    return points, count


def _diverge(
    step: Step, parameters: tuple[float, ...], start: Floats, h: float, steps: int, enough: float
) -> tuple[float, int]:
    """Return the nats by which a neighbour of `start` diverges from its trajectory, and the number of steps.

    It stops after `steps`, or once the nats reach `enough`. NaN nats: the trajectory went to infinity.
    """
    d = len(start)
    x, other, y, total = start.copy(), start.copy(), np.empty(d), np.empty(d)
    apart = 1e-8 * (1.0 + np.sqrt(np.sum(x * x)))
    for i in range(d):
        other[i] += apart / np.sqrt(d)
    grown = 0.0
    for n in range(steps):
        step(x, h, parameters, y, total)
        step(other, h, parameters, y, total)
        if not (_is_bounded(x) and _is_bounded(other)):
            return np.nan, n + 1
        square = 0.0
        for i in range(d):
            square += (other[i] - x[i]) ** 2
        distance = np.sqrt(square)
        if distance == 0.0:  # the two have met, to the last digit, and can never diverge again
            return -np.inf, n + 1
        grown += np.log(distance / apart)
        if grown >= enough:
            return grown, n + 1
        for i in range(d):
            other[i] = x[i] + (other[i] - x[i]) * (apart / distance)
    return grown, steps


_follow_compiled, _diverge_compiled = jit(_follow), jit(_diverge)
