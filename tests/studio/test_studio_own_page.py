"""Variations and one's own movement on the page, by mouse and by keyboard alone."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from bundled_clips import ballet_clip
from gltf_files import with_clips
from pages import RESTING, Tabs
from piece_page import until
from scores import BENDS
from studio_server import Served, serving

from motionmind.studio.project import Project

pytestmark = pytest.mark.long

SIZES = {"large, light": (1440, 900, "light"), "small, dark": (1024, 768, "dark")}
LONG = 60_000  # milliseconds: the machine may be busy

Open = Callable[..., Any]


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    """A studio with an empty piece, and a home of its own."""
    home = tmp_path / "home"
    with serving(Project.create(tmp_path / "piece.motionmind", "ballet", home), home) as found:
        yield found


@pytest.fixture
def open_page(served: Served, tabs: Tabs) -> Iterator[Open]:
    """Open the page at a size; whatever its console calls an error fails the test."""
    errors: list[str] = []

    def note(message: Any) -> None:
        # Pictures of the corpus that a test deletes may still be on their way then, and files are refused.
        place = message.location.get("url", "")
        if message.type == "error" and "/api/thumbnails/mine" not in place and not place.endswith("/api/imports"):
            errors.append(f"{message.text} {place}")

    hearing = {"console": note, "pageerror": lambda error: errors.append(str(error))}

    def visit(width: int = 1440, height: int = 900, scheme: str = "light") -> Any:
        size = {"width": width, "height": height}
        page = using.enter_context(tabs.tab(hearing, viewport=size, color_scheme=scheme, **RESTING))
        page.set_default_timeout(LONG)
        page.goto(served.entry)
        until(page, "window.studio?.store.state")
        return page

    with ExitStack() as using:
        yield visit
    assert not errors


def piece(served: Served) -> list[str]:
    """The stretches of the piece, by their ids."""
    return [block["id"] for block in served.project()["piece"]["blocks"]]


def two_clips(served: Served) -> None:
    served.insert("b1", "ballet/adagio", 0, 40)
    served.insert("b2", "ballet/petit-allegro", 0, 25)


def tab_to(page: Any, name: str) -> None:
    """Press Tab until what has a test id has the focus, as whoever has no mouse does."""
    for _ in range(150):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement?.dataset?.testid") == name:
            return
    raise AssertionError(f"Tab does not lead to {name}")


def to_panel(page: Any, name: str) -> None:
    """Open a panel by keyboard: the rail is one stop, arrows lead on."""
    for _ in range(150):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement?.getAttribute('role')") == "tab":
            break
    for _ in range(5):
        if page.get_by_test_id(f"open-{name}").get_attribute("aria-selected") == "true":
            return
        page.keyboard.press("ArrowDown")
    raise AssertionError(f"the arrows do not lead to {name}")


def order(page: Any) -> list[str]:
    """The pictures of the order that is shown."""
    found: list[str] = page.get_by_test_id("order").locator("img").evaluate_all("all => all.map(one => one.src)")
    return found


# --- variations -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", SIZES)
def test_a_piece_is_varied_by_mouse(served: Served, open_page: Open, size: str) -> None:
    two_clips(served)
    page = open_page(*SIZES[size])
    page.get_by_test_id("open-vary").click()
    page.get_by_test_id("tile-3").wait_for()
    first = order(page)
    # The start, dragged by hand, gives another order while it is dragged.
    box = page.get_by_test_id("map").bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 0.35 * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + 0.62 * box["width"], box["y"] + 0.4 * box["height"], steps=6)
    page.mouse.up()
    until(
        page, "was => [...document.querySelectorAll('.tiles img')].map(i => i.src).join() !== was", arg=",".join(first)
    )
    assert page.get_by_test_id("map").get_attribute("aria-valuetext") != "default"
    # What is kept stays while the rest is varied anew.
    page.get_by_test_id("tile-2").get_by_role("button", name=re.compile("^Keep")).click()
    name = page.locator(".tiles li.kept .keep").get_attribute("aria-label").partition(": ")[2]
    page.get_by_test_id("another").click()
    until(page, "studio.store && document.querySelectorAll('.tiles li.kept').length === 1")
    assert name in page.locator(".tiles li.kept .keep").get_attribute("aria-label")
    # Both beside each other, then the variation becomes the piece, one undo.
    page.get_by_test_id("beside").click()
    until(page, "document.querySelectorAll('.stage.two canvas').length === 2")
    titles = "[studio.viewer.title, studio.viewer.halves[1].dataset.title].join(' | ')"
    assert page.evaluate(titles) == "The piece | The variation"
    assert piece(served) == ["b1", "b2"]
    page.get_by_test_id("vary").click()
    until(page, "studio.store.state.piece.blocks.length > 2")
    varied = piece(served)
    assert len(varied) == page.locator(".tiles > li").count()
    until(page, f"{titles} === 'Before | The piece'")
    # Insertions come as they are found.
    until(page, "studio.store.state.piece.seams.some(seam => seam.state === 'inserted')")
    page.locator(".tiles .seam.inserted").first.wait_for()
    page.get_by_test_id("undo").click()
    until(page, "studio.store.state.piece.blocks.length === 2")
    assert piece(served) == ["b1", "b2"]


def test_a_piece_is_varied_by_keyboard(served: Served, open_page: Open) -> None:
    two_clips(served)
    page = open_page(1024, 768)
    to_panel(page, "vary")
    page.get_by_test_id("tile-3").wait_for()
    tab_to(page, "map")
    page.keyboard.press("PageUp")
    until(page, "document.querySelector('[data-testid=map]').getAttribute('aria-valuetext') !== 'default'")
    page.keyboard.press("Home")
    until(page, "document.querySelector('[data-testid=map]').getAttribute('aria-valuetext') === 'default'")
    tab_to(page, "depart")
    page.keyboard.press("Home")
    until(page, "document.querySelector('[data-testid=departs]').textContent === 'unchanged'")
    for _ in range(20):
        page.keyboard.press("ArrowRight")
    page.get_by_test_id("tile-4").wait_for()
    tab_to(page, "vary")
    page.keyboard.press("Enter")
    until(page, "studio.store.state.piece.blocks.length > 2")
    assert page.evaluate("studio.store.state.undo") == "vary the piece"
    page.keyboard.press("Control+z")
    until(page, "studio.store.state.piece.blocks.length === 2")


def test_the_dial_answers_while_it_is_turned(served: Served, open_page: Open) -> None:
    two_clips(served)
    page = open_page()
    page.get_by_test_id("open-vary").click()
    page.get_by_test_id("tile-3").wait_for()
    page.get_by_test_id("depart").fill("0")
    until(page, "document.querySelector('[data-testid=departs]').textContent === 'unchanged'")
    seen = {"unchanged"}
    for share in (5, 10, 15, 20, 25, 30, 35, 40, 10):
        with page.expect_response("**/api/vary"):
            page.get_by_test_id("depart").fill(str(share))
        until(page, "!document.querySelector('[data-testid=vary-error]')")
        seen.add(page.get_by_test_id("departs").inner_text())
    page.wait_for_timeout(300)
    seen.add(page.get_by_test_id("departs").inner_text())
    assert len(seen) > 2
    assert not page.get_by_test_id("departs").inner_text().endswith("at most")
    page.get_by_test_id("depart").fill("40")  # farther than any order of these departs
    until(page, "document.querySelector('[data-testid=departs]').textContent.endsWith(' at most')")


def test_a_stretch_selected_on_the_time_line_is_kept(served: Served, open_page: Open) -> None:
    two_clips(served)
    served.edit(edit="split", block="b1", at=20, id="b3")
    page = open_page()
    page.get_by_test_id("open-vary").click()
    page.get_by_test_id("tile-3").wait_for()
    page.evaluate("studio.store.set({ selection: { block: 'b3' } })")
    page.get_by_test_id("keep-selected").click()
    page.locator(".tiles li.kept").wait_for()
    page.get_by_test_id("keep-selected").wait_for(state="detached")
    page.get_by_test_id("vary").click()
    until(page, "studio.store.state.piece.blocks.length > 3")
    assert "b3" in piece(served)
    page.get_by_test_id("let-go").click()
    page.locator(".tiles li.kept").wait_for(state="detached")


def test_nothing_to_vary_says_what_to_do(open_page: Open) -> None:
    page = open_page()
    page.get_by_test_id("open-vary").click()
    page.get_by_text("The piece is too short").wait_for()
    page.get_by_role("button", name="Use your own").click()
    page.get_by_test_id("choose-files").wait_for(state="attached")


# --- one's own movement -----------------------------------------------------------------------------------------------


def test_own_movement_by_mouse(served: Served, open_page: Open, tmp_path: Path) -> None:
    (tmp_path / "bends.score").write_text(BENDS)
    (tmp_path / "broken.bvh").write_text("HIERARCHY\nROOT Hips\n{\n")
    (tmp_path / "dance.fbx").write_bytes(b"anything")
    page = open_page()
    page.get_by_test_id("open-movement").click()
    page.get_by_test_id("choose-files").set_input_files(
        [tmp_path / name for name in ("bends.score", "broken.bvh", "dance.fbx")]
    )
    page.get_by_test_id("understood").wait_for()
    until(page, "document.querySelectorAll('[data-testid=file-error]').length === 2")
    errors = sorted(page.get_by_test_id("file-error").all_inner_texts())
    assert errors[0].startswith("broken.bvh:")
    assert errors[1].startswith("dance.fbx: FBX is not read")
    assert "a person with 23 joints" in page.get_by_test_id("understood").inner_text()
    page.emulate_media(reduced_motion="no-preference")  # what is looked at plays then
    page.get_by_test_id("look").click()
    until(page, "studio.viewer.title.includes('bends.score') && studio.viewer.player.playing")
    page.get_by_test_id("scrub").fill("0.9")  # who takes hold of the time stops there
    assert not page.evaluate("studio.viewer.player.playing")
    assert float(page.get_by_test_id("scrub").input_value()) == pytest.approx(0.9)
    page.emulate_media(reduced_motion="reduce")
    page.get_by_test_id("put").click()
    until(page, "studio.store.state.piece.blocks.length === 1")
    # A corpus of it and of another, looked through, and deleted, which it asks about.
    page.get_by_test_id("corpus-name").fill("ballet")
    page.get_by_test_id("learn").click()
    assert "already" in page.get_by_test_id("learn-error").inner_text()
    page.get_by_test_id("corpus-name").fill("mine")
    page.get_by_text("Mix with other corpora").click()
    page.get_by_test_id("mix-ballet").select_option("0.3")
    page.get_by_test_id("learn").click()
    page.get_by_test_id("learned").wait_for()
    page.get_by_test_id("sheet-mine").click()
    page.get_by_test_id("sheet").locator("img").first.wait_for()
    until(page, "[...document.querySelectorAll('.sheet-clips img')].some(one => one.complete && one.naturalWidth)")
    page.get_by_test_id("close-sheet").click()
    page.wait_for_timeout(1000)  # pictures that were asked for still come, of what is about to be deleted
    assert page.get_by_test_id("delete-ballet").count() == 0
    page.get_by_test_id("delete-mine").click()
    page.get_by_test_id("delete-not").click()
    assert "mine" in [one["name"] for one in served.get("/api/corpora")]
    page.get_by_test_id("delete-mine").click()
    page.get_by_test_id("delete-sure").click()
    page.get_by_test_id("corpus-mine").wait_for(state="detached")
    assert "mine" not in [one["name"] for one in served.get("/api/corpora")]


def test_own_movement_by_keyboard(served: Served, open_page: Open, tmp_path: Path) -> None:
    (tmp_path / "bends.score").write_text(BENDS)
    page = open_page(1024, 768, "dark")
    page.once("filechooser", lambda chooser: chooser.set_files(tmp_path / "bends.score"))
    to_panel(page, "movement")
    tab_to(page, "choose")
    page.keyboard.press("Enter")
    page.get_by_test_id("understood").wait_for()
    tab_to(page, "put")
    page.keyboard.press("Enter")
    until(page, "studio.store.state.piece.blocks.length === 1")
    tab_to(page, "corpus-name")
    page.keyboard.type("mine")
    page.keyboard.press("Enter")
    page.get_by_test_id("learned").or_(page.get_by_test_id("learn-ended")).wait_for()
    assert page.get_by_test_id("learned").count() == 1
    tab_to(page, "sheet-mine")
    page.keyboard.press("Enter")
    page.get_by_test_id("sheet").wait_for()
    page.keyboard.press("Escape")
    page.get_by_test_id("sheet").wait_for(state="detached")
    tab_to(page, "delete-mine")
    page.keyboard.press("Enter")
    tab_to(page, "delete-sure")
    page.keyboard.press("Enter")
    page.get_by_test_id("corpus-mine").wait_for(state="detached")


def test_clips_of_a_gltf_file_are_listed_watched_and_put(served: Served, open_page: Open, tmp_path: Path) -> None:
    dance, clips = ballet_clip("adagio").resample(30.0), ["Hip Hop", "<i>Idle</i>", ""]
    moves = [dance.slice(0, 30 + 10 * number) for number in range(3)]
    with_clips(tmp_path / "hero.glb", list(zip(clips, moves, strict=True))).write()
    page = open_page()
    page.get_by_test_id("open-movement").click()
    page.get_by_test_id("choose-files").set_input_files(tmp_path / "hero.glb")
    page.get_by_test_id("understood").wait_for()
    assert page.get_by_test_id("understood").inner_text().startswith("3 clips")
    rows = page.get_by_test_id("file").locator(".clips li")
    assert rows.locator("span").all_inner_texts() == ["hero#Hip Hop", "hero#<i>Idle</i>", "hero#3"]
    page.get_by_text("From 3 clips above").wait_for()  # to learn from
    rows.nth(1).get_by_test_id("look").click()
    until(page, "studio.viewer.title.includes('hero#<i>Idle</i>')")
    rows.nth(2).get_by_test_id("put").click()
    until(page, "studio.store.state.piece.blocks.length === 1")
    (block,) = served.project()["piece"]["blocks"]
    assert block["last"] == len(moves[2]) - 1


def test_learning_is_cancelled(served: Served, open_page: Open, tmp_path: Path) -> None:
    (tmp_path / "bends.score").write_text(BENDS)
    page = open_page()
    page.get_by_test_id("open-movement").click()
    page.get_by_test_id("choose-files").set_input_files(tmp_path / "bends.score")
    page.get_by_test_id("understood").wait_for()
    page.get_by_test_id("corpus-name").fill("mine")
    page.get_by_text("Mix with other corpora").click()
    page.get_by_test_id("mix-ballet").select_option("1")
    page.get_by_test_id("learn").click()
    page.get_by_test_id("cancel-learning").click()
    page.get_by_test_id("learn-ended").wait_for()
    assert "mine" not in [one["name"] for one in served.get("/api/corpora")]


def test_a_recording_leaves_questions(served: Served, open_page: Open, shared_data: Path) -> None:
    page = open_page()
    page.get_by_test_id("open-movement").click()
    page.get_by_test_id("choose-files").set_input_files(
        [
            shared_data / "cmu-05" / "05_06.bvh",
            shared_data / "cmu-135" / "135_04.amc",
            shared_data / "cmu-135" / "135.asf",
        ]
    )
    until(page, "document.querySelectorAll('[data-testid=understood]').length === 2")
    card = page.get_by_test_id("file").filter(has_text="05_06.bvh")
    assert "right hip 10×" in card.inner_text()
    assert card.get_by_test_id("skip").is_checked()
    card.get_by_test_id("unit").select_option("m")
    card.get_by_text("no person has this height").wait_for()
    card.get_by_test_id("unit").select_option("")
    card.get_by_text("no person has this height").wait_for(state="detached")
    rate = card.get_by_test_id("fps")
    for wrong in ("0", "2000"):
        rate.fill(wrong)
        rate.press("Tab")
        assert rate.input_value() == "120"  # which is in use
    card.get_by_test_id("skip").click()
    card.get_by_text("Reading again").wait_for()
    card.get_by_text("Reading again").wait_for(state="detached")
    card.get_by_test_id("put").click()
    until(page, "studio.store.state.piece.blocks[0]?.frames === 886")
    page.get_by_test_id("open-vary").click()
    page.get_by_test_id("tile-2").wait_for()  # at five postures a second
