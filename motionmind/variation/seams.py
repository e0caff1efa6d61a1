"""Where one posture of a piece follows another that it did not follow there: whether that is abrupt, and the movement
that the engine puts in between.

A transition is abrupt where the corpus does not know it: some joint goes from one state to another as it never does
there (or, posturewise, the whole body does), or turns faster than it ever does there. To stay in a state is no move.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from inspect import signature
from typing import Any

import msgspec
import numpy as np

from motionmind._typing import Floats, Int32s
from motionmind.body.motion import Motion, Posture
from motionmind.errors import NoPathError, SkeletonError, did_you_mean
from motionmind.geometry import rotations as rot
from motionmind.search.solve import Progress, Status, Watch
from motionmind.tween.certificate import Bridge, Wait
from motionmind.tween.engine import Engine
from motionmind.tween.result import Tween, gap_of
from motionmind.variation.arguments import whole
from motionmind.variation.piece import Piece

OnProgress = Callable[[int, int], None]

_ROUNDING = 1.0 + 1e-6  # a corpus's fastest move, made again, is not faster than itself
BODY = "body"  # what a break is named after where whole bodies are judged


@dataclass(frozen=True)
class Break:
    """What makes a transition abrupt: a joint (or "facing", or "body" for all of it) that turns by `degrees` within it.

    Attributes:
        joint: its name.
        degrees: how far it turns; of a body the most that any joint does.
        attested: whether the corpus has it go from the one state to the other.
        fast: whether it turns faster than it ever does in the corpus.
    """

    joint: str
    degrees: float
    attested: bool
    fast: bool


@dataclass(frozen=True, eq=False)
class Candidate:
    """Movement that the engine found from one posture to another, with its certificate (see Tween).

    Attributes:
        motion: the movement, from and to `Piece.ends`.
        path: states of the chains [moves + 1, L].
        status: what is proven of it.
        cost: nats.
        lower_bound: no path costs less, nats.
        attested: share of the joints' moves that the corpus attests.
        bridges: the moves that it does not, but for waits.
        waits: moves that joints spend waiting at their goals.
    """

    motion: Motion
    path: Int32s
    status: Status
    cost: float
    lower_bound: float
    attested: float
    bridges: tuple[Bridge, ...]
    waits: tuple[Wait, ...]

    @classmethod
    def of(cls, tween: Tween) -> Candidate:
        """What is kept of a tween."""
        return cls(
            replace(tween.motion, name=""),
            tween.path,
            tween.status,
            tween.cost,
            tween.lower_bound,
            tween.attested,
            tween.bridges,
            tween.waits,
        )

    @property
    def moves(self) -> int:
        """Number of its moves."""
        return len(self.path) - 1

    @property
    def gap(self) -> float:
        """(cost - lower bound) / cost: 0 is proven optimal."""
        return gap_of(self.cost, self.lower_bound)


@dataclass(frozen=True, eq=False)
class Join:
    """What a corpus says of posture `end` of a piece following on posture `start`.

    Attributes:
        start: the posture that it leads from.
        end: the posture that it leads to.
        corpus: the corpus that was asked.
        breaks: what is abrupt about it; nothing where the corpus knows it.
        candidates: movement that the engine found to go between, the best first.
        failure: why it found none, where it found none.
        asked: what was asked of the engine, as plain values.
    """

    start: int
    end: int
    corpus: str
    breaks: tuple[Break, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    failure: str = ""
    asked: Mapping[str, Any] = field(default_factory=dict)

    @property
    def is_abrupt(self) -> bool:
        """Whether the corpus does not know it."""
        return bool(self.breaks)

    @property
    def is_pending(self) -> bool:
        """Whether it is abrupt and the engine was not asked yet."""
        return self.is_abrupt and not self.candidates and not self.failure

    def tells_more_than(self, other: Join | None) -> bool:
        """Whether there is more in it than in what was known of the same transition, if anything."""
        if other is None or self.candidates or not self.is_abrupt:
            return True
        said = other.corpus, other.breaks, other.failure
        return not other.candidates and not self.is_pending and (self.corpus, self.breaks, self.failure) != said


@dataclass(frozen=True, eq=False)
class TransitionTest:
    """A corpus, asked which transitions are abrupt.

    Attributes:
        engine: what was learned from it.
        posturewise: whether the whole body must have made the move, not each joint.
    """

    engine: Engine
    posturewise: bool = False

    def breaks(self, a: Posture, b: Posture, seconds: float) -> tuple[Break, ...]:
        """What is abrupt about posture `b` following on posture `a` within `seconds`; SkeletonError where they are on
        other joints than the corpus."""
        engine, corpus = self.engine, self.engine.corpus
        for posture in (a, b):
            if (difference := corpus.skeleton.difference(posture.skeleton)) is not None:
                raise SkeletonError(f"the piece is on another skeleton than corpus {corpus.name!r}: {difference}")
        chains = corpus.to_chains(np.stack([a.rotations, b.rotations]))
        before, after = engine.space.assign(chains)
        turned = np.degrees(rot.angle(*chains))
        # Within a state's tolerance orientations are one to the corpus: that is no turn.
        fast = turned > np.maximum(engine.space.tolerances, self._fastest * seconds) * _ROUNDING
        moved = before != after
        graph = engine.grammar.transitions
        known = [not moved[chain] or graph.edge(chain, before[chain], after[chain]) >= 0 for chain in range(len(moved))]
        joints = len(corpus.skeleton)
        found = []
        if self.posturewise:
            attested = not moved[:joints].any() or self._has_made(before[:joints], after[:joints])
            known = [True] * len(known)
            if not attested:
                found.append(Break(BODY, float(turned[:joints].max()), attested=False, fast=False))
        found += [
            Break(name, float(turned[chain]), attested=known[chain], fast=bool(fast[chain]))
            for chain, name in enumerate(corpus.chains)
            if fast[chain] or not known[chain]
        ]
        return tuple(found)

    @cached_property
    def _fastest(self) -> Floats:
        """Degrees a second that each chain turns at most in a move of the corpus [L]."""
        corpus, moves = self.engine.corpus, self.engine.corpus.moves
        if len(moves.begins) == 0:
            return np.zeros(len(corpus.chains))
        chains = corpus.to_chains(np.asarray(corpus.rotations))
        turned = np.degrees(rot.angle(chains[moves.begins], chains[moves.ends]))
        return np.asarray((turned / moves.seconds[:, None]).max(axis=0))

    def _has_made(self, before: Int32s, after: Int32s) -> bool:
        """Whether a body of the corpus went from states [J] to states [J] of its joints."""
        states, moves = self.engine.states[:, : len(before)], self.engine.corpus.moves
        return bool(((states[moves.begins] == before).all(axis=1) & (states[moves.ends] == after).all(axis=1)).any())


def judge(piece: Piece, pairs: Iterable[tuple[int, int]], engine: Engine, posturewise: bool) -> list[Join]:
    """What a corpus says of each posture k of a piece following on a posture i, for pairs (i, k)."""
    court, name = TransitionTest(engine, posturewise), engine.corpus.name
    return [Join(i, k, name, court.breaks(*piece.ends(i, k), float(piece.lasting[i]))) for i, k in pairs]


def check_asked(alternatives: int, asked: Mapping[str, Any]) -> None:
    """Whether seams can be smoothed so, before it shows that any are to be.

    Raises:
        MotionMindError: `alternatives` is out of its range.
        TypeError: `Engine.tween` takes no argument of a name in `asked`.
    """
    whole("alternatives", alternatives, 1)
    known = signature(Engine.tween).parameters.keys() - {"self", "a", "b", "unlike"}
    for name in asked:
        if name not in known:
            raise TypeError(f"seams are not smoothed by an argument {name!r}{did_you_mean(name, known)}")


def smooth(
    piece: Piece,
    joins: Iterable[Join],
    engine: Engine,
    alternatives: int,
    *,
    told: OnProgress | None = None,
    watch: Watch | None = None,
    **asked: Any,
) -> tuple[Join, ...]:
    """Those that are abrupt and pending with what the engine finds to go between, and all others as they are.

    Args:
        piece: the piece.
        joins: what a corpus said of them.
        engine: the corpus that they are smoothed by.
        alternatives: how many ways to find for each; whole-body searches find one.
        told: called before each with how many are done and how many there are.
        watch: as for `Engine.tween`; once it returns True, what is left stays pending.
        asked: the other arguments of `Engine.tween`.
    """
    joins, ended = list(joins), False

    def watching(so_far: Progress) -> bool:
        nonlocal ended
        ended = bool(watch and watch(so_far)) or ended
        return ended

    waiting = [number for number, join in enumerate(joins) if join.is_pending]
    for done, number in enumerate(waiting):
        if told:
            told(done, len(waiting))
        join = joins[number]
        a, b = piece.ends(join.start, join.end)
        found: list[Tween] = []
        try:
            for _ in range(1 if asked.get("posturewise") else alternatives):
                found.append(engine.tween(a, b, **asked, unlike=found, watch=watching if watch else None))
                if ended:
                    break
        except NoPathError as error:
            if not found and not ended:
                joins[number] = replace(join, failure=str(error))
        if found:
            ways: dict[bytes, Tween] = {}
            for tween in found:  # a corpus may know one way only: then the next one is the same
                ways.setdefault(tween.path.tobytes(), tween)
            plain = msgspec.to_builtins(found[0].asked, enc_hook=np.generic.item)
            joins[number] = replace(join, candidates=tuple(map(Candidate.of, ways.values())), asked=plain)
        if ended:
            break
    return tuple(joins)
