"""Find frames at which a joint of a recording jumps, and repair them.

Motion capture fits a skeleton to markers frame by frame. If several orientations fit almost equally well, the fit may
jump to another one and, some frames later, back. The knee of a raised leg swings to the other side of the line from hip
to ankle, or a hand or foot turns over. Such a *flip* is repaired in one of two ways:

- It is *put back* exactly if it is a half turn about the line from the joint to its child or grandchild, unless the
  joint is the root. Such a turn does not move the child or grandchild, and a second half turn about the same line
  undoes it.
- Otherwise the joint is *reconstructed*: interpolated over the frames between flips that follow each other closely.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.clip import FLIP_DEG, JointFlip, JointRepair, Repair
from motionmind.geometry import rotations as rot


class _Jump(NamedTuple):
    """A flip with the quick turns around it: the frame before them, and the frame after them."""

    before: int
    after: int


def find_flips(motion: Motion, degrees: float = FLIP_DEG) -> tuple[JointFlip, ...]:
    """Find joints that turn by more than `degrees` between consecutive frames, and faster than 3,000 degrees a second.

    The second condition spares keyframes and slow cameras, whose frames are far apart, and quick throws and kicks.

    Args:
        motion: the recording.
        degrees: the largest credible turn between two frames.

    Returns:
        The flips in order of time, each with the first frame after it.
    """
    turned = _turned(motion)
    return tuple(
        JointFlip(motion.name, motion.skeleton.names[joint], int(frame) + 1, float(turned[frame, joint]))
        for frame, joint in np.argwhere(_is_quick(motion, turned, degrees, 1.0))
    )


class Mended(NamedTuple):
    """A recording that was mended.

    Attributes:
        motion: the recording as it is now.
        flips: the flips that it had, each with its repair.
        repairs: the frames that were changed.
    """

    motion: Motion
    flips: tuple[JointFlip, ...]
    repairs: tuple[JointRepair, ...]


def repair_flips(motion: Motion, degrees: float = FLIP_DEG) -> Mended:
    """Repair the flips of a recording, as this module's docstring describes.

    Flips remain if a joint jumps back and forth for more than a second.

    Args:
        motion: the recording.
        degrees: the turn between two frames that counts as a flip, as for `find_flips`.
    """
    flips = find_flips(motion, degrees)
    rotations = motion.rotations.copy()
    repairs: list[JointRepair] = []
    for joint, jumps in _jumps(motion, degrees):
        rotations[:, joint], found = _put_back(motion, joint, jumps, 0.5 * degrees)
        repairs += found
    motion = replace(motion, rotations=rotations)
    rotations = rotations.copy()
    for joint, fault in _faults(motion, degrees):
        rotations[:, joint], found = _reconstruct(motion, rotations[:, joint], joint, fault)
        repairs += found
    told = tuple(replace(flip, repair=_what_became_of(flip, repairs)) for flip in flips)
    return Mended(replace(motion, rotations=rotations), told, tuple(repairs))


def _what_became_of(flip: JointFlip, repairs: list[JointRepair]) -> Repair:
    """Return a flip's repair: the last repair that changes a frame beside it.

    A flip that takes several frames counts as put back, although these frames are interpolated.
    """
    own = [one for one in repairs if one.joint == flip.joint]
    mended = [one for one in own if one.start <= flip.frame <= one.stop]
    if not mended:
        return "none"
    last = mended[-1]
    exact = last.exact or any(one.exact and (one.start == last.stop or one.stop == last.start) for one in own)
    return "put back" if exact else "reconstructed"


def _turned(motion: Motion) -> Floats:
    """Return the joints' turns from each frame to the next [T - 1, J], degrees."""
    return np.asarray(np.degrees(rot.angle(motion.rotations[:-1], motion.rotations[1:])))


def _is_quick(motion: Motion, turned: Floats, degrees: float, share: float) -> Bools:
    """Return which turns [T - 1, J] exceed a share of a flip's angle and speed."""
    speed = turned / np.diff(motion.times)[:, None]
    return np.asarray((turned > share * degrees) & (speed > share * 3000.0))


def _jumps(motion: Motion, degrees: float) -> Iterator[tuple[int, list[_Jump]]]:
    """Yield each joint that flips, with its jumps in order of time; flips without a pause between them are one jump."""
    turned = _turned(motion)
    flips, quick = (_is_quick(motion, turned, degrees, share) for share in (1.0, 0.25))  # 0.25: around a flip
    for joint in np.flatnonzero(flips.any(axis=0)):
        edges = np.diff(np.concatenate([[0], quick[:, joint], [0]]).astype(int))
        runs = zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True)
        yield int(joint), [_Jump(int(a), int(b)) for a, b in runs if flips[a:b, joint].any()]


# --- putting back -----------------------------------------------------------------------------------------------------


def _put_back(motion: Motion, joint: int, jumps: list[_Jump], tolerance: float) -> tuple[Floats, list[JointRepair]]:
    """Undo half turns of a joint between its jumps, and interpolate over each jump that this removes.

    Choose the stretches to turn so that the fewest jumps are left, then so that the fewest stretches are turned. Turn a
    stretch only if that brings the joint nearer to its rest orientation: a jump shows that one side of it is wrong, but
    not which.

    Args:
        motion: the recording.
        joint: the joint.
        jumps: its jumps.
        tolerance: degrees that may be left of a jump.

    Returns:
        The joint's rotations [T, 4], and the repairs.
    """
    own = motion.rotations[:, joint]
    choices = np.stack([own, *(rot.mul(own, half) for half in _half_turns(motion, joint))])  # [K, T, 4]
    stretches = [*pairwise([0, *(frame for jump in jumps for frame in (jump.before + 1, jump.after)), len(motion)])][
        ::2
    ]
    from_rest = np.array([rot.angle(choices[:, a:b], rot.IDENTITY).mean(axis=1) for a, b in stretches])  # [S, K]
    prices = np.where(from_rest < from_rest[:, :1], 1e-3, np.inf)
    prices[:, 0] = 0.0
    left = [_angles(choices[:, jump.before], choices[:, jump.after]) > tolerance for jump in jumps]  # [K, K] each
    chosen = _cheapest_path(prices, left)

    out, repairs = own.copy(), []
    for (start, stop), choice in zip(stretches, chosen, strict=True):
        if choice:
            out[start:stop] = choices[choice, start:stop]
            repairs.append(_repair(motion, joint, start, stop, exact=True))
    for jump, (k, after), is_left in zip(jumps, pairwise(chosen), left, strict=True):
        if not is_left[k, after] and jump.after > jump.before + 1:
            _interpolate(motion.times, out, jump)
            repairs.append(_repair(motion, joint, jump.before + 1, jump.after, exact=False))
    return out, repairs


def _half_turns(motion: Motion, joint: int) -> Iterator[Floats]:
    """Yield the half turns of a joint [T, 4], in its own frame, that do not move its child, then its grandchild.

    At the end of a limb the tip counts as the child. The root has none: a body may face anywhere, so its rest
    orientation does not show which side of a jump is wrong.
    """
    skeleton = motion.skeleton
    if joint == 0:
        return
    place, turned, at = np.zeros(3), np.broadcast_to(rot.IDENTITY, (len(motion), 4)), joint
    for _ in range(2):
        child = next(iter(skeleton.children(at)), None)
        place = place + rot.mul_vec(turned, skeleton.tips[at] if child is None else skeleton.offsets[child])
        length = np.linalg.norm(place, axis=-1, keepdims=True)
        if np.min(length) > 0.0:
            yield np.concatenate([place / length, np.zeros((len(motion), 1))], axis=-1)
        if child is None:
            return
        turned, at = rot.mul(turned, motion.rotations[:, child]), child


def _repair(motion: Motion, joint: int, start: int, stop: int, *, exact: bool) -> JointRepair:
    """Return the record of a repair of the frames from `start` to before `stop`."""
    seconds = (float(motion.times[start]), float(motion.times[stop - 1]))
    return JointRepair(motion.skeleton.names[joint], start, stop, seconds, exact)


def _angles(a: Floats, b: Floats) -> Floats:
    """Return the angles [K, K], degrees, between all pairs of rotations `a` and `b` [K, 4]."""
    return np.asarray(np.degrees(rot.angle(a[:, None], b[None, :])))


def _cheapest_path(prices: Floats, left: list[Bools]) -> list[int]:
    """Choose one of K turns for each of S stretches, with the least sum of prices [S, K] and of jumps left [K, K]."""
    cost, came_from = prices[0], []
    for price, step in zip(prices[1:], left, strict=True):
        through = cost[:, None] + step
        came_from.append(through.argmin(axis=0))
        cost = through.min(axis=0) + price
    path = [int(cost.argmin())]
    for best in reversed(came_from):
        path.append(int(best[path[-1]]))
    return path[::-1]


# --- reconstructing ---------------------------------------------------------------------------------------------------


def _faults(motion: Motion, degrees: float) -> Iterator[tuple[int, _Jump]]:
    """Yield joints with the stretches in which they jump, by joint and time; jumps close in time are merged.

    A joint that turns by more than half of `degrees` in a frame in which its parent or child flips compensates for that
    flip, so it is faulty there, too.
    """
    turned = _turned(motion)
    flips = _is_quick(motion, turned, degrees, 1.0)
    found: dict[int, list[_Jump]] = {}
    for joint, jumps in _jumps(motion, degrees):
        for jump in jumps:
            frames = jump.before + np.flatnonzero(flips[jump.before : jump.after, joint])
            for other in [joint, *_neighbours(motion.skeleton, joint)]:
                if np.max(turned[frames, other]) > 0.5 * degrees:
                    found.setdefault(other, []).append(jump)
    for joint in sorted(found):
        fault, *others = sorted(found[joint])
        for jump in others:
            # Seconds. CMU's subject 05: flips of one fault are at most 0.18 s apart, different faults at least 0.4 s.
            if motion.times[jump.before] - motion.times[fault.after] > 0.3:
                yield joint, fault
                fault = jump
            fault = _Jump(fault.before, max(fault.after, jump.after))
        yield joint, fault


def _neighbours(skeleton: Skeleton, joint: int) -> list[int]:
    """Return a joint's parent, if it has one, and its children."""
    return [*skeleton.children(joint), *(parent for parent in [skeleton.parents[joint]] if parent >= 0)]


def _reconstruct(motion: Motion, own: Floats, joint: int, fault: _Jump) -> tuple[Floats, list[JointRepair]]:
    """Interpolate a joint's rotations `own` [T, 4] over a fault, widened until the joint turns at a credible speed.

    At an end of the recording, with nothing beyond the fault, hold the joint still.
    """
    times, before, after = motion.times, fault.before, fault.after
    while _seconds_between(own, before, after) > times[after] - times[before] and before > 0 and after < len(own) - 1:
        before, after = before - 1, after + 1
    if times[after] - times[before] > 1.0:  # too long to interpolate
        return own, []
    if _seconds_between(own, before, after) <= times[after] - times[before]:
        _interpolate(times, own, _Jump(before, after))
        start, stop = before + 1, after
    elif before == 0:
        own[:after] = own[after]
        start, stop = 0, after
    else:
        own[before + 1 :] = own[before]
        start, stop = before + 1, len(own)
    return own, [_repair(motion, joint, start, stop, exact=False)] if start < stop else []


def _seconds_between(own: Floats, before: int, after: int) -> float:
    """Return the seconds that a joint needs, at a credible speed, from one of its rotations [T, 4] to another."""
    return float(np.degrees(rot.angle(own[before], own[after]))) / 720.0  # degrees a second


def _interpolate(times: Floats, own: Floats, gap: _Jump) -> None:
    """Interpolate rotations `own` [T, 4] in place, from the frame before a gap to the frame after it."""
    inner = slice(gap.before + 1, gap.after)
    share = (times[inner] - times[gap.before]) / (times[gap.after] - times[gap.before])
    own[inner] = rot.normalise(rot.slerp(own[gap.before], own[gap.after], share))
