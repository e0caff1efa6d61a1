"""A sheet of the transitions that a corpus lacks: each with its two postures, and the tween between them."""

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


def gap_sheet(engine: Engine, gaps: Gaps) -> Image.Image:
    """Draw the transitions that a corpus lacks: both postures and, in violet, three of the engine's tween between them.

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
        frames = evenly(range(first, first + len(motion)), 5)
        blanks = [None] * (5 - len(frames))
        inner = [f"{motion.times[frame - first]:.2f} s" for frame in frames[1:-1]]
        captions = ["from", *inner, *[""] * len(blanks), "to"]
        less = before - one.energy.cost
        heading = f"{number}. {less:.2f} nats less a tween: {_words(one.begin)} to {_words(one.end)}"
        rows.append(Row(heading, [*frames[:-1], *blanks, frames[-1]], captions))
        first, before = first + len(motion), one.energy.cost
    name = f"{gaps.corpus}: what to record next"
    return row_sheet(replace(_joined(motions), name=name), rows)


def _words(place: Place) -> str:
    return f"{displayed(place.clip, 24)} at {place.seconds:.2f} s"


def _ends(corpus: Corpus, recommended: Recommended) -> tuple[Posture, Posture]:
    """Return a transition's postures; the second is at the place of the first and, if facing is free, faces like it."""
    begin, end = recommended.postures
    turned = np.array(corpus.rotations[end])
    if corpus.facing == "free":
        turn = rot.heading(corpus.rotations[begin, 0]) - rot.heading(turned[0])
        turned[0] = rot.mul(rot.about_vertical(turn), turned[0])
    place = np.where([True, False, True], corpus.root[begin], corpus.root[end])
    return (
        Posture(corpus.skeleton, corpus.rotations[begin], corpus.root[begin]),
        Posture(corpus.skeleton, rot.normalise(turned), place),
    )


def _joined(motions: Sequence[Motion]) -> Motion:
    """Join motions one after another, 1 s apart."""
    times, insertions, clock = [], list[Insertion](), 0.0
    for motion in motions:
        times.append(motion.times + clock)
        insertions += [replace(one, times=one.times + clock) for one in motion.insertions]
        clock += float(motion.times[-1]) + 1.0
    return replace(
        motions[0],
        rotations=np.concatenate([motion.rotations for motion in motions]),
        root=np.concatenate([motion.root for motion in motions]),
        times=np.concatenate(times),
        insertions=tuple(insertions),
    )
