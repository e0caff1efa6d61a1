"""The studio's ASGI application: the routes of its parts and the page's files, behind the guard."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from itertools import chain

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route, Router

from motionmind.studio import api, between, export, imports, posing, seams, varied
from motionmind.studio.answers import Entering
from motionmind.studio.guard import ENTER_PATH, Application, Guard, Message, Receive, Send, policy
from motionmind.studio.pages import read_page
from motionmind.studio.schema import document
from motionmind.studio.studio import Studio
from motionmind.studio.token import Keys

_PARTS = (api, seams, between, export, varied, imports, posing)  # with a function `routes` each


def app(studio: Studio, keys: Keys, host: str, port: int) -> Application:
    """Build the application of a studio.

    Args:
        studio: the studio.
        keys: admits requests.
        host: the name or address that the server listens on.
        port: its port.
    """

    @asynccontextmanager
    async def lifespan(_: object) -> AsyncIterator[None]:
        studio.start()
        smoothing = asyncio.create_task(seams.keep_smooth(studio))
        yield
        studio.events.close()
        smoothing.cancel()
        with suppress(asyncio.CancelledError):
            await smoothing
        studio.close()

    routes = [*_open_routes(keys, port), *chain.from_iterable(part.routes(studio) for part in _PARTS)]
    router = Router(routes, redirect_slashes=False, lifespan=lifespan)

    async def routed(scope: Message, receive: Receive, send: Send) -> None:
        scope["app"] = router  # otherwise the router answers unknown paths itself, in plain text
        await router(scope, receive, send)

    return Guard(routed, host, port, keys)


def _open_routes(keys: Keys, port: int) -> list[BaseRoute]:
    """Return the routes that reveal nothing about the project."""
    page = read_page()
    headers = {"content-security-policy": policy(page.script)}

    async def file(request: Request) -> Response:
        if (found := page.files.get(request.url.path)) is None:
            return api.error("not found", 404)
        lasting = "no-cache" if request.url.path == "/" else api.FOREVER
        sent = headers | {"etag": found.tag, "cache-control": lasting}
        if request.headers.get("if-none-match") == found.tag:
            return Response(status_code=304, headers=sent)
        return Response(found.data, media_type=found.type, headers=sent)

    async def health(_: Request) -> Response:
        return api.json({"ready": True})

    async def enter(request: Request) -> Response:
        given = await api.body_of(request, Entering)
        if not keys.admits(given.token):
            return api.error("this address belongs to another studio: open the one shown in the terminal", 403)
        answer = api.json({})
        answer.headers["set-cookie"] = keys.cookie(port)
        return answer

    async def schema(_: Request) -> Response:
        return api.json(document())

    return [
        Route("/", file),
        Route("/page/{path:path}", file),
        Route("/player/{path:path}", file),
        Route("/health", health),
        Route(ENTER_PATH, enter, methods=["POST"]),
        Route("/api/schema", schema),
    ]
