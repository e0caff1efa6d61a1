"""The sound of a variation: that of the piece's postures in their new order, or in its own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np

from motionmind._typing import Floats, Singles
from motionmind.music.sound import Sound
from motionmind.variation.variation import Variation

CROSS_FADE_S = 0.02
_DRIFT_S = 0.002  # of a stretch's sound, below which it keeps the pace of the piece

Order = Literal["own", "straight"]


class Span(NamedTuple):
    """A stretch of a variation: its start and end, and those of its movement in the piece, seconds."""

    start: float
    end: float
    piece_start: float
    piece_end: float


def spans(variation: Variation) -> Iterator[Span]:
    """Yield the stretches of a variation; between them are its insertions. Seconds from its first frame."""
    piece, order = variation.piece, variation.postures
    motion, frames = variation.arrange()
    inserted = {seam.at for seam in variation.seams if seam.insertion}
    for start, stop in zip(*piece.chunks(order), strict=True):
        first, last = order[start], order[stop - 1]
        begin, end = (float(motion.times[frames[at]] - motion.times[0]) for at in (start, stop - 1))
        piece_begin, piece_end = (float(piece.motion.times[piece.frames[k]]) for k in (first, last))
        if stop < len(order) and stop - 1 not in inserted:  # the piece goes on until the next stretch starts
            step = float(motion.times[frames[stop]] - motion.times[0]) - end
            piece_end += float(piece.durations[last])
            end += step
        yield Span(begin, end, piece_begin, piece_end)


def sound_of(variation: Variation, track: Sound, order: Order, begins: float = 0.0) -> Sound:
    """Return the sound of a variation.

    Args:
        variation: the variation.
        track: the sound of the piece.
        order: "own" for the sound of each stretch, faded in and out within 20 ms, with silent insertions; "straight"
            for the piece's sound as it is.
        begins: the time in the piece's movement at which its sound begins, seconds.

    Returns:
        Sound as long as the variation, from its first frame.
    """
    motion = variation.motion()
    seconds = float(motion.times[-1] - motion.times[0])
    if order == "straight":
        return track.part(float(variation.piece.motion.times[0]) - begins, seconds)
    half = 0.5 * CROSS_FADE_S
    out = np.zeros((round(seconds * track.rate), track.samples.shape[1]), dtype=np.float32)
    for span in spans(variation):
        lasts = span.end - span.start
        if lasts <= 0.0:
            continue
        pace = (span.piece_end - span.piece_start) / lasts
        heard = _paced(track, span.piece_start - begins - half * pace, lasts + 2.0 * half, pace)
        ramp = np.minimum(np.arange(len(heard)) + 0.5, np.arange(len(heard))[::-1] + 0.5) / (CROSS_FADE_S * track.rate)
        heard = heard * np.clip(ramp, 0.0, 1.0)[:, None].astype(np.float32)
        at = round((span.start - half) * track.rate)
        low, high = max(at, 0), min(at + len(heard), len(out))
        out[low:high] += heard[low - at : high - at]
    return Sound(out, track.rate)


def _paced(track: Sound, start: float, seconds: float, pace: float) -> Singles:
    """Return `seconds` of a track from `start` on [N, C], faster or slower by `pace`, at its own pitch."""
    if abs(pace - 1.0) * seconds < _DRIFT_S or pace <= 0.0:
        return track.part(start, seconds).samples
    from librosa.effects import time_stretch

    part = track.part(start, seconds * pace)
    count = round(seconds * track.rate)
    stretched: Floats = time_stretch(part.samples.T, rate=pace, n_fft=512)
    return Sound(np.asarray(stretched.T, dtype=np.float32), track.rate).part(0.0, count / track.rate).samples
