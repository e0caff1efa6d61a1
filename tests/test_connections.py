"""Clients that are slow, silent or many keep nobody else out of the servers."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Any, NamedTuple

import pytest

uvicorn = pytest.importorskip("uvicorn")

from motionmind.connections import Connection, config  # noqa: E402

LARGE = 16 * 2**20  # bytes of an answer: more than sockets buffer


class Served(NamedTuple):
    """A server in a thread."""

    port: int
    server: Any

    def connect(self, data: bytes = b"") -> socket.socket:
        """Open a connection and send some bytes."""
        connection = socket.create_connection(("127.0.0.1", self.port), timeout=60)
        connection.sendall(data)
        return connection

    def here(self) -> list[Connection]:
        """The open connections, the oldest first."""
        return sorted(self.server.server_state.connections, key=lambda one: one._since)

    def check(self) -> None:
        """Check all connections, as happens after the time that clients have."""
        loop, is_done = self.server.servers[0].get_loop(), threading.Event()

        def check() -> None:
            for one in self.here():
                one.check()
            loop.call_soon(loop.call_soon, is_done.set)  # once the closed connections are gone

        loop.call_soon_threadsafe(check)
        assert is_done.wait(20)


async def application(scope: Any, receive: Any, send: Any) -> None:
    """Answer at once, with much, never, or once the body has come."""
    if scope["type"] != "http":
        return
    path = scope["path"]
    if path == "/body":
        while (await receive()).get("more_body"):
            pass
    if path == "/never":
        await asyncio.sleep(60)
    await send({"type": "http.response.start", "status": 200, "headers": []})
    count = {"/large": 1, "/pieces": 256}.get(path, 0)
    for number in range(count):
        await send({"type": "http.response.body", "body": bytes(LARGE // count), "more_body": number < count})
    await send({"type": "http.response.body", "body": b"done"})


@contextmanager
def serving(loop: str = "auto", **options: Any) -> Iterator[Served]:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        settings = config(application, **({"patience_s": 600.0, "is_known": is_known} | options))
        settings.timeout_graceful_shutdown, settings.loop = 0, loop
        server = uvicorn.Server(settings)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        thread.start()
        until(lambda: server.started)
        try:
            yield Served(listening.getsockname()[1], server)
        finally:
            server.force_exit = server.should_exit = True
            thread.join(20)
            assert not thread.is_alive()


def is_known(scope: Any) -> bool:
    return (b"cookie", b"known") in scope["headers"]


def until(is_so: Callable[[], bool]) -> None:
    end = time.monotonic() + 20
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.01)


def asking(path: str, *more: str) -> bytes:
    return "\r\n".join([f"GET {path} HTTP/1.1", "Host: localhost", *more, "", ""]).encode()


def is_closed(connection: socket.socket) -> bool:
    """Return whether the server has closed a connection, after what it sent."""
    try:
        while connection.recv(1 << 20):
            pass
    except ConnectionResetError:
        return True
    except TimeoutError:
        return False
    return True


def is_answered(served: Served, connection: socket.socket | None = None) -> bool:
    with connection or served.connect() as asked:
        asked.sendall(asking("/", "Connection: close"))
        found = b""
        while part := asked.recv(1 << 16):
            found += part
        return found.endswith(b"done\r\n0\r\n\r\n")


SLOW = {
    "nothing": b"",
    "half a header": b"GET / HTTP/1.1\r\nHost: loc",
    "half a body": b"POST /body HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n{",
    "a large answer unread": asking("/large"),
    "pieces of an answer unread": asking("/pieces"),
    "many answers unread": 100 * asking("/large"),
    "an answer without keeping alive": asking("/large", "Connection: close"),
    "an idle connection": asking("/"),
}


@pytest.mark.parametrize("kind", SLOW)
def test_many_slow_clients_keep_no_other_out(kind: str) -> None:
    most = 10 if "answer" in kind else 100  # large answers take time
    with serving(most=most) as served, ExitStack() as opened:
        for number in range(3 * most):
            if number % (most // 2) == 0:
                assert is_answered(served)
            opened.enter_context(served.connect(SLOW[kind]))
        assert is_answered(served)
        until(lambda: len(served.here()) <= most)


@pytest.mark.parametrize("kind", [kind for kind in SLOW if kind != "half a body"])  # which the guards limit
def test_slow_clients_are_left(kind: str) -> None:
    with serving() as served, served.connect(SLOW[kind]):
        until(lambda: len(served.here()) == 1)
        if kind.startswith(("a large", "pieces", "many", "an answer")):
            until(lambda: served.here()[0].transport.get_write_buffer_size() > 0)
        served.check()  # it has had no time yet
        for _ in range(2):
            served.check()
        assert served.here() == []


@pytest.mark.parametrize("begin", [b"", asking("/"), asking("/", "Content-Length: 1000")])
def test_dripping_headers_or_bodies_postpone_nothing(begin: bytes) -> None:
    with serving(patience_s=0.2) as served, served.connect(begin) as slow:
        until(lambda: len(served.here()) == 1)

        def is_left() -> bool:
            with suppress(OSError):
                slow.sendall(b"x")
            return served.here() == []

        until(is_left)


@pytest.mark.parametrize("loop", ["auto", "asyncio"])
def test_connections_that_come_at_once_replace_one_another(loop: str) -> None:
    begun, going_on = threading.Event(), threading.Event()
    with serving(loop, most=10) as served, ExitStack() as opened:
        served.server.servers[0].get_loop().call_soon_threadsafe(lambda: begun.set() or going_on.wait(20))
        assert begun.wait(20)
        connections = [opened.enter_context(served.connect()) for _ in range(40)]
        going_on.set()
        assert all(is_closed(one) for one in connections[:30])
        until(lambda: len(served.here()) == 10)


def test_what_is_read_in_time_comes_whole() -> None:
    for path in ("/large", "/pieces"):
        with serving() as served, served.connect(asking(path, "Connection: close")) as connection:
            count = 0
            until(lambda: len(served.here()) == 1 and served.here()[0].transport.get_write_buffer_size() > 0)
            while part := connection.recv(1 << 20):
                before, count = count, count + len(part)
                if count * 8 // LARGE > before * 8 // LARGE and served.here():
                    unsent = served.here()[0]._unsent
                    until(lambda: not served.here() or changed(served.here()[0], unsent))  # noqa: B023
                    served.check()
            assert count > LARGE


def changed(connection: Connection, unsent: int) -> bool:
    return connection._has_advanced or connection.transport.get_write_buffer_size() < unsent


def test_a_request_that_is_being_answered_stays() -> None:
    with serving(most=10) as served, served.connect(asking("/never")) as working, ExitStack() as opened:
        until(lambda: len(served.here()) == 1 and served.here()[0].cycle is not None)
        for _ in range(3):
            served.check()
        for _ in range(30):
            opened.enter_context(served.connect())
            assert is_answered(served)
        working.settimeout(0.1)
        assert not is_closed(working)


def test_connections_of_clients_with_the_key_stay() -> None:
    with serving(most=10) as served, ExitStack() as opened:
        known = opened.enter_context(served.connect(asking("/", "Cookie: known")))
        stranger = opened.enter_context(served.connect(asking("/")))
        for one in (known, stranger):
            assert one.recv(1 << 16)
        for _ in range(30):
            opened.enter_context(served.connect())
            assert is_answered(served)
        assert is_closed(stranger)
        assert is_answered(served, known)


def test_where_all_places_are_of_clients_with_the_key_others_are_sent_away() -> None:
    with serving(most=3) as served, ExitStack() as opened:
        for _ in range(3):
            assert opened.enter_context(served.connect(asking("/", "Cookie: known"))).recv(1 << 16)
        assert is_closed(opened.enter_context(served.connect()))
        assert len(served.here()) == 3
