"""The answers that the page's panels ask for: the gallery, variations, imports, corpora, poses and credits."""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from motionmind.studio.answers import Answer, Numbers, PartView, PieceView
from motionmind.studio.balance import Balance
from motionmind.studio.forecast import Forecast
from motionmind.studio.reading import ClipFacts, Fault
from motionmind.studio.uploads import Choices


class Listed(Answer):
    """A named posture."""

    key: str
    title: str


class ListedClip(Answer):
    """A clip of a corpus."""

    key: str
    title: str
    about: str
    frames: int
    seconds: float


class ListedCorpus(Answer):
    """A corpus in the gallery."""

    name: str
    postures: list[Listed]
    clips: list[ListedClip]


class Gallery(Answer):
    """The postures and clips to choose from; `whole` unless clips are still to come."""

    corpora: list[ListedCorpus]
    own: list[Listed]
    whole: bool


class Map(Answer):
    """A flow's attractor."""

    flow: str
    axes: Any
    points: Numbers
    about: str


class Variation(Answer):
    """A variation of the piece; `unlimited` says why insertions could not be limited as requested, if so.

    `forecast` is None if the corpus cannot tell how long insertions take.
    """

    piece: PieceView
    original: list[PartView]
    places: list[int]
    count: int
    kept: list[str]
    locked: list[str]
    departs: float
    nudge: float
    every: int
    trail: Numbers
    other: Numbers
    jumps: list[int]
    about: dict[str, Any]
    basis: str
    unlimited: str
    forecast: Forecast | None


class FactsView(Answer):
    """Facts about an uploaded motion file."""

    clips: list[ClipFacts]
    joints: int
    rig: str
    filled: list[str]
    height: float
    unit: str
    is_guessed: bool
    doubt: str
    faults: list[Fault]
    notes: list[str]
    people: bool


class UploadView(Answer):
    """An uploaded file."""

    id: str
    name: str
    size: int
    kind: str
    choices: Choices
    facts: FactsView | None
    error: str
    skips: list[int] = msgspec.field(default_factory=list)


class KeptView(Answer):
    """A movement that was added to the project."""

    key: str
    frames: int = 1


class ComposedView(KeptView):
    """A score that was composed: its movement, and the time of each posture, seconds, its line, and the clip's line.

    Without a key if the text is wrong: `error` says why.
    """

    error: str = ""
    calls: list[int] = msgspec.field(default_factory=list)
    lines: list[int] = msgspec.field(default_factory=list)
    times: list[float] = msgspec.field(default_factory=list)


class CorpusView(Answer):
    """A corpus, or the error on reading it."""

    name: str
    title: str
    own: bool
    error: str
    rate: Any = None
    clips: int | None = None


class SheetClip(ListedClip):
    """A clip on a corpus's sheet, and the frames to show of it."""

    pictures: list[int]


class Sheet(Answer):
    """An overview of a corpus."""

    name: str
    title: str
    author: str
    source: str
    licence: str
    body: str
    postures: int
    rate: float | None
    clips: list[SheetClip]


class TurnView(Answer):
    """An angle of a joint, degrees."""

    joint: str
    words: str
    angle: str
    label: str
    least: float
    most: float
    degrees: float


class Posed(Answer):
    """A posture in the editor, with `turns` or, for the same angles, `degrees` alone."""

    rotations: list[float]
    root: tuple[float, float, float]
    standing: list[str]
    corpus: str
    known: list[Literal["seen", "near", "unseen"]]
    balance: Balance | None
    turns: list[TurnView] | None = None
    degrees: list[float] | None = None
    words: str = ""


class HandleView(Answer):
    """A joint or a heel that can be dragged: its name, words for it, and its place in a joint's frame, metres."""

    joint: str
    words: str
    on: str
    at: tuple[float, float, float]


class Opened(Posed):
    """A posture, with what the editor shows of its body."""

    key: str = ""
    title: str = ""
    joints: list[dict[str, str]] = msgspec.field(default_factory=list)
    handles: list[HandleView] = msgspec.field(default_factory=list)
    mirrors: bool = False


class CreditSection(Answer):
    """Lines of credits under a heading."""

    heading: str
    lines: list[str]


class Credited(Answer):
    """Credits of the piece, by clip, performer, corpus and licence."""

    sections: list[CreditSection]


class Lines(Answer):
    """Lines of a score."""

    lines: Any
