"""Finds how human23's axes lie in a rig whose zero pose does not stand, from its movement.

Rigs of MotionBuilder, Maya and others lay every joint's own axis along its bone: with all rotations 0 the body is a
straight line, which does not tell how its joints are turned. Nor does a zero pose that is taken from a movement, such
as a frame of it. Movement does, in each joint's own frame:

- a bone points where the next joint is, and a pelvis or a chest has hips or arms at its sides;
- limbs turn about their bones as the hinges of knees and elbows say: knees bend backwards, elbows forwards;
- feet point to the toes, and their soles are level where they rest;
- what has neither (clavicles, neck and head, hands, toes) is on average as its parent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.skeleton import Skeleton
from motionmind.errors import SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import in_a_row

_FRAMES = 500  # that are looked at, at most
_SAME_PLACE = 1e-6  # metres below which two joints coincide
_SPREAD = np.cos(np.radians(60.0))  # legs that stand are no further from the vertical
_UNEVEN = 0.05  # share of a body's reach by which its sides differ at rest; 0.03 in recordings
_LEANS = np.cos(np.radians(25.0))  # an axis of a joint that is no further from the trunk is along it
_BENDS = 0.05  # the mean sine of a hinge's bend above which its axis can be seen
_STEADY = 0.7  # the share of its bends that go one way
_CURLS = np.radians(2.0)  # by which toes turn if their axis can be seen
_SLOPES = 0.1  # the sine of the angle between a foot and its toes above which they show the foot's axis
_ONE_AXIS = 0.95  # the share of turns that are about one axis if it is a hinge
_RESTS = 0.25  # the share of frames, the lowest, in which a foot may rest
_SOLE = np.cos(np.radians(35.0))  # a sole at rest is no further from a foot's usual slope
_FORWARDS = -0.4  # cosine between the hinge of a knee and the hips, below which left and right are swapped
_LEFT, _UP, _AHEAD = np.eye(3)
# From ankle to toes a foot at rest goes down by 11 to 40 degrees in recordings. Hands are pronated by 20 degrees on
# average there, measured from where elbows bend in the plane of the palm.
_FOOT = np.array([0.0, -np.sin(np.radians(22.0)), np.cos(np.radians(22.0))])
_PRONATED = np.radians(20.0)
_SIDES = ("left", "right")
_HINGES = (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))


def stands(places: Sequence[Floats | None]) -> bool:
    """Return whether a body stands at rest: its legs below it, its head above, hips and shoulders facing one way.

    Its left side is then the mirror image of its right one, as in no frame of most movement.

    Args:
        places: for each joint of human23 its place [3], metres; None for one that a rig lacks.
    """
    of = {name: place for name, place in zip(human23().names, places, strict=True) if place is not None}
    hips, shoulders = (np.stack([of[f"{side}_{joint}"] for side in _SIDES]) for joint in ("hip", "shoulder"))
    lines = [pair[0] - pair[1] for pair in (hips, shoulders)]
    if min(float(np.linalg.norm(line)) for line in lines) < _SAME_PLACE:
        return True  # nothing says that it does not
    if _unit(lines[0]) @ _unit(lines[1]) < _SPREAD:
        return False
    middle = hips.mean(axis=0)
    up = _unit(shoulders.mean(axis=0) - middle)
    if any(up @ (of[joint] - middle) <= 0.0 for joint in ("cervical", "atlantal") if joint in of):
        return False
    bones = [of[f"{side}_{joint}"] - of[f"{side}_hip"] for side in _SIDES for joint in ("knee", "ankle")]
    return all(up @ _unit(bone) <= -_SPREAD for bone in bones) and _is_even(of, middle, _unit(lines[0]))


def _is_even(places: Mapping[str, Floats], middle: Floats, left: Floats) -> bool:
    """Return whether limbs are mirror images in the plane through `middle` [3] that the direction `left` [3] is across.

    Args:
        places: the place [3] of each joint of human23 that a rig has, metres.
        middle: between the hips [3], metres.
        left: from the right hip to the left one.
    """
    pairs = [[f"{side}_{joint}" for side in _SIDES] for limb in _HINGES for joint in limb]
    ends = np.array([[places[joint] for joint in pair] for pair in pairs if places.keys() >= {*pair}]) - middle
    image = ends[:, 0] - 2.0 * (ends[:, 0] @ left)[:, None] * left
    return float(rot.norm(image - ends[:, 1]).max()) <= _UNEVEN * float(rot.norm(ends).max())


@dataclass(frozen=True, eq=False)
class _Course:
    """Movement on a file's joints, as human23's see it.

    Attributes:
        skeleton: the file's.
        stands: for each joint of human23, index of the file's joint that gives its place [23]; -1 for none.
        turns: the same of the joint that gives its rotation [23].
        places: the file's joints [T, J, 3], metres.
        tips: the far ends of the file's joints [T, J, 3], metres.
        turned: orientations of the file's joints [T, J, 4].
    """

    skeleton: Skeleton
    stands: Sequence[int]
    turns: Sequence[int]
    places: Floats
    tips: Floats
    turned: Floats

    def place(self, joint: str) -> Floats | None:
        """Return the places of a joint of human23 [T, 3]; None if it has no source."""
        index = self.stands[human23().index(joint)]
        return None if index < 0 else self.places[:, index]

    @cached_property
    def trunk(self) -> Floats:
        """The vectors [T, 3] from between the hips to between the shoulders, metres."""
        ends = [[self.place(f"{side}_{joint}") for side in _SIDES] for joint in ("hip", "shoulder")]
        hips, shoulders = (np.mean(np.array(pair, dtype=np.float64), axis=0) for pair in ends)
        return np.asarray(shoulders - hips)

    @cached_property
    def vertical(self) -> Floats:
        """The axis of the world [3], y or z, that the trunk is along on average."""
        return _UP if self.trunk[:, 1].mean() >= self.trunk[:, 2].mean() else _AHEAD

    def line(self, start: str, end: str) -> Floats:
        """Return the directions from one joint to another [T, 3]; 0 where there is none."""
        a, b = self.place(start), self.place(end)
        return np.zeros((len(self.places), 3)) if a is None or b is None else _unit(b - a)

    def frame(self, joint: str) -> Floats:
        """Return the orientations [T, 4] of the joint that gives a joint of human23 its rotation."""
        return self.turned[:, self.turns[human23().index(joint)]]

    def within(self, joint: str, vectors: Floats) -> Floats:
        """Return the mean of vectors of the world [T, 3] in a joint's own frame [3]."""
        return np.asarray(rot.mul_vec(rot.inv(self.frame(joint)), vectors).mean(axis=0))

    def as_parent(self, joint: str, parent: str, above: Floats) -> Floats:
        """Return the alignment [4] of a joint that is on average as its parent, of the alignment `above` [4]."""
        return rot.mul(_mean_turn(rot.inv_mul(self.frame(joint), self.frame(parent))), above)


def align_by_movement(
    skeleton: Skeleton, rotations: Floats, root: Floats, stands: Sequence[int], turns: Sequence[int]
) -> tuple[Floats, list[str]]:
    """Find the orientation of human23's axes in the frames of a file's joints, from its movement.

    Args:
        skeleton: the file's.
        rotations: local rotations [T, J, 4] or [J, 4].
        root: positions of the root [T, 3] or [3], metres.
        stands: for each joint of human23, index of the file's joint that gives its place [23]; -1 for none.
        turns: the same of the joint that gives its rotation [23].

    Returns:
        The alignments, quaternions [23, 4], and the joints of human23 of which the movement does not tell how they are
        turned about their bones.

    Raises:
        SkeletonError: knees bend forwards.
    """
    rotations, root = rotations.reshape(-1, len(skeleton), 4), root.reshape(-1, 3)
    some = slice(None, None, -(-len(rotations) // _FRAMES))
    points = skeleton.positions_and_tips(rotations[some], root[some])
    places, tips = points[:, : len(skeleton)], points[:, len(skeleton) :]
    course = _Course(skeleton, stands, turns, places, tips, skeleton.global_rotations(rotations[some]))
    hinges = {joint: axis for side in _SIDES for joint, axis in _find_hinges(course, side).items()}
    body, out = human23(), {"pelvis": _align_trunk(course)}
    unclear: list[str] = []
    for i, (name, parent) in enumerate(zip(body.names, body.parents, strict=True)):
        if parent < 0:
            continue
        above = out[body.names[parent]]
        if turns[i] < 0:
            out[name] = above
            continue
        out[name] = course.as_parent(name, _source_above(turns, parent), above)
        if name in hinges:
            out[name], clear = _align_limb(course, name, hinges[name], out[name])
            unclear += [name] * (not clear)
        elif name.endswith("_ankle"):
            out[name] = _align_foot(course, name, out[name])
        elif name.endswith("_toes"):
            out[name] = _align_toes(course, name, out[name])
        elif name.endswith("_wrist"):
            out[name] = _align_hand(course, name, out[name])
        elif name in ("lumbar", "thorax"):
            out[name] = _align_back(course, name, out[name])
        elif name == "atlantal":
            out[name] = _align_head(out[name])
    return np.array([out[name] for name in body.names]), unclear


def standing_pose(skeleton: Skeleton, rotations: Floats, turns: Sequence[int], alignment: Floats) -> Floats:
    """Return the orientations [J, 4] of a file's joints where human23's, aligned so, are at rest.

    Joints that none of human23's takes its rotation from are on average as they are in the movement.
    """
    source = {turn: i for i, turn in reversed([*enumerate(turns)]) if turn >= 0}
    rotations = rotations.reshape(-1, len(skeleton), 4)
    out = np.tile(rot.IDENTITY, (len(skeleton), 1))
    for joint, parent in enumerate(skeleton.parents):
        if joint in source:
            out[joint] = rot.inv(alignment[source[joint]])
        elif parent >= 0:
            out[joint] = rot.mul(out[parent], _mean_turn(rotations[:, joint]))
    return out


def _source_above(turns: Sequence[int], joint: int) -> str:
    """Return a joint of human23, or the nearest above it that has a source."""
    body = human23()
    while joint > 0 and turns[joint] < 0:
        joint = body.parents[joint]
    return body.names[joint]


def _align_trunk(course: _Course) -> Floats:
    """Return the alignment [4] of the pelvis: hips at its sides, and shoulders, on average, above."""
    left = course.within("pelvis", course.line("right_hip", "left_hip"))
    up = course.within("pelvis", _unit(course.trunk))
    return _frame(_LEFT, left, _UP, _along_axis(up, left))


def _align_back(course: _Course, joint: str, usual: Floats) -> Floats:
    """Return the alignment [4] of a joint of the back: its bone goes up, clavicles or shoulders are at its sides."""
    left, up = rot.mul_vec(usual, _LEFT), rot.mul_vec(usual, _UP)
    bone = course.within(joint, course.line(joint, "thorax" if joint == "lumbar" else "cervical"))
    up = bone if np.linalg.norm(bone) > 0.5 and bone @ up > 0.0 else up
    if joint == "lumbar":
        return _frame(_UP, up, _LEFT, left)
    for arm in ("clavicle", "shoulder"):
        line = course.within(joint, course.line(f"right_{arm}", f"left_{arm}"))
        if np.linalg.norm(line) > 0.5:
            return _frame(_LEFT, line, _UP, _along_axis(up, line))
    return _frame(_UP, up, _LEFT, left)


def _along_axis(up: Floats, left: Floats) -> Floats:
    """Return the axis of a joint's frame that is along the trunk's direction `up` there [3]; `up` if none is."""
    level, up = _unit(left), _unit(up)
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    axes = axes - np.outer(axes @ level, level)
    best = max((axis for axis in axes if np.linalg.norm(axis) > 0.5), key=lambda axis: float(_unit(axis) @ up))
    return best if _unit(best) @ _unit(up - (up @ level) * level) >= _LEANS else up


def _find_hinges(course: _Course, side: str) -> dict[str, Floats]:
    """Return, for each joint of a side's limbs, the mean axis [T, 3] of its hinge, as long as the sine of its bend."""
    out = {}
    for upper, middle, lower in _HINGES:
        above = course.line(f"{side}_{upper}", f"{side}_{middle}")
        below = course.line(f"{side}_{middle}", f"{side}_{lower}")
        out[f"{side}_{upper}"] = out[f"{side}_{middle}"] = rot.cross(above, below)
    return out


def _align_limb(course: _Course, joint: str, hinge: Floats, usual: Floats) -> tuple[Floats, bool]:
    """Return the alignment [4] of a limb's joint by its bone and hinge [T, 3], and whether the hinge can be seen."""
    side, kind = joint.split("_")
    end = {"hip": "knee", "knee": "ankle", "shoulder": "elbow", "elbow": "wrist"}[kind]
    bone = course.within(joint, course.line(joint, f"{side}_{end}"))
    rest = human23().offsets[human23().index(f"{side}_{end}")]
    axis = course.within(joint, hinge)
    # Knees turn about +x, elbows about -y (right ones +y), by a vector product of the bones above and below.
    rest_axis = _LEFT if kind in ("hip", "knee") else _UP if side == "right" else -_UP
    bends, expected = float(np.linalg.norm(axis)), rot.mul_vec(usual, rest_axis)
    if bends < _BENDS or bends < _STEADY * float(np.mean(rot.norm(hinge))):
        return _frame(rest, bone, rest_axis, expected), False
    if kind == "hip" and axis @ expected < _FORWARDS * bends:
        raise SkeletonError(f"{course.skeleton.name}: {side}_knee bends forwards; are left and right swapped?")
    return _frame(rest, bone, rest_axis, axis), True


def _align_foot(course: _Course, ankle: str, usual: Floats) -> Floats:
    """Return the alignment [4] of an ankle: to the toes, with the toes' hinge across, its sole level where it rests."""
    toes = ankle.replace("ankle", "toes")
    bone = course.within(ankle, course.line(ankle, toes))
    if np.linalg.norm(bone) < 0.5:
        bone = _far_end(course, ankle)
    if np.linalg.norm(bone) < _SAME_PLACE:
        return usual
    left = _toes_hinge(course, ankle, rot.mul_vec(usual, _LEFT))
    sloped = _frame(_FOOT, bone, _LEFT, left)
    level = _frame(_LEFT, rot.mul_vec(sloped, _LEFT), _UP, _sole(course, ankle))
    if rot.mul_vec(level, _UP) @ rot.mul_vec(sloped, _UP) < _SOLE:
        return sloped
    return _mean_turn(np.stack([level, sloped]))


def _toes_hinge(course: _Course, ankle: str, usual: Floats) -> Floats:
    """Return the direction in an ankle's frame [3] that the toes turn about; `usual` where nothing shows it."""
    toes = ankle.replace("ankle", "toes")
    start = course.place(toes)
    if start is None:
        return usual
    frame = course.frame(ankle)
    turns = rot.inv_mul(frame, course.frame(toes))
    tips = _unit(course.tips[:, course.turns[human23().index(toes)]] - start)
    across = rot.mul_vec(rot.inv(frame), rot.cross(course.line(ankle, toes), tips))
    for vectors, least in ((rot.log(rot.mul_inv(turns, _mean_turn(turns))), _CURLS), (across, _SLOPES)):
        lengths, axes = np.linalg.svd(vectors, full_matrices=False)[1:]
        axis = axes[0] * np.copysign(1.0, axes[0] @ usual)
        is_hinge = lengths[0] ** 2 >= _ONE_AXIS * np.sum(lengths**2)
        if is_hinge and lengths[0] > least * np.sqrt(len(vectors)) and axis @ usual > _SPREAD:
            return np.asarray(axis)
    return usual


def _sole(course: _Course, ankle: str) -> Floats:
    """Return the direction in an ankle's frame [3] that is up while the foot rests on the floor."""
    places = [place for joint in (ankle, ankle.replace("ankle", "toes")) if (place := course.place(joint)) is not None]
    height = np.mean(places, axis=0) @ course.vertical
    low = np.flatnonzero(height <= np.quantile(height, _RESTS))
    if len(height) > 1:
        speed = np.max([rot.norm(np.gradient(place, axis=0)) for place in places], axis=0)
        low = low[speed[low] <= np.median(speed[low])]
    ups = rot.mul_vec(rot.inv(course.frame(ankle)[low]), course.vertical)
    return np.asarray(np.median(ups, axis=0))


def _align_toes(course: _Course, toes: str, usual: Floats) -> Floats:
    """Return the alignment [4] of toes: their tips ahead, their hinge as the foot's."""
    tip = _far_end(course, toes)
    return usual if np.linalg.norm(tip) < 0.5 else _frame(_AHEAD, tip, _LEFT, rot.mul_vec(usual, _LEFT))


def _align_hand(course: _Course, wrist: str, usual: Floats) -> Floats:
    """Return the alignment [4] of a wrist: its bone to the fingers, its palm a little pronated on average."""
    bone = course.within(wrist, course.line(wrist, wrist.replace("wrist", "fingers")))
    bone = bone if np.linalg.norm(bone) > 0.5 else _far_end(course, wrist)
    if np.linalg.norm(bone) > _SAME_PLACE:
        rest = _LEFT if wrist.startswith("left") else -_LEFT
        usual = _frame(rest, bone, _UP, rot.mul_vec(usual, _UP))
    return rot.mul(usual, rot.from_axis_angle(_LEFT, _PRONATED))


def _align_head(usual: Floats) -> Floats:
    """Return the alignment [4] of a head: the nearest in which its axes are the body's, if one is near."""
    matrix = rot.to_matrix(usual)
    square = np.where(np.abs(matrix) == np.max(np.abs(matrix), axis=0), np.sign(matrix), 0.0)
    near = np.linalg.det(square) > 0.5 and np.trace(square.T @ matrix) > 1.0 + 2.0 * _LEANS
    return rot.from_matrix(square) if near else usual


def _far_end(course: _Course, joint: str) -> Floats:
    """Return the mean direction of the furthest end below a joint in its frame [3]; 0 if nothing hangs from it."""
    top = course.turns[human23().index(joint)]
    below = [i for i in range(top, len(course.skeleton)) if in_a_row(course.skeleton, i, top)]
    ends = np.concatenate([course.places[:, below], course.tips[:, below]], axis=1) - course.places[:, [top]]
    furthest = int(np.argmax(rot.norm(ends).mean(axis=0)))
    return course.within(joint, _unit(ends[:, furthest]))


def _frame(rest: Floats, found: Floats, rest_near: Floats, near: Floats) -> Floats:
    """Return the rotation [4] that takes `rest` [3] to the direction `found`, and `rest_near` as near to `near`."""
    return rot.from_matrix(_triad(found, near) @ _triad(rest, rest_near).T)


def _triad(a: Floats, b: Floats) -> Floats:
    """Return orthonormal columns [3, 3]: along `a`, along `b` as far as it is across `a`, and across both."""
    first = _unit(a)
    second = b - (b @ first) * first
    if np.linalg.norm(second) < _SAME_PLACE:
        second = np.eye(3)[np.argmin(np.abs(first))]
        second = second - (second @ first) * first
    second = _unit(second)
    return np.stack([first, second, np.cross(first, second)], axis=-1)


def _mean_turn(turns: Floats) -> Floats:
    """Return the mean [4] of rotations [T, 4], which `q` and `-q` count alike for."""
    return rot.canonical(np.linalg.eigh(turns.T @ turns)[1][:, -1])


def _unit(v: Floats) -> Floats:
    """Return the directions [..., 3] of vectors; zeros where joints coincide."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.where(length > _SAME_PLACE, v / np.maximum(length, _SAME_PLACE), 0.0)
