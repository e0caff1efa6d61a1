"""Listening sockets and their addresses."""

from __future__ import annotations

import socket

from motionmind.errors import MotionMindError


def listen(host: str, port: int) -> socket.socket:
    """Open a listening socket; MotionMindError if it fails, for example because the port is in use."""
    try:
        return socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except OSError as error:
        raise MotionMindError(f"cannot listen at {host}:{port}: {(error.strerror or str(error)).lower()}") from None


def address_of(listening: socket.socket) -> tuple[str, bool]:
    """Return the URL of a listening socket, and whether other computers can reach it."""
    address, port = listening.getsockname()[:2]
    host = f"[{address}]" if ":" in address else address
    return f"http://{host}:{port}", not address.startswith("127.") and address != "::1"
