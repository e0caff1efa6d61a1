"""Export the piece as a motion file or as a standalone page, and download the project."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.body.motion import Motion
from motionmind.credits.credit import Credit
from motionmind.credits.ledger import ledger_of, sections_of
from motionmind.errors import MotionMindError, suggestion
from motionmind.formats import write_motion
from motionmind.formats.bvh import write_bvh
from motionmind.render.page import page
from motionmind.studio.api import json
from motionmind.studio.local_files import is_here
from motionmind.studio.music import has_sound, sound_of
from motionmind.studio.placement import performance
from motionmind.studio.settings import SetMusic
from motionmind.studio.view import layout_of

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio

_MEDIA_TYPES = {
    "html": "text/html; charset=utf-8",
    "glb": "model/gltf-binary",
    "bvh": "text/plain; charset=utf-8",
    "json": "application/json",
    "motionmind": "application/jsonl",
    "pdf": "application/pdf",
    "png": "image/png",
    "zip": "application/zip",
}


def composed(studio: Studio) -> Motion:
    """Return the piece as one movement; `insertions` marks what the engine inserted.

    Raises:
        MotionMindError: the piece is empty, or a movement is missing.
    """
    project = studio.project
    if not project.state.blocks:
        raise MotionMindError("the piece is empty: nothing to export")
    if missing := project.missing:
        raise MotionMindError(f"cannot export the piece: {missing[0]}")
    layout = layout_of(project.state, project.finding, project.marks, project.standing)
    return replace(performance(list(layout.parts), studio.movements.get), name=project.state.title or "piece")


def credits_of(studio: Studio) -> tuple[Credit, ...]:
    """Return the credits of the movements in the piece; raise MotionMindError if a movement is missing."""
    return composed(studio).credits if studio.project.state.blocks else ()


def file_name(title: str, suffix: str) -> str:
    """Return a file name that is valid on every system.

    >>> from motionmind.studio.export import file_name
    >>> file_name("Swan: act 2/3", "bvh")
    'Swan- act 2-3.bvh'
    """
    safe = re.sub(r'[\\/:*?"<>|\x00-\x1f\x7f]+', "-", title)  # each is invalid on some system
    plain = safe.strip(". ")[:100].rstrip(". ")
    return f"{plain or 'piece'}.{suffix}"


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes for exports and credits."""
    makers: dict[str, Callable[[Motion], bytes]] = {
        "glb": lambda motion: written(".glb", lambda path: write_motion(path, motion)),
        "bvh": lambda motion: bvh(motion if motion.is_even else motion.resample(30.0)),
        "json": lambda motion: written(".json", lambda path: write_motion(path, motion)),
    }

    async def export(request: Request) -> Response:
        form = request.path_params["format"]
        title = studio.project.state.title
        if form == "project":
            return saved(studio.project.path.read_bytes(), file_name(title, "motionmind"))
        if form == "html":
            music = music_for(studio, request)
            data = await run_in_threadpool(_page, composed(studio), music, studio.project.state.stage)
            return saved(data, file_name(title, form))
        if form not in makers:
            raise MotionMindError(f"cannot export as {form!r:.20}{suggestion(form, ['html', *makers])}")
        data = await run_in_threadpool(makers[form], composed(studio))
        return saved(data, file_name(title, form))

    async def credit(_: Request) -> Response:
        sections = sections_of(ledger_of(await run_in_threadpool(credits_of, studio)))
        return json({"sections": [{"heading": heading, "lines": lines} for heading, lines in sections.items()]})

    return [Route("/api/export/{format}", export), Route("/api/credits", credit)]


def music_for(studio: Studio, request: Request) -> SetMusic | None:
    """Return the music that goes into a film or page that a request makes; None for silence, as on other computers."""
    return studio.project.state.music if has_sound(studio.project.state) and is_here(request) else None


def _page(motion: Motion, music: SetMusic | None, stage: tuple[float, float] | None) -> bytes:
    """Return the page that plays a movement, with its music and the edge of its stage."""
    seconds = float(motion.times[-1] - motion.times[0])
    sound = sound_of(music.path, music.begins, seconds) if music else None
    return page(motion, sound=sound, stage=stage).encode()


def bvh(motion: Motion) -> bytes:
    """Return the content of a BVH file of an evenly sampled motion, in metres: Blender's unit; the panel says so."""
    return written(".bvh", lambda path: write_bvh(path, motion, "m"))


def written(suffix: str, write: Callable[[Path], None]) -> bytes:
    """Return the content of a file that a function writes to a path with this suffix."""
    with tempfile.TemporaryDirectory(prefix="motionmind-") as folder:
        path = Path(folder) / f"piece{suffix}"
        write(path)
        return path.read_bytes()


def saved(data: bytes, name: str) -> Response:
    """Return a response that a browser saves as a file."""
    return Response(data, media_type=_MEDIA_TYPES[name.rpartition(".")[2]], headers=saving_headers(name))


def saving_headers(name: str) -> dict[str, str]:
    """Return the headers by which a browser saves a response as a file of this name."""
    disposition = f"attachment; filename*=UTF-8''{quote(name, safe='')}"
    return {"Content-Disposition": disposition, "Cache-Control": "no-store"}
