"""The server of the studio: listens at a socket until Ctrl-C, and then ends at once."""

from __future__ import annotations

import socket
from collections.abc import Callable

import uvicorn

from motionmind.studio.app import app
from motionmind.studio.studio import Studio
from motionmind.studio.token import Keys

_AT_ONCE = 100  # connections
_IDLE = 30  # seconds that a connection without a request stays open
_LAST = 2  # seconds for answers that are on their way when the server ends


class Server(uvicorn.Server):
    """A server that ends the streams of events when it is to end, for they would never end by themselves."""

    def __init__(self, studio: Studio, keys: Keys, host: str, port: int, ready: Callable[[], None]) -> None:
        """Set up the server of a studio.

        Args:
            studio: the studio.
            keys: who is let in.
            host: the name or address at which it listens.
            port: its port.
            ready: called once it answers.
        """
        config = uvicorn.Config(
            app(studio, keys, host, port),
            http="h11",  # which limits the headers of a request
            log_level="error",
            access_log=False,
            ws="none",
            server_header=False,
            limit_concurrency=_AT_ONCE,
            timeout_keep_alive=_IDLE,
            timeout_graceful_shutdown=_LAST,
        )
        super().__init__(config)
        self._studio, self._ready = studio, ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to listen."""
        await super().startup(sockets)
        self._ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the streams, then the server."""
        self._studio.events.close()
        await super().shutdown(sockets)
