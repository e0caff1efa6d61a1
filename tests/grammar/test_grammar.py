"""Laws of what is learned from a corpus, and of the costs that the search reads from it, on small random corpora.

Everything is computed a second time here, by counting in dictionaries and by asking the network's own CPDs.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter, defaultdict
from dataclasses import dataclass
from functools import cache
from itertools import pairwise, product
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from toys import solution

from motionmind._typing import Floats, Int32s, Ints
from motionmind.errors import CorpusError
from motionmind.geometry import rotations as rot
from motionmind.grammar import coordination
from motionmind.grammar.bridges import MAX_BRIDGE_DEG, N_BRIDGES_PER_STATE, Bridges, _Neighbours, find_bridges
from motionmind.grammar.coordination import PRIOR_WEIGHT, Coordination, fit_network, learn_coordination
from motionmind.grammar.grammar import Grammar, learn
from motionmind.grammar.transitions import Transitions, Weights, count_transitions, flatten
from motionmind.search.problem import Model, Problem, Rules
from motionmind.tween.problem import build_model, couplings

TURNS = 8  # steps of the facing's circle
PARENTS = {2: (-1, 0), 3: (-1, 0, 0), 4: (-1, 0, 1, 1)}


@dataclass(frozen=True, eq=False)
class Corpus:
    """Clips of states; the last chain is the facing."""

    names: tuple[str, ...]
    parents: Ints
    sizes: Ints
    centres: Floats
    states: Int32s
    begins: Ints
    seconds: Floats

    @property
    def joints(self) -> int:
        return len(self.names) - 1

    def learned(self) -> Grammar:
        return learn(self.names, self.parents, self.centres, self.states, self.sizes, self.begins, self.seconds)

    def moves(self, chain: int) -> list[tuple[int, int]]:
        return [(int(self.states[p, chain]), int(self.states[p + 1, chain])) for p in self.begins]

    def slice(self, chain: int) -> slice:
        first = int(self.sizes[:chain].sum())
        return slice(first, first + int(self.sizes[chain]))


@cache
def corpus(seed: int) -> Corpus:
    rng = np.random.default_rng(seed)
    joints = 2 + seed % 3
    # A clip of one posture has no move; in a few postures many pairs of states are never seen together.
    lengths = [1, *rng.integers(2, 12 if seed % 2 else 5, size=4)]
    chains = []
    for _ in range(joints):
        walk = rng.integers(0, rng.integers(1, 5), size=sum(lengths))
        chains.append(np.unique(walk, return_inverse=True)[1])  # every state of a joint occurs
    chains.append(rng.integers(0, TURNS, size=sum(lengths)))
    ends = np.cumsum(lengths) - 1
    begins = np.setdiff1d(np.arange(sum(lengths)), ends)
    sizes = np.array([*(chain.max() + 1 for chain in chains[:-1]), TURNS])
    centres = [rot.normalise(rng.normal(size=(size, 4))) for size in sizes[:-1]]
    centres.append(rot.about_vertical(np.arange(TURNS) * 2.0 * np.pi / TURNS))
    return Corpus(
        (*(f"joint{j}" for j in range(joints)), "facing"),
        np.array([*PARENTS[joints], -1]),
        sizes,
        np.concatenate(centres),
        np.stack(chains, axis=1).astype(np.int32),
        begins,
        rng.uniform(0.1, 0.5, size=len(begins)),
    )


@cache
def grammar(seed: int) -> Grammar:
    return corpus(seed).learned()


@pytest.fixture(params=range(6))
def seed(request: pytest.FixtureRequest) -> int:
    return request.param


# --- transitions -----------------------------------------------------------------------------------------------------


def test_transitions_are_counted_within_clips_and_never_across(seed: int) -> None:
    body, graph = corpus(seed), grammar(seed).transitions
    for chain in range(body.joints):
        assert edges(graph, chain) == {move: float(count) for move, count in Counter(body.moves(chain)).items()}
    across = [p for p in range(len(body.states) - 1) if p not in set(body.begins)]
    assert len(across) == 4
    assert graph.counts[: graph.indptr[body.slice(body.joints).start]].sum() == body.joints * len(body.begins)


def test_a_turn_counts_alike_wherever_it_starts(seed: int) -> None:
    body, graph = corpus(seed), grammar(seed).transitions
    turned = Counter((after - before) % TURNS for before, after in body.moves(body.joints))
    expected = {(s, (s + turn) % TURNS): float(n) for s in range(TURNS) for turn, n in turned.items()}
    assert edges(graph, body.joints) == expected


@pytest.mark.parametrize("scheme", ["conditional", "printed"])
def test_the_weight_of_a_turn_depends_on_the_turn_alone(seed: int, scheme: Weights) -> None:
    graph, facing = grammar(seed).transitions, corpus(seed).joints
    by_turn = defaultdict(set)
    for (before, after), weight in edges(graph, facing, graph.weights(scheme)).items():
        by_turn[(after - before) % TURNS].add(round(weight, 12))
    assert all(len(weights) == 1 for weights in by_turn.values())


def test_a_transition_is_attested_by_the_first_move_that_makes_it_and_lasts_their_mean(seed: int) -> None:
    body, graph = corpus(seed), grammar(seed).transitions
    for chain in range(len(body.names)):
        made = defaultdict(list)
        for (before, after), begin, seconds in zip(body.moves(chain), body.begins, body.seconds, strict=True):
            key = (after - before) % TURNS if chain == body.joints else (before, after)
            made[key].append((begin, seconds))
        for (before, after), k in edges(graph, chain, np.arange(len(graph.targets))).items():
            key = (after - before) % TURNS if chain == body.joints else (before, after)
            assert graph.attests[int(k)] == made[key][0][0]
            assert graph.seconds[int(k)] == pytest.approx(np.mean([seconds for _, seconds in made[key]]))


def test_an_edge_is_found_by_its_ends_and_only_where_it_is_attested(seed: int) -> None:
    graph = grammar(seed).transitions
    for chain, size in enumerate(graph.sizes()):
        attested = edges(graph, chain, np.arange(len(graph.targets)))
        for before, after in product(range(size), repeat=2):
            assert graph.edge(chain, before, after) == attested.get((before, after), -1)


def test_all_edges_of_a_path_are_those_that_are_found_one_by_one(seed: int) -> None:
    graph = grammar(seed).transitions
    path = np.random.default_rng(seed).integers(graph.sizes(), size=(40, len(graph.sizes()))).astype(np.int32)
    expected = [
        [graph.edge(chain, *pair) for chain, pair in enumerate(zip(*rows, strict=True))] for rows in pairwise(path)
    ]
    np.testing.assert_array_equal(graph.edges(path), expected)


def test_conditional_weights_are_minus_log_p_and_each_row_sums_to_one(seed: int) -> None:
    body, graph = corpus(seed), grammar(seed).transitions
    weights = graph.weights("conditional")
    left = np.add.reduceat(np.exp(-weights), graph.indptr[:-1][np.diff(graph.indptr) > 0])
    np.testing.assert_allclose(left, 1.0, atol=1e-12)
    for chain in range(body.joints):
        moves = Counter(body.moves(chain))
        leaving = Counter(before for before, _ in body.moves(chain))
        for (before, after), weight in edges(graph, chain, weights).items():
            assert weight == pytest.approx(-np.log(moves[before, after] / leaving[before]), abs=1e-12)


def test_printed_weights_are_what_the_papers_print(seed: int) -> None:
    body, graph = corpus(seed), grammar(seed).transitions
    for chain in range(body.joints):
        moves, visits = Counter(body.moves(chain)), Counter(body.states[:, chain].tolist())
        postures, total = len(body.states), len(body.begins)
        for (i, j), weight in edges(graph, chain, graph.weights("printed")).items():
            f_i, f_j, f_ij = visits[i] / postures, visits[j] / postures, moves[i, j] / total
            assert weight == pytest.approx(-np.log(f_i) + np.log(f_j) - np.log(f_ij), abs=1e-12)


@pytest.mark.parametrize("scheme", ["conditional", "printed"])
@pytest.mark.parametrize("novelty", [0.0, 0.4, 1.0])
def test_novelty_weighs_the_moves_of_a_state_ever_more_alike(seed: int, scheme: Weights, novelty: float) -> None:
    graph = grammar(seed).transitions
    for chain in range(len(corpus(seed).names)):
        plain, novel = (edges(graph, chain, graph.weights(scheme, nu)) for nu in (0.0, novelty))
        kinds = Counter(before for before, _ in plain)
        for (before, after), weight in novel.items():
            mixed = (1.0 - novelty) * plain[before, after] + novelty * np.log(kinds[before])
            assert weight == pytest.approx(mixed, abs=1e-12)


def test_weights_are_the_callers_own(seed: int) -> None:
    graph = grammar(seed).transitions
    before = graph.weights("conditional")
    graph.weights("conditional")[:] = -1.0
    np.testing.assert_array_equal(graph.weights("conditional"), before)


def test_a_facing_is_visited_as_often_as_any_other(seed: int) -> None:
    body, graph = corpus(seed), grammar(seed).transitions
    np.testing.assert_allclose(graph.visits[body.slice(body.joints)], len(body.states) / TURNS)
    assert graph.visits.sum() == pytest.approx(len(body.states) * len(body.names))


def test_postures_without_moves_teach_no_transitions() -> None:
    none = np.zeros(0, np.int64)
    graph = count_transitions(np.array([[0, 3]], np.int32), np.array([1, TURNS]), none, np.zeros(0), pooled=1)
    assert len(graph.targets) == len(graph.weights("conditional")) == len(graph.weights("printed")) == 0
    assert graph.indptr.tolist() == [0] * (TURNS + 2)
    np.testing.assert_array_equal(graph.edges(np.zeros((3, 2), np.int32)), -1)


def test_flat_arrays_are_those_of_the_networkx_graphs_and_back(seed: int) -> None:
    graph = grammar(seed).transitions
    graphs = [graph.graph(chain) for chain in range(len(graph.sizes()))]
    for name, array in vars(flatten(graphs)).items():
        np.testing.assert_array_equal(array, getattr(graph, name), strict=True)
    for chain, one in enumerate(graphs):
        first = graph.starts[chain]
        assert list(one.nodes) == list(range(graph.sizes()[chain]))
        assert dict(one.nodes(data="visits")) == dict(enumerate(graph.visits[first : graph.starts[chain + 1]]))
        assert {(s, t): count for s, t, count in one.edges(data="count")} == edges(graph, chain)
        for s, t, weight in one.edges(data="weight"):
            assert weight == graph.weights("conditional")[graph.edge(chain, s, t)]


# --- bridges ---------------------------------------------------------------------------------------------------------


def test_a_bridge_is_never_attested_and_never_leads_nowhere(seed: int) -> None:
    learned = grammar(seed)
    for chain in range(len(learned.chains)):
        bridged = set(bridge_edges(learned.transitions, learned.bridges, chain))
        assert not bridged & set(edges(learned.transitions, chain))
        assert all(before != after for before, after in bridged)


def test_with_bridges_every_state_reaches_every_other(seed: int) -> None:
    learned = grammar(seed)
    for chain, size in enumerate(learned.transitions.sizes()):
        graph = nx.DiGraph(
            [*edges(learned.transitions, chain), *bridge_edges(learned.transitions, learned.bridges, chain)]
        )
        graph.add_nodes_from(range(size))
        assert nx.is_strongly_connected(graph)


def test_a_bridge_spans_the_angle_between_its_ends(seed: int) -> None:
    body, learned = corpus(seed), grammar(seed)
    for chain in range(len(learned.chains)):
        centres = body.centres[body.slice(chain)]
        for (before, after), degrees in bridge_edges(learned.transitions, learned.bridges, chain).items():
            turned = rot.mul(rot.inv(centres[before]), centres[after])
            angle = 2.0 * np.arctan2(np.linalg.norm(turned[:3]), abs(turned[3]))
            assert degrees == pytest.approx(np.degrees(angle), abs=1e-5)
            row = int(learned.transitions.starts[chain]) + before
            assert learned.bridges.span(row, after) == degrees


def test_unless_attested_bridges_run_both_ways_along_a_shortest_tree_and_else_to_near_neighbours() -> None:
    for size in (1, 2, 3, 12):
        centres = rot.normalise(np.random.default_rng(size).normal(size=(size, 4)))
        graph = count_transitions(np.zeros((1, 1), np.int32), np.array([size]), np.zeros(0, np.int64), np.zeros(0))
        found = find_bridges(centres, graph)
        bridges = bridge_edges(graph, found, 0)
        assert all(found.span(before, after) == degrees for (before, after), degrees in bridges.items())
        angles = np.degrees(2.0 * np.arccos(np.clip(np.abs(centres @ centres.T), 0.0, 1.0)))
        complete = nx.Graph((i, j, {"weight": angles[i, j]}) for i in range(size) for j in range(i))
        tree = set(nx.minimum_spanning_tree(complete).edges)
        tree |= {(j, i) for i, j in tree}
        assert tree <= set(bridges)
        for before, after in set(bridges) - tree:
            assert angles[before, after] <= MAX_BRIDGE_DEG
            assert np.sum(angles[before] < angles[before, after]) <= N_BRIDGES_PER_STATE  # itself among them


def test_the_k_d_tree_finds_the_bridges_of_all_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    for size in (2, 3, 7, 60, 300):
        centres = rot.normalise(np.random.default_rng(size).normal(size=(size, 4)))
        graph = count_transitions(np.zeros((1, 1), np.int32), np.array([size]), np.zeros(0, np.int64), np.zeros(0))
        every = find_bridges(centres, graph)
        monkeypatch.setattr("motionmind.grammar.bridges.MAX_STATES_COMPARED", 1)
        near = find_bridges(centres, graph)
        monkeypatch.undo()
        for one, other in zip(vars(near).values(), vars(every).values(), strict=True):
            np.testing.assert_allclose(one, other, atol=1e-5)


@pytest.mark.long
def test_bridges_of_twice_as_many_states_look_at_hardly_more_than_twice_as_many_pairs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looked, angles = [0], _Neighbours.angles

    def counted(self: _Neighbours, one: Ints, other: Ints) -> Floats:
        looked[-1] += len(one)
        return angles(self, one, other)

    monkeypatch.setattr(_Neighbours, "angles", counted)
    for size in (1_500, 3_000, 6_000):
        looked.append(0)
        centres = rot.normalise(np.random.default_rng(size).normal(size=(size, 4)))
        graph = count_transitions(np.zeros((1, 1), np.int32), np.array([size]), np.zeros(0, np.int64), np.zeros(0))
        find_bridges(centres, graph)
    for fewer, more in pairwise(looked[1:]):
        assert 0 < more < 3 * fewer  # of all pairs it would be 4


def test_many_states_that_coincide_are_joined(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motionmind.grammar.bridges.MAX_STATES_COMPARED", 1)
    turns = np.repeat([0.0, 0.3, 2.0], 20)
    centres = rot.from_axis_angle(np.array([1.0, 0.0, 0.0]), turns)
    graph = count_transitions(np.zeros((1, 1), np.int32), np.array([60]), np.zeros(0, np.int64), np.zeros(0))
    assert nx.is_strongly_connected(nx.DiGraph(list(bridge_edges(graph, find_bridges(centres, graph), 0))))


def test_states_that_coincide_are_bridged_too() -> None:
    centres = np.tile([0.0, 0.0, 0.0, 1.0], (5, 1))
    graph = count_transitions(np.zeros((1, 1), np.int32), np.array([5]), np.zeros(0, np.int64), np.zeros(0))
    bridges = bridge_edges(graph, find_bridges(centres, graph), 0)
    assert nx.is_strongly_connected(nx.DiGraph(list(bridges)))
    assert all(degrees == pytest.approx(0.0, abs=1e-5) for degrees in bridges.values())


# --- coordination ----------------------------------------------------------------------------------------------------


def test_the_network_is_the_corpus_counted_with_a_prior_spread_as_the_marginal(seed: int) -> None:
    body = corpus(seed)
    for chain, cpd in cpds(body).items():
        parent = int(body.parents[chain])
        marginal = Counter(body.states[:, chain].tolist())
        if parent < 0:
            expected = [[marginal[c] / len(body.states)] for c in range(body.sizes[chain])]
        else:
            pairs = Counter(zip(body.states[:, chain].tolist(), body.states[:, parent].tolist(), strict=True))
            above = Counter(body.states[:, parent].tolist())
            expected = [
                [
                    (pairs[c, p] + PRIOR_WEIGHT * marginal[c] / len(body.states)) / (above[p] + PRIOR_WEIGHT)
                    for p in range(body.sizes[parent])
                ]
                for c in range(body.sizes[chain])
            ]
        np.testing.assert_allclose(cpd, expected, atol=1e-12)


def test_compiled_coordination_equals_the_network_entry_by_entry(seed: int) -> None:
    body, learned = corpus(seed), grammar(seed)
    for chain, cpd in cpds(body).items():
        if body.parents[chain] >= 0:
            table = learned.coordination.table(chain, learned.transitions.starts)
            np.testing.assert_allclose(table, -np.log(cpd.T), rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(np.exp(-table).sum(axis=1), 1.0, atol=1e-12)
            for (above, state), cost in np.ndenumerate(table):
                assert learned.coordination.cost(chain, above, state, learned.transitions.starts) == pytest.approx(cost)


def test_there_are_pairs_of_states_that_were_never_seen_or_the_laws_above_say_nothing_of_them() -> None:
    rows = [grammar(seed).coordination.pair_ptr for seed in range(6)]
    sizes = [corpus(seed).sizes[: corpus(seed).joints] for seed in range(6)]
    every = [sum(sizes[k][j] * sizes[k][corpus(k).parents[j]] for j in range(1, corpus(k).joints)) for k in range(6)]
    assert sum(count - row[-1] for count, row in zip(every, rows, strict=True)) > 5


def test_the_facing_coordinates_with_nothing(seed: int) -> None:
    net, facing = grammar(seed).coordination, corpus(seed).joints
    assert net.parents[facing] == -1
    assert net.pair_starts[facing] == net.pair_starts[facing + 1]


def test_the_network_is_what_pgmpys_own_estimator_fits(seed: int) -> None:
    import pandas as pd
    from pgmpy.models import DiscreteBayesianNetwork
    from pgmpy.parameter_estimator import DiscreteBayesianEstimator

    body = corpus(seed)
    names = body.names[: body.joints]
    columns = [body.sizes[p] if p >= 0 else 1 for p in body.parents[: body.joints]]
    priors = {
        name: np.repeat(np.bincount(body.states[:, j], minlength=body.sizes[j])[:, None], columns[j], axis=1)
        for j, name in enumerate(names)
    }
    estimator = DiscreteBayesianEstimator(
        state_names={name: list(range(body.sizes[j])) for j, name in enumerate(names)},
        prior_type="dirichlet",
        pseudo_counts={name: PRIOR_WEIGHT * prior / len(body.states) for name, prior in priors.items()},
    )
    network = DiscreteBayesianNetwork()
    network.add_nodes_from(names)
    network.add_edges_from((names[p], names[j]) for j, p in enumerate(body.parents[: body.joints]) if p >= 0)
    frame = pd.DataFrame({name: body.states[:, j] for j, name in enumerate(names)})
    for theirs in estimator.fit(network, frame).parameters_:
        np.testing.assert_allclose(
            cpds(body)[names.index(theirs.variable)], theirs.get_values(), rtol=0.0, atol=5e-15, err_msg=theirs.variable
        )


def test_costs_are_read_out_of_the_networks_tables(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Halve each entry of each table on the way, and every cost of a pair rises by log 2."""
    from pgmpy.factors.discrete import TabularCPD

    learned, values = grammar(seed), TabularCPD.get_values  # learned before: it is kept for other tests
    before, starts = learned.coordination, learned.transitions.starts
    monkeypatch.setattr(TabularCPD, "get_values", lambda cpd: 0.5 * values(cpd))
    after, body = corpus(seed).learned().coordination, corpus(seed)
    for chain in np.flatnonzero(before.parents >= 0):
        seen = set(zip(body.states[:, body.parents[chain]].tolist(), body.states[:, chain].tolist(), strict=True))
        for p, c in product(range(body.sizes[body.parents[chain]]), range(body.sizes[chain])):
            rise = after.cost(chain, p, c, starts) - before.cost(chain, p, c, starts)
            assert rise == pytest.approx(np.log(2.0)), (chain, p, c, (p, c) in seen)


def test_costs_are_the_same_where_the_tables_are_too_large_to_build(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    before = grammar(seed).coordination
    monkeypatch.setattr(coordination, "MAX_NETWORK_CELLS", 0)
    after = corpus(seed).learned().coordination
    for name, array in vars(before).items():
        np.testing.assert_allclose(getattr(after, name), array, rtol=0.0, atol=5e-15)


def test_a_network_that_is_too_large_is_refused_before_it_is_made() -> None:
    sizes = np.array([20_000, 20_000])
    with pytest.raises(CorpusError, match=r"needs 400,000,000 cells, more than 100,000,000: learn with a coarser"):
        fit_network(("pelvis", "hip"), np.array([-1, 0]), np.zeros((2, 2), dtype=np.int32), sizes)


def test_coordination_takes_no_more_than_what_was_seen() -> None:
    """The dense table of these states would take 80 GB."""
    states = np.stack([np.arange(100_000), np.arange(100_000)[::-1]], axis=1).astype(np.int32)
    found = learn_coordination(("hip", "knee"), np.array([-1, 0]), states, np.array([100_000, 100_000]))
    assert found.pair_costs.shape == (100_000,)
    starts = np.array([0, 100_000, 200_000])
    assert found.cost(1, 0, 99_999, starts) == pytest.approx(-np.log((1.0 + 1e-5) / 2.0))
    assert found.cost(1, 0, 0, starts) == pytest.approx(-np.log(1e-5 / 2.0))


# --- what the search reads -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bridge_price", [None, 0.3])
@pytest.mark.parametrize("scheme", ["conditional", "printed"])
def test_moves_cost_their_weight_and_bridges_their_degrees(
    seed: int, scheme: Weights, bridge_price: float | None
) -> None:
    learned = grammar(seed)
    model = build_model(learned, scheme, 1.0, bridge_price)
    for chain in range(len(learned.chains)):
        expected = edges(learned.transitions, chain, learned.transitions.weights(scheme))
        if bridge_price is not None:
            bridges = bridge_edges(learned.transitions, learned.bridges, chain)
            expected |= {ends: bridge_price * degrees for ends, degrees in bridges.items()}
        assert model_edges(model, chain) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("factor", [0.0, 0.5, 1.0])
def test_standing_somewhere_costs_lambda_times_minus_log_p(seed: int, factor: float) -> None:
    body = corpus(seed)
    model = build_model(grammar(seed), "conditional", factor, None)
    tables = coupling_tables(body)
    for posture in product(*map(range, body.sizes[: body.joints])):
        expected = factor * sum(table[posture[body.parents[j]], posture[j]] for j, table in tables.items())
        assert model_standing(model, (*posture, 0)) == pytest.approx(expected, abs=1e-9)
    for j, table in tables.items():
        alone = model.alone[body.slice(j)]
        np.testing.assert_allclose(alone, factor * table.min(axis=0), atol=1e-12)


def test_the_least_cost_of_a_state_bounds_its_couplings(seed: int) -> None:
    """Of any tables, not only of those that a corpus's counts make."""
    rng, starts = np.random.default_rng(seed), np.array([0, 3, 8])
    seen = rng.random((3, 5)) < 0.4
    parent, state = np.nonzero(seen)
    net = Coordination(
        np.array([-1, 0]),
        np.array([0, 0, 3]),
        np.concatenate([[0], np.cumsum(seen.sum(axis=1))]),
        state.astype(np.int32),
        rng.uniform(0.0, 9.0, len(parent)),
        np.concatenate([np.zeros(3), rng.uniform(0.0, 5.0, 5)]),
        rng.uniform(0.0, 5.0, 3),
    )
    table, alone = net.table(1, starts), couplings(net, starts, 0.5).alone
    assert np.all(alone[3:] <= 0.5 * table.min(axis=0) + 1e-12)
    assert np.all(alone[:3] == 0.0)


def test_arrays_that_the_search_bisects_are_sorted(seed: int) -> None:
    model = build_model(grammar(seed), "conditional", 1.0, 1.0)
    for pointer, listed in ((model.indptr, model.targets), (model.pair_ptr, model.pair_states)):
        for first, last in pairwise(pointer):
            assert np.all(np.diff(listed[first:last]) > 0)
    assert np.all(model.pair_costs <= 0.0)


@pytest.mark.parametrize("bridge_price", [None, 0.1])
@pytest.mark.parametrize("factor", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("scheme", ["conditional", "printed"])
def test_the_best_path_is_that_of_brute_force_on_counts_and_cpds(
    seed: int, scheme: Weights, factor: float, bridge_price: float | None
) -> None:
    body, learned = corpus(seed), grammar(seed)
    rng = np.random.default_rng(seed)
    start, goal = (rng.integers(body.sizes) for _ in range(2))
    optima = brute_force(body, learned.bridges, scheme, factor, bridge_price, start, goal, wait=0.7, moves=4)
    found = solution(
        Problem(build_model(learned, scheme, factor, bridge_price), start, goal, Rules(0.7, 0.4, 1, 4, 100_000))
    )
    least = min(optima[moves] + 0.4 * moves for moves in range(1, 5))
    if found is None:
        assert least == np.inf
    else:
        assert found.status == "optimal"
        assert found.cost == pytest.approx(least, abs=2e-6)
        if bridge_price is None:
            for before, after in zip(found.path[:-1], found.path[1:], strict=True):
                for chain, (s, t) in enumerate(zip(before, after, strict=True)):
                    assert learned.transitions.edge(chain, s, t) >= 0 or s == t == goal[chain]


@pytest.mark.long
def test_fresh_processes_give_the_same_bytes_whatever_their_hash_seed() -> None:
    code = (
        "import sys, numpy as np; sys.path[:0] = sys.argv[1:]\n"
        "from test_grammar import Problem, Rules, build_model, corpus, grammar, solution\n"
        "for seed in range(3):\n"
        "    body = corpus(seed)\n"
        "    for budget in (5, 100_000):\n"
        "        a, b = body.states[[0, -1]].astype(np.int64)\n"
        "        model = build_model(grammar(seed), 'conditional', 1.0, 0.1)\n"
        "        found = solution(Problem(model, a, b, Rules(0.7, 0.4, 3, 8, budget)))\n"
        "        print(repr(found.cost), repr(found.lower_bound), found.path.tobytes().hex(), found.expansions)\n"
    )
    processes = [
        subprocess.Popen(
            [sys.executable, "-W", "ignore", "-c", code, *map(str, Path(__file__).parents[:2])],
            env={**os.environ, "PYTHONHASHSEED": hash_seed},
            stdout=subprocess.PIPE,
        )
        for hash_seed in ("1", "2")
    ]
    one, other = (process.communicate()[0] for process in processes)
    assert all(process.returncode == 0 for process in processes)
    assert one == other
    assert one.count(b"\n") == 6


# --- helpers ---------------------------------------------------------------------------------------------------------


def edges(graph: Transitions, chain: int, values: Floats | None = None) -> dict[tuple[int, int], float]:
    """Attested transitions of a chain with their counts, or other values."""
    return listed(graph.starts, graph.indptr, graph.targets, graph.counts if values is None else values, chain)


def bridge_edges(graph: Transitions, bridges: Bridges, chain: int) -> dict[tuple[int, int], float]:
    return listed(graph.starts, bridges.indptr, bridges.targets, bridges.degrees, chain)


def model_edges(model: Model, chain: int) -> dict[tuple[int, int], float]:
    return listed(model.starts, model.indptr, model.targets, model.costs, chain)


def listed(
    starts: Ints,
    indptr: Ints,
    targets: Int32s,
    values: Floats,
    chain: int,
) -> dict[tuple[int, int], float]:
    found = {}
    for row in range(starts[chain], starts[chain + 1]):
        for k in range(indptr[row], indptr[row + 1]):
            found[row - int(starts[chain]), int(targets[k])] = float(values[k])
    return found


def model_standing(model: Model, posture: tuple[int, ...]) -> float:
    """What a model charges for a posture, moves apart."""
    total = 0.0
    for chain, parent in enumerate(model.parents):
        total += model.unary[model.starts[chain] + posture[chain]]
        if parent >= 0:
            row = model.pair_starts[chain] + posture[parent]
            for q in range(model.pair_ptr[row], model.pair_ptr[row + 1]):
                total += model.pair_costs[q] if model.pair_states[q] == posture[chain] else 0.0
    return float(total)


@cache
def cpds(body: Corpus) -> dict[int, Floats]:
    """P(state | state of the parent) of each joint [S, states of the parent], from the network."""
    joints = body.joints
    network = fit_network(body.names[:joints], body.parents[:joints], body.states[:, :joints], body.sizes[:joints])
    assert network.check_model()
    return {j: network.get_cpds(body.names[j]).get_values() for j in range(joints)}


def coupling_tables(body: Corpus) -> dict[int, Floats]:
    """-log P [states of the parent, S] of each joint that has a parent."""
    return {j: -np.log(cpd.T) for j, cpd in cpds(body).items() if body.parents[j] >= 0}


def brute_force(
    body: Corpus,
    bridges: Bridges,
    scheme: Weights,
    factor: float,
    bridge_price: float | None,
    start: Ints,
    goal: Ints,
    wait: float,
    moves: int,
) -> list[float]:
    """Least cost of 0 .. `moves` moves over all joint states, without tau; from counts and CPDs.

    The facing is coupled to nothing, so it is left out of the joint states and added as a chain of its own.
    """
    tables = []
    for chain in range(len(body.names)):
        pooled = chain == body.joints
        counts = np.zeros((body.sizes[chain],) * 2)
        for before, after in body.moves(chain):
            for turn in range(TURNS) if pooled else [0]:
                counts[(before + turn) % body.sizes[chain], (after + turn) % body.sizes[chain]] += 1
        visits = np.full(TURNS, 1.0) if pooled else np.bincount(body.states[:, chain], minlength=body.sizes[chain])
        with np.errstate(divide="ignore", invalid="ignore"):
            if scheme == "conditional":
                table = -np.log(counts / counts.sum(axis=1, keepdims=True))
            else:
                visited = visits / visits.sum()
                table = -np.log(visited)[:, None] + np.log(visited)[None, :] - np.log(counts / counts.sum())
        table[counts == 0] = np.inf
        if bridge_price is not None:
            row = body.slice(chain).start
            for s in range(body.sizes[chain]):
                for k in range(bridges.indptr[row + s], bridges.indptr[row + s + 1]):
                    table[s, bridges.targets[k]] = bridge_price * bridges.degrees[k]
        table[goal[chain], goal[chain]] = min(table[goal[chain], goal[chain]], wait)
        tables.append(table)

    joint = np.array(list(product(*map(range, body.sizes[:-1]))))
    move = sum(tables[j][joint[:, j][:, None], joint[:, j][None, :]] for j in range(body.joints))
    stand = np.zeros(len(joint))
    for j, table in coupling_tables(body).items():
        stand += factor * table[joint[:, body.parents[j]], joint[:, j]]
    value = np.where((joint == start[:-1]).all(axis=1), 0.0, np.inf)
    facing = np.where(np.arange(TURNS) == start[-1], 0.0, np.inf)
    optima = []
    for _ in range(moves + 1):
        optima.append(float(value[(joint == goal[:-1]).all(axis=1)][0] + facing[goal[-1]]))
        value = (value[:, None] + move).min(axis=0) + stand
        facing = (facing[:, None] + tables[-1]).min(axis=0)
    return optima
