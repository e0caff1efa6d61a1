"""Print the report of a variation, a table of its stretches and seams, and advice about it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli.printing import count, note
from motionmind.display import displayed
from motionmind.variation.orders import REFUSED

if TYPE_CHECKING:
    from motionmind.tween.engine import Engine
    from motionmind.variation.variation import Variation

_MANY_INSERTIONS_SHARE = 0.3  # share of the time beyond which insertions are much
_STANDS_STILL_SHARE = 0.25  # share of steps that stay, beyond which a variation seems to stand still
_NAME_CHARS = 24  # characters of a posture's name in a table


def print_review(report: dict[str, Any], names: Sequence[str]) -> None:
    """Print the report of a variation: how it was made, then a line for each stretch of the piece and its seam.

    Args:
        report: the report, as plain values.
        names: a name for each of the piece's postures [N].
    """
    course, counts = report["course"], report["counts"]
    click.echo(
        f"{displayed(report['piece']['name']) or 'piece'}, {count(report['piece']['postures'], 'posture')}, "
        f"by {_format_making(report['control'], course)}"
    )
    if course:
        click.echo(
            f"Lyapunov exponent {course['exponent']:.2g}: trajectories part by {course['parting']:.2g} nats a posture"
        )
    seams = f"{count(counts['seams'], 'seam')} ({counts['departed']:.0%} of steps)"
    click.echo(
        f"{count(counts['postures'], 'posture')}, {seams}: {counts['inserted']} with an insertion, "
        f"{counts['attested']} attested, {counts['abrupt']} abrupt, {counts['unjudged']} not judged"
    )
    click.echo(f"chunk length in postures: {counts['mean_chunk']:.3g} on average, {counts['longest_chunk']} at most")
    if counts["inserted"]:
        click.echo(f"{counts['inserted_share']:.0%} of the time is inserted")
    begins = [0, *(seam["at"] + 1 for seam in report["seams"])]
    ends = [*(seam["at"] for seam in report["seams"]), counts["postures"] - 1]
    if report["limits"]:
        shortest = min(end - begin + 1 for begin, end in zip(begins, ends, strict=True))
        kept = _format_limits(report["limits"], counts["inserted_share"], shortest)
        click.echo(f"{kept}without limits it leaves the piece in {course['departed']:.0%} of steps")
    if counts["stays"]:
        click.echo(_format_stillness(counts))
    spans = [(report["order"][first], report["order"][last]) for first, last in zip(begins, ends, strict=True)]
    named = [_format_names(names[first], names[last]) for first, last in spans]
    width = max(map(len, named))
    click.echo(f"seam  postures   of the piece  {'named':{width}}  decision   transition")
    for seam, first, last, span, name in zip([None, *report["seams"]], begins, ends, spans, named, strict=True):
        here, there = _format_stretch(first, last), _format_stretch(*span)
        row = f"{seam['number'] if seam else '':>4}  {here:9}  {there:12}   {name:{width}}"
        decision = seam["decision"] if seam and (seam["breaks"] or seam["decision"] != "open") else ""
        click.echo(f"{row}  {decision:9}  {_format_transition(seam)}" if seam else row.rstrip())


def _format_making(control: dict[str, Any] | None, course: dict[str, Any] | None) -> str:
    """Format how an order was made: "dabby, along rossler (a 0.2, b 0.2, c 5.7), nudge 0.01, 0, 0, skip 10"."""
    made = []
    if control:
        made.append(control["by"] if control["seed"] is None else f"{control['by']}, seed {control['seed']}")
    if course:
        values = ", ".join(f"{name} {value:g}" for name, value in course["parameters"].items())
        nudge = ", ".join(f"{x:g}" for x in course["nudge"])
        made.append(f"{course['flow']} ({values}), nudge {nudge}, skip {course['skip']}")
    return ", along ".join(made)


def _format_limits(limits: dict[str, Any], share: float, shortest: int) -> str:
    """Format what a variation is kept within: "kept within 30% inserted, in stretches of 4 postures at least; ".

    Args:
        limits: those that its first order was kept within; edits may have gone beyond them.
        share: share of the time that is inserted now.
        shortest: postures of the shortest stretch now.
    """
    kept = []
    if limits["inserted"] is not None and share <= limits["inserted"]:
        kept.append(f"within {limits['inserted']:.0%} inserted")
    if shortest >= limits["stretch"]:
        kept.append(f"in stretches of {count(limits['stretch'], 'posture')} at least")
    return f"kept {', '.join(kept)}; " if kept else ""


def _format_stillness(counts: dict[str, Any]) -> str:
    """Format how many of a variation's steps stay in their posture, and how long: "32 of 79 steps stay, 6.4 s"."""
    stays, steps = counts["stays"], count(counts["postures"] - 1, "step")
    return f"{stays} of {steps} stay{'s' * (stays == 1)}, {counts['seconds_still']:.1f} s"


def _format_stretch(first: int, last: int) -> str:
    return str(first) if first == last else f"{first}..{last}"


def _format_names(first: str, last: str) -> str:
    """Format the names of the first and the last posture of a stretch: "adagio@3..17", "adagio@3 to tendu"."""
    one, other = (displayed(name, _NAME_CHARS) for name in (first, last))
    clip, at, frame = other.rpartition("@")
    if first == last:
        return one
    return f"{one}..{frame}" if at and one.startswith(f"{clip}@") else f"{one} to {other}"


def _format_transition(seam: dict[str, Any]) -> str:
    """Describe a seam: attested, abrupt, or smoothed by an insertion, and why."""
    if seam["corpus"] is None:
        return "not judged"
    if not seam["breaks"]:
        return f"attested by {displayed(seam['corpus'])}"
    ordered = sorted(seam["breaks"], key=lambda one: -float(one["degrees"]))
    worst, others = ordered[0], [displayed(one["joint"]) for one in ordered[1:]]
    faults = ["not attested"] * (not worst["attested"]) + ["too fast"] * worst["fast"]
    why = f"{displayed(worst['joint'])} {worst['degrees']:.0f} degrees, {' and '.join(faults)}"
    if not seam["candidates"]:
        state = "no path found" if seam["failure"] else "not smoothed"
        return f"abrupt, {state}: {', '.join([why, *others])}"
    why += f", and {len(others)} more" * bool(others)
    best = seam["candidates"][seam["chosen"] - 1]
    tween = (
        f"{count(best['moves'], 'move')} in {best['seconds']:.2f} s, {best['status']}, {best['attested']:.0%} attested"
    )
    bridges = f", {count(len(best['bridges']), 'bridge')}" * bool(best["bridges"])
    insertion = f"{tween}{bridges}, {seam['chosen']} of {len(seam['candidates'])}"
    return f"abrupt, was {insertion}: {why}" if seam["decision"] == "discarded" else f"{insertion}: {why}"


def print_advice(variation: Variation, engine: Engine | None, depart: float | None) -> None:
    """Note what to change if a variation is not what was asked for, or not what one would want.

    Args:
        variation: the variation.
        engine: what judged it; None for nothing.
        depart: the share of steps for which a nudge was sought, if one was.
    """
    from motionmind.variation.departure import DEPARTURE_TOLERANCE, departure

    refused = REFUSED[variation.by]
    reached = departure(variation.first_order)
    if depart is not None and abs(reached - depart) > DEPARTURE_TOLERANCE:
        note(f"no nudge was found by which {depart:.0%} of steps leave the piece's order; the nearest is {reached:.0%}")
    counts = variation.report()["counts"]
    limits = variation.kept.limits if variation.kept else None
    if not variation.seams and limits:
        note("within its limits the variation does not leave the piece's order: allow more by --inserted or --stretch")
    elif not variation.seams:
        hints = {"depart": "--depart 0.25", "length": "a larger --length"}
        tries = ", or ".join(hint for name, hint in hints.items() if name not in refused)
        note("the variation does not leave the piece's order" + f": try {tries}" * bool(tries))
    elif engine is None:
        note("no corpus says which transitions are abrupt, so none is smoothed: name one by --corpus")
    share = counts["inserted_share"]
    if limits is None and share > _MANY_INSERTIONS_SHARE and "inserted" not in refused:
        note(f"insertions take {share:.0%} of the time: --inserted {_MANY_INSERTIONS_SHARE:g} keeps more of the piece")
    if limits and limits.inserted is not None and share > limits.inserted:
        note(f"no order was found with {limits.inserted:.0%} of the time inserted at most; this one has {share:.0%}")
    if counts["stays"] > _STANDS_STILL_SHARE * (counts["postures"] - 1):
        note(f"{_format_stillness(counts)}: try another --start, or a larger --skip or --step")
