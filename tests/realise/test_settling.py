"""Settling: what the body does where a leg that it stands on was turned aside, or has risen, or sunk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.contact import lowest_height
from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.body.support import standing_rises
from motionmind.footing.ground import SINKS
from motionmind.footing.root import stand
from motionmind.geometry import rotations as rot
from motionmind.realise.settling import FOLLOWS, RISES, SEEN, _lifted, _lowered, _with_its_legs

BODY, FRAMES, FPS = human23(), 46, 30.0


def test_a_body_comes_down_with_the_leg_that_is_turned_aside_under_it() -> None:
    straight = np.tile(rot.IDENTITY, (FRAMES, len(BODY), 1))
    straight[:, BODY.index("left_hip")] = rot.from_axis_angle([1.0, 0.0, 0.0], -1.2)
    root = stand(BODY, straight, np.zeros((FRAMES, 3)), np.zeros(FRAMES))
    aside, hip = straight.copy(), BODY.index("right_hip")
    course = np.sin(np.linspace(0.0, np.pi, FRAMES)) ** 2
    aside[:, hip] = rot.from_axis_angle([0.0, 0.0, 1.0], 0.25 * course)
    lifted = lowest_height(BODY, aside, root)
    assert lifted.max() > 0.02
    given = np.zeros(FRAMES, dtype=np.bool_)
    given[[0, 20, -1]] = True
    came = _with_its_legs(Motion(BODY, straight, root, np.arange(FRAMES) / FPS), aside, given, FPS)
    np.testing.assert_array_equal(came[given], root[given])
    away = np.abs(np.arange(FRAMES)[:, None] - np.flatnonzero(given)).min(axis=1) >= FOLLOWS * FPS
    assert np.abs(lowest_height(BODY, aside, came)[away]).max() < 0.1 * lifted.max()


def on_the_right_leg() -> tuple[Floats, Floats]:
    """A body whose left thigh is lifted, the right foot on the floor; and its root."""
    rotations = np.tile(rot.IDENTITY, (FRAMES, len(BODY), 1))
    rotations[:, BODY.index("left_hip")] = rot.from_axis_angle([1.0, 0.0, 0.0], -1.2)
    return rotations, stand(BODY, rotations, np.zeros((FRAMES, 3)), np.zeros(FRAMES))


def up(heights: Floats | float) -> Floats:
    return np.multiply.outer(np.asarray(heights), [0.0, 1.0, 0.0])


GIVEN = np.isin(np.arange(FRAMES), [0, 20, FRAMES - 1])
FLOOR = np.zeros(FRAMES)


@pytest.mark.parametrize("waves", [1, 3, 9])
def test_a_limb_that_stands_alone_is_kept_down_between_given_postures(waves: int) -> None:
    """Whether it rises slowly or fast, and without the body sinking as much where it does not."""
    rotations, root = on_the_right_leg()
    course = np.linspace(0.0, np.pi, FRAMES)
    raised = root + up(0.04 * (np.sin(waves * course) * np.sin(course)) ** 2 * ~GIVEN)
    lowered = _lowered(BODY, rotations, raised, FLOOR, GIVEN, FPS)
    rises = standing_rises(BODY, rotations, lowered)
    assert rises is not None
    assert rises.max() < RISES + 1e-9
    assert rises.min() > -0.03
    np.testing.assert_array_equal(lowered[GIVEN], raised[GIVEN])


@pytest.mark.parametrize("towards", [0.08, -0.08])
def test_a_foot_that_stays_on_the_floor_until_it_leaves_it_is_not_raised_all_the_way(towards: float) -> None:
    """As before a spring, or after one: between both ends the body would float."""
    rotations, root = on_the_right_leg()
    late = np.clip((np.arange(FRAMES) - FRAMES + 6) / 5.0, 0.0, 1.0)
    given = np.isin(np.arange(FRAMES), [0, FRAMES - 1])
    springing = root + up(abs(towards) * (late if towards > 0.0 else late[::-1]))
    np.testing.assert_array_equal(_lowered(BODY, rotations, springing, FLOOR, given, FPS), springing)


@pytest.mark.parametrize("aloft", [0, 20, FRAMES - 1])
def test_a_body_that_is_given_in_the_air_is_not_kept_down_beside_it(aloft: int) -> None:
    rotations, root = on_the_right_leg()
    away = np.abs(np.arange(FRAMES) - aloft) / FPS
    leaping = root + up(np.maximum(0.3 - 4.9 * away**2, 0.0))
    lowered = _lowered(BODY, rotations, leaping, FLOOR, GIVEN, FPS)
    np.testing.assert_array_equal(lowered, leaping)
    # What stands on a floor as high as that is.
    higher = leaping + up(0.4 * np.sin(np.linspace(0.0, np.pi, FRAMES)) * ~GIVEN)
    assert np.abs(_lowered(BODY, rotations, higher, FLOOR + 0.3, GIVEN, FPS) - higher).max() > 0.1


def test_what_is_in_the_floor_is_lifted_out_of_it_and_no_more() -> None:
    rotations, root = on_the_right_leg()
    floor = np.linspace(-0.1, 0.1, FRAMES)
    on_floor = root + up(floor)
    assert _lifted(BODY, rotations, on_floor, floor, GIVEN, FPS) is on_floor
    sunk = on_floor - up(0.02 * np.exp(-(((np.arange(FRAMES) - 10) / 3.0) ** 2)) * ~GIVEN)
    lifted = _lifted(BODY, rotations, sunk, floor, GIVEN, FPS)
    low = lowest_height(BODY, rotations, lifted) - floor
    assert low.min() > -SINKS - 1e-9
    assert low.max() < 0.02
    np.testing.assert_array_equal(lifted[GIVEN], sunk[GIVEN])


def test_a_foot_that_stands_does_not_rise_with_one_that_is_a_little_in_the_floor() -> None:
    rotations, root = on_the_right_leg()
    bell = np.exp(-(((np.arange(FRAMES) - 33) / 4.0) ** 2)) * ~GIVEN
    # The other leg reaches down beside the one that stands, and 2 cm farther.
    rotations[:, BODY.index("left_hip")] = rot.from_axis_angle([1.0, 0.0, 0.0], -1.2 * (1.0 - bell))
    legs = [BODY.index(f"left_{joint}") for joint in ("knee", "ankle")]
    offsets = BODY.offsets.copy()
    offsets[legs] *= 1.0 + 0.02 / np.abs(offsets[legs, 1]).sum()
    longer = replace(BODY, offsets=offsets)
    rises = standing_rises(longer, rotations, _lifted(longer, rotations, root, FLOOR, GIVEN, FPS))
    assert rises is not None
    assert 0.01 < rises.max() < SEEN + 1e-9
    # Where both are in it, the body is lifted out all the same.
    deep = _lifted(longer, rotations, root - up(0.1 * bell), FLOOR, GIVEN, FPS)
    assert lowest_height(longer, rotations, deep)[~GIVEN].min() > SEEN - 0.02 - SINKS
    # And where the other alone is deep in it.
    offsets[legs] *= 1.05
    far = _lifted(replace(BODY, offsets=offsets), rotations, root, FLOOR, GIVEN, FPS)
    assert lowest_height(replace(BODY, offsets=offsets), rotations, far)[~GIVEN].min() > -RISES - SINKS - 1e-9
