"""Runs of the command line in a process of its own, with limits on its memory and its time."""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import motionmind

ROOT = Path(motionmind.__file__).parents[1]
MOST_SECONDS = 10
MOST_BYTES = 10**9

# Starts a process for each line that it reads, which begins with what this one has imported. Address space has room for
# what libraries reserve and never touch; what counts is the memory that was resident.
_STARTER = """
import json, os, resource, sys
import motionmind.tween.engine
from motionmind.cli import main

def run(words, folder, home, out, error):
    os.chdir(folder)
    os.environ["MOTIONMIND_HOME"] = home
    for stream, path in ((1, out), (2, error)):
        os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT), stream)
    resource.setrlimit(resource.RLIMIT_AS, (4 * 10**9, 4 * 10**9))
    resource.setrlimit(resource.RLIMIT_CPU, (30, 30))
    code = 1
    try:
        code = main(words)
    except SystemExit as end:
        code = end.code
    finally:
        used = resource.getrusage(resource.RUSAGE_SELF)
        memory = used.ru_maxrss * 1024
        try:
            # What getrusage tells on Linux counts the process that this one was started from.
            with open("/proc/self/status") as status:
                memory = next(int(line.split()[1]) * 1024 for line in status if line.startswith("VmHWM"))
        except OSError:
            pass
        sys.stderr.flush()
        print(f"used {memory} {used.ru_utime + used.ru_stime}", flush=True)
    sys.exit(code)

for line in sys.stdin:
    child = os.fork()
    if child == 0:
        run(*json.loads(line))
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


class BoundedRun(NamedTuple):
    """What became of a run: its exit code, what it printed, its memory in bytes, and its seconds of work."""

    code: int
    out: str
    error: str
    memory: int
    seconds: float

    @property
    def within_bounds(self) -> bool:
        """Whether it kept to the limits for files under 1 MB."""
        return self.memory <= MOST_BYTES and self.seconds <= MOST_SECONDS


def run_bounded(*arguments: object, folder: Path) -> BoundedRun:
    """Run `motionmind` with these arguments in a folder; it is ended after 30 seconds of work or at 4 GB."""
    starter = _starter()
    assert starter.stdin is not None
    assert starter.stdout is not None
    with TemporaryDirectory() as place:
        told = [Path(place) / name for name in ("out", "error")]
        line = [[*map(str, arguments)], str(folder), str(folder / "home"), *map(str, told)]
        starter.stdin.write(json.dumps(line) + "\n")
        starter.stdin.flush()
        code = int(starter.stdout.readline())
        out, error = (path.read_text("utf-8") for path in told)
    out, _, used = out.rpartition("used ")
    memory, seconds = used.split() if used else ("0", "inf")
    return BoundedRun(code, out, error, int(memory), float(seconds))


@cache
def _starter() -> subprocess.Popen[str]:
    """The process that starts the others; it ends with this one."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    starter = subprocess.Popen(
        [sys.executable, "-c", _STARTER], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    atexit.register(_end, starter)
    return starter


def _end(starter: subprocess.Popen[str]) -> None:
    with starter:
        pass
