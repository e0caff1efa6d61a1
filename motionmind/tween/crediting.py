"""Credits of a tween, from the sources of its moves and its passage in the corpus."""

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
    """Credit each clip in a tween with the time that the joints spend in moves that the clip attests.

    The passage that the tween follows counts as one more joint. The engine gets the time of unattested moves.

    Args:
        corpus: the corpus that was searched.
        sources: a place that attests each joint's move, or None [T][L].
        detail: places of the passage, at equal intervals of the tween.
        times: times of the moves [T + 1], seconds.

    Returns:
        The credits, the largest first; none where nothing moves.
    """
    seconds = np.diff(times)
    shares: list[tuple[Source | None, float]]
    shares = [(source, float(lasts)) for row, lasts in zip(sources, seconds, strict=True) for source in row]
    shares += [(source, float(seconds.sum()) / len(detail)) for source in detail]
    spent: dict[tuple[str, str] | None, float] = {}  # by corpus and clip; None for the engine
    for source, share in shares:
        clip = None if source is None else (source.corpus, source.clip)
        spent[clip] = spent.get(clip, 0.0) + share
    return add_up(_credit(corpus, clip, share) for clip, share in spent.items())


def _credit(corpus: Corpus, clip: tuple[str, str] | None, share: float) -> Credit:
    """Return a credit of this share for a clip, given as (corpus, name), or for the engine if `clip` is None."""
    if clip is None:
        return Credit(share)
    return replace(corpus.credit_of(corpus.clips_named(*clip)[-1]), share=share)
