"""A pipe is read as a file is, as often as a command needs it; a terminal is refused."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from bounded_runs import ROOT

import motionmind
from motionmind.body.human import human23
from motionmind.errors import FormatError
from motionmind.files import pipes_kept, read_bytes
from motionmind.formats import read_motion

POSTURES = Path(motionmind.__file__).parents[1] / "corpora" / "ballet" / "postures"

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes")


def run(arguments: Sequence[object], given: dict[Path, Path], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the command line while other processes write files into pipes, once each."""
    for pipe in given:
        os.mkfifo(pipe)
    writers = [subprocess.Popen(["sh", "-c", 'cat "$0" > "$1"', source, pipe]) for pipe, source in given.items()]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "MOTIONMIND_HOME": str(folder / "home")}
    command = [sys.executable, "-m", "motionmind", *map(str, arguments)]
    try:
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=60)
    finally:
        for writer in writers:
            writer.kill()
            writer.wait()


@pytest.mark.parametrize("name", ["out.bvh", "out.json"])
def test_a_pipe_is_converted(name: str, tmp_path: Path) -> None:
    pipe, out = tmp_path / "pipe.json", tmp_path / name
    done = run(["convert", pipe, out], {pipe: POSTURES / "fifth.json"}, tmp_path)
    assert done.returncode == 0, done
    assert read_motion(out).skeleton.difference(read_motion(POSTURES / "fifth.json").skeleton) is None


def test_two_pipes_make_a_tween(tmp_path: Path) -> None:
    a, b, out = tmp_path / "a.json", tmp_path / "b.json", tmp_path / "out.json"
    given = {a: POSTURES / "fifth.json", b: POSTURES / "arabesque.json"}
    done = run(["tween", a, b, "--corpus", "ballet", "--moves", 4, "-o", out], given, tmp_path)
    assert done.returncode == 0, done
    from_files = tmp_path / "from_files.json"
    done = run(["tween", *given.values(), "--corpus", "ballet", "--moves", 4, "-o", from_files], {}, tmp_path)
    assert done.returncode == 0, done
    assert out.read_bytes() == from_files.read_bytes()


def test_a_mapping_of_joints_comes_from_a_pipe(tmp_path: Path) -> None:
    mapping, pipe = tmp_path / "joints.json", tmp_path / "pipe.json"
    mapping.write_text(json.dumps({name: name for name in human23().names}))
    done = run(["convert", POSTURES / "fifth.json", tmp_path / "o.json", "--joints", pipe], {pipe: mapping}, tmp_path)
    assert done.returncode == 0, done


def test_without_the_context_a_pipe_gives_what_is_in_it_now(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)

    def feed(text: str) -> None:
        writer = subprocess.Popen(["sh", "-c", f'echo {text} > "$0"', pipe])
        found.append(read_bytes(pipe))
        writer.wait()

    found: list[bytes] = []
    feed("one")
    feed("two")
    with pipes_kept():
        feed("three")
        found.append(read_bytes(pipe))
    assert found == [b"one\n", b"two\n", b"three\n", b"three\n"]


def test_a_terminal_is_refused(tmp_path: Path) -> None:
    main, terminal = os.openpty()
    try:
        link = tmp_path / "clip.bvh"
        link.symlink_to(os.ttyname(terminal))
        with pytest.raises(FormatError, match=r"clip\.bvh: cannot be read: it is a terminal$"):
            read_motion(link)
    finally:
        os.close(main)
        os.close(terminal)
