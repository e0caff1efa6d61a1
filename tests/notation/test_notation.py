"""Scores: the body's angles, what is said to whoever slips, the algebra of phrases, and how the body travels."""

from __future__ import annotations

import random
import re
import warnings
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind._typing import Floats
from motionmind.body.anatomy import Anatomy
from motionmind.body.anatomy_file import anatomy_named, read_body
from motionmind.body.contact import lowest_point
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion, Posture
from motionmind.bundled import bundled
from motionmind.cli import main
from motionmind.errors import FormatError
from motionmind.formats import read_motion, read_posture, write_motion
from motionmind.geometry import rotations as rot
from motionmind.notation import compose as notation
from motionmind.notation import rows as phrases
from motionmind.notation.compose import compose, motions
from motionmind.notation.posture_line import Row
from motionmind.notation.read import MAX_INCLUDES, read_score, read_scores
from motionmind.notation.sources import sources

Mutate = Callable[[str, random.Random], bytes]

HUMAN = anatomy_named("human23")
BODIES = ("human23", "human44")
SIDES = ("left", "right")

VOCABULARY = """# What dancers say.
title   For the tests
body    human23
tempo   120

legs
  first    = stand out 7 ahead 4 turn 60
  fifth    = stand out 1 ahead 12 turn 60 / stand out 1 ahead 0 turn 60
  on       = stand turn 60
  tendu    = touch towards -8, hip rotation 60, ankle plantar 58, toes flexion 15 / on
  passe    = hip flexion 50 abduction 50 rotation 60, knee flexion 110, ankle plantar 40 / on
  leaning  = stand out 12 turn 20 lean left 4 lean ahead 2
  push     = stand ahead 20 turn 10 weight 70 lean ahead 4 / stand ahead -15 turn 30 weight 30 lean ahead 1
  jump     = hip flexion 20 rotation 40, knee flexion 30, ankle plantar 40
  scissors = hip flexion 30, knee flexion 10 / hip extension 20, knee flexion 40
  plie     = bend 50
  releve   = heel 48

arms
  bas      = shoulder flexion 15 abduction 14 rotation -30, elbow flexion 38
  second   = shoulder flexion 10 abduction 80 rotation 20, elbow flexion 20
  third    = second / bas

torso
  upright  = neutral
  arched   = lumbar extension 10, thorax extension 10
  aside    = lumbar bend 9, thorax bend 14
  twisted  = pelvis turn 8, spine turn 10

head
  front    = neutral
  turned   = head turn 42
  nod      = head flexion 20

facings
  corner   = 45
"""
PIECE = """
phrase tendu-front
  start | fifth right      | bas    | upright | turned right
  1     | tendu right      | second |         | front
  1     | fifth right      | bas    |         | turned right
  1     | fifth right plie

phrase finish
  1     | fifth right

phrase demi (PLACE, ARMS)
  start | PLACE            | bas
  1     | PLACE plie       | ARMS
  1/2   | PLACE            | bas

clip piece: A piece
  tendu-front
  finish
  1 turn 90 left | fifth left releve | | | front
  1     | fifth left       |        |         | turned left
  tendu-front, other side
  finish, other side
  2 up 20 go ahead 30 left 10 | jump | second
  1     | fifth right      | bas
  demi (fifth right, third left), 2 times

posture open = tendu right | second | upright | front
"""


def write(folder: Path, text: str | bytes, name: str = "a.score") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def moved(folder: Path, text: str, vocabulary: str = VOCABULARY) -> Motion:
    """The movement of a clip's lines, or of the only clip in `text`."""
    if not re.search("^clip ", text, re.MULTILINE):
        text = f"clip c\n{text}"
    return compose(write(folder, f"{vocabulary}\n{text}"))


def posed(folder: Path, text: str, more: str = "") -> Posture:
    return notation.posture(read_score(write(folder, f"{VOCABULARY}\n{more}\nposture p = {text}\n")), "p")


def places(motion: Motion) -> dict[str, Floats]:
    found = motion.skeleton.positions_and_tips(motion.rotations, motion.root)
    joints = motion.skeleton.names
    return {name: found[:, at] for at, name in enumerate([*joints, *(f"{joint}_tip" for joint in joints)])}


def same(a: Motion, b: Motion) -> None:
    np.testing.assert_array_equal(a.rotations, b.rotations)
    np.testing.assert_array_equal(a.root, b.root)
    np.testing.assert_array_equal(a.times, b.times)


# --- anatomy ----------------------------------------------------------------------------------------------------------


def angles_of(human: Anatomy, said: dict[str, str]) -> dict[str, Floats]:
    """Angles as `rotations` takes them, from words as scores have them: {"left_hip": "flexion 90"}."""
    out = {name: np.zeros((1, 3)) for name in human.skeleton.names}
    for name, text in said.items():
        words = text.split()
        _, joint = human.anatomy(name)
        for word, value in zip(words[::2], words[1::2], strict=True):
            opposite = [key for key, angle in joint.angles.items() if angle.opposite == word]
            angle = joint.angles[opposite[0] if opposite else word]
            out[name][0, angle.axis] = (-1.0 if opposite else 1.0) * angle.sign * float(value)
    return out


def held(human: Anatomy, said: dict[str, str]) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Where joints and tips are, and how joints are turned, as matrices; the pelvis in the middle of the world."""
    local = human.rotations(angles_of(human, said))[0]
    turned = rot.to_matrix(human.skeleton.global_rotations(local))
    found = human.skeleton.positions_and_tips(local, np.zeros(3))
    joints = human.skeleton.names
    names = [*joints, *(f"{joint}_tip" for joint in joints)]
    return dict(zip(names, found, strict=True)), dict(zip(joints, turned, strict=True))


LEFT, UP, AHEAD = np.eye(3)
INWARD = -LEFT  # of the left side: towards the middle

# What is said of the left; what must then lie from where in which direction.
POINTS = [
    ({}, "left_shoulder", "left_fingers_tip", -UP),
    ({}, "left_hip", "left_ankle", -UP),
    ({}, "pelvis", "cervical", UP),
    ({"left_hip": "flexion 90"}, "left_hip", "left_knee", AHEAD),
    ({"left_hip": "flexion 90"}, "left_knee", "left_ankle", AHEAD),
    ({"left_hip": "extension 30"}, "left_hip", "left_knee", -0.5 * AHEAD - np.sqrt(0.75) * UP),
    ({"left_hip": "abduction 90"}, "left_hip", "left_knee", LEFT),
    ({"left_hip": "adduction 30"}, "left_hip", "left_knee", -0.5 * LEFT - np.sqrt(0.75) * UP),
    ({"left_hip": "flexion 63.6396 abduction 63.6396"}, "left_hip", "left_knee", AHEAD + LEFT),
    ({"left_hip": "rotation 60"}, "left_toes", "left_toes_tip", np.sqrt(0.75) * LEFT + 0.5 * AHEAD),
    ({"left_hip": "inward 30"}, "left_toes", "left_toes_tip", -0.5 * LEFT + np.sqrt(0.75) * AHEAD),
    ({"left_hip": "flexion 90 rotation 80", "left_knee": "flexion 90"}, "left_hip", "left_knee", AHEAD),
    ({"left_hip": "rotation 90", "left_knee": "flexion 90"}, "left_knee", "left_ankle", -LEFT),
    ({"left_hip": "flexion 90", "left_knee": "flexion 90"}, "left_knee", "left_ankle", -UP),
    ({"left_knee": "flexion 90"}, "left_knee", "left_ankle", -AHEAD),
    ({"left_ankle": "plantar 90"}, "left_toes", "left_toes_tip", -UP),
    ({"left_ankle": "dorsal 45"}, "left_toes", "left_toes_tip", AHEAD + UP),
    ({"left_ankle": "rotation 30"}, "left_toes", "left_toes_tip", 0.5 * LEFT + np.sqrt(0.75) * AHEAD),
    ({"left_toes": "extension 90"}, "left_toes", "left_toes_tip", UP),
    ({"left_toes": "flexion 45"}, "left_toes", "left_toes_tip", AHEAD - UP),
    ({"left_shoulder": "flexion 90"}, "left_shoulder", "left_wrist", AHEAD),
    ({"left_shoulder": "flexion 180"}, "left_shoulder", "left_wrist", UP),
    ({"left_shoulder": "extension 60"}, "left_shoulder", "left_wrist", -np.sqrt(0.75) * AHEAD - 0.5 * UP),
    ({"left_shoulder": "abduction 90"}, "left_shoulder", "left_wrist", LEFT),
    ({"left_shoulder": "abduction 180"}, "left_shoulder", "left_wrist", UP),
    ({"left_elbow": "flexion 90"}, "left_elbow", "left_wrist", AHEAD),
    ({"left_elbow": "flexion 90", "left_shoulder": "rotation 90"}, "left_elbow", "left_wrist", LEFT),
    ({"left_elbow": "flexion 90", "left_shoulder": "inward 90"}, "left_elbow", "left_wrist", INWARD),
    ({"left_elbow": "flexion 90", "left_shoulder": "flexion 90"}, "left_elbow", "left_wrist", UP),
    ({"left_wrist": "flexion 90"}, "left_wrist", "left_fingers", INWARD),
    ({"left_wrist": "radial 90"}, "left_wrist", "left_fingers", AHEAD),
    ({"left_fingers": "flexion 90"}, "left_fingers", "left_fingers_tip", INWARD),
    ({"left_clavicle": "elevation 30"}, "left_clavicle", "left_shoulder", np.sqrt(0.75) * LEFT + 0.5 * UP),
    ({"left_clavicle": "protraction 30"}, "left_clavicle", "left_shoulder", np.sqrt(0.75) * LEFT + 0.5 * AHEAD),
    ({"pelvis": "tilt 90"}, "pelvis", "thorax", AHEAD),
    ({"pelvis": "back 30"}, "pelvis", "thorax", -0.5 * AHEAD + np.sqrt(0.75) * UP),
    ({"pelvis": "list 30"}, "pelvis", "thorax", 0.5 * LEFT + np.sqrt(0.75) * UP),
    ({"pelvis": "turn 90 tilt 90"}, "pelvis", "thorax", LEFT),
    ({"lumbar": "flexion 90"}, "lumbar", "thorax", AHEAD),
    ({"lumbar": "bend 90"}, "lumbar", "thorax", LEFT),
    ({"thorax": "flexion 90"}, "thorax", "cervical", AHEAD),
    ({"thorax": "bend 90"}, "thorax", "cervical", LEFT),
    ({"atlantal": "flexion 90"}, "atlantal", "atlantal_tip", AHEAD),
    ({"atlantal": "bend 90"}, "atlantal", "atlantal_tip", LEFT),
    ({"cervical": "turn 90", "atlantal": "flexion 90"}, "atlantal", "atlantal_tip", LEFT),
]

PALM, SOLE, NOSE = -UP, -UP, AHEAD  # in the joint's own frame, from its rest
FACES = [
    ({}, "left_wrist", PALM, INWARD),  # palms to the thighs
    ({"left_elbow": "flexion 90 supination 90"}, "left_wrist", PALM, UP),
    ({"left_elbow": "flexion 90 pronation 90"}, "left_wrist", PALM, -UP),
    ({"left_shoulder": "rotation 90"}, "left_wrist", PALM, AHEAD),
    ({"left_shoulder": "abduction 90"}, "left_wrist", PALM, -UP),
    ({"left_ankle": "inversion 35"}, "left_ankle", SOLE, np.sin(np.radians(35)) * INWARD - np.cos(np.radians(35)) * UP),
    ({"atlantal": "turn 90"}, "atlantal", NOSE, LEFT),
    ({"cervical": "turn 90"}, "atlantal", NOSE, LEFT),
    ({"pelvis": "turn 90"}, "atlantal", NOSE, LEFT),
    ({"thorax": "turn 90"}, "atlantal", NOSE, LEFT),
]


def other_side(said: dict[str, str]) -> dict[str, str]:
    return {other_name(name): text for name, text in said.items()}


def other_name(name: str) -> str:
    return name.replace("left", "right") if "left" in name else name.replace("right", "left")


def unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))


@pytest.mark.parametrize(("said", "start", "end", "wanted"), POINTS, ids=str)
def test_an_angle_takes_the_limb_where_its_name_says(
    said: dict[str, str], start: str, end: str, wanted: Floats
) -> None:
    found, _ = held(HUMAN, said)
    np.testing.assert_allclose(unit(found[end] - found[start]), unit(wanted), atol=1e-6)
    if "left" in start:  # what is written for the left is the right's mirror image
        found, _ = held(HUMAN, other_side(said))
        line = found[other_name(end)] - found[other_name(start)]
        np.testing.assert_allclose(unit(line), unit(wanted) * [-1.0, 1.0, 1.0], atol=1e-6)


@pytest.mark.parametrize(("said", "joint", "own", "wanted"), FACES, ids=str)
def test_an_angle_turns_the_limb_where_its_name_says(
    said: dict[str, str], joint: str, own: Floats, wanted: Floats
) -> None:
    rest = rot.to_matrix(HUMAN.skeleton.global_rotations(np.tile(rot.IDENTITY, (len(HUMAN.skeleton), 1))))
    np.testing.assert_array_equal(rest[0], np.eye(3))  # at rest all axes are the world's
    _, turned = held(HUMAN, said)
    np.testing.assert_allclose(turned[joint] @ own, wanted, atol=1e-6)
    if "left" in joint:
        _, turned = held(HUMAN, other_side(said))
        np.testing.assert_allclose(turned[other_name(joint)] @ own, wanted * [-1.0, 1.0, 1.0], atol=1e-6)


def test_an_elbow_that_bends_brings_the_hand_to_the_shoulder() -> None:
    far = [
        np.linalg.norm(found["left_wrist"] - found["left_shoulder"])
        for bend in range(0, 151, 10)
        for found, _ in [held(HUMAN, {"left_elbow": f"flexion {bend}"})]
    ]
    assert (np.diff(far) < 0.0).all()
    assert far[-1] < 0.2


def test_the_arm_is_measured_against_the_chest_not_the_collar_bone() -> None:
    plain, _ = held(HUMAN, {"left_shoulder": "flexion 90"})
    raised, _ = held(HUMAN, {"left_shoulder": "flexion 90", "left_clavicle": "elevation 30 protraction 20"})
    along = [unit(found["left_elbow"] - found["left_shoulder"]) for found in (plain, raised)]
    np.testing.assert_allclose(along[0], along[1], atol=1e-9)


@pytest.mark.parametrize("name", BODIES)
@given(data=st.data())
@settings(max_examples=40)
def test_angles_within_their_limits_can_be_read_back(name: str, data: st.DataObject) -> None:
    human = anatomy_named(name)
    said = {}
    for joint_name in human.skeleton.names:
        _, joint = human.anatomy(joint_name)
        vector = np.zeros(3)
        for angle in joint.angles.values():
            low, high = angle.range
            vector[angle.axis] = angle.sign * (low + (high - low) * data.draw(st.integers(0, 100)) / 100.0)
        axis = "xyz".index(joint.long)
        swing = np.linalg.norm(np.delete(vector, axis))
        if swing > 179.0:  # past half a turn there is a shorter way, and at half a turn no twist
            vector[np.arange(3) != axis] *= 179.0 / swing
        vector[axis] = np.clip(vector[axis], -179.999, 179.999)
        said[joint_name] = vector[None]
    read = human.degrees(human.rotations(said))
    np.testing.assert_allclose(read[0], np.array([said[joint][0] for joint in human.skeleton.names]), atol=1e-4)


@pytest.mark.parametrize("name", BODIES)
def test_masses_are_shares_of_a_whole(name: str) -> None:
    human = anatomy_named(name)
    masses = [human.anatomy(joint)[1].mass for joint in human.skeleton.names]
    assert sum(masses) == pytest.approx(1.0, abs=1e-3)
    assert min(masses) >= 0.0


@pytest.mark.parametrize("name", BODIES)
def test_the_centre_of_mass_is_where_people_have_it(name: str) -> None:
    """At 55 to 58 % of the height, in the middle, above the feet, when a person stands with the arms hanging."""
    human = anatomy_named(name)
    rotations = human.rotations({joint: np.zeros((1, 3)) for joint in human.skeleton.names})[0]
    lowest = human.skeleton.positions_and_tips(rotations, np.zeros(3))[:, 1].min()
    centre = human.centre_of_mass(rotations, np.array([0.0, -lowest, 0.0]))
    assert 0.55 <= centre[1] / human.skeleton.height <= 0.58
    assert centre[0] == pytest.approx(0.0, abs=1e-12)
    assert -0.03 < centre[2] < 0.06


@pytest.mark.parametrize("name", BODIES)
def test_both_bodies_weigh_alike(name: str) -> None:
    human = anatomy_named(name)
    whole = {"hip": 0.1416, "knee": 0.0433, "ankle": 0.0137, "shoulder": 0.0271, "elbow": 0.0162}  # de Leva's men
    for joint, mass in whole.items():
        assert human.joints[joint].mass == mass
    trunk = [joint for joint in human.layers["torso"] if joint != "pelvis"]
    assert sum(human.joints[joint].mass for joint in trunk) == pytest.approx(0.1633 + 0.1596, abs=1e-3)


@pytest.mark.parametrize("name", BODIES)
def test_limits_and_words_make_sense(name: str) -> None:
    human = anatomy_named(name)
    for stem, joint in human.joints.items():
        words = [word for key, angle in joint.angles.items() for word in (key, angle.opposite) if word]
        assert len(words) == len(set(words)), stem
        axes = [angle.axis for angle in joint.angles.values()]
        assert len(axes) == len(set(axes)), stem
        for word, angle in joint.angles.items():
            low, high = angle.range
            assert low <= 0.0 < high, (stem, word)
            assert low >= -180.0, (stem, word)
            assert high <= 180.0, (stem, word)
    for group, shares in human.groups.items():
        for word in {word for joint in shares.values() for word in joint}:
            parts = [joint.get(word, 0.0) for joint in shares.values()]
            assert min(parts) > 0.0, (group, word)
            assert sum(parts) == pytest.approx(1.0, abs=1e-9), (group, word)


def test_one_body_goes_as_far_as_the_other() -> None:
    """What human44 divides goes together about as far as it does in one on human23, to the last tenth at least."""
    fine = anatomy_named("human44")
    rows = {
        "lumbar": ("lumbar", "lumbar_middle", "lumbar_upper"),
        "thorax": ("thorax", "thorax_middle", "thorax_upper"),
    }
    for joint, row in rows.items():
        for word, angle in HUMAN.joints[joint].angles.items():
            for end in (0, 1):
                whole = sum(fine.joints[part].angles[word].range[end] for part in row)
                assert 0.9 <= whole / angle.range[end] <= 1.25, (joint, word)


# --- what is said to whoever slips ------------------------------------------------------------------------------------

# What is written after the vocabulary, and what the message says: the line of the slip is the one with "@" at its end.
C = "clip c\n  start | first\n"
SLIPS = {
    "misspelt position": (C + "  1 | frist @", r"'frist' is not a position of the legs; did you mean first\?"),
    "misspelt on top": (C + "  1 | first pliee @", r"'pliee'.*did you mean plie\?"),
    "position of another layer": (
        C + "  1 | bas @",
        r"'bas' is not a position of the legs; it is a position of the arms",
    ),
    "cells moved by one": (C + "  1 | | upright @", r"'upright' is not a position of the arms.*torso"),
    "no side": (C + "  1 | fifth @", r"'fifth': add a side: fifth left or fifth right"),
    "no side of what is on top of a side": (C + "  1 | fifth plie @", r"'fifth plie': add a side"),
    "no side of what is built on a side": (
        "legs\n  odd = fifth, bend 9\n" + C + "  1 | odd @",
        r"'odd': add a side",
    ),
    "no side of a head": (C + "  1 | | | | turned @", r"'turned': add a side"),
    "two sides": (C + "  1 | fifth left right @", r"'fifth left right' names two sides"),
    "one side twice": (C + "  1 | fifth left left @", r"names two sides"),
    "nothing but a side": (C + "  1 | left @", r"no position of the legs"),
    "too many cells": (C + "  1 | first | bas | upright | front | first @", r"6 cells, where a posture has 5"),
    "an unknown phrase": (C + "  tendu-fronts @", r"'tendu-fronts' is not a phrase"),
    "a phrase misspelt": ("phrase finish\n  1 | first\n" + C + "  finnish @", r"'finnish'.*did you mean finish\?"),
    "no comma": ("phrase q\n  1 | first\n" + C + "  q other side @", r"'q other side'"),
    "no such way": ("phrase q\n  1 | first\n" + C + "  q, sideways @", r"'sideways' is not a modifier"),
    "0 times": ("phrase q\n  1 | first\n" + C + "  q, 0 times @", r"'0 times' is not a modifier"),
    "an unknown layer": ("phrase q\n  1 | first\n" + C + "  q, with feet of q @", r"'feet' is not a layer.*legs"),
    "with of nothing": ("phrase q\n  1 | first\n" + C + "  q, with arms of r @", r"'r' is not a phrase"),
    "too few open words": ("phrase q (A, B)\n  1 | A | B\n" + C + "  q (first) @", r"q has 2 open words.*1 "),
    "too many open words": ("phrase q (A)\n  1 | A\n" + C + "  q (first, bas) @", r"q has 1 open words.*2 "),
    "open words forgotten": ("phrase q (A)\n  1 | A\n" + C + "  q @", r"q has 1 open words.*0 "),
    "open word left empty": ("phrase q (A)\n  1 | A\n" + C + "  q () @", r"an open word is empty"),
    "open word not closed": ("phrase q (A @\n  1 | A\n", r"write phrase NAME, or phrase NAME \(WORD, WORD\)"),
    "an open word twice": ("phrase q (A, A) @\n  1 | A\n", r"'A' is already defined"),
    "no open word": ("phrase q () @\n  1 | first\n", r"'' cannot be a name"),
    "open words of a clip": ("clip q (A) @\n  1 | A\n", r"write phrase NAME"),
    "a phrase that calls itself": ("phrase q @\n  1 | first\n  q\n" + C + "  q\n", r"q calls itself"),
    "two that call each other": ("phrase q @\n  r\nphrase r @\n  q\n" + C + "  q\n", r"(q|r) calls itself"),
    "tempo of the score": ("tempo fast @\n" + C, r"tempo fast: give counts per minute"),
    "tempo 0": ("tempo 0 @\n" + C, r"tempo 0"),
    "tempo below 0": ("tempo -60 @\n" + C, r"tempo -60"),
    "no tempo": ("tempo @\n" + C, r"tempo"),
    "tempo of a phrase": (C + "  tempo 1e3 @\n  1 | first", r"tempo 1e3"),
    "tempo where nobody looks": ("phrase q\n  tempo allegro @\n  1 | first\n" + C, r"tempo allegro"),
    "counts by 0": (C + "  1/0 | first @", r"'1/0' is not a number of counts"),
    "no counts": (C + "  0 | first @", r"'0' is not a number of counts"),
    "counts of dots": (C + "  1.2.3 | first @", r"'1.2.3' is not a number of counts"),
    "counts with slashes": (C + "  1/2/3 | first @", r"'1/2/3' is not a number of counts"),
    "counts below 0": (C + "  -1 | first @", r"'-1'"),
    "counts too short to be": (C + "  0.00001 | first @", r"'0.00001' is not a number of counts"),
    "counts without end": (C + f"  {'9' * 400} | first @", r"is not a number of counts"),
    "counts as a word": (C + "  one | first @", r"'one' does not describe a move"),
    "two counts": (C + "  1 2 | first @", r"'2' does not describe a move"),
    "a hold with a slip": (C + "  1 wait @", r"'wait' does not describe a move"),
    "face nowhere": (C + "  1 face | first @", r"'' is not a facing"),
    "face an unknown corner": (C + "  1 face cornr | first @", r"'cornr' is not a facing; did you mean corner\?"),
    "face without end": (C + f"  1 face {'9' * 400} | first @", r"face|number|9999"),
    "a facing without end": (f"facings\n  far = {'9' * 400} @\n" + C, r"number|degrees"),
    "a facing that is a word": ("facings\n  back = behind @\n" + C, r"'behind': a facing is degrees"),
    "turn without a side": (C + "  1 turn 90 | first @", r"turn DEGREES left, or right"),
    "turn by a word": (C + "  1 turn half left | first @", r"turn half: expected a number"),
    "up, but standing": (C + "  1 up 20 | first @", r"up 20, but a leg stands"),
    "up below the floor": (C + "  1 up -5 | jump @", r"up -5: below the floor"),
    "up without height": (C + "  1 up | jump @", r"up: expected a number"),
    "go nowhere": (C + "  1 go | jump @", r"go"),
    "go without how far": (C + "  1 go ahead | jump @", r"go ahead: expected a number"),
    "go without where": (C + "  1 go 30 | jump @", r"go|'30'"),
    "three limbs": (C + "  1 | first / first / first @", r"one / too many"),
    "two torsos": (C + "  1 | | | upright / upright @", r"left / right needs two limbs"),
    "both sides by a slash": (C + "  1 | fifth / first @", r"'fifth' is for both sides"),
    "nothing by a slash": (C + "  1 | first / @", r"no position of the legs"),
    "two slashes": (C + "  1 | first // first @", r"one / too many"),
    "another beginning": (
        "phrase q\n  start | fifth left\n  1 | first\n" + C + "  q @",
        r"starts in another posture than the line before it ends: first, then fifth, leading / fifth, other \(line",
    ),
    "another facing": (C + "  1 face 90 left | first\n  start face 0 | first @", r"facing 90, then 0"),
    "a position defined later": (
        "legs\n  early = late @\n  late = stand\n" + C,
        r"'late' is not a position of the legs",
    ),
    "a position of itself": ("legs\n  round = round, bend 5 @\n" + C, r"'round' is not a position of the legs"),
    "a position twice": ("legs\n  first = stand @\n" + C, r"'first' is already defined"),
    "right as a name": ("legs\n  right = stand @\n" + C, r"'right' cannot be a name"),
    "two words as a name": ("legs\n  my first = stand @\n" + C, r"'my first' cannot be a name"),
    "a name with a dot": ("legs\n  a.b = stand @\n" + C, r"'a.b' cannot be a name"),
    "nothing after =": ("legs\n  odd = @\n" + C, r"empty definition"),
    "no =": ("legs\n  odd stand @\n" + C, r"'odd stand': write NAME = DEFINITION"),
    "nothing before =": ("legs\n  = stand @\n" + C, r"'' cannot be a name"),
    "two commas": ("legs\n  odd = stand,, bend 5 @\n" + C, r"nothing between commas"),
    "a comma at the end": ("legs\n  odd = stand, @\n" + C, r"nothing between commas"),
    "a joint misspelt": (
        "legs\n  odd = hpi flexion 20 @\n" + C,
        r"'hpi' is not a joint of the legs; did you mean hip\?",
    ),
    "a joint of another layer": ("legs\n  odd = elbow flexion 20 @\n" + C, r"'elbow' is not a joint of the legs"),
    "an angle misspelt": ("legs\n  odd = hip flexoin 20 @\n" + C, r"'flexoin' is not an angle.*did you mean flexion\?"),
    "an angle of another joint": (
        "legs\n  odd = knee abduction 20 @\n" + C,
        r"'abduction' is not an angle of the knee",
    ),
    "an angle without degrees": ("legs\n  odd = hip flexion @\n" + C, r"flexion: expected a number"),
    "degrees without an angle": ("legs\n  odd = hip 20 @\n" + C, r"expected a number|angle"),
    "a joint alone": ("legs\n  odd = hip @\n" + C, r"hip"),
    "an angle that is no number": ("legs\n  odd = hip flexion 2o @\n" + C, r"flexion 2o: expected a number"),
    "a huge angle": ("legs\n  odd = hip flexion 1000000 @\n" + C, r"flexion 1000000"),
    "not a number": ("legs\n  odd = hip flexion nan @\n" + C, r"flexion nan: expected a number"),
    "a word of no leg": ("legs\n  odd = stand on 5 @\n" + C, r"'on' does not describe a leg on the floor"),
    "a word of a leg misspelt": ("legs\n  odd = stand trun 5 @\n" + C, r"'trun'.*did you mean turn\?"),
    "a bend below 0": ("legs\n  odd = stand bend -30 @\n" + C, r"bend -30"),
    "a heel below the floor": ("legs\n  odd = stand heel -20 @\n" + C, r"heel -20"),
    "a weight below 0": ("legs\n  odd = stand weight -20 @\n" + C, r"weight -20"),
    "lean nowhere": ("legs\n  odd = stand lean 5 @\n" + C, r"lean 5: write lean, a direction"),
    "touch nowhere": ("legs\n  odd = touch @\n" + C, r"touch towards DEGREES"),
    "an arm that stands": ("arms\n  odd = stand @\n" + C, r"'stand'"),
    "an arm that is planted": ("arms\n  odd = planted @\n" + C, r"'planted'"),
    "a planted leg that bends": ("legs\n  odd = planted bend 5 @\n" + C, r"'bend'.*; words are weight, pivot"),
    "a planted leg and a standing one": (
        "legs\n  odd = planted / stand\n" + "clip c\n  start | odd left @\n",
        "one leg is planted, the other placed",
    ),
    "a planted leg in the air": ("legs\n  odd = planted\nclip c\n  start up 5 | odd @\n", "up 5, but a leg is planted"),
    "a torso of two": ("torso\n  odd = neutral / neutral @\n" + C, r"a / separates two limbs"),
    "an unknown heading": ("arm @\n  bas = neutral\n" + C, r"'arm' is not a heading; did you mean arms\?"),
    "a heading with more": ("legs first @\n" + C, r"'first' after the heading legs"),
    "an indented title": ("title\n  too deep @\n" + C, r"title has no lines below it"),
    "a phrase without lines": ("phrase q @\n" + C, r"phrase q has no lines"),
    "a clip without lines": ("clip c @\n", r"clip c has no lines"),
    "a clip without a name": ("clip @\n  1 | first\n", r"'' cannot be a name"),
    "a clip twice": (C + "clip c @\n  1 | first\n", r"'c' is already defined"),
    "a phrase nobody could call": ("phrase 1 @\n  1 | first\n" + C, r"'1' cannot be"),
    "a phrase called start": ("phrase start @\n  1 | first\n" + C, r"'start' cannot be"),
    "a phrase of nothing": ("phrase q @\n  tempo 90\n" + C + "  q, backwards", r"q has no postures"),
    "a posture without =": ("posture odd first @\n" + C, r"posture NAME ="),
    "a missing include": ("include nobody.score @\n" + C, r"nobody.score"),
    "an include of a folder": ("include . @\n" + C, r"file"),
    "an include of itself": ("include a.score @\n" + C, r"includes itself"),
    "an include of a name too long": (f"include {'a' * 300} @\n" + C, r"aaa"),
    "an include that is no file name": ("include a\0b @\n" + C, r"file|zero|null"),
    "an unknown include": (C + "  1 | ballet.first @", r"'ballet' is not an included score"),
    "an unknown included phrase": (C + "  ballet.tendu @", r"'ballet' is not an included score"),
    "past a limit": ("legs\n  odd = hip flexion 140 / on\n" + C + "  1 | odd left @", r"hip: flexion 140 is past.*130"),
    "past a limit the other way": (
        "legs\n  odd = hip extension 60 / on\n" + C + "  1 | odd right @",
        r"right hip: extension 60 is past its limit of 50 degrees",
    ),
    "past half a turn": (
        "arms\n  odd = shoulder flexion 120 abduction 150\n" + C + "  1 | | odd @",
        r"left shoulder: flexion and abduction together are more than half a turn",
    ),
    "feet too far apart": ("legs\n  odd = stand out 120\n" + C + "  1 | odd @", r"foot is \d+ cm beyond"),
    "a foot that cannot touch": (
        "legs\n  odd = touch towards 0, knee flexion 70 / stand heel 48\n" + C + "  1 | odd left @",
        r"left foot cannot touch the floor: it stays \d+ cm above it",
    ),
    "nobody stands": ("legs\n  odd = touch towards 0\n" + C + "  1 | odd @", r"a leg touches.*none stands"),
    "a turn too far for the feet": ("legs\n  odd = stand turn 100\n" + C + "  1 | odd @", r"is past its limit"),
    "a number for a name": (C + "  1 | 5 @", r"'5' is not a position of the legs"),
    "no body of that name": ("body human24 @\n" + C, r"no body 'human24'; did you mean human"),
    "no body in that file": ("body nobody.toml @\n" + C, r"nobody.toml"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_told_with_file_line_and_word(slip: str, tmp_path: Path) -> None:
    text, wanted = SLIPS[slip]
    whole = f"{VOCABULARY}{text}\n"
    if slip.startswith("no body"):
        whole = whole.replace("body    human23\n", "\n")
    lines = [number for number, line in enumerate(whole.split("\n"), start=1) if line.endswith("@")]
    path = write(tmp_path, whole.replace(" @", ""))
    with pytest.raises(FormatError) as caught:
        motions(read_score(path))
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 600
    assert any(message.startswith(f"{path}:{line}: ") for line in lines), message
    assert re.search(wanted, message.removeprefix(str(path))), message


WHOLES = {
    "nothing": ("", r"clip"),
    "comments": ("# nothing\n   # at all\n", r"clip"),
    "an indented beginning": ("  first = stand\n", r":1: an indented line before any heading"),
    "bytes": (bytes(range(256)), r":\d+: "),
    "zeros": (b"\0" * 64, r":\d+: "),
    "UTF-16 without a mark": ("body human23\n".encode("utf-16-le"), r":\d+: "),
    "half of UTF-16": (b"\xff\xfebody"[:-1], r":\d+: "),
}


@pytest.mark.parametrize("whole", WHOLES)
def test_a_file_that_is_no_score_is_told_so(whole: str, tmp_path: Path) -> None:
    content, wanted = WHOLES[whole]
    path = write(tmp_path, content)
    with pytest.raises(FormatError, match=wanted) as caught:
        compose(path)
    assert str(caught.value).startswith(str(path))
    assert not re.search(r"[:;,] *$", str(caught.value))


def test_clips_and_postures_that_are_not_there_are_told(tmp_path: Path) -> None:
    path = write(tmp_path, VOCABULARY + PIECE + "clip other\n  1 | first\n")
    with pytest.raises(FormatError, match="2 clips; choose one: piece, other"):
        compose(path)
    with pytest.raises(FormatError, match=r"no clip 'peice'; did you mean piece\?"):
        compose(path, "peice")
    with pytest.raises(FormatError, match=r"no posture 'opn'; did you mean open\?"):
        notation.posture(read_score(path), "opn")


def test_a_slip_in_an_included_score_is_told_of_that_score(tmp_path: Path) -> None:
    other = write(tmp_path, VOCABULARY + "phrase q\n  1 | frist\n", "other.score")
    path = write(tmp_path, "include other.score as o\nclip c\n  1 | o.first\n  o.q\n")
    line = len(other.read_text().split("\n")) - 1
    with pytest.raises(FormatError, match=rf"^{re.escape(str(other))}:{line}: 'frist' is not a position"):
        compose(path)


@pytest.mark.parametrize("order", ["include b.score\nbody human44\n", "body human44\ninclude b.score\n"])
def test_a_score_for_another_body_is_not_included(order: str, tmp_path: Path) -> None:
    write(tmp_path, VOCABULARY, "b.score")
    with pytest.raises(FormatError, match=r"a.score:\d: .*for human23.*human44"):
        read_score(write(tmp_path, order))


def test_includes_that_go_round_are_told_of(tmp_path: Path) -> None:
    write(tmp_path, "include a.score as a\n", "b.score")
    with pytest.raises(FormatError, match=r"b.score:1: .*includes itself"):
        read_score(write(tmp_path, "include b.score as b\n"))


@pytest.mark.long
def test_a_great_number_of_postures_is_refused_before_the_memory_is_full(tmp_path: Path) -> None:
    for how in ("1000 times, 1000 times, 1000 times", ", ".join(["there and back"] * 40)):
        with pytest.raises(FormatError, match="postures"):
            moved(tmp_path, f"phrase q\n  1 | first\n  1 | first plie\nclip c\n  q, {how}\n")


LINE_ENDS = {
    "CRLF": lambda text: text.replace("\n", "\r\n").encode(),
    "CR": lambda text: text.replace("\n", "\r").encode(),
    "a mark": lambda text: b"\xef\xbb\xbf" + text.encode(),
    "UTF-16": lambda text: text.encode("utf-16"),
    "tabs": lambda text: text.replace("  ", "\t").encode(),
    "no end": lambda text: text.rstrip().encode(),
    "empty lines": lambda text: text.replace("\n", "\n\n  \n").encode(),
    "comments": lambda text: text.replace("\n", "  # what follows | is = nothing,\n").encode(),
    "wide": lambda text: text.replace(" | ", "   |   ").replace("\n", "   \n").encode(),
    "narrow": lambda text: text.replace(" | ", "|").encode(),
    "another depth": lambda text: re.sub("\n  ([a-z0-9])", "\n        \\1", text).encode(),
}


@pytest.mark.parametrize("end", LINE_ENDS)
def test_how_a_file_is_saved_changes_nothing(end: str, tmp_path: Path) -> None:
    text = VOCABULARY + PIECE
    same(compose(write(tmp_path, LINE_ENDS[end](text), "b.score")), compose(write(tmp_path, text)))


def test_names_may_be_of_any_language(tmp_path: Path) -> None:
    text = VOCABULARY + PIECE
    for name in ("port-de-bras-é", "второй", "五番", "relevé_2"):
        same(moved(tmp_path, text.replace("second", name), ""), moved(tmp_path, text, ""))


@pytest.mark.parametrize("seed", range(120))
def test_a_damaged_score_is_movement_or_one_clear_line(seed: int, tmp_path: Path, mutate: Mutate) -> None:
    rng = random.Random(seed)
    other = write(tmp_path, VOCABULARY, "other.score")
    text = VOCABULARY + PIECE if seed % 4 else "include other.score\n" + PIECE
    compiles_or_tells(write(tmp_path, mutate(text, rng) if seed % 2 else moved_lines(text, rng)), other)


def moved_lines(text: str, rng: random.Random) -> str:
    """`text` with lines, cells or characters deleted, doubled or exchanged."""
    for _ in range(rng.randint(1, 3)):
        mark = rng.choice(["\n", "\n", "|", ""])
        parts = text.split(mark) if mark else list(text)
        at, other = rng.randrange(len(parts)), rng.randrange(len(parts))
        match rng.randrange(3):
            case 0:
                del parts[at]
            case 1:
                parts.insert(other, parts[at])
            case 2:
                parts[at], parts[other] = parts[other], parts[at]
        text = mark.join(parts)
    return text


def compiles_or_tells(path: Path, *others: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            score = read_score(path)
            motions(score)
            for name in score.postures:
                notation.posture(score, name)
        except FormatError as error:
            message = str(error)
            assert "\n" not in message
            assert any(re.match(rf"{re.escape(str(file))}:\d+: \S", message) for file in (path, *others)), message


@given(
    st.text(st.sampled_from("ab1 ()|/=,.:#-\n\t é\0"), max_size=60), st.sampled_from(["", "phrase q (A)\n  ", C + "  "])
)
@settings(max_examples=100)
def test_any_text_is_movement_or_one_clear_line(tmp_path_factory: Any, text: str, before: str) -> None:
    path = tmp_path_factory.getbasetemp() / "any.score"
    path.write_bytes(f"{VOCABULARY}{before}{text}".encode())
    compiles_or_tells(path)


# --- the algebra of phrases -------------------------------------------------------------------------------------------

LEGS = (
    "first",
    "fifth left",
    "fifth right",
    "tendu left",
    "passe right",
    "first plie",
    "fifth left releve",
    "leaning left",
    "push right",
)
ARMS = ("bas", "second", "third left", "third right", "bas / second", "second / bas")
TORSO = ("upright", "arched", "aside left", "aside right", "twisted left", "twisted right")
HEAD = ("front", "turned left", "turned right", "nod")
HOW = ("", "1", "2", "1/2", "0.75", "1 face corner left", "1 face 30 right", "1 turn 90 left", "2 turn 45 right")
AIR = ("1 up 10", "1 up 25 go ahead 30 left 12", "1 up 5 turn 90 left go back 20", "1 go right 15")


@st.composite
def lines(draw: Callable[..., Any], whole: bool) -> list[str]:
    """Lines of a phrase: with a beginning, or going on from anywhere."""

    def cells(legs: tuple[str, ...], full: bool = False) -> str:
        blank = () if full else ("",)
        return " | ".join(draw(st.sampled_from((*words, *blank))) for words in (legs, ARMS, TORSO, HEAD))

    out = (
        [f"start face {draw(st.sampled_from(['0', '30 right', 'corner left']))} | {cells(LEGS, True)}"] if whole else []
    )
    for _ in range(draw(st.integers(1, 4))):
        if draw(st.integers(0, 3)) == 0:
            legs = draw(st.sampled_from(["jump", "scissors left", "scissors right"]))
            out.append(f"{draw(st.sampled_from(AIR))} | {legs} | {cells(ARMS).partition(' | ')[2]}")
        else:
            out.append(f"{draw(st.sampled_from(HOW))} | {cells(LEGS)}")
    return out


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("scores")


def in_phrase(name: str, said: list[str]) -> str:
    return f"phrase {name}\n" + "".join(f"  {line}\n" for line in said)


START = "  start face 20 left | fifth right | bas / second | aside left | turned right\n"
laws = settings(max_examples=15)


@pytest.mark.long
@given(lines(whole=True))
@laws
def test_the_other_side_twice_and_backwards_twice_are_the_phrase(folder: Path, said: list[str]) -> None:
    q = in_phrase("q", said)
    plain = moved(folder, f"{q}clip c\n  q\n")
    same(plain, moved(folder, f"{q}clip c\n  q, other side, other side\n"))
    same(plain, moved(folder, f"{q}clip c\n  q, 1 times\n"))
    again = moved(folder, f"{q}clip c\n  q, backwards, backwards\n")
    np.testing.assert_array_equal(plain.rotations, again.rotations)
    np.testing.assert_allclose(plain.root, again.root, atol=1.1e-5)  # a sine of 90 degrees and back
    np.testing.assert_array_equal(plain.times, again.times)


@given(lines(whole=True))
@laws
def test_the_other_side_is_the_mirror_image(folder: Path, said: list[str]) -> None:
    q = in_phrase("q", said)
    image = mirrored(moved(folder, f"{q}clip c\n  q\n"))
    other = moved(folder, f"{q}clip c\n  q, other side\n")
    np.testing.assert_array_equal(other.times, image.times)
    np.testing.assert_allclose(other.root, image.root, atol=3e-5)
    assert rot.angle(other.rotations, image.rotations).max() < 1e-4


@pytest.mark.long
@given(lines(whole=True))
@laws
def test_backwards_is_the_way_back(folder: Path, said: list[str]) -> None:
    q = in_phrase("q", said)
    there = moved(folder, f"{q}clip c\n  q\n")
    back = moved(folder, f"{q}clip c\n  q, backwards\n")
    np.testing.assert_array_equal(back.rotations, there.rotations[::-1])
    np.testing.assert_allclose(np.diff(back.times), np.diff(there.times)[::-1], atol=2e-4)
    both = moved(folder, f"{q}clip c\n  q\n  q, backwards\n")
    same(both, moved(folder, f"{q}clip c\n  q, there and back\n"))
    # Every step is taken back, and the body ends where it began.
    np.testing.assert_allclose(both.root, both.root[::-1], atol=2e-5 * len(both))


@given(lines(whole=False))
@laws
def test_a_phrase_that_goes_on_returns_to_where_it_began(folder: Path, said: list[str]) -> None:
    q = in_phrase("q", said)
    motion = moved(folder, f"{q}clip c\n{START}  q, there and back\n")
    assert len(motion) == 2 * len(said) + 1
    np.testing.assert_array_equal(motion.rotations, motion.rotations[::-1])


@pytest.mark.long
@given(lines(whole=False), st.integers(1, 4))
@laws
def test_so_many_times_is_so_many_calls(folder: Path, said: list[str], times: int) -> None:
    q = in_phrase("q", said)
    called = moved(folder, f"{q}clip c\n{START}" + "  q\n" * times)
    same(called, moved(folder, f"{q}clip c\n{START}  q, {times} times\n"))
    written = "".join(f"  {line}\n" for line in said)
    same(called, moved(folder, f"clip c\n{START}" + written * times))


@pytest.mark.long
@given(lines(whole=False))
@laws
def test_a_phrase_that_goes_on_is_mirrored_where_it_stands(folder: Path, said: list[str]) -> None:
    """Blank cells keep what stood there: the whole is the mirror image of the phrase after the mirrored beginning."""
    q = in_phrase("q", said)
    image = "  start face 20 right | fifth left | second / bas | aside right | turned left\n"
    other = moved(folder, f"{q}clip c\n{START}  q, other side\n")
    plain = mirrored(moved(folder, f"{q}clip c\n{image}  q\n"))
    np.testing.assert_allclose(other.root - other.root[0], plain.root - plain.root[0], atol=3e-5)
    assert rot.angle(other.rotations, plain.rotations).max() < 1e-4


@given(lines(whole=True), lines(whole=True))
@laws
def test_a_layer_of_another_phrase_is_laid_over_line_by_line(folder: Path, said: list[str], other: list[str]) -> None:
    text = f"{in_phrase('q', said)}{in_phrase('r', other)}phrase both\n  q, with arms head of r\n"
    score = read_score(write(folder, VOCABULARY + text))
    q, r, both = (phrases.play_phrase(score.phrases[name]) for name in ("q", "r", "both"))
    r += [r[-1]] * len(q)
    for upper, lower, whole in zip(r, q, both, strict=False):
        for layer, name in enumerate(score.body.layers):
            source = upper if name in ("arms", "head") else lower
            assert whole.limbs[layer] == source.limbs[layer]
            assert whole.words[layer] == source.words[layer]
        assert whole._replace(limbs=(), words=(), line=0) == lower._replace(limbs=(), words=(), line=0)
    assert len(both) == len(q)


@pytest.mark.parametrize("start", ["", "  start | first\n"])
def test_a_turn_can_be_taken_back(start: str, tmp_path: Path) -> None:
    """A phrase that turns from wherever it is done, then the same backwards, is there and back."""
    q = f"phrase q\n{start}  1 turn 90 left | first\n  1 turn 30 right | first plie\n"
    there = moved(tmp_path, f"{q}clip c\n  start face 20 left | first\n  q\n  q, backwards\n")
    back = moved(tmp_path, f"{q}clip c\n  start face 20 left | first\n  q, there and back\n")
    # Without a beginning of its own the phrase, backwards, ends at its first line.
    np.testing.assert_array_equal(there.rotations, back.rotations[: len(there)])
    assert len(back) - len(there) == (0 if start else 1)


def test_a_layer_is_taken_from_a_phrase_that_begins_as_well(tmp_path: Path) -> None:
    """What stands there need not be where the other phrase's other layers begin."""
    text = "phrase q\n  1 | first\n  1 | first plie\n"
    text += "phrase r\n  start | fifth left | bas\n  1 | | second\n  1 | | third left\n"
    found = moved(tmp_path, f"{text}clip c\n  start | first plie | bas\n  q, with arms of r\n")
    same(found, moved(tmp_path, "  start | first plie | bas\n  1 | first | second\n  1 | first plie | third left\n"))


@given(lines(whole=True))
@laws
def test_a_phrase_is_followed_by_one_that_begins_where_it_ends(folder: Path, said: list[str]) -> None:
    """Every chain of a phrase, back, and there again is movement without a jump."""
    q = in_phrase("q", said)
    once = moved(folder, f"{q}clip c\n  q\n")
    motion = moved(folder, f"{q}clip c\n  q\n  q, backwards\n  q\n  q, backwards, there and back\n")
    assert len(motion) == 5 * (len(once) - 1) + 1
    np.testing.assert_array_equal(motion.rotations[: len(once)], once.rotations)
    np.testing.assert_array_equal(motion.rotations[-len(once) :], once.rotations)


def test_open_words_are_filled_all_at_once(tmp_path: Path) -> None:
    text = "legs\n  A-not = on\n  A = on, bend 20\narms\n  B = bas\n"
    text += "phrase q (A, B)\n  1 | A | B\n  1 | A plie\n  1 | A-not | B\n"
    found = moved(tmp_path, f"{text}clip c\n  start | first | bas\n  q (fifth left, second)\n")
    lines_ = "  1 | fifth left | second\n  1 | fifth left plie\n  1 | A-not | second\n"
    same(found, moved(tmp_path, f"{text}clip c\n  start | first | bas\n{lines_}"))
    crossed = moved(
        tmp_path, f"phrase q (bas, second)\n  1 | | bas\n  1 | | second\nclip c\n{START}  q (second, bas)\n"
    )
    same(crossed, moved(tmp_path, f"clip c\n{START}  1 | | second\n  1 | | bas\n"))


def test_open_words_go_on_to_other_phrases(tmp_path: Path) -> None:
    inner = "phrase inner (X)\n  1 | X plie\n  1 | X\n"
    outer = "phrase outer (PLACE, HOW)\n  inner (PLACE), HOW\n  inner (PLACE releve)\n"
    found = moved(tmp_path, f"{outer}{inner}clip c\n{START}  outer (fifth right, other side), 2 times\n")
    once = "  1 | fifth left plie\n  1 | fifth left\n  1 | fifth right releve plie\n  1 | fifth right releve\n"
    same(found, moved(tmp_path, f"clip c\n{START}{once * 2}"))


def test_included_scores_keep_their_own_words(tmp_path: Path) -> None:
    """Of three scores one in another each has its own `first`; a name reaches through to each."""
    deep = VOCABULARY + "phrase q\n  1 | first\n"
    middle = (
        VOCABULARY.replace("out 7 ahead 4 turn 60", "out 12")
        + "include deep.score as deep\nphrase q\n  1 | first\n  deep.q\n"
    )
    write(tmp_path, deep, "deep.score")
    write(tmp_path, middle, "middle.score")
    top = "include middle.score as m\nlegs\n  first = stand out 2\nclip c\n"
    found = compose(write(tmp_path, top + "  start | first\n  m.q\n  1 | m.first\n  m.q, other side\n"))
    vocabulary = VOCABULARY + "legs\n  second = stand out 12\n  close = stand out 2\n"
    said = "  start | close\n" + "".join(f"  1 | {name}\n" for name in ("second", "first", "second", "second", "first"))
    expected = moved(tmp_path, said, vocabulary)
    np.testing.assert_array_equal(found.rotations, expected.rotations)
    np.testing.assert_array_equal(found.root, expected.root)
    np.testing.assert_allclose(found.times, 2.0 * expected.times, atol=2e-4)  # a minute has 60 counts where none says


def test_an_include_without_a_name_is_as_if_it_stood_there(tmp_path: Path) -> None:
    write(tmp_path, VOCABULARY, "words.score")
    found = compose(write(tmp_path, f"include words.score\ntempo 120\n{PIECE}"))
    same(found, compose(write(tmp_path, VOCABULARY + PIECE)))


def test_a_tempo_holds_until_its_phrase_ends(tmp_path: Path) -> None:
    text = "phrase q\n  1 | first plie\n  tempo 30\n  1 | first\n"
    text += "clip c\n  start | first\n  q\n  1 | first plie\n  tempo 240\n  q\n"
    found = moved(tmp_path, text)
    np.testing.assert_allclose(np.diff(found.times), [0.5, 2.0, 0.5, 0.25, 2.0])


def test_a_long_definition_goes_on_in_the_next_line(tmp_path: Path) -> None:
    text = "arms\n  odd = shoulder flexion 30 abduction 20,\n        elbow flexion 40,  # bent\n    wrist flexion 10\n"
    short = "arms\n  odd = shoulder flexion 30 abduction 20, elbow flexion 40, wrist flexion 10\n"
    said = "clip c\n  start | first | odd\n"
    same(moved(tmp_path, text + said), moved(tmp_path, short + said))


def test_what_comes_later_replaces_what_came_before_angle_by_angle(tmp_path: Path) -> None:
    more = "arms\n  high = bas, shoulder flexion 90\n"
    more += "  same = shoulder flexion 90 abduction 14 rotation -30, elbow flexion 38\n"
    for text in ("first | high", "first | bas high"):
        a, b = posed(tmp_path, text, more), posed(tmp_path, "first | same", more)
        np.testing.assert_array_equal(a.rotations, b.rotations)


def test_the_opposite_of_an_angle_is_its_negative(tmp_path: Path) -> None:
    for human in (HUMAN, anatomy_named("human44")):
        for layer, joints in human.layers.items():
            for joint in joints:
                for word, angle in human.joints[joint].angles.items():
                    if not angle.opposite or joint in human.groups:
                        continue
                    far = round(-angle.range[0] / 2.0)
                    text = f"body {human.skeleton.name}\n{layer}\n"
                    text += f"  a = {joint} {angle.opposite} {far}\n  b = {joint} {word} {-far}\n"
                    words = read_score(write(tmp_path, text)).positions[layer]
                    assert words["a"].lead == words["b"].lead


# --- standing and travelling ------------------------------------------------------------------------------------------

amounts = st.integers(0, 20)


@st.composite
def stances(draw: Callable[..., Any]) -> str:
    """A position of the legs on both feet, as it is written."""
    feet = [
        f"stand out {draw(st.integers(-3, 15))} ahead {draw(st.integers(-12, 15))} turn {draw(st.integers(0, 60))} "
        f"bend {3 * draw(amounts)} heel {2 * draw(amounts)} weight {10 + 4 * draw(amounts)}"
        for _ in SIDES
    ]
    lean = f" lean ahead {draw(st.integers(-4, 4))}"
    return f"{feet[0]}{lean} / {feet[1]}{lean}"


@given(stances())
@settings(max_examples=20)
def test_feet_are_where_a_score_says(folder: Path, text: str) -> None:
    posture = posed(folder, "odd left | second | aside left | turned left", f"legs\n  odd = {text}\n")
    found = places(posture.as_motion())
    balls = [found[f"{side}_toes"][0] for side in SIDES]
    hips = HUMAN.skeleton.offsets[HUMAN.skeleton.index("left_hip")][0]
    said = [dict(zip(part.split()[1::2], part.split()[2::2], strict=False)) for part in text.split(" / ")]
    apart = 2.0 * hips + sum(float(foot["out"]) for foot in said) / 100.0
    along = (float(said[0]["ahead"]) - float(said[1]["ahead"])) / 100.0
    np.testing.assert_allclose(balls[0] - balls[1], [apart, 0.0, along], atol=2e-5)
    for side, foot, sign in zip(SIDES, said, (1.0, -1.0), strict=True):
        tip = found[f"{side}_toes_tip"][0] - found[f"{side}_toes"][0]
        assert found[f"{side}_toes"][0, 1] == pytest.approx(0.0, abs=2e-5)
        assert np.degrees(np.arctan2(sign * tip[0], tip[2])) == pytest.approx(float(foot["turn"]), abs=1e-3)
        assert tip[1] == pytest.approx(0.0, abs=1e-6)


def test_the_other_foot_bears_what_one_does_not(tmp_path: Path) -> None:
    said = ("stand weight 70 / stand weight 30", "stand weight 70 / stand", "stand / stand weight 30")
    found = [posed(tmp_path, "odd right", f"legs\n  odd = {text}\n") for text in said]
    shared = posed(tmp_path, "odd right", "legs\n  odd = stand / stand\n")
    for posture in found:
        np.testing.assert_array_equal(posture.rotations, found[0].rotations)
        np.testing.assert_array_equal(posture.root, found[0].root)
    # The feet are as far apart as the hips: with 70 parts of 100 the weight is two fifths of the way out to the one.
    aside = [HUMAN.centre_of_mass(posture.rotations, posture.root)[0] for posture in (found[0], shared)]
    hips = HUMAN.skeleton.offsets[HUMAN.skeleton.index("left_hip")][0]
    assert aside[1] == pytest.approx(0.0, abs=1e-5)
    assert aside[0] == pytest.approx(-0.4 * hips, abs=1e-5)


def test_an_included_clip_keeps_its_tempo_and_a_phrase_takes_that_of_its_caller(tmp_path: Path) -> None:
    write(tmp_path, VOCABULARY + "phrase q\n  1 | first plie\n  1 | first\nclip d\n  q\n", "other.score")
    found = moved(tmp_path, "include other.score as o\ntempo 60\nclip c\n  start | o.first\n  o.q\n  o.d\n", "")
    np.testing.assert_allclose(np.diff(found.times), [1.0, 1.0, 0.5, 0.5])


@pytest.mark.long
@given(stances(), st.integers(-180, 180))
@settings(max_examples=20)
def test_facing_elsewhere_is_the_same_body_turned(folder: Path, text: str, degrees: int) -> None:
    words = f"legs\n  odd = {text}\n"
    side = "left" if degrees >= 0 else "right"
    ahead, turned = (
        moved(folder, f"{words}clip c\n  start {how} | odd right | third left | twisted left | turned right\n")
        for how in ("", f"face {abs(degrees)} {side}")
    )
    np.testing.assert_array_equal(ahead.rotations[:, 1:], turned.rotations[:, 1:])
    turn = rot.about_vertical(np.radians(degrees))
    np.testing.assert_allclose(turned.root, rot.mul_vec(turn, ahead.root), atol=1.1e-5)
    assert rot.angle(turned.rotations[:, 0], rot.mul(turn, ahead.rotations[:, 0])).max() < 1e-7


@given(st.lists(st.tuples(st.sampled_from(LEGS), st.sampled_from(HOW[:5])), min_size=2, max_size=6))
@settings(max_examples=20)
def test_feet_that_bear_weight_stay(folder: Path, said: list[tuple[str, str]]) -> None:
    """A foot that alone bears weight before and after stays; of two their middle, by what they bear, does."""
    motion = moved(folder, "".join(f"  {how or 1} | {legs}\n" for legs, how in said))
    found = places(motion)
    for t, ((before, _), (after, _)) in enumerate(pairwise(said), start=1):
        held = [min(shares) for shares in zip(borne(before), borne(after), strict=True)]
        if any(held):
            slip = sum(
                share * (found[f"{side}_toes"][t] - found[f"{side}_toes"][t - 1])
                for side, share in zip(SIDES, held, strict=True)
            )
            assert np.abs(slip / sum(held)).max() < 1.1e-5  # the root is rounded to a hundredth of a millimetre


def borne(legs: str) -> tuple[float, float]:
    """The weight that the left and the right foot bear."""
    return {"tendu left": (0.0, 50.0), "passe right": (50.0, 0.0), "push right": (30.0, 70.0)}.get(legs, (50.0, 50.0))


@given(st.sampled_from(LEGS), st.integers(0, 179), st.integers(0, 3))
@settings(max_examples=20)
def test_a_body_turns_over_the_foot_that_bears_it(folder: Path, legs: str, degrees: int, arms: int) -> None:
    motion = moved(folder, f"  start | {legs}\n  1 turn {degrees} left | | {ARMS[arms]} | arched\n")
    found = places(motion)
    held = borne(legs)
    middle = sum(share * found[f"{side}_toes"] for side, share in zip(SIDES, held, strict=True)) / sum(held)
    assert np.abs(middle[1] - middle[0]).max() < 1.1e-5


def test_a_foot_turns_about_its_heel_where_it_should(tmp_path: Path) -> None:
    text = "legs\n  fixed = stand pivot 17 / hip flexion 30, knee flexion 60\n"
    motion = moved(tmp_path, f"{text}clip c\n  start | fixed left\n  1 turn 90 left\n")
    found = places(motion)
    forward = found["left_toes_tip"] - found["left_toes"]
    heel = found["left_toes"] - 0.17 * forward / np.linalg.norm(forward, axis=-1, keepdims=True)
    np.testing.assert_allclose(heel[0], heel[1], atol=1.1e-5)
    assert np.linalg.norm(found["left_toes"][1] - found["left_toes"][0]) > 0.2


@given(st.integers(-60, 60), st.integers(-60, 60), st.integers(-170, 170), st.booleans())
@settings(max_examples=20)
def test_a_leap_carries_the_weight_so_far(folder: Path, left: int, ahead: int, face: int, landing: bool) -> None:
    """In the body's own heading, by exactly that, whatever the limbs do meanwhile."""
    where = f"go {'left' if left >= 0 else 'right'} {abs(left)} {'ahead' if ahead >= 0 else 'back'} {abs(ahead)}"
    facing = f"face {abs(face)} {'left' if face >= 0 else 'right'}"
    end = "fifth left" if landing else "scissors left"
    motion = moved(
        folder, f"  start {facing} up 10 | jump | bas\n  1 {'' if landing else 'up 30'} {where} | {end} | second\n"
    )
    centre = HUMAN.centre_of_mass(motion.rotations, motion.root)
    wanted = rot.mul_vec(rot.about_vertical(np.radians(face)), np.array([left, 0.0, ahead]) / 100.0)
    np.testing.assert_allclose((centre[1] - centre[0])[[0, 2]], wanted[[0, 2]], atol=2e-5)


@given(st.integers(0, 60), st.sampled_from(["jump", "scissors left"]))
@settings(max_examples=20)
def test_in_the_air_the_lowest_point_is_so_high(folder: Path, up: int, legs: str) -> None:
    motion = moved(folder, f"  start up {up} | {legs} | second\n  1 | {legs}\n")
    lowest, _ = lowest_point(HUMAN, motion.rotations, motion.root)
    np.testing.assert_allclose(lowest, [up / 100.0, 0.0], atol=1.1e-5)


@given(st.lists(st.sampled_from(["1", "2", "1/2", "1/3", "0.75", "3/8", "12", ""]), min_size=1, max_size=12))
@settings(max_examples=20)
def test_times_add_up(folder: Path, counts: list[str]) -> None:
    motion = moved(
        folder,
        "  start | first\n"
        + "".join(f"  {count} | {legs}\n" for count, legs in zip(counts, ["first plie", "first"] * 6, strict=False)),
    )
    seconds = [0.5 * float(Fraction(count or 1)) for count in counts]
    np.testing.assert_allclose(motion.times, np.cumsum([0.0, *seconds]), atol=6e-5)


def test_a_clip_is_the_same_whatever_else_is_in_the_score(tmp_path: Path) -> None:
    more = "".join(
        f"clip more-{n}\n  start | {legs} | {ARMS[n % 6]} | {TORSO[n % 6]}\n  1 turn 40 left\n"
        for n, legs in enumerate(LEGS)
    )
    alone = compose(write(tmp_path, VOCABULARY + PIECE, "alone.score"))
    path = write(tmp_path, VOCABULARY + PIECE + more)
    same(alone, compose(path, "piece"))
    same(alone, motions(read_score(path))[0])


def test_the_same_score_is_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From anywhere, by whatever path, with what it includes beside it."""
    (tmp_path / "scores" / "words").mkdir(parents=True)
    write(tmp_path, VOCABULARY, "scores/words/words.score")
    path = write(tmp_path, f"include words/words.score\n{PIECE}", "scores/a.score")
    outputs = []
    for folder_, name in (
        (tmp_path, path),
        (tmp_path, "scores/a.score"),
        (tmp_path / "scores", "a.score"),
        (tmp_path / "scores" / "words", "../a.score"),
    ):
        monkeypatch.chdir(folder_)
        out = tmp_path / f"{len(outputs)}.json"
        write_motion(out, compose(name))
        outputs.append(out.read_bytes())
    assert len(set(outputs)) == 1


def test_a_score_anywhere_includes_one_of_a_corpus_that_comes_along(tmp_path: Path) -> None:
    """Unless a file of that name is beside it."""
    text = "include ballet/vocabulary.score\n"
    path = write(tmp_path, f"{text}clip c\n  start | fifth left | fifth | upright | front\n  1 | first\n")
    vocabulary = bundled("corpora") / "ballet" / "vocabulary.score"
    assert set(read_score(path).postures) == set(read_score(vocabulary).postures)
    assert sources(path) == [path.resolve(), vocabulary.resolve()]
    assert len(compose(path)) == 2
    (tmp_path / "ballet").mkdir()
    own, path = write(tmp_path, VOCABULARY, "ballet/vocabulary.score"), write(tmp_path, text, "b.score")
    assert set(read_score(path).phrases) == set(read_score(own).phrases)
    assert sources(path) == [path.resolve(), own.resolve()]


def test_scores_that_are_read_together_have_the_bounds_of_each(tmp_path: Path) -> None:
    words = [write(tmp_path, "", f"{number}.score") for number in range(2 * MAX_INCLUDES)]
    halves = [words[:MAX_INCLUDES], words[MAX_INCLUDES:]]
    texts = ["".join(f"include {word.name}\n" for word in half) for half in halves]
    paths = [write(tmp_path, text, f"{name}.score") for text, name in zip(texts, "ab", strict=True)]
    scores, files = read_scores(paths)
    assert [score.path for score in scores] == [str(path) for path in paths]
    assert {*paths, *words} <= set(files)
    with pytest.raises(FormatError, match=f"more than {MAX_INCLUDES} scores are included"):
        read_scores([write(tmp_path, "".join(texts), "all.score")])


def test_what_a_score_is_made_of_is_found(tmp_path: Path) -> None:
    """Each file once, also of scores that go round in a circle by different paths."""
    (tmp_path / "more").mkdir()
    paths = [
        write(tmp_path, "body worm.toml # of our own\ninclude more/b.score as b\ninclude c.score\n"),
        write(tmp_path, "", "worm.toml"),
        write(tmp_path, "include ../a.score as a\ninclude ../c.score # again\n", "more/b.score"),
        write(tmp_path, "# include nobody.score\nbody human23\n", "c.score"),
    ]
    found = [path.resolve() for path in sources(paths[0])]
    assert sorted(found) == sorted(path.resolve() for path in paths)


def test_a_score_for_one_body_is_one_for_the_other(tmp_path: Path) -> None:
    """Feet are on the floor where they were; the heavier parts, and so the hips, are almost where they were."""
    coarse, fine = (compose(write(tmp_path, VOCABULARY.replace("human23", name) + PIECE)) for name in BODIES)
    assert fine.skeleton.names == anatomy_named("human44").skeleton.names
    np.testing.assert_array_equal(fine.times, coarse.times)
    a, b = places(coarse), places(fine)
    for joint in ("left_toes", "right_toes"):
        np.testing.assert_allclose(b[joint][:9], a[joint][:9], atol=0.02)
    for joint in ("pelvis", "left_knee", "right_wrist", "thorax", "atlantal"):
        np.testing.assert_allclose(b[joint], a[joint], atol=0.05)
    assert fine.skeleton.positions_and_tips(fine.rotations, fine.root)[..., 1].min() > -0.01


def test_rows_tell_where_they_were_written(tmp_path: Path) -> None:
    text = VOCABULARY + PIECE
    score = read_score(write(tmp_path, text))
    ((rows, motion),) = notation.played(score)
    assert len(rows) == len(motion)
    for row in rows:
        assert isinstance(row, Row)
        assert text.split("\n")[row.where.line - 1].startswith("  ")


# --- bodies in files --------------------------------------------------------------------------------------------------

WORM = """format = "motionmind-body"
version = 1
name = "worm"
layers = { all = ["root", "tail"] }
[[skeleton]]
name = "root"
[[skeleton]]
name = "tail"
parent = "root"
offset = [0, 0, -0.5]
tip = [0, 0, -0.5]
[joints.root]
long = "z"
tilt = { about = "x", range = [-90, 90] }
[joints.tail]
long = "z"
bend = { about = "y", range = [-90, 90] }
"""

WRONG_BODIES = {
    "no joint": (WORM.replace("[joints.tail]", "[joints.tial]"), r"tial.*did you mean tail"),
    "no table of a joint": (WORM.partition("[joints.tail]")[0], r"\[joints.tail\]"),
    "no layer": (WORM.replace('"root", "tail"', '"root"'), r"tail must be in one layer"),
    "an unknown joint in a layer": (WORM.replace('"root", "tail"', '"root", "tail", "wing"'), r"wing"),
    "an empty layer": (WORM.replace('"tail"] }', '"tail"], none = [] }'), r"none"),
    "an axis that is none": (WORM.replace('about = "y"', 'about = "w"'), r"axis"),
    "a length that is none": (WORM.replace('long = "z"\nbend', 'long = "w"\nbend'), r"long must be x, y or z"),
    "an unknown parent": (WORM.replace('parent = "root"', 'parent = "head"'), r"head"),
    "limits the wrong way round": (
        WORM.replace('bend = { about = "y", range = [-90, 90]', 'bend = { about = "y", range = [90, -90]'),
        r"bend",
    ),
    "a frame that is none": (WORM.replace('long = "z"\nbend', 'long = "z"\nagainst = "nobody"\nbend'), r"nobody"),
    "a frame that is no ancestor": (WORM.replace('long = "z"\nbend', 'long = "z"\nagainst = "tail"\nbend'), r"tail"),
    "a leg of no joints": (
        WORM.replace("[joints.root]", '[leg]\nhip = "a"\nknee = "b"\nankle = "c"\ntoes = "d"\n[joints.root]'),
        r"leg",
    ),
    "an axis twice": (WORM + 'sway = { about = "-y", range = [-90, 90] }\n', r"joints.tail.*one axis"),
    "another format": (WORM.replace("motionmind-body", "other"), r"other"),
    "not TOML": ("[", r"cannot be read"),
}


def test_a_body_of_ones_own_moves(tmp_path: Path) -> None:
    write(tmp_path, WORM, "worm.toml")
    motion = compose(
        write(
            tmp_path,
            "body worm.toml\nall\n  curled = tail bend 40\nclip c\n  start\n  1 | curled left\n  1 | curled right\n",
        )
    )
    assert motion.skeleton.names == ("root", "tail")
    np.testing.assert_allclose(np.degrees(rot.angle(motion.rotations[1, 1], motion.rotations[2, 1])), 80.0, atol=1e-4)


@pytest.mark.parametrize("wrong", WRONG_BODIES)
def test_a_wrong_body_is_told(wrong: str, tmp_path: Path) -> None:
    text, wanted = WRONG_BODIES[wrong]
    path = write(tmp_path, text, "worm.toml")
    with pytest.raises(FormatError, match=wanted) as caught:
        read_body(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


# --- the command line -------------------------------------------------------------------------------------------------


def ran(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as end:
        main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    assert isinstance(end.value.code, int)
    return end.value.code, out, err


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    write(tmp_path, VOCABULARY + PIECE)
    write(tmp_path, VOCABULARY + PIECE + "clip other\n  start | first\n  2 | first plie\n", "two.score")
    return tmp_path


@pytest.mark.parametrize("suffix", ["json", "bvh"])
def test_a_user_composes_a_score(suffix: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = ran(capsys, "compose", "a.score", "-o", f"a.{suffix}", "--fps", "30")
    assert (code, err.count("note: ")) == (0, suffix == "bvh")  # how other programs read it
    assert out.count("\n") == 1
    assert out.startswith(f"a.{suffix}: piece, ")
    found, composed = read_motion(here / f"a.{suffix}"), compose("a.score").resample(30.0)
    assert found.skeleton.names == composed.skeleton.names
    assert len(found) == len(composed)
    np.testing.assert_allclose(found.root, composed.root, atol=1e-4)
    assert rot.angle(found.rotations, composed.rotations).max() < 1e-4


def test_a_user_composes_one_clip_of_several(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = ran(capsys, "compose", "two.score", "--clip", "other", "-o", "a.json")
    assert code == 0
    assert "other" in out
    motion = read_motion(here / "a.json")
    assert len(motion) == 2
    assert motion.name == "other"


def test_a_user_composes_a_posture(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for suffix in ("json", "bvh"):
        code, out, _ = ran(capsys, "compose", "a.score", "--posture", "open", "-o", f"open.{suffix}")
        assert code == 0
        assert "open" in out
    found = read_posture(here / "open.json")
    expected = notation.posture(read_score(here / "a.score"), "open")
    assert rot.angle(found.rotations, expected.rotations).max() < 1e-6


MISUSES = {
    "several clips": (["two.score", "-o", "a.json"], "choose one: piece, other"),
    "an unknown clip": (["two.score", "--clip", "othr", "-o", "a.json"], "did you mean other?"),
    "an unknown posture": (["a.score", "--posture", "opn", "-o", "a.json"], "did you mean open?"),
    "both": (["a.score", "--posture", "open", "--clip", "piece", "-o", "a.json"], "not both"),
    "no file": (["b.score", "-o", "a.json"], "b.score"),
    "no output": (["a.score"], "--output"),
    "an unknown format": (["a.score", "-o", "a.xyz"], ".json, .bvh"),
    "itself": (["a.score", "-o", "a.score"], "a.score"),
    "a folder that is not there": (["a.score", "-o", "there/a.json"], "there"),
    "a slip": (["slip.score", "-o", "a.json"], "slip.score:2: 'leg' is not a heading; did you mean legs?"),
}


@pytest.mark.parametrize("misuse", MISUSES)
def test_a_users_slip_is_one_line_and_writes_nothing(
    misuse: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(here, "\nleg\n", "slip.score")
    before = {path: path.read_bytes() for path in here.iterdir()}
    arguments, wanted = MISUSES[misuse]
    code, out, err = ran(capsys, "compose", *arguments)
    assert (code, out) == (2, "")
    assert wanted in err
    assert "Traceback" not in err
    if "usage" not in err.lower():
        assert err.count("\n") == 1
    assert {path: path.read_bytes() for path in here.iterdir()} == before


def test_the_score_in_the_documentation_is_movement(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "notation.md").read_text("utf-8")
    score = read_score(write(tmp_path, re.findall(r"```text\n(.*?)```", text, re.DOTALL)[0]))
    assert motions(score)
    assert [notation.posture(score, name) for name in score.postures]


def test_layers_come_from_a_phrase_whose_open_words_are_filled(tmp_path: Path) -> None:
    text = "phrase q (A, B)\n  1 | | A\n  1 | | B\nphrase w\n  1 | first\n  1 | first plie\n"
    found = moved(tmp_path, f"{text}clip c\n  start | first | bas\n  w, with arms of q (second, bas), 2 times\n")
    lines_ = "  1 | first | second\n  1 | first plie | bas\n" * 2
    same(found, moved(tmp_path, f"  start | first | bas\n{lines_}"))
