"""A client's order: poses, waypoints and pins on a timeline, for its own body."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError

MAX_ANSWER_ROTATIONS = 2_000_000  # in all samples together; each takes 16 bytes in the answer


@dataclass(frozen=True, eq=False)
class Pose:
    """Rotations of some joints in a frame.

    Attributes:
        frame: the frame, from 0.
        rotations: unit quaternions of all joints [J, 4], arbitrary for joints that are not given.
        given: which joints are given [J].
        root: position of the root joint [3], metres; None if it is free.
    """

    frame: int
    rotations: Floats
    given: Bools
    root: Floats | None = None


@dataclass(frozen=True, eq=False)
class Waypoint:
    """A floor position of the root in a frame.

    Attributes:
        frame: the frame, from 0.
        place: x and z [2], metres.
        heading: direction that the body faces, radians from +z towards +x; None if it is free.
    """

    frame: int
    place: Floats
    heading: float | None = None


@dataclass(frozen=True, eq=False)
class Pin:
    """A position of a joint in a frame.

    Attributes:
        frame: the frame, from 0.
        joint: the joint.
        place: x, y and z [3], metres.
        rotation: the joint's rotation [4]; None if it is free.
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
        stands: position of the root joint in the rest pose [3], metres.
        frames: number of frames.
        fps: frames a second.
        poses: poses, at least one.
        waypoints: floor positions of the root.
        pins: positions of joints.
        samples: number of movements.
        seed: seed of the samples; 0 for the best movement and alternatives that differ from it.
        hold: joints of the corpus that keep their state.
        novelty: from 0 to 1, see `TweenRequest`.

    Raises:
        MotionMindError: there is no pose; a frame is out of range; two poses contradict each other; a frame has two
            waypoints, or two pins of one joint; there are too many frames.
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
            raise MotionMindError("no poses: give at least one, or two to move between")
        for frame in [one.frame for some in (self.poses, self.waypoints, self.pins) for one in some]:
            if not 0 <= frame < self.frames:
                raise MotionMindError(f"frame {frame} is outside 0 to {self.frames - 1}")
        if (count := self.samples * self.frames * len(self.skeleton)) > MAX_ANSWER_ROTATIONS:
            raise MotionMindError(f"{count} rotations requested; an answer holds at most {MAX_ANSWER_ROTATIONS}")
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
        raise MotionMindError(f"two {name} in frame {twice[0]}: give one")


def _merged(poses: Sequence[Pose]) -> list[Pose]:
    """Merge poses of the same frame; return them in order; raise MotionMindError if two contradict each other."""
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
