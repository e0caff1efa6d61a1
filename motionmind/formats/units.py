"""Units of length: their names, and a guess for files that do not state the unit."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.anatomy import SIDES
from motionmind.body.human import human23
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError

# Metres in one unit. "cmu" is the unit of the CMU Motion Capture Database, whose ASF files state `length 0.45`: a
# length divided by 0.45 is in inches (mocap.cs.cmu.edu/faqs.php gives the conversion "(1.0/0.45)*2.54/100.0").
# Conversions of them to BVH keep the numbers.
UNITS: dict[str, float] = {
    "cm": 0.01,
    "m": 1.0,
    "mm": 0.001,
    "in": 0.0254,
    "ft": 0.3048,
    "dm": 0.1,
    "cmu": 0.0254 / 0.45,
}

_PERSON_HEIGHT_M = 1.70

# Height as a share of the longest path along the bones, mostly fingertip to toe: 1.70 m to 2.49 m in human23; 0.62 to
# 0.71 in recordings whose rest pose stands. The spread is smaller than the ratio of any two units.
HEIGHT_PER_SPAN_RATIO = 0.68


def metres_per_unit(unit: str | float) -> float:
    """Return the metres in one `unit`: a name in `UNITS`, or the number itself, as a float or as text.

    Raises:
        MotionMindError: the name is unknown, or the number is not between 1e-9 and 1e9.
    """
    scale = UNITS.get(unit.strip().lower(), unit) if isinstance(unit, str) else unit
    try:
        scale = float(scale)
    except ValueError:
        scale = math.nan
    if not 1e-9 <= scale <= 1e9:
        raise MotionMindError(
            f"unit {unit!r} is unknown; give one of {', '.join(UNITS)}, or the metres in one unit as a number"
        )
    return scale


_HAND_SPAN_M = 0.31  # longest path along a hand's bones: human44's, from thumb to fingertip
_FINGER_WORDS = ("thumb", "index", "middle", "ring", "pinky", "pinkie", "little", "finger")
_MAX_PALM_JOINTS = 8  # joints of hands that belong to no finger: forearm, wrist and palm of both


def is_hand(skeleton: Skeleton) -> bool:
    """Return whether most joints of a skeleton are named for fingers: a hand alone, or two, without a body."""
    fingers = int(_fingers(skeleton).sum())
    return len(skeleton) - fingers <= min(fingers, _MAX_PALM_JOINTS)


def _fingers(skeleton: Skeleton) -> Bools:
    """Return whether each joint is named for a finger [J]."""
    return np.array([any(word in name.lower() for word in _FINGER_WORDS) for name in skeleton.names])


def guess_unit(skeleton: Skeleton) -> tuple[str, float]:
    """Guess the unit of length that brings this body's height nearest, by ratio, to 1.70 m; a hand's span to 0.31 m.

    Many rest poses do not stand, so the height is estimated from the bones alone: 0.68 times `bone_span`. A skeleton
    without length gives centimetres, the commonest unit. The closest two units, decimetres and CMU's, differ by a
    factor of 1.77, so the guess is right for people between 1.28 m and 2.26 m tall. For other bodies give the unit.

    Args:
        skeleton: the file's numbers, unscaled (`read_bvh(path, unit=1.0).skeleton`).

    Returns:
        The unit's name, and its length in metres.
    """
    offsets, usual = skeleton.offsets, _PERSON_HEIGHT_M / HEIGHT_PER_SPAN_RATIO
    if is_hand(skeleton):
        offsets, usual = np.where(_fingers(skeleton)[:, None], offsets, 0.0), _HAND_SPAN_M  # without the forearm
    span = bone_span(np.array(skeleton.parents), offsets, skeleton.tips)
    if span <= 0.0:
        return "cm", UNITS["cm"]
    name = min(UNITS, key=lambda unit: abs(math.log(span * UNITS[unit] / usual)))
    return name, UNITS[name]


def person_height(skeleton: Skeleton, mapping: Mapping[str, str]) -> float:
    """Estimate a person's height from the legs' length, which no prop in a hand and no zero pose changes.

    Args:
        skeleton: the file's.
        mapping: {file's joint: human23's joint}, as `joint_mapping` returns it.

    Returns:
        The height of a person with human23's proportions and legs of this length, metres.
    """

    def legs(body: Skeleton, target: Mapping[str, str]) -> float:
        first: dict[str, int] = {}
        for index, name in enumerate(body.names):
            first.setdefault(target.get(name, ""), index)
        length = 0.0
        for side in SIDES:
            joint, hip = first[f"{side}_ankle"], first[f"{side}_hip"]
            while joint > hip:
                length += float(np.linalg.norm(body.offsets[joint]))
                joint = body.parents[joint]
        return length

    body = human23()
    return _PERSON_HEIGHT_M * legs(skeleton, mapping) / legs(body, {name: name for name in body.names})


def bone_span(parents: Indices, offsets: Floats, tips: Floats) -> float:
    """Return the length of the longest path along a body's bones, in the unit of `offsets`.

    This is the diameter of the tree; it is independent of the pose and of the choice of root.

    Args:
        parents: index of each joint's parent [J], -1 for the root; parents come before their children.
        offsets: place of each joint in its parent's frame [J, 3].
        tips: place of each leaf's far end in the leaf's frame [J, 3].
    """
    bones = np.linalg.norm(offsets, axis=-1)
    reach = np.linalg.norm(tips, axis=-1)  # the longest path down from each joint found so far
    longest = float(np.max(reach))
    for joint in range(len(parents) - 1, 0, -1):
        parent = int(parents[joint])
        arm = reach[joint] + bones[joint]
        longest = max(longest, float(reach[parent] + arm))  # through the parent, from another child
        reach[parent] = max(reach[parent], arm)
    return longest
