"""The guide: what it charges, that it adds up, and that answers to all wishes are judged by one energy."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.motion import Motion, Posture, Velocity
from motionmind.geometry import rotations as rot
from motionmind.synthesis.timeline import usual
from motionmind.tween.ends import bring_ends
from motionmind.tween.engine import Engine
from motionmind.tween.formulate import Formulation, formulate
from motionmind.tween.guide import PRICED_MOVE_S, departures, make_guide
from motionmind.tween.request import TweenRequest
from motionmind.walks.expectation import expect
from motionmind.walks.stops import stop_at

PAIRS = {"ballet": (100, 140), "walk-hexapod": (5, 30)}


@cache
def engine_of(name: str) -> Engine:
    return Engine.load(name)


@pytest.fixture(scope="module", params=PAIRS)
def engine(request: pytest.FixtureRequest) -> Engine:
    return engine_of(request.param)


def ends(engine: Engine) -> tuple[Posture, Posture]:
    a, b = PAIRS[engine.corpus.name]
    return posture(engine, a), posture(engine, b)


def posture(engine: Engine, row: int) -> Posture:
    corpus = engine.corpus
    return Posture(corpus.skeleton, corpus.rotations[row], corpus.root[row])


def formulated(engine: Engine, **options: Any) -> Formulation:
    return formulate(engine, bring_ends(engine.corpus, *ends(engine)), TweenRequest.of(**options))


def guide_of(engine: Engine, moves: int, /, **options: Any) -> Floats:
    guide = formulated(engine, **options).searched.guide
    assert guide is not None
    return guide(moves)


# --- what it charges --------------------------------------------------------------------------------------------------


def test_departures_grow_with_the_squared_angle_in_widths() -> None:
    """One chain of states every 10 degrees; its expectation is at 3 degrees, or at 95, farther than the tolerance."""
    centres = rot.about_vertical(np.radians(np.arange(0.0, 90.0, 10.0)))
    found = rot.about_vertical(np.radians([3.0, 95.0]))[:, None]
    for sign in (1.0, -1.0):
        out = departures(sign * found, centres, np.array([0, 9]), np.radians([5.0]))
        np.testing.assert_allclose(out[0], ((np.arange(0.0, 90.0, 10.0) - 3.0) / 5.0) ** 2, rtol=1e-6)
        np.testing.assert_allclose(out[1], ((np.arange(0.0, 90.0, 10.0) - 95.0) / 15.0) ** 2, rtol=1e-6)
    assert out[1].min() == pytest.approx(1.0)  # the nearest of states that are all too far costs as a tolerance's


def test_each_chain_is_charged_by_its_own_states_and_tolerance() -> None:
    rng = np.random.default_rng(0)
    centres, expected = rot.normalise(rng.normal(size=(7, 4))), rot.normalise(rng.normal(size=(3, 2, 4)))
    both = departures(expected, centres, np.array([0, 3, 7]), np.array([0.1, 9.0]))
    for chain, rows in ((0, slice(0, 3)), (1, slice(3, 7))):
        alone = departures(
            expected[:, chain, None],
            centres[rows],
            np.array([0, rows.stop - rows.start]),
            np.array([[0.1, 9.0][chain]]),
        )
        np.testing.assert_allclose(both[:, rows], alone)
    angles = rot.angle(expected[:, 1, None], centres[None, 3:])
    np.testing.assert_allclose(both[:, 3:], (angles / 9.0) ** 2, rtol=1e-6)


def test_the_guide_is_about_what_walks_expect(engine: Engine) -> None:
    """Taken apart by hand, for the bundled corpora's own rates."""
    moves, (a, b) = 6, ends(engine)
    seconds = usual(engine.grammar.transitions)
    stops = {0: stop_at(engine.corpus, a), moves: stop_at(engine.corpus, b)}
    expected = expect(engine.corpus, engine.statistics, stops, np.linspace(0.0, moves * seconds, 2 * moves + 1))
    chains = expected.chains(engine.corpus, seconds * np.arange(1, moves))
    found, starts = guide_of(engine, moves, guide=0.7, liveliness=0.0), engine.space.starts
    assert found.shape == (moves - 1, starts[-1])
    for chain, tolerance in enumerate(np.radians(engine.space.tolerances)):
        rows = slice(starts[chain], starts[chain + 1])
        angles = rot.angle(chains[:, chain, None], engine.space.centres[rows])
        width = np.maximum(angles.min(axis=1, keepdims=True), tolerance)
        np.testing.assert_allclose(
            found[:, rows], 0.7 * seconds / PRICED_MOVE_S * (angles / width) ** 2, rtol=1e-5, atol=1e-5
        )


def test_the_sum_over_moves_does_not_depend_on_their_length(engine: Engine) -> None:
    """To stay in one state for a second costs what it costs, in however many moves."""
    (a, b), rows = ends(engine), np.arange(engine.space.starts[-1])
    totals = []
    for moves in (10, 20, 40, 80):
        guide = make_guide(engine, bring_ends(engine.corpus, a, b).stops(engine.corpus), 1.0, 1.0, rows)
        totals.append(guide(moves).sum(axis=0))
    # What is summed is the trapezoid rule of one integral, but for the ends, where no move is charged.
    np.testing.assert_allclose(totals[2], totals[3], rtol=0.1, atol=0.1)
    np.testing.assert_allclose(np.median(np.array(totals[:-1]) / np.maximum(totals[-1], 1.0), axis=1), 1.0, atol=0.15)


def test_ends_that_move_are_guided_otherwise(engine: Engine) -> None:
    (a, b), rows = ends(engine), np.arange(engine.space.starts[-1])
    velocity = Velocity(np.full((len(a.skeleton), 3), 2.0), np.zeros(3))
    plain, leaving, arriving = (
        make_guide(engine, (stop_at(engine.corpus, a, left), stop_at(engine.corpus, b, arrived)), 1.0, None, rows)(6)
        for left, arrived in ((None, None), (velocity, None), (None, velocity))
    )
    assert np.abs(leaving - plain)[0].max() > 0.1
    assert np.abs(arriving - plain)[-1].max() > 0.1
    assert np.abs(leaving - arriving).max() > 0.1


def test_the_search_is_guided_by_the_movement_before_a_and_after_b(engine: Engine) -> None:
    a, b = ends(engine)
    joints, times = len(a.skeleton), np.array([-0.1, -0.05, 0.0])
    spin = rot.exp(times[:, None, None] * np.full((joints, 3), 2.0))
    before = Motion(a.skeleton, rot.mul(a.rotations, spin), np.repeat(a.root[None], 3, axis=0), times + 1.0, "before")
    after = Motion(b.skeleton, rot.mul(b.rotations, spin)[::-1], np.repeat(b.root[None], 3, axis=0), times, "after")
    guides = []
    for moving in ({}, {"before": before}, {"after": after}):
        guide = formulate(engine, bring_ends(engine.corpus, a, b, **moving), TweenRequest()).searched.guide
        assert guide is not None
        guides.append(guide(6))
    assert np.abs(guides[1] - guides[0])[0].max() > 0.1
    assert np.abs(guides[2] - guides[0])[-1].max() > 0.1


# --- one energy -------------------------------------------------------------------------------------------------------


def test_without_kappa_there_is_no_guide(engine: Engine) -> None:
    assert formulated(engine, guide=0.0).searched.guide is None
    assert formulated(engine, whole_body=True).searched.guide is None
    tween = engine.tween(*ends(engine), guide=0.0, without=["pace"])
    assert not tween.costs.guide.any()
    assert tween.length is None
    assert tween.costs.total == pytest.approx(tween.cost, abs=1e-6)
    # The guide's factor does not touch what is left of the energy.
    guided = engine.tween(*ends(engine), moves=tween.moves)
    assert guided.cost - guided.costs.guide.sum() >= tween.lower_bound - 1e-6
    little = engine.tween(*ends(engine), moves=tween.moves, guide=1e-9)
    assert little.cost == pytest.approx(tween.cost, abs=1e-4)


def test_whatever_is_wished_is_judged_by_one_energy(engine: Engine) -> None:
    plain, joint = guide_of(engine, 9), engine.corpus.skeleton.names[1]
    states = engine.space.assign(engine.corpus.to_chains(posture(engine, 20).rotations[None]))[0]
    for options in (
        {"pin": {joint: "B"}},
        {"avoid": [(engine.corpus.skeleton.names[2], int(states[2]))]},
        {"via": [posture(engine, 20)]},
        {"sample": True},
        {"lambda_": 0.2, "beta": 2.0, "tau": 0.1},
        {"moves": 9},
        {"strict": True},
    ):
        np.testing.assert_array_equal(guide_of(engine, 9, **options), plain)
    np.testing.assert_allclose(guide_of(engine, 9, guide=2.5), 2.5 * plain)
    np.testing.assert_allclose(guide_of(engine, 9, novelty=0.5), 0.5 * plain)  # what walks expect is habit
    assert formulated(engine, novelty=1.0).searched.guide is None


def test_moves_in_place_of_states_are_charged_where_they_arrive() -> None:
    hexapod = engine_of("walk-hexapod")
    states, moves = (formulated(hexapod, coordination=how) for how in ("posture", "progression"))
    assert states.searched.guide is not None
    assert moves.searched.guide is not None
    model = moves.searched.model
    chain = np.repeat(np.arange(len(model.parents)), np.diff(model.starts))
    rows = states.searched.model.starts[chain] + model.place
    np.testing.assert_array_equal(moves.searched.guide(5), states.searched.guide(5)[:, rows])


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"moves": 7},
        {"duration": 1.1},
        {"moves": 12, "duration": 0.7},
        {"guide": 0.3, "lambda_": 0.0},
        {"coordination": "none", "tau": 0.0},
        {"novelty": 0.9},
    ],
)
def test_the_guide_s_costs_add_up_with_the_others(engine: Engine, options: dict[str, Any]) -> None:
    tween = engine.tween(*ends(engine), **options)
    costs = tween.costs
    assert costs.total == pytest.approx(tween.cost, abs=1e-6)
    assert costs.guide.shape == costs.moves.shape
    assert not costs.guide[-1].any()
    assert costs.guide.min() >= 0.0
    guide, starts = guide_of(engine, tween.moves, **options), engine.space.starts[:-1]
    charged = [row[starts + states] for row, states in zip(guide, tween.path[1:-1], strict=True)]
    np.testing.assert_allclose(costs.guide[:-1], charged, atol=1e-9)


def test_a_stronger_guide_is_obeyed_more(engine: Engine) -> None:
    """The optimum at a greater kappa departs no more: kappa G(x') <= kappa G(x) + E(x) - E(x') for both."""
    departs = []
    for kappa in (0.05, 0.3, 1.0, 5.0, 30.0):
        tween = engine.tween(*ends(engine), moves=7, guide=kappa)
        assert tween.status == "optimal"
        departs.append(tween.costs.guide.sum() / kappa)
    assert np.all(np.diff(departs) <= 1e-4)
    assert departs[-1] < departs[0]
