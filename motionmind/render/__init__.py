"""Bodies drawn: solids, depth buffer and colours; pictures, films, and a page that plays a motion."""

from pathlib import Path

PICTURES = (".png", ".gif", ".mp4", ".svg", ".html")  # suffixes that `pictures.draw_picture` writes
SOUNDING = (".mp4", ".html")  # pictures that may have sound


def may_sound(path: Path) -> bool:
    """Return whether a picture may have sound."""
    return path.suffix.lower() in SOUNDING
