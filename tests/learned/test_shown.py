"""The limits of a corpus: its own movement keeps them, and movement that is worse does not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionmind import Engine, Motion
from motionmind._typing import Floats
from motionmind.body.contact import floor_height, foot_slides, lowest_height
from motionmind.body.human import human23
from motionmind.body.noticeable import NOTICEABLE_SHARE
from motionmind.body.plausibility import at_rate
from motionmind.corpus.clip import JointRepair
from motionmind.learned.plausibility import MEASURES, MIN_FOOT_SPEED_LIMIT, Plausibility, learn_plausibility

BALLET = Engine.load("ballet")


def stretches(engine: Engine, count: int, seed: int = 0) -> list[Motion]:
    """Random seconds of the clips of a corpus."""
    rng = np.random.default_rng(seed)
    clips = [at_rate(engine.corpus.recording(clip)) for clip in engine.corpus.clips]
    long = [clip for clip in clips if len(clip) > 31]
    lengths = np.array([len(clip) - 30 for clip in long])
    chosen = [long[number] for number in rng.choice(len(long), size=count, p=lengths / lengths.sum())]
    starts = [int(rng.integers(len(clip) - 30)) for clip in chosen]
    return [clip.slice(start, start + 31) for clip, start in zip(chosen, starts, strict=True)]


def raised(motion: Motion, by: Floats) -> Motion:
    return replace(motion, root=motion.root + by[:, None] * [0.0, 1.0, 0.0])


def test_a_corpus_keeps_its_own_limits() -> None:
    beyond = np.array(
        [[one.is_beyond for one in BALLET.plausibility.shown(motion).values()] for motion in stretches(BALLET, 400)]
    )
    assert np.all(beyond.mean(axis=0) <= 0.02)
    assert np.isfinite(BALLET.plausibility.most).all()  # a ballet has it all: jumps, legs that cross, one-leg balances


def test_haste_is_told_with_its_part() -> None:
    motion = stretches(BALLET, 1)[0]
    hurried = replace(motion, times=motion.times[0] + (motion.times - motion.times[0]) / 20.0)
    shown = BALLET.plausibility.shown(hurried.resample(120.0))
    assert shown["pace"].is_beyond
    assert shown["pace"].part in (*BALLET.corpus.chains, "travel")
    still = replace(motion, rotations=np.tile(motion.rotations[:1], (31, 1, 1)), root=np.tile(motion.root[:1], (31, 1)))
    carried = replace(still, root=still.root + np.linspace(0.0, 9.0, 31)[:, None] * [1.0, 0.0, 0.0])
    found = BALLET.plausibility.shown(carried)["pace"]
    assert (found.part, found.is_beyond) == ("travel", True)
    assert not BALLET.plausibility.shown(still)["pace"].is_beyond


def test_a_body_that_hops_or_floats_is_told() -> None:
    motion = stretches(BALLET, 1)[0]
    hops = raised(motion, 0.05 * np.sin(np.arange(31)))
    assert BALLET.plausibility.shown(hops)["bounce"].is_beyond
    floats = raised(motion, np.concatenate([np.linspace(0.0, 0.5, 5), np.full(26, 0.5)]))
    assert BALLET.plausibility.shown(floats)["flight"].is_beyond


def test_the_frame_rate_does_not_matter() -> None:
    motion = stretches(BALLET, 1)[0]
    once = BALLET.plausibility.shown(motion)
    fine = BALLET.plausibility.shown(motion.resample(120.0))
    for name in MEASURES:
        assert once[name] == fine[name] or once[name].value == pytest.approx(fine[name].value, rel=1e-6)


def test_what_is_unknown_of_a_body_is_not_told() -> None:
    engine = Engine.load("walk-hexapod")
    shown = engine.plausibility.shown(engine.corpus.motion(engine.corpus.clips[0]))
    known = {name for name, one in shown.items() if one.value is not None or one.most is not None}
    assert known == {"pace"}


def test_limits_survive_the_disk(tmp_path: Path) -> None:
    BALLET.save(tmp_path / "ballet")
    opened = Engine.load(str(tmp_path / "ballet")).plausibility
    np.testing.assert_array_equal(opened.most, BALLET.plausibility.most)
    np.testing.assert_array_equal(opened.fastest, BALLET.plausibility.fastest)
    np.testing.assert_array_equal(opened.slides, BALLET.plausibility.slides)


def test_feet_are_seldom_faster_near_the_floor_than_was_learned() -> None:
    engine = Engine.load("karate")
    limit = float(engine.plausibility.slides[0]) * human23().height
    seconds = []
    for clip in engine.corpus.clips:
        whole = at_rate(engine.corpus.recording(clip))
        floor = floor_height(lowest_height(whole.skeleton, whole.rotations, whole.root))
        quick = 30.0 * foot_slides(whole.skeleton, whole.rotations, whole.root, floor).max(axis=1) > limit
        seconds.extend(np.lib.stride_tricks.sliding_window_view(quick, 30).any(axis=1))
    assert 0.03 < np.mean(seconds) < 0.07


def test_what_was_reconstructed_is_no_measure_of_feet() -> None:
    """Somebody walks, and slides 9 m in a second that was interpolated."""
    motion = stretches(BALLET, 1)[0]
    times = np.arange(300) / 30.0
    way = np.cumsum(np.where((times > 5.0) & (times < 6.0), 0.3, 0.02 + 0.03 * np.sin(times)))
    still = Motion(motion.skeleton, np.tile(motion.rotations[:1], (300, 1, 1)), np.zeros((300, 3)), times, "slides")
    low = float(lowest_height(still.skeleton, still.rotations, still.root).min())
    gathered = Engine.fit([replace(still, root=way[:, None] * [1.0, 0.0, 0.0] - [0.0, low, 0.0])], rate=30.0).corpus
    mended = JointRepair("left_knee", 150, 180, (5.0, 6.0), exact=False)
    fastest = BALLET.plausibility.fastest
    for repairs, quick in (((), True), ((mended,), False), ((replace(mended, exact=True),), True)):
        corpus = replace(gathered, clips=tuple(replace(clip, repairs=repairs) for clip in gathered.clips))
        slides = float(learn_plausibility(corpus, fastest).slides[0]) * still.skeleton.height
        assert slides == pytest.approx(9.0 if quick else MIN_FOOT_SPEED_LIMIT * still.skeleton.height, rel=0.02)


def test_bodies_without_feet_have_no_limit_for_them() -> None:
    assert np.isnan(Engine.load("walk-hexapod").plausibility.slides).tolist() == [True]


def test_a_corpus_of_two_postures_has_limits() -> None:
    motion = BALLET.corpus.motion(BALLET.corpus.clips[0])
    limits = Engine.fit([motion.slice(0, 2), motion.slice(5, 6)]).plausibility
    assert not any(one.is_beyond for one in limits.shown(motion.slice(0, 2)).values())


def test_of_a_long_corpus_pieces_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    """The limits of every third piece are near those of all, and cost a third."""
    monkeypatch.setattr("motionmind.learned.plausibility._N_FRAMES_MEASURED", 8_000)
    fewer = learn_plausibility(BALLET.corpus, BALLET.plausibility.fastest).most
    assert np.all(fewer <= BALLET.plausibility.most * 1.2)
    assert np.all(fewer >= BALLET.plausibility.most * 0.6)
    assert np.any(fewer != BALLET.plausibility.most)


def test_trifles_are_not_told() -> None:
    motion = stretches(BALLET, 1)[0]
    still = replace(motion, rotations=np.tile(motion.rotations[:1], (31, 1, 1)), root=np.tile(motion.root[:1], (31, 1)))
    limits = Plausibility(BALLET.plausibility.fastest, np.zeros(len(MEASURES)), np.full(1, np.nan))
    trembles = raised(still, 0.0003 * np.sin(np.arange(31)))
    assert not limits.shown(trembles)["bounce"].is_beyond
    assert limits.shown(raised(still, 0.02 * np.sin(np.arange(31))))["bounce"].is_beyond


def test_feet_that_slide_longer_than_the_corpus_lets_them_are_told() -> None:
    karate = Engine.load("karate")
    motion = stretches(karate, 1)[0]
    still = replace(motion, rotations=np.tile(motion.rotations[:1], (31, 1, 1)), root=np.tile(motion.root[:1], (31, 1)))
    for frames in (0, 3, 12, 30):  # carried off, standing, for so many frames
        way = np.minimum(np.arange(31), frames)[:, None] * [0.04, 0.0, 0.0]
        found = karate.plausibility.shown(replace(still, root=still.root + way))["sliding"]
        assert found.value == pytest.approx(frames / 30)
        assert found.most is not None
        assert found.is_beyond == (frames / 30 > found.most + NOTICEABLE_SHARE)
        lifted = replace(still, root=still.root + way + [0.0, 0.2, 0.0])
        assert karate.plausibility.shown(lifted)["sliding"].value == 0.0
    assert 0.2 <= found.most < 0.9
    creeps = replace(still, root=still.root + np.arange(31)[:, None] * [0.02, 0.0, 0.0])
    assert karate.plausibility.shown(creeps)["sliding"].value == 0.0
