"""What A* holds in memory against what a budget of nodes is reckoned at.

    python experiments/search/memory.py PATH/TO/cmu-05

One pair of postures at 10 a second and 5 degrees, under a bound that is made poor, so that A* fills its budget; each
budget in a process of its own. Growth is of the resident memory, from after a first search that loads all code. There
is one expansion for every two nodes, each with about eight children, so that memory fills several times over.
"""

import argparse
import resource
import subprocess
import sys
from pathlib import Path
from time import process_time

import numpy as np

from motionmind import Engine, own_skeleton, read_motion
from motionmind.discretize import make_discretization
from motionmind.search import astar, pair_chains, trws
from motionmind.search.heuristic import Heuristic
from motionmind.search.problem import costs_to_go, with_waits
from motionmind.search.tolerances import SAME_COST_NATS
from motionmind.search.trellis import build_trellis
from motionmind.tween.problem import build_model

BUDGETS = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
MOVES = 12


def grown(folder: Path, budget: int) -> tuple[int, int, int]:
    """Nodes held at most, bytes by which the process grew, and nanoseconds of processor time that an expansion took."""
    clips = (own_skeleton(read_motion(file)) for file in sorted(folder.glob("*.bvh")))
    engine = Engine.fit(clips, name="memory", rate=10.0, skip=1, discretization=make_discretization("codebook", 5.0))
    model = build_model(engine.grammar, "conditional", 1.0, 1.0)
    start, goal = engine.states[[100, 900]].astype(np.int64)
    held = with_waits(model, goal, 1.0)
    trellis = build_trellis(held, start, MOVES, costs_to_go(held, goal, MOVES), np.inf)
    tables = pair_chains.build(trellis, trws.no_messages(trellis))  # shares as they come, with nothing evened out
    heuristic = Heuristic.of_pair_chains(tables)

    def search(nodes: int) -> int:
        path, on = np.zeros(len(trellis.dom_ptr) - 1, dtype=np.int64), np.zeros(1, dtype=bool)
        return astar.search(trellis, heuristic, np.inf, SAME_COST_NATS, path, nodes, nodes // 2, on).peak_nodes

    search(100)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    began = process_time()
    most = search(budget)
    taken = process_time() - began
    return most, 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before), round(2e9 * taken / budget)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--budget", type=int, help="this one alone, in this process")
    options = parser.parse_args()
    if options.budget:
        print(*grown(options.folder, options.budget))
        return
    a_node = 1e6 / astar.node_capacity(1_000_000, 24)
    print("| budget, nodes | held at most | reckoned | grown | grown / reckoned | an expansion |")
    print("|---|---|---|---|---|---|")
    for budget in BUDGETS:
        command = [sys.executable, __file__, str(options.folder), "--budget", str(budget)]
        ran = subprocess.run(command, capture_output=True, text=True, check=True)
        most, size, ns = map(int, ran.stdout.split())
        reckoned = budget * a_node
        print(f"| {budget:,} | {most:,} | {reckoned / 1e6:.1f} MB | {size / 1e6:.1f} MB", end=" | ")
        print(f"{size / reckoned:.2f} | {ns / 1e3:.1f} µs |")


if __name__ == "__main__":
    main()
