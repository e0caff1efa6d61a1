"""The command that reviews a variation and edits it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.files import check_outputs
from motionmind.cli.options import HOME, JSON, Section, command, given_option, option, output
from motionmind.cli.printing import Interruption, note, print_written
from motionmind.cli.search_options import SEARCH_OPTIONS, request_options, searching
from motionmind.cli.tweens import INTERRUPTED
from motionmind.cli.types import COUNT, FILE, NATURAL, Numbers, Span
from motionmind.cli.variations import load_engine, print_variation
from motionmind.files import all_or_none, sha256_of

if TYPE_CHECKING:
    from motionmind.variation.variation import Variation


@command("motionmind review variation.json --approve 1,2 --discard 3 --list")
@click.argument("file", type=FILE)
@output("Write the edited variation: .json  [default: FILE itself]", required=False)
@option("--list", "listing", section=Section.OUTPUT, is_flag=True, help="Print the seams, after the edits.")
@JSON
@option("--undo", section=Section.EDITS, count=True, help="Take back the last edit; repeat for earlier ones.")
@option(
    "--cut",
    section=Section.EDITS,
    type=Span(),
    metavar="A..B",
    help="Take out postures A to B, as --list numbers them, to --paste them elsewhere.",
)
@option("--paste", section=Section.EDITS, type=NATURAL, metavar="N", help="Put what was cut before posture N.")
@option(
    "--smooth",
    section=Section.EDITS,
    metavar="CORPUS",
    shell_complete=completion.corpora,
    help="Judge and smooth, by this corpus, the seams that are not smoothed yet, or are discarded.",
)
@option(
    "--replace", section=Section.EDITS, type=COUNT, metavar="SEAM", help="Insert --alternative at this seam instead."
)
@option(
    "--alternative",
    section=Section.EDITS,
    type=COUNT,
    metavar="K",
    help="Choose movement K of those found for the seam.",
)
@option(
    "--approve",
    section=Section.EDITS,
    type=Numbers(),
    metavar="SEAMS",
    help="Approve these seams, such as 1,3; or all.",
)
@option(
    "--discard",
    section=Section.EDITS,
    type=Numbers(),
    metavar="SEAMS",
    help="Leave out the insertions at these seams, such as 2; or all.",
)
@option(
    "--alternatives",
    section=Section.SEARCH,
    type=COUNT,
    metavar="K",
    default=3,
    help="Find K movements for each seam that --smooth smooths.",
)
@searching
@HOME
@click.pass_context
def review(
    context: click.Context,
    /,
    file: Path,
    output: Path | None,
    listing: bool,
    as_json: bool,
    smooth: str | None,
    home: Path | None,
    **options: Any,
) -> None:
    """Review a variation that vary wrote, and edit it.

    Edits are made in the order in which they are listed below. None of them loses anything: FILE keeps the piece, the
    variation, all that was found and all that was decided, and --undo takes back one edit after the other. Its
    movement, which render, sheet and convert take, has all insertions but those discarded.

    Seams keep their numbers; postures are numbered from 0. The options on what to pass through, how to search, how to
    weigh and how to move are for --smooth.
    """
    request = {name: options.pop(name) for name in ("alternatives", *(row.field for row in SEARCH_OPTIONS))}
    _check_pairs(context, options, smooth, request)
    from motionmind.variation.variation_json import read_variation, write_variation

    has_edits = any(options[name] for name in ("undo", "cut", "replace", "approve", "discard")) or bool(smooth)
    if output and not has_edits:
        raise click.UsageError("-o is for an edited variation, and no edit is given", context)
    check_outputs([(output, (".json",))] if output else [], [])
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
        motion_sha256 = sha256_of(written, output or file)
    if listing or as_json or not has_edits:
        print_variation(after, as_json, motion_sha256)
    if has_edits and after.edits == before.edits:
        note("nothing changed")
    if is_written and not as_json:
        print_written([output or file])
    if interruption.is_requested:
        context.exit(INTERRUPTED)


def _check_pairs(
    context: click.Context, edits: Mapping[str, Any], smooth: str | None, request: Mapping[str, Any]
) -> None:
    """Check that options which need another come with it."""
    if (edits["cut"] is None) != (edits["paste"] is None):
        raise click.UsageError("--cut and --paste go together: give both", context)
    if (edits["replace"] is None) != (edits["alternative"] is None):
        raise click.UsageError("--replace and --alternative go together: give both", context)
    unused = given_option(context, request.keys())
    if unused and not smooth:
        raise click.UsageError(f"{unused} is for --smooth, which is not given", context)


def _undo_and_cut(variation: Variation, edits: Mapping[str, Any]) -> Variation:
    """Make the edits that come before smoothing."""
    for _ in range(edits["undo"]):
        variation = variation.undo()
    if edits["cut"] and edits["paste"] is not None:
        first, last = edits["cut"]
        variation = variation.cut(first, last, edits["paste"])
    return variation


def _smooth(
    variation: Variation, corpus: str, home: Path | None, request: Mapping[str, Any], interruption: Interruption
) -> Variation:
    """Judge and smooth the seams by a corpus; note if that changes nothing."""
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
            note("nothing new was found for the seams that are left to smooth")
        else:
            note("nothing is left to smooth: --discard the seams to smooth again")
    return smoothed


def _decide(variation: Variation, edits: Mapping[str, Any]) -> Variation:
    """Make the edits that come after smoothing."""
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
