"""Write a transcription as the text of a score: its vocabulary, phrases that recur, and a clip."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.anatomy import SIDES
from motionmind.geometry import rotations as rot
from motionmind.transcription.angles import leads_left, mirror_trunk
from motionmind.transcription.moves import Move
from motionmind.transcription.recorded import Recorded
from motionmind.transcription.repeats import Call, Repeat, Rows
from motionmind.transcription.words import LINES, OPEN, PLANTED, angle_terms, free_name, limb_word, trunk_word

MAX_CALL_CHARS = 100  # of a line, after which the line of a call is continued


@dataclass
class Vocabulary:
    """The positions of one layer, by their definitions.

    Attributes:
        names: the name of each definition in use, in order.
        known: the names of positions of a given vocabulary, by their definitions.
        taken: names in use, or known.
        count: how many positions were named.
        recognized: how many of these are known.
    """

    names: dict[str, str] = field(default_factory=dict)
    known: dict[str, str] = field(default_factory=dict)
    taken: set[str] = field(default_factory=set)
    count: int = 0
    recognized: int = 0

    def __post_init__(self) -> None:
        self.taken |= set(self.known.values())

    def name(self, terms: str, word: str) -> str:
        """Return the name of a position; a new one is called `word`, with a number if that is taken."""
        self.count += 1
        self.recognized += terms in self.known
        if terms in self.known:
            self.names[terms] = self.known[terms]
        elif terms not in self.names:
            self.names[terms] = free_name(word, self.taken)
            self.taken.add(self.names[terms])
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
        self.vocabulary = {layer: Vocabulary(known=self._known(layer, recorded)) for layer in self.body.layers}
        points = self.body.skeleton.positions_and_tips(recorded.written.rotations[keys], np.zeros((len(keys), 3)))
        self.cells = [
            [
                self._limbs(layer, recorded.written.degrees[key], points[row], recorded.bears[key])
                if self.body.paired(joints[0])
                else self._trunk(layer, recorded.written.degrees[key], points[row])
                for layer, joints in self.body.layers.items()
            ]
            for row, key in enumerate(keys)
        ]

    def _limbs(self, layer: str, degrees: Floats, points: Floats, bears: Floats) -> str:
        """Return the cell of a pair of limbs, and add their positions to the vocabulary."""
        words = []
        for number, side in enumerate(SIDES):
            own = degrees[[self.body.named(joint, side) for joint in self.body.layers[layer]]]
            line = self._line(layer, points, side) * np.array([1.0 - 2.0 * number, 1.0, 1.0])
            bend = float(np.abs(degrees[self.body.named(LINES[layer][2], side)]).max())
            name = self.vocabulary[layer].name(self._terms(layer, own), limb_word(line, bend))
            words.append(f"{name} {PLANTED}" if layer == "legs" and bears[number] else name)
        return words[0] if words[0] == words[1] else " / ".join(words)

    def _trunk(self, layer: str, degrees: Floats, points: Floats) -> str:
        """Return the cell of the trunk or head, and add its position to the vocabulary, written for the left."""
        own = degrees[[self.body.named(joint, "") for joint in self.body.layers[layer]]]
        terms, image = self._terms(layer, own), self._terms(layer, mirror_trunk(own))
        vocabulary = self.vocabulary[layer]
        left = terms in vocabulary.known or (image not in vocabulary.known and bool(leads_left(own)))
        name = vocabulary.name(
            terms if left else image, trunk_word(self._line(layer, points, ""), float(own[:, 1].sum()))
        )
        return name if terms == image else f"{name} {'left' if left else 'right'}"

    def _known(self, layer: str, recorded: Recorded) -> dict[str, str]:
        """Return the names of a layer's given positions by their definitions; of several names the first."""
        out: dict[str, str] = {}
        for word, degrees in zip(*recorded.positions[layer], strict=True):
            out.setdefault(self._terms(layer, degrees), word)
        return out

    def _terms(self, layer: str, degrees: Floats) -> str:
        """Write the angles of a layer's joints [joints, 3] as a definition."""
        return angle_terms(self.body, layer, dict(zip(self.body.layers[layer], degrees, strict=True)))

    def _line(self, layer: str, points: Floats, side: str) -> Floats:
        """Return the unit vector along a part of the body [3]."""
        skeleton = self.body.skeleton
        first, last, _ = LINES[layer]
        joint, _, tip = last.partition("_")
        end = self.body.named(joint, side) + (len(skeleton) if tip else 0)
        along = points[end] - points[self.body.named(first, side)]
        return np.asarray(along / max(float(rot.norm(along)), 1e-9))

    def text(self, moves: Sequence[Move], tempo: float, name: str, title: str, repeats: Sequence[Repeat] = ()) -> str:
        """Return the score.

        Args:
            moves: the move to each key [K].
            tempo: counts per minute.
            name: name of the clip.
            title: title of the score.
            repeats: phrases that the clip calls, found in `rows`.
        """
        lines = [f"title   {title}", f"body    {self.body.skeleton.name}", f"tempo   {tempo:g}", ""]
        for layer, vocabulary in self.vocabulary.items():
            lines.append(layer)
            width = max(map(len, vocabulary.names.values()))
            lines += [f"  {word.ljust(width)} = {terms}" for terms, word in vocabulary.names.items()]
            if layer == "legs":
                lines.append(f"  {PLANTED.ljust(width)} = planted")
            lines.append("")
        calls: dict[int, tuple[int, list[str]]] = {}  # by their first rows: the row after them, and their lines
        for number, repeat in enumerate(repeats, start=1):
            called = f"phrase-{number}" + "-" * (name == f"phrase-{number}")
            lines += [f"phrase {called}{_in_brackets(map(_open_word, repeat.open))}"]
            lines += [*_in_columns(self._phrase(repeat, moves)), ""]
            for call in repeat.calls:
                given = [moves[call.start + row] for row in repeat.open]
                stop = call.start + call.times * repeat.length
                calls[call.start] = stop, _call_lines(called, call, given)
        table, row = list[list[str]](), 0
        while row < len(moves):
            if row in calls:
                row, call_lines = calls[row]
                table += [[line] for line in call_lines]
            else:
                table.append([str(moves[row]), *self._changed(row)])
                row += 1
        return "\n".join([*lines, f"clip {name}: {title}", *_in_columns(table)]) + "\n"

    def rows(self, moves: Sequence[Move]) -> Rows:
        """Return the keys and the moves to them by number, in which phrases can be found."""
        paired = [self.body.paired(joints[0]) for joints in self.body.layers.values()]
        images = [tuple(map(_other_side, row, paired)) for row in self.cells]
        cells, cell_images = _numbers([tuple(row) for row in self.cells], images)
        cells[0] = -1  # a start posture is not part of a phrase
        return Rows(cells, cell_images, *_numbers(moves, [move.mirrored() for move in moves]))

    def _phrase(self, repeat: Repeat, moves: Sequence[Move]) -> list[list[str]]:
        """Return the lines of a phrase; its first posture is written in full, for it follows any other."""
        rows = range(repeat.start, repeat.start + repeat.length)
        table = [[str(moves[row]), *self._changed(row)] for row in rows]
        table[0][1:] = self.cells[repeat.start]
        for row in repeat.open:
            table[row][0] = _open_word(row)
        return table

    def _changed(self, row: int) -> list[str]:
        """Return the cells of a key that differ from those before, and "" for the others."""
        before = self.cells[row - 1] if row else [""] * len(self.cells[row])
        return [new if new != old else "" for new, old in zip(self.cells[row], before, strict=True)]


def _in_columns(table: list[list[str]]) -> list[str]:
    """Return lines with their cells in columns; a line of one cell is the call of a phrase."""
    postures = [line for line in table if len(line) > 1]
    widths = [max(len(line[column]) for line in postures) for column in range(len(postures[0]) if postures else 0)]
    return [
        f"  {line[0]}"
        if len(line) == 1
        else ("  " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True))).rstrip(" |")
        if any(line[1:])
        else f"  {line[0]} |"
        for line in table
    ]


def _call_lines(name: str, call: Call, given: list[Move]) -> list[str]:
    """Return the lines of a phrase's call; one that ends in a comma is continued."""
    inside = [str(move.mirrored() if call.mirrored else move) for move in given]  # a call is mirrored with its moves
    text = name + _in_brackets(inside) + ", other side" * call.mirrored
    text += f", {call.times} times" if call.times > 1 else ""
    lines = [""]
    for part in text.split(", "):
        if lines[-1] and len(lines[-1]) + len(part) > MAX_CALL_CHARS:
            lines.append("  ")
        lines[-1] += part + ", "
    return [line.rstrip() for line in [*lines[:-1], lines[-1].removesuffix(", ")]]


def _in_brackets(words: Iterable[str]) -> str:
    """Return the words of a phrase's heading or call in brackets; "" if there are none."""
    inside = ", ".join(words)
    return f" ({inside})" if inside else ""


def _open_word(row: int) -> str:
    """Return the word that stands for the move to a phrase's row, counted from 0."""
    return f"{OPEN}-{row + 1}"


def _other_side(cell: str, paired: bool) -> str:
    """Return the mirror image of a cell that `ScoreWriter` wrote."""
    if paired:
        return " / ".join(reversed(cell.split(" / ")))
    name, _, side = cell.partition(" ")
    return f"{name} {'right' if side == 'left' else 'left'}" if side else name


def _numbers(items: Iterable[Hashable], images: Iterable[Hashable]) -> tuple[Ints, Ints]:
    """Number items and their mirror images, equal ones alike."""
    known: dict[Hashable, int] = {}
    own, other = (np.array([known.setdefault(item, len(known)) for item in each]) for each in (items, images))
    return own, other
