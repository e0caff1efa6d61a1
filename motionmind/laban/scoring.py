"""Write signs as a score: a posture at each count where a sign begins or ends."""

from __future__ import annotations

import tempfile
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import ceil
from pathlib import Path

import numpy as np

from motionmind.body.anatomy import SIDES, Anatomy
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.human import BODIES
from motionmind.errors import FormatError, MotionMindError, enumerated, quoted
from motionmind.geometry import rotations as rot
from motionmind.laban.measured import check_body
from motionmind.laban.posing import Aim, Angles, lift_leg, pose_limb, pose_trunk, standing_height
from motionmind.laban.signs import (
    BEND_STEP_DEG,
    GESTURES,
    LEGS,
    N_DECIMALS,
    PATH,
    PLACE,
    SUPPORTS,
    TURN,
    TWISTS,
    Direction,
    Sign,
    Staff,
    Turn,
    Value,
    ending,
    overlapping,
    vector_of,
)
from motionmind.laban.text import number_text
from motionmind.notation.compose import motions
from motionmind.notation.posture_line import MOVE_RANGE_COUNTS
from motionmind.notation.read import read_score
from motionmind.notation.rows import play_phrase
from motionmind.transcription.text import Vocabulary
from motionmind.transcription.words import angle_terms, limb_word

# What signs leave open: distances and heights, which a score states.
_STEP_CM, _STANCE_CM, _UP_CM = 40, 19, 15  # a step; a foot from the point between two feet; a jump
_REACH_CM = 38  # of a bent leg that rests on the floor
_HIP_CM = 8.5  # from the middle to a hip
_LOW_DEG = 45  # bend of a knee
_SUPPORT_WORDS = {"low": f" bend {_LOW_DEG}", "middle": "", "high": " heel 30"}
_TOUCH_FOOT = "ankle plantar 58, toes flexion 15"
_MAX_TURN_DEG = 170.0  # in one move of a score
_REST = {"torso": "high", "head": "high"}  # of parts without a starting position; limbs hang


@dataclass(frozen=True)
class _State:
    """A posture between signs.

    Attributes:
        aims: by column of `GESTURES`, where the part points.
        twists: by column of `TWISTS`, degrees to the left.
        touches: the columns of legs that rest on the floor.
        bears: the columns of supports that bear weight.
        stands: by column of supports, the latest sign.
    """

    aims: dict[str, Aim]
    twists: dict[str, float]
    touches: frozenset[str]
    bears: frozenset[str]
    stands: dict[str, Direction]


def score_text(staff: Staff, name: str = "notated") -> str:
    """Return a score of a staff, whose postures are where the signs point, as far as the body's joints allow.

    Signs give no distances: steps are 40 cm long, and jumps 15 cm high.

    Args:
        staff: the signs.
        name: name of the score's clip.

    Raises:
        MotionMindError: the body is unknown, or moves follow each other too fast for a score.
    """
    if staff.body not in BODIES:
        raise MotionMindError(f"no body {quoted(staff.body)}; there are {enumerated(BODIES, 9)}")
    body = anatomy_named(staff.body)
    check_body(body)
    times = _times(staff)
    vocabulary = {layer: Vocabulary() for layer in ("legs", "arms", "torso", "head")}
    table: list[list[str]] = []
    before = [""] * len(vocabulary)
    was_in_air = False
    for row, state in enumerate(_states(staff, times)):
        cells = _cells(body, state, vocabulary)
        *held, how = _move(staff, times, row, was_in_air=was_in_air, in_air=not state.bears)
        was_in_air = not state.bears
        table += held
        table.append([*how, *(new if new != old else "" for new, old in zip(cells, before, strict=True))])
        before = cells
    lines = [f"title   {staff.title}".rstrip(), f"body    {staff.body}", f"tempo   {number_text(staff.tempo)}"]
    for layer, known in vocabulary.items():
        width = max(map(len, known.names.values()))
        lines += ["", layer, *(f"  {word.ljust(width)} = {terms}" for terms, word in known.names.items())]
    lines += ["", f"clip {name}: {staff.title}".rstrip(" :"), *_columns(table)]
    return "\n".join(lines) + "\n"


def _times(staff: Staff) -> list[float]:
    """Return the counts of a score's postures: where signs begin or end, and between them if a move is too long.

    Raises:
        MotionMindError: two are too near each other.
    """
    least, most = MOVE_RANGE_COUNTS
    ends = sorted({0.0, staff.counts, *(t for sign in staff.signs for t in (sign.begin, sign.end))})
    times = ends[:1]
    for first, last in pairwise(ends):
        if round(last - first, N_DECIMALS) < least:
            near = f"{number_text(first)} and {number_text(last)}"
            raise MotionMindError(f"signs begin or end at counts {near}: a score needs {least:g} between")
        parts = ceil((last - first) / most)
        times += [round(first + (last - first) * part / parts, N_DECIMALS) for part in range(1, parts)] + [last]
    return times


def _columns(table: list[list[str]]) -> Iterator[str]:
    """Yield a clip's lines, their cells in columns; a line with only the first cell is a hold."""
    widths = [max(len(line[i]) if i < len(line) else 0 for line in table) for i in range(max(map(len, table)))]
    for line in table:
        cells = [cell.ljust(width) for cell, width in zip(line, widths, strict=False)]
        yield ("  " + " | ".join(cells)).rstrip(" |") + (" |" if not any(line[1:]) else "")


class _Track:
    """The signs of a column, by time."""

    def __init__(self, staff: Staff, column: str) -> None:
        self.start = staff.start.get(column)
        self.signs = staff.column(column)
        self.ends = [sign.end for sign in self.signs]

    def at(self, count: float) -> tuple[Sign | None, Sign | None]:
        """Return the last sign that has ended at a count, and the one that is on its way."""
        number = bisect_right(self.ends, count)
        ended = self.signs[number - 1] if number else None
        on_way = number < len(self.signs) and self.signs[number].begin < count
        return ended, self.signs[number] if on_way else None

    def values(self, count: float) -> tuple[Value | None, Value | None, float]:
        """Return the value before a count, the one that the column goes to, and the share of the way that is done."""
        ended, sign = self.at(count)
        before = ended.value if ended else self.start
        return (before, sign.value, (count - sign.begin) / sign.counts) if sign else (before, None, 0.0)


def _states(staff: Staff, times: Sequence[float]) -> Iterator[_State]:
    """Yield the postures at some counts; between the beginning and the end of a sign, a part is on its way."""
    tracks = {column: _Track(staff, column) for column in (*SUPPORTS, *GESTURES, *TWISTS)}
    stands = {column: value for column in SUPPORTS if isinstance(value := staff.start.get(column), Direction)}
    if not any(column in staff.start or staff.column(column) for column in (*SUPPORTS, *LEGS)):
        stands = dict.fromkeys(SUPPORTS, Direction(PLACE, "middle"))  # only what moves is written
    bears = frozenset(stands)
    for count in times:
        aims, twists, touches = {}, {}, set()
        for column in GESTURES:
            before, after, share = tracks[column].values(count)
            aims[column] = _between(_aim(column, before), _aim(column, after), share) if after else _aim(column, before)
            if isinstance(before, Direction) and before.touch and not after:
                touches.add(column)
        for column in TWISTS:
            before, after, share = tracks[column].values(count)
            twists[column] = _left(before) + (share * (_left(after) - _left(before)) if after else 0.0)
        if count > 0.0 and any(tracks[column].signs for column in (*SUPPORTS, *LEGS)):
            bears = _bearing(tracks, count, bears, stands)
        yield _State(aims, twists, frozenset(touches), bears, dict(stands))


def _bearing(
    tracks: dict[str, _Track], count: float, before: frozenset[str], stands: dict[str, Direction]
) -> frozenset[str]:
    """Return the supports that bear weight at a count, and add their signs to `stands`.

    While a step is on its way, the supports before it bear the weight.
    """
    now = set()
    stepping = False
    for column in SUPPORTS:
        ended, sign = tracks[column].at(count)
        stepping |= sign is not None and isinstance(sign.value, Direction)
        if ended is not None and isinstance(ended.value, Direction):
            stands[column] = ended.value
        if sign is not None or (ended is not None and ended.end == count):
            now.add(column)
    return before if stepping else frozenset(column for column in now if column in stands)


def _aim(column: str, value: Value | None) -> Aim:
    """Return where a column's part points; without a sign, limbs hang and the trunk is upright."""
    if not isinstance(value, Direction):
        return Aim(vector_of(PLACE, _REST.get(column, "low")))
    return Aim(vector_of(value.around, value.level), BEND_STEP_DEG * value.bend)


def _between(a: Aim, b: Aim, share: float) -> Aim:
    """Return where a part points on its way from `a` to `b`; from one side to the opposite it goes by way of ahead."""
    if float(a.along @ b.along) < -0.99:
        ahead = Aim(np.array([0.0, 0.0, 1.0] if abs(a.along[2]) < 0.9 else [0.0, -1.0, 0.0]), 0.5 * (a.bend + b.bend))
        return _between(a, ahead, 2.0 * share) if share < 0.5 else _between(ahead, b, 2.0 * share - 1.0)
    turn = share * rot.log(rot.between(a.along, b.along))
    return Aim(rot.mul_vec(rot.exp(turn), a.along), a.bend + share * (b.bend - a.bend))


def _left(value: Value | None) -> float:
    return float(value.left) if isinstance(value, Turn) else 0.0


# --- cells ------------------------------------------------------------------------------------------------------------


def _cells(body: Anatomy, state: _State, vocabulary: dict[str, Vocabulary]) -> list[str]:
    """Return the cells of a posture, and add its positions to the vocabulary."""
    torso, head = pose_trunk(
        body, state.aims["torso"], state.twists["torso turn"], state.aims["head"], state.twists["head turn"]
    )
    cells = []
    for layer, limb in (("legs", "leg"), ("arms", "arm")):
        names = []
        for side in SIDES:
            column = f"{side} {limb}"
            if limb == "leg" and f"{side} support" in state.bears:
                terms, word = _stand(state, side), f"stand-{state.stands[f'{side} support'].level}"
            elif limb == "leg" and column in state.touches and state.bears:
                terms, word = _touch(state.aims[column], side)
            else:
                aim = state.aims[column]
                angles = pose_limb(body, limb, side, aim, torso)
                if limb == "leg" and state.bears:
                    angles = lift_leg(body, side, aim, torso, _hip_height(body, state))
                outward = aim.along * [1.0 if side == "left" else -1.0, 1.0, 1.0]
                terms, word = _terms(body, layer, angles), limb_word(outward, aim.bend)
            names.append(vocabulary[layer].name(terms, word))
        cells.append(names[0] if names[0] == names[1] else " / ".join(names))
    for layer, angles in (("torso", torso), ("head", head)):
        sided = any(own[1] or own[2] for own in angles.values())
        moved = any(own.any() for own in angles.values())
        name = vocabulary[layer].name(_terms(body, layer, angles), "leaning" if moved else "upright")
        cells.append(f"{name} left" if sided else name)
    return cells


def _terms(body: Anatomy, layer: str, angles: Angles) -> str:
    """Return the definition of a position of a layer."""
    nothing = np.zeros(3)
    return angle_terms(body, layer, {joint: angles.get(joint, nothing) for joint in body.layers[layer]})


def _stand(state: _State, side: str) -> str:
    """Return the definition of a leg that bears weight: under its hip, or away from the point between both feet."""
    sign = state.stands[f"{side} support"]
    out = ahead = 0.0
    if len(state.bears) == 2 and sign.around != PLACE:
        along = vector_of(sign.around, "middle")
        out = _STANCE_CM * float(along[0]) * (1.0 if side == "left" else -1.0) - _HIP_CM
        out += 0.4 * _HIP_CM  # feet pass each other
        ahead = _STANCE_CM * float(along[2])
    return f"stand out {_number(out)} ahead {_number(ahead)}{_SUPPORT_WORDS[sign.level]}"


def _touch(aim: Aim, side: str) -> tuple[str, str]:
    """Return the definition of a leg that rests on the floor without weight, and its name."""
    along = aim.along * [1.0 if side == "left" else -1.0, 1.0, 1.0]
    level = np.array([along[0], along[2]])
    if aim.bend or np.linalg.norm(level) < 0.1:
        out, ahead = _REACH_CM * level / max(float(np.linalg.norm(level)), 0.1)
        return f"stand out {_number(out)} ahead {_number(ahead)}{' heel 60' if aim.bend else ''} weight 0", "touch"
    return f"touch towards {_number(float(np.degrees(np.arctan2(*level))))}, {_TOUCH_FOOT}", "touch"


def _hip_height(body: Anatomy, state: _State) -> float:
    """Return the least height of the hips over the floor that the legs that bear weight allow, metres."""
    levels = [state.stands[column].level for column in state.bears]
    return standing_height(body, _LOW_DEG if "low" in levels else 0.0)


def _number(value: float) -> str:
    return f"{round(value, 1) + 0.0:g}"


# --- moves ------------------------------------------------------------------------------------------------------------


def _move(staff: Staff, times: Sequence[float], row: int, *, was_in_air: bool, in_air: bool) -> list[list[str]]:
    """Return the first cells of a posture: of the move that leads there, and of moves before it if it turns by much."""
    before, up = (f" up {_UP_CM}" if high else "" for high in (was_in_air, in_air))
    if row == 0:
        return [[f"start{up}"]]
    first, last = times[row - 1], times[row]
    turns = staff.column(TURN)
    turn = sum(
        _left(sign.value) * (min(sign.end, last) - max(sign.begin, first)) / sign.counts
        for sign in (turns[place] for place in overlapping(turns, first, last))
    )
    go = ""
    for column in (*SUPPORTS, PATH):
        sign = ending(staff.column(column), last)
        if sign is None or not isinstance(sign.value, Direction) or sign.value.around == PLACE:
            continue
        if column == PATH or _steps(staff, sign):
            go = _go(sign.value.around)
    moves = max(1, ceil(abs(turn) / _MAX_TURN_DEG))
    if (last - first) / moves < MOVE_RANGE_COUNTS[0]:
        raise MotionMindError(
            f"a turn of {abs(turn):g} degrees from count {first:g} to {last:g} is too fast for a score"
        )
    counts = number_text(last - first) if moves == 1 else str(Fraction(number_text(last - first)) / moves)
    turned = round(turn / moves, 2) + 0.0
    words = counts + (f" turn {abs(turned):g} {'left' if turned > 0 else 'right'}" if turned else "")
    return [[words + before]] * (moves - 1) + [[words + up + go]]


def _steps(staff: Staff, sign: Sign) -> bool:
    """Return whether a support's sign is a step onto that foot alone, which did not bear weight before."""
    other = staff.column(SUPPORTS[1 - SUPPORTS.index(sign.column)])
    if any(other[place].end >= sign.end for place in overlapping(other, sign.begin, sign.end)):
        return False
    if sign.begin == 0.0:
        return sign.column not in staff.start
    return ending(staff.column(sign.column), sign.begin) is None


def _go(around: str) -> str:
    """Return the words of a step's travel."""
    along = vector_of(around, "middle")
    left, ahead = (round(_STEP_CM * float(along[axis])) for axis in (0, 2))
    words = [f"{'ahead' if ahead > 0 else 'back'} {abs(ahead)}"] if ahead else []
    words += [f"{'left' if left > 0 else 'right'} {abs(left)}"] if left else []
    return f" go {' '.join(words)}"


def checked_score(staff: Staff) -> str:
    """Return a score of a staff, as `score_text`.

    Raises:
        MotionMindError: as `score_text`; or the body's joints cannot follow the signs; says why.
    """
    text = score_text(staff)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "notated.score"
        path.write_text(text, encoding="utf-8")
        at_fault = "the signs cannot be written as a score"
        try:
            score = read_score(path)
            for clip in score.clips:
                play_phrase(clip)
            at_fault = "the body cannot follow the signs"
            motions(score)
        except FormatError as error:
            raise MotionMindError(f"{at_fault}: {str(error).partition(': ')[2]}") from None
    return text
