"""--music and --offset: counts by the beats of music, and the sound of films and pages."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from click_tracks import at_tempo, clicks, onsets
from command_line import Run

from motionmind import TweenRequest, read_motion, write_motion
from motionmind.cli.music import in_seconds
from motionmind.music import Beats, Sound, read_sound

BEATS = [0.4, 1.0, 1.7, 2.2, 2.7, 3.5, 4.1, 4.6, 5.1, 5.6]  # seconds: uneven, with an upbeat


def text_of_beats(folder: Path) -> Path:
    path = folder / "beats.txt"
    path.write_text("\n".join(f"{time} {1 + (number - 1) % 4}" for number, time in enumerate(BEATS)))
    return path


def sound_in(page: Path) -> Sound:
    """Return the sound that a page holds."""
    found = re.search(r'"sound":"([^"]*)"', page.read_text())
    assert found
    path = page.with_suffix(".flac")
    path.write_bytes(base64.b64decode(found[1]))
    return read_sound(path)


def test_counts_of_music_set_the_length_and_the_time_of_a_via(run: Run, tmp_path: Path) -> None:
    music = text_of_beats(tmp_path)
    words = ["tween", "ballet/arabesque", "ballet/fifth", "--music", music, "--counts", 4, "--report", "-"]
    done = run(*words, "--via", "ballet/passe@count3", "-o", tmp_path / "a.json")
    asked = json.loads(done.out)["asked"]
    assert asked["duration"] == pytest.approx(3.5 - 1.0)  # count 1 is the downbeat
    assert asked["via"] == ["1.2s"]
    motion = read_motion(tmp_path / "a.json")
    assert motion.times[-1] == pytest.approx(2.5)
    later = run(*words, "--offset", 2.0)
    assert json.loads(later.out)["asked"]["duration"] == pytest.approx(4.6 - 2.2)


def test_accents_come_at_the_counts_of_music(run: Run, tmp_path: Path) -> None:
    words = ["tween", "ballet/arabesque", "ballet/fifth", "--music", text_of_beats(tmp_path), "--counts", 6]
    done = run(*words, "--accent", "2,4", "--report", "-")
    report = json.loads(done.out)
    assert report["asked"]["accent"] == ["0.700000s", "1.700000s"]
    assert [(one["count"], one["seconds"]) for one in report["accented"]] == [(None, 0.7), (None, 1.7)]
    assert all(one["frames"] is not None for one in report["accented"])
    early = run(*words, "--accent", "0.5")
    assert (early.code, early.out) == (2, "")
    assert "--accent: counts begin with 1, which is A, not with 0.5" in early.err
    late = run(*words, "--accent", "2,7.5")
    assert "--accent: count 7.5 is after B, which is at count 7\n" in late.err
    unordered = run(*words, "--accent", "3,2")
    assert "--accent: the counts 3, 2 must increase" in unordered.err


@pytest.mark.parametrize("seed", range(20))
def test_the_last_count_of_music_can_have_an_accent(seed: int) -> None:
    rng = np.random.default_rng(seed)
    beats = Beats(np.cumsum(rng.uniform(0.3, 0.9, 12)))
    given = {"counts": 8.0, "duration": None, "via": [], "accent": [3.0, 9.0]}
    request = TweenRequest(**in_seconds(given, beats))
    assert request.accents is not None
    assert request.accents.seconds == pytest.approx([beats.seconds(3), beats.seconds(9)], abs=1e-6)


@pytest.mark.long
def test_a_part_of_a_clip_is_shown_with_its_part_of_the_music(run: Run, tmp_path: Path) -> None:
    at = at_tempo(93.7, 0.4, 39.0)
    (tmp_path / "song.wav").write_bytes(clicks(at, 40.0).encode("WAV"))
    motion = ballet_clip("adagio").resample(10.0)
    write_motion(tmp_path / "clip.bvh", motion)
    words = ["render", tmp_path / "clip.bvh", "--from", 20, "--to", 80, "-o", tmp_path / "a.html"]
    run(*words, "--music", tmp_path / "song.wav", "--offset", 1.5)
    sound = sound_in(tmp_path / "a.html")
    assert sound.seconds == pytest.approx(6.0, abs=1e-4)
    expected = at[(at > 3.5) & (at < 9.45)] - 3.5
    assert onsets(sound)[: len(expected)] == pytest.approx(expected, abs=0.002)


@pytest.mark.long
def test_the_sound_beside_a_clip_goes_with_it(run: Run, tmp_path: Path) -> None:
    write_motion(tmp_path / "clip.bvh", ballet_clip("adagio").resample(10.0).slice(0, 41))
    run("render", tmp_path / "clip.bvh", "-o", tmp_path / "silent.html")
    assert '"sound":' not in (tmp_path / "silent.html").read_text()
    at = np.array([0.5, 1.5, 2.25])
    (tmp_path / "clip.wav").write_bytes(clicks(at, 4.0).encode("WAV"))
    run("render", tmp_path / "clip.bvh", "--from", 10, "-o", tmp_path / "a.html", "-o", tmp_path / "a.gif")
    assert onsets(sound_in(tmp_path / "a.html")) == pytest.approx(at[1:] - 1.0, abs=0.002)


def test_faulty_music_is_refused_in_a_line(run: Run, tmp_path: Path) -> None:
    music = text_of_beats(tmp_path)
    (tmp_path / "back.txt").write_text("1\n3\n2\n")
    (tmp_path / "noise.wav").write_bytes(b"noise")
    tween = ["tween", "ballet/arabesque", "ballet/fifth", "--counts", 4]
    render = ["render", "ballet/adagio", "-o", tmp_path / "a.html"]
    for words, fault in [
        ([*tween, "--music", tmp_path / "back.txt"], "back.txt:3: 2 s after 3 s: beats must not go backwards"),
        ([*tween, "--music", music, "--offset", 60], "the last beat comes at 5.60 s, before 60 s"),
        ([*tween, "--music", music, "--duration", 2], "--counts takes the place of --duration"),
        ([*tween, "--music", music, "--tempo", 0], "tempo"),
        ([*tween, "--music", music, "--tempo", 100], "beats.txt says when its beats come; leave out --tempo"),
        (
            ["plan", "ballet/adagio", "-o", tmp_path / "a.svg", "--music", "song.mid", "--tempo", 100],
            "song.mid says when its beats come",
        ),
        ([*tween, "--offset", 1], "--offset needs --music"),
        ([*render, "--music", tmp_path / "noise.wav"], "cannot be read as sound"),
        ([*render, "--music", music], "is no sound file"),
        ([*render, "--music", tmp_path / "noise.wav", "-o", tmp_path / "a.gif"], "is for .mp4 and .html files"),
    ]:
        done = run(*words)
        assert done.code == 2
        assert fault in done.err, done.err
        assert not (tmp_path / "a.html").exists()
