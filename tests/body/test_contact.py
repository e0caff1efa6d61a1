"""Heights and the floor: one set of points with heels, one without, and one rule for the floor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.contact import find_floor, floor_height, limb_heights, lowest_height, lowest_point
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
