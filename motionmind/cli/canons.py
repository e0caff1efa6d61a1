"""Variations for several dancers: they begin together, at nearby starting points, and part."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from motionmind.cli.files import check_outputs, note_licences, numbered
from motionmind.cli.printing import print_written
from motionmind.display import displayed_path
from motionmind.errors import MotionMindError
from motionmind.files import all_or_none, format_toml_string, write_atomically

if TYPE_CHECKING:
    from motionmind.variation.variation import Variation

DANCERS_APART_M = 2.0  # between neighbours of the line in which the dancers begin
MAX_VARIED_DANCERS = 12


def check_canon(outputs: Sequence[Path], dancers: int, sources: Sequence[Path]) -> list[Path]:
    """Return the files of the dancers' variations, given the ensemble's file.

    Raises:
        MotionMindError: there is not one output, it is not a .toml, or a file cannot be written.
    """
    if len(outputs) != 1 or outputs[0].suffix.lower() != ".toml":
        raise MotionMindError("--dancers writes an ensemble; give one output, such as -o trio.toml")
    files = [numbered(outputs[0].with_suffix(".json"), number, dancers) for number in range(1, dancers + 1)]
    check_outputs([(outputs[0], (".toml",)), *((file, (".json",)) for file in files)], sources)
    return files


def vary_canon(first: Variation, dancers: int, vary: Callable[..., Variation]) -> list[Variation]:
    """Return the variations of several dancers: each begins as far from the one before as the first from the piece.

    Args:
        first: the first dancer's.
        dancers: number of dancers.
        vary: varies the piece, given the arguments of `motionmind.vary` that differ from the first dancer's.
    """
    assert first.course is not None
    nudge, limits = first.course.nudge, first.kept.limits if first.kept else None
    given = {"inserted": limits.inserted, "stretch": limits.stretch} if limits else {}
    others = (vary(nudge=tuple(k * x for x in nudge), depart=None, **given) for k in range(2, dancers + 1))
    return [first, *others]


def write_canon(path: Path, files: Sequence[Path], variations: Sequence[Variation]) -> None:
    """Write the variations and their ensemble, or nothing if a file fails; print a line for each dancer."""
    from motionmind.variation.variation_json import write_variation

    lines = ['formation = "line"', f"spacing = {DANCERS_APART_M}"]
    with all_or_none():
        for number, (file, variation) in enumerate(zip(files, variations, strict=True), start=1):
            note_licences(file, variation.motion())
            write_variation(file, variation)
            lines += ["", "[[dancer]]", f'name = "dancer {number}"', f"piece = {format_toml_string(file.name)}"]
        write_atomically(path, ("\n".join(lines) + "\n").encode())
    click.echo(f"{displayed_path(files[0])}: leads")
    for file, variation in zip(files[1:], variations[1:], strict=True):
        parts = _parts_from(variations[0], variation)
        how = "with the first to the end" if parts is None else f"parts at posture {parts}"
        click.echo(f"{displayed_path(file)}: {how}")
    print_written([path])


def _parts_from(one: Variation, other: Variation) -> int | None:
    """Return the first posture at which two variations differ; None if they never do."""
    both = zip(one.first_order.tolist(), other.first_order.tolist(), strict=False)
    return next((number for number, (a, b) in enumerate(both) if a != b), None)
