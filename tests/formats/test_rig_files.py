"""Movement on the rig of a BVH file: its skeleton word for word, its ends in every channel, its joints in between."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plain_bvh import PlainBvh, degrees_between, write_plain
from program_rigs import BODY, EXPORTS, about, along_bones, disguise, export, exported, rig_names, spread, stroll
from scipy.spatial.transform import Rotation

from motionmind._typing import Floats
from motionmind.body.human import human44
from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning, SkeletonError
from motionmind.formats import read_motion
from motionmind.formats.bvh import has_inserted_frames
from motionmind.formats.bvh_rig_file import _continue_angles
from motionmind.formats.rig_files import read_rig, retarget_to_rig, write_on_rig
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import joint_mapping
from motionmind.retarget.retarget import own_skeleton
from motionmind.retarget.vertical import Z_UP_TO_Y_UP

PRINTED_DEG = 1e-5  # angles have six decimals, which add up along a chain of bones
FRAMES = 9


def between(own: Motion, a: int, b: int, seed: int = 0) -> Motion:
    """Movement from frame a to frame b that goes elsewhere in between, with joints that turn by up to half a turn."""
    rng = np.random.default_rng(seed)
    share = np.linspace(0.0, 1.0, FRAMES)
    bump = np.sin(np.pi * share)
    bump[-1] = 0.0
    straight = rot.slerp(own.rotations[a], own.rotations[b], share[:, None])
    turns = rot.mul(straight, rot.exp(bump[:, None, None] * rng.uniform(-1.0, 1.0, (len(own.skeleton), 3))))
    turns[0], turns[-1] = own.rotations[a], own.rotations[b]
    root = own.root[a] + share[:, None] * (own.root[b] - own.root[a]) + 0.3 * np.outer(bump, rng.normal(size=3))
    return Motion(own.skeleton, rot.normalise(turns), root, np.arange(FRAMES) / 30.0, name="between")


@dataclass
class Tween:
    """A file, and movement between two of its frames that was written on its rig."""

    source: PlainBvh
    result: PlainBvh
    motion: Motion
    frames: tuple[int, int]
    adds: bool = False

    def check_ends(self, within: float = PRINTED_DEG) -> None:
        """Check that the tree is the source's word for word, and all joints at both ends."""
        source, result = self.source, self.result
        assert result.hierarchy == source.hierarchy
        off = np.abs(result.values[0] - source.values[self.frames[0]])
        assert off.max() < 1e-5, [*source.columns()][off.argmax()]  # not a whole turn farther, either
        (turns, places), (wanted_turns, wanted) = (
            source.world(self.frames, adds=self.adds),
            result.world([0, -1], adds=self.adds),
        )
        assert degrees_between(turns, wanted_turns) < within
        np.testing.assert_allclose(places, wanted, atol=1e-5 * np.ptp(places))
        assert result.jumps() < 180.0

    def check_turns(self, bones: dict[str, str], upright: Floats = rot.IDENTITY) -> None:
        """Check that bones {name: joint of the motion} turn since A as their joints do, in every frame."""
        turns, _ = self.result.world(range(FRAMES), adds=self.adds)
        found = turns.as_quat().reshape(FRAMES, -1, 4)[:, [self.result.names.index(name) for name in bones]]
        body = self.motion.skeleton
        joints = [body.index(joint) for joint in bones.values()]
        wanted = rot.inv_mul(upright, body.global_rotations(self.motion.rotations)[:, joints])
        since = [rot.mul_inv(one, one[:1]) for one in (found, wanted)]
        off = np.degrees(rot.angle(*since)).max(axis=0)
        assert off.max() < 1e-3, (np.array([*bones])[off >= 1e-3], off.max())

    def check_path(self, hips: str, per_metre: float = 100.0, upright: Floats = rot.IDENTITY) -> None:
        """Check that the hips are where the motion's root is, in every frame."""
        _, places = self.result.world(range(FRAMES), adds=self.adds)
        wanted = rot.mul_vec(rot.inv(upright), self.motion.root)
        np.testing.assert_allclose(places[:, self.result.names.index(hips)] / per_metre, wanted, atol=1e-5)

    def check_rows(self, mapping: dict[str, str]) -> None:
        """Check that bones in a row for one joint, bent alike at A and B, turn as one."""
        turns, _ = self.result.world(range(FRAMES), adds=self.adds)
        each = turns.as_quat().reshape(FRAMES, -1, 4)
        for joint in set(mapping.values()):
            row = [self.result.names.index(name) for name, one in mapping.items() if one == joint]
            bend = rot.inv_mul(each[:, row[-1:]], each[:, row])
            assert np.degrees(rot.angle(bend, bend[:1])).max() < 1e-3, (joint, row)


def tween(source: Path, frames: tuple[int, int], *, adds: bool = False, **given: Any) -> Tween:
    """Write movement between two frames of a file on the file's own rig."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MotionMindWarning)
        motion = read_motion(source)
        own = own_skeleton(motion, **given)
        rig = read_rig(source, frames, motion=motion, **given)
    moved = between(own, *frames)
    out = source.with_name("out.bvh")
    write_on_rig(out, moved, rig)
    return Tween(PlainBvh(source), PlainBvh(out), moved, frames, adds)


def one_to_one(mapping: dict[str, str]) -> dict[str, str]:
    """Return the joints of a rig that alone map to theirs, and follow it in every frame.

    Several in a row turn as one between the ends; and if a row is in the spine, the lumbar joint points at the arms.
    """
    joints = [*mapping.values()]
    alone = {name: joint for name, joint in mapping.items() if joints.count(joint) == 1}
    has_row = any(joints.count(joint) > 1 for joint in ("lumbar", "thorax"))
    return {name: joint for name, joint in alone.items() if not (has_row and joint == "lumbar")}


# --- recordings -----------------------------------------------------------------------------------------------------

IMPORTER = "bvh_test1 bvh_test2 test_mocapbank test_freebvh dab jumping_jacks makehuman_tpose bvhio_example"
IMPORTER += " boxing_toes_header_count_off_by_one rotation_first_root full_precision_frame_time standard_skeleton"
IMPORTER += " sinusoidal_no_end_sites"
RECORDED = [f"importer/{name}" for name in IMPORTER.split()]
RECORDED += [f"bandai/{name}_normal_001" for name in ["dance-short", "kick", "punch", "run", "slash", "walk"]]
RECORDED += [f"indian/{number}" for number in ["04", "06", "07", "08", "13", "14", "15"]]
RECORDED += [f"cmu-05/05_{number:02}" for number in (1, 5, 6, 8, 14, 16, 19)]
Z_UP = {f"importer/{name}" for name in ["bvh_test1", "dab", "makehuman_tpose", "standard_skeleton"]}


@pytest.mark.long
@pytest.mark.parametrize("clip", RECORDED)
def test_recordings_keep_their_skeleton_and_both_ends(shared_data: Path, clip: str, tmp_path: Path) -> None:
    copy = tmp_path / "in.bvh"
    copy.write_bytes((shared_data / f"{clip}.bvh").read_bytes())
    count = len(PlainBvh(copy).values)
    found = tween(copy, (count // 3, count - 1))
    found.check_ends()
    mapping = joint_mapping(Skeleton("x", tuple(found.source.names), tuple(found.source.parents), found.source.offsets))
    if mapping is not None:
        found.check_turns(one_to_one(mapping), Z_UP_TO_Y_UP if clip in Z_UP else rot.IDENTITY)


@pytest.mark.long
@pytest.mark.parametrize("clip", ["importer/test_freebvh", "bandai/kick_normal_001", "indian/04", "cmu-05/05_09"])
def test_what_was_written_on_a_recording_comes_back(shared_data: Path, clip: str, tmp_path: Path) -> None:
    """Other joints are several of the file's, which turn as one between the ends, or lacking there."""
    copy = tmp_path / "in.bvh"
    copy.write_bytes((shared_data / f"{clip}.bvh").read_bytes())
    found = tween(copy, (5, 60))
    back = own_skeleton(read_motion(tmp_path / "out.bvh"))
    turns = [one.skeleton.global_rotations(one.rotations) for one in (back, found.motion)]
    off = np.degrees(rot.angle(*turns)).max(axis=0)
    mapping = joint_mapping(read_motion(copy).skeleton)
    assert mapping is not None
    followed = [BODY.index(joint) for joint in one_to_one(mapping).values()]
    assert off[followed].max() < 1e-4
    np.testing.assert_allclose(back.root, found.motion.root, atol=1e-6)


# --- rigs of programs -----------------------------------------------------------------------------------------------


def stepping(seed: int = 3) -> Motion:
    """Steps on the spot by a body that turns, with feet and hands that all joints move."""
    return replace(stroll(), root=stroll().root + np.linspace([0.0, 0.0, 0.0], [0.5, 0.0, 0.2], 120))


@pytest.mark.parametrize("rig", EXPORTS)
def test_rigs_of_programs_keep_both_ends_and_follow_in_between(rig: str, tmp_path: Path) -> None:
    motion = exported(stepping(), rig, spread())
    bends = rot.exp(0.1 * np.random.default_rng(8).normal(size=(len(motion.skeleton), 3)) * np.ones((120, 1, 1)))
    motion = replace(motion, rotations=rot.mul(motion.rotations, bends))  # within rows, and of twists and props, too
    order = depth_first(motion.skeleton)
    found = tween(write_plain(tmp_path / "in.bvh", reordered(motion, order)), (10, 77))
    found.check_ends()
    mapping = {name: joint for name, _, joint in export(rig) if joint}
    found.check_turns(one_to_one(mapping))
    found.check_rows(mapping)


def depth_first(body: Skeleton) -> list[int]:
    order, waiting = [], [0]
    while waiting:
        order.append(waiting.pop())
        waiting += reversed(body.children(order[-1]))
    return order


def reordered(motion: Motion, order: list[int]) -> Motion:
    body = motion.skeleton
    skeleton = Skeleton(
        body.name,
        tuple(body.names[joint] for joint in order),
        tuple(order.index(body.parents[joint]) if joint else -1 for joint in order),
        body.offsets[order],
        body.tips[order],
    )
    return replace(motion, skeleton=skeleton, rotations=motion.rotations[:, order])


MIXAMO = rig_names("Mixamo")
STANDING = disguise(stepping(), MIXAMO, spread())


@pytest.mark.parametrize("axis", ["x", "y", "-x"])
def test_zero_poses_along_bones(axis: str, tmp_path: Path) -> None:
    """As LaFAN1's: the movement, not the zero pose, shows how the joints' axes lie."""
    found = tween(write_plain(tmp_path / "in.bvh", disguise(stepping(), MIXAMO, {}, along_bones(axis, 20.0))), (10, 77))
    found.check_ends()
    found.check_turns({name: joint for joint, name in MIXAMO.items()})


def test_z_up(tmp_path: Path) -> None:
    z_up = disguise(stepping(), MIXAMO, spread(), world=rot.inv(Z_UP_TO_Y_UP))
    found = tween(write_plain(tmp_path / "in.bvh", z_up), (10, 77))
    found.check_ends()
    found.check_turns({name: joint for joint, name in MIXAMO.items()}, Z_UP_TO_Y_UP)
    found.check_path(MIXAMO["pelvis"], upright=Z_UP_TO_Y_UP)


# --- dialects of BVH ------------------------------------------------------------------------------------------------


def walking_hips(motion: Motion) -> tuple[Motion, Floats]:
    """The motion under a root that stands at the origin, as Bandai-Namco's, and the joints' places for it."""
    body = motion.skeleton
    skeleton = Skeleton(
        body.name,
        ("root", *body.names),
        (-1, *(parent + 1 for parent in body.parents)),
        np.concatenate([np.zeros((1, 3)), body.offsets]),
        np.concatenate([np.zeros((1, 3)), body.tips]),
    )
    still = np.tile(rot.IDENTITY, (len(motion), 1, 1))
    whole = Motion(skeleton, np.concatenate([still, motion.rotations], axis=1), 0.0 * motion.root, motion.times)
    places = np.broadcast_to(skeleton.offsets, (len(motion), len(skeleton), 3)).copy()
    places[:, 1] = motion.root
    return whole, places


STRETCHED = np.broadcast_to(STANDING.skeleton.offsets, (120, 22 + 1, 3)) + 1e-3 * np.random.default_rng(1).normal(
    size=(120, 23, 3)
)
STRETCHED[:, 0] = STANDING.root
UNDER_ROOT, HIPS_PLACES = walking_hips(STANDING)
ORDERS = ["".join(order) for order in permutations("XYZ")]
DIALECTS: dict[str, tuple[Motion, dict[str, Any]]] = {
    "plain": (STANDING, {}),
    "orders differ": (STANDING, {"order": lambda joint: ORDERS[joint % 6]}),
    "rotations first": (STANDING, {"turns_first": True}),
    "CRLF": (STANDING, {"newline": "\r\n"}),
    "blanks": (STANDING, {"indent": "   "}),
    "no End Sites": (STANDING, {"end_sites": False}),
    "metres": (STANDING, {"per_metre": 1.0}),
    "inches": (STANDING, {"per_metre": 1.0 / 0.0254}),
    "all joints move": (STANDING, {"moving": lambda _: True}),
    "all joints stretch": (STANDING, {"moving": lambda _: True, "places": STRETCHED}),
    "hips move under a root": (UNDER_ROOT, {"moving": lambda joint: joint < 2, "places": HIPS_PLACES}),
    "hips alone can move": (UNDER_ROOT, {"moving": lambda joint: joint == 1, "places": HIPS_PLACES}),
    "root has no channels": (
        UNDER_ROOT,
        {
            "moving": lambda joint: joint == 1,
            "places": HIPS_PLACES,
            "order": lambda joint: "" if joint == 0 else "ZYX",
        },
    ),
}


@pytest.mark.parametrize("dialect", DIALECTS)
def test_dialects(dialect: str, tmp_path: Path) -> None:
    motion, how = DIALECTS[dialect]
    found = tween(write_plain(tmp_path / "in.bvh", motion, **how), (10, 77))
    found.check_ends()
    found.check_turns({name: joint for joint, name in MIXAMO.items()})
    found.check_path(MIXAMO["pelvis"], how.get("per_metre", 100.0))


def test_positions_that_add_to_offsets(tmp_path: Path) -> None:
    """As old exporters of Blender meant them."""
    places = np.zeros((120, 23, 3))
    places[:, 0] = STANDING.root
    found = tween(write_plain(tmp_path / "in.bvh", STANDING, moving=lambda _: True, places=places), (10, 77), adds=True)
    found.check_ends()
    found.check_turns({name: joint for joint, name in MIXAMO.items()})


@pytest.mark.parametrize("orders", ["X", "ZX", ""])
def test_joints_of_few_channels_do_not_lead_those_below_astray(orders: str, tmp_path: Path) -> None:
    """Knees that only bend, and turn only there: hips and feet keep their orientations while knees come near theirs."""
    knees = [STANDING.skeleton.index(MIXAMO[f"{side}_knee"]) for side in ("left", "right")]
    turns = STANDING.rotations.copy()
    turns[:, knees] = rot.from_axis_angle([1.0, 0.0, 0.0], rot.angle(turns[:, knees], rot.IDENTITY) * bool(orders))
    source = write_plain(
        tmp_path / "in.bvh",
        replace(STANDING, rotations=turns),
        order=lambda joint: orders if joint in knees else "ZXY",
    )
    found = tween(source, (10, 77))
    found.check_ends()
    found.check_turns({name: joint for joint, name in MIXAMO.items() if not joint.endswith("_knee")})


def test_two_rotations_about_one_axis_are_refused(tmp_path: Path) -> None:
    source = write_plain(tmp_path / "in.bvh", STANDING, order=lambda joint: "XYZ" if joint == 3 else "ZXY")
    text = source.read_text("utf-8").replace("Xrotation Yrotation Zrotation", "Xrotation Yrotation Xrotation")
    source.write_text(text, "utf-8")
    fault = "turns about one axis twice (XYX), which cannot be written"
    with pytest.raises(FormatError, match=re.escape(f"{STANDING.skeleton.names[3]} {fault}")) as refused:
        read_rig(source)
    assert "\n" not in str(refused.value)


def test_gimbal_lock_keeps_the_file_s_angles(tmp_path: Path) -> None:
    turns = STANDING.rotations.copy()
    turns[:] = rot.from_euler("ZXY", np.radians([35.0, 90.0, -20.0]))
    locked = replace(STANDING, rotations=turns)
    source = write_plain(tmp_path / "in.bvh", locked)
    text = source.read_text("utf-8").replace("\n", "\r")
    rows = text.split("\r")
    start = rows.index("Frames: 120") + 2
    for row in range(start, start + 120):  # SciPy sets the third angle to 0
        place = rows[row].split()[:3]
        rows[row] = " ".join(place + ["35", "90", "-20"] * 23)
    source.write_text("\n".join(rows), "utf-8")
    rig = read_rig(source, (3, 3), motion=read_motion(source))
    write_on_rig(tmp_path / "out.bvh", read_motion(source).slice(3, 9), rig)
    np.testing.assert_allclose(PlainBvh(tmp_path / "out.bvh").values[:, 3:6], [[35.0, 90.0, -20.0]] * 6, atol=1e-5)


@given(
    st.sampled_from(ORDERS),
    st.integers(0, 999),
    st.lists(st.sampled_from([0.0, 1e-12, 1e-6, 0.3, 1.5, np.pi, -0.3, -1.2]), min_size=2, max_size=9),
    st.sampled_from([1.0, -1.0]),
)
def test_angles_continue_from_those_given(order: str, seed: int, off: list[float], side: float) -> None:
    rng = np.random.default_rng(seed)
    angles = rng.uniform(-9.0, 9.0, (len(off), 3))
    angles[:, 1] = side * (np.pi / 2 - np.array(off))
    turns = rot.from_euler(order, angles)
    found = _continue_angles(rot.to_euler(order, turns), angles[0], order)
    np.testing.assert_allclose(found[0], angles[0], atol=1e-4 if 0.0 < off[0] < 1e-5 else 1e-9)
    assert rot.angle(rot.from_euler(order, found), turns).max() < 1e-8
    assert np.abs(np.diff(found, axis=0)).max() <= np.pi + 1e-9


# --- what human23 lacks ---------------------------------------------------------------------------------------------


def with_tail(motion: Motion) -> Motion:
    """The motion with a joint of no person, which turns about changing axes."""
    body = motion.skeleton
    skeleton = Skeleton(
        body.name,
        (*body.names, "a tail"),
        (*body.parents, 0),
        np.concatenate([body.offsets, [[0.0, 0.0, -0.1]]]),
        np.concatenate([body.tips, [[0.0, 0.0, -0.3]]]),
    )
    wags = rot.mul(about("x", 40.0), rot.from_axis_angle([0.0, 1.0, 0.0], np.linspace(-1.0, 1.0, len(motion))))
    return replace(motion, skeleton=skeleton, rotations=np.concatenate([motion.rotations, wags[:, None]], axis=1))


def local_turns(file: PlainBvh, name: str) -> Rotation:
    """A joint's rotations in its parent's frame, frame by frame."""
    count, joint = len(file.values), file.names.index(name)
    turns, _ = file.world(range(count))
    every = len(file.names) * np.arange(count)
    return turns[every + file.parents[joint]].inv() * turns[every + joint]


def test_joints_that_human23_lacks_go_from_their_pose_in_a_to_that_in_b(tmp_path: Path) -> None:
    found = tween(write_plain(tmp_path / "in.bvh", with_tail(STANDING)), (10, 77))
    found.check_ends()
    tail = local_turns(found.result, "a tail")
    way = (tail[0].inv() * tail[-1]).magnitude()
    gone, left = (tail[0].inv() * tail).magnitude(), (tail.inv() * tail[-1]).magnitude()
    assert way > 0.5
    np.testing.assert_allclose(gone + left, way, atol=1e-6)  # no way round
    assert np.all(np.diff(gone) > 0.0)


def test_joints_that_human23_lacks_stay_as_in_frame_0_if_the_ends_are_not_the_rig_s(tmp_path: Path) -> None:
    source = write_plain(tmp_path / "in.bvh", with_tail(STANDING))
    write_on_rig(tmp_path / "out.bvh", between(stepping(), 20, 30), read_rig(source))
    tail = local_turns(PlainBvh(tmp_path / "out.bvh"), "a tail")
    assert degrees_between(tail, local_turns(PlainBvh(source), "a tail")[0]) < PRINTED_DEG


@pytest.mark.long
def test_joints_that_human23_lacks_leave_one_known_pose_for_none(tmp_path: Path) -> None:
    """The first frame is the file's, whole turns of its angles included."""
    source = write_plain(tmp_path / "in.bvh", with_tail(STANDING))
    rows = source.read_text("utf-8").split("\n")
    at = rows.index("Frames: 120") + 2 + 50
    values = rows[at].split()
    rows[at] = " ".join([*values[:3], str(float(values[3]) + 360.0), *values[4:]])
    source.write_text("\n".join(rows), "utf-8")
    rig = read_rig(source).with_ends_of(read_rig(source, (50, 50)), None)
    write_on_rig(tmp_path / "out.bvh", between(stepping(), 50, 30), rig)
    tail = local_turns(PlainBvh(tmp_path / "out.bvh"), "a tail")
    assert degrees_between(tail, local_turns(PlainBvh(source), "a tail")[50]) < PRINTED_DEG
    np.testing.assert_allclose(PlainBvh(tmp_path / "out.bvh").values[0], PlainBvh(source).values[50], atol=1e-5)


def test_a_known_end_is_exact_wherever_the_movement_ends(tmp_path: Path) -> None:
    source = write_plain(tmp_path / "in.bvh", with_tail(STANDING))
    moves = between(stepping(), 50, 80)
    moves = replace(moves, root=moves.root + np.array([0.3, 0.2, -0.1]))
    for known, at in (((read_rig(source, (30, 30)), None), 0), ((None, read_rig(source, (30, 30))), -1)):
        write_on_rig(tmp_path / "out.bvh", moves, read_rig(source).with_ends_of(*known))
        (turns, places), (wanted_turns, wanted) = (
            PlainBvh(tmp_path / "out.bvh").world([at]),
            PlainBvh(source).world([30]),
        )
        assert degrees_between(turns, wanted_turns) < PRINTED_DEG
        np.testing.assert_allclose(places, wanted, atol=1e-4)


# --- ends in other files --------------------------------------------------------------------------------------------


def test_each_end_is_in_a_file_of_its_own(tmp_path: Path) -> None:
    """The files have other orders of rotations and units; the first one's are written."""
    one = write_plain(tmp_path / "one.bvh", STANDING)
    other = write_plain(tmp_path / "other.bvh", STANDING, order=lambda _: "XYZ", per_metre=1.0, moving=lambda _: True)
    first, last = read_rig(one, (10, 10)), read_rig(other, (77, 77))
    assert first.is_like(last)
    moved = between(stepping(), 10, 77)
    for rig, source, scale in ((first, one, 1.0), (last, other, 0.01)):
        write_on_rig(tmp_path / "out.bvh", moved, rig.with_ends_of(first, last))
        result = PlainBvh(tmp_path / "out.bvh")
        assert result.hierarchy == PlainBvh(source).hierarchy
        (turns, places), (wanted_turns, wanted) = PlainBvh(one).world([10, 77]), result.world([0, -1])
        assert degrees_between(turns, wanted_turns) < PRINTED_DEG
        np.testing.assert_allclose(scale * places, wanted, atol=1e-4 * scale)
        assert result.jumps() < 180.0


@pytest.mark.parametrize(
    "change",
    [
        lambda body: replace(body, offsets=1.1 * body.offsets),
        lambda body: replace(body, names=tuple(f"{name}_" for name in body.names)),
        lambda body: replace(body, parents=(-1, *([0] * (len(body) - 1)))),
    ],
)
def test_other_bones_are_another_rig(change: Callable[[Skeleton], Skeleton], tmp_path: Path) -> None:
    one = write_plain(tmp_path / "one.bvh", STANDING)
    other = write_plain(tmp_path / "other.bvh", replace(STANDING, skeleton=change(STANDING.skeleton)))
    first, last = read_rig(one, (10, 10)), read_rig(other, (77, 77), unit="cm")
    assert not first.is_like(last)
    assert first.with_ends_of(first, last).armature.is_known == (True, False)


# --- other bodies ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [0.6, 1.3])
@pytest.mark.parametrize("known", [(), (1,)])
def test_other_people_stand_on_the_same_floor(size: float, known: tuple[int, ...], tmp_path: Path) -> None:
    body = STANDING.skeleton
    scaled = replace(body, offsets=size * body.offsets, tips=size * body.tips)
    source = write_plain(tmp_path / "in.bvh", replace(STANDING, skeleton=scaled, root=size * STANDING.root))
    rig = read_rig(source, unit="cm")
    if known:
        rig = rig.with_ends_of(None, read_rig(source, (119, 119), unit="cm"))
    write_on_rig(tmp_path / "out.bvh", stepping(), rig)
    found = own_skeleton(read_motion(tmp_path / "out.bvh", unit="cm"))
    lows = found.skeleton.positions_and_tips(found.rotations, found.root)[..., 1].min(axis=1)
    assert np.abs(lows).max() < 0.02
    np.testing.assert_allclose(np.ptp(found.root, axis=0), size * np.ptp(stepping().root, axis=0), atol=0.03)


def test_a_body_with_more_joints_is_brought_to_human23_first(tmp_path: Path) -> None:
    dancer = human44()
    turns = np.tile(rot.IDENTITY, (5, len(dancer), 1))
    turns[:, dancer.index("left_knee")] = rot.from_axis_angle([1.0, 0.0, 0.0], np.linspace(0.0, 1.0, 5))
    motion = Motion(dancer, turns, np.tile([0.0, 0.9, 0.0], (5, 1)), np.arange(5) / 30.0)
    rig = read_rig(write_plain(tmp_path / "in.bvh", STANDING))
    found = own_skeleton(retarget_to_rig(motion, rig))
    wanted = own_skeleton(motion, {name: name for name in BODY.names if name in dancer.names})
    assert np.degrees(rot.angle(found.rotations, wanted.rotations)).max() < 1e-3


def test_a_body_that_is_no_person_is_refused(tmp_path: Path) -> None:
    rig = read_rig(write_plain(tmp_path / "in.bvh", STANDING))
    worm = Skeleton("worm", ("head", "tail"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.1]]))
    moves = Motion(worm, np.tile(rot.IDENTITY, (3, 2, 1)), np.zeros((3, 3)), np.arange(3) / 30.0)
    with pytest.raises(SkeletonError, match="the joints of worm do not map to human23"):
        retarget_to_rig(moves, rig)
    for part in ("worm", "person"):  # a rig of no person, for a person
        write_plain(tmp_path / f"{part}.bvh", moves if part == "worm" else STANDING)
    with pytest.raises(SkeletonError, match="the joints of worm do not map to human23"):
        retarget_to_rig(stepping(), read_rig(tmp_path / "worm.bvh"))


def test_a_body_that_is_no_person_moves_on_its_own_rig(tmp_path: Path) -> None:
    worm = Skeleton("worm", ("head", "tail"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.1]]))
    turns = rot.normalise(np.random.default_rng(5).normal(size=(9, 2, 4)))
    moves = Motion(worm, turns, np.random.default_rng(6).normal(size=(9, 3)), np.arange(9) / 30.0)
    found = tween(write_plain(tmp_path / "in.bvh", moves, order=lambda _: "YZX"), (2, 7))
    found.check_ends()
    found.check_turns({"head": "head", "tail": "tail"})


# --- the file -------------------------------------------------------------------------------------------------------


def test_frames_that_the_engine_made_are_marked(tmp_path: Path) -> None:
    source = write_plain(tmp_path / "in.bvh", STANDING)
    moved = between(stepping(), 10, 77)
    write_on_rig(
        tmp_path / "out.bvh", replace(moved, insertions=(Insertion(moved.times[[0, -1]]),)), read_rig(source, (10, 77))
    )
    assert has_inserted_frames(tmp_path / "out.bvh")
    assert PlainBvh(tmp_path / "out.bvh").step == pytest.approx(1.0 / 30.0)


def test_uneven_times_are_refused_and_nothing_is_written(tmp_path: Path) -> None:
    moved = between(stepping(), 10, 77)
    uneven = replace(moved, times=moved.times**1.5)
    with pytest.raises(MotionMindError, match="even"):
        write_on_rig(tmp_path / "out.bvh", uneven, read_rig(write_plain(tmp_path / "in.bvh", STANDING)))
    assert not (tmp_path / "out.bvh").exists()


def test_other_files_have_no_rig(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("{}", "utf-8")
    with pytest.raises(FormatError, match=re.escape("it must end in one of .bvh, .glb, .gltf, .vrm")):
        read_rig(tmp_path / "a.json")


def test_what_a_rig_does_not_show_is_said_once_and_only_where_its_frames_are_no_ends(tmp_path: Path) -> None:
    source = write_plain(tmp_path / "in.bvh", disguise(stroll(0.0), MIXAMO, {}, along_bones("x", 0.0)))
    with pytest.warns(MotionMindWarning, match="it does not stand") as said:
        read_rig(source)
    assert len(said) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error", MotionMindWarning)
        read_rig(source, (1, 2))
