"""The corpus gaps command: recommend transitions to record."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from motionmind.cli import completion
from motionmind.cli.files import check_outputs
from motionmind.cli.options import HOME, JSON, Section, command, option, output
from motionmind.cli.printing import count as counted
from motionmind.cli.printing import print_written, progress
from motionmind.cli.types import COUNT, NATURAL, Whole
from motionmind.display import displayed

if TYPE_CHECKING:
    from motionmind.gaps.gaps import Gaps, Place


@command("motionmind corpus gaps ballet --pairs 20 --count 1")
@click.argument("name", shell_complete=completion.corpora)
@output("Sheet of pictures of the transitions (.png).", required=False)
@JSON
@option(
    "--pairs",
    section=Section.CHECK,
    type=COUNT,
    metavar="N",
    default=100,
    help="Number of random pairs of postures to join.",
)
@option(
    "--count",
    section=Section.CHECK,
    type=Whole(1, 100),
    metavar="N",
    default=3,
    help="Transitions to recommend.",
)
@option("--seed", section=Section.CHECK, type=NATURAL, metavar="N", default=0, help="Seed of the random pairs.")
@HOME
def gaps(name: str, output: Path | None, as_json: bool, pairs: int, count: int, seed: int, home: Path | None) -> None:
    """Recommend transitions to record, which would make tweens cheaper or avoid bridges.

    The command joins random pairs of postures by the cheapest path of any number of moves. A transition is one move
    between two postures of the corpus, in which no joint turns farther than in a move of the corpus. To measure the
    gain, the command adds the most promising transitions one by one and joins all pairs again.
    """
    import msgspec

    from motionmind.gaps.gaps import find_gaps
    from motionmind.gaps.named import named_postures
    from motionmind.tween.engine import Engine

    files = check_outputs([(output, (".png",))] if output else [], [])
    engine = Engine.load(name, home)
    found = find_gaps(
        engine,
        pairs,
        count,
        seed,
        named=named_postures(name, home),
        on_progress=lambda done, of: progress(f"trying transition {done + 1} of {of}"),
    )
    if output:
        from motionmind.files import write_atomically
        from motionmind.gaps.sheet import gap_sheet
        from motionmind.render.sheet import png

        write_atomically(output, png(gap_sheet(engine, found)))
    if as_json:
        click.echo(json.dumps(msgspec.to_builtins(found)))
        return
    for line in _lines(found):
        click.echo(line)
    if files:
        print_written(files)


def _lines(found: Gaps) -> Iterator[str]:
    """Format the gaps of a corpus for a choreographer."""
    energy = found.energy
    yield (
        f"{displayed(found.corpus)}: {counted(found.pairs, 'random tween')} cost {energy.cost:.2f} nats on average, at "
        f"least {energy.lower_bound:.2f}, with {energy.bridges:.2f} bridges"
    )
    yield "worst joint graphs  states  pairs apart  bridges a tween"
    for joint in found.joints[:5]:
        yield f"  {displayed(joint.joint):16}  {joint.states:6}  {joint.apart:11.0%}  {joint.bridges:15.2f}"
    if not found.transitions:
        yield "no single move between two postures would lower the cost"
        return
    yield "record next"
    for number, one in enumerate(found.transitions, start=1):
        joints = ", ".join(displayed(joint) for joint in one.joints)
        less, fewer = energy.cost - one.energy.cost, energy.bridges - one.energy.bridges
        yield f"  {number}. from {_place(one.begin)}"
        yield f"     to {_place(one.end)}"
        yield f"     in one move, new to {joints or 'none of the joints alone'}"
        yield (
            f"     tweens then cost {one.energy.cost:.2f} nats, at least {one.energy.lower_bound:.2f}: {less:.2f} less "
            f"than before, with {abs(fewer):.2f} bridges {'fewer' if fewer >= 0.0 else 'more'}"
        )
        energy = one.energy


def _place(place: Place) -> str:
    """Describe the place of a posture: "fifth (barre: plies at 3.2 s)"."""
    mirrored = ", mirrored" * place.mirrored
    where = f"{displayed(place.corpus)}: {displayed(place.clip)} at {place.seconds:.2f} s, posture {place.posture}"
    if not place.near:
        return f"{where}{mirrored}"
    off = "" if place.degrees < 1.0 else f", {place.degrees:.0f} degrees a joint off"
    return f"{'about ' * bool(off)}{displayed(place.near)}{off} ({where}{mirrored})"
