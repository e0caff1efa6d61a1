"""The share of a piece's order that a variation leaves, and the nudge that makes it leave so much."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from motionmind._typing import Bools, Ints
from motionmind.errors import MotionMindError

WITHIN = 0.05  # of the share that is sought
DEPART = 0.25  # the share that is sought unless another is given
# Ten to a power of ten; the attractors are some tens across. A piece of a thousand postures is left by a quarter of the
# steps only if it is followed for hundreds of them, and so from a trajectory that is hardly beside its own.
_NUDGES = np.geomspace(1e-12, 10.0, 131)


def departs(order: Ints) -> Bools:
    """Return which steps [L - 1] of an order of postures [L] neither go on in the piece nor stay."""
    steps = np.diff(order)
    return np.asarray((steps != 1) & (steps != 0))


def departure(order: Ints) -> float:
    """Return the share of the steps of an order of postures [L] that neither go on in the piece nor stay."""
    return float(np.mean(departs(order))) if len(order) > 1 else 0.0


def share_sought(nudge: object | None, depart: float | None, start: object | None, stretch: int = 1) -> float | None:
    """Return the share of steps for which `vary` seeks a nudge, given its arguments; None if it does not seek one.

    Unless one is given, the stretches are twice as long on average as they have to be, or the share is a quarter if
    that is less.
    """
    return min(DEPART, 0.5 / stretch) if nudge is None and depart is None and start is None else depart


def find_nudge(order: Callable[[float], Ints], share: float, every: int = 1) -> float:
    """Find the smallest nudge by which a variation departs from its piece in a share of its steps.

    Args:
        order: returns the order of postures that a nudge gives; MotionMindError if its trajectory leads nowhere.
        share: the share, from 0 to 1.
        every: tries each of so many of the nudges, which are ten to a power of ten.

    Returns:
        The smallest nudge that comes within 0.05 of the share; if none does, the one that comes nearest.

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
            if off == np.inf:  # it is no matter of the nudge
                raise
            break
        if found < off:
            nearest, off = nudge, found
        if off <= WITHIN:
            break
    return nearest
