"""Tracks of feet: where a foot should go so that it stays where it stands, and steps where it would slide."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Bools, Floats

HOLDS = 0.04  # metres above the floor at which a foot's hold on it has fallen to a half
EVEN = 0.03  # weight of an even departure from the original track, that of a standing foot being 1
SMOOTH = 0.015  # seconds in which a departure begins and ends
BACK = 2.5  # a second: how fast a foot without hold returns to its original track
FAST = 0.6  # metres a second from which a foot does not slide but steps
MEANT = 0.25  # how firmly a foot must be meant to stand to step rather than slide
STEP = 0.06  # metres above the floor to which a step lifts it
RISE = 0.3  # seconds of lifting


def departure(ends: Floats, heights: Floats, stands: Floats, others_stand: Bools, fps: float) -> Floats:
    """Return a foot's displacement from its original track [N, 3], metres: 0 in the first and the last frame.

    Args:
        ends: positions of the foot's two ends [N, 2, 3], metres.
        heights: of the same above the floor [N, 2], metres.
        stands: how firmly it stands where it is low, between frames [N - 1], from 0 to 1.
        others_stand: whether another foot stands, so that this one may step [N].
        fps: frames a second.
    """
    moves = np.diff(ends[..., [0, 2]], axis=0)
    level = _track(moves, _higher(heights), stands, fps)
    speed = fps * np.linalg.norm(moves + np.diff(level, axis=0)[:, None], axis=-1)
    low = _higher(heights) < STEP
    slides = np.any(low, axis=1) & np.all(~low | (speed > FAST), axis=1) & (stands > MEANT)
    steps = np.zeros(len(ends), dtype=np.bool_)
    steps[:-1] |= slides
    steps[1:] |= slides
    lift = np.zeros(len(ends))
    if np.any(steps & others_stand):
        lift = _envelope(np.where(steps & others_stand, np.maximum(STEP - heights.min(axis=1), 0.0), 0.0), fps)
        level = _track(moves, _higher(heights + lift[:, None]), stands, fps)
    return np.stack([level[:, 0], lift, level[:, 1]], axis=-1)


def _higher(heights: Floats) -> Floats:
    """Return the greater of the heights [N, 2] in each two successive frames [N - 1, 2]."""
    return np.maximum(heights[1:], heights[:-1])


def _track(moves: Floats, heights: Floats, stands: Floats, fps: float) -> Floats:
    """Return a foot's level displacement from its original track [N, 2], metres, with which it stays where it stands.

    From 0 to 0 the offsets d minimise sum_p w_p |d' + v_p|^2 + EVEN |d'|^2 + (1 - w) BACK^2 |d|^2 + SMOOTH^2 |d''|^2
    over time, with v_p the velocity of end p, w_p its hold on the floor, 1 / (1 + (height / HOLDS)^4) times how firmly
    the foot stands there, and w the greater of both ends' holds. In units of frames, and divided by fps: differences
    stand for derivatives, BACK / fps for BACK and SMOOTH fps for SMOOTH. The normal equations have five diagonals.

    Args:
        moves: level displacements of the foot's ends between frames [N - 1, 2, 2], metres.
        heights: of the ends above the floor meanwhile [N - 1, 2], metres.
        stands: how firmly the foot stands where it is low [N - 1], from 0 to 1.
        fps: frames a second.
    """
    from scipy.linalg import solveh_banded

    hold = stands[:, None] / (1.0 + (np.maximum(heights, 0.0) / HOLDS) ** 4)
    pull = hold.sum(axis=1) + EVEN
    free = 1.0 - hold.max(axis=1)
    back = 0.5 * (free[:-1] + free[1:]) * (BACK / fps) ** 2
    bend = (SMOOTH * fps) ** 2
    out = np.zeros((len(moves) + 1, 2))
    # Rows are the frames but the first and the last, where d = 0, as before and after them; a second difference spans
    # three frames.
    diagonals = np.zeros((3, len(out) - 2))
    diagonals[2] = pull[:-1] + pull[1:] + back + 6.0 * bend
    diagonals[1, 1:] = -pull[1:-1] - 4.0 * bend
    diagonals[0, 2:] = bend
    pulled = np.einsum("np,npk->nk", hold, moves)
    out[1:-1] = solveh_banded(diagonals, pulled[1:] - pulled[:-1])
    return out


def _envelope(need: Floats, fps: float) -> Floats:
    """Return a smooth curve [N] that is at least `need` [N], except within RISE of both ends, where it falls to 0."""
    rise = max(1, round(RISE * fps))
    window = np.hanning(2 * rise + 3)[1:-1]
    # The mean over a window of each frame's greatest need within a window: none of those is less than the need here.
    around = np.lib.stride_tricks.sliding_window_view(np.pad(need, 2 * rise), 2 * rise + 1).max(axis=1)
    return np.asarray(np.convolve(around, window / window.sum(), "valid") * fade_at_ends(len(need), fps))


def fade_at_ends(count: int, fps: float) -> Floats:
    """Return a curve [count] that rises smoothly from 0 to 1 in RISE seconds, and falls to 0 in the last RISE."""
    frames = np.arange(count)
    share = np.minimum(np.minimum(frames, frames[::-1]) / max(1, round(RISE * fps)), 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))
