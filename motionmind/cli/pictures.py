"""The commands that draw movement."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.delivery import for_program
from motionmind.cli.ensembles import describe_ensemble, is_ensemble, open_ensemble
from motionmind.cli.files import check_outputs, note_licences
from motionmind.cli.music import check_sounding, read_part_of_sound, track_of, with_music
from motionmind.cli.options import HOME, Section, command, option, output, outputs, reading
from motionmind.cli.printing import count
from motionmind.cli.sources import parse_movement, read_movement, read_movements, select_part
from motionmind.cli.stages import note_overstep
from motionmind.cli.types import COUNT, FILE_OR_FOLDER, FRAME, RATE, Area, Number, Whole
from motionmind.clip_names import GLTF_SUFFIXES, distinct_names
from motionmind.display import displayed_path
from motionmind.errors import MotionMindError, enumerated
from motionmind.files import all_or_none
from motionmind.render import PICTURES, may_sound
from motionmind.tween.counts import TEMPO_RANGE_BPM

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.music.sound import Sound

PRINTS, FILMS = (".png", ".pdf"), (".gif", ".mp4", ".html")  # of ensembles

CLIP = option(
    "--clip",
    "name",
    section=Section.PART,
    metavar="NAME",
    help="Clip of a score, a corpus or a glTF file  [default: the only one; of glTF the first]",
)
FIRST = option(
    "--from",
    "start",
    section=Section.PART,
    type=FRAME,
    metavar="N",
    default=0,
    help="First frame; negative numbers count from the end.",
)
LAST = option(
    "--to",
    "end",
    section=Section.PART,
    type=FRAME,
    metavar="N",
    default=-1,
    help="Last frame; negative numbers count from the end.",
)


@command("motionmind sheet ballet/adagio -o adagio.png")
@click.argument("source", shell_complete=completion.movement)
@output("Picture (.png; of an ensemble also .pdf), or a folder for a picture of each clip.", type=FILE_OR_FOLDER)
@option(
    "--clip",
    "names",
    section=Section.PART,
    multiple=True,
    metavar="NAME",
    help="Clip of a score, a corpus or a glTF file  [default: all]. Repeatable.",
)
@FIRST
@LAST
@option(
    "--every",
    section=Section.PART,
    type=COUNT,
    metavar="N",
    help="Interval between drawn frames or counts  [default: 1]",
)
@option(
    "--postures",
    section=Section.PART,
    type=COUNT,
    metavar="N",
    help="Number of evenly spaced frames to draw, from the first to the last.",
)
@option(
    "--tempo",
    section=Section.PART,
    type=Number(*TEMPO_RANGE_BPM),
    metavar="BPM",
    help="Counts per minute, to draw counts from 1 on, --every so many, instead of frames.",
)
@option(
    "--counts",
    section=Section.PART,
    type=COUNT,
    metavar="N",
    help="Number of counts of --tempo to draw: with 8, counts 1 to 8  [default: to the last frame]",
)
@option(
    "--columns",
    section=Section.DRAW,
    type=COUNT,
    metavar="N",
    help="Postures per row  [default: as many as suit the screen]",
)
@option(
    "--side",
    section=Section.DRAW,
    type=click.Choice(["right", "left"]),
    default="right",
    help="Side of the stage, as the performer sees it, for the side view.",
)
@reading
@HOME
def sheet(
    source: str,
    output: Path,
    names: tuple[str, ...],
    every: int | None,
    postures: int | None,
    tempo: float | None,
    counts: int | None,
    start: int,
    end: int,
    columns: int | None,
    side: Any,
    home: Path | None,
    **reading_options: Any,
) -> None:
    """Draw the postures of clips side by side.

    SOURCE is a motion file, a score, a corpus by name or folder, CORPUS/CLIP, or a posture such as ballet/arabesque.
    A clip of a glTF file is 'hero.glb#Dance'. --clip selects clips of a score, a corpus or a glTF file.

    The sheet draws each posture from the front and from the side, and its feet from above, with its time and frame
    number: frame 23 is the posture SOURCE@23; or with its count, with --tempo. Of an ensemble (.toml) it draws all
    dancers before one camera, at counts, --every so many (seconds without a tempo), by default at most 24 times.
    """
    from motionmind.files import write_atomically
    from motionmind.render.sheet import check_frames, draw_sheet, png

    _check_counts(tempo, counts, postures)
    if is_ensemble(source, [output], PRINTS):
        _print_ensemble(source, output, home, every, postures, reading_options)
        return
    named = parse_movement(source, home)
    is_gltf = Path(named.source.place).suffix.lower() in GLTF_SUFFIXES
    has_clips = named.source.kind != "file" or (is_gltf and not named.source.name)
    folder = output if has_clips and (output.is_dir() or not output.suffix) else None
    if not folder:
        check_outputs([(output, (".png",))], named.source.paths)
    motions = read_movements(named.source, names, home, whole=named.moment is None, **reading_options)
    if not folder and len(motions) != 1:
        clips = f"{source} holds {len(motions)} clips, {enumerated(one.name for one in motions)}"
        raise MotionMindError(f"{output}: {clips}; choose one by --clip, or give a folder")
    parts, lengths = [select_part(named, motion, start, end) for motion in motions], list(map(len, motions))
    captions: list[list[str] | None] = [None] * len(motions)
    if tempo is None:
        frames = [_select_drawn(part, every, postures) for part in parts]
    else:
        cut = [motion.slice(part.start, part.stop) for motion, part in zip(motions, parts, strict=True)]
        motions, captions = map(list, zip(*(_at_counts(one, tempo, every or 1, counts) for one in cut), strict=True))
        frames = [range(len(one)) for one in motions]
    for motion, drawn in zip(motions, frames, strict=True):
        check_frames(motion, drawn)
    paths = _make_files(folder, motions, named.source.paths) if folder else [output]
    with all_or_none():
        for path, motion, drawn, words, length in zip(paths, motions, frames, captions, lengths, strict=True):
            picture = draw_sheet(motion, drawn, columns=columns, side=side, captions=words)
            write_atomically(path, png(picture))
            number = count(len(drawn), "posture")
            click.echo(f"{displayed_path(path)}: {number} of {length}, {picture.width} x {picture.height} pixels")


@command("motionmind render clip.bvh -o clip.html")
@click.argument("source", shell_complete=completion.movement)
@outputs("Picture (.png), film (.gif, .mp4, .svg) or page (.html).")
@CLIP
@FIRST
@LAST
@option(
    "--fps",
    section=Section.DRAW,
    type=RATE,
    help="Frames per second of a film  [default: the movement's own, at most 25 in .gif; .svg 12]",
)
@for_program("Program whose frames per second a film gets, to match an animation there.")
@option(
    "--view",
    section=Section.DRAW,
    type=click.Choice(["quarter", "front", "side", "left", "top"]),
    help="Camera of a film or a posture  [default: quarter]",
)
@option(
    "--size",
    section=Section.DRAW,
    type=Whole(120, 2160),
    metavar="PIXELS",
    help="Height of a film or the picture of a posture  [default: 480]",
)
@option(
    "--stage",
    section=Section.DRAW,
    type=Area(),
    metavar="WIDTHxDEPTH",
    help="Edge of the stage in the floor plan of an .html, metres, around the origin; a note says where it is left.",
)
@with_music(
    Section.DRAW,
    "Sound of an .mp4 or .html (.wav, .flac, .ogg, .mp3)  [default: the file beside it, as clip.wav beside clip.bvh]",
    "Seconds of the music at frame 0 of the clip  [default: 0]",
)
@reading
@HOME
def render(
    source: str,
    outputs: tuple[Path, ...],
    name: str | None,
    start: int,
    end: int,
    program: str | None,
    stage: tuple[float, float] | None,
    home: Path | None,
    music: Path | None,
    offset: float | None,
    **options: Any,
) -> None:
    """Draw movement as a picture, a film, or a page that plays it.

    SOURCE is a motion file, a score, a corpus by name or folder, CORPUS/CLIP, a clip of a glTF file such as
    'hero.glb#Dance', or a posture such as ballet/arabesque. An ensemble (.toml, or a BVH file of several bodies)
    becomes .gif, .mp4 or .html.

    A .png shows one posture, or a sheet of up to 48 evenly spaced ones (the sheet command has more options); an .html
    page plays the movement in any browser, from disk, offline. Inserted movement is violet; a green ball marks a
    bridged joint.
    """
    from motionmind.formats.programs import PROGRAMS
    from motionmind.render.pictures import draw_picture

    drawing = {key: options.pop(key) for key in ("fps", "view", "size")}
    check_sounding(outputs, music, offset)
    pages = [path for path in outputs if path.suffix.lower() == ".html"]
    if stage and not pages:
        raise MotionMindError(f"--stage is for the floor plan of a page: {displayed_path(outputs[0])} is none (.html)")
    if is_ensemble(source, outputs, FILMS):
        drawing = {key: value for key, value in drawing.items() if value}
        sound = read_part_of_sound(music, offset or 0.0) if music else None
        _film_ensemble(source, outputs, home, drawing, sound, stage, options)
        return
    named = parse_movement(source, home)
    check_outputs([(path, PICTURES) for path in outputs], named.source.paths)
    whole = read_movement(named.source, name, home, **options)
    frames = select_part(named, whole, start, end)
    motion = whole.slice(frames.start, frames.stop)
    if program:
        if drawing["fps"] is not None:
            raise MotionMindError(f"--fps and --for {program} both set the frames per second; give one of them")
        motion = motion.stretch_to(PROGRAMS[program].fps)
        drawing["fps"] = motion.fps
    track = music or track_of(named.source, name, home, outputs)
    since = float(whole.times[frames.start] - whole.times[0])
    sound = read_part_of_sound(track, (offset or 0.0) + since) if track else None
    with all_or_none():
        for path in outputs:
            note_licences(path, motion)
            heard, edge = sound if may_sound(path) else None, stage if path in pages else None
            draw_picture(path, motion, first=frames.start, sound=heard, stage=edge, **drawing)
    seconds = motion.times[-1] - motion.times[0]
    for path in outputs:
        kilobytes = path.stat().st_size / 1000
        click.echo(f"{displayed_path(path)}: {count(len(motion), 'frame')}, {seconds:.2f} s, {kilobytes:.0f} kB")
    note_overstep(source, motion, stage)


def _make_files(folder: Path, motions: Sequence[Motion], read_from: Sequence[Path]) -> list[Path]:
    """Return a file for each motion, named after it, in a folder; make the folder if it does not exist."""
    is_new = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MotionMindError(f"{folder}: cannot be made: {error.strerror or error}") from error
    names = distinct_names([re.sub(r"[^\w.()-]+", "-", motion.name) for motion in motions])
    try:
        return check_outputs([(folder / f"{name}.png", (".png",)) for name in names], read_from)
    except MotionMindError:
        with suppress(OSError):
            if is_new:
                folder.rmdir()
        raise


def _select_drawn(frames: range, every: int | None, postures: int | None) -> Sequence[int]:
    """Select every `every`th frame, or `postures` evenly spaced ones from the first to the last."""
    if every and postures:
        raise MotionMindError("--every and --postures both choose the frames to draw; give one of them")
    from motionmind.render.sheet import evenly

    return evenly(frames, postures) if postures else frames[:: every or 1]


def _check_counts(tempo: float | None, counts: int | None, postures: int | None) -> None:
    """Check that --counts comes with --tempo, and --postures with neither."""
    if counts is not None and tempo is None:
        raise click.UsageError("--counts needs --tempo")
    if tempo is not None and postures is not None:
        raise click.UsageError("--tempo and --postures both choose the postures to draw; give one of them")


def _at_counts(motion: Motion, tempo: float, every: int, counts: int | None) -> tuple[Motion, list[str]]:
    """Return a motion's postures on every `every`th count of a tempo, and a caption for each, such as "count 3"."""
    import numpy as np

    from motionmind.tween.counts import counts_to_seconds, seconds_to_count

    last = seconds_to_count(float(motion.times[-1] - motion.times[0]) + 1e-6, tempo)
    numbers = np.arange(1, int(last if counts is None else min(last, counts)) + 1, every)
    at = motion.at(motion.times[0] + counts_to_seconds(1.0, tempo) * (numbers - 1))
    return at, [f"count {number}" for number in numbers.tolist()]


def _print_ensemble(
    source: str, output: Path, home: Path | None, every: int | None, postures: int | None, options: dict[str, Any]
) -> None:
    """Draw the sheet of an ensemble."""
    if every and postures:
        raise MotionMindError("--every and --postures both choose the times to draw; give one of them")
    without = ["names", "start", "end", "columns", "side", "tempo", "counts"]
    ensemble = open_ensemble(source, [output], PRINTS, home, without, **options)
    from motionmind.render.group_sheet import write_group_sheet

    pictures = write_group_sheet(output, ensemble, every=every, postures=postures)
    click.echo(f"{displayed_path(output)}: {count(pictures, 'picture')}, " + "\n".join(describe_ensemble(ensemble)))


def _film_ensemble(
    source: str,
    outputs: tuple[Path, ...],
    home: Path | None,
    drawing: dict[str, Any],
    sound: Sound | None,
    stage: tuple[float, float] | None,
    options: dict[str, Any],
) -> None:
    """Film an ensemble, or write the page that plays it."""
    from motionmind.body.stage import check_stage

    ensemble = open_ensemble(source, outputs, FILMS, home, ["name", "start", "end", "program"], **options)
    ensemble = replace(ensemble, stage=check_stage(stage)) if stage else ensemble
    pages = [path for path in outputs if path.suffix.lower() == ".html"]
    if pages and drawing:
        raise MotionMindError(f"{pages[0]}: --fps, --view and --size are for films, not for a page")
    with all_or_none():
        for path in outputs:
            if path in pages:
                from motionmind.render.group_page import write_group_page

                write_group_page(path, ensemble, sound)
            else:
                from motionmind.render.film import write_group_film

                write_group_film(path, ensemble, sound=sound if may_sound(path) else None, **drawing)
    names = ", ".join(map(displayed_path, outputs))
    click.echo(f"{names}: " + "\n".join(describe_ensemble(ensemble)))
    for one in ensemble.motions() if stage else ():
        note_overstep(one.name, one, stage)
