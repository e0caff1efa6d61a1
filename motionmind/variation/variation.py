"""A variation of a piece: its postures in another order, with smoothed seams, and its review."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Unpack

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from motionmind._cells import html_of
from motionmind._typing import Ints
from motionmind.arguments import as_integers, check_flag, check_function, check_items, check_options, check_type
from motionmind.body.motion import Motion
from motionmind.chaos.flows import FLOWS, Flow
from motionmind.chaos.reorder import Itinerary, itinerary
from motionmind.chaos.trajectories import largest_exponent
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.search.solve import Watch
from motionmind.tween.engine import Engine
from motionmind.tween.request import SeamOptions, SmoothOptions
from motionmind.variation.arguments import check_number, check_numbers, check_whole
from motionmind.variation.controls import Control, control_of
from motionmind.variation.course import Course
from motionmind.variation.departure import find_nudge, share_sought
from motionmind.variation.insertion_times import estimate_insertions
from motionmind.variation.limits import Kept, Limits, Smoothing, check_departure, check_limits, keep_within
from motionmind.variation.orders import By, check_taken
from motionmind.variation.piece import Arrangement, Piece
from motionmind.variation.report import report_of
from motionmind.variation.review import (
    Approve,
    Cut,
    Discard,
    Edit,
    Replace,
    ReviewState,
    Seam,
    Smooth,
    apply_edit,
    initial_state,
)
from motionmind.variation.seams import (
    JudgedTransition,
    OnProgress,
    Transition,
    TransitionTest,
    judge_and_smooth,
)
from motionmind.variation.stretches import cheapest_order

N_SKIPPED_POINTS = 10  # default number of points between two postures
MAX_LENGTH = 1_000_000  # postures of a variation


@dataclass(frozen=True, eq=False)
class Variation:
    """A variation and its review.

    A variation is immutable: an edit returns a new one, or this one if the edit makes no difference.

    Attributes:
        piece: the piece.
        course: its trajectories; None for a control without a trajectory.
        order: the postures of the piece in the order of the trajectories or the control [L].
        transitions: the judged transitions before any edit; none without a corpus.
        edits: the edits, in order.
        kept: the order within limits, which replaces `order`; None without limits.
        control: the control of the order; None for the attractor's own.

    >>> from motionmind import Engine, vary
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> variation = vary(motion, nudge=1.0).cut(2, 4, before=8)
    >>> variation.postures[:10].tolist()
    [0, 1, 5, 6, 7, 2, 3, 4, 8, 9]
    """

    piece: Piece
    course: Course | None
    order: Ints
    transitions: tuple[Transition, ...] = ()
    edits: tuple[Edit, ...] = ()
    kept: Kept | None = None
    control: Control | None = None

    def __post_init__(self) -> None:
        check_type("piece", self.piece, Piece)
        check_type("course", self.course, Course, or_none=True)
        check_items("transitions", self.transitions, "transitions", JudgedTransition)
        check_items("edits", self.edits, "edits", Approve, Discard, Replace, Cut, Smooth)
        check_type("kept", self.kept, Kept, or_none=True)
        check_type("control", self.control, Control, or_none=True)
        if (self.course is not None) != (self.control is None or self.control.needs_trajectory):
            raise MotionMindError(f"a variation by {self.by} has {'no' if self.course else 'a'} course")
        if self.control and (self.control.seed is not None) != self.control.is_random:
            raise MotionMindError(f"a control by {self.by} has {'a' if self.control.is_random else 'no'} seed")
        if self.piece.composed != (self.by == "quadrants"):
            raise MotionMindError("a variation has composed postures if and only if it is by quadrants")
        order = as_integers("order", self.order)
        for one in (order, np.array(self.kept.order if self.kept else order)):
            if one.ndim != 1 or one.shape != order.shape or not len(one) or min(one) < 0 or max(one) >= len(self.piece):
                last = len(self.piece) - 1
                raise MotionMindError(f"a variation's order must name postures of the piece, 0 to {last}")
        order.setflags(write=False)
        object.__setattr__(self, "order", order)
        _ = self._state  # raises if an edit does not fit

    def __repr__(self) -> str:
        piece = displayed(self.piece.motion.name or "a piece without a name")
        counts = f"postures {len(self.postures)}, seams {len(self.seams)}, edits {len(self.edits)}"
        made = ([self.by] if self.control else []) + ([displayed(self.course.flow)] if self.course else [])
        return f"<Variation of {piece} by {' along '.join(made)}: {counts}>"

    def _repr_html_(self) -> str:
        return html_of(self)

    @cached_property
    def _state(self) -> ReviewState:
        state = initial_state(self.piece, self.first_order, self.transitions)
        for edit in self.edits:
            state = apply_edit(state, edit)
        return state

    @property
    def by(self) -> By:
        """Name of its order: "attractor" or its control."""
        return self.control.by if self.control else "attractor"

    @property
    def first_order(self) -> Ints:
        """The postures of the piece before any edit [L]: `kept`, or else `order`."""
        return np.array(self.kept.order) if self.kept else self.order

    @property
    def postures(self) -> Ints:
        """The postures of the piece in their present order [L]."""
        return self._state.postures

    @property
    def seams(self) -> tuple[Seam, ...]:
        """The seams, in the order of the movement."""
        return self._state.seams

    def motion(self) -> Motion:
        """Return the movement with all insertions that are not discarded."""
        return self.arrange().motion

    def arrange(self) -> Arrangement:
        """Return the movement (see `motion`) and the frame of each posture."""
        insertions = {seam.at: seam.insertion.motion for seam in self.seams if seam.insertion}
        return self.piece.arrange(self.postures, insertions)

    def around(self, seam: int, alternative: int | None = None, *, seconds: float = 1.0) -> Motion:
        """Return the movement around a seam.

        Args:
            seam: the seam's number.
            alternative: number, from 1, of the candidate to insert; None for the present one.
            seconds: duration to include before and after.

        Raises:
            MotionMindError: there is no such seam or alternative.

        >>> from motionmind import Engine, vary
        >>> engine = Engine.load("ballet")
        >>> motion = engine.corpus.motion(engine.corpus.clips[0])
        >>> len(vary(motion, nudge=1.0).around(1, seconds=0.6))
        4
        """
        seconds = check_number("seconds", seconds)
        shown = self if alternative is None else self.replace(seam, alternative)
        motion, frames = shown.arrange()
        at = next(one.at for one in shown.seams if one.number == self._state.seam(check_whole("seam", seam)).number)
        begin, end = motion.times[frames[at]] - seconds, motion.times[frames[at + 1]] + seconds
        first = int(np.searchsorted(motion.times, begin - 1e-6))  # seconds
        return motion.slice(first, int(np.searchsorted(motion.times, end + 1e-6)))

    def report(self) -> dict[str, Any]:
        """Return everything but the movement as plain values for JSON: the fields of `VariationReport`."""
        report: dict[str, Any] = msgspec.to_builtins(
            report_of(
                self.piece,
                self.course,
                self.control,
                self.order,
                self.postures,
                self.seams,
                len(self.edits),
                self.kept,
                self.motion().credits,
            )
        )
        return report

    # --- edits ------------------------------------------------------------------------------------------------------

    def approve(self, *seams: int) -> Variation:
        """Approve seams, by number, as they are.

        Raises:
            MotionMindError: a seam does not exist.
        """
        return self._after(Approve(_check_seams(seams)))

    def discard(self, *seams: int) -> Variation:
        """Leave out the insertions at seams, by number.

        Raises:
            MotionMindError: a seam does not exist or has no insertion.
        """
        return self._after(Discard(_check_seams(seams)))

    def replace(self, seam: int, alternative: int) -> Variation:
        """Insert another candidate of a seam, counted from 1; the seam becomes open again.

        Raises:
            MotionMindError: the seam or the alternative does not exist.
        """
        number = check_whole("a seam's number", seam)
        return self._after(Replace(number, check_whole("an alternative's number", alternative)))

    def cut(self, first: int, last: int, before: int) -> Variation:
        """Move postures `first` to `last` before posture `before`.

        Postures count from 0 in their present order; `before` may be their number, for the end. Seams are renumbered
        in their new order.

        Raises:
            MotionMindError: a posture does not exist, or `before` is among the moved ones.
        """
        places = check_whole("first", first), check_whole("last", last), check_whole("before", before)
        return self._after(Cut(*places, numbers="anew"))

    def smooth(
        self,
        engine: Engine,
        *,
        alternatives: int = 3,
        whole_body: bool = False,
        on_progress: OnProgress | None = None,
        watch: Watch | None = None,
        **options: Unpack[SmoothOptions],
    ) -> Variation:
        """Judge the seams without a judgement, and smooth the abrupt ones without an insertion.

        This includes seams with a discarded insertion. A transition that occurs more than once is smoothed again only
        if its insertion is discarded at each occurrence, and keeps its candidates if the engine finds none. Seams with
        new candidates become open.

        Args:
            engine: the corpus that judges and smooths.
            alternatives: number of movements to find for each transition.
            whole_body: whether to judge whole bodies, and insert only whole bodies of the corpus.
            on_progress: called before each search with the numbers of searches done and in all.
            watch: as for `Engine.tween`; once it returns True, the remaining seams stay as they are.
            options: see `vary`, and `seed`.

        Raises:
            SkeletonError: the piece and the corpus have different skeletons.
            MotionMindError: an argument is out of its range.
            WrongTypeError: an argument has the wrong type, or is unknown.
        """
        check_type("engine", engine, Engine)
        _check_watchers(whole_body, on_progress, watch)
        check_whole("alternatives", alternatives, 1)
        check_options("smooth", options, SmoothOptions, self.smooth)
        inserted = {(seam.start, seam.end) for seam in self.seams if seam.insertion}
        known = {(seam.start, seam.end): seam.transition for seam in self.seams}  # once, however often it comes
        left = [pair for pair, one in known.items() if pair not in inserted and (one is None or one.is_abrupt)]
        judged = judge_and_smooth(
            self.piece,
            left,
            engine,
            alternatives,
            whole_body=whole_body,
            on_progress=on_progress,
            watch=watch,
            **options,
        )
        news = tuple(one for one in judged if one.tells_more_than(known[one.start, one.end]))
        return self._after(Smooth(news)) if news else self

    def undo(self) -> Variation:
        """Undo the last edit; MotionMindError if there is none."""
        if not self.edits:
            raise MotionMindError("there is no edit to undo")
        return replace(self, edits=self.edits[:-1])

    def _after(self, edit: Edit) -> Variation:
        after = replace(self, edits=(*self.edits, edit))
        return self if self._state.looks_like(after._state) else after


def _check_watchers(whole_body: bool, on_progress: OnProgress | None, watch: Watch | None) -> None:
    """Check the types of the arguments that `vary` and `Variation.smooth` share."""
    check_flag("whole_body", whole_body)
    check_function("on_progress", on_progress, or_none=True)
    check_function("watch", watch, or_none=True)


def _check_seams(seams: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(check_whole("a seam's number", seam) for seam in seams)


def vary(
    piece: Motion | Piece,
    engine: Engine | None = None,
    *,
    by: By = "attractor",
    seed: int = 0,
    flow: Flow | None = None,
    nudge: float | Sequence[float] | None = None,
    depart: float | None = None,
    start: Sequence[float] | None = None,
    skip: int | None = None,
    step: float | None = None,
    transient: int | None = None,
    length: int | None = None,
    inserted: float | None = None,
    stretch: int | None = None,
    alternatives: int = 3,
    whole_body: bool = False,
    on_progress: OnProgress | None = None,
    watch: Watch | None = None,
    **options: Unpack[SeamOptions],
) -> Variation:
    """Vary a piece: order its postures as a trajectory passes the sites of another, nearby one.

    The method is that of Bradley and Stuart, "Using chaos to generate variations on movement sequences", Chaos 8:800
    (1998); see `motionmind.chaos.reorder`.

    Args:
        piece: the movement; every frame of a motion is a posture, `Piece.of` takes fewer.
        engine: the corpus that finds the abrupt transitions and smooths them; None leaves all as they are.
        by: the order of the postures: the attractor's, or a control (see `motionmind.variation.controls`), which
            refuses some of the other arguments.
        seed: the seed of all random numbers: of a control, and of samples (`sample`).
        flow: the flow whose trajectories order the postures; None for Lorenz'.
        nudge: the offset of the variation's trajectory from the piece's at its beginning: a number for the flow's first
            coordinate, or one for each [d]. None to seek it by `depart`.
        depart: the share of departing steps, in place of a nudge: the smallest nudge of the first coordinate within
            0.05 of it, or else the nearest. None for 0.25, or half of what `stretch` allows if that is less; or, with a
            `start`, for a nudge of 0.1.
        start: the start of the piece's trajectory, before its transient [d]; None for the flow's own.
        skip: points of the trajectories to skip between two postures; None for 10.
        step: the step of the integration, in the flow's units of time; None for the flow's own.
        transient: steps to drop from the beginning; None for the flow's own.
        length: postures of the variation; None for as many as in the piece.
        inserted: the greatest share of the time for insertions. To meet it, seams with long insertions disappear or
            move to where the piece resembles itself more (see `motionmind.variation.limits`); if no order meets it, the
            order that inserts least is taken. None for no limit.
        stretch: the least number of postures in each stretch of the piece; None for 4 if insertions are limited, or 1.
        alternatives: see `Variation.smooth`, as for `whole_body`, `on_progress` and `watch`.
        options: fields of `TweenRequest` and `SearchOptions`, for the tweens that smooth seams.

    Raises:
        MotionMindError: an argument is out of its range or refused by this order, a trajectory diverges or settles,
            `nudge` and `depart` are both given, `inserted` is given without a corpus, or no order has such stretches.
        SkeletonError: the piece and the corpus have different skeletons.
        WrongTypeError: an argument has the wrong type, or is unknown.

    >>> from motionmind import Engine, vary
    >>> from motionmind.chaos import find_flow
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> variation = vary(motion, flow=find_flow("rossler"), nudge=0.5, length=40)
    >>> len(variation.order)
    40
    """
    check_type("piece", piece, Motion, Piece)
    check_type("engine", engine, Engine, or_none=True)
    _check_watchers(whole_body, on_progress, watch)
    check_whole("alternatives", alternatives, 1)
    check_options("vary", options, SeamOptions, vary)
    control = control_of(by, seed)
    trajectory: dict[str, Any] = {"flow": flow, "nudge": nudge, "depart": depart, "start": start}
    trajectory |= {"skip": skip, "step": step, "transient": transient}
    check_taken(by, trajectory | {"length": length, "inserted": inserted, "stretch": stretch})
    piece = piece if isinstance(piece, Piece) else Piece.of(piece)
    length = check_whole("length", len(piece) if length is None else length, 1, MAX_LENGTH)
    limits = check_limits(inserted, stretch, len(piece), length)
    if inserted is not None and engine is None:
        raise MotionMindError("inserted needs a corpus, which makes the insertions")
    found: Itinerary | None = None
    if control is None or control.needs_trajectory:
        course, found = _order_postures(len(piece), length, limits, **trajectory)
        variation = Variation(piece, course, found.indices)
    else:
        piece, order = control.of_piece(piece)
        variation = Variation(piece, None, order, control=control)
    smooth: Smoothing | None = None
    if engine is not None:
        smooth = partial(
            judge_and_smooth,
            piece,
            engine=engine,
            alternatives=alternatives,
            whole_body=whole_body,
            on_progress=on_progress,
            watch=watch,
            seed=seed,
            **options,
        )
    if found is not None and limits is not None:
        seconds = np.zeros((len(piece), len(piece)), dtype=np.float32)
        if engine is not None and limits.inserted is not None:
            seconds = estimate_insertions(piece, TransitionTest(engine, whole_body))
        kept, transitions = keep_within(limits, found, piece.durations, seconds, None if control else smooth)
        variation = replace(variation, kept=kept, transitions=transitions)
        if control is None:
            return variation
    if found is not None and control is not None:
        variation = _in_order_of(control, variation, found)
    pairs = list(dict.fromkeys((seam.start, seam.end) for seam in variation.seams))
    return replace(variation, transitions=smooth(pairs)) if smooth else variation


def _in_order_of(control: Control, variation: Variation, found: Itinerary) -> Variation:
    """Return a variation by an attractor in the order of a control with the same trajectory."""
    kept = variation.kept
    if kept is not None:
        order = control.of_trajectory(found, np.array(kept.order))
        kept = Kept(tuple(order.tolist()), kept.limits)
    return replace(variation, order=control.of_trajectory(found, variation.order), kept=kept, control=control)


def _order_postures(
    count: int,
    length: int,
    limits: Limits | None,
    *,
    flow: Flow | None,
    nudge: float | Sequence[float] | None,
    depart: float | None,
    start: Sequence[float] | None,
    skip: int | None,
    step: float | None,
    transient: int | None,
) -> tuple[Course, Itinerary]:
    """Check the arguments of `vary` for a trajectory; return its course, and the reordering of `count` postures."""
    flow = FLOWS["lorenz"] if flow is None else flow
    check_type("flow", flow, Flow, wanted="a Flow, such as find_flow('lorenz') gives")
    skip = check_whole("skip", N_SKIPPED_POINTS if skip is None else skip, 0, MAX_LENGTH)
    step = check_number("step", flow.step if step is None else step)
    transient = check_whole("transient", flow.transient if transient is None else transient, 0, 1_000_000_000)
    if nudge is not None and depart is not None:
        raise MotionMindError("give nudge or depart, not both")
    check_departure(depart, limits)
    depart = share_sought(nudge, depart, start, limits.stretch if limits else 1)
    start = check_numbers("start", flow.start if start is None else start)

    def reorder(nudge: ArrayLike) -> Itinerary:
        """Return the reordering by a nudge."""
        return itinerary(flow, count, length, nudge=nudge, start=start, every=skip + 1, step=step, transient=transient)

    if nudge is None:
        nudge = 0.1 if depart is None else _seek_nudge(reorder, check_number("depart", depart), limits)
    offset = check_numbers("nudge", nudge)
    if np.ndim(nudge) == 0:
        offset += (0.0,) * (len(flow.start) - 1)
    # With the flow's own step at least: tiny steps do not reach the attractor in so many.
    exponent = largest_exponent(flow, start, steps=200_000, step=max(step, flow.step))
    course = Course(flow.name, dict(flow.parameters), start, offset, skip, step, transient, round(exponent, 4))
    return course, reorder(offset)


def _seek_nudge(reorder: Callable[[float], Itinerary], depart: float, limits: Limits | None) -> float:
    """Return the nudge for a share of departing steps, in stretches within the limits."""
    if limits is None:
        return find_nudge(lambda nudge: reorder(nudge).indices, depart)
    first = reorder(0.0)
    free = np.zeros((len(first.sites), len(first.sites)), dtype=np.float32)
    stretch = limits.stretch
    return find_nudge(lambda nudge: cheapest_order(reorder(nudge), free, 0.0, stretch), depart, every=5)
