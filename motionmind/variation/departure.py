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


def is_near(order: Ints, share: float) -> bool:
    """Return whether an order [L] departs in a share of its steps, within 0.05 or half a step."""
    half_step = 0.5 / max(len(order) - 1, 1) + 1e-9  # 1e-9 absorbs rounding
    return abs(departure(order) - share) <= max(DEPARTURE_TOLERANCE, half_step)


def share_sought(nudge: object | None, depart: float | None, stretch: int = 1) -> float | None:
    """Return the share of departing steps for which `vary` seeks a nudge; None if a nudge is given.

    The default is a quarter, or less if the stretches must be twice `stretch` on average.
    """
    return min(0.25, 0.5 / stretch) if nudge is None and depart is None else depart


def nudges_from(nudge: float, every: int = 1) -> list[float]:
    """Return the nudges that `find_nudge` tries, from one of them on, smallest first."""
    return [one for one in _NUDGES[::every].tolist() if one >= nudge]


def find_nudge(order: Callable[[float], Ints], share: float, every: int = 1) -> float:
    """Find the smallest nudge by which a variation departs from its piece in a share of its steps.

    Args:
        order: returns the order for a nudge; MotionMindError if its trajectory diverges or settles.
        share: the share, from 0 to 1.
        every: try only every n-th nudge; there are ten nudges per power of ten.

    Returns:
        The smallest nudge whose share is within 0.05 or half a step (`is_near`); if there is none, the nudge with the
        nearest share.

    Raises:
        MotionMindError: the share is not from 0 to 1, or no nudge gives an order.
    """
    if not 0.0 <= share <= 1.0:
        raise MotionMindError(f"the share of steps that depart must be from 0 to 1, not {share}")
    nearest, off = float(_NUDGES[0]), np.inf
    for nudge in nudges_from(nearest, every):
        try:
            found = order(nudge)
        except MotionMindError:
            if off == np.inf:  # the nudge is not the cause
                raise
            break
        if is_near(found, share):
            return nudge
        if abs(departure(found) - share) < off:
            nearest, off = nudge, abs(departure(found) - share)
    return nearest
