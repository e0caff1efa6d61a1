"""The studio on a phone, upright and lying: a thumb plays pieces, chooses insertions and writes notes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import pytest
from pages import RESTING, SCREENS, Tabs
from piece_page import piece, until, wait_for

if TYPE_CHECKING:
    from studio_server import Served

pytestmark = pytest.mark.long

AxeFaults = Callable[[Any], list[str]]

KEYBOARD_PX = 200
# A keyboard covers the page: the part that is seen is lower, the page as high as before.
_KEYBOARD = """
addEventListener('tap-a-field', () => {
  Object.defineProperty(visualViewport, 'height', { configurable: true, value: innerHeight - PIXELS });
  visualViewport.dispatchEvent(new Event('resize'));
});
""".replace("PIXELS", str(KEYBOARD_PX))
# What a thumb meets 21 pixels to each side of the middle of every control, and words that are too small.
_THUMB = """(within) => {
  const name = (one) => one.dataset.testid || one.getAttribute('aria-label') || one.innerText || one.className;
  const seen = [...document.querySelectorAll(within)].flatMap((part) => [...part.querySelectorAll('*')])
    .filter((one) => one.checkVisibility({ visibilityProperty: true }));
  const missed = seen.filter((one) => one.matches('button, select, input:not(.title), .seam[role=option], .stretch'))
    .filter((one) => {
      const { left, right, top, bottom } = one.getBoundingClientRect();
      const [x, y] = [(left + right) / 2, (top + bottom) / 2];
      const tall = one.matches('[role=option], .noted') ? 20 : 21;
      return ![[0, 0], [-21, 0], [21, 0], [0, -tall], [0, tall]].every(([across, down]) => {
        const met = document.elementFromPoint(x + across, y + down);
        return met && (one === met || one.contains(met) || met.closest('label')?.contains(one));
      });
    });
  const written = seen.filter((one) => [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim()));
  const small = written.filter((one) => parseFloat(getComputedStyle(one).fontSize) < 11);
  return [missed.map(name), small.map(name), document.documentElement.scrollWidth > innerWidth];
}"""


@pytest.fixture(params=["upright", "lying"])
def screen(request: pytest.FixtureRequest) -> Any:
    return request.param


@pytest.fixture
def enter(studio_server: Served, tabs: Tabs, screen: str) -> Iterator[Callable[..., Any]]:
    """Open a piece of three stretches on the phone; an error on the page's console fails the test."""
    errors: list[str] = []
    hearing = {
        "console": lambda message: errors.append(message.text) if message.type == "error" else None,
        "pageerror": lambda error: errors.append(str(error)),
    }

    def enter(script: str = "") -> Any:
        studio_server.insert("b1", "ballet/adagio", 0, 10)
        studio_server.insert("b2", "ballet/plies", 0, 10)
        studio_server.insert("b3", "ballet/arabesque", hold=1.5)
        page = using.enter_context(tabs.tab(hearing, script=script, **(SCREENS[screen] | RESTING)))
        page.goto(studio_server.entry)
        wait_for(page, "piece.blocks.length === 3 && piece.seams[0].alternatives.length > 1")
        wait_for(page, "piece.seams.every(({ state }) => state !== 'waiting' && state !== 'abrupt')")
        wait_for(page, "Math.abs(studio.viewer.piece?.end - piece.seconds) < 0.01", 20.0)
        return page

    with ExitStack() as using:
        yield enter
    assert errors == []


def check(page: Any, axe_faults: AxeFaults, within: str = ".bar, .transport, .strip") -> None:
    """Check that a thumb meets each control, words can be read, nothing scrolls sideways, and axe finds no fault."""
    page.wait_for_timeout(100)
    assert page.evaluate(_THUMB, within) == [[], [], False]
    assert axe_faults(page) == []


def finger(page: Any, places: list[tuple[float, float]]) -> None:
    """Touch the first place, go to the others, and let go."""
    session = page.context.new_cdp_session(page)
    kinds = ["touchStart", *["touchMove"] * (len(places) - 1)]
    for kind, (x, y) in zip(kinds, places, strict=True):
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y}]})
        page.wait_for_timeout(20)
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    session.detach()


def scrub(page: Any, share: float) -> None:
    """Drag the slider from its start to a share of its length."""
    box = page.get_by_test_id("scrub").bounding_box()
    y, begin, way = box["y"] + box["height"] / 2, box["x"] + 8, box["width"] - 16
    finger(page, [(begin + share * way * step / 5, y) for step in range(6)])


def test_a_piece_is_played_and_scrubbed_by_thumb(enter: Callable[..., Any], axe_faults: AxeFaults) -> None:
    page = enter()
    check(page, axe_faults)
    page.get_by_test_id("play").tap()
    until(page, "studio.viewer.player.playing && studio.viewer.player.time > 0.2")
    page.get_by_test_id("play").tap()
    until(page, "!studio.viewer.player.playing")
    scrub(page, 0.6)
    assert page.evaluate("studio.viewer.player.time") == pytest.approx(0.6 * piece(page)["seconds"], rel=0.1)
    # The body has room, and the tracks do not hide what plays.
    stage, play, strip = (page.locator(name).bounding_box() for name in (".frame", ".transport", ".strip"))
    assert stage["height"] >= 160
    assert play["y"] + play["height"] <= strip["y"] or play["x"] + play["width"] <= strip["x"]


def test_an_insertion_is_flipped_locked_discarded_and_brought_back_by_thumb(
    enter: Callable[..., Any], axe_faults: AxeFaults
) -> None:
    page = enter()
    box = page.get_by_test_id("insertion-1").bounding_box()
    # A thumb that swipes across an insertion scrolls, and changes nothing.
    before = piece(page)
    finger(page, [(box["x"] + box["width"] - 2 + 10 * step, box["y"] + 15) for step in range(4)])
    page.wait_for_timeout(300)
    assert piece(page) == before
    page.touchscreen.tap(box["x"] + box["width"] / 2 - 18, box["y"] + 20)
    page.get_by_test_id("chosen").wait_for()
    check(page, axe_faults)
    page.get_by_test_id("next").tap()
    wait_for(page, "piece.seams[0].chosen === 2 && piece.seams[0].stands")
    seam = piece(page)["seams"][0]
    assert seam["at"] <= page.evaluate("studio.viewer.player.time") <= seam["at"] + seam["seconds"]
    page.get_by_test_id("previous").tap()
    wait_for(page, "piece.seams[0].chosen === 1")
    page.get_by_test_id("lock").tap()
    wait_for(page, "piece.seams[0].decision === 'locked'")
    assert page.get_by_test_id("next").is_disabled()
    check(page, axe_faults)
    page.get_by_test_id("lock").tap()
    wait_for(page, "piece.seams[0].decision !== 'locked'")
    page.get_by_test_id("discard").tap()
    wait_for(page, "piece.seams[0].state === 'discarded'")
    check(page, axe_faults)
    page.get_by_test_id("undo").tap()
    wait_for(page, "piece.seams[0].state === 'inserted'")


def test_a_note_is_written_read_and_deleted_by_thumb(enter: Callable[..., Any], axe_faults: AxeFaults) -> None:
    page = enter()
    scrub(page, 0.4)
    at = page.evaluate("studio.viewer.player.time")
    page.get_by_test_id("note").tap()
    check(page, axe_faults, ".note-sheet")
    page.keyboard.type("reach further")
    page.get_by_test_id("note-save").tap()
    page.get_by_test_id("note-sheet").wait_for(state="detached")
    note = piece(page)["notes"][0]
    assert (note["text"], note["at"]) == ("reach further", pytest.approx(at, abs=0.05))
    check(page, axe_faults)
    scrub(page, 0.0)
    page.get_by_test_id(f"note-{note['id']}").tap()
    assert "reach further" in page.locator(".note-sheet h3").inner_text()
    assert page.evaluate("document.activeElement.tagName") == "BUTTON"  # no keyboard opens for reading
    assert page.evaluate("studio.viewer.player.time") == pytest.approx(note["at"], abs=0.05)
    check(page, axe_faults, ".note-sheet")
    page.get_by_test_id("note-erase").tap()
    wait_for(page, "piece.notes.length === 0")
    page.get_by_test_id("note-sheet").wait_for(state="detached")
    page.get_by_test_id("undo").tap()
    wait_for(page, "piece.notes.length === 1")


def test_sheets_stand_above_the_keyboard(enter: Callable[..., Any]) -> None:
    page = enter(_KEYBOARD)
    height = page.viewport_size["height"]
    page.get_by_test_id("insertion-1").tap()
    for opener, sheet in (("note", "note-sheet"), ("wishes", "wish-sheet")):
        page.get_by_test_id(opener).tap()
        box = page.get_by_test_id(sheet).bounding_box()
        assert box["y"] + box["height"] > height - KEYBOARD_PX  # what would be hidden
        page.evaluate("dispatchEvent(new Event('tap-a-field'))")
        box = page.get_by_test_id(sheet).bounding_box()
        assert 0 <= box["y"] < box["y"] + box["height"] <= height - KEYBOARD_PX
        page.evaluate("delete visualViewport.height, visualViewport.dispatchEvent(new Event('resize'))")
        page.get_by_test_id("note-close" if opener == "note" else "wishes-close").tap()
