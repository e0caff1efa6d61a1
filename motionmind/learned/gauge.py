"""A gauge of pace: measurements of each clip alone, so that clips can be added to a corpus and removed.

The pace of a corpus (`motionmind.learned.pace`) consists of sums, percentiles and a fit over all clips. Percentiles of
clips cannot be combined, so the gauge keeps the steps between frames, in single precision. The pace is the same
whether clips were added one by one or at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, Ints, Singles
from motionmind.corpus.kept import Kept
from motionmind.executors.workshop import Workshop


@dataclass(frozen=True, eq=False)
class Gauge:
    """Measurements of C clips, at SAMPLED_FPS, from which the pace of their corpus is fitted.

    Attributes:
        starts: first step, resting frame and window of each clip, then their totals [C + 1, 3].
        steps: from each frame to the next: `motionmind.learned.pace.steps_of`, then the root's displacement, body
            heights [T, J + 6].
        stills: time of each resting frame in the recording, seconds, and its mean joint speed, rad/s [S, 2].
        windows: for pairs of resting frames a window apart: mean joint angle and the body's turn, radians, its travel,
            heights; both resting speeds; seconds between them [W, 6].
    """

    starts: Ints
    steps: Singles
    stills: Floats
    windows: Floats

    @property
    def rows(self) -> tuple[NDArray[Any], ...]:
        """The arrays other than `starts`."""
        return self.steps, self.stills, self.windows

    @property
    def counts(self) -> Ints:
        """Numbers of steps, resting frames and windows of each clip [C, 3]."""
        return np.diff(self.starts, axis=0)


def join_gauges(kept: Kept, old: Gauge, new: Gauge | None, workshop: Workshop) -> Gauge:
    """Join the gauges of an earlier corpus and of new clips into that of a corpus.

    Args:
        kept: the corpus, and which of its clips are new.
        old: gauge of the earlier corpus.
        new: gauge of the new clips; None if there are none.
        workshop: room for large arrays.
    """
    counts = np.zeros((len(kept.numbers), 3), dtype=np.int64)
    for gauge, chosen in ((old, kept.numbers >= 0), (new, kept.numbers < 0)):
        if gauge is not None:
            counts[chosen] = gauge.counts[kept.places[chosen]]
    starts = np.concatenate([np.zeros((1, 3), dtype=np.int64), np.cumsum(counts, axis=0)])

    def join(column: int) -> NDArray[Any]:
        rows = old.rows[column]
        out = workshop.empty((int(starts[-1, column]), rows.shape[1]), rows.dtype)
        runs = kept.runs(old.starts[:, column], None if new is None else new.starts[:, column])
        kept.join(rows, None if new is None else new.rows[column], runs, out)
        return out

    return Gauge(starts, join(0), join(1), join(2))
