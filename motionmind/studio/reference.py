"""A reference video beside the piece: a file of this computer, shown on this computer alone."""

from __future__ import annotations

import ipaddress
import re
import stat
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import msgspec
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route

from motionmind.display import displayed_path
from motionmind.errors import MotionMindError
from motionmind.studio import api
from motionmind.studio.edits import SetReference
from motionmind.studio.project import RefusedError

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio

_MAX_PART_BYTES = 2**20  # of an answer: browsers ask for the next part when they need it, and hold no connection open
_RANGE = re.compile(r"bytes=(\d{0,15})-(\d{0,15})")
_ELSEWHERE = "the reference video is shown only on the studio's own computer"


class Referring(msgspec.Struct, forbid_unknown_fields=True):
    """The window that chooses a video, and the video's path."""

    window: api.Window
    path: Annotated[str, msgspec.Meta(max_length=4_096)]


class Video(NamedTuple):
    """A video file.

    Attributes:
        path: the file.
        type: its media type.
        size: its size in bytes.
    """

    path: Path
    type: str
    size: int


def find_video(path: str) -> Video:
    """Return the video at a path; raise MotionMindError if there is none that browsers know.

    Args:
        path: the path, absolute or beginning with "~".
    """
    try:
        file = Path(path).expanduser()
        if not file.is_absolute():
            raise MotionMindError(f"{displayed_path(path)}: needs its whole path, such as {Path.home() / 'dance.mp4'}")
        status = file.stat()
        if not stat.S_ISREG(status.st_mode):
            raise MotionMindError(f"{displayed_path(file)}: is not a file")
        with file.open("rb") as opened:
            head = opened.read(12)
    except (OSError, ValueError, RuntimeError) as error:  # ValueError: a null character; RuntimeError: no such home
        reason = error.strerror.lower() if isinstance(error, OSError) and error.strerror else str(error)
        raise MotionMindError(f"{displayed_path(path)}: {reason}") from error
    kind = _type_of(head)
    if not kind:
        raise MotionMindError(f"{displayed_path(file)}: is not a video that browsers play: WebM, MP4, MOV or Ogg")
    return Video(file, kind, status.st_size)


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes, which other computers may not use."""

    async def choose(request: Request) -> Response:
        given = await api.body_of(request, Referring)
        if not _is_here(request):
            return api.error(_ELSEWHERE, 403)
        video = find_video(given.path)
        try:
            studio.project.edit(given.window, SetReference(str(video.path)))
        except RefusedError as refusal:
            return api.error(str(refusal), 409)
        return api.json(studio.view(given.window))

    async def show(request: Request) -> Response:
        if not _is_here(request):
            return api.error(_ELSEWHERE, 403)
        if not studio.project.state.reference.path:
            return api.error("the piece has no reference video", 404)
        try:
            video = find_video(studio.project.state.reference.path)
        except MotionMindError as error:
            return api.error(str(error), 404)
        if "range" not in request.headers:
            return FileResponse(video.path, media_type=video.type)
        return _part(video, request.headers["range"])

    return [Route("/api/reference", show), Route("/api/reference", choose, methods=["POST"])]


def _part(video: Video, wanted: str) -> Response:
    """Return the beginning of a range of a video's bytes."""
    found = _RANGE.fullmatch(wanted)
    first, last = found.groups() if found else ("", "")
    if first:
        begin, end = int(first), min(int(last) + 1 if last else video.size, video.size)
    else:
        begin, end = max(video.size - int(last or 0), 0), video.size
    if begin >= end:
        answer = api.error(f"{displayed_path(video.path)} has {video.size} bytes", 416)
        answer.headers["content-range"] = f"bytes */{video.size}"
        return answer
    with video.path.open("rb") as file:
        file.seek(begin)
        data = file.read(min(end - begin, _MAX_PART_BYTES))
    headers = {"content-range": f"bytes {begin}-{begin + len(data) - 1}/{video.size}", "accept-ranges": "bytes"}
    return Response(data, 206, headers, media_type=video.type)


def _type_of(head: bytes) -> str:
    """Return the media type of a file by its first twelve bytes; "" if it is no video that browsers know."""
    if head.startswith(b"\x1a\x45\xdf\xa3"):
        return "video/webm"
    if head[4:8] == b"ftyp":
        return "video/mp4"
    return "video/ogg" if head.startswith(b"OggS") else ""


def _is_here(request: Request) -> bool:
    """Return whether a request comes from this computer."""
    client, server = request.scope.get("client"), request.scope.get("server")
    if not client or not server:
        return False
    return client[0] == server[0] or ipaddress.ip_address(client[0]).is_loopback
