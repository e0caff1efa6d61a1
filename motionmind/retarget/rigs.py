"""Well-known rigs: their joints' names, and the orientation of their axes in the body.

Names are written here without case, punctuation or namespace, as `plain_names` returns them: "mixamorig:LeftUpLeg" is
"leftupleg". Several joints in a row may map to one of human23's, which takes its place from the first and its rotation
from the last.

Sources of the names: the CMU Motion Capture Database's ASF files and their conversion to BVH by B. Hahne
(cgspeed.com), also to the figures of Poser and DAZ Studio; Mixamo's and Autodesk HumanIK's rigs (the same but for the
namespace); Biovision's own names, in use since the format's first files, and in Xsens MVN's BVH; Xsens MVN's segments,
as in the MVN User Manual (MV0319P) and in MVNX; Bandai-Namco-Research-Motiondataset; the published code of SMPL and its
variants; Rokoko's Newton skeleton; Unreal Engine's mannequins; the humanoid bones of VRM (VRMC_vrm-1.0) and what VRoid
Studio calls them; Blender's Rigify; DAZ Studio's Genesis figures; OptiTrack Motive's skeletons; 3ds Max's Biped;
Reallusion's Character Creator; MakeHuman's default rig; what Move.ai and DeepMotion export.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from motionmind._typing import Floats
from motionmind.body.human import human23, human44
from motionmind.geometry import rotations as rot
from motionmind.retarget.rig import Rig, plain_names


def _both_sides(sided: Mapping[str, str]) -> dict[str, str]:
    """Expand names for left and right: "{side}" is the word, "{s}" its initial."""
    return {
        name.format(side=side, s=side[0]): f"{side}_{joint}"
        for side in ("left", "right")
        for name, joint in sided.items()
    }


def _axes(x: str, y: str, pitch: float = 0.0) -> Floats:
    """Return the quaternion [4] that takes +x and +y to signed axes such as "-z", after `pitch` degrees about +x."""
    columns = [(-1.0 if name[0] == "-" else 1.0) * np.eye(3)["xyz".index(name[1])] for name in (x, y)]
    turned = rot.from_matrix(np.stack([*columns, np.cross(*columns)], axis=-1))
    return rot.mul(turned, rot.from_axis_angle([1.0, 0.0, 0.0], np.radians(pitch)))


_HUMANIK = {
    "hips": "pelvis",
    "neck": "cervical",
    "neck1": "cervical",
    "neck2": "cervical",
    "head": "atlantal",
} | _both_sides(
    {
        "{side}upleg": "hip",
        "{side}leg": "knee",
        "{side}foot": "ankle",
        "{side}toebase": "toes",
        "{side}toe": "toes",  # LaFAN1's
        "{side}shoulder": "clavicle",
        "{side}arm": "shoulder",
        "{side}forearm": "elbow",
        "{side}hand": "wrist",
        "{side}fingerbase": "wrist",  # CMU's hand; its {side}hand only twists the forearm
        "{side}handmiddle1": "fingers",
        "{side}handindex1": "fingers",
        "{side}handend": "fingers",
    }
)
_HUMANIK_SPINE = ("lowerback", "spine", "spine1", "spine2", "spine3", "spine4", "spine5")

# CMU's neck, too, has two bones. The upper one is where human23's cervical joint is, and taking it alone keeps the head
# closer to its place than joining both (16 mm off instead of 23 mm, in five clips of karate).
_CMU_BVH = {name: joint for name, joint in _HUMANIK.items() if name != "neck"}

# lwrist only twists the forearm; the hand's joint is lhand.
_CMU_ASF = {
    "root": "pelvis",
    "upperneck": "cervical",
    "head": "atlantal",
} | _both_sides(
    {
        "{s}femur": "hip",
        "{s}tibia": "knee",
        "{s}foot": "ankle",
        "{s}toes": "toes",
        "{s}clavicle": "clavicle",
        "{s}humerus": "shoulder",
        "{s}radius": "elbow",
        "{s}hand": "wrist",
        "{s}fingers": "fingers",
    }
)

_BIOVISION = {
    "hips": "pelvis",
    "lowerneck": "cervical",
    "neck": "cervical",
    "neck1": "cervical",
    "head": "atlantal",
} | _both_sides(
    {
        "{side}hip": "hip",
        "{side}upleg": "hip",
        "{side}knee": "knee",
        "{side}lowleg": "knee",
        "{side}ankle": "ankle",
        "{side}foot": "ankle",
        "{side}toes": "toes",
        "{side}toe": "toes",
        "{side}collar": "clavicle",
        "{side}shoulder": "shoulder",
        "{side}uparm": "shoulder",
        "{side}elbow": "elbow",
        "{side}lowarm": "elbow",
        "{side}wrist": "wrist",
        "{side}hand": "wrist",
        "{s}hand": "wrist",
        "{s}fingers": "fingers",
    }
)

_BANDAI = {"hips": "pelvis", "neck": "cervical", "head": "atlantal"} | _both_sides(
    {
        "upperleg{s}": "hip",
        "lowerleg{s}": "knee",
        "foot{s}": "ankle",
        "toes{s}": "toes",
        "shoulder{s}": "clavicle",
        "upperarm{s}": "shoulder",
        "lowerarm{s}": "elbow",
        "hand{s}": "wrist",
    }
)

# Bandai's zero pose does not stand: in each joint's frame the bone lies along +x (right limbs: -x), and the hinge of
# knee and elbow is y. For limbs this gives human23's +x (left) and +y (up); for the trunk they follow from where hips
# and shoulders are attached. The sense of the hinges is taken from the movement: knees turn about +y, elbows about -y.
# With the soles flat on the floor (where the feet of walk, kick and slash rest most of the time) the bone from ankle to
# toes points 39.6 degrees down, the toes' own x axis 23.0 degrees.
_TRUNK, _LEG = _axes("+z", "+x"), {"left": ("+y", "-x"), "right": ("+y", "+x")}
_ARM = {"left": _axes("+x", "+y"), "right": _axes("+x", "-y")}
_BANDAI_FRAMES = (
    {"pelvis": _axes("-y", "+x")}
    | dict.fromkeys(("lumbar", "thorax", "cervical", "atlantal"), _TRUNK)
    | {f"{side}_{joint}": _axes(*axes) for side, axes in _LEG.items() for joint in ("hip", "knee")}
    | {f"{side}_ankle": _axes(*axes, pitch=90.0 - 39.6) for side, axes in _LEG.items()}
    | {f"{side}_toes": _axes(*axes, pitch=90.0 - 23.0) for side, axes in _LEG.items()}
    | {f"{side}_{j}": axes for side, axes in _ARM.items() for j in ("clavicle", "shoulder", "elbow", "wrist")}
)

# CMU's elbows are hinges about (0, -0.866, 0.5) in the zero pose of the left arm, 30 degrees off the vertical (the
# axis of lradius is "180 -30 -90" in the ASF files, and the BVH's LeftForeArm turns about it). The hand is not twisted
# with them: its palm is down in that pose. Necks are as measured on the performer: subject 05's leans back by 22
# degrees, and forward by as much in all movement; subject 135's is straight.
_CMU_TWISTS = {f"{side}_{joint}": np.radians(-30.0) for side in ("left", "right") for joint in ("shoulder", "elbow")}

# Poser's figures, in the conversions of CMU's recordings: they keep CMU's elbows, and the buttocks between hip and
# thigh are at rest.
_POSER = {"hip": "pelvis", "neck": "cervical", "head": "atlantal"} | _both_sides(
    {
        "{s}thigh": "hip",
        "{s}shin": "knee",
        "{s}foot": "ankle",
        "{s}toe": "toes",
        "{s}collar": "clavicle",
        "{s}shldr": "shoulder",
        "{s}forearm": "elbow",
        "{s}hand": "wrist",
        "{s}mid1": "fingers",
    }
)

# At rest SMPL stands like human23, all axes the world's. spine2 is as high above the pelvis as human23's thorax; the
# middle finger represents all four.
_SMPL = {
    "pelvis": "pelvis",
    "spine1": "lumbar",
    "spine2": "thorax",
    "spine3": "thorax",
    "neck": "cervical",
    "head": "atlantal",
} | _both_sides(
    {
        "{side}hip": "hip",
        "{side}knee": "knee",
        "{side}ankle": "ankle",
        "{side}foot": "toes",
        "{side}collar": "clavicle",
        "{side}shoulder": "shoulder",
        "{side}elbow": "elbow",
        "{side}wrist": "wrist",
        "{side}middle1": "fingers",
        "{side}hand": "fingers",
    }
)

# SMPL's models for Maya, Unity and Unreal call the same joints so; SMPL+H's count knuckles from 0 there.
_SMPL_MODELS = {name: joint for name, joint in _SMPL.items() if not name.startswith(("left", "right"))} | _both_sides(
    {
        "{s}hip": "hip",
        "{s}knee": "knee",
        "{s}ankle": "ankle",
        "{s}foot": "toes",
        "{s}collar": "clavicle",
        "{s}shoulder": "shoulder",
        "{s}elbow": "elbow",
        "{s}wrist": "wrist",
        "{s}middle0": "fingers",
        "{s}hand": "fingers",
    }
)

# Genesis 1 and 2 have thigh and shldr; 3 and 8 divide them in bend and twist; 9 says upperarm. Unlike Poser's figures
# they have a pelvis below the hip, and elbows of their own: at rest palms face down, and forearms turn about the
# vertical.
_GENESIS = {
    "hip": "pelvis",
    "pelvis": "pelvis",
    "neck": "cervical",
    "necklower": "cervical",
    "neckupper": "cervical",
    "neck1": "cervical",
    "neck2": "cervical",
    "head": "atlantal",
} | _both_sides(
    {
        "{s}thigh": "hip",
        "{s}thighbend": "hip",
        "{s}thightwist": "hip",
        "{s}shin": "knee",
        "{s}foot": "ankle",
        "{s}toe": "toes",
        "{s}toes": "toes",
        "{s}collar": "clavicle",
        "{s}shoulder": "clavicle",
        "{s}shldr": "shoulder",
        "{s}shldrbend": "shoulder",
        "{s}shldrtwist": "shoulder",
        "{s}upperarm": "shoulder",
        "{s}forearm": "elbow",
        "{s}forearmbend": "elbow",
        "{s}forearmtwist": "elbow",
        "{s}hand": "wrist",
        "{s}mid1": "fingers",
    }
)
_GENESIS_SPINE = (
    *("abdomen", "abdomenlower", "abdomen2", "abdomenupper", "chest", "chestlower", "chestupper"),
    *("spine1", "spine2", "spine3", "spine4"),
)

_ROKOKO = {"hips": "pelvis", "neck": "cervical", "head": "atlantal"} | _both_sides(
    {
        "{side}thigh": "hip",
        "{side}shin": "knee",
        "{side}foot": "ankle",
        "{side}toe": "toes",
        "{side}shoulder": "clavicle",
        "{side}arm": "shoulder",
        "{side}forearm": "elbow",
        "{side}hand": "wrist",
        "{side}finger3proximal": "fingers",
    }
)

# MVN's segments, each named for the bone that begins at the joint.
_XSENS = {"pelvis": "pelvis", "neck": "cervical", "head": "atlantal"} | _both_sides(
    {
        "{side}upperleg": "hip",
        "{side}lowerleg": "knee",
        "{side}foot": "ankle",
        "{side}toe": "toes",
        "{side}shoulder": "clavicle",
        "{side}upperarm": "shoulder",
        "{side}forearm": "elbow",
        "{side}hand": "wrist",
    }
)

# Bones that only twist a limb (upperarm_twist_01_l) hang beside it, and are left out.
_UNREAL = {"pelvis": "pelvis", "neck01": "cervical", "neck02": "cervical", "head": "atlantal"} | _both_sides(
    {
        "thigh{s}": "hip",
        "calf{s}": "knee",
        "foot{s}": "ankle",
        "ball{s}": "toes",
        "clavicle{s}": "clavicle",
        "upperarm{s}": "shoulder",
        "lowerarm{s}": "elbow",
        "hand{s}": "wrist",
        "middle01{s}": "fingers",
    }
)

_VRM = {"hips": "pelvis", "neck": "cervical", "head": "atlantal"} | _both_sides(
    {
        "{side}upperleg": "hip",
        "{side}lowerleg": "knee",
        "{side}foot": "ankle",
        "{side}toes": "toes",
        "{side}shoulder": "clavicle",
        "{side}upperarm": "shoulder",
        "{side}lowerarm": "elbow",
        "{side}hand": "wrist",
        "{side}middleproximal": "fingers",
    }
)
_VROID = {"jbipchips": "pelvis", "jbipcneck": "cervical", "jbipchead": "atlantal"} | _both_sides(
    {
        "jbip{s}upperleg": "hip",
        "jbip{s}lowerleg": "knee",
        "jbip{s}foot": "ankle",
        "jbip{s}toebase": "toes",
        "jbip{s}shoulder": "clavicle",
        "jbip{s}upperarm": "shoulder",
        "jbip{s}lowerarm": "elbow",
        "jbip{s}hand": "wrist",
        "jbip{s}middle1": "fingers",
    }
)

# The metarig; a generated rig's bones that carry the skin are called the same after DEF-, and limbs are divided in two.
_METARIG = {"spine": "pelvis", "spine004": "cervical", "spine005": "cervical", "spine006": "atlantal"} | _both_sides(
    {
        "thigh{s}": "hip",
        "thigh{s}001": "hip",
        "shin{s}": "knee",
        "shin{s}001": "knee",
        "foot{s}": "ankle",
        "toe{s}": "toes",
        "shoulder{s}": "clavicle",
        "upperarm{s}": "shoulder",
        "upperarm{s}001": "shoulder",
        "forearm{s}": "elbow",
        "forearm{s}001": "elbow",
        "hand{s}": "wrist",
        "fmiddle01{s}": "fingers",
    }
)
_METARIG_SPINE = ("spine001", "spine002", "spine003")

_OPTITRACK = {"hip": "pelvis", "neck": "cervical", "head": "atlantal"} | _both_sides(
    {
        "{s}thigh": "hip",
        "{s}shin": "knee",
        "{s}foot": "ankle",
        "{s}toe": "toes",
        "{s}shoulder": "clavicle",
        "{s}uarm": "shoulder",
        "{s}farm": "elbow",
        "{s}hand": "wrist",
        "{s}middle1": "fingers",
    }
)

_BIPED = {
    "pelvis": "pelvis",
    "neck": "cervical",
    "neck1": "cervical",
    "head": "atlantal",
    "head1": "atlantal",
} | _both_sides(
    {
        "{s}thigh": "hip",
        "{s}calf": "knee",
        "{s}foot": "ankle",
        "{s}toe0": "toes",
        "{s}clavicle": "clavicle",
        "{s}upperarm": "shoulder",
        "{s}forearm": "elbow",
        "{s}hand": "wrist",
        "{s}finger2": "fingers",
    }
)

# As in Genesis legs hang from a pelvis below the hip. Bones that only twist a limb are left out.
_REALLUSION = {
    "hip": "pelvis",
    "pelvis": "pelvis",
    "necktwist01": "cervical",
    "necktwist02": "cervical",
    "head": "atlantal",
} | _both_sides(
    {
        "{s}thigh": "hip",
        "{s}calf": "knee",
        "{s}foot": "ankle",
        "{s}toebase": "toes",
        "{s}clavicle": "clavicle",
        "{s}upperarm": "shoulder",
        "{s}forearm": "elbow",
        "{s}hand": "wrist",
        "{s}mid1": "fingers",
    }
)

_MOVE_AI = {"root": "pelvis", "neck": "cervical", "head": "atlantal"} | _both_sides(
    {
        "{side}upperleg": "hip",
        "{side}lowerleg": "knee",
        "{side}foot": "ankle",
        "{side}toe": "toes",
        "{side}shoulder": "clavicle",
        "{side}upperarm": "shoulder",
        "{side}lowerarm": "elbow",
        "{side}hand": "wrist",
    }
)

_MAKEHUMAN = {
    "root": "pelvis",
    "neck01": "cervical",
    "neck02": "cervical",
    "neck03": "cervical",
    "head": "atlantal",
} | _both_sides(
    {
        "upperleg01{s}": "hip",
        "upperleg02{s}": "hip",
        "lowerleg01{s}": "knee",
        "lowerleg02{s}": "knee",
        "foot{s}": "ankle",
        "toe21{s}": "toes",
        "clavicle{s}": "clavicle",
        "shoulder01{s}": "clavicle",
        "upperarm01{s}": "shoulder",
        "upperarm02{s}": "shoulder",
        "lowerarm01{s}": "elbow",
        "lowerarm02{s}": "elbow",
        "wrist{s}": "wrist",
        "finger31{s}": "fingers",
    }
)

_DEEPMOTION = {"hipsjnt": "pelvis", "neckjnt": "cervical", "headjnt": "atlantal"} | _both_sides(
    {
        "{s}uplegjnt": "hip",
        "{s}legjnt": "knee",
        "{s}footjnt": "ankle",
        "{s}toebasejnt": "toes",
        "{s}shoulderjnt": "clavicle",
        "{s}armjnt": "shoulder",
        "{s}forearmjnt": "elbow",
        "{s}handjnt": "wrist",
        "{s}handmiddle1jnt": "fingers",
    }
)

_OWN = {name.replace("_", ""): name for name in human23().names}
_OWN_FRAMES = dict.fromkeys(human23().names, rot.IDENTITY)

# Of human44's rows only the spine's are joined; the axial joint's rotation goes to the head, as in the body. A fist
# folds further than human23's fingers can: they turn with the first row of knuckles, as toes do.
_HUMAN44 = _OWN | {
    "lumbarmiddle": "lumbar",
    "lumbarupper": "lumbar",
    "thoraxmiddle": "thorax",
    "thoraxupper": "thorax",
    "cervicalmiddle": "cervical",
    "cervicalupper": "cervical",
}

RIGS: tuple[Rig, ...] = (
    Rig("human44", _HUMAN44, (), frozenset(plain_names(human44().names)), frames=_OWN_FRAMES),
    Rig("human23", _OWN, (), frames=_OWN_FRAMES),
    Rig("CMU, BVH", _CMU_BVH, _HUMANIK_SPINE, frozenset({"lhipjoint", "neck1"}), neck_leans=True, twists=_CMU_TWISTS),
    Rig("CMU, ASF", _CMU_ASF, ("lowerback", "upperback", "thorax"), neck_leans=True, twists=_CMU_TWISTS),
    Rig("Mixamo", _HUMANIK, _HUMANIK_SPINE),
    Rig("Biovision", _BIOVISION, ("lowerback", "ab", "abdomen", "chest", "chest2", "chest3", "chest4")),
    Rig("DAZ Genesis", _GENESIS, _GENESIS_SPINE, frozenset({"hip", "pelvis"})),
    Rig("Poser", _POSER, ("abdomen", "chest"), frozenset({"abdomen", "lshldr"}), twists=_CMU_TWISTS),
    Rig("Bandai-Namco", _BANDAI, ("spine", "chest", "upperchest"), frames=_BANDAI_FRAMES),
    Rig("SMPL", _SMPL, (), frozenset({"spine3", "leftcollar"}), frames=_OWN_FRAMES),
    Rig("SMPL, models", _SMPL_MODELS, (), frozenset({"spine3", "lcollar"}), frames=_OWN_FRAMES),
    Rig("Rokoko", _ROKOKO, ("spine", "spine1", "spine2", "spine3", "spine4")),
    Rig("Xsens MVN", _XSENS, ("l5", "l3", "t12", "t8")),
    Rig("Unreal", _UNREAL, ("spine01", "spine02", "spine03", "spine04", "spine05")),
    Rig("VRM", _VRM, ("spine", "chest", "upperchest")),
    Rig("VRoid", _VROID, ("jbipcspine", "jbipcchest", "jbipcupperchest")),
    Rig("Rigify", {f"def{name}": joint for name, joint in _METARIG.items()}, [f"def{name}" for name in _METARIG_SPINE]),
    Rig("Rigify, metarig", _METARIG, _METARIG_SPINE),
    Rig("OptiTrack", _OPTITRACK, ("ab", "chest")),
    Rig("Biped", _BIPED, ("spine", "spine1", "spine2", "spine3", "spine4")),
    Rig("Reallusion", _REALLUSION, ("waist", "spine01", "spine02")),
    Rig(  # below a root with another name, so that the prefix is not all joints'
        "Reallusion, named in full",
        {f"ccbase{name}": joint for name, joint in _REALLUSION.items()},
        ("ccbasewaist", "ccbasespine01", "ccbasespine02"),
    ),
    Rig("Move.ai", _MOVE_AI, ("spine", "spine1", "spine2", "chest")),
    Rig("MakeHuman", _MAKEHUMAN, ("spine05", "spine04", "spine03", "spine02", "spine01")),
    Rig("DeepMotion", _DEEPMOTION, ("spinejnt", "spine1jnt", "spine2jnt")),
)
