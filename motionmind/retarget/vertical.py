"""Finds which axis of a file's world is up: its rig's zero pose and its people's trunks tell, and where they touch.

A rig is made standing along y or along z, and people mostly stand along the same axis. Where they do not, either the
file turns them (its world has z up, the rig's y), or they lie or crawl all the time. Then the floor tells: along the
vertical the lowest point of a body stays where the floor is, wherever that is, and across it goes where the body goes.
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

_FRAMES, _FEWEST = 500, 8  # frames that are looked at, at most; and at least, to see what is steady
_ALONG = 0.7  # mean cosine between the trunk and the axis that a body stands along
_STANDS = 0.5  # the same of the axis that a rig stands along, which needs less
_RISES = (0.05, 0.6)  # quantiles of the lowest point's height between which a body is on the floor
_STEADIER = 2.0  # times as steady as along another axis, the lowest point shows where the floor is
_STILL = 0.002  # share of a body's height below which the lowest point does not move
_AT_FLOOR = 0.15  # share of a body's height by which its lowest point may be off a floor at 0
_NAMES = "xyz"


# From z up to y up: z becomes y, and a body that faced -y faces +z.
Z_UP = rot.from_axis_angle([1.0, 0.0, 0.0], -np.pi / 2)


class Vertical(NamedTuple):
    """The axis of a file's world that is up.

    Attributes:
        axis: "y" or "z".
        doubt: says what speaks for another axis; "" if nothing does.
    """

    axis: str
    doubt: str = ""


def check_up(up: str | None) -> None:
    """Raise MotionMindError if `up` is none of "y", "z" and None."""
    check_text("up", up, or_none=True)
    if up not in (None, "y", "z"):
        raise MotionMindError(f'up must be "y" or "z", not {up!r}')


def stood_up(motion: Motion) -> Motion:
    """Return movement in a world with z up in one with y up; its zero pose stays.

    >>> import numpy as np
    >>> from motionmind import Motion, human23
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (1, 23, 1))
    >>> stood_up(Motion(human23(), at_rest, np.array([[0.0, 0.0, 0.9]]), np.zeros(1))).root.round(3).tolist()
    [[0.0, 0.9, 0.0]]
    """
    rotations = motion.rotations.copy()
    rotations[:, 0] = rot.mul(Z_UP, rotations[:, 0])
    return replace(motion, rotations=rotations, root=rot.mul_vec(Z_UP, motion.root))


def find_vertical(
    points: Callable[[slice], Floats], trunk: Floats, *, usual: str, height: float, is_stated: bool = False
) -> Vertical:
    """Find which axis of a file's world is up, y or z.

    Args:
        points: returns the places [T', P, 3] of a body's joints and tips in some of the frames, metres.
        trunk: directions of the trunk, up along the spine [T, 3].
        usual: "y" or "z", the axis that the rig stands along, or that is up in all files of a format.
        height: of the body, metres.
        is_stated: whether the format says what is usual: then a floor at 0 tells nothing.

    >>> import numpy as np
    >>> ahead = np.tile([0.0, 0.0, 1.0], (60, 1))
    >>> lying = np.stack([0.0 * ahead, ahead + np.linspace(0.0, 1.0, 60)[:, None] * ahead], axis=1)
    >>> find_vertical(lambda some: lying[some], ahead, usual="y", height=1.7).axis
    'y'
    """
    mean, own = trunk.mean(axis=0), _NAMES.index(usual)
    axis = int(np.argmax(np.abs(mean)))
    if mean[own] >= _STANDS or abs(mean[axis]) < _ALONG:
        return Vertical(usual)
    sign = float(np.sign(mean[axis]))
    along = "-" * (sign < 0.0) + _NAMES[axis]
    places = points(slice(None, None, -(-len(trunk) // _FRAMES)))
    heights = (sign * places[..., axis]).min(axis=1), places[..., own].min(axis=1)
    rises, usual_rises = (_rise(one, height) for one in heights) if len(places) >= _FEWEST else (1.0, 1.0)
    at_floor, usual_at_floor = (abs(float(np.median(one))) < _AT_FLOOR * height for one in heights)
    steadier = usual_rises > _STEADIER * rises
    if is_stated and not steadier:
        return Vertical(usual)
    if rises > _STEADIER * usual_rises or not (steadier or at_floor):
        is_sure = rises > _STEADIER * usual_rises or usual_at_floor
        found = usual if is_sure or along != "y" else "y"
        return Vertical(found, "" if is_sure else _either(along))
    if along not in ("y", "z"):
        doubt = f"its people stand along {along}, which is up in no file that is read; turn it so that y or z is"
        return Vertical(usual, doubt * steadier)
    is_sure = steadier or not usual_at_floor
    return Vertical(along, "" if is_sure else _either(along))


def _either(along: str) -> str:
    return f"its people lie, or stand along {along}, and nothing tells which (--up y or --up z does)"


def _rise(lowest: Floats, height: float) -> float:
    """Return by how much heights of the lowest point [T] vary while a body of a height is on the floor, metres."""
    low, high = np.quantile(lowest, _RISES)
    return max(float(high - low), _STILL * height)
