"""Modes: passages of the corpus that lead from one posture to another in quite different ways.

A mean of walks has no alternatives but itself, perturbed. The likeliest passages that begin near A and end near B after
about the time that there is are other answers: other ways through space, other tempi, another foot to stand on. Among
these, each next one is the farthest from all before (the traversal of Gonzalez, "Clustering to minimize the maximum
intercluster distance", Theoretical Computer Science 38, 1985).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.contact import RATE
from motionmind.corpus.corpus import Corpus
from motionmind.geometry import rotations as rot
from motionmind.learned.carriage import Carriage
from motionmind.walks.frames import Frames, frames_near
from motionmind.walks.passages import SLOWEST, STRIDE, WARP_COST, WARPS, Place, distances
from motionmind.walks.stops import Stop

LIKELIEST = 16  # passages to choose from


def find_modes(
    corpus: Corpus, carriage: Carriage, ends: tuple[Stop, Stop], seconds: float, known: list[Floats]
) -> Iterator[Place]:
    """Yield where likely passages begin, each the farthest from the movements that are `known` by then.

    Args:
        corpus: the movement that was learned from.
        carriage: how its bodies hold themselves.
        ends: the first and the last posture, with their velocities if they are given.
        seconds: how long the movement lasts.
        known: orientations of the joints [K, J, 4] in each movement that is known, at even times from its first posture
            to its last; those yielded are to be added by whoever takes them.
    """
    steps, joints = max(1, round(seconds * RATE / STRIDE)), known[0].shape[1]
    poses = np.stack([stop.chains[:joints] for stop in ends])
    beside = int(np.ceil(SLOWEST * seconds / float(np.median(corpus.moves.seconds)))) if len(corpus.moves) else 0
    recorded = frames_near(corpus, carriage, poses, beside)
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
    """Return the first and the last frame of passages that begin and end near the ends, the likeliest first.

    No more than half of the time of one lies within another.
    """
    first, last = distances(recorded, poses, ends)
    total, begins = _from_start_to_end(recorded.stretches, first, steps)
    total = total + last
    found: list[tuple[int, int]] = []
    for end in np.argsort(total, kind="stable").tolist():
        if len(found) == LIKELIEST or not np.isfinite(total[end]):
            break
        begin = int(begins[end])
        if all(min(end, other) - max(begin, one) <= 0.5 * min(end - begin, other - one) for one, other in found):
            found.append((begin, end))
    return found


def _from_start_to_end(stretches: Ints, costs: Floats, steps: int) -> tuple[Floats, Ints]:
    """Return the least cost of passages of so many steps to each frame [F], and the frames that they begin at [F].

    Args:
        stretches: number of the stretch that each frame is in [F].
        costs: of beginning at each frame [F].
        steps: of a tenth of a second as it was danced, or up to a third more or less.
    """
    total, begins = costs, np.arange(len(costs))
    goes_on = {warp: np.flatnonzero(stretches[warp:] == stretches[:-warp]) for warp in WARPS}
    for _ in range(steps):
        best, before = np.full(len(total), np.inf), np.zeros(len(total), dtype=np.int64)
        for warp, starts in goes_on.items():
            on = total[starts] + WARP_COST * abs(warp - STRIDE) / steps
            better = on < best[starts + warp]
            best[starts[better] + warp], before[starts[better] + warp] = on[better], begins[starts[better]]
        total, begins = best, before
        if np.isinf(total.min()):  # no stretch is as long
            break
    return total, begins


def _held_to_ends(recorded: Frames, passage: tuple[int, int], poses: Floats, count: int) -> Floats:
    """Return orientations of the joints [count, J, 4] along a passage, its offsets at the ends distributed along it.

    Args:
        recorded: the recordings.
        passage: its first frame and its last.
        poses: orientations of the joints at the ends [2, J, 4].
        count: how many, at even times.
    """
    share = np.linspace(0.0, 1.0, count)[:, None, None]
    frames = np.round(np.linspace(*passage, count)).astype(np.int64)
    shown = recorded.chains[frames, : poses.shape[1]]
    first, last = rot.log(rot.inv_mul(shown[0], poses[0])), rot.log(rot.inv_mul(shown[-1], poses[1]))
    return rot.mul(shown, rot.exp((1.0 - share) * first + share * last))
