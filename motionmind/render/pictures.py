"""Motions as pictures, films and pages, chosen by the file's suffix."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from motionmind.arguments import check_integer, check_path, check_real, check_text, check_type
from motionmind.body.motion import Motion
from motionmind.body.stage import check_stage
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.music.sound import Sound
from motionmind.render import PICTURES, SOUNDING

N_SHEET_POSTURES = 48  # postures on a sheet, at most
_FILMED = (".gif", ".mp4", ".svg")


def draw_picture(
    path: FilePath,
    motion: Motion,
    *,
    fps: float | None = None,
    view: str | None = None,
    size: int | None = None,
    first: int = 0,
    sound: Sound | None = None,
    stage: tuple[float, float] | None = None,
) -> None:
    """Write a motion as a picture, a film or a page, as the file's suffix says.

    `.png` is one posture, or a sheet of up to 48, evenly spread and numbered (`draw_sheet` has more options);
    `.gif`, `.mp4` and `.svg` are films; `.html` is a page that plays the motion in any browser, from disk, offline.
    Inserted movement has another colour, bridged joints are marked, and the insertion's end postures show as ghosts.

    Args:
        path: the file.
        motion: the motion, on any skeleton.
        fps: frames a second of a film, from 0.01 to 50 (GIF), 120 (MP4) or 60 (SVG); by default 12 in an SVG, elsewhere
            the motion's own (25 if fewer than 12), at most 25 in a GIF and 60 in an MP4. Of long movement they are
            fewer, and a GIF or an SVG has 1,000 in all; four times as many may be asked for.
        view: viewpoint of a film or of one posture: "quarter" (the default), "front", "side", "left" or "top".
        size: height of a film or of one posture, pixels, from 120 to 2160, by default 480; a flat movement makes the
            picture lower.
        first: number of the motion's first frame in the longer motion that it is a part of.
        sound: sound of an MP4 or a page, which begins with the first frame and lasts as long as the motion.
        stage: width and depth of the stage around the origin, metres, whose edge the floor plan of a page shows.

    Raises:
        MotionMindError: the suffix is unknown, an option does not apply to it or is out of range, a film would have too
            many frames, the extra for MP4 is not installed, or the file cannot be written.

    >>> import numpy as np
    >>> from motionmind import Posture, draw_picture, human23
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (23, 1))
    >>> posture = Posture(human23(), at_rest, np.zeros(3))
    >>> draw_picture("rest.png", posture.as_motion(), view="front")
    """
    check_path("path", path)
    check_type("motion", motion, Motion)
    check_real("fps", fps, or_none=True)
    check_text("view", view, or_none=True)
    check_integer("size", size, or_none=True)
    check_integer("first", first)
    check_type("sound", sound, Sound, or_none=True)
    stage = None if stage is None else check_stage(stage)
    suffix = Path(path).suffix.lower()
    if suffix not in PICTURES:
        raise MotionMindError(f"{path}: suffix {suffix!r} is unknown; pictures end in {', '.join(PICTURES)}")
    _check(path, suffix, len(motion), fps=fps, view=view, size=size, sound=sound, stage=stage)
    options: dict[str, Any] = {key: value for key, value in (("view", view), ("size", size)) if value is not None}
    if suffix == ".html":
        from motionmind.render.page import write_page

        write_page(path, motion, first, sound, stage)
    elif suffix == ".svg":
        from motionmind.render.svg import write_svg

        write_svg(path, motion, fps=fps, first=first, **options)
    elif suffix == ".png" and len(motion) > 1:
        from motionmind.render.sheet import draw_sheet, evenly, png

        write_atomically(path, png(draw_sheet(motion, evenly(range(len(motion)), N_SHEET_POSTURES), first=first)))
    elif suffix == ".png":
        from motionmind.render.film import write_still

        write_still(path, motion, **options)
    else:
        from motionmind.render.film import write_film

        write_film(path, motion, fps=fps, first=first, sound=sound, **options)


def _check(path: FilePath, suffix: str, frames: int, **options: object) -> None:
    """Refuse options that do not apply to a suffix, instead of silently ignoring them."""
    allowed = {"fps", "view", "size"} if suffix in _FILMED else set[str]()
    allowed |= {"sound"} if suffix in SOUNDING else set()
    allowed |= {"stage"} if suffix == ".html" else set()
    if suffix == ".png" and frames == 1:
        allowed = {"view", "size"}
    for name, value in options.items():
        if value is not None and name not in allowed:
            what = "a page" if suffix == ".html" else "one posture" if frames == 1 else "a sheet of postures"
            if name == "stage":
                raise MotionMindError(f"{path}: stage is for the floor plan of a page (.html)")
            if name == "sound":
                raise MotionMindError(f"{path}: sound is for {' and '.join(SOUNDING)}")
            those = f"films ({', '.join(_FILMED)})" if name == "fps" else "films and single postures"
            raise MotionMindError(f"{path}: {name} is for {those}, not for {what}")
