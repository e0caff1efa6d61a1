"""Constraints on a path: pinned joints, held joints and states to avoid, and the conflicts among them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Ints
from motionmind.discretize.states import StateSpace
from motionmind.errors import MotionMindError, NoPathError
from motionmind.search.problem import Model, Problem, Via, costs_to_go
from motionmind.search.solve import feasible


class Constraint(NamedTuple):
    """A named constraint, such as "pin left_wrist=B", and whether it allows each state between A and B [G]."""

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
    """Return the constraints on the joints' states after posture A and before posture B.

    Args:
        space: the states of each joint.
        start: A's states [L].
        goal: B's states [L].
        pin: joints that keep A's state until the last move ("A"), or have B's from the first move on ("B").
        hold: joints that keep the state that A and B share.
        avoid: joints, each with a state to avoid, by number or name.

    Raises:
        MotionMindError: no such joint or state.
        NoPathError: A and B differ at a joint to hold.
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
            raise NoPathError(f"hold {joint}: A and B have different states there, {a} and {b}")
        out.append(Constraint(f"hold {joint}", _only(space, chain, int(start[chain]))))
    for joint, wanted in avoid:
        chain = space.index(joint)
        allowed = np.ones(space.starts[-1], dtype=bool)
        allowed[space.starts[chain] + _state(space, chain, wanted)] = False
        out.append(Constraint(f"avoid {joint}={wanted}", allowed))
    return out


def restrict(model: Model, constraints: Sequence[Constraint]) -> Model:
    """Return the model restricted to the states that all constraints allow."""
    return model._replace(allowed=np.logical_and.reduce([model.allowed, *(one.allowed for one in constraints)]))


def find_conflicts(chains: Sequence[str], model: Model, problem: Problem, constraints: Sequence[Constraint]) -> str:
    """Find the constraints and vias that leave a problem without a path.

    Args:
        chains: names of the joint chains [L].
        model: the costs before any constraint.
        problem: the problem that has no path.
        constraints: the constraints in it.

    Returns:
        A message with one line for each conflict and remedy; empty if no path exists without the constraints either.
    """
    vias, rules = problem.vias, problem.rules
    names = [*(one.name for one in constraints), *(_via_name(problem, i) for i in range(len(vias)))]

    def possible(kept: Sequence[int]) -> bool:
        some = [one for i, one in enumerate(constraints) if i in kept]
        through = tuple(via for i, via in enumerate(vias, start=len(constraints)) if i in kept)
        return feasible(replace(problem, model=restrict(model, some), vias=through))

    if not possible([]):
        return ""
    every = list(range(len(names)))
    lines = [f"without {name} there is one" for i, name in enumerate(names) if possible([k for k in every if k != i])]
    if not lines:
        lines += [
            f"{' and '.join(names[i] for i in guilty)} leave{'s' * (len(guilty) == 1)} none"
            for guilty in _minimal_conflicts(every, possible)
        ]
    lines += [f"with via {i + 1} after move {move} there is one" for i, move in _feasible_moves(problem)]
    lines += _blocked_segments(chains, problem)
    number = str(rules.longest) if rules.shortest == rules.longest else f"{rules.shortest} to {rules.longest}"
    first = f"no path from A to B in {number} move{'s' * (rules.longest != 1)} under these constraints:"
    return "\n  ".join([first, *lines])


def _minimal_conflicts(every: list[int], possible: Callable[[Sequence[int]], bool]) -> list[list[int]]:
    """Find up to 4 minimal sets of constraints that exclude every path.

    To find the next set, drop one constraint of each set found so far.

    Args:
        every: numbers of all constraints, which together exclude every path.
        possible: return whether a path satisfies some of the constraints.
    """
    found: list[list[int]] = []
    tried = [every]
    for left in tried:
        guilty = next((one for one in found if set(one) <= set(left)), None)
        if guilty is None:
            if possible(left):
                continue
            guilty = left
            for i in left:
                if not possible(others := [k for k in guilty if k != i]):
                    guilty = others
            found.append(guilty)
        if len(found) == 4 or len(tried) > 50:  # enough to read, and to examine
            break
        shorter = ([k for k in left if k != i] for i in guilty)
        tried += [one for one in shorter if one not in tried]
    return found


def _feasible_moves(problem: Problem) -> Iterator[tuple[int, int]]:
    """Yield the index of each via that a path could pass at another move, with the nearest such move."""
    for i, (states, wanted) in enumerate(problem.vias):
        if wanted is None:
            continue
        near = range(max(1, wanted - 60), wanted + 60)
        for move in sorted(near, key=lambda move: abs(move - wanted)):
            moved = (*problem.vias[:i], Via(states, move), *problem.vias[i + 1 :])
            if feasible(replace(problem, vias=moved)):
                yield i, move
                break


def _blocked_segments(chains: Sequence[str], problem: Problem) -> Iterator[str]:
    """Yield a line for each segment between A, the vias and B that some joints cannot cross in any number of moves."""
    held = problem.model_with_waits()
    stops = problem.stops
    stop_names = ["A", *(_via_name(problem, i) for i in range(len(problem.vias))), "B"]
    for segment in range(len(stops) - 1):
        longest = problem.rules.longest
        costs = costs_to_go(held, stops[segment + 1], longest)[1:, held.starts[:-1] + stops[segment]]
        stuck = [joint for chain, joint in enumerate(chains) if not np.isfinite(costs[:, chain]).any()]
        if stuck:
            yield f"{', '.join(stuck)}: no path from {stop_names[segment]} to {stop_names[segment + 1]}"


def _via_name(problem: Problem, i: int) -> str:
    move = problem.vias[i].move
    return f"via {i + 1}" + ("" if move is None else f" after move {move}")


def _only(space: StateSpace, chain: int, state: int) -> Bools:
    allowed = np.ones(space.starts[-1], dtype=bool)
    allowed[space.starts[chain] : space.starts[chain + 1]] = False
    allowed[space.starts[chain] + state] = True
    return allowed


def _state(space: StateSpace, chain: int, wanted: int | str) -> int:
    """Return the state with a number or name."""
    word = str(wanted)
    if word in space.labels[chain]:
        return space.labels[chain].index(word)
    if word.isdecimal() and len(word) < 10:
        space.label(chain, int(word))  # raises an error that states the valid numbers
        return int(word)
    named = f": {', '.join(space.labels[chain])}" if space.labels[chain] else "; here none is named"
    raise MotionMindError(
        f"avoid {space.names[chain]}={word}: a state is given by its number, 0 to {space.sizes[chain] - 1}, or by its "
        f"name{named}"
    )
