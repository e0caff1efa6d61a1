"""Time on the page's time line, by mouse and by keys."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from piece_page import piece, wait_for
from studio_server import Served, serving

from motionmind.studio.project import Project

pytestmark = pytest.mark.long


@pytest.fixture
def studio_server(tmp_path: Path) -> Iterator[Served]:
    """A studio with a posture between two stretches, at which nothing is inserted."""
    with serving(Project.create(tmp_path / "piece.motionmind", "ballet")) as served:
        served.insert("b1", "ballet/plies", 0, 12)
        served.insert("b2", "ballet/adagio-barre", 9, 9)
        served.insert("b3", "ballet/tendus", 11, 18)
        yield served


@pytest.fixture
def page(studio_server: Served, studio_page: Any) -> Any:
    """A page with that piece, all of which is seen and can be played; no search changes it meanwhile."""
    studio_server.send("DELETE", "/api/seams")
    wait_for(
        studio_page, "piece.blocks.length === 3 && Math.abs(studio.viewer.player.motion.end - piece.seconds) < 0.01"
    )
    studio_page.get_by_test_id("zoom-fit").click()
    return studio_page


def drag(page: Any, test: str, share: float, by: float) -> None:
    """Drag something by its place a share of the way along it, pixels."""
    box = page.get_by_test_id(test).bounding_box()
    x, y = box["x"] + share * box["width"], box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + by, y, steps=6)
    page.mouse.up()


def sampled(page: Any, times: list[float]) -> np.ndarray:
    """The joints' rotations that the viewer shows at some times of the piece."""
    wait_for(page, "Math.abs(studio.viewer.piece.end - piece.seconds) < 1e-6")
    shown = page.evaluate(
        """(times) => times.map((time) => {
          const { piece } = studio.viewer;
          const [rotations, root] = [new Float64Array(piece.joints.length * 4), new Float64Array(3)];
          piece.sample(time, rotations, root);
          return [...rotations, ...root];
        })""",
        times,
    )
    return np.array(shown)


def test_a_posture_is_held_by_mouse(page: Any) -> None:
    before = piece(page)
    page.get_by_test_id("block-b2").click()
    box = page.get_by_test_id("block-b2").bounding_box()
    assert box["width"] == pytest.approx(28.0, abs=1.0)
    drag(page, "block-b2", 0.85, 90.0)
    wait_for(page, "piece.blocks[1].hold > 0.1")
    now = piece(page)
    held = now["blocks"][1]
    assert held["seconds"] == pytest.approx(held["hold"])
    assert now["blocks"][0] == before["blocks"][0]
    assert page.get_by_test_id("hold-s").input_value() == f"{held['hold']:.2f}".rstrip("0").rstrip(".")
    still = sampled(page, np.linspace(held["at"], held["at"] + held["hold"], 7).tolist())
    assert np.ptp(still, axis=0).max() == 0.0
    # In counts, and back.
    page.get_by_test_id("tempo").fill("60")
    page.get_by_test_id("tempo").press("Enter")
    page.get_by_test_id("hold-counts").fill("3")
    page.get_by_test_id("hold-counts").press("Enter")
    wait_for(page, "piece.blocks[1].hold === 3")
    assert page.get_by_test_id("block-b2").get_attribute("aria-label").find("held 3.00 seconds") > 0
    drag(page, "block-b2", 0.99, -2000.0)
    wait_for(page, "piece.blocks[1].hold === 0")
    page.get_by_test_id("undo").click()
    wait_for(page, "piece.blocks[1].hold === 3")


def test_a_posture_is_held_by_keys_alone(page: Any) -> None:
    page.get_by_test_id("block-b2").focus()
    for _ in range(12):  # faster than they are answered
        page.keyboard.press("Shift+ArrowRight")
    wait_for(page, "Math.abs(piece.blocks[1].hold - 1.2) < 1e-9")
    page.keyboard.press("Shift+ArrowLeft")
    wait_for(page, "Math.abs(piece.blocks[1].hold - 1.1) < 1e-9")
    assert page.evaluate("document.activeElement.dataset.testid") == "block-b2"
    page.keyboard.press("d")
    wait_for(page, "piece.blocks.length === 4 && Math.abs(piece.blocks[2].hold - 1.1) < 1e-9")
    page.keyboard.press("Control+z")
    wait_for(page, "piece.blocks.length === 3")
    page.keyboard.press("?")
    page.get_by_text("hold the posture").wait_for()


def test_a_variation_keeps_what_is_held(studio_server: Served, studio_page: Any) -> None:
    studio_server.send("DELETE", "/api/seams")
    for name in ("b1", "b2", "b3"):
        studio_server.edit(edit="delete", block=name)
    for number in range(12):
        studio_server.insert(f"p{number}", "ballet/adagio", 4 * number, 4 * number, hold=0.25 * number)
    wait_for(studio_page, "piece.blocks.length === 12")
    studio_page.get_by_test_id("open-vary").click()
    studio_page.get_by_test_id("inserted").select_option("")
    studio_page.get_by_text("Details", exact=True).click()
    studio_page.get_by_test_id("stretch").select_option("1")
    vary = studio_page.get_by_test_id("vary")
    wait_for(studio_page, "document.querySelector('[data-testid=vary]')?.disabled === false")
    vary.click()
    wait_for(studio_page, "piece.blocks.some(({ first }, i) => first !== 4 * i)")
    assert all(block["hold"] == block["first"] / 16 for block in piece(studio_page)["blocks"])


def test_a_stretch_is_stretched_and_repeated_by_mouse(page: Any) -> None:
    before = piece(page)["blocks"][0]
    width = page.get_by_test_id("block-b1").bounding_box()["width"]
    page.keyboard.down("Alt")
    drag(page, "block-b1", 0.995, 0.5 * width)
    page.keyboard.up("Alt")
    wait_for(page, "piece.blocks[0].pace < 0.75 && piece.blocks[0].pace > 0.6")
    now = piece(page)["blocks"][0]
    assert (now["first"], now["last"]) == (before["first"], before["last"])
    assert now["seconds"] == pytest.approx(before["seconds"] / now["pace"])
    assert page.get_by_test_id("pace").input_value() == f"{100 * now['pace']:.1f}".removesuffix(".0")
    page.get_by_test_id("pace").fill("200")
    page.get_by_test_id("pace").press("Enter")
    wait_for(page, "piece.blocks[0].pace === 2")
    page.get_by_test_id("repeats").fill("3")
    page.get_by_test_id("repeats").press("Enter")
    wait_for(page, "piece.blocks[0].repeats === 3 && piece.seams.length === 3")
    assert page.locator(".seam.again").count() == 1
    # The viewer shows the stretch's postures at their new times, in each repeat.
    parts = [part for part in piece(page)["parts"] if part["key"] == "ballet/plies"]
    assert len(parts) == 3
    joints = slice(4, -3)  # all but the root, which repeats move and turn
    shown = [sampled(page, [part["at"] + share * part["seconds"] for share in (0.0, 0.5, 1.0)]) for part in parts]
    assert shown[0][:, joints] == pytest.approx(shown[2][:, joints], abs=1e-6)
    page.evaluate("studio.api.post('/api/seams')")
    wait_for(page, "piece.seams[0].state === 'inserted' || piece.seams[0].state === 'smooth'")
    page.get_by_test_id("undo").click()
    wait_for(page, "piece.blocks[0].repeats === 1 && piece.seams.length === 2")


def test_a_stretch_is_stretched_and_repeated_by_keys_alone(page: Any) -> None:
    page.get_by_test_id("block-b1").focus()
    for _ in range(3):
        page.keyboard.press(",")
    wait_for(page, "piece.blocks[0].pace === 0.85")
    page.keyboard.press(".")
    wait_for(page, "piece.blocks[0].pace === 0.9")
    page.keyboard.press("r")
    page.keyboard.press("r")
    wait_for(page, "piece.blocks[0].repeats === 3")
    page.keyboard.press("Alt+r")
    wait_for(page, "piece.blocks[0].repeats === 2")
    # The insertion between the repeats is an insertion like any other.
    page.keyboard.press("ArrowRight")
    assert page.evaluate("studio.store.selection") == {"seam": ["b1", "b1"]}
    page.keyboard.press("ArrowRight")
    assert page.evaluate("studio.store.selection") == {"seam": ["b1", "b2"]}
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("s")
    page.get_by_text("Put the playhead inside the stretch").wait_for()
    page.keyboard.press("Control+z")
    wait_for(page, "piece.blocks[0].repeats === 3")
    # A split in the second playing leaves the ones before and after it whole.
    before = piece(page)
    block = before["blocks"][0]
    every = (block["seconds"] - block["once"]) / 2
    page.evaluate(f"studio.viewer.player.seek({every + 0.5 * block['once']})")
    page.keyboard.press("s")
    wait_for(page, "piece.blocks.length === 6")
    after = piece(page)
    assert [one["repeats"] for one in after["blocks"]] == [1] * 6
    shown = [(one["first"], one["last"]) for one in after["blocks"][:4]]
    whole = block["first"], block["last"]
    assert (shown[0], shown[3]) == (whole, whole)
    assert (shown[1][0], shown[1][1] + 1, shown[2][1]) == (whole[0], shown[2][0], whole[1])
    assert after["seconds"] == pytest.approx(before["seconds"])
    page.keyboard.press("Control+z")
    wait_for(page, "piece.blocks[0].repeats === 3")


def counted(time: float, tempo: float = 90.0) -> float:
    """How far a time is from the nearest count, in counts."""
    count = time * tempo / 60.0
    return abs(count - round(count))


def begin_counting(page: Any) -> None:
    """Count 90 a minute in sixes."""
    page.get_by_test_id("tempo").fill("90")
    page.get_by_test_id("tempo").press("Enter")
    page.get_by_test_id("counts").select_option("6")
    wait_for(page, "studio.store.state.tempo === 90 && studio.store.state.counts === 6")


def hold_and_settle(page: Any) -> None:
    """Hold the posture, and wait for the insertions beside it, which longer holds do not change."""
    page.evaluate("studio.api.edit({ edit: 'hold', block: 'b2', seconds: 0.5 })")
    page.evaluate("studio.api.post('/api/seams')")
    wait_for(page, "piece.blocks[1].hold > 0 && piece.seams.every(({ state }) => state === 'inserted')")
    wait_for(page, "Math.abs(studio.viewer.player.motion.end - piece.seconds) < 0.01")
    page.get_by_test_id("zoom-fit").click()


def test_edges_insertions_and_the_playhead_snap_to_counts_by_mouse(page: Any) -> None:
    hold_and_settle(page)
    begin_counting(page)
    page.get_by_test_id("snap").click()
    assert page.get_by_test_id("snap").get_attribute("aria-pressed") == "true"
    page.get_by_test_id("block-b2").click()
    drag(page, "block-b2", 0.9, 83.0)
    wait_for(page, "piece.blocks[1].hold > 0.6")
    held = piece(page)["blocks"][1]
    assert counted(held["at"] + held["hold"]) < 2e-3
    ruler = page.get_by_test_id("ruler").bounding_box()
    page.mouse.click(ruler["x"] + 0.37 * ruler["width"], ruler["y"] + 8)
    assert counted(page.evaluate("studio.viewer.player.time")) < 1e-6
    page.keyboard.down("Alt")
    drag(page, "block-b1", 0.995, 37.0)
    page.keyboard.up("Alt")
    wait_for(page, "piece.blocks[0].pace !== 1")
    assert counted(piece(page)["blocks"][0]["seconds"]) < 2e-2  # a pace is kept to a thousandth
    page.evaluate("studio.api.post('/api/seams')")
    wait_for(page, "piece.seams.every(({ state }) => state === 'inserted')")
    page.evaluate("studio.api.delete('/api/seams')")
    drag(page, "insertion-1", 0.97, 60.0)
    wait_for(page, "piece.seams[0].ask.seconds !== null")
    seam = piece(page)["seams"][0]
    assert counted(seam["at"] + seam["ask"]["seconds"]) < 2e-3
    # Told to land on a count, and where it cannot.
    page.get_by_test_id("wishes").click()
    field = page.get_by_test_id("wish-count")
    field.fill(str(int(seam["at"] * 1.5) + 8))
    field.press("Enter")
    wait_for(page, f"Math.abs(piece.seams[0].ask.seconds - {(int(seam['at'] * 1.5) + 7) / 1.5 - seam['at']}) < 0.006")
    field.fill("1")
    field.press("Enter")
    page.get_by_text("This insertion can land from").wait_for()


def test_time_is_counted_and_snaps_by_keys_alone(page: Any) -> None:
    hold_and_settle(page)
    begin_counting(page)
    said = "document.querySelector('[data-testid=ruler]').getAttribute('aria-valuetext')"
    ruler = page.get_by_test_id("ruler")
    ruler.focus()
    page.keyboard.press("Home")
    page.keyboard.press("g")
    for _ in range(7):
        page.keyboard.press("ArrowRight")
    wait_for(page, f"{said} === '4.67 seconds, phrase 2, count 2'")
    page.keyboard.press("ArrowLeft")
    wait_for(page, f"{said} === '4.00 seconds, phrase 2, count 1'")
    page.get_by_test_id("block-b2").focus()
    page.keyboard.press("Shift+ArrowRight")
    wait_for(page, "piece.blocks[1].hold > 0.5")
    first = piece(page)["blocks"][1]
    assert counted(first["at"] + first["hold"]) < 2e-3
    assert first["hold"] <= 0.5 + 60.0 / 90.0 + 1e-3
    page.keyboard.press("Shift+ArrowRight")
    wait_for(page, f"Math.abs(piece.blocks[1].hold - {first['hold'] + 60.0 / 90.0}) < 2e-3")
    for _ in range(4):  # two holds, counts and tempo
        page.keyboard.press("Control+z")
    wait_for(page, "studio.store.state.tempo === 120 && studio.store.state.counts === 8")
    assert piece(page)["blocks"][1]["hold"] == 0.5
    page.reload()
    wait_for(page, "studio.store.state.tempo === 120")
    page.keyboard.press("Control+Shift+z")
    wait_for(page, "studio.store.state.tempo === 90")
