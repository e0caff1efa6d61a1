"""Finds frames that a recording dropped, and fills or leaves out what they leave.

Where a tracker or a network loses frames, files hold something else in their place: the last frame again, zeros, or a
body elsewhere; or nothing, and the frames after them follow at once. A *gap* is

- *repeated* frames in the midst of movement: after them the body is where it would be, had it gone on meanwhile;
- frames in which the whole body is *elsewhere*: it leaps there and back again within a frame, faster than any body;
- a *leap* without a way back, from one frame to the next. A loop whose root is put back leaps the same way each time.

Short gaps are filled by going evenly from the frame before to the frame after, long ones are left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.motion import Motion
from motionmind.body.rates import FILM_FPS
from motionmind.corpus.clip import JointRepair
from motionmind.errors import enumerated
from motionmind.geometry import rotations as rot

# No body is as fast: of the root, and of all joints on average.
_IMPOSSIBLE_MPS, _IMPOSSIBLE_RADPS = 12.0, np.radians(750.0)
MAX_CLOCK_FRAMES = 5  # that a recording at one rate repeats in a file at another
LONGEST_EVEN_GAP_S = 0.25  # a longer gap hides movement that nobody can guess from its ends


class Gap(NamedTuple):
    """Frames of a recording from `start` up to, not including, `stop` that it dropped; none at a leap."""

    start: int
    stop: int
    kind: Literal["repeated", "elsewhere", "leap"]


class Filled(NamedTuple):
    """A recording whose gaps were filled.

    Attributes:
        motion: the recording as it is now.
        repairs: the frames that were filled, by joint.
        left: the gaps that are too long to be filled, and leaps.
        clock: says how many frames the recording's clock repeats, which stay; "" if it repeats none.
        report: says that, and how many frames were dropped, and where; "" if there is nothing to say.
    """

    motion: Motion
    repairs: tuple[JointRepair, ...]
    left: tuple[Gap, ...]
    clock: str
    report: str


def find_gaps(motion: Motion) -> list[Gap]:
    """Find the frames that a recording dropped, in order of time; none in keyframes.

    >>> import numpy as np
    >>> from motionmind import Motion, human23
    >>> at_rest, root = np.tile([0.0, 0.0, 0.0, 1.0], (60, 23, 1)), np.linspace([0, 1, 0], [0, 1, 2], 60)
    >>> root[30:32] = 0.0
    >>> find_gaps(Motion(human23(), at_rest, root, np.arange(60) / 30))
    [Gap(start=30, stop=32, kind='elsewhere')]
    """
    if motion.keyframed or len(motion) < 4 or motion.fps < FILM_FPS:
        return []
    # No more than 45 degrees of a turn in a frame count: joints that flip are no whole body.
    turned = np.minimum(rot.angle(motion.rotations[:-1], motion.rotations[1:]), np.radians(45.0)).mean(axis=1)
    went = rot.norm(np.diff(motion.root, axis=0))
    seconds = np.diff(motion.times)
    # Less than 0.35 m and 20 degrees is noise of a fast camera.
    quick = (went > _IMPOSSIBLE_MPS * seconds) & (went > 0.35)
    quick |= (turned > _IMPOSSIBLE_RADPS * seconds) & (turned > np.radians(20.0))
    leaps = [*_elsewhere(motion, quick)]
    held = [
        gap
        for gap in _repeated(motion, turned + went, seconds)
        if not any(leap.start <= gap.start and gap.stop <= leap.stop for leap in leaps)
    ]
    ends = {gap.stop for gap in held}
    return sorted([*held, *(leap for leap in leaps if leap.kind != "leap" or leap.start not in ends)])


def describe_gaps(motion: Motion, begin: int = 0) -> str:
    """Say how many frames a recording dropped, and where; "" if none were. `begin` is as of `fill_gaps`."""
    gaps = [gap for gap in find_gaps(motion) if gap.start > begin]
    return "; ".join([*_describe(gaps, "", 0), *_describe_leaps(gaps, 0)])


def fill_gaps(motion: Motion, begin: int = 0, skipped: int = 0) -> Filled:
    """Fill the short gaps of a recording, as this module's docstring describes.

    Args:
        motion: the recording.
        begin: frames at its start that are none of the movement, such as an added T-pose.
        skipped: frames of the file before it, which the report counts, too.
    """
    gaps = [gap for gap in find_gaps(motion) if gap.start > begin]
    # So many frames, a few at a time, are repeated by the recording's clock.
    clocks = [gap for gap in gaps if gap.kind == "repeated" and gap.stop - gap.start <= MAX_CLOCK_FRAMES]
    repeated = sum(gap.stop - gap.start for gap in clocks)
    is_clocks = repeated > 0.1 * len(motion)
    if is_clocks:
        gaps = [gap for gap in gaps if gap not in clocks]
    clock = f"{repeated} of {len(motion)} frames repeat the one before; they stay" if is_clocks else ""
    if not gaps:
        return Filled(motion, (), (), clock, clock)
    rotations, root, times = motion.rotations.copy(), motion.root.copy(), motion.times
    repairs: list[JointRepair] = []
    left: list[Gap] = []
    for gap in gaps:
        before, after = gap.start - 1, gap.stop
        if gap.kind == "leap" or times[after] - times[before] > LONGEST_EVEN_GAP_S:
            left.append(gap)
            continue
        go_evenly(times, rotations, root, gap.start, gap.stop)
        at = (float(times[gap.start]), float(times[gap.stop - 1]))
        repairs += [JointRepair(name, gap.start, gap.stop, at, exact=False) for name in motion.skeleton.names]
    report = [clock] * is_clocks
    report += _describe([gap for gap in gaps if gap not in left], ": reconstructed", skipped)
    report += _describe([gap for gap in left if gap.kind != "leap"], ": left out", skipped)
    report += [f"{leaps}: cut there" for leaps in _describe_leaps(left, skipped)]
    filled = replace(motion, rotations=rotations, root=root)
    return Filled(filled, tuple(repairs), tuple(left), clock, "; ".join(report))


def go_evenly(times: Floats, rotations: Floats, root: Floats, start: int, stop: int) -> None:
    """Replace frames `start` to `stop - 1` of `rotations` [T, J, 4] and `root` [T, 3] by even movement, in place."""
    before, after, inner = start - 1, stop, slice(start, stop)
    share = ((times[inner] - times[before]) / (times[after] - times[before]))[:, None]
    rotations[inner] = rot.normalise(rot.slerp(rotations[before], rotations[after], share))
    root[inner] = root[before] + share * (root[after] - root[before])


def _elsewhere(motion: Motion, quick: Bools) -> Iterator[Gap]:
    """Yield frames in which the body is elsewhere, and leaps, given in which steps [T - 1] it leaps."""
    leaps = np.flatnonzero(quick)
    at = 0
    while at < len(leaps):
        start = int(leaps[at]) + 1
        back = next((n for n in range(at + 1, len(leaps)) if _returns(motion, start - 1, int(leaps[n]))), None)
        if back is None:
            yield Gap(start, start, "leap")
            at += 1
        else:
            yield Gap(start, int(leaps[back]) + 1, "elsewhere")
            at = back + 1


def _returns(motion: Motion, there: int, back: int) -> bool:
    """Return whether a body that leaps after frame `there` and after frame `back` is where it may have gone meanwhile.

    It may be there within a second, unless the second leap repeats the first, as where a loop begins again.
    """
    seconds = float(motion.times[back + 1] - motion.times[there])
    turned, went = _apart(motion, there, back + 1)
    is_slow = turned < 0.5 * _IMPOSSIBLE_RADPS * seconds and went < 0.5 * _IMPOSSIBLE_MPS * seconds
    return seconds <= 1.0 and is_slow and not _repeats(motion, there, back)


def _repeats(motion: Motion, first: int, second: int) -> bool:
    """Return whether leaps after two frames begin alike and end alike, rather than undo each other."""
    same, undone = (
        sum(value**2 for a, b in pairs for value in _apart(motion, a, b))
        for pairs in (
            ((first, second), (first + 1, second + 1)),
            ((first, second + 1), (first + 1, second)),
        )
    )
    return same < 0.25 * undone


def _apart(motion: Motion, a: int, b: int) -> tuple[float, float]:
    """Return how far two frames are apart: mean radians of all joints, and metres of the root."""
    turned = float(rot.angle(motion.rotations[a], motion.rotations[b]).mean())
    return turned, float(np.linalg.norm(motion.root[b] - motion.root[a]))


def _repeated(motion: Motion, steps: Floats, seconds: Floats) -> Iterator[Gap]:
    """Yield frames that are repeated in the midst of movement, which goes on from them, and not back.

    Args:
        motion: the recording.
        steps: to each next frame, radians of all joints on average, plus metres of the root [T - 1].
        seconds: to each next frame [T - 1].
    """
    same = steps < 1e-7  # radians and metres: rounding
    edges = np.diff(np.concatenate([[0], same, [0]]).astype(int))
    for first, stop in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True):
        if first == 0 or stop == len(steps):
            continue  # it begins, or ends, still
        around = slice(max(first - 8, 0), stop + 1 + 8)
        pace = float(steps[around].sum() / seconds[around].sum())
        meanwhile = float(seconds[first : stop + 1].sum())
        goes_on = steps[stop] > 0.35 * pace * meanwhile and _way(motion, int(first) - 1, int(stop) + 1) > steps[stop]
        if pace > 0.1 and goes_on:  # radians and metres a second: slower bodies are still
            yield Gap(int(first) + 1, int(stop) + 1, "repeated")


def _way(motion: Motion, a: int, b: int) -> float:
    """Return how far a body is from one frame to another, radians of all joints on average, plus metres of the root."""
    turned = np.minimum(rot.angle(motion.rotations[a], motion.rotations[b]), np.radians(45.0)).mean()
    return float(turned) + float(np.linalg.norm(motion.root[b] - motion.root[a]))


def _describe(gaps: Sequence[Gap], fate: str, skipped: int) -> list[str]:
    """Say how many frames of gaps there are, and where; nothing if there are none."""
    out = []
    for kind, what in (("repeated", "repeat the one before"), ("elsewhere", "have the whole body elsewhere, or zeros")):
        some = [gap for gap in gaps if gap.kind == kind]
        if some:
            number = sum(gap.stop - gap.start for gap in some)
            ends = [(gap.start + skipped, gap.stop - 1 + skipped) for gap in some]
            where = [f"{first}" + f"-{last}" * (last > first) for first, last in ends]
            frames = f"{number} frames {what}" if number > 1 else f"1 frame {what.replace('have', 'has')}"
            out.append(f"{frames.replace('1 frame repeat', '1 frame repeats')} ({_frames(where)}){fate}")
    return out


def _describe_leaps(gaps: Sequence[Gap], skipped: int) -> list[str]:
    """Say where the whole body leaps; nothing if it does not."""
    leaps = [f"{gap.start + skipped}" for gap in gaps if gap.kind == "leap"]
    return [f"the whole body leaps before {_frames(leaps)}"] if leaps else []


def _frames(where: Sequence[str]) -> str:
    return f"frame{'s' * (len(where) > 1 or '-' in where[0])} {enumerated(where, 6)}"
