"""Sharpness of the style classifier: the shares of held-out windows, SLERP and shuffles that it accepts.

python experiments/net/sharpness.py [--data ../shared/data] [--seed 0]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from experiments.material import FPS, TOLD_APART, movement, recorded
from motionmind.metrics.style import fit_style_classifier

SECONDS = (0.6, 1.2, 2.0, 4.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(__file__).parents[3] / "shared" / "data")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    names = recorded(options.data, *TOLD_APART)
    if len(names) < 2:
        parser.error(f"{options.data}: there are not two of {', '.join(TOLD_APART)} to be told apart")
    clips = {
        name: {sequence: [piece.rotations for piece in pieces] for sequence, pieces in found.items()}
        for name in names
        for found in [movement(str(options.data), name, 0)]
    }
    for seconds in SECONDS:
        for name, shares in fit_style_classifier(clips, round(seconds * FPS)).table(options.seed).items():
            told = ", ".join(f"{kind} {share:.0%}" for kind, share in shares.items())
            print(f"{seconds:g} s, {name}, {len(clips[name])} sequences: {told}")


if __name__ == "__main__":
    main()
