"""How closely motions follow their paths: the share of joint-moves within the tolerance of the path's states.

    python experiments/wince/followed.py [--pairs 100] [--of ballet indian] [--data PATH/TO/shared/data] [--quick]

Random pairs are those of `experiments.wince`, joined with the defaults. A joint-move is a joint chain at a move; A and
B, which are always exact, do not count. Bundled corpora have states of their own, and are also learned as recordings
are, with a codebook of 15 degrees. Intervals (95 %) come from 4,000 draws of pairs. --quick joins a few pairs of
bundled ballet.
"""

from __future__ import annotations

import argparse

import numpy as np

from experiments.harness import HERE, Row, markdown
from experiments.material import engine, recorded
from experiments.wince.dancers import Dancers, dancers
from experiments.wince.run import BUDGET
from motionmind import Engine, NoPathError, Tween
from motionmind._typing import Floats, Ints
from motionmind.tween.engine import FOLLOWED_SLACK_DEG

BUNDLED = ("ballet", "karate", "macarena")
RECORDINGS = ("cmu-05", "indian", "cmu-16")
DRAWS = 4_000
SEED = 1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=100)
    parser.add_argument("--of", nargs="+", default=[*BUNDLED, *RECORDINGS], choices=[*BUNDLED, *RECORDINGS])
    parser.add_argument("--data", default=str(HERE.parent.parent / "shared" / "data"), help="recorded movement")
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args()
    data, names, pairs = asked.data, asked.of, asked.pairs
    if asked.quick:
        data, names, pairs = None, ["ballet"], 4
    cases = [(name, kind) for name in names if name in BUNDLED for kind in ("", "codebook")]
    cases += [(name, "codebook") for name in recorded(data, *names) if name in RECORDINGS]
    if not cases:
        parser.error(f"no recordings of {', '.join(names)} in {data}")
    rows = [row(data, *case, pairs) for case in cases]
    print(markdown({column: lambda row, column=column: row[column] for column in rows[0]}, rows))


def row(data: str | None, name: str, kind: str, pairs: int) -> Row:
    """What is found in one corpus under one discretization, its own where `kind` is ""."""
    found = engine(data, name, kind)
    tolerances, counts = found.space.tolerances, counted(found, dancers(data, name), pairs)
    joint_moves, within, within_three = counts.T
    return {
        "corpus": name,
        "states": kind or "its own",
        "tolerances, degrees": " to ".join(f"{value:g}" for value in sorted({tolerances.min(), tolerances.max()})),
        "pairs": len(counts),
        "joint-moves": f"{joint_moves.sum():,}",
        "within tolerance": told(share(within, joint_moves)),
        "within three tolerances": told(share(within_three, joint_moves)),
    }


def counted(found: Engine, danced: Dancers, pairs: int) -> Ints:
    """Count the joint-moves of random pairs' tweens, those within tolerance and within three [pairs, 3]."""
    counts = []
    for i, k in danced.far_pairs(pairs, SEED):
        try:
            counts.append(near(found.tween(danced.ends[i], danced.ends[k], node_budget=BUDGET), found.space.tolerances))
        except NoPathError:
            continue
    return np.array(counts)


def near(tween: Tween, tolerances: Floats) -> tuple[int, int, int]:
    """Count a tween's inner joint-moves, those within tolerance and within three; `tolerances` [L] are in degrees."""
    inner = tween.path_degrees[1:-1]
    return inner.size, int(tween.followed[1:-1].sum()), int((inner <= 3.0 * tolerances + FOLLOWED_SLACK_DEG).sum())


def share(part: Ints, whole: Ints) -> tuple[float, float, float]:
    """Return the share of the sums, and its interval over draws of pairs."""
    drawn = np.random.default_rng(0).integers(len(whole), size=(DRAWS, len(whole)))
    low, high = np.quantile(part[drawn].sum(axis=1) / whole[drawn].sum(axis=1), [0.025, 0.975])
    return float(part.sum() / whole.sum()), float(low), float(high)


def told(found: tuple[float, float, float]) -> str:
    middle, low, high = (100 * value for value in found)
    return f"{middle:.1f} % ({low:.1f} to {high:.1f})"


if __name__ == "__main__":
    main()
