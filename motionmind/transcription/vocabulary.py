"""The positions of a vocabulary that a transcription may use, with their names in scores."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy import SIDES, Anatomy
from motionmind.body.motion import Motion
from motionmind.errors import SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.notation import compose
from motionmind.notation.posture_line import Row, posture_row
from motionmind.notation.score import Score
from motionmind.transcription.angles import Positions, mirror_trunk
from motionmind.transcription.words import PLANTED


def read_positions(scores: Sequence[Score], body: Anatomy) -> Mapping[str, Positions]:
    """Return the positions that the clips and the named postures of scores use.

    A position of both limbs becomes one of each, such as `fifth-leading` and `fifth-other`; one with modifiers has
    them in its name: `fifth-plie-leading`. A standing leg has the angles that it has where the position occurs first.

    Args:
        scores: the scores.
        body: the body of the transcription.

    Returns:
        The positions of each layer.

    Raises:
        FormatError: a score is invalid.
        SkeletonError: a score is of another body.
    """
    found: dict[str, dict[str, Floats]] = {layer: {} for layer in body.layers}
    for score in scores:
        if score.body is not body:
            raise SkeletonError(
                f"a vocabulary must be of the body {body.skeleton.name}; {score.path} is of {score.body.skeleton.name}"
            )
        for layer, word, degrees in _uses(score, body):
            found[layer].setdefault(word, degrees)
    return {
        layer: Positions(list(named), np.array(list(named.values())).reshape(-1, len(body.layers[layer]), 3))
        for layer, named in found.items()
    }


def _uses(score: Score, body: Anatomy) -> Iterator[tuple[str, str, Floats]]:
    """Yield each use of a position in the clips and the named postures of a score: its layer, name and angles."""
    for rows, motion in _danced(score):
        for row, degrees in zip(rows, _degrees_ahead(body, motion.rotations), strict=True):
            for (layer, joints), (left, right) in zip(body.layers.items(), row.words, strict=True):
                for side, words in (("left", left), ("right", right)) if body.paired(joints[0]) else (("", left),):
                    if words != "neutral":
                        word, is_right = _word(words, layer)
                        own = degrees[[body.named(joint, side) for joint in joints]]
                        yield layer, word, mirror_trunk(own) if is_right else own


def _danced(score: Score) -> Iterator[tuple[list[Row], Motion]]:
    """Yield the rows and the movement of a score's clips, and of its named postures."""
    yield from compose.played(score)
    for name, phrase in score.postures.items():
        yield [posture_row(phrase)], compose.posture(score, name).as_motion()


def _degrees_ahead(body: Anatomy, rotations: Floats) -> Floats:
    """Return the angles of composed postures [T, J, 3], whole degrees; the pelvis's turn is left to the facing."""
    turn = body.degrees_of(np.array([0]), rotations)[:, 0, 1]
    ahead = rotations.copy()
    ahead[:, 0] = rot.mul(rot.about_vertical(-np.radians(turn)), ahead[:, 0])
    degrees = np.round(body.degrees(ahead)) + 0.0  # no -0.0
    degrees[:, 0, 1] = 0.0
    return degrees


def _word(text: str, layer: str) -> tuple[str, bool]:
    """Return the name of a position as one word, and whether it is led by the right."""
    words = text.replace(",", "").replace(".", "-").split()
    name = "-".join(word for word in words if word not in SIDES)
    return (f"{name}-{layer}" if name == PLANTED else name), "right" in words
