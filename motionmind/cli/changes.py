"""The commands that add recordings to a corpus or remove them, and the reading of files."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.files import clip_names, read_mapping
from motionmind.cli.options import HOME, Section, command, option, reading
from motionmind.cli.printing import count, note, print_check, progress
from motionmind.cli.types import FILE
from motionmind.cli.warming import prepare
from motionmind.display import displayed_path
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from motionmind.corpus.corpus import Corpus
    from motionmind.corpus.recordings import Rate, Recording
    from motionmind.corpus.shards import Reading, Taken
    from motionmind.executors.team import Team
    from motionmind.executors.workshop import Workshop
    from motionmind.learned.learning import Learned

DETAILS = option(
    "--details",
    section=Section.OUTPUT,
    is_flag=True,
    help="Print the states of joints, and the recordings with faults.",
)
FLIPS = option(
    "--flips",
    section=Section.LEARN,
    type=click.Choice(["repair", "keep", "drop"]),
    default="repair",
    help="Treatment of clips in which a joint jumps: repair, keep or drop.",
)
PERFORMER = option(
    "--performer",
    section=Section.ABOUT,
    default="",
    show_default=False,
    help="Performer of the movement, if not the author; named in credits.",
)


@command("motionmind corpus add mine new/*.bvh")
@click.argument("name", shell_complete=completion.own_corpora)
@click.argument("files", type=FILE, nargs=-1, required=True)
@FLIPS
@PERFORMER
@reading
@DETAILS
@HOME
def add(
    name: str,
    files: tuple[Path, ...],
    home: Path | None,
    joints: Path | None,
    unit: str | None,
    asf: Path | None,
    source_fps: float | None,
    up: str | None,
    details: bool,
    **options: Any,
) -> None:
    """Add recordings to a corpus that you built.

    They are read like the corpus's own recordings: at its rate, and mirrored if it is. The states stay, and earlier
    files are not read again. A note says how far the new movement is outside the states.
    """
    from motionmind.corpus.changing import add_recordings
    from motionmind.corpus.recordings import Taking
    from motionmind.corpus.shards import Reading, shards_of
    from motionmind.executors.opening import open_team
    from motionmind.executors.workshop import Workshop
    from motionmind.learned import persistence

    learned, place = _own(name, home)
    own = [clip for clip in learned.corpus.clips if not clip.corpus]
    rate: Rate = "auto" if learned.corpus.rate is None else learned.corpus.rate
    mirror = any(clip.mirrored for clip in own)
    takes = Taking(rate, learned.corpus.skip, options["flips"], learned.corpus.flip_degrees, mirror)
    source = Reading(takes, read_mapping(joints), unit, str(asf) if asf else None, source_fps, up)
    with open_team() as team, shards_of(name, home) as folder:
        taken = take_files(clip_names(files), source, folder, team, strict=True)
        workshop = Workshop(folder=folder)
        more = add_recordings(learned.corpus, taken, workshop=workshop, **options)
        changed = _learn_again(learned, more, workshop)
        persistence.save(changed, place)
    _print_change(changed, f"added {count(len(files), 'file')} to {displayed_path(place)}", details=details)
    note_kept(place)


@command("motionmind corpus remove mine clip")
@click.argument("name", shell_complete=completion.own_corpora)
@click.argument("clips", nargs=-1, required=True)
@DETAILS
@HOME
def remove(name: str, clips: tuple[str, ...], details: bool, home: Path | None) -> None:
    """Remove clips and their mirror images from a corpus that you built.

    The name of a recording removes all of its parts. The states stay.
    """
    from motionmind.corpus.changing import remove_clips
    from motionmind.corpus.shards import shards_of
    from motionmind.executors.workshop import Workshop
    from motionmind.learned import persistence

    learned, place = _own(name, home)
    with shards_of(name, home) as folder:
        workshop = Workshop(folder=folder)
        changed = _learn_again(learned, remove_clips(learned.corpus, clips, workshop), workshop)
        persistence.save(changed, place)
    gone = len(learned.corpus.clips) - len(changed.corpus.clips)
    _print_change(changed, f"removed {count(gone, 'clip')} from {displayed_path(place)}", details=details)
    note_kept(place)


def note_kept(place: Path) -> None:
    """Note how to bring back the corpus that the last change of a folder replaced, if it is kept."""
    from motionmind.corpus.manifest import count_clips
    from motionmind.corpus.store import read_manifest, replaced

    if old := replaced(read_manifest(place)):
        clips = count(count_clips(old), "clip")
        note(f"corpus restore {place.name} brings back the replaced corpus ({clips}), until the next change")


def take_files(
    names: Mapping[Path, str], reading: Reading, folder: Path, team: Team, *, strict: bool
) -> Iterator[Recording]:
    """Read files with workers, with a progress bar on a terminal; skip and report unusable files.

    Unusable files cannot be read, or are on another skeleton than most. Compiling the code that learning needs begins
    after the last file, so a missing file is reported at once.

    Args:
        names: the clip's name for each file; a score names its own.
        reading: how to read and sample them.
        folder: the folder of shards until the corpus is built.
        team: the workers.
        strict: whether an unusable file is an error.
    """
    from motionmind.corpus import shards

    faults: list[str] = []

    def on_need(size: float) -> None:
        if size >= 1e8:  # bytes
            note(f"needs about {size / 1e9:.1f} GB on disk, more than half of it only until the corpus is built")

    def on_taken(taken: Taken) -> None:
        bar.update(1)
        if taken.fault:
            on_fault(taken.fault)

    def on_fault(fault: str) -> None:
        if strict:
            raise MotionMindError(fault)
        faults.append(fault)

    with click.progressbar(length=len(names), label="reading", file=sys.stderr, hidden=not sys.stderr.isatty()) as bar:
        yield from shards.take_files(names, reading, folder, team, on_need=on_need, on_taken=on_taken, on_odd=on_fault)
    for fault in faults:
        note(f"{fault}; left out")
    if faults:
        note(f"left out {count(len(faults), 'file')} of {len(names)}")
    prepare()
    progress("learning")


def _own(name: str, home: Path | None) -> tuple[Learned, Path]:
    """Load a corpus that the user built; return it and its folder. CorpusError if there is none."""
    from motionmind.corpus.store import own_place
    from motionmind.learned import persistence

    place = own_place(name, home)
    return persistence.load(name, home), place


def _learn_again(learned: Learned, corpus: Corpus, workshop: Workshop) -> Learned:
    """Learn from changed movement in the same states; note the share of new orientations outside all states."""
    from motionmind.corpus.kept import Kept
    from motionmind.learned.learning import learn_changed, outside

    progress("learning")
    kept = Kept.find(corpus, learned.corpus, workshop)
    if kept.new:
        share, joint, degrees = outside(kept.new, learned.space)
        if share > 0.001:  # less is negligible
            note(
                f"{100.0 * share:.1f}% of the new joint orientations are in no state ({joint} by {degrees:.0f} "
                "degrees); to learn new states, build the corpus from all files"
            )
    return learn_changed(learned, kept, workshop)


def _print_change(learned: Learned, done: str, *, details: bool) -> None:
    """Print the check of a changed corpus, and the change."""
    from motionmind.learned.summary import check_corpus, to_plain

    found = to_plain(check_corpus(learned.corpus, learned.grammar, learned.states))
    print_check(found, with_states=details, with_details=details)
    click.echo(done)
