"""Weight that is shifted over what bears it, while feet stay where they are."""

from __future__ import annotations

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.contact import pose
from motionmind.body.human import human23
from motionmind.body.limbs import limbs_of
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import find_support
from motionmind.footing.balance import ROOM, WALKS, balance_rows, falls_without, is_beyond, walks
from motionmind.footing.feet import bend_legs, find_free_feet
from motionmind.footing.leaning import STILL, shift_weight
from motionmind.footing.least_squares import Rows
from motionmind.footing.legs import SOFT
from motionmind.footing.root import stand
from motionmind.geometry import rotations as rot

FRAMES = 60
FREE = np.zeros(23, dtype=np.bool_)
ENDS = np.arange(FRAMES) % (FRAMES - 1) == 0
ALLOWED = 0.05  # metres beyond the support


def leg_lifted_aside(degrees: float) -> tuple[Floats, Floats]:
    """A person on bent knees whose left leg goes aside and back, the hips over the middle of the feet; and the root."""
    skeleton, s = human23(), np.sin(np.linspace(0.0, np.pi, FRAMES)) ** 2
    q = np.tile(rot.IDENTITY, (FRAMES, 23, 1))
    for side in ("left", "right"):
        for joint, bend in (("hip", -0.3), ("knee", 0.6), ("ankle", -0.3)):
            q[:, skeleton.index(f"{side}_{joint}")] = rot.from_axis_angle([1.0, 0.0, 0.0], bend)
    hip = skeleton.index("left_hip")
    q[:, hip] = rot.mul(rot.from_axis_angle([0.0, 0.0, 1.0], np.radians(degrees) * s), q[:, hip])
    return q, stand(skeleton, q, np.zeros((FRAMES, 3)), np.zeros(FRAMES))


def shifted(q: Floats, root: Floats, skeleton: Skeleton | None = None) -> tuple[Floats, Floats]:
    return shift_weight(skeleton or human23(), q, root, ALLOWED, ENDS, FREE, FREE, 30.0)


@pytest.mark.parametrize("degrees", [25.0, 40.0])
def test_weight_comes_over_the_standing_foot_which_stays(degrees: float) -> None:
    skeleton, (q, root) = human23(), leg_lifted_aside(degrees)
    before = find_support(skeleton, q, root, 30.0).overhang
    found, went = shifted(q, root)
    after = find_support(skeleton, found, went, 30.0).overhang
    assert before is not None
    assert after is not None
    middle = slice(FRAMES // 3, 2 * FRAMES // 3)
    assert before[middle].min() > ALLOWED + 0.02
    assert after[middle].max() < ALLOWED + 0.01
    foot = next(limb for limb in limbs_of(skeleton) if skeleton.index("right_hip") in limb)[2:]
    moved = skeleton.positions(found, went)[:, foot] - skeleton.positions(q, root)[:, foot]
    assert np.linalg.norm(moved, axis=-1).max() < 0.005
    np.testing.assert_array_equal(found[ENDS], q[ENDS])
    np.testing.assert_array_equal(went[ENDS], root[ENDS])


@pytest.mark.parametrize("cycles", [1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("sways", [0.03, 0.05, 0.08])
def test_nothing_leans_at_rest_though_the_shift_itself_changes_where_it_rests(sways: float, cycles: float) -> None:
    skeleton, (q, root) = human23(), leg_lifted_aside(30.0)
    seconds = np.arange(FRAMES) / 30.0
    sway = sways * np.sin(np.pi * seconds / seconds[-1]) ** 2 * np.sin(2.0 * np.pi * cycles * seconds)
    feet, off = find_free_feet(skeleton, FREE), np.zeros((FRAMES, 2, 3))
    off[..., 0] = -sway[:, None]
    bent = bend_legs(skeleton, pose(skeleton, q), feet, off, np.full((FRAMES, 2), SOFT))
    bent[ENDS] = q[ENDS]
    root[:, 0] += sway
    assert leaning_at_rest(bent, root) > 0
    assert leaning_at_rest(*shifted(bent, root)) == 0


def leaning_at_rest(q: Floats, root: Floats) -> int:
    """In how many frames between the ends the body leans on one limb, and nothing accelerates."""
    support = find_support(human23(), q, root, 30.0)
    assert support.mass is not None
    assert support.overhang is not None
    rests = np.zeros(FRAMES, dtype=np.bool_)
    rests[1:-1] = 900.0 * np.linalg.norm(np.diff(support.mass[:, [0, 2]], 2, axis=0), axis=1) < STILL
    alone = support.bears.sum(axis=1) == 1
    return int(np.sum(rests & alone & (support.overhang > ALLOWED + 0.005)))


def test_weight_is_shifted_on_the_way_to_elsewhere_too() -> None:
    """It leans on one leg, and then leaps away: faster by far, in the mean, than who is about to stand."""
    q, root = leg_lifted_aside(40.0)
    root[FRAMES * 2 // 3 :, 2] += np.linspace(0.0, 3.0, FRAMES - FRAMES * 2 // 3)
    assert walks(root, 30.0)
    before, after = (leaning_at_rest(*each) for each in ((q, root), shifted(q, root)))
    assert before > 10
    assert after == 0


def test_a_leg_that_is_too_fast_anyhow_does_not_keep_the_weight_where_it_is() -> None:
    """Its joints may turn a tenth faster than they did, and no more."""
    skeleton, (q, root) = human23(), leg_lifted_aside(25.0)
    left = [skeleton.index(f"left_{joint}") for joint in ("hip", "knee", "ankle", "toes")]
    fastest = np.full(23, np.inf)
    fastest[skeleton.index("left_hip")] = 0.0
    found, went = shift_weight(skeleton, q, root, ALLOWED, ENDS, FREE, FREE, 30.0, fastest)
    assert np.abs(went - root).max() > 0.01
    before, after = (rot.angle(each[:-1], each[1:])[:, left[0]].max() for each in (q, found))
    assert before < after < 1.1 * before
    fastest[left] = 0.0  # a knee and an ankle that do not move at all may not begin to
    assert shift_weight(skeleton, q, root, ALLOWED, ENDS, FREE, FREE, 30.0, fastest)[0] is q


def test_it_shifts_alike_whatever_the_size() -> None:
    skeleton, (q, root) = human23(), leg_lifted_aside(30.0)
    large = Skeleton("large", skeleton.names, skeleton.parents, 2.0 * skeleton.offsets, 2.0 * skeleton.tips)
    found, went = shifted(q, root)
    same, far = shift_weight(large, q, 2.0 * root, 2.0 * ALLOWED, ENDS, FREE, FREE, 30.0 / np.sqrt(2.0))
    np.testing.assert_allclose(far, 2.0 * went, atol=0.02)
    assert np.degrees(rot.angle(same, found).max()) < 3.0


def test_a_body_in_balance_or_on_feet_that_slide_or_with_a_leg_that_must_not_change_is_let_be() -> None:
    for q, root in (
        leg_lifted_aside(0.0),
        (leg_lifted_aside(30.0)[0], leg_lifted_aside(30.0)[1] + np.linspace(0, 3.0, FRAMES)[:, None] * [0, 0, 1]),
    ):
        found, went = shifted(q, root)
        assert found is q
        assert went is root
    q, root = leg_lifted_aside(30.0)
    fixed = FREE.copy()
    fixed[human23().index("left_knee")] = True
    assert shift_weight(human23(), q, root, ALLOWED, ENDS, FREE, fixed, 30.0)[0] is q


def test_what_brings_the_weight_back_measures_how_far_its_zero_moment_point_is_beyond_the_support() -> None:
    """A mass that sways over a square, faster than it may: the floor pushes at a point that is ahead of its turns."""
    fps, gravity, height = 30.0, 9.81, np.full(FRAMES, 0.9)
    corners = np.array([[-0.1, -0.1], [-0.1, 0.1], [0.1, -0.1], [0.1, 0.1]])
    points, touches = np.tile(corners, (FRAMES, 1, 1)), np.ones((FRAMES, 4), dtype=np.bool_)
    own = np.stack([0.02 * np.cos(np.arange(FRAMES) / 5.0), np.zeros(FRAMES)], axis=1)
    rise = np.sin(np.linspace(0.0, np.pi, FRAMES)) ** 2
    centre = np.stack([0.09 * rise * np.sin(np.arange(FRAMES) / 3.0), 0.01 * rise], axis=1)
    pressed = centre[1:-1, 0] - height[1:-1] / gravity * np.diff(centre[:, 0], 2) * fps**2
    beyond = np.abs(pressed) - 0.1 - ROOM
    assert np.sum(beyond > 0.01) > 10
    assert np.abs(centre[:, 0]).max() < 0.1  # the mass itself is over the square
    rows = balance_rows(points, touches, centre, own, height, ALLOWED, gravity, fps)
    along = Rows(*(part[: FRAMES - 2] for part in rows))  # the zero-moment point's, towards the support
    root = np.insert(centre - own, 1, 0.8, axis=1)
    windows = np.stack([root[:-2], root[1:-1], root[2:]], axis=1).reshape(FRAMES - 2, 9)
    misses = np.sum(along.coefficients * windows, axis=1) - along.targets
    np.testing.assert_array_equal(along.weights > 0.0, beyond > 0.0)
    np.testing.assert_allclose(misses[beyond > 0.0], beyond[beyond > 0.0], atol=1e-12)


def test_a_body_falls_without_the_foot_that_it_is_over_and_not_without_the_other() -> None:
    points = np.tile([[0.0, 0.0], [0.0, 0.2], [0.4, 0.0], [0.4, 0.2]], (3, 1, 1))
    feet, low = np.array([[1, 1, 0, 0], [0, 0, 1, 1]], dtype=np.bool_), np.ones((3, 4), dtype=np.bool_)
    centre = np.array([[0.0, 0.1], [0.2, 0.1], [0.4, 0.1]])
    falls = falls_without(points, low, feet, centre, 0.05)
    np.testing.assert_allclose(falls, [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    assert not is_beyond(points, low, centre, 0.0).any()
    np.testing.assert_array_equal(is_beyond(points, low & feet[0], centre, 0.05), [False, True, True])


def test_it_walks_by_its_speed_and_not_by_how_far_it_goes() -> None:
    for frames in (30, 300):
        way = np.linspace(0.0, 1.0, frames)[:, None] * np.array([1.0, 5.0, 0.0]) * (frames - 1) / 30.0
        assert walks(1.05 * WALKS * way, 30.0)
        assert not walks(0.95 * WALKS * way, 30.0)
