"""Dragging: find the posture closest to a given one in which a joint is where the user drags it.

Standing feet stay, and nothing sinks into the floor; the dragged joint reaches its target as far as these allow; all
joints stay close to their angles at the start of the drag. `motionmind.body.ik` solves for the angles.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.contact import contact_points, find_feet, heels_of
from motionmind.body.ik import Freedom, Pass, Solver, Targets, heights, positions
from motionmind.body.joint_angles import JointAngles
from motionmind.body.limbs import limb_of_points, limbs_of
from motionmind.body.motion import Posture

# Lengths of a body of human size.
NEAR_FLOOR_M = 0.04  # sole points below stand on the floor; a flat foot dragged below it snaps there
FOOT_HEIGHT_M = 0.12  # above the sole at rest, up to which a joint belongs to the foot
# First with a pull back to the start, then without.
_PASSES = (Pass(keeping=10.0, pull=0.02, steps=14), Pass(keeping=100.0, pull=0.0, steps=14))
_NONE = positions(np.zeros(0, dtype=np.int64), np.zeros(0))


def drag(
    posture: Posture, joint: str, place: Floats, *, start: Posture | None = None, standing: Sequence[str] | None = None
) -> Posture:
    """Return the posture with a joint at a target position, or as close to it as the body reaches.

    Args:
        posture: the posture to begin with.
        joint: the joint to drag, or a heel, "left_heel". The heel of a standing foot rises and sinks over the ball,
            which stays; other heels at the same height follow.
        place: target position [3], metres.
        start: the posture when the drag began, which joints stay close to; `posture` by default.
        standing: the last joints of the feet that stay as in `start`; None for all feet that stand there. The foot of
            the dragged joint never stays.

    Raises:
        SkeletonError: there is no such joint or heel.
    """
    start = posture if start is None else start
    body = _Body(start)
    if joint in body.heels:
        kept, wished = body.rise(standing, body.heels[joint], np.asarray(place, dtype=np.float64))
        return body.solve(posture, kept, wished, travels=len(kept.points) > 0)
    dragged = posture.skeleton.index(joint)
    kept, wished = body.kept(standing, dragged), body.wished(dragged, place)
    return body.solve(posture, kept, wished, travels=len(kept.points) > 0 or dragged == 0)


def position_of(posture: Posture, joint: str) -> Floats:
    """Return the position of a joint or a heel [3], metres; raise SkeletonError if there is none."""
    points, heels = contact_points(posture.skeleton, posture.rotations, posture.root)[0], [*heels_of(posture.skeleton)]
    number = 2 * len(posture.skeleton) + heels.index(joint) if joint in heels else posture.skeleton.index(joint)
    return np.asarray(points[number])


def standing_feet(posture: Posture) -> list[str]:
    """Return the last joints of the feet that stand on the floor."""
    body = _Body(posture)
    return [posture.skeleton.names[leaf] for leaf, sole in body.soles.items() if body.low(sole).any()]


def standing_soles(posture: Posture) -> Ints:
    """Return the sole points that stand on the floor, as indices into `motionmind.body.contact.contact_points`."""
    return _Body(posture).kept(None, None).points[::3]


def plant(posture: Posture, before: Posture) -> Posture:
    """Return the posture with the soles where they stand in another posture of the same body."""
    return _Body(posture).solve(posture, _Body(before).kept(None, None), _NONE, travels=True)


def put_on_floor(posture: Posture) -> Posture:
    """Return the posture lowered or raised to the floor, with the feet near the floor flat on it."""
    lowest = float(contact_points(posture.skeleton, posture.rotations, posture.root)[0][:, 1].min())
    down = Posture(posture.skeleton, posture.rotations, posture.root - np.array([0.0, lowest, 0.0]))
    body = _Body(down)
    near = [sole for sole in body.soles.values() if body.began[sole, 1].min() <= FOOT_HEIGHT_M * body.size]
    if not near:
        return down
    points = np.concatenate(near)
    return body.solve(down, heights(points, np.zeros(len(points))), _NONE, travels=True)


class _Body:
    """A body at the start of a drag: its solver, its feet, and what moves how readily."""

    def __init__(self, start: Posture) -> None:
        self.skeleton = skeleton = start.skeleton
        self.solver = Solver(start, JointAngles(skeleton, start.rotations[None]))
        self.size, self.heights = self.solver.size, self.solver.at_rest[:, 1]
        self.began = contact_points(skeleton, start.rotations, start.root)[0]
        self.limbs = limbs_of(skeleton)
        self.heels = {name: 2 * len(skeleton) + number for number, name in enumerate(heels_of(skeleton))}
        self.soles = self._soles(limb_of_points(skeleton)[self.solver.joints])
        angles = np.full((len(skeleton), 3), 0.4)  # trunk
        angles[[joint for limb in self.limbs for joint in limb]] = 1.0
        angles[0] = 0.25
        self.mobility = np.append(angles.reshape(-1), np.full(3, 0.15 * self.size))

    def _soles(self, limb: Ints) -> dict[int, Ints]:
        """Return the points of each foot's sole, by the foot's last joint: up to 3 cm above its lowest at rest."""
        out = {}
        for leaf in find_feet(self.skeleton):
            points = np.flatnonzero(limb == limb[leaf])
            out[leaf] = points[self.heights[points] <= self.heights[points].min() + 0.03 * self.size]
        return out

    def low(self, points: Ints) -> Bools:
        """Return which points stood on the floor at the start of the drag."""
        return np.asarray(self.began[points, 1] <= NEAR_FLOOR_M * self.size)

    def _foot_of(self, joint: int) -> int | None:
        """Return the last joint of a joint's foot; None if the joint is in no foot."""
        for limb in self.limbs:
            for leaf in set(limb) & set(self.soles):
                if joint in limb and self.above_sole(joint, leaf) <= FOOT_HEIGHT_M * self.size:
                    return leaf
        return None

    def above_sole(self, joint: int, leaf: int) -> float:
        """Return the height of a joint above the sole of its foot at rest, metres."""
        return float(self.heights[joint] - self.heights[self.soles[leaf]].min())

    # --- targets --------------------------------------------------------------------------------------------------

    def kept(self, standing: Sequence[str] | None, dragged: int | None) -> Targets:
        """Return the targets that hold standing feet in place."""
        own = None if dragged is None else self._foot_of(dragged)
        names = self.skeleton.names
        feet = [leaf for leaf in self.soles if leaf != own and (standing is None or names[leaf] in standing)]
        points = [self.soles[leaf] for leaf in feet]
        if standing is None:
            points = [sole[self.low(sole)] for sole in points]
        chosen = np.concatenate([np.zeros(0, dtype=np.int64), *points])
        return positions(chosen, self.began[chosen])

    def rise(self, standing: Sequence[str] | None, heel: int, place: Floats) -> tuple[Targets, Targets]:
        """Return the targets that hold the balls of feet in place, and those for the height of a heel.

        Other heels at the same height follow, and the body rises rather than bend its knees, unless another foot on the
        floor does not follow. The heel of a foot that does not stand is dragged like any other point.
        """
        soles = self.kept(standing, None).points[::3]
        high = self.began[heel, 1]
        feet = [sole for sole in self.soles.values() if np.isin(sole, soles).any()]
        heels = [one for one in self.heels.values() if abs(self.began[one, 1] - high) <= 0.02 * self.size]
        heels = [one for one in heels if any(one in sole for sole in feet)]
        balls = soles[~np.isin(soles, [heel, *heels])]
        kept = positions(balls, self.began[balls])
        if heel not in heels:
            return kept, positions(np.array([heel]), place)
        if all(np.isin(sole, heels).any() for sole in self.soles.values() if self.low(sole).any()):
            self.mobility[-2] = 2.0 * self.size  # the body rises with its heels
        return kept, heights(np.array(heels), np.full(len(heels), place[1]))

    def wished(self, dragged: int, place: Floats) -> Targets:
        """Return the targets for a dragged joint; near the floor, its foot is put down flat."""
        leaf = self._foot_of(dragged)
        whole = positions(np.array([dragged]), np.asarray(place, dtype=np.float64))
        if leaf is None:
            return whole
        sole = self.soles[leaf]
        if place[1] > self.above_sole(dragged, leaf) + NEAR_FLOOR_M * self.size:
            return whole
        level = Targets(whole.points[::2], whole.directions[::2], whole.places[::2])
        return level.and_also(heights(sole, np.zeros(len(sole))))

    # --- solution -------------------------------------------------------------------------------------------------

    def solve(self, posture: Posture, kept: Targets, wished: Targets, *, travels: bool) -> Posture:
        """Return the posture that meets two sets of targets; the first has the greater weight.

        Args:
            posture: the posture to begin with.
            kept: targets of what stays.
            wished: targets of the drag.
            travels: whether the root may move.
        """
        mobile = np.append(self.solver.angles.free.reshape(-1), np.full(3, travels))
        freedom = Freedom(mobile, self.mobility, np.minimum(self.began[:, 1], 0.0))
        return self.solver.solve(posture, kept, wished, freedom, _PASSES)
