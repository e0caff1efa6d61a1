"""Programs of the repository say in a line what they lack."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_fuzzing_where_there_is_no_posix_is_refused_in_a_line() -> None:
    program = (
        "import runpy, sys\n"
        "sys.modules['resource'] = None\n"  # so that it cannot be imported
        "sys.argv[1:] = ['--seconds', '1']\n"
        "runpy.run_module('tests.robustness.fuzz', run_name='__main__')"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.splitlines() == [
        "error: there is no POSIX here, by which time and memory are limited: use Linux or macOS"
    ]


@pytest.mark.skipif(not shutil.which("bash"), reason="there is no bash")
@pytest.mark.parametrize("python", ["nowhere", "old"])
def test_the_check_says_which_python_it_needs(python: str, tmp_path: Path) -> None:
    old = tmp_path / "old"
    old.write_text("#!/bin/sh\nexit 1\n")
    old.chmod(0o755)
    done = subprocess.run(
        ["bash", ROOT / ".ci" / "run"],
        env=os.environ | {"PYTHON": str(tmp_path / python)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"error: {tmp_path / python} is no Python 3.11 or later")
