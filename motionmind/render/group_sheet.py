"""Sheets of ensembles: all dancers before one camera, at counts or at regular times."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from motionmind._typing import Floats
from motionmind.ensemble.dancers import Ensemble
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.render.group import GroupStage
from motionmind.render.print_sheet import ROOM_PX, PrintPosture, pdf, print_pages, print_picture
from motionmind.render.sheet import MAX_SHEET_POSTURES, png
from motionmind.render.timing import SAME_TIME_S
from motionmind.tween.counts import seconds_to_count

_N_USUAL_PICTURES = 24
_HEIGHT_PX = 480  # of a picture


def write_group_sheet(
    path: FilePath, ensemble: Ensemble, *, every: int | None = None, postures: int | None = None
) -> int:
    """Draw an ensemble at counts, or at seconds without a tempo: as `.png`, or as `.pdf` on pages of A4.

    Args:
        path: the file.
        ensemble: the dancers.
        every: counts, or seconds, from one picture to the next; by default the least power of two for at most 24.
        postures: number of pictures, evenly spread over the whole; None for pictures at counts.

    Returns:
        The number of pictures.

    Raises:
        MotionMindError: there would be more than 400 pictures, or the file cannot be written.
    """
    times = np.linspace(0.0, ensemble.seconds, postures) if postures else _counts(ensemble, every)
    if len(times) > MAX_SHEET_POSTURES:
        raise MotionMindError(f"{path}: a sheet holds {MAX_SHEET_POSTURES} pictures, not {len(times)}; draw fewer")
    captions = [
        PrintPosture("" if ensemble.tempo is None else f"{seconds_to_count(time, ensemble.tempo):.4g}", "")
        for time in times.tolist()
    ]
    pictures = _pictures(ensemble, times)
    if Path(path).suffix.lower() == ".pdf":
        data = pdf(print_pages(pictures, captions, ensemble.name), ensemble.name)
    else:
        data = png(print_picture(pictures, captions, ensemble.name))
    write_atomically(path, data)
    return len(times)


def _counts(ensemble: Ensemble, every: int | None) -> Floats:
    """Return the times of counts [N], seconds."""
    count = 1.0 if ensemble.tempo is None else 60.0 / ensemble.tempo
    step = every or 1
    while every is None and ensemble.seconds / (step * count) > _N_USUAL_PICTURES - 1:
        step *= 2
    return np.arange(0.0, ensemble.seconds + SAME_TIME_S, step * count)


def _pictures(ensemble: Ensemble, times: Floats) -> Iterator[Image.Image]:
    """Yield a picture at each time, all of one size and not wider than a page."""
    stage = GroupStage(ensemble.motions(times), size=_HEIGHT_PX)
    for picture in map(Image.fromarray, stage.frames()):
        picture.thumbnail((ROOM_PX, _HEIGHT_PX))
        yield picture
