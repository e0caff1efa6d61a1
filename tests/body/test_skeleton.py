"""Skeletons: forward kinematics against 4 x 4 matrices, differences in words, what is refused, and human23."""

from __future__ import annotations

import pickle
from time import process_time
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.legs import find_legs
from motionmind.body.skeleton import Skeleton, remembered
from motionmind.errors import SkeletonError
from motionmind.geometry import rotations as rot

BODY = human23()


def some_tree(seed: int, joints: int = 12) -> Skeleton:
    rng = np.random.default_rng(seed)
    parents = (-1, *(int(rng.integers(0, child)) for child in range(1, joints)))
    offsets = rng.normal(size=(joints, 3))
    offsets[0] = 0.0
    return Skeleton("tree", tuple(f"j{i}" for i in range(joints)), parents, offsets, rng.normal(size=(joints, 3)))


def by_matrices(skeleton: Skeleton, rotations: Floats, root: Floats) -> tuple[Floats, Floats, Floats]:
    """Positions, tips and global rotations [J, 3, 3] of one posture, by products of 4 x 4 matrices."""
    world: list[Floats] = []
    for joint, parent in enumerate(skeleton.parents):
        local = np.eye(4)
        local[:3, :3] = Rotation.from_quat(rotations[joint]).as_matrix()
        local[:3, 3] = root if parent < 0 else skeleton.offsets[joint]
        world.append(local if parent < 0 else world[parent] @ local)
    tips = [frame @ [*tip, 1.0] for frame, tip in zip(world, skeleton.tips, strict=True)]
    return np.array(world)[:, :3, 3], np.array(tips)[:, :3], np.array(world)[:, :3, :3]


@pytest.mark.parametrize("skeleton", [BODY, some_tree(0), some_tree(1)], ids=["human23", "tree", "another tree"])
def test_forward_kinematics_is_a_product_of_matrices(skeleton: Skeleton) -> None:
    rng = np.random.default_rng(5)
    rotations = rot.normalise(rng.normal(size=(2, 3, len(skeleton), 4)))
    root = rng.normal(size=(2, 3, 3))
    positions = skeleton.positions(rotations, root)
    both = skeleton.positions_and_tips(rotations, root)
    turned = rot.to_matrix(skeleton.global_rotations(rotations))
    points = rng.normal(size=(3, 3))
    for place in np.ndindex(2, 3):
        joints, tips, frames = by_matrices(skeleton, rotations[place], root[place])
        np.testing.assert_allclose(positions[place], joints, atol=1e-13)
        np.testing.assert_allclose(both[place], np.concatenate([joints, tips]), atol=1e-13)
        np.testing.assert_allclose(turned[place], frames, atol=1e-13)
        fixed = skeleton.positions_with(rotations[place], root[place], [5, 2, 5], points)[len(skeleton) :]
        np.testing.assert_allclose(
            fixed, joints[[5, 2, 5]] + (frames[[5, 2, 5]] @ points[..., None])[..., 0], atol=1e-13
        )


def test_joints_may_be_given_in_lists_and_arrays() -> None:
    fields: list[Any] = [list(BODY.names), np.array(BODY.parents), BODY.offsets, BODY.tips]
    same = Skeleton("human23", *fields)
    assert same == BODY
    assert (same.names, same.parents) == (BODY.names, BODY.parents)
    assert find_legs(same) == find_legs(BODY)


@pytest.mark.parametrize("skeleton", [BODY, some_tree(3)], ids=["human23", "tree"])
def test_a_body_without_rotations_is_at_rest(skeleton: Skeleton) -> None:
    still = np.tile(rot.IDENTITY, (len(skeleton), 1))
    np.testing.assert_array_equal(skeleton.rest, skeleton.positions_and_tips(still, np.zeros(3)))


@pytest.mark.parametrize("skeleton", [BODY, some_tree(2)], ids=["human23", "tree"])
def test_local_and_global_rotations_are_inverse(skeleton: Skeleton) -> None:
    q = rot.normalise(np.random.default_rng(6).normal(size=(40, len(skeleton), 4)))
    assert rot.angle(skeleton.local_rotations(skeleton.global_rotations(q)), q).max() < 1e-14
    assert rot.angle(skeleton.global_rotations(skeleton.local_rotations(q)), q).max() < 1e-14


def test_bones_keep_their_lengths_whatever_the_posture() -> None:
    q = rot.normalise(np.random.default_rng(7).normal(size=(40, 23, 4)))
    positions = BODY.positions(q, np.zeros((40, 3)))
    bones = positions[:, 1:] - positions[:, list(BODY.parents[1:])]
    expected = np.linalg.norm(BODY.offsets[1:], axis=1)
    np.testing.assert_allclose(np.linalg.norm(bones, axis=-1), np.tile(expected, (40, 1)), atol=1e-14)


# --- human23 ----------------------------------------------------------------------------------------------------------


def test_human23_is_the_tree_that_the_papers_draw() -> None:
    hangs = {name: BODY.names[parent] if parent >= 0 else None for name, parent in zip(BODY.names, BODY.parents)}  # noqa: B905
    expected: dict[str, str | None] = {"pelvis": None, "lumbar": "pelvis", "thorax": "lumbar"}
    expected |= {"cervical": "thorax", "atlantal": "cervical"}
    for s in ("left", "right"):
        expected |= {f"{s}_hip": "pelvis", f"{s}_knee": f"{s}_hip", f"{s}_ankle": f"{s}_knee"}
        expected |= {f"{s}_toes": f"{s}_ankle", f"{s}_clavicle": "thorax", f"{s}_shoulder": f"{s}_clavicle"}
        expected |= {f"{s}_elbow": f"{s}_shoulder", f"{s}_wrist": f"{s}_elbow", f"{s}_fingers": f"{s}_wrist"}
    assert hangs == expected
    assert len(BODY) == 23


def test_human23_is_symmetric_and_stands_170_centimetres_tall_facing_ahead() -> None:
    for joint, name in enumerate(BODY.names):
        side, _, rest = name.partition("_")
        other = BODY.index(f"right_{rest}") if side == "left" else joint
        flip = np.array([-1.0, 1.0, 1.0])
        if side != "right":
            np.testing.assert_array_equal(BODY.offsets[other], flip * BODY.offsets[joint])
            np.testing.assert_array_equal(BODY.tips[other], flip * BODY.tips[joint])
    assert BODY.height == pytest.approx(1.70, abs=0.05)
    rest = BODY.positions(np.tile(rot.IDENTITY, (23, 1)), np.zeros(3))
    assert rest[BODY.index("left_fingers"), 0] > 0.8  # +x is to the left
    assert rest[BODY.index("left_toes"), 2] > rest[BODY.index("left_ankle"), 2]  # +z is ahead


def test_only_leaves_have_tips() -> None:
    leaves = [not BODY.children(joint) for joint in range(len(BODY))]
    np.testing.assert_array_equal(np.any(BODY.tips != 0.0, axis=1), leaves)


# --- differences ------------------------------------------------------------------------------------------------------


def renamed(skeleton: Skeleton, **changes: object) -> Skeleton:
    parts = {"name": "other", "names": skeleton.names, "parents": skeleton.parents, "offsets": skeleton.offsets}
    return Skeleton(**(parts | changes))  # type: ignore[arg-type]


CHAIN = Skeleton("chain", ("a", "b", "c"), (-1, 0, 1), np.ones((3, 3)))


def test_a_skeleton_does_not_differ_from_itself_nor_from_a_taller_one() -> None:
    taller = renamed(CHAIN, offsets=2.0 * CHAIN.offsets)
    assert CHAIN.difference(taller) is None
    assert renamed(CHAIN) == CHAIN
    assert taller != CHAIN
    assert CHAIN != "chain"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"names": ("a", "b", "x")}, "other lacks c and adds x"),
        ({"names": ("a", "b"), "parents": (-1, 0), "offsets": np.ones((2, 3))}, "other lacks c"),
        ({"names": tuple("abcd"), "parents": (-1, 0, 1, 2), "offsets": np.ones((4, 3))}, "other adds d"),
        ({"parents": (-1, 0, 0)}, "c hangs from a in other, from b in chain"),
        ({"names": ("b", "a", "c"), "parents": (-1, 0, 0)}, "a hangs from b in other, from nothing in chain"),
    ],
)
def test_differences_are_named(changes: dict[str, object], words: str) -> None:
    assert CHAIN.difference(renamed(CHAIN, **changes)) == words


def test_another_order_of_the_same_joints_is_named() -> None:
    star = Skeleton("star", ("a", "b", "c"), (-1, 0, 0), np.ones((3, 3)))
    assert star.difference(renamed(star, names=("a", "c", "b"))) == "other lists the same joints in another order"


def test_of_many_joints_the_first_few_are_named() -> None:
    words = BODY.difference(CHAIN)
    assert words is not None
    assert words.startswith(
        "chain lacks pelvis, left_hip, left_knee, left_ankle, left_toes and 18 more and adds a, b, c"
    )


# --- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"names": (), "parents": (), "offsets": np.zeros((0, 3))}, "has no joints"),
        ({"parents": (-1, 0)}, r"3 joints need as many .* not 2, \[3, 3\]"),
        ({"offsets": np.zeros((2, 3))}, r"not 3, \[2, 3\]"),
        ({"offsets": np.zeros((3, 2))}, r"not 3, \[3, 2\]"),
        ({"tips": np.zeros((3, 2))}, r"\[3, 2\]"),
        ({"names": ("a", "b", "b")}, "names b more than once"),
        ({"parents": (0, 0, 1)}, "first joint must be the root"),
        ({"parents": (-1, -1, 1)}, "the parent of 'b' must stand before it"),
        ({"parents": (-1, 2, 1)}, "the parent of 'b' must stand before it"),
        ({"parents": (-1, 1, 1)}, "the parent of 'b' must stand before it"),
        ({"offsets": np.full((3, 3), np.nan)}, "not a finite number"),
        ({"tips": np.full((3, 3), np.inf)}, "not a finite number"),
    ],
)
def test_what_is_no_tree_of_joints_is_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(SkeletonError, match=words):
        renamed(CHAIN, **changes)


def test_an_unknown_joint_is_answered_with_those_there_are() -> None:
    assert CHAIN.index("b") == 1
    with pytest.raises(SkeletonError, match="no joint 'x' in chain; its joints are a, b, c"):
        CHAIN.index("x")


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("left_hand", "left_wrist or left_fingers"),
        ("right_foot", "right_ankle or right_toes"),
        ("arm", "left_shoulder or right_shoulder or left_elbow or right_elbow"),
        ("head", "atlantal"),
        ("left_head", "left_hip"),
        ("left_elbwo", "left_elbow"),
    ],
)
def test_an_everyday_word_is_answered_with_the_joints_there(word: str, meant: str) -> None:
    with pytest.raises(SkeletonError, match=rf"did you mean {meant}\?$"):
        BODY.index(word)


def test_arrays_are_copied_and_frozen() -> None:
    offsets = np.ones((3, 3))
    skeleton = renamed(CHAIN, offsets=offsets)
    offsets[:] = 5.0
    np.testing.assert_array_equal(skeleton.offsets, 1.0)
    with pytest.raises(ValueError, match="read-only"):
        skeleton.offsets[0] = 2.0


def test_thousands_of_joints_are_checked_and_compared_in_no_time() -> None:
    count = 20_000
    parts = tuple(f"j{i}" for i in range(count)), (-1, *range(count - 1)), np.zeros((count, 3))
    began = process_time()
    skeleton = Skeleton("centipede", *parts)
    assert skeleton.difference(Skeleton("another", *parts)) is None
    assert process_time() - began < 2.0  # quadratic work takes minutes


def test_what_is_found_of_a_skeleton_is_found_once_for_each_and_does_not_travel_with_it() -> None:
    asked = []

    @remembered
    def count(skeleton: Skeleton) -> int:
        """Count the joints."""
        asked.append(skeleton.name)
        return len(skeleton)

    one, other = some_tree(0), some_tree(1, joints=5)
    assert [count(one), count(other), count(one), count(other)] == [12, 5, 12, 5]
    assert asked == ["tree", "tree"]
    assert count.__doc__ == "Count the joints."
    again = pickle.loads(pickle.dumps(one))
    assert again == one
    assert count(again) == 12
    assert len(asked) == 3
