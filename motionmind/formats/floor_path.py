"""Reads paths over a floor: text with a point x, z in each line, or an SVG file with one path, in metres."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice, pairwise

import numpy as np

from motionmind._typing import Floats
from motionmind.errors import FormatError, quoted
from motionmind.files import FilePath, name_of
from motionmind.formats.text import read_lines, to_number, to_numbers

MAX_FLOOR_POINTS = 10_000
N_CURVE_POINTS = 24  # of each curve
_SHAPE = re.compile(r"<(?:\w+:)?(path|polyline|line|polygon|circle|ellipse|rect)\b([^<>]*)>", re.DOTALL)
_DATA = {
    "path": re.compile(r"\bd\s*=\s*(\"[^\"]*\"|'[^']*')"),
    "polyline": re.compile(r"\bpoints\s*=\s*(\"[^\"]*\"|'[^']*')"),
}
_WORD = re.compile(r"\s*,?\s*([A-Za-z]|[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)")
_N_NUMBERS = {"M": 2, "L": 2, "H": 1, "V": 1, "Q": 4, "C": 6, "Z": 0}


def read_floor_path(path: FilePath) -> list[tuple[float, float]]:
    """Read the points x, z of a path over the floor, metres; z points to the audience, as y does in an SVG file.

    Args:
        path: a file that ends in .svg, with one path (commands M, L, H, V, C, Q and Z) or polyline; else text with two
            numbers in each line, separated by a comma or blanks. # begins a comment.

    Raises:
        FormatError: the file does not exist, or is neither; the message names the line or the command.
    """
    lines = read_lines(path)
    points = list(
        islice(
            _svg_points("\n".join(lines), path) if _is_svg(path, lines) else _points(lines, path), MAX_FLOOR_POINTS + 1
        )
    )
    if not points:
        raise FormatError("has no point of a path: give x and z in each line, metres", path=path)
    if len(points) > MAX_FLOOR_POINTS:
        raise FormatError(f"has more than {MAX_FLOOR_POINTS} points", path=path)
    return points


def _is_svg(path: FilePath, lines: list[str]) -> bool:
    """Return whether a file is SVG, by its name or its first line."""
    first = next((line.strip() for line in lines if line.strip()), "")
    return name_of(path).lower().endswith(".svg") or first.startswith("<")


def _points(lines: list[str], path: FilePath) -> Iterator[tuple[float, float]]:
    """Yield the points of a text file; a first line without numbers names its columns."""
    begun = False
    for number, line in enumerate(lines, start=1):
        words = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if not words:
            continue
        if not begun and [word.strip("\"'").lower() for word in words] == ["x", "z"]:
            begun = True
            continue
        begun = True
        if len(words) != 2:
            raise FormatError(f"{len(words)} values where x and z were expected", path=path, line=number)
        x, z = to_numbers(words, path, number)
        yield x, z


def _svg_points(text: str, path: FilePath) -> Iterator[tuple[float, float]]:
    """Yield the points of the one path of an SVG file."""
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    shapes = _SHAPE.findall(text)
    if len(shapes) != 1 or shapes[0][0] not in _DATA:
        names = ", ".join(dict.fromkeys(f"<{name}>" for name, _ in shapes)) or "no shape"
        raise FormatError(f"must hold one <path> or <polyline>, not {len(shapes)} shapes ({names})", path=path)
    if re.search(r"\btransform\s*=", text):
        raise FormatError("has a transform: apply it to the path's own points", path=path)
    kind, attributes = shapes[0]
    data = _DATA[kind].search(attributes)
    if data is None:
        raise FormatError(f"<{kind}> has no points", path=path)
    words = _words(data[1][1:-1], path)
    if kind == "polyline":
        words = ["M", *words]
    return _drawn(words, path)


def _words(data: str, path: FilePath) -> list[str]:
    """Split path data into commands and numbers."""
    words, at = [], 0
    data = data.strip()
    while at < len(data):
        found = _WORD.match(data, at)
        if found is None:
            raise FormatError(
                f"{quoted(data[at : at + 20].strip())} where a command or a number was expected", path=path
            )
        words.append(found[1])
        at = found.end()
    return words


def _drawn(words: list[str], path: FilePath) -> Iterator[tuple[float, float]]:
    """Yield the points of path data."""
    here, first, command, at, number = np.zeros(2), np.zeros(2), "", 0, 0
    while at < len(words):
        is_command = words[at].isalpha()
        if is_command:
            command = words[at]
            at += 1
            if command.upper() not in _N_NUMBERS:
                raise FormatError(f"command {command}: only M, L, H, V, C, Q and Z are read", path=path)
            if (command.upper() == "M") != (number == 0):
                raise FormatError("must be one path that begins with M and goes on without another", path=path)
        elif not command or command in "Zz":
            raise FormatError(f"{quoted(words[at])} where a command was expected", path=path)
        number += 1
        name, count = command.upper(), _N_NUMBERS[command.upper()]
        values = [to_number(word, path, 1) for word in words[at : at + count] if not word.isalpha()]
        at += count
        if len(values) < count:
            raise FormatError(f"command {command} needs {count} numbers", path=path)
        from_here = here if command.islower() else np.zeros(2)
        if name == "Z":
            yield float(first[0]), float(first[1])
            here = first
            continue
        if name in "HV":
            axis = "HV".index(name)
            end = here.copy()
            end[axis] = values[0] + from_here[axis]
            corners = np.array([here, end])
        else:
            corners = np.concatenate([here[None], from_here + np.reshape(values, (-1, 2))])
        for point in _curve(corners):
            yield float(point[0]), float(point[1])
        here = corners[-1]
        if name == "M":
            first, command = here, "l" if command == "m" else "L"


def _curve(corners: Floats) -> Floats:
    """Return points of a Bezier curve after its first one [N, 2]; a line has one."""
    if len(corners) == 2:
        return corners[1:]
    share = np.linspace(0.0, 1.0, N_CURVE_POINTS + 1)[1:, None]
    parts = list(corners)
    while len(parts) > 1:  # de Casteljau, for all shares at once
        parts = [(1.0 - share) * one + share * other for one, other in pairwise(parts)]
    return np.asarray(parts[0])
