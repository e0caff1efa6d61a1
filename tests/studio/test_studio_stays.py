"""Hands and feet that stay in their places: laws on movement of the engine's own."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from motionmind import Engine
from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.errors import SkeletonError
from motionmind.names.finding import open_collection
from motionmind.names.spelling import Source
from motionmind.studio.edits import Ask, Pin
from motionmind.studio.sides import options_of
from motionmind.studio.stays import in_place, stays_of

MILLIMETRE = 1e-3
FAST = 2.5  # metres a second that no joint of a dancer who changes her posture exceeds
PINS = [
    Pin("left_wrist", "place", 0.25, 0.5),
    Pin("left_wrist", "place", 0.5, 1.0),
    Pin("right_wrist", "place", 0.6, 1.0),
    Pin("left_ankle", "place", 0.1, 0.4),
]


@pytest.fixture(scope="module")
def motion() -> Motion:
    ballet = open_collection(Source("ballet", "corpus", "ballet"), None)
    return Engine.load("ballet").tween(ballet.posture("arabesque"), ballet.posture("fifth"), duration=2.0).motion


def _places(motion: Motion, joint: str) -> Floats:
    return np.asarray(motion.skeleton.positions(motion.rotations, motion.root)[:, motion.skeleton.index(joint)])


def _facings(motion: Motion, joint: str) -> Floats:
    return motion.skeleton.global_rotations(motion.rotations)[:, motion.skeleton.index(joint)]


@pytest.mark.parametrize("pin", PINS, ids=lambda pin: f"{pin.joint} {pin.begins}-{pin.ends}")
def test_a_hand_or_foot_stays_in_its_place_and_the_ends_stay_as_they_were(motion: Motion, pin: Pin) -> None:
    found, words = in_place(motion, [pin])
    shares = motion.times / motion.times[-1]
    least = 0.3 / motion.times[-1] if pin.ends == 1.0 and pin.begins == 0.0 else 0.0  # in which it gets away
    held = (shares >= pin.begins) & (shares <= pin.ends - least)
    places, facings = _places(found, pin.joint)[held], _facings(found, pin.joint)[held]
    assert words == []
    assert np.ptp(places, axis=0).max() < MILLIMETRE
    assert np.abs(np.abs(np.sum(facings * facings[0], axis=-1)) - 1.0).max() < 1e-6
    for end in (0, -1):
        assert found.rotations[end].tobytes() == motion.rotations[end].tobytes()
    np.testing.assert_array_equal(found.root, motion.root)
    speed = np.linalg.norm(np.diff(_places(found, pin.joint), axis=0), axis=1) / np.diff(found.times)
    assert speed.max() < FAST


def test_only_the_limb_that_is_pinned_turns(motion: Motion) -> None:
    found, _ = in_place(motion, [PINS[0]])
    changed = np.flatnonzero((found.rotations != motion.rotations).any(axis=(0, 2)))
    limb = ["left_clavicle", "left_shoulder", "left_elbow", "left_wrist"]
    assert [motion.skeleton.names[joint] for joint in changed] == limb
    assert in_place(motion, [])[0].rotations.tobytes() == motion.rotations.tobytes()


def test_a_place_out_of_reach_is_approached_and_that_is_said(motion: Motion) -> None:
    away = motion.root + np.linspace(0.0, 3.0, len(motion))[:, None] * np.array([1.0, 0.0, 0.0])
    far = Motion(motion.skeleton, motion.rotations, away, motion.times)
    _, words = in_place(far, [Pin("left_wrist", "place", 0.0, 0.8)])
    assert len(words) == 1
    assert words[0].startswith("left hand drifts up to ")
    assert words[0].endswith(" cm from its place")


def test_a_wish_for_a_place_is_none_of_the_search(motion: Motion) -> None:
    ask = Ask(pins=(*PINS, Pin("left_ankle", "start")))
    assert stays_of(ask, motion.skeleton) == PINS
    assert set(options_of(ask, motion.skeleton, {}.__getitem__)) == {"pin"}
    with pytest.raises(SkeletonError, match="no joint 'tail'"):
        stays_of(Ask(pins=(Pin("tail", "place"),)), motion.skeleton)


@pytest.mark.parametrize(("begins", "ends"), [(0.5, 0.5), (0.95, 0.9), (0.0, 1.5), (-0.1, 1.0)])
def test_a_time_that_is_none_is_refused(begins: float, ends: float) -> None:
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({"joint": "left_wrist", "hold": "place", "begins": begins, "ends": ends}, Pin)
