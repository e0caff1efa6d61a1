"""From a path of states to a motion: exact at both ends, smooth between, on its feet."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.body.limbs import parts_of
from motionmind.body.limits import within_limits
from motionmind.body.motion import Insertion, Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.corpus import Corpus, subdivide_times
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline, rotation_spline
from motionmind.grammar.grammar import Grammar
from motionmind.learned.carriage import Carriage
from motionmind.realise.detail import detail_of, likest_moves
from motionmind.realise.feet import plant_feet
from motionmind.realise.root import lowest, root_trajectory, stand
from motionmind.realise.timeline import durations
from motionmind.realise.walks import ENDS_WITHIN, FOLLOWS_WITHIN, mean_rotations, nearness, posterior_marginals

RUN = 1.0  # seconds for which a body that turns goes on turning


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
    """The motion from posture `a` to posture `b` in the moves of a path of states [T + 1, L], on the body of `a`.

    Its first and last frames are `a` and `b`, exactly, and at the moves that `through` names its joints and its facing
    are as in the postures there. Between them the body is, at the times of the moves, where the mean of all ways is
    that the corpus knows from `a` to `b` in that time (`motionmind.realise.walks`); a C2 spline joins them, and fine
    detail of the corpus's recordings is added to it (`motionmind.realise.detail`). With `within` ways count the more
    the nearer they are to the path, and each joint is then brought into its state.

    Feet that stand carry the body; where none does it travels as the corpus's bodies do, and it ends where `b` stands.
    What one root cannot hold the legs do (`motionmind.realise.feet`), but not with `within`, which says where they go.
    Its height keeps the lowest point as far above the floor as the corpus's postures have it; the floor is at 0, or
    lower under ends that are, or higher under ends that the corpus knows no such height of.

    Args:
        path: states of the chains.
        a: first posture.
        b: last posture.
        corpus: the movement that was learned from.
        grammar: what was learned.
        carriage: how its bodies hold themselves, travel and stand.
        fps: frames a second; the whole is stretched by less than a frame so that `b` falls on one.
        length: seconds that it lasts, to which frames are fitted; None for as long as the corpus takes.
        through: postures on the way, by the number of moves that lead there, increasing.
        within: radians within which each joint is of its state at each move [J]; None for the mean of all ways,
            wherever the path goes.

    Returns:
        The motion, and the corpus's moves whose detail it has, one after another; none where the corpus keeps none.
    """
    detailed = np.zeros(0, dtype=np.int64)
    if len(path) == 1:
        still = Motion(a.skeleton, a.rotations[None], a.root[None], np.zeros(1), "tween", (Insertion(np.zeros(1)),))
        return still, detailed
    keys, times, count = _clock(path, grammar, fps, length)

    # The facing's states are steps of a circle, which the corpus need not show: its chain has no ways but turns.
    joints = len(a.skeleton)
    postures = {0: a, **through, len(path) - 1: b}
    stops = {move: corpus.to_chains(posture.rotations) for move, posture in postures.items()}
    centres = grammar.centres[grammar.transitions.starts[:joints] + path[:, :joints]]
    halves = subdivide_times(keys, 1)
    if within is None and not through and count != len(path) - 1:
        # A path may take more moves than there is time for; the corpus's ways are not to be hurried.
        halves = np.linspace(0.0, keys[-1], 2 * count + 1)
        stops = {0: stops[0], count: stops[len(path) - 1]}
    poses, stance = _mean_walk(a.skeleton, carriage, stops, halves, None if within is None else centres)
    if within is not None:
        inner = np.array([move for move in range(len(path)) if move not in stops], dtype=np.intp)
        poses[2 * inner] = _brought(poses[2 * inner], centres[inner], within)
    rotations = rotation_spline(halves, poses, times)
    # Each step leads to the middle of a move or from there.
    steps = stance[:-1, -len(carriage.turn) :] + stance[1:, -len(carriage.turn) :]
    steps /= steps.sum(axis=1, keepdims=True)
    if corpus.facing == "free":
        facing = {move: chains[-1] for move, chains in stops.items()}
        if within is None:
            headings = _turning(steps @ carriage.turn, steps @ carriage.turn**2, halves, facing)
        else:
            headings = natural_spline(keys, _headings(path[:, -1], grammar, np.diff(keys), facing), halves)
        turn = rot.about_vertical(natural_spline(halves, headings, times))
        rotations = np.concatenate([rotations, turn[:, None]], axis=1)
    else:
        headings = rot.heading(poses[:, 0])
    rotations = corpus.from_chains(rotations)
    between = corpus.detail.shape[1]
    if between:
        detailed = likest_moves(corpus.moves, carriage.orientations[: len(corpus), :joints], poses[::2])
        detail = natural_spline(subdivide_times(halves[::2], between), detail_of(corpus, detailed), times)
        rotations = rot.mul(rotations, rot.exp(detail))
    given = np.stack([posture.rotations for posture in postures.values()])
    if within is not None:
        states = grammar.centres[grammar.transitions.starts[: path.shape[1]] + path]
        given = np.concatenate([given, corpus.from_chains(states)])
    rotations = within_limits(a.skeleton, rot.normalise(rotations), given, carriage.loose)
    rotations[0], rotations[-1] = a.rotations, b.rotations

    # All heights are of the body of `a`, which the motion is on; `b` may have stood on shorter legs.
    size = a.skeleton.height / corpus.skeleton.height if corpus.skeleton.height > 0.0 else 1.0
    low = lowest(a.skeleton, given[: len(postures)], np.stack([posture.root for posture in postures.values()])).tolist()
    rotations, root = _on_feet(
        a.skeleton,
        rotations,
        times,
        halves,
        size * (stance @ carriage.clearance),
        stance @ carriage.stands,
        carriage.loose,
        dict(zip(stops, low, strict=True)),
        size * _drift(steps @ carriage.travel, headings),
        (a.root, b.root),
        planted=within is None,
    )
    return Motion(a.skeleton, rotations, root, times, "tween", (Insertion(keys),)), detailed


def _clock(path: Int32s, grammar: Grammar, fps: float, length: float | None) -> tuple[Floats, Floats, int]:
    """Times of a path's moves [T + 1], and of as many frames at about `fps` as they take, or as `length` seconds do;
    and how many moves the corpus makes in that time."""
    seconds = durations(path, grammar.transitions)
    usually = float(seconds.sum())
    frames = max(1, round((length or usually) * fps))
    length = length or frames / fps
    keys = np.concatenate([[0.0], np.cumsum(seconds * (length / usually))])
    times = np.linspace(0.0, length, frames + 1)
    keys[-1] = length
    return keys, times, max(1, round(len(seconds) * length / usually))


def _on_feet(
    skeleton: Skeleton,
    rotations: Floats,
    times: Floats,
    halves: Floats,
    heights: Floats,
    stands: Floats,
    loose: Bools,
    low: Mapping[int, float],
    drift: Floats,
    ends: tuple[Floats, Floats],
    planted: bool,
) -> tuple[Floats, Floats]:
    """A movement that feet carry: its local rotations [N, J, 4] and the positions of its root [N, 3].

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        times: of the frames [N], seconds.
        halves: of the steps [2 T + 1].
        heights: of the lowest point above the floor at the steps [2 T + 1], metres.
        stands: how much each limb, and last the trunk, stands where it is low, at the steps [2 T + 1, limbs + 1].
        loose: joints without limits [J].
        low: the same as `heights` above 0 at those moves where postures are given; the first and the last among them.
        drift: how far the root goes in each step as the corpus's bodies travel [2 T, 3].
        ends: the first and the last position of the root [3].
        planted: whether the legs may move, so that feet stay.
    """
    given = 2 * np.array(list(low))
    # A recording's own zero is often off: where the ends are lower so is their floor, and where they are higher than
    # bodies that stand so are in the corpus.
    ends_low = np.array([low[0], low[given[-1] // 2]])
    floor = np.interp(halves, halves[[0, -1]], np.maximum(np.minimum(ends_low, 0.0), ends_low - heights[[0, -1]]))
    heights = heights + floor
    heights[given] = list(low.values())
    heights = _eased(halves, heights, times)
    clear = np.maximum(heights - np.interp(times, halves, floor), 0.0)
    places = np.concatenate([np.zeros((1, 3)), np.cumsum(drift, axis=0)])
    middles = 0.5 * (times[1:] + times[:-1])
    held = np.stack([np.interp(middles, halves, limb) for limb in stands.T], axis=1)
    root = root_trajectory(
        skeleton, rotations, clear, held, np.diff(natural_spline(halves, places, times), axis=0), *ends
    )
    if planted:
        fps = 1.0 / (times[1] - times[0])
        rotations, root = plant_feet(skeleton, rotations, root, heights, clear, held, loose, fps, fps * halves[given])
    else:
        root = stand(skeleton, rotations, root, heights)
    root[0], root[-1] = ends
    return rotations, root


def _mean_walk(
    skeleton: Skeleton, carriage: Carriage, stops: Mapping[int, Floats], halves: Floats, path: Floats | None
) -> tuple[Floats, Floats]:
    """Mean orientations [2 T + 1, J, 4] of the ways from each of `stops` to the next, near `path` [T + 1, J, 4] if
    given; and how likely the body is carried as in each of the corpus's moments [2 T + 1, N].

    Ways of parts of all sizes count alike; the body is carried by the ways of the whole and of what carries it. The
    mean's ends are near the stops but not there: what they are off by is taken off along the way in proportion to the
    times of the steps [2 T + 1].
    """
    joints, known = len(skeleton), len(carriage.weights)
    poses, stance = np.empty((len(halves), joints, 4)), np.empty((len(halves), known))
    parts = parts_of(skeleton)
    # Joints that are in the same part of each size.
    together: dict[tuple[int, ...], list[int]] = {}
    for joint in range(joints):
        together.setdefault(tuple(n for n, part in enumerate(parts) if joint in part), []).append(joint)
    shared = {number for numbers in together for number in numbers[:-1]}
    for start, end in pairwise(stops):
        here, ends = slice(2 * start, 2 * end + 1), np.stack([stops[start], stops[end]])[:, :joints]
        share = ((halves[here] - halves[2 * start]) / (halves[2 * end] - halves[2 * start]))[:, None]
        straight = rot.slerp(ends[:1], ends[1:], share)
        ways: dict[int, Floats] = {}
        sums: dict[tuple[int, ...], Floats] = {}
        for number, part in enumerate(parts):
            shown = np.ascontiguousarray(carriage.orientations[:, part])
            near = np.ones((len(share), known))
            if path is not None and end > start + 1:
                near[2:-2:2] = [nearness(shown, posture, FOLLOWS_WITHIN) for posture in path[start + 1 : end, part]]
            near[0], near[-1] = (nearness(shown, posture, ENDS_WITHIN) for posture in ends[:, part])
            near[0] *= carriage.weights
            kinds = np.ascontiguousarray(carriage.kinds[:, number])
            ways[number] = posterior_marginals(carriage.begins, carriage.ends, carriage.shares, kinds, near)
            for numbers, some in together.items():
                if numbers[-1] != number:
                    continue
                about = np.ascontiguousarray(straight[:, some])
                shown = np.ascontiguousarray(carriage.orientations[:, some])
                if numbers[:-1] not in sums:
                    sums[numbers[:-1]] = np.sum([ways[n] for n in numbers[:-1]], axis=0)
                mean = mean_rotations((sums[numbers[:-1]] + ways[number]) / len(numbers), shown, about)
                off = rot.log(rot.inv_mul(about, mean))
                off -= (1.0 - share)[..., None] * off[:1] + share[..., None] * off[-1:]
                poses[here, some] = rot.mul(about, rot.exp(off))
            if number not in shared:
                del ways[number]  # those of a large corpus are large
        stance[here] = 0.5 * (ways[0] + ways[1])
    for move, chains in stops.items():
        poses[2 * move] = chains[:joints]
    return poses, stance


def _brought(poses: Floats, centres: Floats, within: Floats) -> Floats:
    """Orientations [..., J, 4] brought to within so many radians [J] of `centres`, the short way."""
    off = rot.angle(centres, poses)
    return np.where((off <= within)[..., None], poses, rot.slerp(centres, poses, within / np.maximum(off, 1e-9)))


def _turning(turn: Floats, spread: Floats, halves: Floats, facing: Mapping[int, Floats]) -> Floats:
    """Headings in radians [2 T + 1], unwrapped, at `halves` that are `facing`'s at its moves.

    Ways turn by `turn` [2 T] in each step, with mean squares `spread`. The less sure they are to which side they turn
    on the whole, the less of it is done: M^2 / (M^2 + V) of turns that add up to M with variance V, the linear estimate
    of least mean square error. Ways that turn do so for about RUN seconds, so that V is of steps that vary together for
    as long. What is missing to B is made up by the steps in proportion to how much their turns vary, as the mean of
    normal variables under a condition on their sum; of all that differ by whole turns the nearest is meant.
    """
    varies = np.maximum(spread - turn**2, 1e-4)
    variance = varies.sum() * RUN * len(turn) / (halves[-1] - halves[0])
    turn = turn * (turn.sum() ** 2 / (turn.sum() ** 2 + variance))
    out = np.concatenate([[0.0], np.cumsum(turn)]) + rot.heading(facing[0])
    for start, end in pairwise(2 * move for move in facing):
        missing = rot.heading(facing[end // 2]) - out[end]
        missing -= 2.0 * np.pi * np.round(missing / (2.0 * np.pi))
        share = np.cumsum(varies[start:end]) / varies[start:end].sum()
        out[start + 1 : end + 1] += missing * share
        out[end + 1 :] += missing
    return out


def _drift(travel: Floats, headings: Floats) -> Floats:
    """How far the root goes in each step [2 T, 3], level, by its `travel` in the body's own heading midway [2 T, 3]."""
    along = rot.mul_vec(rot.about_vertical(0.5 * (headings[1:] + headings[:-1])), travel)
    return np.asarray(along * np.array([1.0, 0.0, 1.0]))


def _headings(path: Int32s, grammar: Grammar, seconds: Floats, stops: Mapping[int, Floats]) -> Floats:
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
