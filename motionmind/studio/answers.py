"""Types of the API's answers to the page."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec

from motionmind.studio.edits import Ask, Decision
from motionmind.studio.piece import Found
from motionmind.studio.reading import ClipFacts, Fault
from motionmind.studio.uploads import Choices
from motionmind.studio.view import SeamState
from motionmind.studio.workers import JobState

Text = Annotated[str, msgspec.Meta(max_length=2_000)]
Numbers = str  # little-endian numbers in base64


class _Answer(msgspec.Struct, forbid_unknown_fields=True):
    """An answer, or a part of one."""


class Failure(_Answer):
    """The reason for a failure, in one line."""

    error: Annotated[str, msgspec.Meta(pattern=r"^[^\n]+\Z")]


class Nothing(_Answer):
    """An empty answer: the request succeeded."""


class Health(_Answer):
    """Readiness of the studio."""

    ready: Literal[True]


class Entering(_Answer):
    """The token of the URL that the terminal shows."""

    token: str


class PartView(_Answer):
    """A stretch of a movement, placed in time and on the floor."""

    key: str
    first: int
    last: int
    at: float
    seconds: float
    place: tuple[float, float]
    turn: float
    inserted: bool


class BlockView(_Answer):
    """A stretch of the piece; `missing` if its movement no longer exists, such as after deleting a corpus."""

    id: str
    source: str
    first: int
    last: int
    mirrored: bool
    key: str
    title: Text
    frames: int
    missing: bool
    at: float
    seconds: float


class SeamView(_Answer):
    """A seam between two neighbours."""

    left: str
    right: str
    number: int
    state: SeamState
    words: Text
    chosen: int
    alternatives: list[Found]
    decision: Decision
    ask: Ask
    at: float
    stands: bool
    seconds: float


class PieceView(_Answer):
    """The piece."""

    seconds: float
    parts: list[PartView]
    blocks: list[BlockView]
    seams: list[SeamView]


class Saved(_Answer):
    """A saved posture and the key of its movement."""

    name: str
    key: str


class ProjectView(_Answer):
    """The project as a window sees it."""

    sequence: int
    title: str
    file: str
    corpus: str
    corpora: dict[str, str]
    words: list[Text]
    missing: list[Text]
    postures: list[Saved]
    piece: PieceView
    undo: str | None
    redo: str | None


class JobView(_Answer, omit_defaults=True):
    """A job of the workers; also the data of a `job` event."""

    id: str
    kind: str
    state: JobState
    done: int
    of: int
    words: Text
    partial: list[Any] = []
    result: Any = None


class Begun(_Answer):
    """The id of a job that was submitted."""

    job: str


class Skeleton(_Answer):
    """A body's joints."""

    names: list[str]
    parents: list[int]
    offsets: list[tuple[float, float, float]]


class InsertionView(_Answer):
    """A stretch that the engine inserted."""

    times: list[float]
    bridged: list[dict[str, int]]


class MovementData(_Answer):
    """A movement in the format of the player (player/README.md)."""

    name: str
    first: int
    farthest: list[int]
    skeleton: Skeleton
    body: dict[str, Any]
    colours: dict[str, Any]
    times: Numbers
    root: Numbers
    rotations: Numbers
    insertions: list[InsertionView]


class Listed(_Answer):
    """A named posture."""

    key: str
    title: str


class ListedClip(_Answer):
    """A clip of a corpus."""

    key: str
    title: str
    about: str
    frames: int
    seconds: float


class ListedCorpus(_Answer):
    """A corpus in the gallery."""

    name: str
    postures: list[Listed]
    clips: list[ListedClip]


class Gallery(_Answer):
    """The postures and clips to choose from."""

    corpora: list[ListedCorpus]
    own: list[Listed]


class Map(_Answer):
    """A flow's attractor."""

    flow: str
    axes: Any
    points: Numbers
    about: str


class Variation(_Answer):
    """A variation of the piece; `unlimited` says why insertions could not be limited as requested, if so."""

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


class FactsView(_Answer):
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


class UploadView(_Answer):
    """An uploaded file."""

    id: str
    name: str
    size: int
    kind: str
    choices: Choices
    facts: FactsView | None
    error: str
    skips: list[int] = []


class KeptView(_Answer):
    """A movement that was added to the project."""

    key: str
    frames: int = 1


class CorpusView(_Answer):
    """A corpus, or the error on reading it."""

    name: str
    title: str
    own: bool
    error: str
    rate: Any = None
    clips: int | None = None


class SheetClip(_Answer):
    """A clip on a corpus's sheet, and the frames to show of it."""

    key: str
    name: str
    about: str
    frames: int
    seconds: float
    pictures: list[int]


class Sheet(_Answer):
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


class TurnView(_Answer):
    """An angle of a joint, degrees."""

    joint: str
    words: str
    angle: str
    label: str
    least: float
    most: float
    degrees: float


class Posed(_Answer):
    """A posture in the editor, with `turns` or, for the same angles, `degrees` alone."""

    rotations: list[float]
    root: tuple[float, float, float]
    standing: list[str]
    corpus: str
    known: list[Literal["seen", "near", "unseen"]]
    turns: list[TurnView] | None = None
    degrees: list[float] | None = None
    words: str = ""


class HandleView(_Answer):
    """A joint or a heel that can be dragged: its name, words for it, and its place in a joint's frame, metres."""

    joint: str
    words: str
    on: str
    at: tuple[float, float, float]


class Opened(Posed):
    """A posture, with what the editor shows of its body."""

    key: str = ""
    title: str = ""
    joints: list[dict[str, str]] = []
    handles: list[HandleView] = []
    mirrors: bool = False


class CreditSection(_Answer):
    """Lines of credits under a heading."""

    heading: str
    lines: list[str]


class Credited(_Answer):
    """Credits of the piece, by clip, performer, corpus and licence."""

    sections: list[CreditSection]


class Lines(_Answer):
    """Lines of a score."""

    lines: Any
