"""Hold hands and feet in place in the room during a part of an insertion.

The limb compensates for the rest of the body after the search: states are many degrees wide, and a search that held
one would leave the hand some centimetres off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from motionmind._typing import Floats
from motionmind.body.ik import chain_to, reach
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.display import displayed
from motionmind.geometry import rotations as rot
from motionmind.studio.edits import Ask, Pin

_MIN_EASE_S = 0.3  # in which a limb reaches or leaves its place


def stays_of(ask: Ask, skeleton: Skeleton) -> list[Pin]:
    """Return a request's pins with hold "place"; raise SkeletonError if the body lacks a joint."""
    found = [pin for pin in ask.pins if pin.hold == "place"]
    for pin in found:
        skeleton.index(pin.joint)
    return found


def in_place(motion: Motion, pins: Sequence[Pin]) -> tuple[Motion, list[str]]:
    """Return a movement in which hands and feet stay in place, and messages about misses.

    The place is where the hand or foot is when the pin begins; for a pin that lasts until the end but begins later than
    the movement, where it is at the end. The first and the last frame do not change.

    Args:
        motion: the movement.
        pins: the hands and feet, each held from `begins` to `ends`.
    """
    rotations, words = motion.rotations.copy(), []
    for pin in pins:
        joint = motion.skeleton.index(pin.joint)
        places = motion.skeleton.positions(rotations, motion.root)[:, joint]
        shares = (motion.times - motion.times[0]) / (motion.times[-1] - motion.times[0])
        first, last = np.searchsorted(shares, [pin.begins, pin.ends])
        anchor = last if pin.ends == 1.0 and pin.begins > 0.0 else first
        missed = _hold(motion, rotations, joint, _weights(motion, pin, places - places[anchor]), int(anchor))
        if missed > 0.01:  # metres
            words.append(f"{_hand_or_foot(pin.joint)} drifts up to {100 * missed:.0f} cm from its place")
    return replace(motion, rotations=rotations), words


def _hand_or_foot(joint: str) -> str:
    """Return a hand or a foot in words, by its joint."""
    return displayed(joint).replace("wrist", "hand").replace("ankle", "foot").replace("_", " ")


def _weights(motion: Motion, pin: Pin, away: Floats) -> Floats:
    """Return the weight of a joint's place in each frame [T], from 0 to 1.

    It eases in and out, except at an end of the movement where the joint is in place.

    Args:
        motion: the movement.
        pin: the joint, and when it stays.
        away: the joint's displacement from its place in each frame [T, 3], metres.
    """
    seconds = motion.times - motion.times[0]
    long = float(seconds[-1])
    first, last = pin.begins * long, pin.ends * long
    # The ease adds at most 0.6 body heights a second to the limb's speed if time allows. Its peak slope is 1.5 times
    # its mean.
    distances = np.linalg.norm([away[np.searchsorted(seconds, at - 1e-9)] for at in (first, last)], axis=1)
    eases = np.maximum(1.5 * distances / (0.6 * motion.skeleton.height), _MIN_EASE_S)
    ramps = np.ones((2, len(seconds)))
    if pin.begins > 0.0:
        first = max(first, min(_MIN_EASE_S, 0.25 * long))
        ramps[0] = 1.0 - (first - seconds) / min(float(eases[0]), first)
    if pin.ends < 1.0 or pin.begins == 0.0:
        room = float(eases[1]) if pin.ends == 1.0 else _MIN_EASE_S  # seconds to leave the place
        last = min(last, max(long - room, 0.5 * (first + last)))
        ramps[1] = 1.0 - (seconds - last) / min(float(eases[1]), long - last)
    ramp = np.clip(ramps.min(axis=0), 0.0, 1.0)
    ramp[[0, -1]] = 0.0
    return np.asarray(ramp * ramp * (3.0 - 2.0 * ramp))


def _hold(motion: Motion, rotations: Floats, joint: int, weights: Floats, anchor: int) -> float:
    """Turn a limb in `rotations` to hold its joint where it is in frame `anchor`; return the largest miss, metres."""
    skeleton, missed = motion.skeleton, 0.0
    place = skeleton.positions(rotations[anchor], motion.root[anchor])[joint]
    facing = skeleton.global_rotations(rotations[anchor])[joint]
    chain = [*chain_to(skeleton, joint), joint]
    for frame in np.flatnonzero(weights):
        held = reach(skeleton, rotations[frame], motion.root[frame], joint, place)
        above = skeleton.global_rotations(held)[skeleton.parents[joint]]
        held[joint] = rot.inv_mul(above, facing)
        if weights[frame] == 1.0:
            off = skeleton.positions(held, motion.root[frame])[joint] - place
            missed = max(missed, float(np.linalg.norm(off)))
        turns = rot.log(rot.mul_inv(held[chain], rotations[frame, chain]))
        rotations[frame, chain] = rot.normalise(rot.mul(rot.exp(weights[frame] * turns), rotations[frame, chain]))
    return missed
