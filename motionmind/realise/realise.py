"""From a path of states to a motion: exact at both ends, smooth between, on its feet."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.body.contact import lowest_height
from motionmind.body.limits import within_limits
from motionmind.body.motion import Insertion, Motion, Posture
from motionmind.corpus.corpus import Corpus, subdivide_times
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline, rotation_spline
from motionmind.grammar.grammar import Grammar
from motionmind.learned.carriage import Carriage
from motionmind.realise.detail import detail_of, likest_moves
from motionmind.realise.ground import set_on_floor
from motionmind.realise.headings import travel_along, turn_with_path, turn_with_walks
from motionmind.realise.mean_walk import mean_walk
from motionmind.realise.timeline import Timeline, timeline


class _Walk(NamedTuple):
    """The mean of walks through a corpus, at T moves and midway between them: the half steps.

    Attributes:
        half_steps: times [2 T + 1], seconds.
        stops: orientations of all chains [L, 4] that are given, by the number of moves that lead there.
        poses: orientations of the joints [2 T + 1, J, 4].
        moments: probabilities of the corpus's moments [2 T + 1, N].
        moves: probabilities of the corpus's moves in each half step [2 T, M].
    """

    half_steps: Floats
    stops: Mapping[int, Floats]
    poses: Floats
    moments: Floats
    moves: Floats


def realise(
    path: Int32s,
    a: Posture,
    b: Posture,
    corpus: Corpus,
    grammar: Grammar,
    carriage: Carriage,
    fps: float,
    length: float | None = None,
    through: Mapping[int, Posture] = MappingProxyType({}),
    within: Floats | None = None,
) -> tuple[Motion, Ints]:
    """Return the motion from posture `a` to posture `b` in the moves of a path, on the body of `a`.

    Its first and last frames are `a` and `b`, exactly, and at the moves in `through` its joints and its facing are as
    in the postures there. Between them the body is, at the times of the moves, at the mean of all walks that the corpus
    knows from `a` to `b` in that time (`motionmind.realise.walks`); a C2 spline joins them, and fine detail of the
    corpus's recordings is added (`motionmind.realise.detail`). With `within`, walks count more the nearer they are to
    the path, and each joint is then brought into its state.

    Feet that stand carry the body; where none stands it travels as the corpus's bodies do, and it ends where `b`
    stands. The legs hold what one root cannot (`motionmind.realise.feet`), but not with `within`, which places them
    already. The lowest point stays as far above the floor as in the corpus's postures; the floor is at 0, or lower
    under ends that are lower, or higher under ends higher than the corpus knows of such postures.

    Args:
        path: states of the chains [T + 1, L].
        a: first posture.
        b: last posture.
        corpus: the movement that was learned from.
        grammar: what was learned of its states.
        carriage: how its bodies hold themselves, travel and stand.
        fps: frames a second; the whole is stretched by less than a frame so that `b` falls on one.
        length: duration, seconds, to which frames are fitted; None for as long as the corpus takes.
        through: postures on the way, by the number of moves that lead there, increasing.
        within: radians within which each joint is of its state at each move [J]; None for the mean of all walks,
            wherever the path goes.

    Returns:
        The motion, and the corpus's moves whose detail it has, one after another; none if the corpus keeps no detail.
    """
    if len(path) == 1:
        still = Motion(a.skeleton, a.rotations[None], a.root[None], np.zeros(1), "tween", (Insertion(np.zeros(1)),))
        return still, np.zeros(0, dtype=np.int64)
    clock = timeline(path, grammar.transitions, fps, length)
    postures = {0: a, **through, len(path) - 1: b}
    # A path may take more moves than there is time for; the corpus's walks are not to be hurried.
    count = len(path) - 1 if through or within is not None else clock.usual_moves
    walk = _mean_walk(path, clock, count, postures, corpus, grammar, carriage, within)
    headings = _headings(walk, path, clock, corpus, grammar, carriage, follow=within is not None)
    rotations = _orientations(walk, headings, clock, corpus)
    rotations, detailed = _add_detail(rotations, walk, clock, corpus, carriage)
    states = None if within is None else grammar.centres[grammar.transitions.starts[: path.shape[1]] + path]
    rotations = _limit(rotations, postures, None if states is None else corpus.from_chains(states), carriage.loose)

    # All heights are of the body of `a`, which the motion is on; `b` may have stood on shorter legs.
    size = a.skeleton.height / corpus.skeleton.height if corpus.skeleton.height > 0.0 else 1.0
    rotations, root = set_on_floor(
        a.skeleton,
        rotations,
        clock.frames,
        walk.half_steps,
        size * (walk.moments @ carriage.clearance),
        walk.moments @ carriage.stands,
        carriage.loose,
        _given_heights(walk.stops, postures),
        size * travel_along(walk.moves @ carriage.travel, headings),
        (a.root, b.root),
        plant=within is None,
    )
    return Motion(a.skeleton, rotations, root, clock.frames, "tween", (Insertion(clock.moves),)), detailed


def _mean_walk(
    path: Int32s,
    clock: Timeline,
    count: int,
    postures: Mapping[int, Posture],
    corpus: Corpus,
    grammar: Grammar,
    carriage: Carriage,
    within: Floats | None,
) -> _Walk:
    """Return the mean of walks in `count` moves through the postures, brought `within` the path's states if given.

    The facing's states are steps of a circle, which the corpus need not show: walks are of joints alone.
    """
    last, skeleton = len(path) - 1, postures[0].skeleton
    stops = {move: corpus.to_chains(posture.rotations) for move, posture in postures.items()}
    half_steps, centres = subdivide_times(clock.moves, 1), None
    if within is not None:
        joints = len(skeleton)
        centres = grammar.centres[grammar.transitions.starts[:joints] + path[:, :joints]]
    if count != last:
        half_steps = np.linspace(0.0, clock.moves[-1], 2 * count + 1)
        stops = {0: stops[0], count: stops[last]}
    poses, moments = mean_walk(skeleton, carriage, stops, half_steps, centres)
    if within is not None and centres is not None:
        inner = np.array([move for move in range(len(path)) if move not in stops], dtype=np.intp)
        poses[2 * inner] = _bring_near(poses[2 * inner], centres[inner], within)
    # Each half step leads to the middle of a move or from there.
    known = len(carriage.turn)
    moves = moments[:-1, -known:] + moments[1:, -known:]
    moves /= moves.sum(axis=1, keepdims=True)
    return _Walk(half_steps, stops, poses, moments, moves)


def _bring_near(poses: Floats, centres: Floats, within: Floats) -> Floats:
    """Return orientations [..., J, 4] moved the short way to at most `within` radians [J] from `centres`."""
    off = rot.angle(centres, poses)
    return np.where((off <= within)[..., None], poses, rot.slerp(centres, poses, within / np.maximum(off, 1e-9)))


def _headings(
    walk: _Walk, path: Int32s, clock: Timeline, corpus: Corpus, grammar: Grammar, carriage: Carriage, follow: bool
) -> Floats:
    """Return headings at the half steps [2 T + 1], radians: the path's if it is to `follow` it, else the walks'."""
    if corpus.facing != "free":
        return rot.heading(walk.poses[:, 0])
    facing = {move: chains[-1] for move, chains in walk.stops.items()}
    if follow:
        at_moves = turn_with_path(path[:, -1], grammar, np.diff(clock.moves), facing)
        return natural_spline(clock.moves, at_moves, walk.half_steps)
    turn, spread = walk.moves @ carriage.turn, walk.moves @ carriage.turn**2
    return turn_with_walks(turn, spread, walk.half_steps, facing)


def _orientations(walk: _Walk, headings: Floats, clock: Timeline, corpus: Corpus) -> Floats:
    """Return local rotations [N, J, 4] of the frames: a C2 curve through the walk's poses, turned to the headings."""
    chains = rotation_spline(walk.half_steps, walk.poses, clock.frames)
    if corpus.facing == "free":
        turn = rot.about_vertical(natural_spline(walk.half_steps, headings, clock.frames))
        chains = np.concatenate([chains, turn[:, None]], axis=1)
    return corpus.from_chains(chains)


def _add_detail(
    rotations: Floats, walk: _Walk, clock: Timeline, corpus: Corpus, carriage: Carriage
) -> tuple[Floats, Ints]:
    """Return rotations [N, J, 4] with the corpus's fine detail, and the moves that it comes from."""
    between = corpus.detail.shape[1]
    if not between:
        return rotations, np.zeros(0, dtype=np.int64)
    joints = walk.poses.shape[1]
    moves = likest_moves(corpus.moves, carriage.orientations[: len(corpus), :joints], walk.poses[::2])
    times = subdivide_times(walk.half_steps[::2], between)
    detail = natural_spline(times, detail_of(corpus, moves), clock.frames)
    return rot.mul(rotations, rot.exp(detail)), moves


def _limit(rotations: Floats, postures: Mapping[int, Posture], states: Floats | None, loose: Bools) -> Floats:
    """Return unit rotations [N, J, 4] within the joints' limits, exactly the first and last posture at their ends.

    Limits are widened to the postures, and to the path's `states` [T + 1, J, 4] if it is to be followed.
    """
    first, *_, last = postures.values()
    given = np.stack([posture.rotations for posture in postures.values()])
    if states is not None:
        given = np.concatenate([given, states])
    out = within_limits(first.skeleton, rot.normalise(rotations), given, loose)
    out[0], out[-1] = first.rotations, last.rotations
    return out


def _given_heights(stops: Mapping[int, Floats], postures: Mapping[int, Posture]) -> dict[int, float]:
    """Return the height of each given posture's lowest point, metres, by the number of moves that lead there."""
    first, *_ = postures.values()
    rotations = np.stack([posture.rotations for posture in postures.values()])
    roots = np.stack([posture.root for posture in postures.values()])
    return dict(zip(stops, lowest_height(first.skeleton, rotations, roots).tolist(), strict=True))
