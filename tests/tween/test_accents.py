"""Tweens with accents on counts."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import BALLET
from command_line import Run

from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.formats import read_posture
from motionmind.geometry import rotations as rot
from motionmind.synthesis.accent_times import AccentKind, Accents
from motionmind.synthesis.accents import accented_clock, frames_off, retimed, speeds_of
from motionmind.tween.engine import Engine
from motionmind.tween.headline import beyond

A, B = (read_posture(BALLET / "postures" / f"{name}.json") for name in ("arabesque", "fifth"))
TIMES = np.arange(91) / 30.0
COUNTED = {"tempo": 120.0, "counts": 8.0}


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def swinging(peak: float) -> Motion:
    """A body that turns its thorax for 3 s, fastest at a time."""
    angle = np.cumsum(np.exp(-(((TIMES - peak) / 0.4) ** 2))) / 30.0
    q = np.tile(rot.IDENTITY, (len(TIMES), 23, 1))
    q[:, human23().index("thorax")] = rot.from_axis_angle([0.0, 1.0, 0.0], angle)
    return Motion(human23(), q, np.tile([0.0, 1.0, 0.0], (len(TIMES), 1)), TIMES, "swing")


def off(motion: Motion, kind: AccentKind, *seconds: float) -> list[float]:
    return frames_off(speeds_of(motion), motion.fps, Accents(seconds, kind)).tolist()


def test_peaks_and_rests_are_found_and_a_steady_turn_has_none() -> None:
    assert off(swinging(1.5), "fast", 1.5, 1.2) == pytest.approx([0.0, 9.0], abs=1.01)
    steady = np.tile(rot.IDENTITY, (len(TIMES), 23, 1))
    assert off(Motion(human23(), steady, np.zeros((len(TIMES), 3)), TIMES, ""), "still", 1.0) == [np.inf]


@pytest.mark.parametrize(
    ("kind", "wanted"), [("fast", 1.2), ("fast", 1.4), ("fast", 1.6), ("still", 1.2), ("still", 1.6)]
)
def test_a_clock_brings_an_accent_to_its_time(kind: AccentKind, wanted: float) -> None:
    motion, accents = swinging(1.4), Accents((wanted,), kind)
    shown = accented_clock(motion, accents, None, (False, False), [])
    assert shown is not None or off(motion, kind, wanted)[0] <= 1.0
    if shown is not None:
        assert (np.diff(shown) > 0.0).all()
        assert shown[[0, -1]].tolist() == [0.0, TIMES[-1]]
        placed = retimed(motion, shown)
        assert off(placed, kind, wanted)[0] <= 1.0 + 1e-6
        np.testing.assert_array_equal(placed.rotations[[0, -1]], motion.rotations[[0, -1]])


def test_a_clock_keeps_times_and_speeds() -> None:
    motion, accents = swinging(1.4), Accents((1.9,), "fast")
    shown = accented_clock(motion, accents, None, (False, False), [1.0])
    assert shown is not None
    assert np.interp(1.0, TIMES, shown) == pytest.approx(1.0, abs=1e-9)
    bound = np.full(23, 1.0)  # rad/s: its greatest speed already
    slower = accented_clock(motion, accents, bound, (False, False), [])
    turned = 30.0 * rot.angle(motion.rotations[:-1], motion.rotations[1:]).max()
    assert turned == pytest.approx(1.0, abs=0.01)
    if slower is not None:
        found = retimed(motion, slower)
        assert 30.0 * rot.angle(found.rotations[:-1], found.rotations[1:]).max() < 1.35


@pytest.mark.parametrize("kind", ["fast", "still"])
def test_a_tween_has_its_accents_on_their_counts(ballet: Engine, kind: AccentKind) -> None:
    free = ballet.tween(A, B, **COUNTED)  # type: ignore[arg-type]
    found = ballet.tween(A, B, accent=(3.0, 6.0), accent_kind=kind, **COUNTED)  # type: ignore[arg-type]
    assert [one.count for one in found.accented] == [3.0, 6.0]
    assert [one.seconds for one in found.accented] == [1.0, 2.5]
    assert [one.frames for one in found.accented] == pytest.approx(off(found.motion, kind, 1.0, 2.5))
    assert all(one.is_met for one in found.accented)
    assert max(off(free.motion, kind, 1.0, 2.5)) > 1.0
    assert found.motion.times[-1] == 4.0
    assert found.path.tobytes() == free.path.tobytes()
    np.testing.assert_array_equal(found.motion.rotations[[0, -1]], [A.rotations, B.rotations])


def test_an_accent_that_cannot_be_is_reported(ballet: Engine) -> None:
    found = ballet.tween(A, B, accent=(8.0, 9.0, 10.0), tempo=600.0, counts=20.0)
    missed = [one for one in found.accented if not one.is_met]
    assert missed  # three peaks in 0.2 s
    assert str(missed[0]) in beyond(found)
    assert f" frames from count {missed[0].count:g}" in str(missed[0])


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"accent": (3.0,)}, "accents on counts need a tempo, a duration or counts, and no number of moves"),
        ({"accent": (10.0,), **COUNTED}, "accent: count 10 is not between A, count 1, and B, count 9"),
        ({"accent": (5.0, 3.0), **COUNTED}, "accent: the counts 5, 3 must increase"),
        ({"accent": ("1.5s",)}, "accents on counts need a tempo, a duration or counts, and no number of moves"),
        ({"accent": ("9s",), "duration": 2.0}, "accent: 9s is not between A, 0 s, and B, 2 s"),
        ({"accent": ("1.5s", "1s"), "duration": 2.0}, "accent: the counts 1.5s, 1s must increase"),
        ({"accent": ("soon",), "duration": 2.0}, "accent: 'soon' is neither seconds such as '1.5s' nor 'count 4'"),
        ({"accent": (0.0,), **COUNTED}, "accent must be a number from 0.001 to 100000, not 0.0"),
        ({"accent": (2.0,), "accent_kind": "loud", **COUNTED}, "accent_kind must be 'fast' or 'still', not 'loud'"),
    ],
)
def test_accents_that_cannot_be_are_refused(ballet: Engine, options: dict[str, object], told: str) -> None:
    with pytest.raises(MotionMindError, match=told):
        ballet.tween(A, B, **options)  # type: ignore[arg-type]


def test_the_command_line_places_accents(run: Run) -> None:
    words = "tween", "ballet/arabesque", "ballet/fifth", "--tempo", 120, "--counts", 8
    ran = run(*words, "--accent", "3,6", "--accent-kind", "still", "-o", "t.json", "--report", "r.json", "--details")
    assert ran.code == 0
    assert "\naccent    the moment of rest is 0.0 frames from count 3" in ran.out
    report = json.loads(Path("r.json").read_text("utf-8"))
    assert report["asked"]["accent"] == [3.0, 6.0]
    assert [one["kind"] for one in report["accented"]] == ["still", "still"]
    refused = run(*words, "--accent", "3;6", "-o", "u.json")
    assert refused.code == 2
    assert "'3;6' is neither a count such as 3 nor a list such as 1,5." in refused.err


@pytest.mark.long
def test_a_place_to_reach_keeps_its_time_beside_accents(ballet: Engine) -> None:
    """The clock that brings a rest to count 4 would show the place 0.1 s late, 8 cm off."""
    reach = [("left_wrist", (0.35, 1.3, 0.3), 1.6)]
    tween = ballet.tween(A, B, accent=[4.0], accent_kind="still", reach=reach, **COUNTED)  # type: ignore[arg-type]
    assert tween.reached[0].distance <= 0.01
