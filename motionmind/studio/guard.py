"""The guard between the network and the studio: it checks the origin, authorisation, size and time of each request.

A foreign page in the user's browser cannot reach the studio: after DNS rebinding, its requests have a foreign Host; its
cross-origin requests have its own Origin, lack the header that requires a CORS preflight, and carry no cookie.
"""

from __future__ import annotations

import asyncio
import ipaddress
import json
import sys
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from typing import Any
from urllib.parse import urlsplit

from starlette.exceptions import HTTPException
from starlette.routing import compile_path

from motionmind.display import printable
from motionmind.errors import MotionMindError
from motionmind.studio.token import Keys
from motionmind.studio.uploads import MAX_UPLOAD_BYTES

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]

ENTER_PATH, CHALLENGE_PATH, RENEW_PATH = "/api/enter", "/api/challenge", "/api/renew"
_UPLOAD_PATH = "/api/imports"
# The routes of the look-only link; all others are closed to it, and so are new ones.
LOOKING = (
    ("GET", "/api/project"),
    ("GET", "/api/events"),
    ("GET", "/api/movements/{key:path}"),
    ("GET", "/api/thumbnails/{key:path}/{frame}.png"),
    ("GET", "/api/credits"),
    ("GET", "/api/ensemble"),
    ("POST", "/api/comments"),
)
_LOOKING_PATTERNS = [(method, compile_path(path)[0]) for method, path in LOOKING]
_IS_LOOKING = "motionmind.is_looking"  # in the scope of a request
_SECURITY_HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "x-frame-options": "DENY",
}


def policy(*scripts: str) -> str:
    """Return the Content-Security-Policy of a page that runs only inline scripts with these hashes."""
    inline = "".join(f" '{script}'" for script in scripts)
    return (
        f"default-src 'none'; script-src 'self'{inline}; style-src 'self'; img-src 'self' blob: data:; "
        "connect-src 'self'; media-src 'self' blob:; font-src 'self'; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'"
    )


def is_looking(scope: Message) -> bool:
    """Return whether a request that the guard admitted came by the look-only link."""
    return bool(scope.get(_IS_LOOKING, False))


class TooLargeError(Exception):
    """The body of a request exceeds the limit."""


class Guard:
    """An ASGI application that guards another."""

    def __init__(self, application: Application, host: str, port: int, keys: Keys, *, seconds: float = 20.0) -> None:
        """Guard an application.

        Args:
            application: the application.
            host: the name or address that the server listens on.
            port: its port.
            keys: admits requests.
            seconds: time limit to receive the body of a request, except for uploads.
        """
        self._application, self._port, self._keys, self._seconds = application, port, keys, seconds
        names = {"127.0.0.1", "::1", "localhost", host.lower().strip("[]")}
        self._names = names
        # A server that listens on all addresses is reached by any of them.
        self._any_address = host in ("0.0.0.0", "::", "")

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] == "lifespan":
            await self._application(scope, receive, send)
            return
        if scope["type"] != "http":
            return
        has_begun = False

        async def sent(message: Message) -> None:
            nonlocal has_begun
            if message["type"] == "http.response.start":
                has_begun = True
                message = {**message, "headers": _with_headers(message.get("headers", ()), scope["path"])}
            await send(message)

        async def refuse(status: int, words: str) -> None:
            if not has_begun:  # otherwise the connection breaks off, which the client notices
                await _answer(sent, status, words)

        if fault := self._fault(scope):
            await refuse(*fault)
            return
        most, seconds = _max_bytes(scope["path"]), 120.0 if scope["path"] == _UPLOAD_PATH else self._seconds
        try:
            await self._application(scope, _limited(receive, most, seconds), sent)
        except TimeoutError:
            await refuse(408, f"the request took longer than {seconds:g} s")
        except TooLargeError:
            await refuse(413, f"request too large: at most {most // 2**20} MB")
        except MotionMindError as error:
            await refuse(400, printable(str(error)))
        except HTTPException as error:
            await refuse(error.status_code, "not found" if error.status_code == 404 else "not allowed")
        except Exception as error:
            print(f"motionmind studio: {type(error).__name__}: {error}", file=sys.stderr)
            await refuse(500, "internal error: see the terminal")

    def _fault(self, scope: Message) -> tuple[int, str] | None:
        """Return the status and message for a request to refuse; None to accept it."""
        headers: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
        return self._foreign(headers, scope["method"]) or self._unwelcome(headers, scope)

    def _foreign(self, headers: Mapping[str, list[str]], method: str) -> tuple[int, str] | None:
        """Return the fault of a request that may come from another page."""
        hosts, origins = headers.get("host", []), headers.get("origin", [])
        if len(hosts) != 1 or not self._is_own(hosts[0]):
            return 403, "wrong host for this studio"
        sites = headers.get("sec-fetch-site", [])
        if any(origin != f"http://{hosts[0]}" for origin in origins) or not {*sites} <= {"same-origin", "none"}:
            return 403, "requests from other pages are not allowed"
        if method in ("GET", "HEAD"):
            return None
        if method not in ("POST", "DELETE"):
            return 405, "unknown method"
        if len(origins) != 1 or headers.get("x-motionmind") != ["studio"]:
            return 403, "requests that write need the headers Origin and X-MotionMind"
        return None

    def _unwelcome(self, headers: Mapping[str, list[str]], scope: Message) -> tuple[int, str] | None:
        """Return the fault of a request that is too large or not authorised; mark one of the look-only link."""
        method, path = scope["method"], scope["path"]
        length = headers.get("content-length", ["0"])[0]
        most = _max_bytes(path)
        if not length.isascii() or not length.isdigit() or len(length) > 15 or int(length) > most:
            return 413, f"request too large: at most {most // 2**20} MB"
        needs_cookie = path.startswith("/api/") and path not in (ENTER_PATH, CHALLENGE_PATH, RENEW_PATH)
        cookies = "; ".join(headers.get("cookie", []))
        if not needs_cookie or self._keys.is_let_in(cookies, self._port):
            return None
        if not self._keys.is_looking(cookies, self._port):
            return 401, "open the studio at the address shown in the terminal"
        if not any(method == allowed and pattern.match(path) for allowed, pattern in _LOOKING_PATTERNS):
            return 403, "this link only lets you look and comment"
        scope[_IS_LOOKING] = True
        return None

    def _is_own(self, host: str) -> bool:
        """Return whether a Host header names this server."""
        try:
            parts = urlsplit(f"//{host}")
            name, port = parts.hostname or "", parts.port or 80
            if port != self._port or parts.username is not None or parts.path:
                return False
            if name in self._names:
                return True
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return self._any_address


def _max_bytes(path: str) -> int:
    """Return the size limit of a request's body."""
    return MAX_UPLOAD_BYTES if path == _UPLOAD_PATH else 4 * 2**20


def _limited(receive: Receive, most: int, seconds: float) -> Receive:
    """Wrap `receive` to raise TooLargeError for a large body, and TimeoutError for one that is incomplete in time."""
    until = asyncio.get_running_loop().time() + seconds
    is_whole, size = False, 0

    async def limited() -> Message:
        nonlocal is_whole, size
        if is_whole:  # the next message reports a disconnect
            return await receive()
        async with asyncio.timeout_at(until):
            message = await receive()
        size += len(message.get("body", b""))
        if size > most:
            raise TooLargeError
        is_whole = message["type"] != "http.request" or not message.get("more_body", False)
        return message

    return limited


def _with_headers(headers: Any, path: str) -> list[tuple[bytes, bytes]]:
    found = {name.lower() for name, _ in headers}
    added = {**_SECURITY_HEADERS, "content-security-policy": policy()}
    if path.startswith("/api/"):
        added["cache-control"] = "no-store"
    more = [(name.encode(), value.encode()) for name, value in added.items() if name.encode() not in found]
    return [*headers, *more]


async def _answer(send: Send, status: int, words: str) -> None:
    body = json.dumps({"error": words}).encode()
    headers = [
        (b"content-type", b"application/json"),
        (b"connection", b"close"),
        (b"content-length", str(len(body)).encode()),
    ]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
