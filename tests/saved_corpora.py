"""Small corpora on disk, and a program that changes one, or edits a project or runs a command, killed on the way."""

from __future__ import annotations

import atexit
import ctypes
import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import IO, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from motionmind import files
from motionmind.corpus import store
from motionmind.corpus.arrays import write_arrays
from motionmind.corpus.entries import Packed

MANIFEST = {"name": "arms", "clips": []}
# What changes the disk, as Python reports it before it asks the system.
CHANGES = {"open", "os.link", "os.rename", "os.remove", "os.rmdir", "os.mkdir", "os.truncate", "os.chmod"}
_LET_TRACE, _ANYBODY = 0x59616D61, ctypes.c_ulong(-1)  # PR_SET_PTRACER and PR_SET_PTRACER_ANY of Linux


def arrays(seed: int) -> dict[str, NDArray[Any]]:
    """Arrays that hold nothing but the seed, so that a mixture shows."""
    return {name: np.full((7, 3), seed) for name in ("rotations", "states", "part.targets")}


def seed_of(folder: Path) -> int:
    """The seed of the corpus in a folder; fails if it is a mixture."""
    _, found, *_ = store.load(folder)
    assert found.keys() == arrays(0).keys()
    (seed,) = {int(value) for array in found.values() for value in array.ravel()}
    return seed


def entries(folder: Path, name: str = "clips") -> list[dict[str, Any]]:
    """The entries of a saved corpus's clips, or faults."""
    text: bytes = store.load(folder).arrays[f"{name}.text"].tobytes()
    return [json.loads(line) for line in text.splitlines()]


def put_array(folder: Path, name: str, array: NDArray[Any]) -> None:
    """Replace an array of a saved corpus, and state the checksum of the new one: a corpus that someone forged."""
    manifest = json.loads((folder / store.MANIFEST).read_text("utf-8"))
    place = folder / str(manifest["folder"])
    (place / f"{name}.npy").unlink(missing_ok=True)
    entry = write_arrays(place, {name: array}, flush=False)[name]
    manifest["arrays"][name] = msgspec.to_builtins(entry)
    (folder / store.MANIFEST).write_text(json.dumps(manifest), "utf-8")


def put_entries(folder: Path, found: list[dict[str, Any]]) -> None:
    """Replace the entries of a saved corpus's clips, and leave their columns as they are."""
    for key, array in Packed.of(found)._asdict().items():
        put_array(folder, f"clips.{key}", array)


def names(folder: Path) -> list[str]:
    """All files in a folder and below."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def kill_before(change: int) -> None:
    """Kill this process before it changes the disk for the n-th time, counted from 1."""
    seen = 0

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal seen
        if event in CHANGES and (event != "open" or arguments[2] & (os.O_WRONLY | os.O_RDWR)):
            seen += 1
            if seen == change:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(watch)


def wait_for_tracer() -> None:
    """Let any process trace this one, tell its number, and wait for a line."""
    ctypes.CDLL(None).prctl(_LET_TRACE, _ANYBODY, 0, 0, 0)
    print(os.getpid(), flush=True)
    sys.stdin.readline()


def main(words: Mapping[str, str]) -> None:
    """Save a corpus in a folder, or rename or delete the one there, and be killed before a change if one is given."""
    if change := int(words.get("change", 0)):
        kill_before(change)
    if "traced" in words:
        wait_for_tracer()
    folder, home = Path(words["folder"]), Path(words["folder"]).parents[1]
    match words.get("do", "save"):
        case "save":
            store.save(folder, MANIFEST, arrays(int(words["seed"])))
        case "rename":
            store.rename(folder.name, "legs", home)
        case "delete":
            store.delete(folder.name, home)
        case "command":
            run_command(folder, json.loads(words["words"]))
        case "edit":
            edit_project(folder, int(words["count"]))


def run_command(folder: Path, words: Sequence[str]) -> None:
    """Run a command in a folder, with a home and a cache of learned arrays there, and print nothing."""
    import platformdirs

    from motionmind.cli import main as run

    os.chdir(folder)
    os.environ.setdefault("NUMBA_CACHE_DIR", platformdirs.user_cache_dir("motionmind", appauthor=False))
    os.environ |= {"MOTIONMIND_HOME": str(folder / "home"), "XDG_CACHE_HOME": str(folder / "cache")}
    sys.stdout = sys.stderr = Path(os.devnull).open("w")  # noqa: SIM115 - until the process ends
    run(words)


def edit_project(path: Path, count: int) -> None:
    """Open or create a project, and insert stretches until there are so many."""
    from motionmind.studio.edits import Insert
    from motionmind.studio.project import Project

    project = Project.open(path) if path.exists() else Project.create(path, "ballet")
    for number in range(len(project.state.blocks), count):
        project.edit("w1", Insert(f"b{number}", "ballet/adagio", 0, 9))
    project.close()


def changed(**words: object) -> int:
    """Run `main` in a process that begins with what another one has imported; its exit code, or minus a signal."""
    starter = _start(**words)
    return int(starter.readline())


def traced(tracer: Sequence[str], **words: object) -> int:
    """Run `main` as `changed` does, in a process that strace is attached to with these words of its own."""
    told = _start(traced=True, **words)
    command = ["strace", "-o", os.devnull, *tracer, "-p", told.readline().strip()]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as strace:
        assert strace.stderr is not None
        said = strace.stderr.readline()
        _say("")
        code = int(told.readline())
    assert said.endswith("attached\n"), said
    return code


def _start(**words: object) -> IO[str]:
    """Start a process that runs `main`; return where it, and the one that it was forked from, print."""
    _say(json.dumps({name: str(value) for name, value in words.items()}))
    told = _starter().stdout
    assert told is not None
    return told


def _say(line: str) -> None:
    starter = _starter()
    assert starter.stdin is not None
    starter.stdin.write(f"{line}\n")
    starter.stdin.flush()


@cache
def _starter() -> subprocess.Popen[str]:
    """The process that the others are forked from; it ends with this one."""
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(Path(files.__file__).parents[1])}
    words = [sys.executable, __file__]
    starter = subprocess.Popen(words, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(_end, starter)
    return starter


def _end(starter: subprocess.Popen[str]) -> None:
    with starter:
        pass


def preload(do: str) -> None:
    """Import once what all processes of a kind import."""
    if do == "command":
        import motionmind.cli.application
        import motionmind.tween.engine
    elif do == "edit":
        import motionmind.learned.persistence
        import motionmind.studio.project  # noqa: F401


def start() -> None:
    """Fork a process that runs `main` for each line that comes, and tell how it ended."""
    for line in sys.stdin:
        preload(json.loads(line).get("do", "save"))
        if (child := os.fork()) == 0:
            main(json.loads(line))
            sys.exit()
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    if sys.argv[1:]:
        main(dict(word.split("=", 1) for word in sys.argv[1:]))
    else:
        start()
