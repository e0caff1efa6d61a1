"""Kills, full disks and Ctrl-C: at no moment is more lost than the edit that is on its way."""

from __future__ import annotations

import http.client
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import pytest
from command_line import Run
from studio_server import ROOT, running

from motionmind.cli import warming
from motionmind.errors import MotionMindError
from motionmind.studio.edits import Insert
from motionmind.studio.project import Project
from motionmind.tween.engine import Engine

pytestmark = pytest.mark.long

_Found = TypeVar("_Found")
_MOST = 400  # MB that a server with one worker takes

# For each line that it reads, forks a writer, which begins with what has been imported: it says its number and how many
# blocks there are, appends edits as fast as it can, and says the number of each once it is on disk.
WRITERS = """
import os, sys
from pathlib import Path
from motionmind.studio.edits import Insert
from motionmind.studio.project import Project

def say(line):
    os.write(1, f"{line}\\n".encode())  # in one call, so that no kill leaves a line without its end

def write(path):
    project = Project.open(path)
    say(os.getpid())
    say(len(project.state.blocks))
    for number in range(len(project.state.used), 100_000):
        project.edit("w1", Insert(f"b{number}", "ballet/adagio", 0, 9))
        say(number + 1)

for _ in sys.stdin:
    if (writer := os.fork()) == 0:
        write(Path(sys.argv[1]))
        os._exit(0)
    os.waitpid(writer, 0)
    say("ended")
"""


def test_a_kill_loses_at_most_the_edit_in_flight(tmp_path: Path) -> None:
    path, rng = tmp_path / "piece.motionmind", random.Random(1)
    Project.create(path, "ballet").close()
    with subprocess.Popen(
        [sys.executable, "-c", WRITERS, str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    ) as writers:
        assert writers.stdin is not None
        assert writers.stdout is not None
        for _ in range(12):
            writers.stdin.write("another\n")
            writers.stdin.flush()
            writer, *said = [writers.stdout.readline() for _ in range(5)]  # what was there, and three edits more
            time.sleep(0.05 * rng.random())  # dozens of edits: more only make the file long to read
            os.kill(int(writer), signal.SIGKILL)
            while (line := writers.stdout.readline()) != "ended\n":
                said.append(line)
            written = int(said[-1])
            project = Project.open(path)
            names = [block.id for block in project.state.blocks]
            project.close()
            assert names == [f"b{number}" for number in range(len(names))]
            assert len(names) in (written, written + 1)
    assert len(names) > 20


def test_a_server_that_is_killed_has_all_that_it_answered(tmp_path: Path) -> None:
    path, answered = tmp_path / "piece.motionmind", 0
    for _ in range(2):
        with running(path, home=tmp_path) as (process, client):
            assert len(client.project()["piece"]["blocks"]) in (answered, answered + 1)
            answered = len(client.project()["piece"]["blocks"])
            before = answered
            with suppress(OSError, http.client.HTTPException):
                while True:
                    client.insert(f"b{answered}", "ballet/adagio", 0, 9)
                    answered += 1
                    if answered == before + 3:  # by then it answers at its usual speed, on a busy machine, too
                        threading.Timer(0.1, process.kill).start()
    project = Project.open(path)
    assert len(project.state.blocks) in (answered, answered + 1)
    project.close()
    assert answered > 5


def test_workers_end_with_the_server_that_was_killed(tmp_path: Path) -> None:
    with running(tmp_path / "piece.motionmind", home=tmp_path) as (process, client):
        ends = {"a": {"key": "ballet/arabesque"}, "b": {"key": "ballet/fifth"}}
        assert client.wait_for(client.post("/api/between", ends)["job"])["state"] == "done"
        workers = _until(lambda: [worker for child in _children(process.pid) for worker in _children(child)])
        # The server, the process that workers are forked from, and the worker that searched.
        kept = sum(map(_memory, [process.pid, *_children(process.pid)])) + max(map(_memory, workers))
        assert kept < _MOST
        assert workers
        begun = [*_children(process.pid), *workers]
        assert all(b"multiprocessing" in _command(one) for one in begun)
        process.kill()
        process.wait()
        assert _until(lambda: not any(b"multiprocessing" in _command(one) for one in begun))


@pytest.mark.parametrize("pause", [0.0, 0.5])
def test_ctrl_c_ends_it_at_once_though_windows_listen(tmp_path: Path, pause: float) -> None:
    with running(tmp_path / "piece.motionmind", home=tmp_path) as (process, client), client.listening() as events:
        next(events)
        time.sleep(pause)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
        assert process.returncode == 130
        assert "Traceback" not in out + err


@pytest.mark.skipif(sys.platform == "win32", reason="limits of files' sizes are POSIX")
def test_on_a_full_disk_an_edit_is_refused_in_a_line_and_the_project_stays_whole(tmp_path: Path) -> None:
    import resource

    path = tmp_path / "piece.motionmind"
    project = Project.create(path, "ballet")
    project.edit("w1", Insert("b0", "ballet/adagio", 0, 9))
    whole, state = path.read_bytes(), project.state
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    for room in (0, 1, 30):  # bytes that are free
        handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (len(whole) + room, hard))
        try:
            with pytest.raises(MotionMindError, match=r"not done: piece\.motionmind cannot be written") as error:
                project.edit("w1", Insert("b1", "ballet/adagio", 0, 9))
            with pytest.raises(MotionMindError, match="not done"):
                project.undo("w1")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
            signal.signal(signal.SIGXFSZ, handler)
        assert "\n" not in str(error.value)
        assert (path.read_bytes(), project.state) == (whole, state)
    project.edit("w1", Insert("b1", "ballet/adagio", 0, 9))
    project.undo("w1")
    project.close()
    again = Project.open(path)
    assert [block.id for block in again.state.blocks] == ["b0"]
    again.close()


def test_errors_of_the_command_are_one_line(tmp_path: Path, run: Run) -> None:
    other = tmp_path / "other.motionmind"
    other.write_text("no project\n")
    with running(tmp_path / "piece.motionmind", home=tmp_path / "home") as (_, client):
        port = client.url.rpartition(":")[2]
        for arguments, words in (
            ((other,), "not a studio project"),
            (
                (tmp_path / "new.motionmind", "--port", port),
                f"cannot listen at 127.0.0.1:{port}: address already in use",
            ),
            ((tmp_path / "new.motionmind", "--corpus", "nothing"), "no corpus 'nothing'"),
            ((tmp_path / "nowhere" / "new.motionmind",), "no such file or directory"),
            ((tmp_path / "missing.bvh",), "there is no such file"),
        ):
            code, _, err = run("studio", "--no-browser", *arguments)
            assert (code, err.count("\n")) == (2, 1), err
            assert words in err.lower() or words in err
    assert not (tmp_path / "new.motionmind").exists()


def test_it_says_at_once_that_it_compiles_first(tmp_path: Path) -> None:
    places = {"PYTHONPATH": str(ROOT), "MOTIONMIND_HOME": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "code")}
    compiled = tmp_path / "code/compiled"
    compiled.mkdir(0o700, parents=True)
    command = [sys.executable, "-m", "motionmind", "studio", "--no-browser", str(tmp_path / "piece.motionmind")]
    # The lock says that another process compiles: so the studio starts none that would outlive it.
    with (
        warming._alone(compiled),
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ | places
        ) as process,
    ):
        assert process.stderr is not None
        first = process.stderr.readline()
        process.kill()
        process.communicate()
    assert "preparing in the background" in first


FIRST_PICTURES = """
import hashlib, json, sys
from pathlib import Path
from studio_server import serving
from motionmind.codecache import compiled_names
from motionmind.jit import interpreted
from motionmind.studio.project import Project
from motionmind.studio.studio import Studio
from motionmind.studio.workers import Workers

Workers.begin = lambda self: None  # workers may compile
if sys.argv[2] == "cold":
    Studio.previewing = lambda self: interpreted()
with serving(Project.create(Path(sys.argv[1]), "ballet")) as client:
    client.project()
    (ballet,) = client.get("/api/gallery")["corpora"]
    said = json.dumps([client.get("/api/movements/" + one["key"]) for one in ballet["postures"]]).encode()
    for one in ballet["postures"]:
        said += client.send("GET", f"/api/thumbnails/{one['key']}/0.png?height=96").body
    print(len(compiled_names()), hashlib.sha256(said).hexdigest())
"""


def test_the_first_pictures_need_no_compiled_code_and_are_the_same_bytes(tmp_path: Path) -> None:
    Engine.load("ballet")  # what is learned from it is kept
    said = []
    for state, code in (("warm", ""), ("cold", str(tmp_path / "code"))):
        places = {"PYTHONPATH": os.pathsep.join(map(str, (ROOT, ROOT / "tests", ROOT / "tests" / "studio")))}
        ran = subprocess.run(
            [sys.executable, "-c", FIRST_PICTURES, str(tmp_path / f"{state}.motionmind"), state],
            capture_output=True,
            text=True,
            check=True,
            env=os.environ | places | {"MOTIONMIND_HOME": str(tmp_path)} | ({"NUMBA_CACHE_DIR": code} if code else {}),
        )
        said.append(ran.stdout.split())
    (warm, cold) = said
    assert int(warm[0]) > 0
    assert int(cold[0]) == 0
    assert warm[1] == cold[1]


def test_it_says_where_the_extra_is_missing(tmp_path: Path) -> None:
    (tmp_path / "starlette.py").write_text("raise ImportError('no starlette')")
    ran = subprocess.run(
        [sys.executable, "-m", "motionmind", "studio", "--no-browser", str(tmp_path / "piece.motionmind")],
        capture_output=True,
        text=True,
        timeout=60,
        env=os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}", "MOTIONMIND_HOME": str(tmp_path)},
        check=False,
    )
    assert (ran.returncode, ran.stderr.count("\n")) == (2, 1)
    assert 'pip install "motionmind[studio]"' in ran.stderr


def test_a_movement_begins_a_project_beside_it(tmp_path: Path) -> None:
    score = tmp_path / "bends.score"
    score.write_text(
        "title  Two bends\nbody   human23\nlegs\n  stand = stand out 10 turn 8\n  bend = stand out 10 turn 8, bend 30\n"
        "clip one: Down\n  start | stand\n  1     | bend\nclip two: Up\n  start | bend\n  1     | stand\n"
    )
    for _ in range(2):  # the second time it goes on
        with running(score, home=tmp_path) as (_, client):
            blocks = client.project()["piece"]["blocks"]
            assert [block["title"] for block in blocks] == ["one", "two"]
    assert (tmp_path / "bends.motionmind").is_file()


def _children(process: int) -> list[int]:
    try:
        tasks = Path(f"/proc/{process}/task")
        return [int(word) for task in tasks.iterdir() for word in (task / "children").read_text().split()]
    except OSError:
        return []


def _memory(process: int) -> float:
    """The memory that a process takes, its share of what it shares included, MB."""
    told = Path(f"/proc/{process}/smaps_rollup").read_text()
    return next(int(line.split()[1]) for line in told.splitlines() if line.startswith("Pss:")) / 1000


def _command(process: int) -> bytes:
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes()
    except OSError:
        return b""


def _until(found: Callable[[], _Found], seconds: float = 15.0) -> _Found:
    """Wait until something is found, and return it."""
    end = time.monotonic() + seconds
    while not (value := found()) and time.monotonic() < end:
        time.sleep(0.05)
    return value
