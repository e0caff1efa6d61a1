"""Compiled code on disk: kept for the contents of the sources that it came from, and private to its user.

A wheel may carry code, too, for any processor of its platform and for newer ones (`hatch_build.py`). The user's own,
which is for the very processor, goes first.
"""

from __future__ import annotations

import hashlib
import logging
import os
import pickle
import re
import shutil
import stat
import sys
import tempfile
import time
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numba
import platformdirs
from numba.core import codegen, compiler, serialize
from numba.core.registry import cpu_target

from motionmind.files import make_folder, replace_file

_HERE = Path(__file__).parent
_HASH = 32  # bytes of a hash
_IMPORT = re.compile(r"^from motionmind(?:\.([\w.]+))? import (\([^)]*\)|.*)$", re.M)  # as a module is loaded
_MONTH = 30 * 86400.0  # seconds
_V3 = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")  # features of processors of the level x86-64-v3
# Of numba's core, which is not typed.
_result: Any = compiler.compile_result
_codegen: Any = codegen
_binding: Any = codegen.ll  # type: ignore[attr-defined]  # llvmlite.binding
_dumps: Any = serialize.dumps


@cache
def decorated_names() -> frozenset[str]:
    """Return the functions of this package that are to be compiled, as "search/astar.search"; none need be loaded."""
    return frozenset(
        f"{source.parent.name}/{source.stem}.{name}"
        for source in _compiling_sources()
        for name in re.findall(r"^@jit\ndef (\w+)", _text(source), re.M)
    )


def compiled_names() -> frozenset[str]:
    """Return those of them whose compiled code is on disk."""
    return frozenset(
        f"{_module(folder).replace('.', '/')}.{file.name.rsplit('-', 1)[0]}"
        for folder in _folders()
        for file in [*folder.glob("*.nbc"), *_shipped_files(folder)]
    )


def is_all_compiled() -> bool:
    """Return whether all is shipped, or what `note_all_compiled` found is all there still, for these sources.

    Reading all sources takes a tenth of a second, so a yes is noted under their ages, and found in a hundredth.
    """
    if (place := place_of_code()) is None:
        return False
    seen = place / f"all-{_ages()}"
    if _holds(seen):
        return True
    note = _note()
    if _shipped() and decorated_names() <= compiled_names():
        noted = ""
    elif note is not None and _holds(note):
        noted = note.read_text("utf-8")
    else:
        return False
    with suppress(OSError):
        replace_file(seen, noted.encode())
    return True


def _holds(note: Path) -> bool:
    """Return whether a note is there, and all files that it names."""
    with suppress(OSError, UnicodeDecodeError):
        return all((note.parent / name).is_file() for name in note.read_text("utf-8").splitlines())
    return False


def _ages() -> str:
    """Return a hash of the places, sizes and ages of all that compiled code comes from."""
    files = [*_HERE.glob("*.py"), *_HERE.glob("*/*.py"), *_HERE.glob("_compiled/*.zip")]
    stats = [(str(file), found.st_size, found.st_mtime_ns) for file in sorted(files) for found in [file.stat()]]
    key = (numba.__version__, sys.implementation.cache_tag, cpu_target.target_context.codegen().magic_tuple(), stats)
    return hashlib.sha256(repr(key).encode()).hexdigest()[:24]


def note_all_compiled() -> None:
    """Note that what is compiled now is all that there is to compile."""
    if (note := _note()) is not None:
        names = [str(file.relative_to(note.parent)) for folder in _folders() for file in sorted(folder.glob("*.nbc"))]
        with suppress(OSError):
            replace_file(note, "\n".join(names).encode())


def place_of_code() -> Path | None:
    """Return the folder that compiled code is kept in; None if there is none that can be written."""
    folder = _folder(_HERE / "search" / "astar.py")
    return folder and folder.parent


class Kept:
    """The compiled code of one function on disk, in place of numba's cache: a file for each signature, with its hash.

    numba keeps an index and numbered files. It trusts whatever it finds there, lets two processes write different code
    under one number, fails where the disk is full, and writes into the package where its folder cannot be made. Here
    every fault means that the function is compiled again.
    """

    def __init__(self, function: Callable[..., object]) -> None:
        self._function = function

    @property
    def cache_path(self) -> Path | None:
        """The folder; None if there is none that can be written."""
        return _folder(Path(self._function.__code__.co_filename))

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return the code for a signature; None if it is not there, or damaged."""
        context.refresh()
        file = self._file(signature, context.codegen().magic_tuple())
        if file is None:
            return None
        try:
            data = file.read_bytes()
        except OSError:
            shipped = self._shipped_code(signature)
            with suppress(Exception):  # damaged: it is compiled
                return shipped and _link(context, *pickle.loads(shipped[_HASH:]))
            return None
        try:
            if hashlib.sha256(data[_HASH:]).digest() != data[:_HASH]:
                raise ValueError("not what was written")
            return _link(context, *pickle.loads(data[_HASH:]))
        except Exception:  # whatever unpickling and linking raise
            _say(f"compiled code in {file.parents[1]} was damaged; it is compiled again")
            with suppress(OSError):
                file.unlink(missing_ok=True)
            return None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Write the code for a signature, where that can be done."""
        file = self._file(signature, compiled.codegen.magic_tuple())
        if file is None or compiled.lifted or compiled.library.has_dynamic_globals:
            return
        data = _dumps((_symbols(compiled.library), *compiled._reduce()))
        try:
            replace_file(file, hashlib.sha256(data).digest() + data)
        except OSError as error:
            _say(f"compiled code cannot be kept in {file.parents[1]} ({error.strerror}); each run compiles it again")

    def _shipped_code(self, signature: Any) -> bytes | None:
        """Return the code for a signature that the package carries; None if it carries none that is whole."""
        for target, archive in _shipped():
            file = self._file(signature, target)
            with suppress(KeyError, OSError, zipfile.BadZipFile, zlib.error):
                data = archive.read(f"{file.parent.name}/{file.name}") if file else b""
                if hashlib.sha256(data[_HASH:]).digest() == data[:_HASH]:
                    return data
        return None

    def _file(self, signature: Any, target: tuple[str, ...]) -> Path | None:
        """Return the file for a signature and a target: triple, processor and its features."""
        code, folder = self._function.__code__, self.cache_path
        if folder is None:
            return None
        values = _dumps(tuple(cell.cell_contents for cell in self._function.__closure__ or ()))
        key = (numba.__version__, sys.implementation.cache_tag, str(signature), target, values)
        name = re.sub(r"[^\w.]", "", code.co_qualname)
        return folder / f"{name}-{code.co_firstlineno}.{hashlib.sha256(repr(key).encode()).hexdigest()[:24]}.nbc"


def targets() -> list[str]:
    """Return the processors that a wheel of this platform carries code for, the one to prefer first."""
    return ["x86-64-v3", "generic"] if _binding.get_process_triple().startswith("x86_64") else ["generic"]


def _shipped() -> list[tuple[tuple[str, ...], zipfile.ZipFile]]:
    """Return the archives of code in this package that this processor can run, each with its target."""
    return _opened(os.getpid())  # by the process: forked ones would read at each other's places


@cache
def _opened(_process: int) -> list[tuple[tuple[str, ...], zipfile.ZipFile]]:
    features = _binding.get_host_cpu_features()
    found: list[tuple[tuple[str, ...], zipfile.ZipFile]] = []
    for name in targets():
        if name == "generic" or all(features.get(feature) for feature in _V3):
            with suppress(OSError, zipfile.BadZipFile):
                target = (_binding.get_process_triple(), name, "")
                found.append((target, zipfile.ZipFile(_HERE / "_compiled" / f"{name}.zip")))
    return found


def _shipped_files(folder: Path) -> Iterator[Path]:
    """Yield the names of shipped code for a module's state, which its folder is named after."""
    for _, archive in _shipped()[:1]:
        yield from (Path(name) for name in archive.namelist() if name.startswith(f"{folder.name}/"))


def _symbols(library: Any) -> frozenset[str]:
    """Return the names of what compiled code defines."""
    module = library._get_module_for_linking()
    defined = (one for kind in (module.functions, module.global_variables) for one in kind if not one.is_declaration)
    return frozenset(one.name for one in defined)


def _link(context: Any, symbols: frozenset[str], state: Any, *reduced: Any) -> Any:
    """Return the result of a compilation that was kept, as numba's `_rebuild` does, in a quarter of the time.

    numba reads the intermediate code too, which only serves to compile another function that calls this one: here it is
    read then.

    Args:
        context: the target that it was compiled for.
        symbols: what it defines.
        state: the library that `CompileResult._reduce` returned: its name, and machine and intermediate code.
        reduced: the rest of what it returned.
    """
    description, environment, signature, objectmode, lifted, annotation, reload_init, environments = reduced
    for function in reload_init:
        function()
    name, _, (machine, intermediate) = state
    target = context.codegen()
    library = target.create_library(name)
    library.enable_object_caching()
    library._set_compiled_object(machine)
    library._get_module_for_linking = cache(lambda: _codegen.ll.parse_bitcode(intermediate))
    library._finalize_final_module()
    target._engine._defined_symbols |= symbols
    entry = context.get_executable(library, description, environment)
    for one in environments:
        target.set_env(one.env_name, one)
    return _result(
        target_context=context,
        typing_context=context.typing_context,
        library=library,
        environment=environment,
        entry_point=entry,
        fndesc=description,
        type_annotation=annotation,
        signature=signature,
        objectmode=objectmode,
        lifted=lifted,
        reload_init=reload_init,
        referenced_envs=environments,
    )


def _compiling_sources() -> list[Path]:
    """Return the modules of this package that have functions to compile."""
    return [source for source in sorted(_HERE.glob("*/*.py")) if re.search(r"^@jit$", _text(source), re.M)]


def _folders() -> list[Path]:
    """Return the folders of compiled code of all modules that have some."""
    return [folder for source in _compiling_sources() if (folder := _folder(source))]


def _module(folder: Path) -> str:
    """Return the module whose compiled code a folder holds, as "search.astar"."""
    return folder.name.rpartition("-")[0]


def _note() -> Path | None:
    """Return the file that says that all is compiled, named after what code depends on but for its signatures."""
    if not (folders := _folders()):
        return None
    codegen = cpu_target.target_context.codegen()
    key = (numba.__version__, sys.implementation.cache_tag, codegen.magic_tuple(), [folder.name for folder in folders])
    return folders[0].parent / f"all-{hashlib.sha256(repr(key).encode()).hexdigest()[:24]}"


@cache
def _say(message: str) -> None:
    """Log a warning, once."""
    logging.getLogger("motionmind").warning(message)


@cache
def _text(source: Path) -> str:
    """Return the text of a module."""
    return source.read_text("utf-8")


@cache
def _hash(source: Path) -> str:
    """Return a hash of a module's name and text."""
    return hashlib.sha256(f"{source.parent.name}/{source.name}\n{_text(source)}".encode()).hexdigest()


@cache
def _imported(source: Path) -> frozenset[Path]:
    """Return the modules of this package that a module imports as it is loaded."""
    found: set[Path] = set()
    for package, names in _IMPORT.findall(_text(source)):
        module = _HERE.joinpath(*package.split(".")) if package else _HERE
        one, named = module.with_suffix(".py"), [module / f"{name}.py" for name in re.findall(r"\w+", names)]
        found.update([one] if one.is_file() else filter(Path.is_file, named))
    return frozenset(found)


def _state(source: Path) -> str:
    """Return a hash of the contents of a module and of all that it imports from this package, directly or not.

    Compiled code holds what it calls and the constants that it reads, and these may be in other modules.
    """
    found, left = {source}, [source]
    while left:
        new = _imported(left.pop()) - found
        found |= new
        left += new
    return hashlib.sha256("".join(sorted(map(_hash, found))).encode()).hexdigest()[:16]


@cache
def _folder(source: Path) -> Path | None:
    """Return the folder of a module's compiled code, named after the module and its state.

    Neither the path of the package nor the age of its files matters, so environments share compiled code. The folder is
    in $NUMBA_CACHE_DIR, else in the user's cache directory, else in the system's temporary one; None if none of
    them can be written.
    """
    name = f"{source.parent.name}.{source.stem}-{_state(source)}"
    own = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("motionmind", appauthor=False)
    for temporary in (False, True):
        with suppress(OSError, ValueError):
            place = (_temporary() if temporary else Path(own)) / "compiled"
            folder = place / name
            _make_private(place)
            is_new = not folder.is_dir()
            make_folder(folder)
            if os.access(folder, os.W_OK):
                os.utime(folder)
                if is_new:
                    _remove_unused(place)
                return folder
    _say(f"compiled code can be kept neither in {own} nor among temporary files; each run compiles it again")
    return None


def _make_private(place: Path) -> None:
    """Make a folder that nobody else may write to, since loading compiled code runs it; OSError if it is another's.

    The content of one that others could have written to is removed.
    """
    make_folder(place.parent)
    with suppress(FileExistsError):
        place.mkdir(mode=0o700)
    if not hasattr(os, "getuid"):
        return
    found = place.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid not in (os.getuid(), 0):
        raise PermissionError(f"{place} belongs to somebody else")
    if found.st_mode & 0o022 and found.st_uid == os.getuid():
        shutil.rmtree(place)
        place.mkdir(mode=0o700)


def _remove_unused(place: Path) -> None:
    """Remove compiled code that no process has asked for in a month: of sources that have changed since, most likely.

    A process that needs it compiles it again.
    """
    for found in [*place.glob("*.*-" + "[0-9a-f]" * 16), *place.glob("all-" + "[0-9a-f]" * 24)]:
        with suppress(OSError):
            if time.time() - found.lstat().st_mtime > _MONTH:
                if found.is_dir():
                    shutil.rmtree(found, ignore_errors=True)
                else:
                    found.unlink()


@cache
def _temporary() -> Path:
    """Return a folder among the system's temporary files in which nobody else may write; OSError if there is none."""
    user = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"motionmind-{user}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if stat.S_ISDIR(found.st_mode) and found.st_uid in (user, 0) and not found.st_mode & 0o022:
        return folder
    return Path(tempfile.mkdtemp(prefix="motionmind-"))
