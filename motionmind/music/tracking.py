"""Beats heard in sound: librosa tracks them, and each moves to the attack that is nearest.

librosa's tracker (Ellis, "Beat tracking by dynamic programming", Journal of New Music Research 36, 2007) follows a
changing tempo. Its beats lie on a grid of 12 ms and come late. So each moves to the steepest rise of the spectrum's
magnitude within 0.07 s before or 0.05 s after it, on a grid of 3 ms.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from motionmind._typing import Floats, Singles
from motionmind.errors import FormatError
from motionmind.files import FilePath
from motionmind.music.beats import LEAST_BEAT_S, Beats
from motionmind.music.sound import NEEDS_EXTRA, opened, samples_of

_HEARD_RATE_HZ = 22_050
_N_HOP, _N_WINDOW, _N_BANDS = 256, 2048, 128  # samples; bands of the spectrum
_N_FINE_HOP, _N_FINE_WINDOW, _N_FINE_BANDS = 64, 512, 40
_N_BLOCK_FRAMES = 4096  # of the spectrum, transformed at a time
_N_TEMPO_FRAMES = 800  # around a frame, which tell its tempo: 9 s
_EARLIER_S, _LATER_S = 0.07, 0.05  # of a tracked beat, to look for its attack
_ATTACK_LAG_S = 0.009  # of the steepest rise in such a window behind the attack; clicks and drums: 8 to 10 ms
_CLEAR_SHARE = 0.3  # of the median rise at a beat: a beat before the first or after the last has as much
_SILENT_SHARE = 0.05  # of it: in a track where nearly all beats are clear, a beat with less is none


def track_beats(path: FilePath, tempo: float | None = None) -> Beats:
    """Find the beats of a sound file.

    Args:
        path: the file.
        tempo: about how many counts a minute; None if unknown, so that half or twice the tempo may be found.

    Raises:
        FormatError: the file cannot be read, or no beats are heard.
        MotionMindError: the extra `music` is not installed.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the libraries that librosa imports
            import librosa
            import librosa.beat
    except ImportError as error:
        raise FormatError(f"finding beats in sound {NEEDS_EXTRA}", path=path) from error
    with opened(path) as file:
        heard = samples_of(file, path).mean(axis=1)
        rate = file.samplerate
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # librosa pads sound that is shorter than a window
        heard = librosa.resample(heard, orig_sr=rate, target_sr=_HEARD_RATE_HZ)
        bands = librosa.power_to_db(_bands(librosa, heard, _N_HOP, _N_WINDOW, _N_BANDS))
        rises = librosa.onset.onset_strength(S=bands, sr=_HEARD_RATE_HZ, hop_length=_N_HOP, n_fft=_N_WINDOW)
        if not rises.any():
            raise FormatError("no beats are heard in it; give their times in a text file", path=path)
        _, found = librosa.beat.beat_track(
            onset_envelope=rises,
            sr=_HEARD_RATE_HZ,
            hop_length=_N_HOP,
            bpm=_tempos(librosa, rises, tempo),
            trim=False,
            units="time",
        )
        bands = np.sqrt(_bands(librosa, heard, _N_FINE_HOP, _N_FINE_WINDOW, _N_FINE_BANDS))
        fine = librosa.onset.onset_strength(S=bands, sr=_HEARD_RATE_HZ, hop_length=_N_FINE_HOP, n_fft=_N_FINE_WINDOW)
    times = _on_attacks(np.asarray(found, dtype=np.float64), fine) if len(found) > 1 else np.empty(0)
    if len(times) < 2:
        raise FormatError("fewer than two beats are heard in it; give their times in a text file", path=path)
    return Beats(times)


def _bands(librosa: Any, heard: Singles, hop: int, window: int, count: int) -> Singles:
    """Return the power of the sound in bands of its spectrum [count, F], a frame each `hop`, in bounded memory."""
    heard = np.pad(heard, window // 2)
    frames = (len(heard) - window) // hop + 1
    out = np.empty((count, frames), dtype=np.float32)
    for first in range(0, frames, _N_BLOCK_FRAMES):
        last = min(first + _N_BLOCK_FRAMES, frames)
        part = heard[first * hop : (last - 1) * hop + window]
        out[:, first:last] = librosa.feature.melspectrogram(
            y=part, sr=_HEARD_RATE_HZ, n_fft=window, hop_length=hop, n_mels=count, center=False
        )
    return out


def _tempos(librosa: Any, rises: Singles, tempo: float | None) -> Floats:
    """Return the tempo around each frame of the sound's rises [F], counts a minute, in bounded memory."""
    parts = []
    for first in range(0, len(rises), _N_BLOCK_FRAMES):
        before = min(first, _N_TEMPO_FRAMES)
        found = librosa.feature.tempo(
            onset_envelope=rises[first - before : first + _N_BLOCK_FRAMES + _N_TEMPO_FRAMES],
            sr=_HEARD_RATE_HZ,
            hop_length=_N_HOP,
            aggregate=None,
            start_bpm=tempo or 120.0,  # librosa's own prior
            std_bpm=1.0 if tempo is None else 0.2,  # octaves; 0.2 rules out half and twice a given tempo
        )
        parts.append(found[before : before + _N_BLOCK_FRAMES])
    return np.concatenate(parts)[: len(rises)]


def _on_attacks(found: Floats, fine: Singles) -> Floats:
    """Move tracked beats [N] to their attacks, drop unclear ones at both ends, and add clear ones there.

    Args:
        found: times of tracked beats, seconds.
        fine: rise of the sound at each fine hop.
    """

    def attack(seconds: float) -> tuple[float, float]:
        low, high = (round((seconds + by) * _HEARD_RATE_HZ / _N_FINE_HOP) for by in (-_EARLIER_S, _LATER_S))
        low, high = max(low, 0), min(high, len(fine))
        if low >= high:
            return seconds, 0.0
        at = low + int(np.argmax(fine[low:high]))
        return at * _N_FINE_HOP / _HEARD_RATE_HZ, float(fine[at])

    times, rises = map(np.array, zip(*map(attack, found), strict=True))
    median = float(np.median(rises))
    clear = rises >= _CLEAR_SHARE * median
    if clear.mean() > 0.9:  # a click track, or nearly: no beat is silent
        kept = rises >= _SILENT_SHARE * median
        times, clear = times[kept], clear[kept]
    first, last = np.flatnonzero(clear)[[0, -1]]
    beats = np.unique(times[first : last + 1]).tolist()
    for end, inner in ((-1, -2), (0, 1)):
        while len(beats) > 1:
            step = abs(beats[end] - beats[inner])
            time, rise = attack(2.0 * beats[end] - beats[inner])
            if rise < _CLEAR_SHARE * median or abs(time - beats[end]) < 0.5 * step:
                break
            beats.insert(len(beats) if end else 0, time)
    moved = np.unique(np.maximum(np.array(beats) - _ATTACK_LAG_S, 0.0))
    return np.asarray(moved[np.concatenate([[True], np.diff(moved) >= LEAST_BEAT_S])])
