"""Joint angles as parameters of a posture: anatomical angles within limits, or free rotations from a posture.

A body with an anatomy has anatomical angles (`motionmind.body.anatomy`): a knee only bends, so it never turns aside.
Limits are widened to the edited posture, because dancers exceed the tables. The joints of any other body turn freely
about three axes.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.anatomy_file import anatomy_of
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot


class JointAngles:
    """The angles of a body's joints, radians, and their limits around given postures.

    Attributes:
        skeleton: the body.
        free: which angles can change [J, 3].
        least, most: their limits [J, 3].
        swings: which angles belong to the swing, not the twist [J, 3].
        frames: the joint in whose frame each joint's angles are measured [J]; -1 for the world.
    """

    def __init__(self, skeleton: Skeleton, given: Floats, *, anatomical: bool = True) -> None:
        """Set up the angles around postures.

        Args:
            skeleton: the body.
            given: local rotations [G, J, 4] of postures, to which the limits are widened; joints without an anatomy
                turn from their rotations in the first.
            anatomical: whether joints have the angles and limits of the body's anatomy, if it has one.
        """
        self.skeleton = skeleton
        self._anatomy, self._rest = anatomy_of(skeleton) if anatomical else None, given[0]
        self.frames: Ints = np.array(skeleton.parents)
        self.swings: Bools = np.ones((len(skeleton), 3), dtype=np.bool_)
        if self._anatomy is None:
            self.free: Bools = np.ones((len(skeleton), 3), dtype=np.bool_)
            self.least, self.most = np.full((len(skeleton), 3), -np.inf), np.full((len(skeleton), 3), np.inf)
            return
        for joint, name in enumerate(skeleton.names):
            described = self._anatomy.anatomy(name)[1]
            self.swings[joint, "xyz".index(described.long)] = False
            if described.against:
                self.frames[joint] = skeleton.index(described.against)
        angles = self.of(given)
        least, most = np.radians(self._anatomy.limits)
        self.free = np.isfinite(least)
        unlimited = most - least >= 2.0 * np.pi - 1e-9  # a full turn
        self.least = np.where(unlimited, -np.inf, np.minimum(least, angles.min(axis=0)))
        self.most = np.where(unlimited, np.inf, np.maximum(most, angles.max(axis=0)))

    def of(self, rotations: Floats) -> Floats:
        """Return the angles [..., J, 3] of local rotations [..., J, 4]: the inverse of `rotations`."""
        if self._anatomy is None:
            return rot.log(rot.inv_mul(self._rest, rotations))
        return np.radians(self._anatomy.degrees(rotations))

    def within(self, angles: Floats) -> Floats:
        """Clip angles [J, 3] to their limits, and swings to half a turn, beyond which they mean another rotation."""
        angles = np.clip(angles, self.least, self.most)
        swing = rot.norm(np.where(self.swings, angles, 0.0))[:, None]
        most = np.pi - 1e-6  # radians
        return np.where(self.swings & (swing > most), angles * (most / np.maximum(swing, most)), angles)

    def rotations(self, angles: Floats) -> Floats:
        """Return local rotations [..., J, 4] of angles [..., J, 3]."""
        if self._anatomy is None:
            return rot.mul(self._rest, rot.exp(angles))
        flat = np.degrees(angles).reshape(-1, len(self.skeleton), 3)
        named = {name: flat[:, joint] for joint, name in enumerate(self.skeleton.names)}
        return self._anatomy.rotations(named).reshape(*angles.shape[:-1], 4)

    def turns(self, angles: Floats) -> tuple[Floats, Floats]:
        """Return the global rotations [J, 4] of angles [J, 3], and the axis of each angle [J, 3, 3].

        Axes are in world coordinates; their length is the joint's rotation in radians per radian of the angle.
        """
        small = 1e-6  # radians of the finite differences
        steps = np.concatenate([np.zeros((1, 3)), small * np.eye(3)])
        turned = self.skeleton.global_rotations(self.rotations(angles + steps[:, None, :]))
        frames = np.where((self.frames >= 0)[:, None], turned[:, self.frames], rot.IDENTITY)
        own = rot.inv_mul(frames, turned)
        axes = rot.mul_vec(frames[0], rot.log(rot.mul_inv(own[1:], own[0])) / small)
        return turned[0], np.swapaxes(axes, 0, 1)

    @cached_property
    def carries(self) -> Bools:
        """Whether joint i's rotation turns joint j [J, J]: `carries[j, i]` for j = i and all descendants j."""
        count = len(self.skeleton)
        out = np.eye(count, dtype=np.bool_)
        for joint in range(1, count):
            out[joint] |= out[self.frames[joint]]
        return out
