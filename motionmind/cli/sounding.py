"""The options of vary for beats and sound: --on-beat, --sound and --music."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

import click

from motionmind.cli.music import read_counts, sound_of_counts
from motionmind.errors import MotionMindError
from motionmind.render import PICTURES

if TYPE_CHECKING:
    from motionmind.music import Beats, Sound
    from motionmind.names.spelling import Source
    from motionmind.variation.variation import Variation

Sounds = Literal["own", "straight", "none"]
SOUNDS: tuple[Sounds, ...] = get_args(Sounds)


@dataclass(frozen=True)
class Sounding:
    """The sound of a variation, and its beats.

    Attributes:
        music: the file of --music, if any.
        beats: the beats of --music, or of --tempo for --on-beat.
        track: the sound track of the piece, if --sound asks for it.
        sound: the value of --sound.
    """

    music: Path | None
    beats: Beats | None
    track: Path | None
    sound: Sounds | None

    @property
    def files(self) -> list[Path]:
        """The files that are read."""
        return [path for path in (self.track, self.music) if path]

    def tracks(self, outputs: Sequence[Path]) -> list[Path]:
        """Return the sound tracks to write: one beside each output that holds movement."""
        beside = (path.with_suffix(".wav") for path in outputs if path.suffix.lower() not in PICTURES)
        return list(dict.fromkeys(beside)) if self.track else []

    def sound_of(self, variation: Variation, begins: float, outputs: Sequence[Path]) -> Sound | None:
        """Return the sound of a variation of a piece whose clip begins at `begins` seconds; None for silence."""
        if self.track is None:
            return None if self.sound == "none" else sound_of_counts(self.music, self.beats, outputs)
        from motionmind.music import read_sound
        from motionmind.variation.sounding import sound_of

        order: Literal["own", "straight"] = "own" if self.sound == "own" else "straight"
        return sound_of(variation, read_sound(self.track), order, begins)


def find_sounding(
    source: Source,
    clip: str | None,
    home: Path | None,
    *,
    sound: Sounds | None,
    music: Path | None,
    offset: float | None,
    tempo: float | None,
    on_beat: int | None,
) -> Sounding:
    """Read the beats of a variation, and find the sound track of its piece, a clip of a source.

    Raises:
        MotionMindError: the music cannot be read, or there is no sound track; a usage error if options lack others.
    """
    beats = read_counts(music, offset, tempo)
    if on_beat is not None and beats is None:
        if tempo is None:
            raise click.UsageError("--on-beat needs --tempo or --music")
        from motionmind.music.beats import beats_of_tempo

        beats = beats_of_tempo(tempo)
    track = None
    if sound in ("own", "straight"):
        from motionmind.music.sound import SOUND_SUFFIXES
        from motionmind.names.tracks import find_sound

        track = find_sound(source, clip, home)
        if track is None:
            kinds = ", ".join(SOUND_SUFFIXES)
            raise MotionMindError(
                f"--sound {sound} needs a motion file with its sound beside it, of the same name: {kinds}; or a clip "
                "of a score that names its sound"
            )
    return Sounding(music, beats, track, sound)
