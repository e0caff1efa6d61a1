"""Forecast how long a piece lasts once its seams are smoothed.

The engine determines the length of an insertion, in a search of about a second. The forecast takes the lengths that
the project has found, and elsewhere estimates (`motionmind.variation.insertion_times`) times the ratio of found to
estimated lengths so far. The ratio differs from movement to movement, so it is uncertain until some are found.
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import msgspec
import numpy as np

from motionmind.studio.asks import Ask
from motionmind.studio.neighbours import End, Seam
from motionmind.studio.piece import State
from motionmind.studio.sides import sides_of
from motionmind.studio.view import chosen_at, layout_of, state_of

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio

# Of 134 insertions in 32 variations of 6 clips of ballet and 2 of karate: found over estimated lengths.
USUAL_RATIO = 1.05
_SHARED_SPREAD_RATIO = 0.16  # standard deviation between clips
_SPREAD_RATIO = 0.2  # standard deviation within a clip
_PRIOR_S = 3.0  # estimated seconds that weigh as much as the usual ratio
_STANDARD_DEVIATIONS_RATIO = 1.64  # to each side, for nine outcomes of ten

# A limit of insertions holds for estimates times this: in the same variations the found lengths were up to 1.41 times
# the estimates.
CAUTION_RATIO = 1.45


class Forecast(msgspec.Struct, frozen=True):
    """The duration of a piece with all its insertions.

    Attributes:
        seconds: the expected duration.
        least: nine outcomes of ten are no shorter than this,
        most: and no longer than this.
        inserted: the expected share of insertions.
    """

    seconds: float
    least: float
    most: float
    inserted: float


class _Memory:
    """The estimates so far, and the lengths that were found in their places.

    Attributes:
        estimates: seconds, by the version of the corpus and both ends; 0 where the transition is not abrupt.
        found: estimated and found seconds, by the corpus and the question.
    """

    def __init__(self) -> None:
        self.estimates: dict[tuple[str, tuple[End, End]], float] = {}
        self.found: dict[tuple[str, str], tuple[float, float]] = {}


_memories: WeakKeyDictionary[Studio, _Memory] = WeakKeyDictionary()


def forecast(studio: Studio, state: State) -> Forecast:
    """Forecast the duration of a piece.

    Args:
        studio: the studio, whose project has the findings.
        state: the piece.

    Raises:
        MotionMindError: the corpus has another body, or a movement is missing.
    """
    project = studio.project
    memory = _memories.setdefault(studio, _Memory())
    seams = [seam for seam in state.seams if not seam.goes_on]
    measured = [seam for seam in (*project.state.seams, *seams) if _length(studio, seam) is not None]
    unknown = [
        seam for seam in seams if state_of(seam, project.finding(seam)) in ("waiting", "abrupt") and _is_open(seam)
    ]
    _estimate(studio, memory, [*measured, *unknown])
    corpus = state.corpus
    for seam in measured:
        if (estimate := memory.estimates[_key(studio, seam)]) and (length := _length(studio, seam)):
            memory.found[corpus, project.question(seam)] = estimate, length
    ratio, spread = _ratio([one for (name, _), one in memory.found.items() if name == corpus])

    layout = layout_of(state, project.finding, project.marks, project.standing)
    total, inserted = layout.seconds, 0.0
    for seam, part in zip(state.seams, layout.insertions, strict=True):
        inserted += _times(seam) * part.seconds if part is not None else 0.0
    estimates, awaited = [], {seam.pair for seam in unknown}
    for place, seam in enumerate(state.seams):
        if seam.pair in awaited and layout.insertions[place] is None:
            begin, end = layout.gaps[place]  # an insertion takes its place
            wanted, estimate = seam.verdict.ask.seconds, memory.estimates[_key(studio, seam)]
            for _ in range(_times(seam)):
                if wanted is not None:
                    total, inserted = total + wanted - (end - begin), inserted + wanted
                elif estimate:
                    total -= end - begin
                    estimates.append(estimate)
    more = ratio * sum(estimates)
    deviation = ratio * float(np.hypot(spread * sum(estimates), _SPREAD_RATIO * np.linalg.norm(estimates)))
    total, inserted = total + more, inserted + more
    margin = min(_STANDARD_DEVIATIONS_RATIO * deviation, more)
    return Forecast(total, total - margin, total + margin, inserted / total if total else 0.0)


def _ratio(found: list[tuple[float, float]]) -> tuple[float, float]:
    """Return the expected ratio of found to estimated lengths, and its relative standard deviation.

    Args:
        found: estimated and found seconds.
    """
    estimated, actual = (sum(pair[side] for pair in found) for side in (0, 1))
    weight = _PRIOR_S + estimated
    return (_PRIOR_S * USUAL_RATIO + actual) / weight, _SHARED_SPREAD_RATIO * float(np.sqrt(_PRIOR_S / weight))


def _length(studio: Studio, seam: Seam) -> float | None:
    """Return the duration of the insertion that was found at a seam without wishes; None if there is none."""
    found = chosen_at(seam, studio.project.finding(seam))
    return found.seconds if found is not None and seam.verdict.ask == Ask() else None


def _times(seam: Seam) -> int:
    """Return how many times a seam comes."""
    return seam.left.repeats - 1 if seam.left is seam.right else 1


def _is_open(seam: Seam) -> bool:
    return seam.verdict.decision != "discarded"


def _key(studio: Studio, seam: Seam) -> tuple[str, tuple[End, End]]:
    corpus = studio.project.corpus_at(seam)
    return studio.project.versions.get(corpus, corpus), seam.ends


def _estimate(studio: Studio, memory: _Memory, seams: list[Seam]) -> None:
    """Estimate the insertions at seams that are not estimated yet."""
    from motionmind.variation.insertion_times import estimate_pairs
    from motionmind.variation.seams import TransitionTest

    project = studio.project
    for corpus in {project.corpus_at(seam) for seam in seams}:
        new = {_key(studio, seam): seam for seam in seams if project.corpus_at(seam) == corpus}
        new = {key: seam for key, seam in new.items() if key not in memory.estimates}
        if not new:
            continue
        facing = project.movements.facing(corpus)
        sides = [sides_of(seam.ends, project.movements.get, facing) for seam in new.values()]
        found = estimate_pairs([(one.a, one.b, one.seconds) for one in sides], TransitionTest(studio.engine(corpus)))
        memory.estimates |= dict(zip(new, found.tolist(), strict=True))
