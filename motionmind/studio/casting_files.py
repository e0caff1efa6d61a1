"""Export the project's dancers: a page, a GLB file, and archives of BVH files or of the ensemble's own."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import replace

from motionmind.body.motion import Motion
from motionmind.ensemble.changes import whereabouts
from motionmind.ensemble.dancers import Ensemble
from motionmind.ensemble.reading import check_spots
from motionmind.ensemble.writing import format_ensemble
from motionmind.formats import write_motion
from motionmind.formats.glb import write_group_glb
from motionmind.music.sound import Sound
from motionmind.render.group_page import write_group_page
from motionmind.studio.export import bvh, written

_OLDEST = (1980, 1, 1, 0, 0, 0)  # the date of all files in an archive: the same ensemble gives the same bytes


def page(ensemble: Ensemble, sound: Sound | None) -> bytes:
    """Return the page that plays an ensemble, with its sound."""
    return written(".html", lambda path: write_group_page(path, ensemble, sound))


def _glb(ensemble: Ensemble, _: str) -> bytes:
    return written(".glb", lambda path: write_group_glb(path, ensemble.motions()))


def _bvh(ensemble: Ensemble, title: str) -> bytes:
    """Return an archive with a BVH file for each dancer."""
    return _archive({f"{title}-{number}.bvh": bvh(one) for number, one in enumerate(ensemble.motions(), start=1)})


def _toml(ensemble: Ensemble, title: str) -> bytes:
    """Return an archive with the ensemble's file and the motion file of each piece.

    Raises:
        FormatError: two dancers end a change of formation on one spot, which the file could not say.
    """
    names = [one.name for one in ensemble.dancers]
    for number, way in enumerate(ensemble.dancers[0].ways, start=1):
        check_spots(f"change {number} of formation", "end", names, whereabouts(ensemble.dancers, way.end))
    pieces = {id(one.piece): one.piece for one in ensemble.dancers}
    paths = {piece: f"{title}-{number}.json" for number, piece in enumerate(pieces, start=1)}
    named = tuple(replace(one, source=paths[id(one.piece)]) for one in ensemble.dancers)
    toml = format_ensemble(replace(ensemble, dancers=named), str).encode()
    return _archive({f"{title}.toml": toml} | {paths[name]: _json(piece) for name, piece in pieces.items()})


def _json(piece: Motion) -> bytes:
    return written(".json", lambda path: write_motion(path, piece))


MAKERS: Mapping[str, Callable[[Ensemble, str], bytes]] = {"glb": _glb, "bvh": _bvh, "toml": _toml}
SINGLE_FILES = ("html", "glb")  # the others are archives


def name_in(title: str, form: str) -> str:
    """Return the name under which an export is saved; `title` is valid on every system.

    >>> from motionmind.studio.casting_files import name_in
    >>> name_in("trio", "glb"), name_in("trio", "toml")
    ('trio.glb', 'trio.toml.zip')
    """
    return f"{title}.{form}" if form in SINGLE_FILES else f"{title}.{form}.zip"


def _archive(files: Mapping[str, bytes]) -> bytes:
    """Return a ZIP archive of files."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name, _OLDEST), data, zipfile.ZIP_DEFLATED)
    return out.getvalue()
