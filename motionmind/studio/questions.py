"""Hashes of the questions at seams; the project stores answers under them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import msgspec

from motionmind.studio.asks import Ask
from motionmind.studio.neighbours import MIRRORED, End


def question_of(ends: tuple[End, End], ask: Ask, corpus: str, versions: Mapping[str, str]) -> str:
    """Return the hash, in hexadecimal, of everything that the answer at a seam depends on.

    Args:
        ends: both sides of the seam.
        ask: the request.
        corpus: name of the corpus that judges.
        versions: the version of each corpus that the project uses, by name.
    """
    names = {key.lstrip(MIRRORED).partition("/")[0] for key in _keys(ends, ask)} | {corpus}
    used = sorted((name, versions[name]) for name in names if name in versions)
    asked = msgspec.to_builtins(ask)
    for name in ("reaches", "travel"):
        if not asked[name]:
            del asked[name]  # so that answers from before there was such a request stay valid
    return hashlib.sha256(msgspec.json.encode([ends, asked, corpus, used])).hexdigest()[:32]


def _keys(ends: tuple[End, End], ask: Ask) -> list[str]:
    return [end.key for end in ends] + [one.posture for one in ask.passing]
