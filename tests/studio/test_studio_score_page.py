"""The piece as a score on the page: written, followed line by line, changed and undone, by mouse and keys."""

from __future__ import annotations

from typing import Any

import pytest
from piece_page import piece, until, wait_for
from studio_server import Served

pytestmark = pytest.mark.long

TEXT = "document.querySelector('[data-testid=score-text]')"
AT = "document.querySelector('[data-testid=score-at]')"
TIME = "studio.viewer.player.time"


@pytest.fixture
def written(studio_server: Any, studio_page: Any) -> Any:
    """The page with a piece of two clips, the panel Movement, and the piece as a score."""
    studio_server.insert("b1", "ballet/adagio", 0, 12)
    studio_server.insert("b2", "ballet/temps-lie", 0, 8)
    assert studio_server.send("DELETE", "/api/seams").status == 200  # no insertion changes the piece meanwhile
    page = studio_page
    page.get_by_test_id("open-movement").click()
    until(page, "studio.viewer.piece?.end > 0 && studio.viewer.stage")
    page.get_by_test_id("score-piece").click()
    page.wait_for_selector("[data-testid=score-text]", timeout=120_000)
    page.evaluate("studio.viewer.back()")
    return page


def to_line(page: Any, line: int) -> None:
    """Put the caret at the start of a line, as a click there does."""
    page.evaluate(
        f"""line => {{
          const field = {TEXT};
          const at = field.value.split('\\n').slice(0, line - 1).join('\\n').length + 1;
          field.focus();
          field.setSelectionRange(at, at);
        }}""",
        line,
    )


def test_a_line_and_the_playhead_follow_each_other(written: Any, axe_faults: Any) -> None:
    page = written
    lines = page.evaluate(f"{TEXT}.value").split("\n")
    clip = next(number for number, line in enumerate(lines, start=1) if line.startswith("clip"))
    to_line(page, clip + 1)
    before = -1.0
    for step in range(1, 4):
        page.keyboard.press("ArrowDown")
        until(page, f"{TIME} > {before + 0.01}")
        before = page.evaluate(TIME)
        until(
            page, f"document.querySelector('[data-testid=score-at]').textContent.startsWith('line {clip + 1 + step},')"
        )
    page.evaluate("studio.viewer.player.seek(studio.viewer.piece.end - 0.01)")
    until(page, "!document.querySelector('.score .mark.line').hidden")
    last = int(page.get_by_test_id("score-at").inner_text().split(",")[0].removeprefix("line "))
    assert last >= len(lines) - 3
    page.evaluate("document.activeElement.blur()")
    page.evaluate("studio.viewer.player.seek(0)")
    page.evaluate("studio.viewer.player.seek(studio.viewer.piece.end - 0.01)")
    until(
        page,
        """(() => {
          const [mark, sheet] = ["mark.line", "sheet"]
            .map((name) => document.querySelector(`.score .${name}`).getBoundingClientRect());
          return sheet.top <= mark.top && mark.top <= sheet.bottom - 20;
        })()""",
    )  # scrolled into sight
    assert axe_faults(page) == []


def test_a_click_on_a_line_goes_to_its_time(written: Any) -> None:
    page = written
    page.evaluate(f"{TEXT}.scrollTop = 1e6")
    until(page, f"{TEXT}.scrollTop > 0")
    box = page.get_by_test_id("score-text").bounding_box()
    page.mouse.click(box["x"] + 60, box["y"] + box["height"] - 50)
    until(page, f"{TIME} > 1")


def test_a_score_follows_the_first_dancer_who_enters_late(studio_server: Served, written: Any) -> None:
    page = written
    studio_server.edit(edit="dancer", dancer={"id": "anna", "name": "anna", "entry": 9})
    until(page, "studio.viewer.motion?.dancers?.length === 1")
    late = page.evaluate("studio.viewer.motion.clock(1) - 1")
    assert late == pytest.approx(4.0)
    said = []
    for time in (1.0, 1.0 + late):  # of the player: she waits, and then dances
        page.evaluate("time => studio.viewer.player.seek(time)", time)
        words = f"{page.evaluate('studio.viewer.own'):.2f} s"
        until(page, f"{AT}.textContent.endsWith('{words}')")
        said.append(page.get_by_test_id("score-at").inner_text())
    assert said[0] != said[1]
    line = int(said[1].split(",")[0].removeprefix("line "))
    page.evaluate("studio.viewer.player.seek(0)")
    to_line(page, line - 1)
    page.keyboard.press("ArrowDown")
    until(page, f"Math.abs({TIME} - {1.0 + late}) < 0.5")


def test_a_changed_text_changes_the_piece_and_undo_takes_it_back(written: Any) -> None:
    page = written
    seconds, text = piece(page)["seconds"], page.evaluate(f"{TEXT}.value")
    assert page.get_by_test_id("score-apply").is_disabled()
    page.get_by_test_id("score-text").fill(text.replace("tempo   120", "tempo   240"))
    page.keyboard.press("Control+Enter")
    wait_for(page, f"piece.blocks.length === 1 && Math.abs(piece.seconds - {seconds / 2}) < 0.1")
    until(page, "document.querySelector('[data-testid=score-apply]').disabled")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("Control+z")
    wait_for(page, "piece.blocks.length === 2")
    until(page, f"{TEXT}.value.includes('tempo   120')")
    page.keyboard.press("Control+Shift+z")
    wait_for(page, "piece.blocks.length === 1")
    until(page, f"{TEXT}.value.includes('tempo   240')")


def test_a_wrong_text_leaves_the_piece_and_marks_its_line(written: Any, axe_faults: Any) -> None:
    page = written
    text = page.evaluate(f"{TEXT}.value")
    page.get_by_test_id("score-text").fill(text.replace("start face", "start fase"))
    page.get_by_test_id("score-apply").click()
    page.wait_for_selector("[data-testid=score-error]", timeout=120_000)
    assert "fase" in page.get_by_test_id("score-error").inner_text()
    until(page, "!document.querySelector('.score .mark.wrong').hidden")
    assert [block["id"] for block in piece(page)["blocks"]] == ["b1", "b2"]
    assert axe_faults(page) == []


def test_a_stretch_is_changed_alone_and_another_change_makes_the_text_stale(studio_server: Any, written: Any) -> None:
    page = written
    page.get_by_test_id("score-close").click()
    until(page, f"!{TEXT}")
    page.evaluate("studio.store.set({ selection: { block: 'b2' } })")
    page.get_by_test_id("score-block").click()
    page.wait_for_selector("[data-testid=score-text]", timeout=120_000)
    text = page.evaluate(f"{TEXT}.value")
    page.get_by_test_id("score-text").fill(text.replace("tempo   120", "tempo   60"))
    page.get_by_test_id("score-apply").click()
    wait_for(page, "piece.blocks.length === 2 && piece.blocks[0].id === 'b1' && piece.blocks[1].id !== 'b2'")
    until(page, "document.querySelector('[data-testid=score-apply]').disabled")
    line = len(text.rstrip().split("\n"))
    to_line(page, line - 1)
    page.keyboard.press("ArrowDown")
    until(page, f"{TIME} > studio.store.state.piece.blocks[1].at + 1")
    studio_server.edit(edit="delete", block=piece(page)["blocks"][1]["id"])
    page.wait_for_selector("[data-testid=score-error]", timeout=60_000)
    assert "write it as a score again" in page.get_by_test_id("score-error").inner_text()


def test_notes_and_wishes_stay_in_place_and_a_comment_changes_nothing(studio_server: Served, written: Any) -> None:
    page = written
    for number, (block, frame) in enumerate((("b1", 4), ("b2", 3))):
        note = {"id": f"n{number}", "kind": "note", "text": "softer", "block": block, "frame": frame}
        studio_server.edit(edit="note", note=note)
    wait_for(page, "piece.notes.length === 2")
    before = [note["at"] for note in piece(page)["notes"]]
    text = page.evaluate(f"{TEXT}.value")
    # Only a comment: the piece stays, and the lines are known anew.
    page.get_by_test_id("score-text").fill("# for the evening\n" + text)
    page.get_by_test_id("score-apply").click()
    until(page, "document.querySelector('[data-testid=score]').getAttribute('aria-busy') === 'false'")
    until(page, "document.querySelector('[data-testid=score-apply]').disabled")
    assert page.get_by_test_id("score-error").count() == 0
    assert [block["id"] for block in piece(page)["blocks"]] == ["b1", "b2"]
    # All of the piece: notes keep their times.
    page.get_by_test_id("score-text").fill(text.replace("tempo   120", "tempo   110"))
    page.get_by_test_id("score-apply").click()
    wait_for(page, "piece.blocks.length === 1")
    assert [note["at"] for note in piece(page)["notes"]] == pytest.approx(before, abs=0.01)
    studio_server.post("/api/undo", {"window": page.evaluate("studio.window")})
    wait_for(page, "piece.blocks.length === 2")
    assert [note["block"] for note in piece(page)["notes"]] == ["b1", "b2"]
    # A stretch: its seam keeps its wish, its note its time, the other note its block.
    studio_server.edit(edit="ask", left="b1", right="b2", seconds=0.8)
    page.get_by_test_id("score-close").click()
    until(page, f"!{TEXT}")
    page.evaluate("studio.store.set({ selection: { block: 'b2' } })")
    page.get_by_test_id("score-block").click()
    page.wait_for_selector("[data-testid=score-text]", timeout=120_000)
    text = page.evaluate(f"{TEXT}.value")
    own = "piece.notes[1].at - piece.blocks[1].at"
    before = page.evaluate(f"(({{ piece }}) => {own})(studio.store.state)")
    page.get_by_test_id("score-text").fill(text.replace("tempo   120", "tempo   110"))
    page.get_by_test_id("score-apply").click()
    wait_for(page, f"piece.blocks[1].id !== 'b2' && Math.abs({own} - {before}) < 0.01")
    assert piece(page)["seams"][0]["ask"]["seconds"] == 0.8
    assert [note["block"] for note in piece(page)["notes"]] == [block["id"] for block in piece(page)["blocks"]]
