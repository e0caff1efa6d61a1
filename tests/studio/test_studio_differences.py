"""A dancer's words for the difference between two movements, of movements that differ in one respect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.geometry import rotations as rot
from motionmind.studio.differences import describe_difference, describe_joints

HUMAN = human23()
N = 61
BUMP = np.sin(np.linspace(0.0, np.pi, N))


def standing() -> Motion:
    q = np.tile(rot.IDENTITY, (N, len(HUMAN), 1))
    return Motion(HUMAN, q, np.tile([0.0, -HUMAN.rest[:, 1].min(), 0.0], (N, 1)), np.arange(N) / 30.0)


def turned(joint: str, vector: list[float]) -> Motion:
    """A body that turns a joint, and turns it back."""
    motion = standing()
    q = motion.rotations.copy()
    q[:, HUMAN.index(joint)] = rot.exp(BUMP[:, None] * np.array(vector))
    return replace(motion, rotations=q)


def travelled(way: Floats) -> Motion:
    """A body that slides elsewhere and back."""
    motion = standing()
    return replace(motion, root=motion.root + BUMP[:, None] * way)


def stepped() -> Motion:
    """A body that moves by 0.5 m at once, and stays there."""
    motion, step = standing(), np.clip(np.linspace(-2.0, 3.0, N), 0.0, 1.0)
    return replace(motion, root=motion.root + 0.2 * step[:, None] * [1.0, 0.0, 0.0])


DIFFERENT = {
    "higher left arm": turned("left_shoulder", [0.0, 0.0, 1.0]),
    "lower left arm": turned("left_shoulder", [0.0, 0.0, -1.0]),
    "higher right arm": turned("right_shoulder", [0.0, 0.0, -1.0]),
    "right leg farther back": turned("right_hip", [0.9, 0.0, 0.0]),
    "left leg farther forward": turned("left_hip", [-0.9, 0.0, 0.0]),
    "turns left": turned("pelvis", [0.0, 1.5, 0.0]),
    "turns right": turned("pelvis", [0.0, -1.5, 0.0]),
    "travels farther left": travelled(np.array([0.6, 0.0, 0.0])),
    "travels farther back": travelled(np.array([0.0, 0.0, -0.6])),
    "rises higher": travelled(np.array([0.0, 0.3, 0.0])),
    "through 2 steps": stepped(),
    "slower": replace(standing(), times=np.arange(N) / 20.0),
    "quicker": replace(standing(), times=np.arange(N) / 40.0),
}


@pytest.mark.parametrize("words", DIFFERENT)
def test_a_difference_is_named_as_a_dancer_would(words: str) -> None:
    assert words in describe_difference(DIFFERENT[words], standing()).split(", ")


def test_the_greatest_difference_comes_first_and_at_most_three_are_named() -> None:
    motion = replace(turned("left_shoulder", [0.0, 0.0, 1.5]), times=np.arange(N) / 25.0)
    assert describe_difference(motion, standing()).split(", ")[0] == "higher left arm"
    every = replace(travelled(np.array([1.0, 0.4, 1.0])), times=np.arange(N) / 10.0)
    assert len(describe_difference(every, standing()).split(", ")) == 3


def test_what_no_viewer_sees_has_no_words() -> None:
    assert describe_difference(standing(), standing()) == ""
    assert describe_difference(turned("left_wrist", [0.0, 0.0, 0.1]), standing()) == ""
    assert describe_joints(turned("left_wrist", [0.0, 0.0, 0.1]), standing()) == ""


def test_details_name_the_joint_its_degrees_and_the_time() -> None:
    words = describe_joints(turned("left_shoulder", [0.0, 0.0, 1.0]), standing())
    assert words == "differs from the first: left shoulder by 57° at 1.0 s"
