"""Carriage: how a corpus's bodies hold themselves, travel and stand, moment by moment."""

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
from motionmind.body.support import NEAR, STILL, centre_of_mass, overhang, size_of
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.kept import Kept
from motionmind.executors.workshop import Workshop
from motionmind.geometry import rotations as rot
from motionmind.learned.clusters import clusters_of
from motionmind.learned.neighbours import MANY, Neighbours, build_neighbours
from motionmind.learned.percentiles import Percentile
from motionmind.learned.sampled import BLOCK
from motionmind.learned.trust import PRIOR, Trust

SLIDES = 0.3  # metres a second at which a limb on the floor stands half as firmly as one at rest
LEAVES = 0.06  # metres that a body's lowest point is off the floor in the air, at least; as long as it moves
FIRM = 0.5  # how firmly a limb stands that bears
RARE = 0.01  # share of postures in which limbs may be deeper in each other, or the weight farther out, than usual
USUAL = 0.08  # metres of overhang, for a corpus that shows none
MOST = 0.15  # metres of overhang at most: dancers who lean farther are moving


@dataclass(frozen=True, eq=False)
class Carriage:
    """The carriage of a corpus's bodies: their pose, travel and stance in its postures and midway between them.

    There are N moments: the postures, then the middle of each of the M moves. A step is half a move.

    Attributes:
        orientations: orientations of the chains [N, L, 4].
        weights: weight of each moment [N].
        begins: moment that each step leads from [2 M].
        ends: moment that it leads to [2 M].
        shares: share of each step among those that leave the same moment [2 M].
        clusters: number of the cluster that each part of the body is in at each moment [N, P] (see
            `motionmind.learned.clusters`).
        turn: turn about the vertical in each half of each move [M], radians.
        travel: displacement of the root in the same, metres, in the body's heading midway [M, 3].
        clearance: height of the lowest point above the clip's floor (`floor_height`) [N], metres, at least 0.
        stands: how firmly each limb, and last the trunk, stands [N, limbs + 1]: 1 where its lowest point does not move
            level, near 0 where it moves fast. A foot may be low and slide, as dancers' feet do.
        aloft: whether the body is in the air at each moment [N], 0 or 1: its lowest point is off the floor, and moves.
        overhang: how far the centre of mass is beyond its support while one limb bears it, but for RARE postures [1],
            metres.
        loose: whether each joint breaks its limits in the corpus [J].
        touches: how deep limbs are in each other at most, but for RARE postures, by the pairs of `Capsules.pairs` [P],
            metres.
        trees: by which few of the moments are looked at; None where there are few, or an earlier version learned.
        trust: which share of the departures of walks from the minimal movement is kept.
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
    trust: Trust = PRIOR


def learn_carriage(
    corpus: Corpus, workshop: Workshop | None = None, kept: Kept | None = None, before: Carriage | None = None
) -> Carriage:
    """Learn how the bodies of a corpus hold themselves, travel and stand.

    Args:
        corpus: the movement.
        workshop: threads, and room for large arrays; None for this thread and memory.
        kept: the clips that an earlier corpus has, too; None for no such corpus.
        before: the carriage of that corpus, whose moments in these clips are taken as they are.
    """
    workshop = workshop or Workshop()
    moments = _join_moments(kept, before, workshop) if kept and before else _measure_moments(corpus, workshop)
    begins, ends, weights = corpus.moves.begins, corpus.moves.ends, corpus.moves.weights
    shares = weights / np.bincount(begins, weights, len(corpus))[begins]
    middles = len(corpus) + np.arange(len(begins))
    counts = np.concatenate([corpus.weights, weights])
    orientations, stands, aloft = moments.orientations, moments.stands, moments.aloft
    return Carriage(
        orientations,
        counts,
        np.concatenate([begins, middles]),
        np.concatenate([middles, ends]),
        np.concatenate([shares, np.ones(len(begins))]),
        clusters_of(corpus.skeleton, orientations, workshop),
        moments.turn,
        moments.travel,
        moments.clearance,
        stands,
        aloft,
        _overhang(corpus, stands[: len(corpus)], aloft[: len(corpus)], workshop),
        find_loose(corpus.skeleton, corpus.rotations),
        _touching(corpus, workshop),
        build_neighbours(corpus.skeleton, orientations, counts, workshop) if len(counts) > MANY else None,
    )


_OF_MOVES = "turn", "travel"  # what is known of moves alone, and not of postures


class _Moments(NamedTuple):
    """Arrays of Carriage that say of each clip what it shows by itself."""

    orientations: Floats
    clearance: Floats
    stands: Floats
    aloft: Floats
    turn: Floats
    travel: Floats


def _measure_moments(corpus: Corpus, workshop: Workshop) -> _Moments:
    """Measure the moments of all clips."""

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
    return _Moments(
        _orientations(corpus, workshop),
        clear,
        _standing(corpus, workshop),
        _aloft(corpus, clear, workshop),
        0.5 * turned,
        0.5 * moved,
    )


def _join_moments(kept: Kept, before: Carriage, workshop: Workshop) -> _Moments:
    """Join the moments of clips that are kept with those of new clips, which are measured."""
    new = None if kept.new is None else _measure_moments(kept.new, workshop)
    moves = len(before.turn)

    def join(name: str) -> Floats:
        old, fresh = getattr(before, name), getattr(new, name, None)
        whole = 0 if name in _OF_MOVES else len(kept.corpus)
        out = workshop.empty((whole + len(kept.corpus.moves), *old.shape[1:]))
        if whole:
            kept.join(old, fresh, kept.postures, out)
        middles = None if fresh is None or new is None else fresh[len(fresh) - len(new.turn) :]
        kept.join(old[len(old) - moves :], middles, kept.moves, out[whole:])
        return out

    return _Moments(*map(join, _Moments._fields))


def _blocks(count: int) -> Iterator[slice]:
    """Yield slices of BLOCK from 0 to a count: what is measured of all postures at once would fill the memory."""
    return (slice(start, start + BLOCK) for start in range(0, count, BLOCK))


def _orientations(corpus: Corpus, workshop: Workshop) -> Floats:
    """Return the orientations of the chains in the postures, and midway in the moves [N + M, L, 4]."""
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
    """Return how deep pairs of limbs are in each other [P], metres, in all but RARE postures."""
    if not len(capsules_of(corpus.skeleton).pairs()):
        return np.zeros(0)

    def depths(here: slice) -> Floats:
        return np.stack([*penetration(corpus.skeleton, corpus.rotations[here]).values()], axis=-1)

    most = Percentile(100.0 * (1.0 - RARE), len(corpus))
    for block in workshop.map(depths, _blocks(len(corpus))):
        most.add(block)
    return most.value()


def _standing(corpus: Corpus, workshop: Workshop) -> Floats:
    """Return how firmly limbs and trunk stand [N, limbs + 1], as in Carriage.

    In a move 1 / (1 + (v / SLIDES)^2), with v the level speed of the limb's lowest point; in a posture the mean of the
    moves that begin and end there.
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
        for number in np.unique(limb):  # where every joint belongs to a limb, none is the trunk's
            moved = _lowest_moved(before[:, limb == number], after[:, limb == number])
            speed = np.hypot(moved[:, 0], moved[:, 2]) / corpus.moves.seconds[here]
            out[len(corpus) :, number][here] = 1.0 / (1.0 + (speed / SLIDES) ** 2)

    workshop.do(move, _blocks(len(begins)))
    for number in np.unique(limb):
        still = out[len(corpus) :, number]
        sums = np.bincount(begins, still, len(corpus)) + np.bincount(ends, still, len(corpus))
        out[: len(corpus), number] = sums / counts
    return out


def _lowest_moved(before: Floats, after: Floats) -> Floats:
    """Return how far the lowest of some points moves [n, 3], from where they are `before` to `after` [n, P, 3]."""
    lowest, rows = np.argmin(before[..., 1] + after[..., 1], axis=1), np.arange(len(before))
    return np.asarray(after[rows, lowest] - before[rows, lowest])


def _aloft(corpus: Corpus, clearance: Floats, workshop: Workshop) -> Floats:
    """Return whether the body is in the air in each moment [N], 0 or 1, as in Carriage.

    A body on half-pointe, or whose recording's floor is a little off, is as high; but its lowest point hardly moves.

    Args:
        corpus: the movement.
        clearance: height of the lowest point above the floor in the moments [N], metres.
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
    return np.asarray((clearance > LEAVES * size) & (speeds > STILL * size), dtype=np.float64)


def _overhang(corpus: Corpus, stands: Floats, aloft: Floats, workshop: Workshop) -> Floats:
    """Return how far beyond its support the corpus's bodies have their mass while one limb bears it, as in Carriage.

    Args:
        corpus: the movement.
        stands: how firmly each limb, and last the trunk, stands in its postures [N, limbs + 1].
        aloft: whether the body is in the air there [N].
        workshop: threads.
    """
    size = size_of(corpus.skeleton)
    found = workshop.map(lambda here: _overhangs(corpus, here, stands[here], aloft[here]), _blocks(len(corpus)))
    over = np.concatenate(list(found))
    if not len(over):
        return np.array([USUAL * size])
    return np.array([min(float(np.nanquantile(over, 1.0 - RARE)), MOST * size)])


def _overhangs(corpus: Corpus, here: slice, stands: Floats, aloft: Floats) -> Floats:
    """Return how far beyond its support the body has its mass in those of some postures in which one limb bears it [n].

    None of a body whose masses are not known.

    Args:
        corpus: the movement.
        here: which postures.
        stands: how firmly each limb, and last the trunk, stands in them [T, limbs + 1].
        aloft: whether the body is in the air there [T].
    """
    body, rotations, root = corpus.skeleton, corpus.rotations[here], corpus.root[here]
    mass, near = centre_of_mass(body, rotations, root), NEAR * size_of(body)
    low = limb_heights(body, rotations, root)
    bears = (low <= low.min(axis=1, keepdims=True) + near) & (stands > FIRM) & (aloft == 0.0)[:, None]
    alone = bears.sum(axis=1) == 1
    if mass is None or not alone.any():
        return np.zeros(0)
    places, joints = contact_points(body, rotations[alone], root[alone])
    lowest = places[..., 1] <= places[..., 1].min(axis=1, keepdims=True) + near
    supports = lowest & bears[alone][:, limb_of_points(body)[joints]]
    return overhang(places[..., [0, 2]], supports, mass[alone][:, [0, 2]])
