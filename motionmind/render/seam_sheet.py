"""A sheet of a variation's seams: each with the posture before it, what is inserted, and the posture after it."""

from __future__ import annotations

from collections.abc import Sequence

from PIL import Image

from motionmind.errors import MotionMindError
from motionmind.render.sheet import Row, evenly, row_sheet
from motionmind.variation.review import Seam
from motionmind.variation.variation import Variation

MOST = 250  # seams on a sheet
_INSERTED = 3  # postures of an insertion that are drawn


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
    if len(seams) > MOST:
        raise MotionMindError(f"a sheet shows {MOST} seams at most, not {len(seams)}; --play draws one of them")
    motion, frames = variation.arrange()
    rows = []
    for seam in seams:
        first, last = int(frames[seam.at]), int(frames[seam.at + 1])
        inner = evenly(range(first, last + 1), _INSERTED + 2)[1:-1] if seam.insertion else []
        captions = [f"{motion.times[frame] - motion.times[first]:.2f} s" for frame in inner]
        blanks = _INSERTED - len(inner)
        rows.append(
            Row(
                f"seam {seam.number}, after posture {seam.at}: {_told(seam)}",
                [first, *inner, *[None] * blanks, last],
                [names[seam.start], *captions, *[""] * blanks, names[seam.end]],
            )
        )
    return row_sheet(motion, rows)


def _told(seam: Seam) -> str:
    """Say in a few words what is at a seam."""
    transition = seam.transition
    if transition is None:
        return "not judged"
    if not transition.is_abrupt:
        return "attested"
    if seam.insertion is None:
        return "abrupt, insertion discarded" if seam.decision == "discarded" else "abrupt, not smoothed"
    seconds = float(seam.insertion.motion.times[-1])
    return f"{seconds:.2f} s inserted, {seam.chosen} of {len(transition.candidates)}, {seam.decision}"
