"""The piece on paper: postures at counts or at regular times, with its sections, markers and notes."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO
from math import ceil, floor
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
from motionmind.studio.settings import SetMusic
from motionmind.studio.view import layout_of, noted

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio

_TIME_SLACK_S = 1e-3
_SILENCE = SetMusic()


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
        """The time from posture to posture, without music."""
        return self.every * (60.0 / self.tempo if self.unit == "counts" else 1.0)

    def time(self, number: float, music: SetMusic) -> float:
        """Return the time of a posture, by its number from 0 at count 1 or 0 s: counts follow the beats of music."""
        if (beats := music.counting) is None or self.unit == "seconds":
            return number * self.seconds
        return beats.start + beats.seconds(1.0 + number * self.every) - music.begins

    def number(self, time: float, music: SetMusic) -> float:
        """Return the number at a time, the inverse of `time`."""
        if (beats := music.counting) is None or self.unit == "seconds":
            return time / self.seconds
        return (beats.count(time + music.begins - beats.start) - 1.0) / self.every

    def caption(self, time: float, music: SetMusic, counts: int) -> str:
        """Return the count at a time, as "2·1" for the first count of the second phrase, or "" without counts.

        Args:
            time: the time, seconds.
            music: the music.
            counts: how many counts a phrase has.
        """
        if self.unit == "seconds":
            return ""
        count = floor(self.number(time, music) * self.every + 1e-6)
        return f"{count // counts + 1}·{count % counts + 1}"


def postures_at(
    spacing: Spacing, seconds: float, notes: Sequence[dict[str, Any]], music: SetMusic = _SILENCE, counts: int = 8
) -> dict[float, PrintPosture]:
    """Choose the postures of a sheet, by time.

    The piece and each section begin with a posture. Other notes stand under the posture before them.

    Args:
        spacing: how far apart the postures are.
        seconds: duration of the piece.
        notes: its notes, as `view.noted` returns them.
        music: the music that it plays with.
        counts: how many counts a phrase has: dancers count eights.

    Raises:
        MotionMindError: there would be too many postures.
    """
    sections = [note for note in notes if note["kind"] == "section"]
    first = ceil(spacing.number(-_TIME_SLACK_S, music))
    count = floor(spacing.number(seconds + _TIME_SLACK_S, music)) + 1 - first
    if count + len(sections) > MAX_SHEET_POSTURES:
        raise MotionMindError(
            f"a sheet holds {MAX_SHEET_POSTURES} postures, not {count + len(sections)}: put them farther apart"
        )
    times = [min(max(spacing.time(first + number, music), 0.0), seconds) for number in range(count)]
    for begin in (0.0, *(section["at"] for section in sections)):
        if min((abs(begin - time) for time in times), default=np.inf) > _TIME_SLACK_S:
            times.append(begin)
    times.sort()
    headings, texts = dict[int, str](), dict[int, list[str]]()
    for note in notes:
        place = max(bisect_right(times, note["at"] + _TIME_SLACK_S) - 1, 0)
        if note["kind"] == "section":
            headings[place] = note["text"]
        elif words := f"{note['author']}: {note['text']}" if note["author"] else note["text"] or "marker":
            texts.setdefault(place, []).append(words)
    return {
        time: PrintPosture(
            spacing.caption(time, music, counts), f"{time:.2f} s", headings.get(place, ""), tuple(texts.get(place, ()))
        )
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
        seconds = float(motion.times[-1] - motion.times[0])
        postures = postures_at(spacing, seconds, notes, project.state.music, project.state.counts)
        title = project.state.title or "piece"
        data = await run_in_threadpool(draw, replace(motion, name=title), postures, title, form)
        return saved(data, file_name(project.state.title, form))

    return [Route("/api/sheet/{format}", sheet)]
