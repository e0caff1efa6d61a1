"""The settings of a project, each as the edit that changes it: title, corpus, tempo, music, video and stage."""

from __future__ import annotations

from typing import Annotated, Any

import msgspec
import numpy as np

from motionmind.body.stage import STAGE_RANGE_M
from motionmind.music.beats import MAX_BEATS, Beats
from motionmind.studio.asks import Name

MIN_TEMPO, MAX_TEMPO = 20.0, 300.0  # counts a minute
Tempo = Annotated[float, msgspec.Meta(ge=MIN_TEMPO, le=MAX_TEMPO)]
Shift = Annotated[float, msgspec.Meta(ge=-36_000.0, le=36_000.0)]  # seconds of a video or music at the piece's start
Counts = Annotated[int, msgspec.Meta(ge=2, le=16)]  # of a phrase: dancers count eights
Side = Annotated[float, msgspec.Meta(ge=STAGE_RANGE_M[0], le=STAGE_RANGE_M[1])]  # of a stage, metres


class Setting(msgspec.Struct, frozen=True, tag_field="edit", forbid_unknown_fields=True):
    """An edit of a setting; the field `edit` of its JSON gives its kind."""

    @property
    def place(self) -> str:
        """The part of the project that it changes."""
        return f"/{self.__struct_config__.tag}"


class SetCorpus(Setting, frozen=True, tag="corpus"):
    """Judge and smooth the piece with another corpus."""

    name: Name


class SetTempo(Setting, frozen=True, tag="tempo"):
    """Count the piece by another tempo."""

    tempo: Tempo
    counts: Counts = 8


class SetReference(Setting, frozen=True, tag="reference"):
    """Show a video beside the piece, by its path, or none; `begins` is its time at the piece's start, seconds."""

    path: Annotated[str, msgspec.Meta(max_length=4_096)] = ""
    begins: Shift = 0.0


class SetMusic(Setting, frozen=True, tag="music"):
    """Play music with the piece, by its path, or none.

    Attributes:
        path: the file; "" for none.
        begins: time of the music at the piece's start, seconds.
        beats: times of its beats, seconds of the music; two or more, or none if unknown.
        first: index of the beat that is count 1.
    """

    path: Annotated[str, msgspec.Meta(max_length=4_096)] = ""
    begins: Shift = 0.0
    beats: Annotated[tuple[Shift, ...], msgspec.Meta(max_length=MAX_BEATS)] = ()
    first: Annotated[int, msgspec.Meta(ge=0)] = 0

    @property
    def counting(self) -> Beats | None:
        """The beats; None if they are unknown. MotionMindError if they are not in order."""
        return Beats(np.array(self.beats), first=self.first) if self.beats else None


class SetStage(Setting, frozen=True, tag="stage"):
    """Draw the edge of the stage, around the origin: its width and depth, metres; None for no stage."""

    size: tuple[Side, Side] | None = None


class SetTitle(Setting, frozen=True, tag="title"):
    """Rename the piece."""

    title: Annotated[str, msgspec.Meta(max_length=200)]


def changes_of(setting: Setting) -> dict[str, Any]:
    """Return the fields of the project's state that a setting changes; MotionMindError if beats are not in order."""
    match setting:
        case SetCorpus(name):
            return {"corpus": name}
        case SetMusic():
            _ = setting.counting  # raises
            return {"music": setting}
        case SetReference():
            return {"reference": setting}
        case SetStage(size):
            return {"stage": size}
        case _:
            return msgspec.structs.asdict(setting)
