"""The project's dancers as an ensemble: where each is, who comes too near another, and ensembles from files."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import degrees, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.body.motion import Motion
from motionmind.body.rates import MAX_POSITIONS
from motionmind.clip_names import split_clip
from motionmind.display import displayed
from motionmind.ensemble import NEAR_M, dancers
from motionmind.ensemble.changes import assigned, send, whereabouts
from motionmind.ensemble.dancers import Ensemble, find_approaches
from motionmind.ensemble.formations import places_in
from motionmind.ensemble.reading import read_ensemble
from motionmind.errors import MotionMindError, suggestion
from motionmind.render.group_page import dancer_data, paints
from motionmind.studio import api
from motionmind.studio.casting_files import MAKERS, name_in, page
from motionmind.studio.dancers import Cast, Change, Dancer, PutDancer, RemoveDancer, SetFormations
from motionmind.studio.edits import Arrange, Block, Several, Single
from motionmind.studio.export import composed, file_name, music_for, saved
from motionmind.studio.music import sound_of
from motionmind.studio.piece import State
from motionmind.studio.project import Project, RefusedError
from motionmind.studio.settings import MAX_TEMPO, MIN_TEMPO, SetStage, SetTempo
from motionmind.tween.counts import counts_to_seconds, seconds_to_count

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio


_MAX_ENSEMBLE_BYTES = 2**20  # of a file


def staged(
    cast: Cast,
    piece: Motion,
    movement: Callable[[str], Motion],
    tempo: float,
    stage: tuple[float, float] | None = None,
) -> Ensemble:
    """Return a project's dancers as an ensemble.

    Args:
        cast: the dancers.
        piece: the piece, which all dance who have no movement of their own.
        movement: returns movements by key.
        tempo: counts a minute.
        stage: width and depth of the stage, metres; None for none.
    """
    found: Sequence[dancers.Dancer] = [
        dancers.Dancer(
            one.name,
            movement(one.source) if one.source else piece,
            one.place,
            radians(one.facing),
            counts_to_seconds(one.entry - 1.0, tempo),
            one.mirrored,
            source=one.source,
        )
        for one in cast.dancers
    ]
    for change in cast.changes:
        start, end = (counts_to_seconds(count - 1.0, tempo) for count in (change.at, change.at + change.counts))
        targets = whereabouts(found, start)
        if change.formation is not None:
            targets = assigned(targets, places_in(change.formation, len(found), change.spacing))
        for number, one in enumerate(cast.dancers):
            targets[number] = change.places.get(one.id, targets[number])
        found = send(found, targets, start, end)
    return Ensemble(piece.name, tuple(found), tempo, stage)


def cast_of(ensemble: Ensemble, sources: Sequence[str]) -> Cast:
    """Return an ensemble's dancers as those of a project; the inverse of `staged`.

    Args:
        ensemble: the ensemble.
        sources: of each dancer, the key of a movement of its own; "" for the piece.
    """
    tempo = ensemble.tempo or State().tempo
    own = tuple(
        Dancer(
            f"d{number}",
            one.name,
            one.place,
            round(degrees(one.facing), 9),
            round(seconds_to_count(one.entry, tempo), 9),
            one.is_mirrored,
            source,
        )
        for number, (one, source) in enumerate(zip(ensemble.dancers, sources, strict=True), start=1)
    )
    changes = []
    for way in ensemble.dancers[0].ways:  # all go at the same counts
        at, end = (seconds_to_count(time, tempo) for time in (way.start, way.end))
        places = whereabouts(ensemble.dancers, way.end).tolist()
        changes.append(
            Change(
                round(at, 9),
                round(end - at, 9),
                places={one.id: (x, z) for one, (x, z) in zip(own, places, strict=True)},
            )
        )
    return Cast(own, tuple(changes))


def check_tempo(ensemble: Ensemble) -> None:
    """Check that a project can count an ensemble's tempo; raise MotionMindError if it cannot."""
    low, high = MIN_TEMPO, MAX_TEMPO
    if ensemble.tempo is not None and not low <= ensemble.tempo <= high:
        raise MotionMindError(
            f"{displayed(ensemble.name)}: the studio counts {low:g} to {high:g} a minute, not {ensemble.tempo:g}"
        )


def take_in_ensemble(project: Project, ensemble: Ensemble, window: str) -> None:
    """Make an ensemble the dancers of a project: the piece that most of them dance becomes its piece.

    All of it is one edit, which one undo takes back.

    Args:
        project: the project.
        ensemble: the ensemble.
        window: the window that makes the edit.

    Raises:
        MotionMindError: its tempo is not one of the studio's, or it cannot be written.
    """
    check_tempo(ensemble)
    pieces = [id(one.piece) for one in ensemble.dancers]
    common = max(pieces, key=pieces.count)  # the first of them
    keys = {id(one.piece): project.movements.keep(one.piece, displayed(one.piece.name)) for one in ensemble.dancers}
    piece = next(one.piece for one in ensemble.dancers if id(one.piece) == common)
    state = project.state
    number = next(number for number in range(1, len(state.used) + 2) if f"b{number}" not in state.used)
    cast = cast_of(ensemble, ["" if one == common else keys[one] for one in pieces])
    words = f"open the ensemble {displayed(ensemble.name)}"
    edits: list[Single] = [Arrange((Block(f"b{number}", keys[common], 0, len(piece) - 1),), {"words": words})]
    if ensemble.tempo is not None:
        edits.append(SetTempo(ensemble.tempo, state.counts))
    edits += [RemoveDancer(one.id) for one in state.cast.dancers]
    edits += [PutDancer(one) for one in cast.dancers]
    edits += [SetFormations(cast.changes), SetStage(ensemble.stage)]
    project.edit(window, Several(tuple(edits), words))


async def ensemble_of(studio: Studio) -> Ensemble:
    """Return the project's dancers; raise MotionMindError if it has none, or nothing to dance."""
    state = studio.project.state
    if not state.cast.dancers:
        raise MotionMindError("the piece has no dancers: add one first")

    def stage() -> Ensemble:
        return staged(state.cast, composed(studio), studio.movements.get, state.tempo, state.stage)

    return await run_in_threadpool(stage)


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes for ensembles."""

    async def show(_: Request) -> Response:
        cast = studio.project.state.cast
        return api.json(await run_in_threadpool(_view, await ensemble_of(studio), cast))

    async def near(_: Request) -> Response:
        return api.json(await run_in_threadpool(_near, await ensemble_of(studio)))

    async def take(request: Request) -> Response:
        name = displayed(unquote(request.headers.get("x-name", ""), errors="replace"))
        window, data = api.window_of(request), await request.body()
        if len(data) > _MAX_ENSEMBLE_BYTES:
            raise MotionMindError(f"{name}: an ensemble's file has at most {_MAX_ENSEMBLE_BYTES >> 20} MB")
        found = await run_in_threadpool(_read, name, data, _pieces(studio))
        try:
            take_in_ensemble(studio.project, found, window)
        except RefusedError as refusal:
            return api.error(str(refusal), 409)
        return api.json(studio.view(window))

    async def export(request: Request) -> Response:
        form = request.path_params["format"]
        if form != "html" and form not in MAKERS:
            raise MotionMindError(f"cannot export an ensemble as {form!r:.20}{suggestion(form, ['html', *MAKERS])}")
        title, ensemble = Path(file_name(studio.project.state.title, form)).stem, await ensemble_of(studio)
        if form == "html":
            music = music_for(studio, request)
            sound = await run_in_threadpool(sound_of, music.path, music.begins, ensemble.seconds) if music else None
            data = await run_in_threadpool(page, ensemble, sound)
        else:
            data = await run_in_threadpool(MAKERS[form], ensemble, title)
        return saved(data, name_in(title, form))

    return [
        Route("/api/ensemble", show, methods=["GET"]),
        Route("/api/ensemble", take, methods=["POST"]),
        Route("/api/ensemble/near", near, methods=["GET"]),
        Route("/api/ensemble/{format}", export, methods=["GET"]),
    ]


def _view(ensemble: Ensemble, cast: Cast) -> dict[str, Any]:
    """Return an ensemble as the page plays it, with the data of group_page and the dancers' ids."""
    own = [
        dancer_data(number, one)
        | {"id": member.id, "source": member.source, "mirrored": member.mirrored}
        | {"end": one.end}
        for number, (one, member) in enumerate(zip(ensemble.dancers, cast.dancers, strict=True))
    ]
    times = {"frames": ensemble.count_frames(), "rate": ensemble.rate, "seconds": ensemble.seconds}
    return {"dancers": own, "paints": paints(len(own)), **times}


def _near(ensemble: Ensemble) -> list[dict[str, Any]]:
    """Return the pairs of dancers who come nearer than an arm's length, closest first, and when.

    Long pieces of many dancers are sampled at the rate at which they can be made at once.
    """
    joints = len(ensemble.dancers) * len(ensemble.dancers[0].piece.skeleton)
    most = (MAX_POSITIONS / joints - 2.0) / max(ensemble.seconds, 1.0)
    motions = ensemble.motions(ensemble.times(min(ensemble.rate, most)))
    return [
        {
            "names": one.names,
            "metres": one.metres,
            "seconds": one.seconds,
            "count": seconds_to_count(one.seconds, ensemble.tempo or State().tempo),
        }
        for one in find_approaches(motions)
        if one.metres < NEAR_M
    ]


def _pieces(studio: Studio) -> Callable[[str], Motion]:
    """Return a function that finds the pieces which an ensemble's file names: uploads, and clips of corpora."""
    uploads = {one.name: one for one in studio.uploads.list() if one.facts}

    def read(piece: str) -> Motion:
        path, wanted = split_clip(piece)
        if (upload := uploads.get(Path(path).name)) and upload.facts:
            clips = [clip.name for clip in upload.facts.clips]
            if wanted is not None and wanted not in clips:
                raise MotionMindError(f"{upload.name} has no clip {displayed(wanted)}{suggestion(wanted, clips)}")
            return studio.uploads.motion(upload.id, clips.index(wanted) if wanted else 0)
        try:
            return studio.movements.get(piece)
        except MotionMindError as error:
            raise MotionMindError(
                f"{displayed(piece)}: upload this movement first (Movement), or open the ensemble in a terminal: "
                f"motionmind studio FILE.toml ({error})"
            ) from error

    return read


def _read(name: str, data: bytes, pieces: Callable[[str], Motion]) -> Ensemble:
    """Read an uploaded ensemble file; `name` is its own."""
    with tempfile.TemporaryDirectory(prefix="motionmind-") as folder:
        path = Path(folder) / "ensemble.toml"
        path.write_bytes(data)
        try:
            return replace(read_ensemble(path, pieces), name=Path(name).stem)
        except MotionMindError as error:
            raise MotionMindError(str(error).replace(str(path), name)) from error
