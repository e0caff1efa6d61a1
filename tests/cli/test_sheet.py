"""Sheets on the counts of a tempo."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

import motionmind.render.sheet as sheets
from motionmind import Motion, write_motion


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Motion, list[str]]]:
    """What sheets draw: the postures, and their captions."""
    found: list[tuple[Motion, list[str]]] = []
    draw = sheets.draw_sheet

    def record(motion: Motion, frames: object = None, **options: object) -> object:
        found.append((motion, options["captions"]))  # type: ignore[arg-type]
        return draw(motion, frames, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(sheets, "draw_sheet", record)
    return found


@pytest.mark.parametrize(("counts", "every"), [(8, 1), (8, 3), (None, 4)])
def test_a_sheet_shows_the_postures_at_the_counts_of_a_tempo(
    run: Run, drawn: list[tuple[Motion, list[str]]], counts: int | None, every: int
) -> None:
    piece = ballet_clip("adagio")
    write_motion("piece.json", piece)
    words = ["sheet", "piece.json", "--tempo", 108, "--every", every, "-o", "s.png"]
    ran = run(*words, *(["--counts", counts] if counts else []))
    assert ran.code == 0
    ((shown, captions),) = drawn
    length = float(piece.times[-1] - piece.times[0])
    numbers = [n for n in range(1, 1000, every) if (n - 1) * 60 / 108 <= length + 1e-6 and n <= (counts or n)]
    assert captions == [f"count {number}" for number in numbers]
    expected = piece.at(piece.times[0] + (np.array(numbers) - 1.0) * 60.0 / 108.0)
    np.testing.assert_allclose(shown.positions(), expected.positions(), atol=1e-9)
    assert f"{len(numbers)} postures of {len(piece)}" in ran.out


def test_counts_begin_with_the_first_frame_drawn(run: Run, drawn: list[tuple[Motion, list[str]]]) -> None:
    piece = ballet_clip("adagio")
    run("sheet", "ballet/adagio", "--from", 5, "--tempo", 60, "--counts", 2, "-o", "s.png")
    ((shown, captions),) = drawn
    assert captions == ["count 1", "count 2"]
    np.testing.assert_allclose(shown.positions()[0], piece.positions()[5], atol=1e-6)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--counts", "8"], "--counts needs --tempo"),
        (["--tempo", "108", "--postures", "4"], "--tempo and --postures both choose the postures to draw"),
        (["--tempo", "0"], "0"),
        (["--tempo", "6000"], "a sheet holds 400 postures"),
    ],
)
def test_counts_that_cannot_be_drawn_are_refused(run: Run, options: list[str], words: str) -> None:
    said = run("sheet", "ballet/adagio", "-o", "s.png", *options)
    assert (said.code, said.out) == (2, "")
    assert words in said.err
    assert not Path("s.png").exists()
