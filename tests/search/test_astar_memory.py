"""What A* does when its memory is full, on toy bodies (see toys.py) bounded so poorly that it has work to do.

Forgetting a leaf is safe only because its key is backed up into its parent. `ByTheBook` is the same search in plain
Python, with the backing up as an option, and shows what becomes of the proof without it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from toys import noisy_messages, random_toy, solution, trellis_of

from motionmind.search import astar, bounding, pair_chains
from motionmind.search.heuristic import Heuristic
from motionmind.search.pair_chain_tables import PairChains
from motionmind.search.tolerances import SAME_COST_NATS
from motionmind.search.trellis import Trellis

MOVES = 5
ENOUGH = 50_000  # nodes, and expansions: more than any toy here needs
ROUNDING = 1e-8
SEEDS = range(40)


@dataclass(frozen=True)
class Case:
    """A trellis, pair chains with a poor bound, and the optimum by brute force."""

    trellis: Trellis
    tables: PairChains
    bound: float
    optimum: float

    def search(self, budget: int, expansions: int = ENOUGH, cost: float = np.inf) -> astar.Found:
        path = np.zeros(len(self.trellis.dom_ptr) - 1, np.int64)
        on = np.zeros(1, dtype=bool)
        return astar.search(self.trellis, self.heuristic, cost, SAME_COST_NATS, path, budget, expansions, on)

    @property
    def heuristic(self) -> Heuristic:
        return Heuristic.of_pair_chains(self.tables)

    @property
    def depth(self) -> int:
        """Nodes on a whole path: the root, and one for each variable but the last, which needs none."""
        return MOVES * self.trellis.chains


@cache
def cases(even: bool = False) -> tuple[Case, ...]:
    """Toys that can be solved in MOVES moves."""
    found = []
    for seed in SEEDS:
        toy = random_toy(seed, states=3, frustrated=True, even=even)
        optimum = toy.optima(MOVES)[MOVES] - MOVES * toy.per_move
        if len(toy.sizes) > 1 and np.isfinite(optimum):
            trellis = trellis_of(toy, MOVES)
            tables = pair_chains.build(trellis, noisy_messages(trellis, seed, 20.0))
            found.append(Case(trellis, tables, pair_chains.lower_bound(tables), float(optimum)))
    return tuple(found)


# --- laws ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("even", [False, True])
@pytest.mark.parametrize("budget", [1, 2, 3, 5, 10, 20, 50, 100, 1000])
def test_nodes_held_never_exceed_the_budget_and_the_bound_is_true(budget: int, even: bool) -> None:
    for case in cases(even):
        cost, lower, expansions, peak, _ = case.search(budget, 2000)
        assert peak <= budget
        assert expansions <= 2000
        assert case.bound - ROUNDING <= lower <= case.optimum + ROUNDING
        assert cost >= case.optimum - ROUNDING


@pytest.mark.parametrize("even", [False, True])
def test_with_enough_memory_the_answer_is_the_optimum_and_proven(even: bool) -> None:
    for case in cases(even):
        cost, lower, _, _, forgotten = case.search(ENOUGH)
        assert forgotten == 0
        assert cost == pytest.approx(case.optimum, abs=ROUNDING)
        assert lower == pytest.approx(case.optimum, abs=ROUNDING)


@pytest.mark.parametrize("even", [False, True])
def test_forgetting_keeps_the_bound_valid(even: bool) -> None:
    proven_in_little = 0
    for case in cases(even):
        needed = case.search(ENOUGH).peak_nodes
        for budget in (case.depth + 5, case.depth + 10, 2 * case.depth, 3 * case.depth):
            cost, lower, expansions, peak, forgotten = case.search(budget)
            assert forgotten == 0 or peak == budget < needed
            if budget < needed and expansions < ENOUGH and cost < np.inf:
                assert peak == budget
                assert forgotten > 0
                assert lower <= case.optimum + ROUNDING
                if lower >= cost - ROUNDING:
                    assert cost == pytest.approx(case.optimum, abs=ROUNDING)
                    proven_in_little += 1
    assert proven_in_little > 20


def test_a_known_optimum_is_proven() -> None:
    for case in cases():
        cost, lower, *_ = case.search(ENOUGH, cost=case.optimum)
        assert cost == case.optimum
        assert lower == pytest.approx(case.optimum, abs=ROUNDING)


def test_bounds_of_interrupted_searches_grow_with_effort() -> None:
    for case in cases():
        bounds = [case.search(ENOUGH, expansions).lower_bound for expansions in (0, 1, 2, 5, 20, 100, 500, ENOUGH)]
        assert bounds[0] == case.bound
        assert all(before <= after + ROUNDING for before, after in pairwise(bounds))
        assert bounds[-1] == pytest.approx(case.optimum, abs=ROUNDING)


def test_duplicates_are_merged_so_few_nodes_are_expanded_twice() -> None:
    """Only those are that were freed, because all that lies behind them was reached otherwise, and met again."""
    for case in cases() + cases(even=True):
        expansions = case.search(ENOUGH).expansions
        assert expansions <= 1.05 * frontiers(case.trellis)


def test_merging_frontiers_saves_what_the_tree_of_prefixes_would_cost() -> None:
    saved = [prefixes(case.trellis) / frontiers(case.trellis) for case in cases()]
    assert max(saved) > 100  # or the law above would say little


def test_more_memory_never_gave_a_worse_answer_on_these_bodies(monkeypatch: pytest.MonkeyPatch) -> None:
    """No theorem: who forgets other leaves looks elsewhere first. It holds for these; a change is worth a look."""
    monkeypatch.setattr(bounding, "MAX_PAIR_CHAIN_SWEEPS", 0)
    for seed in SEEDS:
        toy = random_toy(seed, frustrated=True)
        found = [
            solution(toy.problem(toy.rules(1, 6, node_budget, sweeps=1)))
            for node_budget in (1, 2, 10, 30, 100, 1000, ENOUGH)
        ]
        if found[0] is not None:
            costs, bounds = [answer.cost for answer in found], [answer.lower_bound for answer in found]
            assert all(after <= before + ROUNDING for before, after in pairwise(costs))
            assert all(after >= before - ROUNDING for before, after in pairwise(bounds))
            assert found[-1].status == "optimal"


def test_all_numbers_of_moves_together_take_no_more_expansions_than_are_allowed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(bounding, "MAX_PAIR_CHAIN_SWEEPS", 0)
    spent = 0
    for seed in SEEDS:
        toy = random_toy(seed, frustrated=True)
        for budget in (10, 30, 100):
            found = solution(toy.problem(toy.rules(1, 6, budget, sweeps=1)))
            if found is not None:
                assert found.expansions <= budget
                spent += found.expansions == budget
    assert spent > 5


@pytest.mark.long
@pytest.mark.parametrize("budget", [30, 45, 70])
def test_full_memory_loses_a_quarter_of_its_nodes_and_keeps_the_bound(budget: int) -> None:
    """Or all but the way to the node that is being expanded: so forgetting is paid for by the nodes then made anew."""
    times = 0
    for case in cases():
        path, nodes = np.zeros(len(case.trellis.dom_ptr) - 1, np.int64), astar._root(case.trellis, case.bound, budget)
        for _ in range(300):
            if nodes.counters[astar._N_OPEN] == 0 or nodes.counters[astar._N_FREE] < 8:
                break
            node = nodes.heap[0]  # no integer of Python, for which all of this would be compiled once more
            astar._close(nodes, node)
            astar._expand(case.trellis, case.heuristic, nodes, node, np.inf, SAME_COST_NATS, path)
            astar._free_dead_ends(nodes, node)
        if nodes.counters[astar._N_FREE] >= 8 or nodes.counters[astar._N_OPEN] == 0:
            continue
        current = nodes.heap[0]
        astar._close(nodes, current)
        before = {float(nodes.priority[node]) for node in nodes.heap[: nodes.counters[astar._N_OPEN]]}
        held, forgotten = nodes.counters[[astar._N_HELD, astar._N_FORGOTTEN]]
        assert astar._forget(nodes, current)
        opened = nodes.heap[: nodes.counters[astar._N_OPEN]]
        assert nodes.counters[astar._N_HELD] <= max(astar.KEPT_NODES_SHARE * budget, case.depth)
        assert (
            nodes.counters[astar._N_HELD] > astar.KEPT_NODES_SHARE * budget - case.depth
        )  # a leaf more, and its way, are too many
        assert nodes.counters[astar._N_HELD] + nodes.counters[astar._N_FREE] == budget
        assert nodes.counters[astar._N_FORGOTTEN] - forgotten == held - nodes.counters[astar._N_HELD] > 0
        assert min(nodes.priority[opened]) == min(before)
        assert {float(key) for key in nodes.priority[opened]} <= before
        assert (nodes.heap_index[opened] == np.arange(len(opened))).all()
        times += 1
    assert times > 3


@pytest.mark.parametrize("count", [1000, 1024, 1025, 2047, 2049])
def test_node_capacity_counts_all_memory(count: int) -> None:
    """Just beyond a power of two the buckets take most."""
    for trellis in {case.trellis.chains: case.trellis for case in cases()}.values():
        memory = next(size for size in range(10**7) if astar.node_capacity(size, trellis.chains) == count)
        nodes = astar._root(trellis, 0.0, count)
        taken = sum(array.nbytes for array in nodes) - nodes.counters.nbytes + count  # and a mark while others go
        assert 0.9 * memory < taken <= memory


def test_the_heap_stays_ordered_when_nodes_are_removed_from_its_middle() -> None:
    rng, count = np.random.default_rng(0), 200
    nodes = astar._root(cases()[0].trellis, 0.0, count)
    for node in np.arange(1, count, dtype=np.int32):
        nodes.priority[node], nodes.f[node], nodes.var[node] = (
            rng.integers(0, 60),
            rng.integers(0, 5),
            rng.integers(0, 5),
        )
        astar._open(nodes, node)
    place = {node: (nodes.priority[node], -nodes.var[node], nodes.f[node], node) for node in range(count)}
    for node in rng.permutation(count)[: count - 1].astype(np.int32):
        astar._close(nodes, node)
        heap = nodes.heap[: nodes.counters[astar._N_OPEN]].tolist()
        assert all(place[heap[(k - 1) // 2]] < place[heap[k]] for k in range(1, len(heap)))
        assert nodes.heap_index[heap].tolist() == [*range(len(heap))]
        assert nodes.heap_index[node] == -1


def test_the_hash_table_finds_exactly_the_added_nodes() -> None:
    """By variable and whole frontier: half of all frontiers are added, and those are found and no others."""
    rng = np.random.default_rng(0)
    trellis = next(case.trellis for case in cases() if case.trellis.chains > 2)
    nodes, added, root = astar._root(trellis, 0.0, 2000), set(), np.int32(0)
    asked = [(var, frontier) for var in range(2 * trellis.chains) for frontier in np.ndindex(*[3] * trellis.chains)]
    for var, frontier in asked:
        if rng.random() < 0.5:
            chain, nodes.frontier[0] = var % trellis.chains, frontier
            astar._add(nodes, root, var, frontier[chain], chain, 0.0, 0.0)
            added.add((var, frontier))
    for var, frontier in asked:
        chain, nodes.frontier[0] = var % trellis.chains, frontier
        found = astar._find(nodes, root, var, frontier[chain], chain)
        assert (found >= 0) == ((var, frontier) in added)
        if found >= 0:
            assert (nodes.var[found], tuple(nodes.frontier[found])) == (var, frontier)


# --- against the search in plain Python -------------------------------------------------------------------------------


def test_compiled_and_plain_search_agree() -> None:
    for case in cases():
        for budget in (3 * case.depth, ENOUGH):
            ours, book = case.search(budget, 1500), ByTheBook(case, budget, 1500)
            if ours.expansions < 1500 and book.expansions < 1500:
                assert ours.cost == pytest.approx(book.cost, abs=ROUNDING)
                assert ours.lower_bound == pytest.approx(book.lower, abs=ROUNDING)


def test_forgetting_without_backing_up_gives_false_bounds() -> None:
    fooled = []
    for case in cases():
        for budget in (case.depth + 10, 2 * case.depth):
            sound, unsound = ByTheBook(case, budget, 600), ByTheBook(case, budget, 600, backup=False)
            assert sound.lower <= case.optimum + ROUNDING
            if unsound.lower > case.optimum + 0.01:
                assert unsound.forgotten > 0
                fooled.append(case)
                assert case.search(budget).lower_bound <= case.optimum + ROUNDING
    assert len(fooled) > 3


@dataclass(eq=False)
class Node:
    var: int
    frontier: tuple[int, ...]
    f: float
    key: float
    parent: Node | None
    number: int
    children: int = 0
    is_open: bool = True


class ByTheBook:
    """A* that forgets the worse half of its leaves when `budget` nodes are held; without `backup` it does so for good.

    Attributes:
        cost, lower: of the best path found, and of all paths as far as it could be proven.
        expansions, forgotten: how many nodes were expanded, and how many leaves forgotten.
    """

    def __init__(self, case: Case, budget: int, expansions: int, *, backup: bool = True) -> None:
        self.case, self.budget, self.backup = case, budget, backup
        self.cost = np.inf
        self.expansions = self.forgotten = self.made = 0
        self.held = 1
        self.root = Node(case.trellis.chains - 1, (0,) * case.trellis.chains, case.bound, case.bound, None, 0)
        self.opened = {self.root}
        self.twins = defaultdict(list)
        self.lower = min(self.run(expansions), self.cost)

    def run(self, expansions: int) -> float:
        while self.opened:
            node = min(self.opened, key=lambda node: (node.key, -node.var, node.number))
            if node.key >= self.cost - SAME_COST_NATS:
                break
            if self.expansions == expansions:
                return node.key
            self.close(node)
            self.expansions += 1
            floor = node.key
            if not self.expand(node):
                return min([floor, *(other.key for other in self.opened)])
            self.release(node)
        return self.cost

    def expand(self, node: Node) -> bool:
        """Make the children of a node; whether there was room for all."""
        floor, var = node.key, node.var + 1
        chain = var % self.case.trellis.chains
        for choice, f in children(self.case, node):
            key = max(f, floor)
            if key >= self.cost - SAME_COST_NATS:
                continue
            if var == len(self.case.trellis.dom_ptr) - 2:
                self.cost = f
                continue
            frontier = (*node.frontier[:chain], choice, *node.frontier[chain + 1 :])
            twin = next(reversed(self.twins[var, frontier]), None)
            if twin is not None and twin.f <= f + SAME_COST_NATS:
                continue
            if twin is not None and twin.is_open and twin.children == 0:
                self.close(twin)
                self.drop(twin)
                if twin.parent is not node:
                    self.release(twin.parent)
            if self.held == self.budget and not self.forget(node):
                return False
            self.made, self.held = self.made + 1, self.held + 1
            child = Node(var, frontier, f, key, node, self.made)
            self.twins[var, frontier].append(child)
            node.children += 1
            self.opened.add(child)
        return True

    def forget(self, current: Node) -> bool:
        """Forget leaves, but not the node that is being expanded; whether there were any."""
        leaves = [node for node in self.opened if node.children == 0 and node not in (self.root, current)]
        leaves.sort(key=lambda node: (-node.key, node.number))
        for leaf in leaves[: (len(leaves) + 1) // 2]:
            parent = leaf.parent
            self.close(leaf)
            self.drop(leaf)
            self.forgotten += 1
            if self.backup:
                parent.key = min(parent.key, leaf.key) if parent.is_open else leaf.key
                parent.is_open = True
                self.opened.add(parent)
            elif parent is not current:
                self.release(parent)
        return bool(leaves)

    def close(self, node: Node) -> None:
        self.opened.remove(node)
        node.is_open = False

    def release(self, node: Node) -> None:
        """Drop a closed node without children, and so its ancestors."""
        while node is not self.root and not node.is_open and node.children == 0:
            self.drop(node)
            node = node.parent

    def drop(self, node: Node) -> None:
        self.twins[node.var, node.frontier].remove(node)
        node.parent.children -= 1
        self.held -= 1


def children(case: Case, node: Node) -> Iterator[tuple[int, float]]:
    """Choices for the next variable, and f with each."""
    trellis = case.trellis
    i = node.var + 1
    chain, frontier = i % trellis.chains, np.array(node.frontier, np.uint16)
    before = trellis.dom_ptr[i - trellis.chains] + node.frontier[chain]
    for e in range(trellis.row_ptr[before], trellis.row_ptr[before + 1]):
        grown = pair_chains.step(trellis, case.tables, i, frontier, e)
        yield int(trellis.row_to[e] - trellis.dom_ptr[i]), node.f + grown


def frontiers(trellis: Trellis) -> int:
    """Number of different nodes: for each variable, the choices of its chain and of all others' latest variables."""
    sizes = np.diff(trellis.dom_ptr).astype(float)
    return int(sum(np.prod(sizes[i - trellis.chains + 1 : i + 1]) for i in range(trellis.chains - 1, len(sizes) - 1)))


def prefixes(trellis: Trellis) -> float:
    """Number of ways to choose all variables, one after another."""
    total = 0.0
    chains = [np.ones(1)] * trellis.chains
    for i in range(trellis.chains, len(trellis.dom_ptr) - 1):
        counts = np.zeros(trellis.dom_ptr[i + 1] - trellis.dom_ptr[i])
        before = range(trellis.dom_ptr[i - trellis.chains], trellis.dom_ptr[i - trellis.chains + 1])
        for p, many in zip(before, chains[i % trellis.chains], strict=True):
            np.add.at(counts, trellis.row_to[trellis.row_ptr[p] : trellis.row_ptr[p + 1]] - trellis.dom_ptr[i], many)
        chains[i % trellis.chains] = counts
        total += float(np.prod([chain.sum() for chain in chains]))
    return total
