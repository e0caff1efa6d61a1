"""Counts: a tween lasts its counts, passes postures on theirs, and is proven under them like any other."""

from __future__ import annotations

import numpy as np
import pytest
from command_line import Run

from motionmind import Engine, MotionMindError, TweenRequest, read_motion
from motionmind.body.motion import Posture
from motionmind.geometry import rotations as rot

NAMES = ("arabesque", "fifth", "passe", "second", "first")


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def postures(engine: Engine, *names: str) -> list[Posture]:
    return [engine.posture(name) for name in names]


@pytest.mark.parametrize(
    ("names", "tempo", "counts", "count"),
    [
        (("arabesque", "fifth", "passe"), 60.0, 8.0, 4.0),
        (("fifth", "arabesque", "passe"), 97.0, 6.0, 3.0),
        (("fifth", "second", "arabesque"), 133.3, 12.0, 5.0),
        (("arabesque", "fifth", "passe"), 60.0, 8.0, 2.0),  # hurried
        (("second", "fifth", "first"), 72.0, 5.5, 4.5),
    ],
)
def test_a_posture_is_passed_on_the_frame_of_its_count(
    ballet: Engine, names: tuple[str, str, str], tempo: float, counts: float, count: float
) -> None:
    a, b, via = postures(ballet, *names)
    tween = ballet.tween(a, b, tempo=tempo, counts=counts, via=[(via, f"count {count:g}")])
    motion = tween.motion
    assert motion.times[-1] == pytest.approx(counts * 60.0 / tempo, abs=1e-12)
    frame = int(np.abs(motion.times - (count - 1.0) * 60.0 / tempo).argmin())
    assert rot.angle(motion.rotations[frame], via.rotations).max() < 1e-6
    assert motion.insertions[0].times[tween.passed[0]] == pytest.approx(motion.times[frame], abs=1e-9)


def test_a_count_asks_for_the_path_through_a_move(ballet: Engine) -> None:
    a, b, via = postures(ballet, "arabesque", "fifth", "passe")
    counted = ballet.tween(a, b, tempo=60, counts=8, via=[(via, "count 4")])
    (move,) = counted.passed
    placed = ballet.tween(a, b, moves=counted.moves, duration=8.0, via=[(via, move)])
    np.testing.assert_array_equal(counted.path, placed.path)
    assert counted.status == placed.status == "optimal"
    assert counted.report()["asked"]["via"] == ["3s"]


def test_seconds_and_counts_are_the_same_times(ballet: Engine) -> None:
    a, b, via = postures(ballet, "arabesque", "fifth", "passe")
    counted = ballet.tween(a, b, tempo=90, counts=9, via=[(via, "count 4")])
    timed = ballet.tween(a, b, duration=6.0, via=[(via, "2.0s")])
    np.testing.assert_array_equal(counted.motion.rotations, timed.motion.rotations)


def test_postures_on_counts_stand_beside_others(ballet: Engine) -> None:
    a, b, first, second = postures(ballet, "arabesque", "fifth", "passe", "second")
    tween = ballet.tween(a, b, tempo=60, counts=9, via=[first, (second, "count 7")])
    motion = tween.motion
    assert tween.passed[0] < tween.passed[1]
    assert rot.angle(motion.rotations[round(6.0 * motion.fps)], second.rotations).max() < 1e-6


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"counts": 8}, "need a tempo"),
        ({"counts": 8, "tempo": 60, "duration": 8.0}, "take the place of a duration"),
        ({"tempo": 0.5}, "tempo must be a number of counts a minute"),
        ({"tempo": float("nan")}, "tempo must be"),
        ({"counts": 0, "tempo": 60}, "counts must be a number"),
        ({"counts": 8, "tempo": 60, "pace": 1.2}, "leave out pace"),
        ({"via": "count 4", "tempo": 60}, "needs a duration or counts"),
        ({"via": "count 4", "counts": 8, "tempo": 60, "moves": 9}, "no number of moves"),
        ({"via": "count 4", "duration": 8.0}, "needs a tempo"),
        ({"via": "count 0.5", "counts": 8, "tempo": 60}, "counts begin with 1"),
        ({"via": "count 1", "counts": 8, "tempo": 60}, "must increase by a frame or more"),
        ({"via": "count 9", "counts": 8, "tempo": 60}, "must increase by a frame or more"),
        ({"via": "soon", "counts": 8, "tempo": 60}, "neither seconds such as"),
        ({"via": "-1s", "counts": 8, "tempo": 60}, "neither seconds such as"),
    ],
)
def test_times_that_contradict_each_other_are_refused(ballet: Engine, options: dict[str, object], words: str) -> None:
    via = options.pop("via", None)
    given = {"via": [(ballet.posture("passe"), via)]} if via else {}
    with pytest.raises(MotionMindError, match=words):
        TweenRequest.of(**options, **given)  # type: ignore[arg-type]


def test_the_command_counts(run: Run) -> None:
    counted = ("--tempo", "108", "--counts", "8", "--via", "ballet/passe@count4")
    ran = run("tween", "ballet/arabesque", "ballet/fifth", *counted, "-o", "counted.json", "--details")
    assert ran.code == 0
    assert "8 counts at 108 a minute" in ran.out
    assert "at count 4 (1.67 s)" in ran.out
    assert read_motion("counted.json").times[-1] == pytest.approx(8 * 60 / 108)
    for wrong, words in ((("--counts", "8"), "need a tempo"), (("--via", "ballet/passe@count4"), "needs a tempo")):
        ran = run("tween", "ballet/arabesque", "ballet/fifth", *wrong, "-o", "wrong.json")
        assert (ran.code, ran.out) == (2, "")
        assert words in ran.err
