"""The movement and its report appear together or not at all, and can be told to belong together."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from command_line import Run
from faults import failing_at

import motionmind
from motionmind import files
from motionmind.errors import MotionMindError
from motionmind.tween.engine import Engine

ROOT = Path(motionmind.__file__).parents[1]
POSTURES = ROOT / "corpora" / "ballet" / "postures"
TWEEN = ("tween", POSTURES / "arabesque.json", POSTURES / "fifth.json", "--corpus", "ballet", "--moves", 4)
OUTPUTS = ("-o", "out.json", "--report", "report.json", "--problem", "problem.cfn")


@pytest.fixture(autouse=True)
def _nothing_else_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep no compiled code, for faults are to hit the command's own files."""
    monkeypatch.setattr("motionmind.codecache.replace_file", lambda *_: None)
    Engine.load("ballet")  # learned, and kept, once


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
@pytest.mark.parametrize(("owner", "name"), [(files.os, "fdopen"), (files.os, "fsync"), (Path, "replace")])
def test_an_error_or_ctrl_c_while_files_are_written_leaves_none_of_them(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, owner: Any, name: str, error: BaseException
) -> None:
    for number in count(1):
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, failing_at(number, getattr(owner, name), error))
            ran = run(*TWEEN, *OUTPUTS)
        if ran.code == 0:
            break
        assert ran.code == (2 if isinstance(error, OSError) else 130)
        assert contents(tmp_path) == {}
    assert number > 3
    assert contents(tmp_path).keys() == {"out.json", "report.json", "problem.cfn"}


def test_files_that_were_there_stay_when_the_new_ones_cannot_be_written(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(*TWEEN, *OUTPUTS).code == 0
    before = contents(tmp_path)
    full = OSError(errno.ENOSPC, "No space left on device")
    for number in (1, 2, 3):
        with monkeypatch.context() as patch:
            patch.setattr(files.os, "fsync", failing_at(number, os.fsync, full))
            assert run(*TWEEN, "--tau", 2, *OUTPUTS).code == 2
        assert contents(tmp_path) == before


def test_alternatives_and_variations_are_written_together_too(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = OSError(errno.ENOSPC, "No space left on device")
    vary = ("vary", ROOT / "corpora" / "ballet" / "barre.score", "--clip", "plies")
    for words, number in (((*TWEEN, "--alternatives", 2), 4), (vary, 2)):
        with monkeypatch.context() as patch:
            patch.setattr(files.os, "fsync", failing_at(number, os.fsync, full))
            ran = run(*words, "-o", "out.json", "--report", "report.json")
        assert (ran.code, "No space left" in ran.err or "no space left" in ran.err) == (2, True), ran.err
        assert contents(tmp_path) == {}


def test_a_report_holds_the_hash_of_its_motion(run: Run, tmp_path: Path) -> None:
    for output in ("out.json", "out.bvh", "out.svg"):
        assert run(*TWEEN, "-o", output, "--report", "report.json").code == 0
        report = json.loads((tmp_path / "report.json").read_bytes())
        assert report["motion_sha256"] == hashlib.sha256((tmp_path / output).read_bytes()).hexdigest()
    assert run(*TWEEN, "--report", "report.json").code == 0
    assert json.loads((tmp_path / "report.json").read_bytes())["motion_sha256"] is None
    assert run(*TWEEN, "--report", "-").json["motion_sha256"] is None
    assert run(*TWEEN, "--alternatives", 2, "-o", "out.json", "--report", "report.json").code == 0
    for number in (1, 2):
        report = json.loads((tmp_path / f"report-{number}.json").read_bytes())
        assert report["motion_sha256"] == hashlib.sha256((tmp_path / f"out-{number}.json").read_bytes()).hexdigest()


def test_a_printed_report_holds_the_hash_of_its_motion_too(run: Run, tmp_path: Path) -> None:
    report = run(*TWEEN, "-o", "out.json", "--report", "-").json
    assert report["motion_sha256"] == hashlib.sha256((tmp_path / "out.json").read_bytes()).hexdigest()


@pytest.mark.parametrize("way", [["--report", "-"], ["--json"]])
def test_a_printed_report_of_a_variation_holds_the_hash_of_its_file(run: Run, tmp_path: Path, way: list[str]) -> None:
    report = run("vary", "ballet/jump", "-o", "variation.json", "--nudge", 5, *way).json
    written = (tmp_path / "variation.json").read_bytes()
    assert report["motion_sha256"] == hashlib.sha256(written).hexdigest()
    assert run("review", "variation.json", "--list", "--json").json["motion_sha256"] is None  # nothing is written
    report = run("review", "variation.json", "--cut", "0..1", "--paste", 3, "-o", "cut.json", "--json").json
    assert report["motion_sha256"] == hashlib.sha256((tmp_path / "cut.json").read_bytes()).hexdigest()


def test_a_file_is_written_at_once_outside_and_together_inside(tmp_path: Path) -> None:
    (tmp_path / "old").write_bytes(b"old")
    with files.all_or_none() as written:
        for name in ("old", "new"):
            files.write_atomically(tmp_path / name, b"new")
        assert (tmp_path / "old").read_bytes() == b"old"
        assert not (tmp_path / "new").exists()
        assert files.sha256_of(written, tmp_path / "new") == hashlib.sha256(b"new").hexdigest()
    assert contents(tmp_path) == {"old": b"new", "new": b"new"}
    files.write_atomically(tmp_path / "at once", b"")
    assert (tmp_path / "at once").exists()


def test_a_file_whose_place_became_a_folder_is_an_error_and_leaves_no_other(tmp_path: Path) -> None:
    def write() -> None:
        with files.all_or_none():
            files.write_atomically(tmp_path / "one", b"")
            files.write_atomically(tmp_path / "two", b"")
            (tmp_path / "two").mkdir()

    with pytest.raises(MotionMindError, match="two: cannot be written: is a directory"):
        write()
    assert [path.name for path in tmp_path.iterdir()] == ["two"]


@pytest.mark.skipif(not shutil.which("strace"), reason="there is no strace")
def test_a_kill_at_any_move_leaves_whole_files_and_the_next_run_cleans_up(tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from motionmind import files\n"
        "with files.all_or_none():\n"
        "    for name in ('one', 'two'): files.write_atomically(Path(sys.argv[1]) / name, b'new')"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    for call in ("rename", "write", "fsync"):
        for number in count(1):
            for name in ("one", "two"):
                (tmp_path / name).write_bytes(b"old")
            tracer = ["strace", "-f", "-o", os.devnull, "-e", f"inject={call}:signal=KILL:when={number}"]
            command = [*tracer, "-e", f"trace={call}", sys.executable, "-c", program, str(tmp_path)]
            done = subprocess.run(command, env=environment, capture_output=True, check=False)
            assert {(tmp_path / name).read_bytes() for name in ("one", "two")} <= {b"old", b"new"}
            for temporary in tmp_path.glob(".motionmind-*"):
                os.utime(temporary, (time.time() - 120.0,) * 2)
            if done.returncode == 0:
                break
        assert number > 2
    files.write_atomically(tmp_path / "one", b"")
    assert sorted(contents(tmp_path)) == ["one", "two"]


def test_ctrl_c_before_the_search_leaves_nothing(tmp_path: Path) -> None:
    words = [str(word) for word in (*TWEEN, *OUTPUTS)]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    for delay in (0.05, 0.3, 0.6):
        with subprocess.Popen(
            [sys.executable, "-m", "motionmind", *words], cwd=tmp_path, env=environment, stderr=subprocess.DEVNULL
        ) as process:
            time.sleep(delay)
            process.send_signal(signal.SIGINT)
        assert contents(tmp_path).keys() in (set(), {"out.json", "report.json", "problem.cfn"})
