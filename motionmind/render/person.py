"""A person's body as solids, on any skeleton that contains human23's tree.

Thicknesses are those of a body 1.70 m tall, scaled; lengths are the skeleton's own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.human import human23
from motionmind.body.mirror import LEFT, MIDDLE, RIGHT, sides_of
from motionmind.body.skeleton import Skeleton
from motionmind.render.body_solids import Ball, BodyShape, Cone, Frame, Point, as_point, extent, joint_frames
from motionmind.render.palette import FACE, HAIR, MARK

# Radii of a person's limbs at the joints.
_RADII_M = {"hip": 0.080, "knee": 0.051, "ankle": 0.032, "shoulder": 0.046, "elbow": 0.036, "wrist": 0.025}
# The joints of human23 whose segments make up a body part.
_SEGMENTS = {
    **{"head": ("atlantal",), "trunk": ("pelvis", "lumbar", "thorax")},
    **{"upper_arm": ("shoulder",), "forearm": ("elbow",), "hand": ("wrist",)},
    **{"thigh": ("hip",), "shank": ("knee",), "foot": ("ankle",)},
}


class PersonShape:
    """Builds a person's solids from lengths in metres on a body 1.70 m tall, times `size`.

    Attributes:
        skeleton: the skeleton.
        size: the body's scale; 1 for 1.70 m.
        rest: positions of the joints at rest [J, 3], metres, the root in the origin.
        frames: the axes that carry the solids, so far.
        drawn: indices of the joints within fingers and toes, so far.
        thumbs: whether the skeleton has thumbs of its own.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        self.size = (skeleton.height or extent(skeleton)) / human23().height
        self.rest = skeleton.rest[: len(skeleton)]
        self.frames = list(joint_frames(skeleton))
        self.drawn: set[int] = set()
        self.thumbs = any("thumb" in name.lower() for name in skeleton.names)

    def build(self) -> BodyShape:
        """Build the whole body."""
        solids = [*self._trunk(), *self._head()]
        for paint, outward in ((LEFT, 1.0), (RIGHT, -1.0)):
            solids += [*self._leg(paint, outward), *self._foot(paint, outward)]
            solids += [*self._arm(paint), *self._hand(paint, outward)]
        solids += self._further_joints()
        cones = tuple(solid for solid in solids if isinstance(solid, Cone))
        balls = tuple(solid for solid in solids if isinstance(solid, Ball))
        anatomy = anatomy_named("human23").joints
        masses = {
            part: sum(anatomy[joint].mass for joint in _SEGMENTS.get(re.sub("^(left|right)_", "", part), ()))
            for part in (solid.part for solid in solids)
        }
        return BodyShape(self.skeleton, tuple(self.frames), cones, balls, self.size, masses)

    def _trunk(self) -> Iterator[Cone | Ball]:
        lumbar, thorax = self._joint("lumbar"), self._joint("thorax")
        hips = self._offset("pelvis", "left_hip")[1]
        waist = float(np.linalg.norm(self._offset("lumbar", "thorax"))) / self.size
        chest = self._offset("thorax", "cervical") / self.size
        tall = float(np.linalg.norm(chest))
        between = self._halfway((lumbar, thorax), (lumbar, thorax))
        cervical, atlantal = self._joint("cervical"), self._joint("atlantal")
        ribs = self._halfway((thorax, cervical), (thorax, self.skeleton.parents[cervical]))
        yield self._ball(
            "trunk", MIDDLE, self._joint("pelvis"), (0.0, 0.4 * hips / self.size, 0.0), (0.140, 0.105, 0.105)
        )
        yield self._ball("trunk", MIDDLE, between, (0.0, -0.01, 0.0), (0.116, 0.5 * waist + 0.09, 0.086))
        yield self._ball("trunk", MIDDLE, ribs, as_point(-0.08 * chest), (0.138, 0.5 * tall + 0.035, 0.100))
        # Breastbone and navel distinguish the front of the trunk from its back.
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
        yield from self._limb(f"{side}_thigh", side, (hip, knee), (_RADII_M["hip"], _RADII_M["knee"]))
        yield from self._limb(f"{side}_shank", side, (knee, ankle), (_RADII_M["knee"], _RADII_M["ankle"]))
        length = float(np.linalg.norm(self._offset(f"{side}_knee", f"{side}_ankle"))) / self.size
        yield self._ball(
            f"{side}_shank",
            side,
            knee,
            (0.004 * outward, -0.32 * length, -0.022),
            (0.046, 0.3 * max(length, 0.1), 0.046),
        )
        # The kneecap lies half-way between the fronts of thigh and shank, and stands out as a blunt beak.
        bend = self._halfway((knee, knee), (hip, knee))
        yield self._cone(f"{side}_kneecap", MARK, bend, (0.0, 0.0, 0.030), 0.036, bend, (0.0, 0.0, 0.064), 0.022)

    def _foot(self, side: str, outward: float) -> Iterator[Cone | Ball]:
        """Yield a foot whose sole is level with the joints at its ball and with the tips, which are on the floor."""
        part, ankle, toes = f"{side}_foot", self._joint(f"{side}_ankle"), self._joint(f"{side}_toes")
        sole = self._offset(f"{side}_ankle", f"{side}_toes") / self.size
        heel = (0.0, float(sole[1]) + 0.026, -0.28 * max(float(sole[2]), 0.08))
        yield self._cone(part, side, ankle, (0.0, 0.0, 0.0), _RADII_M["ankle"], ankle, heel, 0.026)
        yield self._cone(part, side, ankle, (0.0, 0.0, 0.012), 0.030, toes, (0.0, 0.022, 0.0), 0.022)
        for x, share in ((-0.024, 1.0), (0.002, 0.85), (0.026, 0.65)):  # from the great toe to the little one
            ball = (x * outward, 0.020, 0.0)
            yield self._cone(part, side, ankle, heel, 0.026, toes, ball, 0.020)
            yield from self._ray(part, side, toes, ball, (0.020, 0.012), np.array([0.0, 0.0, 0.045]), share)

    def _arm(self, side: str) -> Iterator[Cone | Ball]:
        shoulder, elbow, wrist = (self._joint(f"{side}_{joint}") for joint in ("shoulder", "elbow", "wrist"))
        yield from self._limb(f"{side}_upper_arm", side, (shoulder, elbow), (_RADII_M["shoulder"], _RADII_M["elbow"]))
        yield from self._limb(f"{side}_forearm", side, (elbow, wrist), (_RADII_M["elbow"], _RADII_M["wrist"]))

    def _hand(self, side: str, outward: float) -> Iterator[Cone | Ball]:
        """Yield a flat hand with a thumb, to show which way the palm faces: down at rest, the thumb ahead."""
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
        beside: Point,
        radii: tuple[float, float],
        least: Floats,
        share: float = 1.0,
    ) -> Iterator[Cone]:
        """Yield a finger or toe from the joint `root` through the joints below it to the tip; metres on 1.70 m.

        It starts `beside` the joint and approaches the line of the joints. If the skeleton has no tip, or one nearer
        than `least` (some recordings mark only the knuckles), it ends at `least`. `share` shortens the last bone.
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
        end_step = tip * max(1.0 - radii[1] / reach, 0.0) if reach > 0.0 else tip
        # Beside the line of the joints, less so towards the tip; a toe lies its radius above the sole.
        nearer = np.stack([1.0 - 0.3 * shares, widths / radii[0], 1.0 - 0.3 * shares], axis=-1)
        points = np.array(beside) * nearer
        for i in range(len(chain)):
            end = chain[min(i + 1, len(chain) - 1)]
            last = points[i + 1] + (end_step if i == len(chain) - 1 else 0.0)
            yield self._cone(part, paint, chain[i], as_point(points[i]), widths[i], end, as_point(last), widths[i + 1])

    def _further_joints(self) -> Iterator[Cone]:
        """Yield thin limbs for joints beyond human23's at the ends of the body, such as those of single fingers."""
        known = set(human23().names)
        inner = {-1, *self.drawn}  # joints drawn already, or above one of human23's
        for joint in range(len(self.skeleton) - 1, -1, -1):
            if joint in inner or self.skeleton.names[joint] in known:
                inner |= {joint, self.skeleton.parents[joint]}
        paints, centre = sides_of(self.skeleton), (0.0, 0.0, 0.0)
        for joint in sorted(set(range(len(self.skeleton))) - inner):
            part, parent = self.skeleton.names[joint], self.skeleton.parents[joint]
            tip = as_point(self.skeleton.tips[joint] / self.size)
            yield self._cone(part, paints[joint], parent, centre, 0.013, joint, centre, 0.012)
            yield self._cone(part, paints[joint], joint, centre, 0.012, joint, tip, 0.009)

    def _limb(self, part: str, paint: str, ends: tuple[int, int], radii: tuple[float, float]) -> Iterator[Cone]:
        """Yield a limb from one joint to another, through all joints between them."""
        chain = [ends[1]]
        while chain[-1] != ends[0]:
            chain.append(self.skeleton.parents[chain[-1]])
        chain.reverse()
        shares = np.linspace(0.0, 1.0, len(chain))
        widths = radii[0] + shares * (radii[1] - radii[0])
        for i in range(len(chain) - 1):
            centre = (0.0, 0.0, 0.0)
            yield self._cone(part, paint, chain[i], centre, widths[i], chain[i + 1], centre, widths[i + 1])

    def _joint(self, name: str) -> int:
        return self.skeleton.index(name)

    def _offset(self, start: str, end: str) -> Floats:
        """Return the vector from one joint to another at rest [3], metres."""
        return np.asarray(self.rest[self._joint(end)] - self.rest[self._joint(start)])

    def _halfway(self, places: tuple[int, int], turns: tuple[int, int]) -> int:
        """Add a frame half-way between joints, and return its index."""
        self.frames.append(Frame(places, turns))
        return len(self.frames) - 1

    def _cone(
        self, part: str, paint: str, a_frame: int, a: Point, a_radius: float, b_frame: int, b: Point, b_radius: float
    ) -> Cone:
        size = self.size
        return Cone(
            part,
            paint,
            a_frame,
            as_point(size * np.array(a)),
            size * a_radius,
            b_frame,
            as_point(size * np.array(b)),
            size * b_radius,
        )

    def _ball(self, part: str, paint: str, frame: int, centre: Point, radii: Point) -> Ball:
        return Ball(part, paint, frame, as_point(self.size * np.array(centre)), as_point(self.size * np.array(radii)))
