"""From a path of states to a motion: exact at both ends, smooth between, on its feet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionmind import rotations as rot
from motionmind.corpus.corpus import Corpus
from motionmind.grammar.grammar import Grammar
from motionmind.motion import Motion, Posture
from motionmind.realise.root import Carriage, carry, stand
from motionmind.realise.samples import choose_samples
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
) -> Motion:
    """The motion of a path of states [T + 1, L] from posture `a` to posture `b`, on the body of `a`.

    Its first and last frames are `a` and `b`, exactly. Between them each lane passes, at the times of the moves,
    through orientations that the corpus shows in its states; a C2 spline joins them. The root travels as the corpus's
    root does in these moves and ends where `b` stands. Its height keeps the lowest point of the body as far
    above the floor as the postures have it that the orientations come from.

    Args:
        path: states of the lanes.
        a: first posture.
        b: last posture.
        corpus: the movement that was learned from.
        states: of its postures [N, L].
        grammar: what was learned.
        carriage: how its bodies travel and stand.
        fps: frames a second; the whole is stretched by less than a frame so that `b` falls on one.
    """
    if len(path) == 1:
        return a.as_motion()
    seconds = durations(path, grammar.transitions)
    frames = max(1, round(float(seconds.sum()) * fps))
    seconds *= frames / fps / seconds.sum()
    keys = np.concatenate([[0.0], np.cumsum(seconds)])
    times = np.arange(frames + 1) / fps
    keys[-1] = times[-1]

    # The facing's states are steps of a circle, which the corpus need not show: its lane is not sampled but turned.
    joints = len(a.skeleton)
    first, last = corpus.to_lanes(a.rotations), corpus.to_lanes(b.rotations)
    orientations = corpus.to_lanes(corpus.rotations)
    chosen = choose_samples(path[:, :joints], states, orientations, first, last)
    inner = orientations[chosen, np.arange(joints)]
    between = rotation_spline(keys, np.concatenate([first[None, :joints], inner, last[None, :joints]]), times)
    if corpus.facing == "free":
        headings = _headings(path[:, -1], grammar, first[-1], last[-1])
        turn = rot.about_vertical(natural_spline(keys, headings, times))
        between = np.concatenate([between, turn[:, None]], axis=1)
    else:
        headings = np.concatenate([[rot.heading(first[0])], rot.heading(inner[:, 0]), [rot.heading(last[0])]])
    rotations = rot.normalise(corpus.from_lanes(between))
    rotations[0], rotations[-1] = a.rotations, b.rotations

    places = carry(path, headings, seconds, carriage.travel, grammar.transitions, a.root, b.root)
    heights = np.array([_lowest(a), *np.median(carriage.clearance[chosen], axis=1), _lowest(b)])
    root = stand(a.skeleton, rotations, natural_spline(keys, places, times), _eased(keys, heights, times))
    root[0], root[-1] = a.root, b.root
    return Motion(a.skeleton, rotations, root, times, "tween", keys)


def _headings(path: NDArray[np.int32], grammar: Grammar, a: Floats, b: Floats) -> Floats:
    """Headings in radians [T + 1] of a path through facing states, unwrapped, `a` and `b` [4] at its ends.

    Each move turns the short way between its states, as it was counted; what the ends lie off their states is spread
    over the moves, so that steady turning stays steady.
    """
    first = grammar.transitions.starts[-2]
    centres = rot.heading(grammar.centres[first + path])
    turned = np.unwrap(centres)
    off = rot.heading(np.stack([a, b])) - centres[[0, -1]]
    off -= 2.0 * np.pi * np.round(off / (2.0 * np.pi))
    return np.asarray(turned + off[0] + (off[1] - off[0]) * np.linspace(0.0, 1.0, len(path)))


def _lowest(posture: Posture) -> float:
    return float(posture.skeleton.positions_and_tips(posture.rotations, posture.root)[:, 1].min())


def _eased(times: Floats, values: Floats, at: Floats) -> Floats:
    """Values [N] that pass from key to key without overshoot: a cubic ease in and out on each piece."""
    i = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    s = (at - times[i]) / (times[i + 1] - times[i])
    return np.asarray(values[i] + (values[i + 1] - values[i]) * s * s * (3.0 - 2.0 * s))
