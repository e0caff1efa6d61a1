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

from motionmind import Engine, Posture, Tween, own_skeleton, read_motion, write_posture
from motionmind.discretize import make_discretization

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
    ours, fixed, reading, solving = [], [], [], []
    proven, gaps, expansions, attested, agree = 0, [], [], [], 0
    for a, b in drawn:
        began = perf_counter()
        tween = engine.tween(posture(engine, a), posture(engine, b))
        ours.append(perf_counter() - began)
        proven += tween.status == "optimal"
        gaps += [tween.gap] * (tween.status != "optimal")
        expansions.append(tween.expansions)
        attested.append(tween.attested)
        if tween.moves == 0:
            agree += 1
            continue
        again = engine.tween(posture(engine, a), posture(engine, b), moves=tween.moves)
        fixed.append(sum(again.seconds[part] for part in ("problem", "bound", "search")))
        read, solved, optimum = general_solver(tween)
        reading.append(read)
        solving.append(solved)
        agree += optimum is not None and abs(optimum - tween.cost) < 1e-3
    ms, same, read, other = (1e3 * np.array(seconds) for seconds in (ours, fixed, reading, solving))
    size = f"{len(engine.corpus)} postures, largest joint {engine.space.sizes.max()} states"
    print(f"corpus: {size}; read, learned and saved in {built:.2f} s")
    print(f"tween, all numbers of moves: median {np.median(ms):.0f} ms, 95th percentile {np.percentile(ms, 95):.0f} ms")
    print(f"proven optimal: {proven} of {pairs}; gaps of the rest: {[f'{gap:.2%}' for gap in gaps]}")
    print(f"expansions: median {np.median(expansions):.0f}, most {max(expansions)}; attested {np.mean(attested):.1%}")
    print("that number of moves alone, posed and solved:      median      95th      mean")
    for name, times in (("here", same), ("toulbar2, solving", other), ("toulbar2, reading and solving", read + other)):
        print(f"{name:45}{np.median(times):9.1f} {np.percentile(times, 95):9.1f} {times.mean():9.1f} ms")
    for name, times in (("solving", other), ("reading and solving", read + other)):
        ratios = [f(times) / f(same) for f in (np.median, lambda t: np.percentile(t, 95), np.mean)]
        print(f"toulbar2 {name} / here: " + ", ".join(f"{ratio:.1f}" for ratio in ratios))
    print(f"the same optimum: {agree} of {pairs} (limit {TIME_LIMIT} s a problem)")


def posture(engine: Engine, index: int) -> Posture:
    """A posture of the corpus."""
    return Posture(engine.corpus.skeleton, engine.corpus.rotations[index], engine.corpus.root[index])


def general_solver(tween: Tween) -> tuple[float, float, float | None]:
    """Seconds that toulbar2 takes to read the problem and to solve it, and its optimum."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "problem.cfn"
        path.write_text(tween.problem())
        began = perf_counter()
        network = pytoulbar2.CFN(verbose=-1)
        network.Read(str(path))
        read = perf_counter() - began
        network.CFN.timer(TIME_LIMIT)
        found = network.Solve()
        return read, perf_counter() - began - read, found[1] if found else None


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
