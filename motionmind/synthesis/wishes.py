"""Input of a motion besides its path: a style, learned from a corpus, and a request."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.motion import Posture, Velocity
from motionmind.corpus.corpus import Corpus
from motionmind.footing.corrections import Correction
from motionmind.footing.course import Course
from motionmind.grammar.grammar import Grammar
from motionmind.learned.posture_statistics import PostureStatistics
from motionmind.solver.reaches import Reach, Stay
from motionmind.synthesis.accent_times import Accents
from motionmind.walks.passages import Place


class Style(NamedTuple):
    """The style of a motion, learned from a corpus.

    Attributes:
        corpus: the corpus.
        grammar: its states and transitions.
        statistics: its posture statistics: travel and stance.
        tolerances: angle within which a state of each chain stands for an orientation [L], radians.
        fastest: greatest speeds of the joints, of turning and of travel [J + 2], as in `motionmind.learned.pace`, at a
            pace of 1; None for no bound. With a given length, slower parts give up time to meet them.
        peaks: function of a duration, seconds, and a pace that returns the bounds on the peaks of movement of that
            length [J + 4] (`motionmind.learned.pace.Pace.peaks_in`); None for no bounds.
        slides: greatest speed of a foot near the floor at a pace of 1, heights/s, in movement with `peaks`.
    """

    corpus: Corpus
    grammar: Grammar
    statistics: PostureStatistics
    tolerances: Floats
    fastest: Floats | None = None
    peaks: Callable[[float, float], Floats] | None = None
    slides: float = np.inf


class Wishes(NamedTuple):
    """The request for a motion, besides its path.

    Attributes:
        a: first posture.
        b: last posture.
        wished: chains that the request constrains at more than A and B [L].
        fixed: chains among them that must not move, not even for the feet [L].
        fps: frames a second; the motion is stretched by less than a frame so that `b` falls on one.
        length: duration, seconds; None for the typical duration of the corpus.
        through: postures on the way, by the number of moves that lead there, increasing.
        fixed_times: the times of some of them, seconds, by the same numbers.
        leaving: velocity at `a`; None where unknown.
        arriving: velocity at `b`; None where unknown.
        without: terms of the solve to leave out.
        pace: speed relative to the corpus; ignored if `length` is given.
        slows: whether the clock may slow down; if not, the given moves keep their durations.
        liveliness: 0 for the mean of walks, up to 1 for a passage of the corpus (`motionmind.walks.passages`).
        place: start of that passage in the corpus; None for any.
        reaches: places for joints at given times.
        accents: moments of greatest or least speed, in a movement of given length; None for none.
        route: points x, z of the path over the floor from `a` to `b` [P, 2], metres; None for any.
        stays: joints that keep their places for a while.
        course: where the body is, and how it faces, at which time of a given length; None for any.
    """

    a: Posture
    b: Posture
    wished: Bools
    fixed: Bools
    fps: float
    length: float | None = None
    through: Mapping[int, Posture] = MappingProxyType({})
    leaving: Velocity | None = None
    arriving: Velocity | None = None
    without: Collection[Correction] = ()
    pace: float = 1.0
    slows: bool = True
    liveliness: float = 0.5
    place: Place | None = None
    fixed_times: Mapping[int, float] = MappingProxyType({})
    reaches: Sequence[Reach] = ()
    route: Floats | None = None
    stays: Sequence[Stay] = ()
    accents: Accents | None = None
    course: Course | None = None

    @property
    def moving(self) -> tuple[bool, bool]:
        """Whether the velocity at the first and at the last posture is given."""
        return self.leaving is not None, self.arriving is not None
