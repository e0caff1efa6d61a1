"""Recognises a person's joints by names of limbs, and by where these hang: for rigs that no table lists.

A name says which side a joint is on, and what limb it moves: "thigh.L", "HipLeft", "l_up_leg", "左足". Few words
mean one joint in all rigs: a shoulder may be the collarbone or the arm, a leg the thigh or the shank, a foot the ankle
or the toes. Where a joint hangs in its limb tells. On the way from the pelvis to the toes, or from the chest to the
fingers,

- joints come in the body's order, and each has a name of its own, but for those that divide a limb ("thigh.L",
  "thigh.L.001"), of which the first is its place and the last its turn;
- as many names are used as can be, in one way alone, and the same on both sides.

Pelvis and spine need no names. Legs hang from the pelvis, and the spine is what lies between it and the joint that
carries the arms. What is not clear is no rig: a wrong guess is worse than none.

Sources of the words: the rigs of `motionmind.retarget.rigs`; Sony's receiver plugins for mocopi; Microsoft's documents
of Kinect for Windows 2 and of Azure Kinect's body tracking; Apple's ARKit (`ARSkeletonDefinition.defaultBody3D`);
Cascadeur's help on rigs; what Auto-Rig Pro, Advanced Skeleton and Synty's characters call their bones; MikuMikuDance's
standard and half-standard bones, and their names in English in its models and in MMD Tools; the lists of bones of
Rokoko's and Cats' add-ons for Blender.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from itertools import groupby, pairwise, product
from typing import NamedTuple

from motionmind.retarget.rig import spine_shares

_LEG, _ARM = ("hip", "knee", "ankle", "toes"), ("clavicle", "shoulder", "elbow", "wrist", "fingers")
_ESSENTIAL = {"hip", "knee", "ankle", "shoulder", "elbow", "wrist"}
_DIVIDED = {"hip", "knee", "shoulder", "elbow"}  # the others take their place and their turn from the first
# Joints of human23 that a word may stand for, sideless. Where it may stand for several, it may for none of them.
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
} | {"hip": ("hip", "")}  # none: beside the pelvis, where a thigh hangs from it
_SAME = {"手捩": "ひじ", "handtwist": "elbow", "wristtwist": "elbow"}  # twist the forearm
_PELVIS = {"hips", "pelvis", "hip", "lowerbody", "下半身"}
_HEAD, _NECK = {"head", "頭"}, {"neck", "首"}
_DIVIDERS = ("stretch", "twistoffset", "twist", "roll", "bend", "part", "捩")
_MIDDLES = ("", "x", "m", "c")  # "root.x" of Auto-Rig Pro, "Root_M" of Advanced Skeleton
_AFFIXES = ("", "def", "org", "joint", "jnt", "bone", "bn", "bind", "b", "j", "c")
_MOST = 8  # words of a limb that are looked at
_SIDES = {"left": ("left", "l", "lf", "lt", "左"), "right": ("right", "r", "rt", "右")}
_PARTS = {f"{side} {name}": (side, limb) for side in _SIDES for name, limb in (("leg", _LEG), ("arm", _ARM))}


class _Named(NamedTuple):
    """A joint by its name: the side that it is on, "" for none, and the word for it."""

    side: str
    word: str


def map_by_limbs(names: Sequence[str], parents: Sequence[int]) -> dict[int, str] | None:
    """Map joints with names of limbs to human23's: {joint's index: human23's joint}; None where they are not clear.

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
        found = _map_plain([_without(name, affix) for name in plain], parents)
        if found is not None:
            return found
    return None


def find_unclear(names: Sequence[str], parents: Sequence[int]) -> list[str]:
    """Name what `map_by_limbs` does not find of a person's parts, as few as an affix of names leaves; all if none."""
    plain, least = [_plain(name) for name in names], list(_PARTS)
    for affix in _AFFIXES:
        named = [_read(_without(name, affix)) for name in plain]
        unclear = [part for part, (side, limb) in _PARTS.items() if not _find_limb(side, limb, named, parents)]
        least = min(least, unclear, key=len)
    return least or ["pelvis, spine or head"]


def _plain(name: str) -> str:
    """Return a name without namespace, case, punctuation and numbers."""
    bare = re.split(r"[:|]", unicodedata.normalize("NFKC", name))[-1]
    return re.sub(r"[\W\d_]", "", bare.lower())


def _without(plain: str, affix: str) -> str:
    """Return a plain name without an affix, which others may have; "" if it lacks it."""
    if plain.startswith(affix):
        return plain.removeprefix(affix)
    return plain.removesuffix(affix) if plain.endswith(affix) else ""


def _map_plain(plain: Sequence[str], parents: Sequence[int]) -> dict[int, str] | None:
    """Map joints as `map_by_limbs`, by plain names."""
    named = [_read(name) for name in plain]
    limbs = {(side, limb): _find_limb(side, limb, named, parents) for side, limb in product(_SIDES, (_LEG, _ARM))}
    for limb in (_LEG, _ARM):
        one, other = ([(named[i].word, joint) for i, joint in limbs[side, limb].items()] for side in _SIDES)
        if not one or one != other:
            return None
    left, right = ([next(iter(limbs[side, limb])) for limb in (_LEG, _ARM)] for side in _SIDES)
    pelvis, chest = (_common(*pair, parents) for pair in zip(left, right, strict=True))
    trunk = _find_trunk(pelvis, chest, named, parents)
    if not trunk:
        return None
    return trunk | {i: f"{side}_{joint}" for (side, _), joints in limbs.items() for i, joint in joints.items()}


def _find_trunk(pelvis: int, chest: int, named: Sequence[_Named], parents: Sequence[int]) -> dict[int, str]:
    """Return the joints of the trunk and the head: {joint's index: human23's joint}; empty if they are not clear.

    Args:
        pelvis: index of the joint that both legs hang from.
        chest: index of the joint that both arms hang from.
        named: the joints by their names.
        parents: their parents.
    """
    below, up = _way(pelvis, parents), _way(chest, parents)
    others = [i for i, one in enumerate(named) if not one.side and one.word in _PELVIS and i not in below]
    if named[pelvis].word not in _PELVIS and (others or pelvis not in up):
        return {}
    spine = [i for i in reversed(up) if i not in below and named[i].word not in _NECK]
    head = next((i for i, one in enumerate(named) if one.word in _HEAD and chest in _way(i, parents)), None)
    if head is None or not spine:
        return {}
    shares = spine_shares([str(i) for i in spine])
    neck = [i for i in _way(head, parents) if named[i].word in _NECK]
    return {i: shares[str(i)] for i in spine} | dict.fromkeys(neck, "cervical") | {head: "atlantal", pelvis: "pelvis"}


def _read(plain: str) -> _Named:
    """Return the side and the word of a plain name; no word if it has none that is known."""
    for side, spellings in _SIDES.items():
        for spelling in spellings:
            for rest in (plain.removeprefix(spelling), plain.removesuffix(spelling)):
                if rest != plain and (word := _word(rest)):
                    return _Named(side, word)
    for middle in _MIDDLES:
        for rest in (plain.removeprefix(middle), plain.removesuffix(middle)):
            if rest in _PELVIS | _HEAD | _NECK:
                return _Named("", rest)
    return _Named("", "")


def _word(rest: str) -> str:
    """Return the word for a limb that is left of a name, without what divides it; "" for none."""
    rest = _SAME.get(rest, rest)
    for divider in ("", *_DIVIDERS):
        if rest.endswith(divider) and (word := rest.removesuffix(divider)) in _WORDS:
            return word
    return ""


def _find_limb(side: str, limb: Sequence[str], named: Sequence[_Named], parents: Sequence[int]) -> dict[int, str]:
    """Return the joints of a limb, downwards: {joint's index: human23's, sideless}; empty if they are not clear."""
    own = {i for i, one in enumerate(named) if one.side == side and {*_WORDS[one.word]} & {*limb}}
    above: set[int] = set()
    for end in own:
        up = parents[end]
        while up >= 0 and up not in above:
            above.add(up)
            up = parents[up]
    chains = [[i for i in reversed(_way(end, parents)) if i in own] for end in sorted(own - above)]
    found = [placed for placed in (_place(chain, limb, named) for chain in chains) if placed]
    joined = {i: joint for one in found for i, joint in one.items()}
    for joint in limb:
        rows = {tuple(i for i in one if one[i] == joint) for one in found} - {()}
        if len(rows) > 1 and joint in _ESSENTIAL:
            return {}
        if len(rows) > 1:  # such as five toes
            joined = {i: other for i, other in joined.items() if other != joint}
    return joined


def _place(chain: Sequence[int], limb: Sequence[str], named: Sequence[_Named]) -> dict[int, str]:
    """Place the joints of a chain in a limb, downwards, as this module's docstring says; empty if that is not clear."""
    words = [word for word, _ in groupby(named[i].word for i in chain)]
    if len(words) > _MOST or len({*words}) < len(words):
        return {}
    ways = [way for way in product(*(_WORDS[word] for word in words)) if _is_in_order(way, limb)]
    most = max((_count(way) for way in ways), default=0)
    ways = [way for way in ways if _count(way) == most]
    if len(ways) != 1:
        return {}
    of = dict(zip(words, ways[0], strict=True))
    placed: dict[int, str] = {}
    for i in chain:
        joint = of[named[i].word]
        if joint and (joint in _DIVIDED or joint not in placed.values()):
            placed[i] = joint
    return placed


def _is_in_order(way: Sequence[str], limb: Sequence[str]) -> bool:
    """Return whether joints come in a limb's order, "" for none, with all that are essential."""
    at = [limb.index(joint) for joint in way if joint in limb]
    in_order = all(a < b or limb[a] == limb[b] == "toes" for a, b in pairwise(at))
    return in_order and len(at) == _count(way) and {*limb} & _ESSENTIAL <= {*way}


def _count(way: Sequence[str]) -> int:
    return sum(map(bool, way))


def _way(joint: int, parents: Sequence[int]) -> list[int]:
    """Return a joint and all that it hangs from, upwards."""
    way = []
    while joint >= 0:
        way.append(joint)
        joint = parents[joint]
    return way


def _common(a: int, b: int, parents: Sequence[int]) -> int:
    """Return the lowest joint that two others hang from; -1 for none."""
    above = _way(a, parents)
    return next((i for i in _way(b, parents) if i in above), -1)
