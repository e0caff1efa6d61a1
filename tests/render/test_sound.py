"""Sound in step with movement: in films, whose sound is decoded, and on the page, whose output is recorded."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click_tracks import at_tempo, clicks, onsets, played, recording
from pages import Opened

from motionmind import draw_picture
from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.music import Sound
from motionmind.render import page as pages

FRAME_S = 1.0 / 30.0


def hopping(clicks_at: Floats, seconds: float, rate: float = 30.0) -> Motion:
    """A body that stands 0.3 m to the right or to the left, and changes sides at each click."""
    times = np.arange(round(seconds * rate) + 1) / rate
    side = 0.3 * (-1.0) ** np.searchsorted(clicks_at, times + 1e-9)
    root = np.stack([side, np.full(len(times), 0.97), np.zeros(len(times))], axis=-1)
    return Motion(human23(), np.tile(rot.IDENTITY, (len(times), 23, 1)), root, times, "hop")


def decoded(path: Path, folder: Path) -> tuple[Floats, Sound]:
    """Return how much each frame of a film differs from the one before, and its sound."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    track = folder / "track.wav"
    subprocess.run([ffmpeg, "-y", "-loglevel", "error", "-i", path, track], check=True)
    raw = [ffmpeg, "-loglevel", "error", "-i", path, "-vf", "scale=64:64", "-pix_fmt", "gray", "-f", "rawvideo", "-"]
    frames = np.frombuffer(subprocess.run(raw, capture_output=True, check=True).stdout, np.uint8).reshape(-1, 64, 64)
    from motionmind.music import read_sound

    differences = np.abs(np.diff(frames.astype(float), axis=0, prepend=frames[:1])).mean(axis=(1, 2))
    return differences, read_sound(track)


@pytest.mark.long
@pytest.mark.parametrize(("bpm", "fps"), [(93.7, None), (131.0, 24.0)])
def test_a_films_clicks_sound_with_their_frames(bpm: float, fps: float | None, tmp_path: Path) -> None:
    at = at_tempo(bpm, 0.41, 9.5)
    draw_picture(tmp_path / "a.mp4", hopping(at, 9.7), fps=fps, size=120, sound=clicks(at, 30.0))
    differences, sound = decoded(tmp_path / "a.mp4", tmp_path)
    rate = fps or 30.0
    changed = np.flatnonzero(differences > 0.25 * differences.max())
    changes = changed[np.diff(changed, prepend=-9) > 1] / rate  # a hop may fall between two frames, and take both
    heard = onsets(sound)
    assert len(changes) == len(heard) == len(at)
    assert np.abs(heard - changes).max() <= 1.0 / rate
    assert np.abs(heard - at).max() < 0.005
    assert sound.seconds == pytest.approx(len(differences) / rate, abs=0.03)  # so that it loops in step


@pytest.mark.long
@pytest.mark.parametrize("speed", [1.0, 0.5])
def test_a_pages_clicks_sound_at_their_moments_from_loop_to_loop(show: Callable[..., Opened], speed: float) -> None:
    at = np.array([0.3, 0.7, 1.37, 1.9])
    tab = show(hopping(at, 2.3), sound=clicks(at, 3.0), viewport={"width": 320, "height": 240})
    tab.click("sound")
    tab.wait("motionmind.sound.audible")
    tab.get(recording("motionmind"))
    tab.page.select_option("#speed", f"{speed:g}")
    tab.press("Space")
    tab.wait(f"window.found && found.onsets.length >= {12 if speed == 1.0 else 6}")
    tab.press("Space")
    heads = played(tab.get("found"), tab.get("motionmind.sound.context.outputLatency || 0"))
    heads = heads[np.isfinite(heads)]
    off = np.abs(heads[:, None] - at).min(axis=1)
    assert len(heads) >= (11 if speed == 1.0 else 5)
    # A picture that a busy machine draws late is put right by the next: it says nothing of the clocks.
    assert np.quantile(off, 0.8) < FRAME_S
    assert off.max() < 3.0 * FRAME_S
    assert len(set(np.abs(heads[:, None] - at).argmin(axis=1))) == 4


@pytest.mark.long
def test_sound_waits_for_a_key_and_is_turned_off_and_on(show: Callable[..., Opened]) -> None:
    at = np.array([0.3, 0.7])
    tab = show(hopping(at, 2.0), sound=clicks(at, 3.0))
    button = "document.getElementById('sound')"
    assert tab.get(f"{button}.checkVisibility()")
    assert tab.get(f"{button}.ariaPressed") == "false"
    tab.press("Space")  # plays, and wakes the sound
    tab.wait("motionmind.sound.audible && motionmind.sound.heard !== undefined")
    assert tab.get(f"{button}.ariaPressed") == "true"
    tab.press("s")
    assert tab.get("motionmind.sound.audible") is False
    assert tab.get("motionmind.sound.heard ?? null") is None
    tab.click("sound")
    tab.wait("motionmind.sound.heard !== undefined")
    tab.press("Space")
    assert tab.get("motionmind.sound.heard ?? null") is None


def test_a_page_without_sound_has_no_button_for_it(show: Callable[..., Opened]) -> None:
    tab = show(hopping(np.array([0.3]), 1.0))
    assert not tab.get("document.getElementById('sound').checkVisibility()")
    assert tab.get("motionmind.sound ?? null") is None


def test_too_much_sound_for_a_page_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "MAX_PAGE_SOUND_BYTES", 1000)
    with pytest.raises(MotionMindError, match="are too much for a page") as raised:
        draw_picture(tmp_path / "a.html", hopping(np.array([0.3]), 1.0), sound=clicks(np.array([0.3]), 1.0))
    assert "\n" not in str(raised.value)
    assert [*tmp_path.iterdir()] == []


def test_pictures_without_sound_refuse_it(tmp_path: Path) -> None:
    with pytest.raises(MotionMindError, match=r"sound is for \.mp4 and \.html"):
        draw_picture(tmp_path / "a.gif", hopping(np.array([0.3]), 1.0), sound=clicks(np.array([0.3]), 1.0))
