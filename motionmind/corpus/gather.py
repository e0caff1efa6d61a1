"""Gathers recordings and other corpora into a corpus: repairs them, resamples them, mirrors them."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain, count, pairwise
from numbers import Real
from typing import Literal, NamedTuple, TypedDict, get_args

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Ints
from motionmind.arguments import (
    check_flag,
    check_integer,
    check_items,
    check_mapping,
    check_real,
    check_text,
    check_type,
)
from motionmind.body.mirror import find_sides, mirrored
from motionmind.body.motion import Motion
from motionmind.body.rates import FILM_RATE
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.corpus import MAX_PRICE, Clip, Corpus, Facing, JointFlip, JointRepair, subdivide_times
from motionmind.corpus.flips import FLIP_DEGREES, find_flips, repair_flips
from motionmind.corpus.origins import gather_origins, warn_of_licences
from motionmind.errors import CorpusError, MotionMindWarning, SkeletonError, enumerated
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import rotation_spline

Flips = Literal["drop", "keep", "repair"]
Rate = float | Literal["auto"] | None

# Postures a second of a recording, unless another rate is given: [O10]'s choice for motion capture.
RECORDED_RATE = 5.0
LIGHTEST, HEAVIEST = 1e-6, 1e6  # weights of a corpus that is mixed in
DETAIL_RATE = 30.0  # per second: the rate at which detail between postures is kept
FAULT_DEGREES = 30.0  # a joint that departs by more between two postures was recorded badly
_COARSE = 20.0  # frames per second; a slower recording has no detail to keep

_log = logging.getLogger(__name__)


class Gathering(TypedDict, total=False):
    """Options of `gather`, for functions that pass them on."""

    rate: Rate
    skip: int
    facing: Facing
    flips: Flips
    flip_degrees: float
    mirror: bool
    reverse: float | None
    about: Mapping[str, str] | None
    title: str
    author: str
    source: str
    licence: str
    citation: str
    performer: str | Mapping[str, str]


def gather(
    name: str,
    motions: Iterable[Motion],
    *,
    rate: Rate = "auto",
    skip: int = 0,
    facing: Facing = "free",
    flips: Flips = "repair",
    flip_degrees: float = FLIP_DEGREES,
    mirror: bool = False,
    reverse: float | None = None,
    mix: Sequence[tuple[Corpus, float]] = (),
    about: Mapping[str, str] | None = None,
    title: str = "",
    author: str = "",
    source: str = "",
    licence: str = "",
    citation: str = "",
    performer: str | Mapping[str, str] = "",
) -> Corpus:
    """Gather `motions`, and the corpora to `mix` with them, into a corpus; all are on the same joints.

    Args:
        name: the corpus's name.
        motions: the recordings, named; repeated names are numbered.
        rate: postures per second; None keeps every frame with its own time. "auto" takes 5 postures a second of a
            recording, which a log entry says (logger "motionmind.corpus.gather", level INFO), and every frame of
            keyframes: of a motion that says so, and of one with fewer than 15 frames a second.
        skip: frames to drop at each recording's start, such as an added T-pose.
        facing: "free" removes the turn about the vertical from the root's state and makes it a joint chain of its own;
            "stage" leaves it there, and facing the wall is then another state than facing the audience.
        flips: treatment of a recording with flips (`find_flips`): `repair` mends them (`repair_flips`), and cuts the
            recording where it cannot, so no flip is learned; `keep` takes it unchanged, `drop` leaves it out.
        flip_degrees: the turn in one frame that counts as a flip.
        mirror: whether to learn from the mirror images of all clips, too.
        reverse: the price, in nats per move, of learning from all clips backwards, too: there each move counts
            exp(-price). None keeps the prices of corpora mixed in, and adds no others.
        mix: other corpora, each with the count of its postures and moves relative to those of `motions`, which have 1.
            Only ratios matter: the largest becomes 1. Their clips are taken unchanged, or resampled at `rate`; `skip`
            and `flips` apply to the recordings only.
        about: one-line descriptions of clips, by name.
        title: a one-line description of the corpus.
        author: who made it.
        source: where it comes from.
        licence: the licence for its use.
        citation: how to cite it.
        performer: who performs the recordings: one for all, or each by the recording's name. Where it is not known, the
            author is credited.

    Returns:
        The corpus.

    Warns:
        MotionMindWarning: recordings contradict their clocks (`question_tempo`), or the licences of the corpora stand
            against passing on what is made of them together (`motionmind.credits.licences`).

    Raises:
        CorpusError: nothing is left to learn from, recordings or corpora differ in their joints or cannot be brought to
            one rate, or an option is out of range.
        SkeletonError: the body cannot be mirrored.
    """
    check_text("name", name)
    check_type("rate", rate, str, Real, wanted='"auto", None, or a number', or_none=True)
    check_text("facing", facing)
    check_flag("mirror", mirror)
    check_mapping("about", about, or_none=True)
    texts = {"title": title, "author": author, "source": source, "licence": licence, "citation": citation}
    for key, value in texts.items():
        check_text(key, value)
    if not isinstance(performer, str):
        check_mapping("performer", performer)
    check_items("clips", motions, "motions")
    _check_options(skip, flips, flip_degrees, reverse)
    given = None if rate == "auto" else rate
    _check_mix(name, mix, given)
    own = _take_recordings(motions, rate, skip, flips, flip_degrees, performer)
    body = own.body
    if body is None and not mix:
        raise CorpusError(f"corpus {name!r}: no recordings given")
    if rate == "auto" and own.rate is not None:
        _log.info(
            "corpus %s: %g postures a second of each recording (--rate, or rate=, for more or fewer)", name, own.rate
        )
    pieces = [
        piece._replace(clip=replace(piece.clip, about=(about or {}).get(piece.clip.name, ""))) for piece in own.pieces
    ]
    for other, weight in mix:
        body = body or other.skeleton
        difference = body.difference(other.skeleton)
        if difference is not None:
            raise CorpusError(f"corpus {other.name!r} is on another skeleton than {body.name}: {difference}")
        pieces += _take_clips(other, weight, given)
    if not pieces or body is None:
        raise CorpusError(f"corpus {name!r}: every recording has faults, and without them nothing is left")
    common = _common_rate(own, mix) if given is None else given
    if mirror:
        pieces += _mirror_images(pieces)
    between = _frames_between(common)
    corpus = Corpus(
        name,
        body,
        _lay_out_clips(name, pieces, common, reverse),
        np.concatenate([piece.postures.rotations for piece in pieces]),
        np.concatenate([piece.postures.root for piece in pieces]),
        np.concatenate([piece.postures.times for piece in pieces]),
        np.concatenate([_detail(piece.postures, piece.recording, between) for piece in pieces]),
        facing,
        common,
        title,
        author,
        source,
        licence,
        own.faults,
        skip,
        gather_origins(other for other, _ in mix),
        citation,
    )
    if mix:
        warn_of_licences(corpus)
    return corpus


# --- options ----------------------------------------------------------------------------------------------------------


def _check_options(skip: int, flips: Flips, flip_degrees: float, reverse: float | None) -> None:
    """Raise CorpusError if an option is out of range."""
    check_integer("skip", skip)
    check_text("flips", flips)
    check_real("flip_degrees", flip_degrees)
    check_real("reverse", reverse, or_none=True)
    if skip < 0:
        raise CorpusError(f"the number of frames to skip must be at least 0, not {skip}")
    if flips not in get_args(Flips):
        raise CorpusError(f"flips must be one of {', '.join(get_args(Flips))}, not {flips!r}")
    if not 0.0 < flip_degrees <= 180.0:
        raise CorpusError(f"the angle of a flip must be above 0 and at most 180 degrees, not {flip_degrees}")
    if reverse is not None and not 0.0 <= reverse <= MAX_PRICE:
        raise CorpusError(f"the price of a move backwards must be from 0 to {MAX_PRICE:g} nats, not {reverse}")


def _check_mix(name: str, mix: Sequence[tuple[Corpus, float]], rate: float | None) -> None:
    """Raise CorpusError if a weight, a name or a rate rules a corpus out."""
    names = [other.name for other, _ in mix]
    for other, weight in mix:
        if not LIGHTEST <= weight <= HEAVIEST:
            raise CorpusError(
                f"the weight of corpus {other.name!r} must be from {LIGHTEST:g} to {HEAVIEST:g}, not {weight}"
            )
        if other.name == name:
            raise CorpusError(f"corpus {name!r} cannot be mixed into itself; give the new corpus another name")
        if names.count(other.name) > 1:
            raise CorpusError(f"two of the corpora to mix are called {other.name!r}")
        if rate is not None and other.rate is not None and rate > other.rate:
            raise CorpusError(
                f"corpus {other.name!r} has {other.rate:g} postures a second; {rate:g} cannot be made of them"
            )


def _common_rate(own: _Recordings, mix: Sequence[tuple[Corpus, float]]) -> float | None:
    """Return the rate of recordings and of corpora mixed with them unchanged; CorpusError if they differ."""
    found: dict[float | None, str] = {own.rate: "the recordings"} if own.body else {}
    for mixed, _ in mix:
        found.setdefault(mixed.rate, f"corpus {mixed.name!r}")
    if len(found) > 1:
        (a, one), (b, other) = list(found.items())[:2]
        raise CorpusError(f"{one} and {other} are of different rates ({_pace(a)}, {_pace(b)}); give a rate for all")
    return next(iter(found))


def _pace(rate: float | None) -> str:
    return "frame by frame" if rate is None else f"{rate:g} postures a second"


# --- clips without their place in the corpus --------------------------------------------------------------------------


class _Recordings(NamedTuple):
    """Recordings without their faults.

    Attributes:
        pieces: their unbroken parts.
        faults: the faults, by recording and time.
        rate: postures a second of what was resampled; None if nothing was.
        body: the first recording's skeleton; None if there is no recording.
    """

    pieces: list[_Piece]
    faults: tuple[JointFlip, ...]
    rate: float | None
    body: Skeleton | None


class _Piece(NamedTuple):
    """A clip: its postures, their recording, and its other attributes."""

    postures: Motion
    recording: Motion
    clip: Clip


def _lay_out_clips(name: str, pieces: Sequence[_Piece], rate: float | None, reverse: float | None) -> tuple[Clip, ...]:
    """Place the clips one after the other, with the heaviest weight scaled to 1; CorpusError if they have no moves."""
    lengths = np.cumsum([0, *(len(piece.postures) for piece in pieces)])
    if lengths[-1] == len(pieces):
        at_rate = f" at {rate:g} postures a second" if rate else ""
        raise CorpusError(f"corpus {name!r}: no recording holds two postures{at_rate}, so there is no move to learn")
    heaviest = max(piece.clip.weight for piece in pieces)
    return tuple(
        replace(
            piece.clip,
            start=int(start),
            stop=int(stop),
            weight=piece.clip.weight / heaviest,
            reverse=piece.clip.reverse if reverse is None else reverse,
        )
        for piece, start, stop in zip(pieces, lengths[:-1], lengths[1:], strict=True)
    )


def _frames_between(rate: float | None) -> int:
    """Return how many frames of detail there are between two postures."""
    return max(round(DETAIL_RATE / rate) - 1, 0) if rate else 0


def _detail(postures: Motion, recording: Motion, between: int) -> NDArray[np.float16]:
    """Return a recording's departures from the spline through its postures [N, between, J, 3], rotation vectors.

    They are 0 after the last posture, where each frame is a posture, and for a joint in a move in which it departs by
    more than `FAULT_DEGREES`.
    """
    count, joints = len(postures), len(postures.skeleton)
    out = np.zeros((count, between, joints, 3), np.float16)
    if between > 0 and 1 < count < len(recording) and recording.fps >= _COARSE:
        times = subdivide_times(postures.times, between)
        spline = rotation_spline(postures.times, postures.rotations, times)
        detail = rot.log(rot.inv_mul(spline, recording.at(times).rotations))
        detail = detail[:-1].reshape(count - 1, between + 1, joints, 3)[:, 1:]
        faulty = np.linalg.norm(detail, axis=-1).max(axis=1) > np.radians(FAULT_DEGREES)
        out[:-1] = np.where(faulty[:, None, :, None], 0.0, detail)
    return out


def _take_recordings(
    motions: Iterable[Motion],
    rate: Rate,
    skip: int,
    flips: Flips,
    flip_degrees: float,
    performer: str | Mapping[str, str],
) -> _Recordings:
    """Skip frames, repair recordings or cut them at faults, and take their postures at `rate`."""
    from motionmind.body.tempo import question_tempo  # a tween from a built corpus does not need it

    pieces: list[_Piece] = []
    faults: list[JointFlip] = []
    names: set[str] = set()
    rates: set[float] = set()
    doubts: list[str] = []
    first: Motion | None = None
    for recording in motions:
        check_type("a clip", recording, Motion)
        first = first or recording
        difference = first.skeleton.difference(recording.skeleton)
        if difference is not None:
            raise CorpusError(
                f"{recording.name} is on another skeleton than {first.name}: {difference}; "
                "a corpus has one (a mapping of joints may bring it there)"
            )
        if skip >= len(recording):
            raise CorpusError(f"{recording.name} has {len(recording)} frames; skipping {skip} leaves none")
        motion = replace(recording.slice(skip, len(recording)), name=_free_name(recording.name or "clip", names))
        names.add(motion.name)
        if doubt := question_tempo(motion):
            doubts.append(f"{motion.name} ({doubt})")
        found, cuts = find_flips(motion, flip_degrees), list[int]()
        repairs: tuple[JointRepair, ...] = ()
        if found and flips == "repair":
            motion, found, repairs = repair_flips(motion, flip_degrees)
            cuts = sorted({flip.frame for flip in find_flips(motion, flip_degrees)})
        faults += [replace(flip, frame=flip.frame + skip) for flip in found]
        if found and flips == "drop":
            continue
        wanted = _posture_rate(motion) if rate == "auto" else rate
        if wanted is not None:
            rates.add(wanted)
        by = performer if isinstance(performer, str) else performer.get(motion.name, "")
        pieces += _cut(motion, cuts, wanted, Clip(motion.name, 0, 0, repairs=_later(repairs, skip), performer=by))
    if doubts:
        message = (
            f"frames per second, or the unit, are doubtful where people move as nobody can: {enumerated(doubts, 3)}"
        )
        warnings.warn(message, MotionMindWarning, stacklevel=3)
    return _Recordings(pieces, tuple(faults), max(rates, default=None), first.skeleton if first else None)


def _cut(motion: Motion, cuts: Sequence[int], rate: float | None, whole: Clip) -> list[_Piece]:
    """Cut a recording before the frames `cuts`, and take its parts' postures; `whole` is its clip.

    Parts are numbered, and those of a single posture, which have no move, are dropped.
    """
    parts = [motion.slice(start, stop) for start, stop in pairwise([0, *cuts, len(motion)])]
    pieces = []
    for number, part in enumerate(parts, start=1):
        name = f"{motion.name}.{number}" if cuts else motion.name
        postures = replace(part if rate is None else part.resample(rate), name=name)
        if len(postures) > 1 or not cuts:
            first, last = part.times[0], part.times[-1]
            within = tuple(one for one in whole.repairs if one.seconds[0] <= last and first <= one.seconds[1])
            clip = replace(whole, name=name, repairs=within)
            pieces.append(_Piece(postures, _with_detail(postures, part, rate), clip))
    return pieces


def _with_detail(postures: Motion, part: Motion, rate: float | None) -> Motion:
    """Return as much of a part of a recording as detail is taken from: hours of it would fill the memory."""
    between = _frames_between(rate)
    if between == 0 or len(postures) == 1 or part.fps < _COARSE:
        return postures
    return part.at(subdivide_times(postures.times, between))


def _later(repairs: Iterable[JointRepair], frames: int) -> tuple[JointRepair, ...]:
    """Return the same repairs, numbered from so many frames before."""
    return tuple(replace(one, start=one.start + frames, stop=one.stop + frames) for one in repairs)


def _posture_rate(motion: Motion) -> float | None:
    """Return how many postures a second to take of a motion; None for every frame, of keyframes."""
    return None if motion.keyframed or motion.fps < FILM_RATE else RECORDED_RATE


def _take_clips(other: Corpus, weight: float, rate: float | None) -> list[_Piece]:
    """Take the clips of another corpus, marked with its name, each counting `weight` times as much."""
    out = []
    for clip in other.clips:
        motion = other.motion(clip)
        if rate is not None and rate != other.rate:
            motion = motion.resample(rate)
        taken = replace(clip, corpus=clip.corpus or other.name, weight=weight * clip.weight)
        out.append(_Piece(motion, other.recording(clip), taken))
    return out


def _mirror_images(pieces: Sequence[_Piece]) -> list[_Piece]:
    """Mirror the clips, except those whose mirror image is already there, from a corpus mixed in."""
    present = {(clip.corpus, clip.name) for _, _, clip in pieces if clip.mirrored}
    out = []
    for postures, recording, clip in pieces:
        if (clip.corpus, clip.name) not in present:
            try:
                partners = find_sides(postures.skeleton).partners
                out.append(_Piece(mirrored(postures), mirrored(recording), _mirror_image(clip, postures, partners)))
            except SkeletonError as error:
                raise SkeletonError(f"{clip.label}: {error}") from None
    return out


def _mirror_image(clip: Clip, postures: Motion, partners: Ints) -> Clip:
    """Return a clip with left and right exchanged; `partners` are the joints' on the other side [J]."""
    names = postures.skeleton.names
    opposite = {name: names[partner] for name, partner in zip(names, partners, strict=True)}
    repairs = tuple(replace(repair, joint=opposite[repair.joint]) for repair in clip.repairs)
    return replace(clip, mirrored=True, repairs=repairs)


def _free_name(name: str, taken: set[str]) -> str:
    """Return the name, or "name (2)" and so on if it is taken."""
    numbered = (f"{name} ({i})" for i in count(2))
    return next(free for free in chain([name], numbered) if free not in taken)
