"""Numbers as they are given, numpy's or Python's, as Python's own, which files hold; what is no number is refused."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.errors import MotionMindError


def whole(name: str, value: object, least: int | None = None, most: int | None = None) -> int:
    """A whole number from `least` to `most`; MotionMindError says which one is none, or out of this range."""
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        found = int(value)
        if (least is None or found >= least) and (most is None or found <= most):
            return found
    span = "".join(f" {word} {bound}" for word, bound in (("from", least), ("to", most)) if bound is not None)
    raise MotionMindError(f"{name} must be a whole number{span}, not {value!r}")


def number(name: str, value: object) -> float:
    """A finite number; MotionMindError where it is none."""
    found = _finite(value)
    if found is None or found.ndim:
        raise MotionMindError(f"{name} must be a finite number, not {value!r}")
    return float(found)


def numbers(name: str, value: object) -> tuple[float, ...]:
    """Finite numbers [d], or of a single one that; MotionMindError where they are none."""
    found = _finite(value)
    if found is None:
        raise MotionMindError(f"{name} must be finite numbers, not {value!r}")
    return tuple(map(float, found.reshape(-1)))


def _finite(value: object) -> Floats | None:
    try:
        found = np.asarray(value)
    except ValueError:  # rows of different lengths
        return None
    if found.dtype.kind not in "iuf" or found.ndim > 1 or not np.isfinite(found).all():
        return None
    return found.astype(np.float64)
