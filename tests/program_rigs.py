"""Bodies on the rigs of programs, for tests: their bones as these export them, and movement on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot

BODY = human23()
SIDES = (("left", 1.0), ("right", -1.0))


def about(axis: str, degrees: float) -> Floats:
    return rot.from_axis_angle(np.eye(3)["xyz".index(axis)], np.radians(degrees))


PLAN = (Insertion(np.array([0.0, 0.2, 0.3]), (("left_hip", 1), ("pelvis", 0))),)


@cache
def dance(frames: int = 12) -> Motion:
    """Some movement on human23: every joint turns, none by very much."""
    rng = np.random.default_rng(23)
    steps = rot.exp(0.5 * rng.standard_normal((frames, len(BODY), 3)))
    root = np.cumsum(0.05 * rng.standard_normal((frames, 3)), axis=0) + np.array([0.0, 0.9, 0.0])
    return Motion(BODY, steps, root, np.arange(frames) / 30.0, name="dance", insertions=PLAN)


def spread(legs: float = 20.0, arms: float = 70.0, **more: Floats) -> dict[str, Floats]:
    """A zero pose that stands, as local rotations of human23: legs spread and arms lowered by so many degrees."""
    pose = {f"{side}_hip": about("z", sign * legs) for side, sign in SIDES}
    return pose | {f"{side}_shoulder": about("z", -sign * arms) for side, sign in SIDES} | more


def same_movement(found: Motion, wanted: Motion, without: tuple[str, ...] = ()) -> None:
    kept = [i for i, name in enumerate(BODY.names) if not name.endswith(without or ("-",))]
    assert found.skeleton.name == "human23"
    assert BODY.difference(found.skeleton) is None
    assert np.max(rot.angle(found.rotations[:, kept], wanted.rotations[:, kept])) < 1e-7
    np.testing.assert_allclose(found.root, wanted.root, atol=1e-12)
    np.testing.assert_array_equal(found.times, wanted.times)


# Bones in the order of the file, each after the bone it hangs from, as "name<parent"; {s} stands for left and right. A
# bone that maps to a joint of human23 is "name<parent=joint"; the others are rigid with what they hang from.
REALLUSION = (
    "CC_Base_{S}_Clavicle<CC_Base_Spine02=clavicle CC_Base_{S}_Upperarm<CC_Base_{S}_Clavicle=shoulder "
    "CC_Base_{S}_UpperarmTwist01<CC_Base_{S}_Upperarm CC_Base_{S}_Forearm<CC_Base_{S}_Upperarm=elbow "
    "CC_Base_{S}_Hand<CC_Base_{S}_Forearm=wrist CC_Base_{S}_Mid1<CC_Base_{S}_Hand=fingers "
    "CC_Base_{S}_Thigh<CC_Base_Pelvis=hip CC_Base_{S}_ThighTwist01<CC_Base_{S}_Thigh "
    "CC_Base_{S}_Calf<CC_Base_{S}_Thigh=knee CC_Base_{S}_Foot<CC_Base_{S}_Calf=ankle "
    "CC_Base_{S}_ToeBase<CC_Base_{S}_Foot=toes"
)
EXPORTS = {
    "Rokoko": (
        "root Hips<root=pelvis Spine1<Hips=lumbar Spine2<Spine1=lumbar Spine3<Spine2=thorax Spine4<Spine3=thorax "
        "Neck<Spine4=cervical Head<Neck=atlantal",
        "{Side}Shoulder<Spine4=clavicle {Side}Arm<{Side}Shoulder=shoulder {Side}ForeArm<{Side}Arm=elbow "
        "{Side}Hand<{Side}ForeArm=wrist {Side}Finger3Proximal<{Side}Hand=fingers {Side}Thigh<Hips=hip "
        "{Side}Shin<{Side}Thigh=knee {Side}Foot<{Side}Shin=ankle {Side}Toe<{Side}Foot=toes {Side}ToeTip<{Side}Toe",
    ),
    "Xsens MVN": (
        "Pelvis=pelvis L5<Pelvis=lumbar L3<L5=lumbar T12<L3=thorax T8<T12=thorax Neck<T8=cervical Head<Neck=atlantal",
        "{Side}Shoulder<T8=clavicle {Side}UpperArm<{Side}Shoulder=shoulder {Side}ForeArm<{Side}UpperArm=elbow "
        "{Side}Hand<{Side}ForeArm=wrist {Side}UpperLeg<Pelvis=hip {Side}LowerLeg<{Side}UpperLeg=knee "
        "{Side}Foot<{Side}LowerLeg=ankle {Side}Toe<{Side}Foot=toes",
    ),
    "Biovision": (  # Xsens MVN's BVH
        "Hips=pelvis Chest<Hips=lumbar Chest2<Chest=lumbar Chest3<Chest2=thorax Chest4<Chest3=thorax "
        "Neck<Chest4=cervical Head<Neck=atlantal",
        "{Side}Collar<Chest4=clavicle {Side}Shoulder<{Side}Collar=shoulder {Side}Elbow<{Side}Shoulder=elbow "
        "{Side}Wrist<{Side}Elbow=wrist {Side}Hip<Hips=hip {Side}Knee<{Side}Hip=knee {Side}Ankle<{Side}Knee=ankle "
        "{Side}Toe<{Side}Ankle=toes",
    ),
    "Unreal": (
        "root pelvis<root=pelvis spine_01<pelvis=lumbar spine_02<spine_01=lumbar spine_03<spine_02=lumbar "
        "spine_04<spine_03=thorax spine_05<spine_04=thorax neck_01<spine_05=cervical neck_02<neck_01=cervical "
        "head<neck_02=atlantal ik_foot_root<root ik_hand_root<root",
        "clavicle_{s}<spine_05=clavicle upperarm_{s}<clavicle_{s}=shoulder upperarm_twist_01_{s}<upperarm_{s} "
        "lowerarm_{s}<upperarm_{s}=elbow lowerarm_twist_01_{s}<lowerarm_{s} hand_{s}<lowerarm_{s}=wrist "
        "middle_metacarpal_{s}<hand_{s} middle_01_{s}<middle_metacarpal_{s}=fingers thumb_01_{s}<hand_{s} "
        "thigh_{s}<pelvis=hip thigh_twist_01_{s}<thigh_{s} calf_{s}<thigh_{s}=knee calf_twist_01_{s}<calf_{s} "
        "foot_{s}<calf_{s}=ankle ball_{s}<foot_{s}=toes ik_foot_{s}<ik_foot_root ik_hand_{s}<ik_hand_root",
    ),
    "VRM": (
        "hips=pelvis spine<hips=lumbar chest<spine=lumbar upperChest<chest=thorax neck<upperChest=cervical "
        "head<neck=atlantal jaw<head",
        "{side}Shoulder<upperChest=clavicle {side}UpperArm<{side}Shoulder=shoulder {side}LowerArm<{side}UpperArm=elbow "
        "{side}Hand<{side}LowerArm=wrist {side}MiddleProximal<{side}Hand=fingers {side}UpperLeg<hips=hip "
        "{side}LowerLeg<{side}UpperLeg=knee {side}Foot<{side}LowerLeg=ankle {side}Toes<{side}Foot=toes {side}Eye<head",
    ),
    "VRoid": (
        "Root J_Bip_C_Hips<Root=pelvis J_Bip_C_Spine<J_Bip_C_Hips=lumbar J_Bip_C_Chest<J_Bip_C_Spine=lumbar "
        "J_Bip_C_UpperChest<J_Bip_C_Chest=thorax J_Bip_C_Neck<J_Bip_C_UpperChest=cervical "
        "J_Bip_C_Head<J_Bip_C_Neck=atlantal",
        "J_Bip_{S}_Shoulder<J_Bip_C_UpperChest=clavicle J_Bip_{S}_UpperArm<J_Bip_{S}_Shoulder=shoulder "
        "J_Bip_{S}_LowerArm<J_Bip_{S}_UpperArm=elbow J_Bip_{S}_Hand<J_Bip_{S}_LowerArm=wrist "
        "J_Bip_{S}_Middle1<J_Bip_{S}_Hand=fingers J_Bip_{S}_UpperLeg<J_Bip_C_Hips=hip "
        "J_Bip_{S}_LowerLeg<J_Bip_{S}_UpperLeg=knee J_Bip_{S}_Foot<J_Bip_{S}_LowerLeg=ankle "
        "J_Bip_{S}_ToeBase<J_Bip_{S}_Foot=toes J_Sec_{S}_Bust1<J_Bip_C_UpperChest",
    ),
    "Rigify": (
        "root DEF-spine<root=pelvis DEF-spine.001<DEF-spine=lumbar DEF-spine.002<DEF-spine.001=lumbar "
        "DEF-spine.003<DEF-spine.002=thorax DEF-spine.004<DEF-spine.003=cervical DEF-spine.005<DEF-spine.004=cervical "
        "DEF-spine.006<DEF-spine.005=atlantal",
        "DEF-pelvis.{S}<DEF-spine DEF-shoulder.{S}<DEF-spine.003=clavicle DEF-upper_arm.{S}<DEF-shoulder.{S}=shoulder "
        "DEF-upper_arm.{S}.001<DEF-upper_arm.{S}=shoulder DEF-forearm.{S}<DEF-upper_arm.{S}.001=elbow "
        "DEF-forearm.{S}.001<DEF-forearm.{S}=elbow DEF-hand.{S}<DEF-forearm.{S}.001=wrist "
        "DEF-palm.02.{S}<DEF-hand.{S} DEF-f_middle.01.{S}<DEF-palm.02.{S}=fingers DEF-thigh.{S}<DEF-spine=hip "
        "DEF-thigh.{S}.001<DEF-thigh.{S}=hip DEF-shin.{S}<DEF-thigh.{S}.001=knee DEF-shin.{S}.001<DEF-shin.{S}=knee "
        "DEF-foot.{S}<DEF-shin.{S}.001=ankle DEF-toe.{S}<DEF-foot.{S}=toes",
    ),
    "Rigify, metarig": (
        "spine=pelvis spine.001<spine=lumbar spine.002<spine.001=lumbar spine.003<spine.002=thorax "
        "spine.004<spine.003=cervical spine.005<spine.004=cervical spine.006<spine.005=atlantal face<spine.006",
        "pelvis.{S}<spine shoulder.{S}<spine.003=clavicle upper_arm.{S}<shoulder.{S}=shoulder "
        "forearm.{S}<upper_arm.{S}=elbow hand.{S}<forearm.{S}=wrist palm.02.{S}<hand.{S} "
        "f_middle.01.{S}<palm.02.{S}=fingers thigh.{S}<spine=hip shin.{S}<thigh.{S}=knee foot.{S}<shin.{S}=ankle "
        "toe.{S}<foot.{S}=toes heel.02.{S}<foot.{S} breast.{S}<spine.003",
    ),
    "OptiTrack": (
        "Skeleton1_Hip=pelvis Skeleton1_Ab<Skeleton1_Hip=lumbar Skeleton1_Chest<Skeleton1_Ab=thorax "
        "Skeleton1_Neck<Skeleton1_Chest=cervical Skeleton1_Head<Skeleton1_Neck=atlantal",
        "Skeleton1_{S}Shoulder<Skeleton1_Chest=clavicle Skeleton1_{S}UArm<Skeleton1_{S}Shoulder=shoulder "
        "Skeleton1_{S}FArm<Skeleton1_{S}UArm=elbow Skeleton1_{S}Hand<Skeleton1_{S}FArm=wrist "
        "Skeleton1_{S}Thigh<Skeleton1_Hip=hip Skeleton1_{S}Shin<Skeleton1_{S}Thigh=knee "
        "Skeleton1_{S}Foot<Skeleton1_{S}Shin=ankle Skeleton1_{S}Toe<Skeleton1_{S}Foot=toes",
    ),
    "Biped": (
        "Bip01 Bip01_Pelvis<Bip01=pelvis Bip01_Spine<Bip01_Pelvis=lumbar Bip01_Spine1<Bip01_Spine=lumbar "
        "Bip01_Spine2<Bip01_Spine1=thorax Bip01_Neck<Bip01_Spine2=cervical Bip01_Head<Bip01_Neck=atlantal",
        "Bip01_{S}_Clavicle<Bip01_Spine2=clavicle Bip01_{S}_UpperArm<Bip01_{S}_Clavicle=shoulder "
        "Bip01_{S}_Forearm<Bip01_{S}_UpperArm=elbow Bip01_{S}_Hand<Bip01_{S}_Forearm=wrist "
        "Bip01_{S}_Finger0<Bip01_{S}_Hand Bip01_{S}_Finger2<Bip01_{S}_Hand=fingers Bip01_{S}_Thigh<Bip01_Pelvis=hip "
        "Bip01_{S}_Calf<Bip01_{S}_Thigh=knee Bip01_{S}_Foot<Bip01_{S}_Calf=ankle Bip01_{S}_Toe0<Bip01_{S}_Foot=toes",
    ),
    "Reallusion": (
        "CC_Base_BoneRoot CC_Base_Hip<CC_Base_BoneRoot=pelvis CC_Base_Pelvis<CC_Base_Hip=pelvis "
        "CC_Base_Waist<CC_Base_Hip=lumbar CC_Base_Spine01<CC_Base_Waist=lumbar CC_Base_Spine02<CC_Base_Spine01=thorax "
        "CC_Base_NeckTwist01<CC_Base_Spine02=cervical CC_Base_NeckTwist02<CC_Base_NeckTwist01=cervical "
        "CC_Base_Head<CC_Base_NeckTwist02=atlantal",
        REALLUSION,
    ),
    "Reallusion, named in full": (
        "RL_BoneRoot CC_Base_Hip<RL_BoneRoot=pelvis CC_Base_Waist<CC_Base_Hip=lumbar "
        "CC_Base_Spine01<CC_Base_Waist=lumbar CC_Base_Spine02<CC_Base_Spine01=thorax "
        "CC_Base_NeckTwist01<CC_Base_Spine02=cervical CC_Base_Head<CC_Base_NeckTwist01=atlantal",
        REALLUSION.replace("CC_Base_Pelvis", "CC_Base_Hip"),
    ),
    "Move.ai": (
        "Root=pelvis Spine1<Root=lumbar Spine2<Spine1=lumbar Chest<Spine2=thorax Neck<Chest=cervical "
        "Head<Neck=atlantal",
        "{Side}_Shoulder<Chest=clavicle {Side}_UpperArm<{Side}_Shoulder=shoulder "
        "{Side}_LowerArm<{Side}_UpperArm=elbow {Side}_Hand<{Side}_LowerArm=wrist {Side}_UpperLeg<Root=hip "
        "{Side}_LowerLeg<{Side}_UpperLeg=knee {Side}_Foot<{Side}_LowerLeg=ankle {Side}_Toe<{Side}_Foot=toes",
    ),
    "MakeHuman": (
        "root=pelvis spine05<root=lumbar spine04<spine05=lumbar spine03<spine04=lumbar spine02<spine03=thorax "
        "spine01<spine02=thorax neck01<spine01=cervical neck02<neck01=cervical neck03<neck02=cervical "
        "head<neck03=atlantal jaw<head",
        "pelvis.{S}<root clavicle.{S}<spine01=clavicle shoulder01.{S}<clavicle.{S}=clavicle "
        "upperarm01.{S}<shoulder01.{S}=shoulder upperarm02.{S}<upperarm01.{S}=shoulder "
        "lowerarm01.{S}<upperarm02.{S}=elbow lowerarm02.{S}<lowerarm01.{S}=elbow wrist.{S}<lowerarm02.{S}=wrist "
        "metacarpal2.{S}<wrist.{S} finger3-1.{S}<metacarpal2.{S}=fingers upperleg01.{S}<pelvis.{S}=hip "
        "upperleg02.{S}<upperleg01.{S}=hip lowerleg01.{S}<upperleg02.{S}=knee lowerleg02.{S}<lowerleg01.{S}=knee "
        "foot.{S}<lowerleg02.{S}=ankle metatarsal2.{S}<foot.{S} toe2-1.{S}<metatarsal2.{S}=toes",
    ),
    "DeepMotion": (
        "hips_JNT=pelvis spine_JNT<hips_JNT=lumbar spine1_JNT<spine_JNT=lumbar spine2_JNT<spine1_JNT=thorax "
        "neck_JNT<spine2_JNT=cervical head_JNT<neck_JNT=atlantal",
        "{s}_shoulder_JNT<spine2_JNT=clavicle {s}_arm_JNT<{s}_shoulder_JNT=shoulder {s}_forearm_JNT<{s}_arm_JNT=elbow "
        "{s}_hand_JNT<{s}_forearm_JNT=wrist {s}_handMiddle1_JNT<{s}_hand_JNT=fingers {s}_upleg_JNT<hips_JNT=hip "
        "{s}_leg_JNT<{s}_upleg_JNT=knee {s}_foot_JNT<{s}_leg_JNT=ankle {s}_toebase_JNT<{s}_foot_JNT=toes",
    ),
    "DAZ Genesis": (  # 3 and 8
        "hip=pelvis pelvis<hip=pelvis abdomenLower<hip=lumbar abdomenUpper<abdomenLower=lumbar "
        "chestLower<abdomenUpper=thorax chestUpper<chestLower=thorax neckLower<chestUpper=cervical "
        "neckUpper<neckLower=cervical head<neckUpper=atlantal upperFaceRig<head",
        "{s}Collar<chestUpper=clavicle {s}ShldrBend<{s}Collar=shoulder {s}ShldrTwist<{s}ShldrBend=shoulder "
        "{s}ForearmBend<{s}ShldrTwist=elbow {s}ForearmTwist<{s}ForearmBend=elbow {s}Hand<{s}ForearmTwist=wrist "
        "{s}Carpal2<{s}Hand {s}Mid1<{s}Carpal2=fingers {s}Pectoral<chestUpper {s}ThighBend<pelvis=hip "
        "{s}ThighTwist<{s}ThighBend=hip {s}Shin<{s}ThighTwist=knee {s}Foot<{s}Shin=ankle {s}Metatarsals<{s}Foot "
        "{s}Toe<{s}Metatarsals=toes {s}BigToe<{s}Toe",
    ),
    "DAZ Genesis 2": (
        "hip=pelvis pelvis<hip=pelvis abdomen<hip=lumbar abdomen2<abdomen=lumbar chest<abdomen2=thorax "
        "neck<chest=cervical head<neck=atlantal",
        "{s}Collar<chest=clavicle {s}Shldr<{s}Collar=shoulder {s}ForeArm<{s}Shldr=elbow {s}Hand<{s}ForeArm=wrist "
        "{s}Carpal2<{s}Hand {s}Mid1<{s}Carpal2=fingers {s}Thigh<pelvis=hip {s}Shin<{s}Thigh=knee {s}Foot<{s}Shin=ankle "
        "{s}Toe<{s}Foot=toes",
    ),
    "DAZ Genesis 9": (
        "hip=pelvis pelvis<hip=pelvis spine1<hip=lumbar spine2<spine1=lumbar spine3<spine2=thorax spine4<spine3=thorax "
        "neck1<spine4=cervical neck2<neck1=cervical head<neck2=atlantal",
        "{s}_shoulder<spine4=clavicle {s}_upperarm<{s}_shoulder=shoulder {s}_upperarmtwist1<{s}_upperarm "
        "{s}_forearm<{s}_upperarm=elbow {s}_hand<{s}_forearm=wrist {s}_midmetacarpal<{s}_hand "
        "{s}_mid1<{s}_midmetacarpal=fingers {s}_thigh<pelvis=hip {s}_shin<{s}_thigh=knee {s}_foot<{s}_shin=ankle "
        "{s}_metatarsals<{s}_foot {s}_toes<{s}_metatarsals=toes",
    ),
    "SMPL, models": (
        "m_avg_root m_avg_Pelvis<m_avg_root=pelvis m_avg_Spine1<m_avg_Pelvis=lumbar m_avg_Spine2<m_avg_Spine1=thorax "
        "m_avg_Spine3<m_avg_Spine2=thorax m_avg_Neck<m_avg_Spine3=cervical m_avg_Head<m_avg_Neck=atlantal",
        "m_avg_{S}_Hip<m_avg_Pelvis=hip m_avg_{S}_Knee<m_avg_{S}_Hip=knee m_avg_{S}_Ankle<m_avg_{S}_Knee=ankle "
        "m_avg_{S}_Foot<m_avg_{S}_Ankle=toes m_avg_{S}_Collar<m_avg_Spine3=clavicle "
        "m_avg_{S}_Shoulder<m_avg_{S}_Collar=shoulder m_avg_{S}_Elbow<m_avg_{S}_Shoulder=elbow "
        "m_avg_{S}_Wrist<m_avg_{S}_Elbow=wrist m_avg_{S}_Hand<m_avg_{S}_Wrist=fingers",
    ),
    "SMPL, models, hands": (
        "Pelvis=pelvis Spine1<Pelvis=lumbar Spine2<Spine1=thorax Spine3<Spine2=thorax Neck<Spine3=cervical "
        "Head<Neck=atlantal",
        "{S}_Hip<Pelvis=hip {S}_Knee<{S}_Hip=knee {S}_Ankle<{S}_Knee=ankle {S}_Foot<{S}_Ankle=toes "
        "{S}_Collar<Spine3=clavicle {S}_Shoulder<{S}_Collar=shoulder {S}_Elbow<{S}_Shoulder=elbow "
        "{S}_Wrist<{S}_Elbow=wrist {s}index0<{S}_Wrist {s}middle0<{S}_Wrist=fingers {s}middle1<{s}middle0",
    ),
}

# Rigs of no table, which are known by names of limbs.
BY_LIMBS = {
    "mocopi": (
        "root=pelvis torso_1<root=lumbar torso_2<torso_1=lumbar torso_3<torso_2=lumbar torso_4<torso_3=lumbar "
        "torso_5<torso_4=thorax torso_6<torso_5=thorax torso_7<torso_6=thorax neck_1<torso_7=cervical "
        "neck_2<neck_1=cervical head<neck_2=atlantal",
        "{s}_shoulder<torso_7=clavicle {s}_up_arm<{s}_shoulder=shoulder {s}_low_arm<{s}_up_arm=elbow "
        "{s}_hand<{s}_low_arm=wrist {s}_up_leg<root=hip {s}_low_leg<{s}_up_leg=knee {s}_foot<{s}_low_leg=ankle "
        "{s}_toes<{s}_foot=toes",
    ),
    "Kinect 2": (
        "SpineBase=pelvis SpineMid<SpineBase=lumbar SpineShoulder<SpineMid=thorax Neck<SpineShoulder=cervical "
        "Head<Neck=atlantal",
        "Shoulder{Side}<SpineShoulder=shoulder Elbow{Side}<Shoulder{Side}=elbow Wrist{Side}<Elbow{Side}=wrist "
        "Hand{Side}<Wrist{Side}=fingers HandTip{Side}<Hand{Side} Thumb{Side}<Hand{Side} Hip{Side}<SpineBase=hip "
        "Knee{Side}<Hip{Side}=knee Ankle{Side}<Knee{Side}=ankle Foot{Side}<Ankle{Side}=toes",
    ),
    "Azure Kinect": (
        "PELVIS=pelvis SPINE_NAVEL<PELVIS=lumbar SPINE_CHEST<SPINE_NAVEL=thorax NECK<SPINE_CHEST=cervical "
        "HEAD<NECK=atlantal NOSE<HEAD",
        "CLAVICLE_{SIDE}<SPINE_CHEST=clavicle SHOULDER_{SIDE}<CLAVICLE_{SIDE}=shoulder "
        "ELBOW_{SIDE}<SHOULDER_{SIDE}=elbow WRIST_{SIDE}<ELBOW_{SIDE}=wrist HAND_{SIDE}<WRIST_{SIDE}=fingers "
        "HANDTIP_{SIDE}<HAND_{SIDE} THUMB_{SIDE}<WRIST_{SIDE} HIP_{SIDE}<PELVIS=hip KNEE_{SIDE}<HIP_{SIDE}=knee "
        "ANKLE_{SIDE}<KNEE_{SIDE}=ankle FOOT_{SIDE}<ANKLE_{SIDE}=toes EYE_{SIDE}<HEAD EAR_{SIDE}<HEAD",
    ),
    "ARKit": (
        "root hips_joint<root=pelvis spine_1_joint<hips_joint=lumbar spine_2_joint<spine_1_joint=lumbar "
        "spine_3_joint<spine_2_joint=lumbar spine_4_joint<spine_3_joint=lumbar spine_5_joint<spine_4_joint=thorax "
        "spine_6_joint<spine_5_joint=thorax spine_7_joint<spine_6_joint=thorax neck_1_joint<spine_7_joint=cervical "
        "neck_2_joint<neck_1_joint=cervical neck_3_joint<neck_2_joint=cervical neck_4_joint<neck_3_joint=cervical "
        "head_joint<neck_4_joint=atlantal jaw_joint<head_joint",
        "{side}_shoulder_1_joint<spine_7_joint=clavicle {side}_arm_joint<{side}_shoulder_1_joint=shoulder "
        "{side}_forearm_joint<{side}_arm_joint=elbow {side}_hand_joint<{side}_forearm_joint=wrist "
        "{side}_handThumbStart_joint<{side}_hand_joint {side}_handMidStart_joint<{side}_hand_joint "
        "{side}_handMid_1_joint<{side}_handMidStart_joint=fingers {side}_upLeg_joint<hips_joint=hip "
        "{side}_leg_joint<{side}_upLeg_joint=knee {side}_foot_joint<{side}_leg_joint=ankle "
        "{side}_toes_joint<{side}_foot_joint=toes {side}_toesEnd_joint<{side}_toes_joint {side}_eye_joint<head_joint",
    ),
    "Cascadeur": (
        "pelvis=pelvis stomach<pelvis=lumbar chest<stomach=thorax neck<chest=cervical head<neck=atlantal",
        "clavicle_{s}<chest=clavicle arm_{s}<clavicle_{s}=shoulder forearm_{s}<arm_{s}=elbow "
        "hand_{s}<forearm_{s}=wrist thigh_{s}<pelvis=hip calf_{s}<thigh_{s}=knee foot_{s}<calf_{s}=ankle "
        "toe_{s}<foot_{s}=toes",
    ),
    "Blender, by hand": (
        "root hips<root=pelvis spine<hips=lumbar chest<spine=lumbar upper_chest<chest=thorax neck<upper_chest=cervical "
        "head<neck=atlantal",
        "shoulder.{S}<upper_chest=clavicle upper_arm.{S}<shoulder.{S}=shoulder forearm.{S}<upper_arm.{S}=elbow "
        "hand.{S}<forearm.{S}=wrist thigh.{S}<hips=hip shin.{S}<thigh.{S}=knee foot.{S}<shin.{S}=ankle "
        "foot_ik.{S}<root knee_pole.{S}<root hand_ik.{S}<root",
    ),
    "Rigify, ORG": (
        "root ORG-spine<root=pelvis ORG-spine.001<ORG-spine=lumbar ORG-spine.003<ORG-spine.001=thorax "
        "ORG-neck<ORG-spine.003=cervical ORG-head<ORG-neck=atlantal",
        "thigh_ik.{S}<root ORG-shoulder.{S}<ORG-spine.003=clavicle ORG-upper_arm.{S}<ORG-shoulder.{S}=shoulder "
        "ORG-forearm.{S}<ORG-upper_arm.{S}=elbow ORG-hand.{S}<ORG-forearm.{S}=wrist ORG-pelvis.{S}<ORG-spine "
        "ORG-thigh.{S}<ORG-spine=hip ORG-shin.{S}<ORG-thigh.{S}=knee ORG-foot.{S}<ORG-shin.{S}=ankle "
        "ORG-toe.{S}<ORG-foot.{S}=toes",
    ),
    "Auto-Rig Pro": (
        "root.x=pelvis spine_01.x<root.x=lumbar spine_02.x<spine_01.x=thorax neck.x<spine_02.x=cervical "
        "head.x<neck.x=atlantal",
        "shoulder.{s}<spine_02.x=clavicle c_arm_twist_offset.{s}<shoulder.{s} "
        "arm_stretch.{s}<c_arm_twist_offset.{s}=shoulder forearm_stretch.{s}<arm_stretch.{s}=elbow "
        "hand.{s}<forearm_stretch.{s}=wrist thigh_twist.{s}<root.x=hip thigh_stretch.{s}<thigh_twist.{s}=hip "
        "leg_stretch.{s}<thigh_stretch.{s}=knee leg_twist.{s}<leg_stretch.{s}=knee foot.{s}<leg_twist.{s}=ankle "
        "toes_01.{s}<foot.{s}=toes",
    ),
    "Advanced Skeleton": (
        "Root_M=pelvis Spine1_M<Root_M=lumbar Chest_M<Spine1_M=thorax Neck_M<Chest_M=cervical Head_M<Neck_M=atlantal",
        "Scapula_{S}<Chest_M=clavicle Shoulder_{S}<Scapula_{S}=shoulder ShoulderPart1_{S}<Shoulder_{S}=shoulder "
        "Elbow_{S}<ShoulderPart1_{S}=elbow Wrist_{S}<Elbow_{S}=wrist MiddleFinger1_{S}<Wrist_{S}=fingers "
        "MiddleFinger2_{S}<MiddleFinger1_{S} Hip_{S}<Root_M=hip HipPart1_{S}<Hip_{S}=hip Knee_{S}<HipPart1_{S}=knee "
        "Ankle_{S}<Knee_{S}=ankle Toes_{S}<Ankle_{S}=toes ToesEnd_{S}<Toes_{S}",
    ),
    "Synty": (
        "Root Hips<Root=pelvis Spine_01<Hips=lumbar Spine_02<Spine_01=lumbar Spine_03<Spine_02=thorax "
        "Neck<Spine_03=cervical Head<Neck=atlantal",
        "Clavicle_{S}<Spine_03=clavicle Shoulder_{S}<Clavicle_{S}=shoulder Elbow_{S}<Shoulder_{S}=elbow "
        "Hand_{S}<Elbow_{S}=wrist UpperLeg_{S}<Hips=hip LowerLeg_{S}<UpperLeg_{S}=knee Ankle_{S}<LowerLeg_{S}=ankle "
        "Ball_{S}<Ankle_{S}=toes Toes_{S}<Ball_{S}",
    ),
    "MikuMikuDance": (  # half-standard bones
        "全ての親 センター<全ての親 グルーブ<センター 腰<グルーブ 下半身<腰=pelvis 上半身<腰=lumbar "
        "上半身2<上半身=thorax 首<上半身2=cervical 頭<首=atlantal 両目<頭",
        "{J}肩P<上半身2 {J}肩<{J}肩P=clavicle {J}肩C<{J}肩 {J}腕<{J}肩C=shoulder {J}腕捩<{J}腕=shoulder "
        "{J}腕捩１<{J}腕 {J}ひじ<{J}腕捩=elbow {J}手捩<{J}ひじ=elbow {J}手首<{J}手捩=wrist {J}親指１<{J}手首 "
        "{J}中指１<{J}手首=fingers {J}足<下半身=hip {J}ひざ<{J}足=knee {J}足首<{J}ひざ=ankle "
        "{J}つま先<{J}足首=toes {J}足ＩＫ親<全ての親 {J}足ＩＫ<{J}足ＩＫ親 {J}つま先ＩＫ<{J}足ＩＫ "
        "腰キャンセル{J}<下半身 {J}足D<腰キャンセル{J} {J}ひざD<{J}足D {J}足首D<{J}ひざD {J}足先EX<{J}足首D",
    ),
    "MikuMikuDance, MMD Tools": (
        "センター 下半身<センター=pelvis 上半身<センター=thorax 首<上半身=cervical 頭<首=atlantal",
        "肩.{S}<上半身=clavicle 腕.{S}<肩.{S}=shoulder ひじ.{S}<腕.{S}=elbow 手首.{S}<ひじ.{S}=wrist "
        "足.{S}<下半身=hip ひざ.{S}<足.{S}=knee 足首.{S}<ひざ.{S}=ankle つま先.{S}<足首.{S}=toes 足ＩＫ.{S}<センター",
    ),
    "MikuMikuDance, in English": (
        "center groove<center waist<groove lower_body<waist=pelvis upper_body<waist=lumbar "
        "upper_body2<upper_body=thorax neck<upper_body2=cervical head<neck=atlantal",
        "shoulder_{S}<upper_body2=clavicle arm_{S}<shoulder_{S}=shoulder elbow_{S}<arm_{S}=elbow "
        "wrist_twist_{S}<elbow_{S}=elbow wrist_{S}<wrist_twist_{S}=wrist leg_{S}<lower_body=hip knee_{S}<leg_{S}=knee "
        "ankle_{S}<knee_{S}=ankle leg_IK_{S}<center toe_IK_{S}<leg_IK_{S}",
    ),
}
EXPORTS |= BY_LIMBS


def export(rig: str) -> list[tuple[str, str, str]]:
    """The bones of an export in order: name, parent, and the joint of human23 it maps to ("" for none)."""
    middle, sided = EXPORTS[rig]
    rows = [(row, "") for row in middle.split()]
    for side, _ in SIDES:
        words = {"side": side, "Side": side.title(), "SIDE": side.upper(), "s": side[0], "S": side[0].upper()}
        words["J"] = "左" if side == "left" else "右"
        rows += [(row.format(**words), side) for row in sided.split()]
    bones = []
    for row, side in rows:
        bone, _, joint = row.partition("=")
        name, _, parent = bone.partition("<")
        bones.append((name, parent, f"{side}_{joint}" if joint and side else joint))
    return bones


def exported(motion: Motion, rig: str, zero: Mapping[str, Floats]) -> Motion:
    """The movement on a program's bones: of several in a row for one joint, the lower ones stand on its bone."""
    bones, body = export(rig), motion.skeleton
    local = np.array([zero.get(name, rot.IDENTITY) for name in body.names])
    alignment = body.global_rotations(local)
    at_zero = body.positions(local, np.zeros(3))
    turned = rot.mul_inv(body.global_rotations(motion.rotations), alignment)
    names = [name for name, _, _ in bones]
    parents = [names.index(parent) if parent else -1 for _, parent, _ in bones]
    places, turns = np.zeros((len(bones), 3)), np.tile(rot.IDENTITY, (len(motion), len(bones), 1))
    seen: list[str] = []
    below = next(i for i, (_, _, joint) in enumerate(bones) if joint == "pelvis")
    for i, (_, _, joint) in enumerate(bones):
        if joint:
            number = body.index(joint)
            along = at_zero[body.children(number)[0]] if body.children(number) else at_zero[number]
            row = [one for _, _, one in bones].count(joint)
            places[i] = at_zero[number] + seen.count(joint) / row * (along - at_zero[number])
            turns[:, i] = turned[:, number]
            seen.append(joint)
        elif i > below:  # what the pelvis hangs from is at its place, and stays as it is
            places[i], turns[:, i] = places[parents[i]] + [0.0, -0.02, 0.01], turns[:, parents[i]]
    offsets = places - places[[max(parent, 0) for parent in parents]]
    offsets[0] = 0.0
    tips = np.zeros((len(bones), 3))
    for i, (_, _, joint) in enumerate(bones):
        if joint and i not in parents:
            tips[i] = rot.mul_vec(alignment[body.index(joint)], body.tips[body.index(joint)])
    skeleton = Skeleton("file", tuple(names), tuple(parents), offsets, tips)
    return Motion(skeleton, skeleton.local_rotations(turns), motion.root, motion.times)


# What each rig calls human23's joints; {0} is "left", {1} "Left", {2} "l", {3} "L".
SIDED = {
    "CMU, BVH": "UpLeg Leg Foot ToeBase Shoulder Arm ForeArm Hand HandIndex1",
    "Mixamo": "UpLeg Leg Foot ToeBase Shoulder Arm ForeArm Hand HandMiddle1",
    "CMU, ASF": "femur tibia foot toes clavicle humerus radius hand fingers",
    "Biovision": "Hip Knee Ankle Toe Collar Shoulder Elbow Wrist -",
    "Poser": "Thigh Shin Foot Toe Collar Shldr ForeArm Hand Mid1",
    "Bandai-Namco": "UpperLeg LowerLeg Foot Toes Shoulder UpperArm LowerArm Hand -",
}
CENTRE = {
    "CMU, BVH": "Hips Spine Spine1 Neck1 Head",
    "Mixamo": "mixamorig:Hips mixamorig:Spine mixamorig:Spine1 mixamorig:Neck mixamorig:Head",
    "CMU, ASF": "root upperback thorax upperneck head",
    "Biovision": "Hips Chest Chest2 Neck Head",
    "Poser": "hip abdomen chest neck head",
    "Bandai-Namco": "Hips Spine Chest Neck Head",
}
PATTERN = {
    "CMU, BVH": "{1}{j}",
    "Mixamo": "mixamorig:{1}{j}",
    "CMU, ASF": "{2}{j}",
    "Biovision": "{1}{j}",
    "Poser": "{2}{j}",
    "Bandai-Namco": "{j}_{3}",
}
LIMB_JOINTS = ("hip", "knee", "ankle", "toes", "clavicle", "shoulder", "elbow", "wrist", "fingers")


def rig_names(rig: str) -> dict[str, str]:
    """human23's joint -> the rig's name for it; without those it lacks."""
    names = dict(zip(("pelvis", "lumbar", "thorax", "cervical", "atlantal"), CENTRE[rig].split(), strict=True))
    for side, _ in SIDES:
        for joint, word in zip(LIMB_JOINTS, SIDED[rig].split(), strict=True):
            if word != "-":
                names[f"{side}_{joint}"] = PATTERN[rig].format(side, side.title(), side[0], side[0].upper(), j=word)
    return names


def disguise(
    motion: Motion,
    names: Mapping[str, str],
    zero: Mapping[str, Floats],
    frames: Mapping[str, Floats] | None = None,
    world: Floats = rot.IDENTITY,
) -> Motion:
    """The movement on a skeleton with other names, zero pose, axes and vertical.

    `zero` are human23's local rotations in the file's zero pose; `frames` where human23's axes lie in the joints'
    own frames, where that is not given by `zero`. Joints of human23 without a name must be leaves.
    """
    body = motion.skeleton
    local = np.array([zero.get(name, rot.IDENTITY) for name in body.names])
    alignment = rot.mul(world, body.global_rotations(local))
    for name, frame in (frames or {}).items():
        alignment[body.index(name)] = frame
    turned = rot.mul_inv(rot.mul(world, body.global_rotations(motion.rotations)), alignment)
    kept = [i for i, name in enumerate(body.names) if name in names]
    skeleton = Skeleton(
        "file",
        tuple(names[body.names[i]] for i in kept),
        tuple(kept.index(body.parents[i]) if i else -1 for i in kept),
        np.array([rot.mul_vec(alignment[body.parents[i]], body.offsets[i]) if i else np.zeros(3) for i in kept]),
        np.array([rot.mul_vec(alignment[i], body.tips[i]) for i in kept]),
    )
    rotations = skeleton.local_rotations(turned[:, kept])
    plan = tuple(insertion.renamed(names) for insertion in motion.insertions)
    return Motion(skeleton, rotations, rot.mul_vec(world, motion.root), motion.times, "x", plan)


@cache
def stroll(bends: float = 1.0, frames: int = 120) -> Motion:
    """A body that steps on the spot: knees, elbows and toes bend as hinges do, all else sways; without toes' tips down.

    `bends` is the share of the hinges' usual bends.
    """
    rng = np.random.default_rng(7)
    phase = np.linspace(0.0, 8.0 * np.pi, frames)
    sway = 0.1 * np.sin(
        phase[:, None, None] * rng.uniform(0.5, 2.0, (len(BODY), 3)) + rng.uniform(0, 6, (len(BODY), 3))
    )
    angles = dict(zip(BODY.names, np.moveaxis(sway, 1, 0), strict=True))
    for side, sign in SIDES:
        lift = bends * np.maximum(0.0, sign * np.sin(phase))
        angles[f"{side}_hip"] = angles[f"{side}_hip"] * [1.0, 0.5, 0.5] - np.outer(0.7 * lift, [1.0, 0.0, 0.0])
        angles[f"{side}_knee"] = np.outer(0.05 * bends + 1.2 * lift, [1.0, 0.0, 0.0])
        angles[f"{side}_ankle"] = np.outer(-0.5 * lift, [1.0, 0.0, 0.0])
        angles[f"{side}_toes"] = np.outer(-0.3 * lift, [1.0, 0.0, 0.0])
        angles[f"{side}_shoulder"] = angles[f"{side}_shoulder"] + [0.0, 0.0, -sign * 1.2]
        angles[f"{side}_elbow"] = np.outer(-sign * (0.3 * bends + 0.5 * lift), [0.0, 1.0, 0.0])
    turns = rot.exp(np.stack([angles[name] for name in BODY.names], axis=1))
    low = BODY.positions_and_tips(turns, np.zeros((frames, 3)))[..., 1].min(axis=1)
    return Motion(BODY, turns, np.stack([0.0 * low, -low, 0.0 * low], axis=1), np.arange(frames) / 30.0)


def along_bones(axis: str, roll: float, world: tuple[str, ...] = ()) -> dict[str, Floats]:
    """Where human23's axes lie in joints whose own axis is along their bones, turned about them by `roll` degrees."""
    first = {BODY.names[parent]: child for child, parent in reversed([*enumerate(BODY.parents)]) if parent >= 0}
    first |= {"pelvis": BODY.index("lumbar"), "thorax": BODY.index("cervical")}
    sign = -1.0 if axis[0] == "-" else 1.0
    along = sign * np.eye(3)["xyz".index(axis[-1])]
    out = {}
    for i, name in enumerate(BODY.names):
        bone = BODY.offsets[first[name]] if name in first else BODY.tips[i]
        out[name] = rot.mul(rot.from_axis_angle(along, np.radians(roll)), rot.between(bone, along))
    return out | dict.fromkeys(world, rot.IDENTITY)


def lacking(rig: str) -> tuple[str, ...]:
    """The joints of human23, without their side, that a program's rig lacks."""
    return tuple({name.split("_")[-1] for name in BODY.names} - {joint.split("_")[-1] for _, _, joint in export(rig)})


def with_still(motion: Motion, joints: tuple[str, ...]) -> Motion:
    """The movement with some joints at rest, given without their side."""
    rotations = motion.rotations.copy()
    rotations[:, [i for i, name in enumerate(motion.skeleton.names) if name.endswith(joints or ("-",))]] = rot.IDENTITY
    return replace(motion, rotations=rotations)
