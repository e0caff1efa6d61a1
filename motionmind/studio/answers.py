"""Types of the API's answers to the page."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec

from motionmind.studio.asks import Ask
from motionmind.studio.dancers import Change, Dancer
from motionmind.studio.edits import Decision, NoteKind
from motionmind.studio.findings import Found
from motionmind.studio.view import SeamState
from motionmind.studio.workers import JobState

Text = Annotated[str, msgspec.Meta(max_length=2_000)]
Numbers = str  # little-endian numbers in base64


class Answer(msgspec.Struct, forbid_unknown_fields=True):
    """An answer, or a part of one."""


class Failure(Answer):
    """The reason for a failure, in one line."""

    error: Annotated[str, msgspec.Meta(pattern=r"^[^\n]+\Z")]


class Nothing(Answer):
    """An empty answer: the request succeeded."""


class Health(Answer):
    """Readiness of the studio."""

    ready: Literal[True]


class Entering(Answer):
    """The token of the URL that the terminal shows."""

    token: str


class Entered(Answer):
    """Whether the token only lets its holder look."""

    looks: bool


class Looking(Answer):
    """The look-only link; "" if there is none."""

    address: str


class Renewing(Answer):
    """The key that lets this page in again after a restart; "" if there is none."""

    key: str


class Asking(Answer):
    """A page's number, fresh for each request."""

    number: Annotated[str, msgspec.Meta(min_length=20, max_length=100)]


class Proving(Answer):
    """The studio's number, and the proof that its sender has the key."""

    number: Annotated[str, msgspec.Meta(max_length=100)]
    proof: Annotated[str, msgspec.Meta(max_length=100)]


class Visiting(Answer):
    """The token of the URL, and one for a single visit within a minute."""

    token: str
    visit: str


class PartView(Answer):
    """A stretch of a movement, placed in time and on the floor."""

    key: str
    first: int
    last: int
    at: float
    seconds: float
    place: tuple[float, float]
    turn: float
    inserted: bool


class BlockView(Answer):
    """A stretch of the piece; `missing` if its movement no longer exists, such as after deleting a corpus.

    It lasts `seconds` with all its repeats, and `once` without.
    """

    id: str
    source: str
    first: int
    last: int
    mirrored: bool
    hold: float
    pace: float
    repeats: int
    key: str
    title: Text
    frames: int
    missing: bool
    at: float
    once: float
    seconds: float


class SeamView(Answer):
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


class NoteView(Answer):
    """A note, when it is in the piece, and for how long: a section lasts until the next one."""

    id: str
    kind: NoteKind
    text: str
    block: str
    frame: int
    after: float
    author: str
    at: float
    seconds: float


class PieceView(Answer):
    """The piece."""

    seconds: float
    parts: list[PartView]
    blocks: list[BlockView]
    seams: list[SeamView]
    notes: list[NoteView]


class VersionView(Answer):
    """A version of the piece, its duration, and what has changed since."""

    name: str
    seconds: float
    changes: list[str]


class Saved(Answer):
    """A saved posture and the key of its movement."""

    name: str
    key: str


class ReferenceView(Answer):
    """The path of the video beside the piece, or "", and its time at the piece's start, seconds."""

    path: str
    begins: float


class CastView(Answer):
    """The dancers of the piece and their changes of formation."""

    dancers: list[Dancer]
    changes: list[Change]


class DancerView(Answer):
    """A dancer for the player: facing in radians, times in seconds; `ways` as in player/README.md."""

    id: str
    name: str
    colour: tuple[int, int, int]
    place: tuple[float, float]
    facing: float
    entry: float
    end: float
    mirrored: bool
    source: str
    ways: list[tuple[float, float, float, float]]


class EnsembleView(Answer):
    """The dancers as they play together, and their bodies' paints."""

    dancers: list[DancerView]
    paints: list[dict[str, Any]]
    frames: int
    rate: float
    seconds: float


class Approaching(Answer):
    """Two dancers who come nearer than an arm's length: how near, and when."""

    names: tuple[str, str]
    metres: float
    seconds: float
    count: float


class MusicView(Answer):
    """The path of the piece's music, or "", its time at the piece's start, its beats, and which of them is count 1."""

    path: str
    begins: float
    beats: list[float]
    first: int


class ProjectView(Answer):
    """The project as a window sees it; with `access` "look" little else than its piece."""

    sequence: int
    access: Literal["own", "shared", "look"]
    title: str
    file: str
    saved: float
    corpus: str
    corpora: dict[str, str]
    tempo: float
    counts: int
    reference: ReferenceView
    stage: tuple[float, float] | None
    music: MusicView
    words: list[Text]
    missing: list[Text]
    postures: list[Saved]
    cast: CastView
    piece: PieceView
    undo: str | None
    redo: str | None


class JobView(Answer, omit_defaults=True):
    """A job of the workers; also the data of a `job` event."""

    id: str
    kind: str
    state: JobState
    done: int
    of: int
    words: Text
    partial: list[Any] = []
    result: Any = None


class Begun(Answer):
    """The id of a job that was submitted."""

    job: str


class FilmBegun(Answer):
    """The id of a job that makes a film; None if this computer has no encoder."""

    job: str | None


class Skeleton(Answer):
    """A body's joints."""

    names: list[str]
    parents: list[int]
    offsets: list[tuple[float, float, float]]


class InsertionView(Answer):
    """A stretch that the engine inserted."""

    times: list[float]
    bridged: list[dict[str, int]]


class MovementData(Answer):
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
