"""Pace: how long a corpus's bodies take for how far a way, and how fast they move at most.

A *way* leads from one posture to another: each joint turns, the body turns about the vertical, and the root travels.
How long dancers take for it says little of the joints and much of the travel, in each corpus differently; so all parts
of the way are brought to one unit first, the seconds that they take at the corpus's usual speeds:

    s = turning of the mean joint + hypot(travel, half the body's turn)

for a body turns as it travels. The logarithm of a movement's duration is normal about

    level + slope log(BEGINS + s),

so a longer way never takes less. It is learned from all pairs of still moments of a clip that are 0.3 to 5 s apart:
between those somebody went from one posture to another and had arrived. Least squares, with a prior worth AS_MANY
windows, for a corpus of one clip may have three of them, or none: LEVEL, SLOPE and SPREAD are those of the recorded
corpora together (experiments/duration).

The fastest speeds are 99th percentiles of the corpus's frames at 30 a second, joint by joint. What hardly moves in the
corpus is not forbidden to move: no joint counts as slower than a quarter of the median joint, and neither the body's
turning nor its travel as slower than everyday movement.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.corpus import Corpus
from motionmind.geometry import rotations as rot
from motionmind.learned.sampled import BLOCK, Sampled

SHORTEST, LONGEST = 0.3, 5.0  # seconds between the still moments of a window
SMOOTHED = 0.5  # seconds over which speeds are averaged to find still moments
BEGINS = 0.3  # seconds at usual speeds that no way is shorter than, in effect: to begin and to end takes time
LEVEL, SLOPE, SPREAD = 0.4, 0.4, 0.6  # logarithms of seconds; of cmu-05, indian, cmu-16 and cmu-135 together
SLOPES = 0.15, 1.0  # the least and the greatest slope: a longer way takes longer, and never more than in proportion
AS_MANY = 20.0  # windows that the prior is worth
RARE = 99.0  # percentile of the frames' speeds that counts as fastest
FPS = 30.0
SLOWEST_USUAL = 0.3, 0.2, 0.1  # rad/s of the mean joint, rad/s of turning, heights/s of travel: no usual speed is less
OF_MEDIAN = 0.25  # of the median joint's fastest speed: no joint's is less
EVERYDAY = 3.0, 2.0, 0.5  # rad/s of a joint where none moves; the least of turning, rad/s, and of travel, heights/s


class Way(NamedTuple):
    """The ways from some postures to others.

    Attributes:
        joints: angles that the joints turn by [..., J], radians; the root's without the body's turning.
        turn: angle that the body turns by about the vertical [...], radians.
        travel: level distance that the root travels [...], in heights of the body.
    """

    joints: Floats
    turn: Floats
    travel: Floats

    @property
    def parts(self) -> Floats:
        """All of them, side by side [..., J + 2]."""
        return np.concatenate([self.joints, self.turn[..., None], self.travel[..., None]], axis=-1)


def ways(skeleton: Skeleton, rotations: tuple[Floats, Floats], roots: tuple[Floats, Floats]) -> Way:
    """Return the ways from postures to others, of local rotations [..., J, 4] and root positions [..., 3], metres."""
    headings = [rot.heading(those[..., 0, :]) for those in rotations]
    joints = rot.angle(*rotations)
    tilts = (rot.mul(rot.about_vertical(-h), those[..., 0, :]) for h, those in zip(headings, rotations, strict=True))
    joints[..., 0] = rot.angle(*tilts)
    turn = np.abs(np.angle(np.exp(1j * (headings[1] - headings[0]))))
    moved = roots[1] - roots[0]
    height = skeleton.height if skeleton.height > 0.0 else 1.0
    return Way(joints, np.asarray(turn), np.hypot(moved[..., 0], moved[..., 2]) / height)


def way_between(a: Posture, b: Posture) -> Way:
    """Return the way from one posture to another on the same body."""
    return ways(a.skeleton, (a.rotations, b.rotations), (a.root, b.root))


def way_of(motion: Motion) -> Way:
    """Return the ways from each frame of a motion to the next [T - 1]."""
    rotations, root = motion.rotations, motion.root
    return ways(motion.skeleton, (rotations[:-1], rotations[1:]), (root[:-1], root[1:]))


@dataclass(frozen=True, eq=False)
class Pace:
    """The pace of a corpus of J joints.

    Attributes:
        usual: usual speeds of the mean joint and of the body's turning, rad/s, and of its travel, heights/s [3].
        fastest: fastest speeds of the joints, rad/s, of the body's turning and of its travel [J + 2].
        greatest: greatest speeds of the same in any frame [J + 2].
        slowest: the speed of the mean joint over a second, rad/s, that only a hundredth of all seconds is below [1].
        law: level, slope and spread of the logarithm of durations [3].
    """

    usual: Floats
    fastest: Floats
    greatest: Floats
    slowest: Floats
    law: Floats

    @property
    def spread(self) -> float:
        """Standard deviation of the logarithm of a movement's duration, given its way."""
        return float(self.law[2])

    def expected(self, way: Way) -> Floats:
        """Return the median duration of movements of such ways [...], seconds."""
        level, slope, _ = self.law
        return np.asarray(np.exp(level + slope * _effort(way, self.usual)))


def learn_pace(corpus: Corpus) -> Pace:
    """Learn the pace of a corpus."""
    recordings = [Sampled(corpus, clip, FPS) for clip in corpus.clips if len(clip) > 1]
    clips = [recording for recording in recordings if len(recording) > 1]
    steps = [np.concatenate([way_of(block).parts for block in clip.blocks(BLOCK, overlap=1)]) for clip in clips]
    joints = len(corpus.skeleton)
    usual, fastest = np.array(SLOWEST_USUAL), np.concatenate([np.full(joints, EVERYDAY[0]), EVERYDAY[1:]])
    greatest, slowest = fastest, np.zeros(1)
    if steps:
        speeds = np.concatenate(steps)
        speeds *= FPS
        each = np.stack([speeds[:, :joints].mean(axis=1), speeds[:, joints], speeds[:, joints + 1]], axis=1)
        usual = np.maximum(each.mean(axis=0), usual)
        rare = np.percentile(speeds, RARE, axis=0)
        median = float(np.median(rare[:joints]))
        least = OF_MEDIAN * median if median > 0.0 else EVERYDAY[0]
        fastest = np.maximum(rare, [*[least] * joints, *EVERYDAY[1:]])
        greatest = np.maximum(speeds.max(axis=0), fastest)
        seconds = [over_seconds(FPS * step[:, :joints].mean(axis=1), FPS) for step in steps]
        slowest = np.percentile(np.concatenate(seconds), [100.0 - RARE])
    windows = [_windows(clip, step[:, :joints].mean(axis=1)) for clip, step in zip(clips, steps, strict=True)]
    efforts = np.concatenate([np.zeros(0), *(_effort(way, usual) for way, _ in windows)])
    logs = np.concatenate([np.zeros(0), *(np.log(seconds) for _, seconds in windows)])
    return Pace(usual, fastest, greatest, slowest, _fit(efforts, logs))


def over_seconds(speeds: Floats, fps: float) -> Floats:
    """Return the means of speeds [T] over every second of them, or over all of them if they are fewer."""
    return np.asarray(np.lib.stride_tricks.sliding_window_view(speeds, min(round(fps), len(speeds))).mean(axis=1))


def _effort(way: Way, usual: Floats) -> Floats:
    """Return the logarithm of the seconds that ways take at usual speeds [...]."""
    joints, turn, travel = way.joints.mean(axis=-1) / usual[0], way.turn / usual[1], way.travel / usual[2]
    return np.asarray(np.log(BEGINS + joints + np.hypot(travel, 0.5 * turn)))


def _windows(clip: Sampled, steps: Floats) -> tuple[Way, Floats]:
    """Return the ways and durations between a clip's still moments, of each two that are as far apart as a window.

    Args:
        clip: at FPS frames a second.
        steps: angle that the mean joint turns by from each frame to the next [T - 1].
    """
    still = find_still(steps)
    rotations, root = clip.take(still)
    stops = np.searchsorted(still, still + LONGEST * FPS, side="right")
    pairs = [
        (i, k)
        for i, stop in enumerate(stops)
        for k in range(i + 1, stop)
        if SHORTEST <= (still[k] - still[i]) / FPS <= LONGEST
    ]
    begins, ends = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    parts = [slice(start, start + BLOCK) for start in range(0, max(len(pairs), 1), BLOCK)]
    found = [
        ways(clip.skeleton, (rotations[begins[part]], rotations[ends[part]]), (root[begins[part]], root[ends[part]]))
        for part in parts
    ]
    return Way(*map(np.concatenate, zip(*found, strict=True))), (still[ends] - still[begins]) / FPS


def find_still(steps: Floats) -> Ints:
    """Return the frames in which a body is stiller than before and after: minima of its speed, smoothed.

    Args:
        steps: angle that the mean joint turns by from each frame to the next [T - 1], at FPS frames a second.
    """
    window = np.hanning(round(SMOOTHED * FPS) + 2)[1:-1]
    if len(steps) < len(window):
        return np.zeros(0, dtype=np.int64)
    speed = np.convolve(np.pad(steps, len(window) // 2, mode="edge"), window / window.sum(), "valid")
    falls, rises = speed[1:-1] < speed[:-2], speed[1:-1] <= speed[2:]
    return np.flatnonzero(falls & rises) + 1


def _fit(efforts: Floats, logs: Floats) -> Floats:
    """Return level, slope and spread [3] of the logarithms of durations [n], given those of the ways' seconds [n]."""
    mean = efforts.mean() if len(efforts) else 0.0
    middle = (logs.sum() + AS_MANY * (LEVEL + SLOPE * mean)) / (len(logs) + AS_MANY)  # of the logs at the mean effort
    off = efforts - mean
    # As if AS_MANY windows lay along the prior's line, a standard deviation of the logs of 1 apart.
    slope = float(np.clip((off @ logs + AS_MANY * SLOPE) / (off @ off + AS_MANY), *SLOPES))
    left = logs - middle - slope * off
    spread = np.sqrt((left @ left + AS_MANY * SPREAD**2) / (len(logs) + AS_MANY))
    return np.array([middle - slope * mean, slope, spread])
