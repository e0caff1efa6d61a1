"""Support of a body in each frame: the stances of its feet, and other body parts on the floor."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.footing.feet import Foot
from motionmind.footing.footfalls import COSTS, Stance, find_stances, standing_costs
from motionmind.footing.ground import Stretch
from motionmind.footing.root import FIRMNESS_EXPONENT
from motionmind.footing.shape import Shape
from motionmind.geometry import rotations as rot

LIMB_TOUCHES_M = 0.03  # above a limb's lowest point, up to which its other points touch the floor
HOLDS_UP_SHARE = 0.3  # of the support, above which a part other than a foot holds the body up


def _touching(places: Floats, parts: Bools, low: Floats, bears: Bools) -> Bools:
    """Return whether each point belongs to a bearing part and is about as low as its lowest point [N, P]."""
    out = np.zeros(places.shape[:2], dtype=np.bool_)
    for own, lowest_of, on in zip(parts, low.T, bears.T, strict=True):
        out[:, own] |= on[:, None] & (places[:, own, 1] < (lowest_of + LIMB_TOUCHES_M)[:, None])
    return out


class SupportPhases(NamedTuple):
    """The support of a body in each frame.

    Attributes:
        stances: times and places of each foot's stances.
        stands: whether each foot stands [N, feet].
        targets: level position of the root at which each foot is in its place [N, feet, 2], metres.
        others: share of the support of each other part [N, parts], 0 to 1.
    """

    stances: list[list[Stance]]
    stands: Bools
    targets: Floats
    others: Floats

    def all_standing(self) -> SupportPhases:
        """Return the same with all feet on the floor throughout."""
        return self._replace(stands=np.ones_like(self.stands))

    def touching(self, shape: Shape) -> Bools:
        """Return whether each point touches the floor [N, P]: points of bearing parts, about as low as their lowest."""
        # A foot carries no weight in the frame in which it lands or lifts.
        still = self.stands.copy()
        still[1:] &= self.stands[:-1]
        still[:-1] &= self.stands[1:]
        feet = _touching(shape.places, shape.feet, shape.low, still)
        return feet | _touching(shape.places, shape.others, shape.low_others, self.others > HOLDS_UP_SHARE)


def find_support_phases(
    shape: Shape,
    stretch: Stretch,
    mass: Floats,
    flying: Bools,
    staying: int | None,
    feet: list[Foot],
    fps: float,
    falls: Floats | None = None,
    lifted: Bools | None = None,
) -> SupportPhases:
    """Find the support of a body, and the steps of its feet.

    Args:
        shape: the body.
        stretch: its movement, over the ground.
        mass: positions of the centre of mass relative to the root [N, 3], metres.
        flying: whether the body is in the air [N].
        staying: a foot that stands throughout, or None.
        feet: feet of the body.
        fps: frames a second.
        falls: degree to which the body would fall without each foot [N, feet], 0 to 1; None if unknown.
        lifted: whether each foot is off the floor for a reach [N, feet]; None for none.
    """
    root, firm = stretch.ground.root[:, [0, 2]], stretch.ground.firm
    others = _support_of_others(shape, firm, flying)
    rests = others.max(axis=1, initial=0.0) > HOLDS_UP_SHARE
    still = _stillness(len(root), stretch.moving, fps)
    low = shape.lowest[:, None]
    costs = [
        standing_costs(shape.low[:, k] - low[:, 0], np.maximum(firm[:, foot.limb], still))
        for k, foot in enumerate(feet)
    ]
    weighs = COSTS.swing_loaded * still[:, None] * _weights(shape, mass[:, [0, 2]])
    if falls is not None:
        weighs += COSTS.swing_falling * falls
    costs = [(stand, swing + weighs[:, k]) for k, (stand, swing) in enumerate(costs)]
    if lifted is not None:
        bears = lifted.any(axis=1, keepdims=True) & ~lifted
        costs = [
            (stand + COSTS.against_request * lifted[:, k], swing + COSTS.against_request * bears[:, k])
            for k, (stand, swing) in enumerate(costs)
        ]
    tracks = shape.tracks + root[:, None]
    stands = np.stack([stand <= swing for stand, swing in costs], axis=1) if feet else np.zeros((len(root), 0), bool)
    if staying is not None:
        costs[staying] = np.zeros(len(root)), np.full(len(root), np.inf)
        stands[:, staying] = True
    stances: list[list[Stance]] = [[] for _ in feet]
    supported = [np.zeros(0, dtype=np.bool_) for _ in feet]
    for _ in range(2):  # each foot steps while others stand, as found in the previous round
        for k in range(len(feet)):
            bears = stands[:, [other for other in range(len(feet)) if other != k]].any(axis=1) | rests
            if np.array_equal(bears, supported[k]):
                continue  # unchanged
            supported[k] = bears
            stances[k] = find_stances(tracks[:, k], shape.outward[:, k], *costs[k], bears, flying, fps, stretch.passing)
            stands[:, k] = False
            for stance in stances[k]:
                stands[stance.start : stance.end + 1, k] = True
    places = tracks.copy()
    for k, own in enumerate(stances):
        for start, end, place, slip in own:
            places[start : end + 1, k] = place + np.linspace(0.0, 1.0, end - start + 1)[:, None] * slip
    return SupportPhases(stances, stands, places - shape.tracks, others)


def _support_of_others(shape: Shape, firm: Floats, flying: Bools) -> Floats:
    """Return the share of the support of each part other than the feet [N, parts], 0 to 1, none while `flying` [N].

    It is the firmness of the part [N, parts] to a power, times a decay with its height above the lowest point.
    """
    low = shape.lowest[:, None]
    far = np.minimum(shape.low_others - low, 1.0)
    bears = np.maximum(firm, 1e-3) ** FIRMNESS_EXPONENT
    if shape.low.shape[1]:  # if the lowest foot is above 0.15 m, the lowest part bears, whatever the corpus shows
        lifted = np.clip((shape.low.min(axis=1, keepdims=True) - low) / 0.15 - 1.0, 0.0, 1.0)
        bears = np.maximum(bears, lifted)
    others = bears * np.exp(-far / 0.02) * np.isfinite(shape.low_others)  # 1/e at 0.02 m
    others[flying] = 0.0
    return others


def _stillness(count: int, moving: tuple[bool, bool], fps: float) -> Floats:
    """Return the nearness of each frame to an end without a velocity [count]: 1 there, 0 from 0.3 s on."""
    frames = np.arange(count) / fps
    rest = [
        np.zeros(count) if moves else np.maximum(1.0 - away / 0.3, 0.0)
        for moves, away in zip(moving, (frames, frames[::-1]), strict=True)
    ]
    return np.maximum(*rest)


def _weights(shape: Shape, mass: Floats) -> Floats:
    """Estimate the share of the weight on each foot if all stood [N, feet], from the level centre of mass [N, 2]."""
    far = rot.norm(shape.tracks - mass[:, None])
    near = 1.0 / np.maximum(far, 0.03) ** 2
    return np.asarray(near / np.maximum(near.sum(axis=1, keepdims=True), 1e-9)) ** 2


def find_staying(shape: Shape, root: Floats) -> int | None:
    """Return the foot that alone supports the body, in one place, in the first and the last frame; None without one.

    The foot may roll from heel to toes, or turn on either.

    Args:
        shape: the body.
        root: level positions of the root [N, 2], metres.
    """
    low = np.concatenate([shape.low, shape.low_others], axis=1)[[0, -1]]
    bears = low < low.min(axis=1, keepdims=True) + 0.05  # m
    if np.any(bears.sum(axis=1) != 1) or np.any(bears[0] != bears[1]) or not bears[0, : shape.low.shape[1]].any():
        return None
    foot = int(bears[0].argmax())
    places = shape.places[[0, -1]][:, shape.feet[foot]][..., [0, 2]]
    moved = places[1] + root[-1] - places[0] - root[0]
    # Some point of the foot stays, though the foot may roll or turn.
    return foot if np.linalg.norm(moved, axis=1).min() < 0.1 else None  # m
