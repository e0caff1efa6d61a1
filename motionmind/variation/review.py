"""The review of a variation: its edits and its state.

A variation keeps the list of its edits, which lose nothing: applied in turn to the first order they give its state. To
undo the last edit, drop it from the list.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Generic, Literal, TypeVar

import msgspec
import numpy as np

from motionmind._typing import Ints
from motionmind.errors import MotionMindError, enumerated
from motionmind.variation.piece import Piece
from motionmind.variation.seams import Candidate, Transition

T = TypeVar("T")  # a judged transition, or its form in a file
Decision = Literal["open", "approved", "discarded"]


class Approve(msgspec.Struct, frozen=True, tag_field="edit", tag="approve", forbid_unknown_fields=True):
    """Approve the insertions at these seams; where a seam has no insertion, approve the transition as it is."""

    seams: tuple[int, ...]


class Discard(msgspec.Struct, frozen=True, tag_field="edit", tag="discard", forbid_unknown_fields=True):
    """Leave out the insertions at these seams."""

    seams: tuple[int, ...]


class Replace(msgspec.Struct, frozen=True, tag_field="edit", tag="replace", forbid_unknown_fields=True):
    """Insert another candidate of a seam, counted from 1."""

    seam: int
    alternative: int


class Cut(msgspec.Struct, frozen=True, tag_field="edit", tag="cut", forbid_unknown_fields=True):
    """Move postures `first` to `last` before posture `before`, all as numbered before the edit.

    Seams are then numbered in their new order. In files `numbers` says so; cuts of earlier versions, which kept the old
    numbers, lack it.
    """

    first: int
    last: int
    before: int
    numbers: Literal["anew"]


class Smooth(
    msgspec.Struct, Generic[T], frozen=True, eq=False, tag_field="edit", tag="smooth", forbid_unknown_fields=True
):
    """Judge and smooth transitions without a judgement, or with a discarded insertion; they become open.

    Attributes:
        transitions: the new judgements, with their candidates; variation files call them `joins`.
    """

    transitions: tuple[T, ...] = msgspec.field(name="joins")


Edit = Approve | Discard | Replace | Cut | Smooth[Transition]


@dataclass(frozen=True)
class Verdict:
    """The reviewer's decision on a seam.

    Attributes:
        number: the seam's number, from 1 on in the order of the movement.
        decision: open until approved or discarded; the movement contains all insertions that are not discarded.
        chosen: the number of the chosen candidate, counted from 1.
    """

    number: int
    decision: Decision = "open"
    chosen: int = 1


@dataclass(frozen=True, eq=False)
class Seam:
    """A place in a variation where it neither continues the piece nor stays in its posture.

    Attributes:
        number: the seam's number, from 1 on in the order of the movement.
        at: the posture of the variation before the seam; the seam leads to the next one.
        start: that posture's number in the piece.
        end: the next posture's number in the piece.
        transition: the corpus's judgement of it; None if no corpus has judged it.
        decision: open, approved or discarded.
        chosen: the number of the chosen candidate of the transition, counted from 1.

    >>> from motionmind import Engine, vary
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> seam = vary(motion, nudge=1.0).seams[0]
    >>> seam.number, seam.end - seam.start not in (0, 1)
    (1, True)
    """

    number: int
    at: int
    start: int
    end: int
    transition: Transition | None
    decision: Decision
    chosen: int

    def __repr__(self) -> str:
        judged = f", chosen {self.chosen}\n {self.transition!r}" if self.transition else ", not judged"
        return f"<Seam {self.number} from posture {self.start} to {self.end}: {self.decision}{judged}>"

    @property
    def insertion(self) -> Candidate | None:
        """The engine's movement inserted here; None if it found none, or the reviewer discarded it."""
        if self.transition is None or not self.transition.candidates or self.decision == "discarded":
            return None
        return self.transition.candidates[self.chosen - 1]

    @property
    def is_abrupt(self) -> bool:
        """Whether the transition is abrupt and nothing is inserted to smooth it."""
        return self.transition is not None and self.transition.is_abrupt and self.insertion is None


@dataclass(frozen=True, eq=False)
class ReviewState:
    """A variation as it stands.

    Attributes:
        piece: the piece.
        order: its postures in their first order [L].
        sequence: the entries of `order` in their present order [L].
        transitions: judged transitions, by their two postures of the piece, (from, to).
        verdicts: decisions, by the two entries of `order` that the seam joins or joined.
    """

    piece: Piece
    order: Ints
    sequence: tuple[int, ...]
    transitions: Mapping[tuple[int, int], Transition]
    verdicts: Mapping[tuple[int, int], Verdict]

    @cached_property
    def postures(self) -> Ints:
        """The piece's postures in their present order [L]."""
        return np.asarray(self.order[list(self.sequence)])

    @cached_property
    def seams(self) -> tuple[Seam, ...]:
        """All seams, in the order of the movement."""
        seams = []
        for at, (one, other) in enumerate(pairwise(self.sequence)):
            start, end = int(self.order[one]), int(self.order[other])
            if self.piece.is_seam(start, end):
                verdict = self.verdicts[one, other]
                transition = self.transitions.get((start, end))
                seams.append(Seam(verdict.number, at, start, end, transition, verdict.decision, verdict.chosen))
        return tuple(seams)

    def looks_like(self, other: ReviewState) -> bool:
        """Return whether another state has the same postures, seams and insertions."""
        mine, theirs = (
            [(seam.number, seam.transition, seam.decision, seam.chosen) for seam in state.seams]
            for state in (self, other)
        )
        return np.array_equal(self.postures, other.postures) and mine == theirs

    def seam(self, number: int) -> Seam:
        """Return the seam with a number; MotionMindError lists the existing seams if there is none."""
        for seam in self.seams:
            if seam.number == number:
                return seam
        there = enumerated([str(number) for number in sorted(seam.number for seam in self.seams)], 60)
        raise MotionMindError(f"no seam {number}; there are {there or 'none'}")


def initial_state(piece: Piece, order: Ints, transitions: tuple[Transition, ...]) -> ReviewState:
    """Return the state before any edit.

    Args:
        piece: the piece.
        order: its postures in their first order [L].
        transitions: judged transitions.
    """
    known = {(transition.start, transition.end): transition for transition in transitions}
    return _number_seams(ReviewState(piece, order, tuple(range(len(order))), known, {}))


def apply_edit(state: ReviewState, edit: Edit) -> ReviewState:
    """Return the state after an edit.

    Raises:
        MotionMindError: the edit does not fit the state; the message says why.
    """
    match edit:
        case Approve(seams):
            return _decide(state, seams, "approved")
        case Discard(seams):
            for number in seams:
                _candidates(state, number, "discard")
            return _decide(state, seams, "discarded")
        case Replace(number, alternative):
            count = len(_candidates(state, number, "replace"))
            if not 1 <= alternative <= count:
                raise MotionMindError(f"seam {number} has alternatives 1 to {count}, no alternative {alternative}")
            return _change_verdict(state, number, chosen=alternative, decision="open")
        case Cut():
            return _number_seams(replace(state, sequence=_move_postures(state.sequence, edit)))
        case Smooth(transitions):
            return _judge_anew(state, {(one.start, one.end): one for one in transitions})


def _judge_anew(state: ReviewState, judged: Mapping[tuple[int, int], Transition]) -> ReviewState:
    """Return the state with new judgements; a decision stands unless it was a discard or there is a new result."""
    verdicts = dict(state.verdicts)
    for (one, other), verdict in verdicts.items():
        transition = judged.get((int(state.order[one]), int(state.order[other])))
        if transition and (transition.candidates or verdict.decision == "discarded"):
            verdicts[one, other] = Verdict(verdict.number)
    return replace(state, transitions={**state.transitions, **judged}, verdicts=verdicts)


def _candidates(state: ReviewState, number: int, purpose: str) -> tuple[Candidate, ...]:
    """Return the candidates of a seam; MotionMindError names the `purpose` if there are none."""
    transition = state.seam(number).transition
    if not (transition and transition.candidates):
        raise MotionMindError(f"seam {number} has no insertion to {purpose}")
    return transition.candidates


def _decide(state: ReviewState, seams: tuple[int, ...], decision: Decision) -> ReviewState:
    for number in seams:
        state = _change_verdict(state, number, decision=decision)
    return state


def _change_verdict(state: ReviewState, number: int, **changes: object) -> ReviewState:
    at = state.seam(number).at
    pair = state.sequence[at], state.sequence[at + 1]
    verdict = replace(state.verdicts[pair], **changes)  # type: ignore[arg-type]
    return replace(state, verdicts={**state.verdicts, pair: verdict})


def _move_postures(sequence: tuple[int, ...], cut: Cut) -> tuple[int, ...]:
    """Return the sequence with the cut postures in their new place."""
    count = len(sequence)
    if not 0 <= cut.first <= cut.last < count:
        raise MotionMindError(f"cannot cut {cut.first}..{cut.last}: postures are 0 to {count - 1}, the first one first")
    if not 0 <= cut.before <= count:
        raise MotionMindError(
            f"cannot paste before {cut.before}: postures are 0 to {count - 1}, and {count} is the end"
        )
    if cut.first < cut.before <= cut.last:
        raise MotionMindError(
            f"cannot paste before {cut.before}: it is itself among {cut.first}..{cut.last}, the postures that are cut"
        )
    taken, rest = sequence[cut.first : cut.last + 1], sequence[: cut.first] + sequence[cut.last + 1 :]
    place = cut.before if cut.before <= cut.first else cut.before - len(taken)
    return rest[:place] + taken + rest[place:]


def _number_seams(state: ReviewState) -> ReviewState:
    """Return the state with its seams numbered in their order; a new seam is open."""
    pairs = [pair for pair in pairwise(state.sequence) if state.piece.is_seam(*state.order[list(pair)])]
    numbered = {
        pair: replace(state.verdicts.get(pair, Verdict(number)), number=number)
        for number, pair in enumerate(pairs, start=1)
    }
    return replace(state, verdicts={**state.verdicts, **numbered})
