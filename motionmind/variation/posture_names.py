"""Names of a piece's postures: from a corpus or score, or by clip and frame."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion, Posture
from motionmind.geometry import rotations as rot
from motionmind.names.finding import Collection
from motionmind.variation.piece import Piece


def name_postures(piece: Piece, collection: Collection | None = None) -> tuple[str, ...]:
    """Name a piece's postures [N]: "tendu" if the collection names such a posture, else "adagio@23".

    A name fits within 1 degree in each joint; the heading does not matter. Frames count from 0 in the whole clip, even
    if the piece is only a part of it. Composed postures belong to no clip: "composed@23".

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
        for number in np.flatnonzero(off < np.radians(1.0)):  # in every joint
            found[number] = name
    return tuple(found)


def _postures_of(motion: Motion, collection: Collection | None) -> list[tuple[str, Posture]]:
    """Return the named postures of a collection on the motion's skeleton."""
    if collection is None:
        return []
    postures = [(name, collection.posture(name)) for name in collection.postures]
    return [(name, one) for name, one in postures if motion.skeleton.difference(one.skeleton) is None]


def _first_frame(motion: Motion, collection: Collection | None) -> int:
    """Return the number of a motion's first frame in the whole clip, by its time."""
    if collection is not None and motion.name in collection.clips:
        times = collection.motions([motion.name])[0].times
        first = int(np.abs(times - motion.times[0]).argmin())
        own = times[first : first + len(motion)]
        # Times within 1 ms; else the clip was made of this recording.
        if len(own) == len(motion) and np.abs(own - motion.times).max() < 1e-3:
            return first
    return round(float(motion.times[0]) * motion.fps) if len(motion) > 1 else 0


def _upright(rotations: Floats) -> Floats:
    """Return local rotations [..., J, 4] with the heading turned to +Z."""
    out = rotations.copy()
    out[..., 0, :] = rot.mul(rot.about_vertical(-rot.heading(out[..., 0, :])), out[..., 0, :])
    return out
