"""Reference of a motion: the mean of the corpus walks near a path, bent to its states and moved like a passage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Int32s
from motionmind.body.contact import lowest_height
from motionmind.body.limits import within_limits
from motionmind.body.motion import Posture, Velocity
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import size_of
from motionmind.corpus.corpus import Corpus, subdivide_times
from motionmind.footing.ground import Stance, ends_in_air
from motionmind.geometry import rotations as rot
from motionmind.geometry.polylines import places_along
from motionmind.geometry.splines import rotation_spline
from motionmind.learned.posture_statistics import PostureStatistics
from motionmind.solver.motion import MOTIONLESS_RAD
from motionmind.synthesis.bending import allowed_distances, bend_to_states
from motionmind.synthesis.retime import jump_in_time, keep_pace, land_between
from motionmind.synthesis.timeline import Timeline, stretch, timeline
from motionmind.synthesis.wishes import Style, Wishes
from motionmind.walks.expectation import Expectation, expect
from motionmind.walks.headings import travel_along
from motionmind.walks.minimal import departure
from motionmind.walks.passages import Danced, dance
from motionmind.walks.stops import Stop, stop_at


class Reference(NamedTuple):
    """The reference of a motion.

    Attributes:
        clock: its times.
        rotations: local rotations [N, J, 4].
        stance: stances of the corpus's bodies along it.
        low: height of the lowest point of the given postures, metres, by the number of the walk's moves to there.
        danced: passage of the corpus that it follows; None for none.
        left_out: share of walks that begin or end in samples that others represent (`mean_walk.MeanWalk`).
    """

    clock: Timeline
    rotations: Floats
    stance: Stance
    low: dict[int, float]
    danced: Danced | None
    left_out: float


def find_reference(path: Int32s, style: Style, wishes: Wishes) -> Reference:
    """Return the mean of the corpus walks near a path, moved like a passage, in the time that they take."""
    a, b, corpus, statistics, grammar = wishes.a, wishes.b, style.corpus, style.statistics, style.grammar
    clock = timeline(path, grammar.transitions, wishes.fps, wishes.length, wishes.fixed_times)
    postures = {0: a, **wishes.through, len(path) - 1: b}
    stops = {move: stop_at(corpus, posture) for move, posture in postures.items()}
    # Find the walk at a pace of 1, then scale it in time.
    slower = 1.0 if wishes.length else 1.0 / wishes.pace
    stops[0] = stop_at(corpus, a, _scaled(slower, wishes.leaving))
    stops[len(path) - 1] = stop_at(corpus, b, _scaled(slower, wishes.arriving))
    states = grammar.centres[grammar.transitions.starts[: path.shape[1]] + path]
    walk = _walk_near(states, clock, stops, corpus, statistics, wishes.length is None and not wishes.through)
    chains = walk.chains(corpus, clock.moves)
    within = allowed_distances(chains, path, grammar, style.tolerances, wishes.wished)
    walk = bend_to_states(walk, chains, states, clock, stops, corpus, within)
    size = a.skeleton.height / corpus.skeleton.height if corpus.skeleton.height > 0.0 else 1.0
    travel = travel_along(walk.trust[:, :1] * (walk.moves @ statistics.travel[walk.of_moves]), walk.headings)
    given = [0, *(2 * move for move in wishes.through), -1]
    low = _given_heights(postures, walk)
    # Heights are those of the body of `a`, which moves; the body of `b` may have had shorter legs.
    stance = _find_stance(walk, statistics, travel, size, given)
    if wishes.length is None:
        longer = np.full(len(travel), slower)
        if style.fastest is not None:
            even = travel - travel.mean(axis=0) + _even_steps(wishes, len(travel)) / size
            longer *= keep_pace(walk, clock.frames, corpus, style.fastest, even, wishes.moving)
            if "flight" not in wishes.without:
                # Steps and weight shifts keep their own time: at a slower pace they stay as fast as in the corpus.
                quick = max(wishes.pace, 1.0) * style.fastest
                longer *= _jump_factors(walk, longer, corpus, a.skeleton, stance, low, wishes.moving, quick)
        clock, half_steps = stretch(clock, walk.half_steps, longer, wishes.fps)
        walk, stance = walk._replace(half_steps=half_steps), stance._replace(half_steps=half_steps)
    danced = _follow_passage(walk, clock, stops, states, style, wishes)
    chains = walk.chains(corpus, clock.frames)
    rotations = corpus.from_chains(danced.move(chains, clock.frames) if danced else chains)
    lasts = float(statistics.trust.lasts[0])
    rotations = _with_velocities(rotations, clock, [*stops], wishes.leaving, wishes.arriving, lasts)
    return Reference(clock, _within_limits(rotations, postures, statistics.loose), stance, low, danced, walk.left_out)


def _even_steps(wishes: Wishes, count: int) -> Floats:
    """Return equal steps of the root from `a` to `b`, straight or along the route [count, 3], metres."""
    if wishes.route is None:
        return np.tile((wishes.b.root - wishes.a.root) / count, (count, 1))
    steps = np.diff(places_along(wishes.route, np.linspace(0.0, 1.0, count + 1)), axis=0)
    return np.stack([steps[:, 0], np.zeros(count), steps[:, 1]], axis=1)


def _scaled(factor: float, velocity: Velocity | None) -> Velocity | None:
    """Return a velocity times a factor; None for none."""
    return None if velocity is None else Velocity(factor * velocity.rotations, factor * velocity.root)


def _walk_near(
    states: Floats,
    clock: Timeline,
    stops: Mapping[int, Stop],
    corpus: Corpus,
    statistics: PostureStatistics,
    near: bool,
) -> Expectation:
    """Return the mean of the walks that pass the stops and are near a path's states [T + 1, L, 4].

    The body turns the short way from stop to stop if `near`, else as walks do. A path may have more moves than there is
    time for; walks then take as many as the corpus usually does.
    """
    last, joints = len(states) - 1, len(corpus.skeleton)
    half_steps, path = subdivide_times(clock.moves, 1), states[:, :joints]
    if len(stops) == 2 and clock.usual_moves != last:
        half_steps = np.linspace(0.0, clock.moves[-1], 2 * clock.usual_moves + 1)
        path = rotation_spline(clock.moves, path, half_steps[::2])
        stops = {0: stops[0], clock.usual_moves: stops[last]}
    return expect(corpus, statistics, stops, half_steps, path, near)


def _find_stance(
    walk: Expectation, statistics: PostureStatistics, travel: Floats, size: float, given: Sequence[int]
) -> Stance:
    """Return the stances of the corpus's bodies along a walk, on a body of another size.

    Args:
        walk: the movement at its half steps.
        statistics: posture statistics of the corpus.
        travel: level displacement of the root in each half step [2 T, 3], metres, on the corpus's skeleton.
        size: height of the body, in heights of the corpus's skeleton.
        given: half steps at which postures are given.
    """
    trust, in_air, clearance = (
        walk.trust[:, 0],
        statistics.aloft[walk.of_samples],
        statistics.clearance[walk.of_samples],
    )
    aloft = walk.samples @ in_air
    trusted = np.interp(np.arange(len(walk.half_steps)), 0.5 + np.arange(len(trust)), trust)
    flies = trusted * aloft
    flies[given] = aloft[given]  # whether a given posture is in the air does not depend on trust
    return Stance(
        walk.half_steps,
        size * (walk.samples @ clearance),
        trusted,
        walk.samples @ statistics.stands[walk.of_samples],
        flies,
        size * (walk.samples @ (in_air * clearance)) / np.maximum(aloft, 1e-9),
        size * travel,
        size * float(statistics.overhang[0]),
    )


def _jump_factors(
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


def _follow_passage(
    walk: Expectation, clock: Timeline, stops: Mapping[int, Stop], states: Floats, style: Style, wishes: Wishes
) -> Danced | None:
    """Return the passage that a walk follows, scaled so that joints stay within the tolerance of their states.

    Fixed joints stay where they are. A joint beyond its tolerance already may stay as far off, unless the request
    constrains it.

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
    danced = dance(corpus, style.statistics, walk, passed, wishes.liveliness, wishes.place)
    if danced is None:
        return None
    chains, joints = walk.chains(corpus, clock.moves), danced.off.shape[1]
    off, most = danced.at(clock.moves), 0.9 * style.tolerances[:joints]  # the rest is for the arc between frames
    moved = danced.move(chains, clock.moves)
    before, after = (rot.angle(found[:, :joints], states[:, :joints]) for found in (chains, moved))
    room = np.maximum(most - before, 0.0) / np.maximum(rot.norm(off), 1e-9)
    firmly = np.where(wished[:joints], most, np.maximum(most, before))
    share = np.where(after <= firmly, 1.0, np.minimum(room, 1.0))
    share[:, wishes.fixed[:joints]] = 0.0
    shares = np.stack([np.interp(danced.times, clock.moves, own) for own in share.T], axis=1)
    return danced._replace(off=shares[..., None] * danced.off)


def _with_velocities(
    rotations: Floats,
    clock: Timeline,
    stops: Sequence[int],
    leaving: Velocity | None,
    arriving: Velocity | None,
    lasts: float,
) -> Floats:
    """Return rotations [N, J, 4] with the given velocities at both ends, which decay within `lasts` seconds.

    Rotations at the moves of the `stops`, and between the inner stops, do not change.
    """
    times = clock.frames
    turned = rot.log(rot.inv_mul(rotations[[0, -2]], rotations[[1, -1]])) / (times[1] - times[0])
    first = None if leaving is None else leaving.rotations - turned[0]
    last = None if arriving is None else arriving.rotations - turned[1]
    if first is None and last is None:
        return rotations
    until = clock.moves[stops[1]], clock.moves[stops[-2]]
    return rot.mul(rotations, rot.exp(departure(times, first, last, until, lasts)))


def _within_limits(rotations: Floats, postures: Mapping[int, Posture], loose: Bools) -> Floats:
    """Return unit rotations [N, J, 4] within the joints' limits, widened to the postures; the ends are exact."""
    first, *_, last = postures.values()
    given = np.stack([posture.rotations for posture in postures.values()])
    out = within_limits(first.skeleton, rot.normalise(rotations), given, loose)
    # Joints that were not recorded, such as fingers, may have other values in walks.
    still = rot.angle(given, first.rotations).max(axis=0) < 1e-9  # rad: equal but for rounding
    still &= rot.angle(out, first.rotations).max(axis=0) < MOTIONLESS_RAD
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
