"""Read, write and check the files that commands name."""

from __future__ import annotations

import os
import warnings
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from motionmind.cli.printing import note
from motionmind.clip_names import split_clip
from motionmind.errors import MotionMindError, MotionMindWarning, SkeletonError
from motionmind.files import FilePath, all_or_none, as_text
from motionmind.render import PICTURES, may_sound

if TYPE_CHECKING:
    from motionmind.body.motion import Motion, Posture
    from motionmind.music import Sound

MOTION_SUFFIXES = (".json", ".bvh", ".glb", ".npz", ".vrma")
EVEN_SUFFIXES = (".bvh", ".npz")  # formats with evenly spaced frames
_DEFAULT_FPS = 30.0  # rate of motions resampled for these formats
_SPARSE_FPS = 5.0  # the rate of a corpus's postures; slower frames are keys


def read(path: FilePath, unit: str | None, asf: Path | None, source_fps: float | None, up: str | None) -> Motion:
    """Read a motion file, given the values of the options that `options.reading` adds."""
    from motionmind.formats import read_motion

    return read_motion(path, unit=unit, asf=asf, fps=source_fps, up=up)


def question_recording(path: FilePath, motion: Motion, up: str | None = None) -> None:
    """Warn if the movement in a file contradicts its frame rate, drops frames, or stands off the floor, y = 0.

    Args:
        path: the file, with its clip if it has several.
        motion: its movement; joints that do not map to human23 are not checked.
        up: the axis that is up in the movement; None finds it.
    """
    from motionmind.body.human import SHORTEST_PERSON_M, TALLEST_PERSON_M
    from motionmind.body.rates import FILM_FPS
    from motionmind.body.tempo import question_tempo
    from motionmind.corpus.dropped import describe_gaps, fill_gaps
    from motionmind.corpus.recordings import FLOOR_OFFSET_M, added_frames, floor_of
    from motionmind.retarget.joint_mapping import joint_mapping
    from motionmind.retarget.retarget import own_skeleton

    if motion.keyframed or motion.insertions or joint_mapping(motion.skeleton) is None:
        return
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MotionMindWarning)  # retargeting to human23 warns later
            person = own_skeleton(motion, up=up)
    except SkeletonError:  # its zero pose does not show how it stands
        return
    added = added_frames(person)
    doubts = [gaps] if (gaps := describe_gaps(person, added)) else []
    if clock := question_tempo(fill_gaps(person, added).motion if gaps else person):
        doubts.append(f"seems to play {clock} (check the frames per second, --source-fps, and the unit)")
    is_long = person.fps >= FILM_FPS and len(person) - added > person.fps
    if is_long and SHORTEST_PERSON_M <= person.skeleton.height <= TALLEST_PERSON_M:  # else the unit is wrong
        floor = floor_of(person.slice(added, len(person)))
        if abs(floor) > FLOOR_OFFSET_M:
            where = "above" if floor > 0.0 else "below"
            doubts.append(f"the floor under its feet is {100.0 * abs(floor):.0f} cm {where} 0")
    for doubt in doubts:
        warnings.warn(f"{path}: {doubt}", MotionMindWarning, stacklevel=2)


def write(path: Path, movement: Motion | Posture, source: Path | None = None, sound: Sound | None = None) -> None:
    """Write a motion or a posture as movement or as a picture, by the suffix of `path`; note the data left out.

    Args:
        path: the file.
        movement: the motion or the posture.
        source: the file that the movement comes from, whose other data may be left out, too; None for none.
        sound: the sound of a film or a page; None for none.
    """
    from motionmind.body.motion import Posture
    from motionmind.formats import lossy_fields, write_motion, write_posture
    from motionmind.render.pictures import draw_picture

    motion = movement.as_motion() if isinstance(movement, Posture) else evened(path, movement)
    note_licences(path, motion)
    if path.suffix.lower() in PICTURES:
        draw_picture(path, motion, sound=sound if may_sound(path) else None)
        return
    if isinstance(movement, Posture):
        write_posture(path, movement)
    else:
        write_motion(path, motion)
    note_lossy_fields(path, lossy_fields(motion, path, source))


def note_licences(path: Path, motion: Motion) -> None:
    """Note the licences of a motion's sources that restrict its distribution."""
    from motionmind.credits.ledger import objections

    for objection in objections(motion.credits):
        note(f"{path}: {objection}")


def evened(path: Path, motion: Motion) -> Motion:
    """Return a motion as its file can hold it: resampled, with a note, if the format needs evenly spaced frames.

    Evenly spaced keys are resampled, too, unless their rate is stated or chosen: programs play frames, and show no
    movement between frames that are seconds apart.
    """
    is_sparse = len(motion) > 1 and motion.fps < _SPARSE_FPS - 1e-6 and not motion.rate
    if path.suffix.lower() not in EVEN_SUFFIXES or (motion.is_even and not is_sparse):
        return motion
    even = motion.stretch_to(_DEFAULT_FPS)
    note(
        f"{path}: this format needs {'frames, not keys' if motion.is_even else 'evenly spaced frames'}: resampled "
        f"{len(motion)} frames to {len(even)}, {_DEFAULT_FPS:g} per second (--fps sets another rate)"
    )
    return even


def write_all(paths: Sequence[Path], movement: Motion | Posture) -> None:
    """Write a motion or a posture to several files as `write` does, or to none if one cannot be written."""
    with all_or_none():
        for path in paths:
            write(path, movement)


def note_lossy_fields(path: Path, fields: Sequence[str]) -> None:
    """Note the fields of a motion that its file format cannot hold, if any."""
    if fields:
        note(f"{path}: no place for {'; '.join(fields)}")


def read_mapping(path: Path | None) -> dict[str, str] | None:
    """Read a mapping of joints to human23; None without a file."""
    from motionmind.retarget.retarget import read_joint_mapping

    return read_joint_mapping(path) if path else None


def clip_names(files: Sequence[Path]) -> dict[Path, str]:
    """Name each file's clip: by its stem, or by as much more of its path as tells it from the others.

    The name of a clip in a glTF file follows, as in "hero#Dance".

    Raises:
        MotionMindError: a file is given twice.
    """
    if len(set(files)) < len(files):
        repeated = next(file for file, number in Counter(files).items() if number > 1)
        raise MotionMindError(f"{repeated}: given twice")
    parts = {file: split_clip(file) for file in files}
    places = {file: Path(place) for file, (place, _) in parts.items()}
    ends = {file: "" if clip is None else f"#{clip}" for file, (_, clip) in parts.items()}
    schemes = [
        {file: f"{place.stem}{ends[file]}" for file, place in places.items()},
        {file: f"{place.name}{ends[file]}" for file, place in places.items()},
        {file: f"{place.with_suffix('').as_posix()}{ends[file]}" for file, place in places.items()},
    ]
    uses = [Counter(names.values()) for names in schemes]
    unique = ([names[f] for names, used in zip(schemes, uses, strict=True) if used[names[f]] == 1] for f in files)
    return {file: as_text(next(iter(names), file.as_posix())) for file, names in zip(files, unique, strict=True)}


def numbered(path: Path, number: int, count: int | None) -> Path:
    """Return the file of one of `count` tweens, as "out-1.json" of "out.json"; `path` itself if `count` is None."""
    return path if count is None else path.with_stem(f"{path.stem}-{number}")


def check_outputs(outputs: Sequence[tuple[Path, tuple[str, ...]]], sources: Sequence[Path]) -> list[Path]:
    """Check that files can be written, before any work.

    Args:
        outputs: files to write, each with its allowed suffixes; empty for any.
        sources: files to read.

    Returns:
        The paths of `outputs`.

    Raises:
        MotionMindError: a file has another suffix, is given twice or is also read, or its folder is not writable.
    """
    paths = [path for path, _ in outputs]
    places, read_places = [_resolve(path) for path in paths], [_resolve(path) for path in sources]
    for path, suffixes in outputs:
        folder = _resolve(path).parent
        if suffixes and not _is_one_of(path, suffixes):
            fault = f"the name must end in one of {', '.join(suffixes)}"
        elif places.count(_resolve(path)) > 1:
            fault = "it would be written twice"
        elif _resolve(path) in read_places:
            fault = "it is read from"
        elif not folder.is_dir():
            fault = f"there is no folder {folder}"
        elif not os.access(path if path.exists() else folder, os.W_OK):
            fault = "not permitted"
        else:
            continue
        raise MotionMindError(f"{path}: cannot be written: {fault}")
    return paths


def _is_one_of(path: Path, suffixes: tuple[str, ...]) -> bool:
    """Return whether a file has one of some suffixes; for movement, also one of a plug-in format."""
    suffix = path.suffix.lower()
    if suffix in suffixes or ".bvh" not in suffixes:
        return suffix in suffixes
    from motionmind.plugins import added

    return suffix.removeprefix(".") in added("motionmind.formats")


def _resolve(path: Path) -> Path:
    """Resolve a path; MotionMindError if it is invalid, such as a cycle of links."""
    try:
        found = path.resolve()
        found.exists()
    except (OSError, RuntimeError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or "it leads nowhere"
        raise MotionMindError(f"{path}: cannot be used: {reason[0].lower()}{reason[1:]}") from error
    return found
