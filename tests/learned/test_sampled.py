"""Long recordings are learned from block by block: what is learned is the same, and hours take no more memory."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from motionmind.body import rates
from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.body.plausibility import at_rate
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.gather import gather
from motionmind.corpus.kept import Kept
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.learned import pace, plausibility
from motionmind.learned.sampled import Sampled
from motionmind.tween.engine import Engine

BODY = human23()
pytestmark = pytest.mark.filterwarnings("ignore:frames per second, or the unit")  # such is nobody's movement


def recording(seconds: float, fps: float = 30.0, seed: int = 0) -> Motion:
    """Somebody who moves all joints, each in a rhythm of its own."""
    rng = np.random.default_rng(seed)
    times = np.arange(round(seconds * fps)) / fps
    turns = np.zeros((len(times), len(BODY), 3))
    for _ in range(3):
        rhythm, phase = rng.uniform(0.5, 7.0, (2, len(BODY), 3))
        turns += rng.normal(0.0, 0.15, (len(BODY), 3)) * np.sin(rhythm * times[:, None, None] + phase)
    root = np.stack([np.sin(0.2 * times), 0.95 + 0.05 * np.sin(3.0 * times), np.zeros(len(times))], axis=-1)
    return Motion(BODY, rot.exp(turns), root, times, "clip")


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize(("fps", "rate"), [(30.0, 5.0), (120.0, 4.0), (25.0, 7.0), (12.0, None), (60.0, None)])
def test_frames_are_those_of_the_whole_recording(fps: float, rate: float | None, smooth: bool) -> None:
    corpus = gather("c", [recording(40.0, fps), recording(0.9, fps, 1)], rate=rate)
    rng = np.random.default_rng(0)
    for clip in corpus.clips:
        whole = corpus.recording(clip)
        expected = at_rate(whole) if smooth else whole.resample(30.0)
        sampled = Sampled(corpus, clip, 30.0, smooth=smooth)
        np.testing.assert_array_equal(sampled.times, expected.times)
        bounds = [(0, 1), (0, len(sampled)), (len(sampled) - 1, len(sampled)), *np.sort(rng.integers(27, size=(9, 2)))]
        for start, stop in ((int(a), int(b) + (a == b)) for a, b in bounds):
            part = sampled.frames(start, stop)
            np.testing.assert_allclose(part.rotations, expected.rotations[start:stop], atol=1e-12)
            np.testing.assert_allclose(part.root, expected.root[start:stop], atol=1e-12)
        blocks = [*sampled.blocks(100, overlap=1)]
        assert [len(block) for block in blocks[1:-1]] == [101] * len(blocks[1:-1])
        joined = [blocks[0].root, *(block.root[1:] for block in blocks[1:])]
        np.testing.assert_allclose(np.concatenate(joined), expected.root, atol=1e-12)
        numbers = np.sort(rng.choice(len(sampled), size=9, replace=False))
        np.testing.assert_allclose(sampled.take(numbers)[0], expected.rotations[numbers], atol=1e-12)
        np.testing.assert_allclose(sampled.take(numbers)[1], expected.root[numbers], atol=1e-12)


def learned(corpus: Corpus) -> list[np.ndarray]:
    pace_of = pace.refit_pace(corpus, pace.measure_pace(Kept.none(corpus)))
    return [*vars(pace_of).values(), plausibility.learn_plausibility(corpus, pace_of.fastest).most]


def test_what_is_learned_does_not_depend_on_the_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    corpus = gather("c", [recording(70.0), recording(33.0, 120.0, 1)], rate=5.0)
    monkeypatch.setattr(plausibility, "_N_FRAMES_MEASURED", 1000)
    monkeypatch.setattr(plausibility, "_PIECE_FRAMES", 20)
    usual = learned(corpus)
    for module in (pace, plausibility):
        monkeypatch.setattr(module, "BLOCK_FRAMES", 60)
    monkeypatch.setattr("motionmind.learned.sampled.BLOCK_FRAMES", 60)
    for one, other in zip(usual, learned(corpus), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)


def test_a_recording_of_more_frames_than_are_made_at_once_is_learned_from(monkeypatch: pytest.MonkeyPatch) -> None:
    clip = recording(60.0)
    usual = Engine.fit([clip], rate=5.0)
    monkeypatch.setattr(rates, "MAX_POSITIONS", 1500 * len(BODY))
    engine = Engine.fit([clip], rate=5.0)
    np.testing.assert_array_equal(engine.plausibility.most, usual.plausibility.most)
    np.testing.assert_array_equal(engine.pace.law, usual.pace.law)
    with pytest.raises(MotionMindError, match="more than can be made at once, 1500 "):
        clip.resample(100.0)


def test_longer_recordings_take_no_more_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plausibility, "_N_FRAMES_MEASURED", 1000)
    monkeypatch.setattr(plausibility, "BLOCK_FRAMES", 480)
    fastest = np.full(len(BODY) + 2, 5.0)
    peaks = []
    for minutes in (1.5, 6.0):
        corpus = gather("c", [recording(60.0 * minutes)], rate=5.0)
        tracemalloc.start()
        plausibility.learn_plausibility(corpus, fastest)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.25 * peaks[0]
