"""The attacker: pages elsewhere, other users of the machine, floods of bytes, slow bodies and paths that lead out."""

from __future__ import annotations

import asyncio
import base64
import hashlib
import http.client
import io
import json
import re
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from studio_server import Client, Served, running, serving

from motionmind.studio.guard import Guard
from motionmind.studio.pages import read_page
from motionmind.studio.project import Project
from motionmind.studio.token import Keys

PAGE = next(path for path in read_page().files if path.endswith("/main.js")).removesuffix("/main.js")
PLAYER = PAGE.replace("page", "player", 1)
EDIT = {"window": "w1", "edit": {"edit": "title", "title": "mine now"}}
OUT = [
    "../../../../etc/passwd",
    "..%2f..%2f..%2fetc%2fpasswd",
    "%2e%2e/%2e%2e/etc/passwd",
    "/etc/passwd",
    "//etc/passwd",
]
OUT += ["....//....//etc/passwd", "..\\..\\windows\\win.ini", "%00", "a%00.png", "~~~~", "C:/", "own/../../x", "%ff%fe"]
PATHS = [
    f"{PAGE}/{{}}",
    f"{PLAYER}/{{}}",
    "/page/{}",
    "/player/{}",
    "/{}",
    "/api/movements/{}",
    "/api/movements/ballet/{}",
    "/api/movements/~{}",
    "/api/thumbnails/{}/0.png",
    "/api/thumbnails/ballet/adagio/{}.png",
    "/api/jobs/{}",
]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """One studio for all attacks, none of which changes anything."""
    with serving(Project.create(tmp_path_factory.mktemp("guard") / "piece.motionmind", "ballet")) as found:
        sequence = found.project()["sequence"]
        yield found
        assert found.project()["sequence"] == sequence


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:{port}",
        "localhost.evil.example:{port}",
        "127.0.0.1",
        "127.0.0.1:1",
        "[::1",
        "",
        "10.0.0.1:{port}",
        "user@127.0.0.1:{port}",
        "127.0.0.1:{port}/x",
        "127.0.0.1:{port}, evil.example",
        "0x7f.1:{port}",
    ],
)
@pytest.mark.parametrize("path", ["/", "/health", "/api/project", f"{PAGE}/main.js"])
def test_a_name_that_was_rebound_to_this_computer_gets_nothing(served: Served, host: str, path: str) -> None:
    port = urlsplit(served.url).port
    assert served.send("GET", path, Host=host.format(port=port)).status == 403


def test_two_hosts_or_none_get_nothing(served: Served) -> None:
    parts = urlsplit(served.url)
    for heads in (b"", f"Host: {parts.netloc}\r\nHost: {parts.netloc}\r\n".encode()):
        answer = raw(served, b"GET /health HTTP/1.1\r\n" + heads + b"Connection: close\r\n\r\n")
        assert b" 200 " not in answer.split(b"\r\n")[0]


@pytest.mark.parametrize("name", ["localhost", "127.0.0.1", "[::1]"])
def test_this_computers_own_names_are_let_in(served: Served, name: str) -> None:
    port = urlsplit(served.url).port
    assert served.send("GET", "/api/project", Host=f"{name}:{port}").status == 200


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://{host}", "http://{host}.evil.example", "", None]
)
@pytest.mark.parametrize(
    ("method", "path"), [("POST", "/api/edits"), ("POST", "/api/enter"), ("DELETE", "/api/jobs/j1")]
)
def test_what_writes_needs_the_pages_own_origin(served: Served, origin: str | None, method: str, path: str) -> None:
    sent = origin and origin.format(host=urlsplit(served.url).netloc)
    assert served.send(method, path, EDIT, Origin=sent).status == 403


@pytest.mark.parametrize("value", [None, "", "1", "studio, studio"])
def test_what_writes_needs_the_header_that_pages_elsewhere_must_ask_for(served: Served, value: str | None) -> None:
    assert served.send("POST", "/api/edits", EDIT, X_MotionMind=value).status == 403


def test_a_browser_that_asks_whether_another_page_may_is_told_nothing(served: Served) -> None:
    answer = served.send("OPTIONS", "/api/edits", Origin="http://evil.example", Access_Control_Request_Method="POST")
    assert answer.status == 403
    for path in ("/", "/api/project", "/api/enter"):
        headers = served.send("GET", path).headers
        assert not [name for name in headers if name.startswith("access-control")]


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
@pytest.mark.parametrize("path", ["/api/events", "/api/project", "/api/movements/ballet/adagio"])
def test_another_pages_streams_and_pictures_get_nothing(served: Served, site: str, path: str) -> None:
    assert served.send("GET", path, Origin="http://evil.example").status == 403
    assert served.send("GET", path, Sec_Fetch_Site=site).status == 403
    assert served.send("GET", path, Cookie=None).status == 401  # for it is not sent across: SameSite=Strict


def test_the_cookie(served: Served) -> None:
    answer = served.send("POST", "/api/enter", {"token": served.keys.token})
    name, *attributes = re.split("[=;] ?", answer.headers["set-cookie"])
    assert name == f"motionmind-{urlsplit(served.url).port}"
    assert {"HttpOnly", "SameSite", "Strict", "Path"} <= set(attributes)
    assert "Domain" not in attributes
    assert served.keys.token not in answer.headers["set-cookie"]


@pytest.mark.parametrize("token", ["", "x", "é", "\ud800", 7, None, [], "A" * 1_000_000])
def test_no_other_token_lets_in(served: Served, token: object) -> None:
    answer = served.send("POST", "/api/enter", {"token": token})
    assert answer.status in (400, 403)
    assert "set-cookie" not in answer.headers
    assert served.keys.token.encode() not in answer.body


@pytest.mark.parametrize(
    "change", [lambda cookie: cookie[:-1], lambda cookie: f"{cookie}x", lambda cookie: f"{cookie}; {cookie}"]
)
def test_no_other_cookie_lets_in(served: Served, change: Any) -> None:
    assert served.send("GET", "/api/project", Cookie=change(served.cookie)).status == 401


@pytest.mark.parametrize("out", OUT)
@pytest.mark.parametrize("path", PATHS)
def test_no_path_leads_out(served: Served, path: str, out: str) -> None:
    try:
        answer = served.send("GET", path.format(out))
    except ValueError:  # the client's own refusal
        return
    assert answer.status in (200, 400, 404)
    assert b"root:" not in answer.body
    if answer.status == 200:
        assert answer.headers["content-type"].startswith("text/html"), "only the page itself"
    else:
        assert list(answer.value) == ["error"]
        assert "\n" not in answer.value["error"]


@pytest.mark.parametrize(
    "source", ["../../etc/passwd", "/etc/passwd", "~~", "own/..", "m-../../x", "ballet/../ballet/adagio"]
)
def test_no_key_in_an_edit_leads_out(served: Served, source: str) -> None:
    edit = {"edit": "insert", "id": "b1", "source": source, "first": 0, "last": 0}
    answer = served.send("POST", "/api/edits", {"window": "w1", "edit": edit})
    assert answer.status == 409


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"{",
        b"[" * 100_000,
        b"null",
        b'{"window": "w1"}',
        b'{"window": "../x", "edit": {"edit": "title", "title": ""}}',
        b'{"window": "w1", "edit": {"edit": "title", "title": "' + b"x" * 1000 + b'"}}',
        b"\xff" * 1000,
        b'{"window": "w1", "edit": {"edit": "trim", "block": "b1", "first": -1, "last": 1e400}}',
    ],
)
def test_what_is_not_understood_is_refused_in_a_line(served: Served, body: bytes) -> None:
    answer = served.send("POST", "/api/edits", body)
    assert answer.status == 400
    assert "\n" not in answer.value["error"]
    assert len(answer.value["error"]) < 300


def test_fifty_megabytes_are_refused_before_they_are_read(served: Served) -> None:
    head = served.send("POST", "/api/edits", None, Content_Length=str(50 * 2**20))
    assert head.status == 413
    parts = urlsplit(served.url)
    chunk = b"10000\r\n" + b"x" * 0x10000 + b"\r\n"
    sent = 0
    with closing(socket.create_connection((parts.hostname, parts.port), timeout=60)) as connection:
        connection.sendall(writing(served, "/api/edits", "Transfer-Encoding: chunked"))
        try:
            while sent < 50 * 2**20:
                connection.sendall(chunk)
                sent += len(chunk)
        except OSError:
            pass
    assert sent < 20 * 2**20
    assert served.send("GET", "/health").status == 200


def test_endless_headers_are_refused(served: Served) -> None:
    answer = raw(served, b"GET / HTTP/1.1\r\nX: " + b"a" * 2**20)
    assert b" 200 " not in answer.split(b"\r\n")[0]
    assert served.send("GET", "/health").status == 200


def test_half_open_connections_keep_the_owner_out_of_nothing(served: Served) -> None:
    host, port = urlsplit(served.url).hostname, urlsplit(served.url).port
    assert host is not None
    kept = http.client.HTTPConnection(host, port, timeout=60)
    with ExitStack() as opened, closing(kept):
        for _ in range(2):  # new connections do not replace one that has shown the cookie
            kept.request("GET", "/api/project?window=w1", headers={"Cookie": served.cookie})
            answer = kept.getresponse()
            assert (answer.status, answer.will_close) == (200, False)
            assert json.loads(answer.read())
            for _ in range(150):
                half = opened.enter_context(socket.create_connection((host, port), timeout=60))
                half.sendall(b"GET / HTTP/1.1\r\nHost: loc")
            assert served.send("GET", "/api/project?window=w1").status == 200


def test_a_slow_body_is_dropped() -> None:
    async def never(*_: object) -> Any:
        await asyncio.sleep(1000)

    async def reads(_: object, receive: Any, __: object) -> None:
        await receive()

    keys, told = Keys(), []

    async def send(message: Any) -> None:
        told.append(message)

    async def ask() -> None:
        cookie = keys.cookie(80).partition(";")[0].encode()
        headers = [
            (b"host", b"127.0.0.1"),
            (b"origin", b"http://127.0.0.1"),
            (b"x-motionmind", b"studio"),
            (b"cookie", cookie),
        ]
        scope = {"type": "http", "method": "POST", "path": "/api/edits", "headers": headers}
        await Guard(reads, "127.0.0.1", 80, keys, seconds=0.1)(scope, never, send)

    began = time.monotonic()
    asyncio.run(ask())
    assert told[0]["status"] == 408
    assert time.monotonic() - began < 60.0


def test_the_page_runs_no_script_but_its_own(served: Served) -> None:
    answer = served.send("GET", "/")
    policy = answer.headers["content-security-policy"]
    scripts = re.findall(r"<script(?![^>]*\bsrc=)[^>]*>(.*?)</script>", answer.body.decode(), re.DOTALL)
    assert len(scripts) == 1
    digest = base64.b64encode(hashlib.sha256(scripts[0].encode()).digest()).decode()
    assert f"script-src 'self' 'sha256-{digest}';" in policy
    assert "unsafe" not in policy
    assert {"default-src 'none'", "base-uri 'none'", "form-action 'none'", "frame-ancestors 'none'"} <= set(
        policy.split("; ")
    )
    assert b" style=" not in answer.body
    assert not re.search(rb"\bon\w+=", answer.body)


@pytest.mark.parametrize("path", ["/", "/health", f"{PAGE}/main.js", "/api/project", "/api/nothing", "/nothing"])
def test_every_answer_says_what_browsers_may_do_with_it(served: Served, path: str) -> None:
    headers = served.send("GET", path).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cross-origin-resource-policy"] == "same-origin"
    assert "default-src 'none'" in headers["content-security-policy"]
    assert "server" not in headers


def test_a_browser_keeps_the_files_of_the_page_and_asks_whether_the_page_is_another(served: Served) -> None:
    page = served.send("GET", "/")
    assert page.headers["cache-control"] == "no-cache"
    assert served.send("GET", "/", If_None_Match=page.headers["etag"]).status == 304
    files = re.findall(r'"(/(?:page|player)/[^"]+)"', page.body.decode())
    assert len(files) > 70
    for file in files:
        answer = served.send("GET", file)
        assert answer.status == 200, file
        assert answer.headers["cache-control"].endswith("immutable"), file
    assert served.send("GET", f"{PAGE[:-1]}_/main.js").status == 404, "the files of another version"


def test_an_error_inside_shows_nothing_of_itself(
    served: Served, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def broken(_: str) -> None:
        raise RuntimeError("/secret/place")

    monkeypatch.setattr(served.studio, "view", broken)
    answer = served.send("GET", "/api/project")
    assert answer.status == 500
    assert b"secret" not in answer.body
    assert "RuntimeError: /secret/place" in capfd.readouterr().err
    monkeypatch.undo()


@pytest.mark.long
def test_the_token_stands_in_the_first_line_alone(tmp_path: Path) -> None:
    with running(tmp_path / "piece.motionmind", home=tmp_path) as (process, client):
        for path in ("/", "/api/project", "/api/nothing", "/api/movements/x"):
            client.send("GET", path)
        client.send("POST", "/api/edits", b"{")
        client.send("GET", "/api/project", Cookie=None)
        process.terminate()
        out, err = process.communicate(timeout=60)
    cookie = client.cookie.partition("=")[2]
    assert client.token not in out + err
    assert cookie not in out + err


@pytest.mark.long
def test_a_browsers_arguments_admit_one_visit(tmp_path: Path) -> None:
    browser, told = tmp_path / "browser", tmp_path / "told"
    browser.write_text(f'#!/bin/sh\nprintf %s "$1" > {told}.new && mv {told}.new {told}\n')
    browser.chmod(0o755)
    with running(tmp_path / "a.motionmind", home=tmp_path, BROWSER=f"{browser} %s &") as (_, owner):
        end = time.monotonic() + 30
        while not told.exists():
            assert time.monotonic() < end
            time.sleep(0.01)
        url, _, token = told.read_text().partition("/#token=")
        assert url == owner.url
        assert token
        assert token != owner.token
        first, second = Client(url), Client(url)
        first.enter(token)
        assert first.send("GET", "/api/project?window=w1").status == 200
        assert second.send("POST", "/api/enter", {"token": token}).status == 403
        assert first.send("GET", "/api/project?window=w1").status == 401, "it may be the thief's"
        owner.enter(owner.token)
        for _ in range(2):
            assert second.send("POST", "/api/enter", {"token": token}).status == 403
            assert owner.send("GET", "/api/project?window=w1").status == 200


def test_a_visit_is_soon_or_never(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 1000.0
    monkeypatch.setattr("motionmind.studio.token.monotonic", lambda: now)
    keys = Keys()
    assert not keys.admits("")
    early, late = keys.visit(), keys.visit()
    now += 59.0
    assert not keys.admits(early), "the latest only"
    assert keys.admits(late)
    late = keys.visit()
    now += 61.0
    assert not keys.admits(late)
    assert keys.admits(keys.token)


@pytest.mark.long
def test_other_computers_are_let_in_only_where_that_is_asked_for(tmp_path: Path) -> None:
    with running(tmp_path / "a.motionmind", "--host", "0.0.0.0", home=tmp_path) as (process, client):
        port = urlsplit(client.url).port
        here = Client(f"http://127.0.0.1:{port}")
        assert here.send("GET", "/health", Host=f"192.0.2.7:{port}").status == 200
        assert here.send("GET", "/health", Host=f"evil.example:{port}").status == 403
        assert here.send("GET", "/api/project", Host=f"192.0.2.7:{port}").status == 401
        process.terminate()
        _, err = process.communicate(timeout=60)
    assert "anyone with the URL" in err
    assert "is not encrypted" in err


def writing(served: Served, path: str, *more: str) -> bytes:
    """The head of a request that writes, as the page's."""
    host = urlsplit(served.url).netloc
    lines = [f"POST {path} HTTP/1.1", f"Host: {host}", f"Origin: {served.url}", "X-MotionMind: studio"]
    return "\r\n".join([*lines, f"Cookie: {served.cookie}", *more, "", ""]).encode()


def raw(served: Served, data: bytes) -> bytes:
    """Send bytes, and return what comes."""
    parts = urlsplit(served.url)
    found = io.BytesIO()
    with closing(socket.create_connection((parts.hostname, parts.port), timeout=60)) as connection:
        try:
            connection.sendall(data)
            connection.shutdown(socket.SHUT_WR)
            while part := connection.recv(65536):
                found.write(part)
        except OSError:
            pass
    return found.getvalue()
