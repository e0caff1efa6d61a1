"""The whole page, panel by panel, on light and on dark paper: who can use it, and the words that it uses."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, Literal

import pytest
from pages import RESTING, Tabs

if TYPE_CHECKING:
    from studio_server import Served

pytestmark = pytest.mark.long

AxeFaults = Callable[[Any], list[str]]
Enter = Callable[[Literal["light", "dark"], int], Any]

PANELS = ("between", "vary", "pose", "dancers", "movement", "take")
# The engine's words, not a choreographer's.
FORBIDDEN = re.compile(r"\b(nats?|states?|lyapunov|quaternions?|entropy|likelihoods?|posteriors?)\b", re.IGNORECASE)
_NEEDS = """(field) => {
  field.style.flex = 'none';
  const { width } = field.getBoundingClientRect();
  field.style.flex = '';
  return width;
}"""
_WORDS = """() => {
  const shown = (element) => element.checkVisibility() && !element.closest('details:not([open]) > :not(summary)');
  const told = ['aria-label', 'title', 'placeholder', 'alt'];
  const attributes = [...document.body.querySelectorAll('*')]
    .filter(shown)
    .flatMap((element) => told.map((name) => element.getAttribute(name) ?? ''));
  return [document.body.innerText, ...attributes].join('\\n');
}"""


@pytest.fixture(params=["light", "dark"])
def scheme(request: pytest.FixtureRequest) -> Any:
    return request.param


def _piece(server: Served) -> None:
    """Two stretches that join, a held posture, and a saved one."""
    server.insert("a", "ballet/adagio", 0, 20)
    server.insert("b", "ballet/adagio", 21, 40)
    server.insert("c", "ballet/arabesque", hold=1.5)
    opened = server.post("/api/pose/open", {"key": "ballet/arabesque"})
    pose = {"key": "ballet/arabesque", "rotations": opened["rotations"], "root": opened["root"]}
    server.edit(
        edit="posture", name="mine", posture=server.post("/api/pose/keep", {"pose": pose, "name": "mine"})["key"]
    )


@pytest.fixture
def enter(studio_server: Served, tabs: Tabs) -> Iterator[Enter]:
    """Open the page in a colour scheme and a width; whatever its console calls an error fails the test."""
    errors: list[str] = []
    hearing = {
        "console": lambda message: errors.append(message.text) if message.type == "error" else None,
        "pageerror": lambda error: errors.append(str(error)),
    }

    def enter(scheme: Literal["light", "dark"], width: int) -> Any:
        size = {"width": width, "height": 900}
        page = using.enter_context(tabs.tab(hearing, viewport=size, color_scheme=scheme, **RESTING))
        page.goto(studio_server.entry)
        page.get_by_test_id("open-between").wait_for()
        page.wait_for_function("() => window.studio?.store.state")
        return page

    with ExitStack() as using:
        yield enter
    assert errors == []


def _panels(page: Any) -> Any:
    for name in PANELS:
        page.get_by_test_id(f"open-{name}").click()
        page.get_by_test_id(f"panel-{name}").wait_for()
        page.wait_for_timeout(700)  # what it fetches
        yield name


def test_no_panel_shuts_anybody_out(studio_server: Served, enter: Enter, scheme: Any, axe_faults: AxeFaults) -> None:
    _piece(studio_server)
    page = enter(scheme, 1440)
    page.evaluate("studio.store.set({ selection: { block: 'c' } })")
    faults = {}
    for name in _panels(page):
        for width in (1440, 1024, 390):
            page.set_viewport_size({"width": width, "height": 900})
            if found := axe_faults(page):
                faults[f"{name} at {width}"] = found
        page.set_viewport_size({"width": 1440, "height": 900})
    page.keyboard.press("?")
    page.get_by_test_id("keys").wait_for()
    if found := axe_faults(page):
        faults["keys"] = found
    page.keyboard.press("Escape")
    page.get_by_test_id("open-between").click()
    page.get_by_test_id("manage-postures").click()
    page.get_by_test_id("delete-mine").click()
    page.get_by_test_id("restore").wait_for()
    if found := axe_faults(page):
        faults["own postures"] = found
    assert faults == {}, json.dumps(faults, indent=1)


def test_the_page_speaks_a_choreographers_words(studio_server: Served, enter: Enter) -> None:
    _piece(studio_server)
    page = enter("light", 1024)
    found = {}
    for name in _panels(page):
        words = page.evaluate(_WORDS)
        assert len(words) > 200
        # It begins with its top, however far the one before it was scrolled.
        assert page.locator(".panel").evaluate("(panel) => panel.scrollTop") == 0
        page.locator(".panel").evaluate("(panel) => panel.scrollTo(0, 9999)")
        found[name] = sorted({match[0] for match in FORBIDDEN.finditer(words)})
    assert {name: words for name, words in found.items() if words} == {}


def test_nothing_covers_what_it_stands_beside(studio_server: Served, enter: Enter) -> None:
    studio_server.send("DELETE", "/api/seams")  # no insertion moves what stands there
    for number in range(9):
        studio_server.insert(f"b{number}", "ballet/adagio", 0, 40)
    page = enter("light", 1024)
    # Counts on the ruler, up to eights of three digits.
    page.get_by_test_id("tempo").fill("300")
    page.get_by_test_id("tempo").press("Tab")
    gap = """() => {
      const labels = [...document.querySelectorAll('.ruler .count')].map((label) => label.getBoundingClientRect());
      return Math.min(...labels.slice(1).map((label, i) => label.left - labels[i].right));
    }"""
    for _ in range(12):
        page.evaluate("document.querySelector('.tracks').scrollLeft = 1e6")
        page.wait_for_timeout(100)
        assert "100·1" < page.locator(".ruler .count.strong").last.inner_text() < "199·1"
        assert page.evaluate(gap) >= 2
        page.get_by_test_id("zoom-in").click()
    # What is wished, beside what plays; also on a telephone, where all of it is read.
    page.evaluate("studio.store.set({ selection: { seam: ['b0', 'b1'] } })")
    page.get_by_test_id("wishes").click()
    for width in (1440, 1024, 390):
        page.set_viewport_size({"width": width, "height": 844})
        page.wait_for_timeout(200)
        sheet, play = page.get_by_test_id("wish-sheet").bounding_box(), page.get_by_test_id("transport").bounding_box()
        assert 0 <= sheet["y"] < sheet["y"] + sheet["height"] <= 844
        assert sheet["y"] + sheet["height"] <= play["y"] or play["y"] + play["height"] <= sheet["y"]
        for name in ("wish-joint", "wish-hold"):
            field = page.get_by_test_id(name)
            assert field.bounding_box()["width"] >= field.evaluate(_NEEDS) - 1


def test_one_is_not_several(studio_server: Served, enter: Enter) -> None:
    studio_server.insert("b0", "ballet/adagio", 0, 40)
    page = enter("light", 1024)
    page.get_by_text(re.compile(r"^1 stretch, \d")).wait_for()
    studio_server.insert("b1", "ballet/plies", 0, 20)
    page.get_by_test_id("insertion-1").and_(page.locator("[data-state=inserted]")).click()
    assert re.fullmatch(r"Insertion, [\d.]+ s +(?!\d).+", page.get_by_test_id("selected").inner_text())


def test_what_is_shown_is_named_where_there_is_little_room(studio_server: Served, enter: Enter) -> None:
    studio_server.send("DELETE", "/api/seams")
    studio_server.insert("b0", "ballet/adagio", 0, 40)
    page = enter("light", 820)
    page.get_by_test_id("open-vary").click()
    page.get_by_test_id("tile-2").wait_for()
    page.get_by_test_id("beside").click()
    name, views = page.locator(".caption .name"), page.locator(".views")
    needs = "(name) => [name.scrollWidth, name.clientWidth]"
    for width in (820, 1024, 1440):
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_timeout(200)
        needed, given = name.evaluate(needs)
        assert needed <= given
        one, other, half = name.bounding_box(), views.bounding_box(), page.locator(".half").nth(1).bounding_box()
        assert one["x"] + one["width"] <= half["x"]
        # The name of what is beside it is no element.
        assert other["y"] >= half["y"] + 32 or other["x"] >= half["x"] + 130
    page.set_viewport_size({"width": 820, "height": 900})
    page.get_by_test_id("open-pose").click()
    page.get_by_text("being edited").wait_for()
    needed, given = name.evaluate(needs)
    assert needed <= given
    boxes = [one.bounding_box() for one in (name, page.locator(".caption .button"), views)]
    for one, other in ((boxes[0], boxes[1]), (boxes[0], boxes[2]), (boxes[1], boxes[2])):
        beside = one["x"] + one["width"] <= other["x"] or other["x"] + other["width"] <= one["x"]
        assert beside or one["y"] + one["height"] <= other["y"] or other["y"] + other["height"] <= one["y"]
