"""Poses of a glTF file's joints in the world, in motion and at rest.

Section numbers refer to "glTF 2.0 Specification", version 2.0.1, The Khronos Group (2021).
"""

from __future__ import annotations

import logging
import warnings
from dataclasses import dataclass

import numpy as np

from motionmind._typing import Floats
from motionmind.body.skeleton import Skeleton
from motionmind.display import displayed_path
from motionmind.errors import MotionMindWarning
from motionmind.formats._gltf import MIN_SCALE_RATIO, Gltf, from_matrix, to_trs
from motionmind.geometry import rotations as rot
from motionmind.retarget.fitting import zero_pose_rests

PATH_TYPES = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3"}
SAME_KEY_S = 1e-5  # keys no further apart are one; times have seven digits
_SAME_POSE_RAD = 1e-3

_log = logging.getLogger(__name__)


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
    # Joints first, so that the frames of each lie together.
    turns, places = np.empty((len(joints), len(times), 4)), np.empty((len(joints), len(times), 3))
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
        place, turn = place + rot.mul_vec(turn, scale * moved[0]), rot.mul(turn, moved[1])
        if node in number:
            i = number[node]
            places[i], turns[i] = place, turn
            place, turn = places[i], turns[i]
        frames[node] = place, turn, scale * moved[2]
    return rot.normalise(turns.swapaxes(0, 1)), places.swapaxes(0, 1)


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
    number = {node: i for i, node in enumerate(joints)}
    bound: dict[int, Floats] = {}
    for skin in gltf.document.skins:
        if skin.inverse_bind_matrices is not None:
            matrices = gltf.numbers(skin.inverse_bind_matrices, "MAT4", "skin")
            bound |= {number[node]: row for node, row in zip(skin.joints, matrices, strict=False) if node in number}
    known = sorted(joint for joint, row in bound.items() if np.any(row[:12]))
    if len(known) < len(bound):  # gltfpack writes zeros for an armature without a mesh
        path, missing = displayed_path(gltf.path), len(bound) - len(known)
        _log.info("%s: %d inverse bind matrices are zero; the nodes' pose is taken as the rest pose", path, missing)
    if not known and names is not None:
        return _unbound_rest(gltf, parents, joints, names, (turns, places))
    if len(known) < len(joints) - 1:
        return turns, places
    place, turn, scale = from_matrix(np.array([bound[i] for i in known]))
    bound_turns = rot.inv(turn)
    to_world = rot.mul_inv(turns[known], bound_turns)
    if np.all(rot.angle(to_world, to_world[:1]) < _SAME_POSE_RAD):  # the nodes stand as they were bound
        return turns, places
    there = -rot.mul_vec(bound_turns, place / scale)
    row = {joint: i for i, joint in enumerate(known)}
    above = [row.get(number[parents[joints[one]]], -1) for one in known[1:]]
    pairs = [(i + 1, parent) for i, parent in enumerate(above) if parent >= 0]
    ours = sum(np.linalg.norm(places[known[i]] - places[known[j]]) for i, j in pairs)
    theirs = sum(np.linalg.norm(there[i] - there[j]) for i, j in pairs)
    turns, places = turns.copy(), places.copy()
    turns[known] = bound_turns
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
    rows = parent_rows(parents, joints)
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
        warnings.warn(message, MotionMindWarning, 6)
    return np.tile(unturned, (len(joints), 1)), straight


def parent_rows(parents: list[int], joints: list[int]) -> list[int]:
    """Return the index among joints of each joint's parent, -1 for the first."""
    number = {node: i for i, node in enumerate(joints)}
    return [-1, *(number[parents[node]] for node in joints[1:])]


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
