"""Hands and feet that a tween brings to given places."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import BALLET
from command_line import Run

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError, SkeletonError
from motionmind.formats import read_motion, read_posture
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine
from motionmind.tween.headline import beyond
from motionmind.tween.reaches import REACHED_M

A, B = (read_posture(BALLET / "postures" / f"{name}.json") for name in ("arabesque", "fifth"))
TWEEN = "tween", "ballet/arabesque", "ballet/fifth"


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def place_of(motion: Motion, joint: str, seconds: float) -> Floats:
    """Where a joint is [3], metres."""
    return motion.at(np.array([seconds])).positions()[0, motion.skeleton.index(joint)]


def corpus_place(engine: Engine, motion: Motion, joint: str, seconds: float, rng: np.random.Generator) -> Floats:
    """Where a posture of the corpus has a joint, seen from the pelvis, and up to some centimetres beside it."""
    corpus, at = engine.corpus, motion.at(np.array([seconds]))
    row = int(rng.integers(len(corpus)))
    there = corpus.skeleton.positions(corpus.rotations[row], corpus.root[row])
    turn = rot.about_vertical(rot.heading(at.rotations[:, 0]) - rot.heading(corpus.rotations[row, :1]))
    return (
        at.root[0]
        + rot.mul_vec(turn, (there[corpus.skeleton.index(joint)] - there[0])[None])[0]
        + rng.normal(0.0, 0.02, 3)
    )


@pytest.mark.parametrize("seed", range(4))
def test_hands_reach_where_the_corpus_has_them(ballet: Engine, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = rng.integers(0, len(ballet.corpus), 2).tolist()
    a, b = (type(A)(A.skeleton, ballet.corpus.rotations[row], ballet.corpus.root[row]) for row in rows)
    free = ballet.tween(a, b, duration=2.0)
    reach = []
    for joint, seconds in (("left_wrist", 0.7), ("right_wrist", 1.25)):
        reach.append((joint, tuple(corpus_place(ballet, free.motion, joint, seconds, rng)), seconds))
    found = ballet.tween(a, b, duration=2.0, reach=reach)
    for (joint, place, seconds), reached in zip(reach, found.reached, strict=True):
        distance = np.linalg.norm(place_of(found.motion, joint, seconds) - place)
        assert (reached.joint, reached.seconds) == (joint, seconds)
        assert reached.distance == pytest.approx(distance)
        assert distance < REACHED_M
    assert found.path.tobytes() == free.path.tobytes()
    for tween in (found, free):
        np.testing.assert_array_equal(tween.motion.rotations[[0, -1]], [a.rotations, b.rotations])


def test_a_place_out_of_reach_is_reported_with_its_distance(ballet: Engine) -> None:
    found = ballet.tween(A, B, reach=[("left_wrist", (3.0, 1.0, 0.0), 1.2)])
    (reached,) = found.reached
    assert reached.distance == pytest.approx(
        np.linalg.norm(place_of(found.motion, "left_wrist", 1.2) - (3.0, 1.0, 0.0))
    )
    assert f"left_wrist is {100.0 * reached.distance:.1f} cm from its place at 1.2 s" in beyond(found)
    report = found.report()
    assert report["asked"]["reach"] == [["left_wrist", [3.0, 1.0, 0.0], 1.2]]
    assert report["reached"][0]["distance"] == reached.distance


def test_a_body_that_stays_moves_to_reach(ballet: Engine) -> None:
    place = place_of(A.as_motion(), "left_wrist", 0.0) + np.array([0.05, 0.05, 0.0])
    found = ballet.tween(A, A, reach=[("left_wrist", tuple(place), 0.6)], duration=1.2)
    assert found.moves > 0
    assert found.reached[0].is_met


def test_what_cannot_be_reached_for_is_refused(ballet: Engine) -> None:
    with pytest.raises(SkeletonError, match="no joint 'right_hand' in human23; did you mean right_"):
        ballet.tween(A, B, reach=[("right_hand", (0.0, 1.0, 0.0), 1.0)])
    with pytest.raises(MotionMindError, match=r"reach left_wrist: 60 s is not between A and B: the movement lasts "):
        ballet.tween(A, B, reach=[("left_wrist", (0.0, 1.0, 0.0), 60.0)])


@pytest.mark.long
def test_alternatives_before_one_that_ends_before_the_reach_are_kept(run: Run) -> None:
    run(*TWEEN, "--alternatives", 4, "-o", "free.json")
    lasts = [float(read_motion(f"free-{number}.json").times[-1]) for number in range(1, 5)]
    seconds = lasts[0] - 0.05
    n_long = next(number for number, one in enumerate(lasts) if one < seconds)  # alternatives have paces of their own
    assert n_long > 0
    ran = run(*TWEEN, "--alternatives", 4, "--reach", f"left_wrist=0.3,1.2,0.3@{seconds:.3f}s", "-o", "t.json")
    assert ran.code == 0
    assert f"{n_long} of 4 found: reach left_wrist: {seconds:.3f}"[:-1] in ran.err
    assert [Path(f"t-{number}.json").exists() for number in range(1, 5)] == [True] * n_long + [False] * (4 - n_long)
    late = run(*TWEEN, "--alternatives", 4, "--reach", "left_wrist=0.3,1.2,0.3@60s", "-o", "u.json")
    assert (late.code, late.out) == (2, "")
    assert "reach left_wrist: 60 s is not between A and B" in late.err
    assert not list(Path().glob("u*.json"))


def test_the_command_line_reaches_and_prints_how_near(run: Run) -> None:
    place = place_of(Engine.load("ballet").tween(A, B).motion, "right_wrist", 1.2) + 0.1
    word = f"right_wrist={','.join(map(str, place))}@1.2s"
    ran = run(*TWEEN, "--reach", word, "-o", "t.json", "--report", "report.json", "--details")
    assert ran.code == 0
    assert "\nreach     right_wrist is 0." in ran.out
    assert np.linalg.norm(place_of(read_motion("t.json"), "right_wrist", 1.2) - place) < REACHED_M
    assert json.loads(Path("report.json").read_text("utf-8"))["reached"][0]["seconds"] == 1.2


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("right_hand=0,1,0@1", "no joint 'right_hand' in human23; did you mean right_"),
        ("right_wrist=nan,1,0@1", "--reach right_wrist=nan,1,0@1: give a joint, its place in metres and the seconds"),
        ("right_wrist=0,1@1", "--reach right_wrist=0,1@1: give a joint"),
        ("right_wrist=0,1,0", "--reach right_wrist=0,1,0: give a joint"),
        ("right_wrist", "--reach right_wrist: give a joint"),
        ("right_wrist=0,1,0@0", "reach right_wrist: the time must be more than 0 s"),
        ("right_wrist=0,1,0@99s", "reach right_wrist: 99 s is not between A and B"),
        ("right_wrist=0,1e9,0@1s", "reach right_wrist: metres and seconds are numbers up to 10000"),
    ],
)
def test_a_reach_that_cannot_be_is_one_line(word: str, told: str, run: Run) -> None:
    ran = run(*TWEEN, "--reach", word, "-o", "t.json")
    assert (ran.code, ran.out) == (2, "")
    lines = [line for line in ran.err.splitlines() if not line.startswith("still preparing")]
    assert len(lines) == 1
    assert lines[0].startswith(f"error: {told}")
    assert not Path("t.json").exists()
