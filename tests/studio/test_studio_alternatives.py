"""Alternatives between postures of ballet: that they differ, are near enough to the best, and what is said is true."""

from __future__ import annotations

import re
from itertools import combinations, pairwise

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionmind import Engine, Motion, Tween
from motionmind.errors import NoPathError
from motionmind.names.finding import find_motion
from motionmind.names.postures import find_posture
from motionmind.names.spelling import Source
from motionmind.studio.alternatives import (
    COST_GAP_RATIO,
    FAR_SHARE,
    MAX_ALTERNATIVES,
    Account,
    account,
    clock,
    find,
    key_of,
    usual_likelihoods,
)

ENDS = [
    ("ballet/arabesque", "ballet/fifth"),
    ("ballet/adagio@3", "ballet/adagio@40"),
    ("ballet/second", "ballet/first"),
]


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


@pytest.fixture(scope="module", params=ENDS, ids=" to ".join)
def found(request: pytest.FixtureRequest, ballet: Engine) -> list[tuple[Tween, Account]]:
    a, b = (find_posture(name).posture for name in request.param)
    own = usual_likelihoods(ballet)
    tweens = list(find(ballet, a, b))
    firsts = [None, *[tweens[0].motion] * (len(tweens) - 1)]
    return [(tween, account(tween, ballet.corpus, own, first)) for tween, first in zip(tweens, firsts, strict=True)]


def test_alternatives_differ_and_are_near_enough(found: list[tuple[Tween, Account]]) -> None:
    assert len(found) == MAX_ALTERNATIVES
    for number, (tween, _) in enumerate(found):
        assert len(tween.differs) == number
        assert min(tween.differs, default=1.0) >= 0.2 - 1e-9
        assert tween.cost <= (1.0 + COST_GAP_RATIO) * tween.lower_bound + 1e-6


@pytest.mark.long
def test_the_farther_they_go_the_more_any_two_differ(ballet: Engine) -> None:
    pairs = [("arabesque", "fifth"), ("first", "attitude"), ("passe", "arabesque")]
    for names in pairs:
        a, b = (find_posture(f"ballet/{name}").posture for name in names)
        least: dict[str, float] = {}
        best: Tween | None = None
        for spread, share in (("near", 0.2), ("usual", 0.2), ("far", FAR_SHARE)):
            tweens = list(find(ballet, a, b, spread=spread))
            assert len(tweens) == MAX_ALTERNATIVES
            assert min(min(tween.differs) for tween in tweens[1:]) >= share - 1e-9
            best = best or tweens[0]
            assert np.array_equal(tweens[0].path, best.path)
            shown = [tween.motion.at(np.linspace(0.0, tween.motion.times[-1], 41)) for tween in tweens]
            least[spread] = min(float(_degrees_apart(*two).mean()) for two in combinations(shown, 2))
        assert 0.0 < 1.5 * least["near"] < least["usual"] < least["far"]


def test_words_say_what_is_proven(found: list[tuple[Tween, Account]]) -> None:
    for tween, said in found:
        assert (tween.status == "optimal") == ("proven" in said.sure)
        assert said.usual.endswith(f"; {tween.motion_attested:.0%} of the motion's transitions occur in ballet")
        assert "_" not in "".join([said.words, said.differs, said.details, said.sure, said.usual, *said.beyond])
        assert f"{tween.motion.times[-1]:.1f} s" in said.words
        assert b"nat" not in msgspec.json.encode([said.words, said.sure, said.usual, said.beyond])


def test_words_say_where_and_when_one_differs_most_from_the_first(found: list[tuple[Tween, Account]]) -> None:
    (tween, said), *others = found
    assert (said.differs, said.details) == ("", "")
    for other, words in others:
        assert words.differs
        joint, degrees, at = re.findall(r": ([a-z ]+) by (\d+)°.* at ([\d.]+) s$", words.details)[0]
        apart = _degrees_apart(other.motion, tween.motion)
        frame, number = np.unravel_index(int(apart.argmax()), apart.shape)
        assert joint == other.motion.skeleton.names[number].replace("_", " ")
        assert int(degrees) == round(apart.max())
        assert float(at) == pytest.approx(other.motion.times[frame], abs=0.05 + 1e-9)


def _degrees_apart(motion: Motion, other: Motion) -> np.ndarray:
    """Return how differently joints are turned in each frame [T, J] and where another movement is as far on its way."""
    last, end = len(motion) - 1, len(other) - 1
    pairs = [(motion.rotations[frame], other.rotations[round(frame * end / last)]) for frame in range(last + 1)]
    return np.degrees([(Rotation.from_quat(one).inv() * Rotation.from_quat(two)).magnitude() for one, two in pairs])


def test_what_is_as_the_first_is_said_to_be_so(ballet: Engine, found: list[tuple[Tween, Account]]) -> None:
    tween, _ = found[0]
    said = account(tween, ballet.corpus, usual_likelihoods(ballet), tween.motion)
    assert said.differs == "almost the same as the first"


def test_each_joint_is_accounted_for_from_the_first_moment_to_the_last(found: list[tuple[Tween, Account]]) -> None:
    for tween, said in found:
        times = tween.motion.insertions[0].times
        assert len(said.joints) == len(tween.joints)
        for joint, stretches in zip(tween.joints, said.joints.values(), strict=True):
            assert stretches[0].begins == times[0]
            assert stretches[-1].ends == times[-1]
            assert all(one.ends == other.begins for one, other in pairwise(stretches))
            chain = tween.joints.index(joint)
            assert sum(one.degrees for one in stretches) == pytest.approx(float(tween.costs.degrees[:, chain].sum()))
            bridged = {bridge.move for bridge in tween.bridges if bridge.joint == joint}
            new = [one for one in stretches if one.how == "new"]
            assert all(any(one.begins <= times[move] < one.ends for one in new) for move in bridged)
            assert bool(bridged) == bool(new)


def test_where_a_joint_was_seen_is_a_movement_that_there_is(found: list[tuple[Tween, Account]]) -> None:
    for key, at in {(one.key, one.at) for _, said in found for way in said.joints.values() for one in way if one.key}:
        corpus, _, clip = key.partition("/")
        motion = find_motion(Source(key, "corpus", corpus, clip))
        assert motion.times[0] <= at <= motion.times[-1]


def test_seen_stretches_name_the_place_in_words(ballet: Engine, found: list[tuple[Tween, Account]]) -> None:
    for tween, said in found:
        for way in said.joints.values():
            for one in way:
                assert (one.how == "seen") == bool(one.key)
                assert (one.how == "seen") == one.where.endswith(f" at {clock(one.at)}")
        sources = {key_of(source, ballet.corpus) for row in tween.sources for source in row if source}
        assert {one.key for way in said.joints.values() for one in way} - {""} <= sources


def test_equal_postures_need_no_movement(ballet: Engine) -> None:
    posture = find_posture("ballet/fifth").posture
    (tween,) = find(ballet, posture, posture)
    said = account(tween, ballet.corpus, usual_likelihoods(ballet))
    assert said.words.startswith("no movement")
    assert said.joints == {}


def test_a_wish_that_cannot_be_met_is_an_error(ballet: Engine) -> None:
    with pytest.raises(NoPathError):
        list(
            find(
                ballet,
                find_posture("ballet/arabesque").posture,
                find_posture("ballet/fifth").posture,
                moves=1,
                strict=True,
            )
        )


def test_the_corpus_itself_is_usual(ballet: Engine) -> None:
    own = usual_likelihoods(ballet)
    assert np.all(np.diff(own) >= 0.0)
    assert own[-1] <= 0.0


@pytest.mark.parametrize(("seconds", "shown"), [(0.0, "0:00"), (12.4, "0:12"), (75.0, "1:15"), (3600.0, "60:00")])
def test_times_are_read_off_a_clock(seconds: float, shown: str) -> None:
    assert clock(seconds) == shown
