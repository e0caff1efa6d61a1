"""Distances between generated movement and the true movement that it replaces: L2Q, L2P and NPSS.

The protocol is that of LaFAN1: Harvey, Yurick, Nowrouzezahrai and Pal, "Robust motion in-betweening", ACM TOG 39(4)
(2020), and `lafan1/benchmarks.py`, released with it. Only the frames in between count; the given ones, A and B, are
left out. Rotations and positions are global, in windows that `seen` has aligned.

LaFAN1 takes the signs of quaternions from the recording, so an error may count more on one hemisphere than on the
other. Here q and -q are the same rotation: the nearer sign counts.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot


def seen(
    skeleton: Skeleton, rotations: Floats, root: Floats, truth_rotations: Floats, truth_root: Floats
) -> tuple[Floats, Floats]:
    """Align windows as the protocol does, and return global rotations and joint positions.

    The true body then faces +Z in its first frame, and its mean position is above the origin.

    Args:
        skeleton: the body.
        rotations: local rotations of the windows [..., T, J, 4].
        root: positions of the root joint [..., T, 3], metres.
        truth_rotations: the true movement in the same windows [..., T, J, 4].
        truth_root: its root [..., T, 3], metres.

    Returns:
        Global rotations [..., T, J, 4] and positions [..., T, J, 3], metres.
    """
    turn = rot.inv(rot.about_vertical(rot.heading(truth_rotations[..., :1, 0, :])))
    place = truth_root.mean(axis=-2, keepdims=True) * np.array([1.0, 0.0, 1.0])
    turned = rotations.copy()
    turned[..., 0, :] = rot.mul(turn, rotations[..., 0, :])
    root = rot.mul_vec(turn, root - place)
    return skeleton.global_rotations(turned), skeleton.positions(turned, root)


def l2q(truth: Floats, made: Floats) -> Floats:
    """Return L2Q of each window: the mean over its frames of ||q_made - q_truth|| over all joints.

    It is dimensionless; if every joint is off by the angle a, it is 2 sqrt(J) sin(a / 4).

    Args:
        truth: true global rotations [..., T, J, 4].
        made: generated global rotations [..., T, J, 4].

    Returns:
        L2Q [...].
    """
    nearer = np.minimum(np.sum((made - truth) ** 2, axis=-1), np.sum((made + truth) ** 2, axis=-1))
    return np.asarray(np.sqrt(nearer.sum(axis=-1)).mean(axis=-1))


def l2p(truth: Floats, made: Floats, spread: Floats) -> Floats:
    """Return L2P of each window: the mean over its frames of ||(p_made - p_truth) / spread|| over all joints.

    Args:
        truth: true global positions [..., T, J, 3], metres.
        made: generated global positions [..., T, J, 3], metres.
        spread: standard deviation of each coordinate [J, 3], metres, in the training movement.

    Returns:
        L2P [...], dimensionless.
    """
    off = (made - truth) / spread
    return np.asarray(np.sqrt(np.sum(off**2, axis=(-2, -1))).mean(axis=-1))


def position_spread(positions: Floats) -> Floats:
    """Return the standard deviation of each coordinate [J, 3], metres.

    Args:
        positions: aligned windows of positions [..., T, J, 3], metres (see `seen`).

    Raises:
        MotionMindError: a coordinate never changes, so nothing can be measured in units of it.
    """
    spread = np.asarray(positions.reshape(-1, *positions.shape[-2:]).std(axis=0))
    if not np.all(spread > 0.0):
        raise MotionMindError("L2P needs a spread in every coordinate: some joint never moves along an axis")
    return spread


def npss(truth: Floats, made: Floats) -> float:
    """Return the normalised power spectrum similarity of a batch: a distance, 0 for equal spectra.

    Defined by Gopalakrishnan, Mali, Kifer, Giles and Ororbia, "A neural temporal model for human motion prediction",
    CVPR (2019); computed as in LaFAN1. For each quaternion coefficient of each window, the squared real parts of
    its Fourier coefficients are normalised to a sum of 1; the distance is the sum of the absolute differences of the
    two cumulative spectra. Windows and coefficients are averaged, weighted by the power of the truth. A coefficient
    without power has a spectrum of zeros. Signs are chosen to make each joint's quaternions continuous in time.

    Args:
        truth: true global rotations [B, T, J, 4].
        made: generated global rotations [B, T, J, 4].
    """
    steady = [rot.continuous(q.swapaxes(0, 1)).swapaxes(0, 1).reshape(*q.shape[:2], -1) for q in (truth, made)]
    powers = [np.fft.fft(one, axis=1).real ** 2 for one in steady]
    totals = [power.sum(axis=1) for power in powers]
    true_share, made_share = (
        np.cumsum(power / np.where(total > 0.0, total, 1.0)[:, None], axis=1)
        for power, total in zip(powers, totals, strict=True)
    )
    return float(np.average(np.abs(made_share - true_share).sum(axis=1), weights=totals[0]))
