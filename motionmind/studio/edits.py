"""The edits of a project: a choreographer's actions, each with all that is needed to repeat it.

An edit is plain data; `motionmind.studio.piece` applies it and `motionmind.studio.journal` stores it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal, TypeAlias

import msgspec

from motionmind.studio.asks import MAX_INSERTION_S, Ask, Frame, Key, Name, Passing, Pin, Reach, Travel
from motionmind.studio.dancers import PutDancer, RemoveDancer, SetFormations, cast_places
from motionmind.studio.settings import SetCorpus, SetMusic, SetReference, SetStage, SetTempo, Setting, SetTitle

MAX_BLOCKS = 10_000  # in a piece
MAX_HOLD_S = 3600.0
MAX_PIECE_NOTES = 2_000

Id = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_.-]{1,40}\Z")]  # of a block
Decision = Literal["open", "locked", "discarded"]
NoteKind = Literal["note", "marker", "section"]
Seconds = Annotated[float, msgspec.Meta(ge=0.0, le=MAX_HOLD_S)]  # of a held posture
Pace = Annotated[float, msgspec.Meta(ge=0.5, le=2.0)]  # of a stretch: 2 is twice as fast as recorded
Repeats = Annotated[int, msgspec.Meta(ge=1, le=100)]  # of a stretch
Place = str | tuple[str, str]  # touched by an edit: a block's id, or the ids on both sides of a seam


class _Struct(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A value in an edit."""


class _Edit(msgspec.Struct, frozen=True, tag_field="edit", tag=str.lower, forbid_unknown_fields=True):
    """An edit; the field `edit` of its JSON gives its kind."""


class Block(_Struct, frozen=True):
    """A stretch of a movement in a piece.

    Attributes:
        id: its name in the project, which is never reused.
        source: key of the movement.
        first: first frame of the movement.
        last: last frame of the movement, inclusive, no less than `first`.
        mirrored: whether left and right are exchanged.
        hold: seconds in which a posture, a block of one frame, stands still; 0 for a block of several.
        pace: its speed, as a multiple of the recorded one.
        repeats: how many times it plays; 1 for a posture.
    """

    id: Id
    source: Key
    first: Frame
    last: Frame
    mirrored: bool = False
    hold: Seconds = 0.0
    pace: Pace = 1.0
    repeats: Repeats = 1


class Note(_Struct, frozen=True):
    """A text at a moment of the movement; it stays with the movement when the piece changes.

    Attributes:
        id: its name in the project.
        kind: "note" for a remark, "marker" for a place to go to, "section" for the name of all up to the next section.
        text: its text, which may be empty only in a marker.
        block: the block that it is in.
        frame: a frame of the block's movement.
        after: seconds after that frame.
        author: who wrote it, if it came as a comment; "" for the project's own.
    """

    id: Id
    kind: NoteKind
    text: Annotated[str, msgspec.Meta(max_length=1_000)]
    block: Id
    frame: Frame
    after: Annotated[float, msgspec.Meta(ge=0.0, le=600.0)] = 0.0
    author: Annotated[str, msgspec.Meta(max_length=80)] = ""


class Insert(_Edit, frozen=True):
    """Put a new block before another, or at the end."""

    id: Id
    source: Key
    first: Frame
    last: Frame
    mirrored: bool = False
    before: Id | None = None
    hold: Seconds = 0.0
    pace: Pace = 1.0
    repeats: Repeats = 1

    @property
    def block(self) -> Block:
        """The new block."""
        return msgspec.convert({name: getattr(self, name) for name in Block.__struct_fields__}, Block)


class Move(_Edit, frozen=True):
    """Move a block before another, or to the end."""

    block: Id
    before: Id | None = None


class Trim(_Edit, frozen=True):
    """Change the first and last frames of a block; several frames are not held, and a single one does not repeat."""

    block: Id
    first: Frame
    last: Frame


class HoldPosture(_Edit, frozen=True, tag="hold"):
    """Hold a posture, a block of one frame, for some seconds."""

    block: Id
    seconds: Seconds


class Play(_Edit, frozen=True):
    """Change how fast a block plays, and how many times."""

    block: Id
    pace: Pace = 1.0
    repeats: Repeats = 1


class Split(_Edit, frozen=True):
    """Cut a block in two; the second begins with the frame `at` and gets the new id.

    Of a block that repeats, cut the playing number `turn`, from 1. The playings before it keep the block's id: its
    first half then gets the id `half`, and the playings after it, if any, get `rest`.
    """

    block: Id
    at: Frame
    id: Id
    turn: Repeats = 1
    half: Id | None = None
    rest: Id | None = None


class Mirror(_Edit, frozen=True):
    """Exchange left and right in a block."""

    block: Id


class Delete(_Edit, frozen=True):
    """Take a block out of the piece."""

    block: Id


class Choose(_Edit, frozen=True):
    """Choose one of the movements, counted from 1, that were found for the seam between two neighbours.

    Here and below, a block that repeats is its own neighbour.
    """

    left: Id
    right: Id
    alternative: Annotated[int, msgspec.Meta(ge=1, le=100)]


class Decide(_Edit, frozen=True):
    """Lock or discard the insertion between two neighbours, or leave it open again."""

    left: Id
    right: Id
    decision: Decision


class Wish(_Edit, frozen=True, tag="ask"):
    """Request other movement between two neighbours; the fields are those of `Ask`."""

    left: Id
    right: Id
    seconds: Annotated[float, msgspec.Meta(gt=0.0, le=MAX_INSERTION_S)] | None = None
    passing: Annotated[tuple[Passing, ...], msgspec.Meta(max_length=20)] = ()
    pins: Annotated[tuple[Pin, ...], msgspec.Meta(max_length=20)] = ()
    reaches: Annotated[tuple[Reach, ...], msgspec.Meta(max_length=20)] = ()
    travel: Travel | None = None

    @property
    def ask(self) -> Ask:
        """The request without its seam."""
        return Ask(self.seconds, self.passing, self.pins, self.reaches, self.travel)


class Arrange(_Edit, frozen=True):
    """Replace all blocks of the piece.

    Attributes:
        blocks: all blocks; one that was in the piece keeps its id if it is the same stretch.
        about: origin of the new order: `words` for people, and data to make it again.
    """

    blocks: Annotated[tuple[Block, ...], msgspec.Meta(max_length=MAX_BLOCKS)]
    about: dict[str, Any] = {}


class Annotate(_Edit, frozen=True, tag="note"):
    """Add a note, or replace the one with its id."""

    note: Note


class Erase(_Edit, frozen=True, tag="erase"):
    """Delete a note."""

    note: Id


class SaveVersion(_Edit, frozen=True, tag="version"):
    """Keep the piece as a version by name, or delete that version.

    Attributes:
        name: its name; a version of that name is replaced.
        keep: whether to keep it.
    """

    name: Name
    keep: bool = True


class GoBack(_Edit, frozen=True):
    """Replace the piece by a version of it."""

    name: Name


class SavePosture(_Edit, frozen=True, tag="posture"):
    """Save a posture by name, or forget it.

    Attributes:
        name: its name; its movement is `own/NAME`.
        posture: key of the project's movement, of one frame, that holds it; None forgets it.
    """

    name: Name
    posture: Key | None


Single: TypeAlias = (
    Insert
    | Move
    | Trim
    | HoldPosture
    | Play
    | Split
    | Mirror
    | Delete
    | Choose
    | Decide
    | Wish
    | Arrange
    | Annotate
    | Erase
    | SaveVersion
    | GoBack
    | SavePosture
    | SetCorpus
    | SetMusic
    | SetReference
    | SetStage
    | SetTempo
    | SetTitle
    | PutDancer
    | RemoveDancer
    | SetFormations
)


class Several(_Edit, frozen=True):
    """Apply several edits as one, which one undo takes back; either all of them apply or none.

    Attributes:
        edits: the edits, in order.
        words: description of the whole, for people; "" for that of the last edit.
    """

    edits: Annotated[tuple[Single, ...], msgspec.Meta(min_length=1, max_length=2_000)]
    words: Annotated[str, msgspec.Meta(max_length=200)] = ""


Edit: TypeAlias = Single | Several


def each(edit: Edit) -> Iterator[Single]:
    """Yield the single edits that an edit consists of, in order."""
    if isinstance(edit, Several):
        yield from edit.edits
    else:
        yield edit


def touched(edit: Edit) -> frozenset[Place]:
    """Return the blocks and seams that an edit changes; a later edit of one of them depends on it.

    All others stay as they are, though blocks and seams may move.
    """
    places: set[Place] = set()
    for one in each(edit):
        match one:
            case Insert(id=new):
                places.add(new)
            case Split(block=block, id=new, half=half, rest=rest):
                places |= {block, new, *filter(None, (half, rest))}
            case Move(block) | Trim(block) | HoldPosture(block) | Play(block) | Mirror(block) | Delete(block):
                places.add(block)
            case Choose(left, right) | Decide(left, right) | Wish(left, right):
                places.add((left, right))
            case Arrange(blocks=blocks):
                places |= {block.id for block in blocks}
            case Annotate(note=Note(id=name)) | Erase(note=name):
                places.add(f"/note/{name}")
            case SaveVersion(name=name) | GoBack(name=name):
                places.add(f"/version/{name}")
            case SavePosture(name=name):
                places.add(f"own/{name}")
            case Setting():
                places.add(one.place)
            case PutDancer() | RemoveDancer() | SetFormations():
                places.add(cast_places(one))
    return frozenset(places)
