"""Colours and text as SVG writes them."""

from __future__ import annotations

from collections.abc import Iterable
from xml.sax.saxutils import escape

from motionmind.display import printable


def hexadecimal(rgb: Iterable[float]) -> str:
    """Return a colour as "#rrggbb", its channels rounded; `rgb` is three numbers from 0 to 255."""
    return "#" + "".join(f"{round(float(value)):02x}" for value in rgb)


def xml_text(text: str) -> str:
    """Escape text for XML, and as it is displayed (`printable`); ends of lines stay."""
    return escape(printable(text))
