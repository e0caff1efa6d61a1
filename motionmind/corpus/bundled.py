"""Where the data that comes with MotionMind lives."""

from __future__ import annotations

from pathlib import Path

from motionmind.errors import CorpusError

FOLDERS = ("corpora", "discretization")


def bundled(folder: str) -> Path:
    """The bundled folder called `folder`, "corpora" or "discretization".

    A wheel carries both inside the package, under `_bundled`; a checkout, and an editable install of one, has them
    beside the package. Nothing else in MotionMind knows this. CorpusError where neither place has the folder.
    """
    if folder not in FOLDERS:
        raise CorpusError(f"no bundled folder {folder!r}; there are {' and '.join(FOLDERS)}")
    package = Path(__file__).resolve().parents[1]
    places = (package / "_bundled" / folder, package.parent / folder)
    for place in places:
        if place.is_dir():
            return place
    raise CorpusError(f"the bundled {folder} are missing: neither {places[0]} nor {places[1]} is a folder")
