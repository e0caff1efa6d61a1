"""A reference video beside the piece: a file of this computer, shown on this computer alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.display import displayed_path
from motionmind.errors import MotionMindError
from motionmind.studio import api
from motionmind.studio.local_files import LocalFile, PathText, find_file, is_here, show_file
from motionmind.studio.project import RefusedError
from motionmind.studio.settings import SetReference

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio

_ELSEWHERE = "the reference video is shown only on the studio's own computer"


class Referring(msgspec.Struct, forbid_unknown_fields=True):
    """The window that chooses a video, and the video's path."""

    window: api.Window
    path: PathText


def find_video(path: str) -> LocalFile:
    """Return the video at a path; raise MotionMindError if there is none that browsers know.

    Args:
        path: the path, absolute or beginning with "~".
    """
    video = find_file(path, "dance.mp4", _type_of)
    if not video.type:
        raise MotionMindError(f"{displayed_path(video.path)}: is not a video that browsers play: WebM, MP4, MOV or Ogg")
    return video


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes, which other computers may not use."""

    async def choose(request: Request) -> Response:
        given = await api.body_of(request, Referring)
        if not is_here(request):
            return api.error(_ELSEWHERE, 403)
        video = find_video(given.path)
        try:
            studio.project.edit(given.window, SetReference(str(video.path)))
        except RefusedError as refusal:
            return api.error(str(refusal), 409)
        return api.json(studio.view(given.window))

    async def show(request: Request) -> Response:
        if not is_here(request):
            return api.error(_ELSEWHERE, 403)
        if not studio.project.state.reference.path:
            return api.error("the piece has no reference video", 404)
        try:
            video = find_video(studio.project.state.reference.path)
        except MotionMindError as error:
            return api.error(str(error), 404)
        return show_file(request, video)

    return [Route("/api/reference", show), Route("/api/reference", choose, methods=["POST"])]


def _type_of(head: bytes) -> str:
    """Return the media type of a file by its first twelve bytes; "" if it is no video that browsers know."""
    if head.startswith(b"\x1a\x45\xdf\xa3"):
        return "video/webm"
    if head[4:8] == b"ftyp":
        return "video/mp4"
    return "video/ogg" if head.startswith(b"OggS") else ""
