"""Beats: of sound, text and MIDI; counts among them; and what no file may say."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import mido
import numpy as np
import pytest
from click_tracks import at_tempo, clicks

from motionmind._typing import Floats
from motionmind.errors import FormatError, MotionMindError
from motionmind.music import Beats, read_beats, read_sound
from motionmind.music.beats import MAX_BEATS, beats_of_tempo
from motionmind.music.sound import Sound

FRAME_S = 1.0 / 30.0


def off(found: Floats, true: Floats) -> float:
    """Return how far found beats are off the true ones at most; infinite unless they are as many."""
    return float(np.abs(found - true).max()) if len(found) == len(true) else np.inf


def changing(first: float, then: float) -> Floats:
    """Return beats of a tempo for 15 s, then of another."""
    before = at_tempo(first, 0.5, 15.1)
    return np.concatenate([before, np.arange(before[-1] + 60.0 / then, 29.9, 60.0 / then)])


@pytest.mark.long
@pytest.mark.parametrize("suffix", ["wav", "flac", "ogg", "mp3"])
@pytest.mark.parametrize(
    "true",
    [
        pytest.param(at_tempo(93.7, 0.37, 29.9), id="93.7"),
        pytest.param(at_tempo(131.0, 0.05, 29.9), id="131"),
        pytest.param(at_tempo(160.0, 1.41, 29.9), id="160"),
        pytest.param(changing(93.7, 131.0), id="faster"),
        pytest.param(changing(131.0, 93.7), id="slower"),
    ],
)
def test_beats_of_a_click_track_are_found_within_a_frame(true: Floats, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"click.{suffix}"
    if suffix in ("wav", "flac"):
        path.write_bytes(clicks(true, 30.0).encode("WAV" if suffix == "wav" else "FLAC"))
    else:
        import soundfile

        sound = clicks(true, 30.0)
        soundfile.write(path, sound.samples, sound.rate)
    assert off(read_beats(path).times, true) < FRAME_S


@pytest.mark.long
def test_a_given_tempo_tells_beats_from_half_as_many(tmp_path: Path) -> None:
    true, path = at_tempo(190.0, 0.3, 29.9), tmp_path / "fast.wav"
    path.write_bytes(clicks(true, 30.0, noise=0.02).encode("WAV"))
    assert len(read_beats(path)) < 0.6 * len(true)
    assert off(read_beats(path, tempo=185.0).times, true) < FRAME_S


def test_count_one_is_the_first_downbeat_after_an_upbeat(tmp_path: Path) -> None:
    path = tmp_path / "waltz.txt"
    path.write_text("# a waltz\n0.4 3\n1.0 1\n1.5, 2\n\n2.5 3\n3.0 1\n")
    beats = read_beats(path)
    assert beats.start == 1.0
    assert [beats.seconds(count) for count in (1, 2, 2.5, 4, 0)] == pytest.approx([0.0, 0.5, 1.0, 2.0, -0.6])
    assert beats.counts == 4
    assert beats.starting_at(1.2).start == 1.5


def test_counts_go_on_after_the_last_beat() -> None:
    beats = Beats(np.array([1.0, 2.0, 2.5]))
    assert beats.seconds(5) == pytest.approx(2.5)
    assert beats.grid(2, 3.2).tolist() == pytest.approx([0.0, 1.5, 2.5, 3.5])
    assert beats.grid(2, 2.5).tolist() == pytest.approx([0.0, 1.5, 2.5])
    assert beats_of_tempo(120.0).grid(1, 0.0).tolist() == [0.0, 0.5]


def test_the_count_at_a_time_is_the_inverse_of_the_time_of_a_count() -> None:
    beats = Beats(np.cumsum(np.random.default_rng(0).uniform(0.1, 2.0, 40)), first=7)
    for count in np.linspace(-20.0, 60.0, 333):
        assert beats.count(beats.seconds(count)) == pytest.approx(count)
    assert [beats.count(time - beats.start) for time in beats.times] == pytest.approx(np.arange(40) - 6)
    with pytest.raises(MotionMindError, match="a time must be a finite number"):
        beats.count(np.inf)


def test_a_grid_holds_every_nth_count() -> None:
    beats = Beats(np.cumsum(np.random.default_rng(3).uniform(0.3, 0.8, 40)), first=3)
    for every in (1, 2, 3):
        grid = beats.grid(every, 25.0)
        assert grid == pytest.approx([beats.seconds(1 + every * number) for number in range(len(grid))])
        assert grid[-2] < 25.0 <= grid[-1]


def midi(path: Path, *messages: mido.MetaMessage, ticks: int = 480, kind: int = 1) -> Path:
    file = mido.MidiFile(type=kind, ticks_per_beat=ticks)
    file.tracks.append(mido.MidiTrack([*messages, mido.MetaMessage("end_of_track", time=0)]))
    file.save(path)
    return path


def test_midi_beats_follow_its_tempos_and_signatures(tmp_path: Path) -> None:
    path = midi(
        tmp_path / "song.mid",
        mido.MetaMessage("time_signature", numerator=1, denominator=4),
        mido.MetaMessage("set_tempo", tempo=mido.bpm2tempo(93.7)),
        mido.MetaMessage("time_signature", numerator=3, denominator=4, time=480),
        mido.MetaMessage("set_tempo", tempo=mido.bpm2tempo(131), time=3 * 480),
        mido.MetaMessage("text", text="end", time=6 * 480),
    )
    beats = read_beats(path)
    steps = [60.0 / 93.7] * 4 + [60.0 / 131.0] * 6
    assert beats.times == pytest.approx(np.concatenate([[0.0], np.cumsum(steps)]), abs=1e-5)
    assert beats.in_bar.tolist() == [1, 1, 2, 3, 1, 2, 3, 1, 2, 3, 1]


def test_midi_beats_in_six_eight_are_dotted_quarters(tmp_path: Path) -> None:
    signature = mido.MetaMessage("time_signature", numerator=6, denominator=8, clocks_per_click=36)
    beats = read_beats(midi(tmp_path / "jig.mid", signature, mido.MetaMessage("text", text="", time=6 * 480)))
    assert np.diff(beats.times) == pytest.approx(0.75)
    assert beats.in_bar.tolist() == [1, 2, 1, 2, 1]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1\n2\n1.5\n", "song.txt:3: 1.5 s after 2 s: beats must not go backwards"),
        ("1\n1\n", "song.txt:2: 1 s after 1 s: beats must not go backwards"),
        ("1\nla\n", "song.txt:2: 'la' where a number was expected"),
        ("1\n2 x\n", "song.txt:2: a line has the seconds of a beat"),
        ("1\nnan\n", "where a number was expected"),
        ("1\n", "beats must be from 2 to 20,000 finite times, not 1"),
        ("", "not 0"),
        ("1\n1.001\n", "not 0.01 s or more after beat 1"),
        ("\n".join(map(str, range(MAX_BEATS + 1))), "more than 20,000 beats"),
    ],
)
def test_a_faulty_text_of_beats_is_refused_in_a_line(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "song.txt").write_text(text)
    with pytest.raises(FormatError) as raised:
        read_beats(tmp_path / "song.txt")
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)


def test_unreadable_music_is_refused_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "noise.wav").write_bytes(b"RIFF no sound")
    (tmp_path / "empty.wav").write_bytes(Sound(np.zeros((0, 1)), 8000).encode("WAV"))
    (tmp_path / "song.mid").write_bytes(b"MThd nothing")
    (tmp_path / "song.doc").write_bytes(b"la la")
    smpte = bytes(midi(tmp_path / "film.mid").read_bytes())
    (tmp_path / "film.mid").write_bytes(smpte[:12] + b"\xe7\x28" + smpte[14:])
    for name, words in {
        "noise.wav": "cannot be read as sound",
        "empty.wav": "holds no sound",
        "song.mid": "cannot be read as MIDI",
        "film.mid": "no beats can be read from it",
        "song.doc": "is no music that can be read",
        "nowhere.mp3": "there is no such file",
    }.items():
        with pytest.raises(MotionMindError, match=words) as raised:
            read_beats(tmp_path / name)
        assert "\n" not in str(raised.value)
    (tmp_path / "long.wav").write_bytes(Sound(np.zeros((1201 * 4000, 1)), 4000).encode("WAV"))
    with pytest.raises(FormatError, match="is too long: sound may last 20 minutes"):
        read_beats(tmp_path / "long.wav")
    with pytest.raises(FormatError, match="is no sound file"):
        read_sound(tmp_path / "song.mid")


def test_silence_has_no_beats(tmp_path: Path) -> None:
    (tmp_path / "still.wav").write_bytes(Sound(np.zeros((22050 * 3, 1)), 22050).encode("WAV"))
    with pytest.raises(FormatError, match="no beats are heard"):
        read_beats(tmp_path / "still.wav")


def test_sound_is_read_as_written_and_cut_with_silence_around(tmp_path: Path) -> None:
    sound = clicks(np.array([0.25, 0.75]), 1.0)
    for kind in ("WAV", "FLAC"):
        path = tmp_path / f"a.{kind.lower()}"
        path.write_bytes(sound.encode(kind))
        assert np.abs(read_sound(path).samples - sound.samples).max() < 1e-4
    part = sound.part(-0.5, 2.0)
    assert part.seconds == 2.0
    assert not part.samples[: sound.rate // 2].any()
    assert (part.samples[sound.rate // 2 : sound.rate // 2 + len(sound.samples)] == sound.samples).all()
    assert not part.samples[sound.rate // 2 + len(sound.samples) :].any()


@pytest.mark.long
def test_the_package_and_its_help_load_no_music() -> None:
    code = (
        "import sys, motionmind; from motionmind.cli import main\n"
        "try: main(['--help'])\nexcept SystemExit: pass\n"
        "print(sorted({'librosa', 'soundfile', 'mido', 'motionmind.music'} & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.splitlines()[-1] == "[]"
