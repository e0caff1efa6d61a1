"""The price of each restriction: search again without it, and compare the two certificates."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, TypeVar

from motionmind.search.length import choose_length
from motionmind.search.problem import Problem
from motionmind.search.solve import Certificate, solve
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS
from motionmind.tween.request import TweenRequest

_Item = TypeVar("_Item")


Compared = Literal["cost", "haste and pace", "costs without the guide"]


@dataclass(frozen=True)
class WhatIf:
    """The price of a restriction: the saving in cost without it.

    Attributes:
        without: the restriction's name, such as "pin left_wrist=B".
        least: lower bound on its price, nats.
        most: upper bound on its price, nats.
        proven: whether the two bounds agree to 1e-6 nats per search.
        moves: number of moves that the answer gains without it; negative for fewer.
        compared: the costs compared: "cost", the tween's own; or, for a length or duration, since another length has
            another guide, "haste and pace", or "costs without the guide" if the request has no pace.
    """

    without: str
    least: float
    most: float
    proven: bool
    moves: int
    compared: Compared


class Answer(NamedTuple):
    """A request, its search problem, and the certificate of the best path."""

    request: TweenRequest
    problem: Problem
    certificate: Certificate


def find_what_if(asked: Answer, answer: Callable[[TweenRequest], Answer]) -> tuple[WhatIf, ...]:
    """Find the price of each pin, held joint, state to avoid and via, and of the given length.

    Where the length is open and paced, dropping a restriction may change the number of moves and the moves at which
    the path passes vias. Then compare costs at the same number of moves, with the other vias at the answer's moves.

    Args:
        asked: the request, with its answer.
        answer: answers another request between the same ends. Stop after an interrupted search.
    """
    out, open_length = [], asked.problem.tolls is not None and not asked.request.fixes_length
    stops = [(posture, move) for (posture, *_), move in zip(asked.request.vias, asked.certificate.passed, strict=True)]
    placed = replace(asked.request, moves=_moves(asked), via=stops) if open_length else asked.request
    alikes = (alike for _, alike in _without_each(asked._replace(request=placed)))
    for (name, request), alike in zip(_without_each(asked), alikes, strict=False):  # `placed` gives the length, too
        freed = answer(request)
        moves = _moves(freed) - _moves(asked)
        if open_length and (moves != 0 or request.via):
            freed = answer(alike)
        if "interrupted" in (asked.certificate.status, freed.certificate.status):
            break
        out.append(_compare(name, asked, freed, moves))
    return tuple(out)


def _moves(answer: Answer) -> int:
    """Return the number of an answer's moves."""
    return len(answer.certificate.path) - 1


def _without_each(asked: Answer) -> Iterator[tuple[str, TweenRequest]]:
    """Yield the name of each restriction, and the request without it."""
    request = asked.request
    for joint, end in request.pin.items():
        others = {other: request.pin[other] for other in request.pin if other != joint}
        yield f"pin {joint}={end}", replace(request, pin=others)
    for i, joint in enumerate(request.hold):
        yield f"hold {joint}", replace(request, hold=_all_but(request.hold, i))
    for i, (joint, state) in enumerate(request.avoid):
        yield f"avoid {joint}={state}", replace(request, avoid=_all_but(request.avoid, i))
    for i, (_, move, seconds) in enumerate(request.vias):
        name = f"via {i + 1}" + ("" if move is None else f" after move {move}")
        name += "" if seconds is None else f" at {seconds:g} s"
        yield name, replace(request, via=_all_but(request.via, i))
    if request.fixes_length:
        longest = max(request.search.max_moves, _moves(asked))
        untimed = [posture if move is None else (posture, move) for posture, move, _ in request.vias]
        freed = TweenRequest.of(request, moves=None, duration=None, counts=None, via=untimed, max_moves=longest)
        yield _length_name(request), freed


def _length_name(request: TweenRequest) -> str:
    """Name the length that a request gives: "moves 8", "moves 6..10", "duration 2.5", or both."""
    names = []
    if request.moves is not None:
        least, most = request.move_range
        names.append(f"moves {least}" if least == most else f"moves {least}..{most}")
    if request.counts is not None:
        names.append(f"counts {request.counts:g}")
    if request.duration is not None:
        names.append(f"duration {request.duration:g}")
    return " and ".join(names)


def _compare(name: str, asked: Answer, freed: Answer, moves: int) -> WhatIf:
    """Bound the difference between two optima from below and above; the second makes `moves` more moves.

    Every path that keeps a restriction is also valid without it, so the difference is never negative.
    """
    same = _moves(asked) == _moves(freed) and asked.request.length == freed.request.length
    compared: Compared = "cost" if same else "haste and pace"
    if asked.problem.tolls is None and not same:
        compared = "cost" if asked.problem.guide is None else "costs without the guide"
    costs = {"cost": _cost, "haste and pace": _paced, "costs without the guide": _unguided}[compared]
    (cost, bound), (freed_cost, freed_bound) = costs(asked), costs(freed)
    least, most = max(bound - freed_cost, 0.0), max(cost - freed_bound, 0.0)
    return WhatIf(name, least, most, most - least <= 2.0 * OPTIMAL_WITHIN_NATS, moves, compared)


def _cost(answer: Answer) -> tuple[float, float]:
    """Return an answer's cost and its lower bound, nats."""
    return answer.certificate.cost, answer.certificate.lower_bound


def _paced(answer: Answer) -> tuple[float, float]:
    """Return haste plus tolls of an answer's number of moves, nats, as both cost and bound, since it is exact."""
    if _moves(answer) == 0:  # to stay is free
        return 0.0, 0.0
    cost = choose_length(answer.problem).cost
    return cost, cost


def _unguided(answer: Answer) -> tuple[float, float]:
    """Return the cost of the cheapest path without the guide, and its lower bound, nats."""
    if _moves(answer) == 0:  # to stay is free
        return 0.0, 0.0
    found = solve(replace(answer.problem, guide=None))
    return found.cost, found.lower_bound


def _all_but(sequence: Sequence[_Item], i: int) -> list[_Item]:
    return [*sequence[:i], *sequence[i + 1 :]]
