"""Files of other programs: one line that says what to do."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from bodies import ant, tumble
from hypothesis import given
from hypothesis import strategies as st

from motionmind import read_motion, write_motion
from motionmind.display import one_line
from motionmind.errors import FormatError, MotionMindError
from motionmind.formats import _READABLE
from motionmind.formats.refused import _WAYS_OUT, way_out

# Words that say what to do: a verb and, unless the file is merely packed, a format that is read.
_TO_DO = re.compile(r"\b(export|unpack|save)\b.*(BVH|glTF|\.npz|give a file)")


@pytest.mark.parametrize("suffix", sorted(_WAYS_OUT))
def test_one_line_says_what_to_do(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix.upper()}"
    path.write_bytes(b"x")
    with pytest.raises(FormatError) as caught:
        read_motion(path)
    message = str(caught.value)
    assert message == f"{path}: {way_out(suffix)}"
    assert message == one_line(message)
    assert _TO_DO.search(message)
    assert list(tmp_path.iterdir()) == [path]


def test_no_readable_suffix_is_refused() -> None:
    assert not {*_READABLE} & {*_WAYS_OUT}


@given(st.text("abcdefghijklmnopqrstuvwxyz0123456789", min_size=1, max_size=5).map(".{}".format))
def test_other_suffixes_name_those_that_are_read(suffix: str) -> None:
    if suffix not in (*_READABLE, *_WAYS_OUT):
        with pytest.raises(FormatError, match=re.escape(", ".join(_READABLE))):
            read_motion(f"no such file{suffix}")


@pytest.mark.parametrize("suffix", [".fbx", ".zip"])
def test_writing_lists_what_can_be_written(suffix: str, tmp_path: Path) -> None:
    with pytest.raises(MotionMindError, match=r"files that can be written end in \.json"):
        write_motion(tmp_path / f"a{suffix}", tumble(ant(), seed=0))
    assert not list(tmp_path.iterdir())
