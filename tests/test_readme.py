"""Every command that README and the gallery show runs as printed, and their pictures are what it makes."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from bundled_clips import ballet_clip
from PIL import Image

from motionmind import write_motion

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
    assert_same_picture(tmp_path / "tween.gif", ROOT / "docs" / "arabesque-to-fifth.gif")


def test_the_commands_for_ones_own_movement_run(elsewhere: dict[str, str], tmp_path: Path) -> None:
    for name in ("plies", "adagio"):
        write_motion(tmp_path / f"{name}.bvh", ballet_clip(name).resample(30.0))
    shutil.copy(tmp_path / "adagio.bvh", tmp_path / "clip.bvh")
    (tmp_path / "corpora").symlink_to(ROOT / "corpora")
    commands = [command for command in COMMANDS[2:] if command.startswith("motionmind ")]
    assert len(commands) == 15
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
    assert (tmp_path / "tween.html").read_text().startswith("<!doctype html>")


def test_the_gallery_shows_what_its_commands_make(elsewhere: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / "corpora").symlink_to(ROOT / "corpora")
    gallery = ROOT / "docs" / "gallery.md"
    text = gallery.read_text()
    commands = [line.strip() for line in re.findall(r"^    (motionmind \S.*)$", text, re.M)]
    shown = [gallery.parent / path for path in re.findall(r"^!\[.*\]\((.*)\)$", text, re.M)]
    assert len(commands) == 10
    for command in commands:
        done = subprocess.run(
            command, shell=True, cwd=tmp_path, env=elsewhere, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{command}: {done.stderr}"
    for path in shown:
        if path.suffix == ".svg":
            assert ElementTree.parse(path).getroot().attrib == ElementTree.parse(tmp_path / path.name).getroot().attrib
            assert path.stat().st_size == pytest.approx((tmp_path / path.name).stat().st_size, rel=0.02)
        elif path.name != "player.png":  # which a browser took
            assert_same_picture(tmp_path / path.name, path)


def assert_same_picture(made: Path, shown: Path) -> None:
    """All frames are alike; letters may differ with the fonts."""
    with Image.open(made) as one, Image.open(shown) as other:
        assert one.size == other.size
        frames = getattr(one, "n_frames", 1)
        assert frames == getattr(other, "n_frames", 1)
        for frame in range(frames):
            one.seek(frame)
            other.seek(frame)
            pixels = (np.asarray(picture.convert("RGB"), dtype=float) for picture in (one, other))
            assert np.abs(np.subtract(*pixels)).mean() < 1.0, f"{shown.name}, frame {frame}"
