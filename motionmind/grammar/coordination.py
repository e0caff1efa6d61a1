"""Coordination of joints: a Bayesian network over the joint tree, P(state of a joint | state of its parent).

Stuart and Bradley, "Learning the grammar of dance", ICML (1998), coordinate joints by such a network. A joint's
conditional distribution is estimated from the corpus's postures with a Dirichlet prior of `PSEUDO_COUNT` virtual
postures that are distributed as the joint's marginal. So a pair that was never seen together is expensive, but
possible. For states c of the joint and p of its parent, with N the corpus's counts (each posture by its weight), m the
marginal and a the pseudo-count,

    P(c | p) = (N(p, c) + a m(c)) / (N(p) + a)

If N(p, c) = 0, then -log P(c | p) = -log(a m(c)) + log(N(p) + a): a term of c and a term of p. Learning and search have
it in that form, which is as large as the pairs that were seen. A pgmpy network (`fit_network`) says the same in dense
tables, for whoever wants to ask other things of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from motionmind._typing import Floats, Int32s, Ints, States
from motionmind.errors import CorpusError
from motionmind.executors.here import this_process
from motionmind.executors.team import Team
from motionmind.grammar.rows import insertion_points

if TYPE_CHECKING:
    from pgmpy.models import DiscreteBayesianNetwork


PSEUDO_COUNT = 1.0  # virtual postures in the Dirichlet prior
MOST_CELLS = 100_000_000  # of the dense tables of a network: 0.8 GB, and pgmpy copies them


@dataclass(frozen=True, eq=False)
class Coordination:
    """-log P(state | parent's state) in nats for all chains, flat; G states, V pair rows, Q pairs seen.

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
        at = insertion_points(self.pair_ptr, self.pair_states, row, state)
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


def count_coordination(
    parents: Ints,
    states: Int32s,
    sizes: Ints,
    joints: int,
    weights: Floats | None = None,
    team: Team | None = None,
) -> Coordination:
    """Count how joints coordinate.

    Args:
        parents: parent chain [L], or -1.
        states: state of each chain in each posture [N, L].
        sizes: number of states of each chain [L].
        joints: number of the first chains, which are joints; others get no coordination.
        weights: weight of each posture [N]; None for 1.
        team: threads, for which each joint is a job; None for this one.
    """
    weights = np.ones(len(states)) if weights is None else np.asarray(weights)
    starts = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    coupled = np.where(np.arange(len(parents)) < joints, parents, -1).astype(np.int64)
    rows = np.where(coupled >= 0, np.asarray(sizes)[coupled], 0)
    child_costs = np.zeros(starts[-1])

    def count_pairs(j: int) -> tuple[Ints, Ints, Floats, Floats]:
        parent = coupled[j]
        prior = PSEUDO_COUNT * np.bincount(states[:, j], weights, sizes[j]) / weights.sum()
        visits = np.bincount(states[:, parent], weights, sizes[parent]) + PSEUDO_COUNT
        keys, which = np.unique(states[:, parent].astype(np.int64) * sizes[j] + states[:, j], return_inverse=True)
        p, c = keys // sizes[j], keys % sizes[j]
        costs = np.log(visits[p]) - np.log(np.bincount(which, weights, len(keys)) + prior[c])
        child_costs[starts[j] : starts[j + 1]] = -np.log(prior)
        return np.bincount(p, minlength=sizes[parent]), c, costs, np.log(visits)

    none = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0)
    found = (team or this_process()).map(count_pairs, np.flatnonzero(coupled >= 0).tolist())
    pair_counts, pair_states, pair_costs, parent_costs = map(np.concatenate, zip(none, *found, strict=True))
    return Coordination(
        coupled,
        np.concatenate([[0], np.cumsum(rows)]).astype(np.int64),
        np.concatenate([[0], np.cumsum(pair_counts)]).astype(np.int64),
        pair_states.astype(np.int32),
        pair_costs,
        child_costs,
        parent_costs,
    )


def fit_network(
    names: tuple[str, ...], parents: Ints, states: Int32s, sizes: Ints, weights: Floats | None = None
) -> DiscreteBayesianNetwork:
    """Fit a pgmpy network to a corpus's postures.

    Every joint is a node with the state names 0 .. S - 1; `get_cpds("left_knee")` is P(left_knee | left_hip).

    Args:
        names: names of the joints [J].
        parents: parent joint [J], or -1.
        states: state of each joint in each posture [N, J].
        sizes: number of states of each joint [J].
        weights: weight of each posture [N]; None for 1.

    Raises:
        CorpusError: the network's tables would have more than MOST_CELLS cells.
    """
    cells = sum(int(sizes[j]) * int(sizes[p]) for j, p in enumerate(parents) if p >= 0)
    if cells > MOST_CELLS:
        raise CorpusError(
            f"a network over these states has {cells:,} cells, and can have {MOST_CELLS:,}: learn with a coarser "
            "tolerance, or read the coordination's lists of pairs"
        )
    import pandas as pd
    from pgmpy.models import DiscreteBayesianNetwork
    from pgmpy.parameter_estimator import DiscreteBayesianEstimator

    network = DiscreteBayesianNetwork()
    network.add_nodes_from(names)
    network.add_edges_from((names[p], name) for name, p in zip(names, parents, strict=True) if p >= 0)
    prior = {}
    weights = np.ones(len(states)) if weights is None else np.asarray(weights)
    for j, name in enumerate(names):
        marginal = np.bincount(states[:, j], weights, sizes[j]) / weights.sum()
        columns = sizes[parents[j]] if parents[j] >= 0 else 1
        prior[name] = np.repeat(PSEUDO_COUNT * marginal[:, None], columns, axis=1)
    estimator = DiscreteBayesianEstimator(
        state_names={name: list(range(sizes[j])) for j, name in enumerate(names)},
        prior_type="dirichlet",
        pseudo_counts=prior,
    )
    frame = pd.DataFrame({name: states[:, j] for j, name in enumerate(names)})
    network.add_cpds(*estimator.fit(network, frame, sample_weight=weights).parameters_)
    return network
