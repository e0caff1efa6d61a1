"""What stands between the network and the server: hosts, origins, routes, sizes, times, numbers of requests."""

from __future__ import annotations

import http.client
import json
import signal
import socket
import subprocess
import sys
import threading
from contextlib import ExitStack
from pathlib import Path
from time import monotonic
from typing import Any
from urllib.parse import urlsplit

import pytest
from command_line import Run
from served import ask, keyframe, of_ballet, serving

from motionmind.search import solve
from motionmind.serve.guard import Guard
from motionmind.serve.mmcp import app
from motionmind.tween.engine import Engine

POSES = [keyframe(0, of_ballet("arabesque")), keyframe(40, of_ballet("fifth"))]


def send(url: str, method: str, path: str, body: bytes = b"", **headers: str) -> tuple[int, Any]:
    """The status and the JSON that answer a request with some headers."""
    connection = http.client.HTTPConnection(urlsplit(url).netloc, timeout=60)
    try:
        connection.putrequest(method, path, skip_host="Host" in headers)
        for name, value in ({"Content_Length": str(len(body))} | headers).items():
            connection.putheader(name.replace("_", "-"), value)
        connection.endheaders(body)
        answer = connection.getresponse()
        return answer.status, json.loads(answer.read())
    finally:
        connection.close()


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8000", "localhost.evil.example", "127.0.0.1.evil.example", ""]
)
def test_a_host_that_is_a_name_of_others_is_refused(host: str, url: str) -> None:
    status, answer = send(url, "GET", "/capabilities", Host=host)
    assert (status, answer["error"]["code"]) == (403, "forbidden")


@pytest.mark.parametrize("host", ["localhost:{0}", "127.0.0.1:{0}", "[::1]:{0}", "192.168.0.7:{0}"])
def test_addresses_and_localhost_are_taken(host: str, url: str) -> None:
    assert send(url, "GET", "/capabilities", Host=host.format(urlsplit(url).port))[0] == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", "file://"])
def test_pages_of_others_are_refused(origin: str, url: str) -> None:
    for method, path in (("GET", "/capabilities"), ("POST", "/generate")):
        status, answer = send(url, method, path, Origin=origin)
        assert (status, answer["error"]["code"]) == (403, "forbidden")


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/", 404),
        ("GET", "/docs", 404),
        ("GET", "/openapi.json", 404),
        ("GET", "/../../etc/passwd", 404),
        ("GET", "/capabilities/../../etc/passwd", 404),
        ("DELETE", "/capabilities", 405),
        ("GET", "/generate", 405),
    ],
)
def test_there_are_two_routes(method: str, path: str, status: int, url: str) -> None:
    found, answer = send(url, method, path)
    assert (found, answer["error"]["code"]) == (status, "invalid_request")


@pytest.mark.parametrize("body", [b"", b"{", b"[" * 100_000, b"\xff\xfe", b'{"a": NaN', b"null", b"[]", b'"x"'])
def test_a_body_that_is_no_request_is_refused(body: bytes, url: str) -> None:
    status, answer = send(url, "POST", "/generate", body)
    assert (status, answer["error"]["code"]) == (422, "schema_validation")


def test_a_body_that_is_too_large_is_refused_before_it_comes(url: str) -> None:
    status, answer = send(url, "POST", "/generate", Content_Length=str(1 << 40))
    assert (status, answer["error"]["code"]) == (413, "payload_too_large")


def test_a_body_that_comes_slowly_is_dropped() -> None:
    with (
        serving(app(Engine.load("ballet")), seconds=0.3) as url,
        socket.create_connection((urlsplit(url).hostname or "", urlsplit(url).port or 0), timeout=60) as slow,
    ):
        slow.sendall(b"POST /generate HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n{")
        assert b" 408 " in slow.recv(1000)


def test_half_open_connections_keep_nobody_out(url: str) -> None:
    parts = urlsplit(url)
    with ExitStack() as opened:
        for _ in range(300):
            half = opened.enter_context(socket.create_connection((parts.hostname or "", parts.port or 0), timeout=60))
            half.sendall(b"GET /capabilities HTTP/1.1\r\nHost: loc")
        assert send(url, "GET", "/capabilities")[0] == 200


def test_an_error_inside_leaves_as_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    async def broken(scope: Any, receive: Any, send: Any) -> None:
        if scope["type"] == "http":
            raise RuntimeError("/secret/place")

    with serving(broken) as url:
        status, answer = send(url, "GET", "/capabilities")
    assert (status, answer["error"]["code"]) == (500, "internal_error")
    assert "secret" not in json.dumps(answer)
    assert capsys.readouterr().err.count("\n") == 1


def test_a_search_without_end_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    def endless(problem: Any, watch: Any) -> Any:
        while True:
            watch(solve.Progress(1.0, 0.0, 0))

    monkeypatch.setattr("motionmind.tween.engine.solve", endless)
    with serving(app(Engine.load("ballet"), patience=0.2)) as url:
        status, answer = send(url, "POST", "/generate", json.dumps(ask(POSES, 41)).encode())
    assert (status, answer["error"]["code"]) == (504, "timeout")


@pytest.mark.long
def test_a_server_that_ends_does_not_wait_for_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    begun = threading.Event()

    def endless(problem: Any, watch: Any) -> Any:
        while True:
            begun.set()
            watch(solve.Progress(1.0, 0.0, 0))

    monkeypatch.setattr("motionmind.tween.engine.solve", endless)
    body = json.dumps(ask(POSES, 41)).encode()
    with serving(app(Engine.load("ballet"))) as url:
        connection = http.client.HTTPConnection(urlsplit(url).netloc, timeout=60)
        connection.request("POST", "/generate", body)
        assert begun.wait(60)
        began = monotonic()
    connection.close()
    assert monotonic() - began < 60.0


def test_more_requests_than_can_wait_are_sent_away(monkeypatch: pytest.MonkeyPatch) -> None:
    going_on = threading.Event()
    monkeypatch.setattr("motionmind.serve.mmcp.perform", lambda *_: going_on.wait(120) and [])
    found: list[int] = []
    body = json.dumps(ask(POSES, 41)).encode()
    with serving(app(Engine.load("ballet"))) as url:

        def call() -> None:
            found.append(send(url, "POST", "/generate", body)[0])

        threads = [threading.Thread(target=call) for _ in range(9)]
        for thread in threads:
            thread.start()
        until = monotonic() + 60.0
        while len(found) < 4 and monotonic() < until:
            threads[0].join(0.01)
        early = list(found)
        going_on.set()
        for thread in threads:
            thread.join(60)
    assert early == [429] * 4


def test_the_guard_takes_the_name_that_the_server_was_given() -> None:
    guard = Guard(app(Engine.load("ballet")), "studio.local")
    scope = {"type": "http", "method": "GET", "path": "/capabilities"}
    assert guard._fault({**scope, "headers": [(b"host", b"studio.local:8000")]}) is None
    assert guard._fault({**scope, "headers": [(b"host", b"other.local:8000")]}) is not None
    assert guard._fault({**scope, "headers": [(b"host", b"localhost"), (b"host", b"evil.example")]}) is not None


def test_the_command_serves_until_it_is_interrupted(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "motionmind", "serve", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        line = server.stdout.readline()
        url = line.split()[3]
        assert urlsplit(url).hostname == "127.0.0.1"
        assert send(url, "GET", "/capabilities")[0] == 200
        server.send_signal(signal.SIGINT)
        _, errors = server.communicate(timeout=60)
    assert "Traceback" not in errors
    assert server.returncode in {0, 130}


def test_a_port_that_is_taken_is_an_error_in_one_line(run: Run) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        done = run("serve", "--port", taken.getsockname()[1])
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert "cannot listen" in done.err
