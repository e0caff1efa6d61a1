"""The volume of a body: which solids surround which joints. It knows no pixels.

Sizes are those of a body 1.70 m tall and grow with it; lengths are the skeleton's own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.human import human23
from motionmind.body.mirror import LEFT, MIDDLE, RIGHT, sides_of
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.render.solids import Cones, Ellipsoids

Place = tuple[float, float, float]

FACE, HAIR, MARK = "face", "hair", "mark"  # paints, beside the sides

# Radii in metres of a person's limbs at the joints.
_RADII = {"hip": 0.080, "knee": 0.051, "ankle": 0.032, "shoulder": 0.046, "elbow": 0.036, "wrist": 0.025}
# The joints of human23 whose segments a part is.
_SEGMENTS = {"head": ("atlantal",), "trunk": ("pelvis", "lumbar", "thorax")}
_SEGMENTS |= {"upper_arm": ("shoulder",), "forearm": ("elbow",), "hand": ("wrist",)}
_SEGMENTS |= {"thigh": ("hip",), "shank": ("knee",), "foot": ("ankle",)}


@dataclass(frozen=True)
class Frame:
    """Axes to which solids are fixed: half-way between two joints, in place and in orientation; or one joint's."""

    places: tuple[int, int]
    turns: tuple[int, int]


@dataclass(frozen=True)
class Cone:
    """A round cone between two frames; places in metres in their axes, radii in metres.

    `part` is what it is a part of, as "left_foot": solids of one part have no line between them. `paint` is its colour.
    """

    part: str
    paint: str
    a_frame: int
    a: Place
    a_radius: float
    b_frame: int
    b: Place
    b_radius: float


@dataclass(frozen=True)
class Ball:
    """An ellipsoid in a frame's axes: its centre and its half axes, metres; `part` and `paint` as a cone's."""

    part: str
    paint: str
    frame: int
    centre: Place
    radii: Place


@dataclass(frozen=True, eq=False)
class BodyShape:
    """The volume of a skeleton's body: first the cones, then the balls.

    Attributes:
        skeleton: its joints.
        frames: the axes to which the solids are fixed.
        cones, balls: the solids.
        size: how large the body is; 1 for a person 1.70 m tall.
        masses: shares of the body's mass by part, where they are known.
    """

    skeleton: Skeleton
    frames: tuple[Frame, ...]
    cones: tuple[Cone, ...]
    balls: tuple[Ball, ...]
    size: float
    masses: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def height(self) -> float:
        """How tall a person of this size is, in metres."""
        return self.size * human23().height

    @cached_property
    def parts(self) -> tuple[str, ...]:
        """What each solid is a part of."""
        return tuple([cone.part for cone in self.cones] + [ball.part for ball in self.balls])

    @cached_property
    def paints(self) -> tuple[str, ...]:
        """What each solid is painted with."""
        return tuple([cone.paint for cone in self.cones] + [ball.paint for ball in self.balls])

    def solids(self, rotations: Floats, root: Floats) -> tuple[Cones, Ellipsoids]:
        """The solids in the world of postures given by local rotations [..., J, 4] and the root's place [..., 3]."""
        turned = self.skeleton.global_rotations(rotations)
        joints = self.skeleton.positions(rotations, root)
        places, turns = (np.array([getattr(frame, of) for frame in self.frames]) for of in ("places", "turns"))
        origin = joints[..., places, :].mean(axis=-2)
        first, second = turned[..., turns[:, 0], :], turned[..., turns[:, 1], :]
        axes = rot.slerp(first, second, 0.5)

        def put(frames: list[int], points: list[Place]) -> Floats:
            local = np.array(points).reshape(-1, 3)
            return np.asarray(origin[..., frames, :] + rot.mul_vec(axes[..., frames, :], local))

        cones = Cones(
            put([cone.a_frame for cone in self.cones], [cone.a for cone in self.cones]),
            put([cone.b_frame for cone in self.cones], [cone.b for cone in self.cones]),
            np.array([cone.a_radius for cone in self.cones]),
            np.array([cone.b_radius for cone in self.cones]),
        )
        frames = [ball.frame for ball in self.balls]
        half = np.array([ball.radii for ball in self.balls]).reshape(-1, 1, 3)
        balls = Ellipsoids(
            put(frames, [ball.centre for ball in self.balls]), rot.to_matrix(axes[..., frames, :]) * half
        )
        return cones, balls

    def centre_of_mass(self, cones: Cones, balls: Ellipsoids) -> Floats:
        """The centre of mass [..., 3] of a body whose solids are there, metres.

        A person's parts weigh what people's do, and each is as dense as another of its solids; any other body is as
        dense all over.
        """
        volumes = np.concatenate([cones.volumes(), balls.volumes()], axis=-1)
        if self.masses:
            part_of = np.array([[part == one for part in self.parts] for one in self.masses], dtype=np.float64)
            volumes = volumes * (np.array(list(self.masses.values())) / (volumes @ part_of.T) @ part_of)
        centres = np.concatenate([0.5 * (cones.a + cones.b), balls.centre], axis=-2)
        return np.asarray((volumes[..., None] * centres).sum(axis=-2) / volumes.sum(axis=-1)[..., None])


def shape_of(skeleton: Skeleton) -> BodyShape:
    """The volume of any skeleton: a person's where human23's tree is in it, whatever joints are between and beyond."""
    return _Person(skeleton).body() if _is_person(skeleton) else _creature(skeleton)


def _is_person(skeleton: Skeleton) -> bool:
    human = human23()
    known: list[str | None] = []  # for each joint, the nearest of human23's at or above it
    for name, parent in zip(skeleton.names, skeleton.parents, strict=True):
        above = known[parent] if parent >= 0 else None
        if name in human.names:
            wanted = human.parents[human.index(name)]
            if above != (human.names[wanted] if wanted >= 0 else None):
                return False
        known.append(name if name in human.names else above)
    return set(human.names) <= set(skeleton.names)


def _creature(skeleton: Skeleton) -> BodyShape:
    """A tapered limb from each joint to its children and to its tip, the thinner the nearer to the limb's end."""
    span = _span(skeleton)
    levels = np.zeros(len(skeleton), dtype=int)  # of joints below
    for joint in range(len(skeleton) - 1, 0, -1):
        parent = skeleton.parents[joint]
        levels[parent] = max(levels[parent], levels[joint] + 1)
    paints, still = sides_of(skeleton), (0.0, 0.0, 0.0)
    radii = span * (0.008 + 0.006 * np.minimum(levels, 4))
    radii[[paint == MIDDLE for paint in paints]] *= 1.5  # a body is thicker than its legs
    cones = [
        Cone(skeleton.names[parent], paints[joint], parent, still, radii[joint], joint, still, radii[joint])
        for joint, parent in enumerate(skeleton.parents)
        if parent >= 0
    ]
    cones += [
        Cone(skeleton.names[joint], paints[joint], joint, still, radii[joint], joint, _place(tip), 0.6 * radii[joint])
        for joint, tip in enumerate(skeleton.tips)
        if tip.any() or len(skeleton) == 1
    ]
    return BodyShape(skeleton, _own_frames(skeleton), tuple(cones), (), span / human23().height)


class _Person:
    """A person's solids, part by part, in metres times `size`, which is 1 for 1.70 m."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        self.size = (skeleton.height or _span(skeleton)) / human23().height
        self.rest = skeleton.positions(np.tile(rot.IDENTITY, (len(skeleton), 1)), np.zeros(3))
        self.frames = list(_own_frames(skeleton))
        self.drawn: set[int] = set()
        self.thumbs = any("thumb" in name.lower() for name in skeleton.names)

    def body(self) -> BodyShape:
        """All of it."""
        solids = [*self._trunk(), *self._head()]
        for paint, outward in ((LEFT, 1.0), (RIGHT, -1.0)):
            solids += [*self._leg(paint, outward), *self._foot(paint, outward)]
            solids += [*self._arm(paint), *self._hand(paint, outward)]
        solids += self._others()
        cones = tuple(solid for solid in solids if isinstance(solid, Cone))
        balls = tuple(solid for solid in solids if isinstance(solid, Ball))
        known = anatomy_named("human23").joints
        masses = {
            part: sum(known[joint].mass for joint in _SEGMENTS.get(re.sub("^(left|right)_", "", part), ()))
            for part in (solid.part for solid in solids)
        }
        return BodyShape(self.skeleton, tuple(self.frames), cones, balls, self.size, masses)

    def _trunk(self) -> Iterator[Cone | Ball]:
        lumbar, thorax = self._joint("lumbar"), self._joint("thorax")
        hips = self._step("pelvis", "left_hip")[1]
        waist = float(np.linalg.norm(self._step("lumbar", "thorax"))) / self.size
        chest = self._step("thorax", "cervical") / self.size
        tall = float(np.linalg.norm(chest))
        between = self._halfway((lumbar, thorax), (lumbar, thorax))
        cervical, atlantal = self._joint("cervical"), self._joint("atlantal")
        ribs = self._halfway((thorax, cervical), (thorax, self.skeleton.parents[cervical]))
        yield self._ball(
            "trunk", MIDDLE, self._joint("pelvis"), (0.0, 0.4 * hips / self.size, 0.0), (0.140, 0.105, 0.105)
        )
        yield self._ball("trunk", MIDDLE, between, (0.0, -0.01, 0.0), (0.116, 0.5 * waist + 0.09, 0.086))
        yield self._ball("trunk", MIDDLE, ribs, _place(-0.08 * chest), (0.138, 0.5 * tall + 0.035, 0.100))
        # The breastbone and the navel tell the front of the trunk from its back.
        top, bottom = (0.0, 0.17 * tall, 0.086), (0.0, -0.28 * tall, 0.093)
        yield self._cone("trunk", MARK, ribs, top, 0.011, ribs, bottom, 0.011)
        yield self._ball("trunk", MARK, between, (0.0, -0.02, 0.082), (0.014, 0.014, 0.010))
        yield self._cone("trunk", MIDDLE, cervical, (0.0, -0.03, 0.0), 0.052, atlantal, (0.0, 0.02, 0.0), 0.044)
        for side in (LEFT, RIGHT):
            clavicle, shoulder = self._joint(f"{side}_clavicle"), self._joint(f"{side}_shoulder")
            yield self._cone("trunk", MIDDLE, clavicle, (0.0, 0.0, 0.0), 0.055, shoulder, (0.0, 0.0, 0.0), 0.046)

    def _head(self) -> Iterator[Cone | Ball]:
        skull = self._joint("atlantal")
        yield self._ball("head", HAIR, skull, (0.0, 0.100, 0.000), (0.076, 0.100, 0.094))
        yield self._ball("head", FACE, skull, (0.0, 0.078, 0.028), (0.063, 0.098, 0.076))
        yield self._cone("head", FACE, skull, (0.0, 0.085, 0.095), 0.014, skull, (0.0, 0.062, 0.122), 0.011)
        for x in (-0.027, 0.027):
            yield self._ball("head", HAIR, skull, (x, 0.098, 0.092), (0.011, 0.009, 0.012))

    def _leg(self, side: str, outward: float) -> Iterator[Cone | Ball]:
        hip, knee, ankle = (self._joint(f"{side}_{joint}") for joint in ("hip", "knee", "ankle"))
        yield from self._limb(f"{side}_thigh", side, (hip, knee), (_RADII["hip"], _RADII["knee"]))
        yield from self._limb(f"{side}_shank", side, (knee, ankle), (_RADII["knee"], _RADII["ankle"]))
        length = float(np.linalg.norm(self._step(f"{side}_knee", f"{side}_ankle"))) / self.size
        yield self._ball(
            f"{side}_shank",
            side,
            knee,
            (0.004 * outward, -0.32 * length, -0.022),
            (0.046, 0.3 * max(length, 0.1), 0.046),
        )
        # The kneecap sits half-way between the fronts of thigh and shank, and stands out as a blunt beak.
        bend = self._halfway((knee, knee), (hip, knee))
        yield self._cone(f"{side}_kneecap", MARK, bend, (0.0, 0.0, 0.030), 0.036, bend, (0.0, 0.0, 0.064), 0.022)

    def _foot(self, side: str, outward: float) -> Iterator[Cone | Ball]:
        """The sole is level with the joints at the ball of the foot and with the tips: these stand on the floor."""
        part, ankle, toes = f"{side}_foot", self._joint(f"{side}_ankle"), self._joint(f"{side}_toes")
        sole = self._step(f"{side}_ankle", f"{side}_toes") / self.size
        heel = (0.0, float(sole[1]) + 0.026, -0.28 * max(float(sole[2]), 0.08))
        yield self._cone(part, side, ankle, (0.0, 0.0, 0.0), _RADII["ankle"], ankle, heel, 0.026)
        yield self._cone(part, side, ankle, (0.0, 0.0, 0.012), 0.030, toes, (0.0, 0.022, 0.0), 0.022)
        for x, share in ((-0.024, 1.0), (0.002, 0.85), (0.026, 0.65)):  # from the great toe to the little one
            ball = (x * outward, 0.020, 0.0)
            yield self._cone(part, side, ankle, heel, 0.026, toes, ball, 0.020)
            yield from self._ray(part, side, toes, ball, (0.020, 0.012), np.array([0.0, 0.0, 0.045]), share)

    def _arm(self, side: str) -> Iterator[Cone | Ball]:
        shoulder, elbow, wrist = (self._joint(f"{side}_{joint}") for joint in ("shoulder", "elbow", "wrist"))
        yield from self._limb(f"{side}_upper_arm", side, (shoulder, elbow), (_RADII["shoulder"], _RADII["elbow"]))
        yield from self._limb(f"{side}_forearm", side, (elbow, wrist), (_RADII["elbow"], _RADII["wrist"]))

    def _hand(self, side: str, outward: float) -> Iterator[Cone | Ball]:
        """Flat, with its thumb: which way the palm looks is seen. At rest the palm looks down, the thumb ahead."""
        part, wrist, fingers = f"{side}_hand", self._joint(f"{side}_wrist"), self._joint(f"{side}_fingers")
        for z in (-0.018, 0.018):
            yield self._cone(part, side, wrist, (0.0, 0.0, 0.4 * z), 0.020, fingers, (0.0, 0.0, z), 0.017)
            yield from self._ray(
                part, side, fingers, (0.0, 0.0, z), (0.016, 0.009), np.array([0.060 * outward, 0.0, 0.0])
            )
        if not self.thumbs:
            root, end = (0.02 * outward, 0.0, 0.020), (0.075 * outward, -0.008, 0.052)
            yield self._cone(part, side, wrist, root, 0.014, wrist, end, 0.010)

    def _ray(
        self,
        part: str,
        paint: str,
        root: int,
        beside: Place,
        radii: tuple[float, float],
        least: Floats,
        share: float = 1.0,
    ) -> Iterator[Cone]:
        """Fingers or toes from the joint `root` on, through the joints below it up to the tip; metres for 1.70 m.

        The ray starts `beside` the joint and draws nearer to the joints' own line. Where the skeleton has no tip, or
        one nearer than `least`, as recordings do that mark the knuckles only, it goes there; a `share` of that bone.
        """
        chain = [root]
        while len(below := self.skeleton.children(chain[-1])) == 1:
            chain += below
        self.drawn |= set(chain)
        tip = self.skeleton.tips[chain[-1]] / self.size
        if len(chain) == 1 and np.linalg.norm(tip) < np.linalg.norm(least):
            tip = least
        tip, reach = share * tip, share * float(np.linalg.norm(tip))
        shares = np.linspace(0.0, 1.0, len(chain) + 1)
        widths = radii[0] + shares * (radii[1] - radii[0])
        # Flesh ends at the tip, so the last ball's centre lies its radius before it.
        far = tip * max(1.0 - radii[1] / reach, 0.0) if reach > 0.0 else tip
        # Beside the joints' line, less so towards the tip; above the sole by the radius, where it is a toe.
        nearer = np.stack([1.0 - 0.3 * shares, widths / radii[0], 1.0 - 0.3 * shares], axis=-1)
        points = np.array(beside) * nearer
        for i in range(len(chain)):
            end = chain[min(i + 1, len(chain) - 1)]
            last = points[i + 1] + (far if i == len(chain) - 1 else 0.0)
            yield self._cone(part, paint, chain[i], _place(points[i]), widths[i], end, _place(last), widths[i + 1])

    def _others(self) -> Iterator[Cone]:
        """Joints at a body's ends that human23 has not, such as those of single fingers: thin."""
        known = set(human23().names)
        inner = {-1, *self.drawn}  # joints that are drawn, or have one of human23's below them
        for joint in range(len(self.skeleton) - 1, -1, -1):
            if joint in inner or self.skeleton.names[joint] in known:
                inner |= {joint, self.skeleton.parents[joint]}
        paints, still = sides_of(self.skeleton), (0.0, 0.0, 0.0)
        for joint in sorted(set(range(len(self.skeleton))) - inner):
            part, parent = self.skeleton.names[joint], self.skeleton.parents[joint]
            tip = _place(self.skeleton.tips[joint] / self.size)
            yield self._cone(part, paints[joint], parent, still, 0.013, joint, still, 0.012)
            yield self._cone(part, paints[joint], joint, still, 0.012, joint, tip, 0.009)

    def _limb(self, part: str, paint: str, ends: tuple[int, int], radii: tuple[float, float]) -> Iterator[Cone]:
        """A limb from one joint to another, by way of the joints between them, if the skeleton has such."""
        chain = [ends[1]]
        while chain[-1] != ends[0]:
            chain.append(self.skeleton.parents[chain[-1]])
        chain.reverse()
        shares = np.linspace(0.0, 1.0, len(chain))
        widths = radii[0] + shares * (radii[1] - radii[0])
        for i in range(len(chain) - 1):
            still = (0.0, 0.0, 0.0)
            yield self._cone(part, paint, chain[i], still, widths[i], chain[i + 1], still, widths[i + 1])

    def _joint(self, name: str) -> int:
        return self.skeleton.index(name)

    def _step(self, start: str, end: str) -> Floats:
        """From one joint to another at rest [3], metres."""
        return np.asarray(self.rest[self._joint(end)] - self.rest[self._joint(start)])

    def _halfway(self, places: tuple[int, int], turns: tuple[int, int]) -> int:
        self.frames.append(Frame(places, turns))
        return len(self.frames) - 1

    def _cone(
        self, part: str, paint: str, a_frame: int, a: Place, a_radius: float, b_frame: int, b: Place, b_radius: float
    ) -> Cone:
        size = self.size
        return Cone(
            part,
            paint,
            a_frame,
            _place(size * np.array(a)),
            size * a_radius,
            b_frame,
            _place(size * np.array(b)),
            size * b_radius,
        )

    def _ball(self, part: str, paint: str, frame: int, centre: Place, radii: Place) -> Ball:
        return Ball(part, paint, frame, _place(self.size * np.array(centre)), _place(self.size * np.array(radii)))


def _own_frames(skeleton: Skeleton) -> tuple[Frame, ...]:
    return tuple(Frame((joint, joint), (joint, joint)) for joint in range(len(skeleton)))


def _span(skeleton: Skeleton) -> float:
    """The greatest extent in metres of the skeleton at rest; 1 where it has none."""
    rest = skeleton.positions_and_tips(np.tile(rot.IDENTITY, (len(skeleton), 1)), np.zeros(3))
    return float(np.ptp(rest, axis=0).max()) or 1.0


def _place(point: Floats) -> Place:
    x, y, z = (float(number) for number in point)
    return x, y, z
