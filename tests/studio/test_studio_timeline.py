"""The line of time, used as a choreographer does: by mouse, by keys alone, by touch."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from piece_page import piece, wait_for
from studio_server import LARGE, SMALL, Served, serving

from motionmind.geometry import rotations as rot
from motionmind.studio.placement import performance
from motionmind.studio.project import Project
from motionmind.studio.view import layout_of

pytestmark = pytest.mark.long

BEGIN = [("b1", "plies", 0, 12), ("b2", "adagio-barre", 9, 15), ("b3", "tendus", 11, 18)]
POSTURE = "application/x-motionmind-posture"


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The file of a piece of three stretches, two insertions found between them: searches take more than a page."""
    path = tmp_path_factory.mktemp("begun") / "piece.motionmind"
    with serving(Project.create(path, "ballet")) as served, served.listening() as events:
        for name, clip, first, last in BEGIN:
            served.insert(name, f"ballet/{clip}", first, last)
        while [seam["state"] for seam in served.project()["piece"]["seams"]] != ["inserted", "inserted"]:
            next(events)
    return path.read_bytes()


@pytest.fixture
def studio_server(begun: bytes, tmp_path: Path) -> Iterator[Served]:
    """A studio with a copy of that piece, in this process, at a free port; one worker."""
    path = tmp_path / "piece.motionmind"
    path.write_bytes(begun)
    with serving(Project.open(path)) as served:
        yield served


@pytest.fixture
def page(studio_page: Any) -> Any:
    """A page with that piece, all of which is seen and can be played."""
    wait_for_states(studio_page, ["inserted", "inserted"])
    wait_for(studio_page, "Math.abs(studio.viewer.player.motion.end - piece.seconds) < 0.01")
    studio_page.get_by_test_id("zoom-fit").click()
    return studio_page


def wait_for_states(page: Any, states: list[str]) -> None:
    wait_for(page, f"piece.seams.map(({{ state }}) => state).join() === '{','.join(states)}'")


def wait_for_blocks(page: Any, wanted: list[str]) -> None:
    name = "(block.mirrored ? '~' : '') + `${block.title} ${block.first}-${block.last}`"
    wait_for(page, f"piece.blocks.map((block) => {name}).join() === '{','.join(wanted)}'", 10.0)


def drag(page: Any, test: str, share: float, by: float) -> None:
    """Drag something by its place a share of the way along it."""
    box = page.get_by_test_id(test).bounding_box()
    x, y = box["x"] + share * box["width"], box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + by, y, steps=6)
    page.mouse.up()


def box_at_rest(page: Any, test: str) -> dict[str, float]:
    """The box of something that stays where it is: the line of time is fitted to its window after it is drawn."""
    boxes = [{}, *(page.get_by_test_id(test).bounding_box() for _ in range(2))]
    while boxes[-1] != boxes[-2] or boxes[-2] != boxes[-3]:
        page.wait_for_timeout(100)
        boxes.append(page.get_by_test_id(test).bounding_box())
    return boxes[-1]


def selection(page: Any) -> Any:
    return page.evaluate("studio.store.selection")


@pytest.mark.parametrize("studio_page", [LARGE, SMALL], ids=["large", "small"], indirect=True)
def test_a_piece_is_made_by_mouse(page: Any) -> None:
    width = page.get_by_test_id("block-b1").bounding_box()["width"]
    # Reorder, trim by an edge, split, duplicate, mirror, delete.
    drag(page, "block-b1", 0.5, 600.0)
    wait_for_blocks(page, ["adagio-barre 9-15", "plies 0-12", "tendus 11-18"])
    assert selection(page) == {"block": "b1"}
    drag(page, "block-b1", 0.99, -0.5 * width)
    wait_for(page, "piece.blocks[1].last < 9 && piece.blocks[1].last > 3")
    last = piece(page)["blocks"][1]["last"]
    ruler, block = (page.get_by_test_id(name).bounding_box() for name in ("ruler", "block-b1"))
    page.mouse.click(block["x"] + 0.5 * block["width"], ruler["y"] + 8)
    page.get_by_test_id("split").click()
    wait_for(page, "piece.blocks.length === 4")
    first, second = piece(page)["blocks"][1:3]
    assert (first["first"], second["last"]) == (0, last)
    assert first["last"] + 1 == second["first"]
    page.get_by_test_id("block-b2").click()
    page.get_by_test_id("duplicate").click()
    wait_for(page, "piece.blocks.length === 5 && piece.blocks[1].source === 'ballet/adagio-barre'")
    page.get_by_test_id("mirror").click()
    wait_for(page, "piece.blocks[1].mirrored")
    page.get_by_test_id("delete").click()
    wait_for(page, "piece.blocks.length === 4 && !piece.blocks.some(({ mirrored }) => mirrored)")
    for _ in range(6):  # split, duplicate, mirror, delete, trim, move
        page.get_by_test_id("undo").click()
    wait_for_blocks(page, ["plies 0-12", "adagio-barre 9-15", "tendus 11-18"])
    page.get_by_test_id("redo").click()
    wait_for_blocks(page, ["adagio-barre 9-15", "plies 0-12", "tendus 11-18"])


def test_an_insertion_is_flipped_locked_discarded_and_made_longer_by_mouse(page: Any) -> None:
    mark = page.get_by_test_id("insertion-1")
    mark.click(position={"x": 20, "y": 12})
    page.get_by_test_id("next").click()
    wait_for(page, "piece.seams[0].chosen === 2")
    assert piece(page)["parts"][1]["key"] == piece(page)["seams"][0]["alternatives"][1]["key"]
    page.get_by_test_id("lock").click()
    wait_for(page, "piece.seams[0].decision === 'locked'")
    assert page.get_by_test_id("next").is_disabled()
    page.get_by_test_id("lock").click()
    wait_for(page, "piece.seams[0].decision === 'open'")
    page.get_by_test_id("discard").click()
    wait_for(page, "piece.seams[0].state === 'discarded'")
    page.get_by_test_id("discard").click()
    wait_for(page, "piece.seams[0].state === 'inserted'")
    before, keys = piece(page)["seams"][0]["seconds"], [part["key"] for part in piece(page)["parts"]]
    page.evaluate("studio.api.delete('/api/seams')")
    drag(page, "insertion-1", 0.99, 40.0)
    wait_for(page, "piece.seams[0].state === 'waiting'")  # until it is found the one before stands there
    assert piece(page)["seams"][0]["seconds"] == before
    assert mark.bounding_box()["width"] > 60
    assert page.get_by_test_id("selected").inner_text().startswith("Insertion, ")
    assert [part["key"] for part in piece(page)["parts"]] == keys
    page.evaluate("studio.api.post('/api/seams')")
    wait_for(page, f"piece.seams[0].state === 'inserted' && piece.seams[0].seconds > {before + 0.1}")
    seam = piece(page)["seams"][0]
    assert seam["seconds"] == pytest.approx(seam["ask"]["seconds"])
    assert mark.get_attribute("data-state") == "inserted"


def test_a_posture_is_dropped_on_an_insertion_and_a_foot_is_pinned(page: Any) -> None:
    target = page.get_by_test_id("insertion-2")
    data = page.evaluate_handle(
        f"() => {{ const data = new DataTransfer(); data.setData('{POSTURE}', JSON.stringify({{ key: 'ballet/tendus', "
        "frame: 12 })); return data; }"
    )
    target.dispatch_event("dragover", {"dataTransfer": data})
    target.dispatch_event("drop", {"dataTransfer": data})
    wait_for(page, "piece.seams[1].ask.passing.length === 1 && piece.seams[1].state === 'inserted'")
    assert piece(page)["seams"][1]["ask"]["passing"] == [{"posture": "ballet/tendus", "frame": 12}]
    clip = page.evaluate_handle(
        f"() => {{ const data = new DataTransfer(); data.setData('{POSTURE}', JSON.stringify({{ key: 'ballet/tendus', "
        "frame: 0, last: 20 })); return data; }"
    )
    target.dispatch_event("drop", {"dataTransfer": clip})
    page.get_by_text("An insertion passes single postures").wait_for()
    assert piece(page)["seams"][1]["ask"]["passing"] == [{"posture": "ballet/tendus", "frame": 12}]
    target.click()
    page.get_by_test_id("wishes").click()
    page.get_by_role("button", name="Remove posture 1").click()
    wait_for(page, "piece.seams[1].ask.passing.length === 0")
    page.get_by_test_id("wish-joint").select_option("left_wrist")
    page.get_by_test_id("wish-hold").select_option("end")
    page.get_by_test_id("wish-pin-add").click()
    wait_for(page, "piece.seams[1].ask.pins.length === 1 && !['waiting', 'abrupt'].includes(piece.seams[1].state)")
    assert piece(page)["seams"][1]["ask"]["pins"] == [{"joint": "left_wrist", "hold": "end", "begins": 0, "ends": 1}]
    page.get_by_test_id("wishes-close").click()
    # A posture that is dropped beside the insertions becomes a stretch of its own.
    tracks = page.locator(".stretches")
    box = tracks.bounding_box()
    place = {"clientX": box["x"] + 2, "clientY": box["y"] + 5}
    tracks.dispatch_event("drop", {"dataTransfer": data, **place})
    wait_for(page, "piece.blocks.length === 4 && piece.blocks[0].source === 'ballet/tendus'")


def press_on(page: Any) -> Callable[..., None]:
    """A function that presses keys, one after the other."""

    def press(*keys: str) -> None:
        for key in keys:
            page.keyboard.press(key)

    return press


@pytest.mark.parametrize("studio_page", [SMALL], ids=["small"], indirect=True)
def test_stretches_are_arranged_by_keys_alone(page: Any) -> None:
    press = press_on(page)
    page.get_by_test_id("open-between").focus()
    for _ in range(150):
        press("Tab")
        if page.evaluate("document.activeElement.closest('.stretches') !== null"):
            break
    assert selection(page) == {"block": "b1"}
    press("Alt+ArrowRight")
    wait_for_blocks(page, ["adagio-barre 9-15", "plies 0-12", "tendus 11-18"])
    assert page.evaluate("document.activeElement.dataset.testid") == "block-b1"
    press("Shift+ArrowLeft")
    wait_for_blocks(page, ["adagio-barre 9-15", "plies 0-11", "tendus 11-18"])
    press("Alt+Shift+ArrowRight")
    wait_for_blocks(page, ["adagio-barre 9-15", "plies 1-11", "tendus 11-18"])
    press("m")
    wait_for_blocks(page, ["adagio-barre 9-15", "~plies 1-11", "tendus 11-18"])
    press("d")
    wait_for_blocks(page, ["adagio-barre 9-15", "~plies 1-11", "~plies 1-11", "tendus 11-18"])
    wait_for(page, "document.activeElement.dataset.testid !== 'block-b1'")
    press("Delete")
    wait_for_blocks(page, ["adagio-barre 9-15", "~plies 1-11", "tendus 11-18"])
    press("Control+z", "Control+z")
    wait_for_blocks(page, ["adagio-barre 9-15", "~plies 1-11", "tendus 11-18"])
    press("Control+z")
    wait_for_blocks(page, ["adagio-barre 9-15", "plies 1-11", "tendus 11-18"])
    press("Control+Shift+z")
    wait_for_blocks(page, ["adagio-barre 9-15", "~plies 1-11", "tendus 11-18"])
    # The playhead, and a split there.
    page.get_by_test_id("ruler").focus()
    press("Home", "ArrowRight", "ArrowRight", "ArrowRight", "ArrowRight")
    assert page.evaluate("studio.viewer.player.time") == pytest.approx(0.4)
    page.get_by_test_id("block-b2").focus()
    press("s")
    wait_for(page, "piece.blocks.length === 4")


@pytest.mark.parametrize("studio_page", [SMALL], ids=["small"], indirect=True)
def test_insertions_are_chosen_by_keys_alone(page: Any) -> None:
    press = press_on(page)
    # To the insertion before the last stretch: flip, lock, discard, restore, longer, a posture and a hand.
    page.get_by_test_id("block-b3").focus()
    press("ArrowLeft")
    assert selection(page) == {"seam": ["b2", "b3"]}
    press("ArrowDown")
    wait_for(page, "piece.seams[1].chosen === 2")
    press("ArrowUp")
    wait_for(page, "piece.seams[1].chosen === 1")
    press("u")
    wait_for(page, "piece.seams[1].decision === 'locked'")
    press("u", "Delete")
    wait_for(page, "piece.seams[1].state === 'discarded'")
    press("Delete")
    wait_for(page, "piece.seams[1].state === 'inserted'")
    before = piece(page)["seams"][1]["seconds"]
    for pause in (0, 0, 150, 150):  # faster than the first is answered, or found
        press("Shift+ArrowRight")
        page.wait_for_timeout(pause)
    wait_for(page, f"Math.abs(piece.seams[1].ask.seconds - {before + 0.4}) < 0.01")
    wait_for(page, f"piece.seams[1].state === 'inserted' && piece.seams[1].seconds > {before + 0.3}")
    press("w")
    page.get_by_test_id("wish-sheet").wait_for()
    for _ in range(20):
        press("Tab")
        if page.evaluate("document.activeElement.dataset.testid") == "wish-joint":
            break
    assert page.evaluate("document.activeElement.dataset.testid") == "wish-joint"
    press("ArrowDown")
    press("Tab", "Tab", "Enter")
    wait_for(page, "piece.seams[1].ask.pins.length === 1")
    press("Escape")
    assert page.get_by_test_id("wish-sheet").count() == 0


def test_no_key_is_lost_between_the_tracks_and_the_wishes(page: Any) -> None:
    """The sheet has the focus before the next key comes: from the tracks, that key closes it again."""
    page.get_by_test_id("block-b3").focus()
    page.keyboard.press("ArrowLeft")
    assert (
        page.evaluate(
            """async () => {
          const { activeElement: seam } = document;
          seam.dispatchEvent(new KeyboardEvent("keydown", { key: "w", bubbles: true, cancelable: true }));
          for (let turn = 0; turn < 100; turn++) await null; // neither a frame nor a timer comes in between
          return document.activeElement.dataset.testid;
        }"""
        )
        == "wish-seconds"
    )


def test_edits_come_in_the_order_in_which_they_were_made(page: Any) -> None:
    """A request that is held up is overtaken by none, and one that fails keeps up none."""
    titles: list[str] = []

    def hold(route: Any) -> None:
        edit = route.request.post_data_json["edit"]
        if edit["title"] == "first":
            page.wait_for_timeout(300)
        titles.append(edit["title"])
        route.continue_()

    page.route("**/api/edits", hold)
    last = page.evaluate(
        """async () => {
          const title = (title) => studio.api.edit({ edit: "title", title });
          const all = await Promise.allSettled(["first", "second", "third"].map(title));
          return all.at(-1).value.title;
        }"""
    )
    assert titles == ["first", "second", "third"]
    assert last == "third"


def test_smoothing_tells_how_far_it_is_and_can_be_stopped(page: Any) -> None:
    page.evaluate("studio.api.edit({ edit: 'mirror', block: 'b2' })")
    page.get_by_text(re.compile(r"^smoothing: [12] of 2 seams")).wait_for()
    page.get_by_role("button", name="Pause", exact=True).click()
    page.get_by_text(re.compile(r"^paused: [12] of 2 seams")).wait_for()
    page.reload()
    page.get_by_role("button", name="Resume", exact=True).click()
    wait_for_states(page, ["inserted", "inserted"])
    assert page.get_by_test_id("smoothing").count() == 0


def test_the_ruler_counts_and_the_piece_is_zoomed(page: Any) -> None:
    page.get_by_test_id("tempo").fill("60")
    page.get_by_test_id("tempo").press("Enter")
    wait_for(page, "studio.store.state.tempo === 60")
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")  # it is drawn
    ruler = page.get_by_test_id("ruler")
    ruler.focus()
    page.keyboard.press("Home")
    page.keyboard.press("PageUp")
    assert page.evaluate("studio.viewer.player.time") == pytest.approx(1.0)
    said = "document.querySelector('[data-testid=ruler]').getAttribute('aria-valuetext')"
    wait_for(page, f"{said} === '1.00 seconds, eight 1, count 2'")
    box_at_rest(page, "block-b2")
    pictures = "[...document.querySelectorAll('[data-testid=block-b2] img')].map((one) => one.getAttribute('src'))"
    before = page.evaluate(pictures)
    wide = page.locator(".timeline .inner").evaluate("(element) => element.clientWidth")
    page.get_by_test_id("block-b2").hover()
    page.keyboard.down("Control")
    page.mouse.wheel(0, -400)
    # A wheel's turn comes when the browser is ready for it, and counts as it is with the keys that are down then.
    wait_for(page, f"document.querySelector('.timeline .inner').clientWidth > {2 * wide}")
    page.keyboard.up("Control")
    # A stretch is pictured all along, closer when it is wider; pictures that were there stay.
    wait_for(page, f"{pictures}.length > {len(before)}")
    after = page.evaluate(pictures)
    assert len(set(after)) == len(after)
    assert set(before) <= set(after)


def test_a_finger_scrolls_and_drags_what_it_has_selected(studio_server: Any, page: Any, browser: Any) -> None:
    context = browser.new_context(
        viewport={"width": 1024, "height": 768}, device_scale_factor=0.5, reduced_motion="reduce", has_touch=True
    )
    touched = context.new_page()
    try:
        touched.goto(studio_server.entry)
        wait_for_states(touched, ["inserted", "inserted"])
        box = box_at_rest(touched, "block-b3")
        touched.touchscreen.tap(box["x"] + box["width"] / 2, box["y"] + 20)
        assert selection(touched) == {"block": "b3"}
        x, y = box["x"] + box["width"] / 2, box["y"] + 20
        session = context.new_cdp_session(touched)

        def touch(kind: str, *points: float) -> None:
            places = [{"x": points[0], "y": points[1]}] if points else []
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})

        touch("touchStart", x, y)
        for part in range(1, 9):
            touch("touchMove", x - part * x / 9, y)
        touch("touchEnd")
        wait_for_blocks(touched, ["tendus 11-18", "plies 0-12", "adagio-barre 9-15"])
    finally:
        context.close()


def test_the_page_plays_what_is_taken_away(studio_server: Any, page: Any) -> None:
    """The parts that the page plays and the whole movement of the piece are one movement, also between the parts."""
    studio_server.edit(edit="mirror", block="b2")
    studio_server.edit(edit="split", block="b3", at=14, id="b4")
    studio_server.edit(edit="decide", left="b1", right="b2", decision="discarded")
    wait_for(page, "piece.blocks.length === 4 && piece.seams[0].state === 'discarded'")
    project = studio_server.studio.project
    layout = layout_of(project.state, project.finding, project.marks)
    whole = performance(list(layout.parts), project.movements.get)
    times = np.linspace(0.0, layout.seconds, 300)
    expected = whole.at(times)
    wait_for(page, f"Math.abs(studio.viewer.piece.end - {layout.seconds}) < 1e-6")
    page.wait_for_timeout(1000)
    shown = page.evaluate(
        """(times) => times.map((time) => {
          const { piece } = studio.viewer;
          const [rotations, root] = [new Float64Array(piece.joints.length * 4), new Float64Array(3)];
          piece.sample(time, rotations, root);
          return [[...rotations], [...root], piece.insertedAt(time)];
        })""",
        times.tolist(),
    )
    rotations = np.array([one[0] for one in shown]).reshape(len(times), -1, 4)
    assert rot.angle(rotations, expected.rotations).max() < 1e-4
    assert np.abs(np.array([one[1] for one in shown]) - expected.root).max() < 1e-4
    assert (np.array([one[2] for one in shown]) == expected.inserted()).mean() > 0.99
