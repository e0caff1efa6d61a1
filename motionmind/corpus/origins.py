"""Where the clips of corpora that are mixed come from, and whether their licences let them be mixed."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

from motionmind.corpus.corpus import Corpus
from motionmind.credits.credit import Origin
from motionmind.credits.licences import find_conflicts
from motionmind.display import displayed
from motionmind.errors import MotionMindWarning


def gather_origins(corpora: Iterable[Corpus]) -> tuple[Origin, ...]:
    """Return where the clips of some corpora come from, each corpus once."""
    found = (origin for corpus in corpora for origin in corpus.clip_origins.values())
    return tuple({origin.name: origin for origin in found}.values())


def warn_of_licences(corpus: Corpus) -> None:
    """Warn if the licences of its parts stand against passing on what is made of a corpus."""
    licences = {displayed(origin.name): displayed(origin.licence) for origin in corpus.clip_origins.values()}
    if conflicts := find_conflicts(licences):
        warnings.warn("; ".join(conflicts), MotionMindWarning, stacklevel=3)
