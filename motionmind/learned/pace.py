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
corpus is not forbidden to move: no joint counts as slower than a quarter of the median joint, or than everyday movement
where that is at rest, and neither the body's turning nor its travel as slower than everyday movement. The *peaks*
(`motionmind.learned.peaks`) are what the greatest of windows of 1 to 6 s keep to, accelerations of the root among them;
none is less than the fastest speeds, or everyday movement.
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
from motionmind.learned.peaks import LENGTHS, RARE, Peaks, accelerations
from motionmind.learned.percentiles import Percentile
from motionmind.learned.sampled import BLOCK, FPS, Sampled

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
SLOWEST_USUAL = 0.3, 0.2, 0.1  # rad/s of the mean joint, rad/s of turning, heights/s of travel: no usual speed is less
OF_MEDIAN = 0.25  # of the median joint's fastest speed: no joint's is less
EVERYDAY = 3.0, 2.0, 0.5  # rad/s of a joint where most rest; the least of turning, rad/s, and of travel, heights/s
STARTS = 3.0  # heights/s^2 of the root, than which no peak is less: in three of four seconds recorded dancers show more


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
    first, last = (_faced(those[..., 0, :]) for those in rotations)
    return _way(skeleton, rot.angle(*rotations), first, last, roots[1] - roots[0])


def _faced(root: Floats) -> tuple[Floats, Floats]:
    """Return where a body whose root has these orientations [..., 4] faces [...], radians, and how it tilts there."""
    headings = rot.heading(root)
    return headings, rot.mul(rot.about_vertical(-headings), root)


def _way(
    skeleton: Skeleton, joints: Floats, first: tuple[Floats, Floats], last: tuple[Floats, Floats], moved: Floats
) -> Way:
    """Return ways by the joints' angles [..., J], radians, how the body is turned before and after them (`_faced`), and
    how far its root moves [..., 3], metres."""
    (faced, tilted), (faces, tilts) = first, last
    joints[..., 0] = rot.angle(tilted, tilts)
    turn = np.abs(np.angle(np.exp(1j * (faces - faced))))
    height = skeleton.height if skeleton.height > 0.0 else 1.0
    return Way(joints, np.asarray(turn), np.hypot(moved[..., 0], moved[..., 2]) / height)


def way_between(a: Posture, b: Posture) -> Way:
    """Return the way from one posture to another on the same body."""
    return ways(a.skeleton, (a.rotations, b.rotations), (a.root, b.root))


def way_of(motion: Motion) -> Way:
    """Return the ways from each frame of a motion to the next [T - 1]."""
    joints, (faces, tilts) = rot.angle(motion.rotations[:-1], motion.rotations[1:]), _faced(motion.rotations[:, 0])
    moved = np.diff(motion.root, axis=0)
    return _way(motion.skeleton, joints, (faces[:-1], tilts[:-1]), (faces[1:], tilts[1:]), moved)


@dataclass(frozen=True, eq=False)
class Pace:
    """The pace of a corpus of J joints.

    Attributes:
        usual: usual speeds of the mean joint and of the body's turning, rad/s, and of its travel, heights/s [3].
        fastest: fastest speeds of the joints, rad/s, of the body's turning and of its travel [J + 2].
        greatest: greatest speeds of the same in any frame [J + 2].
        slowest: the speed of the mean joint over a second, rad/s, that only a hundredth of all seconds is below [1].
        peaks: greatest speeds of the same, and of the root's rise or fall, heights/s, and the root's greatest
            acceleration, heights/s^2, in all windows of each of LENGTHS but a hundredth [6, J + 4].
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

    def peaks_in(self, seconds: float, pace: float = 1.0) -> Floats:
        """Return the peaks of windows so long [J + 4], of movement at so many times the corpus's pace."""
        peaks = pace * np.array([np.interp(pace * seconds, LENGTHS, part) for part in self.peaks.T])
        peaks[-1] *= pace  # accelerations grow by the square
        return peaks

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
    return refit_pace(corpus, measure_pace(Kept.none(corpus)))


def measure_pace(kept: Kept, before: Gauge | None = None, workshop: Workshop | None = None) -> Gauge:
    """Return what the clips of a corpus show of their pace.

    Args:
        kept: the corpus, and which of its clips are new: these alone are measured.
        before: what the clips of the earlier corpus show; None if there is none.
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
    """Return what a clip shows of its pace: steps, still moments and windows, as in Gauge; a single frame, none."""
    recording = Sampled(corpus, clip, FPS)
    if len(recording) < 2:
        return np.zeros((0, len(corpus.skeleton) + 6), np.float32), np.zeros((0, 2)), np.zeros((0, 6))
    blocks = [np.column_stack([steps_of(block), moved_in(block)]) for block in recording.blocks(BLOCK, overlap=1)]
    steps = np.concatenate(blocks)
    still, speeds = _lulls(steps[:, : len(corpus.skeleton)].mean(axis=1))
    stills = np.column_stack([recording.times[still], speeds])
    return steps.astype(np.float32), stills, _windows(recording, still, speeds)


def refit_pace(corpus: Corpus, gauge: Gauge) -> Pace:
    """Return the pace of a corpus, given what its clips show."""
    joints = len(corpus.skeleton)
    counts = np.diff(gauge.starts[:, 0])
    shown = [(number, clip) for number, clip in enumerate(corpus.clips) if counts[number]]
    stretches = [_danced(Sampled(corpus, clip, FPS)) for _, clip in shown]
    lengths = np.array([stop - start for some in stretches for start, stop in some], dtype=np.int64)
    moving = counts[counts > 0]
    rare = Percentile(RARE, int(counts.sum()))
    seconds = Percentile(100.0 - RARE, int((moving - np.minimum(moving, round(FPS)) + 1).sum()))
    peaks = Peaks(lengths)
    total, most = np.zeros((0, 3)), np.zeros(joints + 4)
    for (number, _), some in zip(shown, stretches, strict=True):
        steps = gauge.steps[gauge.starts[number, 0] : gauge.starts[number + 1, 0]].astype(np.float64)
        speeds, moved = FPS * steps[:, :-3], steps[:, -3:]
        # Row after row, so that it does not matter how many clips there are.
        total = np.concatenate([total, _usual_parts(speeds, joints)]).sum(axis=0, keepdims=True)
        most = np.maximum(most, np.append(speeds.max(axis=0), accelerations(moved, FPS).max(initial=0.0)))
        rare.add(speeds[:, :-1])
        seconds.add(over_seconds(FPS * steps[:, :joints].mean(axis=1), FPS)[:, None])
        for start, stop in some:
            peaks.add(speeds[start:stop], moved[start:stop])
    usual, fastest = np.array(SLOWEST_USUAL), np.concatenate([np.full(joints, EVERYDAY[0]), EVERYDAY[1:]])
    greatest, slowest = np.append(fastest, [EVERYDAY[2], STARTS]), np.zeros(1)
    if shown:
        usual = np.maximum(total[0] / counts.sum(), usual)
        of_joints = rare.value()
        median = float(np.median(of_joints[:joints]))
        least = OF_MEDIAN * median if median > SLOWEST_USUAL[0] else EVERYDAY[0]  # at rest there is noise
        fastest = np.maximum(of_joints, [*[least] * joints, *EVERYDAY[1:]])
        greatest = np.maximum(most, np.append(fastest, [EVERYDAY[2], STARTS]))
        slowest = seconds.value()
    lulls = np.ones(len(corpus))
    for number, clip in shown:
        here = slice(clip.start, clip.stop)
        times, speed = gauge.stills[gauge.starts[number, 1] : gauge.starts[number + 1, 1]].T
        lulls[here] = np.interp(corpus.times[here], times, speed / usual[0])
    peak = peaks.values(greatest, np.append(fastest, [EVERYDAY[2], STARTS]))
    return Pace(usual, fastest, greatest[:-2], slowest, peak, lulls, _fit_windows(gauge.windows, usual))


def _usual_parts(speeds: Floats, joints: int) -> Floats:
    """Return the speeds of the mean joint, of the body's turning and of its travel [T, 3], from those of all parts."""
    return np.column_stack([speeds[:, :joints].mean(axis=1), speeds[:, joints], speeds[:, joints + 1]])


def steps_of(motion: Motion) -> Floats:
    """Return all parts of the ways from each frame to the next, and how far the root rises or falls [T - 1, J + 3]."""
    height = motion.skeleton.height if motion.skeleton.height > 0.0 else 1.0
    return np.column_stack([way_of(motion).parts, np.abs(np.diff(motion.root[:, 1])) / height])


def moved_in(motion: Motion) -> Floats:
    """Return the displacements of the root from each frame to the next [T - 1, 3], heights."""
    height = motion.skeleton.height if motion.skeleton.height > 0.0 else 1.0
    return np.diff(motion.root, axis=0) / height


def _danced(clip: Sampled) -> Ints:
    """Return the stretches of a clip's steps of which nothing was reconstructed, from and to a step [n, 2]."""
    known = np.zeros(len(clip) + 1, dtype=np.bool_)
    known[1:-1] = clip.danced(clip.times)
    return np.flatnonzero(np.diff(known)).reshape(-1, 2)


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


def _windows(clip: Sampled, still: Ints, speeds: Floats) -> Floats:
    """Return the windows between a clip's still moments, as of `_Shown` [W, 6].

    What was reconstructed in a recording nobody danced: no window leads over it.

    Args:
        clip: at FPS frames a second.
        still: its still moments, frames in order [S].
        speeds: of the mean joint in them [S], rad/s.
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
    out = np.empty((len(pairs), 6))
    for start in range(0, len(pairs), BLOCK):
        part = slice(start, start + BLOCK)
        found = ways(clip.skeleton, *((of[begins[part]], of[ends[part]]) for of in (rotations, root)))
        out[part, :3] = np.column_stack([found.joints.mean(axis=-1), found.turn, found.travel])
    out[:, 3], out[:, 4], out[:, 5] = speeds[begins], speeds[ends], (still[ends] - still[begins]) / FPS
    return out


def _fit_windows(windows: Floats, usual: Floats) -> Floats:
    """Return the law [4] of windows [W, 6] (see `_Shown`) at usual speeds (see `Pace`)."""
    joints, turn, travel, first, last, seconds = windows.T
    efforts = _effort(Way(joints[:, None], turn, travel), usual)
    return _fit(efforts, _quickness(first / usual[0], last / usual[0]), np.log(seconds))


def _lulls(steps: Floats) -> tuple[Ints, Floats]:
    """Return a clip's still moments, frames in order [S], and the speeds of the mean joint in them [S], rad/s; the
    first frame, with the clip's mean speed, where there are none.

    Args:
        steps: angle that the mean joint turns by from each frame to the next [T - 1], at FPS frames a second.
    """
    still = find_still(steps)
    if not len(still):
        return np.zeros(1, dtype=np.int64), FPS * steps.mean(keepdims=True)
    return still, FPS * _smooth(steps)[still]


def find_still(steps: Floats) -> Ints:
    """Return the frames in which a body is stiller than before and after: minima of its speed, smoothed.

    Args:
        steps: angle that the mean joint turns by from each frame to the next [T - 1], at FPS frames a second.
    """
    # Keyframed joints turn evenly: their speeds are equal but for rounding, on any machine. A level stretch of them is
    # still once, in its middle. SciPy's `find_peaks` finds the same, upside down; its import takes longer than learning
    # a few clips.
    speeds = np.round(_smooth(steps), 9)
    starts = np.flatnonzero(np.diff(speeds, prepend=np.inf))
    ends = np.append(starts[1:], len(speeds)) - 1
    sinks_and_rises = np.diff(np.sign(np.diff(speeds[starts]))) > 0.0
    return np.asarray((starts + ends)[1:-1][sinks_and_rises] // 2, dtype=np.int64)


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
