"""Frames: a corpus's recordings at 30 frames a second, the whole of them and parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.contact import CONTACT_FPS
from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.gather import gather
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import rotation_spline
from motionmind.learned.nearest import postures_near
from motionmind.learned.neighbours import build_neighbours
from motionmind.tween.engine import Engine
from motionmind.walks.frames import (
    N_FRAME_NEIGHBORS,
    N_LEAVES_SEARCHED,
    N_POSTURES_BESIDE,
    Frames,
    all_frames,
    frame_distances,
    frames_near,
    frames_of,
)

SPEED = np.array([0.3, -0.5, 0.2])  # radians a second


def clip(rotations: Floats, times: Floats, name: str) -> Motion:
    return Motion(human23(), rotations, np.tile([0.0, 0.9, 0.0], (len(times), 1)), times, name)


def turning(counts: tuple[int, ...]) -> Corpus:
    """Clips of so many keyframes, 0.2 s apart; every joint but the root turns at one velocity."""
    clips = []
    for number, count in enumerate(counts):
        times = 0.2 * np.arange(float(count))
        turned = times[:, None, None] * np.tile(SPEED, (23, 1))
        turned[:, 0] = 0.0
        clips.append(clip(rot.exp(turned), times, f"clip {number}"))
    return gather("turning", clips)


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def check_order(corpus: Corpus, found: Frames) -> None:
    """Check that stretches follow one another, each within a clip, with the postures that are passed at their times."""
    clips = np.searchsorted(corpus.columns.starts, found.postures, side="right") - 1
    for stretch in range(int(found.stretches[-1]) + 1):
        own = found.stretches == stretch
        assert len(set(clips[own])) == 1
        np.testing.assert_allclose(np.diff(found.times[own]), 1.0 / CONTACT_FPS, atol=1e-3 / CONTACT_FPS + 1e-9)
    assert set(np.diff(found.stretches)) <= {0, 1}
    after = np.minimum(found.postures + 1, corpus.columns.starts[clips + 1] - 1)
    assert np.all(corpus.times[found.postures] <= found.times + 2e-6)
    assert np.all((found.times < corpus.times[after] + 1e-9) | (after == found.postures))


def check_rates(found: Frames) -> None:
    """Check that rates lead from each frame to the next of its stretch."""
    goes_on = np.flatnonzero(np.diff(found.stretches) == 0)
    reached = rot.mul(found.chains[goes_on], rot.exp(found.rates[goes_on] / CONTACT_FPS))
    assert rot.angle(reached, found.chains[goes_on + 1]).max() < 1e-7


def test_all_frames_are_the_recordings(cmu05: Engine) -> None:
    corpus, found = cmu05.corpus, all_frames(cmu05.corpus)
    for number, one in enumerate(corpus.clips):
        recorded, own = corpus.recording(one), found.stretches == number
        np.testing.assert_allclose(found.times[own], recorded.times, atol=1e-9)
        assert rot.angle(found.chains[own], corpus.to_chains(recorded.rotations)).max() < 1e-6
    check_order(corpus, found)
    check_rates(found)


@pytest.mark.parametrize("facing", ["free", "stage"])
def test_keyframes_are_joined_by_splines(facing: str, ballet: Engine) -> None:
    corpus = ballet.corpus if facing == "stage" else turning((5, 9))
    assert corpus.facing == facing
    found = all_frames(corpus)
    check_order(corpus, found)
    check_rates(found)
    for number in (0, 1):
        knots, own = slice(*corpus.columns.starts[number : number + 2]), found.stretches == number
        shown = rotation_spline(corpus.times[knots], corpus.rotations[knots], found.times[own])
        assert rot.angle(found.chains[own], corpus.to_chains(shown)).max() < 1e-6
        assert found.times[own][0] == corpus.times[knots][0]
        assert corpus.times[knots][-1] - found.times[own][-1] < 1.0 / CONTACT_FPS


def test_even_turning_has_constant_velocity() -> None:
    found = all_frames(turning((4, 7)))
    np.testing.assert_allclose(found.rates[:, 1:23], np.broadcast_to(SPEED, (len(found.rates), 22, 3)), atol=1e-6)
    np.testing.assert_allclose(found.rates[:, [0, 23]], 0.0, atol=1e-9)
    assert np.bincount(found.stretches).tolist() == [19, 37]


def test_a_clip_of_one_posture_is_a_frame_at_rest() -> None:
    corpus = turning((1, 4, 1))
    found = all_frames(corpus)
    assert np.bincount(found.stretches).tolist() == [1, 19, 1]
    np.testing.assert_array_equal(found.rates[[0, -1]], 0.0)
    assert rot.norm(found.rates[1:-1, 1:23]).min() > 0.5
    check_order(corpus, found)
    for number in (0, 2):
        assert len(frames_of(corpus, number, 0.0, 1.0).chains) == 1


def test_a_part_of_a_clip_is_as_in_the_whole(cmu05: Engine, ballet: Engine) -> None:
    rng = np.random.default_rng(0)
    for corpus in (cmu05.corpus, ballet.corpus):
        for _ in range(8):
            number = int(rng.integers(len(corpus.clips)))
            knots = slice(*corpus.columns.starts[number : number + 2])
            times = corpus.times[knots]
            begin, end = np.sort(rng.uniform(times[0], times[-1], 2))
            found = frames_of(corpus, number, begin, end)
            check_order(corpus, found)
            check_rates(found)
            assert corpus.times[found.postures[0]] == found.times[0]
            assert found.times[0] <= begin
            assert found.times[-1] >= end - 1.0 / CONTACT_FPS
            assert begin - found.times[0] < np.diff(times).max()
            if corpus.detail.shape[1]:
                whole = all_frames(corpus)
                own = np.flatnonzero(whole.stretches == number)
                first = own[np.argmin(np.abs(whole.times[own] - found.times[0]))]
                shown = whole.chains[first : first + len(found.chains)]
            else:
                shown = corpus.to_chains(rotation_spline(times, corpus.rotations[knots], found.times))
            off = rot.angle(shown, found.chains).max(axis=1)
            assert off.max() < 5e-3
            inside = (found.times > found.times[0] + 0.8) & (found.times < found.times[-1] - 0.8)
            assert off[inside].max(initial=0.0) < 1e-3


def test_a_part_beyond_a_clip_ends_with_it() -> None:
    corpus = turning((4, 7))
    for begin, end, frames in ((-1.0, 9.0, 37), (9.0, 10.0, 1), (0.0, 0.0, 1), (0.21, 0.39, 7)):
        found = frames_of(corpus, 1, begin, end)
        assert len(found.chains) == frames
        assert found.postures.min() >= 4


def test_frames_near_postures_are_whole_runs_with_these_in_them(ballet: Engine) -> None:
    corpus, statistics = ballet.corpus, ballet.statistics
    assert statistics.trees is None
    assert frames_near(corpus, statistics, statistics.orientations[:1]) is all_frames(corpus)
    trees = build_neighbours(corpus.skeleton, statistics.orientations, statistics.weights)
    poses = statistics.orientations[[5, 812, 2104]]
    found = frames_near(corpus, replace(statistics, trees=trees), poses)
    check_order(corpus, found)
    check_rates(found)
    assert len(found.chains) < 0.7 * len(all_frames(corpus).chains)
    near = [
        postures_near(trees, statistics.orientations, pose, N_FRAME_NEIGHBORS, len(corpus), N_LEAVES_SEARCHED)
        for pose in poses
    ]
    for posture in np.unique(near).tolist():
        number = int(np.searchsorted(corpus.columns.starts, posture, side="right")) - 1
        start, stop = (int(at) for at in corpus.columns.starts[number : number + 2])
        # The last posture of a run may lie between two frames.
        run = set(range(max(posture - N_POSTURES_BESIDE, start), min(posture + N_POSTURES_BESIDE, stop - 1)))
        stretch = found.stretches[found.postures == min(posture, stop - 2)][0]
        assert run <= set(found.postures[found.stretches == stretch].tolist())
    for stretch in range(0, int(found.stretches[-1]) + 1, 7):
        own = np.flatnonzero(found.stretches == stretch)
        number = int(np.searchsorted(corpus.columns.starts, found.postures[own[0]], side="right")) - 1
        knots = slice(*corpus.columns.starts[number : number + 2])
        shown = rotation_spline(corpus.times[knots], corpus.rotations[knots], found.times[own])
        assert rot.angle(shown, found.chains[own]).max() < 5e-3
    assert frame_distances(found, poses).min(axis=1).max() < 1e-3  # the last posture is that of many clips' ends
    more = frames_near(corpus, replace(statistics, trees=trees), poses, 2 * N_POSTURES_BESIDE)
    inside = np.diff(found.stretches, append=-1) == 0
    assert set(found.postures[inside].tolist()) < set(more.postures.tolist())


def test_distances_are_means_over_the_joints() -> None:
    rng = np.random.default_rng(0)
    chains, poses = rot.normalise(rng.normal(size=(7, 4, 4))), rot.normalise(rng.normal(size=(5, 3, 4)))
    recorded = Frames(chains, np.zeros(7, dtype=np.int64), np.arange(7), np.arange(7.0), np.zeros((7, 4, 3)))
    angles = rot.angle(poses[:, None], chains[None, :, :3])
    expected = np.mean((2.0 * np.sin(0.5 * angles)) ** 2, axis=-1)
    np.testing.assert_allclose(frame_distances(recorded, poses), expected, atol=1e-12)
    np.testing.assert_allclose(frame_distances(recorded, -poses), expected, atol=1e-12)
