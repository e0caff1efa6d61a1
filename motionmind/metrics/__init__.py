"""Measures of movement: distance from the truth, smoothness, foot skating, likelihood, novelty and style."""

from motionmind._moved import renamed
from motionmind.body.contact import find_feet, find_floor, foot_slide, skating
from motionmind.metrics.inbetween import l2p, l2q, npss, position_spread, seen
from motionmind.metrics.paths import Habits, arrival_spread, arrivals, learn_habits
from motionmind.metrics.smoothness import angular_jerk, angular_speed, sparc
from motionmind.metrics.style import StyleClassifier, fit_style_classifier
from motionmind.metrics.verbatim import Phrasebook, learn_phrases

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
    "fit_style_classifier",
    "foot_slide",
    "l2p",
    "l2q",
    "learn_habits",
    "learn_phrases",
    "npss",
    "position_spread",
    "seen",
    "skating",
    "sparc",
]

__getattr__ = renamed(
    __name__,
    {
        "Judge": "StyleClassifier",
        "find_habits": "learn_habits",
        "find_judge": "fit_style_classifier",
        "find_phrases": "learn_phrases",
    },
)
