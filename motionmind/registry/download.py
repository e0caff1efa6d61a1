"""Download files over TLS, with a size limit, verification, and resumption.

Every file is checked against the SHA-256 in the index, so any later process can resume a partial download without
asking the server whether it still has the same file.
"""

from __future__ import annotations

import hashlib
import http.client
import ipaddress
import shutil
import urllib.request
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import IO, Any
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit

from motionmind.errors import CorpusError
from motionmind.files import sync_folder

_TIMEOUT_S = 30.0  # for a server to answer, or to send the next bytes

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


class _Redirections(urllib.request.HTTPRedirectHandler):
    """Follows redirections to allowed addresses only."""

    max_redirections = 5

    def redirect_request(
        self, req: urllib.request.Request, fp: IO[bytes], code: int, msg: str, headers: Any, newurl: str
    ) -> urllib.request.Request | None:
        """Return the request for the new address."""
        check_address(newurl, req.full_url)
        return super().redirect_request(req, fp, code, msg, headers, newurl)


def _open(url: str, start: int = 0) -> Any:
    """Request an address from byte `start`; return the response, with status 206 from that byte, or 200 from byte 0."""
    check_address(url)
    request = urllib.request.Request(url, headers={"Accept-Encoding": "identity", "User-Agent": "motionmind"})
    if start:
        request.add_header("Range", f"bytes={start}-")
    handlers: list[urllib.request.BaseHandler] = [_Redirections()]
    if _is_loopback(urlsplit(url).hostname or ""):
        handlers.append(urllib.request.ProxyHandler({}))  # a proxy would ask its own machine
    return urllib.request.build_opener(*handlers).open(request, timeout=_TIMEOUT_S)


def _reason(error: Exception) -> str:
    """Describe why a request failed."""
    if isinstance(error, HTTPError):
        return f"the server answers {error.code} {error.reason}"
    cause = error.reason if isinstance(error, URLError) else error
    if isinstance(cause, TimeoutError):
        return f"nothing came for {_TIMEOUT_S:g} s"
    if isinstance(cause, OSError):
        return cause.strerror or str(cause)
    return str(cause) or type(cause).__name__


def read_address(url: str, most: int) -> tuple[bytes, str]:
    """Read a small file; return its bytes, and the address after redirections.

    Args:
        url: the address.
        most: its largest allowed size in bytes.

    Raises:
        CorpusError: the address is not allowed or cannot be reached, or the file is larger.
    """
    try:
        with _open(url) as response:
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
        CorpusError: it cannot be reached, ends early, is larger, has another hash, or the disk is too small.
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
        try:
            with _open(url, start) as response:
                _append(url, file, size, response, on_progress)
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


def _append(url: str, file: IO[bytes], size: int, response: Any, on_progress: Progress | None) -> None:
    """Append a response to a file, or restart the file with it; raise CorpusError beyond `size` bytes."""
    if response.status != http.client.PARTIAL_CONTENT:
        _empty(file)  # the server sends the whole file
    elif not response.headers.get("Content-Range", "").startswith(f"bytes {file.tell()}-"):
        raise http.client.HTTPException("the server sends another part of the file than requested")
    while chunk := response.read(1 << 18):
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
