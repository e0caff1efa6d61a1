"""What the command line prints."""

from __future__ import annotations

import logging
import math
import signal
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, TextIO

import click

from motionmind.errors import MotionMindWarning

if TYPE_CHECKING:
    from motionmind.search.solve import Progress
    from motionmind.tween.result import Tween


class Notes(logging.Handler):
    """Notes on what was taken for granted, such as a file's unit: for the first file of which each is true."""

    def __init__(self, level: int) -> None:
        super().__init__(level)
        self.said: set[object] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Print it, to standard error."""
        what = (record.msg, record.args[1:] if isinstance(record.args, tuple) else record.args)
        if what not in self.said:
            self.said.add(what)
            note(record.getMessage())


def progress(message: str) -> None:
    """Say on a terminal what takes long."""
    if sys.stderr.isatty():
        click.echo(message, err=True)


def note(message: str) -> None:
    """Say what is worth knowing, on a line of its own where a progress bar stands."""
    clear = "\r\x1b[2K" if sys.stderr.isatty() else ""
    click.echo(f"{clear}note: {message}", err=True)


def count(number: int, what: str) -> str:
    """A number of things, in words: "1 move", "2 moves"."""
    return f"{number} {what}{'s' * (number != 1)}"


class Interruption:
    """While it is entered, Ctrl-C does not end the program but asks the search to end with what it has found.

    Attributes:
        asked: whether Ctrl-C was pressed.
    """

    def __init__(self) -> None:
        self.asked = False
        self._said = monotonic()
        self._doing = ""

    def __enter__(self) -> Interruption:
        self._before = signal.signal(signal.SIGINT, self._ask)
        return self

    def __exit__(self, *_: object) -> None:
        signal.signal(signal.SIGINT, self._before)
        if sys.stderr.isatty():
            click.echo("\r\x1b[2K", err=True, nl=False)

    def watch(self, so_far: Progress) -> bool:
        """Say on a terminal, once a second, how far the search is; whether it is to end."""
        if sys.stderr.isatty() and monotonic() > self._said + 1.0:
            self._said = monotonic()
            best = f"best so far {so_far.cost:.3f}" if so_far.cost < math.inf else "no path yet"
            line = f"{self._doing}{best}, proven {so_far.lower_bound:.3f} nats (Ctrl-C ends here)"
            click.echo(f"\r\x1b[2K{line}", err=True, nl=False)
        return self.asked

    def told(self, done: int, of: int) -> None:
        """Say on a terminal which of several searches begins, after so many are done."""
        self._doing = f"transition {done + 1} of {of}: "
        if sys.stderr.isatty():
            click.echo(f"\r\x1b[2K{self._doing}", err=True, nl=False)

    def _ask(self, *_: object) -> None:
        self.asked = True


def print_tween(result: Tween, files: Sequence[Path]) -> None:
    """A tween in a few lines: moves, cost, what is proven, what it is made of, and the files written."""
    seconds = float(result.motion.times[-1])
    bridged = [f"{b.joint} in move {b.move + 1} ({b.degrees:.0f} degrees)" for b in result.bridges]
    waited = Counter(wait.joint for wait in result.waits)
    lines = [
        ("moves", f"{result.moves}, in {seconds:.2f} s ({count(len(result.motion), 'frame')})"),
        ("cost", f"{result.cost:.3f} nats"),
        ("proven", f"{result.status}: no path costs less than {result.lower_bound:.3f}, gap {result.gap:.2%}"),
        ("attested", f"{result.attested:.1%} of the joints' moves were seen in the corpus{_attesters(result)}"),
        ("bridged", ", ".join(bridged) or "none"),
        ("waited", ", ".join(f"{joint} {count(times, 'move')}" for joint, times in waited.items()) or "none"),
    ]
    stops = [("A", "", result.snap_degrees[0]), ("B", "", result.snap_degrees[1])]
    for number, (move, row) in enumerate(zip(result.passed, result.via_degrees, strict=True), start=1):
        stops.insert(number, (f"via {number}", f"at move {move}, ", row))
    for stop, where, row in stops:
        worst = int(row.argmax())
        mean, most = f"{row.mean():.1f} degrees a joint", f"{row[worst]:.1f} ({result.joints[worst]})"
        lines.append((stop, f"{where}{mean} off the corpus's states, at most {most}"))
    if result.moves > 1:
        kind = "keeps to the path" if result.asked["follow"] else "the mean of the corpus's ways"
        off = result.path_degrees[1:-1]
        lines.append(
            ("motion", f"{kind}: {off.mean():.1f} degrees a joint off its states on the way, at most {off.max():.1f}")
        )
    if result.detail:
        lines.append(("detail", f"from {', '.join(dict.fromkeys(source.clip for source in result.detail))}"))
    if files:
        lines.append(("written", ", ".join(map(click.format_filename, files))))
    for name, line in lines:
        click.echo(f"{name:10}{line}")


def print_alternatives(results: Sequence[Tween], files: Sequence[Path]) -> None:
    """Tweens that differ, a line each: what each costs, the price of what it shares with those before included."""
    click.echo("    moves  seconds      cost  proven      gap    attested  bridged  shared with those before")
    for number, result in enumerate(results, start=1):
        changes = int((result.path[1:] != result.path[:-1]).sum())
        click.echo(
            f"{number:2}  {result.moves:5}  {result.motion.times[-1]:7.2f}  {result.cost:8.3f}  {result.status:11} "
            f"{result.gap:6.2%} {result.attested:8.1%}  {len(result.bridges):7}  {result.shared} of "
            f"{count(changes * (number - 1), 'move')}"
        )
    if files:
        click.echo(f"written   {', '.join(map(click.format_filename, files))}")


def print_review(found: dict[str, Any]) -> None:
    """A variation (`Variation.report`): what it was made by, then a line for each stretch of the piece and its seam."""
    course, counts = found["course"], found["counts"]
    values = ", ".join(f"{name} {value:g}" for name, value in course["parameters"].items())
    nudge = ", ".join(f"{x:g}" for x in course["nudge"])
    click.echo(
        f"{found['piece']['name'] or 'piece'}, {count(found['piece']['postures'], 'posture')}, by {course['flow']} "
        f"({values}), nudge {nudge}, skip {course['skip']}"
    )
    click.echo(
        f"Lyapunov exponent {course['exponent']:.2g}: trajectories part by {course['parting']:.2g} nats a posture"
    )
    click.echo(
        f"{count(counts['postures'], 'posture')}, {count(counts['seams'], 'seam')}: {counts['inserted']} with an "
        f"insertion, {counts['attested']} attested, {counts['abrupt']} abrupt, {counts['unjudged']} not judged"
    )
    if counts["stays"]:
        click.echo(stillness(counts))
    click.echo("seam  postures   of the piece  decision   transition")
    begins = [0, *(seam["at"] + 1 for seam in found["seams"])]
    ends = [*(seam["at"] for seam in found["seams"]), counts["postures"] - 1]
    for seam, first, last in zip([None, *found["seams"]], begins, ends, strict=True):
        here, there = _stretch(first, last), _stretch(found["order"][first], found["order"][last])
        row = f"{seam['number'] if seam else '':>4}  {here:9}  {there:12}"
        decision = seam["decision"] if seam and (seam["breaks"] or seam["decision"] != "open") else ""
        click.echo(f"{row}  {decision:9}  {_transition(seam)}" if seam else row.rstrip())


def stillness(counts: dict[str, Any]) -> str:
    """How many of a variation's steps stay in their posture, and for how long: "32 of 79 steps stay, 6.4 s"."""
    stays, steps = counts["stays"], count(counts["postures"] - 1, "step")
    return f"{stays} of {steps} stay{'s' * (stays == 1)}, {counts['seconds_still']:.1f} s"


def _stretch(first: int, last: int) -> str:
    return str(first) if first == last else f"{first}..{last}"


def _transition(seam: dict[str, Any]) -> str:
    """What is known of a seam, in words."""
    if seam["corpus"] is None:
        return "not judged"
    if not seam["breaks"]:
        return f"attested by {seam['corpus']}"
    ordered = sorted(seam["breaks"], key=lambda one: -float(one["degrees"]))
    worst, others = ordered[0], [one["joint"] for one in ordered[1:]]
    faults = ["not attested"] * (not worst["attested"]) + ["too fast"] * worst["fast"]
    why = f"{worst['joint']} {worst['degrees']:.0f} degrees, {' and '.join(faults)}"
    if not seam["candidates"]:
        left = "no way found" if seam["failure"] else "not smoothed"
        return f"abrupt, {left}: {', '.join([why, *others])}"
    why += f", and {len(others)} more" * bool(others)
    one = seam["candidates"][seam["chosen"] - 1]
    made = f"{count(one['moves'], 'move')} in {one['seconds']:.2f} s, {one['status']}, {one['attested']:.0%} attested"
    bridges = f", {count(len(one['bridges']), 'bridge')}" * bool(one["bridges"])
    which = f"{made}{bridges}, {seam['chosen']} of {len(seam['candidates'])}"
    return f"abrupt, was {which}: {why}" if seam["decision"] == "discarded" else f"{which}: {why}"


def _attesters(result: Tween) -> str:
    """What part of the corpus attests how much, where it has several."""
    seen = [source for row in result.sources for source in row if source is not None]
    times = Counter(origin(source.corpus, source.mirrored, source.reversed) for source in seen)
    if len(times) < 2:
        return ""
    return ": " + ", ".join(f"{name} {number / len(seen):.0%}" for name, number in times.most_common())


def origin(corpus: str, is_mirrored: bool, is_reversed: bool) -> str:
    """Where movement comes from: "ballet", "ballet (mirrored, reversed)"."""
    changes = ", ".join(["mirrored"] * is_mirrored + ["reversed"] * is_reversed)
    return f"{corpus} ({changes})" if changes else corpus


def print_origins(found: dict[str, Any]) -> None:
    """What a corpus was made of, where that is not only its own recordings as they are."""
    rows = [(origin(row["corpus"], row["mirrored"], row["reversed"]), row) for row in found["origins"]]
    if len(rows) < 2 and not any(name != found["name"] for name, _ in rows):
        return
    width = max(len(name) for name, _ in rows)
    click.echo(f"{'learned from':{width}}  clips  postures  moves  each counts  of all moves")
    for name, row in rows:
        click.echo(
            f"{name:{width}}  {row['clips']:5}  {row['postures']:8}  {row['moves']:5}  {row['weight']:11.4g}  "
            f"{row['share']:12.1%}"
        )


def print_check(found: dict[str, Any]) -> None:
    """What `survey.check` found: states, edges and out-degree of each joint, what can be joined, faults."""
    rate = f"{found['rate']:g} a second" if found["rate"] else "keyframes"
    click.echo(
        f"{found['name']}: {count(len(found['clips']), 'clip')}, {found['postures']} postures ({rate}), "
        f"{found['skeleton']}"
    )
    print_origins(found)
    width = max(len(joint) for joint in found["states"])
    click.echo(f"{'joint':{width}}  states  edges  out-degree")
    for joint, states in found["states"].items():
        click.echo(f"{joint:{width}}  {states:6}  {found['edges'][joint]:5}  {found['out_degree'][joint]:10.2f}")
    click.echo(f"{found['joinable']:.1%} of {found['pairs']} random pairs of postures can be joined without a bridge")
    faults: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for fault in found["faults"]:
        faults.setdefault((fault["clip"], fault["joint"]), []).append(fault)
    if faults:
        total = count(len(found["faults"]), "fault")
        click.echo(f"{total} of the recordings, where a joint turns too far in one frame (all with --json):")
    for (clip, joint), jumps in faults.items():
        frames = ", ".join(str(jump["frame"]) for jump in jumps[:3])
        more = f" and {len(jumps) - 3} more" if len(jumps) > 3 else ""
        most = max(jump["degrees"] for jump in jumps)
        click.echo(f"  {clip}: {joint} by up to {most:.0f} degrees, at frame {frames}{more}")


def say(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Warnings of our own are notes to the user; others are for developers and stay away from the command line."""
    if issubclass(category, MotionMindWarning):
        note(str(message))
