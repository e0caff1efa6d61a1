"""What a window has set from A to B is kept for its reload: by the server, and on the page."""

from __future__ import annotations

from typing import Any

import pytest
from piece_page import from_a_to_b, until, wait_for_alternatives
from studio_server import Served

from motionmind.studio.between import _MAX_DESKS, _MAX_SEARCHES

EMPTY = {
    "a": None,
    "b": None,
    "seconds": 0.0,
    "reaches": [],
    "spread": "usual",
    "job": None,
    "chosen": 0,
    "shown": False,
}
A, B = ({"key": f"ballet/{name}", "frame": 0, "title": name} for name in ("arabesque", "fifth"))
ENDS = "[studio.desk.ends.a?.title ?? '', studio.desk.ends.b?.title ?? ''].join(' ')"


def kept(server: Served, window: str) -> Any:
    return server.get(f"/api/desk?window={window}")


def keep(server: Served, window: str, **desk: Any) -> Any:
    return server.post("/api/desk", {"window": window, "desk": EMPTY | desk})


def test_each_window_has_its_own_and_the_project_has_none(studio_server: Served) -> None:
    before = studio_server.project()
    keep(studio_server, "w1", a=A, seconds=2.0, spread="far")
    reach = {"joint": "right_wrist", "place": [0.3, 1.4, 0.5], "at": 1.2}
    keep(studio_server, "w2", a=B, b=A, shown=True, reaches=[reach])
    assert kept(studio_server, "w1") == EMPTY | {"a": A, "seconds": 2.0, "spread": "far"}
    assert kept(studio_server, "w2") == EMPTY | {"a": B, "b": A, "shown": True, "reaches": [reach]}
    assert kept(studio_server, "w3") == EMPTY
    keep(studio_server, "w1")
    assert kept(studio_server, "w1") == EMPTY
    assert studio_server.project() == before


@pytest.mark.parametrize(
    "desk",
    [
        {"a": {"key": ""}},
        {"a": {"key": "x", "frame": -1}},
        {"a": {"key": "x", "title": "x" * 401}},
        {"seconds": -1.0},
        {"seconds": 601.0},
        {"reaches": [{"joint": "right_wrist", "place": [0.0, 1.0], "at": 1.0}]},
        {"reaches": [{"joint": "right_wrist", "place": [0.0, 1.0, 101.0], "at": 1.0}]},
        {"reaches": [{"joint": "right_wrist", "place": [0.0, 1.0, 0.0], "at": 0.0}]},
        {"spread": "farthest"},
        {"job": "j" * 41},
        {"chosen": 4},
        {"more": 1},
    ],
)
def test_what_does_not_fit_is_refused(studio_server: Served, desk: Any) -> None:
    answer = studio_server.send("POST", "/api/desk", {"window": "w1", "desk": desk})
    assert answer.status == 400
    assert "invalid request" in answer.value["error"]
    assert kept(studio_server, "w1") == EMPTY


def test_windows_without_end_take_no_memory_without_end(studio_server: Served) -> None:
    for number in range(_MAX_DESKS + 5):
        keep(studio_server, "first", a=A)
        keep(studio_server, f"w{number}", a=B)
    assert kept(studio_server, "w0") == EMPTY
    assert kept(studio_server, f"w{_MAX_DESKS + 4}")["a"] == B
    assert kept(studio_server, "first")["a"] == A  # the latest stay


def test_a_search_is_named_as_long_as_its_alternatives_can_be_accepted(studio_server: Served) -> None:
    asked = {"a": {"key": A["key"]}, "b": {"key": B["key"]}}
    job = studio_server.post("/api/between", asked)["job"]
    keep(studio_server, "w1", a=A, b=B, job=job)
    assert kept(studio_server, "w1")["job"] == job
    for _ in range(_MAX_SEARCHES):
        studio_server.send("DELETE", f"/api/jobs/{studio_server.post('/api/between', asked)['job']}")
    assert kept(studio_server, "w1") == EMPTY | {"a": A, "b": B}


@pytest.mark.long
def test_a_reload_keeps_the_ends_the_alternatives_and_the_choice(studio_server: Served, studio_page: Any) -> None:
    page = studio_page
    until(page, "studio.store.state && studio.desk")
    page.get_by_test_id("posture-arabesque").click()
    until(page, f"{ENDS} === 'arabesque '")
    page.wait_for_timeout(300)  # a click and a reload in the same instant are not a user's
    page.reload()
    until(page, f"window.studio?.desk && {ENDS} === 'arabesque '")
    assert page.evaluate("studio.desk.shown") is False
    page.get_by_test_id("posture-fifth").click()
    wait_for_alternatives(page)
    page.keyboard.press("3")
    words = page.locator(".alternative .words").all_inner_texts()
    page.wait_for_timeout(300)
    searches: list[str] = []
    page.on("request", lambda request: request.url.endswith("/api/between") and searches.append(request.url))
    page.reload()
    wait_for_alternatives(page)
    assert page.evaluate(ENDS) == "arabesque fifth"
    assert page.locator(".alternative .words").all_inner_texts() == words
    assert page.get_by_test_id("alternative-3").get_attribute("aria-checked") == "true"
    page.keyboard.press("Escape")
    page.wait_for_timeout(300)
    page.reload()
    page.get_by_role("button", name="Show the alternatives").click()
    assert page.get_by_test_id("alternative-3").get_attribute("aria-checked") == "true"
    assert searches == []
    page.get_by_test_id("alternative-3").focus()
    page.keyboard.press("Enter")
    until(page, "studio.store.state.piece.blocks.length === 2")
    assert page.evaluate("studio.store.state.piece.seams[0].chosen") == 3
    assert kept(studio_server, page.evaluate("studio.window"))["a"]["title"] == "fifth"  # the next begins there


@pytest.mark.long
def test_a_reload_during_a_search_goes_on_with_it_and_other_windows_begin_empty(
    studio_server: Served, studio_page: Any
) -> None:
    page = studio_page
    page.get_by_test_id("posture-arabesque").click()
    page.get_by_test_id("posture-bow").click()
    until(page, "studio.desk.job")
    job = page.evaluate("studio.desk.job")
    page.wait_for_timeout(100)
    page.reload()
    wait_for_alternatives(page)
    assert page.evaluate("studio.desk.job") == job
    other = page.context.new_page()
    other.goto(studio_server.url)
    other.get_by_test_id("posture-arabesque").wait_for()
    until(other, "studio.store.state")
    assert other.evaluate(ENDS) == " "
    # Of alternatives that have expired, both ends are left, and they are searched again.
    for _ in range(_MAX_SEARCHES):
        asked = {"a": {"key": A["key"]}, "b": {"key": B["key"]}}
        studio_server.send("DELETE", f"/api/jobs/{studio_server.post('/api/between', asked)['job']}")
    page.reload()
    wait_for_alternatives(page)
    assert page.evaluate(ENDS) == "arabesque bow"
    assert page.evaluate("studio.desk.job") != job
    from_a_to_b(other)
    assert page.evaluate(ENDS) == "arabesque bow"


@pytest.mark.long
def test_a_search_counts_its_seconds(studio_page: Any) -> None:
    page = studio_page
    page.route("**/api/between", lambda route: (page.wait_for_timeout(2300), route.continue_()))
    page.get_by_test_id("posture-arabesque").click()
    page.get_by_test_id("posture-fifth").click()
    elapsed = "document.querySelector('[data-testid=elapsed]')?.textContent"
    until(page, f"({elapsed}) === '2 s'")
    wait_for_alternatives(page)
    assert page.get_by_test_id("elapsed").count() == 0
