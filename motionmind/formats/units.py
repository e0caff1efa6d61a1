"""Units of length: names for them, and the one a file that names none was most likely written in."""

from __future__ import annotations

import math

import numpy as np

from motionmind._typing import Floats, Indices
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError

# Metres in one unit. The "cmu" unit is that of the CMU Motion Capture Database, whose ASF files say `length 0.45`:
# a length divided by 0.45 is in inches (mocap.cs.cmu.edu/faqs.php gives this conversion, "(1.0/0.45)*2.54/100.0");
# its conversions to BVH keep the numbers.
UNITS: dict[str, float] = {
    "cm": 0.01,
    "m": 1.0,
    "mm": 0.001,
    "in": 0.0254,
    "ft": 0.3048,
    "dm": 0.1,
    "cmu": 0.0254 / 0.45,
}

PERSON_HEIGHT = 1.70

# Height of a body as a share of its longest way from one end to another along the bones, most often fingertip to
# toe: 1.70 m to 2.49 m in human23; 0.62 to 0.71 in recordings whose rest pose stands. That is nearer to each other
# than any two units are.
HEIGHT_PER_SPAN = 0.68


def metres_per_unit(unit: str | float) -> float:
    """Metres in one `unit`: a name in `UNITS`, or the number itself, as a float or as text."""
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


def guess_unit(skeleton: Skeleton) -> tuple[str, float]:
    """The unit in which a person with this skeleton is nearest to 1.70 m tall: its name, and its metres.

    `skeleton` holds the file's own numbers, unscaled (`read_bvh(path, unit=1.0).skeleton`). A rest pose need not
    stand, and many do not, so the height is told from the bones alone: 0.68 times `bone_span`. "Nearest" is by
    ratio. A skeleton without length gives centimetres, the commonest.

    The units are further from each other than people are: the closest, decimetres and CMU's, differ by 1.77, so
    that a body between 1.28 m and 2.26 m tall is told right. What is no person is told wrong: give its unit.
    """
    height = HEIGHT_PER_SPAN * bone_span(np.array(skeleton.parents), skeleton.offsets, skeleton.tips)
    if height <= 0.0:
        return "cm", UNITS["cm"]
    name = min(UNITS, key=lambda unit: abs(math.log(height * UNITS[unit] / PERSON_HEIGHT)))
    return name, UNITS[name]


def bone_span(parents: Indices, offsets: Floats, tips: Floats) -> float:
    """Length of the longest way from one end of a body to another along its bones, in the unit of `offsets`.

    This is the diameter of the tree. It depends neither on the pose, nor on which joint is the root.

    Args:
        parents: index of each joint's parent [J], -1 for the root, each before its children.
        offsets: place of each joint in its parent's frame [J, 3].
        tips: place of each leaf's far end in the leaf's frame [J, 3].
    """
    bones = np.linalg.norm(offsets, axis=-1)
    reach = np.linalg.norm(tips, axis=-1)  # the longest way down from each joint, as far as it is known
    longest = float(np.max(reach))
    for joint in range(len(parents) - 1, 0, -1):
        parent = int(parents[joint])
        arm = reach[joint] + bones[joint]
        longest = max(longest, float(reach[parent] + arm))  # through the parent, from another child of its
        reach[parent] = max(reach[parent], arm)
    return longest
