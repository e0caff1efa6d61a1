"""The piece, or a stretch of it, as a score: transcribed by a worker, and composed anew from an edited text."""

from __future__ import annotations

import shutil
import tempfile
from collections import OrderedDict
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import numpy as np
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.body.motion import Motion
from motionmind.credits.credit import Credit
from motionmind.errors import CorpusError, MotionMindError
from motionmind.studio.api import body_of, json
from motionmind.studio.edits import Id
from motionmind.studio.export import composed
from motionmind.studio.reading import Order, lines_of, load_clip, load_lines
from motionmind.studio.room import Room

if TYPE_CHECKING:
    from motionmind.notation.score import Score
    from motionmind.studio.studio import Studio

_MAX_SCORES = 100  # whose credits are known
_FILE = "upload.score"
_REFUSED = {"key": "", "frames": 0}


class Scoring(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to write the piece as a score.

    Attributes:
        block: the stretch to write; None for the whole piece.
        tolerance: degrees by which a bone's direction may deviate.
    """

    block: Id | None = None
    tolerance: Annotated[float, msgspec.Meta(ge=1.0, le=90.0)] = 10.0


class Composing(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to compose an edited score.

    Attributes:
        job: id of the job that wrote the score.
        text: the score.
    """

    job: str
    text: Annotated[str, msgspec.Meta(max_length=4_000_000)]


def write_score(
    _: Any, motion: Motion, tolerance: float, tempo: float, corpus: str, home: Path | None
) -> dict[str, Any]:
    """Transcribe movement in a worker, with the positions of the corpus if that is written in scores.

    Returns:
        The text, and the lines and the time of each posture, seconds.
    """
    from motionmind.notation.compose import played
    from motionmind.notation.read import read_score
    from motionmind.transcription import transcribe

    text = transcribe(motion, tolerance, tempo=tempo, vocabulary=_vocabulary(corpus, home)).text
    with tempfile.TemporaryDirectory(prefix="motionmind-") as folder:
        path = Path(folder) / _FILE
        path.write_text(text, encoding="utf-8")
        ((rows, movement),) = played(read_score(path))
    return {"text": text, "times": movement.times.tolist(), **lines_of(rows)}


def _vocabulary(corpus: str, home: Path | None) -> list[Score]:
    """Return a corpus's scores of the body of transcriptions; none if the corpus is missing, or holds recordings."""
    from motionmind.body.anatomy_file import anatomy_named
    from motionmind.names.finding import open_collection
    from motionmind.names.spelling import parse_source

    try:
        scores = open_collection(parse_source(corpus, home), home).scores
    except CorpusError:
        return []
    return [score for score in scores if score.body is anatomy_named("human23")]


def _shown(result: dict[str, Any]) -> dict[str, Any]:
    """Return what the page sees of a score."""
    return result


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes for scores of the piece."""
    room, numbers = Room(), count(1)
    credited: OrderedDict[str, tuple[Credit, ...]] = OrderedDict()  # of the movement behind each score

    async def write(request: Request) -> Response:
        given = await body_of(request, Scoring)
        motion, state = _part(studio, given.block), studio.project.state
        wishes = given.tolerance, state.tempo, state.corpus, studio.home
        job = studio.workers.submit("score", write_score, motion, *wishes, finish=_shown, urgent=True)
        credited[job.id] = motion.credits
        while len(credited) > _MAX_SCORES:
            credited.popitem(last=False)
        return json({"job": job.id})

    async def compose(request: Request) -> Response:
        given = await body_of(request, Composing)
        if given.job not in credited:
            raise MotionMindError("the studio no longer knows this score: write the piece as a score again")
        folder = room.folder / str(next(numbers))
        folder.mkdir()
        try:
            (folder / _FILE).write_text(given.text, encoding="utf-8")
            answer = await studio.uploads.read_apart(folder, Order(_FILE, "score"))
            if answer.facts is None:
                return json(_REFUSED | {"error": answer.error})
            if (clips := len(answer.facts.clips)) != 1:
                words = f"the score has {clips} clips; a piece is one: make the others phrases"
                return json(_REFUSED | {"error": words})
            motion, lines = load_clip(folder, answer.facts, 0), load_lines(folder, 0)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        key = studio.movements.keep(replace(motion, recorded=credited[given.job]), motion.name)
        return json({"key": key, "frames": len(motion), "times": motion.times.tolist(), **lines})

    return [
        Route("/api/score", write, methods=["POST"]),
        Route("/api/score/compose", compose, methods=["POST"]),
    ]


def _part(studio: Studio, block: str | None) -> Motion:
    """Return the piece, or a stretch of it, as one movement.

    Raises:
        MotionMindError: the piece is empty, there is no such stretch, or a movement is missing.
    """
    motion = composed(studio)
    if block is None:
        return motion
    source = studio.movements.get(studio.project.state.block(block).source)
    (own,) = (one for one in studio.view("-")["piece"]["blocks"] if one["id"] == block)
    inside = np.flatnonzero((motion.times > own["at"] - 1e-6) & (motion.times < own["at"] + own["seconds"] + 1e-6))
    part = motion.slice(int(inside[0]), int(inside[-1]) + 1)
    return replace(part, recorded=source.own_credits)
