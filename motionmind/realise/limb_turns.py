"""Turns of limbs that are in each other: planes to pass each other on either side of, and the least turns for it.

For `motionmind.realise.limbs_apart`, which says in what order, how smoothly, and where feet then stand.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.capsules import radius_at
from motionmind.geometry.segments import nearest_points
from motionmind.jit import jit

LEAST = 1e-3  # metres that are not corrected
LEVER = 0.1  # metres: touched so near to its joint, a limb turns half as far as it would have to
MOST = 0.3  # radians that a limb turns in one correction


class Limbs(NamedTuple):
    """The limbs of a person that turn about their first joints: left and right leg, left and right arm.

    Attributes:
        first: the joint that each turns about [4].
        last: the joint that keeps its orientation, a leg's ankle; an arm has its first joint here [4].
        owner: the limb that each capsule belongs to, -1 for trunk and head [C].
        carried: whether it belongs to what keeps its orientation: foot and toes [C].
    """

    first: Ints
    last: Ints
    owner: Ints
    carried: Bools


class Placed(NamedTuple):
    """A movement's limbs in the world, the root being in the origin; metres.

    Attributes:
        ends: of the capsules' axes [N, C, 2, 3].
        pivots: places of the limbs' first joints [N, 4, 3].
        anchors: places of their last [N, 4, 3].
        held: how firmly each limb stands where a given posture has it [N, 4], from 0 to 1.
    """

    ends: Floats
    pivots: Floats
    anchors: Floats
    held: Floats


@jit
def planes_between(inside: Bools, directions: Floats, pairs: Ints, owner: Ints, pivots: Floats) -> Floats:
    """Return normals of the planes that keep pairs apart, towards the first [N, P, 3]; 0 where no plane is needed.

    Args:
        inside: whether the pair is too deep in each other [N, P].
        directions: of the first from the second [N, P, 3].
        pairs: numbers of capsules [P, 2].
        owner: the limb that each capsule belongs to, or -1 [C].
        pivots: of the limbs [N, 4, 3], metres.
    """
    sides = np.zeros_like(directions)
    for p in range(len(pairs)):
        one, other = owner[pairs[p, 0]], owner[pairs[p, 1]]
        end = 0
        for begin in range(len(inside)):
            if begin < end or not inside[begin, p]:
                continue
            end = begin
            while end < len(inside) and inside[end, p]:
                end += 1
            before, after = max(begin - 1, 0), min(end, len(inside) - 1)
            meet, part = directions[before, p], directions[after, p]
            opposite = 1.0 - np.sum(meet * part)  # 0 where they meet and part on the same side, 2 on opposite ones
            for t in range(begin, end):
                share = (t - before) / max(after - before, 1)
                side = (1.0 - share) * meet + share * part
                if other >= 0:
                    across = pivots[t, one] - pivots[t, other]
                    side += 2.0 * share * (1.0 - share) * opposite * across / np.sqrt(np.sum(across**2))
                sides[t, p] = side / max(np.sqrt(np.sum(side**2)), 1e-9)
    return sides


@jit
def is_any_deeper(ends: Floats, radii: Floats, pairs: Ints, allowed: Floats) -> bool:
    """Return whether a pair of capsules is deeper in each other than allowed, by more than LEAST.

    Args:
        ends: of the capsules' axes [N, C, 2, 3], metres.
        radii: at both ends [C, 2], metres.
        pairs: numbers of capsules [P, 2].
        allowed: how deep each pair may be in each other [N, P], metres, at least 0.
    """
    middles, spans = np.empty((len(radii), 3)), np.empty(len(radii))
    for t in range(len(ends)):
        _enclose(ends[t], radii, middles, spans)
        for p in range(len(pairs)):
            i, j = pairs[p]
            if _apart(middles[i], middles[j]) <= spans[i] + spans[j]:
                gap, s, u = nearest_points(ends[t, i], ends[t, j])
                if radius_at(radii[i], s) + radius_at(radii[j], u) - gap > allowed[t, p] + LEAST:
                    return True
    return False


def least_turns(
    placed: Placed, limbs: Limbs, radii: Floats, pairs: Ints, allowed: Floats, sides: Floats
) -> tuple[Floats, Floats]:
    """Return how deep limbs are that have to turn [N, 4], metres, and the least rotation vectors for it [N, 4, 3].

    Of several pairs that a limb is in, the deepest counts. Where a pair has a plane, its ends are to be on either side
    of it; elsewhere its nearest points are to move apart. Pairs that are apart stay as they are.

    Args:
        placed: the limbs as they are.
        limbs: which limbs there are.
        radii: of the capsules [C, 2], metres.
        pairs: numbers of capsules [P, 2].
        allowed: how deep each pair may be in each other [N, P], metres.
        sides: normals of planes, 0 where there is none [N, P, 3].
    """
    return _least_turns(*placed, limbs.owner, limbs.carried, radii, pairs, allowed, sides)


@jit
def _least_turns(
    ends: Floats,
    pivots: Floats,
    anchors: Floats,
    firmly: Floats,
    owner: Ints,
    carried: Bools,
    radii: Floats,
    pairs: Ints,
    allowed: Floats,
    sides: Floats,
) -> tuple[Floats, Floats]:
    """Return what `least_turns` does, of the arrays in its arguments: named tuples take numba long to tell apart."""
    count = len(ends)
    deep, steps = np.zeros((count, 4)), np.zeros((count, 4, 3))
    points, levers, gives = np.empty((2, 3)), np.empty((2, 3)), np.empty(2, np.bool_)
    middles, spans = np.empty((len(radii), 3)), np.empty(len(radii))
    for t in range(count):
        worst = np.zeros(4)
        _enclose(ends[t], radii, middles, spans)
        for p in range(len(pairs)):
            if _apart(middles[pairs[p, 0]], middles[pairs[p, 1]]) > spans[pairs[p, 0]] + spans[pairs[p, 1]]:
                continue
            one, other = ends[t, pairs[p, 0]], ends[t, pairs[p, 1]]
            gap, s, u = nearest_points(one, other)
            reach = radius_at(radii[pairs[p, 0]], s) + radius_at(radii[pairs[p, 1]], u)
            depth = reach - gap - allowed[t, p]
            if depth <= LEAST:
                continue
            side = sides[t, p]
            points[0] = one[0] + s * (one[1] - one[0])
            points[1] = other[0] + u * (other[1] - other[0])
            if side[0] != 0.0 or side[1] != 0.0 or side[2] != 0.0:
                ahead, behind = _along(one, side), _along(other, side)
                points[0], points[1] = one[ahead.argmin()], other[behind.argmax()]
                gap = ahead.min() - behind.max()
            else:
                side = (points[0] - points[1]) / max(gap, 1e-9)
            excess = reach - gap - allowed[t, p]
            size = LEVER**2
            for k in range(2):
                limb, against = owner[pairs[p, k]], owner[pairs[p, 1 - k]]
                gives[k] = limb > 1 or (limb >= 0 and against < 2)  # a leg does not give way to an arm
                if not gives[k]:
                    continue
                touched = anchors[t, limb] if carried[pairs[p, k]] else points[k]
                lever = np.cross(touched - pivots[t, limb], side) * (1.0 - 2.0 * k)
                axis = anchors[t, limb] - pivots[t, limb]
                along = np.sum(lever * axis) / max(np.sum(axis**2), 1e-9) * axis
                held = firmly[t, limb]
                levers[k] = (1.0 - held) * lever + held * along
                size += np.sum(lever * levers[k])
            for k in range(2):
                limb = owner[pairs[p, k]]
                if not gives[k]:
                    continue
                deep[t, limb] = max(deep[t, limb], depth)
                if excess > worst[limb]:
                    worst[limb] = excess
                    step = levers[k] * excess / size
                    steps[t, limb] = step * min(1.0, MOST / max(np.sqrt(np.sum(step**2)), 1e-9))
    return deep, steps


@jit
def _enclose(ends: Floats, radii: Floats, middles: Floats, spans: Floats) -> None:
    """Write the middles [C, 3] and radii [C], metres, of balls around capsules with these ends [C, 2, 3]."""
    for c in range(len(ends)):
        for k in range(3):
            middles[c, k] = 0.5 * (ends[c, 0, k] + ends[c, 1, k])
        spans[c] = 0.5 * _apart(ends[c, 0], ends[c, 1]) + max(radii[c, 0], radii[c, 1])


@jit
def _apart(one: Floats, other: Floats) -> float:
    """Return how far two points [3] are from each other, metres."""
    x, y, z = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    return float(np.sqrt(x * x + y * y + z * z))


@jit
def _along(ends: Floats, direction: Floats) -> Floats:
    """Return how far two points [2, 3] lie along a direction [3]: [2]."""
    out = np.zeros(2)
    for end in range(2):
        for k in range(3):
            out[end] += ends[end, k] * direction[k]
    return out


def turn(placed: Placed, limbs: Limbs, turns: Floats) -> None:
    """Turn limbs about their first joints by rotation vectors [N, 4, 3]; what is carried moves along."""
    _turn(placed.ends, placed.pivots, placed.anchors, limbs.owner, limbs.carried, turns)


@jit
def _turn(ends: Floats, pivots: Floats, anchors: Floats, owner: Ints, carried: Bools, turns: Floats) -> None:
    """Turn as `turn` does."""
    for t in range(len(turns)):
        for limb in range(4):
            vector, pivot, anchor = turns[t, limb], pivots[t, limb], anchors[t, limb]
            angle = np.sqrt(np.sum(vector**2))
            if angle < 1e-12:
                continue
            moved = -anchor
            _turn_point(anchor, pivot, vector, angle)
            moved += anchor
            for capsule in range(len(owner)):
                if owner[capsule] != limb:
                    continue
                for end in range(2):
                    point = ends[t, capsule, end]
                    if carried[capsule]:
                        point += moved
                    else:
                        _turn_point(point, pivot, vector, angle)


@jit
def _turn_point(point: Floats, pivot: Floats, vector: Floats, angle: float) -> None:
    """Turn a point [3] about a pivot [3] by a rotation vector [3] of some length, by Rodrigues' formula, in place."""
    ax, ay, az = point[0] - pivot[0], point[1] - pivot[1], point[2] - pivot[2]
    vx, vy, vz = vector[0], vector[1], vector[2]
    sine, versine = np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle**2
    bx, by, bz = vy * az - vz * ay, vz * ax - vx * az, vx * ay - vy * ax
    point[0] = pivot[0] + (ax + sine * bx + versine * (vy * bz - vz * by))
    point[1] = pivot[1] + (ay + sine * by + versine * (vz * bx - vx * bz))
    point[2] = pivot[2] + (az + sine * bz + versine * (vx * by - vy * bx))
