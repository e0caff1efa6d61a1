"""Variations that stay on a stage."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind import (
    Engine,
    Insertion,
    Motion,
    NoPathError,
    Piece,
    Posture,
    Tween,
    Variation,
    read_variation,
    vary,
    write_motion,
    write_variation,
)
from motionmind.body.stage import find_overstep
from motionmind.geometry import rotations as rot


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def travelling(metres: float) -> Motion:
    """The adagio, carried over the floor by some metres in all."""
    motion = ballet_clip("adagio")
    share = np.linspace(0.0, metres, len(motion))
    return replace(motion, root=motion.root + share[:, None] * (0.8, 0.0, 0.6))


def made(engine: Engine | None, stage: tuple[float, float] | None, **options: object) -> Variation:
    return vary(travelling(6.0), engine, depart=0.15, alternatives=1, stage=stage, **options)  # type: ignore[arg-type]


def test_a_variation_that_fits_is_moved_as_a_whole() -> None:
    free = made(None, None).motion()
    size = np.ptp(free.root[:, [0, 2]], axis=0) + 0.01
    placed = made(None, (float(size[0]), float(size[1])))
    assert find_overstep(placed.motion(), tuple(size)) is None
    assert not placed.edits
    np.testing.assert_allclose(np.diff(placed.motion().root, axis=0), np.diff(free.root, axis=0), atol=1e-12)


def test_on_too_small_a_stage_it_is_centred_without_a_corpus() -> None:
    placed, free = made(None, (1.0, 1.0)).motion().root, made(None, None).motion().root
    np.testing.assert_allclose(np.diff(placed, axis=0), np.diff(free, axis=0), atol=1e-12)
    level = placed[:, [0, 2]]
    np.testing.assert_allclose(level.min(axis=0), -level.max(axis=0), atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("facing", ["free", "stage"])
def test_insertions_travel_so_that_runs_fit(ballet: Engine, facing: str, tmp_path: Path) -> None:
    piece = Piece.of(travelling(6.0), facing=facing)  # type: ignore[arg-type]
    stage = (3.2, 3.2)
    free = vary(piece, ballet, depart=0.15, alternatives=1)
    assert find_overstep(free.motion(), stage) is not None
    placed = vary(piece, ballet, depart=0.15, alternatives=1, stage=stage)
    over, before = find_overstep(placed.motion(), stage), find_overstep(free.motion(), stage)
    assert before is not None
    assert placed.edits
    assert over is None or over.metres < 0.3 * before.metres
    np.testing.assert_array_equal(placed.postures, free.postures)
    motion, frames = placed.arrange()
    for seam in placed.seams:
        if seam.insertion:  # it ends in the posture that follows
            at = slice(int(frames[seam.at]), int(frames[seam.at + 1]) + 1)
            steps = np.linalg.norm(np.diff(motion.root[at], axis=0), axis=1)
            assert steps.max() < 0.12
            turned = np.diff(np.unwrap(rot.heading(motion.rotations[at, 0])))
            assert np.abs(turned).max() < 0.5
    write_variation(tmp_path / "v.json", placed)
    np.testing.assert_allclose(read_variation(tmp_path / "v.json").motion().root, motion.root, atol=1e-9)


@pytest.mark.long
def test_insertions_that_travel_for_longer_than_inserted_allows_are_noted(run: Run) -> None:
    write_motion("far.json", travelling(6.0))
    words = ("vary", "far.json", "--corpus", "ballet", "--alternatives", "1", "-o", "v.json")
    assert "insertions travel" not in run(*words).err
    ran = run(*words, "--stage", "3.2x3.2")
    (told,) = [line for line in ran.err.splitlines() if "insertions travel to stay on the stage" in line]
    assert "more than --inserted 0.3, which a larger --stage keeps" in told
    assert "no order of" not in ran.err


def test_where_no_insertion_can_travel_the_variation_is_centred(
    ballet: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    tween = Engine.tween

    def stays(self: Engine, *ends: Posture, **options: Any) -> Tween:
        if options.get("to") is not None:
            raise NoPathError("no path leads there")
        return tween(self, *ends, **options)

    monkeypatch.setattr(Engine, "tween", stays)
    placed = made(ballet, (3.2, 3.2))
    assert not placed.edits
    level = placed.motion().root[:, [0, 2]]
    np.testing.assert_allclose(level.min(axis=0), -level.max(axis=0), atol=1e-9)
    assert find_overstep(placed.motion(), (3.2, 3.2)) is not None


def test_what_follows_a_travelling_insertion_is_carried_with_it() -> None:
    piece = Piece.of(ballet_clip("plies").slice(0, 12))
    a, b = piece.ends(3, 7)
    turn, place = rot.about_vertical(np.asarray(0.5)), np.array([1.0, 0.0, 2.0])
    last = b.rotations.copy()
    last[0] = rot.mul(turn, last[0])
    way = replace(
        a.as_motion(),
        rotations=np.stack([a.rotations, a.rotations, last]),
        root=np.stack([a.root, a.root, b.root + place]),
        times=np.array([0.0, 0.5, 1.0]),
        insertions=(Insertion(np.array([0.0, 1.0])),),
    )
    order = np.array([0, 1, 2, 3, 7, 8, 9])
    still = replace(
        way, rotations=np.stack([a.rotations, a.rotations, b.rotations]), root=np.stack([a.root, a.root, b.root])
    )
    free, carried = (piece.arrange(order, {3: one}).motion for one in (still, way))
    facing = rot.heading(free.rotations[3, 0])
    about = rot.about_vertical(np.asarray(facing))
    there = rot.mul_vec(about, place) + free.root[3] * (1.0, 0.0, 1.0)
    expected = rot.mul_vec(turn, (free.root - free.root[3])[5:] * (1.0, 0.0, 1.0)) + there
    np.testing.assert_allclose(carried.root[5:, [0, 2]], expected[:, [0, 2]], atol=1e-9)
    np.testing.assert_allclose(
        rot.heading(carried.rotations[5:, 0]) - rot.heading(free.rotations[5:, 0]), 0.5, atol=1e-9
    )


def test_the_command_line_keeps_movement_on_a_stage(run: Run) -> None:
    write_motion("far.json", travelling(3.0))
    ran = run("convert", "far.json", "near.json", "--stage", "3x3")
    assert ran.code == 0
    assert "far.json: moved by " in ran.err
    assert "to stay on the stage" in ran.err
    assert run("plan", "near.json", "-o", "p.svg", "--stage", "3x3").err == ""
    small = run("convert", "far.json", "near.json", "--stage", "1.5x1.5")
    assert small.code == 0
    assert "far.json leaves the stage, " in small.err
    assert "; it is larger than the stage" in small.err
    told = run("vary", "far.json", "--depart", "0.2", "--stage", "0.5x3", "-o", "v.json")
    assert told.code == 2
    assert "stage must be its width and depth, from 1 to 200 m each, not (0.5, 3.0)" in told.err
    assert not Path("v.json").exists()
    assert run("vary", "far.json", "--depart", "0.2", "--stage", "9x9", "-o", "v.json").code == 0
