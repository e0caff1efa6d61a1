"""A corpus in memory: consecutive clips of postures on one skeleton, with their provenance."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, Ints
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.clip import FLIP_DEG, MIRRORED, Clip, JointFlip
from motionmind.corpus.entries import Columns, StoredClips, key_of
from motionmind.corpus.moves import Moves
from motionmind.credits.credit import Credit, Origin, credit_clip
from motionmind.display import displayed
from motionmind.errors import CorpusError
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline, rotation_spline

Facing = Literal["free", "stage"]

FACING = "facing"  # the joint chain of the body's turn about the vertical
MAX_PRICE = 100.0  # nats per move backwards; no search will use a count of exp(-100)


@dataclass(frozen=True, eq=False)
class Corpus:
    """Movement to learn from.

    Attributes:
        name: the corpus's name.
        skeleton: the body; with the first performer's proportions if there are several.
        clips: the clips, in order and without gaps; a loaded corpus decodes each on access.
        rotations: local rotations of all postures [N, J, 4].
        root: positions of the root joint [N, 3], metres.
        times: seconds in the clip's own recording [N], increasing within a clip.
        detail: the recording's departures from the spline through its clip's postures [N, K, J, 3]: rotation vectors,
            radians, at K evenly spaced times between each posture and the next.
        facing: "stage" if the root's full orientation is its state; "free" if its turn about the vertical is removed
            from it and is a joint chain of its own.
        rate: postures per second of what was recorded; None if all are keyframes with their own times.
        title: a one-line description.
        author: who made it.
        source: where it comes from.
        licence: the licence for its use.
        faults: joint flips in the corpus's own recordings, read like the clips.
        skip: frames that were dropped at each recording's start, such as an added T-pose.
        origins: the corpora that its other clips were taken from.
        citation: how to cite it; "" if nobody asks for that.
        flip_degrees: the turn in one frame that counted as a flip in its own recordings.

    >>> from motionmind import Corpus, Engine
    >>> corpus = Engine.load("ballet").corpus
    >>> isinstance(corpus, Corpus), corpus.rotations.shape == (len(corpus.root), len(corpus.skeleton), 4)
    (True, True)
    """

    name: str
    skeleton: Skeleton
    clips: Sequence[Clip]
    rotations: Floats
    root: Floats
    times: Floats
    detail: NDArray[np.float16]
    facing: Facing
    rate: float | None = None
    title: str = ""
    author: str = ""
    source: str = ""
    licence: str = ""
    faults: Sequence[JointFlip] = ()
    skip: int = 0
    origins: tuple[Origin, ...] = ()
    citation: str = ""
    flip_degrees: float = FLIP_DEG

    def __post_init__(self) -> None:
        if len(self.rotations) == 0:
            raise CorpusError(f"corpus {self.name!r} has no postures")
        count = len(self.rotations)
        if (self.rotations.shape, self.root.shape, self.times.shape) != (
            (count, len(self.skeleton), 4),
            (count, 3),
            (count,),
        ):
            raise CorpusError(f"corpus {self.name!r}: rotations, root and times are not those of {count} postures")
        if self.detail.shape != (count, self.detail.shape[1], len(self.skeleton), 3):
            raise CorpusError(f"corpus {self.name!r}: its detail is not that of {count} postures")
        if not isinstance(self.clips, StoredClips):
            self.check_clips()
        if self.facing not in ("free", "stage"):
            raise CorpusError(f"corpus {self.name!r}: facing must be 'free' or 'stage', not {self.facing!r}")
        if FACING in self.skeleton.names:
            raise CorpusError(f"corpus {self.name!r}: a joint cannot be called {FACING!r}; that is the body's turn")

    def check_clips(self) -> None:
        """Check where each clip starts and what it counts; of a corpus on disk, once, when its arrays are checked.

        Raises:
            CorpusError: they do not follow one another, or one counts nothing or too much.
        """
        starts, stops = [], []
        for clip in self.clips:
            starts.append(clip.start)
            stops.append(clip.stop)
            if not (0.0 < clip.weight < math.inf and (clip.reverse is None or 0.0 <= clip.reverse <= MAX_PRICE)):
                raise CorpusError(
                    f"corpus {self.name!r}: {clip.label} weighs {clip.weight} and costs {clip.reverse} nats a move "
                    f"backwards; a weight must be above 0, a price from 0 to {MAX_PRICE:g}"
                )
        if [0, *stops] != [*starts, len(self)]:
            raise CorpusError(f"corpus {self.name!r}: the clips do not follow one another from 0 to {len(self)}")

    def __len__(self) -> int:
        return len(self.rotations)

    def __repr__(self) -> str:
        name, body = displayed(self.name), displayed(self.skeleton.name)
        return f"<Corpus {name} on {body}: postures {len(self)}, clips {len(self.clips)}, facing {self.facing}>"

    @cached_property
    def moves(self) -> Moves:
        """All moves from a posture to the next in its clip; then, for clips learned backwards, to the one before."""
        return Moves(self.columns, self.times)

    @cached_property
    def columns(self) -> Columns:
        """Where its clips start, what they count and how they are ordered by name."""
        return self.clips.columns if isinstance(self.clips, StoredClips) else Columns.of(self.clips)

    @property
    def begins(self) -> Ints:
        """Indices of the postures that the moves lead from [M]."""
        return self.moves.begins

    @property
    def seconds(self) -> Floats:
        """Durations of the moves [M], seconds."""
        return self.moves.seconds

    @cached_property
    def weights(self) -> Floats:
        """Counts of the postures [N]. A clip learned backwards shows the same postures, so they count once."""
        return np.repeat(self.columns.weights[:, 0], np.diff(self.columns.starts))

    @cached_property
    def chains(self) -> tuple[str, ...]:
        """Names of the joint chains [L]: the joints, then the facing if it is free."""
        return (*self.skeleton.names, FACING) if self.facing == "free" else self.skeleton.names

    @cached_property
    def chain_parents(self) -> Ints:
        """Index of each joint chain's parent [L], -1 for the root and the facing."""
        free = (-1,) if self.facing == "free" else ()
        return np.array((*self.skeleton.parents, *free), dtype=np.int64)

    def to_chains(self, rotations: Floats) -> Floats:
        """Convert postures' local rotations [..., J, 4] to orientations of the joint chains [..., L, 4]."""
        if self.facing == "stage":
            return rotations
        turn = rot.about_vertical(rot.heading(rotations[..., 0, :]))
        tilt = rot.inv_mul(turn, rotations[..., 0, :])
        return np.concatenate([tilt[..., None, :], rotations[..., 1:, :], turn[..., None, :]], axis=-2)

    def chain(self, number: int) -> Floats:
        """Return the orientations of one joint chain in all postures [N, 4], as `to_chains` gives them."""
        if self.facing == "stage" or 0 < number < len(self.skeleton):
            return np.ascontiguousarray(self.rotations[:, number])
        pelvis = self.rotations[:, 0]
        turn = rot.about_vertical(rot.heading(pelvis))
        return rot.inv_mul(turn, pelvis) if number == 0 else turn

    def from_chains(self, chains: Floats) -> Floats:
        """Convert orientations of the joint chains [..., L, 4] to local rotations [..., J, 4]; inverts `to_chains`."""
        if self.facing == "stage":
            return chains
        pelvis = rot.mul(chains[..., -1, :], chains[..., 0, :])
        return np.concatenate([pelvis[..., None, :], chains[..., 1:-1, :]], axis=-2)

    def where(self, posture: int) -> tuple[str, int]:
        """Return the name of a posture's clip, and the posture's number there, from 0."""
        clip = self.clip_of(posture)
        return clip.name, posture - clip.start

    def clip_of(self, posture: int) -> Clip:
        """Return the clip that a posture is in."""
        return self.clips[bisect_right(self.columns.starts, range(len(self))[posture]) - 1]

    def clips_named(self, corpus: str, name: str) -> list[Clip]:
        """Return the clips with a name, taken from the corpus of a name; a mirror image has both in common."""
        own = ("", corpus) if corpus == self.name else (corpus,)
        return [clip for key in own for clip in self._clips_at(key, name)]

    def clip_labelled(self, label: str) -> Clip:
        """Return the clip with a label (`Clip.label`); KeyError if there is none."""
        for text in (label, label.removesuffix(MIRRORED)):
            words = text.split(": ")
            for count in range(len(words)):
                found = self._clips_at(": ".join(words[:count]), ": ".join(words[count:]))
                if clips := [clip for clip in found if clip.label == label]:
                    return clips[-1]
        raise KeyError(label)

    def _clips_at(self, corpus: str, name: str) -> list[Clip]:
        """Return the clips whose entries have these, as few others as possible being read."""
        order = self.columns.order
        if not len(order) or key_of(self.clips[order[-1]]) < (corpus, name):  # as all are, where none comes from there
            return []
        found: list[Clip] = []
        at = bisect_left(order, (corpus, name), key=lambda number: key_of(self.clips[number]))
        while at < len(order) and key_of(clip := self.clips[order[at]]) == (corpus, name):
            found.append(clip)
            at += 1
        return found

    @cached_property
    def own_origin(self) -> Origin:
        """Where its own clips come from."""
        return Origin(self.name, self.title, self.author, self.source, self.licence, self.citation)

    @cached_property
    def clip_origins(self) -> dict[str, Origin]:
        """Where its clips come from, by the name of the corpus that each was taken from, its own among them."""
        return {clip.corpus or self.name: self._origin_of(clip) for clip in self.clips}

    def _origin_of(self, clip: Clip) -> Origin:
        """Return where a clip comes from; corpora that were mixed before origins were kept are known by their names."""
        name = clip.corpus or self.name
        return next((one for one in (self.own_origin, *reversed(self.origins)) if one.name == name), Origin(name))

    def credit_of(self, clip: Clip) -> Credit:
        """Return the credit of a movement that is all made of a clip."""
        return credit_clip(self._origin_of(clip), clip.name, clip.performer)

    def motion(self, clip: Clip) -> Motion:
        """Return a clip's N postures as a motion."""
        here = slice(clip.start, clip.stop)
        return Motion(
            self.skeleton,
            self.rotations[here],
            self.root[here],
            self.times[here],
            clip.name,
            keyframed=self.rate is None,
            recorded=(self.credit_of(clip),),
        )

    def recording(self, clip: Clip, start: int = 0, stop: int | None = None) -> Motion:
        """Return a clip as a motion of its N postures and, if the corpus keeps detail, K frames between each two.

        Args:
            clip: one of the clips.
            start, stop: the first of the frames to return, and the one after the last; all by default.
        """
        between = self.detail.shape[1]
        if between == 0 or len(clip) == 1:
            # Part of a long clip costs no more than part of a short one.
            stop = len(clip) if stop is None else min(stop, len(clip))
            return self.motion(replace(clip, start=clip.start + start, stop=clip.start + stop))
        here = slice(clip.start, clip.stop)
        whole = self.recorded_times(clip)
        frames = np.arange(len(whole))[start:stop]
        move, number = np.divmod(frames, between + 1)
        is_between = number > 0
        detail = np.zeros((len(frames), len(self.skeleton), 3))
        detail[is_between] = self.detail[clip.start + move[is_between], number[is_between] - 1]
        times = whole[frames]
        spline = rotation_spline(self.times[here], self.rotations[here], times)
        rotations = rot.normalise(rot.mul(spline, rot.exp(detail)))
        root = natural_spline(self.times[here], self.root[here], times)
        return Motion(self.skeleton, rotations, root, times, clip.name, recorded=(self.credit_of(clip),))

    def recorded_times(self, clip: Clip) -> Floats:
        """Return the times of the frames of `recording`, seconds."""
        times, between = self.times[clip.start : clip.stop], self.detail.shape[1]
        return times if between == 0 or len(clip) == 1 else subdivide_times(times, between)


def subdivide_times(times: Floats, between: int) -> Floats:
    """Insert `between` evenly spaced times between each of `times` [N] and the next: [(N - 1) (between + 1) + 1]."""
    share = np.arange(between + 1) / (between + 1)
    return np.append((times[:-1, None] + share * np.diff(times)[:, None]).ravel(), times[-1])
