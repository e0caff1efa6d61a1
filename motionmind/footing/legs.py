"""Legs of two long bones: bring their ends to a place by inverse kinematics."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.geometry import rotations as rot
from motionmind.geometry.single import (
    Rotation,
    Vector,
    about,
    between,
    cross,
    dot,
    inverse,
    length,
    minus,
    plus,
    product,
    rotation,
    turned,
    unit,
    vector,
)
from motionmind.jit import either, jit

_Lengths = TypeVar("_Lengths", Floats, float)

SOFT = 0.02  # of a leg's length: this near to its full length a leg that stands stretches less than it would have to
HINGE = 0.1  # sine of a knee's bend below which its axis is mostly the one of other frames


@either
def stretched(now: _Lengths, wanted: _Lengths, straight: Floats | float, soft: Floats | float) -> _Lengths:
    """Return how far a leg's ends are from each other [N], metres, that is to be longer or shorter.

    All that is wanted, up to `soft` from the end of the room; then exponentially less, so the end is never reached.

    Args:
        now: how far they are [N], metres.
        wanted: how far they are to be [N], metres.
        straight: length of the straight leg, metres.
        soft: of the leg's length: this near to its full length it stretches less than it would have to [N].
    """
    room = straight - now
    near = np.maximum(np.minimum(soft * straight, room), 1e-9)
    over = np.maximum(wanted - now - (room - near), 0.0)
    longer: _Lengths = np.minimum(wanted - now, room - near) + near * -np.expm1(-over / near)
    return now + longer


def reach(
    hip: Floats, leg: Floats, target: Floats, hinge: Floats | None = None, soft: Floats | float = SOFT
) -> tuple[Floats, Floats]:
    """Return rotations [N, ..., 4] of thighs and shanks, in the world, that bring the legs' ends to their targets.

    The knee bends about its own axis until the end is as far from the hip as the target, by the law of cosines; the
    leg then turns the shortest way towards it. A leg that is too short falls smoothly short of the target.

    Args:
        hip: orientations of the hips in the world [N, ..., 4].
        leg: positions of hip, knee and end [N, ..., 3, 3], metres.
        target: positions for the end [N, ..., 3], metres.
        hinge: axis in the hip's frame about which each knee bends where the leg is all but straight [..., 3]; None for
            that of frames where it is not.
        soft: of the leg's length: this near to its full length it stretches less than it would have to [N, ...].

    Raises:
        ValueError: a leg or its target has no direction.
    """
    shape, usual = target.shape[:-1], usual_hinge(hip, leg, hinge)
    thigh, shank = np.empty((2, *shape, 4))
    _reach(
        np.ascontiguousarray(hip).reshape(-1, 4),
        np.ascontiguousarray(leg).reshape(-1, 3, 3),
        np.ascontiguousarray(target).reshape(-1, 3),
        np.ascontiguousarray(np.broadcast_to(usual, target.shape)).reshape(-1, 3),
        np.ascontiguousarray(np.broadcast_to(soft, shape)).reshape(-1),
        thigh.reshape(-1, 4),
        shank.reshape(-1, 4),
    )
    if not np.isfinite(thigh).all():
        raise ValueError("a leg, or the way to its target, has no direction")
    return thigh, shank


def usual_hinge(hip: Floats, leg: Floats, usual: Floats | None) -> Floats:
    """Return unit axes [..., 3] in the hip's frame about which knees bend where legs are all but straight.

    They are those given [..., 3] or, if there are none, those of other frames. Arguments are as for `reach`.
    """
    if usual is None:
        normal = rot.cross(leg[..., 1, :] - leg[..., 0, :], leg[..., 2, :] - leg[..., 1, :])
        usual = rot.mul_vec(rot.inv(hip), normal).sum(axis=0)
    straight = rot.norm(usual)[..., None] < 1e-9
    if straight.any():  # in all frames: the body axis most nearly at right angles to the thigh, made exactly so
        bone = rot.mul_vec(rot.inv(hip[0]), leg[0, ..., 1, :] - leg[0, ..., 0, :])
        across = np.eye(3)[np.argmin(np.abs(bone), axis=-1)]
        across -= bone * (np.sum(across * bone, axis=-1) / np.sum(bone * bone, axis=-1))[..., None]
        usual = np.where(straight, across, usual)
    return np.asarray(usual / rot.norm(usual)[..., None])


@jit
def _reach(
    hip: Floats, leg: Floats, target: Floats, usual: Floats, soft: Floats, thighs: Floats, shanks: Floats
) -> None:
    """Write what `reach` returns [N, 4], each: `usual` hinges [N, 3] are unit vectors in the hips' frames."""
    for n in range(len(leg)):
        places = vector(leg[n, 0]), vector(leg[n, 1]), vector(leg[n, 2])
        thighs[n], shanks[n] = _turns(rotation(hip[n]), places, vector(target[n]), vector(usual[n]), soft[n])


@jit
def _turns(
    hip: Rotation, places: tuple[Vector, Vector, Vector], target: Vector, usual: Vector, soft: float
) -> tuple[Rotation, Rotation]:
    """Return what `reach` does, of one leg."""
    start, middle, end = places
    thigh, shank, whole, aim = minus(middle, start), minus(end, middle), minus(end, start), minus(target, start)
    size = HINGE * (length(thigh) * length(shank))
    axis = unit(plus(cross(thigh, shank), turned(hip, usual), size))
    # Components along the axis do not change; across it, the bones and their angle form a triangle.
    along, further = dot(thigh, axis), dot(shank, axis)
    across, beyond = np.sqrt(dot(thigh, thigh) - along**2), np.sqrt(dot(shank, shank) - further**2)
    least, twice = (along + further) ** 2 + across**2 + beyond**2, 2.0 * across * beyond
    now, wanted = length(whole), length(aim)
    far = stretched(now, wanted, np.sqrt(least + twice), soft)
    was = np.arccos(min(max((now**2 - least) / twice, -1.0), 1.0))
    bend = about(axis, np.arccos(min(max((far**2 - least) / twice, -1.0), 1.0)) - was)
    turn = between(plus(thigh, turned(bend, shank), 1.0), aim)
    return turn, product(turn, bend)


@jit
def write_bent(
    out: Floats, world: Floats, places: Floats, chains: Ints, above: Ints, off: Floats, usual: Floats, soft: Floats
) -> None:
    """Write local rotations of legs whose ends are brought to other places, as `reach` does; feet keep orientations.

    Args:
        out: local rotations [N, J, 4], to be changed.
        world: orientations of the joints in the world [N, J, 4].
        places: of joints and tips [N, 2 J, 3], metres.
        chains: hip, knee and end of each leg [legs, 3], by their places.
        above: the joints that the hips hang from [legs].
        off: how far each end is to be from its place [N, legs, 3], metres.
        usual: unit axes in the hips' frames about which straight knees bend [legs, 3].
        soft: as for `reach` [N, legs].
    """
    for t in range(len(out)):
        for leg in range(len(chains)):
            hip, knee, end = chains[leg]
            points = vector(places[t, hip]), vector(places[t, knee]), vector(places[t, end])
            aim = plus(points[2], vector(off[t, leg]), 1.0)
            thigh, shank = _turns(rotation(world[t, hip]), points, aim, vector(usual[leg]), soft[t, leg])
            thigh, shank = product(thigh, rotation(world[t, hip])), product(shank, rotation(world[t, knee]))
            out[t, hip] = product(inverse(rotation(world[t, above[leg]])), thigh)
            out[t, knee] = product(inverse(thigh), shank)
            if end < world.shape[1]:
                out[t, end] = product(inverse(shank), rotation(world[t, end]))
