"""What bears a body: the lowest points of its parts, and those that touch the floor with them."""

from __future__ import annotations

import numpy as np

from motionmind.body.contact import pose
from motionmind.body.human import human23
from motionmind.footing.feet import find_free_feet
from motionmind.footing.shape import lowest, shape_of
from motionmind.footing.support_phases import HOLDS_UP_SHARE, LIMB_TOUCHES_M, SupportPhases
from motionmind.geometry import rotations as rot

BODY = human23()
FRAMES = 30
FEET = find_free_feet(BODY, np.zeros(len(BODY), dtype=np.bool_))
RNG = np.random.default_rng(1)
MOVEMENT = rot.exp(0.4 * RNG.normal(size=(FRAMES, len(BODY), 3)))


def test_the_lowest_point_of_each_part() -> None:
    places = RNG.normal(size=(5, 7, 3))
    parts = np.zeros((3, 7), dtype=np.bool_)
    parts[0, [1, 4]] = parts[1, [0, 2, 6]] = True
    found = lowest(places, parts)
    np.testing.assert_array_equal(found[:, 0], places[:, [1, 4], 1].min(axis=1))
    np.testing.assert_array_equal(found[:, 1], places[:, [0, 2, 6], 1].min(axis=1))
    assert np.all(np.isinf(found[:, 2]))  # which has no points


def test_points_touch_the_floor_with_what_bears() -> None:
    shape = shape_of(BODY, pose(BODY, MOVEMENT), FEET)
    stands = np.ones((FRAMES, 2), dtype=np.bool_)
    stands[10:20, 0] = False
    others = np.where(np.arange(len(shape.others)) == 0, HOLDS_UP_SHARE + 0.1, 0.0) * np.ones((FRAMES, 1))
    touches = SupportPhases([[], []], stands, np.zeros((FRAMES, 2, 2)), others).touching(shape)
    heights = shape.places[..., 1]
    near = [heights < low[:, None] + LIMB_TOUCHES_M for low in (*shape.low.T, shape.low_others[:, 0])]
    bears = stands[:, 0].copy()
    bears[[9, 20]] = False  # as it lifts, or comes down
    expected = (near[0] & shape.feet[0] & bears[:, None]) | (near[1] & shape.feet[1]) | (near[2] & shape.others[0])
    np.testing.assert_array_equal(touches, expected)
    assert touches.any(axis=0).sum() > 4
