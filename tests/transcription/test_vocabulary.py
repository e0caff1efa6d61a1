"""Positions of a given vocabulary in transcriptions."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind import read_score
from motionmind._typing import Floats
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.motion import Motion
from motionmind.bundled import bundled
from motionmind.errors import SkeletonError
from motionmind.notation.compose import compose
from motionmind.notation.score import Score
from motionmind.transcription import transcribe
from motionmind.transcription.angles import _merge, write_angles
from motionmind.transcription.bones import Bones, deviations
from motionmind.transcription.text import Vocabulary
from motionmind.transcription.vocabulary import read_positions

HUMAN = anatomy_named("human23")
BONES = Bones.of(HUMAN)
DANCE = """title  Two bows
body   human23
legs
  on        = stand out 10 turn 8
  stork-leg = hip flexion 60, knee flexion 80
  stork     = stork-leg / on
  deep      = bend 30
arms
  low   = shoulder abduction 12
  wide  = shoulder abduction 80, elbow flexion 20
  ahead = shoulder flexion 80 inward 80
torso
  up    = neutral
  lean  = lumbar turn -12, thorax turn -8
head
  ahead = neutral
  aside = head turn 40

clip bows: Bow
  start | on | low | up | ahead
  1     | stork right deep | wide / low | lean left | aside right
  1     | on | ahead | lean right | aside left
  1     | on | low | up | ahead
"""


@cache
def ballet() -> tuple[Score, ...]:
    """The scores of ballet's clips."""
    return tuple(read_score(bundled("corpora") / "ballet" / f"{name}.score") for name in ("barre", "centre", "allegro"))


def own(folder: Path) -> Score:
    """A small score with positions that its transcription finds again."""
    path = folder / "bows.score"
    path.write_text(DANCE)
    return read_score(path)


def cells(text: str) -> list[list[str]]:
    """The cells of the postures of a transcription, below the heading of its clip."""
    _, _, clip = text.partition("\nclip ")
    return [[cell.strip() for cell in line.split("|")[1:]] for line in clip.splitlines()[1:]]


def test_a_dance_is_written_in_the_words_that_it_was_composed_of(tmp_path: Path) -> None:
    score = own(tmp_path)
    motion = compose(score.path, "bows")
    found = transcribe(motion.resample(30.0), 3.0, vocabulary=[score])
    rows = dict(zip(found.keys.tolist(), cells(found.text), strict=True))
    assert rows[0] == ["on-legs on / on-legs", "low", "up", "ahead"]
    assert rows[30] == ["stork-deep-other on / stork-deep-leading", "wide / low", "lean left", "aside right"]
    assert rows[60][1:3] == ["ahead", "lean right"]
    assert "aside left" in found.text
    assert rows[90] == ["on-legs on", "low", "up", "ahead"]
    assert found.recognized["head"] == 1.0
    assert 0.3 <= found.recognized["legs"] < 1.0  # of the keys, some are between counts


def test_a_clip_of_ballet_is_mostly_ballet_and_stays_within_the_tolerance() -> None:
    motion = ballet_clip("temps-lie").resample(30.0)
    plain, named = transcribe(motion, 12.0), transcribe(motion, 12.0, vocabulary=ballet())
    assert set(plain.recognized.values()) == {0.0}
    assert min(named.recognized.values()) > 0.6
    assert "tendu-front-leading" in named.text
    assert "tendu-front-leading" not in plain.text
    assert len(named.keys) < 1.3 * len(plain.keys)
    for layer, bones in BONES.layers.items():
        assert max(named.deviation.degrees[layer]) <= 2.0 * BONES.allowed(12.0)[bones].max()


def test_named_positions_are_the_nearest_within_half_the_tolerance() -> None:
    positions = read_positions(ballet(), HUMAN)["arms"]
    exact = write_angles(BONES, ballet_clip("temps-lie").resample(30.0).rotations, 0.0).degrees
    merged = exact.copy()
    _merge(BONES, "arms", merged, 4.0, positions)
    joints = [HUMAN.named(joint, "left") for joint in HUMAN.layers["arms"]]

    def towards(degrees: Floats) -> Floats:
        """Directions of the bones of the left arm alone."""
        alone = np.zeros((len(degrees), len(HUMAN.skeleton), 3))
        alone[:, joints] = degrees
        turned = HUMAN.rotations(dict(zip(HUMAN.skeleton.names, alone.swapaxes(0, 1), strict=True)))
        return BONES.directions(turned)

    taken = 0
    for before, after in zip(exact[:, joints], merged[:, joints], strict=True):
        off = (deviations(towards(positions.degrees), towards(before[None])) / BONES.allowed(4.0)).max(axis=1)
        is_known = (positions.degrees == after).all(axis=(1, 2))
        taken += is_known.any()
        if off.min() < 0.999:
            assert off[is_known].min() == pytest.approx(off.min())
        elif off.min() > 1.001:
            assert not is_known.any()
    assert 0.2 * len(exact) < taken < len(exact)


def test_the_named_postures_of_a_score_without_clips_are_a_vocabulary() -> None:
    positions = read_positions([read_score(bundled("corpora") / "ballet" / "vocabulary.score")], HUMAN)
    assert {"arabesque-leading", "arabesque-other", "passe-poised-leading"} <= set(positions["legs"].words)
    assert {"bas", "fifth", "second"} <= set(positions["arms"].words)


def test_a_transcription_is_the_vocabulary_of_another(tmp_path: Path) -> None:
    first = transcribe(ballet_clip("adagio").resample(30.0).slice(0, 400), 12.0)
    (tmp_path / "first.score").write_text(first.text)
    score = read_score(tmp_path / "first.score")
    words = {layer: set(positions.words) for layer, positions in read_positions([score], HUMAN).items()}
    assert not any(" " in word or word.startswith("on-") for word in words["legs"])
    again = transcribe(ballet_clip("adagio").resample(30.0).slice(0, 400), 12.0, vocabulary=[score])
    assert min(again.recognized.values()) > 0.9
    other = transcribe(ballet_clip("temps-lie").resample(30.0), 12.0, vocabulary=[score])
    assert 0.0 < other.recognized["legs"] < 1.0


def test_names_in_use_are_numbered_on() -> None:
    vocabulary = Vocabulary(known={"known": "down-2"})
    assert [vocabulary.name(terms, "down") for terms in ("a", "b", "known", "a")] == [
        "down",
        "down-3",
        "down-2",
        "down",
    ]
    assert (vocabulary.count, vocabulary.recognized) == (4, 1)


OWN = """title  Own
body   human23
arms
  MOVE-2    = shoulder flexion 30
  lib-first = shoulder flexion 60
  same      = shoulder flexion 60

posture moved = neutral | MOVE-2
posture first = neutral | lib-first
posture same  = neutral | same
"""


def test_names_that_mean_something_else_or_occur_twice_change(tmp_path: Path) -> None:
    (tmp_path / "lib.score").write_text("title Lib\nbody human23\narms\n  first = shoulder flexion 90\n")
    own = OWN.replace("arms\n", "include lib.score as lib\narms\n", 1) + "posture lib = neutral | lib.first\n"
    (tmp_path / "own.score").write_text(own)
    (tmp_path / "other.score").write_text(OWN.replace("flexion 30", "flexion 45"))
    scores = [read_score(tmp_path / name) for name in ("own.score", "other.score")]
    found = read_positions(scores, HUMAN)["arms"]
    assert list(found.words) == ["MOVE-2-arms", "lib-first", "same", "lib-first-2"]
    assert np.abs(found.degrees).max(axis=(1, 2)).tolist() == [30.0, 60.0, 60.0, 90.0]  # of two scores, the first's
    posed = HUMAN.rotations({name: np.tile([-60.0, 0.0, 0.0], (2, 1)) for name in ("left_shoulder", "right_shoulder")})
    still = Motion(HUMAN.skeleton, posed, np.zeros((2, 3)), np.array([0.0, 0.1]), "still")
    assert cells(transcribe(still, vocabulary=scores).text)[0][1] == "lib-first"  # and of two names, the first


def test_the_facing_is_not_part_of_a_position(tmp_path: Path) -> None:
    text = DANCE.replace("  1     | on | ahead", "  1 face 90 | on | ahead")
    (tmp_path / "a.score").write_text(text)
    (tmp_path / "b.score").write_text(DANCE)
    turned, ahead = (read_positions([read_score(tmp_path / name)], HUMAN) for name in ("a.score", "b.score"))
    for layer in HUMAN.layers:
        assert turned[layer].words == ahead[layer].words
        np.testing.assert_array_equal(turned[layer].degrees, ahead[layer].degrees)


def test_a_vocabulary_that_no_clip_uses_is_refused(run: Run) -> None:
    Path("defs.score").write_text("title D\nbody human23\narms\n  low = shoulder flexion 30\n")
    done = run("transcribe", "ballet/temps-lie", "-o", "t.score", "--vocabulary", "defs.score")
    assert done.code == 2
    assert done.err.startswith("error: defs.score: a vocabulary needs clips or postures")


def test_the_scores_of_a_vocabulary_are_not_overwritten(run: Run) -> None:
    Path("own.score").write_text(DANCE)
    before = Path("own.score").read_bytes()
    done = run("transcribe", "ballet/temps-lie", "-o", "own.score", "--vocabulary", "own.score")
    assert done.code == 2
    assert Path("own.score").read_bytes() == before


def test_a_vocabulary_of_another_body_is_refused(tmp_path: Path) -> None:
    motion = compose(own(tmp_path).path, "bows")
    insect = read_score(bundled("corpora") / "walk-hexapod" / "insect.score")
    with pytest.raises(
        SkeletonError, match=r"a vocabulary must have the joints of human23; .*insect\.score is of hexapod"
    ):
        transcribe(motion, vocabulary=[insect])


@pytest.mark.parametrize(
    ("word", "line"),
    [
        ("nothere", "nothere: there is no such file or corpus"),
        ("ballet/adagio", "--vocabulary ballet/adagio: give the whole score or corpus, ballet"),
        ("other.bvh", "--vocabulary other.bvh: holds no positions; give a score, or a corpus of scores"),
    ],
)
def test_what_is_no_vocabulary_is_refused_in_one_line(word: str, line: str, run: Run) -> None:
    assert run("compose", "ballet/centre.score", "--clip", "temps-lie", "-o", "other.bvh", "--fps", "30").code == 0
    done = run("transcribe", "other.bvh", "-o", "t.score", "--vocabulary", word)
    assert done.code == 2
    assert line in done.err
    assert len(done.err.splitlines()) == 1
    assert not Path("t.score").exists()


def test_the_command_prints_the_share_of_positions_in_the_vocabulary(run: Run) -> None:
    done = run("transcribe", "ballet/temps-lie", "-o", "t.score", "--tolerance", "12", "--vocabulary", "ballet")
    assert done.code == 0
    assert re.search(r"positions of the vocabulary: [89]\d% of legs, [67]\d% of arms, 100% of torso, 100%", done.out)
    assert "tendu-front-leading" in Path("t.score").read_text(encoding="utf-8")
