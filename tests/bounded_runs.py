"""Runs of the command line in a process of its own, with limits on its memory and its time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import motionmind

ROOT = Path(motionmind.__file__).parents[1]
MOST_SECONDS = 10
MOST_BYTES = 10**9

# Address space has room for what libraries reserve and never touch; what counts is the memory that was resident.
_CHILD = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (4 * 10**9, 4 * 10**9))
resource.setrlimit(resource.RLIMIT_CPU, (30, 30))
from motionmind.cli import main
code = 1
try:
    code = main(sys.argv[1:])
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
    print(f"used {memory} {used.ru_utime + used.ru_stime}")
    sys.stdout.flush()
sys.exit(code)
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
    environment = os.environ | {
        "PYTHONPATH": str(ROOT),
        "MOTIONMIND_HOME": str(folder / "home"),
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    done = subprocess.run(
        [sys.executable, "-c", _CHILD, *map(str, arguments)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    out, _, used = done.stdout.rpartition("used ")
    memory, seconds = used.split() if used else ("0", "inf")
    return BoundedRun(done.returncode, out, done.stderr, int(memory), float(seconds))
