"""Colours and text as SVG writes them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from xml.sax.saxutils import escape


def hexadecimal(rgb: Iterable[float]) -> str:
    """Return a colour as "#rrggbb", its channels rounded; `rgb` is three numbers from 0 to 255."""
    return "#" + "".join(f"{round(float(value)):02x}" for value in rgb)


def xml_text(text: str) -> str:
    """Escape text for XML; control characters, which XML cannot hold, become spaces, but line breaks stay."""
    return escape(re.sub(r"[\x00-\x09\x0b-\x1f\x7f\ud800-\udfff\ufffe\uffff]", " ", text))
