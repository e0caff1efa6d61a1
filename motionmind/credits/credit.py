"""Credits: shares of a movement, each with the clip, the performer and the corpus that it is made of."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from motionmind.errors import MotionMindError

_ROUNDING = 1e-6  # of shares that a file holds, in sum


@dataclass(frozen=True)
class Origin:
    """Where a corpus comes from; attributes as in Corpus."""

    name: str
    title: str = ""
    author: str = ""
    source: str = ""
    licence: str = ""
    citation: str = ""


@dataclass(frozen=True)
class Credit:
    """A share of a movement.

    Attributes:
        share: from 0 to 1; all credits of a movement add up to 1.
        clip: the name of the clip that it is made of; of the given movement, where there is no corpus; "" for what the
            engine made and no clip attests.
        performer: who performs the clip; "" where that is not known.
        corpus: the corpus that the clip comes from; "" for given movement, and for what no clip attests.
        title: of the corpus.
        author: of the corpus.
        source: of the corpus.
        licence: of the corpus; "" where none is stated.

    >>> from motionmind.credits import Credit
    >>> Credit(0.75, "plies", performer="Ada", corpus="ballet", licence="CC0-1.0").share
    0.75
    """

    share: float
    clip: str = ""
    performer: str = ""
    corpus: str = ""
    title: str = ""
    author: str = ""
    source: str = ""
    licence: str = ""

    @property
    def is_given(self) -> bool:
        """Whether the movement was given, and the engine made nothing of it."""
        return bool(self.clip) and not self.corpus

    @property
    def is_engines(self) -> bool:
        """Whether the engine made it and no clip attests it."""
        return not self.clip and not self.corpus


def credit_clip(origin: Origin, clip: str, performer: str = "", share: float = 1.0) -> Credit:
    """Return the credit of a clip; where its performer is not known, that of the corpus's author."""
    by = performer or origin.author
    return Credit(share, clip, by, origin.name, origin.title, origin.author, origin.source, origin.licence)


def add_up(parts: Iterable[Credit]) -> tuple[Credit, ...]:
    """Return credits with those of the same clip added up and all scaled to a sum of 1, the largest first.

    Args:
        parts: credits whose shares are in any unit, such as seconds; none is negative.
    """
    totals: dict[Credit, float] = {}
    for credit in parts:
        one = replace(credit, share=0.0)
        totals[one] = totals.get(one, 0.0) + credit.share
    whole = math.fsum(totals.values())
    if whole <= 0.0:
        return ()
    shared = [replace(one, share=total / whole) for one, total in totals.items() if total > 0.0]
    # Rounded, so that the last bits of sums do not decide.
    return tuple(sorted(shared, key=lambda one: (-round(one.share, 9), one.corpus, one.clip, one.performer)))


def check_shares(parts: Sequence[Credit]) -> None:
    """Raise MotionMindError unless the shares are from 0 to 1 and add up to 1; no credits at all are right, too."""
    shares = [credit.share for credit in parts]
    whole = math.fsum(shares)
    if parts and not (all(0.0 <= share <= 1.0 + _ROUNDING for share in shares) and abs(whole - 1.0) <= _ROUNDING):
        raise MotionMindError(f"the shares of credits must be from 0 to 1 and add up to 1, not to {whole:.6g}")
