"""Read motion files in worker processes and store the recordings as shards, so that an interrupted build can resume.

A shard holds what `motionmind.corpus.recordings.take` made of one file. Its name is a hash of everything that it
depends on: the file's bytes and name, the options, and the package's code. It lists the other files that were read for
it (a skeleton, an included score) with their hashes. So an existing shard is valid whichever process wrote it, and
workers return only its name. Workers and client must share the disk.

    shards/mine/3f/3f9a...npz      for the corpus "mine", until it is built
"""

from __future__ import annotations

import hashlib
import io
import shutil
import threading
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.clip_names import CLIP_SUFFIXES, split_clip
from motionmind.corpus import store, versions
from motionmind.corpus.clip import Clip, JointFlip
from motionmind.corpus.fingerprint import code_name
from motionmind.corpus.kept import MOVEMENT
from motionmind.corpus.manifest import BodyEntry
from motionmind.corpus.recordings import Piece, Recording, Taking, take
from motionmind.errors import CorpusError, MotionMindError, MotionMindWarning
from motionmind.executors.team import Team, UnfinishedError
from motionmind.files import make_folder, name_of, read_bytes, reads_recorded, replace_file

_ONE_AT_A_TIME = threading.Lock()  # all threads of a process share Python's list of warnings


@dataclass(frozen=True)
class Reading:
    """Options for reading and taking files.

    Attributes:
        taking: the options of `take`.
        joints: {file's joint: human23's joint}; None recognises rigs by name.
        unit, asf, fps, up: as for `read_motion`.
    """

    taking: Taking
    joints: dict[str, str] | None = None
    unit: str | None = None
    asf: str | None = None
    fps: float | None = None
    up: str | None = None


class Job(NamedTuple):
    """A file to take.

    Attributes:
        file: its path.
        name: its clip's name; a score names its own clips, and clips of a glTF file with several add theirs to it.
        reading: the options.
        folder: the shards' folder.
        code: hash of the package's code (`code_name`).
        clip: the clip of a glTF file to take; None for all.
    """

    file: Path
    name: str
    reading: Reading
    folder: Path
    code: str
    clip: str | None = None

    def __str__(self) -> str:
        return str(self.file) if self.clip is None else f"{self.file}#{self.clip}"


class Taken(NamedTuple):
    """The result of taking a file.

    Attributes:
        key: the shard's name; "" if there is none.
        size: the shard's size, bytes.
        fault: why the file cannot be read or taken; "" if it was taken.
        body: a hash of its joints' names and parents.
    """

    key: str
    size: int = 0
    fault: str = ""
    body: str = ""


class _RecordingEntry(msgspec.Struct, frozen=True):
    """A recording without its arrays: attributes as in Recording; each clip has its range in the arrays."""

    name: str
    body: BodyEntry
    rate: float | None
    doubt: str
    faults: tuple[JointFlip, ...]
    pieces: tuple[Clip, ...]
    images: tuple[Clip, ...]
    added: int
    floor: float
    is_made: bool


class _Entry(msgspec.Struct, frozen=True):
    """A shard without its arrays: the recordings, warnings about them, and the hashes of the other files read."""

    recordings: tuple[_RecordingEntry, ...]
    warnings: tuple[str, ...]
    read: dict[str, str]


# --- the client -------------------------------------------------------------------------------------------------------


@contextmanager
def shards_of(name: str, home: Path | None) -> Iterator[Path]:
    """Hold the folder of a corpus's shards until the context ends; then remove it, unless another build holds it.

    It is kept after Ctrl-C, a full disk or the loss of workers, so that the build can resume, but not after bad input.

    Raises:
        CorpusError: it cannot be made.
    """
    folder = store.unfinished(name, home)
    place = folder.parents[1]
    above = [folder.parent, *([] if place.exists() else [place])]
    there = False
    try:
        while not there:  # another build may have removed it before it was held
            make_folder(folder)
            with versions.hold(folder) as there:
                if there:
                    yield folder
    except OSError as error:
        raise CorpusError(f"{folder}: cannot be written: {error.strerror or error}") from error
    except MotionMindError as error:
        if not isinstance(error, UnfinishedError) and not isinstance(error.__cause__, OSError):
            _remove(folder, above)
        raise
    _remove(folder, above)


def _remove(folder: Path, above: Sequence[Path]) -> None:
    """Remove a folder of shards that no build holds, and the folders `above` it if they are empty."""
    versions.remove_unused(folder)
    with suppress(OSError):
        for one in above:
            one.rmdir()


def take_files(
    names: Mapping[Path, str],
    reading: Reading,
    folder: Path,
    team: Team,
    *,
    on_need: Callable[[float], None],
    on_taken: Callable[[Taken], None],
    on_odd: Callable[[str], None],
) -> Iterator[Recording]:
    """Let workers take all files without a shard; then yield the recordings in the order of the files.

    Files on another skeleton than most are left out; of equally frequent skeletons the first counts.

    Args:
        names: the clip's name for each file.
        reading: the options.
        folder: the shards' folder.
        team: the workers.
        on_need: called once a file of each format was taken, with the estimated bytes of the corpus and its shards on
            disk.
        on_taken: called for each file; an exception from it ends the work.
        on_odd: called with a message for each file on another skeleton; an exception from it ends the work.

    Warns:
        MotionMindWarning: warnings of the readers.

    Raises:
        CorpusError: no file can be read, the disk lacks space, or workers do not share it.
        UnfinishedError: a file crashes workers again and again, or workers are out of reach.
    """
    code = code_name()
    parts = [(split_clip(file), name) for file, name in names.items()]
    jobs = [Job(Path(place), name, reading, folder, code, clip) for (place, clip), name in parts]
    done: dict[str, Taken] = {}

    def work(some: Sequence[Job]) -> None:
        # A pipe can be read once, and by this process alone.
        ours = [job for job in some if not job.file.is_file()]
        theirs = [job for job in some if job.file.is_file()]
        for job, taken in zip(ours, map(take_file, ours), strict=True):
            done[str(job)] = taken
            on_taken(taken)
        for job, taken in zip(theirs, team.map(take_file, theirs), strict=True):
            done[str(job)] = taken
            on_taken(taken)

    samples = list({job.file.suffix.lower(): job for job in reversed(jobs)}.values())
    work(samples)
    if (needed := _needed(jobs, done)) > 0.0:
        present = sum(file.stat().st_size for file in folder.rglob("*.npz"))
        on_need(needed)
        free = shutil.disk_usage(folder).free
        if needed - present > free:
            raise CorpusError(
                f"{folder}: the corpus needs about {needed / 1e9:.1f} GB of disk, and {free / 1e9:.1f} GB are free"
            )
    work([job for job in jobs if str(job) not in done])
    readable = [job for job in jobs if done[str(job)].key]
    if jobs and not readable:
        raise CorpusError(done[str(jobs[0])].fault)
    bodies = Counter(done[str(job)].body for job in readable)
    usual = max(readable, key=lambda job: bodies[done[str(job)].body], default=None)  # the first of them
    for job in readable:
        if usual and done[str(job)].body != done[str(usual)].body:
            on_odd(_differs(job, usual, done))
        else:
            yield from _recordings(job, done[str(job)])


def _differs(job: Job, usual: Job, done: Mapping[str, Taken]) -> str:
    """Say how the skeleton of a file differs from that of another."""
    body, other = (_shard(one, done[str(one)])[0][0].body for one in (usual, job))
    return (
        f"{job.file}: is on another skeleton than {usual.file}: {body.difference(other)}; a corpus has one (a mapping "
        "of joints may bring it there)"
    )


def _needed(jobs: Sequence[Job], samples: Mapping[str, Taken]) -> float:
    """Estimate the bytes on disk that all files need, from one of each format."""
    shares = {
        job.file.suffix.lower(): samples[str(job)].size / max(_size(job.file), 1) for job in jobs if str(job) in samples
    }
    # 7 bytes per byte of shards: the shards, the corpus's arrays, and what is learned
    return 7.0 * sum(shares[job.file.suffix.lower()] * _size(job.file) for job in jobs)


def _size(file: Path) -> int:
    return file.stat().st_size if file.is_file() else 0


def _recordings(job: Job, taken: Taken) -> Iterator[Recording]:
    """Read a shard, and repeat its warnings."""
    recordings, said = _shard(job, taken)
    for text in said:
        warnings.warn(text, MotionMindWarning, stacklevel=2)
    yield from recordings


def _shard(job: Job, taken: Taken) -> tuple[list[Recording], tuple[str, ...]]:
    """Read a shard; if it was lost or damaged, write it again first."""
    found = _open(job, taken.key)
    if found is None:
        found = _open(job, take_file(job).key)
    if found is None:
        raise CorpusError(f"{job.folder}: the shard of {job.file} is not there: workers must share this disk")
    return found


# --- a worker ---------------------------------------------------------------------------------------------------------


def take_file(job: Job) -> Taken:
    """Take a file, unless its shard exists; return the shard's name, or why the file cannot be taken.

    Raises:
        UnfinishedError: the shard cannot be written.
        CorpusError: this worker runs another version of the package.
    """
    if job.code != code_name():
        raise CorpusError(
            "a worker of the cluster has another version of MotionMind; all must be as this one for the same result"
        )
    with _ONE_AT_A_TIME:
        try:
            key = _key(job)
            if (found := _open(job, key)) is None:
                with warnings.catch_warnings(record=True) as raised, reads_recorded() as read:
                    warnings.simplefilter("always", MotionMindWarning)
                    recordings = [take(motion, job.reading.taking) for motion in _read(job)]
                said = tuple(str(one.message) for one in raised if issubclass(one.category, MotionMindWarning))
        except MotionMindError as error:
            return Taken("", fault=str(error))
        path = _place(job.folder, key)
        try:
            if found is None:
                read.pop(str(job.file.absolute()), None)  # readers of other packages may open it themselves
                make_folder(path.parent)
                replace_file(path, _encode(recordings, said, read))
            first = (found[0] if found else recordings)[:1]
            return Taken(key, path.stat().st_size, body="".join(_body_key(one.body) for one in first))
        except OSError as error:
            raise UnfinishedError(
                f"{path.parent}: cannot be written: {error.strerror or error}; what is done is kept, and the same "
                "command goes on from there"
            ) from error


def _read(job: Job) -> Iterator[Motion]:
    """Read the movement of a file; on human23 if its joints map to it."""
    from motionmind.body.motion import Insertion
    from motionmind.formats import read_clips
    from motionmind.formats.bvh import has_inserted_frames
    from motionmind.notation.compose import motions
    from motionmind.notation.read import read_score
    from motionmind.retarget.retarget import own_skeleton

    if job.file.suffix.lower() == ".score":
        yield from motions(read_score(job.file))
        return
    options = job.reading
    up = "y" if options.up else None
    has_moves = False
    for motion in read_clips(str(job), unit=options.unit, asf=options.asf, fps=options.fps, up=options.up):
        has_clips = job.file.suffix.lower() in CLIP_SUFFIXES
        clip = motion.name.removeprefix(name_of(job.file)) if has_clips and job.clip is None else ""  # "#Dance"
        doubt = f"{job}{clip}: holds one posture, and no move to learn from"
        if len(motion) == 1 and clip:
            warnings.warn(f"{doubt}; left out", MotionMindWarning, stacklevel=2)
            continue
        if len(motion) == 1:
            if options.taking.skip:  # it would drop the posture
                raise CorpusError(doubt)
            warnings.warn(doubt, MotionMindWarning, stacklevel=2)
        if job.file.suffix.lower() == ".bvh" and has_inserted_frames(job.file):
            motion = replace(motion, insertions=(Insertion(motion.times),))  # noqa: PLW2901
        has_moves = True
        yield own_skeleton(replace(motion, name=f"{job.name}{clip}"), options.joints, up=up)
    if not has_moves:
        raise CorpusError(f"{job}: its clips hold one posture each, and no move to learn from")


def _key(job: Job) -> str:
    data = hashlib.sha256(read_bytes(job.file)).hexdigest()
    depends = (job.code, job.file.suffix.lower(), job.clip, job.name, job.reading, data)
    return hashlib.sha256(msgspec.json.encode(depends)).hexdigest()


def _body_key(body: Skeleton) -> str:
    return hashlib.sha256(msgspec.json.encode((body.names, body.parents))).hexdigest()


def _place(folder: Path, key: str) -> Path:
    return folder / key[:2] / f"{key}.npz"


# --- shards on disk ---------------------------------------------------------------------------------------------------


def _encode(recordings: Sequence[Recording], said: tuple[str, ...], read: dict[str, str]) -> bytes:
    """Encode a shard: recordings, warnings about them, and the hashes of the other files read."""
    arrays: dict[str, Any] = {}
    entries = []
    for number, one in enumerate(recordings):
        pieces = [*one.pieces, *one.images]
        stops = np.cumsum([0, *(len(piece.times) for piece in pieces)]).tolist()
        clips = tuple(
            replace(piece.clip, start=start, stop=stop)
            for piece, start, stop in zip(pieces, stops[:-1], stops[1:], strict=True)
        )
        for name in MOVEMENT if pieces else ():
            arrays[f"{name}{number}"] = np.concatenate([getattr(piece, name) for piece in pieces])
        body = one.body
        entry = BodyEntry(body.name, body.names, body.parents, body.offsets.tolist(), body.tips.tolist())
        split = len(one.pieces)
        kept = one.rate, one.doubt, one.faults, clips[:split], clips[split:], one.added, one.floor, one.is_made
        entries.append(_RecordingEntry(one.name, entry, *kept))
    about = msgspec.json.encode(_Entry(tuple(entries), said, read))
    out = io.BytesIO()
    np.savez(out, about=np.frombuffer(about, np.uint8), **arrays)
    return out.getvalue()


def _open(job: Job, key: str) -> tuple[list[Recording], tuple[str, ...]] | None:
    """Return a shard's recordings and warnings; None if it is missing or damaged, or another file has changed."""
    try:
        with np.load(io.BytesIO(_place(job.folder, key).read_bytes()), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        entry = msgspec.json.decode(arrays["about"].tobytes(), type=_Entry)
        if any(hashlib.sha256(read_bytes(path)).hexdigest() != known for path, known in entry.read.items()):
            return None
    except Exception:  # a damaged archive can raise anything
        return None
    return [_decode(one, number, arrays) for number, one in enumerate(entry.recordings)], entry.warnings


def _decode(entry: _RecordingEntry, number: int, arrays: Mapping[str, NDArray[Any]]) -> Recording:
    body = entry.body
    skeleton = Skeleton(body.name, body.names, body.parents, np.array(body.offsets), np.array(body.tips))

    def pieces(clips: Sequence[Clip]) -> tuple[Piece, ...]:
        return tuple(
            Piece(
                replace(clip, start=0, stop=0),
                *(arrays[f"{name}{number}"][clip.start : clip.stop] for name in MOVEMENT),
            )
            for clip in clips
        )

    both = pieces(entry.pieces), pieces(entry.images)
    found = Recording(entry.name, skeleton, entry.rate, entry.doubt, entry.faults, *both, entry.added, entry.floor)
    return found._replace(is_made=entry.is_made)
