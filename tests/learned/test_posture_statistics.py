"""How a corpus's bodies turn, travel and go on, moment by moment, and the states of where they face."""

from __future__ import annotations

import numpy as np
import pytest

from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.corpus.gather import gather
from motionmind.discretize.codebook import Codebook
from motionmind.geometry import rotations as rot
from motionmind.learned.learning import learn
from motionmind.learned.posture_statistics import learn_posture_statistics


def turning(frames: int, turn: float, ahead: float) -> Motion:
    """A body at rest that turns by `turn` radians a posture, past facing backwards, and travels in an arc ahead."""
    headings = 2.0 + turn * np.arange(frames)
    rotations = np.tile(rot.IDENTITY, (frames, 23, 1))
    rotations[:, 0] = rot.about_vertical(headings)
    steps = rot.mul_vec(rot.about_vertical(headings[:-1] + 0.5 * turn), np.array([0.0, 0.0, ahead]))
    root = np.array([0.0, 0.9, 0.0]) + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    return Motion(human23(), rotations, root, 0.2 * np.arange(frames), "turning")


@pytest.mark.parametrize("turn", [0.4, -0.3])
def test_half_a_move_turns_and_travels_half_as_far_in_the_body_s_heading(turn: float) -> None:
    statistics = learn_posture_statistics(gather("turning", [turning(20, turn, 0.1)]))
    np.testing.assert_allclose(statistics.turn, 0.5 * turn, atol=1e-9)
    np.testing.assert_allclose(statistics.travel, np.tile([0.0, 0.0, 0.05], (19, 1)), atol=1e-9)


def test_shares_of_the_steps_that_leave_a_moment_add_up_to_one_by_their_weights() -> None:
    """Also of a posture that more moves arrive in than leave, of other weights."""
    corpus = gather("back and forth", [turning(9, 0.3, 0.0)], reverse=1.0)
    statistics = learn_posture_statistics(corpus)
    samples = len(corpus) + len(corpus.moves.begins)
    sums = np.bincount(statistics.begins, statistics.shares, samples)
    np.testing.assert_allclose(sums[np.unique(statistics.begins)], 1.0, atol=1e-12)
    leaving = np.flatnonzero(corpus.moves.begins == 4)
    ahead, back = sorted(statistics.shares[leaving])[::-1]
    assert ahead / back == pytest.approx(np.e)


def test_a_posture_faces_within_half_a_step_of_its_state() -> None:
    corpus = gather("turning", [turning(60, 0.17, 0.0)], facing="free")
    learned = learn(corpus, Codebook(15.0))
    off = learned.space.distance(corpus.to_chains(corpus.rotations), learned.states)
    assert off[:, -1].max() <= 180.0 / learned.space.sizes[-1] + 1e-6


def test_carriage_is_the_same_in_blocks_of_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    clips = []
    for name, count in (("one", 23), ("other", 11)):
        rotations = rot.exp(np.cumsum(rng.normal(0.0, 0.2, (count, 23, 3)), axis=0))
        root = np.array([0.0, 0.9, 0.0]) + np.cumsum(rng.normal(0.0, 0.03, (count, 3)), axis=0)
        clips.append(Motion(human23(), rotations, root, 0.2 * np.arange(count), name))
    corpus = gather("wandering", clips, reverse=1.0)
    whole = learn_posture_statistics(corpus)
    assert whole.loose.any()
    assert not whole.loose.all()
    for size in (1, 7):
        monkeypatch.setattr("motionmind.learned.posture_statistics.BLOCK_FRAMES", size)
        monkeypatch.setattr("motionmind.body.limits._N_POSTURES_AT_ONCE", size)
        for name, array in vars(learn_posture_statistics(corpus)).items():
            np.testing.assert_array_equal(array, getattr(whole, name), err_msg=name)
