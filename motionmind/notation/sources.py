"""Finds the files that a score is made of, without parsing their content."""

from __future__ import annotations

from pathlib import Path
from unicodedata import normalize

from motionmind.formats.text import read_lines


def sources(path: Path) -> list[Path]:
    """List a score's file, the scores that it includes, and the body files beside them; resolved paths.

    Raises:
        FormatError: a file cannot be read.
    """
    waiting = [path.resolve()]
    found = set(waiting)
    for score in waiting:  # the list grows during the loop
        for line in read_lines(score):
            word, _, rest = normalize("NFC", line).partition("#")[0].replace("\t", " ").partition(" ")
            file = rest.split(" as ")[0].strip()
            if word == "include" or (word == "body" and file.endswith(".toml")):
                beside = (score.parent / file).resolve()
                if beside not in found:
                    found.add(beside)
                    waiting.append(beside)
    return waiting
