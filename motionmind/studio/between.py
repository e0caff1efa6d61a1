"""From A to B: the gallery of postures, alternatives between two of them, and adding one to the piece."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.body.motion import Motion
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.render.page import player_data
from motionmind.studio.alternatives import MAX_ALTERNATIVES, Account, account, find, usual_likelihoods
from motionmind.studio.api import Window, body_of, error, json
from motionmind.studio.edits import Ask, Choose, Edit, Frame, Insert, Key, Pin, Several, Single, Wish
from motionmind.studio.piece import End, Finding, Found, State, key_of
from motionmind.studio.project import RefusedError
from motionmind.studio.questions import question_of
from motionmind.studio.sides import options_of, sides_of
from motionmind.studio.stays import in_place, stays_of
from motionmind.studio.worker_loop import engine_of

if TYPE_CHECKING:
    from motionmind.studio.sides import Sides
    from motionmind.studio.studio import Studio
    from motionmind.studio.workers import Report


class Place(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A posture: a frame of a movement."""

    key: Key
    frame: Frame = 0


class Between(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request for movement between two postures; `options` are as for a seam."""

    a: Place
    b: Place
    options: Ask = Ask()


class Acceptance(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to add one of a job's alternatives, counted from 1, to the piece."""

    job: Annotated[str, msgspec.Meta(max_length=40)]
    alternative: Annotated[int, msgspec.Meta(ge=1, le=MAX_ALTERNATIVES)]
    window: Window


def search(report: Report, corpus: str, sides: Sides, options: dict[str, Any], stays: Sequence[Pin]) -> None:
    """Find alternatives in a worker, and report each as soon as it is found: a motion and its `Account`.

    Args:
        report: called with the progress and each alternative.
        corpus: name of the corpus.
        sides: both postures.
        options: options of the engine.
        stays: hands and feet that stay in place.
    """
    engine = engine_of(corpus)
    own = usual_likelihoods(engine)
    found = find(engine, sides.a, sides.b, before=sides.before, after=sides.after, **options)
    first: Motion | None = None
    for number, tween in enumerate(found, start=1):
        described = account(tween, engine.corpus, own, first)
        first = first or tween.motion
        motion, missed = in_place(tween.motion, stays)
        described = msgspec.structs.replace(described, beyond=[*missed, *described.beyond])
        report(number, MAX_ALTERNATIVES, "searching for more", (motion, described))


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


class _Desk:
    """Request handlers, and the searches whose alternatives can still be accepted."""

    def __init__(self, studio: Studio) -> None:
        self._studio = studio
        self._searches: OrderedDict[str, _Search] = OrderedDict()

    async def gallery(self, _: Request) -> Response:
        """List the postures and clips of the project's corpora, and saved postures."""
        project = self._studio.project
        names = dict.fromkeys([project.state.corpus, *project.versions])
        own = [{"key": f"own/{name}", "title": name} for name in project.state.postures]
        here = [name for name in names if name and self._studio.movements.has(name)]
        return json({"corpora": [self._listed(name) for name in here], "own": own})

    def _listed(self, name: str) -> dict[str, Any]:
        """List a corpus."""
        collection = self._studio.movements.collection(name)
        clips = []
        for clip, about in collection.clips.items():
            motion = self._studio.movements.get(f"{name}/{clip}")
            seen = {"key": f"{name}/{clip}", "title": displayed(clip), "about": displayed(about, 200)}
            clips.append(seen | {"frames": len(motion), "seconds": _seconds(motion)})
        postures = [{"key": f"{name}/{posture}", "title": displayed(posture)} for posture in collection.postures]
        return {"name": displayed(name), "postures": postures, "clips": clips}

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
        seeking = _Search(Between(a, b, asked.options), question)
        given = corpus, sides, options, stays_of(asked.options, sides.a.skeleton)
        job = self._studio.workers.submit("between", search, *given, collect=seeking.take, urgent=True)
        self._searches[job.id] = seeking
        while len(self._searches) > 8:
            self._searches.popitem(last=False)
        return json({"job": job.id})

    async def movement(self, request: Request) -> Response:
        """Return one of a search's movements, in the player's format."""
        found = self._found(request.path_params["job"]).found
        number = request.path_params["number"]
        if not 1 <= number <= len(found):
            raise MotionMindError(f"no alternative {number}: there are {len(found)}")
        return json(player_data(found[number - 1][0], 0))

    async def accept(self, request: Request) -> Response:
        """Add an alternative to the piece."""
        asked = await body_of(request, Acceptance)
        seeking, project = self._found(asked.job), self._studio.project
        if asked.alternative > len(seeking.found):
            raise MotionMindError(f"no alternative {asked.alternative}: there are {len(seeking.found)}")
        edit = accepted(project.state, seeking.asked, asked.alternative)
        insertions = tuple(
            Found(self._studio.movements.keep(motion, said.words), _seconds(motion), words_of(said))
            for motion, said in seeking.found
        )
        words = "from one posture to the other"
        project.keep_finding(Finding(seeking.question, abrupt=True, words=words, insertions=insertions))
        try:
            project.edit(asked.window, edit)
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
        alternative: number of the alternative, from 1.
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
        edits.append(Wish(left, right, asked.options.seconds, asked.options.passing, asked.options.pins))
    edits.append(Choose(left, right, alternative))
    return Several(tuple(edits), "go from A to B")


def words_of(said: Account) -> str:
    """Return an account in one line."""
    return "; ".join(part for part in (said.words, said.differs, said.usual) if part)


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes for the gallery and for searches from A to B."""
    desk = _Desk(studio)
    return [
        Route("/api/gallery", desk.gallery),
        Route("/api/between", desk.ask, methods=["POST"]),
        Route("/api/between/accept", desk.accept, methods=["POST"]),
        Route("/api/between/{job}/{number:int}", desk.movement),
    ]


def _new(state: State, *taken: str) -> str:
    """Return an id that no block has or had."""
    number = len(state.used) + 1
    while f"b{number}" in state.used or f"b{number}" in taken:
        number += 1
    return f"b{number}"


def _seconds(motion: Motion) -> float:
    return float(motion.times[-1] - motion.times[0])
