"""Signs as scores: the movement goes where they point, as far as the joints allow."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from staves import ALL_DIRECTIONS, danced, staff_of

from motionmind import compose
from motionmind.errors import MotionMindError
from motionmind.laban.scoring import checked_score, score_text
from motionmind.laban.signs import AROUND, LEVELS, PATH, PLACE, Direction, Hold, Sign, Staff, Turn, Value, allowed
from motionmind.notation import rows

# What the joints' limits do not allow; of the left limb, the right one's are their mirror images.
BEYOND = {
    "arm": {
        *("back middle", "back high", "right-back high", "right middle", "right high"),
        *("back middle bent", "back high bent", "right-back high bent", "right high bent", "back middle very bent"),
    },
    "leg": {
        *("left high", "left-back high", "back middle", "back high", "right-back middle", "right-back high"),
        *("right middle", "right high", "right-forward high", "place high bent", "back high bent"),
        *("right-back high bent", "right middle bent", "right high bent", "forward high very bent"),
        *("left-forward high very bent", "left high very bent", "right high very bent"),
        "right-forward high very bent",
    },
}
UPRIGHT_ENOUGH = {  # directions of the trunk and the head that their joints reach
    "torso": [
        *(Direction(around, "high") for around in AROUND),
        *(Direction(around, "middle") for around in ("forward", "left-forward", "right-forward")),
        Direction("forward", "low"),
    ],
    "head": [Direction(around, "high") for around in AROUND],
}
ONE_FOOT: dict[str, Value] = {"right support": Direction(PLACE, "middle"), "left leg": Direction(PLACE, "low", 1)}


def mirrored(words: str) -> str:
    other = {"left": "right", "right": "left"}
    return " ".join("-".join(other.get(part, part) for part in word.split("-")) for word in words.split())


@pytest.mark.parametrize("limb", ["arm", "leg"])
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_limb_points_where_its_sign_says_up_to_its_limits(tmp_path: Path, side: str, limb: str) -> None:
    column = f"{side} {limb}"
    values = [value for value in ALL_DIRECTIONS if allowed(column, value) and not value.touch]
    signs = [Sign(column, float(i), 1.0, value) for i, value in enumerate(values)]
    if limb == "leg":
        other = "right" if side == "left" else "left"
        signs.append(Sign(f"{other} support", 0.0, 1.0, Direction(PLACE, "middle")))
        signs.append(Sign(f"{other} support", 1.0, float(len(values) - 1), Hold()))
    got = danced(staff_of(signs), tmp_path)
    reached = {}
    at_count = got.start.get(column)
    ends = {sign.end: sign.value for sign in got.column(column)}
    for i, value in enumerate(values):
        at_count = ends.get(float(i + 1), at_count)
        reached[str(value)] = str(at_count)
    missed = {said if side == "left" else mirrored(said) for said, found in reached.items() if said != found}
    assert missed == BEYOND[limb]


@pytest.mark.parametrize("column", ["torso", "head"])
def test_the_trunk_leans_where_its_sign_says(tmp_path: Path, column: str) -> None:
    values = UPRIGHT_ENOUGH[column]
    signs = [Sign(column, float(i), 1.0, value) for i, value in enumerate(values)]
    got = danced(staff_of(signs, {"left leg": Direction(PLACE, "low")}), tmp_path)  # in the air
    assert [str(sign.value) for sign in got.column(column)] == [str(value) for value in values]


@pytest.mark.parametrize("around", [PLACE, *AROUND])
@pytest.mark.parametrize("level", LEVELS)
def test_a_step_goes_where_its_sign_says(tmp_path: Path, around: str, level: str) -> None:
    step = Sign("left support", 0.0, 1.0, Direction(around, level))
    got = danced(staff_of([step, Sign("right leg", 0.0, 1.0, Direction("back", "low", 1))], ONE_FOOT), tmp_path)
    assert [*got.column("left support")] == [step]
    assert not got.column("right support")


@pytest.mark.parametrize("degrees", [degrees for degrees in range(-720, 721, 45) if degrees])
def test_a_turn_is_as_far_as_its_pin_says(tmp_path: Path, degrees: int) -> None:
    turn = Sign("turn", 0.0, 2.0, Turn(degrees))
    holds = [Sign(f"{side} support", 0.0, 2.0, Hold()) for side in ("left", "right")]
    assert [*danced(staff_of([turn, *holds]), tmp_path).column("turn")] == [turn]


@pytest.mark.parametrize("around", AROUND)
def test_a_jump_travels_where_its_path_says(tmp_path: Path, around: str) -> None:
    gestures = [Sign(f"{side} leg", 0.0, 1.0, Direction(PLACE, "low")) for side in ("left", "right")]
    lands = [Sign(f"{side} support", 1.0, 1.0, Direction(PLACE, "low")) for side in ("left", "right")]
    path = Sign(PATH, 1.0, 1.0, Direction(around))
    got = danced(staff_of([*gestures, *lands, path]), tmp_path)
    assert [*got.column(PATH)] == [path]
    assert all([*got.column(sign.column)] == [sign] for sign in (*gestures, *lands))


@pytest.mark.parametrize("around", AROUND)
def test_a_foot_that_rests_on_the_floor_bears_no_weight(tmp_path: Path, around: str) -> None:
    touch = Sign("left leg", 0.0, 1.0, Direction(around, "low", touch=True))
    stand = Sign("right support", 0.0, 1.0, Direction(PLACE, "low"))
    if "right" in around.split("-"):
        return  # the other leg is in the way
    assert [*danced(staff_of([touch, stand]), tmp_path).column("left leg")] == [touch]


def test_a_limb_is_on_its_way_while_its_sign_lasts(tmp_path: Path) -> None:
    path = tmp_path / "a.score"
    slow = Sign("left arm", 0.0, 4.0, Direction("left", "high"))
    quick = [Sign("right arm", float(i), 1.0, Direction("forward", ("middle", "low")[i % 2])) for i in range(4)]
    path.write_text(score_text(staff_of([slow, *quick])), encoding="utf-8")
    motion = compose(path)
    wrist = motion.skeleton.index("left_wrist")
    rises = motion.skeleton.positions(motion.rotations, motion.root)[:, wrist, 1]
    assert len(motion) == 5
    assert all(rises[1:] > rises[:-1] + 0.05)


def test_a_score_that_the_body_cannot_follow_is_refused_in_a_line() -> None:
    leans = Sign("torso", 0.0, 1.0, Direction("forward", "low"))
    staff = staff_of(
        [leans, *(Sign(f"{side} support", 0.0, 1.0, Direction(PLACE, "low")) for side in ("left", "right"))]
    )
    with pytest.raises(
        MotionMindError, match=r"the body cannot follow the signs: the left fingers would be \d+ cm under"
    ):
        checked_score(staff)


def test_rests_and_signs_of_any_length_become_a_score(tmp_path: Path) -> None:
    # A rest of 2,500 counts, a sign of 3,000, and a rest to the end.
    raises = Sign("left arm", 2500.0, 3000.0, Direction("left", "high"))
    staff = replace(staff_of([raises]), counts=100_000.0)
    path = tmp_path / "long.score"
    path.write_text(checked_score(staff), encoding="utf-8")
    motion = compose(path)
    assert motion.times[-1] == pytest.approx(100_000.0)  # at 60 counts a minute
    wrist = motion.skeleton.index("left_wrist")
    rises = motion.skeleton.positions(motion.rotations, motion.root)[:, wrist, 1]
    rising = (motion.times[1:] > 2500.0) & (motion.times[1:] <= 5500.0)
    assert np.array_equal(np.diff(rises) > 1e-4, rising)


@pytest.mark.parametrize(
    ("signs", "says"),
    [
        (
            [Sign("left arm", 0.0, 1.0, Direction("left", "low")), Sign("head", 0.0, 1.005, Direction("left", "high"))],
            "signs begin or end at counts 1 and 1.005: a score needs 0.01 between",
        ),
        ([Sign("turn", 0.0, 0.1, Turn(3600))], "a turn of 3600 degrees from count 0 to 0.1 is too fast for a score"),
    ],
)
def test_limits_of_scores_are_not_the_bodys(signs: list[Sign], says: str) -> None:
    with pytest.raises(MotionMindError, match=f"^{re.escape(says)}"):
        checked_score(staff_of(signs))


def test_the_length_of_a_score_is_not_the_bodys_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rows, "MAX_CLIP_POSTURES", 3)
    signs = [Sign("left arm", float(i), 1.0, Direction("left", LEVELS[i % 3])) for i in range(4)]
    with pytest.raises(MotionMindError, match=r"^the signs cannot be written as a score: more than 3 postures"):
        checked_score(staff_of(signs))


def test_who_has_no_signs_for_legs_stands(tmp_path: Path) -> None:
    raises = Sign("left arm", 0.0, 3.0, Direction("left", "high"))
    got = danced(staff_of([raises], {}), tmp_path)
    assert [str(got.start[f"{side} support"]) for side in ("left", "right")] == ["place middle"] * 2
    assert [*got.column("left arm")] == [raises]
    assert "head" in got.start
    assert not got.column("head")


def test_a_body_that_is_unknown_is_refused() -> None:
    staff = Staff("A", "hexapod", 60.0, 4, 1.0, {}, ())
    with pytest.raises(MotionMindError, match="no body 'hexapod'; there are human23"):
        score_text(staff)
