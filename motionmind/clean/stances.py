"""Stances of a recording: in which frames each foot stands.

A foot stands in a run of frames in which its leg bears the body (`motionmind.body.support`) and one of its points on
the floor, heel, ball or tip, hardly moves. A leg also bears the body while its foot turns or slides.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d, percentile_filter

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.contact import Posed, floor_height, pose
from motionmind.body.limbs import limb_of_points
from motionmind.body.motion import Motion
from motionmind.body.support import SUPPORT_HEIGHT_M, find_bearers, size_of
from motionmind.body.tempo import runs_of
from motionmind.clean.jitter import smooth
from motionmind.footing.feet import Foot, find_free_feet, foot_points
from motionmind.geometry import rotations as rot

STANDS_MPS = 0.15  # faster points do not stand; cmu-05, indian, cmu-16: three quarters of bearing feet are slower
STEADY_HZ = 6.0  # cut-off of the movement in which stances are found
SHORTEST_STANCE_S = 0.1
FLIGHT_S = 1.0  # longer than anybody flies
SHORTEST_SWING_S = 0.06
_ALOFT_MPS = 1e3  # faster than any foot


class FootStances(NamedTuple):
    """The stances of a foot.

    Attributes:
        foot: the foot.
        points: indices of its points (`motionmind.body.contact.contact_points`) [Q].
        speeds: speeds of its points [T, Q], m/s; points off the floor are faster than any foot.
        stances: first frame of each stance, and the frame after it.
        bears: whether its leg bears the body, also while the foot turns or slides [T].
    """

    foot: Foot
    points: Indices
    speeds: Floats
    stances: list[tuple[int, int]]
    bears: Bools


def find_foot_stances(motion: Motion) -> tuple[Posed, list[FootStances]]:
    """Find the stances of each foot of a recording, y up; return its poses, too.

    A movement of less than twice the shortest stance has no stances, nor has a body without feet.
    """
    skeleton, fps = motion.skeleton, motion.fps
    posed, size = pose(skeleton, motion.rotations, motion.root), size_of(skeleton)
    feet = find_free_feet(skeleton, np.zeros(len(skeleton), dtype=np.bool_))
    if not feet or len(motion) < max(4, round(2.0 * SHORTEST_STANCE_S * fps)):
        return posed, []
    steady = smooth(posed.places, min(STEADY_HZ, 0.4 * fps), fps)
    limb = limb_of_points(skeleton)[posed.joints]
    floor = floor_heights(posed.lowest, fps)
    bears, _, touches = find_bearers(steady, limb, size, fps, floor)
    out = []
    for foot in feet:
        own = np.flatnonzero(foot_points(foot, posed.joints, len(skeleton)))
        speeds = _speeds(steady[:, own], fps) + np.where(touches[:, own], 0.0, _ALOFT_MPS)
        stances = _stances(bears[:, foot.limb] & (speeds.min(axis=1) < STANDS_MPS * size), fps)
        out.append(FootStances(foot, own, speeds, stances, _in_runs(_stances(bears[:, foot.limb], fps), len(motion))))
    # A body on the floor needs a support: if all feet are too fast to bear, as in a spin, the lowest one bears.
    slides = ~np.any([each.bears for each in out], axis=0) & (posed.lowest < floor + SUPPORT_HEIGHT_M * size)
    lowest = limb[steady[..., 1].argmin(axis=1)]
    return posed, [each._replace(bears=each.bears | (slides & (lowest == each.foot.limb))) for each in out]


def floor_heights(lowest: Floats, fps: float) -> Floats:
    """Return the height of the floor in each frame [T], metres, from the heights [T] of the body's lowest point.

    The floor of a recording may tilt: across the room of `cmu-05`, 05_05, it falls by 10 cm. So the floor is as high as
    the lowest points within about a second, in which every flight ends.
    """
    near = percentile_filter(lowest, 5.0, size=2 * round(FLIGHT_S * fps) + 1, mode="nearest")
    return np.asarray(np.maximum(near, floor_height(lowest)))


def _stances(bears: Bools, fps: float) -> list[tuple[int, int]]:
    """Return the first frame of each stance and the frame after it, given the frames in which a leg bears [T]."""
    joined = bears.copy()
    for start, stop in runs_of(~bears):
        if start > 0 and stop < len(bears) and stop - start < SHORTEST_SWING_S * fps:
            joined[start:stop] = True
    return [(start, stop) for start, stop in runs_of(joined) if stop - start >= max(3, SHORTEST_STANCE_S * fps)]


def _in_runs(runs: list[tuple[int, int]], count: int) -> Bools:
    """Return whether each of `count` frames is in one of the runs."""
    out = np.zeros(count, dtype=np.bool_)
    for start, stop in runs:
        out[start:stop] = True
    return out


def _speeds(places: Floats, fps: float) -> Floats:
    """Return the speeds of points [T, Q], m/s, averaged over 0.04 s, so that the stillest changes rarely."""
    return np.asarray(gaussian_filter1d(rot.norm(np.gradient(places, axis=0)) * fps, 0.04 * fps, axis=0))
