"""Server-sent events to every open window.

A window that reads slowly gets only the latest event about each thing.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from typing import Any

import msgspec

from motionmind.errors import MotionMindError

_HEARTBEAT_S = 15.0  # of an idle stream: heartbeats reveal that its reader has gone, and to the reader that it goes on
_MAX_STREAMS = 32
_MAX_LOOKING = 24  # of these, for the look-only link: the owner's windows have the others


class Events:
    """The streams of the open windows."""

    def __init__(self) -> None:
        self._streams: set[_Stream] = set()
        self._is_closed = False

    @property
    def are_read(self) -> bool:
        """Whether a window listens."""
        return bool(self._streams)

    def send(self, event: str, data: Any, about: str = "") -> None:
        """Send an event to all windows.

        Args:
            event: its kind.
            data: plain values for JSON.
            about: the subject of the event; it replaces an unread event of the same kind and subject.
        """
        text = _encode(event, data)
        for stream in self._streams:
            stream.put((event, about), text)

    def open(self, first: dict[tuple[str, str], Any], *, is_looking: bool = False) -> AsyncGenerator[bytes]:
        """Open a stream that begins with some events (see `send`), by kind and subject.

        Args:
            first: the events.
            is_looking: whether the stream tells only that the project has changed, until `end_looking`.

        Raises:
            MotionMindError: there are too many streams, or the studio is closing.
        """
        if self._is_closed or len(self._streams) >= _MAX_STREAMS:
            raise MotionMindError(f"too many open windows: at most {_MAX_STREAMS}")
        if is_looking and sum(stream.is_looking for stream in self._streams) >= _MAX_LOOKING:
            raise MotionMindError(f"too many people look at this piece: at most {_MAX_LOOKING}")
        stream = _Stream(is_looking)
        for (event, about), data in first.items():
            stream.put((event, about), _encode(event, data))
        self._streams.add(stream)
        return self._events_of(stream)

    def close(self) -> None:
        """End all streams."""
        self._is_closed = True
        for stream in self._streams:
            stream.end()

    def end_looking(self) -> None:
        """End the streams of the look-only link."""
        for stream in self._streams:
            if stream.is_looking:
                stream.end()

    async def _events_of(self, stream: _Stream) -> AsyncGenerator[bytes]:
        try:
            yield b"retry: 1000\n\n"
            while (text := await stream.take()) is not None:
                yield text
        finally:
            self._streams.discard(stream)


def _encode(event: str, data: Any) -> bytes:
    return b"event: %s\ndata: %s\n\n" % (event.encode(), msgspec.json.encode(data, enc_hook=float))


class _Stream:
    """Events that a window has yet to read."""

    def __init__(self, is_looking: bool) -> None:
        self.is_looking = is_looking
        self._waiting: dict[tuple[str, str], bytes] = {}
        self._has_news = asyncio.Event()
        self._has_ended = False

    def put(self, what: tuple[str, str], text: bytes) -> None:
        if self.is_looking and what[0] != "project":
            return
        self._waiting.pop(what, None)  # keeps the events in order
        self._waiting[what] = text
        self._has_news.set()

    def end(self) -> None:
        self._has_ended = True
        self._has_news.set()

    async def take(self) -> bytes | None:
        """Wait for events and return them, or a heartbeat; None if the stream has ended."""
        try:
            async with asyncio.timeout(_HEARTBEAT_S):
                await self._has_news.wait()
        except TimeoutError:
            return _encode("here", {})
        self._has_news.clear()
        text = b"".join(self._waiting.values())
        self._waiting.clear()
        return None if self._has_ended else text
