"""Write the problem of a fixed number of moves in toulbar2's cfn format, so that anyone can check an optimum.

The format: "cost function network", JSON with `problem`, `variables` and `functions`
(toulbar2's documentation, "User guide: file formats, cfn format"). A cost at or above `mustbe` forbids.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from motionmind.search.problem import Model, Problem
from motionmind.search.trellis import Trellis, segment_trellises

DECIMALS = 6


class _Function(NamedTuple):
    """A cost function: its name, the variables in its scope, and its body in the format's terms."""

    name: str
    scope: list[str]
    body: dict[str, object]


def cfn(problem: Problem, moves: int, names: Sequence[str]) -> str:
    """Write the problem of exactly `moves` moves, with the costs that the search minimises.

    Variables are named chain_t, and their values after the chain's states, such as "s12"; where states are moves, after
    the number of the move and the state that it leads to, "m40_s12". The optimum is the cost that a certificate states,
    the price of the moves themselves included. Where states are moves, chains go on from a via as variables chain_t_on.

    Args:
        problem: the problem; each via names the move at which it is passed.
        moves: number of moves T.
        names: names of the chains [L].

    Raises:
        ValueError: a via names no move.
    """
    stops = [0]
    for number, via in enumerate(problem.vias, start=1):
        if via.move is None:
            raise ValueError(f"via {number} names no move; cfn writes the problem with vias at given moves")
        stops.append(via.move)
    variables: dict[str, list[str]] = {}
    functions = [_Function("moves", [], {"costs": [_round(problem.rules.per_move * moves)]})]
    for first, trellis in zip(stops, segment_trellises(problem, [*stops, moves]), strict=True):
        functions += _functions(problem.model, trellis, first, names, variables)
    # Above what any path can cost: the sum of the greatest costs of all functions.
    forbidden = 1.0 + sum(max(map(abs, _costs(scope, body)), default=0.0) for _, scope, body in functions)
    lines = []
    for name, scope, body in functions:
        default = {"defaultcost": forbidden} if body.get("defaultcost", 0.0) is None else {}
        head = json.dumps({"scope": scope, **{key: body[key] for key in body if key != "costs"}, **default})
        lines.append(f'{json.dumps(name)}: {head[:-1]}, "costs": {_numbers(_listed(body))}}}')
    values = [f"{json.dumps(name)}: {json.dumps(states)}" for name, states in variables.items()]
    header = {"name": f"tween_{moves}_moves", "mustbe": f"<{forbidden:.{DECIMALS}f}"}
    return (
        f'{{"problem": {json.dumps(header)},\n"variables": {{\n'
        + ",\n".join(values)
        + '\n},\n"functions": {\n'
        + ",\n".join(lines)
        + "\n}}\n"
    )


def _functions(
    model: Model, trellis: Trellis, first: int, chains: Sequence[str], variables: dict[str, list[str]]
) -> Iterator[_Function]:
    """Yield the cost functions of a segment that starts at move `first`, and add its variables to `variables`."""
    domains = [slice(*span) for span in pairwise(trellis.dom_ptr)]
    names = [f"{chains[i % trellis.chains]}_{first + i // trellis.chains}" for i in range(len(domains))]
    values = [[_value(model, i % trellis.chains, int(s)) for s in trellis.dom[d]] for i, d in enumerate(domains)]
    if first > 0:  # a segment starts where the one before ends: in the same states, unless these are moves
        starts = zip(names[: trellis.chains], values, strict=False)
        names[: trellis.chains] = [name if variables[name] == here else f"{name}_on" for name, here in starts]
    for i, name in enumerate(names):
        if name not in variables:  # else the segment before has paid for it
            variables[name] = values[i]
            yield _Function(f"stand_{name}", [name], {"costs": [_round(cost) for cost in trellis.unary[domains[i]]]})
        after, above = i + trellis.chains, i - i % trellis.chains + trellis.parents[i % trellis.chains]
        if after < len(names):
            costs = _edges(trellis, domains[i], domains[after])
            yield _Function(f"move_{name}", [name, names[after]], {"defaultcost": None, "costs": costs})
        if trellis.up_ptr[i + 1] > trellis.up_ptr[i]:
            costs = _pairs(trellis, i, domains[i])
            yield _Function(f"coordinate_{name}", [names[above], name], {"defaultcost": 0.0, "costs": costs})


def _edges(trellis: Trellis, here: slice, after: slice) -> list[float]:
    """Return the edges between two domains of a chain, as (value, value, cost) one after another."""
    edges = [(p, e) for p in range(here.start, here.stop) for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1])]
    return _flat([(p - here.start, trellis.row_to[e] - after.start, trellis.row_cost[e]) for p, e in edges])


def _pairs(trellis: Trellis, i: int, here: slice) -> list[float]:
    """Return the listed pairs of variable i and its parent, as (parent's value, value, cost) one after another."""
    rows = range(trellis.up_ptr[i], trellis.up_ptr[i + 1])
    pairs = [(u, q) for u in rows for q in range(trellis.col_ptr[u], trellis.col_ptr[u + 1])]
    return _flat([(u - rows.start, trellis.col_to[q] - here.start, trellis.col_cost[q]) for u, q in pairs])


def _value(model: Model, chain: int, state: int) -> str:
    place = model.place[model.starts[chain] + state]
    return f"s{state}" if place == state else f"m{state}_s{place}"


def _flat(listed: list[tuple[int, int, float]]) -> list[float]:
    """Return entries one after another, as the format wants them, costs rounded."""
    return [number for a, b, cost in listed for number in (int(a), int(b), _round(cost))]


def _costs(scope: list[str], body: dict[str, object]) -> list[float]:
    costs = _listed(body)
    return costs[2::3] if len(scope) == 2 else costs


def _listed(body: dict[str, object]) -> list[float]:
    costs = body["costs"]
    assert isinstance(costs, list)
    return costs


def _numbers(numbers: list[float]) -> str:
    """Return a list as the format has it: numbers such as 2e-06, which JSON knows, are none to toulbar2."""
    written = (f"{number:.{DECIMALS}f}" if isinstance(number, float) else str(number) for number in numbers)
    return f"[{', '.join(written)}]"


def _round(cost: float) -> float:
    return round(float(cost), DECIMALS)
