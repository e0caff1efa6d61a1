"""Whether two corpora are the same, and all that was learned from them, to the last bit."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from motionmind.learned.learning import Learned


def assert_learned_alike(one: Learned, other: Learned) -> None:
    """Fail if two corpora differ in clips, faults, movement or anything that was learned from them."""
    mine, theirs = one.corpus, other.corpus
    assert (mine.clips, mine.faults, mine.rate) == (theirs.clips, theirs.faults, theirs.rate)
    for name in ("rotations", "root", "times", "detail"):
        np.testing.assert_array_equal(getattr(mine, name), getattr(theirs, name), err_msg=name)
    for name in ("space", "grammar", "statistics", "pace", "plausibility", "gauge"):
        _assert_same_arrays(getattr(one, name), getattr(other, name))
    np.testing.assert_array_equal(one.states, other.states)


def _assert_same_arrays(mine: Any, theirs: Any) -> None:
    """Fail if two dataclasses differ in an array, however deep."""
    for field in fields(mine):
        value, same = getattr(mine, field.name), getattr(theirs, field.name)
        if isinstance(value, np.ndarray):
            np.testing.assert_array_equal(value, same, err_msg=field.name)
        elif is_dataclass(value):
            _assert_same_arrays(value, same)
