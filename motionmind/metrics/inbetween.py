"""How far movement that was made is from the movement that it stands for: L2Q, L2P and NPSS.

The protocol is that of LaFAN1: Harvey, Yurick, Nowrouzezahrai and Pal, "Robust motion in-betweening", ACM TOG 39(4)
(2020), and `lafan1/benchmarks.py`, which was released with it. The frames that are compared are those in between; what
was given, A and B, is left out. Rotations and positions are global, of windows as `seen` shows them.

There signs of quaternions follow from those of the recording, so that an error may count more on one hemisphere than
on the other. Here q and -q are the same rotation: the nearer sign counts.
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
    """Global rotations [..., T, J, 4] and joints' positions [..., T, J, 3] of windows, as the protocol looks at them.

    The stage is turned and moved so that the true body faces +Z in its first frame, and is on average above the origin.

    Args:
        skeleton: the body.
        rotations: local rotations of the windows [..., T, J, 4].
        root: positions of the root joint [..., T, 3], metres.
        truth_rotations: the true movement in the same windows [..., T, J, 4].
        truth_root: its root [..., T, 3].
    """
    turn = rot.inv(rot.about_vertical(rot.heading(truth_rotations[..., :1, 0, :])))
    place = truth_root.mean(axis=-2, keepdims=True) * np.array([1.0, 0.0, 1.0])
    turned = rotations.copy()
    turned[..., 0, :] = rot.mul(turn, rotations[..., 0, :])
    root = rot.mul_vec(turn, root - place)
    return skeleton.global_rotations(turned), skeleton.positions(turned, root)


def l2q(truth: Floats, made: Floats) -> Floats:
    """L2Q of each window [...]: the mean over its frames of the norm of the difference of all joints' quaternions.

    `truth` and `made` are global rotations [..., T, J, 4]. No unit: 2 sqrt(J) sin(a / 4) where every joint is off by
    the angle a.
    """
    nearer = np.minimum(np.sum((made - truth) ** 2, axis=-1), np.sum((made + truth) ** 2, axis=-1))
    return np.asarray(np.sqrt(nearer.sum(axis=-1)).mean(axis=-1))


def l2p(truth: Floats, made: Floats, spread: Floats) -> Floats:
    """L2P of each window [...]: the mean over its frames of the norm of the difference of all joints' positions.

    `truth` and `made` are global positions [..., T, J, 3] in metres; each coordinate counts in units of its `spread`
    [J, 3] in the movement that was learned from.
    """
    off = (made - truth) / spread
    return np.asarray(np.sqrt(np.sum(off**2, axis=(-2, -1))).mean(axis=-1))


def position_spread(positions: Floats) -> Floats:
    """Standard deviation of each coordinate [J, 3], metres, over windows of positions [..., T, J, 3] as `seen`.

    Raises:
        MotionMindError: a coordinate never changes, so that nothing can be measured by it.
    """
    spread = np.asarray(positions.reshape(-1, *positions.shape[-2:]).std(axis=0))
    if not np.all(spread > 0.0):
        raise MotionMindError("L2P needs movement to measure by: there is a joint that never moves along some axis")
    return spread


def npss(truth: Floats, made: Floats) -> float:
    """NPSS of a batch: how unlike the power spectra of all joints' quaternions are; 0 for the same spectra.

    Gopalakrishnan, Mali, Kifer, Giles and Ororbia, "A neural temporal model for human motion prediction", CVPR (2019),
    on global rotations [B, T, J, 4] as in LaFAN1: of each coefficient in each window the squares of the Fourier
    coefficients' real parts are brought to a sum of 1, the distance is the sum of the absolute differences of the two
    cumulated spectra, and windows and coefficients are averaged by the power of the truth. A coefficient without power
    has a spectrum of zeros. Signs are those with which each joint's quaternions follow one another most nearly.
    """
    powers = [np.fft.fft(_continuous(q).reshape(*q.shape[:2], -1), axis=1).real ** 2 for q in (truth, made)]
    totals = [power.sum(axis=1) for power in powers]
    true_share, made_share = (
        np.cumsum(power / np.where(total > 0.0, total, 1.0)[:, None], axis=1)
        for power, total in zip(powers, totals, strict=True)
    )
    return float(np.average(np.abs(made_share - true_share).sum(axis=1), weights=totals[0]))


def _continuous(q: Floats) -> Floats:
    """The same rotations [B, T, ...,  4], each with the sign that is nearer to the frame before."""
    flips = np.sum(q[:, 1:] * q[:, :-1], axis=-1, keepdims=True) < 0.0
    sign = np.cumprod(np.where(flips, -1.0, 1.0), axis=1)
    return np.concatenate([q[:, :1], q[:, 1:] * sign], axis=1)
