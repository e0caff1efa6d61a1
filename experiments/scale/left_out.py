"""How much of the walks' ends lies beyond the nearest moments, and what could be said of it for certain.

python experiments/scale/left_out.py PATH/TO/cmu-05 [--times 1 10] [--pairs 20] [--keep FOLDER]

The corpora are those of tweens.py; small ones, of which all moments are looked at, are given trees here.
"""

import argparse
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from tweens import build, name_of, posture

from motionmind import Engine
from motionmind._typing import Bools, Floats
from motionmind.geometry.distances import squared_distance
from motionmind.learned.nearest import N_LEAVES_VISITED
from motionmind.learned.neighbours import build_neighbours
from motionmind.learned.posture_statistics import PostureStatistics
from motionmind.walks.likelihood import end_variance, squared_distances
from motionmind.walks.marginals import posterior_marginals
from motionmind.walks.sparse import all_samples, choose

STEPS = 12  # half steps of a walk


class Shares(NamedTuple):
    """Shares of what is left out, in the part of the body where each is greatest."""

    said: float  # by the moments that stand for what is left out, as the report has it
    ends: float  # of the weights of all moments as ends
    walks: float  # of all walks
    leaves: float  # at most, by the balls of the tree's leaves
    radius: float  # at most, by the nearest moment that is left out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="recordings, BVH")
    parser.add_argument("--times", type=int, nargs="+", default=[1, 10])
    parser.add_argument("--degrees", type=float, default=3.0, help="that joints of a copy are turned by, in the mean")
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="where corpora are kept, and found again")
    options = parser.parse_args()
    print("times  moments | " + "  ".join(f"{name:>15}" for name in Shares._fields) + " | said too little", flush=True)
    with tempfile.TemporaryDirectory() as scratch:
        options.keep = options.keep or Path(scratch)
        for times in options.times:
            if not (options.keep / "corpora" / name_of(times)).exists():
                build(argparse.Namespace(**vars(options) | {"times": [times]}))
            engine = Engine.load(name_of(times), options.keep)
            drawn = np.random.default_rng(options.seed).integers(len(engine.corpus), size=(options.pairs, 2))
            found = np.array([shares(engine, *pair) for pair in drawn])
            middle = "  ".join(f"{np.median(row):6.3f} ({row.min():5.3f})" for row in found.T)
            short = np.mean(found[:, 0] < found[:, 2])
            print(f"{times:5} {len(engine.statistics.weights):8} | {middle} | {short:.0%}", flush=True)


def shares(engine: Engine, a: int, b: int) -> Shares:
    """Return what walks from one posture of the corpus to another leave out."""
    statistics, joints = engine.statistics, len(engine.corpus.skeleton)
    ends = engine.corpus.to_chains(np.stack([posture(engine, one).rotations for one in (a, b)]))[:, :joints]
    trees = statistics.trees or build_neighbours(engine.corpus.skeleton, statistics.orientations, statistics.weights)
    statistics = PostureStatistics(**vars(statistics) | {"trees": trees})
    return Shares(*np.max([in_part(statistics, number, ends) for number in range(len(trees.parts))], axis=0))


def in_part(statistics: PostureStatistics, number: int, ends: Floats) -> Floats:
    """Return the shares in one part of the body, each the greater one of both ends."""
    trees = statistics.trees
    assert trees is not None
    part, weights = trees.parts[number], statistics.weights
    chosen = choose(statistics, number, ends, STEPS).chosen
    assert chosen.near is not None
    assert not isinstance(chosen.samples, slice)
    shown = np.ascontiguousarray(statistics.orientations[:, part])
    whole, given = np.zeros((len(part), 1), dtype=np.int64), np.ascontiguousarray(ends[:, part])
    off = squared_distances(shown, whole, 1, given)[0]
    near, out = np.ones((STEPS + 1, len(weights))), []
    for k in range(2):
        few = off[k, chosen.samples]
        variance = end_variance(float(np.sqrt(few.min())))
        near[-k] = np.exp(0.5 * (few.min() - off[k]) / variance)
        seen = np.zeros(len(weights), dtype=bool)
        seen[chosen.samples[chosen.near[k]]] = True
        kept, rest = weights[seen] @ near[-k, seen], weights[~seen] @ near[-k, ~seen]
        stands = chosen.weights @ near[-k, chosen.samples]
        farthest = weights[~seen].sum() * near[-k, ~seen].max()
        by_leaves = _by_leaves(statistics, number, given[k], seen, near[-k], (few.min(), variance))
        out.append([1.0 - kept / stands, *(x / (kept + x) for x in (rest, by_leaves, farthest)), seen])
    every = all_samples(statistics, number)
    marginals = posterior_marginals(every.begins, every.ends, every.shares, every.clusters, weights, near)
    walks = [1.0 - marginals[-k, out[k][-1]].sum() for k in range(2)]
    said, rest, leaves, radius = np.max([one[:-1] for one in out], axis=0)
    return np.array([said, rest, max(walks), leaves, radius])


def _by_leaves(
    statistics: PostureStatistics, number: int, given: Floats, seen: Bools, near: Floats, nearest: tuple[float, float]
) -> float:
    """Return at most how much is not `seen`, by what no moment of a leaf's ball can exceed.

    In as many leaves as are searched, the nearest ones, each moment is known.
    """
    trees, (least, variance) = statistics.trees, nearest
    assert trees is not None
    first = len(trees.bounds) // 2
    centres, radii, bounds = trees.centres_of(number)[first:], trees.radii[number, first:], trees.bounds[first:]
    away = np.sqrt([squared_distance(centre, given) / len(given) for centre in centres])
    within = np.maximum(away - radii, 0.0)
    most = np.exp(0.5 * (least - within**2) / variance)
    total = 0.0
    for rank, leaf in enumerate(np.argsort(within, kind="stable")):
        samples = trees.order[number, slice(*bounds[leaf])]
        samples = samples[~seen[samples]]
        weights = statistics.weights[samples]
        total += float(weights @ near[samples]) if rank < N_LEAVES_VISITED else float(weights.sum() * most[leaf])
    return total


if __name__ == "__main__":
    main()
