"""Onto human23 from other rigs: laws on disguised movement, and what knees, feet and walks look like in recordings."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from program_rigs import (
    BODY,
    BY_LIMBS,
    EXPORTS,
    LIMB_JOINTS,
    PLAN,
    SIDES,
    about,
    along_bones,
    dance,
    disguise,
    export,
    exported,
    lacking,
    rig_names,
    same_movement,
    spread,
    stroll,
    with_still,
)

from motionmind._typing import Floats
from motionmind.body.human import human23, human44
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning, SkeletonError
from motionmind.formats.asf_amc import read_amc
from motionmind.formats.bvh import read_bvh, write_bvh
from motionmind.geometry import rotations as rot
from motionmind.retarget.armature import from_human23
from motionmind.retarget.joint_mapping import known_rig
from motionmind.retarget.retarget import (
    filled_joints,
    joint_mapping,
    own_skeleton,
    read_joint_mapping,
    to_human23,
)
from motionmind.retarget.rig import plain_names, spine_shares, without_endings
from motionmind.retarget.rigs import RIGS
from motionmind.retarget.vertical import to_y_up

# --- laws ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rig", ["Mixamo", "Biovision"])
@pytest.mark.parametrize(("legs", "arms"), [(0.0, 0.0), (20.0, 45.0), (5.0, 88.0)])
def test_a_zero_pose_that_stands_is_seen_through(rig: str, legs: float, arms: float) -> None:
    source = disguise(dance(), rig_names(rig), spread(legs, arms))
    found = to_human23(source)
    without = ("fingers",) if rig == "Biovision" else ()
    same_movement(found, dance(), without)
    np.testing.assert_allclose(found.skeleton.offsets, BODY.offsets, atol=1e-12)
    np.testing.assert_allclose(found.skeleton.tips, BODY.tips, atol=1e-12)
    (planned,) = found.insertions
    np.testing.assert_array_equal(planned.times, PLAN[0].times)
    assert planned.bridged == PLAN[0].bridged
    assert found.name == source.name


@pytest.mark.parametrize("rig", ["Mixamo", "Biovision"])
def test_movement_goes_back_to_the_rig_that_it_came_from(rig: str) -> None:
    there = disguise(dance(), rig_names(rig), spread())
    back = from_human23(to_human23(there, up="y"), there.posture(0))
    assert back.skeleton is there.skeleton
    assert np.max(rot.angle(back.rotations, there.rotations)) < 1e-7
    np.testing.assert_allclose(back.root, there.root, atol=1e-12)


def test_joints_that_human23_lacks_stay_as_in_the_posture_given() -> None:
    there = with_leaf(disguise(dance(), rig_names("Mixamo"), spread()), "a tail")
    bent = there.rotations[3].copy()
    bent[-1] = about("z", 30.0)
    like = Posture(there.skeleton, bent, there.root[3])
    back = from_human23(to_human23(there, up="y"), like)
    tail = there.skeleton.index("a tail")
    np.testing.assert_allclose(back.rotations[:, tail], np.tile(like.rotations[tail], (len(there), 1)), atol=1e-12)


@pytest.mark.parametrize("rig", ["CMU, BVH", "CMU, ASF"])
def test_elbows_and_necks_of_cmu(rig: str) -> None:
    # A neck that goes straight up, so that its slope in the zero pose is that of the pose alone.
    offsets = BODY.offsets.copy()
    offsets[BODY.index("atlantal")] = [0.0, 0.1, 0.0]
    body = Skeleton(BODY.name, BODY.names, BODY.parents, offsets, BODY.tips)
    wanted = Motion(body, dance().rotations, dance().root, dance().times)
    # Before they are turned to where CMU's hinges are, upper arm and forearm are twisted by 30 degrees; not the hand.
    roll = {f"{side}_shoulder": rot.mul(about("z", -sign * 40.0), about("x", -30.0)) for side, sign in SIDES}
    roll |= {f"{side}_wrist": about("x", 30.0) for side, _ in SIDES}
    names = rig_names(rig)
    if rig == "CMU, BVH":
        wanted_mark = "LHipJoint"
        source = disguise(wanted, names, spread() | roll | {"cervical": about("x", -22.0)})
        assert to_rig(source.skeleton) == "Mixamo"  # not CMU's by these names alone
        source = with_leaf(source, wanted_mark)
    else:
        source = disguise(wanted, names, spread() | roll | {"cervical": about("x", -22.0)})
    assert to_rig(source.skeleton) == rig
    same_movement(to_human23(source), wanted)


def test_elbows_of_poser_are_those_of_cmu() -> None:
    roll = {f"{side}_shoulder": rot.mul(about("z", -sign * 40.0), about("x", -30.0)) for side, sign in SIDES}
    roll |= {f"{side}_wrist": about("x", 30.0) for side, _ in SIDES}
    source = disguise(dance(), rig_names("Poser"), spread() | roll)
    assert to_rig(source.skeleton) == "Poser"
    same_movement(to_human23(source), dance())


def test_frames_of_bandai() -> None:
    rig = next(rig for rig in RIGS if rig.name == "Bandai-Namco")
    names = rig_names("Bandai-Namco")
    source = disguise(dance(), names, {}, {name: rig.frames[name] for name in names})
    # As in the files: in its own frame a limb's bone lies along x, to the right along -x.
    for joint, along in (("Hand_R", -1.0), ("Foot_L", 1.0), ("Foot_R", -1.0)):
        bone = source.skeleton.offsets[source.skeleton.index(joint)]
        np.testing.assert_allclose(bone / np.linalg.norm(bone), [along, 0.0, 0.0], atol=1e-12)
    found = to_human23(source)
    same_movement(found, dance(), ("fingers",))
    np.testing.assert_allclose(found.skeleton.offsets, BODY.offsets, atol=1e-12)
    np.testing.assert_allclose(found.skeleton.tips, BODY.tips, atol=1e-12)  # toes lie otherwise than ankles


def test_names_of_bandai_on_a_zero_pose_that_stands() -> None:
    source = disguise(dance(), rig_names("Bandai-Namco"), spread())
    same_movement(to_human23(source), dance(), ("fingers",))


def test_z_up_is_seen_and_can_be_said() -> None:
    # z up, facing -y, as Blender has it.
    source = disguise(dance(), rig_names("Mixamo"), spread(), world=about("x", 90.0))
    same_movement(to_human23(source), dance())
    same_movement(to_human23(source, up="z"), dance())
    assert np.ptp(to_human23(source, up="y").root[:, 2]) == pytest.approx(np.ptp(dance().root[:, 1]))
    with pytest.raises(MotionMindError, match='"y" or "z", not \'x\''):
        to_human23(source, up="x")


@pytest.mark.parametrize("ending", ["_jnt", ".001", "#2", "_01", "_{}"])
def test_endings_that_exporters_add_do_not_count(ending: str) -> None:
    names = {joint: name + ending.format(i) for i, (joint, name) in enumerate(rig_names("Mixamo").items())}
    same_movement(to_human23(disguise(dance(), names, spread())), dance())
    assert without_endings(["Bone_1", "Bone_2"]) is None
    assert without_endings(["Hips", "Spine_01"]) is None


def standing(body: Skeleton = BODY) -> Motion:
    """Movement of a body that stands on a floor at 0."""
    rng = np.random.default_rng(5)
    turns = rot.exp(0.1 * rng.standard_normal((12, len(body), 3)))
    low = body.positions_and_tips(turns, np.zeros((12, 3)))[..., 1].min(axis=1)
    root = np.stack([np.linspace(0.0, 2.0, 12), -low, 0.0 * low], axis=1)
    return Motion(body, turns, root, np.arange(12) / 30.0)


def root_turned(motion: Motion, degrees: float = 90.0) -> Motion:
    """The movement in a world with z up, its zero pose as it was."""
    rotations = motion.rotations.copy()
    rotations[:, 0] = rot.mul(about("x", degrees), rotations[:, 0])
    root = rot.mul_vec(about("x", degrees), motion.root)
    return Motion(motion.skeleton, rotations, root, motion.times, motion.name)


@pytest.mark.parametrize("rig", ["Mixamo", "Biovision", "CMU, ASF", "Poser", "Bandai-Namco"])
def test_z_up_in_the_movement_but_not_in_the_zero_pose(rig: str) -> None:
    frames = next(one for one in RIGS if one.name == rig).frames
    names = rig_names(rig)
    source = disguise(standing(), names, {} if frames else spread(), {n: frames[n] for n in names} if frames else None)
    upright, turned = to_human23(source), to_human23(root_turned(source))
    np.testing.assert_allclose(turned.rotations, upright.rotations, atol=1e-9)
    np.testing.assert_allclose(turned.root, upright.root, atol=1e-9)
    np.testing.assert_allclose(np.ptp(turned.skeleton.positions(turned.rotations, turned.root)[..., 1]), 1.6, atol=0.2)


def test_z_up_in_the_movement_on_a_floor_that_is_not_at_0() -> None:
    source = disguise(standing(), rig_names("Mixamo"), spread())
    turned = root_turned(source)
    for height in (-0.9, 0.4, 2.0):
        there = replace(turned, root=turned.root + np.array([0.3, 0.1, height]))
        found = to_human23(there)
        np.testing.assert_allclose(found.rotations, to_human23(source).rotations, atol=1e-9)
        np.testing.assert_allclose(
            found.root - to_human23(source).root, np.tile([0.3, height, -0.1], (12, 1)), atol=1e-9
        )


def lying(limbs: float = 0.3) -> Motion:
    """On its back, its head along +z, in the middle of a room: its limbs move, and its lowest point is on the floor."""
    rng = np.random.default_rng(6)
    turns = rot.exp(limbs * rng.standard_normal((12, 23, 3)))
    turns[:, 0] = about("x", 90.0)
    low = BODY.positions_and_tips(turns, np.zeros((12, 3)))[..., 1].min(axis=1)
    return Motion(BODY, turns, np.stack([0.0 * low, -low, 0.0 * low + 3.0], axis=1), np.arange(12) / 30.0, "rest")


def test_a_body_that_lies_is_not_to_y_up() -> None:
    source = disguise(lying(), rig_names("Mixamo"), spread())
    found = to_human23(source)
    np.testing.assert_allclose(found.root, source.root, atol=1e-9)
    assert np.ptp(found.positions()[..., 1]) < 1.3


def test_who_lies_still_or_stands_is_asked_of_the_user() -> None:
    """Nothing moves, and it begins at 0 along both axes: who knows."""
    still = lying(0.0)
    low = still.skeleton.positions_and_tips(still.rotations, still.root)[..., 2].min()
    source = disguise(replace(still, root=still.root - [0.0, 0.0, low]), rig_names("Mixamo"), spread())
    with pytest.warns(
        MotionMindWarning, match=r"x: taken with z up, which is doubtful: .*; choose with --up y or --up z"
    ):
        to_human23(source)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_allclose(to_human23(source, up="y").root, source.root, atol=1e-9)
        np.testing.assert_allclose(own_skeleton(source, up="y").root, source.root, atol=1e-9)


def test_people_who_stand_along_x_are_told() -> None:
    source = disguise(standing(), rig_names("Mixamo"), spread())
    turn = about("z", -90.0)
    rotations = source.rotations.copy()
    rotations[:, 0] = rot.mul(turn, rotations[:, 0])
    with pytest.warns(MotionMindWarning, match="people stand along x, but only y or z can be up"):
        to_human23(replace(source, rotations=rotations, root=rot.mul_vec(turn, source.root)))


@pytest.mark.parametrize("body", [human23(), human44()], ids=["human23", "human44"])
def test_our_own_bodies_with_z_up_zero_pose_and_all(body: Skeleton, tmp_path: Path) -> None:
    """As Blender writes what it has read."""
    wanted = standing(body)
    there = about("x", 90.0)
    skeleton = Skeleton(
        body.name, body.names, body.parents, rot.mul_vec(there, body.offsets), rot.mul_vec(there, body.tips)
    )
    rotations = rot.mul_inv(rot.mul(there, wanted.rotations), there)
    source = Motion(skeleton, rotations, rot.mul_vec(there, wanted.root), wanted.times)
    for unit in ("cm", "m"):
        write_bvh(tmp_path / "z.bvh", source, unit)
        found = own_skeleton(read_bvh(tmp_path / "z.bvh"))
        assert found.skeleton.difference(body) is None
        assert found.skeleton.height == pytest.approx(body.height, abs=1e-6)
        assert np.max(rot.angle(found.rotations, wanted.rotations)) < 1e-5
        np.testing.assert_allclose(found.root, wanted.root, atol=1e-6)
    stood = to_y_up(source)  # as reading it with z up does
    assert np.max(rot.angle(own_skeleton(stood, up="y").rotations, wanted.rotations)) < 1e-5
    np.testing.assert_allclose(own_skeleton(stood, up="y").root, wanted.root, atol=1e-9)
    lying = root_turned(wanted)
    assert own_skeleton(lying) is lying  # what we write has y up


def test_z_up_in_the_zero_pose_but_not_in_the_movement() -> None:
    # The zero pose lies on its back, but the root's rotation stands it up: y is up all the same.
    lying = disguise(dance(), rig_names("Mixamo"), spread(), world=about("x", 90.0))
    rotations = lying.rotations.copy()
    rotations[:, 0] = rot.mul(about("x", -90.0), rotations[:, 0])
    source = Motion(lying.skeleton, rotations, dance().root, lying.times)
    same_movement(to_human23(source), dance())


@pytest.mark.parametrize("turn", [0.0, 90.0, 180.0, 33.0, 10.0, -20.0, 65.0])
def test_a_zero_pose_may_face_anywhere(turn: float) -> None:
    source = disguise(dance(), rig_names("Mixamo"), spread(pelvis=about("y", turn)))
    same_movement(to_human23(source), dance())


def test_a_zero_pose_that_leans_and_faces_elsewhere_is_taken_as_upright() -> None:
    turn = about("y", 20.0)
    lean = rot.mul(rot.mul(turn, about("x", 8.0)), rot.inv(turn))
    spine = {"pelvis": turn, "lumbar": rot.mul(rot.mul(rot.inv(turn), lean), turn)}
    source = disguise(dance(), rig_names("Mixamo"), spread() | spine)
    at_zero = Motion(source.skeleton, np.tile(rot.IDENTITY, (1, 23, 1)), np.zeros((1, 3)), np.zeros(1))
    np.testing.assert_allclose(rot.angle(to_human23(at_zero).rotations[0, 0], turn), 0.0, atol=1e-3)


def test_a_zero_pose_that_leans_a_little_is_taken_as_upright() -> None:
    source = disguise(dance(), rig_names("Mixamo"), spread(lumbar=about("x", 4.0)))
    at_zero = Motion(source.skeleton, np.tile(rot.IDENTITY, (1, 23, 1)), np.zeros((1, 3)), np.zeros(1))
    found = to_human23(at_zero)
    trunk = [BODY.index(name) for name in ("pelvis", "lumbar", "thorax", "cervical", "atlantal", "left_clavicle")]
    assert np.max(rot.angle(found.rotations[0, trunk], rot.IDENTITY)) < 1e-7


def test_feet_turned_out_in_the_zero_pose() -> None:
    out = {f"{side}_ankle": about("y", sign * 20.0) for side, sign in SIDES}
    same_movement(to_human23(disguise(dance(), rig_names("Mixamo"), spread() | out)), dance())


def test_the_height_of_an_instep_is_no_posture() -> None:
    offsets = BODY.offsets.copy()
    for side, _ in SIDES:
        offsets[BODY.index(f"{side}_toes")] = [0.0, -0.12, 0.12]
    high = Skeleton("high", BODY.names, BODY.parents, offsets, BODY.tips)
    source = disguise(Motion(high, dance().rotations, dance().root, dance().times), rig_names("Mixamo"), spread())
    same_movement(to_human23(source), dance())


def test_a_foot_that_hangs_down_in_the_zero_pose() -> None:
    pointed = {f"{side}_ankle": about("x", 60.0) for side, _ in SIDES}
    same_movement(to_human23(disguise(dance(), rig_names("Mixamo"), spread() | pointed)), dance())


def test_a_posture_is_brought_over_as_a_motion_is() -> None:
    source = disguise(dance(), rig_names("Mixamo"), spread())
    found = to_human23(source.posture(3))
    assert np.max(rot.angle(found.rotations, dance().rotations[3])) < 1e-7


def test_human23_is_returned_as_it_is() -> None:
    assert to_human23(dance()) is dance()
    posture = dance().posture(0)
    assert to_human23(posture) is posture


def test_human23_in_another_order_is_put_in_order() -> None:
    order = [0, *range(9, 23), *range(1, 9)]
    skeleton = Skeleton(
        "from a file",
        tuple(BODY.names[i] for i in order),
        tuple(order.index(BODY.parents[i]) if i else -1 for i in order),
        BODY.offsets[order],
        BODY.tips[order],
    )
    same_movement(to_human23(Motion(skeleton, dance().rotations[:, order], dance().root, dance().times)), dance())


def test_a_row_in_the_spine_ends_where_it_ended_and_turns_the_chest_as_its_last_joint() -> None:
    source = disguise(dance(), rig_names("Mixamo"), spread())
    # The spine's upper joint is halved: half of its rotation where it was, half of it 10 cm above.
    at = source.skeleton.index("mixamorig:Spine1")
    skeleton = source.skeleton
    parents = [p + (p >= at) if p != at else at + 1 for p in skeleton.parents]
    split = Skeleton(
        "split",
        (*skeleton.names[: at + 1], "mixamorig:Spine2", *skeleton.names[at + 1 :]),
        (*parents[: at + 1], at, *parents[at + 1 :]),
        np.insert(skeleton.offsets, at + 1, [0.0, 0.1, 0.0], axis=0),
        np.insert(skeleton.tips, at + 1, 0.0, axis=0),
    )
    half = rot.exp(0.5 * rot.log(source.rotations[:, at]))
    rotations = np.insert(source.rotations, at + 1, half, axis=1)
    rotations[:, at] = half
    motion = Motion(split, rotations, source.root, source.times)
    mapping = joint_mapping(split)
    assert mapping is not None
    assert [mapping[f"mixamorig:Spine{n}"] for n in ("", "1", "2")] == ["lumbar", "lumbar", "thorax"]
    found = to_human23(motion)
    theirs = split.global_rotations(rotations)[:, split.index("mixamorig:Spine2")]
    ours = found.skeleton.global_rotations(found.rotations)
    assert np.max(rot.angle(ours[:, BODY.index("thorax")], theirs)) < 1e-7
    there = split.positions(rotations, source.root)
    here = found.skeleton.positions(found.rotations, found.root)
    lumbar, thorax = BODY.index("lumbar"), BODY.index("thorax")
    np.testing.assert_allclose(here[:, lumbar], there[:, split.index("mixamorig:Spine")], atol=1e-9)
    # What a bent row is shorter by than a straight bone is all that the chest is off, along that bone.
    bone, row = here[:, thorax] - here[:, lumbar], there[:, split.index("mixamorig:Spine2")] - here[:, lumbar]
    straight = np.linalg.norm(bone, axis=-1)
    np.testing.assert_allclose(np.sum(bone * row, axis=-1), straight * np.linalg.norm(row, axis=-1), atol=1e-9)
    off = np.linalg.norm(here[:, BODY.index("left_wrist")] - there[:, split.index("mixamorig:LeftHand")], axis=-1)
    np.testing.assert_allclose(off, straight - np.linalg.norm(row, axis=-1), atol=1e-9)
    # The arms hang as they hung.
    for joint in ("left_wrist", "right_shoulder"):
        i = BODY.index(joint)
        assert np.max(rot.angle(ours[:, i], BODY.global_rotations(dance().rotations)[:, i])) < 1e-7


@pytest.mark.parametrize("lacking", ["lumbar", "thorax", "atlantal", "left_clavicle", "left_toes"])
def test_what_is_lacking_goes_along_with_what_it_hangs_from(lacking: str) -> None:
    # Movement in which the joint does not turn is told rightly without it.
    rotations = dance().rotations.copy()
    rotations[:, BODY.index(lacking)] = rot.IDENTITY
    still = Motion(BODY, rotations, dance().root, dance().times)
    source = disguise(still, {name: f"j_{name}" for name in BODY.names}, spread())
    mapping = {f"j_{name}": name for name in BODY.names if name != lacking}
    found = to_human23(source, mapping)
    same_movement(found, still)
    np.testing.assert_allclose(found.skeleton.offsets, BODY.offsets, atol=1e-9)
    known = joint_mapping(source.skeleton, mapping)
    assert known is not None
    assert filled_joints(known) == [lacking]


def test_a_body_half_as_large_keeps_its_size() -> None:
    small = Skeleton("small", BODY.names, BODY.parents, 0.5 * BODY.offsets, 0.5 * BODY.tips)
    motion = Motion(small, dance().rotations, dance().root, dance().times)
    found = to_human23(disguise(motion, rig_names("Biovision"), spread()))
    np.testing.assert_allclose(found.skeleton.offsets, small.offsets, atol=1e-12)  # the fingers' too
    assert found.skeleton.height == pytest.approx(small.height)


# --- zero poses that do not stand ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("axis", "roll", "world"),
    [("x", 0.0, ()), ("y", 0.0, ()), ("-x", 90.0, ()), ("y", 37.0, ()), ("x", 0.0, ("pelvis",)), ("x", 180.0, ())],
)
@pytest.mark.parametrize("rig", ["Mixamo", "Biovision"])
def test_a_zero_pose_along_its_bones_is_seen_through(rig: str, axis: str, roll: float, world: tuple[str, ...]) -> None:
    source = disguise(stroll(), rig_names(rig), {}, along_bones(axis, roll, world))
    found = to_human23(source)
    off = np.degrees(
        np.median(rot.angle(*(m.skeleton.global_rotations(m.rotations) for m in (found, stroll()))), axis=0)
    )
    hands = [i for i, name in enumerate(BODY.names) if name.endswith(("wrist", "fingers"))]
    assert np.max(np.delete(off, hands)) < 10.0
    assert np.max(off[hands]) < 25.0  # nothing but habit tells how a hand is turned
    kept = [i for i, name in enumerate(BODY.names) if not name.endswith("fingers")]
    here = found.skeleton.positions(found.rotations, found.root)
    np.testing.assert_allclose(here[:, kept], BODY.positions(stroll().rotations, stroll().root)[:, kept], atol=1e-9)
    back = from_human23(found, source.posture(0)) if rig == "Mixamo" and not world else None
    assert back is None or back.skeleton is source.skeleton


def test_limbs_that_hardly_bend_do_not_show_how_they_are_turned() -> None:
    source = disguise(stroll(0.0), rig_names("Mixamo"), {}, along_bones("x", 0.0))
    with pytest.warns(
        MotionMindWarning, match="it does not stand, and left_hip, left_knee.* bend too little to show their twist"
    ):
        to_human23(source)


def test_what_is_unclear_is_said_once(run: Run) -> None:
    write_bvh(Path("in.bvh"), disguise(stroll(0.0), rig_names("Mixamo"), {}, along_bones("x", 0.0)))
    ran = run("convert", "in.bvh", "out.json", "--skeleton", "human23")
    assert ran.code == 0
    assert ran.err.count("it does not stand") == 1
    assert "it does not stand" not in run("convert", "in.bvh", "out.json").err


def test_left_and_right_exchanged_in_a_zero_pose_along_its_bones() -> None:
    names = {name: f"j_{name}" for name in BODY.names}
    source = disguise(stroll(), names, {}, along_bones("x", 0.0))
    swap = {"left": "right", "right": "left"}
    mapping = {f"j_{name}": re.sub("left|right", lambda m: swap[m[0]], name) for name in BODY.names}
    with pytest.raises(SkeletonError, match="left_knee bends forwards; are left and right swapped"):
        to_human23(source, mapping)


# --- what programs export ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("arms", [0.0, 50.0])
@pytest.mark.parametrize("rig", EXPORTS)
def test_what_programs_export(rig: str, arms: float) -> None:
    without = lacking(rig)
    moved = with_still(dance(), without)
    source = exported(moved, rig, spread(5.0 if arms else 0.0, arms))
    known = known_rig(source.skeleton)
    assert known is not None
    assert rig.startswith(known[0].name) or (rig in BY_LIMBS and known[0].name == "names of limbs")
    assert known[1] == {name: joint for name, _, joint in export(rig) if joint}
    found = to_human23(source)
    same_movement(found, moved, without)
    strays = rot.norm(
        found.skeleton.positions(found.rotations, found.root) - BODY.positions(moved.rotations, moved.root)
    )
    legs = [i for i, name in enumerate(BODY.names) if name.endswith(("pelvis", "hip", "knee", "ankle"))]
    kept = [i for i, name in enumerate(BODY.names) if not name.endswith(without or "-")]
    assert strays[:, legs].max() < 1e-9
    # In MikuMikuDance the trunk hangs from what the pelvis hangs from: its place there does not turn with the pelvis.
    first = BODY.offsets[BODY.index("lumbar" if "lumbar" in known[1].values() else "thorax")]
    waist = 2.0 * np.linalg.norm(first) if rig.startswith("MikuMikuDance") else 0.0
    assert strays[:, kept].max() < waist + 1e-9
    back = from_human23(found, source.posture(0))
    own = [source.skeleton.index(name) for name in known[1]]
    places = [one.skeleton.positions(one.rotations, one.root)[:, own] for one in (back, source)]
    assert rot.norm(places[0] - places[1]).max() < waist + 1e-9


@pytest.mark.parametrize("rig", BY_LIMBS)
def test_a_bundled_dance_on_a_rig_that_is_known_by_its_limbs_comes_back_from_bvh(rig: str, tmp_path: Path) -> None:
    clip = ballet_clip("adagio")
    without = lacking(rig)
    moved = with_still(clip, without)
    write_bvh(tmp_path / "clip.bvh", exported(moved.resample(10.0), rig, spread()))
    with warnings.catch_warnings():
        warnings.simplefilter("error", MotionMindWarning)
        found = to_human23(read_bvh(tmp_path / "clip.bvh"))
    wanted = moved.resample(10.0)
    kept = [i for i, name in enumerate(BODY.names) if not name.endswith(without or "-")]
    assert np.degrees(rot.angle(found.rotations[:, kept], wanted.rotations[:, kept]).max()) < 0.01
    np.testing.assert_allclose(found.root, wanted.root, atol=1e-4)


# --- names and mappings --------------------------------------------------------------------------------------------


def to_rig(skeleton: Skeleton) -> str | None:
    known = known_rig(skeleton)
    return None if known is None else known[0].name


def with_leaf(motion: Motion, name: str) -> Motion:
    """The motion with one more joint that stands still on the root."""
    skeleton = motion.skeleton
    more = Skeleton(
        skeleton.name,
        (*skeleton.names, name),
        (*skeleton.parents, 0),
        np.concatenate([skeleton.offsets, np.zeros((1, 3))]),
        np.concatenate([skeleton.tips, np.zeros((1, 3))]),
    )
    still = np.tile(rot.IDENTITY, (len(motion), 1, 1))
    return Motion(more, np.concatenate([motion.rotations, still], axis=1), motion.root, motion.times)


@pytest.mark.parametrize("prefix", ["", "mixamorig:", "mixamorig9:", "Character1_", "a|b:", "CHARACTER1_"])
def test_namespaces_do_not_count(prefix: str) -> None:
    names = {joint: prefix + name.removeprefix("mixamorig:") for joint, name in rig_names("Mixamo").items()}
    source = disguise(dance(), names, spread())
    same_movement(to_human23(source), dance())
    assert joint_mapping(source.skeleton) == {name: joint for joint, name in names.items()}


def test_toes_of_lafan() -> None:
    names = {joint: name.removeprefix("mixamorig:") for joint, name in rig_names("Mixamo").items()}
    names |= {f"{side}_toes": f"{side.title()}Toe" for side, _ in SIDES}
    source = disguise(dance(), names, spread())
    assert to_rig(source.skeleton) == "Mixamo"
    same_movement(to_human23(source), dance())


def test_a_spine_of_two_in_rokokos_names() -> None:
    words = ("Thigh", "Shin", "Foot", "Toe", "Shoulder", "Arm", "ForeArm", "Hand", "Finger3Proximal")
    names = dict(
        zip(
            ("pelvis", "lumbar", "thorax", "cervical", "atlantal"),
            ["Hips", "Spine", "Spine4", "Neck", "Head"],
            strict=True,
        )
    )
    names |= {
        f"{side}_{j}": side.title() + word for side, _ in SIDES for j, word in zip(LIMB_JOINTS, words, strict=True)
    }
    source = disguise(dance(), names, spread())
    assert to_rig(source.skeleton) == "Rokoko"
    same_movement(to_human23(source), dance())


def test_case_does_not_count() -> None:
    names = {joint: name.upper() for joint, name in rig_names("Bandai-Namco").items()}
    source = disguise(dance(), names, spread())
    assert joint_mapping(source.skeleton) == {name: joint for joint, name in names.items()}


def test_plain_names() -> None:
    assert plain_names(["mixamorig:Hips", "mixamorig:LeftUpLeg"]) == ["hips", "leftupleg"]
    assert plain_names(["Bip_Hips", "Bip_Left_Leg"]) == ["hips", "leftleg"]
    assert plain_names(["Upper_Leg", "Upper_Arm"]) == ["leg", "arm"]
    assert plain_names(["Hips"]) == ["hips"]
    assert plain_names(["Bip01", "Bip01 Pelvis", "Bip01 L Thigh"]) == ["bip01", "pelvis", "lthigh"]


def test_shares_of_a_spine() -> None:
    assert spine_shares([]) == {}
    assert spine_shares(["a"]) == {"a": "thorax"}
    assert spine_shares(["a", "b"]) == {"a": "lumbar", "b": "thorax"}
    assert spine_shares(["a", "b", "c"]) == {"a": "lumbar", "b": "lumbar", "c": "thorax"}
    assert list(spine_shares("abcd").values()) == ["lumbar", "lumbar", "thorax", "thorax"]


def test_an_insect_does_not_map() -> None:
    insect = Skeleton("insect", ("body", "leg1", "leg2"), (-1, 0, 0), np.eye(3))
    assert joint_mapping(insect) is None
    motion = Motion(insect, np.tile(rot.IDENTITY, (1, 3, 1)), np.zeros((1, 3)), np.zeros(1))
    with pytest.raises(SkeletonError, match="joints of insect do not map to human23: they have the names of no known"):
        to_human23(motion)


def test_a_rig_that_lacks_an_essential_joint_does_not_map() -> None:
    names = {joint: name for joint, name in rig_names("Mixamo").items() if joint not in ("left_wrist", "left_fingers")}
    source = disguise(dance(), names, spread())
    assert joint_mapping(source.skeleton) is None
    with pytest.raises(SkeletonError, match=r"named as in Mixamo, they lack left_wrist; give a mapping \(--joints\)"):
        to_human23(source)


def test_a_rig_that_lacks_a_mark_does_not_map() -> None:
    bones = {name: joint for name, _, joint in export("DAZ Genesis 9")}
    names = {joint: name for name, joint in reversed(bones.items()) if joint} | {"pelvis": "hip"}
    assert to_rig(disguise(dance(), names, spread()).skeleton) == "names of limbs"
    del names["atlantal"]  # which its limbs' names ask for
    with pytest.raises(SkeletonError, match="named as in DAZ Genesis, they lack a joint called pelvis; give"):
        to_human23(disguise(dance(), names, spread()))


@pytest.fixture
def own() -> tuple[Motion, dict[str, str]]:
    """Movement on a rig that nobody knows, and its mapping."""
    names = {name: f"Bone.{i:03}" for i, name in enumerate(BODY.names)}
    return disguise(dance(), names, spread()), {name: joint for joint, name in names.items()}


def test_a_mapping_of_ones_own(own: tuple[Motion, dict[str, str]]) -> None:
    source, mapping = own
    assert joint_mapping(source.skeleton) is None
    assert joint_mapping(source.skeleton, mapping) == mapping
    same_movement(to_human23(source, mapping), dance())
    lower = {name.lower(): joint for name, joint in mapping.items()}
    assert joint_mapping(source.skeleton, lower) == mapping


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"Bone.002": "left_kne"}, "no joint 'left_kne' in human23; did you mean 'left_knee'?"),
        ({"Bone.002": "tail"}, "no joint 'tail' in human23; its joints are pelvis, left_hip"),
        ({"Bone.02x": "left_knee"}, "no joint 'Bone.02x' in file; did you mean 'Bone.02"),
        ({"Bone.002": "right_knee"}, "'Bone.002' and 'Bone.006' both map to right_knee"),
        ({"Bone.000": None, "Bone.002": None}, "the mapping onto human23 lacks pelvis, left_knee"),
        ({"Bone.009": None, "Bone.010": None}, "lacks lumbar or thorax"),
        ({"Bone.001": "left_knee", "Bone.002": "left_hip"}, "'Bone.002' maps to left_hip and 'Bone.001' to left_k"),
    ],
)
def test_mappings_with_faults(own: tuple[Motion, dict[str, str]], change: dict[str, str], message: str) -> None:
    source, mapping = own
    mapping = {name: joint for name, joint in (mapping | change).items() if joint is not None}
    with pytest.raises(SkeletonError, match=re.escape(message)):
        to_human23(source, mapping)


def test_left_and_right_exchanged(own: tuple[Motion, dict[str, str]]) -> None:
    source, mapping = own
    swap = {"left": "right", "right": "left"}
    exchanged = {name: re.sub("left|right", lambda m: swap[m[0]], joint) for name, joint in mapping.items()}
    with pytest.raises(SkeletonError, match="are left and right swapped"):
        to_human23(source, exchanged)


def test_a_zero_pose_all_in_one_place(own: tuple[Motion, dict[str, str]]) -> None:
    source, mapping = own
    flat = Skeleton("flat", source.skeleton.names, source.skeleton.parents, np.zeros((23, 3)))
    with pytest.raises(SkeletonError, match="flat: with all rotations 0, hips and shoulders do not show"):
        to_human23(Motion(flat, source.rotations, source.root, source.times), mapping)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("m.toml", 'Hips = "pelvis"\n"mixamorig:LeftLeg" = "left_knee"\n'),
        ("m.toml", '\ufeff[joints]\nHips = "pelvis"\n"mixamorig:LeftLeg" = "left_knee"\n'),
        ("m.json", '{"Hips": "pelvis", "mixamorig:LeftLeg": "left_knee"}'),
        ("m.JSON", '{"joints": {"Hips": "pelvis", "mixamorig:LeftLeg": "left_knee"}}'),
    ],
)
def test_mapping_files(tmp_path: Path, name: str, text: str) -> None:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    assert read_joint_mapping(path) == {"Hips": "pelvis", "mixamorig:LeftLeg": "left_knee"}


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("m.toml", 'Hips = "pelvsi"', "'Hips': no joint 'pelvsi' in human23; did you mean 'pelvis'?"),
        ("m.toml", "Hips = 3", "'Hips' must map to the name of a joint"),
        ("m.toml", 'leg.L = "left_hip"', "'leg' must map to the name of a joint of human23, as text (a name with"),
        ("m.toml", "Hips: pelvis", "not a joint mapping: "),
        ("m.toml", "", "not a joint mapping: it must hold"),
        ("m.json", '["Hips"]', "not a joint mapping: it must hold"),
        ("m.json", '{"Hips": ', "not a joint mapping: "),
        ("m.json", "[" * 100_000, "not a joint mapping: "),
    ],
)
def test_mapping_files_with_faults(tmp_path: Path, name: str, text: str, message: str) -> None:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FormatError, match=re.escape(f"{path}: {message}")):
        read_joint_mapping(path)


def test_mapping_files_that_are_not_there(tmp_path: Path) -> None:
    for path in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(FormatError, match="cannot be read"):
            read_joint_mapping(path)
    (tmp_path / "b.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FormatError, match="not a joint mapping"):
        read_joint_mapping(tmp_path / "b.toml")


# --- recorded movement ---------------------------------------------------------------------------------------------

CLIPS = (
    "cmu-05/05_01.bvh",
    "cmu-135/135_04.amc",
    "bandai/walk_normal_001.bvh",
    "bandai/kick_normal_001.bvh",
    "importer/test_freebvh.bvh",
    "indian/06.bvh",
)


@cache
def recorded(folder: Path, clip: str) -> tuple[Motion, Motion]:
    """A clip on its own skeleton and on human23, without CMU's added first frame."""
    path = folder / clip
    source = read_amc(path) if path.suffix == ".amc" else read_bvh(path)
    added = {"cmu-05": 1, "indian": 30}.get(path.parent.name, 0)  # frames of a T-pose, and from there
    source = source.slice(added, len(source))
    return source, to_human23(source)


def turns(motion: Motion, joint: str) -> Floats:
    """Rotation vectors [T, 3] of a joint in degrees."""
    return np.degrees(rot.log(motion.rotations[:, BODY.index(joint)]))


def strays(source: Motion, found: Motion) -> dict[str, Floats]:
    """How far joints stand from where they stood [T], in mm, by human23's names."""
    mapping = joint_mapping(source.skeleton)
    assert mapping is not None
    theirs = source.skeleton.positions(source.rotations, source.root)
    ours = found.skeleton.positions(found.rotations, found.root)
    first = {joint: source.skeleton.index(name) for name, joint in reversed(mapping.items())}
    return {
        joint: 1000.0 * np.linalg.norm(theirs[:, i] - ours[:, BODY.index(joint)], axis=-1) for joint, i in first.items()
    }


@pytest.mark.parametrize(
    ("clip", "arms", "head"),  # at most, mm; measured 0.4, 40 | 4, 31 | 0 | 0 | 0.4 | 0
    [*zip(CLIPS, (1.0, 6.0, 1e-3, 1e-3, 1.0, 1e-3), (42.0, 40.0, 1e-3, 1e-3, 1.0, 1e-3), strict=True)],
)
def test_joints_stand_where_they_stood(shared_data: Path, clip: str, arms: float, head: float) -> None:
    source, found = recorded(shared_data, clip)
    far = {joint: float(np.max(stray)) for joint, stray in strays(source, found).items()}
    for joint, stray in far.items():
        if joint.endswith(("pelvis", "hip", "knee", "ankle", "toes", "lumbar")):
            assert stray < 1e-3, joint
        elif joint in ("cervical", "atlantal"):
            assert stray < head, joint
        else:
            assert stray < arms, joint


@pytest.mark.parametrize("clip", CLIPS)
def test_knees_are_hinges_that_bend_backwards(shared_data: Path, clip: str) -> None:
    _, found = recorded(shared_data, clip)
    for side, _ in SIDES:
        knee = turns(found, f"{side}_knee")
        assert np.percentile(knee[:, 0], 95) > 35.0
        assert np.min(knee[:, 0]) > -5.0
        assert np.median(np.abs(knee[:, 1])) < 7.0  # Mixamo's knees are no strict hinges; all others give < 1
        assert np.median(np.abs(knee[:, 2])) < 5.0


@pytest.mark.parametrize("clip", CLIPS)
def test_elbows_are_hinges_that_bend_forwards(shared_data: Path, clip: str) -> None:
    _, found = recorded(shared_data, clip)
    for side, sign in SIDES:
        elbow = turns(found, f"{side}_elbow")
        assert np.median(-sign * elbow[:, 1]) > 10.0
        assert np.median(np.linalg.norm(elbow[:, [0, 2]], axis=-1)) < 20.0


@pytest.mark.parametrize("clip", CLIPS)
def test_feet_and_faces_look_ahead_and_soles_are_flat(shared_data: Path, clip: str) -> None:
    _, found = recorded(shared_data, clip)
    turned = BODY.global_rotations(found.rotations)
    ahead = rot.mul_vec(turned, np.broadcast_to([0.0, 0.0, 1.0], (*turned.shape[:-1], 3)))
    level = ahead * [1.0, 0.0, 1.0]
    for joint in ("thorax", "atlantal", "left_ankle", "right_ankle"):
        assert np.median(np.sum(level[:, 0] * level[:, BODY.index(joint)], axis=-1)) > 0.5, joint
    up = rot.mul_vec(turned, np.broadcast_to([0.0, 1.0, 0.0], (*turned.shape[:-1], 3)))
    for joint in ("pelvis", "thorax", "cervical", "atlantal"):
        assert np.median(up[:, BODY.index(joint), 1]) > 0.85, joint
    # While a foot carries the body (it hardly moves), its sole lies on the floor.
    positions = found.skeleton.positions(found.rotations, found.root)
    for side, _ in SIDES:
        feet = [BODY.index(f"{side}_ankle"), BODY.index(f"{side}_toes")]
        speed = np.linalg.norm(np.diff(positions[:, feet], axis=0), axis=-1).max(axis=-1) * found.fps
        planted = np.flatnonzero(speed < np.percentile(speed, 25))
        slope = np.degrees(np.arcsin(ahead[planted, feet[0], 1]))
        assert abs(np.median(slope)) < 13.0


@pytest.mark.parametrize("clip", ["cmu-05/05_01.bvh", "bandai/walk_normal_001.bvh"])
def test_walkers_walk_forwards_and_swing_alike(shared_data: Path, clip: str) -> None:
    _, found = recorded(shared_data, clip)
    way = found.root[-1] - found.root[0]
    ahead = rot.mul_vec(found.rotations[:, 0], np.array([0.0, 0.0, 1.0])).mean(axis=0)
    assert way @ ahead / np.linalg.norm(way) > 0.8
    for side, sign in SIDES:
        hip, knee = turns(found, f"{side}_hip")[:, 0], turns(found, f"{side}_knee")[:, 0]
        # Degrees: hips swing from 8 behind to 37 before the pelvis, knees bend between 4 and 66; each walker has
        # a way of their own, within 10 of these.
        np.testing.assert_allclose(np.percentile(hip, [5, 95]), [-35.0, 8.0], atol=10.0)
        np.testing.assert_allclose(np.percentile(knee, [5, 95]), [4.0, 65.0], atol=10.0)
        # The arms hang.
        assert np.median(-sign * turns(found, f"{side}_shoulder")[:, 2]) == pytest.approx(75.0, abs=15.0)
        assert np.max(np.abs(np.median(turns(found, f"{side}_ankle"), axis=0))) < 25.0
    for joint in ("lumbar", "thorax"):
        assert np.max(np.abs(np.median(turns(found, joint), axis=0))) < 12.0


def test_the_t_pose_that_was_added_to_cmu_is_near_human23s(shared_data: Path) -> None:
    first = to_human23(read_bvh(shared_data / "cmu-05" / "05_01.bvh").posture(0))
    degrees = dict(zip(BODY.names, np.degrees(rot.angle(first.rotations, rot.IDENTITY)), strict=True))
    for joint in ("pelvis", "hip", "knee", "ankle", "toes", "lumbar", "thorax", "clavicle", "fingers"):
        assert max(turn for name, turn in degrees.items() if name.endswith(joint)) < 1.1, joint
    assert max(degrees["cervical"], degrees["atlantal"]) < 20.0  # of its maker's own taste
    assert all(turn < 35.0 for turn in degrees.values())  # shoulders and wrists: 30 about the arm, by CMU's hinges


@pytest.mark.parametrize(
    ("clip", "rig", "lacking"),
    [
        ("cmu-05/05_01.bvh", "CMU, BVH", ()),
        ("cmu-135/135_04.amc", "CMU, ASF", ()),
        ("importer/test_freebvh.bvh", "Mixamo", ()),
        ("importer/dab.bvh", "Mixamo", ()),
        ("importer/bvh_test1.bvh", "Mixamo", ("fingers",)),
        ("importer/standard_skeleton.bvh", "Mixamo", ("fingers",)),
        ("importer/bvh_test2.bvh", "Biovision", ("fingers",)),
        ("importer/test_mocapbank.bvh", "Biovision", ("toes", "fingers")),
        ("importer/jumping_jacks.bvh", "Biovision", ()),
        ("importer/bvhio_example.bvh", "Biovision", ("toes", "lumbar", "fingers")),
        ("bandai/walk_normal_001.bvh", "Bandai-Namco", ("fingers",)),
        ("indian/15.bvh", "Poser", ("toes",)),
        ("importer/rotation_first_root.bvh", None, ()),
        ("importer/sinusoidal_no_end_sites.bvh", None, ()),
    ],
)
def test_known_files(shared_data: Path, clip: str, rig: str | None, lacking: tuple[str, ...]) -> None:
    path = shared_data / clip
    source = read_amc(path) if path.suffix == ".amc" else read_bvh(path)
    assert to_rig(source.skeleton) == rig
    mapping = joint_mapping(source.skeleton)
    if mapping is None:
        assert rig is None
        return
    assert filled_joints(mapping) == [name for name in BODY.names if lacking and name.endswith(lacking)]
    found = to_human23(source)
    # Whatever way up the file is, its people stand on the ground and look over it.
    if clip not in ("importer/standard_skeleton.bvh", "importer/test_mocapbank.bvh"):
        assert np.median(found.root[:, 1]) > 0.6
    standing = rot.mul_vec(found.rotations[:, 0], np.array([0.0, 1.0, 0.0]))[:, 1]
    assert np.percentile(standing, 75) > 0.85
