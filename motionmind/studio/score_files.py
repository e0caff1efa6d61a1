"""Resolve `include` lines between uploaded scores: by name among the uploads, never by path."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from unicodedata import normalize

from motionmind.errors import FormatError

_MAX_SCORES = 100  # with all that they include


def take_together(file: str, name: str, others: Mapping[str, str]) -> dict[str, str]:
    """Copy a score and the scores that it includes into this folder, under new names.

    Args:
        file: the score.
        name: its original name.
        others: files of other uploaded scores, by their original names.

    Returns:
        Original names by new names, that of the score itself first.

    Raises:
        FormatError: it includes a score that was not uploaded, or a body file; names the file and the line.
    """
    here = {name: "score-0.score"}  # new names by original names
    files = {name: file, **{other: path for other, path in others.items() if other != name}}
    waiting = [name]
    while waiting:
        own = waiting.pop(0)
        text = []
        for number, line in enumerate(_lines(Path(files[own])), start=1):
            kept = line
            word, *rest = _heading(line).split(maxsplit=1) or [""]
            if word == "include" and rest:
                wanted, mark, alias = rest[0].partition(" as ")
                # The path is on the user's computer: uploads have only a name.
                included = PurePosixPath(wanted.strip().replace("\\", "/")).name
                if included not in files:
                    raise FormatError(f"includes {included:.60}: upload that score too", path=Path(own), line=number)
                if included not in here:
                    if len(here) == _MAX_SCORES:
                        raise FormatError(f"includes more than {_MAX_SCORES} scores", path=Path(own), line=number)
                    here[included] = f"score-{len(here)}.score"
                    waiting.append(included)
                kept = f"include {here[included]}{mark}{alias}"
            elif word == "body" and rest and rest[0].strip().endswith(".toml"):
                raise FormatError("uses a body file: upload a score for a built-in body", path=Path(own), line=number)
            text.append(kept)
        Path(here[own]).write_text("\n".join([*text, ""]), encoding="utf-8")
    return {place: own for own, place in here.items()}


def _lines(path: Path) -> list[str]:
    from motionmind.formats.text import read_lines

    return list(read_lines(path))


def _heading(line: str) -> str:
    """Return a line as the score reader sees it, if it is a heading; otherwise ""."""
    text = normalize("NFC", line).replace("\t", " ").partition("#")[0].rstrip()
    return "" if text[:1].isspace() else text
