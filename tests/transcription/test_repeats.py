"""Phrases that recur: against all choices on small sequences, and calls that play the rows back."""

from __future__ import annotations

from itertools import product

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind.transcription.repeats import MAX_OPEN_MOVES, Repeat, Rows, best_repeat, find_repeats

IMAGES = np.array([1, 0, 2, 3])  # cells 0 and 1 are mirror images of each other, 2 and 3 of themselves


def rows_of(cells: list[int], moves: list[int]) -> Rows:
    own, how = np.array(cells, dtype=np.int64), np.array(moves, dtype=np.int64)
    return Rows(own, IMAGES[own], how, IMAGES[how])


sequences = st.lists(st.tuples(st.integers(0, 3), st.sampled_from([2, 2, 2, 3, 0, 1])), min_size=1, max_size=9).map(
    lambda pairs: rows_of([cell for cell, _ in pairs], [move for _, move in pairs])
)


def played(rows: Rows, repeat: Repeat) -> list[tuple[int, list[tuple[int, int]]]]:
    """Return where each call begins and the rows it plays. Moves are the phrase's, unless the call gives its own."""
    out = []
    first = repeat.calls[0]
    for call in repeat.calls:
        own = []
        for r in range(repeat.length):
            cell = (rows.images if call.mirrored else rows.cells)[repeat.start + r]
            if r in repeat.open:
                move = rows.moves[call.start + r]
            else:
                move = (rows.move_images if call.mirrored else rows.moves)[first.start + r]
            own.append((int(cell), int(move)))
        out.append((call.start, own * call.times))
    return out


def check(rows: Rows, found: list[Repeat]) -> None:
    covered = np.zeros(len(rows.cells), dtype=np.int64)
    for repeat in found:
        lines = 0
        for start, own in played(rows, repeat):
            here = slice(start, start + len(own))
            assert own == list(zip(rows.cells[here].tolist(), rows.moves[here].tolist(), strict=True))
            covered[here] += 1
            lines += 1
        assert repeat.saved == sum(call.times * repeat.length for call in repeat.calls) - lines - repeat.length - 1 > 0
    assert covered.max(initial=0) <= 1


def most_saved(rows: Rows) -> int:
    """The most rows that one phrase saves, by trying all phrases and all choices of what to call."""
    count, best = len(rows.cells), 0
    cells, images, moves = (each.tolist() for each in rows[:3])
    for start, length in product(range(count), range(1, count + 1)):
        phrase, image = cells[start : start + length], images[start : start + length]
        if len(phrase) < length:
            continue

        def side(place: int, phrase: list[int] = phrase, image: list[int] = image) -> int | None:
            here = cells[place : place + len(phrase)]
            return 0 if here == phrase else 1 if here == image else None

        def lines(place: int, last: object = None, length: int = length, side: object = side) -> int:
            """Fewest lines from a place on; a call that continues `last` adds none."""
            if place >= count:
                return 0
            fewest = 1 + lines(place + 1)
            own = side(place)  # type: ignore[operator]
            if own is not None:
                call = own, moves[place : place + length]
                fewest = min(fewest, (call != last) + lines(place + length, call))
            return fewest

        best = max(best, count - lines(0) - length - 1)
    return best


@settings(max_examples=300, deadline=None)
@given(sequences)
def test_no_phrase_saves_more_rows(rows: Rows) -> None:
    found = best_repeat(rows)
    assert (found.saved if found else 0) == most_saved(rows)
    check(rows, [found] if found else [])


@settings(max_examples=200, deadline=None)
@given(sequences, st.integers(1, 4))
def test_calls_play_the_rows(rows: Rows, times: int) -> None:
    long = Rows(*(np.tile(each, times) for each in rows))
    check(long, find_repeats(long))


def test_verse_and_chorus_are_found() -> None:
    rng = np.random.default_rng(1)
    verse, chorus = rng.integers(10, 1000, 12), rng.integers(1000, 2000, 9)
    images = np.arange(4000) ^ 2048  # 2048 and more are the other side
    song = np.concatenate([[1], verse, [2], chorus, verse, chorus, images[chorus], [3]])
    still = np.zeros(len(song), dtype=np.int64)
    found = find_repeats(Rows(song, images[song], still, still))
    assert [(repeat.length, [call[1:] for call in repeat.calls]) for repeat in found] == [
        (12, [(1, False), (1, False)]),
        (9, [(1, False), (1, False), (1, True)]),
    ]


def test_what_recurs_in_another_rhythm_gives_its_moves() -> None:
    phrase = np.arange(8)
    moves = np.zeros(24, dtype=np.int64)
    moves[[9, 12]] = 1, 2
    cells = np.tile(phrase, 3)
    (found,) = find_repeats(Rows(cells, cells + 100, moves, moves))
    assert found.open == (1, 4)
    assert [(call.start, call.times) for call in found.calls] == [(0, 1), (8, 1), (16, 1)]
    assert found.saved == 24 - 3 - 8 - 1


def test_more_moves_than_a_phrase_can_leave_open_are_not_given() -> None:
    phrase = np.arange(MAX_OPEN_MOVES + 5)
    cells, moves = np.tile(phrase, 2), np.arange(2 * len(phrase))
    found = find_repeats(Rows(cells, cells + 100, moves, moves))
    assert max(len(repeat.open) for repeat in found) == MAX_OPEN_MOVES
