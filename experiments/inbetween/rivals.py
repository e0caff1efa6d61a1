"""Other ways from posture A to posture B: interpolation, and segments of the corpus that are warped to fit.

Each way is given as local rotations [T, J, 4] and the root's positions [T, 3], metres, and has exactly A and B at its
ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionmind import Motion, Posture
from motionmind._typing import Floats, Ints
from motionmind.geometry import rotations as rot

Made = tuple[Floats, Floats]  # rotations [T, J, 4], root [T, 3]


@dataclass(frozen=True, eq=False)
class Ends:
    """What is known of a window: where it starts and ends, and how the body moves there, where that is known.

    Attributes:
        a: its first posture.
        b: its last posture.
        frames: steps from one to the other.
        before: the frames that lead up to A, which is their last; None if only A is known.
        after: the frames that follow B, which is their first; None if only B is known.
    """

    a: Posture
    b: Posture
    frames: int
    before: Motion | None = None
    after: Motion | None = None

    @property
    def share(self) -> Floats:
        """The share of the time that has passed at each frame [T, 1]."""
        return np.linspace(0.0, 1.0, self.frames + 1)[:, None]


# --- interpolation ----------------------------------------------------------------------------------------------------


def slerp(ends: Ends) -> Made:
    """Turn each joint the short way round at a constant speed."""
    return _eased(ends, ends.share)


def at_rest(ends: Ends) -> Made:
    """Turn each joint as SLERP does, from rest to rest: a rotation spline, where no velocity is known."""
    share = ends.share
    return _eased(ends, share**3 * (10.0 - 15.0 * share + 6.0 * share**2))


def _eased(ends: Ends, share: Floats) -> Made:
    a, b = ends.a, ends.b
    return rot.slerp(a.rotations[None], b.rotations[None], share), a.root + share * (b.root - a.root)


def hermite(ends: Ends) -> Made:
    """Join the ends by cubics with the velocities there; where B's is unknown, by those that do not bend there.

    Rotations are the Hermite quaternion curve of Kim, Kim and Shin, "A general construction scheme for unit quaternion
    curves with simple high order derivatives", SIGGRAPH (1995).
    """
    assert ends.before is not None
    a, b, s = ends.a, ends.b, ends.share
    across, way = rot.log(rot.inv_mul(a.rotations, b.rotations)), b.root - a.root
    turning, moving = _velocity(ends.before, -2, ends.frames)
    # A cubic from p to q that starts with v has no second derivative at q if it arrives there with (3 (q - p) - v) / 2.
    arriving, reaching = (3.0 * across - turning) / 2.0, (3.0 * way - moving) / 2.0
    if ends.after is not None:
        arriving, reaching = _velocity(ends.after, 0, ends.frames)
    first, last = rot.exp(turning / 3.0), rot.exp(arriving / 3.0)
    middle = rot.log(rot.inv_mul(first, rot.mul_inv(rot.inv_mul(a.rotations, b.rotations), last)))
    rising = [1.0 - (1.0 - s) ** 3, 3.0 * s**2 - 2.0 * s**3, s**3]  # cumulative Bernstein polynomials
    rotations = a.rotations
    for vector, share in zip((turning / 3.0, middle, arriving / 3.0), rising, strict=True):
        rotations = rot.mul(rotations, rot.exp(share[..., None] * vector))
    root = a.root + rising[1] * way + (s - 2.0 * s**2 + s**3) * moving + (s**3 - s**2) * reaching
    return rotations, root


def _velocity(motion: Motion, frame: int, frames: int) -> Made:
    """Velocities from a frame to the next: rotation vectors [J, 3] and metres [3] in the time of so many frames."""
    turn = rot.log(rot.inv_mul(motion.rotations[frame], motion.rotations[frame + 1]))
    return frames * turn, frames * (motion.root[frame + 1] - motion.root[frame])


# --- segments ---------------------------------------------------------------------------------------------------------


class Segments:
    """All segments of a length in some movement.

    Attributes:
        frames: steps in each.
        starts: where each starts in the movement [S].
    """

    frames: int
    starts: Ints

    def __init__(self, pieces: Sequence[Motion], frames: int) -> None:
        kept = [piece for piece in pieces if len(piece) > frames]
        begins = np.cumsum([0, *(len(piece) for piece in kept)])[:-1]
        self.frames = frames
        self.starts = np.concatenate(
            [np.zeros(0, np.int64), *(b + np.arange(len(p) - frames) for b, p in zip(begins, kept, strict=True))]
        ).astype(np.int64)
        if kept:
            self._rotations = np.concatenate([piece.rotations for piece in kept])
            self._root = np.concatenate([piece.root for piece in kept])
            ends = np.stack([self._rotations[self.starts], self._rotations[self.starts + frames]], axis=1)
            self._ends = _facing_ahead(ends)

    def nearest(self, ends: Ends, count: int) -> Made:
        """Return the mean of the segments whose ends are nearest to A and B, each warped to end there.

        Nearness is the squared distance of local rotations at both ends; where a segment faces does not matter. Its
        offsets from A and B are distributed along it in proportion to time.
        """
        sought = _facing_ahead(np.stack([ends.a.rotations, ends.b.rotations]))
        off = np.sum(1.0 - np.abs(np.einsum("sejk,ejk->sej", self._ends, sought)), axis=(1, 2))
        best = np.argsort(off, kind="stable")[:count]
        ways = [warped(*self._placed(int(self.starts[k]), ends.a), ends) for k in best]
        rotations = np.stack([way[0] for way in ways])
        side = np.where(np.sum(rotations * rotations[0], axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
        return rot.normalise(np.sum(side * rotations, axis=0)), np.mean([way[1] for way in ways], axis=0)

    def _placed(self, start: int, a: Posture) -> Made:
        """A segment, turned and moved to face and stand as A does at its beginning."""
        here = slice(start, start + self.frames + 1)
        rotations, root = self._rotations[here].copy(), self._root[here]
        turn = rot.about_vertical(rot.heading(a.rotations[0]) - rot.heading(rotations[0, 0]))
        rotations[:, 0] = rot.mul(turn, rotations[:, 0])
        return rotations, a.root + rot.mul_vec(turn, root - root[0])


def warped(rotations: Floats, root: Floats, ends: Ends) -> Made:
    """Bring a movement [T, J, 4], [T, 3] to A and B, with its offsets there distributed in proportion to time."""
    share = ends.share
    first = rot.log(rot.inv_mul(rotations[0], ends.a.rotations))
    last = rot.log(rot.inv_mul(rotations[-1], ends.b.rotations))
    off = (1.0 - share)[..., None] * first + share[..., None] * last
    moved = (1.0 - share) * (ends.a.root - root[0]) + share * (ends.b.root - root[-1])
    return rot.mul(rotations, rot.exp(off)), root + moved


def _facing_ahead(ends: Floats) -> Floats:
    """Turn pairs of postures [..., 2, J, 4] about the vertical, so that the first of each faces +Z."""
    turn = rot.inv(rot.about_vertical(rot.heading(ends[..., :1, 0, :])))
    out = ends.copy()
    out[..., 0, :] = rot.mul(turn, ends[..., 0, :])
    return out
