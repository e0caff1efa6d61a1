"""Find the movement that commands draw, measure, convert or vary: in motion files, scores and corpora."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from motionmind.cli.files import question_recording, read, read_mapping
from motionmind.clip_names import CLIP_SUFFIXES, GLTF_SUFFIXES
from motionmind.errors import MotionMindError
from motionmind.files import name_of
from motionmind.names.spelling import PostureName, Source, parse_posture

if TYPE_CHECKING:
    from motionmind.body.motion import Motion


def parse_movement(word: str, home: Path | None) -> PostureName:
    """Parse the name of movement, or of one posture of it.

    Raises:
        MotionMindError: the name has a ~, or names neither a corpus nor a file.
    """
    from motionmind.names.finding import check_exists

    named = parse_posture(word, home)
    check_exists(named.source, home)
    if named.is_moving:
        raise MotionMindError(f"{word}: ~ is only for the ends of a tween; leave it out")
    return named


def read_movements(
    source: Source, names: Sequence[str], home: Path | None, *, raw: bool = False, whole: bool = False, **options: Any
) -> list[Motion]:
    """Read the movement of a file, or clips of a score, a corpus or a glTF file.

    Args:
        source: the source.
        names: the clips to read; empty for all, or of a glTF file for the usual one.
        home: the folder of the user's corpora; None for the default folder.
        raw: whether a file's movement keeps its own joints; else it is retargeted to human23 if they map to it.
        whole: whether empty `names` stand for all clips of a glTF file, too.
        options: values of the options that `options.reading` adds; only for motion files.

    Raises:
        MotionMindError: the source cannot be read, there is no such clip, or an option is not for this source.
    """
    from motionmind.names.finding import find_motion, open_collection

    has_clips = source.kind != "file"
    is_gltf = not has_clips and Path(source.place).suffix.lower() in GLTF_SUFFIXES
    if names and not (has_clips or is_gltf):
        raise MotionMindError(f"{source.word}: --clip is only for a score, a corpus or a glTF file")
    if names and source.name:
        raise MotionMindError(f"{source.word}: already names a clip; leave out --clip")
    for name, value in options.items():
        if has_clips and value is not None:
            option = name.replace("_", "-")
            raise MotionMindError(f"{source.word}: --{option} is only for motion files")
    if has_clips and not source.name:
        return open_collection(source, home).choose(names)
    if is_gltf and whole and not (names or source.name):
        from motionmind.formats import read_clips

        clips = read_clips(source.place, unit=options["unit"], up=options["up"])
        return [_on_human(spelled(source, one), one, options["joints"], options["up"]) for one in clips]
    read_file = partial(read if raw else _read_file, **options)
    sources = [replace(source, name=name) for name in dict.fromkeys(names)] or [source]
    return [find_motion(one, home, read=read_file) for one in sources]


def read_bodies(source: Source, joints: Path | None, **options: Any) -> list[Motion]:
    """Read all bodies of a BVH file, each on human23 if its joints map to it, in the space that they share."""
    from motionmind.formats import read_clips

    given = {"unit": options["unit"], "fps": options["source_fps"], "up": options["up"]}
    bodies = read_clips(source.place, **given)
    return [_on_human(spelled(source, one), one, joints, options["up"]) for one in bodies]


def spelled(source: Source, motion: Motion) -> str:
    """Return the spelling of a motion from a source: of one of several clips of a file with its name."""
    if source.kind == "file" and not source.name and Path(source.place).suffix.lower() in CLIP_SUFFIXES:
        return f"{source.word}{motion.name.removeprefix(name_of(source.place))}"
    return motion.name if source.kind != "file" and not source.name else source.word


def read_movement(source: Source, name: str | None, home: Path | None, **options: Any) -> Motion:
    """Read the only movement of a source, or the clip of this name; arguments and errors as of `read_movements`."""
    found = read_movements(source, (name,) if name else (), home, **options)
    if len(found) != 1:
        raise MotionMindError(
            f"{source.word}: holds {len(found)} clips; name one, such as {source.word}/{found[0].name}"
        )
    return found[0]


def read_part(named: PostureName, home: Path | None, **options: Any) -> Motion:
    """Read the named movement, or its named frame, like `read_movement`."""
    motion = read_movement(named.source, None, home, **options)
    frames = select_part(named, motion, 0, -1)
    return motion.slice(frames.start, frames.stop)


def select_part(named: PostureName, motion: Motion, start: int, end: int) -> range:
    """Return the frames of a motion from `start` to `end`, or the frame in its name.

    Args:
        named: the name.
        motion: the motion of that name, or one of several.
        start: the first frame; 0 by default.
        end: the last frame, included; negative if counted from the end; -1 by default.

    Raises:
        MotionMindError: there is no such frame, `end` is before `start`, or the name and they both select frames.
    """
    from motionmind.names.finding import select_frame, select_frames

    word = spelled(named.source, motion)
    if named.moment is None:
        return select_frames(word, len(motion), start, end)
    if (start, end) != (0, -1):
        raise MotionMindError(f"{named.word}: already names a frame; leave out --from and --to")
    frame = select_frame(word, motion, named.moment)
    return range(frame, frame + 1)


def ends_reader(
    sources: Sequence[Source], corpus: str, home: Path | None, **options: Any
) -> Callable[[Path | str], Motion]:
    """Return a reader of the files with the postures of a tween; it reads and checks each file once.

    It retargets whole motions, not single postures, because a motion shows better which axis is up and how a rig's
    joints are turned.

    Args:
        sources: the sources of the postures.
        corpus: the corpus of the tween.
        home: the folder of the user's corpora; None for the default folder.
        options: values of the options that `options.reading` adds.

    Raises:
        MotionMindError: an option is given, but no source is a motion file; or the corpus's manifest is damaged.
    """
    for name, value in options.items():
        if value is not None and all(source.kind != "file" for source in sources):
            raise MotionMindError(f"--{name.replace('_', '-')} is only for motion files, and no posture here is in one")
    stays = _has_own_joints(corpus, home) and not options["joints"]

    @cache
    def read_once(path: Path | str) -> Motion:
        if not stays:
            return _read_file(path, **options)
        return read(path, **{name: value for name, value in options.items() if name != "joints"})

    return read_once


def _has_own_joints(corpus: str, home: Path | None) -> bool:
    """Return whether a corpus has joints other than human23's."""
    from motionmind.body.human import human23
    from motionmind.corpus import store

    manifest = store.read_manifest(store.locate(corpus, home))
    body = manifest.get("skeleton")
    return isinstance(body, dict) and body.get("names") != list(human23().names)


def _read_file(path: Path | str, joints: Path | None, **source: Any) -> Motion:
    """Read a motion file, on human23 if its joints map to it."""
    return _on_human(path, read(path, **source), joints, source["up"])


def _on_human(path: Path | str, motion: Motion, joints: Path | None, up: str | None) -> Motion:
    """Return the movement of a file on human23 if its joints map to it, and question it."""
    from motionmind.retarget.retarget import own_skeleton

    person = own_skeleton(motion, read_mapping(joints), up=up and "y")
    question_recording(path, person)
    return person
