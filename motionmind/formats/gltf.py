"""Reads glTF 2.0 (`.glb`, `.gltf`) and formats based on it: VRM bodies (`.vrm`) and VRM animations (`.vrma`).

Section numbers refer to "glTF 2.0 Specification", version 2.0.1, The Khronos Group (2021).

The body consists of the nodes that the file lists as a person's bones (VRM), else of the joints of its skins, else of
the animated nodes; with all nodes between them. Frames of bones may point anywhere at rest, so the movement is read
onto joints whose axes at rest are the world's: with all rotations 0 the skeleton is in the file's rest pose. This is
the pose in which the mesh was bound to the joints (3.7.3); without a mesh, the nodes' pose; or, if that is a frame of
the movement, the pose of zero rotations.
"""

from __future__ import annotations

import shlex
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property

import msgspec
import numpy as np
from networkx.utils import UnionFind

from motionmind._typing import Floats
from motionmind.body.human import BODIES
from motionmind.body.motion import Motion
from motionmind.body.rates import FILM_FPS, MAX_POSITIONS, check_size
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindWarning, enumerated
from motionmind.files import FilePath, name_of
from motionmind.formats import _json
from motionmind.formats._bvh_rig import NormalisedRig, Placed, normalise
from motionmind.formats._gltf import Gltf, Humanoid, read_container
from motionmind.formats._gltf_clips import Clips, find_clips, tracks_of
from motionmind.formats._gltf_poses import (
    SAME_KEY_S,
    Tracks,
    globals_at,
    heading_of,
    lineage,
    parent_rows,
    rest_pose,
    skeleton_at,
)
from motionmind.formats._json import MARKS_KEY, MarksSchema
from motionmind.formats.text import MAX_JOINTS, MAX_NUMBER
from motionmind.formats.units import bone_span, metres_per_unit
from motionmind.geometry import rotations as rot

_CURVE_FPS = 30.0  # of curves and jumps, unless the file has a faster even clock
_MIN_CLIP_FRAMES = 30  # a shorter clip takes as long to read


def read_gltf(path: FilePath, *, clip: str | None = None, unit: str | float | None = None) -> Motion:
    """Read a motion from glTF, on the file's own bones; a file without animation is a posture, one frame.

    There is a frame at each key, or at each tick of the even clock that the keys lie on; curves and jumps between keys
    are sampled at the clock's rate or 30 frames a second. If there are several animations and none is named, the first
    that moves the body is read, with a warning; but animations of one node each, equally long, are one movement.
    MotionMind's own files come back whole, marks of insertions included.

    Args:
        path: the file; its stem becomes the motion's name, and "stem#clip" with a clip.
        clip: the animation to read, by its name or its number from 1; None for the usual one.
        unit: a name in `UNITS`, or metres in one unit of the file; None takes metres, as glTF defines.

    Returns:
        The motion, in metres and seconds, starting at time 0.

    Raises:
        FormatError: the file does not exist, is not glTF 2, holds no body or no such clip, or compresses its movement.
        MotionMindError: `unit` is invalid, or there are too many frames.

    Warns:
        MotionMindWarning: there are several bodies or animations, or joints move against their parents.
    """
    scale = 1.0 if unit is None else metres_per_unit(unit)
    gltf = read_container(path)
    with _as_faults(gltf):
        body = find_body(gltf, clip)
        if clip is None and (others := body.others):
            message = (
                f"{path}: the first animation that moves is read, not {enumerated(others)}; name another, as "
                f"{shlex.quote(f'{path}#{others[0]}')}"
            )
            warnings.warn(message, MotionMindWarning, 3)
        if clip is None:
            _report(body)
        return _read(body, scale, None if clip is None else body.clips.names[body.clips.chosen[0]])


def read_gltf_clips(path: FilePath, *, unit: str | float | None = None) -> Iterator[Motion]:
    """Read all clips of a glTF file that move the body, poses included, as `read_gltf` reads one.

    If there are several, each has a name of the form "stem#clip".

    Raises:
        FormatError: as of `read_gltf`, or the clips have more frames than the file's size explains.
    """
    scale = 1.0 if unit is None else metres_per_unit(unit)
    gltf = read_container(path)
    with _as_faults(gltf):
        body = find_body(gltf)
        _report(body)
    if not body.clips.are_several:
        with _as_faults(gltf):
            yield _read(body, scale, None)
        return
    played = [replace(body.clips, chosen=(number,)) for number in body.clips.moving]
    positions = 0
    for clips in played:
        with _as_faults(gltf):
            positions += max(len(replace(body, clips=clips).times), _MIN_CLIP_FRAMES) * len(body.joints)
        # Clips may share numbers, so that a small file could hold hours.
        if positions > max(MAX_POSITIONS, gltf.size):
            raise gltf.fault(f"its {len(played)} clips are too long to be read together: name those to read")
    for clips in played:
        with _as_faults(gltf):
            yield _read(replace(body, clips=clips), scale, body.clips.names[clips.chosen[0]])


@contextmanager
def _as_faults(gltf: Gltf) -> Iterator[None]:
    """Turn numbers that overflow, and values that make no rotation, into FormatErrors of a file."""
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            yield
    except (FormatError, ValueError) as error:
        raise error if isinstance(error, FormatError) else gltf.fault(f"not movement: {error}") from error


def _report(body: GltfBody) -> None:
    """Warn if animations are read as one movement, or move other bodies."""
    clips = body.clips
    if len(clips.chosen) > 1:
        message = (
            f"{body.gltf.path}: {len(clips.chosen)} animations of one node each, equally long, are read as one "
            f"movement: {enumerated(clips.names[one] for one in clips.chosen)}"
        )
        warnings.warn(message, MotionMindWarning, 4)
    if clips.apart:
        others = enumerated(clips.names[one] for one in clips.apart)
        message = f"{body.gltf.path}: animations of another body are not read: {others}; name one to read it"
        warnings.warn(message, MotionMindWarning, 4)


@dataclass(frozen=True)
class GltfBody:
    """The body in a glTF file, and what moves it.

    Attributes:
        gltf: the file.
        parents: index of each node's parent, -1 for none.
        joints: the body's nodes [J], each after its parent.
        names: their names, no two alike.
        skin: name of the skin, "" for none.
        clips: the animations that move the body.
        rest_turns: orientations of the joints at rest, without the heading of the nodes above [J, 4].
        rest: their places at rest [J, 3].
    """

    gltf: Gltf
    parents: list[int]
    joints: list[int]
    names: tuple[str, ...]
    skin: str
    clips: Clips
    rest_turns: Floats
    rest: Floats

    @property
    def others(self) -> list[str]:
        """Names of the clips that are not read."""
        chosen = set(self.clips.chosen)
        return [self.clips.names[one] for one in self.clips.moving if one not in chosen]

    @cached_property
    def tracks(self) -> Tracks:
        """The tracks of all nodes that the chosen animations move."""
        animations = self.gltf.document.animations
        return {key: track for one in self.clips.chosen for key, track in tracks_of(self.gltf, animations[one]).items()}

    @cached_property
    def times(self) -> Floats:
        """Times of the frames [T], seconds: the keys of the joints and of the nodes above them."""
        movers = set(lineage(self.parents, self.joints))
        tracks = {key: track for key, track in self.tracks.items() if key[0] in movers}
        # The root's place counts as one more, and nodes above the joints cost as much as joints.
        return _clock(tracks, len(movers) + 1, str(self.gltf.path))


def find_body(gltf: Gltf, clip: str | None = None) -> GltfBody:
    """Find the body in a file, and the clip of this name, or the usual one; FormatError if there is none."""
    parents = _parents(gltf)
    names, skins = _bone_names(gltf), _skins(gltf)
    is_person = bool(names)
    carriers = set(names) or {node for _, joints in skins for node in joints}
    clips = find_clips(gltf, parents, set(lineage(parents, carriers)), clip)
    joints, skin_name = _find_joints(gltf, parents, names, skins, set(clips.turned))
    for node, name in enumerate(gltf.document.nodes):
        names.setdefault(node, name.name or f"node {node}")
    called = _distinct([names[node] for node in joints])
    rest_turns, rest = rest_pose(gltf, parents, joints, None if is_person else called)
    heading = heading_of(gltf, parents, joints[0])
    rest_turns, rest = rot.inv_mul(heading, rest_turns), rot.mul_vec(rot.inv(heading), rest)
    return GltfBody(gltf, parents, joints, called, skin_name, clips, rest_turns, rest)


def _read(body: GltfBody, scale: float, clip: str | None) -> Motion:
    """Read the motion; lengths are in units of `scale` metres, and `clip` is the name of its clip, if it needs one."""
    gltf, joints, times = body.gltf, body.joints, body.times
    turns, places = globals_at(gltf, body.parents, joints, body.tracks, times)
    for what, array in (("rest pose", body.rest), ("movement", places)):
        if not np.all(np.abs(array) <= MAX_NUMBER):
            raise gltf.fault(f"its {what} reaches beyond {MAX_NUMBER:g} m")
    stem = name_of(gltf.path)
    skeleton = skeleton_at(body.skin or stem, body.names, parent_rows(body.parents, joints), body.rest)
    turned = rot.mul_inv(turns, body.rest_turns)
    rig = _placed(skeleton, turned, places)
    for message in rig.repairs(scale):
        warnings.warn(f"{gltf.path}{'' if clip is None else '#' + clip}: {message}", MotionMindWarning, 4)
    marks = _marks(gltf)
    tipped = _with_tips(rig.skeleton, marks, scale)
    if body.clips.chosen != body.clips.usual:
        marks = MarksSchema()  # they belong to the movement that was written, which comes first
    known = frozenset(tipped.names)
    return Motion(
        tipped,
        rot.normalise(rig.rotations),
        rig.root * scale,
        times - times[0],
        name=stem if clip is None else f"{stem}#{clip}",
        insertions=tuple(
            replace(one, bridged=tuple(pair for pair in one.bridged if pair[0] in known))
            for one in map(_json.to_insertion, marks.insertions)
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
            warnings.warn(message, MotionMindWarning, 5)
    wanted = wanted or moving
    if not wanted:
        raise gltf.fault("nothing moves: there is no skin, no person's bone and no animation of nodes")
    line = lineage(parents, wanted)
    if len(line) > MAX_JOINTS:
        raise gltf.fault(f"{len(line)} joints and nodes above them are more than a body has, {MAX_JOINTS}")
    tops = [node for node in line if parents[node] < 0]
    if len(tops) > 1:
        raise gltf.fault(f"its joints have {len(tops)} roots; a body has one")
    # The body begins at the first joint or branch; nodes above it move it but are not joints.
    below = dict.fromkeys(line, 0)
    for node in line[1:]:
        below[parents[node]] += 1
    top = next(node for node in line if node in wanted or below[node] > 1)
    return line[line.index(top) :], name


def _skins(gltf: Gltf) -> list[tuple[str, set[int]]]:
    """Return the names and joints of bodies, the largest first; skins that share joints belong to one body."""
    bodies: UnionFind[int] = UnionFind()
    for number, skin in enumerate(gltf.document.skins):
        for node in skin.joints:
            gltf.member(gltf.document.nodes, node, f"skin {number}: joint")
        bodies.union(*skin.joints)
    groups: dict[int, tuple[str, set[int]]] = {}
    for skin in gltf.document.skins:
        if skin.joints:
            groups.setdefault(bodies[skin.joints[0]], (skin.name, set()))[1].update(skin.joints)
    return sorted(groups.values(), key=lambda group: -len(group[1]))


def _distinct(names: list[str]) -> tuple[str, ...]:
    """Make names unique by appending numbers to repeated ones."""
    found: dict[str, int] = {}  # with the last number appended
    for name in names:
        unique, number = name, found.get(name, 1)
        while unique in found:
            number += 1
            unique = f"{name} {number}"
        found[name] = number
        found.setdefault(unique, 1)
    return tuple(found)


# --- the movement ---------------------------------------------------------------------------------------------------


def _clock(tracks: Tracks, joints: int, name: str) -> Floats:
    """Return the times of frames [T], seconds: those of the keys, on an even clock if they lie on one."""
    if not tracks:
        return np.zeros(1)
    shared = {id(track): track for track in tracks.values()}.values()
    times = np.unique(np.concatenate([track.times for track in shared]))
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
    if all(track.kind == "LINEAR" or len(track.times) == 1 for track in shared):
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
