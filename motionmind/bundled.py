"""Locates the data bundled with MotionMind."""

from __future__ import annotations

from pathlib import Path

from motionmind.errors import CorpusError

FOLDERS = ("corpora", "discretization")


def bundled(folder: str) -> Path:
    """Return the path of a bundled folder, "corpora" or "discretization".

    A wheel holds both inside the package, under `_bundled`; a checkout, or an editable install, has them beside the
    package. Only this function knows that.

    Raises:
        CorpusError: the name is unknown, or the folder is in neither place.
    """
    if folder not in FOLDERS:
        raise CorpusError(f"no bundled folder {folder!r}; there are {' and '.join(FOLDERS)}")
    package = Path(__file__).resolve().parent
    places = (package / "_bundled" / folder, package.parent / folder)
    for place in places:
        if place.is_dir():
            return place
    raise CorpusError(f"the bundled {folder} are missing: neither {places[0]} nor {places[1]} is a folder")
