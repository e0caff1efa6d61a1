"""Bundled movement for tests that need some, whatever it is."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from motionmind.body.motion import Motion
from motionmind.notation.compose import motions
from motionmind.notation.read import read_score

BALLET = Path(__file__).parents[1] / "corpora" / "ballet"


@cache
def ballet_clip(name: str) -> Motion:
    """A clip of the bundled ballet, a frame a posture."""
    for file in sorted(BALLET.glob("*.score")):
        score = read_score(file)
        found = [clip for clip in score.clips if clip.name == name]
        if found:
            return motions(score, found)[0]
    raise LookupError(name)
