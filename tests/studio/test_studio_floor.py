"""The path of an insertion over the floor, drawn in the viewer by mouse, moved by keys, or set by fields; the stage."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from piece_page import until, wait_for
from studio_server import LARGE, SMALL, Served

from motionmind.geometry.polylines import offsets_to
from motionmind.studio.export import composed
from motionmind.studio.project import Project

pytestmark = pytest.mark.long

INSERTED = "piece.seams[0]?.state === 'inserted'"
PIXEL = """([x, z]) => {
  const { stage, overlay } = studio.viewer;
  stage.camera.updateMatrixWorld();
  const point = stage.middle.clone().set(x, 0, z).project(stage.camera);
  const { left, top, width, height } = overlay.getBoundingClientRect();
  return [left + 0.5 * (point.x + 1) * width, top + 0.5 * (1 - point.y) * height];
}"""
HANDLE = """([x, y]) => {
  const { left, top, width, height } = document.querySelector("[data-testid=floor-point-2]").getBoundingClientRect();
  return Math.hypot(left + width / 2 - x, top + height / 2 - y) < 2;
}"""
START = """() => {
  const { place, turn } = studio.store.state.piece.parts.find((one) => one.inserted);
  return [...place, turn];
}"""
TRAVEL = "piece.seams[0].ask.travel"


def _insertion(page: Any, server: Served) -> None:
    """Make a piece of three stretches, and select its first insertion."""
    server.insert("b1", "ballet/arabesque")
    server.insert("b2", "ballet/fifth")
    server.insert("b3", "ballet/adagio", 0, 20)
    server.edit(edit="ask", left="b1", right="b2", seconds=2.5)
    wait_for(page, f"{INSERTED} && piece.seams[1].state === 'smooth'")
    page.get_by_test_id("insertion-1").click()
    page.get_by_test_id("floor-draw").wait_for()
    page.evaluate("document.activeElement.blur()")


def _to_floor(start: list[float], places: Any) -> Any:
    """Bring places of the insertion [N, 2] onto the viewer's floor."""
    x, z, turn = start
    sine, cosine = np.sin(turn), np.cos(turn)
    return np.asarray(places) @ np.array([[cosine, -sine], [sine, cosine]]) + [x, z]


def _travel(page: Any) -> Any:
    return page.evaluate("studio.store.state.piece.seams[0].ask.travel")


def _check_path(server: Served, page: Any) -> None:
    """Check that the insertion is on its path, and that the rest of the piece begins where it ends."""
    parts = page.evaluate("studio.store.state.piece.parts")
    (_, part, after, *_) = parts
    path = _to_floor(page.evaluate(START), [[0.0, 0.0], *_travel(page)["points"]])
    motion = composed(server.studio)
    own = motion.root[(part["at"] < motion.times) & (motion.times < after["at"] + 1e-9)][:, [0, 2]]
    assert len(own) > 10
    assert np.linalg.norm(offsets_to(path, own), axis=1).max() < 0.1
    assert own[-1] == pytest.approx(path[-1], abs=0.02)  # the next stretch begins there
    begins = next(place for place, time in zip(motion.root, motion.times, strict=True) if time > after["at"] + 1e-6)
    assert np.linalg.norm(begins[[0, 2]] - path[-1]) < 0.15


@pytest.mark.parametrize("studio_page", [LARGE], ids=["large"], indirect=True)
def test_a_path_is_drawn_and_dragged_by_mouse_and_all_that_follows_stays_attached(
    studio_server: Served, studio_page: Any, axe_faults: Any
) -> None:
    page = studio_page
    _insertion(page, studio_server)
    page.get_by_test_id("floor-draw").click()
    until(page, "document.querySelector('.half').classList.contains('drawing')")
    start = page.evaluate(START)
    corner = _to_floor(start, [[0.0, 0.0], [0.6, 0.1], [0.6, 0.7]])
    pixels = [page.evaluate(PIXEL, place.tolist()) for place in corner]
    camera = "JSON.stringify(studio.viewer.stage.camera.position)"
    before = page.evaluate(camera)
    page.mouse.move(*pixels[0])
    page.mouse.down()
    for x, y in pixels[1:]:
        page.mouse.move(x, y, steps=8)
    page.mouse.up()
    wait_for(page, TRAVEL)
    assert page.evaluate(camera) == before  # it is the path that is drawn
    assert page.get_by_test_id("floor-draw").get_attribute("aria-pressed") == "false"
    assert np.array(_travel(page)["points"]) == pytest.approx(np.array([[0.6, 0.1], [0.6, 0.7]]), abs=0.03)
    wait_for(page, f"{INSERTED} && piece.seams[0].alternatives[0].words.includes('travels')")
    off = page.get_by_test_id("floor-off").inner_text()
    assert off.startswith("travels 1.2 m, up to")
    assert off.endswith("cm off the path")
    _check_path(studio_server, page)
    assert axe_faults(page) == []

    page.evaluate("studio.viewer.look('top')")
    x, y = page.evaluate(PIXEL, _to_floor(start, _travel(page)["points"])[1].tolist())
    until(page, HANDLE, [x, y])
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(*page.evaluate(PIXEL, _to_floor(start, [[0.3, 0.9]])[0].tolist()), steps=6)
    page.mouse.up()
    wait_for(page, f"{TRAVEL}.points[1][1] > 0.8 && {INSERTED}")
    assert _travel(page)["points"][1] == pytest.approx([0.3, 0.9], abs=0.03)
    _check_path(studio_server, page)
    kept = _travel(page)
    page.reload()
    wait_for(page, INSERTED)
    assert _travel(page) == kept
    page.get_by_test_id("insertion-1").click()
    page.get_by_test_id("floor-point-2").wait_for()
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("Control+z")
    wait_for(page, f"{TRAVEL}.points[1][1] < 0.8 && {INSERTED}")
    page.keyboard.press("Control+z")
    wait_for(page, f"!{TRAVEL} && {INSERTED}")
    assert page.get_by_test_id("floor-point-1").count() == 0


@pytest.mark.parametrize("studio_page", [SMALL], ids=["small"], indirect=True)
def test_a_click_sets_where_it_ends_and_escape_leaves_it_as_it_was(studio_server: Served, studio_page: Any) -> None:
    page = studio_page
    _insertion(page, studio_server)
    place = _to_floor(page.evaluate(START), [[0.4, 0.5]])[0].tolist()
    for key in ("Escape", "Enter"):
        page.get_by_test_id("floor-draw").click()
        until(page, "document.querySelector('.half').classList.contains('drawing')")
        page.mouse.click(*page.evaluate(PIXEL, place))
        page.get_by_test_id("floor-point-1").wait_for()
        assert _travel(page) is None
        page.keyboard.press(key)
        until(page, "!document.querySelector('.half').classList.contains('drawing')")
        assert page.get_by_test_id("floor-point-1").count() == (key == "Enter")
    wait_for(page, TRAVEL)
    assert _travel(page)["points"] == [pytest.approx([0.4, 0.5], abs=0.03)]
    wait_for(page, INSERTED)
    assert page.get_by_test_id("floor-off").inner_text().startswith("travels")
    ends = composed(studio_server.studio)
    after = page.evaluate("studio.store.state.piece.blocks[1].at")
    at = int(np.abs(ends.times - after).argmin())
    assert ends.root[at, [0, 2]] == pytest.approx(place, abs=0.04)


@pytest.mark.parametrize("studio_page", [SMALL], ids=["small"], indirect=True)
def test_a_path_is_made_moved_and_removed_by_keys_and_fields(
    studio_server: Served, studio_page: Any, axe_faults: Any
) -> None:
    page = studio_page
    _insertion(page, studio_server)
    page.evaluate("studio.viewer.look('top')")
    page.get_by_test_id("floor-draw").focus()
    page.keyboard.press("Enter")
    wait_for(page, TRAVEL)
    (first,) = _travel(page)["points"]
    until(page, "document.activeElement.dataset.testid === 'floor-point-1'")
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("ArrowUp")
    wait_for(page, f"{TRAVEL}.points[0][0] !== {first[0]}")
    size = page.evaluate("studio.viewer.motion.body.size")
    start = page.evaluate(START)
    before, after = _to_floor(start, [first, _travel(page)["points"][0]])
    assert after - before == pytest.approx([0.25 * size, -0.05 * size], abs=0.002)  # seen from above: right, and up
    page.keyboard.press("Enter")
    wait_for(page, f"{TRAVEL}.points.length === 2")
    until(page, "document.activeElement.dataset.testid === 'floor-point-2'")
    page.keyboard.press("Delete")
    wait_for(page, f"{TRAVEL}.points.length === 1")
    page.get_by_test_id("wishes").click()
    field = page.get_by_test_id("travel-1-ahead")
    field.fill("70")
    field.press("Enter")
    wait_for(page, f"{TRAVEL}.points[0][1] === 0.7")
    page.get_by_test_id("travel-facing").fill("90")
    page.get_by_test_id("travel-facing").press("Enter")
    wait_for(page, f"{TRAVEL}.facing === 90 && {INSERTED}")
    assert axe_faults(page) == []
    parts = page.evaluate("studio.store.state.piece.parts")
    assert [parts[0]["turn"], parts[1]["turn"]] == [0.0, 0.0]
    turns = {round(part["turn"], 9) for part in parts[2:]}
    assert len(turns) == 1  # all that follows is turned
    assert abs(turns.pop()) > 0.5
    page.get_by_test_id("travel-facing").fill("")
    page.get_by_test_id("travel-facing").press("Enter")
    wait_for(page, f"{TRAVEL}.facing === null")
    page.get_by_test_id("travel-clear").click()
    wait_for(page, f"!{TRAVEL}")


@pytest.mark.parametrize("studio_page", [SMALL], ids=["small"], indirect=True)
def test_a_point_that_keys_moved_is_kept_when_something_else_is_selected(
    studio_server: Served, studio_page: Any
) -> None:
    page = studio_page
    _insertion(page, studio_server)
    page.get_by_test_id("floor-draw").focus()
    page.keyboard.press("Enter")
    wait_for(page, f"{TRAVEL} && {INSERTED}")
    (first,) = _travel(page)["points"]
    page.get_by_test_id("floor-point-1").focus()
    page.evaluate(
        """() => {
          const key = new KeyboardEvent("keydown", { key: "ArrowRight", bubbles: true });
          document.querySelector("[data-testid=floor-point-1]").dispatchEvent(key);
          studio.store.set({ selection: { block: "b3" } });
        }"""
    )
    wait_for(page, f"JSON.stringify({TRAVEL}.points[0]) !== '{json.dumps(first, separators=(',', ':'))}'")


@pytest.mark.parametrize("studio_page", [LARGE], ids=["large"], indirect=True)
def test_the_stage_is_drawn_kept_and_exported(studio_server: Served, studio_page: Any, axe_faults: Any) -> None:
    page = studio_page
    studio_server.insert("b1", "ballet/adagio", 0, 20)
    wait_for(page, "piece.blocks.length === 1")
    page.get_by_test_id("sights").click()
    width, depth = page.get_by_test_id("stage-width"), page.get_by_test_id("stage-depth")
    width.fill("8")
    width.press("Enter")
    until(page, "studio.store.state.stage?.join() === '8,6'")
    depth.fill("5")
    depth.press("Enter")
    until(page, "studio.store.state.stage?.join() === '8,5'")
    assert axe_faults(page) == []
    edge = """() => {
      const { edge } = studio.viewer.stage, { array } = edge.geometry.attributes.position;
      const across = [0, 2].map((axis) => array.filter((_, i) => i % 3 === axis));
      return [Boolean(edge.parent), ...across.map((values) => Math.max(...values))];
    }"""
    assert page.evaluate(edge) == [True, pytest.approx(4.0, abs=0.05), pytest.approx(2.5, abs=0.05)]
    page.evaluate("studio.viewer.look('top')")
    for x, z in ((-4.0, -2.5), (4.0, 2.5)):  # all of it is seen from above
        left, top = page.evaluate(PIXEL, [x, z])
        box = page.locator(".half canvas").first.bounding_box()
        assert 0.0 < left - box["x"] < box["width"]
        assert 0.0 < top - box["y"] < box["height"]
    assert b'"stage":[8.0,5.0]' in studio_server.send("GET", "/api/export/html").body
    page.reload()
    until(page, "studio.viewer?.stage?.edge?.parent")
    page.keyboard.press("Control+z")
    until(page, "studio.store.state.stage.join() === '8,6'")
    page.get_by_test_id("sights").wait_for()
    if page.get_by_test_id("stage-width").count() == 0:
        page.get_by_test_id("sights").click()
    page.get_by_test_id("stage-width").fill("")
    page.get_by_test_id("stage-width").press("Enter")
    until(page, "studio.store.state.stage === null && !studio.viewer.stage.edge")


def test_the_project_keeps_paths_and_the_stage_and_its_versions_keep_paths(make_project: Any) -> None:
    from motionmind.studio import edits as e

    project: Project = make_project()
    for number in range(2):
        project.edit("w", e.Insert(f"b{number}", "ballet/adagio", 10 * number, 10 * number))
    travel = e.Travel(((0.5, 0.5), (1.0, 0.0)), 45.0)
    project.edit("w", e.Wish("b0", "b1", travel=travel))
    project.edit("w", e.SaveVersion("drawn"))
    project.edit("w", e.SetStage((8.0, 6.0)))
    project.edit("w", e.Wish("b0", "b1"))
    project.edit("w", e.GoBack("drawn"))
    project.close()
    again: Project = make_project()
    assert again.state.seams[0].verdict.ask == e.Ask(travel=travel)
    assert again.state.stage == (8.0, 6.0)
    for _ in range(3):
        again.undo("w")
    assert again.state.stage is None
