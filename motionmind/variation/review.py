"""What a reviewer does with a variation: edits, each of which leads from one state of the review to the next.

Nothing is lost by an edit. A variation keeps the list of them, and its state is what they make, one after another, of
the order that the attractor gave; to undo one is to leave out the last.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import msgspec
import numpy as np

from motionmind._typing import Ints
from motionmind.errors import MotionMindError, enumerated
from motionmind.variation.seams import Candidate, Join

Decision = Literal["open", "approved", "discarded"]


class Approve(msgspec.Struct, frozen=True, tag_field="edit", tag="approve", forbid_unknown_fields=True):
    """The insertions at these seams are good; where there is none, the transition is good as it is."""

    seams: tuple[int, ...]


class Discard(msgspec.Struct, frozen=True, tag_field="edit", tag="discard", forbid_unknown_fields=True):
    """The insertions at these seams are left out."""

    seams: tuple[int, ...]


class Replace(msgspec.Struct, frozen=True, tag_field="edit", tag="replace", forbid_unknown_fields=True):
    """At a seam another of the movements that the engine found, counted from 1."""

    seam: int
    alternative: int


class Cut(msgspec.Struct, frozen=True, tag_field="edit", tag="cut", forbid_unknown_fields=True):
    """Postures `first` to `last` are taken out and put before posture `before`, all as numbered until then."""

    first: int
    last: int
    before: int


@dataclass(frozen=True, eq=False)
class Smooth:
    """Seams that had not been judged or smoothed are, or whose insertion had been discarded; nobody has approved what
    stands there now."""

    joins: tuple[Join, ...]


Edit = Approve | Discard | Replace | Cut | Smooth


@dataclass(frozen=True)
class Verdict:
    """What is decided of a seam.

    Attributes:
        number: by which it goes, as long as it is there.
        decision: open until somebody approves or discards it; what is not discarded is in the movement.
        chosen: which of the movements that the engine found, counted from 1.
    """

    number: int
    decision: Decision = "open"
    chosen: int = 1


@dataclass(frozen=True, eq=False)
class Seam:
    """A place in a variation where it neither goes on as the piece does nor stays in its posture.

    Attributes:
        number: by which it goes.
        at: the posture of the variation that it leads from; it leads to the next one.
        start: that posture's number in the piece.
        end: the next one's.
        join: what the corpus says of it; None where none was asked.
        decision: open, approved or discarded.
        chosen: which of the join's candidates, counted from 1.
    """

    number: int
    at: int
    start: int
    end: int
    join: Join | None
    decision: Decision
    chosen: int

    @property
    def insertion(self) -> Candidate | None:
        """The engine's movement that stands here; None where there is none, or it is discarded."""
        if self.join is None or not self.join.candidates or self.decision == "discarded":
            return None
        return self.join.candidates[self.chosen - 1]

    @property
    def is_abrupt(self) -> bool:
        """Whether the transition is abrupt and stays so, for nothing is inserted."""
        return self.join is not None and self.join.is_abrupt and self.insertion is None


@dataclass(frozen=True, eq=False)
class State:
    """A variation as it stands.

    Attributes:
        order: the postures of the piece as the attractor gave them [L].
        sequence: which of these follow one another now [L].
        joins: what the corpus says of transitions, by the postures that they lead from and to.
        verdicts: on transitions between entries of `order` that are or were seams.
    """

    order: Ints
    sequence: tuple[int, ...]
    joins: Mapping[tuple[int, int], Join]
    verdicts: Mapping[tuple[int, int], Verdict]

    @cached_property
    def postures(self) -> Ints:
        """The piece's postures in the order in which they are now [L]."""
        return np.asarray(self.order[list(self.sequence)])

    @cached_property
    def seams(self) -> tuple[Seam, ...]:
        """All seams, in the order in which they come."""
        found = []
        for at, (one, other) in enumerate(pairwise(self.sequence)):
            start, end = int(self.order[one]), int(self.order[other])
            if is_seam(start, end):
                verdict = self.verdicts[one, other]
                join = self.joins.get((start, end))
                found.append(Seam(verdict.number, at, start, end, join, verdict.decision, verdict.chosen))
        return tuple(found)

    def shows(self, other: State) -> bool:
        """Whether another state is the same to whoever looks: its postures, its seams and what stands there."""
        mine, theirs = (
            [(seam.number, seam.join, seam.decision, seam.chosen) for seam in state.seams] for state in (self, other)
        )
        return np.array_equal(self.postures, other.postures) and mine == theirs

    def seam(self, number: int) -> Seam:
        """The seam of that number; MotionMindError names those there are."""
        for seam in self.seams:
            if seam.number == number:
                return seam
        there = enumerated([str(number) for number in sorted(seam.number for seam in self.seams)], 60)
        raise MotionMindError(f"no seam {number}; there are {there or 'none'}")


def begun(order: Ints, joins: tuple[Join, ...]) -> State:
    """The state before any edit."""
    return _numbered(State(order, tuple(range(len(order))), {(join.start, join.end): join for join in joins}, {}))


def edited(state: State, edit: Edit) -> State:
    """The state after an edit; MotionMindError where it does not fit."""
    match edit:
        case Approve(seams):
            return _decided(state, seams, "approved")
        case Discard(seams):
            for number in seams:
                _with_candidates(state, number, "discard")
            return _decided(state, seams, "discarded")
        case Replace(number, alternative):
            ways = len(_with_candidates(state, number, "replace"))
            if not 1 <= alternative <= ways:
                raise MotionMindError(f"seam {number} has alternatives 1 to {ways}, no alternative {alternative}")
            return _ruled(state, number, chosen=alternative, decision="open")
        case Cut():
            return _numbered(replace(state, sequence=_moved(state.sequence, edit)))
        case Smooth(joins):
            return _smoothed(state, {(join.start, join.end): join for join in joins})


def _smoothed(state: State, joins: Mapping[tuple[int, int], Join]) -> State:
    """The state with what is said of transitions now; what was decided stands only where there was and is nothing."""
    verdicts = dict(state.verdicts)
    for (one, other), verdict in verdicts.items():
        join = joins.get((int(state.order[one]), int(state.order[other])))
        if join and (join.candidates or verdict.decision == "discarded"):
            verdicts[one, other] = Verdict(verdict.number)
    return replace(state, joins={**state.joins, **joins}, verdicts=verdicts)


def _with_candidates(state: State, number: int, what: str) -> tuple[Candidate, ...]:
    join = state.seam(number).join
    if not (join and join.candidates):
        raise MotionMindError(f"seam {number} has no insertion to {what}")
    return join.candidates


def _decided(state: State, seams: tuple[int, ...], decision: Decision) -> State:
    for number in seams:
        state = _ruled(state, number, decision=decision)
    return state


def _ruled(state: State, number: int, **changes: object) -> State:
    """The state with a verdict changed."""
    at = state.seam(number).at
    pair = state.sequence[at], state.sequence[at + 1]
    verdict = replace(state.verdicts[pair], **changes)  # type: ignore[arg-type]
    return replace(state, verdicts={**state.verdicts, pair: verdict})


def _moved(sequence: tuple[int, ...], cut: Cut) -> tuple[int, ...]:
    """The sequence with what was cut in another place."""
    count = len(sequence)
    if not 0 <= cut.first <= cut.last < count:
        raise MotionMindError(f"cannot cut {cut.first}..{cut.last}: postures are 0 to {count - 1}, the first one first")
    if not 0 <= cut.before <= count:
        raise MotionMindError(
            f"cannot paste before {cut.before}: postures are 0 to {count - 1}, and {count} is the end"
        )
    if cut.first < cut.before <= cut.last:
        raise MotionMindError(
            f"cannot paste before {cut.before}: it is itself among {cut.first}..{cut.last}, what is cut"
        )
    taken, rest = sequence[cut.first : cut.last + 1], sequence[: cut.first] + sequence[cut.last + 1 :]
    place = cut.before if cut.before <= cut.first else cut.before - len(taken)
    return rest[:place] + taken + rest[place:]


def _numbered(state: State) -> State:
    """The state with a verdict on each seam: new ones are open, and get the next numbers."""
    verdicts = dict(state.verdicts)
    for pair in pairwise(state.sequence):
        if is_seam(*state.order[list(pair)]) and pair not in verdicts:
            verdicts[pair] = Verdict(len(verdicts) + 1)
    return replace(state, verdicts=verdicts)


def is_seam(start: int, end: int) -> bool:
    """Whether posture `end` of a piece following on its posture `start` is another transition than the piece's own."""
    return end not in (start, start + 1)
