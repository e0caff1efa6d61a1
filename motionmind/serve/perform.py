"""Turn poses, waypoints and pins on a timeline into movement: tweens from pose to pose, each with its certificate.

A tween leads from each pose to the next in the time between them, and continues the movement of the previous tween.
For a waypoint or a partial pose between two poses, a first pass moves the body without it; the resulting posture is put
on the waypoint or given the pose's rotations, and the second pass goes through it. Corrections that are linear in time
remove the remaining errors (retargeting is not exact, and not every one of several close waypoints gets a posture).
Pins turn limbs, fully in the pins' frames and gradually less around them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.ik import chain_to, reach
from motionmind.body.motion import Motion, Posture
from motionmind.errors import NoPathError
from motionmind.geometry import rotations as rot
from motionmind.search.solve import Progress, Watch
from motionmind.serve.order import Order, Pin, Pose, Waypoint
from motionmind.serve.rig import Rig
from motionmind.tween.engine import Engine
from motionmind.tween.result import Tween

_WAYPOINT_GAP_S = 0.4  # at least, between a posture at a waypoint and its neighbours
_PIN_EASE_S = 0.3  # pins ease in before a joint's first one, and out after its last
_MISS_M = 1e-3  # a greater miss of a pin or a waypoint gets a note


@dataclass(frozen=True)
class Stretch:
    """A tween between two poses.

    Attributes:
        first: frame of the first pose.
        last: frame of the second.
        tween: the tween, on the corpus's joints.
    """

    first: int
    last: int
    tween: Tween


@dataclass(frozen=True, eq=False)
class Performance:
    """One movement.

    Attributes:
        rotations: of the order's joints [T, J, 4].
        root: positions of the root joint [T, 3], metres.
        stretches: its tweens, in order.
        notes: sentences on results that the client may not expect.
    """

    rotations: Floats
    root: Floats
    stretches: tuple[Stretch, ...]
    notes: tuple[str, ...]


def perform(engine: Engine, order: Order, watch: Watch | None = None) -> list[Performance]:
    """Return the movements of an order.

    Args:
        engine: the corpus that moves the body.
        order: the order.
        watch: see `Engine.tween`; its errors end the work.

    Raises:
        SkeletonError: the body does not map to the corpus's.
        NoPathError: no path joins two poses.
        MotionMindError: the order cannot be fulfilled.
    """
    return _Stage(engine, order, watch).perform()


class _Stage:
    """The work on one order."""

    def __init__(self, engine: Engine, order: Order, watch: Watch | None) -> None:
        self.engine, self.order, self.watch = engine, order, watch
        self.rig = Rig(order.skeleton, engine.corpus)
        self.hold = tuple(order.hold)
        self.notes: list[str] = []

    def perform(self) -> list[Performance]:
        """Return the movements."""
        order, given = self.order, self._whole_poses()
        first, last = order.poses[0].frame, order.poses[-1].frame
        if first > 0:
            self.notes.append(f"still before frame {first}, the first with a pose")
        if last < order.frames - 1:
            self.notes.append(f"still after frame {last}, the last with a pose")
        poses, fixed = self._with_postures_between(given), np.array([pose.frame for pose in order.poses])
        out = []
        tried: list[list[Tween]] = [[] for _ in poses]
        for sample in range(order.samples):
            motion, stretches = self._move(poses, tried, sample)
            motion = self._on_waypoints(motion, fixed)
            motion, missed = self._pin(motion, fixed.tolist())
            out.append(Performance(motion.rotations, motion.root, tuple(stretches), (*self.notes, *missed)))
        return out

    def _whole_poses(self) -> list[tuple[int, Posture]]:
        """Return frames and postures of the whole poses and of the first and last pose, completed if partial."""
        order, skeleton = self.order, self.order.skeleton
        places = {one.frame: one.place for one in order.waypoints}
        places |= {one.frame: one.root[[0, 2]] for one in order.poses if one.root is not None}
        frames = sorted(places)
        known = np.array([places[frame] for frame in frames]) if frames else order.stands[None, [0, 2]]
        out = []
        for pose in order.poses:
            if not pose.given.all() and pose is not order.poses[0] and pose is not order.poses[-1]:
                continue
            rotations, root = self._filled(pose), pose.root
            if root is None:
                x, z = (np.interp(pose.frame, frames or [0], known[:, axis]) for axis in (0, 1))
                low = skeleton.positions(rotations, np.zeros(3))[:, 1].min()
                root = np.array([x, order.lowest - low, z])
            out.append((pose.frame, Posture(skeleton, rotations, root)))
        return out

    def _filled(self, pose: Pose) -> Floats:
        """Return the rotations of a pose [J, 4], with missing joints from the corpus's nearest posture."""
        if pose.given.all():
            return pose.rotations
        skeleton = self.order.skeleton
        like = Posture(skeleton, np.where(pose.given[:, None], pose.rotations, rot.IDENTITY), np.zeros(3))
        filled = self.rig.nearest(like, pose.given.astype(np.float64))
        rotations = np.where(pose.given[:, None], pose.rotations, filled)
        for one in self.order.waypoints:
            if one.frame == pose.frame and one.heading is not None and not pose.given[0]:
                rotations[0] = _facing(rotations[0], one.heading)
        lacks = [name for name, is_given in zip(skeleton.names, pose.given, strict=True) if not is_given]
        self.notes.append(
            f"frame {pose.frame}: the pose lacks {len(lacks)} joints, such as {lacks[0]}; they come from the nearest "
            "posture of the corpus"
        )
        return rotations

    def _with_postures_between(self, given: list[tuple[int, Posture]]) -> list[tuple[int, Posture]]:
        """Return the whole poses, and between them postures at partial poses and waypoints.

        These postures come from a movement through the whole poses alone, and are adjusted to the order.
        """
        apart, chosen = _WAYPOINT_GAP_S * self.order.fps, [pose.frame for pose in self.order.poses]
        asked: dict[int, tuple[Pose | None, Waypoint | None]] = {
            pose.frame: (pose, None) for pose in self.order.poses if all(pose.frame != frame for frame, _ in given)
        }
        for one in self.order.waypoints:
            if one.frame in asked:
                asked[one.frame] = asked[one.frame][0], one
            elif chosen[0] < one.frame < chosen[-1] and min(abs(one.frame - frame) for frame in chosen) >= apart:
                asked[one.frame] = None, one
                chosen = sorted([*chosen, one.frame])
        if not asked:
            return given
        motion, _ = self._move(given, [[] for _ in given], 0)
        between = [(frame, _put(motion.posture(frame), *what)) for frame, what in asked.items()]
        return sorted([*given, *between], key=lambda pair: pair[0])

    def _move(
        self, poses: list[tuple[int, Posture]], tried: list[list[Tween]], sample: int
    ) -> tuple[Motion, list[Stretch]]:
        """Return the motion through postures, still before the first and after the last, and its tweens.

        Args:
            poses: frames and postures, in order.
            tried: tweens of earlier samples, for each pair of neighbours; this sample's are added.
            sample: number of the sample.
        """
        order = self.order
        rotations = np.empty((order.frames, len(order.skeleton), 4))
        root = np.empty((order.frames, 3))
        for (frame, posture), (following, _) in pairwise([*poses, (order.frames, poses[-1][1])]):
            rotations[frame:following], root[frame:following] = posture.rotations, posture.root
        rotations[: poses[0][0]], root[: poses[0][0]] = poses[0][1].rotations, poses[0][1].root
        stretches: list[Stretch] = []
        before: Motion | None = None
        for ((first, a), (last, b)), found in zip(pairwise(poses), tried, strict=False):
            if last - first < 2 or _is_same(a, b):
                before = None
                continue
            tween = self._tween(a, b, last - first, before, found, sample)
            found.append(tween)
            stretches.append(Stretch(first, last, tween))
            made = tween.motion.at(tween.motion.times[0] + np.arange(last - first + 1) / order.fps)
            mine = _joining(self.rig.from_corpus(made, a), a, b)
            rotations[first + 1 : last], root[first + 1 : last] = mine.rotations[1:-1], mine.root[1:-1]
            before = replace(made, insertions=())
        return Motion(order.skeleton, rotations, root, np.arange(order.frames) / order.fps), stretches

    def _tween(
        self, a: Posture, b: Posture, frames: int, before: Motion | None, found: list[Tween], sample: int
    ) -> Tween:
        """Return the tween from one posture to another in a number of frames."""
        order = self.order
        start, end = self.rig.to_corpus(a), self.rig.to_corpus(b)
        options: dict[str, Any] = {
            "duration": frames / order.fps,
            "fps": order.fps,
            "novelty": order.novelty,
            "hold": self.hold,
            "sample": order.seed > 0,
            "seed": order.seed + sample,
        }
        if found and not order.seed:
            try:
                return self.engine.tween(start, end, before=before, watch=self.watch, **options, unlike=found)
            except NoPathError:
                self.notes.append(f"sample {sample}: no alternative for {frames} of the frames")
        return self.engine.tween(start, end, before=before, watch=self.watch, **options)

    def _on_waypoints(self, motion: Motion, frames: Ints) -> Motion:
        """Move the motion onto all waypoints, by corrections that are linear in time between them and the poses."""
        times, rotations, root = np.arange(len(motion)), motion.rotations.copy(), motion.root.copy()
        free = [one for one in self.order.waypoints if frames[0] < one.frame < frames[-1] and one.frame not in frames]
        headed = [(one.frame, one.heading) for one in free if one.heading is not None]
        if headed:
            between = np.array([frame for frame, _ in headed])
            turned = [_turns(rotations[frame, 0], _facing(rotations[frame, 0], heading)) for frame, heading in headed]
            turn = _lines(times, *_with_zeros(between, np.stack(turned), frames))
            rotations[:, 0] = rot.normalise(rot.mul(rot.exp(turn), rotations[:, 0]))
        if free:
            between = np.array([one.frame for one in free])
            level = np.stack([one.place for one in free]) - root[between][:, [0, 2]]
            root[:, [0, 2]] += _lines(times, *_with_zeros(between, level, frames))
        for one in self.order.waypoints:
            off = float(np.linalg.norm(root[one.frame, [0, 2]] - one.place))
            if off > _MISS_M:
                self.notes.append(
                    f"frame {one.frame}: {off:.3f} m from the waypoint: poses take precedence, and the body is still "
                    "before the first and after the last"
                )
        return replace(motion, rotations=rotations, root=root)

    def _pin(self, motion: Motion, fixed: Sequence[int]) -> tuple[Motion, list[str]]:
        """Return the motion with joints at their pins, except in the poses' frames, and notes on misses."""
        skeleton, rotations, notes = self.order.skeleton, motion.rotations.copy(), []
        eases = round(_PIN_EASE_S * self.order.fps)
        pins = [pin for pin in self.order.pins if pin.frame not in fixed]
        for joint in dict.fromkeys(pin.joint for pin in pins):
            mine: list[Pin] = sorted((pin for pin in pins if pin.joint == joint), key=lambda pin: pin.frame)
            frames = np.array([pin.frame for pin in mine])
            turned = [*chain_to(skeleton, joint), joint]
            goals = rotations[frames]
            for goal, pin in zip(goals, mine, strict=True):
                if self.watch is not None:
                    self.watch(Progress(0.0, 0.0, 0))  # may raise: a request can have thousands of pins
                goal[:] = reach(skeleton, goal, motion.root[pin.frame], joint, pin.place)
                if pin.rotation is not None:
                    goal[joint] = pin.rotation
            beside = [*fixed, frames[0] - eases, frames[-1] + eases]
            turns = _turns(rotations[frames], goals)
            for one in turned:
                turn = _lines(np.arange(len(motion)), *_with_zeros(frames, turns[:, one], np.array(beside)))
                rotations[:, one] = rot.normalise(rot.mul(rot.exp(turn), rotations[:, one]))
        for pin in self.order.pins:
            at = skeleton.positions(rotations[pin.frame], motion.root[pin.frame])[pin.joint]
            if (missed := float(np.linalg.norm(at - pin.place))) > _MISS_M:
                notes.append(f"frame {pin.frame}: {skeleton.names[pin.joint]} is {missed:.3f} m from its pin")
        return replace(motion, rotations=rotations), notes


def _put(posture: Posture, pose: Pose | None, waypoint: Waypoint | None) -> Posture:
    """Return a posture with the given rotations of a pose, on a waypoint."""
    rotations, root = posture.rotations.copy(), posture.root.copy()
    if waypoint is not None:
        root[[0, 2]] = waypoint.place
        rotations[0] = rotations[0] if waypoint.heading is None else _facing(rotations[0], waypoint.heading)
    if pose is not None:
        rotations = np.where(pose.given[:, None], pose.rotations, rotations)
        root = root if pose.root is None else pose.root
    return replace(posture, rotations=rotations, root=root)


def _joining(motion: Motion, a: Posture, b: Posture) -> Motion:
    """Make a motion begin and end exactly in two postures, by a correction that is linear in time."""
    ends, times = np.array([0, len(motion) - 1]), np.arange(len(motion))
    turns = _turns(motion.rotations[ends], np.stack([a.rotations, b.rotations]))
    rotations = rot.normalise(rot.mul(rot.exp(_lines(times, ends, turns)), motion.rotations))
    root = motion.root + _lines(times, ends, np.stack([a.root, b.root]) - motion.root[ends])
    return replace(motion, rotations=rotations, root=root)


def _facing(q: Floats, heading: float) -> Floats:
    """Turn a rotation of the root [4] about the vertical to face a heading."""
    return rot.mul(rot.about_vertical(heading - float(rot.heading(q))), q)


def _turns(q: Floats, wanted: Floats) -> Floats:
    """Return the rotation vectors [..., 3] from rotations to wanted ones."""
    return rot.log(rot.mul_inv(wanted, q))


def _lines(times: Ints, frames: Ints, values: Floats) -> Floats:
    """Interpolate values [K, ...] at increasing frames [K] linearly, constant beyond them [T, ...]."""
    flat = values.reshape(len(values), -1)
    return np.stack([np.interp(times, frames, one) for one in flat.T], axis=1).reshape(len(times), *values.shape[1:])


def _with_zeros(frames: Ints, values: Floats, beside: Ints) -> tuple[Ints, Floats]:
    """Add values of 0 at other frames; return frames and values in order."""
    zeros = np.setdiff1d(beside, frames)
    every = np.concatenate([frames, zeros])
    order = np.argsort(every)
    return every[order], np.concatenate([values, np.zeros((len(zeros), *values.shape[1:]))])[order]


def _is_same(a: Posture, b: Posture) -> bool:
    tolerance = 1e-4  # radians and metres
    return bool(rot.angle(a.rotations, b.rotations).max() < tolerance and np.abs(a.root - b.root).max() < tolerance)
