"""The state of a project after its edits: blocks in order, and requests and decisions at the seams.

Everything here is pure: `apply` returns a new state, and a project's state follows from its edits, without the undone
ones, applied in order. `motionmind.studio.checks` checks once, when an edit comes in, that movements exist and are long
enough.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from itertools import pairwise
from typing import Any, NamedTuple

import msgspec

from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.studio.edits import (
    MAX_BLOCKS,
    Arrange,
    Ask,
    Block,
    Choose,
    Decide,
    Decision,
    Delete,
    Edit,
    Insert,
    Mirror,
    Move,
    SavePosture,
    SetCorpus,
    SetTitle,
    Single,
    Split,
    Trim,
    Wish,
    each,
)

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


class End(msgspec.Struct, frozen=True):
    """One side of a seam.

    Attributes:
        key: key of the movement, with `~` if it is mirrored.
        frame: the frame at the seam.
        moves: whether the body moves there; a block of one frame is a held posture.
    """

    key: str
    frame: int
    moves: bool


class Found(msgspec.Struct, frozen=True):
    """A movement that was found for a seam.

    Attributes:
        key: key of the movement.
        seconds: its duration.
        words: a description for choreographers.
    """

    key: str
    seconds: float
    words: str


class Finding(msgspec.Struct, frozen=True):
    """The engine's answer at a seam: a fact, which undo never removes.

    Attributes:
        finding: the hash of its question (`question_of`).
        abrupt: whether the transition is abrupt for the corpus.
        words: the reason, or the reason why nothing was found.
        insertions: movements to insert, the best first; None before the search.
    """

    finding: str
    abrupt: bool
    words: str
    insertions: tuple[Found, ...] | None


class Seam(NamedTuple):
    """A seam between two neighbours.

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
        return key_of(one) == key_of(other) and other.first - one.last in (0, 1)

    @property
    def ends(self) -> tuple[End, End]:
        """Both sides: the end of the left block and the beginning of the right one."""
        one, other = self.left, self.right
        return (
            End(key_of(one), one.last, one.last > one.first),
            End(key_of(other), other.first, other.last > other.first),
        )


@dataclass(frozen=True)
class State:
    """The state of a project.

    Attributes:
        title: the piece's title.
        corpus: name of the corpus that judges and smooths it.
        blocks: the blocks in order; their ids differ.
        verdicts: verdicts on seams by the ids of their two blocks, also of past seams, which may come back.
        postures: keys of saved postures' movements, by name.
        used: ids of all blocks, past and present.
        about: origin of the present order, from `Arrange`.
    """

    title: str = ""
    corpus: str = ""
    blocks: tuple[Block, ...] = ()
    verdicts: Mapping[Pair, Verdict] = field(default_factory=dict)
    postures: Mapping[str, str] = field(default_factory=dict)
    used: frozenset[str] = frozenset()
    about: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def seams(self) -> tuple[Seam, ...]:
        """The seams in order, one fewer than blocks."""
        return tuple(
            Seam(one, other, self.verdicts.get((one.id, other.id), Verdict())) for one, other in pairwise(self.blocks)
        )

    @cached_property
    def _places(self) -> dict[str, int]:
        return {block.id: place for place, block in enumerate(self.blocks)}

    def place(self, block: str) -> int:
        """Return the index of a block; raise MotionMindError if there is no such block."""
        try:
            return self._places[block]
        except KeyError:
            raise MotionMindError("this stretch is no longer in the piece") from None

    def block(self, block: str) -> Block:
        """Return the block with an id; raise MotionMindError if there is none."""
        return self.blocks[self.place(block)]

    def seam(self, left: str, right: str) -> Seam:
        """Return the seam between two neighbours; raise MotionMindError if they are not neighbours."""
        place = self.place(left)
        if self.place(right) != place + 1:
            raise MotionMindError("these two stretches are no longer neighbours")
        return self.seams[place]

    def stable(self, key: str) -> str:
        """Return the key of the movement that now holds a saved posture; other keys unchanged.

        Raises:
            MotionMindError: there is no such posture.
        """
        mark, bare = (MIRRORED, key[1:]) if key.startswith(MIRRORED) else ("", key)
        if not bare.startswith(OWN):
            return key
        name = bare.removeprefix(OWN)
        if name not in self.postures:
            raise MotionMindError(f"no posture is saved as {displayed(name)}")
        return mark + self.postures[name]


def key_of(block: Block) -> str:
    """Return the key of the movement that a block shows, with `~` if it is mirrored."""
    return MIRRORED + block.source if block.mirrored else block.source


def apply(state: State, edit: Edit) -> State:
    """Return the state after an edit.

    Raises:
        MotionMindError: the edit does not apply to the state; the message says why.

    >>> from motionmind.studio.edits import Insert, Split
    >>> from motionmind.studio.piece import State, apply
    >>> state = apply(State(), Insert("b1", "ballet/adagio", 0, 40))
    >>> [(block.id, block.first, block.last) for block in apply(state, Split("b1", 10, "b2")).blocks]
    [('b1', 0, 9), ('b2', 10, 40)]
    """
    return reduce(_apply, each(edit), state)


def apply_all(edits: Iterable[Edit], state: State | None = None) -> State:
    """Return the state after several edits of `state` or of the empty project; raise the errors of `apply`."""
    return reduce(apply, edits, state or State())


def _apply(state: State, edit: Single) -> State:  # noqa: PLR0911 (one case an edit)
    match edit:
        case Insert():
            block = _checked(state, edit.block)
            _check_new(state, block.id)
            before = len(state.blocks) if edit.before is None else state.place(edit.before)
            blocks = (*state.blocks[:before], block, *state.blocks[before:])
            return replace(state, blocks=_check_count(blocks), used=state.used | {block.id})
        case Move():
            return _moved(state, edit)
        case Trim(block=name, first=first, last=last):
            block = state.block(name)
            trimmed = _checked(state, msgspec.structs.replace(block, first=first, last=last))
            reset = _forget_ends(state, block, begins=first != block.first, ends=last != block.last)
            return _put(reset, trimmed)
        case Split():
            return _split(state, edit)
        case Mirror(name):
            block = state.block(name)
            mirrored = msgspec.structs.replace(block, mirrored=not block.mirrored)
            return _put(_forget_ends(state, block, begins=True, ends=True), mirrored)
        case Delete(name):
            place = state.place(name)
            return replace(state, blocks=state.blocks[:place] + state.blocks[place + 1 :])
        case Choose(left, right, alternative):
            verdict = _open(state.seam(left, right))
            return _judged(state, (left, right), Verdict(verdict.ask, alternative))
        case Decide(left, right, decision):
            verdict = state.seam(left, right).verdict
            corpus = (verdict.corpus or state.corpus) if decision == "locked" else ""
            return _judged(state, (left, right), Verdict(verdict.ask, verdict.chosen, decision, corpus))
        case Wish(left=left, right=right):
            _open(state.seam(left, right))
            passing = tuple(msgspec.structs.replace(one, posture=state.stable(one.posture)) for one in edit.ask.passing)
            return _judged(state, (left, right), Verdict(msgspec.structs.replace(edit.ask, passing=passing)))
        case Arrange(given, about):
            blocks = tuple(_checked(state, block) for block in given)
            names = {block.id for block in blocks}
            if len(names) < len(blocks):
                raise MotionMindError("two stretches have the same id")
            for block in blocks:
                if block.id in state.used and block not in state.blocks:
                    raise MotionMindError(f"{block.id} is the id of another stretch: a new one needs a new id")
            return replace(arranged(state, blocks), used=state.used | names, about=about)
        case SavePosture(name, posture):
            return _saved(state, name, posture)
        case SetCorpus(name):
            return replace(state, corpus=name)
        case SetTitle(title):
            return replace(state, title=title)


def arranged(state: State, blocks: tuple[Block, ...]) -> State:
    """Return a piece with other blocks; a new seam with the ends of an old one inherits its verdict, unlocked.

    Args:
        state: the piece.
        blocks: the blocks; one that was in the piece has its id if it is the same stretch.
    """
    verdicts = {seam.ends: seam.verdict for seam in state.seams if seam.verdict != Verdict()}
    after = replace(state, blocks=blocks)
    new = {
        seam.pair: Verdict(old.ask, old.chosen, "discarded" if old.decision == "discarded" else "open")
        for seam in after.seams
        if seam.pair not in state.verdicts and (old := verdicts.get(seam.ends))
    }
    return replace(after, verdicts={**state.verdicts, **new}) if new else after


def _checked(state: State, block: Block) -> Block:
    """Return the block with a stable source; raise MotionMindError if it ends before it begins."""
    if block.first > block.last:
        raise MotionMindError(f"a stretch cannot end before it begins: frames {block.first} to {block.last}")
    source, mirrored = state.stable(block.source), block.mirrored
    if source.startswith(MIRRORED):
        source, mirrored = source[1:], not mirrored
    return msgspec.structs.replace(block, source=source, mirrored=mirrored)


def _check_new(state: State, block: str) -> None:
    if block in state.used:
        raise MotionMindError(f"id {displayed(block)} is taken: a new stretch needs a new id")


def _check_count(blocks: tuple[Block, ...]) -> tuple[Block, ...]:
    if len(blocks) > MAX_BLOCKS:
        raise MotionMindError(f"a piece has at most {MAX_BLOCKS:,} stretches")
    return blocks


def _moved(state: State, edit: Move) -> State:
    place = state.place(edit.block)
    if edit.before == edit.block:
        raise MotionMindError("a stretch cannot come before itself")
    block, rest = state.blocks[place], state.blocks[:place] + state.blocks[place + 1 :]
    before = len(rest)
    if edit.before is not None:
        before = state.place(edit.before)
        before -= before > place
    return replace(state, blocks=(*rest[:before], block, *rest[before:]))


def _split(state: State, edit: Split) -> State:
    place = state.place(edit.block)
    block = state.blocks[place]
    _check_new(state, edit.id)
    if not block.first < edit.at <= block.last:
        raise MotionMindError(f"cannot split at frame {edit.at}: the stretch has frames {block.first} to {block.last}")
    one = msgspec.structs.replace(block, last=edit.at - 1)
    other = msgspec.structs.replace(block, first=edit.at, id=edit.id)
    blocks = _check_count((*state.blocks[:place], one, other, *state.blocks[place + 1 :]))
    # The verdict on the seam at the block's end moves with that end.
    verdicts = {
        (edit.id if left == block.id else left, right): verdict for (left, right), verdict in state.verdicts.items()
    }
    return replace(state, blocks=blocks, verdicts=verdicts, used=state.used | {edit.id})


def _put(state: State, block: Block) -> State:
    """Replace the block that has the same id."""
    place = state.place(block.id)
    return replace(state, blocks=(*state.blocks[:place], block, *state.blocks[place + 1 :]))


def _forget_ends(state: State, block: Block, *, begins: bool, ends: bool) -> State:
    """Reset the decisions at a block's changed ends, where the search will find other insertions.

    Raises:
        MotionMindError: an insertion is locked there.
    """
    verdicts = dict(state.verdicts)
    for pair, verdict in state.verdicts.items():
        if (begins and pair[1] == block.id) or (ends and pair[0] == block.id):
            verdicts[pair] = Verdict(verdict.ask)
    for seam in state.seams:
        if verdicts.get(seam.pair, seam.verdict) != seam.verdict:
            _open(seam)
    return replace(state, verdicts=verdicts)


def _open(seam: Seam) -> Verdict:
    """Return the verdict on a seam; raise MotionMindError if it is locked."""
    if seam.verdict.decision == "locked":
        raise MotionMindError("this would change a locked insertion: unlock it first")
    return seam.verdict


def _judged(state: State, pair: Pair, verdict: Verdict) -> State:
    return replace(state, verdicts={**state.verdicts, pair: verdict})


def _saved(state: State, name: str, posture: str | None) -> State:
    postures = dict(state.postures)
    if posture is not None:
        postures[name] = posture
    elif postures.pop(name, None) is None:
        raise MotionMindError(f"no posture is saved as {displayed(name)}")
    return replace(state, postures=postures)
