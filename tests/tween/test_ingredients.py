"""The ingredients of the written problem against the report, the corpus's tables and the angles between states."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest
from ingredients import PARTS, ROUNDING, altered, assert_reported

from motionmind.body.motion import Posture
from motionmind.errors import NoPathError
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine
from motionmind.tween.result import Tween


@cache
def engine_of(name: str) -> Engine:
    return Engine.load(name)


def drawn(engine: Engine, count: int, seed: int) -> Iterator[list[Posture]]:
    """Three postures of the corpus at a time, at random."""
    corpus = engine.corpus
    for rows in np.random.default_rng(seed).integers(0, len(corpus), (count, 3)).tolist():
        yield [Posture(corpus.skeleton, corpus.rotations[row], corpus.root[row]) for row in rows]


# --- along the path ---------------------------------------------------------------------------------------------------

REQUESTS: list[dict[str, Any]] = [
    {},
    {"strict": True},
    {"moves": 3, "bridge_price": 0.7},
    {"moves": 8, "beta": 0.1},
    {"weights": "printed", "moves": 5},
    {"weights": "printed", "coordination": "progression", "moves": 3},
    {"novelty": 0.6, "beta": 0.4, "tau": 3.0},
    {"novelty": 1.0},
    {"duration": 2.0, "guide": 3.0, "lambda_": 0.3},
    {"coordination": "none"},
    {"guide": 0.0},
    {"coordination": "progression", "moves": 3, "beta": 0.1},
    {"coordination": "progression", "novelty": 0.5, "moves": 4, "lambda_": 2.0},
    {"coordination": "progression", "strict": True, "moves": 4},
    {"pin": {"left_wrist": "B", "cervical": "A"}, "moves": 6},
    {"hold": ["left_wrist"], "moves": 5},
    {"avoid": [("left_knee", 0)]},
    {"sample": True, "seed": 3},
    {"whole_body": True},
]


@pytest.mark.parametrize("request_", REQUESTS, ids=str)
def test_each_ingredient_of_a_tween_is_what_its_report_says(request_: dict[str, Any]) -> None:
    found = 0
    for a, b, _ in drawn(engine_of("ballet"), 3, seed=21):
        try:
            assert_reported(engine_of("ballet").tween(a, b, **request_))
        except NoPathError:
            continue
        found += 1
    assert found


@pytest.mark.long
@pytest.mark.parametrize("coordination", ["posture", "progression"])
def test_each_ingredient_is_reported_on_the_way_through_other_postures(coordination: str) -> None:
    engine = engine_of("ballet")
    for a, b, via in drawn(engine, 2, seed=22):
        for vias, moves in (([via], None), ([(via, 3)], 6), ([via, a], None)):
            tween = engine.tween(a, b, via=vias, moves=moves, coordination=coordination)
            assert_reported(tween)
            variables = json.loads(tween.problem())["variables"]
            assert any(name.endswith("_on") for name in variables) == (coordination == "progression")


def test_each_ingredient_of_an_alternative_is_what_its_report_says() -> None:
    a, b, _ = next(drawn(engine_of("ballet"), 1, seed=23))
    for tween in engine_of("ballet").alternatives(a, b, 3):
        assert_reported(tween)


def test_bridges_and_waits_are_among_what_is_tested() -> None:
    counts: Counter[str] = Counter()
    for request in ({"moves": 8, "beta": 0.1}, {"moves": 3}, {"coordination": "progression", "moves": 3, "beta": 0.1}):
        for a, b, _ in drawn(engine_of("ballet"), 3, seed=21):
            try:
                paid = assert_reported(engine_of("ballet").tween(a, b, **request, liveliness=0.0))
            except NoPathError:
                continue
            counts.update(part for (part, _, _), cost in paid.items() if cost)
    assert min(counts[part] for part in ("transition", "bridge", "wait", "network", "guide")) > 3


def test_a_posture_that_stays_pays_nothing() -> None:
    a, _, _ = next(drawn(engine_of("ballet"), 1, seed=24))
    tween = engine_of("ballet").tween(a, a)
    assert tween.moves == 0
    assert not any(assert_reported(tween).values())


def test_recorded_dance_is_reported_as_it_is_written(cmu05: Engine) -> None:
    corpus, rng = cmu05.corpus, np.random.default_rng(25)
    for first in rng.integers(len(corpus) - 5, size=6).tolist():
        a, b = (Posture(corpus.skeleton, corpus.rotations[row], corpus.root[row]) for row in (first, first + 4))
        assert_reported(cmu05.tween(a, b))


# --- against the corpus -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def tween() -> Tween:
    a, b, _ = next(drawn(engine_of("ballet"), 1, seed=21))
    return engine_of("ballet").tween(a, b, lambda_=0.3, bridge_price=0.7, moves=6, liveliness=0.0)


@pytest.fixture(scope="module")
def network(tween: Tween) -> dict[str, Any]:
    return json.loads(tween.problem())


def listed(network: dict[str, Any], name: str) -> dict[tuple[int, int], float]:
    """The pairs of states that a function lists, with their costs."""
    function = network["functions"].get(name)
    if function is None:
        return {}
    first, second = (states(network, variable) for variable in function["scope"])
    costs = function["costs"]
    return {(first[a], second[b]): c for a, b, c in zip(costs[::3], costs[1::3], costs[2::3], strict=True)}


def states(network: dict[str, Any], variable: str) -> list[int]:
    return [int(value.removeprefix("s")) for value in network["variables"][variable]]


def test_the_network_of_the_file_is_that_of_the_corpus(tween: Tween, network: dict[str, Any]) -> None:
    """-0.3 log P(state | parent's state), for all pairs of states that a joint and its parent may have at each move."""
    engine = engine_of("ballet")
    cpds, parents, pairs = engine.network(), engine.corpus.chain_parents, 0
    functions = network["functions"]
    for (j, joint), t in product(enumerate(tween.joints), range(1, tween.moves + 1)):
        if parents[j] < 0:
            assert f"network_{joint}_{t}" not in functions
            continue
        table = cpds.get_cpds(joint).get_values()  # P(row | column)
        above, own = f"{tween.joints[parents[j]]}_{t}", f"{joint}_{t}"
        assert functions[f"network_{own}"]["defaultcost"] == 0
        corrections = listed(network, f"network_{own}")
        parent, child = functions[f"network_{own}_parent"]["costs"], functions[f"network_{own}_child"]["costs"]
        for (p, of_parent), (c, of_child) in product(
            zip(states(network, above), parent, strict=True), zip(states(network, own), child, strict=True)
        ):
            found = of_parent + of_child + corrections.get((p, c), 0.0)
            assert found == pytest.approx(-0.3 * np.log(table[c, p]), abs=ROUNDING), (own, p, c)
            pairs += 1
    assert pairs > 10_000


def test_the_moves_of_the_file_are_those_of_the_corpus(tween: Tween, network: dict[str, Any]) -> None:
    """Transitions have the joint graph's weights, bridges cost 0.7 nats a degree, waits 1; no edge is of two kinds."""
    engine, counts = engine_of("ballet"), Counter[str]()
    for (j, joint), t in product(enumerate(tween.joints), range(1, tween.moves + 1)):
        graph, goal = engine.joint_graph(joint), int(tween.path[-1, j])
        kinds = {kind: listed(network, f"{kind}_{joint}_{t}") for kind in ("transition", "bridge", "wait")}
        for (a, b), cost in kinds["transition"].items():
            assert cost == pytest.approx(graph.edges[a, b]["weight"], abs=ROUNDING)
        for (a, b), cost in kinds["bridge"].items():
            assert not graph.has_edge(a, b)
            angle = rot.angle(*(np.array(graph.nodes[state]["orientation"]) for state in (a, b)))
            assert cost == pytest.approx(0.7 * np.degrees(angle), abs=1e-4)
        assert kinds["wait"] in ({}, {(goal, goal): 1.0})
        allowed = listed(network, f"allowed_{joint}_{t}")
        assert sorted(allowed) == sorted(edge for edges in kinds.values() for edge in edges)
        assert not any(allowed.values())
        # Nothing that the corpus attests between states that may be had is missing.
        before, after = states(network, f"{joint}_{t - 1}"), set(states(network, f"{joint}_{t}"))
        assert {(a, b) for a in before for b in graph.successors(a) if b in after} <= allowed.keys()
        counts.update({kind: len(edges) for kind, edges in kinds.items()})
    assert min(counts.values()) > 20


@pytest.mark.parametrize("part", PARTS)
def test_a_change_in_any_ingredient_is_noticed(part: str, tween: Tween) -> None:
    """So none is left out of the comparison with the report."""
    text = altered(tween.problem(), part)
    assert_reported(tween)
    with pytest.raises(AssertionError):
        assert_reported(tween, text)
