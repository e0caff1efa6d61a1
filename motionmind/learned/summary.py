"""What a corpus holds and how well it hangs together."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Int32s
from motionmind.corpus.corpus import Clip, Corpus
from motionmind.errors import MotionMindError
from motionmind.grammar.grammar import Grammar


def summarise(corpus: Corpus, grammar: Grammar) -> dict[str, Any]:
    """What a corpus is and how large, as plain values for JSON; states and edges for each chain."""
    graph = grammar.transitions
    return {
        "name": corpus.name,
        "title": corpus.title,
        "author": corpus.author,
        "source": corpus.source,
        "licence": corpus.licence,
        "clips": [{"name": clip.label, "postures": len(clip), "about": clip.about} for clip in corpus.clips],
        "origins": origins(corpus),
        "postures": len(corpus),
        "moves": len(corpus.begins),
        "skeleton": corpus.skeleton.name,
        "joints": list(corpus.skeleton.names),
        "facing": corpus.facing,
        "rate": corpus.rate,
        "states": _by_chain(grammar, graph.sizes()),
        "edges": _by_chain(grammar, np.diff(graph.indptr[graph.starts])),
    }


def origins(corpus: Corpus) -> list[dict[str, Any]]:
    """Where a corpus comes from, as plain values for JSON: for each corpus that it was made of, and for what of that is
    mirrored, reversed or of another weight, the clips, postures and moves, what each move counts, and the share of all
    moves that they make."""
    found: dict[tuple[str, bool, bool, float], list[Clip]] = {}
    for backwards in (False, True):
        for clip in corpus.clips:
            if clip.reverse is not None or not backwards:
                weight = clip.reverse_weight if backwards else clip.weight
                found.setdefault((clip.corpus or corpus.name, clip.mirrored, backwards, weight), []).append(clip)
    total = float(corpus.moves.weights.sum())
    return [
        {
            "corpus": name,
            "mirrored": is_mirrored,
            "reversed": backwards,
            "clips": len(clips),
            "postures": sum(map(len, clips)),
            "moves": sum(len(clip) - 1 for clip in clips),
            "weight": weight,
            "share": weight * sum(len(clip) - 1 for clip in clips) / total,
        }
        for (name, is_mirrored, backwards, weight), clips in found.items()
    ]


def check_corpus(corpus: Corpus, grammar: Grammar, states: Int32s, pairs: int = 2000, seed: int = 0) -> dict[str, Any]:
    """`summarise`, and how well the corpus hangs together, as plain values for JSON.

    `joinable` is the share of random pairs of the corpus's postures such that every chain has attested moves that lead
    from one state to the other, however many; `out_degree` the mean number of states that a state leads to.
    """
    if pairs < 1:
        raise MotionMindError(f"the number of pairs must be at least 1, not {pairs}")
    if seed < 0:
        raise MotionMindError(f"a seed must be a whole number of at least 0, not {seed}")
    graph = grammar.transitions
    degree = np.diff(graph.indptr[graph.starts]) / graph.sizes()
    return {
        **summarise(corpus, grammar),
        "joinable": joinable(grammar, states, pairs, seed),
        "pairs": pairs,
        "seed": seed,
        "out_degree": _by_chain(grammar, np.round(degree, 3)),
        "faults": [
            {"clip": f.clip, "joint": f.joint, "frame": f.frame, "degrees": round(f.degrees, 1)} for f in corpus.faults
        ],
    }


def joinable(grammar: Grammar, states: Int32s, pairs: int, seed: int) -> float:
    """Share of `pairs` random pairs of postures that attested moves alone can join."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order

    graph = grammar.transitions
    drawn = np.random.default_rng(seed).integers(len(states), size=(pairs, 2))
    joined = np.ones(pairs, dtype=bool)
    for chain, size in enumerate(graph.sizes()):
        first = graph.starts[chain]
        rows = slice(graph.indptr[first], graph.indptr[first + size])
        chain_graph = csr_array(
            (np.ones(rows.stop - rows.start), graph.targets[rows], graph.indptr[first : first + size + 1] - rows.start),
            shape=(size, size),
        )
        a, b = states[drawn[:, 0], chain], states[drawn[:, 1], chain]
        for state in np.unique(a):
            reached = np.zeros(size, dtype=bool)
            reached[breadth_first_order(chain_graph, state, return_predecessors=False)] = True
            joined[a == state] &= reached[b[a == state]]
    return float(joined.mean())


def _by_chain(grammar: Grammar, values: NDArray[Any]) -> dict[str, Any]:
    return dict(zip(grammar.chains, values.tolist(), strict=True))
