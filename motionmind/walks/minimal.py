"""The minimal movement between two postures.

Each joint turns the short way, evenly. A velocity given at an end decays, or builds up, within a fraction of a second.
Walks through a corpus add the rest (`motionmind.walks.mean_walk`).
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot

END_VELOCITY_DECAY_S = 0.45  # longest effect of a velocity at an end; the default where no corpus was fitted


def departure(
    times: Floats,
    leaving: Floats | None,
    arriving: Floats | None,
    until: tuple[float, float] | None = None,
    decay: float = END_VELOCITY_DECAY_S,
) -> Floats:
    """Return the cubic that is 0 at both ends and has the given rates there: [S + 1, ...].

    Args:
        times: increasing [S + 1], seconds.
        leaving: rate at the first time [...], units per second; None for 0.
        arriving: rate at the last time.
        until: the time at which the effect of `leaving` ends, and that at which the effect of `arriving` begins; None
            for the last time and the first.
        decay: seconds for which each rate has effect, at most.
    """
    over, begins = until or (times[-1], times[0])
    begin, end = (times - times[0], over - times[0]), (times[-1] - times, times[-1] - begins)
    out = np.zeros(1)
    for (since, most), rate, sign in ((begin, leaving, 1.0), (end, arriving, -1.0)):
        if rate is not None:
            within = min(decay, most)
            felt = sign * since * np.maximum(1.0 - since / within, 0.0) ** 2
            out = out + felt.reshape(-1, *(1,) * np.ndim(rate)) * rate
    return np.asarray(out)


def minimal_movement(
    ends: Floats, times: Floats, leaving: Floats | None, arriving: Floats | None, decay: float = END_VELOCITY_DECAY_S
) -> Floats:
    """Return orientations [S + 1, m, 4] from ends[0] to ends[1].

    Args:
        ends: orientations of m joints at both ends [2, m, 4].
        times: increasing [S + 1], seconds.
        leaving: angular velocities at the first time [m, 3], rad/s, in the joints' own frames; None if unknown.
        arriving: angular velocities at the last time.
        decay: seconds for which each velocity has effect, at most.
    """
    length = times[-1] - times[0]
    straight = rot.slerp(ends[:1], ends[1:], ((times - times[0]) / length)[:, None])
    if leaving is None and arriving is None:
        return straight
    even = rot.log(rot.inv_mul(ends[0], ends[1])) / length
    first, last = (None if rate is None else rate - even for rate in (leaving, arriving))
    return rot.mul(straight, rot.exp(departure(times, first, last, decay=decay)))
