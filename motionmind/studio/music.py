"""The music of a piece: a file of this computer, its beats, and its sound, which plays on this computer alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import msgspec
import numpy as np
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.display import displayed_path
from motionmind.errors import FormatError, MotionMindError
from motionmind.music.sound import SOUND_SUFFIXES, Sound
from motionmind.studio import api
from motionmind.studio.edits import Several
from motionmind.studio.local_files import LocalFile, PathText, find_file, is_here, show_file
from motionmind.studio.settings import MAX_TEMPO, MIN_TEMPO, SetMusic, SetTempo, Tempo
from motionmind.studio.workers import Report

if TYPE_CHECKING:
    from motionmind.studio.piece import State
    from motionmind.studio.studio import Studio

_NOT_HERE = "the music plays only on the studio's own computer"
_N_DIGITS = 4  # of a second, in the project's file


class ChoosingMusic(msgspec.Struct, forbid_unknown_fields=True):
    """The window that chooses music, the music's path, and about how many counts a minute, if known."""

    window: api.Window
    path: PathText
    tempo: Tempo | None = None


class Heard(NamedTuple):
    """The beats of a file.

    Attributes:
        times: seconds from its beginning; none if no beats are heard.
        first: index of the beat that is count 1.
        tempo: counts a minute; None without beats.
    """

    times: tuple[float, ...] = ()
    first: int = 0
    tempo: float | None = None


def hear(_: Report, path: str, tempo: float | None) -> Heard:
    """Find the beats of a file, in a worker.

    Args:
        path: the file.
        tempo: about how many counts a minute; None if unknown.

    Raises:
        FormatError: the file cannot be read.
        MotionMindError: the extra `music` is not installed.
    """
    from motionmind.music import read_beats, read_sound

    try:
        beats = read_beats(path, tempo)
    except FormatError:
        if Path(path).suffix.lower() not in SOUND_SUFFIXES:
            raise
        read_sound(path)  # raises if it is no sound; otherwise only its beats are missing
        return Heard()
    first = int(np.searchsorted(beats.times, beats.start))
    return Heard(tuple(np.round(beats.times, _N_DIGITS).tolist()), first, round(beats.tempo, 1))


def find_sound(path: str) -> LocalFile:
    """Return the sound file at a path; raise MotionMindError if there is none."""
    file = find_file(path, "song.mp3", _type_of)
    if not file.type or file.path.suffix.lower() not in SOUND_SUFFIXES:
        *most, last = SOUND_SUFFIXES
        raise MotionMindError(f"{displayed_path(file.path)}: not a sound file: use {', '.join(most)} or {last}")
    return file


def has_sound(state: State) -> bool:
    """Return whether a piece has music that sounds: text and MIDI only have beats."""
    return Path(state.music.path).suffix.lower() in SOUND_SUFFIXES


def sound_of(path: str, begins: float, seconds: float) -> Sound:
    """Read the sound of a piece: silence before and after the music.

    Args:
        path: the music's file.
        begins: time of the music at the piece's start, seconds.
        seconds: the piece's length.

    Raises:
        MotionMindError: the file cannot be read.
    """
    from motionmind.music import read_sound

    try:
        return read_sound(path).part(begins, seconds)
    except MotionMindError as error:
        raise MotionMindError(f"the piece's music: {error}") from error


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes, which other computers may not use."""

    async def choose(request: Request) -> Response:
        given = await api.body_of(request, ChoosingMusic)
        if not is_here(request):
            return api.error(_NOT_HERE, 403)
        path = str(find_file(given.path, "song.mp3", _type_of).path)

        def keep(heard: Heard) -> None:
            """Make a file the piece's music, or replace the beats of the one that is."""
            state = studio.project.state
            is_same = path == state.music.path
            if is_same and state.music.beats and not heard.times:
                raise MotionMindError("no beats were found near this tempo; yours are kept")
            begins = state.music.begins if is_same else heard.times[heard.first] if heard.times else 0.0
            tempo = min(max(heard.tempo or state.tempo, MIN_TEMPO), MAX_TEMPO)
            chosen = SetMusic(path, begins, heard.times, heard.first)
            words = "find the beats" if is_same else "choose the music"
            studio.project.edit(given.window, Several((chosen, SetTempo(tempo, state.counts)), words))

        return api.json({"job": studio.workers.submit("music", hear, path, given.tempo, finish=keep, urgent=True).id})

    async def show(request: Request) -> Response:
        if not is_here(request):
            return api.error(_NOT_HERE, 403)
        if not has_sound(studio.project.state):
            return api.error("the piece has no sound, only beats", 404)
        try:
            sound = find_sound(studio.project.state.music.path)
        except MotionMindError as error:
            return api.error(str(error), 404)
        return show_file(request, sound)

    return [Route("/api/music", show), Route("/api/music", choose, methods=["POST"])]


def _type_of(head: bytes) -> str:
    """Return the media type of a sound file by its first twelve bytes; "" if it is none."""
    if head.startswith((b"RIFF", b"RF64")) and head[8:12] == b"WAVE":
        return "audio/wav"
    if head.startswith(b"fLaC"):
        return "audio/flac"
    if head.startswith(b"OggS"):
        return "audio/ogg"
    is_frame = len(head) > 1 and head[0] == 0xFF and head[1] >= 0xE0  # of MPEG
    return "audio/mpeg" if is_frame or head.startswith(b"ID3") else ""
