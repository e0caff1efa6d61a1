"""Named postures, to describe places in a corpus."""

from __future__ import annotations

from pathlib import Path

from motionmind.body.motion import Posture
from motionmind.bundled import bundled
from motionmind.corpus import store
from motionmind.names.finding import open_collection
from motionmind.names.spelling import Source


def named_postures(corpus: str, home: Path | None = None) -> dict[str, Posture]:
    """Return the named postures of a corpus; if it has none, those of the bundled corpora, as "ballet/tendu".

    Args:
        corpus: its name or folder.
        home: the folder of the user's corpora; None for the default folder.

    Raises:
        CorpusError: there is no such corpus.
        FormatError: it cannot be read.
    """
    own = _postures_of(corpus, home)
    if own:
        return own
    others = [name for name, place in store.list_corpora(home).items() if place.parent == bundled("corpora")]
    return {f"{name}/{posture}": one for name in others for posture, one in _postures_of(name, home).items()}


def _postures_of(corpus: str, home: Path | None) -> dict[str, Posture]:
    collection = open_collection(Source(corpus, "corpus", corpus), home)
    return {name: collection.posture(name) for name in collection.postures}
