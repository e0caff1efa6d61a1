"""What the search proves, how fast, and what each bound is worth, on random pairs of postures of one corpus.

python experiments/search/bench.py PATH/TO/cmu-05 --pairs 100 --setting 10,5 [--seed 0] [--few 8] [--plot gap.svg]

A setting is postures a second and degrees. Four parts: all pairs, after loading; some of them coordinated by moves;
gaps against time as less effort is allowed; and the same problems solved by toulbar2. The last two look at the first
few pairs.
"""

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
import pytoulbar2

from motionmind import Engine, own_skeleton, read_motion
from motionmind._typing import Floats, Int32s, Ints
from motionmind.discretize import make_discretization
from motionmind.grammar.grammar import Grammar
from motionmind.grammar.progression import fit_progression
from motionmind.search import bounding, solve
from motionmind.search.cfn import cfn
from motionmind.search.problem import Model, Problem, Rules, costs_to_go, with_waits
from motionmind.search.solve import Certificate
from motionmind.tween.problem import build_model, ingredients_of, lift_to_moves

TIME_LIMIT = 20  # seconds that toulbar2 gets for one problem
RULES = Rules(wait=1.0, per_move=1.0, shortest=1, longest=60, node_budget=200_000)
EFFORTS = (  # sweeps of pair chains and of messages
    ("messages", (0, 2)),
    ("messages", (0, 8)),
    ("messages", (0, 160)),
    ("pair_chains", (1, 160)),
    ("pair_chains", (2, 160)),
    ("pair_chains", (4, 160)),
    ("pair_chains", (100, 160)),
)

Ends = tuple[Ints, Ints]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--setting", default="5,15")
    parser.add_argument("--pairs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--few", type=int, default=8)
    parser.add_argument("--moves", type=int, default=20)
    parser.add_argument("--plot", type=Path)
    options = parser.parse_args()
    rate, tolerance = map(float, options.setting.split(","))
    engine = Engine.fit(
        (own_skeleton(read_motion(file)) for file in sorted(options.folder.glob("*.bvh"))),
        name="bench",
        rate=rate,
        skip=1,
        discretization=make_discretization("codebook", tolerance),
    )
    model = build_model(engine.grammar, "conditional", 1.0, 1.0)
    size = f"{len(engine.states)} postures, largest joint {engine.space.sizes.max()} states"
    print(f"{rate:g} postures a second, {tolerance:g} degrees: {size}")
    warm_up(model, np.asarray(engine.states))
    pairs = list(joinable(model, np.asarray(engine.states), options.pairs, options.seed))
    found = prove(model, pairs)
    if options.moves:
        prove_moves(engine, pairs[: options.moves])
    few = list(zip(pairs[: options.few], found, strict=False))
    trade(model, [ends for ends, _ in few], options.plot)
    compare_solvers(model, few, engine.grammar)


def joinable(model: Model, states: Int32s, count: int, seed: int) -> Iterator[Ends]:
    """Random pairs of postures that some path of at most RULES.longest moves joins."""
    rng = np.random.default_rng(seed)
    while count > 0:
        start, goal = states[rng.integers(len(states), size=2)].astype(np.int64)
        alone = costs_to_go(with_waits(model, goal, RULES.wait), goal, RULES.longest)[1:, model.starts[:-1] + start]
        if np.isfinite(alone).all(axis=1).any():
            count -= 1
            yield start, goal


def warm_up(model: Model, states: Int32s) -> None:
    """Compile, or load, all that is measured."""
    for ends in joinable(model, states, 3, 1):
        solve.solve(Problem(model, *ends, RULES))


# --- all pairs -------------------------------------------------------------------------------------------------------


def prove(model: Model, pairs: list[Ends]) -> list[Certificate]:
    """Answer all, and print what is proven and how long it took."""
    return prove_each((model, RULES, ends) for ends in pairs)


def prove_moves(engine: Engine, pairs: list[Ends]) -> None:
    """The same coordinated by moves, [C98]'s progressions; what makes moves of states is not timed."""
    model, net, seen = (
        build_model(engine.grammar, "conditional", 0.0, 1.0),
        engine.grammar.coordination,
        engine.corpus.moves,
    )
    rules = replace(RULES, wait=np.inf)

    def posed() -> Iterator[tuple[Model, Rules, Ends]]:
        for start, goal in pairs:
            held = with_waits(model, goal, RULES.wait)
            lists, moves = (held.starts, held.indptr, held.targets), (seen.begins, seen.ends, seen.weights)
            together = fit_progression(net.parents, *lists, np.asarray(engine.states), *moves)
            yield lift_to_moves(held, together, 1.0), rules, (start, goal)

    print("\ncoordinated by moves")
    prove_each(posed())


def prove_each(problems: Iterator[tuple[Model, Rules, Ends]]) -> list[Certificate]:
    found, seconds = [], []
    for model, rules, (start, goal) in problems:
        began = perf_counter()
        answer = solve.solve(Problem(model, start, goal, rules))
        seconds.append(perf_counter() - began)
        found.append(answer)
    gaps = [gap(answer) for answer in found if answer.status != "optimal"]
    rest = f"; gap of the rest: median {np.median(gaps):.2%}, worst {max(gaps):.2%}" if gaps else ""
    ms = 1e3 * np.array(seconds)
    shares = {part: sum(answer.seconds[part] for answer in found) / sum(seconds) for part in found[0].seconds}
    print(f"proven optimal: {len(found) - len(gaps)} of {len(found)}{rest}")
    print(f"median {np.median(ms):.0f} ms, 95th percentile {np.percentile(ms, 95):.0f} ms, longest {ms.max():.0f} ms")
    print("of it " + ", ".join(f"{part} {share:.0%}" for part, share in shares.items()), end="; ")
    print(f"expansions in all {sum(answer.expansions for answer in found)}")
    print(f"moves: {min(map(moves_of, found))} to {max(map(moves_of, found))}")
    return found


def gap(answer: Certificate) -> float:
    return (answer.cost - answer.lower_bound) / answer.cost if answer.cost else 0.0


def moves_of(answer: Certificate) -> int:
    return len(answer.path) - 1


# --- gaps against time -----------------------------------------------------------------------------------------------


def trade(model: Model, few: list[Ends], plot: Path | None) -> None:
    """Gaps and times of the same pairs as less effort is allowed; no A* but in the last row."""
    rows = [(name, *spend(model, few, *effort, node_budget=1)) for name, effort in EFFORTS]
    rows.append(("and A*", *spend(model, few, *EFFORTS[-1][1], node_budget=RULES.node_budget)))
    print("effort: sweeps of pair_chains, of messages           median ms   gap: median     worst")
    for (name, seconds, gaps), effort in zip(rows, [*(effort for _, effort in EFFORTS), ("all", "all")], strict=True):
        print(f"{name:12}{effort[0]!s:>8}{effort[1]!s:>8}", end="")
        print(f"{1e3 * np.median(seconds):29.1f}{np.median(gaps):14.2%}{max(gaps):10.2%}")
    if plot:
        plot.write_text(drawing([(name, float(np.median(s)), np.array(gaps)) for name, s, gaps in rows]))


def spend(
    model: Model, few: list[Ends], pair_chain_sweeps: int, sweeps: int, node_budget: int
) -> tuple[list[float], list[float]]:
    """Seconds and gaps with so many sweeps of messages and of pair chains, and nodes of A*."""
    seconds, gaps = [], []
    most = bounding.MAX_PAIR_CHAIN_SWEEPS, bounding.MAX_STATE_PAIRS
    bounding.MAX_PAIR_CHAIN_SWEEPS, bounding.MAX_STATE_PAIRS = pair_chain_sweeps, most[1] if pair_chain_sweeps else 0
    rules = Rules(RULES.wait, RULES.per_move, RULES.shortest, RULES.longest, node_budget, sweeps)
    for start, goal in few:
        began = perf_counter()
        answer = solve.solve(Problem(model, start, goal, rules))
        seconds.append(perf_counter() - began)
        gaps.append(gap(answer))
    bounding.MAX_PAIR_CHAIN_SWEEPS, bounding.MAX_STATE_PAIRS = most
    return seconds, gaps


def drawing(rows: list[tuple[str, float, Floats]]) -> str:
    """An SVG: the median gap (line) and all gaps (dots), in percent, over the median time, on a logarithmic axis."""
    width, height, left, bottom = 520, 300, 50, 40
    times = np.array([seconds for _, seconds, _ in rows])
    low, high = np.floor(np.log10(times.min())), np.ceil(np.log10(times.max()))
    most = max(gaps.max() for _, _, gaps in rows) or 1.0

    def at(seconds: float, share: float) -> tuple[float, float]:
        x = left + (np.log10(seconds) - low) / (high - low) * (width - left - 20)
        return round(float(x), 1), round(float(height - bottom - share / most * (height - bottom - 20)), 1)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" '
        'font-size="11">',
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
    ]
    for power in range(int(low), int(high) + 1):
        x, y = at(10.0**power, 0.0)
        parts.append(f'<path d="M{x} 20V{y}" stroke="#ddd"/><text x="{x}" y="{y + 16}">{10.0**power:g} s</text>')
    for share in np.linspace(0.0, most, 5):
        x, y = at(10.0**low, share)
        parts.append(f'<path d="M{x} {y}H{width - 20}" stroke="#ddd"/><text x="4" y="{y + 4}">{share:.1%}</text>')
    for name, colour in (("messages", "#8a8a8a"), ("pair_chains", "#c0392b"), ("and A*", "#2471a3")):
        mine = [(seconds, gaps) for kind, seconds, gaps in rows if kind == name]
        line = " ".join("{},{}".format(*at(seconds, float(np.median(gaps)))) for seconds, gaps in mine)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2"/>')
        dots = (at(seconds, share) for seconds, gaps in mine for share in gaps)
        parts += [f'<circle cx="{x}" cy="{y}" r="2.5" fill="{colour}" fill-opacity="0.6"/>' for x, y in dots]
        x, y = at(mine[0][0], float(np.median(mine[0][1])))
        parts.append(f'<text x="{x + 6}" y="{y - 6}" fill="{colour}">{name}</text>')
    return "\n".join([*parts, "</svg>\n"])


# --- another solver --------------------------------------------------------------------------------------------------


def compare_solvers(model: Model, few: list[tuple[Ends, Certificate]], grammar: Grammar) -> None:
    """The problem of as many moves as were found, solved here and by toulbar2."""
    ours, theirs, left, agree, disagree = [], [], [], 0, 0
    for (start, goal), answer in few:
        moves = moves_of(answer)
        rules = Rules(RULES.wait, RULES.per_move, moves, moves, RULES.node_budget)
        began = perf_counter()
        problem = Problem(model, start, goal, rules)
        again = solve.solve(problem)
        ours.append(perf_counter() - began)
        seconds, optimum, short = toulbar2(written(problem, moves, grammar))
        theirs.append(seconds)
        if optimum is None:
            left.append(short)
        agree += optimum is not None and abs(optimum - again.cost) < 1e-3
        disagree += optimum is not None and (optimum < again.lower_bound - 1e-3 or optimum > again.cost + 1e-3)
    ratios = np.array(theirs) / np.array(ours)
    print(f"toulbar2 (limit {TIME_LIMIT} s) in as many moves: the same optimum {agree}, another {disagree},", end=" ")
    print(f"none in time {len(few) - agree - disagree} of {len(few)}", end="")
    print(f", with a gap of {', '.join(f'{short:.2%}' for short in left)}" if left else "")
    print(f"median {1e3 * np.median(ours):.0f} ms here, {1e3 * np.median(theirs):.0f} ms toulbar2 (solving);", end=" ")
    print(f"toulbar2 / here: median {np.median(ratios):.1f}, in all {sum(theirs) / sum(ours):.1f}")


def written(problem: Problem, moves: int, grammar: Grammar) -> str:
    """The problem of so many moves as toulbar2 reads it."""
    ingredients = ingredients_of(problem, grammar, "conditional", grammar.coordination, 1.0, problem.rules.wait)
    return cfn(problem, moves, grammar.chains, ingredients)


def toulbar2(problem: str) -> tuple[float, float | None, float]:
    """Seconds that toulbar2 takes to solve a problem, once read; its optimum, if it proves one in time; and the gap
    that it is left with, infinite if it found nothing."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "problem.cfn"
        path.write_text(problem)
        network = pytoulbar2.CFN(verbose=-1)
        network.Read(str(path))
        network.CFN.timer(TIME_LIMIT)
        began = perf_counter()
        found = network.Solve()
        seconds = perf_counter() - began
        if found and seconds < TIME_LIMIT:
            return seconds, found[1], 0.0
        return seconds, None, (found[1] - network.GetDDualBound()) / found[1] if found else np.inf


if __name__ == "__main__":
    main()
