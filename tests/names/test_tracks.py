"""The sound of named movement: of clips of scores, and beside files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click_tracks import clicks, onsets
from command_line import Run

from motionmind import compose, read_score, read_variation
from motionmind.errors import FormatError
from motionmind.music import read_sound
from motionmind.names.spelling import parse_posture
from motionmind.names.tracks import find_sound

AT = np.array([0.5, 1.5, 2.25])
SCORE = """title Bends
legs
  stand = stand out 10 turn 8
  bend = stand out 10 turn 8, bend 30
clip loud: With sound
  sound music/loud.wav  # from the first posture on
  start | stand
{lines}
clip still: Without
  start | stand
{lines}
"""
LINES = "\n".join("  1 | bend\n  1 | stand" for _ in range(8))


@pytest.fixture
def score(tmp_path: Path) -> Path:
    path = tmp_path / "bends.score"
    path.write_text(SCORE.format(lines=LINES), "utf-8")
    (tmp_path / "music").mkdir()
    (tmp_path / "music" / "loud.wav").write_bytes(clicks(AT, 20.0).encode("WAV"))
    return path


def found(word: str, clip: str | None = None) -> Path | None:
    return find_sound(parse_posture(word).source, clip)


def test_a_clip_of_a_score_names_its_sound_and_moves_as_without(score: Path) -> None:
    loud, still = read_score(score).clips
    assert (loud.sound, still.sound) == ("music/loud.wav", "")
    np.testing.assert_array_equal(compose(score, "loud").rotations, compose(score, "still").rotations)
    track = score.parent / "music" / "loud.wav"
    assert found(f"{score}/loud") == found(str(score), "loud") == track
    assert found(f"{score}/still") is None
    assert found(str(score)) is None  # of which clip?


def test_other_clips_have_the_sound_beside_their_file(score: Path) -> None:
    beside = score.with_suffix(".wav")
    beside.write_bytes(b"")
    assert found(f"{score}/still") == beside
    assert found(f"{score}/loud") != beside


@pytest.mark.parametrize("file", ["", "/tmp/a.wav", "../a.wav", "a/../../b.wav", "..\\a.wav"])
def test_a_sound_elsewhere_is_refused_in_its_line(score: Path, file: str) -> None:
    score.write_text(score.read_text("utf-8").replace("music/loud.wav  # from the first posture on", file), "utf-8")
    with pytest.raises(FormatError, match=r"bends.score:6: .* is not a file beside the score; write sound FILE"):
        read_score(score)


def test_a_clip_has_one_sound_and_lines_besides(score: Path) -> None:
    text = score.read_text("utf-8")
    score.write_text(text.replace("  start | stand", "  sound b.wav\n  start | stand", 1), "utf-8")
    with pytest.raises(FormatError, match=r"bends.score:7: a second sound; a clip has one"):
        read_score(score)
    score.write_text("clip empty: Nothing\n  sound a.wav\n", "utf-8")
    with pytest.raises(FormatError, match="clip empty has no lines"):
        read_score(score)


def test_a_missing_sound_is_said_and_nothing_is_written(score: Path, run: Run) -> None:
    (score.parent / "music" / "loud.wav").unlink()
    for words in (["render"], ["vary", "--depart", 0.2, "--sound", "own"]):
        said = run(*words, f"{score}/loud", "-o", "a.html")
        assert (said.code, said.out) == (2, "")
        assert "clip loud: there is no sound file" in said.err
        assert not Path("a.html").exists()
    assert run("render", f"{score}/loud", "-o", "a.png").code == 0


@pytest.mark.long
def test_the_sound_of_a_clip_of_a_score_is_kept_with_its_postures(score: Path, run: Run) -> None:
    assert run("render", f"{score}/loud", "-o", "a.html").code == 0
    assert '"sound":"' in Path("a.html").read_text("utf-8")
    assert run("render", f"{score}/still", "-o", "b.html").code == 0
    assert '"sound":"' not in Path("b.html").read_text("utf-8")
    assert run("vary", score, "--clip", "loud", "--nudge", 0, "--sound", "own", "-o", "v.json").code == 0
    length = float(read_variation("v.json").motion().times[-1])
    sound = read_sound("v.wav")
    assert sound.seconds == pytest.approx(length, abs=1e-3)
    assert onsets(sound) == pytest.approx(AT, abs=0.005)
    refused = run("vary", f"{score}/still", "--depart", 0.2, "--sound", "own", "-o", "w.json")
    assert refused.code == 2
    assert "or a clip of a score that names its sound" in refused.err
