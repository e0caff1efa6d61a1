"""Reaches and stays of a request: joints at given or kept places, and how near the motion comes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.display import displayed
from motionmind.solver.reaches import Reach, Stay
from motionmind.tween.options import ReachOption, StayOption, check_time

REACHED_M = 0.01  # up to which distance a joint is at its place


class Reached(msgspec.Struct, frozen=True):
    """A reach, and how near the motion comes.

    Attributes:
        joint: the joint's name.
        place: its place [3], metres.
        seconds: the time, from the start.
        distance: distance of the joint from its place then, metres.
    """

    joint: str
    place: tuple[float, float, float]
    seconds: float
    distance: float

    @property
    def is_met(self) -> bool:
        """Whether the joint is within REACHED_M of its place."""
        return self.distance <= REACHED_M

    def __str__(self) -> str:
        """Return the distance in words."""
        return f"{displayed(self.joint)} is {100.0 * self.distance:.1f} cm from its place at {self.seconds:g} s"


class Stayed(msgspec.Struct, frozen=True):
    """A joint that stays in its place, and how far it drifts.

    Attributes:
        joint: the joint's name.
        begins: share of the duration at which it begins.
        ends: share at which it ends.
        drift: greatest distance from its place meanwhile, metres.
    """

    joint: str
    begins: float
    ends: float
    drift: float

    @property
    def is_met(self) -> bool:
        """Whether the joint stays within REACHED_M of its place."""
        return self.drift <= REACHED_M

    def __str__(self) -> str:
        """Return the drift in words."""
        return f"{displayed(self.joint)} drifts up to {100.0 * self.drift:.0f} cm from its place"


def resolve_stays(skeleton: Skeleton, options: Iterable[StayOption]) -> list[Stay]:
    """Return the stays of a request, on a skeleton; raise SkeletonError if it lacks a joint."""
    return [Stay(skeleton.index(joint), begins, ends) for joint, begins, ends in options]


def find_stayed(motion: Motion, options: Sequence[StayOption]) -> tuple[Stayed, ...]:
    """Measure how far joints drift from the places in which they stay."""
    out = []
    for (name, begins, ends), stay in zip(options, resolve_stays(motion.skeleton, options), strict=True):
        places = motion.positions()[:, stay.joint]
        anchor, frames = stay.frames(places, motion.times - motion.times[0])
        drift = float(np.linalg.norm(places[frames] - places[anchor], axis=1).max(initial=0.0))
        out.append(Stayed(name, begins, ends, drift))
    return tuple(out)


def resolve_reaches(skeleton: Skeleton, options: Iterable[ReachOption]) -> list[Reach]:
    """Return the reaches of a request, on a skeleton; raise SkeletonError if it lacks a joint."""
    return [Reach(skeleton.index(joint), np.array(place), float(seconds)) for joint, place, seconds in options]


def find_reached(motion: Motion, options: Sequence[ReachOption]) -> tuple[Reached, ...]:
    """Measure how near a motion comes to each place; a MotionMindError says which time lies outside the motion."""
    out, lasts = [], float(motion.times[-1])
    for joint, place, seconds in options:
        check_time(joint, seconds, lasts, "; a longer duration makes room")
        there: Floats = motion.at(np.array([seconds])).positions()[0, motion.skeleton.index(joint)]
        x, y, z = map(float, place)
        out.append(Reached(joint, (x, y, z), float(seconds), float(np.linalg.norm(there - place))))
    return tuple(out)
