"""Limits of plausible movement, learned from a corpus.

Two measures extend those of `motionmind.body.plausibility`:

- `pace`: the greatest ratio of speed to fastest speed over all joints, the body's turn and its travel, where the
  fastest speed of a part is its 99th percentile over the corpus's frames (`motionmind.learned.pace`);
- `sliding`: the share of a second in which a foot near the floor moves farther between frames than a stance foot
  (`motionmind.body.contact.skating`), for bodies of human height with feet.

The limit of each measure is the 99.5th percentile, over all one-second stretches of the corpus's clips, of its greatest
value in a stretch; a shorter clip is one stretch.

The speed of feet near the floor is not a measure but a limit for tweens: the 95th percentile over the same stretches. A
few kicks are much faster in every corpus, but its steps are not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats
from motionmind.body.contact import (
    CONTACT_FPS,
    STANCE_STEP_M,
    TALL_BODY_M,
    find_feet,
    floor_height,
    foot_slides,
    lowest_height,
)
from motionmind.body.motion import Motion
from motionmind.body.noticeable import NOTICEABLE_M, NOTICEABLE_MPS2, NOTICEABLE_SHARE
from motionmind.body.plausibility import SEEN, at_rate, floor_of, greatest, implausibility
from motionmind.corpus.corpus import FACING, Corpus
from motionmind.learned.pace import way_of
from motionmind.learned.sampled import BLOCK_FRAMES, Sampled

MEASURES = (*SEEN, "pace", "sliding")
UNITS_AND_MEANINGS = {
    "balance": ("m", "how far the body, calm on one limb, leans beyond its support"),
    "bounce": ("m/s^2", "greatest vertical acceleration of the body's mass"),
    "flight": ("", "share of gravity that the body lacks in the air: 1 where it floats"),
    "crossed_limbs": ("m", "greatest penetration depth of limbs"),
    "pace": ("", "greatest ratio of a part's speed to its fastest usual speed"),
    "sliding": ("", "greatest share of a second in which a foot near the floor slides"),
}
# By unit: the least excess that a viewer notices.
_NOTICEABLE = {"m": NOTICEABLE_M, "m/s^2": NOTICEABLE_MPS2, "": NOTICEABLE_SHARE}
STRETCH_S = 1.0
LIMIT_PERCENTILE = 99.5  # of the corpus's own stretches
FOOT_SPEED_PERCENTILE = 95.0  # for feet near the floor
MIN_FOOT_SPEED_LIMIT = 1.5  # heights/s: feet reach it in slow walking
# Negligible values in any corpus: metres, m/s^2, share of gravity, metres, ratio of speeds, share.
NEGLIGIBLE_EXCESS = np.array([0.02, 1.0, 0.2, 0.01, 1.0, 0.2])
_N_FRAMES_MEASURED = 40_000  # approximately
_PIECE_FRAMES = BLOCK_FRAMES // 32  # the size of pieces of a corpus with more frames


@dataclass(frozen=True)
class Sighting:
    """A movement's greatest value of a plausibility measure, and the corpus's limit.

    Attributes:
        value: the greatest value; None where the measure does not apply to the movement.
        most: the limit from one-second stretches of the corpus; None where the corpus sets none.
        unit: the unit of both; "" for shares and ratios.
        part: the body part with the greatest value: a joint, "facing" or "travel"; "" if it is not a single part.

    >>> from motionmind.learned import Sighting
    >>> Sighting(31.0, 18.5, "m/s^2").is_beyond
    True
    """

    value: float | None
    most: float | None
    unit: str
    part: str = ""

    @property
    def is_beyond(self) -> bool:
        """Whether the movement exceeds the corpus's limit by so much that a viewer notices."""
        if self.value is None or self.most is None:
            return False
        return self.value - self.most > max(_NOTICEABLE[self.unit], NOTICEABLE_SHARE * abs(self.most))


@dataclass(frozen=True, eq=False)
class Plausibility:
    """The limits of a corpus with J joints.

    Attributes:
        fastest: fastest speeds of the joints, rad/s, of the body's turn, rad/s, and of its travel, heights/s [J + 2].
        most: limits in the order of `MEASURES` [M]; NaN where a measure never applies in the corpus.
        slides: limit on the speed of a foot near the floor, heights/s [1]; NaN for bodies without feet.
    """

    fastest: Floats
    most: Floats
    slides: Floats

    def shown(self, motion: Motion) -> dict[str, Sighting]:
        """Measure a movement on the corpus's joints; return a `Sighting` for each measure, by name."""
        values, part = _summarise(motion, self.fastest, None)
        most = np.maximum(self.most, NEGLIGIBLE_EXCESS)  # NaN stays NaN
        return {
            name: Sighting(
                _or_none(value), _or_none(limit), UNITS_AND_MEANINGS[name][0], part if name == "pace" else ""
            )
            for name, value, limit in zip(MEASURES, values, most, strict=True)
        }


def learn_plausibility(corpus: Corpus, fastest: Floats) -> Plausibility:
    """Learn the limits of a corpus from its clips.

    Args:
        corpus: the movement.
        fastest: see `Plausibility`.
    """
    stretches = [_greatest_of_stretches(values) for values in _frames_of(corpus, fastest)]
    most = np.full(len(MEASURES) + 1, np.nan)
    for column, percent in enumerate((*[LIMIT_PERCENTILE] * len(MEASURES), FOOT_SPEED_PERCENTILE)):
        known = np.concatenate([values[:, column] for values in stretches])
        if np.isfinite(known).any():
            most[column] = np.percentile(known[np.isfinite(known)], percent)
    return Plausibility(fastest, most[:-1], np.maximum(most[-1:], MIN_FOOT_SPEED_LIMIT))


def summarise_shown(motion: Motion, fastest: Floats, floor: float) -> Floats:
    """Return a movement's greatest value of each of `MEASURES` [M], above a floor at a height in metres."""
    return _summarise(motion, fastest, floor)[0]


def _summarise(motion: Motion, fastest: Floats, floor: float | None) -> tuple[Floats, str]:
    """Return a movement's greatest value of each of `MEASURES` [M], and the name of its fastest part.

    The floor's height is in metres; None means 0, or lower if the body is lower.
    """
    sampled = at_rate(motion)
    if floor is None:
        floor = floor_of(sampled.skeleton, sampled.rotations, sampled.root)
    shown = _show(sampled, fastest, floor)
    parts, speeds = (*motion.skeleton.names, FACING, "travel"), shown.speeds
    return greatest(shown.frames), parts[int(speeds.max(axis=0).argmax())] if len(speeds) else ""


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


class _Shown(NamedTuple):
    """Measures of a movement of T frames, at 30 per second.

    Attributes:
        frames: the measures in each frame [T, M].
        speeds: ratio of each part's speed between frames to its fastest speed [T - 1, J + 2].
        slides: speed of the fastest foot near the floor up to each frame [T], heights/s; NaN for small bodies and those
            without feet.
    """

    frames: Floats
    speeds: Floats
    slides: Floats


def _show(sampled: Motion, fastest: Floats, floor: float) -> _Shown:
    """Measure movement at 30 frames per second, above a floor at a height in metres."""
    frames = implausibility(sampled.skeleton, sampled.rotations, sampled.root, CONTACT_FPS, floor)
    pace = np.full((len(sampled), 1), np.nan)
    speeds = CONTACT_FPS * way_of(sampled).parts / fastest
    pace[1:, 0] = speeds.max(axis=1)
    sliding, slides = _sliding(sampled, floor)
    return _Shown(np.concatenate([frames, pace, sliding[:, None]], axis=1), speeds, slides)


def _sliding(motion: Motion, floor: float) -> tuple[Floats, Floats]:
    """Return the share of the second up to each frame in which a foot slides, and the speed (see `_Shown`) [T].

    Time before the movement counts as not sliding.
    """
    body = motion.skeleton
    if body.height < TALL_BODY_M or not find_feet(body):
        return np.full(len(motion), np.nan), np.full(len(motion), np.nan)
    slides = foot_slides(body, motion.rotations, motion.root, floor)
    so_far = np.concatenate([np.zeros(round(CONTACT_FPS) + 1), np.cumsum((slides > STANCE_STEP_M).any(axis=-1))])
    share = (so_far[round(CONTACT_FPS) :] - so_far[: len(motion)]) / CONTACT_FPS
    return np.asarray(share), np.append(0.0, CONTACT_FPS * slides.max(axis=-1) / body.height)


def _frames_of(corpus: Corpus, fastest: Floats) -> Iterator[Floats]:
    """Yield the measures in each frame of a corpus's clips, and the speed of feet [T, M + 1].

    The speed of feet is infinite in reconstructed movement.

    If a corpus has more than _N_FRAMES_MEASURED frames, evenly spread pieces with about that many are measured.
    """
    seconds = sum(corpus.times[clip.stop - 1] - corpus.times[clip.start] for clip in corpus.clips)
    every = int(np.ceil(CONTACT_FPS * seconds / _N_FRAMES_MEASURED))
    pieces = 0
    for clip in corpus.clips:
        recording = Sampled(corpus, clip, CONTACT_FPS, smooth=True)
        size = max(len(recording), BLOCK_FRAMES) if every <= 1 else _PIECE_FRAMES
        many = -(-len(recording) // size)
        chosen = range(-pieces % every, many, every) if every > 1 else range(many)
        pieces += many
        if len(chosen):  # else skip the floor, which takes all frames to find
            kept, floor = _pieces_of(recording, size, chosen)
            for piece in kept:
                shown, danced = _show(piece, fastest, floor), recording.danced(piece.times)
                slides = np.where(np.append(True, danced), shown.slides, np.inf)
                yield np.column_stack([shown.frames, slides])


def _pieces_of(recording: Sampled, size: int, chosen: range) -> tuple[list[Motion], float]:
    """Return the `chosen` pieces of a clip, cut every `size` frames, and the height of its floor, metres."""
    lowest: list[Floats] = []
    kept: list[Motion] = []
    numbers = count()
    for block in recording.blocks(max(size, BLOCK_FRAMES)):
        lowest.append(lowest_height(block.skeleton, block.rotations, block.root))
        parts = (block.slice(start, start + size) for start in range(0, len(block), size))
        kept += [part for part, number in zip(parts, numbers, strict=False) if number in chosen]
    return kept, floor_height(np.concatenate(lowest))


def _greatest_of_stretches(values: Floats) -> Floats:
    """Return the maximum of each column [T, M] in each stretch [stretches, M]; minus infinity if all are NaN."""
    known = np.where(np.isnan(values), -np.inf, values)
    windows = np.lib.stride_tricks.sliding_window_view(known, min(round(STRETCH_S * CONTACT_FPS), len(known)), axis=0)
    return np.asarray(windows.max(axis=-1))
