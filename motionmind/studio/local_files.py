"""Files of this computer that the page plays, such as a video: found by their path, shown on this computer alone."""

from __future__ import annotations

import ipaddress
import re
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, NamedTuple

import msgspec
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from motionmind.display import displayed_path
from motionmind.errors import MotionMindError
from motionmind.studio import api

_MAX_PART_BYTES = 2**20  # of an answer: browsers ask for the next part when they need it, and hold no connection open
_RANGE = re.compile(r"bytes=(\d{0,15})-(\d{0,15})")

PathText = Annotated[str, msgspec.Meta(max_length=4_096)]


class LocalFile(NamedTuple):
    """A file of this computer.

    Attributes:
        path: the file.
        type: its media type; "" if its kind is unknown.
        size: its size in bytes.
    """

    path: Path
    type: str
    size: int


def find_file(path: str, example: str, type_of: Callable[[bytes], str]) -> LocalFile:
    """Return the file at a path; raise MotionMindError if there is none.

    Args:
        path: the path, absolute or beginning with "~".
        example: the name of such a file, for the message.
        type_of: returns the media type of a file by its first twelve bytes; "" if it is of no known kind.
    """
    try:
        file = Path(path).expanduser()
        if not file.is_absolute():
            raise MotionMindError(f"{displayed_path(path)}: needs its whole path, such as {Path.home() / example}")
        status = file.stat()
        if not stat.S_ISREG(status.st_mode):
            raise MotionMindError(f"{displayed_path(file)}: is not a file")
        with file.open("rb") as opened:
            head = opened.read(12)
    except (OSError, ValueError, RuntimeError) as error:  # ValueError: a null character; RuntimeError: no such home
        reason = error.strerror.lower() if isinstance(error, OSError) and error.strerror else str(error)
        raise MotionMindError(f"{displayed_path(path)}: {reason}") from error
    return LocalFile(file, type_of(head), status.st_size)


def show_file(request: Request, file: LocalFile) -> Response:
    """Return a file, or the beginning of the range of its bytes that a request names."""
    if "range" not in request.headers:
        return FileResponse(file.path, media_type=file.type)
    found = _RANGE.fullmatch(request.headers["range"])
    first, last = found.groups() if found else ("", "")
    if first:
        begin, end = int(first), min(int(last) + 1 if last else file.size, file.size)
    else:
        begin, end = max(file.size - int(last or 0), 0), file.size
    if begin >= end:
        answer = api.error(f"{displayed_path(file.path)} has {file.size} bytes", 416)
        answer.headers["content-range"] = f"bytes */{file.size}"
        return answer
    with file.path.open("rb") as opened:
        opened.seek(begin)
        data = opened.read(min(end - begin, _MAX_PART_BYTES))
    headers = {"content-range": f"bytes {begin}-{begin + len(data) - 1}/{file.size}", "accept-ranges": "bytes"}
    return Response(data, 206, headers, media_type=file.type)


def is_here(request: Request) -> bool:
    """Return whether a request comes from this computer."""
    client, server = request.scope.get("client"), request.scope.get("server")
    if not client or not server:
        return False
    return client[0] == server[0] or ipaddress.ip_address(client[0]).is_loopback
