"""A notebook cell that plays movement: the player's page, compressed, in a frame.

The frame is sandboxed: its scripts see nothing of the notebook, and the page's own policy forbids every request. The
cell holds the whole page, so a saved notebook plays anywhere; see docs/design/notebooks.md for its size.
"""

from __future__ import annotations

import gzip
import html
from functools import cache
from pathlib import Path
from string import Template

from motionmind.arguments import check_type
from motionmind.body.motion import Motion, Posture
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.render.markup import base64_of
from motionmind.render.page import page
from motionmind.tween.headline import beyond, feet_staying, headline
from motionmind.tween.result import Tween
from motionmind.variation.piece import Piece
from motionmind.variation.variation import Variation

Movement = Motion | Posture | Tween | Piece | Variation

MAX_ROTATIONS = 300_000  # joints times frames of a cell, 2.4 MB: seven minutes of 23 joints at 30 frames a second


def html_of(movement: Movement) -> str:
    """Return the HTML that plays movement in a cell.

    Text above it summarises a tween or a variation. Movement that is too long for a cell gets a message instead.
    """
    words: list[str] = []
    if isinstance(movement, Tween):
        words += [headline(movement), *feet_staying(movement.motion), *beyond(movement)]
    words += [repr(movement)] if isinstance(movement, Variation) else []
    motion = motion_of(movement)
    try:
        check_length(motion)
    except MotionMindError as error:
        return _lines(*words, str(error))
    name = displayed(motion.name or motion.skeleton.name)
    return _lines(*words) + (
        f'<iframe title="{html.escape(name)}" sandbox="allow-scripts allow-downloads" loading="lazy"'
        f' style="width:100%;height:480px;border:0" srcdoc="{html.escape(packed(page(motion), name))}"></iframe>'
    )


def motion_of(movement: Movement) -> Motion:
    """Return the motion of any kind of movement; WrongTypeError for other objects."""
    check_type("movement", movement, Motion, Posture, Tween, Piece, Variation)
    if isinstance(movement, Posture):
        return movement.as_motion()
    if isinstance(movement, Motion):
        return movement
    return movement.motion() if isinstance(movement, Variation) else movement.motion


def check_length(motion: Motion) -> None:
    """Raise MotionMindError, with ways to shorten it, if a motion is too long for a notebook."""
    if len(motion) * len(motion.skeleton) > MAX_ROTATIONS:
        raise MotionMindError(
            f"{motion!r} is too long to play in a notebook: motion.slice(start, stop) and motion.resample(rate) make "
            "it shorter, draw_picture('clip.html', motion) writes a page of it all"
        )


def packed(content: str, title: str) -> str:
    """Return a small page that unpacks another page and replaces itself with it."""
    data = base64_of(gzip.compress(content.encode(), compresslevel=9, mtime=0))
    return _shell().substitute(title=html.escape(title), packed=data)


@cache
def _shell() -> Template:
    return Template((Path(__file__).parent / "cell.html").read_text(encoding="utf-8"))


def _lines(*texts: str) -> str:
    return "".join(f"<p>{html.escape(text)}</p>" for text in texts)
