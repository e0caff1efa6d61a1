"""Mirror movement: exchange left and right on any body whose rest pose is symmetric.

A joint's axes are the world's when the body is at rest. Let M be the reflection along the lateral axis, and let each
joint's partner stand, at rest, where M puts the joint. Then the mirror image of a posture has the rotation M q M at
each joint, with q the partner's local rotation: M commutes with every step of forward kinematics.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from motionmind._typing import Floats, Indices
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import SkeletonError
from motionmind.geometry import rotations as rot

# Measured bodies are not quite symmetric: bones differ from left to right by up to 1.2 cm in one dancer's recordings,
# by 2.5 cm in other people's.
LEFT, RIGHT, MIDDLE = "left", "right", "middle"
TOLERANCE = 0.05  # of the distance from the root to the farthest joint
_X, _Y, _Z = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Sides:
    """The joints and the axis that a mirror exchanges on a body.

    Attributes:
        partners: index of each joint's mirror image [J]; a joint in the middle is its own.
        axis: the axis from right to left when the body is at rest: 0 for x, 1 for y, 2 for z.
    """

    partners: Indices
    axis: int

    @property
    def world(self) -> int:
        """The world's axis along which the body is reflected: the lateral one, except that it is never the vertical."""
        return _X if self.axis == _Y else self.axis


def mirrored(motion: Motion) -> Motion:
    """Return the movement with left and right exchanged; applied twice, the movement itself.

    The body is mirrored too, so each joint is exactly where its partner appears in the mirror, even if the two sides
    differ a little. The mirror stands at the world's origin.

    Args:
        motion: movement on any body that `find_sides` accepts.

    Raises:
        SkeletonError: the body is not symmetric; the message names a joint without a partner.
    """
    sides = find_sides(motion.skeleton)
    rotations = rot.mirror(motion.rotations[:, sides.partners], sides.axis)
    if sides.axis != sides.world:
        # The root turns between a frame that is reflected along one axis and a world that is along another:
        # W q M = (W q W) (W M), and two reflections in a row are half a turn about the third axis.
        turn = np.zeros(4)
        turn[3 - sides.axis - sides.world] = 1.0
        rotations[:, 0] = rot.mul(rot.mirror(motion.rotations[:, 0], sides.world), turn)
    joints = motion.skeleton.names
    names = {name: joints[partner] for name, partner in zip(joints, sides.partners, strict=True)}
    return replace(
        motion,
        skeleton=_mirrored_body(motion.skeleton, sides),
        rotations=rotations,
        root=motion.root * _reflection(sides.world),
        insertions=tuple(one.renamed(names) for one in motion.insertions),
    )


def find_sides(skeleton: Skeleton) -> Sides:
    """Pair the joints of a body by their names along the tree, and check the pairs by their places at rest.

    Names may mark sides by words or letters, before, after or within: left_hip, LeftHip, lhip, LHipJoint, thigh.L,
    hand_l, "Bip01 L Thigh". Of the axes that fit all pairs the lateral axis is the one along which they lie furthest
    apart; a body without pairs is accepted if it has no breadth in x.

    Args:
        skeleton: the body.

    Raises:
        SkeletonError: a joint has no partner, or two partners are no mirror images of each other.
    """
    partners = _pair(skeleton)
    paired = partners != np.arange(len(skeleton))
    offsets = skeleton.offsets
    at_rest = skeleton.rest[: len(skeleton)]
    reach = float(np.linalg.norm(at_rest, axis=-1).max())
    # Distance of each joint from its partner's image, for each axis [3, J].
    off = np.stack([np.linalg.norm(offsets * _reflection(axis) - offsets[partners], axis=-1) for axis in range(3)])
    possible = [axis for axis in ((_X, _Z, _Y) if paired.any() else (_X,)) if off[axis].max() <= TOLERANCE * reach]
    if not possible:
        raise SkeletonError(_asymmetry(skeleton, partners, off if paired.any() else off[:1]))
    apart = np.abs(offsets - offsets[partners]).sum(axis=0)
    return Sides(partners, max(possible, key=lambda axis: apart[axis]))


def _reflection(axis: int) -> Floats:
    """Return the factors [3] by which a reflection along `axis` multiplies coordinates."""
    sign = np.ones(3)
    sign[axis] = -1.0
    return sign


def _mirrored_body(skeleton: Skeleton, sides: Sides) -> Skeleton:
    sign = _reflection(sides.axis)
    return replace(skeleton, offsets=skeleton.offsets[sides.partners] * sign, tips=skeleton.tips[sides.partners] * sign)


# --- by their names ---------------------------------------------------------------------------------------------------


def _pair(skeleton: Skeleton) -> Indices:
    """Return each joint's partner [J]: the child of its parent's partner whose name is that of the other side."""
    names = skeleton.names
    partners = np.zeros(len(skeleton), dtype=np.intp)
    for joint, name in enumerate(names):
        if joint == 0:
            continue
        parent = skeleton.parents[joint]
        across = int(partners[parent])
        others = other_side(name)
        found = [child for child in skeleton.children(across) if names[child] in others]
        if len(found) > 1:
            raise _without_partner(skeleton, name, f"both {names[found[0]]} and {names[found[1]]} could be it")
        if found:
            partners[joint] = found[0]
        elif across == parent and not _side_in(name):
            partners[joint] = joint
        else:
            elsewhere = [other for other in names if other in others]
            where = f"{elsewhere[0]} does not hang from" if elsewhere else "nothing of that name hangs from"
            raise _without_partner(skeleton, name, f"on the other side {where} {names[across]}")
    once = np.flatnonzero(partners[partners] != np.arange(len(skeleton)))
    if len(once):
        name, other = names[once[0]], names[partners[once[0]]]
        raise _without_partner(skeleton, name, f"{other} is the partner of {names[partners[partners[once[0]]]]}")
    return partners


def other_side(name: str) -> set[str]:
    """Return the names that a joint of this name might have on the other side.

    A joint is sided only if the body has a joint of one of these names.
    """
    out = set()
    for sign in _SIGNS:
        found = list(sign.finditer(name))
        if found:
            out.add(sign.sub(_exchanged, name))
            out |= {name[: at.start()] + _exchanged(at) + name[at.end() :] for at in found}
    return out - {name}


def sides_of(skeleton: Skeleton) -> list[str]:
    """Return LEFT, RIGHT or MIDDLE for each joint [J].

    A joint is sided if another joint has the name of its other side, or if "left" or "right" is a word of its name;
    else it is on its parent's side. Names are read as `find_sides` reads them: lfemur and thigh.L as well as left_hip.
    """
    names, found = set(skeleton.names), list[str]()
    for name, parent in zip(skeleton.names, skeleton.parents, strict=True):
        others = other_side(name) & names
        if others:  # "l" and "left" stand before "r" and "right"
            found.append(LEFT if name.lower() < min(others).lower() else RIGHT)
        else:
            found.append(_side_in(name) or (found[parent] if parent >= 0 else MIDDLE))
    return found


_SIGNS = (
    re.compile(r"left|right", re.IGNORECASE),
    re.compile(r"(?<![A-Za-z])[lr](?![A-Za-z])", re.IGNORECASE),  # thigh.L, l_hip
    re.compile(r"(?<![A-Za-z])[lr](?=[A-Za-z])", re.IGNORECASE),  # lfemur, LHipJoint
    re.compile(r"(?<=[A-Za-z])[lr](?![A-Za-z])", re.IGNORECASE),  # HipL
)
_OPPOSITE = {"left": "right", "right": "left", "l": "r", "r": "l"}


def _exchanged(found: re.Match[str]) -> str:
    """Return the word for the other side, in the same case."""
    word = found[0]
    other = _OPPOSITE[word.lower()]
    return other.upper() if word.isupper() else other.title() if word[0].isupper() else other


def _side_in(name: str) -> str:
    """Return LEFT or RIGHT if that is a word of the name by itself, which rules out the middle; else ""."""
    words = (word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name))
    return next((LEFT if word in ("left", "l") else RIGHT for word in words if word in _OPPOSITE), "")


# --- by where they stand ----------------------------------------------------------------------------------------------


def _asymmetry(skeleton: Skeleton, partners: Indices, off: Floats) -> str:
    """Describe the joint that is furthest from its partner's mirror image, along the axis that fits best."""
    axis = int(off.max(axis=1).argmin())
    joint = int(off[axis].argmax())
    name, other = skeleton.names[joint], skeleton.names[partners[joint]]
    if partners[joint] == joint:
        aside = abs(float(skeleton.offsets[joint, axis]))
        why = f"it stands {aside:.3g} m off the middle, and by its name no joint is the other side's"
        return str(_without_partner(skeleton, name, why))
    a, b = (", ".join(f"{x:.3g}" for x in skeleton.offsets[end]) for end in (joint, partners[joint]))
    return (
        f"{skeleton.name} cannot be mirrored: {name} and {other} are no mirror images of each other at rest: they "
        f"stand at ({a}) and ({b}) metres from the joints that they hang from"
    )


def _without_partner(skeleton: Skeleton, name: str, why: str) -> SkeletonError:
    return SkeletonError(f"{skeleton.name} cannot be mirrored: {name} has no partner: {why}")
