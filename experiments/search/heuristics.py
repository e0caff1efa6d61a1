"""How A*'s work grows as its heuristic is weakened.

    python experiments/search/heuristics.py [PATH/TO/cmu-05] [--setting 5,15] [--pairs 8] [--seed 0] [--quick]

Bundled ballet, or recordings learned as in bench.py. Random pairs of postures, in the number of moves that is best; A*
knows no path, and nothing is pruned before. The same for the first few chains of the body alone, for which weak
heuristics are enough. --quick takes two pairs and few expansions.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from bench import RULES, Ends, joinable, moves_of

from motionmind import Engine, own_skeleton, read_motion
from motionmind._typing import Floats
from motionmind.discretize import make_discretization
from motionmind.search import astar, heuristic, pair_chains, solve, trws
from motionmind.search.heuristic import Heuristic
from motionmind.search.problem import Model, Problem, costs_to_go, with_waits
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS, SAME_COST_NATS
from motionmind.search.trellis import Trellis, build_trellis
from motionmind.tween.problem import build_model

CHAINS = (3, 6)  # of the body, beside all
EXPANSIONS = 200_000
ON = np.zeros(1, dtype=bool)  # what would end A* before its time


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--setting", default="5,15")
    parser.add_argument("--pairs", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    engine = learn(options.folder, *map(float, options.setting.split(",")))
    pairs, expansions = (2, 2_000) if options.quick else (options.pairs, EXPANSIONS)
    whole = build_model(engine.grammar, "conditional", 1.0, 1.0)
    print(
        f"| {pairs} pairs, {expansions:,} expansions | bound short of the best | expansions, median and most | proven |"
    )
    print("|---|---|---|---|")
    for chains in (*CHAINS, len(whole.parents)):
        model = first_chains(whole, chains)
        ends = joinable(model, np.asarray(engine.states)[:, :chains], pairs, options.seed)
        weaken(model, list(ends), expansions)


def learn(folder: Path | None, rate: float, tolerance: float) -> Engine:
    if folder is None:
        return Engine.load("ballet")
    clips = (own_skeleton(read_motion(file)) for file in sorted(folder.glob("*.bvh")))
    book = make_discretization("codebook", tolerance)
    return Engine.fit(clips, name="heuristics", rate=rate, skip=1, discretization=book)


def first_chains(model: Model, chains: int) -> Model:
    """The model of the first chains alone; a state still pays its part of all couplings that it was in."""
    rows, pair_rows = model.starts[chains], model.pair_starts[chains]
    edges, pairs = model.indptr[rows], model.pair_ptr[pair_rows]
    return Model(
        starts=model.starts[: chains + 1],
        parents=model.parents[:chains],
        indptr=model.indptr[: rows + 1],
        targets=model.targets[:edges],
        costs=model.costs[:edges],
        unary=model.unary[:rows],
        alone=model.alone[:rows],
        pair_starts=model.pair_starts[: chains + 1],
        pair_ptr=model.pair_ptr[: pair_rows + 1],
        pair_states=model.pair_states[:pairs],
        pair_costs=model.pair_costs[:pairs],
        allowed=model.allowed[:rows],
        place=model.place[:rows],
    )


def weaken(model: Model, pairs: list[Ends], expansions: int) -> None:
    """A* under each heuristic on the same trellises: a row of the table for each."""
    rows: dict[str, list[tuple[float, int, bool]]] = {}
    for start, goal in pairs:
        answer = solve.solve(Problem(model, start, goal, RULES))
        assert answer.status == "optimal"
        held, moves = with_waits(model, goal, RULES.wait), moves_of(answer)
        trellis = build_trellis(held, start, moves, costs_to_go(held, goal, moves), np.inf)
        optimum = answer.cost - RULES.per_move * moves
        for name, estimate in heuristics(trellis):
            path = np.zeros(len(trellis.dom_ptr) - 1, np.int64)
            found = astar.search(trellis, estimate, np.inf, SAME_COST_NATS, path, expansions, expansions, ON)
            assert found.lower_bound <= optimum + OPTIMAL_WITHIN_NATS <= found.cost + 2 * OPTIMAL_WITHIN_NATS
            short = max(1.0 - heuristic.from_start(estimate) / optimum, 0.0) if optimum else 0.0
            proved = found.lower_bound > found.cost - OPTIMAL_WITHIN_NATS
            rows.setdefault(name, []).append((short, found.expansions, proved))
    for name, row in rows.items():
        short, expanded, proved = zip(*row, strict=True)
        print(f"| {len(model.parents)} chains: {name} | {np.median(short):.2%} |", end=" ")
        print(f"{np.median(expanded):,.0f}, {max(expanded):,} | {sum(proved)} of {len(pairs)} |", flush=True)


def heuristics(trellis: Trellis) -> Iterator[tuple[str, Heuristic]]:
    """Bounds on the cost to go, the strongest first."""
    messages = trws.no_messages(trellis)
    trws.tighten(trellis, messages, np.zeros(len(trellis.dom_ptr) - 1, np.int64), 160, np.inf)
    tables, through = pair_chains.build(trellis, messages), np.zeros(len(trellis.dom))
    for _ in range(10):
        pair_chains.sweep(trellis, tables, through)
    yield "pair chains, 10 sweeps", Heuristic.of_pair_chains(tables)
    yield "messages", Heuristic.of_messages(messages)
    back = np.zeros(trellis.up_ptr[-1])  # the most that a position can save in the coupling to a child
    for u in range(len(back)):
        back[u] = trellis.col_cost[trellis.col_ptr[u] : trellis.col_ptr[u + 1]].min(initial=0.0)
    yield (
        "each joint alone, in the moves that are left",
        as_tables(trellis, alone(trellis, back, ends_at_goal=False), back),
    )
    yield "each joint alone, in any number of moves", as_tables(trellis, alone(trellis, back, ends_at_goal=True), back)
    yield "none: Dijkstra", as_tables(trellis, np.zeros(len(trellis.dom)), back)


def alone(trellis: Trellis, back: Floats, ends_at_goal: bool) -> Floats:
    """What each position's chain costs from there on its own [P], couplings at the least that they can cost it."""
    cost, least = trellis.unary.copy(), np.full(len(trellis.dom), np.inf)
    for i in range(trellis.chains, len(trellis.dom_ptr) - 1):
        here = slice(trellis.dom_ptr[i], trellis.dom_ptr[i + 1])
        if trellis.up_ptr[i + 1] == trellis.up_ptr[i]:
            least[here] = 0.0
            continue
        a = trellis.dom_ptr[i - i % trellis.chains + trellis.parents[i % trellis.chains]]
        for k, u in enumerate(range(trellis.up_ptr[i], trellis.up_ptr[i + 1])):
            cost[a + k] += back[u]
            paid = np.full(here.stop - here.start, -back[u])
            pairs = slice(trellis.col_ptr[u], trellis.col_ptr[u + 1])
            paid[trellis.col_to[pairs] - here.start] += trellis.col_cost[pairs]
            least[here] = np.minimum(least[here], paid)
    goal = trellis.dom[trellis.dom_ptr[-trellis.chains - 1 : -1]]
    rest = np.zeros(len(trellis.dom))
    for i in range(len(trellis.dom_ptr) - 2 - trellis.chains, -1, -1):
        for p in range(trellis.dom_ptr[i], trellis.dom_ptr[i + 1]):
            edges = slice(trellis.row_ptr[p], trellis.row_ptr[p + 1])
            to = trellis.row_to[edges]
            rest[p] = (trellis.row_cost[edges] + cost[to] + least[to] + rest[to]).min()
            if ends_at_goal and trellis.dom[p] == goal[i % trellis.chains]:
                rest[p] = min(rest[p], 0.0)
    return rest


def as_tables(trellis: Trellis, rest: Floats, back: Floats) -> Heuristic:
    """The estimate `rest` by position [P] plus `back` by coupling row where only the parent has moved, in A*'s form."""
    stand, s = trellis.unary, pair_chains.build(trellis, trws.no_messages(trellis))
    s.edge_share[:], s.partner_share[:] = trellis.row_cost, 0.0
    for i in range(len(trellis.dom_ptr) - 1):
        chain = i % trellis.chains
        if chain == 0:
            continue
        a = i - chain + s.partner[chain]
        here, above = (slice(trellis.dom_ptr[k], trellis.dom_ptr[k + 1]) for k in (i, a))
        paid = np.zeros((above.stop - above.start, here.stop - here.start)) + stand[here]
        to_go = np.zeros(paid.shape) + rest[here]
        pending = np.zeros(len(paid))
        for k, u in enumerate(range(trellis.up_ptr[i], trellis.up_ptr[i + 1])):
            pairs = slice(trellis.col_ptr[u], trellis.col_ptr[u + 1])
            paid[k, trellis.col_to[pairs] - here.start] += trellis.col_cost[pairs]
            pending[k] = back[u]
        if chain == 1:  # whose pair chain bears all that the first chain costs
            edges = slice(trellis.row_ptr[above.start], trellis.row_ptr[above.stop])
            s.partner_share[s.partner_ptr[i] : s.partner_ptr[i + 1]] = trellis.row_cost[edges]
            paid += stand[above, None]
            to_go += rest[above, None]
            pending += stand[above] + rest[above]
        s.pair_cost[s.pair_ptr[i] : s.pair_ptr[i + 1]] = paid.ravel()
        s.to_go[s.pair_ptr[i] : s.pair_ptr[i + 1]] = to_go.ravel()
        if i >= trellis.chains:
            before = slice(trellis.dom_ptr[i - trellis.chains], trellis.dom_ptr[i - trellis.chains + 1])
            s.half[s.half_ptr[i] : s.half_ptr[i + 1]] = (pending[:, None] + rest[before]).ravel()
    return Heuristic.of_pair_chains(s)


if __name__ == "__main__":
    main()
