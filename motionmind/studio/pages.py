"""The files of the page: its own modules and the player's, each read once and known by its path."""

from __future__ import annotations

import hashlib
import posixpath
import re
from base64 import b64encode
from collections.abc import Mapping
from pathlib import Path
from string import Template
from typing import NamedTuple

import msgspec

_PAGE = Path(__file__).parent / "page"
_PLAYER = Path(__file__).parents[1] / "render" / "player"
_TYPES = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
}
_IMPORT = re.compile(r'\b(?:from|import)\s*"([^"]+)"')
_THREE = {"three": "three.module.min.js", "three/OrbitControls": "OrbitControls.js"}


class File(NamedTuple):
    """A file that anybody may have who reaches the server; it holds nothing of anybody.

    Attributes:
        data: its bytes.
        type: its media type.
        tag: changes with its bytes.
    """

    data: bytes
    type: str
    tag: str


class Page(NamedTuple):
    """The page.

    Attributes:
        files: all files by the path that they are asked for by.
        script: hash of the import map, the only inline script, as the page's policy names it.
    """

    files: dict[str, File]
    script: str


def read_page() -> Page:
    """Read all files of the page."""
    files = {}
    names = {name: f"/player/vendor/{file}" for name, file in _THREE.items()}
    for prefix, folder in (("/page", _PAGE), ("/player", _PLAYER)):
        for path in sorted(folder.rglob("*")):
            relative = path.relative_to(folder).as_posix()
            if path.suffix in _TYPES and not any(part.startswith((".", "node_modules")) for part in path.parts[-3:]):
                files[f"{prefix}/{relative}"] = _file(path.read_bytes(), _TYPES[path.suffix])
                if prefix == "/player" and path.suffix == ".js" and not relative.startswith("vendor/"):
                    names[f"motionmind/{relative.removesuffix('.js')}"] = f"/player/{relative}"
    modules = msgspec.json.encode({"imports": names}).decode().replace("<", "\\u003c")
    first = _loaded(files, names, "/page/begin.js")
    later = [path for path in _loaded(files, names, "/page/main.js") if path not in first]
    # A browser asks for six files at a time: what `begin.js` asks for would wait for all others.
    links = [f'<link rel="modulepreload" href="{path}">' for path in first]
    links += [f'<link rel="modulepreload" fetchpriority="low" href="{path}">' for path in later]
    preloads = "\n".join(links)
    index = Template((_PAGE / "index.html").read_text("utf-8")).substitute(modules=modules, preloads=preloads)
    files["/"] = _file(index.encode(), "text/html; charset=utf-8")
    digest = b64encode(hashlib.sha256(modules.encode()).digest()).decode("ascii")
    return Page(files, f"sha256-{digest}")


def _loaded(files: Mapping[str, File], names: Mapping[str, str], start: str) -> list[str]:
    """Return the paths of a module and of all that it needs, so that the page loads them at once, not in turn."""
    text = {path: file.data.decode() for path, file in files.items() if path.endswith(".js")}
    found, new = set[str](), {start}
    while new:
        found |= new
        new = {
            named
            for path in new
            for name in _IMPORT.findall(text[path])
            if (named := names.get(name) or posixpath.normpath(f"{posixpath.dirname(path)}/{name}")) in text
        } - found
    return sorted(found)


def _file(data: bytes, kind: str) -> File:
    return File(data, kind, f'"{hashlib.sha256(data).hexdigest()[:16]}"')
