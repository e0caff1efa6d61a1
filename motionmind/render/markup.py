"""Colours, text and bytes as SVG and HTML write them."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable
from xml.sax.saxutils import escape

from motionmind.display import printable


def hexadecimal(rgb: Iterable[float]) -> str:
    """Return a colour as "#rrggbb", its channels rounded; `rgb` is three numbers from 0 to 255."""
    return "#" + "".join(f"{round(float(value)):02x}" for value in rgb)


def xml_text(text: str) -> str:
    """Escape text for XML, and make it `printable`; line breaks stay."""
    return escape(printable(text))


def base64_of(data: bytes) -> str:
    """Encode bytes as base64 text."""
    return b64encode(data).decode("ascii")
