"""Hands and feet that stay in their places during a part of a tween."""

from __future__ import annotations

import numpy as np
import pytest
from bundled_clips import BALLET

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.errors import SkeletonError
from motionmind.formats import read_posture
from motionmind.tween.engine import Engine
from motionmind.tween.headline import beyond
from motionmind.tween.reaches import REACHED_M
from motionmind.tween.result import Tween

A, B = (read_posture(BALLET / "postures" / f"{name}.json") for name in ("arabesque", "fifth"))
FAST = 2.5  # metres a second that no joint of a dancer who changes her posture exceeds


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


@pytest.fixture(scope="module")
def free(ballet: Engine) -> Tween:
    return ballet.tween(A, B, duration=2.0)


def places_of(motion: Motion, joint: int, shares: Floats) -> Floats:
    """Where a joint is at shares of the time, increasing [N, 3], metres."""
    return motion.at(motion.times[-1] * shares).positions()[:, joint]


@pytest.mark.parametrize(
    "stay",
    [
        ("left_wrist", 0.25, 0.5),
        ("left_wrist", 0.5, 1.0),
        ("right_wrist", 0.6, 1.0),
        ("left_ankle", 0.1, 0.4),
        ("left_wrist", 0.0, 1.0),
    ],
    ids=lambda stay: " ".join(map(str, stay)),
)
def test_a_hand_or_foot_stays_with_what_it_carries(ballet: Engine, free: Tween, stay: tuple[str, float, float]) -> None:
    name, begins, ends = stay
    found = ballet.tween(A, B, duration=2.0, stay=[stay])
    joint = A.skeleton.index(name)
    anchor = 1.0 if ends == 1.0 and begins > 0.0 else begins
    until = 0.5 if (begins, ends) == (0.0, 1.0) else ends  # what is held from A on leaves in time for B
    for one in (joint, *A.skeleton.children(joint)):
        place = places_of(found.motion, one, np.array([anchor]))
        off = np.linalg.norm(places_of(found.motion, one, np.linspace(begins + 1.0 / 60.0, until, 41)) - place, axis=1)
        assert off.max() < 1.5 * REACHED_M  # between frames
        assert np.median(off) < 0.4 * REACHED_M
    (stayed,) = found.stayed
    assert (stayed.joint, stayed.begins, stayed.ends) == stay
    assert stayed.is_met
    assert not any("drifts" in line for line in beyond(found))
    assert found.path.tobytes() == free.path.tobytes()
    for tween in (found, free):
        np.testing.assert_array_equal(tween.motion.rotations[[0, -1]], [A.rotations, B.rotations])
    speed = np.linalg.norm(np.diff(found.motion.positions()[:, joint], axis=0), axis=1) / np.diff(found.motion.times)
    assert speed.max() < FAST


def test_a_share_is_one_of_the_finished_motion_even_if_that_slows_down(ballet: Engine) -> None:
    found = ballet.tween(A, B, pace=1.5, stay=[("left_wrist", 0.3, 0.8)])
    shares = found.motion.times / found.motion.times[-1]
    held = (shares >= 0.3) & (shares <= 0.8)
    places = found.motion.positions()[held, A.skeleton.index("left_wrist")]
    assert np.linalg.norm(places - places[0], axis=1).max() == pytest.approx(found.stayed[0].drift)
    assert found.stayed[0].is_met


def test_places_that_contradict_each_other_are_approached_and_that_is_reported(ballet: Engine) -> None:
    stays = [("left_wrist", 0.2, 0.7), ("left_wrist", 0.4, 0.9)]
    found = ballet.tween(A, B, duration=2.0, stay=stays)
    drifts = [one for one in found.stayed if not one.is_met]
    assert drifts
    for one in drifts:
        assert f"left_wrist drifts up to {100.0 * one.drift:.0f} cm from its place" in beyond(found)
    report = found.report()
    assert report["asked"]["stay"] == [list(stay) for stay in stays]
    assert [one["drift"] for one in report["stayed"]] == [one.drift for one in found.stayed]


def test_what_cannot_stay_is_refused(ballet: Engine) -> None:
    with pytest.raises(SkeletonError, match="no joint 'right_hand' in human23; did you mean right_"):
        ballet.tween(A, B, stay=[("right_hand", 0.0, 0.5)])
