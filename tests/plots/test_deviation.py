"""The picture of a transcription's deviations: curves as high as the report says, marked where they are worst."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind import MotionMindError
from motionmind.plots import Plate, draw_deviation
from motionmind.plots.marks import Line, Words
from motionmind.transcription import Transcription, transcribe


@cache
def transcribed() -> Transcription:
    return transcribe(ballet_clip("adagio").resample(30.0).slice(0, 121), 8.0)


def titled(plate: Plate, title: str) -> list[Line]:
    return [mark for mark in plate.marks if isinstance(mark, Line) and title in mark.title]


def test_each_part_has_a_panel_whose_curve_is_as_high_as_it_is_off() -> None:
    found, plate = transcribed(), draw_deviation(transcribed())
    written = [mark.text for mark in plate.marks if isinstance(mark, Words)]
    for part, off in found.deviation.degrees.items():
        assert part in written
        (curve,) = titled(plate, f"score: {part}")
        assert f"{max(off):.1f} degrees at most" in curve.title
        heights = curve.points[:, 1].max() - curve.points[:, 1]
        shape = np.array(off) - min(off)
        np.testing.assert_allclose(heights * shape.max(), shape * heights.max(), atol=1e-6)
    (pelvis,) = titled(plate, "score: pelvis")
    assert f"{max(found.deviation.centimetres):.1f} cm at most" in pelvis.title


def test_each_posture_has_a_tick_at_its_time() -> None:
    found, plate = transcribed(), draw_deviation(transcribed())
    x = np.array([line.points[0, 0] for line in titled(plate, "posture")])
    assert len(x) == len(found.keys)
    np.testing.assert_allclose((x - x[0]) / (x[-1] - x[0]), found.keys / found.keys[-1], atol=1e-9)


def test_the_bodies_stand_apart_as_they_do_in_the_worst_frame() -> None:
    """Both are drawn from one pelvis: where the score is the recording, they cover each other."""
    plate = draw_deviation(transcribed())
    ghost, body = (
        np.concatenate([mark.points for mark in plate.marks if isinstance(mark, Line) and mark.width == width])
        for width in (6.0, 1.6)
    )
    assert ghost.shape == body.shape
    apart = np.linalg.norm(ghost - body, axis=1)
    assert 0.1 < apart.max() < 20.0


def test_a_single_frame_is_refused() -> None:
    with pytest.raises(MotionMindError, match="is a single frame, and has no time to draw over"):
        draw_deviation(transcribe(ballet_clip("adagio").slice(0, 1)))


def test_the_command_draws_the_deviations(run: Run) -> None:
    done = run("transcribe", "ballet/temps-lie", "--to", "8", "-o", "t.score", "--picture", "t.svg")
    assert done.code == 0, done.err
    assert "t.score, t.svg" in done.out
    assert Path("t.svg").read_text(encoding="utf-8").startswith("<svg")
    assert run("transcribe", "ballet/temps-lie", "-o", "u.score", "--picture", "u.txt").code == 2
    assert not Path("u.score").exists()
