"""Checks of incoming edits, and of a piece: do its movements exist, and are they long enough?"""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.studio.dancers import Dancer, PutDancer
from motionmind.studio.edit_words import words_of
from motionmind.studio.edits import Arrange, Block, Edit, Insert, SavePosture, Trim, Wish, each
from motionmind.studio.neighbours import OWN, key_of
from motionmind.studio.piece import State
from motionmind.studio.placement import Marks


def check_movements(state: State, edit: Edit, frames: Callable[[str], int]) -> None:
    """Check that the movements in an edit exist and are long enough.

    Args:
        state: the state that the edit leads to.
        edit: the edit.
        frames: returns the number of frames of a movement by its key; raises MotionMindError if there is none.

    Raises:
        MotionMindError: a movement is missing or too short.
    """
    for one in each(edit):
        match one:
            case Insert(id=name) | Trim(block=name) if name in state.used:
                blocks = [block for block in state.blocks if block.id == name]
            case Arrange(blocks=blocks):
                pass
            case Wish(passing=passing):
                blocks = [Block("passing", state.stable(at.posture), at.frame, at.frame) for at in passing]
            case PutDancer(Dancer(source=source)) if source:
                blocks = [Block("dancer", source, 0, 0)]
            case SavePosture(posture=str(posture)):
                blocks = [Block("posture", posture, 0, 0)]
            case _:
                continue
        for block in blocks:
            count = frames(key_of(block))
            if block.last >= count:
                raise MotionMindError(
                    f"{displayed(block.source)} has no frame {block.last}: its frames are 0 to {count - 1}"
                )


def check_bounds(edit: Edit) -> None:
    """Check that an edit can be read again from the project's file, as edits made by this process are not checked.

    Raises:
        MotionMindError: a value is out of range, or of the wrong type.
    """
    for one in (*each(edit), edit):
        try:
            msgspec.json.decode(msgspec.json.encode(one), type=Edit)
        except ValueError as error:  # msgspec's errors are ValueErrors
            words, _, where = str(error).replace("`float`", "a number").partition(" - at `$.")
            place = f"{where.rstrip('`')}: " if where else ""
            raise MotionMindError(
                f"cannot {displayed(words_of(one))}: {place}{words[:1].lower()}{words[1:]}"
            ) from error


def check_names(edit: Edit) -> None:
    """Check that the postures which an edit saves have names that can stand in a URL.

    Raises:
        MotionMindError: a name has a part "." or "..", which browsers remove.
    """
    for one in each(edit):
        if isinstance(one, SavePosture) and one.posture is not None and {".", ".."} & set(one.name.split("/")):
            raise MotionMindError(f"“{displayed(one.name)}” cannot be the name of a posture: choose another")


def missing_in(state: State, has_corpus: Callable[[str], bool], marks: Marks) -> list[str]:
    """Return a line for each thing that a piece needs and lacks: missing corpora, and frames missing in the others.

    Args:
        state: the piece.
        has_corpus: returns whether a corpus exists.
        marks: marks of the movements.
    """
    lines: dict[str, None] = {}
    for name in sorted(corpora_of(state)):
        if not has_corpus(name):
            lines[f"corpus {displayed(name)} is missing: build it again under that name"] = None
    for block in state.blocks:
        if not marks.has(key := key_of(block), block.last) and has_corpus(corpus_of(block.source) or state.corpus):
            lines[f"the piece needs frame {block.last} of {displayed(key)}, which is missing"] = None
    return list(lines)


def corpora_of(state: State) -> set[str]:
    """Return the names of the corpora that a piece needs."""
    return {state.corpus, *(corpus_of(block.source) for block in state.blocks)} - {""}


def corpus_of(source: str) -> str:
    """Return the name of a movement's corpus; "" if it has none."""
    name, slash, _ = source.partition("/")
    return name if slash and f"{name}/" != OWN else ""
