"""Natural cubic splines through numbers and through rotations.

>>> natural_spline(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.0]), np.array([0.5, 1.0])).tolist()
[0.6875, 1.0]
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats


def natural_spline(times: Floats, values: Floats, at: Floats) -> Floats:
    """Evaluate the natural cubic spline through values.

    It is twice continuously differentiable, its second derivative 0 at both ends. Two knots give a straight line, one a
    constant.

    Args:
        times: times of the knots, increasing [K].
        values: values at the knots [K, ...].
        at: times to evaluate at [N].

    Returns:
        Values [N, ...].
    """
    if len(times) == 1:
        return np.broadcast_to(values[0], (len(at), *values.shape[1:])).copy()
    from motionmind.geometry.curves import natural_curve  # numba is slow to import

    out = natural_curve(_floats(times), _floats(values).reshape(len(times), -1), _floats(at))
    return out.reshape(len(at), *values.shape[1:])


def rotation_spline(times: Floats, keys: Floats, at: Floats) -> Floats:
    """Evaluate a twice continuously differentiable curve of rotations through keys.

    Around each key, take the natural spline of the rotation vectors from it to all keys (the chart of SO(3) centred
    there), unrolled so that neighbouring keys lie within half a turn of each other. Between two keys, blend from the
    first one's spline to the second one's, by a weight whose first two derivatives are 0 at both. The curve is exact at
    the keys; for keys that turn about one axis all charts agree on the spline of their angle. A single chart does not
    suffice: it ends a whole turn from its centre, where vectors in all directions are the same rotation.

    Args:
        times: times of the keys, increasing [K].
        keys: unit quaternions [K, ..., 4].
        at: times to evaluate at [N].

    Returns:
        Unit quaternions [N, ..., 4].
    """
    if len(times) == 1:
        return np.broadcast_to(keys[0], (len(at), *keys.shape[1:])).copy()
    knots = np.minimum(np.searchsorted(times, at), len(times) - 1)
    if np.array_equal(times[knots], at):
        return keys[knots]
    from motionmind.geometry.charts import N_CHART_KEYS, curve_of_rotations  # numba is slow to import

    # Keys farther away than a chart reaches have no effect.
    near = slice(max(int(knots.min()) - N_CHART_KEYS - 1, 0), int(knots.max()) + N_CHART_KEYS + 2)
    times, keys = times[near], keys[near]
    out = curve_of_rotations(_floats(times), _floats(keys).reshape(len(times), -1, 4), _floats(at))
    return out.reshape(len(at), *keys.shape[1:])


def _floats(x: Floats) -> Floats:
    """Return a contiguous, writable array, the kind for which the loops are compiled."""
    x = np.ascontiguousarray(x, dtype=np.float64)
    return x if x.flags.writeable else x.copy()
