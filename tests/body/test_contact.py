"""Heights and the floor: one set of points with heels, one without, and one rule for the floor."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.contact import (
    contact_points,
    feet_that_stay,
    find_floor,
    floor_height,
    limb_heights,
    lowest_height,
    lowest_point,
    skating,
)
from motionmind.body.human import BODIES, human23
from motionmind.body.limbs import limbs_of
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot


def tumble(body: Skeleton, frames: int = 40, seed: int = 0) -> tuple[Floats, Floats]:
    """Random local rotations [frames, J, 4] and root positions [frames, 3]."""
    rng = np.random.default_rng(seed)
    return rot.normalise(rng.normal(size=(frames, len(body), 4))), rng.normal(size=(frames, 3))


@pytest.mark.parametrize("name", BODIES)
def test_the_lowest_point_is_the_lowest_of_all_limbs_and_the_trunk(name: str) -> None:
    body = BODIES[name]()
    rotations, root = tumble(body)
    limbs = limb_heights(body, rotations, root)
    assert limbs.shape == (40, len(limbs_of(body)) + 1)
    lowest = lowest_height(body, rotations, root)
    np.testing.assert_array_equal(limbs.min(axis=1), lowest)
    height, joint = lowest_point(anatomy_named(name), rotations, root)
    np.testing.assert_array_equal(height, lowest)
    bones = np.maximum(np.linalg.norm(body.tips, axis=-1), 0.2)  # a heel is less than 0.2 m from its ankle
    at = body.positions(rotations, root)[np.arange(40), joint, 1]
    assert np.all(at - height <= bones[joint])


@pytest.mark.parametrize("name", BODIES)
def test_a_heel_is_where_a_joint_would_hang_from_the_ankle(name: str) -> None:
    """On both sides, as a mirror shows them; of heels so long that they are often the lowest point."""
    anatomy, body = anatomy_named(name), BODIES[name]()
    assert anatomy.leg is not None
    place = np.array([0.1, -0.2, -0.3])
    longer = replace(anatomy, leg=msgspec.structs.replace(anatomy.leg, heel=tuple(place.tolist())))
    rotations, root = tumble(body, 200)
    heights, joints = lowest_point(longer, rotations, root)
    at, turned = body.positions(rotations, root), body.global_rotations(rotations)
    expected, _ = lowest_point(replace(anatomy, leg=None), rotations, root)
    for side, mirror in (("left", 1.0), ("right", -1.0)):
        ankle = body.index(f"{side}_{anatomy.leg.ankle}")
        heel = (at[:, ankle] + rot.mul_vec(turned[:, ankle], place * [mirror, 1.0, 1.0]))[:, 1]
        assert np.sum(joints[heel < expected] == ankle) > 10
        expected = np.minimum(expected, heel)
    np.testing.assert_allclose(heights, expected, atol=1e-12)


@pytest.mark.parametrize("heels", [True, False])
def test_the_lowest_height_is_that_of_the_lowest_place(heels: bool) -> None:
    rotations, root = tumble(human23())
    places, _ = contact_points(human23(), rotations, root, heels=heels)
    heights = lowest_height(human23(), rotations, root, heels=heels)
    np.testing.assert_array_equal(heights, places[..., 1].min(axis=-1))
    in_rows = lowest_height(human23(), rotations.reshape(8, 5, -1, 4), root.reshape(8, 5, 3), heels=heels)
    np.testing.assert_array_equal(in_rows.reshape(-1), heights)
    about_root = lowest_height(human23(), rotations[0], np.zeros(3), heels=heels)
    np.testing.assert_allclose(about_root + root[0, 1], heights[0], atol=1e-12)


def test_a_person_at_rest_stands_on_heels_and_toes() -> None:
    """In human23's own measures: the ankles are 90.5 cm under the pelvis, the soles 97.1 cm."""
    body = human23()
    rest, root = np.tile(rot.IDENTITY, (1, 23, 1)), np.array([[0.0, 2.0, 0.0]])
    ankle, toes = (body.index(f"left_{joint}") for joint in ("ankle", "toes"))
    points = body.positions_and_tips(rest, root)[0, :, 1]
    assert lowest_height(body, rest, root) == pytest.approx(2.0 - 0.971)
    assert lowest_height(body, rest, root, heels=False) == pytest.approx(2.0 - 0.971)
    np.testing.assert_allclose(points[[ankle, toes, toes + 23]], [2.0 - 0.905, 2.0 - 0.971, 2.0 - 0.971], atol=1e-12)
    # Bent by 30 degrees the heel, 6.6 cm below the ankle and 4.5 cm behind it, comes lower.
    rest[0, ankle] = rot.from_axis_angle([1.0, 0.0, 0.0], -np.pi / 6.0)
    lower = 0.066 * np.cos(np.pi / 6.0) + 0.045 * np.sin(np.pi / 6.0)
    assert lowest_height(body, rest, root) == pytest.approx(2.0 - 0.905 - lower)
    limbs = limb_heights(body, rest, root)[0]
    left = next(number for number, limb in enumerate(limbs_of(body)) if ankle in limb)
    assert limbs[left] == pytest.approx(2.0 - 0.905 - lower)
    assert np.sum(limbs == limbs[left]) == 1


def test_without_heels_a_body_stands_no_lower() -> None:
    """On a foot that is bent up the heel is the lowest point, and on one that is stretched the toes are."""
    body = human23()
    rest = np.tile(rot.IDENTITY, (1, 23, 1))
    up, down = rest.copy(), rest.copy()
    for side in ("left", "right"):
        up[:, body.index(f"{side}_ankle")] = rot.from_axis_angle([1.0, 0.0, 0.0], -0.8)
        down[:, body.index(f"{side}_ankle")] = rot.from_axis_angle([1.0, 0.0, 0.0], 0.8)
    root = np.zeros((1, 3))
    assert lowest_height(body, up, root)[0] < lowest_height(body, up, root, heels=False)[0] - 0.01
    assert lowest_height(body, down, root) == lowest_height(body, down, root, heels=False)


def test_heels_grow_with_the_body() -> None:
    body = human23()
    tall = replace(body, offsets=body.offsets * 1.2, tips=body.tips * 1.2)
    rotations, root = tumble(body)
    expected = 1.2 * lowest_height(body, rotations, root)
    np.testing.assert_allclose(lowest_height(tall, rotations, 1.2 * root), expected, atol=1e-12)


@pytest.mark.parametrize("heels", [True, False])
def test_the_floor_is_under_nineteen_frames_of_twenty(heels: bool) -> None:
    body = human23()
    rotations, root = tumble(body, 200)
    lowest = lowest_height(body, rotations, root, heels=heels)
    floor = find_floor(body, rotations, root, heels=heels)
    assert floor == floor_height(lowest)
    assert np.mean(lowest < floor) == pytest.approx(0.05, abs=0.01)


def test_a_foot_that_is_put_down_or_lifted_does_not_skate() -> None:
    """It is to be low in both frames, from the first to the second of which it goes far."""
    body = human23()
    rest = np.tile(rot.IDENTITY, (2, 23, 1))
    low = 0.971
    for heights, expected in (((0.0, 0.0), 1.0), ((0.0, 0.06), 0.0), ((0.06, 0.0), 0.0), ((0.04, 0.04), 1.0)):
        root = np.array([[0.0, low + heights[0], 0.0], [0.1, low + heights[1], 0.0]])
        assert skating(body, rest, root) == expected


def test_a_foot_stays_that_is_on_the_floor_all_the_time_and_hardly_slides() -> None:
    body = human23()
    frames, low = 30, 0.971
    at_rest = np.tile(rot.IDENTITY, (frames, 23, 1))
    level = np.linspace(0.0, 1.0, frames)[:, None] * [1.0, 0.0, 0.0] + [0.0, low, 0.0]
    for slides, stays in ((0.0, True), (0.045, True), (0.055, False), (1.0, False)):
        root = np.array([0.0, low, 0.0]) + slides * (level - [0.0, low, 0.0])
        assert feet_that_stay(body, at_rest, root).tolist() == [stays, stays], slides
    up = np.tile([0.0, low, 0.0], (frames, 1))
    up[10, 1] += 0.06  # a hop, down in the same place
    assert feet_that_stay(body, at_rest, up).tolist() == [False, False]
    assert feet_that_stay(body, at_rest, up + np.array([0.0, 0.3, 0.0]), 0.3).tolist() == [False, False]
    assert feet_that_stay(body, at_rest, level * [0.0, 1.0, 0.0] + [0.0, 0.3, 0.0], 0.3).tolist() == [True, True]
    kick = at_rest.copy()
    kick[:, body.index("right_hip")] = rot.from_axis_angle(np.array([1.0, 0.0, 0.0]), -np.linspace(0.0, 1.0, frames))
    assert feet_that_stay(body, kick, np.tile([0.0, low, 0.0], (frames, 1))).tolist() == [True, False]
