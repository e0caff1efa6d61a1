"""AMASS's .npz, in and out, against forward kinematics by scipy along SMPL's published tree."""

from __future__ import annotations

import contextlib
import io
import re
import struct
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionmind._typing import Floats
from motionmind.body.human import BODIES, human23, human44
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning, SkeletonError
from motionmind.formats import npz, read_motion, write_motion, write_posture
from motionmind.formats._smpl import smpl_bodies, unmapped_joints
from motionmind.formats.npz import read_npz, write_npz
from motionmind.geometry import rotations as rot
from motionmind.retarget.retarget import to_human23

# The models' `kintree_table`: SMPL's 24 joints; SMPL+H's 30 of the fingers hang in threes from the wrists, 20 and 21,
# SMPL-X's too, after jaw and eyes, which hang from the head, 15.
KINTREE = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19]


def fingers(first: int) -> list[int]:
    return [(20 + i // 15) if i % 3 == 0 else first + i - 1 for i in range(30)]


TREES = {22: KINTREE, 24: [*KINTREE, 20, 21], 52: KINTREE + fingers(22), 55: [*KINTREE, 15, 15, 15, *fingers(25)]}
COUNTS = sorted(TREES)


def arrays(joints: int = 52, frames: int = 5, seed: int = 0, rate: float = 120.0) -> dict[str, Floats]:
    """What a file holds: random turns, some by more than half a circle."""
    rng = np.random.default_rng(seed)
    return {
        "poses": rng.normal(size=(frames, 3 * joints)) * 2.0,
        "trans": rng.normal(size=(frames, 3)),
        "mocap_framerate": np.array(rate),
        "betas": rng.normal(size=16),
        "gender": np.array("female"),
    }


def saved(path: Path, found: dict[str, Floats]) -> Path:
    np.savez(path, **found)  # type: ignore[arg-type]
    return path


def in_space(poses: Floats) -> list[Rotation]:
    """Rotations of the joints in AMASS's world, one [T] a joint."""
    local = poses.reshape(len(poses), -1, 3)
    turned: list[Rotation] = []
    for joint, parent in enumerate(TREES[local.shape[1]]):
        here = Rotation.from_rotvec(local[:, joint])
        turned.append(here if parent < 0 else turned[parent] * here)
    return turned


def y_up(points: Floats) -> Floats:
    """From AMASS's world to ours: what faces -y there faces +z here."""
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


# --- in -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("joints", COUNTS)
def test_joints_are_where_scipy_puts_them(tmp_path: Path, joints: int) -> None:
    found = arrays(joints, seed=joints)
    motion = read_npz(saved(tmp_path / "a.npz", found))
    turned, offsets = in_space(found["poses"]), motion.skeleton.offsets.copy()
    places = [found["trans"]]
    for joint, parent in enumerate(TREES[joints][1:], start=1):
        places.append(places[parent] + turned[parent].apply(offsets[joint]))
    expected = y_up(np.stack(places, axis=1))
    np.testing.assert_allclose(motion.skeleton.positions(motion.rotations, motion.root), expected, atol=1e-9)
    np.testing.assert_allclose(motion.times, np.arange(5) / 120.0, atol=1e-12)
    assert motion.name == "a"


def test_who_faces_the_other_way_of_y_faces_ahead(tmp_path: Path) -> None:
    found = arrays(frames=3)
    found["poses"][:] = 0.0
    found["poses"][:, 0] = np.pi / 2  # SMPL at rest stands along y; this puts it up in a world with z up
    found["trans"][:] = [[0.0, 0.0, 0.9], [0.0, -1.0, 0.9], [0.5, -1.0, 0.9]]  # ahead, then to its left
    motion = read_npz(saved(tmp_path / "a.npz", found))
    np.testing.assert_allclose(rot.angle(motion.rotations, rot.IDENTITY), 0.0, atol=1e-12)
    np.testing.assert_allclose(motion.root, [[0.0, 0.9, 0.0], [0.0, 0.9, 1.0], [0.5, 0.9, 1.0]], atol=1e-12)


def test_people_who_stand_along_y_are_not_laid_down(tmp_path: Path) -> None:
    """As programs write it that track people in video; which axis is up can be said, too."""
    found = arrays(frames=40)
    found["poses"] *= 0.05
    found["trans"] = np.linspace([0.0, 0.9, 0.0], [0.5, 0.9, 2.0], 40)
    motion = read_npz(saved(tmp_path / "a.npz", found))
    np.testing.assert_allclose(motion.root, found["trans"], atol=1e-9)
    np.testing.assert_array_equal(motion.root, read_motion(tmp_path / "a.npz", up="y").root)
    np.testing.assert_allclose(read_motion(tmp_path / "a.npz", up="z").root, y_up(found["trans"]), atol=1e-9)


@pytest.mark.parametrize("joints", COUNTS)
def test_at_rest_every_smpl_is_human23(tmp_path: Path, joints: int) -> None:
    found = arrays(joints, frames=2)
    motion = read_npz(saved(tmp_path / "a.npz", found))
    person = to_human23(motion)
    assert person.skeleton == human23()
    left = motion.skeleton.offsets[[name.startswith("left_") for name in motion.skeleton.names]]
    right = motion.skeleton.offsets[[name.startswith("right_") for name in motion.skeleton.names]]
    np.testing.assert_allclose(left * [-1.0, 1.0, 1.0], right, atol=1e-12)
    turned = in_space(found["poses"])
    for name, joint in (("pelvis", 0), ("thorax", 9), ("atlantal", 15), ("left_wrist", 20), ("right_toes", 11)):
        expected = Rotation.from_euler("x", -np.pi / 2) * turned[joint]
        there = person.skeleton.global_rotations(person.rotations)[:, human23().index(name)]
        np.testing.assert_allclose((Rotation.from_quat(there).inv() * expected).magnitude(), 0.0, atol=1e-7)


def test_fingers_lie_side_by_side_the_thumb_before_them() -> None:
    hand = smpl_bodies()["SMPL+H"]
    rest = hand.positions(np.tile(rot.IDENTITY, (len(hand), 1)), np.zeros(3))
    for side in ("left", "right"):
        ahead = [rest[hand.index(f"{side}_{name}2"), 2] for name in ("pinky", "ring", "middle", "index", "thumb")]
        assert (np.diff(ahead) > 0.015).all()


def test_other_names_and_types_that_files_have(tmp_path: Path) -> None:
    found = arrays(55)
    expected = read_npz(saved(tmp_path / "a.npz", found))
    rate = found.pop("mocap_framerate")
    found |= {"mocap_frame_rate": rate.astype(np.int32).reshape(1), "labels": np.array([{"no": "numbers"}])}
    found["trans"] = found["trans"].astype(np.float32)
    motion = read_npz(saved(tmp_path / "a.npz", found))
    np.testing.assert_array_equal(motion.rotations, expected.rotations)
    np.testing.assert_allclose(motion.root, expected.root, atol=1e-6)
    assert motion.fps == pytest.approx(120.0)


@pytest.mark.parametrize("names", [("global_orient", "body_pose", "transl"), ("root_orient", "pose_body", "trans")])
@pytest.mark.parametrize("joints", [22, 24, 52])
@pytest.mark.parametrize("is_flat", [False, True])
def test_poses_in_parts_are_put_together(
    tmp_path: Path, names: tuple[str, str, str], joints: int, is_flat: bool
) -> None:
    found = arrays(joints)
    expected = read_npz(saved(tmp_path / "a.npz", found))
    body = 23 if joints == 24 else 21
    rows = found.pop("poses").reshape(5, joints, 3)
    parts = {names[0]: rows[:, :1], names[1]: rows[:, 1 : 1 + body], names[2]: found.pop("trans")}
    if joints == 52 and names[0] == "root_orient":
        parts["pose_hand"] = rows[:, 22:]
    elif joints == 52:
        parts |= {"left_hand_pose": rows[:, 22:37], "right_hand_pose": rows[:, 37:]}
    if is_flat:
        parts = {name: part.reshape(5, -1) for name, part in parts.items()}
    parts["fps"] = found["mocap_framerate"]
    motion = read_npz(saved(tmp_path / "a.npz", parts))
    assert motion.skeleton.names == expected.skeleton.names
    np.testing.assert_array_equal(motion.rotations, expected.rotations)
    np.testing.assert_array_equal(motion.root, expected.root)
    assert motion.fps == pytest.approx(120.0)


def test_a_full_pose(tmp_path: Path) -> None:
    found = arrays(55)
    expected = read_npz(saved(tmp_path / "a.npz", found))
    found |= {"fullpose": found.pop("poses").reshape(5, 55, 3), "transl": found.pop("trans")}
    np.testing.assert_array_equal(read_npz(saved(tmp_path / "a.npz", found)).rotations, expected.rotations)


def test_hands_of_another_form_are_left_out(tmp_path: Path) -> None:
    found = arrays(22)
    rows = found.pop("poses")
    found |= {"global_orient": rows[:, :3], "body_pose": rows[:, 3:], "transl": found.pop("trans")}
    found |= {"left_hand_pose": np.zeros((5, 6)), "right_hand_pose": np.zeros((5, 6))}  # as principal components
    assert len(read_npz(saved(tmp_path / "a.npz", found)).skeleton) == 22


@pytest.mark.parametrize(
    ("name", "shape", "message"),
    [
        ("global_orient", (5, 4), r"'global_orient' has the shape [5, 4], not frames by 3 numbers"),
        ("global_orient", (0, 3), r"'global_orient' has the shape [0, 3], not frames by 3 numbers"),
        ("global_orient", (5, 3, 3), r"'global_orient' has the shape [5, 3, 3], not frames by 3 numbers"),
        ("body_pose", (5, 60), r"'body_pose' has the shape [5, 60], not [5, 63 or 69] as 'global_orient' has"),
        ("body_pose", (4, 63), r"'body_pose' has the shape [4, 63], not [5, 63 or 69] as 'global_orient' has"),
        ("transl", (4, 3), r"'transl' has the shape [4, 3], not [5, 3] as 'global_orient' and 'body_pose' has"),
        ("transl", None, "no array 'trans': not movement in AMASS's form"),
        ("body_pose", None, "no array 'poses': not movement in AMASS's form"),
    ],
)
def test_a_fault_in_a_part_is_named(tmp_path: Path, name: str, shape: tuple[int, ...] | None, message: str) -> None:
    found = {"global_orient": np.zeros((5, 3)), "body_pose": np.zeros((5, 63)), "transl": np.zeros((5, 3))}
    found["fps"] = np.array(30.0)
    read_npz(saved(tmp_path / "a.npz", found))
    del found[name]
    if shape is not None:
        found[name] = np.zeros(shape)
    assert fails(saved(tmp_path / "a.npz", found)) == message


def test_places_in_centimetres_are_told_and_can_be_said(tmp_path: Path) -> None:
    found = arrays(22, frames=9) | {"poses": np.zeros((9, 66)), "trans": np.tile([0.0, 0.0, 92.0], (9, 1))}
    path = saved(tmp_path / "a.npz", found)
    with pytest.warns(MotionMindWarning, match=r"the body is 92 m off 0; is its place in centimetres \(--unit cm\)\?"):
        read_motion(path, up="z")
    np.testing.assert_allclose(read_motion(path, up="z", unit="cm").root[:, 1], 0.92)


def test_degrees_are_refused(tmp_path: Path) -> None:
    found = arrays()
    found["poses"] = np.degrees(found["poses"])
    with pytest.raises(FormatError, match=r"a\.npz: 'poses' turns by \d+ radians: are these degrees\?"):
        read_npz(saved(tmp_path / "a.npz", found))


def test_a_rate_that_is_not_said_must_be_given(tmp_path: Path) -> None:
    found = arrays()
    del found["mocap_framerate"]
    saved(tmp_path / "a.npz", found)
    with pytest.raises(FormatError, match=r"no array 'mocap_framerate': give the frames per second .*--source-fps"):
        read_motion(tmp_path / "a.npz")
    assert read_motion(tmp_path / "a.npz", fps=60).fps == pytest.approx(60.0)
    assert read_motion(saved(tmp_path / "b.npz", arrays()), fps=60).fps == pytest.approx(60.0)  # in place of the file's
    with pytest.raises(FormatError, match="'fps' must be one number of frames per second, not -1"):
        read_npz(tmp_path / "a.npz", fps=-1)


@pytest.mark.parametrize("name", npz._RATE_NAMES)
def test_a_given_rate_replaces_that_of_any_name(name: str, tmp_path: Path) -> None:
    found = arrays()
    found[name] = found.pop("mocap_framerate")
    path = saved(tmp_path / "a.npz", found)
    assert read_npz(path).fps == pytest.approx(120.0)
    assert read_npz(path, fps=60.0).fps == pytest.approx(60.0)


# --- there and back -------------------------------------------------------------------------------------------------


@pytest.mark.long
@settings(max_examples=30)
@given(st.sampled_from(COUNTS), st.integers(1, 6), st.integers(0, 999), st.sampled_from([1.0, 29.97, 60.0, 120.0]))
def test_nothing_is_lost_from_file_to_file(
    tmp_path_factory: pytest.TempPathFactory, joints: int, frames: int, seed: int, rate: float
) -> None:
    folder = tmp_path_factory.getbasetemp()
    found = arrays(joints, frames, seed, rate)
    write_npz(folder / "b.npz", read_npz(saved(folder / "a.npz", found)))
    with np.load(folder / "b.npz", allow_pickle=False) as file:
        again = dict(file)
    np.testing.assert_allclose(again["trans"], found["trans"], atol=1e-12)
    there = Rotation.from_rotvec(again["poses"].reshape(-1, 3))
    here = Rotation.from_rotvec(found["poses"].reshape(-1, 3))
    np.testing.assert_allclose((here.inv() * there).magnitude(), 0.0, atol=1e-9)
    assert again["poses"].shape == found["poses"].shape
    name = "mocap_frame_rate" if joints == 55 else "mocap_framerate"
    assert again[name] == pytest.approx(rate)


@given(st.integers(0, 999), st.floats(-np.pi, np.pi))
@settings(max_examples=20)
def test_a_turn_about_the_vertical_is_one(tmp_path_factory: pytest.TempPathFactory, seed: int, angle: float) -> None:
    folder = tmp_path_factory.getbasetemp()
    found = arrays(22, seed=seed)
    motion = read_npz(saved(folder / "a.npz", found))
    turn = Rotation.from_euler("z", angle)
    found["trans"] = turn.apply(found["trans"])
    found["poses"][:, :3] = (turn * Rotation.from_rotvec(found["poses"][:, :3])).as_rotvec()
    turned = read_npz(saved(folder / "a.npz", found))
    about = rot.about_vertical(angle)
    np.testing.assert_allclose(turned.root, rot.mul_vec(about, motion.root), atol=1e-9)
    np.testing.assert_allclose(turned.rotations[:, 1:], motion.rotations[:, 1:], atol=1e-12)
    assert rot.angle(turned.rotations[:, 0], rot.mul(about, motion.rotations[:, 0])).max() < 1e-7


def moving(skeleton: Skeleton, frames: int = 6, seed: int = 0) -> Motion:
    rng = np.random.default_rng(seed)
    rotations = rot.normalise(rng.normal(size=(frames, len(skeleton), 4)))
    return Motion(skeleton, rotations, rng.normal(size=(frames, 3)), np.arange(frames) / 30.0, name="moving")


@pytest.mark.parametrize("body", BODIES)
def test_bodies_of_ours_come_back_as_human23(tmp_path: Path, body: str) -> None:
    motion = moving(BODIES[body]())
    write_motion(tmp_path / "a.npz", motion)
    here, there = to_human23(motion), to_human23(read_motion(tmp_path / "a.npz"))
    assert there.skeleton == human23()
    assert rot.angle(here.rotations, there.rotations).max() < 1e-9
    np.testing.assert_allclose(there.root, here.root, atol=1e-12)
    np.testing.assert_allclose(there.times, here.times, atol=1e-9)


def test_hands_close_as_those_of_human44(tmp_path: Path) -> None:
    motion = moving(human44(), seed=4)
    write_npz(tmp_path / "a.npz", motion)
    again = read_npz(tmp_path / "a.npz")
    here = motion.skeleton.global_rotations(motion.rotations)
    there = again.skeleton.global_rotations(again.rotations)
    for finger, joint in (("middle", "fingers"), ("pinky", "fingers"), ("thumb", "thumb")):
        for row, name in enumerate((joint, f"{joint}_middle", f"{joint}_end"), start=1):
            ours, theirs = human44().index(f"right_{name}"), again.skeleton.index(f"right_{finger}{row}")
            assert rot.angle(here[:, ours], there[:, theirs]).max() < 1e-9
    for name, other in (("lumbar_upper", "spine1"), ("thorax_upper", "spine3"), ("cervical_upper", "neck")):
        assert rot.angle(here[:, human44().index(name)], there[:, again.skeleton.index(other)]).max() < 1e-9


@pytest.mark.parametrize("name", ["cmu-05/05_02.bvh", "bandai/kick_normal_001.bvh"])
def test_recordings(shared_data: Path, tmp_path: Path, name: str) -> None:
    motion = to_human23(read_motion(shared_data / name))
    write_motion(tmp_path / "a.npz", read_motion(shared_data / name))
    again = to_human23(read_motion(tmp_path / "a.npz"))
    assert rot.angle(motion.rotations, again.rotations).max() < 1e-7
    np.testing.assert_allclose(again.root, motion.root, atol=1e-9)


# --- out ------------------------------------------------------------------------------------------------------------


def test_what_is_written_is_amasss(tmp_path: Path) -> None:
    write_posture(tmp_path / "a.npz", moving(human23()).posture(2))
    with np.load(tmp_path / "a.npz", allow_pickle=False) as file:
        shapes = {name: (file[name].shape, file[name].dtype.kind) for name in file}
    assert shapes == {
        "trans": ((1, 3), "f"),
        "gender": ((), "U"),
        "mocap_framerate": ((), "f"),
        "betas": ((16,), "f"),
        "dmpls": ((1, 8), "f"),
        "poses": ((1, 156), "f"),
    }


def test_the_same_motion_gives_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_npz(tmp_path / "a.npz", moving(human23()))
    monkeypatch.setattr(time, "time", lambda: 2e9)
    monkeypatch.setattr(time, "localtime", lambda *_: time.gmtime(2e9))
    write_npz(tmp_path / "b.npz", moving(human23()))
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_what_cannot_be_written(tmp_path: Path) -> None:
    motion = moving(human23(), 3)
    uneven = Motion(motion.skeleton, motion.rotations, motion.root, np.array([0.0, 0.1, 0.3]))
    with pytest.raises(MotionMindError, match="AMASS needs frames evenly spaced in time"):
        write_npz(tmp_path / "a.npz", uneven)
    with pytest.raises(SkeletonError, match="do not map to human23"):
        write_npz(tmp_path / "a.npz", moving(Skeleton("dot", ("dot",), (-1,), np.zeros((1, 3)))))
    assert list(tmp_path.iterdir()) == []


def test_what_has_no_place_is_what_turns(tmp_path: Path) -> None:
    motion = moving(human44())
    assert set(unmapped_joints(motion)) == {
        *(f"{side}_toes_{row}" for side in ("left", "right") for row in ("middle", "end")),
        *("lumbar_middle", "cervical_middle", "axial"),
    }
    still = Motion(human44(), np.tile(rot.IDENTITY, (1, 44, 1)), np.zeros((1, 3)), np.zeros(1))
    assert unmapped_joints(still) == []
    for body in (human23(), *smpl_bodies().values()):
        assert unmapped_joints(moving(body)) == []


# --- files that are none --------------------------------------------------------------------------------------------


def fails(path: Path) -> str:
    with pytest.raises(FormatError) as caught:
        read_motion(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("poses", None, "no array 'poses'"),
        ("trans", None, "no array 'trans'"),
        ("poses", np.zeros((5, 157)), r"'poses' has the shape \[5, 157\], not frames by one of 66, 72, 156, 165"),
        ("poses", np.zeros((5, 52, 3)), r"shape \[5, 52, 3\]"),
        ("poses", np.zeros((0, 156)), r"shape \[0, 156\]"),
        ("poses", np.zeros(()), r"shape \[\]"),
        ("trans", np.zeros((4, 3)), r"'trans' has the shape \[4, 3\], not \[5, 3\]"),
        ("trans", np.array([[0.0, 0.0, 0.0]] * 4 + [[0.0, np.nan, 0.0]]), r"'trans'\[4, 1\] is nan"),
        ("poses", np.full((5, 156), np.inf), r"'poses'\[0, 0\] is inf"),
        ("trans", np.full((5, 3), 1e300), r"'trans'\[0, 0\] is 1e\+300"),
        ("poses", np.full((5, 156), "text"), "'poses' holds no numbers"),
        ("poses", np.zeros((5, 156), dtype=complex), "'poses' holds no numbers"),
        ("poses", np.array([{"a": 1}]), "'poses' holds no numbers"),
        ("mocap_framerate", np.array(0.0), "'mocap_framerate' must be one number of frames per second, not 0"),
        ("mocap_framerate", np.array(1e9), "must be one number"),
        ("mocap_framerate", np.array([30.0, 60.0]), r"not \[30\. 60\.\]"),
    ],
)
def test_a_fault_is_named(tmp_path: Path, name: str, value: Floats | None, message: str) -> None:
    found = arrays()
    del found[name]
    if value is not None:
        found[name] = value
    said = fails(saved(tmp_path / "a.npz", found))
    assert re.search(message, said), said


def packed(path: Path, poses: bytes, name: str = "poses.npy") -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(name, poses)
    return path


def test_no_zips(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    for data in (b"", b"no zip", b"\x80\x04]q\x00.", np.lib.format.magic(1, 0)):
        path.write_bytes(data)
        assert fails(path) == "not an .npz file, which is a zip of numpy arrays"
    assert "there is no such file" in fails(tmp_path / "none.npz")
    whole = saved(path, arrays()).read_bytes()
    for cut in range(2, len(whole), 97):
        path.write_bytes(whole[:cut])
        assert "cannot be read" in fails(path)


def test_what_would_fill_the_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**13, 156)})
    claims = fails(packed(tmp_path / "claims.npz", header.getvalue()))
    assert claims == "'poses' is too large to be movement: [10000000000000, 156]"
    nested = b"\x93NUMPY\x01\x00" + struct.pack("<H", 6000) + b"(" * 6000
    assert "'poses' cannot be read" in fails(packed(tmp_path / "nested.npz", nested))
    monkeypatch.setattr(npz, "_MAX_ARRAY_BYTES", 100_000)
    header = io.BytesIO()
    np.save(header, np.zeros((1000, 156)))
    for name in ("poses.npy", "poses"):
        bomb = packed(tmp_path / "bomb.npz", header.getvalue(), name)
        assert bomb.stat().st_size < 10_000
        assert fails(bomb) == "'poses' is too large to be movement: [1000, 156]"


@pytest.mark.long
@settings(max_examples=150)
@given(st.data())
def test_only_our_errors_escape(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.npz"
    whole = bytearray(saved(path, arrays(22, 1)).read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(whole) - 1))
        whole[at : at + data.draw(st.integers(0, 2))] = data.draw(st.binary(max_size=2))
    path.write_bytes(whole)
    with contextlib.suppress(FormatError):
        assert np.isfinite(read_npz(path).rotations).all()


@given(st.binary(max_size=200))
def test_any_bytes(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "any.npz"
    path.write_bytes(b"PK" + data)
    with pytest.raises(FormatError):
        read_npz(path)


def test_small_numbers_do_not_swell_on_reading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = arrays(frames=100)
    found["poses"] = np.zeros((100, 156), dtype=np.uint8)
    monkeypatch.setattr(npz, "_MAX_ARRAY_BYTES", 8 * found["poses"].size - 1)
    assert fails(saved(tmp_path / "a.npz", found)) == "'poses' is too large to be movement: [100, 156]"


def test_no_rate_is_written_that_could_not_be_read(tmp_path: Path) -> None:
    body = human23()
    still = np.tile(rot.IDENTITY, (3, len(body), 1))
    fast = Motion(body, still, np.zeros((3, 3)), np.arange(3) * 1e-5)
    with pytest.raises(MotionMindError, match="100000 frames a second are more than 10000"):
        write_npz(tmp_path / "a.npz", fast)
    assert not list(tmp_path.iterdir())
