"""Projects that begin with a variation: its stretches, its insertions to the bit, its decisions."""

from pathlib import Path

import numpy as np
import pytest

from motionmind.studio.beginning import corpus_of, take_in
from motionmind.studio.project import Project
from motionmind.tween.engine import Engine
from motionmind.variation.variation import Variation, vary
from motionmind.variation.variation_json import is_variation, read_variation, write_variation


@pytest.fixture(scope="module")
def variation() -> Variation:
    engine = Engine.load("ballet")
    motion = engine.corpus.motion(engine.corpus.clips[0])
    return vary(motion, engine, nudge=1.0, alternatives=2)


@pytest.fixture
def project(make_project) -> Project:
    return make_project()


def test_stretches_follow_one_another_as_in_the_variation(project, variation):
    take_in(project, variation, "w")
    frames = variation.piece.frames
    shown = [
        frame
        for block in project.state.blocks
        for frame in frames[(frames >= block.first) & (frames <= block.last)].tolist()
    ]
    assert shown == frames[variation.postures].tolist()


def test_insertions_are_the_variations_own(project, variation):
    take_in(project, variation, "w")
    inserted = [seam for seam in project.state.seams if (found := project.finding(seam)) and found.insertions]
    wanted = [seam.insertion for seam in variation.seams if seam.insertion]
    assert len(inserted) == len(wanted) > 3
    for seam, candidate in zip(inserted, wanted, strict=True):
        key = project.finding(seam).insertions[0].key
        assert np.array_equal(project.movements.get(key).rotations, candidate.motion.rotations)


def test_decisions_are_taken_over_and_undo_takes_all_back(project, variation):
    approved, discarded = [seam.number for seam in variation.seams if seam.insertion][:2]
    take_in(project, variation.approve(approved).discard(discarded), "w")
    decisions = [seam.verdict.decision for seam in project.state.seams if seam.verdict.decision != "open"]
    assert decisions == ["locked", "discarded"]
    project.undo("w")
    assert project.state.blocks == ()


def test_a_variations_file_is_known_by_what_is_in_it(tmp_path: Path, variation):
    write_variation(tmp_path / "v.json", variation)
    assert is_variation(tmp_path / "v.json")
    assert corpus_of(read_variation(tmp_path / "v.json")) == "ballet"
    (tmp_path / "m.json").write_text('{"format": "motionmind-motion"}')
    (tmp_path / "x.json").write_text("[")
    assert not any(is_variation(tmp_path / name) for name in ("m.json", "x.json", "v.bvh"))
