"""An entry for the studio among the applications of the desktop: Linux, macOS and Windows."""

from __future__ import annotations

import os
import plistlib
import shlex
import struct
import sys
from collections.abc import Sequence
from pathlib import Path

from motionmind.errors import MotionMindError
from motionmind.files import make_folder, write_atomically

_NAME, _ABOUT = "MotionMind studio", "Compose, vary and pose movement"
_ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="-2 -1 24 24"><path fill="none" stroke="#7847b8" stroke-width="2" '
    'stroke-linecap="round" stroke-linejoin="round" '
    'd="M10 4.2a1.7 1.7 0 1 0 0-.1M3 7.5l5.500 1.200v4L5 18M17 5.500 11.500 8.700v4L16 16"/></svg>\n'
)


def install(home: Path | None) -> Path:
    """Install the entry for this user, and return its file; MotionMindError if that fails.

    Args:
        home: the folder of the user's corpora; None for the default folder.
    """
    command = [sys.executable, "-m", "motionmind", "studio", "--until-closed"]
    command += ["--home", str(home.absolute())] if home else []
    try:
        if sys.platform == "win32":
            programs = Path(os.environ["APPDATA"], "Microsoft", "Windows", "Start Menu", "Programs")
            return _write(programs / f"{_NAME}.lnk", shortcut(command))
        if sys.platform == "darwin":
            return install_bundle(Path.home() / "Applications" / f"{_NAME}.app", command)
        data = Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share")
        icon = _write(data / "icons" / "hicolor" / "scalable" / "apps" / "motionmind.svg", _ICON.encode())
        return _write(data / "applications" / "motionmind-studio.desktop", desktop_entry(command, icon).encode())
    except (OSError, KeyError) as error:
        raise MotionMindError(f"the launcher cannot be installed: {error}") from error


def desktop_entry(command: Sequence[str], icon: Path) -> str:
    """Return a desktop entry of the Desktop Entry Specification 1.5.

    Args:
        command: the program and its arguments.
        icon: the icon's file.
    """
    if any(not part.isprintable() for part in (*command, str(icon))):
        raise MotionMindError(f"{command[0]!r}: no desktop entry can name this path; use one of printable characters")
    lines = {
        "Type": "Application",
        "Version": "1.5",
        "Name": _NAME,
        "Comment": _ABOUT,
        "Exec": _escaped(" ".join(_quoted(part) for part in command)),
        "Icon": _escaped(str(icon)),
        "Terminal": "false",
        "Categories": "Graphics;3DGraphics;",
    }
    return "[Desktop Entry]\n" + "".join(f"{key}={value}\n" for key, value in lines.items())


def _quoted(argument: str) -> str:
    """Quote an argument of Exec: four characters get a backslash, and percent signs are doubled."""
    return '"' + "".join("\\" + one if one in '"`$\\' else one for one in argument).replace("%", "%%") + '"'


def _escaped(value: str) -> str:
    """Escape a value of a desktop entry."""
    return value.replace("\\", "\\\\")


def install_bundle(folder: Path, command: Sequence[str]) -> Path:
    """Write an application of macOS whose program runs a command, and return its folder."""
    about = {
        "CFBundleName": _NAME,
        "CFBundleIdentifier": "org.motionmind.studio",
        "CFBundleExecutable": "motionmind-studio",
        "CFBundlePackageType": "APPL",
        "CFBundleInfoDictionaryVersion": "6.0",
        "CFBundleShortVersionString": "1.0",
        "CFBundleVersion": "1",
    }
    _write(folder / "Contents" / "Info.plist", plistlib.dumps(about))
    program = _write(
        folder / "Contents" / "MacOS" / "motionmind-studio", f"#!/bin/sh\nexec {shlex.join(command)}\n".encode()
    )
    program.chmod(0o755)
    return folder


def shortcut(command: Sequence[str]) -> bytes:
    """Return a link of Windows to a command ([MS-SHLLINK]), with the program's path in its environment block.

    Args:
        command: the program and its arguments.
    """
    program, arguments = command[0], " ".join(f'"{part}"' if " " in part else part for part in command[1:])
    if len(program) >= 260:
        raise MotionMindError(f"{program}: the path is too long for a link of Windows")
    has_name, has_arguments, is_unicode, has_environment, prefers_environment = 4, 0x20, 0x80, 0x200, 0x2000000
    flags = has_name | has_arguments | is_unicode | has_environment | prefers_environment
    minimised = 7  # the console of the program
    link_class = bytes.fromhex("0114020000000000c000000000000046")
    header = struct.pack("<I16sII24sIIIHHII", 0x4C, link_class, flags, 0, bytes(24), 0, 0, minimised, 0, 0, 0, 0)
    texts = b"".join(struct.pack("<H", len(text)) + text.encode("utf-16-le") for text in (_ABOUT, arguments))
    ansi = program.encode("mbcs" if sys.platform == "win32" else "latin-1", "replace")
    block = struct.pack("<II260s520s", 0x314, 0xA0000001, ansi[:259], program.encode("utf-16-le"))
    return header + texts + block + bytes(4)


def _write(path: Path, data: bytes) -> Path:
    make_folder(path.parent)
    write_atomically(path, data)
    return path
