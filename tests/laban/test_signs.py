"""Signs: each direction has the directions nearest to it, and text says all of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from staves import ALL_VALUES, BY_COLUMN, random_staff

from motionmind.errors import FormatError
from motionmind.laban.signs import (
    AROUND,
    COLUMNS,
    LEVELS,
    PLACE,
    Sign,
    Staff,
    nearest_around,
    nearest_bend,
    nearest_sign,
    nearest_turn,
    vector_of,
)
from motionmind.laban.text import parse_value, read_staff, staff_text
from motionmind.notation.score import Where

POINTING = [(PLACE, "low"), (PLACE, "high"), *((around, level) for around in AROUND for level in LEVELS)]
WHOLE = "laban 1\ntitle A tendu\nbody human23\ntempo 60\nbar 4\ncounts 2\nleft arm\n  0 1 | left middle\n"


@pytest.mark.parametrize(("around", "level"), POINTING)
def test_every_direction_and_level_is_nearest_to_itself(around: str, level: str) -> None:
    assert nearest_sign(vector_of(around, level)) == (around, level)


@given(st.integers(0, 10**6))
def test_a_direction_is_within_half_a_sector_of_its_sign(seed: int) -> None:
    direction = np.random.default_rng(seed).normal(size=3)
    direction /= np.linalg.norm(direction)
    around, level = nearest_sign(direction)
    rise = np.degrees(np.arcsin(direction[1]))
    if around == PLACE:
        assert abs(rise) >= 67.5 - 1e-3
        assert (rise > 0.0) == (level == "high")
        return
    assert abs(rise - 45.0 * (LEVELS.index(level) - 1)) <= 22.5 + 1e-3
    turn = np.degrees(np.arctan2(direction[0], direction[2])) - 45.0 * AROUND.index(around)
    assert abs((turn + 180.0) % 360.0 - 180.0) <= 22.5 + 1e-3


@pytest.mark.parametrize(("around", "level"), POINTING)
def test_left_and_right_are_mirror_images(around: str, level: str) -> None:
    words = {"left": "right", "right": "left"}
    other = "-".join(words.get(word, word) for word in around.split("-"))
    assert np.allclose(vector_of(other, level), vector_of(around, level) * [-1.0, 1.0, 1.0])


@given(st.floats(-2000.0, 2000.0))
def test_a_turn_is_within_an_eighth_of_its_sign(degrees: float) -> None:
    assert nearest_turn(degrees) % 45 == 0
    assert abs(nearest_turn(degrees) - degrees) <= 22.5 + 1e-3


@given(st.floats(0.0, 150.0))
def test_a_bend_is_nearest_to_its_narrow_sign(degrees: float) -> None:
    assert abs(60.0 * nearest_bend(degrees) - degrees) <= min(abs(60.0 * bend - degrees) for bend in range(3)) + 1e-3


@pytest.mark.parametrize("around", AROUND)
def test_a_path_ignores_height(around: str) -> None:
    assert nearest_around(vector_of(around, "high")) == around


@pytest.mark.parametrize("value", ALL_VALUES, ids=str)
def test_every_sign_is_read_from_its_words(value: object) -> None:
    assert parse_value(str(value), Where("a.laban", 1)) == value


def test_every_sign_of_every_column_is_read_from_text(tmp_path: Path) -> None:
    path = tmp_path / "a.laban"
    for column in COLUMNS:
        signs = tuple(Sign(column, float(i), 1.0, value) for i, value in enumerate(BY_COLUMN[column]))
        staff = Staff("All signs", "human44", 96.5, 3, float(len(signs)), {}, signs)
        path.write_text(staff_text(staff), encoding="utf-8")
        assert read_staff(path) == staff


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_random_staves_are_read_from_their_text(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    path = tmp_path_factory.mktemp("staves") / "a.laban"
    staff = random_staff(seed)
    path.write_text(staff_text(staff), encoding="utf-8")
    assert read_staff(path) == staff
    assert staff_text(read_staff(path)) == staff_text(staff)


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        ("", 1, "the first line must be: laban 1"),
        (WHOLE.replace("laban 1", "laban 2"), 1, "the first line must be"),
        (WHOLE.replace("left arm", "left aarm"), 7, "'left aarm' is not a column; did you mean left arm?"),
        (WHOLE.replace("left arm", "tempo 60"), 7, "tempo is already defined"),
        (WHOLE + "left arm\n", 9, "left arm is already defined"),
        (WHOLE.replace("left arm\n", ""), 7, "a sign before any column"),
        (WHOLE.replace("left middle", "lefft middle"), 8, "'lefft middle' is not a sign; did you mean left?"),
        (WHOLE.replace("left middle", ""), 8, "'' is not a sign"),
        (WHOLE.replace("left middle", "left mittle"), 8, "'mittle' after the direction"),
        (WHOLE.replace("left middle", "left"), 8, "left is not a sign of the column left arm"),
        (WHOLE.replace("left middle", "place middle"), 8, "place middle is not a sign of the column left arm"),
        (WHOLE.replace("left middle", "hold"), 8, "hold is not a sign of the column left arm"),
        (WHOLE.replace("left middle", "left low touch"), 8, "left low touch is not a sign"),
        (WHOLE.replace("left arm\n  0 1 | left middle", "turn\n  0 1 | turn 50 left"), 8, "must be a multiple of 45"),
        (
            WHOLE.replace("left arm\n  0 1 | left middle", "turn\n  0 1 | turn 45"),
            8,
            "write turn DEGREES left, or right",
        ),
        (WHOLE.replace("left arm\n  0 1 | left middle", "turn\n  0 1 | turn 0"), 8, "turn 0 is not a sign of"),
        (
            WHOLE.replace("left arm\n  0 1 | left middle", "path\n  start | left"),
            8,
            "cannot be in the starting position",
        ),
        (WHOLE.replace("0 1 |", "0 1"), 8, "write BEGIN COUNTS | SIGN"),
        (WHOLE.replace("0 1 |", "0 |"), 8, "write the count where the sign begins"),
        (WHOLE.replace("0 1 |", "0 x |"), 8, "'x' where a number was expected"),
        (WHOLE.replace("0 1 |", "0 0 |"), 8, "a sign begins at count 0 or later, lasts"),
        (WHOLE.replace("0 1 |", "0 0.0099 |"), 8, "lasts 0.01 counts or more, and ends by 100000"),
        (WHOLE.replace("0 1 |", "-1 1 |"), 8, "a sign begins at count 0 or later, lasts"),
        (WHOLE + "  0.5 1 | left low\n", 9, "begins at count 0.5, before the sign below it ends, at 1"),
        (WHOLE + "  start | left low\n", 9, "start must be a column's first line"),
        (WHOLE.replace("counts 2", "counts 0.5"), 8, "counts 0.5: the last sign ends at 1"),
        (WHOLE.replace("counts 2\n", ""), 7, "there is no line counts"),
        (WHOLE.replace("bar 4", "bar 4.5"), 8, "must be a whole number of counts from 1 to 64"),
        (WHOLE.replace("tempo 60", "tempo fast"), 8, "tempo fast: give counts per minute"),
    ],
)
def test_bad_text_is_refused_in_a_line_that_says_where(tmp_path: Path, text: str, line: int, says: str) -> None:
    path = tmp_path / "a.laban"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FormatError) as error:
        read_staff(path)
    assert str(error.value).startswith(f"{path}:{line}: ")
    assert says in str(error.value)
    assert "\n" not in str(error.value)
