"""From a path of states to a motion: exact at both ends, smooth, near the path, and carried by its feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Int32s
from motionmind.body.motion import Insertion, Motion, Posture, Velocity
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.footing.ground import Given, Stance
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import rotation_spline
from motionmind.solver.motion import Bounds, Synthesis, solve_motion
from motionmind.solver.residual import Residual
from motionmind.synthesis.accents import accented_clock, n_on_count, retimed
from motionmind.synthesis.reference import Reference, find_reference
from motionmind.synthesis.retime import JOINT_SPEED_RATIO, SPEED_HEADROOM_RATIO, slower_steps
from motionmind.synthesis.timeline import Timeline, stretch
from motionmind.synthesis.wishes import Style, Wishes
from motionmind.walks.passages import Danced

MAX_SOLVES = 3  # the first, then others on slower clocks
MAX_ACCENT_SOLVES = 3  # on clocks that bring accents to their times


class Synthesised(NamedTuple):
    """A synthesised path.

    Attributes:
        motion: the motion.
        danced: passage of the corpus that it follows; None for none.
        left_out: share of walks that begin or end in samples that others represent (`mean_walk.MeanWalk`).
        residuals: largest residual of each term of the solve.
    """

    motion: Motion
    danced: Danced | None
    left_out: float
    residuals: tuple[Residual, ...] = ()


def synthesise(path: Int32s, style: Style, wishes: Wishes) -> Synthesised:
    """Return the motion of a path, on the body of its first posture.

    Its first and last frames are exactly the given postures; at the moves in `through`, its joints and its facing are
    those of the postures there. Its reference (`motionmind.synthesis.reference`) is the mean of the corpus walks from
    `a` to `b` in that time, weighted by their nearness to the path (`motionmind.walks.likelihood`), with a C2 spline
    between the moves. The reference bends smoothly towards states that a chain would miss, and moves like a passage of
    the corpus (`motionmind.walks.passages`).

    The motion is the one nearest to its reference that satisfies contacts, gravity and joint limits
    (`motionmind.solver.motion`). The floor is at 0, lower under an end below 0, and higher under an end that is
    higher than the corpus's bodies in such postures. Where the motion exceeds a bound on speed, its clock slows down
    for another solve.

    Args:
        path: states of the chains [T + 1, L].
        style: style of the motion.
        wishes: request for it.
    """
    a, skeleton = wishes.a, wishes.a.skeleton
    if len(path) == 1:
        still = Motion(skeleton, a.rotations[None], a.root[None], np.zeros(1), "tween", (Insertion(np.zeros(1)),))
        return Synthesised(still, None, 0.0)
    reference, pace = find_reference(path, style, wishes), max(wishes.pace, 1.0)
    peaks = None
    if style.peaks is not None:  # of movement at most 1.1 times as long
        peaks = style.peaks(1.1 * float(reference.clock.frames[-1]), pace)
    final, strict = peaks, peaks
    if wishes.length is not None or not wishes.slows:  # fast parts then take time from slow ones, or stay
        strict = None
    if strict is not None:
        given = [0, *(2 * move for move in wishes.through), -1]
        stance = _without_high_jumps(reference.stance, 0.95 * strict[-2] * skeleton.height, given)
        reference, final = reference._replace(stance=stance), _final_peaks(strict, style.fastest, pace, len(skeleton))
    return _synthesise(reference, style, wishes, final, _bounds(style, wishes, final, strict, pace))


def _bounds(style: Style, wishes: Wishes, final: Floats | None, strict: Floats | None, pace: float) -> Bounds:
    """Return the bounds of the solve, from those of the finished movement [J + 4] and from the corpus's peaks [J + 4].

    None stands for no bounds.
    """
    joints, height = len(wishes.a.skeleton), wishes.a.skeleton.height
    travels = np.inf
    if style.fastest is not None and wishes.length is None:
        travels = SPEED_HEADROOM_RATIO * pace * float(style.fastest[-1])
    wished = wishes.wished[:joints].copy()
    wished[0] |= wishes.wished[joints:].any()  # the root turns the facing
    kept = None if final is None else 0.97 * final  # the solve exceeds its bounds slightly
    return Bounds(
        wishes.fixed[:joints],
        wished,
        style.statistics.loose,
        style.statistics.touches,
        None if kept is None else kept[:joints],
        np.inf if kept is None else float(kept[joints]),
        travels * height,
        np.inf if kept is None else float(kept[joints + 2]) * height,
        np.inf if strict is None else float(strict[-1]) * height,
    )


def _synthesise(
    reference: Reference, style: Style, wishes: Wishes, final: Floats | None, bounds: Bounds
) -> Synthesised:
    """Synthesise a motion, and again on slower clocks while it exceeds the bounds of the finished movement [J + 4]."""
    a, b, pace = wishes.a, wishes.b, max(wishes.pace, 1.0)
    clock, rotations, stance = reference.clock, reference.rotations, reference.stance
    kept = [] if wishes.length is None else [*(clock.moves[move] for move in wishes.fixed_times), clock.frames[-1]]
    velocities = _root_velocity(wishes.leaving), _root_velocity(wishes.arriving)
    course = wishes.course
    ends = Given(reference.low, (a.root, b.root), velocities, None if course else wishes.route, course)
    before: Synthesis | None = None
    n_slower, n_accented, accented = 0, 0, list[Motion]()
    while True:
        made = solve_motion(
            a.skeleton,
            course.faced(rotations, clock.frames) if course else rotations,
            clock.frames,
            stance,
            ends,
            bounds,
            wishes.without,
            before,
            reaches=wishes.reaches,
            stays=wishes.stays,
        )
        motion = _motion_between(a, b, made.rotations, made.root, clock)
        steps = None
        if final is not None and wishes.slows and n_slower < MAX_SOLVES - 1:
            slower = slower_steps(motion, final, wishes.moving, pace * style.slides, kept)
            steps = slower if slower.max() >= 1.02 else None  # less is not worth another solve
            n_slower += 1
        if steps is None:
            n_slower = MAX_SOLVES
            if wishes.accents is None:
                break
            shown = accented_clock(
                motion, wishes.accents, _joint_speeds(final, bounds), wishes.moving, _given_times(wishes, kept)
            )
            made_so_far = replace(motion, insertions=(Insertion(clock.moves),))
            accented.append(made_so_far if shown is None else retimed(made_so_far, shown))
            if shown is None or n_accented == MAX_ACCENT_SOLVES:
                break
            steps = np.diff(np.interp(clock.frames, shown, clock.frames)) / np.diff(clock.frames)
            n_accented += 1
        was, end = clock.frames, clock.frames[-1]
        clock, at = stretch(clock, was, steps, wishes.fps)
        if kept:  # to the last digit
            clock = clock._replace(frames=np.append(clock.frames[:-1], end), moves=np.append(clock.moves[:-1], end))
        then = np.interp(clock.frames, at, was)
        rotations = rot.normalise(rotation_spline(was, rotations, then))
        rotations[0], rotations[-1] = a.rotations, b.rotations
        before = made.at(was, then)
        stance = stance._replace(half_steps=np.interp(stance.half_steps, was, at))
    motion = replace(motion, insertions=(Insertion(clock.moves),))
    if wishes.accents is not None:  # of those on equally many counts, the one that was solved last
        motion = max(reversed(accented), key=partial(n_on_count, wishes.accents))
    return Synthesised(motion, reference.danced, reference.left_out, made.residuals)


def _given_times(wishes: Wishes, kept: Sequence[float]) -> list[float]:
    """Return the times between A and B that a movement of given length keeps: of `kept` vias, reaches and stays."""
    end = kept[-1]
    shares = [share for stay in wishes.stays for share in (stay.begins, stay.ends)]
    times = {*kept[:-1], *(reach.seconds for reach in wishes.reaches), *(share * end for share in shares)}
    return sorted(time for time in times if 0.0 < time < end)


def _joint_speeds(final: Floats | None, bounds: Bounds) -> Floats | None:
    """Return the greatest speeds of the joints in the finished movement [J], rad/s; None for no bound."""
    return None if final is None else final[: len(bounds.fixed)]


def _motion_between(a: Posture, b: Posture, rotations: Floats, root: Floats, clock: Timeline) -> Motion:
    """Return a motion of rotations [N, J, 4] and root positions [N, 3], metres, whose ends are exactly `a` and `b`."""
    rotations = rot.normalise(rotations)
    rotations[0], rotations[-1], root[0], root[-1] = a.rotations, b.rotations, a.root, b.root
    return Motion(a.skeleton, rotations, root, clock.frames, "tween")


def _root_velocity(velocity: Velocity | None) -> Floats | None:
    """Return the velocity of the root [3], m/s; None for none."""
    return None if velocity is None else velocity.root


def _without_high_jumps(stance: Stance, fastest: float, given: Sequence[int]) -> Stance:
    """Return a stance without the jumps that take off faster than `fastest`, m/s; those at `given` half steps stay."""
    high = np.sqrt(2.0 * GRAVITY_MPS2 * stance.leaps) > fastest
    high[given] = False
    return stance._replace(aloft=np.where(high, 0.0, stance.aloft))


def _final_peaks(peaks: Floats, speeds: Floats | None, pace: float, joints: int) -> Floats:
    """Return the bounds of the finished movement [J + 4]: slightly below the corpus's peaks [J + 4] and, for joints,
    slightly above the 99th percentiles of the corpus's `speeds` [J + 2] at a pace."""
    out = 0.92 * peaks  # chosen on cmu-05
    if speeds is not None:
        out[:joints] = np.minimum(out[:joints], JOINT_SPEED_RATIO * pace * speeds[:joints])
    return out
