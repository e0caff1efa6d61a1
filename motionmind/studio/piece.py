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
from typing import Any

import msgspec

from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.studio.dancers import Cast, PutDancer, RemoveDancer, SetFormations, recast
from motionmind.studio.edits import (
    MAX_BLOCKS,
    Arrange,
    Block,
    Choose,
    Decide,
    Delete,
    Edit,
    HoldPosture,
    Insert,
    Mirror,
    Move,
    Play,
    SavePosture,
    Single,
    Split,
    Trim,
    Wish,
    each,
)
from motionmind.studio.neighbours import MIRRORED, OWN, Pair, Seam, Verdict
from motionmind.studio.notes import Notes, follow
from motionmind.studio.settings import SetMusic, SetReference, Setting, changes_of
from motionmind.studio.versions import Version, changed


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
        notes, versions: the notes on it, by id, and versions of it, by name.
        tempo: counts a minute.
        counts: counts of a phrase.
        reference: the video beside it.
        stage: width and depth of the stage around the origin, metres; None for none.
        cast: the dancers.
        music: the music that it plays with.
    """

    title: str = ""
    corpus: str = ""
    blocks: tuple[Block, ...] = ()
    verdicts: Mapping[Pair, Verdict] = field(default_factory=dict)
    postures: Mapping[str, str] = field(default_factory=dict)
    used: frozenset[str] = frozenset()
    about: Mapping[str, Any] = field(default_factory=dict)
    notes: Notes = field(default_factory=dict)
    versions: Mapping[str, Version] = field(default_factory=dict)
    tempo: float = 120.0
    counts: int = 8
    reference: SetReference = field(default_factory=SetReference)
    stage: tuple[float, float] | None = None
    cast: Cast = field(default_factory=Cast)
    music: SetMusic = field(default_factory=SetMusic)

    @cached_property
    def seams(self) -> tuple[Seam, ...]:
        """The seams in order: one after each block but the last, and before it one within each block that repeats."""
        played = (block for block in self.blocks for _ in range(min(block.repeats, 2)))
        return tuple(
            Seam(one, other, self.verdicts.get((one.id, other.id), Verdict())) for one, other in pairwise(played)
        )

    @cached_property
    def _by_pair(self) -> dict[Pair, Seam]:
        return {seam.pair: seam for seam in self.seams}

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
        for name in (left, right):
            self.place(name)
        if (seam := self._by_pair.get((left, right))) is None:
            raise MotionMindError("these two stretches are no longer neighbours")
        return seam

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
    return reduce(_followed, each(edit), state)


def apply_all(edits: Iterable[Edit], state: State | None = None) -> State:
    """Return the state after several edits of `state` or of the empty project; raise the errors of `apply`."""
    return reduce(apply, edits, state or State())


def _followed(state: State, edit: Single) -> State:
    after = _apply(state, edit)
    return replace(after, notes=follow(after.notes, state.blocks, after.blocks))


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
            time: dict[str, Any] = {"repeats": 1} if first == last else {"hold": 0.0}
            trimmed = _checked(state, msgspec.structs.replace(block, first=first, last=last, **time))
            return _put(_forget_ends(state, block, begins=first != block.first, ends=last != block.last), trimmed)
        case HoldPosture(name, seconds):
            block = state.block(name)
            held = _checked(state, msgspec.structs.replace(block, hold=seconds))
            at_rest = (held.hold > 0.0) != (block.hold > 0.0)  # its insertions then begin and end at rest
            return _put(_forget_ends(state, block, begins=at_rest, ends=at_rest), held)
        case Play(name, pace, repeats):
            block = state.block(name)
            played = _checked(state, msgspec.structs.replace(block, pace=pace, repeats=repeats))
            is_other = pace != block.pace
            return _put(_forget_ends(state, block, begins=is_other, ends=is_other), played)
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
            chosen = Verdict(_open(state.seam(left, right)).ask, alternative)
            return replace(state, verdicts={**state.verdicts, (left, right): chosen})
        case Decide(left, right, decision):
            verdict = state.seam(left, right).verdict
            corpus = (verdict.corpus or state.corpus) if decision == "locked" else ""
            decided = Verdict(verdict.ask, verdict.chosen, decision, corpus)
            return replace(state, verdicts={**state.verdicts, (left, right): decided})
        case Wish(left=left, right=right):
            _open(state.seam(left, right))
            passing = tuple(msgspec.structs.replace(one, posture=state.stable(one.posture)) for one in edit.ask.passing)
            wished = Verdict(msgspec.structs.replace(edit.ask, passing=passing))
            return replace(state, verdicts={**state.verdicts, (left, right): wished})
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
        case Setting():
            return replace(state, **changes_of(edit))
        case PutDancer() | RemoveDancer() | SetFormations():
            return replace(state, cast=recast(state.cast, edit))
        case _:
            return replace(state, **changed(state, edit))


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
    """Return the block with a stable source; raise MotionMindError if it ends before it begins, or cannot be held."""
    if block.first > block.last:
        raise MotionMindError(f"a stretch cannot end before it begins: frames {block.first} to {block.last}")
    if block.hold and block.first < block.last:
        raise MotionMindError(f"only a posture can be held: this stretch has frames {block.first} to {block.last}")
    if block.repeats > 1 and block.first == block.last:
        raise MotionMindError("a posture cannot repeat: hold it for longer")
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
    if not block.first < edit.at <= block.last:
        raise MotionMindError(f"cannot split at frame {edit.at}: the stretch has frames {block.first} to {block.last}")
    if edit.turn > block.repeats:
        raise MotionMindError(f"cannot split playing {edit.turn}: the stretch plays {block.repeats} times")
    once, after = msgspec.structs.replace(block, repeats=1), block.repeats - edit.turn
    half, rest = edit.half if edit.turn > 1 else block.id, edit.rest if after else edit.id
    if half is None or rest is None:
        raise MotionMindError("to split a stretch that repeats, give new ids to its other playings")
    cut = [
        *([msgspec.structs.replace(block, repeats=edit.turn - 1)] if edit.turn > 1 else []),
        msgspec.structs.replace(once, id=half, last=edit.at - 1),
        msgspec.structs.replace(once, id=edit.id, first=edit.at),
        *([msgspec.structs.replace(block, id=rest, repeats=after)] if after else []),
    ]
    blocks = _check_count((*state.blocks[:place], *cut, *state.blocks[place + 1 :]))
    names = [one.id for one in cut if one.id != block.id]
    for number, name in enumerate(names):
        _check_new(state, name)
        if name in names[:number]:
            raise MotionMindError(f"id {displayed(name)} is taken: a new stretch needs a new id")
    # The verdict on the seam at the block's end moves with that end; that on its repeats holds at each of them.
    again = block.id, block.id
    verdicts = {
        (rest if left == block.id else left, right): verdict
        for (left, right), verdict in state.verdicts.items()
        if (left, right) != again
    }
    if (verdict := state.verdicts.get(again)) is not None:
        played = (one.id for one in cut for _ in range(min(one.repeats, 2)))
        verdicts |= dict.fromkeys(set(pairwise(played)) - {(half, edit.id)}, verdict)
    return replace(state, blocks=blocks, verdicts=verdicts, used=state.used | set(names))


def _put(state: State, block: Block) -> State:
    """Replace the block that has the same id."""
    return replace(state, blocks=tuple(block if one.id == block.id else one for one in state.blocks))


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


def _saved(state: State, name: str, posture: str | None) -> State:
    postures = dict(state.postures)
    if posture is not None:
        postures[name] = posture
    elif postures.pop(name, None) is None:
        raise MotionMindError(f"no posture is saved as {displayed(name)}")
    return replace(state, postures=postures)
