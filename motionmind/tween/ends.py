"""The ends of a tween, brought onto the corpus's skeleton: the postures A and B, and the body's velocity there."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from motionmind.body.human import human23
from motionmind.body.motion import Motion, Posture, Velocity
from motionmind.corpus.clip import JointFlip
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.flips import find_flips
from motionmind.errors import MotionMindError, MotionMindWarning, SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import joint_mapping
from motionmind.retarget.retarget import to_human23
from motionmind.tween.travel import stand_at
from motionmind.walks.stops import Stop, stop_at

_Movement = TypeVar("_Movement", Motion, Posture)


@dataclass(frozen=True, eq=False)
class Ends:
    """The ends of a tween on the corpus's skeleton.

    Attributes:
        a: posture A.
        b: posture B.
        leaving: the body's velocity at A; None if unknown.
        arriving: the body's velocity at B; None if unknown.
        before: seconds of the movement before A that shows `leaving`; None for none.
        after: seconds of the movement after B that shows `arriving`; None for none.
    """

    a: Posture
    b: Posture
    leaving: Velocity | None
    arriving: Velocity | None
    before: float | None
    after: float | None

    @property
    def rest_in_one_posture(self) -> bool:
        """Whether A equals B to within rounding, and no velocity is known."""
        a, b = self.a, self.b
        if self.leaving is not None or self.arriving is not None:
            return False
        return bool(np.all(rot.angle(a.rotations, b.rotations) < 1e-6) and np.all(np.abs(a.root - b.root) < 1e-6))

    def stops(self, corpus: Corpus) -> tuple[Stop, Stop]:
        """Return the ends as stops of walks through the corpus."""
        return stop_at(corpus, self.a, self.leaving), stop_at(corpus, self.b, self.arriving)


def bring_ends(
    corpus: Corpus,
    a: Posture,
    b: Posture,
    before: Motion | None = None,
    after: Motion | None = None,
    to: Sequence[float] | None = None,
) -> Ends:
    """Bring the postures and the movement around them onto the corpus's skeleton.

    Args:
        corpus: the corpus.
        a: posture A.
        b: posture B.
        before: frames that lead up to A; None if unknown.
        after: frames that follow B; None if unknown.
        to: where B stands, and perhaps its facing (`stand_at`); None for where it is.

    Raises:
        SkeletonError: a posture or a movement has another skeleton than the corpus, or lacks a joint.
        MotionMindError: the movement before A does not end in A, the one after B does not begin in B, or one of them
            has a single frame, which shows no velocity.
    """
    a, b = bring(corpus, a, "posture A"), bring(corpus, b, "posture B")
    if before is not None:
        before = bring(corpus, before, "the movement before A")
        _check_posture(before.posture(-1), a, "the movement before A does not end in A")
        before = _after_flips(before)
    if after is not None:
        after = bring(corpus, after, "the movement after B")
        _check_posture(after.posture(0), b, "the movement after B does not begin in B")
        after = _before_flips(after)
    leaving = None if before is None else Velocity.at_end(before)
    arriving = None if after is None else Velocity.at_start(after)
    if to is not None:
        b, turned = stand_at(b, to)
        arriving = arriving and Velocity(arriving.rotations, rot.mul_vec(turned, arriving.root))
    return Ends(a, b, leaving, arriving, _seconds(before), _seconds(after))


def bring(corpus: Corpus, movement: _Movement, which: str) -> _Movement:
    """Bring a posture or a motion onto the corpus's joints; SkeletonError names the difference."""
    skeleton = corpus.skeleton
    if human23().difference(skeleton) is None and joint_mapping(movement.skeleton) is not None:
        movement = to_human23(movement)
    difference = skeleton.difference(movement.skeleton)
    if difference is not None:
        raise SkeletonError(f"{which} is on another skeleton than corpus {corpus.name!r}: {difference}")
    return movement


def _check_posture(found: Posture, expected: Posture, fault: str) -> None:
    """Check that two postures agree, wherever they stand; else a MotionMindError gives `fault` and the worst joint."""
    degrees = np.degrees(rot.angle(found.rotations, expected.rotations))
    worst = int(degrees.argmax())
    if degrees[worst] > 1.0:  # degrees: files are rounded
        raise MotionMindError(f"{fault}: {found.skeleton.names[worst]} is {degrees[worst]:.3g} degrees off there")


def _after_flips(before: Motion) -> Motion | None:
    """Drop the movement before the last flip of a joint; warn and return None if a joint flips right before A."""
    if flips := find_flips(before):
        before = before.slice(flips[-1].frame, len(before))
        if len(before) == 1:
            _warn_of(flips[-1], "before A")
            return None
    return before


def _before_flips(after: Motion) -> Motion | None:
    """Drop the movement from the first flip of a joint on; warn and return None if a joint flips right after B."""
    if flips := find_flips(after):
        after = after.slice(0, flips[0].frame)
        if len(after) == 1:
            _warn_of(flips[0], "after B")
            return None
    return after


def _warn_of(flip: JointFlip, which: str) -> None:
    """Warn that a flip leaves nothing of the movement before A or after B."""
    message = f"the movement {which} shows no velocity: {flip.joint} flips by {flip.degrees:.0f} degrees in a frame"
    warnings.warn(message, MotionMindWarning, stacklevel=5)


def _seconds(motion: Motion | None) -> float | None:
    """Return the duration of a motion in seconds; None for None."""
    return None if motion is None else float(motion.times[-1] - motion.times[0])
