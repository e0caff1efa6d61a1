"""Films that the page makes: what is in the file, and what the page says where it can make none."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from pages import FINE, SCREENS, Opened, near, readable_words
from PIL import Image

from motionmind._typing import Floats, Int16s, Pixels
from motionmind.body.motion import Insertion, Motion
from motionmind.render.palette import COLOURS, INSERTED
from motionmind.render.timing import frame_times

pytestmark = pytest.mark.long


def briefly(name: str = "briefly", seconds: float = 0.777) -> Motion:
    """The start of the adagio; the middle third of it inserted."""
    clip = ballet_clip("adagio").resample(25.0)
    motion = clip.slice(0, int(25.0 * seconds) + 2)
    times = (motion.times - motion.times[0]) * seconds / (motion.times[-1] - motion.times[0])
    return replace(motion, name=name, times=times, insertions=(Insertion(np.array([1.0, 2.0]) * seconds / 3.0),))


def film(tab: Opened, path: Path) -> str:
    """Film a page into a file; returns the name that the page gave it."""
    with tab.page.expect_download(timeout=120_000) as download:
        tab.click("film")
    download.value.save_as(path)
    tab.wait("document.getElementById('film').textContent === 'Film'")
    return str(download.value.suggested_filename)


def decoded(path: Path, shape: tuple[int, int]) -> tuple[Floats, Pixels]:
    """The times of a film's frames [T], seconds, and their pictures [T, H, W, 3]."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    arguments = ["-i", path, "-vf", "showinfo", "-fps_mode", "passthrough", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    run = subprocess.run([ffmpeg, *arguments], capture_output=True, check=True)
    log = run.stderr.decode()
    assert "rror" not in log
    times = [float(time) for time in re.findall(r"pts_time:([\d.]+)", log)]
    height, width = shape
    return np.array(times), np.frombuffer(run.stdout, np.uint8).reshape(-1, height, width, 3)


def seen_by_a_browser(browser: Any, path: Path) -> dict[str, Any]:
    """How long a browser says that a film is, how large, and whether it can be searched to its middle."""
    host = path.with_suffix(".html")
    host.write_text(f'<video src="{path.name}" muted preload="auto"></video>', "utf-8")
    tab = browser.new_context().new_page()
    tab.goto(host.as_uri())
    found = tab.evaluate(
        "new Promise((done, failed) => { const film = document.querySelector('video'); film.onerror = failed;"
        "film.onseeked = () => done({ length: film.duration, width: film.videoWidth, height: film.videoHeight,"
        "at: film.currentTime }); const go = () => (film.currentTime = film.duration / 2);"
        "film.readyState ? go() : (film.onloadedmetadata = go) })"
    )
    tab.context.close()
    return dict(found)


# --- the file ---------------------------------------------------------------------------------------------------------


def test_a_film_lasts_as_long_as_the_movement_and_has_all_of_it(
    show: Callable[..., Opened], browser: Any, tmp_path: Path
) -> None:
    seconds = 0.377  # each frame is drawn for a third of a second
    motion = briefly("the adagio", seconds)
    tab = show(motion, **FINE)
    tab.click("front")
    name = film(tab, tmp_path / "film.webm")
    assert name == "the adagio.webm"
    assert tab.time == 0.0

    found = seen_by_a_browser(browser, tmp_path / "film.webm")
    assert found["length"] == pytest.approx(seconds, abs=1e-6)
    assert found["at"] == pytest.approx(seconds / 2, abs=1e-3)
    assert found["width"] == 1280
    times, frames = decoded(tmp_path / "film.webm", (found["height"], found["width"]))
    np.testing.assert_allclose(times, frame_times(motion, 30.0), atol=0.0006)  # whole milliseconds

    for i in (0, len(times) // 2, len(times) - 1):  # as the page shows it
        tab.get(f"motionmind.player.seek({times[i]})")
        seen = pixels(tab, frames[i].shape[1], frames[i].shape[0])
        assert np.abs(frames[i].astype(int) - seen).mean() < 5.0
        others = [np.abs(frames[j].astype(int) - seen).mean() for j in (0, len(times) // 2, len(times) - 1)]
        assert int(np.argmin(others)) == (0, len(times) // 2, len(times) - 1).index(i)
    violet = [near(frame.astype(np.int16), INSERTED["middle"]).sum() > 500 for frame in frames]
    inside = (times > seconds / 3 + 0.001) & (times < 2 * seconds / 3 - 0.001)
    assert violet == inside.tolist()
    assert near(frames[0].astype(np.int16), COLOURS["left"]).sum() > 500


def pixels(tab: Opened, width: int, height: int) -> Int16s:
    """The picture on the page now, in another size."""
    picture = Image.fromarray(tab.picture().astype(np.uint8)).resize((width, height), Image.Resampling.BICUBIC)
    return np.array(picture).astype(np.int16)


def test_a_film_has_the_shape_of_the_picture_whatever_becomes_of_the_page(
    show: Callable[..., Opened], browser: Any, tmp_path: Path
) -> None:
    motion = replace(briefly(), insertions=())
    count = len(motion)
    still = replace(motion, rotations=motion.rotations[[0] * count], root=motion.root[[0] * count])
    tab = show(still, **SCREENS["upright"], is_drawn=True)
    box = tab.page.locator("#canvas").bounding_box()
    hold_at_the_second_frame(tab)
    with tab.page.expect_download(timeout=120_000) as download:
        tab.page.tap("#film")
        tab.wait("motionmind.player.time > 0")
        tab.page.set_viewport_size(SCREENS["lying"]["viewport"])
        tab.picture()
        assert tab.page.inner_text("#film") == "Stop"
        tab.get("delete performance.now")
    download.value.save_as(tmp_path / "film.webm")
    found = seen_by_a_browser(browser, tmp_path / "film.webm")
    assert found["width"] / found["height"] == pytest.approx(box["width"] / box["height"], abs=0.01)
    _, frames = decoded(tmp_path / "film.webm", (found["height"], found["width"]))
    assert np.abs(frames[-1].astype(int) - frames[0]).mean() < 3.0
    tab.wait("document.getElementById('film').textContent === 'Film'")
    assert tab.page.locator("#canvas").bounding_box()["width"] == 844  # and the page is drawn as it is now
    assert tab.get("motionmind.stage.camera.aspect") > 2


def hold_at_the_second_frame(tab: Opened) -> None:
    """Stop a page's clock when a film draws its second frame: the film goes on when `performance.now` is deleted."""
    tab.get(
        "(() => { const { stage } = motionmind, shoot = stage.shoot; let count = 0;"
        "stage.shoot = function (...given) { shoot.apply(this, given);"
        "const now = performance.now(); if (++count === 2) performance.now = () => now; } })()"
    )


def test_frames_that_a_recorder_left_out_move_none_of_the_others(show: Callable[..., Opened], tmp_path: Path) -> None:
    tab = show(briefly(seconds=0.2))
    film(tab, tmp_path / "film.webm")
    times, _ = decoded(tmp_path / "film.webm", shape_of(tab))
    # As if between every two frames another one had been drawn, 3 ms after the first of them, and not recorded.
    drawn = np.repeat(1000.0 * times, 2) + np.tile([0.0, 3.0], len(times))
    wanted = 2.0 * np.arange(len(drawn)) / 30.0
    data = list((tmp_path / "film.webm").read_bytes())
    length = float(wanted[-1] + 1.0)
    script = f"import('motionmind/webm').then(m => [...m.retimed(new Uint8Array({data}), {drawn.tolist()}, "
    again = tab.get(script + f"{wanted.tolist()}, {length})])")
    (tmp_path / "again.webm").write_bytes(bytes(again))
    found, _ = decoded(tmp_path / "again.webm", shape_of(tab))
    np.testing.assert_allclose(found, wanted[::2], atol=0.0006)


def shape_of(tab: Opened) -> tuple[int, int]:
    """The height and width of the films of a page."""
    box = tab.page.locator("#canvas").bounding_box()
    return 2 * round(1280 * box["height"] / box["width"] / 2), 1280


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ('a/b\\c: "d"?', "a-b-c- -d-.webm"),
        ("...", "movement.webm"),
        ("舞 é", "舞 é.webm"),
        ("n" * 60, "n" * 60 + ".webm"),
    ],
)
def test_films_have_names_that_every_system_takes(
    show: Callable[..., Opened], tmp_path: Path, name: str, file: str
) -> None:
    tab = show(briefly(name, 0.1), viewport={"width": 360, "height": 480})
    assert film(tab, tmp_path / "film.webm") == file
    assert tab.page.inner_text("#filming a") == f"Save {file}"
    assert tab.get("[document.getElementById('filming')].every(one => one.scrollWidth <= one.clientWidth)")


# --- what the page says -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("screen", SCREENS)
def test_words_about_films_cover_no_others(show: Callable[..., Opened], screen: str) -> None:
    tab = show(briefly("n" * 60, 0.1), **SCREENS[screen], script="delete window.MediaRecorder")
    tab.get("document.getElementById('legend').open = true")
    tab.click("film")
    boxes = [tab.page.locator(one).bounding_box() for one in ("#legend", "#filming", "#canvas")]
    (left, top, right, bottom) = np.transpose(
        [[b["x"], b["y"], b["x"] + b["width"], b["y"] + b["height"]] for b in boxes]
    )
    assert right[0] <= left[1] or right[1] <= left[0] or bottom[0] <= top[1] or bottom[1] <= top[0]
    assert left.min() == left[2]
    assert right.max() == right[2]
    readable_words(tab.page)


@pytest.mark.parametrize(
    "script",
    [
        "delete window.MediaRecorder",
        "MediaRecorder.isTypeSupported = type => !type.includes('webm')",
        "delete HTMLCanvasElement.prototype.captureStream",
    ],
)
def test_a_browser_that_records_no_webm_says_so(show: Callable[..., Opened], script: str) -> None:
    tab = show(briefly(), script=script)
    tab.click("film")
    assert "records no WebM" in tab.page.inner_text("#filming")
    assert "motionmind render" in tab.page.inner_text("#filming")
    assert not tab.page.is_visible("#filming a")
    assert "status" not in readable_words(tab.page)
    tab.page.click("#filming button")
    assert not tab.page.is_visible("#filming")
    tab.press("Space")
    tab.wait("motionmind.player.time > 0")


def test_what_goes_wrong_in_a_recorder_is_said(show: Callable[..., Opened]) -> None:
    tab = show(briefly(), script="MediaRecorder.prototype.start = () => { throw new Error('no encoder') }")
    tab.click("film")
    tab.wait("document.getElementById('filming').innerText.includes('No film was made: no encoder')")
    assert tab.page.inner_text("#film") == "Film"
    tab = show(briefly(), script="HTMLCanvasElement.prototype.captureStream = () => new MediaStream()")
    tab.click("film")
    tab.wait("document.getElementById('filming').innerText.includes('No film was made: ')")


def test_a_film_can_be_stopped(show: Callable[..., Opened]) -> None:
    tab = show(briefly(seconds=5.0), is_drawn=True)
    tab.get("motionmind.player.seek(0.4)")
    tab.click("film")
    tab.wait("motionmind.player.time !== 0.4 && document.querySelector('#filming progress').value > 0.01")
    assert tab.page.inner_text("#film") == "Stop"
    tab.click("film")
    tab.wait("document.getElementById('film').textContent === 'Film'")
    assert tab.page.inner_text("#filming p") == "Stopped; nothing was saved."
    assert not tab.page.is_visible("#filming a")
    assert tab.time == pytest.approx(0.4)
    before = tab.picture()
    tab.press("1")
    assert not np.array_equal(tab.picture(), before)


def test_one_posture_is_not_filmed(show: Callable[..., Opened]) -> None:
    assert not show(briefly().slice(0, 1)).page.is_visible("#film")
