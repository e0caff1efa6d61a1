"""Weighted means of rotations: many means over the same orientations."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.jit import jit

# A mean ignores smaller weights. From this weight to twice as much, the effective weight rises continuously from 0 to
# the full one; at a sudden threshold, rounding would decide whether an orientation counts.
NEGLIGIBLE_WEIGHT_RATIO = 1e-6


@jit
def mean_rotations(weights: Floats, orientations: Floats, joints: Ints, about: Floats) -> Floats:
    """Return weighted means [S, m, 4] of m joints' orientations, in the hemisphere of `about`.

    The mean is the normalised sum of quaternions of the same sign, within a few thousandths of the mean rotation if
    they lie within a right angle. Source: Gramkow, "On averaging rotations", IJCV 42 (2001).

    Args:
        weights: of the orientations in each mean [S, N].
        orientations: of all joint chains [N, L, 4].
        joints: indices of the m joints.
        about: orientations that set each quaternion's sign, and replace a mean of length 0 [S, m, 4].
    """
    sums = np.zeros((len(joints), 4, len(about)))
    kept = np.arange(weights.shape[1])
    add_rotations(sums, scale_weights(1.0, weights, kept), kept, orientations, joints, about)
    return means(sums, about)


@jit
def mean_of_parts(
    weights: tuple[Floats, Floats, Floats],
    kept: tuple[Ints, Ints, Ints],
    shown: tuple[Floats, Floats, Floats],
    columns: Ints,
    about: Floats,
) -> Floats:
    """Return `mean_rotations` over the walks of three body parts together; each part has its own samples.

    Args:
        weights: per part, from `scale_weights` [m, S].
        kept: per part, indices of the non-negligible samples [n].
        shown: per part, orientations of its joints in its samples [N, p, 4].
        columns: indices of the joints within each part [3, m].
        about: as in `mean_rotations`.
    """
    sums = np.zeros((columns.shape[1], 4, len(about)))
    for k in range(3):
        add_rotations(sums, weights[k], kept[k], shown[k], columns[k], about)
    return means(sums, about)


@jit
def nonnegligible(weights: Floats) -> Ints:
    """Return the indices [n] of orientations with a non-negligible weight in any of the means [S, N]."""
    most = weights[0].copy()
    for t in range(1, len(weights)):
        for i in range(len(most)):
            most[i] = max(most[i], weights[t, i])
    return np.flatnonzero(most > NEGLIGIBLE_WEIGHT_RATIO)


@jit
def scale_weights(size: float, weights: Floats, kept: Ints) -> Floats:
    """Scale the weights of orientations and arrange them for `add_rotations` [m, S].

    The weights of one orientation in all means are contiguous. `add_rotations` takes four orientations at a time, so
    rows of 0, which change no sum, pad the number to a multiple of four.

    Args:
        size: the scale factor.
        weights: of the orientations in each mean [S, N].
        kept: indices of the orientations to add [n].
    """
    out = np.zeros((len(kept) + -len(kept) % 4, len(weights)))
    for i in range(len(kept)):
        for t in range(len(weights)):
            weight = size * weights[t, kept[i]]
            out[i, t] = max(min(weight, 2.0 * (weight - NEGLIGIBLE_WEIGHT_RATIO)), 0.0)
    return out


@jit
def add_rotations(sums: Floats, weights: Floats, kept: Ints, orientations: Floats, joints: Ints, about: Floats) -> None:
    """Add orientations, in the hemisphere of `about`, to the sums of all means [m, 4, S].

    Arguments are those of `mean_rotations`, except `weights`, from `scale_weights`, and `kept`, the indices of the
    orientations to add [n].
    """
    count, samples = len(about), len(kept)
    near, signed, shown = np.empty((4, count)), np.empty((4, count)), np.empty((4, 4))
    for j in range(len(joints)):
        for t in range(count):  # an array assignment takes seconds to compile
            for c in range(4):
                near[c, t] = about[t, j, c]
        middle, added_up = about[count // 2, j], sums[j]
        radius = _radius(near, middle)
        for first in range(0, len(weights), 4):
            added, mixed = weights[first : first + 4], False
            for k in range(4):
                x, y, z, w = orientations[kept[min(first + k, samples - 1)], joints[j]]
                cosine = middle[0] * x + middle[1] * y + middle[2] * z + middle[3] * w
                sign = -1.0 if cosine < -radius else 1.0
                shown[0, k], shown[1, k], shown[2, k], shown[3, k] = sign * x, sign * y, sign * z, sign * w
                mixed = mixed or abs(cosine) <= radius
            if mixed:
                for k in range(4):
                    x, y, z, w = shown[:, k]
                    for t in range(count):
                        cosine = near[0, t] * x + near[1, t] * y + near[2, t] * z + near[3, t] * w
                        signed[k, t] = -added[k, t] if cosine < 0.0 else added[k, t]
                added = signed
            for c in range(4):
                a, b, d, e = shown[c]
                own = added_up[c]
                for t in range(count):
                    own[t] = own[t] + added[0, t] * a + added[1, t] * b + added[2, t] * d + added[3, t] * e


@jit
def means(sums: Floats, about: Floats) -> Floats:
    """Normalise sums of m joints' orientations [m, 4, S] to means [S, m, 4]; `about` where a sum is 0."""
    out = about.copy()
    for j in range(len(sums)):
        for t in range(len(about)):
            x, y, z, w = sums[j, :, t]
            length = np.sqrt(x * x + y * y + z * z + w * w)
            if length > 1e-6:
                out[t, j, 0], out[t, j, 1], out[t, j, 2], out[t, j, 3] = x / length, y / length, z / length, w / length
    return out


@jit
def _radius(near: Floats, middle: Floats) -> float:
    """Return the greatest distance, as vectors, of orientations [4, S] from `middle` [4], one of them.

    A quaternion whose cosine with `middle` exceeds it has a cosine of the same sign with all of them.
    """
    farthest = 0.0
    for t in range(near.shape[1]):
        far = 0.0
        for c in range(4):
            far += (near[c, t] - middle[c]) ** 2
        farthest = max(farthest, far)
    return float(np.sqrt(farthest)) + 1e-6
