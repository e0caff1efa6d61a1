"""Joints' angles, compiled: twist about a joint's long axis, and swing, by which joints have degrees."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.geometry.compiled import from_axis_angle, log, mul
from motionmind.jit import jit


@jit
def swings_and_twists(turned: Floats, long: Ints, outer: Bools, rest: Floats, mirrored: Bools) -> Floats:
    """Return angles [N, J, 3] in radians about x, y and z of joints' rotations [N, J, 4].

    Args:
        turned: rotations in the joints' frames of reference, unit quaternions.
        long: axis of each joint's twist, 0, 1 or 2 [J].
        outer: whether the twist is applied after the swing [J].
        rest: radians about z from the rest pose to that of angles 0 [J].
        mirrored: whether the joint has the angles of its mirror image [J].
    """
    out = np.empty((len(turned), len(long), 3))
    for n in range(len(turned)):
        for joint in range(len(long)):
            (x, y, z, w), axis = turned[n, joint], long[joint]
            q = (x, -y, -z, w) if mirrored[joint] else (x, y, z, w)
            if rest[joint] != 0.0:
                q = mul(q, from_axis_angle((0.0, 0.0, 1.0), -rest[joint]))
            twist = 2.0 * np.arctan2(q[axis], q[3])
            twist -= 2.0 * np.pi * np.round(twist / (2.0 * np.pi))
            sine, cosine = np.sin(-0.5 * twist), np.cos(0.5 * twist)
            back = sine * (axis == 0), sine * (axis == 1), sine * (axis == 2), cosine
            swing = log(mul(back, q) if outer[joint] else mul(q, back))
            for k in range(3):
                out[n, joint, k] = swing[k]
            out[n, joint, axis] = twist
    return out


def find_beyond(angles: Floats, least: Floats, most: Floats) -> Bools:
    """Return which joints have an angle beyond its limits [N, J], of angles [N, J, 3] and their limits [J, 3]."""
    return np.asarray(((angles < least) | (angles > most)).any(axis=-1))
