"""Write the problem of a fixed number of moves in toulbar2's cfn format, so that anyone can check an optimum.

The format: "cost function network", JSON with `problem`, `variables` and `functions` (toulbar2's documentation, "User
guide: file formats, cfn format"). A cost at or above `mustbe` forbids.

The cost of a path is the sum of all functions. The variable chain_t is the state of a chain after move t. Each
ingredient of the cost has its own functions:

    moves                   the price of all moves
    allowed_chain_t         lists the edges into chain_t, at no cost, and forbids all others
    KIND_chain_t            lists the edges of one kind, such as bridges, with their costs
    network_chain_t         corrects the coupling to the parent chain for pairs of states
    network_chain_t_child   the separable part of the coupling: what the chain's state costs
    network_chain_t_parent  and what the parent's state costs
    guide_chain_t           the guide's cost of the state at this move

The word before the first underscore names the ingredient. A kind without edges has no function; nor has a network or
a guide that is 0 throughout.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.search.problem import Model, Problem
from motionmind.search.trellis import Trellis, segment_trellises


class Ingredients(NamedTuple):
    """The ingredients of a model's costs, which the model itself adds up.

    Attributes:
        kinds: names of the kinds of edges [K], without underscores.
        kind: the kind of each edge of the problem's model with waits, from 0 to K - 1 [E].
        child: the part of `Model.unary` that comes from the coupling of each state's chain to its parent, nats [G].
        parent: the part that comes from the parent's state in the coupling, for each pair row of the model, nats [sum].
    """

    kinds: Sequence[str]
    kind: Ints
    child: Floats
    parent: Floats


class _Function(NamedTuple):
    """A cost function of two variables, of one, or of none.

    Attributes:
        name: its name.
        scope: names of its variables.
        costs: nats [n], of the listed pairs; for one variable, of each value; for none, of every path (n = 1).
        pairs: the listed pairs of values of two variables [n, 2]; else None.
        forbids: whether other pairs are forbidden; otherwise they cost 0.
    """

    name: str
    scope: list[str]
    costs: Floats
    pairs: Ints | None = None
    forbids: bool = False


def cfn(problem: Problem, moves: int, names: Sequence[str], ingredients: Ingredients) -> str:
    """Write the problem of exactly `moves` moves, with the costs that the search minimises.

    Variables are named chain_t, and their values after the chain's states, such as "s12". A state that is a move is
    named after the places that it joins, such as "s7_s12"; a chain then continues from a via as a variable chain_t_on
    with values such as "s12". The optimum is the cost in a certificate, including the price of the moves.

    Args:
        problem: the problem; each via names the move at which it is passed.
        moves: number of moves T.
        names: names of the chains [L].
        ingredients: the ingredients of its costs.

    Raises:
        ValueError: a via has no move.
    """
    stops = [0]
    for number, via in enumerate(problem.vias, start=1):
        if via.move is None:
            raise ValueError(f"via {number} has no move; cfn needs the move of each via")
        stops.append(via.move)
    model, timed = problem.model_with_waits(), problem.timed_costs(moves)
    words = _value_names(model)
    variables: dict[str, list[str]] = {}
    functions = [_Function("moves", [], np.array([problem.rules.per_move * moves]))]
    for first, trellis in zip(stops, segment_trellises(problem, [*stops, moves]), strict=True):
        segment = _segment(model, trellis, first, names, words, variables)
        kind = ingredients.kind[_model_edges(model, segment)]
        for i in range(trellis.chains, len(segment.names)):
            functions += _edges(segment, i, ingredients.kinds, kind)
            functions += _couplings(model, segment, i, ingredients)
            if timed is not None:
                functions += _guide(segment, i, timed[first + i // trellis.chains])
    return _write(f"tween_{moves}_moves", variables, functions)


# --- variables -------------------------------------------------------------------------------------------------------


class _Segment(NamedTuple):
    """A segment of the problem.

    Attributes:
        trellis: its trellis.
        names: names of its variables [n].
        domains: positions of each variable [n].
        rows: row of each position in the model [P].
    """

    trellis: Trellis
    names: list[str]
    domains: list[slice]
    rows: Ints


def _segment(
    model: Model,
    trellis: Trellis,
    first: int,
    chains: Sequence[str],
    words: Sequence[str],
    variables: dict[str, list[str]],
) -> _Segment:
    """Return the segment that starts at move `first`, and add its variables with their values to `variables`.

    Args:
        model: the costs, waits included.
        trellis: the segment.
        first: number of the move.
        chains: names of the chains [L].
        words: names of the model's states [G].
        variables: those of the segments before.
    """
    domains = [slice(*span) for span in pairwise(trellis.dom_ptr.tolist())]
    chain = np.repeat(np.arange(len(domains)) % trellis.chains, np.diff(trellis.dom_ptr))
    rows = model.starts[chain] + trellis.dom
    names = []
    for i, domain in enumerate(domains):
        name = f"{chains[i % trellis.chains]}_{first + i // trellis.chains}"
        values = [words[row] for row in rows[domain]]
        # A segment starts in the states in which the previous one ends, unless states are moves.
        names.append(name if variables.setdefault(name, values) == values else f"{name}_on")
        variables[names[-1]] = values
    return _Segment(trellis, names, domains, rows)


def _value_names(model: Model) -> list[str]:
    """Return the name of each state [G]."""
    first = np.repeat(model.starts[:-1], np.diff(model.starts))
    sources = np.repeat(np.arange(len(first)), np.diff(model.indptr))
    left = np.zeros(len(first), dtype=np.int64)  # the place that a move leads from
    left[first[sources] + model.targets] = model.place[sources]
    named = zip(np.arange(len(first)) - first, left.tolist(), model.place.tolist(), strict=True)
    return [f"s{place}" if state == place else f"s{before}_s{place}" for state, before, place in named]


# --- functions -------------------------------------------------------------------------------------------------------


def _edges(segment: _Segment, i: int, kinds: Sequence[str], kind: Ints) -> Iterator[_Function]:
    """Yield the functions of the edges into variable i; `kind` is that of each edge of the segment [R]."""
    trellis, name, before = segment.trellis, segment.names[i], i - segment.trellis.chains
    scope, source = [segment.names[before], name], segment.domains[before]
    pairs, listed = _entries(trellis.row_ptr, trellis.row_to, source.start, source.stop, segment.domains[i].start)
    yield _Function(f"allowed_{name}", scope, np.zeros(len(pairs)), pairs, forbids=True)
    for number, word in enumerate(kinds):
        own = kind[listed] == number
        if own.any():
            yield _Function(f"{word}_{name}", scope, trellis.row_cost[listed][own], pairs[own])


def _couplings(model: Model, segment: _Segment, i: int, ingredients: Ingredients) -> Iterator[_Function]:
    """Yield the functions of the coupling of variable i to its parent."""
    trellis, name, chain = segment.trellis, segment.names[i], i % segment.trellis.chains
    if trellis.parents[chain] < 0:
        return
    above = i - chain + int(trellis.parents[chain])
    here, there = segment.domains[i], segment.domains[above]
    pairs, listed = _entries(trellis.col_ptr, trellis.col_to, trellis.up_ptr[i], trellis.up_ptr[i + 1], here.start)
    parent = ingredients.parent[model.pair_starts[chain] + trellis.dom[there]]
    for function in (
        _Function(f"network_{name}", [segment.names[above], name], trellis.col_cost[listed], pairs),
        _Function(f"network_{name}_child", [name], ingredients.child[segment.rows[here]]),
        _Function(f"network_{name}_parent", [segment.names[above]], parent),
    ):
        if np.any(function.costs):
            yield function


def _guide(segment: _Segment, i: int, costs: Floats) -> Iterator[_Function]:
    """Yield the guide's function of variable i, given what states cost at its move [G]."""
    own = costs[segment.rows[segment.domains[i]]]
    if own.any():
        yield _Function(f"guide_{segment.names[i]}", [segment.names[i]], own)


def _entries(ptr: Ints, columns: Int32s, first: int, last: int, start: int) -> tuple[Ints, slice]:
    """Return entries of a matrix as pairs of values [n, 2], and the slice that they occupy.

    Args:
        ptr: entries of each row.
        columns: their columns, which are positions.
        first: first row to return.
        last: the row after the last one to return.
        start: first position of the variable that the columns belong to.
    """
    listed = slice(int(ptr[first]), int(ptr[last]))
    values = np.repeat(np.arange(last - first), np.diff(ptr[first : last + 1]))
    return np.column_stack([values, columns[listed] - start]), listed


def _model_edges(model: Model, segment: _Segment) -> Ints:
    """Return the index in the model of each edge of a segment [R]."""
    trellis, width = segment.trellis, int(np.diff(model.starts).max())
    keys = np.repeat(np.arange(len(model.place)) * width, np.diff(model.indptr)) + model.targets
    wanted = np.repeat(segment.rows * width, np.diff(trellis.row_ptr)) + trellis.dom[trellis.row_to]
    return np.searchsorted(keys, wanted)


# --- text ------------------------------------------------------------------------------------------------------------


def _write(title: str, variables: dict[str, list[str]], functions: Sequence[_Function]) -> str:
    """Return the text of a network; costs have six decimals."""
    # More than any path can cost: above the sum of the greatest costs of all functions.
    forbidden = f"{1.0 + sum(np.abs(one.costs).max(initial=0.0) for one in functions):.6f}"
    header = {"name": title, "mustbe": f"<{forbidden}"}
    values = (f"{json.dumps(name)}: {json.dumps(states)}" for name, states in variables.items())
    return (
        f'{{"problem": {json.dumps(header)},\n"variables": {{\n'
        + ",\n".join(values)
        + '\n},\n"functions": {\n'
        + ",\n".join(_line(function, forbidden) for function in functions)
        + "\n}}\n"
    )


def _line(function: _Function, forbidden: str) -> str:
    """Format a function without exponents: toulbar2 does not read numbers such as 2e-06, although JSON does."""
    rounded = np.round(function.costs, 6).tolist()
    costs, default = [f"{cost:.6f}" if cost else "0" for cost in rounded], ""
    if function.pairs is not None:
        costs = [f"{a}, {b}, {cost}" for (a, b), cost in zip(function.pairs.tolist(), costs, strict=True)]
        default = f'"defaultcost": {forbidden if function.forbids else 0}, '
    scope = json.dumps(function.scope)
    return f'{json.dumps(function.name)}: {{"scope": {scope}, {default}"costs": [{", ".join(costs)}]}}'
