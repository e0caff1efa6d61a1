"""The studio's ASGI application: the routes of its parts and the page's files, behind the guard."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from itertools import chain

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route, Router

from motionmind.studio import (
    api,
    between,
    casting,
    comments,
    export,
    filming,
    imports,
    keeping,
    music,
    posing,
    printing,
    recent,
    reference,
    scoring,
    seams,
    varied,
)
from motionmind.studio.answers import Asking, Entering, Proving
from motionmind.studio.guard import (
    CHALLENGE_PATH,
    ENTER_PATH,
    RENEW_PATH,
    Application,
    Guard,
    Message,
    Receive,
    Send,
    policy,
)
from motionmind.studio.pages import read_page
from motionmind.studio.schema import document
from motionmind.studio.studio import Studio
from motionmind.studio.token import Keys

# Each has a function `routes`.
_PARTS = (
    api,
    casting,
    seams,
    between,
    comments,
    export,
    filming,
    printing,
    keeping,
    varied,
    imports,
    posing,
    recent,
    reference,
    music,
    scoring,
)


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

    router = Router(routes_of(studio, keys, port), redirect_slashes=False, lifespan=lifespan)

    async def routed(scope: Message, receive: Receive, send: Send) -> None:
        scope["app"] = router  # otherwise the router answers unknown paths itself, in plain text
        await router(scope, receive, send)

    return Guard(routed, host, port, keys)


def routes_of(studio: Studio, keys: Keys, port: int) -> list[BaseRoute]:
    """Return all routes of a studio."""
    own = [*_open_routes(keys, port), *_renewal_routes(keys, port), *_link_routes(studio, keys)]
    return [*own, *chain.from_iterable(part.routes(studio) for part in _PARTS)]


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
        if keys.lets_look(given.token):
            answer = api.json({"looks": True})
            answer.headers["set-cookie"] = keys.looking_cookie(port)
            return answer
        if not keys.admits(given.token):
            return api.error("this address was used or is of another studio: open the one shown in the terminal", 403)
        answer = api.json({"looks": False})
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


def _renewal_routes(keys: Keys, port: int) -> list[BaseRoute]:
    """Return the routes that let a page in again after a restart, and one that opens another page."""
    unknown = "this studio does not know the page: open the address shown in the terminal"

    async def challenge(request: Request) -> Response:
        given = await api.body_of(request, Asking)
        if keys.renewal is None:
            return api.error(unknown, 403)
        number, proof = keys.renewal.prove(given.number)
        return api.json({"number": number, "proof": proof})

    async def renew(request: Request) -> Response:
        given = await api.body_of(request, Proving)
        if keys.renewal is None or not keys.renewal.admits(given.number, given.proof):
            return api.error(unknown, 403)
        answer = api.json({})
        answer.headers["set-cookie"] = keys.cookie(port)
        return answer

    async def renewal(_: Request) -> Response:
        return api.json({"key": keys.renewal.key if keys.renewal else ""})

    async def visit(_: Request) -> Response:
        return api.json({"token": keys.token, "visit": keys.visit()})

    return [
        Route(CHALLENGE_PATH, challenge, methods=["POST"]),
        Route(RENEW_PATH, renew, methods=["POST"]),
        Route("/api/renewal", renewal),
        Route("/api/visit", visit, methods=["POST"]),
    ]


def _link_routes(studio: Studio, keys: Keys) -> list[BaseRoute]:
    """Return the routes by which the owner passes the look-only link on, or replaces it."""

    async def link(request: Request) -> Response:
        if keys.link and request.method == "POST":
            keys.link.replace()
            studio.events.end_looking()
        return api.json({"address": keys.link.address if keys.link else ""})

    return [Route("/api/link", link, methods=["GET", "POST"])]
