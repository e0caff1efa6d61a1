"""Print results to standard output; notes and progress to standard error."""

from __future__ import annotations

import logging
import math
import re
import signal
import sys
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, TextIO

import click

from motionmind.cli.exits import ExitCode
from motionmind.cli.noted import Noted
from motionmind.display import displayed, displayed_path, one_line
from motionmind.errors import MotionMindWarning, enumerated
from motionmind.files import FilePath
from motionmind.tween.counts import moment

if TYPE_CHECKING:
    from motionmind.search.solve import Progress
    from motionmind.tween.certificate import Source
    from motionmind.tween.result import Tween
    from motionmind.tween.what_if import WhatIf


_SAME_PASSAGE_S = 3.0  # longest step within one passage: postures of a score are up to 3 s apart
_N_WARNINGS_PRINTED = 3  # without --details


class Notes(logging.Handler):
    """Prints each logged assumption, such as the unit of a file, once: for the first file that needs it.

    A record with a `file` is about that file alone; later commands do not print it again.
    """

    def __init__(self, level: int) -> None:
        super().__init__(level)
        self._printed: set[object] = set()
        self._noted = Noted()

    def close(self) -> None:
        """Remember the notes about files."""
        self._noted.save()
        super().close()

    def emit(self, record: logging.LogRecord) -> None:
        """Print a record, unless one that differs in its first argument alone, the file, was printed before."""
        file: FilePath | None = getattr(record, "file", None)
        if file is not None and not self._noted.is_new(Path(file), str((record.msg, record.args))):
            return
        key = (record.msg, record.args[1:] if isinstance(record.args, tuple) else record.args)
        if key not in self._printed:
            self._printed.add(key)
            note(record.getMessage())


def progress(message: str) -> None:
    """Print the progress of a long operation, on a terminal only."""
    if sys.stderr.isatty():
        click.echo(message, err=True)


def note(message: str) -> None:
    """Print a note to standard error, in place of a progress bar if one stands there."""
    clear = "\r\x1b[2K" if sys.stderr.isatty() else ""
    click.echo(f"{clear}note: {one_line(message)}", err=True)


def count(number: int, noun: str) -> str:
    """Format a number of things: "1 move", "2 moves", "2 stretches"."""
    plural = "es" if noun.endswith("ch") else "s"
    return f"{number} {noun}{plural * (number != 1)}"


class Interruption:
    """A context in which Ctrl-C ends only the search, not the program; the search then returns its best result.

    Attributes:
        is_requested: whether Ctrl-C was pressed.
    """

    def __init__(self) -> None:
        self.is_requested = False
        self._printed_at = monotonic()
        self._stage = ""

    def __enter__(self) -> Interruption:
        self._previous = signal.signal(signal.SIGINT, self._request)
        return self

    def __exit__(self, *_: object) -> None:
        signal.signal(signal.SIGINT, self._previous)
        if sys.stderr.isatty():
            click.echo("\r\x1b[2K", err=True, nl=False)

    def watch(self, so_far: Progress) -> bool:
        """Print the search's progress on a terminal, once a second; return whether to end the search."""
        if sys.stderr.isatty() and monotonic() > self._printed_at + 1.0:
            self._printed_at = monotonic()
            best = f"best so far {so_far.cost:.3f}" if so_far.cost < math.inf else "no path yet"
            line = f"{self._stage}{best}, proven {so_far.lower_bound:.3f} nats (Ctrl-C ends here)"
            click.echo(f"\r\x1b[2K{line}", err=True, nl=False)
        return self.is_requested

    def on_progress(self, done: int, of: int) -> None:
        """Print on a terminal which of several searches begins; `done` searches have ended."""
        self._stage = f"transition {done + 1} of {of}: "
        if sys.stderr.isatty():
            click.echo(f"\r\x1b[2K{self._stage}", err=True, nl=False)

    def finish(self) -> None:
        """Exit with code 130 if Ctrl-C was pressed; called when the result is written and printed."""
        if self.is_requested:
            click.get_current_context().exit(ExitCode.INTERRUPTED)

    def _request(self, *_: object) -> None:
        self.is_requested = True


def print_tween(result: Tween, files: Sequence[Path] | None, *, with_details: bool = False) -> None:
    """Print the summary of a tween, and the files written unless `files` is None.

    With details, print costs, states and distances from the corpus, too.
    """
    from motionmind.tween.headline import headline, reached_share

    click.echo(headline(result))
    if reached_share(result) < 0.5:
        note("the proof says little about a motion that leaves its path so far; a corpus nearer to A and B may help")
    _print_seen(result)
    for one in result.what_if:
        click.echo(f"without   {format_what_if(one)}")
    if with_details:
        _print_details(result)
    if files is not None:
        print_written(files)


def _print_seen(result: Tween, indent: str = "") -> None:
    """Print the feet that stay in place, and each visible flaw, one per line."""
    from motionmind.tween.headline import beyond, feet_staying

    for sentence in feet_staying(result.motion):
        click.echo(f"{indent}feet      {sentence}")
    for sentence in beyond(result):
        click.echo(f"{indent}warning   {sentence}")


def _print_details(result: Tween) -> None:
    """Print the search's figures: moves, cost, proof, make-up, and distances from the corpus."""
    lines = [*_search_lines(result), *_distance_lines(result)]
    if result.detail:
        lines.append(("passages", _passages(result.detail)))
    lines.insert(1, ("pace", _tempo(result)))
    for name, line in lines:
        click.echo(f"{name:10}{line}")


def _passages(places: Sequence[Source]) -> str:
    """Format the passages that a movement follows: "adagio from 3.2 s, temps-lie from 10.0 s"."""
    starts = [*places[:1], *(after for before, after in pairwise(places) if _parts(before, after))]
    return ", ".join(f"{displayed(one.clip)} from {one.seconds:.1f} s" for one in starts)


def _parts(before: Source, after: Source) -> bool:
    """Return whether a passage breaks off between two places in a corpus."""
    return (before.clip, before.corpus, before.mirrored) != (after.clip, after.corpus, after.mirrored) or not (
        before.seconds <= after.seconds <= before.seconds + _SAME_PASSAGE_S
    )


def _tempo(result: Tween) -> str:
    """Explain the duration of a tween, and its differences from the corpus."""
    from motionmind.body.noticeable import NOTICEABLE_SHARE
    from motionmind.tween.pacing import worded

    tempo = result.tempo
    if tempo.least > tempo.usual:
        parts = [f"{displayed(tempo.slowest)} needs {tempo.least:.2f} s at the corpus's fast speed"]
    else:
        parts = [f"typical duration for this distance: {tempo.usual:.2f} s"]
    if tempo.usual_moves is not None:
        verbs = ("fits", "does") if tempo.usual_moves == 1 else ("fit", "do")
        moves = count(tempo.usual_moves, "move")
        parts.append(f"{moves} of typical length {verbs[0]} the duration but {verbs[1]} not reach B")
    if tempo.faster and (result.request.fixes_length or result.request.pace > 1.0):
        parts.append(f"faster than anything in the corpus: {worded(tempo.faster)}")
    if tempo.detours:
        parts.append("usual movement after postures like A and before postures like B fills the time")
    if tempo.creeps >= NOTICEABLE_SHARE:
        parts.append(f"slower than 99% of the corpus in {tempo.creeps:.0%} of the time")
    return "; ".join(parts)


def format_what_if(one: WhatIf) -> str:
    """Format the price of a restriction: "hold neck: 12.400 nats and 1 move less"."""
    nats = f"at least {one.least:.3f}, at most {one.most:.3f} nats"
    if one.proven:
        nats = f"{one.most:.3f} nats" if one.most >= 0.0005 else "no nats"
    moves = count(abs(one.moves), "move")
    change = f" and {moves} less" if one.moves < 0 else f" less, {moves} more" if one.moves > 0 else " less"
    of = "" if one.compared == "cost" else f" ({one.compared})"
    return f"{displayed(one.without, 300)}: {nats}{change}{of}"


def print_written(files: Sequence[Path]) -> None:
    """Print the names of the written files."""
    names = ", ".join(displayed_path(file) for file in files)
    click.echo(f"written   {names or 'nothing (-o FILE writes the result)'}")


def _search_lines(result: Tween) -> list[tuple[str, str]]:
    """Return pairs of a heading and a line that describe a path and its certificate."""
    seconds = float(result.motion.times[-1])
    bridged = [f"{displayed(b.joint)} in move {b.move + 1} ({b.degrees:.0f} degrees)" for b in result.bridges]
    waited = Counter(displayed(wait.joint) for wait in result.waits)
    return [
        ("moves", f"{result.moves}, in {seconds:.2f} s ({count(len(result.motion), 'frame')}){_counts(result)}"),
        ("cost", f"{result.cost:.3f} nats"),
        ("proven", f"{result.status}: no path costs less than {result.lower_bound:.3f}, gap {result.gap:.2%}"),
        ("attested", f"{result.attested:.1%} of the joints' transitions occur in the corpus{_shares(result)}"),
        ("bridged", ", ".join(bridged) or "none"),
        ("waited", ", ".join(f"{joint} {count(times, 'move')}" for joint, times in waited.items()) or "none"),
    ]


def _counts(result: Tween) -> str:
    """Format the length in counts: ", 8 counts at 120 a minute"; "" without any."""
    request = result.request
    return "" if request.counts is None else f", {request.counts:g} counts at {request.tempo:g} a minute"


def _distance_lines(result: Tween) -> list[tuple[str, str]]:
    """Return pairs of a heading and a line with the distances of A, B, vias and the motion from their states."""
    ends = zip("AB", (result.before, result.after), result.snap_degrees, strict=True)
    stops = [(end, "" if seconds is None else "moving, ", row) for end, seconds, row in ends]
    vias = zip(result.request.vias, result.passed, result.via_degrees, strict=True)
    for number, ((_, _, seconds), move, row) in enumerate(vias, start=1):
        time = "" if seconds is None else f"at {moment(seconds, result.request.tempo)}, "
        stops.insert(number, (f"via {number}", f"after move {move}, {time}", row))
    lines = []
    for stop, where, row in stops:
        worst = int(row.argmax())
        mean, most = f"{row.mean():.1f} degrees per joint", f"{row[worst]:.1f} ({displayed(result.joints[worst])})"
        lines.append((stop, f"{where}{mean} from the corpus's states, at most {most}"))
    if result.moves > 1:
        off, share = result.path_degrees[1:-1], result.followed[1:-1].mean()
        degrees = f"{off.mean():.1f} degrees per joint from the path's states, at most {off.max():.1f}"
        lines.append(("motion", f"{degrees}; within their tolerance in {share:.0%} of joints and moves"))
    lines += [*(("reach", str(one)) for one in result.reached), *(("accent", str(one)) for one in result.accented)]
    return lines + ([("travel", str(result.travelled))] if result.travelled else [])


def _shares(result: Tween) -> str:
    """Format the share of attested transitions from each origin of a corpus; "" for one origin."""
    attested = [source for row in result.sources for source in row if source is not None]
    times = Counter(_format_origin(source.corpus, source.mirrored, source.reversed) for source in attested)
    if len(times) < 2:
        return ""
    return ": " + ", ".join(f"{name} {number / len(attested):.0%}" for name, number in times.most_common())


def print_alternatives(results: Sequence[Tween], files: Sequence[Path], *, with_details: bool = False) -> None:
    """Print the summaries of alternative tweens, each with the share by which it differs from the ones above.

    The prices of restrictions on the first tween follow, if requested; with details, a table of costs.
    """
    from motionmind.tween.headline import headline

    for number, result in enumerate(results, start=1):
        differs = ", ".join(f"{share:.0%}" for share in result.differs)
        passage = f"; follows {displayed(result.request.passage)}" if result.request.passage else ""
        click.echo(f"{number:2}  {headline(result)}{passage}{f'; differs by {differs}' if differs else ''}")
        _print_seen(result, "    ")
    for one in results[0].what_if:
        click.echo(f"without   {format_what_if(one)}")
    if with_details:
        click.echo("    moves  seconds      cost  at least     gap  proven       attested  bridged")
        for number, result in enumerate(results, start=1):
            click.echo(
                f"{number:2}  {result.moves:5}  {result.motion.times[-1]:7.2f}  {result.cost:8.3f}  "
                f"{result.lower_bound:8.3f}  {result.gap:6.2%}  {result.status:11}  {result.attested:8.1%}  "
                f"{len(result.bridges):7}"
            )
    print_written(files)


def _format_origin(corpus: str, is_mirrored: bool, is_reversed: bool) -> str:
    """Format where movement comes from: "ballet", "ballet (mirrored, reversed)"."""
    changes = ", ".join(["mirrored"] * is_mirrored + ["reversed"] * is_reversed)
    return f"{displayed(corpus)} ({changes})" if changes else displayed(corpus)


def print_origins(summary: dict[str, Any]) -> None:
    """Print the origins of a corpus's movement, unless its own unchanged recordings are the only one."""
    rows = [(_format_origin(row["corpus"], row["mirrored"], row["reversed"]), row) for row in summary["origins"]]
    if len(rows) < 2 and not any(name != displayed(summary["name"]) for name, _ in rows):
        return
    width = max(len(name) for name, _ in rows)
    click.echo(f"{'learned from':{width}}  clips  postures  moves  each counts  of all moves  licence")
    for name, row in rows:
        click.echo(
            f"{name:{width}}  {row['clips']:5}  {row['postures']:8}  {row['moves']:5}  {row['weight']:11.4g}  "
            f"{row['share']:12.1%}  {displayed(row['licence']) or '-'}"
        )


def print_check(check: dict[str, Any], *, with_states: bool = True, with_details: bool = False) -> None:
    """Print the result of `Engine.check`: size, states of each joint, share of joinable pairs, faults.

    Args:
        check: the result.
        with_states: whether to print a line for each joint, with its states, edges and out-degree.
        with_details: whether to print a line for each recording with faults.
    """
    rate = f"{check['rate']:g} a second" if check["rate"] else "keyframes"
    size = f"{count(len(check['clips']), 'clip')}, {count(check['postures'], 'posture')}"
    click.echo(f"{displayed(check['name'])}: {size} ({rate}), {displayed(check['skeleton'])}")
    print_origins(check)
    if with_states:
        width = max(len(displayed(joint)) for joint in check["states"])
        click.echo(f"{'joint':{width}}  states  edges  out-degree")
        for joint, states in check["states"].items():
            click.echo(
                f"{displayed(joint):{width}}  {states:6}  {check['edges'][joint]:5}  {check['out_degree'][joint]:10.2f}"
            )
    click.echo(f"{check['joinable']:.1%} of {check['pairs']} random pairs of postures can be joined without a bridge")
    _print_faults(check["faults"], check["repairs"], with_details)


def format_repairs(summary: dict[str, Any]) -> str:
    """Format the repairs of a corpus's recordings: "2 clips, 12 stretches put back exactly, 30 reconstructed"."""
    exact = sum(one["exact"] for one in summary["repairs"])
    clips = count(len({one["clip"] for one in summary["repairs"]}), "clip")
    return f"{clips}, {count(exact, 'stretch')} put back exactly, {len(summary['repairs']) - exact} reconstructed"


def _print_faults(faults: Sequence[dict[str, Any]], repairs: Sequence[dict[str, Any]], with_details: bool) -> None:
    """Print how often joints jump in the corpus's own recordings, and the repairs; with details, for each recording.

    `repairs` also has those of mixed corpora, which are ignored.
    """
    if not faults:
        return
    clips = list(dict.fromkeys(fault["clip"] for fault in faults))
    parts = re.compile(rf"({'|'.join(map(re.escape, clips))})(\.\d+)?")
    total = _format_faults(faults, [one for one in repairs if not one["exact"] and parts.fullmatch(one["clip"])])
    more = ":" if with_details else " (--details lists them)"
    click.echo(f"{count(len(clips), 'recording')} with joints that turn too far in one frame, {total}{more}")
    for clip in clips if with_details else ():
        parts_of_clip = re.compile(rf"{re.escape(clip)}(\.\d+)?")
        stretches = [one for one in repairs if parts_of_clip.fullmatch(one["clip"]) and not one["exact"]]
        joints = enumerated(dict.fromkeys(displayed(one["joint"]) for one in stretches), 4)
        here = _format_faults([fault for fault in faults if fault["clip"] == clip], stretches)
        click.echo(f"  {displayed(clip)}: {here}{f' ({joints})' if joints else ''}")


def _format_faults(faults: Sequence[dict[str, Any]], stretches: Sequence[dict[str, Any]]) -> str:
    """Format flips and reconstructed stretches: "3 flips, 2 put back exactly, 9 frames reconstructed"."""
    ends = Counter(fault["repair"] for fault in faults)
    parts = [count(len(faults), "flip")]
    parts += [f"{ends['put back']} put back exactly"] * (ends["put back"] > 0)
    parts += [f"{ends['none']} left"] * (ends["none"] > 0)
    frames = {(one["clip"], frame) for one in stretches for frame in range(one["start"], one["stop"])}
    parts += [f"{count(len(frames), 'frame')} reconstructed"] * bool(frames)
    return ", ".join(parts)


class Warned:
    """Prints our own warnings as notes, and drops other warnings, which are for developers.

    A command that has `--details` prints the first few and the number of the others, unless `--details` is given.
    """

    def __init__(self) -> None:
        self._n_seen = self._n_dropped = 0

    def show(
        self,
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        """Print a warning as a note; signature of `warnings.showwarning`."""
        if not issubclass(category, MotionMindWarning):
            return
        context = click.get_current_context(silent=True)
        self._n_seen += 1
        if context and context.params.get("details") is False and self._n_seen > _N_WARNINGS_PRINTED:
            self._n_dropped += 1
        else:
            note(str(message))

    def finish(self) -> None:
        """Print the number of dropped warnings."""
        if self._n_dropped:
            note(f"{count(self._n_dropped, 'more warning')} like these (--details prints them)")
