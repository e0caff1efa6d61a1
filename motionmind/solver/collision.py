"""Collision term of the solve: limbs overlap no more than usual, and a plane keeps the legs apart."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.capsules import LEG, capsules_of, pair_depths
from motionmind.body.tempo import runs_of
from motionmind.footing.smoothing import sliding_max
from motionmind.solver.kinematics import Rows, State
from motionmind.solver.one_sided import BOUND_TOLERANCE, OneSided, once_per_state
from motionmind.solver.system import Normal

LEGS_NEAR_M = 0.06  # legs this near may pass through each other within a frame
MAX_SIDE_CHANGE_COSINE = 0.2  # between the directions from leg to leg before and after they change sides


@dataclass
class Collision(OneSided):
    """Keep limbs, as capsules, from overlapping more than they do in the corpus or at an end.

    While two legs overlap, a plane keeps them apart. It separates them as they meet and as they part. If they change
    sides in between, as when a leg passes from in front of the other to behind it, the plane turns through the line
    from hip to hip, so that the legs open.

    Attributes:
        usual: overlap allowed to each pair of `Capsules.pairs` [P], metres.
        sd: standard deviation of the excess, metres.
        around: frames before legs meet and after they part in which the plane may turn.
    """

    unit: ClassVar[str] = "cm"

    usual: Floats
    sd: float
    around: int
    _planes: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    _on_plane: Bools = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))

    def separate(self, state: State) -> None:
        """Find the planes between legs that overlap or change sides between two frames, given by their normals."""
        deep, directions, _, _ = self._deep(state)
        legs, planes = self._legs(state), np.zeros((len(deep), 3))
        nearest = np.flatnonzero(legs)[deep[:, legs].argmax(axis=1)]
        frames, skeleton = np.arange(len(deep)), state.body.skeleton
        away, closest = directions[frames, nearest], deep[frames, nearest]
        sides = state.places[:, skeleton.index("left_hip")] - state.places[:, skeleton.index("right_hip")]
        sides /= np.maximum(np.linalg.norm(sides, axis=1, keepdims=True), BOUND_TOLERANCE)
        passes = (np.sum(away[1:] * away[:-1], axis=1) < MAX_SIDE_CHANGE_COSINE) & (
            np.minimum(closest[1:], closest[:-1]) > -LEGS_NEAR_M
        )
        meets = closest > 0.0
        meets[1:] |= passes
        meets[:-1] |= passes
        for begin, end in runs_of(sliding_max(meets, self.around)):
            before, after = away[max(begin - 1, 0)], away[min(end, len(away) - 1)]
            share = np.linspace(0.0, 1.0, end - begin + 2)[1:-1, None]
            if before @ after < MAX_SIDE_CHANGE_COSINE:
                first, last = np.maximum(1.0 - 2.0 * share, 0.0), np.maximum(2.0 * share - 1.0, 0.0)
                planes[begin:end] = first * before + (1.0 - first - last) * sides[begin:end] + last * after
            else:
                planes[begin:end] = (1.0 - share) * before + share * after
        planes /= np.maximum(np.linalg.norm(planes, axis=1, keepdims=True), BOUND_TOLERANCE)
        if len(self._planes):  # legs that have come apart stay on their sides
            planes = np.where(np.any(planes != 0.0, axis=1, keepdims=True), planes, self._planes)
        self._planes = planes
        # Choose the pairs now: a pair that joined later would count with its whole distance from the plane at once, and
        # the solve would refuse steps.
        self._on_plane = legs & np.any(planes != 0.0, axis=1, keepdims=True) & (deep > -LEGS_NEAR_M)

    def _legs(self, state: State) -> Bools:
        """Return whether each pair consists of two legs' capsules [P]."""
        capsules = capsules_of(state.body.skeleton)
        return np.asarray(np.array([name.endswith(LEG) for name in capsules.names])[capsules.pairs()].all(axis=1))

    @once_per_state
    def _deep(self, state: State) -> tuple[Floats, Floats, Floats, Floats]:
        """Return the excess overlap of the pairs [N, P], metres; directions from the second capsule to the first
        [N, P, 3]; the nearest points' shares of both axes [N, P, 2]; and the displacement between them [N, P, 3]."""
        capsules = capsules_of(state.body.skeleton)
        pairs = capsules.pairs()
        ends = capsules.place(np.ascontiguousarray(state.places[:, : 2 * len(state.body.skeleton)]))
        depths, directions, at = pair_depths(ends, capsules.radii, pairs)
        share = np.linspace(0.0, 1.0, len(depths))[:, None]
        deep = depths - np.maximum((1.0 - share) * depths[0] + share * depths[-1], self.usual)
        axes = ends[:, pairs]
        where = axes[..., 0, :] + at[..., None] * (axes[..., 1, :] - axes[..., 0, :])
        return deep, directions, at, where[:, :, 0] - where[:, :, 1]

    def _over(self, state: State) -> tuple[Floats, Floats, Floats]:
        """Return the excess overlap of the pairs [N, P], metres; the directions along which they part [N, P, 3]; and
        the nearest points' shares of both axes [N, P, 2]."""
        if not len(self._planes):
            self.separate(state)
        deep, directions, at, apart = self._deep(state)
        beyond = np.linalg.norm(apart, axis=2) - np.einsum("tpk,tk->tp", apart, self._planes)
        deep = deep + np.where(self._on_plane, beyond, 0.0)
        deep[[0, -1]] = -1.0
        return deep, np.where(self._on_plane[..., None], self._planes[:, None], directions), at

    def _rows(self, state: State, chosen: Bools, directions: Floats, at: Floats) -> Rows:
        capsules = capsules_of(state.body.skeleton)
        frames, which = np.nonzero(chosen)
        pairs, at = capsules.pairs()[which], at[frames, which]
        between = capsules.shares[pairs]
        along = between[..., 0] + at * (between[..., 1] - between[..., 0])
        points = capsules.points[pairs].reshape(-1, 4)
        shares = np.stack([along[:, 0] - 1.0, -along[:, 0], 1.0 - along[:, 1], along[:, 1]], axis=1)
        return Rows(frames, directions[frames, which], points, np.zeros_like(points), shares)

    def add(self, state: State, normal: Normal) -> None:
        """Add the rows; see `Term.add`."""
        deep, directions, at = self._over(state)
        pushes = deep > BOUND_TOLERANCE
        self._rows(state, pushes, directions, at).add_uniform(state, normal, deep[pushes], self.sd)
        normal.cost += float(np.sum(deep[pushes] ** 2)) * self.sd**-2.0

    def foresee(self, state: State, step: Floats, normal: Normal) -> bool:
        """Add the rows that a step breaks; see `OneSided.foresee`."""
        deep, directions, at = self._over(state)
        chosen = (deep <= BOUND_TOLERANCE) & (deep > -LEGS_NEAR_M)
        rows = self._rows(state, chosen, directions, at)
        return rows.add_broken(state, step, normal, deep[chosen], self.sd)

    def residuals(self, state: State) -> Floats:
        """Return the residual of each frame; see `Term.residuals`."""
        return np.asarray(100.0 * np.maximum(self._deep(state)[0].max(axis=1), 0.0))
