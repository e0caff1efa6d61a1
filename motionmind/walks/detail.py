"""Fine detail of movement: motion between postures, restored from the corpus's recordings.

A movement that passes smoothly through a few postures a second is smoother than any that was recorded: the motion
between two postures is missing. It is copied from the corpus's moves that are most like those of the movement, in long
runs. All joints take it from the same move, for their motions within a fifth of a second belong together. A quiet
movement gets only some of the roughness of a lively move. A mean of walks is quieter than any of them, and legs that
step are not: so the rest of the body gets more of it, and moves in proportion to its legs.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.moves import Moves
from motionmind.geometry import rotations as rot
from motionmind.jit import jit, read_only
from motionmind.learned.carriage import Carriage
from motionmind.learned.nearest import postures_near
from motionmind.walks.steps import steps_at

GOES_OVER = 0.4  # radians a joint, root mean square: how much nearer another posture must be to leave a run for it
NEAREST = 48  # postures of a large corpus near every other of a movement's whose moves are looked at
BESIDE = 5  # moves before and after these
LEAVES = 32  # of the tree over a large corpus that are searched for them
# How many times as fast as a movement its copied moves may be before it gets less of their detail. Means of walks are
# slower than any movement that was recorded, mostly by less than this. Chosen on `indian` and `cmu-05`: at 3, movement
# of `cmu-05` is taken for the dancer's less often.
LIVELIER = 4.0
# How much more detail all joints but the legs' get, where a movement stands still beside what it copies; chosen on
# `cmu-05`.
MISSES = 0.6


def likest_moves(moves: Moves, orientations: Floats, poses: Floats, among: Ints | None = None) -> Ints:
    """Return the corpus's moves [T] that lead along a movement's postures, in long runs.

    They minimise the sum of d^2 over both ends of all moves, with d the distance from the movement's postures, radians,
    root mean square over the joints, plus 2 GOES_OVER^2 for each move that does not continue the one before it in the
    corpus's clip. Found by dynamic programming.

    Args:
        moves: the corpus's moves.
        orientations: of the corpus's postures, the joints' first [N, L, 4].
        poses: orientations of the movement's postures [T + 1, J, 4].
        among: numbers of the moves to choose from, rising [m] (`moves_near`); None for all.
    """
    some = moves if among is None else moves.take(among)
    if among is None:
        among, begins, ends = np.arange(len(moves)), moves.begins, moves.ends
        postures = np.arange(len(orientations))
    else:
        postures, which = np.unique([some.begins, some.ends], return_inverse=True)
        begins, ends = which.reshape(2, -1)
    shown = np.ascontiguousarray(poses.transpose(1, 2, 0))
    distances = _squared_distances(read_only(orientations), postures, shown).T / len(shown)
    cost = distances[:-1, begins] + distances[1:, ends]
    before = _predecessors(some, among)
    total, came_from = cost[0], []
    for step in cost[1:]:
        least = int(total.argmin())
        straight_on = np.where(before >= 0, total[before], np.inf)
        over = total[least] + 2.0 * GOES_OVER**2
        came_from.append(np.where(straight_on <= over, before, least))
        total = np.minimum(straight_on, over) + step
    out = [int(total.argmin())]
    for previous in reversed(came_from):
        out.append(int(previous[out[-1]]))
    return among[out[::-1]]


def moves_near(moves: Moves, carriage: Carriage, poses: Floats) -> Ints | None:
    """Return the corpus's moves near every other of a movement's postures [T + 1, J, 4], and those around them in the
    clips.

    None stands for all, of a corpus without trees.
    """
    if carriage.trees is None:
        return None
    count = len(carriage.weights) - len(carriage.turn)
    near = [
        postures_near(carriage.trees, carriage.orientations, pose, NEAREST, count, LEAVES)
        for pose in (*poses[:-1:2], poses[-1])
    ]
    leaving = steps_at(np.unique(np.concatenate(near)), True, carriage.begins, carriage.ends, count)[2]
    return np.unique(np.clip(leaving[:, None] + np.arange(-BESIDE, BESIDE + 1), 0, len(moves) - 1))


def detail_of(corpus: Corpus, moves: Ints) -> Floats:
    """Return the detail of some of the corpus's moves, one after another: rotation vectors [T (K + 1) + 1, J, 3].

    They are in radians, and 0 at the postures: the detail is continuous even where a move does not continue the one
    before it.

    Args:
        corpus: a corpus that keeps K frames of detail a move.
        moves: numbers of its moves [T].
    """
    some = corpus.moves.take(moves)
    begins, ends = some.begins, some.ends
    between = corpus.detail[np.minimum(begins, ends)].astype(np.float64)
    backward = ends < begins
    between[backward] = between[backward, ::-1]
    count, inner, joints, _ = between.shape
    out = np.zeros((count, inner + 1, joints, 3))
    out[:, 1:] = between
    return np.concatenate([out.reshape(-1, joints, 3), np.zeros((1, joints, 3))])


def share_of_detail(
    moves: Moves, orientations: Floats, copied: Ints, poses: Floats, seconds: Floats
) -> tuple[Floats, Floats]:
    """Return how much of the detail of copied moves a movement gets in each of its own: [T] and [T].

    The first is for the legs, which get all of it where the movement is at least a LIVELIER-th as fast as the move that
    is copied, and in proportion to its speed where it is slower. The second is for all others, which get more, by
    MISSES times the share of the speed that is missing. Speeds are the turns from end to end, root mean square over the
    joints, a second.

    Args:
        moves: the corpus's moves.
        orientations: of the corpus's postures [N, J, 4].
        copied: numbers of the moves that are copied [T].
        poses: orientations of the movement's postures [T + 1, J, 4].
        seconds: durations of the movement's moves [T].
    """
    speed = _turns(poses[:-1], poses[1:]) / seconds
    some = moves.take(copied)
    copied_speed = _turns(orientations[some.begins], orientations[some.ends]) / some.seconds
    relative = np.divide(speed, copied_speed, out=np.ones(len(copied)), where=speed < copied_speed)
    legs = np.minimum(LIVELIER * relative, 1.0)
    return legs, legs * (1.0 + MISSES * (1.0 - relative))


def _turns(a: Floats, b: Floats) -> Floats:
    """Return the angles from poses `a` to `b` [T, J, 4], radians, root mean square over the joints: [T]."""
    return np.asarray(np.sqrt(np.mean(rot.angle(a, b) ** 2, axis=-1)))


def _predecessors(some: Moves, among: Ints) -> Ints:
    """Return which of some moves, those of these numbers, precedes each in its clip [m], in the same direction of time;
    -1 for none of them.

    Moves are in the order of their clips; those backward in time follow on the ones after them.
    """
    begins, ends = some.begins, some.ends
    before = among + np.where(ends > begins, -1, 1)
    place = np.minimum(np.searchsorted(among, before), len(among) - 1)
    follows = (among[place] == before) & (ends[place] == begins)
    return np.where(follows, place, -1)


@jit
def _squared_distances(orientations: Floats, some: Ints, poses: Floats) -> Floats:
    """Return the squared distance of some of all `orientations` [N, L, 4] from each of poses [J, 4, T]: [n, T]."""
    out = np.zeros((len(some), poses.shape[2]))
    for i in range(len(some)):
        off = out[i]
        for j in range(len(poses)):
            x, y, z, w = orientations[some[i], j]
            for t in range(len(off)):  # side by side, so that several are measured at once; as `squared_turn`
                cosine = x * poses[j, 0, t] + y * poses[j, 1, t] + z * poses[j, 2, t] + w * poses[j, 3, t]
                off[t] += 4.0 * max(1.0 - cosine * cosine, 0.0)
    return out
