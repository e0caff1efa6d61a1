"""Clips and faults of a corpus on disk: one entry each, decoded on access, and columns beside them.

A corpus of a hundred hours has tens of thousands of clips. Loading it decodes none of them: a tween needs only the
start and the weight of every clip, and the columns hold these.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, TypeVar, overload

import msgspec
import numpy as np

from motionmind._typing import Bytes, Floats, Int32s, Ints
from motionmind.corpus.clip import Clip

_Kind = TypeVar("_Kind")


class Packed(NamedTuple):
    """A line of JSON for each of n entries.

    Attributes:
        text: the lines, one after the other, as UTF-8 [B].
        lines: start of each line, then the end of the text [n + 1].
    """

    text: Bytes
    lines: Ints

    @classmethod
    def of(cls, entries: Iterable[object]) -> Packed:
        """Pack entries."""
        encoder = msgspec.json.Encoder()
        lines = [encoder.encode(entry) + b"\n" for entry in entries]
        return cls(np.frombuffer(b"".join(lines), np.uint8), np.cumsum([0, *map(len, lines)], dtype=np.int64))


class Entries(Sequence[_Kind]):
    """Packed entries, decoded on access.

    Args:
        packed: the entries.
        kind: the type of an entry.
    """

    def __init__(self, packed: Packed, kind: type[_Kind]) -> None:
        self._text, self._lines = packed
        self._decoder = msgspec.json.Decoder(kind)
        self._lately: dict[int, _Kind] = {}

    def __len__(self) -> int:
        return len(self._lines) - 1

    @overload
    def __getitem__(self, index: int) -> _Kind: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[_Kind, ...]: ...

    def __getitem__(self, index: int | slice) -> _Kind | tuple[_Kind, ...]:
        numbers = range(len(self))[index]
        if not isinstance(numbers, int):
            return tuple(map(self._read, numbers))
        kept = self._lately  # another thread may replace it
        if numbers not in kept:
            if len(kept) >= 4096:  # a tween reads the same entries hundreds of times
                kept = self._lately = {}
            kept[numbers] = self._read(numbers)
        return kept[numbers]

    def __iter__(self) -> Iterator[_Kind]:
        return map(self._read, range(len(self)))

    def __eq__(self, other: object) -> bool:
        return tuple(self) == tuple(other) if isinstance(other, tuple | Entries) else NotImplemented

    __hash__ = None  # type: ignore[assignment]

    def _read(self, number: int) -> _Kind:
        return self._decoder.decode(self._text[self._lines[number] : self._lines[number + 1]].tobytes())


class Columns(NamedTuple):
    """Columns of C clips.

    Attributes:
        starts: first posture of each clip, then the number of postures [C + 1].
        weights: weight of each of its moves forwards and backwards [C, 2]; 0 if it is not learned backwards.
        order: the clips, sorted by the corpus that they come from and by name [C].
    """

    starts: Ints
    weights: Floats
    order: Int32s

    @classmethod
    def of(cls, clips: Sequence[Clip]) -> Columns:
        """Return the columns of clips that follow one another from 0."""
        return cls(
            np.array([0, *(clip.stop for clip in clips)], dtype=np.int64),
            np.array([(clip.weight, clip.reverse_weight) for clip in clips], dtype=np.float64).reshape(-1, 2),
            np.array(sorted(range(len(clips)), key=[key_of(clip) for clip in clips].__getitem__), dtype=np.int32),
        )


def key_of(clip: Clip) -> tuple[str, str]:
    """Return the sort key of a clip."""
    return clip.corpus, clip.name


class StoredClips(Entries[Clip]):
    """The clips of a corpus on disk.

    Args:
        packed: their entries.
        columns: their columns, consistent with the entries.
    """

    def __init__(self, packed: Packed, columns: Columns) -> None:
        super().__init__(packed, Clip)
        self.columns = columns
