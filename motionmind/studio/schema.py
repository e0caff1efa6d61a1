"""The schema of the API: the types of each route's request and answer, and an OpenAPI document.

The page relies on it, and tests check every answer against it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import msgspec

from motionmind.studio.answers import (
    Approaching,
    Asking,
    Begun,
    EnsembleView,
    Entered,
    Entering,
    Failure,
    FilmBegun,
    Health,
    JobView,
    Looking,
    MovementData,
    Nothing,
    ProjectView,
    Proving,
    Renewing,
    VersionView,
    Visiting,
)
from motionmind.studio.api import Edited, Windowed
from motionmind.studio.between import Acceptance, Between, Desk, DeskKeeping
from motionmind.studio.comments import Comment
from motionmind.studio.corpora import Lesson
from motionmind.studio.filming import Direction
from motionmind.studio.music import ChoosingMusic
from motionmind.studio.panel_answers import (
    ComposedView,
    CorpusView,
    Credited,
    Gallery,
    KeptView,
    Lines,
    Map,
    Opened,
    Posed,
    Sheet,
    UploadView,
    Variation,
)
from motionmind.studio.posing import Changing, Dragging, Keeping, Opening, Telling, Turning
from motionmind.studio.recent import RecentOpening, RecentProject
from motionmind.studio.reference import Referring
from motionmind.studio.scoring import Composing, Scoring
from motionmind.studio.uploads import Choices
from motionmind.studio.varied import Ordering, Wish


class Call(NamedTuple):
    """A route.

    Attributes:
        method: its method.
        path: its path, with parameters in braces.
        takes: the type of its body; None for no body or a file.
        answers: the type of its answer, or its media type if it is not JSON.
    """

    method: str
    path: str
    takes: Any
    answers: Any


CALLS = (
    Call("GET", "/health", None, Health),
    Call("POST", "/api/enter", Entering, Entered),
    Call("POST", "/api/challenge", Asking, Proving),
    Call("POST", "/api/renew", Proving, Nothing),
    Call("GET", "/api/renewal", None, Renewing),
    Call("POST", "/api/visit", None, Visiting),
    Call("GET", "/api/link", None, Looking),
    Call("POST", "/api/link", None, Looking),
    Call("GET", "/api/schema", None, dict[str, Any]),
    Call("GET", "/api/project", None, ProjectView),
    Call("POST", "/api/edits", Edited, ProjectView),
    Call("POST", "/api/undo", Windowed, ProjectView),
    Call("POST", "/api/redo", Windowed, ProjectView),
    Call("POST", "/api/comments", Comment, ProjectView),
    Call("GET", "/api/events", None, "text/event-stream"),
    Call("GET", "/api/jobs/{id}", None, JobView),
    Call("DELETE", "/api/jobs/{id}", None, JobView),
    Call("GET", "/api/movements/{key}", None, MovementData),
    Call("GET", "/api/thumbnails/{key}/{frame}.png", None, "image/png"),
    Call("POST", "/api/seams", None, Nothing),
    Call("DELETE", "/api/seams", None, Nothing),
    Call("GET", "/api/gallery", None, Gallery),
    Call("GET", "/api/desk", None, Desk),
    Call("POST", "/api/desk", DeskKeeping, Nothing),
    Call("POST", "/api/between", Between, Begun),
    Call("POST", "/api/between/accept", Acceptance, ProjectView),
    Call("GET", "/api/between/{job}/{number}", None, MovementData),
    Call("GET", "/api/between/{job}/{number}/{frame}.png", None, "image/png"),
    Call("GET", "/api/vary/map", None, Map),
    Call("POST", "/api/vary", Wish, Variation),
    Call("POST", "/api/vary/accept", Ordering, ProjectView),
    Call("GET", "/api/imports", None, list[UploadView]),
    Call("POST", "/api/imports", None, UploadView),
    Call("POST", "/api/imports/{upload}", Choices, UploadView),
    Call("DELETE", "/api/imports/{upload}", None, Nothing),
    Call("GET", "/api/imports/{upload}/{clip}/movement", None, MovementData),
    Call("POST", "/api/imports/{upload}/{clip}/keep", None, KeptView),
    Call("GET", "/api/corpora", None, list[CorpusView]),
    Call("POST", "/api/corpora", Lesson, Begun),
    Call("GET", "/api/corpora/{name}", None, Sheet),
    Call("DELETE", "/api/corpora/{name}", None, Nothing),
    Call("POST", "/api/pose/open", Opening, Opened),
    Call("POST", "/api/pose/tell", Telling, Posed),
    Call("POST", "/api/pose/drag", Dragging, Posed),
    Call("POST", "/api/pose/turn", Turning, Posed),
    Call("POST", "/api/pose/change", Changing, Posed),
    Call("POST", "/api/pose/keep", Keeping, KeptView),
    Call("POST", "/api/pose/score", Keeping, Lines),
    Call("POST", "/api/score", Scoring, Begun),
    Call("POST", "/api/score/compose", Composing, ComposedView),
    Call("GET", "/api/reference", None, "application/octet-stream"),
    Call("POST", "/api/reference", Referring, ProjectView),
    Call("GET", "/api/ensemble", None, EnsembleView),
    Call("POST", "/api/ensemble", None, ProjectView),
    Call("GET", "/api/ensemble/near", None, list[Approaching]),
    Call("GET", "/api/ensemble/{format}", None, "application/octet-stream"),
    Call("GET", "/api/music", None, "application/octet-stream"),
    Call("POST", "/api/music", ChoosingMusic, Begun),
    Call("GET", "/api/recent", None, list[RecentProject]),
    Call("POST", "/api/recent", RecentOpening, Nothing),
    Call("GET", "/api/versions", None, list[VersionView]),
    Call("GET", "/api/credits", None, Credited),
    Call("POST", "/api/films", Direction, FilmBegun),
    Call("GET", "/api/films/{job}", None, "video/mp4"),
    Call("GET", "/api/sheet/{format}", None, "application/octet-stream"),
    Call("GET", "/api/export/{format}", None, "application/octet-stream"),
)


def document() -> dict[str, Any]:
    """Return the API as an OpenAPI 3.1 document."""
    types = [
        kind for call in CALLS for kind in (call.takes, call.answers) if kind is not None and kind.__class__ is not str
    ]
    schemas, components = msgspec.json.schema_components([*types, Failure], ref_template="#/components/schemas/{name}")
    found = iter(schemas)
    paths: dict[str, dict[str, Any]] = {}
    for call in CALLS:
        told: dict[str, Any] = {}
        if call.takes is not None:
            told["requestBody"] = {"content": {"application/json": {"schema": next(found)}}, "required": True}
        media = call.answers if isinstance(call.answers, str) else "application/json"
        schema = {} if isinstance(call.answers, str) else {"schema": next(found)}
        told["responses"] = {"200": {"description": "done", "content": {media: schema}}}
        paths.setdefault(call.path, {})[call.method.lower()] = told
    failure = {"description": "not done", "content": {"application/json": {"schema": next(found)}}}
    for told in (one for methods in paths.values() for one in methods.values()):
        told["responses"]["4XX"] = failure
    title = {"title": "MotionMind studio", "version": "1"}
    return {"openapi": "3.1.0", "info": title, "paths": paths, "components": {"schemas": components}}
