"""Credits: shares of a movement, each with its clip, performer and corpus."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from motionmind.errors import MotionMindError

_SHARE_TOLERANCE = 1e-6  # of the sum of rounded shares in a file


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
        clip: the name of its clip, or of given movement, which has no corpus; "" for movement that the engine made and
            no clip attests.
        performer: the clip's performer; "" if unknown.
        corpus: the clip's corpus; "" for given movement, and for movement that no clip attests.
        title: of the corpus.
        author: of the corpus.
        source: of the corpus.
        licence: of the corpus; "" if it states none.

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
        """Whether the movement was given to the engine."""
        return bool(self.clip) and not self.corpus

    @property
    def is_engines(self) -> bool:
        """Whether the engine made it and no clip attests it."""
        return not self.clip and not self.corpus


def credit_clip(origin: Origin, clip: str, performer: str = "", share: float = 1.0) -> Credit:
    """Return the credit of a clip; the corpus's author replaces an unknown performer."""
    by = performer or origin.author
    return Credit(share, clip, by, origin.name, origin.title, origin.author, origin.source, origin.licence)


def add_up(parts: Iterable[Credit]) -> tuple[Credit, ...]:
    """Add up the credits of each clip and scale them to a sum of 1, the largest first.

    Args:
        parts: credits with shares in any unit, such as seconds, not negative.
    """
    totals: dict[Credit, float] = {}
    for credit in parts:
        one = replace(credit, share=0.0)
        totals[one] = totals.get(one, 0.0) + credit.share
    whole = math.fsum(totals.values())
    if whole <= 0.0:
        return ()
    shared = [replace(one, share=total / whole) for one, total in totals.items() if total > 0.0]
    # Rounded: the last bits of sums must not decide the order.
    return tuple(sorted(shared, key=lambda one: (-round(one.share, 9), one.corpus, one.clip, one.performer)))


def check_shares(parts: Sequence[Credit]) -> None:
    """Raise MotionMindError unless the shares are from 0 to 1 and add up to 1, or there are no credits."""
    shares = [credit.share for credit in parts]
    whole = math.fsum(shares)
    if parts and not (
        all(0.0 <= share <= 1.0 + _SHARE_TOLERANCE for share in shares) and abs(whole - 1.0) <= _SHARE_TOLERANCE
    ):
        raise MotionMindError(f"the shares of credits must be from 0 to 1 and add up to 1, not to {whole:.6g}")
