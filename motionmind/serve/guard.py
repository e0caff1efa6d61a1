"""The guard between the network and the application: it checks the origin, route and time of each request."""

from __future__ import annotations

import asyncio
import ipaddress
import json
import sys
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import urlsplit

from motionmind.serve.mmcp import CERTIFICATE

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]

ROUTES = {("GET", "/capabilities"), ("POST", "/generate")}


class Guard:
    """An ASGI application that guards another.

    It answers only the protocol's two routes. A foreign page in a browser cannot use the server: its requests have a
    foreign Origin and, after DNS rebinding, a foreign name as Host; the guard accepts only IP addresses, `localhost`
    and the server's given name. It drops slow bodies, and reports internal errors as one line.
    """

    def __init__(self, application: Application, host: str, *, seconds: float = 20.0) -> None:
        """Guard an application.

        Args:
            application: the application.
            host: the name or address that the server was given.
            seconds: time limit to receive the body of a request.
        """
        self._application, self._seconds = application, seconds
        self._names = {"localhost", host.lower()}

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] == "lifespan":
            await self._application(scope, receive, send)
            return
        if scope["type"] != "http":
            return
        if fault := self._fault(scope):
            await _refuse(send, *fault)
            return
        answer = _Answer()
        try:
            await self._application(scope, _in_time(receive, self._seconds), answer.take)
        except TimeoutError:
            await _refuse(send, 408, "timeout", f"no complete request within {self._seconds:g} s")
            return
        except OverflowError:
            await _refuse(send, 400, "invalid_request", "a number is out of range")
            return
        except Exception as error:
            print(f"motionmind serve: {type(error).__name__}: {error}", file=sys.stderr)
            await _refuse(send, 500, "internal_error", "internal error: see the output of the server")
            return
        await answer.give(send)

    def _fault(self, scope: Message) -> tuple[int, str, str] | None:
        """Return the status, code and message for a request to refuse; None to accept it."""
        headers = [(name.lower(), value.decode("latin-1")) for name, value in scope["headers"]]
        hosts = [value for name, value in headers if name == b"host"]
        if len(hosts) != 1 or not self._is_own(hosts[0]):
            return 403, "forbidden", "Host must be an IP address, localhost or the name of the server (--host)"
        if any(name == b"origin" and urlsplit(value).netloc != hosts[0] for name, value in headers):
            return 403, "forbidden", "Origin must be that of the server"
        method, path = scope["method"], scope["path"]
        if (method, path) not in ROUTES:
            known = any(path == one for _, one in ROUTES)
            return 405 if known else 404, "invalid_request", "use GET /capabilities or POST /generate"
        return None

    def _is_own(self, host: str) -> bool:
        try:
            name = urlsplit(f"//{host}").hostname or ""
            if name in self._names:
                return True
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return True


class _Answer:
    """An answer that is held until complete, so that an error on the way can replace it."""

    def __init__(self) -> None:
        self._messages: list[Message] = []

    async def take(self, message: Message) -> None:
        """Keep a message."""
        self._messages.append(message)

    async def give(self, send: Send) -> None:
        """Send the complete answer, with certificates as `extras` of animations."""
        start, *rest = self._messages
        body = b"".join(message.get("body", b"") for message in rest)
        if start["status"] == 200 and CERTIFICATE.encode() in body:
            body = with_extras(body)
        headers = [(name, value) for name, value in start["headers"] if name.lower() != b"content-length"]
        await _send(send, start["status"], headers, body)


def with_extras(body: bytes) -> bytes:
    """Move the certificates in an answer's notes to the `extras` of their animations."""
    document = json.loads(body)
    found = [one["gltf"] for one in document["results"] if "gltf" in one] if "results" in document else [document]
    for gltf in found:
        extension = gltf.get("extensions", {}).get("MMCP_motion", {})
        kept = []
        for note in extension.get("notes", []):
            if note["code"] == CERTIFICATE:
                certificate = {name: note[name] for name in ("message", "corpus", "stretches")}
                gltf["animations"][note["sample"]]["extras"] = {"motionmind": certificate}
            else:
                kept.append(note)
        extension["notes"] = kept
    return json.dumps(document, separators=(",", ":")).encode()


def _in_time(receive: Receive, seconds: float) -> Receive:
    """Wrap `receive` to raise TimeoutError if the body is not complete in time."""
    until = asyncio.get_running_loop().time() + seconds
    is_whole = False

    async def in_time() -> Message:
        nonlocal is_whole
        if is_whole:  # the next message reports a disconnect
            return await receive()
        async with asyncio.timeout_at(until):
            message = await receive()
        is_whole = message["type"] != "http.request" or not message.get("more_body", False)
        return message

    return in_time


async def _refuse(send: Send, status: int, code: str, message: str) -> None:
    body = json.dumps({"error": {"code": code, "message": message, "details": {}}}).encode()
    await _send(send, status, [(b"content-type", b"application/json"), (b"connection", b"close")], body)


async def _send(send: Send, status: int, headers: list[tuple[bytes, bytes]], body: bytes) -> None:
    headers = [*headers, (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
