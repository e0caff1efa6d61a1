"""A studio that listens at a free port, in this process or in one of its own, and requests to it."""

from __future__ import annotations

import http.client
import json
import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote, urlsplit

import msgspec

from motionmind.studio.answers import Failure
from motionmind.studio.project import Project
from motionmind.studio.renewal import Link
from motionmind.studio.schema import CALLS
from motionmind.studio.serving import Server
from motionmind.studio.studio import Studio
from motionmind.studio.token import Keys

ROOT = Path(__file__).parents[2]
LARGE, SMALL = (1440, 900), (1024, 768)  # windows in pixels


class Answer(NamedTuple):
    """What the server answered."""

    status: int
    headers: Mapping[str, str]
    body: bytes

    @property
    def value(self) -> Any:
        """The JSON in its body."""
        return json.loads(self.body)


class Client:
    """Whoever asks: the page, with its cookie, unless headers say otherwise."""

    def __init__(self, url: str, window: str = "w1") -> None:
        self.url, self.window, self.cookie, self.token = url, window, "", ""

    def send(self, method: str, path: str, body: Any = None, **headers: str | None) -> Answer:
        """Send a request as the page does; headers of the page can be replaced, or left out by None."""
        parts = urlsplit(self.url)
        sent: dict[str, str | None] = {"Host": parts.netloc, "Cookie": self.cookie or None}
        if method not in ("GET", "HEAD"):
            sent |= {"Origin": self.url, "X-MotionMind": "studio"}
        sent |= {name.replace("_", "-"): value for name, value in headers.items()}
        data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        if data is not None and "Transfer_Encoding" not in headers:
            sent["Content-Length"] = str(len(data))
        connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=60)
        try:
            connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for name, value in sent.items():
                if value is not None:
                    connection.putheader(name, value)
            connection.endheaders(data)
            answer = connection.getresponse()
            found = Answer(answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read())
        finally:
            connection.close()
        check_answer(method, path, found)
        return found

    def enter(self, token: str) -> None:
        """Exchange the token for the cookie."""
        self.token = token
        answer = self.send("POST", "/api/enter", {"token": token})
        assert answer.status == 200, answer
        self.cookie = answer.headers["set-cookie"].partition(";")[0]

    def look(self, key: str) -> Client:
        """Someone who has the key of the look-only link."""
        looking = Client(self.url, "w-look")
        looking.enter(key)
        return looking

    def get(self, path: str) -> Any:
        """GET a path, which must be there."""
        answer = self.send("GET", path)
        assert answer.status == 200, answer
        return answer.value

    def post(self, path: str, body: Any) -> Any:
        """POST to a path, which must succeed."""
        answer = self.send("POST", path, body)
        assert answer.status == 200, answer
        return answer.value

    def project(self) -> Any:
        """The project as this window sees it."""
        return self.get(f"/api/project?window={self.window}")

    def edit(self, **edit: Any) -> Any:
        """Edit: `edit` is the kind, the rest its fields."""
        return self.post("/api/edits", {"window": self.window, "edit": edit})

    def insert(self, name: str, source: str, first: int = 0, last: int = 0, **more: Any) -> Any:
        """Insert a block."""
        return self.edit(edit="insert", id=name, source=source, first=first, last=last, **more)

    @contextmanager
    def listening(self) -> Iterator[Iterator[tuple[str, Any]]]:
        """Listen to the events; yields an iterator over their kinds and data."""
        parts = urlsplit(self.url)
        connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=60)
        connection.request("GET", f"/api/events?window={self.window}", headers={"Cookie": self.cookie})
        answer = connection.getresponse()
        assert answer.status == 200
        try:
            yield _events(answer)
        finally:
            if answer.fp is not None:
                connection.sock and connection.sock.shutdown(socket.SHUT_RDWR)
            connection.close()

    def wait_for(self, job: str) -> Any:
        """Wait until a job is over, and return it."""
        with self.listening() as events:
            found = self.get(f"/api/jobs/{quote(job)}")
            while found["state"] in ("waiting", "running"):
                kind, data = next(events)
                if kind == "job" and data["id"] == job:
                    found = data
            return found


def check_answer(method: str, path: str, answer: Answer) -> None:
    """Check an answer of the API against its schema: every field that it has, and that it has them all."""
    bare = path.partition("?")[0]
    if method == "HEAD":
        assert answer.body == b""
    elif answer.status >= 400 and bare.startswith("/api/"):
        assert answer.headers["content-type"] == "application/json"
        msgspec.json.decode(answer.body, type=Failure)
    elif answer.status == 200:
        for pattern, call in PATTERNS:
            if call.method == method and pattern.fullmatch(bare):
                kind = answer.headers["content-type"]
                if not isinstance(call.answers, str):
                    assert kind == "application/json"
                    msgspec.json.decode(answer.body, type=call.answers)
                elif call.answers != "application/octet-stream":
                    assert kind.startswith(call.answers)
                return
        assert not bare.startswith("/api/"), f"{method} {bare} is not in the schema"


def _pattern(path: str) -> re.Pattern[str]:
    parts = re.split(r"\{\w+\}", path)
    within = ".+" if "{key}" in path else "[^/]+"
    return re.compile(within.join(map(re.escape, parts)))


PATTERNS = [(_pattern(call.path), call) for call in sorted(CALLS, key=lambda call: "{" in call.path)]


def _events(answer: http.client.HTTPResponse) -> Iterator[tuple[str, Any]]:
    kind = ""
    while line := answer.readline().decode().rstrip("\n"):
        while line:
            name, _, value = line.partition(": ")
            if name == "event":
                kind = value
            elif name == "data":
                yield kind, json.loads(value)
            line = answer.readline().decode().rstrip("\n")


class Served(Client):
    """A studio that listens, and its page.

    Attributes:
        studio: the studio.
        keys: its keys.
    """

    def __init__(self, url: str, studio: Studio, keys: Keys) -> None:
        super().__init__(url)
        self.studio, self.keys = studio, keys
        self.enter(keys.token)

    @property
    def entry(self) -> str:
        """The URL that lets a browser in."""
        return f"{self.url}/#token={self.keys.token}"

    def another(self, window: str) -> Client:
        """Another window of the same browser."""
        client = Client(self.url, window)
        client.cookie = self.cookie
        return client


_ports: dict[str, int] = {}


def _listening(host: str) -> socket.socket:
    """Return a socket that listens at the port of the studio before, if that is free: to a browser, which has loaded
    the page from there, it is the same server."""
    try:
        found = socket.create_server((host, _ports.get(host, 0)))
    except OSError:  # the studio before still runs
        return socket.create_server((host, 0))
    _ports[host] = found.getsockname()[1]
    return found


@contextmanager
def serving(
    project: Project, home: Path | None = None, host: str = "127.0.0.1", link: Link | None = None
) -> Iterator[Served]:
    """Serve a project in this process, with one worker, and to others if there is a look-only link; the project is
    closed at the end."""
    studio, keys, ready = Studio(project, home, 1, is_shared=link is not None), Keys(link=link), threading.Event()
    with _listening(host) as listening:
        port = listening.getsockname()[1]
        server = Server(studio, keys, host, port, ready.set)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        thread.start()
        assert ready.wait(60)
        try:
            yield Served(f"http://127.0.0.1:{port}", studio, keys)
        finally:
            server.should_exit = True
            thread.join(60.0)
            assert not thread.is_alive()


@contextmanager
def running(*arguments: object, home: Path, **environment: str) -> Iterator[tuple[subprocess.Popen[str], Client]]:
    """Run `motionmind studio` in a process of its own, which heeds interrupts even if the tests run in the background;
    yield it and its page."""
    program = (
        "import runpy, signal\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "runpy.run_module('motionmind', run_name='__main__', alter_sys=True)\n"
    )
    options = () if "BROWSER" in environment else ("--no-browser",)
    process = subprocess.Popen(
        [sys.executable, "-c", program, "studio", *options, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT), "MOTIONMIND_HOME": str(home)} | environment,
    )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.search(r"(http://\S+)/#token=(\S+)", line)
        if found is None:
            raise AssertionError(line + (process.stderr.read() if process.stderr else ""))
        client = Client(found[1])
        client.enter(found[2])
        yield process, client
    finally:
        process.kill()
        process.communicate()
