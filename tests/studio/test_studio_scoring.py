"""The piece as a score over HTTP: written, composed after a change, and credited."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from scores import BENDS
from studio_server import Served, serving

from motionmind.studio import uploads
from motionmind.studio.project import Project
from motionmind.studio.reading import Answer
from motionmind.studio.scoring import write_score


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    """A studio with a piece of two clips."""
    with serving(Project.create(tmp_path / "piece.motionmind", "ballet", tmp_path), tmp_path) as found:
        found.insert("b1", "ballet/adagio", 0, 20)
        found.insert("b2", "ballet/petit-allegro", 0, 12, mirrored=True)
        assert found.send("DELETE", "/api/seams").status == 200  # no insertion changes the piece meanwhile
        yield found


def written(served: Served, **wish: Any) -> tuple[str, Any]:
    """Write a score; return the job's id and what it wrote."""
    job = served.post("/api/score", wish)["job"]
    done = served.wait_for(job)
    assert done["state"] == "done", done
    return job, done["result"]


def test_the_piece_is_written_and_every_posture_has_its_line(served: Served) -> None:
    _, found = written(served, tolerance=12)
    lines = found["text"].splitlines()
    assert all("|" in lines[line - 1] for line in found["lines"])
    clip = next(number for number, line in enumerate(lines, start=1) if line.startswith("clip"))
    assert all(own == call or own < clip < call for own, call in zip(found["lines"], found["calls"], strict=True))
    assert found["calls"] == sorted(found["calls"])
    seconds = served.project()["piece"]["seconds"]
    assert found["times"][0] == 0.0
    assert found["times"][-1] == pytest.approx(seconds, abs=0.05)
    assert f"tempo   {served.project()['tempo']:g}" in found["text"]
    assert {"fifth-leading", "demi-second"} <= set(found["text"].split())  # positions of the corpus, by their names


@pytest.mark.parametrize("corpus", ["gone", "hands", "medley"])
def test_a_corpus_without_positions_of_its_own_does_not_matter(corpus: str, tmp_path: Path) -> None:
    motion = ballet_clip("temps-lie").resample(30.0).slice(0, 60)
    assert write_score(None, motion, 10.0, 60.0, corpus, tmp_path)["text"]


def test_a_stretch_is_written_alone(served: Served) -> None:
    one = served.project()["piece"]["blocks"][1]
    _, found = written(served, block="b2", tolerance=12)
    assert found["times"][-1] == pytest.approx(one["seconds"], abs=0.05)


def test_a_changed_text_is_composed_into_movement_of_the_project(served: Served) -> None:
    job, found = written(served, block="b1", tolerance=15)
    same = served.post("/api/score/compose", {"job": job, "text": found["text"]})
    assert [same["lines"], same["times"]] == [found["lines"], found["times"]]
    assert same["frames"] == len(same["lines"])
    tempo = served.project()["tempo"]
    text = found["text"].replace(f"tempo   {tempo:g}", f"tempo   {2 * tempo:g}")
    fast = served.post("/api/score/compose", {"job": job, "text": text})
    np.testing.assert_allclose(2.0 * np.array(fast["times"]), same["times"], atol=2e-3)
    state = served.insert("b3", fast["key"], 0, fast["frames"] - 1)
    assert state["piece"]["blocks"][-1]["seconds"] == pytest.approx(fast["times"][-1], abs=1e-3)


def test_the_recording_behind_a_score_keeps_its_credits(served: Served) -> None:
    job, found = written(served, block="b1", tolerance=15)
    kept = served.post("/api/score/compose", {"job": job, "text": found["text"]})
    before = served.get("/api/credits")
    for block in ("b1", "b2"):
        served.edit(edit="delete", block=block)
    served.insert("b3", kept["key"], 0, kept["frames"] - 1)
    lines = [line for section in served.get("/api/credits")["sections"] for line in section["lines"]]
    assert any("adagio" in line for line in lines)
    assert not any("petit-allegro" in line for line in lines)
    assert before != served.get("/api/credits")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: re.sub(r"(\n  start face [^|]*\| )\S+", r"\1nothing", text), r"^score:\d+: .*nothing"),
        (lambda _: BENDS + "clip again: Once more\n  bends\n", "the score has 2 clips"),
        (lambda _: "include /etc/passwd", "includes passwd: upload that score too"),
        (lambda _: "", "has no clip"),
    ],
)
def test_a_wrong_text_is_refused_with_its_line(served: Served, change: Any, words: str) -> None:
    job, found = written(served, block="b1", tolerance=20)
    blocks = served.project()["piece"]["blocks"]
    answer = served.post("/api/score/compose", {"job": job, "text": change(found["text"])})
    assert answer["key"] == ""
    assert re.search(words, answer["error"]), answer
    assert served.project()["piece"]["blocks"] == blocks


def test_scores_are_composed_two_at_a_time(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    job, found = written(served, block="b1", tolerance=20)
    running, counts = [0], []

    async def read(*_: Any) -> Answer:
        running[0] += 1
        counts.append(running[0])
        await asyncio.sleep(0.5)
        running[0] -= 1
        return Answer(error="no score")

    monkeypatch.setattr(uploads, "_read_apart", read)
    wanted = {"job": job, "text": found["text"]}
    with ThreadPoolExecutor(5) as pool:
        answers = [*pool.map(lambda _: served.post("/api/score/compose", wanted), range(5))]
    assert {one["error"] for one in answers} == {"no score"}
    assert (len(counts), max(counts)) == (5, 2)


def test_what_cannot_be_written_is_said(served: Served) -> None:
    assert "no longer in the piece" in served.send("POST", "/api/score", {"block": "b9"}).value["error"]
    assert served.send("POST", "/api/score", {"tolerance": 0.5}).status == 400
    refused = served.send("POST", "/api/score/compose", {"job": "99", "text": BENDS})
    assert "no longer knows this score" in refused.value["error"]
    for block in ("b1", "b2"):
        served.edit(edit="delete", block=block)
    assert "the piece is empty" in served.send("POST", "/api/score", {}).value["error"]
