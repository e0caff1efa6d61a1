"""Ensemble files on the command line, wherever a command draws movement."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli.files import check_outputs, note_licences
from motionmind.cli.options import given_option
from motionmind.cli.sources import parse_movement, read_bodies, read_movement
from motionmind.clip_names import split_clip
from motionmind.display import displayed
from motionmind.ensemble import NEAR_M
from motionmind.errors import MotionMindError
from motionmind.files import name_of

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.ensemble.dancers import Ensemble
    from motionmind.ensemble.keeping import Shift


def is_ensemble(source: str, outputs: Sequence[Path], suffixes: tuple[str, ...]) -> bool:
    """Return whether a source is an ensemble: spelled like its file, or a BVH file of several bodies.

    Args:
        source: the source.
        outputs: the files to write.
        suffixes: the suffixes of files that show an ensemble; into others goes one of several bodies.
    """
    if source.lower().endswith(".toml"):
        return True
    if not source.lower().endswith(".bvh") or any(one.suffix.lower() not in suffixes for one in outputs):
        return False
    from motionmind.formats._bvh_file import count_bodies

    return count_bodies(source) > 1


def open_ensemble(
    source: str,
    outputs: Sequence[Path],
    suffixes: tuple[str, ...],
    home: Path | None,
    without: Sequence[str],
    written: Callable[[int], Sequence[Path]] | None = None,
    **options: Any,
) -> Ensemble:
    """Read an ensemble file and the movement of its dancers, or a file of several bodies, and check the outputs.

    Args:
        source: the file.
        outputs: the files to write.
        suffixes: the suffixes that they may have.
        home: the folder of the user's corpora; None for the default folder.
        without: names of the command's options that do not apply to an ensemble.
        written: returns the files that the outputs become, given the number of dancers; None if they stay as they are.
        options: values of the options that `options.reading` adds.

    Raises:
        MotionMindError: an option does not apply, or a file cannot be read or written.
    """
    from motionmind.ensemble.reading import read_ensemble

    if flag := given_option(click.get_current_context(), without):
        raise MotionMindError(f"{displayed(source)}: {flag} is not for an ensemble")
    path = Path(source)
    check_outputs([(output, suffixes) for output in outputs], [path])
    read_from = [path]

    def read(piece: str) -> Motion:
        named = parse_movement(_found(path, piece) or piece, home)
        read_from.extend(named.source.paths)
        return read_movement(named.source, None, home, **options)

    ensemble = read_ensemble(path, read) if path.suffix.lower() == ".toml" else _read_together(source, options)
    check_outputs([(file, ()) for file in (written(len(ensemble.dancers)) if written else outputs)], read_from)
    for output in outputs:
        for piece in {id(dancer.piece): dancer.piece for dancer in ensemble.dancers}.values():
            note_licences(output, piece)
    return ensemble


def _found(file: Path, piece: str) -> str | None:
    """Return the path of a piece, or of a clip in it, beside an ensemble's file; None if there is none."""
    beside = str(file.parent / piece)
    return beside if Path(split_clip(beside)[0]).exists() else None


def _read_together(source: str, options: dict[str, Any]) -> Ensemble:
    """Read the bodies of a file as dancers in the space that they share."""
    from motionmind.ensemble.dancers import Dancer, Ensemble

    named = parse_movement(source, None)
    dancers = []
    for motion in read_bodies(named.source, **options):
        x, _, z = motion.root[0].tolist()
        name = motion.name.partition("#")[2] or motion.name
        dancers.append(Dancer(name, motion, (x, z), source=f"{Path(source).name}#{name}"))
    return Ensemble(name_of(source), tuple(dancers))


def write_ensemble(source: str, output: Path, ensemble: Ensemble) -> None:
    """Write an ensemble, each dancer with a piece, a place, a facing and an entry.

    Raises:
        MotionMindError: the file cannot be written.
    """
    from motionmind.ensemble.writing import format_ensemble
    from motionmind.files import write_atomically

    folder = output.parent.resolve()

    def piece(name: str) -> str:
        found = _found(Path(source), name)
        return os.path.relpath(Path(found).resolve(), folder) if found else name

    write_atomically(output, format_ensemble(ensemble, piece).encode())


def write_steps(output: Path, files: Sequence[Path], ensemble: Ensemble) -> Ensemble:
    """Write each dancer's movement to a file; return the ensemble that names these files as pieces.

    Raises:
        MotionMindError: a file cannot be written.
    """
    from motionmind.formats import write_motion

    dancers = []
    for file, dancer in zip(files, ensemble.dancers, strict=True):
        note_licences(file, dancer.piece)
        write_motion(file, dancer.piece)
        dancers.append(replace(dancer, source=os.path.relpath(file.resolve(), output.parent.resolve())))
    return replace(ensemble, dancers=tuple(dancers))


def keep_ensemble(ensemble: Ensemble, metres: float) -> tuple[Ensemble, list[str]]:
    """Keep dancers apart; return the ensemble, and what moved, in words.

    Raises:
        MotionMindError: they cannot be kept so far apart.
    """
    from motionmind.ensemble.keeping import keep_apart

    kept = keep_apart(ensemble, metres)
    moved = [
        f"moved     {displayed(dancer.name)}: {_shift_in_words(shift)}"
        for dancer, shift in zip(ensemble.dancers, kept.shifts, strict=True)
        if shift.weight
    ]
    what = f"all at least {metres:g} m apart"
    if not moved:
        what += "; nobody had to move"
    elif not kept.is_least:
        what += "; less may do"
    else:
        what += "; no lighter shifts do (a count weighs 50 cm)"
    return kept.ensemble, [what, *moved]


def _shift_in_words(shift: Shift) -> str:
    """Say by how many counts and centimetres a dancer was shifted, as the performer sees it."""
    x, z = (round(100.0 * value) for value in shift.place)
    words = [
        (
            shift.counts,
            f"{abs(shift.counts)} count{'s' * (abs(shift.counts) != 1)} {'later' if shift.counts > 0 else 'earlier'}",
        ),
        (x, f"{abs(x)} cm to stage {'left' if x > 0 else 'right'}"),
        (z, f"{abs(z)} cm {'downstage' if z > 0 else 'upstage'}"),
    ]
    return ", ".join(text for value, text in words if value)


def describe_ensemble(ensemble: Ensemble) -> list[str]:
    """Describe an ensemble: its length, and each pair that comes nearer than an arm's length, closest first."""
    from motionmind.ensemble.dancers import find_approaches

    dancers = len(ensemble.dancers)
    lines = [f"{dancers} dancer{'s' * (dancers != 1)}, {ensemble.seconds:.1f} s"]
    if ways := [hypot(*way.shift) for dancer in ensemble.dancers for way in dancer.ways]:
        lines.append(
            f"ways      {len(ways)}, up to {max(ways):.1f} m; pieces wait, feet slide; convert --steps dances them"
        )
    for near in find_approaches(ensemble.motions()):
        if near.metres < NEAR_M:
            one, other = map(displayed, near.names)
            lines.append(f"near      {one} and {other}: {near.metres:.2f} m at {ensemble.counted(near.seconds)}")
    return lines
