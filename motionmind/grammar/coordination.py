"""Coordination of joints: a Bayesian network over the joint tree, P(state of a joint | state of its parent).

Stuart and Bradley, "Learning the grammar of dance", ICML (1998), coordinate joints by such a network. A joint's
conditional distribution is estimated from the corpus's postures with a Dirichlet prior of `PRIOR_WEIGHT` virtual
postures that are distributed as the joint's marginal. So a pair that was never seen together is expensive, but
possible. For states c of the joint and p of its parent, with N the corpus's counts (each posture by its weight), m the
marginal and a the pseudo-count,

    P(c | p) = (N(p, c) + a m(c)) / (N(p) + a)

The network is a pgmpy one (`fit_network`), and the search's costs are read out of its tables. An unseen pair has
N(p, c) = 0, and costs -log P(c | p) = -log(a m(c)) + log(N(p) + a): a term of c and a term of p. `Coordination` has
that form, which is as large as the pairs that were seen, so a search loads neither pgmpy nor dense tables.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from motionmind._typing import Floats, Int32s, Ints, States
from motionmind.errors import CorpusError
from motionmind.executors.here import this_process
from motionmind.executors.team import Team
from motionmind.grammar.rows import searchsorted_rows

if TYPE_CHECKING:
    from pgmpy.factors.discrete import TabularCPD
    from pgmpy.models import DiscreteBayesianNetwork


PRIOR_WEIGHT = 1.0  # of the Dirichlet prior, in virtual postures
MAX_NETWORK_CELLS = 100_000_000  # of dense tables: 0.8 GB


@dataclass(frozen=True, eq=False)
class Coordination:
    """-log P(state | parent's state) in nats, for all chains in flat arrays; G states, V pair rows, Q pairs seen.

    A chain has one pair row for each state of its parent, `pair_starts[chain] + parent's state`; chains without a
    parent have none. A pair that is not listed costs `child_costs` of the state + `parent_costs` of the pair row.

    Attributes:
        parents: parent chain [L], or -1.
        pair_starts: first pair row of each chain [L + 1].
        pair_ptr: pairs of each pair row [V + 1].
        pair_states: the chain's state in a pair, increasing within a pair row [Q].
        pair_costs: -log P [Q].
        child_costs: -log(a m(c)) for each state, 0 in chains without a parent [G].
        parent_costs: log(N(p) + a) for each pair row [V].
    """

    parents: Ints
    pair_starts: Ints
    pair_ptr: Ints
    pair_states: Int32s
    pair_costs: Floats
    child_costs: Floats
    parent_costs: Floats

    def cost(self, chain: int | Ints, above: int | States, state: int | States, starts: Ints) -> Floats:
        """Return -log P(state | parent's state) of chains, nats, in the shape of the first three arguments together.

        Args:
            chain: the chains, which have parents.
            above: the parents' states.
            state: the chains' states.
            starts: first row of each chain [L + 1].
        """
        row = self.pair_starts[chain] + above
        unseen = self.child_costs[starts[chain] + state] + self.parent_costs[row]
        if not len(self.pair_states):
            return np.asarray(unseen)
        at = searchsorted_rows(self.pair_ptr, self.pair_states, row, state)
        nearest = np.minimum(at, len(self.pair_states) - 1)
        is_listed = (at < self.pair_ptr[row + 1]) & (self.pair_states[nearest] == state)
        return np.where(is_listed, self.pair_costs[nearest], unseen)

    def table(self, chain: int, starts: Ints) -> Floats:
        """Return -log P(c | p) of one chain as a table [states of the parent, states of the chain], nats.

        Args:
            chain: the chain; without a parent its table has no rows.
            starts: first row of each chain [L + 1].
        """
        rows = slice(self.pair_starts[chain], self.pair_starts[chain + 1])
        out = self.parent_costs[rows, None] + self.child_costs[starts[chain] : starts[chain + 1]]
        for p, row in enumerate(range(rows.start, rows.stop)):
            listed = slice(self.pair_ptr[row], self.pair_ptr[row + 1])
            out[p, self.pair_states[listed]] = self.pair_costs[listed]
        return np.asarray(out)


def learn_coordination(
    names: tuple[str, ...],
    parents: Ints,
    states: Int32s,
    sizes: Ints,
    weights: Floats | None = None,
    team: Team | None = None,
) -> Coordination:
    """Learn how joints coordinate: fit the network, and read the search's costs out of its tables.

    A network of more than `MAX_NETWORK_CELLS` cells is not built; the same formula then gives the costs of the pairs.

    Args:
        names: names of the joints, which are the first J of L chains; other chains get no coordination.
        parents: parent chain [L], or -1.
        states: state of each chain in each posture [N, L].
        sizes: number of states of each chain [L].
        weights: weight of each posture [N]; None for 1.
        team: threads, one job per joint; None for the current thread.
    """
    coupled = np.where(np.arange(len(parents)) < len(names), parents, -1).astype(np.int64)
    counted = _count(parents[: len(names)], states, sizes, weights, team)
    is_dense = _count_cells(parents[: len(names)], sizes) <= MAX_NETWORK_CELLS
    network = _build_network(names, parents, sizes, counted) if is_dense else None

    starts = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    child_costs, parent_costs = np.zeros(starts[-1]), [np.zeros(0)]
    pair_counts, pair_states, pair_costs = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], [np.zeros(0)]
    for j in np.flatnonzero(coupled >= 0):
        pairs = counted[j]
        likely, normaliser = (
            _read_table(network.get_cpds(names[j]), pairs) if network else (pairs.likely(), pairs.normaliser)
        )
        child_costs[starts[j] : starts[j + 1]] = -np.log(pairs.prior)
        parent_costs.append(np.log(normaliser))
        pair_counts.append(np.bincount(pairs.above, minlength=len(pairs.visits)))
        pair_states.append(pairs.below)
        pair_costs.append(-np.log(likely))
    rows = np.where(coupled >= 0, np.asarray(sizes)[coupled], 0)
    return Coordination(
        coupled,
        np.concatenate([[0], np.cumsum(rows)]).astype(np.int64),
        np.concatenate([[0], np.cumsum(np.concatenate(pair_counts))]).astype(np.int64),
        np.concatenate(pair_states).astype(np.int32),
        np.concatenate(pair_costs),
        child_costs,
        np.concatenate(parent_costs),
    )


def fit_network(
    names: tuple[str, ...],
    parents: Ints,
    states: Int32s,
    sizes: Ints,
    weights: Floats | None = None,
    team: Team | None = None,
) -> DiscreteBayesianNetwork:
    """Fit a pgmpy network to a corpus's postures.

    Every joint is a node with the state names 0 .. S - 1; `get_cpds("left_knee")` is P(left_knee | left_hip).

    Args:
        names: names of the joints [J].
        parents: parent joint [J], or -1.
        states: state of each joint in each posture [N, J].
        sizes: number of states of each joint [J].
        weights: weight of each posture [N]; None for 1.
        team: threads, one job per joint; None for the current thread.

    Raises:
        CorpusError: the network's tables would have more than `MAX_NETWORK_CELLS` cells.
    """
    cells = _count_cells(parents, sizes)
    if cells > MAX_NETWORK_CELLS:
        raise CorpusError(
            f"a network over these states needs {cells:,} cells, more than {MAX_NETWORK_CELLS:,}: learn with a coarser "
            "tolerance, or read the coordination's lists of pairs"
        )
    return _build_network(names, parents, sizes, _count(parents, states, sizes, weights, team))


class _PairCounts(NamedTuple):
    """Counts of Q pairs: one of a joint's C states with one of its parent's P states. A root has one "parent" state.

    Attributes:
        above: the parent's state p in each pair, not decreasing [Q].
        below: the joint's state c in each pair, increasing with the same p [Q].
        together: N(p, c), the weight of the postures in both [Q].
        visits: N(p), the weight of the postures in each state of the parent [P].
        prior: a m(c), the virtual postures in each state of the joint [C].
    """

    above: Ints
    below: Ints
    together: Floats
    visits: Floats
    prior: Floats

    @property
    def normaliser(self) -> Floats:
        """N(p) + a [P]."""
        return self.visits + PRIOR_WEIGHT

    def likely(self) -> Floats:
        """Return P(c | p) of each pair [Q]."""
        return (self.together + self.prior[self.below]) / self.normaliser[self.above]

    def table(self) -> Floats:
        """Return P(c | p) of all pairs, seen or not [C, P]."""
        table = self.prior[:, None] / self.normaliser
        table[self.below, self.above] = self.likely()
        return table


def _count(
    parents: Ints, states: Int32s, sizes: Ints, weights: Floats | None, team: Team | None
) -> tuple[_PairCounts, ...]:
    """Count the pairs of each joint; arguments as for `fit_network`."""
    weights = np.ones(len(states)) if weights is None else np.asarray(weights)

    def count(j: int) -> _PairCounts:
        above = states[:, parents[j]].astype(np.int64) if parents[j] >= 0 else np.zeros(len(states), dtype=np.int64)
        most = sizes[parents[j]] if parents[j] >= 0 else 1
        visits = np.asarray(np.bincount(above, weights, most), dtype=np.float64)
        keys, which = np.unique(above * sizes[j] + states[:, j], return_inverse=True)
        together = np.asarray(np.bincount(which, weights, len(keys)), dtype=np.float64)
        prior = PRIOR_WEIGHT * np.bincount(states[:, j], weights, sizes[j]) / weights.sum()
        return _PairCounts(keys // sizes[j], keys % sizes[j], together, visits, prior)

    return tuple((team or this_process()).map(count, range(len(parents))))


def _count_cells(parents: Ints, sizes: Ints) -> int:
    """Return the number of cells in the tables of joints with parents."""
    return sum(int(sizes[j]) * int(sizes[p]) for j, p in enumerate(parents) if p >= 0)


def _build_network(
    names: tuple[str, ...], parents: Ints, sizes: Ints, counted: tuple[_PairCounts, ...]
) -> DiscreteBayesianNetwork:
    """Build the network from the counts of each joint and let pgmpy check it; other arguments as for `fit_network`."""
    from pgmpy.factors.discrete import TabularCPD
    from pgmpy.models import DiscreteBayesianNetwork

    network = DiscreteBayesianNetwork()
    network.add_nodes_from(names)
    network.add_edges_from((names[parents[j]], name) for j, name in enumerate(names) if parents[j] >= 0)
    state_names = {name: list(range(sizes[j])) for j, name in enumerate(names)}
    for j, name in enumerate(names):
        above = [names[parents[j]]] if parents[j] >= 0 else []
        network.add_cpds(
            TabularCPD(
                name,
                len(state_names[name]),
                counted[j].table(),
                evidence=above,
                evidence_card=[len(state_names[parent]) for parent in above],
                state_names={one: state_names[one] for one in (name, *above)},
            )
        )
    network.check_model()
    return network


def _read_table(cpd: TabularCPD, pairs: _PairCounts) -> tuple[Floats, Floats]:
    """Return P(c | p) of the pairs seen [Q] and N(p) + a of each parent's state [P], read from a joint's table."""
    table = np.asarray(cpd.get_values(), dtype=np.float64)
    seen = np.zeros(table.shape, dtype=np.bool_)
    seen[pairs.below, pairs.above] = True
    unseen, columns = np.argmin(seen, axis=0), np.arange(table.shape[1])
    # An unseen pair has the probability a m(c) / (N(p) + a); a column without unseen pairs needs no normaliser.
    normaliser = np.where(seen.all(axis=0), pairs.normaliser, pairs.prior[unseen] / table[unseen, columns])
    return table[pairs.below, pairs.above], normaliser
