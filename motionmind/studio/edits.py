"""The edits of a project: a choreographer's actions, each with all that is needed to repeat it.

An edit is plain data; `motionmind.studio.piece` applies it and `motionmind.studio.journal` stores it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, TypeAlias

import msgspec

MAX_BLOCKS = 10_000  # in a piece

Id = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_.-]{1,40}\Z")]  # of a block
Key = Annotated[str, msgspec.Meta(min_length=1, max_length=400)]  # of a movement
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=200)]
Frame = Annotated[int, msgspec.Meta(ge=0, lt=2**31)]
Decision = Literal["open", "locked", "discarded"]
Hold = Literal["start", "end", "throughout", "place"]
Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
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
    """

    id: Id
    source: Key
    first: Frame
    last: Frame
    mirrored: bool = False


class Passing(_Struct, frozen=True):
    """A posture that an insertion passes through: a frame of a movement."""

    posture: Key
    frame: Frame = 0


class Pin(_Struct, frozen=True):
    """A hand or a foot that stays during an insertion: in its limb's posture, or in place in the room.

    Attributes:
        joint: the joint at the limb's end.
        hold: "start" if the limb keeps its posture of the start until the end, "end" if it takes its posture of the end
            at once, "throughout" if both ends agree and it keeps its posture; "place" if the hand or foot keeps its
            place in the room and the limb compensates.
        begins: share of the insertion's time at which "place" begins.
        ends: share at which it ends, more than `begins`.
    """

    joint: Name
    hold: Hold = "start"
    begins: Share = 0.0
    ends: Share = 1.0

    def __post_init__(self) -> None:
        """Check that `begins` is less than `ends`."""
        if self.begins >= self.ends:
            raise ValueError(f"begins must be less than ends, not {self.begins:g} and {self.ends:g}")


class Ask(_Struct, frozen=True):
    """A request for a seam's insertion.

    Attributes:
        seconds: its duration; None leaves that to the engine.
        passing: postures to pass through, in this order.
        pins: hands and feet that stay.
    """

    seconds: Annotated[float, msgspec.Meta(gt=0.0, le=600.0)] | None = None
    passing: Annotated[tuple[Passing, ...], msgspec.Meta(max_length=20)] = ()
    pins: Annotated[tuple[Pin, ...], msgspec.Meta(max_length=20)] = ()


class Insert(_Edit, frozen=True):
    """Put a new block before another, or at the end."""

    id: Id
    source: Key
    first: Frame
    last: Frame
    mirrored: bool = False
    before: Id | None = None

    @property
    def block(self) -> Block:
        """The new block."""
        return Block(self.id, self.source, self.first, self.last, self.mirrored)


class Move(_Edit, frozen=True):
    """Move a block before another, or to the end."""

    block: Id
    before: Id | None = None


class Trim(_Edit, frozen=True):
    """Change the first and last frames of a block."""

    block: Id
    first: Frame
    last: Frame


class Split(_Edit, frozen=True):
    """Cut a block in two; the second begins with the frame `at` and gets the new id."""

    block: Id
    at: Frame
    id: Id


class Mirror(_Edit, frozen=True):
    """Exchange left and right in a block."""

    block: Id


class Delete(_Edit, frozen=True):
    """Take a block out of the piece."""

    block: Id


class Choose(_Edit, frozen=True):
    """Choose one of the movements, counted from 1, that were found for the seam between two neighbours."""

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
    seconds: Annotated[float, msgspec.Meta(gt=0.0, le=600.0)] | None = None
    passing: Annotated[tuple[Passing, ...], msgspec.Meta(max_length=20)] = ()
    pins: Annotated[tuple[Pin, ...], msgspec.Meta(max_length=20)] = ()

    @property
    def ask(self) -> Ask:
        """The request without its seam."""
        return Ask(self.seconds, self.passing, self.pins)


class Arrange(_Edit, frozen=True):
    """Replace all blocks of the piece.

    Attributes:
        blocks: all blocks; one that was in the piece keeps its id if it is the same stretch.
        about: origin of the new order: `words` for people, and data to make it again.
    """

    blocks: Annotated[tuple[Block, ...], msgspec.Meta(max_length=MAX_BLOCKS)]
    about: dict[str, Any] = {}


class SavePosture(_Edit, frozen=True, tag="posture"):
    """Save a posture by name, or forget it.

    Attributes:
        name: its name; its movement is `own/NAME`.
        posture: key of the project's movement, of one frame, that holds it; None forgets it.
    """

    name: Name
    posture: Key | None


class SetCorpus(_Edit, frozen=True, tag="corpus"):
    """Judge and smooth the piece with another corpus."""

    name: Name


class SetTitle(_Edit, frozen=True, tag="title"):
    """Rename the piece."""

    title: Annotated[str, msgspec.Meta(max_length=200)]


Single: TypeAlias = (
    Insert
    | Move
    | Trim
    | Split
    | Mirror
    | Delete
    | Choose
    | Decide
    | Wish
    | Arrange
    | SavePosture
    | SetCorpus
    | SetTitle
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

_DESCRIPTIONS: Mapping[type, str] = {
    Insert: "insert a stretch",
    Move: "move a stretch",
    Trim: "trim a stretch",
    Split: "split a stretch",
    Mirror: "mirror a stretch",
    Delete: "delete a stretch",
    Choose: "choose an insertion",
    Wish: "change the wishes for an insertion",
    SetCorpus: "change the corpus",
    SetTitle: "rename the piece",
}


def each(edit: Edit) -> Iterator[Single]:
    """Yield the single edits that an edit consists of, in order."""
    if isinstance(edit, Several):
        yield from edit.edits
    else:
        yield edit


def words_of(edit: Edit) -> str:
    """Describe an edit in a few words, such as "delete a stretch".

    >>> from motionmind.studio.edits import Delete, words_of
    >>> words_of(Delete("b1"))
    'delete a stretch'
    """
    match edit:
        case Several(edits, words):
            return words or words_of(edits[-1])
        case Decide():
            verb = {"open": "reopen", "locked": "lock", "discarded": "discard"}[edit.decision]
            return f"{verb} an insertion"
        case Arrange():
            return str(edit.about.get("words", "")) or "rearrange the piece"
        case SavePosture():
            return f"{'delete' if edit.posture is None else 'save'} the posture {edit.name}"
        case _:
            return _DESCRIPTIONS[type(edit)]


def touched(edit: Edit) -> frozenset[Place]:
    """Return the blocks and seams that an edit changes; a later edit of one of them depends on it.

    All others stay as they are, though blocks and seams may move.
    """
    places: set[Place] = set()
    for one in each(edit):
        match one:
            case Insert(id=new):
                places.add(new)
            case Split(block=block, id=new):
                places |= {block, new}
            case Move(block=block) | Trim(block=block) | Mirror(block=block) | Delete(block=block):
                places.add(block)
            case Choose(left, right) | Decide(left, right) | Wish(left, right):
                places.add((left, right))
            case Arrange(blocks=blocks):
                places |= {block.id for block in blocks}
            case SavePosture(name=name):
                places.add(f"own/{name}")
            case SetCorpus():
                places.add("/corpus")
            case SetTitle():
                places.add("/title")
    return frozenset(places)
