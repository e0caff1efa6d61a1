"""Aligns human23's axes with a rig whose zero pose does not stand, by its movement.

Rigs of MotionBuilder, Maya and others lay one axis of every joint along its bone: with all rotations 0 the body is a
straight line, which does not show the twist of its joints. Neither does a zero pose copied from a frame of a movement.
Movement shows it, in each joint's own frame:

- a bone points to the next joint, and a pelvis or a chest has hips or arms at its sides;
- the hinges of knees and elbows give the twist of limbs: knees bend backwards, elbows forwards;
- feet point to the toes, and their soles are level while they rest;
- any other joint (clavicles, neck and head, hands, toes) has on average its parent's orientation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy import SIDES
from motionmind.body.human import human23
from motionmind.body.skeleton import Skeleton
from motionmind.errors import SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import on_one_chain
from motionmind.retarget.vertical import thin_frames

COINCIDENT_M = 1e-6  # joints closer than this coincide
COS_MAX_LEAN = np.cos(np.radians(25.0))  # of a trunk, or a joint's axis along it, from the vertical
_COS_MAX_SPREAD = np.cos(np.radians(60.0))  # of a standing leg from the vertical
_LEFT, UP, _AHEAD = np.eye(3)
_HINGES = (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))


def rests_upright(places: Sequence[Floats | None]) -> bool:
    """Return whether a body stands at rest: its legs below it, its head above, hips and shoulders facing one way.

    Its left side must mirror its right side, which hardly any frame of a movement does.

    Args:
        places: place of each joint of human23 [3], metres; None if a rig lacks the joint.
    """
    of = {name: place for name, place in zip(human23().names, places, strict=True) if place is not None}
    hips, shoulders = (np.stack([of[f"{side}_{joint}"] for side in SIDES]) for joint in ("hip", "shoulder"))
    lines = [pair[0] - pair[1] for pair in (hips, shoulders)]
    if min(float(np.linalg.norm(line)) for line in lines) < COINCIDENT_M:
        return True  # no evidence against it
    if _unit(lines[0]) @ _unit(lines[1]) < _COS_MAX_SPREAD:
        return False
    middle = hips.mean(axis=0)
    up = _unit(shoulders.mean(axis=0) - middle)
    if any(up @ (of[joint] - middle) <= 0.0 for joint in ("cervical", "atlantal") if joint in of):
        return False
    bones = [of[f"{side}_{joint}"] - of[f"{side}_hip"] for side in SIDES for joint in ("knee", "ankle")]
    return all(up @ _unit(bone) <= -_COS_MAX_SPREAD for bone in bones) and _is_symmetric(of, middle, _unit(lines[0]))


def _is_symmetric(places: Mapping[str, Floats], middle: Floats, left: Floats) -> bool:
    """Return whether limbs are mirror images in the plane through `middle` [3] with the normal `left` [3].

    Args:
        places: {joint of human23: its place [3], metres}, as far as a rig has it.
        middle: between the hips [3], metres.
        left: direction from the right hip to the left one.
    """
    pairs = [[f"{side}_{joint}" for side in SIDES] for limb in _HINGES for joint in limb]
    ends = np.array([[places[joint] for joint in pair] for pair in pairs if places.keys() >= {*pair}]) - middle
    image = ends[:, 0] - 2.0 * (ends[:, 0] @ left)[:, None] * left
    # Sides differ by 3 % of the reach in recordings' rest poses.
    return float(rot.norm(image - ends[:, 1]).max()) <= 0.05 * float(rot.norm(ends).max())


@dataclass(frozen=True, eq=False)
class _Movement:
    """Movement on a file's joints, seen through human23's.

    Attributes:
        skeleton: the file's.
        place_sources: for each joint of human23, index of the file's joint that gives its place [23]; -1 for none.
        rotation_sources: the same for the joint that gives its rotation [23].
        places: of the file's joints [T, J, 3], metres.
        tips: far ends of the file's joints [T, J, 3], metres.
        orientations: of the file's joints [T, J, 4].
    """

    skeleton: Skeleton
    place_sources: Sequence[int]
    rotation_sources: Sequence[int]
    places: Floats
    tips: Floats
    orientations: Floats

    def place(self, joint: str) -> Floats | None:
        """Return the places of a joint of human23 [T, 3]; None if it has no source."""
        index = self.place_sources[human23().index(joint)]
        return None if index < 0 else self.places[:, index]

    @cached_property
    def trunk(self) -> Floats:
        """The vectors [T, 3] from the middle of the hips to the middle of the shoulders, metres."""
        ends = [[self.place(f"{side}_{joint}") for side in SIDES] for joint in ("hip", "shoulder")]
        hips, shoulders = (np.mean(np.array(pair, dtype=np.float64), axis=0) for pair in ends)
        return np.asarray(shoulders - hips)

    @cached_property
    def vertical(self) -> Floats:
        """The axis of the world [3], y or z, nearest to the mean direction of the trunk."""
        return UP if self.trunk[:, 1].mean() >= self.trunk[:, 2].mean() else _AHEAD

    def line(self, start: str, end: str) -> Floats:
        """Return the directions from one joint to another [T, 3]; 0 if one is missing or they coincide."""
        a, b = self.place(start), self.place(end)
        return np.zeros((len(self.places), 3)) if a is None or b is None else _unit(b - a)

    def frame(self, joint: str) -> Floats:
        """Return the orientations [T, 4] of the joint that gives a joint of human23 its rotation."""
        return self.orientations[:, self.rotation_sources[human23().index(joint)]]

    def mean_in_frame(self, joint: str, vectors: Floats) -> Floats:
        """Return the mean of the world's vectors [T, 3] in a joint's own frame [3]."""
        return np.asarray(rot.mul_vec(rot.inv(self.frame(joint)), vectors).mean(axis=0))

    def align_with_parent(self, joint: str, parent: str, above: Floats) -> Floats:
        """Return the alignment [4] that gives a joint on average its parent's orientation.

        `above` [4] is the parent's alignment.
        """
        return rot.mul(_mean_rotation(rot.inv_mul(self.frame(joint), self.frame(parent))), above)


def align_by_movement(
    skeleton: Skeleton,
    rotations: Floats,
    root: Floats,
    place_sources: Sequence[int],
    rotation_sources: Sequence[int],
) -> tuple[Floats, list[str]]:
    """Find the orientation of human23's axes in the frames of a file's joints, from its movement.

    Args:
        skeleton: the file's.
        rotations: local rotations [T, J, 4] or [J, 4].
        root: positions of the root [T, 3] or [3], metres.
        place_sources: for each joint of human23, index of the file's joint that gives its place [23]; -1 for none.
        rotation_sources: the same for the joint that gives its rotation [23].

    Returns:
        The alignments, quaternions [23, 4], and the joints of human23 whose twist the movement does not show.

    Raises:
        SkeletonError: knees bend forwards.
    """
    rotations, root = rotations.reshape(-1, len(skeleton), 4), root.reshape(-1, 3)
    some = thin_frames(len(rotations))
    points = skeleton.positions_and_tips(rotations[some], root[some])
    places, tips = points[:, : len(skeleton)], points[:, len(skeleton) :]
    orientations = skeleton.global_rotations(rotations[some])
    movement = _Movement(skeleton, place_sources, rotation_sources, places, tips, orientations)
    hinges = {joint: axis for side in SIDES for joint, axis in _find_hinges(movement, side).items()}
    body, out = human23(), {"pelvis": _align_trunk(movement)}
    unclear: list[str] = []
    for i, (name, parent) in enumerate(zip(body.names, body.parents, strict=True)):
        if parent < 0:
            continue
        above = out[body.names[parent]]
        if rotation_sources[i] < 0:
            out[name] = above
            continue
        out[name] = movement.align_with_parent(name, _nearest_with_source(rotation_sources, parent), above)
        if name in hinges:
            out[name], clear = _align_limb(movement, name, hinges[name], out[name])
            unclear += [name] * (not clear)
        elif name.endswith("_ankle"):
            out[name] = _align_foot(movement, name, out[name])
        elif name.endswith("_toes"):
            out[name] = _align_toes(movement, name, out[name])
        elif name.endswith("_wrist"):
            out[name] = _align_hand(movement, name, out[name])
        elif name in ("lumbar", "thorax"):
            out[name] = _align_back(movement, name, out[name])
        elif name == "atlantal":
            out[name] = _align_head(out[name])
    return np.array([out[name] for name in body.names]), unclear


def standing_pose(skeleton: Skeleton, rotations: Floats, rotation_sources: Sequence[int], alignment: Floats) -> Floats:
    """Return the orientations [J, 4] of a file's joints while human23's joints, with this alignment, are at rest.

    Joints that are no source of a rotation keep their mean rotation in the movement.
    """
    source = {joint: i for i, joint in reversed([*enumerate(rotation_sources)]) if joint >= 0}
    rotations = rotations.reshape(-1, len(skeleton), 4)
    out = np.tile(rot.IDENTITY, (len(skeleton), 1))
    for joint, parent in enumerate(skeleton.parents):
        if joint in source:
            out[joint] = rot.inv(alignment[source[joint]])
        elif parent >= 0:
            out[joint] = rot.mul(out[parent], _mean_rotation(rotations[:, joint]))
    return out


def _nearest_with_source(rotation_sources: Sequence[int], joint: int) -> str:
    """Return the name of a joint of human23, or of its nearest ancestor that has a source."""
    body = human23()
    while joint > 0 and rotation_sources[joint] < 0:
        joint = body.parents[joint]
    return body.names[joint]


def _align_trunk(movement: _Movement) -> Floats:
    """Return the alignment [4] of the pelvis: hips at its sides and, on average, shoulders above."""
    left = movement.mean_in_frame("pelvis", movement.line("right_hip", "left_hip"))
    up = movement.mean_in_frame("pelvis", _unit(movement.trunk))
    return _frame(_LEFT, left, UP, _along_axis(up, left))


def _align_back(movement: _Movement, joint: str, usual: Floats) -> Floats:
    """Return the alignment [4] of a joint of the back: its bone goes up, clavicles or shoulders are at its sides."""
    left, up = rot.mul_vec(usual, _LEFT), rot.mul_vec(usual, UP)
    bone = movement.mean_in_frame(joint, movement.line(joint, "thorax" if joint == "lumbar" else "cervical"))
    up = bone if np.linalg.norm(bone) > 0.5 and bone @ up > 0.0 else up
    if joint == "lumbar":
        return _frame(UP, up, _LEFT, left)
    for arm in ("clavicle", "shoulder"):
        line = movement.mean_in_frame(joint, movement.line(f"right_{arm}", f"left_{arm}"))
        if np.linalg.norm(line) > 0.5:
            return _frame(_LEFT, line, UP, _along_axis(up, line))
    return _frame(UP, up, _LEFT, left)


def _along_axis(up: Floats, left: Floats) -> Floats:
    """Return the axis of a joint's frame along the trunk's direction `up` there [3]; `up` if none lies along it."""
    level, up = _unit(left), _unit(up)
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    axes = axes - np.outer(axes @ level, level)
    best = max((axis for axis in axes if np.linalg.norm(axis) > 0.5), key=lambda axis: float(_unit(axis) @ up))
    return best if _unit(best) @ _unit(up - (up @ level) * level) >= COS_MAX_LEAN else up


def _find_hinges(movement: _Movement, side: str) -> dict[str, Floats]:
    """Return the axis [T, 3] of the hinge of each limb joint on a side; its length is the sine of the bend."""
    out = {}
    for upper, middle, lower in _HINGES:
        above = movement.line(f"{side}_{upper}", f"{side}_{middle}")
        below = movement.line(f"{side}_{middle}", f"{side}_{lower}")
        out[f"{side}_{upper}"] = out[f"{side}_{middle}"] = rot.cross(above, below)
    return out


def _align_limb(movement: _Movement, joint: str, hinge: Floats, usual: Floats) -> tuple[Floats, bool]:
    """Return the alignment [4] of a limb's joint by its bone and hinge [T, 3], and whether the hinge is clear."""
    side, kind = joint.split("_")
    end = {"hip": "knee", "knee": "ankle", "shoulder": "elbow", "elbow": "wrist"}[kind]
    bone = movement.mean_in_frame(joint, movement.line(joint, f"{side}_{end}"))
    rest = human23().offsets[human23().index(f"{side}_{end}")]
    axis = movement.mean_in_frame(joint, hinge)
    # Knees turn about +x, elbows about -y (right ones +y), by a vector product of the bones above and below.
    rest_axis = _LEFT if kind in ("hip", "knee") else UP if side == "right" else -UP
    bends, expected = float(np.linalg.norm(axis)), rot.mul_vec(usual, rest_axis)
    # Clear: the mean sine of the bend is at least 0.05, and at least 70 % of it about one direction.
    if bends < 0.05 or bends < 0.7 * float(np.mean(rot.norm(hinge))):
        return _frame(rest, bone, rest_axis, expected), False
    if kind == "hip" and axis @ expected < -0.4 * bends:
        raise SkeletonError(f"{movement.skeleton.name}: {side}_knee bends forwards; are left and right swapped?")
    return _frame(rest, bone, rest_axis, axis), True


def _align_foot(movement: _Movement, ankle: str, usual: Floats) -> Floats:
    """Return the alignment [4] of an ankle: towards the toes, the toes' hinge across, the sole level at rest."""
    toes = ankle.replace("ankle", "toes")
    bone = movement.mean_in_frame(ankle, movement.line(ankle, toes))
    if np.linalg.norm(bone) < 0.5:
        bone = _far_end(movement, ankle)
    if np.linalg.norm(bone) < COINCIDENT_M:
        return usual
    left = _toes_hinge(movement, ankle, rot.mul_vec(usual, _LEFT))
    slope_rad = np.radians(22.0)  # of a resting foot, from ankle to toes; 11 to 40 degrees in recordings
    sloped = _frame(np.array([0.0, -np.sin(slope_rad), np.cos(slope_rad)]), bone, _LEFT, left)
    level = _frame(_LEFT, rot.mul_vec(sloped, _LEFT), UP, _resting_up(movement, ankle))
    if rot.mul_vec(level, UP) @ rot.mul_vec(sloped, UP) < np.cos(np.radians(35.0)):
        return sloped
    return _mean_rotation(np.stack([level, sloped]))


def _toes_hinge(movement: _Movement, ankle: str, usual: Floats) -> Floats:
    """Return the axis of the toes' hinge in an ankle's frame [3]; `usual` if the movement does not show it."""
    toes = ankle.replace("ankle", "toes")
    start = movement.place(toes)
    if start is None:
        return usual
    frame = movement.frame(ankle)
    turns = rot.inv_mul(frame, movement.frame(toes))
    tips = _unit(movement.tips[:, movement.rotation_sources[human23().index(toes)]] - start)
    across = rot.mul_vec(rot.inv(frame), rot.cross(movement.line(ankle, toes), tips))
    curls = rot.log(rot.mul_inv(turns, _mean_rotation(turns)))
    # Toes show the axis if they curl by 2 degrees, or the sine of their angle with the foot is above 0.1.
    for vectors, least in ((curls, np.radians(2.0)), (across, 0.1)):
        lengths, axes = np.linalg.svd(vectors, full_matrices=False)[1:]
        axis = axes[0] * np.copysign(1.0, axes[0] @ usual)
        is_hinge = lengths[0] ** 2 >= 0.95 * np.sum(lengths**2)
        if is_hinge and lengths[0] > least * np.sqrt(len(vectors)) and axis @ usual > _COS_MAX_SPREAD:
            return np.asarray(axis)
    return usual


def _resting_up(movement: _Movement, ankle: str) -> Floats:
    """Return the direction in an ankle's frame [3] that is up while the foot rests on the floor.

    A foot may rest in the lowest quarter of the frames, and rests in the slower half of these.
    """
    places = [
        place for joint in (ankle, ankle.replace("ankle", "toes")) if (place := movement.place(joint)) is not None
    ]
    height = np.mean(places, axis=0) @ movement.vertical
    low = np.flatnonzero(height <= np.quantile(height, 0.25))
    if len(height) > 1:
        speed = np.max([rot.norm(np.gradient(place, axis=0)) for place in places], axis=0)
        low = low[speed[low] <= np.median(speed[low])]
    ups = rot.mul_vec(rot.inv(movement.frame(ankle)[low]), movement.vertical)
    return np.asarray(np.median(ups, axis=0))


def _align_toes(movement: _Movement, toes: str, usual: Floats) -> Floats:
    """Return the alignment [4] of toes: their tips ahead, their hinge parallel to the foot's."""
    tip = _far_end(movement, toes)
    return usual if np.linalg.norm(tip) < 0.5 else _frame(_AHEAD, tip, _LEFT, rot.mul_vec(usual, _LEFT))


def _align_hand(movement: _Movement, wrist: str, usual: Floats) -> Floats:
    """Return the alignment [4] of a wrist: its bone to the fingers, its palm pronated by 20 degrees on average.

    Recordings have this mean, measured from elbows that bend in the plane of the palm.
    """
    bone = movement.mean_in_frame(wrist, movement.line(wrist, wrist.replace("wrist", "fingers")))
    bone = bone if np.linalg.norm(bone) > 0.5 else _far_end(movement, wrist)
    if np.linalg.norm(bone) > COINCIDENT_M:
        rest = _LEFT if wrist.startswith("left") else -_LEFT
        usual = _frame(rest, bone, UP, rot.mul_vec(usual, UP))
    return rot.mul(usual, rot.from_axis_angle(_LEFT, np.radians(20.0)))


def _align_head(usual: Floats) -> Floats:
    """Return the alignment [4] of a head: the nearest one along the axes of its frame, if one is near, else `usual`."""
    matrix = rot.to_matrix(usual)
    square = np.where(np.abs(matrix) == np.max(np.abs(matrix), axis=0), np.sign(matrix), 0.0)
    near = np.linalg.det(square) > 0.5 and np.trace(square.T @ matrix) > 1.0 + 2.0 * COS_MAX_LEAN
    return rot.from_matrix(square) if near else usual


def _far_end(movement: _Movement, joint: str) -> Floats:
    """Return the mean direction of a joint's furthest descendant in its frame [3]; 0 if it has none."""
    top = movement.rotation_sources[human23().index(joint)]
    below = [i for i in range(top, len(movement.skeleton)) if on_one_chain(movement.skeleton.parents, i, top)]
    ends = np.concatenate([movement.places[:, below], movement.tips[:, below]], axis=1) - movement.places[:, [top]]
    furthest = int(np.argmax(rot.norm(ends).mean(axis=0)))
    return movement.mean_in_frame(joint, _unit(ends[:, furthest]))


def _frame(rest: Floats, found: Floats, rest_near: Floats, near: Floats) -> Floats:
    """Return the rotation [4] that takes `rest` [3] to the direction `found` [3], and `rest_near` nearest to `near`."""
    return rot.from_matrix(_triad(found, near) @ _triad(rest, rest_near).T)


def _triad(a: Floats, b: Floats) -> Floats:
    """Return orthonormal columns [3, 3]: along `a`, along the part of `b` across `a`, and across both."""
    first = _unit(a)
    second = b - (b @ first) * first
    if np.linalg.norm(second) < COINCIDENT_M:
        second = np.eye(3)[np.argmin(np.abs(first))]
        second = second - (second @ first) * first
    second = _unit(second)
    return np.stack([first, second, np.cross(first, second)], axis=-1)


def _mean_rotation(rotations: Floats) -> Floats:
    """Return the mean [4] of rotations [T, 4]; `q` and `-q` count as equal."""
    return rot.canonical(np.linalg.eigh(rotations.T @ rotations)[1][:, -1])


def _unit(v: Floats) -> Floats:
    """Return the directions [..., 3] of vectors; zeros where joints coincide."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.where(length > COINCIDENT_M, v / np.maximum(length, COINCIDENT_M), 0.0)
