"""A variation as a file: the movement as it stands, which whatever reads movement reads, and with it all the rest.

It is motion JSON (`motionmind.formats.motion_json`) with one field more:

    "variation": {
      "version": 1,
      "piece": {"motion": {...}, "frames": [0, 1, 2, ...], "facing": "free"},
      "course": {"flow": "lorenz", "parameters": {"sigma": 16.0, ...}, "start": [...], "nudge": [...], "skip": 10, ...},
      "order": [0, 1, 2, 63, 64, ...],
      "joins": [{"start": 2, "end": 63, "corpus": "ballet", "breaks": [{"joint": "left_hip", ...}],
                 "candidates": [{"motion": {...}, "status": "optimal", "cost": 131.2, ...}], "failure": ""}, ...],
      "edits": [{"edit": "approve", "seams": [1, 3]}, {"edit": "cut", "first": 10, "last": 14, "before": 30}, ...]
    }

`piece` is the original with the frame of each of its postures, `order` the postures as the trajectory gave them,
`joins` what the corpus says of one posture following another, and `edits` the decisions, from which all else follows.
Numbers are written in full, so that what is read is what was written, to the last bit.
"""

from __future__ import annotations

from typing import Annotated, Any

import msgspec
import numpy as np

from motionmind.body.motion import Motion
from motionmind.corpus.corpus import Facing
from motionmind.errors import FormatError, MotionMindError
from motionmind.files import FilePath, read_bytes
from motionmind.formats import _json
from motionmind.formats.motion_json import FramesSchema, InsertionSchema, MotionSchema, motion_of, write_motion_json
from motionmind.search.solve import Status
from motionmind.tween.certificate import Bridge, Wait
from motionmind.variation.piece import Piece
from motionmind.variation.review import Approve, Cut, Discard, Edit, Replace, Smooth, is_seam
from motionmind.variation.seams import Break, Candidate, Join
from motionmind.variation.variation import Course, Variation

VERSION = 1
_ROUNDING = 1e-6  # of a quaternion and of metres: how far a candidate's ends may be from the piece's postures
_Index = Annotated[int, msgspec.Meta(ge=0, lt=2**31)]


class PieceSchema(msgspec.Struct, forbid_unknown_fields=True):
    """The original."""

    motion: FramesSchema
    frames: list[_Index]
    facing: Facing


class CandidateSchema(msgspec.Struct, forbid_unknown_fields=True):
    """Movement that the engine found, with its certificate."""

    motion: FramesSchema
    path: list[list[_Index]]
    status: Status
    cost: float
    lower_bound: float
    attested: float
    bridges: tuple[Bridge, ...]
    waits: tuple[Wait, ...]


class JoinSchema(msgspec.Struct, forbid_unknown_fields=True):
    """What a corpus says of one posture following another."""

    start: _Index
    end: _Index
    corpus: str
    breaks: tuple[Break, ...]
    candidates: list[CandidateSchema]
    failure: str
    asked: dict[str, Any]


class SmoothSchema(msgspec.Struct, tag_field="edit", tag="smooth", forbid_unknown_fields=True):
    """Seams that were judged and smoothed later."""

    joins: list[JoinSchema]


class VariationSchema(msgspec.Struct, forbid_unknown_fields=True):
    """The field `variation`, version 1."""

    version: int
    piece: PieceSchema
    course: Course
    order: list[_Index]
    joins: list[JoinSchema]
    edits: list[Approve | Discard | Replace | Cut | SmoothSchema]


class _Version(msgspec.Struct):
    version: int = 0


def read_variation(path: FilePath) -> Variation:
    """The variation in the file at `path`.

    Raises:
        FormatError: it cannot be read, holds movement alone, is of a version that is not known, or its parts do not fit
            together. The message says which.
    """
    data = read_bytes(path)
    wanted = "where a variation was expected (motionmind vary writes one)"
    if _json.kind_of(data, path) != _json.MOTION:
        raise FormatError(f"this holds a posture, {wanted}", path=path)
    file = _json.decode(data, MotionSchema, path)
    section = bytes(file.variation)
    if not section:
        raise FormatError(f"this holds movement alone, {wanted}", path=path)
    version = _json.decode(section, _Version, path).version
    if version != VERSION:
        raise FormatError(f"variation: version {version}: this MotionMind reads version {VERSION}", path=path)
    schema = _json.decode(section, VariationSchema, path)
    skeleton = _json.to_skeleton(file.skeleton, path)
    try:
        motion = motion_of(schema.piece.motion, skeleton, path, mend=False)
        piece = Piece(motion, np.array(schema.piece.frames), schema.piece.facing)
        edits: list[Edit] = [
            Smooth(_joins(edit.joins, f"edits[{number}].joins", piece, path))
            if isinstance(edit, SmoothSchema)
            else edit
            for number, edit in enumerate(schema.edits)
        ]
        joins = _joins(schema.joins, "joins", piece, path)
        return Variation(piece, schema.course, np.array(schema.order), joins, tuple(edits))
    except FormatError:
        raise
    except MotionMindError as error:
        raise FormatError(f"variation: {error}", path=path) from error


def write_variation(path: FilePath, variation: Variation) -> None:
    """Write a variation, whole or not at all; MotionMindError if it cannot be."""
    piece = variation.piece
    schema = VariationSchema(
        VERSION,
        PieceSchema(_frames(piece.motion), piece.frames.tolist(), piece.facing),
        variation.course,
        variation.order.tolist(),
        [_join(join) for join in variation.joins],
        [
            SmoothSchema([_join(join) for join in edit.joins]) if isinstance(edit, Smooth) else edit
            for edit in variation.edits
        ],
    )
    write_motion_json(path, variation.motion(), {"variation": msgspec.json.encode(schema)})


def _frames(motion: Motion) -> FramesSchema:
    return FramesSchema(
        times=motion.times.tolist(),
        root=motion.root.tolist(),
        rotations=motion.rotations.tolist(),
        name=motion.name,
        insertions=[InsertionSchema(mark.times.tolist(), list(mark.bridged)) for mark in motion.insertions],
    )


def _join(join: Join) -> JoinSchema:
    candidates = [
        CandidateSchema(
            _frames(way.motion),
            way.path.tolist(),
            way.status,
            way.cost,
            way.lower_bound,
            way.attested,
            way.bridges,
            way.waits,
        )
        for way in join.candidates
    ]
    return JoinSchema(join.start, join.end, join.corpus, join.breaks, candidates, join.failure, dict(join.asked))


def _joins(schemas: list[JoinSchema], where: str, piece: Piece, path: FilePath) -> tuple[Join, ...]:
    """The joins in one of the file's lists; FormatError names the place in it of what does not fit the piece."""
    found = []
    for number, join in enumerate(schemas):
        here = f"{where}[{number}]"
        if max(join.start, join.end) >= len(piece) or not is_seam(join.start, join.end):
            fault = f"from posture {join.start} to {join.end} there is no seam: the piece has 0 to {len(piece) - 1}"
            raise FormatError(f"variation: {here}: {fault}", path=path)
        ways = enumerate(join.candidates)
        candidates = tuple(_candidate(way, join, f"{here}.candidates[{k}]", piece, path) for k, way in ways)
        found.append(Join(join.start, join.end, join.corpus, join.breaks, candidates, join.failure, join.asked))
    return tuple(found)


def _candidate(way: CandidateSchema, join: JoinSchema, where: str, piece: Piece, path: FilePath) -> Candidate:
    motion = motion_of(way.motion, piece.motion.skeleton, path, mend=False)
    states = len(way.path[0]) if way.path else 0
    if len(motion.insertions) != 1 or len(way.path) < 2 or any(len(row) != states for row in way.path):
        raise FormatError(f"variation: {where}: this is no insertion with its path of states", path=path)
    for what, frame, end in zip(("start", "end"), (0, -1), piece.ends(join.start, join.end), strict=True):
        rotations, root = motion.rotations[frame], motion.root[frame]
        apart = np.minimum(np.abs(rotations - end.rotations), np.abs(rotations + end.rotations))  # q and -q are one
        if max(apart.max(), np.abs(root - end.root).max()) > _ROUNDING:
            posture = getattr(join, what)
            raise FormatError(f"variation: {where}: it does not {what} at posture {posture} of the piece", path=path)
    certificate = way.status, way.cost, way.lower_bound, way.attested, way.bridges, way.waits
    return Candidate(motion, np.array(way.path, dtype=np.int32), *certificate)
