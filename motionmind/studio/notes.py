"""Notes on a piece stay with the movement that they are about, whatever becomes of its stretches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import msgspec

from motionmind.errors import MotionMindError
from motionmind.studio.edits import MAX_PIECE_NOTES, Annotate, Block, Erase, Note

Notes = Mapping[str, Note]  # by id
COMMENTS = "comments"  # the window of comments, which no other window undoes


def changed(notes: Notes, edit: Annotate | Erase, blocks: Sequence[Block]) -> dict[str, Note]:
    """Return a piece's notes after an edit of them.

    Args:
        notes: the notes, by id.
        edit: the edit.
        blocks: the blocks of the piece.

    Raises:
        MotionMindError: there is no such note or moment, the text is missing, or there are too many notes.
    """
    if isinstance(edit, Erase):
        if edit.note not in notes:
            raise MotionMindError("this note is no longer there")
        return {name: note for name, note in notes.items() if name != edit.note}
    note = edit.note
    if not note.author:  # a comment keeps no edit before it from being undone
        check_place(note, blocks)
    if not note.text.strip() and note.kind != "marker":
        raise MotionMindError(f"a {note.kind} needs a text")
    if len(notes) >= MAX_PIECE_NOTES and note.id not in notes:
        raise MotionMindError(f"a piece has at most {MAX_PIECE_NOTES:,} notes")
    return {**notes, note.id: note}


def check_place(note: Note, blocks: Sequence[Block]) -> None:
    """Check that a piece has the moment of a note.

    Raises:
        MotionMindError: it has not.
    """
    block = next((block for block in blocks if block.id == note.block), None)
    if block is None:
        raise MotionMindError("this stretch is no longer in the piece")
    if not block.first <= note.frame <= block.last:
        raise MotionMindError(f"this stretch has frames {block.first} to {block.last}, not {note.frame}")


def follow(notes: Notes, before: Sequence[Block], after: Sequence[Block]) -> dict[str, Note]:
    """Return a piece's notes after an edit of its blocks.

    A note whose block is split goes with its frame. One whose block is gone goes to the nearest block that has this
    frame, or else to the next block, or the last. In an empty piece it waits for an undo.

    Args:
        notes: the notes, by id.
        before: the blocks before the edit.
        after: the blocks after it.
    """
    if not notes or before is after:
        return dict(notes)
    places = {block.id: place for place, block in enumerate(before)}
    kept = {block.id: place for place, block in enumerate(after)}
    return {name: _followed(note, before, after, places, kept) for name, note in notes.items()}


def _followed(
    note: Note, before: Sequence[Block], after: Sequence[Block], places: Mapping[str, int], kept: Mapping[str, int]
) -> Note:
    """Return a note, anchored anew if need be."""
    if (place := kept.get(note.block)) is not None:
        rest = after[place + 1 : place + 2]
        is_split = not _has(after[place], after[place], note.frame) and any(block.id not in places for block in rest)
        return _moved(note, rest[0].id) if is_split and _has(rest[0], after[place], note.frame) else note
    if (was := places.get(note.block)) is None or not after:
        return note
    same = [block for block in after if _has(block, before[was], note.frame)]
    if same:
        return _moved(note, min(same, key=lambda block: abs(kept[block.id] - was)).id)
    later = next((block for block in before[was + 1 :] if block.id in kept), None)
    if later is not None:
        return msgspec.structs.replace(note, block=later.id, frame=after[kept[later.id]].first, after=0.0)
    return msgspec.structs.replace(note, block=after[-1].id, frame=after[-1].last, after=0.0)


def _moved(note: Note, block: str) -> Note:
    return msgspec.structs.replace(note, block=block)


def _has(block: Block, like: Block, frame: int) -> bool:
    """Return whether a block shows a frame of the movement that another one shows."""
    is_alike = (block.source, block.mirrored) == (like.source, like.mirrored)
    return is_alike and block.first <= frame <= block.last
