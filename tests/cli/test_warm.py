"""Compiling ahead of time: everything is reached, and whoever waits is told for what."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import pytest
from bundled_clips import ballet_clip
from command_line import Run
from numba.core.registry import CPUDispatcher

from motionmind import jit
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

    def reached(*works: Callable[[], None]) -> set[str]:
        for work in works:
            work()
        return {name for one in dispatchers().values() if one.overloads for name in names_called(one.py_func)}

    # What is counted until searches may begin is what they need, give or take a few.
    first = warming._first_names()
    assert len(first - reached(warming.search, warming.realise, warming.seek)) <= len(first) // 20
    assert jit.decorated_names() - reached(warming.draw, warming.learn) == set()


def test_the_workers_reach_every_function_that_is_to_be_compiled() -> None:
    # In a process of its own: here other tests have reached some.
    code = f"import sys; sys.path[:] = {sys.path!r}; import {__name__}; {__name__}.reach_everything()"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_compiling_beside_other_work_tells_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    class Process:
        returncode = 0

        def __init__(self, looks: int) -> None:
            self.looks = looks

        def poll(self) -> int | None:
            self.looks -= 1
            return None if self.looks >= 0 else 0

        def kill(self) -> None:
            pass

        def wait(self) -> int:
            return 0

    names, first, noted = jit.decorated_names(), warming._first_names(), list[bool]()
    others = sorted(names - first)
    found = [set(others[:3]), first | set(others[:3]), first | set(others[:3]), first | set(others[:4])]
    there = iter(found)
    monkeypatch.setattr(warming, "_start", lambda programs, **_: [Process(3 - len(programs)) for _ in programs])
    monkeypatch.setattr(jit, "compiled_names", lambda: frozenset(next(there)))
    monkeypatch.setattr(jit, "note_all_compiled", lambda: noted.append(True))
    steps = list(warming.compile_in_steps())
    assert steps[:2] == [(0, len(first), False), (len(first), len(first), False)]
    assert steps[2:] == [(len(first) + 3, len(names), True), (len(first) + 4, len(names), True)]
    assert noted == [True]


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with a copy of what is compiled, of which a test may take away what others would compile again."""
    place = jit.place_of_code()
    assert place is not None
    folder = tmp_path / "cache"
    (folder / place.name).mkdir(0o700, parents=True)
    for one in [*jit._folders(), *place.glob("all-*")]:  # not what earlier states of the sources have left
        copy = shutil.copytree if one.is_dir() else shutil.copy
        copy(one, folder / place.name / one.name)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    jit._folder.cache_clear()
    yield folder / place.name
    jit._folder.cache_clear()


@pytest.mark.usefixtures("own_cache")
def test_warm_says_what_it_did_and_does_nothing_a_second_time(run: Run) -> None:
    note = jit._note()
    assert note is not None
    note.unlink(missing_ok=True)
    done = run("warm")
    assert done.code == 0
    assert done.out.startswith(f"compiled {len(jit.decorated_names())} functions in ")
    assert jit.decorated_names() == jit.compiled_names()
    done = run("warm")
    assert (done.code, done.out) == (0, f"nothing to do: all {len(jit.decorated_names())} functions are compiled\n")


@pytest.mark.parametrize("is_first", [True, False])
def test_the_first_search_alone_says_what_it_waits_for(is_first: bool, tmp_path: Path, own_cache: Path) -> None:
    # From a posture to itself there is no move to search for, and so nothing is compiled while the test waits.
    command = [sys.executable, "-m", "motionmind", "tween", "ballet/fifth", "ballet/fifth", "-o", "still.json"]
    warming.search()
    if is_first:  # all is there but what is compiled last, and so compiling takes the test no time
        module, _, name = warming._LAST.replace("/", ".").rpartition(".")
        for file in [*own_cache.glob("all-*"), *own_cache.glob(f"{module}-*/{name}-*.nbc")]:
            file.unlink()
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert ("compiling" in done.stderr) == is_first
    assert done.stderr.count("\n") <= 1


def test_what_an_interruption_left_uncompiled_is_said_again(monkeypatch: pytest.MonkeyPatch) -> None:
    names = jit.decorated_names()
    assert warming._LAST in names
    monkeypatch.setattr(jit, "compiled_names", lambda: names - {warming._LAST})
    assert warming.is_cold()
    monkeypatch.setattr(jit, "compiled_names", lambda: names)
    assert not warming.is_cold()


def test_a_build_compiles_once_its_files_are_read(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt() -> None:
        raise MotionMindError("compiling")

    monkeypatch.setattr(changes, "warm_once", interrupt)
    monkeypatch.setattr(corpora, "warm_once", interrupt)
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
    monkeypatch.setattr(jit, "compiled_names", frozenset[str])
    monkeypatch.setattr(warming, "NOTICE", "compiling")
    for words, said in [
        (("ballet/arabesque", "ballet/fifth"), "compiling\nerror: learning\n"),
        (("ballet/arabesk", "ballet/fifth"), "error: ballet: no posture or clip 'arabesk'"),
        (("ballet/arabesque", "ballet/adagoi@3"), "error: ballet: no posture or clip 'adagoi'"),
        (("no.json", "ballet/fifth"), "error: no.json: cannot be read: there is no such file"),
        (("ballet/arabesque", "ballet/fifth", "--before", "no.bvh@2..3"), "error: no.bvh: cannot be read: "),
        (("ballet/arabesque", "ballet/fifth", "--corpus", "balet"), "error: no corpus 'balet'"),
    ]:
        assert run("tween", *words).err.startswith(said)
    assert run("vary", "macarena", "-o", "v.json").err == "compiling\nerror: learning\n"


def test_a_place_that_cannot_be_written_is_an_error_in_one_line(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "_folder", lambda source: None)
    done = run("warm")
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert "NUMBA_CACHE_DIR" in done.err


def test_a_tween_imports_neither_linear_algebra_nor_the_network() -> None:
    code = (
        "import sys; from motionmind.cli import main\n"
        "try: main(['tween', 'ballet/arabesque', 'ballet/fifth'])\n"
        "finally: print({'scipy.linalg', 'pgmpy', 'uvicorn', 'motionmcp'} & set(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.splitlines()[-1] == "set()"
