"""Cells of a notebook: what plays in them, in a browser, and what it cannot do."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from pages import Tabs

from motionmind import Engine, Motion, Piece, vary
from motionmind.notebook.cell import MAX_ROTATIONS, html_of
from motionmind.render.page import page

ADAGIO = ballet_clip("adagio")
KINDS: dict[str, Callable[[], Any]] = {
    "motion": lambda: ADAGIO,
    "posture": lambda: ADAGIO.posture(3),
    "tween": lambda: Engine.load("ballet").tween(ADAGIO.posture(20), ADAGIO.posture(40)),
    "piece": lambda: Piece.of(ADAGIO),
    "variation": lambda: vary(ADAGIO, nudge=1.0),
}


def motion_of(thing: Any) -> Motion:
    """The movement that a cell should play."""
    if isinstance(thing, Motion):
        return thing
    if hasattr(thing, "as_motion"):
        return thing.as_motion()
    return thing.motion() if callable(thing.motion) else thing.motion


@pytest.fixture
def opened(tabs: Tabs, tmp_path: Path) -> Iterator[Callable[..., Any]]:
    """Open cells in one page, as a notebook shows them, and wait until each is there; what was asked for is `asked`.

    They play by themselves only where that is asked for, and are drawn with few pixels: drawing in software is most of
    a test's time.
    """
    asked: list[str] = []

    def call(*cells: str, plays: bool = False) -> Any:
        tab.emulate_media(reduced_motion="no-preference" if plays else "reduce")
        (tmp_path / "notebook.html").write_text("<!doctype html><meta charset=utf-8>" + "".join(cells), "utf-8")
        tab.goto((tmp_path / "notebook.html").as_uri())
        for frame in tab.query_selector_all("iframe"):
            frame.scroll_into_view_if_needed()
            inner = frame.content_frame()
            for _ in range(500):
                if inner.evaluate("!!window.motionmind"):
                    break
                tab.wait_for_timeout(20)
            assert inner.evaluate("!!window.motionmind"), "the page in the cell does not start"
        tab.asked = asked
        return tab

    hearing = {"request": lambda request: asked.append(request.url)}
    with tabs.tab(hearing, viewport={"width": 800, "height": 600}, device_scale_factor=0.5) as tab:
        yield call


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_a_cell_plays_the_movement_and_asks_nothing_of_the_network(kind: str, opened: Callable[..., Any]) -> None:
    thing = KINDS[kind]()
    tab = opened(thing._repr_html_(), plays=True)
    (frame,) = tab.frames[1:]
    shown = frame.evaluate("({ frames: motionmind.motion.length, joints: motionmind.motion.joints })")
    motion = motion_of(thing)
    assert shown == {"frames": len(motion), "joints": list(motion.skeleton.names)}
    if len(motion) > 1:
        before = frame.evaluate("motionmind.player.time")
        tab.wait_for_timeout(400)
        assert frame.evaluate("motionmind.player.time") != before
    assert [url for url in tab.asked if not url.startswith(("data:", "file:", "about:"))] == []


def test_the_frame_knows_nothing_of_the_notebook(opened: Callable[..., Any]) -> None:
    tab = opened(html_of(ADAGIO))
    frame = tab.frames[1]
    assert frame.evaluate("origin") == "null"
    for reached in ("parent.document.title", "localStorage.length", "document.cookie"):
        assert frame.evaluate(f"(() => {{ try {{ {reached}; return 'open' }} catch {{ return 'shut' }} }})()") == "shut"
    assert frame.evaluate("fetch('https://example.org').then(() => 'open', () => 'shut')") == "shut"


@pytest.mark.long
def test_a_film_is_saved_from_the_frame(opened: Callable[..., Any]) -> None:
    tab = opened(html_of(ADAGIO.resample(25.0).slice(0, 6)))
    with tab.expect_download(timeout=60_000) as download:
        tab.frames[1].click("#film")
    assert download.value.suggested_filename.endswith(".webm")
    assert download.value.failure() is None


@pytest.mark.long
def test_cells_stand_beside_each_other(opened: Callable[..., Any]) -> None:
    tab = opened(*(html_of(ADAGIO.slice(0, frames)) for frames in (3, 5, 8)))
    assert [frame.evaluate("motionmind.motion.length") for frame in tab.frames[1:]] == [3, 5, 8]


@pytest.mark.long
def test_names_are_words_and_never_markup(opened: Callable[..., Any]) -> None:
    name = "</title></script>\"'><script>window.taken = 1</script><b>&amp;"
    tab = opened(html_of(replace(ADAGIO, name=name)), vary(replace(ADAGIO, name=name))._repr_html_())
    for frame in tab.frames:
        assert frame.evaluate("window.taken") is None
        assert frame.query_selector("b") is None
    assert tab.frames[1].evaluate("document.querySelector('h1').textContent")[:20] == name[:20]


@pytest.mark.long
def test_a_tween_s_words_stand_above_it() -> None:
    html = KINDS["tween"]()._repr_html_()
    assert re.search(r"^<p>\d moves, \d\.\d s\. [^<]+</p>.*<iframe ", html, re.S)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_a_cell_is_the_same_each_time_and_a_fraction_of_the_page(kind: str) -> None:
    thing = KINDS[kind]()
    html = html_of(thing)
    assert html == html_of(thing)
    assert len(html) < 0.45 * len(page(motion_of(thing)))


def test_movement_that_is_too_long_is_said_to_be() -> None:
    frames = MAX_ROTATIONS // 23 + 1
    rest = np.tile([0.0, 0.0, 0.0, 1.0], (frames, 23, 1))
    motion = Motion(ADAGIO.skeleton, rest, np.zeros((frames, 3)), np.arange(frames) / 30.0, "<long>")
    html = html_of(motion)
    assert len(html) < 500
    assert "<long>" in unescape(html)
    assert "too long to play in a notebook" in html
    assert "<iframe" not in html
    assert "<iframe" in html_of(motion.slice(0, frames - 1))


@pytest.mark.long
def test_movement_imports_nothing_that_draws() -> None:
    code = (
        "import sys; from motionmind import Motion, Tween, Variation\n"
        "print([name for name in sys.modules if name.startswith(('motionmind.render', 'motionmind.notebook'))])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
