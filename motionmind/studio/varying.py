"""Vary a piece of stretches: reorder its postures along a trajectory, except the stretches to keep.

A *unit* is a posture of the piece with the frames up to the next one, at the corpus's rate; all units in order are the
piece, frame by frame. The units that may move are laid out along a trajectory; a second trajectory that begins nearby
selects the unit for each free place (`motionmind.chaos.reorder`). Kept stretches keep their places. A unit that
repeats at consecutive places appears only once.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, NamedTuple

import msgspec
import numpy as np

from motionmind._typing import Floats, Ints, Singles
from motionmind.chaos.flows import FLOWS, Flow
from motionmind.chaos.reorder import Itinerary, reorder
from motionmind.chaos.trajectories import trajectory
from motionmind.errors import MotionMindError, suggestion
from motionmind.studio.edits import Block
from motionmind.variation.departure import departure, find_nudge
from motionmind.variation.limits import Limits, check_departure, check_limits, keep_within
from motionmind.variation.nudge import N_SKIPPED_POINTS
from motionmind.variation.stretches import cheapest_order

MAX_UNITS = 4_000  # of a piece: with a minimum stretch above 1, memory grows with their square
STEPS_PER_PLACE = N_SKIPPED_POINTS + 1  # of a trajectory


class Clock(NamedTuple):
    """The time of a movement.

    Attributes:
        times: times of its frames [T], seconds.
        rate: units a second; None if each frame is a unit, as with keyframes.
    """

    times: Floats
    rate: float | None


Clocks = Callable[[str], Clock]  # returns the clock of a movement by its key


class Kept(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A stretch that stays.

    Attributes:
        block: the stretch.
        place: index of its first unit among all units, from 0.
    """

    block: Block
    place: Annotated[int, msgspec.Meta(ge=0)]


class Wanted(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request for a variation.

    Attributes:
        flow: name of the flow.
        depart: share of steps that leave the piece's order.
        nudge: offset of the variation's trajectory in the flow's first coordinate, instead of `depart`.
        start: start of the piece's trajectory, on the attractor [3]; None for the flow's own start.
        stretch: units in each stretch, at least, except beside kept ones.
        inserted: largest share of time for insertions, by estimate; None for no limit.
        kept: the stretches that stay, in order.
    """

    flow: str = "lorenz"
    depart: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] = 0.25
    nudge: float | None = None
    start: tuple[float, float, float] | None = None
    stretch: Annotated[int, msgspec.Meta(ge=1, le=100)] = 1
    inserted: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] | None = None
    kept: Annotated[tuple[Kept, ...], msgspec.Meta(max_length=1_000)] = ()


class Unit(NamedTuple):
    """A posture of a piece and the frames up to the next one.

    Attributes:
        block: index of its stretch.
        source: key of the movement.
        mirrored: whether left and right are exchanged.
        first: its first frame.
        last: its last frame.
        hold: seconds in which a posture stands still.
        pace: its speed, as a multiple of the recorded one.
    """

    block: int
    source: str
    mirrored: bool
    first: int
    last: int
    hold: float = 0.0
    pace: float = 1.0


class Estimates(NamedTuple):
    """Estimates of the insertions between N units.

    Attributes:
        seconds: duration of the insertion from each unit to each [N, N].
        durations: seconds from each unit to the next one [N].
    """

    seconds: Singles
    durations: Floats


Insertions = Callable[[Sequence[Unit]], Estimates | None]  # None: insertions cannot be limited


@dataclass(frozen=True, eq=False)
class Order:
    """An order of N units at L places, and its trajectories.

    Attributes:
        indices: the unit at each place [L].
        nudge: offset of the variation's trajectory in the flow's first coordinate.
        piece: the piece's trajectory, every step [(N - 1) * 11 + 1, d].
        other: the variation's trajectory, every step [(L - 1) * 11 + 1, d].
    """

    indices: Ints
    nudge: float
    piece: Floats
    other: Floats

    @property
    def departs(self) -> float:
        """The share of steps that leave the piece's order."""
        return departure(self.indices)


@dataclass(frozen=True, eq=False)
class Proposal:
    """A variation of a piece.

    Attributes:
        blocks: its stretches.
        places: index of each stretch's first unit among all units.
        count: number of all units.
        kept: ids of the kept stretches.
        order: the order of the other units.
    """

    blocks: tuple[Block, ...]
    places: tuple[int, ...]
    count: int
    kept: frozenset[str]
    order: Order


def units_of(blocks: Sequence[Block], clocks: Clocks) -> list[Unit]:
    """Cut stretches into units.

    Args:
        blocks: the stretches.
        clocks: returns the clock of a movement.
    """
    found = []
    for number, block in enumerate(blocks):
        source, mirrored = block.source, block.mirrored
        times, rate = clocks(source)
        own = times[block.first : block.last + 1]
        begins = np.arange(len(own))
        if rate is not None and len(own) > 1:
            wanted = own[0] + np.arange(np.floor((own[-1] - own[0]) * rate + 1e-3) + 1.0) / rate
            after = np.minimum(np.searchsorted(own, wanted), len(own) - 1)
            before = np.maximum(after - 1, 0)
            begins = np.unique(np.where(wanted - own[before] <= own[after] - wanted, before, after))
        ends = np.append(begins[1:] - 1, len(own) - 1)
        found += [
            Unit(number, source, mirrored, block.first + int(first), block.first + int(last), block.hold, block.pace)
            for first, last in zip(begins, ends, strict=True)
        ]
    return found


def kept_in(blocks: Sequence[Block], ids: Collection[str], clocks: Clocks) -> tuple[Kept, ...]:
    """Return the stretches of a piece with these ids, and their places; arguments as for `units_of`."""
    places = np.cumsum([0, *(len(units_of([block], clocks)) for block in blocks)]).tolist()
    return tuple(Kept(block, place) for block, place in zip(blocks, places, strict=False) if block.id in ids)


def vary_blocks(
    blocks: Sequence[Block],
    wanted: Wanted,
    clocks: Clocks,
    *,
    present: Sequence[Block] | None = None,
    total: int | None = None,
    used: Collection[str] = (),
    insertions: Insertions | None = None,
) -> Proposal:
    """Vary a piece.

    Args:
        blocks: the stretches to lay out along the trajectory.
        wanted: the request.
        clocks: returns the clock of a movement.
        present: the present piece, whose stretches keep their ids; None if it is `blocks`.
        total: units of the variation; None for as many as `present` has.
        used: ids that new stretches may not take.
        insertions: estimates insertions, for a request that limits them.

    Raises:
        MotionMindError: there is nothing to vary, or the request cannot be met.
    """
    present = blocks if present is None else present
    total = len(units_of(present, clocks)) if total is None else total
    kept = [(one, units_of([one.block], clocks)) for one in wanted.kept]
    taken = np.zeros(total, dtype=np.bool_)
    for one, own in kept:
        stands = slice(one.place, one.place + len(own))
        if stands.stop > total or taken[stands].any():
            raise MotionMindError("the kept stretches no longer fit: choose them again")
        taken[stands] = True
    free = _without(units_of(blocks, clocks), [unit for _, own in kept for unit in own])
    places = np.flatnonzero(~taken)
    if len(free) < 2 or len(places) < 2:
        raise MotionMindError("nothing left to vary: release a kept stretch or add to the piece")
    if max(len(free), total) > MAX_UNITS:
        raise MotionMindError(f"too long to vary: {max(len(free), total):,} postures, at most {MAX_UNITS:,}")
    order = find_order(wanted, len(free), len(places), insertions(free) if insertions else None)
    naming = _Naming(blocks, present, used, [one.block for one in wanted.kept])
    found = [(place, naming.block(run)) for place, run in _runs(order.indices, places, free)]
    found = sorted([*found, *((one.place, one.block) for one in wanted.kept)], key=lambda entry: entry[0])
    names = frozenset(one.block.id for one in wanted.kept)
    return Proposal(tuple(block for _, block in found), tuple(place for place, _ in found), total, names, order)


def find_order(wanted: Wanted, count: int, length: int, insertions: Estimates | None = None) -> Order:
    """Order `count` units at `length` places; `insertions` are estimates, for a request that limits them.

    Raises:
        MotionMindError: no flow has this name, or the request cannot be met.
    """
    stretch = min(wanted.stretch, count, length)
    course = _course(find_flow(wanted.flow).name, wanted.start, count, length, stretch)
    nudge = wanted.nudge
    if nudge is None:
        limits = check_limits(None, stretch, count, length) if stretch > 1 else None
        depart = min(wanted.depart, 1.0 / stretch)
        check_departure(depart, limits)
        nudge = find_nudge(course.order, depart, every=1 if stretch == 1 else 5)  # a minimum makes each trial slow
    order = course.order(nudge)
    if wanted.inserted is not None and insertions is not None:
        order = course.within(Limits(wanted.inserted, stretch), nudge, insertions)
    return Order(order, nudge, course.piece, course.follow(nudge))


@dataclass(frozen=True, eq=False)
class _Course:
    """A piece's trajectory, and a cache of the orders that nudges of it give.

    Attributes:
        flow: the flow.
        piece: the trajectory, every step [(N - 1) * 11 + 1, d].
        length: number of places.
        stretch: units in each stretch, at least.
        found: orders by nudge.
    """

    flow: Flow
    piece: Floats
    length: int
    stretch: int
    found: dict[float, Ints]

    def follow(self, nudge: float) -> Floats:
        """Return the variation's trajectory, every step [(L - 1) * 11 + 1, d]."""
        begin = self.piece[0] + nudge * np.eye(1, self.piece.shape[1])[0]
        return trajectory(self.flow, begin, count=(self.length - 1) * STEPS_PER_PLACE + 1, every=1, transient=0)

    def order(self, nudge: float) -> Ints:
        """Return the unit at each place [L]."""
        if nudge not in self.found:
            sites, points = self.piece[::STEPS_PER_PLACE], self.follow(nudge)[::STEPS_PER_PLACE]
            indices = reorder(sites, points)
            if self.stretch > 1:
                free = np.zeros((len(sites), len(sites)), dtype=np.float32)
                indices = cheapest_order(Itinerary(sites, points, indices), free, 0.0, self.stretch)
            self.found[nudge] = indices
        return self.found[nudge]

    def within(self, limits: Limits, nudge: float, insertions: Estimates) -> Ints:
        """Return the unit at each place [L], with insertions within limits if another order than the piece's is."""
        sites, points = self.piece[::STEPS_PER_PLACE], self.follow(nudge)[::STEPS_PER_PLACE]
        itinerary = Itinerary(sites, points, reorder(sites, points))
        kept, _ = keep_within(limits, itinerary, insertions.durations, insertions.seconds, None, leaves=True)
        return np.array(kept.order)


@lru_cache(maxsize=8)
def _course(flow: str, start: tuple[float, float, float] | None, count: int, length: int, stretch: int) -> _Course:
    """Return the course of a request; a start that the user chose is on the attractor and needs no transient."""
    own = find_flow(flow)
    transient = own.transient if start is None else 0
    piece = trajectory(own, start, count=(count - 1) * STEPS_PER_PLACE + 1, every=1, transient=transient)
    return _Course(own, piece, length, stretch, {})


def find_flow(name: str) -> Flow:
    """Return a flow by name; raise MotionMindError if no flow in three dimensions has this name."""
    if name not in FLOWS or len(FLOWS[name].start) != 3:
        known = [known for known, flow in FLOWS.items() if len(flow.start) == 3]
        raise MotionMindError(f"no attractor {name!r:.60}{suggestion(name, known)}")
    return FLOWS[name]


def _without(units: Sequence[Unit], kept: Sequence[Unit]) -> list[Unit]:
    """Return the units without the kept ones; of several with the same frames, the first is removed."""
    taken: dict[tuple[object, ...], int] = {}
    for unit in kept:
        taken[unit[1:4]] = taken.get(unit[1:4], 0) + 1
    free = []
    for unit in units:
        if taken.get(unit[1:4], 0):
            taken[unit[1:4]] -= 1
        else:
            free.append(unit)
    return free


def _runs(indices: Ints, places: Ints, units: Sequence[Unit]) -> list[tuple[int, list[Unit]]]:
    """Return the runs of units that continue as recorded, each with its first place.

    Args:
        indices: the unit at each free place [L].
        places: the free places [L]; a run ends before a taken one.
        units: the units.
    """
    runs: list[tuple[int, list[Unit]]] = []
    before = -2
    for index, place in zip(indices.tolist(), places.tolist(), strict=True):
        unit = units[index]
        last = runs[-1][1][-1] if place == before + 1 else None
        before = place
        if last is unit:
            continue
        if last and last.block == unit.block and last.last + 1 == unit.first:
            runs[-1][1].append(unit)
        else:
            runs.append((place, [unit]))
    return runs


class _Naming:
    """Assign ids to stretches: a stretch of the piece keeps its own, a new one gets an unused id."""

    def __init__(
        self, blocks: Sequence[Block], present: Sequence[Block], used: Collection[str], kept: Sequence[Block]
    ) -> None:
        self._blocks = blocks
        self._taken = {block.id for block in kept}
        self._present: dict[Block, list[str]] = {}  # ids of equal stretches, in order, by these without an id
        for block in present:
            if block.id not in self._taken:
                self._present.setdefault(msgspec.structs.replace(block, id=""), []).append(block.id)
        self._used = set(used)

    def block(self, run: Sequence[Unit]) -> Block:
        """Return the stretch of a run of units."""
        unit = run[0]
        origin = self._blocks[unit.block]
        last = run[-1].last
        repeats = origin.repeats if (unit.first, last) == (origin.first, origin.last) else 1
        bare = msgspec.structs.replace(origin, id="", first=unit.first, last=last, repeats=repeats)
        here = self._present.get(bare)
        name = here.pop(0) if here else self._new(bare)
        self._taken.add(name)
        return msgspec.structs.replace(bare, id=name)

    def _new(self, block: Block) -> str:
        number = 0
        while True:
            text = repr((*msgspec.structs.astuple(block), number))
            name = f"v{hashlib.sha256(text.encode()).hexdigest()[:10]}"
            if name not in self._used and name not in self._taken:
                return name
            number += 1
