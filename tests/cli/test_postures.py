"""Postures and frames that the command line names, by themselves and as what movement passes through."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import BALLET, ballet_clip
from command_line import Run
from PIL import Image

from motionmind.body.motion import Motion
from motionmind.bundled import bundled
from motionmind.cli.postures import read_end
from motionmind.cli.words import parse_vias
from motionmind.errors import MotionMindError
from motionmind.formats import read_motion, write_motion, write_posture
from motionmind.geometry import rotations as rot
from motionmind.names.postures import find_posture
from motionmind.names.spelling import Moment, parse_posture

FIFTH = BALLET / "postures" / "fifth.json"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def clip(fps: float = 30.0) -> Motion:
    return ballet_clip("jump").resample(fps)


def tween(run: Run, *words: object) -> Any:
    return run("tween", *words, "--corpus", "ballet", "--report", "-")


# --- what is named; what names mean is in tests/names -----------------------------------------------------------------


def test_a_file_of_the_whole_name_goes_first() -> None:
    for name in ("C.json@3", "clip.bvh@3@3"):
        assert parse_vias([name])[0][0].source.place == name.partition("@")[0]
        Path(name).touch()
        ((posture, move),) = parse_vias([name])
        assert (posture.source.place, posture.moment, move) == (name, None, None)


@pytest.mark.parametrize(
    ("word", "file", "frame", "move"),
    [
        ("C.json", "C.json", None, None),
        ("C.json@3", "C.json", None, 3),
        ("C.json@", "C.json", None, None),
        ("clip.bvh@150@3", "clip.bvh", 150, 3),
        ("clip.bvh@150@", "clip.bvh", 150, None),
        ("clip.bvh@-1@2", "clip.bvh", -1, 2),
        ("ballet/passe@3", "ballet", None, 3),
        ("ballet/adagio@23@3", "ballet", 23, 3),
    ],
)
def test_what_is_passed_names_its_move_last(word: str, file: str, frame: int | None, move: int | None) -> None:
    ((posture, at),) = parse_vias([word])
    assert (posture.source.place, posture.moment and posture.moment.frame, at) == (file, frame, move)


def test_a_second_is_told_from_a_move() -> None:
    for word, move in (("clip.bvh@1.5s", None), ("clip.bvh@1.5s@", None), ("clip.bvh@1.5s@3", 3)):
        ((posture, at),) = parse_vias([word])
        assert (posture.moment, at) == (Moment(seconds=1.5), move)


@pytest.mark.parametrize("word", ["clip.bvh@150~", "clip.bvh@150~@3", "clip.bvh@-1", "C.json~"])
def test_what_is_passed_is_told_from_a_frame_and_stands_still(word: str) -> None:
    with pytest.raises(MotionMindError, match=r"give a posture and its move, as C.json@3 or clip.bvh@150@3"):
        parse_vias([word])


# --- what is read -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["clip.bvh", "clip.json", "clip.npz", "clip.txt"])
def test_a_frame_of_every_format_is_the_frame_with_the_movement_around_it(name: str) -> None:
    write_motion(name, clip())
    whole = read_motion(name)
    for frame in (0, 7, -2):
        found = find_posture(parse_posture(f"{name}@{frame}"), read=read_motion).posture
        np.testing.assert_array_equal(found.rotations, whole.posture(frame).rotations)
        np.testing.assert_array_equal(found.root, whole.posture(frame).root)
    a, before = read_end(parse_posture(f"{name}@9~"), "before")
    b, after = read_end(parse_posture(f"{name}@9~"), "after")
    assert before is not None
    assert after is not None
    around = 6  # 0.2 s
    np.testing.assert_array_equal(before.times, whole.times[9 - around : 10])
    np.testing.assert_array_equal(after.times, whole.times[9 : 10 + around])
    for posture, neighbour in ((a, before.posture(-1)), (b, after.posture(0))):
        np.testing.assert_array_equal(posture.rotations, whole.rotations[9])
        np.testing.assert_array_equal(neighbour.rotations, whole.rotations[9])


def test_movement_next_to_the_ends_of_a_clip_is_what_there_is() -> None:
    write_motion("clip.json", clip())
    last = len(clip()) - 1
    _, before = read_end(parse_posture("clip.json@2~"), "before")
    _, after = read_end(parse_posture("clip.json@-2~"), "after")
    assert before is not None
    assert after is not None
    assert (len(before), len(after)) == (3, 2)
    assert after.times[-1] == clip().times[last]


# --- on the command line ----------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_tween_begins_and_ends_as_fast_as_the_clip(run: Run) -> None:
    write_motion("clip.bvh", clip())
    by_tilde = tween(run, "clip.bvh@10~", "clip.bvh@30~").json["asked"]
    assert (by_tilde["before"], by_tilde["after"]) == (pytest.approx(0.2, abs=1e-4), pytest.approx(0.2, abs=1e-4))
    alone = tween(run, "clip.bvh@10", FIFTH).json["asked"]
    assert (alone["before"], alone["after"]) == (None, None)
    ran = run("tween", "clip.bvh@10~", FIFTH, "--corpus", "ballet", "-o", "out.json", "--details")
    assert ["moving, " in line for line in ran.out.splitlines() if line.startswith(("A  ", "B  "))] == [True, False]
    assert rot.angle(read_motion("out.json").rotations[0], read_motion("clip.bvh").rotations[10]).max() < 1e-6


@pytest.mark.long
def test_a_frame_of_a_clip_is_passed(run: Run) -> None:
    write_motion("clip.bvh", clip())
    assert tween(run, "clip.bvh@0", FIFTH, "--via", "clip.bvh@15@4").json["asked"]["via"] == [4]
    assert tween(run, "clip.bvh@0", FIFTH, "--via", "clip.bvh@15@").json["asked"]["via"] == [None]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["clip.bvh@99", "B.json"], r"clip\.bvh: frames are 0 to 36, there is no frame 99"),
        (["clip.bvh@-99~", "B.json"], r"clip\.bvh: frames are 0 to 36, there is no frame -99"),
        (["clip.bvh", "B.json"], r"clip\.bvh: 37 frames, .* expected; say which, from clip\.bvh@0 to clip\.bvh@36"),
        (["clip.bvh@9.9s", "B.json"], r"clip\.bvh: its frames are from 0\.00 to 1\.20 s, there is none at 9\.9 s"),
        (["clip.bvh@0~", "B.json"], r"clip\.bvh@0~: nothing comes before this frame; leave out ~"),
        (["B.json", "clip.bvh@-1~"], r"clip\.bvh@-1~: nothing comes after this frame; leave out ~"),
        (["B.json~", "clip.bvh@3"], r"B\.json~: B\.json holds one posture, no movement around it; leave out ~"),
        (["B.json@0~", "clip.bvh@3"], r"B\.json@0~: B\.json holds one posture, no movement around it; leave out ~"),
        (["clip.bvh~", "B.json"], r"clip\.bvh~: say which frame, from 0 to 36, as clip\.bvh@0~"),
        (["no.bvh@3", "B.json"], r"no\.bvh: cannot be read: there is no such file or folder"),
        (
            ["clip.bvh@3x", "B.json"],
            r"clip\.bvh: @3x is neither a frame, such as @240, nor seconds, such as @2\.0s",
        ),
        (
            ["clip.bvh@0", "B.json", "--via", "clip.bvh@15"],
            r"the last @ is a move, .* write clip\.bvh@15@ for frame 15",
        ),
        (
            ["clip.bvh@0", "B.json", "--via", "ballet/adagio@23"],
            r"write ballet/adagio@23@ .*, or ballet/adagio@FRAME@23",
        ),
        (["clip.bvh@0", "B.json", "--via", "clip.bvh@15~"], r"--via clip\.bvh@15~: give a posture and its move"),
        (["clip.bvh@" + "9" * 5000, "B.json"], r"cannot be used|no such file"),
        (["clip.bvh@3", "B.json", "--via", "B.json@" + "9" * 5000], r"cannot be used|no such file"),
        (["A" * 5000 + "@3", "B.json"], r"cannot be used|no such file"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(run: Run, words: Sequence[str], message: str) -> None:
    write_motion("clip.bvh", clip())
    write_posture("B.json", clip().posture(30))
    ran = tween(run, *words)
    assert ran.code == 2
    assert ran.out == ""
    (line,) = (line for line in ran.err.splitlines() if not line.startswith("note: clip.bvh: one unit taken as"))
    assert re.search(message, line), line


def test_a_clip_that_is_read_is_not_written_over(run: Run) -> None:
    write_motion("clip.bvh", clip())
    ran = run("tween", "clip.bvh@9", FIFTH, "-o", "clip.bvh", "--corpus", "ballet")
    assert ran.code == 2
    assert "cannot be written: it is read from" in ran.err


def test_a_clip_on_another_rig_is_retargeted_with_its_movement(run: Run) -> None:
    body = clip().skeleton
    shifted = replace(clip(), root=clip().root + np.array([1.0, 0.0, 0.0]))
    write_motion("clip.bvh", replace(shifted, skeleton=replace(body, offsets=body.offsets * 1.1)))
    assert tween(run, "clip.bvh@10~", "clip.bvh@30~").code == 0


# --- by name ----------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_tween_of_named_postures_is_of_their_corpus(run: Run) -> None:
    named = run("tween", "ballet/arabesque", "ballet/fifth", "--report", "-").json
    files = tween(run, BALLET / "postures" / "arabesque.json", FIFTH).json
    assert named["path"] == files["path"]
    for words in (("karate/yoi", FIFTH), (FIFTH, "karate/yoi")):
        ran = run("tween", *words, "-o", "out.json", "--moves", 2)
        assert ran.code in (0, 3), ran.err  # of karate, for nothing says otherwise
    mixed = run("tween", "karate/yoi", "ballet/fifth", "-o", "out.json")
    assert mixed.code == 2
    assert "A is a posture of karate and B of ballet: choose --corpus karate or --corpus ballet" in mixed.err
    assert "karate: no posture or clip 'arabesque'" in run("tween", "karate/arabesque", "ballet/fifth").err
    assert tween(run, "karate/yoi", "ballet/fifth").code == 0
    alone = run("tween", FIFTH, FIFTH)
    assert alone.code == 2
    assert "Missing option '--corpus': neither A nor B is a posture of a corpus" in alone.err


def test_clips_of_a_corpus_of_ones_own_are_named_too(run: Run) -> None:
    write_motion("walk.bvh", clip(fps=10.0))
    assert run("corpus", "build", "mine", "walk.bvh", "--rate", 10).code == 0
    report = run("tween", "mine/walk@2~", "mine/walk@1.0s", "--via", "mine/walk@5@", "--report", "-").json
    assert report["asked"]["before"] == pytest.approx(0.2, abs=1e-4)
    assert report["asked"]["via"] == [None]
    found = run("tween", "mine/walk@2", "mine/wakl@3")
    assert found.code == 2
    assert "mine: no posture or clip 'wakl'; did you mean walk?" in found.err


@pytest.mark.parametrize(
    ("words", "frame"),
    [
        (["ballet/jump@3"], 3),
        (["ballet/jump", "--frame", -1], 6),
        (["ballet", "--clip", "jump", "--frame", 3], 3),
        ([BALLET / "allegro.score", "--clip", "jump", "--frame", 3], 3),
        ([f"{BALLET / 'allegro.score'}/jump@0.6s"], 3),
        (["jump.json@3"], 3),
        (["jump.json", "--frame", 3], 3),
    ],
)
def test_posture_takes_what_sheet_numbers(run: Run, words: Sequence[object], frame: int) -> None:
    write_motion("jump.json", ballet_clip("jump"))
    ran = run("posture", *words, "-o", "A.json")
    assert ran.out == f"A.json: frame {frame} of 7, on human23 (23 joints)\n", ran.err
    assert rot.angle(find_posture("A.json").posture.rotations, ballet_clip("jump").rotations[frame]).max() < 1e-6


@pytest.mark.long
def test_a_posture_by_name_is_drawn_measured_and_converted(run: Run) -> None:
    assert run("sheet", "ballet/arabesque", "-o", "sheet.png").out.startswith("sheet.png: 1 posture of 1, ")
    assert run("sheet", "ballet/adagio@23", "-o", "one.png").out.startswith("one.png: 1 posture of 68, ")
    assert run("render", "ballet/arabesque", "-o", "one.svg").code == 0
    assert run("convert", "ballet/jump", "jump.json").code == 0
    assert len(read_motion("jump.json")) == 7
    assert run("measure", "ballet/jump", "--corpus", "ballet").out.startswith("ballet/jump: 7 frames in 1.20 s")
    for words, message in (
        (["sheet", "ballet/adagio@23", "--from", 3, "-o", "x.png"], "already names a frame; leave out --from and --to"),
        (["posture", "ballet/adagio@23", "--frame", 3, "-o", "x.json"], "already names a frame; leave out --frame"),
        (["posture", "ballet/adagio", "-o", "x.json"], "say which, from ballet/adagio@0 to ballet/adagio@67"),
        (["render", "ballet/adagio@23~", "-o", "x.png"], "~ is only for the ends of a tween"),
        (["sheet", "ballet/jump", "--clip", "jump", "-o", "x.png"], "already names a clip; leave out --clip"),
    ):
        ran = run(*words)
        assert (ran.code, ran.out) == (2, "")
        assert message in ran.err


def test_postures_lists_what_other_commands_take_and_draws_it(run: Run) -> None:
    ran = run("postures", "karate", "-o", "karate.png")
    lines = [line.split()[0] for line in ran.out.splitlines() if line.startswith("  ")]
    assert len(lines) == 11 + 4
    listed = run("postures", "karate", "--json").json
    assert lines == [*listed["postures"], *(one["name"] for one in listed["clips"])]
    for name in (*listed["postures"], *(f"{one['name']}@{one['postures'] - 1}" for one in listed["clips"])):
        find_posture(name)
    with Image.open("karate.png") as picture:
        assert picture.width > 600
    for words, message in (
        (["A.json"], "not a corpus or a score"),
        (["karate/yoi"], "give karate alone"),
        (["karte"], "did you mean karate?"),
        (["hands", "-o", "hands.png"], "hands: has no named postures; `motionmind sheet` draws its clips"),
        (["karate", "-o", "karate.bvh"], "the name must end in one of .png"),
    ):
        ran = run("postures", *words)
        assert (ran.code, ran.out) == (2, "")
        assert message in ran.err


@pytest.mark.parametrize("source", ["hands", "walk-hexapod", "three.score"])
def test_commands_that_take_one_clip_name_one_of_several(source: str, run: Run) -> None:
    Path("three.score").write_bytes((bundled("corpora") / "hands" / "hands.score").read_bytes())
    for words in (
        ("convert", source, "out.json"),
        ("loop", source, "-o", "out.json"),
        ("measure", source, "--corpus", "ballet"),
        ("posture", source, "--frame", 1, "-o", "out.json"),
        ("render", source, "-o", "out.gif"),
        ("vary", source, "-o", "out.json"),
    ):
        ran = run(*words)
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
        found = re.fullmatch(r"error: (\S+): holds \d clips; name one, such as (\S+)\n", ran.err)
        assert found, ran.err
        assert found[1] == source
    assert run("convert", found[2], "out.json").code == 0
    assert run("posture", source, "--frame", 1, "--clip", found[2].rpartition("/")[2], "-o", "A.json").code == 0
