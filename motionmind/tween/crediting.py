"""Credits of a tween, from the places in the corpus that its moves and its fine detail were found at."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from motionmind._typing import Floats
from motionmind.corpus.corpus import Corpus
from motionmind.credits.credit import Credit, add_up
from motionmind.tween.certificate import Source


def credit_tween(
    corpus: Corpus, sources: Sequence[Iterable[Source | None]], detail: Sequence[Source], times: Floats
) -> tuple[Credit, ...]:
    """Credit the clips that a tween is made of, by the time that each joint spends in moves that they attest.

    The fine detail counts as one more joint. The time of moves that no clip attests is the engine's.

    Args:
        corpus: what was searched.
        sources: a place that attests each joint's move, or None [T][L].
        detail: where the detail was recorded, for even parts of the tween's time.
        times: of the moves [T + 1], seconds.

    Returns:
        The credits, the largest first; none where nothing moves.
    """
    seconds = np.diff(times)
    shares = [_credit(corpus, source, float(s)) for row, s in zip(sources, seconds, strict=True) for source in row]
    shares += [_credit(corpus, source, float(seconds.sum()) / len(detail)) for source in detail]
    return add_up(shares)


def _credit(corpus: Corpus, source: Source | None, share: float) -> Credit:
    """Return so large a share for the clip of a source; for the engine where there is none."""
    if source is None:
        return Credit(share)
    return replace(corpus.credit_of(corpus.clips_by_name[source.corpus, source.clip]), share=share)
