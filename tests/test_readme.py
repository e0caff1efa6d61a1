"""Every command that README shows runs as printed."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from bundled_clips import ballet_clip

from motionmind import read_motion, write_motion

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
COMMANDS = [line.strip() for line in re.findall(r"^    (\S.*)$", README, re.M)]


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """An environment whose `motionmind` is this interpreter's, and whose corpora are of this test alone."""
    scripts = str(Path(sys.executable).parent)
    home = str(tmp_path_factory.mktemp("home"))
    return {**os.environ, "PATH": f"{scripts}{os.pathsep}{os.environ['PATH']}", "MOTIONMIND_HOME": home}


def test_readme_leads_with_the_two_commands() -> None:
    assert COMMANDS[0].startswith("pip install . && motionmind tween ")
    assert COMMANDS[1] == 'pip install -e ".[dev]" && pytest'


def test_the_first_command_runs(elsewhere: dict[str, str], tmp_path: Path) -> None:
    shutil.copytree(ROOT / "corpora", tmp_path / "corpora")
    command = COMMANDS[0].removeprefix("pip install . && ")
    done = subprocess.run(command, shell=True, cwd=tmp_path, env=elsewhere, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    shown = re.search(r"```text\n(.*?)```", README, re.S)
    assert shown is not None
    assert [line.rstrip() for line in done.stdout.splitlines()] == [line.rstrip() for line in shown[1].splitlines()]
    assert len(read_motion(tmp_path / "tween.bvh")) > 10


def test_the_commands_for_ones_own_movement_run(elsewhere: dict[str, str], tmp_path: Path) -> None:
    for name in ("plies", "adagio"):
        write_motion(tmp_path / f"{name}.bvh", ballet_clip(name).resample(30.0))
    shutil.copy(tmp_path / "adagio.bvh", tmp_path / "clip.bvh")
    (tmp_path / "corpora").symlink_to(ROOT / "corpora")
    commands = [command for command in COMMANDS[2:] if command.startswith("motionmind ")]
    assert len(commands) == 8
    for command in commands:
        done = subprocess.run(
            command, shell=True, cwd=tmp_path, env=elsewhere, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{command}: {done.stderr}"
    assert (tmp_path / "report.json").stat().st_size > 1000
    python = re.search(r"```python\n(.*?)```", README, re.S)
    assert python is not None
    done = subprocess.run(
        [sys.executable, "-c", python[1]], cwd=tmp_path, env=elsewhere, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "tween.bvh").exists()
