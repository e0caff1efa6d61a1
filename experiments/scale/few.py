"""What it costs to look at few moments of a large corpus: in-betweens of movement that was held out.

python experiments/scale/few.py PATH/TO/DATA [--by cmu-05 indian] [--postures 20000] [--keep FOLDER]

Half of a dancer's families of takes are held out, and then the other half. From performances of the rest, made as
`tweens.py` makes them, so many postures are learned. Windows of what is held out are filled by walks through all
moments and by walks through few. L2Q is in per cent below SLERP's; intervals of 95% are by families.
"""

import argparse
import sys
import tempfile
import warnings
from dataclasses import replace
from math import ceil
from pathlib import Path

import numpy as np
from tweens import FPS, performances

sys.path.insert(0, str(Path(__file__).parents[2]))

from experiments.inbetween.rivals import slerp
from experiments.inbetween.run import GAPS, GIVEN, Window, tween, windows_of
from experiments.material import RATE, families, movement, recordings
from motionmind import Engine, NoPathError
from motionmind._typing import Floats
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.gather import gather
from motionmind.discretize import make_discretization

STRIDE, LONG_STRIDE = 0.7, 1.0  # seconds from window to window; the second of those longer than LONG
LONG = 3.0
DRAWS = 4_000  # of families, for an interval


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", help="recordings of all dancers")
    parser.add_argument("--by", nargs="+", default=["cmu-05", "indian"], help="dancers")
    parser.add_argument("--postures", type=int, default=20_000, help="that are learned from, about")
    parser.add_argument("--degrees", type=float, default=3.0, help="that joints of a copy are turned by, in the mean")
    parser.add_argument("--keep", type=Path, help="where corpora are kept, and found again")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as scratch:
        options.home = options.keep or Path(scratch)
        found = {by: np.array([row for part in range(2) for row in measured(by, part, options)]) for by in options.by}
    for by, rows in found.items():
        print(f"\n{by} | windows | all | few | few less all, points")
        for seconds in GAPS:
            print(f"{seconds:g} s | {line(rows[rows[:, 0] == seconds])}")
        print(f"all | {line(rows)}")
    print(f"\nmean of {', '.join(found)}: few less all {difference(list(found.values()))}")


def measured(by: str, part: int, options: argparse.Namespace) -> list[tuple[float, int, float, float, float]]:
    """Return of each window of one half its seconds, its family, and L2Q of all, of few and of SLERP."""
    groups = families(options.folder, by)
    held = {take: number for number, family in enumerate(groups) if number % 2 == part for take in family}
    few = learned(by, part, [take for family in groups for take in family if take not in held], options)
    every = replace(few, statistics=replace(few.statistics, trees=None))
    out = []
    for seconds in GAPS:
        frames = round(seconds * FPS)
        stride = round((LONG_STRIDE if seconds > LONG else STRIDE) * FPS)
        for take, number, start in windows_of(options.folder, by, held, frames, stride):
            window = Window(movement(options.folder, by, frames)[take][number], start, frames)
            ends = window.ends(GIVEN[0])
            body, real = window.real.skeleton, window.real.rotations
            try:
                made = [tween(engine, ends, seconds)[0][0] for engine in (every, few)]
            except NoPathError:
                continue
            costs = (l2q(body, real, rotations) for rotations in (*made, slerp(ends)[0]))
            out.append((seconds, held[take], *costs))
    return out


def learned(by: str, part: int, takes: list[str], options: argparse.Namespace) -> Engine:
    """Return an engine that has learned from performances of some takes, from where it is kept if it is there."""
    name = f"few-{by}-{part}"
    if not (options.home / "corpora" / name).exists():
        clips = [clip.resample(FPS) for clip in recordings(options.folder, by) if clip.name in takes]
        times = ceil(options.postures / len(gather(name, clips, rate=RATE)))
        corpus = gather(name, performances(clips, times, options.degrees, part), rate=RATE)
        Engine.learn(corpus, make_discretization("codebook", 15.0)).save(options.home / "corpora" / name)
    return Engine.load(name, options.home)


def l2q(body: Skeleton, real: Floats, made: Floats) -> float:
    """Return the mean distance of global orientations over a window's frames."""
    one, other = body.global_rotations(real), body.global_rotations(made)
    sign = np.where((one * other).sum(axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    return float(np.sqrt(((one - sign * other) ** 2).sum(axis=(1, 2))).mean())


def line(rows: Floats) -> str:
    """Return a line of a table of windows."""
    every, few = below([rows])
    return f"{len(rows)} | {every:.1f} | {few:.1f} | {difference([rows])}"


def difference(dancers: list[Floats]) -> str:
    """Return by how many points few are nearer than all, in the mean of the dancers, and its interval by families."""
    own = [[rows[rows[:, 1] == family] for family in np.unique(rows[:, 1])] for rows in dancers]
    rng = np.random.default_rng(0)

    def mean(drawn: list[list[Floats]]) -> float:
        return float(np.mean([np.diff(below(families))[0] for families in drawn]))

    low, high = np.percentile(
        [mean([[of[k] for k in rng.integers(len(of), size=len(of))] for of in own]) for _ in range(DRAWS)], [2.5, 97.5]
    )
    return f"{mean(own):.1f} ({low:.1f} to {high:.1f})"


def below(families: list[Floats]) -> Floats:
    """Return how far L2Q of all and of few is below SLERP's [2], per cent."""
    every, few, straight = np.concatenate(families)[:, 2:].mean(axis=0)
    return 100.0 * (1.0 - np.array([every, few]) / straight)


if __name__ == "__main__":
    main()
