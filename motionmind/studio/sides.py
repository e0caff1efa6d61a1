"""Movement on both sides of a seam, and the user's request, as input for the engine.

The rules are those of variations (`motionmind.variation.piece`): both ends stand above the origin and face ahead, or
keep their own headings if the corpus's dancers face the audience. Frames beside each end show its speed, as far as the
recording has them. A posture that is held shows the speed 0.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from motionmind.body.limbs import limbs_of
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.corpus import Facing
from motionmind.studio.asks import Ask
from motionmind.studio.neighbours import End
from motionmind.studio.placement import Marks, Movements, check_body
from motionmind.tween.options import StayOption
from motionmind.variation.piece import Piece

_REST_S = 0.2  # of a held posture, which shows that it does not move
_CONTEXT_S = 1.0  # on each side of a seam; `Piece.around` takes what it needs


class Sides(NamedTuple):
    """The input for the engine at a seam.

    Attributes:
        a: the posture that the seam leads from.
        b: the posture that it leads to.
        before: frames that lead up to `a`; None at a posture that is not held, or where the recording begins.
        after: frames that follow `b`; None likewise.
        seconds: time from `a` to `b` without an insertion.
    """

    a: Posture
    b: Posture
    before: Motion | None
    after: Motion | None
    seconds: float


def sides_of(ends: tuple[End, End], movement: Movements, facing: Facing) -> Sides:
    """Return the movement on both sides of a seam.

    Args:
        ends: start and end of the seam.
        movement: returns movements by key.
        facing: the corpus's; with "stage", the postures keep their own headings.

    Raises:
        MotionMindError: there is no such movement.
        SkeletonError: the two ends have different skeletons.
    """
    one, other = (movement(end.key) for end in ends)
    check_body(ends[0].key, one, ends[1].key, other)
    begin, stop = ends[0].frame, ends[1].frame + 1
    if ends[0].moves:
        earliest = one.times[begin] - _CONTEXT_S * (ends[0].pace or 1.0)
        begin = min(int(np.searchsorted(one.times, earliest)), max(begin - 1, 0))
    if ends[1].moves:
        latest = other.times[stop - 1] + _CONTEXT_S * (ends[1].pace or 1.0)
        stop = max(int(np.searchsorted(other.times, latest)), min(stop + 1, len(other)))
    before, after = one.slice(begin, ends[0].frame + 1), other.slice(ends[1].frame, stop)
    before, after = (_played(side, end) for end, side in zip(ends, (before, after), strict=True))
    seconds = Marks(movement).step(ends[0].key, ends[0].frame) / (ends[0].pace or 1.0)
    clock = float(before.times[-1]) + seconds - float(after.times[0])
    both = replace(
        before,
        rotations=np.concatenate([before.rotations, after.rotations]),
        root=np.concatenate([before.root, after.root]),
        times=np.concatenate([before.times, after.times + clock]),
        insertions=(),
    )
    i = len(before) - 1
    piece = Piece.of(both, facing=facing)
    return Sides(*piece.ends(i, i + 1), *piece.around(i, i + 1), seconds)


def _played(side: Motion, end: End) -> Motion:
    """Return the movement on one side of a seam as it plays: at its pace, or, in its only frame, at rest."""
    if end.rests:
        return side.at(side.times[0] + np.linspace(0.0, _REST_S, 3))
    return side if end.pace is None else replace(side, times=side.times / end.pace, insertions=(), rate=0.0)


def options_of(ask: Ask, skeleton: Skeleton, movement: Movements) -> dict[str, Any]:
    """Convert a request to options of the engine.

    Args:
        ask: the request.
        skeleton: the body.
        movement: returns movements by key.

    Raises:
        MotionMindError: there is no such joint, movement or frame.
    """
    options: dict[str, Any] = {}
    if ask.seconds is not None:
        options["duration"] = ask.seconds
    if ask.passing:
        options["via"] = [movement(one.posture).posture(one.frame) for one in ask.passing]
    pin: dict[str, str] = {}
    hold: list[str] = []
    stays: list[StayOption] = []
    for one in ask.pins:
        if one.hold == "place":
            skeleton.index(one.joint)  # raises if there is none
            stays.append((one.joint, one.begins, one.ends))
            continue
        limb = _limb(skeleton, one.joint)
        if one.hold == "throughout":
            hold += [joint for joint in limb if joint not in hold]
        else:
            pin |= dict.fromkeys(limb, "A" if one.hold == "start" else "B")
    if pin:
        options["pin"] = pin
    if hold:
        options["hold"] = hold
    if stays:
        options["stay"] = stays
    if ask.reaches:
        for reach in ask.reaches:
            skeleton.index(reach.joint)  # raises if there is none
        options["reach"] = [(reach.joint, reach.place, reach.at) for reach in ask.reaches]
    if ask.travel is not None:
        *_, last = points = ask.travel.points
        options["to"] = last if ask.travel.facing is None else (*last, ask.travel.facing)
        if len(points) > 1:
            options["along"] = points
    return options


def _limb(skeleton: Skeleton, joint: str) -> list[str]:
    """Return the names of the joints of a limb, down to a hand or a foot."""
    wanted = skeleton.index(joint)
    for limb in limbs_of(skeleton):
        if wanted in limb:
            return [skeleton.names[one] for one in limb[: limb.index(wanted) + 1]]
    return [joint]
