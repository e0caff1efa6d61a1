"""The problem of a fixed number of moves in toulbar2's cfn format, so that anyone can check an optimum.

The format: "cost function network", JSON with `problem`, `variables` and `functions`
(toulbar2's documentation, "User guide: file formats, cfn format"). A cost at or above `mustbe` forbids.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from itertools import pairwise

from motionmind._typing import Ints
from motionmind.search.problem import Model, Rules, Via
from motionmind.search.trellis import segment_trellises

DECIMALS = 6


def cfn(
    model: Model, start: Ints, goal: Ints, rules: Rules, moves: int, chains: Sequence[str], vias: Sequence[Via] = ()
) -> str:
    """The problem of exactly `moves` moves from states `start` [L] to `goal` [L], with the costs that are searched.

    Variables are named chain_t and their values after the chain's states, such as "s12", or, where moves are searched,
    after the number of the move and the state that it leads to, "m40_s12". The optimum is the cost that a certificate
    states, the price of the moves themselves included. `vias` are passed at the moves that they name; where moves are
    searched, chains go on from there as variables chain_t_on.
    """
    stops = [(0, start), *((via.move or 0, via.states) for via in vias), (moves, goal)]
    trellises = segment_trellises(model, goal, rules.wait, stops)
    variables: dict[str, list[str]] = {}

    def functions() -> Iterator[tuple[str, list[str], dict[str, object]]]:
        yield "moves", [], {"costs": [_round(rules.per_move * moves)]}
        for (first, _), trellis in zip(stops, trellises, strict=False):
            domains = [slice(*span) for span in pairwise(trellis.dom_ptr)]
            names = [
                f"{chains[i % trellis.chains]}_{first + i // trellis.chains}" for i in range(len(trellis.dom_ptr) - 1)
            ]
            values = [
                [_value(model, i % trellis.chains, int(s)) for s in trellis.dom[d]] for i, d in enumerate(domains)
            ]
            if (
                first > 0
            ):  # a segment starts where the one before ends, which is in the same states unless these are moves
                starts = zip(names[: trellis.chains], values, strict=False)
                names[: trellis.chains] = [name if variables[name] == here else f"{name}_on" for name, here in starts]
            for i, name in enumerate(names):
                chain = i % trellis.chains
                if name not in variables:  # what a segment starts with, the segment before has paid for
                    variables[name] = values[i]
                    yield f"stand_{name}", [name], {"costs": [_round(cost) for cost in trellis.unary[domains[i]]]}
                if i + trellis.chains < len(names):
                    after = i + trellis.chains
                    rows = range(domains[i].start, domains[i].stop)
                    edges = [(p, e) for p in rows for e in range(trellis.row_ptr[p], trellis.row_ptr[p + 1])]
                    listed = [
                        (p - domains[i].start, trellis.row_to[e] - domains[after].start, trellis.row_cost[e])
                        for p, e in edges
                    ]
                    yield f"move_{name}", [name, names[after]], {"defaultcost": None, "costs": _flat(listed)}
                if trellis.up_ptr[i + 1] > trellis.up_ptr[i]:
                    above = i - chain + trellis.parents[chain]
                    couplings = range(trellis.up_ptr[i], trellis.up_ptr[i + 1])
                    pairs = [(u, q) for u in couplings for q in range(trellis.col_ptr[u], trellis.col_ptr[u + 1])]
                    listed = [
                        (u - couplings.start, trellis.col_to[q] - domains[i].start, trellis.col_cost[q])
                        for u, q in pairs
                    ]
                    yield f"coordinate_{name}", [names[above], name], {"defaultcost": 0.0, "costs": _flat(listed)}

    parts = list(functions())
    # Above what any path can cost: the sum of the dearest entries of all functions.
    forbidden = 1.0 + sum(max(map(abs, _costs(scope, body)), default=0.0) for _, scope, body in parts)
    lines = []
    for name, scope, body in parts:
        default = {"defaultcost": forbidden} if body.get("defaultcost", 0.0) is None else {}
        lines.append(f"{json.dumps(name)}: {json.dumps({'scope': scope, **body, **default})}")
    values = [f"{json.dumps(name)}: {json.dumps(states)}" for name, states in variables.items()]
    problem = {"name": f"tween_{moves}_moves", "mustbe": f"<{forbidden:.{DECIMALS}f}"}
    return (
        f'{{"problem": {json.dumps(problem)},\n"variables": {{\n'
        + ",\n".join(values)
        + '\n},\n"functions": {\n'
        + ",\n".join(lines)
        + "\n}}\n"
    )


def _value(model: Model, chain: int, state: int) -> str:
    place = model.place[model.starts[chain] + state]
    return f"s{state}" if place == state else f"m{state}_s{place}"


def _flat(listed: list[tuple[int, int, float]]) -> list[float]:
    """Pairs with their cost, one after another, as the format wants them."""
    return [number for a, b, cost in listed for number in (int(a), int(b), _round(cost))]


def _costs(scope: list[str], body: dict[str, object]) -> list[float]:
    costs = body["costs"]
    assert isinstance(costs, list)
    return costs[2::3] if len(scope) == 2 else costs


def _round(cost: float) -> float:
    return round(float(cost), DECIMALS)
