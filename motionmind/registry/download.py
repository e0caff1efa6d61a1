"""Download files over TLS, with limits of size and time, verification, and resumption.

Every file is checked against the SHA-256 in the index, so any later process can resume a partial download without
asking the server whether it still has the same file.

A server that sends a byte now and then meets every time limit of a single read. So a request has a deadline, which
only the bytes of a file postpone.
"""

from __future__ import annotations

import hashlib
import http.client
import io
import ipaddress
import shutil
import socket
import urllib.request
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from time import monotonic
from typing import IO, Any
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit

from motionmind.errors import CorpusError
from motionmind.files import sync_folder

_TIMEOUT_S = 30.0  # for a server to answer; an average rate is taken over as long
_INDEX_TIMEOUT_S = 60.0  # for all of an index
_MIN_RATE_BYTES_S = 1000.0  # of a file

Progress = Callable[[int], None]  # called with the number of bytes so far


def check_address(url: str, before: str | None = None) -> None:
    """Check that an address is allowed: it uses TLS, or is on this machine and not named by another machine.

    Args:
        url: the address.
        before: the address that named it, if any.

    Raises:
        CorpusError: it is not allowed; the message says why.
    """
    try:
        parts = urlsplit(url)
        host, is_secret, _ = parts.hostname, parts.username or parts.password, parts.port
    except ValueError as error:
        raise CorpusError(f"{url}: is not an address: {error}") from error
    if is_secret:
        raise CorpusError(f"{url}: remove the user name and password; they would be sent to the server")
    is_here = _is_loopback(host or "")
    if parts.scheme not in (("https", "http") if is_here else ("https",)) or not host:
        raise CorpusError(f"{url}: is not asked for; addresses begin with https:// (or are on this machine)")
    if is_here and before is not None and not _is_loopback(urlsplit(before).hostname or ""):
        raise CorpusError(f"{url}: is on this machine, and {before} is not; it is not asked for")


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    with suppress(ValueError):
        return ipaddress.ip_address(host).is_loopback
    return False


class _Deadline:
    """The time at which a request fails, whatever has come, and the reason to give."""

    def __init__(self, seconds: float, reason: str) -> None:
        self._at, self.reason = monotonic() + seconds, reason

    def left(self) -> float:
        """Return the seconds that are left; raise TimeoutError if there are none."""
        if (left := self._at - monotonic()) <= 0.0:
            raise TimeoutError(self.reason)
        return left

    def postpone(self, count: int) -> None:
        """Postpone the deadline by the time that bytes take at the lowest rate, to at most `_TIMEOUT_S` from now."""
        self._at = min(self._at + count / _MIN_RATE_BYTES_S, monotonic() + _TIMEOUT_S)


class _Stream(io.RawIOBase):
    """The bytes from a server, until a deadline."""

    def __init__(self, source: io.RawIOBase, connected: socket.socket, deadline: _Deadline) -> None:
        self._source, self._socket, self._deadline = source, connected, deadline

    def readable(self) -> bool:
        """Return True."""
        return True

    def readinto(self, buffer: Any) -> int | None:
        """Read into a buffer and return the number of bytes; raise TimeoutError at the deadline."""
        self._socket.settimeout(self._deadline.left())
        try:
            return self._source.readinto(buffer)
        except TimeoutError:
            raise TimeoutError(self._deadline.reason) from None

    def close(self) -> None:
        """Close the stream."""
        self._source.close()
        super().close()


class _Response(http.client.HTTPResponse):
    """A response whose headers and body are read until a deadline."""

    fp: io.BufferedReader

    def __init__(self, deadline: _Deadline, connected: socket.socket, *args: Any, **options: Any) -> None:
        super().__init__(connected, *args, **options)
        self.fp = io.BufferedReader(_Stream(self.fp.detach(), connected, deadline))


class _Connections(urllib.request.HTTPHandler, urllib.request.HTTPSHandler):
    """Opens connections whose responses have a deadline."""

    def __init__(self, deadline: _Deadline) -> None:
        super().__init__()
        self._deadline = deadline

    def do_open(self, http_class: Any, req: urllib.request.Request, **options: Any) -> http.client.HTTPResponse:
        """Send a request and return the response, whose headers have come."""

        def connection(*args: Any, **more: Any) -> http.client.HTTPConnection:
            made: http.client.HTTPConnection = http_class(*args, **more)
            made.response_class = partial(_Response, self._deadline)  # type: ignore[assignment]
            return made

        req.timeout = self._deadline.left()
        return super().do_open(connection, req, **options)


class _Redirections(urllib.request.HTTPRedirectHandler):
    """Follows redirections to allowed addresses only."""

    max_redirections = 5

    def redirect_request(
        self, req: urllib.request.Request, fp: IO[bytes], code: int, msg: str, headers: Any, newurl: str
    ) -> urllib.request.Request | None:
        """Return the request for the new address."""
        check_address(newurl, req.full_url)
        fp.close()  # otherwise the whole body is read, which may be endless
        return super().redirect_request(req, fp, code, msg, headers, newurl)


def _open(url: str, deadline: _Deadline, start: int = 0) -> Any:
    """Request an address from byte `start`; return the response, with status 206 from that byte, or 200 from byte 0."""
    check_address(url)
    request = urllib.request.Request(url, headers={"Accept-Encoding": "identity", "User-Agent": "motionmind"})
    if start:
        request.add_header("Range", f"bytes={start}-")
    handlers: list[urllib.request.BaseHandler] = [_Redirections(), _Connections(deadline)]
    if _is_loopback(urlsplit(url).hostname or ""):
        handlers.append(urllib.request.ProxyHandler({}))  # a proxy would ask its own machine
    return urllib.request.build_opener(*handlers).open(request)


def _reason(error: Exception) -> str:
    """Describe why a request failed."""
    if isinstance(error, HTTPError):
        return f"the server answers {error.code} {error.reason}"
    cause = error.reason if isinstance(error, URLError) else error
    if isinstance(cause, OSError):
        return cause.strerror or str(cause)
    return str(cause) or type(cause).__name__


def read_address(url: str, most: int) -> tuple[bytes, str]:
    """Read a small file; return its bytes, and the address after redirections.

    Args:
        url: the address.
        most: its largest allowed size in bytes.

    Raises:
        CorpusError: the address is not allowed or cannot be reached, or the file is larger or takes too long.
    """
    try:
        with _open(url, _Deadline(_INDEX_TIMEOUT_S, f"it took longer than {_INDEX_TIMEOUT_S:g} s")) as response:
            data, reached = response.read(most + 1), response.url
            if response.length and len(data) <= most:
                raise http.client.HTTPException(f"it ended {response.length:,} bytes early")
    except (OSError, http.client.HTTPException, ValueError) as error:
        raise CorpusError(f"{url}: cannot be reached: {_reason(error)}") from error
    if len(data) > most:
        raise CorpusError(f"{url}: is larger than {most // 10**6} MB")
    return data, str(reached)


def download(url: str, place: Path, size: int, sha256: str, on_progress: Progress | None = None) -> None:
    """Download a file; a partial download stays beside its place, and the next call resumes it.

    Args:
        url: its address.
        place: its path, in a folder that no other process writes to.
        size: its size in bytes.
        sha256: its hash.
        on_progress: called with the number of bytes so far.

    Raises:
        CorpusError: it cannot be reached, is too slow, ends early, is larger, has another hash, or the disk is too
            small.
    """
    part = place.with_name(f"{place.name}.part")
    try:
        had = min(part.stat().st_size, size) if part.exists() else 0
        if (free := shutil.disk_usage(place.parent).free) < size - had:
            lacking = f"{size - had:,} bytes are needed, and {free:,} are free"
            raise CorpusError(f"{place.parent}: the disk is too small: {lacking}")
        with part.open("ab") as file:
            if file.tell() > size:
                _empty(file)
            _complete(url, file, size, on_progress)
        found = file_hash(part)
        if found != sha256 and had:  # the old part may be of another file: download all of it
            part.unlink()
            return download(url, place, size, sha256, on_progress)
        if found != sha256:
            part.unlink()
            raise CorpusError(f"{url}: is not the file that the index names: its SHA-256 is {found}, not {sha256}")
        part.replace(place)
        sync_folder(place.parent)
    except OSError as error:
        raise CorpusError(f"{part}: cannot be written: {error.strerror or error}") from error


def _complete(url: str, file: IO[bytes], size: int, on_progress: Progress | None) -> None:
    """Append the missing bytes to a file, over up to five connections as long as each delivers some."""
    for _ in range(5):
        if (start := file.tell()) == size:
            return
        reason = "the connection ended"
        deadline = _Deadline(_TIMEOUT_S, f"less than {_MIN_RATE_BYTES_S / 1000.0:g} kB/s came for {_TIMEOUT_S:g} s")
        try:
            with _open(url, deadline, start) as response:
                _append(url, file, size, response, deadline, on_progress)
        except HTTPError as error:
            if error.code != http.client.REQUESTED_RANGE_NOT_SATISFIABLE:
                raise CorpusError(f"{url}: cannot be fetched: {_reason(error)}") from error
            _empty(file)  # the server's file is shorter: start over
        except (OSError, http.client.HTTPException, ValueError) as error:
            reason = _reason(error)
        if file.tell() == start:
            break
    if file.tell() != size:
        raise CorpusError(f"{url}: {file.tell():,} of {size:,} bytes have come: {reason}; fetch it again to go on")


def _append(
    url: str, file: IO[bytes], size: int, response: Any, deadline: _Deadline, on_progress: Progress | None
) -> None:
    """Append a response to a file, or restart the file with it; raise CorpusError beyond `size` bytes."""
    if response.status != http.client.PARTIAL_CONTENT:
        _empty(file)  # the server sends the whole file
    elif not response.headers.get("Content-Range", "").startswith(f"bytes {file.tell()}-"):
        raise http.client.HTTPException("the server sends another part of the file than requested")
    while chunk := response.read1(1 << 18):
        deadline.postpone(len(chunk))
        if file.tell() + len(chunk) > size:
            _empty(file)
            raise CorpusError(f"{url}: is larger than the {size:,} bytes that the index states")
        file.write(chunk)
        if on_progress:
            on_progress(file.tell())


def _empty(file: IO[bytes]) -> None:
    file.seek(0)
    file.truncate()


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file; raise OSError if it cannot be read."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
