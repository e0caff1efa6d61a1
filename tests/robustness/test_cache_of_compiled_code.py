"""No fault of the cache of compiled code ends a run, or is in the way of the next one."""

from __future__ import annotations

import errno
import json
import logging
import os
import pickle
import random
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import pytest

import motionmind
from motionmind import codecache as door
from motionmind import files
from motionmind.jit import jit

PACKAGE = Path(motionmind.__file__).parent
# It prints what functions of two rooms return, of those that take the least time to compile, and how many of them were
# compiled, and not found.
PROGRAM = """
import numpy as np
from motionmind.body.capsules import radius_at
from motionmind.geometry.distances import squared_distance
print(squared_distance(np.ones((2, 4)), np.zeros((2, 4))))
print(radius_at(np.ones(2), 0.5))
print(sum(sum(one._cache_misses.values()) for one in (squared_distance, radius_at)))
"""


# Runs programs, each in a process of its own that begins with what this one has imported and with a compiler that has
# compiled something like what they compile, and ends without a search for garbage among it: most of what a program
# takes. No function of the package is compiled or looked for yet.
_STARTER = """
import atexit, gc, json, os, sys, tempfile
import numba, numpy as np
import motionmind.body.capsules, motionmind.geometry.distances

@numba.njit
def alike(x, share):
    total = 0.0
    for j in range(len(x)):
        total += x[j][0] - share * x[j][1]
    return float(total)

alike(np.ones((2, 4)), 0.5)
atexit.register(gc.freeze)
for line in sys.stdin:
    if (child := os.fork()) == 0:
        program, environment, out, error = json.loads(line)
        os.environ.clear()
        os.environ.update(environment)
        tempfile.tempdir = None
        for stream, path in ((1, out), (2, error)):
            os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT), stream)
        exec(program, {})
        sys.exit()
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


class Told(NamedTuple):
    """What a program printed."""

    stdout: str
    stderr: str


@pytest.fixture(scope="module", autouse=True)
def starter() -> Iterator[None]:
    """The process that programs begin in."""
    global _starter
    environment = os.environ | {"PYTHONPATH": str(PACKAGE.parent)}
    words = [sys.executable, "-c", _STARTER]
    with subprocess.Popen(words, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as _starter:
        yield


_starter: subprocess.Popen[str]


def run(home: Path, program: str = PROGRAM, **environment: str) -> Told:
    """Run a program whose caches and temporary files are in a folder."""
    places = {"XDG_CACHE_HOME": str(home / "cache"), "TMPDIR": str(home / "tmp"), "PYTHONPATH": str(PACKAGE.parent)}
    (home / "tmp").mkdir(exist_ok=True)
    kept = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    assert _starter.stdin is not None
    assert _starter.stdout is not None
    with TemporaryDirectory() as place:
        told = [Path(place) / name for name in ("out", "error")]
        _starter.stdin.write(json.dumps([program, kept | places | environment, *map(str, told)]) + "\n")
        _starter.stdin.flush()
        code = int(_starter.stdout.readline())
        found = Told(*(path.read_text("utf-8") for path in told))
    assert code == 0, found.stderr
    return found


def kept(home: Path) -> list[Path]:
    return sorted(home.rglob("*.nbc"))


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A home in which the functions are compiled."""
    home = tmp_path_factory.mktemp("compiled")
    first, again = run(home), run(home)
    assert kept(home)
    assert first.stdout.split() == ["8.0", "1.0", "2"]
    assert again.stdout.split()[-1] == "0"  # found
    assert first.stderr == again.stderr == ""
    return home


def emptied(file: Path, rng: random.Random) -> None:
    file.write_bytes(b"")


def cut(file: Path, rng: random.Random) -> None:
    file.write_bytes(file.read_bytes()[: rng.randrange(1, file.stat().st_size)])


def random_bytes(file: Path, rng: random.Random) -> None:
    file.write_bytes(rng.randbytes(file.stat().st_size))


def a_bit_turned(file: Path, rng: random.Random) -> None:
    data = bytearray(file.read_bytes())
    data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    file.write_bytes(data)


def of_another(file: Path, rng: random.Random) -> None:
    """What is unpickled, and is no code."""
    data = b"\x80\x04N."
    file.write_bytes(door.hashlib.sha256(data).digest() + data)


def a_folder(file: Path, rng: random.Random) -> None:
    file.unlink()
    file.mkdir()


@pytest.mark.parametrize("damage", [emptied, cut, random_bytes, a_bit_turned, of_another])
def test_damaged_code_is_thrown_away_compiled_again_and_said_once(
    compiled: Path, tmp_path: Path, damage: Callable[[Path, random.Random], None]
) -> None:
    home = tmp_path / "home"
    shutil.copytree(compiled, home)
    rng = random.Random(0)
    before = {file: file.read_bytes() for file in kept(home)}
    for file in before:
        damage(file, rng)
    told = run(home)
    assert told.stdout.split() == ["8.0", "1.0", "2"]
    assert told.stderr.count("is damaged") == 1
    assert told.stderr.count("\n") == 1
    assert kept(home) == list(before)
    again = run(home)
    assert (again.stdout.split()[-1], again.stderr) == ("0", "")


OTHER = 12345  # another user's number


def _of_another(path: Path) -> None:
    os.chown(path, OTHER, OTHER)


def _writable(path: Path) -> None:
    path.chmod(0o777)


def _moved_and_linked(path: Path) -> None:
    path.rename(path.with_name("elsewhere"))
    path.symlink_to("elsewhere")


def _a_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


POISONS: dict[str, tuple[str, Callable[[Path], None]]] = {
    "others can write to the folder": ("cache/motionmind/compiled", _writable),
    "all can write to the folder, and remove their own": (
        "cache/motionmind/compiled",
        lambda path: (path.chmod(0o1777), _of_another(path))[1],
    ),
    "the folder is another's": ("cache/motionmind/compiled", _of_another),
    "others can exchange the folder": ("cache/motionmind", _writable),
    "others can exchange a folder above": ("cache", _writable),
    "another owns the folder above": ("cache/motionmind", _of_another),
    "another owns the home": ("cache", _of_another),
    "a link to a folder of another": (
        "cache/motionmind/compiled",
        lambda path: (_of_another(path), _moved_and_linked(path))[1],
    ),
    "files of another": ("**/*.nbc", _of_another),
    "files that others can write": ("**/*.nbc", _writable),
    "links to files": ("**/*.nbc", lambda path: (path.with_name("elsewhere").unlink(True), _moved_and_linked(path))[1]),
    "pipes": ("**/*.nbc", _a_pipe),
}


class _Payload:
    """Its pickle leaves a mark when it is loaded."""

    def __init__(self, mark: Path) -> None:
        self._mark = mark

    def __reduce__(self) -> tuple[object, ...]:
        return os.mkdir, (str(self._mark),)


def poison(home: Path) -> Path:
    """Put a payload into all files, with the right hash; return the mark that it leaves."""
    mark = home / "mark"
    data = pickle.dumps(_Payload(mark))
    for file in kept(home):
        file.write_bytes(door.hashlib.sha256(data).digest() + data)
    return mark


def owners(folder: Path) -> dict[Path, int]:
    """The owner of everything in a folder."""
    return {path: path.lstat().st_uid for path in folder.rglob("*")}


def test_a_payload_runs_where_only_the_user_could_have_put_it(compiled: Path, tmp_path: Path) -> None:
    shutil.copytree(compiled, tmp_path / "home")
    mark = poison(tmp_path / "home")
    run(tmp_path / "home")
    assert mark.exists()  # so the tests below can fail


@pytest.mark.parametrize("place", ["cache", "tmp"])
@pytest.mark.parametrize("kind", POISONS)
def test_what_others_could_have_written_never_runs(compiled: Path, tmp_path: Path, kind: str, place: str) -> None:
    where, change = POISONS[kind]
    home = tmp_path / "home"
    shutil.copytree(compiled, home)
    if place == "tmp":  # where code is kept if the cache cannot hold it
        where = where.replace("cache/motionmind", f"tmp/motionmind-{os.getuid()}")
        if where == "cache":
            pytest.skip("all users can write to a folder for temporary files")
        (home / "tmp").mkdir(exist_ok=True)
        (home / "cache/motionmind").rename(home / f"tmp/motionmind-{os.getuid()}")
        (home / f"tmp/motionmind-{os.getuid()}").chmod(0o700)
        (home / "cache").rmdir()
        (home / "cache").write_text("not a folder")
    mark = poison(home)
    try:
        for path in sorted(home.glob(where)):
            change(path)
    except PermissionError:
        pytest.skip("only root can give files to others")
    before = owners(home / "cache")
    told, again = run(home), run(home)
    assert not mark.exists()
    if "another" in kind and "nbc" not in where:
        assert owners(home / "cache") == before, "they stay, and nothing is put among them"
    assert told.stdout.split() == ["8.0", "1.0", "2"]
    if place == "cache":  # otherwise there may be nowhere else
        assert told.stderr == again.stderr == ""
        assert again.stdout.split()[-1] == "0", "it is kept where it is safe"


def test_code_is_kept_where_all_that_users_write_is_their_groups_too(tmp_path: Path) -> None:
    program = f"import os; os.umask(0o002)\n{PROGRAM}"
    assert [run(tmp_path, program).stdout.split()[-1] for _ in range(2)] == ["2", "0"]


def test_code_that_cannot_be_read_is_compiled_each_time(compiled: Path, tmp_path: Path) -> None:
    home = tmp_path / "home"
    shutil.copytree(compiled, home)
    for file in kept(home):
        a_folder(file, random.Random(0))
    for _ in range(2):
        told = run(home)
        assert told.stdout.split()[-1] == "2"
        assert told.stderr.count("cannot cache") == 1


@pytest.fixture
def untouched() -> Iterator[None]:
    """Check that nothing was written into the package, whose files of bytecode may come and go."""

    def listed() -> set[Path]:
        return {path for path in PACKAGE.rglob("*") if path.suffix != ".pyc" and path.name != "__pycache__"}

    before = listed()
    yield
    assert listed() - before == set()


def a_file(place: Path) -> None:
    place.write_text("not a folder")


def in_a_file(place: Path) -> None:
    place.mkdir()
    (place / "motionmind").write_text("not a folder")


def a_loop_of_links(place: Path) -> None:
    place.symlink_to(place)


@pytest.mark.parametrize("obstacle", [a_file, in_a_file, a_loop_of_links])
@pytest.mark.usefixtures("untouched")
def test_where_the_cache_can_be_no_folder_temporary_files_hold_it(
    tmp_path: Path, obstacle: Callable[[Path], None]
) -> None:
    obstacle(tmp_path / "cache")
    assert run(tmp_path).stderr == ""
    assert kept(tmp_path / "tmp")
    assert run(tmp_path).stdout.split()[-1] == "0"


@pytest.mark.usefixtures("untouched")
def test_where_nothing_can_be_kept_it_is_compiled_each_time_and_said_once(tmp_path: Path) -> None:
    a_file(tmp_path / "cache")
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        program = f"import tempfile; tempfile.tempdir = {str(tmp_path / 'cache')!r}\n{PROGRAM}"
        told = run(tmp_path, program, **{name: str(tmp_path / "cache")})
        assert told.stderr.count("cannot cache compiled code in") == 1
        assert told.stderr.count("\n") == 1


@pytest.mark.usefixtures("untouched")
def test_a_full_disk_is_no_reason_to_fail(tmp_path: Path) -> None:
    # No file may be longer than some bytes: writing fails as it does where a disk is full.
    limit = "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
    limit += f"resource.setrlimit(resource.RLIMIT_FSIZE, (1000, {resource.RLIM_INFINITY}))\n"
    told = run(tmp_path, limit + PROGRAM)
    assert told.stdout.split()[-1] == "2"
    assert told.stderr.count("cannot cache") == 1
    assert told.stderr.count("\n") == 1
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), OSError(errno.EROFS, "Read-only")])
def test_code_that_cannot_be_written_at_any_step_is_done_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, error: OSError
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    for name in ("open", "fsync", "fdopen"):
        door._folder.cache_clear()
        door._warn.cache_clear()
        with monkeypatch.context() as patch, caplog.at_level(logging.WARNING):
            patch.setattr(files.os, name, failing(error))
            assert jit(lambda x: 2.0 * x)(4.0) == 8.0
        assert kept(tmp_path) == []
    door._folder.cache_clear()


def failing(error: OSError) -> Callable[..., object]:
    def instead(*_: object, **__: object) -> object:
        raise error

    return instead


def test_many_processes_that_compile_at_once_all_succeed(tmp_path: Path) -> None:
    # Each compiles for types of its own first, then for those of all.
    program = """
import os, sys
import numpy as np
from motionmind.geometry.distances import squared_distance
kinds = [np.float32, np.float64, np.int64]
for first in range(3):
    if os.fork() == 0:
        order = kinds[first:] + kinds[:first]
        found = [squared_distance(np.ones((2, 4), kind), np.zeros((2, 4), kind)) for kind in order]
        line = f"{' '.join(map(str, found))} {sum(squared_distance._cache_misses.values())}\\n"
        os.write(1, line.encode())  # at once, where Python is told to write each word as it comes
        sys.exit()
for _ in range(3):
    assert os.wait()[1] == 0
"""
    for is_kept in (False, True):
        told = run(tmp_path, program)
        assert told.stderr == ""
        lines = [line.split() for line in told.stdout.splitlines()]
        assert [line[:3] for line in lines] == [["8.0"] * 3] * 3
        assert all(line[3] == "0" for line in lines) or not is_kept


@pytest.mark.long
def test_code_of_two_processes_is_not_mixed_up_in_a_third(tmp_path: Path) -> None:
    # numba's loops of sort and of argsort have one name and signature. If functions are counted, these have one number,
    # too: to sort takes three functions more before them.
    (tmp_path / "sorting.py").write_text(
        "import numpy as np\n"
        "from motionmind.jit import jit\n"
        "@jit\ndef greatest(x):\n    return np.sort(x)[-1]\n"
        "@jit\ndef last(x):\n    return np.argsort(x)[-1]\n"
    )
    begin = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import numba, numpy as np; from sorting import *\n"
    begin += "x = np.ones(40); x[7] = 2.0\n"
    end = "\nprint(sum(sum(one._cache_misses.values()) for one in (greatest, last)))"
    for program, said in [
        ("print(greatest(x))", "2.0\n1\n"),
        ("[numba.njit(lambda x: x)(1.0) for _ in range(3)]; print(last(x))", "7\n1\n"),
        ("print(greatest(x), last(x))", "2.0 7\n0\n"),
        ("print(last(x), greatest(x))", "7 2.0\n0\n"),
    ]:
        assert run(tmp_path, begin + program + end).stdout == said
