"""Joints known by names of limbs: where they hang says what a word means, and what is not clear is no rig."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import tumble

from motionmind.body.anatomy import SIDES
from motionmind.body.skeleton import Skeleton
from motionmind.retarget.joint_mapping import describe_unknown_rig, joint_mapping
from motionmind.retarget.limb_names import map_by_limbs
from motionmind.retarget.retarget import to_human23

TRUNK = "Hips Spine<Hips Chest<Spine Neck<Chest Head<Neck"
LEG = "Thigh_{S}<Hips Shin_{S}<Thigh_{S} Foot_{S}<Shin_{S} Toe_{S}<Foot_{S}"
ARM = "UpperArm_{S}<Chest Forearm_{S}<UpperArm_{S} Hand_{S}<Forearm_{S}"


def read_tree(text: str) -> tuple[list[str], list[int]]:
    """Names and parents of bones, each "name<parent"; {S} stands for left and right."""
    rows = [row for side in "LR" for row in text.replace("{S}", side).split()]
    rows = list(dict.fromkeys(rows))
    names = [row.partition("<")[0] for row in rows]
    above = [row.partition("<")[2] for row in rows]
    order = sorted(range(len(rows)), key=lambda i: depth(i, names, above))
    names, above = [names[i] for i in order], [above[i] for i in order]
    return names, [names.index(parent) if parent else -1 for parent in above]


def depth(i: int, names: list[str], above: list[str]) -> int:
    return depth(names.index(above[i]), names, above) + 1 if above[i] else 0


def mapped(text: str) -> dict[str, str]:
    """What bones map to, by their names; empty if they are no rig."""
    names, parents = read_tree(text)
    return {names[i]: joint for i, joint in (map_by_limbs(names, parents) or {}).items()}


def test_thighs_and_shins() -> None:
    found = mapped(f"{TRUNK} {LEG} {ARM}")
    assert found["Hips"] == "pelvis"
    assert [found[name] for name in ("Spine", "Chest", "Neck", "Head")] == ["lumbar", "thorax", "cervical", "atlantal"]
    assert [found[f"{name}_L"] for name in ("Thigh", "Shin", "Foot")] == ["left_hip", "left_knee", "left_ankle"]
    assert [found[f"{name}_R"] for name in ("UpperArm", "Hand", "Toe")] == [
        "right_shoulder",
        "right_wrist",
        "right_toes",
    ]


def hung(bones: list[str], above: str) -> str:
    """The bones of a limb on both sides, each on the one before, the first on a joint of the trunk."""
    named = [f"{bone}_{{S}}" for bone in bones]
    return " ".join(f"{bone}<{parent}" for bone, parent in zip(named, [above, *named], strict=False))


@pytest.mark.parametrize(
    ("leg", "joints"),
    [
        ("UpLeg Leg Foot", "hip knee ankle"),
        ("Leg Knee Foot", "hip knee ankle"),
        ("Hip Leg Foot", "hip knee ankle"),
        ("Hip Thigh Shin Foot", "- hip knee ankle"),
        ("Hip Leg Knee Ankle", "- - - -"),  # the thigh may be the hip's or the leg's
        ("Thigh Knee Ankle Foot", "hip knee ankle toes"),
        ("Thigh Knee Foot Ball", "hip knee ankle toes"),
        ("Thigh ThighTwist Calf Foot", "hip hip knee ankle"),
        ("Thigh Muscle Calf Foot", "hip - knee ankle"),
    ],
)
def test_what_a_word_of_a_leg_means_is_where_it_hangs(leg: str, joints: str) -> None:
    bones = leg.split()
    found = mapped(f"{TRUNK} {ARM} {hung(bones, 'Hips')}")
    assert [found.get(f"{bone}_R", "-").removeprefix("right_") for bone in bones] == joints.split()


@pytest.mark.parametrize(
    ("arm", "joints"),
    [
        ("Shoulder Elbow Wrist", "shoulder elbow wrist"),
        ("Shoulder Arm Elbow Wrist", "clavicle shoulder elbow wrist"),
        ("Clavicle Shoulder Arm Elbow Hand", "clavicle - shoulder elbow wrist"),
        ("Collar Shoulder Elbow Hand", "clavicle shoulder elbow wrist"),
        ("Arm Forearm Wrist Hand", "shoulder elbow wrist fingers"),
        ("Arm Forearm Wrist Hand Middle1", "shoulder elbow wrist - fingers"),
        ("Arm Forearm Hand Middle1 Middle2", "shoulder elbow wrist fingers -"),
    ],
)
def test_what_a_word_of_an_arm_means_is_where_it_hangs(arm: str, joints: str) -> None:
    bones = arm.split()
    found = mapped(f"{TRUNK} {LEG} {hung(bones, 'Chest')}")
    assert [found.get(f"{bone}_L", "-").removeprefix("left_") for bone in bones] == joints.split()


@pytest.mark.parametrize(
    ("left", "right", "middle"),
    [
        ("L_{}", "R_{}", "{}"),
        ("Left{}", "Right{}", "{}"),
        ("left {}", "right {}", "{}"),
        ("{}.l", "{}.r", "{}.x"),
        ("{}Left", "{}Right", "{}"),
        ("l{}", "r{}", "{}"),
        ("{}_L.001", "{}_R.001", "{}.001"),
        ("a:L_{}_jnt", "a:R_{}_jnt", "a:{}_jnt"),
        ("DEF-{}.L", "DEF-{}.R", "DEF-{}"),
        ("左{}", "右{}", "{}"),
    ],
)
def test_sides_are_said_before_and_after(left: str, right: str, middle: str) -> None:
    names, parents = read_tree(f"{TRUNK} {LEG} {ARM}")
    spelling = {"_L": left, "_R": right}
    called = [spelling.get(name[-2:], middle).format(name.removesuffix("_L").removesuffix("_R")) for name in names]
    found = map_by_limbs(called, parents)
    assert found is not None
    assert found == map_by_limbs(names, parents)


@pytest.mark.parametrize(
    "text",
    [
        f"{TRUNK} {LEG}",  # no arms
        f"{TRUNK} {ARM}",  # no legs
        f"{TRUNK} {ARM} {LEG.replace('Shin_{S}', 'Middle_{S}')}",  # no knees
        f"{TRUNK} {LEG} {ARM.replace('Forearm', 'Second')}",  # no elbows
        f"{TRUNK} {ARM} Shin_{{S}}<Hips Thigh_{{S}}<Shin_{{S}} Foot_{{S}}<Thigh_{{S}}",  # another order
        f"{TRUNK} {ARM} Thigh_{{S}}<Hips Shin_{{S}}<Hips Foot_{{S}}<Hips",  # not in a row
        f"{TRUNK} {ARM} {LEG} Femur_{{S}}<Hips Tibia_{{S}}<Femur_{{S}} Ankle_{{S}}<Tibia_{{S}}",  # four legs
        f"{TRUNK} {ARM} {LEG.replace('Foot_{S}<Shin', 'ThighTwist_{S}<Shin_{S} Foot_{S}<ThighTwist')}",  # again
        f"{TRUNK} {ARM} Leg_{{S}}<Hips Knee_{{S}}<Leg_{{S}} Leg2_{{S}}<Knee_{{S}} Foot_{{S}}<Leg2_{{S}}",
        f"{TRUNK} {LEG} Arm_{{S}}<Hips Elbow_{{S}}<Arm_{{S}} Hand_{{S}}<Elbow_{{S}}",  # no spine
        f"{TRUNK.replace(' Head<Neck', '')} {LEG} {ARM}",  # no head
        f"{TRUNK.replace('Head<Neck', 'Head<Hips')} {LEG} {ARM}",  # a head that is not over the chest
        f"Root Hips<Root Spine<Hips Chest<Spine Head<Chest {ARM} {LEG.replace('<Hips', '<Root')}",  # legs without hips
        "Thigh_L<Hips Shin_L<Thigh_L Foot_L<Shin_L Leg_R<Hips Knee_R<Leg_R Ankle_R<Knee_R " + f"{TRUNK} {ARM}",
    ],
)
def test_what_is_not_clear_is_no_rig(text: str) -> None:
    assert mapped(text) == {}


@pytest.mark.parametrize(
    ("text", "unclear"),
    [
        (f"{TRUNK} {LEG.replace('Shin', 'Middle').replace('Foot', 'End')} {ARM}", "the left leg, the right leg"),
        (f"{TRUNK} {LEG} {ARM.replace('Hand_{S}<Forearm_{S}', 'Hand_L<Forearm_L')}", "the right arm"),
        (
            f"Root Hips<Root Spine<Hips Chest<Spine Head<Chest {ARM} {LEG.replace('<Hips', '<Root')}",
            "the pelvis, spine or",
        ),
        (f"{TRUNK} Wing_{{S}}<Chest", ""),
    ],
)
def test_what_is_not_clear_is_named(text: str, unclear: str) -> None:
    names, parents = read_tree(text)
    said = describe_unknown_rig(Skeleton("file", tuple(names), tuple(parents), np.zeros((len(names), 3))))
    fault = f"the joints' names do not show {unclear}"
    assert (fault in said) if unclear else ("do not show" not in said)


def test_which_of_five_toes_is_meant_is_not_said() -> None:
    toes = " ".join(f"Toe{n}_{{S}}<Foot_{{S}}" for n in range(1, 6))
    found = mapped(f"{TRUNK} {LEG.replace(' Toe_{S}<Foot_{S}', '')} {toes} {ARM}")
    assert found["Foot_L"] == "left_ankle"
    assert "left_toes" not in found.values()


def test_what_hangs_beside_a_limb_is_none_of_it() -> None:
    beside = "ThighTwist_{S}<Thigh_{S} Foot_IK_{S}<Hips HandTwist_{S}<Forearm_{S} Hand_Roll_{S}<Hips"
    assert mapped(f"{TRUNK} {LEG} {ARM} {beside}") == mapped(f"{TRUNK} {LEG} {ARM}")


def test_bones_of_another_kind_beside_those_of_limbs() -> None:
    controls = f"{LEG} {ARM}".replace("_{S}", "_fk_{S}").replace("<Hips", "<DEF-Hips").replace("<Chest", "<DEF-Chest")
    bones = f"{TRUNK} {LEG} {ARM}"
    deforming = " ".join("<".join(f"DEF-{name}" for name in row.split("<")) for row in bones.split())
    found = mapped(f"{deforming} {controls}")
    assert found == {f"DEF-{name}": joint for name, joint in mapped(bones).items()}


OPENNI_ARM = "{S}_SHOULDER#<{} {S}_ELBOW<{S}_SHOULDER# {S}_HAND<{S}_ELBOW"
OPENNI_LEG = "{S}_HIP#<{} {S}_KNEE<{S}_HIP# {S}_FOOT<{S}_KNEE"


def openni(neck: str, arm: str, leg: str) -> dict[str, str]:
    """What OpenNI's joints map to, by the joint that each of three rows hangs from."""
    limbs = OPENNI_ARM.replace("{}", arm) + " " + OPENNI_LEG.replace("{}", leg)
    helpers = [f"{joint}<TORSO#" for joint in (neck, arm, leg) if joint not in ("TORSO#", "NECK#")]
    both = [row.replace("{S}", side).replace("{s}", side[0]) for side in ("LEFT", "RIGHT") for row in helpers]
    sided = " ".join(limbs.replace("{S}", side).replace("{s}", side[0]) for side in ("LEFT", "RIGHT"))
    return mapped(f"TORSO# {' '.join(both)} NECK#<{neck} HEAD<NECK# {sided}")


@pytest.mark.parametrize(
    ("neck", "arm", "leg", "others"),
    [
        ("TORSO#", "TORSO#", "TORSO#", {"NECK#": "cervical"}),
        ("TORSO#", "NECK#", "TORSO#", {"NECK#": "thorax"}),
        (
            "TN",
            "T{s}S",
            "T{s}H",
            {"TN": "thorax", "NECK#": "cervical", "TLS": "left_clavicle", "TRS": "right_clavicle"},
        ),
    ],
)
def test_one_joint_may_carry_legs_and_arms(neck: str, arm: str, leg: str, others: dict[str, str]) -> None:
    limbs = {"SHOULDER#": "shoulder", "ELBOW": "elbow", "HAND": "wrist", "HIP#": "hip", "KNEE": "knee", "FOOT": "ankle"}
    sides = {f"{side.upper()}_{name}": f"{side}_{joint}" for side in SIDES for name, joint in limbs.items()}
    assert openni(neck, arm, leg) == {"TORSO#": "pelvis", "HEAD": "atlantal"} | sides | others


@pytest.mark.parametrize("arms_on", [0, 1])
def test_a_trunk_of_one_joint_keeps_all_places(arms_on: int) -> None:
    names = ["Torso", "Neck", "Head"]
    parents, rest = [-1, 0, 1], [(0.0, 1.2, 0.0), (0.0, 1.45, 0.0), (0.0, 1.65, 0.0)]
    limbs = {
        "Shoulder": (0.18, 1.4, 0.0),
        "Elbow": (0.45, 1.4, 0.0),
        "Hand": (0.7, 1.4, 0.0),
        "Hip": (0.09, 0.95, 0.0),
        "Knee": (0.09, 0.5, 0.01),
        "Foot": (0.09, 0.08, 0.0),
    }
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        for name, (x, y, z) in limbs.items():
            parents.append({"Shoulder": arms_on, "Hip": 0}.get(name, len(names) - 1))
            names.append(side + name)
            rest.append((sign * x, y, z))
    places = np.array(rest)
    offsets = places - places[np.maximum(parents, 0)]
    body = Skeleton("openni", tuple(names), tuple(parents), offsets, np.zeros_like(offsets))
    motion = tumble(body, seed=3)
    found, mapping = to_human23(motion, up="y"), joint_mapping(body)
    assert mapping is not None
    ours = [found.skeleton.index(mapping[name]) for name in names]
    moved = found.skeleton.positions(found.rotations, found.root)[:, ours]
    np.testing.assert_allclose(moved, body.positions(motion.rotations, motion.root), atol=1e-9)
    if not arms_on:  # the spine is within the torso
        spine = [found.skeleton.index(name) for name in ("lumbar", "thorax")]
        np.testing.assert_array_equal(found.skeleton.offsets[spine], 0.0)
