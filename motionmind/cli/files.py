"""Files that the commands read and write."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from motionmind.cli.options import avoided, passing, pins
from motionmind.cli.printing import note
from motionmind.errors import MotionMindError
from motionmind.render import PICTURES

if TYPE_CHECKING:
    from motionmind.body.motion import Motion, Posture

MOVEMENT = (".json", ".bvh", ".glb", ".npz")


def read(path: Path, unit: str | None, asf: Path | None, source_fps: float | None) -> Motion:
    """Movement from a file, as the options of `reading` say."""
    from motionmind.formats import read_motion

    return read_motion(path, unit=unit, asf=asf, fps=source_fps)


def write(path: Path, thing: Motion | Posture) -> None:
    """Movement into a file, as movement or as a picture, as its suffix says; what it has no place for is said."""
    from motionmind.body.motion import Posture
    from motionmind.formats import lossy_fields, write_motion, write_posture
    from motionmind.render.pictures import write_picture

    motion = thing.as_motion() if isinstance(thing, Posture) else thing
    if path.suffix.lower() in PICTURES:
        write_picture(path, motion)
        return
    if isinstance(thing, Posture):
        write_posture(path, thing)
    else:
        write_motion(path, thing)
    if missing := lossy_fields(motion, path):
        note(f"{path}: no place for {'; '.join(missing)}")


def read_mapping(path: Path | None) -> dict[str, str] | None:
    """Which joint is which, from a file; None without one."""
    from motionmind.retarget.retarget import read_joint_mapping

    return read_joint_mapping(path) if path else None


def clip_names(files: Sequence[Path]) -> dict[Path, str]:
    """What each file's clip is called: its stem, or as much more of its path as tells it from the others."""
    if len(set(files)) < len(files):
        twice = next(file for file, count in Counter(files).items() if count > 1)
        raise MotionMindError(f"{twice}: given twice")
    shorter = [{f: f.stem for f in files}, {f: f.name for f in files}, {f: f.with_suffix("").as_posix() for f in files}]
    taken = [Counter(names.values()) for names in shorter]
    unique = ([names[f] for names, count in zip(shorter, taken, strict=True) if count[names[f]] == 1] for f in files)
    return {file: next(iter(names), file.as_posix()) for file, names in zip(files, unique, strict=True)}


def check_outputs(wanted: Sequence[tuple[Path, tuple[str, ...]]], read: Sequence[Path]) -> list[Path]:
    """The files to write, each with the suffixes that it may have; refused before anything is done, not after it."""
    paths = [path for path, _ in wanted]
    places, sources = [_place(path) for path in paths], [_place(path) for path in read]
    for path, suffixes in wanted:
        folder = _place(path).parent
        if suffixes and path.suffix.lower() not in suffixes:
            fault = f"the name must end in one of {', '.join(suffixes)}"
        elif places.count(_place(path)) > 1:
            fault = "it is to be written twice"
        elif _place(path) in sources:
            fault = "it is read from"
        elif not folder.is_dir():
            fault = f"there is no folder {folder}"
        elif not os.access(path if path.exists() else folder, os.W_OK):
            fault = "not permitted"
        else:
            continue
        raise MotionMindError(f"{path}: cannot be written: {fault}")
    return paths


def _place(path: Path) -> Path:
    """Where a path leads to; MotionMindError where that is nowhere, as with links in a circle."""
    try:
        found = path.resolve()
        found.exists()
    except (OSError, RuntimeError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or "it leads nowhere"
        raise MotionMindError(f"{path}: cannot be used: {reason[0].lower()}{reason[1:]}") from error
    return found


@contextmanager
def all_or_none(files: Sequence[Path]) -> Iterator[None]:
    """Of files that are written one after another, leave none that is new behind if one cannot be."""
    new = [file for file in files if not file.exists()]
    try:
        yield
    except MotionMindError:
        for file in new:
            file.unlink(missing_ok=True)
        raise


def asked(given: Mapping[str, Any]) -> dict[str, Any]:
    """What the options of `searching` ask of `Engine.tween`; the postures to pass through are read from their files."""
    from motionmind.formats import read_posture

    if given["node_budget"] is not None and given["memory"] is not None:
        raise MotionMindError("--memory says how many nodes there may be, and so does --node-budget: give one of them")
    stops = [(read_posture(path), move) for path, move in passing(given["via"])]
    found = {
        **given,
        "pin": pins(given["pin"]),
        "avoid": avoided(given["avoid"]),
        "hold": [joint for word in given["hold"] for joint in word.split(",")],
        "via": [posture if move is None else (posture, move) for posture, move in stops],
    }
    if given["node_budget"] is None:
        del found["node_budget"]
    return found
