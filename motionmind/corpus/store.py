"""Corpora on disk: folders of arrays with a manifest, and where to find them."""

from __future__ import annotations

import hashlib
import io
import math
import mmap
import os
import re
import shlex
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec
import platformdirs

from motionmind.arguments import check_path
from motionmind.bundled import bundled
from motionmind.corpus import versions
from motionmind.errors import CorpusError, FormatError, suggestion
from motionmind.files import make_folder, replace_file, sync_folder

if TYPE_CHECKING:
    from numpy.typing import NDArray

FORMAT, BUILT = "motionmind-corpus", "motionmind-built-corpus"
VERSIONS = {FORMAT: (1,), BUILT: (1, 2, 3, 4, 5, 6, 7, 8, 9, 10)}  # that can be read; the last is written
_CLIPS = 9  # the first that keeps what each clip shows of its pace, and the code that learned
_FEET = 8  # the first that keeps how fast feet are near the floor
_COMPLETE = 6  # the first that keeps all that is learned, and the last whose manifest lists clips and faults
MANIFEST = "manifest.json"
CHECKED_BY = Path(__file__).parents[1] / "learned" / "validity.py"  # when that changes, arrays are checked again
_COARSEST_CLOCK = 2.0  # seconds to which file systems round the time of a change
_LOOKS, _BETWEEN = 20, 0.005  # for a version that is missing, and seconds between them
_ARRAY_NAME = re.compile(r"\w+(\.\w+)*")  # of a file in the folder: no name from a manifest leads out of it


def home(folder: str | os.PathLike[str] | None = None) -> Path:
    """Return the folder of a user's data: `folder`, else $MOTIONMIND_HOME, else the platform's data directory."""
    check_path("folder", folder, or_none=True)
    chosen = folder or os.environ.get("MOTIONMIND_HOME")
    return Path(chosen) if chosen else Path(platformdirs.user_data_dir("motionmind", appauthor=False))


def list_corpora(folder: str | os.PathLike[str] | None = None) -> dict[str, Path]:
    """Return the folders of all corpora by name, sorted: the bundled ones, and those under `home(folder)`.

    >>> from motionmind import list_corpora
    >>> "ballet" in list_corpora()
    True
    """
    found = {}
    for place in (bundled("corpora"), home(folder) / "corpora"):
        if place.is_dir():
            entries = [entry for entry in sorted(place.iterdir()) if not entry.name.startswith(".")]
            found.update({entry.name: entry for entry in entries if (entry / MANIFEST).is_file()})
    return dict(sorted(found.items()))


def locate(name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Return the folder of the corpus with this name, or at this path; CorpusError names the known ones."""
    check_path("name", name)
    corpora, name = list_corpora(folder), os.fspath(name)
    if name in corpora:
        return corpora[name]
    with suppress(OSError, ValueError):  # not a possible path: too long, or with a zero byte
        if name and (Path(name) / MANIFEST).is_file():
            return Path(name)
    raise CorpusError(f"no corpus {name!r}{suggestion(name, corpora)}")


def place_for(name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Return the folder for a new corpus of a user; CorpusError if the name is invalid or a bundled corpus's."""
    if not re.fullmatch(r"\w[\w.-]{0,63}", name):
        raise CorpusError(f"{name!r:.80} cannot be a corpus's name: use letters, digits, -, _ and . (64 at most)")
    if _is_bundled(name):
        raise CorpusError(f"{name!r} is the name of a bundled corpus; choose another")
    return home(folder) / "corpora" / name


def own_place(name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Return the folder of a corpus of the user's own; CorpusError if it is none."""
    corpora = list_corpora(folder)
    if name in corpora and _is_bundled(name):
        raise CorpusError(f"{name!r} is a bundled corpus, which can be neither changed nor deleted")
    place = place_for(name, folder)
    if corpora.get(name) != place:
        own = [known for known, where in corpora.items() if where.parent == place.parent]
        raise CorpusError(f"no corpus {name!r} of your own{suggestion(name, own)}")
    return place


def _is_bundled(name: str) -> bool:
    """Return whether a corpus of this name comes with MotionMind."""
    return (bundled("corpora") / name / MANIFEST).is_file()


def unfinished(name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Return the folder of the work on a corpus that is not built yet."""
    return home(folder).absolute() / "shards" / name


def removable(name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Return the folder that `delete` deletes: of a user's corpus, or of the work on one that was never built."""
    left = unfinished(name, folder)
    return left if left.exists() and not place_for(name, folder).exists() else own_place(name, folder)


def delete(name: str, folder: str | os.PathLike[str] | None = None) -> None:
    """Delete a user's corpus at once; who has loaded it keeps what it read. Work that was left of building it goes too.

    Args:
        name: of the corpus, or of one that was never built to the end.
        folder: the user's home (`home`).

    Raises:
        CorpusError: there is no such corpus of the user's own, it holds files that are no part of a built corpus, or it
            cannot be deleted.
    """
    left = unfinished(name, folder)
    if removable(name, folder) != left:
        place = _own(name, folder)
        try:
            versions.remove(place)
        except OSError as error:
            raise CorpusError(f"{place}: cannot be deleted: {error.strerror or error}") from error
    versions.remove_unused(left)
    with suppress(OSError):
        left.parent.rmdir()


def rename(name: str, new: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Rename a user's corpus, and return its new folder.

    First its manifest gets the new name, then its folder; each of them at once. After a kill in between, the corpus is
    whole under its old name, and can be renamed again.

    Args:
        name: of the corpus.
        new: its new name, which no corpus has.
        folder: the user's home (`home`).

    Raises:
        CorpusError: there is no such corpus of the user's own, it holds files that are no part of a built corpus, the
            new name is invalid or taken, or it cannot be renamed.
    """
    place, target = _own(name, folder), place_for(new, folder)
    if target.exists():
        raise CorpusError(f"there is a corpus {new!r} already; corpus delete {new} removes it")
    manifest = read_manifest(place)
    try:
        with versions.hold(_place_of(place, manifest)):  # so that no build in the meantime removes what it names
            data = msgspec.json.encode(read_manifest(place) | {"name": new})
            replace_file(place / MANIFEST, msgspec.json.format(data, indent=1) + b"\n")
            place.rename(target)
        sync_folder(target.parent)
    except OSError as error:
        raise CorpusError(f"{place}: cannot be renamed: {error.strerror or error}") from error
    return target


def _own(name: str, folder: str | os.PathLike[str] | None) -> Path:
    """Return the folder of a corpus of the user's own that holds nothing but what was built; CorpusError if none is."""
    place = own_place(name, folder)
    if stranger := versions.find_stranger(place, MANIFEST):
        raise CorpusError(f"{place}: holds {stranger.relative_to(place)}, which is no part of a built corpus")
    return place


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of a corpus's folder; FormatError if it is invalid or of an unknown version."""
    return _parse(folder / MANIFEST, _read(folder / MANIFEST))


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise FormatError(f"cannot be read as a corpus's manifest: {error}", path=path) from error


def _parse(path: Path, data: bytes) -> dict[str, Any]:
    try:
        manifest = msgspec.json.decode(data, type=dict[str, Any])
    except (ValueError, RecursionError) as error:  # msgspec's errors are ValueErrors
        is_built = versions.find_stranger(path.parent, MANIFEST) is None
        advice = f"; {remedy(path.parent)}" if is_built else ""
        raise FormatError(f"cannot be read as a corpus's manifest: {error}{advice}", path=path) from error
    form, version = manifest.get("format"), manifest.get("version")
    known = VERSIONS.get(form, ()) if isinstance(form, str) else ()
    if version not in known:
        readable = f"version {known[-1]}" if known else f"{FORMAT!r} and {BUILT!r}"
        raise FormatError(f"is {form!r} version {version!r}; {readable} can be read", path=path)
    return manifest


def save(folder: Path, manifest: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a corpus's folder: its manifest, and one .npy file per array.

    An existing corpus is replaced at once when the new one is complete and on disk (`motionmind.corpus.versions`).

    Args:
        folder: the corpus's folder.
        manifest: plain values for JSON; format, version, folder and the arrays' shapes are added.
        arrays: by name.

    Raises:
        CorpusError: the folder cannot be written, or holds files that are not a corpus's.
    """
    try:
        versions.recover(folder)
        if stranger := versions.find_stranger(folder, MANIFEST):
            name = stranger.relative_to(folder)
            raise CorpusError(f"{folder}: holds {name}, which is no part of a built corpus; it is not replaced")
        make_folder(folder)
        try:
            _write(folder, manifest, arrays)
        finally:
            with suppress(FormatError):  # the manifest is damaged, and stays so until a save succeeds
                versions.remove_others(folder, lambda: _current(folder))
        versions.remove_leftovers(folder)
    except OSError as error:
        raise CorpusError(f"{folder}: cannot be written: {error.strerror or error}") from error


def _write(folder: Path, manifest: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a new version and make it the current one; all that it consists of is on disk before that."""
    import numpy as np  # here, for shells complete names of corpora without it

    with versions.new_version(folder) as version:
        for name, array in arrays.items():
            with (version / f"{name}.npy").open("xb") as file:
                whole = np.ascontiguousarray(array)
                if whole.dtype.hasobject:
                    raise ValueError(f"{name}: Object arrays cannot be saved")
                np.lib.format.write_array_header_1_0(file, np.lib.format.header_data_from_array_1_0(whole))
                file.write(whole.data)  # as np.save does, but for an error that says why
                file.flush()
                os.fsync(file.fileno())
        sync_folder(version)
        sync_folder(folder)
        shapes = {name: [array.dtype.str, *array.shape] for name, array in arrays.items()}
        head = {"format": BUILT, "version": VERSIONS[BUILT][-1], "folder": int(version.name), **manifest}
        data = msgspec.json.encode(head | {"arrays": shapes})
        replace_file(folder / MANIFEST, msgspec.json.format(data, indent=1) + b"\n")


def _current(folder: Path) -> Path | None:
    """Return the folder of the arrays of a built corpus; None if it has no manifest yet."""
    return _place_of(folder, read_manifest(folder)) if (folder / MANIFEST).exists() else None


def _place_of(folder: Path, manifest: Mapping[str, Any]) -> Path:
    """Return the folder of a built corpus's arrays; those of 0.1 lie beside the manifest."""
    if manifest["version"] == 1:
        return folder
    if not isinstance(number := manifest.get("folder"), int):
        raise FormatError(f"there is no key `folder` with a number; {remedy(folder)}", path=folder / MANIFEST)
    return folder / str(number)


class Stored(NamedTuple):
    """The content of a corpus's folder.

    Attributes:
        manifest: its manifest.
        arrays: a built corpus's arrays by name, memory-mapped.
        place: the folder of the arrays.
        identity: changes when any of the files does; "" while they are so new that it might not.
    """

    manifest: dict[str, Any]
    arrays: dict[str, NDArray[Any]]
    place: Path
    identity: str

    @property
    def version(self) -> int:
        """The version of its format."""
        return int(self.manifest["version"])

    @property
    def files(self) -> list[Path]:
        """The files of the arrays."""
        return [_array_file(self.place, name) for name in self.arrays]

    @property
    def is_current(self) -> bool:
        """Whether it is a built corpus that keeps all that this version learns."""
        return self.manifest["format"] == BUILT and self.version >= _COMPLETE

    @property
    def measures_feet(self) -> bool:
        """Whether it keeps how fast feet are near the floor; movement from one that does not keeps to no such speed."""
        return self.version >= _FEET

    @property
    def measures_clips(self) -> bool:
        """Whether it keeps what each clip shows of its pace, and says which code learned it."""
        return self.version >= _CLIPS

    @property
    def lists_clips(self) -> bool:
        """Whether its manifest lists clips and faults, which later versions keep in arrays."""
        return self.version <= _COMPLETE

    @property
    def is_checked(self) -> bool:
        """Whether these very files were found valid before."""
        with suppress(OSError):
            return bool(self.identity) and (self.place / versions.CHECKED).read_text("utf-8") == self.identity
        return False

    def remember_checked(self) -> None:
        """Note beside the arrays that they were found valid, where that can be written."""
        with suppress(OSError):
            if self.identity:
                replace_file(self.place / versions.CHECKED, self.identity.encode())


def load(folder: Path) -> Stored:
    """Load a corpus's folder, of one version even while others replace it.

    Raises:
        FormatError: the manifest or an array is missing, damaged, or not the one that was saved.
    """
    path, missing = folder / MANIFEST, 0
    while True:
        data = _read(path)
        manifest = _parse(path, data)
        if manifest["format"] != BUILT:
            return Stored(manifest, {}, folder, "")
        place = _place_of(folder, manifest)
        with versions.hold(place) as there:
            # Only a version that is current while it is held is complete, and stays so.
            if _read(path) != data:
                continue
            if not there:
                missing += 1
                if missing == _LOOKS:
                    raise FormatError(f"there is no folder {place.name} beside it; {remedy(folder)}", path=path)
                time.sleep(_BETWEEN)  # writers may make and remove versions of a number that is free again
                continue
            shapes = _shapes_in(manifest, folder)
            identity = _identity(data, [_array_file(place, name) for name in shapes])
            try:
                arrays = _open_arrays(folder, place, shapes)
            except FormatError:
                if _read(path) == data:
                    raise
                continue  # replaced, on a disk without locks
            return Stored(manifest, arrays, place, identity)


def remedy(folder: Path) -> str:
    """Return the advice to build the corpus of a folder again, with the command for it."""
    words = ["motionmind", "corpus", "build", folder.name]
    if folder.parent != home() / "corpora" and folder.parent.name == "corpora":
        words += ["--home", str(folder.parent.parent)]
    return f"build the corpus again: {shlex.join(words)} FILES"


def _shapes_in(manifest: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return what the manifest of a corpus's folder says of each array: [type, *shape], or None."""
    shapes = manifest.get("arrays")
    if isinstance(shapes, list) and all(isinstance(name, str) for name in shapes):
        shapes = dict.fromkeys(shapes)  # as the first corpora of 0.1 listed them, without their shapes
    if not isinstance(shapes, dict) or not all(map(_ARRAY_NAME.fullmatch, shapes)):
        raise FormatError(f"does not say which arrays there are; {remedy(folder)}", path=folder / MANIFEST)
    return shapes


def _open_arrays(folder: Path, place: Path, shapes: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """Open a corpus's arrays in `place`; the manifest states each one's type and shape, as [type, *shape], or None."""

    arrays = {}
    for name, shape in shapes.items():
        file = _array_file(place, name)
        try:
            arrays[name] = _open_array(file, shape)
        except Exception as error:  # the header is Python; parsing a damaged one can raise anything
            raise FormatError(f"cannot be read as an array: {error}; {remedy(folder)}", path=file) from error
        if shape is not None and [arrays[name].dtype.str, *arrays[name].shape] != shape:
            raise FormatError(f"is not the array that was saved; {remedy(folder)}", path=file)
    return arrays


def _open_array(file: Path, form: Sequence[Any] | None) -> NDArray[Any]:
    """Map an array of a file, read-only; `form` is what the manifest states of it."""
    import numpy as np

    if form is not None:
        kind, *shape = form
        header, count = _header(kind, *shape), math.prod(shape)
        with file.open("rb") as stream:
            if count and stream.read(len(header)) == header:
                data = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
                return np.frombuffer(data, kind, count, len(header)).reshape(shape)
    # A plain view: still mapped, but without the subclass, which slows every slice. A path would be resolved, link by
    # link.
    return np.asarray(np.lib.format.open_memmap(str(file), mode="r"))


@lru_cache(maxsize=1000)
def _header(kind: str, *shape: int) -> bytes:
    """Return how a file of such an array begins: to compare it takes a fifth of the time of reading what it says."""
    import numpy as np

    written = io.BytesIO()
    np.lib.format.write_array_header_1_0(written, {"descr": kind, "fortran_order": False, "shape": shape})
    return written.getvalue()


def _array_file(place: Path, name: str) -> Path:
    return place / f"{name}.npy"


def _identity(manifest: bytes, files: Iterable[Path]) -> str:
    """Return a name of a manifest and files as they are; "" if a file lacks, or could change and keep its times."""
    digest = hashlib.sha256(manifest)
    newest = 0.0
    for file in [*files, CHECKED_BY]:
        try:
            found = file.stat()
        except (OSError, ValueError):
            return ""
        newest = max(newest, found.st_mtime, found.st_ctime)
        digest.update(repr((found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns)).encode())
    return digest.hexdigest() if time.time() - newest > _COARSEST_CLOCK else ""


def cache() -> Path:
    """Return the folder that caches corpora built from bundled sources."""
    return Path(platformdirs.user_cache_dir("motionmind", appauthor=False)) / "corpora"
