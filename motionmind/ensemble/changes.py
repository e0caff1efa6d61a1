"""Changes of formation: who goes to which place, on straight ways on which nobody meets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from motionmind._typing import Floats
from motionmind.ensemble.dancers import Dancer, Way


def whereabouts(dancers: Sequence[Dancer], seconds: float) -> Floats:
    """Return the places x, z [N, 2] of dancers at a time, metres."""
    return np.array([dancer.where(seconds) for dancer in dancers])


def assigned(places: Floats, new: Floats) -> Floats:
    """Return the new places [N, 2] in the order of the dancers who take them.

    The sum of the squared ways is least. Then, if all set out and arrive together, no two of them come closer than the
    least distance between two places, old or new, divided by the root of 2. Source: Turpin, Michael and Kumar, "CAPT:
    Concurrent assignment and planning of trajectories for multiple robots", IJRR 33 (2014), theorem 4.

    Args:
        places: where the dancers are [N, 2].
        new: the places to take [N, 2], in any order.
    """
    from scipy.optimize import linear_sum_assignment

    squares = ((places[:, None] - new[None]) ** 2).sum(axis=-1)
    _, taken = linear_sum_assignment(squares)
    return np.asarray(new[taken])


def send(dancers: Sequence[Dancer], targets: Floats, start: float, end: float) -> list[Dancer]:
    """Return dancers with a way from where they are at `start` to `targets` [N, 2] at `end`, seconds."""
    shifts = targets - whereabouts(dancers, start)
    return [
        replace(dancer, ways=(*dancer.ways, Way(start, end, (float(x), float(z)))))
        for dancer, (x, z) in zip(dancers, shifts, strict=True)
    ]
