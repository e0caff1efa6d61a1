"""From a path of states to a motion: exact at both ends, smooth between, on its feet."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from motionmind import rotations as rot
from motionmind.corpus.corpus import Corpus
from motionmind.grammar.grammar import Grammar
from motionmind.motion import Insertion, Motion, Posture
from motionmind.realise.root import Carriage, carry, lowest, stand
from motionmind.realise.samples import choose_samples, find_samples
from motionmind.realise.spline import natural_spline, rotation_spline
from motionmind.realise.timing import durations

Floats = NDArray[np.float64]


def realise(
    path: NDArray[np.int32],
    a: Posture,
    b: Posture,
    corpus: Corpus,
    states: NDArray[np.int32],
    grammar: Grammar,
    carriage: Carriage,
    fps: float,
    length: float | None = None,
    through: Mapping[int, Posture] = MappingProxyType({}),
) -> Motion:
    """The motion of a path of states [T + 1, L] from posture `a` to posture `b`, on the body of `a`.

    Its first and last frames are `a` and `b`, exactly, and at the moves that `through` names its joints and its facing
    are as in the postures there. Between them each lane passes, at the times of the moves, through orientations that
    the corpus shows in its states; a C2 spline joins them. The root travels as the corpus's
    root does in these moves and ends where `b` stands. Its height keeps the lowest point of the body as far
    above the floor as the postures have it that the orientations come from; the floor is at 0, or lower under ends that
    are.

    Args:
        path: states of the lanes.
        a: first posture.
        b: last posture.
        corpus: the movement that was learned from.
        states: of its postures [N, L].
        grammar: what was learned.
        carriage: how its bodies travel and stand.
        fps: frames a second; the whole is stretched by less than a frame so that `b` falls on one.
        length: seconds that it lasts, to which frames are fitted; None for as long as the corpus takes.
        through: postures on the way, by the number of moves that lead there, increasing.
    """
    if len(path) == 1:
        return Motion(a.skeleton, a.rotations[None], a.root[None], np.zeros(1), "tween", (Insertion(np.zeros(1)),))
    seconds = durations(path, grammar.transitions)
    frames = max(1, round((length or float(seconds.sum())) * fps))
    fps = frames / length if length else fps
    seconds *= frames / fps / seconds.sum()
    keys = np.concatenate([[0.0], np.cumsum(seconds)])
    times = np.arange(frames + 1) / fps
    times[-1] = length or times[-1]
    keys[-1] = times[-1]

    # The facing's states are steps of a circle, which the corpus need not show: its lane is not sampled but turned.
    joints = len(a.skeleton)
    postures = {0: a, **through, len(path) - 1: b}
    stops = {move: corpus.to_lanes(posture.rotations) for move, posture in postures.items()}
    poses, heights = np.empty((len(path), joints, 4)), np.empty(len(path))
    for start, end in pairwise(stops):
        between = slice(start + 1, end)
        ends = stops[start][:joints], stops[end][:joints]
        observed = find_samples(path[start : end + 1, :joints], states)
        orientations = corpus.rotations[observed, np.arange(joints)[:, None]]
        orientations[:, 0] = corpus.to_lanes(orientations[:, 0, :, None])[..., 0, :]  # of the root without its facing
        chosen = choose_samples(observed, orientations, *ends)
        poses[between] = corpus.to_lanes(corpus.rotations[chosen, np.arange(joints)])[:, :joints]
        heights[between] = np.median(carriage.clearance[chosen], axis=1)
    for move, lanes in stops.items():
        poses[move] = lanes[:joints]
    rotations = rotation_spline(keys, poses, times)
    if corpus.facing == "free":
        headings = _headings(path[:, -1], grammar, seconds, {move: lanes[-1] for move, lanes in stops.items()})
        turn = rot.about_vertical(natural_spline(keys, headings, times))
        rotations = np.concatenate([rotations, turn[:, None]], axis=1)
    else:
        headings = rot.heading(poses[:, 0])
    rotations = rot.normalise(corpus.from_lanes(rotations))
    rotations[0], rotations[-1] = a.rotations, b.rotations

    places = carry(path, headings, seconds, carriage.travel, grammar.transitions, a.root, b.root)
    # All heights are of the body of `a`, which the motion is on; `b` may have stood on shorter legs.
    low = {move: lowest(a.skeleton, posture.rotations, posture.root) for move, posture in postures.items()}
    # Where the ends are below 0 so is their floor: a recording's own zero is often off.
    heights[1:-1] += np.interp(keys[1:-1], keys[[0, -1]], np.minimum([low[0], low[len(path) - 1]], 0.0))
    heights[list(low)] = list(low.values())
    root = stand(a.skeleton, rotations, natural_spline(keys, places, times), _eased(keys, heights, times))
    root[0], root[-1] = a.root, b.root
    return Motion(a.skeleton, rotations, root, times, "tween", (Insertion(keys),))


def _headings(
    path: NDArray[np.int32], grammar: Grammar, seconds: Floats, stops: Mapping[int, NDArray[np.float64]]
) -> Floats:
    """Headings in radians [T + 1] of a path through facing states, unwrapped, at `stops` those of their turns [4].

    Each move turns the short way between its states, as it was counted. A state is a step of the circle, and the body
    may face anywhere in it: of all headings in the path's states those that turn most evenly, so that steady turning
    stays steady however coarse the steps.
    """
    ring = grammar.centres[grammar.transitions.starts[-2] :]
    centres = np.unwrap(rot.heading(ring[path]))
    half = np.pi / len(ring)
    low, high = centres - half, centres + half
    for move, turn in stops.items():
        off = rot.heading(turn) - centres[move]
        low[move] = high[move] = centres[move] + off - 2.0 * np.pi * np.round(off / (2.0 * np.pi))
    return _evenest(low[[0, -1]], low[1:-1], high[1:-1], seconds)


def _evenest(ends: Floats, low: Floats, high: Floats, seconds: Floats) -> Floats:
    """Numbers [T + 1] from ends[0] to ends[1], from `low` to `high` [T - 1] on the way, for which the sum of squared
    steps, each over its seconds [T], is least: the taut string.

    By relaxation: every other number is pulled to where its neighbours would have it, in turns, until all lie still.
    """
    out = np.concatenate([ends[:1], 0.5 * (low + high), ends[1:]])
    pull = 1.0 / seconds
    moved = np.inf
    while moved > 1e-6:
        before = out.copy()
        for first in (1, 2):
            here = np.arange(first, len(out) - 1, 2)
            mean = (pull[here - 1] * out[here - 1] + pull[here] * out[here + 1]) / (pull[here - 1] + pull[here])
            out[here] = np.clip(mean, low[here - 1], high[here - 1])
        moved = float(np.abs(out - before).max())
    return out


def _eased(times: Floats, values: Floats, at: Floats) -> Floats:
    """Values [N] that pass from key to key without overshoot: a cubic ease in and out on each piece."""
    i = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    s = (at - times[i]) / (times[i + 1] - times[i])
    return np.asarray(values[i] + (values[i + 1] - values[i]) * s * s * (3.0 - 2.0 * s))
