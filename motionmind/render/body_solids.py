"""The volume of a body as solids: round cones and ellipsoids fixed to its joints; no pixels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.render.solids import Cones, Ellipsoids

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Frame:
    """Axes that carry solids, half-way between two joints in position and in orientation.

    Attributes:
        places: indices of the two joints whose positions are averaged; the same one twice for one joint's own axes.
        turns: indices of the two joints whose orientations are averaged.
    """

    places: tuple[int, int]
    turns: tuple[int, int]


@dataclass(frozen=True)
class Cone:
    """A round cone from one frame to another.

    Attributes:
        part: the body part, such as "left_foot"; no line separates solids of one part.
        paint: a key of `palette.COLOURS`.
        a_frame, b_frame: indices of the frames that carry its ends.
        a, b: centres of its end balls, metres, in those frames' axes.
        a_radius, b_radius: radii of its end balls, metres.
    """

    part: str
    paint: str
    a_frame: int
    a: Point
    a_radius: float
    b_frame: int
    b: Point
    b_radius: float


@dataclass(frozen=True)
class Ball:
    """An ellipsoid along a frame's axes.

    Attributes:
        part, paint: as a cone's.
        frame: index of the frame that carries it.
        centre: its centre, metres, in the frame's axes.
        radii: its half axes, metres.
    """

    part: str
    paint: str
    frame: int
    centre: Point
    radii: Point


@dataclass(frozen=True, eq=False)
class BodyShape:
    """A skeleton's body as solids, numbered from 0: the cones, then the balls.

    Attributes:
        skeleton: the skeleton.
        frames: the axes that carry the solids.
        cones, balls: the solids.
        size: the body's scale; 1 for a person 1.70 m tall.
        masses: share of the body's mass, by body part; empty if unknown.
    """

    skeleton: Skeleton
    frames: tuple[Frame, ...]
    cones: tuple[Cone, ...]
    balls: tuple[Ball, ...]
    size: float
    masses: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def height(self) -> float:
        """Height in metres of a person of this size."""
        return self.size * human23().height

    @cached_property
    def parts(self) -> tuple[str, ...]:
        """The body part of each solid [N]."""
        return tuple([cone.part for cone in self.cones] + [ball.part for ball in self.balls])

    @cached_property
    def paints(self) -> tuple[str, ...]:
        """The paint of each solid [N], a key of `palette.COLOURS`."""
        return tuple([cone.paint for cone in self.cones] + [ball.paint for ball in self.balls])

    def solids(self, rotations: Floats, root: Floats) -> tuple[Cones, Ellipsoids]:
        """Point the solids in the world.

        Args:
            rotations: unit quaternions x, y, z, w, local to the parent [..., J, 4].
            root: the root's positions [..., 3], metres.

        Returns:
            Cones [..., N, 3] and ellipsoids [..., M, 3] in the world, metres.
        """
        orientations = self.skeleton.global_rotations(rotations)
        joints = self.skeleton.positions(rotations, root)
        places, turns = (np.array([getattr(frame, of) for frame in self.frames]) for of in ("places", "turns"))
        origin = joints[..., places, :].mean(axis=-2)
        axes = rot.slerp(orientations[..., turns[:, 0], :], orientations[..., turns[:, 1], :], 0.5)

        def to_world(frames: list[int], points: list[Point]) -> Floats:
            local = np.array(points).reshape(-1, 3)
            return np.asarray(origin[..., frames, :] + rot.mul_vec(axes[..., frames, :], local))

        cones = Cones(
            to_world([cone.a_frame for cone in self.cones], [cone.a for cone in self.cones]),
            to_world([cone.b_frame for cone in self.cones], [cone.b for cone in self.cones]),
            np.array([cone.a_radius for cone in self.cones]),
            np.array([cone.b_radius for cone in self.cones]),
        )
        frames = [ball.frame for ball in self.balls]
        half = np.array([ball.radii for ball in self.balls]).reshape(-1, 1, 3)
        balls = Ellipsoids(
            to_world(frames, [ball.centre for ball in self.balls]), rot.to_matrix(axes[..., frames, :]) * half
        )
        return cones, balls

    def centre_of_mass(self, cones: Cones, balls: Ellipsoids) -> Floats:
        """Compute the centre of mass [..., 3] of a body whose solids `solids` placed, metres.

        A person's body parts have human masses, each of uniform density; any other body has uniform density.

        Args:
            cones, balls: the body's solids in the world, metres.
        """
        volumes = np.concatenate([cones.volumes(), balls.volumes()], axis=-1)
        if self.masses:
            part_of = np.array([[part == name for part in self.parts] for name in self.masses], dtype=np.float64)
            volumes = volumes * (np.array(list(self.masses.values())) / (volumes @ part_of.T) @ part_of)
        centres = np.concatenate([0.5 * (cones.a + cones.b), balls.centre], axis=-2)
        return np.asarray((volumes[..., None] * centres).sum(axis=-2) / volumes.sum(axis=-1)[..., None])


def joint_frames(skeleton: Skeleton) -> tuple[Frame, ...]:
    """Return the frame of each joint [J]."""
    return tuple(Frame((joint, joint), (joint, joint)) for joint in range(len(skeleton)))


def extent(skeleton: Skeleton) -> float:
    """Return the longest side of the skeleton's bounding box at rest, metres; 1 if all joints coincide."""
    return float(np.ptp(skeleton.rest, axis=0).max()) or 1.0


def as_point(point: Floats) -> Point:
    """Return a point [3] as a tuple."""
    x, y, z = (float(number) for number in point)
    return x, y, z
