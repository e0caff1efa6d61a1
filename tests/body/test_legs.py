"""Legs are found in any body."""

from __future__ import annotations

import numpy as np

from motionmind import Skeleton, human23, human44
from motionmind.body.legs import find_legs
from motionmind.body.limbs import parts_of


def test_legs_are_found_by_their_long_bones() -> None:
    for skeleton in (human23(), human44()):
        legs = [
            ([skeleton.names[joint] for joint in leg], skeleton.names[leg[knee]])
            for leg, knee in find_legs(skeleton)[1]
        ]
        assert [knee for _, knee in legs] == ["left_knee", "right_knee"]
        assert [leg[0] for leg, _ in legs] == ["left_hip", "right_hip"]


def test_legs_hang_where_the_body_forks_first() -> None:
    """A rig's own root above the pelvis changes nothing; a chain that does not fork is no leg."""
    body = human23()
    rig = Skeleton(
        "rig",
        ("root", *body.names),
        (-1, 0, *(p + 1 for p in body.parents[1:])),
        np.concatenate([[[0.0] * 3], body.offsets]),
        np.concatenate([[[0.0] * 3], body.tips]),
    )
    assert [[joint - 1 for joint in leg] for leg, _ in find_legs(rig)[1]] == [leg for leg, _ in find_legs(body)[1]]
    assert parts_of(rig)[1].tolist() == [0, *(parts_of(body)[1] + 1)]
    chain = Skeleton("chain", ("a", "b", "c"), (-1, 0, 1), np.array([[0.0] * 3, [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]))
    assert find_legs(chain)[1] == []
