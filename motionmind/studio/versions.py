"""Named versions of a piece: what they keep, and how the piece differs from them, in words."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.studio import notes
from motionmind.studio.dancers import Cast, cast_differences
from motionmind.studio.edits import Annotate, Block, Erase, GoBack, Note, SaveVersion
from motionmind.studio.notes import Notes

_MAX_VERSIONS = 200
_SAME_LENGTH_S = 0.005


class Version(NamedTuple):
    """A version of a piece.

    Attributes:
        blocks: its blocks, in order.
        verdicts: the requests and decisions at its seams.
        notes: its notes.
        about: origin of its order.
        cast: its dancers.
    """

    blocks: tuple[Block, ...]
    verdicts: Mapping[tuple[str, str], Any]
    notes: Notes
    about: Mapping[str, Any]
    cast: Cast = Cast()


class _Piece(Protocol):
    """The parts of a project's state that are kept."""

    @property
    def blocks(self) -> tuple[Block, ...]: ...
    @property
    def verdicts(self) -> Mapping[tuple[str, str], Any]: ...
    @property
    def notes(self) -> Notes: ...
    @property
    def about(self) -> Mapping[str, Any]: ...
    @property
    def cast(self) -> Cast: ...
    @property
    def versions(self) -> Mapping[str, Version]: ...


def changed(state: _Piece, edit: Annotate | Erase | SaveVersion | GoBack) -> dict[str, Any]:
    """Return the fields of a state that an edit of notes or versions changes.

    Raises:
        MotionMindError: there is no such note, moment or version, or too many of them.
    """
    if isinstance(edit, Annotate | Erase):
        return {"notes": notes.changed(state.notes, edit, state.blocks)}
    if isinstance(edit, SaveVersion) and edit.keep:
        if len(state.versions) >= _MAX_VERSIONS and edit.name not in state.versions:
            raise MotionMindError(f"a project has at most {_MAX_VERSIONS} versions: delete some")
        version = Version(state.blocks, state.verdicts, state.notes, state.about, state.cast)
        return {"versions": {**state.versions, edit.name: version}}
    if edit.name not in state.versions:
        raise MotionMindError(f"there is no version “{displayed(edit.name)}”")
    if isinstance(edit, SaveVersion):
        return {"versions": {name: one for name, one in state.versions.items() if name != edit.name}}
    return state.versions[edit.name]._asdict()


def differences(before: Version, now: Version, seconds: tuple[float, float]) -> list[str]:
    """Describe how a piece differs from a version, in a few words each; nothing if it does not.

    Args:
        before: the version.
        now: the piece.
        seconds: the durations of both.
    """
    old, new = ({block.id: block for block in one.blocks} for one in (before, now))
    kept = [name for name in old if name in new]
    places = {name: place for place, name in enumerate(new)}
    counts = {
        "added": len(new) - len(kept),
        "removed": len(old) - len(kept),
        "moved": len(kept) - _longest_rising([places[name] for name in kept]),
        "trimmed": sum((old[name].first, old[name].last) != (new[name].first, new[name].last) for name in kept),
        "mirrored": sum(old[name].mirrored != new[name].mirrored for name in kept),
    }
    words = [f"{_counted(count, 'stretch', 'stretches')} {verb}" for verb, count in counts.items() if count]
    seams = pairwise(block.id for block in now.blocks)
    others = sum(_judged(before, seam) != _judged(now, seam) for seam in seams if seam[0] in old and seam[1] in old)
    words += [f"{_counted(others, 'insertion', 'insertions')} changed"] * bool(others)
    texts = sum(_is_other(before.notes.get(name), now.notes.get(name), new) for name in {*before.notes, *now.notes})
    words += [f"{_counted(texts, 'note', 'notes')} changed"] * bool(texts)
    words += cast_differences(before.cast, now.cast)
    longer = seconds[1] - seconds[0]
    if abs(longer) > _SAME_LENGTH_S:
        words.append(f"{abs(longer):.2f} s {'longer' if longer > 0.0 else 'shorter'}")
    return words


def _is_other(before: Note | None, now: Note | None, blocks: Mapping[str, Block]) -> bool:
    """Return whether a note has changed, other than by following its movement when its block went."""
    if before is None or now is None or before.block in blocks:
        return before != now
    return (before.kind, before.text) != (now.kind, now.text)


def _judged(version: Version, seam: tuple[str, str]) -> Any:
    """Return the verdict on a seam; None if it is as at first."""
    verdict = version.verdicts.get(seam)
    return None if verdict is None or verdict == type(verdict)() else verdict


def _counted(count: int, one: str, many: str) -> str:
    return f"{count} {one if count == 1 else many}"


def _longest_rising(places: Sequence[int]) -> int:
    """Return the length of the longest rising subsequence: the stretches that need not move."""
    ends: list[int] = []
    for place in places:
        at = bisect_left(ends, place)
        ends[at : at + 1] = [place]
    return len(ends)
