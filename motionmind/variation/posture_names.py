"""Names of a piece's postures: as a corpus names them, or by clip and frame."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion, Posture
from motionmind.geometry import rotations as rot
from motionmind.names.finding import Collection
from motionmind.variation.piece import Piece

_MOMENT = 1e-3  # seconds
_SAME = np.radians(1.0)  # in every joint, of postures that have one name


def name_postures(piece: Piece, collection: Collection | None = None) -> tuple[str, ...]:
    """Name a piece's postures [N]: "tendu" where the collection names such a posture, else "adagio@23".

    Frames count from 0 in the whole clip, also where the piece is a part of it; composed postures are in no clip, and
    called "composed@23". Which way a body faces makes no other posture of it.

    Args:
        piece: the piece.
        collection: a corpus or score that names postures; None for none.
    """
    motion = piece.motion
    named = _postures_of(motion, collection)
    where = _upright(motion.rotations[piece.frames])
    clip, first = ("composed", 0) if piece.composed else (motion.name or "piece", _first_frame(motion, collection))
    found = [f"{clip}@{first + frame}" for frame in piece.frames.tolist()]
    for name, posture in reversed(named):  # the first of several names of a posture stays
        off = rot.angle(where, _upright(posture.rotations)).max(axis=-1)
        for number in np.flatnonzero(off < _SAME):
            found[number] = name
    return tuple(found)


def _postures_of(motion: Motion, collection: Collection | None) -> list[tuple[str, Posture]]:
    """Return the postures on the motion's joints that a collection names."""
    if collection is None:
        return []
    postures = [(name, collection.posture(name)) for name in collection.postures]
    return [(name, one) for name, one in postures if motion.skeleton.difference(one.skeleton) is None]


def _first_frame(motion: Motion, collection: Collection | None) -> int:
    """Return the number that the first frame of a part of a clip has in the whole clip, told by its time."""
    if collection is not None and motion.name in collection.clips:
        times = collection.motions([motion.name])[0].times
        first = int(np.abs(times - motion.times[0]).argmin())
        own = times[first : first + len(motion)]
        if (
            len(own) == len(motion) and np.abs(own - motion.times).max() < _MOMENT
        ):  # else a recording that it is made of
            return first
    return round(float(motion.times[0]) * motion.fps) if len(motion) > 1 else 0


def _upright(rotations: Floats) -> Floats:
    """Return local rotations [..., J, 4] of bodies that face +Z."""
    out = rotations.copy()
    out[..., 0, :] = rot.mul(rot.about_vertical(-rot.heading(out[..., 0, :])), out[..., 0, :])
    return out
