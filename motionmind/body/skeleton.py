"""Skeletons: trees of joints in topological order, each with its parent and its place in the parent's frame."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property, wraps
from numbers import Integral
from typing import Any, NamedTuple, TypeVar

import numpy as np

from motionmind._typing import Floats, Indices, Ints
from motionmind.arguments import as_floats, check_integer, check_items, check_text, check_type
from motionmind.body.everyday import suggest_joint
from motionmind.display import displayed
from motionmind.errors import SkeletonError
from motionmind.geometry import rotations as rot

_Found = TypeVar("_Found")


def remembered(find: Callable[[Skeleton], _Found]) -> Callable[[Skeleton], _Found]:
    """Return a function that finds something of a skeleton once, and then remembers it: nobody is to change it."""

    @wraps(find)
    def of(skeleton: Skeleton) -> _Found:
        known = skeleton._known
        if find not in known:
            known[find] = find(skeleton)
        found: _Found = known[find]
        return found

    return of


class Points(NamedTuple):
    """Points of a body: its joints, then others.

    Attributes:
        joints: those in whose frames the points are [P]; of a joint its parent, of the root -1.
        places: of the points in these frames [P, 3], metres.
    """

    joints: Ints
    places: Floats


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A tree of joints. Metres; Y up; a person at rest faces +Z, so that +X is to the person's left.

    Attributes:
        name: the skeleton's name, such as "human23".
        names: the joints' names [J], each listed after its parent; the first is the root.
        parents: index of each joint's parent [J], -1 for the root.
        offsets: place of each joint in its parent's frame [J, 3], metres (the root's is 0).
        tips: place of each leaf's far end (fingertip, toe tip, crown) in the leaf's own frame [J, 3], metres;
            0 for joints without one.

    >>> import numpy as np
    >>> from motionmind import Skeleton
    >>> arm = Skeleton("arm", ("shoulder", "elbow"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]))
    >>> len(arm), arm.children(0)
    (2, [1])
    """

    name: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Floats
    tips: Floats = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        check_text("name", self.name)
        check_items("names", self.names, "joints' names", str)
        check_items("parents", self.parents, "whole numbers", Integral)
        count = len(self.names)
        offsets, tips = as_floats("offsets", self.offsets), as_floats("tips", self.tips)
        tips = np.zeros((count, 3)) if len(tips) == 0 else tips
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
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "parents", tuple(map(int, self.parents)))
        object.__setattr__(self, "offsets", offsets)
        object.__setattr__(self, "tips", tips)

    def __len__(self) -> int:
        return len(self.names)

    def __eq__(self, other: object) -> bool:
        """Compare joints, tree and proportions."""
        return (
            isinstance(other, Skeleton)
            and self.difference(other) is None
            and np.array_equal(self.offsets, other.offsets)
            and np.array_equal(self.tips, other.tips)
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Skeleton {displayed(self.name)}: {len(self)} joints from {displayed(self.names[0])}>"

    def index(self, joint: str) -> int:
        """Return the index of the joint called `joint`.

        Raises:
            SkeletonError: there is no such joint; the message names those there are.
        """
        check_text("joint", joint)
        if joint not in self.names:
            raise SkeletonError(
                f"no joint {joint!r} in {self.name}{suggest_joint(joint, self.names, 'its joints are')}"
            )
        return self.names.index(joint)

    def children(self, joint: int) -> list[int]:
        """Return the indices of the joints whose parent is `joint`."""
        check_integer("joint", joint)
        return [*self._children[joint]]

    @cached_property
    def _children(self) -> list[list[int]]:
        out: list[list[int]] = [[] for _ in self.parents]
        for child, parent in enumerate(self.parents[1:], start=1):
            out[parent].append(child)
        return out

    def difference(self, other: Skeleton) -> str | None:
        """Describe how the tree of `other` differs from this one, in words; None if names and parents are the same.

        Proportions do not count: orientations mean the same on a taller body.
        """
        check_type("other", other, Skeleton)
        if (self.names, self.parents) == (other.names, other.parents):
            return None
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

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields, and nothing that was found of them."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    def _parent_names(self) -> dict[str, str]:
        above = ("nothing" if parent < 0 else self.names[parent] for parent in self.parents)
        return dict(zip(self.names, above, strict=True))

    @cached_property
    def _tree(self) -> Ints:
        """The joints' parents [J], as compiled code takes them."""
        return np.array(self.parents, dtype=np.int64)

    @cached_property
    def _known(self) -> dict[Callable[[Skeleton], Any], Any]:
        """Facts that are `remembered` of this skeleton, by the function that finds each."""
        return {}

    @cached_property
    def rest(self) -> Floats:
        """Positions of all joints, then of all tips, at rest [2 J, 3], metres: identity rotations, the root at 0."""
        places = np.zeros((len(self), 3))
        for joint, parent in enumerate(self.parents[1:], start=1):
            places[joint] = places[parent] + self.offsets[joint]
        out = np.concatenate([places, places + self.tips])
        out.setflags(write=False)
        return out

    @cached_property
    def height(self) -> float:
        """Vertical extent in metres of the body at rest (identity rotations), tips included."""
        return float(np.ptp(self.rest[:, 1]))

    def global_rotations(self, rotations: Floats) -> Floats:
        """Return the orientation of each joint's frame in the world [..., J, 4], from local rotations [..., J, 4]."""
        from motionmind.body.kinematics import turn_with_parents  # numba is slow to import

        out = np.ascontiguousarray(as_floats("rotations", rotations))
        turn_with_parents(out.reshape(-1, len(self), 4), self._tree)
        return out

    def local_rotations(self, turned: Floats) -> Floats:
        """Return local rotations [..., J, 4] from global ones [..., J, 4]: the inverse of `global_rotations`."""
        parents, turned = np.array(self.parents[1:], dtype=np.intp), as_floats("turned", turned)
        local = rot.inv_mul(turned[..., parents, :], turned[..., 1:, :])
        return np.concatenate([turned[..., :1, :], local], axis=-2)

    def positions(self, rotations: Floats, root: Floats) -> Floats:
        """Return the joints' positions [..., J, 3], metres, by forward kinematics.

        Args:
            rotations: local rotations [..., J, 4].
            root: positions of the root [..., 3], metres.
        """
        return places_of(self, joints_of(self), rotations, root)

    def positions_and_tips(self, rotations: Floats, root: Floats) -> Floats:
        """Return the positions [..., 2 J, 3], metres, of all joints, then of all tips.

        A joint without a tip has its own position for one; arguments as for `positions`.
        """
        return places_of(self, _joints_and_tips(self), rotations, root)

    def positions_with(
        self, rotations: Floats, root: Floats, joints: Sequence[int] | Indices, points: Floats
    ) -> Floats:
        """Return the positions [..., J + P, 3], metres, of all joints, then of points of their segments.

        Args:
            rotations: local rotations [..., J, 4].
            root: positions of the root [..., 3], metres.
            joints: those in whose frames the points are [P].
            points: their places in these frames [P, 3], metres.
        """
        return places_of(self, points_of(self, joints, points), rotations, root)


def points_of(skeleton: Skeleton, joints: Sequence[int] | Indices, points: Floats) -> Points:
    """Return all joints, then points of their segments.

    Args:
        skeleton: the body.
        joints: those in whose frames the points are [P].
        points: their places in these frames [P, 3], metres.
    """
    if not (isinstance(joints, np.ndarray) and joints.dtype.kind in "iu"):
        check_items("joints", joints, "joints' indices", Integral)
    frames = np.concatenate([skeleton._tree, np.asarray(joints, dtype=np.int64)])
    return Points(frames, np.concatenate([skeleton.offsets, as_floats("points", points)]))


def places_of(skeleton: Skeleton, points: Points, rotations: Floats, root: Floats) -> Floats:
    """Return the places [..., P, 3], metres, of points of a body; arguments as for `Skeleton.positions`."""
    return place(skeleton, points, skeleton.global_rotations(rotations), root)


def place(skeleton: Skeleton, points: Points, turned: Floats, root: Floats) -> Floats:
    """Return the same, from the orientations of the joints in the world [..., J, 4] (`Skeleton.global_rotations`)."""
    from motionmind.body.kinematics import place_points  # numba is slow to import

    out = np.empty((*turned.shape[:-2], len(points.joints), 3))
    out[..., 0, :] = as_floats("root", root)
    place_points(out.reshape(-1, *out.shape[-2:]), turned.reshape(-1, len(skeleton), 4), *points)
    return out


@remembered
def joints_of(skeleton: Skeleton) -> Points:
    """Return a body's joints."""
    return points_of(skeleton, np.arange(0), np.zeros((0, 3)))


@remembered
def _joints_and_tips(skeleton: Skeleton) -> Points:
    """Return a body's joints, then its tips."""
    return points_of(skeleton, np.arange(len(skeleton)), skeleton.tips)


def _some(names: list[str]) -> str:
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
