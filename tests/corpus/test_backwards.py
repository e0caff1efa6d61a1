"""Laws of corpora that are learned backwards, too, at a price."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from walks import (
    PRICES,
    WALKS,
    assert_rows_sum_to_one,
    counted,
    expected,
    few,
    learned,
    walk,
    weights,
)


def backwards(walks: Sequence[Sequence[int]], price: float) -> dict[tuple[int, int], float]:
    """Counts of what was made, and of the way back at exp(-price)."""
    counts: dict[tuple[int, int], float] = defaultdict(float)
    for (before, after), number in counted(walks).items():
        counts[before, after] += number
        counts[after, before] += number * math.exp(-price)
    return counts


@given(walks=WALKS, price=PRICES)
@few
def test_the_way_back_is_attested_and_rows_sum_to_one(walks: list[list[int]], price: float) -> None:
    clips = [walk(f"clip{i}", states) for i, states in enumerate(walks)]
    forth, both = learned(clips), learned(clips, reverse=price)
    assert weights(both).keys() == weights(forth).keys() | {(b, a) for a, b in weights(forth)}
    found = weights(both)
    assert found == pytest.approx(expected(backwards(walks, price)), rel=1e-9, abs=1e-9)
    assert_rows_sum_to_one(both)


@given(walks=WALKS, price=PRICES)
@few
def test_what_is_made_one_way_costs_the_price_more_the_other(walks: list[list[int]], price: float) -> None:
    """The law, exactly: w(b, a) - w(a, b) = price + log C(b) - log C(a), C the counts that leave.

    So of two moves out of one state that were seen alike often, one forwards and one backwards, the second costs the
    price more; and along a path the logarithms cancel but for its ends.
    """
    engine = learned([walk(f"clip{i}", states) for i, states in enumerate(walks)], reverse=price)
    seen, counts, found = counted(walks), backwards(walks, price), weights(engine)
    leaving: dict[int, float] = defaultdict(float)
    for (before, _), number in counts.items():
        leaving[before] += number
    one_way = [(a, b) for a, b in seen if (b, a) not in seen]
    for a, b in one_way:
        more = price + math.log(leaving[b]) - math.log(leaving[a])
        assert found[b, a] - found[a, b] == pytest.approx(more, rel=1e-9, abs=1e-9)
    for a, b in one_way:
        for c, d in one_way:
            if b == c and seen[a, b] == seen[c, d]:
                assert found[b, a] - found[c, d] == pytest.approx(price, rel=1e-9, abs=1e-9)
    for states in walks:
        if all(move in one_way for move in pairwise(states)):
            forth = sum(found[move] for move in pairwise(states))
            back = sum(found[b, a] for a, b in pairwise(states))
            ends = math.log(leaving[states[-1]]) - math.log(leaving[states[0]])
            assert back - forth == pytest.approx((len(states) - 1) * price + ends, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("price", [0.0, 0.7, 3.0])
def test_along_a_thread_every_move_back_costs_exactly_the_price_more(price: float) -> None:
    """Where the corpus knows one way forth (P = 1), one way back is learned, each move of it dearer by the price.

    Forth costs log(1 + exp(-price)), for what may be undone is no longer certain.
    """
    engine = learned([walk("thread", range(-5, 6))], reverse=price)
    found = weights(engine)
    for state in range(-4, 4):
        assert found[state, state + 1] == pytest.approx(math.log1p(math.exp(-price)), abs=1e-12)
        assert found[state + 1, state] - found[state, state + 1] == pytest.approx(price, abs=1e-12)


@pytest.mark.parametrize("price", [0.0, 0.7, 3.0])
def test_a_tween_against_the_time_of_the_corpus_costs_the_price_a_move_and_joint(price: float) -> None:
    clip = walk("thread", range(-5, 6))
    engine = learned([clip], reverse=price)
    a, b = clip.posture(2), clip.posture(7)
    plain = {"strict": True, "lambda_": 0.0, "guide": 0.0, "moves": 5}
    forth, back = engine.tween(a, b, **plain), engine.tween(b, a, **plain)
    assert back.cost - forth.cost == pytest.approx(5 * 2 * price, abs=1e-9)
    assert {(s.clip, s.corpus, s.reversed) for row in back.sources for s in row if s} == {("thread", "corpus", True)}
    assert [row[0].posture for row in back.sources if row[0]] == [7, 6, 5, 4, 3]
    assert not any(s.reversed for row in forth.sources for s in row if s)
    # It takes as long, and goes back over the ground that it came.
    np.testing.assert_allclose(back.motion.insertions[0].times, forth.motion.insertions[0].times)
    if price == 0.0:  # the mean way is the same only where both directions count alike
        np.testing.assert_allclose(back.motion.root, forth.motion.root[::-1], atol=0.1)
    with pytest.raises(Exception, match="no path from A to B"):
        learned([clip]).tween(b, a, strict=True)


@given(walks=WALKS, price=PRICES)
@few
def test_what_is_made_both_ways_alike_costs_what_it_did(walks: list[list[int]], price: float) -> None:
    clips = [walk(f"clip{i}", states + states[::-1]) for i, states in enumerate(walks)]
    forth, both = weights(learned(clips)), weights(learned(clips, reverse=price))
    assert both == pytest.approx(forth, abs=1e-9)


def test_the_root_travels_back_as_it_came() -> None:
    engine = learned([walk("thread", [0, 1, 3])], reverse=1.0)
    np.testing.assert_allclose(engine.statistics.travel[:, 0], 0.5 * np.array([1.0, 2.0, -1.0, -2.0]), atol=1e-12)
    np.testing.assert_allclose(engine.statistics.travel[:, 1:], 0.0, atol=1e-12)


def test_the_price_leaves_postures_and_how_joints_stand_together_alone() -> None:
    clips = [walk("a", [0, 1, 2, 1], [0, 0, 1, 1]), walk("b", [2, 0], [1, 2])]
    forth, both = learned(clips), learned(clips, reverse=0.5)
    for name in ("pair_costs", "child_costs", "parent_costs"):
        one, other = (getattr(engine.grammar.coordination, name) for engine in (forth, both))
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(forth.grammar.transitions.visits, both.grammar.transitions.visits)
