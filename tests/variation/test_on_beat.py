"""Variations on the beat, and their sound: each part starts on a beat, and each click sounds with its posture."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from click_tracks import at_tempo, clicks, onsets
from command_line import Run

from motionmind import Engine, Variation, read_motion, read_variation, vary, write_motion, write_variation
from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.music import Beats, read_sound
from motionmind.music.beats import beats_of_tempo
from motionmind.variation.on_beat import MAX_PACE_RATIO, OnBeat
from motionmind.variation.sounding import CROSS_FADE_S, sound_of, spans

UNEVEN = Beats(np.cumsum([0.2, *np.random.default_rng(5).uniform(0.4, 0.7, 30)]), first=2)


@cache
def engine() -> Engine:
    return Engine.load("ballet")


@cache
def adagio_varied(every: int = 2, beats: str = "even") -> Variation:
    given = UNEVEN if beats == "uneven" else beats_of_tempo(120.0)
    return vary(ballet_clip("adagio"), engine(), alternatives=1, beats=given, on_beat=every)


def starts(variation: Variation) -> Floats:
    """Return when each stretch and each insertion starts, by the frames of the movement, seconds."""
    motion, frames = variation.arrange()
    times = motion.times - motion.times[0]
    found = [0.0]
    for seam in variation.seams:
        found += [times[frames[seam.at]]] if seam.insertion else []
        found.append(times[frames[seam.at + 1]])
    return np.array(found)


@pytest.mark.long
@pytest.mark.parametrize("every", [1, 2, 3])
@pytest.mark.parametrize("beats", ["even", "uneven"])
def test_every_part_starts_on_a_beat(every: int, beats: str) -> None:
    variation = adagio_varied(every, beats)
    assert len([seam for seam in variation.seams if seam.insertion]) >= 2
    given = UNEVEN if beats == "uneven" else beats_of_tempo(120.0)
    grid = given.grid(every, 200.0)
    found = starts(variation)
    assert np.abs(found[:, None] - grid).min(axis=1).max() < 1e-9
    report = variation.report()["on_beat"]
    assert [part["seconds"] for part in report["parts"]] == pytest.approx(found)
    assert [given.seconds(part["count"]) for part in report["parts"]] == pytest.approx(found)
    assert max(part["pace"] for part in report["parts"]) <= MAX_PACE_RATIO + 1e-9
    assert report["seconds"] == pytest.approx(np.ptp(variation.motion().times))


@pytest.mark.long
def test_parts_stay_on_the_beat_through_edits_and_files(tmp_path: Path) -> None:
    variation = adagio_varied()
    seam = next(one.number for one in variation.seams if one.insertion)
    edited = variation.discard(seam).cut(2, 9, before=20)
    assert len(edited.seams) != len(variation.seams)
    grid = beats_of_tempo(120.0).grid(2, 200.0)
    assert np.abs(starts(edited)[:, None] - grid).min(axis=1).max() < 1e-9
    write_variation(tmp_path / "v.json", edited)
    again = read_variation(tmp_path / "v.json")
    assert again.on_beat == edited.on_beat
    assert (again.motion().times == edited.motion().times).all()
    assert read_motion(tmp_path / "v.json").times == pytest.approx(edited.motion().times)


@pytest.mark.long
def test_postures_stay_as_they_are_on_the_beat() -> None:
    variation = adagio_varied()
    free = Variation(**{**vars_of(variation), "on_beat": None})
    assert (variation.motion().rotations == free.motion().rotations).all()
    assert (variation.motion().root == free.motion().root).all()


def vars_of(variation: Variation) -> dict[str, object]:
    names = ("piece", "course", "order", "transitions", "edits", "kept", "control")
    return {name: getattr(variation, name) for name in names}


def test_faulty_beats_of_a_variation_are_refused() -> None:
    motion = ballet_clip("adagio")
    with pytest.raises(MotionMindError, match="on_beat and beats need each other"):
        vary(motion, on_beat=2)
    with pytest.raises(MotionMindError, match="on_beat must be a whole number from 1 to 64, not 0"):
        vary(motion, beats=UNEVEN, on_beat=0)
    own = vars_of(vary(motion, nudge=0.1))
    for times in ((0.0,), (0.1, 0.2), (0.0, 2.0, 1.0)):
        with pytest.raises(MotionMindError, match="begin with 0, and increase"):
            Variation(**own, on_beat=OnBeat(2, times))  # type: ignore[arg-type]


# --- sound ------------------------------------------------------------------------------------------------------------


def sounding_piece() -> tuple[Motion, Floats]:
    """Return a clip at 10 postures a second, and the times of clicks in its sound."""
    motion = ballet_clip("adagio").resample(10.0)
    return motion, at_tempo(93.7, 0.23, float(motion.times[-1]) - 0.2)


def expected(variation: Variation, at: Floats) -> Floats:
    """Return when clicks of the piece should sound in a variation, away from the cross-fades."""
    found = []
    for span in spans(variation):
        inner = at[(at > span.piece_start + 0.03) & (at < span.piece_end - 0.15)]
        share = (inner - span.piece_start) / max(span.piece_end - span.piece_start, 1e-9)
        found += (span.start + share * (span.end - span.start)).tolist()
    return np.array(found)


@pytest.mark.long
@pytest.mark.parametrize("on_beat", [None, 2])
def test_each_click_sounds_with_its_posture_and_insertions_are_silent(on_beat: int | None) -> None:
    motion, at = sounding_piece()
    beats = None if on_beat is None else beats_of_tempo(108.0)
    options = {"beats": beats, "on_beat": on_beat, "alternatives": 1}
    variation = vary(motion, engine(), **options)  # type: ignore[arg-type]
    length = float(np.ptp(variation.motion().times))
    sound = sound_of(variation, clicks(at, float(motion.times[-1]) + 1.0), "own")
    assert sound.seconds == pytest.approx(length, abs=1e-4)
    heard, wanted = onsets(sound, apart=0.09), expected(variation, at)
    assert len(wanted) >= 20
    assert np.abs(wanted[:, None] - heard).min(axis=1).max() < (1.0 / 30.0 if on_beat else 0.003)
    arranged, frames = variation.arrange()
    times = arranged.times - arranged.times[0]
    inserted = [seam.at for seam in variation.seams if seam.insertion]
    assert inserted
    for number in inserted:
        start, end = (round(float(times[frames[number + by]]) * sound.rate) for by in (0, 1))
        margin = round(0.5 * CROSS_FADE_S * sound.rate) + 2
        assert not sound.samples[start + margin : end - margin].any()


@pytest.mark.long
def test_straight_sound_is_the_pieces_own() -> None:
    motion, at = sounding_piece()
    variation = vary(motion.slice(20, len(motion)), nudge=0.3)
    track = clicks(at, 60.0)
    sound = sound_of(variation, track, "straight")
    start = round(2.0 * track.rate)
    assert (sound.samples == track.samples[start : start + len(sound.samples)]).all()


@pytest.mark.long
def test_a_sound_track_never_replaces_music_or_the_sound_of_the_piece(run: Run, tmp_path: Path) -> None:
    motion, at = sounding_piece()
    write_motion(tmp_path / "clip.bvh", motion)
    kept = clicks(at, 40.0).encode("WAV")
    for name in ("clip.wav", "song.wav"):
        (tmp_path / name).write_bytes(kept)
    words = ["vary", tmp_path / "clip.bvh", "--depart", 0.2, "--sound", "own", "--music", tmp_path / "song.wav"]
    for name, track in (("song.json", "song.wav"), ("clip.json", "clip.wav")):
        ran = run(*words, "-o", tmp_path / name)
        assert ran.code == 2
        assert f"{track}: cannot be written: it is read from" in ran.err
        assert (tmp_path / track).read_bytes() == kept
        assert not (tmp_path / name).exists()


@pytest.mark.long
def test_a_variation_takes_its_sound_along(run: Run, tmp_path: Path) -> None:
    motion, at = sounding_piece()
    write_motion(tmp_path / "clip.bvh", motion)
    words = ["vary", tmp_path / "clip.bvh", "--nudge", 0.3, "-o", tmp_path / "v.json", "-o", tmp_path / "v.html"]
    done = run(*words, "--sound", "own")
    assert (done.code, [*tmp_path.glob("v.*")]) == (2, [])
    assert "needs a motion file with its sound beside it" in done.err
    (tmp_path / "clip.wav").write_bytes(clicks(at, 40.0).encode("WAV"))
    assert run(*words, "--sound", "own").code == 0
    variation, sound = read_variation(tmp_path / "v.json"), read_sound(tmp_path / "v.wav")
    assert np.abs(expected(variation, at)[:, None] - onsets(sound)).min(axis=1).max() < 0.005
    assert '"sound":"' in (tmp_path / "v.html").read_text()
    assert run(*words, "--on-beat", 2).code == 2
    assert run(*words, "--on-beat", 2, "--tempo", 100, "--sound", "none").code == 0
    assert '"sound":"' not in (tmp_path / "v.html").read_text()
