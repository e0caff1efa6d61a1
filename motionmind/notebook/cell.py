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

from motionmind.body.motion import Motion, Posture
from motionmind.display import displayed
from motionmind.render.page import base64_of, page
from motionmind.tween.headline import beyond, headline
from motionmind.tween.result import Tween
from motionmind.variation.piece import Piece
from motionmind.variation.variation import Variation

MOST_PLACES = 300_000  # joints times frames that a cell holds, 2.4 MB: seven minutes of 23 joints at 30 frames a second
_HEIGHT = 480  # of the frame, pixels


def html_of(thing: Motion | Posture | Tween | Piece | Variation) -> str:
    """Return the HTML that plays a thing in a cell.

    Of a tween, what matters stands above it in words; of a variation, how it is made up. Movement that is too long for
    a cell is said to be.
    """
    if isinstance(thing, Posture):
        return frame_of(thing.as_motion())
    if isinstance(thing, Tween):
        return _lines(headline(thing), *beyond(thing)) + frame_of(thing.motion)
    if isinstance(thing, Piece):
        return frame_of(thing.motion)
    if isinstance(thing, Variation):
        return _lines(repr(thing)) + frame_of(thing.motion())
    return frame_of(thing)


def frame_of(motion: Motion) -> str:
    """Return a frame that plays a motion, or a line that says that it is too long for one."""
    if len(motion) * len(motion.skeleton) > MOST_PLACES:
        return _lines(
            f"{motion!r} is too long to play in a cell: motion.slice(start, stop) and motion.resample(rate) make it "
            "shorter, write_picture('clip.html', motion) writes a page of it all"
        )
    name = displayed(motion.name or motion.skeleton.name)
    return (
        f'<iframe title="{html.escape(name)}" sandbox="allow-scripts allow-downloads" loading="lazy"'
        f' style="width:100%;height:{_HEIGHT}px;border:0" srcdoc="{html.escape(packed(page(motion), name))}"></iframe>'
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
