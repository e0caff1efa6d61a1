"""A gauge of pace: what each clip of a corpus shows by itself, so that clips can be added and removed.

The pace of a corpus (`motionmind.learned.pace`) is made of sums, percentiles and a fit over all of its clips.
Percentiles of all do not follow from percentiles of each; so the steps between frames are kept, in single precision,
and the pace is the same whether clips came one by one or at once.
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
    """The pace that each of C clips shows by itself, at FPS frames a second; that of the corpus is refitted from it.

    Attributes:
        starts: where the steps, still moments and windows of each clip begin, and how many there are [C + 1, 3].
        steps: from each frame to the next: as of `motionmind.learned.pace.steps_of`, then the displacement of the root,
            heights [T, J + 6].
        stills: of the still moments, seconds in the recording and the speed of the mean joint, rad/s [S, 2].
        windows: the ways between each two that are as far apart as a window: angles of the mean joint and of the
            body's turning, radians, and its travel, heights; both speeds; seconds [W, 6].
    """

    starts: Ints
    steps: Singles
    stills: Floats
    windows: Floats

    @property
    def rows(self) -> tuple[NDArray[Any], ...]:
        """All but where they begin."""
        return self.steps, self.stills, self.windows

    @property
    def counts(self) -> Ints:
        """Numbers of steps, still moments and windows of each clip [C, 3]."""
        return np.diff(self.starts, axis=0)


def join_gauges(kept: Kept, old: Gauge, new: Gauge | None, workshop: Workshop) -> Gauge:
    """Return what the clips of a corpus show, given that of the clips of an earlier one and of those that are new.

    Args:
        kept: the corpus, and which of its clips are new.
        old: of the earlier corpus.
        new: of the new clips; None if there are none.
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
