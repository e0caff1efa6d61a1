"""Comments by the look-only link, which become notes of the piece."""

from __future__ import annotations

import secrets
import time
from collections import deque
from typing import TYPE_CHECKING, Annotated

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.errors import MotionMindError
from motionmind.studio import api
from motionmind.studio.asks import Frame
from motionmind.studio.edits import Annotate, Id, Note
from motionmind.studio.notes import COMMENTS, check_place
from motionmind.studio.project import RefusedError

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio

_MAX_COMMENTS = 500  # in a piece, so that the owner's own notes have room
_MAX_A_MINUTE = 60
_MAX_A_MINUTE_FROM_ADDRESS = 10
_MINUTE_S = 60.0
_JOINERS = "\u200c\u200d"  # within words of some languages, and within emoji


class Comment(msgspec.Struct, forbid_unknown_fields=True):
    """A comment, its author, and its place: a block of the piece, a frame of its movement, and seconds after it."""

    author: Annotated[str, msgspec.Meta(max_length=80)]
    text: Annotated[str, msgspec.Meta(max_length=500)]
    block: Id
    frame: Frame
    after: Annotated[float, msgspec.Meta(ge=0.0, le=600.0)] = 0.0


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the route for comments."""
    latest = deque[tuple[float, str]](maxlen=_MAX_A_MINUTE)  # time and address

    def is_often(address: str) -> bool:
        """Return whether another comment, now, would be too many."""
        now = time.monotonic()
        while latest and latest[0][0] < now - _MINUTE_S:
            latest.popleft()
        if len(latest) >= _MAX_A_MINUTE or [one for _, one in latest].count(address) >= _MAX_A_MINUTE_FROM_ADDRESS:
            return True
        latest.append((now, address))
        return False

    async def comment(request: Request) -> Response:
        given = await api.body_of(request, Comment)
        author, text = _plain(given.author), _plain(given.text)
        if not author or not text:
            raise MotionMindError("a comment needs a name and a text")
        if is_often(request.client.host if request.client else ""):
            return api.error("too many comments: wait a minute", 429)
        state = studio.project.state
        if sum(bool(note.author) for note in state.notes.values()) >= _MAX_COMMENTS:
            raise MotionMindError(f"a piece has at most {_MAX_COMMENTS} comments")
        note = Note(f"c-{secrets.token_hex(8)}", "note", text, given.block, given.frame, given.after, author)
        try:
            check_place(note, state.blocks)
            studio.project.edit(COMMENTS, Annotate(note))
        except RefusedError as refusal:
            return api.error(str(refusal), 409)
        return api.json(studio.look())

    return [Route("/api/comments", comment, methods=["POST"])]


def _plain(text: str) -> str:
    """Return a text in one line, without characters that are invisible or change the order of others."""
    return "".join(one for one in " ".join(text.split()) if one.isprintable() or one in _JOINERS).strip()
