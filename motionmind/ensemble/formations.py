"""Formations: places of dancers on the floor, seen from above."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from motionmind._typing import Floats

V_ANGLE_DEG = 45.0  # of each arm of a V to the line that faces the audience


def _line(count: int) -> Floats:
    x = np.arange(count) - 0.5 * (count - 1)
    return np.stack([x, np.zeros(count)], axis=1)


def _circle(count: int) -> Floats:
    if count == 1:
        return np.zeros((1, 2))
    radius = 0.5 / np.sin(np.pi / count)  # neighbours are 1 apart
    angles = 2.0 * np.pi * np.arange(count) / count
    return np.asarray(radius * np.stack([np.sin(angles), np.cos(angles)], axis=1))


def _v(count: int) -> Floats:
    """Place the first dancer at the tip, downstage, then left and right in turn."""
    steps, sides = (np.arange(count) + 1) // 2, np.where(np.arange(count) % 2 == 1, 1.0, -1.0)
    angle = np.radians(V_ANGLE_DEG)
    return np.stack([sides * steps * np.cos(angle), -steps * np.sin(angle)], axis=1)


def _grid(count: int) -> Floats:
    """Fill as many rows as columns, from downstage right; the last may be shorter."""
    columns = int(np.ceil(np.sqrt(count)))
    row, column = np.divmod(np.arange(count), columns)
    return np.stack([column - 0.5 * (columns - 1), 0.5 * (row.max() if count else 0) - row], axis=1)


FORMATIONS: Mapping[str, Callable[[int], Floats]] = {"line": _line, "circle": _circle, "V": _v, "grid": _grid}


def places_in(formation: str, count: int, spacing: float) -> Floats:
    """Return the places x, z [N, 2] of dancers in a formation around the origin, metres.

    Args:
        formation: a key of FORMATIONS.
        count: number of dancers.
        spacing: distance between neighbours, metres.

    >>> places_in("line", 3, 1.5)[:, 0].tolist()
    [-1.5, 0.0, 1.5]
    """
    return spacing * FORMATIONS[formation](count)
