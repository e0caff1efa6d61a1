"""The files of the page: its own modules and the player's, each read once, by path."""

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
_MEDIA_TYPES = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
}


class File(NamedTuple):
    """A public file, without user data.

    Attributes:
        data: its bytes.
        type: its media type.
        tag: its ETag, which changes with its bytes.
    """

    data: bytes
    type: str
    tag: str


class Page(NamedTuple):
    """The page.

    Attributes:
        files: all files by URL path. All paths but "/", the page itself, contain the page's version, so that a browser
            can cache the files forever.
        script: hash of the import map, the only inline script, for the page's Content-Security-Policy.
    """

    files: dict[str, File]
    script: str


def read_page() -> Page:
    """Read all files of the page."""
    own, players = _read(_PAGE), _read(Path(__file__).parents[1] / "render" / "player")
    index = Template((_PAGE / "index.html").read_text("utf-8"))
    tags = [(name, file.tag) for files in (own, players) for name, file in files.items()]
    version = hashlib.sha256(repr(tags).encode()).hexdigest()[:16]
    page, player = f"/page/{version}", f"/player/{version}"
    files = {f"{page}/{name}": file for name, file in own.items()}
    files |= {f"{player}/{name}": file for name, file in players.items()}
    names = {
        "three": f"{player}/vendor/three.module.min.js",
        "three/OrbitControls": f"{player}/vendor/OrbitControls.js",
    }
    for name in players:
        if name.endswith(".js") and not name.startswith("vendor/"):
            names[f"motionmind/{name.removesuffix('.js')}"] = f"{player}/{name}"
    modules = msgspec.json.encode({"imports": names}).decode().replace("<", "\\u003c")
    first = _loaded(files, names, f"{page}/begin.js")
    later = [path for path in _loaded(files, names, f"{page}/main.js") if path not in first]
    # A browser loads six files at a time: requests by `begin.js` would wait for all others.
    links = [f'<link rel="modulepreload" href="{path}">' for path in first]
    links += [f'<link rel="modulepreload" fetchpriority="low" href="{path}">' for path in later]
    preloads = "\n".join(links)
    whole = index.substitute(modules=modules, preloads=preloads, page=page)
    files["/"] = _file(whole.encode(), "text/html; charset=utf-8")
    digest = b64encode(hashlib.sha256(modules.encode()).digest()).decode("ascii")
    return Page(files, f"sha256-{digest}")


def _read(folder: Path) -> dict[str, File]:
    """Return a folder's files for browsers, by relative path."""
    return {
        path.relative_to(folder).as_posix(): _file(path.read_bytes(), _MEDIA_TYPES[path.suffix])
        for path in sorted(folder.rglob("*"))
        if path.suffix in _MEDIA_TYPES and not any(part.startswith((".", "node_modules")) for part in path.parts[-3:])
    }


def _loaded(files: Mapping[str, File], names: Mapping[str, str], start: str) -> list[str]:
    """Return the paths of a module and all its imports, which the page then loads in parallel."""
    text = {path: file.data.decode() for path, file in files.items() if path.endswith(".js")}
    found, new = set[str](), {start}
    while new:
        found |= new
        new = {
            named
            for path in new
            for name in re.findall(r'\b(?:from|import)\s*"([^"]+)"', text[path])
            if (named := names.get(name) or posixpath.normpath(f"{posixpath.dirname(path)}/{name}")) in text
        } - found
    return sorted(found)


def _file(data: bytes, kind: str) -> File:
    return File(data, kind, f'"{hashlib.sha256(data).hexdigest()[:16]}"')
