"""Files of variations: motion that any reader of motion JSON can read, and everything else beside it.

A file is motion JSON (`motionmind.formats.motion_json`) with one more field:

    "variation": {
      "version": 1,
      "piece": {"motion": {...}, "frames": [0, 1, 2, ...], "facing": "free"},
      "course": {"flow": "lorenz", "parameters": {"sigma": 16.0, ...}, "start": [...], "nudge": [...], "skip": 10, ...},
      "order": [0, 1, 2, 63, 64, ...],
      "joins": [{"start": 2, "end": 63, "corpus": "ballet", "breaks": [{"joint": "left_hip", ...}],
                 "candidates": [{"motion": {...}, "status": "optimal", "cost": 131.2, ...}], "failure": ""}, ...],
      "edits": [{"edit": "approve", "seams": [1, 3]}, {"edit": "cut", "first": 10, "last": 14, "before": 30}, ...],
      "kept": {"order": [0, 1, 2, 3, 64, ...], "limits": {"inserted": 0.3, "stretch": 4}},
      "control": {"by": "chunks", "seed": 0},
      "on_beat": {"every": 2, "times": [0.0, 1.0, 2.0, ...]}
    }

`piece` is the original with the frame of each of its postures, `order` the postures in the trajectory's order,
`joins` the judged transitions, and `edits` the decisions, from which all else follows. With limits, `kept` is the order
that replaces the trajectory's. With a control, `control` names it; `course` is null if it follows no trajectory, and
the piece of quadrants has `"composed": true`. `on_beat` has the beats on which stretches and insertions start.
Numbers keep all their bits.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.arguments import check_path, check_type
from motionmind.body.motion import Motion, Posture
from motionmind.corpus.corpus import Facing
from motionmind.errors import FormatError, MotionMindError
from motionmind.files import FilePath, read_bytes
from motionmind.formats import _json
from motionmind.formats._json import InsertionSchema
from motionmind.formats.motion_json import FramesSchema, MotionSchema, motion_of, write_motion_json
from motionmind.geometry import rotations as rot
from motionmind.variation.controls import Control
from motionmind.variation.course import Course
from motionmind.variation.limits import Kept
from motionmind.variation.on_beat import OnBeat
from motionmind.variation.piece import Piece, Placement
from motionmind.variation.review import Approve, Cut, Discard, Edit, Replace, Smooth
from motionmind.variation.seams import Candidate, Index, InsertionCandidate, JudgedTransition, Transition
from motionmind.variation.variation import Variation

VERSION = 1
_MOVEMENT_ALONE = (".bvh", ".glb", ".npz", ".txt", ".gif", ".png", ".mp4", ".svg", ".html")  # as vary writes it, too

# In a file, a candidate's movement and path are lists of numbers.
FileCandidate = InsertionCandidate[FramesSchema, list[list[Index]]]
FileTransition = JudgedTransition[FileCandidate]


class PieceSchema(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """The original, or composed postures."""

    motion: FramesSchema
    frames: list[Index]
    facing: Facing
    composed: bool = False


class VariationSchema(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """The field `variation`, version 1."""

    version: int
    piece: PieceSchema
    course: Course | None
    order: list[Index]
    joins: list[FileTransition]
    edits: list[Approve | Discard | Replace | Cut | Smooth[FileTransition]]
    kept: Kept | None = None
    control: Control | None = None
    on_beat: OnBeat | None = None


class _EditHead(msgspec.Struct):
    edit: str = ""
    numbers: str = ""


class _Head(msgspec.Struct):
    """Tells a file's version: cuts of earlier ones do not say how seams are numbered after them."""

    version: int = 0
    edits: list[_EditHead] = []


def read_variation(path: FilePath) -> Variation:
    """Read the variation in the file at `path`.

    Raises:
        FormatError: the file cannot be read, holds movement alone, has another version, or is inconsistent; the message
            says which.

    >>> from motionmind import Engine, read_variation, vary, write_variation
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> write_variation("variation.json", vary(motion, nudge=1.0))
    >>> len(read_variation("variation.json").order) == len(motion)
    True
    """
    check_path("path", path)
    file = _read_motion(path)
    schema = _json.decode(bytes(file.variation), VariationSchema, path)
    skeleton = _json.to_skeleton(file.skeleton, path)
    try:
        motion = motion_of(schema.piece.motion, skeleton, path, mend=False)
        piece = Piece(motion, np.array(schema.piece.frames), schema.piece.facing, schema.piece.composed)
        edits: list[Edit] = [
            Smooth(_read_transitions(edit.transitions, f"edits[{number}].joins", piece, path))
            if isinstance(edit, Smooth)
            else edit
            for number, edit in enumerate(schema.edits)
        ]
        transitions = _read_transitions(schema.joins, "joins", piece, path)
        order = np.array(schema.order)
        rest = tuple(edits), schema.kept, schema.control, schema.on_beat
        return Variation(piece, schema.course, order, transitions, *rest)
    except FormatError:
        raise
    except MotionMindError as error:
        raise FormatError(f"variation: {error}", path=path) from error


def is_variation(path: FilePath) -> bool:
    """Return whether the file at `path` is JSON with a variation, even a damaged one."""
    if Path(path).suffix.lower() != ".json":
        return False
    try:
        return "variation" in msgspec.json.decode(read_bytes(path), type=dict[str, msgspec.Raw])
    except (msgspec.DecodeError, UnicodeDecodeError, FormatError):
        return False


def write_variation(path: FilePath, variation: Variation) -> None:
    """Write a variation, whole or not at all; MotionMindError if it cannot be written.

    >>> from motionmind import Engine, vary, write_variation
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> write_variation("variation.json", vary(motion, nudge=1.0))
    """
    check_path("path", path)
    check_type("variation", variation, Variation)
    piece = variation.piece
    schema = VariationSchema(
        VERSION,
        PieceSchema(_frames(piece.motion), piece.frames.tolist(), piece.facing, piece.composed),
        variation.course,
        variation.order.tolist(),
        [_file_transition(transition) for transition in variation.transitions],
        [
            Smooth(tuple(map(_file_transition, edit.transitions))) if isinstance(edit, Smooth) else edit
            for edit in variation.edits
        ],
        variation.kept,
        variation.control,
        variation.on_beat,
    )
    write_motion_json(path, variation.motion(), {"variation": msgspec.json.encode(schema)})


def _read_motion(path: FilePath) -> MotionSchema:
    """Read the file at `path`; FormatError unless it holds a variation of this version."""
    given = Path(path)
    if given.suffix.lower() in _MOVEMENT_ALONE:
        beside = given.with_suffix(".json")
        hint = f"; did you mean {beside}?" if beside.is_file() else ""
        raise FormatError(f"holds movement alone; a variation is the .json that vary wrote{hint}", path=path)
    data = read_bytes(path)
    wanted = "where a variation was expected (motionmind vary writes one)"
    if _json.kind_of(data, path) != _json.MOTION:
        raise FormatError(f"this holds a posture, {wanted}", path=path)
    file = _json.decode(data, MotionSchema, path)
    section = bytes(file.variation)
    if not section:
        raise FormatError(f"this holds movement alone, {wanted}", path=path)
    head = _json.decode(section, _Head, path)
    if head.version > VERSION:
        raise FormatError(f"variation: version {head.version}: this MotionMind reads version {VERSION}", path=path)
    if head.version < VERSION or any(one.edit == "cut" and not one.numbers for one in head.edits):
        again = f"motionmind vary PIECE --corpus NAME -o {shlex.quote(os.fsdecode(path))}"
        raise FormatError(f"a variation of an earlier version; make it again: {again}", path=path)
    return file


def _frames(motion: Motion) -> FramesSchema:
    return FramesSchema(
        times=motion.times.tolist(),
        root=motion.root.tolist(),
        rotations=motion.rotations.tolist(),
        name=motion.name,
        insertions=[
            InsertionSchema(mark.times.tolist(), list(mark.bridged), list(mark.credits)) for mark in motion.insertions
        ],
        keyframed=motion.keyframed,
        recorded=list(motion.recorded),
    )


def _file_transition(transition: Transition) -> FileTransition:
    """Return a judged transition in its form for files."""
    return transition.with_candidates(
        tuple(one.with_movement(_frames(one.motion), one.path.tolist()) for one in transition.candidates)
    )


def _read_transitions(
    file: Sequence[FileTransition], where: str, piece: Piece, path: FilePath
) -> tuple[Transition, ...]:
    """Read one of the file's lists of judged transitions; FormatError names the place of an inconsistent one."""
    transitions = []
    for number, one in enumerate(file):
        here = f"{where}[{number}]"
        if max(one.start, one.end) >= len(piece) or not piece.is_seam(one.start, one.end):
            fault = f"from posture {one.start} to {one.end} there is no seam: the piece has 0 to {len(piece) - 1}"
            raise FormatError(f"variation: {here}: {fault}", path=path)
        candidates = tuple(
            _read_candidate(candidate, one, f"{here}.candidates[{k}]", piece, path)
            for k, candidate in enumerate(one.candidates)
        )
        transitions.append(one.with_candidates(candidates))
    return tuple(transitions)


def _read_candidate(
    file: FileCandidate, transition: FileTransition, where: str, piece: Piece, path: FilePath
) -> Candidate:
    """Return a candidate with its movement and path as arrays; FormatError if it does not fit the transition."""
    motion = motion_of(file.motion, piece.motion.skeleton, path, mend=False)
    states = len(file.path[0]) if file.path else 0
    if len(motion.insertions) != 1 or len(file.path) < 2 or any(len(row) != states for row in file.path):
        raise FormatError(f"variation: {where}: not one insertion with its path of states", path=path)
    ends = piece.ends(transition.start, transition.end)
    for word, frame, end in zip(("start", "end"), (0, -1), ends, strict=True):
        rotations, root = motion.rotations[frame], motion.root[frame]
        if word == "end":
            rotations, root = _turned_back(piece, end, rotations), root * (0.0, 1.0, 0.0)
        apart = np.minimum(np.abs(rotations - end.rotations), np.abs(rotations + end.rotations))  # q and -q are one
        if max(apart.max(), np.abs(root - end.root).max()) > 1e-6:  # of a quaternion, and metres
            posture = getattr(transition, word)
            raise FormatError(f"variation: {where}: does not {word} at posture {posture} of the piece", path=path)
    return file.with_movement(motion, np.array(file.path, dtype=np.int32))


def _turned_back(piece: Piece, end: Posture, rotations: Floats) -> Floats:
    """Return local rotations [J, 4], turned to the facing of a posture if the piece may face anywhere."""
    turn = float(rot.heading(end.rotations[0]) - rot.heading(rotations[0])) if piece.facing == "free" else 0.0
    return Placement(turn, np.zeros(3)).turn(rotations) if turn else rotations
