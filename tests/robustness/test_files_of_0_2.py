"""Postures, movement and variations that 0.2 wrote are read."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from command_line import Run

from motionmind.formats import read_motion, read_posture
from motionmind.variation.variation_json import read_variation


@pytest.fixture
def written(tmp_path: Path) -> Path:
    zipfile.ZipFile(Path(__file__).with_name("files_of_0_2.zip")).extractall(tmp_path)
    return tmp_path


def test_a_posture_and_movement_are_read(written: Path) -> None:
    motion, posture = read_motion(written / "motion.json"), read_posture(written / "posture.json")
    assert len(motion) == 14
    np.testing.assert_allclose(posture.rotations, motion.rotations[0], atol=1e-5)
    (insertion,) = read_motion(written / "tween.json").insertions
    assert len(insertion.times) == 6


def test_a_variation_is_read_and_drawn_on(written: Path, run: Run) -> None:
    for name, edits in (("variation.json", 0), ("reviewed.json", 2)):
        variation = read_variation(written / name)
        assert (len(variation.transitions), len(variation.edits)) == (2, edits)
    assert run("review", written / "variation.json", "--approve", "1", "-o", "again.json").code == 0
