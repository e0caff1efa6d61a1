"""Print the report of a variation, a table of its stretches and seams, and advice about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli.printing import count, note
from motionmind.display import displayed
from motionmind.variation.orders import DEFAULT_INSERTED_SHARE, REFUSED

if TYPE_CHECKING:
    from motionmind.tween.engine import Engine
    from motionmind.variation.variation import Variation


def print_review(report: dict[str, Any], names: Sequence[str], is_chosen: bool = False) -> None:
    """Print the report of a variation: its method, then a line for each stretch of the piece and its seam.

    Args:
        report: the report, as plain values.
        names: a name for each of the piece's postures [N].
        is_chosen: whether `vary` has just chosen the nudge.
    """
    course, counts = report["course"], report["counts"]
    click.echo(
        f"{displayed(report['piece']['name']) or 'piece'}, {count(report['piece']['postures'], 'posture')}, "
        f"by {_format_method(report['control'], course)}"
    )
    if course:
        click.echo(
            f"Lyapunov exponent {course['exponent']:.2g}: trajectories diverge by {course['parting']:.2g} nats per "
            "posture"
        )
    seams = f"{count(counts['seams'], 'seam')} ({counts['departed']:.0%} of steps)"
    click.echo(
        f"{count(counts['postures'], 'posture')}, {seams}: {counts['inserted']} with an insertion, "
        f"{counts['attested']} attested, {counts['abrupt']} abrupt, {counts['unjudged']} not judged"
    )
    click.echo(f"chunk length in postures: {counts['mean_chunk']:.3g} on average, {counts['longest_chunk']} at most")
    inserted = f"insertions take {counts['inserted_share']:.0%} of the time" if counts["inserted"] else ""
    if is_chosen:
        steps = f"{counts['seams']} of {count(counts['postures'] - 1, 'step')} leave{'s' * (counts['seams'] == 1)}"
        steps = f"{steps} the piece's order"
        inserted = f"nudge {course['nudge'][0]:.2g}, chosen so that {steps}{'; ' * bool(inserted)}{inserted}"
    if inserted:
        click.echo(inserted)
    begins = [0, *(seam["at"] + 1 for seam in report["seams"])]
    ends = [*(seam["at"] for seam in report["seams"]), counts["postures"] - 1]
    if report["limits"]:
        shortest = min(end - begin + 1 for begin, end in zip(begins, ends, strict=True))
        kept = _format_limits(report["limits"], counts["inserted_share"], shortest)
        click.echo(f"{kept}without limits, {course['departed']:.0%} of steps leave the piece")
    if report["on_beat"]:
        click.echo(_format_on_beat(report["on_beat"]))
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


def _format_method(control: dict[str, Any] | None, course: dict[str, Any] | None) -> str:
    """Format the method of an order: "dabby, along rossler (a 0.2, b 0.2, c 5.7), nudge 0.01, 0, 0, skip 10"."""
    parts = []
    if control:
        parts.append(control["by"] if control["seed"] is None else f"{control['by']}, seed {control['seed']}")
    if course:
        values = ", ".join(f"{name} {value:g}" for name, value in course["parameters"].items())
        nudge = ", ".join(f"{x:g}" for x in course["nudge"])
        parts.append(f"{course['flow']} ({values}), nudge {nudge}, skip {course['skip']}")
    return ", along ".join(parts)


def _format_limits(limits: dict[str, Any], share: float, shortest: int) -> str:
    """Format the limits that a variation meets: "at most 30% inserted, stretches of at least 4 postures; ".

    Args:
        limits: the limits of its first order; edits may exceed them.
        share: share of inserted time after the edits.
        shortest: postures of the shortest stretch after the edits.
    """
    kept = []
    if limits["inserted"] is not None and share <= limits["inserted"]:
        kept.append(f"at most {limits['inserted']:.0%} inserted")
    if shortest >= limits["stretch"] > 1:
        kept.append(f"stretches of at least {count(limits['stretch'], 'posture')}")
    return f"limits: {', '.join(kept)}; " if kept else ""


def _format_stillness(counts: dict[str, Any]) -> str:
    """Format the number and duration of a variation's steps without movement: "32 of 79 steps stay, 6.4 s"."""
    stays, steps = counts["stays"], count(counts["postures"] - 1, "step")
    return f"{stays} of {steps} stay{'s' * (stays == 1)}, {counts['seconds_still']:.1f} s"


def _format_stretch(first: int, last: int) -> str:
    return str(first) if first == last else f"{first}..{last}"


def _format_names(first: str, last: str) -> str:
    """Format the names of the first and the last posture of a stretch: "adagio@3..17", "adagio@3 to tendu"."""
    one, other = (displayed(name, 24) for name in (first, last))
    clip, at, frame = other.rpartition("@")
    if first == last:
        return one
    return f"{one}..{frame}" if at and one.startswith(f"{clip}@") else f"{one} to {other}"


def _format_transition(seam: dict[str, Any]) -> str:
    """Describe a seam: attested, abrupt, or what it was and what the insertion makes of it."""
    if seam["corpus"] is None:
        return "not judged"
    if not seam["breaks"]:
        return f"attested by {displayed(seam['corpus'])}"
    why = _format_joints(seam["breaks"])
    if not seam["candidates"]:
        return f"abrupt, {'no path found' if seam['failure'] else 'not smoothed'}: {why}"
    best, chosen = seam["candidates"][seam["chosen"] - 1], f"{seam['chosen']} of {len(seam['candidates'])}"
    first, then = ("abrupt", "discarded") if seam["decision"] == "discarded" else ("was", "now")
    return f"{first}: {why}; {then}: {_format_insertion(best)}, {chosen}"


def _format_joints(joints: Sequence[dict[str, Any]]) -> str:
    """Describe an abrupt transition: "left_elbow jumps 83 degrees, unattested and too fast, and 4 more joints"."""
    worst = max(joints, key=lambda one: float(one["degrees"]))
    faults = ["unattested"] * (not worst["attested"]) + ["too fast"] * worst["fast"]
    why = f"{displayed(worst['joint'])} jumps {worst['degrees']:.0f} degrees, {' and '.join(faults)}"
    return why + f", and {count(len(joints) - 1, 'more joint')}" * (len(joints) > 1)


def _format_insertion(candidate: dict[str, Any]) -> str:
    """Describe an insertion: "7 moves in 2.53 s, optimal, 97% attested, 5 bridges"."""
    share = candidate["attested"]
    attested = "every transition attested" if share == 1.0 else f"{min(share, 0.99):.0%} attested"
    parts = [f"{count(candidate['moves'], 'move')} in {candidate['seconds']:.2f} s", candidate["status"], attested]
    return ", ".join(parts + [count(len(candidate["bridges"]), "bridge")] * bool(candidate["bridges"]))


def print_advice(variation: Variation, engine: Engine | None, depart: float | None) -> None:
    """Note which options to change if a variation misses a request, or hardly varies or moves.

    Args:
        variation: the variation.
        engine: the engine that judged it; None if there is none.
        depart: the requested share of steps that leave the piece's order; None if not requested.
    """
    from motionmind.variation.departure import departure, is_near

    refused, order = REFUSED[variation.by], variation.first_order
    if depart is not None and not is_near(order, depart):
        note(f"no nudge found for --depart {depart:.0%}; the nearest share is {departure(order):.0%}")
    counts = variation.report()["counts"]
    limits = variation.kept.limits if variation.kept else None
    if not variation.seams and limits:
        note("within its limits the variation keeps the piece's order: raise --inserted, or lower --stretch")
    elif not variation.seams:
        hints = {"depart": "--depart 0.25", "length": "a larger --length"}
        tries = ", or ".join(hint for name, hint in hints.items() if name not in refused)
        note("the variation keeps the piece's order" + f": try {tries}" * bool(tries))
    elif engine is None:
        note("without --corpus, no transition is judged or smoothed")
    _print_advice_on_insertions(variation, counts)
    if counts["stays"] > 0.25 * (counts["postures"] - 1):
        note(f"{_format_stillness(counts)}: try another --start, or a larger --skip or --step")


def _print_advice_on_insertions(variation: Variation, counts: dict[str, Any]) -> None:
    """Note why insertions take more of the time than the limit, or than the limit that none set."""
    from motionmind.variation.limits import MAX_LIMITED_POSTURES

    limits, share = variation.kept.limits if variation.kept else None, counts["inserted_share"]
    most = limits.inserted if limits and limits.inserted is not None else DEFAULT_INSERTED_SHARE
    if share <= most or "inserted" in REFUSED[variation.by]:
        return
    unstaged = replace(variation, edits=()).report()["counts"]["inserted_share"]
    if unstaged <= most:  # the edits of a new variation are the insertions that travel
        note(
            f"insertions travel to stay on the stage, and take {share:.0%} of the time, not {unstaged:.0%}: more than "
            f"--inserted {most:g}, which a larger --stage keeps"
        )
        return
    if limits and limits.inserted is not None:
        seconds = min(float(seam.insertion.motion.times[-1]) for seam in variation.seams if seam.insertion)
        found = f"no order of {count(counts['postures'], 'posture')} found with at most {most:.0%} of the time inserted"
        note(f"{found}; this one has {share:.0%}, and its shortest insertion takes {seconds:.2f} s")
    elif max(len(variation.piece), len(variation.order)) > MAX_LIMITED_POSTURES:
        note(
            f"insertions take {share:.0%} of the time, and --inserted limits up to {MAX_LIMITED_POSTURES:,} postures: "
            "vary a part, or at a lower --rate"
        )
    else:
        note(f"insertions take {share:.0%} of the time: --inserted {most:g} keeps more of the piece")


def _format_on_beat(on_beat: dict[str, Any]) -> str:
    """Format how many parts start on the beat, at which pace, and what that costs in length."""
    parts, paces = on_beat["parts"], [part["pace"] for part in on_beat["parts"]]
    inserted = sum(part["kind"] == "insertion" for part in parts)
    longer = on_beat["seconds"] / on_beat["own_seconds"] - 1.0 if on_beat["own_seconds"] else 0.0
    every = {1: "every", 2: "every 2nd", 3: "every 3rd"}.get(on_beat["every"], f"every {on_beat['every']}th")
    return (
        f"on {every} beat: {count(len(parts) - inserted, 'stretch')} and {count(inserted, 'insertion')}, at "
        f"{min(paces):.0%} to {max(paces):.0%} of their pace; {on_beat['seconds']:.1f} s, {longer:+.0%}"
    )
