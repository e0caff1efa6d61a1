"""Choose the fewest key frames between which every frame is followed: a shortest path over frames.

The problem says between which keys a frame is followed; nothing here knows about bodies.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from motionmind._typing import Bools, Floats, Ints

N_STARTS = 256  # whose steps are tested together, to bound the memory
_EARLY_SHARES = (0.5, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875)  # of a step: most long steps fail at one of these frames

# Whether movement from key `start` to key `end` follows frame `at`: three arrays of frames [N] -> [N].
Follows = Callable[[Ints, Ints, Ints], Bools]


def fewest_keys(count: int, longest: int, follows: Follows, weights: Floats, shortest: int = 1) -> Ints:
    """Return the fewest key frames, the first and the last frame among them, between which all frames are followed.

    A step over `shortest` frames is always allowed, as is one over fewer than twice as many to the last frame; frames
    within it may then not be followed. Of the choices with the fewest keys, one with the fewest frames that are not
    followed is returned, and of these the one whose keys weigh least. All are exact: dynamic programming over the graph
    of all steps.

    Args:
        count: number of frames, at least 1.
        longest: the most frames that a step spans.
        follows: whether a step follows a frame within it.
        weights: of each frame as a key [count], not negative.
        shortest: the fewest frames that a step spans, unless there are fewer in all.
    """
    steps = _steps(count, longest, follows, shortest)
    # total[t]: the fewest keys up to t, then the fewest frames not followed, then the least weight; one number, for all
    # weights together are below a frame, and all frames below a key.
    key = 1.0 + weights / ((float(weights.sum()) + 1.0) * (count + 1.0))
    total, before = np.full(count, np.inf), np.zeros(count, dtype=np.int64)
    total[0] = key[0]
    for t in range(1, count):
        spans, missed = steps[t]
        if len(spans) == 0:
            continue
        costs = total[t - spans] + missed / (count + 1.0)
        best = int(costs.argmin())
        total[t], before[t] = costs[best] + key[t], t - spans[best]
    keys = [count - 1]
    while keys[-1]:
        keys.append(int(before[keys[-1]]))
    return np.array(keys[::-1])


def _steps(count: int, longest: int, follows: Follows, shortest: int) -> list[tuple[Ints, Ints]]:
    """Return, for each frame, the spans of the steps that may end there, and how many frames each does not follow."""
    span_range = np.arange(shortest + 1, longest + 1)
    ending: list[list[int]] = [[] for _ in range(count)]
    for first in range(0, count, N_STARTS):
        starts = np.arange(first, min(first + N_STARTS, count))
        start, span = np.repeat(starts, len(span_range)), np.tile(span_range, len(starts))
        inside = start + span < count
        start, span = start[inside], span[inside]
        for share in _EARLY_SHARES:
            kept = follows(start, start + span, start + np.clip(np.round(share * span).astype(np.int64), 1, span - 1))
            start, span = start[kept], span[kept]
        for offset in range(1, longest):
            long = np.flatnonzero(span > offset)
            if len(long) == 0:
                break
            kept = np.ones(len(span), dtype=np.bool_)
            kept[long] = follows(start[long], (start + span)[long], start[long] + offset)
            start, span = start[kept], span[kept]
        for end, one in zip((start + span).tolist(), span.tolist(), strict=True):
            ending[end].append(one)
    always = [[shortest] if end >= shortest else [] for end in range(count)]
    always[-1] = list(range(min(shortest, count - 1), min(2 * shortest, count)))
    ends = np.repeat(np.arange(count), list(map(len, always)))
    free = np.concatenate([np.array(spans, dtype=np.int64) for spans in always])
    missed = np.zeros(len(free), dtype=np.int64)
    for offset in range(1, int(free.max(initial=1))):
        within = np.flatnonzero(free > offset)
        start = ends[within] - free[within]
        missed[within] += ~follows(start, ends[within], start + offset)
    out, place = list[tuple[Ints, Ints]](), 0
    for allowed, spans in zip(always, ending, strict=True):
        lost = np.zeros(len(allowed) + len(spans), dtype=np.int64)
        lost[: len(allowed)] = missed[place : place + len(allowed)]
        place += len(allowed)
        out.append((np.array([*allowed, *spans], dtype=np.int64), lost))
    return out
