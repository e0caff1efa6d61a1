"""The font of pictures and the font family of SVG."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL import ImageFont

FONT_FAMILY = 'font-family="system-ui,Helvetica,Arial,sans-serif"'  # an attribute of SVG elements


@cache
def font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Load Pillow's own font at a size in pixels of the picture it is drawn on."""
    from PIL import ImageFont

    return ImageFont.load_default(size)
