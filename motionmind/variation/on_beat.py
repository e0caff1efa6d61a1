"""Variations on the beat: their stretches and insertions start on every n-th beat.

Each part is stretched or compressed to end on one of these beats: the one that changes its pace least. No part plays
more than 1.25 times as fast; slowing down has no limit. Feet that stand still do so at any pace. The last stretch keeps
its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.arguments import check_type
from motionmind.errors import MotionMindError
from motionmind.music.beats import Beats
from motionmind.variation.arguments import check_numbers, check_whole
from motionmind.variation.orders import MAX_EVERY
from motionmind.variation.piece import Arrangement, Piece
from motionmind.variation.review import Seam

MAX_PACE_RATIO = 1.25  # of a part, relative to the piece or to the insertion as found
_SAME_TIME_S = 1e-6  # times no farther apart count as equal

Kind = Literal["stretch", "insertion"]


class OnBeat(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The beats on which stretches and insertions start.

    Attributes:
        every: the interval in counts.
        times: seconds from the first frame to counts 1, 1 + every, 1 + 2 every, ...; they begin with 0, and after the
            last one the last interval repeats.
    """

    every: int
    times: tuple[float, ...]


class Part(msgspec.Struct, frozen=True):
    """A stretch or an insertion of a variation on the beat.

    Attributes:
        kind: which of the two.
        count: the count on which it starts.
        seconds: when it starts, from the first frame.
        pace: its pace relative to the piece, or to the insertion as found; 1 where it lasts no time.
    """

    kind: Kind
    count: int
    seconds: float
    pace: float


def check_on_beat(on_beat: OnBeat) -> OnBeat:
    """Return the beats of a variation; MotionMindError if they do not begin with 0 and increase."""
    check_whole("every", on_beat.every, 1, MAX_EVERY)
    times = np.array(check_numbers("times", on_beat.times))
    if len(times) < 2 or times[0] != 0.0 or (np.diff(times) <= _SAME_TIME_S).any():
        raise MotionMindError("the beats of a variation must be two or more, begin with 0, and increase")
    return on_beat


def find_on_beat(beats: Beats | None, every: int | None) -> OnBeat | None:
    """Return every n-th beat from count 1 on, up to where counts only repeat the last interval; None for no beats.

    Raises:
        MotionMindError: one of both is given without the other, or `every` is out of range.
    """
    check_type("beats", beats, Beats, or_none=True)
    every = None if every is None else check_whole("on_beat", every, 1, MAX_EVERY)
    if beats is None or every is None:
        if beats is not None or every is not None:
            raise MotionMindError("on_beat and beats need each other")
        return None
    step = float(beats.times[-1] - beats.times[-2])
    times = beats.grid(every, beats.seconds(beats.counts) + (2 * every + 1) * step)
    return OnBeat(every, tuple(times.tolist()))


def least_stretch(on_beat: OnBeat, piece: Piece) -> int:
    """Return the least number of postures that fill the interval between two starts at a permitted pace."""
    interval = float(np.median(np.diff(on_beat.times)))
    fewest = int(np.ceil(interval / MAX_PACE_RATIO / float(np.median(piece.durations)))) + 1
    return max(1, min(fewest, len(piece) // 5))


def retime(arrangement: Arrangement, seams: Sequence[Seam], on_beat: OnBeat) -> tuple[Arrangement, list[Part]]:
    """Return an arrangement whose stretches and insertions start on the beat, and these parts."""
    motion, frames = arrangement
    own = motion.times - motion.times[0]
    starts: list[tuple[Kind, float]] = [("stretch", 0.0)]
    for seam in seams:
        if seam.insertion:
            starts.append(("insertion", float(own[frames[seam.at]])))
        starts.append(("stretch", float(own[frames[seam.at + 1]])))
    parts: list[Part] = []
    knots: list[float] = []
    targets: list[float] = []
    at = 0
    for number, (kind, start) in enumerate(starts):
        seconds = _beat(on_beat, at)
        length = starts[number + 1][1] - start if number + 1 < len(starts) else 0.0
        after = _end(on_beat, at, length) if length > _SAME_TIME_S else at
        pace = length / (_beat(on_beat, after) - seconds) if after > at else 1.0
        parts.append(Part(kind, 1 + on_beat.every * at, seconds, pace))
        if not knots or start > knots[-1] + _SAME_TIME_S:
            knots.append(start)
            targets.append(seconds)
        at = after
    knots.append(knots[-1] + float(own[-1]) + 1.0)  # beyond the last frame: the last stretch at its own pace
    targets.append(targets[-1] + float(own[-1]) + 1.0)

    def warped(times: Floats) -> Floats:
        return np.asarray(np.interp(times - motion.times[0], knots, targets) + motion.times[0])

    insertions = tuple(replace(one, times=warped(one.times)) for one in motion.insertions)
    return Arrangement(replace(motion, times=warped(motion.times), insertions=insertions), frames), parts


def _beat(on_beat: OnBeat, at: int) -> float:
    """Return when a start may come, seconds."""
    times = on_beat.times
    last = len(times) - 1
    return times[at] if at <= last else times[-1] + (at - last) * (times[-1] - times[-2])


def _end(on_beat: OnBeat, at: int, length: float) -> int:
    """Return the beat at which a part ends that starts at another and lasts `length` seconds at its own pace."""
    start, later = _beat(on_beat, at), at + 1
    while _beat(on_beat, later) - start < length:
        later += 1
    shorter = _beat(on_beat, later - 1) - start
    is_fast = shorter < length / MAX_PACE_RATIO
    return later if is_fast or length / shorter > (_beat(on_beat, later) - start) / length else later - 1
