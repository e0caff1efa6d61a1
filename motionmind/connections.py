"""Connections of the servers, which do not wait for slow or silent clients.

uvicorn waits without end for the headers of a request, and for a client to read its answer. So a client can occupy all
connections that a limit allows. Here such connections are closed: in time, and at once if a new client needs the place.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from itertools import count
from typing import Any

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

_MAX_CONNECTIONS = 100
_MAX_BACKLOG = 256  # asyncio accepts as many at once, before any is closed; each takes a file descriptor
_PATIENCE_S = 10.0
_MIN_RATE_BYTES_S = 1000.0  # of reading

_clock = count()  # loops' clocks are too coarse to tell the older of two connections


def config(
    application: Any,
    *,
    is_known: Callable[[Any], bool] = lambda _: False,
    patience_s: float = _PATIENCE_S,
    most: int = _MAX_CONNECTIONS,
) -> uvicorn.Config:
    """Return the settings of a server.

    Args:
        application: the ASGI application.
        is_known: returns whether a request, by its ASGI scope, comes from a client whose connections are never closed
            in favour of others.
        patience_s: seconds that a client has for the headers of a request, or to read part of an answer.
        most: the largest number of connections.
    """
    return uvicorn.Config(
        application,
        http=partial(Connection, is_known=is_known, patience_s=patience_s, most=most),  # type: ignore[arg-type]
        backlog=_MAX_BACKLOG,
        log_level="error",
        access_log=False,
        ws="none",
        server_header=False,
        timeout_graceful_shutdown=2,  # seconds for answers in progress
    )


class Connection(H11Protocol):
    """A connection that is closed if its client is slow, or has sent no request when a new client needs the place."""

    def __init__(
        self, *args: Any, is_known: Callable[[Any], bool], patience_s: float, most: int, **options: Any
    ) -> None:
        super().__init__(*args, **options)
        self._is_known, self._patience_s, self._most = is_known, patience_s, most
        self._has_left = self._has_advanced = False
        self._unsent = 0  # bytes at the last check
        self._timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin, in place of another connection if there are too many."""
        super().connection_made(transport)
        self._since = next(_clock)
        self._timer = self.loop.call_later(self._patience_s, self.check)
        here = [one for one in self.connections if isinstance(one, Connection) and not one._has_left]
        if len(here) > self._most:
            expendable = (one for one in here if one is not self and one.is_expendable())
            min(expendable, key=lambda one: one._since, default=self).leave()

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        if self._timer is not None:
            self._timer.cancel()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take part of a request."""
        before = self.cycle
        super().data_received(data)
        self._has_advanced |= self.cycle is not before

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        self._has_advanced, self._since = True, next(_clock)
        super().on_response_complete()

    def resume_writing(self) -> None:
        """Send more: the client has read most of what was sent."""
        self._has_advanced = True
        super().resume_writing()

    def check(self) -> None:
        """Close the connection if the client has kept it waiting since the last check."""
        unsent = self.transport.get_write_buffer_size()
        has_read = self._unsent - unsent >= self._patience_s * _MIN_RATE_BYTES_S
        if not (self._has_advanced or has_read) and (unsent or self._is_idle()):
            self.leave()
            return
        self._has_advanced, self._unsent = False, unsent
        self._timer = self.loop.call_later(self._patience_s, self.check)

    def is_expendable(self) -> bool:
        """Return whether a new client may have the place: this one is unknown, and keeps the server waiting."""
        is_waiting = self._is_idle() or self.conn.their_state is h11.SEND_BODY
        is_waiting = is_waiting or self.transport.get_write_buffer_size() > 0
        return is_waiting and (self.scope is None or not self._is_known(self.scope))

    def leave(self) -> None:
        """Close the connection at once, even with bytes to send."""
        self._has_left = True
        self.transport.abort()

    def _is_idle(self) -> bool:
        """Return whether no request is being answered."""
        return self.cycle is None or self.cycle.response_complete
