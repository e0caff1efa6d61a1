"""The share of a variation's steps that depart from the piece's order, and the nudge for a wanted share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from motionmind._typing import Bools, Ints
from motionmind.errors import MotionMindError

DEPARTURE_TOLERANCE = 0.05  # of a share of steps
# Ten per power of ten; the attractors are some tens across. To depart from a piece of a thousand postures at a quarter
# of the steps, a variation must follow it for hundreds of steps, so its trajectory must start very near the piece's.
_NUDGES = np.geomspace(1e-12, 10.0, 131)


def departs(order: Ints) -> Bools:
    """Return which steps [L - 1] of an order [L] depart: neither continue the piece nor stay."""
    steps = np.diff(order)
    return np.asarray((steps != 1) & (steps != 0))


def departure(order: Ints) -> float:
    """Return the share of the steps of an order [L] that depart."""
    return float(np.mean(departs(order))) if len(order) > 1 else 0.0


def share_sought(nudge: object | None, depart: float | None, start: object | None, stretch: int = 1) -> float | None:
    """Return the share of departing steps for which `vary` seeks a nudge; None if its arguments determine the nudge.

    The default is a quarter, or less if the stretches must be twice `stretch` on average.
    """
    return min(0.25, 0.5 / stretch) if nudge is None and depart is None and start is None else depart


def find_nudge(order: Callable[[float], Ints], share: float, every: int = 1) -> float:
    """Find the smallest nudge by which a variation departs from its piece in a share of its steps.

    Args:
        order: returns the order for a nudge; MotionMindError if its trajectory diverges or settles.
        share: the share, from 0 to 1.
        every: try only every n-th nudge; there are ten nudges per power of ten.

    Returns:
        The smallest nudge whose share is within 0.05; if there is none, the nudge with the nearest share.

    Raises:
        MotionMindError: the share is not from 0 to 1, or no nudge gives an order.
    """
    if not 0.0 <= share <= 1.0:
        raise MotionMindError(f"the share of steps that depart must be from 0 to 1, not {share}")
    nearest, off = float(_NUDGES[0]), np.inf
    for nudge in map(float, _NUDGES[::every]):
        try:
            found = abs(departure(order(nudge)) - share)
        except MotionMindError:
            if off == np.inf:  # the nudge is not the cause
                raise
            break
        if found < off:
            nearest, off = nudge, found
        if off <= DEPARTURE_TOLERANCE:
            break
    return nearest
