"""Normalises a BVH rig, whose joints may move against their parents, to a skeleton of constant offsets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from motionmind._typing import Floats
from motionmind.body.noticeable import NOTICEABLE_SPAN_SHARE
from motionmind.body.skeleton import Skeleton
from motionmind.errors import enumerated
from motionmind.formats.units import bone_span
from motionmind.geometry import rotations as rot

# A joint that moves by less counts as still: share of the body's span, or radians. Exporters print 6 digits.
_STILL_SPAN_SHARE = 1e-4


@dataclass(frozen=True)
class Placed:
    """Movement in a BVH file, where each joint may move against its parent.

    Attributes:
        skeleton: the file's tree with its OFFSETs, in the file's unit.
        rotations: local quaternions [T, J, 4].
        places: {joint with position channels: its place in its parent's frame [T, 3], in the file's unit}.
    """

    skeleton: Skeleton
    rotations: Floats
    places: dict[int, Floats]

    def stray(self, joint: int) -> float:
        """Return the joint's largest range of movement against its parent along an axis, in the file's unit."""
        return float(np.max(np.ptp(self.places[joint], axis=0))) if joint in self.places else 0.0

    def turn(self, joint: int) -> float:
        """Return the largest angle, radians, between the joint's first rotation and any other."""
        return float(np.max(rot.angle(self.rotations[:1, joint], self.rotations[:, joint])))

    def place(self, joint: int) -> Floats:
        """Return the joint's places in its parent's frame [T, 3], in the file's unit."""
        still = np.broadcast_to(self.skeleton.offsets[joint], (len(self.rotations), 3))
        return self.places.get(joint, still)

    def mean_offsets(self) -> Floats:
        """Return the joints' mean places in their parents' frames [J, 3], in the file's unit; 0 for the root."""
        offsets = np.array(self.skeleton.offsets)
        for joint, place in self.places.items():
            offsets[joint] = place.mean(axis=0)
        offsets[0] = 0.0
        return offsets


@dataclass(frozen=True)
class NormalisedRig:
    """A BVH file's movement on a skeleton of constant offsets, with the repairs made.

    Attributes:
        skeleton: offsets and tips in the file's unit.
        rotations: local quaternions [T, J, 4].
        root: places of the root [T, 3] in the file's unit.
        notes: the repairs in words.
        strays: joints whose place varies, each with its largest distance from the mean, in the file's unit.
    """

    skeleton: Skeleton
    rotations: Floats
    root: Floats
    notes: list[str]
    strays: list[tuple[str, float]]

    def repairs(self, scale: float) -> Iterator[str]:
        """Describe the repairs, with lengths in millimetres if one unit is `scale` metres."""
        yield from self.notes
        if self.strays:
            far = [f"{name} (by up to {1000.0 * scale * stray:.3g} mm)" for name, stray in self.strays]
            yield f"joints that move against their parents stay at their mean place: {enumerated(far)}"


def normalise(body: Placed) -> NormalisedRig:
    """Reduce `body` to constant offsets: each joint's mean place.

    Position channels that the file adds to OFFSETs are resolved, and the joint that carries the body becomes the root.
    """
    body, is_resolved = resolve_places(body)
    notes = ["position channels near 0 are added to OFFSETs, which are not"] if is_resolved else []
    span = bone_span(np.array(body.skeleton.parents), body.mean_offsets(), body.skeleton.tips)
    if top := _new_root(body, span):
        body = _fold(body, top, span, notes)
    offsets = body.mean_offsets()
    strays = [
        (body.skeleton.names[joint], float(np.max(np.linalg.norm(place - offsets[joint], axis=-1))))
        for joint, place in body.places.items()
        if joint > 0 and body.stray(joint) > NOTICEABLE_SPAN_SHARE * span
    ]
    return NormalisedRig(replace(body.skeleton, offsets=offsets), body.rotations, body.place(0), notes, strays)


def resolve_places(body: Placed) -> tuple[Placed, bool]:
    """Add position channels to OFFSETs if the file means their sum; return the result, and whether it does."""
    if not _channels_add_to_offsets(body):
        return body, False
    offsets = body.skeleton.offsets
    return replace(body, places={j: place + offsets[j] * (j > 0) for j, place in body.places.items()}), True


def _channels_add_to_offsets(body: Placed) -> bool:
    """Return whether position channels add to OFFSETs: most still joints have channels near 0 but nonzero OFFSETs."""
    added = replaced = 0
    for joint, place in body.places.items():
        offset = body.skeleton.offsets[joint]
        near = 0.01 * float(np.linalg.norm(offset))
        if joint > 0 and near > 0.0 and body.stray(joint) <= near:
            added += bool(np.linalg.norm(place[0]) < near)
            replaced += bool(np.linalg.norm(place[0] - offset) < near)
    return added > replaced


def _new_root(body: Placed, span: float) -> int:
    """Find the joint that should replace the file's root; 0 if none should.

    It moves against its parent by more than 1 % of the span, which exceeds the stretch of joints, and all moving joints
    descend from it. Any other joint is an ancestor, or still; still ones make up less than half of the body.
    """
    skeleton = body.skeleton
    far = [joint for joint in body.places if joint > 0 and body.stray(joint) > 0.01 * span]
    if not far:
        return 0
    sizes = [1] * len(skeleton)  # of subtrees
    for joint in range(len(skeleton) - 1, 0, -1):
        sizes[skeleton.parents[joint]] += sizes[joint]
    top = max(far, key=lambda joint: (sizes[joint], -joint))
    carried, above = _descendants(skeleton, top), _ancestors(skeleton, top)
    aside = sorted({*range(len(skeleton))} - {*carried, *above})
    if not aside:
        return top
    still = all(
        body.stray(joint) <= _STILL_SPAN_SHARE * span and body.turn(joint) < _STILL_SPAN_SHARE
        for joint in above + aside
    )
    return top if still and 2 * len(carried) > len(skeleton) else 0


def _ancestors(skeleton: Skeleton, joint: int) -> list[int]:
    """Return the joints from the root down to the joint's parent."""
    chain: list[int] = []
    while (joint := skeleton.parents[joint]) >= 0:
        chain.append(joint)
    return chain[::-1]


def _descendants(skeleton: Skeleton, joint: int) -> list[int]:
    """Return the joint and its descendants, in order."""
    found = {joint}
    for child in range(joint + 1, len(skeleton)):
        if skeleton.parents[child] in found:
            found.add(child)
    return sorted(found)


def _fold(body: Placed, top: int, span: float, notes: list[str]) -> Placed:
    """Make `top` the root: fold its ancestors' transforms into its own, and drop joints outside its subtree."""
    old = body.skeleton
    above, kept = _ancestors(old, top), _descendants(old, top)
    turned: Floats = np.broadcast_to(rot.IDENTITY, (len(body.rotations), 4))
    root: Floats = np.zeros((len(body.rotations), 3))
    for joint in [*above, top]:
        root = root + rot.mul_vec(turned, body.place(joint))
        turned = rot.mul(turned, body.rotations[:, joint])
    rotations = body.rotations[:, kept]
    rotations[:, 0] = turned
    new = {joint: index for index, joint in enumerate(kept)}
    skeleton = Skeleton(
        old.name,
        tuple(old.names[joint] for joint in kept),
        (-1, *(new[old.parents[joint]] for joint in kept[1:])),
        old.offsets[kept],
        old.tips[kept],
    )
    name = old.names[top]
    aside = [old.names[joint] for joint in sorted({*range(len(old))} - {*kept, *above})]
    if aside:
        notes.append(f"{name} becomes the root; joints that stand still beside it are left out: {enumerated(aside)}")
    walking = [old.names[joint] for joint in above if body.stray(joint) > _STILL_SPAN_SHARE * span]
    if walking:
        notes.append(f"{name} becomes the root, at its own place; the path of {enumerated(walking)} itself is lost")
    return Placed(skeleton, rotations, {**{new[j]: p for j, p in body.places.items() if j in new}, 0: root})
