"""Measures of movement: how far from the truth, how smooth, whether feet stay, how likely, how new, in whose style."""

from motionmind.body.contact import find_feet, find_floor, foot_slide, skating
from motionmind.metrics.inbetween import l2p, l2q, npss, position_spread, seen
from motionmind.metrics.paths import Habits, arrival_spread, arrivals, find_habits
from motionmind.metrics.smoothness import angular_jerk, angular_speed, sparc
from motionmind.metrics.style import StyleClassifier, fit_style_classifier
from motionmind.metrics.verbatim import Phrasebook, find_phrases

__all__ = [
    "Habits",
    "Phrasebook",
    "StyleClassifier",
    "angular_jerk",
    "angular_speed",
    "arrival_spread",
    "arrivals",
    "find_feet",
    "find_floor",
    "find_habits",
    "find_phrases",
    "fit_style_classifier",
    "foot_slide",
    "l2p",
    "l2q",
    "npss",
    "position_spread",
    "seen",
    "skating",
    "sparc",
]
