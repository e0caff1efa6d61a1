"""Modes: recorded passages that lead from one posture to another along different trajectories.

A mean of walks offers only perturbations of itself as alternatives. The likeliest passages that begin near A and end
near B in about the given time offer other trajectories, tempi and support feet. Each mode is the passage farthest from
all earlier ones: the farthest-first traversal of Gonzalez, "Clustering to minimize the maximum intercluster distance",
Theoretical Computer Science 38, 1985.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.contact import CONTACT_FPS
from motionmind.corpus.corpus import Corpus
from motionmind.geometry import rotations as rot
from motionmind.learned.posture_statistics import PostureStatistics
from motionmind.walks.frames import Frames, frames_near
from motionmind.walks.passages import MAX_TEMPO_RATIO, NODE_FRAMES, WARP_COST_RAD2, WARP_FRAMES, Place, node_distances
from motionmind.walks.stops import Stop

N_CANDIDATE_PASSAGES = 16


def find_modes(
    corpus: Corpus, statistics: PostureStatistics, ends: tuple[Stop, Stop], seconds: float, known: list[Floats]
) -> Iterator[Place]:
    """Yield the places where likely passages begin, each the farthest from the movements `known` by then.

    Args:
        corpus: the movement learned from.
        statistics: its posture statistics.
        ends: the first and the last posture, with velocities if given.
        seconds: duration of the movement.
        known: orientations of the joints [K, J, 4] in each known movement, at even times from its first posture to its
            last; the caller appends each yielded one.
    """
    steps, joints = max(1, round(seconds * CONTACT_FPS / NODE_FRAMES)), known[0].shape[1]
    poses = np.stack([stop.chains[:joints] for stop in ends])
    beside = (
        int(np.ceil(MAX_TEMPO_RATIO * seconds / float(np.median(corpus.moves.seconds)))) if len(corpus.moves) else 0
    )
    recorded = frames_near(corpus, statistics, poses, beside)
    passages = _likeliest(recorded, ends, poses, steps)
    shown = [_held_to_ends(recorded, passage, poses, len(known[0])) for passage in passages]
    while passages:
        off = [min(float(rot.angle(own, other).mean()) for other in known) for own in shown]
        farthest = int(np.argmax(off))
        shown.pop(farthest)
        begin = passages.pop(farthest)[0]
        clip = int(np.searchsorted(corpus.columns.starts, recorded.postures[begin], side="right")) - 1
        yield Place(clip, float(recorded.times[begin]))


def _likeliest(recorded: Frames, ends: tuple[Stop, Stop], poses: Floats, steps: int) -> list[tuple[int, int]]:
    """Return the first and last frames of passages that begin and end near the ends, likeliest first.

    Two passages overlap by at most half of the shorter one.
    """
    first, last = node_distances(recorded, poses, ends)
    total, begins = _from_start_to_end(recorded.stretches, first, steps)
    total = total + last
    found: list[tuple[int, int]] = []
    for end in np.argsort(total, kind="stable").tolist():
        if len(found) == N_CANDIDATE_PASSAGES or not np.isfinite(total[end]):
            break
        begin = int(begins[end])
        if all(min(end, other) - max(begin, one) <= 0.5 * min(end - begin, other - one) for one, other in found):
            found.append((begin, end))
    return found


def _from_start_to_end(stretches: Ints, costs: Floats, steps: int) -> tuple[Floats, Ints]:
    """Return the least cost of a passage of `steps` steps to each frame [F], and the frame at which it begins [F].

    Args:
        stretches: index of each frame's stretch [F].
        costs: of beginning at each frame [F].
        steps: number of steps, each 0.1 s of the recording, up to a third more or less.
    """
    total, begins = costs, np.arange(len(costs))
    goes_on = {warp: np.flatnonzero(stretches[warp:] == stretches[:-warp]) for warp in WARP_FRAMES}
    for _ in range(steps):
        best, before = np.full(len(total), np.inf), np.zeros(len(total), dtype=np.int64)
        for warp, starts in goes_on.items():
            on = total[starts] + WARP_COST_RAD2 * abs(warp - NODE_FRAMES) / steps
            better = on < best[starts + warp]
            best[starts[better] + warp], before[starts[better] + warp] = on[better], begins[starts[better]]
        total, begins = best, before
        if np.isinf(total.min()):  # no stretch is long enough
            break
    return total, begins


def _held_to_ends(recorded: Frames, passage: tuple[int, int], poses: Floats, count: int) -> Floats:
    """Return orientations of the joints [count, J, 4] along a passage, warped to meet the given ends.

    Args:
        recorded: the recordings.
        passage: its first frame and its last.
        poses: orientations of the joints at the ends [2, J, 4].
        count: number of even times.
    """
    share = np.linspace(0.0, 1.0, count)[:, None, None]
    frames = np.round(np.linspace(*passage, count)).astype(np.int64)
    shown = recorded.chains[frames, : poses.shape[1]]
    first, last = rot.log(rot.inv_mul(shown[0], poses[0])), rot.log(rot.inv_mul(shown[-1], poses[1]))
    return rot.mul(shown, rot.exp((1.0 - share) * first + share * last))
