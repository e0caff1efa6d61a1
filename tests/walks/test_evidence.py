"""What a corpus's clips show of trust, each when it is left out."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.gather import gather
from motionmind.geometry import rotations as rot
from motionmind.learned.posture_statistics import learn_posture_statistics
from motionmind.learned.trust import PRIOR_TRUST, Squares, fit_table
from motionmind.walks import evidence
from motionmind.walks.evidence import (
    DECAY_CANDIDATES_S,
    end_velocity_errors,
    gather_evidence,
    learn_trust,
    restrict,
    spread_of,
)

FRAMES = 16  # a clip, 0.2 s apart


def clip(rotations: Floats, name: str) -> Motion:
    root = np.tile([0.0, 0.9, 0.0], (len(rotations), 1))
    return Motion(human23(), rotations, root, np.linspace(0.0, 0.2 * (len(rotations) - 1), len(rotations)), name)


def postures(count: int, seed: int, size: float = 0.3) -> Floats:
    return rot.exp(np.random.default_rng(seed).normal(0.0, size, (count, 23, 3)))


def straight(seed: int = 0) -> Corpus:
    """Clips that each go the short way between two of a few postures, evenly."""
    ends, share = postures(4, seed), np.linspace(0.0, 1.0, FRAMES)[:, None]
    pairs = permutations(range(4), 2)
    return gather("straight", [clip(rot.slerp(ends[[a]], ends[[b]], share), f"{a} to {b}") for a, b in pairs])


def repeated(seed: int = 1) -> Corpus:
    """A phrase that is danced a few times, almost alike."""
    rng = np.random.default_rng(seed)
    waves = rng.normal(0.0, 0.3, (3, 2, 23, 3))
    angles = np.arange(1, 4)[:, None] * np.arange(FRAMES) * 0.4
    shape = np.tensordot(np.sin(angles).T, waves[:, 0], 1) + np.tensordot(np.cos(angles).T, waves[:, 1], 1)
    noise = rng.normal(0.0, 0.003, (6, *shape.shape))
    takes = zip("abcdef", noise, strict=True)
    return gather("repeated", [clip(rot.exp(shape + off), f"take {letter}") for letter, off in takes])


def test_a_corpus_whose_clips_go_the_short_way_trusts_no_walk() -> None:
    corpus = straight()
    found = gather_evidence(corpus, learn_posture_statistics(corpus), 24)
    table = fit_table(found, PRIOR_TRUST.table)
    known = np.diag(Squares.summed(found).inner)
    told = known > 1e-2 * known.max()
    assert told.any()
    assert table[told].max() < 0.05


def test_a_corpus_with_a_repeated_phrase_trusts_its_walks() -> None:
    corpus = repeated()
    trust = learn_trust(corpus, learn_posture_statistics(corpus))
    assert trust.table[0] > 0.9
    found = gather_evidence(corpus, learn_posture_statistics(corpus), 12)
    assert fit_table(found, np.zeros(5))[0] > 0.9


def test_what_is_learned_is_the_same_each_time() -> None:
    corpus = repeated()
    one, other = (learn_trust(corpus, learn_posture_statistics(corpus)) for _ in range(2))
    for name in ("table", "lasts", "spread"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("names", [["alone"], ["take.1", "take.2"], ["take", "take (2)"]])
def test_a_single_take_tells_nothing_of_itself(names: list[str]) -> None:
    corpus = gather("one", [clip(postures(FRAMES, seed), name) for seed, name in enumerate(names)])
    statistics = learn_posture_statistics(corpus)
    assert gather_evidence(corpus, statistics, 12) == []
    trust = learn_trust(corpus, statistics)
    np.testing.assert_array_equal(trust.table, PRIOR_TRUST.table)
    np.testing.assert_array_equal(trust.spread, spread_of(corpus, statistics))


def test_mirrored_copies_are_left_out_with_their_clip() -> None:
    corpus = gather("two", [clip(postures(FRAMES, seed), name) for seed, name in enumerate("ab")], mirror=True)
    families = [piece.family for piece in evidence._pieces(corpus)]
    assert len(families) == 4
    assert len(set(families)) == 2


@pytest.mark.parametrize("reverse", [None, 1.0])
def test_the_rest_of_a_corpus_is_as_if_it_had_been_gathered_alone(reverse: float | None) -> None:
    clips = [clip(postures(FRAMES, seed), name) for seed, name in enumerate("abc")]
    corpus, alone = gather("all", clips, reverse=reverse), gather("all", clips[::2], reverse=reverse)
    pieces = [piece for piece in evidence._pieces(corpus) if piece.family[1] != "b"]
    found, same = restrict(corpus, learn_posture_statistics(corpus), pieces), learn_posture_statistics(alone)
    for name in ("orientations", "weights", "begins", "ends", "shares", "turn", "travel"):
        np.testing.assert_allclose(getattr(found, name), getattr(same, name), atol=1e-12, err_msg=name)


def test_large_corpora_are_sampled_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    corpus = straight()
    monkeypatch.setattr(evidence, "N_POSTURES", 64)
    monkeypatch.setattr(evidence, "MIN_CLIPS", 4)
    pieces = evidence._pieces(corpus)
    assert 4 <= len(pieces) < len(corpus.clips)
    assert sum(piece.stop - piece.start for piece in pieces) <= 64
    own = restrict(corpus, learn_posture_statistics(corpus), pieces)
    left = np.unique(own.begins)
    np.testing.assert_allclose(np.bincount(own.begins, own.shares)[left], 1.0)
    assert len(gather_evidence(corpus, learn_posture_statistics(corpus), 12)) > 1


@pytest.mark.parametrize("slows", [0.3, 0.7])
def test_velocities_last_as_long_as_in_the_clips(slows: float) -> None:
    """Bodies that turn less and less after each posture, and none of whose postures is told of by others."""
    times, rng = np.arange(0.0, 12.0, 1.0 / 30.0), np.random.default_rng(5)
    clips = []
    for name in "abcd":
        pushes = rng.normal(size=(int(12.0 / 1.5) + 1, 23, 3))
        since = times % 1.5
        angles = since * np.maximum(1.0 - since / slows, 0.0) ** 2
        moved = angles[:, None, None] * pushes[(times // 1.5).astype(int)]
        motion = clip(rot.exp(moved), name)
        clips.append(replace(motion, times=times))
    errors = end_velocity_errors(gather("pushed", clips, rate=10.0), 60)
    best = DECAY_CANDIDATES_S[int(errors.argmin())]
    assert abs(np.log(best / slows)) <= np.log(1.6)


def test_a_corpus_without_time_for_windows_takes_the_prior() -> None:
    corpus = gather("brief", [clip(postures(2, seed), name) for seed, name in enumerate("abc")])
    trust = learn_trust(corpus, learn_posture_statistics(corpus))
    np.testing.assert_array_equal(trust.table, PRIOR_TRUST.table)
    np.testing.assert_array_equal(trust.lasts, PRIOR_TRUST.lasts)
