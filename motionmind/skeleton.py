"""Skeletons: joints in topological order, each with its parent and its place in the parent's frame."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from motionmind import rotations as rot
from motionmind.errors import SkeletonError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A tree of joints. Metres; Y up; a person at rest faces +Z, so that +X is to the person's left.

    Attributes:
        name: what the skeleton is called, such as "human23".
        names: the joints' names [J], each after its parent; the first is the root.
        parents: index of each joint's parent [J], -1 for the root.
        offsets: place of each joint in its parent's frame [J, 3], metres (the root's is 0).
        tips: place of each leaf's far end (fingertip, toe tip, crown) in the leaf's own frame [J, 3], metres;
            0 where there is none.
    """

    name: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Array
    tips: Array = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        count = len(self.names)
        offsets = np.array(self.offsets, dtype=np.float64)
        tips = np.zeros((count, 3)) if len(self.tips) == 0 else np.array(self.tips, dtype=np.float64)
        if count == 0:
            raise SkeletonError(f"skeleton {self.name!r} has no joints")
        if len(self.parents) != count or offsets.shape != (count, 3) or tips.shape != (count, 3):
            raise SkeletonError(
                f"skeleton {self.name!r}: {count} joints need as many parents, offsets and tips in metres x, y, z, "
                f"not {len(self.parents)}, {list(offsets.shape)} and {list(tips.shape)}"
            )
        twice = sorted(name for name, times in Counter(self.names).items() if times > 1)
        if twice:
            raise SkeletonError(f"skeleton {self.name!r} names {', '.join(twice)} more than once")
        if self.parents[0] != -1:
            raise SkeletonError(f"skeleton {self.name!r}: the first joint must be the root, with parent -1")
        for child, parent in enumerate(self.parents[1:], start=1):
            if not 0 <= parent < child:
                raise SkeletonError(f"skeleton {self.name!r}: the parent of {self.names[child]!r} must stand before it")
        if not (np.isfinite(offsets).all() and np.isfinite(tips).all()):
            raise SkeletonError(f"skeleton {self.name!r} has an offset that is not a finite number")
        offsets.setflags(write=False)
        tips.setflags(write=False)
        object.__setattr__(self, "offsets", offsets)
        object.__setattr__(self, "tips", tips)

    def __len__(self) -> int:
        return len(self.names)

    def __eq__(self, other: object) -> bool:
        """Same joints, same tree, same proportions."""
        return (
            isinstance(other, Skeleton)
            and self.difference(other) is None
            and np.array_equal(self.offsets, other.offsets)
            and np.array_equal(self.tips, other.tips)
        )

    __hash__ = None  # type: ignore[assignment]

    def index(self, joint: str) -> int:
        """Index of the joint called `joint`; SkeletonError names the joints there are."""
        if joint not in self.names:
            raise SkeletonError(f"no joint {joint!r} in {self.name}; its joints are {', '.join(self.names)}")
        return self.names.index(joint)

    def children(self, joint: int) -> list[int]:
        """Indices of the joints whose parent is `joint`."""
        return [child for child, parent in enumerate(self.parents) if parent == joint]

    def difference(self, other: Skeleton) -> str | None:
        """How the tree of `other` differs from this one, in words; None where names and parents are the same.

        Proportions do not count: orientations mean the same on a taller body.
        """
        mine, theirs = self._parent_names(), other._parent_names()
        missing = [name for name in mine if name not in theirs]
        extra = [name for name in theirs if name not in mine]
        if missing or extra:
            parts = [f"lacks {_some(missing)}"] * bool(missing) + [f"adds {_some(extra)}"] * bool(extra)
            return f"{other.name} {' and '.join(parts)}"
        for name, parent in mine.items():
            if theirs[name] != parent:
                return f"{name} hangs from {theirs[name]} in {other.name}, from {parent} in {self.name}"
        if self.names != other.names:
            return f"{other.name} lists the same joints in another order"
        return None

    def _parent_names(self) -> dict[str, str]:
        above = ("nothing" if parent < 0 else self.names[parent] for parent in self.parents)
        return dict(zip(self.names, above, strict=True))

    @cached_property
    def height(self) -> float:
        """Vertical extent in metres of the body at rest (identity rotations), tips included."""
        positions = self.positions(np.tile(rot.IDENTITY, (len(self), 1)), np.zeros(3))
        heights = np.concatenate([positions[:, 1], (positions + self.tips)[:, 1]])
        return float(np.ptp(heights))

    def global_rotations(self, rotations: Array) -> Array:
        """Rotations [..., J, 4] of each joint's frame against the world, from local ones [..., J, 4]."""
        out = np.array(rotations, dtype=np.float64)
        for joints, parents in self._generations:
            out[..., joints, :] = rot.mul(out[..., parents, :], out[..., joints, :])
        return out

    def local_rotations(self, turned: Array) -> Array:
        """Local rotations [..., J, 4] from global ones; the inverse of `global_rotations`."""
        parents = np.array(self.parents[1:], dtype=np.intp)
        local = rot.inv_mul(turned[..., parents, :], turned[..., 1:, :])
        return np.concatenate([turned[..., :1, :], local], axis=-2)

    def positions(self, rotations: Array, root: Array) -> Array:
        """Forward kinematics: joint positions [..., J, 3] in metres.

        `rotations` [..., J, 4] are local, `root` [..., 3] is the root's position.
        """
        return self._positions(self.global_rotations(rotations), root)

    def positions_and_tips(self, rotations: Array, root: Array) -> Array:
        """Positions [..., J + J, 3] in metres of all joints, then of all tips (a joint without one twice)."""
        turned = self.global_rotations(rotations)
        positions = self._positions(turned, root)
        return np.concatenate([positions, positions + rot.mul_vec(turned, self.tips)], axis=-2)

    def _positions(self, turned: Array, root: Array) -> Array:
        out = np.empty((*turned.shape[:-1], 3))
        out[..., 0, :] = root
        for joints, parents in self._generations:
            out[..., joints, :] = out[..., parents, :] + rot.mul_vec(turned[..., parents, :], self.offsets[joints])
        return out

    @cached_property
    def _generations(self) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
        """Joints as far from the root as each other, and their parents: from its children outward."""
        depth = [0] * len(self)
        for joint, parent in enumerate(self.parents):
            depth[joint] = depth[parent] + 1 if parent >= 0 else 0
        steps = [np.flatnonzero(np.array(depth) == far) for far in range(1, max(depth) + 1)]
        return [(joints, np.array(self.parents, dtype=np.intp)[joints]) for joints in steps]


def _some(names: list[str]) -> str:
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")


# --- the bodies that go by their names -------------------------------------------------------------------------------

# A body is rows: a joint, the joint that it hangs from, its place there in metres. Limbs are written for the left side;
# what ends in "_tip" is a leaf's far end. At rest: a T-pose facing +Z, palms down, every joint's axes the world's.
_Row = tuple[str, str, tuple[float, float, float]]

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
    """The default body: 23 joints, 1.70 m, at rest in a T-pose facing +Z with all joint axes the world's."""
    return _skeleton("human23", _human(_ARM))


@cache
def human44() -> Skeleton:
    """The body whose hands close, toes curl and spine rolls: 44 joints, as tall as human23 and at rest like it.

    That a body has 44 joints is from Bradley and Stuart's technical report CU-CS-844-97 (1997). Its list of them was
    not at hand, so which they are is our reading: the joints of human23, and those that are lumped in its hands, feet
    and spine, as many as the count allows.

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

    Joints of human23 have their names, places and axes here. What hangs from `lumbar`, `thorax` or `cervical` there
    hangs from the end of that row here: `thorax` from `lumbar_upper`, clavicles and `cervical` from `thorax_upper`,
    `atlantal` from `axial`.
    """
    rows = _human(_ARM + _THUMB)
    for row in (*_VERTEBRAE, *_both_sides(_KNUCKLES)):
        rows = _divided(rows, row)
    return _skeleton("human44", rows)


# The bodies that files name without describing them.
BODIES: Mapping[str, Callable[[], Skeleton]] = {"human23": human23, "human44": human44}


def _human(arm: tuple[_Row, ...]) -> list[_Row]:
    return [("pelvis", "", (0.0, 0.0, 0.0)), *_both_sides(_LEG), *_TRUNK, *_both_sides(arm)]


def _both_sides(rows: tuple[_Row, ...]) -> list[_Row]:
    """The left side's rows, then the right side's."""
    shared = {"pelvis", "thorax"}
    return [
        (f"{side}_{joint}", parent if parent in shared else f"{side}_{parent}", (sign * x, y, z))
        for side, sign in (("left", 1.0), ("right", -1.0))
        for joint, parent, (x, y, z) in rows
    ]


def _divided(rows: list[_Row], new: _Row) -> list[_Row]:
    """The rows with a new joint between the one that it hangs from and all that hung there, which keeps its place."""
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
