"""How a tween's time grows with the corpus: recordings, and then other performances of them made from these.

python experiments/scale/tweens.py PATH/TO/cmu-05 [--times 1 10 100] [--pairs 60] [--keep FOLDER]

A copy is mirrored or not, has a tempo of its own, and every joint but the root is turned by an angle that drifts with
time, so that no two postures are the same. Copies are made one after another and never held together.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from time import perf_counter, process_time

import numpy as np

from motionmind import Engine, Motion, Posture, own_skeleton, read_motion
from motionmind.body.mirror import mirrored
from motionmind.corpus.gather import gather
from motionmind.discretize import make_discretization
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline

FPS, RATE = 30.0, 5.0  # frames a second of the copies, and postures a second that are learned from
TEMPI = 0.8, 1.25
AT_ONCE = 10  # tweens from one corpus, before those from the next
DRIFT = 1.0  # seconds between the angles through which a joint's drift goes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="recordings, BVH")
    parser.add_argument("--times", type=int, nargs="+", default=[1, 10, 100])
    parser.add_argument("--degrees", type=float, default=3.0, help="that joints of a copy are turned by, in the mean")
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="where corpora are kept, and found again")
    parser.add_argument("--part", choices=["build", "ask"], help="in this process; each runs in one of its own")
    options = parser.parse_args()
    if options.part:
        {"build": build, "ask": ask}[options.part](options)
        return
    with tempfile.TemporaryDirectory() as scratch:
        home = options.keep or Path(scratch)
        words = [str(options.folder), "--keep", str(home)]
        for name in ("degrees", "pairs", "seed"):
            words += [f"--{name}", str(getattr(options, name))]
        for times in options.times:
            if not (home / "corpora" / name_of(times)).exists():
                run = [sys.executable, __file__, *words, "--times", str(times), "--part", "build"]
                subprocess.run(run, check=True)
        subprocess.run(
            [sys.executable, __file__, *words, "--times", *map(str, options.times), "--part", "ask"], check=True
        )


def name_of(times: int) -> str:
    return f"times{times}"


def build(options: argparse.Namespace) -> None:
    """Learn a corpus of so many times the recordings, and keep it."""
    (times,) = options.times
    clips = [own_skeleton(read_motion(path)) for path in sorted(options.folder.glob("*.bvh"))]
    clips = [clip.slice(1, len(clip)).resample(FPS) for clip in clips]
    corpus = gather(name_of(times), performances(clips, times, options.degrees, options.seed), rate=RATE)
    Engine.learn(corpus, make_discretization("codebook", 15.0)).save(options.keep / "corpora" / name_of(times))


def performances(clips: list[Motion], times: int, degrees: float, seed: int) -> Iterator[Motion]:
    """Yield the clips as they are, then other performances of each."""
    yield from clips
    rng = np.random.default_rng(seed)
    for number in range(1, times):
        for clip in clips:
            yield performed(clip, number, degrees, rng)


def performed(clip: Motion, number: int, degrees: float, rng: np.random.Generator) -> Motion:
    """Return another performance of a clip, the `number`th, whose joints are turned by so many degrees in the mean."""
    other = mirrored(clip) if number % 2 else clip
    other = replace(other, skeleton=clip.skeleton, times=other.times * rng.uniform(*TEMPI)).resample(FPS)
    knots = np.arange(0.0, other.times[-1] + 2.0 * DRIFT, DRIFT)
    drift = rng.normal(0.0, np.radians(degrees) / 1.6, (len(knots), len(clip.skeleton), 3))
    drift[:, 0] = 0.0
    turned = rot.mul(rot.exp(natural_spline(knots, drift, other.times)), other.rotations)
    return replace(other, rotations=rot.normalise(turned), name=f"{clip.name} {number}")


def ask(options: argparse.Namespace) -> None:
    """Load the corpora, and join random pairs of postures of each, some of one and some of the next in turn: so that a
    machine that is slower for a while is slower for all."""
    Engine.load("ballet")  # imports what loading takes
    asked = [Asked(times, options) for times in options.times]
    for first in range(0, options.pairs, AT_ONCE):
        for one in asked:
            one.join(min(AT_ONCE, options.pairs - first))
    print("times postures | load ms  MB more | first ms  median    95th | guide+search  realise | processor")
    for one in asked:
        print(one.row(), flush=True)


class Asked:
    """A corpus that is loaded, and what its tweens took."""

    def __init__(self, times: int, options: argparse.Namespace) -> None:
        self.times, before, began = times, resident(), perf_counter()
        self.engine = Engine.load(name_of(times), options.keep)
        self.loaded, self.more = perf_counter() - began, resident() - before
        drawn = np.random.default_rng(options.seed).integers(len(self.engine.corpus), size=(options.pairs + 1, 2))
        self.pairs = iter(drawn)
        self.took: list[tuple[float, ...]] = []
        self.join(1)
        self.first = self.took.pop()[0]

    def join(self, count: int) -> None:
        """Join the postures of so many of the next pairs."""
        for a, b in islice(self.pairs, count):
            ends = posture(self.engine, a), posture(self.engine, b)
            began, before = perf_counter(), process_time()
            tween = self.engine.tween(*ends)
            took, used, spent = perf_counter() - began, process_time() - before, tween.seconds
            self.took.append((took, spent["problem"] + spent["bound"] + spent["search"], spent["realise"], used))

    def row(self) -> str:
        """Return a line of the table."""
        took, searching, synthesising, used = 1e3 * np.median(self.took, axis=0)
        late = 1e3 * np.percentile([one[0] for one in self.took], 95)
        return (
            f"{self.times:5} {len(self.engine.corpus):8} | {1e3 * self.loaded:7.1f} {self.more:8.1f} | "
            f"{1e3 * self.first:8.0f} {took:7.1f} {late:7.1f} | {searching:12.1f} {synthesising:8.1f} | {used:9.1f}"
        )


def posture(engine: Engine, index: int) -> Posture:
    """Return a posture of the corpus."""
    return Posture(engine.corpus.skeleton, engine.corpus.rotations[index], engine.corpus.root[index])


def resident() -> float:
    """Return the memory that this process holds now, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


if __name__ == "__main__":
    main()
