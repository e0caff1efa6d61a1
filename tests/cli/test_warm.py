"""Compiling ahead of time: everything is reached, and whoever waits is told for what."""

from __future__ import annotations

import functools
import io
import re
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from time import sleep
from types import FunctionType, ModuleType
from typing import Any

import pytest
from bundled_clips import ballet_clip
from command_line import Run
from numba.core.registry import CPUDispatcher

from motionmind import codecache
from motionmind.cli import changes, corpora, warming
from motionmind.errors import MotionMindError
from motionmind.formats import write_motion
from motionmind.tween.engine import Engine

pytestmark = pytest.mark.long


def dispatchers() -> dict[str, Any]:
    """All functions that are compiled, of the modules that are loaded, by name."""
    found = {}
    for name, module in list(sys.modules.items()):
        if name.startswith("motionmind."):
            for thing in list(vars(module).values()):
                if isinstance(thing, CPUDispatcher):
                    package, stem = thing.py_func.__module__.split(".")[1:3]
                    found[f"{package}/{stem}.{thing.py_func.__name__}"] = thing
    return found


def names_called(function: FunctionType) -> set[str]:
    """The compiled functions that one calls, itself among them: they are compiled with it."""
    found, left = set(), [function]
    while left:
        one = left.pop()
        named = [one.__globals__.get(name) for name in one.__code__.co_names]
        modules = [
            thing for thing in named if isinstance(thing, ModuleType) and thing.__name__.startswith("motionmind.")
        ]
        named += [getattr(module, name, None) for module in modules for name in one.__code__.co_names]
        for other in [thing.py_func for thing in named if isinstance(thing, CPUDispatcher)] + [one]:
            package, stem = other.__module__.split(".")[1:3]
            if (name := f"{package}/{stem}.{other.__name__}") not in found:
                found.add(name)
                left.append(other)
    return found


def reach_everything() -> None:
    """Check that what is compiled ahead is all that there is to compile, in a process that has compiled nothing."""
    for work in (
        warming.turn,
        warming.search,
        warming.synthesise,
        warming.film,
        warming.learn,
        warming.draw,
        warming.seek,
    ):
        work()
    reached = {name for one in dispatchers().values() if one.overloads for name in names_called(one.py_func)}
    assert codecache.decorated_names() - reached == set()


def compile_ahead_of_learning() -> None:
    """Check that learning calls what is compiled before a corpus is learned, in a process that has compiled nothing."""
    warming.turn()
    ahead = {name: set(one.overloads) for name, one in dispatchers().items() if one.overloads}
    Engine.fit(map(ballet_clip, ("adagio", "jump", "plies")))
    assert {"walks/means.mean_rotations", "geometry/charts._write_curve"} <= set(ahead)
    assert {name: set(one.overloads) for name, one in dispatchers().items() if name in ahead} == ahead


@pytest.mark.parametrize("check", [reach_everything, compile_ahead_of_learning])
def test_what_is_compiled_is_what_is_called(check: Callable[[], None]) -> None:
    # In a process of its own: here other tests have reached some.
    code = f"import sys; sys.path[:] = {sys.path!r}; import {__name__}; {__name__}.{check.__name__}()"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with a copy of what is compiled, of which a test may take away what others would compile again."""
    place = codecache.place_of_code()
    assert place is not None
    folder = tmp_path / "cache"
    (folder / place.name).mkdir(0o700, parents=True)
    for one in [*codecache._folders(), *place.glob("all-*")]:  # not what earlier states of the sources have left
        copy = shutil.copytree if one.is_dir() else shutil.copy
        copy(one, folder / place.name / one.name)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    codecache._folder.cache_clear()
    yield folder / place.name
    codecache._folder.cache_clear()


def test_warm_says_what_it_did_and_does_nothing_a_second_time(run: Run, own_cache: Path) -> None:
    for note in own_cache.glob("all-*"):
        note.unlink()
    done = run("warm")
    assert done.code == 0
    assert done.out.startswith(f"compiled {len(codecache.decorated_names())} functions in ")
    assert codecache.decorated_names() == codecache.compiled_names()
    done = run("warm")
    assert (done.code, done.out) == (
        0,
        f"nothing to do: all {len(codecache.decorated_names())} functions are compiled\n",
    )


# From a posture to itself there is no move to search for, and so nothing is compiled while a test waits.
STILL = ["tween", "ballet/fifth", "ballet/fifth", "-o", "still.json"]


def command(*words: str) -> list[str]:
    return [sys.executable, "-m", "motionmind", *words]


def wait_until(is_so: Callable[[], bool]) -> None:
    """Wait for another process, a minute at most."""
    for _ in range(600):
        if is_so():
            return
        sleep(0.1)
    raise AssertionError("it never was")


def test_the_first_run_prepares_in_the_background_and_says_so_until_all_is_compiled(
    tmp_path: Path, own_cache: Path
) -> None:
    def tell() -> str:
        return subprocess.run(command(*STILL), cwd=tmp_path, capture_output=True, text=True, check=True).stderr

    codecache.note_all_compiled()
    assert "preparing" not in tell()
    for file in [*own_cache.glob("all-*"), *own_cache.glob("search.astar-*/search-*.nbc")]:
        file.unlink()
    try:
        first = tell()
        assert first.startswith("first run: preparing in the background")
        wait_until(lambda: warming._is_running(own_cache))
        again = tell()
        assert again.startswith("still preparing in the background (")
        assert (first + again).count("\n") == 2
    finally:
        stopped = subprocess.run(command("warm", "--stop"), capture_output=True, text=True, check=True).stdout
    assert stopped == "stopped preparing\n"
    wait_until(lambda: not warming._is_running(own_cache))
    assert not list(own_cache.glob("all-*"))
    stopped = subprocess.run(command("warm", "--stop"), capture_output=True, text=True, check=True).stdout
    assert stopped == "nothing is preparing in the background\n"


def test_a_terminal_shows_how_much_is_compiled_until_the_first_run_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    terminal = Terminal()
    monkeypatch.setattr(warming, "prepare", lambda: None)
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(codecache, "is_all_compiled", lambda: False)
    total = len(codecache.decorated_names())
    with warming.preparing():
        wait_until(lambda: f"{total}/{total}" in terminal.getvalue())
    monkeypatch.setattr(codecache, "is_all_compiled", lambda: True)
    terminal.truncate(0)
    with warming.preparing():
        sleep(0.4)  # it looks every 0.2 s
    assert not terminal.getvalue()


def test_of_several_processes_one_compiles(own_cache: Path) -> None:
    with warming._alone(own_cache) as is_first:
        assert is_first
        assert warming._is_running(own_cache)
        with warming._alone(own_cache) as is_second:
            assert not is_second
        warming.compile_beside_search()  # returns at once
    assert not warming._is_running(own_cache)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="this system does not show its processes")
def test_workers_end_with_the_process_that_started_them_even_if_it_is_killed() -> None:
    worker = "from motionmind.cli import warming; warming.end_with(PARENT); import time; time.sleep(60)"
    parent = f"""
import os, subprocess, sys, time
worker = subprocess.Popen([sys.executable, "-c", {worker!r}.replace("PARENT", str(os.getpid()))])
print(worker.pid, flush=True)
time.sleep(60)
"""

    def is_over(process: int) -> bool:
        stat = Path(f"/proc/{process}/stat")
        return not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] == "Z"

    with subprocess.Popen([sys.executable, "-c", parent], stdout=subprocess.PIPE, text=True) as started:
        assert started.stdout is not None
        process = int(started.stdout.readline())
        sleep(2.0)
        assert not is_over(process)
        started.kill()
        wait_until(lambda: is_over(process))


def test_nothing_is_started_where_code_cannot_be_kept(
    own_cache: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(codecache, "is_all_compiled", lambda: False)
    monkeypatch.setattr(warming, "_start", lambda *_, **__: pytest.fail("started"))
    monkeypatch.setattr(warming, "_MIN_FREE_BYTES", float("inf"))  # as on a full disk
    warming.prepare()
    assert list(warming.prepare_in_steps()) == []
    monkeypatch.setattr(warming, "_MIN_FREE_BYTES", 0.0)
    monkeypatch.setattr(codecache, "place_of_code", lambda: None)
    warming.prepare()
    assert capsys.readouterr().err == ""
    assert own_cache.is_dir()


def test_a_build_compiles_once_its_files_are_read(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt() -> None:
        raise MotionMindError("compiling")

    monkeypatch.setattr(changes, "prepare", interrupt)
    monkeypatch.setattr(corpora, "prepare", interrupt)
    write_motion("clip.bvh", ballet_clip("jump").resample(30.0))
    for words, message in [
        (["nothing.bvh"], "nothing.bvh: cannot be read: there is no such file"),
        (["clip.bvh", "--mix", "balet"], "no corpus 'balet'; did you mean ballet?"),
        (["clip.bvh", "--strict-files", "nothing.bvh"], "nothing.bvh: cannot be read: there is no such file"),
        (["clip.bvh"], "compiling"),
        (["--mix", "ballet"], "compiling"),
    ]:
        done = run("corpus", "build", "mine", *words)
        assert (done.code, message in done.err) == (2, True), done.err


def test_the_first_search_says_what_it_waits_for_before_it_learns_a_corpus(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object) -> Engine:
        raise MotionMindError("learning")

    monkeypatch.setattr(Engine, "load", interrupt)
    monkeypatch.setattr(codecache, "is_all_compiled", lambda: False)
    monkeypatch.setattr(warming, "_is_running", lambda place: False)
    monkeypatch.setattr(warming, "_start", lambda *_, **__: [])
    monkeypatch.setattr(warming, "FIRST_RUN_NOTE", "compiling")
    for words, said in [
        (("ballet/arabesque", "ballet/fifth"), "compiling\nerror: learning\n"),
        (("ballet/arabesk", "ballet/fifth"), "error: ballet: no posture or clip 'arabesk'"),
        (("ballet/arabesque", "ballet/adagoi@3"), "error: ballet: no posture or clip 'adagoi'"),
        (("no.json", "ballet/fifth"), "error: no.json: cannot be read: there is no such file"),
        (("ballet/arabesque", "ballet/fifth", "--via", "no.bvh@2@"), "error: no.bvh: cannot be read: "),
        (("ballet/arabesque", "ballet/fifth", "--corpus", "balet"), "error: no corpus 'balet'"),
    ]:
        assert run("tween", *words).err.startswith(said)
    assert run("vary", "macarena", "-o", "v.json").err == "compiling\nerror: learning\n"


@pytest.mark.parametrize("fault", ["killed", "full"])
def test_what_could_not_be_stored_is_compiled_by_the_next_run(
    run: Run, own_cache: Path, monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    """A worker that is killed, or that finds the disk full, leaves its functions to the next run."""
    for file in [*own_cache.glob("walks.means-*/mean_rotations-*.nbc"), *own_cache.glob("all-*")]:
        file.unlink()
    start, popen = warming._start, subprocess.Popen

    def failing(programs: Any, **options: Any) -> Any:
        if fault == "full":  # files hold no more than the lock's
            limit = functools.partial(resource.setrlimit, resource.RLIMIT_FSIZE, (64, 64))
            with monkeypatch.context() as patch:
                patch.setattr(subprocess, "Popen", functools.partial(popen, preexec_fn=limit))
                return start(programs, **options)
        for worker in (workers := start(programs, **options)):
            worker.kill()
        return workers

    # The functions that lack are those of one of the works.
    monkeypatch.setattr(warming, "_wait_or_compile", lambda _: warming._compile([warming.turn], 1, hidden=True))
    with monkeypatch.context() as patch:
        patch.setattr(warming, "_start", failing)
        done = run("warm")
    assert done.code == 2
    said = r"\d+ of \d+ functions could not be compiled and stored; is the disk full\? run it again"
    assert re.fullmatch(rf"error: \S+: {said}\n", done.err)
    assert run("warm").out.startswith(f"compiled {len(codecache.decorated_names())} functions in ")


def test_a_place_that_cannot_be_written_is_an_error_in_one_line(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(codecache, "_folder", lambda source: None)
    done = run("warm")
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert "NUMBA_CACHE_DIR" in done.err


def test_a_tween_imports_neither_linear_algebra_nor_the_network() -> None:
    Engine.load("ballet")  # so that the process need not learn it, which takes the network
    code = (
        "import sys; from motionmind.cli import main\n"
        "try: main(['tween', 'ballet/arabesque', 'ballet/fifth'])\n"
        "finally: print({'scipy.linalg', 'pgmpy', 'uvicorn', 'motionmcp'} & set(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.splitlines()[-1] == "set()"
