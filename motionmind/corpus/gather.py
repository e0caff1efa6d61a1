"""From recordings to a corpus: frames dropped, faults found, postures made even in time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import chain, count
from typing import Literal, get_args

import numpy as np

from motionmind import rotations as rot
from motionmind.corpus.corpus import Clip, Corpus, Facing, Fault
from motionmind.errors import CorpusError
from motionmind.motion import Motion

Flips = Literal["drop", "keep", "split"]

FLIP_DEGREES = 45.0
FLIP_SPEED = 3000.0  # degrees a second


def find_flips(motion: Motion, degrees: float = FLIP_DEGREES) -> tuple[Fault, ...]:
    """Joints that turn by more than `degrees` from one frame to the next, and faster than 3,000 degrees a second.

    The second condition spares keyframes and slow cameras, whose frames lie far apart, and quick throws and kicks. A
    fault's frame is the first one after the jump.
    """
    turned = np.degrees(rot.angle(motion.rotations[:-1], motion.rotations[1:]))
    speed = turned / np.diff(motion.times)[:, None]
    return tuple(
        Fault(motion.name, motion.skeleton.names[joint], int(frame) + 1, float(turned[frame, joint]))
        for frame, joint in np.argwhere((turned > degrees) & (speed > FLIP_SPEED))
    )


def gather(
    name: str,
    motions: Iterable[Motion],
    *,
    rate: float | None = None,
    skip: int = 0,
    facing: Facing = "free",
    flips: Flips = "split",
    flip_degrees: float = FLIP_DEGREES,
    about: dict[str, str] | None = None,
    title: str = "",
    author: str = "",
    source: str = "",
    licence: str = "",
) -> Corpus:
    """A corpus of `motions`, all on the same joints.

    Args:
        name: of the corpus.
        motions: the recordings, named; one of a name that is taken is numbered.
        rate: postures a second; None keeps every frame with its own time.
        skip: frames to drop at each recording's start, such as an added T-pose.
        facing: see Corpus.
        flips: what becomes of a recording with faults (`find_flips`): `split` cuts it there, so that no jump is
            learned, `keep` takes it as it is, `drop` leaves it out.
        flip_degrees: what counts as one, in one frame.
        about: a line on each clip, by its name.
        title: a line on what the corpus is.
        author: who made it.
        source: where it comes from.
        licence: under which it may be used.

    Raises CorpusError where nothing is left to learn from, two recordings differ in their joints, or an option is out
    of its range.
    """
    if skip < 0:
        raise CorpusError(f"the number of frames to skip must be at least 0, not {skip}")
    if flips not in get_args(Flips):
        raise CorpusError(f"flips must be one of {', '.join(get_args(Flips))}, not {flips!r}")
    if not 0.0 < flip_degrees <= 180.0:
        raise CorpusError(f"the angle of a flip must be above 0 and at most 180 degrees, not {flip_degrees}")
    pieces: list[Motion] = []
    faults: list[Fault] = []
    names: set[str] = set()
    first: Motion | None = None
    for recording in motions:
        first = first or recording
        difference = first.skeleton.difference(recording.skeleton)
        if difference is not None:
            raise CorpusError(
                f"{recording.name} is on another skeleton than {first.name}: {difference}; "
                "a corpus has one (a mapping of joints may bring it there)"
            )
        if skip >= len(recording):
            raise CorpusError(f"{recording.name} has {len(recording)} frames; skipping {skip} leaves none")
        motion = replace(recording.slice(skip, len(recording)), name=_free(recording.name or "clip", names))
        names.add(motion.name)
        found = find_flips(motion, flip_degrees)
        faults += [Fault(f.clip, f.joint, f.frame + skip, f.degrees) for f in found]
        if found and flips == "drop":
            continue
        cuts = sorted({f.frame for f in found}) if flips == "split" else []
        parts = [motion.slice(a, b) for a, b in zip([0, *cuts], [*cuts, len(motion)], strict=True)]
        pieces += _named([part if rate is None else part.resample(rate) for part in parts], motion.name)
    if first is None:
        raise CorpusError(f"corpus {name!r}: no recordings given")
    if not pieces:
        raise CorpusError(f"corpus {name!r}: every recording has faults, and without them nothing is left")
    lengths = np.cumsum([0, *(len(piece) for piece in pieces)])
    if lengths[-1] == len(pieces):
        what = f" at {rate:g} postures a second" if rate else ""
        raise CorpusError(f"corpus {name!r}: no recording holds two postures{what}, so there is no move to learn")
    clips = tuple(
        Clip(piece.name, int(start), int(stop), (about or {}).get(piece.name, ""))
        for piece, start, stop in zip(pieces, lengths[:-1], lengths[1:], strict=True)
    )
    return Corpus(
        name,
        first.skeleton,
        clips,
        np.concatenate([piece.rotations for piece in pieces]),
        np.concatenate([piece.root for piece in pieces]),
        np.concatenate([piece.times for piece in pieces]),
        facing,
        rate,
        title,
        author,
        source,
        licence,
        tuple(faults),
    )


def _named(parts: list[Motion], name: str) -> list[Motion]:
    """Parts of a recording that was cut are numbered; a part of a single posture teaches no move and is left out."""
    if len(parts) == 1:
        return parts
    return [replace(part, name=f"{name}.{i}") for i, part in enumerate(parts, start=1) if len(part) > 1]


def _free(name: str, taken: set[str]) -> str:
    """The name, or "name (2)" and so on if it is taken."""
    numbered = (f"{name} ({i})" for i in count(2))
    return next(free for free in chain([name], numbered) if free not in taken)
