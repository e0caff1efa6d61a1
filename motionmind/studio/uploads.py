"""Uploaded files: stored in a temporary folder, and each read by a child process (`motionmind.studio.reading`).

Original file names are shown but never used as paths: each file gets a new name in a folder of its own.
"""

from __future__ import annotations

import asyncio
import os
import secrets
import shutil
import sys
from collections.abc import AsyncIterator
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import msgspec

from motionmind.body.motion import Motion
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.formats.refused import way_out
from motionmind.formats.units import UNITS
from motionmind.studio.reading import (
    FACTS_FILE,
    ORDER_FILE,
    READABLE_SUFFIXES,
    TIME_LIMIT_S,
    Answer,
    Facts,
    Order,
    load_clip,
)
from motionmind.studio.room import Room

MAX_UPLOAD_BYTES = 64 * 2**20  # of a file
_MAX_FILES = 300
_START_S = 5.0  # to start a child process
_TWO_FILES = "a .gltf refers to other files: export a single .glb"


class Choices(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The user's choices on how to read a file.

    Attributes:
        unit: its unit of length; None guesses it.
        fps: its frames a second; None takes the file's own.
        asf: id of the upload with an AMC's skeleton.
        skip: frames to leave out at the beginning of each clip; None leaves out an added first pose.
    """

    unit: Annotated[str, msgspec.Meta(max_length=20)] | None = None
    fps: Annotated[float, msgspec.Meta(gt=0.0, le=10_000.0)] | None = None
    asf: str | None = None
    skip: Annotated[int, msgspec.Meta(ge=0, le=100_000)] | None = None


class Upload(msgspec.Struct, frozen=True):
    """An uploaded file.

    Attributes:
        id: its id.
        name: its original name, for display.
        size: its size in bytes.
        kind: its suffix, without the dot.
        choices: the choices that it was read with.
        facts: facts about it; None if it was not read, or is an AMC's skeleton.
        error: the reason why it was not read; "" if it was.
    """

    id: str
    name: str
    size: int
    kind: str
    choices: Choices = Choices()
    facts: Facts | None = None
    error: str = ""

    def skip(self, clip: int) -> int:
        """Return the number of frames to leave out at the beginning of a clip."""
        if self.choices.skip is not None:
            return self.choices.skip
        return int(self.facts is not None and self.facts.clips[clip].posed_first)


class Uploads:
    """All uploads since the studio started; they are deleted when it ends."""

    def __init__(self) -> None:
        self._room = Room()
        self._uploads: dict[str, Upload] = {}
        self._reading = asyncio.Semaphore(2)

    def list(self) -> tuple[Upload, ...]:
        """Return all uploads, the earliest first."""
        return tuple(self._uploads.values())

    def get(self, upload: str) -> Upload:
        """Return an upload; raise MotionMindError if there is none with this id."""
        if upload not in self._uploads:
            raise MotionMindError("this file is gone: upload it again")
        return self._uploads[upload]

    async def take(self, name: str, chunks: AsyncIterator[bytes]) -> Upload:
        """Store a file and read it.

        Args:
            name: its original name.
            chunks: its content.

        Raises:
            MotionMindError: its format is unknown, it is too large, or there are too many uploads.
        """
        shown, suffix = displayed(name), Path(name).suffix.lower()
        if suffix not in (accepted := (*READABLE_SUFFIXES, ".asf")):
            instead = _TWO_FILES if suffix == ".gltf" else way_out(suffix)
            raise MotionMindError(f"{shown}: {instead or 'supported formats are ' + ', '.join(accepted)}")
        if len(self._uploads) >= _MAX_FILES:
            raise MotionMindError(f"{shown}: there are already {_MAX_FILES} files; remove some first")
        upload = secrets.token_hex(8)
        folder = self._place(upload)
        folder.mkdir()
        try:
            size = await self._write(folder / f"upload{suffix}", shown, chunks)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        self._uploads[upload] = Upload(upload, shown, size, suffix[1:])
        if suffix == ".asf":
            return self._uploads[upload]
        asf = next((one.id for one in reversed(self.list()) if one.kind == "asf"), None)
        return await self.read(upload, Choices(asf=asf if suffix == ".amc" else None))

    async def _write(self, path: Path, shown: str, chunks: AsyncIterator[bytes]) -> int:
        room = 2**30 - sum(one.size for one in self._uploads.values())
        size = 0
        with path.open("xb") as file:
            async for chunk in chunks:
                size += len(chunk)
                if size > MAX_UPLOAD_BYTES:
                    raise MotionMindError(f"{shown}: larger than {MAX_UPLOAD_BYTES >> 20} MB; upload a part of it")
                if size > room:
                    raise MotionMindError(f"{shown}: no room left; remove some files first")
                file.write(chunk)
        return size

    async def read(self, upload: str, choices: Choices) -> Upload:
        """Read an upload, or read it again with other choices.

        Raises:
            MotionMindError: there is no such upload, or a choice is invalid.
        """
        own = self.get(upload)
        if choices.unit is not None and choices.unit not in UNITS:
            raise MotionMindError(f"unknown unit {displayed(choices.unit)}: choose from {', '.join(UNITS)}")
        folder = self._place(upload)
        asf = None
        if choices.asf is not None:
            skeleton = self.get(choices.asf)
            if skeleton.kind != "asf":
                raise MotionMindError(f"{skeleton.name} is not an .asf skeleton")
            asf = "upload.asf"
            shutil.copyfile(self._place(skeleton.id) / asf, folder / asf)
        if own.kind == "amc" and asf is None:
            answer = Answer(error=f"{own.name}: upload its .asf too: an .amc has no skeleton")
        else:
            scores = {one.name: str(self._place(one.id) / "upload.score") for one in self.list() if one.kind == "score"}
            others = scores if own.kind == "score" else {}
            order = Order(f"upload.{own.kind}", own.name, choices.unit, choices.fps, asf, others)
            answer = await self.read_apart(folder, order)
        facts = answer.facts
        error = answer.error if facts is None else ""
        new = msgspec.structs.replace(own, choices=choices, facts=facts, error=error)
        if upload in self._uploads:  # unless it was deleted meanwhile
            self._uploads[upload] = new
        return new

    async def read_apart(self, folder: Path, order: Order) -> Answer:
        """Let a child process read a file in a folder, within the time limit; two at most run at once."""
        async with self._reading:
            return await _read_apart(folder, order)

    def motion(self, upload: str, clip: int) -> Motion:
        """Return a clip of an upload, without the frames to leave out.

        Raises:
            MotionMindError: there is no such clip, or no frame is left.
        """
        own = self.get(upload)
        if own.facts is None:
            raise MotionMindError(own.error or f"{own.name} has no movement")
        motion = load_clip(self._place(upload), own.facts, clip)
        skip = own.skip(clip)
        if skip >= len(motion):
            raise MotionMindError(f"{motion.name} has {len(motion)} frames; skipping {skip} leaves none")
        return motion.slice(skip, len(motion)) if skip else motion

    def folder(self, upload: str) -> Path:
        """Return the folder of an upload; raise MotionMindError if there is none with this id."""
        return self._place(self.get(upload).id)

    def forget(self, upload: str) -> None:
        """Delete an upload; raise MotionMindError if there is none with this id."""
        folder = self.folder(upload)
        del self._uploads[upload]
        shutil.rmtree(folder, ignore_errors=True)

    def close(self) -> None:
        """Delete all uploads."""
        self._uploads.clear()
        self._room.close()

    def _place(self, upload: str) -> Path:
        return self._room.folder / upload


async def _read_apart(folder: Path, order: Order) -> Answer:
    shown = displayed(order.name)
    (folder / FACTS_FILE).unlink(missing_ok=True)
    (folder / ORDER_FILE).write_bytes(msgspec.json.encode(order))
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    child = await asyncio.create_subprocess_exec(
        *(sys.executable, "-P", "-m", "motionmind.studio.reading"),
        cwd=folder,
        env=os.environ | threads,
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.DEVNULL,
    )
    try:
        await asyncio.wait_for(child.wait(), TIME_LIMIT_S + _START_S)
    except TimeoutError:
        return Answer(error=f"{shown}: took longer to read than {TIME_LIMIT_S:g} s")
    finally:
        with suppress(ProcessLookupError):
            child.kill()
        await child.wait()
    try:
        return msgspec.json.decode((folder / FACTS_FILE).read_bytes(), type=Answer)
    except (OSError, msgspec.MsgspecError):
        return Answer(error=f"{shown}: cannot be read within the limits of time and memory")
