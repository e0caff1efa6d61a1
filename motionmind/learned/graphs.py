"""A learned corpus as graphs for other programs: a joint's graph for networkx, the coordination for pgmpy."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from motionmind.arguments import check_text
from motionmind.grammar.coordination import fit_network
from motionmind.learned.model import LearnedCorpus

if TYPE_CHECKING:
    import networkx as nx
    from pgmpy.models import DiscreteBayesianNetwork

N_LIKELIEST_PARENTS = 3  # parent states listed for each state of a joint graph


def joint_graph(learned: LearnedCorpus, joint: str) -> nx.DiGraph:
    """Return the joint graph of a joint (or "facing") as a networkx graph.

    Nodes are states, with `orientation` (x, y, z, w), `visits`, `label` and `given`: the attested parent states that
    make the state likeliest, each with P(state | parent's state). Edges are attested transitions, with `count`,
    `weight` (-log P(next | state), nats), `seconds`, and `attests` and `arrives`, the corpus's postures at either end
    of the first occurrence. The graph's attributes are `corpus`, `joint` and `parent`, which may be None.

    Raises:
        SkeletonError: the corpus has no such joint.
    """
    check_text("joint", joint)
    chain = learned.space.index(joint)
    parent = int(learned.grammar.coordination.parents[chain])
    graph = learned.grammar.transitions.graph(chain)
    graph.graph.update(
        corpus=learned.corpus.name, joint=joint, parent=learned.corpus.chains[parent] if parent >= 0 else None
    )
    given = _likeliest_parents(learned, chain, parent)
    for state, values in graph.nodes(data=True):
        values["orientation"] = tuple(map(float, learned.space.of(chain)[state]))
        values["label"], values["given"] = learned.space.label(chain, state), given[state]
    return graph


def network(learned: LearnedCorpus) -> DiscreteBayesianNetwork:
    """Return the coordination as a pgmpy network over the joints, whose tables give the search its costs."""
    joints = len(learned.corpus.skeleton)
    parents, sizes = learned.corpus.chain_parents[:joints], learned.space.sizes[:joints]
    states, weights = np.asarray(learned.states[:, :joints]), learned.corpus.weights
    return fit_network(learned.corpus.skeleton.names, parents, states, sizes, weights)


def _likeliest_parents(learned: LearnedCorpus, chain: int, parent: int) -> list[tuple[tuple[str, float], ...]]:
    """Return, for each state of a chain, the parent states that make it likeliest, each with P(state | parent's)."""
    if parent < 0:
        return [()] * int(learned.space.sizes[chain])
    pairs = learned.grammar.coordination
    rows = pairs.pair_ptr[pairs.pair_starts[chain] : pairs.pair_starts[chain + 1] + 1]
    listed = slice(rows[0], rows[-1])
    above, below = np.repeat(np.arange(len(rows) - 1), np.diff(rows)), pairs.pair_states[listed]
    likely = np.exp(-pairs.pair_costs[listed])
    order = np.lexsort((above, -likely, below))
    starts = np.searchsorted(below[order], np.arange(int(learned.space.sizes[chain]) + 1))
    best = (order[first : min(first + N_LIKELIEST_PARENTS, last)] for first, last in pairwise(starts))
    return [tuple((learned.space.label(parent, int(above[k])), float(likely[k])) for k in some) for some in best]
