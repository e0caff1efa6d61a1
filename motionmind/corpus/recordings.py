"""Turn single recordings into clips of a corpus: repair them, cut them at faults, resample and mirror them."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, Ints
from motionmind.body.contact import find_floor
from motionmind.body.mirror import find_sides, mirrored
from motionmind.body.motion import Motion
from motionmind.body.rates import FILM_FPS
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.clip import FLIP_DEG, Clip, JointFlip, JointRepair
from motionmind.corpus.corpus import Corpus, subdivide_times
from motionmind.corpus.dropped import Gap, fill_gaps
from motionmind.corpus.flips import find_flips, repair_flips
from motionmind.errors import CorpusError, MotionMindWarning, SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import rotation_spline

Flips = Literal["drop", "keep", "repair"]
Rate = float | Literal["auto"] | None

POSTURE_RATE_FPS = 5.0  # default for recordings, as [O10] chose for motion capture
FLOOR_OFFSET_M = 0.03  # a floor farther from 0 is reported
_DETAIL_MIN_FPS = 20.0  # a slower recording has no detail to keep


@dataclass(frozen=True)
class Taking:
    """Options of `gather` for a single recording; see there."""

    rate: Rate = "auto"
    skip: int = 0
    flips: Flips = "repair"
    flip_degrees: float = FLIP_DEG
    mirror: bool = False


class Piece(NamedTuple):
    """A clip of N postures without its place in a corpus.

    Attributes:
        clip: its attributes; `start` and `stop` are 0.
        rotations: local rotations [N, J, 4].
        root: positions of the root joint [N, 3], metres.
        times: seconds in the recording [N].
        detail: the recording's departures from the spline through the postures [N, K, J, 3], as in Corpus.
    """

    clip: Clip
    rotations: Floats
    root: Floats
    times: Floats
    detail: NDArray[np.float16]


class Recording(NamedTuple):
    """The result of taking a recording: its repaired pieces, and what was found in it.

    Attributes:
        name: its name; "" if it has none.
        body: its skeleton.
        rate: postures taken a second; None if every frame was taken, or none.
        doubt: why its clock is doubtful (`question_tempo`); "" if it is not.
        faults: its flips.
        pieces: its unbroken parts; none if it is left out.
        images: their mirror images, if requested.
        added: number of frames of one posture before the movement (`added_frames`), after the skipped frames.
        floor: height of the floor that its feet stand on (`find_floor`), metres; 0 for keyframes.
        is_made: whether the engine made some of it.
    """

    name: str
    body: Skeleton
    rate: float | None
    doubt: str
    faults: tuple[JointFlip, ...]
    pieces: tuple[Piece, ...]
    images: tuple[Piece, ...]
    added: int = 0
    floor: float = 0.0
    is_made: bool = False


class Source(NamedTuple):
    """The material of a clip: its postures, the part of its recording that gives the detail, and its attributes."""

    postures: Motion
    recording: Motion
    clip: Clip


def take(recording: Motion, taking: Taking) -> Recording:
    """Skip frames of a recording, repair it or cut it at its faults, and take its postures.

    Raises:
        CorpusError: no frames are left.
        SkeletonError: the body cannot be mirrored.
    """
    from motionmind.body.tempo import question_tempo  # a tween from a built corpus does not need it

    skip = taking.skip
    if skip >= len(recording):
        raise CorpusError(f"{recording.name} has {len(recording)} frames; skipping {skip} leaves none")
    motion = replace(recording.slice(skip, len(recording)), name=recording.name or "clip")
    added, is_made = added_frames(motion), bool(recording.insertions)
    repairs: tuple[JointRepair, ...] = ()
    left: tuple[Gap, ...] = ()
    if taking.flips == "repair":
        motion, repairs, left, _, report = fill_gaps(motion, added, skip)
        if report:
            warnings.warn(f"{motion.name}: {report}", MotionMindWarning, stacklevel=2)
    ends = sorted({0, *(frame for gap in left for frame in (gap.start, gap.stop)), len(motion)})
    doubt = question_tempo(motion.slice(*max(pairwise(ends), key=lambda part: part[1] - part[0])))
    found, cuts = find_flips(motion, taking.flip_degrees), list[int]()
    if found and taking.flips == "repair":
        motion, found, mended = repair_flips(motion, taking.flip_degrees)
        cuts = [flip.frame for flip in find_flips(motion, taking.flip_degrees)]
        repairs += mended
    cuts = sorted({*cuts, *ends[1:-1]})
    faults = tuple(replace(flip, frame=flip.frame + skip) for flip in found)
    if found and taking.flips == "drop":
        return Recording(motion.name, motion.skeleton, None, doubt, faults, (), (), added, is_made=is_made)
    rate = posture_rate(motion) if taking.rate == "auto" else taking.rate
    whole = Clip(motion.name, 0, 0, repairs=_later(repairs, skip))
    parts = _cut(motion, cuts, rate, whole, {gap.start for gap in left if gap.stop > gap.start})
    between = frames_between(rate)
    pieces = tuple(as_piece(part, between) for part in parts)
    images = tuple(mirror_image(part, between) for part in parts) if taking.mirror else ()
    floor = floor_of(motion) if rate is not None else 0.0
    return Recording(motion.name, motion.skeleton, rate, doubt, faults, pieces, images, added, floor, is_made)


def floor_of(motion: Motion) -> float:
    """Return the height of the floor that feet stand on in a recording, metres, as of `find_floor` with heels."""
    some = slice(None, None, -(-len(motion) // 500))  # 500 frames at most
    return find_floor(motion.skeleton, motion.rotations[some], motion.root[some], heels=True)


def added_frames(recording: Motion) -> int:
    """Return the number of frames of one added posture before the movement, such as a T-pose.

    Nothing moves in these frames; then several joints jump at once.
    """
    if recording.keyframed or recording.fps < FILM_FPS:
        return 0
    stop = int(2.0 * recording.fps) + 2  # they last two seconds at most
    rotations = recording.rotations[:stop]
    turned = np.degrees(rot.angle(rotations[:-1], rotations[1:]))
    moving = np.flatnonzero(turned.max(axis=1) > 0.05)  # degrees in a frame
    if not len(moving) or np.count_nonzero(turned[moving[0]] > FLIP_DEG) < 3:
        return 0
    return int(moving[0]) + 1


def usually_added(taken: Sequence[Recording]) -> int:
    """Return the most common `added_frames` of recordings; 0 unless most recordings have some."""
    found = Counter(one.added for one in taken if one.added)
    return found.most_common(1)[0][0] if 2 * found.total() > len(taken) else 0


def renamed(taken: Recording, name: str) -> Recording:
    """Return a recording under another name; the names of its pieces, which begin with the old one, change too."""
    if name == taken.name:
        return taken

    def other(piece: Piece) -> Piece:
        return piece._replace(clip=replace(piece.clip, name=name + piece.clip.name[len(taken.name) :]))

    faults = tuple(replace(fault, clip=name) for fault in taken.faults)
    pieces, images = tuple(map(other, taken.pieces)), tuple(map(other, taken.images))
    return taken._replace(name=name, faults=faults, pieces=pieces, images=images)


def take_clip(other: Corpus, clip: Clip, rate: float | None) -> Source:
    """Take a clip of another corpus as it is, or resampled at `rate`."""
    motion = other.motion(clip)
    return Source(motion if rate in (None, other.rate) else motion.resample(rate), other.recording(clip), clip)


def as_piece(source: Source, between: int) -> Piece:
    """Return a clip with `between` frames of detail between its postures."""
    postures, recording, clip = source
    return Piece(clip, postures.rotations, postures.root, postures.times, _detail(postures, recording, between))


def mirror_image(source: Source, between: int) -> Piece:
    """Return a clip with left and right exchanged, as `as_piece`; SkeletonError if the body has no sides."""
    postures, recording, clip = source
    try:
        partners = find_sides(postures.skeleton).partners
        image = Source(mirrored(postures), mirrored(recording), _mirrored_clip(clip, postures, partners))
    except SkeletonError as error:
        raise SkeletonError(f"{clip.label}: {error}") from None
    return as_piece(image, between)


def frames_between(rate: float | None) -> int:
    """Return the number of frames of detail between two postures."""
    return max(round(30.0 / rate) - 1, 0) if rate else 0


def posture_rate(motion: Motion) -> float | None:
    """Return the postures a second to take of a motion; None, every frame, for keyframes."""
    return None if motion.keyframed or motion.fps < FILM_FPS else POSTURE_RATE_FPS


# --- helpers ----------------------------------------------------------------------------------------------------------


def _detail(postures: Motion, recording: Motion, between: int) -> NDArray[np.float16]:
    """Return a recording's departures from the spline through its postures [N, between, J, 3], rotation vectors.

    They are 0 after the last posture, if each frame is a posture, and for a joint throughout a move in which it departs
    by more than 30 degrees.
    """
    count, joints = len(postures), len(postures.skeleton)
    out = np.zeros((count, between, joints, 3), np.float16)
    if between > 0 and 1 < count < len(recording) and recording.fps >= _DETAIL_MIN_FPS:
        times = subdivide_times(postures.times, between)
        spline = rotation_spline(postures.times, postures.rotations, times)
        recorded = recording if np.array_equal(recording.times, times) else recording.at(times)
        detail = rot.log(rot.inv_mul(spline, recorded.rotations))
        detail = detail[:-1].reshape(count - 1, between + 1, joints, 3)[:, 1:]
        faulty = np.linalg.norm(detail, axis=-1).max(axis=1) > np.radians(30.0)
        out[:-1] = np.where(faulty[:, None, :, None], 0.0, detail)
    return out


def _cut(
    motion: Motion, cuts: Sequence[int], rate: float | None, whole: Clip, dropped: Collection[int]
) -> list[Source]:
    """Cut a recording before the frames `cuts`, and take its parts' postures; `whole` is its clip.

    Parts are numbered. Leave out parts that begin at `dropped` frames, and parts of a single posture: they have no
    move.
    """
    parts = [motion.slice(a, b) for a, b in pairwise([0, *cuts, len(motion)]) if a not in dropped]
    pieces = []
    for number, part in enumerate(parts, start=1):
        name = f"{motion.name}.{number}" if cuts else motion.name
        postures = replace(part if rate is None else part.resample(rate), name=name)
        if len(postures) > 1 or not cuts:
            first, last = part.times[0], part.times[-1]
            within = tuple(one for one in whole.repairs if one.seconds[0] <= last and first <= one.seconds[1])
            clip = replace(whole, name=name, repairs=within)
            pieces.append(Source(postures, _with_detail(postures, part, rate), clip))
    return pieces


def _with_detail(postures: Motion, part: Motion, rate: float | None) -> Motion:
    """Return a part of a recording at the times of its detail only: hours of recording would fill the memory."""
    between = frames_between(rate)
    if between == 0 or len(postures) == 1 or part.fps < _DETAIL_MIN_FPS:
        return postures
    return part.at(subdivide_times(postures.times, between))


def _later(repairs: Iterable[JointRepair], frames: int) -> tuple[JointRepair, ...]:
    """Return the repairs with their frame numbers increased by `frames`."""
    return tuple(replace(one, start=one.start + frames, stop=one.stop + frames) for one in repairs)


def _mirrored_clip(clip: Clip, postures: Motion, partners: Ints) -> Clip:
    """Return a clip with left and right exchanged, given each joint's partner on the other side [J]."""
    names = postures.skeleton.names
    opposite = {name: names[partner] for name, partner in zip(names, partners, strict=True)}
    repairs = tuple(replace(repair, joint=opposite[repair.joint]) for repair in clip.repairs)
    return replace(clip, mirrored=True, repairs=repairs)
