"""Server-sent events: what every open window is told, as it happens.

A window that reads slowly is told the latest of each thing, not all that came before it.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from typing import Any

import msgspec

from motionmind.errors import MotionMindError

_BEAT = 15.0  # seconds after which a stream says that it is there, so that one without a reader is noticed
_MOST = 32  # streams at once


class Events:
    """The streams of the open windows."""

    def __init__(self) -> None:
        self._streams: set[_Stream] = set()
        self._is_closed = False

    def send(self, event: str, data: Any, about: str = "") -> None:
        """Tell all windows of something.

        Args:
            event: its kind.
            data: plain values for JSON.
            about: the thing that it is about; what was told of it before, and has not been read, is left out.
        """
        text = b"event: %s\ndata: %s\n\n" % (event.encode(), msgspec.json.encode(data, enc_hook=float))
        for stream in self._streams:
            stream.put((event, about), text)

    def open(self, first: dict[tuple[str, str], Any]) -> AsyncGenerator[bytes]:
        """Open a stream, which begins with some events (see `send`), by their kinds and what they are about.

        Raises:
            MotionMindError: there are too many streams, or the studio ends.
        """
        if self._is_closed or len(self._streams) >= _MOST:
            raise MotionMindError(f"{_MOST} windows are open, and no more can be")
        stream = _Stream()
        for (event, about), data in first.items():
            text = b"event: %s\ndata: %s\n\n" % (event.encode(), msgspec.json.encode(data, enc_hook=float))
            stream.put((event, about), text)
        self._streams.add(stream)
        return self._told(stream)

    def close(self) -> None:
        """End all streams."""
        self._is_closed = True
        for stream in self._streams:
            stream.end()

    async def _told(self, stream: _Stream) -> AsyncGenerator[bytes]:
        try:
            yield b"retry: 1000\n\n"
            while (text := await stream.take()) is not None:
                yield text
        finally:
            self._streams.discard(stream)


class _Stream:
    """The events that a window is still to be told."""

    def __init__(self) -> None:
        self._waiting: dict[tuple[str, str], bytes] = {}
        self._has_news = asyncio.Event()
        self._has_ended = False

    def put(self, what: tuple[str, str], text: bytes) -> None:
        self._waiting.pop(what, None)  # so that it comes after what came before it
        self._waiting[what] = text
        self._has_news.set()

    def end(self) -> None:
        self._has_ended = True
        self._has_news.set()

    async def take(self) -> bytes | None:
        """Return what there is to tell, once there is something; None if the stream has ended."""
        try:
            async with asyncio.timeout(_BEAT):
                await self._has_news.wait()
        except TimeoutError:
            return b": here\n\n"
        self._has_news.clear()
        text = b"".join(self._waiting.values())
        self._waiting.clear()
        return None if self._has_ended else text
