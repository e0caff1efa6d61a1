"""Inverse kinematics: find the posture closest to a given one in which a joint is where the user drags it.

Standing feet stay, and nothing sinks into the floor; the dragged joint reaches its target as far as these allow; all
joints stay close to their angles at the start of the drag. Each step is a damped least-squares step on joint angles;
an angle that would exceed its limit stops there, and the others compensate. Sources: Wampler,
"Manipulator inverse kinematic solutions based on vector formulations and damped least-squares methods", IEEE
Transactions on Systems, Man and Cybernetics 16 (1986); for limits Baerlocher and Boulic, "An inverse kinematics
architecture enforcing an arbitrary number of strict priority levels", The Visual Computer 20 (2004). Unlike theirs,
our targets have weights, not strict priorities, which are unstable if a standing foot and limits leave no freedom.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.contact import contact_points, find_feet, heels_of
from motionmind.body.limbs import limb_of_points, limbs_of
from motionmind.body.motion import Posture
from motionmind.body.support import size_of
from motionmind.geometry import rotations as rot
from motionmind.studio.joint_angles import JointAngles

STANDS = 0.04  # metres: a sole point stands on the floor below this height, for a body of human size
SNAPS = 0.04  # metres: a joint dragged to within this of its height in a flat foot snaps the foot to the floor
FOOT = 0.12  # metres above the sole at rest, up to which a joint belongs to the foot
LEVEL = 0.02  # metres: heels that differ less in height rise together
SOLE = 0.03  # metres above a foot's lowest point at rest, up to which points belong to its sole
# Weights relative to the dragged joint: feet and floor, the same at the end, the pull back to the start.
_KEPT, _KEPT_AT_LAST, _PULL = 10.0, 100.0, 0.02
_JUDGED = 0.1  # factor of the feet's weight in the cost that accepts a step: the next step corrects a slight lift
_DAMPING = 0.01  # metres a radian: keeps a stretched limb from jerking
_ROUNDS, _SETTLING = 14, 14  # steps, at most, with the pull back to the start, then without
_TRIES = 6  # rounds, at most, to find the angles that stop at their limits in a step
_AT_REST, _SLOW, _SMALL = 1e-6, 1e-3, 1e-9  # end of steps: radians of a step, relative gain, gain in square metres
_CLEAR = 1e-4  # metres that a point may be below the floor
_STRIDE = 0.25  # metres of a step, at most, for a body of human size
_FURTHEST = 0.4  # radians of an angle in a step, at most
_TRUNK, _ROOT, _TRAVEL = 0.4, 0.25, 0.15  # mobility of trunk and root relative to limbs; of travel, metres a radian
_RISE = 2.0  # mobility of the body's rise with its heels, metres a radian


class Wishes(NamedTuple):
    """Target positions of points, each along one direction.

    Attributes:
        points: indices of the points [R].
        directions: unit vectors [R, 3].
        places: targets along these, metres [R].
    """

    points: Ints
    directions: Floats
    places: Floats

    def and_also(self, other: Wishes) -> Wishes:
        """Concatenate two sets of targets."""
        return Wishes(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


class _Problem(NamedTuple):
    """The least-squares problem of a drag: targets of feet and of the dragged joint, and the weights."""

    kept: Wishes
    wished: Wishes
    keeping: float
    pull: float


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


def place_of(posture: Posture, joint: str) -> Floats:
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
    kept, body = _Body(before).kept(None, None), _Body(posture)
    nothing = _heights(kept.points[:0], np.zeros(0))
    return body.solve(posture, kept, nothing, travels=True)


def put_on_floor(posture: Posture) -> Posture:
    """Return the posture lowered or raised to the floor, with the feet near the floor flat on it."""
    lowest = float(contact_points(posture.skeleton, posture.rotations, posture.root)[0][:, 1].min())
    down = Posture(posture.skeleton, posture.rotations, posture.root - np.array([0.0, lowest, 0.0]))
    body = _Body(down)
    near = [sole for sole in body.soles.values() if body.began[sole, 1].min() <= FOOT * body.size]
    if not near:
        return down
    points = np.concatenate(near)
    flat = _heights(points, np.zeros(len(points)))
    nothing = _heights(points[:0], np.zeros(0))
    return body.solve(down, flat, nothing, travels=True)


class _Body:
    """A body at the start of a drag: its angles, its contact points, and their derivatives."""

    def __init__(self, start: Posture) -> None:
        self.skeleton = skeleton = start.skeleton
        self.size, self.start = size_of(skeleton), start
        self.angles = JointAngles(skeleton, start.rotations[None])
        self.home = self.angles.of(start.rotations)
        count = len(skeleton)
        upright = np.tile(rot.IDENTITY, (count, 1))
        at_rest, joints = contact_points(skeleton, upright, np.zeros(3))
        self.began = contact_points(skeleton, start.rotations, start.root)[0]
        # Segments: from each joint's parent to the joint, then from joints to their contact points.
        self.segments = np.concatenate([skeleton.offsets, at_rest[count:] - at_rest[joints[count:]]])
        self.above = np.concatenate([skeleton.parents, joints[count:]])
        carries = self.angles.carries
        # The last point on the path to each point [P] that rotates around a joint [J]; the joint itself if none does.
        self.last = np.tile(np.arange(count), (len(joints), 1))
        for point, above in enumerate(self.above[1:], start=1):
            self.last[point] = np.where(carries[above], point, self.last[above])
        self.limbs = limbs_of(skeleton)
        self.heights = at_rest[:, 1]
        self.heels = {name: 2 * count + number for number, name in enumerate(heels_of(skeleton))}
        self.bottom = np.minimum(self.began[:, 1], 0.0)
        self.soles = self._soles(self.heights, limb_of_points(skeleton)[joints])
        readily = np.full((count, 3), _TRUNK)
        readily[[joint for limb in self.limbs for joint in limb]] = 1.0
        readily[0] = _ROOT
        self.readily = np.append(readily.reshape(-1), np.full(3, _TRAVEL * self.size))

    def _soles(self, heights: Floats, limb: Ints) -> dict[int, Ints]:
        """Return the points of each foot's sole, by the foot's last joint."""
        out = {}
        for leaf in find_feet(self.skeleton):
            points = np.flatnonzero(limb == limb[leaf])
            out[leaf] = points[heights[points] <= heights[points].min() + SOLE * self.size]
        return out

    def low(self, points: Ints) -> Bools:
        """Return which points stood on the floor at the start of the drag."""
        return np.asarray(self.began[points, 1] <= STANDS * self.size)

    def _foot_of(self, joint: int) -> int | None:
        """Return the last joint of a joint's foot; None if the joint is in no foot."""
        for limb in self.limbs:
            for leaf in set(limb) & set(self.soles):
                if joint in limb and self.above_sole(joint, leaf) <= FOOT * self.size:
                    return leaf
        return None

    def above_sole(self, joint: int, leaf: int) -> float:
        """Return the height of a joint above the sole of its foot at rest, metres."""
        return float(self.heights[joint] - self.heights[self.soles[leaf]].min())

    # --- wishes ---------------------------------------------------------------------------------------------------

    def kept(self, standing: Sequence[str] | None, dragged: int | None) -> Wishes:
        """Return the targets that hold standing feet in place."""
        own = None if dragged is None else self._foot_of(dragged)
        names = self.skeleton.names
        feet = [leaf for leaf in self.soles if leaf != own and (standing is None or names[leaf] in standing)]
        points = [self.soles[leaf] for leaf in feet]
        if standing is None:
            points = [sole[self.low(sole)] for sole in points]
        chosen = np.concatenate([np.zeros(0, dtype=np.int64), *points])
        return self._where_they_were(chosen)

    def rise(self, standing: Sequence[str] | None, heel: int, place: Floats) -> tuple[Wishes, Wishes]:
        """Return the targets that hold the balls of feet in place, and those for the height of a heel.

        Other heels at the same height follow, and the body rises rather than bend its knees, unless another foot on the
        floor does not follow. The heel of a foot that does not stand is dragged like any other point.
        """
        soles = self.kept(standing, None).points[::3]
        high = self.began[heel, 1]
        feet = [sole for sole in self.soles.values() if np.isin(sole, soles).any()]
        heels = [one for one in self.heels.values() if abs(self.began[one, 1] - high) <= LEVEL * self.size]
        heels = [one for one in heels if any(one in sole for sole in feet)]
        kept = self._where_they_were(soles[~np.isin(soles, [heel, *heels])])
        if heel not in heels:
            return kept, Wishes(np.full(3, heel), np.eye(3), place)
        if all(np.isin(sole, heels).any() for sole in self.soles.values() if self.low(sole).any()):
            self.readily[-2] = _RISE * self.size
        return kept, _heights(np.array(heels), np.full(len(heels), place[1]))

    def _where_they_were(self, points: Ints) -> Wishes:
        """Return the targets that hold points where they were at the start of the drag."""
        return Wishes(np.repeat(points, 3), np.tile(np.eye(3), (len(points), 1)), self.began[points].reshape(-1))

    def wished(self, dragged: int, place: Floats) -> Wishes:
        """Return the targets for a dragged joint; near the floor, its foot is put down flat."""
        leaf = self._foot_of(dragged)
        whole = Wishes(np.full(3, dragged), np.eye(3), np.asarray(place, dtype=np.float64))
        if leaf is None:
            return whole
        sole = self.soles[leaf]
        if place[1] > self.above_sole(dragged, leaf) + SNAPS * self.size:
            return whole
        level = Wishes(whole.points[::2], whole.directions[::2], whole.places[::2])
        return level.and_also(_heights(sole, np.zeros(len(sole))))

    # --- steps ----------------------------------------------------------------------------------------------------

    def solve(self, posture: Posture, kept: Wishes, wished: Wishes, *, travels: bool) -> Posture:
        """Return the posture that meets two sets of targets.

        Args:
            posture: the posture to begin with.
            kept: targets with the greater weight.
            wished: targets with the smaller weight.
            travels: whether the root may move.
        """
        here = np.append(self.angles.of(posture.rotations).reshape(-1), posture.root)
        self.mobile = np.append(self.angles.free.reshape(-1), np.full(3, travels))
        for keeping, pull, rounds in ((_KEPT, _PULL, _ROUNDS), (_KEPT_AT_LAST, 0.0, _SETTLING)):
            problem = _Problem(kept, wished, keeping, pull)
            here = self._descend(here, problem, rounds)
        return Posture(self.skeleton, rot.normalise(self.angles.rotations(here[:-3].reshape(-1, 3))), here[-3:])

    def _descend(self, here: Floats, problem: _Problem, rounds: int) -> Floats:
        """Reduce the weighted sum of squares from the angles and root `here` [D]; return new ones [D]."""
        damping, moving = _DAMPING, self._slopes(here)
        cost = self._cost(here, moving[0], problem)
        for _ in range(rounds):
            ahead = here + self._step(here, moving, problem, damping)
            step = np.append(self.angles.within(ahead[:-3].reshape(-1, 3)).reshape(-1), ahead[-3:]) - here
            found = self._slopes(here + step)
            less = self._cost(here + step, found[0], problem)
            if less <= cost:
                rests = np.abs(step).max() < _AT_REST or less > (1.0 - _SLOW) * cost - _SMALL
                here, moving, cost, damping = here + step, found, less, max(0.3 * damping, _DAMPING)
                if rests:
                    break
            else:
                damping *= 6.0
        return here

    def _cost(self, here: Floats, places: Floats, problem: _Problem) -> float:
        """Return the weighted sum of squares."""
        sunk = np.minimum(places[:, 1] - self.bottom, 0.0)
        kept = float(np.sum(_missed(problem.kept, places) ** 2) + sunk @ sunk)
        back = self._back(here) * self.mobile
        wished = float(np.sum(_missed(problem.wished, places) ** 2))
        return float((_JUDGED * problem.keeping) ** 2 * kept + wished + problem.pull**2 * (back @ back))

    def _back(self, here: Floats) -> Floats:
        """Return the displacement back to the starting angles and root [D], divided by their mobility.

        An unlimited angle goes back the short way round.
        """
        way = self.home - here[:-3].reshape(-1, 3)
        way = np.where(np.isfinite(self.angles.least), way, np.angle(np.exp(1j * way)))
        return np.asarray(np.append(way.reshape(-1), self.start.root - here[-3:]) / self.readily)

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
        (places, slopes), (kept, wished, keeping, pull) = moving, problem
        angles = here[:-3].reshape(-1, 3)
        least = np.append((self.angles.least - angles).reshape(-1), np.full(3, -np.inf))
        most = np.append((self.angles.most - angles).reshape(-1), np.full(3, np.inf))
        back = self._back(here)
        step, stopped = np.zeros(len(back)), ~self.mobile
        sunk = places[:, 1] < self.bottom - _CLEAR
        rows = [self._rows(wishes, places, slopes) for wishes in (kept, wished)]
        for _ in range(_TRIES):
            floor = np.flatnonzero(sunk)
            first, second, third = *rows, (self.bottom[floor] - places[floor, 1], slopes[floor, 1])
            missed = np.concatenate([keeping * first[0], second[0], keeping * third[0]])
            turns = np.concatenate([keeping * first[1], second[1], keeping * third[1]])
            free = ~stopped
            mine = turns[:, free] * self.readily[free]
            square = mine.T @ mine + (damping**2 + pull**2) * np.eye(mine.shape[1])
            right = mine.T @ (missed - turns[:, stopped] @ step[stopped]) + pull**2 * back[free]
            step[free] = self.readily[free] * np.linalg.solve(square, right)
            step *= min(1.0, _FURTHEST / max(np.abs(step).max(), 1e-12))
            over = free & ((step < least) | (step > most))
            falling = places[:, 1] + slopes[:, 1] @ step < self.bottom - _CLEAR
            if not over.any() and not (falling & ~sunk).any():
                break
            step[over] = np.clip(step, least, most)[over]
            stopped |= over
            sunk |= falling
        return np.clip(step, least, most)

    def _rows(self, wishes: Wishes, places: Floats, slopes: Floats) -> tuple[Floats, Floats]:
        """Return the residuals of targets [R], at most `_STRIDE`, and their derivatives [R, D]."""
        missed = _missed(wishes, places)
        far = np.abs(missed).max(initial=0.0)
        missed = missed * min(1.0, _STRIDE * self.size / max(far, 1e-12))
        return missed, np.einsum("rx,rxd->rd", wishes.directions, slopes[wishes.points])


def _heights(points: Ints, heights: Floats) -> Wishes:
    """Return targets for the heights [R] of points [R]."""
    return Wishes(points, np.tile([0.0, 1.0, 0.0], (len(points), 1)), heights)


def _missed(wishes: Wishes, places: Floats) -> Floats:
    """Return the residuals of targets [R], metres, for points at `places` [P, 3]."""
    return np.asarray(wishes.places - np.sum(wishes.directions * places[wishes.points], axis=-1))
