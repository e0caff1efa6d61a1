"""Find the movement that commands draw or vary: in files of movement, scores and corpora."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from motionmind.cli.files import read, read_mapping
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from motionmind.body.motion import Motion


def is_collection(source: Path, home: Path | None) -> bool:
    """Return whether a source is a score, a corpus's name or folder, or CORPUS/CLIP; otherwise it is a file of one
    movement, whose suffix gives its format."""
    from motionmind.corpus.store import list_corpora

    return (
        source.suffix.lower() in (".score", "") or source.is_dir() or split_clip(source, home)[0] in list_corpora(home)
    )


def split_clip(source: Path, home: Path | None) -> tuple[str, str | None]:
    """Split CORPUS/CLIP into the corpus's name and the clip's; return any other source as it is, with None."""
    from motionmind.corpus.store import list_corpora

    name, *clip = source.parts or (str(source),)
    if clip and name in list_corpora(home) and not source.exists():
        return name, "/".join(clip)
    return str(source), None


def read_movements(source: Path, names: Sequence[str], home: Path | None, **options: Any) -> list[Motion]:
    """Read the movement of a file, or clips of a score or a corpus.

    Args:
        source: a file of movement, a score, a corpus's name or folder, or CORPUS/CLIP.
        names: the clips to read; empty for all.
        home: the folder of the user's corpora; None for the usual one.
        options: values of the options that `options.reading` adds; they are for files of movement alone.

    Raises:
        MotionMindError: the source cannot be read, there is no such clip, or an option is not for this source.
    """
    has_clips = is_collection(source, home)
    if names and not has_clips:
        raise MotionMindError(f"{source}: --clip chooses from a score or a corpus")
    for name, value in options.items():
        if has_clips and value is not None:
            raise MotionMindError(f"{source}: --{name.replace('_', '-')} is for a file of movement, which this is not")
    return _read_clips(source, names, home) if has_clips else [_read_file(source, **options)]


def read_movement(source: Path, name: str | None, home: Path | None, **options: Any) -> Motion:
    """Read the only movement of a source, or the clip of this name; arguments and errors as of `read_movements`."""
    found = read_movements(source, (name,) if name else (), home, **options)
    if len(found) != 1:
        raise MotionMindError(f"{source}: holds {len(found)} clips; choose one by --clip")
    return found[0]


def _read_file(path: Path, joints: Path | None, **source: Any) -> Motion:
    """Read the movement in a file, on human23 if its joints map to it."""
    from motionmind.retarget.retarget import own_skeleton

    return own_skeleton(read(path, **source), read_mapping(joints))


def _read_clips(source: Path, wanted: Sequence[str], home: Path | None) -> list[Motion]:
    """Read the wanted clips of a score or a corpus, or all."""
    if source.suffix.lower() == ".score":
        from motionmind.notation.compose import motions
        from motionmind.notation.read import read_score

        score = read_score(source)
        written = {clip.name: clip for clip in score.clips}
        return motions(score, [written[name] for name in _choose(source, list(written), wanted)])
    from motionmind.learned.model import LearnedCorpus

    name, clip = split_clip(source, home)
    if clip is not None:
        if wanted:
            raise MotionMindError(f"{source}: names a clip, and so does --clip; give one of them")
        wanted = [clip]
    corpus = LearnedCorpus.load(name, home).corpus
    clips = {clip.label: clip for clip in corpus.clips}
    return [replace(corpus.motion(clips[label]), name=label) for label in _choose(source, list(clips), wanted)]


def select_frames(clip: Path | str, length: int, start: int, end: int) -> range:
    """Return the frames of a clip from `start` to `end`, both included and negative if counted from the end.

    Args:
        clip: the clip's name, for messages.
        length: the number of its frames.
        start: the first frame.
        end: the last frame.

    Raises:
        MotionMindError: there is no such frame, or `end` lies before `start`.
    """
    first, last = (frame + length if frame < 0 else frame for frame in (start, end))
    for frame, given in ((first, start), (last, end)):
        if not 0 <= frame < length:
            raise MotionMindError(f"{clip}: frames are 0 to {length - 1}, there is no frame {given}")
    if last < first:
        raise MotionMindError(f"{clip}: the last frame, {end}, lies before the first, {start}")
    return range(first, last + 1)


def _choose(source: Path, names: Sequence[str], wanted: Sequence[str]) -> Sequence[str]:
    """Return the wanted names without repetitions, or all; MotionMindError if there is no such name."""
    from motionmind.errors import did_you_mean, enumerated

    if not names:
        raise MotionMindError(f"{source}: holds no clips")
    for name in wanted:
        if name not in names:
            raise MotionMindError(
                f"{source}: no clip {name!r}{did_you_mean(name, names)}; there are {enumerated(names, 60)}"
            )
    return list(dict.fromkeys(wanted)) or names
