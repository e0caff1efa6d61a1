"""A studio that is started again: who gets in without the new token, and who does not."""

from __future__ import annotations

import json
import os
import re
import signal
import threading
import time
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from pages import RESTING
from piece_page import until
from studio_server import Client, Served, running

from motionmind.studio import renewal
from motionmind.studio.renewal import Renewal, known, proof
from motionmind.studio.token import Keys

URL = "http://127.0.0.1:1234"
NUMBER = "x" * 43


def made(folder: Path, url: str = URL, project: str = "piece.motionmind") -> Renewal:
    return Renewal(folder / project, url, folder / "home")


def file_of(folder: Path) -> Path:
    (found,) = (folder / "home" / "studio").iterdir()
    return found


def answer(key: str, client: Client, url: str) -> Any:
    """A page's answer to the studio's challenge; the studio must have the key, and say so first."""
    told = client.send("POST", "/api/challenge", {"number": NUMBER}).value
    assert told["proof"] == proof(key, "studio", url, NUMBER, told["number"])
    return {"number": told["number"], "proof": proof(key, "page", url, NUMBER, told["number"])}


# --- the key --------------------------------------------------------------------------------------------------------


def test_a_projects_key_lasts_and_no_other_project_has_it(tmp_path: Path) -> None:
    first = made(tmp_path)
    assert made(tmp_path, "http://127.0.0.1:99").key == first.key
    assert made(tmp_path, project="other.motionmind").key != first.key
    assert known(tmp_path / "piece.motionmind", tmp_path / "home") == ("http://127.0.0.1:99", first.key)


def test_only_a_proof_of_this_studio_in_time_and_once_lets_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    now = 1000.0
    monkeypatch.setattr(renewal.time, "monotonic", lambda: now)
    studio = made(tmp_path)
    own, _ = studio.prove(NUMBER)
    right = proof(studio.key, "page", URL, NUMBER, own)
    wrong = [
        proof("another key", "page", URL, NUMBER, own),
        proof(studio.key, "studio", URL, NUMBER, own),  # the studio's own, sent back
        proof(studio.key, "page", "http://127.0.0.1:99", NUMBER, own),  # for a program between them
        proof(studio.key, "page", URL, "y" * 43, own),
        right[:-1],
        "é",
        "",
    ]
    for given in wrong:
        own, _ = studio.prove(NUMBER)
        assert not studio.admits(own, given)
    assert not studio.admits("unknown", proof(studio.key, "page", URL, "", "unknown"))
    for seconds, is_in_time in ((29.0, True), (31.0, False)):
        own, _ = studio.prove(NUMBER)
        right = proof(studio.key, "page", URL, NUMBER, own)
        now += seconds
        assert studio.admits(own, right) is is_in_time
        assert not studio.admits(own, right)
    own, _ = studio.prove(NUMBER)
    right = proof(studio.key, "page", URL, NUMBER, own)
    studio.replace()
    assert not studio.admits(own, right)
    for _ in range(200):
        studio.prove(NUMBER)
    assert len(studio._asked) == 64


@pytest.mark.skipif(os.name != "posix", reason="modes of files")
def test_others_can_neither_read_nor_plant_the_key(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        key = made(tmp_path).key
    finally:
        os.umask(before)
    file = file_of(tmp_path)
    assert file.stat().st_mode & 0o777 == 0o600
    data = file.read_bytes()
    for mode in (0o644, 0o640, 0o602, 0o660):
        file.chmod(mode)
        assert known(tmp_path / "piece.motionmind", tmp_path / "home") is None
    assert made(tmp_path).key != key, "others may have read it"
    assert file.stat().st_mode & 0o777 == 0o600
    target = tmp_path / "planted"
    target.write_bytes(data)
    target.chmod(0o600)
    file.unlink()
    file.symlink_to(target)
    assert made(tmp_path).key != key
    assert target.read_bytes() == data


@pytest.mark.parametrize(
    "data",
    [b"", b"{", b"[" * 100_000, b'{"key": "short", "made": %d, "url": ""}' % time.time(), b"\xff"],
    ids=["empty", "cut", "deep", "short", "no text"],  # the time is another in each process
)
def test_a_damaged_or_old_key_is_made_anew(tmp_path: Path, data: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    key = made(tmp_path).key
    file_of(tmp_path).write_bytes(data)
    again = made(tmp_path)
    assert again.key != key
    assert len(again.key) >= 43
    now = time.time() + 8 * 86400.0
    monkeypatch.setattr(renewal.time, "time", lambda: now)
    assert made(tmp_path).key != again.key


def test_a_folder_that_cannot_be_written_only_forgets(tmp_path: Path) -> None:
    (tmp_path / "home").write_text("no folder")
    assert made(tmp_path).key
    assert known(tmp_path / "piece.motionmind", tmp_path / "home") is None


def test_a_stolen_visit_changes_the_key(tmp_path: Path) -> None:
    keys = Keys(made(tmp_path))
    assert keys.renewal
    key, visit = keys.renewal.key, keys.visit()
    assert keys.admits(visit)
    assert keys.renewal.key == key
    assert not keys.admits(visit)
    assert keys.renewal.key != key
    assert made(tmp_path).key == keys.renewal.key


def test_a_studio_without_a_key_renews_nothing(studio_server: Served) -> None:
    assert studio_server.get("/api/renewal") == {"key": ""}
    stranger = Client(studio_server.url)
    assert stranger.send("POST", "/api/challenge", {"number": NUMBER}).status == 403
    assert stranger.send("POST", "/api/renew", {"number": NUMBER, "proof": ""}).status == 403
    assert stranger.send("GET", "/api/renewal").status == 401
    assert stranger.send("POST", "/api/visit").status == 401


# --- the command ----------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_restart_at_the_same_port_lets_in_who_has_the_key_and_no_old_cookie(tmp_path: Path) -> None:
    path = tmp_path / "piece.motionmind"
    with running(path, home=tmp_path) as (process, before):
        key = before.get("/api/renewal")["key"]
        (file,) = (tmp_path / "studio").iterdir()
        assert key in file.read_text()
        assert before.token not in file.read_text()
        process.send_signal(signal.SIGKILL)
        process.wait()
    with running(path, home=tmp_path) as (_, owner):
        assert owner.url == before.url
        assert owner.token != before.token
        page = Client(owner.url)
        page.cookie = before.cookie
        assert page.send("GET", "/api/project").status == 401
        right = answer(key, page, owner.url)
        wrong = answer(key, page, owner.url) | {"proof": right["proof"]}
        assert page.send("POST", "/api/renew", wrong).status == 403
        renewed = page.send("POST", "/api/renew", right)
        assert renewed.status == 200
        page.cookie = renewed.headers["set-cookie"].partition(";")[0]
        assert page.send("GET", "/api/project").status == 200
        assert page.send("POST", "/api/renew", right).status == 403
        with running(tmp_path / "other.motionmind", home=tmp_path) as (_, other):
            assert other.url != owner.url
            told = other.send("POST", "/api/challenge", {"number": NUMBER}).value
            assert told["proof"] != proof(key, "studio", other.url, NUMBER, told["number"])


@pytest.mark.long
def test_other_computers_get_no_key(tmp_path: Path) -> None:
    with running(tmp_path / "piece.motionmind", "--host", "0.0.0.0", home=tmp_path) as (_, client):
        here = Client(f"http://127.0.0.1:{urlsplit(client.url).port}")
        here.enter(client.token)
        assert here.get("/api/renewal") == {"key": ""}
    (file,) = (tmp_path / "studio").iterdir()
    assert json.loads(file.read_text())["key"] == ""


@pytest.mark.long
def test_an_open_project_is_reached_at_an_address_that_lets_in(
    tmp_path: Path, run: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    path, visited = tmp_path / "piece.motionmind", []
    monkeypatch.setenv("MOTIONMIND_HOME", str(tmp_path))
    monkeypatch.setattr("webbrowser.open", visited.append)
    with running(path, home=tmp_path) as (process, client):
        code, out, err = run("studio", path)
        assert (code, err) == (0, "")
        (url,) = re.findall(r"http://\S+", out)
        for address in (url, *visited):
            assert address.startswith(client.url)
            reached = Client(client.url)
            reached.enter(address.partition("#token=")[2])
            assert reached.send("GET", "/api/project").status == 200
        assert len(visited) == 1
        assert visited[0] != url  # other users see a program's arguments
        # Without the key, no address is named that would let nobody in.
        file_of_key = next((tmp_path / "studio").iterdir())
        file_of_key.unlink()
        code, out, err = run("studio", "--no-browser", path)
        assert (code, out) == (2, "")
        assert "already open in a studio; close it, or open the address that its terminal shows" in err
        assert "http" not in err
        process.terminate()
        process.wait()


# --- the page -------------------------------------------------------------------------------------------------------


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """A page of a context of its own: its servers come and go."""
    context = browser.new_context(viewport={"width": 1024, "height": 768}, **RESTING)
    yield context.new_page()
    context.close()


def enter(page: Any, client: Client) -> None:
    page.goto(f"{client.url}/#token={client.token}")
    until(page, "window.studio?.store.state && studio.store.connected")
    page.wait_for_timeout(300)  # until it has the key


@pytest.mark.long
def test_the_page_goes_on_after_a_restart_and_after_a_network_gap(tmp_path: Path, page: Any) -> None:
    path = tmp_path / "piece.motionmind"
    offline = page.get_by_test_id("offline")
    with running(path, home=tmp_path) as (process, client):
        enter(page, client)
        process.send_signal(signal.SIGKILL)
        process.wait()
        offline.wait_for()
        assert page.get_by_test_id("saved").count() == 0
        title = page.get_by_test_id("title")
        title.fill("Lost")
        title.press("Enter")
        page.get_by_test_id("toast").get_by_text("does not answer").wait_for()
    with running(path, home=tmp_path) as (process, again):
        assert again.url == client.url
        offline.wait_for(state="detached")
        page.get_by_test_id("toast").wait_for(state="detached")  # its cause is gone
        title.fill("Evening")
        title.press("Enter")
        until(page, "studio.store.state.title === 'Evening'")
        page.context.set_offline(True)
        process.send_signal(signal.SIGKILL)
        process.wait()
        offline.wait_for()
    with running(path, home=tmp_path) as (process, _):
        page.wait_for_timeout(500)
        assert offline.is_visible()
        page.context.set_offline(False)
        offline.wait_for(state="detached")
        page.reload()  # by the new cookie
        until(page, "window.studio?.store.state?.title === 'Evening'")
        assert "token" not in page.evaluate("JSON.stringify([{ ...localStorage }, { ...sessionStorage }])")


class Impostor(BaseHTTPRequestHandler):
    """A program of another user at the studio's port, which says yes to everything."""

    heard: list[str]

    def do_POST(self) -> None:
        self.do_GET()

    def do_GET(self) -> None:
        length = int(self.headers.get("Content-Length", 0))
        self.heard.append(f"{self.path} {self.headers} {self.rfile.read(length).decode()}")
        body = b'{"error": "enter"}' if self.path.startswith("/api/project") else b'{"number": "1", "proof": "2"}'
        self.send_response(401 if self.path.startswith("/api/project") else 200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:  # type: ignore[override]
        pass


@pytest.mark.long
def test_another_program_at_the_port_learns_nothing_that_lets_it_in(tmp_path: Path, page: Any) -> None:
    path = tmp_path / "piece.motionmind"
    Impostor.heard = []
    with running(path, home=tmp_path) as (process, client):
        enter(page, client)
        key = client.get("/api/renewal")["key"]
        process.send_signal(signal.SIGKILL)
        process.wait()
    ThreadingHTTPServer.allow_reuse_address = True
    impostor = ThreadingHTTPServer(("127.0.0.1", urlsplit(client.url).port or 0), Impostor)
    threading.Thread(target=impostor.serve_forever, daemon=True).start()
    try:
        end = time.monotonic() + 30
        while not any("/api/challenge" in one for one in Impostor.heard):
            assert time.monotonic() < end
            page.wait_for_timeout(50)
        page.wait_for_timeout(300)
        assert not any(one.startswith("/api/renew ") for one in Impostor.heard), "it must prove the key first"
        assert not any(key in one for one in Impostor.heard)
        with running(path, home=tmp_path) as (_, again):
            assert again.url != client.url
            stolen = Client(again.url)
            for cookie in {cookie for one in Impostor.heard for cookie in re.findall(r"Cookie: (\S+)", one)}:
                name, _, value = cookie.partition("=")
                for sent in (cookie, f"motionmind-{urlsplit(again.url).port}={value}"):
                    assert name
                    assert stolen.send("GET", "/api/project", Cookie=sent).status == 401
    finally:
        impostor.shutdown()
        impostor.server_close()


@pytest.mark.long
def test_a_silent_connection_is_made_anew(studio_page: Any) -> None:
    page, asked = studio_page, list[str]()
    until(page, "window.studio?.store.state && studio.store.connected")
    page.on("request", lambda request: "/api/events" in request.url and asked.append(request.url))
    page.wait_for_timeout(2500)
    assert asked == []
    page.evaluate("studio.store.heardAt -= 41_000")
    until(page, "!studio.store.connected")
    until(page, "studio.store.connected")
    assert len(asked) == 1


@pytest.mark.long
def test_the_time_of_the_last_edit_stands_beside_the_title(studio_server: Served, studio_page: Any) -> None:
    page = studio_page
    saved = page.get_by_test_id("saved")
    saved.wait_for()
    written = studio_server.studio.project.path.stat().st_mtime
    shown = page.evaluate("(s) => new Date(1000 * s).toTimeString().slice(0, 8)", written)
    until(page, "(time) => document.querySelector('[data-testid=saved]').textContent === `saved ${time}`", shown)
    page.wait_for_timeout(1100)
    title = page.get_by_test_id("title")
    title.fill("Evening")
    title.press("Enter")
    until(page, "(before) => !document.querySelector('[data-testid=saved]').textContent.includes(before)", shown)
    written = studio_server.studio.project.path.stat().st_mtime
    assert studio_server.project()["saved"] == pytest.approx(written, abs=1e-3)
    one, other = title.bounding_box(), saved.bounding_box()
    assert 0 <= other["x"] - (one["x"] + one["width"]) < 16
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert re.fullmatch(r"\d\d:\d\d:\d\d", saved.inner_text())


@pytest.mark.long
def test_a_notice_goes_when_its_cause_is_gone(studio_server: Served, studio_page: Any) -> None:
    project, loop = studio_server.studio.project, studio_server.studio.workers._loop
    until(studio_page, "window.studio?.store.state")
    loop.call_soon_threadsafe(project.notice, "the roof leaks")
    studio_page.get_by_test_id("toast").get_by_text("the roof leaks").wait_for()
    loop.call_soon_threadsafe(project.withdraw, "the roof leaks")
    studio_page.get_by_test_id("toast").wait_for(state="detached")
