"""The review command: list the seams of a variation, and edit it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.files import check_outputs
from motionmind.cli.options import HOME, JSON, Section, command, given_option, option, output
from motionmind.cli.printing import Interruption, count, note, print_written
from motionmind.cli.search_options import SEARCH_OPTIONS, request_options, searching
from motionmind.cli.types import COUNT, FILE, NATURAL, Numbers, Span
from motionmind.cli.variations import load_engine, names_in, print_variation
from motionmind.display import displayed_path
from motionmind.files import all_or_none, sha256_of
from motionmind.render import PICTURES

if TYPE_CHECKING:
    from motionmind.variation.variation import Variation


@command("motionmind review variation.json --approve 1,2 --discard 4 --list")
@click.argument("file", type=FILE)
@output(
    "Edited variation (.json)  [default: FILE itself]; with --play, picture (.png), film (.gif, .mp4, .svg) or page "
    "(.html).",
    required=False,
)
@option("--list", "listing", section=Section.OUTPUT, is_flag=True, help="Print the seams after the edits.")
@JSON
@option(
    "--sheet",
    section=Section.OUTPUT,
    type=FILE,
    help="Picture of each seam after the edits: the posture before, the insertion, the posture after (.png).",
)
@option(
    "--play",
    section=Section.OUTPUT,
    type=COUNT,
    metavar="SEAM",
    help="Seam whose surrounding movement to draw into -o, with --alternative K if given; edits nothing.",
)
@option("--undo", section=Section.EDITS, count=True, help="Undo the last edit; repeat for earlier ones.")
@option(
    "--cut",
    section=Section.EDITS,
    type=Span(),
    metavar="A..B",
    help="Range of postures, as numbered by --list, to cut and --paste elsewhere.",
)
@option(
    "--paste",
    section=Section.EDITS,
    type=NATURAL,
    metavar="N",
    help="Posture before which to insert the cut.",
)
@option(
    "--smooth",
    section=Section.EDITS,
    metavar="CORPUS",
    shell_complete=completion.corpora,
    help="Corpus by which to judge and smooth the seams without an insertion, or with a discarded one.",
)
@option("--replace", section=Section.EDITS, type=COUNT, metavar="SEAM", help="Seam at which to insert --alternative.")
@option(
    "--alternative",
    section=Section.EDITS,
    type=COUNT,
    metavar="K",
    help="Number of the movement found for the seam to --replace or to --play.",
)
@option(
    "--approve",
    section=Section.EDITS,
    type=Numbers(),
    metavar="SEAMS",
    help="Seams to approve, such as 1,3; or all.",
)
@option(
    "--discard",
    section=Section.EDITS,
    type=Numbers(),
    metavar="SEAMS",
    help="Seams whose insertions to leave out, such as 2; or all.",
)
@option(
    "--alternatives",
    section=Section.SEARCH,
    type=COUNT,
    metavar="K",
    default=3,
    help="Number of movements to find for each seam that --smooth smooths.",
)
@searching(few=True)
@HOME
@click.pass_context
def review(
    context: click.Context,
    /,
    file: Path,
    output: Path | None,
    listing: bool,
    as_json: bool,
    sheet: Path | None,
    play: int | None,
    smooth: str | None,
    home: Path | None,
    **options: Any,
) -> None:
    """Review and edit a variation that vary wrote.

    Edits apply in the order of the list below. They lose nothing: FILE keeps the piece, the variation, all movements
    found and all decisions, and --undo reverts one edit at a time. Its movement, which render, sheet and convert read,
    has all insertions except discarded ones.

    Seams are numbered in order, and renumbered after a --cut. Postures are numbered from 0, and named by the corpus, or
    by clip and frame. The options under Constraints, Search, Costs and Motion apply to --smooth.
    """
    request = {name: options.pop(name) for name in ("alternatives", *(row.field for row in SEARCH_OPTIONS))}
    has_edits = any(options[name] for name in ("undo", "cut", "replace", "approve", "discard")) or bool(smooth)
    _check_pairs(context, options | {"play": play}, smooth, request)
    if play is not None:
        if has_edits or listing or as_json or sheet:
            raise click.UsageError("--play draws one seam; leave out edits, --list, --json and --sheet", context)
        _play(context, file, play, options["alternative"], output)
        return
    from motionmind.variation.variation_json import read_variation, write_variation

    if output and not has_edits:
        raise click.UsageError("-o is for an edited variation; give an edit", context)
    outputs = [(output, (".json",))] if output else []
    outputs += [(sheet, (".png",))] if sheet else []
    check_outputs(outputs, [])
    before = read_variation(file)
    interruption = Interruption()
    after = _undo_and_cut(before, options)
    if smooth:
        after = _smooth(after, smooth, home, request, interruption)
    after = _decide(after, options)
    is_written = after.edits != before.edits or output is not None
    with all_or_none() as written:
        if is_written:
            write_variation(output or file, after)
        if sheet:
            _draw_seams(sheet, after, home)
        motion_sha256 = sha256_of(written, output or file)
    if listing or as_json or not (has_edits or sheet):
        print_variation(after, as_json, motion_sha256, home)
    if has_edits and after.edits == before.edits:
        note("nothing changed")
    files = [output or file] if is_written else []
    files += [sheet] if sheet else []
    if files and not as_json:
        print_written(files)
    interruption.finish()


def _check_pairs(
    context: click.Context, edits: Mapping[str, Any], smooth: str | None, request: Mapping[str, Any]
) -> None:
    """Check that options that need another come with it."""
    if (edits["cut"] is None) != (edits["paste"] is None):
        raise click.UsageError("--cut and --paste need each other; give both", context)
    if edits["play"] is None and (edits["replace"] is None) != (edits["alternative"] is None):
        raise click.UsageError("--replace and --alternative need each other; give both, or --play", context)
    unused = given_option(context, request.keys())
    if unused and not smooth:
        raise click.UsageError(f"{unused} needs --smooth", context)


def _draw_seams(path: Path, variation: Variation, home: Path | None) -> None:
    """Draw all seams of a variation."""
    from motionmind.files import write_atomically
    from motionmind.render.seam_sheet import seam_sheet
    from motionmind.render.sheet import png

    write_atomically(path, png(seam_sheet(variation, names_in(variation, home))))


def _play(context: click.Context, file: Path, seam: int, alternative: int | None, output: Path | None) -> None:
    """Draw the movement around a seam of a variation in a file, with an alternative insertion if given."""
    from motionmind.render.pictures import draw_picture
    from motionmind.variation.variation_json import read_variation

    if output is None:
        raise click.UsageError(f"--play needs a file, such as -o seam-{seam}.gif", context)
    check_outputs([(output, PICTURES)], [file])
    motion = read_variation(file).around(seam, alternative)
    draw_picture(output, motion)
    seconds = motion.times[-1] - motion.times[0]
    click.echo(f"{displayed_path(output)}: seam {seam}, {count(len(motion), 'frame')}, {seconds:.2f} s")


def _undo_and_cut(variation: Variation, edits: Mapping[str, Any]) -> Variation:
    """Apply the edits that precede smoothing."""
    for _ in range(edits["undo"]):
        variation = variation.undo()
    if edits["cut"] and edits["paste"] is not None:
        first, last = edits["cut"]
        variation = variation.cut(first, last, edits["paste"])
    return variation


def _smooth(
    variation: Variation, corpus: str, home: Path | None, request: Mapping[str, Any], interruption: Interruption
) -> Variation:
    """Judge and smooth the seams by a corpus; add a note if nothing changes."""
    arguments = request_options({key: value for key, value in request.items() if key != "alternatives"}, home)
    engine = load_engine(corpus, home)
    with interruption:
        smoothed = variation.smooth(
            engine,
            alternatives=request["alternatives"],
            on_progress=interruption.on_progress,
            watch=interruption.watch,
            **arguments,
        )
    if smoothed is variation and not interruption.is_requested:
        if any(seam.is_abrupt for seam in variation.seams):
            note("no new movement found for the remaining seams")
        else:
            note("no seam left to smooth; --discard a seam to smooth it again")
    return smoothed


def _decide(variation: Variation, edits: Mapping[str, Any]) -> Variation:
    """Apply the edits that follow smoothing."""
    if edits["replace"] and edits["alternative"]:
        variation = variation.replace(edits["replace"], edits["alternative"])
    if edits["approve"]:
        variation = variation.approve(*_select_seams(variation, edits["approve"]))
    if edits["discard"]:
        variation = variation.discard(*_select_seams(variation, edits["discard"]))
    return variation


def _select_seams(variation: Variation, seams: tuple[int, ...] | str) -> tuple[int, ...]:
    """Return the seams of these numbers; for "all", those with an insertion."""
    return tuple(seam.number for seam in variation.seams if seam.insertion) if isinstance(seams, str) else seams
