"""From A to B: the gallery of postures, alternatives between two of them, and adding one to the piece."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.body.motion import Motion
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.render.page import player_data
from motionmind.studio.alternatives import MAX_ALTERNATIVES, Account, Spread, account, find, usual_likelihoods
from motionmind.studio.api import FOREVER, Window, body_of, error, json, window_of
from motionmind.studio.asks import MAX_INSERTION_S, Ask, Frame, Key, Reach
from motionmind.studio.edits import Choose, Edit, Insert, Several, Single, Wish
from motionmind.studio.findings import Finding, Found
from motionmind.studio.neighbours import End, key_of
from motionmind.studio.piece import State
from motionmind.studio.project import RefusedError
from motionmind.studio.questions import question_of
from motionmind.studio.sides import options_of, sides_of
from motionmind.studio.thumbnails import THUMBNAIL_HEIGHT_PX
from motionmind.studio.worker_loop import engine_of

if TYPE_CHECKING:
    from motionmind.studio.sides import Sides
    from motionmind.studio.studio import Studio
    from motionmind.studio.workers import Report


_COMPOSING_S = 0.5  # for clips; those of learned corpora come at once
_MAX_SEARCHES = 8
_MAX_DESKS = 32  # windows


class Place(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A posture: a frame of a movement."""

    key: Key
    frame: Frame = 0


class Between(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request for movement between two postures; `options` are as for a seam, and `spread` as in `find`."""

    a: Place
    b: Place
    options: Ask = Ask()
    spread: Spread = "usual"


class Named(Place, frozen=True, forbid_unknown_fields=True):
    """A posture and its title."""

    title: Annotated[str, msgspec.Meta(max_length=400)] = ""


class Desk(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A window's settings: both postures, the duration (0: automatic), reaches, how far alternatives go, its search.

    `chosen` is the chosen alternative, from 0, and `shown` says whether the alternatives are in view.
    """

    a: Named | None = None
    b: Named | None = None
    seconds: Annotated[float, msgspec.Meta(ge=0.0, le=MAX_INSERTION_S)] = 0.0
    reaches: Annotated[tuple[Reach, ...], msgspec.Meta(max_length=20)] = ()
    spread: Spread = "usual"
    job: Annotated[str, msgspec.Meta(max_length=40)] | None = None
    chosen: Annotated[int, msgspec.Meta(ge=0, lt=MAX_ALTERNATIVES)] = 0
    shown: bool = False


class DeskKeeping(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to keep what a window has set, for a reload."""

    window: Window
    desk: Desk


class Acceptance(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to add one of a job's alternatives, counted from 1, to the piece."""

    job: Annotated[str, msgspec.Meta(max_length=40)]
    alternative: Annotated[int, msgspec.Meta(ge=1, le=MAX_ALTERNATIVES)]
    window: Window


def search(report: Report, corpus: str, sides: Sides, options: dict[str, Any], spread: Spread) -> None:
    """Find alternatives in a worker, and report each as soon as it is found: a motion and its `Account`.

    Args:
        report: called with the progress and each alternative.
        corpus: name of the corpus.
        sides: both postures.
        options: options of the engine.
        spread: how far the alternatives may go from the best movement.
    """
    engine = engine_of(corpus)
    own = usual_likelihoods(engine)
    found = find(engine, sides.a, sides.b, spread=spread, before=sides.before, after=sides.after, **options)
    first: Motion | None = None
    for number, tween in enumerate(found, start=1):
        described = account(tween, engine.corpus, own, first)
        first = first or tween.motion
        report(number, MAX_ALTERNATIVES, "searching for more", (tween.motion, described))


class _Search:
    """A search and its alternatives so far.

    Attributes:
        asked: the request, with stable keys.
        question: the question that a seam between the two postures would have.
        found: the movements and their accounts.
    """

    def __init__(self, asked: Between, question: str) -> None:
        self.asked, self.question = asked, question
        self.found: list[tuple[Motion, Account]] = []

    def take(self, found: tuple[Motion, Account]) -> dict[str, Any]:
        """Add an alternative, and return it as the page sees it."""
        self.found.append(found)
        motion, said = found
        shown: dict[str, Any] = msgspec.to_builtins(said)
        return shown | {"number": len(self.found), "seconds": _seconds(motion)}


class _Desks:
    """Request handlers, the searches whose alternatives can still be accepted, and what each window has set."""

    def __init__(self, studio: Studio) -> None:
        self._studio = studio
        self._searches: OrderedDict[str, _Search] = OrderedDict()
        self._kept: OrderedDict[str, Desk] = OrderedDict()
        self._composing: set[asyncio.Task[list[dict[str, Any]]]] = set()

    async def keep(self, request: Request) -> Response:
        """Keep what a window has set."""
        asked = await body_of(request, DeskKeeping)
        self._kept[asked.window] = asked.desk
        self._kept.move_to_end(asked.window)
        while len(self._kept) > _MAX_DESKS:
            self._kept.popitem(last=False)
        return json({})

    async def kept(self, request: Request) -> Response:
        """Return what a window has set; its search only if its alternatives can still be accepted."""
        desk = self._kept.get(window_of(request), Desk())
        return json(desk if desk.job in self._searches else msgspec.structs.replace(desk, job=None))

    async def gallery(self, request: Request) -> Response:
        """List the postures and clips of the project's corpora, and saved postures.

        Clips that take long to compose, as on a first start, are left out, unless the request asks for the whole.
        """
        project = self._studio.project
        names = dict.fromkeys([project.state.corpus, *project.versions])
        own = [{"key": f"own/{name}", "title": name} for name in project.state.postures]
        here = [name for name in names if name and self._studio.movements.has(name)]
        patience = None if "whole" in request.query_params else _COMPOSING_S
        with self._studio.previewing():  # which the threads inherit
            listed = [await self._listed(name, patience) for name in here]
        corpora = [one | {"clips": one["clips"] or []} for one in listed]
        return json({"corpora": corpora, "own": own, "whole": all(one["clips"] is not None for one in listed)})

    async def _listed(self, name: str, patience: float | None) -> dict[str, Any]:
        """List a corpus; its clips are None if they take longer than some seconds."""
        movements = self._studio.movements
        clips = asyncio.create_task(asyncio.to_thread(movements.clips, name))
        self._composing.add(clips)
        clips.add_done_callback(self._composed)
        found = await asyncio.to_thread(lambda: movements.collection(name).postures)
        postures = [{"key": f"{name}/{posture}", "title": displayed(posture)} for posture in found]
        ready, _ = await asyncio.wait([clips], timeout=patience)
        return {"name": displayed(name), "postures": postures, "clips": clips.result() if ready else None}

    def _composed(self, clips: asyncio.Task[list[dict[str, Any]]]) -> None:
        """Forget a task; a request for the whole reports its error."""
        self._composing.discard(clips)
        _ = clips.cancelled() or clips.exception()

    async def ask(self, request: Request) -> Response:
        """Start a search."""
        asked = await body_of(request, Between)
        project, movements = self._studio.project, self._studio.movements
        a, b = (Place(project.state.stable(place.key), place.frame) for place in (asked.a, asked.b))
        ends = End(a.key, a.frame, moves=False), End(b.key, b.frame, moves=False)
        for place in (a, b):
            movements.get(place.key).posture(place.frame)  # raises if there is none
        sides = sides_of(ends, movements.get, movements.facing(project.state.corpus))
        options = options_of(asked.options, sides.a.skeleton, movements.get)
        corpus = project.state.corpus
        question = question_of(ends, asked.options, corpus, project.versions)
        seeking = _Search(Between(a, b, asked.options, asked.spread), question)
        given = corpus, sides, options, asked.spread
        job = self._studio.workers.submit("between", search, *given, collect=seeking.take, urgent=True)
        self._searches[job.id] = seeking
        while len(self._searches) > _MAX_SEARCHES:
            self._searches.popitem(last=False)
        return json({"job": job.id})

    async def movement(self, request: Request) -> Response:
        """Return one of a search's movements, in the player's format."""
        return json(player_data(self._movement(request), 0))

    async def picture(self, request: Request) -> Response:
        """Return a small picture of a frame of one of a search's movements."""
        job, number, frame = (request.path_params[name] for name in ("job", "number", "frame"))
        motion = self._movement(request)
        drawn = await self._studio.thumbnails.draw(f"{job}/{number}", motion, frame, THUMBNAIL_HEIGHT_PX)
        return Response(drawn, media_type="image/png", headers={"cache-control": FOREVER})

    def _movement(self, request: Request) -> Motion:
        """Return the movement that a request names."""
        found = self._found(request.path_params["job"]).found
        number = request.path_params["number"]
        if not 1 <= number <= len(found):
            raise MotionMindError(f"no alternative {number}: there are {len(found)}")
        motion: Motion = found[number - 1][0]
        return motion

    async def accept(self, request: Request) -> Response:
        """Add an alternative to the piece."""
        asked = await body_of(request, Acceptance)
        seeking, project = self._found(asked.job), self._studio.project
        if asked.alternative > len(seeking.found):
            raise MotionMindError(f"no alternative {asked.alternative}: there are {len(seeking.found)}")
        insertions = tuple(
            Found(self._studio.movements.keep(motion, said.words), _seconds(motion), said.line())
            for motion, said in seeking.found
        )
        words = "from one posture to the other"
        finding = Finding(seeking.question, abrupt=True, words=words, insertions=insertions)
        known = [one.key for one in project.keep_finding(finding).insertions or ()]
        alternative = 1 + known.index(insertions[asked.alternative - 1].key)
        try:
            project.edit(asked.window, accepted(project.state, seeking.asked, alternative))
        except RefusedError as refusal:
            return error(str(refusal), 409)
        return json(self._studio.view(asked.window))

    def _found(self, job: str) -> _Search:
        if job not in self._searches:
            raise MotionMindError("these alternatives have expired: search again")
        return self._searches[job]


def accepted(state: State, asked: Between, alternative: int) -> Edit:
    """Return the edit that adds an alternative to a piece: A (unless the piece ends with it), B, and the choice.

    Args:
        state: the piece.
        asked: both postures and the options.
        alternative: its number among the insertions that are known for the question, from 1.
    """
    last = state.blocks[-1] if state.blocks else None
    edits: list[Single] = []
    if last and (key_of(last), last.first, last.last) == (asked.a.key, asked.a.frame, asked.a.frame):
        left = last.id
    else:
        left = _new(state)
        edits.append(Insert(left, asked.a.key, asked.a.frame, asked.a.frame))
    right = _new(state, left)
    edits.append(Insert(right, asked.b.key, asked.b.frame, asked.b.frame))
    if asked.options != Ask():
        edits.append(Wish(left, right, **msgspec.structs.asdict(asked.options)))
    edits.append(Choose(left, right, alternative))
    return Several(tuple(edits), "go from A to B")


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes for the gallery and for searches from A to B."""
    desk = _Desks(studio)
    return [
        Route("/api/desk", desk.kept),
        Route("/api/desk", desk.keep, methods=["POST"]),
        Route("/api/gallery", desk.gallery),
        Route("/api/between", desk.ask, methods=["POST"]),
        Route("/api/between/accept", desk.accept, methods=["POST"]),
        Route("/api/between/{job}/{number:int}", desk.movement),
        Route("/api/between/{job}/{number:int}/{frame:int}.png", desk.picture),
    ]


def _new(state: State, *taken: str) -> str:
    """Return an id that no block has or had."""
    number = len(state.used) + 1
    while f"b{number}" in state.used or f"b{number}" in taken:
        number += 1
    return f"b{number}"


def _seconds(motion: Motion) -> float:
    return float(motion.times[-1] - motion.times[0])
