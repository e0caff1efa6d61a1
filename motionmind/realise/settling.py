"""Settling: limbs that passed through each other are kept apart, the weight is shifted over what bears it, and what has
risen or sunk by that is put back on the floor.

It is done to a movement whose feet have their places, and again where its clock has slowed: its frames fall elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import lowest_height
from motionmind.body.legs import find_legs
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import size_of, standing_rises
from motionmind.footing.carrying import TIPTOE
from motionmind.footing.corrections import Correction
from motionmind.footing.flight import fall_freely
from motionmind.footing.ground import SINKS
from motionmind.footing.knees import cover, smoothed
from motionmind.footing.leaning import shift_weight
from motionmind.learned.carriage import Carriage
from motionmind.realise.limbs_apart import keep_limbs_apart
from motionmind.realise.timeline import Timeline

RISES = 0.01  # metres that a limb which stands may rise
SEEN = 0.018  # metres from which it is seen to
FOLLOWS = 0.1  # seconds over which a body follows a leg that is turned aside under it


def keeper(
    clock: Timeline,
    stops: Sequence[int],
    fixed: Bools,
    wished: Bools,
    carriage: Carriage,
    skeleton: Skeleton,
    without: Collection[Correction],
) -> Callable[[Floats, Floats | None], Floats]:
    """Return what keeps limbs apart in rotations [N, J, 4] of a body whose root is at some places [N, 3], if known.

    As for planted feet, legs may leave their states if something is asked of them; other limbs may not.
    """
    if "limbs" in without:
        return lambda rotations, root: rotations
    legs = [joint for leg, _ in find_legs(skeleton)[1] for joint in leg]
    stays = wished[: len(skeleton)].copy()
    stays[legs] = fixed[legs]
    given = (len(clock.frames) - 1) * clock.moves[[*stops]] / clock.moves[-1]
    return lambda rotations, root: keep_limbs_apart(
        skeleton, rotations, root, clock.frames, given, stays, carriage.touches
    )


def settled(
    motion: Motion,
    clock: Timeline,
    fps: float,
    stops: Sequence[int],
    moving: tuple[bool, bool],
    fixed: Bools,
    wished: Bools,
    carriage: Carriage,
    overhang: float,
    floors: tuple[float, float],
    fastest: Floats | None,
    without: Collection[Correction],
) -> Motion:
    """Return a movement whose feet have their places, with its limbs apart and its weight over what bears it.

    Args:
        motion: the movement, at the clock's frames.
        clock: its clock.
        fps: frames a second, about.
        stops: moves at which it passes given postures, the first and the last among them.
        moving: whether it passes the first and the last with a given velocity.
        fixed: chains that do not move for the feet's sake [L].
        wished: chains of which something is asked [L].
        carriage: how the corpus's bodies hold themselves.
        overhang: how far beyond its support the centre of mass may be, metres.
        floors: heights of the floor under the first and the last posture, metres.
        fastest: speeds of the joints [J], rad/s; None for any speed.
        without: corrections to leave out.
    """
    skeleton, root = motion.skeleton, motion.root
    given = _given_frames(clock, stops, moving)
    rotations = keeper(clock, stops, fixed, wished, carriage, skeleton, without)(motion.rotations, root)
    if rotations is not motion.rotations:
        root = _with_its_legs(motion, rotations, given, fps)
    if "balance" not in without:
        joints = fixed[: len(skeleton)]
        rotations, root = shift_weight(skeleton, rotations, root, overhang, given, carriage.loose, joints, fps, fastest)
    floor = np.linspace(*floors, len(root))
    root = _lowered(skeleton, rotations, root, floor, given, fps)
    root = _lifted(skeleton, rotations, root, floor, given, fps)
    if "flight" not in without:
        root = fall_freely(skeleton, rotations, root, given, fps)
    return replace(motion, rotations=rotations, root=root)


def _with_its_legs(motion: Motion, rotations: Floats, given: Bools, fps: float) -> Floats:
    """Return positions of the root [N, 3], metres, that sinks or rises with a leg that was turned aside under it.

    Args:
        motion: the movement before that.
        rotations: local rotations after it [N, J, 4].
        given: frames that must not change [N].
        fps: frames a second.
    """
    skeleton, root = motion.skeleton, motion.root
    lifted = lowest_height(skeleton, rotations, root) - lowest_height(skeleton, motion.rotations, root)
    frames = np.arange(len(root))
    since = np.abs(frames[:, None] - np.flatnonzero(given)).min(axis=1) / fps
    out = root.copy()
    out[:, 1] -= smoothed(lifted, FOLLOWS, fps) * np.minimum(since / FOLLOWS, 1.0)
    return out


def _lowered(skeleton: Skeleton, rotations: Floats, root: Floats, floor: Floats, given: Bools, fps: float) -> Floats:
    """Return positions of the root [N, 3], metres, with which limbs that stand alone between given postures stay down.

    Joints that meet their limits, and limbs that are kept apart, may have raised them.

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        root: positions of the root before [N, 3], metres.
        floor: height of the floor [N], metres.
        given: frames that must not change [N].
        fps: frames a second.
    """
    out, low = root.copy(), lowest_height(skeleton, rotations, root)
    for part, _ in _standing(skeleton, rotations, root, low - floor, given):
        here = low[part]
        rises = np.maximum(here - np.linspace(here[0], here[-1], len(here)), 0.0)
        lowered = smoothed(rises, FOLLOWS, fps)
        lowered += cover(np.maximum(rises - lowered - RISES, 0.0), fps)
        out[part, 1] -= np.where(given[part], 0.0, lowered)
    return out


def _lifted(skeleton: Skeleton, rotations: Floats, root: Floats, floor: Floats, given: Bools, fps: float) -> Floats:
    """Return positions of the root [N, 3], metres, with which nothing is in the floor.

    But a limb that stands alone is not seen to rise with it, at the price of RISES at most that another foot is in the
    floor: that shows less.

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        root: positions of the root before [N, 3], metres.
        floor: its height [N], metres.
        given: frames that must not change [N].
        fps: frames a second.
    """
    low = lowest_height(skeleton, rotations, root) - floor
    sunk = np.where(given, 0.0, np.maximum(-low - SINKS, 0.0))
    if not sunk.any():
        return root
    out, lifted = root.copy(), cover(sunk, fps)
    for part, rises in _standing(skeleton, rotations, root, low, given):
        if rises.max() < SEEN:
            lifted[part] = np.clip(SEEN - rises, lifted[part] - RISES, lifted[part])
    out[:, 1] += np.where(given, 0.0, lifted)
    return out


def _standing(
    skeleton: Skeleton, rotations: Floats, root: Floats, low: Floats, given: Bools
) -> Iterator[tuple[slice, Floats]]:
    """Yield the frames from one given posture to the next in which one limb stands alone, and how far it rises there,
    as `standing_rises` has it.

    Args:
        skeleton: the body.
        rotations: local rotations [N, J, 4].
        root: positions of the root [N, 3], metres.
        low: heights of the lowest points above the floor [N], metres.
        given: frames of given postures [N].
    """
    stops = np.flatnonzero(given)
    stands = low[stops] < TIPTOE * size_of(skeleton)
    for (start, end), stand in zip(pairwise(stops), stands[:-1] & stands[1:], strict=True):
        part = slice(start, end + 1)
        if stand and (rises := standing_rises(skeleton, rotations[part], root[part])) is not None:
            yield part, rises


def _given_frames(clock: Timeline, stops: Sequence[int], moving: tuple[bool, bool]) -> Bools:
    """Return the frames that must not change [N]: those of given postures or beside them, and of given velocities."""
    at = (len(clock.frames) - 1) * clock.moves[[*stops]] / clock.moves[-1]
    out = np.zeros(len(clock.frames), dtype=np.bool_)
    out[np.floor(at + 1e-6).astype(np.int64)] = True
    out[np.ceil(at - 1e-6).astype(np.int64)] = True
    out[[1, -2]] |= moving
    return out
