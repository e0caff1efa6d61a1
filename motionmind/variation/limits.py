"""Limits of a variation: the least length of its stretches, and the greatest share of time for insertions.

The trajectory's own order has short stretches and many insertions. Limits replace it by the cheapest order near the
trajectory with long enough stretches (`motionmind.variation.stretches`), at the smallest price per second of insertion
that meets the limit. The longer its insertion and the smaller the detour, the sooner a seam disappears, or moves to
where the piece resembles itself more.

The engine determines the length of an insertion. So start with estimates, smooth the seams of the resulting order, and
replace the estimates by the actual lengths, until every seam of the order is smoothed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from motionmind._typing import Floats, Ints, Singles
from motionmind.chaos.reorder import Itinerary
from motionmind.errors import MotionMindError
from motionmind.variation.arguments import check_number, check_whole
from motionmind.variation.departure import DEPARTURE_TOLERANCE, departs
from motionmind.variation.seams import Index, Transition
from motionmind.variation.stretches import cheapest_order

MAX_LIMITED_POSTURES = 4_000  # of a piece, and of its variation: arrays hold the square of them
_MAX_ROUNDS = 12  # of smoothing; then only use seams that are smoothed already

Smoothing = Callable[[Sequence[tuple[int, int]]], tuple[Transition, ...]]  # smooths seams; fewer if interrupted


class Limits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Limits of a variation.

    Attributes:
        inserted: the greatest share of the time for insertions; None for no limit.
        stretch: the least number of postures in each stretch of the piece.
    """

    inserted: float | None
    stretch: int


class Kept(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The order under limits, in place of the trajectory's.

    Attributes:
        order: postures of the piece [L].
        limits: the limits; the actual share of insertions may be greater.
    """

    order: tuple[Index, ...]
    limits: Limits


def check_limits(inserted: float | None, stretch: int | None, count: int, length: int) -> Limits | None:
    """Return the requested limits; None for none.

    Args:
        inserted: see `Limits`.
        stretch: see `Limits`; None for 4 if insertions are limited, or for a fifth of fewer than 20 postures.
        count: postures of the piece.
        length: postures of the variation.

    Raises:
        MotionMindError: a limit is out of its range.
    """
    if inserted is None and stretch is None:
        return None
    if inserted is not None and not 0.0 <= check_number("inserted", inserted) <= 1.0:
        raise MotionMindError(f"the share of inserted time must be from 0 to 1, not {inserted}")
    if max(count, length) > MAX_LIMITED_POSTURES:
        raise MotionMindError(
            f"inserted and stretch are for pieces and variations of up to {MAX_LIMITED_POSTURES:,} postures, not of "
            f"{max(count, length):,}: vary a part"
        )
    most = min(count, length)
    if stretch is not None and check_whole("stretch", stretch, 1) > most:
        raise MotionMindError(f"stretch must be at most {most}, the postures of piece and variation, not {stretch}")
    share = None if inserted is None else float(inserted)
    return Limits(share, min(4, max(most // 5, 1)) if stretch is None else int(stretch))


def check_departure(depart: float | None, limits: Limits | None) -> None:
    """Raise MotionMindError if the least length of stretches rules out departing at this share of the steps."""
    if depart is not None and limits is not None and depart > 1.0 / limits.stretch + DEPARTURE_TOLERANCE:
        raise MotionMindError(
            f"depart {depart:g} cannot be reached in stretches of {limits.stretch} postures: at most 1 step in "
            f"{limits.stretch} leaves the piece's order; take shorter stretches"
        )


def inserted_share(inserted: Floats, durations: Floats) -> float:
    """Return the share of a variation's time that insertions take.

    Args:
        inserted: seconds of the insertion at each of its steps, 0 where there is none [L - 1].
        durations: seconds of the same steps in the piece [L - 1]; an insertion replaces them.
    """
    total = float(np.where(inserted > 0.0, inserted, durations).sum())
    return float(inserted.sum()) / total if total > 0.0 else 0.0


@dataclass(eq=False)
class _Seeker:
    """A search for an order within limits; actual lengths replace the estimates in `seconds` [N, N].

    With `leaves`, an order that leaves the piece's comes before the limit of insertions.
    """

    course: Itinerary
    durations: Floats
    limits: Limits
    seconds: Singles
    leaves: bool

    def order(self) -> Ints:
        """Return the order [L] at the smallest price that meets the limit, by the present `seconds`.

        If that is the piece's own order, return with `leaves` the one at the next smaller price.
        """
        beyond = self._cheapest(0.0)
        if self._holds(beyond):
            return beyond
        low, high = np.log((1e-6, 1e4))  # price of a second, in the trajectory's extents
        within = self._cheapest(float(np.exp(high)))
        if not self._holds(within):
            return within  # no other inserts less
        for _ in range(20):
            middle = 0.5 * (low + high)
            order = self._cheapest(float(np.exp(middle)))
            if self._holds(order):
                within, high = order, middle
            else:
                beyond, low = order, middle
        return beyond if self.leaves and not departs(within).any() else within

    def _cheapest(self, price: float) -> Ints:
        return cheapest_order(self.course, self.seconds, price, self.limits.stretch)

    def _holds(self, order: Ints) -> bool:
        if self.limits.inserted is None:
            return True
        return self.share(order) <= self.limits.inserted

    def share(self, order: Ints) -> float:
        """Return the share of the time for insertions in an order [L]."""
        inserted = np.where(departs(order), self.seconds[order[:-1], order[1:]], 0.0)
        return inserted_share(inserted, self.durations[order[:-1]])


def keep_within(
    limits: Limits,
    course: Itinerary,
    durations: Floats,
    seconds: Singles,
    smooth: Smoothing | None,
    leaves: bool = False,
) -> tuple[Kept, tuple[Transition, ...]]:
    """Find the order of a variation within limits, and smooth its seams.

    Args:
        limits: the limits.
        course: the trajectories.
        durations: seconds from each of the piece's postures to the next [N].
        seconds: estimated seconds of the insertion from each posture to each other [N, N].
        smooth: smooths seams; None without a corpus.
        leaves: whether to exceed the share of insertions rather than keep the piece's order.

    Returns:
        The order, and its judged and smoothed seams.

    Raises:
        MotionMindError: there is no order with such stretches.
    """
    seeker = _Seeker(course, durations, limits, seconds.copy(), leaves)
    smoothed: dict[tuple[int, int], Transition] = {}
    order = seeker.order()
    for number in range(_MAX_ROUNDS + 1):
        pairs = _seams_of(order)
        new = [pair for pair in pairs if pair not in smoothed]
        if not new or smooth is None:
            break
        found = smooth(new)
        smoothed |= {(one.start, one.end): one for one in found}
        if any(one.is_pending for one in found):  # ended early
            break
        _learn(seeker, seconds, smoothed)
        if number == _MAX_ROUNDS - 1:
            taken = np.array(list(smoothed))
            rest = np.ones(seconds.shape, dtype=np.bool_)
            rest[taken[:, 0], taken[:, 1]] = False
            seeker.seconds[rest] = 1e6  # so long that no order takes these seams
        order = seeker.order()
    kept = Kept(tuple(order.tolist()), limits)
    return kept, tuple(smoothed[pair] for pair in _seams_of(order) if pair in smoothed)


def estimate_order(limits: Limits, course: Itinerary, durations: Floats, seconds: Singles) -> tuple[Ints, float]:
    """Return the order [L] with which `keep_within` begins if it `leaves`, and its estimated share of insertions."""
    seeker = _Seeker(course, durations, limits, seconds, leaves=True)
    order = seeker.order()
    return order, seeker.share(order)


def _seams_of(order: Ints) -> list[tuple[int, int]]:
    """Return the distinct seams of an order of postures [L], as (from, to) postures."""
    at = np.flatnonzero(departs(order))
    return list(dict.fromkeys(zip(order[at].tolist(), order[at + 1].tolist(), strict=True)))


def _learn(seeker: _Seeker, estimates: Singles, smoothed: Mapping[tuple[int, int], Transition]) -> None:
    """Replace estimates by actual lengths, and rescale the other estimates to match."""
    known = {pair: float(one.candidates[0].motion.times[-1]) for pair, one in smoothed.items() if one.candidates}
    scale = 1.0
    if known:
        i, k = np.array(list(known)).T
        scale = sum(known.values()) / max(float(estimates[i, k].sum()), 1e-3)
    seeker.seconds[:] = scale * estimates
    for pair, seconds in known.items():
        seeker.seconds[pair] = seconds
