"""Variations for the page: the map of an attractor, and variations of the project's piece."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple
from weakref import WeakKeyDictionary

import msgspec
import numpy as np
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.body.motion import Motion
from motionmind.body.rates import FILM_FPS
from motionmind.corpus import store
from motionmind.corpus.recordings import POSTURE_RATE_FPS
from motionmind.errors import MotionMindError
from motionmind.render.markup import base64_of
from motionmind.studio import api
from motionmind.studio.attractor_map import drawn, map_of
from motionmind.studio.edits import Arrange, Block
from motionmind.studio.forecast import CAUTION_RATIO, Forecast, forecast
from motionmind.studio.piece import State, arranged
from motionmind.studio.project import RefusedError
from motionmind.studio.varying import (
    STEPS_PER_PLACE,
    Clock,
    Clocks,
    Estimates,
    Kept,
    Proposal,
    Unit,
    Wanted,
    kept_in,
    units_of,
    vary_blocks,
)
from motionmind.studio.view import view_of

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio

_MAX_ESTIMATED_UNITS = 800  # estimates between all pairs of them take 1.5 s


class _Estimated(NamedTuple):
    """The latest estimates, which every turn of a dial needs again; `held` keeps the ids in `asked` from reuse."""

    asked: list[Any]
    held: tuple[Any, ...]
    estimates: Estimates


_latest: WeakKeyDictionary[Studio, _Estimated] = WeakKeyDictionary()


class Wish(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The page's request: the fields of `Wanted`, and ids of stretches of the piece that stay."""

    flow: str = "lorenz"
    depart: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] = 0.25
    nudge: float | None = None
    start: tuple[float, float, float] | None = None
    stretch: Annotated[int, msgspec.Meta(ge=1, le=100)] = 1
    inserted: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] | None = None
    kept: Annotated[tuple[Kept, ...], msgspec.Meta(max_length=1_000)] = ()
    stay: Annotated[tuple[str, ...], msgspec.Meta(max_length=1_000)] = ()

    def wanted(self, kept: tuple[Kept, ...]) -> Wanted:
        """Return the request with all stretches that stay."""
        return Wanted(self.flow, self.depart, self.nudge, self.start, self.stretch, self.inserted, kept)


class Ordering(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A proposed order to make the piece, and the `basis` of the proposal."""

    edit: Arrange
    basis: Annotated[str, msgspec.Meta(max_length=64)]
    window: api.Window


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes for variations."""

    async def attractor(request: Request) -> Response:
        found = await run_in_threadpool(map_of, request.query_params.get("flow", "lorenz"))
        return api.json(found | {"points": encoded(found["points"])})

    async def vary(request: Request) -> Response:
        return api.json(await propose(studio, await api.body_of(request, Wish)))

    async def accept(request: Request) -> Response:
        """Make a proposed order the piece, unless the piece has changed since."""
        given = await api.body_of(request, Ordering)
        if given.basis != basis_of(studio.project.state):
            return api.error("the piece has changed: look at its variation again", 412)
        try:
            studio.project.edit(given.window, given.edit)
        except RefusedError as refusal:
            return api.error(str(refusal), 409)
        return api.json(studio.view(given.window))

    return [
        Route("/api/vary/map", attractor),
        Route("/api/vary", vary, methods=["POST"]),
        Route("/api/vary/accept", accept, methods=["POST"]),
    ]


async def propose(studio: Studio, wish: Wish) -> dict[str, Any]:
    """Return a variation of the piece, as the page sees it.

    Raises:
        MotionMindError: there is nothing to vary, or the request cannot be met.
    """
    project = studio.project
    state = project.state
    if missing := project.missing:
        raise MotionMindError(f"cannot vary the piece: {missing[0]}")
    base = base_of(state)
    locked = locked_in(state)
    asked = [one for one in wish.kept if one.block.id not in locked]
    known = {block.source for block in (*base, *state.blocks, *(one.block for one in asked))}
    recorded = _rate_of(state.corpus, studio)
    clocks = {source: clock_of(project.movements.get(source), recorded) for source in known}
    for one in asked:
        if one.block.first > one.block.last or one.block.last >= len(clocks[one.block.source].times):
            raise MotionMindError("a kept stretch no longer exists: choose again")
    staying = (locked | set(wish.stay)) - {one.block.id for one in asked}
    total, standing = standing_in(state, clocks.__getitem__)
    kept = (*asked, *(one for one in standing if one.block.id in staying))
    unlimited = ""

    def insertions(units: Sequence[Unit]) -> Estimates | None:
        """Return the estimates; None, and note why, if there can be none."""
        nonlocal unlimited
        try:
            return _estimates(studio, units, clocks.__getitem__)
        except MotionMindError as error:
            unlimited = f"Insertions are not limited: {error}."
            return None

    # In a thread: a long piece first takes some seconds, and the server must answer meanwhile.
    found = await run_in_threadpool(
        vary_blocks,
        base,
        wish.wanted(kept),
        clocks.__getitem__,
        present=state.blocks,
        total=total,
        used=state.used,
        insertions=None if wish.inserted is None else insertions,
    )
    try:
        foreseen: Forecast | None = await run_in_threadpool(forecast, studio, arranged(state, found.blocks))
    except MotionMindError:
        foreseen = None
    return _shown(studio, state, base, found, locked, wish) | {"unlimited": unlimited, "forecast": foreseen}


def _estimates(studio: Studio, units: Sequence[Unit], clocks: Clocks) -> Estimates:
    """Estimate the insertions between units, with caution."""
    from motionmind.variation.insertion_times import estimate_insertions
    from motionmind.variation.piece import Piece
    from motionmind.variation.seams import TransitionTest

    if len(units) > _MAX_ESTIMATED_UNITS:
        raise MotionMindError(f"the piece has {len(units):,} postures, more than {_MAX_ESTIMATED_UNITS}")
    engine = studio.engine(studio.project.state.corpus)
    keys = ["~" * unit.mirrored + unit.source for unit in units]
    motions = [studio.project.movements.get(key) for key in keys]
    asked = [id(engine), *map(id, motions), *units]
    if (latest := _latest.get(studio)) and latest.asked == asked:
        return latest.estimates
    test = TransitionTest(engine)
    for motion in motions:
        test.check_skeleton(motion.posture(0))
    firsts = [unit.first for unit in units]
    times = [clocks(unit.source).times for unit in units]
    durations = np.array(
        [own[min(unit.last + 1, len(own) - 1)] - own[unit.first] for own, unit in zip(times, units, strict=True)]
    )
    durations = np.maximum(durations, 1e-3)  # the last frame of a movement leads nowhere
    durations = durations / [unit.pace for unit in units] + [unit.hold for unit in units]
    postures = Motion(
        motions[0].skeleton,
        np.stack([motion.rotations[first] for motion, first in zip(motions, firsts, strict=True)]),
        np.stack([motion.root[first] for motion, first in zip(motions, firsts, strict=True)]),
        np.append(0.0, np.cumsum(durations[:-1])),
    )
    seconds = CAUTION_RATIO * estimate_insertions(Piece(postures, np.arange(len(units))), test)
    estimates = Estimates(seconds, durations)
    _latest[studio] = _Estimated(asked, (engine, *motions), estimates)
    return estimates


def _shown(
    studio: Studio, state: State, base: tuple[Block, ...], found: Proposal, locked: set[str], wish: Wish
) -> dict[str, Any]:
    project, order = studio.project, found.order

    def view(blocks: tuple[Block, ...]) -> dict[str, Any]:
        return view_of(
            arranged(state, blocks), project.finding, project.marks, project.movements.title, project.standing
        )

    steps = np.diff(order.indices)
    about = {
        "words": "vary the piece",
        "variation": {
            "flow": wish.flow,
            "nudge": order.nudge,
            "start": wish.start,
            "stretch": wish.stretch,
        },
        "original": msgspec.to_builtins(base),
        "places": {block.id: place for block, place in zip(found.blocks, found.places, strict=True)},
        "count": found.count,
    }
    return {
        "piece": view(found.blocks),
        "original": view(base)["parts"],
        "places": found.places,
        "count": found.count,
        "kept": sorted(found.kept),
        "locked": sorted(locked),
        "departs": order.departs,
        "nudge": order.nudge,
        "every": STEPS_PER_PLACE if len(drawn(order.other)) == len(order.other) else 1,
        "trail": encoded(drawn(order.piece)),
        "other": encoded(drawn(order.other)),
        "jumps": (np.flatnonzero((steps != 0) & (steps != 1)) + 1).tolist(),
        "about": about,
        "basis": basis_of(state),
    }


def basis_of(state: State) -> str:
    """Return the hash, in hexadecimal, of all that variations of a piece depend on: pieces with the same hash have
    the same variations.

    >>> from motionmind.studio.edits import Insert, Trim
    >>> from motionmind.studio.settings import SetTitle
    >>> from motionmind.studio.piece import State, apply
    >>> piece = apply(State(), Insert("b1", "ballet/adagio", 0, 40))
    >>> [basis_of(apply(piece, edit)) == basis_of(piece) for edit in (SetTitle("Swan"), Trim("b1", 0, 20))]
    [True, False]
    """
    rests_on = [state.corpus, state.blocks, sorted(locked_in(state)), state.about]
    return hashlib.sha256(msgspec.json.encode(rests_on, order="sorted")).hexdigest()[:32]


def encoded(points: list[list[float]]) -> str:
    """Encode points for the page: float32 in base64."""
    return base64_of(np.array(points, dtype="<f4").tobytes())


def base_of(state: State) -> tuple[Block, ...]:
    """Return the stretches to vary: the original of a varied piece, or the piece itself if it has other frames."""
    given = state.about.get("original")
    try:
        base = msgspec.convert(given, type=tuple[Block, ...])
    except msgspec.ValidationError:
        return state.blocks
    whole = all(any(_holds(one, block) for one in base) for block in state.blocks)
    return base if base and whole else state.blocks


def _holds(one: Block, block: Block) -> bool:
    kinds = [(each.source, each.mirrored, each.hold, each.pace) for each in (one, block)]
    same = kinds[0] == kinds[1]
    return same and one.first <= block.first and block.last <= one.last


def standing_in(state: State, clocks: Clocks) -> tuple[int, tuple[Kept, ...]]:
    """Return the number of units of the piece, and its stretches with their places.

    A variation leaves out repeated units; they count as long as its order has not changed.
    """
    places, count = state.about.get("places"), state.about.get("count")
    if isinstance(places, dict) and isinstance(count, int) and list(places) == [block.id for block in state.blocks]:
        return count, tuple(Kept(block, places[block.id]) for block in state.blocks)
    kept = kept_in(state.blocks, {block.id for block in state.blocks}, clocks)
    return sum(len(units_of([block], clocks)) for block in state.blocks), kept


def locked_in(state: State) -> set[str]:
    """Return the ids of the stretches beside locked insertions, which must stay for the insertion to stay."""
    return {name for seam in state.seams if seam.verdict.decision == "locked" for name in seam.pair}


def clock_of(motion: Motion, rate: float) -> Clock:
    """Return the clock of a movement: a recording has units at `rate`, any other movement has a unit for each frame."""
    recorded = len(motion) > 1 and not motion.keyframed and motion.fps >= FILM_FPS
    return Clock(motion.times, rate if recorded else None)


def _rate_of(corpus: str, studio: Studio) -> float:
    """Return a corpus's rate, postures a second."""
    folder = store.list_corpora(studio.home).get(corpus)
    rate = store.read_manifest(folder).get("rate") if folder else None
    return float(rate) if isinstance(rate, int | float) and rate > 0.0 else POSTURE_RATE_FPS
