"""The project over HTTP: its state, edits, movement, small pictures, jobs and events."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import aclosing
from typing import Annotated, Any, TypeVar

import msgspec
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import BaseRoute, Route

from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.render.page import player_data
from motionmind.studio.edits import Edit, each
from motionmind.studio.guard import is_looking
from motionmind.studio.movements import STORED
from motionmind.studio.neighbours import MIRRORED
from motionmind.studio.project import RefusedError
from motionmind.studio.settings import SetMusic, SetReference
from motionmind.studio.studio import Studio
from motionmind.studio.thumbnails import THUMBNAIL_HEIGHT_PX

T = TypeVar("T")
Window = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_-]{1,40}\Z")]
_WINDOW_GONE_S = 10.0  # a window closed for longer is gone: a reload takes less
FOREVER = "private, max-age=31536000, immutable"


class Edited(msgspec.Struct, forbid_unknown_fields=True):
    """An edit and the window that makes it."""

    window: Window
    edit: Edit


class Windowed(msgspec.Struct, forbid_unknown_fields=True):
    """The window that undoes or redoes an edit."""

    window: Window


def json(value: Any, status: int = 200) -> Response:
    """Return plain values, which may include numpy numbers, as a JSON response."""
    return Response(msgspec.json.encode(value, enc_hook=float), status, media_type="application/json")


def error(words: str, status: int = 400) -> Response:
    """Return an error response with a one-line message."""
    return json({"error": words}, status)


async def body_of(request: Request, schema: type[T]) -> T:
    """Decode the body of a request; raise MotionMindError if it does not match the schema."""
    try:
        return msgspec.json.decode(await request.body(), type=schema)
    except (ValueError, RecursionError) as problem:
        raise MotionMindError(f"invalid request: {problem}") from problem


def number(text: str | None, words: str) -> int:
    """Parse a whole number; otherwise raise MotionMindError, which names the value with `words`."""
    if text is None or not (text.isascii() and text.isdigit() and len(text) < 10):
        raise MotionMindError(f"{words} must be a whole number")
    return int(text)


def window_of(request: Request) -> str:
    """Return the window that a request names by `?window=`; raise MotionMindError if the name is invalid."""
    try:
        return msgspec.convert(request.query_params.get("window", "-"), Window)
    except msgspec.ValidationError:
        raise MotionMindError("a window's name may contain only letters, digits, - and _") from None


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes."""
    return [*_project_routes(studio), *_movement_routes(studio)]


def _project_routes(studio: Studio) -> list[BaseRoute]:
    async def project(request: Request) -> Response:
        window = window_of(request)
        if is_looking(request.scope):
            with studio.previewing():
                return json(studio.look())
        if window != "-":
            studio.project.greet(window)
        with studio.previewing():
            return json(studio.view(window))

    def written(window: str, write: Callable[[], None]) -> Response:
        """Write, then return the window's view of the project."""
        try:
            write()
        except RefusedError as refusal:
            return error(str(refusal), 409)
        return json(studio.view(window))

    async def edits(request: Request) -> Response:
        given = await body_of(request, Edited)
        # Only this computer may choose a file of it, by /api/reference and /api/music.
        state = studio.project.state
        for kind, own, name in ((SetReference, state.reference, "reference video"), (SetMusic, state.music, "music")):
            if {one.path for one in each(given.edit) if isinstance(one, kind)} - {"", own.path}:
                return error(f"open the {name} first: an edit only shifts or removes the one in the piece", 409)
        return written(given.window, lambda: studio.project.edit(given.window, given.edit))

    async def undo(request: Request) -> Response:
        given = await body_of(request, Windowed)
        return written(given.window, lambda: studio.project.undo(given.window))

    async def redo(request: Request) -> Response:
        given = await body_of(request, Windowed)
        return written(given.window, lambda: studio.project.redo(given.window))

    open_streams = Counter[str]()

    def leave(window: str) -> None:
        if not open_streams[window] and studio.project.forget(window):
            studio.events.send("project", {"sequence": studio.project.sequence, "left": window})

    async def watched(window: str, stream: AsyncGenerator[bytes]) -> AsyncIterator[bytes]:
        """Stream events to a window; some time after it closes, other windows may undo its edits."""
        open_streams[window] += 1
        try:
            async with aclosing(stream):
                async for text in stream:
                    yield text
        finally:
            open_streams[window] -= 1
            asyncio.get_running_loop().call_later(_WINDOW_GONE_S, leave, window)

    async def events(request: Request) -> Response:
        looks = is_looking(request.scope)
        window = "-" if looks else window_of(request)
        project = {"sequence": studio.project.sequence, "notices": len(studio.project.words)}
        first: dict[tuple[str, str], Any] = {("project", ""): project}
        if studio.has_stopped:
            first["smoothing", ""] = {"stopped": True}
        first |= {("job", job.id): job.view() for job in studio.workers.jobs}
        headers = {"cache-control": "no-store"}
        stream = watched(window, studio.events.open(first, is_looking=looks))
        return StreamingResponse(stream, headers=headers, media_type="text/event-stream")

    async def job(request: Request) -> Response:
        try:
            found = studio.workers.find(request.path_params["id"])
        except MotionMindError as missing:
            return error(str(missing), 404)
        if request.method == "DELETE":
            found.cancel()
        return json(found.view())

    return [
        Route("/api/project", project),
        Route("/api/edits", edits, methods=["POST"]),
        Route("/api/undo", undo, methods=["POST"]),
        Route("/api/redo", redo, methods=["POST"]),
        Route("/api/events", events),
        Route("/api/jobs/{id}", job, methods=["GET", "DELETE"]),
    ]


def _movement_routes(studio: Studio) -> list[BaseRoute]:
    def is_hidden(request: Request, key: str) -> bool:
        return is_looking(request.scope) and not studio.has_shown(key)

    async def movement(request: Request) -> Response:
        key = request.path_params["key"]
        if is_hidden(request, key):
            return error(f"the piece has no movement {displayed(key)}", 404)
        try:
            with studio.previewing():
                motion = studio.movements.get(key)
        except MotionMindError as missing:
            return error(str(missing), 404)
        with studio.previewing():
            answer = json(player_data(motion) | {"name": studio.movements.title(key)})
        if key.lstrip(MIRRORED).startswith(STORED):
            answer.headers["cache-control"] = FOREVER
        return answer

    async def picture(request: Request) -> Response:
        key, frame = request.path_params["key"], number(request.path_params["frame"], "a frame")
        height = number(request.query_params.get("height", str(THUMBNAIL_HEIGHT_PX)), "the height")
        if is_hidden(request, key):
            return error(f"the piece has no movement {displayed(key)}", 404)
        stable = studio.project.state.stable(key)
        try:
            with studio.previewing():
                motion = studio.movements.get(stable)
        except MotionMindError as missing:
            return error(str(missing), 404)
        with studio.previewing():  # which the thread inherits
            drawn = await studio.thumbnails.draw(stable, motion, frame, height)
        lasting = FOREVER if stable == key and stable.lstrip("~").startswith("m-") else "private, max-age=60"
        return Response(drawn, media_type="image/png", headers={"cache-control": lasting})

    return [
        Route("/api/movements/{key:path}", movement),
        Route("/api/thumbnails/{key:path}/{frame}.png", picture),
    ]
