"""Writes glTF with the nodes, skins, meshes and materials of another glTF file, and a new animation.

Section numbers refer to "glTF 2.0 Specification", version 2.0.1, The Khronos Group (2021). The new animation comes
first, where viewers and importers look; the file's own follow it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.files import FilePath, name_of, write_atomically
from motionmind.formats import _json
from motionmind.formats._gltf import Gltf, read_chunks, read_container, to_trs
from motionmind.formats._gltf_poses import PATH_TYPES, lineage
from motionmind.formats._json import MARKS_KEY
from motionmind.formats._rig_file import RigFile
from motionmind.formats.glb import GlbBuffer, add_clock, animation, container, continuous, encode_marks
from motionmind.formats.gltf import GltfBody, find_body
from motionmind.formats.units import metres_per_unit
from motionmind.geometry import rotations as rot
from motionmind.retarget.armature import Armature, Pose, ease

_SINGLE_PRECISION_M, _SINGLE_PRECISION_RAD = 1e-6, 1e-6
_IMAGE_TYPES = {b"\x89PNG": "image/png", b"\xff\xd8\xff": "image/jpeg", b"RIFF": "image/webp", b"\xabKTX": "image/ktx2"}


class _Image(msgspec.Struct):
    """A picture; its other members stay as they are."""

    uri: str | None = None


class _Pictures(msgspec.Struct):
    """The pictures of a file."""

    images: list[_Image] = []


@dataclass(frozen=True, eq=False)
class GlbRigFile(RigFile):
    """The rig of a glTF file.

    The bones are the joints of the body, and the nodes above them.

    Attributes:
        gltf: the file.
        nodes: the node of each bone [N].
        body_nodes: the nodes that are joints of the body.
        props: {node, path: values before and after the movement to come [2, 3 or 4]} of all else that the file's
            animation moves, such as a sword, and of scales.
    """

    gltf: Gltf
    nodes: list[int]
    body_nodes: frozenset[int]
    props: Mapping[tuple[int, str], Floats]
    suffix: ClassVar[str] = ".glb"

    def with_ends_of(self, start: RigFile | None, end: RigFile | None) -> Self:
        """Return this rig with the first pose of one file and the last of another; props need the same nodes."""
        rig = super().with_ends_of(start, end)
        first, last = (
            one.props if known and isinstance(one, GlbRigFile) and self._has_nodes_of(one) else self.props
            for one, known in zip((start, end), rig.armature.is_known, strict=True)
        )
        props = {
            key: np.stack([first.get(key, values)[0], last.get(key, values)[1]]) for key, values in self.props.items()
        }
        return replace(rig, props=props)

    def _has_nodes_of(self, other: GlbRigFile) -> bool:
        """Return whether another file has the same nodes."""
        ours, theirs = ([node.name for node in one.gltf.document.nodes] for one in (self, other))
        return ours == theirs

    def write(self, path: FilePath, pose: Pose, motion: Motion) -> None:
        """Write the rig with a new animation; a pose of one frame becomes the nodes' own.

        Raises:
            MotionMindError: times are too close together for single precision, a picture or a buffer beside the rig
                cannot be read, or the file cannot be written.
        """
        text, _ = read_chunks(self.path)
        document: dict[str, Any] = _json.decode(text, dict, self.path)
        _json.decode(text, _Pictures, self.path)  # refuses damaged ones
        name = motion.name or name_of(path)
        buffer = _take_buffers(self.gltf, document)
        _take_pictures(self.gltf, document, buffer)
        channels = [*self._channels(pose), *self._prop_channels(motion)]
        for node in {node for node, _, _ in channels}:
            _set_trs(document["nodes"][node], self.gltf, node)
        if len(motion) == 1:
            for node, target, values in channels:
                document["nodes"][node][target] = values[0].tolist()
        else:
            clock = add_clock(buffer, motion, name)
            outputs = [(node, target, buffer.add(values.astype("<f4"))) for node, target, values in channels]
            document["animations"] = [animation(name, clock, outputs), *document.get("animations", [])]
        top = document["nodes"][self.nodes[int(self.armature.joints[0])]]
        if isinstance(top.setdefault("extras", {}), dict):
            top["extras"][MARKS_KEY] = encode_marks(path, self.armature.motion_of(pose, motion))
        if buffer.data:
            document |= {"accessors": buffer.accessors, "bufferViews": buffer.views}
            document["buffers"][0] = {"byteLength": len(buffer.data)}
        else:
            del document["buffers"]
        write_atomically(path, container(document, bytes(buffer.data), name))

    def _channels(self, pose: Pose) -> Iterator[tuple[int, str, Floats]]:
        """Yield the node, the path and the values [T, 3 or 4] of bones that turn or move; of joints all turns."""
        for bone, node in enumerate(self.nodes):
            place, turn, _ = to_trs(self.gltf.document.nodes[node])
            turns = continuous(pose.rotations[:, [bone]])[:, 0]
            if node in self.body_nodes or np.any(rot.angle(turns, turn) > _SINGLE_PRECISION_RAD):
                yield node, "rotation", turns
            places = pose.translations[:, bone] / self.unit
            if np.any(np.abs(places - place) > _SINGLE_PRECISION_M / self.unit):
                yield node, "translation", places

    def _prop_channels(self, motion: Motion) -> Iterator[tuple[int, str, Floats]]:
        """Yield the node, the path and the values [T, 3 or 4] of props that differ from their nodes."""
        share = ease(motion.times)[:, None]
        for (node, path), (first, last) in self.props.items():
            turns = path == "rotation"
            values = rot.slerp(first, last, share[:, 0]) if turns else first + share * (last - first)
            still = dict(zip(PATH_TYPES, to_trs(self.gltf.document.nodes[node]), strict=True))[path]
            if not np.allclose(values, still, rtol=0.0, atol=_SINGLE_PRECISION_M):
                yield node, path, values


def read_glb_rig(
    path: FilePath,
    motion: Motion,
    frames: tuple[int, int] | None,
    unit: str | float | None = None,
    clip: str | None = None,
) -> GlbRigFile:
    """Read the rig of a glTF file.

    Args:
        path: the file.
        motion: its movement, as `read_gltf` returns it with the same unit and clip.
        frames: those before and after the movement to come; None if they are not of this file.
        unit: as for `read_gltf`.
        clip: as for `read_gltf`.
    """
    gltf = read_container(path)
    body = find_body(gltf, clip)
    rows = gltf.document.nodes
    nodes = lineage(body.parents, body.joints)
    number = {node: bone for bone, node in enumerate(nodes)}
    scale = 1.0 if unit is None else metres_per_unit(unit)
    known = [body.names.index(name) for name in motion.skeleton.names]
    times = body.times[list(frames or (0, 0))]
    props = {
        (node, path): track.at(times)
        for (node, path), track in body.tracks.items()
        if (path == "scale" or node not in number) and not rows[node].matrix  # nothing may move a matrix (3.11)
    }
    is_known = frames is not None
    scales = [
        body.tracks[node, "scale"].at(body.times[:1])[0] if (node, "scale") in props else to_trs(rows[node])[2]
        for node in nodes
    ]
    armature = Armature(
        motion,
        tuple(number.get(body.parents[node], -1) for node in nodes),
        np.array(scales),
        np.ones(len(nodes), dtype=bool),
        np.array([number[body.joints[joint]] for joint in known]),
        body.rest_turns[known],
        _pose_at(body, nodes, times, scale),
        (is_known, is_known),
    )
    names = tuple(rows[node].name for node in nodes)
    return GlbRigFile(path, names, armature, scale, gltf, nodes, frozenset(body.joints), props)


def _pose_at(body: GltfBody, nodes: list[int], times: Floats, scale: float) -> Pose:
    """Return the local transforms of nodes at `times` [T], seconds, with lengths in units of `scale` metres."""
    rotations, places = np.empty((len(times), len(nodes), 4)), np.empty((len(times), len(nodes), 3))
    for bone, node in enumerate(nodes):
        still = dict(zip(PATH_TYPES, to_trs(body.gltf.document.nodes[node]), strict=True))
        for path, out in (("rotation", rotations), ("translation", places)):
            out[:, bone] = body.tracks[node, path].at(times) if (node, path) in body.tracks else still[path]
    return Pose(rot.normalise(rotations), places * scale)


def _set_trs(node: dict[str, Any], gltf: Gltf, index: int) -> None:
    """Replace a node's matrix, which no animation may move (3.11), by its translation, rotation and scale."""
    if node.pop("matrix", None):
        place, turn, scale = to_trs(gltf.document.nodes[index])
        node |= {"translation": place.tolist(), "rotation": turn.tolist(), "scale": scale.tolist()}


def _take_buffers(gltf: Gltf, document: dict[str, Any]) -> GlbBuffer:
    """Return one buffer with all that a file's buffers hold, beside it or in it; change the document.

    Raises:
        FormatError: a view is in no buffer, or a buffer cannot be read.
    """
    data, starts = bytearray(), {}
    found: dict[int, int] = {}  # where the bytes of a buffer lie, by their identity: buffers may be one file
    buffers = document.get("buffers", [])
    for index, one in enumerate(buffers):
        if index == 0 or "uri" in one:  # others have data of extensions only
            whole = gltf.buffer(index)
            if id(whole) not in found:
                data += b"\0" * (-len(data) % 4)
                found[id(whole)] = len(data)
                data += whole
            starts[index] = found[id(whole)]
    kept = [index for index in range(len(buffers)) if index not in starts]
    number = {index: place for place, index in enumerate(kept, start=1)}
    views = document.get("bufferViews", [])
    for view in views:
        for one in (view, *view.get("extensions", {}).values()):
            held, offset = (one.get("buffer"), one.get("byteOffset", 0)) if isinstance(one, dict) else (None, 0)
            if isinstance(held, int) and isinstance(offset, int):
                gltf.member(buffers, held, "buffer view: buffer")
                one["buffer"] = number.get(held, 0)
                one["byteOffset"] = offset + starts.get(held, 0)
    document["buffers"] = [{}, *(buffers[index] for index in kept)]
    return GlbBuffer(bytes(data), views, document.get("accessors", []))


def _take_pictures(gltf: Gltf, document: dict[str, Any], buffer: GlbBuffer) -> None:
    """Append pictures that lie beside a file, or in its text, to its buffer; change the document."""
    found: dict[bytes, int] = {}  # the view of each picture; several may be one file
    for image in document.get("images", []):
        if (uri := image.pop("uri", None)) is None:
            continue
        picture = gltf.fetch(uri)
        kinds = (kind for magic, kind in _IMAGE_TYPES.items() if picture.startswith(magic))
        if (kind := next(kinds, None)) is None and "mimeType" not in image:
            raise gltf.fault(f"picture {uri[:40]!r} is neither PNG, JPEG, WebP nor KTX 2")
        image["mimeType"] = kind or image["mimeType"]
        if picture not in found:
            found[picture] = buffer.view(np.frombuffer(picture + b"\0" * (-len(picture) % 4), dtype=np.uint8))
            buffer.views[-1]["byteLength"] = len(picture)
        image["bufferView"] = found[picture]
