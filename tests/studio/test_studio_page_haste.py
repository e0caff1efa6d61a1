"""The page in hasty hands: clicks and keys that come before what was asked for is answered."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from pages import beside
from piece_page import from_a_to_b, piece, until, wait_for, wait_for_alternatives
from scores import BENDS

if TYPE_CHECKING:
    from studio_server import Served

pytestmark = pytest.mark.long


def hold_up(page: Any, address: str, milliseconds: int = 200) -> None:
    """Let every answer from some address come late."""

    def late(route: Any) -> None:
        answer = route.fetch()
        page.wait_for_timeout(milliseconds)
        route.fulfill(response=answer)

    page.route(address, late)


def test_what_is_varied_is_the_piece_as_it_stands(studio_server: Served, studio_page: Any) -> None:
    page = studio_page
    studio_server.insert("b1", "ballet/adagio", 0, 40)
    page.get_by_test_id("open-vary").click()
    page.get_by_test_id("tile-3").wait_for()
    hold_up(page, "**/api/vary")
    page.get_by_test_id("depart").fill("10")  # is asked for when the edit comes
    edit = "{ edit: 'insert', id: 'b2', source: 'ballet/plies', first: 0, last: 20, mirrored: false, before: 'b1' }"
    page.evaluate(f"void studio.api.edit({edit})")
    page.get_by_test_id("vary").click()
    wait_for(page, "studio.store.state.undo === 'vary the piece'", 20.0)
    assert "ballet/plies" in {block["source"] for block in piece(page)["blocks"]}


def test_what_another_window_does_before_the_order_comes_is_varied_too(studio_server: Served, studio_page: Any) -> None:
    page = beside(studio_page)  # what is refused is told of on a page's console
    page.goto(studio_server.url)
    studio_server.insert("b1", "ballet/adagio", 0, 40)
    page.get_by_test_id("open-vary").click()
    page.get_by_test_id("tile-3").wait_for()
    edited: list[str] = []

    def late(route: Any) -> None:
        """Let the other window be quicker, twice: here nobody has heard of it yet."""
        if len(edited) < 2 and '"arrange"' in (route.request.post_data or ""):
            edited.append(f"c{len(edited)}")
            studio_server.insert(edited[-1], "ballet/plies", 0, 20, before="b1")
        route.continue_()

    page.route(re.compile("/api/(edits|vary/accept)$"), late)
    page.get_by_test_id("vary").click()
    wait_for(page, "studio.store.state.undo === 'vary the piece'", 20.0)
    assert [block["id"] for block in studio_server.studio.project.state.about["original"]] == ["c0", "c1", "b1"]
    page.get_by_text("Another window edited").wait_for()
    page.get_by_test_id("undo").click()
    wait_for(page, "piece.blocks.map(({ id }) => id).join() === 'c0,c1,b1'", 20.0)


def test_a_double_click_does_a_thing_once(studio_server: Served, studio_page: Any) -> None:
    page = studio_page
    page.get_by_test_id("posture-bow").click()
    page.get_by_test_id("insert-posture").dblclick()
    wait_for(page, "piece.blocks.length === 1")
    page.get_by_test_id("open-pose").click()
    page.get_by_test_id("handle-pelvis").wait_for()
    hold_up(page, "**/api/pose/keep")
    page.get_by_test_id("posture-to-timeline").dblclick()
    wait_for(page, "piece.blocks.length === 2")
    page.get_by_test_id("open-vary").click()  # too short for it: whatever was asked for twice has come by now
    page.wait_for_timeout(400)
    assert len(piece(page)["blocks"]) == 2


def test_a_movement_is_put_on_the_time_line_once(studio_page: Any, tmp_path: Path) -> None:
    page = studio_page
    (tmp_path / "bends.score").write_text(BENDS)
    page.get_by_test_id("open-movement").click()
    page.get_by_test_id("choose-files").set_input_files(tmp_path / "bends.score")
    page.get_by_test_id("put").dblclick()
    wait_for(page, "piece.blocks.length === 1")
    page.wait_for_timeout(400)
    assert len(piece(page)["blocks"]) == 1
    # A moment later the same is another wish.
    page.get_by_test_id("put").click()
    wait_for(page, "piece.blocks.length === 2", 10.0)


def test_an_alternative_is_accepted_once_by_keys(studio_page: Any) -> None:
    page = studio_page
    from_a_to_b(page)
    hold_up(page, "**/api/between/accept")
    page.keyboard.press("2")
    page.keyboard.press("Enter")
    page.keyboard.press("Enter")
    wait_for(page, "piece.blocks.length === 2 && studio.desk.state === 'idle'")
    page.wait_for_timeout(400)
    assert len(piece(page)["blocks"]) == 2
    assert page.evaluate("[studio.desk.ends.a?.title, studio.desk.ends.b]") == ["fifth", None]
    # Whoever takes it back before it has come takes it back.
    page.get_by_test_id("posture-bow").click()
    wait_for_alternatives(page)
    page.keyboard.press("1")
    page.keyboard.press("Enter")
    page.keyboard.press("Control+z")
    wait_for(page, "studio.store.state.redo !== null", 10.0)
    assert len(piece(page)["blocks"]) == 2


def test_every_press_is_a_step(studio_server: Served, studio_page: Any) -> None:
    page = studio_page
    studio_server.insert("b1", "ballet/adagio", 0, 40)
    studio_server.insert("b2", "ballet/plies", 0, 20)
    page.get_by_test_id("block-b1").click()
    hold_up(page, "**/api/edits", 60)
    for key in ["Shift+ArrowLeft"] * 8 + ["Alt+Shift+ArrowRight"] * 3 + ["Shift+ArrowRight"] * 2:
        page.keyboard.press(key)
    for _ in range(2):
        page.keyboard.press("ArrowRight")  # over the seam: what is selected then is not what is trimmed
    wait_for(page, "piece.blocks[0].first === 3 && piece.blocks[0].last === 34", 10.0)
    page.keyboard.press("Delete")
    page.keyboard.press("Delete")  # which finds nothing more to delete, and says nothing
    wait_for(page, "piece.blocks.length === 1")
    page.wait_for_timeout(200)
    assert [(block["id"], block["first"], block["last"]) for block in piece(page)["blocks"]] == [("b1", 3, 34)]
    assert page.get_by_test_id("toast").count() == 0


def test_a_field_shows_what_is_wished(studio_server: Served, studio_page: Any) -> None:
    page = studio_page
    page.evaluate("studio.api.delete('/api/seams')")  # nothing is sought
    for name in ("b1", "b2"):
        studio_server.insert(name, "ballet/adagio", 0, 10)
    wait_for(page, "piece.blocks.length === 2")
    page.evaluate("studio.store.set({ selection: { seam: ['b1', 'b2'] } })")
    page.get_by_test_id("wishes").click()
    field = page.get_by_test_id("wish-seconds")
    for given, shown, wished in (("999", "60", "60"), ("0", "", "null"), ("0.01", "0.1", "0.1")):
        field.fill(given)
        field.press("Tab")
        until(page, "([field, shown]) => field.value === shown", [field.element_handle(), shown])
        wait_for(page, f"piece.seams[0].ask.seconds === {wished}", 10.0)
    # What is being written stays, though the view is drawn anew.
    field.fill("2.5")
    page.evaluate("studio.store.set({ state: structuredClone(studio.store.state) })")
    page.wait_for_timeout(100)
    assert field.input_value() == "2.5"
    field.press("Tab")
    wait_for(page, "piece.seams[0].ask.seconds === 2.5", 10.0)
    # What is wished one after another is wished together.
    hold_up(page, "**/api/edits", 100)
    for joint in ("left_wrist", "right_wrist"):
        page.get_by_test_id("wish-joint").select_option(joint)
        page.get_by_test_id("wish-pin-add").click()
    wait_for(page, "piece.seams[0].ask.pins.length === 2", 10.0)
    tempo = page.get_by_test_id("tempo")
    for given in ("500", "999"):
        tempo.fill(given)
        tempo.press("Tab")
        until(page, "(tempo) => tempo.value === '300'", tempo.element_handle())
