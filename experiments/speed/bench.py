"""How fast a tween is found and proven, beside an exact general solver on the same problems, in one run.

python experiments/speed/bench.py PATH/TO/cmu-05 [--rate 5] [--tolerance 15] [--pairs 100] [--seed 0]
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np
import pytoulbar2

from motionmind import Engine, Posture, Tween, make_discretization, own_skeleton, read_motion, write_posture

TIME_LIMIT = 60  # seconds that the general solver gets for one problem


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rate", type=float, default=5.0)
    parser.add_argument("--tolerance", type=float, default=15.0)
    parser.add_argument("--pairs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    files = sorted(options.folder.glob("*.bvh"))
    with tempfile.TemporaryDirectory() as home:
        began = perf_counter()
        engine = Engine.fit(
            (own_skeleton(read_motion(file)) for file in files),
            name="bench",
            rate=options.rate,
            skip=1,
            discretization=make_discretization("codebook", options.tolerance),
        )
        engine.save(Path(home) / "corpora" / "bench")
        built = perf_counter() - began
        engine = Engine.load("bench", home)
        compare(engine, options.pairs, options.seed, built)
        command(engine, Path(home), options.seed)


def compare(engine: Engine, pairs: int, seed: int, built: float) -> None:
    """Tweens between random pairs of postures, each beside the general solver on the problem of as many moves."""
    drawn = np.random.default_rng(seed).integers(len(engine.corpus), size=(pairs, 2))
    engine.tween(posture(engine, 0), posture(engine, len(engine.corpus) - 1), node_budget=10)  # load compiled code
    ours, theirs, proven, gaps, expansions, attested, agree = [], [], 0, [], [], [], 0
    for a, b in drawn:
        began = perf_counter()
        tween = engine.tween(posture(engine, a), posture(engine, b))
        ours.append(perf_counter() - began)
        proven += tween.status == "optimal"
        gaps += [tween.gap] * (tween.status != "optimal")
        expansions.append(tween.expansions)
        attested.append(tween.attested)
        seconds, optimum = general_solver(tween)
        theirs.append(seconds)
        agree += optimum is not None and abs(optimum - tween.cost) < 1e-3
    ms, other = 1e3 * np.array(ours), 1e3 * np.array(theirs)
    size = f"{len(engine.corpus)} postures, largest joint {engine.space.sizes.max()} states"
    print(f"corpus: {size}; read, learned and saved in {built:.2f} s")
    print(f"tween, all numbers of moves: median {np.median(ms):.0f} ms, 95th percentile {np.percentile(ms, 95):.0f} ms")
    print(f"proven optimal: {proven} of {pairs}; gaps of the rest: {[f'{gap:.2%}' for gap in gaps]}")
    print(f"expansions: median {np.median(expansions):.0f}, most {max(expansions)}; attested {np.mean(attested):.1%}")
    print(f"toulbar2, that number of moves: median {np.median(other):.0f} ms, 95th {np.percentile(other, 95):.0f} ms")
    print(f"toulbar2 / tween: median {np.median(other) / np.median(ms):.2f}, mean {other.mean() / ms.mean():.2f}")
    print(f"the same optimum: {agree} of {pairs} (limit {TIME_LIMIT} s a problem)")


def posture(engine: Engine, index: int) -> Posture:
    """A posture of the corpus."""
    return Posture(engine.corpus.skeleton, engine.corpus.rotations[index], engine.corpus.root[index])


def general_solver(tween: Tween) -> tuple[float, float | None]:
    """Seconds that toulbar2 takes to solve the problem (reading it does not count), and its optimum."""
    if tween.moves == 0:
        return 0.0, tween.cost
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "problem.cfn"
        path.write_text(tween.problem())
        network = pytoulbar2.CFN(verbose=-1)
        network.Read(str(path))
        network.CFN.timer(TIME_LIMIT)
        began = perf_counter()
        found = network.Solve()
        return perf_counter() - began, found[1] if found else None


def command(engine: Engine, home: Path, seed: int) -> None:
    """The whole command, compiled code on disk."""
    drawn = np.random.default_rng(seed).integers(len(engine.corpus), size=(9, 2))
    script = [str(Path(sys.executable).with_name("motionmind")), "tween", str(home / "A.json"), str(home / "B.json")]
    seconds = []
    for a, b in drawn:
        for name, index in (("A", a), ("B", b)):
            write_posture(home / f"{name}.json", posture(engine, index))
        began = perf_counter()
        subprocess.run(
            [*script, "--corpus", "bench", "-o", str(home / "tween.bvh")],
            env={**os.environ, "MOTIONMIND_HOME": str(home)},
            check=True,
            capture_output=True,
        )
        seconds.append(perf_counter() - began)
    bare = perf_counter()
    subprocess.run([sys.executable, "-c", "import numpy, numba"], check=True)
    bare = perf_counter() - bare
    print(f"whole command: median {np.median(seconds):.2f} s of {len(seconds)}; of it numpy and numba {bare:.2f} s")


if __name__ == "__main__":
    main()
