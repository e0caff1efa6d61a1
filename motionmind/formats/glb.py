"""Writes glTF 2.0 in one binary file (`.glb`): movement as a skinned, animated body.

Section numbers refer to "glTF 2.0 Specification", version 2.0.1, The Khronos Group (2021); ISO/IEC 12113:2022.
glTF's world is ours (3.4): metres, y up, a person faces +z; its quaternions are x, y, z, w.

The layout makes programs recognise an armature:

- One node per joint, with the joint's name, in the skeleton's tree; only these nodes are the skin's joints. Leaves get
  no end bones: a bone in glTF is a frame without a length, readers choose lengths themselves, and every program that
  rewrites the file would return extra bones. Tips show in the mesh.
- The skin's inverse bind matrices define the rest pose: identity rotations, the lowest point on the floor, x = z = 0.
  Nodes have this pose too, for programs that take the rest pose from them.
- A mesh on that skin (`_glb_body`): an unused skin is a fault, and an animation without a skin is not an armature.
- One animation that rotates all joints and moves the root. A single frame has no animation: its nodes have the posture
  instead, which programs show without playing. The skin still holds the rest pose.
- Text in the root joint's `extras` (3.12) holds the rest (insertions, credits, whether frames are keyframes, tips of
  bones): Blender keeps it as a custom property of the bone, and exports it on request.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, Singles
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, name_of, write_atomically
from motionmind.formats._glb_body import COLOURS, Mesh, body_mesh
from motionmind.formats._gltf import COMPONENT_DTYPES, N_COMPONENTS
from motionmind.formats._json import MARKS_KEY, MarksSchema, insertion_schema, rounded
from motionmind.geometry import rotations as rot

_VERTEX_TARGET_CODE, _INDEX_TARGET_CODE = 34962, 34963  # targets of a buffer view (5.11.5)


def write_glb(path: FilePath, motion: Motion, *, has_root: bool = False) -> None:
    """Write `motion` as binary glTF.

    Interpolated (rotations by slerp, root linearly), all joints agree with `motion` to the seven digits of single
    precision. The first time becomes 0. Neighbouring quaternions lie in the same hemisphere, so readers that blend
    their components never turn the long way round. The same motion gives the same bytes.

    Args:
        path: the file to write.
        motion: the movement, on any skeleton.
        has_root: whether to put the body under a bone "root" that stays on the floor at the origin, unless its own
            root has this name.

    Raises:
        MotionMindError: the body or its path is longer than 1000 km, times are too close together for single
            precision, or the file cannot be written.
    """
    skeleton = motion.skeleton
    name = motion.name or skeleton.name
    for what, lengths in (("root", motion.root), ("offsets", skeleton.offsets), ("tips", skeleton.tips)):
        if np.abs(lengths).max() > 1e6:  # metres; single precision is off by centimetres there
            raise MotionMindError(f"{name}: {what}: GLB cannot hold {np.abs(lengths).max():.3g} metres")
    rest = at_rest(skeleton)
    moving, has_root = len(motion) > 1, has_root and skeleton.names[0].lower() != "root"
    buffer = GlbBuffer()
    mesh = body_mesh(skeleton, rest[0])
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "MotionMind"},
        "scene": 0,
        "scenes": [{"name": name, "nodes": [0, len(skeleton)]}],
        "nodes": [
            *(joint_nodes(skeleton, rest[0]) if moving else _posture_nodes(motion)),
            {"name": f"{skeleton.name} body", "mesh": 0, "skin": 0},  # 3.7.3: its own transform is ignored
        ],
        "meshes": [{"name": f"{skeleton.name} body", "primitives": _primitives(buffer, mesh)}],
        "materials": [_material(paint) for paint in mesh.paints],
        "skins": [
            {
                "name": skeleton.name,
                "joints": list(range(len(skeleton))),
                "skeleton": 0,
                "inverseBindMatrices": buffer.add(_inverse_binds(np.vstack([rest, np.zeros((int(has_root), 3))]))),
            }
        ],
    }
    if moving:
        document["animations"] = [animation_of(buffer, motion, name)]
    document["nodes"][0]["extras"] = {MARKS_KEY: encode_marks(path, motion)}
    if has_root:
        document["scenes"][0]["nodes"] = [len(skeleton) + 1, len(skeleton)]
        document["nodes"].append({"name": "root", "children": [0]})
        skin = document["skins"][0]
        skin["joints"].append(len(skeleton) + 1)
        skin["skeleton"] = len(skeleton) + 1
    document |= {
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    write_atomically(path, container(document, bytes(buffer.data), name))


def write_group_glb(path: FilePath, motions: Sequence[Motion]) -> None:
    """Write the movement of several dancers as binary glTF: a skinned body for each, and one animation of all.

    Args:
        path: the file to write.
        motions: the dancers' movement, on one clock; each has the dancer's name.

    Raises:
        MotionMindError: times are too close together for single precision, or the file cannot be written.
    """
    name = name_of(path)
    buffer, meshes = GlbBuffer(), dict[int, int]()
    document: dict[str, list[dict[str, Any]]] = {"nodes": [], "meshes": [], "materials": [], "skins": []}
    roots, channels = list[int](), list[tuple[int, str, int]]()
    clock = add_clock(buffer, motions[0], name)
    for motion in motions:
        skeleton, first = motion.skeleton, len(document["nodes"])
        rest = at_rest(skeleton)
        if id(skeleton) not in meshes:  # dancers of one piece share their body
            meshes[id(skeleton)] = len(document["meshes"])
            mesh, materials = body_mesh(skeleton, rest[0]), len(document["materials"])
            primitives = _primitives(buffer, mesh)
            for primitive in primitives:
                primitive["material"] += materials
            document["materials"] += [_material(paint) for paint in mesh.paints]
            document["meshes"].append({"name": f"{skeleton.name} body", "primitives": primitives})
        joints = joint_nodes(skeleton, rest[0])
        for node in joints:
            if "children" in node:
                node["children"] = [first + child for child in node["children"]]
        body = {"name": f"{motion.name} body", "mesh": meshes[id(skeleton)], "skin": len(document["skins"])}
        roots += [first + len(joints), first + len(joints) + 1]  # skinned meshes belong at the top (3.7.3)
        document["nodes"] += [*joints, {"name": motion.name, "children": [first]}, body]
        numbers = list(range(first, first + len(joints)))
        binds = buffer.add(_inverse_binds(rest))
        skin = {"name": motion.name, "joints": numbers, "skeleton": first, "inverseBindMatrices": binds}
        document["skins"].append(skin)
        channels += _channels(buffer, motion, first)
    whole = {
        "asset": {"version": "2.0", "generator": "MotionMind"},
        "scene": 0,
        "scenes": [{"name": name, "nodes": roots}],
        **document,
        "animations": [animation(name, clock, channels)],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    write_atomically(path, container(whole, bytes(buffer.data), name))


def encode_marks(path: FilePath, motion: Motion) -> str:
    """Return JSON of MarksSchema: all that glTF cannot hold, with times from the first frame on; "{}" if nothing."""
    # A file's movement takes the file's name, but credits of given movement its own.
    recorded = motion.own_credits if motion.name and motion.name != name_of(path) else motion.recorded
    insertions = [insertion_schema(one, float(motion.times[0])) for one in motion.insertions]
    body = motion.skeleton
    tips = {name: rounded(tip).tolist() for name, tip in zip(body.names, body.tips, strict=True) if tip.any()}
    return msgspec.json.encode(MarksSchema(insertions, motion.keyframed, list(recorded), tips)).decode()


class GlbBuffer:
    """The binary chunk under construction, with the views and accessors that describe it (3.6)."""

    def __init__(self, data: bytes = b"", views: Sequence[Any] = (), accessors: Sequence[Any] = ()) -> None:
        self.data = bytearray(data + b"\0" * (-len(data) % 4))
        self.views: list[dict[str, Any]] = [*views]
        self.accessors: list[dict[str, Any]] = [*accessors]

    def add(self, array: NDArray[Any], *, target: int | None = None, bounds: bool = False) -> int:
        """Append an array [n] or [n, components] with a view of its own; return its accessor's index."""
        view = self.view(array, target)
        return self.accessor(view, array, bounds=bounds)

    def view(self, array: NDArray[Any], target: int | None = None) -> int:
        """Append an array with rows of a multiple of 4 bytes, for alignment (3.6.2.4); return its view's index."""
        data = array.tobytes()
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)})
        if target is not None:
            self.views[-1]["target"] = target
        self.data += data
        return len(self.views) - 1

    def accessor(self, view: int, array: NDArray[Any], *, offset: int = 0, bounds: bool = False) -> int:
        """Add an accessor to a view from byte `offset` on, for an array of this shape and type; return its index."""
        rows = array.reshape(len(array), -1)
        component_types = {dtype: code for code, dtype in COMPONENT_DTYPES.items()}
        types = {count: name for name, count in N_COMPONENTS.items()}
        accessor = {
            "bufferView": view,
            "byteOffset": offset,
            "componentType": component_types[array.dtype.str],
            "count": len(rows),
            "type": types[rows.shape[1]],
        }
        if bounds:
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def container(document: dict[str, Any], data: bytes, name: str) -> bytes:
    """Return the file's bytes: a header, the JSON padded with spaces, the binary data (4.4)."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    whole = 12 + 8 + len(text) + 8 + len(data)
    if whole >= 2**32:
        raise MotionMindError(f"{name}: {whole} bytes are more than GLB holds, 4 GiB (resample the motion, or cut it)")
    return b"".join(
        [
            struct.pack("<4sII", b"glTF", 2, whole),
            struct.pack("<I4s", len(text), b"JSON"),
            text,
            struct.pack("<I4s", len(data), b"BIN\0"),
            data,
        ]
    )


# --- the armature ---------------------------------------------------------------------------------------------------


def at_rest(skeleton: Skeleton) -> Floats:
    """Return the joints' places at rest [J, 3], metres: the root above the origin, the lowest point at height 0."""
    lowest = skeleton.rest[:, 1].min()
    return np.asarray(skeleton.rest[: len(skeleton)] - np.array([0.0, lowest, 0.0]))


def joint_nodes(skeleton: Skeleton, root: Floats) -> list[dict[str, Any]]:
    """Return the joints' nodes in order, at rest: a node without a rotation has the identity (3.5.3)."""
    nodes: list[dict[str, Any]] = []
    for joint, name in enumerate(skeleton.names):
        place = skeleton.offsets[joint] if joint else root
        nodes.append({"name": name, "translation": rounded(place).tolist()})
        if children := skeleton.children(joint):
            nodes[-1]["children"] = children
    return nodes


def _posture_nodes(motion: Motion) -> list[dict[str, Any]]:
    """Return the joints' nodes in the first posture."""
    nodes = joint_nodes(motion.skeleton, motion.root[0])
    for node, rotation in zip(nodes, rot.canonical(motion.rotations[0]), strict=True):
        node["rotation"] = rounded(rotation).tolist()
    return nodes


def _inverse_binds(rest: Floats) -> Singles:
    """Return the inverse bind matrices [J, 16], column by column: from the rest pose to each joint's frame (3.7.3).

    Frames at rest have the world's axes, so each is a translation.
    """
    matrices = np.tile(np.eye(4), (len(rest), 1, 1))
    matrices[:, 3, :3] = 0.0 - rest
    return matrices.reshape(-1, 16).astype("<f4")


# --- the mesh -------------------------------------------------------------------------------------------------------


def _primitives(buffer: GlbBuffer, mesh: Mesh) -> list[dict[str, Any]]:
    """Return one primitive per paint, all on the same vertices; each vertex has weight 1 at one joint (3.7.3)."""
    joints, weights = np.zeros((len(mesh.joints), 4), "<u2"), np.zeros((len(mesh.joints), 4), "<f4")
    joints[:, 0], weights[:, 0] = mesh.joints, 1.0
    attributes = {
        "POSITION": buffer.add(mesh.positions.astype("<f4"), target=_VERTEX_TARGET_CODE, bounds=True),
        "NORMAL": buffer.add(mesh.normals.astype("<f4"), target=_VERTEX_TARGET_CODE),
        "JOINTS_0": buffer.add(joints, target=_VERTEX_TARGET_CODE),
        "WEIGHTS_0": buffer.add(weights, target=_VERTEX_TARGET_CODE),
    }
    return [
        {
            "attributes": attributes,
            "indices": buffer.add(chosen.astype("<u4"), target=_INDEX_TARGET_CODE),
            "material": number,
        }
        for number, chosen in enumerate(mesh.paints.values())
    ]


def _material(paint: str) -> dict[str, Any]:
    """Return a matte material. Vertex colours would not show in every program."""
    srgb = np.array(COLOURS[paint]) / 255.0
    # 3.9.2: factors are linear. IEC 61966-2-1; no colour is dark enough for its linear segment.
    linear = ((srgb + 0.055) / 1.055) ** 2.4
    colour = [*np.round(linear, 4).tolist(), 1.0]
    return {
        "name": paint,
        "pbrMetallicRoughness": {"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.8},
    }


# --- the movement ---------------------------------------------------------------------------------------------------


def animation_of(buffer: GlbBuffer, motion: Motion, name: str) -> dict[str, Any]:
    """Return an animation: a sampler and a channel for each joint's rotations, and for the root's places (3.11)."""
    return animation(name, add_clock(buffer, motion, name), _channels(buffer, motion))


def _channels(buffer: GlbBuffer, motion: Motion, first: int = 0) -> list[tuple[int, str, int]]:
    """Append a motion's values; return each channel's node, path and accessor, given the root's node."""
    outputs = [(first, "translation", buffer.add(motion.root.astype("<f4")))]
    rotations = continuous(motion.rotations).swapaxes(0, 1).astype("<f4")  # [J, T, 4]
    view = buffer.view(rotations)
    outputs += [
        (first + joint, "rotation", buffer.accessor(view, turns, offset=joint * turns.nbytes))
        for joint, turns in enumerate(rotations)
    ]
    return outputs


def add_clock(buffer: GlbBuffer, motion: Motion, name: str) -> int:
    """Append a motion's times, from 0 on; return the accessor's index.

    Raises:
        MotionMindError: two of them are equal in single precision.
    """
    times = (motion.times - motion.times[0]).astype("<f4")
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if len(late):
        frame = int(late[0]) + 1
        gap = motion.times[frame] - motion.times[frame - 1]
        raise MotionMindError(
            f"{name}: frame {frame} is {gap:.3g} s after the one before it, at {times[frame]:.6g} s: too close for GLB "
            "(resample the motion, or cut it)"
        )
    return buffer.add(times, bounds=True)


def animation(name: str, clock: int, outputs: Sequence[tuple[int, str, int]]) -> dict[str, Any]:
    """Return an animation from the accessor of its times, and each channel's node, path and accessor."""
    return {
        "name": name,
        "samplers": [{"input": clock, "interpolation": "LINEAR", "output": output} for _, _, output in outputs],
        "channels": [
            {"sampler": sampler, "target": {"node": node, "path": path}}
            for sampler, (node, path, _) in enumerate(outputs)
        ],
    }


def continuous(rotations: Floats) -> Floats:
    """Return rotations [T, J, 4] by quaternions that begin canonical and stay in the hemisphere of the one before."""
    return rot.continuous(np.concatenate([rot.canonical(rotations[:1]), rotations[1:]]))
