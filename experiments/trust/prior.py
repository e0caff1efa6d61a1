"""python experiments/trust/prior.py [FOLDER]

Print what dancers of the folder (../shared/data) show of trust together, each counting the same: the prior of
`motionmind.learned.trust`. Of a phrase that was danced more than once, one recording is taken. The recordings are those
of mocap.cs.cmu.edu, which are free for all uses.
"""

from __future__ import annotations

import sys

import numpy as np

from experiments.material import corpus, families, part, take_of
from motionmind._typing import Floats
from motionmind.learned.posture_statistics import learn_posture_statistics
from motionmind.learned.trust import DISTANCE_RATIOS, Squares
from motionmind.walks.evidence import DECAY_CANDIDATES_S, end_velocity_errors, gather_evidence

DANCERS = ("cmu-05", "cmu-16", "cmu-29", "cmu-135")  # dance, runs and leaps, slow gestures, karate
WINDOWS = 120  # of each length
STRENGTH = 0.01  # of nothing at all, for entries that no window tells of


def main(data: str) -> None:
    """Print the table and the duration of velocities of each dancer, and of all together."""
    shares, lasting = [], []
    for name in DANCERS:
        whole, takes = corpus(data, name), {family[0] for family in families(data, name)}
        movement = part(whole, [number for number, clip in enumerate(whole.clips) if take_of(clip.name) in takes])
        found = Squares.summed(gather_evidence(movement, learn_posture_statistics(movement), WINDOWS))
        shares.append(Squares(found.inner / found.whole, found.along / found.whole, 1.0))
        errors = end_velocity_errors(movement, WINDOWS)
        lasting.append(errors / errors.min())
        _tell(name, shares[-1], lasting[-1])
    _tell("together", Squares.summed(shares), np.mean(lasting, axis=0))


def _tell(name: str, found: Squares, lasting: Floats) -> None:
    table = found.fitted(np.zeros(len(DISTANCE_RATIOS)), STRENGTH)
    print(f"{name}: shares {table.round(2).tolist()}, velocities last {DECAY_CANDIDATES_S[int(lasting.argmin())]} s")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "../shared/data")
