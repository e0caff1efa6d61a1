"""The minimal movement between two postures.

With nothing known but two postures, each joint turns the short way, evenly. Where the body moves at an end, it loses
or gains that velocity within a while. Walks through a corpus add what such a body does on the way
(`motionmind.walks.mean_walk`).
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot

LASTS = 0.45  # seconds for which a velocity at an end is felt at most, unless a corpus shows otherwise


def departure(
    times: Floats,
    leaving: Floats | None,
    arriving: Floats | None,
    until: tuple[float, float] | None = None,
    lasts: float = LASTS,
) -> Floats:
    """Return the cubic that is 0 at both ends and has the given rates there: [S + 1, ...].

    Args:
        times: increasing [S + 1], seconds.
        leaving: rate at the first time [...], units a second; None for 0.
        arriving: rate at the last.
        until: the time by which the first is over, and that before which the last is not felt; None for the whole.
        lasts: seconds for which each rate is felt at most.
    """
    over, begins = until or (times[-1], times[0])
    begin, end = (times - times[0], over - times[0]), (times[-1] - times, times[-1] - begins)
    out = np.zeros(1)
    for (since, most), rate, sign in ((begin, leaving, 1.0), (end, arriving, -1.0)):
        if rate is not None:
            within = min(lasts, most)
            felt = sign * since * np.maximum(1.0 - since / within, 0.0) ** 2
            out = out + felt.reshape(-1, *(1,) * np.ndim(rate)) * rate
    return np.asarray(out)


def minimal_movement(
    ends: Floats, times: Floats, leaving: Floats | None, arriving: Floats | None, lasts: float = LASTS
) -> Floats:
    """Return orientations [S + 1, m, 4] from ends[0] to ends[1].

    Args:
        ends: orientations of m joints at both ends [2, m, 4].
        times: increasing [S + 1], seconds.
        leaving: angular velocities at the first [m, 3], radians a second, in the joints' own frames; None if unknown.
        arriving: the same at the last.
        lasts: seconds for which each is felt at most.
    """
    length = times[-1] - times[0]
    straight = rot.slerp(ends[:1], ends[1:], ((times - times[0]) / length)[:, None])
    if leaving is None and arriving is None:
        return straight
    even = rot.log(rot.inv_mul(ends[0], ends[1])) / length
    first, last = (None if rate is None else rate - even for rate in (leaving, arriving))
    return rot.mul(straight, rot.exp(departure(times, first, last, lasts=lasts)))
