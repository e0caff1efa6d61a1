"""Read a score into the columns of a staff: one sign for each movement that changes what a column says."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import msgspec
import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.laban.measured import Measured, measure
from motionmind.laban.signs import (
    BEND_STEP_DEG,
    COLUMNS,
    GESTURES,
    LEGS,
    N_DECIMALS,
    PATH,
    SUPPORTS,
    TURN,
    TWISTS,
    Direction,
    Hold,
    Sign,
    Staff,
    Turn,
    Value,
    nearest_bend,
    nearest_sign,
    nearest_turn,
    vector_of,
)
from motionmind.laban.supports import Supported, support_signs
from motionmind.notation.compose import played
from motionmind.notation.score import Clip, Score

STILL_DEG = 1.0  # a part that turns or bends by less in a move is still


class Deviation(msgspec.Struct, frozen=True):
    """Deviation of a sign from the movement that it stands for.

    Attributes:
        column: the sign's column.
        count: the count where it ends.
        sign: what it says.
        degrees: angle between its direction and the movement's at its end.
        most: the greatest angle until the column's next sign begins.
        bend: difference of the limb's bend at its end, degrees.
    """

    column: str
    count: float
    sign: str
    degrees: float
    most: float
    bend: float


class Notated(NamedTuple):
    """A score as signs.

    Attributes:
        staff: the signs; their tempo is the clip's mean.
        deviations: how far each is from the movement.
        is_steady: whether the clip keeps to one tempo.
    """

    staff: Staff
    deviations: list[Deviation]
    is_steady: bool


def notate(score: Score, clip: Clip, bar: int) -> Notated:
    """Return a score's clip as signs, each the nearest to the posture at its end.

    Args:
        score: the score.
        clip: one of its clips.
        bar: counts in a bar.

    Raises:
        FormatError: as `compose`.
        MotionMindError: the body is not a person's.
    """
    ((rows, motion),) = played(score, [clip])
    measured = measure(score.body, rows, motion)
    whole = np.cumsum([0.0, *(row.counts for row in rows[1:])])
    counts = np.round(whole, N_DECIMALS)
    seconds = sum(row.seconds or 0.0 for row in rows[1:])
    tempo = 60.0 * float(whole[-1]) / seconds if seconds else score.tempo
    start: dict[str, Value] = {}
    signs: list[Sign] = []
    deviations: list[Deviation] = []
    supported = support_signs(measured)
    for column in COLUMNS:
        for sign, deviation in _column(column, measured, supported, counts):
            deviations.append(deviation)
            if isinstance(sign, Sign):
                signs.append(sign)
            else:
                start[column] = sign
    title = " ".join((clip.about or score.title or clip.name).split())
    staff = Staff(
        title,
        score.body.skeleton.name,
        round(tempo, N_DECIMALS),
        bar,
        float(counts[-1]),
        start,
        tuple(signs),
    )
    beats = {round((row.seconds or 0.0) / row.counts, 9) for row in rows[1:]}
    return Notated(staff, [one for one in deviations if one.degrees or one.most or one.bend], len(beats) < 2)


def _column(
    column: str, measured: Measured, supported: Supported, counts: Floats
) -> list[tuple[Sign | Value, Deviation]]:
    """Return a column's starting position if it has one, then its signs, each with how far it is off."""
    if column in (*SUPPORTS, PATH):
        return [*_events(column, supported, counts)]
    if column in GESTURES:
        return [*_gestures(column, measured, counts)]
    if column in TWISTS:
        return [*_twists(column, measured.twists[column], counts)]
    return [*_turns(measured.facing, supported, counts)]


def _events(column: str, supported: Supported, counts: Floats) -> Iterator[tuple[Sign | Value, Deviation]]:
    """Yield the signs of supports and paths, each for one move, and the holds between them."""
    side = SUPPORTS.index(column) if column in SUPPORTS else -1
    held = -1  # the row where a hold begins
    for row in range(len(counts) + 1):
        value, degrees = supported.events[row][side] if row < len(counts) else (None, 0.0)
        keeps = side >= 0 and 0 < row < len(counts) and value is None and bool(supported.bears[row, side])
        if keeps and held < 0:
            held = row - 1
        if held >= 0 and not keeps:
            yield (
                _made(column, Hold(), counts, held, row - 1),
                _deviation(column, counts[row - 1], Hold(), 0.0, 0.0, 0.0),
            )
            held = -1
        if value is not None:
            sign = value if row == 0 else _made(column, value, counts, row - 1, row)
            yield sign, _deviation(column, counts[row], value, degrees, degrees, 0.0)


def _gestures(column: str, measured: Measured, counts: Floats) -> Iterator[tuple[Sign | Value, Deviation]]:
    """Yield the direction signs of a part of the body; none while a leg bears weight."""
    along, bends = measured.directions[column], measured.bends.get(column)
    states: list[Direction | None] = []
    angles, bent = np.zeros(len(along)), np.zeros(len(along))
    for row, direction in enumerate(along):
        if column in LEGS and measured.bears[row, LEGS.index(column)]:
            states.append(None)
            continue
        around, level = nearest_sign(direction)
        bend = 0 if bends is None else nearest_bend(float(bends[row]))
        touch = column in LEGS and bool(measured.touches[row, LEGS.index(column)])
        states.append(Direction(around, level, bend, touch))
        angles[row] = _angle(direction, vector_of(around, level))
        bent[row] = 0.0 if bends is None else abs(float(bends[row]) - BEND_STEP_DEG * bend)
    moves = np.array([_angle(a, b) > STILL_DEG for a, b in pairwise(along)], dtype=np.bool_)
    if bends is not None:
        moves |= np.abs(np.diff(bends)) > STILL_DEG
    for run in _runs(states, angles + bent, moves):
        value = states[run.end]
        assert value is not None  # as of every run
        sign = value if run.begin < 0 else _made(column, value, counts, run.begin, run.end)
        most = float(angles[run.end : run.last + 1].max())
        yield sign, _deviation(column, counts[run.end], value, angles[run.end], most, bent[run.end])


def _twists(column: str, degrees: Floats, counts: Floats) -> Iterator[tuple[Sign | Value, Deviation]]:
    """Yield the turn signs of the torso or the head: where it faces, against the front of the body."""
    states = [nearest_turn(angle) for angle in degrees.tolist()]
    angles = np.abs(degrees - states)
    for run in _runs(states, angles, np.abs(np.diff(degrees)) > STILL_DEG):
        value = Turn(states[run.end])
        sign = value if run.begin < 0 else _made(column, value, counts, run.begin, run.end)
        most = float(angles[run.end : run.last + 1].max())
        if run.begin >= 0 or value.left:
            yield sign, _deviation(column, counts[run.end], value, angles[run.end], most, 0.0)


def _turns(facing: Floats, supported: Supported, counts: Floats) -> Iterator[tuple[Sign | Value, Deviation]]:
    """Yield the turn signs of the body: how far it turns without rest to one side, until it steps."""
    turned = facing - facing[0]
    states = [nearest_turn(angle) for angle in turned.tolist()]
    angles = np.abs(turned - states)
    steps = np.array([any(value for value, _ in events[:2]) for events in supported.events])
    whole: list[_Run] = []
    for run in _runs(states, angles, np.abs(np.diff(turned)) > STILL_DEG):
        last = whole[-1] if whole else run
        goes_on = (
            last.begin >= 0
            and run.begin == last.end
            and not steps[run.begin + 1 : run.end + 1].any()
            and (states[run.end] > states[last.end]) == (states[last.end] > states[last.begin])
        )
        if goes_on:
            whole[-1] = _Run(last.begin, run.end, run.last)
        else:
            whole.append(run)
    for before, run in pairwise(whole):
        value = Turn(states[run.end] - states[before.end])
        most = float(angles[run.end : run.last + 1].max())
        sign = _made(TURN, value, counts, run.begin, run.end)
        yield sign, _deviation(TURN, counts[run.end], value, angles[run.end], most, 0.0)


def _made(column: str, value: Value, counts: Floats, first: int, last: int) -> Sign:
    """Return the sign of a movement from one row to another."""
    begin = float(counts[first])
    return Sign(column, begin, round(float(counts[last]) - begin, N_DECIMALS), value)


def _deviation(column: str, count: float, value: Value, degrees: float, most: float, bend: float) -> Deviation:
    return Deviation(column, float(count), str(value), *(round(float(one), 1) for one in (degrees, most, bend)))


class _Run(NamedTuple):
    """Rows in a row with one state: the movement that leads there.

    Attributes:
        begin, end: the rows from which and to which it leads; begin is -1 for the starting position.
        last: the last row of the run.
    """

    begin: int
    end: int
    last: int


def _runs(states: Sequence[object], degrees: Floats, moves: Bools) -> Iterator[_Run]:
    """Yield the runs of rows whose state is the same, and not None.

    A movement begins when the part starts to move, or when the movement before it ends. It ends in the row where the
    part, without having rested, is nearest to the sign's direction.

    Args:
        states: of each row [T].
        degrees: deviation of each row from its sign [T].
        moves: whether the part moves between one row and the next [T - 1].
    """
    first, arrived = 0, 0
    while first < len(states):
        last = first
        while last + 1 < len(states) and states[last + 1] == states[first]:
            last += 1
        if states[first] is None:
            arrived = last
        elif first == 0:
            yield _Run(-1, 0, last)
        else:
            begin = first - 1
            while begin > arrived and moves[begin - 1]:
                begin -= 1
            rests = first
            while rests < last and moves[rests]:
                rests += 1
            arrived = first + int(np.argmin(np.round(degrees[first : rests + 1], 6)))
            yield _Run(begin, arrived, last)
        first = last + 1


def _angle(a: Floats, b: Floats) -> float:
    """Return the angle between two unit vectors, degrees."""
    return float(2.0 * np.degrees(np.arcsin(min(0.5 * float(np.linalg.norm(a - b)), 1.0))))
