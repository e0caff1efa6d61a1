"""The positions of a vocabulary that a transcription may use, with their names in scores."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy import SIDES
from motionmind.body.motion import Motion
from motionmind.errors import SkeletonError
from motionmind.notation import compose
from motionmind.notation.posture_line import Row, posture_row
from motionmind.notation.score import Score
from motionmind.transcription.angles import Positions, mirror_trunk, write_angles
from motionmind.transcription.bones import Bones
from motionmind.transcription.words import PLANTED


def read_positions(scores: Sequence[Score], bones: Bones) -> Mapping[str, Positions]:
    """Return the positions that the clips and the named postures of scores use.

    A position of both limbs becomes one of each, such as `fifth-leading` and `fifth-other`; one with modifiers has
    them in its name: `fifth-plie-leading`. A standing leg has the angles that it has where the position occurs first.

    Args:
        scores: the scores.
        bones: the bones of a transcription's body.

    Returns:
        The positions of each layer.

    Raises:
        FormatError: a score is invalid.
        SkeletonError: a score is of another body.
    """
    body = bones.body
    found: dict[str, dict[str, Floats]] = {layer: {} for layer in body.layers}
    for score in scores:
        if score.body is not body:
            raise SkeletonError(
                f"a vocabulary must be of the body {body.skeleton.name}; {score.path} is of {score.body.skeleton.name}"
            )
        for rows, motion in _danced(score):
            written = write_angles(bones, motion.rotations, 0.0)
            for row, degrees in zip(rows, written.degrees, strict=True):
                for (layer, joints), words in zip(body.layers.items(), row.words, strict=True):
                    sides = SIDES if body.paired(joints[0]) else ("",)
                    for side, words_of_side in zip(sides, words, strict=False):
                        word, is_right = _word(words_of_side, layer)
                        if word not in (*found[layer], "neutral"):
                            own = degrees[[body.named(joint, side) for joint in joints]]
                            found[layer][word] = mirror_trunk(own) if is_right else own
    return {
        layer: Positions(list(named), np.array(list(named.values())).reshape(-1, len(body.layers[layer]), 3))
        for layer, named in found.items()
    }


def _danced(score: Score) -> Iterator[tuple[list[Row], Motion]]:
    """Yield the rows and the movement of a score's clips, and of its named postures."""
    yield from compose.played(score)
    for name, phrase in score.postures.items():
        yield [posture_row(phrase)], compose.posture(score, name).as_motion()


def _word(text: str, layer: str) -> tuple[str, bool]:
    """Return the name of a position as one word, and whether it is led by the right."""
    words = text.replace(",", "").replace(".", "-").split()
    name = "-".join(word for word in words if word not in SIDES)
    return (f"{name}-{layer}" if name == PLANTED else name), "right" in words
