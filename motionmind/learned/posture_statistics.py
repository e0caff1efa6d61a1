"""Posture statistics: orientations, travel and support in each sample of a corpus."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.body.capsules import capsules_of, penetration
from motionmind.body.contact import contact_points, floor_height, limb_heights, lowest_height
from motionmind.body.limbs import limb_of_points, limbs_of
from motionmind.body.limits import find_loose
from motionmind.body.support import SUPPORT_HEIGHT_M, SUPPORT_SPEED_MPS, centre_of_mass, overhang, size_of
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.kept import Kept
from motionmind.executors.workshop import Workshop
from motionmind.geometry import rotations as rot
from motionmind.learned.clusters import clusters_of
from motionmind.learned.neighbours import MAX_FULL_SEARCH, Neighbours, build_neighbours
from motionmind.learned.percentiles import Percentile
from motionmind.learned.sampled import BLOCK_FRAMES
from motionmind.learned.trust import PRIOR_TRUST, Trust

FIRMNESS_HALVED_MPS = 0.3  # speed on the floor that halves a limb's firmness
AIRBORNE_CLEARANCE_M = 0.06  # a body in the air is at least this high, and its lowest point moves
MIN_FIRMNESS = 0.5  # of a supporting limb
RARE_POSTURE_SHARE = 0.01  # share of postures that exceed the learned limb penetration or overhang
DEFAULT_OVERHANG_M = 0.08  # for bodies of unknown mass, or never on a single limb
MAX_OVERHANG_M = 0.15  # dancers who lean farther are moving


@dataclass(frozen=True, eq=False)
class PostureStatistics:
    """Posture statistics of a corpus: orientations, travel and support in its N samples.

    The samples are the postures, then the midpoints of the M moves. A step is half a move.

    Attributes:
        orientations: orientations of the joint chains [N, L, 4].
        weights: weight of each sample [N].
        begins: sample at the start of each step [2 M].
        ends: sample at its end [2 M].
        shares: probability of each step, given the sample at its start [2 M].
        clusters: cluster of each body part in each sample [N, P] (see `motionmind.learned.clusters`).
        turn: turn about the vertical in each half of each move [M], radians.
        travel: displacement of the root in each half, metres, relative to the body's heading midway [M, 3].
        clearance: height of the lowest point above the clip's floor (`floor_height`) [N], metres, at least 0.
        stands: firmness of each limb, then of the trunk [N, limbs + 1]: 1 if its lowest point does not move
            horizontally, near 0 if it moves fast. A low foot may slide, as dancers' feet do.
        aloft: 1 if the body is in the air [N], else 0: its lowest point is off the floor, and moves.
        overhang: greatest distance of the centre of mass beyond a single supporting limb [1], metres, without the
            RARE_POSTURE_SHARE of most extreme postures.
        loose: whether each joint exceeds its limits in the corpus [J].
        touches: greatest penetration depth for each of `Capsules.pairs` [P], metres, without the RARE_POSTURE_SHARE of
            most extreme postures.
        trees: neighbour trees over the samples; None if there are few samples.
        trust: share of the walks' departure from the minimal movement to keep.
    """

    orientations: Floats
    weights: Floats
    begins: Ints
    ends: Ints
    shares: Floats
    clusters: Int32s
    turn: Floats
    travel: Floats
    clearance: Floats
    stands: Floats
    aloft: Floats
    overhang: Floats
    loose: Bools
    touches: Floats
    trees: Neighbours | None = None
    trust: Trust = PRIOR_TRUST


def learn_posture_statistics(
    corpus: Corpus, workshop: Workshop | None = None, kept: Kept | None = None, before: PostureStatistics | None = None
) -> PostureStatistics:
    """Learn the posture statistics of a corpus.

    Args:
        corpus: the movement.
        workshop: threads, and room for large arrays; None for the current thread and memory.
        kept: the clips shared with an earlier corpus; None for no such corpus.
        before: the posture statistics of that corpus; its samples in these clips are reused.
    """
    workshop = workshop or Workshop()
    samples = _join_samples(kept, before, workshop) if kept and before else _measure_samples(corpus, workshop)
    begins, ends, weights = corpus.moves.begins, corpus.moves.ends, corpus.moves.weights
    shares = weights / np.bincount(begins, weights, len(corpus))[begins]
    middles = len(corpus) + np.arange(len(begins))
    counts = np.concatenate([corpus.weights, weights])
    orientations, stands, aloft = samples.orientations, samples.stands, samples.aloft
    return PostureStatistics(
        orientations,
        counts,
        np.concatenate([begins, middles]),
        np.concatenate([middles, ends]),
        np.concatenate([shares, np.ones(len(begins))]),
        clusters_of(corpus.skeleton, orientations, workshop),
        samples.turn,
        samples.travel,
        samples.clearance,
        stands,
        aloft,
        _overhang(corpus, stands[: len(corpus)], aloft[: len(corpus)], workshop),
        find_loose(corpus.skeleton, corpus.rotations),
        _touching(corpus, workshop),
        build_neighbours(corpus.skeleton, orientations, counts, workshop) if len(counts) > MAX_FULL_SEARCH else None,
    )


_MOVE_FIELDS = "turn", "travel"  # fields with a row per move, and none per posture


class _Samples(NamedTuple):
    """Arrays of PostureStatistics that depend on each clip alone."""

    orientations: Floats
    clearance: Floats
    stands: Floats
    aloft: Floats
    turn: Floats
    travel: Floats


def _measure_samples(corpus: Corpus, workshop: Workshop) -> _Samples:
    """Measure the samples of all clips."""

    def low_in(here: slice) -> Floats:
        return lowest_height(corpus.skeleton, corpus.rotations[here], corpus.root[here])

    low = np.concatenate(list(workshop.map(low_in, _blocks(len(corpus)))))
    floor = [floor_height(low[clip.start : clip.stop]) for clip in corpus.clips]
    clearance = np.maximum(low - np.repeat(floor, [clip.stop - clip.start for clip in corpus.clips]), 0.0)
    begins, ends = corpus.moves.begins, corpus.moves.ends
    heading = rot.heading(corpus.rotations[:, 0])
    turned = np.angle(np.exp(1j * (heading[ends] - heading[begins])))
    moved = rot.mul_vec(rot.about_vertical(-heading[begins] - 0.5 * turned), corpus.root[ends] - corpus.root[begins])
    clear = np.concatenate([clearance, 0.5 * (clearance[begins] + clearance[ends])])
    return _Samples(
        _orientations(corpus, workshop),
        clear,
        _standing(corpus, workshop),
        _aloft(corpus, clear, workshop),
        0.5 * turned,
        0.5 * moved,
    )


def _join_samples(kept: Kept, before: PostureStatistics, workshop: Workshop) -> _Samples:
    """Join the samples of kept clips with those of new clips, which are measured."""
    new = None if kept.new is None else _measure_samples(kept.new, workshop)
    moves = len(before.turn)

    def join(name: str) -> Floats:
        old, fresh = getattr(before, name), getattr(new, name, None)
        whole = 0 if name in _MOVE_FIELDS else len(kept.corpus)
        out = workshop.empty((whole + len(kept.corpus.moves), *old.shape[1:]))
        if whole:
            kept.join(old, fresh, kept.postures, out)
        middles = None if fresh is None or new is None else fresh[len(fresh) - len(new.turn) :]
        kept.join(old[len(old) - moves :], middles, kept.moves, out[whole:])
        return out

    return _Samples(*map(join, _Samples._fields))


def _blocks(count: int) -> Iterator[slice]:
    """Yield slices of BLOCK_FRAMES rows from 0 to a count: measuring all postures at once would exhaust memory."""
    return (slice(start, start + BLOCK_FRAMES) for start in range(0, count, BLOCK_FRAMES))


def _orientations(corpus: Corpus, workshop: Workshop) -> Floats:
    """Return orientations of the joint chains in the N postures and midway in the M moves [N + M, L, 4]."""
    count, begins, ends = len(corpus), corpus.moves.begins, corpus.moves.ends
    out = workshop.empty((count + len(begins), len(corpus.chains), 4))

    def postures(here: slice) -> None:
        out[:count][here] = corpus.to_chains(corpus.rotations[here])

    def middles(here: slice) -> None:
        out[count:][here] = rot.normalise(rot.slerp(out[begins[here]], out[ends[here]], 0.5))

    workshop.do(postures, _blocks(count))
    workshop.do(middles, _blocks(len(begins)))
    return out


def _touching(corpus: Corpus, workshop: Workshop) -> Floats:
    """Return the greatest penetration depth of each pair of limbs [P], metres, as in PostureStatistics."""
    if not len(capsules_of(corpus.skeleton).pairs()):
        return np.zeros(0)

    def depths(here: slice) -> Floats:
        return np.stack([*penetration(corpus.skeleton, corpus.rotations[here]).values()], axis=-1)

    most = Percentile(100.0 * (1.0 - RARE_POSTURE_SHARE), len(corpus))
    for block in workshop.map(depths, _blocks(len(corpus))):
        most.add(block)
    return most.value()


def _standing(corpus: Corpus, workshop: Workshop) -> Floats:
    """Return the firmness of limbs and trunk [N, limbs + 1], as in PostureStatistics.

    In a move it is 1 / (1 + (v / FIRMNESS_HALVED_MPS)^2), with v the horizontal speed of the limb's lowest point. In a
    posture it is the mean over the moves that begin or end there.
    """
    begins, ends = corpus.moves.begins, corpus.moves.ends
    limb = limb_of_points(corpus.skeleton)
    out = workshop.empty((len(corpus) + len(begins), len(limbs_of(corpus.skeleton)) + 1))
    out[:] = 1.0
    counts = np.maximum(np.bincount(np.concatenate([begins, ends]), minlength=len(corpus)), 1)

    def move(here: slice) -> None:
        before, after = (
            corpus.skeleton.positions_and_tips(corpus.rotations[of[here]], corpus.root[of[here]])
            for of in (begins, ends)
        )
        for number in np.unique(limb):  # not all numbers: a body may have no trunk
            moved = _lowest_moved(before[:, limb == number], after[:, limb == number])
            speed = np.hypot(moved[:, 0], moved[:, 2]) / corpus.moves.seconds[here]
            out[len(corpus) :, number][here] = 1.0 / (1.0 + (speed / FIRMNESS_HALVED_MPS) ** 2)

    workshop.do(move, _blocks(len(begins)))
    for number in np.unique(limb):
        still = out[len(corpus) :, number]
        sums = np.bincount(begins, still, len(corpus)) + np.bincount(ends, still, len(corpus))
        out[: len(corpus), number] = sums / counts
    return out


def _lowest_moved(before: Floats, after: Floats) -> Floats:
    """Return the displacement [n, 3] of the lowest of P points, given `before` and `after` [n, P, 3]."""
    lowest, rows = np.argmin(before[..., 1] + after[..., 1], axis=1), np.arange(len(before))
    return np.asarray(after[rows, lowest] - before[rows, lowest])


def _aloft(corpus: Corpus, clearance: Floats, workshop: Workshop) -> Floats:
    """Return whether the body is in the air in each sample [N], 0 or 1, as in PostureStatistics.

    A body on half-pointe, or with a slightly misplaced floor, may be as high, but its lowest point hardly moves.

    Args:
        corpus: the movement.
        clearance: height of the lowest point above the floor in the samples [N], metres.
        workshop: threads.
    """
    begins, ends, size = corpus.moves.begins, corpus.moves.ends, size_of(corpus.skeleton)
    speed = np.empty(len(begins))

    def move(here: slice) -> None:
        before, after = (
            contact_points(corpus.skeleton, corpus.rotations[of[here]], corpus.root[of[here]])[0]
            for of in (begins, ends)
        )
        speed[here] = np.linalg.norm(_lowest_moved(before, after), axis=-1) / corpus.moves.seconds[here]

    workshop.do(move, _blocks(len(begins)))
    both, twice = np.concatenate([begins, ends]), np.concatenate([speed, speed])
    counts = np.maximum(np.bincount(both, minlength=len(corpus)), 1)
    speeds = np.concatenate([np.bincount(both, twice, len(corpus)) / counts, speed])
    return np.asarray((clearance > AIRBORNE_CLEARANCE_M * size) & (speeds > SUPPORT_SPEED_MPS * size), dtype=np.float64)


def _overhang(corpus: Corpus, stands: Floats, aloft: Floats, workshop: Workshop) -> Floats:
    """Return the overhang of the corpus's bodies, as in PostureStatistics.

    Args:
        corpus: the movement.
        stands: firmness of each limb, then of the trunk, in its postures [N, limbs + 1].
        aloft: whether the body is in the air in each posture [N].
        workshop: threads.
    """
    size = size_of(corpus.skeleton)
    found = workshop.map(lambda here: _overhangs(corpus, here, stands[here], aloft[here]), _blocks(len(corpus)))
    over = np.concatenate(list(found))
    if not len(over):
        return np.array([DEFAULT_OVERHANG_M * size])
    return np.array([min(float(np.nanquantile(over, 1.0 - RARE_POSTURE_SHARE)), MAX_OVERHANG_M * size)])


def _overhangs(corpus: Corpus, here: slice, stands: Floats, aloft: Floats) -> Floats:
    """Return the overhang in each of T postures with a single supporting limb [n]; empty if the masses are unknown.

    Args:
        corpus: the movement.
        here: the T postures.
        stands: firmness of each limb, then of the trunk, in them [T, limbs + 1].
        aloft: whether the body is in the air in each [T].
    """
    body, rotations, root = corpus.skeleton, corpus.rotations[here], corpus.root[here]
    mass, near = centre_of_mass(body, rotations, root), SUPPORT_HEIGHT_M * size_of(body)
    low = limb_heights(body, rotations, root)
    bears = (low <= low.min(axis=1, keepdims=True) + near) & (stands > MIN_FIRMNESS) & (aloft == 0.0)[:, None]
    alone = bears.sum(axis=1) == 1
    if mass is None or not alone.any():
        return np.zeros(0)
    places, joints = contact_points(body, rotations[alone], root[alone])
    lowest = places[..., 1] <= places[..., 1].min(axis=1, keepdims=True) + near
    supports = lowest & bears[alone][:, limb_of_points(body)[joints]]
    return overhang(places[..., [0, 2]], supports, mass[alone][:, [0, 2]])
