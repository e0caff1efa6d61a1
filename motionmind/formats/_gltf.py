"""Reads glTF's containers and the numbers in them, without interpreting them.

Section numbers refer to "glTF 2.0 Specification", version 2.0.1, The Khronos Group (2021). Meshes, materials and
pictures are not read, so extensions that compress them do no harm.
"""

from __future__ import annotations

import base64
import binascii
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar
from urllib.parse import unquote

import msgspec
import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats
from motionmind.display import displayed
from motionmind.errors import FormatError, quoted
from motionmind.files import FilePath, read_bytes
from motionmind.formats import _json
from motionmind.formats.text import MAX_NUMBER
from motionmind.geometry import rotations as rot

# 3.6.2.2, 5.1.3; the largest value of a type is 1 where integers are normalised (3.11).
COMPONENT_DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
N_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_MAX_OVERLAP_RATIO = 4  # numbers read against those in the buffers; a clock's parts overlap, little else does
MIN_SCALE_RATIO = 1e-9  # of a frame, or of its volume; frames that mirror or flatten have less

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
_Index = int | None
Row = TypeVar("Row")


class Asset(msgspec.Struct):
    """The header of every glTF file."""

    version: str


class Buffer(msgspec.Struct):
    """Bytes: in the file's binary chunk, in the JSON text, or in another file."""

    uri: str | None = None


class View(msgspec.Struct, rename="camel"):
    """A part of a buffer."""

    buffer: int
    byte_length: int
    byte_offset: int = 0
    byte_stride: int = 0
    extensions: dict[str, msgspec.Raw] = {}


class Accessor(msgspec.Struct, rename="camel"):
    """Numbers in a view."""

    component_type: int
    count: int
    type: str
    buffer_view: _Index = None
    byte_offset: int = 0
    normalized: bool = False
    sparse: msgspec.Raw = msgspec.Raw()


class Node(msgspec.Struct):
    """A frame in the tree of the scene."""

    name: str = ""
    children: list[int] = []
    translation: Vector = (0.0, 0.0, 0.0)
    rotation: Quaternion = (0.0, 0.0, 0.0, 1.0)
    scale: Vector = (1.0, 1.0, 1.0)
    matrix: list[float] = []
    mesh: _Index = None
    extras: msgspec.Raw = msgspec.Raw()


class Skin(msgspec.Struct, rename="camel"):
    """The joints that carry a mesh."""

    joints: list[int]
    name: str = ""
    inverse_bind_matrices: _Index = None


class Target(msgspec.Struct):
    """A channel's node, and the property that it animates."""

    path: str
    node: _Index = None


class Channel(msgspec.Struct):
    """A sampler and its target."""

    sampler: int
    target: Target


class Sampler(msgspec.Struct):
    """Accessors of times and values, and the interpolation between them."""

    input: int
    output: int
    interpolation: str = "LINEAR"


class Animation(msgspec.Struct):
    """Movement of nodes."""

    channels: list[Channel]
    samplers: list[Sampler]
    name: str = ""


class Bone(msgspec.Struct):
    """A node that is a bone of a person."""

    node: int
    bone: str = ""


class Bones(msgspec.Struct, rename="camel"):
    """The bones of a person: by name (VRM 1.0), or each with its name (VRM 0)."""

    human_bones: dict[str, Bone] | list[Bone] = {}


class Humanoid(msgspec.Struct):
    """An extension that lists the nodes of a person's bones."""

    humanoid: Bones = msgspec.field(default_factory=Bones)


class Document(msgspec.Struct, rename="camel"):
    """The parts of the file's JSON that describe movement."""

    asset: Asset
    nodes: list[Node] = []
    skins: list[Skin] = []
    animations: list[Animation] = []
    accessors: list[Accessor] = []
    buffer_views: list[View] = []
    buffers: list[Buffer] = []
    extensions: dict[str, msgspec.Raw] = {}


@dataclass(eq=False)
class Gltf:
    """A glTF file.

    Attributes:
        path: the file, for messages and to find other files by relative paths.
        document: its JSON.
        binary: the bytes of its first buffer, if the file holds them.
    """

    path: FilePath
    document: Document
    binary: bytes
    _buffers: dict[int, bytes] = field(default_factory=dict, repr=False)
    _files: dict[Path, bytes] = field(default_factory=dict, repr=False)
    _numbers: dict[tuple[object, ...], Floats] = field(default_factory=dict, repr=False)
    _bytes_read: int = 0

    @property
    def size(self) -> int:
        """The bytes of the buffers that were read."""
        return sum(map(len, self._buffers.values()))

    def fault(self, message: str) -> FormatError:
        """Return the error to raise for this file."""
        return FormatError(message, path=self.path)

    def numbers(self, index: int, kind: str, what: str) -> Floats:
        """Return an accessor's numbers [n, components], checked to be finite; the same array if it is read again.

        Args:
            index: the accessor's.
            kind: the required type, such as "VEC3".
            what: its name in errors.

        Raises:
            FormatError: there is no such accessor, it has another type, it is compressed, sparse or beyond its data, or
                too many accessors have the same data.
        """
        array, accessor = self._raw(index, kind, what)
        place = array.__array_interface__["data"][0], array.shape, array.strides, array.dtype, accessor.normalized
        if place not in self._numbers:
            self._bytes_read += array.size * array.itemsize
            if self._bytes_read > _MAX_OVERLAP_RATIO * self.size:
                raise self.fault(f"{what}: accessor {index} has data that too many others have, in part")
            self._numbers[place] = self._checked(array, accessor, index, what)
        return self._numbers[place]

    def _checked(self, array: NDArray[np.generic], accessor: Accessor, index: int, what: str) -> Floats:
        """Return an accessor's numbers as floats [n, components]; FormatError if one is out of range."""
        numbers = array.astype(np.float64)
        if accessor.normalized and array.dtype.kind in "iu":
            numbers = np.maximum(numbers / np.iinfo(array.dtype.str).max, -1.0)
        if not np.all(np.abs(numbers) <= MAX_NUMBER):
            row = int(np.argwhere(~(np.abs(numbers) <= MAX_NUMBER))[0][0])
            raise self.fault(f"{what}: number {row} of accessor {index} is out of range")
        numbers.setflags(write=False)
        return numbers

    def _raw(self, index: int, kind: str, what: str) -> tuple[NDArray[np.generic], Accessor]:
        """Return an accessor's stored numbers [n, components], and the accessor."""
        accessor = self.member(self.document.accessors, index, f"{what}: accessor")
        if accessor.type != kind or accessor.component_type not in COMPONENT_DTYPES:
            raise self.fault(
                f"{what}: accessor {index} holds {quoted(accessor.type)} of {accessor.component_type}, not {kind}"
            )
        if bytes(accessor.sparse) or accessor.buffer_view is None:
            raise self.fault(f"{what}: accessor {index} is sparse, which cannot be read: export without that")
        view = self.member(self.document.buffer_views, accessor.buffer_view, f"{what}: buffer view")
        compressed = [name for name in view.extensions if "meshopt" in name]
        if compressed:
            raise self.fault(
                f"{what}: compressed ({displayed(compressed[0])}), which cannot be read: export without that"
            )
        dtype = np.dtype(COMPONENT_DTYPES[accessor.component_type])
        width, data = N_COMPONENTS[kind], self.buffer(view.buffer, what)
        size = width * dtype.itemsize
        stride = view.byte_stride or size
        length = stride * (accessor.count - 1) + size
        if (
            accessor.count < 1
            or stride < size
            or min(view.byte_offset, accessor.byte_offset) < 0
            or accessor.byte_offset + length > view.byte_length
            or view.byte_offset + view.byte_length > len(data)
        ):
            raise self.fault(f"{what}: accessor {index} lies outside its data")
        start = view.byte_offset + accessor.byte_offset
        shape, strides = (accessor.count, width), (stride, dtype.itemsize)
        return np.ndarray(shape, dtype, data, start, strides), accessor

    def member(self, rows: list[Row], index: int, what: str) -> Row:
        """Return the row at `index`; FormatError if there is none."""
        if not 0 <= index < len(rows):
            raise self.fault(f"{what} {index} does not exist: the file has {len(rows)}")
        return rows[index]

    def buffer(self, index: int, what: str = "file") -> bytes:
        """Return a buffer's bytes; read another file on first use."""
        if index not in self._buffers:
            uri = self.member(self.document.buffers, index, f"{what}: buffer").uri
            self._buffers[index] = self.binary if uri is None and index == 0 else self.fetch(uri or "")
        return self._buffers[index]

    def fetch(self, uri: str) -> bytes:
        """Return the bytes of a data URI, or of a file in this one's folder or below (3.6.1.1), which is read once."""
        if uri.startswith("data:"):
            kind, _, text = uri.partition(",")
            try:
                return base64.b64decode(text, validate=True) if kind.endswith(";base64") else unquote(text).encode()
            except (binascii.Error, ValueError):
                raise self.fault("a data URI is not base64") from None
        name = unquote(uri)
        beside = Path(name)
        if not name or "\0" in name or ":" in name or "\\" in name or beside.is_absolute() or ".." in beside.parts:
            raise self.fault(f"data is at {quoted(uri)}: it must be in this file's folder or below")
        if beside not in self._files:
            self._files[beside] = read_bytes(Path(self.path).parent / beside)
        return self._files[beside]


def read_container(path: FilePath) -> Gltf:
    """Read the JSON and the binary chunk of a glTF file: binary (`.glb`) or text, whatever its suffix.

    Raises:
        FormatError: the file cannot be read, or is not glTF 2.
    """
    text, binary = read_chunks(path)
    document = _json.decode(text, Document, path)
    if document.asset.version.split(".")[0] != "2":
        raise FormatError(f"glTF of version {quoted(document.asset.version)}; only version 2 can be read", path=path)
    return Gltf(path, document, binary)


def read_chunks(path: FilePath) -> tuple[bytes, bytes]:
    """Read the JSON and the binary chunk of a glTF file; FormatError if it cannot be read."""
    data = read_bytes(path)
    return _chunks(data, path) if data.startswith(b"glTF") else (data, b"")


def _chunks(data: bytes, path: FilePath) -> tuple[bytes, bytes]:
    """Return the JSON and the binary data of a `.glb` (4.4)."""
    if len(data) < 20 or struct.unpack_from("<I", data, 4)[0] != 2:
        raise FormatError("not a GLB of version 2", path=path)
    whole = struct.unpack_from("<I", data, 8)[0]
    if whole > len(data):
        raise FormatError(f"cut short: {len(data)} of {whole} bytes", path=path)
    found: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= whole:
        size, kind = struct.unpack_from("<I4s", data, at)
        if at + 8 + size > whole:
            raise FormatError(f"a chunk of {size} bytes does not fit into the file", path=path)
        found.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size + -size % 4
    if b"JSON" not in found:
        raise FormatError("a GLB without JSON", path=path)
    return found[b"JSON"], found.get(b"BIN\0", b"")


def to_trs(node: Node) -> tuple[Floats, Floats, Floats]:
    """Return a node's translation [3], rotation [4] and scale [3] (3.5.3).

    Raises:
        ValueError: its matrix is not a translation, a rotation and a scale, or its rotation is zero.
    """
    if not node.matrix:
        return np.array(node.translation), rot.normalise(node.rotation), np.array(node.scale)
    return from_matrix(np.array(node.matrix))


def from_matrix(numbers: Floats) -> tuple[Floats, Floats, Floats]:
    """Return translations [..., 3], rotations [..., 4] and scales [..., 3] of matrices [..., 16], stored by column.

    Raises:
        ValueError: a matrix has another size, mirrors or has no volume.
    """
    if numbers.shape[-1:] != (16,) or not np.all(np.abs(numbers) <= MAX_NUMBER):
        raise ValueError("a matrix has 16 numbers")
    matrix = np.swapaxes(numbers.reshape(*numbers.shape[:-1], 4, 4), -1, -2)
    scale = np.linalg.norm(matrix[..., :3, :3], axis=-2)
    if not np.all(scale > MIN_SCALE_RATIO):
        raise ValueError("a matrix mirrors, or has no volume")
    turn = matrix[..., :3, :3] / scale[..., None, :]
    if np.any(np.linalg.det(turn) < MIN_SCALE_RATIO):
        raise ValueError("a matrix mirrors, or has no volume")
    return matrix[..., :3, 3], rot.from_matrix(turn), scale
