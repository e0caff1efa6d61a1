"""Mirror movement: exchange left and right on any body whose rest pose is symmetric.

At rest, every joint's axes are the world's. Let M be the reflection along the lateral axis, and let M map each joint's
rest position to its partner's. Then the mirror image of a posture has the rotation M q M at each joint, with q the
partner's local rotation: M commutes with every step of forward kinematics.
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

LEFT, RIGHT, MIDDLE = "left", "right", "middle"
# Of the distance from the root to the farthest joint. Measured bodies are not quite symmetric: left and right bones
# differ by up to 1.2 cm in one dancer's recordings, by 2.5 cm in other people's.
MIRROR_TOLERANCE_RATIO = 0.05
_X, _Y, _Z = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Sides:
    """The joints and the axis that a mirror exchanges on a body.

    Attributes:
        partners: index of each joint's partner [J]; a joint in the middle is its own partner.
        axis: the lateral axis at rest: 0 for x, 1 for y, 2 for z.
    """

    partners: Indices
    axis: int

    @property
    def world(self) -> int:
        """The world's axis along which to reflect the body: the lateral axis, or x if that axis is vertical."""
        return _X if self.axis == _Y else self.axis


def mirrored(motion: Motion) -> Motion:
    """Return the movement with left and right exchanged; applying this twice returns the original movement.

    The body is mirrored too, so each joint is exactly at the mirror image of its partner, even if the two sides differ
    a little. The mirror plane contains the world's origin.

    Args:
        motion: movement on any body that `find_sides` accepts.

    Raises:
        SkeletonError: the body is not symmetric; the message names a joint without a partner.
    """
    sides = find_sides(motion.skeleton)
    rotations = rot.mirror(motion.rotations[:, sides.partners], sides.axis)
    if sides.axis != sides.world:
        # The root's rotation maps a frame reflected along one axis (M) to a world reflected along another (W):
        # W q M = (W q W) (W M), and the two reflections W M are a half turn about the third axis.
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
    """Pair the joints of a body by their names along the tree, and check the pairs by their positions at rest.

    Names may mark sides by words or letters at any place: left_hip, LeftHip, lhip, LHipJoint, thigh.L, hand_l,
    "Bip01 L Thigh". The lateral axis is the axis that fits all pairs and along which they are farthest apart. A body
    without pairs is accepted if it has no extent in x.

    Args:
        skeleton: the body.

    Raises:
        SkeletonError: a joint has no partner, or two partners are not mirror images of each other.
    """
    partners = _pair(skeleton)
    paired = partners != np.arange(len(skeleton))
    offsets = skeleton.offsets
    at_rest = skeleton.rest[: len(skeleton)]
    reach = float(np.linalg.norm(at_rest, axis=-1).max())
    # Distance of each joint from its partner's image, for each axis [3, J].
    off = np.stack([np.linalg.norm(offsets * _reflection(axis) - offsets[partners], axis=-1) for axis in range(3)])
    possible = [
        axis for axis in ((_X, _Z, _Y) if paired.any() else (_X,)) if off[axis].max() <= MIRROR_TOLERANCE_RATIO * reach
    ]
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


# --- pairing by name --------------------------------------------------------------------------------------------------


def _pair(skeleton: Skeleton) -> Indices:
    """Return each joint's partner [J]: the child of its parent's partner with the name of the other side."""
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

    A joint is sided if another joint has its name for the other side, or if "left" or "right" is a word of its name;
    otherwise it is on its parent's side. Names are read as by `find_sides`: lfemur and thigh.L as well as left_hip.
    """
    names, found = set(skeleton.names), list[str]()
    for name, parent in zip(skeleton.names, skeleton.parents, strict=True):
        others = other_side(name) & names
        if others:  # "l" and "left" sort before "r" and "right"
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
    """Return LEFT or RIGHT if a word of the name says so, which rules out the middle; else ""."""
    words = (word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name))
    return next((LEFT if word in ("left", "l") else RIGHT for word in words if word in _OPPOSITE), "")


# --- checking by position ---------------------------------------------------------------------------------------------


def _asymmetry(skeleton: Skeleton, partners: Indices, off: Floats) -> str:
    """Describe the joint that is farthest from its partner's mirror image, along the axis that fits best."""
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
