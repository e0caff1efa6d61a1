"""Taking a piece away: each file holds the piece, under a name that every system takes."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from studio_server import Answer, Served

from motionmind import read_motion
from motionmind.studio.export import composed, credits_of, file_name
from motionmind.studio.project import Project


@pytest.fixture
def with_piece(studio_server: Served) -> Served:
    studio_server.insert("b1", "ballet/adagio", 0, 20)
    studio_server.insert("b2", "ballet/adagio", 21, 40)
    studio_server.edit(edit="title", title="Evening: 1/2")
    return studio_server


def taken(server: Served, form: str) -> Answer:
    answer = server.send("GET", f"/api/export/{form}")
    assert answer.status == 200, answer
    return answer


@pytest.mark.parametrize("form", ["bvh", "glb", "json"])
def test_a_file_holds_the_whole_piece(with_piece: Served, form: str, tmp_path: Path) -> None:
    answer = taken(with_piece, form)
    assert unquote(answer.headers["content-disposition"]).endswith(f"''Evening- 1-2.{form}")
    path = tmp_path / f"taken.{form}"
    path.write_bytes(answer.body)
    motion, whole = read_motion(path), composed(with_piece.studio)
    assert motion.times[-1] - motion.times[0] == pytest.approx(whole.times[-1] - whole.times[0], abs=0.02)
    ends = motion.positions()[[0, -1]] - motion.root[[0, -1]][:, None]
    expected = whole.positions()[[0, -1]] - whole.root[[0, -1]][:, None]
    names = [motion.skeleton.names.index(name) for name in whole.skeleton.names]
    assert np.allclose(ends[:, names], expected, atol=1e-3)


def test_the_page_asks_nobody_for_anything(with_piece: Served) -> None:
    page = taken(with_piece, "html").body.decode()
    assert "default-src 'none'" in page
    assert "Evening: 1/2" in page
    assert "/api/" not in page


def test_the_project_opens_again(with_piece: Served, tmp_path: Path) -> None:
    path = tmp_path / "again.motionmind"
    path.write_bytes(taken(with_piece, "project").body)
    project = Project.open(path)
    assert project.state == with_piece.studio.project.state
    project.close()


def credited(server: Served) -> dict[str, list[str]]:
    answer = server.send("GET", "/api/credits")
    assert answer.status == 200, answer
    return {one["heading"]: one["lines"] for one in answer.value["sections"]}


def test_the_page_and_the_panel_credit_the_clips_of_the_piece(with_piece: Served) -> None:
    assert credited(with_piece)["clips"] == ["100%  ballet: adagio, The MotionMind authors"]
    assert "ballet: adagio, The MotionMind authors" in taken(with_piece, "html").body.decode()


def test_insertions_are_credited_as_they_were_found(studio_server: Served) -> None:
    ends = {"a": {"key": "ballet/arabesque", "frame": 0}, "b": {"key": "ballet/fifth", "frame": 0}}
    job = studio_server.post("/api/between", {**ends, "options": {}})["job"]
    assert studio_server.wait_for(job)["state"] == "done"
    studio_server.post("/api/between/accept", {"job": job, "alternative": 1, "window": "w1"})
    found = credits_of(studio_server.studio)
    assert len(found) > 1
    assert sum(one.share for one in found) == pytest.approx(1.0)
    assert {one.corpus for one in found} <= {"ballet", ""}
    assert any(one.clip == "plies" for one in found)
    (insertion,) = composed(studio_server.studio).insertions
    shares = {one.clip: one.share for one in found}
    assert shares == pytest.approx({one.clip: one.share for one in insertion.credits})


def test_frames_that_are_not_even_are_a_file_all_the_same(studio_server: Served, tmp_path: Path) -> None:
    """An insertion, a clip, and a seam at which one posture is held until the other comes."""
    ends = {"a": {"key": "ballet/arabesque", "frame": 0}, "b": {"key": "ballet/fifth", "frame": 0}}
    job = studio_server.post("/api/between", {**ends, "options": {}})["job"]
    assert studio_server.wait_for(job)["state"] == "done"
    studio_server.post("/api/between/accept", {"job": job, "alternative": 1, "window": "w1"})
    studio_server.insert("b3", "ballet/adagio", 3, 20)
    whole = composed(studio_server.studio)
    assert not whole.is_even
    path = tmp_path / "taken.bvh"
    path.write_bytes(taken(studio_server, "bvh").body)
    motion = read_motion(path)
    assert motion.fps == pytest.approx(30.0)
    assert motion.times[-1] == pytest.approx(whole.times[-1], abs=1 / 30)
    text = path.read_text()
    assert (
        0.1 < max(float(word) for line in text.splitlines() if "OFFSET" in line for word in line.split()[1:]) < 1.0
    )  # metres


def test_nothing_is_taken_away_of_an_empty_piece(studio_server: Served) -> None:
    answer = studio_server.send("GET", "/api/export/bvh")
    assert (answer.status, answer.value["error"]) == (400, "the piece is empty: nothing to export")


def test_an_unknown_format_is_refused(with_piece: Served) -> None:
    answer = with_piece.send("GET", "/api/export/fbx")
    assert answer.status == 400
    assert "'fbx'" in answer.value["error"]


@pytest.mark.parametrize(
    ("title", "name"),
    [
        ("", "piece.bvh"),
        ("...", "piece.bvh"),
        ("a/b\\c", "a-b-c.bvh"),
        ('"Swan" <1>', "-Swan- -1-.bvh"),
        ("schön", "schön.bvh"),
        ("x" * 300, "x" * 100 + ".bvh"),
    ],
)
def test_names_are_those_that_every_system_takes(title: str, name: str) -> None:
    assert file_name(title, "bvh") == name
