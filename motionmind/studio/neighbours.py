"""Neighbours in a piece: the seam between two stretches, its two ends, and what a choreographer decided there."""

from __future__ import annotations

from typing import NamedTuple

import msgspec

from motionmind.studio.asks import Ask
from motionmind.studio.edits import Block, Decision

OWN = "own/"  # prefix of keys of saved postures
MIRRORED = "~"

Pair = tuple[str, str]  # ids of the blocks before and after a seam


class Verdict(msgspec.Struct, frozen=True):
    """A choreographer's requests and decision at a seam.

    Attributes:
        ask: the request for its insertion.
        chosen: number of the chosen insertion, counted from 1.
        decision: a "locked" insertion does not change until it is unlocked; a "discarded" one is left out.
        corpus: the corpus of a locked insertion, whatever the piece's is now; "" unless it is locked.
    """

    ask: Ask = Ask()
    chosen: int = 1
    decision: Decision = "open"
    corpus: str = ""


class End(msgspec.Struct, frozen=True, omit_defaults=True):
    """One side of a seam.

    Attributes:
        key: key of the movement, with `~` if it is mirrored.
        frame: the frame at the seam.
        moves: whether the body moves there; a block of one frame is a posture.
        rests: whether the posture is held, so that the body stands still there.
        pace: speed of the movement there, as a multiple of the recorded one; None if it is that, or a posture.
    """

    key: str
    frame: int
    moves: bool
    rests: bool = False
    pace: float | None = None  # not 1.0: only a singleton is left out of the question, as before there were paces


class Seam(NamedTuple):
    """A seam between two neighbours, or between the end of a block and its beginning, when it repeats.

    Attributes:
        left: the block before it.
        right: the block after it.
        verdict: requests and decision.
    """

    left: Block
    right: Block
    verdict: Verdict

    @property
    def pair(self) -> Pair:
        """The ids of both blocks."""
        return self.left.id, self.right.id

    @property
    def goes_on(self) -> bool:
        """Whether the movement continues as recorded or holds its posture, so that there is nothing to judge."""
        one, other = self.left, self.right
        alike = (one.first, one.last) == (other.first, other.last)
        is_next = other.first - one.last in (0, 1) and one.pace == other.pace
        continues = alike if one.hold or other.hold else is_next
        return continues and key_of(one) == key_of(other)

    @property
    def ends(self) -> tuple[End, End]:
        """Both sides: the end of the left block and the beginning of the right one."""
        return _end(self.left, self.left.last), _end(self.right, self.right.first)


def _end(block: Block, frame: int) -> End:
    moves = block.last > block.first
    return End(key_of(block), frame, moves, block.hold > 0.0, block.pace if moves and block.pace != 1.0 else None)


def key_of(block: Block) -> str:
    """Return the key of the movement that a block shows, with `~` if it is mirrored."""
    return MIRRORED + block.source if block.mirrored else block.source
