"""Fit the angles of a body's anatomy to recorded postures: whole degrees within the joints' limits, few positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.anatomy import SIDES, Anatomy
from motionmind.geometry import rotations as rot
from motionmind.transcription.bones import Bones


class Positions(NamedTuple):
    """Named positions of a layer, as written for the left.

    Attributes:
        words: their names.
        degrees: the angles of the layer's joints [N, joints, 3].
    """

    words: Sequence[str]
    degrees: Floats


class Written(NamedTuple):
    """Postures as a score can write them.

    Attributes:
        facing: of each posture [T], degrees to the left of the audience.
        degrees: angles of the joints [T, J, 3] about x, y and z (`Anatomy.degrees`); whole, and 0 without an angle.
        rotations: local rotations of these angles [T, J, 4], in the frame that the body faces in.
    """

    facing: Ints
    degrees: Floats
    rotations: Floats

    def turned(self) -> Floats:
        """Return the local rotations in the world [T, J, 4]."""
        out = self.rotations.copy()
        out[:, 0] = rot.mul(rot.about_vertical(np.radians(self.facing)), out[:, 0])
        return out


def write_angles(
    bones: Bones, rotations: Floats, tolerance: float, known: Mapping[str, Positions] | None = None
) -> Written:
    """Return postures that a score can write in few words, near recorded ones.

    Joints are fitted from the pelvis outward. Each takes the angles that it has, in whole degrees within its limits,
    that bring its segment nearest to the recorded orientation, given how far its parent is off. So neither rounding nor
    a missing angle, such as the knee's twist, adds up along a limb. Facings and the positions of each layer are then
    merged: a position stands for those in which no bone differs by more than half the tolerance.

    Args:
        bones: the bones of the score's body.
        rotations: local rotations of postures on its skeleton [T, J, 4].
        tolerance: degrees; 0 merges nothing.
        known: named positions of each layer, the first to stand for others.
    """
    body, count = bones.body, len(rotations)
    has = _angles_of(body)
    step = max(1.0, np.floor(tolerance))
    turn = body.degrees_of(np.array([0]), rotations)[:, 0, 1]
    facing = (step * np.round(turn / step)).astype(np.int64)
    has[0, 1] = False  # the pelvis's turn about the vertical, which is the facing
    fitted = rotations.copy()
    fitted[:, 0] = rot.mul(rot.about_vertical(-np.radians(facing)), fitted[:, 0])
    segments = body.skeleton.global_rotations(fitted)
    degrees = np.zeros((count, len(body.skeleton), 3))
    # The trunk first: the limbs make up for what its positions leave out.
    trunk_first = sorted(body.layers, key=lambda layer: body.paired(body.layers[layer][0]))
    for layer in sorted(trunk_first, key=lambda layer: body.skeleton.names[0] not in body.layers[layer]):
        joints = np.array([index for index, name in enumerate(body.skeleton.names) if _in_layer(body, name, layer)])
        for joint in joints:
            parent = body.skeleton.parents[joint]
            above = body.skeleton.global_rotations(fitted)[:, parent] if joint else rot.IDENTITY
            fitted[:, joint] = rot.inv_mul(above, segments[:, joint])
            wanted = body.degrees_of(np.array([joint]), fitted)[:, 0]
            limits = body.limits[0][joint], body.limits[1][joint]
            degrees[:, joint] = np.where(has[joint], np.round(wanted).clip(*limits), 0.0) + 0.0  # no -0.0
            fitted[:, joint] = rotations_of(body, degrees)[:, joint]
        if tolerance:
            _merge(bones, layer, degrees, 0.5 * tolerance, (known or {}).get(layer))
            fitted[:, joints] = rotations_of(body, degrees)[:, joints]
    return Written(facing, degrees, fitted)


def mirror_trunk(degrees: Floats) -> Floats:
    """Return the angles [..., 3] of a trunk's joints in the mirror image."""
    return np.asarray(degrees * [1.0, -1.0, -1.0] + 0.0)  # no -0.0


def rotations_of(body: Anatomy, degrees: Floats) -> Floats:
    """Return the local rotations [T, J, 4] of angles [T, J, 3], degrees."""
    return body.rotations(dict(zip(body.skeleton.names, degrees.swapaxes(0, 1), strict=True)))


def leads_left(degrees: Floats) -> Bools:
    """Return whether trunks with these angles [..., joints, 3] are written for the left: one name for both sides."""
    sided = degrees[..., 1:].reshape(*degrees.shape[:-2], -1)
    first = np.take_along_axis(sided, (sided != 0.0).argmax(axis=-1)[..., None], axis=-1)[..., 0]
    return np.asarray(first >= 0.0)


def _angles_of(body: Anatomy) -> Bools:
    """Return which angles the joints of a body have [J, 3]."""
    has = np.zeros((len(body.skeleton), 3), dtype=np.bool_)
    for index, name in enumerate(body.skeleton.names):
        for angle in body.anatomy(name)[1].angles.values():
            has[index, angle.axis] = True
    return has


def _in_layer(body: Anatomy, name: str, layer: str) -> bool:
    return body.anatomy(name)[0] in body.layers[layer]


def _merge(bones: Bones, layer: str, degrees: Floats, tolerance: float, known: Positions | None) -> None:
    """Replace the angles of a layer in `degrees` [T, J, 3] by those of few positions, at most `tolerance` off.

    The nearest of the known positions comes first. Of the others, the slowest become positions first, so that the
    places where a limb rests have names (leader clustering: Hartigan, "Clustering Algorithms", 1975, chapter 3). Right
    limbs share the positions of left ones, and trunks those of their mirror images.
    """
    body = bones.body
    names, sides = body.layers[layer], SIDES if body.paired(body.layers[layer][0]) else ("",)
    own = [np.array([body.named(joint, side) for joint in names]) for side in sides]
    wide = np.isin(bones.joints, own[0])
    allowed = 2.0 * np.sin(0.5 * np.radians(bones.allowed(tolerance)[wide]))

    def written_left(angles: Floats) -> tuple[Floats, Bools, Floats]:
        """Return angles [N, joints, 3] for one side, which of them were mirrored, and the directions of the bones."""
        mirrored = np.zeros(len(angles), dtype=np.bool_) if len(sides) == 2 else ~leads_left(angles)
        angles = np.where(mirrored[:, None, None], mirror_trunk(angles), angles)
        alone = np.zeros((len(angles), len(body.skeleton), 3))
        alone[:, own[0]] = angles
        return angles, mirrored, bones.directions(rotations_of(body, alone))[:, wide]

    samples, mirrored, directions = written_left(np.concatenate([degrees[:, joints] for joints in own]))
    speed = np.concatenate([_speed(part) for part in np.split(directions, len(sides))])
    merged = samples.copy()
    nearest = np.ones(len(samples))
    if known is not None and len(known.words):
        for angles, _, towards in zip(*written_left(known.degrees), strict=True):
            off = (rot.norm(directions - towards) / allowed).max(axis=1)
            merged[off < nearest] = angles
            nearest = np.minimum(nearest, off)
    free = nearest == 1.0
    for sample in np.argsort(speed, kind="stable"):
        if free[sample]:
            others = np.flatnonzero(free)
            near = others[(rot.norm(directions[others] - directions[sample]) <= allowed).all(axis=1)]
            merged[near], free[near] = samples[sample], False
    merged[mirrored] = mirror_trunk(merged[mirrored])
    for joints, part in zip(own, np.split(merged, len(sides)), strict=True):
        degrees[:, joints] = part


def _speed(directions: Floats) -> Floats:
    """Return the mean change of directions from frame to frame [T]."""
    if len(directions) < 2:
        return np.zeros(len(directions))
    return np.asarray(rot.norm(np.gradient(directions, axis=0)).mean(axis=1))
