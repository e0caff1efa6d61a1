"""Forward kinematics, compiled: along a tree of joints, from the root outward."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.geometry.compiled import mul, mul_vec
from motionmind.jit import jit


@jit
def turn_with_parents(rotations: Floats, parents: Ints) -> None:
    """Convert local rotations [N, J, 4] to world rotations in place: multiply each by its parent's.

    Args:
        rotations: unit quaternions of the joints.
        parents: parents of the joints [J], each before its children; the first has none.
    """
    for t in range(len(rotations)):
        for joint in range(1, len(parents)):
            turned = mul(rotations[t, parents[joint]], rotations[t, joint])
            for k in range(4):
                rotations[t, joint, k] = turned[k]


@jit
def place_points(places: Floats, turned: Floats, joints: Ints, offsets: Floats) -> None:
    """Place all points [N, P, 3] but the first, which is given: each at an offset from its joint.

    Args:
        places: positions of the points, metres; the first J are the joints themselves.
        turned: orientations of the joints in the world [N, J, 4].
        joints: the joint in whose frame each point is [P]; joints come before their points.
        offsets: positions of the points in these frames [P, 3], metres.
    """
    for t in range(len(places)):
        for point in range(1, len(joints)):
            joint = joints[point]
            offset = mul_vec(turned[t, joint], offsets[point])
            for k in range(3):
                places[t, point, k] = places[t, joint, k] + offset[k]


@jit
def write_lowest(lowest: Floats, turned: Floats, joints: Ints, offsets: Floats) -> None:
    """Write the heights [N] of the lowest points of `place_points`, metres, over those of the first points.

    Other arguments are as there.
    """
    heights = np.empty(len(joints))
    for t in range(len(lowest)):
        heights[0] = lowest[t]
        for point in range(1, len(joints)):
            joint = joints[point]
            heights[point] = heights[joint] + mul_vec(turned[t, joint], offsets[point])[1]
            lowest[t] = min(lowest[t], heights[point])


@jit
def weigh(places: Floats, turned: Floats, shares: Floats, centres: Floats, out: Floats) -> None:
    """Write the centres of mass [N, 3] of bodies, metres.

    Args:
        places: positions of the joints, then of any other points [N, P, 3], metres.
        turned: orientations of the joints in the world [N, J, 4].
        shares: the segments' shares of the body's mass [J].
        centres: centres of mass of the segments in the joints' frames [J, 3], metres.
        out: the centres of mass.
    """
    for t in range(len(places)):
        out[t] = 0.0
        for joint in range(len(shares)):
            centre = mul_vec(turned[t, joint], centres[joint])
            for k in range(3):
                out[t, k] += shares[joint] * (places[t, joint, k] + centre[k])
