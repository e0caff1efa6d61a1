"""The tween command: find a movement between two postures."""

from __future__ import annotations

import gc
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.delivery import Delivery, check_delivery, find_rig, for_program, on_rig, rig_files, takes_delivery
from motionmind.cli.duets import are_duets, tween_duets
from motionmind.cli.files import MOTION_SUFFIXES, check_outputs, numbered
from motionmind.cli.music import in_seconds, read_counts, sound_of_counts, with_music
from motionmind.cli.options import HOME, OUTPUT_KINDS, Section, command, option, outputs, reading
from motionmind.cli.printing import Interruption, note, print_alternatives, print_tween
from motionmind.cli.search_options import request_options, searching, via_sources
from motionmind.cli.sources import ends_reader
from motionmind.cli.types import EXISTING_FILE, FILE, Place, Whole, known_corpora
from motionmind.cli.warming import preparing
from motionmind.cli.words import parse_reaches
from motionmind.display import displayed
from motionmind.errors import MotionMindError, NoPathError
from motionmind.files import all_or_none, sha256_of
from motionmind.names.spelling import PostureName, parse_posture
from motionmind.render import PICTURES

if TYPE_CHECKING:
    from motionmind.body.motion import Motion, Posture
    from motionmind.tween.engine import Engine
    from motionmind.tween.report import TweenReport
    from motionmind.tween.result import Tween


@command("motionmind tween ballet/arabesque ballet/fifth -o tween.bvh")
@click.argument("a", shell_complete=completion.postures)
@click.argument("b", shell_complete=completion.postures)
@option(
    "--corpus",
    section=Section.CORPORA,
    metavar="NAME",
    shell_complete=completion.corpora,
    help="Corpus to use, by name or folder  [default: the corpus of A and B, if they are its postures]",
)
@outputs(f"File to write: {OUTPUT_KINDS}.", required=False)
@for_program("Program to open .bvh and .glb files in: they get the unit, frames per second and root that it expects.")
@on_rig("File with the rig for .bvh files (its skeleton) or .glb files (its character)  [default: the file of A and B]")
@option("--report", section=Section.OUTPUT, type=FILE, help="File of the report, as JSON; - prints it.")
@option(
    "--details", section=Section.OUTPUT, is_flag=True, help="Print costs, states and distances from the corpus, too."
)
@option(
    "--problem",
    section=Section.OUTPUT,
    advanced=True,
    type=FILE,
    help="File of the optimisation problem, for toulbar2 (.cfn).",
)
@option(
    "--alternatives",
    section=Section.SEARCH,
    type=Whole(1, 1000),
    metavar="K",
    help="Number of different tweens to find, with equally many moves; files are out-1.json, out-2.json, ...",
)
@option(
    "--loop",
    "is_loop",
    section=Section.MOTION,
    advanced=True,
    is_flag=True,
    help="Come back to A at the velocity of the start, to repeat; other options steer the way to B.",
)
@option(
    "--what-if",
    section=Section.SEARCH,
    advanced=True,
    is_flag=True,
    help="Report the cost of each --pin, --hold, --avoid and --via, and of the length, by searching without it.",
)
@option(
    "--reach",
    section=Section.THROUGH,
    multiple=True,
    metavar="JOINT=X,Y,Z@SECONDS",
    shell_complete=completion.joints,
    help="Place of a joint at a time, as right_wrist=0.3,1.4,0.5@1.2s: metres where A stands, Y up; seconds from A. "
    "Repeatable.",
)
@option(
    "--to",
    section=Section.THROUGH,
    type=Place(),
    metavar="X,Z[,FACING]",
    help="Where B stands on the floor, in the metres of a plan, z to the audience, and its facing, degrees left  "
    "[default: where it is, facing as it does]",
)
@option(
    "--along",
    section=Section.THROUGH,
    type=FILE,
    help="File with the path to B over the floor: an SVG path in metres, or a point x,z in each line.",
)
@option(
    "--duets",
    section=Section.CORPORA,
    advanced=True,
    type=EXISTING_FILE,
    multiple=True,
    help="Ensemble of two (.bvh, .toml) that shows how couples keep together, where A and B are of two dancers  "
    "[default: the files of A and B]. Repeatable.",
)
@searching()
@with_music(
    Section.SEARCH,
    "Music whose beats are the counts: .txt, .mid, or sound, of about --tempo if given; sound of an .mp4 or .html.",
    "Seconds of the music before count 1, the next beat  [default: to the first downbeat]",
    advanced=True,
)
@reading
@HOME
def tween(
    a: str,
    b: str,
    corpus: str | None,
    outputs: tuple[Path, ...],
    program: str | None,
    rig: Path | None,
    report: Path | None,
    details: bool,
    problem: Path | None,
    home: Path | None,
    alternatives: int | None,
    is_loop: bool,
    what_if: bool,
    reach: tuple[str, ...],
    to: tuple[float, ...] | None,
    along: Path | None,
    duets: tuple[Path, ...],
    music: Path | None,
    offset: float | None,
    joints: Path | None,
    unit: str | None,
    asf: Path | None,
    source_fps: float | None,
    up: str | None,
    **options: Any,
) -> None:
    """Find the optimal movement from A to B, with a proven bound.

    A and B are postures of corpora, such as ballet/arabesque or ballet/adagio@23 (the postures command lists them),
    files of one posture, or frames of clips. Frames count from 0: clip.bvh@240, or by time clip.bvh@2.0s; of a clip of
    a glTF file, 'hero.glb#Dance@240'. Velocities are free; clip.bvh@240~ has the clip's velocity. The input options
    apply to every motion file on the command line. Two frames of ensembles of two, such as duo.bvh@12, make a duet.

    Ctrl-C ends the search: the command writes the best movement found and its bound, and exits with code 130. Exit
    code 3 means that no path joins A and B under these constraints; --report then holds the diagnosis.
    """
    if problem and options["whole_body"]:
        raise click.UsageError("--problem and --whole-body exclude each other: the problem has a variable per joint")
    if is_loop and (problem or report or alternatives or what_if):
        raise click.UsageError("--loop excludes --alternatives, --problem, --report and --what-if: it finds two tweens")
    gc.disable()  # start-up makes a million objects and no garbage: saves 0.1 s
    _load_numba()
    from motionmind.cli.postures import read_end
    from motionmind.corpus.store import locate
    from motionmind.formats.floor_path import read_floor_path
    from motionmind.names.finding import check_named
    from motionmind.tween.engine import Engine
    from motionmind.tween.report import plain

    named = parse_posture(a, home), parse_posture(b, home)
    given = {"joints": joints, "unit": unit, "asf": asf, "source_fps": source_fps, "up": up}
    if are_duets(named, duets):
        tween_duets(named, duets, outputs, corpus, home, options | {"to": to, "along": along}, given)
        return
    files = _Files(outputs, report, problem, alternatives)
    taker = check_delivery(outputs, program, rig)
    sources = [one.source for one in named]
    vias = via_sources(options, home)
    files.check(
        [path for source in (*sources, *vias) for path in source.paths] + rig_files(rig) + ([along] if along else [])
    )
    corpus = _corpus_of(named, home) if corpus is None else corpus
    locate(corpus, home)
    read = ends_reader([*sources, *vias], corpus, home, **given)
    request = request_options(options, home, read) | {
        "what_if": what_if,
        "reach": parse_reaches(reach),
        "to": to,
        "along": None if along is None else read_floor_path(along),
    }
    beats = read_counts(music, offset, options["tempo"])
    request = in_seconds(request, beats)
    for source in sources:
        check_named(source, home)
    with preparing():  # before a bundled corpus is learned
        start, request["before"] = read_end(named[0], "before", home, read)
        end, request["after"] = read_end(named[1], "after", home, read)
        on = None
        if any(map(takes_delivery, outputs)):
            on = find_rig(rig, named, start, joints=joints, unit=unit, source_fps=source_fps, up=up)
        engine = Engine.load(corpus, home)
        with _diagnosing(files), Interruption() as interruption:
            results = _find_tweens(engine, (start, end), request, files.count, interruption)
            results += [_find_way_back(engine, results[0], interruption)] if is_loop else []
        delivery = Delivery(taker, on, taker.fps if taker else None, sound=sound_of_counts(music, beats, outputs))
        motions = [one.motion for one in results]
        written, reports = files.write(results, [_joined(*motions)] if is_loop else motions, delivery)
    if files.is_report_printed:
        printed = list(map(plain, reports))
        click.echo(json.dumps(printed[0] if alternatives is None else printed))
    else:
        _print(results, written, are_alternatives=alternatives is not None, details=details)
        delivery.print(outputs)
    interruption.finish()


def _print(results: list[Tween], written: list[Path], *, are_alternatives: bool, details: bool) -> None:
    """Print tweens, and the files that were written."""
    if are_alternatives:
        print_alternatives(results, written, with_details=details)
        return
    for result in results:
        print_tween(result, written if result is results[-1] else None, with_details=details)


def _corpus_of(ends: Sequence[PostureName], home: Path | None) -> str:
    """Return the corpus of A and B; fail if they have none, or two."""
    from motionmind.names.finding import find_motion
    from motionmind.names.postures import find_posture

    corpora = [end.source.place for end in ends if end.source.kind == "corpus"]
    if not corpora:
        for end in ends:
            find_motion(end.source, home)  # raises if there is no such file
        message = f"Missing option '--corpus': neither A nor B is a posture of a corpus. Corpora: {known_corpora(home)}"
        raise click.UsageError(message, click.get_current_context())
    if len(set(corpora)) > 1:
        for end in ends:
            find_posture(end, home)  # raises if there is no such posture
        a, b = map(displayed, corpora)
        raise MotionMindError(f"A is a posture of {a} and B of {b}: choose --corpus {a} or --corpus {b}")
    return corpora[0]


def _find_tweens(
    engine: Engine, ends: tuple[Posture, Posture], request: dict[str, Any], count: int, interruption: Interruption
) -> list[Tween]:
    """Find `count` tweens; fewer after Ctrl-C, or with a note if no other path differs enough or takes long enough."""
    found: list[Tween] = []
    try:
        for tween in engine.alternatives(*ends, count, **request, watch=interruption.watch):
            found.append(tween)
            if interruption.is_requested:
                break
    except MotionMindError as error:
        if not found:
            raise
        note(f"{len(found)} of {count} found: {error}")
    return found


def _find_way_back(engine: Engine, there: Tween, interruption: Interruption) -> Tween:
    """Find the tween from B to A, with the velocities of a tween from A to B at both of its ends."""
    a, b = there.motion.posture(0), there.motion.posture(-1)
    return engine.tween(b, a, before=there.motion, after=there.motion, watch=interruption.watch)


def _joined(there: Motion, back: Motion) -> Motion:
    """Return the movement to B and back, whose last frame is its first."""
    import numpy as np

    later = back.times[1:] - back.times[0] + there.times[-1]
    way_back = tuple(replace(one, times=one.times - back.times[0] + there.times[-1]) for one in back.insertions)
    return replace(
        there,
        rotations=np.concatenate([there.rotations, back.rotations[1:]]),
        root=np.concatenate([there.root, back.root[1:]]),
        times=np.concatenate([there.times, later]),
        insertions=(*there.insertions, *way_back),
    )


@dataclass(frozen=True)
class _Files:
    """The output files: for each alternative, motions, a report and a problem.

    Attributes:
        motions: the files of the motion.
        report: the file of the report; - to print it.
        problem: the file of the problem.
        alternatives: the requested number of tweens; None for one, with unnumbered files.
    """

    motions: tuple[Path, ...]
    report: Path | None
    problem: Path | None
    alternatives: int | None

    @property
    def count(self) -> int:
        """The number of tweens."""
        return self.alternatives or 1

    @property
    def is_report_printed(self) -> bool:
        """Whether the report, and nothing else, goes to standard output."""
        return self.report == Path("-")

    def check(self, sources: Sequence[Path]) -> None:
        """Check that all files are writable and not among `sources`."""
        outputs: list[tuple[Path, tuple[str, ...]]] = []
        for number in range(1, self.count + 1):
            motions, report, problem = self._files_of(number)
            outputs += [(path, MOTION_SUFFIXES + PICTURES) for path in motions]
            outputs += [(report, ())] if report else []
            outputs += [(problem, (".cfn",))] if problem else []
        check_outputs(outputs, sources)

    def write(
        self, results: Sequence[Tween], movements: Sequence[Motion], delivery: Delivery
    ) -> tuple[list[Path], list[TweenReport]]:
        """Write all requested files, or none if one fails; return the files, and the reports if requested."""
        from motionmind.files import write_atomically
        from motionmind.tween.report import encode_report
        from motionmind.tween.result import report_of

        files: list[Path] = []
        reports = []
        with all_or_none() as written:
            for number, (result, movement) in enumerate(zip(results, movements, strict=False), start=1):
                motions, report, problem = self._files_of(number)
                files += [*motions, *(path for path in (report, problem) if path)]
                for path in motions:
                    delivery.write(path, movement)
                if problem:
                    write_atomically(problem, result.problem().encode())
                if self.report:
                    reports.append(report_of(result, sha256_of(written, next(iter(motions), None))))
                if report:
                    write_atomically(report, encode_report(reports[-1]))
        return files, reports

    def write_diagnosis(self, error: NoPathError) -> None:
        """Write or print the diagnosis in place of the first report, if one was requested."""
        from motionmind.files import write_atomically

        text = json.dumps({"status": "no path", "message": str(error), "diagnosis": error.diagnosis})
        _, report, _ = self._files_of(1)
        if self.is_report_printed:
            click.echo(text)
        elif report:
            write_atomically(report, f"{text}\n".encode())

    def _files_of(self, number: int) -> tuple[list[Path], Path | None, Path | None]:
        """Return one tween's files: the motion's, the report's and the problem's; None for no file."""
        report = None if self.is_report_printed else self.report
        return (
            [numbered(path, number, self.alternatives) for path in self.motions],
            report and numbered(report, number, self.alternatives),
            self.problem and numbered(self.problem, number, self.alternatives),
        )


@contextmanager
def _diagnosing(files: _Files) -> Iterator[None]:
    """Write the diagnosis in place of the report if there is no path."""
    try:
        yield
    except NoPathError as error:
        files.write_diagnosis(error)
        raise


def _load_numba() -> None:
    """Import numba without SciPy's linear algebra, and without YAML unless a file configures numba: saves 0.25 s.

    Later imports find both.
    """
    hidden = {"scipy.linalg"} | ({"yaml"} if not Path(".numba_config.yaml").exists() else set())
    hidden -= sys.modules.keys()
    sys.modules.update(dict.fromkeys(hidden))  # type: ignore[arg-type]
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        for name in hidden:
            del sys.modules[name]
