"""A variation of a piece: its postures in the order of a chaotic trajectory, smoothed by the engine, as reviewed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from motionmind._typing import Ints
from motionmind.body.motion import Motion
from motionmind.chaos.flows import FLOWS, Flow
from motionmind.chaos.reorder import itinerary
from motionmind.chaos.trajectories import largest_exponent
from motionmind.errors import MotionMindError
from motionmind.search.solve import Watch
from motionmind.tween.engine import Engine
from motionmind.variation.arguments import number, numbers, whole
from motionmind.variation.piece import Arranged, Piece
from motionmind.variation.review import (
    Approve,
    Cut,
    Discard,
    Edit,
    Replace,
    Seam,
    Smooth,
    State,
    begun,
    edited,
)
from motionmind.variation.seams import Join, OnProgress, check_asked, judge, smooth

NUDGE = 0.1  # in a flow's own coordinates; ten times as much may begin elsewhere than with the first posture
SKIP = 10
ALTERNATIVES = 3
EXPONENT_STEPS = 200_000
MOST_STEPS = 1_000_000_000  # of a transient, which take some minutes
LONGEST = 1_000_000  # postures that a variation may have


@dataclass(frozen=True)
class Course:
    """The trajectories that a variation was made by.

    Attributes:
        flow: the flow's name.
        parameters: of the flow.
        start: of the piece's trajectory, before its transient [d].
        nudge: how far from there, once the transient is over, the variation's trajectory begins [d], as it was asked.
        skip: points of the trajectories that are left out between two postures.
        step: of the integration.
        transient: steps that are dropped of the piece's trajectory at first.
        exponent: the flow's largest Lyapunov exponent, nats a unit of time, to within some percent.
    """

    flow: str
    parameters: Mapping[str, float]
    start: tuple[float, ...]
    nudge: tuple[float, ...]
    skip: int
    step: float
    transient: int
    exponent: float

    @property
    def parting(self) -> float:
        """Nats by which neighbouring trajectories part, on average, from one posture to the next."""
        return self.exponent * self.step * (self.skip + 1)


@dataclass(frozen=True, eq=False)
class Variation:
    """A variation and its review. Nothing changes it: what edits it returns another one, or itself where the edit
    changes nothing, which is no edit then.

    Attributes:
        piece: what it is a variation of.
        course: the trajectories that it was made by.
        order: the postures of the piece as these gave them [L].
        joins: what a corpus said of the seams; nothing where none was asked.
        edits: what was done to it since, in this order.
    """

    piece: Piece
    course: Course
    order: Ints
    joins: tuple[Join, ...] = ()
    edits: tuple[Edit, ...] = ()

    def __post_init__(self) -> None:
        order = np.array(self.order, dtype=np.int64)
        if order.ndim != 1 or len(order) == 0 or order.min() < 0 or order.max() >= len(self.piece):
            raise MotionMindError(f"a variation's order must name postures of the piece, 0 to {len(self.piece) - 1}")
        order.setflags(write=False)
        object.__setattr__(self, "order", order)
        _ = self._state  # which raises where an edit does not fit

    @cached_property
    def _state(self) -> State:
        state = begun(self.order, self.joins)
        for edit in self.edits:
            state = edited(state, edit)
        return state

    @property
    def postures(self) -> Ints:
        """The postures of the piece in the order in which they are now [L]."""
        return self._state.postures

    @property
    def seams(self) -> tuple[Seam, ...]:
        """Where it neither goes on as the piece does nor stays where it is, in the order in which that comes."""
        return self._state.seams

    def motion(self) -> Motion:
        """The movement as it stands: with all insertions but those that were discarded."""
        return self.arranged().motion

    def arranged(self) -> Arranged:
        """The same, and which of its frames the postures are."""
        found = {seam.at: seam.insertion.motion for seam in self.seams if seam.insertion}
        return self.piece.arranged(self.postures, found)

    def report(self) -> dict[str, Any]:
        """What it is made of, as plain values for JSON: all but the movement."""
        seams, stays = [_plain(seam) for seam in self.seams], np.flatnonzero(np.diff(self.postures) == 0)
        return {
            "piece": {"name": self.piece.motion.name, "postures": len(self.piece), "facing": self.piece.facing},
            "course": {
                **asdict(self.course),
                "start": list(self.course.start),
                "nudge": list(self.course.nudge),
                "parting": self.course.parting,
            },
            "order": self.postures.tolist(),
            "counts": {
                "postures": len(self.postures),
                "seams": len(seams),
                "inserted": sum(seam.insertion is not None for seam in self.seams),
                "attested": sum(seam.join is not None and not seam.join.is_abrupt for seam in self.seams),
                "abrupt": sum(seam.is_abrupt for seam in self.seams),
                "unjudged": sum(seam.join is None for seam in self.seams),
                "stays": len(stays),
                "seconds_still": float(self.piece.lasting[self.postures[stays]].sum()),
            },
            "seams": seams,
            "edits": len(self.edits),
        }

    # --- edits ------------------------------------------------------------------------------------------------------

    def approve(self, *seams: int) -> Variation:
        """These seams are good as they are."""
        return self._after(Approve(_numbers(seams)))

    def discard(self, *seams: int) -> Variation:
        """Without the insertions at these seams; MotionMindError where there is none."""
        return self._after(Discard(_numbers(seams)))

    def replace(self, seam: int, alternative: int) -> Variation:
        """With another of the movements that the engine found for a seam, counted from 1; it is open again."""
        return self._after(Replace(whole("a seam's number", seam), whole("an alternative's number", alternative)))

    def cut(self, first: int, last: int, before: int) -> Variation:
        """With postures `first` to `last` before posture `before` instead, all as they are numbered now, from 0;
        `before` may be the number of postures, which is the end. Seams keep their numbers, new ones get the next."""
        return self._after(Cut(*(whole("a posture's number", posture) for posture in (first, last, before))))

    def smooth(
        self,
        engine: Engine,
        *,
        alternatives: int = ALTERNATIVES,
        posturewise: bool = False,
        told: OnProgress | None = None,
        watch: Watch | None = None,
        **asked: Any,
    ) -> Variation:
        """With the seams judged, and smoothed by the engine, that no corpus was asked about, that were not smoothed, or
        whose insertions are discarded.

        What is found for these is open again. A transition that comes more than once is made anew where all its
        insertions are discarded, and keeps what it had where nothing is found.

        Args:
            engine: the corpus that says which of them are abrupt, and smooths those.
            alternatives: how many movements to find for each.
            posturewise: what is abrupt is told by whole bodies, and only whole bodies of the corpus are inserted.
            told: called before each with how many are done and how many there are.
            watch: as for `Engine.tween`; once it returns True, what is left stays as it is.
            asked: the other arguments of `Engine.tween`.

        Raises:
            SkeletonError: the piece is on another skeleton than the corpus.
            MotionMindError: an argument is out of its range.
            TypeError: there is no such argument.
        """
        check_asked(alternatives, asked)
        stands = {(seam.start, seam.end) for seam in self.seams if seam.insertion}
        known = {(seam.start, seam.end): seam.join for seam in self.seams}  # once however often it comes
        left = [pair for pair, join in known.items() if pair not in stands and (join is None or join.is_abrupt)]
        judged = judge(self.piece, left, engine, posturewise)
        asked = {"posturewise": posturewise, **asked}
        found = smooth(self.piece, judged, engine, alternatives, told=told, watch=watch, **asked)
        news = tuple(join for join in found if join.tells_more_than(known[join.start, join.end]))
        return self._after(Smooth(news)) if news else self

    def undo(self) -> Variation:
        """Without the last edit; MotionMindError where there is none."""
        if not self.edits:
            raise MotionMindError("there is no edit to undo")
        return replace(self, edits=self.edits[:-1])

    def _after(self, edit: Edit) -> Variation:
        after = replace(self, edits=(*self.edits, edit))
        return self if self._state.shows(after._state) else after


def _numbers(seams: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(whole("a seam's number", seam) for seam in seams)


def _plain(seam: Seam) -> dict[str, Any]:
    """A seam as plain values."""
    join = seam.join
    return {
        "number": seam.number,
        "at": seam.at,
        "start": seam.start,
        "end": seam.end,
        "decision": seam.decision,
        "chosen": seam.chosen,
        "corpus": join.corpus if join else None,
        "breaks": [asdict(one) for one in join.breaks] if join else [],
        "failure": join.failure if join else "",
        "candidates": [
            {
                "moves": way.moves,
                "seconds": float(way.motion.times[-1]),
                "status": way.status,
                "cost": way.cost,
                "lower_bound": way.lower_bound,
                "gap": way.gap,
                "attested": way.attested,
                "bridges": [asdict(bridge) for bridge in way.bridges],
                "waits": [asdict(wait) for wait in way.waits],
            }
            for way in (join.candidates if join else ())
        ],
    }


def vary(
    piece: Motion | Piece,
    engine: Engine | None = None,
    *,
    flow: Flow = FLOWS["lorenz"],
    nudge: float | Sequence[float] = NUDGE,
    start: Sequence[float] | None = None,
    skip: int = SKIP,
    step: float | None = None,
    transient: int | None = None,
    length: int | None = None,
    alternatives: int = ALTERNATIVES,
    posturewise: bool = False,
    told: OnProgress | None = None,
    watch: Watch | None = None,
    **asked: Any,
) -> Variation:
    """A variation of a piece: its postures in the order in which a trajectory passes the sites of another one.

    Args:
        piece: the movement; every frame of a motion is a posture, `Piece.of` takes fewer.
        engine: a corpus that says which transitions are abrupt, and smooths those; None leaves them as they are.
        flow: whose trajectories they are.
        nudge: how far the variation's trajectory begins from the piece's, in the flow's first coordinate or in each.
        start: where the piece's trajectory begins, before its transient; the flow's own where None.
        skip: points of the trajectories to leave out between two postures.
        step: of the integration; the flow's own where None.
        transient: steps that are dropped at first; the flow's own where None.
        length: postures of the variation; as many as the piece's where None.
        alternatives: see `Variation.smooth`, as are `posturewise`, `told`, `watch` and what else is `asked`.

    Raises:
        MotionMindError: an argument is out of its range, or a trajectory diverges or settles.
        SkeletonError: the piece is on another skeleton than the corpus.
        TypeError: there is no such argument.
    """
    check_asked(alternatives, asked)
    piece = piece if isinstance(piece, Piece) else Piece.of(piece)
    if not isinstance(flow, Flow):
        raise MotionMindError(f"flow must be a Flow, such as flow_of('lorenz') gives, not {flow!r}")
    skip = whole("skip", skip, 0, LONGEST)
    length = whole("length", len(piece) if length is None else length, 1, LONGEST)
    step = number("step", flow.step if step is None else step)
    transient = whole("transient", flow.transient if transient is None else transient, 0, MOST_STEPS)
    start = numbers("start", flow.start if start is None else start)
    away = numbers("nudge", nudge)
    if np.ndim(nudge) == 0:
        away += (0.0,) * (len(flow.start) - 1)
    found = itinerary(flow, len(piece), length, nudge=away, start=start, every=skip + 1, step=step, transient=transient)
    course = Course(
        flow.name,
        dict(flow.parameters),
        start,
        away,
        skip,
        step,
        transient,
        # With the flow's own step and transient at least: tiny ones do not come to the attractor in so many steps.
        round(largest_exponent(flow, start, steps=EXPONENT_STEPS, step=max(step, flow.step)), 4),
    )
    variation = Variation(piece, course, found.indices)
    if engine is None:
        return variation
    # What it begins with is no edit, and cannot be undone.
    edits = variation.smooth(
        engine, alternatives=alternatives, posturewise=posturewise, told=told, watch=watch, **asked
    ).edits
    return replace(variation, joins=tuple(join for edit in edits if isinstance(edit, Smooth) for join in edit.joins))
