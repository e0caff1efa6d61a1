"""The support of bodies: geometry by hand, laws that hold for any body, and the same answers as slower definitions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bodies import insect
from scipy.spatial import ConvexHull

from motionmind._typing import Floats
from motionmind.body.contact import lowest_height
from motionmind.body.human import human23
from motionmind.body.limbs import limbs_of
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import (
    AIRBORNE_M,
    centre_of_mass,
    find_support,
    overhang,
    size_of,
    standing_rise,
    stands_alone,
)
from motionmind.geometry import rotations as rot

FPS = 30.0
BODY = human23()
LEFT, RIGHT = (
    next(number for number, limb in enumerate(limbs_of(BODY)) if BODY.index(f"{side}_toes") in limb)
    for side in ("left", "right")
)


def standing(frames: int = 30, **turns: list[float]) -> tuple[Floats, Floats]:
    """A body at rest, joints turned by rotation vectors (radians), its lowest point on the floor."""
    rotations = np.tile(rot.IDENTITY, (frames, len(BODY), 1))
    for joint, turn in turns.items():
        rotations[:, BODY.index(joint)] = rot.exp(np.array(turn))
    return rotations, np.tile([0.0, -lowest_height(BODY, rotations[0], np.zeros(3)), 0.0], (frames, 1))


def test_both_feet_bear_a_body_at_rest_and_its_mass_is_over_them() -> None:
    support = find_support(BODY, *standing(), FPS)
    assert support.bears[:, [LEFT, RIGHT]].all()
    assert support.bears.sum() == 60
    assert not support.airborne.any()
    assert support.overhang is not None
    assert (support.overhang < 0.02).all()


def test_a_lifted_leg_bears_nothing() -> None:
    rotations, root = standing(left_hip=[-1.0, 0.0, 0.0], left_knee=[1.0, 0.0, 0.0])
    support = find_support(BODY, rotations, root, FPS)
    assert support.bears[:, RIGHT].all()
    assert support.bears.sum() == 30
    assert (stands_alone(BODY, rotations, root) == RIGHT).all()
    assert (stands_alone(BODY, *standing()) == -1).all()


def test_a_leaning_body_hangs_over_as_far_as_geometry_says() -> None:
    """Turned about its toes as one piece, a body's mass goes forward by its height times the sine of the angle."""
    rotations, root = standing(1)
    mass = centre_of_mass(BODY, rotations, root)
    assert mass is not None
    toes = BODY.positions_and_tips(rotations, root)[0, len(BODY) + BODY.index("left_toes")]
    for angle in (0.3, 0.5):
        turn = rot.exp(np.array([angle, 0.0, 0.0]))
        leaning = rotations.copy()
        leaning[:, 0] = rot.mul(turn, leaning[:, 0])
        about = toes * [0.0, 1.0, 1.0]
        support = find_support(BODY, leaning, rot.mul_vec(turn, root - about) + about, FPS)
        assert support.overhang is not None
        arm = mass[0] - about
        expected = arm[2] * np.cos(angle) + arm[1] * np.sin(angle)
        np.testing.assert_allclose(support.overhang[0], expected, atol=0.005)


def test_overhang_is_the_distance_to_the_hull() -> None:
    rng = np.random.default_rng(0)
    points, mass = rng.normal(size=(300, 8, 2)), rng.normal(size=(300, 2))
    found = overhang(points, np.ones((300, 8), dtype=bool), mass)
    for square, centre, distance in zip(points, mass, found, strict=True):
        hull = ConvexHull(square)
        outside = (hull.equations[:, :2] @ centre + hull.equations[:, 2]).max()
        assert (distance == 0.0) == (outside <= 0.0)
        assert distance >= outside - 1e-12  # the nearest side's line is no farther than the side
        ring = square[hull.vertices]
        sides = np.linspace(ring, np.roll(ring, -1, axis=0), 2001)
        nearest = np.linalg.norm(sides - centre, axis=-1).min()
        assert distance == 0.0 or abs(distance - nearest) < 1e-3


def test_one_support_is_a_point_and_none_is_no_number() -> None:
    points, mass = np.array([[[3.0, 4.0], [9.0, 9.0]]]), np.zeros((1, 2))
    assert overhang(points, np.array([[True, False]]), mass)[0] == 5.0
    assert np.isnan(overhang(points, np.array([[False, False]]), mass)[0])


def test_a_body_that_is_carried_along_stands_on_nothing() -> None:
    rotations, root = standing()
    slow, fast = (root + np.arange(30)[:, None] * [speed / FPS, 0.0, 0.0] for speed in (0.2, 0.5))
    assert find_support(BODY, rotations, slow, FPS).bears[:, [LEFT, RIGHT]].all()
    support = find_support(BODY, rotations, fast, FPS)
    assert not support.bears.any()
    assert not support.airborne.any()
    assert support.overhang is not None
    assert np.isnan(support.overhang).all()


def test_in_the_air_nothing_bears() -> None:
    rotations, root = standing()
    above = root + np.array([0.0, 2.0 * AIRBORNE_M, 0.0])
    support = find_support(BODY, rotations, above, FPS)
    assert support.airborne.all()
    assert not support.bears.any()
    raised = find_support(BODY, rotations, above, FPS, np.full(30, 2.0 * AIRBORNE_M))
    assert not raised.airborne.any()
    assert raised.bears[:, [LEFT, RIGHT]].all()


def test_a_single_point_is_as_large_as_any_body() -> None:
    """It has no size to measure lengths by, and may be moved all the same."""
    assert size_of(Skeleton("point", ("root",), (-1,), np.zeros((1, 3)))) == 1.0


@pytest.mark.parametrize("size", [0.5, 1.3])
def test_what_bears_does_not_depend_on_size(size: float) -> None:
    rng = np.random.default_rng(1)
    pose = rng.normal(size=(len(BODY), 4)) * 0.1 + rot.IDENTITY
    rotations = rot.normalise(pose + rng.normal(size=(60, len(BODY), 4)) * 0.001)
    root = np.cumsum(rng.normal(size=(60, 3)) * 0.003, axis=0) + np.linspace(0.85, 1.1, 60)[:, None]
    other = replace(BODY, offsets=BODY.offsets * size, tips=BODY.tips * size)
    assert size_of(other) == pytest.approx(size)
    mine, theirs = find_support(BODY, rotations, root, FPS), find_support(other, rotations, root * size, FPS)
    assert 0.1 < mine.bears.any(axis=1).mean() < 0.9
    assert 0.1 < mine.airborne.mean() < 0.9
    np.testing.assert_array_equal(mine.bears, theirs.bears)
    np.testing.assert_array_equal(mine.airborne, theirs.airborne)
    assert mine.overhang is not None
    assert theirs.overhang is not None
    np.testing.assert_allclose(mine.overhang * size, theirs.overhang, atol=1e-9)


def test_a_standing_foot_that_rises_is_seen() -> None:
    rotations, root = standing(left_hip=[-1.0, 0.0, 0.0], left_knee=[1.0, 0.0, 0.0])
    assert abs(standing_rise(BODY, rotations, root)) < 1e-12
    bump = 0.04 * np.sin(np.linspace(0.0, np.pi, 30))[:, None] * [0.0, 1.0, 0.0]
    assert standing_rise(BODY, rotations, root + bump) == pytest.approx(0.04, abs=1e-3)
    away = np.linspace(0.0, 0.5, 30)[:, None] * [1.0, 0.0, 0.0]
    assert np.isnan(standing_rise(BODY, rotations, root + bump + away))  # it makes a step
    assert np.isnan(standing_rise(BODY, *standing()))  # on two feet


def test_bodies_without_masses_stand_but_have_no_overhang() -> None:
    body: Skeleton = insect()
    rotations = np.tile(rot.IDENTITY, (4, len(body), 1))
    low = body.positions_and_tips(rotations[0], np.zeros(3))[:, 1].min()
    support = find_support(body, rotations, np.tile([0.0, -low, 0.0], (4, 1)), FPS)
    assert support.mass is None
    assert support.overhang is None
    assert support.bears.any(axis=1).all()
    assert not support.airborne.any()
