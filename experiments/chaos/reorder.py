"""Time and memory of reordering: the k-d tree against brute force, and the whole procedure.

python experiments/chaos/reorder.py [--repeats 7]

Each figure is the least of the repeats. Comparing all goes point by point over all sites, in compiled code.
"""

import argparse
import resource
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from time import perf_counter

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.chaos.flows import FLOWS
from motionmind.chaos.reorder import itinerary, reorder
from motionmind.chaos.trajectories import trajectory
from motionmind.jit import jit

NAMES = ("lorenz", "rossler")
COMPARED = (1_000, 9_000)
WHOLE = (1_000, 9_000, 100_000, 1_000_000)
NUDGE = 0.01
PAPERS = "18, 156.2 (tree) and 30.2, 2324.2 (all)"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--only", type=int, help="postures: print what memory the whole procedure takes, and no more")
    options = parser.parse_args()
    if options.only:
        measure_memory(options.only)
        return
    print("memory of the whole procedure, each in a process of its own")
    for count in (10_000, *WHOLE[2:]):  # before this process grows: another inherits what it held at most
        subprocess.run([sys.executable, __file__, "--only", str(count)], check=True)
    began = perf_counter()
    itinerary(FLOWS["lorenz"], 10, nudge=NUDGE)
    print(
        f"\nfirst call, mostly imports of scipy.spatial and of numba's parts: {1e3 * (perf_counter() - began):.0f} ms"
    )
    for name in NAMES:
        compare(name, options.repeats)
    print("\nthe whole procedure: both trajectories, 11 steps a posture, and the tree; and one trajectory alone, ms")
    print(f"{'postures':>9}" + "".join(f"{name:>10}" for name in NAMES) + "".join(f"{name:>10}" for name in NAMES))
    for count in WHOLE:
        whole = [least(partial(itinerary, FLOWS[name], count, nudge=NUDGE), options.repeats) for name in NAMES]
        alone = [least(partial(trajectory, FLOWS[name], count=count), options.repeats) for name in NAMES]
        print(f"{count:9,}" + "".join(f"{1e3 * seconds:10.1f}" for seconds in whole + alone))


def compare(name: str, repeats: int) -> None:
    """Time reordering alone, with the tree and by brute force."""
    print(f"\n{name}: reordering alone, ms (the papers: {PAPERS})")
    found = []
    for count in COMPARED:
        given = itinerary(FLOWS[name], count, nudge=NUDGE)
        assert np.array_equal(given.indices, compare_all(given.sites, given.points))
        tree = least(partial(reorder, given.sites, given.points), repeats)
        every = least(partial(compare_all, given.sites, given.points), repeats)
        found.append((tree, every))
        print(f"{count:9,}  tree {1e3 * tree:8.2f}  all {1e3 * every:8.2f}  all / tree {every / tree:6.1f}")
    (tree, every), (more, much) = found
    print(f"{'growth':>9}  tree {more / tree:8.1f}  all {much / every:8.1f}")


@jit
def compare_all(sites: Floats, points: Floats) -> Ints:
    """Return the nearest site of each point by brute force."""
    out = np.empty(len(points), np.int64)
    for n in range(len(points)):
        least = np.inf
        for i in range(len(sites)):
            square = 0.0
            for k in range(sites.shape[1]):
                square += (sites[i, k] - points[n, k]) ** 2
            if square < least:
                least, out[n] = square, i
    return out


def measure_memory(count: int) -> None:
    """Return the peak growth of the process's memory."""
    itinerary(FLOWS["lorenz"], 10, nudge=NUDGE)
    before = peak()
    itinerary(FLOWS["lorenz"], count, nudge=NUDGE)
    grown = peak() - before
    print(f"{count:9,} postures: {grown / 2**20:7.1f} MB more at most, {grown / count:6.0f} bytes a posture")


def peak() -> int:
    """Return the peak memory of this process, bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def least(work: Callable[[], object], repeats: int) -> float:
    """Return the shortest time that `work` took, seconds."""
    times = []
    for _ in range(repeats):
        began = perf_counter()
        work()
        times.append(perf_counter() - began)
    return min(times)


if __name__ == "__main__":
    main()
