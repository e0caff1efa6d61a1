"""The server of the studio: it listens on a socket until Ctrl-C, and then stops at once."""

from __future__ import annotations

import socket
from collections.abc import Callable

import uvicorn

from motionmind.studio.app import app
from motionmind.studio.studio import Studio
from motionmind.studio.token import Keys


class Server(uvicorn.Server):
    """A server that closes the event streams when it stops, because they never end by themselves."""

    def __init__(self, studio: Studio, keys: Keys, host: str, port: int, ready: Callable[[], None]) -> None:
        """Set up the server of a studio.

        Args:
            studio: the studio.
            keys: admits requests.
            host: the name or address to listen on.
            port: its port.
            ready: called once the server answers.
        """
        config = uvicorn.Config(
            app(studio, keys, host, port),
            http="h11",  # limits the size of request headers
            log_level="error",
            access_log=False,
            ws="none",
            server_header=False,
            limit_concurrency=100,  # connections
            timeout_keep_alive=30,  # seconds
            timeout_graceful_shutdown=2,  # seconds for answers in progress
        )
        super().__init__(config)
        self._studio, self._ready = studio, ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start to listen."""
        await super().startup(sockets)
        self._ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Close the streams, then stop the server."""
        self._studio.events.close()
        await super().shutdown(sockets)
