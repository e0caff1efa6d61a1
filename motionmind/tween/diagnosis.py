"""Diagnose a request without a path: the blocked joints, their states in A and B, and possible remedies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, shortest_path

from motionmind._typing import Floats, Ints
from motionmind.body.mirror import find_sides
from motionmind.corpus.corpus import FACING, Corpus
from motionmind.discretize.codebook import codebook
from motionmind.discretize.states import StateSpace, nearest
from motionmind.errors import SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.grammar.grammar import Grammar
from motionmind.search.problem import Model, Rules


@dataclass(frozen=True)
class Remedy:
    """A change that would give a joint a path, and the fewest moves of such a path."""

    what: str
    moves: int


@dataclass(frozen=True)
class Gap:
    """The names of the two nearest states across a gap in a joint graph, and the angle between them."""

    before: str
    after: str
    degrees: float


@dataclass(frozen=True)
class BlockedJoint:
    """A joint without a path from its state in A to its state in B.

    Attributes:
        joint: its name.
        start: name of its state in A.
        goal: name of its state in B.
        needs: fewest moves that it needs; None if no number suffices.
        ahead: number of states reachable from its state in A, itself included.
        behind: number of states from which its state in B is reachable.
        gap: the nearest pair of states from these two sets, if `needs` is None.
        remedies: changes that would give it a path.
    """

    joint: str
    start: str
    goal: str
    needs: int | None
    ahead: int
    behind: int
    gap: Gap | None
    remedies: tuple[Remedy, ...]


@dataclass(frozen=True)
class Diagnosis:
    """The reason why there is no path.

    Attributes:
        max_moves: greatest number of moves allowed.
        strict: whether bridges were forbidden.
        faults: the joints without a path.
        helps: changes that would give all of them a path.
    """

    max_moves: int
    strict: bool
    faults: tuple[BlockedJoint, ...]
    helps: tuple[str, ...]

    def plain(self) -> dict[str, Any]:
        """Return the diagnosis as plain values for JSON."""
        return asdict(self)

    def __str__(self) -> str:
        many = f"{self.max_moves} move{'s' * (self.max_moves != 1)}"
        helps = (
            "without strict, bridges may join them; so may a coarser tolerance" if self.strict else "allow more moves"
        )
        return "\n".join([f"no path from A to B in at most {many} ({helps}):", *self._lines()])

    def _lines(self) -> Iterator[str]:
        for fault in self.faults:
            if fault.gap:
                yield (
                    f"  {fault.joint}: {fault.start} leads to {fault.ahead} states, and {fault.behind} lead to "
                    f"{fault.goal}, with none in common; the nearest are {fault.gap.before} and {fault.gap.after}, "
                    f"{fault.gap.degrees:.1f} degrees apart"
                )
            else:
                yield f"  {fault.joint} needs {fault.needs} moves from {fault.start} to {fault.goal}"
            if fault.remedies:
                found = (f"{r.what} (in {r.moves} move{'s' * (r.moves != 1)})" for r in fault.remedies)
                yield f"    would join them: {', '.join(found)}"
        if len(self.faults) > 1 and self.helps:
            yield f"  would join all of them: {', '.join(self.helps)}"


def diagnose(
    model: Model,
    grammar: Grammar,
    corpus: Corpus,
    space: StateSpace,
    start: Ints,
    goal: Ints,
    rules: Rules,
    strict: bool,
) -> Diagnosis:
    """Find the joints without a path from states `start` [L] to `goal` [L] under `rules`, and remedies for them.

    The remedies tried for each joint are bridges, if `strict` forbade them; learning the corpus backwards too; learning
    it mirrored too, as far as its states allow; and coarser states. A joint may wait at its goal, so a path exists if
    each joint has a short enough path.
    """
    faults = []
    for chain in range(len(grammar.chains)):
        first, last = model.starts[chain], model.starts[chain + 1]
        rows = slice(model.indptr[first], model.indptr[last])
        edges = np.repeat(np.arange(last - first), np.diff(model.indptr[first : last + 1])), model.targets[rows]
        graph, a, b = _graph(*edges, last - first), int(start[chain]), int(goal[chain])
        needs = _moves(graph, a, b)
        if needs is not None and needs <= rules.longest:
            continue
        tried = _remedies(graph, grammar, corpus, space, chain, a, b, strict)
        remedies = tuple(Remedy(what, moves) for what, moves in tried if moves is not None and moves <= rules.longest)
        ahead = breadth_first_order(graph, a, return_predecessors=False)
        behind = breadth_first_order(graph.T.tocsr(), b, return_predecessors=False)
        centres = space.of(chain)
        cosines = np.abs(centres[ahead] @ centres[behind].T)
        i, k = np.unravel_index(int(cosines.argmax()), cosines.shape)
        degrees = float(np.degrees(2.0 * np.arccos(min(1.0, cosines[i, k]))))
        gap = (
            Gap(_state_name(space, chain, ahead[i]), _state_name(space, chain, behind[k]), degrees)
            if needs is None
            else None
        )
        ends = _state_name(space, chain, a), _state_name(space, chain, b)
        faults.append(BlockedJoint(grammar.chains[chain], *ends, needs, len(ahead), len(behind), gap, remedies))
    every = [{remedy.what for remedy in fault.remedies} for fault in faults]
    helps = tuple(sorted(set.intersection(*every))) if every else ()
    return Diagnosis(rules.longest, strict, tuple(faults), helps)


def _remedies(
    graph: csr_array, grammar: Grammar, corpus: Corpus, space: StateSpace, chain: int, a: int, b: int, strict: bool
) -> Iterator[tuple[str, int | None]]:
    """Yield each change that might lead a chain from state `a` to `b`, with the moves it then needs; None if stuck."""
    if strict:
        first, last = grammar.transitions.starts[chain], grammar.transitions.starts[chain + 1]
        indptr = grammar.bridges.indptr[first : last + 1]
        sources = np.repeat(np.arange(last - first), np.diff(indptr))
        bridged = _graph(sources, grammar.bridges.targets[indptr[0] : indptr[-1]], last - first)
        yield "bridges, without strict", _moves(graph + bridged, a, b)
    yield "the corpus learned backwards too (--reverse)", _moves(graph + graph.T, a, b)
    mirrored = _mirrored(grammar, corpus, space, chain)
    if mirrored is not None:
        yield "the corpus learned in a mirror too (--mirror)", _moves(graph + mirrored, a, b)
    if grammar.chains[chain] != FACING:
        for ratio in (1.25, 1.5, 2.0, 3.0):
            degrees = ratio * float(space.tolerances[chain])
            moves = _coarser(corpus, space.of(chain)[[a, b]], chain, min(degrees, 180.0))
            if moves is not None:
                yield f"a tolerance of {degrees:g} degrees for {grammar.chains[chain]}", moves
                break


def _mirrored(grammar: Grammar, corpus: Corpus, space: StateSpace, chain: int) -> csr_array | None:
    """Mirror the moves of a chain's partner onto the chain's own states.

    Return None if the body has no mirror image, or if the chain's image is not simply its partner's reflection.
    """
    graph = grammar.transitions
    if grammar.chains[chain] == FACING:
        partner, image = chain, space.of(chain) * np.array([-1.0, -1.0, -1.0, 1.0])
    else:
        try:
            sides = find_sides(corpus.skeleton)
        except SkeletonError:
            return None
        if chain == 0 and sides.axis != sides.world:
            return None
        partner = int(sides.partners[chain])
        image = rot.mirror(space.of(partner), sides.axis)
    here, cosines = nearest(image, space.of(chain))
    near = np.degrees(2.0 * np.arccos(np.minimum(cosines, 1.0))) <= space.tolerances[chain]
    first, last = graph.starts[partner], graph.starts[partner + 1]
    rows = slice(graph.indptr[first], graph.indptr[last])
    sources = np.repeat(np.arange(last - first), np.diff(graph.indptr[first : last + 1]))
    targets = graph.targets[rows]
    kept = near[sources] & near[targets]
    return _graph(here[sources[kept]], here[targets[kept]], int(space.sizes[chain]))


def _coarser(corpus: Corpus, ends: Floats, chain: int, degrees: float) -> int | None:
    """Return the moves that a joint needs between two orientations [2, 4] after relearning states `degrees` wide."""
    orientations = corpus.to_chains(corpus.rotations)[:, chain]
    centres = codebook(orientations, degrees)
    states, (a, b) = nearest(orientations, centres)[0], nearest(ends, centres)[0]
    return _moves(_graph(states[corpus.moves.begins], states[corpus.moves.ends], len(centres)), int(a), int(b))


def _graph(sources: NDArray[Any], targets: NDArray[Any], size: int) -> csr_array:
    return csr_array((np.ones(len(sources)), (sources, targets)), shape=(size, size))


def _moves(graph: csr_array, a: int, b: int) -> int | None:
    """Return the fewest moves from one state to another; None if there is no path."""
    hops = shortest_path(graph, unweighted=True, indices=a)[b]
    return int(hops) if np.isfinite(hops) else None


def _state_name(space: StateSpace, chain: int, state: int) -> str:
    """Return a state's number, and its name if it has one."""
    number, name = f"state {state}", space.label(chain, int(state))
    return number if name == number else f"{number} ({name})"
