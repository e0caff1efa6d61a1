"""Edits in words, for undo and redo."""

from __future__ import annotations

from collections.abc import Mapping

from motionmind.studio.dancers import PutDancer, RemoveDancer, SetFormations, described
from motionmind.studio.edits import (
    Annotate,
    Arrange,
    Choose,
    Decide,
    Delete,
    Edit,
    Erase,
    GoBack,
    HoldPosture,
    Insert,
    Mirror,
    Move,
    Play,
    SavePosture,
    SaveVersion,
    Several,
    Split,
    Trim,
    Wish,
)
from motionmind.studio.settings import SetCorpus, SetMusic, SetReference, SetStage, SetTempo, SetTitle

_DESCRIPTIONS: Mapping[type, str] = {
    Insert: "insert a stretch",
    Move: "move a stretch",
    Trim: "trim a stretch",
    HoldPosture: "hold a posture",
    Play: "change the pace or the repeats of a stretch",
    Split: "split a stretch",
    Mirror: "mirror a stretch",
    Delete: "delete a stretch",
    Choose: "choose an insertion",
    Wish: "change the wishes for an insertion",
    Erase: "delete a note",
    SetCorpus: "change the corpus",
    SetMusic: "change the music",
    SetReference: "change the reference video",
    SetStage: "change the stage",
    SetTempo: "change the tempo",
    SetTitle: "rename the piece",
}


def words_of(edit: Edit) -> str:  # noqa: PLR0911 (one case an edit)
    """Describe an edit in a few words, such as "delete a stretch".

    >>> from motionmind.studio.edit_words import words_of
    >>> from motionmind.studio.edits import Delete
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
        case Annotate(note):
            return {"note": "write a note", "marker": "set a marker", "section": "name a section"}[note.kind]
        case SaveVersion():
            return f"{'keep' if edit.keep else 'delete'} the version {edit.name}"
        case GoBack():
            return f"go back to {edit.name}"
        case SavePosture():
            return f"{'delete' if edit.posture is None else 'save'} the posture {edit.name}"
        case PutDancer() | RemoveDancer() | SetFormations():
            return described(edit)
        case _:
            return _DESCRIPTIONS[edit.__class__]
