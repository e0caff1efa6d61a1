"""The look-only link: what it shows, what it does not, and comments."""

from __future__ import annotations

import json
import os
import re
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from pages import RESTING, SCREENS, Tabs, beside
from piece_page import until, wait_for
from starlette.routing import Route
from studio_server import Client, Served, running, serving

from motionmind.studio import comments, renewal
from motionmind.studio.app import routes_of
from motionmind.studio.guard import LOOKING
from motionmind.studio.project import Project
from motionmind.studio.renewal import Link

OPEN = {"/", "/page/{path:path}", "/player/{path:path}", "/health", "/api/enter", "/api/challenge", "/api/renew"}
SAMPLES = {"key:path": "ballet/adagio", "path:path": "x", "frame": "0", "format": "json", "number": "1"}
COMMENT = {"author": "Ann", "text": "softer", "block": "b1", "frame": 4}


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    """A studio with a look-only link, and a piece of one stretch."""
    (tmp_path / "secret-folder").mkdir()
    project = Project.create(tmp_path / "secret-folder" / "secret-file.motionmind", "ballet", title="Evening")
    link = Link(project.path, "http://127.0.0.1:80", tmp_path / "home")
    with serving(project, link=link) as found:
        found.insert("b1", "ballet/adagio", 0, 20)
        yield found


@pytest.fixture
def looking(served: Served) -> Client:
    assert served.keys.link
    return served.look(served.keys.link.key)


def comments_in(client: Client) -> list[tuple[str, str]]:
    return [(one["author"], one["text"]) for one in client.project()["piece"]["notes"]]


def test_every_route_but_a_few_is_closed_to_the_link(served: Served, looking: Client) -> None:
    port, asked = urlsplit(served.url).port or 0, 0
    for route in routes_of(served.studio, served.keys, port):
        assert isinstance(route, Route)
        if route.path in OPEN:
            continue
        path = re.sub(r"\{([^}]+)\}", lambda name: SAMPLES.get(name[1], "x"), route.path)
        for method in ("GET", "HEAD", "POST", "DELETE"):
            if (method, route.path) in LOOKING:
                continue
            answer = looking.send(method, path, {} if method == "POST" else None)
            assert answer.status == 403, (method, path)
            if method != "HEAD":
                assert answer.value == {"error": "this link only lets you look and comment"}
            asked += 1
    assert asked > 150
    for path in ("/api/new", "/api/project/", "/api/project/x", "/api//project", "/api/comments/x", "/api/Project"):
        for method in ("GET", "POST"):
            assert looking.send(method, path, {} if method == "POST" else None).status == 403


def test_every_open_route_of_the_link_is_one_of_the_studio(served: Served) -> None:
    routes = routes_of(served.studio, served.keys, 80)
    known = {(method, one.path) for one in routes if isinstance(one, Route) for method in one.methods or ()}
    assert set(LOOKING) <= known
    assert {path for _, path in LOOKING} == {
        "/api/project",
        "/api/events",
        "/api/movements/{key:path}",
        "/api/thumbnails/{key:path}/{frame}.png",
        "/api/credits",
        "/api/ensemble",
        "/api/comments",
    }


def test_the_link_shows_the_piece_and_nothing_else(served: Served, looking: Client, tmp_path: Path) -> None:
    served.studio.project.words.append(f"your piece continues in {tmp_path}/secret-file")
    seen = looking.project()
    own = served.project()
    assert (seen["access"], own["access"]) == ("look", "shared")
    assert seen["piece"]["parts"] == own["piece"]["parts"]
    assert seen["piece"]["blocks"] == own["piece"]["blocks"]
    answers = [json.dumps(seen), json.dumps(looking.get("/api/credits"))]
    answers.append(json.dumps(looking.get("/api/movements/ballet/adagio")["name"]))
    assert looking.send("GET", "/api/thumbnails/ballet/adagio/3.png").status == 200
    with looking.listening() as events:
        kind, data = next(events)
        assert (kind, data["sequence"]) == ("project", own["sequence"])
        answers.append(json.dumps(data))
    for key in ("ballet/plies", "ballet/../ballet/adagio", "own/mine", "~ballet/adagio", "m-0123456789abcdef"):
        for path in (f"/api/movements/{key}", f"/api/thumbnails/{key}/0.png"):
            answer = looking.send("GET", path)
            assert answer.status == 404, path
            answers.append(answer.body.decode())
    for text in answers:
        for secret in (served.keys.token, served.cookie.partition("=")[2], "secret-f", str(tmp_path)):
            assert secret not in text


def test_the_link_hears_only_that_the_piece_has_changed(served: Served, looking: Client) -> None:
    with looking.listening() as events:
        assert next(events)[0] == "project"
        loop = served.studio.workers._loop
        loop.call_soon_threadsafe(served.studio.tell_of_smoothing, True)
        loop.call_soon_threadsafe(served.studio.events.send, "job", {"words": "learning /secret"}, "j1")
        served.edit(edit="title", title="Evening")
        kind, data = next(events)
        assert (kind, data["sequence"]) == ("project", served.project()["sequence"])
    # Its windows are nobody's: the owner's are as they were.
    assert "w-look" not in served.studio.project._windows


def test_lookers_leave_the_owners_windows_room(served: Served, looking: Client) -> None:
    opened = []
    try:
        while len(opened) < 30:
            stream = looking.listening()
            try:
                stream.__enter__()
            except AssertionError:
                break
            opened.append(stream)
        assert len(opened) == 24
        with served.listening() as events:
            assert next(events)[0] == "project"
    finally:
        for stream in opened:
            stream.__exit__(None, None, None)


def test_neither_key_reveals_the_other(served: Served, looking: Client) -> None:
    link = served.keys.link
    assert link
    port = urlsplit(served.url).port
    secret = looking.cookie.partition("=")[2]
    assert len({link.key, secret, served.keys.token, served.cookie.partition("=")[2]}) == 4
    for name in (f"motionmind-{port}", f"motionmind-look-{port}"):
        for value in (link.key, secret[:-1], f"{secret}x"):
            assert served.send("GET", "/api/project", Cookie=f"{name}={value}").status == 401
    assert served.send("GET", "/api/project", Cookie=f"motionmind-{port}={secret}").status == 401
    assert looking.send("GET", "/api/project", Cookie=f"{looking.cookie}; {looking.cookie}").status == 401
    both = served.send("GET", "/api/project?window=w1", Cookie=f"{looking.cookie}; {served.cookie}")
    assert both.value["access"] == "shared"


def test_a_new_link_ends_the_old_one_at_once(served: Served, looking: Client) -> None:
    link = served.keys.link
    assert link
    address = served.get("/api/link")["address"]
    assert address == f"http://127.0.0.1:80/#look={link.key}"
    with looking.listening() as events:
        next(events)
        other = served.post("/api/link", {})["address"]
        assert other != address
        assert next(events, None) is None  # the stream has ended
    assert looking.send("GET", "/api/project").status == 401
    old = Client(served.url)
    assert old.send("POST", "/api/enter", {"token": address.partition("=")[2]}).status == 403
    assert served.look(other.partition("=")[2]).project()["access"] == "look"


def test_a_studio_without_a_link_lets_nobody_look(studio_server: Served) -> None:
    assert studio_server.get("/api/link") == {"address": ""}
    assert studio_server.post("/api/link", {}) == {"address": ""}
    for token in ("", "x"):
        assert studio_server.send("POST", "/api/enter", {"token": token}).status == 403
    port = urlsplit(studio_server.url).port
    for value in ("", "None"):
        assert studio_server.send("GET", "/api/project", Cookie=f"motionmind-look-{port}={value}").status == 401


def test_the_link_lasts_until_it_is_replaced(tmp_path: Path) -> None:
    def made() -> Link:
        return Link(tmp_path / "piece.motionmind", "http://127.0.0.1:80", tmp_path / "home")

    first = made()
    assert made().key == first.key
    # A studio of this computer alone changes nothing about it, nor it about that one's key.
    own = renewal.Renewal(tmp_path / "piece.motionmind", "http://127.0.0.1:81", tmp_path / "home")
    assert made().key == first.key
    assert renewal.Renewal(tmp_path / "piece.motionmind", "http://127.0.0.1:81", tmp_path / "home").key == own.key
    second = made()
    second.replace()
    assert made().key == second.key != first.key
    (file,) = (tmp_path / "home" / "studio").iterdir()
    if os.name == "posix":
        assert file.stat().st_mode & 0o777 == 0o600
        file.chmod(0o644)
        assert made().key != second.key, "others may have read it"


def test_a_link_has_an_address_that_others_reach(tmp_path: Path) -> None:
    for url in ("http://0.0.0.0:80", "http://[::]:80"):
        address = Link(tmp_path / "piece.motionmind", url, tmp_path / "home").address
        assert urlsplit(address).hostname not in ("0.0.0.0", "::", None)
        assert urlsplit(address).port == 80
    kept = Link(tmp_path / "piece.motionmind", "http://192.168.1.5:80", tmp_path / "home").address
    assert kept.startswith("http://192.168.1.5:80/#look=")


# --- comments -------------------------------------------------------------------------------------------------------


def test_a_comment_is_a_note_that_its_owner_deletes(served: Served, looking: Client) -> None:
    seen = looking.post("/api/comments", COMMENT)
    assert seen["access"] == "look"
    (note,) = served.project()["piece"]["notes"]
    assert (note["author"], note["text"], note["kind"], note["frame"]) == ("Ann", "softer", "note", 4)
    assert seen["piece"]["notes"] == [note]
    served.edit(edit="erase", note=note["id"])
    assert looking.project()["piece"]["notes"] == []
    served.post("/api/undo", {"window": "w1"})
    assert comments_in(looking) == [("Ann", "softer")]


def test_a_comment_is_not_undone_and_hinders_no_undo(served: Served, looking: Client) -> None:
    looking.post("/api/comments", COMMENT)
    assert served.project()["undo"] == "insert a stretch"
    served.post("/api/undo", {"window": "w1"})
    assert served.project()["piece"]["blocks"] == []
    assert comments_in(served) == [("Ann", "softer")]
    served.post("/api/redo", {"window": "w1"})
    (note,) = served.project()["piece"]["notes"]
    assert (note["block"], note["frame"]) == ("b1", 4)
    served.post("/api/undo", {"window": "w1"})
    served.insert("b2", "ballet/plies", 0, 10)
    looking.post("/api/comments", COMMENT | {"block": "b2", "text": "lower"})
    path = served.studio.project.path
    served.studio.project.close()
    again = Project.open(path)
    assert [(note.author, note.text) for note in again.state.notes.values()] == [("Ann", "softer"), ("Ann", "lower")]
    # A restarted studio knows none of the windows before; a comment is still nobody's to undo.
    assert again.undoable("w2") == "insert a stretch"
    again.close()


def test_other_comments_are_refused(served: Served, looking: Client) -> None:
    cases: list[tuple[dict[str, Any], str]] = [
        ({"author": ""}, "a comment needs a name and a text"),
        ({"author": " \n\u202e"}, "a comment needs a name and a text"),
        ({"text": " "}, "a comment needs a name and a text"),
        ({"text": "x" * 501}, "invalid request"),
        ({"author": "x" * 81}, "invalid request"),
        ({"block": "b9"}, "this stretch is no longer in the piece"),
        ({"frame": 21}, "this stretch has frames 0 to 20, not 21"),
        ({"after": -1}, "invalid request"),
        ({"kind": "section"}, "invalid request"),
        ({"id": "n1"}, "invalid request"),
    ]
    for change, words in cases:
        answer = looking.send("POST", "/api/comments", COMMENT | change)
        assert answer.status == 400, change
        assert words in answer.value["error"]
    assert comments_in(served) == []


def test_a_comment_is_one_line_of_what_one_sees(served: Served, looking: Client) -> None:
    looking.post(
        "/api/comments", COMMENT | {"author": " A\x1b[31mnn ", "text": "<b>up</b>\n\tthen \u202edown 👩\u200d🎤"}
    )
    assert comments_in(served) == [("A[31mnn", "<b>up</b> then down 👩\u200d🎤")]


def test_comments_come_no_faster_than_people_write(
    served: Served, looking: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = time.monotonic()
    monkeypatch.setattr(comments.time, "monotonic", lambda: now)
    for number in range(10):
        looking.post("/api/comments", COMMENT | {"text": f"{number}"})
    answer = looking.send("POST", "/api/comments", COMMENT)
    assert (answer.status, answer.value["error"]) == (429, "too many comments: wait a minute")
    assert len(comments_in(served)) == 10
    now += 61.0
    looking.post("/api/comments", COMMENT)


def test_comments_leave_the_owners_notes_room(served: Served, looking: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(comments, "_MAX_COMMENTS", 1)
    looking.post("/api/comments", COMMENT)
    answer = looking.send("POST", "/api/comments", COMMENT)
    assert (answer.status, answer.value["error"]) == (400, "a piece has at most 1 comments")


# --- the page -------------------------------------------------------------------------------------------------------

SIZES = {"large": {"viewport": {"width": 1440, "height": 900}}, "small": {"viewport": {"width": 1024, "height": 768}}}
SIZES |= {name: SCREENS[name] for name in ("upright", "lying")}


@pytest.fixture
def open_page(tabs: Tabs) -> Iterator[Callable[..., Any]]:
    """Open an address in a browser of its own, of a size; an error on the console fails the test."""
    errors: list[str] = []
    hearing = {
        "console": lambda message: (
            errors.append(f"{message.text} {message.location}") if message.type == "error" else None
        ),
        "pageerror": lambda error: errors.append(str(error)),
    }

    def enter(address: str, size: str = "large", *, fails: bool = False) -> Any:
        page = using.enter_context(tabs.tab({} if fails else hearing, **(SIZES[size] | RESTING)))
        page.goto(address)
        until(page, "studio.viewer.piece?.length > 1 && studio.store.connected")
        return page

    with ExitStack() as using:
        yield enter
    assert errors == []


def link_of(served: Served) -> str:
    assert served.keys.link
    return f"{served.url}/#look={served.keys.link.key}"


@pytest.mark.long
@pytest.mark.parametrize("size", SIZES)
def test_the_page_of_the_link_edits_nothing_and_reads_well(
    served: Served, open_page: Callable[..., Any], axe_faults: Callable[[Any], list[str]], size: str
) -> None:
    served.post("/api/comments", COMMENT | {"text": "<img src=x onerror=document.title='run'>"})
    page = open_page(link_of(served), size)
    assert "look=" not in page.url
    names = page.evaluate("[...document.querySelectorAll('[data-testid]')].map((one) => one.dataset.testid)")
    own = {"title", "dark", "play", "scrub", "made", "transport", "credits", "offline", "sights", "colours"}
    assert {name for name in names if not name.startswith(("comment-", "note-c-"))} <= own
    (note,) = served.project()["piece"]["notes"]
    words = page.get_by_test_id(f"note-{note['id']}")
    assert words.inner_text() == f"{note['at']:.2f} s Ann <img src=x onerror=document.title='run'>"
    assert page.title() == "Evening · MotionMind studio"
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert axe_faults(page) == []
    page.get_by_role("button", name="Keys").click()
    assert "First steps" not in page.get_by_test_id("keys").inner_text()
    assert axe_faults(page) == []
    page.keyboard.press("Escape")
    page.reload()  # by the cookie
    until(page, "window.studio?.viewer.piece?.length > 1")
    assert page.get_by_test_id("comment-name").is_visible()


@pytest.mark.long
def test_a_comment_by_mouse_is_a_note_in_the_owners_page_at_once(
    served: Served, open_page: Callable[..., Any], axe_faults: Callable[[Any], list[str]]
) -> None:
    looking, own = open_page(link_of(served)), open_page(served.entry)
    box = looking.get_by_test_id("scrub").bounding_box()
    looking.mouse.click(box["x"] + 0.4 * box["width"], box["y"] + box["height"] / 2)
    at = looking.evaluate("studio.viewer.player.time")
    assert looking.get_by_test_id("comment-moment").inner_text() == f"{at:.2f} s"
    assert looking.get_by_test_id("comment-send").is_disabled()
    looking.get_by_test_id("play").click()
    until(looking, "studio.viewer.player.playing")
    looking.get_by_test_id("comment-text").click()
    until(looking, "!studio.viewer.player.playing")  # so that the moment stays
    at = looking.evaluate("studio.viewer.player.time")
    looking.get_by_test_id("comment-text").fill("reach further")
    looking.get_by_test_id("comment-name").fill("Ann")
    looking.get_by_test_id("comment-send").click()
    wait_for(own, "piece.notes.length === 1", 10.0)
    (note,) = own.evaluate("studio.store.state.piece.notes")
    assert (note["author"], note["text"]) == ("Ann", "reach further")
    assert note["at"] == pytest.approx(at, abs=0.01)
    until(looking, "document.querySelectorAll('.looking .notes li').length === 1")
    assert looking.get_by_test_id("comment-text").input_value() == ""
    flag = own.get_by_test_id(f"note-{note['id']}")
    assert flag.inner_text().split("\n") == ["Ann:", "reach further"]
    assert axe_faults(own) == []
    flag.click()
    assert "by Ann" in own.get_by_test_id("note-sheet").inner_text()
    own.get_by_test_id("note-erase").click()
    until(looking, "document.querySelectorAll('.looking .notes li').length === 0")


@pytest.mark.long
def test_a_comment_is_written_and_reached_by_keys_alone(served: Served, open_page: Callable[..., Any]) -> None:
    page = open_page(link_of(served), "small")
    press = page.keyboard.press
    page.evaluate("studio.viewer.player.seek(1)")
    for shown in (1, 0):
        press("c")
        until(page, f"document.querySelectorAll('[data-testid=legend]').length === {shown}")
    press("n")
    page.keyboard.type("breathe")
    press("Shift+Tab")
    page.keyboard.type("Ben")
    press("Enter")
    until(page, "document.querySelectorAll('.looking .notes li').length === 1")
    assert comments_in(served) == [("Ben", "breathe")]
    page.evaluate("document.activeElement.blur()")
    press("Home")
    press("]")
    assert page.evaluate("studio.viewer.player.time") == pytest.approx(1.0, abs=0.02)
    press("Home")
    press("n")
    for _ in range(2):  # the button that sends is disabled
        press("Tab")
        if page.evaluate("document.activeElement.dataset.note"):
            break
    press("Enter")
    assert page.evaluate("studio.viewer.player.time") == pytest.approx(1.0, abs=0.02)


@pytest.mark.long
def test_the_owner_copies_the_link_and_replaces_it(
    served: Served, open_page: Callable[..., Any], axe_faults: Callable[[Any], list[str]]
) -> None:
    looking, own = open_page(link_of(served), fails=True), open_page(served.entry, "upright")
    assert own.evaluate("document.documentElement.scrollWidth <= innerWidth")
    own.get_by_test_id("share").click()
    field = own.get_by_test_id("share-link")
    old = field.input_value()
    assert old == served.get("/api/link")["address"]
    own.get_by_test_id("share-copy").click()
    until(own, "/Copied|Ctrl/.test(document.querySelector('.share [role=status]').textContent)")
    assert axe_faults(own) == []
    own.get_by_test_id("share-new").click()
    until(own, "(old) => document.querySelector('[data-testid=share-link]').value !== old", old)
    assert field.input_value() == served.get("/api/link")["address"]
    offline = looking.get_by_test_id("offline")
    offline.get_by_text("This link is no longer valid: ask for a new one.").wait_for()
    own.keyboard.press("Escape")
    own.get_by_test_id("share-sheet").wait_for(state="detached")


@pytest.mark.long
def test_a_tab_without_the_key_but_with_its_cookie_only_looks(served: Served, open_page: Callable[..., Any]) -> None:
    page = open_page(link_of(served), fails=True)
    page.evaluate("sessionStorage.clear()")
    page.goto(f"{served.url}/")
    page.get_by_test_id("comment-name").wait_for()
    # In the owner's browser, the link shows what others see, and the owner's own window stays.
    own = open_page(served.entry)
    tab = beside(own)
    tab.goto(link_of(served))
    tab.get_by_test_id("comment-name").wait_for()
    own.reload()
    own.get_by_test_id("undo").wait_for()
    tab.close()


# --- the command ----------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_the_link_is_printed_and_goes_on_after_a_restart(tmp_path: Path, browser: Any) -> None:
    path = tmp_path / "piece.motionmind"
    with running(path, "--host", "0.0.0.0", home=tmp_path) as (process, owner):
        assert process.stdout
        line = process.stdout.readline()
        key = line.strip().partition("#look=")[2]
        assert line.startswith("to look and comment only: http://")
        assert "0.0.0.0" not in line
        here = Client(f"http://127.0.0.1:{urlsplit(owner.url).port}")
        looking = here.look(key)
        assert looking.project()["access"] == "look"
        assert owner.get("/api/link")["address"] in line
        owner.insert("b1", "ballet/adagio", 0, 20)
        page = browser.new_context().new_page()
        page.goto(f"{here.url}/#look={key}")
        until(page, "window.studio?.viewer.piece?.length > 1")
        looking.post("/api/comments", COMMENT)
    with running(path, "--host", "0.0.0.0", home=tmp_path) as (_, again):
        assert again.url == owner.url
        until(page, "studio.store.connected && document.querySelectorAll('.looking .notes li').length === 1")
        page.close()
        assert looking.project()["access"] == "look"
        assert here.look(key).project()["access"] == "look"
        assert again.token != owner.token
        assert again.send("GET", "/api/project", Cookie=owner.cookie).status == 401
        again.post("/api/link", {})
        assert looking.send("GET", "/api/project").status == 401


@pytest.mark.long
def test_the_link_plays_all_dancers(served: Served, open_page: Callable[..., Any]) -> None:
    for number in range(2):
        dancer = {"id": f"d{number}", "name": str(number), "place": [number, 0], "mirrored": number == 1}
        served.edit(edit="dancer", dancer=dancer)
    page = open_page(link_of(served))
    until(page, "studio.viewer.motion.dancers?.length === 2")
    until(page, "studio.viewer.motion.dancers.every(({ piece }) => piece.times.length > 1)")
    # A moment is the first dancer's, who enters after two seconds.
    served.edit(edit="dancer", dancer={"id": "d0", "name": "0", "entry": 5})
    until(page, "studio.viewer.motion.clock(0) === 2")
    page.evaluate("studio.viewer.player.seek(2.5)")
    until(page, "document.querySelector('[data-testid=comment-moment]').textContent === '0.50 s'")
