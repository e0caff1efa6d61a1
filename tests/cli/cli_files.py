"""Files that commands are tried on, and commands in a process of their own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from bundled_clips import ballet_clip
from command_line import Run

from motionmind.body.motion import Motion

BALLET = Path(__file__).parents[2] / "corpora" / "ballet"
ARABESQUE, FIFTH, PLIE = (BALLET / "postures" / f"{name}.json" for name in ("arabesque", "fifth", "plie"))


def start(*arguments: object, cwd: Path, stdout: int = subprocess.PIPE) -> subprocess.Popen[str]:
    """The command line in a process of its own, which heeds interrupts even if the tests run in the background."""
    program = (
        "import runpy, signal\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "runpy.run_module('motionmind', run_name='__main__')\n"
    )
    return subprocess.Popen(
        [sys.executable, "-c", program, *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, "MOTIONMIND_HOME": str(cwd / "home")},
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
    )


def clip(name: str = "jump", fps: float = 30.0) -> Motion:
    """A clip of the bundled corpus, with even frames."""
    return ballet_clip(name).resample(fps)


def files_under(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() if path.is_file() else b"" for path in sorted(folder.rglob("*"))}


def built(run: Run, *arguments: object, name: str = "mine") -> Any:
    """Build a corpus with these arguments, in place of an earlier one if there is one; return its check."""
    ran = run("corpus", "build", name, *arguments, "--replace")
    assert ran.code == 0, ran.err
    return run("corpus", "check", name, "--json", "--pairs", 50).json
