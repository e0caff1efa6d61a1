"""Notes, markers and sections on the time line, and stretches that are edited together."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from piece_page import blocks, piece, until, wait_for
from studio_server import LARGE, SMALL, Served

from motionmind.studio.edits import Note
from motionmind.studio.piece import Block, State
from motionmind.studio.placement import Mark, lay_out
from motionmind.studio.view import noted


class Even:
    """Marks of movements that stand still, ten frames a second."""

    def facing(self, _: str) -> str:
        return "stage"

    def at(self, _: str, frame: int) -> Mark:
        return Mark(0.0, 0.0, 0.0, frame / 10.0)

    def step(self, _key: str, _frame: int) -> float:
        return 0.1

    def length(self, _: str) -> int:
        return 1000


@settings(max_examples=60)
@given(st.lists(st.tuples(st.integers(0, 20), st.integers(1, 30)), min_size=1, max_size=5), st.data())
def test_notes_stand_where_their_frames_are_shown_and_sections_follow_each_other(stretches, data):
    own = tuple(Block(f"b{i}", f"x/{i}", first, first + more) for i, (first, more) in enumerate(stretches))
    notes = {}
    for number in range(data.draw(st.integers(1, 6))):
        block = data.draw(st.sampled_from(own))
        frame, after = data.draw(st.integers(block.first, block.last)), data.draw(st.floats(0.0, 3.0))
        kind = data.draw(st.sampled_from(["note", "section"]))
        notes[f"n{number}"] = Note(f"n{number}", kind, "x", block.id, frame, after)
    state, marks = State(blocks=own, notes=notes), Even()
    layout = lay_out(state, lambda _: None, marks)
    found = noted(state, layout, marks)
    assert sorted(one["at"] for one in found) == [one["at"] for one in found]
    begins = {block.id: part.at for block, part in zip(own, layout.blocks, strict=True)}
    ends = [*begins.values(), layout.seconds][1:]
    for one in found:
        place = [block.id for block in own].index(one["block"])
        shown = begins[one["block"]] + (one["frame"] - own[place].first) / 10.0
        assert one["at"] == pytest.approx(min(shown + one["after"], ends[place]))
    sections = [one for one in found if one["kind"] == "section"]
    for one, other in pairwise(sections):
        assert one["at"] + one["seconds"] == pytest.approx(other["at"])
    if sections:
        assert sections[-1]["at"] + sections[-1]["seconds"] == pytest.approx(layout.seconds)


def noted_by(server: Served) -> list[tuple[str, str, float]]:
    return [(one["kind"], one["text"], round(one["at"], 2)) for one in server.project()["piece"]["notes"]]


def test_notes_are_kept_in_the_project_and_undone(studio_server: Served) -> None:
    studio_server.insert("b1", "ballet/adagio", 0, 20)
    note = {"id": "n1", "kind": "note", "text": "softer", "block": "b1", "frame": 4}
    studio_server.edit(edit="note", note=note)
    assert noted_by(studio_server) == [("note", "softer", round(begins_at(studio_server, 4), 2))]
    studio_server.edit(edit="note", note=note | {"text": "softer!", "kind": "section"})
    assert [one[:2] for one in noted_by(studio_server)] == [("section", "softer!")]
    assert studio_server.project()["undo"] == "name a section"
    studio_server.edit(edit="erase", note="n1")
    assert noted_by(studio_server) == []
    for words in ("delete a note", "name a section", "write a note"):
        assert studio_server.project()["undo"] == words
        studio_server.post("/api/undo", {"window": "w1"})
    assert noted_by(studio_server) == []
    answer = studio_server.send("POST", "/api/edits", {"window": "w1", "edit": {"edit": "erase", "note": "n1"}})
    assert (answer.status, answer.value["error"]) == (409, "this note is no longer there")


def begins_at(server: Served, frame: int) -> float:
    times = server.studio.movements.get("ballet/adagio").times
    return float(times[frame] - times[0])


# --- on the page ------------------------------------------------------------------------------------------------------


@pytest.fixture
def page(studio_server: Served, studio_page: Any) -> Any:
    """A page with a piece of three stretches; nothing is sought between them."""
    studio_page.evaluate("studio.api.delete('/api/seams')")
    for number, (first, last) in enumerate([(0, 10), (11, 20), (21, 30)]):
        studio_server.insert(f"b{number}", "ballet/adagio", first, last)
    wait_for(studio_page, "piece.blocks.length === 3")
    wait_for(studio_page, "Math.abs(studio.viewer.piece?.end - piece.seconds) < 0.01", 20.0)
    studio_page.evaluate("studio.viewer.back()")
    studio_page.get_by_test_id("zoom-fit").click()
    return studio_page


def wait_for_piece(page: Any, expression: str) -> None:
    wait_for(page, expression, 15.0)


def told(page: Any) -> list[tuple[str, str, float]]:
    return [(one["kind"], one["text"], round(one["at"], 1)) for one in piece(page)["notes"]]


@pytest.mark.long
@pytest.mark.parametrize("studio_page", [LARGE, SMALL], ids=["large", "small"], indirect=True)
def test_notes_are_written_moved_and_deleted_by_mouse(page: Any) -> None:
    ruler = page.get_by_test_id("ruler").bounding_box()
    page.mouse.click(ruler["x"] + 120, ruler["y"] + 8)
    at = page.evaluate("studio.viewer.player.time")
    page.get_by_test_id("note").click()
    page.get_by_test_id("note-text").fill("reach further")
    page.get_by_test_id("note-save").click()
    wait_for_piece(page, "piece.notes.length === 1")
    assert told(page) == [("note", "reach further", round(at, 1))]
    assert page.get_by_test_id("note-sheet").count() == 0
    name = piece(page)["notes"][0]["id"]
    flag = page.get_by_test_id(f"note-{name}")
    assert flag.bounding_box()["x"] == pytest.approx(ruler["x"] + 120, abs=3)
    flag.click()
    page.get_by_test_id("note-kind").select_option("section")
    page.get_by_test_id("note-text").fill("Adagio")
    page.mouse.click(ruler["x"] + 300, ruler["y"] + 8)
    page.get_by_test_id("note-here").click()
    wait_for_piece(page, "piece.notes[0].kind === 'section'")
    assert told(page) == [("section", "Adagio", round(page.evaluate("studio.viewer.player.time"), 1))]
    end = piece(page)["notes"][0]["at"] + piece(page)["notes"][0]["seconds"]
    assert end == pytest.approx(piece(page)["seconds"])
    flag.click()
    page.get_by_test_id("note-erase").click()
    wait_for_piece(page, "piece.notes.length === 0")
    page.get_by_test_id("undo").click()
    wait_for_piece(page, "piece.notes.length === 1")


@pytest.mark.long
def test_notes_are_written_reached_and_deleted_by_keys_alone(page: Any) -> None:
    press = page.keyboard.press
    wanted = [("marker", "", 0.0), ("note", "breathe", 1.0), ("section", "Waltz", 2.5)]
    for kind, text, at in wanted:
        page.evaluate("(document.activeElement ?? document.body).blur()")
        page.evaluate(f"studio.viewer.player.seek({at})")
        press("n")
        page.get_by_test_id("note-sheet").wait_for()
        assert page.evaluate("document.activeElement.dataset.testid") == "note-text"
        page.keyboard.type(text)
        press("Shift+Tab")
        while page.get_by_test_id("note-kind").input_value() != kind:
            press("ArrowDown")
        press("Tab")
        press("Enter")
        page.get_by_test_id("note-sheet").wait_for(state="detached")
    wait_for_piece(page, "piece.notes.length === 3")
    assert told(page) == wanted
    page.evaluate("document.activeElement.blur()")
    press("[")
    assert page.evaluate("studio.viewer.player.time") == pytest.approx(1.0, abs=0.02)
    press("[")
    assert page.evaluate("studio.viewer.player.time") == pytest.approx(0.0, abs=0.02)
    press("]")
    # From the ruler, Tab leads to the notes, arrows through them.
    page.get_by_test_id("ruler").focus()
    press("Tab")
    press("ArrowRight")
    assert "breathe" in page.evaluate("document.activeElement.getAttribute('aria-label')")
    press("Delete")
    wait_for_piece(page, "piece.notes.length === 2")
    assert "Waltz" in page.evaluate("document.activeElement.getAttribute('aria-label')")
    press("Enter")
    page.get_by_test_id("note-sheet").wait_for()
    press("Escape")
    page.get_by_test_id("note-sheet").wait_for(state="detached")
    assert "Waltz" in page.evaluate("document.activeElement.getAttribute('aria-label')")
    press("Control+z")
    wait_for_piece(page, "piece.notes.length === 3")


@pytest.mark.long
def test_stretches_are_moved_and_copied_together_by_mouse(page: Any) -> None:
    begun = blocks(page)
    page.get_by_test_id("block-b0").click()
    page.get_by_test_id("block-b1").click(modifiers=["Shift"])
    assert page.get_by_test_id("selected").inner_text().startswith("2 stretches")
    box, last = (page.get_by_test_id(f"block-{name}").bounding_box() for name in ("b0", "b2"))
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 30)
    page.mouse.down()
    page.mouse.move(last["x"] + last["width"] + 30, box["y"] + 30, steps=6)
    assert page.locator(".stretch.moving").count() == 2
    page.mouse.up()
    wait_for_piece(page, "piece.blocks[0].id === 'b2'")
    assert blocks(page) == [begun[2], begun[0], begun[1]]
    page.get_by_test_id("duplicate").click()
    wait_for_piece(page, "piece.blocks.length === 5")
    assert blocks(page) == [begun[2], begun[0], begun[1], begun[0], begun[1]]
    until(page, "document.querySelectorAll('.stretch[aria-selected=true]').length === 2")
    page.get_by_test_id("delete").click()
    wait_for_piece(page, "piece.blocks.length === 3")
    for _ in range(3):
        page.get_by_test_id("undo").click()
    wait_for_piece(page, "piece.blocks[0].id === 'b0'")
    assert blocks(page) == begun
    # A click on one of several selects it alone.
    page.get_by_test_id("block-b1").click()
    page.get_by_test_id("block-b2").click(modifiers=["Shift"])
    page.get_by_test_id("block-b2").click()
    until(page, "document.querySelectorAll('.stretch[aria-selected=true]').length === 1")


@pytest.mark.long
def test_stretches_are_moved_and_copied_together_by_keys_alone(page: Any) -> None:
    press = page.keyboard.press
    begun = blocks(page)
    page.evaluate("(document.activeElement ?? document.body).blur()")
    press("t")
    press("Control+Shift+ArrowRight")
    assert page.get_by_test_id("selected").inner_text().startswith("2 stretches")
    press("Alt+ArrowRight")
    wait_for_piece(page, "piece.blocks[0].id === 'b2'")
    assert blocks(page) == [begun[2], begun[0], begun[1]]
    press("d")
    wait_for_piece(page, "piece.blocks.length === 5")
    press("m")
    wait_for_piece(page, "piece.blocks[3].mirrored && piece.blocks[4].mirrored && !piece.blocks[1].mirrored")
    press("Delete")
    wait_for_piece(page, "piece.blocks.length === 3")
    for _ in range(4):
        press("Control+z")
    wait_for_piece(page, "piece.blocks[0].id === 'b0'")
    assert blocks(page) == begun
    press("Escape")
    until(page, "document.querySelectorAll('.stretch[aria-selected=true]').length <= 1")
