"""Beats from a file: sound, a text file of times, or MIDI."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from motionmind.arguments import check_path, check_real
from motionmind.errors import FormatError, MotionMindError
from motionmind.files import FilePath
from motionmind.formats.text import read_lines, to_numbers
from motionmind.music.beats import MAX_BEATS, Beats
from motionmind.music.sound import SOUND_SUFFIXES

TEXT_SUFFIXES = (".txt", ".beats")
MIDI_SUFFIXES = (".mid", ".midi")
_NUMBER_IN_BAR = re.compile(r"[0-9]{1,3}\Z")
MUSIC_SUFFIXES = (*SOUND_SUFFIXES, *TEXT_SUFFIXES, *MIDI_SUFFIXES)


def read_beats(path: FilePath, tempo: float | None = None) -> Beats:
    """Read the beats of a piece of music.

    Args:
        path: sound (`.wav`, `.flac`, `.ogg`, `.mp3`), whose beats are found; a text file (`.txt`, `.beats`), which has
            the seconds of a beat in each line, and after them its number in the bar if known; or a standard MIDI file
            (`.mid`, `.midi`).
        tempo: about how many counts a minute, for sound, where half or twice the tempo may be found without it.

    Raises:
        FormatError: the file cannot be read, or has no beats.
        MotionMindError: sound or MIDI, but the extra `music` is not installed.

    >>> from pathlib import Path
    >>> from motionmind.music import read_beats
    >>> _ = Path("waltz.txt").write_text("0.4 3" + chr(10) + "1.0 1" + chr(10) + "1.6 2")
    >>> read_beats("waltz.txt").start
    1.0
    """
    check_path("path", path)
    check_real("tempo", tempo, or_none=True)
    suffix = Path(path).suffix.lower()
    if suffix in TEXT_SUFFIXES:
        return _read_text(path)
    if suffix in MIDI_SUFFIXES:
        from motionmind.music.midi import read_midi

        return read_midi(path)
    if suffix not in SOUND_SUFFIXES:
        raise FormatError(f"is no music that can be read: give {', '.join(MUSIC_SUFFIXES)}", path=path)
    from motionmind.music.tracking import track_beats

    return track_beats(path, tempo)


def _read_text(path: FilePath) -> Beats:
    """Read a text file of beats: seconds, and perhaps the number in the bar, in each line; # begins a comment."""
    times: list[float] = []
    numbers: list[int] = []
    for line, text in enumerate(read_lines(path), start=1):
        words = text.partition("#")[0].replace(",", " ").split()
        if not words:
            continue
        if len(words) > 2 or not all(map(_NUMBER_IN_BAR.match, words[1:])):
            fault = "a line has the seconds of a beat, and perhaps its number in the bar"
            raise FormatError(fault, path=path, line=line)
        times += to_numbers(words[:1], path, line)
        numbers.append(int(words[1]) if len(words) == 2 else 0)
        if len(times) > 1 and times[-1] <= times[-2]:
            fault = f"{times[-1]:g} s after {times[-2]:g} s: beats must not go backwards"
            raise FormatError(fault, path=path, line=line)
        if len(times) > MAX_BEATS:
            raise FormatError(f"more than {MAX_BEATS:,} beats", path=path, line=line)
    try:
        return Beats(np.array(times), np.array(numbers))
    except MotionMindError as error:
        raise FormatError(str(error), path=path) from error
