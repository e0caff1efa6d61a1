"""Ends of tweens in files that do not say all about themselves: which axis is up, their unit, their joints."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.formats import read_motion, write_motion
from motionmind.geometry import rotations as rot
from motionmind.retarget.retarget import to_human23
from motionmind.retarget.vertical import Z_UP_TO_Y_UP
from motionmind.tween.engine import Engine

SLOW = ballet_clip("adagio").resample(30.0).slice(0, 120)
TWEEN = ("tween", "--corpus", "ballet", "--moves", "2..6")


def turned(motion: Motion, turn: np.ndarray) -> Motion:
    """The movement with the world turned."""
    rotations = motion.rotations.copy()
    rotations[:, 0] = rot.mul(turn, rotations[:, 0])
    return replace(motion, rotations=rotations, root=rot.mul_vec(turn, motion.root))


def renamed(motion: Motion) -> Motion:
    """The movement on a rig that is known, so that which axis is up is looked for."""
    words = {"hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "toes": "ToeBase", "clavicle": "Shoulder"}
    words |= {"shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand", "fingers": "HandMiddle1", "lumbar": "Spine"}
    words |= {"pelvis": "Hips", "thorax": "Spine1", "cervical": "Neck", "atlantal": "Head"}
    split = [name.rpartition("_") for name in human23().names]
    names = tuple(side.title() + words[word] for side, _, word in split)
    return replace(motion, skeleton=replace(motion.skeleton, names=names))


def ends_lying() -> Motion:
    """Movement in a world with z up, of somebody who lies on the back in the last frame."""
    stands = SLOW.slice(0, 60)
    lies = turned(stands.slice(0, 1), rot.from_axis_angle([1.0, 0.0, 0.0], -np.pi / 2))
    rotations, root = (np.concatenate([getattr(one, name) for one in (stands, lies)]) for name in ("rotations", "root"))
    whole = replace(stands, rotations=rotations, root=root, times=np.arange(61) / 30.0, keyframed=False)
    return renamed(turned(whole, rot.inv(Z_UP_TO_Y_UP)))


def test_what_is_up_in_a_file_of_an_end_is_seen_in_all_of_its_movement(run: Run) -> None:
    write_motion("z.bvh", ends_lying())
    wanted = to_human23(read_motion("z.bvh")).posture(60)
    assert np.degrees(rot.angle(wanted.rotations[0], rot.IDENTITY)) > 60.0
    alone = to_human23(read_motion("z.bvh").posture(60))
    assert np.degrees(rot.angle(wanted.rotations[0], alone.rotations[0])) > 60.0
    assert run(*TWEEN, "z.bvh@60", "z.bvh@0", "-o", "t.json").code == 0
    assert np.max(rot.angle(read_motion("t.json").rotations[0], wanted.rotations)) < 1e-4
    engine = Engine.load("ballet")
    by_name = engine.tween(engine.posture("z.bvh@60"), engine.posture("z.bvh@0"), moves=(2, 6))
    assert np.max(rot.angle(by_name.motion.rotations[0], wanted.rotations)) < 1e-4


def test_which_axis_is_up_in_a_file_of_an_end_can_be_said(run: Run) -> None:
    write_motion("z.bvh", ends_lying())
    assert run(*TWEEN, "z.bvh@60", "z.bvh@0", "--up", "y", "-o", "y.json").code == 0
    assert run(*TWEEN, "z.bvh@60", "z.bvh@0", "--up", "z", "-o", "z.json").code == 0
    stands, lies = (read_motion(f"{up}.json").rotations[0, 0] for up in "yz")
    assert np.degrees(rot.angle(rot.mul(Z_UP_TO_Y_UP, stands), lies)) == pytest.approx(0.0, abs=0.1)


def test_a_unit_is_for_files_of_both_ends_of_the_way_and_of_its_movement(run: Run) -> None:
    write_motion("clip.bvh", SLOW, unit="dm")
    heights = {}
    for unit in ("dm", "0.08"):
        ran = run(*TWEEN, "clip.bvh@20~", "clip.bvh@40", "--via", "clip.bvh@30@", "--unit", unit, "-o", "t.json")
        assert ran.code == 0, ran.err
        heights[unit] = read_motion("t.json").root[[0, -1], 1]
    np.testing.assert_allclose(heights["0.08"], 0.8 * heights["dm"], atol=2e-3)


def test_joints_of_ones_own_are_mapped_in_ends_in_movement_around_them_and_in_postures_on_the_way(run: Run) -> None:
    names = human23().names
    stranger = replace(SLOW.skeleton, name="stranger", names=tuple(f"J{i}" for i in range(len(names))))
    write_motion("own.json", SLOW)
    write_motion("other.json", replace(SLOW, skeleton=stranger))
    Path("map.toml").write_text("".join(f'J{i} = "{name}"\n' for i, name in enumerate(names)), "utf-8")

    def tween(of: str, *more: object) -> Motion:
        ends = (f"{of}@20~", f"{of}@40~", "--via", f"{of}@30@")
        ran = run(*TWEEN, *ends, "-o", "t.json", *more)
        assert ran.code == 0, ran.err
        return read_motion("t.json")

    assert "is on another skeleton" in run(*TWEEN, "other.json@20", "other.json@40").err
    found, wanted = tween("other.json", "--joints", "map.toml"), tween("own.json")
    assert np.max(rot.angle(found.rotations, wanted.rotations)) < 1e-4
    np.testing.assert_allclose(found.root, wanted.root, atol=1e-4)


def test_a_floor_of_an_end_that_is_off_is_told_once(run: Run) -> None:
    raised = replace(SLOW, root=SLOW.root + np.array([0.0, 0.2, 0.0]), keyframed=False)
    write_motion("high.bvh", raised)
    ran = run(*TWEEN, "high.bvh@20", "high.bvh@40")
    assert ran.err.count("high.bvh: the floor under its feet is 19 cm above 0") == 1


def test_a_corpus_on_its_own_joints_takes_ends_as_they_are(run: Run) -> None:
    write_motion("clip.json", renamed(SLOW))
    Engine.fit([renamed(SLOW)], name="own").save(Path("own"))
    ran = run("tween", "clip.json@20", "clip.json@40", "--corpus", "./own", "-o", "t.json")
    assert ran.code == 0, ran.err
    assert read_motion("t.json").skeleton.names[0] == "Hips"
