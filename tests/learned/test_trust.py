"""Trust in walks: shares between 0 and 1, a table fitted to families of clips, and where it is kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionmind.learned import persistence
from motionmind.learned.trust import (
    DISTANCE_RATIOS,
    PRIOR_TRUST,
    ZERO_DISPLACEMENT_RAD,
    Squares,
    Trust,
    counts,
    fit_table,
)
from motionmind.tween.engine import Engine

SPREAD = np.array([0.8, 0.5])
ONES = Trust(np.ones(len(DISTANCE_RATIOS)), np.array([0.45]), SPREAD)


@given(st.lists(st.floats(0.0, 1.0), min_size=5, max_size=5), st.floats(0.0, np.pi), st.floats(0.0, np.pi))
def test_trust_is_a_share(table: list[float], off: float, way: float) -> None:
    shares = replace(ONES, table=np.array(table)).shares(np.full(2, off), np.full(2, way))
    assert np.all((shares >= 0.0) & (shares <= 1.0))


def test_entries_of_the_table_are_met_at_their_ratios() -> None:
    near = replace(ONES, table=np.array([0.9, 0.7, 0.4, 0.3, 0.1]), spread=np.array(np.inf))
    np.testing.assert_allclose(near.shares(0.2 * DISTANCE_RATIOS, np.full(5, 0.2)), near.table, atol=1e-12)


def test_trust_has_no_leaps() -> None:
    ways = np.geomspace(2.0 * ZERO_DISPLACEMENT_RAD, 3.0, 4000)
    shares = PRIOR_TRUST.shares(np.full(len(ways), 0.2), ways)
    assert np.abs(np.diff(shares)).max() < 0.01
    assert np.all(np.diff(shares) >= 0.0)
    offs = np.linspace(0.0, 1.0, 4000)
    assert (
        np.abs(np.diff(replace(PRIOR_TRUST, spread=np.array(0.8)).shares(offs, np.full(len(offs), 0.3)))).max() < 0.01
    )


def test_as_far_as_random_postures_are_from_each_other_nothing_is_trusted() -> None:
    """However far there is to go."""
    assert np.all(ONES.shares(SPREAD, np.full(2, 1e6)) == 0.0)
    assert np.all(ONES.shares(2.0 * SPREAD, np.full(2, 1e6)) == 0.0)
    np.testing.assert_allclose(ONES.shares(0.5 * SPREAD, np.full(2, 1e6)), 0.75, atol=1e-5)


def test_where_there_is_no_way_to_go_nothing_is_trusted() -> None:
    for off in (0.0, 0.3):
        assert np.all(ONES.shares(np.full(2, off), np.full(2, 0.5 * ZERO_DISPLACEMENT_RAD)) == 0.0)


# --- fitting ----------------------------------------------------------------------------------------------------------


def squares(share: float, seed: int, noise: float = 0.05, count: int = 40) -> Squares:
    """Windows in which so much of the walks' departure is true, but for noise."""
    rng = np.random.default_rng(seed)
    ratios = rng.uniform(0.0, 2.0, count)
    made = rng.normal(size=(count, 30))
    true = share * made + noise * rng.normal(size=made.shape)
    entries = counts(0.2 * ratios, np.full(count, 0.2), np.array(np.inf))
    return Squares(
        entries.T @ (np.sum(made**2, axis=1)[:, None] * entries),
        entries.T @ np.sum(made * true, axis=1),
        float(np.sum(true**2)),
    )


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_a_table_is_the_share_that_is_true(share: float) -> None:
    table = fit_table([squares(share, seed) for seed in range(8)], PRIOR_TRUST.table)
    np.testing.assert_allclose(table, share, atol=0.1)


def test_the_error_is_the_squared_distance() -> None:
    one = squares(0.6, 3)
    assert one.error(np.zeros(5)) == one.whole
    best = one.fitted(np.zeros(5), 1e-9)
    assert one.error(best) < one.error(best + 0.1)
    assert Squares.summed([one, one]).error(best) == pytest.approx(2.0 * one.error(best))


def test_one_family_and_families_that_disagree_tell_nothing() -> None:
    assert fit_table([], PRIOR_TRUST.table) is PRIOR_TRUST.table
    assert fit_table([squares(0.0, 1)], PRIOR_TRUST.table) is PRIOR_TRUST.table
    split = [squares(float(number % 2), number, noise=0.5, count=4) for number in range(4)]
    np.testing.assert_array_equal(fit_table(split, np.full(5, 0.5)), 0.5)


# --- on disk ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def engine() -> Engine:
    known = Engine.load("hands")
    trust = replace(known.statistics.trust, table=np.linspace(0.9, 0.1, 5), lasts=np.array([0.3]))
    return replace(known, statistics=replace(known.statistics, trust=trust))


def test_trust_is_kept_with_the_corpus(engine: Engine, tmp_path: Path, empty_cache: Path) -> None:
    persistence.save(engine, tmp_path / "kept")
    loaded = persistence.load(str(tmp_path / "kept")).statistics.trust
    for name in ("table", "lasts", "spread"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(engine.statistics.trust, name))
