"""From A to B and taking it away, as somebody does it: in a browser, by mouse, and by keyboard alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pages import beside
from piece_page import LONG, from_a_to_b, until, wait_for_alternatives
from studio_server import LARGE, SMALL

pytestmark = pytest.mark.long


class Counted:
    """A mouse whose clicks are counted."""

    def __init__(self, page: Any) -> None:
        self.page, self.clicks = page, 0

    def click(self, testid: str) -> None:
        self.page.get_by_test_id(testid).click()
        self.clicks += 1


def drag(page: Any, source: Any, target: Any) -> None:
    """Drag as a hand does, which begins with a small move: by that the browser takes hold."""
    source.hover()
    page.mouse.down()
    box = source.bounding_box()
    page.mouse.move(box["x"] + 0.5 * box["width"] + 8, box["y"] + 0.5 * box["height"] + 8, steps=4)
    target.hover()
    page.mouse.up()


def painted(page: Any, canvas: str) -> int:
    """The number of colours of a canvas, some pixels of it."""
    script = """(canvas) => {
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      const seen = new Set();
      for (let i = 0; i < data.length; i += 4) seen.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
      return seen.size;
    }"""
    return int(page.locator(canvas).evaluate(script))


@pytest.mark.parametrize("studio_page", [LARGE, SMALL], ids=["large", "small"], indirect=True)
def test_from_the_open_page_to_a_file_in_six_clicks(studio_page: Any, tmp_path: Path) -> None:
    mouse = Counted(studio_page)
    mouse.click("posture-arabesque")
    mouse.click("posture-fifth")
    wait_for_alternatives(studio_page)
    mouse.click("alternative-2")
    mouse.click("accept")
    until(studio_page, "studio.store.selection?.seam && studio.viewer.isHome")  # what was accepted is what one sees
    mouse.click("open-take")
    with studio_page.expect_download() as download:
        mouse.click("export-html")
    assert mouse.clicks <= 6
    assert download.value.suggested_filename == "piece.html"
    download.value.save_as(tmp_path / "piece.html")
    shared = beside(studio_page)
    shared.goto((tmp_path / "piece.html").as_uri())
    until(shared, "window.motionmind?.motion.length > 10")
    assert shared.evaluate("motionmind.motion.insertions.length") == 1


def test_a_film_of_the_piece_is_taken_away_while_something_else_is_done(
    studio_server: Any, studio_page: Any, tmp_path: Path
) -> None:
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    studio_server.insert("b1", "ballet/adagio", 0, 2)
    until(studio_page, "studio.viewer.piece?.end > 0")
    seconds = studio_page.evaluate("studio.viewer.piece.end")
    studio_page.get_by_test_id("open-take").click()
    with studio_page.expect_download(timeout=LONG) as download:
        studio_page.get_by_test_id("export-film").click()
        studio_page.locator("progress[aria-label=Film]").wait_for()
        studio_page.get_by_test_id("open-pose").click()
        studio_page.get_by_test_id("handle-pelvis").wait_for()
        studio_server.edit(edit="delete", block="b1")
    assert download.value.suggested_filename == "piece.mp4"
    download.value.save_as(tmp_path / "piece.mp4")
    _, found = ffmpeg.count_frames_and_secs(str(tmp_path / "piece.mp4"))
    assert found == pytest.approx(seconds, abs=0.1)
    studio_page.get_by_text("Film saved: piece.mp4.").wait_for()


def test_how_far_a_film_is_leads_to_where_it_is_stopped(studio_server: Any, studio_page: Any) -> None:
    studio_server.insert("b1", "ballet/adagio", 0, 40)
    until(studio_page, "studio.viewer.piece?.end > 0")
    studio_page.get_by_test_id("open-take").click()
    studio_page.get_by_test_id("export-film").click()
    studio_page.get_by_test_id("open-vary").click()
    told = studio_page.get_by_test_id("filming")
    told.click()
    stop = studio_page.get_by_test_id("stop-film")
    stop.wait_for()
    with studio_page.expect_event("dialog") as asked:  # whoever closes the page loses it
        studio_page.close(run_before_unload=True)
    assert asked.value.type == "beforeunload"
    asked.value.dismiss()
    stop.click()
    studio_page.get_by_test_id("export-film").wait_for()
    told.wait_for(state="detached")
    assert studio_page.get_by_test_id("toast").count() == 0


@pytest.mark.parametrize("is_drawn", [True])
def test_four_alternatives_play_in_step_and_say_what_they_are(studio_page: Any) -> None:
    studio_page.emulate_media(reduced_motion="no-preference")
    # What is sought is seen to be: both ends, and nothing to play yet.
    held: list[Any] = []

    def hold(route: Any) -> None:
        held.append(route)

    studio_page.route("**/api/between", hold)
    studio_page.get_by_test_id("posture-arabesque").click()
    studio_page.get_by_test_id("posture-fifth").click()
    until(studio_page, "document.querySelectorAll('.waiting img').length === 8")
    play, time = studio_page.get_by_test_id("play-alternatives"), studio_page.get_by_label("Time of all alternatives")
    assert play.is_disabled()
    assert time.is_disabled()
    assert time.input_value() == "0"
    held[0].continue_()
    wait_for_alternatives(studio_page)
    until(studio_page, "document.querySelector('.alternatives input[type=range]').value > 0.1")
    time.fill("0.05")  # who takes hold of the time stops there
    assert float(time.input_value()) == pytest.approx(0.05)
    assert play.get_attribute("aria-label") == "Play all"
    assert [studio_page.get_by_test_id(f"alternative-{n}").count() for n in range(1, 6)] == [1, 1, 1, 1, 0]
    cards = studio_page.locator(".alternative .words")
    for text in cards.all_inner_texts():
        assert " s" in text
        assert "ballet" in text  # how usual it is
        assert "best" in text  # how sure
    assert studio_page.locator(".alternative .differs").count() == 3
    joints = studio_page.locator(".alternative .joints").all_text_contents()
    assert ["differs from the first" in text for text in joints] == [False, True, True, True]
    for n in range(1, 5):
        assert painted(studio_page, f"[data-testid=alternative-{n}] > canvas") > 50


def test_one_renderer_draws_all_nothing_plays_where_it_may_not_and_pointing_says_where_a_joint_was_seen(
    studio_page: Any,
) -> None:
    studio_page.emulate_media(reduced_motion="reduce")
    from_a_to_b(studio_page)
    assert studio_page.get_by_test_id("play-alternatives").get_attribute("aria-label") == "Play all"
    script = "[...document.querySelectorAll('.alternatives canvas')].filter((c) => c.getContext('webgl2')).length"
    assert studio_page.evaluate(script) == 1
    box = studio_page.get_by_test_id("alternative-1").bounding_box()
    words = studio_page.get_by_test_id("alternative-1").locator(".seen")
    said = set()
    for share in range(30, 70, 4):
        studio_page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + share / 100 * box["height"])
        said.add(words.inner_text())
    assert len(said - {""}) > 1
    studio_page.mouse.move(0, 0)
    assert words.inner_text() == ""
    assert studio_page.get_by_text("seen in", exact=False).count() > 0  # joint by joint


@pytest.mark.parametrize("studio_page", [LARGE, SMALL], ids=["large", "small"], indirect=True)
def test_buttons_set_the_ends_and_dragging_does(studio_page: Any) -> None:
    page = studio_page
    passe = page.get_by_test_id("posture-passe")
    passe.wait_for()
    before = passe.bounding_box()
    page.get_by_test_id("posture-first").click()
    page.locator(".end img").wait_for()
    assert passe.bounding_box() == pytest.approx(before, abs=1)  # nothing moves away from under the hand
    page.get_by_test_id("set-b").click()
    ends = "JSON.stringify([studio.desk.ends.a?.key, studio.desk.ends.b?.key])"
    assert page.evaluate(ends) == '["ballet/first","ballet/first"]'
    assert passe.bounding_box() == pytest.approx(before, abs=1)
    for card in page.locator(".alternative:has(summary)").all():  # where joints are told of is seen without scrolling
        box, summary = card.bounding_box(), card.locator("summary").bounding_box()
        assert summary["y"] + summary["height"] <= box["y"] + box["height"]
    drag(page, passe, page.locator(".end").nth(1))
    page.locator(".end").nth(1).get_by_text("passe").wait_for()  # the browser tells of the drop when it comes to it
    assert page.evaluate(ends) == '["ballet/first","ballet/passe"]'
    page.get_by_label("Exchange A and B").click()
    assert page.evaluate(ends) == '["ballet/passe","ballet/first"]'


def test_any_moment_of_a_clip_is_an_end(studio_page: Any) -> None:
    page = studio_page
    page.get_by_placeholder("Search postures and clips").fill("adagio")
    page.get_by_test_id("clip-adagio").click()
    page.get_by_test_id("frames").fill("20")
    page.get_by_role("button", name="As A").click()
    page.get_by_test_id("frames").fill("30")
    drag(page, page.get_by_test_id("moment"), page.locator(".end").nth(1))
    until(page, "studio.desk.ends.b?.frame === 30")
    assert page.evaluate("studio.desk.ends.a.frame") == 20
    wait_for_alternatives(page)


def test_a_whole_clip_goes_onto_the_line_of_time(studio_page: Any) -> None:
    page = studio_page
    page.get_by_placeholder("Search postures and clips").fill("adagio")
    page.get_by_test_id("clip-adagio").click()
    page.get_by_test_id("insert-clip").click()
    until(page, "studio.store.state.piece.blocks.length === 1")
    assert page.evaluate("studio.store.state.piece.blocks[0].source") == "ballet/adagio"
    until(page, "studio.viewer.isHome && studio.viewer.player.motion.end > 10")


def test_a_piece_that_begins_with_an_insertion_is_seen_after_a_reload(studio_page: Any) -> None:
    page = studio_page
    from_a_to_b(page)
    page.get_by_test_id("accept").click()
    until(page, "studio.store.state.piece.blocks.length === 2 && studio.store.state.piece.parts[1].inserted")
    held: list[Any] = []

    def hold(route: Any) -> None:
        held.append(route)

    page.route("**/api/movements/m-*", hold)  # the insertion comes late
    page.reload()
    until(page, "window.studio?.viewer.stage?.camera.position.length() > 0.5")
    for _ in range(200):
        if held:
            break
        page.wait_for_timeout(25)
    assert page.evaluate("studio.viewer.stage.root.slice(0, 3).some((x) => x !== 0)")  # and A stands there meanwhile
    reach = page.evaluate("studio.viewer.stage.reach")
    for one in held:
        one.continue_()
    until(page, f"Math.abs(studio.viewer.stage.reach - {reach}) > 1e-6")
    assert page.evaluate("studio.viewer.stage.camera.position.toArray().every(Number.isFinite)")


def test_nothing_is_left_of_an_emptied_piece(studio_page: Any) -> None:
    page = studio_page
    page.keyboard.press("Control+z")  # nothing to take back: no error on the console, as the fixture sees
    page.get_by_test_id("posture-passe").click()
    page.get_by_test_id("insert-posture").click()
    until(page, "studio.viewer.isHome && studio.viewer.motion?.end === 0 && !document.querySelector('.half').hidden")
    page.locator(".stretches [role=option]").click()
    page.keyboard.press("Delete")
    until(page, "studio.store.state.piece.blocks.length === 0 && !studio.viewer.motion")
    assert not page.locator(".stage canvas").is_visible()
    assert page.get_by_test_id("play").is_disabled()
    page.keyboard.press("Control+z")
    until(page, "studio.viewer.motion !== undefined")
    assert page.locator(".stage canvas").is_visible()
    page.keyboard.press("Control+Shift+z")
    until(page, "!studio.viewer.motion")
    page.keyboard.press("Control+Shift+z")


@pytest.mark.parametrize("studio_page", [SMALL], ids=["small"], indirect=True)
def test_it_all_goes_by_keyboard_alone(studio_page: Any) -> None:
    page = studio_page
    page.wait_for_selector("[data-testid=posture-arabesque]")
    page.keyboard.press("Tab")

    def reach(selector: str) -> None:
        for _ in range(200):
            if page.evaluate(f"document.activeElement.matches('{selector}')"):
                return
            page.keyboard.press("Tab")
        raise AssertionError(f"no Tab leads to {selector}")

    reach("[data-testid=posture-first]")
    for posture, key in (("arabesque", "ArrowRight"), ("fifth", "ArrowLeft")):
        while not page.evaluate(f"document.activeElement.matches('[data-testid=posture-{posture}]')"):
            page.keyboard.press(key)
        page.keyboard.press("Enter")
    wait_for_alternatives(page)
    page.keyboard.press("3")
    assert page.get_by_test_id("alternative-3").get_attribute("aria-checked") == "true"
    focused = "document.activeElement.dataset.testid"
    assert page.evaluate(focused) == "alternative-3"
    page.keyboard.press("ArrowDown")
    assert page.get_by_test_id("alternative-3").locator(".seen").inner_text() != ""
    page.keyboard.press("Enter")
    until(page, "studio.store.state.piece.blocks.length === 2")
    assert page.evaluate("studio.store.state.piece.seams[0].chosen") == 3
    until(page, f"{focused} === 'posture-fifth'")  # the next one begins here
    page.keyboard.press("t")
    assert page.evaluate(focused) == "block-b1"
    page.keyboard.press("Control+z")
    until(page, "studio.store.state.piece.blocks.length === 0")
    page.keyboard.press("Control+Shift+z")
    until(page, "studio.store.state.piece.blocks.length === 2")
    page.keyboard.press("p")
    assert page.evaluate(focused) == "open-between"
    while not page.evaluate("document.activeElement.matches('[data-testid=open-take]')"):
        page.keyboard.press("ArrowDown")
    reach("[data-testid=export-bvh]")
    with page.expect_download() as download:
        page.keyboard.press("Enter")
    assert download.value.suggested_filename == "piece.bvh"


def test_the_title_is_edited_and_taken_back(studio_page: Any) -> None:
    title = studio_page.get_by_test_id("title")
    title.fill("Evening")
    title.press("Enter")
    until(studio_page, "studio.store.state.title === 'Evening'")
    until(studio_page, "document.title.startsWith('Evening')")
    studio_page.get_by_test_id("undo").click()
    until(studio_page, "studio.store.state.title === 'piece'")
    until(studio_page, "document.querySelector('[data-testid=title]').value === 'piece'")


def test_what_fails_is_said_in_one_line(studio_page: Any) -> None:
    studio_page.evaluate("studio.act(() => Promise.reject(new Error('nothing came of it')))")
    assert "nothing came of it" in studio_page.get_by_test_id("toast").inner_text()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_paper_is_as_the_system_has_it_until_it_is_switched(studio_page: Any, scheme: str) -> None:
    studio_page.emulate_media(color_scheme=scheme)
    paper = "getComputedStyle(document.body).backgroundColor"
    before = studio_page.evaluate(paper)
    assert (before == "rgb(27, 26, 30)") == (scheme == "dark")
    # Small pictures, drawn for light paper, are brighter on dark.
    studio_page.locator("[data-testid=posture-fifth] img").wait_for()
    filtered = "getComputedStyle(document.querySelector('[data-testid=posture-fifth] img')).filter"
    assert (studio_page.evaluate(filtered) != "none") == (scheme == "dark")
    studio_page.get_by_test_id("dark").click()
    assert studio_page.evaluate(paper) != before
    assert (studio_page.evaluate(filtered) == "none") == (scheme == "dark")


def test_the_sheet_of_keys_tells_what_they_do(studio_page: Any) -> None:
    studio_page.wait_for_selector("[data-testid=gallery]")
    studio_page.keyboard.press("?")
    sheet = studio_page.get_by_test_id("keys")
    assert "play or pause" in sheet.inner_text()
    studio_page.keyboard.press("Escape")
    sheet.wait_for(state="detached")


def test_a_telephone_shows_and_approves(studio_page: Any) -> None:
    page = studio_page
    page.set_viewport_size({"width": 390, "height": 844})
    from_a_to_b(page)
    windows = [page.get_by_test_id(f"alternative-{n}").bounding_box() for n in range(1, 5)]
    assert min(box["height"] for box in windows) > 80
    page.get_by_test_id("alternative-2").click()
    assert "ballet" in page.locator(".chosen-words").inner_text()  # how usual, and how sure
    page.get_by_test_id("accept").click()
    until(page, "studio.store.state.piece.blocks.length === 2")
    # What was inserted is flipped through, and seen to be inserted; it is locked, or left out.
    page.get_by_test_id("insertion-1").click()
    assert page.get_by_test_id("made").is_hidden()
    page.get_by_test_id("next").click()
    until(page, "studio.store.state.piece.seams[0].chosen === 3")
    page.get_by_test_id("made").wait_for()
    page.get_by_test_id("lock").click()
    until(page, "studio.store.state.piece.seams[0].decision === 'locked'")
    page.get_by_test_id("lock").click()
    until(page, "studio.store.state.piece.seams[0].decision === 'open'")
    page.get_by_test_id("discard").click()
    until(page, "studio.store.state.piece.seams[0].state === 'discarded'")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    # A moment of the piece that is posed is called so.
    page.get_by_test_id("undo").click()
    page.get_by_test_id("made").wait_for()
    page.get_by_test_id("open-pose").click()
    page.locator(".caption .name").get_by_text("piece at 1.").wait_for()
    chosen = page.get_by_test_id("pose-from").evaluate("(select) => select.selectedOptions[0].textContent")
    assert chosen.startswith("piece at 1.")


def test_film_strips_lead_to_a_moment_and_the_dial_to_the_next_four(
    studio_page: Any, axe_faults: Callable[[Any], list[str]]
) -> None:
    page = studio_page
    from_a_to_b(page)
    strips = page.locator(".film")
    assert strips.count() == 4
    for width in (390, 1024, 1440):
        page.set_viewport_size({"width": width, "height": 900})
        assert axe_faults(page) == []
        assert page.get_by_test_id("spread").bounding_box()["height"] >= 24
    drawn = "[...document.querySelectorAll('.film img')].filter((one) => one.complete && one.naturalWidth).length"
    until(page, f"{drawn} === 24")
    end = page.evaluate("studio.desk.found[1].motion.end")
    box = page.get_by_test_id("film-2").bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    whole = page.evaluate("Math.max(...studio.desk.found.map(({ motion }) => motion.end))")
    time = page.get_by_label("Time of all alternatives")
    assert float(time.input_value()) == pytest.approx(0.5 * end / whole, abs=0.01)
    lines = [one.evaluate("(line) => parseFloat(line.style.left)") for one in page.locator(".film-line").all()]
    assert lines[1] == pytest.approx(50.0, abs=1.0)  # the same moment of each
    ends = page.evaluate("studio.desk.found.map(({ motion }) => motion.end)")
    assert lines == pytest.approx([min(50.0 * end / own, 100.0) for own in ends], abs=1.0)
    usual = page.locator(".differs").all_inner_texts()
    # By keys, then by mouse.
    page.get_by_test_id("spread").focus()
    page.keyboard.press("ArrowRight")
    until(page, "studio.desk.spread === 'far' && studio.desk.state === 'searching'")
    wait_for_alternatives(page)
    far = page.locator(".differs").all_inner_texts()
    assert far != usual
    dial = page.get_by_test_id("spread")
    box = dial.bounding_box()
    page.mouse.click(box["x"] + 2, box["y"] + 0.5 * box["height"])
    until(page, "studio.desk.spread === 'near'")
    wait_for_alternatives(page)
    assert page.locator(".differs").all_inner_texts() not in (usual, far)
    page.reload()
    until(page, "window.studio?.desk?.spread === 'near'")
    wait_for_alternatives(page)
    page.get_by_test_id("accept").click()
    until(page, "studio.store.state.piece.blocks.length === 2")


def test_what_was_found_before_a_search_is_cancelled_is_accepted(studio_page: Any) -> None:
    page = studio_page
    for posture in ("arabesque", "fifth"):
        page.get_by_test_id(f"posture-{posture}").click()
    until(page, "studio.desk.found.length > 0")
    page.evaluate("studio.desk.stop()")
    page.get_by_test_id("accept").click()
    until(page, "studio.store.state.piece.blocks.length === 2")


def test_the_first_stretch_is_shown_though_the_gallery_answers_late(studio_page: Any) -> None:
    page = studio_page
    wait = lambda route: (page.wait_for_timeout(1500), route.continue_())  # noqa: E731
    page.get_by_test_id("posture-first").wait_for()
    page.route("**/api/movements/ballet/*", wait)
    page.reload()
    page.get_by_test_id("posture-fifth").wait_for()
    page.evaluate("void studio.api.edit({ edit: 'insert', id: 'x1', source: 'ballet/fifth', first: 0, last: 0 })")
    until(page, "studio.viewer.piece && studio.viewer.motion === studio.viewer.piece && studio.viewer.isHome")
    page.wait_for_timeout(2000)  # what comes late comes
    assert page.evaluate("studio.viewer.isHome")
    # What is picked and added at once is shown in the piece.
    page.get_by_test_id("posture-arabesque").click()
    page.get_by_test_id("insert-posture").click()
    until(page, "studio.store.state.piece.blocks.length === 2 && studio.viewer.isHome")
    page.wait_for_timeout(2000)
    assert page.evaluate("studio.viewer.isHome && studio.viewer.motion === studio.viewer.piece")


def test_the_slider_is_as_long_amid_an_insertion_and_credits_open_to_a_finger(studio_page: Any) -> None:
    page = studio_page
    from_a_to_b(page)
    page.get_by_test_id("accept").click()
    until(page, "studio.store.state.piece.blocks.length === 2 && studio.viewer.isHome")
    boxes = []
    for share, is_inserted in ((0.0, False), (0.5, True), (1.0, False)):
        page.evaluate(f"studio.viewer.player.seek({share} * studio.viewer.player.motion.end)")
        page.wait_for_timeout(50)
        assert page.get_by_test_id("made").is_visible() == is_inserted
        boxes.append(page.get_by_test_id("scrub").bounding_box())
    assert boxes[0] == boxes[1] == boxes[2]
    page.get_by_test_id("open-take").click()
    summary = page.get_by_test_id("credits").locator("summary")
    summary.wait_for()
    assert summary.bounding_box()["height"] >= 24
