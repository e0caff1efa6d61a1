"""Single messages, single moves of a polished path and matrices, against what they are defined as."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from toys import noisy_messages, random_toy, trellis_of

from motionmind.search import trws
from motionmind.search.costs import path_cost
from motionmind.search.csr import insert_entries, keep_entries, select_entries
from motionmind.search.polish import polish
from motionmind.search.trellis import Trellis, correction

MOVES = 4
ROUNDING = 1e-8


def toys(**kind: bool) -> list[tuple[int, Trellis]]:
    """Return trellises of toys that have a path, by their seeds."""
    seeds = range(30)
    return [
        (seed, trellis_of(toy, MOVES))
        for seed, toy in ((seed, random_toy(seed, **kind)) for seed in seeds)
        if np.isfinite(toy.optima(MOVES)[MOVES])
    ]


@pytest.mark.parametrize("dear", [False, True])
def test_messages_between_chains_are_minima_over_all_pairs(dear: bool) -> None:
    others = 0  # messages for which another position than the best of all is the best
    for seed, trellis in toys(dear=dear):
        rng = np.random.default_rng(seed)
        for i in range(trellis.chains, len(trellis.dom_ptr) - 1):
            parent = trellis.parents[i % trellis.chains]
            if parent < 0:
                continue
            own, above = (np.diff(trellis.dom_ptr)[k] for k in (i, i - i % trellis.chains + parent))
            first, rows = trellis.dom_ptr[i], trellis.up_ptr[i]
            pairs = np.array([[correction(trellis, rows + k, first + x) for x in range(own)] for k in range(above)])

            messages, theta = noisy_messages(trellis, seed, 5.0), rng.random(above)
            values = theta - messages.up_col[rows : rows + above]
            trws._send_down(trellis, messages, i, theta)
            expected = (values[:, None] + pairs).min(axis=0)
            assert np.array_equal(messages.down_col[first : first + own], expected - expected.min()), seed
            others += int(np.sum(expected > values.min() + 1e-12))

            messages, theta = noisy_messages(trellis, seed, 5.0), rng.random(own)
            values = theta - messages.down_col[first : first + own]
            trws._send_up(trellis, messages, i, theta)
            expected = (values + pairs).min(axis=1)
            assert np.array_equal(messages.up_col[rows : rows + above], expected - expected.min()), seed
            others += int(np.sum(expected > values.min() + 1e-12))
    assert (others > 0) == dear


@pytest.mark.parametrize("dear", [False, True])
def test_no_single_move_improves_a_polished_path(dear: bool) -> None:
    for seed, trellis in toys(dear=dear):
        messages, path = noisy_messages(trellis, seed, 5.0), np.zeros(len(trellis.dom_ptr) - 1, np.int64)
        path[: trellis.chains] = trellis.dom_ptr[: trellis.chains]
        trws.backward(trellis, messages)
        trws.descend(trellis, messages, path, trellis.chains)
        cost = polish(trellis, path, np.full(len(trellis.dom), -np.inf))
        for t in range(1, MOVES + 1):
            here, trial = np.arange(t * trellis.chains, (t + 1) * trellis.chains), path.copy()
            for positions in product(*(range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]) for i in here)):
                trial[here] = positions
                assert path_cost(trellis, trial) >= cost - ROUNDING, (seed, t)


def matrix(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a random matrix as compressed sparse rows."""
    rows = [np.flatnonzero(rng.random(7) < 0.4).astype(np.int32) for _ in range(6)]
    ptr, columns = np.cumsum([0, *map(len, rows)]), np.concatenate(rows)
    return ptr, columns, rng.random(len(columns))


def test_entries_are_inserted_where_they_belong() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        ptr, columns, costs = matrix(rng)
        rows = np.flatnonzero(rng.random(6) < 0.5)
        new = rng.integers(0, 7, len(rows)).astype(np.int32)
        at = np.array([ptr[row] + np.searchsorted(columns[ptr[row] : ptr[row + 1]], column) for row, column in
                       zip(rows, new, strict=True)], dtype=np.int64)  # fmt: skip
        found_ptr, found_columns, found_costs = insert_entries(ptr, columns, costs, rows, at, new, 9.0)
        assert np.array_equal(found_columns, np.insert(columns, at, new))
        assert np.array_equal(found_costs, np.insert(costs, at, 9.0))
        assert np.array_equal(np.diff(found_ptr), np.diff(ptr) + np.isin(np.arange(6), rows))


def test_entries_are_selected_by_rows_and_columns() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        ptr, columns, costs = matrix(rng)
        rows, kept = np.flatnonzero(rng.random(6) < 0.7), rng.random(7) < 0.6
        numbers = np.where(kept, np.cumsum(kept) - 1, -1).astype(np.int32)
        found_ptr, found_columns, found_costs = select_entries(
            ptr, columns, costs, rows, numbers, np.zeros(len(rows), np.int64)
        )
        for k, row in enumerate(rows):
            here, there = slice(ptr[row], ptr[row + 1]), slice(found_ptr[k], found_ptr[k + 1])
            among = kept[columns[here]]
            assert np.array_equal(found_columns[there], numbers[columns[here][among]])
            assert np.array_equal(found_costs[there], costs[here][among])
        assert found_ptr[-1] == len(found_columns) == len(found_costs)
        kept_ptr, kept_columns, kept_costs = keep_entries(ptr, columns, costs, rows, numbers)  # over the other matrix
        assert np.array_equal(kept_ptr, found_ptr)
        assert np.array_equal(kept_columns, found_columns)
        assert np.array_equal(kept_costs, found_costs)
