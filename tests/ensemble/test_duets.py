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


TWEEN = "tween", "duo.bvh@30", "duo.bvh@100", "--corpus", "ballet"


def test_tween_leads_a_couple_from_one_duet_posture_to_another(duo: Path, run: Run) -> None:
    Path("sub").mkdir()
    ran = run(*TWEEN, "-o", "sub/t.toml", "-o", "t.html", "-o", "t.glb", "-o", "t.bvh")
    assert ran.code == 0, ran.err
    assert "leader:\n" in ran.out
    assert "\ncouple    " in ran.out
    assert "no hands held" in ran.out
    assert "in the duets\n" in ran.out
    assert all(
        Path(name).exists() for name in ("t.html", "t.glb", "t-1.bvh", "t-2.bvh", "sub/t-1.json", "sub/t-2.json")
    )
    ensemble = read_ensemble(Path("sub/t.toml"), lambda piece: read_motion(f"sub/{piece}"))
    for dancer, whole, name in zip(ensemble.dancers, face_to_face(), ("pelvis", "pelvis (2)"), strict=True):
        assert dancer.name == name
        for frame, given in ((0, 30), (-1, 100)):
            there = dancer.placed().slice(frame % len(dancer.piece), frame % len(dancer.piece) + 1)
            np.testing.assert_allclose(there.positions()[0], whole.positions()[given], atol=3e-3)
    again = run("tween", "sub/t.toml@0", "duo.bvh@60~", "--corpus", "ballet", "--duets", "duo.bvh", "--duration", "1")
    assert again.code == 0, again.err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("duo.bvh@30", "ballet/fifth"), "duo.bvh@30 is of several dancers, and ballet/fifth of one"),
        (("duo.bvh#pelvis@3", "duo.bvh@9"), "duo.bvh@9 is of several dancers, and duo.bvh#pelvis@3 of one"),
        (("duo.bvh@30", "duo.bvh@9999"), "duo.bvh: frames are 0 to "),
        (("duo.bvh", "duo.bvh@9"), "frames, where one posture was expected; say which"),
        (("solo.toml@0", "duo.bvh@9"), "solo.toml: a duet has two dancers, not 1"),
        (("odd.toml@0", "duo.bvh@9"), "odd.toml: Anna and Ben have different joints: "),
        (("duo.bvh@3", "duo.bvh@9", "--alternatives", "2"), "duo.bvh: --alternatives is not for an ensemble"),
        (("duo.bvh@3", "duo.bvh@9", "-o", "t.json"), "t.json: cannot be written: the name must end in one of .toml"),
        (("duo.bvh@3", "duo.bvh@9", "-o", "t.toml", "--duets", "0.bvh"), "0.bvh: a duet has two dancers, not 1"),
        (("ballet/fifth", "ballet/tendu", "--duets", "duo.bvh"), "--duets: ballet/fifth and ballet/tendu are of one"),
    ],
)
def test_what_is_no_duet_is_one_line(duo: Path, run: Run, words: tuple[str, ...], told: str) -> None:
    Path("solo.toml").write_text('[[dancer]]\npiece = "ballet/balances"\n')
    Path("odd.toml").write_text(
        '[[dancer]]\nname = "Anna"\npiece = "ballet/balances"\n[[dancer]]\nname = "Ben"\npiece = "walk-hexapod/wave"\n'
    )
    ran = run("tween", *words, "--corpus", "ballet")
    assert (ran.code, ran.out) == (2, ""), ran
    assert told in ran.err
    assert ran.err.strip().splitlines()[-1].startswith("error: ")
    assert not list(Path().glob("t*"))


def test_pieces_of_a_duet_are_not_overwritten(duo: Path, run: Run) -> None:
    assert run(*TWEEN, "--duration", "1", "-o", "pas.toml").code == 0
    before = Path("pas-1.json").read_bytes()
    ran = run("tween", "pas.toml@0", "pas.toml@9", "--corpus", "ballet", "-o", "pas.toml")
    assert ran.code == 2, ran
    Path("others.toml").write_bytes(Path("pas.toml").read_bytes())
    ran = run("tween", "others.toml@0", "others.toml@9", "--corpus", "ballet", "-o", "pas.toml")
    assert (ran.code, "pas-1.json" in ran.err) == (2, True), ran
    assert Path("pas-1.json").read_bytes() == before


def test_duets_need_a_corpus(duo: Path, run: Run) -> None:
    ran = run(*TWEEN[:3])
    assert ran.code == 2
    assert "Missing option '--corpus': duet postures are in files." in ran.err
