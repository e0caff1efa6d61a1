"""Find the files that a score includes, without parsing their content."""

from __future__ import annotations

from pathlib import Path
from unicodedata import normalize

from motionmind.bundled import bundled
from motionmind.formats.text import read_lines


def sources(path: Path) -> list[Path]:
    """List a score's file, the scores that it includes, and their body files; resolved paths.

    Raises:
        FormatError: a file cannot be read.
    """
    waiting = [path.resolve()]
    found = set(waiting)
    for score in waiting:  # the list grows during the loop
        for line in read_lines(score):
            if not line.startswith(("include", "body")):  # most lines of most scores
                continue
            word, _, rest = normalize("NFC", line).partition("#")[0].replace("\t", " ").partition(" ")
            file = rest.split(" as ")[0].strip()
            if word == "include" or (word == "body" and file.endswith(".toml")):
                other = (place_of(score, file) if word == "include" else score.parent / file).resolve()
                if other not in found:
                    found.add(other)
                    waiting.append(other)
    return waiting


def place_of(score: Path, file: str) -> Path:
    """Return the path of an included file: beside the score, else the bundled CORPUS/NAME.score."""
    beside, bundle = score.parent / file, bundled("corpora") / file
    return bundle if not beside.is_file() and bundle.is_file() else beside
