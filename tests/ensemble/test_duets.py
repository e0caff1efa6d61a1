"""Two bodies of one BVH file as an ensemble: in the space that they share, in every command.

The duet is one dancer and the dancer's mirror image, face to face: their relation is known in every frame.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind import read_motion, write_motion
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion
from motionmind.ensemble.dancers import Dancer
from motionmind.ensemble.reading import read_ensemble

APART_M = 1.4


def face_to_face() -> tuple[Motion, Motion]:
    """Dancers who mirror each other in the plane z = 0, 1.4 m apart at first."""
    piece = ballet_clip("temps-lie").slice(0, 12).resample(30.0)
    one = Dancer("one", piece, (0.2, -0.5 * APART_M)).placed()
    other = Dancer("other", mirrored(piece), (0.2, 0.5 * APART_M), np.pi).placed()
    return one, replace(other, times=one.times)


@pytest.fixture
def duo(tmp_path: Path) -> Path:
    parts = []
    for number, motion in enumerate(face_to_face()):
        path = tmp_path / f"{number}.bvh"
        write_motion(path, motion)
        parts.append(path.read_text().split("MOTION\n"))
    (first, rows), (second, others) = parts
    hierarchy = first + second.removeprefix("HIERARCHY\n")
    values = [f"{a} {b}" for a, b in zip(rows.split("\n")[2:], others.split("\n")[2:], strict=True)]
    path = tmp_path / "duo.bvh"
    path.write_text("\n".join([f"{hierarchy}MOTION", *rows.split("\n")[:2], *values]))
    return path


def test_convert_keeps_the_space_that_they_share(duo: Path, run: Run) -> None:
    Path("sub").mkdir()
    ran = run("convert", "duo.bvh", "sub/duo.toml")
    assert ran.code == 0, ran.err
    assert ran.out.startswith("sub/duo.toml: 2 dancers, ")
    ensemble = read_ensemble(Path("sub/duo.toml"), lambda piece: read_motion(f"sub/{piece}"))
    assert [dancer.name for dancer in ensemble.dancers] == ["pelvis", "pelvis (2)"]
    one, other = (dancer.at(dancer.piece.times) for dancer in ensemble.dancers)
    for motion, wanted in zip((one, other), face_to_face(), strict=True):
        np.testing.assert_allclose(motion.positions(), wanted.positions(), atol=2e-3)
    np.testing.assert_allclose(one.root * [1, 1, -1], other.root, atol=2e-3)


def test_every_command_draws_both(duo: Path, run: Run) -> None:
    for arguments in (
        ("plan", "duo.bvh", "-o", "duo.svg"),
        ("sheet", "duo.bvh", "-o", "duo.png", "--postures", "3"),
        ("render", "duo.bvh", "-o", "duo.html"),
        ("render", "duo.bvh", "-o", "duo.gif", "--fps", "2", "--size", "120"),
        ("convert", "duo.bvh", "duo.glb"),
    ):
        ran = run(*arguments)
        assert ran.code == 0, ran.err
        assert "2 dancers, " in ran.out
    run("convert", "duo.bvh", "duo.toml")
    assert run("render", "duo.toml", "-o", "again.html").code == 0


def test_one_of_them_is_still_drawn_alone_and_one_body_is_no_ensemble(duo: Path, run: Run) -> None:
    ran = run("render", "duo.bvh#pelvis", "-o", "one.html")
    assert ran.code == 0, ran.err
    assert "frames" in ran.out
    assert "frames" in run("render", "0.bvh", "-o", "alone.html").out
    ran = run("convert", "0.bvh", "alone.toml")
    assert ran.code == 2
    assert ".bvh, .json" in ran.err


def test_a_file_that_is_damaged_below_its_bodies_is_refused(duo: Path, run: Run) -> None:
    text = duo.read_text()
    for damaged in (text[:-200], text.replace("MOTION", "NOTION")):
        duo.write_text(damaged)
        ran = run("render", "duo.bvh", "-o", "duo.html")
        assert ran.code == 2
        assert ran.err.count("\n") == 1
        assert "duo.bvh" in ran.err
        assert not Path("duo.html").exists()
