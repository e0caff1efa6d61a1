"""Passages: consecutive recorded frames that resemble a movement, and the transfer of their detail to it.

A mean of walks has a small error but looks unlike real dancing: averaging removes the middle frequencies. Here a
movement keeps its mean in the low band and takes everything above a cut-off from a passage: consecutive frames of the
corpus's recordings, all joints from the same frames. For the trade-off see Blau and Michaeli, "The
Perception-Distortion Tradeoff", CVPR 2018.

The passage is the path of least cost through the recordings along the mean (Viterbi's algorithm), with a cost for each
change to another stretch. It may be up to a third faster or slower than recorded: its time is warped to the movement's.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.contact import CONTACT_FPS
from motionmind.corpus.corpus import Corpus
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline
from motionmind.learned.posture_statistics import PostureStatistics
from motionmind.learned.trust import ZERO_DISPLACEMENT_RAD
from motionmind.walks.expectation import Expectation
from motionmind.walks.frames import Frames, frame_distances, frames_near, frames_of
from motionmind.walks.stops import Stop

NODE_FRAMES = 3  # of the recording, between nodes of a passage at its own tempo: 0.1 s
WARP_FRAMES = 2, 3, 4  # allowed between nodes: up to a third faster or slower
MAX_TEMPO_RATIO = WARP_FRAMES[-1] / NODE_FRAMES  # recorded seconds per second of movement
WARP_COST_RAD2 = 0.3  # for each frame more or less than NODE_FRAMES between nodes
CHANGE_COST_RAD2 = 0.72  # for a change to another stretch: 0.6 radians a joint off, before and after
GIVEN_POSTURE_WEIGHT = 20.0  # of the distance at a given posture
# Weight of the distance at other nodes. It is low because a mean is quiet, and so are the frames nearest to it. Chosen
# on cmu-05: with 1, passages are a tenth slower and easier to tell from the dancer (AUC 0.77, not 0.74) at equal error.
FREE_POSTURE_WEIGHT = 0.05
END_VELOCITY_HORIZON_S = 0.2  # converts a difference of velocity at an end to a distance
PASSAGE_BLEND_S = 0.2  # in which the velocities of one stretch blend into those of the next
# Cut-off at a liveliness of a half, and the least number of its periods in a short movement. Chosen on cmu-05: lower
# cut-offs cost more error for each point of AUC.
HALF_LIVELINESS_HZ = 0.6
N_HALF_LIVELINESS_PERIODS = 0.9


class Place(NamedTuple):
    """A place in a corpus: the index of a clip, and a time in its recording, seconds."""

    clip: int
    seconds: float


class Danced(NamedTuple):
    """Displacements that give a mean of walks the detail of a passage.

    Attributes:
        passage: the passage.
        times: of the displacements [n + 1], seconds.
        off: displacements of the joints from the mean, rotation vectors, radians [n + 1, J, 3]. The mean's heading
            stays, since the passage faces elsewhere.
    """

    passage: Passage
    times: Floats
    off: Floats

    def at(self, times: Floats) -> Floats:
        """Return the displacements at times [N]: [N, J, 3]."""
        return natural_spline(self.times, self.off, times)

    def move(self, chains: Floats, times: Floats) -> Floats:
        """Displace the mean's joint chains [N, L, 4], given at times [N]."""
        off, joints = self.at(times), self.off.shape[1]
        return np.concatenate([rot.mul(chains[:, :joints], rot.exp(off)), chains[:, joints:]], axis=1)


class Passage(NamedTuple):
    """A passage along a movement: one recorded frame per node.

    Attributes:
        times: of the nodes in the movement, evenly spaced [K], seconds.
        frames: index of the frame at each node [K].
        recorded: the recordings.
        starts: nodes at which a new stretch begins, the first node included.
    """

    times: Floats
    frames: Ints
    recorded: Frames
    starts: Ints

    @property
    def postures(self) -> Ints:
        """The corpus's last posture at or before each node's frame [K]."""
        return self.recorded.postures[self.frames]


def find_passage(recorded: Frames, poses: Floats, times: Floats, ends: tuple[Stop, Stop], given: Ints) -> Passage:
    """Return the passage of least cost along a movement.

    Args:
        recorded: the recordings to choose from.
        poses: orientations of the joints at the nodes [K, J, 4].
        times: of the nodes, evenly spaced [K], seconds.
        ends: the first and the last posture, with velocities if given.
        given: nodes whose postures are given, first and last included.
    """
    weights = np.full(len(poses), FREE_POSTURE_WEIGHT)
    weights[given] = GIVEN_POSTURE_WEIGHT
    costs = weights[:, None] * node_distances(recorded, poses, ends)
    stretches, count = recorded.stretches, len(recorded.stretches)
    goes_on = {warp: np.flatnonzero(stretches[warp:] == stretches[:-warp]) for warp in WARP_FRAMES}
    total, came_from = costs[0], []
    for own in costs[1:]:
        least = int(total.argmin())
        best, before = np.full(count, total[least] + CHANGE_COST_RAD2), np.full(count, least)
        for warp, starts in goes_on.items():
            on = total[starts] + WARP_COST_RAD2 * abs(warp - NODE_FRAMES)
            better = on < best[starts + warp]
            best[starts[better] + warp], before[starts[better] + warp] = on[better], starts[better]
        came_from.append(before)
        total = best + own
    found = [int(total.argmin())]
    for before in reversed(came_from):
        found.append(int(before[found[-1]]))
    frames = np.array(found[::-1])
    return Passage(times, frames, recorded, _starts(frames, stretches))


def node_distances(recorded: Frames, poses: Floats, ends: tuple[Stop, Stop]) -> Floats:
    """Return squared distances between postures and all frames, including velocities at the ends [K, F], radians^2.

    Args:
        recorded: the frames.
        poses: orientations of the joints [K, J, 4].
        ends: the first and the last of the postures.
    """
    out = frame_distances(recorded, poses)
    for row, stop in zip((0, -1), ends, strict=True):
        if stop.rates is not None:
            off = recorded.rates[:, : poses.shape[1]] - stop.rates.joints
            out[row] += END_VELOCITY_HORIZON_S**2 * np.mean(np.sum(off**2, axis=-1), axis=-1)
    return out


def velocities(passage: Passage, times: Floats) -> Floats:
    """Return the angular velocities of a passage's joint chains from each time to the next [n, L, 3], rad/s.

    Velocities are blended where the passage changes to another stretch.

    Args:
        passage: the passage.
        times: increasing [n + 1], seconds.
    """
    recorded, middles = passage.recorded, 0.5 * (times[1:] + times[:-1])
    out = np.zeros((len(middles), *recorded.chains.shape[1:-1], 3))
    weights = np.zeros(len(middles))
    bounds = [*passage.starts.tolist(), len(passage.frames)]
    for begin, end in pairwise(bounds):
        weight = np.ones(len(middles))
        if begin > 0:
            change = 0.5 * (passage.times[begin - 1] + passage.times[begin])
            weight *= np.clip(0.5 + (middles - change) / PASSAGE_BLEND_S, 0.0, 1.0)
        if end < len(passage.frames):
            change = 0.5 * (passage.times[end - 1] + passage.times[end])
            weight *= np.clip(0.5 - (middles - change) / PASSAGE_BLEND_S, 0.0, 1.0)
        here = np.flatnonzero(weight > 0.0)
        if len(here) == 0:
            continue
        around = times[here[0] : here[-1] + 2]
        shown = _chains_at(recorded, passage, (begin, end), around)
        turned = rot.log(rot.inv_mul(shown[:-1], shown[1:])) / np.diff(around)[:, None, None]
        out[here] += weight[here, None, None] * turned
        weights[here] += weight[here]
    return out / np.maximum(weights, 1e-9)[:, None, None]


def _chains_at(recorded: Frames, passage: Passage, nodes: tuple[int, int], times: Floats) -> Floats:
    """Return the joint chains of one part of a passage at the given times [n, L, 4], extrapolated beyond its nodes.

    Args:
        recorded: the recordings.
        passage: the passage.
        nodes: the first node of the part, and the one after its last.
        times: the times [n], seconds.
    """
    at, frames = passage.times[slice(*nodes)], passage.frames[slice(*nodes)].astype(np.float64)
    frames[1:-1] = 0.25 * frames[:-2] + 0.5 * frames[1:-1] + 0.25 * frames[2:]  # smooths the tempo
    first = last = CONTACT_FPS
    if len(at) > 1:
        first, last = (np.diff(frames) / np.diff(at))[[0, -1]]
    where = np.interp(times, at, frames)
    where += first * np.minimum(times - at[0], 0.0) + last * np.maximum(times - at[-1], 0.0)
    own = np.flatnonzero(recorded.stretches == recorded.stretches[passage.frames[nodes[0]]])
    where = np.clip(where, own[0], own[-1])
    before = np.clip(np.floor(where).astype(np.int64), own[0], max(own[-1] - 1, own[0]))
    after = np.minimum(before + 1, own[-1])
    return rot.slerp(recorded.chains[before], recorded.chains[after], (where - before)[:, None])


def displacements(base: Floats, times: Floats, rates: Floats, given: Ints, cutoff: float) -> Floats:
    """Displace a movement so that it moves as a passage does above a cut-off: rotation vectors [n + 1, J, 3].

    They minimise, over each joint's displacements d that are 0 at the given times,

        sum over t of |d'(t) - (rate of the passage - rate of the movement)|^2 + (2 pi cutoff)^2 |d(t)|^2,

    a screened Poisson problem. Above the cut-off, velocities follow the passage; below it, orientations follow the
    movement.
    Source: Bhat, Curless, Cohen and Zitnick, "Fourier analysis of the 2D screened Poisson equation for gradient domain
    problems", ECCV 2008.

    Args:
        base: orientations of the joints in the movement [n + 1, J, 4].
        times: of the movement, evenly spaced from one given time to the next [n + 1], seconds.
        rates: angular velocities of the passage from each time to the next [n, J, 3], rad/s.
        given: indices of times with zero displacement, increasing, first and last included.
        cutoff: in hertz.
    """
    steps = np.diff(times)
    missing = steps[:, None, None] * rates - rot.log(rot.inv_mul(base[:-1], base[1:]))
    out = np.zeros((*base.shape[:-1], 3))
    for begin, end in pairwise(given.tolist()):
        out[begin + 1 : end] = _screened(missing[begin:end], 2.0 * np.pi * cutoff * float(steps[begin]))
    return out


def _screened(steps: Floats, screen: float) -> Floats:
    """Return d[1], ..., d[n - 1] that minimise sum |d[t + 1] - d[t] - steps[t]|^2 + screen^2 |d[t]|^2, with d[0] = d[n]
    = 0, for steps [n, ...]: a tridiagonal system, solved by Thomas's algorithm."""
    out = steps[:-1] - steps[1:]
    diagonal, pivots = 2.0 + screen**2, np.empty(len(out))
    for row in range(len(out)):
        pivots[row] = diagonal - (1.0 / pivots[row - 1] if row else 0.0)
        if row:
            out[row] += out[row - 1] / pivots[row - 1]
    for row in range(len(out) - 1, -1, -1):
        if row < len(out) - 1:
            out[row] += out[row + 1]
        out[row] /= pivots[row]
    return out


def dance(
    corpus: Corpus,
    statistics: PostureStatistics,
    walk: Expectation,
    stops: Mapping[float, Stop],
    liveliness: float,
    place: Place | None = None,
) -> Danced | None:
    """Add the detail of a passage to a mean of walks; return None where there is nothing to add.

    Args:
        corpus: the movement learned from.
        statistics: its posture statistics.
        walk: the mean of walks.
        stops: postures to pass exactly, keyed by time in seconds; increasing, first and last included.
        liveliness: 0 for the mean itself, 1 for the passage, displaced to meet the stops.
        place: start of the passage; None for any.
    """
    (first, *_, last), passed = stops.values(), np.array([*stops])
    joints, length = walk.poses.shape[1], float(passed[-1])
    displacement = np.sqrt(np.mean(rot.angle(first.chains[:joints], last.chains[:joints]) ** 2))
    is_still = displacement < ZERO_DISPLACEMENT_RAD and len(stops) == 2 and first.rates is None and last.rates is None
    if liveliness == 0.0 or (is_still and place is None):
        return None
    nodes = np.linspace(0.0, length, max(1, round(length * CONTACT_FPS / NODE_FRAMES)) + 1)
    poses = walk.chains(corpus, nodes)[:, :joints]
    given = np.unique(np.abs(nodes[:, None] - passed).argmin(axis=0))
    if place is None:
        recorded = frames_near(corpus, statistics, poses[::4])
    else:
        recorded = frames_of(corpus, place.clip, place.seconds, place.seconds + MAX_TEMPO_RATIO * length)
    passage = find_passage(recorded, poses, nodes, (first, last), given)
    times, rows = _frame_times(passed)
    rates, base = velocities(passage, times)[:, :joints], walk.chains(corpus, times)[:, :joints]
    off = displacements(base, times, rates, rows[[0, -1]], cutoff_frequency(liveliness, length))
    return Danced(passage, times, _zero_at_stops(off, times, rows))


def _zero_at_stops(off: Floats, times: Floats, rows: Ints) -> Floats:
    """Make displacements [n + 1, J, 3] zero at the given rows: subtract smooth bumps that reach to the rows beside.

    A displacement constrained to 0 there would reverse at once, and the movement would falter.

    Args:
        off: displacements, 0 at the first row and the last.
        times: of the displacements [n + 1], seconds.
        rows: increasing, first and last included.
    """
    out = off.copy()
    for before, row, after in zip(rows[:-2], rows[1:-1], rows[2:], strict=True):
        away = (times - times[row]) / np.where(
            times < times[row], times[before] - times[row], times[after] - times[row]
        )
        share = np.where(away < 1.0, (1.0 - away) ** 2 * (1.0 + 2.0 * away), 0.0)
        out -= share[:, None, None] * off[row]
    return out


def _frame_times(passed: Floats) -> tuple[Floats, Ints]:
    """Return times about 1 / RATE apart, evenly spaced between consecutive stops, and the rows of the stops."""
    parts, rows = [passed[:1]], [0]
    for begin, end in pairwise(passed.tolist()):
        count = max(1, round((end - begin) * CONTACT_FPS))
        parts.append(np.linspace(begin, end, count + 1)[1:])
        rows.append(rows[-1] + count)
    return np.concatenate(parts), np.array(rows)


def cutoff_frequency(liveliness: float, seconds: float) -> float:
    """Return the cut-off, hertz, for a liveliness above 0 and a movement of this duration.

    It is 0 at a liveliness of 1. At a half it is `HALF_LIVELINESS_HZ` or, in a movement too short for it,
    `N_HALF_LIVELINESS_PERIODS` per movement.
    """
    return max(HALF_LIVELINESS_HZ, N_HALF_LIVELINESS_PERIODS / seconds) * (1.0 - liveliness) / liveliness


def _starts(frames: Ints, stretches: Ints) -> Ints:
    """Return the nodes at which a passage begins or changes to another stretch [C]."""
    steps, apart = np.diff(frames), np.diff(stretches[frames]) != 0
    changes = apart | (steps < min(WARP_FRAMES)) | (steps > max(WARP_FRAMES))
    return np.concatenate([[0], np.flatnonzero(changes) + 1])
