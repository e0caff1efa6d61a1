"""The options of a tween: the rule that each must follow, and the options of its search.

The command line's options, the report's `asked` and the options that `vary` accepts are the rows of `OPTIONS`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from numbers import Integral
from types import MappingProxyType
from typing import Any, get_args

from motionmind.arguments import (
    check_flag,
    check_integer,
    check_items,
    check_mapping,
    check_real,
    check_text,
    described,
)
from motionmind.body.rates import MAX_FPS
from motionmind.errors import MotionMindError, WrongTypeError
from motionmind.footing.corrections import Correction
from motionmind.grammar.schemes import Scheme, Weights
from motionmind.tween.counts import COUNTS_RANGE, TEMPO_RANGE_BPM

MAX_MOVES = 10_000  # more is a typing error, and exceeds memory
MAX_NODES = 1_000_000_000
MAX_PATH_POINTS = 10_000
MAX_PATH_M = 200.0  # through the largest stage
MAX_REACH = 1e4  # metres and seconds; more is a typing error
PACE_RANGE = 0.05, 20.0  # multiples of the corpus's pace

ReachOption = tuple[str, Sequence[float], float]  # joint, place in metres, seconds
StayOption = tuple[str, float, float]  # joint, shares of the duration
_Rule = Callable[[str, Any], Any]  # check the value of a named option, and return it as the request keeps it


def _whole(least: int, most: int | None = None) -> _Rule:
    """Return the rule for a whole number, Python's or NumPy's."""
    limits = f"of at least {least}" if most is None else f"from {least} to {most}"

    def take(name: str, value: Any) -> Any:
        is_whole = isinstance(value, Integral) and not isinstance(value, bool)
        if is_whole and least <= value and (most is None or value <= most):
            return value
        raise (MotionMindError if is_whole else WrongTypeError)(
            f"{name} must be a whole number {limits}, not {described(value)}"
        )

    return take


def _number(least: float, most: float, unit: str = "") -> _Rule:
    """Return the rule for a number in a range; NaN lies in none."""

    def take(name: str, value: Any) -> Any:
        check_real(name, value)
        if not least <= value <= most:
            raise MotionMindError(f"{name} must be a number{unit} from {least:g} to {most:g}, not {value}")
        return value

    return take


def _choice(choices: Sequence[str]) -> _Rule:
    """Return the rule for one of several words."""

    def take(name: str, value: Any) -> Any:
        check_text(name, value)
        if value not in choices:
            listed = f"{', '.join(map(repr, choices[:-1]))} or {choices[-1]!r}"
            raise MotionMindError(f"{name} must be {listed}, not {value!r}")
        return value

    return take


def _items(wanted: str, *types: type, each: _Rule = lambda _, item: item) -> _Rule:
    """Return the rule for a sequence, which the request copies."""

    def take(name: str, value: Any) -> Any:
        check_items(name, value, wanted, *types)
        return tuple(each(name, item) for item in value)

    return take


def _or_none(rule: _Rule) -> _Rule:
    return lambda name, value: None if value is None else rule(name, value)


def _checked(check: Callable[[str, Any], None]) -> _Rule:
    """Return the rule for a value that only needs a check of its type."""

    def take(name: str, value: Any) -> Any:
        check(name, value)
        return value

    return take


def _take_moves(name: str, value: Any) -> Any:
    """Check a number of moves, or the least and the greatest."""
    if not isinstance(value, tuple):
        return _whole(1, MAX_MOVES)(name, value)
    if len(value) != 2:
        raise WrongTypeError(f"{name} must be a whole number, or a pair of them, not {len(value)} of them")
    least, most = (_whole(1, MAX_MOVES)(name, number) for number in value)
    if least > most:
        raise MotionMindError(f"{name} must be a range from the least to the greatest, not from {least} to {most}")
    return value


def _take_pins(name: str, value: Any) -> Any:
    """Check the pinned joints, and copy them."""
    check_mapping(name, value)
    return MappingProxyType(dict(value))


def _take_accent(name: str, value: Any) -> Any:
    """Check the count of an accent; a time is checked with the length."""
    return value if isinstance(value, str) else _number(*COUNTS_RANGE)(name, value)


def _take_vias(name: str, value: Any) -> Any:
    """Check the moves or times of the postures to pass through."""
    check_items(name, value, "postures, or pairs of a posture and a move or a time")
    vias = tuple(value)
    for number, via in enumerate(vias, start=1):
        if isinstance(via, tuple) and not isinstance(via[1], str):  # a time is checked with the tempo
            _, move = via
            _or_none(_whole(1, MAX_MOVES - 1))(f"via {number}: the move", move)
    return vias


def _take_reaches(name: str, value: Any) -> Any:
    """Check joints, each with a place and a time, and copy them."""
    check_items(name, value, "a joint's name, its place and seconds each", tuple, list)
    out = []
    for item in value:
        if len(item) != 3:
            raise WrongTypeError(f"{name}: give a joint's name, its place and seconds, not {described(item)}")
        joint, place, seconds = item
        check_text(f"{name}: the joint", joint)
        place = tuple(place) if isinstance(place, Iterable) and not isinstance(place, str) else (place,)
        for number in (*place, seconds):
            check_real(f"{name} {joint}", number)
            if not abs(number) <= MAX_REACH:
                raise MotionMindError(
                    f"{name} {joint}: metres and seconds are numbers up to {MAX_REACH:g}, not {number}"
                )
        if len(place) != 3:
            raise MotionMindError(f"{name} {joint}: a place has three coordinates, x, y and z, not {len(place)}")
        if not seconds > 0.0:
            raise MotionMindError(f"{name} {joint}: the time must be more than 0 s, A's, not {seconds} s")
        out.append((joint, place, seconds))
    return tuple(out)


def _take_place(name: str, value: Any) -> Any:
    """Check where B stands, x, z and perhaps its facing, and copy it."""
    wanted = "x and z in metres, and perhaps a facing in degrees"
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise WrongTypeError(f"{name} must be {wanted}, not {described(value)}")
    place = tuple(value)
    for number in place:
        check_real(name, number)
    if len(place) not in (2, 3) or not all(abs(number) <= MAX_REACH for number in place):
        raise MotionMindError(f"{name} must be {wanted}, up to {MAX_REACH:g} each, not {', '.join(map(str, place))}")
    return place


def _take_path(name: str, value: Any) -> Any:
    """Check the points of a path, each x and z, and copy them."""
    check_items(name, value, "points, each x and z")
    points = tuple(tuple(point) if isinstance(point, Iterable) else (point,) for point in value)
    if not 1 <= len(points) <= MAX_PATH_POINTS:
        raise MotionMindError(f"{name} must have 1 to {MAX_PATH_POINTS} points, not {len(points)}")
    far = 0.0
    for number, point in enumerate(points, start=1):
        for coordinate in point:
            check_real(f"{name}: point {number}", coordinate)
        shown = ", ".join(map(str, point))
        if len(point) not in (2, 4) or not all(abs(coordinate) <= MAX_REACH for coordinate in point):
            raise MotionMindError(f"{name}: point {number} must be x, z in metres, up to {MAX_REACH:g}, not {shown}")
        if len(point) != len(points[0]):
            raise MotionMindError(f"{name}: all points must have a time and a facing, or none, not {shown}")
        far += 0.0 if number == 1 else math.dist(points[number - 2][:2], point[:2])
    if far > MAX_PATH_M:
        raise MotionMindError(f"{name}: the path is {far:g} m long, and a tween may travel up to {MAX_PATH_M:g} m")
    return points


def _take_stays(name: str, value: Any) -> Any:
    """Check joints, each with the shares of the duration between which it stays, and copy them."""
    check_items(name, value, "a joint's name and two shares of the duration each", tuple, list)
    out = []
    for item in value:
        if len(item) != 3:
            raise WrongTypeError(f"{name}: give a joint's name and two shares of the duration, not {described(item)}")
        joint, begins, ends = item
        check_text(f"{name}: the joint", joint)
        for share in (begins, ends):
            _number(0.0, 1.0)(f"{name} {joint}: a share of the duration", share)
        if not begins < ends:
            raise MotionMindError(f"{name} {joint}: it must end after it begins, not at {begins:g} and {ends:g}")
        out.append((joint, float(begins), float(ends)))
    return tuple(out)


_nats = _number(0.0, 1e6, " of nats")  # larger sums lose the other costs to rounding, and then overflow
_share = _number(0.0, 1.0)
_flag = _checked(check_flag)

# The rule of each option, in the order of reports.
OPTIONS: Mapping[str, _Rule] = {
    "moves": _or_none(_take_moves),
    "max_moves": _whole(1, MAX_MOVES),
    "duration": _or_none(_checked(check_real)),
    "tempo": _or_none(_number(*TEMPO_RANGE_BPM, " of counts a minute")),
    "counts": _or_none(_number(*COUNTS_RANGE)),
    "pace": _number(*PACE_RANGE),
    "accent": _items("counts or times", int, float, str, each=_take_accent),
    "accent_kind": _choice(("fast", "still")),
    "pin": _take_pins,
    "hold": _items("joints' names", str),
    "avoid": _items("pairs of a joint's name and a state", tuple, list),
    "via": _take_vias,
    "reach": _take_reaches,
    "to": _or_none(_take_place),
    "along": _or_none(_take_path),
    "stay": _take_stays,
    "unlike": _items("tweens"),
    "differ": _share,
    "within": _share,
    "what_if": _flag,
    "sample": _flag,
    "seed": _whole(0),
    "strict": _flag,
    "whole_body": _flag,
    "node_budget": _whole(1, MAX_NODES),
    "memory": _or_none(_whole(1, 1 << 50)),  # bytes
    "weights": _choice(get_args(Weights)),
    "novelty": _share,
    "coordination": _choice(get_args(Scheme)),
    "lambda_": _nats,
    "beta": _nats,
    "tau": _nats,
    "bridge_price": _nats,
    "guide": _nats,
    "liveliness": _share,
    "passage": _or_none(_checked(check_text)),
    "without": _items("corrections' names", str, each=_choice(get_args(Correction))),
    "fps": _number(0.01, MAX_FPS, " of frames a second"),
}


def check_time(joint: str, seconds: float, lasts: float, remedy: str = "") -> None:
    """Check that the time of a reach lies between A and B."""
    if not 0.0 < seconds < lasts:
        between = f"{seconds:g} s is not between A and B: the movement lasts {lasts:.2f} s"
        raise MotionMindError(f"reach {joint}: {between}{remedy}")


def is_timed(along: Sequence[Sequence[float]]) -> bool:
    """Return whether the points of a path have times and facings, too."""
    return len(along[0]) > 2


def take_options(options: Any) -> None:
    """Check the fields of a dataclass by their rules, and copy mutable values."""
    for one in fields(options):
        if one.name in OPTIONS:
            value = OPTIONS[one.name](one.name.rstrip("_"), getattr(options, one.name))
            object.__setattr__(options, one.name, value)


@dataclass(frozen=True, kw_only=True)
class SearchOptions:
    """The options of the search for a path: its costs, method and limits.

    Attributes:
        max_moves: greatest number of moves that the search may find.
        within: share by which the cost of a tween that differs from others may exceed the proven lower bound; 0 finds
            the best.
        sample: sample a path with probability proportional to exp(-cost) instead of finding the best one; it has as
            many moves as the best. See `motionmind.search.sample` for the accuracy of the distribution.
        seed: seed of the sample, at least 0.
        strict: forbid bridges: every move of every joint is attested, or a wait at its goal.
        whole_body: search whole postures of the corpus in their recorded order, from the one nearest to A to the one
            nearest to B: the search of 1998, as a baseline.
        node_budget: nodes that the search may hold at once; it also stops after this many expansions.
        memory: bytes for these nodes, instead of `node_budget`.
        weights: cost of a transition: "conditional", -log P(next state | state), or "printed", as in the papers.
        coordination: model of a joint's coordination: "posture", P(joint's state | parent's state); "progression",
            P(joint's next state | its state, parent's state and next state), as in [C98]; or "none".
        lambda_: factor of the coordination's -log P.
        beta: nats for each move that a joint waits at its goal.
        tau: nats for each move.
        bridge_price: nats for each degree of an unattested move.
        guide: kappa, nats for a joint that is one tolerance away from the corpus walks for 0.2 s; 0 turns the guide
            off. It shrinks as novelty grows; a search of whole postures has no guide.

    Raises:
        WrongTypeError: a value has the wrong type.
        MotionMindError: a value is out of range.

    >>> from motionmind import SearchOptions
    >>> SearchOptions(tau=-1.0)
    Traceback (most recent call last):
    motionmind.errors.MotionMindError: tau must be a number of nats from 0 to 1e+06, not -1.0
    """

    max_moves: int = 60
    within: float = 0.0
    sample: bool = False
    seed: int = 0
    strict: bool = False
    whole_body: bool = False
    node_budget: int = 200_000
    memory: int | None = None
    weights: Weights = "conditional"
    coordination: Scheme = "posture"
    lambda_: float = 1.0
    beta: float = 1.0
    tau: float = 1.0
    bridge_price: float = 1.0
    guide: float = 1.0

    def __post_init__(self) -> None:
        take_options(self)
        if self.whole_body and self.coordination == "progression":
            raise MotionMindError("whole_body: coordination can be posture or none, not progression")

    @property
    def coordination_factor(self) -> float:
        """Factor of the coordination's -log P: lambda, or 0 if joints move independently."""
        return 0.0 if self.coordination == "none" else self.lambda_

    def nodes(self, chains: int) -> int:
        """Return the number of nodes that the search may hold, for a body with this many joint chains."""
        check_integer("chains", chains)
        if self.memory is None:
            return self.node_budget
        from motionmind.search.astar import node_capacity  # numba is slow to import

        nodes = node_capacity(int(self.memory), chains)
        if nodes < 1:
            raise MotionMindError(f"memory={self.memory} is too small: a search needs some megabytes")
        return min(nodes, MAX_NODES)
