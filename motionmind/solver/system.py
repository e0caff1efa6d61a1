"""Normal equations of a whole movement: one block-banded system of rows that span up to three successive frames.

Frame t has n unknowns. `blocks[t, :, k n : (k + 1) n]` couples those of frame t with those of frame t + k, for k = 0, 1
and 2; for k = 0 only the upper triangle counts. Cholesky factorisation proceeds frame by frame, so time and memory are
linear in the number of frames.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.jit import jit

ROW_SPAN_FRAMES = 3  # frames that a row may span


class Normal:
    """The normal equations of a sum of squares, to which terms add their rows.

    Attributes:
        blocks: couplings of each frame with itself and the next two [N, n, 3 n].
        gradient: half the gradient of the sum [N, n].
        cost: the sum of squares.
        mass_blocks: couplings of the centre of mass with itself and the next two frames' [3, N, 3, 3], see `expand`.
        mass_gradient: half the gradient with respect to the centre of mass [N, 3].
    """

    def __init__(self, frames: int, unknowns: int) -> None:
        self.blocks = np.zeros((frames, unknowns, ROW_SPAN_FRAMES * unknowns))
        self.gradient = np.zeros((frames, unknowns))
        self.cost = 0.0
        self.mass_blocks = np.zeros((ROW_SPAN_FRAMES, frames, 3, 3))
        self.mass_gradient = np.zeros((frames, 3))

    def block(self, k: int) -> Floats:
        """Return the couplings of each frame with the one k later [N, n, n], a view to add to."""
        n = self.gradient.shape[1]
        return self.blocks[:, :, k * n : (k + 1) * n]

    def add_mass(self, first: Indices, coefficients: Floats, residual: Floats, weight: Floats) -> None:
        """Add rows in the centre of mass over three successive frames each.

        Args:
            first: first frame of each row [R], each at most once.
            coefficients: of the three positions [R, 3 frames, 3].
            residual: of the rows [R].
            weight: of their squares [R].
        """
        weighted = coefficients * weight[:, None, None]
        for a in range(ROW_SPAN_FRAMES):
            self.mass_gradient[first + a] += weighted[:, a] * residual[:, None]
            for b in range(a, ROW_SPAN_FRAMES):
                self.mass_blocks[b - a, first + a] += weighted[:, a, :, None] * coefficients[:, b, None, :]

    def add_joint(self, first: Indices, columns: slice, jacobian: Floats, residual: Floats, weight: float) -> None:
        """Add rows in a few unknowns of one frame, or of two successive frames.

        Args:
            first: first frame of each row [R], each once.
            columns: the unknowns.
            jacobian: their coefficients [R, frames, unknowns, C].
            residual: of the rows, of C components each [R, C].
            weight: of their squares.
        """
        weighted = weight * jacobian
        for a in range(jacobian.shape[1]):
            self.gradient[first + a, columns] += (weighted[:, a] @ residual[..., None])[..., 0]
            for b in range(a, jacobian.shape[1]):
                self.block(b - a)[first + a, columns, columns] += weighted[:, a] @ np.swapaxes(jacobian[:, b], 1, 2)

    def expand(self, jacobian: Floats) -> None:
        """Express the rows in the centre of mass in the unknowns, by its Jacobian [N, 3, n]."""
        self.gradient += np.einsum("txi,tx->ti", jacobian, self.mass_gradient)
        across = np.ascontiguousarray(np.swapaxes(jacobian, 1, 2))
        for k in range(ROW_SPAN_FRAMES):
            count = len(jacobian) - k
            self.block(k)[:count] += across[:count] @ (self.mass_blocks[k, :count] @ jacobian[k:])
        self.mass_blocks[:], self.mass_gradient[:] = 0.0, 0.0

    def step(self, damping: float, fixed: Bools) -> Floats:
        """Return the Gauss-Newton step [N, n], zero in the `fixed` frames [N]."""
        n = self.gradient.shape[1]
        step = -self.gradient
        step[fixed] = 0.0
        blocks = self.blocks.copy()
        blocks[fixed] = 0.0
        for k in range(1, ROW_SPAN_FRAMES):
            blocks[:-k, :, k * n : (k + 1) * n][fixed[k:]] = 0.0
        diagonal = np.arange(n)
        blocks[:, diagonal, diagonal] += np.where(fixed[:, None], 1.0, damping)
        _solve(blocks, step)
        return step


@jit
def _solve(blocks: Floats, right: Floats) -> None:
    """Overwrite the right side [N, n] with the solution, and `blocks` [N, n, 3 n] with their Cholesky factor."""
    count, n = right.shape
    for t in range(count):
        own = blocks[t]
        for i in range(n):  # U of this frame, and U^-T times its couplings
            _eliminate(own[i], own, i, i, 0)
            pivot = 1.0 / np.sqrt(own[i, i])
            for j in range(i, 3 * n):
                own[i, j] *= pivot
        for ahead in range(1, min(3, count - t)):  # Schur complement in the next two frames
            for i in range(n):
                _eliminate(blocks[t + ahead, i], own, n, ahead * n + i, ahead * n)
    for t in range(count):
        for i in range(n):
            right[t, i] /= blocks[t, i, i]
            for j in range(i + 1, n):
                right[t, j] -= blocks[t, i, j] * right[t, i]
            for ahead in range(1, min(3, count - t)):
                for j in range(n):
                    right[t + ahead, j] -= blocks[t, i, ahead * n + j] * right[t, i]
    for t in range(count - 1, -1, -1):
        for i in range(n - 1, -1, -1):
            total = right[t, i]
            for j in range(i + 1, n):
                total -= blocks[t, i, j] * right[t, j]
            for ahead in range(1, min(3, count - t)):
                for j in range(n):
                    total -= blocks[t, i, ahead * n + j] * right[t + ahead, j]
            right[t, i] = total / blocks[t, i, i]


@jit
def _eliminate(row: Floats, rows: Floats, count: int, column: int, shift: int) -> None:
    """Subtract the first `count` rows, each times its entry in a column, from a row that starts `shift` later.

    Four rows at a time: the target is read and written a quarter as often.
    """
    target = row[column - shift : rows.shape[1] - shift]
    for k in range(0, count - count % 4, 4):
        a, b, c, d = rows[k], rows[k + 1], rows[k + 2], rows[k + 3]
        e, f, g, h = a[column], b[column], c[column], d[column]
        a, b, c, d = a[column:], b[column:], c[column:], d[column:]
        for j in range(len(target)):
            target[j] -= (e * a[j] + f * b[j]) + (g * c[j] + h * d[j])
    for k in range(count - count % 4, count):
        a = rows[k]
        e = a[column]
        a = a[column:]
        for j in range(len(target)):
            target[j] -= e * a[j]
