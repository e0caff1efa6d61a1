"""Parts of bodies, and the limits of their joints."""

from __future__ import annotations

import numpy as np
import pytest

from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.human import human23
from motionmind.body.limbs import parts_of
from motionmind.body.limits import find_loose, within_limits
from motionmind.body.skeleton import Skeleton


def test_each_joint_is_in_one_part_of_each_size() -> None:
    names = human23().names
    whole, carrying, carried, *limbs = ([names[j] for j in part] for part in parts_of(human23()))
    for parts in ([whole], [carrying, carried], limbs):
        assert sorted(name for part in parts for name in part) == sorted(names)
    assert limbs[0] == ["pelvis", "lumbar", "thorax"]
    assert ["left_hip", "left_knee", "left_ankle", "left_toes"] in limbs
    assert carrying == ["pelvis", *limbs[1], *limbs[2]]
    hand = Skeleton("hand", ("wrist", "thumb", "finger"), (-1, 0, 0), np.zeros((3, 3)))
    assert [part.tolist() for part in parts_of(hand)] == [[0, 1, 2], [0, 1, 2], [0], [1], [2]]


def test_joints_are_brought_to_their_limits_and_no_further() -> None:
    anatomy = anatomy_named("human23")
    q = np.tile(anatomy.rotations({"pelvis": np.zeros((1, 3))}), (3, 1, 1))
    bent = anatomy.rotations({"left_knee": np.array([[170.0, 0.0, 0.0]]), "right_hip": np.array([[0.0, 100.0, 0.0]])})
    q[1] = bent[0]
    tight = np.zeros(23, dtype=np.bool_)
    limited = anatomy.degrees(within_limits(human23(), q, q[[0, 2]], tight))[1]
    assert limited[human23().index("left_knee"), 0] == pytest.approx(150.0)
    assert limited[human23().index("right_hip"), 1] == pytest.approx(80.0)
    np.testing.assert_array_equal(within_limits(human23(), q, q[[0, 2]], tight)[[0, 2]], q[[0, 2]])
    loose = np.arange(23) == human23().index("left_knee")
    spared = within_limits(human23(), q, q[[0, 2]], loose)
    np.testing.assert_array_equal(spared[:, loose], q[:, loose])
    assert anatomy.degrees(spared)[1, human23().index("right_hip"), 1] == pytest.approx(80.0)
    q[2] = q[1]  # what is given is not changed, nor what goes no further
    np.testing.assert_array_equal(within_limits(human23(), q, q[1:], tight), q)


def test_joints_that_a_corpus_itself_has_beyond_their_limits_are_loose() -> None:
    anatomy, knee = anatomy_named("human23"), human23().index("left_knee")
    straight = np.tile(anatomy.rotations({"pelvis": np.zeros((1, 3))}), (200, 1, 1))
    for degrees, count, loose in ((154.0, 200, False), (156.0, 2, False), (156.0, 3, True), (170.0, 200, True)):
        q = straight.copy()
        q[:count, knee] = anatomy.rotations({"left_knee": np.array([[degrees, 0.0, 0.0]])})[0, knee]
        assert find_loose(human23(), q).tolist() == [joint == knee and loose for joint in range(23)]
