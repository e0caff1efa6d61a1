"""The state of a project that its edits lead to: blocks in their order, and what is wished and decided at the seams.

Everything here is pure: `apply` leads from one state to the next and changes nothing, so the state is that of the edits
that are not undone, applied in their order. Whether movements exist and are long enough is asked once, when an edit
comes in (`motionmind.studio.checks`).
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
    MOST_BLOCKS,
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

OWN = "own/"  # keys of saved postures
MIRRORED = "~"

Pair = tuple[str, str]  # ids of two blocks, the one before and the one after a seam


class Verdict(msgspec.Struct, frozen=True):
    """A choreographer's word on a seam.

    Attributes:
        ask: the wish for its insertion.
        chosen: number of the insertion chosen of those found, counted from 1.
        decision: "locked" insertions change only when they are opened again; "discarded" ones are left out.
        corpus: the corpus that a locked insertion was found in, whatever the piece's is now; "" of one that is not.
    """

    ask: Ask = Ask()
    chosen: int = 1
    decision: Decision = "open"
    corpus: str = ""


class End(msgspec.Struct, frozen=True):
    """One side of a seam.

    Attributes:
        key: the movement, its key with `~` if it is mirrored.
        frame: the frame at the seam.
        moves: whether the movement goes on there; a block of one frame is a posture, held.
    """

    key: str
    frame: int
    moves: bool


class Found(msgspec.Struct, frozen=True):
    """A movement that was found for a seam.

    Attributes:
        key: the movement.
        seconds: its length.
        words: what there is to know of it, in a choreographer's words.
    """

    key: str
    seconds: float
    words: str


class Finding(msgspec.Struct, frozen=True):
    """The engine's answer at a seam: a fact, which no undo takes back.

    Attributes:
        finding: the question that it answers (`question_of`).
        abrupt: whether the corpus does not know the transition.
        words: why, or why nothing was found.
        insertions: what can be inserted, the best first; None as long as nobody has searched.
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
        verdict: the word on it.
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
        """Whether the movement goes on as recorded, or stays in its posture: nothing is to be judged."""
        one, other = self.left, self.right
        return key_of(one) == key_of(other) and other.first - one.last in (0, 1)

    @property
    def ends(self) -> tuple[End, End]:
        """Both sides: where the left block ends and where the right one begins."""
        one, other = self.left, self.right
        return (
            End(key_of(one), one.last, one.last > one.first),
            End(key_of(other), other.first, other.last > other.first),
        )


@dataclass(frozen=True)
class State:
    """A project as it stands.

    Attributes:
        title: the piece's title.
        corpus: name of the corpus that judges and smooths it.
        blocks: the blocks in their order; their ids differ.
        verdicts: words on seams by the ids of their two blocks, also of seams that were and may be again.
        postures: keys of the movements that saved postures are, by name.
        used: ids of all blocks that there ever were.
        about: how the present order came about, if it was given as a whole.
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
        """The seams, in order; one fewer than there are blocks."""
        return tuple(
            Seam(one, other, self.verdicts.get((one.id, other.id), Verdict())) for one, other in pairwise(self.blocks)
        )

    @cached_property
    def _places(self) -> dict[str, int]:
        return {block.id: place for place, block in enumerate(self.blocks)}

    def place(self, block: str) -> int:
        """Return the place of a block among the others; MotionMindError if there is no such block."""
        try:
            return self._places[block]
        except KeyError:
            raise MotionMindError("this stretch is not in the piece any more") from None

    def block(self, block: str) -> Block:
        """Return the block of that id; MotionMindError if there is none."""
        return self.blocks[self.place(block)]

    def seam(self, left: str, right: str) -> Seam:
        """Return the seam between two neighbours; MotionMindError if they are not neighbours."""
        place = self.place(left)
        if self.place(right) != place + 1:
            raise MotionMindError("these two stretches do not follow each other any more")
        return self.seams[place]

    def stable(self, key: str) -> str:
        """Return the key of the movement that a saved posture is now; other keys as they are.

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
        MotionMindError: the edit does not fit the state; the message says why.

    >>> from motionmind.studio.edits import Insert, Split
    >>> from motionmind.studio.piece import State, apply
    >>> state = apply(State(), Insert("b1", "ballet/adagio", 0, 40))
    >>> [(block.id, block.first, block.last) for block in apply(state, Split("b1", 10, "b2")).blocks]
    [('b1', 0, 9), ('b2', 10, 40)]
    """
    return reduce(_apply, each(edit), state)


def apply_all(edits: Iterable[Edit], state: State | None = None) -> State:
    """Return the state after several edits, from the empty project on or from `state`; errors as of `apply`."""
    return reduce(apply, edits, state or State())


def _apply(state: State, edit: Single) -> State:  # noqa: PLR0911 (one case an edit)
    match edit:
        case Insert():
            block = _checked(state, edit.block)
            _check_new(state, block.id)
            before = len(state.blocks) if edit.before is None else state.place(edit.before)
            blocks = (*state.blocks[:before], block, *state.blocks[before:])
            return replace(state, blocks=_countable(blocks), used=state.used | {block.id})
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
            found_in = (verdict.corpus or state.corpus) if decision == "locked" else ""
            return _judged(state, (left, right), Verdict(verdict.ask, verdict.chosen, decision, found_in))
        case Wish(left=left, right=right):
            _open(state.seam(left, right))
            passing = tuple(msgspec.structs.replace(one, posture=state.stable(one.posture)) for one in edit.ask.passing)
            return _judged(state, (left, right), Verdict(msgspec.structs.replace(edit.ask, passing=passing)))
        case Arrange(given, about):
            blocks = tuple(_checked(state, block) for block in given)
            names = {block.id for block in blocks}
            if len(names) < len(blocks):
                raise MotionMindError("the stretches of an order must differ in their ids")
            for block in blocks:
                if block.id in state.used and block not in state.blocks:
                    raise MotionMindError(f"{block.id} is another stretch: a new one needs a new id")
            return replace(arranged(state, blocks), used=state.used | names, about=about)
        case SavePosture(name, posture):
            return _saved(state, name, posture)
        case SetCorpus(name):
            return replace(state, corpus=name)
        case SetTitle(title):
            return replace(state, title=title)


def arranged(state: State, blocks: tuple[Block, ...]) -> State:
    """Return a piece with its blocks in another order, or cut into others: a word on a seam goes with the seam's ends.

    Args:
        state: the piece.
        blocks: the blocks; one that was in the piece has its id if it is the same stretch.
    """
    words = {seam.ends: seam.verdict for seam in state.seams if seam.verdict != Verdict()}
    after = replace(state, blocks=blocks)
    new = {
        seam.pair: Verdict(word.ask, word.chosen, "discarded" if word.decision == "discarded" else "open")
        for seam in after.seams
        if seam.pair not in state.verdicts and (word := words.get(seam.ends))
    }
    return replace(after, verdicts={**state.verdicts, **new}) if new else after


def _checked(state: State, block: Block) -> Block:
    """The block, its source a movement that stays; MotionMindError if it ends before it begins."""
    if block.first > block.last:
        raise MotionMindError(f"a stretch cannot go from frame {block.first} back to frame {block.last}")
    source, mirrored = state.stable(block.source), block.mirrored
    if source.startswith(MIRRORED):
        source, mirrored = source[1:], not mirrored
    return msgspec.structs.replace(block, source=source, mirrored=mirrored)


def _check_new(state: State, block: str) -> None:
    if block in state.used:
        raise MotionMindError(f"there is, or was, a stretch {displayed(block)}: a new one needs a new id")


def _countable(blocks: tuple[Block, ...]) -> tuple[Block, ...]:
    if len(blocks) > MOST_BLOCKS:
        raise MotionMindError(f"a piece has at most {MOST_BLOCKS:,} stretches")
    return blocks


def _moved(state: State, edit: Move) -> State:
    place = state.place(edit.block)
    if edit.before == edit.block:
        raise MotionMindError("a stretch cannot stand before itself")
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
        raise MotionMindError(
            f"the stretch goes from frame {block.first} to {block.last}: frame {edit.at} does not split it"
        )
    one = msgspec.structs.replace(block, last=edit.at - 1)
    other = msgspec.structs.replace(block, first=edit.at, id=edit.id)
    blocks = _countable((*state.blocks[:place], one, other, *state.blocks[place + 1 :]))
    # The word on the seam at the block's end goes with that end.
    verdicts = {
        (edit.id if left == block.id else left, right): verdict for (left, right), verdict in state.verdicts.items()
    }
    return replace(state, blocks=blocks, verdicts=verdicts, used=state.used | {edit.id})


def _put(state: State, block: Block) -> State:
    """The state with a block in the place of the one that has its id."""
    place = state.place(block.id)
    return replace(state, blocks=(*state.blocks[:place], block, *state.blocks[place + 1 :]))


def _forget_ends(state: State, block: Block, *, begins: bool, ends: bool) -> State:
    """The state with no decision at the ends of a block that change: nobody has seen what will be found there.

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
    """The word on a seam; MotionMindError if it is locked."""
    if seam.verdict.decision == "locked":
        raise MotionMindError("an insertion that this changes is locked: unlock it first")
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
