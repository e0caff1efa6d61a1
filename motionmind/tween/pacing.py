"""Pacing: a cost for the number of moves, given the distance to cover.

A likeliest path hurries: every move costs something, so the energy alone prefers as few as the states' graphs allow.
Dancers take their time (`motionmind.learned.pace`). So a segment of T moves, of u seconds each, pays a toll

    10 L (log(T u / d) / spread)^2 / 2 + 10000 max(0, least / (T u) - 1)   nats

beside its haste (`motionmind.search.length`):

- the first term is the duration's -log density in the corpus, given the displacement, up to a constant; d is the
  median. Haste adds up over the L chains, so the duration counts ten times for each chain too;
- `least` is the shortest time in which every joint can turn, and the body turn and travel, at no more than the 99th
  percentile of the corpus's speeds. The peak speed of a smooth movement is 15/8 of its mean where jerk is least (Flash
  and Hogan, J. Neuroscience 5:1688, 1985). The toll amounts to a prohibition, but gives way where the number of moves
  is bounded from above.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion, Posture
from motionmind.display import displayed
from motionmind.geometry.polylines import length_of
from motionmind.learned.model import LearnedCorpus
from motionmind.learned.nearest import postures_near
from motionmind.learned.pace import N_NEIGHBORS, over_seconds, way_between, way_of
from motionmind.synthesis.timeline import usual

PEAK_SPEED_RATIO = 15.0 / 8.0  # peak speed of a smooth movement over its mean


@dataclass(frozen=True)
class UsualTime:
    """The usual time in the corpus for the displacement from one stop to the next.

    Attributes:
        median: median duration of movements with this displacement, seconds.
        least: shortest time in which no body part need exceed the 99th percentile of its speed in the corpus, seconds.
        slowest: the body part that determines `least`: a joint, "turning" or "travel".
    """

    median: float
    least: float
    slowest: str


def usual_times(learned: LearnedCorpus, stops: Sequence[Posture], route: Floats | None = None) -> tuple[UsualTime, ...]:
    """Return the corpus's usual time from each posture to the next; each covers an equal share of a route [P, 2]."""
    parts = _parts(learned)
    resting = find_resting_speeds(learned, np.stack([posture.rotations for posture in stops]))
    out = []
    for (a, first), (b, last) in pairwise(zip(stops, resting, strict=True)):
        displacement = way_between(a, b)
        if route is not None:
            heights = length_of(route) / (learned.corpus.skeleton.height or 1.0)
            displacement = displacement._replace(travel=np.asarray(heights / (len(stops) - 1)))
        needs = PEAK_SPEED_RATIO * displacement.parts / learned.pace.fastest
        slowest = int(needs.argmax())
        median = float(learned.pace.expected(displacement, (first, last)))
        out.append(UsualTime(median, float(needs[slowest]), parts[slowest]))
    return tuple(out)


def find_resting_speeds(learned: LearnedCorpus, rotations: Floats) -> Floats:
    """Return the resting speeds [n] of postures [n, J, 4], where the corpus knows them (`Pace.resting_speeds_of`)."""
    corpus, joints = learned.corpus, len(learned.corpus.skeleton)
    shown, trees = learned.statistics.orientations, learned.statistics.trees
    postures = corpus.to_chains(rotations)[:, :joints]
    if trees is None:
        return learned.pace.resting_speeds_of(postures, shown[: len(corpus), :joints])
    near = (postures_near(trees, shown, posture, N_NEIGHBORS, len(corpus)) for posture in postures)
    return np.array([learned.pace.resting_speed_of(numbers) for numbers in near])


class FasterPart(msgspec.Struct, frozen=True):
    """The name of a body part, and its speed as a multiple of its greatest speed in the corpus."""

    part: str
    times: float


class Tempo(msgspec.Struct, frozen=True):
    """The timing of a tween compared with the corpus's.

    Attributes:
        usual: the corpus's median duration for this displacement, seconds.
        least: shortest time in which no body part need exceed the 99th percentile of its speed in the corpus, seconds.
        slowest: the body part that determines `least`: a joint, "turning" or "travel".
        usual_moves: number of moves of the corpus's usual length in the given duration, if too few to reach B, so that
            the tween makes more; else None.
        faster: up to three body parts that exceed their greatest speed in the corpus by a fifth, worst first.
        creeps: share of the time in which the body is slower than in all but the slowest hundredth of the corpus's
            seconds.
        detours: whether movement that the corpus shows after postures like A and before ones like B fills spare time.
    """

    usual: float
    least: float
    slowest: str
    usual_moves: int | None
    faster: list[FasterPart]
    creeps: float
    detours: bool


def tempo_of(
    learned: LearnedCorpus, times: Sequence[UsualTime], usual_moves: int | None, detours: bool, motion: Motion
) -> Tempo:
    """Compare a motion's timing with the corpus's.

    Args:
        learned: the corpus.
        times: its usual time of each segment.
        usual_moves: as in `Tempo`.
        detours: as in `Tempo`.
        motion: the motion, on its joints.
    """
    faster: list[FasterPart] = []
    creeps = 0.0
    if len(motion) > 1:
        pace = learned.pace
        speeds = way_of(motion).parts / np.diff(motion.times)[:, None]
        beyond = speeds.max(axis=0) / pace.greatest
        names = _parts(learned)
        worst = [k for k in np.argsort(-beyond, kind="stable")[:3] if beyond[k] > 1.2]
        faster = [FasterPart(names[k], float(beyond[k])) for k in worst]
        seconds = over_seconds(speeds[:, : len(motion.skeleton)].mean(axis=1), max(motion.fps, 1.0))
        creeps = float(np.mean(seconds < pace.slowest[0]))
    longest = max(times, key=lambda time: time.least)
    total = sum(time.median for time in times), sum(time.least for time in times)
    return Tempo(*total, longest.slowest, usual_moves, faster, creeps, detours)


def worded(faster: Sequence[FasterPart]) -> str:
    """Describe body parts that are faster than ever: "left_knee 2.1 times, travel 1.4 times"."""
    return ", ".join(f"{displayed(one.part)} {one.times:.1f} times" for one in faster)


def _parts(learned: LearnedCorpus) -> tuple[str, ...]:
    """Return the names of the components of a displacement."""
    return (*learned.corpus.skeleton.names, "turning", "travel")


def tolls(learned: LearnedCorpus, times: Sequence[UsualTime], longest: int) -> Floats:
    """Return the toll of each number of moves for each segment, nats [K, longest + 1].

    Args:
        learned: the corpus.
        times: the usual time of each segment [K].
        longest: greatest number of moves.
    """
    seconds = np.maximum(np.arange(longest + 1), 1) * usual(learned.grammar.transitions)
    out = np.empty((len(times), longest + 1))
    for row, time in zip(out, times, strict=True):
        off = np.log(seconds / time.median) / learned.pace.spread
        hurries = np.maximum(time.least / seconds - 1.0, 0.0)
        row[:] = 0.5 * 10.0 * len(learned.space) * off**2 + 1e4 * hurries
    return out
