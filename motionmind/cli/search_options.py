"""The options of commands that search for movement: one for each option of a tween, with its default.

`tween` sets the others itself: `unlike` by --alternatives, and `what_if`, `reach`, `to` and `along` by their own.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_args

import click
from click.shell_completion import CompletionItem

from motionmind.cli import completion
from motionmind.cli.options import Section, given_option, option
from motionmind.cli.types import COUNT, NATS, NATURAL, POSITIVE, RATE, Counts, Moves, Number, Size
from motionmind.cli.words import parse_avoided, parse_pins, parse_vias
from motionmind.errors import MotionMindError
from motionmind.footing.corrections import Correction
from motionmind.grammar.schemes import Scheme, Weights
from motionmind.synthesis.accent_times import AccentKind
from motionmind.tween.counts import COUNTS_RANGE, TEMPO_RANGE_BPM
from motionmind.tween.options import PACE_RANGE, SearchOptions
from motionmind.tween.request import TweenRequest

if TYPE_CHECKING:
    from motionmind.body.motion import Motion, Posture
    from motionmind.names.spelling import PostureName, Source

_Function = TypeVar("_Function", bound=Callable[..., Any])

_FEW = ("pace", "novelty", "liveliness")  # fields of options for a whole piece, rather than for one tween


@dataclass(frozen=True)
class SearchOption:
    """An option for one field of `TweenRequest` or `SearchOptions`.

    Attributes:
        field: the field's name.
        flags: the option's names on the command line.
        section: the heading that --help lists it under.
        help: its help text.
        type: the type of its value; bool for a switch.
        metavar: the placeholder of its value in --help; None to show its type.
        advanced: whether only --help-all lists it.
        multiple: whether it may be repeated.
        complete: completes its value in shells; None to complete by its type.
    """

    field: str
    flags: str
    section: Section
    help: str
    type: click.ParamType[Any] | type[str] | type[bool]
    metavar: str | None = None
    advanced: bool = False
    multiple: bool = False
    complete: Callable[[click.Context, click.Parameter, str], list[CompletionItem]] | None = None


SEARCH_OPTIONS = (
    SearchOption(
        "via",
        "--via",
        Section.THROUGH,
        "Posture to pass through after move N (the first is 1), or after any, or at a count, as @count4; a frame of a "
        "clip is CLIP@FRAME@N, or CLIP@FRAME@. Repeatable, in order.",
        str,
        "POSTURE[@N]",
        multiple=True,
        complete=completion.postures,
    ),
    SearchOption(
        "pin",
        "--pin",
        Section.THROUGH,
        "Joint to keep in A's state until the last move; with =B, in B's state from the first move on. Repeatable.",
        str,
        "JOINT[=B]",
        advanced=True,
        multiple=True,
        complete=completion.joints,
    ),
    SearchOption(
        "hold",
        "--hold",
        Section.THROUGH,
        "Joints, separated by commas, to keep in one state, which A and B must share. Repeatable.",
        str,
        "JOINTS",
        advanced=True,
        multiple=True,
        complete=completion.joints,
    ),
    SearchOption(
        "avoid",
        "--avoid",
        Section.THROUGH,
        "State, by number or name, that JOINT must avoid between A and B. Repeatable.",
        str,
        "JOINT=STATE",
        advanced=True,
        multiple=True,
        complete=completion.joints,
    ),
    SearchOption(
        "moves",
        "--moves",
        Section.SEARCH,
        "Number of moves, or a range such as 6..10  [default: the best number]",
        Moves(),
        "N",
    ),
    SearchOption(
        "duration",
        "--duration",
        Section.SEARCH,
        "Duration of the motion; it determines the number of moves, unless --moves is given.",
        POSITIVE,
        "SECONDS",
    ),
    SearchOption(
        "tempo",
        "--tempo",
        Section.SEARCH,
        "Counts per minute, for --counts and --via POSTURE@count4.",
        Number(*TEMPO_RANGE_BPM),
        "BPM",
    ),
    SearchOption(
        "counts",
        "--counts",
        Section.SEARCH,
        "Duration in counts, in place of --duration: with 8, B comes on count 9.",
        Number(*COUNTS_RANGE),
        "N",
    ),
    SearchOption(
        "accent",
        "--accent",
        Section.SEARCH,
        "Counts of the accents, such as 3,5, with --tempo or --music, and a length: movement peaks, or rests, there.",
        Counts(),
        "COUNTS",
    ),
    SearchOption(
        "accent_kind",
        "--accent-kind",
        Section.SEARCH,
        "What an accent is: the greatest speed, or the least.",
        click.Choice(get_args(AccentKind)),
        advanced=True,
    ),
    SearchOption(
        "pace",
        "--pace",
        Section.SEARCH,
        "Speed relative to the corpus, unless --duration is given.",
        Number(*PACE_RANGE),
        "FACTOR",
    ),
    SearchOption(
        "strict", "--strict", Section.SEARCH, "Allow only attested transitions: no bridges.", bool, advanced=True
    ),
    SearchOption(
        "whole_body",
        "--whole-body",
        Section.SEARCH,
        "Allow only whole postures in the order of the corpus, like the search of 1998.",
        bool,
        advanced=True,
    ),
    SearchOption(
        "sample",
        "--sample",
        Section.SEARCH,
        "Sample a path, with probability proportional to exp(-cost).",
        bool,
        advanced=True,
    ),
    SearchOption(
        "seed",
        "--seed",
        Section.SEARCH,
        "Seed of random numbers, such as those of --sample.",
        NATURAL,
        "N",
        advanced=True,
    ),
    SearchOption(
        "max_moves",
        "--max-moves",
        Section.SEARCH,
        "Maximum number of moves, unless --moves is given.",
        COUNT,
        "N",
        advanced=True,
    ),
    SearchOption(
        "differ",
        "--differ",
        Section.SEARCH,
        "Minimum share of joints' states between A and B in which an alternative differs from each earlier one.",
        Number(min=0, max=1),
        "SHARE",
        advanced=True,
    ),
    SearchOption(
        "within",
        "--within",
        Section.SEARCH,
        "Cost of an alternative above the optimum that is accepted, as a share; 0.05 is fast.",
        Number(min=0, max=1),
        "SHARE",
        advanced=True,
    ),
    SearchOption(
        "node_budget",
        "--node-budget",
        Section.SEARCH,
        "Maximum number of search nodes in memory.",
        COUNT,
        "N",
        advanced=True,
    ),
    SearchOption(
        "memory",
        "--memory",
        Section.SEARCH,
        "Memory for search nodes, such as 200MB; replaces --node-budget.",
        Size(),
        "SIZE",
        advanced=True,
    ),
    SearchOption(
        "novelty",
        "--novelty",
        Section.WEIGH,
        "Flattening of the cost of attested moves: 0 favours frequent ones, 1 treats all alike.",
        Number(min=0, max=1),
    ),
    SearchOption(
        "coordination",
        "--coordination",
        Section.WEIGH,
        "Coordination of joints: by posture, by progression from posture to posture, or none.",
        click.Choice(get_args(Scheme)),
        advanced=True,
    ),
    SearchOption(
        "weights",
        "--weights",
        Section.WEIGH,
        "Weights of transitions: conditional probability, or the formula as printed in the papers.",
        click.Choice(get_args(Weights)),
        advanced=True,
    ),
    SearchOption("lambda_", "--lambda", Section.WEIGH, "Factor of the cost of coordination.", NATS, advanced=True),
    SearchOption("beta", "--beta", Section.WEIGH, "Nats per move that a joint waits at its goal.", NATS, "N", True),
    SearchOption("tau", "--tau", Section.WEIGH, "Nats per move.", NATS, "N", advanced=True),
    SearchOption(
        "bridge_price",
        "--bridge-price",
        Section.WEIGH,
        "Nats per degree of an unattested move.",
        NATS,
        "N",
        advanced=True,
    ),
    SearchOption(
        "guide",
        "--guide",
        Section.WEIGH,
        "Nats for a joint that is one tolerance away from the corpus walks for 0.2 s.",
        NATS,
        "N",
        advanced=True,
    ),
    SearchOption(
        "liveliness",
        "--liveliness",
        Section.MOTION,
        "Blend from the corpus's mean movement over this displacement (0) to one of its passages (1).",
        Number(min=0, max=1),
    ),
    SearchOption(
        "passage",
        "--passage",
        Section.MOTION,
        "Start of the passage to follow in place of the mean, such as adagio@3.2s.",
        str,
        "CLIP@TIME",
        advanced=True,
    ),
    SearchOption(
        "without",
        "--without",
        Section.MOTION,
        "Part of the synthesis to leave out. Repeatable.",
        click.Choice(get_args(Correction)),
        advanced=True,
        multiple=True,
    ),
    SearchOption("fps", "--fps", Section.MOTION, "Frames per second of the motion.", RATE, advanced=True),
)


def searching(*, few: bool = False, only: Collection[str] = ()) -> Callable[[_Function], _Function]:
    """Add the options of the search to a command, with their defaults.

    Args:
        few: whether --help lists only the most frequent ones, for a command with many options of its own.
        only: the fields to add options for; () for all.
    """
    defaults = {field.name: field.default for field in (*fields(TweenRequest), *fields(SearchOptions))}

    def decorate(function: _Function) -> _Function:
        for row in reversed([row for row in SEARCH_OPTIONS if not only or row.field in only]):
            attributes = {"is_flag": True} if row.type is bool else {"type": row.type}
            function = option(
                row.flags,
                row.field,
                section=row.section,
                advanced=row.advanced or (few and row.field not in _FEW),
                default=() if row.multiple else defaults[row.field],
                metavar=row.metavar,
                multiple=row.multiple,
                help=row.help,
                shell_complete=row.complete,
                **attributes,
            )(function)
        return function

    return decorate


def request_options(
    options: Mapping[str, Any], home: Path | None, read: Callable[[Path | str], Motion] | None = None
) -> dict[str, Any]:
    """Convert the values of the search options to options of `Engine.tween`; read the vias.

    Args:
        options: a value for each field in `SEARCH_OPTIONS`, as the command received them.
        home: the folder of the user's corpora; None for the default folder.
        read: reads a motion file; None reads it as it is.

    Raises:
        MotionMindError: a value cannot be used, or a posture cannot be read.
    """
    context = click.get_current_context()
    if given_option(context, ["memory"]) and given_option(context, ["node_budget"]):
        raise MotionMindError("--memory and --node-budget both limit the number of nodes; give one of them")
    stops = [(_find_via(posture, move, home, read), move) for posture, move in parse_vias(options["via"], home)]
    return {
        **options,
        "pin": parse_pins(options["pin"]),
        "avoid": parse_avoided(options["avoid"]),
        "hold": [joint for word in options["hold"] for joint in word.split(",")],
        "via": [posture if move is None else (posture, move) for posture, move in stops],
    }


def via_sources(options: Mapping[str, Any], home: Path | None) -> list[Source]:
    """Return the sources of the vias."""
    return [posture.source for posture, _ in parse_vias(options["via"], home)]


def _find_via(
    name: PostureName, move: int | str | None, home: Path | None, read: Callable[[Path | str], Motion] | None
) -> Posture:
    from motionmind.formats import read_motion
    from motionmind.names.finding import find_motion
    from motionmind.names.postures import find_posture

    word, read = name.word, read or read_motion
    is_clear = name.moment is not None or move is None
    if not is_clear and (count := len(find_motion(name.source, home, as_clip=False, read=read))) > 1:
        raise MotionMindError(
            f"--via {word}@{move}: the last @ is a move, and {word} has {count} frames; write {word}@{move}@ for frame "
            f"{move} after any move, or {word}@FRAME@{move}"
        )
    return find_posture(name, home, read=read).posture
