"""Steps between a corpus's moments, found from some of them without a look at the others.

A corpus with N postures and M moves has N + M moments, the postures and then the middles of its moves, and 2 M steps:
those from postures to middles, then those from middles to postures. Moves that lead on in their clips come first, and
then those that lead back; in either the postures that they leave, and those that they lead to, rise.
"""

from __future__ import annotations

import numpy as np

from motionmind._typing import Ints
from motionmind.jit import jit


@jit
def index_of(numbers: Ints, first: int, last: int, wanted: int, beside: int) -> int:
    """Return which of rising numbers, from the first up to the last, is the wanted one; -1 for none.

    One that was found last is mostly near: numbers that rise differ by as much as their places, or more.
    """
    place = place_of(numbers, first, last, wanted, beside)
    return place if place < last and numbers[place] == wanted else -1


@jit
def place_of(numbers: Ints, first: int, last: int, wanted: int, beside: int) -> int:
    """Return the place of the first of rising numbers, from the first up to the last, that is not below the wanted one;
    the last for none. Arguments are those of `index_of`."""
    if first <= beside < last:
        away = wanted - numbers[beside]
        if away > 0:
            first, last = beside + 1, min(last, beside + away)
        else:
            first, last = max(first, beside + away), beside
    while first < last:
        middle = (first + last) // 2
        if numbers[middle] < wanted:
            first = middle + 1
        else:
            last = middle
    return first


@jit
def _backward(begins: Ints, ends: Ints, moves: int) -> int:
    """Return the number of the first move that leads backward in its clip; all those after it do."""
    first, last = 0, moves
    while first < last:
        middle = (first + last) // 2
        if ends[moves + middle] > begins[middle]:
            first = middle + 1
        else:
            last = middle
    return first


@jit
def follow(moments: Ints, ahead: bool, steps: int, begins: Ints, ends: Ints, postures: int) -> Ints:
    """Return moments and those to which so many steps lead from them; or from which they lead there, if not `ahead`."""
    moves = len(begins) // 2
    turns = _backward(begins, ends, moves)
    leaves, arrives = (begins[:moves], ends[moves:]) if ahead else (ends[moves:], begins[:moves])
    out, found = [0][:0], np.zeros(2, np.int64)
    # After k steps there are at most k + 1 postures to be in, and twice as many middles.
    here, on = np.empty((2, 2 * (steps + 2)), np.int64)
    for moment in moments:
        here[0], many = moment, 1
        for _ in range(steps):
            more = 0
            for one in here[:many]:
                if one >= postures:
                    there = arrives[one - postures]
                    if there not in on[:more]:  # where clips are gone both ways, ways there double with each move
                        on[more] = there
                        more += 1
                    continue
                for way, (first, last) in enumerate(((0, turns), (turns, moves))):
                    move = index_of(leaves, first, last, one, found[way])
                    if move >= 0:
                        found[way] = move
                        on[more] = postures + move
                        more += 1
            for one in on[:more]:
                out.append(one)
            here, on, many = on, here, more
    return np.array(out, np.int64)


@jit
def steps_at(moments: Ints, ahead: bool, begins: Ints, ends: Ints, postures: int) -> tuple[Ints, Ints, Ints]:
    """Return the steps that leave moments, or that lead to them if not `ahead`: at which of the moments [m], the moment
    at each one's other end [m], and its number [m]."""
    moves = len(begins) // 2
    turns = _backward(begins, ends, moves)
    at, other, steps = np.empty((3, 2 * len(moments)), np.int64)
    count, found = 0, np.zeros(2, np.int64)
    for k in range(len(moments)):
        one = moments[k]
        if one >= postures:
            step = one - postures + (moves if ahead else 0)
            at[count], other[count], steps[count] = k, ends[step] if ahead else begins[step], step
            count += 1
            continue
        for way, (first, last) in enumerate(((0, turns), (turns, moves))):
            move = index_of(begins[:moves] if ahead else ends[moves:], first, last, one, found[way])
            if move >= 0:
                found[way] = move
                at[count], other[count], steps[count] = k, postures + move, move + (0 if ahead else moves)
                count += 1
    return at[:count], other[:count], steps[:count]
