"""Rows of a root's trajectory: the terms of its least-squares problem that say what bears the body, and how it moves.

Rows about legs that are too short, parts in the floor and hurry hold near a trajectory, and are made again in each
round (`motionmind.footing.carrying`). Standard deviations say what is worth what; they were chosen on cmu-05 and
ballet.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.skeleton import Skeleton
from motionmind.footing.bearing import Bearing, Shape
from motionmind.footing.departures import SETTLES
from motionmind.footing.feet import Foot
from motionmind.footing.knees import bend_of
from motionmind.footing.least_squares import Rows, difference_rows
from motionmind.footing.legs import SOFT
from motionmind.geometry.single import length as length_of
from motionmind.geometry.single import vector
from motionmind.jit import jit

HEIGHT = 0.01, 0.2  # metres that a standing leg gives or takes, and where it may bend for a jump
RIGID = 0.004  # metres that a part which is no foot is off the floor
REACH = 0.002  # metres by which a leg is too short
LEANS = 0.08  # metres that a leg leans more than the movement has it when it may not be straight
PLACE = 0.08  # metres that a standing leg leans more than the movement has it
KNEE = 0.15  # radians that a standing leg's knee bends more or less than the movement has it; chosen on cmu-05
STRAIGHT = 0.15  # radians: a knee that is straighter counts as bent so far, for it turns a leg's length into any bend
PRIOR = 0.3  # metres off the trajectory that feet have the root on by themselves
TRAVEL = 0.3, 0.03  # metres a second off that, where feet alone bear, and where other parts do
PUSH = 2.0  # metres a second squared: accelerations of the centre of mass
HURRY = 0.018  # metres a second by which a body travels faster than it may; chosen on cmu-05, 0.02, and with SLIDES
JERKS = 0.2  # metres a second squared by which it is accelerated level more than it may; chosen on cmu-16
NEARLY = 0.9  # of that speed, or acceleration: from here on it is held to it
BENDS, LEAVES, ARRIVES = (1.0, -2.0, 1.0), (-1.0, 1.0, 0.0), (0.0, -1.0, 1.0)  # of three frames' places


def prior_rows(prior: Floats, bearing: Bearing, fps: float) -> list[Rows]:
    """Return rows for being, and moving, as on the trajectory that feet have the root on by themselves [N, 3]."""
    count = len(prior)
    rests = np.minimum(bearing.others.max(axis=1, initial=0.0), 1.0)
    share = 0.5 * (rests[1:-1] + rests[:-2])
    travel = (1.0 - share) * TRAVEL[0] ** -2.0 + share * TRAVEL[1] ** -2.0
    rows = []
    for axis in (0, 2):
        rows.append(_axis_rows(axis, prior[:, axis], np.full(count, PRIOR**-2.0)))
        rows.append(difference_rows(axis, (-fps, fps, 0.0), fps * np.diff(prior[:-1, axis]), travel))
    return rows


def hurry_rows(root: Floats, travels: float, freedom: Floats, fps: float) -> Rows:
    """Return rows that slow a root [N, 3] down where it is about to travel faster than it may, metres a second.

    For a flight, where legs are free [N], it may.
    """
    # Rows look at three frames: each at its first two, and the last one at its last two.
    first = np.minimum(np.arange(len(root) - 1), len(root) - 3)
    return Rows(first, *_hurry_rows(root, first, travels, freedom, fps))


@jit
def _hurry_rows(
    root: Floats, first: Ints, travels: float, freedom: Floats, fps: float
) -> tuple[Floats, Floats, Floats]:
    """Return the coefficients [N - 1, 9], targets and weights of rows that begin with the `first` frames [N - 1]."""
    coefficients, weights = np.zeros((len(first), 9)), np.zeros(len(first))
    for t in range(len(first)):
        x, z = fps * (root[t + 1, 0] - root[t, 0]), fps * (root[t + 1, 2] - root[t, 2])
        speed = np.sqrt(x * x + z * z)
        if speed > NEARLY * travels:
            weights[t] = (1.0 - freedom[t]) * HURRY**-2.0
            for k, way in ((0, x), (2, z)):
                along, at = way / max(speed, 1e-9), 3 * (t - first[t]) + k
                coefficients[t, at], coefficients[t, at + 3] = -fps * along, fps * along
    return coefficients, np.full(len(first), min(travels, 1e3)), weights


def jerk_rows(root: Floats, pushes: float, freedom: Floats, fps: float) -> Rows:
    """Return rows that spread out the level accelerations of a root [N, 3] that are about to be greater than they may,
    metres a second squared.

    What bears a body, and its balance, may be had for one great jolt, as of who runs and is to stand: smooth rows weigh
    it against all that comes after. Where legs are free [N], for a flight, they push as it takes.
    """
    return Rows(np.arange(len(root) - 2), *_jerk_rows(root, pushes, freedom, fps))


@jit
def _jerk_rows(root: Floats, pushes: float, freedom: Floats, fps: float) -> tuple[Floats, Floats, Floats]:
    """Return the coefficients [N - 2, 9], targets and weights of rows of three frames each."""
    coefficients, weights = np.zeros((len(root) - 2, 9)), np.zeros(len(root) - 2)
    for t in range(len(weights)):
        bend = fps**2 * (root[t] - 2.0 * root[t + 1] + root[t + 2])
        size = length_of((bend[0], 0.0, bend[2]))
        if size > NEARLY * pushes:
            weights[t] = (1.0 - max(freedom[t], freedom[t + 1], freedom[t + 2])) * JERKS**-2.0
            for k in (0, 2):
                for frame, factor in enumerate((1.0, -2.0, 1.0)):
                    coefficients[t, 3 * frame + k] = fps**2 * factor * bend[k] / size
    return coefficients, np.full(len(weights), min(pushes, 1e3)), weights


def smooth_rows(prior: Floats, mass: Floats, fps: float, vertical: float) -> Rows:
    """Return rows for the accelerations of the centre of mass, `mass` [N, 3] relative to the root.

    At the ends the root is to move as on the trajectory that feet have it on by themselves [N, 3].
    """
    last = len(prior) - 3
    first, coefficients, weights = _smooth_rows(len(prior), fps, vertical)
    targets, leaves, arrives = np.empty((3, len(prior))), np.array(LEAVES), np.array(ARRIVES)
    targets[:, :-2] = -(fps**2) * np.diff(mass, 2, axis=0).T
    for axis in range(3):
        targets[axis, -2:] = prior[:3, axis] @ (fps**2 * leaves), prior[last:, axis] @ (fps**2 * arrives)
    return Rows(first, coefficients, targets.reshape(-1), weights)


@lru_cache(maxsize=64)
def _smooth_rows(count: int, fps: float, vertical: float) -> tuple[Ints, Floats, Floats]:
    """Return the frames that `smooth_rows` of so many begin with, their coefficients and their weights."""
    coefficients, weights = np.zeros((3, count, 9)), np.empty((3, count))
    for axis, share in enumerate((1.0, vertical, 1.0)):
        of_axis = coefficients[axis, :, axis::3]
        of_axis[:-2], of_axis[-2], of_axis[-1] = (fps**2 * np.array(shares) for shares in (BENDS, LEAVES, ARRIVES))
        weights[axis] = share * PUSH**-2.0
    return np.tile([*range(count - 2), 0, count - 3], 3), coefficients.reshape(-1, 9), weights.reshape(-1)


def standing_rows(shape: Shape, bearing: Bearing, floor: Floats, freedom: Floats) -> list[Rows]:
    """Return rows for what bears to be on the floor, and for standing legs not to lean elsewhere."""
    rows = []
    height = (HEIGHT[0] ** (1.0 - freedom) * HEIGHT[1] ** freedom) ** -2.0
    for number in range(shape.low.shape[1]):
        load = bearing.loads[:, number]
        rows.append(_axis_rows(1, floor - shape.low[:, number], load * height))
        firmly = load * PLACE**-2.0
        rows += [_axis_rows(axis, bearing.targets[:, number, axis // 2], firmly) for axis in (0, 2)]
    for part in np.flatnonzero(np.isfinite(shape.low_others[0])):
        rows.append(_axis_rows(1, floor - shape.low_others[:, part], bearing.others[:, part] * RIGID**-2.0))
    # Where nothing bears, or hardly, the lowest point is near the floor.
    rows.append(_axis_rows(1, floor - shape.lowest, np.full(len(floor), 0.01) * height))
    return rows


def sunk_rows(shape: Shape, floor: Floats, root: Floats) -> Rows:
    """Return rows that lift parts other than feet out of the floor, where the root [N, 3] has them in it."""
    height = floor - shape.low_others.min(axis=1, initial=np.inf)
    sunk = root[:, 1] < height
    return _axis_rows(1, np.where(sunk, height, 0.0), np.where(sunk, RIGID**-2.0, 0.0))


def reach_rows(legs: tuple[Floats, Floats], bearing: Bearing, root: Floats, bones: Floats, fps: float) -> Rows:
    """Return rows that bring the root [N, 3] near enough to feet that stand farther than their legs reach.

    A leg may be as long as the movement has it; leaning elsewhere, not quite straight.

    Args:
        legs: those in the movement, and as long as they must be, as `legs_to_places` returns them.
        bearing: what bears it.
        root: positions of the root [N, 3], metres.
        bones: lengths of the legs' thighs and shanks [feet, 2], metres.
        fps: frames a second.
    """
    lengths, every = bones.sum(axis=1), np.tile(np.arange(len(root)), len(bones))
    return Rows(every, *_reach_rows(*legs, bearing.targets, bearing.stands, root, lengths, SETTLES * fps))


@jit
def _reach_rows(
    own: Floats, legs: Floats, targets: Floats, stands: Bools, root: Floats, lengths: Floats, settles: float
) -> tuple[Floats, Floats, Floats]:
    """Return the coefficients [feet N, 9], targets and weights of rows, foot by foot, of legs of such lengths, metres.

    In the first and the last frames, which they settle in, rows have less weight.
    """
    count = len(root)
    rows = len(legs) * count
    coefficients, aims, weights = np.zeros((rows, 9)), np.zeros(rows), np.zeros(rows)
    for foot in range(len(legs)):
        length = lengths[foot]
        for t in range(count):
            row = foot * count + t
            x, z = targets[t, foot, 0] - root[t, 0], targets[t, foot, 1] - root[t, 2]
            bent = SOFT * min((x * x + z * z) / LEANS**2, 1.0)
            was, far = length_of(vector(own[foot, t])), length_of(vector(legs[foot, t]))
            longest = length * max(min(was / length, 1.0 - bent), 1.0 - SOFT)
            if far > longest + 1e-6 and stands[t, foot]:
                aims[row] = _write_along(legs[foot, t], far, 1.0, root[t], coefficients[row]) + far - longest
                weights[row] = (min(min(t, count - 1 - t) / settles, 1.0) / REACH) ** 2
    return coefficients, aims, weights


@jit
def _write_along(leg: Floats, far: float, times: float, root: Floats, coefficients: Floats) -> float:
    """Write the coefficients [9] of a root's place along a leg [3] that is so `far`, metres, so many `times`: return
    what they are of a root [3]."""
    total = 0.0
    for k in range(3):
        coefficients[k] = times * leg[k] / max(far, 1e-9)
        total += coefficients[k] * root[k]
    return total


def knee_rows(legs: tuple[Floats, Floats], bearing: Bearing, root: Floats, bones: Floats, freedom: Floats) -> Rows:
    """Return rows that let the knees of standing legs bend as the movement has them: arguments as for `reach_rows`.

    A leg that is all but straight bends its knee by much for a little of its length; the root goes along with it
    then, as a body goes over a leg that it stands on. Where the legs are free, for a flight, they bend for that.
    """
    every = np.tile(np.arange(len(root)), len(bones))
    return Rows(every, *_knee_rows(*legs, bearing.loads, root, freedom, bones))


@jit
def _knee_rows(
    own: Floats, legs: Floats, loads: Floats, root: Floats, freedom: Floats, bones: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the coefficients [feet N, 9], targets and weights of rows, foot by foot, of legs with bones of these
    lengths [feet, 2], metres."""
    count = len(root)
    rows = len(legs) * count
    coefficients, aims, weights = np.zeros((rows, 9)), np.empty(rows), np.empty(rows)
    for foot in range(len(legs)):
        thigh, shank = bones[foot]
        for t in range(count):
            row = foot * count + t
            was, far = length_of(vector(own[foot, t])), length_of(vector(legs[foot, t]))
            bend = max(0.5 * (bend_of(was, thigh, shank) + bend_of(far, thigh, shank)), STRAIGHT)
            lever = far / (thigh * shank * np.sin(bend))  # radians that the knee bends a metre of the leg's length
            aims[row] = _write_along(legs[foot, t], far, lever, root[t], coefficients[row]) + lever * (far - was)
            weights[row] = loads[t, foot] * (1.0 - freedom[t]) * KNEE**-2.0
    return coefficients, aims, weights


def legs_of(skeleton: Skeleton, places: Floats, feet: list[Foot]) -> Floats:
    """Return legs from hip to end [feet, N, 3], metres, from places of joints and tips [N, 2 J, 3]."""
    out = np.empty((len(feet), len(places), 3))
    for number, foot in enumerate(feet):
        hip, _, end = foot.chain(skeleton)
        np.subtract(places[:, end], places[:, hip], out=out[number])
    return out


def legs_to_places(own: Floats, shape: Shape, bearing: Bearing, floor: Floats, root: Floats) -> tuple[Floats, Floats]:
    """Return the legs from hip to end [feet, N, 3], metres, in the movement, and where their feet have their places.

    Args:
        own: the legs in the movement.
        shape: the body.
        bearing: what bears it.
        floor: height of the floor [N], metres.
        root: positions of the root [N, 3], metres.
    """
    legs = own - root
    legs[..., ::2] += bearing.targets.swapaxes(0, 1)
    legs[..., 1] += floor - shape.low.T
    return own, legs


def _axis_rows(axis: int, targets: Floats, weights: Floats) -> Rows:
    """Return rows for one coordinate of a trajectory in all its frames: targets [N], weights [N]."""
    return Rows(*_one_coordinate(axis, len(targets)), targets, weights)


@lru_cache(maxsize=64)
def _one_coordinate(axis: int, count: int) -> tuple[Ints, Floats]:
    """Return what rows for one coordinate in so many frames begin with [count], and their coefficients [count, 9]."""
    coefficients = np.zeros((count, 9))
    coefficients[:, axis] = 1.0
    return np.arange(count), coefficients
