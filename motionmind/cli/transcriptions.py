"""The command that transcribes a recording into a score."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.files import check_outputs
from motionmind.cli.options import HOME, Section, command, option, outputs, reading
from motionmind.cli.pictures import CLIP, FIRST, LAST
from motionmind.cli.printing import count, print_written
from motionmind.cli.sources import parse_movement, read_movement, select_part
from motionmind.cli.types import FILE, Number
from motionmind.errors import MotionMindError
from motionmind.files import all_or_none, write_atomically
from motionmind.names.spelling import Source, parse_source
from motionmind.transcription import LONGEST_MOVE_S, TOLERANCE_RANGE_DEG
from motionmind.tween.counts import TEMPO_RANGE_BPM

if TYPE_CHECKING:
    from motionmind.notation.score import Score
    from motionmind.transcription import Transcription

SCORE = ".score"
COMPARISONS = (".gif", ".mp4", ".html", ".png", ".pdf")


@command("motionmind transcribe ballet/adagio -o adagio.score --tolerance 12")
@click.argument("source", shell_complete=completion.movement)
@outputs(f"Score to write ({SCORE}), or the score and the recording on one stage ({', '.join(COMPARISONS)}).")
@CLIP
@FIRST
@LAST
@option(
    "--tolerance",
    section=Section.MOTION,
    type=Number(*TOLERANCE_RANGE_DEG),
    default=6.0,
    metavar="DEGREES",
    help="Deviation of a bone's direction that the score may leave; half as many centimetres of the pelvis.",
)
@option(
    "--tempo",
    section=Section.MOTION,
    type=Number(*TEMPO_RANGE_BPM),
    metavar="BPM",
    help="Counts per minute in which durations are written  [default: seconds]",
)
@option(
    "--no-repeats",
    section=Section.MOTION,
    is_flag=True,
    help="Write all postures in one list, without phrases.",
)
@option(
    "--shortest",
    section=Section.MOTION,
    type=Number(0.0, LONGEST_MOVE_S),
    default=0.0,
    metavar="S",
    help="Least seconds from posture to posture, even where the tolerance needs more of them.",
)
@option(
    "--vocabulary",
    section=Section.MOTION,
    metavar="SCORE|CORPUS",
    shell_complete=completion.corpora,
    help="Use the positions of a score's clips and postures, or of a corpus of scores, where they fit; repeatable.",
    multiple=True,
)
@option("--report", section=Section.OUTPUT, type=FILE, help="File of the deviations over time, as JSON.")
@option(
    "--picture",
    section=Section.OUTPUT,
    type=FILE,
    help="Picture of the deviations over time, with both bodies where they are worst (.svg, .png).",
)
@reading
@HOME
def transcribe(
    source: str,
    outputs: tuple[Path, ...],
    report: Path | None,
    picture: Path | None,
    name: str | None,
    start: int,
    end: int,
    tolerance: float,
    shortest: float,
    tempo: float | None,
    no_repeats: bool,
    vocabulary: tuple[str, ...],
    home: Path | None,
    **options: Any,
) -> None:
    """Transcribe a recording into a score, which a person can read, change and compose.

    Postures that recur, mirrored or not, become phrases.
    SOURCE is a motion file, a score, a corpus by name or folder, CORPUS/CLIP, or a clip of a glTF file such as
    'hero.glb#Dance'. The score has the fewest postures between which every frame is followed within the tolerance.
    docs/notation.md explains the language of scores.
    """
    from motionmind.notation.sources import sources
    from motionmind.plots import draw_deviation
    from motionmind.transcription import transcribe as to_score

    named = parse_movement(source, home)
    files: list[tuple[Path, tuple[str, ...]]] = [(path, (SCORE, *COMPARISONS)) for path in outputs]
    files += [(report, ())] if report else []
    files += [(picture, (".svg", ".png"))] if picture else []
    scores = [score for word in vocabulary for score in _read_vocabulary(parse_source(word, home), home)]
    check_outputs(files, [*named.source.paths, *(path for score in scores for path in sources(Path(score.path)))])
    whole = read_movement(named.source, name, home, **options)
    frames = select_part(named, whole, start, end)
    part = whole.slice(frames.start, frames.stop)
    found = to_score(part, tolerance, shortest=shortest, tempo=tempo, repeats=not no_repeats, vocabulary=scores)
    with all_or_none():
        for path in outputs:
            _write(path, found)
        if report:
            write_atomically(report, found.report())
        if picture:
            draw_deviation(found).save(picture)
    for line in _lines(found, bool(scores)):
        click.echo(line)
    print_written([path for path, _ in files])


def _read_vocabulary(source: Source, home: Path | None) -> Sequence[Score]:
    """Read the scores of a vocabulary.

    Raises:
        MotionMindError: the source does not exist, or holds no scores.
    """
    from motionmind.names.finding import check_exists, open_collection

    check_exists(source, home)
    if source.name:
        raise MotionMindError(f"--vocabulary {source.word}: give the whole score or corpus, {source.place}")
    scores = () if source.kind == "file" else open_collection(source, home).scores
    if not scores:
        raise MotionMindError(f"--vocabulary {source.word}: holds no positions; give a score, or a corpus of scores")
    return scores


def _write(path: Path, found: Transcription) -> None:
    """Write the score, or a picture, film or page of it beside the recording."""
    suffix = path.suffix.lower()
    if suffix == SCORE:
        write_atomically(path, found.text.encode())
    elif suffix == ".html":
        from motionmind.render.group_page import write_group_page

        write_group_page(path, found.compared())
    elif suffix in (".png", ".pdf"):
        from motionmind.render.group_sheet import write_group_sheet

        write_group_sheet(path, found.compared())
    else:
        from motionmind.render.film import write_group_film

        write_group_film(path, found.compared())


def _lines(found: Transcription, has_vocabulary: bool) -> Iterator[str]:
    """Format what the score holds and what it leaves out."""
    import numpy as np

    seconds = float(found.recording.times[-1] - found.recording.times[0])
    fewest = "the fewest" if len(found.keys) == found.fewest else f"{found.fewest} are the fewest"
    apart = f" if {found.shortest:g} s apart or more" if found.shortest else ""
    yield (
        f"{count(len(found.keys), 'posture')} in {seconds:.1f} s, {fewest} within {found.tolerance:g} degrees "
        f"and {0.5 * found.tolerance:g} cm{apart}"
    )
    if found.repeats:
        lines = len(found.keys) - sum(each.saved for each in found.repeats)
        calls = sum(call.times for each in found.repeats for call in each.calls)
        yield f"{count(len(found.repeats), 'phrase')} danced {calls} times: {lines} lines"
    if has_vocabulary:
        shares = ", ".join(f"{share:.0%} of {part}" for part, share in found.recognized.items())
        yield f"positions of the vocabulary: {shares}"
    for part, values in found.deviation.degrees.items():
        off, most = np.percentile(values, [95.0, 100.0])
        line = f"{part:6} within {off:3.0f} degrees in 95 % of frames, {most:.0f} at most"
        cannot = max(found.deviation.unwritten[part])
        yield line + (f"; up to {cannot:.0f} cannot be written" if cannot > 0.5 * found.tolerance else "")
    off, most = np.percentile(found.deviation.centimetres, [95.0, 100.0])
    yield f"pelvis within {off:3.0f} cm in 95 % of frames, {most:.0f} at most"
