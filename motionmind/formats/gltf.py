"""Reads glTF 2.0 (`.glb`, `.gltf`) and formats based on it: VRM bodies (`.vrm`) and VRM animations (`.vrma`).

Section numbers refer to "glTF 2.0 Specification", version 2.0.1, The Khronos Group (2021).

The body consists of the nodes that the file lists as a person's bones (VRM), else of the joints of its skins, else of
the animated nodes; with all nodes between them. Frames of bones may point anywhere at rest, so the movement is read
onto joints whose axes at rest are the world's: with all rotations 0 the skeleton is in the file's rest pose. This is
the pose in which the mesh was bound to the joints (3.7.3); without a mesh, the nodes' pose; or, if that is a frame of
the movement, the pose of zero rotations.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.body.human import BODIES
from motionmind.body.motion import Motion
from motionmind.body.rates import FILM_FPS, check_size
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindWarning, enumerated
from motionmind.files import FilePath, name_of
from motionmind.formats import _json
from motionmind.formats._bvh_rig import NormalisedRig, Placed, normalise
from motionmind.formats._gltf import Animation, Gltf, Humanoid, read_container
from motionmind.formats._gltf_poses import (
    PATH_TYPES,
    SAME_KEY_S,
    Track,
    Tracks,
    globals_at,
    heading_of,
    lineage,
    rest_pose,
    skeleton_at,
)
from motionmind.formats._json import MARKS_KEY, MarksSchema
from motionmind.formats.text import MAX_JOINTS, MAX_NUMBER
from motionmind.formats.units import bone_span, metres_per_unit
from motionmind.geometry import rotations as rot

_CURVE_FPS = 30.0  # of curves and jumps, unless the file has a faster even clock


def read_gltf(path: FilePath, *, unit: str | float | None = None) -> Motion:
    """Read a motion from glTF, on the file's own bones; a file without animation is a posture, one frame.

    There is a frame at each key, or at each tick of the even clock that the keys lie on; curves and jumps between keys
    are sampled at the clock's rate or 30 frames a second. If there are several animations, the first that moves the
    body is read, with a warning. MotionMind's own files come back whole, marks of insertions included.

    Args:
        path: the file; its stem becomes the motion's name.
        unit: a name in `UNITS`, or metres in one unit of the file; None takes metres, as glTF defines.

    Returns:
        The motion, in metres and seconds, starting at time 0.

    Raises:
        FormatError: the file does not exist, is not glTF 2, holds no body, or compresses its movement.
        MotionMindError: `unit` is invalid, or there are too many frames.

    Warns:
        MotionMindWarning: there are several bodies or animations, or joints move against their parents.
    """
    scale = 1.0 if unit is None else metres_per_unit(unit)
    gltf = read_container(path)
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            return _read(gltf, scale)
    except (FormatError, ValueError) as error:
        raise error if isinstance(error, FormatError) else gltf.fault(f"not movement: {error}") from error


@dataclass(frozen=True)
class GltfBody:
    """The body in a glTF file, and what moves it.

    Attributes:
        gltf: the file.
        parents: index of each node's parent, -1 for none.
        joints: the body's nodes [J], each after its parent.
        names: their names, no two alike.
        skin: name of the skin, "" for none.
        tracks: the tracks of all nodes that the animation of the body moves.
        others: names of the animations that are not read.
        times: times of the frames [T], seconds: the keys of the joints and of the nodes above them.
        rest_turns: orientations of the joints at rest, without the heading of the nodes above [J, 4].
        rest: their places at rest [J, 3].
    """

    gltf: Gltf
    parents: list[int]
    joints: list[int]
    names: tuple[str, ...]
    skin: str
    tracks: Tracks
    others: list[str]
    times: Floats
    rest_turns: Floats
    rest: Floats


def find_body(gltf: Gltf) -> GltfBody:
    """Find the body in a file; FormatError if there is none."""
    parents = _parents(gltf)
    names, skins = _bone_names(gltf), _skins(gltf)
    is_person = bool(names)
    carriers = set(names) or {node for _, joints in skins for node in joints}
    tracks, others = _find_tracks(gltf, set(lineage(parents, carriers)))
    joints, skin_name = _find_joints(gltf, parents, names, skins, {node for node, path in tracks if path == "rotation"})
    for node, name in enumerate(gltf.document.nodes):
        names.setdefault(node, name.name or f"node {node}")
    movers = set(lineage(parents, joints))
    times = _clock({key: track for key, track in tracks.items() if key[0] in movers}, len(joints), str(gltf.path))
    called = _distinct([names[node] for node in joints])
    rest_turns, rest = rest_pose(gltf, parents, joints, None if is_person else called)
    heading = heading_of(gltf, parents, joints[0])
    rest_turns, rest = rot.inv_mul(heading, rest_turns), rot.mul_vec(rot.inv(heading), rest)
    return GltfBody(gltf, parents, joints, called, skin_name, tracks, others, times, rest_turns, rest)


def _read(gltf: Gltf, scale: float) -> Motion:
    """Read the motion; lengths are in units of `scale` metres."""
    body = find_body(gltf)
    joints, times = body.joints, body.times
    turns, places = globals_at(gltf, body.parents, joints, body.tracks, times)
    for what, array in (("rest pose", body.rest), ("movement", places)):
        if not np.all(np.abs(array) <= MAX_NUMBER):
            raise gltf.fault(f"its {what} reaches beyond {MAX_NUMBER:g} m")
    if body.others:
        warnings.warn(
            f"{gltf.path}: the first animation that moves is read, not {enumerated(body.others)}", MotionMindWarning, 5
        )
    above = [joints.index(body.parents[node]) if i else -1 for i, node in enumerate(joints)]
    skeleton = skeleton_at(body.skin or name_of(gltf.path), body.names, above, body.rest)
    turned = rot.mul_inv(turns, body.rest_turns)
    rig = _placed(skeleton, turned, places)
    for message in rig.repairs(scale):
        warnings.warn(f"{gltf.path}: {message}", MotionMindWarning, 5)
    marks = _marks(gltf)
    tipped = _with_tips(rig.skeleton, marks, scale)
    return Motion(
        tipped,
        rot.normalise(rig.rotations),
        rig.root * scale,
        times - times[0],
        name=name_of(gltf.path),
        insertions=tuple(
            one.renamed({name: name for name in tipped.names}) for one in map(_json.to_insertion, marks.insertions)
        ),
        keyframed=marks.keyframed,
        recorded=tuple(marks.recorded),
    )


# --- the tree -------------------------------------------------------------------------------------------------------


def _parents(gltf: Gltf) -> list[int]:
    """Return each node's parent, -1 for none; FormatError if the nodes are not trees."""
    nodes = gltf.document.nodes
    parents = [-1] * len(nodes)
    for node, one in enumerate(nodes):
        for child in one.children:
            gltf.member(nodes, child, f"node {node}: child")
            if parents[child] >= 0:
                raise gltf.fault(f"node {child} hangs from both node {parents[child]} and node {node}")
            parents[child] = node
    reached = [node for node, parent in enumerate(parents) if parent < 0]
    for node in reached:
        reached += nodes[node].children
    if len(reached) < len(nodes):
        raise gltf.fault(f"node {min(set(range(len(nodes))) - set(reached))} hangs from itself")
    return parents


def _bone_names(gltf: Gltf) -> dict[int, str]:
    """Return {node: VRM's name} of a person's bones, as VRM's extensions list them; empty without them."""
    for extension in ("VRMC_vrm", "VRMC_vrm_animation", "VRM"):
        if extension in gltf.document.extensions:
            bones = _json.decode(bytes(gltf.document.extensions[extension]), Humanoid, gltf.path).humanoid.human_bones
            rows = bones.items() if isinstance(bones, dict) else [(bone.bone, bone) for bone in bones]
            named = {bone.node: name for name, bone in rows}
            for node, name in named.items():
                gltf.member(gltf.document.nodes, node, f"{extension}: {name}: node")
            if named:
                return named
    return {}


def _find_joints(
    gltf: Gltf, parents: list[int], bones: dict[int, str], skins: list[tuple[str, set[int]]], moving: set[int]
) -> tuple[list[int], str]:
    """Return the body's nodes, each after its parent, and the name of its skin, "" for none."""
    name, wanted = "", set(bones)
    if skins and not wanted:
        name, wanted = skins[0]
        if left := [skin or "a skin without a name" for skin, _ in skins[1:]]:
            message = f"{gltf.path}: {name or 'the largest skin'} is read, not {enumerated(left)}"
            warnings.warn(message, MotionMindWarning, 7)
    wanted = wanted or moving
    if not wanted:
        raise gltf.fault("nothing moves: there is no skin, no person's bone and no animation of nodes")
    if len(wanted) > MAX_JOINTS:
        raise gltf.fault(f"{len(wanted)} joints are more than a body has, {MAX_JOINTS}")
    line = lineage(parents, wanted)
    tops = [node for node in line if parents[node] < 0]
    if len(tops) > 1:
        raise gltf.fault(f"its joints have {len(tops)} roots; a body has one")
    # The body begins at the first joint or branch; nodes above it move it but are not joints.
    below = dict.fromkeys(line, 0)
    for node in line[1:]:
        below[parents[node]] += 1
    top = next(node for node in line if node in wanted or below[node] > 1)
    joints = line[line.index(top) :]
    if len(joints) > MAX_JOINTS:
        raise gltf.fault(f"{len(joints)} joints are more than a body has, {MAX_JOINTS}")
    return joints, name


def _skins(gltf: Gltf) -> list[tuple[str, set[int]]]:
    """Return the names and joints of bodies, the largest first; skins that share joints belong to one body."""
    groups: list[tuple[str, set[int]]] = []
    for number, skin in enumerate(gltf.document.skins):
        for node in skin.joints:
            gltf.member(gltf.document.nodes, node, f"skin {number}: joint")
        joints = set(skin.joints)
        near = [group for group in groups if group[1] & joints]
        name = near[0][0] if near else skin.name
        groups = [group for group in groups if group not in near]
        groups.append((name, joints.union(*(group[1] for group in near))))
    return sorted((group for group in groups if group[1]), key=lambda group: -len(group[1]))


def _distinct(names: list[str]) -> tuple[str, ...]:
    """Make names unique by appending numbers to repeated ones."""
    found: dict[str, None] = {}
    for name in names:
        unique, number = name, 1
        while unique in found:
            number += 1
            unique = f"{name} {number}"
        found[unique] = None
    return tuple(found)


# --- the movement ---------------------------------------------------------------------------------------------------


def _find_tracks(gltf: Gltf, body: set[int]) -> tuple[Tracks, list[str]]:
    """Return the tracks of the first animation that moves nodes of `body`, and the other animations' names.

    If `body` is empty, any nodes count. Animations of one key are poses, read only if there is nothing else. Several
    animations of one node each make up one movement.
    """
    animations = [
        one
        for one in gltf.document.animations
        if any(
            channel.target.path in PATH_TYPES and (channel.target.node in body or not body) for channel in one.channels
        )
    ]
    animations.sort(key=lambda one: _is_pose(gltf, one))  # keeps their order otherwise
    moving = [one for one in animations if not _is_pose(gltf, one)]
    targets = [(channel.target.node, channel.target.path) for one in moving for channel in one.channels]
    if (
        len(moving) > 1
        and len({*targets}) == len(targets)
        and all(len({channel.target.node for channel in one.channels}) == 1 for one in moving)
    ):
        return {key: track for one in moving for key, track in _tracks(gltf, one).items()}, []
    names = [one.name or "one without a name" for one in animations[1:]]
    return (_tracks(gltf, animations[0]) if animations else {}), names


def _is_pose(gltf: Gltf, animation: Animation) -> bool:
    """Return whether an animation has only one key."""
    rows = gltf.document.accessors
    return all(not 0 <= one.input < len(rows) or rows[one.input].count <= 1 for one in animation.samplers)


def _tracks(gltf: Gltf, animation: Animation) -> Tracks:
    """Return the tracks of an animation."""
    found: Tracks = {}
    for number, channel in enumerate(animation.channels):
        node, path = channel.target.node, channel.target.path
        if node is None or path not in PATH_TYPES:
            continue
        what = f"animation {animation.name or 'without a name'}, channel {number}"
        gltf.member(gltf.document.nodes, node, f"{what}: node")
        sampler = gltf.member(animation.samplers, channel.sampler, f"{what}: sampler")
        times = gltf.numbers(sampler.input, "SCALAR", what)[:, 0]
        values = gltf.numbers(sampler.output, PATH_TYPES[path], what)
        if sampler.interpolation not in ("LINEAR", "STEP", "CUBICSPLINE"):
            raise gltf.fault(f"{what}: interpolation {sampler.interpolation!r} is unknown")
        if np.any(np.diff(times) <= 0.0):
            raise gltf.fault(f"{what}: its times do not increase")
        curve = sampler.interpolation == "CUBICSPLINE"
        if len(values) != len(times) * (3 if curve else 1):
            raise gltf.fault(f"{what}: {len(values)} values for {len(times)} times")
        values = values.reshape(len(times), 3, -1) if curve else values
        if path == "rotation":
            keys = values[:, 1] if curve else values
            if not np.all(rot.norm(keys) > 1e-5):
                raise gltf.fault(f"{what}: a rotation is zero")
            values = values if curve else rot.normalise(values)
        found[node, path] = Track(times, values, sampler.interpolation)
    return found


def _clock(tracks: Tracks, joints: int, name: str) -> Floats:
    """Return the times of frames [T], seconds: those of the keys, on an even clock if they lie on one."""
    if not tracks:
        return np.zeros(1)
    times = np.unique(np.concatenate([track.times for track in tracks.values()]))
    times = times[np.concatenate([[True], np.diff(times) > max(SAME_KEY_S, 1e-6 * float(np.abs(times).max()))])]
    check_size(len(times), joints, name)
    if len(times) == 1:
        return np.asarray(times)
    span, step = float(times[-1] - times[0]), float(np.median(np.diff(times)))
    frames = np.round((times - times[0]) / step)
    # Keys are even within 2 % of a step, and fill a quarter of the clock's ticks.
    even = bool(np.all(np.abs(times - times[0] - frames * step) <= 0.02 * step))
    even = even and len(np.unique(frames)) == len(frames) and frames[-1] < 4 * len(times)
    check_size(frames[-1] + 1.0 if even else 1.0, joints, name)
    rate = frames[-1] / span if even else _CURVE_FPS
    if abs(round(rate, 2) - rate) < 1e-5 * rate:
        rate = round(rate, 2)  # times have seven digits
    if all(track.kind == "LINEAR" or len(track.times) == 1 for track in tracks.values()):
        return np.asarray(times[0] + np.arange(frames[-1] + 1) / rate if even else times)
    if rate < FILM_FPS:
        rate *= float(np.ceil(_CURVE_FPS / rate))
    count = np.floor(span * rate + 1e-3)
    check_size(count + 1.0, joints, name)
    return np.asarray(times[0] + np.arange(count + 1) / rate)


def _placed(skeleton: Skeleton, turned: Floats, places: Floats) -> NormalisedRig:
    """Reduce orientations [T, J, 4] and places [T, J, 3] in the world to constant offsets."""
    span = bone_span(np.array(skeleton.parents), skeleton.offsets, skeleton.tips)
    moved = {0: places[:, 0]}
    for joint, parent in enumerate(skeleton.parents[1:], start=1):
        place = rot.mul_vec(rot.inv(turned[:, parent]), places[:, joint] - places[:, parent])
        if np.abs(place - skeleton.offsets[joint]).max() > 1e-5 * span:
            moved[joint] = place
    return normalise(Placed(skeleton, skeleton.local_rotations(turned), moved))


# --- marks ----------------------------------------------------------------------------------------------------------


def _marks(gltf: Gltf) -> MarksSchema:
    """Return the marks in a node's extras; empty ones if there are none of MotionMind's."""
    for node in gltf.document.nodes:
        if MARKS_KEY.encode() in bytes(node.extras):
            try:
                return msgspec.json.decode(msgspec.json.decode(node.extras)[MARKS_KEY], type=MarksSchema)
            except (msgspec.MsgspecError, KeyError, TypeError, RecursionError, ValueError):
                continue
    return MarksSchema()


def _with_tips(skeleton: Skeleton, marks: MarksSchema, scale: float) -> Skeleton:
    """Return the skeleton in metres, with tips from the marks, or from the built-in body with the same joints."""
    body = replace(skeleton, offsets=skeleton.offsets * scale)
    tips = np.array([marks.tips.get(name, (0.0, 0.0, 0.0)) for name in body.names])
    ours = next((make() for make in BODIES.values() if make().difference(body) is None), None)
    if not marks.tips and ours is not None:
        lengths = np.linalg.norm(body.offsets, axis=-1).sum(), np.linalg.norm(ours.offsets, axis=-1).sum()
        # Only if it rests in the built-in body's pose: cosine of all offsets above 0.8.
        if np.sum(body.offsets * ours.offsets) > 0.8 * np.linalg.norm(body.offsets) * np.linalg.norm(ours.offsets):
            tips = ours.tips * float(lengths[0] / lengths[1])
    return replace(body, tips=tips)
