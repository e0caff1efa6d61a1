"""Bodies and movements seen in a mirror, and files whose joints have sides."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bodies import CONVENTIONS, insect, renamed, tumble
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.mirror import find_sides, mirrored, other_side
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, SkeletonError
from motionmind.formats import read_motion
from motionmind.geometry import rotations as rot


def turned(skeleton: Skeleton, turn: Floats) -> Skeleton:
    """The same body with other axes: a rest pose that is turned in the world."""
    offsets, tips = (rot.mul_vec(turn, places) for places in (skeleton.offsets, skeleton.tips))
    return replace(skeleton, name=f"{skeleton.name}, turned", offsets=offsets, tips=tips)


_S = math.sqrt(0.5)
ACROSS, UPRIGHT = np.array([0.0, _S, 0.0, _S]), np.array([0.0, 0.0, _S, _S])  # x becomes -z; x becomes y
BODIES = {
    "human23": human23(),
    "insect": insect(),
    **{name: renamed(name) for name in CONVENTIONS},
    "facing along x": turned(human23(), ACROSS),
    "lying": turned(human23(), UPRIGHT),
    "standing in z": turned(human23(), np.array([_S, 0.0, 0.0, _S])),
}
LATERAL = {"facing along x": 2, "lying": 1}


@pytest.mark.parametrize("body", BODIES)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15)
def test_a_mirrored_body_stands_where_its_image_is_seen(body: str, seed: int) -> None:
    skeleton = BODIES[body]
    motion = tumble(skeleton, seed)
    sides, image = find_sides(skeleton), mirrored(motion)
    assert sides.axis == LATERAL.get(body, 0)
    reflection = np.ones(3)
    reflection[2 if body == "facing along x" else 0] = -1.0  # level, whatever the body's own axes are
    seen = skeleton.positions_and_tips(motion.rotations, motion.root) * reflection
    partners = np.concatenate([sides.partners, sides.partners + len(skeleton)])
    # On the mirrored body, and, as these are symmetric, on the body itself.
    for on in (image.skeleton, skeleton):
        np.testing.assert_allclose(on.positions_and_tips(image.rotations, image.root)[:, partners], seen, atol=1e-12)
    np.testing.assert_array_equal(image.times, motion.times)


@pytest.mark.parametrize("body", BODIES)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=5)
def test_mirrored_twice_is_the_movement_itself(body: str, seed: int) -> None:
    motion = tumble(BODIES[body], seed)
    again = mirrored(mirrored(motion))
    assert again.skeleton == motion.skeleton
    np.testing.assert_array_equal(again.rotations, motion.rotations)
    np.testing.assert_array_equal(again.root, motion.root)


def test_on_human23_left_and_right_are_exchanged_and_two_coefficients_change_their_sign() -> None:
    motion = tumble(human23(), 5)
    image, names = mirrored(motion), human23().names
    for joint, name in enumerate(names):
        other = {"left": f"right{name[4:]}", "right": f"left{name[5:]}"}.get(name.split("_")[0], name)
        q = motion.rotations[:, names.index(other)]
        np.testing.assert_array_equal(image.rotations[:, joint], q * [1.0, -1.0, -1.0, 1.0])
    np.testing.assert_array_equal(image.root, motion.root * [-1.0, 1.0, 1.0])


def test_a_performer_whose_sides_differ_a_little_is_mirrored_onto_a_mirrored_body() -> None:
    body = human23()
    offsets = body.offsets.copy()
    offsets[body.index("left_knee")] += (0.004, -0.012, 0.003)
    motion = tumble(replace(body, offsets=offsets), 1)
    image, partners = mirrored(motion), find_sides(body).partners
    seen = motion.skeleton.positions(motion.rotations, motion.root) * [-1.0, 1.0, 1.0]
    np.testing.assert_allclose(image.skeleton.positions(image.rotations, image.root)[:, partners], seen, atol=1e-12)
    assert image.skeleton != motion.skeleton


def body_of(rows: Mapping[str, tuple[str, tuple[float, float, float]]]) -> Skeleton:
    names = tuple(rows)
    parents = tuple(names.index(parent) if parent else -1 for parent, _ in rows.values())
    return Skeleton("beast", names, parents, np.array([offset for _, offset in rows.values()]))


TRUNK = {"root": ("", (0.0, 0.0, 0.0)), "head": ("root", (0.0, 0.5, 0.0))}
HANDS = {"left_hand": ("root", (0.6, 0.0, 0.0)), "right_hand": ("root", (-0.6, 0.0, 0.0))}


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ({"left_hand": HANDS["left_hand"]}, "left_hand has no partner: .* nothing of that name hangs from root"),
        ({**HANDS, "sword": ("left_hand", (0.0, 0.5, 0.0))}, "sword has no partner: .* hangs from right_hand"),
        (
            {**HANDS, "left_thumb": ("left_hand", (0.1, 0.0, 0.0)), "right_thumb": ("head", (-0.1, 0.0, 0.0))},
            "left_thumb has no partner: on the other side right_thumb does not hang from right_hand",
        ),
        ({**HANDS, "pack": ("root", (0.2, 0.0, 0.0))}, r"pack has no partner: it stands 0\.2 m off the middle"),
        (
            {**HANDS, "right_hand": ("root", (-0.5, 0.2, 0.0))},
            r"(left|right)_hand and (left|right)_hand are no mirror images of each other at rest: they stand at \(",
        ),
        ({"elbow": ("root", (0.3, 0.0, 0.0))}, r"elbow has no partner: it stands 0\.3 m off the middle"),
        (
            {**HANDS, **dict.fromkeys(("left_r_eye", "right_r_eye", "left_l_eye"), ("head", (0.0, 0.1, 0.0)))},
            "left_r_eye has no partner: both right_r_eye and left_l_eye could be it",
        ),
    ],
)  # fmt: skip
def test_a_body_without_two_sides_is_refused_and_the_joint_named(
    rows: dict[str, tuple[str, tuple[float, float, float]]], words: str
) -> None:
    with pytest.raises(SkeletonError, match=f"^beast cannot be mirrored: {words}"):
        mirrored(tumble(body_of(TRUNK | rows), 0))


@pytest.mark.parametrize("axis", [0, 2])
def test_sides_so_near_each_other_that_several_axes_fit_lie_along_the_one_that_parts_them(axis: int) -> None:
    near = {
        f"{side}_hand": ("root", tuple(sign * 0.01 * np.eye(3)[axis])) for side, sign in (("left", 1), ("right", -1))
    }
    assert find_sides(body_of(TRUNK | near)).axis == axis


def test_what_has_no_sides_and_no_breadth_is_its_own_image() -> None:
    snake = body_of({"head": ("", (0.0, 0.0, 0.0)), "neck": ("head", (0.0, 0.0, -1.0)), "tail": ("neck", (0.0, 0, -1))})
    assert find_sides(snake).partners.tolist() == [0, 1, 2]
    np.testing.assert_array_equal(mirrored(tumble(snake, 0)).rotations, rot.mirror(tumble(snake, 0).rotations))


def test_names_of_the_other_side() -> None:
    for left, right in CONVENTIONS.values():
        assert right("knee") in other_side(left("knee"))
        assert left("knee") in other_side(right("knee"))
    assert other_side("pelvis") == set()
    # A name may hold letters that look like sides; such a partner has to be there to count.
    assert {joint for joint in human23().names if other_side(joint) & set(human23().names)} == {
        joint for joint in human23().names if joint.startswith(("left_", "right_"))
    }


def test_any_file_is_mirrored_or_refused_by_name(shared_data: Path) -> None:
    mirrors, refused = 0, []
    for path in sorted((shared_data / "importer").glob("*.bvh")):
        try:
            with warnings.catch_warnings(action="ignore"):
                motion = read_motion(path).slice(0, 5)
        except FormatError:
            continue
        try:
            image, partners = mirrored(motion), find_sides(motion.skeleton).partners
        except SkeletonError as error:
            refused.append(str(error))
            continue
        seen = motion.skeleton.positions(motion.rotations, motion.root) * [-1.0, 1.0, 1.0]
        np.testing.assert_allclose(image.skeleton.positions(image.rotations, image.root)[:, partners], seen, atol=1e-9)
        mirrors += 1
    assert mirrors >= 8
    assert all("no partner" in words or "no mirror images" in words for words in refused)
