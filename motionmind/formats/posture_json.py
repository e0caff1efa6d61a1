"""One posture as JSON that a person can read and edit.

    {
      "format": "motionmind-posture",
      "version": 1,
      "skeleton": "human23",
      "root": [0.0, 0.97, 0.0],
      "rotations": {
        "pelvis": [0.0, 0.0, 0.0, 1.0],
        "left_hip": [0.38268, 0.0, 0.0, 0.92388],
        ...
      }
    }

`recorded`, if present, holds the credits of the movement that the posture comes from (`motionmind.credits.credit`).
`root` is the root's place in metres, `rotations` each joint's quaternion x, y, z, w against its parent.
`skeleton` is "human23", "human44", or a description in metres, parents before their children, `tip` optional:
`{"name": ..., "joints": [{"name": ..., "parent": NAME or null, "offset": [x, y, z], "tip": [x, y, z]}, ...]}`.
"""

from __future__ import annotations

import msgspec
import numpy as np

from motionmind.body.motion import Posture
from motionmind.credits.credit import Credit
from motionmind.errors import FormatError, MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.formats import _json


class PostureSchema(msgspec.Struct, forbid_unknown_fields=True):
    """The file, version 1."""

    format: str
    version: int
    skeleton: str | _json.SkeletonSchema
    root: _json.Vector
    rotations: dict[str, _json.Quaternion]
    recorded: list[Credit] = []


def posture_from_json(data: bytes, path: FilePath) -> Posture:
    """Decode a posture.

    Args:
        data: the content of the file.
        path: the file, for messages.

    Raises:
        FormatError: `data` is not a posture of version 1, or a joint is missing, unknown or has a zero quaternion. The
            message names file and joint.

    Warns:
        MotionMindWarning: a quaternion whose length was off by more than 1 % has been normalised.
    """
    kind = _json.kind_of(data, path)
    if kind != _json.POSTURE:
        raise FormatError(f"this holds a motion, where a posture ({_json.POSTURE!r}) was expected", path=path)
    schema = _json.decode(data, PostureSchema, path)
    skeleton = _json.to_skeleton(schema.skeleton, path)
    _json.check_joints(list(schema.rotations), skeleton, path)
    rotations = np.array([schema.rotations[name] for name in skeleton.names], dtype=np.float64)
    root = np.array(schema.root, dtype=np.float64)
    _json.check_lengths(root, "root", path)
    rotations = _json.normalise_rotations(rotations, skeleton.names, path)
    try:
        return Posture(skeleton, rotations, root, tuple(schema.recorded))
    except MotionMindError as error:  # of the credits' shares
        raise FormatError(str(error), path=path) from None


def write_posture_json(path: FilePath, posture: Posture) -> None:
    """Write `posture` as JSON; read back, no number is off by more than 1e-9. MotionMindError if writing fails."""
    skeleton = posture.skeleton
    rows = [
        f"    {_json.text(name)}: {rotation}"
        for name, rotation in zip(skeleton.names, _json.rounded(posture.rotations).tolist(), strict=True)
    ]
    shares = [f'  "recorded": {msgspec.json.encode(posture.recorded).decode()}'] if posture.recorded else []
    fields = [
        f'  "format": "{_json.POSTURE}"',
        f'  "version": {_json.VERSION}',
        f'  "skeleton": {_json.skeleton_text(skeleton, "  ")}',
        f'  "root": {_json.rounded(posture.root).tolist()}',
        '  "rotations": {\n' + ",\n".join(rows) + "\n  }",
        *shares,
    ]
    write_atomically(path, ("{\n" + ",\n".join(fields) + "\n}\n").encode())
