"""Forward kinematics, compiled: along a tree of joints, from the root outward."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.jit import jit


@jit
def turn_with_parents(rotations: Floats, parents: Ints) -> None:
    """Turn local rotations [N, J, 4] into those in the world, in place: each becomes its parent's times its own.

    Args:
        rotations: unit quaternions of the joints.
        parents: of the joints [J], each before its children; the first has none.
    """
    for t in range(len(rotations)):
        for joint in range(1, len(parents)):
            ax, ay, az, aw = rotations[t, parents[joint]]
            bx, by, bz, bw = rotations[t, joint]
            rotations[t, joint, 0] = aw * bx + ax * bw + ay * bz - az * by
            rotations[t, joint, 1] = aw * by - ax * bz + ay * bw + az * bx
            rotations[t, joint, 2] = aw * bz + ax * by - ay * bx + az * bw
            rotations[t, joint, 3] = aw * bw - ax * bx - ay * by - az * bz


@jit
def place_points(places: Floats, turned: Floats, joints: Ints, offsets: Floats) -> None:
    """Place points [N, P, 3] but for the first, which is in its place: each at an offset from its joint's own.

    Args:
        places: of the points, metres; the first J are the joints themselves.
        turned: orientations of the joints in the world [N, J, 4].
        joints: those in whose frames the points are [P], each before its points.
        offsets: places of the points in these frames [P, 3], metres.
    """
    for t in range(len(places)):
        for point in range(1, len(joints)):
            joint = joints[point]
            x, y, z, w = turned[t, joint]
            vx, vy, vz = offsets[point]
            # As in `rotations.mul_vec`.
            tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
            places[t, point, 0] = places[t, joint, 0] + (vx + w * tx + (y * tz - z * ty))
            places[t, point, 1] = places[t, joint, 1] + (vy + w * ty + (z * tx - x * tz))
            places[t, point, 2] = places[t, joint, 2] + (vz + w * tz + (x * ty - y * tx))


@jit
def write_lowest(lowest: Floats, turned: Floats, joints: Ints, offsets: Floats) -> None:
    """Write the heights [N] of the lowest of points, metres, that `place_points` places, over those of the first.

    Other arguments are as there.
    """
    heights = np.empty(len(joints))
    for t in range(len(lowest)):
        heights[0] = lowest[t]
        for point in range(1, len(joints)):
            joint = joints[point]
            x, y, z, w = turned[t, joint]
            vx, vy, vz = offsets[point]
            tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
            heights[point] = heights[joint] + (vy + w * ty + (z * tx - x * tz))
            lowest[t] = min(lowest[t], heights[point])


@jit
def weigh(places: Floats, turned: Floats, shares: Floats, centres: Floats, out: Floats) -> None:
    """Write the centres of mass [N, 3] of bodies, metres.

    Args:
        places: of the joints, and whatever points after them [N, P, 3], metres.
        turned: orientations of the joints in the world [N, J, 4].
        shares: of the body's mass that the joints' segments have [J].
        centres: of mass of the segments in the joints' frames [J, 3], metres.
        out: the centres of mass.
    """
    for t in range(len(places)):
        out[t] = 0.0
        for joint in range(len(shares)):
            x, y, z, w = turned[t, joint]
            vx, vy, vz = centres[joint]
            # As in `rotations.mul_vec`.
            tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
            out[t, 0] += shares[joint] * (places[t, joint, 0] + (vx + w * tx + (y * tz - z * ty)))
            out[t, 1] += shares[joint] * (places[t, joint, 1] + (vy + w * ty + (z * tx - x * tz)))
            out[t, 2] += shares[joint] * (places[t, joint, 2] + (vz + w * tz + (x * ty - y * tx)))
