"""Films of the piece as MP4: drawn and encoded by a worker, and fetched when they are done."""

from __future__ import annotations

import asyncio
import shutil
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route

from motionmind._typing import Pixels
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.studio import api
from motionmind.studio.casting import ensemble_of
from motionmind.studio.export import composed, file_name, music_for, saving_headers
from motionmind.studio.music import sound_of
from motionmind.studio.room import Room
from motionmind.studio.settings import SetMusic
from motionmind.studio.workers import Job, Report

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio

FILM_HEIGHT_PX = 720
FILM_RATE_FPS = 30.0
MIN_ELEVATION_DEG = 4.0  # nearer to the floor's level, the floor is a line
_N_FRAMES_PER_REPORT = 8
_MAX_KEPT_FILMS = 4


class Direction(msgspec.Struct, forbid_unknown_fields=True):
    """The direction of the camera: degrees to the performer's left of the front, and above the floor."""

    azimuth: Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)]
    elevation: Annotated[float, msgspec.Meta(ge=0.0, le=90.0)]


class _Film(NamedTuple):
    """A film's file, its name for the user, and the job that makes it."""

    path: Path
    name: str
    job: Job


def draw_film(
    report: Report, motions: Sequence[Motion], direction: Direction, path: Path, music: SetMusic | None
) -> None:
    """Draw and encode a film, in a worker.

    Args:
        report: receives the number of frames drawn.
        motions: the motion, or those of several dancers on one clock, at the film's rate.
        direction: where the camera stands.
        path: the file.
        music: the music that the film carries; None for a silent film.
    """
    from motionmind.render.film import encode_mp4
    from motionmind.render.group import GroupStage
    from motionmind.render.stage import Stage
    from motionmind.render.timing import frame_times
    from motionmind.render.view import view_from

    view = view_from("as in the studio", direction.azimuth, max(direction.elevation, MIN_ELEVATION_DEG))
    stage: Stage | GroupStage
    if len(motions) > 1:
        stage = GroupStage(motions, view=view, size=FILM_HEIGHT_PX)
    else:
        stage = Stage(motions[0], frame_times(motions[0], FILM_RATE_FPS), view=view, size=FILM_HEIGHT_PX)

    def reported() -> Iterator[Pixels]:
        for number, picture in enumerate(stage.frames()):
            if number % _N_FRAMES_PER_REPORT == 0:
                report(number, len(stage))
            yield picture

    sound = sound_of(music.path, music.begins, len(stage) / FILM_RATE_FPS) if music else None
    encode_mp4(path, stage, FILM_RATE_FPS, reported(), sound)


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes for films."""
    room = Room()
    films: OrderedDict[str, _Film] = OrderedDict()
    tidying: set[asyncio.Task[None]] = set()

    async def tidy(job: Job) -> None:
        """Wait for a film; if it fails or is cancelled, remove what there is of it."""
        try:
            await job.result()
        except MotionMindError:
            _remove(films.pop(job.id))

    async def make(request: Request) -> Response:
        from motionmind.render.film import encoder_program

        direction = await api.body_of(request, Direction)
        if encoder_program() is None:
            return api.json({"job": None})  # the page then films by itself
        motions = [composed(studio)]
        if studio.project.state.cast.dancers:
            ensemble = await ensemble_of(studio)
            motions = await run_in_threadpool(ensemble.motions, ensemble.times(FILM_RATE_FPS))
        if len(motions[0]) < 2:
            raise MotionMindError("the piece is a single posture: nothing to film")
        for old in [one for one in films.values() if one.job.state == "done"][: 1 - _MAX_KEPT_FILMS]:
            _remove(films.pop(old.job.id))
        number = 1 + max((int(film.path.parent.name) for film in films.values()), default=0)
        folder = room.folder / str(number)
        folder.mkdir()
        path = folder / "film.mp4"
        job = studio.workers.submit("film", draw_film, motions, direction, path, music_for(studio, request))
        films[job.id] = _Film(path, file_name(studio.project.state.title, "mp4"), job)
        tidying.add(task := asyncio.create_task(tidy(job)))
        task.add_done_callback(tidying.discard)
        return api.json({"job": job.id})

    async def fetch(request: Request) -> Response:
        film = films.get(request.path_params["job"])
        if film is None or film.job.state != "done":
            return api.error("there is no such film: make it again", 404)
        return FileResponse(film.path, media_type="video/mp4", headers=saving_headers(film.name))

    return [Route("/api/films", make, methods=["POST"]), Route("/api/films/{job}", fetch)]


def _remove(film: _Film) -> None:
    shutil.rmtree(film.path.parent, ignore_errors=True)
