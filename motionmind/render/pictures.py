"""Movement as pictures, films and pages: which of them a file's suffix asks for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.render import PICTURES

ON_A_SHEET = 48  # postures on a sheet where nobody says which
_FILMED = (".gif", ".mp4", ".svg")


def write_picture(
    path: FilePath,
    motion: Motion,
    *,
    fps: float | None = None,
    view: str | None = None,
    size: int | None = None,
    first: int = 0,
) -> None:
    """Draw a motion on any skeleton, as the suffix says.

    `.png` is one posture, or a sheet of up to 48, evenly spread and numbered (`contact_sheet` has more to choose);
    `.gif`, `.mp4` and `.svg` are films; `.html` is a page that plays the motion in any browser, from disk, offline.
    What the engine inserted has another colour, the joints that are bridged are marked, and the postures between which
    it goes on show as ghosts.

    Args:
        path: where it goes.
        motion: the movement.
        fps: frames a second of a film; None takes the motion's own, at most 25 in a GIF and 60 in an MP4 (25 where it
            has fewer than 12), and 12 in an SVG.
        view: from where a film or a posture is seen: "quarter" (the default), "front", "side", "left" or "top".
        size: height of a film or a posture in pixels, 480 by default; it is less high where the movement is flat.
        first: the number of the motion's first frame, where it is a part of something longer.

    Raises:
        MotionMindError: the suffix is unknown, an option is not for what it asks for, or the file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in PICTURES:
        raise MotionMindError(f"{path}: suffix {suffix!r} is unknown; pictures end in {', '.join(PICTURES)}")
    _check(path, suffix, len(motion), fps=fps, view=view, size=size)
    seen: dict[str, Any] = {key: value for key, value in (("view", view), ("size", size)) if value is not None}
    if suffix == ".html":
        from motionmind.render.page import write_page

        write_page(path, motion, first)
    elif suffix == ".svg":
        from motionmind.render.svg import write_svg

        write_svg(path, motion, fps=fps, first=first, **seen)
    elif suffix == ".png" and len(motion) > 1:
        from motionmind.render.sheet import contact_sheet, evenly, png

        write_atomically(path, png(contact_sheet(motion, evenly(range(len(motion)), ON_A_SHEET), first=first)))
    elif suffix == ".png":
        from motionmind.render.film import write_still

        write_still(path, motion, **seen)
    else:
        from motionmind.render.film import write_film

        write_film(path, motion, fps=fps, first=first, **seen)


def _check(path: FilePath, suffix: str, frames: int, **options: object) -> None:
    """Options are for what can follow them: to draw without them, and say nothing, would surprise."""
    allowed = {"fps", "view", "size"} if suffix in _FILMED else set[str]()
    if suffix == ".png" and frames == 1:
        allowed = {"view", "size"}
    for name, value in options.items():
        if value is not None and name not in allowed:
            what = "a page" if suffix == ".html" else "one posture" if frames == 1 else "a sheet of postures"
            those = f"films ({', '.join(_FILMED)})" if name == "fps" else "films and single postures"
            raise MotionMindError(f"{path}: {name} is for {those}, not for {what}")
