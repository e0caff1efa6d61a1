"""BVH written again with some of its movement changed: the rest stays word for word."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from plain_bvh import PlainBvh, write_plain
from program_rigs import dance

from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindWarning
from motionmind.formats import read_motion
from motionmind.formats.bvh_changed import write_changed_bvh
from motionmind.formats.bvh_rig_file import nearest_angles
from motionmind.geometry import rotations as rot

ORDERS: dict[str, Callable[[int], str]] = {
    "one": lambda _: "ZXY",
    "mixed": lambda joint: ("ZYX", "XYZ", "YXZ")[joint % 3],
}


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def words(path: str) -> list[list[str]]:
    """The words of the frames of a file."""
    lines = Path(path).read_text().splitlines()
    start = next(n for n, line in enumerate(lines) if line.startswith("Frame Time"))
    return [line.split() for line in lines[start + 1 :] if line.strip()]


def turned(motion: Motion, joint: str, frames: slice, seed: int = 0) -> Motion:
    """The motion with a joint elsewhere in some frames."""
    rotations = motion.rotations.copy()
    at = motion.skeleton.index(joint)
    rotations[frames, at] = rot.mul(
        rotations[frames, at], rot.exp(0.4 * np.random.default_rng(seed).standard_normal((1, 3)))
    )
    return replace(motion, rotations=rotations)


def read(path: str, unit: str = "cm") -> Motion:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MotionMindWarning)  # of bodies that are giants in other units
        return read_motion(path, unit=unit)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_a_changed_joint_changes_its_own_channels_alone(order: str, newline: str) -> None:
    source = PlainBvh(write_plain(Path("a.bvh"), dance(), order=ORDERS[order], newline=newline))
    before = read("a.bvh")
    after = turned(before, "left_knee", slice(3, 7))
    written = write_changed_bvh("b.bvh", "a.bvh", before, after, "cm")
    assert PlainBvh("b.bvh").hierarchy == source.hierarchy
    changed = np.array(words("a.bvh")) != np.array(words("b.bvh"))
    knee = before.skeleton.index("left_knee")
    assert set(np.flatnonzero(changed.any(axis=1))) == {3, 4, 5, 6}
    assert set(np.flatnonzero(changed.any(axis=0))) <= {3 + 3 * knee, 4 + 3 * knee, 5 + 3 * knee}
    found = read("b.bvh")
    assert rot.angle(found.rotations, after.rotations).max() < 1e-6
    np.testing.assert_allclose(found.root, after.root, atol=1e-7)
    np.testing.assert_allclose(written.positions(), found.positions(), atol=1e-9)


def test_nothing_changed_is_the_same_file() -> None:
    write_plain(Path("a.bvh"), dance())
    motion = read("a.bvh")
    write_changed_bvh("b.bvh", "a.bvh", motion, motion, "cm")
    assert words("b.bvh") == words("a.bvh")


@pytest.mark.parametrize("unit", ["m", "cm", "in"])
def test_the_root_keeps_its_unit(unit: str) -> None:
    write_plain(Path("a.bvh"), dance())
    before = read("a.bvh", unit)
    after = replace(before, root=before.root + np.array([0.0, 0.013, 0.0]))
    write_changed_bvh("b.bvh", "a.bvh", before, after, unit)
    np.testing.assert_allclose(read("b.bvh", unit).root, after.root, atol=1e-7)
    assert rot.angle(read("b.bvh", unit).rotations, before.rotations).max() < 1e-12


def test_small_changes_keep_the_turns_that_a_file_counts() -> None:
    skeleton = Skeleton("spin", ("root", "arm"), (-1, 0), np.array([[0.0, 0, 0], [0, 1.0, 0]]), np.zeros((2, 3)))
    times = np.arange(40) / 10.0
    q = np.tile(rot.IDENTITY, (40, 2, 1))
    q[:, 1] = rot.from_axis_angle([0.0, 0.0, 1.0], 4.0 * times)
    write_plain(Path("a.bvh"), Motion(skeleton, q, np.zeros((40, 3)), times), order=lambda _: "ZXY")
    before = read("a.bvh")
    after = turned(before, "arm", slice(0, 40))
    write_changed_bvh("b.bvh", "a.bvh", before, after, "cm")
    old, new = (np.array(words(name), dtype=float)[:, 6] for name in ("a.bvh", "b.bvh"))
    assert np.abs(new - old).max() < 90.0
    assert rot.angle(read("b.bvh").rotations, after.rotations).max() < 1e-6


def test_large_changes_continue_from_the_frame_before() -> None:
    skeleton = Skeleton("spin", ("root", "arm"), (-1, 0), np.array([[0.0, 0, 0], [0, 1.0, 0]]), np.zeros((2, 3)))
    times = np.arange(40) / 10.0
    q = np.tile(rot.IDENTITY, (40, 2, 1))
    q[:, 1] = rot.from_axis_angle([0.0, 0.0, 1.0], 4.0 * times)
    smooth = Motion(skeleton, q.copy(), np.zeros((40, 3)), times)
    q[20:23, 1] = rot.mul(q[20:23, 1], rot.from_axis_angle([0.0, 0.0, 1.0], 2.9))
    write_plain(Path("a.bvh"), replace(smooth, rotations=q), order=lambda _: "ZXY")
    before = read("a.bvh")
    write_changed_bvh("b.bvh", "a.bvh", before, replace(before, rotations=smooth.rotations), "cm")
    angles = np.array(words("b.bvh"), dtype=float)
    at = [joint for joint in range(3, 9) if np.ptp(angles[:, joint]) > 1.0]
    assert np.abs(np.diff(angles[:, at], axis=0)[18:22]).max() < 90.0


def test_a_joint_with_one_channel_comes_as_near_as_it_can_and_says_so() -> None:
    text = (
        "HIERARCHY\nROOT hip\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
        "JOINT knee\n{\nOFFSET 0 -40 0\nCHANNELS 1 Xrotation\nEnd Site\n{\nOFFSET 0 -40 0\n}\n}\n}\nMOTION\n"
        "Frames: 3\nFrame Time: 0.05\n" + "".join(f"0 90 0 0 0 0 {angle}\n" for angle in (10, 20, 30))
    )
    Path("a.bvh").write_text(text)
    before = read("a.bvh")
    after = turned(before, "knee", slice(1, 2))
    written = write_changed_bvh("b.bvh", "a.bvh", before, after, "cm")
    assert rot.angle(written.rotations, after.rotations).max() > 0.01
    np.testing.assert_allclose(written.rotations, read("b.bvh").rotations, atol=1e-9)


def test_movement_on_a_root_below_the_files_root_is_written_there() -> None:
    places, turns = "Xposition Yposition Zposition", "Zrotation Xrotation Yrotation"
    still = f"HIERARCHY\nROOT world\n{{\nOFFSET 0 0 0\nCHANNELS 6 {places} {turns}\n"
    hips = f"JOINT hips\n{{\nOFFSET 0 0 0\nCHANNELS 6 {places} {turns}\n"
    head = f"JOINT head\n{{\nOFFSET 0 60 0\nCHANNELS 3 {turns}\nEnd Site\n{{\nOFFSET 0 30 0\n}}\n}}\n}}\n}}\n"
    rows = "".join(f"5 0 0 0 90 0 {10 * n} 90 {7 * n} 3 {n} 2 1 2 3\n" for n in range(8))
    Path("a.bvh").write_text(f"{still}{hips}{head}MOTION\nFrames: 8\nFrame Time: 0.05\n{rows}")
    before = read("a.bvh")
    assert before.skeleton.names == ("hips", "head")
    after = turned(replace(before, root=before.root + 0.1), "hips", slice(2, 5))
    write_changed_bvh("b.bvh", "a.bvh", before, after, "cm")
    np.testing.assert_allclose(read("b.bvh").positions(), after.positions(), atol=1e-7)
    assert [row[:6] for row in words("b.bvh")] == [row[:6] for row in words("a.bvh")]


@pytest.mark.parametrize("order", ["XYZ", "ZXY", "YZX"])
def test_the_nearest_angles_are_the_same_rotation_and_none_is_nearer(order: str) -> None:
    rng = np.random.default_rng(5)
    near = rng.uniform(-9.0, 9.0, (200, 3))
    turns = rot.exp(rng.standard_normal((200, 3)))
    found = nearest_angles(rot.to_euler(order, turns), near, order)
    assert rot.angle(rot.from_euler(order, found), turns).max() < 1e-9
    assert np.all(np.abs(found - near) <= 2.0 * np.pi)
    np.testing.assert_allclose(nearest_angles(rot.to_euler(order, turns), found, order), found, atol=1e-9)
