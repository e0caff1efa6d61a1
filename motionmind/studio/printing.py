"""The piece on paper: postures at counts or at regular times, with its sections, markers and notes."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO
from typing import TYPE_CHECKING, Annotated, Any, Literal

import msgspec
import numpy as np
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.render.print_sheet import PrintPosture, pdf, print_pages, print_picture
from motionmind.render.sheet import MAX_SHEET_POSTURES, tiles
from motionmind.studio.export import composed, file_name, saved
from motionmind.studio.view import layout_of, noted

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio

_N_COUNTS = 8  # in a phrase: dancers count eights
_TIME_SLACK_S = 1e-3


class Spacing(msgspec.Struct, forbid_unknown_fields=True):
    """The time from posture to posture: some counts, or some seconds.

    Attributes:
        every: their number.
        unit: their unit.
        tempo: counts a minute.
    """

    every: Annotated[float, msgspec.Meta(ge=0.05, le=600.0)] = 1.0
    unit: Literal["counts", "seconds"] = "counts"
    tempo: Annotated[float, msgspec.Meta(ge=20.0, le=300.0)] = 120.0

    @property
    def seconds(self) -> float:
        """The time from posture to posture."""
        return self.every * (60.0 / self.tempo if self.unit == "counts" else 1.0)

    def caption(self, time: float) -> str:
        """Return the count at a time, as "2·1" for the first count of the second eight, or "" without counts."""
        if self.unit == "seconds":
            return ""
        count = int(time * self.tempo / 60.0 + 1e-6)
        return f"{count // _N_COUNTS + 1}·{count % _N_COUNTS + 1}"


def postures_at(spacing: Spacing, seconds: float, notes: Sequence[dict[str, Any]]) -> dict[float, PrintPosture]:
    """Choose the postures of a sheet, by time.

    A section begins with a posture of its own, if none is there. Other notes stand under the posture before them.

    Args:
        spacing: how far apart the postures are.
        seconds: duration of the piece.
        notes: its notes, as `view.noted` returns them.

    Raises:
        MotionMindError: there would be too many postures.
    """
    sections = [note for note in notes if note["kind"] == "section"]
    count = int((seconds + _TIME_SLACK_S) / spacing.seconds) + 1
    if count + len(sections) > MAX_SHEET_POSTURES:
        raise MotionMindError(
            f"a sheet holds {MAX_SHEET_POSTURES} postures, not {count + len(sections)}: put them farther apart"
        )
    times = [min(number * spacing.seconds, seconds) for number in range(count)]
    for section in sections:
        if min(abs(section["at"] - time) for time in times) > _TIME_SLACK_S:
            times.append(section["at"])
    times.sort()
    headings, texts = dict[int, str](), dict[int, list[str]]()
    for note in notes:
        place = max(bisect_right(times, note["at"] + _TIME_SLACK_S) - 1, 0)
        if note["kind"] == "section":
            headings[place] = note["text"]
        elif words := f"{note['author']}: {note['text']}" if note["author"] else note["text"] or "marker":
            texts.setdefault(place, []).append(words)
    return {
        time: PrintPosture(spacing.caption(time), f"{time:.2f} s", headings.get(place, ""), tuple(texts.get(place, ())))
        for place, time in enumerate(times)
    }


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the route for sheets."""

    def draw(motion: Motion, postures: dict[float, PrintPosture], title: str, form: str) -> bytes:
        shown = motion.at(motion.times[0] + np.array([*postures]))
        if form == "pdf":
            return pdf(print_pages(tiles(shown), [*postures.values()], title), title)
        data = BytesIO()
        print_picture(tiles(shown), [*postures.values()], title).save(data, "PNG", optimize=False)
        return data.getvalue()

    async def sheet(request: Request) -> Response:
        form = request.path_params["format"]
        if form not in ("pdf", "png"):
            raise MotionMindError(f"cannot print as {form!r:.20}: as pdf or png")
        try:
            spacing = msgspec.convert(dict(request.query_params), Spacing, strict=False)
        except msgspec.ValidationError as error:
            raise MotionMindError(f"invalid request: {error}") from None
        motion, project = composed(studio), studio.project
        notes = noted(
            project.state, layout_of(project.state, project.finding, project.marks, project.standing), project.marks
        )
        postures = postures_at(spacing, float(motion.times[-1] - motion.times[0]), notes)
        title = project.state.title or "piece"
        data = await run_in_threadpool(draw, replace(motion, name=title), postures, title, form)
        return saved(data, file_name(project.state.title, form))

    return [Route("/api/sheet/{format}", sheet)]
