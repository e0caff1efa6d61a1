"""Changing a corpus's movement: clips of more recordings, and clips left out."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionmind.body.motion import Motion
from motionmind.corpus.clip import Clip
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.gather import gather
from motionmind.corpus.recordings import Flips, Recording
from motionmind.errors import CorpusError, suggestion
from motionmind.executors.workshop import Workshop

Taken = tuple[Corpus, Clip]  # a clip, and the corpus that its movement is in


def add_recordings(
    corpus: Corpus,
    motions: Iterable[Motion | Recording],
    *,
    flips: Flips = "repair",
    performer: str = "",
    workshop: Workshop | None = None,
) -> Corpus:
    """Return a corpus with the clips of more recordings, in the order in which `gather` would have put them.

    They are taken as the corpus's own were: at its rate, mirrored if these are, backwards at the same price, with the
    same angle for a flip. The body stays, with its proportions.

    Args:
        corpus: the corpus.
        motions: the recordings, as `motionmind.corpus.gather.gather` takes them, on the same joints.
        flips, performer, workshop: as of `gather`.

    Raises:
        CorpusError: a clip's name is taken, there is nothing to take, or the recordings are on other joints or cannot
            be taken at the corpus's rate.
        SkeletonError: the body cannot be mirrored.
    """
    own = [clip for clip in corpus.clips if not clip.corpus]
    like = own[0] if own else Clip("", 0, 0)
    more = gather(
        corpus.name,
        motions,
        rate="auto" if corpus.rate is None else corpus.rate,
        skip=corpus.skip,
        facing=corpus.facing,
        flips=flips,
        flip_degrees=corpus.flip_degrees,
        mirror=any(clip.mirrored for clip in own),
        reverse=like.reverse,
        performer=performer,
        workshop=workshop,
    )
    if (difference := corpus.skeleton.difference(more.skeleton)) is not None:
        raise CorpusError(f"{more.clips[0].name} is on another skeleton than corpus {corpus.name!r}: {difference}")
    if more.rate != corpus.rate:
        raise CorpusError(
            f"corpus {corpus.name!r} is of keyframes, with times of their own, and recordings cannot be added to it"
        )
    taken = {clip.name for clip in own}
    if repeated := next((clip.name for clip in more.clips if clip.name in taken), None):
        raise CorpusError(
            f"corpus {corpus.name!r} has a clip {repeated!r} already: `corpus remove` it first, or rename the file"
        )
    new = [replace(clip, weight=like.weight) for clip in more.clips]
    last, last_image = (
        max((i for i, c in enumerate(corpus.clips) if not c.corpus and c.mirrored == m), default=-1) + 1
        for m in (False, True)
    )
    kept: list[Taken] = [(corpus, clip) for clip in corpus.clips]
    plain: list[Taken] = [(more, clip) for clip in new if not clip.mirrored]
    images: list[Taken] = [(more, clip) for clip in new if clip.mirrored]
    last_image = max(last, last_image)
    parts = [*kept[:last], *plain, *kept[last:last_image], *images, *kept[last_image:]]
    return replace(of_clips(corpus, parts, workshop), faults=(*corpus.faults, *more.faults))


def remove_clips(corpus: Corpus, names: Sequence[str], workshop: Workshop | None = None) -> Corpus:
    """Return a corpus without some of its own clips, and their mirror images.

    Args:
        corpus: the corpus.
        names: of clips, or of recordings: then all their parts go ("dance" takes "dance.1" and "dance.2" along).
        workshop: as of `gather`.

    Raises:
        CorpusError: there is no such clip of its own, or nothing would be left to learn from.
    """
    whole = {clip.name: re.sub(r"\.\d+$", "", clip.name) for clip in corpus.clips if not clip.corpus}
    for name in names:
        if name not in whole and name not in whole.values():
            raise CorpusError(f"corpus {corpus.name!r} has no clip {name!r} of its own{suggestion(name, whole)}")
    gone = {clip for clip, recording in whole.items() if clip in names or recording in names}
    parts = [(corpus, clip) for clip in corpus.clips if clip.corpus or clip.name not in gone]
    if all(len(clip) < 2 for _, clip in parts):
        raise CorpusError(f"corpus {corpus.name!r}: without these clips there is no move left to learn")
    kept = {clip.name for _, clip in parts if not clip.corpus}
    recordings = {whole[name] for name in kept} | kept
    faults = tuple(fault for fault in corpus.faults if fault.clip in recordings)
    return replace(of_clips(corpus, parts, workshop), faults=faults)


def of_clips(corpus: Corpus, parts: Sequence[Taken], workshop: Workshop | None) -> Corpus:
    """Return a corpus of clips of this one and of others on the same joints, the heaviest clip having weight 1.

    Args:
        corpus: says all but the clips and their movement.
        parts: the clips in their order, one at least.
        workshop: room for their movement; None for memory.
    """
    stops = np.cumsum([len(clip) for _, clip in parts])
    heaviest = max(clip.weight for _, clip in parts)
    clips = tuple(
        replace(clip, start=int(stop) - len(clip), stop=int(stop), weight=clip.weight / heaviest)
        for (_, clip), stop in zip(parts, stops, strict=True)
    )

    def joined(name: str) -> NDArray[Any]:
        pile = (workshop or Workshop()).pile()
        for one, clip in parts:
            pile.add(getattr(one, name)[clip.start : clip.stop])
        return pile.array()

    return replace(
        corpus,
        clips=clips,
        rotations=joined("rotations"),
        root=joined("root"),
        times=joined("times"),
        detail=joined("detail"),
    )
