"""Laws of plain numbers: compiled code reads them as NumPy does, to the bit, or leaves them alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionmind.formats._numbers import read_plain

numbers = st.floats(-1e12, 1e12) | st.floats(-1.0, 1.0)
written = st.sampled_from(["%.6f", "%.4f", "%.0f", "%g", "%+.5f", "%.9e", "%.15g", "%.17g", "%.20f"])


@given(st.lists(st.tuples(numbers, written, numbers, written), min_size=1, max_size=20), st.sampled_from(" \t"))
def test_what_is_read_is_what_numpy_reads(rows: list[tuple[float, str, float, str]], blank: str) -> None:
    lines = [f"{blank}{one % a}{blank}{blank}{other % b}" for a, one, b, other in rows]
    found = read_plain(lines, 2)
    if found is not None:
        assert found.tobytes() == np.loadtxt(lines, ndmin=2).tobytes()
    if all(form in ("%.6f", "%.4f", "%+.5f") for _, one, _, other in rows for form in (one, other)):
        assert found is not None or max(abs(number) for a, _, b, _ in rows for number in (a, b)) > 9e9


@pytest.mark.parametrize("line", ["1e22 -1E-22", "+5. -.5", "1e5 2e+3 ", "-0 0.0", "9007199254740992 1"])
def test_all_ways_of_writing_are_known(line: str) -> None:
    found = read_plain([line], 2)
    assert found is not None
    assert found.tobytes() == np.loadtxt([line], ndmin=2).tobytes()


@pytest.mark.parametrize(
    "word",
    ["x", "nan", "inf", ".", "-", "1e", "1e+", "--3", "1.2.3", "1_0", "0x3", "1e5x", "1e23", "9" * 20, "\u0663", ""],
)
def test_what_is_not_plain_is_left_alone(word: str) -> None:
    assert read_plain(["1 2", f"1 {word}"], 2) is None
    assert read_plain(["1 2 3", f"1 {word}"], 2) is None
