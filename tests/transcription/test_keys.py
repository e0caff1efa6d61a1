"""The fewest key frames, against all choices of keys on small problems."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind._typing import Bools, Ints
from motionmind.transcription.keys import fewest_keys


class Table:
    """Whether each frame within each step is followed, drawn at random."""

    def __init__(self, count: int, share: float, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.followed = rng.random((count, count, count)) < share
        self.weights = rng.random(count) * (rng.random(count) < 0.7)

    def __call__(self, start: Ints, end: Ints, at: Ints) -> Bools:
        assert np.all((start < at) & (at < end))
        return np.asarray(self.followed[start, end, at])

    def follows(self, start: int, end: int, longest: int, shortest: int) -> bool:
        """Whether a step from one key to another is allowed."""
        last = len(self.weights) - 1
        if end - start == min(shortest, last) or (end == last and shortest <= end - start < 2 * shortest):
            return True
        followed = bool(self.followed[start, end, start + 1 : end].all())
        return shortest <= end - start <= longest and followed

    def missed(self, keys: list[int]) -> int:
        """How many frames are not followed."""
        return sum(int((~self.followed[a, b, a + 1 : b]).sum()) for a, b in pairwise(keys))

    def best(self, longest: int, shortest: int) -> tuple[int, int, float]:
        """The fewest keys, then the fewest frames not followed, then the least weight, by trying all choices."""
        count = len(self.weights)
        choices = [
            [0, *inner, count - 1] for size in range(count - 1) for inner in combinations(range(1, count - 1), size)
        ]
        return min(
            (len(keys), self.missed(keys), float(self.weights[keys].sum()))
            for keys in choices
            if all(self.follows(a, b, longest, shortest) for a, b in pairwise(keys))
        )


@settings(max_examples=150, deadline=None)
@given(
    st.integers(2, 9),
    st.sampled_from([0.3, 0.8, 0.95, 1.0]),
    st.integers(1, 8),
    st.sampled_from([1, 1, 2, 3, 5]),
    st.integers(0, 10**6),
)
def test_no_choice_of_keys_is_better(count: int, share: float, longest: int, shortest: int, seed: int) -> None:
    table = Table(count, share, seed)
    keys = fewest_keys(count, longest, table, table.weights, shortest)
    assert keys[0] == 0
    assert keys[-1] == count - 1
    assert np.all(np.diff(keys) > 0)
    assert all(table.follows(a, b, longest, shortest) for a, b in pairwise(keys))
    fewest, missed, least = table.best(longest, shortest)
    assert len(keys) == fewest
    assert table.missed(keys.tolist()) == missed
    assert table.weights[keys].sum() == pytest.approx(least, abs=1e-9)


def test_one_frame_is_one_key() -> None:
    assert fewest_keys(1, 5, Table(1, 1.0, 0), np.zeros(1)).tolist() == [0]


def test_steps_are_tested_in_parts() -> None:
    """More starts than are tested together: a straight line with corners needs the corners alone."""
    heights = np.interp(np.arange(700), [0, 90, 333, 500, 699], [0.0, 5.0, -3.0, 4.0, 4.0])

    def follows(start: Ints, end: Ints, at: Ints) -> Bools:
        share = (at - start) / (end - start)
        return np.abs(heights[start] + share * (heights[end] - heights[start]) - heights[at]) < 1e-9

    assert fewest_keys(700, 699, follows, np.zeros(700)).tolist() == [0, 90, 333, 500, 699]
