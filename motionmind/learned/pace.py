"""Pace: how long a corpus's bodies take for how far a way, and how fast they move at most.

A *way* leads from one posture to another: each joint turns, the body turns about the vertical, and the root travels.
How long dancers take for it says little of the joints and much of the travel, in each corpus differently; so all parts
of the way are brought to one unit first, the seconds that they take at the corpus's usual speeds:

    s = turning of the mean joint + hypot(travel, half the body's turn)

for a body turns as it travels. And the same way is gone in less time in the midst of quick movement than from rest to
rest. Between movements a body comes to a lull, but seldom stands still; the *lull* of a moment is the speed of the mean
joint in the still moments before and after it, over its usual speed. The logarithm of a movement's duration is normal
about

    level + slope log(BEGINS + s) + pull log(STILL + lull),

the lulls of both ends in the geometric mean. A longer way never takes less, and is gone the faster: durations grow by
the square root at most, for what windows show beyond that holds for no others. It is learned from all pairs of still
moments of a clip that are 0.3 to 5 s apart: between those somebody went from one posture to another and had arrived.
Least squares, with a prior worth AS_MANY windows, for a corpus of one clip may have three of them, or none: LEVEL,
SLOPE, PULL and SPREAD are those of the recorded corpora together (experiments/duration). Of a posture on its own nobody
knows the lull: it is that of the corpus's postures most like it.

The fastest speeds are 99th percentiles of the corpus's frames at 30 a second, joint by joint. What hardly moves in the
corpus is not forbidden to move: no joint counts as slower than a quarter of the median joint, and neither the body's
turning nor its travel as slower than everyday movement. A movement of many seconds that is nowhere faster than that may
still show more than any of the corpus that is as long, for quick clips are short: so the *peaks* are what the greatest
speeds of all windows of 1 to 6 s, but a hundredth, keep to; none is less than the fastest speeds, or everyday movement.
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
STILL = 0.05  # usual speeds that no lull is slower than, in effect: no recording is without noise
# Logarithms of seconds; of cmu-05, indian, cmu-16 and cmu-135 together.
LEVEL, SLOPE, PULL, SPREAD = 0.0, 0.5, -0.35, 0.6
SLOPES = 0.15, 0.5  # the least and the greatest slope: a longer way takes longer, and is gone the faster
PULLS = -0.5, 0.0  # of the pull, in the same way: who is in quick movement takes no longer
ALIKE = 5  # of the corpus's postures, whose lulls say that of a posture
AS_MANY = 20.0  # windows that the prior is worth
RARE = 99.0  # percentile of the frames' speeds that counts as fastest
FPS = 30.0
SLOWEST_USUAL = 0.3, 0.2, 0.1  # rad/s of the mean joint, rad/s of turning, heights/s of travel: no usual speed is less
OF_MEDIAN = 0.25  # of the median joint's fastest speed: no joint's is less
EVERYDAY = 3.0, 2.0, 0.5  # rad/s of a joint where none moves; the least of turning, rad/s, and of travel, heights/s
LENGTHS = 1.0, 2.0, 3.0, 4.0, 5.0, 6.0  # seconds of the windows whose peaks are known
STRIDE = 6  # frames from window to window
FEW = 10  # windows; where there are fewer, peaks are those of shorter ones
_NO_WINDOWS = (np.zeros(0),) * 3


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
        peaks: greatest speeds of the same, and of the root's rise or fall, heights/s, in all windows of each of LENGTHS
            but a hundredth [6, J + 3].
        lulls: of the corpus's N postures, usual speeds of the mean joint [N].
        law: level, slope, pull and spread of the logarithm of durations [4].
    """

    usual: Floats
    fastest: Floats
    greatest: Floats
    slowest: Floats
    peaks: Floats
    lulls: Floats
    law: Floats

    @property
    def spread(self) -> float:
        """Standard deviation of the logarithm of a movement's duration, given its way."""
        return float(self.law[3])

    def expected(self, way: Way, lulls: tuple[Floats, Floats]) -> Floats:
        """Return the median duration of movements of such ways [...], seconds, between such lulls [...]."""
        level, slope, pull, _ = self.law
        return np.asarray(np.exp(level + slope * _effort(way, self.usual) + pull * _quickness(*lulls)))

    def peaks_in(self, seconds: float) -> Floats:
        """Return the peaks of windows so long [J + 3]."""
        return np.array([np.interp(seconds, LENGTHS, part) for part in self.peaks.T])

    def lulls_of(self, postures: Floats, shown: Floats) -> Floats:
        """Return the lulls of postures [n]: means of those of the corpus's postures that are most like each.

        Args:
            postures: orientations of their joints [n, J, 4], as `motionmind.corpus.corpus.Corpus.to_chains` gives them.
            shown: those of the corpus's postures, in the same way [N, J, 4].
        """
        # The sum of squared cosines of half the angles. What is equal but for rounding is taken by number, on any
        # machine.
        alike = (np.sum(np.einsum("njc,jc->nj", shown, one) ** 2, axis=1) for one in postures)
        order = (np.argsort(-np.round(one, 9), kind="stable") for one in alike)
        return np.array([self.lull_of(near[:ALIKE]) for near in order])

    def lull_of(self, numbers: Ints) -> float:
        """Return the mean lull of some of the corpus's postures, by number [n]."""
        return float(np.exp(np.log(STILL + self.lulls[numbers]).mean()) - STILL)


def learn_pace(corpus: Corpus) -> Pace:
    """Learn the pace of a corpus."""
    recordings = [Sampled(corpus, clip, FPS) for clip in corpus.clips if len(clip) > 1]
    clips = [recording for recording in recordings if len(recording) > 1]
    steps = [np.concatenate([steps_of(block) for block in clip.blocks(BLOCK, overlap=1)]) for clip in clips]
    joints = len(corpus.skeleton)
    usual, fastest = np.array(SLOWEST_USUAL), np.concatenate([np.full(joints, EVERYDAY[0]), EVERYDAY[1:]])
    greatest, slowest, rises = fastest, np.zeros(1), EVERYDAY[2]
    if steps:
        rises = max(FPS * max(float(step[:, -1].max()) for step in steps), rises)
        each = np.concatenate([_usual_parts(FPS * step, joints) for step in steps])
        usual = np.maximum(each.mean(axis=0), usual)
        # Part by part, for all at once are as large as the corpus.
        parts = ([FPS * step[:, part] for step in steps] for part in range(joints + 2))
        summed = [(np.percentile(speeds, RARE), speeds.max()) for speeds in map(np.concatenate, parts)]
        rare, most = np.array(summed, dtype=np.float64).T
        median = float(np.median(rare[:joints]))
        least = OF_MEDIAN * median if median > 0.0 else EVERYDAY[0]
        fastest = np.maximum(rare, [*[least] * joints, *EVERYDAY[1:]])
        greatest = np.maximum(most, fastest)
        seconds = [over_seconds(FPS * step[:, :joints].mean(axis=1), FPS) for step in steps]
        slowest = np.percentile(np.concatenate(seconds), [100.0 - RARE])
    lulls, windows = np.ones(len(corpus)), [_NO_WINDOWS]
    for clip, step in zip(clips, steps, strict=True):
        means = step[:, :joints].mean(axis=1)
        found = _lulls(means, usual[0])
        windows.append(_windows(clip, *found, usual))
        here = slice(clip.clip.start, clip.clip.stop)
        lulls[here] = np.interp(corpus.times[here], clip.times[found[0]], found[1])
    danced = [part for clip, step in zip(clips, steps, strict=True) for part in _danced(clip, step)]
    peaks = _peaks(danced, np.append(fastest, EVERYDAY[2]), np.append(greatest, rises))
    return Pace(usual, fastest, greatest, slowest, peaks, lulls, _fit(*map(np.concatenate, zip(*windows, strict=True))))


def _usual_parts(speeds: Floats, joints: int) -> Floats:
    """Return the speeds of the mean joint, of the body's turning and of its travel [T, 3], from those of all parts."""
    return np.column_stack([speeds[:, :joints].mean(axis=1), speeds[:, joints], speeds[:, joints + 1]])


def steps_of(motion: Motion) -> Floats:
    """Return all parts of the ways from each frame to the next, and how far the root rises or falls [T - 1, J + 3]."""
    height = motion.skeleton.height if motion.skeleton.height > 0.0 else 1.0
    return np.column_stack([way_of(motion).parts, np.abs(np.diff(motion.root[:, 1])) / height])


def _danced(clip: Sampled, steps: Floats) -> list[Floats]:
    """Return the stretches of a clip's steps [T - 1, ...] of which nothing was reconstructed."""
    known = np.ones(len(steps) + 2, dtype=np.bool_)
    known[[0, -1]] = False
    for repair in clip.clip.repairs:
        if not repair.exact:
            first, last = repair.seconds
            known[1:-1] &= (clip.times[1:] < first) | (clip.times[:-1] > last)
    edges = np.flatnonzero(np.diff(known))
    return [steps[start:stop] for start, stop in edges.reshape(-1, 2)]


def _peaks(steps: list[Floats], least: Floats, greatest: Floats) -> Floats:
    """Return the greatest speeds in all windows of each of LENGTHS but a hundredth [6, J + 3].

    Args:
        steps: of the clips, from each frame to the next [T - 1, J + 3].
        least: what no peak is less than [J + 3].
        greatest: peaks where there are no windows [J + 3].
    """
    # Each STRIDE frames are one, for the greatest is the same.
    parts = [FPS * np.maximum.reduceat(step, np.arange(0, len(step), STRIDE)) for step in steps]
    peaks = []
    for seconds in LENGTHS:
        size = round(seconds * FPS / STRIDE)
        windows = [
            np.lib.stride_tricks.sliding_window_view(p, size, axis=0).max(axis=-1) for p in parts if len(p) >= size
        ]
        if sum(map(len, windows)) >= FEW:
            greatest = np.maximum(np.percentile(np.concatenate(windows), RARE, axis=0), least)
        peaks.append(greatest)
    return np.stack(peaks)


def over_seconds(speeds: Floats, fps: float) -> Floats:
    """Return the means of speeds [T] over every second of them, or over all of them if they are fewer."""
    return np.asarray(np.lib.stride_tricks.sliding_window_view(speeds, min(round(fps), len(speeds))).mean(axis=1))


def _effort(way: Way, usual: Floats) -> Floats:
    """Return the logarithm of the seconds that ways take at usual speeds [...]."""
    joints, turn, travel = way.joints.mean(axis=-1) / usual[0], way.turn / usual[1], way.travel / usual[2]
    return np.asarray(np.log(BEGINS + joints + np.hypot(travel, 0.5 * turn)))


def _quickness(first: Floats, last: Floats) -> Floats:
    """Return the mean logarithm of the lulls [...] of the ends of ways [...]."""
    return np.asarray(0.5 * (np.log(STILL + first) + np.log(STILL + last)))


def _windows(clip: Sampled, still: Ints, lulls: Floats, usual: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the efforts, quickness and logarithms of the seconds [n] between a clip's still moments, of each two that
    are as far apart as a window.

    What was reconstructed in a recording nobody danced: no window leads over it.

    Args:
        clip: at FPS frames a second.
        still: its still moments, frames in order [S].
        lulls: of these [S], in usual speeds.
        usual: see `Pace`.
    """
    rotations, root = clip.take(still)
    stops = np.searchsorted(still, still + LONGEST * FPS, side="right")
    for repair in clip.clip.repairs:
        if not repair.exact:
            first, last = np.searchsorted(clip.times[still], repair.seconds)
            stops[:last] = np.minimum(stops[:last], np.maximum(first, np.arange(last)))
    pairs = [
        (i, k)
        for i, stop in enumerate(stops)
        for k in range(i + 1, stop)
        if SHORTEST <= (still[k] - still[i]) / FPS <= LONGEST
    ]
    begins, ends = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    efforts = [np.zeros(0)]
    for start in range(0, len(pairs), BLOCK):
        part = slice(start, start + BLOCK)
        places = ((of[begins[part]], of[ends[part]]) for of in (rotations, root))
        efforts.append(_effort(ways(clip.skeleton, *places), usual))
    seconds = (still[ends] - still[begins]) / FPS
    return np.concatenate(efforts), _quickness(lulls[begins], lulls[ends]), np.log(seconds)


def _lulls(steps: Floats, usual: float) -> tuple[Ints, Floats]:
    """Return a clip's still moments, frames in order [S], and their lulls [S]; the first frame, with the clip's mean
    speed, where there are none.

    Args:
        steps: angle that the mean joint turns by from each frame to the next [T - 1], at FPS frames a second.
        usual: its usual speed, rad/s.
    """
    still = find_still(steps)
    if not len(still):
        return np.zeros(1, dtype=np.int64), FPS * steps.mean(keepdims=True) / usual
    return still, FPS * _smooth(steps)[still] / usual


def find_still(steps: Floats) -> Ints:
    """Return the frames in which a body is stiller than before and after: minima of its speed, smoothed.

    Args:
        steps: angle that the mean joint turns by from each frame to the next [T - 1], at FPS frames a second.
    """
    from scipy.signal import find_peaks  # takes a second, which only learning needs

    # Keyframed joints turn evenly: their speeds are equal but for rounding, on any machine. A level stretch of them is
    # still once, in its middle.
    return np.asarray(find_peaks(-np.round(_smooth(steps), 9))[0], dtype=np.int64)


def _smooth(steps: Floats) -> Floats:
    """Return the means of steps [T - 1] over SMOOTHED seconds about each frame; none of a clip that is shorter."""
    window = np.hanning(round(SMOOTHED * FPS) + 2)[1:-1]
    if len(steps) < len(window):
        return np.zeros(0)
    return np.convolve(np.pad(steps, len(window) // 2, mode="edge"), window / window.sum(), "valid")


def _fit(efforts: Floats, quickness: Floats, logs: Floats) -> Floats:
    """Return level, slope, pull and spread [4] of the logarithms of durations [n].

    Args:
        efforts: logarithms of the ways' seconds at usual speeds [n].
        quickness: mean logarithms of the lulls of their ends [n].
        logs: logarithms of the durations [n].
    """
    given = np.stack([efforts, quickness], axis=1)
    mean = given.mean(axis=0) if len(given) else np.zeros(2)
    prior = np.array([SLOPE, PULL])
    middle = (logs.sum() + AS_MANY * (LEVEL + prior @ mean)) / (len(logs) + AS_MANY)  # of the logs at the mean
    off = given - mean
    # As if AS_MANY windows lay along the prior's plane, a standard deviation of the logs of 1 apart either way.
    products, sums = off.T @ off + AS_MANY * np.eye(2), off.T @ logs + AS_MANY * prior
    pull = float(np.clip(np.linalg.solve(products, sums)[1], *PULLS))
    slope = float(np.clip((sums[0] - products[0, 1] * pull) / products[0, 0], *SLOPES))
    left = logs - middle - off @ [slope, pull]
    spread = np.sqrt((left @ left + AS_MANY * SPREAD**2) / (len(logs) + AS_MANY))
    return np.array([middle - slope * mean[0] - pull * mean[1], slope, pull, spread])
