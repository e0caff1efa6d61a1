"""Transcribe a recording into a score: the fewest postures between which the movement stays within a tolerance."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from motionmind._typing import Ints
from motionmind.arguments import check_flag, check_items, check_real, check_text, check_type
from motionmind.body.motion import Motion
from motionmind.ensemble.dancers import Dancer, Ensemble
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.notation.compose import compose
from motionmind.notation.read import LINE_WORDS, RESERVED_NAMES
from motionmind.notation.score import Score
from motionmind.transcription.bones import CM_PER_DEG, deviations
from motionmind.transcription.following import SLIDE_SHARE, Following, check_fineness
from motionmind.transcription.moves import Move, counts_of
from motionmind.transcription.recorded import Recorded, prepare
from motionmind.transcription.repeats import Repeat, find_repeats, models_of
from motionmind.transcription.takes import choose_phrases, find_takes, match_takes
from motionmind.transcription.text import ScoreWriter


class Deviation(msgspec.Struct, frozen=True):
    """The deviation of a score's movement from its recording, frame by frame.

    Attributes:
        degrees: by body part, the deviation of a bone's direction, the worst of the part in each frame.
        unwritten: by body part, the same of postures written out in full: what no score can say, such as a knee's twist
            or an angle beyond the joint's limit.
        centimetres: distance of the pelvis from its recorded place.
    """

    degrees: dict[str, list[float]]
    unwritten: dict[str, list[float]]
    centimetres: list[float]


@dataclass(frozen=True, eq=False)
class Transcription:
    """A recording as a score.

    Attributes:
        text: the score.
        tolerance: the deviation between its postures that was allowed, degrees.
        shortest: the least time from posture to posture, seconds.
        keys: its postures' frames in `recording` [K].
        fewest: the fewest postures that follow the recording; `keys` can be more, to write takes of a phrase alike.
        repeats: its phrases, with the rows that call them; row k is the posture of `keys[k]`.
        recognized: by body part, the share of positions that are of the given vocabulary.
        recording: the recording with the score's proportions, on a level floor; at most 30 frames a second.
        motion: the movement of the score.
        deviation: how far that deviates from the recording.
    """

    text: str
    tolerance: float
    shortest: float
    keys: Ints
    fewest: int
    repeats: list[Repeat]
    recognized: dict[str, float]
    recording: Motion
    motion: Motion
    deviation: Deviation

    def report(self) -> bytes:
        """Return the deviations as JSON, with the frames' rate and the numbers of the key frames."""
        return msgspec.json.encode(
            {
                "tolerance": self.tolerance,
                "frames_per_second": round(self.recording.fps, 6) if len(self.recording) > 1 else None,
                "keys": self.keys.tolist(),
                "deviation": self.deviation,
            }
        )

    def compared(self) -> Ensemble:
        """Return the recording and the score's movement as two dancers on one spot."""
        start = float(self.recording.root[0, 0]), float(self.recording.root[0, 2])
        return Ensemble(
            self.motion.name,
            (Dancer("recording", self.recording, start), Dancer("score", self.motion, start)),
        )


def transcribe(
    motion: Motion,
    tolerance: float = 6.0,
    *,
    shortest: float = 0.0,
    tempo: float | None = None,
    name: str = "",
    repeats: bool = True,
    vocabulary: Sequence[Score] = (),
) -> Transcription:
    """Transcribe a recording into a score.

    The score has the fewest postures such that its movement, each bone turning evenly from posture to posture, follows
    every frame within the tolerance; this is proven, as a shortest path over all frames. Of equally few postures, those
    where the body moves least are chosen. Phrases that recur may add postures if they save lines: later takes, mirrored
    or not, are written in the postures of the first, within the same tolerance.

    Args:
        motion: the recording of a person.
        tolerance: greatest deviation of a bone's direction, degrees; the pelvis may be off by half as many centimetres,
            and the ends of short bones, too. The deviation of the postures themselves, as a score can write them, comes
            on top (`Deviation.unwritten`).
        shortest: least seconds from posture to posture, at most 3; where movement cannot be followed within the
            tolerance for so long, it is not followed.
        tempo: counts per minute; None for counts of one second.
        name: name of the score's clip; "" for the motion's.
        repeats: whether phrases that recur become phrases of the score, if it has up to 2,000 postures.
        vocabulary: scores whose positions are used, by their names, where they are within half the tolerance.

    Raises:
        MotionMindError: the tolerance, the time or the tempo is out of range, or the recording lasts more than 10
            minutes.
        SkeletonError: the movement is not of a person, or a score of the vocabulary is of another body.

    >>> import numpy as np
    >>> from motionmind import Motion, human23
    >>> from motionmind.transcription import transcribe
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (31, 23, 1))
    >>> still = Motion(human23(), at_rest, np.zeros((31, 3)), np.arange(31) / 30.0, "still")
    >>> len(transcribe(still).keys)
    2
    """
    check_type("motion", motion, Motion)
    check_real("tempo", tempo, or_none=True)
    check_text("name", name)
    check_flag("repeats", repeats)
    check_items("vocabulary", vocabulary, "scores", Score)
    check_fineness(tolerance, shortest)
    counts = 60.0 if tempo is None else tempo  # a count is a second where no tempo is known
    if not 1.0 <= counts <= 6000.0:
        raise MotionMindError(f"a tempo must be from 1 to 6000 counts per minute, not {counts:g}")
    recorded = prepare(motion, tolerance, vocabulary)
    following = Following(recorded, tolerance, shortest)
    fewest = following.fewest_keys(0, len(recorded.root))
    choices = [(recorded, fewest)]
    matched = repeats and not shortest  # takes are matched at frames of their own, which may be nearer to each other
    if matched and (phrases := choose_phrases(find_takes(following, fewest), fewest, len(recorded.root))):
        choices.append(match_takes(following, fewest, phrases, tolerance))
    clip, title = _clip_name(name or motion.name), _title(motion.name)
    drafts = [_draft(*choice, tolerance, counts, clip, title, repeats) for choice in choices]
    best = min(drafts, key=lambda draft: len(draft.keys) - sum(each.saved for each in draft.repeats))
    composed = _compose(best.text)
    return Transcription(
        best.text,
        tolerance,
        shortest,
        best.keys,
        len(fewest),
        best.repeats,
        best.recognized,
        recorded.motion,
        composed,
        _deviation(recorded, composed),
    )


class _Draft(NamedTuple):
    keys: Ints
    repeats: list[Repeat]
    recognized: dict[str, float]
    text: str


def _draft(
    recorded: Recorded, keys: Ints, tolerance: float, tempo: float, clip: str, title: str, repeats: bool
) -> _Draft:
    """Write a score with given keys."""
    writer, moves = ScoreWriter(recorded, keys), _moves(recorded, keys, tempo)
    still = _compose(writer.text(moves, tempo, clip, title))
    models = models_of(find_repeats(writer.rows(moves)) if repeats else [])
    travel = _travel(recorded, keys, still, tolerance, models)
    moves = [move._replace(left=left, ahead=ahead) for move, (left, ahead) in zip(moves, travel, strict=True)]
    found = find_repeats(writer.rows(moves)) if repeats else []
    recognized = {layer: words.recognized / words.count for layer, words in writer.vocabulary.items()}
    return _Draft(keys, found, recognized, writer.text(moves, tempo, clip, title, found))


def _clip_name(name: str) -> str:
    """Return a name that a score allows, from a motion's."""
    word = "".join(one if one.isalnum() else "-" for one in Path(name).name).strip("-")
    is_free = word and not word[0].isdigit() and word not in (*LINE_WORDS, *RESERVED_NAMES)
    return word if is_free else f"clip-{word}".rstrip("-")


def _title(name: str) -> str:
    """Return a motion's name as a score's title: on one line, without a comment or a continuation."""
    return " ".join(name.replace("#", " ").split()).rstrip(",") or "A recording"


def _moves(recorded: Recorded, keys: Ints, tempo: float) -> list[Move]:
    """Return the moves to the keys at `tempo` counts per minute, without travel."""
    facing, up = recorded.written.facing, recorded.up
    per_frame = tempo / (60.0 * recorded.motion.fps) if len(recorded.motion) > 1 else 0.0
    moves = [Move("start", face=int(facing[keys[0]]), up=int(up[keys[0]]))]
    for before, key in pairwise(keys.tolist()):
        turn = int((facing[key] - facing[before] + 180) % 360) - 180
        half = turn == -180  # a turn is less, and has a side
        moves.append(
            Move(
                counts_of(key - before, per_frame),
                turn=0 if half else turn,
                face=int(facing[key]) if half else None,
                up=int(up[key]),
            )
        )
    return moves


def _travel(
    recorded: Recorded, keys: Ints, composed: Motion, tolerance: float, models: Mapping[int, tuple[int, bool]]
) -> list[tuple[int, int]]:
    """Return the travel to write for each key's move, centimetres to the left and ahead of the body.

    A standing foot keeps its place, so its slip in the recording is written only where it adds up. A row that repeats
    another travels as that does, unless the slip adds up.

    Args:
        recorded: the recording.
        keys: its key frames [K].
        composed: the score's movement without any travel written.
        tolerance: of the score, degrees.
        models: the rows that others repeat, and whether on the other side.
    """
    slip = SLIDE_SHARE * CM_PER_DEG * tolerance
    missing = 100.0 * ((recorded.root[keys] - recorded.root[keys[0]]) - (composed.root - composed.root[0]))[:, [0, 2]]
    facing = np.radians(recorded.written.facing[keys])
    stays = np.zeros(len(keys), dtype=np.bool_)
    stays[1:] = (recorded.bears[keys[1:]] & recorded.bears[keys[:-1]]).any(axis=1)
    written, out = np.zeros(2), [(0, 0)]
    for row in range(1, len(keys)):
        sine, cosine = np.sin(facing[row]), np.cos(facing[row])
        ways = np.array([[cosine, -sine], [sine, cosine]])  # to the left and ahead
        x, z = missing[row] - written
        own = ways @ (x, z)
        choices = [(0, 0)] if stays[row] else []
        if row in models:
            model, mirrored = models[row]
            left, ahead = out[model]
            choices.insert(0, (-left if mirrored else left, ahead))
        near = [choice for choice in choices if np.hypot(*(own - choice)) <= slip]
        left, ahead = near[0] if near else (round(float(own[0])), round(float(own[1])))
        written += (left, ahead) @ ways
        out.append((left, ahead))
    return out


def _compose(text: str) -> Motion:
    """Compose the only clip of a score's text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "transcribed.score"
        path.write_text(text, encoding="utf-8")
        return compose(path)


def _deviation(recorded: Recorded, composed: Motion) -> Deviation:
    """Return how far the score's movement deviates from the recording."""
    motion, bones = recorded.motion, recorded.bones
    played = composed.at(composed.times[0] + (motion.times - motion.times[0]))
    directions = bones.directions(motion.rotations)
    start = (motion.root[0] - played.root[0]) * [1.0, 0.0, 1.0]
    degrees, unwritten = (
        {layer: np.round(each[:, own].max(axis=1), 2).tolist() for layer, own in bones.layers.items()}
        for each in (
            deviations(bones.directions(played.rotations), directions),
            deviations(bones.directions(recorded.writable), directions),
        )
    )
    far = 100.0 * rot.norm(played.root + start - motion.root)
    return Deviation(degrees, unwritten, np.round(far, 2).tolist())
