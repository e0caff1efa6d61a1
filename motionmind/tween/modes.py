"""Named passages, and a search for different passages from A to B: the first alternatives to a movement."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion, Velocity
from motionmind.corpus.corpus import Corpus
from motionmind.display import displayed
from motionmind.errors import MotionMindError, did_you_mean
from motionmind.geometry.splines import rotation_spline
from motionmind.learned.model import LearnedCorpus
from motionmind.walks.modes import find_modes
from motionmind.walks.passages import Place
from motionmind.walks.stops import stop_at

N_COMPARED = 11  # postures, evenly spaced in time, for comparing movements
_PASSAGE = re.compile(r"(.+)@(\d+(?:\.\d*)?|\.\d+)s?", re.ASCII | re.DOTALL)


def find_place(corpus: Corpus, passage: str) -> Place:
    """Return the place of a named passage, such as "adagio@3.2s".

    Raises:
        MotionMindError: the name is malformed, the corpus has no such clip, or the time lies outside the clip.
    """
    found = _PASSAGE.fullmatch(passage)
    if found is None:
        raise MotionMindError(f"passage {displayed(passage)}: give a clip and a time in it, such as adagio@3.2s")
    label, seconds = found[1], float(found[2])
    try:
        clip = corpus.clip_labelled(label)
    except KeyError:
        near = did_you_mean(label, (clip.label for clip in corpus.clips))
        raise MotionMindError(
            f"passage {displayed(passage)}: {displayed(corpus.name)} has no such clip{near}"
        ) from None
    begin, end = corpus.times[clip.start], corpus.times[clip.stop - 1]
    if not begin - 1e-3 <= seconds <= end + 1e-3:  # names are rounded to milliseconds
        raise MotionMindError(
            f"passage {displayed(passage)}: the clip lasts from {begin:.2f} s to {end:.2f} s of its recording"
        )
    return Place(int(np.searchsorted(corpus.columns.starts, clip.start)), seconds)


class Modes:
    """Passages from A to B, each different from all movements known so far.

    Args:
        learned: the corpus.
        first: a known movement from A to B.
        leaves: whether the velocity at A is given.
        arrives: whether the velocity at B is given.
    """

    def __init__(self, learned: LearnedCorpus, first: Motion, leaves: bool, arrives: bool) -> None:
        self._corpus = learned.corpus
        self._known: list[Floats] = []
        self.know(first)
        stops = (
            stop_at(learned.corpus, first.posture(0), Velocity.at_start(first) if leaves else None),
            stop_at(learned.corpus, first.posture(-1), Velocity.at_end(first) if arrives else None),
        )
        seconds = float(first.times[-1] - first.times[0])
        self._places = find_modes(learned.corpus, learned.statistics, stops, seconds, self._known)

    def know(self, motion: Motion) -> None:
        """Add a movement to the known ones."""
        times = np.linspace(motion.times[0], motion.times[-1], N_COMPARED)
        chains = self._corpus.to_chains(rotation_spline(motion.times, motion.rotations, times))
        self._known.append(chains[:, : len(motion.skeleton)])

    def __iter__(self) -> Iterator[str]:
        """Yield the passages' names, as `find_place` takes them."""
        for place in self._places:
            yield f"{self._corpus.clips[place.clip].label}@{place.seconds:.3f}s"
