"""Music on the command line: --music and --offset, the counts that they give, and the sound of films and pages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from motionmind.cli.options import Section, option
from motionmind.cli.printing import note
from motionmind.cli.types import FILE, Number
from motionmind.display import displayed_path
from motionmind.errors import MotionMindError
from motionmind.render import SOUNDING, may_sound
from motionmind.tween.counts import SAME_TIME_S, parse_time

if TYPE_CHECKING:
    from motionmind.music import Beats, Sound
    from motionmind.names.spelling import Source

_Function = TypeVar("_Function", bound=Callable[..., Any])


def with_music(section: Section, text: str, offset: str, *, advanced: bool = False) -> Callable[[_Function], _Function]:
    """Add --music, with the help `text`, and --offset, with the help `offset`, to a command."""

    def decorate(function: _Function) -> _Function:
        for one in (
            option(
                "--offset", section=section, advanced=advanced, type=Number(-60, 3600), metavar="SECONDS", help=offset
            ),
            option("--music", section=section, advanced=advanced, type=FILE, metavar="FILE", help=text),
        ):
            function = one(function)
        return function

    return decorate


def read_counts(music: Path | None, offset: float | None, tempo: float | None) -> Beats | None:
    """Read the beats of --music, with count 1 at the first beat from --offset on, or else at the first downbeat.

    Return None without --music; usage error for an --offset without it, or for a tempo beside beats in a file.

    Args:
        music: the file.
        offset: seconds of the music before count 1.
        tempo: about how many counts a minute, for sound.
    """
    if music is None:
        check_offset(music, offset)
        return None
    from motionmind.music import read_beats
    from motionmind.music.reading import MIDI_SUFFIXES, TEXT_SUFFIXES

    if tempo is not None and music.suffix.lower() in (*TEXT_SUFFIXES, *MIDI_SUFFIXES):
        raise click.UsageError(f"{displayed_path(music)} says when its beats come; leave out --tempo")
    beats = read_beats(music, tempo)
    if offset is not None:
        try:
            beats = beats.starting_at(offset)
        except MotionMindError as error:
            raise MotionMindError(f"--offset {offset:g}: {displayed_path(music)}: {error}") from error
    note(
        f"{displayed_path(music)}: {len(beats)} beats, {beats.tempo:.1f} a minute; count 1 comes at {beats.start:.3f} s"
    )
    return beats


def check_offset(music: Path | None, offset: float | None) -> None:
    """Check that --offset comes with --music."""
    if music is None and offset is not None:
        raise click.UsageError("--offset needs --music")


def in_seconds(request: dict[str, Any], beats: Beats | None) -> dict[str, Any]:
    """Return the options of a tween with counts as seconds, by the beats of music, if any, in place of a tempo."""
    if beats is None:
        return request
    counts, vias = request["counts"], []
    if counts is not None and request["duration"] is not None:
        raise MotionMindError("--counts takes the place of --duration; give one of them")
    for via in request["via"]:
        posture, place = via if isinstance(via, tuple) else (via, None)
        if isinstance(place, str) and place.startswith("count"):
            place = f"{beats.seconds(1.0 + parse_time('--via', place, 60.0)):.6f}s"
        vias.append(via if place is None else (posture, place))
    duration = request["duration"] if counts is None else beats.seconds(1.0 + counts)
    accents = _accents(request.get("accent") or (), beats, duration)
    return request | {"tempo": None, "counts": None, "duration": duration, "via": vias, "accent": accents}


def _accents(counts: Sequence[float], beats: Beats, duration: float | None) -> list[str]:
    """Return accents on counts of music as times; MotionMindError if they do not lie in order between A and B."""
    for count in counts:
        if count < 1.0:
            raise MotionMindError(f"--accent: counts begin with 1, which is A, not with {count:g}")
        if duration is not None and beats.seconds(count) > duration + SAME_TIME_S:
            raise MotionMindError(f"--accent: count {count:g} is after B, which is at count {beats.count(duration):g}")
    if any(after <= before for before, after in pairwise(counts)):
        raise MotionMindError(f"--accent: the counts {', '.join(f'{count:g}' for count in counts)} must increase")
    return [f"{beats.seconds(count):.6f}s" for count in counts]


def read_part_of_sound(path: Path, start: float) -> Sound:
    """Read the sound of a file from `start` seconds on."""
    from motionmind.music import read_sound

    sound = read_sound(path)
    return sound.part(start, max(sound.seconds - start, 1.0)) if start else sound


def sound_of_counts(music: Path | None, beats: Beats | None, outputs: Sequence[Path]) -> Sound | None:
    """Read the sound of --music from count 1 on, if it is sound and an output may have some."""
    from motionmind.music.sound import SOUND_SUFFIXES

    if not (music and beats and music.suffix.lower() in SOUND_SUFFIXES and any(map(may_sound, outputs))):
        return None
    return read_part_of_sound(music, beats.start)


def track_of(source: Source, clip: str | None, home: Path | None, outputs: Sequence[Path]) -> Path | None:
    """Return the sound track of a clip, as clip.wav beside clip.bvh, if an output may have sound."""
    from motionmind.names.tracks import find_sound

    beside = find_sound(source, clip, home) if any(map(may_sound, outputs)) else None
    if beside and find_spec("soundfile") is None:
        note(f'{displayed_path(beside)}: left out; sound needs the extra: pip install "motionmind[music]"')
        return None
    return beside


def check_sounding(outputs: Sequence[Path], music: Path | None, offset: float | None) -> None:
    """Check that all outputs can play --music, if it is given."""
    check_offset(music, offset)
    silent = next((path for path in outputs if not may_sound(path)), None)
    if music and silent:
        raise click.UsageError(f"--music is for {' and '.join(SOUNDING)} files, not for {displayed_path(silent)}")
