"""Which files a score is made of, found without reading what they say."""

from __future__ import annotations

from pathlib import Path
from unicodedata import normalize

from motionmind.formats.text import read_lines


def sources(path: Path) -> list[Path]:
    """The score's file, those that it includes, and those of bodies beside them."""
    found = [path.resolve()]
    for score in found:  # it grows as it is read
        for line in read_lines(score):
            word, _, rest = normalize("NFC", line).partition("#")[0].replace("\t", " ").partition(" ")
            file = rest.split(" as ")[0].strip()
            if word == "include" or (word == "body" and file.endswith(".toml")):
                beside = (score.parent / file).resolve()
                found += [] if beside in found else [beside]
    return found
