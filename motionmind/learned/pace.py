"""Pace: durations of a corpus's movements by displacement, and limits on speed.

A displacement leads from one posture to another (`Way`): each joint turns, the body turns about the vertical, and the
root travels. These parts affect the duration differently in each corpus, so they are first converted to one unit,
seconds at the corpus's usual speeds. As a body turns while it travels, the displacement is

    s = mean joint angle + hypot(travel, half the body's turn).

The same displacement takes less time amid quick movement than from rest to rest. Between movements a body slows down,
but seldom stands still. The resting speed r of a frame is the mean joint speed in the resting frames before
and after it, divided by the usual speed. The logarithm of a movement's duration is normal about

    level + slope log(DURATION_OFFSET_S + s) + pull log(RESTING_OFFSET_RATIO + r),

with the geometric mean of the resting speeds at both ends. A longer displacement never takes less time, and durations
grow at most as the square root: steeper slopes did not generalise.

The law is fitted by least squares to *windows*: all pairs of resting frames of a clip that are 0.3 to 5 s apart. A
corpus of one clip may have three windows, or none, so the fit has a prior worth PRIOR_COUNT windows, from the recorded
corpora together (experiments/duration). A posture outside the corpus takes the resting speed of the corpus's most
similar postures.

The fastest speeds are 99th percentiles over the corpus's frames at 30 per second, joint by joint. Parts that hardly
move in the corpus may still move: the limit of a joint is at least a quarter of the median joint's, or everyday
movement if the median joint rests. The limits of the body's turn and travel are at least everyday movement. The *peaks*
(`motionmind.learned.peaks`) are limits for windows of 1 to 6 s, including the root's acceleration. They are never below
the fastest speeds, or everyday movement.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, Ints, Singles
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.clip import Clip
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.kept import Kept
from motionmind.executors.workshop import Workshop
from motionmind.geometry import rotations as rot
from motionmind.learned.gauge import Gauge, join_gauges
from motionmind.learned.peaks import PEAK_PERCENTILE, PEAK_WINDOWS_S, Peaks, accelerations
from motionmind.learned.percentiles import Percentile
from motionmind.learned.sampled import BLOCK_FRAMES, SAMPLED_FPS, Sampled

SHORTEST_WINDOW_S, LONGEST_WINDOW_S = 0.3, 5.0  # between the resting frames of a window
SPEED_SMOOTHING_S = 0.5  # to find resting frames
DURATION_OFFSET_S = 0.3  # at usual speeds: starting and stopping take time
RESTING_OFFSET_RATIO = 0.05  # to the usual speed: every recording has noise
# Logarithms of seconds; fitted to cmu-05, indian, cmu-16 and cmu-135 together.
PRIOR_LEVEL, PRIOR_SLOPE, PRIOR_PULL, PRIOR_SPREAD = 0.0, 0.5, -0.35, 0.6
SLOPE_RANGE = 0.15, 0.5  # a longer displacement takes longer, at a higher speed
PULL_RANGE = -0.5, 0.0  # movement that is quick at its ends takes no longer
N_NEIGHBORS = 5  # similar postures of the corpus that give a posture's resting speed
PRIOR_COUNT = 20.0  # weight of the prior, in windows
MIN_USUAL_SPEEDS = 0.3, 0.2, 0.1  # mean joint, rad/s; turn, rad/s; travel, heights/s
MIN_PEAK_MEDIAN_RATIO = 0.25  # of a joint's fastest speed to the median joint's
MIN_PEAK_SPEEDS = 3.0, 2.0, 0.5  # a joint if most joints rest, rad/s; turn, rad/s; travel, heights/s
MIN_PEAK_ROOT_ACCELERATION = 3.0  # heights/s^2: recorded dancers exceed it in 3 of 4 seconds


class Way(NamedTuple):
    """Displacements from some postures to others.

    Attributes:
        joints: rotation angles of the joints [..., J], radians; the root's excludes the body's turn.
        turn: angle of the body's turn about the vertical [...], radians.
        travel: horizontal distance that the root travels [...], in body heights.
    """

    joints: Floats
    turn: Floats
    travel: Floats

    @property
    def parts(self) -> Floats:
        """All parts concatenated [..., J + 2]."""
        return np.concatenate([self.joints, self.turn[..., None], self.travel[..., None]], axis=-1)


def ways(skeleton: Skeleton, rotations: tuple[Floats, Floats], roots: tuple[Floats, Floats]) -> Way:
    """Return displacements between postures with local rotations [..., J, 4] and root positions [..., 3], metres."""
    first, last = (_faced(those[..., 0, :]) for those in rotations)
    return _way(skeleton, rot.angle(*rotations), first, last, roots[1] - roots[0])


def _faced(root: Floats) -> tuple[Floats, Floats]:
    """Split root orientations [..., 4] into headings [...], radians, and tilts [..., 4]."""
    headings = rot.heading(root)
    return headings, rot.mul(rot.about_vertical(-headings), root)


def _way(
    skeleton: Skeleton, joints: Floats, first: tuple[Floats, Floats], last: tuple[Floats, Floats], moved: Floats
) -> Way:
    """Return displacements, given the joints' angles [..., J], radians, the heading and tilt before and after
    (`_faced`), and the root's movement [..., 3], metres."""
    (faced, tilted), (faces, tilts) = first, last
    joints[..., 0] = rot.angle(tilted, tilts)
    turn = np.abs(np.angle(np.exp(1j * (faces - faced))))
    height = skeleton.height if skeleton.height > 0.0 else 1.0
    return Way(joints, np.asarray(turn), np.hypot(moved[..., 0], moved[..., 2]) / height)


def way_between(a: Posture, b: Posture) -> Way:
    """Return the displacement from one posture to another on the same body."""
    return ways(a.skeleton, (a.rotations, b.rotations), (a.root, b.root))


def way_of(motion: Motion) -> Way:
    """Return the displacements from each frame of a motion to the next [T - 1]."""
    joints, (faces, tilts) = rot.angle(motion.rotations[:-1], motion.rotations[1:]), _faced(motion.rotations[:, 0])
    moved = np.diff(motion.root, axis=0)
    return _way(motion.skeleton, joints, (faces[:-1], tilts[:-1]), (faces[1:], tilts[1:]), moved)


@dataclass(frozen=True, eq=False)
class Pace:
    """The pace of a corpus of J joints.

    Attributes:
        usual: usual mean joint speed and turning rate of the body, rad/s, and travel speed, heights/s [3].
        fastest: fastest speeds of the joints, rad/s, of the body's turn, rad/s, and of its travel, heights/s [J + 2].
        greatest: greatest speeds of the same parts in any frame [J + 2].
        slowest: 1st percentile of the mean joint speed over a second, rad/s [1].
        peaks: 99th percentiles, over windows of each of PEAK_WINDOWS_S, of the greatest speeds of the same parts and of
            the root's rise or fall, heights/s, and of the root's acceleration, heights/s^2 [6, J + 4].
        resting_speeds: resting speeds of the corpus's N postures, in usual mean joint speeds [N].
        law: level, slope, pull and spread of the logarithm of durations [4].
    """

    usual: Floats
    fastest: Floats
    greatest: Floats
    slowest: Floats
    peaks: Floats
    resting_speeds: Floats
    law: Floats

    @property
    def spread(self) -> float:
        """Standard deviation of the logarithm of a movement's duration, given its displacement."""
        return float(self.law[3])

    def expected(self, way: Way, resting_speeds: tuple[Floats, Floats]) -> Floats:
        """Return the median duration, seconds, of movements with given displacements and resting speeds [...]."""
        level, slope, pull, _ = self.law
        return np.asarray(np.exp(level + slope * _effort(way, self.usual) + pull * _quickness(*resting_speeds)))

    def peaks_in(self, seconds: float, pace: float = 1.0) -> Floats:
        """Return the peaks in windows of a duration [J + 4], for movement at a multiple of the corpus's pace."""
        peaks = pace * np.array([np.interp(pace * seconds, PEAK_WINDOWS_S, part) for part in self.peaks.T])
        peaks[-1] *= pace  # accelerations scale with its square
        return peaks

    def resting_speeds_of(self, postures: Floats, shown: Floats) -> Floats:
        """Return the resting speeds of postures [n]: means over the corpus's most similar postures.

        Args:
            postures: orientations of their joints [n, J, 4], from `motionmind.corpus.corpus.Corpus.to_chains`.
            shown: orientations of the corpus's postures [N, J, 4].
        """
        # Similarity is the sum of squared cosines of half the angles. Ties, up to rounding, go by index on any machine.
        alike = (np.sum(np.einsum("njc,jc->nj", shown, one) ** 2, axis=1) for one in postures)
        order = (np.argsort(-np.round(one, 9), kind="stable") for one in alike)
        return np.array([self.resting_speed_of(near[:N_NEIGHBORS]) for near in order])

    def resting_speed_of(self, numbers: Ints) -> float:
        """Return the mean resting speed of some of the corpus's postures, given by index [n]."""
        return float(np.exp(np.log(RESTING_OFFSET_RATIO + self.resting_speeds[numbers]).mean()) - RESTING_OFFSET_RATIO)


def measure_pace(kept: Kept, before: Gauge | None = None, workshop: Workshop | None = None) -> Gauge:
    """Measure the pace of a corpus's clips.

    Args:
        kept: the corpus, and which of its clips are new: only these are measured.
        before: gauge of the earlier corpus; None if there is none.
        workshop: room for large arrays; None for memory.
    """
    workshop = workshop or Workshop()
    if before is None:
        return _measure(kept.corpus, workshop)
    return join_gauges(kept, before, _measure(kept.new, workshop) if kept.new else None, workshop)


def _measure(corpus: Corpus, workshop: Workshop) -> Gauge:
    """Measure the pace of all clips."""
    piles, counts = [workshop.pile() for _ in range(3)], [[0, 0, 0]]
    for clip in corpus.clips:
        shown: tuple[NDArray[Any], ...] = _show(corpus, clip)
        counts.append([len(rows) for rows in shown])
        for pile, rows in zip(piles, shown, strict=True):
            pile.add(rows)
    return Gauge(np.cumsum(counts, axis=0), *(pile.array() for pile in piles))


def _show(corpus: Corpus, clip: Clip) -> tuple[Singles, Floats, Floats]:
    """Return a clip's steps, resting frames and windows, as in Gauge; all are empty for a single frame."""
    recording = Sampled(corpus, clip, SAMPLED_FPS)
    if len(recording) < 2:
        return np.zeros((0, len(corpus.skeleton) + 6), np.float32), np.zeros((0, 2)), np.zeros((0, 6))
    blocks = [
        np.column_stack([steps_of(block), moved_in(block)]) for block in recording.blocks(BLOCK_FRAMES, overlap=1)
    ]
    steps = np.concatenate(blocks)
    still, speeds = _resting_frames(steps[:, : len(corpus.skeleton)].mean(axis=1))
    stills = np.column_stack([recording.times[still], speeds])
    return steps.astype(np.float32), stills, _windows(recording, still, speeds)


def refit_pace(corpus: Corpus, gauge: Gauge) -> Pace:
    """Compute the pace of a corpus from the gauge of its clips."""
    joints = len(corpus.skeleton)
    counts = np.diff(gauge.starts[:, 0])
    shown = [(number, clip) for number, clip in enumerate(corpus.clips) if counts[number]]
    stretches = [_danced(Sampled(corpus, clip, SAMPLED_FPS)) for _, clip in shown]
    lengths = np.array([stop - start for some in stretches for start, stop in some], dtype=np.int64)
    moving = counts[counts > 0]
    rare = Percentile(PEAK_PERCENTILE, int(counts.sum()))
    seconds = Percentile(100.0 - PEAK_PERCENTILE, int((moving - np.minimum(moving, round(SAMPLED_FPS)) + 1).sum()))
    peaks = Peaks(lengths)
    total, most = np.zeros((0, 3)), np.zeros(joints + 4)
    for (number, _), some in zip(shown, stretches, strict=True):
        steps = gauge.steps[gauge.starts[number, 0] : gauge.starts[number + 1, 0]].astype(np.float64)
        speeds, moved = SAMPLED_FPS * steps[:, :-3], steps[:, -3:]
        # Summed in row order, so that the split into clips does not affect rounding.
        total = np.concatenate([total, _usual_parts(speeds, joints)]).sum(axis=0, keepdims=True)
        most = np.maximum(most, np.append(speeds.max(axis=0), accelerations(moved, SAMPLED_FPS).max(initial=0.0)))
        rare.add(speeds[:, :-1])
        seconds.add(over_seconds(SAMPLED_FPS * steps[:, :joints].mean(axis=1), SAMPLED_FPS)[:, None])
        for start, stop in some:
            peaks.add(speeds[start:stop], moved[start:stop])
    usual, fastest = (
        np.array(MIN_USUAL_SPEEDS),
        np.concatenate([np.full(joints, MIN_PEAK_SPEEDS[0]), MIN_PEAK_SPEEDS[1:]]),
    )
    greatest, slowest = np.append(fastest, [MIN_PEAK_SPEEDS[2], MIN_PEAK_ROOT_ACCELERATION]), np.zeros(1)
    if shown:
        usual = np.maximum(total[0] / counts.sum(), usual)
        of_joints = rare.value()
        median = float(np.median(of_joints[:joints]))
        least = (
            MIN_PEAK_MEDIAN_RATIO * median if median > MIN_USUAL_SPEEDS[0] else MIN_PEAK_SPEEDS[0]
        )  # speeds at rest are noise
        fastest = np.maximum(of_joints, [*[least] * joints, *MIN_PEAK_SPEEDS[1:]])
        greatest = np.maximum(most, np.append(fastest, [MIN_PEAK_SPEEDS[2], MIN_PEAK_ROOT_ACCELERATION]))
        slowest = seconds.value()
    resting_speeds = np.ones(len(corpus))
    for number, clip in shown:
        here = slice(clip.start, clip.stop)
        times, speed = gauge.stills[gauge.starts[number, 1] : gauge.starts[number + 1, 1]].T
        resting_speeds[here] = np.interp(corpus.times[here], times, speed / usual[0])
    peak = peaks.values(greatest, np.append(fastest, [MIN_PEAK_SPEEDS[2], MIN_PEAK_ROOT_ACCELERATION]))
    return Pace(usual, fastest, greatest[:-2], slowest, peak, resting_speeds, _fit_windows(gauge.windows, usual))


def _usual_parts(speeds: Floats, joints: int) -> Floats:
    """Reduce the speeds of all parts to mean joint speed, turning rate and travel speed [T, 3]."""
    return np.column_stack([speeds[:, :joints].mean(axis=1), speeds[:, joints], speeds[:, joints + 1]])


def steps_of(motion: Motion) -> Floats:
    """Return the parts of each frame's displacement to the next, and the root's rise or fall [T - 1, J + 3]."""
    height = motion.skeleton.height if motion.skeleton.height > 0.0 else 1.0
    return np.column_stack([way_of(motion).parts, np.abs(np.diff(motion.root[:, 1])) / height])


def moved_in(motion: Motion) -> Floats:
    """Return the root's displacements from each frame to the next [T - 1, 3], body heights."""
    height = motion.skeleton.height if motion.skeleton.height > 0.0 else 1.0
    return np.diff(motion.root, axis=0) / height


def _danced(clip: Sampled) -> Ints:
    """Return the stretches of a clip's steps without reconstructed movement, as ranges of steps [n, 2]."""
    known = np.zeros(len(clip) + 1, dtype=np.bool_)
    known[1:-1] = clip.danced(clip.times)
    return np.flatnonzero(np.diff(known)).reshape(-1, 2)


def over_seconds(speeds: Floats, fps: float) -> Floats:
    """Return the means of speeds [T] over each window of a second; over all T if they are fewer."""
    return np.asarray(np.lib.stride_tricks.sliding_window_view(speeds, min(round(fps), len(speeds))).mean(axis=1))


def _effort(way: Way, usual: Floats) -> Floats:
    """Return log(DURATION_OFFSET_S + s) for displacements s in seconds at usual speeds [...]."""
    joints, turn, travel = way.joints.mean(axis=-1) / usual[0], way.turn / usual[1], way.travel / usual[2]
    return np.asarray(np.log(DURATION_OFFSET_S + joints + np.hypot(travel, 0.5 * turn)))


def _quickness(first: Floats, last: Floats) -> Floats:
    """Return the mean of log(RESTING_OFFSET_RATIO + r) over the resting speeds r at both ends [...]."""
    return np.asarray(0.5 * (np.log(RESTING_OFFSET_RATIO + first) + np.log(RESTING_OFFSET_RATIO + last)))


def _windows(clip: Sampled, still: Ints, speeds: Floats) -> Floats:
    """Return the windows between a clip's resting frames, as in Gauge [W, 6].

    No window spans reconstructed movement, which nobody danced.

    Args:
        clip: the clip, at SAMPLED_FPS frames a second.
        still: its resting frames, in order [S].
        speeds: mean joint speed in them [S], rad/s.
    """
    rotations, root = clip.take(still)
    stops = np.searchsorted(still, still + LONGEST_WINDOW_S * SAMPLED_FPS, side="right")
    for repair in clip.clip.repairs:
        if not repair.exact:
            first, last = np.searchsorted(clip.times[still], repair.seconds)
            stops[:last] = np.minimum(stops[:last], np.maximum(first, np.arange(last)))
    pairs = [
        (i, k)
        for i, stop in enumerate(stops)
        for k in range(i + 1, stop)
        if SHORTEST_WINDOW_S <= (still[k] - still[i]) / SAMPLED_FPS <= LONGEST_WINDOW_S
    ]
    begins, ends = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    out = np.empty((len(pairs), 6))
    for start in range(0, len(pairs), BLOCK_FRAMES):
        part = slice(start, start + BLOCK_FRAMES)
        found = ways(clip.skeleton, *((of[begins[part]], of[ends[part]]) for of in (rotations, root)))
        out[part, :3] = np.column_stack([found.joints.mean(axis=-1), found.turn, found.travel])
    out[:, 3], out[:, 4], out[:, 5] = speeds[begins], speeds[ends], (still[ends] - still[begins]) / SAMPLED_FPS
    return out


def _fit_windows(windows: Floats, usual: Floats) -> Floats:
    """Fit the law [4] to windows [W, 6] (see `Gauge`), given usual speeds (see `Pace`)."""
    joints, turn, travel, first, last, seconds = windows.T
    efforts = _effort(Way(joints[:, None], turn, travel), usual)
    return _fit(efforts, _quickness(first / usual[0], last / usual[0]), np.log(seconds))


def _resting_frames(steps: Floats) -> tuple[Ints, Floats]:
    """Return a clip's resting frames, in order [S], and the mean joint speed in them [S], rad/s.

    A clip without resting frames has its first frame, with its mean speed.

    Args:
        steps: mean joint angle from each frame to the next [T - 1], radians, at SAMPLED_FPS frames a second.
    """
    still = find_still(steps)
    if not len(still):
        return np.zeros(1, dtype=np.int64), SAMPLED_FPS * steps.mean(keepdims=True)
    return still, SAMPLED_FPS * _smooth(steps)[still]


def find_still(steps: Floats) -> Ints:
    """Return the resting frames: local minima of the smoothed mean joint speed.

    Args:
        steps: mean joint angle from each frame to the next [T - 1], radians, at SAMPLED_FPS frames a second.
    """
    # Keyframed joints turn evenly, at speeds equal up to rounding. A flat minimum yields one frame, its middle. SciPy's
    # `find_peaks` finds the same in negated speeds, but its import takes longer than learning a few clips.
    speeds = np.round(_smooth(steps), 9)
    starts = np.flatnonzero(np.diff(speeds, prepend=np.inf))
    ends = np.append(starts[1:], len(speeds)) - 1
    sinks_and_rises = np.diff(np.sign(np.diff(speeds[starts]))) > 0.0
    return np.asarray((starts + ends)[1:-1][sinks_and_rises] // 2, dtype=np.int64)


def _smooth(steps: Floats) -> Floats:
    """Smooth steps [T - 1] over SPEED_SMOOTHING_S about each frame; empty for a shorter clip."""
    window = np.hanning(round(SPEED_SMOOTHING_S * SAMPLED_FPS) + 2)[1:-1]
    if len(steps) < len(window):
        return np.zeros(0)
    return np.convolve(np.pad(steps, len(window) // 2, mode="edge"), window / window.sum(), "valid")


def _fit(efforts: Floats, quickness: Floats, logs: Floats) -> Floats:
    """Fit level, slope, pull and spread [4] to the logarithms of durations [n].

    Args:
        efforts: logarithms of displacements in seconds at usual speeds [n].
        quickness: mean logarithms of the resting speeds at both ends [n].
        logs: logarithms of the durations [n].
    """
    given = np.stack([efforts, quickness], axis=1)
    mean = given.mean(axis=0) if len(given) else np.zeros(2)
    prior = np.array([PRIOR_SLOPE, PRIOR_PULL])
    middle = (logs.sum() + PRIOR_COUNT * (PRIOR_LEVEL + prior @ mean)) / (
        len(logs) + PRIOR_COUNT
    )  # of the logs at the mean
    off = given - mean
    # The prior acts as PRIOR_COUNT windows on its plane, with a standard deviation of 1 in both regressors.
    products, sums = off.T @ off + PRIOR_COUNT * np.eye(2), off.T @ logs + PRIOR_COUNT * prior
    pull = float(np.clip(np.linalg.solve(products, sums)[1], *PULL_RANGE))
    slope = float(np.clip((sums[0] - products[0, 1] * pull) / products[0, 0], *SLOPE_RANGE))
    left = logs - middle - off @ [slope, pull]
    spread = np.sqrt((left @ left + PRIOR_COUNT * PRIOR_SPREAD**2) / (len(logs) + PRIOR_COUNT))
    return np.array([middle - slope * mean[0] - pull * mean[1], slope, pull, spread])
