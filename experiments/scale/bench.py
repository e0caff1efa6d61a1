"""How building, loading and asking grow with the corpus: recordings repeated, each copy turned a little in every joint.

python experiments/scale/bench.py PATH/TO/cmu-05 [--times 1 10 100] [--tolerance 15] [--degrees 3] [--pairs 30]
"""

import argparse
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

from motionmind import Engine, Motion, Posture, own_skeleton, read_motion
from motionmind.corpus.gather import gather
from motionmind.discretize import make_discretization
from motionmind.geometry import rotations as rot

RATE = 5.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--times", type=int, nargs="+", default=[1, 10, 100])
    parser.add_argument("--tolerance", type=float, default=15.0)
    parser.add_argument(
        "--degrees", type=float, default=3.0, help="that each joint of a copy is turned by, in the mean"
    )
    parser.add_argument("--pairs", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--part", choices=["build", "ask"], help="in this process; each runs in one of its own")
    parser.add_argument("--home", help="where the corpus lies between the parts")
    options = parser.parse_args()
    if options.part:
        {"build": build, "ask": ask}[options.part](options)
        return
    print("times postures  states most  gather  learn   save     MB peak | load ms  MB more | first  median    95th")
    for times in options.times:
        with tempfile.TemporaryDirectory() as home:
            words = [str(options.folder), "--times", str(times), "--home", home]
            for name in ("tolerance", "degrees", "pairs", "seed"):
                words += [f"--{name}", str(getattr(options, name))]
            for part in ("build", "ask"):
                subprocess.run([sys.executable, __file__, *words, "--part", part], check=True)


def build(options: argparse.Namespace) -> None:
    """Learn the corpus and save it."""
    recorded = gather("recorded", (own_skeleton(read_motion(f)) for f in files(options)), rate=RATE, skip=1)
    clips = [recorded.motion(clip) for clip in recorded.clips]
    times = options.times[0]
    began = perf_counter()
    corpus = gather("bench", copies(clips, times, options.degrees, options.seed), flips="keep")
    gathered = perf_counter()
    engine = Engine.learn(corpus, make_discretization("codebook", options.tolerance))
    learned = perf_counter()
    engine.save(Path(options.home) / "corpora" / "bench")
    saved = perf_counter()
    sizes = engine.space.sizes
    print(
        f"{times:5} {len(corpus):8} {sizes.sum():7} {sizes.max():4} {gathered - began:7.2f} {learned - gathered:6.2f} "
        f"{saved - learned:6.2f} {peak():11.0f}",
        end=" |",
        flush=True,
    )


def ask(options: argparse.Namespace) -> None:
    """Load the corpus, and join random pairs of its postures."""
    Engine.load("ballet")  # imports what loading takes
    before, began = resident(), perf_counter()
    engine = Engine.load("bench", options.home)
    loaded, more = perf_counter() - began, resident() - before
    drawn = np.random.default_rng(options.seed).integers(len(engine.corpus), size=(options.pairs + 1, 2))
    seconds = []
    for a, b in drawn:
        began = perf_counter()
        engine.tween(posture(engine, a), posture(engine, b))
        seconds.append(perf_counter() - began)
    ms = 1e3 * np.array(seconds)
    print(
        f"{1e3 * loaded:8.1f} {more:8.1f} |{ms[0]:6.0f} {np.median(ms[1:]):7.1f} {np.percentile(ms[1:], 95):7.1f}",
        flush=True,
    )


def files(options: argparse.Namespace) -> list[Path]:
    return sorted(options.folder.glob("*.bvh"))


def copies(clips: list[Motion], times: int, degrees: float, seed: int) -> Iterator[Motion]:
    """Yield the clips as they are, then copies in which every joint but the root is turned by a small random angle.

    A joint's angle is the same throughout a copy, `degrees` in the mean.
    """
    rng = np.random.default_rng(seed)
    yield from clips
    for copy in range(1, times):
        for clip in clips:
            turn = rot.exp(rng.normal(0.0, np.radians(degrees) / 1.6, (len(clip.skeleton), 3)))
            turn[0] = rot.IDENTITY
            yield replace(clip, rotations=rot.normalise(rot.mul(turn, clip.rotations)), name=f"{clip.name} {copy}")


def posture(engine: Engine, index: int) -> Posture:
    """Return a posture of the corpus."""
    return Posture(engine.corpus.skeleton, engine.corpus.rotations[index], engine.corpus.root[index])


def peak() -> float:
    """Return the peak memory of this process, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def resident() -> float:
    """Return the memory that this process holds now, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


if __name__ == "__main__":
    main()
