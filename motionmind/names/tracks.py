"""Find the sound of named movement: the file that a clip of a score names, or the one beside a file."""

from __future__ import annotations

from pathlib import Path

from motionmind.errors import FormatError
from motionmind.music.sound import sound_beside
from motionmind.names.finding import locate_score
from motionmind.names.spelling import Source
from motionmind.notation.read import read_score


def find_sound(source: Source, clip: str | None = None, home: Path | None = None) -> Path | None:
    """Return the sound track of a source's movement, as clip.wav beside clip.bvh; None for silence.

    Args:
        source: where the movement is; a corpus has no sound.
        clip: the clip, if the source does not name one; None for the only one.
        home: the folder of the user's corpora; None for the default folder.

    Raises:
        FormatError: the score is invalid, or there is no file as a clip names.
    """
    if source.kind == "corpus":
        return None
    if source.kind == "file":
        return sound_beside(Path(source.place))
    path = locate_score(source.place, home)
    wanted = source.name or clip
    found = [one for one in read_score(path).clips if wanted in (None, one.name)]
    if len(found) != 1 or not found[0].sound:
        return sound_beside(path)
    track = path.parent / found[0].sound
    if not track.is_file():
        raise FormatError(f"clip {found[0].name}: there is no sound file {track}", path=path)
    return track
