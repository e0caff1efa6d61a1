"""Standing feet: lock each to its place, moving legs and root little.

In a stance (`motionmind.clean.stances`) one point of a foot hardly moves: heel, ball or tip, one after another as it
rolls. The foot as a whole is displaced so that this point keeps its
place; over a stance its median is 0, and it fades out over the swing that follows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Indices, Ints
from motionmind.body.contact import pose
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import size_of
from motionmind.clean.stances import find_foot_stances
from motionmind.footing.feet import Foot, foot_points
from motionmind.footing.smoothing import smoothstep
from motionmind.geometry import rotations as rot
from motionmind.solver.kinematics import Freedom, body_of
from motionmind.solver.solve import Problem, solve
from motionmind.solver.terms import Contacts, Track

LOCKED_M = 1e-3  # how far the standing point of a locked foot may still move
MIN_SLIDE_M = 5e-4  # feet that slide by less are left alone
MAX_SLIDE_M = 0.05  # from its mean place: a foot that goes farther, slowly, is moved on purpose
FADES_S = 0.25
N_SOLVED_FRAMES = 2000  # solved at once
# Standard deviations: of a standing point, of other points of feet, of the root, and of a leg's angles.
_STANDS_M, _FOLLOWS_M, _ROOT_M, _LEG_RAD = 1e-4, 4e-3, 0.01, 0.15


class Contact(NamedTuple):
    """Frames in which a point of a foot stands.

    Attributes:
        foot: index of the foot.
        point: index of the point (`motionmind.body.contact.contact_points`).
        first: the first frame.
        last: the last frame.
        held: whether the point moves by LOCKED_M at most.
    """

    foot: int
    point: int
    first: int
    last: int
    held: bool


class Locked(NamedTuple):
    """A recording with its feet locked, and the contacts of its stances, in order of time."""

    motion: Motion
    contacts: list[Contact]


def lock_feet(motion: Motion) -> Locked:
    """Lock the standing feet of a recording, y up, to their places."""
    skeleton, size = motion.skeleton, size_of(motion.skeleton)
    posed, feet = find_foot_stances(motion)
    contacts: list[Contact] = []
    shifts = np.zeros((len(motion), len(feet), 3))
    for number, one in enumerate(feet):
        places = posed.places[:, one.points]
        shifts[:, number], found = _shift(places, one.speeds, one.stances, MAX_SLIDE_M * size, FADES_S * motion.fps)
        contacts += [Contact(number, int(one.points[point]), first, last, True) for point, first, last in found]
    if np.abs(shifts).max(initial=0.0) >= MIN_SLIDE_M * size:
        motion = _solve(motion, [one.foot for one in feet], posed.places, shifts, contacts)
    places = pose(skeleton, motion.rotations, motion.root).places
    return Locked(motion, sorted((_checked(one, places) for one in contacts), key=lambda one: (one.first, one.foot)))


def _checked(contact: Contact, places: Floats) -> Contact:
    """Return a contact with whether its point stays in place, given the positions of all points [T, P, 3]."""
    own = places[contact.first : contact.last + 1, contact.point]
    return contact._replace(held=bool(rot.norm(own - own.mean(axis=0)).max() <= LOCKED_M))


def _shift(
    places: Floats, speeds: Floats, stances: list[tuple[int, int]], most: float, fades: float
) -> tuple[Floats, list[tuple[int, int, int]]]:
    """Return the displacement of a foot [T, 3], metres, and its contacts: point, first and last frame.

    Args:
        places: of its points [T, Q, 3], metres.
        speeds: of its points [T, Q], m/s; points off the floor are faster than any foot.
        stances: of the foot.
        most: greatest displacement in a stance that is locked, metres.
        fades: frames in which a displacement fades out.
    """
    shift = np.zeros((len(places), 3))
    contacts: list[tuple[int, int, int]] = []
    locked: list[tuple[int, int]] = []
    for start, stop in stances:
        # From each frame to the next; of points that differ by less than 1 cm/s, the first.
        still = np.round(speeds[start : stop - 1] + speeds[start + 1 : stop], 2).argmin(axis=1)
        at = [0, *(np.flatnonzero(np.diff(still)) + 1).tolist(), len(still)]
        runs = [(int(still[a]), start + a, start + b) for a, b in pairwise(at)]
        own = np.zeros((stop - start, 3))
        for point, first, last in runs:
            moved = places[first : last + 1, point] - places[first, point]
            own[first - start : last + 1 - start] = own[first - start] - moved
        own -= np.median(own, axis=0)  # a foot that is locked already stays, whatever frames are beside its stance
        if rot.norm(own).max() <= most:
            shift[start:stop] = own
            contacts += runs
            locked.append((start, stop))
    _fade(shift, locked, fades)
    return shift, contacts


def _fade(shift: Floats, stances: list[tuple[int, int]], frames: float) -> None:
    """Fade a displacement [T, 3] out after each stance and in before it, within a number of frames, in place."""
    ends = [0, *(frame for stance in stances for frame in stance), len(shift)]
    for stop, start in zip(ends[::2], ends[1::2], strict=True):  # of swings
        if stop == start:
            continue
        steps = np.arange(1, start - stop + 1)
        over = min(frames, start - stop + 1)
        if stop > 0:
            shift[stop:start] += (1.0 - smoothstep(steps / over))[:, None] * shift[stop - 1]
        if start < len(shift):
            shift[stop:start] += (1.0 - smoothstep(steps[::-1] / over))[:, None] * shift[start]


def _solve(motion: Motion, feet: Sequence[Foot], places: Floats, shifts: Floats, contacts: Sequence[Contact]) -> Motion:
    """Move legs and root so that the points of feet, at `places` [T, P, 3], are displaced by `shifts` [T, feet, 3]."""
    skeleton, count = motion.skeleton, len(motion)
    size, body = size_of(skeleton), body_of(skeleton)
    freedom = _freedom(skeleton, feet, motion.rotations)
    stands = np.zeros((count, len(body.owners)), dtype=np.bool_)
    for one in contacts:
        stands[one.first : one.last + 1, one.point] = True
    points = [np.flatnonzero(foot_points(foot, body.owners, len(skeleton))) for foot in feet]
    which = np.concatenate(points)
    targets = places[:, which] + np.repeat(shifts, [len(own) for own in points], axis=1)
    sds = np.concatenate([np.full(3, _ROOT_M * size), np.full(len(freedom.joints), _LEG_RAD)])
    rotations, root = motion.rotations.copy(), motion.root.copy()
    for begin in range(0, count, N_SOLVED_FRAMES):  # frames do not depend on each other
        frames = slice(begin, min(begin + N_SOLVED_FRAMES, count))
        x = np.zeros((frames.stop - begin, freedom.unknowns))
        free = np.zeros(len(x), dtype=np.bool_)
        problem = Problem(body, freedom, motion.rotations[frames], motion.root[frames], free)
        held = _contacts(stands[frames][:, which], targets[frames], which, size)
        state = solve(problem, [Track(np.broadcast_to(sds, x.shape)), held], x)
        rotations[frames], root[frames] = state.rotations, state.root
    moved = np.unique(freedom.joints)
    out = motion.rotations.copy()
    out[:, moved] = rot.normalise(rotations[:, moved])
    return replace(motion, rotations=out, root=root)


def _contacts(stands: Bools, targets: Floats, points: Indices, size: float) -> Contacts:
    """Return the contacts of feet whose points [Q] have targets [N, Q, 3], metres, and stand in some frames [N, Q]."""
    count = len(stands)
    sds = np.where(stands, _STANDS_M, _FOLLOWS_M)[..., None] * np.full(3, size)
    frames: Ints = np.repeat(np.arange(count), len(points))
    none = np.zeros(0, dtype=np.int64)
    return Contacts(
        frames,
        np.tile(points, count),
        targets.reshape(-1, 3),
        sds.reshape(-1, 3),
        stands.reshape(-1),
        none,
        np.zeros((count - 1, 0, 2)),
        np.zeros((count - 1, 0)),
    )


def _freedom(skeleton: Skeleton, feet: Sequence[Foot], rotations: Floats) -> Freedom:
    """Return the degrees of freedom of legs, from thigh to ankle; a knee that turns about one axis stays a hinge."""
    joints: list[int] = []
    axes: list[Floats] = []
    for foot in feet:
        for joint in foot.leg[max(foot.knee - 1, 0) : foot.knee + 2]:
            turned = rot.log(rot.inv_mul(rotations[:1, joint], rotations[:, joint]))
            _, spread, directions = np.linalg.svd(turned, full_matrices=False)
            is_hinge = joint == foot.leg[foot.knee] and spread[0] > 0.0 and spread[1] < 0.2 * spread[0]
            own = directions[:1] if is_hinge else np.eye(3)
            joints += [joint] * len(own)
            axes.append(own)
    order = np.argsort(joints, kind="stable")
    return Freedom(np.array(joints, dtype=np.int64)[order], np.concatenate(axes)[order])
