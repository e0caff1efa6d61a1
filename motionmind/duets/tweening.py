"""Tweens of duets: the leader's movement, then the follower's, which keeps their relation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Unpack

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.arguments import check_function, check_items, check_type
from motionmind.body.motion import Motion, Posture
from motionmind.duets.coupling import COUPLE_RATE_FPS, Coupling, RelationPath, find_relations, learn_coupling
from motionmind.duets.relations import HANDS, Relations, inverse_heading, relate
from motionmind.errors import MotionMindError
from motionmind.footing.smoothing import smoothed
from motionmind.geometry import rotations as rot
from motionmind.search.solve import Watch
from motionmind.tween.ends import bring
from motionmind.tween.engine import Engine
from motionmind.tween.pacing import usual_times
from motionmind.tween.request import TweenOptions, TweenRequest
from motionmind.tween.result import Tween

COURSE_RATE_FPS = 10.0  # points of the follower's course, and places of held hands, a second
RELATION_SMOOTH_S = 0.4  # over which relations blend: two steps

Couple = tuple[Posture, Posture]  # leader and follower


class Deviation(NamedTuple):
    """Greatest deviation of a follower from the relations found.

    Attributes:
        place: distance from its place, metres.
        facing: angle from its facing, degrees.
        hand: distance of a held hand from its place, metres; None if none is held.
    """

    place: float
    facing: float
    hand: float | None


@dataclass(frozen=True, eq=False)
class DuetTween:
    """A tween of a duet.

    Attributes:
        leader: the leader's tween.
        follower: the follower's, at the same times.
        path: the relations found.
        distances: least and greatest level distance of the roots, metres.
        usual: 1st and 99th percentile of that distance in the duets; None without duets.
        deviation: how near the follower keeps to the relations.

    >>> from motionmind import Engine, find_posture
    >>> from motionmind.duets import tween_duet
    >>> from motionmind.tween.travel import stand_at
    >>> engine = Engine.load("ballet")
    >>> a, b = (find_posture(f"ballet/{name}").posture for name in ("fifth", "tendu"))
    >>> duet = tween_duet(engine, (a, stand_at(a, (0, 1, 180))[0]), (b, stand_at(b, (0, 1, 180))[0]), duration=1.0)
    >>> [round(distance, 1) for distance in duet.distances]
    [1.0, 1.0]
    """

    leader: Tween
    follower: Tween
    path: RelationPath
    distances: tuple[float, float]
    usual: tuple[float, float] | None
    deviation: Deviation

    @property
    def motions(self) -> tuple[Motion, Motion]:
        """The movement of leader and follower."""
        return self.leader.motion, self.follower.motion


def tween_duet(
    engine: Engine,
    a: Couple,
    b: Couple,
    duets: Sequence[tuple[Motion, Motion]] = (),
    *,
    before: tuple[Motion | None, Motion | None] = (None, None),
    after: tuple[Motion | None, Motion | None] = (None, None),
    watch: Watch | None = None,
    **options: Unpack[TweenOptions],
) -> DuetTween:
    """Find a movement of two dancers from one duet posture to another that keeps the couple together.

    The leader is tweened alone. A path of relations from A's to B's is found for that movement (`find_relations`). The
    follower's tween takes its place and facing from it, and its held hands follow the leader's.

    Args:
        engine: the engine, of the corpus in whose style both dance.
        a: posture A of the leader and of the follower, in one space.
        b: posture B of both.
        duets: movement of leader and follower, at the same times and in one space, to learn their relations from; none
            leads straight from A's relation to B's.
        before: movement of each that leads up to A, as for `Engine.tween`.
        after: movement of each that follows B.
        watch: see `Engine.tween`.
        options: the leader's options (`Engine.tween`). The follower has the same style, `fps` and `search`, and as much
            time; where `to` or `along` take the leader elsewhere, it stands in B as given from there.

    Raises:
        MotionMindError: the two movements of a duet differ in their times; else as `Engine.tween`.
        NoPathError: as `Engine.tween`.
        SkeletonError: as `Engine.tween`.

    >>> from motionmind import Engine, find_posture
    >>> from motionmind.duets import tween_duet
    >>> from motionmind.tween.travel import stand_at
    >>> engine = Engine.load("ballet")
    >>> a, b = (find_posture(f"ballet/{name}").posture for name in ("fifth", "tendu"))
    >>> beside = [stand_at(posture, (0.6, 0))[0] for posture in (a, b)]
    >>> duet = tween_duet(engine, (a, beside[0]), (b, beside[1]), duration=1.0)
    >>> len(duet.motions[0]) == len(duet.motions[1])
    True
    """
    check_type("engine", engine, Engine)
    for name, around in (("before", before), ("after", after)):
        check_items(name, around, "the leader's movement and the follower's, or None", Motion, type(None))
        _check_pair(name, around)
    check_function("watch", watch, or_none=True)
    request = TweenRequest.of(None, **options)
    first, last = _couple(engine, "a", a), _couple(engine, "b", b)
    coupling = learn_coupling(_checked(engine, duets))
    request = _with_time_for_both(engine, request, first, last)
    leader = engine.tween(first[0], last[0], request, before=before[0], after=after[0], watch=watch)
    one = leader.motion
    seconds, ends = float(one.times[-1]), [relate(*(posture.as_motion() for posture in pair)) for pair in (first, last)]
    steps = max(1, round(seconds * COUPLE_RATE_FPS))
    path = find_relations(coupling, one.at(np.linspace(0.0, seconds, steps + 1)), *ends)
    times = np.linspace(0.0, seconds, max(1, round(seconds * COURSE_RATE_FPS)) + 1)
    there = one.at(times)
    relations, held = _in_time(path, times)
    places, facings = _in_space(there, relations)
    x, z = places[-1]
    follower = engine.tween(
        first[1],
        last[1],
        _for_follower(request, seconds),
        before=before[1],
        after=after[1],
        watch=watch,
        to=(x, z, facings[-1]),
        along=[(*places[k], times[k], facings[k]) for k in range(1, len(times) - 1)] or None,
        reach=_reaches(there, relations, held),
    )
    return _assess(leader, follower, path, coupling, (times, relations, held))


def _couple(engine: Engine, name: str, couple: Couple) -> Couple:
    """Check a couple, and bring it onto the corpus's joints."""
    check_items(name, couple, "the leader's posture and the follower's", Posture)
    _check_pair(name, couple)
    one, other = (
        bring(engine.corpus, posture, f"{who} in {name.upper()}")
        for who, posture in zip(("the leader", "the follower"), couple, strict=True)
    )
    return one, other


def _check_pair(name: str, pair: Sequence[object]) -> None:
    if len(pair) != 2:
        raise MotionMindError(f"{name} must be two, leader and follower, not {len(pair)}")


def _checked(engine: Engine, duets: Sequence[tuple[Motion, Motion]]) -> list[tuple[Motion, Motion]]:
    """Check duets, and bring them onto the corpus's joints."""
    check_items("duets", duets, "pairs of motions", tuple, list)
    out = []
    for number, duet in enumerate(duets, start=1):
        check_items(f"duets: duet {number}", duet, "the leader's movement and the follower's", Motion)
        _check_pair(f"duets: duet {number}", duet)
        one, other = (bring(engine.corpus, motion, f"duet {number}") for motion in duet)
        if len(one) != len(other) or np.abs(one.times - other.times).max() > 1e-6:
            raise MotionMindError(f"duets: the dancers of duet {number} have different times; resample them together")
        out.append((one, other))
    return out


def _with_time_for_both(engine: Engine, request: TweenRequest, a: Couple, b: Couple) -> TweenRequest:
    """Return a request of the follower's usual time, where it is open and the leader stays or usually takes less."""
    if request.fixes_length or request.to is not None or request.along is not None or request.via:
        return request
    own, follows = (usual_times(engine, (a[k], b[k]))[0].median for k in (0, 1))
    if follows < own and rot.angle(a[0].rotations, b[0].rotations).max() > 1e-6:
        return request
    return replace(request, duration=round(follows / request.pace * request.fps) / request.fps, pace=1.0)


def _for_follower(request: TweenRequest, seconds: float) -> TweenRequest:
    """Return the follower's request: the leader's style and search, in its time."""
    return TweenRequest(
        duration=seconds,
        novelty=request.novelty,
        liveliness=request.liveliness,
        without=request.without,
        fps=request.fps,
        search=request.search,
    )


def _in_time(path: RelationPath, times: Floats) -> tuple[Relations, Bools]:
    """Return the relations of a path at some times, blended, and which hands are held from step to step."""
    steps, relations = np.linspace(times[0], times[-1], len(path.held)), path.relations
    facings = np.unwrap(relations.facings)
    flat = np.concatenate([relations.places, facings[:, None], relations.hands.reshape(len(steps), -1)], axis=1)
    fine = np.stack([np.interp(times, steps, column) for column in flat.T], axis=1)
    if len(times) > 3:
        fine = np.stack([smoothed(column, RELATION_SMOOTH_S, COURSE_RATE_FPS) for column in fine.T], axis=1)
    step = np.searchsorted(steps, times - 1e-9).clip(1, max(len(steps) - 1, 1)) if len(steps) > 1 else times.astype(int)
    held = path.held[step - 1] & path.held[step]
    return Relations(fine[:, :2], fine[:, 2], fine[:, 3:].reshape(len(times), -1, 3)), held


def _in_space(leader: Motion, relations: Relations) -> tuple[Floats, Floats]:
    """Return the follower's places [N, 2], metres, and facings [N], degrees, on the stage."""
    local = np.insert(relations.places, 1, 0.0, axis=1)
    places = leader.root + rot.mul_vec(rot.inv(inverse_heading(leader)), local)
    heading = np.unwrap(rot.heading(leader.rotations[:, 0]))
    return places[:, [0, 2]], np.degrees(heading + relations.facings)


def _held_places(leader: Motion, relations: Relations) -> Floats:
    """Return the places of the follower's hands beside the leader's [N, pairs, 3], metres."""
    names = leader.skeleton.names
    own = [names.index(hand) for hand in HANDS] if relations.hands.shape[1] else []
    there = leader.positions()[:, own].repeat(len(HANDS), axis=1)
    return np.asarray(there + rot.mul_vec(rot.inv(inverse_heading(leader))[:, None], relations.hands))


def _reaches(leader: Motion, relations: Relations, held: Bools) -> list[tuple[str, tuple[float, float, float], float]]:
    """Return the places of held hands between A and B: a hand that holds two takes the middle."""
    places, out = _held_places(leader, relations), []
    for frame in range(1, len(leader) - 1):
        for number, hand in enumerate(HANDS if held.shape[1] else ()):
            mine = np.flatnonzero(held[frame]) % len(HANDS) == number
            if mine.any():
                x, y, z = places[frame, np.flatnonzero(held[frame])[mine]].mean(axis=0).tolist()
                out.append((hand, (x, y, z), float(leader.times[frame])))
    return out


def _assess(
    leader: Tween,
    follower: Tween,
    path: RelationPath,
    coupling: Coupling,
    wanted: tuple[Floats, Relations, Bools],
) -> DuetTween:
    """Return the duet, and how near the follower keeps to the relations."""
    times, relations, held = wanted
    one, other = leader.motion.at(times), follower.motion.at(times)
    found = relate(one, other)
    facing = np.abs(np.angle(np.exp(1j * (found.facings - relations.facings))))
    hand = None
    if held[1:-1].any():
        hand = float(rot.norm(found.hands - relations.hands)[1:-1][held[1:-1]].max())
    off = float(rot.norm(found.places - relations.places).max())
    every = relate(leader.motion, follower.motion.at(leader.motion.times)).distances
    seen = coupling.seen.distances
    usual = (float(np.percentile(seen, 1.0)), float(np.percentile(seen, 99.0))) if len(seen) else None
    deviation = Deviation(off, float(np.degrees(facing.max())), hand)
    return DuetTween(leader, follower, path, (float(every.min()), float(every.max())), usual, deviation)
