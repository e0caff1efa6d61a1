"""Limbs reach for pins on any body, and turn no joint that does not lead there."""

from __future__ import annotations

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.human import human23, human44
from motionmind.body.ik import chain_to, reach
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot


def bent(skeleton: Skeleton, seed: int, size: float) -> Floats:
    """Some rotations of all joints."""
    rng = np.random.default_rng(seed)
    return rot.exp(size * rng.standard_normal((len(skeleton), 3)))


@pytest.mark.parametrize(
    ("joint", "limb"),
    [
        ("left_wrist", ["left_clavicle", "left_shoulder", "left_elbow"]),
        ("right_toes", ["right_hip", "right_knee", "right_ankle"]),
        ("atlantal", ["cervical"]),
        ("left_hip", ["pelvis"]),
        ("thorax", ["lumbar"]),
    ],
)
def test_a_limb_ends_where_another_begins_with_fingers_or_without(joint: str, limb: list[str]) -> None:
    for body in (human23(), human44()):
        chain = [body.names[one] for one in chain_to(body, body.index(joint))]
        assert [name for name in chain if name in human23().names] == limb  # human44 has more of a spine


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("joint", ["left_wrist", "right_ankle", "atlantal", "left_toes", "right_fingers"])
def test_a_place_that_the_limb_can_come_to_is_reached(joint: str, seed: int) -> None:
    body, root = human23(), np.array([0.3, 0.9, -0.2])
    chain = chain_to(body, body.index(joint))
    start = bent(body, seed, 0.3)
    goal = start.copy()
    goal[chain] = rot.mul(bent(body, seed + 100, 0.3)[chain], goal[chain])
    place = body.positions(goal, root)[body.index(joint)]
    found = reach(body, start, root, body.index(joint), place)
    assert np.linalg.norm(body.positions(found, root)[body.index(joint)] - place) < 1e-5
    others = np.setdiff1d(np.arange(len(body)), chain)
    np.testing.assert_array_equal(found[others], start[others])


def test_a_place_out_of_reach_is_pointed_at() -> None:
    body, root = human23(), np.zeros(3)
    wrist, shoulder = body.index("left_wrist"), body.index("left_shoulder")
    rest = np.tile(rot.IDENTITY, (len(body), 1))
    far = np.array([3.0, 5.0, 2.0])
    places = body.positions(reach(body, rest, root, wrist, far), root)
    towards = (far - places[shoulder]) / np.linalg.norm(far - places[shoulder])
    reached = (places[wrist] - places[shoulder]) @ towards
    length = np.linalg.norm(body.offsets[[body.index("left_elbow"), wrist]], axis=1).sum()
    assert reached > 0.98 * length


def test_a_joint_that_is_there_turns_nothing() -> None:
    body = human23()
    start = bent(body, 0, 0.3)
    place = body.positions(start, np.zeros(3))[body.index("left_wrist")]
    np.testing.assert_array_equal(reach(body, start, np.zeros(3), body.index("left_wrist"), place), start)
