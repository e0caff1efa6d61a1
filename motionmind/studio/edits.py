"""The edits of which a project consists: what a choreographer did, each with all that doing it again needs.

An edit is plain data and says nothing of how it is applied (`motionmind.studio.piece`) or kept (the journal).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, TypeAlias

import msgspec

MOST_BLOCKS = 10_000  # of a piece
_MOST_TOGETHER = 2_000  # edits that are taken back at once

Id = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_.-]{1,40}\Z")]  # of a block
Key = Annotated[str, msgspec.Meta(min_length=1, max_length=400)]  # of a movement
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=200)]
Frame = Annotated[int, msgspec.Meta(ge=0, lt=2**31)]
Decision = Literal["open", "locked", "discarded"]
Hold = Literal["start", "end", "throughout", "place"]
Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Place = str | tuple[str, str]  # that an edit touches: a block's id, or the ids on both sides of a seam


class _Struct(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A value in an edit."""


class _Edit(msgspec.Struct, frozen=True, tag_field="edit", tag=str.lower, forbid_unknown_fields=True):
    """An edit; the field `edit` of its JSON says which."""


class Block(_Struct, frozen=True):
    """A stretch of a movement, as it stands in a piece.

    Attributes:
        id: its name in the project; no other block has it or ever had it.
        source: key of the movement.
        first: frame of the movement that it begins with.
        last: frame that it ends with, no less than `first`.
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
    """A hand or a foot that stays on an insertion's way: as its limb is, or in its place in the room.

    Attributes:
        joint: the joint at the limb's end.
        hold: "start" if the limb stays as it is at the start until the end comes, "end" if it takes up what it has at
            the end at once, "throughout" if both ends agree and it stays all the way; "place" if the hand or foot stays
            where it is in the room, and the limb makes up for that.
        begins: share of the insertion's time from which it stays in its place.
        ends: share until which it does, more than `begins`.
    """

    joint: Name
    hold: Hold = "start"
    begins: Share = 0.0
    ends: Share = 1.0

    def __post_init__(self) -> None:
        """Check that it begins before it ends."""
        if self.begins >= self.ends:
            raise ValueError("a hand or foot that stays must begin to before it ends to")


class Ask(_Struct, frozen=True):
    """A wish for a seam's insertion.

    Attributes:
        seconds: its length; None leaves that to the corpus.
        passing: postures to pass through, in this order.
        pins: limbs to keep as they are.
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
    """Let a block begin and end with other frames of its movement."""

    block: Id
    first: Frame
    last: Frame


class Split(_Edit, frozen=True):
    """Cut a block in two; the frame `at` begins the second, which gets the new id."""

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
    """Insert another of the movements that were found for the seam between two neighbours, counted from 1."""

    left: Id
    right: Id
    alternative: Annotated[int, msgspec.Meta(ge=1, le=100)]


class Decide(_Edit, frozen=True):
    """Lock or discard the insertion between two neighbours, or leave it open again."""

    left: Id
    right: Id
    decision: Decision


class Wish(_Edit, frozen=True, tag="ask"):
    """Ask for other movement between two neighbours; the fields are those of `Ask`."""

    left: Id
    right: Id
    seconds: Annotated[float, msgspec.Meta(gt=0.0, le=600.0)] | None = None
    passing: Annotated[tuple[Passing, ...], msgspec.Meta(max_length=20)] = ()
    pins: Annotated[tuple[Pin, ...], msgspec.Meta(max_length=20)] = ()

    @property
    def ask(self) -> Ask:
        """The wish alone."""
        return Ask(self.seconds, self.passing, self.pins)


class Arrange(_Edit, frozen=True):
    """Give the piece a whole new order.

    Attributes:
        blocks: all its blocks; one that was in the piece keeps its id if it is the same stretch.
        about: how the order came about: `words` for people, and what its maker needs to make it again.
    """

    blocks: Annotated[tuple[Block, ...], msgspec.Meta(max_length=MOST_BLOCKS)]
    about: dict[str, Any] = {}


class SavePosture(_Edit, frozen=True, tag="posture"):
    """Save a posture by name, or forget it.

    Attributes:
        name: its name; the movement `own/NAME` is it.
        posture: key of the movement, of one frame, that the project keeps of it; None forgets it.
    """

    name: Name
    posture: Key | None


class SetCorpus(_Edit, frozen=True, tag="corpus"):
    """Judge and smooth the piece beside another corpus."""

    name: Name


class SetTitle(_Edit, frozen=True, tag="title"):
    """Call the piece something else."""

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
    """Do several edits as one, which is taken back as one; either all of them apply or none.

    Attributes:
        edits: the edits, in order.
        words: what they do together, for people; "" for the words of the last of them.
    """

    edits: Annotated[tuple[Single, ...], msgspec.Meta(min_length=1, max_length=_MOST_TOGETHER)]
    words: Annotated[str, msgspec.Meta(max_length=200)] = ""


Edit: TypeAlias = Single | Several

_WORDS: Mapping[type, str] = {
    Insert: "insert a stretch",
    Move: "move a stretch",
    Trim: "trim a stretch",
    Split: "split a stretch",
    Mirror: "mirror a stretch",
    Delete: "delete a stretch",
    Choose: "choose an insertion",
    Wish: "ask for another insertion",
    SetCorpus: "change the corpus",
    SetTitle: "rename the piece",
}
_DECIDED = {"open": "leave an insertion open", "locked": "lock an insertion", "discarded": "discard an insertion"}


def each(edit: Edit) -> Iterator[Single]:
    """Yield the single edits that an edit consists of, in order."""
    if isinstance(edit, Several):
        yield from edit.edits
    else:
        yield edit


def words_of(edit: Edit) -> str:
    """Say what an edit does in a few words, such as "delete a stretch".

    >>> from motionmind.studio.edits import Delete, words_of
    >>> words_of(Delete("b1"))
    'delete a stretch'
    """
    match edit:
        case Several(edits, words):
            return words or words_of(edits[-1])
        case Decide():
            return _DECIDED[edit.decision]
        case Arrange():
            return str(edit.about.get("words", "")) or "arrange the piece anew"
        case SavePosture():
            return f"{'forget' if edit.posture is None else 'save'} the posture {edit.name}"
        case _:
            return _WORDS[type(edit)]


def touched(edit: Edit) -> frozenset[Place]:
    """Return the blocks and seams that an edit changes; a later edit that changes one of them rests on it.

    Whatever it does not touch stays as it is, though blocks and seams may come to stand elsewhere.
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
