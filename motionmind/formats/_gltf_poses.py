"""Poses of a glTF file's joints in the world, in motion and at rest.

Section numbers refer to "glTF 2.0 Specification", version 2.0.1, The Khronos Group (2021).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from motionmind._typing import Floats
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindWarning
from motionmind.formats._gltf import MIN_SCALE_RATIO, Gltf, from_matrix, to_trs
from motionmind.geometry import rotations as rot
from motionmind.retarget.fitting import zero_pose_rests

PATH_TYPES = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3"}
SAME_KEY_S = 1e-5  # keys no further apart are one; times have seven digits
_SAME_POSE_RAD = 1e-3


@dataclass(frozen=True)
class Track:
    """Keys of a node's translation, rotation or scale.

    Attributes:
        times: of the keys [K], seconds, increasing.
        values: at the keys [K, 3 or 4]; for CUBICSPLINE [K, 3, 3 or 4]: in-tangent, value, out-tangent.
        kind: "LINEAR", "STEP" or "CUBICSPLINE" (3.11).
    """

    times: Floats
    values: Floats
    kind: str

    def at(self, times: Floats) -> Floats:
        """Return the values at `times` [T], seconds; constant before the first key and after the last (appendix C)."""
        turns = self.values.shape[-1] == 4
        values = self.values[:, 1] if self.kind == "CUBICSPLINE" else self.values
        after = np.searchsorted(self.times, times + SAME_KEY_S, side="right").clip(1, max(len(self.times) - 1, 1))
        before = after - 1
        if len(self.times) == 1:
            return np.asarray(values[np.zeros(len(times), dtype=int)])
        span = self.times[after] - self.times[before]
        share = ((times - self.times[before]) / span).clip(0.0, 1.0)
        share = np.where(share * span < SAME_KEY_S, 0.0, np.where((1.0 - share) * span < SAME_KEY_S, 1.0, share))[
            :, None
        ]
        if self.kind == "STEP":
            return np.asarray(values[np.where(share[:, 0] == 1.0, after, before)])
        if self.kind == "CUBICSPLINE":
            out, into = span[:, None] * self.values[before, 2], span[:, None] * self.values[after, 0]
            s2, s3 = share**2, share**3
            found = (2 * s3 - 3 * s2 + 1) * values[before] + (s3 - 2 * s2 + share) * out
            found += (3 * s2 - 2 * s3) * values[after] + (s3 - s2) * into
            return np.asarray(rot.normalise(found) if turns else found)
        if turns:
            return rot.slerp(values[before], values[after], share[:, 0])
        return np.asarray(values[before] + share * (values[after] - values[before]))


Tracks = dict[tuple[int, str], Track]  # by node and animated path


def lineage(parents: list[int], nodes: list[int] | set[int]) -> list[int]:
    """Return nodes and their ancestors, each after its parent."""
    found: dict[int, None] = {}
    for last in sorted(nodes):
        path, node = [], last
        while node >= 0 and node not in found:
            path.append(node)
            node = parents[node]
        found |= dict.fromkeys(reversed(path))
    return list(found)


def globals_at(
    gltf: Gltf, parents: list[int], joints: list[int], tracks: Tracks, times: Floats
) -> tuple[Floats, Floats]:
    """Return the joints' orientations [T, J, 4] and places [T, J, 3] in the world at `times`."""
    turns = np.empty((len(times), len(joints), 4))
    places = np.empty((len(times), len(joints), 3))
    number = {node: i for i, node in enumerate(joints)}
    frames: dict[int, tuple[Floats, Floats, Floats]] = {-1: (np.zeros((1, 3)), rot.IDENTITY[None], np.ones((1, 3)))}
    for node in lineage(parents, joints):
        try:
            local = to_trs(gltf.document.nodes[node])
        except ValueError as error:
            raise gltf.fault(f"node {node}: {error}") from error
        moved = [
            tracks[node, path].at(times) if (node, path) in tracks else value[None]
            for path, value in zip(PATH_TYPES, local, strict=True)
        ]
        place, turn, scale = frames[parents[node]]
        least = np.prod(moved[2], axis=-1).min()
        if not least > MIN_SCALE_RATIO:
            raise gltf.fault(f"node {node} has a scale that mirrors or flattens it")
        frames[node] = (
            place + rot.mul_vec(turn, scale * moved[0]),
            rot.mul(turn, moved[1]),
            scale * moved[2],
        )
        if node in number:
            places[:, number[node]], turns[:, number[node]] = frames[node][:2]
    return rot.normalise(turns), places


def rest_pose(
    gltf: Gltf, parents: list[int], joints: list[int], names: tuple[str, ...] | None
) -> tuple[Floats, Floats]:
    """Return the joints' orientations [J, 4] and places [J, 3] at rest, in the world.

    Args:
        gltf: the file.
        parents: of its nodes, -1 for none.
        joints: the body's nodes, each after its parent.
        names: the joints' names [J], to check that the nodes stand at rest; None if they are known to.
    """
    turns, places = globals_at(gltf, parents, joints, {}, np.zeros(1))
    turns, places = turns[0], places[0]
    bound: dict[int, tuple[Floats, Floats]] = {}
    for skin in gltf.document.skins:
        if skin.inverse_bind_matrices is None:
            continue
        for node, numbers in zip(skin.joints, gltf.numbers(skin.inverse_bind_matrices, "MAT4", "skin"), strict=False):
            if node in joints:
                place, turn, scale = from_matrix(numbers)
                bound[joints.index(node)] = -rot.mul_vec(rot.inv(turn), place / scale), rot.inv(turn)
    known = sorted(bound)
    if not known and names is not None:
        return _unbound_rest(gltf, parents, joints, names, (turns, places))
    if len(known) < len(joints) - 1:
        return turns, places
    to_world = rot.mul_inv(turns[known], np.array([bound[i][1] for i in known]))
    if np.all(rot.angle(to_world, to_world[:1]) < _SAME_POSE_RAD):  # the nodes stand as they were bound
        return turns, places
    there = np.array([bound[i][0] for i in known])
    above = [known.index(i) if (i := joints.index(parents[joints[one]])) in bound else -1 for one in known[1:]]
    pairs = [(i + 1, parent) for i, parent in enumerate(above) if parent >= 0]
    ours = sum(np.linalg.norm(places[known[i]] - places[known[j]]) for i, j in pairs)
    theirs = sum(np.linalg.norm(there[i] - there[j]) for i, j in pairs)
    turns, places = turns.copy(), places.copy()
    turns[known] = [bound[i][1] for i in known]
    places[known] = there * (ours / theirs if theirs > 0.0 else 1.0)
    return turns, places


def _unbound_rest(
    gltf: Gltf, parents: list[int], joints: list[int], names: tuple[str, ...], standing: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """Return the rest pose of joints without a skin: the nodes' pose, if a person stands in it, else zero rotations.

    Without a skin, programs write the nodes in the pose of a frame of the movement. If joints' axes lie along bones,
    the pose of zero rotations does not stand either; their axes then follow from it and from the movement
    (`motionmind.retarget.standing`).

    Args:
        gltf: the file.
        parents: of its nodes, -1 for none.
        joints: the body's nodes, each after its parent.
        names: the joints' names [J].
        standing: orientations [J, 4] and places [J, 3] in the nodes' pose.

    Warns:
        MotionMindWarning: a person stands in neither pose.
    """
    turns, places = standing
    rows = [joints.index(parents[node]) if i else -1 for i, node in enumerate(joints)]
    if zero_pose_rests(skeleton_at("", names, rows, places)) is not False:
        return standing
    above = parents[joints[0]]
    unturned = rot.IDENTITY if above < 0 else globals_at(gltf, parents, [above], {}, np.zeros(1))[0][0, 0]
    straight = places.copy()
    for joint, parent in enumerate(rows[1:], start=1):
        offset = rot.mul_vec(rot.inv(turns[parent]), places[joint] - places[parent])
        straight[joint] = straight[parent] + rot.mul_vec(unturned, offset)
    if not zero_pose_rests(skeleton_at("", names, rows, straight)):
        message = (
            f"{gltf.path}: neither a skin nor the nodes show the rest pose: joints are aligned by the movement, head "
            "and feet roughly (export it with a mesh)"
        )
        warnings.warn(message, MotionMindWarning, 7)
    return np.tile(unturned, (len(joints), 1)), straight


def skeleton_at(name: str, names: tuple[str, ...], parents: list[int], rest: Floats) -> Skeleton:
    """Build the skeleton from the joints' places at rest [J, 3]."""
    offsets = rest - rest[[max(parent, 0) for parent in parents]]
    return Skeleton(name, names, tuple(parents), offsets, np.zeros_like(offsets))


def heading_of(gltf: Gltf, parents: list[int], top: int) -> Floats:
    """Return the rotation [4] of the body's parent node if it is about the vertical, else the identity.

    Such a rotation is not a part of the rest pose.
    """
    if parents[top] < 0:
        return rot.IDENTITY
    turn = globals_at(gltf, parents, [parents[top]], {}, np.zeros(1))[0][0, 0]
    heading = rot.about_vertical(rot.heading(turn))
    return heading if rot.angle(turn, heading) < _SAME_POSE_RAD else rot.IDENTITY
