"""Compose scores into movement: convert angles to rotations, place feet on the floor, and move the body over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.arguments import check_text
from motionmind.body.anatomy import SIDES, Anatomy
from motionmind.body.contact import lowest_point
from motionmind.body.motion import Motion, Posture
from motionmind.body.rates import check_size
from motionmind.errors import FormatError, did_you_mean, enumerated, quoted
from motionmind.files import FilePath
from motionmind.geometry import rotations as rot
from motionmind.notation.posture_line import Row, posture_row
from motionmind.notation.read import read_score
from motionmind.notation.rows import check_words, play_phrase
from motionmind.notation.score import Clip, Score, Setting
from motionmind.notation.stance import Feet, place_legs
from motionmind.notation.work import Work

LIMIT_TOLERANCE_DEG = 0.5  # rounding
REACH_TOLERANCE_M = 0.001  # by which a leg may miss the floor, or the weight its place


def compose(path: FilePath, clip: str | None = None) -> Motion:
    """Compose a score's clip into movement.

    Args:
        path: the score.
        clip: the clip's name; None for the only one.

    Returns:
        The motion, in metres and seconds, on the score's body.

    Raises:
        FormatError: the score is invalid, has no such clip, or exceeds what the body can do; names file, line and
            word.

    >>> from pathlib import Path
    >>> text = '''title  Two bends of the knees
    ... body   human23
    ... legs
    ...   stand = stand out 10 turn 8
    ...   bend = stand out 10 turn 8, bend 30
    ... clip bends: Down and up
    ...   start | stand
    ...   1     | bend
    ...   1     | stand
    ... '''
    >>> _ = Path("bends.score").write_text(text)
    >>> from motionmind import compose
    >>> motion = compose("bends.score", "bends")
    >>> len(motion)
    3
    """
    check_text("clip", clip, or_none=True)
    score = read_score(path)
    return motions(score, [find_clip(score, clip)])[0]


def find_clip(score: Score, name: str | None) -> Clip:
    """Return a score's clip by name, or its only one; FormatError if there is none."""
    names = [found.name for found in score.clips]
    if name is None and len(names) != 1:
        raise FormatError(
            f"holds {len(names) or 'no'} clips" + f"; choose one: {enumerated(names, 60)}" * bool(names),
            path=score.path,
        )
    if name is not None and name not in names:
        hint = did_you_mean(name, names) or f"; clips are {enumerated(names, 60)}"
        raise FormatError(f"no clip {quoted(name)}{hint}", path=score.path)
    return next(found for found in score.clips if name is None or found.name == name)


def motions(score: Score, clips: Sequence[Clip] | None = None) -> list[Motion]:
    """Compose some clips of a score into movement, all by default; FormatError as `compose`."""
    return [motion for _, motion in played(score, clips)]


def played(score: Score, clips: Sequence[Clip] | None = None) -> list[tuple[list[Row], Motion]]:
    """Play some clips of a score, all by default.

    Returns:
        For each clip, its rows, with the names of its positions, and its motion, in metres and seconds.

    Raises:
        FormatError: as `compose`.
    """
    work = Work()
    for phrase in score.phrases.values():
        if phrase.score is score:
            check_words(phrase, work)
    clips = score.clips if clips is None else clips
    if not clips:
        return []
    parts = [play_phrase(clip, work) for clip in clips]
    check_size(sum(map(len, parts)), len(score.body.skeleton), score.path)
    placed = _place_distinct(score.body, [row for part in parts for row in part])
    ends = np.cumsum([len(part) for part in parts])
    return [
        (part, _join_moves(score.body, clip.name, part, placed.part(end - len(part), end)))
        for clip, part, end in zip(clips, parts, ends, strict=True)
    ]


def posture(score: Score, name: str) -> Posture:
    """Compose a named posture of a score or of its includes.

    Raises:
        FormatError: there is no such posture, or the body cannot take it.
    """
    if name not in score.postures:
        hint = did_you_mean(name, score.postures) or f"; there are {enumerated(score.postures, 60) or 'none'}"
        raise FormatError(f"no posture {quoted(name)}{hint}", path=score.path)
    row = posture_row(score.postures[name])
    return _join_moves(score.body, name, [row], _place_distinct(score.body, [row])).posture(0)


@dataclass(frozen=True)
class _Placed:
    """D distinct postures placed on the floor, each in the frame of its facing, and the posture of each row.

    Attributes:
        taken: index of each row's posture among the D [T].
        rotations: local [D, J, 4].
        root: [D, 3], metres.
        weight: share of the weight on each foot [D, F].
        rests: whether a foot is on the floor [D, F].
        balls, tips: places of the feet [D, F, 3], metres.
        back: unit vectors from the ball of a foot towards its heel [D, F, 3].
        pivot: distance in that direction to the point about which the foot turns [D, F, 1], metres.
    """

    taken: Ints
    rotations: Floats
    root: Floats
    weight: Floats
    rests: Bools
    balls: Floats
    tips: Floats
    back: Floats
    pivot: Floats

    def part(self, start: int, stop: int) -> _Placed:
        """Return the postures of the rows from `start` up to `stop`."""
        return replace(self, taken=self.taken[start:stop])


def _place_distinct(body: Anatomy, rows: list[Row]) -> _Placed:
    """Place the distinct postures of rows with `_place_postures`."""
    numbers: dict[object, int] = {}
    distinct: list[Row] = []
    taken = np.empty(len(rows), dtype=np.int64)
    for t, row in enumerate(rows):
        # Settings are parsed and mirrored once each, so most equal ones are the same object.
        key = *map(id, row.limbs), row.up
        taken[t] = number = numbers.setdefault(key, len(distinct))
        if number == len(distinct):
            distinct.append(row)
    return replace(_place_postures(body, distinct), taken=taken)


def _place_postures(body: Anatomy, rows: list[Row]) -> _Placed:
    """Place the postures of rows on the floor, or at their height above it; check the body's limits."""
    settings = _settings(body, rows)
    degrees = _degrees(body, settings, len(rows))
    rotations = body.rotations(degrees)
    root = np.zeros((len(rows), 3))
    stands = np.zeros(len(rows), dtype=np.bool_)
    if body.leg is None:
        toes, rests = _planted_limbs(body, settings, len(rows))
        tips = toes
        weight, pivot = rests.astype(np.float64), np.zeros((len(rows), len(toes)))
    else:
        feet = _feet(body, settings, len(rows))
        toes, tips = np.array([np.take(body.foot(body.leg.toes, side), [0, -1]) for side in SIDES]).T
        rests = feet.stands | feet.touches | feet.planted
        weight, pivot = np.where(feet.stands | feet.planted, feet.weight, 0.0), feet.pivot
        stance = place_legs(body, body.leg, rotations, feet)
        rotations, root, stands = stance.rotations, stance.root, feet.stands[:, 0] | feet.stands[:, 1]
        _check_feet(rows, feet, stance.shortfall)
        for t in np.flatnonzero(stance.imbalance > REACH_TOLERANCE_M)[:1]:
            raise rows[t].where.error("the weight cannot be brought over the feet")
        solved = body.degrees(rotations)
        for side in (0, 1):  # legs on the floor: the solved angles replace those written
            for joint in body.leg_joints(body.leg, SIDES[side]):
                name = body.skeleton.names[joint]
                placed = feet.stands[:, side] | feet.touches[:, side]
                degrees[name] = np.where(placed[:, None], solved[:, joint], degrees[name])
    _check_limits(body, rows, degrees)
    root[:, 1] += _lift(body, rows, rotations, root, stands)
    points = body.skeleton.positions_and_tips(rotations, root)
    on_floor = np.array([row.up is None for row in rows])[:, None]
    above = body.skeleton.global_rotations(rotations)[:, [body.skeleton.parents[joint] for joint in toes]]
    return _Placed(
        np.arange(len(rows)),
        rotations,
        root,
        weight * on_floor,
        rests & on_floor,
        points[:, toes if body.leg else len(body.skeleton) + tips],  # a limb that is not a leg stands on its tip
        points[:, len(body.skeleton) + tips],
        rot.mul_vec(above, np.array([0.0, 0.0, -1.0])),
        pivot[..., None],
    )


def _settings(body: Anatomy, rows: list[Row]) -> dict[tuple[str, str], list[Setting]]:
    """Collect each limb's settings in all rows, by layer and side; the side of a trunk is ""."""
    out = {}
    for index, (layer, joints) in enumerate(body.layers.items()):
        for number, side in enumerate(SIDES if body.paired(joints[0]) else ("",)):
            out[layer, side] = [row.limbs[index][number] for row in rows]
    return out


def _degrees(body: Anatomy, settings: dict[tuple[str, str], list[Setting]], count: int) -> dict[str, Floats]:
    """Return the written angles of each joint, by name: [T, 3], degrees."""
    out = {name: np.zeros((count, 3)) for name in body.skeleton.names}
    for (_, side), limbs in settings.items():
        for t, setting in enumerate(limbs):
            for key, value in setting.items():
                if isinstance(key, tuple):
                    joint, axis = key
                    out[f"{side}_{joint}" if side else joint][t, axis] = value
    return out


def _feet(body: Anatomy, settings: dict[tuple[str, str], list[Setting]], count: int) -> Feet:
    """Convert the rows' settings of legs on the floor to metres and radians."""
    assert body.leg is not None  # checked by the caller
    layer = next(layer for layer, joints in body.layers.items() if body.leg.hip in joints)
    legs = [settings[layer, side] for side in SIDES]

    def read(key: str, otherwise: float) -> Floats:
        return np.array([[limb[t].get(key, otherwise) for limb in legs] for t in range(count)])

    stands, planted = read("stand", 0.0) > 0.0, read("planted", 0.0) > 0.0
    bears = stands | planted
    turn, knee, weight = read("turn", 0.0), read("knee", np.nan), read("weight", np.nan)
    others = np.where(bears[:, ::-1] & ~np.isnan(weight[:, ::-1]), 100.0 - weight[:, ::-1], 50.0)
    lean = np.stack([_mean_over_legs(legs, key, count) for key in ("lean left", "lean ahead")], axis=-1)
    return Feet(
        stands=stands,
        touches=read("touch", 0.0) > 0.0,
        planted=planted,
        out=read("out", 0.0) / 100.0,
        ahead=read("ahead", 0.0) / 100.0,
        turn=np.radians(turn),
        knee=np.radians(np.where(np.isnan(knee), turn, knee)),
        heel=np.radians(read("heel", 0.0)),
        bend=np.radians(read("bend", 0.0)),
        pivot=read("pivot", 0.0) / 100.0,
        towards=np.radians(read("towards", 0.0)),
        weight=np.where(np.isnan(weight), np.maximum(others, 0.0), weight),
        lean=lean / 100.0,
    )


def _mean_over_legs(legs: list[list[Setting]], key: str, count: int) -> Floats:
    """Return a value of the whole body [T] that either leg may set: the mean if both do, 0 if neither does."""
    written = [[leg[t][key] for leg in legs if key in leg[t]] for t in range(count)]
    return np.array([sum(values) / max(len(values), 1) for values in written])


def _planted_limbs(body: Anatomy, settings: dict[tuple[str, str], list[Setting]], count: int) -> tuple[Ints, Bools]:
    """Return the last joint of each limb [F], and whether it is planted [T, F]."""
    limbs = [(layer, side) for layer, side in settings if side]
    ends = np.array([body.named(body.layers[layer][-1], side) for layer, side in limbs], dtype=np.int64)
    planted = np.array([["planted" in settings[limb][t] for limb in limbs] for t in range(count)], dtype=bool)
    return ends, planted.reshape(count, len(limbs))


def _lift(body: Anatomy, rows: list[Row], rotations: Floats, root: Floats, stands: Bools) -> Floats:
    """Return the lift of each posture [T], metres, that brings its lowest point to the floor or its row's height.

    A standing leg already fixes the height; then nothing may be under the floor.
    """
    lowest, joints = lowest_point(body, rotations, root)
    for t in np.flatnonzero(stands):
        row = rows[t]
        if row.up is not None:
            raise row.where.error(f"up {row.up:g}, but a leg stands; give the legs a position in the air")
        if lowest[t] < -0.01:  # metres; less is invisible
            joint = body.skeleton.names[joints[t]].replace("_", " ")
            raise row.where.error(f"the {joint} would be {-100.0 * lowest[t]:.0f} cm under the floor")
    up = np.array([(row.up or 0.0) / 100.0 for row in rows])
    return np.where(stands, 0.0, up - lowest)


def _check_feet(rows: list[Row], feet: Feet, shortfall: Floats) -> None:
    """Raise FormatError if legs on the floor contradict each other, cannot reach it, or bear no weight."""
    for t in np.flatnonzero(feet.planted.any(axis=1) & (feet.stands | feet.touches).any(axis=1))[:1]:
        raise rows[t].where.error("one leg is planted, the other placed; give both their angles, or neither")
    for t in np.flatnonzero(feet.planted.any(axis=1)):
        if (up := rows[t].up) is not None:
            raise rows[t].where.error(f"up {up:g}, but a leg is planted")
    for t in np.flatnonzero(feet.touches.any(axis=1) & ~feet.stands.any(axis=1))[:1]:
        raise rows[t].where.error("a leg touches the floor, but none stands on it")
    bears = feet.stands | feet.planted
    weightless = bears.any(axis=1) & ~(bears & (feet.weight > 0.0)).any(axis=1)
    for t in np.flatnonzero(weightless)[:1]:
        raise rows[t].where.error("no foot bears weight")
    for t, side in np.argwhere(shortfall > REACH_TOLERANCE_M):
        far = f"{100.0 * shortfall[t, side]:.0f} cm"
        if feet.touches[t, side]:
            raise rows[t].where.error(f"the {SIDES[side]} foot cannot touch the floor: it stays {far} above it")
        raise rows[t].where.error(f"the {SIDES[side]} foot is {far} beyond the reach of the leg")


def _check_limits(body: Anatomy, rows: list[Row], degrees: dict[str, Floats]) -> None:
    """Raise FormatError if an angle is past its joint's limits; names line, joint, angle and limit."""
    for name in body.skeleton.names:
        _, joint = body.anatomy(name)
        swing = np.delete(degrees[name], "xyz".index(joint.long), axis=1)
        for t in np.flatnonzero(np.linalg.norm(swing, axis=1) > 180.0 + LIMIT_TOLERANCE_DEG)[:1]:
            called = " and ".join(word for word, angle in joint.angles.items() if "xyz"[angle.axis] != joint.long)
            raise rows[t].where.error(f"{name.replace('_', ' ')}: {called} together are more than half a turn")
        for word, angle in joint.angles.items():
            values = angle.sign * degrees[name][:, angle.axis]
            low, high = angle.range
            for t in np.flatnonzero((values < low - LIMIT_TOLERANCE_DEG) | (values > high + LIMIT_TOLERANCE_DEG))[:1]:
                over = values[t] > high
                called = word if over or not angle.opposite else angle.opposite
                value, limit = (values[t], high) if over else (values[t], low)
                if called != word:
                    value, limit = -value, -limit
                raise rows[t].where.error(
                    f"{name.replace('_', ' ')}: {called} {value:.0f} is past its limit of {limit:g} degrees"
                )


def _join_moves(body: Anatomy, name: str, rows: list[Row], placed: _Placed) -> Motion:
    """Join placed postures into movement: turn each to where it faces, and keep feet that bear weight in place."""
    taken = placed.taken
    turn = rot.about_vertical(np.radians([row.face for row in rows]))
    root, centre = (
        rot.mul_vec(turn, places[taken]) for places in (placed.root, body.centre_of_mass(placed.rotations, placed.root))
    )
    moved = np.zeros((len(rows), 3))
    moved[1:, [0, 2]] = np.cumsum(_steps(rows, placed, turn, centre), axis=0)[:, [0, 2]]
    # Rounded, so a score gives the same bytes on every machine.
    rotations = _rounded(placed.rotations)[taken]
    rotations[:, 0] = _rounded(rot.mul(turn, placed.rotations[taken, 0]))
    times = np.cumsum([0.0, *(row.seconds or 0.0 for row in rows[1:])])
    return Motion(body.skeleton, rotations, np.round(root + moved, 5) + 0.0, np.round(times, 4), name, keyframed=True)


def _rounded(rotations: Floats) -> Floats:
    """Round rotations [..., 4] for the motion of a score."""
    return np.asarray(np.round(rot.canonical(rotations), 8) + 0.0)


def _steps(rows: list[Row], placed: _Placed, turn: Floats, centre: Floats) -> Floats:
    """Return the displacement of the body from each row to the next [T - 1, 3], metres.

    Feet that bear weight before and after stay in place; if they disagree, their mean does. Without such feet, feet
    that rest on the floor stay. Those feet slide by the row's `go`. Without them, the centre of mass moves by it.

    Args:
        rows: the rows.
        placed: their postures.
        turn: facing of each row [T, 4].
        centre: centres of mass [T, 3], turned, metres.
    """
    taken = placed.taken
    weight, rests = placed.weight[taken], placed.rests[taken]
    balls, tips, back = (rot.mul_vec(turn[:, None], feet[taken]) for feet in (placed.balls, placed.tips, placed.back))
    held = np.minimum(weight[:-1], weight[1:])
    both = held > 0.0  # else the foot rolls over its tip
    held = np.where(both.any(axis=1, keepdims=True), held, rests[:-1] & rests[1:])
    pivot = placed.pivot[taken[1:]]
    before, after = (
        np.where(both[:, :, None], balls[part] + pivot * back[part], tips[part]) for part in (slice(-1), slice(1, None))
    )
    total = held.sum(axis=1)[:, None]
    stay = (held[..., None] * (before - after)).sum(axis=1) / np.where(total > 0.0, total, 1.0)
    go = np.zeros((len(rows) - 1, 3))
    go[:, [0, 2]] = np.array([row.go for row in rows[1:]]).reshape(-1, 2) / 100.0
    return np.where(total > 0.0, stay, centre[:-1] - centre[1:]) + rot.mul_vec(turn[1:], go)
