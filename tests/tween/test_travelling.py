"""Tweens that travel to a place on the floor, or along a path drawn there."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import BALLET
from command_line import Run

from motionmind.body.contact import foot_slide
from motionmind.body.motion import Motion, Velocity
from motionmind.errors import MotionMindError
from motionmind.footing.smoothing import smoothstep
from motionmind.formats import read_motion, read_posture
from motionmind.geometry import rotations as rot
from motionmind.geometry.polylines import offsets_to
from motionmind.tween.ends import bring_ends
from motionmind.tween.engine import Engine
from motionmind.tween.headline import beyond
from motionmind.tween.travel import NEAR_PATH_M

A, B = (read_posture(BALLET / "postures" / f"{name}.json") for name in ("arabesque", "fifth"))
TWEEN = "tween", "ballet/arabesque", "ballet/fifth"
TURN = np.linspace(0.0, np.pi, 30)[1:]
PATHS = {
    "straight": [(0.0, 1.2)],
    "corner": [(0.9, 0.0), (0.9, 0.9)],
    "half circle": [(0.8 * np.sin(turn), 0.8 - 0.8 * np.cos(turn)) for turn in TURN],
}


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def facing(motion: Motion, frame: int) -> float:
    """The facing in a frame, degrees."""
    return float(np.degrees(rot.heading(motion.rotations[frame, 0])))


def warped(motion: Motion, place: tuple[float, float], turn: float) -> Motion:
    """The movement with its root's path and facing bent smoothly to a place, whatever the feet do."""
    share, rotations = smoothstep(np.linspace(0.0, 1.0, len(motion))), motion.rotations.copy()
    rotations[:, 0] = rot.mul(rot.about_vertical(turn * share), rotations[:, 0])
    off = np.array([place[0], 0.0, place[1]]) - motion.root[-1] * (1.0, 0.0, 1.0)
    return replace(motion, rotations=rotations, root=motion.root + share[:, None] * off)


def slide(motion: Motion) -> float:
    """How far feet slide, cm a frame."""
    return foot_slide(motion.skeleton, motion.rotations, motion.root)


@pytest.mark.parametrize(("place", "degrees"), [((1.2, 0.5), 90.0), ((-0.6, -1.0), -150.0)])
def test_b_stands_where_it_should_and_steps_there(ballet: Engine, place: tuple[float, float], degrees: float) -> None:
    free, found = ballet.tween(A, B), ballet.tween(A, B, to=(*place, degrees))
    np.testing.assert_allclose(found.motion.root[-1], [place[0], B.root[1], place[1]], atol=1e-12)
    assert facing(found.motion, -1) == pytest.approx(degrees)
    np.testing.assert_array_equal(found.motion.rotations[-1, 1:], B.rotations[1:])
    travelled = found.travelled
    assert travelled is not None
    assert (travelled.place, travelled.off) == (place, None)
    assert (travelled.distance, travelled.degrees, travelled.facing) == pytest.approx((0.0, 0.0, degrees), abs=1e-6)
    assert travelled.length == pytest.approx(np.hypot(*(place - A.root[[0, 2]])))
    assert found.motion.times[-1] > free.motion.times[-1]
    turn = np.radians(degrees - facing(free.motion, -1))
    assert slide(found.motion) < 0.3 * slide(warped(free.motion, place, turn))


def test_without_a_facing_b_keeps_its_own(ballet: Engine) -> None:
    found = ballet.tween(A, B, to=(0.5, 0.5))
    np.testing.assert_array_equal(found.motion.rotations[-1], B.rotations)


def test_a_velocity_at_b_turns_with_it(ballet: Engine) -> None:
    motion = ballet.corpus.motion(ballet.corpus.clips[0]).slice(3, 9)
    free = bring_ends(ballet.corpus, A, motion.posture(0), after=motion)
    turn = facing(motion, 0) + 90.0
    ends = bring_ends(ballet.corpus, A, motion.posture(0), after=motion, to=(2.0, 0.0, turn))
    assert isinstance(ends.arriving, Velocity)
    assert isinstance(free.arriving, Velocity)
    x, y, z = free.arriving.root
    np.testing.assert_allclose(ends.arriving.root, [z, y, -x], atol=1e-9)
    np.testing.assert_array_equal(ends.arriving.rotations, free.arriving.rotations)


@pytest.mark.long
@pytest.mark.parametrize("name", PATHS)
def test_the_body_keeps_to_a_drawn_path(ballet: Engine, name: str) -> None:
    found = ballet.tween(A, B, along=PATHS[name])
    drawn = np.array([A.root[[0, 2]], *PATHS[name]])
    far = np.linalg.norm(offsets_to(drawn, found.motion.root[:, [0, 2]]), axis=1)
    assert found.travelled is not None
    assert found.travelled.off is not None
    assert far.max() - 1e-9 <= found.travelled.off
    assert found.travelled.is_met
    assert slide(found.motion) < 0.4
    np.testing.assert_allclose(found.motion.root[-1][[0, 2]], PATHS[name][-1], atol=1e-12)


@pytest.mark.long
def test_a_round_path_from_a_to_a_is_danced_and_takes_its_time(ballet: Engine) -> None:
    x, z = A.root[[0, 2]]
    round_path = [(x + 0.5 * np.sin(turn), z + 0.5 - 0.5 * np.cos(turn)) for turn in np.linspace(0.0, 2.0 * np.pi, 40)]
    found = ballet.tween(A, A, along=round_path)
    assert found.travelled is not None
    assert found.travelled.is_met
    assert found.travelled.length == pytest.approx(np.pi, rel=0.01)
    assert found.motion.times[-1] > 3.0


def test_a_path_that_cannot_be_kept_to_is_reported(ballet: Engine) -> None:
    there_and_back = [(0.9 * (k % 2), 0.1 * k) for k in range(6)]
    found = ballet.tween(A, B, along=there_and_back, duration=1.0)
    assert found.travelled is not None
    assert found.travelled.off is not None
    assert found.travelled.off > NEAR_PATH_M
    assert f"travels {found.travelled}" in beyond(found)
    assert "cm off the path" in str(found.travelled)


@pytest.mark.parametrize("sway", [0.0, 60.0])
def test_the_body_is_where_it_should_be_at_each_time_and_faces_so(ballet: Engine, sway: float) -> None:
    """On a bow to B, there and back in its facing."""
    seconds, (x, z), start = 3.0, A.root[[0, 2]], float(np.degrees(rot.heading(A.rotations[0])))
    shares = np.linspace(0.0, 1.0, 30)[1:-1]
    bow = np.sin(np.pi * shares)
    places = np.stack([x + (1.5 - x) * shares + 0.3 * bow, z + (0.5 - z) * shares], axis=1)
    degrees = start + (60.0 - start) * shares - sway * bow
    points = np.column_stack([places, seconds * shares, degrees]).tolist()
    found = ballet.tween(A, B, duration=seconds, to=(1.5, 0.5, 60.0), along=points)
    there = found.motion.at(seconds * shares)
    far = np.linalg.norm(there.root[:, [0, 2]] - places, axis=1)
    turned = np.degrees(rot.heading(there.rotations[:, 0])) - degrees
    assert far.max() < NEAR_PATH_M
    assert np.abs((turned + 180.0) % 360.0 - 180.0).max() < 6.0
    assert found.travelled is not None
    assert found.travelled.off == pytest.approx(far.max(), abs=1e-9)
    assert found.travelled.is_met
    np.testing.assert_allclose(found.motion.root[-1], [1.5, B.root[1], 0.5], atol=1e-12)
    assert slide(found.motion) < 0.5


def test_with_times_b_stands_where_it_is(ballet: Engine) -> None:
    found = ballet.tween(A, B, duration=2.0, along=[(*A.root[[0, 2]], 1.0, 0.0)])
    np.testing.assert_array_equal(found.motion.root[-1], B.root)


def test_the_command_line_travels(run: Run) -> None:
    Path("path.csv").write_text("x,z\n0.4,0\n0.8,0.4  # there\n")
    ran = run(*TWEEN, "--along", "path.csv", "--to", "1,0.6,45", "-o", "t.json", "--report", "r.json", "--details")
    assert ran.code == 0
    assert "\ntravel    1.2 m to 1, 0.6 m, facing 45 degrees; up to " in ran.out
    np.testing.assert_allclose(read_motion("t.json").root[-1][[0, 2]], [1.0, 0.6], atol=1e-9)
    report = json.loads(Path("r.json").read_text("utf-8"))
    assert report["asked"]["to"] == [1.0, 0.6, 45.0]
    assert report["asked"]["along"] == [[0.4, 0.0], [0.8, 0.4]]
    assert report["travelled"]["place"] == pytest.approx([1.0, 0.6])


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"to": (1.0,)}, "to must be x and z in metres, and perhaps a facing in degrees, up to 10000 each, not 1.0"),
        ({"to": (1.0, float("nan"))}, "to must be x and z"),
        ({"along": []}, "along must have 1 to 10000 points, not 0"),
        ({"along": [(0.0, 1.0, 2.0)]}, "along: point 1 must be x, z in metres, up to 10000, not 0.0, 1.0, 2.0"),
        ({"along": [(0.0, 0.0), (1.0, 0.0, 1.0, 0.0)]}, "along: all points must have a time and a facing, or none"),
        ({"along": [(0.0, 0.0, 1.0, 0.0)]}, "along: points at times need a duration or counts"),
        (
            {"along": [(0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 1.0, 0.0)], "duration": 2.0},
            "along: the times 1, 1 s must increase, from 0 to the 2 s",
        ),
        ({"along": [(0.0, 0.0, 2.5, 0.0)], "duration": 2.0}, "along: the times 2.5 s must increase"),
        ({"along": [(0.0, 0.0), (300.0, 0.0)]}, "along: the path is 300 m long, and a tween may travel up to 200 m"),
    ],
)
def test_travel_that_cannot_be_is_refused(ballet: Engine, options: dict[str, object], told: str) -> None:
    with pytest.raises(MotionMindError, match=told):
        ballet.tween(A, B, **options)  # type: ignore[arg-type]


def test_a_place_that_is_none_is_one_line(run: Run) -> None:
    ran = run(*TWEEN, "--to", "1,two", "-o", "t.json")
    assert (ran.code, ran.out) == (2, "")
    assert "'1,two' is neither a place in metres such as 2,1.5 nor one with a facing: 2,1.5,90." in ran.err
