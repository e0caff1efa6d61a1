"""How varied movement is that was made of one example: coverage, global and local diversity.

Li, Aberman, Zhang, Hanocka and Sorkine-Hornung, "GANimator: neural motion synthesis from a single sequence", ACM TOG
41(4) (SIGGRAPH 2022), and the code released with it; SinMDM (Raab et al., ICLR 2024) measures the same way. The
distance of two frames is that of the six numbers that describe each joint's rotation (two columns of its matrix). Only
where a body faces does not count here: what is made may turn elsewhere.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot

COVERED = 2.0  # the mean distance of frames below which a window of the example is covered
CLOSELY = 0.5  # the same, more strictly: in quiet movement most frames are within 2 of each other
WINDOW = 30  # frames, of which coverage is taken, and the least length of a patch of the example in global diversity
SHORT = 15  # frames, of which local diversity is taken


def distances(made: Floats, example: Floats) -> Floats:
    """Return the distance of each frame of a movement [L, J, 4] from each of an example [M, J, 4]: [L, M]."""
    x, y = _described(made), _described(example)
    squared = np.sum(x**2, axis=1)[:, None] + np.sum(y**2, axis=1) - 2.0 * x @ y.T
    return np.asarray(np.sqrt(np.maximum(squared, 0.0)))


def coverage(off: Floats, within: float = COVERED) -> float:
    """Return the share of the example's windows that have one of the movement's within a distance.

    Args:
        off: the `distances` of their frames [L, M].
        within: that distance.
    """
    return float(np.mean(_window_distances(off, WINDOW).min(axis=0) < within))


def local_diversity(off: Floats) -> float:
    """Return the mean distance of the movement's short windows from the example's nearest."""
    return float(np.mean(_window_distances(off, SHORT).min(axis=1)))


def global_diversity(off: Floats) -> float:
    """Return the least mean distance of the movement from patches of the example, each `WINDOW` frames or longer.

    The patches may follow one another in any order. A movement that is the example, cut into such patches and put
    together in another order, has 0.
    """
    # cheapest[r, k]: of the frames so far, if the last is the example's frame k and the r-th of its patch; from the
    # r-th on where r is the last row.
    cheapest = np.full((WINDOW, off.shape[1]), np.inf)
    cheapest[0] = off[0]
    for row in off[1:]:
        after = np.full_like(cheapest, np.inf)
        after[0] = cheapest[-1].min()
        after[1:, 1:] = cheapest[:-1, :-1]
        after[-1, 1:] = np.minimum(after[-1, 1:], cheapest[-1, :-1])
        cheapest = after + row
    return float(cheapest[-1].min() / len(off))


def _window_distances(off: Floats, frames: int) -> Floats:
    """Return the mean distance of each window of the movement from each of the example [L - frames, M - frames]."""
    return np.asarray(
        sum(off[k : len(off) - frames + k, k : off.shape[1] - frames + k] for k in range(frames)) / frames
    )


def _described(rotations: Floats) -> Floats:
    """Describe each frame by six numbers a joint [T, 6 J], of rotations without the facing."""
    local = rotations.copy()
    local[:, 0] = rot.inv_mul(rot.about_vertical(rot.heading(rotations[:, 0])), rotations[:, 0])
    return np.asarray(rot.to_matrix(local)[..., :2].reshape(len(rotations), -1))
