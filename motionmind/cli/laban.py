"""The command that draws scores in Labanotation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from motionmind.cli.files import check_outputs
from motionmind.cli.options import Section, command, option, outputs
from motionmind.cli.printing import count, note, print_written
from motionmind.cli.types import FILE
from motionmind.display import displayed
from motionmind.files import all_or_none, write_atomically
from motionmind.laban import DRAWINGS, LABAN_SUFFIX, MAX_BAR_COUNTS

if TYPE_CHECKING:
    from motionmind.laban.columns import Deviation
    from motionmind.laban.signs import Staff

SCORE = ".score"


@command("motionmind laban ballet/centre.score --clip pirouettes -o pirouettes.svg")
@click.argument("source", type=FILE)
@outputs(f"Drawing ({', '.join(DRAWINGS)}), signs as text ({LABAN_SUFFIX}), or a score of the signs ({SCORE}).")
@option("--clip", section=Section.PART, metavar="NAME", help="Clip of the score  [default: its only one]")
@option(
    "--bar",
    section=Section.DRAW,
    type=click.IntRange(1, MAX_BAR_COUNTS),
    metavar="COUNTS",
    help="Counts in a bar  [default: 4, or as the text of signs says]",
)
@option("--report", section=Section.OUTPUT, type=FILE, help="File of how far each sign is off, as JSON.")
def laban(source: Path, outputs: tuple[Path, ...], clip: str | None, bar: int | None, report: Path | None) -> None:
    """Draw a score in Labanotation.

    SOURCE is a score, or signs as text (.laban). Each sign is the nearest to the movement; the command says how far it
    is off. docs/notation.md explains the columns and signs.
    """
    from motionmind.laban.columns import notate
    from motionmind.laban.text import read_staff
    from motionmind.names.finding import locate_score
    from motionmind.notation.compose import find_clip
    from motionmind.notation.read import read_score

    is_signs = source.suffix.lower() == LABAN_SUFFIX
    if is_signs and (clip or bar or report):
        raise click.UsageError("--clip, --bar and --report are for a score")
    source = source if is_signs else locate_score(str(source))
    files = [(path, (*DRAWINGS, LABAN_SUFFIX, SCORE)) for path in outputs]
    check_outputs(files + ([(report, ())] if report else []), [source])
    deviations: Sequence[Deviation] = ()
    if is_signs:
        staff = read_staff(source)
        name = displayed(staff.title) or "Movement"
    else:
        score = read_score(source)
        found = find_clip(score, clip)
        name = found.name
        staff, deviations, is_steady = notate(score, found, bar or 4)
        if not is_steady:
            note(f"the tempo changes in this clip; the signs state its mean, {staff.tempo:.1f} counts a minute")
    contents = {path: _contents(path, staff) for path in outputs}
    if report:
        import msgspec

        contents[report] = msgspec.json.encode(deviations)
    with all_or_none():
        for path, data in contents.items():
            write_atomically(path, data)
    click.echo(f"{name}: {count(len(staff.signs), 'sign')} in {staff.counts:g} counts")
    for line in _lines(deviations):
        click.echo(line)
    print_written([*contents])


def _contents(path: Path, staff: Staff) -> bytes:
    """Return the contents of a file: a drawing, the signs' text, or a score of them, if the body can move so."""
    from motionmind.laban.drawing import draw_staff
    from motionmind.laban.scoring import checked_score
    from motionmind.laban.text import staff_text

    suffix = path.suffix.lower()
    if suffix in DRAWINGS:
        return draw_staff(staff).encode(suffix)
    if suffix == LABAN_SUFFIX:
        return staff_text(staff).encode()
    return checked_score(staff).encode()


def _lines(deviations: Sequence[Deviation]) -> Iterator[str]:
    """Format how far the signs of each column are off at most, and where."""
    for column in dict.fromkeys(one.column for one in deviations):
        own = [one for one in deviations if one.column == column]
        worst = max(own, key=lambda one: one.degrees)
        bent = max(own, key=lambda one: one.bend)
        line = f"{column:13} {worst.degrees:2.0f} degrees off at most: {worst.sign}, at {worst.count:g} counts"
        if bent.bend:
            line += f"; bent by {bent.bend:.0f} degrees more or less at {bent.count:g}"
        if worst.degrees or bent.bend:
            yield line
