"""Terms of the solve: each adds its squared residuals, in units of their standard deviations, to one system.

A term states one property of the movement and its weight. `add(state, normal)` adds its rows, linearised at a state;
`residuals(state)` returns its residual frame by frame, in the unit of reports. Terms that push only beyond a bound are
in `motionmind.solver.one_sided`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Protocol

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.solver.kinematics import Rows, State, rows_at
from motionmind.solver.system import Normal


class Term(Protocol):
    """A sum of squares over a movement.

    Attributes:
        unit: unit of `residuals`; empty for a term that reports omit.
    """

    unit: ClassVar[str]

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows, linearised at a state, and the cost there."""

    def residuals(self, state: State) -> Floats:
        """Return the residual in each frame [N], in `unit`."""


@dataclass
class Track:
    """Stay near the reference.

    Attributes:
        sds: standard deviations of the unknowns in each frame [N, n], metres and radians.
    """

    unit: ClassVar[str] = "degrees"

    sds: Floats

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        weight = self.sds**-2.0
        diagonal = np.arange(state.x.shape[1])
        normal.block(0)[:, diagonal, diagonal] += weight
        normal.gradient += weight * state.x
        normal.cost += float(np.sum(weight * state.x**2))

    def residuals(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.residuals`."""
        return np.asarray(np.degrees(np.abs(state.x[:, 3:]).max(axis=1, initial=0.0)))


@dataclass
class Smoothness:
    """Depart from the reference slowly, to keep its accelerations: second differences of the unknowns.

    Unknowns are 0 before the first frame and after the last.

    Attributes:
        sds: standard deviations of these differences [n], metres and radians per frame squared.
    """

    unit: ClassVar[str] = ""

    sds: Floats

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        weight, x = self.sds**-2.0, state.x
        padded = np.zeros((len(x) + 4, x.shape[1]))
        padded[2:-2] = x
        bends = np.diff(padded, 2, axis=0)
        normal.cost += float(np.sum(weight * bends**2))
        normal.gradient += weight * np.diff(bends, 2, axis=0)
        diagonal = np.arange(x.shape[1])
        for k, share in enumerate((6.0, -4.0, 1.0)):
            normal.block(k)[: len(x) - k, diagonal, diagonal] += share * weight

    def residuals(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.residuals`."""
        return np.zeros(len(state.x))


@dataclass
class Ballistic:
    """Let the centre of mass fall freely in flight, and accelerate it as little as possible in stance.

    Attributes:
        fps: frames a second.
        falling: whether it is in flight in each inner frame [N - 2].
        gravity: m/s^2.
        push: standard deviations of its acceleration in stance, level and vertical, m/s^2.
        falls: standard deviation of its departure from free fall, m/s^2.
    """

    unit: ClassVar[str] = "m/s^2"

    fps: float
    falling: Bools
    gravity: float
    push: tuple[float, float]
    falls: float

    def _residual(self, state: State) -> Floats:
        residual = self.fps**2 * np.diff(state.mass, 2, axis=0)
        residual[self.falling, 1] += self.gravity
        return np.asarray(residual)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        residual, first = self._residual(state), np.arange(len(state.x) - 2)
        level, vertical = self.push
        weight = np.where(self.falling[:, None], self.falls, (level, vertical, level)) ** -2.0
        shares, axes = self.fps**2 * np.array([1.0, -2.0, 1.0]), np.arange(3)
        for a in range(3):
            normal.mass_gradient[first + a] += shares[a] * weight * residual
            for b in range(a, 3):
                normal.mass_blocks[b - a, first[:, None] + a, axes, axes] += shares[a] * shares[b] * weight
        normal.cost += float(np.sum(weight * residual**2))

    def residuals(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.residuals`."""
        out = np.zeros(len(state.x))
        out[1:-1] = np.where(self.falling, np.linalg.norm(self._residual(state), axis=1), 0.0)
        return out


@dataclass
class Contacts:
    """Bring points to their targets, and let supporting points slide no more than in the corpus.

    Attributes:
        frames: frames of the targets [M].
        points: point numbers [M].
        targets: target positions [M, 3], metres.
        sds: standard deviations of each coordinate [M, 3], metres; infinite where it is free.
        stands: whether the point stands there [M].
        grips: points that may support the body [Q].
        moves: their target displacements from frame to frame [N - 1, Q, 2], level, metres.
        slips: standard deviations of these [N - 1, Q], metres; infinite for a point without grip.
        reach: distance from its target beyond which the pull on a point is constant, metres.
    """

    unit: ClassVar[str] = "cm"

    frames: Indices
    points: Indices
    targets: Floats
    sds: Floats
    stands: Bools
    grips: Indices
    moves: Floats
    slips: Floats
    reach: float = 0.02

    @cached_property
    def _placed(self) -> tuple[Indices, Indices, Rows]:
        """The target and the axis of each coordinate that is not free [R], and their rows."""
        target, axis = np.nonzero(np.isfinite(self.sds))
        return target, axis, rows_at(self.frames[target], np.eye(3)[axis], self.points[target])

    @cached_property
    def _held(self) -> tuple[Indices, Indices, Indices, Rows]:
        """The first frame, the grip and the level axis of each displacement that counts [R], and their rows."""
        first, grip = (np.repeat(found, 2) for found in np.nonzero(np.isfinite(self.slips)))
        axis = np.arange(len(first)) % 2
        points, after = np.repeat(self.grips[grip][:, None], 2, axis=1), np.tile([0, 1], (len(first), 1))
        shares = np.tile([-1.0, 1.0], (len(first), 1))
        return first, grip, axis, Rows(first, np.eye(3)[2 * axis], points, after, shares)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        off, weight = state.places[self.frames, self.points] - self.targets, self.sds**-2.0
        for axes in ([0, 2], [1]):  # both level coordinates have one standard deviation
            own = off[:, axes] * (weight[:, axes] > 0.0)
            share = 1.0 / np.maximum(1.0, np.linalg.norm(own, axis=1) / self.reach)
            normal.cost += float(np.sum(share * (2.0 - share) * np.sum(weight[:, axes] * own**2, axis=1)))
            weight[:, axes] *= share[:, None]
        target, axis, rows = self._placed
        rows.add(state, normal, off[target, axis], weight[target, axis])
        first, grip, axis, rows = self._held
        slid, weight = self._slid(state)[first, grip, axis], self.slips[first, grip] ** -2.0
        normal.cost += float(np.sum(weight * slid**2))
        rows.add(state, normal, slid, weight)

    @classmethod
    def joined(cls, parts: list[Contacts], begins: list[int], count: int) -> Contacts:
        """Return the contacts of a movement of `count` frames, from those of its parts and their first frames."""
        grips = np.unique(np.concatenate([part.grips for part in parts]))
        moves, slips = np.zeros((count - 1, len(grips), 2)), np.full((count - 1, len(grips)), np.inf)
        for begin, part in zip(begins, parts, strict=True):
            at, here = np.searchsorted(grips, part.grips), slice(begin, begin + len(part.moves))
            moves[here, at], slips[here, at] = part.moves, part.slips
        return cls(
            np.concatenate([begin + part.frames for begin, part in zip(begins, parts, strict=True)]),
            np.concatenate([part.points for part in parts]),
            np.concatenate([part.targets for part in parts]),
            np.concatenate([part.sds for part in parts]),
            np.concatenate([part.stands for part in parts]),
            grips,
            moves,
            slips,
        )

    def part(self, frames: slice) -> Contacts:
        """Return the contacts of a slice of the frames."""
        here = (self.frames >= frames.start) & (self.frames < frames.stop)
        between = slice(frames.start, frames.stop - 1)
        return Contacts(
            self.frames[here] - frames.start,
            self.points[here],
            self.targets[here],
            self.sds[here],
            self.stands[here],
            self.grips,
            self.moves[between],
            self.slips[between],
        )

    def _slid(self, state: State) -> Floats:
        return np.asarray(np.diff(state.places[:, self.grips][..., [0, 2]], axis=0) - self.moves)

    def residuals(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.residuals`."""
        out, off = np.zeros(len(state.x)), state.places[self.frames, self.points] - self.targets
        firm = self.stands & (self.sds[:, 1] < 2.0 * self.sds[:, 1].min(initial=np.inf, where=self.stands))
        np.maximum.at(out, self.frames[firm], 100.0 * np.abs(off[firm, 1]))
        return out
