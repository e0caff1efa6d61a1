"""Where commands find the movement that they are to draw or to vary: files of movement, scores, corpora."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from motionmind.cli.files import read, read_mapping
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from motionmind.body.motion import Motion


def holds_clips(source: Path, home: Path | None) -> bool:
    """Whether it is a score, a corpus's name or folder, or CORPUS/CLIP; not a file of one movement, whose name says its
    format."""
    from motionmind.corpus.store import known

    return source.suffix.lower() in (".score", "") or source.is_dir() or in_corpus(source, home)[0] in known(home)


def in_corpus(source: Path, home: Path | None) -> tuple[str, str | None]:
    """The corpus that a source names, by name or folder, and the clip of it where it is CORPUS/CLIP."""
    from motionmind.corpus.store import known

    name, *clip = source.parts or (str(source),)
    if clip and name in known(home) and not source.exists():
        return name, "/".join(clip)
    return str(source), None


def movements(source: Path, wanted: Sequence[str], home: Path | None, **given: Any) -> list[Motion]:
    """The movement of a file, as the options of `reading` say; or the clips of a score or of a corpus, those that are
    wanted or all of them, to which these options say nothing."""
    many = holds_clips(source, home)
    if wanted and not many:
        raise MotionMindError(f"{source}: --clip chooses from a score or a corpus")
    for name, value in given.items():
        if many and value is not None:
            raise MotionMindError(f"{source}: --{name.replace('_', '-')} is for a file of movement, which this is not")
    return _clips(source, wanted, home) if many else [_movement(source, **given)]


def _movement(path: Path, joints: Path | None, **source: Any) -> Motion:
    """The movement in a file, on human23 where its joints map there, as the options of `reading` say."""
    from motionmind.retarget.retarget import own_skeleton

    return own_skeleton(read(path, **source), read_mapping(joints))


def _clips(source: Path, wanted: Sequence[str], home: Path | None) -> list[Motion]:
    """The clips of a score or of a corpus, those that are wanted or all of them."""
    if source.suffix.lower() == ".score":
        from motionmind.notation.compose import motions
        from motionmind.notation.read import read_score

        score = read_score(source)
        written = {clip.name: clip for clip in score.clips}
        return motions(score, [written[name] for name in _chosen(source, list(written), wanted)])
    from motionmind.learned.model import LearnedCorpus

    name, clip = in_corpus(source, home)
    if clip is not None:
        if wanted:
            raise MotionMindError(f"{source}: names a clip, and so does --clip; give one of them")
        wanted = [clip]
    corpus = LearnedCorpus.load(name, home).corpus
    clips = {clip.label: clip for clip in corpus.clips}
    return [replace(corpus.motion(clips[label]), name=label) for label in _chosen(source, list(clips), wanted)]


def frames_of(clip: Path | str, length: int, start: int, end: int) -> range:
    """The frames from `start` to `end`, both among them, of a clip of `length` frames; negative from the end."""
    first, last = (frame + length if frame < 0 else frame for frame in (start, end))
    for frame, given in ((first, start), (last, end)):
        if not 0 <= frame < length:
            raise MotionMindError(f"{clip}: frames are 0 to {length - 1}, there is no frame {given}")
    if last < first:
        raise MotionMindError(f"{clip}: --to {end} lies before --from {start}")
    return range(first, last + 1)


def _chosen(source: Path, names: Sequence[str], wanted: Sequence[str]) -> Sequence[str]:
    from motionmind.errors import did_you_mean, enumerated

    if not names:
        raise MotionMindError(f"{source}: holds no clips")
    for name in wanted:
        if name not in names:
            raise MotionMindError(
                f"{source}: no clip {name!r}{did_you_mean(name, names)}; there are {enumerated(names, 60)}"
            )
    return list(dict.fromkeys(wanted)) or names
