"""The report of a variation for JSON: everything but the movement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import msgspec
import numpy as np

from motionmind._typing import Ints
from motionmind.corpus.corpus import Facing
from motionmind.credits.credit import Credit
from motionmind.credits.ledger import Ledger, ledger_of
from motionmind.search.solve import Status
from motionmind.tween.certificate import Bridge, Wait
from motionmind.variation.controls import Control
from motionmind.variation.course import Course
from motionmind.variation.departure import departure
from motionmind.variation.limits import Kept, Limits, inserted_share
from motionmind.variation.on_beat import Part
from motionmind.variation.piece import Piece
from motionmind.variation.review import Decision, Seam
from motionmind.variation.seams import AbruptJoint, Candidate


class PieceReport(msgspec.Struct, frozen=True):
    """The piece: its name, its number of postures, and whether it may face anywhere ("free") or not ("stage")."""

    name: str
    postures: int
    facing: Facing


class CourseReport(msgspec.Struct, frozen=True):
    """The trajectories (see `Course`).

    `parting` is their mean divergence from one posture to the next, nats; `departed` is the share of steps that leave
    the piece's order before limits apply.
    """

    flow: str
    parameters: Mapping[str, float]
    start: list[float]
    nudge: list[float]
    skip: int
    step: float
    transient: int
    exponent: float
    parting: float
    departed: float


class CountsReport(msgspec.Struct, frozen=True):
    """The numbers of postures and seams of a variation as it stands.

    Attributes:
        postures: postures.
        seams: seams.
        inserted: seams with an insertion.
        attested: seams whose transition the corpus contains.
        abrupt: seams that are abrupt and not smoothed.
        unjudged: seams that no corpus has judged.
        stays: steps that stay in their posture.
        seconds_still: duration of the stays, seconds.
        departed: share of departing steps.
        mean_chunk, longest_chunk: postures of the chunks.
        inserted_share: share of the time for insertions.
    """

    postures: int
    seams: int
    inserted: int
    attested: int
    abrupt: int
    unjudged: int
    stays: int
    seconds_still: float
    departed: float
    mean_chunk: float
    longest_chunk: int
    inserted_share: float


class OnBeatReport(msgspec.Struct, frozen=True):
    """The parts of a variation on the beat, in order, and what they cost in length.

    `every` is the interval between possible starts, counts; `own_seconds` is the length with each part at its own pace,
    `seconds` on the beat.
    """

    every: int
    own_seconds: float
    seconds: float
    parts: list[Part]


class CandidateReport(msgspec.Struct, frozen=True):
    """A candidate (see `InsertionCandidate`): its length in moves and seconds, its certificate, and its credits."""

    moves: int
    seconds: float
    status: Status
    cost: float
    lower_bound: float
    gap: float
    attested: float
    bridges: list[Bridge]
    waits: list[Wait]
    credits: list[Credit]


class SeamReport(msgspec.Struct, frozen=True):
    """A seam (see `Seam`) with its transition (see `JudgedTransition`), whose corpus is None if none has judged it."""

    number: int
    at: int
    start: int
    end: int
    decision: Decision
    chosen: int
    corpus: str | None
    abrupt_joints: list[AbruptJoint] = msgspec.field(name="breaks")
    failure: str
    candidates: list[CandidateReport]


class VariationReport(msgspec.Struct, frozen=True):
    """The report of a variation as it stands.

    Attributes:
        piece: the piece.
        course: the trajectories; null if it follows none.
        order: the piece's postures in their present order [L].
        counts: numbers of postures and seams.
        seams: the seams.
        edits: number of edits.
        credits: sources of the movement, by share.
        limits: limits of its first order; null for none.
        control: the control of its first order; null for the attractor's own.
        on_beat: its parts, which start on beats; null if they start at any time.
        motion_sha256: hash of the movement's file, written with the report; null if there is none.
    """

    piece: PieceReport
    course: CourseReport | None
    order: list[int]
    counts: CountsReport
    seams: list[SeamReport]
    edits: int
    credits: Ledger
    limits: Limits | None = None
    control: Control | None = None
    on_beat: OnBeatReport | None = None
    motion_sha256: str | None = None


def report_of(
    piece: Piece,
    course: Course | None,
    control: Control | None,
    made: Ints,
    order: Ints,
    seams: Sequence[Seam],
    edits: int,
    kept: Kept | None,
    shares: tuple[Credit, ...],
    on_beat: OnBeatReport | None,
) -> VariationReport:
    """Return the report of a variation.

    Args:
        piece: the piece.
        course: its trajectories, if any.
        control: its control, if any.
        made: the order that the trajectories or the control give, before limits [L].
        order: the present order [L].
        seams: its seams.
        edits: number of its edits.
        kept: its first order within limits, if any.
        shares: its credits.
        on_beat: its parts on the beat, if it has a beat.
    """
    return VariationReport(
        PieceReport(piece.motion.name, len(piece), piece.facing),
        _course_report(course, made) if course else None,
        order.tolist(),
        _counts_report(piece, order, seams),
        list(map(_seam_report, seams)),
        edits,
        ledger_of(shares),
        kept.limits if kept else None,
        control,
        on_beat,
    )


def _course_report(course: Course, made: Ints) -> CourseReport:
    return CourseReport(
        course.flow,
        dict(course.parameters),
        list(course.start),
        list(course.nudge),
        course.skip,
        course.step,
        course.transient,
        course.exponent,
        course.parting,
        departure(made),
    )


def _counts_report(piece: Piece, order: Ints, seams: Sequence[Seam]) -> CountsReport:
    stays = np.flatnonzero(np.diff(order) == 0)
    inserted = np.zeros(len(order) - 1)
    for seam in seams:
        if seam.insertion:
            inserted[seam.at] = seam.insertion.motion.times[-1]
    starts, stops = piece.chunks(order)
    lengths = stops - starts
    return CountsReport(
        postures=len(order),
        seams=len(seams),
        inserted=sum(seam.insertion is not None for seam in seams),
        attested=sum(seam.transition is not None and not seam.transition.is_abrupt for seam in seams),
        abrupt=sum(seam.is_abrupt for seam in seams),
        unjudged=sum(seam.transition is None for seam in seams),
        stays=len(stays),
        seconds_still=float(piece.durations[order[stays]].sum()),
        departed=len(seams) / max(len(order) - 1, 1),
        mean_chunk=float(lengths.mean()),
        longest_chunk=int(lengths.max()),
        inserted_share=inserted_share(inserted, piece.durations[order[:-1]]),
    )


def _seam_report(seam: Seam) -> SeamReport:
    transition = seam.transition
    return SeamReport(
        seam.number,
        seam.at,
        seam.start,
        seam.end,
        seam.decision,
        seam.chosen,
        transition.corpus if transition else None,
        list(transition.abrupt_joints) if transition else [],
        transition.failure if transition else "",
        list(map(_candidate_report, transition.candidates)) if transition else [],
    )


def _candidate_report(candidate: Candidate) -> CandidateReport:
    return CandidateReport(
        candidate.moves,
        float(candidate.motion.times[-1]),
        candidate.status,
        candidate.cost,
        candidate.lower_bound,
        candidate.gap,
        candidate.attested,
        list(candidate.bridges),
        list(candidate.waits),
        list(candidate.motion.credits),
    )
