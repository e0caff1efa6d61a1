"""Feet: the tracks that they go along relative to the root, and legs that bring them to where they should be."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.contact import Posed
from motionmind.body.legs import find_hinge, find_legs
from motionmind.body.skeleton import Skeleton, remembered
from motionmind.footing.knees import SHIFTS, bend_of, distance_of, keep_detail, slow_down, smoothed
from motionmind.footing.legs import SOFT, stretched, usual_hinge, write_bent
from motionmind.geometry import rotations as rot
from motionmind.geometry.single import length, vector
from motionmind.jit import jit

GRIP = 0.015  # metres above the lower end of a foot at which the other's hold on the floor has fallen to 1/e
LOOSE = 0.15  # of a leg's length, as `legs.SOFT`, of one that swings
KNEE = 8.0  # radians a second at which knees bend at most, where nothing is known of the corpus's
QUICK = 1.2  # times as fast as all but a hundredth of the corpus's moments: as knees bend at most
STEEP = 0.4, 0.7  # cosines of a leg's lean from which its foot is raised and lowered, not drawn along the leg
GIVES = 0.15, 0.1, 0.06, 0.04  # seconds over which the height of a body changes that gives way to a knee, by round
SHOWS = 0.01  # metres by which a foot that stands may rise, and nobody sees it


class Foot(NamedTuple):
    """A leg that can be placed; the part of it that stands is everything beyond the shank.

    Attributes:
        limb: its number among the limbs.
        leg: its joints, outward.
        knee: the place among them of its knee.
        hinge: the axis about which that bends, in the frame of the joint above [3]; None if unknown.
    """

    limb: int
    leg: list[int]
    knee: int
    hinge: Floats | None

    @property
    def joints(self) -> list[int]:
        """The joints of the foot itself; none if the leg ends in the shank's own tip."""
        return self.leg[self.knee + 1 :]

    def chain(self, skeleton: Skeleton) -> list[int]:
        """Return hip, knee and the point that they bring to its place: the next joint, or its tip as J + joint."""
        return [*self.leg, self.leg[-1] + len(skeleton)][self.knee - 1 : self.knee + 2]

    def length(self, skeleton: Skeleton) -> float:
        """Return the length of thigh and shank together, metres."""
        return sum(self.bones(skeleton))

    def bones(self, skeleton: Skeleton) -> tuple[float, float]:
        """Return the lengths of thigh and shank, metres."""
        _, knee, end = self.chain(skeleton)
        shank = skeleton.offsets[end] if end < len(skeleton) else skeleton.tips[end - len(skeleton)]
        return _length(*skeleton.offsets[knee].tolist()), _length(*shank.tolist())


@lru_cache(maxsize=64)
def _length(x: float, y: float, z: float) -> float:
    """Return the length of a bone, metres, from its end in the frame of its beginning."""
    return float(np.linalg.norm([x, y, z]))


def find_free_feet(skeleton: Skeleton, fixed: Bools) -> list[Foot]:
    """Return the feet of a body's legs, but for those with joints that must not change."""
    return [foot for foot in _find_feet(skeleton) if not fixed[foot.leg].any()]


@remembered
def _find_feet(skeleton: Skeleton) -> list[Foot]:
    """Return the feet of a body's legs."""
    numbers, legs = find_legs(skeleton)
    return [
        Foot(number, leg, knee, find_hinge(skeleton, leg[knee]))
        for number, (leg, knee) in zip(numbers, legs, strict=True)
    ]


def foot_points(foot: Foot, joints: Indices, count: int) -> Bools:
    """Return which of a body's points are a foot's [P]: its joints, tips and heel; of a leg without a foot, its tip.

    Args:
        foot: the foot.
        joints: the joint that each point belongs to [P] (`contact_points`).
        count: number of joints; after them come the joints' tips.
    """
    out = np.zeros(len(joints), dtype=np.bool_)
    for joint in foot.joints:
        out |= joints == joint
    if not foot.joints:
        out[count + foot.leg[-1]] = True
    return out


def track_of(foot: Foot, places: Floats, count: int) -> Floats:
    """Return where a foot is, level, relative to the root [N, 2], metres, so that one that stands or rolls stays.

    It moves as its last bone does, both ends of it by how low they are.

    Args:
        foot: the foot.
        places: of all joints, then all tips, and whatever points after them, relative to the root [N, P, 3], metres.
        count: number of joints.
    """
    ends = places[:, [foot.leg[-1], count + foot.leg[-1]]]
    height, level = ends[..., 1], ends[..., [0, 2]]
    holds = _hold(np.maximum(height[1:], height[:-1]))
    # A foot that rolls to and fro comes back to its place only roughly: on the whole, it moves as the end of it does
    # that stands in the first and in the last frame.
    both, out = _hold(height[0] + height[-1]), np.empty((len(places), 2))
    _write_track(np.ascontiguousarray(ends), holds, both @ level[0], both @ (level[-1] - level[0]), out)
    return out


@jit
def _write_track(ends: Floats, holds: Floats, first: Floats, whole: Floats, out: Floats) -> None:
    """Write the level track of a foot [N, 2], metres.

    Args:
        ends: of its last bone [N, 2, 3], metres.
        holds: how much each end holds on to the floor between frames [N - 1, 2].
        first: where the track begins [2].
        whole: how far it goes on the whole [2].
        out: the track.
    """
    last = len(ends) - 1
    out[0] = 0.0
    for t in range(last):
        for k in range(2):
            moved = holds[t, 0] * (ends[t + 1, 0, 2 * k] - ends[t, 0, 2 * k])
            out[t + 1, k] = out[t, k] + (moved + holds[t, 1] * (ends[t + 1, 1, 2 * k] - ends[t, 1, 2 * k]))
    for k in range(2):
        drift = whole[k] - out[last, k]
        for t in range(last + 1):
            out[t, k] = first[k] + (out[t, k] + (1.0 if t == last else t * (1.0 / last)) * drift)


def _hold(height: Floats) -> Floats:
    """Return how much each end of a foot holds on to the floor [..., 2], by its height [..., 2], metres; sums are 1."""
    share = np.exp(-(height - height.min(axis=-1, keepdims=True)) / GRIP)
    return np.asarray(share / share.sum(axis=-1, keepdims=True))


def softness(holds: Floats) -> Floats:
    """Return how near to their full length legs fall short [N, feet], a share of it, by how firmly they hold."""
    return LOOSE + (SOFT - LOOSE) * holds


def ease_knees(
    skeleton: Skeleton,
    posed: Posed,
    feet: list[Foot],
    off: Floats,
    holds: Floats,
    bound: Floats,
    room: Floats,
    fine: bool,
    staying: int | None,
    moving: tuple[bool, bool],
    fastest: Floats,
    fps: float,
) -> tuple[Floats, Floats]:
    """Return displacements of feet whose knees bend as knees do, and of the root [N, 3], metres.

    They bend no faster than they can, and keep the movement's fine detail. Feet that swing come nearer to the hip or
    go farther from it; where they stand, the body does.

    Args:
        skeleton: the body.
        posed: the movement, whose legs are to bend.
        feet: those to place.
        off: how far each is from where the rotations have it [N, feet, 3], metres.
        holds: how much each holds its place [N, feet], from 0 to 1.
        bound: how much the body's height may give way [N], from 0 to 1.
        room: how much lower than there each foot may be [N, feet], metres.
        fine: whether the movement has fine detail.
        staying: a foot that stands throughout, or None: detail takes it off its place by millimetres alone.
        moving: whether the velocity is given in the first and in the last frame.
        fastest: speeds of the joints [J], rad/s, that knees keep to if they do so in the movement itself.
        fps: frames a second.
    """
    fixed = np.zeros(len(off), dtype=np.bool_)
    fixed[[0, -1]] = True
    fixed[[1, -2]] |= moving
    legs, own = np.empty(off.shape), np.empty(off.shape[:2])
    most, bones = np.empty(len(feet)), [foot.bones(skeleton) for foot in feet]
    for number, foot in enumerate(feet):
        hip, knee, end = foot.chain(skeleton)
        legs[:, number] = posed.places[:, end] - posed.places[:, hip]
        own[:, number] = bend_of(rot.norm(legs[:, number]), *bones[number])
        most[number] = max(QUICK * float(fastest[knee]), fps * float(np.abs(np.diff(own[:, number])).max()))
    now, full, soft = rot.norm(legs), np.array([sum(bone) for bone in bones]), softness(holds)

    def aims_at(places: Floats) -> Floats:
        """Return where feet come to that are to be at places [N, feet, 3] from the hips: legs stretch softly."""
        wanted = rot.norm(places)
        far = stretched(now, wanted, full, soft)
        far[fixed] = now[fixed]
        return np.asarray(places * (far / np.maximum(wanted, 1e-9))[..., None])

    def bends_of(aims: Floats, stands: Bools) -> list[Floats]:
        """Return the bends of knees, slow enough, whose feet come near their aims."""
        far = rot.norm(aims)
        return [
            slow_down(bend_of(far[:, number], *bones[number]), stands[:, number], fixed, most[number], fps)
            for number in range(len(feet))
        ]

    bears, places = holds**4, legs + off
    share = bears / np.maximum(bears.sum(axis=1, keepdims=True), 1.0)
    shift, stands = np.zeros((len(off), 3)), holds == 1.0
    for number_of_round, seconds in enumerate(GIVES):
        places_now = places - shift[:, None]
        aims = aims_at(places_now)
        made, wanted = _lengthened(aims, _lengths(bends_of(aims, stands), bones)), aims
        if number_of_round:
            # Finer rounds are seen in the body: they are for a foot that stands all the time, and is seen to rise.
            if staying is None or (made - places_now)[:, staying, 1].max() < SHOWS:
                break
            wanted = places_now
        gives = np.sum(share * (wanted - made)[..., 1], axis=1)
        shift[:, 1] += smoothed(gives, seconds, fps) * bound
    # With a soft stretch from where the body is now, a few more of the ballet would lean at rest: for that foot alone.
    aims = aims_at(places) - shift[:, None] if staying is None else aims_at(places - shift[:, None])
    # What the body does not give, the feet do: upward, for the floor is in the way of the rest.
    bends = bends_of(aims, np.zeros_like(stands))
    firm = _lengthened(aims, _lengths(bends, bones))
    if not fine:
        return firm - legs, shift
    pairs = zip(bends, own.T, bones, strict=True)
    out = _lengthened(aims, _lengths([keep_detail(bend, one, fixed, *bone, fps) for bend, one, bone in pairs], bones))
    lowest = (legs + off - shift[:, None])[..., 1] - room
    # Detail that would take a foot into the floor is left out there: to lift the foot for a while would be seen.
    out[..., 1] = np.maximum(out[..., 1], np.minimum(firm[..., 1], lowest))
    if staying is not None:
        height = firm[:, staying, 1]
        out[:, staying, 1] = height + SHIFTS * np.tanh((out[:, staying, 1] - height) / SHIFTS)
    return out - legs, shift


def _lengths(bends: Sequence[Floats], bones: Sequence[tuple[float, float]]) -> Floats:
    """Return how far legs' ends are from each other [N, feet], metres, by the bends of their knees [N]."""
    return np.stack([distance_of(bend, *bone) for bend, bone in zip(bends, bones, strict=True)], axis=1)


def _lengthened(legs: Floats, lengths: Floats) -> Floats:
    """Return legs from hip to foot [N, feet, 3] as long as given [N, feet], metres: steep ones, with feet level."""
    out = np.empty(legs.shape)
    _write_lengthened(legs, lengths, out)
    return out


@jit
def _write_lengthened(legs: Floats, lengths: Floats, out: Floats) -> None:
    """Write what `_lengthened` returns."""
    for t in range(len(legs)):
        for foot in range(legs.shape[1]):
            leg, wanted, own = vector(legs[t, foot]), lengths[t, foot], length(vector(legs[t, foot]))
            level = min(own**2 - leg[1] ** 2, wanted**2)
            upright = leg[0], -np.sqrt(wanted**2 - level), leg[2]
            s = min(max((-leg[1] / max(own, 1e-9) - STEEP[0]) / (STEEP[1] - STEEP[0]), 0.0), 1.0)
            for k in range(3):
                drawn = leg[k] * (wanted / max(own, 1e-9))
                out[t, foot, k] = drawn + s * s * (3.0 - 2.0 * s) * (upright[k] - drawn)
            longer = wanted / max(length(vector(out[t, foot])), 1e-9)
            for k in range(3):
                out[t, foot, k] *= longer


def bend_legs(skeleton: Skeleton, posed: Posed, feet: list[Foot], off: Floats, soft: Floats) -> Floats:
    """Return rotations [N, J, 4] whose legs bring the feet to their places; feet keep their orientations.

    Args:
        skeleton: the body.
        posed: the movement, whose legs are to bend.
        feet: those to place.
        off: how far each is from where the rotations have it [N, feet, 3], metres.
        soft: how near to its full length each falls short [N, feet], a share of it.
    """
    turned, places, out = posed.turned, posed.places, posed.rotations.copy()
    if not feet:
        return out
    chains = np.array([foot.chain(skeleton) for foot in feet])
    hips, usual = chains[:, 0], None if feet[0].hinge is None else np.array([foot.hinge for foot in feet])
    if usual is None or not usual.any(axis=1).all():
        usual = usual_hinge(turned[:, hips], places[:, chains], usual)
    above = np.array([skeleton.parents[hip] for hip in hips.tolist()])
    write_bent(out, turned, places, chains, above, np.ascontiguousarray(off), usual, np.ascontiguousarray(soft))
    if not np.isfinite(out[:, hips]).all():
        raise ValueError("a leg, or the way to its place, has no direction")
    return out
