"""Summaries of a corpus: its contents, its origins, and how well it is connected.

`corpus info` and `corpus check` write the structs as JSON, with the fields in this order.
"""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Bools, Int32s, Ints
from motionmind.arguments import check_integer
from motionmind.corpus.clip import Clip, Repair
from motionmind.corpus.corpus import Corpus, Facing
from motionmind.errors import MotionMindError
from motionmind.grammar.grammar import Grammar


class ClipSummary(msgspec.Struct, frozen=True):
    """A clip of a corpus.

    Attributes:
        name: the clip's label.
        postures: number of its postures.
        about: a line on its content.
        performer: its performer; the corpus's author if the performer is not known.
    """

    name: str
    postures: int
    about: str
    performer: str


class OriginSummary(msgspec.Struct, frozen=True):
    """The clips of a corpus with one origin: the same corpus, mirroring, direction and weight.

    Attributes:
        corpus: the corpus that they come from.
        mirrored: whether left and right are exchanged.
        reversed: whether they run backwards.
        clips: number of clips.
        postures: number of their postures.
        moves: number of their moves.
        weight: weight of a move.
        share: weighted share of all moves of the corpus, from 0 to 1.
        licence: the licence of that corpus.
    """

    corpus: str
    mirrored: bool
    reversed: bool
    clips: int
    postures: int
    moves: int
    weight: float
    share: float
    licence: str


class FlipReport(msgspec.Struct, frozen=True):
    """A joint that flips between two frames of a recording.

    Attributes:
        clip: name of the clip.
        joint: name of the joint.
        frame: the first frame after the flip.
        degrees: angle of the flip, rounded to a tenth.
        repair: "put back" if a half turn was undone; "reconstructed" if the joint was interpolated; "none" if the flip
            was kept, or the recording cut there.
    """

    clip: str
    joint: str
    frame: int
    degrees: float
    repair: Repair


class RepairReport(msgspec.Struct, frozen=True):
    """Frames of a recording in which a joint was mended.

    Attributes:
        clip: label of the clip.
        joint: name of the joint.
        start: the first of the frames.
        stop: the frame after the last.
        exact: whether a half turn was undone; otherwise the joint was interpolated.
    """

    clip: str
    joint: str
    start: int
    stop: int
    exact: bool


class CorpusSummary(msgspec.Struct, frozen=True, kw_only=True):
    """A corpus's description and size.

    Attributes:
        name: its name.
        title: a one-line description.
        author: its author.
        source: where it comes from.
        licence: the licence for its use.
        citation: how to cite it; "" if no citation is requested.
        clips: its clips.
        origins: the corpora that its clips come from.
        postures: number of postures.
        moves: number of moves from posture to posture.
        skeleton: name of the body.
        joints: the joints' names.
        facing: "stage" or "free", as in Corpus.
        rate: postures a second of recorded clips; None if all postures are keyframes with times of their own.
        states: number of states, by chain.
        edges: number of attested moves from state to state, by chain.
        repairs: the repairs of its recordings.
    """

    name: str
    title: str
    author: str
    source: str
    licence: str
    citation: str
    clips: list[ClipSummary]
    origins: list[OriginSummary]
    postures: int
    moves: int
    skeleton: str
    joints: list[str]
    facing: Facing
    rate: float | None
    states: dict[str, int]
    edges: dict[str, int]
    repairs: list[RepairReport]


class CorpusCheck(CorpusSummary, frozen=True, kw_only=True):
    """A summary, and how well the corpus is connected.

    Attributes:
        joinable: share of random pairs of postures that any number of attested moves joins in every chain.
        pairs: number of random pairs.
        seed: seed of the random pairs.
        out_degree: mean number of successors of a state, by chain.
        faults: flips of joints in the corpus's recordings.
    """

    joinable: float
    pairs: int
    seed: int
    out_degree: dict[str, float]
    faults: list[FlipReport]


def summarise(corpus: Corpus, grammar: Grammar) -> CorpusSummary:
    """Summarise a corpus and its grammar; states and edges are counted for each chain."""
    return CorpusSummary(**_summary_values(corpus, grammar))


def check_corpus(corpus: Corpus, grammar: Grammar, states: Int32s, pairs: int = 2000, seed: int = 0) -> CorpusCheck:
    """Summarise a corpus, and measure how well it is connected.

    Args:
        corpus: the movement.
        grammar: what was learned of its states.
        states: states of its postures [N, L].
        pairs: number of random pairs of postures to try to join.
        seed: seed of the random pairs, at least 0.

    Raises:
        MotionMindError: `pairs` or `seed` is out of its range.
    """
    check_integer("pairs", pairs)
    check_integer("seed", seed)
    if pairs < 1:
        raise MotionMindError(f"the number of pairs must be at least 1, not {pairs}")
    if seed < 0:
        raise MotionMindError(f"a seed must be a whole number of at least 0, not {seed}")
    graph = grammar.transitions
    degree = np.diff(graph.indptr[graph.starts]) / graph.sizes()
    return CorpusCheck(
        **_summary_values(corpus, grammar),
        joinable=joinable(grammar, states, pairs, seed),
        pairs=pairs,
        seed=seed,
        out_degree=_by_chain(grammar, np.round(degree, 3)),
        faults=[FlipReport(f.clip, f.joint, f.frame, round(f.degrees, 1), f.repair) for f in corpus.faults],
    )


def to_plain(summary: CorpusSummary) -> dict[str, Any]:
    """Return a summary as plain values for JSON, in the order of its fields."""
    plain: dict[str, Any] = msgspec.to_builtins(summary, enc_hook=_plain_number)
    return plain


def _plain_number(value: Any) -> Any:
    """Return a NumPy number, such as a weight from a caller, as a Python number."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} cannot be written as JSON")


def _summary_values(corpus: Corpus, grammar: Grammar) -> dict[str, Any]:
    """Return the values of a CorpusSummary by the names of its fields."""
    graph = grammar.transitions
    return {
        "name": corpus.name,
        "title": corpus.title,
        "author": corpus.author,
        "source": corpus.source,
        "licence": corpus.licence,
        "citation": corpus.citation,
        "clips": [
            ClipSummary(clip.label, len(clip), clip.about, corpus.credit_of(clip).performer) for clip in corpus.clips
        ],
        "origins": origins(corpus),
        "postures": len(corpus),
        "moves": len(corpus.moves),
        "skeleton": corpus.skeleton.name,
        "joints": list(corpus.skeleton.names),
        "facing": corpus.facing,
        "rate": corpus.rate,
        "states": _by_chain(grammar, graph.sizes()),
        "edges": _by_chain(grammar, np.diff(graph.indptr[graph.starts])),
        "repairs": [
            RepairReport(clip.label, one.joint, one.start, one.stop, one.exact)
            for clip in corpus.clips
            for one in clip.repairs
            if not clip.mirrored
        ],
    }


def origins(corpus: Corpus) -> list[OriginSummary]:
    """Return the origins of a corpus's clips, grouped by corpus, mirroring, direction and weight."""
    groups: dict[tuple[str, bool, bool, float], list[Clip]] = {}
    for backwards in (False, True):
        for clip in corpus.clips:
            if clip.reverse is not None or not backwards:
                weight = clip.reverse_weight if backwards else clip.weight
                groups.setdefault((clip.corpus or corpus.name, clip.mirrored, backwards, weight), []).append(clip)
    total = float(corpus.moves.weights.sum())
    out = []
    for (name, is_mirrored, backwards, weight), clips in groups.items():
        moves = sum(len(clip) - 1 for clip in clips)
        share = weight * moves / total
        postures = sum(map(len, clips))
        licence = corpus.clip_origins[name].licence
        out.append(OriginSummary(name, is_mirrored, backwards, len(clips), postures, moves, weight, share, licence))
    return out


def joinable(grammar: Grammar, states: Int32s, pairs: int, seed: int) -> float:
    """Return the share of random pairs of postures that attested moves alone can join.

    Args:
        grammar: what was learned of the states.
        states: states of the corpus's postures [N, L].
        pairs: number of pairs.
        seed: seed of the random pairs.
    """
    chosen = np.random.default_rng(seed).integers(len(states), size=(pairs, 2))
    return float(joined_pairs(grammar, states, chosen).all(axis=1).mean())


def joined_pairs(grammar: Grammar, states: Int32s, pairs: Ints) -> Bools:
    """Return whether attested moves alone lead from one posture of a pair to the other, by chain [P, L].

    Args:
        grammar: what was learned of the states.
        states: states of the corpus's postures [N, L].
        pairs: numbers of the postures [P, 2].
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order

    graph = grammar.transitions
    joined = np.zeros((len(pairs), states.shape[1]), dtype=bool)
    for chain, size in enumerate(graph.sizes()):
        first = graph.starts[chain]
        rows = slice(graph.indptr[first], graph.indptr[first + size])
        chain_graph = csr_array(
            (np.ones(rows.stop - rows.start), graph.targets[rows], graph.indptr[first : first + size + 1] - rows.start),
            shape=(size, size),
        )
        a, b = states[pairs, chain].T
        for state in np.unique(a):
            reached = np.zeros(size, dtype=bool)
            reached[breadth_first_order(chain_graph, state, return_predecessors=False)] = True
            joined[a == state, chain] = reached[b[a == state]]
    return joined


def _by_chain(grammar: Grammar, values: NDArray[Any]) -> dict[str, Any]:
    return dict(zip(grammar.chains, values.tolist(), strict=True))
