"""Weights of the solve: the standard deviation of each term, for a body the size of a person."""

from __future__ import annotations

from typing import NamedTuple


class Weights(NamedTuple):
    """Standard deviations of the terms, chosen on cmu-05 and indian, far pairs of `experiments/synthesis`.

    Attributes:
        pelvis, trunk, arm, hip, knee, foot: departure of these joints from the reference, radians.
        wished: the same of joints that a request constrains.
        root_level, root_height: departure of the root from where the feet alone put it, metres.
        root_s, trunk_s, arms_s, legs_s: time over which these departures come and go, seconds.
        push_level, push_vertical: acceleration of the centre of mass in stance, m/s^2.
        falls: departure from free fall in flight, m/s^2.
        floor: depth in the floor, metres.
        limits: excess over a joint's limits, radians.
        balance: excess distance from the support, metres.
        room: allowed distance of the zero-moment point: half a foot's width, because points lie on its midline.
        collision: excess overlap of two limbs, metres.
        touches: overlap that any two limbs are allowed, metres.
        speed: excess angular speed of a joint, rad/s.
        travel: excess speed of the root, m/s.
        pushes: excess acceleration of the root, m/s^2.
        reach: distance of a joint from its place in a reach, metres.
        reach_pull: distance beyond which the pull there is constant, metres.
        route: excess distance of the root from a drawn path, metres.
        route_pull: excess beyond which the pull there is constant, metres.
        reach_s: time over which a reaching arm departs from the reference and returns, seconds.
    """

    pelvis: float = 0.08
    trunk: float = 0.09
    arm: float = 0.12
    hip: float = 0.25
    knee: float = 0.2
    foot: float = 0.3
    wished: float = 0.01
    root_level: float = 0.5
    root_height: float = 0.2
    root_s: float = 0.1
    trunk_s: float = 0.2
    arms_s: float = 0.1
    legs_s: float = 0.06
    push_level: float = 3.0
    push_vertical: float = 6.0
    falls: float = 0.15
    floor: float = 0.0007
    limits: float = 0.03
    balance: float = 0.005
    room: float = 0.04
    collision: float = 0.0025
    touches: float = 0.005
    speed: float = 0.03
    travel: float = 0.02
    pushes: float = 0.2
    reach: float = 0.001
    reach_pull: float = 0.005
    route: float = 0.005
    route_pull: float = 0.1
    reach_s: float = 0.2


WEIGHTS = Weights()
