"""The positions of a vocabulary that a transcription may use, with their names in scores."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from motionmind._typing import Floats
from motionmind.body.anatomy import SIDES, Anatomy
from motionmind.body.motion import Motion
from motionmind.errors import FormatError, SkeletonError
from motionmind.notation import compose
from motionmind.notation.posture_line import Row, posture_row
from motionmind.notation.score import Score
from motionmind.transcription.angles import Positions, mirror_trunk
from motionmind.transcription.words import OPEN, PLANTED, free_name


def read_positions(scores: Sequence[Score], body: Anatomy) -> Mapping[str, Positions]:
    """Return the positions that the clips and the named postures of scores use.

    A position of both limbs becomes one of each, such as `fifth-leading` and `fifth-other`; one with modifiers has
    them in its name: `fifth-plie-leading`. A leg that stands has the angles of its first use, and of two legs in one
    position without a side, the left one's. Of several scores with one name the first counts.

    Args:
        scores: the scores.
        body: the body of the transcription.

    Returns:
        The positions of each layer.

    Raises:
        FormatError: a score is invalid, or has neither clips nor named postures.
        SkeletonError: a score is of a body with other joints.
    """
    found: dict[str, dict[str, Floats]] = {layer: {} for layer in body.layers}
    for score in scores:
        if not (score.clips or score.postures):
            raise FormatError("a vocabulary needs clips or postures, which use its positions", path=score.path)
        if (score.body.skeleton.names, score.body.layers) != (body.skeleton.names, body.layers):
            raise SkeletonError(
                f"a vocabulary must have the joints of {body.skeleton.name}; {score.path} is of "
                f"{score.body.skeleton.name}"
            )
        for layer, text, degrees in _uses(score):
            found[layer].setdefault(text, degrees)
    return {
        layer: Positions(_one_word_each(layer, used), np.array(list(used.values())).reshape(-1, len(joints), 3))
        for (layer, joints), used in zip(body.layers.items(), found.values(), strict=True)
    }


def _uses(score: Score) -> Iterator[tuple[str, str, Floats]]:
    """Yield each use of a position in the clips and the named postures of a score.

    Yields:
        The layer; the words that matter, without sides, `neutral` or a leg that is planted; and the angles.
    """
    body = score.body
    for rows, motion in _danced(score):
        for row, degrees in zip(rows, _degrees_ahead(body, motion.rotations), strict=True):
            for (layer, joints), (left, right) in zip(body.layers.items(), row.words, strict=True):
                for side, text in (("left", left), ("right", right)) if body.paired(joints[0]) else (("", left),):
                    words = [word for word in text.split() if not _is_left_out(score, layer, word)]
                    if words:
                        own = degrees[[body.named(joint, side) for joint in joints]]
                        yield layer, " ".join(words), mirror_trunk(own) if "right" in text.split() else own


def _is_left_out(score: Score, layer: str, word: str) -> bool:
    position = score.positions.get(layer, {}).get(word)
    return word in (*SIDES, "neutral") or (position is not None and set(position.lead) == {"planted"})


def _one_word_each(layer: str, texts: Iterable[str]) -> list[str]:
    """Return a name of one word for each position; none is a word with a meaning of its own in a transcription."""
    out = list[str]()
    for text in texts:
        word = text.replace(",", "").replace(".", "-").replace(" ", "-")
        if word == PLANTED or word.startswith(f"{OPEN}-"):
            word += f"-{layer}"
        out.append(free_name(word, out))
    return out


def _danced(score: Score) -> Iterator[tuple[list[Row], Motion]]:
    """Yield the rows and the movement of a score's clips, and of its named postures."""
    yield from compose.played(score)
    for name, phrase in score.postures.items():
        yield [posture_row(phrase)], compose.posture(score, name).as_motion()


def _degrees_ahead(body: Anatomy, rotations: Floats) -> Floats:
    """Return the angles of composed postures [T, J, 3], whole degrees; the pelvis's turn is left to the facing."""
    degrees = np.round(body.degrees(rotations)) + 0.0  # no -0.0
    degrees[:, 0, 1] = 0.0
    return degrees
