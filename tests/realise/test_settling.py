"""Settling: what the body does where a leg that it stands on was turned aside."""

from __future__ import annotations

import numpy as np

from motionmind.body.contact import lowest_height
from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.footing.root import stand
from motionmind.geometry import rotations as rot
from motionmind.realise.settling import FOLLOWS, _with_its_legs

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
