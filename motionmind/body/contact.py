"""Whether feet stay where they stand."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot

RATE = 30.0  # frames a second at which feet are looked at
LOW = 0.05  # metres above the floor below which a foot should stand
FAR = 0.025  # metres from one frame to the next by which it may move at most
_SOFT = 0.025  # metres above the floor at which Zhang et al. count a slide no more
_NEAR = 0.1  # of the body's height: how near to its lowest point, at rest, a limb must end to end in a foot


def find_feet(skeleton: Skeleton) -> list[int]:
    """The joints that end in feet: leaves of the tree whose end is, at rest, within a tenth of the body's height of its
    lowest point. In a person those are the toes, in an insect all legs."""
    at_rest = skeleton.positions_and_tips(np.tile(rot.IDENTITY, (len(skeleton), 1)), np.zeros(3))[:, 1]
    ends = np.minimum(at_rest[: len(skeleton)], at_rest[len(skeleton) :])
    low = ends.min() + _NEAR * np.ptp(at_rest)
    return [joint for joint in range(len(skeleton)) if not skeleton.children(joint) and ends[joint] <= low]


def find_floor(skeleton: Skeleton, rotations: Floats, root: Floats) -> float:
    """Height in metres of the floor under movement, whose own zero is often off: where the body's lowest point is in
    the lowest twentieth of the frames [T, J, 4], [T, 3]."""
    return float(np.quantile(skeleton.positions_and_tips(rotations, root)[..., 1].min(axis=-1), 0.05))


def skating(skeleton: Skeleton, rotations: Floats, root: Floats, floor: float = 0.0) -> float:
    """Share of frames in which a foot skates: it is below 5 cm, and moves level by more than 2.5 cm to the next frame.

    Karunratanakul, Preechakul, Suwajanakorn and Tang, "Guided motion diffusion for controllable human motion
    synthesis", ICCV (2023), with these limits but two differences. Frames are at 30 a second, not 20, so that the limit
    is 0.75 m/s, not 0.5. And a foot is both ends of its last bone: one that turns on its ball or on its tip stands. So
    it skates where it has an end below 5 cm in both frames and every such end moves too far. A foot that swings past
    near the floor, as in walking, counts too: judge by what the corpus's own movement has.

    Args:
        skeleton: the body.
        rotations: local rotations [T, J, 4] at 30 frames a second.
        root: positions of the root joint [T, 3], metres.
        floor: height of the floor, metres; `find_floor` tells that of a recording.
    """
    moved, height = _ends(skeleton, rotations, root, floor)
    down = height < LOW
    skates = np.any(down, axis=-1) & np.all(~down | (moved > FAR), axis=-1)
    return float(skates.any(axis=-1).mean()) if len(moved) else 0.0


def foot_slide(skeleton: Skeleton, rotations: Floats, root: Floats, floor: float = 0.0) -> float:
    """How far feet slide, cm a frame at 30 frames a second: the mean over frames and feet of v (2 - 2^(h / 2.5 cm)).

    Zhang, Starke, Komura and Saito, "Mode-adaptive neural networks for quadruped motion control", ACM TOG 37(4)
    (2018): v is how far a foot moves level, h its height, the factor from 1 on the floor to 0 at 2.5 cm and
    above. Of a foot's two ends, as in `skating`, the one that slides least of those that are that low counts.
    """
    moved, height = _ends(skeleton, rotations, root, floor)
    share = np.clip(2.0 - 2.0 ** (height / _SOFT), 0.0, 1.0)
    least = np.where(share > 0.0, moved * share, np.inf).min(axis=-1)
    return float(100.0 * np.where(np.isfinite(least), least, 0.0).mean()) if least.size else 0.0


def _ends(skeleton: Skeleton, rotations: Floats, root: Floats, floor: float) -> tuple[Floats, Floats]:
    """How far both ends of each foot's last bone move level to the next frame, and the greater of their heights in the
    two frames [T - 1, feet, 2], metres."""
    feet = np.array(find_feet(skeleton), dtype=np.intp)
    places = skeleton.positions_and_tips(rotations, root)[:, np.stack([feet, feet + len(skeleton)], axis=-1)]
    moved = np.hypot(np.diff(places[..., 0], axis=0), np.diff(places[..., 2], axis=0))
    height = places[..., 1] - floor
    return moved, np.maximum(height[1:], height[:-1])
