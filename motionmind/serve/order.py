"""Orders of a program: poses, waypoints and pins on a time line, on a body of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError

MOST_ROTATIONS = 2_000_000  # in all samples together, 16 bytes each where they are sent


@dataclass(frozen=True, eq=False)
class Pose:
    """Rotations of some joints in a frame.

    Attributes:
        frame: the frame, from 0.
        rotations: unit quaternions of all joints [J, 4]; those that are not given are any.
        given: which joints are given [J].
        root: place of the root joint [3], metres; None where it is free.
    """

    frame: int
    rotations: Floats
    given: Bools
    root: Floats | None = None


@dataclass(frozen=True, eq=False)
class Waypoint:
    """A place on the floor that the root passes in a frame.

    Attributes:
        frame: the frame, from 0.
        place: x and z [2], metres.
        heading: where the body then faces, radians from +z towards +x; None where it is free.
    """

    frame: int
    place: Floats
    heading: float | None = None


@dataclass(frozen=True, eq=False)
class Pin:
    """A place that a joint is at in a frame.

    Attributes:
        frame: the frame, from 0.
        joint: the joint.
        place: x, y and z [3], metres.
        rotation: the joint's rotation then [4]; None where it is free.
    """

    frame: int
    joint: int
    place: Floats
    rotation: Floats | None = None


@dataclass(frozen=True, eq=False)
class Order:
    """An order of movement.

    Attributes:
        skeleton: the body; its zero pose is its rest pose.
        stands: place of the root joint in the rest pose [3], metres.
        frames: how many frames.
        fps: frames a second.
        poses: at least one.
        waypoints: on the way.
        pins: of joints.
        samples: how many movements.
        seed: of the samples; 0 for the best movement and others that differ from it.
        hold: joints of the corpus that keep their state.
        novelty: from 0 to 1: see `TweenRequest`.

    Raises:
        MotionMindError: there is no pose; a frame is outside; two poses disagree; two waypoints, or two pins of a
            joint, are in one frame; there are too many frames.
    """

    skeleton: Skeleton
    stands: Floats
    frames: int
    fps: float
    poses: Sequence[Pose]
    waypoints: Sequence[Waypoint] = ()
    pins: Sequence[Pin] = ()
    samples: int = 1
    seed: int = 0
    hold: Sequence[str] = ()
    novelty: float = 0.0

    def __post_init__(self) -> None:
        if not self.poses:
            raise MotionMindError("there is no pose to move from: give at least one, and for movement two")
        for frame in [one.frame for some in (self.poses, self.waypoints, self.pins) for one in some]:
            if not 0 <= frame < self.frames:
                raise MotionMindError(f"frame {frame} is outside 0 to {self.frames - 1}")
        if (count := self.samples * self.frames * len(self.skeleton)) > MOST_ROTATIONS:
            raise MotionMindError(f"{count} rotations are asked for; the most in an answer are {MOST_ROTATIONS}")
        _check_once("waypoints", [one.frame for one in self.waypoints])
        for joint in {one.joint for one in self.pins}:
            name = f"pins of {self.skeleton.names[joint]}"
            _check_once(name, [one.frame for one in self.pins if one.joint == joint])
        object.__setattr__(self, "poses", _merged(self.poses))
        object.__setattr__(self, "waypoints", sorted(self.waypoints, key=lambda one: one.frame))

    @property
    def lowest(self) -> float:
        """Height of the lowest joint in the rest pose, metres."""
        return float(self.stands[1] + self.skeleton.rest[: len(self.skeleton), 1].min())


def _check_once(name: str, frames: Sequence[int]) -> None:
    twice = sorted(frame for frame, count in Counter(frames).items() if count > 1)
    if twice:
        raise MotionMindError(f"there are two {name} in frame {twice[0]}: give one")


def _merged(poses: Sequence[Pose]) -> list[Pose]:
    """Return one pose for each frame, in order; MotionMindError if two give a joint or the root differently."""
    found: dict[int, Pose] = {}
    for pose in sorted(poses, key=lambda one: one.frame):
        other = found.get(pose.frame)
        if other is None:
            found[pose.frame] = pose
            continue
        both = pose.given & other.given
        roots = [one.root for one in (other, pose) if one.root is not None]
        if not np.allclose(pose.rotations[both], other.rotations[both]) or not np.allclose(roots, roots[:1]):
            raise MotionMindError(f"two poses in frame {pose.frame} disagree: give one")
        rotations = np.where(pose.given[:, None], pose.rotations, other.rotations)
        found[pose.frame] = Pose(pose.frame, rotations, pose.given | other.given, roots[0] if roots else None)
    return list(found.values())
