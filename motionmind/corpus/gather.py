"""Gather recordings and other corpora into a corpus: repair, resample and mirror them."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, count
from numbers import Real
from typing import Any, TypedDict, get_args

import numpy as np
from numpy.typing import NDArray

from motionmind.arguments import (
    check_flag,
    check_integer,
    check_items,
    check_mapping,
    check_real,
    check_text,
    check_type,
)
from motionmind.body.motion import Motion
from motionmind.corpus.clip import FLIP_DEG, Clip
from motionmind.corpus.corpus import MAX_PRICE, Corpus, Facing
from motionmind.corpus.origins import gather_origins, warn_of_licences
from motionmind.corpus.recordings import (
    Flips,
    Piece,
    Rate,
    Recording,
    Source,
    Taking,
    as_piece,
    frames_between,
    mirror_image,
    renamed,
    take,
    take_clip,
)
from motionmind.corpus.remarks import remark
from motionmind.errors import CorpusError, MotionMindWarning, enumerated
from motionmind.executors.workshop import Workshop

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
    motions: Iterable[Motion | Recording],
    *,
    rate: Rate = "auto",
    skip: int = 0,
    facing: Facing = "free",
    flips: Flips = "repair",
    flip_degrees: float = FLIP_DEG,
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
    workshop: Workshop | None = None,
) -> Corpus:
    """Gather `motions`, and the corpora to `mix` with them, into one corpus; all must have the same joints.

    Args:
        name: the corpus's name.
        motions: the named recordings; repeated names are numbered. A `Recording`, which
            `motionmind.corpus.recordings.take` returned for the same options, is used as it is.
        rate: postures per second; None keeps every frame with its own time. "auto" takes 5 postures a second of a
            recording, and logs it (logger "motionmind.corpus.remarks", level INFO). It takes every frame of keyframes:
            a motion marked as keyframed, or one with fewer than 15 frames a second. It resamples corpora mixed in at
            the recordings' rate, or without recordings at the lowest rate of these corpora.
        skip: frames to drop at each recording's start, such as an added T-pose. If it is 0 and most recordings begin
            with such a pose, a log entry says so.
        facing: "free" removes the turn about the vertical from the root's state and makes it a joint chain of its own;
            "stage" leaves it there, so facing the wall and facing the audience are different states.
        flips: treatment of a recording with flips (`find_flips`): "repair" mends them (`repair_flips`), or cuts the
            recording there, so no flip is learned; "keep" takes it unchanged; "drop" leaves it out.
        flip_degrees: a joint that turns by more degrees than this in one frame flips.
        mirror: whether to learn from the mirror images of all clips, too.
        reverse: the price, in nats per move, of learning from all clips backwards, too: a move backwards counts
            exp(-price). None keeps the prices of corpora mixed in, and adds no others.
        mix: other corpora, each with the weight of its postures and moves; `motions` have weight 1. Only ratios matter:
            the largest becomes 1. Clips of these corpora are taken unchanged, or resampled at `rate`; `skip` and
            `flips` apply to the recordings only.
        about: one-line descriptions of clips, by name.
        title: a one-line description of the corpus.
        author: who made it.
        source: where it comes from.
        licence: the licence for its use.
        citation: how to cite it.
        performer: the performer of all recordings, or of each by its name. The author is credited for recordings
            without a performer.
        workshop: room on disk for a corpus that does not fit into memory; None keeps it in memory.

    Returns:
        The corpus.

    Warns:
        MotionMindWarning: recordings contradict their clocks (`question_tempo`), or the licences of the corpora do not
            allow passing on a mixture of them (`motionmind.credits.licences`).

    Raises:
        CorpusError: nothing is left to learn from, recordings or corpora differ in their joints or cannot be brought to
            one rate, or an option is out of range.
        SkeletonError: the body cannot be mirrored.
        OSError: the workshop's disk is full.
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
    workshop = workshop or Workshop()
    growing, images = _Growing(workshop), _Growing(workshop)
    own: list[Recording] = []
    for one in _take_recordings(motions, Taking(rate, skip, flips, flip_degrees, mirror)):
        by = performer if isinstance(performer, str) else performer.get(one.name, "")
        for into, pieces in ((growing, one.pieces), (images, one.images if mirror else ())):
            for piece in pieces:
                clip = replace(piece.clip, about=(about or {}).get(piece.clip.name, ""), performer=by)
                into.add(piece._replace(clip=clip))
        own.append(one._replace(pieces=(), images=()))
    body = own[0].body if own else None
    if body is None and not mix:
        raise CorpusError(f"corpus {name!r}: no recordings given")
    taken = max((one.rate for one in own if one.rate is not None), default=None)
    for other, _ in mix:
        body = body or other.skeleton
        difference = body.difference(other.skeleton)
        if difference is not None:
            raise CorpusError(f"corpus {other.name!r} is on another skeleton than {body.name}: {difference}")
    remark(name, own, is_rate_given=rate != "auto", skip=skip)
    mixed = [(other, clip, weight) for other, weight in mix for clip in other.clips]
    if body is None or not (mixed or growing.clips):
        raise CorpusError(f"corpus {name!r}: every recording has faults, and without them nothing is left")
    common = _common_rate(name, taken, bool(own), mix, rate == "auto") if given is None else given
    between = frames_between(common)
    for one_mixed in mixed:
        growing.add(as_piece(_mixed(*one_mixed, common), between))
    if mirror:
        growing.extend(images)
        present = {_name_in(other, clip) for other, clip, _ in mixed if clip.mirrored}
        for other, clip, weight in mixed:
            if _name_in(other, clip) not in present:
                growing.add(mirror_image(_mixed(other, clip, weight, common), between))
    corpus = Corpus(
        name,
        body,
        _lay_out_clips(name, growing.clips, common, reverse),
        growing.array("rotations"),
        growing.array("root"),
        growing.array("times"),
        growing.detail(between),
        facing,
        common,
        title,
        author,
        source,
        licence,
        tuple(fault for one in own for fault in one.faults),
        skip,
        gather_origins(other for other, _ in mix),
        citation,
        flip_degrees,
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
        if not 1e-6 <= weight <= 1e6:
            raise CorpusError(f"the weight of corpus {other.name!r} must be from 1e-06 to 1e+06, not {weight}")
        if other.name == name:
            raise CorpusError(f"corpus {name!r} cannot be mixed into itself; give the new corpus another name")
        if names.count(other.name) > 1:
            raise CorpusError(f"two of the corpora to mix are called {other.name!r}")
        if rate is not None and other.rate is not None and rate > other.rate:
            raise CorpusError(
                f"corpus {other.name!r} has {other.rate:g} postures a second; {rate:g} cannot be made of them"
            )


def _common_rate(
    name: str, taken: float | None, has_own: bool, mix: Sequence[tuple[Corpus, float]], auto: bool
) -> float | None:
    """Return the common rate of recordings and of the corpora mixed with them.

    Args:
        name: the name of the new corpus.
        taken: postures a second taken of the recordings.
        has_own: whether there are recordings.
        mix: the corpora, as for `gather`.
        auto: whether corpora may be resampled.

    Raises:
        CorpusError: the rates differ, and the corpora may not or cannot be resampled to one.
    """
    found: dict[float | None, str] = {taken: "the recordings"} if has_own else {}
    for mixed, _ in mix:
        found.setdefault(mixed.rate, f"corpus {mixed.name!r}")
    lowest = min((rate for rate in found if rate is not None), default=None)
    if len(found) > 1 and auto and not (has_own and taken != lowest):
        brought = ", ".join(repr(mixed.name) for mixed, _ in mix if mixed.rate != lowest)
        _log.info("corpus %s: %g postures a second, also of %s", name, lowest, brought)
        return lowest
    if len(found) > 1:
        (a, one), (b, other) = list(found.items())[:2]
        raise CorpusError(f"{one} and {other} are of different rates ({_pace(a)}, {_pace(b)}); give a rate for all")
    return next(iter(found))


def _pace(rate: float | None) -> str:
    return "frame by frame" if rate is None else f"{rate:g} postures a second"


# --- a growing corpus -------------------------------------------------------------------------------------------------


class _Growing:
    """A corpus under construction: its clips so far, one after the other, and their movement.

    Attributes:
        clips: the clips, with their ranges in the corpus.
    """

    def __init__(self, workshop: Workshop) -> None:
        self.clips: list[Clip] = []
        self._workshop, self._joints = workshop, 0
        self._piles = {name: workshop.pile() for name in Piece._fields[1:]}
        self._between: list[int] = []  # frames of detail, by clip

    def add(self, piece: Piece) -> None:
        """Add a clip and its movement."""
        start = self.clips[-1].stop if self.clips else 0
        self.clips.append(replace(piece.clip, start=start, stop=start + len(piece.times)))
        self._joints = piece.detail.shape[2]
        self._between.append(piece.detail.shape[1])
        for name, pile in self._piles.items():
            if name != "detail" or piece.detail.shape[1]:
                pile.add(getattr(piece, name))

    def extend(self, others: _Growing) -> None:
        """Add all clips of `others`, which must be complete."""
        if not others.clips:
            return
        rotations, root, times = (others.array(name) for name in ("rotations", "root", "times"))
        detail = others.detail(max(others._between))
        for clip, between in zip(others.clips, others._between, strict=True):
            here = slice(clip.start, clip.stop)
            self.add(Piece(clip, rotations[here], root[here], times[here], detail[here, :between]))

    def array(self, name: str) -> NDArray[Any]:
        """Return rotations, roots or times of all postures."""
        return self._piles[name].array()

    def detail(self, between: int) -> NDArray[np.float16]:
        """Return the detail of all postures [N, between, J, 3]; zeros for keyframes."""
        pile, count = self._piles["detail"], self.clips[-1].stop
        if len(pile) == count and set(self._between) == {between}:
            return pile.array()
        out = self._workshop.empty((count, between, self._joints, 3), np.float16)
        kept, start = pile.array() if len(pile) else out[:0], 0
        for clip, own in zip(self.clips, self._between, strict=True):
            stop = start + len(clip) * bool(own)
            out[clip.start : clip.stop] = kept[start:stop] if own else 0.0
            start = stop
        return out


def _lay_out_clips(name: str, clips: Sequence[Clip], rate: float | None, reverse: float | None) -> tuple[Clip, ...]:
    """Return the clips with the heaviest weight scaled to 1; CorpusError if they have no moves."""
    if clips[-1].stop == len(clips):
        at_rate = f" at {rate:g} postures a second" if rate else ""
        raise CorpusError(f"corpus {name!r}: no recording holds two postures{at_rate}, so there is no move to learn")
    heaviest = max(clip.weight for clip in clips)
    return tuple(
        replace(clip, weight=clip.weight / heaviest, reverse=clip.reverse if reverse is None else reverse)
        for clip in clips
    )


def _take_recordings(motions: Iterable[Motion | Recording], taking: Taking) -> Iterator[Recording]:
    """Yield the recordings, with repeated names numbered; take motions first. At the end warn of doubtful clocks.

    Raises:
        CorpusError: they are on different joints, or skipping leaves no frames of one.
        SkeletonError: the body cannot be mirrored.
    """
    first: Recording | None = None
    names: set[str] = set()
    doubts: list[str] = []
    for motion in motions:
        check_type("a clip", motion, Motion, Recording, wanted="a Motion")
        taken = motion if isinstance(motion, Recording) else take(motion, taking)
        if first is not None and (difference := first.body.difference(taken.body)) is not None:
            raise CorpusError(
                f"{taken.name} is on another skeleton than {first.name}: {difference}; "
                "a corpus has one (a mapping of joints may bring it there)"
            )
        taken = renamed(taken, _free_name(taken.name, names))
        first = first or taken._replace(pieces=(), images=())
        names.add(taken.name)
        if taken.doubt:
            doubts.append(f"{taken.name} ({taken.doubt})")
        yield taken
    if doubts:
        message = (
            f"frames per second, or the unit, are doubtful where people move as nobody can: {enumerated(doubts, 3)}"
        )
        warnings.warn(message, MotionMindWarning, stacklevel=3)


def _name_in(other: Corpus, clip: Clip) -> tuple[str, str]:
    """Return the name of the corpus that a clip of `other` comes from, and the clip's own name."""
    return clip.corpus or other.name, clip.name


def _mixed(other: Corpus, clip: Clip, weight: float, rate: float | None) -> Source:
    """Take a clip of another corpus: record that corpus's name, and multiply the clip's weight by `weight`."""
    found = take_clip(other, clip, rate)
    return found._replace(clip=replace(clip, corpus=clip.corpus or other.name, weight=weight * clip.weight))


def _free_name(name: str, taken: set[str]) -> str:
    """Return the name, or "name (2)" and so on if it is taken."""
    numbered = (f"{name} ({i})" for i in count(2))
    return next(free for free in chain([name], numbered) if free not in taken)
