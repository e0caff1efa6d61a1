"""A sheet of a variation's seams: each with the posture before it, the insertion, and the posture after it."""

from __future__ import annotations

from collections.abc import Sequence

from PIL import Image

from motionmind.errors import MotionMindError
from motionmind.render.sheet import Row, evenly, row_sheet
from motionmind.variation.review import Seam
from motionmind.variation.variation import Variation

MAX_SEAMS = 250  # on a sheet


def seam_sheet(variation: Variation, names: Sequence[str]) -> Image.Image:
    """Draw the seams of a variation as it stands.

    Args:
        variation: the variation.
        names: a name for each of the piece's postures [N].

    Raises:
        MotionMindError: there is no seam, or there are more than 250.
    """
    seams = variation.seams
    if not seams:
        raise MotionMindError("there is no seam to draw: the variation does not leave the piece's order")
    if len(seams) > MAX_SEAMS:
        raise MotionMindError(f"a sheet shows {MAX_SEAMS} seams at most, not {len(seams)}; --play draws one of them")
    motion, frames = variation.arrange()
    rows, most = [], 3  # postures of an insertion
    for seam in seams:
        first, last = int(frames[seam.at]), int(frames[seam.at + 1])
        inner = evenly(range(first, last + 1), most + 2)[1:-1] if seam.insertion else []
        captions = [f"{motion.times[frame] - motion.times[first]:.2f} s" for frame in inner]
        blanks = most - len(inner)
        rows.append(
            Row(
                f"seam {seam.number}, after posture {seam.at}: {_describe(seam)}",
                [first, *inner, *[None] * blanks, last],
                [names[seam.start], *captions, *[""] * blanks, names[seam.end]],
            )
        )
    return row_sheet(motion, rows)


def _describe(seam: Seam) -> str:
    """Return the state of a seam in a few words."""
    transition = seam.transition
    if transition is None:
        return "not judged"
    if not transition.is_abrupt:
        return "attested"
    if seam.insertion is None:
        return "abrupt, insertion discarded" if seam.decision == "discarded" else "abrupt, not smoothed"
    seconds = float(seam.insertion.motion.times[-1])
    return f"{seconds:.2f} s inserted, {seam.chosen} of {len(transition.candidates)}, {seam.decision}"
