"""Inverse kinematics: find the joint angles that bring points of a body to target positions.

One solver serves all clients. It minimises a weighted sum of squares by damped least-squares steps on joint angles. An
angle stops at its limit, a sinking point at the floor, and the others compensate.

Sources: Wampler, "Manipulator inverse kinematic solutions based on vector formulations and damped least-squares
methods", IEEE Transactions on Systems, Man and Cybernetics 16 (1986).
For limits: Baerlocher and Boulic, "An inverse kinematics architecture enforcing an arbitrary number of strict priority
levels", The Visual Computer 20 (2004). Targets here have weights: strict priorities, as in that paper, are unstable if
a standing foot and limits leave no freedom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.contact import contact_points
from motionmind.body.joint_angles import JointAngles
from motionmind.body.motion import Posture
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import size_of
from motionmind.geometry import rotations as rot

IK_DAMPING_M = 0.01  # metres per radian: keeps a stretched limb from jerking
MAX_SINK_M = 1e-4  # depth of a point below the floor


class Targets(NamedTuple):
    """Target positions of points, each along one direction.

    Attributes:
        points: indices of the points [R], as of `motionmind.body.contact.contact_points`.
        directions: unit vectors [R, 3].
        places: targets along these, metres [R].
    """

    points: Ints
    directions: Floats
    places: Floats

    def and_also(self, other: Targets) -> Targets:
        """Concatenate two sets of targets."""
        return Targets(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))

    def residuals(self, places: Floats) -> Floats:
        """Return the residuals [R], metres, for points at `places` [P, 3]."""
        return np.asarray(self.places - np.sum(self.directions * places[self.points], axis=-1))


def positions(points: Ints, places: Floats) -> Targets:
    """Return targets for the positions [R, 3] of points [R]."""
    return Targets(np.repeat(points, 3), np.tile(np.eye(3), (len(points), 1)), places.reshape(-1))


def heights(points: Ints, places: Floats) -> Targets:
    """Return targets for the heights [R] of points [R]."""
    return Targets(points, np.tile([0.0, 1.0, 0.0], (len(points), 1)), places)


class Pass(NamedTuple):
    """A series of steps with the same weights, relative to those of the wished targets.

    Attributes:
        keeping: weight of kept targets and the floor.
        pull: weight of the angles at the start, metres per radian.
        steps: the largest number of steps.
    """

    keeping: float
    pull: float
    steps: int


@dataclass(frozen=True)
class Freedom:
    """The unknowns that a body may change: D = 3 J + 3, which are three angles of each joint, then the root's position.

    Attributes:
        mobile: whether each unknown may change [D].
        mobility: how readily it changes, relative to a limb's angle [D]; for the root, metres per radian.
        floor: height below which each point may not sink, metres [P].
    """

    mobile: Bools
    mobility: Floats
    floor: Floats


class _Problem(NamedTuple):
    """The least-squares problem of a pass."""

    kept: Targets
    wished: Targets
    freedom: Freedom
    keeping: float
    pull: float


class Solver:
    """Inverse kinematics of a body near a starting posture: its angles, its points, and their derivatives."""

    def __init__(self, start: Posture, angles: JointAngles) -> None:
        """Set up the body.

        Args:
            start: the posture to stay close to.
            angles: parameters of its joints' rotations.
        """
        self.skeleton = skeleton = start.skeleton
        self.start, self.angles, self.size = start, angles, size_of(skeleton)
        self.home = angles.of(start.rotations)
        count = len(skeleton)
        self.at_rest, self.joints = contact_points(skeleton, np.tile(rot.IDENTITY, (count, 1)), np.zeros(3))
        # Segments: from each joint's parent to the joint, then from joints to their contact points.
        owners = self.joints[count:]
        self.segments = np.concatenate([skeleton.offsets, self.at_rest[count:] - self.at_rest[owners]])
        self.above = np.concatenate([skeleton.parents, owners])
        # The last point on the path to each point [P] that rotates around a joint [J]; the joint itself if none does.
        self.last = np.tile(np.arange(count), (len(self.joints), 1))
        for point, above in enumerate(self.above[1:], start=1):
            self.last[point] = np.where(angles.carries[above], point, self.last[above])

    def solve(
        self, posture: Posture, kept: Targets, wished: Targets, freedom: Freedom, passes: Sequence[Pass]
    ) -> Posture:
        """Return the posture that meets two sets of targets as far as possible.

        Args:
            posture: the posture to begin with.
            kept: targets with the weight `keeping` of a pass.
            wished: targets with weight 1.
            freedom: what may move.
            passes: the weights and numbers of steps, one pass after another.
        """
        here = np.append(self.angles.of(posture.rotations).reshape(-1), posture.root)
        for keeping, pull, steps in passes:
            here = self._descend(here, _Problem(kept, wished, freedom, keeping, pull), steps)
        return Posture(self.skeleton, rot.normalise(self.angles.rotations(here[:-3].reshape(-1, 3))), here[-3:])

    def _descend(self, here: Floats, problem: _Problem, steps: int) -> Floats:
        """Reduce the weighted sum of squares from the angles and root `here` [D]; return new ones [D]."""
        damping, moving = IK_DAMPING_M, self._slopes(here)
        cost = self._cost(here, moving[0], problem)
        for _ in range(steps):
            ahead = here + self._step(here, moving, problem, damping)
            step = np.append(self.angles.within(ahead[:-3].reshape(-1, 3)).reshape(-1), ahead[-3:]) - here
            found = self._slopes(here + step)
            less = self._cost(here + step, found[0], problem)
            if less <= cost:
                # Ends at a step of 1e-6 radians, or a gain of 0.1 % and 1e-9 square metres.
                rests = np.abs(step).max() < 1e-6 or less > (1.0 - 1e-3) * cost - 1e-9
                here, moving, cost, damping = here + step, found, less, max(0.3 * damping, IK_DAMPING_M)
                if rests:
                    break
            else:
                damping *= 6.0
        return here

    def _cost(self, here: Floats, places: Floats, problem: _Problem) -> float:
        """Return the weighted sum of squares that accepts a step."""
        freedom = problem.freedom
        sunk = np.minimum(places[:, 1] - freedom.floor, 0.0)
        kept = float(np.sum(problem.kept.residuals(places) ** 2) + sunk @ sunk)
        back = self._back(here, freedom) * freedom.mobile
        wished = float(np.sum(problem.wished.residuals(places) ** 2))
        # Kept targets weigh less than in a step: the next step corrects a slight lift.
        return float((0.1 * problem.keeping) ** 2 * kept + wished + problem.pull**2 * (back @ back))

    def _back(self, here: Floats, freedom: Freedom) -> Floats:
        """Return the displacement back to the starting angles and root [D], divided by their mobility.

        An unlimited angle goes back the short way round.
        """
        back = self.home - here[:-3].reshape(-1, 3)
        back = np.where(np.isfinite(self.angles.least), back, np.angle(np.exp(1j * back)))
        return np.asarray(np.append(back.reshape(-1), self.start.root - here[-3:]) / freedom.mobility)

    def _slopes(self, here: Floats) -> tuple[Floats, Floats]:
        """Return the positions of all points [P, 3] and their derivatives by angles and root [P, 3, D]."""
        angles, root = here[:-3].reshape(-1, 3), here[-3:]
        turned, axes = self.angles.turns(angles)
        bones = rot.mul_vec(turned[np.maximum(self.above, 0)], self.segments)
        places = np.empty_like(bones)
        places[0] = root
        for point, above in enumerate(self.above[1:], start=1):
            places[point] = places[above] + bones[point]
        levers = places[self.last] - places[: len(self.skeleton)]
        slopes = np.empty((len(places), 3, axes.size // 3 + 3))
        across = rot.cross(axes[None], levers[:, :, None, :])
        slopes[..., :-3] = np.moveaxis(across.reshape(len(places), -1, 3), -1, 1)
        slopes[..., -3:] = np.eye(3)
        return places, slopes

    def _step(self, here: Floats, moving: tuple[Floats, Floats], problem: _Problem, damping: float) -> Floats:
        """Return the step [D] of angles and root; angles stop at limits, and points do not sink into the floor."""
        (places, slopes), (kept, wished, freedom, keeping, pull) = moving, problem
        angles, bottom, mobility = here[:-3].reshape(-1, 3), freedom.floor, freedom.mobility
        least = np.append((self.angles.least - angles).reshape(-1), np.full(3, -np.inf))
        most = np.append((self.angles.most - angles).reshape(-1), np.full(3, np.inf))
        back = self._back(here, freedom)
        step, stopped = np.zeros(len(back)), ~freedom.mobile
        sunk = places[:, 1] < bottom - MAX_SINK_M
        rows = [self._rows(targets, places, slopes) for targets in (kept, wished)]
        for _ in range(6):  # tries to find the angles that stop at their limits
            floor = np.flatnonzero(sunk)
            first, second, third = *rows, (bottom[floor] - places[floor, 1], slopes[floor, 1])
            missed = np.concatenate([keeping * first[0], second[0], keeping * third[0]])
            turns = np.concatenate([keeping * first[1], second[1], keeping * third[1]])
            free = ~stopped
            mine = turns[:, free] * mobility[free]
            square = mine.T @ mine + (damping**2 + pull**2) * np.eye(mine.shape[1])
            right = mine.T @ (missed - turns[:, stopped] @ step[stopped]) + pull**2 * back[free]
            step[free] = mobility[free] * np.linalg.solve(square, right)
            step *= min(1.0, 0.4 / max(np.abs(step).max(), 1e-12))  # at most 0.4 radians (metres) a step
            over = free & ((step < least) | (step > most))
            falling = places[:, 1] + slopes[:, 1] @ step < bottom - MAX_SINK_M
            if not over.any() and not (falling & ~sunk).any():
                break
            step[over] = np.clip(step, least, most)[over]
            stopped |= over
            sunk |= falling
        return np.clip(step, least, most)

    def _rows(self, targets: Targets, places: Floats, slopes: Floats) -> tuple[Floats, Floats]:
        """Return the residuals of targets [R] and their derivatives [R, D].

        Residuals are scaled down to at most 0.25 m for a body of human size.
        """
        missed = targets.residuals(places)
        far = np.abs(missed).max(initial=0.0)
        missed = missed * min(1.0, 0.25 * self.size / max(far, 1e-12))
        return missed, np.einsum("rx,rxd->rd", targets.directions, slopes[targets.points])


# --- one joint of a limb ----------------------------------------------------------------------------------------------


def chain_to(skeleton: Skeleton, joint: int) -> list[int]:
    """Return the joints of a joint's limb that lead to it, outward; if it begins no limb, all joints before it.

    A limb ends where another hangs from the same joint. Fingers and helpers are too short to be limbs.
    """
    lengths = np.linalg.norm(skeleton.offsets, axis=1)
    reaches = np.zeros(len(skeleton))  # longest path along the bones from a joint outward
    for child in range(len(skeleton) - 1, 0, -1):
        parent = skeleton.parents[child]
        reaches[parent] = max(reaches[parent], lengths[child] + reaches[child])
    limb: list[int] = []
    below, at = joint, skeleton.parents[joint]
    while at >= 0:
        others = [lengths[child] + reaches[child] for child in skeleton.children(at) if child != below]
        if max(others, default=0.0) >= 0.2 * reaches[0]:  # as long as a limb
            break
        limb.insert(0, at)
        below, at = at, skeleton.parents[at]
    if not limb:
        while (joint := skeleton.parents[joint]) >= 0:
            limb.insert(0, joint)
    return limb


def reach(skeleton: Skeleton, rotations: Floats, root: Floats, joint: int, place: Floats) -> Floats:
    """Return local rotations [J, 4] with one joint as close to a position as its limb (`chain_to`) reaches.

    Only the limb turns, about any axis and without limits; the root stays.

    Args:
        skeleton: the body.
        rotations: local rotations [J, 4].
        root: position of the root [3], metres.
        joint: the joint.
        place: target position [3], metres.
    """
    chain, out = chain_to(skeleton, joint), rotations.copy()
    if not chain or np.linalg.norm(skeleton.positions(rotations, root)[joint] - place) < 1e-6:
        return out
    start = Posture(skeleton, rotations, root)
    solver = Solver(start, JointAngles(skeleton, rotations[None], anatomical=False))
    mobile = np.append(np.isin(np.arange(len(skeleton)), chain).repeat(3), np.zeros(3, dtype=np.bool_))
    freedom = Freedom(mobile, np.ones(len(mobile)), np.full(len(solver.joints), -np.inf))
    target, none = positions(np.array([joint]), place), positions(np.zeros(0, dtype=np.int64), np.zeros(0))
    out[chain] = solver.solve(start, none, target, freedom, [Pass(0.0, 0.0, 60)]).rotations[chain]
    return out
