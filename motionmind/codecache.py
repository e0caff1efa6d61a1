"""A private cache of compiled code on disk, keyed by the contents of the sources.

A wheel may also carry code, for any processor of its platform and for newer ones (`hatch_build.py`). The user's own,
which is compiled for the exact processor, takes precedence.
"""

from __future__ import annotations

import hashlib
import logging
import os
import pickle
import re
import shutil
import sys
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
from motionmind.private_folders import is_fixed, is_private, read_own, temporary_folder

_HERE = Path(__file__).parent
_HASH_BYTES = 32
_IMPORT = re.compile(r"^from motionmind(?:\.([\w.]+))? import (\([^)]*\)|.*)$", re.M)  # as a module is loaded
_V3_FEATURES = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")  # of x86-64-v3
# Numba's core is untyped.
_result: Any = compiler.compile_result
_codegen: Any = codegen
_binding: Any = codegen.ll  # type: ignore[attr-defined]  # llvmlite.binding
_dumps: Any = serialize.dumps


@cache
def decorated_names() -> frozenset[str]:
    """Return the jitted functions of this package, as "search/astar.search", without importing them."""
    return frozenset(
        f"{source.parent.name}/{source.stem}.{name}"
        for source in _compiling_sources()
        for name in re.findall(r"^@jit\ndef (\w+)", _text(source), re.M)
    )


def compiled_names() -> frozenset[str]:
    """Return the jitted functions whose compiled code is on disk."""
    return frozenset(
        f"{_module(folder).replace('.', '/')}.{file.name.rsplit('-', 1)[0]}"
        for folder in _folders()
        for file in [*folder.glob("*.nbc"), *_shipped_files(folder)]
    )


def is_all_compiled() -> bool:
    """Return whether the code of all functions is shipped or, since `note_all_compiled`, still on disk.

    Reading all sources takes 0.1 s, so a positive result is noted under their modification times, and found in 0.01 s.
    """
    if (place := place_of_code()) is None:
        return False
    seen = place / f"all-{_sources_key()}"
    if _is_complete(seen):
        return True
    note = _note()
    if _shipped() and decorated_names() <= compiled_names():
        noted = ""
    elif note is not None and _is_complete(note):
        noted = note.read_text("utf-8")
    else:
        return False
    with suppress(OSError):
        replace_file(seen, noted.encode())
    return True


def _is_complete(note: Path) -> bool:
    """Return whether a note exists and all files that it names."""
    with suppress(OSError, UnicodeDecodeError):
        return all((note.parent / name).is_file() for name in note.read_text("utf-8").splitlines())
    return False


def _sources_key() -> str:
    """Return a hash of the paths, sizes and modification times of all sources of compiled code."""
    files = [*_HERE.glob("*.py"), *_HERE.glob("*/*.py"), *_HERE.glob("_compiled/*.zip")]
    stats = [(str(file), found.st_size, found.st_mtime_ns) for file in sorted(files) for found in [file.stat()]]
    key = (numba.__version__, sys.implementation.cache_tag, cpu_target.target_context.codegen().magic_tuple(), stats)
    return hashlib.sha256(repr(key).encode()).hexdigest()[:24]


def note_all_compiled() -> None:
    """Note that everything is compiled, and in which files."""
    if (note := _note()) is not None:
        names = [str(file.relative_to(note.parent)) for folder in _folders() for file in sorted(folder.glob("*.nbc"))]
        with suppress(OSError):
            replace_file(note, "\n".join(names).encode())


def place_of_code() -> Path | None:
    """Return the folder of compiled code; None if no folder is writable."""
    folder = _folder(_HERE / "search" / "astar.py")
    return folder and folder.parent


class Kept:
    """The compiled code of one function on disk, instead of Numba's cache: a file for each signature, with its hash.

    Numba keeps an index and numbered files. It trusts their contents, lets two processes write different code under one
    number, fails on a full disk, and writes into the package if it cannot make its folder. Here every fault means that
    the function is compiled again.
    """

    def __init__(self, function: Callable[..., object]) -> None:
        self._function = function

    @property
    def cache_path(self) -> Path | None:
        """The folder; None if no folder is writable."""
        return _folder(Path(self._function.__code__.co_filename))

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return the code for a signature; None if it is missing or damaged."""
        context.refresh()
        file = self._file(signature, context.codegen().magic_tuple())
        if file is None:
            return None
        try:
            data = read_own(file)
        except OSError:
            shipped = self._shipped_code(signature)
            with suppress(Exception):  # damaged: compile again
                return shipped and _linked(context, *pickle.loads(shipped[_HASH_BYTES:]))
            return None
        try:
            if hashlib.sha256(data[_HASH_BYTES:]).digest() != data[:_HASH_BYTES]:
                raise ValueError("wrong hash")
            return _linked(context, *pickle.loads(data[_HASH_BYTES:]))
        except Exception:  # unpickling and linking raise many kinds
            _warn(f"compiled code in {file.parents[1]} is damaged: compiling again")
            with suppress(OSError):
                file.unlink(missing_ok=True)
            return None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Write the code for a signature, if possible."""
        file = self._file(signature, compiled.codegen.magic_tuple())
        if file is None or compiled.lifted or compiled.library.has_dynamic_globals:
            return
        data = _dumps((_symbols(compiled.library), *compiled._reduce()))
        try:
            replace_file(file, hashlib.sha256(data).digest() + data, 0o600)
        except OSError as error:
            _warn(f"cannot cache compiled code in {file.parents[1]} ({error.strerror}): each run compiles again")

    def _shipped_code(self, signature: Any) -> bytes | None:
        """Return the shipped code for a signature; None if it is missing or damaged."""
        for target, archive in _shipped():
            file = self._file(signature, target)
            with suppress(KeyError, OSError, zipfile.BadZipFile, zlib.error):
                data = archive.read(f"{file.parent.name}/{file.name}") if file else b""
                if hashlib.sha256(data[_HASH_BYTES:]).digest() == data[:_HASH_BYTES]:
                    return data
        return None

    def _file(self, signature: Any, target: tuple[str, ...]) -> Path | None:
        """Return the file for a signature and a target (triple, processor, features)."""
        code, folder = self._function.__code__, self.cache_path
        if folder is None:
            return None
        values = _dumps(tuple(cell.cell_contents for cell in self._function.__closure__ or ()))
        key = (numba.__version__, sys.implementation.cache_tag, str(signature), target, values)
        name = re.sub(r"[^\w.]", "", code.co_qualname)
        return folder / f"{name}-{code.co_firstlineno}.{hashlib.sha256(repr(key).encode()).hexdigest()[:24]}.nbc"


def targets() -> list[str]:
    """Return the processors for which a wheel of this platform carries code, in order of preference."""
    return ["x86-64-v3", "generic"] if _binding.get_process_triple().startswith("x86_64") else ["generic"]


def _shipped() -> list[tuple[tuple[str, ...], zipfile.ZipFile]]:
    """Return the shipped archives of code that this processor can run, each with its target."""
    return _opened(os.getpid())  # one per process: forked processes would share the file's offset


@cache
def _opened(_process: int) -> list[tuple[tuple[str, ...], zipfile.ZipFile]]:
    features = _binding.get_host_cpu_features()
    found: list[tuple[tuple[str, ...], zipfile.ZipFile]] = []
    for name in targets():
        if name == "generic" or all(features.get(feature) for feature in _V3_FEATURES):
            with suppress(OSError, zipfile.BadZipFile):
                target = (_binding.get_process_triple(), name, "")
                found.append((target, zipfile.ZipFile(_HERE / "_compiled" / f"{name}.zip")))
    return found


def _shipped_files(folder: Path) -> Iterator[Path]:
    """Yield the names of shipped code for the state of a module after which its folder is named."""
    for _, archive in _shipped()[:1]:
        yield from (Path(name) for name in archive.namelist() if name.startswith(f"{folder.name}/"))


def _symbols(library: Any) -> frozenset[str]:
    """Return the names of the symbols that compiled code defines."""
    module = library._get_module_for_linking()
    defined = (one for kind in (module.functions, module.global_variables) for one in kind if not one.is_declaration)
    return frozenset(one.name for one in defined)


def _linked(context: Any, symbols: frozenset[str], state: Any, *reduced: Any) -> Any:
    """Return a cached result of a compilation, as Numba's `_rebuild` does, in a quarter of the time.

    Numba also parses the intermediate code, which only serves to compile other functions that call this one: here it
    is parsed only then.

    Args:
        context: the target of the compilation.
        symbols: the symbols that the code defines.
        state: the library from `CompileResult._reduce`: its name, and machine and intermediate code.
        reduced: the other items from `CompileResult._reduce`.
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
    """Return the modules of this package with jitted functions."""
    return [source for source in sorted(_HERE.glob("*/*.py")) if re.search(r"^@jit$", _text(source), re.M)]


def _folders() -> list[Path]:
    """Return the folders of compiled code of all modules with jitted functions."""
    return [folder for source in _compiling_sources() if (folder := _folder(source))]


def _module(folder: Path) -> str:
    """Return the module whose compiled code a folder holds, as "search.astar"."""
    return folder.name.rpartition("-")[0]


def _note() -> Path | None:
    """Return the file that notes that everything is compiled, named after the sources and the platform."""
    if not (folders := _folders()):
        return None
    codegen = cpu_target.target_context.codegen()
    key = (numba.__version__, sys.implementation.cache_tag, codegen.magic_tuple(), [folder.name for folder in folders])
    return folders[0].parent / f"all-{hashlib.sha256(repr(key).encode()).hexdigest()[:24]}"


@cache
def _warn(message: str) -> None:
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
    """Return the modules of this package that a module imports at its top level."""
    found: set[Path] = set()
    for package, names in _IMPORT.findall(_text(source)):
        module = _HERE.joinpath(*package.split(".")) if package else _HERE
        one, named = module.with_suffix(".py"), [module / f"{name}.py" for name in re.findall(r"\w+", names)]
        found.update([one] if one.is_file() else filter(Path.is_file, named))
    return frozenset(found)


def _state(source: Path) -> str:
    """Return a hash of the contents of a module and of all its imports from this package, direct or indirect.

    Compiled code contains the functions that it calls and the constants that it reads, even from other modules.
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

    The path of the package and the times of its files do not matter, so environments share compiled code. The folder
    is in $NUMBA_CACHE_DIR, else in the user's cache directory, else in the system's temporary one; None if none of
    them is writable.
    """
    name = f"{source.parent.name}.{source.stem}-{_state(source)}"
    own = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("motionmind", appauthor=False)
    for temporary in (False, True):
        with suppress(OSError, ValueError):
            place = _make_private((temporary_folder() if temporary else Path(own)) / "compiled")
            folder = place / name
            is_new = not folder.is_dir()
            make_folder(folder)
            if os.access(folder, os.W_OK):
                os.utime(folder)
                if is_new:
                    _remove_unused(place)
                return folder
    _warn(f"cannot cache compiled code in {own} or among temporary files: each run compiles again")
    return None


@cache
def _make_private(place: Path) -> Path:
    """Make a folder that only this user can write to, since loading compiled code runs it; return its real path.

    If others could write to an existing folder of the user, remove its content.

    Raises:
        OSError: it belongs to another user, others could replace it, or it cannot be made.
    """
    place = Path(os.path.realpath(place.parent)) / place.name
    if is_fixed(place):
        make_folder(place.parent)
        with suppress(FileExistsError):
            place.mkdir(mode=0o700)
        if not is_private(place) and place.lstat().st_uid == os.getuid():
            shutil.rmtree(place)
            place.mkdir(mode=0o700)
        if is_private(place):
            return place
    raise PermissionError(f"{place}: others could replace what is in it")


def _remove_unused(place: Path) -> None:
    """Remove compiled code that no process has used for a month, most likely of sources that have since changed."""
    for found in [*place.glob("*.*-" + "[0-9a-f]" * 16), *place.glob("all-" + "[0-9a-f]" * 24)]:
        with suppress(OSError):
            if time.time() - found.lstat().st_mtime > 30 * 86400.0:  # seconds
                if found.is_dir():
                    shutil.rmtree(found, ignore_errors=True)
                else:
                    found.unlink()
