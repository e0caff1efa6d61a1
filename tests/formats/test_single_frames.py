"""The frame rate of a single frame, and of keys that are seconds apart."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import Run

from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError, WrongTypeError
from motionmind.formats import read_motion, write_motion
from motionmind.geometry import rotations as rot

SUFFIXES = (".bvh", ".npz")


def moving(frames: int, rate: float) -> Motion:
    rng = np.random.default_rng(frames)
    turns = rot.exp(0.1 * rng.normal(size=(frames, 23, 3)))
    return Motion(human23(), turns, np.tile([0.0, 0.95, 0.0], (frames, 1)), np.arange(frames) / rate, name="a")


def written_rate(path: Path) -> float:
    """The frames per second in a file."""
    if path.suffix == ".npz":
        with np.load(path) as file:
            return float(file["mocap_framerate"])
    (line,) = (line for line in path.read_text().splitlines() if line.startswith("Frame Time"))
    return 1.0 / float(line.split(":")[1])


@pytest.mark.parametrize("rate", [24.0, 29.97, 120.0])
@pytest.mark.parametrize("after", SUFFIXES)
@pytest.mark.parametrize("before", SUFFIXES)
def test_one_frame_keeps_the_rate_of_its_file(before: str, after: str, rate: float, tmp_path: Path) -> None:
    long, one, copy = (
        tmp_path / f"{name}{suffix}" for name, suffix in (("long", before), ("one", before), ("copy", after))
    )
    write_motion(long, moving(4, rate))
    cut = read_motion(long).slice(2, 3)
    write_motion(one, cut)
    assert written_rate(one) == pytest.approx(rate, rel=1e-6)
    write_motion(copy, read_motion(one))
    assert written_rate(copy) == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "rate"),
    [
        (lambda motion: motion, 30.0),
        (lambda motion: replace(motion, rate=1e9), 30.0),
        (lambda motion: motion.resample(50.0), 50.0),
        (lambda motion: motion.stretch_to(60.0), 60.0),
        (lambda motion: moving(9, 2.0).slice(3, 4), 30.0),  # a key has no rate
        (lambda motion: moving(9, 100.0).slice(3, 4), 100.0),
    ],
)
def test_rates_of_one_frame(change: Callable[[Motion], Motion], rate: float, tmp_path: Path) -> None:
    write_motion(tmp_path / "a.bvh", change(moving(1, 1.0)))
    assert written_rate(tmp_path / "a.bvh") == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize("rate", [-1.0, np.nan, np.inf])
def test_rates_that_are_none(rate: float) -> None:
    with pytest.raises(MotionMindError, match="rate must be a number of frames a second"):
        replace(moving(1, 1.0), rate=rate)
    with pytest.raises(WrongTypeError):
        replace(moving(1, 1.0), rate="30")  # type: ignore[arg-type]


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("source", [".json", ".glb"])
@pytest.mark.parametrize("frames", [2, 5])
def test_sparse_keys_become_frames(source: str, suffix: str, frames: int, tmp_path: Path, run: Run) -> None:
    keys, out = tmp_path / f"keys{source}", tmp_path / f"out{suffix}"
    motion = moving(frames, 0.5)
    write_motion(keys, motion)
    result = run("convert", str(keys), str(out))
    assert result.code == 0, result.err
    assert "frames, not keys: resampled" in result.err
    assert written_rate(out) == pytest.approx(30.0)
    found = read_motion(out)
    assert len(found) == 60 * (frames - 1) + 1
    if suffix == ".bvh":
        assert rot.angle(found.rotations[::60], motion.rotations).max() < 1e-4
    chosen = run("convert", str(keys), str(out), "--fps", "2")
    assert chosen.code == 0, chosen.err
    assert written_rate(out) == pytest.approx(2.0)


def test_a_rate_that_a_file_states_stays(tmp_path: Path, run: Run) -> None:
    write_motion(tmp_path / "slow.bvh", moving(4, 0.5))
    assert run("convert", str(tmp_path / "slow.bvh"), str(tmp_path / "out.bvh")).code == 0
    assert written_rate(tmp_path / "out.bvh") == pytest.approx(0.5)
