"""Films of a piece: what is in the file, and that nothing of a stopped one stays."""

from __future__ import annotations

import subprocess
import time
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from piece_page import LONG, until
from studio_server import Served

from motionmind.render import film
from motionmind.render.stage import Stage
from motionmind.render.timing import frame_times
from motionmind.render.view import view_from
from motionmind.studio import room
from motionmind.studio.export import composed
from motionmind.studio.filming import FILM_HEIGHT_PX, FILM_RATE_FPS

AHEAD = {"azimuth": -30.0, "elevation": 10.0}


@pytest.fixture
def rooms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which the studio's temporary folders are."""
    monkeypatch.setattr(room.tempfile, "tempdir", str(tmp_path))
    return tmp_path


def wait_for(server: Served, job: str, *states: str) -> dict[str, object]:
    end = time.monotonic() + 120.0
    while (found := server.get(f"/api/jobs/{job}"))["state"] not in states:
        assert time.monotonic() < end, found
        time.sleep(0.05)
    return dict(found)


@pytest.mark.long
def test_a_film_shows_the_whole_piece_from_where_it_was_asked(studio_server: Served, tmp_path: Path) -> None:
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    studio_server.insert("b1", "ballet/adagio", 0, 6)
    studio_server.edit(edit="title", title="Evening: 1/2")
    job = studio_server.post("/api/films", AHEAD)["job"]
    assert wait_for(studio_server, job, "done", "failed")["state"] == "done"
    answer = studio_server.send("GET", f"/api/films/{job}")
    assert answer.headers["content-disposition"].endswith("Evening-%201-2.mp4")
    (tmp_path / "film.mp4").write_bytes(answer.body)
    motion = composed(studio_server.studio)
    stage = Stage(motion, frame_times(motion, FILM_RATE_FPS), view=view_from("", -30.0, 10.0), size=FILM_HEIGHT_PX)
    arguments = ["-i", tmp_path / "film.mp4", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    run = subprocess.run([ffmpeg.get_ffmpeg_exe(), *arguments], capture_output=True, check=True)
    size = stage.camera.height, stage.camera.width, 3
    frames = np.frombuffer(run.stdout, np.uint8).reshape(-1, *size)
    assert len(frames) == len(stage)
    for number in (0, len(stage) // 2, len(stage) - 1):
        seen = stage.picture(number).astype(int)
        assert np.abs(frames[number] - seen).mean() < 2.0
        assert np.abs(frames[number - len(stage) // 2].astype(int) - seen).mean() > 2.0  # other frames differ


@pytest.mark.long
def test_nothing_of_a_cancelled_film_stays(rooms: Path, studio_server: Served) -> None:
    pytest.importorskip("imageio_ffmpeg")
    for number in range(4):
        studio_server.insert(f"b{number}", "ballet/adagio", 0, 60)
    before = {path for path in rooms.rglob("*") if path.is_file()}
    job = studio_server.post("/api/films", AHEAD)["job"]
    end = time.monotonic() + 120.0
    while not studio_server.get(f"/api/jobs/{job}")["done"]:
        assert time.monotonic() < end
        time.sleep(0.02)
    assert {path.name for path in rooms.rglob("*") if path.is_file()} >= {"film.mp4"}
    studio_server.send("DELETE", f"/api/jobs/{job}")
    assert studio_server.send("GET", f"/api/films/{job}").status == 404
    end = time.monotonic() + 10.0
    while {path for path in rooms.rglob("*") if path.is_file()} - before:
        assert time.monotonic() < end
        time.sleep(0.02)


def test_films_are_refused_in_words(studio_server: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(status: int, body: object = AHEAD) -> str:
        answer = studio_server.send("POST", "/api/films", body)
        assert answer.status == status
        return str(answer.value["error"])

    assert refused(400) == "the piece is empty: nothing to export"
    studio_server.insert("b1", "ballet/adagio", 3, 3)
    assert refused(400) == "the piece is a single posture: nothing to film"
    for elevation in (-1.0, 91.0, "up", None):
        assert "elevation" in refused(400, AHEAD | {"elevation": elevation})
    monkeypatch.setattr(film, "encoder_program", lambda: None)
    assert studio_server.post("/api/films", AHEAD) == {"job": None}
    assert studio_server.send("GET", "/api/films/j1").status == 404


@pytest.mark.parametrize("elevation", [4.0, 17.0, 89.0, 90.0])
@pytest.mark.parametrize("azimuth", [-180.0, -90.0, 0.0, 40.0, 360.0])
def test_a_film_from_any_direction_shows_all_of_the_body(azimuth: float, elevation: float) -> None:
    motion = ballet_clip("adagio").slice(10, 11)
    stage = Stage(motion, view=view_from("", azimuth, elevation), size=240)
    axes = stage.camera.view.axes
    assert np.allclose(axes @ axes.T, np.eye(3))
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[2, 1] == pytest.approx(np.sin(radians(elevation)))
    box = stage.drawing(0).box
    height, width = stage.picture(0).shape[:2]
    assert 0 <= box[0].start < box[0].stop <= height
    assert 0 <= box[1].start < box[1].stop <= width


# --- on the page ------------------------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("dancers", [0, 2])
def test_without_an_encoder_the_browser_films(
    studio_server: Served, studio_page: Any, monkeypatch: pytest.MonkeyPatch, dancers: int
) -> None:
    page = studio_page
    monkeypatch.setattr(film, "encoder_program", lambda: None)
    studio_server.insert("b1", "ballet/adagio", 0, 1)
    for number in range(dancers):
        dancer = {"id": f"d{number}", "name": str(number), "place": [number, 0], "mirrored": number == 1}
        studio_server.edit(edit="dancer", dancer=dancer)
    until(
        page, "(count) => studio.viewer.piece?.end > 0 && (studio.viewer.piece.dancers ?? []).length === count", dancers
    )
    page.get_by_test_id("open-take").click()
    with page.expect_download(timeout=LONG) as download:
        page.get_by_test_id("export-film").press("Enter")
    assert download.value.suggested_filename == "piece.webm"
