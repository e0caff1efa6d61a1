"""Balance: rows that keep a body's weight over its support, as far as a corpus's bodies keep it there.

Two points are kept near the support, the hull of what bears on the floor. The *zero-moment point* is where the floor's
force acts, c - (h / g) c'' for a centre of mass c at height h: it cannot leave the support, however a body accelerates.
Source: Kajita et al., "Biped walking pattern generation by using preview control of zero-moment point", ICRA (2003).
The centre of mass itself may be as far beyond as the corpus's bodies have theirs.

Constants were chosen on ballet, and looked at on recordings.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.footing.least_squares import Rows
from motionmind.jit import jit

GRAVITY = 9.81  # metres a second squared
OVER = 0.005  # metres beyond what is allowed, standard deviation
GIVES = 0.005  # metres beyond it from which a row pulls no harder: what cannot be had is not worth a jerk
ACROSS = 0.3  # of a row's weight: that of not going round the support instead of towards it
ROOM = (
    0.04  # metres that the zero-moment point may be beyond the support: half a foot's width, points being in its middle
)
SWAYS = 0.5  # seconds in which a body that is given beyond its support comes back over it
DEEP = 0.1  # metres beyond what is allowed at which a body surely falls
WALKS = 0.5  # metres a second: a body that travels faster falls from foot to foot, as walkers do


def balance_rows(
    points: Floats,
    touches: Bools,
    centre: Floats,
    own: Floats,
    height: Floats,
    overhang: float,
    gravity: float,
    fps: float,
) -> Rows:
    """Return rows for the root's trajectory that bring the weight back over the support where it is beyond it.

    They are those of the zero-moment point towards the support, and round it, and the same of the centre of mass, for
    all frames but the first and the last.

    Args:
        points: level places of points of the body [N, P, 2], metres.
        touches: which of them bear the body on the floor [N, P]; none where it is in the air.
        centre: level place of the centre of mass [N, 2], metres.
        own: the same relative to the root.
        height: of the centre of mass above the floor [N], metres.
        overhang: how far beyond the support the centre of mass may be, metres.
        gravity: metres a second squared.
        fps: frames a second.
    """
    lever = np.maximum(height, 0.1)[1:-1] / gravity * fps**2
    # The same order in memory, whoever asks, or it would be compiled for each.
    points, centre, own = (np.ascontiguousarray(places) for places in (points, centre, own))
    rows = _balance_rows(points, touches, centre, own, lever, _fades(len(centre), fps), overhang)
    return Rows(np.tile(np.arange(len(lever)), 4), *rows)


@lru_cache(maxsize=64)
def _fades(count: int, fps: float) -> Floats:
    """Return how far a body is yet from having left the first frame, in so many frames [count], from 1 to 0."""
    since = np.minimum(np.arange(count) / (SWAYS * fps), 1.0)
    return np.asarray(1.0 - since * since * (3.0 - 2.0 * since))


@jit
def _balance_rows(
    points: Floats, touches: Bools, centre: Floats, own: Floats, lever: Floats, fades: Floats, overhang: float
) -> tuple[Floats, Floats, Floats]:
    """Return the coefficients [4 (N - 2), 9], targets and weights of `balance_rows`, with h / g in frames^2 [N - 2]."""
    count = len(lever)
    coefficients, targets, weights = np.zeros((4 * count, 9)), np.empty(4 * count), np.empty(4 * count)
    pressure = centre.copy()
    for t in range(1, count + 1):
        for k in range(2):
            pressure[t, k] -= lever[t - 1] * ((centre[t + 1, k] - centre[t, k]) - (centre[t, k] - centre[t - 1, k]))
    for which, (point, share, room) in enumerate(((pressure, lever, ROOM), (centre, 0.0 * lever, overhang))):
        nearest, here = _nearest_in_support(points, touches, point), slice(2 * count * which, 2 * count * (which + 1))
        rows = coefficients[here], targets[here], weights[here]
        _write_rows_towards(nearest, point, own, share, fades, room, *rows)
    return coefficients, targets, weights


@jit
def _write_rows_towards(
    nearest: Floats,
    point: Floats,
    own: Floats,
    share: Floats,
    fades: Floats,
    room: float,
    coefficients: Floats,
    targets: Floats,
    weights: Floats,
) -> None:
    """Write rows that bring a point towards the nearest of the support, then rows that keep it from going round that.

    Args:
        nearest: level places of the support [N, 2], metres.
        point: those of the point that is to be near them: c - s c'' of the centre of mass c [N, 2].
        own: of the centre of mass relative to the root [N, 2].
        share: s of all frames but the first and the last [N - 2], in frames^2.
        fades: how far the body is yet from having left the first frame [N], from 1 to 0.
        room: how far beyond the support the point may be, metres.
        coefficients: of both [2 (N - 2), 9], 0 before.
        targets: of both [2 (N - 2)].
        weights: of both [2 (N - 2)].
    """
    count = len(point)
    far = np.sqrt((point[:, 0] - nearest[:, 0]) ** 2 + (point[:, 1] - nearest[:, 1]) ** 2)
    for t in range(1, count - 1):
        # Ends may be beyond the support; the body comes back from there, and goes there, within a while.
        allowed = max(far[0] * fades[t], far[-1] * fades[count - 1 - t], room)
        over, s = max(far[t] - allowed, 0.0), share[t - 1]
        pull = OVER**-2.0 / np.sqrt(1.0 + (over / GIVES) ** 2) if over > 0.0 else 0.0
        x, y = (point[t] - nearest[t]) / max(far[t], 1e-9)
        for row, direction, further, weight in (
            (t - 1, (x, y), min(far[t], allowed), pull),
            (t - 1 + count - 2, (-y, x), 0.0, ACROSS * pull),
        ):
            target = direction[0] * nearest[t, 0] + direction[1] * nearest[t, 1] + further
            for k in range(2):
                bends = (own[t + 1, k] - own[t, k]) - (own[t, k] - own[t - 1, k])
                target -= direction[k] * (own[t, k] - s * bends)
                for frame, factor in enumerate((-s, 1.0 + 2.0 * s, -s)):
                    coefficients[row, 3 * frame + 2 * k] = direction[k] * factor
            targets[row], weights[row] = target, weight


def walks(root: Floats, fps: float) -> bool:
    """Return whether a body travels so fast that it is never to stand still over a foot: positions [N, 3], metres."""
    return bool(np.linalg.norm((root[-1] - root[0])[[0, 2]]) * fps > WALKS * (len(root) - 1))


def is_beyond(points: Floats, touches: Bools, centre: Floats, overhang: float) -> Bools:
    """Return where a centre of mass is farther beyond its support than it may be [N].

    Args:
        points: level places of points of the body [N, P, 2], metres.
        touches: which of them bear the body on the floor [N, P].
        centre: level place of the centre of mass [N, 2], metres.
        overhang: how far beyond the support it may be, metres.
    """
    return np.asarray(np.linalg.norm(centre - nearest_in_support(points, touches, centre), axis=1) > overhang)


def falls_without(points: Floats, low: Bools, feet: Bools, centre: Floats, overhang: float) -> Floats:
    """Return how far a body would fall without each foot [N, feet], from 0 to 1 where it surely falls.

    Args:
        points: level places of points of the body [N, P, 2], metres.
        low: which of them would bear it if all its feet stood [N, P].
        feet: which of them are each foot's [feet, P].
        centre: level place of the centre of mass [N, 2], metres.
        overhang: how far beyond its support that may be, metres.
    """
    out = np.zeros((len(centre), len(feet)))
    for number, own in enumerate(feet):
        far = np.linalg.norm(centre - nearest_in_support(points, low & ~own, centre), axis=1)
        out[:, number] = np.clip((far - overhang) / DEEP, 0.0, 1.0)
    return out


def nearest_in_support(points: Floats, touches: Bools, wanted: Floats) -> Floats:
    """Return the point [N, 2] of each support that is nearest to a wanted one [N, 2]; that itself where none bears.

    The support is the convex hull of the points that touch the floor. A point outside of it is nearest to one of the
    segments between two of them; one inside sees them all around itself, with no gap of half a turn.

    Args:
        points: level places of points on the floor [N, P, 2], metres.
        touches: which of them bear the body [N, P].
        wanted: level places [N, 2], metres.
    """
    # The same order in memory, whoever asks, or it would be compiled for each.
    return _nearest_in_support(np.ascontiguousarray(points), touches, np.ascontiguousarray(wanted))


@jit
def _nearest_in_support(points: Floats, touches: Bools, wanted: Floats) -> Floats:
    out = wanted.copy()
    angles, chosen = np.empty(points.shape[1]), np.empty(points.shape[1], np.int64)
    for t in range(len(points)):
        count = 0
        for i in range(points.shape[1]):
            if touches[t, i]:
                chosen[count] = i
                angles[count] = np.arctan2(points[t, i, 1] - wanted[t, 1], points[t, i, 0] - wanted[t, 0])
                count += 1
        if count > 2:
            angles[:count].sort()
            gap = angles[0] + 2.0 * np.pi - angles[count - 1]
            for i in range(1, count):
                gap = max(gap, angles[i] - angles[i - 1])
            if gap < np.pi:
                continue
        best = np.inf
        for number in range(count):
            i = chosen[number]
            dx, dy = points[t, i, 0] - wanted[t, 0], points[t, i, 1] - wanted[t, 1]
            for j in chosen[: number + 1]:
                ex, ey = points[t, j, 0] - points[t, i, 0], points[t, j, 1] - points[t, i, 1]
                length = ex * ex + ey * ey
                share = 0.0 if length < 1e-12 else min(max(-(dx * ex + dy * ey) / length, 0.0), 1.0)
                x, y = dx + share * ex, dy + share * ey
                if x * x + y * y < best:
                    best = x * x + y * y
                    out[t, 0], out[t, 1] = wanted[t, 0] + x, wanted[t, 1] + y
    return out
