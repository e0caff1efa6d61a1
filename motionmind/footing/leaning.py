"""Leaning: a body whose limbs are in their places shifts its weight over what bears it, and its feet stay.

The root is carried in balance before limbs are kept apart and legs reach for their places, and both move the mass and
the feet that it is to be over. What they leave is made up for here, where one limb bears alone and the body is hardly
accelerated: the hips move level, as little and as smoothly as will do, and the legs keep the feet where they are. A
body that is accelerated may fall from foot to foot.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import pose
from motionmind.body.legs import find_legs
from motionmind.body.limbs import limb_of_points
from motionmind.body.limits import within_limits
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import find_bearers, mass_of, size_of
from motionmind.footing.balance import GRAVITY, balance_rows, is_beyond
from motionmind.footing.feet import QUICK, Foot, bend_legs, find_free_feet
from motionmind.footing.least_squares import Rows, difference_rows, joined, position_rows, solve
from motionmind.footing.legs import SOFT
from motionmind.geometry import rotations as rot

PUSH = 2.0  # metres a second squared by which the hips are accelerated beside the movement
SHIFTS = 0.2  # metres that they shift
STILL = 0.5  # metres a second squared: level acceleration up to which they do; chosen on ballet and cmu-135
LESS = 1.0, 0.7, 0.4  # shares of that shift: the first for which no leg has to hurry
HURRIES = 1.1  # times as fast as before that a joint may then turn; chosen on ballet and karate
ROUNDS = 4  # of finding the support's nearest points, and the shift
TIMES = 3  # that weight is shifted: a body that moved where it leaned may lean where it now moves no more


def shift_weight(
    skeleton: Skeleton,
    rotations: Floats,
    root: Floats,
    overhang: float,
    given: Bools,
    loose: Bools,
    fixed: Bools,
    fps: float,
    fastest: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Return rotations [N, J, 4] and positions of the root [N, 3], metres, that have the weight over what bears it.

    Nothing changes where the weight is over it, where it is not known, and where a leg must not change. Only what one
    limb bears, and nothing accelerates, is to be over it.

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        root: positions of the root [N, 3], metres.
        overhang: how far beyond its support the centre of mass may be, metres.
        given: frames that must not change, the first and the last among them [N].
        loose: joints without limits [J].
        fixed: joints that must not change [J].
        fps: frames a second.
        fastest: speeds of the joints [J], rad/s, for which the weight is shifted less; None for any speed.
    """
    feet = find_free_feet(skeleton, fixed)
    if len(root) < 3 or not feet or len(feet) < len(find_legs(skeleton)[0]):
        return rotations, root
    most = None
    if fastest is not None:
        most = np.maximum(QUICK * fastest, HURRIES * _fastest_turns(rotations, fps))
    for _ in range(TIMES):
        before = root
        rotations, root = _shift_once(skeleton, rotations, root, feet, overhang, given, loose, fps, most)
        if root is before:
            break
    return rotations, root


def _shift_once(
    skeleton: Skeleton,
    rotations: Floats,
    root: Floats,
    feet: list[Foot],
    overhang: float,
    given: Bools,
    loose: Bools,
    fps: float,
    most: Floats | None,
) -> tuple[Floats, Floats]:
    """Return what `shift_weight` does where the body leans now; the same arrays where nothing is to change.

    Joints turn at most so fast [J], rad/s; None for any speed.
    """
    size, placed = size_of(skeleton), pose(skeleton, rotations, root)
    places, centre = placed.places, mass_of(skeleton, placed)
    if centre is None:
        return rotations, root
    bears, _, touches = find_bearers(places, limb_of_points(skeleton)[placed.joints], size, fps)
    points, mass, allowed = places[..., [0, 2]] / size, centre[:, [0, 2]] / size, overhang / size
    calm = bears.sum(axis=1) == 1
    calm[1:-1] &= np.linalg.norm(np.diff(mass, 2, axis=0), axis=1) * fps**2 < STILL
    if not (is_beyond(points, touches, mass, allowed) & calm & ~given).any():
        return rotations, root
    height = (centre[:, 1] - placed.lowest) / size
    shift, every = np.zeros_like(root), np.tile(calm[1:-1], 4)
    for _ in range(ROUNDS):
        now = mass + shift[:, [0, 2]]
        rows = balance_rows(points, touches, now, mass, height, allowed, GRAVITY / size, fps)
        shift = solve([rows._replace(weights=rows.weights * every), _small_shift(len(root), fps)], shift, given)
    shift[given] = 0.0
    legs, posed = [joint for foot in feet for joint in foot.leg], pose(skeleton, rotations)
    for share in LESS:
        off = -share * size * np.repeat(shift[:, None], len(feet), axis=1)
        bent = bend_legs(skeleton, posed, feet, off, np.full(off.shape[:2], SOFT))
        out = rotations.copy()
        limited = within_limits(skeleton, bent, rotations[given], loose, legs)
        out[:, legs] = np.where(given[:, None, None], rotations[:, legs], limited[:, legs])
        if most is None or np.all(_fastest_turns(out[:, legs], fps) <= most[legs]):
            return out, root + share * size * shift
    return rotations, root


@lru_cache(maxsize=64)
def _small_shift(count: int, fps: float) -> Rows:
    """Return rows that keep a shift small in so many frames, and smooth."""
    rows, none = [], np.zeros(count)
    for axis in range(3):
        rows.append(position_rows(np.arange(count), np.eye(3)[axis], none, none + SHIFTS**-2.0))
        bends = (fps**2, -2.0 * fps**2, fps**2)
        rows.append(difference_rows(axis, bends, none[1:-1], none[1:-1] + PUSH**-2.0))
    return joined(rows)


def _fastest_turns(rotations: Floats, fps: float) -> Floats:
    """Return the greatest speed of each joint [J], rad/s, of rotations [N, J, 4]."""
    return np.asarray(fps * rot.angle(rotations[:-1], rotations[1:]).max(axis=0))
