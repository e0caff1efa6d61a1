"""Limbs as capsules: how deep they are in each other does not depend on side, place or size of the body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bodies import insect

from motionmind._typing import Floats
from motionmind.body.capsules import capsules_of, legs_depth, penetration
from motionmind.body.human import BODIES, human23, human44
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot


def rest(body: Skeleton, **turned: Floats) -> Floats:
    """Local rotations [J, 4] at rest, but for the rotation vectors of some joints."""
    out = np.tile(rot.IDENTITY, (len(body), 1))
    for joint, vector in turned.items():
        out[body.index(joint)] = rot.exp(np.array(vector))
    return out


def tumble(body: Skeleton, frames: int = 60) -> Floats:
    """Random local rotations [frames, J, 4]."""
    return rot.normalise(np.random.default_rng(3).normal(size=(frames, len(body), 4)))


@pytest.mark.parametrize("name", BODIES)
def test_nothing_is_inside_anything_in_a_body_at_rest(name: str) -> None:
    body = BODIES[name]()
    depths = penetration(body, rest(body))
    assert ("left_shank", "right_shank") in depths
    assert not np.any(list(depths.values()))


def test_shanks_that_cross_are_inside_each_other_by_the_sum_of_their_radii() -> None:
    """Both hips turned inwards by the same angle: the axes meet between the knees and the ankles."""
    body, angle = human23(), 0.145
    crossed = rest(body, left_hip=[0.0, 0.0, -angle], right_hip=[0.0, 0.0, angle])
    capsules = capsules_of(body)
    down = 0.085 / np.sin(angle) - 0.417  # along the shank to where the axes meet
    top, bottom = capsules.radii[capsules.names.index("left_shank")]
    expected = 2.0 * (top + down / 0.418 * (bottom - top))
    assert penetration(body, crossed)["left_shank", "right_shank"] == pytest.approx(expected)
    assert legs_depth(body, crossed) >= expected - 1e-9


def test_a_hand_in_the_chest_is_inside_the_trunk() -> None:
    body = human23()
    folded = rest(body, left_shoulder=[0.0, -1.2, 0.0], left_elbow=[0.0, -2.7, 0.0])
    depths = penetration(body, folded)
    assert depths["left_hand", "trunk"] > 0.03
    assert depths["right_hand", "trunk"] == 0.0
    assert legs_depth(body, folded) == 0.0


def test_legs_are_as_deep_as_their_deepest_parts() -> None:
    body = human44()
    rotations = tumble(body)
    depths = penetration(body, rotations)
    legs = [depth for (one, other), depth in depths.items() if one.startswith("left") and _leg(one) and _leg(other)]
    assert len(legs) == 16
    assert np.any(legs)
    np.testing.assert_array_equal(legs_depth(body, rotations), np.max(legs, axis=0))


def test_a_mirrored_body_is_as_deep_on_the_other_side() -> None:
    body = human23()
    rotations = tumble(body)
    image = mirrored(Motion(body, rotations, np.zeros((60, 3)), np.arange(60.0)))
    depths, others = penetration(body, rotations), penetration(body, image.rotations)
    for (one, other), depth in depths.items():
        pair = (_other_side(one), _other_side(other))
        np.testing.assert_allclose(others[pair if pair in others else pair[::-1]], depth, atol=1e-9)


def test_a_body_twice_as_tall_is_twice_as_deep() -> None:
    body = human23()
    tall = replace(body, offsets=2.0 * body.offsets, tips=2.0 * body.tips)
    rotations = tumble(body)
    for pair, depth in penetration(body, rotations).items():
        np.testing.assert_allclose(penetration(tall, rotations)[pair], 2.0 * depth, atol=1e-12)


def test_of_other_bodies_nothing_is_known() -> None:
    body = insect()
    rotations = tumble(body)
    assert penetration(body, rotations) == {}
    np.testing.assert_array_equal(legs_depth(body, rotations), np.zeros(60))


def _leg(name: str) -> bool:
    return name.endswith(("thigh", "shank", "foot", "toes"))


def _other_side(name: str) -> str:
    sides = {"left": "right", "right": "left"}
    side, _, part = name.partition("_")
    return f"{sides[side]}_{part}" if side in sides else name
