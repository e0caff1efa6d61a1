"""Fit the angles of a body's anatomy to recorded postures: whole degrees within the joints' limits, few positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.anatomy import SIDES, Anatomy
from motionmind.geometry import rotations as rot
from motionmind.transcription.bones import Bones

# Turns about a segment's length that are tried, in passes: about the nearest orientation, then about the best so far.
TURNS_DEG = (range(-100, 101, 20), range(-16, 17, 4), range(-3, 4))
TURN_SHARE = 0.1  # of the deviation of orientations beside that of the next segments' directions, which show
BELOW_SHARES = (1.0, 0.1)  # of the next segment, and of the shorter one after it


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
    a missing angle, such as the knee's twist, adds up along a limb. A segment's turn about its own length, which shows
    only in the next ones, is the one that brings them nearest: the forearm turns as the hand needs it.

    Facings and the positions of each layer are then merged: a position stands for those in which no bone differs by
    more than half the tolerance.

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
    fit = _Fit(body, has, body.skeleton.global_rotations(fitted), fitted)
    next_segment = _turning_segments(body, has)
    degrees = np.zeros((count, len(body.skeleton), 3))
    # The trunk first: the limbs make up for what its positions leave out.
    trunk_first = sorted(body.layers, key=lambda layer: body.paired(body.layers[layer][0]))
    for layer in sorted(trunk_first, key=lambda layer: body.skeleton.names[0] not in body.layers[layer]):
        joints = np.array([index for index, name in enumerate(body.skeleton.names) if _in_layer(body, name, layer)])
        for joint in joints:
            parent = body.skeleton.parents[joint]
            above = body.skeleton.global_rotations(fitted)[:, parent] if joint else rot.IDENTITY
            degrees[:, joint] = fit(joint, above)
            if joint in next_segment:
                degrees[:, joint] = _turn_about_length(fit, joint, next_segment[joint], above, degrees[:, joint])
            fitted[:, joint] = fit.reach(joint, degrees[:, joint])
        if tolerance:
            _merge(bones, layer, degrees, 0.5 * tolerance, (known or {}).get(layer))
            fitted[:, joints] = rotations_of(body, degrees)[:, joints]
    return Written(facing, degrees, fitted)


@dataclass(frozen=True, eq=False)
class _Fit:
    """Finds the angles of single joints that bring their segments nearest to recorded orientations.

    Attributes:
        body: the anatomy.
        has: which angles its joints have [J, 3].
        segments: recorded orientations of the segments [T, J, 4].
        fitted: local rotations [T, J, 4]; those of joints above the one in question have their angles.
    """

    body: Anatomy
    has: Bools
    segments: Floats
    fitted: Floats

    def __call__(self, joint: int, above: Floats) -> Floats:
        """Return the angles of a joint [T, 3], whole degrees within its limits, below orientations `above` [T, 4]."""
        self.fitted[:, joint] = rot.inv_mul(above, self.segments[:, joint])
        wanted = self.body.degrees_of(np.array([joint]), self.fitted)[:, 0]
        return self.allowed(joint, wanted)

    def allowed(self, joint: int, degrees: Floats) -> Floats:
        """Return the nearest angles that a joint has [T, 3]."""
        least, most = self.body.limits[0][joint], self.body.limits[1][joint]
        return np.where(self.has[joint], np.round(degrees).clip(least, most), 0.0) + 0.0  # no -0.0

    def reach(self, joint: int, degrees: Floats) -> Floats:
        """Return the local rotations of a joint [T, 4] at these angles [T, 3]."""
        return self.body.rotations_of(np.array([joint]), degrees[:, None], self.fitted)[:, 0]


def _turn_about_length(fit: _Fit, joint: int, below: int, above: Floats, degrees: Floats) -> Floats:
    """Return angles of a joint [T, 3] whose turn about its segment's length brings the segments below nearest.

    Args:
        fit: the fit.
        joint: the joint.
        below: the joint at the end of its segment.
        above: orientations of the joint's parent [T, 4].
        degrees: the angles that bring its own segment nearest [T, 3].
    """
    skeleton, axis = fit.body.skeleton, _long_axis(fit.body, joint)
    ends = {parent: skeleton.offsets[child] for child, parent in enumerate(skeleton.parents)}
    chain = [(each, ends[each]) for each in (below, *skeleton.children(below)) if each in ends]
    best, least = degrees.copy(), np.full(len(degrees), np.inf)
    for offsets in TURNS_DEG:
        centre = best.copy()
        for offset in offsets:
            tried = centre.copy()
            tried[:, axis] += offset
            tried = fit.allowed(joint, tried)
            turned = fit.fitted[:, joint] = fit.reach(joint, tried)
            reached = rot.mul(above, turned)
            off = (TURN_SHARE * rot.angle(reached, fit.segments[:, joint])) ** 2
            for (each, along), share in zip(chain, BELOW_SHARES, strict=False):
                reached = rot.mul(reached, fit.reach(each, fit(each, reached)))
                apart = rot.mul_inv(reached, fit.segments[:, each])
                wanted = rot.mul_vec(fit.segments[:, each], along / rot.norm(along))
                off += share * rot.norm(rot.mul_vec(apart, wanted) - wanted) ** 2
                off += share * (TURN_SHARE * rot.angle(reached, fit.segments[:, each])) ** 2
            nearer = off < least
            best[nearer], least[nearer] = tried[nearer], off[nearer]
    return best


def _turning_segments(body: Anatomy, has: Bools) -> dict[int, int]:
    """Return the joints that turn their segment about its length, with the joint below, if that lacks an angle."""
    out = {}
    for joint in range(len(body.skeleton)):
        below = body.skeleton.children(joint)
        if len(below) != 1 or has[below[0]].all() or not has[joint, _long_axis(body, joint)]:
            continue
        turned = np.zeros((2, len(body.skeleton), 3))
        turned[1, joint, _long_axis(body, joint)] = 90.0
        places = body.skeleton.positions(rotations_of(body, turned), np.zeros((2, 3)))[:, below[0]]
        if np.allclose(*places):
            out[joint] = below[0]
    return out


def _long_axis(body: Anatomy, joint: int) -> int:
    return "xyz".index(body.anatomy(body.skeleton.names[joint])[1].long)


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
