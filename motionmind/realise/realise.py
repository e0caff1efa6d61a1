"""From a path of states to a motion: exact at both ends, smooth, near the path, and carried by its feet."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Int32s
from motionmind.body.contact import lowest_height
from motionmind.body.limits import within_limits
from motionmind.body.motion import Insertion, Motion, Posture, Velocity
from motionmind.body.plausibility import GRAVITY
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import size_of
from motionmind.corpus.corpus import Corpus, subdivide_times
from motionmind.footing.corrections import Correction
from motionmind.footing.ground import Given, Stance, ends_in_air
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import rotation_spline
from motionmind.grammar.grammar import Grammar
from motionmind.learned.carriage import Carriage
from motionmind.realise.bending import allowed_off, bend_to_states
from motionmind.realise.retime import (
    COMPARED_DURATION_RATIO,
    FINAL_PEAK_RATIO,
    JOINT_SPEED_RATIO,
    JUMP_RISE_RATIO,
    SPEED_HEADROOM_RATIO,
    jump_in_time,
    keep_pace,
    land_between,
    slower_steps,
)
from motionmind.realise.timeline import Timeline, stretch, timeline
from motionmind.synth.gave import Gave
from motionmind.synth.synthesise import Bounds, Synthesis, synthesise
from motionmind.walks.expectation import Expectation, expect
from motionmind.walks.headings import travel_along
from motionmind.walks.minimal import departure
from motionmind.walks.passages import Danced, Place, dance
from motionmind.walks.stops import Stop, stop_at

DANCED_WITHIN = (
    0.9  # tolerances by which a passage may take a joint off its state; the rest is for the arc between frames
)
MAX_SOLVES = 3  # most solves: the first, then others on slower clocks
SPEED_BOUND_RATIO = 0.97  # share of the speed bounds given to the solve, which exceeds them slightly
MIN_STRETCH_RATIO = 1.02  # smallest stretch of a step worth another solve
_SAME_ORIENTATION_RAD = 1e-9  # radians: orientations no farther apart differ by rounding alone
_MOTIONLESS_RAD = 2e-3  # radians: a joint that returns to its start and goes no farther does not move


class Realised(NamedTuple):
    """A realised path.

    Attributes:
        motion: the motion.
        danced: passage of the corpus that it follows; None for none.
        left_out: share of walks that begin or end in samples that others stand for (`mean_walk.MeanWalk`).
        gave: largest residual of each term of the solve.
    """

    motion: Motion
    danced: Danced | None
    left_out: float
    gave: tuple[Gave, ...] = ()


class Style(NamedTuple):
    """The style of a motion, learned from a corpus.

    Attributes:
        corpus: the corpus.
        grammar: its states and transitions.
        carriage: its posture statistics: travel and stance.
        tolerances: angle within which a state of each chain stands for an orientation [L], radians.
        fastest: greatest speeds of the joints, of turning and of travel [J + 2], as in `motionmind.learned.pace`, at a
            pace of 1; None for no bound. With a given length they hold as far as slower parts leave time.
        peaks: returns the bounds on the peaks of movement of so many seconds at a pace [J + 4], as
            `motionmind.learned.pace.Pace.peaks_in` does; None for no bounds.
        slides: greatest speed of a foot near the floor at a pace of 1, heights/s, in movement with `peaks`.
    """

    corpus: Corpus
    grammar: Grammar
    carriage: Carriage
    tolerances: Floats
    fastest: Floats | None = None
    peaks: Callable[[float, float], Floats] | None = None
    slides: float = np.inf


class Wishes(NamedTuple):
    """The request for a motion, besides its path.

    Attributes:
        a: first posture.
        b: last posture.
        wished: chains that the request constrains beyond their ends [L].
        fixed: chains among them that must not move, not even for the feet [L].
        fps: frames a second; the motion is stretched by less than a frame so that `b` falls on one.
        length: duration, seconds; None for the typical duration of the corpus.
        through: postures on the way, by the number of moves that lead there, increasing.
        leaving: velocity at `a`; None where unknown.
        arriving: velocity at `b`; None where unknown.
        without: terms of the solve to leave out.
        pace: speed relative to the corpus, where there is no `length`.
        slows: whether the clock may slow down; if not, the given moves keep their durations.
        liveliness: 0 for the mean of walks, up to 1 for a passage of the corpus (`motionmind.walks.passages`).
        place: start of that passage in the corpus; None for any.
    """

    a: Posture
    b: Posture
    wished: Bools
    fixed: Bools
    fps: float
    length: float | None = None
    through: Mapping[int, Posture] = MappingProxyType({})
    leaving: Velocity | None = None
    arriving: Velocity | None = None
    without: Collection[Correction] = ()
    pace: float = 1.0
    slows: bool = True
    liveliness: float = 0.5
    place: Place | None = None

    @property
    def moving(self) -> tuple[bool, bool]:
        """Whether the body passes the first and the last posture at a given velocity."""
        return self.leaving is not None, self.arriving is not None


def realise(path: Int32s, style: Style, wishes: Wishes) -> Realised:
    """Return the motion of a path, on the body of its first posture.

    Its first and last frames are exactly the given postures; at the moves in `through`, its joints and its facing are
    those of the postures there. Its reference is the mean of the corpus walks from `a` to `b` in that time, weighted by
    their nearness to the path (`motionmind.walks.likelihood`), with a C2 spline between the moves. Where that leaves a
    chain too far from its state, the reference bends towards it, smoothly. It moves like a passage of the corpus
    (`motionmind.walks.passages`).

    The motion is the one nearest to its reference that stands, falls and turns as bodies do
    (`motionmind.synth.synthesise`). The floor is at 0, lower under an end below 0, and higher under an end that is
    higher than the corpus's bodies in such postures. Where the motion exceeds a bound on speed, its clock slows down
    and it is solved again.

    Args:
        path: states of the chains [T + 1, L].
        style: style of the motion.
        wishes: request for it.
    """
    a, b = wishes.a, wishes.b
    if len(path) == 1:
        still = Motion(a.skeleton, a.rotations[None], a.root[None], np.zeros(1), "tween", (Insertion(np.zeros(1)),))
        return Realised(still, None, 0.0)
    reference = _find_reference(path, style, wishes)
    clock, rotations, stance, joints = reference.clock, reference.rotations, reference.stance, len(a.skeleton)
    pace = max(wishes.pace, 1.0)
    lasts, most, caps = wishes.length is not None, None, None
    if style.peaks is not None:
        caps = most = style.peaks(COMPARED_DURATION_RATIO * float(clock.frames[-1]), pace)
    if lasts or not wishes.slows:  # fast parts then take time from slow ones, or stay
        most = None
    if most is not None and caps is not None:
        given = [0, *(2 * move for move in wishes.through), -1]
        stance = _without_high_jumps(stance, JUMP_RISE_RATIO * most[-2] * a.skeleton.height, given)
        caps = _quickest(caps, style.fastest, pace, joints)
    travels = np.inf if style.fastest is None or lasts else SPEED_HEADROOM_RATIO * pace * float(style.fastest[-1])
    wished = wishes.wished[:joints].copy()
    wished[0] |= wishes.wished[joints:].any()  # the root turns the facing
    kept = None if caps is None else SPEED_BOUND_RATIO * caps
    bounds = Bounds(
        wishes.fixed[:joints],
        wished,
        style.carriage.loose,
        style.carriage.touches,
        None if kept is None else kept[:joints],
        np.inf if kept is None else float(kept[joints]),
        travels * a.skeleton.height,
        np.inf if kept is None else float(kept[joints + 2]) * a.skeleton.height,
        np.inf if most is None else float(most[-1]) * a.skeleton.height,
    )
    ends = Given(reference.low, (a.root, b.root), (_rate(wishes.leaving), _rate(wishes.arriving)))
    before: Synthesis | None = None
    for number in range(MAX_SOLVES):
        made = synthesise(a.skeleton, rotations, clock.frames, stance, ends, bounds, wishes.without, before)
        motion = _exact(a, b, made.rotations, made.root, clock)
        if caps is None or not wishes.slows or number == MAX_SOLVES - 1:
            break
        slower = slower_steps(motion, caps, wishes.moving, pace * style.slides, lasts)
        if slower.max() < MIN_STRETCH_RATIO:
            break
        was, end = clock.frames, clock.frames[-1]
        clock, at = stretch(clock, was, slower, wishes.fps)
        if lasts:  # the given length holds to the last digit
            clock = clock._replace(frames=np.append(clock.frames[:-1], end), moves=np.append(clock.moves[:-1], end))
        then = np.interp(clock.frames, at, was)
        rotations = rot.normalise(rotation_spline(was, rotations, then))
        rotations[0], rotations[-1] = a.rotations, b.rotations
        before = made.at(was, then)
        stance = stance._replace(half_steps=np.interp(stance.half_steps, was, at))
    motion = replace(motion, insertions=(Insertion(clock.moves),))
    return Realised(motion, reference.danced, reference.left_out, made.gave)


def _exact(a: Posture, b: Posture, rotations: Floats, root: Floats, clock: Timeline) -> Motion:
    """Return a motion of rotations [N, J, 4] and root positions [N, 3], metres, whose ends are exactly `a` and `b`."""
    rotations = rot.normalise(rotations)
    rotations[0], rotations[-1], root[0], root[-1] = a.rotations, b.rotations, a.root, b.root
    return Motion(a.skeleton, rotations, root, clock.frames, "tween")


class _Reference(NamedTuple):
    """The reference of a motion: local rotations [N, J, 4], and the stances of the corpus's bodies along it."""

    clock: Timeline
    rotations: Floats
    stance: Stance
    low: dict[int, float]
    danced: Danced | None
    left_out: float


def _find_reference(path: Int32s, style: Style, wishes: Wishes) -> _Reference:
    """Return the mean of the corpus walks near a path, moved like a passage, in the time that they take."""
    a, b, corpus, carriage, grammar = wishes.a, wishes.b, style.corpus, style.carriage, style.grammar
    clock = timeline(path, grammar.transitions, wishes.fps, wishes.length)
    postures = {0: a, **wishes.through, len(path) - 1: b}
    stops = {move: stop_at(corpus, posture) for move, posture in postures.items()}
    # The walk is found at a pace of 1, then scaled in time.
    slower = 1.0 if wishes.length else 1.0 / wishes.pace
    stops[0] = stop_at(corpus, a, _times(slower, wishes.leaving))
    stops[len(path) - 1] = stop_at(corpus, b, _times(slower, wishes.arriving))
    states = grammar.centres[grammar.transitions.starts[: path.shape[1]] + path]
    walk = _walk_near(states, clock, stops, corpus, carriage, wishes.length is None and not wishes.through)
    chains = walk.chains(corpus, clock.moves)
    within = allowed_off(chains, path, grammar, style.tolerances, wishes.wished)
    walk = bend_to_states(walk, chains, states, clock, stops, corpus, within)
    size = a.skeleton.height / corpus.skeleton.height if corpus.skeleton.height > 0.0 else 1.0
    travel = travel_along(walk.trust[:, :1] * (walk.moves @ carriage.travel[walk.of_moves]), walk.headings)
    given = [0, *(2 * move for move in wishes.through), -1]
    low = _given_heights(postures, walk)
    # Heights are those of the body of `a`, which moves; `b` may have stood on shorter legs.
    stance = _stance(walk, carriage, travel, size, given)
    if wishes.length is None:
        longer = np.full(len(travel), slower)
        if style.fastest is not None:
            missing = (b.root - a.root) / size - travel.sum(axis=0)
            even = travel + missing / len(travel)
            longer *= keep_pace(walk, clock.frames, corpus, style.fastest, even, wishes.moving)
            if "flight" not in wishes.without:
                # Steps and weight shifts keep their own time: a slower body takes them as fast as the corpus does.
                quick = max(wishes.pace, 1.0) * style.fastest
                longer *= _for_jumps(walk, longer, corpus, a.skeleton, stance, low, wishes.moving, quick)
        clock, half_steps = stretch(clock, walk.half_steps, longer, wishes.fps)
        walk, stance = walk._replace(half_steps=half_steps), stance._replace(half_steps=half_steps)
    danced = _danced(walk, clock, stops, states, style, wishes)
    chains = walk.chains(corpus, clock.frames)
    rotations = corpus.from_chains(danced.move(chains, clock.frames) if danced else chains)
    lasts = float(carriage.trust.lasts[0])
    rotations = _with_rates(rotations, clock, [*stops], wishes.leaving, wishes.arriving, lasts)
    return _Reference(clock, _limit(rotations, postures, carriage.loose), stance, low, danced, walk.left_out)


def _rate(velocity: Velocity | None) -> Floats | None:
    """Return the velocity of the root [3], m/s; None for none."""
    return None if velocity is None else velocity.root


def _times(factor: float, velocity: Velocity | None) -> Velocity | None:
    """Return a velocity times a factor; None for none."""
    return None if velocity is None else Velocity(factor * velocity.rotations, factor * velocity.root)


def _walk_near(
    states: Floats, clock: Timeline, stops: Mapping[int, Stop], corpus: Corpus, carriage: Carriage, near: bool
) -> Expectation:
    """Return the mean of the walks that pass the stops and are near a path's states [T + 1, L, 4].

    The body turns the short way from stop to stop if `near`, else as walks do.

    A path may have more moves than there is time for. Walks are not hurried: they take as many as the corpus usually
    does.
    """
    last, joints = len(states) - 1, len(corpus.skeleton)
    half_steps, path = subdivide_times(clock.moves, 1), states[:, :joints]
    if len(stops) == 2 and clock.usual_moves != last:
        half_steps = np.linspace(0.0, clock.moves[-1], 2 * clock.usual_moves + 1)
        path = rotation_spline(clock.moves, path, half_steps[::2])
        stops = {0: stops[0], clock.usual_moves: stops[last]}
    return expect(corpus, carriage, stops, half_steps, path, near)


def _stance(walk: Expectation, carriage: Carriage, travel: Floats, size: float, given: Sequence[int]) -> Stance:
    """Return the stances of the corpus's bodies along a walk, on a body of another size.

    Args:
        walk: the movement at its half steps.
        carriage: posture statistics of the corpus.
        travel: level displacement of the root in each half step [2 T, 3], metres, on the corpus's skeleton.
        size: height of the body, in heights of the corpus's skeleton.
        given: half steps at which postures are given.
    """
    trust, in_air, clearance = walk.trust[:, 0], carriage.aloft[walk.of_moments], carriage.clearance[walk.of_moments]
    aloft = walk.moments @ in_air
    trusted = np.interp(np.arange(len(walk.half_steps)), 0.5 + np.arange(len(trust)), trust)
    flies = trusted * aloft
    flies[given] = aloft[given]  # trust has no say in whether a given posture is in the air
    return Stance(
        walk.half_steps,
        size * (walk.moments @ clearance),
        trusted,
        walk.moments @ carriage.stands[walk.of_moments],
        flies,
        size * (walk.moments @ (in_air * clearance)) / np.maximum(aloft, 1e-9),
        size * travel,
        size * float(carriage.overhang[0]),
    )


def _without_high_jumps(stance: Stance, fastest: float, given: Sequence[int]) -> Stance:
    """Return a stance without jumps that take off faster than `fastest`, m/s, except at the `given` half steps."""
    high = np.sqrt(2.0 * GRAVITY * stance.leaps) > fastest
    high[given] = False
    return stance._replace(aloft=np.where(high, 0.0, stance.aloft))


def _for_jumps(
    walk: Expectation,
    longer: Floats,
    corpus: Corpus,
    skeleton: Skeleton,
    stance: Stance,
    low: Mapping[int, float],
    moving: tuple[bool, bool],
    fastest: Floats,
) -> Floats:
    """Return the factor by which each half step lasts longer [2 T], for jumps into a given posture (`jump_in_time`) or
    from one into another (`land_between`).

    Args:
        walk: the movement at its half steps.
        longer: the factor without jumps [2 T].
        corpus: the corpus.
        skeleton: the body.
        stance: stances of the corpus's bodies along the walk.
        low: height of the lowest point of the given postures, metres, by the number of the walk's moves to there.
        moving: whether the velocity at the first and at the last posture is given.
        fastest: greatest speeds, those of the joints first [J], rad/s.
    """
    (in_air, above), seconds = ends_in_air(stance, low, size_of(skeleton)), longer * np.diff(walk.half_steps)
    if (
        in_air.all()
        and len(low) == 2
        and (lands := land_between(seconds, above, size_of(skeleton), moving)).max() > 1.0
    ):
        return lands
    in_air &= ~np.array(moving)
    if not in_air.any():
        return np.ones(len(longer))
    moves = [*low]
    reach = 2 * (moves[1] - moves[0]), 2 * (moves[-1] - moves[-2])
    rotations = rot.normalise(corpus.from_chains(walk.chains(corpus, walk.half_steps)))
    return jump_in_time(skeleton, rotations, seconds, stance.clearance, above, in_air, reach, fastest[: len(skeleton)])


def _quickest(most: Floats, speeds: Floats | None, pace: float, joints: int) -> Floats:
    """Return the bounds of the finished movement [J + 4]: a little less than `most` and, for joints, little more than
    the speeds of all but a hundredth of the corpus's samples [J + 2], at a pace."""
    out = FINAL_PEAK_RATIO * most
    if speeds is not None:
        out[:joints] = np.minimum(out[:joints], JOINT_SPEED_RATIO * pace * speeds[:joints])
    return out


def _danced(
    walk: Expectation, clock: Timeline, stops: Mapping[int, Stop], states: Floats, style: Style, wishes: Wishes
) -> Danced | None:
    """Return the passage that a walk follows; no joint leaves its states' tolerance for it, and `fixed` joints stay.

    A joint that is beyond the tolerance already may be as far off, unless the request constrains it.

    Args:
        walk: the movement at its half steps.
        clock: its times.
        stops: postures passed exactly, by the number of moves that lead there.
        states: orientations of the path's states at the moves [T + 1, L, 4].
        style: style of the motion.
        wishes: request for it.
    """
    corpus, wished = style.corpus, wishes.wished
    passed = {float(clock.moves[move]): stop for move, stop in stops.items()}
    danced = dance(corpus, style.carriage, walk, passed, wishes.liveliness, wishes.place)
    if danced is None:
        return None
    chains, joints = walk.chains(corpus, clock.moves), danced.off.shape[1]
    off, most = danced.at(clock.moves), DANCED_WITHIN * style.tolerances[:joints]
    moved = danced.move(chains, clock.moves)
    before, after = (rot.angle(found[:, :joints], states[:, :joints]) for found in (chains, moved))
    room = np.maximum(most - before, 0.0) / np.maximum(rot.norm(off), 1e-9)
    firmly = np.where(wished[:joints], most, np.maximum(most, before))
    share = np.where(after <= firmly, 1.0, np.minimum(room, 1.0))
    share[:, wishes.fixed[:joints]] = 0.0
    shares = np.stack([np.interp(danced.times, clock.moves, own) for own in share.T], axis=1)
    return danced._replace(off=shares[..., None] * danced.off)


def _with_rates(
    rotations: Floats,
    clock: Timeline,
    stops: Sequence[int],
    leaving: Velocity | None,
    arriving: Velocity | None,
    lasts: float,
) -> Floats:
    """Return rotations [N, J, 4] with the given velocities at the first and last frames, each felt for at most `lasts`
    seconds.

    Rotations at the moves of the `stops`, and between those on the way, do not change.
    """
    times = clock.frames
    turned = rot.log(rot.inv_mul(rotations[[0, -2]], rotations[[1, -1]])) / (times[1] - times[0])
    first = None if leaving is None else leaving.rotations - turned[0]
    last = None if arriving is None else arriving.rotations - turned[1]
    if first is None and last is None:
        return rotations
    until = clock.moves[stops[1]], clock.moves[stops[-2]]
    return rot.mul(rotations, rot.exp(departure(times, first, last, until, lasts)))


def _limit(rotations: Floats, postures: Mapping[int, Posture], loose: Bools) -> Floats:
    """Return unit rotations [N, J, 4] within the joints' limits, with the first and the last posture as exact ends.

    The postures widen the limits.
    """
    first, *_, last = postures.values()
    given = np.stack([posture.rotations for posture in postures.values()])
    out = within_limits(first.skeleton, rot.normalise(rotations), given, loose)
    # Fingers that were not recorded, for example, may have other values in walks.
    still = rot.angle(given, first.rotations).max(axis=0) < _SAME_ORIENTATION_RAD
    still &= rot.angle(out, first.rotations).max(axis=0) < _MOTIONLESS_RAD
    out[:, still] = first.rotations[still]
    out[0], out[-1] = first.rotations, last.rotations
    return out


def _given_heights(postures: Mapping[int, Posture], walk: Expectation) -> dict[int, float]:
    """Return the height of each given posture's lowest point, metres, by the number of the walk's moves to there."""
    first, *_ = postures.values()
    rotations = np.stack([posture.rotations for posture in postures.values()])
    roots = np.stack([posture.root for posture in postures.values()])
    moves = [*[*postures][:-1], len(walk.half_steps) // 2]
    return dict(zip(moves, lowest_height(first.skeleton, rotations, roots).tolist(), strict=True))
