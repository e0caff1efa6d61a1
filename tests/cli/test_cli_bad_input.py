"""Answers to bad input, and files that stay as they are."""

from __future__ import annotations

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest
from cli_files import ARABESQUE, BALLET, FIFTH, clip, files_under
from command_line import Run

from motionmind.formats import read_motion, write_motion
from motionmind.geometry import rotations as rot

TWEEN = "tween A.json B.json --corpus ballet -o tween.bvh"
BUILD = "corpus build mine clip.bvh"
BAD = [
    # what is there to read
    ("tween nan.json B.json --corpus ballet -o t.bvh", r"nan\.json:\d+: NaN is not a number"),
    ("tween zero.json B.json --corpus ballet -o t.bvh", r"zero\.json: the rotation of left_hip is zero"),
    ("tween missing.json B.json --corpus ballet", r"missing\.json: rotations: no left_hip"),
    ("tween A.json binary.json --corpus ballet", r"binary\.json:1: not valid JSON"),
    ("tween A.json empty.bvh --corpus ballet", r"empty\.bvh:1: not a BVH file"),
    ("tween A.json folder --corpus ballet", r"folder: is a folder, and no corpus"),
    ("tween A.json nowhere.json --corpus ballet", r"nowhere\.json: cannot be read: there is no such file"),
    ("tween A.json clip.bvh --corpus ballet", r"clip\.bvh: \d+ frames, where one posture was expected"),
    ("tween stranger.bvh B.json --corpus ballet", r"posture A is on another skeleton than corpus 'ballet': "),
    ("posture clip.bvh --frame 9999 -o t.json", r"clip\.bvh: frames are 0 to \d+, there is no frame 9999"),
    ("posture empty.bvh --frame 0 -o t.json", r"empty\.bvh:1: not a BVH file"),
    ("convert cut.bvh t.json", r"cut\.bvh:\d+: "),
    ("convert binary.bvh t.json", r"binary\.bvh:1: not a BVH file"),
    ("convert stranger.bvh t.json --skeleton human23", r"stranger"),
    ("convert clip.xyz t.json", r"suffix '\.xyz' is unknown; files that can be read end in \.json, \.bvh"),
    # corpora
    ("tween A.json B.json --corpus nobody", r"no corpus 'nobody'; there are ballet"),
    ("corpus info balet", r"no corpus 'balet'; did you mean ballet\?"),
    ("tween ballet/arabesque ballet/fifth --unit m", r"--unit is only for motion files, and no posture here is in one"),
    ("tween clip.bvh@0 clip.bvh@1 --corpus ballet --unit parsec", r"unit 'parsec' is unknown; give one of cm, m"),
    ("tween clip.bvh@0 clip.bvh@1 --corpus ballet --joints broken.toml", r"broken\.toml: not a joint mapping"),
    (f"{TWEEN} --up x", r"'--up': 'x' is not one of 'y', 'z'"),
    (f"{TWEEN} --pin left_hop", r"no joint 'left_hop' among the states; did you mean left_hip\?"),
    (f"{TWEEN} --avoid lft_hip=3", r"no joint 'lft_hip' among the states; did you mean left_hip\?"),
    ("vary ballet/jump --attractor rosler -o t.json", r"no flow 'rosler'; did you mean rossler\?"),
    ("vary ballet/jump --parameter roh=3 -o t.json", r"lorenz has no parameter 'roh'; did you mean rho\?"),
    (f"{BUILD} --discretize balet", r"no library 'balet'; did you mean ballet\?"),
    ("corpus info nobody", r"no corpus 'nobody'; there are ballet"),
    ("corpus list --home A.json", r"'A\.json' is a file"),
    ("corpus build mine", r"Missing argument 'FILES\.\.\.'"),
    ("corpus build mine one.json", r"no recording holds two postures"),
    ("corpus build mine clip.bvh cut.bvh --strict-files", r"cut\.bvh:\d+: "),
    (
        "corpus build mine clip.bvh stranger.bvh --strict-files",
        r"stranger\.bvh: is on another skeleton than clip\.bvh: ",
    ),
    ("corpus build mine clip.bvh folder", r"'folder' is a directory"),
    ("corpus build mine clip.bvh ./clip.bvh", r"clip\.bvh: given twice"),
    ("corpus build ballet clip.bvh", r"'ballet' is the name of a bundled corpus"),
    ("corpus build a/b clip.bvh", r"'a/b' cannot be a corpus's name"),
    (f"{BUILD} --rate -5", r"'--rate': -5\.0 is not in the range"),
    (f"{BUILD} --rate 0.01", r"no recording holds two postures at 0\.01 postures a second"),
    (f"{BUILD} --skip 9999", r"skipping 9999 leaves none"),
    (f"{BUILD} --skip -1", r"'--skip': -1 is not in the range"),
    (f"{BUILD} --tolerance some", r"--tolerance some: give degrees, or JOINT=DEGREES"),
    (f"{BUILD} --tolerance left_hip=", r"--tolerance left_hip=: give degrees, or JOINT=DEGREES"),
    (f"{BUILD} --tolerance =5", r"--tolerance =5: give degrees, or JOINT=DEGREES"),
    (f"{BUILD} --tolerance -3", r"tolerance in degrees must be a number from"),
    (f"{BUILD} --tolerance nan", r"tolerance in degrees must be a number from"),
    (f"{BUILD} --tolerance left_hop=5", r"no joint 'left_hop'.*; did you mean left_hip\?"),
    (f"{BUILD} --discretize nobody", r"no library 'nobody'; .*bundled are ballet, human23"),
    (f"{BUILD} --discretize broken.toml", r"broken\.toml: not TOML"),
    (f"{BUILD} --joints broken.toml", r"broken\.toml: not a joint mapping"),
    (f"{BUILD} --unit parsec", r"unit 'parsec' is unknown; give one of cm, m"),
    (f"{BUILD} --flip-angle nan", r"'--flip-angle': nan is not a finite number"),
    (f"{BUILD} --home A.json/home", r"cannot be written"),
    ("corpus check ballet --pairs 0", r"'--pairs': 0 is not in the range"),
    # what is there to write
    ("tween A.json B.json --corpus ballet -o nowhere/t.bvh", r"nowhere/t\.bvh: cannot be written: there is no folder"),
    ("tween A.json B.json --corpus ballet -o folder", r"'folder' is a directory"),
    ("tween A.json B.json --corpus ballet -o t.xyz", r"t\.xyz: cannot be written: the name must end in one of \.json,"),
    ("tween A.json B.json --corpus ballet --report nowhere/r", r"nowhere/r: cannot be written: there is no folder"),
    ("tween A.json B.json --corpus ballet --problem t.txt", r"t\.txt: cannot be written: the name must end in .*cfn"),
    ("tween A.json B.json --corpus ballet -o t.json --report t.json", r"t\.json: .*: it would be written twice"),
    ("posture clip.bvh --frame 0 -o t.xyz", r"t\.xyz: cannot be written"),
    ("convert clip.bvh t.amc", r"t\.amc: cannot be written: the name must end in one of \.bvh, \.json, \.txt"),
    ("convert clip.bvh nowhere/t.json", r"nowhere/t\.json: cannot be written: there is no folder"),
    # options
    (f"{TWEEN} --moves 0", r"'--moves': '0' is neither a number of moves such as 8"),
    (f"{TWEEN} --max-moves 0", r"'--max-moves': 0 is not in the range x>=1"),
    (f"{TWEEN} --node-budget 0", r"'--node-budget': 0 is not in the range x>=1"),
    (f"{TWEEN} --lambda nan", r"'--lambda': nan is not a finite number"),
    (f"{TWEEN} --beta -1", r"'--beta': -1\.0 is not in the range 0<=x<=1000000\.0"),
    (f"{TWEEN} --tau inf", r"'--tau': inf is not in the range"),
    (f"{TWEEN} --fps 0", r"'--fps': 0\.0 is not in the range"),
    (f"{TWEEN} --fps 1e12", r"'--fps': 1000000000000\.0 is not in the range"),
    (f"{TWEEN} --weights heavy", r"'--weights': 'heavy' is not one of 'conditional', 'printed'"),
    (f"{TWEEN} --foo", r"No such option"),
    ("tween A.json", r"Missing argument 'B'\. \(motionmind tween --help shows how\)"),
    ("tween A.json B.json", r"Missing option '--corpus': neither A nor B .* Corpora: (.+, )?ballet, hands, "),
    ("measure clip.bvh", r"Missing option '--corpus'. Corpora: (.+, )?ballet, hands, "),
    ("dance", r"No such command 'dance'"),
]


@pytest.fixture(scope="module")
def bad_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of files, good ones and bad ones."""
    folder = tmp_path_factory.mktemp("bad")
    (folder / "folder").mkdir()
    posture = json.loads(ARABESQUE.read_text("utf-8"))
    turns = posture["rotations"]
    others = {name: turn for name, turn in turns.items() if name != "left_hip"}
    for name, rotations in {
        "A": turns,
        "nan": {**turns, "left_hip": [float("nan"), 0.0, 0.0, 1.0]},
        "zero": {**turns, "left_hip": [0.0, 0.0, 0.0, 0.0]},
        "missing": others,
    }.items():
        (folder / f"{name}.json").write_text(json.dumps({**posture, "rotations": rotations}), "utf-8")
    (folder / "B.json").write_bytes(FIFTH.read_bytes())
    (folder / "one.json").write_bytes(FIFTH.read_bytes())
    for name in ("binary.json", "binary.bvh"):
        (folder / name).write_bytes(bytes(range(256)) * 9)
    (folder / "empty.bvh").touch()
    (folder / "broken.toml").write_text("hip = [", "utf-8")
    motion = clip()
    write_motion(folder / "clip.bvh", motion)
    text = (folder / "clip.bvh").read_text("utf-8")
    (folder / "cut.bvh").write_text(text[: len(text) - 40], "utf-8")
    names = tuple(f"J{i}" for i in range(len(motion.skeleton)))
    stranger = replace(motion.slice(0, 1), skeleton=replace(motion.skeleton, name="stranger", names=names))
    write_motion(folder / "stranger.bvh", stranger)
    return folder


@pytest.mark.parametrize(("line", "message"), BAD, ids=[line for line, _ in BAD])
def test_bad_input_is_one_line_and_leaves_nothing(
    line: str, message: str, run: Run, bad_files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(bad_files)
    monkeypatch.setenv("MOTIONMIND_HOME", str(bad_files / "home"))
    before = files_under(bad_files)
    ran = run(*line.split())
    assert ran.code == 2
    assert ran.out == ""
    errors = [text for text in ran.err.splitlines() if not text.startswith("note: ")]
    assert len(errors) == 1
    assert errors[0].startswith("error: ")
    assert re.search(message, errors[0])
    assert files_under(bad_files) == before


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="the administrator may write everywhere")
def test_a_folder_without_permission(run: Run, tmp_path: Path) -> None:
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    ran = run("tween", ARABESQUE, FIFTH, "--corpus", "ballet", "-o", "locked/tween.bvh")
    assert (ran.code, ran.err) == (2, "error: locked/tween.bvh: cannot be written: not permitted\n")


# --- files are safe ---------------------------------------------------------------------------------------------------


def test_what_is_read_is_not_written_over(run: Run, tmp_path: Path) -> None:
    write_motion(tmp_path / "clip.bvh", clip())
    before = files_under(tmp_path)
    (tmp_path / "down").mkdir()
    done = run("convert", "clip.bvh", "down/../clip.bvh")
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "it is read from" in done.err
    (tmp_path / "down").rmdir()
    assert files_under(tmp_path) == before


def test_one_file_under_two_names_is_not_written_twice(run: Run, tmp_path: Path) -> None:
    posture = BALLET / "postures" / "fifth.json"
    done = run("tween", posture, posture, "--corpus", "ballet", "-o", "a.json", "--report", tmp_path / "a.json")
    assert done.code == 2
    assert "written twice" in done.err
    assert not (tmp_path / "a.json").exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full to write to in vain")
def test_outputs_are_written_all_or_none(run: Run, tmp_path: Path) -> None:
    posture = BALLET / "postures" / "fifth.json"
    done = run("tween", posture, posture, "--corpus", "ballet", "-o", "a.bvh", "--report", "/dev/full")
    assert done.code == 2
    assert not (tmp_path / "a.bvh").exists()
    assert Path("/dev/full").exists()


def test_the_papers_two_forms_and_their_rate(run: Run) -> None:
    write_motion("clip.bvh", clip())
    assert run("convert", "clip.bvh", "braces.txt").code == 0
    done = run("convert", "clip.bvh", "lines.txt", "--form", "lines")
    assert done.code == 0
    assert "no place for where the body is" in done.err
    assert "{" in Path("braces.txt").read_text()
    assert "{" not in Path("lines.txt").read_text()
    for name in ("braces", "lines"):
        assert run("convert", f"{name}.txt", f"{name}.json").code == 0
        again = read_motion(f"{name}.json")
        assert len(again) == len(clip())
        assert again.fps == pytest.approx(30.0)
        assert float(rot.angle(again.rotations, clip().rotations).max()) < 1e-6
