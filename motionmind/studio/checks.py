"""Whether an edit that comes in can be: the movements that it names exist, and are long enough."""

from __future__ import annotations

from collections.abc import Callable

from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.studio.edits import Arrange, Block, Edit, Insert, SavePosture, Trim, Wish, each
from motionmind.studio.piece import State, key_of


def check_movements(state: State, edit: Edit, frames: Callable[[str], int]) -> None:
    """Check that the movements which an edit names exist and are long enough.

    Args:
        state: the state that the edit leads to.
        edit: the edit.
        frames: returns the number of frames of the movement of a key; MotionMindError if there is none.

    Raises:
        MotionMindError: one does not.
    """
    for one in each(edit):
        match one:
            case Insert(id=name) | Trim(block=name) if name in state.used:
                blocks = [block for block in state.blocks if block.id == name]
            case Arrange(blocks=blocks):
                pass
            case Wish(passing=passing):
                blocks = [Block("passing", state.stable(at.posture), at.frame, at.frame) for at in passing]
            case SavePosture(posture=str(posture)):
                blocks = [Block("posture", posture, 0, 0)]
            case _:
                continue
        for block in blocks:
            count = frames(key_of(block))
            if block.last >= count:
                raise MotionMindError(
                    f"{displayed(block.source)} has frames 0 to {count - 1}, no frame {block.last}: end sooner"
                )
