"""Well-known rigs: their joints' names, and the orientation of their axes in the body.

Names are in plain form, as `plain_names` returns them: "mixamorig:LeftUpLeg" is "leftupleg". Several joints in a row
may map to one of human23's joints, which takes its place from the first and its rotation from the last.

Sources of the names: the CMU Motion Capture Database's ASF files and their conversion to BVH by B. Hahne
(cgspeed.com), also to the figures of Poser and DAZ Studio; Mixamo's and Autodesk HumanIK's rigs (the same but for the
namespace); Biovision's own names, in use since the format's first files, and in Xsens MVN's BVH; Xsens MVN's segments,
as in the MVN User Manual (MV0319P) and in MVNX; Bandai-Namco-Research-Motiondataset; the published code of SMPL and its
variants; Rokoko's Newton skeleton; Unreal Engine's mannequins; the humanoid bones of VRM (VRMC_vrm-1.0) and VRoid
Studio's names for them; Blender's Rigify; DAZ Studio's Genesis figures; OptiTrack Motive's skeletons; 3ds Max's Biped;
Reallusion's Character Creator; MakeHuman's default rig; exports of Move.ai and DeepMotion.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy import SIDES
from motionmind.body.human import human23, human44
from motionmind.geometry import rotations as rot
from motionmind.retarget.rig import Rig, plain_names


def _joints(**names: str) -> dict[str, str]:
    """Return {name: joint of human23} for the names of each joint.

    In names of limbs "{side}" is the word "left" or "right", and "{s}" its initial.
    """
    return {
        name.format(side=side, s=side[0]): f"{side}_{joint}" if "{" in name else joint
        for joint, words in names.items()
        for name in words.split()
        for side in SIDES
    }


def _axes(x: str, y: str, pitch_deg: float = 0.0) -> Floats:
    """Return the quaternion [4] that takes +x and +y to signed axes such as "-z", after a pitch about +x."""
    columns = [(-1.0 if name[0] == "-" else 1.0) * np.eye(3)["xyz".index(name[1])] for name in (x, y)]
    turned = rot.from_matrix(np.stack([*columns, np.cross(*columns)], axis=-1))
    return rot.mul(turned, rot.from_axis_angle([1.0, 0.0, 0.0], np.radians(pitch_deg)))


def _bandai_frames() -> dict[str, Floats]:
    """Return the frames of Bandai-Namco's rig, whose zero pose does not stand.

    In each joint's frame the bone lies along +x (right limbs: -x), and the hinge of knee and elbow is y. For limbs this
    gives human23's +x (left) and +y (up); for the trunk they follow from where hips and shoulders are attached. The
    sense of the hinges comes from the movement: knees turn about +y, elbows about -y. With the soles flat on the floor
    (where the feet of walk, kick and slash rest most of the time) the bone from ankle to toes points 39.6 degrees down,
    the toes' own x axis 23.0 degrees.
    """
    frames = {"pelvis": _axes("-y", "+x")}
    frames |= dict.fromkeys(("lumbar", "thorax", "cervical", "atlantal"), _axes("+z", "+x"))
    for side, leg, arm in (("left", ("+y", "-x"), ("+x", "+y")), ("right", ("+y", "+x"), ("+x", "-y"))):
        frames |= {f"{side}_{joint}": _axes(*leg) for joint in ("hip", "knee")}
        frames |= {f"{side}_ankle": _axes(*leg, 90.0 - 39.6), f"{side}_toes": _axes(*leg, 90.0 - 23.0)}
        frames |= {f"{side}_{joint}": _axes(*arm) for joint in ("clavicle", "shoulder", "elbow", "wrist")}
    return frames


_HUMANIK = _joints(
    pelvis="hips",
    cervical="neck neck1 neck2",
    atlantal="head",
    hip="{side}upleg",
    knee="{side}leg",
    ankle="{side}foot",
    toes="{side}toebase {side}toe",  # the second is LaFAN1's
    clavicle="{side}shoulder",
    shoulder="{side}arm",
    elbow="{side}forearm",
    wrist="{side}hand {side}fingerbase",  # CMU's hand is fingerbase; its {side}hand only twists the forearm
    fingers="{side}handmiddle1 {side}handindex1 {side}handend",
)
_HUMANIK_SPINE = ("lowerback", "spine", "spine1", "spine2", "spine3", "spine4", "spine5")

# CMU's elbows are hinges about (0, -0.866, 0.5) in the zero pose of the left arm, 30 degrees off the vertical (the
# axis of lradius is "180 -30 -90" in the ASF files, and the BVH's LeftForeArm turns about it). The hand is not twisted
# with them: its palm is down in that pose. Necks are as measured on the performer: subject 05's leans back by 22
# degrees, and forward by as much in all movement; subject 135's is straight.
_CMU_TWISTS_RAD = {f"{side}_{joint}": np.radians(-30.0) for side in SIDES for joint in ("shoulder", "elbow")}

# spine2 is as high above the pelvis as human23's thorax.
_SMPL_TRUNK = _joints(pelvis="pelvis", lumbar="spine1", thorax="spine2 spine3", cervical="neck", atlantal="head")

# The bones of a generated rig that carry the skin have the same names after DEF-, and its limbs are divided in two.
_METARIG = _joints(
    pelvis="spine",
    cervical="spine004 spine005",
    atlantal="spine006",
    hip="thigh{s} thigh{s}001",
    knee="shin{s} shin{s}001",
    ankle="foot{s}",
    toes="toe{s}",
    clavicle="shoulder{s}",
    shoulder="upperarm{s} upperarm{s}001",
    elbow="forearm{s} forearm{s}001",
    wrist="hand{s}",
    fingers="fmiddle01{s}",
)
_METARIG_SPINE = ("spine001", "spine002", "spine003")

# As in Genesis, legs hang from a pelvis below the hip. Bones that only twist a limb are left out.
_REALLUSION = _joints(
    pelvis="hip pelvis",
    cervical="necktwist01 necktwist02",
    atlantal="head",
    hip="{s}thigh",
    knee="{s}calf",
    ankle="{s}foot",
    toes="{s}toebase",
    clavicle="{s}clavicle",
    shoulder="{s}upperarm",
    elbow="{s}forearm",
    wrist="{s}hand",
    fingers="{s}mid1",
)

_HUMAN23 = {name.replace("_", ""): name for name in human23().names}
_WORLD_FRAMES = dict.fromkeys(human23().names, rot.IDENTITY)

RIGS: tuple[Rig, ...] = (
    # Of human44's rows only the spine's are joined; the axial joint's rotation goes to the head, as in the body. A fist
    # folds further than human23's fingers can: they turn with the first row of knuckles, as toes do.
    Rig(
        "human44",
        _HUMAN23
        | _joints(
            lumbar="lumbarmiddle lumbarupper",
            thorax="thoraxmiddle thoraxupper",
            cervical="cervicalmiddle cervicalupper",
        ),
        (),
        frozenset(plain_names(human44().names)),
        frames=_WORLD_FRAMES,
    ),
    Rig("human23", _HUMAN23, (), frames=_WORLD_FRAMES),
    # CMU's neck, too, has two bones. The upper one is where human23's cervical joint is, and taking it alone keeps the
    # head closer to its place than joining both (16 mm off instead of 23 mm, in five clips of karate).
    Rig(
        "CMU, BVH",
        {name: joint for name, joint in _HUMANIK.items() if name != "neck"},
        _HUMANIK_SPINE,
        frozenset({"lhipjoint", "neck1"}),
        neck_leans=True,
        twists_rad=_CMU_TWISTS_RAD,
    ),
    Rig(
        "CMU, ASF",
        _joints(
            pelvis="root",
            cervical="upperneck",
            atlantal="head",
            hip="{s}femur",
            knee="{s}tibia",
            ankle="{s}foot",
            toes="{s}toes",
            clavicle="{s}clavicle",
            shoulder="{s}humerus",
            elbow="{s}radius",
            wrist="{s}hand",  # lwrist only twists the forearm
            fingers="{s}fingers",
        ),
        ("lowerback", "upperback", "thorax"),
        neck_leans=True,
        twists_rad=_CMU_TWISTS_RAD,
    ),
    Rig("Mixamo", _HUMANIK, _HUMANIK_SPINE),
    Rig(
        "Biovision",
        _joints(
            pelvis="hips",
            cervical="lowerneck neck neck1",
            atlantal="head",
            hip="{side}hip {side}upleg",
            knee="{side}knee {side}lowleg",
            ankle="{side}ankle {side}foot",
            toes="{side}toes {side}toe",
            clavicle="{side}collar",
            shoulder="{side}shoulder {side}uparm",
            elbow="{side}elbow {side}lowarm",
            wrist="{side}wrist {side}hand {s}hand",
            fingers="{s}fingers",
        ),
        ("lowerback", "ab", "abdomen", "chest", "chest2", "chest3", "chest4"),
    ),
    # Genesis 1 and 2 have thigh and shldr; 3 and 8 divide them into bend and twist; 9 has upperarm. Unlike Poser's
    # figures they have a pelvis below the hip, and elbows of their own: at rest palms face down, and forearms turn
    # about the vertical.
    Rig(
        "DAZ Genesis",
        _joints(
            pelvis="hip pelvis",
            cervical="neck necklower neckupper neck1 neck2",
            atlantal="head",
            hip="{s}thigh {s}thighbend {s}thightwist",
            knee="{s}shin",
            ankle="{s}foot",
            toes="{s}toe {s}toes",
            clavicle="{s}collar {s}shoulder",
            shoulder="{s}shldr {s}shldrbend {s}shldrtwist {s}upperarm",
            elbow="{s}forearm {s}forearmbend {s}forearmtwist",
            wrist="{s}hand",
            fingers="{s}mid1",
        ),
        (
            *("abdomen", "abdomenlower", "abdomen2", "abdomenupper", "chest", "chestlower", "chestupper"),
            *("spine1", "spine2", "spine3", "spine4"),
        ),
        frozenset({"hip", "pelvis"}),
    ),
    # Poser's figures in the conversions of CMU's recordings keep CMU's elbows; the buttocks between hip and thigh are
    # at rest.
    Rig(
        "Poser",
        _joints(
            pelvis="hip",
            cervical="neck",
            atlantal="head",
            hip="{s}thigh",
            knee="{s}shin",
            ankle="{s}foot",
            toes="{s}toe",
            clavicle="{s}collar",
            shoulder="{s}shldr",
            elbow="{s}forearm",
            wrist="{s}hand",
            fingers="{s}mid1",
        ),
        ("abdomen", "chest"),
        frozenset({"abdomen", "lshldr"}),
        twists_rad=_CMU_TWISTS_RAD,
    ),
    Rig(
        "Bandai-Namco",
        _joints(
            pelvis="hips",
            cervical="neck",
            atlantal="head",
            hip="upperleg{s}",
            knee="lowerleg{s}",
            ankle="foot{s}",
            toes="toes{s}",
            clavicle="shoulder{s}",
            shoulder="upperarm{s}",
            elbow="lowerarm{s}",
            wrist="hand{s}",
        ),
        ("spine", "chest", "upperchest"),
        frames=_bandai_frames(),
    ),
    # At rest SMPL stands like human23, all axes the world's. The middle finger represents all four.
    Rig(
        "SMPL",
        _SMPL_TRUNK
        | _joints(
            hip="{side}hip",
            knee="{side}knee",
            ankle="{side}ankle",
            toes="{side}foot",
            clavicle="{side}collar",
            shoulder="{side}shoulder",
            elbow="{side}elbow",
            wrist="{side}wrist",
            fingers="{side}middle1 {side}hand",
        ),
        (),
        frozenset({"spine3", "leftcollar"}),
        frames=_WORLD_FRAMES,
    ),
    # The names in SMPL's models for Maya, Unity and Unreal; SMPL+H's count knuckles from 0 there.
    Rig(
        "SMPL, models",
        _SMPL_TRUNK
        | _joints(
            hip="{s}hip",
            knee="{s}knee",
            ankle="{s}ankle",
            toes="{s}foot",
            clavicle="{s}collar",
            shoulder="{s}shoulder",
            elbow="{s}elbow",
            wrist="{s}wrist",
            fingers="{s}middle0 {s}hand",
        ),
        (),
        frozenset({"spine3", "lcollar"}),
        frames=_WORLD_FRAMES,
    ),
    Rig(
        "Rokoko",
        _joints(
            pelvis="hips",
            cervical="neck",
            atlantal="head",
            hip="{side}thigh",
            knee="{side}shin",
            ankle="{side}foot",
            toes="{side}toe",
            clavicle="{side}shoulder",
            shoulder="{side}arm",
            elbow="{side}forearm",
            wrist="{side}hand",
            fingers="{side}finger3proximal",
        ),
        ("spine", "spine1", "spine2", "spine3", "spine4"),
    ),
    # MVN's segments, each named for the bone that begins at the joint.
    Rig(
        "Xsens MVN",
        _joints(
            pelvis="pelvis",
            cervical="neck",
            atlantal="head",
            hip="{side}upperleg",
            knee="{side}lowerleg",
            ankle="{side}foot",
            toes="{side}toe",
            clavicle="{side}shoulder",
            shoulder="{side}upperarm",
            elbow="{side}forearm",
            wrist="{side}hand",
        ),
        ("l5", "l3", "t12", "t8"),
    ),
    # Bones that only twist a limb (upperarm_twist_01_l) hang beside it, and are left out.
    Rig(
        "Unreal",
        _joints(
            pelvis="pelvis",
            cervical="neck01 neck02",
            atlantal="head",
            hip="thigh{s}",
            knee="calf{s}",
            ankle="foot{s}",
            toes="ball{s}",
            clavicle="clavicle{s}",
            shoulder="upperarm{s}",
            elbow="lowerarm{s}",
            wrist="hand{s}",
            fingers="middle01{s}",
        ),
        ("spine01", "spine02", "spine03", "spine04", "spine05"),
    ),
    Rig(
        "VRM",
        _joints(
            pelvis="hips",
            cervical="neck",
            atlantal="head",
            hip="{side}upperleg",
            knee="{side}lowerleg",
            ankle="{side}foot",
            toes="{side}toes",
            clavicle="{side}shoulder",
            shoulder="{side}upperarm",
            elbow="{side}lowerarm",
            wrist="{side}hand",
            fingers="{side}middleproximal",
        ),
        ("spine", "chest", "upperchest"),
    ),
    Rig(
        "VRoid",
        _joints(
            pelvis="jbipchips",
            cervical="jbipcneck",
            atlantal="jbipchead",
            hip="jbip{s}upperleg",
            knee="jbip{s}lowerleg",
            ankle="jbip{s}foot",
            toes="jbip{s}toebase",
            clavicle="jbip{s}shoulder",
            shoulder="jbip{s}upperarm",
            elbow="jbip{s}lowerarm",
            wrist="jbip{s}hand",
            fingers="jbip{s}middle1",
        ),
        ("jbipcspine", "jbipcchest", "jbipcupperchest"),
    ),
    Rig("Rigify", {f"def{name}": joint for name, joint in _METARIG.items()}, [f"def{name}" for name in _METARIG_SPINE]),
    Rig("Rigify, metarig", _METARIG, _METARIG_SPINE),
    Rig(
        "OptiTrack",
        _joints(
            pelvis="hip",
            cervical="neck",
            atlantal="head",
            hip="{s}thigh",
            knee="{s}shin",
            ankle="{s}foot",
            toes="{s}toe",
            clavicle="{s}shoulder",
            shoulder="{s}uarm",
            elbow="{s}farm",
            wrist="{s}hand",
            fingers="{s}middle1",
        ),
        ("ab", "chest"),
    ),
    Rig(
        "Biped",
        _joints(
            pelvis="pelvis",
            cervical="neck neck1",
            atlantal="head head1",
            hip="{s}thigh",
            knee="{s}calf",
            ankle="{s}foot",
            toes="{s}toe0",
            clavicle="{s}clavicle",
            shoulder="{s}upperarm",
            elbow="{s}forearm",
            wrist="{s}hand",
            fingers="{s}finger2",
        ),
        ("spine", "spine1", "spine2", "spine3", "spine4"),
    ),
    Rig("Reallusion", _REALLUSION, ("waist", "spine01", "spine02")),
    Rig(  # below a root with another name, so that not all joints share the prefix
        "Reallusion, named in full",
        {f"ccbase{name}": joint for name, joint in _REALLUSION.items()},
        ("ccbasewaist", "ccbasespine01", "ccbasespine02"),
    ),
    Rig(
        "Move.ai",
        _joints(
            pelvis="root",
            cervical="neck",
            atlantal="head",
            hip="{side}upperleg",
            knee="{side}lowerleg",
            ankle="{side}foot",
            toes="{side}toe",
            clavicle="{side}shoulder",
            shoulder="{side}upperarm",
            elbow="{side}lowerarm",
            wrist="{side}hand",
        ),
        ("spine", "spine1", "spine2", "chest"),
    ),
    Rig(
        "MakeHuman",
        _joints(
            pelvis="root",
            cervical="neck01 neck02 neck03",
            atlantal="head",
            hip="upperleg01{s} upperleg02{s}",
            knee="lowerleg01{s} lowerleg02{s}",
            ankle="foot{s}",
            toes="toe21{s}",
            clavicle="clavicle{s} shoulder01{s}",
            shoulder="upperarm01{s} upperarm02{s}",
            elbow="lowerarm01{s} lowerarm02{s}",
            wrist="wrist{s}",
            fingers="finger31{s}",
        ),
        ("spine05", "spine04", "spine03", "spine02", "spine01"),
    ),
    Rig(
        "DeepMotion",
        _joints(
            pelvis="hipsjnt",
            cervical="neckjnt",
            atlantal="headjnt",
            hip="{s}uplegjnt",
            knee="{s}legjnt",
            ankle="{s}footjnt",
            toes="{s}toebasejnt",
            clavicle="{s}shoulderjnt",
            shoulder="{s}armjnt",
            elbow="{s}forearmjnt",
            wrist="{s}handjnt",
            fingers="{s}handmiddle1jnt",
        ),
        ("spinejnt", "spine1jnt", "spine2jnt"),
    ),
)
