"""Transitions at the seams of a variation: which are abrupt, and the movement that the engine inserts to smooth them.

A seam joins two postures that are not successive in the piece. Its transition is abrupt if the corpus lacks it: some
joint (with `whole_body`, the whole body) makes a move between states that the corpus does not contain, or some joint
turns faster than ever in the corpus. Staying in a state is no move.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sized
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Generic, TypeVar, Unpack

import msgspec
import numpy as np

from motionmind._typing import Bools, Floats, Int32s
from motionmind.body.motion import Motion, Posture
from motionmind.display import displayed
from motionmind.errors import NoPathError, SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.search.solve import Progress, Status, Watch
from motionmind.tween.certificate import Bridge, Wait, gap_of
from motionmind.tween.engine import Engine
from motionmind.tween.request import SmoothOptions
from motionmind.tween.result import Tween
from motionmind.variation.piece import Piece

OnProgress = Callable[[int, int], None]  # called with the numbers of searches done and in all
Index = Annotated[int, msgspec.Meta(ge=0, lt=2**31)]  # of a posture or a state
M = TypeVar("M")  # a movement: Motion, or its form in a file
P = TypeVar("P", bound=Sized)  # a path of states: Int32s, or its form in a file
C = TypeVar("C")  # a candidate, in memory or in a file
M2 = TypeVar("M2")  # the same three in the other form
P2 = TypeVar("P2", bound=Sized)
C2 = TypeVar("C2")

BODY = "body"  # stands for the joint where whole bodies are judged


@dataclass(frozen=True)
class AbruptJoint:
    """A joint that makes a transition abrupt; "facing" is one, and "body" stands for all joints together.

    Attributes:
        joint: its name.
        degrees: its turn; for "body", the largest turn of any joint.
        attested: whether the corpus contains its move from the one state to the other.
        fast: whether it turns faster than ever in the corpus.
    """

    joint: str
    degrees: float
    attested: bool
    fast: bool


class InsertionCandidate(msgspec.Struct, Generic[M, P], frozen=True, eq=False, forbid_unknown_fields=True):
    """Movement that the engine found from one posture to another, with its certificate (see Tween).

    Variation files hold the same fields in this order, with the movement and the path in the file's own form.

    Attributes:
        motion: the movement, from and to `Piece.ends`.
        path: states of the chains [moves + 1, L].
        status: the proof: "optimal", "bounded", "interrupted" or "sampled".
        cost: nats.
        lower_bound: no path costs less, nats.
        attested: share of joint-moves that the corpus attests.
        bridges: unattested moves, other than waits.
        waits: moves that joints spend waiting at their goals.
    """

    motion: M
    path: P
    status: Status
    cost: float
    lower_bound: float
    attested: float
    bridges: tuple[Bridge, ...]
    waits: tuple[Wait, ...]

    def __repr__(self) -> str:
        proof = f"{self.status} at {self.cost:.3f} nats, at least {self.lower_bound:.3f}"
        return f"<InsertionCandidate: moves {self.moves}, {proof}, attested {self.attested:.1%}>"

    @property
    def moves(self) -> int:
        """Number of moves T; the path has T + 1 postures."""
        return len(self.path) - 1

    @property
    def gap(self) -> float:
        """(cost - lower bound) / cost: 0 is proven optimal."""
        return gap_of(self.cost, self.lower_bound)

    def with_movement(self, motion: M2, path: P2) -> InsertionCandidate[M2, P2]:
        """Return the candidate with its movement and path in another form."""
        certificate = self.status, self.cost, self.lower_bound, self.attested, self.bridges, self.waits
        return InsertionCandidate(motion, path, *certificate)


Candidate = InsertionCandidate[Motion, Int32s]


class JudgedTransition(msgspec.Struct, Generic[C], frozen=True, eq=False, forbid_unknown_fields=True):
    """A corpus's judgement of the transition from posture `start` of a piece to `end`, and movement to insert there.

    Variation files hold the same fields in this order; `breaks` and `asked` are their names there for two of them.

    Attributes:
        start, end: numbers of the two postures.
        corpus: the name of the corpus.
        abrupt_joints: the joints that make it abrupt; none if the corpus contains the transition.
        candidates: movements found by the engine, the best first.
        failure: why the engine found none; "" if it found some or has not searched.
        options: the options of the search, as plain values.
    """

    start: Index
    end: Index
    corpus: str
    abrupt_joints: tuple[AbruptJoint, ...] = msgspec.field(name="breaks")
    candidates: tuple[C, ...]
    failure: str
    options: Mapping[str, Any] = msgspec.field(name="asked")

    def __repr__(self) -> str:
        found = f"abrupt joints {len(self.abrupt_joints)}, candidates {len(self.candidates)}"
        return f"<JudgedTransition from {self.start} to {self.end} by {displayed(self.corpus)}: {found}>"

    @property
    def is_abrupt(self) -> bool:
        """Whether the corpus lacks this transition."""
        return bool(self.abrupt_joints)

    @property
    def is_pending(self) -> bool:
        """Whether it is abrupt and the engine has not searched for movement yet."""
        return self.is_abrupt and not self.candidates and not self.failure

    def tells_more_than(self, other: JudgedTransition[C] | None) -> bool:
        """Return whether it adds to an earlier judgement of the same transition, or to None."""
        if other is None or self.candidates or not self.is_abrupt:
            return True
        mine, theirs = ((one.corpus, one.abrupt_joints, one.failure) for one in (self, other))
        return not other.candidates and not self.is_pending and mine != theirs

    def with_candidates(self, candidates: tuple[C2, ...]) -> JudgedTransition[C2]:
        """Return the transition with its candidates in another form."""
        judgement = self.start, self.end, self.corpus, self.abrupt_joints
        return JudgedTransition(*judgement, candidates, self.failure, self.options)


Transition = JudgedTransition[Candidate]


@dataclass(frozen=True, eq=False)
class TransitionTest:
    """A test for transitions that a corpus lacks.

    Attributes:
        engine: the corpus.
        whole_body: whether to test moves of the whole body instead of each joint.
    """

    engine: Engine
    whole_body: bool = False

    def abrupt_joints(self, a: Posture, b: Posture, seconds: float) -> tuple[AbruptJoint, ...]:
        """List the joints that make the transition from posture `a` to posture `b` within `seconds` abrupt.

        Raises:
            SkeletonError: a posture is on other joints than the corpus.
        """
        engine, corpus = self.engine, self.engine.corpus
        for posture in (a, b):
            self.check_skeleton(posture)
        chains = corpus.to_chains(np.stack([a.rotations, b.rotations]))
        before, after = engine.space.assign(chains)
        angles = np.degrees(rot.angle(*chains))
        fast = angles > self._largest(seconds)
        joints, found = len(corpus.skeleton), []
        attested = self._attested(before, after)
        if self.whole_body:
            attested[:] = True
            if (before != after)[:joints].any() and not self._has_made(before[:joints], after[:joints]):
                found.append(AbruptJoint(BODY, float(angles[:joints].max()), attested=False, fast=False))
        found += [
            AbruptJoint(name, float(angles[chain]), attested=bool(attested[chain]), fast=bool(fast[chain]))
            for chain, name in enumerate(corpus.chains)
            if fast[chain] or not attested[chain]
        ]
        return tuple(found)

    def known(self, rotations: Floats, durations: Floats) -> Bools:
        """Return which transitions between N postures are not abrupt [from N, to N].

        Args:
            rotations: local rotations of the postures [N, J, 4].
            durations: seconds from each posture to the next one [N].
        """
        chains = self.engine.corpus.to_chains(rotations)
        states = self.engine.space.assign(chains)
        known = self._known_bodies(states) if self.whole_body else self._attested_pairs(states)
        for i, seconds in enumerate(durations):
            known[i] &= (np.degrees(rot.angle(chains[i], chains)) <= self._largest(float(seconds))).all(axis=-1)
        return known

    def check_skeleton(self, posture: Posture) -> None:
        """Raise SkeletonError if a posture is on other joints than the corpus."""
        corpus = self.engine.corpus
        if (difference := corpus.skeleton.difference(posture.skeleton)) is not None:
            raise SkeletonError(f"the piece is on another skeleton than corpus {corpus.name!r}: {difference}")

    def _largest(self, seconds: float) -> Floats:
        """Return the largest turn of each chain within some seconds that is not too fast [L], degrees."""
        # A turn within a state's tolerance is no move; 1e-6 absorbs rounding when the corpus's fastest move recurs.
        return np.asarray(np.maximum(self.engine.space.tolerances, self._fastest * seconds) * (1.0 + 1e-6))

    def _attested_pairs(self, states: Int32s) -> Bools:
        """Return whether the corpus attests all chains' moves between rows of states [N, L]: [from N, to N]."""
        graph = self.engine.grammar.transitions
        attested = np.ones((len(states), len(states)), dtype=np.bool_)
        for chain in range(states.shape[1]):
            used, which = np.unique(states[:, chain], return_inverse=True)
            moves = np.eye(len(used), dtype=np.bool_)
            for row, state in enumerate(used):
                edges = slice(*graph.indptr[graph.starts[chain] + state :][:2])
                moves[row] |= np.isin(used, graph.targets[edges])
            attested &= moves[np.ix_(which, which)]
        return attested

    def _known_bodies(self, states: Int32s) -> Bools:
        """Return whether a whole body in the corpus moved between rows of states [N, L], or stayed: [from N, to N]."""
        moves, joints, count = self.engine.corpus.moves, len(self.engine.corpus.skeleton), len(states)
        rows = np.concatenate([states, self.engine.states])[:, :joints]
        _, which = np.unique(rows, axis=0, return_inverse=True)
        own, mine = np.unique(which[:count], return_inverse=True)
        made = np.eye(len(own), dtype=np.bool_)
        begins, ends = which[count:][moves.begins], which[count:][moves.ends]
        both = np.isin(begins, own) & np.isin(ends, own)
        made[np.searchsorted(own, begins[both]), np.searchsorted(own, ends[both])] = True
        return np.asarray(made[np.ix_(mine, mine)])

    @cached_property
    def _fastest(self) -> Floats:
        """Largest speed of each chain in a move of the corpus [L], degrees a second."""
        corpus, moves = self.engine.corpus, self.engine.corpus.moves
        if len(moves) == 0:
            return np.zeros(len(corpus.chains))
        chains = corpus.to_chains(np.asarray(corpus.rotations))
        angles = np.degrees(rot.angle(chains[moves.begins], chains[moves.ends]))
        return np.asarray((angles / moves.seconds[:, None]).max(axis=0))

    def _attested(self, before: Int32s, after: Int32s) -> Bools:
        """Return whether the corpus attests each chain's move between states [L], or the chain stays [L]."""
        graph = self.engine.grammar.transitions
        pairs = enumerate(zip(before, after, strict=True))
        return np.array([state == target or graph.edge(chain, state, target) >= 0 for chain, (state, target) in pairs])

    def _has_made(self, before: Int32s, after: Int32s) -> bool:
        """Return whether a whole body in the corpus moved between joint states [J]."""
        states, moves = self.engine.states[:, : len(before)], self.engine.corpus.moves
        return bool(((states[moves.begins] == before).all(axis=1) & (states[moves.ends] == after).all(axis=1)).any())


def judge_transitions(
    piece: Piece, pairs: Iterable[tuple[int, int]], engine: Engine, whole_body: bool
) -> list[Transition]:
    """Judge the transitions between pairs of a piece's postures.

    Args:
        piece: the piece.
        pairs: numbers of two postures each, (from, to).
        engine: the corpus that judges.
        whole_body: whether to judge moves of the whole body instead of each joint.

    Raises:
        SkeletonError: the piece is on another skeleton than the corpus.
    """
    test, name = TransitionTest(engine, whole_body), engine.corpus.name
    return [
        Transition(i, k, name, test.abrupt_joints(*piece.ends(i, k), float(piece.durations[i])), (), "", {})
        for i, k in pairs
    ]


def judge_and_smooth(
    piece: Piece,
    pairs: Iterable[tuple[int, int]],
    engine: Engine,
    alternatives: int,
    *,
    whole_body: bool = False,
    on_progress: OnProgress | None = None,
    watch: Watch | None = None,
    **options: Unpack[SmoothOptions],
) -> tuple[Transition, ...]:
    """Judge the transitions between pairs of a piece's postures, and find movement for the abrupt ones.

    The movement begins and ends with the piece's velocity there, if the piece shows one (`Piece.around`).

    Args:
        piece: the piece.
        pairs: numbers of two postures each, (from, to).
        engine: the corpus.
        alternatives: number of movements to find for each; a search of whole bodies finds one.
        whole_body: whether to judge and insert whole bodies.
        on_progress: called before each search with the numbers of searches done and in all.
        watch: as for `Engine.tween`; once it returns True, the remaining transitions stay pending.
        options: see `Variation.smooth`.

    Raises:
        SkeletonError: the piece is on another skeleton than the corpus.
        MotionMindError: an option is out of its range.
    """
    transitions = judge_transitions(piece, pairs, engine, whole_body)
    ended = False

    def watching(so_far: Progress) -> bool:
        nonlocal ended
        ended = bool(watch and watch(so_far)) or ended
        return ended

    pending = [number for number, transition in enumerate(transitions) if transition.is_pending]
    for done, number in enumerate(pending):
        if on_progress:
            on_progress(done, len(pending))
        transition = transitions[number]
        a, b = piece.ends(transition.start, transition.end)
        before, after = piece.around(transition.start, transition.end)
        found = engine.alternatives(
            a,
            b,
            1 if whole_body else alternatives,
            before=before,
            after=after,
            watch=watching if watch else None,
            whole_body=whole_body,
            **options,
        )
        tweens: list[Tween] = []
        try:
            for tween in found:
                tweens.append(tween)
                if ended:
                    break
        except NoPathError as error:
            if not tweens and not ended:
                transitions[number] = msgspec.structs.replace(transition, failure=str(error))
        if tweens:
            transitions[number] = _with_candidates(transition, tweens)
        if ended:
            break
    return tuple(transitions)


def _with_candidates(transition: Transition, tweens: Iterable[Tween]) -> Transition:
    """Return the transition with the tweens as its candidates, without repeated paths."""
    distinct: dict[bytes, Tween] = {}
    for tween in tweens:
        distinct.setdefault(tween.path.tobytes(), tween)
    first = next(iter(distinct.values()))
    return msgspec.structs.replace(
        transition,
        candidates=tuple(map(candidate_of, distinct.values())),
        options=msgspec.to_builtins(first.asked, enc_hook=np.generic.item),
    )


def candidate_of(tween: Tween) -> Candidate:
    """Return the part of a tween that a variation keeps."""
    return Candidate(
        replace(tween.motion, name=""),
        tween.path,
        tween.status,
        tween.cost,
        tween.lower_bound,
        tween.attested,
        tween.bridges,
        tween.waits,
    )
