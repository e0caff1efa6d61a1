"""Beats of a standard MIDI file, from its map of tempos and time signatures."""

from __future__ import annotations

from io import BytesIO

import numpy as np

from motionmind.errors import FormatError, MotionMindError
from motionmind.files import FilePath, read_bytes
from motionmind.music.beats import MAX_BEATS, Beats
from motionmind.music.sound import NEEDS_EXTRA

MAX_MIDI_BYTES = 5_000_000
_QUARTER_S = 0.5  # a quarter note, where a file states no tempo
_N_CLICKS_A_QUARTER = 24


def read_midi(path: FilePath) -> Beats:
    """Read the beats of a standard MIDI file, up to the end of its longest track.

    A beat is as long as the metronome's click that the time signature states, such as a dotted quarter note in 6/8,
    where clicks fill a bar; elsewhere as the note that the signature names.

    Raises:
        FormatError: the file cannot be read, or has fewer than two beats or too many.
        MotionMindError: the extra `music` is not installed.
    """
    try:
        import mido
        from mido.midifiles.meta import KeySignatureError
    except ImportError as error:
        raise MotionMindError(f"{path}: MIDI {NEEDS_EXTRA}") from error
    data = read_bytes(path)
    if len(data) > MAX_MIDI_BYTES:
        raise FormatError(f"has {len(data) / 1e6:.0f} MB; MIDI files may have 5", path=path)
    try:
        file = mido.MidiFile(file=BytesIO(data), clip=True)
    except (EOFError, OSError, ValueError, LookupError, TypeError, AttributeError, KeySignatureError) as error:
        raise FormatError(f"cannot be read as MIDI: {error or 'it ends too early'}", path=path) from error
    if file.type == 2 or file.ticks_per_beat <= 0:
        fault = "its tracks follow each other" if file.type == 2 else "its times are in frames of film"
        raise FormatError(f"{fault}: no beats can be read from it", path=path)
    tempos, signatures, end = {0: round(1e6 * _QUARTER_S)}, {0: (4, 4, _N_CLICKS_A_QUARTER)}, 0
    for track in file.tracks:
        tick = 0
        for message in track:
            tick += message.time
            if message.type == "set_tempo":
                tempos[tick] = max(message.tempo, 1)
            elif message.type == "time_signature":
                signatures[tick] = message.numerator, message.denominator, message.clocks_per_click
        end = max(end, tick)
    ticks, numbers = _beats(signatures, end, file.ticks_per_beat, path)
    changes = np.array(sorted(tempos))
    second = np.array([tempos[at] for at in changes.tolist()]) / (1e6 * file.ticks_per_beat)  # a tick
    begins = np.concatenate([[0.0], np.cumsum(np.diff(changes) * second[:-1])])
    at = np.searchsorted(changes, ticks, side="right") - 1
    try:
        return Beats(begins[at] + (ticks - changes[at]) * second[at], numbers)
    except MotionMindError as error:
        raise FormatError(str(error), path=path) from error


def _beats(
    signatures: dict[int, tuple[int, int, int]], end: int, quarter: int, path: FilePath
) -> tuple[np.ndarray, np.ndarray]:
    """Return the beats' ticks [N] and their numbers in their bars [N].

    Args:
        signatures: by tick: notes in a bar, the note (4 is a quarter), and clocks between two clicks.
        end: the last tick.
        quarter: ticks of a quarter note.
        path: the file, for the message.
    """
    ticks: list[float] = []
    numbers: list[int] = []
    starts = sorted(signatures)
    for start, stop in zip(starts, [*starts[1:], end + 1], strict=True):
        notes, note, clocks = signatures[start]
        if notes == 0:
            raise FormatError("has a time signature of 0 notes in a bar", path=path)
        bar = 4.0 * quarter * notes / note
        step = quarter * clocks / _N_CLICKS_A_QUARTER
        per_bar = bar / step if step else 0.0
        if per_bar < 1.0 or per_bar != round(per_bar):
            per_bar, step = float(notes), bar / notes
        count = int(np.ceil((stop - start) / step))
        if len(ticks) + count > MAX_BEATS:
            raise FormatError(f"has more than {MAX_BEATS:,} beats", path=path)
        ticks += [start + step * number for number in range(count)]
        numbers += [1 + number % round(per_bar) for number in range(count)]
    return np.array(ticks), np.array(numbers, dtype=np.int64)
