"""The human skeletons that files refer to by name: human23 and human44."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np

from motionmind.body.skeleton import Skeleton

# A body is a list of rows: a joint, its parent, its place in the parent's frame in metres. Limbs are written for the
# left side; a name that ends in "_tip" is a leaf's far end. At rest: a T-pose facing +Z, palms down, every joint's axes
# the world's.
_Row = tuple[str, str, tuple[float, float, float]]


# Metres, of people and of what is animated as people: a body beyond them has another unit.
SHORTEST_PERSON_M, TALLEST_PERSON_M = 0.5, 2.6

# human23: the tree of [I98] figure 4 with hands and toes. Segment lengths for a height of 1.70 m after Drillis and
# Contini, "Body segment parameters" (1966), as given in Winter, "Biomechanics and Motor Control of Human Movement"
# (2009), fig. 4.1: thigh .245 H, shank .246 H, ankle height .039 H, upper arm .186 H, forearm .146 H, hand .108 H, hips
# .191 H apart outside to outside (half of it between the joints), shoulders .259 H apart.
_LEG: tuple[_Row, ...] = (
    ("hip", "pelvis", (0.085, -0.070, 0.0)),
    ("knee", "hip", (0.0, -0.417, 0.0)),
    ("ankle", "knee", (0.0, -0.418, 0.0)),
    ("toes", "ankle", (0.0, -0.066, 0.130)),
    ("toes_tip", "toes", (0.0, 0.0, 0.065)),
)


_TRUNK: tuple[_Row, ...] = (
    ("lumbar", "pelvis", (0.0, 0.085, 0.0)),
    ("thorax", "lumbar", (0.0, 0.145, 0.0)),
    ("cervical", "thorax", (0.0, 0.260, 0.0)),
    ("atlantal", "cervical", (0.0, 0.100, 0.015)),
    ("atlantal_tip", "atlantal", (0.0, 0.180, 0.0)),
)


_ARM: tuple[_Row, ...] = (
    ("clavicle", "thorax", (0.030, 0.205, 0.0)),
    ("shoulder", "clavicle", (0.150, 0.0, 0.0)),
    ("elbow", "shoulder", (0.316, 0.0, 0.0)),
    ("wrist", "elbow", (0.248, 0.0, 0.0)),
    ("fingers", "wrist", (0.090, 0.0, 0.0)),
    ("fingers_tip", "fingers", (0.094, 0.0, 0.0)),
)


# human44 adds thumbs to human23, and divides some of its bones. Hands after Buryanov and Kotiuk, "Proportions of hand
# segments", Int. J. Morphol. 28(3) (2010): the phalanges of the four fingers are on average 40, 23 and 21 mm long (with
# the pulp), the thumb's three bones 46, 32 and 27 mm to a middle finger of 92. The thumb lies in the hand's plane, 30
# degrees off its length. Vertebrae are taken as equally high within lumbar spine, chest and neck. The toes are a guess.
_THUMB: tuple[_Row, ...] = (
    ("thumb", "wrist", (0.022, -0.008, 0.022)),
    ("thumb_middle", "thumb", (0.041, 0.0, 0.023)),
    ("thumb_end", "thumb_middle", (0.028, 0.0, 0.016)),
    ("thumb_end_tip", "thumb_end", (0.024, 0.0, 0.014)),
)


_VERTEBRAE: tuple[_Row, ...] = (
    ("lumbar_middle", "lumbar", (0.0, 0.058, 0.0)),
    ("lumbar_upper", "lumbar_middle", (0.0, 0.058, 0.0)),
    ("thorax_middle", "thorax", (0.0, 0.087, 0.0)),
    ("thorax_upper", "thorax_middle", (0.0, 0.087, 0.0)),
    ("cervical_middle", "cervical", (0.0, 0.029, 0.004)),
    ("cervical_upper", "cervical_middle", (0.0, 0.029, 0.004)),
    ("axial", "cervical_upper", (0.0, 0.028, 0.004)),
)


_KNUCKLES: tuple[_Row, ...] = (
    ("toes_middle", "toes", (0.0, 0.0, 0.030)),
    ("toes_end", "toes_middle", (0.0, 0.0, 0.018)),
    ("fingers_middle", "fingers", (0.045, 0.0, 0.0)),
    ("fingers_end", "fingers_middle", (0.026, 0.0, 0.0)),
)


@cache
def human23() -> Skeleton:
    """Return the default body: 23 joints, 1.70 m, at rest in a T-pose facing +Z with all joint axes the world's.

    >>> from motionmind import human23
    >>> len(human23()), human23().names[0]
    (23, 'pelvis')
    """
    return _skeleton("human23", _human(_ARM))


@cache
def human44() -> Skeleton:
    """Return a body whose hands close, toes curl and spine rolls: 44 joints, as tall as human23, in the same rest pose.

    The number 44 is from Bradley and Stuart's technical report CU-CS-844-97 (1997). Its list of joints was not at hand,
    so the choice is ours: the joints of human23, with hands, feet and spine divided as far as the count allows.

    - Hands, 3 + 3 a side for 1: the thumb's three joints (`thumb` at its root, `thumb_middle`, `thumb_end`), and the
      three rows of the fingers' knuckles, the four fingers of a row lumped: `fingers` (as in human23, where they meet
      the palm), `fingers_middle`, `fingers_end`.
    - Feet, 3 a side for 1: the rows of the toes' knuckles, the five toes lumped: `toes` (as in human23, the ball of
      the foot), `toes_middle`, `toes_end`.
    - Spine, 11 for 4: every second joint of lumbar spine and neck, every fourth of the chest, which the ribs stiffen.
      From below: `lumbar` (L5/S1), `lumbar_middle` (L3/L4), `lumbar_upper` (L1/L2), `thorax` (T12/L1),
      `thorax_middle` (T8/T9), `thorax_upper` (T4/T5), `cervical` (C7/T1), `cervical_middle` (C5/C6),
      `cervical_upper` (C3/C4), `axial` (C1/C2, where the head turns), `atlantal` (C0/C1, where it nods).

    With pelvis (1), hips, knees and ankles (6), clavicles, shoulders, elbows and wrists (8): 12 + 6 + 11 + 15 = 44.
    There are no single fingers or toes, and neither eyes nor jaw.

    The joints of human23 keep their names, places and axes. Children of `lumbar`, `thorax` or `cervical` there hang
    from the end of that row here: `thorax` from `lumbar_upper`, clavicles and `cervical` from `thorax_upper`,
    `atlantal` from `axial`.

    >>> from motionmind import human44
    >>> len(human44())
    44
    """
    rows = _human(_ARM + _THUMB)
    for row in (*_VERTEBRAE, *_both_sides(_KNUCKLES)):
        rows = _divided(rows, row)
    return _skeleton("human44", rows)


# The bodies that files refer to by name.
BODIES: Mapping[str, Callable[[], Skeleton]] = {"human23": human23, "human44": human44}


def _human(arm: tuple[_Row, ...]) -> list[_Row]:
    return [("pelvis", "", (0.0, 0.0, 0.0)), *_both_sides(_LEG), *_TRUNK, *_both_sides(arm)]


def _both_sides(rows: tuple[_Row, ...]) -> list[_Row]:
    """Return the rows of the left side, then those of the right."""
    shared = {"pelvis", "thorax"}
    return [
        (f"{side}_{joint}", parent if parent in shared else f"{side}_{parent}", (sign * x, y, z))
        for side, sign in (("left", 1.0), ("right", -1.0))
        for joint, parent, (x, y, z) in rows
    ]


def _divided(rows: list[_Row], new: _Row) -> list[_Row]:
    """Insert a new joint between its parent and the parent's former children, which keep their places in the world."""
    name, above, (x, y, z) = new
    out: list[_Row] = []
    for joint, parent, offset in rows:
        rest = (round(offset[0] - x, 6), round(offset[1] - y, 6), round(offset[2] - z, 6))
        out.append((joint, name, rest) if parent == above else (joint, parent, offset))
        if joint == above:
            out.append(new)
    return out


def _skeleton(name: str, rows: list[_Row]) -> Skeleton:
    joints = [row for row in rows if not row[0].endswith("_tip")]
    tips = {parent: offset for joint, parent, offset in rows if joint.endswith("_tip")}
    names = tuple(joint for joint, _, _ in joints)
    return Skeleton(
        name,
        names,
        tuple(names.index(parent) if parent else -1 for _, parent, _ in joints),
        np.array([offset for _, _, offset in joints]),
        np.array([tips.get(joint, (0.0, 0.0, 0.0)) for joint in names]),
    )
