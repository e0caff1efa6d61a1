"""Credits of a tween, from the places in the corpus that its moves and its passage were found at."""

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

    The passage that the tween is danced like counts as one more joint. The time of moves that no clip attests is the
    engine's.

    Args:
        corpus: what was searched.
        sources: a place that attests each joint's move, or None [T][L].
        detail: places of the passage, for even parts of the tween's time.
        times: of the moves [T + 1], seconds.

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
    """Return so large a share for a clip, by its corpus and its name; for the engine where there is none."""
    if clip is None:
        return Credit(share)
    return replace(corpus.credit_of(corpus.clips_named(*clip)[-1]), share=share)
