"""The studio's entry among the applications of the desktop: its structure, and starting what it names."""

from __future__ import annotations

import os
import plistlib
import random
import re
import shlex
import struct
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from pathlib import Path

import pytest

from motionmind.cli.launcher import desktop_entry, install_bundle, shortcut
from motionmind.errors import MotionMindError

ROOT = Path(__file__).parents[2]
Run = Callable[..., tuple[int, str, str]]
ODD = "ab /\\\"'`$%&;é|~<>*?#()"  # what an argument may hold


def fields(text: str) -> dict[str, str]:
    """The keys of a desktop entry, by its specification: escapes of values are undone."""
    head, *lines = text.splitlines()
    assert head == "[Desktop Entry]"
    found = dict(re.fullmatch(r"([A-Za-z0-9-]+)=(.*)", line).groups() for line in lines)  # type: ignore[union-attr]
    assert len(found) == len(lines)
    escapes = {"s": " ", "n": "\n", "t": "\t", "r": "\r", "\\": "\\"}
    return {key: re.sub(r"\\(.)", lambda match: escapes[match[1]], value) for key, value in found.items()}


def arguments(line: str) -> list[str]:
    """The arguments of an Exec line: each in double quotes, where four characters have a backslash."""
    assert re.fullmatch(r'"(?:[^"`$\\]|\\["`$\\])*"(?: "(?:[^"`$\\]|\\["`$\\])*")*', line), line
    parts = re.findall(r'"((?:[^"\\]|\\.)*)"', line)
    assert not any(re.search(r"(?<!%)(?:%%)*%(?!%)", part) for part in parts), "a field code"
    return [re.sub(r"\\(.)", r"\1", part).replace("%%", "%") for part in parts]


@pytest.mark.parametrize("seed", range(30))
def test_any_arguments_come_back_from_a_desktop_entry(seed: int) -> None:
    rng = random.Random(seed)
    command = ["".join(rng.choices(ODD, k=rng.randint(1, 12))) for _ in range(rng.randint(1, 5))]
    entry = fields(desktop_entry(command, Path("/tmp/an icon.svg")))
    assert arguments(entry["Exec"]) == command
    assert entry["Type"] == "Application"
    assert entry["Name"]
    assert entry["Terminal"] in ("true", "false")
    assert entry["Categories"].endswith(";")
    assert entry["Icon"] == "/tmp/an icon.svg"


def test_no_argument_adds_a_line() -> None:
    with pytest.raises(MotionMindError, match="no desktop entry can name"):
        desktop_entry(["/bin/x\nExec=evil"], Path("/icon"))


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="other desktops have other entries")
@pytest.mark.long
def test_the_entry_is_installed_and_its_line_starts_a_studio(
    tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    home = tmp_path / "my home"
    for _ in range(2):  # a second time, it replaces itself
        code, out, err = run("studio", "--install-launcher", "--home", home)
        assert (code, err) == (0, "")
    file = tmp_path / "data" / "applications" / "motionmind-studio.desktop"
    assert str(file.name) in out
    entry = fields(file.read_text("utf-8"))
    assert Path(entry["Icon"]).read_text("utf-8").startswith("<svg ")
    command = arguments(entry["Exec"])
    assert command[-2:] == ["--home", str(home)]
    process = subprocess.Popen(
        [*command, "--no-browser"],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        cwd=tmp_path,
    )
    try:
        assert process.stdout is not None
        url = re.search(r"http://[^/]+", process.stdout.readline())
        assert url
        with urllib.request.urlopen(f"{url[0]}/health", timeout=30) as answer:
            assert answer.status == 200
    finally:
        process.kill()
        process.communicate()
    assert list((home / "projects").glob("*.motionmind"))


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "data").write_text("no folder")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setattr("sys.platform", "linux")
    code, out, err = run("studio", "--install-launcher")
    assert (code, out, err.count("\n")) == (2, "", 1)


def test_the_application_of_macos_has_its_parts_and_its_program_runs_the_command(tmp_path: Path) -> None:
    command = [sys.executable, "-c", "import sys; print(sys.argv[1:])", "a b", "$HOME", "it's", '"']
    folder = install_bundle(tmp_path / "Studio.app", command)
    about = plistlib.loads((folder / "Contents" / "Info.plist").read_bytes())
    assert about["CFBundlePackageType"] == "APPL"
    assert about["CFBundleIdentifier"]
    program = folder / "Contents" / "MacOS" / about["CFBundleExecutable"]
    lines = program.read_text("utf-8").splitlines()
    assert lines[0] == "#!/bin/sh"
    assert shlex.split(lines[1]) == ["exec", *command]
    if os.name == "posix":
        assert program.stat().st_mode & 0o111 == 0o111
        said = subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout
        assert said.strip() == str(command[3:])


@pytest.mark.parametrize("program", [r"C:\Python\python.exe", r"C:\Program Files\Pythön\python.exe"])
def test_the_link_of_windows_has_the_structure_of_a_shell_link(program: str) -> None:
    data = shortcut([program, "-m", "motionmind", "--home", r"C:\my home"])
    size, link_class, flags = struct.unpack_from("<I16sI", data)
    assert (size, link_class.hex()) == (0x4C, "0114020000000000c000000000000046")
    assert flags == 0x4 | 0x20 | 0x80 | 0x200 | 0x2000000  # name, arguments, Unicode, environment
    assert struct.unpack_from("<I", data, 0x3C)[0] in (1, 3, 7)  # ShowCommand
    at, texts = size, []
    for _ in range(2):
        (length,) = struct.unpack_from("<H", data, at)
        texts.append(data[at + 2 : at + 2 + 2 * length].decode("utf-16-le"))
        at += 2 + 2 * length
    assert texts[1] == r'-m motionmind --home "C:\my home"'
    block, signature = struct.unpack_from("<II", data, at)
    assert (block, signature) == (0x314, 0xA0000001)
    assert data[at + 8 + 260 : at + block].decode("utf-16-le").rstrip("\0") == program
    assert data[at + 8 : at + 268].rstrip(b"\0").decode("latin-1") == program
    assert data[at + block :] == bytes(4)


def test_a_path_too_long_for_a_link_is_refused() -> None:
    with pytest.raises(MotionMindError, match="too long"):
        shortcut(["C:\\" + "x" * 300])
