"""Prepare docstrings and signatures for readers: escape prose, hide private constructors, list each of the `**options`.

A function with `**options: Unpack[...]` lists them among its parameters, unless its docstring says "options: see ...".
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from typing import Any

from reference import public_names
from sphinx.util import logging
from sphinx.util.typing import stringify_annotation

import motionmind
from motionmind.corpus.gather import Gathering, gather
from motionmind.tween.request import SeamOptions, TweenOptions

_log = logging.getLogger(__name__)
_SPAN = re.compile(r"(`[^`]*`)")

# Classes that users construct. Functions return the others, so their constructors stay hidden.
CONSTRUCTED = {
    "Flow",
    "Insertion",
    "Motion",
    "Piece",
    "Posture",
    "SearchOptions",
    "Skeleton",
    "TweenRequest",
    "Velocity",
}

# By TypedDict: the dataclasses or the function that describe its options and hold their defaults.
_TWEEN = (motionmind.TweenRequest, motionmind.SearchOptions)
OWNERS: dict[type, tuple[Any, ...]] = {Gathering: (gather,), SeamOptions: _TWEEN, TweenOptions: _TWEEN}


# --- markup and signatures --------------------------------------------------------------------------------------------


def escape(text: str) -> str:
    """Escape prose that reStructuredText would read as markup or an address, but not `code` in backticks."""
    parts = _SPAN.split(text)
    parts[::2] = [re.sub(r"([|*@]|(?<=\w)_(?=\W|$))", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)


def escape_docstring(app: object, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Escape the prose of a docstring, but not its examples, each of which ends at an empty line."""
    is_example = False
    for number, line in enumerate(lines):
        is_example = bool(line.strip()) and (is_example or line.lstrip().startswith(">>> "))
        if not is_example:
            lines[number] = escape(line)


def show_signature(
    app: object, what: str, name: str, thing: Any, options: object, signature: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    """Hide the constructors of classes that users never construct; write out defaults that factories make."""
    if what == "class" and name.rpartition(".")[2] not in CONSTRUCTED:
        return "", None
    if what == "class" and signature and dataclasses.is_dataclass(thing):
        made = defaults(thing)
        signature = re.sub(r"SearchOptions\(.*?\)(?=[,)])", made.get("search", ""), signature)
        for one in dataclasses.fields(thing):
            if one.default_factory is not dataclasses.MISSING:
                signature = signature.replace("<factory>", made[one.name], 1)
    return signature, returns


# --- options ----------------------------------------------------------------------------------------------------------


def defaults(owner: Any) -> dict[str, str]:
    """Return the defaults of a dataclass's fields or a function's parameters, as written in Python."""
    values = {name: one.default for name, one in inspect.signature(owner).parameters.items()}
    if dataclasses.is_dataclass(owner):
        made = {one.name: one.default_factory for one in dataclasses.fields(owner)}
        values |= {name: make() for name, make in made.items() if make is not dataclasses.MISSING}
    plain = {name: f"{type(value).__name__}()" for name, value in values.items() if dataclasses.is_dataclass(value)}
    return {name: repr(value) for name, value in values.items()} | plain


def meanings(owner: Any) -> dict[str, str]:
    """Return the text of each item under `Args` or `Attributes` in a docstring."""
    section = re.search(r"^(?:Args|Attributes):\n((?:    .*\n|\n)+)", inspect.getdoc(owner) or "", re.M)
    items = re.findall(r"^    (\w+): (.*(?:\n        .*)*)", section[1] if section else "", re.M)
    return {name: escape(" ".join(text.split())) for name, text in items}


def types(options: type) -> dict[str, str]:
    """Return the types of the options of a TypedDict, with literals as their values."""
    hints = typing.get_type_hints(options, localns={name: getattr(motionmind, name) for name in motionmind.__all__})
    shown = {name: stringify_annotation(hint, "smart", short_literals=True) for name, hint in hints.items()}
    return {name: re.sub(r"~[\w.]+\.", "", text) for name, text in shown.items()}


def fields(options: type) -> Iterator[str]:
    """Yield reStructuredText's fields for the options of a TypedDict."""
    default, meaning = ({k: v for one in OWNERS[options] for k, v in of(one).items()} for of in (defaults, meanings))
    for name, type_ in types(options).items():
        if name not in meaning:
            _log.warning("docs/_extensions/docstrings.py: no docstring describes the option %s", name)
        yield f":param {escape(name)}: {meaning.get(name, '')}"
        yield f":type {escape(name)}: ``{type_}`` = ``{default[name]}``"


def add_options(app: object, what: str, name: str, thing: Any, options: object, lines: list[str]) -> None:
    """List a function's options after its `options:` line."""
    annotation = str(getattr(thing, "__annotations__", {}).get("options", ""))
    at = next((n for n, line in enumerate(lines) if re.match(r":param \S*options: (?!see )", line)), None)
    if at is None or not (unpacked := re.fullmatch(r"Unpack\[(\w+)\]", annotation)):
        return
    end = next((n for n, line in enumerate(lines) if n > at and not line.startswith(" ")), len(lines))
    lines[end:end] = fields({one.__name__: one for one in OWNERS}[unpacked[1]])


@cache
def public_paths() -> dict[str, str]:
    """Return the path from which to import each public name, by the path of its definition."""
    paths = {}
    for name in public_names():
        room, _, last = f"motionmind.{name}".rpartition(".")
        thing = getattr(import_module(room), last)
        paths[f"{thing.__module__}.{last}"] = f"{room}.{last}"
    return paths


def shorten_types(app: object, what: str, name: str, thing: Any, options: object, lines: list[str]) -> None:
    """Shorten the types of attributes to their last names, with links to public ones."""
    for number, line in enumerate(lines):
        field, _, type_ = line.rpartition(": ")
        if field.startswith(":vartype "):
            short = re.sub(r"\b(?:\w+\.)+\w+", lambda path: f"~{public_paths().get(path[0], path[0])}", type_)
            lines[number] = f"{field}: {short}"


def setup(app: Any) -> dict[str, Any]:
    """Escape docstrings before napoleon reads their sections, and add options after that."""
    app.connect("autodoc-process-docstring", escape_docstring, priority=100)
    app.connect("autodoc-process-docstring", add_options, priority=900)
    app.connect("autodoc-process-docstring", shorten_types, priority=900)
    app.connect("autodoc-process-signature", show_signature)
    return {"parallel_read_safe": True}
