"""Recognises a person's joints by names of limbs and their place in the tree, for rigs without a table.

A name gives a joint's side and limb: "thigh.L", "HipLeft", "l_up_leg", "左足". Few words mean the same joint in all
rigs: a shoulder may be the collarbone or the arm, a leg the thigh or the shank, a foot the ankle or the toes. The
joint's place in its limb decides. From the pelvis to the toes, or from the chest to the fingers,

- joints come in the body's order, and each has a name of its own, except joints that divide a limb ("thigh.L",
  "thigh.L.001"): the first gives its place, the last its rotation;
- the assignment that uses most names must be unique, and the same on both sides.

Pelvis and spine need no names. Legs hang from the pelvis, and the spine lies between it and the joint that carries the
arms. If one joint carries legs and arms, as in OpenNI, joints between it and neck or arms are thorax and clavicles. An
unclear rig counts as unknown: a wrong guess is worse than none.

Sources of the words: the rigs of `motionmind.retarget.rigs`; Sony's receiver plugins for mocopi; Microsoft's documents
of Kinect for Windows 2 and of Azure Kinect's body tracking; Apple's ARKit (`ARSkeletonDefinition.defaultBody3D`);
Cascadeur's help on rigs; bones of Auto-Rig Pro, Advanced Skeleton and Synty's characters; MikuMikuDance's standard and
half-standard bones, and their names in English in its models and in MMD Tools; the lists of bones of Rokoko's and Cats'
add-ons for Blender; OpenNI's XnSkeletonJoint.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from itertools import groupby, pairwise, product
from typing import NamedTuple

from motionmind.retarget.rig import spine_shares

ESSENTIAL_LIMB_JOINTS = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
_LIMBS = {"leg": ("hip", "knee", "ankle", "toes"), "arm": ("clavicle", "shoulder", "elbow", "wrist", "fingers")}
_DIVIDED = {"hip", "knee", "shoulder", "elbow"}  # other joints take place and rotation from the first of a row
# Joints of human23, without side, that a word may mean; "" for none, possible for any ambiguous word.
_WORDS = {
    word: (*joints.split(), *[""] * (" " in joints))
    for joints, words in {
        "hip": "thigh upleg upperleg legupper femur",
        "hip knee": "leg 足",
        "knee": "knee calf shin lowleg lowerleg leglower tibia ひざ 膝",
        "ankle": "ankle 足首",
        "ankle toes": "foot",
        "toes": "toe toes toebase ball つま先",
        "clavicle": "clavicle collar collarbone scapula 肩",
        "clavicle shoulder": "shoulder",
        "shoulder": "upperarm uparm armupper humerus arm 腕",
        "elbow": "elbow forearm lowerarm lowarm armlower radius ひじ 肘",
        "wrist": "wrist 手首",
        "wrist fingers": "hand",
        "fingers": "middle middleproximal middlefinger handmiddle handmid fmiddle mid 中指",
    }.items()
    for word in words.split()
} | {"hip": ("hip", "")}  # none: beside the pelvis, if a thigh hangs from it
_FOREARM_TWISTS = {"手捩": "ひじ", "handtwist": "elbow", "wristtwist": "elbow"}
_TRUNK_WORDS = {
    "pelvis": {"hips", "pelvis", "hip", "lowerbody", "下半身"},
    "head": {"head", "頭"},
    "neck": {"neck", "首"},
}
_TORSO_WORDS = {"torso", "trunk"}  # may carry legs and arms
_DIVIDERS = ("stretch", "twistoffset", "twist", "roll", "bend", "part", "捩")
_AFFIXES = ("", "def", "org", "joint", "jnt", "bone", "bn", "bind", "b", "j", "c")
_SIDE_WORDS = {"left": ("left", "l", "lf", "lt", "左"), "right": ("right", "r", "rt", "右")}


class _Named(NamedTuple):
    """A joint's name, parsed: its side, "" for none, and the word for the joint."""

    side: str
    word: str


def map_by_limbs(names: Sequence[str], parents: Sequence[int]) -> dict[int, str] | None:
    """Map joints with names of limbs to human23's: {joint's index: human23's joint}; None if they are unclear.

    Args:
        names: the joints' names.
        parents: index of each joint's parent, -1 for the root; parents come first.

    >>> names = "Root Torso Neck Head"
    >>> arms = [f"{joint}_{side}" for side in "LR" for joint in ("Arm", "Elbow", "Wrist")]
    >>> legs = [f"{joint}_{side}" for side in "LR" for joint in ("Leg", "Knee", "Ankle")]
    >>> found = map_by_limbs([*names.split(), *arms, *legs], [-1, 0, 1, 2, 1, 4, 5, 1, 7, 8, 0, 10, 11, 0, 13, 14])
    >>> [found[i] for i in (0, 1, 4, 10)]
    ['pelvis', 'thorax', 'left_shoulder', 'left_hip']
    """
    plain = [_plain(name) for name in names]
    for affix in _AFFIXES:
        found = _map_plain([_strip_affix(name, affix) for name in plain], parents)
        if found is not None:
            return found
    return None


def find_unclear(names: Sequence[str], parents: Sequence[int]) -> list[str]:
    """Name the body parts that `map_by_limbs` does not find, with the affix of names that leaves fewest."""
    parts = {f"{side} {name}": (side, limb) for side in _SIDE_WORDS for name, limb in _LIMBS.items()}
    plain, least = [_plain(name) for name in names], list(parts)
    for affix in _AFFIXES:
        named = [_parse(_strip_affix(name, affix)) for name in plain]
        unclear = [part for part, (side, limb) in parts.items() if not _find_limb(side, limb, named, parents)]
        least = min(least, unclear, key=len)
    return least or ["pelvis, spine or head"]


def _plain(name: str) -> str:
    """Return a name without namespace, case, punctuation and numbers."""
    bare = re.split(r"[:|]", unicodedata.normalize("NFKC", name))[-1]
    return re.sub(r"[\W\d_]", "", bare.lower())


def _strip_affix(plain: str, affix: str) -> str:
    """Return a plain name without an affix at either end; "" if the name lacks it."""
    if plain.startswith(affix):
        return plain.removeprefix(affix)
    return plain.removesuffix(affix) if plain.endswith(affix) else ""


def _map_plain(plain: Sequence[str], parents: Sequence[int]) -> dict[int, str] | None:
    """Map joints as `map_by_limbs`, by plain names."""
    named = [_parse(name) for name in plain]
    limbs = {
        (side, name): _find_limb(side, _LIMBS[name], named, parents) for side, name in product(_SIDE_WORDS, _LIMBS)
    }
    for name in _LIMBS:
        one, other = ([(named[i].word, joint) for i, joint in limbs[side, name].items()] for side in _SIDE_WORDS)
        if not one or one != other:
            return None
    left, right = ([next(iter(limbs[side, name])) for name in _LIMBS] for side in _SIDE_WORDS)
    pelvis, chest = (_lowest_common_ancestor(*pair, parents) for pair in zip(left, right, strict=True))
    if plain[pelvis] in _TORSO_WORDS and (chest == pelvis or named[chest].word in _TRUNK_WORDS["neck"]):
        trunk = _find_torso(pelvis, chest, limbs, named, parents)
    else:
        trunk = _find_trunk(pelvis, chest, named, parents)
    if not trunk:
        return None
    return trunk | {i: f"{side}_{joint}" for (side, _), joints in limbs.items() for i, joint in joints.items()}


def _find_torso(
    torso: int,
    chest: int,
    limbs: Mapping[tuple[str, str], Mapping[int, str]],
    named: Sequence[_Named],
    parents: Sequence[int],
) -> dict[int, str]:
    """Return the joints of a trunk without a spine, and the head: {joint's index: human23's joint}; empty if unclear.

    Args:
        torso: index of the joint that both legs hang from.
        chest: index of the joint that both arms hang from: the torso or the neck.
        limbs: {side and limb: {joint's index: human23's joint, without side}}.
        named: the joints' parsed names.
        parents: index of each joint's parent, -1 for the root.
    """
    head = next((i for i, one in enumerate(named) if not one.side and one.word in _TRUNK_WORDS["head"]), -1)
    path = _path_to_root(head, parents)
    if chest not in path:
        return {}
    neck = [i for i in path if named[i].word in _TRUNK_WORDS["neck"]]
    found = dict.fromkeys(neck, "cervical") | {head: "atlantal", torso: "pelvis"}
    above = path[path.index(torso) - 1]
    if chest != torso or not named[above].word:
        found[above] = "thorax"
    for side in _SIDE_WORDS:
        arm = limbs[side, "arm"]
        clavicle = parents[next(iter(arm))]
        if clavicle != chest and "clavicle" not in arm.values():
            found[clavicle] = f"{side}_clavicle"
    return found


def _find_trunk(pelvis: int, chest: int, named: Sequence[_Named], parents: Sequence[int]) -> dict[int, str]:
    """Return the joints of the trunk and the head: {joint's index: human23's joint}; empty if they are unclear.

    Args:
        pelvis: index of the joint that both legs hang from.
        chest: index of the joint that both arms hang from.
        named: the joints' parsed names.
        parents: index of each joint's parent, -1 for the root.
    """
    pelvis_path, chest_path = _path_to_root(pelvis, parents), _path_to_root(chest, parents)
    others = [
        i for i, one in enumerate(named) if not one.side and one.word in _TRUNK_WORDS["pelvis"] and i not in pelvis_path
    ]
    if named[pelvis].word not in _TRUNK_WORDS["pelvis"] and (others or pelvis not in chest_path):
        return {}
    is_neck = [one.word in _TRUNK_WORDS["neck"] for one in named]
    spine = [i for i in reversed(chest_path) if i not in pelvis_path and not is_neck[i]]
    heads = [i for i, one in enumerate(named) if one.word in _TRUNK_WORDS["head"]]
    head = next((i for i in heads if chest in _path_to_root(i, parents)), None)
    if head is None or not spine:
        return {}
    shares = spine_shares([str(i) for i in spine])
    neck = [i for i in _path_to_root(head, parents) if is_neck[i]]
    return {i: shares[str(i)] for i in spine} | dict.fromkeys(neck, "cervical") | {head: "atlantal", pelvis: "pelvis"}


def _parse(plain: str) -> _Named:
    """Return the side and the word of a plain name; "" for an unknown word."""
    for side, spellings in _SIDE_WORDS.items():
        for spelling in spellings:
            for rest in (plain.removeprefix(spelling), plain.removesuffix(spelling)):
                if rest != plain and (word := _limb_word(rest)):
                    return _Named(side, word)
    for middle in ("", "x", "m", "c"):  # "root.x" of Auto-Rig Pro, "Root_M" of Advanced Skeleton
        for rest in (plain.removeprefix(middle), plain.removesuffix(middle)):
            if any(rest in words for words in _TRUNK_WORDS.values()):
                return _Named("", rest)
    return _Named("", "")


def _limb_word(rest: str) -> str:
    """Return the word for a limb in the rest of a name, without a divider; "" for none."""
    rest = _FOREARM_TWISTS.get(rest, rest)
    for divider in ("", *_DIVIDERS):
        if rest.endswith(divider) and (word := rest.removesuffix(divider)) in _WORDS:
            return word
    return ""


def _find_limb(side: str, limb: Sequence[str], named: Sequence[_Named], parents: Sequence[int]) -> dict[int, str]:
    """Return the joints of a limb, downwards: {joint's index: human23's, without side}; empty if they are unclear."""
    own = {i for i, one in enumerate(named) if one.side == side and {*_WORDS[one.word]} & {*limb}}
    above: set[int] = set()
    for end in own:
        up = parents[end]
        while up >= 0 and up not in above:
            above.add(up)
            up = parents[up]
    chains = [[i for i in reversed(_path_to_root(end, parents)) if i in own] for end in sorted(own - above)]
    found = [assigned for assigned in (_assign(chain, limb, named) for chain in chains) if assigned]
    joined = {i: joint for one in found for i, joint in one.items()}
    for joint in limb:
        rows = {tuple(i for i in one if one[i] == joint) for one in found} - {()}
        if len(rows) > 1 and joint in ESSENTIAL_LIMB_JOINTS:
            return {}
        if len(rows) > 1:  # such as five toes
            joined = {i: other for i, other in joined.items() if other != joint}
    return joined


def _assign(chain: Sequence[int], limb: Sequence[str], named: Sequence[_Named]) -> dict[int, str]:
    """Assign a chain's joints to a limb's, downwards, by the rules in this module's docstring; empty if unclear."""
    words = [word for word, _ in groupby(named[i].word for i in chain)]
    if len(words) > 8 or len({*words}) < len(words):  # the number of choices is exponential in the number of words
        return {}
    choices = [choice for choice in product(*(_WORDS[word] for word in words)) if _is_in_order(choice, limb)]
    most = max((_count_named(choice) for choice in choices), default=0)
    choices = [choice for choice in choices if _count_named(choice) == most]
    if len(choices) != 1:
        return {}
    joint_of = dict(zip(words, choices[0], strict=True))
    assigned: dict[int, str] = {}
    for i in chain:
        joint = joint_of[named[i].word]
        if joint and (joint in _DIVIDED or joint not in assigned.values()):
            assigned[i] = joint
    return assigned


def _is_in_order(choice: Sequence[str], limb: Sequence[str]) -> bool:
    """Return whether joints, "" for none, come in a limb's order and include all essential ones."""
    at = [limb.index(joint) for joint in choice if joint in limb]
    in_order = all(a < b or limb[a] == limb[b] == "toes" for a, b in pairwise(at))
    return in_order and len(at) == _count_named(choice) and {*limb} & {*ESSENTIAL_LIMB_JOINTS} <= {*choice}


def _count_named(choice: Sequence[str]) -> int:
    return sum(map(bool, choice))


def _path_to_root(joint: int, parents: Sequence[int]) -> list[int]:
    """Return a joint and its ancestors, upwards."""
    path = []
    while joint >= 0:
        path.append(joint)
        joint = parents[joint]
    return path


def _lowest_common_ancestor(a: int, b: int, parents: Sequence[int]) -> int:
    """Return the lowest joint that `a` and `b` are or descend from; -1 for none."""
    above = _path_to_root(a, parents)
    return next((i for i in _path_to_root(b, parents) if i in above), -1)
