"""Scores as signs: one sign for each change of what a column says, against counting in the movement itself."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import groupby, pairwise
from pathlib import Path

import numpy as np
import pytest
from scores import BENDS
from staves import danced

from motionmind import MotionMindError, read_score
from motionmind.body.anatomy import SIDES
from motionmind.geometry import rotations as rot
from motionmind.laban.columns import Notated, notate
from motionmind.laban.signs import ARMS, COLUMNS, LEGS, SUPPORTS, Direction, Hold, Sign, nearest_bend, nearest_sign
from motionmind.notation.compose import played

CORPORA = Path(__file__).parents[2] / "corpora"
CLIPS = [
    ("ballet/allegro", "grand-jete"),
    ("ballet/centre", "pirouettes"),
    ("ballet/centre", "valse"),
    ("karate/kata", "heian-shodan"),
    ("macarena/macarena", "macarena"),
]
STEPS = """body human23
legs
  on = stand
  off = hip flexion 45
  low = stand bend 45
arms
  out = shoulder abduction 90
clip steps: Steps
  start | on
  1     | on / off
  2 go ahead 40 | off / on
  1     |
  1 up 20 | off
  1 go left 50 | on
  1 turn 90 left | low | out
"""


@cache
def notated(name: str, clip: str) -> Notated:
    score = read_score(CORPORA / f"{name}.score")
    return notate(score, next(found for found in score.clips if found.name == clip), 4)


@pytest.mark.parametrize(("name", "clip"), CLIPS)
def test_each_change_of_an_arm_has_one_sign(name: str, clip: str) -> None:
    score = read_score(CORPORA / f"{name}.score")
    ((rows, motion),) = played(score, [found for found in score.clips if found.name == clip])
    places = motion.skeleton.positions(motion.rotations, motion.root)
    back = rot.about_vertical(-np.radians([row.face for row in rows]))
    for side, column in zip(SIDES, ARMS, strict=True):
        shoulder, elbow, wrist = (
            rot.mul_vec(back, places[:, motion.skeleton.index(f"{side}_{joint}")])
            for joint in ("shoulder", "elbow", "wrist")
        )
        seen = []
        for upper, middle, lower in zip(shoulder, elbow, wrist, strict=True):
            cosine = (
                (middle - upper) @ (lower - middle) / np.linalg.norm(middle - upper) / np.linalg.norm(lower - middle)
            )
            bend = nearest_bend(float(np.degrees(np.arccos(min(cosine, 1.0)))))
            seen.append(Direction(*nearest_sign((lower - upper) / np.linalg.norm(lower - upper)), bend))
        changes = [value for value, _ in groupby(seen)]
        staff = notated(name, clip).staff
        assert [staff.start[column], *(sign.value for sign in staff.column(column))] == changes


@pytest.mark.parametrize(("name", "clip"), CLIPS)
def test_signs_of_a_column_follow_each_other(name: str, clip: str) -> None:
    staff = notated(name, clip).staff
    for column in COLUMNS:
        signs = staff.column(column)
        assert all(sign.counts > 0.0 for sign in signs)
        assert all(a.end <= b.begin for a, b in pairwise(signs))
        assert all(sign.end <= staff.counts for sign in signs)


@pytest.mark.parametrize(("name", "clip"), CLIPS)
def test_a_leg_gestures_only_while_it_bears_no_weight(name: str, clip: str) -> None:
    staff = notated(name, clip).staff
    for leg, support in zip(LEGS, SUPPORTS, strict=True):
        ends = [sign.end for sign in staff.column(leg)]
        for sign in staff.column(support):
            assert not any(sign.begin < end <= sign.end for end in ends)


@pytest.mark.parametrize(("name", "clip"), CLIPS)
def test_no_sign_is_further_off_than_its_sector(name: str, clip: str) -> None:
    # The corner of a sector: 22.5 degrees up and to the side.
    corner = np.degrees(np.arccos(np.cos(np.radians(22.5)) ** 2)) + 0.1
    for off in notated(name, clip).deviations:
        assert off.degrees <= (corner if "support" not in off.column else 22.6)
        assert off.degrees <= off.most
        assert off.bend <= 30.1


@pytest.mark.parametrize(("name", "clip"), CLIPS)
def test_most_signs_come_back_from_the_movement_of_their_score(tmp_path: Path, name: str, clip: str) -> None:
    staff = notated(name, clip).staff
    got = danced(staff, tmp_path)
    same = count = 0
    for column in (*ARMS, *LEGS, "torso", "head"):
        found = {sign.end: sign.value for sign in got.column(column)}
        same += sum(found.get(sign.end) == sign.value for sign in staff.column(column))
        count += len(staff.column(column))
    assert same >= 0.93 * count


def test_steps_jumps_turns_and_holds(tmp_path: Path) -> None:
    path = tmp_path / "steps.score"
    path.write_text(STEPS, encoding="utf-8")
    score = read_score(path)
    staff = notate(score, score.clips[0], 3).staff
    middle, gesture = Direction("place", "middle"), Direction("forward", "low")
    assert staff.start["left support"] == staff.start["right support"] == middle
    assert list(staff.column("left support")) == [
        Sign("left support", 0.0, 1.0, middle),
        Sign("left support", 5.0, 1.0, middle),
        Sign("left support", 6.0, 1.0, Direction("place", "low")),
    ]
    assert list(staff.column("right support")) == [
        Sign("right support", 1.0, 2.0, Direction("forward", "middle")),
        Sign("right support", 3.0, 1.0, Hold()),
        Sign("right support", 5.0, 1.0, middle),
        Sign("right support", 6.0, 1.0, Direction("place", "low")),
    ]
    assert list(staff.column("left leg")) == [Sign("left leg", 1.0, 2.0, gesture)]
    assert [(sign.begin, sign.end) for sign in staff.column("right leg")] == [(0.0, 1.0), (4.0, 5.0)]
    assert [(sign.begin, str(sign.value)) for sign in staff.column("path")] == [(5.0, "left")]
    assert [(sign.begin, str(sign.value)) for sign in staff.column("turn")] == [(6.0, "turn 90 left")]
    assert [(sign.begin, str(sign.value)) for sign in staff.column("right arm")] == [(6.0, "right middle")]


def test_a_clip_has_the_same_signs_at_any_tempo(tmp_path: Path) -> None:
    def staff_at(tempo: str) -> Notated:
        path = tmp_path / "steps.score"
        opening, first, rest = STEPS.partition("  1     | on / off")
        lines = [
            opening + tempo,
            first.replace("1  ", "1/3"),
            rest,
            "  fall, backwards\n",
            "phrase fall\n  1/3 | low\n  2 | low\n",
        ]
        path.write_text("".join(lines), encoding="utf-8")
        score = read_score(path)
        return notate(score, score.clips[0], 4)

    plain, fast = staff_at(""), staff_at("  tempo 90\n")
    assert fast.staff == replace(plain.staff, tempo=90.0)
    assert plain.is_steady
    assert fast.is_steady


def test_a_change_of_tempo_keeps_the_counts(tmp_path: Path) -> None:
    path = tmp_path / "bends.score"
    path.write_text(BENDS + "  tempo 120\n  4 | bend\n", encoding="utf-8")
    score = read_score(path)
    notated = notate(score, score.clips[0], 4)
    assert not notated.is_steady
    assert notated.staff.counts == 6.0
    assert notated.staff.tempo == 90.0  # 2 counts in 2 seconds, then 4 in 2


def test_a_movement_ends_where_the_limb_is_nearest_to_the_sign(tmp_path: Path) -> None:
    path = tmp_path / "raise.score"
    rises = (0, 20, 40, 60, 80, 90, 90, 90, 100)
    names = [f"  at-{i} = shoulder abduction {rise}" for i, rise in enumerate(rises)]
    lines = [f"  {'1' if i else 'start'} | | at-{i}" for i in range(len(rises))]
    path.write_text("\n".join(["body human23", "arms", *names, "clip raise: A raise", *lines]), encoding="utf-8")
    score = read_score(path)
    signs = notate(score, score.clips[0], 4).staff.column("left arm")
    assert [(sign.begin, sign.end, str(sign.value)) for sign in signs] == [
        (0.0, 2.0, "left low"),
        (2.0, 5.0, "left middle"),
    ]


def test_a_body_without_arms_is_refused() -> None:
    score = read_score(CORPORA / "walk-hexapod" / "insect.score")
    with pytest.raises(MotionMindError, match="Labanotation is drawn of people"):
        notate(score, score.clips[0], 4)
