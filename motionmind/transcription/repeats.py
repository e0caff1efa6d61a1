"""Find phrases that recur in a sequence of rows, and choose those whose names save the most rows.

A row is a *cell*, its posture, and a *move*, the way there. Both are numbers here, with the number of their mirror
image; nothing here knows about bodies. A phrase recurs where its cells do, or their mirror images. Its moves may
differ, and the calls of the phrase give them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from motionmind._typing import Ints

MAX_ROWS = 2_000  # in which phrases are sought: at worst 6 s
MAX_OPEN_MOVES = 20  # that a call gives, as many as a score's phrase may have open words


class Rows(NamedTuple):
    """A sequence of rows.

    Attributes:
        cells: number of each row's posture [K], not negative; -1 in a row that cannot be part of a phrase.
        images: number of its mirror image [K].
        moves: number of the move to each row [K].
        move_images: number of the move's mirror image [K].
    """

    cells: Ints
    images: Ints
    moves: Ints
    move_images: Ints


class Call(NamedTuple):
    """Rows that are written as a call of a phrase.

    Attributes:
        start: the first row.
        times: how often the phrase is played, one after the other.
        mirrored: whether it is played on the other side.
    """

    start: int
    times: int
    mirrored: bool


class Repeat(NamedTuple):
    """A phrase and its calls.

    Attributes:
        start: the row at which the phrase is first played, as written.
        length: number of its rows.
        calls: in order, without overlaps.
        open: the rows, counted from the phrase's first, whose moves the calls give.
        saved: rows that a score saves by the phrase: the calls' rows, less a line for each call, less the phrase's rows
            and its heading.
    """

    start: int
    length: int
    calls: tuple[Call, ...]
    open: tuple[int, ...]
    saved: int


def find_repeats(rows: Rows) -> list[Repeat]:
    """Return phrases that shorten a score, in the order of their first calls; no two calls overlap.

    Each phrase saves the most rows of all phrases in the rows that no earlier one calls; this is exact. Phrases are
    chosen one after another, since the best set of phrases is NP-hard to find (Charikar et al., "The smallest grammar
    problem", 2005). More than `MAX_ROWS` rows have no phrases.
    """
    if len(rows.cells) > MAX_ROWS:
        return []
    cells, found = rows.cells.copy(), list[Repeat]()
    while best := best_repeat(rows._replace(cells=cells)):
        found.append(best)
        for call in best.calls:
            cells[call.start : call.start + call.times * best.length] = -1
    return sorted(found, key=lambda repeat: repeat.calls[0].start)


def models_of(repeats: Sequence[Repeat]) -> dict[int, tuple[int, bool]]:
    """Return the row that each row of a later call repeats, and whether on the other side."""
    out = {}
    for repeat in repeats:
        for call in repeat.calls:
            for row in range(call.start, call.start + call.times * repeat.length):
                model = repeat.start + (row - call.start) % repeat.length
                if model != row:
                    out[row] = model, call.mirrored
    return out


def best_repeat(rows: Rows) -> Repeat | None:
    """Return the phrase that saves the most rows, with the calls that save the most; None if none saves any."""
    count, best = len(rows.cells), None
    # same[j]: rows from j on that equal those from i on; other[j]: that equal their mirror images.
    same, other = np.zeros(count + 1, dtype=np.int64), np.zeros(count + 1, dtype=np.int64)
    for i in range(count - 1, -1, -1):
        same[:-1] = np.where((rows.cells == rows.cells[i]) & (rows.cells >= 0), same[1:] + 1, 0)
        other[:-1] = np.where((rows.cells == rows.images[i]) & (rows.cells[i] >= 0), other[1:] + 1, 0)
        longest = np.maximum(same, other)[i:count]
        if longest[0] == 0 or np.count_nonzero(longest) == 1:
            continue
        # occurrences[n]: of the first n rows; they bound the rows saved.
        occurrences = np.cumsum(np.bincount(longest)[::-1])[::-1]
        lengths = np.arange(len(occurrences))
        most = np.minimum(occurrences * lengths, count - i) - 2 - lengths
        most[occurrences < 2] = 0
        for n in np.argsort(-most, kind="stable").tolist():
            if most[n] <= (best.saved if best else 0):
                break
            found = _best_calls(rows, i, n, same, other)
            if found and found.saved > (best.saved if best else 0):
                best = found
    return best


def _best_calls(rows: Rows, start: int, length: int, same: Ints, other: Ints) -> Repeat | None:
    """Return the phrase of `length` rows from `start` on with the calls that save the most rows.

    A shortest path from the last occurrence back: each is left out, or called once, or with its repetitions.

    Returns:
        None if no call saves a row, or the calls have too many open moves.
    """
    places = start + np.flatnonzero(np.maximum(same, other)[start:] >= length)
    # saved[j], step[j]: the most rows saved from the j-th place on, and how often its phrase is called.
    saved, step = [0] * (len(places) + 1), [0] * len(places)
    runs = dict[int, int]()
    for j in range(len(places) - 1, -1, -1):
        place = int(places[j])
        saved[j] = saved[j + 1]
        follows = place + length
        runs[place] = run = 1 + (runs[follows] if follows in runs and _plays_on(rows, place, length, same) else 0)
        for times in range(1, run + 1):
            total = times * length - 1 + saved[int(np.searchsorted(places, place + times * length))]
            if total > saved[j]:
                saved[j], step[j] = total, times
    calls, j = list[Call](), 0
    mirrored = same[places] < length
    while j < len(places):
        if step[j]:
            calls.append(Call(int(places[j]), step[j], bool(mirrored[j])))
            j = int(np.searchsorted(places, places[j] + step[j] * length))
        else:
            j += 1
    if not calls or calls[0].start != start:  # then the phrase from its first call on saves as much
        return None
    moves = np.array([(rows.move_images if call.mirrored else rows.moves)[call.start :][:length] for call in calls])
    opened = np.flatnonzero((moves != moves[0]).any(axis=0)).tolist()
    if len(opened) > MAX_OPEN_MOVES:
        return None
    return Repeat(start, length, tuple(calls), tuple(opened), saved[0] - length - 1)


def _plays_on(rows: Rows, place: int, length: int, same: Ints) -> bool:
    """Return whether `length` rows are played again right after themselves, on the same side, by the same moves."""
    follows = place + length
    return bool(
        (same[place] < length) == (same[follows] < length)
        and np.array_equal(rows.moves[place:follows], rows.moves[follows : follows + length])
    )
