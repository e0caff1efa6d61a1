"""A variation of a piece: its postures in another order, with smoothed seams, and its review."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Unpack

import msgspec
import numpy as np

from motionmind._cells import html_of
from motionmind._typing import Ints
from motionmind.arguments import as_integers, check_flag, check_function, check_items, check_options, check_type
from motionmind.body.motion import Motion
from motionmind.body.stage import check_stage
from motionmind.chaos.flows import Flow
from motionmind.chaos.reorder import Itinerary
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.music.beats import Beats
from motionmind.search.solve import Watch
from motionmind.tween.engine import Engine
from motionmind.tween.request import SeamOptions, SmoothOptions
from motionmind.variation.arguments import check_number, check_whole
from motionmind.variation.controls import Control, control_of
from motionmind.variation.course import Course
from motionmind.variation.insertion_times import estimate_insertions
from motionmind.variation.limits import (
    MAX_LIMITED_POSTURES,
    Kept,
    Smoothing,
    check_limits,
    estimate_order,
    keep_within,
)
from motionmind.variation.nudge import MAX_LENGTH, find_course
from motionmind.variation.on_beat import OnBeat, check_on_beat, find_on_beat, least_stretch, retime
from motionmind.variation.orders import DEFAULT_INSERTED_SHARE, By, check_taken
from motionmind.variation.piece import Arrangement, Piece
from motionmind.variation.report import OnBeatReport, report_of
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
from motionmind.variation.staging import put_on_stage


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
        on_beat: the beats on which its stretches and insertions start; None for any time.

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
    on_beat: OnBeat | None = None

    def __post_init__(self) -> None:
        check_type("piece", self.piece, Piece)
        check_type("course", self.course, Course, or_none=True)
        check_items("transitions", self.transitions, "transitions", JudgedTransition)
        check_items("edits", self.edits, "edits", Approve, Discard, Replace, Cut, Smooth)
        check_type("kept", self.kept, Kept, or_none=True)
        check_type("control", self.control, Control, or_none=True)
        check_type("on_beat", self.on_beat, OnBeat, or_none=True)
        if self.on_beat is not None:
            check_on_beat(self.on_beat)
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
        return self._arrange()[0]

    def _arrange(self) -> tuple[Arrangement, OnBeatReport | None]:
        insertions = {seam.at: seam.insertion.motion for seam in self.seams if seam.insertion}
        arranged = self.piece.arrange(self.postures, insertions)
        if self.on_beat is None:
            return arranged, None
        retimed, parts = retime(arranged, self.seams, self.on_beat)
        own, now = (float(one.motion.times[-1] - one.motion.times[0]) for one in (arranged, retimed))
        return retimed, OnBeatReport(self.on_beat.every, own, now, parts)

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
        (motion, _), on_beat = self._arrange()
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
                motion.credits,
                on_beat,
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
    beats: Beats | None = None,
    on_beat: int | None = None,
    stage: tuple[float, float] | None = None,
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
            0.05 of it, or half a step, or else the nearest. None for 0.25, or half of what `stretch` allows if that is
            less.
        start: the start of the piece's trajectory, before its transient [d]; None for the flow's own.
        skip: points of the trajectories to skip between two postures; None for 10.
        step: the step of the integration, in the flow's units of time; None for the flow's own.
        transient: steps to drop from the beginning; None for the flow's own.
        length: postures of the variation; None for as many as in the piece.
        inserted: the greatest share of the time for insertions. To meet it, seams with long insertions disappear or
            move to where the piece resembles itself more (see `motionmind.variation.limits`); if no order meets it, the
            order that inserts least is taken. 1 is no limit. None for 0.3 with an engine, unless `nudge` or `depart` is
            given or there are more than 4,000 postures; this default gives way where all else is the piece itself.
        stretch: the least number of postures in each stretch of the piece; None for 4 if insertions are limited (for a
            fifth of the postures if they are fewer than 20), or 1; with `on_beat`, as many as fill its interval.
        beats: the beats of its music; count 1 comes with the first frame.
        on_beat: the counts from one beat to the next on which a stretch or an insertion may start; all do, played
            faster or slower (see `motionmind.variation.on_beat`). None to leave their times as they are.
        stage: width and depth of the stage around the origin, metres: the variation is turned and moved to stay on it,
            as a whole, or else insertions travel between runs that fit; None leaves it where it goes. See
            `motionmind.plots.find_overstep` for what is left.
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
    at_beats = find_on_beat(beats, on_beat)
    if at_beats and stretch is None and (control is None or control.needs_trajectory):
        stretch = max(least_stretch(at_beats, piece), 4 if len(piece) >= 20 else 1)
    stage = None if stage is None else check_stage(stage)
    length = check_whole("length", len(piece) if length is None else length, 1, MAX_LENGTH)
    is_default = engine is not None and control is None and inserted is nudge is depart is None
    is_default &= max(len(piece), length) <= MAX_LIMITED_POSTURES
    if is_default:
        inserted = DEFAULT_INSERTED_SHARE
    limits = check_limits(inserted, stretch, len(piece), length)
    if inserted is not None and engine is None:
        raise MotionMindError("inserted needs a corpus, which makes the insertions")
    seconds = np.zeros((len(piece), len(piece)) if limits else (0, 0), dtype=np.float32)
    if engine is not None and limits is not None and limits.inserted is not None:
        seconds = estimate_insertions(piece, TransitionTest(engine, whole_body))
    found: Itinerary | None = None
    if control is None or control.needs_trajectory:
        within = None
        if is_default and limits is not None:
            within = partial(estimate_order, limits, durations=piece.durations, seconds=seconds)
        course, found = find_course(len(piece), length, limits, within, **trajectory)
        variation = Variation(piece, course, found.indices, on_beat=at_beats)
    else:
        piece, order = control.of_piece(piece)
        variation = Variation(piece, None, order, control=control, on_beat=at_beats)
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
        kept, transitions = keep_within(
            limits, found, piece.durations, seconds, None if control else smooth, leaves=is_default
        )
        variation = replace(variation, kept=kept, transitions=transitions)
    if found is not None and control is not None:
        variation = _in_order_of(control, variation, found)
    if smooth and not (control is None and variation.kept):
        pairs = list(dict.fromkeys((seam.start, seam.end) for seam in variation.seams))
        variation = replace(variation, transitions=smooth(pairs))
    if stage is None:
        return variation
    return _on_stage(variation, stage, engine, watch, {"whole_body": whole_body, "seed": seed, **options})


def _on_stage(
    variation: Variation,
    stage: tuple[float, float],
    engine: Engine | None,
    watch: Watch | None,
    options: dict[str, Any],
) -> Variation:
    """Return a variation turned and moved so that it stays on the stage, as far as it can."""
    staged = put_on_stage(variation.piece, variation.arrange(), variation.seams, stage, engine, watch, **options)
    news = {(one.start, one.end): one for one in staged.transitions}
    judged = tuple(news.get((one.start, one.end), one) for one in variation.transitions)
    return replace(variation, piece=staged.piece, transitions=judged, edits=(*variation.edits, *staged.edits))


def _in_order_of(control: Control, variation: Variation, found: Itinerary) -> Variation:
    """Return a variation by an attractor in the order of a control with the same trajectory."""
    kept = variation.kept
    if kept is not None:
        order = control.of_trajectory(found, np.array(kept.order))
        kept = Kept(tuple(order.tolist()), kept.limits)
    return replace(variation, order=control.of_trajectory(found, variation.order), kept=kept, control=control)
