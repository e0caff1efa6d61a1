"""Evidence for trust: leave-one-out reconstruction of a corpus's own clips.

Each clip is left out, with its copies and the other parts of its take, and windows of it are filled by walks through
the remaining clips. `motionmind.learned.trust` fits its table to the agreement between the walks' departures from the
minimal movement and the true departures.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.limbs import parts_of
from motionmind.body.motion import Velocity
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.clip import Clip
from motionmind.corpus.corpus import Corpus
from motionmind.executors.workshop import Workshop
from motionmind.geometry import rotations as rot
from motionmind.learned.posture_statistics import PostureStatistics
from motionmind.learned.trust import PRIOR_TRUST, ZERO_DISPLACEMENT_RAD, Squares, Trust, counts, fit_table
from motionmind.walks.likelihood import BODY_PART_WEIGHTS
from motionmind.walks.mean_walk import Walk, walk_between
from motionmind.walks.minimal import departure, minimal_movement
from motionmind.walks.stops import Stop, stop_at

WINDOW_LENGTHS_S = (0.4, 0.6, 1.2, 2.0, 4.0)
N_WINDOWS_PER_LENGTH = 12  # evenly spread over the clips
N_POSTURES = 2_000  # to learn from, about, of at least MIN_CLIPS clips: the time per window is proportional to it
MIN_CLIPS = 8
MIN_FAMILIES = 3  # with two families of clips, each is judged by the other alone
DECAY_CANDIDATES_S = (0.3, 0.45, 0.6)  # of end velocities; 1.0 cost a take of cmu-29 23 points


class _Piece(NamedTuple):
    """Consecutive postures of a clip.

    Attributes:
        clip: index of the clip.
        start, stop: the first posture, and the one after the last.
        family: key shared by all clips that are left out together.
    """

    clip: int
    start: int
    stop: int
    family: tuple[str, str]


class _Window(NamedTuple):
    """A range of a corpus's postures, from first to last inclusive."""

    piece: _Piece
    first: int
    last: int


def learn_trust(corpus: Corpus, statistics: PostureStatistics, workshop: Workshop | None = None) -> Trust:
    """Learn how far to trust walks through a corpus, and how long the effect of an end velocity lasts.

    A corpus with fewer than `MIN_FAMILIES` families of clips takes the prior.

    Args:
        corpus: the movement.
        statistics: posture statistics of its samples.
        workshop: threads; None for the current one.
    """
    spread = spread_of(corpus, statistics)
    evidence = (
        gather_evidence(corpus, statistics, N_WINDOWS_PER_LENGTH, workshop) if len(corpus.clips) >= MIN_FAMILIES else []
    )
    if len(evidence) < MIN_FAMILIES:
        return replace(PRIOR_TRUST, spread=spread)
    errors = end_velocity_errors(corpus, 2 * N_WINDOWS_PER_LENGTH)
    decay = DECAY_CANDIDATES_S[int(np.argmin(errors))] if errors.any() else PRIOR_TRUST.lasts[0]
    return Trust(fit_table(evidence, PRIOR_TRUST.table), np.array([decay]), spread)


def gather_evidence(
    corpus: Corpus, statistics: PostureStatistics, count: int, workshop: Workshop | None = None
) -> list[Squares]:
    """Compare walks with the recording in windows of each family of clips; the walks use the other families only.

    Args:
        corpus: the movement.
        statistics: posture statistics of its samples.
        count: windows per length.
        workshop: threads; None for the current one.
    """
    pieces, spread = [piece for piece in _pieces(corpus) if piece.stop - piece.start > 1], spread_of(corpus, statistics)
    windows = [window for seconds in WINDOW_LENGTHS_S for window in _windows(corpus, pieces, seconds, count)]
    families = sorted({window.piece.family for window in windows})
    if len({piece.family for piece in pieces}) < 2:
        return []

    def learn(family: tuple[str, str]) -> Squares:
        others = restrict(corpus, statistics, [piece for piece in pieces if piece.family != family])
        own = (window for window in windows if window.piece.family == family)
        return Squares.summed(_compare(corpus, statistics, others, spread, window) for window in own)

    return list((workshop or Workshop()).map(learn, families))


def spread_of(corpus: Corpus, statistics: PostureStatistics) -> Floats:
    """Return the RMS distance per joint between two random postures, for each body part [P], radians."""
    one, other = np.random.default_rng(0).integers(len(corpus), size=(2, 1_000))
    turned = rot.angle(statistics.orientations[one], statistics.orientations[other]) ** 2
    return np.array(
        [max(float(np.sqrt(turned[:, part].mean())), ZERO_DISPLACEMENT_RAD) for part in parts_of(corpus.skeleton)]
    )


def restrict(corpus: Corpus, statistics: PostureStatistics, pieces: Sequence[_Piece]) -> PostureStatistics:
    """Restrict posture statistics to pieces of clips, in corpus order; update only the fields that walks need."""
    starts, firsts, count = corpus.columns.starts, corpus.moves.firsts, len(corpus.columns.weights)
    postures = np.concatenate([np.arange(piece.start, piece.stop) for piece in pieces])
    moves = np.concatenate(
        [
            np.arange(
                firsts[number] + piece.start - starts[piece.clip], firsts[number] + piece.stop - 1 - starts[piece.clip]
            )
            for round_ in (0, count)
            for piece in pieces
            if firsts[(number := round_ + piece.clip) + 1] > firsts[number]
        ]
    )
    kept, steps = np.concatenate([postures, len(corpus) + moves]), np.concatenate([moves, len(statistics.turn) + moves])
    shares, begins = statistics.shares[steps], np.searchsorted(kept, statistics.begins[steps])
    return replace(
        statistics,
        orientations=np.ascontiguousarray(statistics.orientations[kept]),
        weights=statistics.weights[kept],
        begins=begins,
        ends=np.searchsorted(kept, statistics.ends[steps]),
        shares=shares / np.bincount(begins, shares, len(kept))[begins],  # a piece may end where its clip goes on
        clusters=np.ascontiguousarray(statistics.clusters[kept]),
        turn=statistics.turn[moves],
        travel=statistics.travel[moves],
        trees=None,
    )


def _family(corpus: str, name: str) -> tuple[str, str]:
    """Return the key of a clip's take: mirrored copies share its name; parts and namesakes append a number to it."""
    return corpus, re.sub(r"(\.\d+| \(\d+\))+$", "", name)


def _pieces(corpus: Corpus) -> list[_Piece]:
    """Choose pieces of clips that represent a corpus, with at most about `N_POSTURES` postures in all."""
    starts = corpus.columns.starts
    numbers = np.arange(len(starts) - 1)
    if len(corpus) > N_POSTURES:
        share = max(N_POSTURES / len(corpus), MIN_CLIPS / len(numbers))
        numbers = numbers[
            np.unique((np.arange(0.0, 1.0, 1.0 / max(share * len(numbers), 1.0)) * len(numbers)).astype(int))
        ]
    longest = max(N_POSTURES // MIN_CLIPS, N_POSTURES // len(numbers)) if len(corpus) > N_POSTURES else len(corpus)
    out = []
    for number in numbers.tolist():
        clip = corpus.clips[number]
        out.append(_Piece(number, clip.start, min(clip.stop, clip.start + longest), _family(clip.corpus, clip.name)))
    return out


def _windows(corpus: Corpus, pieces: Sequence[_Piece], seconds: float, count: int) -> list[_Window]:
    """Return about `count` windows of about `seconds`, evenly spread over pieces; each spans at least two moves."""
    found: list[tuple[_Piece, Ints, Ints]] = []
    for piece in pieces:
        times = corpus.times[piece.start : piece.stop]
        first = np.arange(len(times))
        last = np.maximum(np.searchsorted(times, times + seconds - 1e-6), first + 2)
        fits = last < len(times)
        found.append((piece, piece.start + first[fits], piece.start + last[fits]))
    total = sum(len(first) for _, first, _ in found)
    chosen = np.unique(((np.arange(count) + 0.5) * total / count).astype(int)) if total else np.zeros(0, int)
    out, before = [], 0
    for piece, first, last in found:
        here = chosen[(chosen >= before) & (chosen < before + len(first))] - before
        out += [_Window(piece, int(first[k]), int(last[k])) for k in here]
        before += len(first)
    return out


def _compare(
    corpus: Corpus, statistics: PostureStatistics, others: PostureStatistics, spread: Floats, window: _Window
) -> Squares:
    """Compare the departure of walks through the other clips with the true departure in a window.

    Departures are in the joints' global rotations, at the inner postures. They are divided by the window's true
    departure, so that quiet windows count as much as lively ones.
    """
    skeleton, here = corpus.skeleton, slice(window.first, window.last + 1)
    true, times = statistics.orientations[here, : len(skeleton)], corpus.times[here]
    half_steps = np.interp(np.arange(2 * len(times) - 1), np.arange(0, 2 * len(times), 2), times)
    size = skeleton.height or 1.0
    ends = tuple(Stop(statistics.orientations[end], corpus.root[end] / size) for end in (window.first, window.last))
    walk = walk_between(parts_of(skeleton), others, None, (ends[0], ends[1]), half_steps, None)
    minimal = walk.minimal[2:-2:2]
    made = rot.mul(minimal, rot.exp(walk.departs[2:-2:2]))
    plain, made, true = (skeleton.global_rotations(one) for one in (minimal, made, true[1:-1]))
    departs, truly = rot.log(rot.inv_mul(plain, made)), rot.log(rot.inv_mul(plain, true))
    of_joints = _joint_weights(walk, spread)
    inner = of_joints.T @ (np.sum(departs**2, axis=(0, 2))[:, None] * of_joints)
    along, whole = of_joints.T @ np.sum(departs * truly, axis=(0, 2)), float(np.sum(truly**2))
    weight = 1.0 / max(whole, ZERO_DISPLACEMENT_RAD**2)
    return Squares(weight * inner, weight * along, weight * whole)


def _joint_weights(walk: Walk, spread: Floats) -> Floats:
    """Return the weight of each table entry in the share of each joint [J, 5]."""
    of_parts = counts(walk.nearest.mean(axis=1), walk.displacements, spread)
    return np.asarray(np.einsum("k,jkc->jc", np.array(BODY_PART_WEIGHTS), of_parts[walk.members]))


def end_velocity_errors(corpus: Corpus, count: int) -> Floats:
    """Return the error of minimal movements for each decay time in `DECAY_CANDIDATES_S` [n], radians.

    It is the mean distance from the recordings, summed over windows of the lengths at which end velocities matter most;
    0 if there are no windows.

    Args:
        corpus: the movement.
        count: windows per length.
    """
    pieces, out = _pieces(corpus), np.zeros(len(DECAY_CANDIDATES_S))
    for window in (window for seconds in WINDOW_LENGTHS_S[1:3] for window in _windows(corpus, pieces, seconds, count)):
        clip = corpus.clips[window.piece.clip]
        if clip.start < window.first and window.last < clip.stop - 1:
            out += _errors_in(corpus, clip, window)
    return out


def _errors_in(corpus: Corpus, clip: Clip, window: _Window) -> Floats:
    """Return the mean distance of minimal movements from a clip's recording in a window, for each decay time [n]."""
    skeleton, frames = corpus.skeleton, corpus.detail.shape[1] + 1  # a move
    first, last = ((end - clip.start) * frames for end in (window.first, window.last))
    shown = corpus.recording(clip, first - frames, last + frames + 1)
    motion, after = shown.slice(frames, len(shown) - frames), shown.slice(len(shown) - frames - 1, len(shown))
    leaves = stop_at(corpus, motion.posture(0), Velocity.at_end(shown.slice(0, frames + 1))).rates
    arrives = stop_at(corpus, motion.posture(-1), Velocity.at_start(after)).rates
    assert leaves is not None
    assert arrives is not None
    true, times = corpus.to_chains(motion.rotations)[:, : len(skeleton)], motion.times
    truly = rot.log(rot.inv_mul(minimal_movement(true[[0, -1]], times, None, None), true))
    even = rot.log(rot.inv_mul(true[0], true[-1])) / (times[-1] - times[0])
    out = np.empty(len(DECAY_CANDIDATES_S))
    for k, decay in enumerate(DECAY_CANDIDATES_S):
        off = truly - departure(times, leaves.joints - even, arrives.joints - even, decay=decay)
        out[k] = np.sqrt(np.sum(off**2, axis=-1) @ _carried(skeleton)).mean()
    return out


def _carried(skeleton: Skeleton) -> Floats:
    """Return the number of joints that each joint carries, itself included [J].

    A joint's error recurs in the global rotations of all joints that it carries.
    """
    out = np.ones(len(skeleton))
    for joint in range(len(skeleton) - 1, 0, -1):
        out[skeleton.parents[joint]] += out[joint]
    return out
