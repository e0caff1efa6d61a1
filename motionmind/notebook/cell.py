"""A cell of a notebook that plays movement: the player's page in a frame of its own, packed.

The frame is sandboxed: its scripts see nothing of the notebook, and the page's own policy forbids every request. The
whole page lies in the cell, so that a saved notebook plays anywhere; see docs/design/notebooks.md for its size.
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
from motionmind.render.page import base64_of, page
from motionmind.tween.headline import beyond, headline
from motionmind.tween.result import Tween
from motionmind.variation.piece import Piece
from motionmind.variation.variation import Variation

Movement = Motion | Posture | Tween | Piece | Variation

MOST_PLACES = 300_000  # joints times frames that a cell holds, 2.4 MB: seven minutes of 23 joints at 30 frames a second
_HEIGHT = 480  # of the frame, pixels


def html_of(thing: Movement) -> str:
    """Return the HTML that plays a thing in a cell.

    Of a tween, what matters stands above it in words; of a variation, how it is made up. Movement that is too long for
    a cell is said to be.
    """
    words = [headline(thing), *beyond(thing)] if isinstance(thing, Tween) else []
    words += [repr(thing)] if isinstance(thing, Variation) else []
    motion = motion_of(thing)
    try:
        check_length(motion)
    except MotionMindError as error:
        return _lines(*words, str(error))
    name = displayed(motion.name or motion.skeleton.name)
    return _lines(*words) + (
        f'<iframe title="{html.escape(name)}" sandbox="allow-scripts allow-downloads" loading="lazy"'
        f' style="width:100%;height:{_HEIGHT}px;border:0" srcdoc="{html.escape(packed(page(motion), name))}"></iframe>'
    )


def motion_of(thing: Movement) -> Motion:
    """Return the motion of anything that moves; WrongTypeError if it does not."""
    check_type("movement", thing, Motion, Posture, Tween, Piece, Variation)
    if isinstance(thing, Posture):
        return thing.as_motion()
    if isinstance(thing, Motion):
        return thing
    return thing.motion() if isinstance(thing, Variation) else thing.motion


def check_length(motion: Motion) -> None:
    """Raise MotionMindError if a motion is too long for a notebook; it says what makes it shorter."""
    if len(motion) * len(motion.skeleton) > MOST_PLACES:
        raise MotionMindError(
            f"{motion!r} is too long to play in a notebook: motion.slice(start, stop) and motion.resample(rate) make "
            "it shorter, draw_picture('clip.html', motion) writes a page of it all"
        )


def packed(content: str, title: str) -> str:
    """Return a small page that unpacks another and becomes it."""
    data = base64_of(gzip.compress(content.encode(), compresslevel=9, mtime=0))
    return _shell().substitute(title=html.escape(title), packed=data)


@cache
def _shell() -> Template:
    return Template((Path(__file__).parent / "cell.html").read_text(encoding="utf-8"))


def _lines(*texts: str) -> str:
    return "".join(f"<p>{html.escape(text)}</p>" for text in texts)
