"""The server of the studio: it listens on a socket until Ctrl-C, and then stops at once."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Callable
from typing import Any

import uvicorn

from motionmind.connections import config
from motionmind.studio.app import app
from motionmind.studio.studio import Studio
from motionmind.studio.token import Keys

_UNUSED_S = 600.0  # a browser may put a window to sleep for some minutes
_LOOK_S = 1.0


class Server(uvicorn.Server):
    """A server that closes the event streams when it stops, because they never end by themselves."""

    def __init__(
        self,
        studio: Studio,
        keys: Keys,
        host: str,
        port: int,
        ready: Callable[[], None],
        *,
        until_closed: bool = False,
    ) -> None:
        """Set up the server of a studio.

        Args:
            studio: the studio.
            keys: admits requests.
            host: the name or address to listen on.
            port: its port.
            ready: called once the server answers.
            until_closed: whether it stops once no window has been open for ten minutes.
        """

        def is_known(scope: Any) -> bool:
            cookies = (value.decode("latin-1") for name, value in scope["headers"] if name == b"cookie")
            return keys.is_let_in("; ".join(cookies), port)

        super().__init__(config(app(studio, keys, host, port), is_known=is_known))
        self._studio, self._ready, self._until_closed = studio, ready, until_closed

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start to listen."""
        await super().startup(sockets)
        self._ready()
        if self._until_closed:
            self._leaving = asyncio.create_task(self._leave())

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Close the streams, then stop the server."""
        self._studio.events.close()
        await super().shutdown(sockets)

    async def _leave(self) -> None:
        """Stop once no window has been open for long."""
        used = time.monotonic()
        while time.monotonic() < used + _UNUSED_S:
            await asyncio.sleep(_LOOK_S)
            if self._studio.events.are_read:
                used = time.monotonic()
        self.should_exit = True
