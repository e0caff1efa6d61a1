"""Support of a body in each frame: the stances of its feet, and other body parts on the floor."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.contact import Posed
from motionmind.body.limbs import limb_of_points, limbs_of
from motionmind.body.skeleton import Skeleton
from motionmind.footing.feet import Foot, foot_points, track_of
from motionmind.footing.footfalls import Stance, find_stances, standing_costs
from motionmind.geometry import rotations as rot
from motionmind.jit import jit

SUPPORT_SHARE_HEIGHT_M = 0.02  # metres above the lowest limb at which a limb's share of the support has fallen to 1/e
FIRMNESS_EXPONENT = 4  # exponent: a limb's firmness to this power is its share of the support
LIMB_TOUCHES_M = 0.03  # metres above a limb's lowest point up to which its other points touch the floor
HOLDS_UP_SHARE = 0.3  # share of the support above which a part other than a foot holds the body up
WEIGHT_TAKEOVER_S = 0.12  # seconds for a foot to take over the body's weight
ALSO_BEARS_M = 0.05  # metres above a body's lowest point up to which another part bears it, too
SWING_LOADED_NATS_PER_S = 6.0  # per second: cost of swinging a foot that bears the whole weight of a body at rest
SWING_FALLING_NATS_PER_S = (
    30.0  # per second: cost of swinging a foot without which the body falls; chosen on ballet and karate
)
STANDS_AT_REST_S = 0.3  # seconds from a motionless end during which low feet stand
LOWEST_FOOT_BEARS_M = 0.15  # metres above a body's lowest point up to which its lowest foot may bear it
STAYING_FOOT_REACH_M = (
    0.1  # metres: largest displacement of some point of a foot that stays in place, though it may roll or turn
)


class Shape(NamedTuple):
    """A body and its parts in each frame, relative to the root.

    Attributes:
        places: positions of the points that may touch the floor [N, P, 3], metres.
        feet: whether a point belongs to each foot [feet, P].
        others: whether a point belongs to each other part: limbs without their feet, then the trunk [parts, P].
        low: height of each foot's lowest point [N, feet], metres.
        low_others: the same of the other parts [N, parts]; infinite for one without points.
        tracks: level positions of the feet, constant while they stand or roll [N, feet, 2], metres.
        outward: level unit vectors from the middle of the hips to each leg's [N, feet, 2].
    """

    places: Floats
    feet: Bools
    others: Bools
    low: Floats
    low_others: Floats
    tracks: Floats
    outward: Floats

    @property
    def lowest(self) -> Floats:
        """Height of the lowest point of the body [N], metres."""
        return np.asarray(self.places[..., 1].min(axis=1))


def shape_of(skeleton: Skeleton, posed: Posed, feet: list[Foot]) -> Shape:
    """Return the shape of a body posed about its root."""
    places, limb = posed.places, limb_of_points(skeleton)[posed.joints]
    of_feet = points_of_feet(skeleton, posed.joints, feet)
    others = (limb == np.arange(len(limbs_of(skeleton)) + 1)[:, None]) & ~of_feet.any(axis=0)
    hips = places[:, [foot.leg[0] for foot in feet]][..., [0, 2]]
    outward = hips - hips.mean(axis=1, keepdims=True) if feet else hips
    outward /= np.maximum(np.linalg.norm(outward, axis=-1, keepdims=True), 1e-9)
    tracks = [track_of(foot, places, len(skeleton)) for foot in feet]
    along = np.stack(tracks, axis=1) if feet else np.zeros((len(places), 0, 2))
    return Shape(places, of_feet, others, lowest(places, of_feet), lowest(places, others), along, outward)


def points_of_feet(skeleton: Skeleton, joints: Indices, feet: list[Foot]) -> Bools:
    """Return whether each point belongs to each foot [feet, P], from the joint of each point [P]."""
    own = [foot_points(foot, joints, len(skeleton)) for foot in feet]
    return np.stack(own) if own else np.zeros((0, len(joints)), dtype=np.bool_)


def lowest(places: Floats, parts: Bools) -> Floats:
    """Return the height of the lowest point of each part [N, parts], metres; infinite for a part without points.

    Args:
        places: positions of the body's points [N, P, 3], metres.
        parts: whether a point belongs to each part [parts, P].
    """
    heights = [places[:, own, 1].min(axis=1, initial=np.inf) for own in parts]
    return np.stack(heights, axis=1) if heights else np.zeros((len(places), 0))


def _touching(places: Floats, parts: Bools, low: Floats, bears: Bools) -> Bools:
    """Return whether each point belongs to a bearing part and is about as low as its lowest [N, P]."""
    out = np.zeros(places.shape[:2], dtype=np.bool_)
    for own, lowest_of, on in zip(parts, low.T, bears.T, strict=True):
        out[:, own] |= on[:, None] & (places[:, own, 1] < (lowest_of + LIMB_TOUCHES_M)[:, None])
    return out


class Bearing(NamedTuple):
    """The support of a body in each frame.

    Attributes:
        stances: times and places of each foot's stances.
        loads: share of the weight that each foot may bear [N, feet], 0 to 1; less as a stance begins and ends.
        stands: whether each foot stands [N, feet].
        targets: the feet's places minus their tracks [N, feet, 2], metres: the root's position according to each foot.
        others: share of the support of each other part [N, parts], 0 to 1.
    """

    stances: list[list[Stance]]
    loads: Floats
    stands: Bools
    targets: Floats
    others: Floats

    def all_standing(self) -> Bearing:
        """Return the same with all feet on the floor throughout."""
        return self._replace(stands=np.ones_like(self.stands))

    def touching(self, shape: Shape) -> Bools:
        """Return whether each point touches the floor [N, P]: points of bearing parts, about as low as their lowest."""
        # A foot carries nothing in the frame in which it lands or lifts.
        still = self.stands.copy()
        still[1:] &= self.stands[:-1]
        still[:-1] &= self.stands[1:]
        feet = _touching(shape.places, shape.feet, shape.low, still)
        return feet | _touching(shape.places, shape.others, shape.low_others, self.others > HOLDS_UP_SHARE)


def find_bearing(
    shape: Shape,
    root: Floats,
    mass: Floats,
    firm: Floats,
    flying: Bools,
    staying: int | None,
    moving: tuple[bool, bool],
    passing: tuple[bool, bool],
    feet: list[Foot],
    fps: float,
    falls: Floats | None = None,
) -> Bearing:
    """Find the support of a body, and the steps of its feet.

    Args:
        shape: the body.
        root: level positions of the root if the feet may slide [N, 2], metres.
        mass: level positions of the centre of mass relative to the root [N, 2], metres.
        firm: firmness of each limb, and last of the trunk, where it is low [N, limbs + 1], 0 to 1.
        flying: whether the body is in the air [N].
        staying: a foot that stands throughout, or None.
        moving: whether the body has a velocity in the first and the last frame; if not, low feet rest there.
        passing: whether the body passes through them at any velocity; if not, a foot in the air there takes its time.
        feet: feet of the body.
        fps: frames a second.
        falls: degree to which the body would fall without each foot [N, feet], 0 to 1; None if unknown.
    """
    low = shape.lowest[:, None]
    far = np.minimum(shape.low_others - low, 1.0)
    bears = np.maximum(firm, 1e-3) ** FIRMNESS_EXPONENT
    if feet:  # without a foot near the floor, the lowest part bears, whatever the corpus shows
        lifted = np.clip((shape.low.min(axis=1, keepdims=True) - low) / LOWEST_FOOT_BEARS_M - 1.0, 0.0, 1.0)
        bears = np.maximum(bears, lifted)
    others = bears * np.exp(-far / SUPPORT_SHARE_HEIGHT_M) * np.isfinite(shape.low_others)
    others[flying] = 0.0
    rests = others.max(axis=1, initial=0.0) > HOLDS_UP_SHARE
    frames = np.arange(len(root)) / fps
    rest = [
        np.zeros(len(root)) if moves else np.maximum(1.0 - away / STANDS_AT_REST_S, 0.0)
        for moves, away in zip(moving, (frames, frames[::-1]), strict=True)
    ]
    still = np.maximum(*rest)
    costs = [
        standing_costs(shape.low[:, k] - low[:, 0], np.maximum(firm[:, foot.limb], still))
        for k, foot in enumerate(feet)
    ]
    weighs = SWING_LOADED_NATS_PER_S * still[:, None] * _weights(shape, mass)
    if falls is not None:
        weighs += SWING_FALLING_NATS_PER_S * falls
    costs = [(stand, swing + weighs[:, k]) for k, (stand, swing) in enumerate(costs)]
    tracks = shape.tracks + root[:, None]
    stands = np.stack([stand <= swing for stand, swing in costs], axis=1) if feet else np.zeros((len(root), 0), bool)
    if staying is not None:
        costs[staying] = np.zeros(len(root)), np.full(len(root), np.inf)
        stands[:, staying] = True
    stances: list[list[Stance]] = [[] for _ in feet]
    borne = [np.zeros(0, dtype=np.bool_) for _ in feet]
    for _ in range(2):  # each foot steps while others stand, as found in the previous round
        for k in range(len(feet)):
            bears = stands[:, [other for other in range(len(feet)) if other != k]].any(axis=1) | rests
            if np.array_equal(bears, borne[k]):
                continue  # unchanged
            borne[k] = bears
            stances[k] = find_stances(tracks[:, k], shape.outward[:, k], *costs[k], bears, flying, fps, passing)
            stands[:, k] = False
            for stance in stances[k]:
                stands[stance.start : stance.end + 1, k] = True
    loads, places = np.zeros(stands.shape), tracks.copy()
    for k, own in enumerate(stances):
        for stance in own:
            _write_stance(*stance, WEIGHT_TAKEOVER_S * fps, k, places, loads)
    return Bearing(stances, loads, stands, places - shape.tracks, others)


def _weights(shape: Shape, mass: Floats) -> Floats:
    """Estimate the share of the weight on each foot if all stood [N, feet]; near feet bear more."""
    far = rot.norm(shape.tracks - mass[:, None])
    near = 1.0 / np.maximum(far, 0.03) ** 2
    return np.asarray(near / np.maximum(near.sum(axis=1, keepdims=True), 1e-9)) ** 2


def find_staying(shape: Shape, root: Floats) -> int | None:
    """Return the foot that alone bears the body in the first and the last frame, in one place; None if there is none.

    The foot may roll from heel to toes, or turn on either.

    Args:
        shape: the body.
        root: level positions of the root [N, 2], metres.
    """
    low = np.concatenate([shape.low, shape.low_others], axis=1)[[0, -1]]
    bears = low < low.min(axis=1, keepdims=True) + ALSO_BEARS_M
    if np.any(bears.sum(axis=1) != 1) or np.any(bears[0] != bears[1]) or not bears[0, : shape.low.shape[1]].any():
        return None
    foot = int(bears[0].argmax())
    places = shape.places[[0, -1]][:, shape.feet[foot]][..., [0, 2]]
    moved = places[1] + root[-1] - places[0] - root[0]
    return foot if np.linalg.norm(moved, axis=1).min() < STAYING_FOOT_REACH_M else None


@jit
def _write_stance(
    start: int, end: int, place: Floats, slip: Floats, fades: float, foot: int, places: Floats, loads: Floats
) -> None:
    """Write the places of a foot in its stance [N, feet, 2], metres, and its share of the weight [N, feet].

    The share is 1 within the stance, and falls off towards its beginning and end over `fades` frames.
    """
    for t in range(start, end + 1):
        share = 1.0 if t == end > start else (t - start) * (1.0 / max(end - start, 1))
        for k in range(2):
            places[t, foot, k] = place[k] + share * slip[k]
        since = t - start + 1.0 if start > 0 else np.inf
        until = end - t + 1.0 if end < len(loads) - 1 else np.inf
        s = min(min(since, until) / fades, 1.0)
        loads[t, foot] = s * s * (3.0 - 2.0 * s)
