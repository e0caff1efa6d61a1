"""Movements by key: clips and postures of corpora, saved postures, and movements stored in the project.

A key has one of these forms:

    ballet/adagio         a clip of a corpus
    ballet/arabesque      a named posture of a corpus: a movement of one frame
    own/bow               a posture saved in the project
    m-0123456789abcdef    a movement stored in the project, by the hash of its content
    ~KEY                  the mirrored movement
"""

from __future__ import annotations

import hashlib
from base64 import b64decode, b64encode
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from threading import Lock
from typing import Any, cast

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.corpus import store
from motionmind.corpus.corpus import Corpus, Facing
from motionmind.credits.credit import Credit
from motionmind.display import displayed
from motionmind.errors import MotionMindError, suggestion
from motionmind.names.finding import Collection, open_collection
from motionmind.names.spelling import Source
from motionmind.studio.corpora import list_clips
from motionmind.studio.journal import DamagedError, Journal, Line
from motionmind.studio.neighbours import MIRRORED, OWN

STORED = "m-"  # prefix of keys of movements stored in the project


class Packed(msgspec.Struct, frozen=True):
    """An array in base64.

    Attributes:
        type: "<f4" if that is exact, otherwise "<f8".
        shape: the array's shape.
        data: the numbers in base64.
    """

    type: str
    shape: tuple[int, ...]
    data: str

    @classmethod
    def of(cls, array: Floats) -> Packed:
        """Pack an array."""
        small = array.astype("<f4")
        kept = small if np.array_equal(small.astype("<f8"), array) else array.astype("<f8")
        return cls(kept.dtype.str, kept.shape, b64encode(np.ascontiguousarray(kept).tobytes()).decode("ascii"))

    def array(self) -> Floats:
        """Return the array; raise ValueError if it is damaged."""
        if self.type not in ("<f4", "<f8"):
            raise ValueError(f"numbers of type {self.type!r:.20}")
        data = b64decode(self.data, validate=True)
        return np.frombuffer(data, self.type).reshape(self.shape).astype(np.float64)


class MotionRecord(msgspec.Struct, frozen=True):
    """A motion in a project's file; the fields are those of `Motion` and `Skeleton`, and the insertions' credits."""

    body: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Packed
    tips: Packed
    rotations: Packed
    root: Packed
    times: Packed
    insertions: tuple[tuple[tuple[float, ...], tuple[tuple[str, int], ...]], ...] = ()
    keyframed: bool = False
    credits: tuple[tuple[Credit, ...], ...] = ()  # of each insertion, if known
    recorded: tuple[Credit, ...] = ()

    @classmethod
    def of(cls, motion: Motion) -> MotionRecord:
        """Record a motion, without its name."""
        body = motion.skeleton
        return cls(
            body.name,
            body.names,
            body.parents,
            Packed.of(body.offsets),
            Packed.of(body.tips),
            Packed.of(motion.rotations),
            Packed.of(motion.root),
            Packed.of(motion.times),
            tuple((tuple(one.times.tolist()), one.bridged) for one in motion.insertions),
            motion.keyframed,
            tuple(one.credits for one in motion.insertions),
            motion.recorded,
        )

    def motion(self, name: str) -> Motion:
        """Return the motion; raise MotionMindError if the record is damaged."""
        try:
            offsets, tips, rotations, root, times = (
                packed.array() for packed in (self.offsets, self.tips, self.rotations, self.root, self.times)
            )
        except ValueError as error:
            raise MotionMindError(f"{displayed(name)}: its arrays are damaged: {error}") from error
        skeleton = Skeleton(self.body, self.names, self.parents, offsets, tips)
        credited = self.credits or ((),) * len(self.insertions)  # projects of 0.2 and before have none
        insertions = tuple(
            Insertion(np.array(times), bridged, shares)
            for (times, bridged), shares in zip(self.insertions, credited, strict=False)
        )
        return Motion(skeleton, rotations, root, times, name, insertions, self.keyframed, self.recorded)


class MovementLine(msgspec.Struct, frozen=True):
    """A line of the project's file that holds a movement."""

    movement: str
    title: str
    motion: msgspec.Raw


class Movements:
    """All movements, by key.

    Attributes:
        saved: returns the key of a saved posture's movement by its name; raises MotionMindError if there is none.
    """

    def __init__(self, journal: Journal, home: Path | None) -> None:
        """Open the movements of a project.

        Args:
            journal: its file.
            home: the folder of the user's corpora; None for the default folder.
        """
        self._journal, self._home = journal, home
        self._kept: dict[str, tuple[str, int, int]] = {}  # title, first byte and length of its line
        self._held: OrderedDict[str, Motion] = OrderedDict()
        self._size = 0
        self._holding = Lock()  # several threads may ask
        self._collections: dict[str, _Corpus] = {}
        self.saved: Callable[[str], str] = _no_posture

    def take_in(self, line: Line) -> None:
        """Register a line of the file that holds a movement; raise DamagedError if it is damaged."""
        try:
            found = msgspec.json.decode(line.data, type=MovementLine)
        except (ValueError, RecursionError) as error:
            raise DamagedError(f"is damaged: {error}", self._journal.path, line.number) from error
        self._kept[found.movement] = found.title, line.start, len(line.data)

    def get(self, key: str) -> Motion:
        """Return the movement of a key; raise MotionMindError if there is none."""
        with self._holding:
            if (known := self._held.get(key)) is not None:
                self._held.move_to_end(key)
                return known
        if key.lstrip(MIRRORED).startswith(OWN):  # not cached: the name may be saved anew
            motion = self.get(self.saved(key.lstrip(MIRRORED).partition("/")[2]))
            return mirrored(motion) if key.startswith(MIRRORED) else motion
        if key.startswith(MIRRORED):
            motion = mirrored(self.get(key[1:]))
        elif key in self._kept:
            motion = self._read(key)
        else:
            corpus, clip = self._split(key)
            motion = corpus.motion(clip)
        self._hold(key, motion)
        return motion

    def title(self, key: str) -> str:
        """Return a movement's title."""
        if key.startswith(MIRRORED):
            return f"{self.title(key[1:])} (mirrored)"
        if key in self._kept:
            return self._kept[key][0]
        return displayed(key.partition("/")[2] or key)

    def keep(self, motion: Motion, title: str = "") -> str:
        """Store a movement in the project, unless it is there, and return its key.

        Args:
            motion: the movement.
            title: its title; its name by default.

        Raises:
            MotionMindError: it cannot be written.
        """
        record = msgspec.json.encode(MotionRecord.of(motion))
        key = _key_of(record)
        if key not in self._kept:
            title = displayed(title or motion.name or motion.skeleton.name)
            self.take_in(self._journal.append(MovementLine(key, title, msgspec.Raw(record))))
        return key

    def has(self, corpus: str) -> bool:
        """Return whether a corpus exists."""
        return corpus in self._collections or corpus in store.list_corpora(self._home)

    def collection(self, corpus: str) -> Collection:
        """Return a corpus's clips and postures by name; raise MotionMindError if there is no such corpus."""
        return self._corpus(corpus).collection

    def clips(self, corpus: str) -> list[dict[str, Any]]:
        """List a corpus's clips, as `list_clips` does; composing them takes a few seconds the first time."""
        return self._corpus(corpus).clips()

    def facing(self, corpus: str) -> Facing:
        """Return which way a corpus's dancers may face; "free" if there is no such corpus."""
        return self._corpus(corpus).facing if self.has(corpus) else "free"

    def forget(self, corpus: str) -> None:
        """Drop cached data of a corpus that has changed."""
        self._collections.pop(corpus, None)
        with self._holding:
            for key in [key for key in self._held if key.lstrip(MIRRORED).startswith(f"{corpus}/")]:
                self._size -= _bytes(self._held.pop(key))

    def _read(self, key: str) -> Motion:
        title, start, length = self._kept[key]
        try:
            line = msgspec.json.decode(self._journal.read(start, length), type=MovementLine)
            if _key_of(line.motion) != key:
                raise ValueError("its content has changed")
            record = msgspec.json.decode(line.motion, type=MotionRecord)
        except (ValueError, RecursionError) as error:
            raise MotionMindError(f"{self._journal.path}: movement {key} is damaged: {error}") from error
        return record.motion(title)

    def _split(self, key: str) -> tuple[_Corpus, str]:
        name, slash, clip = key.partition("/")
        if not slash or name not in store.list_corpora(self._home):
            raise MotionMindError(f"no movement {displayed(key)}")
        return self._corpus(name), clip

    def _corpus(self, name: str) -> _Corpus:
        if name not in self._collections:
            if name not in (known := store.list_corpora(self._home)):
                raise MotionMindError(f"no corpus {displayed(name)}{suggestion(name, known)}")
            self._collections[name] = _Corpus(name, self._home)
        return self._collections[name]

    def _hold(self, key: str, motion: Motion) -> None:
        with self._holding:
            if (known := self._held.pop(key, None)) is not None:  # another thread was faster
                self._size -= _bytes(known)
            self._held[key] = motion
            self._size += _bytes(motion)
            while self._size > 64 * 2**20 and len(self._held) > 1:
                self._size -= _bytes(self._held.popitem(last=False)[1])


class _Corpus:
    """The clips and postures of a corpus, loaded on first use."""

    def __init__(self, name: str, home: Path | None) -> None:
        self.collection = open_collection(Source(name, "corpus", name), home)
        self._name, self._home = name, home
        self._loading, self._loaded = Lock(), cast("Corpus | None", None)

    @property
    def _corpus(self) -> Corpus:
        from motionmind.learned import persistence  # numba is slow to import

        with self._loading:  # several threads may ask
            if self._loaded is None:
                self._loaded = persistence.load_corpus(self._name, self._home)
        return self._loaded

    def clips(self) -> list[dict[str, Any]]:
        """List the clips; a corpus without any is not loaded."""
        return list_clips(self._corpus, self._name) if self.collection.clips else []

    @cached_property
    def facing(self) -> Facing:
        """Which way the dancers may face."""
        found: Facing = store.read_manifest(store.locate(self._name, self._home)).get("facing", "free")
        return found

    def motion(self, name: str) -> Motion:
        """Return a clip as recorded, or else a posture, which needs no clips."""
        if name in self.collection.clips or name not in self.collection.postures:
            with suppress(KeyError):
                return replace(self._corpus.recording(self._corpus.clip_labelled(name)), name=name)
        return self.collection.find(name, as_clip=True)


def version_of(corpus: str, home: Path | None) -> str:
    """Return a hash of a corpus's content; raise MotionMindError if there is no such corpus or it is damaged."""
    folder = store.locate(corpus, home)
    stored = store.load(folder)
    if stored.arrays:
        return stored.digest
    digest = hashlib.sha256(msgspec.json.encode(stored.manifest))
    # A corpus written by hand has its files beside its manifest.
    for path in sorted(path for path in folder.rglob("*") if path.is_file() and path.name[:1] != "."):
        with path.open("rb") as file:
            digest.update(f"{path.name}\0".encode())
            digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()[:16]


def _key_of(record: bytes | msgspec.Raw) -> str:
    """Return the key of a stored movement."""
    return STORED + hashlib.sha256(record).hexdigest()[:16]


def _bytes(motion: Motion) -> int:
    return motion.rotations.nbytes + motion.root.nbytes + motion.times.nbytes


def _no_posture(name: str) -> str:
    raise MotionMindError(f"no posture is saved as {displayed(name)}")
