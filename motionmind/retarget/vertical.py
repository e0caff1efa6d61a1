"""Finds which axis of a file's world is up, by the rig's zero pose, people's trunks and the floor.

A rig is made standing along y or along z, and people mostly stand along the same axis. If they do not, either the file
turns them (its world has z up, the rig's y), or they lie or crawl all the time. The floor then decides: along the
vertical the lowest point of a body stays at the floor, at whatever height; along other axes it travels with the body.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats
from motionmind.arguments import check_text
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot

# The lowest point of a body marks the floor if along another axis it moves more by this factor.
_FLOOR_STEADINESS_RATIO = 2.0

# Rotation [4] from a world with z up to one with y up: a body that faced -y faces +z.
Z_UP_TO_Y_UP = rot.from_axis_angle([1.0, 0.0, 0.0], -np.pi / 2)


class Vertical(NamedTuple):
    """The axis of a file's world that is up.

    Attributes:
        axis: "y" or "z".
        doubt: the reason to doubt it, in words; "" for none.
    """

    axis: str
    doubt: str = ""


def check_up(up: str | None) -> None:
    """Raise MotionMindError unless `up` is "y", "z" or None."""
    check_text("up", up, or_none=True)
    if up not in (None, "y", "z"):
        raise MotionMindError(f'up must be "y" or "z", not {up!r}')


def to_y_up(motion: Motion) -> Motion:
    """Turn the world of a motion from z up to y up; the zero pose stays.

    >>> import numpy as np
    >>> from motionmind import Motion, human23
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (1, 23, 1))
    >>> to_y_up(Motion(human23(), at_rest, np.array([[0.0, 0.0, 0.9]]), np.zeros(1))).root.round(3).tolist()
    [[0.0, 0.9, 0.0]]
    """
    rotations = motion.rotations.copy()
    rotations[:, 0] = rot.mul(Z_UP_TO_Y_UP, rotations[:, 0])
    return replace(motion, rotations=rotations, root=rot.mul_vec(Z_UP_TO_Y_UP, motion.root))


def thin_frames(count: int) -> slice:
    """Return a slice of at most 500 of `count` frames, evenly spaced; a posture is known by no more."""
    return slice(None, None, -(-count // 500))


def find_vertical(
    points: Callable[[slice], Floats], trunk: Floats, *, usual: str, height: float, is_stated: bool = False
) -> Vertical:
    """Find which axis of a file's world is up, y or z.

    Args:
        points: function of some of the frames; returns the positions [T', P, 3] of joints and tips, metres.
        trunk: directions of the trunk, up along the spine [T, 3].
        usual: "y" or "z", the axis that the rig stands along, or that is up in all files of a format.
        height: of the body, metres.
        is_stated: whether the format defines the usual axis; a floor at 0 then proves nothing.

    >>> import numpy as np
    >>> ahead = np.tile([0.0, 0.0, 1.0], (60, 1))
    >>> path = np.linspace(0.0, 1.0, 60)[:, None] * ahead
    >>> crawling = np.stack([path, path + ahead], axis=1)
    >>> find_vertical(lambda some: crawling[some], ahead, usual="y", height=1.7).axis
    'y'
    """
    mean, usual_axis = trunk.mean(axis=0), "xyz".index(usual)
    axis = int(np.argmax(np.abs(mean)))
    # Mean cosines: people stand along the rig's own axis from 0.5, along another one from 0.7.
    if mean[usual_axis] >= 0.5 or abs(mean[axis]) < 0.7:
        return Vertical(usual)
    sign = float(np.sign(mean[axis]))
    along = "-" * (sign < 0.0) + "xyz"[axis]
    places = points(thin_frames(len(trunk)))
    lows = (sign * places[..., axis]).min(axis=1), places[..., usual_axis].min(axis=1)
    ranges = (
        (_range_on_floor(low, height) for low in lows) if len(places) >= 8 else (1.0, 1.0)
    )  # fewer frames show none
    low_range, usual_range = ranges
    at_floor, usual_at_floor = (abs(float(np.median(low))) < 0.15 * height for low in lows)
    steadier = usual_range > _FLOOR_STEADINESS_RATIO * low_range
    if is_stated and not steadier:
        return Vertical(usual)
    usual_is_steadier = low_range > _FLOOR_STEADINESS_RATIO * usual_range
    if usual_is_steadier or not (steadier or at_floor):
        is_sure = usual_is_steadier or usual_at_floor
        found = usual if is_sure or along != "y" else "y"
        return Vertical(found, "" if is_sure else _describe_doubt(along))
    if along not in ("y", "z"):
        doubt = f"people stand along {along}, but only y or z can be up; turn the file"
        return Vertical(usual, doubt * steadier)
    is_sure = steadier or not usual_at_floor
    return Vertical(along, "" if is_sure else _describe_doubt(along))


def _describe_doubt(along: str) -> str:
    return f"people either lie or stand along {along}; choose with --up y or --up z"


def _range_on_floor(lowest: Floats, height: float) -> float:
    """Return the range of heights of the lowest point [T] while the body is on the floor, metres.

    The body counts as on the floor between the quantiles 0.05 and 0.6, and 0.2 % of its height as still.
    """
    low, high = np.quantile(lowest, (0.05, 0.6))
    return max(float(high - low), 0.002 * height)
