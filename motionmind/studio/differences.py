"""Describe in a dancer's words how a movement differs from another: "higher right arm, through a step, slower"."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from motionmind._typing import Floats
from motionmind.body.contact import find_feet
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.display import displayed
from motionmind.geometry import rotations as rot

MAX_WORDS = 3
N_SAMPLES_SEEN = 41
# What a viewer tells apart at a glance, for a body 1.7 m high.
ARM_M, LEG_M, LEVEL_M, PATH_M = 0.2, 0.15, 0.1, 0.25
TURN_RAD = np.radians(40.0)
LENGTH_RATIO = 1.15
STEP_M, ON_FLOOR_M = 0.15, 0.06  # least length of a step, and height above its lowest up to which a foot stands
PERSON_M = 1.7


def describe_difference(motion: Motion, first: Motion) -> str:
    """Describe how a movement differs from the first, the greatest difference first; "" if a viewer sees none."""
    found = sorted(_differences(motion, first), key=lambda one: -one[0])
    return ", ".join(words for ratio, words in found[:MAX_WORDS] if ratio >= 1.0)


def _differences(motion: Motion, first: Motion) -> Iterator[tuple[float, str]]:
    """Yield differences as multiples of what a viewer notices, and in words."""
    one, other = (_sampled(each) for each in (motion, first))
    skeleton, places = motion.skeleton, one.positions()
    apart, size = places - other.positions(), skeleton.height / PERSON_M
    faces = rot.about_vertical(-rot.heading(first.rotations[:1, 0]))
    feet = find_feet(skeleton)
    for joint, part in _hands_and_feet(skeleton):
        least = size * (LEG_M if part.endswith("leg") else ARM_M)
        rise = _greatest(apart[:, joint, 1])
        yield abs(rise) / least, f"{'higher' if rise > 0.0 else 'lower'} {part}"
        ahead = _greatest(_ahead(one, joint) - _ahead(other, joint))
        yield abs(ahead) / (1.5 * least), f"{part} farther {'forward' if ahead > 0.0 else 'back'}"
    level = _greatest(apart[:, 0, 1])
    yield abs(level) / (size * LEVEL_M), "rises higher" if level > 0.0 else "sinks deeper"
    across, _, along = rot.mul_vec(faces, apart[:, 0]).T
    side, ahead = _greatest(across), _greatest(along)
    yield abs(side) / (size * PATH_M), f"travels farther {'left' if side > 0.0 else 'right'}"
    yield abs(ahead) / (size * PATH_M), f"travels farther {'forward' if ahead > 0.0 else 'back'}"
    turns = _greatest(_turned(one) - _turned(other))
    yield abs(turns) / float(TURN_RAD), f"turns {'left' if turns > 0.0 else 'right'}"
    steps = _steps(places[:, feet], size) - _steps(other.positions()[:, feet], size)
    more = "through a step" if steps == 1 else f"through {steps} steps"
    yield 1.5 * abs(steps), more if steps > 0 else "with fewer steps"
    seconds = [float(each.times[-1] - each.times[0]) for each in (motion, first)]
    longer = float(np.log(seconds[0] / seconds[1]))
    yield abs(longer) / float(np.log(LENGTH_RATIO)), "slower" if longer > 0.0 else "quicker"


def describe_joints(motion: Motion, first: Motion) -> str:
    """Name the joints in which a movement differs most from the first, by how many degrees, and when."""
    same_share = np.rint(np.linspace(0.0, len(first) - 1, len(motion))).astype(np.intp)
    degrees = np.degrees(rot.angle(motion.rotations, first.rotations[same_share]))
    frame = int(degrees.max(axis=1).argmax())
    most = [int(joint) for joint in np.argsort(-degrees[frame], kind="stable")[:2]]
    named = [
        f"{displayed(motion.skeleton.names[joint]).replace('_', ' ')} by {degrees[frame, joint]:.0f}°"
        for joint in most
        if degrees[frame, joint] >= 10.0  # smaller differences are hard to see
    ]
    if not named:
        return ""
    return f"differs from the first: {' and '.join(named)} at {motion.times[frame] - motion.times[0]:.1f} s"


def _sampled(motion: Motion) -> Motion:
    """Return a motion at even shares of its time."""
    return motion.at(np.linspace(motion.times[0], motion.times[-1], N_SAMPLES_SEEN))


def _greatest(values: Floats) -> float:
    """Return the value of the greatest magnitude, the first of several."""
    return float(values[np.abs(values).argmax()])


def _ahead(motion: Motion, joint: int) -> Floats:
    """Return how far a joint is ahead of the root, as the body faces [N], metres."""
    faces = rot.about_vertical(-rot.heading(motion.rotations[:, 0]))
    return np.asarray(rot.mul_vec(faces, motion.positions()[:, joint] - motion.root)[:, 2])


def _turned(motion: Motion) -> Floats:
    """Return how far a body has turned to its left since the start [N], radians."""
    heading = np.unwrap(rot.heading(motion.rotations[:, 0]))
    return np.asarray(heading - heading[0])


def _hands_and_feet(skeleton: Skeleton) -> Iterator[tuple[int, str]]:
    """Yield the last joint of each arm and leg that has a wrist or an ankle, with its name in words."""
    for joint, name in enumerate(skeleton.names):
        for end, part in (("wrist", "arm"), ("ankle", "leg")):
            if name.endswith(f"_{end}"):
                yield joint, f"{name.removesuffix(f'_{end}')} {part}".replace("_", " ")


def _steps(feet: Floats, size: float) -> int:
    """Count the steps of feet at positions [N, feet, 3]: places on the floor, apart from the one before."""
    count = 0
    for foot in np.swapaxes(feet, 0, 1):
        low = foot[:, 1] < foot[:, 1].min() + size * ON_FLOOR_M
        still = np.zeros(len(foot), dtype=np.bool_)
        still[:-1] = np.linalg.norm(np.diff(foot[:, [0, 2]], axis=0), axis=1) < 0.1 * size * STEP_M
        stood = foot[low & still][:, [0, 2]]
        if len(stood):
            place = stood[0]
            for there in stood[1:]:
                if np.linalg.norm(there - place) > size * STEP_M:
                    count += 1
                    place = there
    return count
