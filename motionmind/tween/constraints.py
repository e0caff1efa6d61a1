"""Restrictions in the words of joints: where a joint is pinned, what it holds, which states it avoids."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Ints
from motionmind.discretize import StateSpace
from motionmind.errors import MotionMindError, NoPathError
from motionmind.search.problem import Model, Problem, Via, costs_to_go, with_waits
from motionmind.search.solve import feasible

FARTHEST = 60  # moves by which a via is moved to see whether that helps


class Constraint(NamedTuple):
    """What was asked, such as "pin left_wrist=B", and whether each state may then be on the way [G]."""

    name: str
    allowed: Bools


def constraints_of(
    space: StateSpace,
    start: Ints,
    goal: Ints,
    pin: Mapping[str, str],
    hold: Sequence[str],
    avoid: Sequence[tuple[str, int | str]],
) -> list[Constraint]:
    """Which states each joint may be in on the way, after posture A and before posture B.

    Args:
        space: the states of each joint.
        start: A's states [L].
        goal: B's states [L].
        pin: joints that are in A's state until the last move, or in B's from the first on: "A" or "B".
        hold: joints that stay in the state that A and B share.
        avoid: joints, each with a state, by its number or its name, that it is not in.

    Raises:
        MotionMindError: no such joint or state.
        NoPathError: A and B differ where a joint is to be held.
    """
    out = []
    for joint, end in pin.items():
        if end not in ("A", "B"):
            raise MotionMindError(f"pin {joint}={end}: a joint is pinned to A or to B")
        state = int((start if end == "A" else goal)[space.index(joint)])
        out.append(Constraint(f"pin {joint}={end}", _only(space, space.index(joint), state)))
    for joint in hold:
        chain = space.index(joint)
        if start[chain] != goal[chain]:
            a, b = (space.label(chain, int(end[chain])) for end in (start, goal))
            raise NoPathError(f"hold {joint}: A and B differ there, {a} and {b}, so that it cannot be held")
        out.append(Constraint(f"hold {joint}", _only(space, chain, int(start[chain]))))
    for joint, wanted in avoid:
        chain = space.index(joint)
        allowed = np.ones(space.starts[-1], dtype=bool)
        allowed[space.starts[chain] + _state(space, chain, wanted)] = False
        out.append(Constraint(f"avoid {joint}={wanted}", allowed))
    return out


def restrict(model: Model, asked: Sequence[Constraint]) -> Model:
    """The model with those states on the way that all restrictions allow."""
    return model._replace(allowed=np.logical_and.reduce([model.allowed, *(one.allowed for one in asked)]))


def find_conflicts(chains: Sequence[str], model: Model, posed: Problem, asked: Sequence[Constraint]) -> str:
    """What was asked that leaves no path, one line each; nothing where without all of it there is none either.

    Args:
        chains: names [L].
        model: the costs before any restriction.
        posed: the problem that has no path.
        asked: the restrictions in it.
    """
    rules, vias = posed.rules, posed.vias
    names = [*(one.name for one in asked), *(_via(posed, i) for i in range(len(vias)))]

    def possible(kept: Sequence[int]) -> bool:
        constraints_of = [one for i, one in enumerate(asked) if i in kept]
        through = [via for i, via in enumerate(vias, start=len(asked)) if i in kept]
        return feasible(replace(posed, model=restrict(model, constraints_of), vias=through))

    if not possible([]):
        return ""
    every = list(range(len(names)))
    lines = [f"without {name} there is one" for i, name in enumerate(names) if possible([k for k in every if k != i])]
    if not lines:
        guilty = every
        for i in every:
            if not possible(others := [k for k in guilty if k != i]):
                guilty = others
        lines.append(f"{' and '.join(names[i] for i in guilty)} leave{'s' * (len(guilty) == 1)} none")
    for i, (states, wanted) in enumerate(vias):
        if wanted is not None:
            near = range(max(1, wanted - FARTHEST), wanted + FARTHEST)
            nearest = sorted(near, key=lambda move: abs(move - wanted))
            moved = ((move, [*vias[:i], Via(states, move), *vias[i + 1 :]]) for move in nearest)
            helps = (move for move, others in moved if feasible(replace(posed, vias=others)))
            lines += [f"with via {i + 1} at move {move} there is one" for move in islice(helps, 1)]

    held = with_waits(posed.model, posed.goal, rules.wait)
    stops = [posed.start, *(via.states for via in vias), posed.goal]
    for segment in range(len(stops) - 1):
        costs = costs_to_go(held, stops[segment + 1], rules.longest)[1:, held.starts[:-1] + stops[segment]]
        stuck = [joint for chain, joint in enumerate(chains) if not np.isfinite(costs[:, chain]).any()]
        if stuck:
            here, there = ("A", *(_via(posed, i) for i in range(len(vias))), "B")[segment : segment + 2]
            lines.append(f"{', '.join(stuck)}: no way from {here} to {there}")
    number = str(rules.longest) if rules.shortest == rules.longest else f"{rules.shortest} to {rules.longest}"
    return "\n  ".join(
        [f"no path from A to B in {number} move{'s' * (rules.longest != 1)} under what was asked:", *lines]
    )


def _via(posed: Problem, i: int) -> str:
    move = posed.vias[i].move
    return f"via {i + 1}" + ("" if move is None else f" at move {move}")


def _only(space: StateSpace, chain: int, state: int) -> Bools:
    allowed = np.ones(space.starts[-1], dtype=bool)
    allowed[space.starts[chain] : space.starts[chain + 1]] = False
    allowed[space.starts[chain] + state] = True
    return allowed


def _state(space: StateSpace, chain: int, wanted: int | str) -> int:
    """The state that a number or a name stands for."""
    word = str(wanted)
    if word in space.labels[chain]:
        return space.labels[chain].index(word)
    if word.isdecimal():
        space.label(chain, int(word))  # which says what numbers there are
        return int(word)
    named = f": {', '.join(space.labels[chain])}" if space.labels[chain] else "; here none is named"
    raise MotionMindError(
        f"avoid {space.names[chain]}={word}: a state is given by its number, 0 to {space.sizes[chain] - 1}, or by its "
        f"name{named}"
    )
