"""Dancers to be beside: their clips at 30 frames a second, what a viewer sees in them, and pairs of their postures."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from scipy.ndimage import minimum_filter1d

from experiments.material import FPS, RECORDED, corpus, movement
from motionmind import Motion, Posture
from motionmind._typing import Bools, Floats, Ints
from motionmind.body.capsules import legs_depth
from motionmind.body.contact import STANCE_STEP_M, floor_height, foot_slides, lowest_height
from motionmind.body.legs import find_legs
from motionmind.body.plausibility import CALM_MPS2, FALLING_RATIO, GRAVITY_MPS2
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import find_support, stands_alone
from motionmind.geometry import rotations as rot

MEASURES = ("root speed", "root acceleration", "slide", "joints", "legs")
BEYOND = 99.5  # percentile of the dancers' own windows
TOUCHING = 0.01  # metres: legs that are no deeper in each other touch
REST = 0.5  # metres a second squared: level acceleration of a body at rest; balance is measured up to CALM_MPS2
STILL_JOINT = 0.5  # rad/s: no joint's limit is less
_ENOUGH = 30  # frames of which the greatest hundredth says something
_FEW = 50  # windows; where clips have fewer of a length, whole clips count as well


class Seen(NamedTuple):
    """Movement at 30 frames a second as a viewer sees it.

    Attributes:
        greatest: `MEASURES` but the joints, frame by frame: speed and acceleration of the root [T - 1], [T - 2], slide
            of the feet [T - 1], depth of the legs in each other [T]; metres and seconds.
        joints: speeds of the joints [T - 1, J], rad/s.
        bounce: vertical acceleration of the mass, up or down [T - 2], m/s^2; empty where masses are unknown.
        lean: overhang where one limb bears and the mass is accelerated level by less than CALM, less than REST, and
            less than REST in the frames before and after, too [T, 3], metres, else NaN; or empty.
        fall: vertical acceleration in frames in the air whose neighbours are in the air, too, m/s^2.
        skates: whether a foot skates [T - 1].
        swings: whether a foot moves as fast as that, low or not [T - 1].
        airborne: whether the body is in the air [T].
        falls: whether it falls there, by more than half of gravity [T].
    """

    greatest: dict[str, Floats]
    joints: Floats
    bounce: Floats
    lean: Floats
    fall: Floats
    skates: Bools
    swings: Bools
    airborne: Bools
    falls: Bools


def see(motion: Motion) -> Seen:
    """Look at movement at 30 frames a second above a floor at 0."""
    body, rotations, root = motion.skeleton, motion.rotations, motion.root
    support = find_support(body, rotations, root, FPS)
    bounce, lean, fall = np.zeros(0), np.zeros((0, 3)), np.zeros(0)
    falls = np.zeros(len(motion), dtype=np.bool_)
    if support.mass is not None and support.overhang is not None:
        accelerations = FPS**2 * np.diff(support.mass, 2, axis=0)
        level = np.full(len(motion), np.inf)
        level[1:-1] = np.hypot(accelerations[:, 0], accelerations[:, 2])
        calm = np.stack([level < CALM_MPS2, level < REST, minimum_filter1d(level < REST, 3, mode="constant")], axis=1)
        alone = support.bears.sum(axis=1, keepdims=True) == 1
        lean = np.where(calm & alone, support.overhang[:, None], np.nan)
        bounce = np.abs(accelerations[:, 1])
        up = support.airborne
        fall = accelerations[up[:-2] & up[1:-1] & up[2:], 1]
        falls[1:-1] = up[1:-1] & (accelerations[:, 1] < -FALLING_RATIO * GRAVITY_MPS2)
    slides = foot_slides(body, rotations, root).max(axis=1, initial=0.0)
    greatest = {
        "root speed": FPS * np.linalg.norm(np.diff(root, axis=0), axis=1),
        "root acceleration": FPS**2 * np.linalg.norm(np.diff(root, 2, axis=0), axis=1),
        "slide": FPS * slides,
        "legs": legs_depth(body, rotations),
    }
    joints = FPS * rot.angle(rotations[:-1], rotations[1:])
    swings = (
        foot_slides(body, rotations, root, np.inf).max(axis=1, initial=0.0) > STANCE_STEP_M
    )  # all are under such a floor
    return Seen(greatest, joints, bounce, lean, fall, slides > STANCE_STEP_M, swings, support.airborne, falls)


class Limits(NamedTuple):
    """The limits of movement of some length.

    Attributes:
        most: of each of `MEASURES`; that of the joints as a multiple of `joints`.
        joints: what each joint's greatest speed exceeds in one window of two hundred [J], rad/s.
        own: share of the dancers' windows that are beyond any of them.
        leans: shares of the dancers' windows in which the mass is beyond each of `Dancers.lean` [3]; NaN as there.
    """

    most: dict[str, float]
    joints: Floats
    own: float
    leans: Floats


@dataclass(frozen=True, eq=False)
class Dancers:
    """A corpus's clips at 30 frames a second, and its postures, each clip with its floor at 0.

    Attributes:
        body: the skeleton.
        clips: the unbroken pieces.
        seen: how a viewer sees each.
        ends: postures that pairs are drawn from.
        aloft: numbers of those that are in the air: of recorded ones, those in which the dancers fall.
    """

    body: Skeleton
    clips: list[Motion]
    seen: list[Seen]
    ends: list[Posture]
    aloft: Ints
    _limits: dict[int, Limits] = field(default_factory=dict)

    def limits(self, frames: int) -> Limits:
        """Limits of movement of so many frames."""
        if frames not in self._limits:
            self._limits[frames] = self._find_limits(frames)
        return self._limits[frames]

    def _find_limits(self, frames: int) -> Limits:
        long = [seen for clip, seen in zip(self.clips, self.seen, strict=True) if len(clip) >= frames]
        windows = sum(len(seen.airborne) - frames + 1 for seen in long)
        chosen = long if windows >= _FEW else self.seen

        def greatest(values: list[Floats] | list[Bools], less: int) -> Floats:
            """The greatest in each window of values that are `less` fewer than their frames [W, ...]."""
            size = max(frames - less, 1)
            windows = (np.lib.stride_tricks.sliding_window_view(v, min(size, len(v)), axis=0) for v in values)
            return np.concatenate([found.max(axis=-1) for found in windows])

        joints = greatest([seen.joints for seen in chosen], 1)
        each = np.maximum(np.percentile(joints, BEYOND, axis=0), STILL_JOINT)
        all_of = {
            "root speed": greatest([seen.greatest["root speed"] for seen in chosen], 1),
            "root acceleration": greatest([seen.greatest["root acceleration"] for seen in chosen], 2),
            "slide": greatest([seen.greatest["slide"] for seen in chosen], 1),
            "joints": (joints / each).max(axis=1),
            "legs": greatest([seen.greatest["legs"] for seen in chosen], 0),
        }
        most = {name: float(np.percentile(values, BEYOND)) for name, values in all_of.items()}
        most["legs"] = max(most["legs"], TOUCHING)
        count = min(map(len, all_of.values()))
        beyond = np.any([all_of[name][:count] > most[name] for name in MEASURES], axis=0)
        leans = [np.nan_to_num(seen.lean) > self.lean for seen in chosen if len(seen.lean)]
        out = greatest(leans, 0).mean(axis=0) if leans else np.zeros(3)
        out[np.isnan(self.lean)] = np.nan
        return Limits(most, each, float(beyond.mean()), out)

    def worst(self, seen: Seen) -> dict[str, float]:
        """How many times as great as its limit the greatest of each of `MEASURES` is."""
        limits = self.limits(len(seen.airborne))
        out = {name: float(values.max(initial=0.0)) / limits.most[name] for name, values in seen.greatest.items()}
        out["joints"] = float((seen.joints.max(axis=0, initial=0.0) / limits.joints).max()) / limits.most["joints"]
        return out

    @cached_property
    def bounce(self) -> float:
        """The 99th percentile of the vertical acceleration of the dancers' mass, m/s^2."""
        return _percentile([seen.bounce for seen in self.seen])

    @cached_property
    def lean(self) -> Floats:
        """The 99th percentiles of how far it is outside of what they stand on, as in `Seen` [3], metres.

        NaN where they are so in too few frames to tell.
        """
        leans = np.concatenate([seen.lean for seen in self.seen])
        known = [those[np.isfinite(those)] for those in leans.T]
        return np.array([_percentile([those] if len(those) >= _ENOUGH else []) for those in known])

    def far_pairs(self, count: int, seed: int) -> list[tuple[int, int]]:
        """Random pairs of postures."""
        rng = np.random.default_rng(seed)
        return [tuple(map(int, rng.choice(len(self.ends), size=2, replace=False))) for _ in range(count)]

    def one_leg_pairs(self, count: int, seed: int) -> list[tuple[int, int]]:
        """Random pairs of postures that stand on the same single leg."""
        rng, legs = np.random.default_rng(seed), self._legs()
        limbs = [limb for limb, ends in legs.items() if len(ends) > 1]
        chosen = [legs[limbs[int(rng.integers(len(limbs)))]] for _ in range(count)] if limbs else []
        return [tuple(map(int, rng.choice(ends, size=2, replace=False))) for ends in chosen]

    def jumps(self, count: int, seed: int) -> list[tuple[int, int]]:
        """Random pairs of a posture and one in the air."""
        rng, some = np.random.default_rng(seed), count if len(self.aloft) else 0
        return [(int(rng.integers(len(self.ends))), int(rng.choice(self.aloft))) for _ in range(some)]

    def _legs(self) -> dict[int, Ints]:
        rotations, root = np.stack([p.rotations for p in self.ends]), np.stack([p.root for p in self.ends])
        alone = stands_alone(self.body, rotations, root)
        # In the air, too, one limb is the lowest; nothing stands on it.
        alone[[_is_airborne(posture) for posture in self.ends]] = -1
        return {limb: np.flatnonzero(alone == limb) for limb in find_legs(self.body)[0] if np.any(alone == limb)}


@lru_cache(maxsize=2)
def dancers(data: str | None, name: str) -> Dancers:
    """The dancers of a corpus, bundled or recorded."""
    clips = []
    for pieces in movement(data, name, 1).values():
        clips += [piece for piece in _on_the_floor(pieces) if len(piece) > 3]
    seen = [see(clip) for clip in clips]
    if name in RECORDED:
        ends = [clip.posture(k) for clip in clips for k in range(len(clip))]
        aloft = np.flatnonzero(np.concatenate([one.falls for one in seen]))
    else:  # keyframes are what an author writes, and asks for
        whole = corpus(data, name)
        keyed = [one for clip in whole.clips for one in _on_the_floor([whole.motion(clip)])]
        ends = [one.posture(k) for one in keyed for k in range(len(one))]
        aloft = np.flatnonzero([_is_airborne(posture) for posture in ends])
    return Dancers(clips[0].skeleton, clips, seen, ends, aloft)


def _on_the_floor(pieces: list[Motion]) -> list[Motion]:
    """Pieces of one recording, whose zero may be a decimetre off, with their floor at 0."""
    low = [lowest_height(piece.skeleton, piece.rotations, piece.root) for piece in pieces]
    up = np.array([0.0, floor_height(np.concatenate(low)), 0.0])
    return [replace(piece, root=piece.root - up) for piece in pieces]


def nearer(a: Posture, b: Posture, metres: float) -> Posture:
    """Posture `b`, moved level so that its root is within so many metres of that of `a`."""
    way = (b.root - a.root) * np.array([1.0, 0.0, 1.0])
    far = float(np.linalg.norm(way))
    return b if far <= metres else Posture(b.skeleton, b.rotations, b.root - way * (1.0 - metres / far))


def on_the_same_spot(a: Posture, b: Posture) -> Posture:
    """Posture `b`, turned about the vertical and moved so that the leg that it stands on is where that of `a` is.

    The two stand on the same leg; its foot points the same way then, by the bone above its lowest joint.
    """
    body = a.skeleton
    places = [body.positions(p.rotations, p.root) for p in (a, b)]
    low = int(min(range(len(body)), key=lambda joint: places[0][joint, 1]))
    above = body.parents[low]
    headings = [np.arctan2(*(place[low] - place[above])[[0, 2]]) for place in places]
    turn = rot.about_vertical(np.array(headings[0] - headings[1]))
    rotations = b.rotations.copy()
    rotations[0] = rot.mul(turn, rotations[0])
    moved = (places[0][low] - places[1][low]) * np.array([1.0, 0.0, 1.0])
    return Posture(body, rotations, rot.mul_vec(turn, b.root - places[1][low]) + places[1][low] + moved)


def _is_airborne(posture: Posture) -> bool:
    body = posture.skeleton
    return bool(find_support(body, posture.rotations[None], posture.root[None], FPS).airborne[0])


def _percentile(values: list[Floats]) -> float:
    known = np.concatenate([*values, np.zeros(0)])
    return float(np.percentile(known, 99.0)) if len(known) else float("nan")
