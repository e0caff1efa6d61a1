"""Feet that stay where they stand: what the root, which is one, cannot do for two feet their legs do.

Each foot is given a *track*, near to the one that it has, on which it hardly moves while it is near the floor. Where it
has to get elsewhere in so short a time that it would slide, it is lifted as in a step. The root goes along as far as
the legs would otherwise have to bend or stretch, and the legs follow, by inverse kinematics of their two long bones;
the feet keep their orientations. The constants were chosen on other recordings than those that experiments/inbetween
reports.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.limbs import limbs_of, stem_of
from motionmind.body.limits import within_limits
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.realise.root import BEARS, lows, stand

HOLDS = 0.04  # metres above the floor at which a foot's hold on it has fallen to a half
EVEN = 0.03  # what it weighs, beside a foot that stands, that a track departs evenly from the one that was
SMOOTH = 0.015  # seconds: so long it takes to begin to depart, and to cease
BACK = 2.5  # a second: how fast a foot that holds on to nothing returns to where it was
UNDER = 0.02  # metres by which a limb must be lower than another, for the body to stand on it, that stands e times less
FAST = 0.6  # metres a second from which a foot does not slide but steps
MEANT = 0.25  # how much a foot is to stand, so that it may step rather than slide
STEP = 0.06  # metres above the floor to which a step lifts it
RISE = 0.3  # seconds of lifting
STANDS = 0.055  # metres above the floor below which another foot stands, so that this one may step
SOFT = 0.02  # of a leg's length: so near to its full length it is not stretched as far as it would have to be
HINGE = 0.1  # sine of a knee's bend below which its axis is rather the one that it has at other times
STAY = 0.3  # what it weighs, beside a leg that keeps its length, that the root stays on its way


def plant_feet(
    skeleton: Skeleton,
    rotations: Floats,
    root: Floats,
    heights: Floats,
    clearance: Floats,
    stands: Floats,
    loose: Bools,
    fps: float,
    given: Floats,
) -> tuple[Floats, Floats]:
    """The same movement with feet that stay where they stand: local rotations [N, J, 4], positions of the root [N, 3].

    Only the root and the legs differ. A leg is a limb of two bones or more that hangs from the root, or from the first
    fork below it; its joints are brought within their limits at last, and then its foot may be a little off its track,
    but not in the floor. The body stands on what stands: where a foot that does not is lower, its leg bends, and the
    body is not lifted onto it.

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        root: positions of the root [N, 3], metres, of any height.
        heights: of the body's lowest point at each frame [N], metres, as it is to be.
        clearance: how far it is above the floor [N], metres.
        stands: how much each limb, and last the trunk, is to stand where it is low from each frame to the next
            [N - 1, limbs + 1], 0 to 1.
        loose: joints without limits [J].
        fps: frames a second.
        given: when postures were given that are to stay as they are, in frames, whole or not, from the first frame to
            the last [G]. The frames next to them stay too.
    """
    numbers, legs = _legs(skeleton)
    if not legs:
        return rotations, stand(skeleton, rotations, root, heights)
    rotations, root, floor = rotations.copy(), root.copy(), heights - clearance
    low = lows(skeleton, rotations, root)
    lift = heights - low.min(axis=1)
    root[:, 1] += lift
    low += lift[:, None]
    sunk = _sunk(low, stands)
    for start, end in pairwise(given):
        # Rounded, so that a posture that falls on a frame does.
        part = slice(int(np.ceil(start - 1e-6)), int(end + 1e-6) + 1)
        if part.stop - part.start > 2:
            sink = np.maximum(sunk[part] - np.linspace(sunk[part][0], sunk[part][-1], len(sunk[part])), 0.0)
            sink *= _edges(len(sink), fps)
            root[part, 1] -= sink
            under = np.maximum(heights[part, None] - (low[part][:, numbers] - sink[:, None]), 0.0)
            stretch = rotations[part], root[part], floor[part], under, stands[part.start : part.stop - 1, numbers]
            rotations[part], root[part] = _planted(skeleton, legs, *stretch, loose, fps)
    return rotations, stand(skeleton, rotations, root, heights)


def _planted(
    skeleton: Skeleton,
    legs: list[tuple[list[int], int]],
    rotations: Floats,
    root: Floats,
    floor: Floats,
    under: Floats,
    stands: Floats,
    loose: Bools,
    fps: float,
) -> tuple[Floats, Floats]:
    """The same movement, three frames or more, between two that stay; legs are lifted by so much that they are `under`
    where the body stands [N, legs]."""
    turned = skeleton.global_rotations(rotations)
    places = skeleton.positions_and_tips(rotations, root)
    # Both ends of each foot's last bone: one that turns on its ball or on its tip stands.
    ends = [places[:, [leg[-1], leg[-1] + len(skeleton)]] for leg, _ in legs]
    heights = [end[..., 1] - floor[:, None] + lifted[:, None] for end, lifted in zip(ends, under.T, strict=True)]
    off = np.empty((len(rotations), len(legs), 3))
    for foot, end in enumerate(ends):
        others = [height.min(axis=1) for other, height in enumerate(heights) if other != foot]
        others_stand = np.min(others, axis=0) < STANDS if others else np.zeros(len(rotations), dtype=np.bool_)
        off[:, foot] = _departure(end, heights[foot], stands[:, foot], others_stand, fps)
        heights[foot] = heights[foot] + off[:, foot, 1:2]
        off[:, foot, 1] += under[:, foot]
    # Hip, knee and what they bring to its place: the next joint, or the tip.
    chains = np.array([[*leg, leg[-1] + len(skeleton)][knee - 1 : knee + 2] for leg, knee in legs])
    # For a step a knee bends; the root goes along with what is level.
    moved = _along(places[:, chains[:, 2]] - places[:, chains[:, 0]], off * np.array([1.0, 0.0, 1.0]))
    planted = rotations.copy()
    for foot, (hip, knee, end) in enumerate(chains):
        thigh, shank = _reach(turned[:, hip], places[:, chains[foot]], places[:, end] + off[:, foot] - moved)
        thigh, shank = rot.mul(thigh, turned[:, hip]), rot.mul(shank, turned[:, knee])
        planted[:, hip] = rot.inv_mul(turned[:, skeleton.parents[hip]], thigh)
        planted[:, knee] = rot.inv_mul(thigh, shank)
        if end < len(skeleton):
            planted[:, end] = rot.inv_mul(shank, turned[:, end])
    joints = [joint for leg, _ in legs for joint in leg]
    out = rotations.copy()
    out[1:-1, joints] = within_limits(skeleton, planted, rotations[[0, -1]], loose)[1:-1, joints]
    return out, root + moved


def _sunk(low: Floats, stands: Floats) -> Floats:
    """How far the body is to sink [N] from where its lowest point is on the floor, to stand on what stands there.

    Its limbs, whose lowest points are at `low` [N, limbs + 1], count by how much they stand [N - 1, limbs + 1],
    to the power of BEARS, and by exp(-h / UNDER) for the height h above the lowest of all.
    """
    still = np.concatenate([stands[:1], 0.5 * (stands[1:] + stands[:-1]), stands[-1:]])
    above = low - low.min(axis=1, keepdims=True)
    weights = np.maximum(still, 1e-3) ** BEARS * np.exp(-above / UNDER)
    return np.asarray(np.sum(weights * np.where(weights > 0.0, above, 0.0), axis=1) / weights.sum(axis=1))


def _along(legs: Floats, off: Floats) -> Floats:
    """How far the root goes along [N, 3], metres, so that legs hardly change their lengths.

    It is the r for which sum_l (u_l . (off_l - r))^2 + STAY |r|^2 is least, with u_l the direction of leg l: 0 where
    all feet are to be where they were.

    Args:
        legs: from the hip to the end of each leg [N, L, 3], metres.
        off: how far that end is to be from where it was [N, L, 3], metres.
    """
    along = legs / np.maximum(np.linalg.norm(legs, axis=-1, keepdims=True), 1e-9)
    system = np.einsum("nli,nlj->nij", along, along) + STAY * np.eye(3)
    pull = np.einsum("nli,nlj,nlj->ni", along, along, off)
    return np.asarray(np.linalg.solve(system, pull[..., None])[..., 0])


def _legs(skeleton: Skeleton) -> tuple[list[int], list[tuple[list[int], int]]]:
    """Which limbs are legs; the joints of each from the root down, and which of them is its knee: the one between its
    two long bones."""
    numbers, out, above = [], [], stem_of(skeleton)[-1]
    for number, limb in enumerate(limbs_of(skeleton)):
        bones = np.linalg.norm([*skeleton.offsets[limb[1:]], skeleton.tips[limb[-1]]], axis=-1)
        pairs = np.minimum(bones[:-1], bones[1:])
        if skeleton.parents[limb[0]] == above and len(limb) > 1 and pairs.max() > 0.0:
            numbers.append(number)
            out.append((limb, int(np.argmax(pairs)) + 1))
    return numbers, out


def _departure(ends: Floats, heights: Floats, stands: Floats, others_stand: Bools, fps: float) -> Floats:
    """How far a foot is to be from where it was [N, 3], metres: 0 in the first and in the last frame.

    Args:
        ends: places of the foot's two ends [N, 2, 3], metres.
        heights: theirs above the floor [N, 2], metres.
        stands: how much it stands where it is low from each frame to the next [N - 1].
        others_stand: whether it may step, for the body stands elsewhere [N].
        fps: frames a second.
    """
    moves = np.diff(ends[..., [0, 2]], axis=0)
    level = _track(moves, _higher(heights), stands, fps)
    speed = fps * np.linalg.norm(moves + np.diff(level, axis=0)[:, None], axis=-1)
    low = _higher(heights) < STEP
    slides = np.any(low, axis=1) & np.all(~low | (speed > FAST), axis=1) & (stands > MEANT)
    steps = np.zeros(len(ends), dtype=np.bool_)
    steps[:-1] |= slides
    steps[1:] |= slides
    lift = np.zeros(len(ends))
    if np.any(steps & others_stand):
        lift = _envelope(np.where(steps & others_stand, np.maximum(STEP - heights.min(axis=1), 0.0), 0.0), fps)
        level = _track(moves, _higher(heights + lift[:, None]), stands, fps)
    return np.stack([level[:, 0], lift, level[:, 1]], axis=-1)


def _higher(heights: Floats) -> Floats:
    """The greater of the heights [N, 2] in two frames that follow each other [N - 1, 2]."""
    return np.maximum(heights[1:], heights[:-1])


def _track(moves: Floats, heights: Floats, stands: Floats, fps: float) -> Floats:
    """How far, level, a foot is to be from where it was [N, 2], metres, so that it stays where it stands.

    From 0 to 0 the offsets d minimise sum_p w_p |d' + v_p|^2 + EVEN |d'|^2 + (1 - w) BACK^2 |d|^2 + SMOOTH^2 |d''|^2
    over the time, with v_p how fast end p moves, w_p = 1 / (1 + (height / HOLDS)^4) how near to the floor it is, times
    how much the foot stands there, and w the greater of the two. In frames, and
    divided by fps: differences stand for derivatives, BACK / fps for BACK and SMOOTH fps for SMOOTH. The normal
    equations are five diagonals.

    Args:
        moves: how far the foot's ends move from each frame to the next, level [N - 1, 2, 2], metres.
        heights: theirs above the floor meanwhile [N - 1, 2], metres.
        stands: how much the foot stands where it is low [N - 1].
        fps: frames a second.
    """
    from scipy.linalg import solveh_banded

    hold = stands[:, None] / (1.0 + (np.maximum(heights, 0.0) / HOLDS) ** 4)
    pull = hold.sum(axis=1) + EVEN
    free = 1.0 - hold.max(axis=1)
    back = 0.5 * (free[:-1] + free[1:]) * (BACK / fps) ** 2
    bend = (SMOOTH * fps) ** 2
    out = np.zeros((len(moves) + 1, 2))
    # Rows are of the frames but the first and the last, where d = 0, as before and after; a second difference reaches
    # over three frames.
    diagonals = np.zeros((3, len(out) - 2))
    diagonals[2] = pull[:-1] + pull[1:] + back + 6.0 * bend
    diagonals[1, 1:] = -pull[1:-1] - 4.0 * bend
    diagonals[0, 2:] = bend
    pulled = np.einsum("np,npk->nk", hold, moves)
    out[1:-1] = solveh_banded(diagonals, pulled[1:] - pulled[:-1])
    return out


def _envelope(need: Floats, fps: float) -> Floats:
    """A smooth curve [N] that is at least `need` [N], and 0 at both ends: nearer to them than RISE it may be less."""
    rise = max(1, round(RISE * fps))
    window = np.hanning(2 * rise + 3)[1:-1]
    # The mean over a window of what is the greatest in the window around each frame: none of these is less than need.
    around = np.lib.stride_tricks.sliding_window_view(np.pad(need, 2 * rise), 2 * rise + 1).max(axis=1)
    return np.asarray(np.convolve(around, window / window.sum(), "valid") * _edges(len(need), fps))


def _edges(count: int, fps: float) -> Floats:
    """A curve [count] that rises smoothly from 0 to 1 in RISE, and falls to 0 as long before the end."""
    frames = np.arange(count)
    share = np.minimum(np.minimum(frames, frames[::-1]) / max(1, round(RISE * fps)), 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


def _reach(hip: Floats, leg: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Turns [N, 4], in the world, of a leg's two bones that bring its end to `target` [N, 3], and the knee where it
    bends.

    The knee bends about its own axis until the end is as far from the hip as the target, by the law of cosines; the
    leg then turns the shortest way towards it. A leg that is too short is stretched, but smoothly ever less.

    Args:
        hip: orientations of the hip [N, 4].
        leg: places of hip, knee and end [N, 3, 3], metres.
        target: where the end is to be [N, 3], metres.
    """
    thigh, shank = leg[:, 1] - leg[:, 0], leg[:, 2] - leg[:, 1]
    axis = _hinge(hip, thigh, shank)
    # Along the axis nothing changes; across it, the two bones and the angle between them.
    along = np.sum(thigh * axis, axis=-1), np.sum(shank * axis, axis=-1)
    across = np.sqrt(np.sum(thigh**2, axis=-1) - along[0] ** 2), np.sqrt(np.sum(shank**2, axis=-1) - along[1] ** 2)
    least, product = (along[0] + along[1]) ** 2 + across[0] ** 2 + across[1] ** 2, 2.0 * across[0] * across[1]
    now, wanted = np.linalg.norm(leg[:, 2] - leg[:, 0], axis=-1), np.linalg.norm(target - leg[:, 0], axis=-1)
    far = now + _stretched(wanted - now, np.sqrt(least + product) - now, SOFT * np.sqrt(least + product))
    bends = [np.arccos(np.clip((distance**2 - least) / product, -1.0, 1.0)) for distance in (now, far)]
    bend = rot.from_axis_angle(axis, bends[1] - bends[0])
    turn = rot.between(thigh + rot.mul_vec(bend, shank), target - leg[:, 0])
    return turn, rot.mul(turn, bend)


def _hinge(hip: Floats, thigh: Floats, shank: Floats) -> Floats:
    """Unit axes [N, 3] about which a knee bends, from its bones [N, 3]; of a leg that is all but straight that of the
    other frames, seen from the hip [N, 4]."""
    normal = np.cross(thigh, shank)
    usual = rot.mul_vec(rot.inv(hip), normal).sum(axis=0)
    if np.linalg.norm(usual) < 1e-9:
        # Straight all along: across the thigh, where of the body's own axes the one most across it points.
        bone = rot.mul_vec(rot.inv(hip[0]), thigh[0])
        across = np.eye(3)[np.argmin(np.abs(bone))]
        usual = across - bone * (across @ bone) / (bone @ bone)
    size = np.linalg.norm(thigh, axis=-1) * np.linalg.norm(shank, axis=-1)
    normal += (HINGE * size)[:, None] * rot.mul_vec(hip, usual / np.linalg.norm(usual))
    return np.asarray(normal / np.linalg.norm(normal, axis=-1, keepdims=True))


def _stretched(wanted: Floats, room: Floats, soft: Floats) -> Floats:
    """How much longer a leg gets [N] of what is wanted [N], with so much room [N]: all of it up to `soft` [N] from the
    end, then exponentially less, so that it never gets there. Metres."""
    soft = np.maximum(np.minimum(soft, room), 1e-9)
    over = np.maximum(wanted - (room - soft), 0.0)
    return np.asarray(np.minimum(wanted, room - soft) + soft * -np.expm1(-over / soft))
