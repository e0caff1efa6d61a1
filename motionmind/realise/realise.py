"""From a path of states to a motion: exact at both ends, smooth between, near the path, on its feet."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Int32s
from motionmind.body.contact import lowest_height
from motionmind.body.legs import find_legs
from motionmind.body.limits import within_limits
from motionmind.body.motion import Insertion, Motion, Posture, Velocity
from motionmind.body.plausibility import GRAVITY
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import size_of
from motionmind.corpus.corpus import Corpus, subdivide_times
from motionmind.footing.carrying import Allowed
from motionmind.footing.corrections import Correction
from motionmind.footing.feet import KNEE
from motionmind.footing.ground import Given, Stance, ends_in_air, floors_at_ends, set_on_floor
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import rotation_spline
from motionmind.grammar.grammar import Grammar
from motionmind.learned.carriage import Carriage
from motionmind.realise.bending import allowed_off, bend_to_states
from motionmind.realise.retime import (
    ENDS_AT,
    HEADROOM,
    JOINTS_AT,
    JUMPS_AT,
    LONGER,
    jump_in_time,
    keep_pace,
    land_between,
    slow_down,
)
from motionmind.realise.settling import keeper, settled
from motionmind.realise.timeline import Timeline, stretch, timeline
from motionmind.walks.expectation import Expectation, expect
from motionmind.walks.headings import travel_along
from motionmind.walks.minimal import departure
from motionmind.walks.passages import Danced, Place, dance
from motionmind.walks.stops import Stop, stop_at

# Of a passage's displacement that legs get: feet find their places elsewhere. Chosen on ballet: with all of it a foot
# that stands makes a step; with none, legs are as slow as the mean's.
LEGS_SHARE = 0.4
DANCED_WITHIN = (
    0.9  # tolerances by which a dance may take a joint off its state, with room for the arc between two frames
)
_SAME = 1e-9  # radians: two orientations no farther apart are the same but for rounding
_UNSEEN = 2e-3  # radians: a joint that comes back to where it began, and goes no farther, does not move


class Realised(NamedTuple):
    """A realised path.

    Attributes:
        motion: the motion.
        danced: the passage of the corpus that it is danced like; None if like none.
        left_out: share of walks that begin or end in moments that others stand for (`mean_walk.MeanWalk`).
    """

    motion: Motion
    danced: Danced | None
    left_out: float


def realise(
    path: Int32s,
    a: Posture,
    b: Posture,
    corpus: Corpus,
    grammar: Grammar,
    carriage: Carriage,
    tolerances: Floats,
    wished: Bools,
    fixed: Bools,
    fps: float,
    length: float | None = None,
    through: Mapping[int, Posture] = MappingProxyType({}),
    leaving: Velocity | None = None,
    arriving: Velocity | None = None,
    without: Collection[Correction] = (),
    pace: float = 1.0,
    fastest: Floats | None = None,
    peaks: Callable[[float, float], Floats] | None = None,
    slides: float = np.inf,
    liveliness: float = 0.5,
    place: Place | None = None,
) -> Realised:
    """Return the motion from posture `a` to posture `b` in the moves of a path, on the body of `a`.

    Its first and last frames are `a` and `b`, exactly, and at the moves in `through` its joints and its facing are as
    in the postures there. Between them the body is, at the times of the moves, at the mean of the walks that the corpus
    knows from `a` to `b` in that time and that count the more the nearer they are to the path
    (`motionmind.walks.likelihood`); a C2 spline joins them. Where that leaves a chain too far from its state, the
    movement is bent towards it, smoothly. It is danced like a passage of the corpus (`motionmind.walks.passages`).

    Feet that stand carry the body; where none stands it travels as the corpus's bodies do, and it ends where `b`
    stands. The legs hold what one root cannot (`motionmind.footing.feet`), but for those with `fixed` joints. The
    lowest point stays as far above the floor as in the corpus's postures; the floor is at 0, or lower under ends that
    are lower, or higher under ends higher than the corpus knows of such postures. Limbs that would then pass through
    each other are kept apart (`motionmind.realise.limbs_apart`).

    Args:
        path: states of the chains [T + 1, L].
        a: first posture.
        b: last posture.
        corpus: the movement that was learned from.
        grammar: what was learned of its states.
        carriage: how its bodies hold themselves, travel and stand.
        tolerances: radians within which a state of each chain stands for an orientation [L].
        wished: chains of which more is asked than that they go from `a` to `b` [L].
        fixed: those of them that do not move for the feet's sake either [L].
        fps: frames a second; the whole is stretched by less than a frame so that `b` falls on one.
        length: duration, seconds, to which frames are fitted; None for as long as the corpus takes.
        through: postures on the way, by the number of moves that lead there, increasing.
        leaving: velocity with which the body leaves `a`; None where it is unknown.
        arriving: velocity with which it arrives at `b`.
        without: corrections to leave out.
        pace: how many times as fast as the corpus to move, where there is no `length`.
        fastest: speeds that the joints, the body's turning and its travel keep to [J + 2], as in
            `motionmind.learned.pace`, at a pace of 1; None for any speed. Where there is a `length`, as far as slower
            parts of the movement have the time for it.
        peaks: returns what the greatest of movement of so many seconds keep to at a pace [J + 4], as
            `motionmind.learned.pace.Pace.peaks_in` does; None for any.
        slides: speed of a foot near the floor, heights/s, that movement with `peaks` keeps to at a pace of 1.
        liveliness: from 0, the mean of walks, to 1, a passage of the corpus (`motionmind.walks.passages`).
        place: where in the corpus that passage begins; None for any.
    """
    if len(path) == 1:
        still = Motion(a.skeleton, a.rotations[None], a.root[None], np.zeros(1), "tween", (Insertion(np.zeros(1)),))
        return Realised(still, None, 0.0)
    clock = timeline(path, grammar.transitions, fps, length)
    postures = {0: a, **through, len(path) - 1: b}
    stops = {move: stop_at(corpus, posture) for move, posture in postures.items()}
    slower = 1.0 if length else 1.0 / pace  # the walk is made at a pace of 1, and then taken faster
    # Steps and the weight take their time at any pace: who is slower may take them as fast as the corpus does.
    pace = max(pace, 1.0)
    speeds, windows = fastest, peaks
    if length is not None:  # what is faster than that then takes its time from the rest, in the end
        fastest = peaks = None
    stops[0] = stop_at(corpus, a, _times(slower, leaving))
    stops[len(path) - 1] = stop_at(corpus, b, _times(slower, arriving))
    states = grammar.centres[grammar.transitions.starts[: path.shape[1]] + path]
    walk = _walk_near(states, clock, stops, corpus, carriage, length is None and not through)
    within = allowed_off(chains := walk.chains(corpus, clock.moves), path, grammar, tolerances, wished)
    walk = bend_to_states(walk, chains, states, clock, stops, corpus, within)
    size = a.skeleton.height / corpus.skeleton.height if corpus.skeleton.height > 0.0 else 1.0
    travel = travel_along(walk.trust[:, :1] * (walk.moves @ carriage.travel[walk.of_moves]), walk.headings)
    given = [0, *(2 * move for move in through), -1]
    moving, low = (leaving is not None, arriving is not None), _given_heights(postures, walk)
    # All heights are of the body of `a`, which the motion is on; `b` may have stood on shorter legs.
    stance = _stance(walk, carriage, travel, size, given)
    longer = np.full(len(travel), slower)
    if length is None:
        if fastest is not None:
            missing = (b.root - a.root) / size - travel.sum(axis=0)
            longer *= keep_pace(walk, clock.frames, corpus, fastest, travel + missing / len(travel), moving)
            if "flight" not in without:
                longer *= _for_jumps(walk, longer, corpus, a.skeleton, stance, low, moving, pace * fastest)
        clock, half_steps = stretch(clock, walk.half_steps, longer, fps)
        walk, stance = walk._replace(half_steps=half_steps), stance._replace(half_steps=half_steps)
    quick = None if fastest is None else pace * fastest
    danced = _danced(walk, clock, stops, corpus, carriage, liveliness, place, states, tolerances, wished, fixed)
    chains = walk.chains(corpus, clock.frames)
    rotations = corpus.from_chains(danced.move(chains, clock.frames) if danced else chains)
    rotations = _with_rates(rotations, clock, [*stops], leaving, arriving, float(carriage.trust.lasts[0]))
    # Once so that feet find places to stand at, and once for where they have been put.
    keep_apart = keeper(clock, [*stops], fixed, wished, carriage, a.skeleton, without)
    rotations = _limit(keep_apart(rotations, None), postures, carriage.loose)

    greatest = None if windows is None else windows(LONGER * float(clock.frames[-1]), pace)
    most = None if peaks is None else greatest
    if most is not None:
        stance = _without_high_jumps(stance, JUMPS_AT * most[-2] * a.skeleton.height, given)
    rotations, root = set_on_floor(
        a.skeleton,
        rotations,
        rotations,
        clock.frames,
        stance,
        Given(low, (a.root, b.root), (_rate(leaving), _rate(arriving))),
        _allowed(a.skeleton, fixed, carriage, quick, most),
        without,
    )
    settle = partial(
        settled,
        fps=fps,
        stops=[*stops],
        moving=moving,
        fixed=fixed,
        wished=wished,
        carriage=carriage,
        overhang=stance.overhang,
        floors=floors_at_ends(stance, low, size_of(a.skeleton)),
        fastest=None if quick is None else quick[: len(a.skeleton)],
        without=without,
    )
    motion = settle(Motion(a.skeleton, rotations, root, clock.frames), clock)
    if greatest is not None:
        if length is None:
            greatest = _quickest(greatest, speeds, pace, len(a.skeleton))
        motion, clock = slow_down(motion, clock, greatest, moving, pace * slides, settle, lasts=length is not None)
    return Realised(replace(motion, name="tween", insertions=(Insertion(clock.moves),)), danced, walk.left_out)


def _allowed(body: Skeleton, fixed: Bools, carriage: Carriage, quick: Floats | None, most: Floats | None) -> Allowed:
    """Return what a body may change for its feet, and how fast it may be.

    Args:
        body: the body.
        fixed: chains that do not move for the feet's sake [L].
        carriage: how the corpus's bodies hold themselves.
        quick: speeds of the joints, of turning and of travel [J + 2]; None for any.
        most: the greatest of movement as long, as of `realise`'s `peaks` [J + 4]; None for any.
    """
    joints = len(body)
    return Allowed(
        fixed[:joints],
        carriage.loose,
        np.full(joints, KNEE) if quick is None else quick[:joints],
        np.inf if quick is None else float(HEADROOM * quick[-1] * body.height),
        np.inf if most is None else float(most[-1]) * body.height,
    )


def _rate(velocity: Velocity | None) -> Floats | None:
    """Return the velocity of the root [3], metres a second; None for none."""
    return None if velocity is None else velocity.root


def _times(factor: float, velocity: Velocity | None) -> Velocity | None:
    """Return a velocity times a factor; None for none."""
    return None if velocity is None else Velocity(factor * velocity.rotations, factor * velocity.root)


def _walk_near(
    states: Floats, clock: Timeline, stops: Mapping[int, Stop], corpus: Corpus, carriage: Carriage, near: bool
) -> Expectation:
    """Return the mean of the walks that pass the stops and are near a path's states [T + 1, L, 4].

    The body turns the `near` way from stop to stop, or as walks do.

    A path may take more moves than there is time for; the corpus's walks are not to be hurried, and take as many as it
    usually does.
    """
    last, joints = len(states) - 1, len(corpus.skeleton)
    half_steps, path = subdivide_times(clock.moves, 1), states[:, :joints]
    if len(stops) == 2 and clock.usual_moves != last:
        half_steps = np.linspace(0.0, clock.moves[-1], 2 * clock.usual_moves + 1)
        path = rotation_spline(clock.moves, path, half_steps[::2])
        stops = {0: stops[0], clock.usual_moves: stops[last]}
    return expect(corpus, carriage, stops, half_steps, path, near)


def _stance(walk: Expectation, carriage: Carriage, travel: Floats, size: float, given: Sequence[int]) -> Stance:
    """Return how the corpus's bodies hold themselves along a walk, on a body so many times as large.

    Args:
        walk: the movement at its half steps.
        carriage: how the corpus's bodies hold themselves.
        travel: level displacement of the root in each half step [2 T, 3], metres, on the corpus's skeleton.
        size: of the body, in heights of the corpus's skeleton.
        given: half steps at which postures are given.
    """
    trust, in_air, clearance = walk.trust[:, 0], carriage.aloft[walk.of_moments], carriage.clearance[walk.of_moments]
    aloft = walk.moments @ in_air
    trusted = np.interp(np.arange(len(walk.half_steps)), 0.5 + np.arange(len(trust)), trust)
    flies = trusted * aloft
    flies[given] = aloft[given]  # whether a given posture is in the air is no matter of trust
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
    """Return a stance that leaves the floor at most so fast, metres a second, but for the half steps that are given."""
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
    """Return how many times as long each half step is to take [2 T] for jumps into given postures (`jump_in_time`), or
    from one into another (`land_between`).

    Args:
        walk: the movement at its half steps.
        longer: how many times longer each would take else [2 T].
        corpus: what it was learned from.
        skeleton: the body.
        stance: how the corpus's bodies hold themselves along the walk.
        low: height of the lowest point of the given postures, metres, by the number of the walk's moves to there.
        moving: whether the first and the last posture are passed at a given velocity.
        fastest: speeds of the joints first [J], rad/s.
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
    """Return what movement keeps to in the end [J + 4]: a little less than `most`; of its joints, not much more than
    their speeds in all but a hundredth of the corpus's moments [J + 2], at a pace."""
    out = ENDS_AT * most
    if speeds is not None:
        out[:joints] = np.minimum(out[:joints], JOINTS_AT * pace * speeds[:joints])
    return out


def _danced(
    walk: Expectation,
    clock: Timeline,
    stops: Mapping[int, Stop],
    corpus: Corpus,
    carriage: Carriage,
    liveliness: float,
    place: Place | None,
    states: Floats,
    tolerances: Floats,
    wished: Bools,
    fixed: Bools,
) -> Danced | None:
    """Return how a walk is danced; no joint leaves its states' tolerance for that, and `fixed` ones do not move.

    Where a joint is beyond the tolerance already, it may go on as far, unless something is asked of it.

    Args:
        walk: the movement at its half steps.
        clock: its times.
        stops: what is passed exactly, by the number of moves that lead there.
        corpus: what it was learned from.
        carriage: how its bodies hold themselves.
        liveliness: from 0 to 1, as `motionmind.walks.passages.dance` takes it.
        place: where the passage begins; None for any.
        states: orientations of the path's states at the moves [T + 1, L, 4].
        tolerances: radians within which a state of each chain stands for an orientation [L].
        wished: chains of which more is asked than that they go from A to B [L].
        fixed: chains that are not displaced [L].
    """
    passed = {float(clock.moves[move]): stop for move, stop in stops.items()}
    danced = dance(corpus, carriage, walk, passed, liveliness, place)
    if danced is None:
        return None
    chains, joints = walk.chains(corpus, clock.moves), danced.off.shape[1]
    off, most = danced.at(clock.moves), DANCED_WITHIN * tolerances[:joints]
    moved = danced.move(chains, clock.moves)
    before, after = (rot.angle(found[:, :joints], states[:, :joints]) for found in (chains, moved))
    room = np.maximum(most - before, 0.0) / np.maximum(rot.norm(off), 1e-9)
    firmly = np.where(wished[:joints], most, np.maximum(most, before))
    share = np.where(after <= firmly, 1.0, np.minimum(room, 1.0))
    share[:, fixed[:joints]] = 0.0
    share[:, [joint for leg, _ in find_legs(corpus.skeleton)[1] for joint in leg]] *= LEGS_SHARE
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
    """Return rotations [N, J, 4] that leave their first frame and arrive at their last with the given velocities, each
    of which is felt for so many seconds at most.

    They do not change at the moves of the `stops` nor between those on the way.
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
    """Return unit rotations [N, J, 4] within the joints' limits, exactly the first and last posture at their ends.

    Limits are widened to the postures.
    """
    first, *_, last = postures.values()
    given = np.stack([posture.rotations for posture in postures.values()])
    out = within_limits(first.skeleton, rot.normalise(rotations), given, loose)
    # Such as fingers that were not recorded: walks may know other values of them.
    still = rot.angle(given, first.rotations).max(axis=0) < _SAME
    still &= rot.angle(out, first.rotations).max(axis=0) < _UNSEEN
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
