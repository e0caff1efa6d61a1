"""Find the cycle of a movement: the stretch that repeats best, closed so that it plays without a seam.

The last frame of a cycle is its first, one round later: `Cycle.ground` moves the one onto the other. What is left
between them is spread over the round: of joints and the root smoothly, and of each foot while it swings, so that feet
stand as still as before. Speeds that differ at the seam are blended within 0.2 s of it, in the manner of Bollo,
"Inertialization: High-performance animation transitions in Gears of War", GDC (2018). A tween of 0.4 s in place of the
end accelerated joints 1.7 times as much at the seam (median of twelve walks, runs and dances).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import floor_height, pose
from motionmind.body.motion import Motion
from motionmind.body.support import SUPPORT_HEIGHT_M, SUPPORT_SPEED_MPS, size_of
from motionmind.errors import MotionMindError
from motionmind.footing.feet import Foot, find_free_feet, foot_points
from motionmind.geometry import rotations as rot

_STRAIGHT_RAD = np.radians(5.0)  # a walk that turns less in a round goes straight on
_VELOCITY_S = 0.2  # a velocity counts as the way in so many seconds; within as many of the seam speeds are blended
_N_COARSE = 40_000  # frames of the first search: twenty minutes
_SAME_RATIO = 1e-3  # squares of gaps that are smaller, relative to the movement, are the same
_LEAST_MOVEMENT_M = 0.1  # mean displacement of the joints within a cycle: less is standing still


class Ground(NamedTuple):
    """A displacement along the floor: a turn about the vertical, radians, then a translation [3], metres."""

    turn: float
    travel: Floats

    def at(self, share: Floats | float) -> tuple[Floats, Floats]:
        """Return the turn [..., 4] and the translation [..., 3] of a share [...] of the displacement.

        Shares add up: the way is a line, or a circle.
        """
        share = np.asarray(share, dtype=np.float64)
        turned = rot.about_vertical(share * self.turn)
        if self.turn == 0.0:
            return turned, share[..., None] * self.travel
        x, _, z = self.travel
        reach = 0.5 / np.tan(0.5 * self.turn)
        centre = np.array([0.5 * x + reach * z, 0.0, 0.5 * z - reach * x])
        return turned, centre - rot.mul_vec(turned, centre)

    def moved(self, motion: Motion, share: Floats | float) -> Motion:
        """Return a motion displaced by a share, or by a share in each frame [T]."""
        turned, travel = self.at(np.broadcast_to(share, len(motion)))
        rotations = motion.rotations.copy()
        rotations[:, 0] = rot.mul(turned, rotations[:, 0])
        return replace(motion, rotations=rotations, root=rot.mul_vec(turned, motion.root) + travel)


@dataclass(frozen=True)
class Cycle:
    """A movement that repeats without a seam.

    Attributes:
        motion: one round; its last frame is its first one displaced by `ground`.
        ground: displacement in a round.
        frames: its first and last frame in the recording.
        gap: angle of each joint between these before it was closed [J], radians.
        root_gap: distance of the root, besides `ground`, metres.
        speed_gap: difference of each joint's velocity [J], radians a second.
        moved: largest angle by which each joint was turned to close the cycle [J], radians.
    """

    motion: Motion
    ground: Ground
    frames: tuple[int, int]
    gap: Floats
    root_gap: float
    speed_gap: Floats
    moved: Floats

    def in_place(self) -> Motion:
        """Return the round without its displacement, which is taken out evenly."""
        return self.ground.moved(self.motion, -np.linspace(0.0, 1.0, len(self.motion)))


def close_cycle(motion: Motion, shortest: float = 0.5, longest: float = 8.0) -> Cycle:
    """Find the stretch of a movement that repeats best, and close it.

    Args:
        motion: the movement, with even frames.
        shortest: least length, seconds.
        longest: greatest length, seconds.

    Raises:
        MotionMindError: the movement is shorter than `shortest`, or nothing in it moves.
    """
    first, last = find_cycle(motion, shortest, longest)
    return close_between(motion, first, last)


# --- finding ----------------------------------------------------------------------------------------------------------


def find_cycle(motion: Motion, shortest: float, longest: float) -> tuple[int, int]:
    """Return the first and the last frame of the stretch that repeats best.

    Its ends have the nearest postures and velocities, relative to how far it goes from them; of stretches that are as
    good the shortest counts, and of these the first.
    """
    least = max(round(shortest * motion.fps), 4)
    most = min(round(longest * motion.fps), len(motion) - 1)
    if least > most:
        seconds = (len(motion) - 1) / motion.fps if motion.fps else 0.0
        raise MotionMindError(
            f"{motion.name or 'movement'}: lasts {seconds:.2g} s, too short for a cycle of {shortest:g} s"
        )
    features = _features(motion)
    step = max(-(-len(motion) // _N_COARSE), round(motion.fps / 30.0), 1)
    coarse = _best(features[::step], range(-(-least // step), most // step + 1), None)
    if coarse is None:
        raise MotionMindError(f"{motion.name or 'movement'}: nothing moves far enough to repeat")
    first, length = coarse.first * step, coarse.length * step
    begin, fine = max(first - step, 0), list[_Stretch]()
    near = features[begin : first + length + 2 * step + 1]
    for rounds in (3, 2, 1):  # the steps of the first search may fit several rounds only
        lengths = range(max(length // rounds - step, least), min(length // rounds + step, most) + 1)
        found = _best(near, lengths, 2 * step + 1)
        fine += [found] if found else []
    best = _shortest(fine) or _Stretch(0.0, first - begin, length)
    return begin + best.first, begin + best.first + best.length


def _features(motion: Motion) -> Floats:
    """Return what is compared of each frame [T, F], metres: places, and ways in 0.2 s, of the joints as the root faces.

    Mean squares of differences are those of the distances of joints.
    """
    places = motion.positions()
    turned = rot.mul_inv(motion.rotations[:, 0], motion.rotations[:1, 0])  # a root may rest in any orientation
    ahead = rot.about_vertical(-rot.heading(turned))[:, None]
    ways = np.gradient(places, axis=0) * motion.fps * _VELOCITY_S
    here = places - motion.root[:, None] * [1.0, 0.0, 1.0]
    both = np.concatenate([rot.mul_vec(ahead, here), rot.mul_vec(ahead, ways)], axis=1)
    return np.asarray(both.reshape(len(motion), -1) / np.sqrt(len(motion.skeleton)))


class _Stretch(NamedTuple):
    """A stretch of frames, and the squared distance of its ends, relative to how far it goes from the first."""

    ratio: float
    first: int
    length: int


def _best(features: Floats, lengths: range, starts: int | None) -> _Stretch | None:
    """Return the stretch that repeats best; None if nothing moves.

    Args:
        features: of each frame [T, F].
        lengths: the lengths to try, frames.
        starts: number of first frames to try; None for all.
    """
    count = len(features)
    far = np.zeros(count)  # the greatest distance so far from each first frame
    found = []
    for length in range(1, min(lengths.stop, count)):
        apart = np.sum((features[length:] - features[:-length]) ** 2, axis=1)[:starts]
        if length in lengths:
            some = far[: len(apart)]
            ratio = np.where(some > _LEAST_MOVEMENT_M**2, apart / np.maximum(some, 1e-12), np.inf)
            first = int(np.argmin(ratio))
            found.append(_Stretch(float(ratio[first]), first, length))
        far[: len(apart)] = np.maximum(far[: len(apart)], apart)
    return _shortest(found)


def _shortest(stretches: list[_Stretch]) -> _Stretch | None:
    """Return the shortest of the stretches that repeat best; None if none moves."""
    least = min((one.ratio for one in stretches), default=np.inf)
    good = [one for one in stretches if one.ratio <= 1.2 * least + _SAME_RATIO]
    if not np.isfinite(least):
        return None
    shortest = min(one.length for one in good)
    return min(one for one in good if one.length <= 1.1 * shortest)


# --- closing ----------------------------------------------------------------------------------------------------------


class _Seam(NamedTuple):
    """The course of a round.

    Attributes:
        share: of the round's gap that is behind each frame [T], 0 to 1, level at both ends.
        blend: seconds of the velocity gap by which each frame is displaced [T].
        inner: 0 at both ends, 1 beyond 0.2 s of them [T].
    """

    share: Floats
    blend: Floats
    inner: Floats

    def offsets(self, gap: Floats, velocity: Floats) -> Floats:
        """Return the offsets [T, ...] that close a gap [...] and one of velocities [...], half at each end."""
        shape = (-1,) + (1,) * np.ndim(gap)
        return np.asarray((self.share - 0.5).reshape(shape) * gap + self.blend.reshape(shape) * velocity)


def close_between(motion: Motion, first: int, last: int) -> Cycle:
    """Close the stretch from one frame to another."""
    part = motion.slice(first, last + 1)
    begin = part.times[0]
    insertions = tuple(replace(one, times=one.times - begin) for one in part.insertions)
    part = replace(part, times=part.times - begin, insertions=insertions)
    fps, count = motion.fps, len(part)
    seconds = np.arange(count) / fps
    within = min(_VELOCITY_S, seconds[-1] / 3.0)
    after, before = np.minimum(seconds / within, 1.0), np.minimum(seconds[::-1] / within, 1.0)
    u = seconds / seconds[-1]
    seam = _Seam(
        _smooth(u),
        -0.5 * within * (after * (1.0 - after) ** 2 + before * (1.0 - before) ** 2),
        _smooth(after) * _smooth(before),
    )
    body = part.skeleton
    posed = pose(body, part.rotations, part.root)
    floor = floor_height(posed.lowest)
    feet = [foot for foot in find_free_feet(body, np.zeros(len(body), dtype=bool)) if foot.joints and foot.knee > 0]
    stands = [
        _stands(posed.places[:, foot_points(foot, posed.joints, len(body))], floor, fps, size_of(body)) for foot in feet
    ]
    ground = _ground(part, feet, stands, posed.places)
    onto, travel = ground.at(1.0)

    start = part.rotations[0].copy()
    start[0] = rot.mul(onto, start[0])
    gap = rot.log(rot.inv_mul(part.rotations[-1], start))
    speeds = _rates(motion, first) - _rates(motion, last)
    rotations = rot.mul(part.rotations, rot.exp(seam.offsets(gap, speeds)))
    root_gap = rot.mul_vec(onto, part.root[0]) + travel - part.root[-1]
    ends = [_velocities(motion, frame) for frame in (first, last)]
    drift = rot.mul_vec(onto, ends[0]) - ends[1]  # of each joint
    spins = _rates(motion, first, in_world=True) - _rates(motion, last, in_world=True)
    root = part.root + _along(ground, u, seam.share, seam.blend, root_gap, drift[0])
    closed = replace(part, rotations=rotations, root=root)
    for foot, standing in zip(feet, stands, strict=True):
        ankle = foot.joints[0]
        closed = _place_foot(closed, part, foot, standing, ground, seam, (drift[ankle], spins[ankle]))
    moved = rot.angle(part.rotations, closed.rotations).max(axis=0)
    rest = float(np.linalg.norm(root_gap))
    return Cycle(closed, ground, (first, last), rot.norm(gap), rest, rot.norm(speeds), moved)


def _smooth(share: Floats) -> Floats:
    """Return a share that is level at 0 and 1."""
    return share * share * (3.0 - 2.0 * share)


def _stands(places: Floats, floor: float, fps: float, size: float) -> Bools:
    """Return whether a foot stands [T], given the places of its points [T, P, 3]."""
    low = places[..., 1] < floor + SUPPORT_HEIGHT_M * size
    slow = rot.norm(np.gradient(places, axis=0)) * fps < SUPPORT_SPEED_MPS * size
    return np.asarray((low & slow).any(axis=1))


def _ground(part: Motion, feet: list[Foot], stands: list[Bools], places: Floats) -> Ground:
    """Return the displacement of a round: by feet that stand at both of its ends, or else by the root."""
    turn = float(rot.heading(rot.mul_inv(part.rotations[-1, 0], part.rotations[0, 0])))
    turn = 0.0 if abs(turn) < _STRAIGHT_RAD else turn
    standing = [foot.joints[0] for foot, one in zip(feet, stands, strict=True) if one[0] and one[-1]]
    a, b = places[0, standing or [0]].mean(axis=0), places[-1, standing or [0]].mean(axis=0)
    return Ground(turn, (b - rot.mul_vec(rot.about_vertical(turn), a)) * [1.0, 0.0, 1.0])


def _along(ground: Ground, u: Floats, share: Floats, blend: Floats, gap: Floats, velocity: Floats) -> Floats:
    """Return offsets in the world [T, 3] that close a gap [3] at the end of a round, and turn with it."""
    turned = rot.about_vertical((u - 1.0) * ground.turn)
    return rot.mul_vec(turned, (share - 0.5)[:, None] * gap + blend[:, None] * velocity)


def _around(motion: Motion, frame: int) -> tuple[int, int, float]:
    """Return the frames between which velocities at a frame are measured, and the seconds between them."""
    span = max(round(motion.fps / 60.0), 1)  # single frames of a fast camera are noisy
    begin, end = max(frame - span, 0), min(frame + span, len(motion) - 1)
    return begin, end, (end - begin) / motion.fps


def _rates(motion: Motion, frame: int, *, in_world: bool = False) -> Floats:
    """Return each joint's angular velocity in its frame [J, 3], radians a second, against its parent or the world."""
    begin, end, seconds = _around(motion, frame)
    ends = motion.rotations[[begin, end]]
    a, b = motion.skeleton.global_rotations(ends) if in_world else ends
    return np.asarray(rot.log(rot.inv_mul(a, b)) / seconds)


def _velocities(motion: Motion, frame: int) -> Floats:
    """Return the velocity of each joint [J, 3], metres a second."""
    begin, end, seconds = _around(motion, frame)
    ends = motion.skeleton.positions(motion.rotations[[begin, end]], motion.root[[begin, end]])
    return np.asarray((ends[1] - ends[0]) / seconds)


def _place_foot(
    closed: Motion,
    part: Motion,
    foot: Foot,
    stands: Bools,
    ground: Ground,
    seam: _Seam,
    speed_gap: tuple[Floats, Floats],
) -> Motion:
    """Place a foot where it was, displaced only while it swings, by turning the hip, the knee and the ankle."""
    body = part.skeleton
    hip, knee, ankle = foot.leg[foot.knee - 1], foot.leg[foot.knee], foot.joints[0]
    places, turned = part.positions()[:, ankle], body.global_rotations(part.rotations)[:, ankle]
    swing = np.where(stands, 0.0, rot.norm(np.gradient(places, axis=0))) * seam.inner
    share = np.cumsum(swing) / swing.sum() if swing.sum() > 0.0 else seam.share
    onto, travel = ground.at(1.0)
    gap = rot.mul_vec(onto, places[0]) + travel - places[-1]
    velocity, spin = speed_gap
    blend = np.zeros(len(places)) if stands[0] and stands[-1] else seam.blend
    target = places + _along(ground, share, share, blend, gap, velocity)
    twist = rot.log(rot.inv_mul(turned[-1], rot.mul(onto, turned[0])))
    facing = rot.mul(turned, rot.exp((share - 0.5)[:, None] * twist + blend[:, None] * spin))
    return bend_leg(closed, (hip, knee, ankle), foot.hinge, target, facing)


def bend_leg(motion: Motion, leg: tuple[int, int, int], hinge: Floats | None, target: Floats, facing: Floats) -> Motion:
    """Return a motion whose ankle is at `target` [T, 3] with orientation `facing` [T, 4], in closed form."""
    hip, knee, ankle = leg
    body, rotations = motion.skeleton, motion.rotations.copy()
    turned, places = body.global_rotations(rotations), motion.positions()
    thigh, shank = places[:, knee] - places[:, hip], places[:, ankle] - places[:, knee]
    long, short = rot.norm(thigh), rot.norm(shank)
    reach = np.clip(rot.norm(target - places[:, hip]), np.abs(long - short) + 1e-6, (long + short) * (1.0 - 1e-6))
    axis = rot.cross(thigh, shank)
    if hinge is not None:
        bent = rot.norm(axis) > 0.05 * long * short
        axis = np.where(bent[:, None], axis, rot.mul_vec(turned[:, knee], hinge))
    axis /= np.maximum(rot.norm(axis), 1e-12)[:, None]
    now = np.arctan2(rot.norm(rot.cross(thigh, shank)), np.sum(thigh * shank, axis=1))
    bend = np.arccos(np.clip((reach**2 - long**2 - short**2) / (2.0 * long * short), -1.0, 1.0))
    flex = rot.from_axis_angle(axis, bend - now)
    reached = thigh + rot.mul_vec(flex, shank)
    swing = rot.between(reached, target - places[:, hip])
    above = turned[:, body.parents[hip]]
    new_hip = rot.mul(swing, turned[:, hip])
    new_knee = rot.mul(swing, rot.mul(flex, turned[:, knee]))
    rotations[:, hip] = rot.inv_mul(above, new_hip)
    rotations[:, knee] = rot.inv_mul(new_hip, new_knee)
    rotations[:, ankle] = rot.inv_mul(new_knee, facing)
    return replace(motion, rotations=rot.normalise(rotations))
