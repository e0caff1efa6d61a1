"""Corpora on disk: folders of arrays with a manifest, and where to find them."""

from __future__ import annotations

import hashlib
import os
import re
import shlex
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec
import platformdirs

from motionmind.arguments import check_path
from motionmind.bundled import bundled
from motionmind.corpus import cache, versions
from motionmind.corpus.arrays import (
    identify,
    is_checked,
    open_arrays,
    parse_entries,
    remember_checked,
    write_arrays,
)
from motionmind.errors import CorpusError, FormatError, quoted, suggestion
from motionmind.files import make_folder, replace_file, sync_folder

if TYPE_CHECKING:
    from numpy.typing import NDArray

FORMAT, BUILT = "motionmind-corpus", "motionmind-built-corpus"
VERSIONS = {FORMAT: 1, BUILT: 11}
MANIFEST = "manifest.json"
# Names of devices on Windows, with any suffix.
_DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in "0123456789¹²³")}
_PREVIOUS = "previous"  # key of a manifest: the manifest of the corpus that this one replaced
_MAX_RETRIES, _PAUSE_S = 20, 0.005  # until a missing version appears


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
    """Return the folder for a corpus of a user; CorpusError if the name is a bundled corpus's or not portable."""
    if not re.fullmatch(r"\w[\w.-]{0,63}", name):
        raise CorpusError(f"{name!r:.80} cannot be a corpus's name: use letters, digits, -, _ and . (64 at most)")
    if _is_bundled(name):
        raise CorpusError(f"{name!r} is the name of a bundled corpus; choose another")
    if name not in (known := list_corpora(folder)):
        _check_portable(name, known)
    return home(folder) / "corpora" / name


def _check_portable(name: str, known: Iterable[str]) -> None:
    """Raise CorpusError if not every system can have a folder of this name beside those of the known corpora."""
    if name.endswith(".") or name.partition(".")[0].casefold() in _DEVICES:
        raise CorpusError(f"{name!r} cannot be a folder on Windows; choose another name")
    if twin := next((one for one in known if one.casefold() == name.casefold()), None):
        raise CorpusError(f"{name!r} differs from the corpus {twin!r} only by case; choose another name")


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
    """Delete a user's corpus at once, with what was learned from it and the remains of unfinished builds.

    Processes that have loaded it keep their data.

    Args:
        name: the name of the corpus, or of one whose build was never finished.
        folder: the user's home (`home`).

    Raises:
        CorpusError: the user has no such corpus, its folder holds other files, or it cannot be deleted.
    """
    left = unfinished(name, folder)
    if removable(name, folder) != left:
        place = _own(name, folder)
        before = _digests_of(place)
        try:
            versions.remove(place)
        except OSError as error:
            raise CorpusError(f"{place}: cannot be deleted: {error.strerror or error}") from error
        for gone in before:
            cache.forget(gone)
    versions.remove_unused(left)
    with suppress(OSError):
        left.parent.rmdir()


def rename(name: str, new: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Rename a user's corpus, and return its new folder; what was learned from it stays.

    First its manifest gets the new name, then its folder, each at once. After a kill in between, the corpus is
    complete under its old name, and can be renamed again.

    Args:
        name: the name of the corpus.
        new: its new name, which no corpus has.
        folder: the user's home (`home`).

    Raises:
        CorpusError: the user has no such corpus, its folder holds other files, the new name is invalid or taken, or it
            cannot be renamed.
    """
    place, target = _own(name, folder), place_for(new, folder)
    if target.exists():
        raise CorpusError(f"there is a corpus {new!r} already; corpus delete {new} removes it")
    manifest = read_manifest(place)
    try:
        with versions.hold(_place_of(place, manifest)):  # so that no build removes its version meanwhile
            _write_manifest(place, read_manifest(place) | {"name": new})
            place.rename(target)
        sync_folder(target.parent)
    except OSError as error:
        raise CorpusError(f"{place}: cannot be renamed: {error.strerror or error}") from error
    return target


def _own(name: str, folder: str | os.PathLike[str] | None) -> Path:
    """Return the folder of a user's corpus; CorpusError if there is none, or if it holds other files."""
    place = own_place(name, folder)
    if stranger := versions.find_stranger(place, MANIFEST):
        raise CorpusError(f"{place}: holds {stranger.relative_to(place)}, which is no part of a built corpus")
    return place


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of a corpus's folder; FormatError if it is invalid or of another version."""
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
    if not isinstance(form, str) or form not in VERSIONS:
        form = quoted(form) if isinstance(form, str) else "no text"
        raise FormatError(f"its `format` is {form}; {FORMAT!r} and {BUILT!r} can be read", path=path)
    if version == VERSIONS[form]:
        return manifest
    if form == BUILT and isinstance(version, int):
        age = "an earlier" if version < VERSIONS[form] else "a later"
        raise FormatError(f"a corpus of {age} version; {remedy(path.parent)}", path=path)
    shown = version if isinstance(version, int) and abs(version) < 2**63 else "not a small number"
    raise FormatError(f"its `version` is {shown}; version {VERSIONS[form]} can be read", path=path)


def remedy(folder: Path) -> str:
    """Return the advice to rebuild the corpus of a folder, with the command."""
    words = ["motionmind", "corpus", "build", folder.name, "FILES", "--replace"]
    if folder.parent != home() / "corpora" and folder.parent.name == "corpora":
        words += ["--home", str(folder.parent.parent)]
    return f"rebuild it: {shlex.join(words)}"


def save(folder: Path, manifest: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]], *, keep: bool = True) -> str:
    """Write a corpus's folder, and return the corpus's hash, by which what is learned from it is cached.

    An existing corpus is replaced at once when the new one is complete and on disk (`motionmind.corpus.versions`).

    Args:
        folder: the corpus's folder.
        manifest: plain values for JSON; format, version, folder and the arrays' entries are added.
        arrays: by name.
        keep: whether a replaced corpus of other movement stays beside the new one, for `restore`.

    Raises:
        CorpusError: the folder cannot be written, or holds other files.
    """
    try:
        if stranger := versions.find_stranger(folder, MANIFEST):
            name = stranger.relative_to(folder)
            raise CorpusError(f"{folder}: holds {name}, which is no part of a built corpus; it is not replaced")
        before = _digests_of(folder)
        make_folder(folder)
        try:
            digest = _write(folder, manifest, arrays, keep=keep)
        finally:
            with suppress(FormatError):  # no manifest that can be read: all stays until a save succeeds
                versions.remove_others(folder, lambda: _used(folder))
        versions.remove_leftovers(folder)
        for stray in folder.glob("*.npy"):  # of a version that kept arrays beside the manifest
            stray.unlink(missing_ok=True)
    except OSError as error:
        raise CorpusError(f"{folder}: cannot be written: {error.strerror or error}") from error
    for gone in before - _digests_of(folder):
        cache.forget(gone)
    return digest


def _write(folder: Path, manifest: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]], *, keep: bool) -> str:
    """Write a new version, make it the current one, and return its hash; its files are on disk before the manifest."""
    with versions.new_version(folder) as version:
        entries = write_arrays(version, arrays, flush=True)
        sync_folder(version)
        sync_folder(folder)
        head = {"format": BUILT, "version": VERSIONS[BUILT], "folder": int(version.name)}
        new = msgspec.json.decode(msgspec.json.encode({**head, **manifest, "arrays": entries}))
        with _held(folder) as old:
            if keep and old is not None:
                kept = replaced(old) if _digest(old) == _digest(new) else _without_previous(old)
                new |= {_PREVIOUS: kept} if kept else {}
            _write_manifest(folder, new)
    return _digest(new)


def _write_manifest(folder: Path, manifest: Mapping[str, Any]) -> None:
    data = msgspec.json.encode(manifest)
    replace_file(folder / MANIFEST, msgspec.json.format(data, indent=1) + b"\n")


@contextmanager
def _held(folder: Path) -> Iterator[dict[str, Any] | None]:
    """Prevent the removal of a built corpus's current version; yield its manifest, None if there is none to hold."""
    with ExitStack() as stack:
        manifest = None
        with suppress(FormatError):
            manifest = read_manifest(folder)
            if not stack.enter_context(versions.hold(_place_of(folder, manifest))):
                manifest = None
        yield manifest


def restore(name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Exchange a user's corpus, atomically, with the one that its last change replaced; return its folder.

    A second call brings the newer one back.

    Args:
        name: the name of the corpus.
        folder: the user's home (`home`).

    Raises:
        CorpusError: the user has no such corpus, no replaced one is kept, or the folder cannot be written.
    """
    place = own_place(name, folder)
    manifest = read_manifest(place)
    old = replaced(manifest)
    try:
        with versions.hold(_place_of(place, old or manifest)) as there:
            if old is None or not there:
                raise CorpusError(f"{name!r} replaced no corpus that is kept")
            _write_manifest(place, old | {"name": name, _PREVIOUS: _without_previous(manifest)})
    except OSError as error:
        raise CorpusError(f"{place}: cannot be written: {error.strerror or error}") from error
    return place


def _digest(manifest: Mapping[str, Any]) -> str:
    """Return a hash of a built corpus: of its manifest, which holds its arrays' checksums, but for its name."""
    kept = {key: value for key, value in manifest.items() if key not in ("name", "folder", _PREVIOUS)}
    return hashlib.sha256(msgspec.json.encode(kept)).hexdigest()[:16]


def _digests_of(folder: Path) -> set[str]:
    """Return the hashes of the built corpus in a folder and of the one that it replaced, if they exist."""
    with suppress(FormatError):
        return {_digest(manifest) for manifest in _manifests(folder)}
    return set()


def _used(folder: Path) -> list[Path]:
    """Return the folders of the arrays of a built corpus, and of the one that it replaced; none without a manifest."""
    return [_place_of(folder, manifest) for manifest in _manifests(folder)] if (folder / MANIFEST).exists() else []


def _manifests(folder: Path) -> list[dict[str, Any]]:
    """Return the manifest of a built corpus, and that of the one that it replaced, if it is kept."""
    manifest = read_manifest(folder)
    old = replaced(manifest)
    return [manifest] if old is None else [manifest, old]


def replaced(manifest: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the manifest of the corpus that a built corpus replaced, from its manifest; None if it is not kept."""
    old = manifest.get(_PREVIOUS)
    return old if isinstance(old, dict) else None


def _without_previous(manifest: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in manifest.items() if key != _PREVIOUS}


def _place_of(folder: Path, manifest: Mapping[str, Any]) -> Path:
    """Return the folder of a built corpus's arrays."""
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
        is_checked: whether these very files were found valid before.
    """

    manifest: dict[str, Any]
    arrays: dict[str, NDArray[Any]]
    place: Path
    identity: str = ""
    is_checked: bool = False

    @property
    def digest(self) -> str:
        """A hash of the corpus, whatever its name."""
        return _digest(self.manifest)

    def remember_checked(self) -> None:
        """Note beside the arrays that they were found valid, where that can be written."""
        remember_checked(self.place, self.identity)


def load(folder: Path) -> Stored:
    """Load a corpus's folder, of one version even while others replace it; verify the checksums of new files.

    Raises:
        FormatError: the manifest or an array is missing, damaged, or not the one that was saved.
    """
    path, missing = folder / MANIFEST, 0
    while True:
        data = _read(path)
        manifest = _parse(path, data)
        if manifest["format"] != BUILT:
            return Stored(manifest, {}, folder)
        place = _place_of(folder, manifest)
        with versions.hold(place) as there:
            # Only a version that is current while it is held is complete, and stays so.
            if _read(path) != data:
                continue
            if not there:
                missing += 1
                if missing == _MAX_RETRIES:
                    raise FormatError(f"there is no folder {place.name} beside it; {remedy(folder)}", path=path)
                time.sleep(_PAUSE_S)  # writers may make and remove versions of a number that is free again
                continue
            try:
                return _open(manifest, data, place)
            except (FormatError, ValueError) as error:
                if _read(path) != data:
                    continue  # replaced, on a disk without locks
                where = "" if isinstance(error, FormatError) else f"{path}: "
                raise FormatError(f"{where}{error}; {remedy(folder)}") from error


def _open(manifest: dict[str, Any], data: bytes, place: Path) -> Stored:
    """Open the arrays of a built corpus; FormatError or ValueError if the manifest's entries or a file are wrong."""
    entries = parse_entries(manifest.get("arrays"))
    identity = identify(place, data, entries)
    is_known = is_checked(place, identity)
    return Stored(manifest, open_arrays(place, entries, verify=not is_known), place, identity, is_known)
