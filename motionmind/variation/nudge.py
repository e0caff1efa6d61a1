"""Lay a piece and its variation along two trajectories, and choose the nudge between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike

from motionmind._typing import Ints
from motionmind.arguments import check_type
from motionmind.chaos.flows import FLOWS, Flow
from motionmind.chaos.reorder import Itinerary, itinerary
from motionmind.chaos.trajectories import largest_exponent
from motionmind.errors import MotionMindError
from motionmind.variation.arguments import check_number, check_numbers, check_whole
from motionmind.variation.course import Course
from motionmind.variation.departure import departs, find_nudge, nudges_from, share_sought
from motionmind.variation.limits import Limits, check_departure
from motionmind.variation.stretches import cheapest_order

N_SKIPPED_POINTS = 10  # default number of points between two postures
MAX_LENGTH = 1_000_000  # postures of a variation

Within = Callable[[Itinerary], tuple[Ints, float]]  # estimates an order within limits, and its share of insertions


def find_course(
    count: int,
    length: int,
    limits: Limits | None,
    within: Within | None,
    *,
    flow: Flow | None,
    nudge: float | Sequence[float] | None,
    depart: float | None,
    start: Sequence[float] | None,
    skip: int | None,
    step: float | None,
    transient: int | None,
) -> tuple[Course, Itinerary]:
    """Check the arguments of `vary` for a trajectory; return the course, and the reordering of a piece's postures.

    Args:
        count: postures of the piece.
        length: postures of the variation.
        limits: its limits, if any.
        within: estimates the order within them, if that is to leave the piece's order.
        flow, nudge, depart, start, skip, step, transient: as for `vary`.
    """
    flow = FLOWS["lorenz"] if flow is None else flow
    check_type("flow", flow, Flow, wanted="a Flow, such as find_flow('lorenz') gives")
    skip = check_whole("skip", N_SKIPPED_POINTS if skip is None else skip, 0, MAX_LENGTH)
    step = check_number("step", flow.step if step is None else step)
    transient = check_whole("transient", flow.transient if transient is None else transient, 0, 1_000_000_000)
    if nudge is not None and depart is not None:
        raise MotionMindError("give nudge or depart, not both")
    check_departure(depart, limits)
    depart = share_sought(nudge, depart, limits.stretch if limits else 1)
    start = check_numbers("start", flow.start if start is None else start)

    def reorder(nudge: ArrayLike) -> Itinerary:
        """Return the reordering by a nudge."""
        return itinerary(flow, count, length, nudge=nudge, start=start, every=skip + 1, step=step, transient=transient)

    if nudge is None:
        nudge = _seek_nudge(reorder, check_number("depart", depart), limits, within)
    offset = check_numbers("nudge", nudge)
    if np.ndim(nudge) == 0:
        offset += (0.0,) * (len(flow.start) - 1)
    # With the flow's own step at least: tiny steps do not reach the attractor in so many.
    exponent = largest_exponent(flow, start, steps=200_000, step=max(step, flow.step))
    course = Course(flow.name, dict(flow.parameters), start, offset, skip, step, transient, round(exponent, 4))
    return course, reorder(offset)


def _seek_nudge(
    reorder: Callable[[float], Itinerary], depart: float, limits: Limits | None, within: Within | None
) -> float:
    """Return the nudge for a share of departing steps, in stretches within the limits.

    If the order `within` limits then keeps the piece's, return the smallest larger nudge, to either side, whose order
    leaves it; if none does, the one whose order leaves it with the smallest share of insertions.
    """
    if limits is None:
        return find_nudge(lambda nudge: reorder(nudge).indices, depart)
    stretch, every = limits.stretch, 1 if limits.stretch == 1 else 5  # a minimum makes each trial slow
    sites = len(reorder(0.0).sites)
    free = np.zeros((sites, sites), dtype=np.float32)
    nudge = find_nudge(lambda nudge: cheapest_order(reorder(nudge), free, 0.0, stretch), depart, every)
    if within is None or limits.inserted is None:
        return nudge
    # Within the limits, a short piece may keep its order: try larger nudges, then those to the other side.
    larger = nudges_from(nudge, every)
    best, lowest = nudge, np.inf
    for other in (*larger, *(-one for one in larger)):
        with suppress(MotionMindError):  # the trajectory diverges
            order, share = within(reorder(other))
            if departs(order).any() and share < lowest:
                best, lowest = other, share
        if lowest <= limits.inserted:
            break
    return best
