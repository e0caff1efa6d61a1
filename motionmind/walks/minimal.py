"""The minimal movement between two postures, and how far to trust what a corpus's walks add to it.

With nothing known but two postures, each joint turns the short way, evenly. Where the body moves at an end, it loses
or gains that velocity within a while. Walks through a corpus add what such a body does on the way; but walks that
start and end far from the given postures are of another movement, and what they add shrinks towards nothing.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot

LASTS = 0.45  # seconds for which a velocity at an end is felt at most
FAR = 1.2  # walks are trusted by half where the corpus is as far as 1 / FAR of the way to go
UNLIKE = 0.45  # radians a joint (root mean square): as far as that the corpus holds another posture altogether
SHARPLY = 4  # power by which trust falls beyond that
NO_WAY = 1e-3  # radians a joint: nothing to go, but for the rounding of files


def departure(
    times: Floats, leaving: Floats | None, arriving: Floats | None, until: tuple[float, float] | None = None
) -> Floats:
    """Return the cubic that is 0 at both ends and has the given rates there: [S + 1, ...].

    Each rate is felt for LASTS seconds at most.

    Args:
        times: increasing [S + 1], seconds.
        leaving: rate at the first time [...], units a second; None for 0.
        arriving: rate at the last.
        until: the time by which the first is over, and that before which the last is not felt; None for the whole.
    """
    over, begins = until or (times[-1], times[0])
    begin, end = (times - times[0], over - times[0]), (times[-1] - times, times[-1] - begins)
    out = np.zeros(1)
    for (since, most), rate, sign in ((begin, leaving, 1.0), (end, arriving, -1.0)):
        if rate is not None:
            within = min(LASTS, most)
            felt = sign * since * np.maximum(1.0 - since / within, 0.0) ** 2
            out = out + felt.reshape(-1, *(1,) * np.ndim(rate)) * rate
    return np.asarray(out)


def minimal_movement(ends: Floats, times: Floats, leaving: Floats | None, arriving: Floats | None) -> Floats:
    """Return orientations [S + 1, m, 4] from ends[0] to ends[1].

    Args:
        ends: orientations of m joints at both ends [2, m, 4].
        times: increasing [S + 1], seconds.
        leaving: angular velocities at the first [m, 3], radians a second, in the joints' own frames; None if unknown.
        arriving: the same at the last.
    """
    length = times[-1] - times[0]
    straight = rot.slerp(ends[:1], ends[1:], ((times - times[0]) / length)[:, None])
    if leaving is None and arriving is None:
        return straight
    even = rot.log(rot.inv_mul(ends[0], ends[1])) / length
    rates = (None if rate is None else rate - even for rate in (leaving, arriving))
    return rot.mul(straight, rot.exp(departure(times, *rates)))


def trust(nearest: Floats, way: float) -> float:
    """Return the share of what walks of a part of the body add that is to be trusted, from 0 to 1.

    It is 1 / (1 + (FAR d / way)^SHARPLY) / (1 + (d / UNLIKE)^SHARPLY), with d the distance of the ends from the
    corpus's nearest postures, on average, and the way that from one end to the other. Where there is no way to go,
    nothing is added.

    Args:
        nearest: distance of each end from the corpus's nearest posture of the part [2], radians a joint.
        way: distance from one end to the other, radians a joint.
    """
    if way < NO_WAY:
        return 0.0
    off = float(nearest.mean())
    return 1.0 / (1.0 + (FAR * off / way) ** SHARPLY) / (1.0 + (off / UNLIKE) ** SHARPLY)
