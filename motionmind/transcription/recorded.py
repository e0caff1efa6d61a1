"""Prepare a recording for transcription: the score's body, an even rate, the floor at 0, the legs that bear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.anatomy import SIDES
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.contact import lowest_point
from motionmind.body.motion import Motion
from motionmind.clean.stances import find_foot_stances, floor_heights
from motionmind.errors import MotionMindError
from motionmind.notation.score import Score
from motionmind.retarget.retarget import to_human23
from motionmind.transcription.angles import Positions, Written, write_angles
from motionmind.transcription.bones import Bones
from motionmind.transcription.vocabulary import read_positions

MAX_RATE_FPS = 30.0  # frames a second that are compared with the score; a faster recording is resampled
MAX_RECORDING_S = 600.0  # the steps between frames take 10 s of processor per minute


@dataclass(frozen=True, eq=False)
class Recorded:
    """A recording, and each of its frames as a score can write it.

    Attributes:
        bones: the bones of the score's body.
        motion: the recording with the score's proportions, above a level floor at height 0.
        bears: whether the left and the right leg bear the body [T, 2].
        written: the frames as the score may write them: in few words.
        writable: local rotations of the frames as the notation could write them at best, in the world [T, J, 4].
        up: height of the lowest point of each frame in the air [T], centimetres; 0 on the floor.
        root: position of the pelvis in each written frame [T, 3], metres.
        positions: named positions of each layer that the score may use.
    """

    bones: Bones
    motion: Motion
    bears: Bools
    written: Written
    writable: Floats
    up: Ints
    root: Floats
    positions: Mapping[str, Positions]


def to_even_human23(motion: Motion) -> Motion:
    """Return a recording on human23 with its own proportions, at an even rate of at most `MAX_RATE_FPS`."""
    moved = to_human23(motion)
    if len(moved) > 1 and (moved.keyframed or not moved.is_even or moved.fps > MAX_RATE_FPS):
        moved = moved.resample(MAX_RATE_FPS)
    return moved


def prepare(motion: Motion, tolerance: float, vocabulary: Sequence[Score] = ()) -> Recorded:
    """Prepare a recording of a person for transcription.

    The score's body has proportions of its own: joints keep their rotations, and travel is scaled by the bodies'
    heights.

    Args:
        motion: the recording.
        tolerance: of the score, degrees.
        vocabulary: scores whose positions it may use.

    Raises:
        MotionMindError: the recording is too long.
        SkeletonError: it is not of a person, or a score is of another body.
    """
    if motion.times[-1] - motion.times[0] > MAX_RECORDING_S:
        raise MotionMindError(
            f"{motion.name or 'the recording'} lasts {motion.times[-1] - motion.times[0]:.0f} s, and a transcription "
            f"at most {MAX_RECORDING_S:g} s; choose a part"
        )
    moved, body = to_even_human23(motion), anatomy_named("human23")
    root = moved.root * (body.skeleton.height / moved.skeleton.height)
    moved = replace(moved, skeleton=body.skeleton, root=root)
    bears = np.zeros((len(moved), 2), dtype=np.bool_)
    posed, feet = find_foot_stances(moved)
    lowest = posed.lowest
    for found in feet:
        side = SIDES.index(body.skeleton.names[found.foot.leg[0]].partition("_")[0])
        bears[:, side] = found.bears
    floor = floor_heights(lowest, moved.fps) if len(moved) > 1 else lowest
    moved = replace(moved, root=moved.root - np.stack([np.zeros_like(floor), floor, np.zeros_like(floor)], axis=-1))
    bones = Bones.of(body)
    positions = read_positions(vocabulary, body)
    written = write_angles(bones, moved.rotations, tolerance, positions)
    up = np.where(bears.any(axis=1), 0, np.round(100.0 * np.maximum(lowest - floor, 0.0))).astype(np.int64)
    root = moved.root.copy()
    root[:, 1] = 0.0
    root[:, 1] = 0.01 * up - lowest_point(body, written.rotations, root)[0]
    writable = write_angles(bones, moved.rotations, 0.0).turned()
    return Recorded(bones, moved, bears, written, writable, up, root, positions)
