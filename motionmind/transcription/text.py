"""Write a transcription as the text of a score: its vocabulary, and a clip with one posture a line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.anatomy import SIDES
from motionmind.geometry import rotations as rot
from motionmind.transcription.angles import leads_left, mirror_trunk
from motionmind.transcription.recorded import Recorded
from motionmind.transcription.words import LINES, angle_terms, limb_word, trunk_word

PLANTED = "on"  # the position of a leg that bears weight
_Go = tuple[int, int]  # to the left and ahead, centimetres


@dataclass
class Vocabulary:
    """The positions of one layer, by their definitions.

    Attributes:
        names: the name of each definition, in order.
        taken: how often each word is in use.
    """

    names: dict[str, str] = field(default_factory=dict)
    taken: dict[str, int] = field(default_factory=dict)

    def name(self, terms: str, word: str) -> str:
        """Return the name of a position; a new one is called `word`, with a number if that is taken."""
        if terms not in self.names:
            self.taken[word] = number = self.taken.get(word, 0) + 1
            self.names[terms] = word if number == 1 else f"{word}-{number}"
        return self.names[terms]


class ScoreWriter:
    """Writes key frames of a recording as a score.

    Attributes:
        body: the body of the score.
        vocabulary: the positions of each layer.
        cells: of each key, the words of each layer.
    """

    def __init__(self, recorded: Recorded, keys: Ints) -> None:
        self.body = recorded.bones.body
        self.vocabulary = {layer: Vocabulary() for layer in self.body.layers}
        points = self.body.skeleton.positions_and_tips(recorded.written.rotations[keys], np.zeros((len(keys), 3)))
        self.cells = [
            [
                self._limbs(layer, recorded.written.degrees[key], points[row], recorded.stands[key])
                if self.body.paired(joints[0])
                else self._trunk(layer, recorded.written.degrees[key], points[row])
                for layer, joints in self.body.layers.items()
            ]
            for row, key in enumerate(keys)
        ]

    def _limbs(self, layer: str, degrees: Floats, points: Floats, stands: Floats) -> str:
        """Return the cell of a pair of limbs, and add their positions to the vocabulary."""
        words = []
        for number, side in enumerate(SIDES):
            angles = {joint: degrees[self.body.named(joint, side)] for joint in self.body.layers[layer]}
            line = self._line(layer, points, side) * np.array([1.0 - 2.0 * number, 1.0, 1.0])
            bend = float(np.abs(angles[LINES[layer][2]]).max())
            name = self.vocabulary[layer].name(angle_terms(self.body, layer, angles), limb_word(line, bend))
            words.append(f"{name} {PLANTED}" if layer == "legs" and stands[number] else name)
        return words[0] if words[0] == words[1] else " / ".join(words)

    def _trunk(self, layer: str, degrees: Floats, points: Floats) -> str:
        """Return the cell of the trunk or head, and add its position to the vocabulary, written for the left."""
        joints = self.body.layers[layer]
        own = degrees[[self.body.named(joint, "") for joint in joints]]
        left = bool(leads_left(own))
        terms, image = (
            angle_terms(self.body, layer, dict(zip(joints, each, strict=True))) for each in (own, mirror_trunk(own))
        )
        word = trunk_word(self._line(layer, points, ""), float(own[:, 1].sum()))
        name = self.vocabulary[layer].name(terms if left else image, word)
        return name if terms == image else f"{name} {'left' if left else 'right'}"

    def _line(self, layer: str, points: Floats, side: str) -> Floats:
        """Return the unit vector along a part of the body [3]."""
        skeleton = self.body.skeleton
        first, last, _ = LINES[layer]
        joint, _, tip = last.partition("_")
        end = self.body.named(joint, side) + (len(skeleton) if tip else 0)
        along = points[end] - points[self.body.named(first, side)]
        return np.asarray(along / max(float(rot.norm(along)), 1e-9))

    def text(self, recorded: Recorded, keys: Ints, go: Sequence[_Go], tempo: float, name: str, title: str) -> str:
        """Return the score.

        Args:
            recorded: the recording.
            keys: its key frames [K].
            go: the travel of each key's move, centimetres to the left and ahead.
            tempo: counts per minute.
            name: name of the clip.
            title: title of the score.
        """
        lines = [f"title   {title}", f"body    {self.body.skeleton.name}", f"tempo   {tempo:g}", ""]
        for layer, vocabulary in self.vocabulary.items():
            lines.append(layer)
            width = max(map(len, vocabulary.names.values()))
            lines += [f"  {word.ljust(width)} = {terms}" for terms, word in vocabulary.names.items()]
            if layer == "legs":
                lines.append(f"  {PLANTED.ljust(width)} = planted")
            lines.append("")
        lines.append(f"clip {name}: {title}")
        lines += self._rows(recorded, keys, go, tempo)
        return "\n".join(lines) + "\n"

    def _rows(self, recorded: Recorded, keys: Ints, go: Sequence[_Go], tempo: float) -> list[str]:
        """Return the clip's lines, in columns; unchanged cells stay empty."""
        facing = recorded.written.facing
        per_frame = tempo / (60.0 * recorded.motion.fps) if len(recorded.motion) > 1 else 0.0
        table = []
        before: list[str] = [""] * len(self.body.layers)
        for row, key in enumerate(keys):
            how = f"start face {facing[key]}"
            if row:
                how = _counts(int(key - keys[row - 1]), per_frame)
                turn = int((facing[key] - facing[keys[row - 1]] + 180) % 360) - 180
                if abs(turn) == 180:  # a turn is less, and has a side
                    how += f" face {facing[key]}"
                elif turn:
                    how += f" turn {abs(turn)} {'left' if turn > 0 else 'right'}"
            how += f" up {recorded.up[key]}" if recorded.up[key] else ""
            how += _go(go[row])
            cells = self.cells[row]
            table.append([how, *(new if new != old else "" for new, old in zip(cells, before, strict=True))])
            before = cells
        widths = [max(len(line[column]) for line in table) for column in range(len(table[0]))]
        return [
            ("  " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True))).rstrip(" |")
            if any(line[1:])
            else f"  {line[0]} |"
            for line in table
        ]


def _counts(frames: int, per_frame: float) -> str:
    """Write a duration in counts, as a fraction if that is exact."""
    exact = Fraction(frames * per_frame).limit_denominator(240)
    return str(exact) if abs(float(exact) - frames * per_frame) < 1e-9 else f"{frames * per_frame:.5f}"


def _go(go: _Go) -> str:
    """Write a move's travel."""
    left, ahead = go
    out = f" go {'ahead' if ahead > 0 else 'back'} {abs(ahead)}" if ahead else ""
    if left:
        out += f"{' ' if out else ' go '}{'left' if left > 0 else 'right'} {abs(left)}"
    return out
