"""A server of files on this computer, which can be told to fail."""

from __future__ import annotations

import re
import socketserver
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path


@dataclass
class Files:
    """What a server does with requests, and what it was asked.

    Attributes:
        folder: the files that it serves.
        most: the bytes that it sends before it closes the connection, though it promised more; None for all.
        ranges: whether it sends parts of files.
        redirections: addresses by path, to which it sends on who asks for them.
        extra: what it sends after the end of a file.
        asked: the path and the range of each request so far.
        sent: bytes of all responses so far.
        address: its own.
    """

    folder: Path
    most: int | None = None
    ranges: bool = True
    redirections: dict[str, str] = field(default_factory=dict)
    extra: bytes = b""
    asked: list[tuple[str, str | None]] = field(default_factory=list)
    sent: int = 0
    address: str = ""


@contextmanager
def serving_files(folder: Path) -> Iterator[Files]:
    """Serve a folder at a free port of this computer."""
    files = Files(folder)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            range_ = self.headers.get("Range")
            files.asked.append((self.path, range_))
            if self.path in files.redirections:
                self.send_response(302)
                self.send_header("Location", files.redirections[self.path])
                self.end_headers()
                return
            path = files.folder / self.path.lstrip("/")
            if not path.is_file():
                self.send_error(404)
                return
            self._send(path.read_bytes() + files.extra, range_ if files.ranges else None)

        def _send(self, data: bytes, range_: str | None) -> None:
            start = int(match[1]) if range_ and (match := re.fullmatch(r"bytes=(\d+)-", range_)) else 0
            if start > len(data):
                self.send_error(416)
                return
            self.send_response(206 if start else 200)
            if start:
                self.send_header("Content-Range", f"bytes {start}-{len(data) - 1}/{len(data)}")
            self.send_header("Content-Length", str(len(data) - start))
            self.end_headers()
            part = data[start:][: files.most]
            files.sent += len(part)
            self.wfile.write(part)

        def log_message(self, *_: object) -> None:
            """Print nothing."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        files.address = f"http://127.0.0.1:{server.server_port}"
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        try:
            yield files
        finally:
            server.shutdown()
            thread.join()


@contextmanager
def dripping(at_once: bytes, then: bytes, pause: float = 0.02) -> Iterator[str]:
    """Answer each request with some bytes, and then with others again and again, as long as the client is there."""
    over = threading.Event()

    class Handler(socketserver.BaseRequestHandler):
        def handle(self) -> None:
            with suppress(OSError):
                self.request.recv(1 << 16)
                self.request.sendall(at_once)
                while not over.wait(pause):
                    self.request.sendall(then)

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}/file"
        finally:
            over.set()
            server.shutdown()
            thread.join()
