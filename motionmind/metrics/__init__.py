"""Measures of movement: how far from the truth, how smooth, whether feet stay."""

from motionmind.metrics.feet import find_feet, find_floor, foot_slide, skating
from motionmind.metrics.inbetween import l2p, l2q, npss, position_spread, seen
from motionmind.metrics.smoothness import angular_jerk, angular_speed, sparc

__all__ = [
    "angular_jerk",
    "angular_speed",
    "find_feet",
    "find_floor",
    "foot_slide",
    "l2p",
    "l2q",
    "npss",
    "position_spread",
    "seen",
    "skating",
    "sparc",
]
