"""Routes for the user's own movement: uploaded files, and corpora learned from them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.corpus import store
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.render.page import player_data
from motionmind.studio import api
from motionmind.studio.checks import corpora_of
from motionmind.studio.corpora import Lesson, Recording, check_lesson, known, learn, list_all, sheet_of
from motionmind.studio.uploads import Choices, Upload, Uploads

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes for uploads and corpora."""
    uploads = studio.uploads = Uploads()
    return [*_upload_routes(studio, uploads), *_corpus_routes(studio, uploads)]


def view(upload: Upload) -> dict[str, Any]:
    """Return an upload as the page sees it, without the body's measurements."""
    found: dict[str, Any] = msgspec.to_builtins(upload)
    if upload.facts is not None:
        found["facts"].pop("body")
        found["skips"] = [upload.skip(number) for number in range(len(upload.facts.clips))]
    return found


def _upload_routes(studio: Studio, uploads: Uploads) -> list[BaseRoute]:
    async def files(_: Request) -> Response:
        return api.json([view(one) for one in uploads.list()])

    async def take(request: Request) -> Response:
        name = unquote(request.headers.get("x-name", ""), errors="replace")
        return api.json(view(await uploads.take(name, request.stream())))

    async def read(request: Request) -> Response:
        choices = await api.body_of(request, Choices)
        return api.json(view(await uploads.read(request.path_params["upload"], choices)))

    async def forget(request: Request) -> Response:
        uploads.forget(request.path_params["upload"])
        return api.json({})

    async def show(request: Request) -> Response:
        motion = uploads.motion(request.path_params["upload"], request.path_params["clip"])
        data = await run_in_threadpool(player_data, motion)
        return api.json(data)

    async def keep(request: Request) -> Response:
        motion = uploads.motion(request.path_params["upload"], request.path_params["clip"])
        key = studio.project.movements.keep(motion, displayed(motion.name))
        return api.json({"key": key, "frames": len(motion)})

    clip = "/api/imports/{upload:str}/{clip:int}"
    return [
        Route("/api/imports", files, methods=["GET"]),
        Route("/api/imports", take, methods=["POST"]),
        Route("/api/imports/{upload:str}", read, methods=["POST"]),
        Route("/api/imports/{upload:str}", forget, methods=["DELETE"]),
        Route(f"{clip}/movement", show, methods=["GET"]),
        Route(f"{clip}/keep", keep, methods=["POST"]),
    ]


def _corpus_routes(studio: Studio, uploads: Uploads) -> list[BaseRoute]:
    home = studio.home

    async def corpora(_: Request) -> Response:
        return api.json(await run_in_threadpool(list_all, home))

    async def sheet(request: Request) -> Response:
        return api.json(await run_in_threadpool(_sheet, request.path_params["name"], home))

    async def begin(request: Request) -> Response:
        lesson = await api.body_of(request, Lesson)
        check_lesson(lesson, home)
        recordings = [_recording(uploads, part.upload, part.clip) for part in lesson.parts]
        job = studio.workers.submit("learn", learn, lesson, recordings, home, finish=learned)
        return api.json({"job": job.id})

    def learned(result: dict[str, Any]) -> dict[str, Any]:
        """Return the result unchanged, after dropping cached data of the corpus, which may have been missing."""
        studio.forget(result["name"])
        return result

    async def delete(request: Request) -> Response:
        name = known(request.path_params["name"], home)
        if name in corpora_of(studio.project.state):
            raise MotionMindError(f"cannot delete corpus {displayed(name)}: this piece uses it")
        if name in studio.project.versions:
            raise MotionMindError(f"cannot delete corpus {displayed(name)}: undo or redo may need it")
        store.delete(name, home)
        studio.forget(name)
        return api.json({})

    return [
        Route("/api/corpora", corpora, methods=["GET"]),
        Route("/api/corpora", begin, methods=["POST"]),
        Route("/api/corpora/{name:str}", sheet, methods=["GET"]),
        Route("/api/corpora/{name:str}", delete, methods=["DELETE"]),
    ]


def _recording(uploads: Uploads, upload: str, clip: int) -> Recording:
    own = uploads.get(upload)
    if own.facts is None or not 0 <= clip < len(own.facts.clips):
        raise MotionMindError(own.error or f"{own.name} has no clip {clip + 1}")
    return Recording(uploads.folder(upload), own.facts, clip, own.skip(clip))


def _sheet(name: str, home: Any) -> dict[str, Any]:
    from motionmind.learned import persistence

    return sheet_of(persistence.load_corpus(known(name, home), home), name)
