"""Kimodo's .npz: places and orientations of joints in the world come back as they were."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from kimodo_files import movement

from motionmind import read_motion
from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.errors import FormatError, MotionMindWarning
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import joint_mapping
from motionmind.retarget.retarget import to_human23

COUNTS = (22, 30, 77)


def saved(path: Path, arrays: dict[str, Floats], dtype: str = "f8") -> Path:
    np.savez(path, **{name: array.astype(dtype) for name, array in arrays.items()})  # type: ignore[arg-type]
    return path


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("dtype", ["f4", "f8"])
def test_joints_have_their_places_and_orientations(count: int, dtype: str, tmp_path: Path) -> None:
    arrays = movement(count)
    motion = read_motion(saved(tmp_path / "a.npz", arrays, dtype))
    atol = 1e-5 if dtype == "f4" else 1e-9
    np.testing.assert_allclose(
        motion.skeleton.positions(motion.rotations, motion.root), arrays["posed_joints"], atol=atol
    )
    found = rot.to_matrix(motion.skeleton.global_rotations(motion.rotations))
    np.testing.assert_allclose(found, arrays["global_rot_mats"], atol=atol)
    np.testing.assert_allclose(motion.times, np.arange(6) / 30.0)
    assert (motion.name, len(motion.skeleton)) == ("a", count)


@pytest.mark.parametrize("count", COUNTS)
def test_on_human23_limbs_keep_their_places(count: int, tmp_path: Path) -> None:
    motion = read_motion(saved(tmp_path / "a.npz", movement(count)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # so little movement does not show the floor
        found = to_human23(motion, up="y")
    mapping = joint_mapping(motion.skeleton)
    assert mapping is not None
    assert {*human23().names} - {*mapping.values()} <= {"left_fingers", "right_fingers"}
    places = motion.skeleton.positions(motion.rotations, motion.root)
    ours = found.skeleton.positions(found.rotations, found.root)
    for name, joint in mapping.items():
        if any(part in joint for part in ("hip", "knee", "ankle", "toes", "pelvis")):
            theirs = places[:, motion.skeleton.index(name)]
            np.testing.assert_allclose(ours[:, found.skeleton.index(joint)], theirs, atol=1e-9)
    assert 1.6 < found.skeleton.height < 1.9


def test_rate_unit_vertical_and_a_batch_of_one(tmp_path: Path) -> None:
    arrays = movement(30)
    plain = read_motion(saved(tmp_path / "a.npz", arrays))
    batch = read_motion(saved(tmp_path / "a.npz", {name: array[None] for name, array in arrays.items()}))
    np.testing.assert_allclose(batch.rotations, plain.rotations)
    faster = read_motion(saved(tmp_path / "a.npz", arrays | {"fps": np.array(60.0)}))
    np.testing.assert_allclose(faster.times, np.arange(6) / 60.0)
    assert read_motion(tmp_path / "a.npz", fps=20.0).times[1] == pytest.approx(0.05)
    scaled = read_motion(
        saved(tmp_path / "a.npz", arrays | {"posed_joints": 100.0 * arrays["posed_joints"]}), unit="cm"
    )
    np.testing.assert_allclose(scaled.root, plain.root)
    np.testing.assert_allclose(scaled.skeleton.offsets, plain.skeleton.offsets, atol=1e-12)
    turn = rot.from_axis_angle([1.0, 0.0, 0.0], np.pi / 2)
    lying = {
        "posed_joints": rot.mul_vec(turn, arrays["posed_joints"]),
        "global_rot_mats": rot.to_matrix(turn) @ arrays["global_rot_mats"],
    }
    upright = read_motion(saved(tmp_path / "a.npz", lying), up="z")
    np.testing.assert_allclose(upright.root, plain.root, atol=1e-12)
    assert rot.angle(upright.rotations, plain.rotations).max() < 1e-9


def test_joints_that_stray_are_reported(tmp_path: Path) -> None:
    arrays = movement(30)
    arrays["posed_joints"][2, 15] += [0.1, 0.0, 0.0]
    with pytest.warns(
        MotionMindWarning, match="a.npz: joints that move against their parents .*: LeftHandMiddleEnd by"
    ):
        read_motion(saved(tmp_path / "a.npz", arrays))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"global_rot_mats": None}, "no array 'global_rot_mats': not movement in Kimodo's form"),
        ({"posed_joints": np.zeros((6, 29, 3))}, "[6, 29, 3], not frames by 22 or 30 or 77 joints by 3"),
        ({"posed_joints": np.zeros((6, 34, 3))}, "34 joints are those of the robot G1"),
        ({"posed_joints": np.zeros((0, 30, 3))}, "'posed_joints' has the shape [0, 30, 3]"),
        ({"posed_joints": np.zeros((2, 6, 30, 3))}, "'posed_joints' has the shape [2, 6, 30, 3]"),
        ({"posed_joints": np.zeros(())}, "'posed_joints' has the shape []"),
        ({"global_rot_mats": np.zeros((6, 30, 3))}, "'global_rot_mats' has the shape [6, 30, 3], not [6, 30, 3, 3]"),
        ({"global_rot_mats": np.zeros((5, 30, 3, 3))}, "'global_rot_mats' has the shape [5, 30, 3, 3]"),
        ({"global_rot_mats": np.zeros((6, 30, 3, 3))}, "'global_rot_mats'[0, 0] is no matrix of a rotation"),
        ({"global_rot_mats": np.tile(-np.eye(3), (6, 30, 1, 1))}, "is no matrix of a rotation"),
        ({"global_rot_mats": np.full((6, 30, 3, 3), np.nan)}, "'global_rot_mats'[0, 0, 0, 0] is nan"),
        ({"fps": np.array(0.0)}, "'fps' must be one number of frames per second"),
    ],
)
def test_what_is_no_movement(change: dict[str, Floats | None], message: str, tmp_path: Path) -> None:
    arrays = {name: array for name, array in (movement(30) | change).items() if array is not None}
    with pytest.raises(FormatError, match=re.escape(message)) as caught:
        read_motion(saved(tmp_path / "a.npz", arrays))
    assert "\n" not in str(caught.value)
