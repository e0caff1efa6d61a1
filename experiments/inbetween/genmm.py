"""Generative motion matching: movement made of overlapping patches of examples, from coarse to fine.

Li, Chen, Li, Sorkine-Hornung and Chen, "Example-based motion synthesis via generative motion matching", ACM TOG 42(4)
(SIGGRAPH 2023), with the constants of the code that was released with it. From the coarsest time scale to the finest,
each patch of what is made is replaced by the patch of the examples that is nearest in proportion to how near anything
made is to that patch (the bidirectional similarity's completeness), and overlapping patches are averaged.

Frames are described as there: by six numbers a joint (two columns of its rotation matrix), the root's height and its
velocity. Only where a body faces is described otherwise: by how it turns from frame to frame, so that examples match
wherever they face.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.inbetween.rivals import Ends, Made, slerp, warped
from motionmind import Motion
from motionmind._typing import Floats
from motionmind.geometry import rotations as rot

PATCH = 11  # frames
FACTOR = 0.75  # of the frames at each scale, at the next coarser one
STEPS = 3  # at each scale
COMPLETENESS = 0.01  # alpha: the smaller, the more the examples are used up
NOISE = 10.0  # standard deviation of what is made at first, where nothing is given
COARSEST = 5 * PATCH  # frames of the longest example, where nothing is given


@dataclass(frozen=True, eq=False)
class Examples:
    """Movement to make patches of.

    Attributes:
        frames: descriptions of the frames of each piece [T, F].
    """

    frames: tuple[Floats, ...]

    @classmethod
    def of(cls, pieces: Sequence[Motion]) -> Examples:
        return cls(tuple(described(piece.rotations, piece.root) for piece in pieces))

    def patches(self, scale: float) -> Floats:
        """Return all patches [P, PATCH F] of the examples at a time scale; of short ones there are none."""
        sizes = [round(scale * len(piece)) for piece in self.frames]
        cut = [_patches(_resized(x, size)) for x, size in zip(self.frames, sizes, strict=True) if size >= PATCH]
        return np.concatenate(cut)


def scales(frames: int, coarsest: int) -> list[float]:
    """Return time scales, coarse to fine, by which so many frames are at least `coarsest`; the last is 1."""
    out = [1.0]
    while round(frames * out[0] * FACTOR) >= coarsest:
        out.insert(0, out[0] * FACTOR)
    return out


def solve_motion(
    begun: Floats, patches: Callable[[float], Floats], at: Sequence[float], fix: Callable[[Floats], Floats]
) -> Floats:
    """Return movement [T, F] of the examples' patches.

    Args:
        begun: what to begin with, at the finest scale [T, F].
        patches: of the examples at a time scale [P, PATCH F].
        at: the scales, coarse to fine.
        fix: sets what is given in a movement at any scale, before each step.
    """
    made = begun
    for scale in at:
        made = _resized(made, max(round(scale * len(begun)), PATCH))
        known = patches(scale)
        for _ in range(STEPS):
            made = _matched(fix(made), known)
    return made


def between(ends: Ends, patches: Callable[[float], Floats]) -> Made:
    """Return movement from A to B: both are set before each step, and it begins as SLERP between them.

    What it is off A and B after the last step is distributed along it in proportion to time.
    """
    begun = described(*slerp(ends))
    given = begun[[0, -1], :-3]  # not the turn and the velocity, which a posture does not tell

    def fix(made: Floats) -> Floats:
        made[[0, -1], :-3] = given
        return made

    found = solve_motion(begun, patches, scales(len(begun), PATCH), fix)
    return warped(*restored(found, ends.a.rotations[0], ends.a.root), ends)


def freely(examples: Examples, frames: int, seed: int) -> Made:
    """Return movement of so many frames, made of noise and the examples alone."""
    longest = max(map(len, examples.frames))
    begun = np.random.default_rng(seed).normal(scale=NOISE, size=(frames, examples.frames[0].shape[1]))
    found = solve_motion(begun, examples.patches, scales(longest, COARSEST), lambda made: made)
    return restored(found, rot.IDENTITY, np.zeros(3))


def described(rotations: Floats, root: Floats) -> Floats:
    """Describe frames [T, 6 J + 4]: rotations without the facing, the height, the turn and level velocity a frame."""
    facing = rot.heading(rotations[:, 0])
    turn = np.diff(facing, prepend=facing[:1])
    turn -= 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
    ahead = rot.inv(rot.about_vertical(facing))
    local = rotations.copy()
    local[:, 0] = rot.mul(ahead, rotations[:, 0])
    velocity = rot.mul_vec(ahead, np.diff(root, axis=0, prepend=root[:1]))
    six = rot.to_matrix(local)[..., :2].reshape(len(rotations), -1)
    return np.concatenate([six, root[:, 1:2], turn[:, None], velocity[:, [0, 2]]], axis=1)


def restored(frames: Floats, first: Floats, place: Floats) -> Made:
    """Return rotations [T, J, 4] and root [T, 3] of described frames, facing as `first` [4], from a `place` [3] on."""
    six = frames[:, :-4].reshape(len(frames), -1, 3, 2)
    x = six[..., 0] / np.linalg.norm(six[..., 0], axis=-1, keepdims=True)
    y = six[..., 1] - np.sum(x * six[..., 1], axis=-1, keepdims=True) * x
    y /= np.linalg.norm(y, axis=-1, keepdims=True)
    rotations = rot.from_matrix(np.stack([x, y, np.cross(x, y)], axis=-1))
    facing = rot.about_vertical(rot.heading(first) + np.cumsum(frames[:, -3]) - frames[0, -3])
    rotations[:, 0] = rot.mul(facing, rotations[:, 0])
    step = np.zeros((len(frames), 3))
    step[1:, [0, 2]] = frames[1:, -2:]
    root = place + np.cumsum(rot.mul_vec(facing, step), axis=0)
    root[:, 1] = frames[:, -4]
    return rotations, root


def _matched(made: Floats, known: Floats) -> Floats:
    """Replace each patch of a movement [T, F] by the best of the known ones [P, PATCH F], and average them."""
    own = _patches(made)
    off = (np.sum(own**2, axis=1)[:, None] + np.sum(known**2, axis=1) - 2.0 * own @ known.T) / own.shape[1]
    off = np.maximum(off, 0.0)
    best = np.argmin(off / (COMPLETENESS + off.min(axis=0)), axis=1)
    out, count = np.zeros_like(made), np.zeros((len(made), 1))
    for k, patch in enumerate(known[best].reshape(len(own), PATCH, -1)):
        out[k : k + PATCH] += patch
        count[k : k + PATCH] += 1.0
    return np.asarray(out / count)


def _patches(frames: Floats) -> Floats:
    """Return all patches of frames [T, F]: [T - PATCH + 1, PATCH F], in single precision."""
    windows = np.lib.stride_tricks.sliding_window_view(frames, PATCH, axis=0)
    return np.ascontiguousarray(windows.swapaxes(1, 2), dtype=np.float32).reshape(len(windows), -1)


def _resized(frames: Floats, count: int) -> Floats:
    """Interpolate frames [T, F] linearly to another number of them."""
    at = np.linspace(0.0, len(frames) - 1.0, count)
    low = np.minimum(at.astype(int), max(len(frames) - 2, 0))
    share = (at - low)[:, None]
    return np.asarray((1.0 - share) * frames[low] + share * frames[np.minimum(low + 1, len(frames) - 1)])
