"""Natural cubic splines, compiled: second derivatives at their knots, and values between them."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.jit import jit


@jit
def natural_curve(times: Floats, values: Floats, at: Floats) -> Floats:
    """Return the natural cubic spline through values [K, m], two or more, at some times [N]: [N, m].

    Args:
        times: times of the knots, increasing [K].
        values: values at the knots.
        at: times to evaluate at.
    """
    bends, out = second_derivatives(times, values), np.empty((len(at), values.shape[1]))
    for t in range(len(at)):
        knot = _piece_at(times, at[t])
        after, before = times[knot + 1] - at[t], at[t] - times[knot]
        step = after + before
        # The straight line, plus the contribution of both second derivatives, which is 0 at the knots.
        a, b = after**3 / step - step * after, before**3 / step - step * before
        for k in range(values.shape[1]):
            line = (values[knot, k] * after + values[knot + 1, k] * before) / step
            out[t, k] = line + (bends[knot, k] * a + bends[knot + 1, k] * b) / 6.0
    return out


@jit
def _piece_at(times: Floats, at: float) -> int:
    """Return the knot at which the spline piece around a time begins; beyond the ends, that of the outermost piece."""
    return min(max(int(np.searchsorted(times, at, side="right")) - 1, 0), len(times) - 2)


@jit
def second_derivatives(times: Floats, values: Floats) -> Floats:
    """Return the second derivatives [K, m] of the natural spline through values [K, m] at its knots.

    With steps h and slopes d, they solve the tridiagonal system

        h[i-1] M[i-1] + 2 (h[i-1] + h[i]) M[i] + h[i] M[i+1] = 6 (d[i] - d[i-1]).

    Source: de Boor, "A Practical Guide to Splines" (1978), chapter IV.
    """
    out, upper = np.zeros(values.shape), np.zeros(len(times))
    for i in range(1, len(times) - 1):
        before, after = times[i] - times[i - 1], times[i + 1] - times[i]
        pivot = 2.0 * (before + after) - before * upper[i - 1]
        upper[i] = after / pivot
        left, right, carried = 6.0 / (before * pivot), 6.0 / (after * pivot), before / pivot
        for k in range(values.shape[1]):
            slopes = right * (values[i + 1, k] - values[i, k]) - left * (values[i, k] - values[i - 1, k])
            out[i, k] = slopes - carried * out[i - 1, k]
    for i in range(len(times) - 3, 0, -1):
        for k in range(values.shape[1]):
            out[i, k] -= upper[i] * out[i + 1, k]
    return out
