"""The loop command, and --loop of convert and tween."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind import read_motion, write_motion
from motionmind.body.motion import Motion
from motionmind.geometry import rotations as rot

PERIOD = 40  # frames


def swinging(rounds: float = 3.5, travel_m: float = 1.2) -> Motion:
    """Arms and legs swing, 30 frames a second, on a straight way."""
    still = ballet_clip("adagio")
    body, frames = still.skeleton, round(rounds * PERIOD)
    phase = 2.0 * np.pi * np.arange(frames) / PERIOD
    rotations = np.tile(rot.IDENTITY, (frames, len(body), 1))
    for name, size in (("left_hip", 0.5), ("right_hip", -0.5), ("left_shoulder", -0.7), ("right_shoulder", 0.6)):
        rotations[:, body.index(name)] = rot.from_axis_angle([1.0, 0.0, 0.0], size * np.sin(phase))
    root = np.stack([0.0 * phase, 0.95 + 0.02 * np.cos(2.0 * phase), travel_m * phase / (2.0 * np.pi)], axis=1)
    return Motion(body, rotations, root, np.arange(frames) / 30.0, name="swing")


def test_loop_keeps_the_rig_and_the_way(run: Run) -> None:
    write_motion("swing.bvh", swinging(), unit="m")
    ran = run("loop", "swing.bvh", "-o", "cycle.bvh", "-o", "cycle.json")
    assert ran.code == 0
    assert "1.33 s; the last frame is the first of the next round\na round   1.20 m\ngap       0.0 degrees" in ran.out
    for name in ("cycle.bvh", "cycle.json"):
        cycle = read_motion(name)
        assert len(cycle) == PERIOD + 1
        assert cycle.root[-1] - cycle.root[0] == pytest.approx([0.0, 0.0, 1.2], abs=1e-4)
        assert rot.angle(cycle.rotations[-1], cycle.rotations[0]).max() < 1e-3
    rigs = [Path(name).read_text().split("MOTION")[0] for name in ("swing.bvh", "cycle.bvh")]
    assert rigs[0] == rigs[1]
    assert run("loop", "swing.bvh", "-o", "still.json", "--in-place").code == 0
    still = read_motion("still.json")
    assert still.root[-1] == pytest.approx(still.root[0], abs=1e-4)
    assert run("convert", "swing.bvh", "again.json", "--loop").code == 0
    assert len(read_motion("again.json")) == PERIOD + 1


def test_a_root_that_is_put_back_walks_on(run: Run) -> None:
    motion = swinging()
    root = motion.root.copy()
    root[:, 2] = 1.2 * (np.arange(len(motion)) % PERIOD) / PERIOD
    write_motion("back.json", replace(motion, root=root))
    ran = run("loop", "back.json", "-o", "cycle.json")
    assert "the whole body leaps before frames 40, 80, 120" in ran.err
    assert "a round   1.20 m" in ran.out


def _other_name(joint: str) -> str:
    """Name a joint as Mixamo does."""
    names = {"pelvis": "Hips", "lumbar": "Spine", "thorax": "Spine1", "cervical": "Neck", "atlantal": "Head"}
    limbs = {"clavicle": "Shoulder", "shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand", "fingers": "HandMiddle1"}
    limbs |= {"hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "toes": "ToeBase"}
    side, _, part = joint.partition("_")
    return names.get(joint) or side.title() + limbs[part]


def test_z_up_stays_z_up(run: Run) -> None:
    motion = swinging()
    over = rot.from_axis_angle([1.0, 0.0, 0.0], 0.5 * np.pi)
    rotations = motion.rotations.copy()
    rotations[:, 0] = rot.mul(over, rotations[:, 0])
    rig = replace(motion.skeleton, name="rig", names=tuple(map(_other_name, motion.skeleton.names)))
    root = rot.mul_vec(over, motion.root)
    write_motion("z.bvh", replace(motion, skeleton=rig, rotations=rotations, root=root), unit="m")
    assert "a round   1.20 m" in run("loop", "z.bvh", "-o", "cycle.bvh").out
    cycle = read_motion("cycle.bvh")
    assert cycle.root[-1] - cycle.root[0] == pytest.approx([0.0, -1.2, 0.0], abs=1e-3)


def test_what_cannot_loop(run: Run) -> None:
    write_motion("short.json", swinging(0.2))
    for words, message in (
        (("short.json",), "error: short.json: lasts 0.23 s, too short for a cycle of 0.5 s\n"),
        (("short.json", "--shortest", 3, "--longest", 2), "--shortest 3: more than --longest 2"),
    ):
        ran = run("loop", *words, "-o", "cycle.json")
        assert (ran.code, ran.out) == (2, "")
        assert message in ran.err
        assert not Path("cycle.json").exists()


def test_a_tween_comes_back(run: Run) -> None:
    assert run("tween", "ballet/arabesque", "ballet/fifth", "--loop", "-o", "round.json").code == 0
    motion = read_motion("round.json")
    assert len(motion.insertions) == 2
    assert rot.angle(motion.rotations[0], motion.rotations[-1]).max() < 1e-6
    assert motion.root[0] == pytest.approx(motion.root[-1], abs=1e-9)
    places = motion.positions()
    twice = np.concatenate([places, places[1:]])
    for order in (1, 2):
        moved = np.linalg.norm(np.diff(twice, order, axis=0), axis=2).max(axis=1)
        seam = np.delete(np.arange(len(moved)), slice(len(motion) - 3, len(motion) + 1))
        assert moved[len(motion) - 3 : len(motion) + 1].max() <= moved[seam].max()
    ran = run("tween", "ballet/arabesque", "ballet/fifth", "--loop", "--alternatives", 2, "-o", "a.json")
    assert ran.code == 2
    assert "--loop excludes --alternatives" in ran.err
