"""A sheet of the transitions that a corpus lacks: each with its two postures, and what the engine makes of the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from PIL import Image

from motionmind.body.motion import Insertion, Motion, Posture
from motionmind.corpus.corpus import Corpus
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.gaps.gaps import Gaps, Place, Recommended
from motionmind.geometry import rotations as rot
from motionmind.render.sheet import Row, evenly, row_sheet
from motionmind.tween.engine import Engine

_BETWEEN = 3  # moments of the way that are drawn
_CLIP = 24  # characters of a clip's name
_APART = 1.0  # seconds from the end of one movement to the beginning of the next
_FLOOR = np.array([1.0, 0.0, 1.0])


def gap_sheet(engine: Engine, gaps: Gaps) -> Image.Image:
    """Draw the transitions that a corpus lacks; between their postures, in violet, the best movement it has for them.

    Args:
        engine: the corpus.
        gaps: its gaps.

    Raises:
        MotionMindError: there is no transition to draw.
    """
    if not gaps.transitions:
        raise MotionMindError(f"corpus {gaps.corpus!r}: there is nothing to draw: no transition would help its tweens")
    motions = [engine.tween(*_ends(engine.corpus, one)).motion for one in gaps.transitions]
    rows, first, before = [], 0, gaps.energy.cost
    for number, (one, motion) in enumerate(zip(gaps.transitions, motions, strict=True), start=1):
        frames = evenly(range(first, first + len(motion)), _BETWEEN + 2)
        blanks = [None] * (_BETWEEN + 2 - len(frames))
        inner = [f"{motion.times[frame - first]:.2f} s" for frame in frames[1:-1]]
        captions = ["from", *inner, *[""] * len(blanks), "to"]
        less = before - one.energy.cost
        heading = f"{number}. {less:.2f} nats less a tween: {_words(one.begin)} to {_words(one.end)}"
        rows.append(Row(heading, [*frames[:-1], *blanks, frames[-1]], captions))
        first, before = first + len(motion), one.energy.cost
    name = f"{gaps.corpus}: what to record next"
    return row_sheet(replace(_joined(motions), name=name), rows)


def _words(place: Place) -> str:
    return f"{displayed(place.clip, _CLIP)} at {place.seconds:.2f} s"


def _ends(corpus: Corpus, recommended: Recommended) -> tuple[Posture, Posture]:
    """Return a transition's postures, the second on the same place, and, if it may face anywhere, as the first."""
    begin, end = recommended.postures
    turned = np.array(corpus.rotations[end])
    if corpus.facing == "free":
        turn = rot.heading(corpus.rotations[begin, 0]) - rot.heading(turned[0])
        turned[0] = rot.mul(rot.about_vertical(turn), turned[0])
    place = np.where(_FLOOR > 0.0, corpus.root[begin], corpus.root[end])
    return (
        Posture(corpus.skeleton, corpus.rotations[begin], corpus.root[begin]),
        Posture(corpus.skeleton, rot.normalise(turned), place),
    )


def _joined(motions: Sequence[Motion]) -> Motion:
    """Return motions one after another."""
    times, insertions, clock = [], list[Insertion](), 0.0
    for motion in motions:
        times.append(motion.times + clock)
        insertions += [replace(one, times=one.times + clock) for one in motion.insertions]
        clock += float(motion.times[-1]) + _APART
    return replace(
        motions[0],
        rotations=np.concatenate([motion.rotations for motion in motions]),
        root=np.concatenate([motion.root for motion in motions]),
        times=np.concatenate(times),
        insertions=tuple(insertions),
    )
