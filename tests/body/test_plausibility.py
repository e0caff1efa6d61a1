"""What a viewer would see: parabolas by hand, bodies that float, bounce and lean, legs that pass through each other."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import insect

from motionmind._typing import Floats
from motionmind.body.capsules import penetration
from motionmind.body.contact import lowest_height
from motionmind.body.human import human23
from motionmind.body.plausibility import CALM_MPS2, GRAVITY_MPS2, SEEN, floor_of, greatest, implausibility
from motionmind.body.support import find_support
from motionmind.geometry import rotations as rot

FPS = 30.0
BODY = human23()
TIMES = np.arange(30) / FPS


def standing(**turns: list[float]) -> tuple[Floats, Floats]:
    """A body at rest for a second, joints turned by rotation vectors (radians), its lowest point on the floor."""
    rotations = np.tile(rot.IDENTITY, (len(TIMES), len(BODY), 1))
    for joint, turn in turns.items():
        rotations[:, BODY.index(joint)] = rot.exp(np.array(turn))
    return rotations, np.tile([0.0, -lowest_height(BODY, rotations[0], np.zeros(3)), 0.0], (len(TIMES), 1))


def raised(root: Floats, heights: Floats) -> Floats:
    return root + np.asarray(heights)[:, None] * [0.0, 1.0, 0.0]


def seen(rotations: Floats, root: Floats) -> dict[str, float]:
    values = greatest(implausibility(BODY, rotations, root, FPS))
    return dict(zip(SEEN, values.tolist(), strict=True))


def test_a_body_at_rest_shows_nothing() -> None:
    found = seen(*standing())
    assert found["bounce"] < 1e-9
    assert found["crossed_limbs"] == 0.0
    assert np.isnan(found["flight"])
    assert np.isnan(found["balance"])  # it stands on two feet


@pytest.mark.parametrize("gravity", [1.0, 0.9, 0.5, 0.0, 1.5])
def test_a_flight_lacks_what_it_lacks_of_gravity(gravity: float) -> None:
    rotations, root = standing()
    heights = 3.0 * TIMES - 0.5 * gravity * GRAVITY_MPS2 * TIMES**2
    found = seen(rotations, raised(root, np.maximum(heights, 0.0)))
    assert found["flight"] == pytest.approx(1.0 - gravity, abs=0.01)


def test_a_flight_is_told_through_the_noise_of_single_frames() -> None:
    rotations, root = standing()
    noise = np.random.default_rng(0).normal(size=30) * 0.003
    heights = 4.9 * TIMES - 0.5 * GRAVITY_MPS2 * TIMES**2 + noise
    frames = implausibility(BODY, rotations, raised(root, heights), FPS)
    assert abs(greatest(frames)[2]) < 0.2
    assert greatest(frames)[1] > 1.5 * GRAVITY_MPS2


def test_bounce_is_the_acceleration_of_the_mass() -> None:
    rotations, root = standing()
    found = seen(rotations, raised(root, 0.02 * np.sin(2.0 * np.pi * 2.0 * TIMES)))
    assert found["bounce"] == pytest.approx(0.02 * (4.0 * np.pi) ** 2, rel=0.03)


def test_a_body_on_one_leg_leans_as_far_as_its_mass_hangs_over() -> None:
    rotations, root = standing(left_hip=[-1.0, 0.0, 0.0], left_knee=[1.0, 0.0, 0.0])
    support = find_support(BODY, rotations, root, FPS)
    assert support.overhang is not None
    assert support.overhang[0] > 0.03  # the mass is between the hips, the foot under one of them
    assert seen(rotations, root)["balance"] == support.overhang[0]


def test_a_body_that_is_accelerated_need_not_be_in_balance() -> None:
    rotations, root = standing(left_hip=[-1.0, 0.0, 0.0], left_knee=[1.0, 0.0, 0.0])
    level = np.array([1.0, 0.0, 0.0])
    for share, calm in ((0.8, True), (1.2, False)):
        swing = 0.5 * share * CALM_MPS2 * (TIMES - 0.5) ** 2
        frames = implausibility(BODY, rotations, root + swing[:, None] * level, FPS)
        standing_still = np.abs(TIMES - 0.5) < 0.05  # elsewhere it is carried along, and stands on nothing
        assert np.isfinite(frames[standing_still, 0]).all() == calm


def test_crossed_legs_are_as_deep_as_their_capsules() -> None:
    rotations, root = standing(left_hip=[0.0, 0.0, -0.3], right_hip=[0.0, 0.0, 0.3])
    depths = penetration(BODY, rotations[:1])
    assert seen(rotations, root)["crossed_limbs"] == max(float(depth[0]) for depth in depths.values()) > 0.02


def test_an_insect_shows_none_of_it() -> None:
    body = insect()
    rotations = np.tile(rot.IDENTITY, (9, len(body), 1))
    assert np.isnan(implausibility(body, rotations, np.zeros((9, 3)), FPS)).all()


def test_the_floor_is_no_higher_than_the_ground() -> None:
    rotations, root = standing()
    assert floor_of(BODY, rotations, raised(root, np.full(30, 0.3))) == 0.0
    assert floor_of(BODY, rotations, raised(root, np.full(30, -0.3))) == pytest.approx(-0.3)
