"""An empty studio: its first steps, the latest pieces, and when it ends by itself."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pages import RESTING
from piece_page import from_a_to_b, until
from studio_server import LARGE, SMALL, Client, Served, running

from motionmind.studio import serving as serving_module
from motionmind.studio.project import Project
from motionmind.studio.renewal import Renewal, recent
from motionmind.studio.serving import Server
from motionmind.studio.studio import Studio
from motionmind.studio.token import Keys

CURRENT = "[...document.querySelectorAll('[data-testid=steps] li')].findIndex((one) => one.ariaCurrent === 'step')"


@pytest.mark.long
@pytest.mark.parametrize("studio_page", [LARGE, SMALL, (390, 844)], ids=["large", "small", "phone"], indirect=True)
def test_three_steps_lead_to_the_first_accept_and_the_question_mark_brings_them_back(studio_page: Any) -> None:
    page = studio_page
    steps = page.get_by_test_id("steps")
    steps.wait_for()
    words = steps.locator("li span:last-child").all_inner_texts()
    assert len(words) == 3
    stage = page.locator(".stage").bounding_box()
    box = page.get_by_test_id("first-sight").bounding_box()
    assert box["y"] >= stage["y"]
    assert box["y"] + box["height"] <= stage["y"] + stage["height"]
    assert box["x"] + box["width"] <= stage["x"] + stage["width"]
    assert page.evaluate(CURRENT) == 0
    from_a_to_b(page)
    assert steps.count() == 0  # the alternatives are there
    page.keyboard.press("Escape")
    assert page.evaluate(CURRENT) == 1
    page.get_by_role("button", name="Show the alternatives").click()
    page.get_by_test_id("accept").click()
    until(page, "studio.store.state.piece.blocks.length === 2")
    assert steps.count() == 0
    page.keyboard.press("Control+z")
    until(page, "studio.store.state.piece.blocks.length === 0")
    page.wait_for_timeout(200)
    assert steps.count() == 0
    page.keyboard.press("?")
    sheet = page.get_by_test_id("keys")
    for step in words:
        assert step in sheet.inner_text()
    page.keyboard.press("Escape")
    page.reload()
    until(page, "window.studio?.store.state")
    page.wait_for_timeout(200)
    assert steps.count() == 0


@pytest.mark.long
def test_other_panels_have_the_stage_for_themselves(studio_page: Any) -> None:
    studio_page.get_by_test_id("steps").wait_for()
    studio_page.get_by_test_id("open-pose").click()
    studio_page.get_by_test_id("handle-pelvis").wait_for()
    assert studio_page.get_by_test_id("first-sight").count() == 0


def test_the_latest_projects_are_those_that_exist_in_order(tmp_path: Path) -> None:
    home, begun = tmp_path / "home", time.time() - 1000.0
    for number, name in enumerate(("old", "gone", "new", "again")):
        project = tmp_path / f"{name}.motionmind"
        project.write_text("")
        Renewal(project, "http://127.0.0.1:1", home)
        for file in (home / "studio").iterdir():
            if name in file.read_text():
                os.utime(file, (begun, begun + number))
    (tmp_path / "gone.motionmind").unlink()
    (home / "studio" / "broken.json").write_text("{")
    assert [path.stem for path, _ in recent(home)] == ["again", "new", "old"]
    assert [at for _, at in recent(home)] == pytest.approx([begun + 3, begun + 2, begun], abs=0.01)
    assert recent(tmp_path / "nowhere") == []


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    context = browser.new_context(viewport={"width": 1024, "height": 768}, **RESTING)
    yield context.new_page()
    context.close()


@pytest.mark.long
@pytest.mark.skipif(os.name != "posix", reason="the browser is a script of a shell")
def test_an_earlier_piece_is_gone_on_with_by_mouse_and_by_keys(tmp_path: Path, page: Any) -> None:
    for name in ("swan", "nut"):
        with running(tmp_path / f"{name}.motionmind", home=tmp_path) as (_, client):
            client.edit(edit="title", title=f"The {name}")
    (tmp_path / "broken.motionmind").write_text("no project\n")
    Renewal(tmp_path / "broken.motionmind", "http://127.0.0.1:1", tmp_path)
    visits, script = tmp_path / "visits", tmp_path / "browser"
    # It notes the address, and the studio that asks for it, which the test ends.
    script.write_text(f'#!/bin/sh\nprintf "%s %s\\n" "$1" $PPID >> {visits}\n')
    script.chmod(0o755)

    def visited(number: int) -> tuple[str, int]:
        """The address that was opened as this one, and the process."""
        end = time.monotonic() + 60
        while not visits.exists() or len(lines := visits.read_text().splitlines()) <= number:
            assert time.monotonic() < end
            page.wait_for_timeout(50)
        url, _, process = lines[number].partition(" ")
        return url, int(process)

    started: list[int] = []
    with running(tmp_path / "empty.motionmind", home=tmp_path, BROWSER=f"{script} %s") as (_, client):
        page.goto(visited(0)[0])
        page.get_by_test_id("recent").wait_for()
        listed = page.get_by_test_id("recent").get_by_role("button")
        assert [words.split("\n")[0] for words in listed.all_inner_texts()] == ["broken", "nut", "swan"]
        assert client.send("POST", "/api/recent", {"id": "../x"}).status == 400
        listed.nth(0).click()
        page.get_by_test_id("toast").get_by_text("not a studio project").wait_for()
        try:
            listed.nth(2).focus()
            page.keyboard.press("Enter")
            url, process = visited(1)
            started.append(process)
            other = page.context.new_page()
            other.goto(url)
            until(other, "window.studio?.store.state?.title === 'The swan'")
            page.bring_to_front()
            page.get_by_text("Opened in another tab.").wait_for()
            listed.nth(2).click()  # it is open already: its own studio is reached
            again = visited(2)[0]
            assert again.partition("#")[0] == url.partition("#")[0]
            third = page.context.new_page()
            third.goto(again)
            until(third, "window.studio?.store.state?.title === 'The swan'")
        finally:
            for process in started:
                os.kill(process, signal.SIGTERM)
    with running(tmp_path / "shared.motionmind", "--host", "0.0.0.0", home=tmp_path) as (_, client):
        here = Client(client.url.replace("0.0.0.0", "127.0.0.1"))
        here.enter(client.token)
        assert here.get("/api/recent") == []


@pytest.mark.long
def test_it_ends_once_no_window_has_been_open_for_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import socket

    monkeypatch.setattr(serving_module, "_UNUSED_S", 1.5)
    monkeypatch.setattr(serving_module, "_LOOK_S", 0.05)
    studio, keys, ready = (
        Studio(Project.create(tmp_path / "p.motionmind", "ballet"), None, 1),
        Keys(),
        threading.Event(),
    )
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        server = Server(studio, keys, "127.0.0.1", port, ready.set, until_closed=True)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        thread.start()
        assert ready.wait(60)
        client = Served(f"http://127.0.0.1:{port}", studio, keys)
        with client.listening() as events:
            next(events)
            time.sleep(3.0)
            assert thread.is_alive()
        thread.join(60.0)
        assert not thread.is_alive()


@pytest.mark.long
def test_the_key_d_duplicates_and_nothing_else(studio_server: Served, studio_page: Any) -> None:
    page = studio_page
    studio_server.insert("b1", "ballet/adagio", 0, 20)
    page.get_by_test_id("block-b1").wait_for()
    dark = "document.documentElement.classList.contains('dark')"
    before = page.evaluate(dark)
    for focus in ("open-between", "posture-first", "play"):
        page.get_by_test_id(focus).focus()
        page.keyboard.press("d")
    page.wait_for_timeout(200)
    assert page.evaluate(dark) == before
    assert page.evaluate("studio.store.state.piece.blocks.length") == 1
    page.keyboard.press("i")
    assert page.evaluate(dark) != before
    page.get_by_test_id("dark").click()
    assert page.evaluate(dark) == before
    page.get_by_test_id("block-b1").click()
    page.keyboard.press("d")
    until(page, "studio.store.state.piece.blocks.length === 2")
    assert page.evaluate(dark) == before
    page.keyboard.press("?")
    assert page.get_by_test_id("keys").locator("kbd").all_inner_texts().count("D") == 1
