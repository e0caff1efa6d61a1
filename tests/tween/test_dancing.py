"""Passages by their names; movements that follow them from A to B; what dancing leaves as it was asked for."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from itertools import combinations
from typing import Any

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.motion import Motion, Posture
from motionmind.bundled import bundled
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.gather import gather
from motionmind.discretize.codebook import Codebook
from motionmind.errors import MotionMindError, NoPathError
from motionmind.formats import read_posture
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import rotation_spline
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS
from motionmind.synthesis import reference
from motionmind.tween.engine import Engine
from motionmind.tween.modes import N_COMPARED, Modes, find_place
from motionmind.tween.result import Tween
from motionmind.walks.passages import Danced, Place

POSTURES = bundled("corpora") / "ballet" / "postures"


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


@pytest.fixture(scope="module")
def ends() -> tuple[Posture, Posture]:
    return read_posture(POSTURES / "arabesque.json"), read_posture(POSTURES / "fifth.json")


def dance(name: str, count: int, seed: int = 0, begin: float = 0.0) -> Motion:
    rng = np.random.default_rng(seed)
    rotations = rot.exp(np.cumsum(rng.normal(0.0, 0.1, (count, 23, 3)), axis=0))
    return Motion(
        human23(), rotations, np.tile([0.0, 0.9, 0.0], (count, 1)), begin + 0.2 * np.arange(float(count)), name
    )


def posture(corpus: Corpus, row: int) -> Posture:
    return Posture(corpus.skeleton, corpus.rotations[row], corpus.root[row])


# --- names ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def corpus() -> Corpus:
    """Clips with mirror images, one with an odd name, some taken from another corpus."""
    other = gather("other", [dance("solo", 4, 2)])
    clips = [dance("solo", 5, 0, 1.0), dance("a@2s", 9, 1)]
    return gather("own", clips, mirror=True, mix=[(other, 1.0)])


def test_names_of_places_lead_back_to_them(corpus: Corpus) -> None:
    labels = [clip.label for clip in corpus.clips]
    assert len(set(labels)) == len(labels) >= 5
    assert any(label.endswith("(mirrored)") for label in labels)
    for number, clip in enumerate(corpus.clips):
        times = corpus.times[clip.start : clip.stop]
        for seconds in (times[0], times[1] + 0.05, times[-1]):
            for words in (f"{clip.label}@{seconds:.3f}s", f"{clip.label}@{seconds:.3f}"):
                place = find_place(corpus, words)
                assert place.clip == number
                assert place.seconds == pytest.approx(float(seconds), abs=1e-3)
    assert find_place(corpus, "a@2s@.5") == Place(labels.index("a@2s"), 0.5)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("solo", "give a clip and a time in it, such as adagio@3.2s"),
        ("solo@", "give a clip and a time in it"),
        ("@1.2s", "give a clip and a time in it"),
        ("solo@-1s", "give a clip and a time in it"),
        ("solo@1e3s", "give a clip and a time in it"),
        ("solo@\u0661s", "give a clip and a time in it"),
        ("sollo@1.2s", "own has no such clip; did you mean solo?"),
        ("zzz@1.2s", "own has no such clip$"),
        ("solo@0.9s", r"the clip lasts from 1\.00 s to 1\.80 s of its recording"),
        ("solo@1.81s", r"the clip lasts from 1\.00 s to 1\.80 s of its recording"),
        ("\x1b[31m\n@1s", "own has no such clip"),
    ],
)
def test_what_is_no_place_is_refused_in_one_line(corpus: Corpus, name: str, words: str) -> None:
    with pytest.raises(MotionMindError, match=words) as fault:
        find_place(corpus, name)
    message = str(fault.value)
    assert message.isprintable()
    assert message.startswith("passage ")


def test_modes_yield_names_of_places(ballet: Engine, ends: tuple[Posture, Posture]) -> None:
    first = ballet.tween(*ends).motion
    modes = Modes(ballet, first, False, False)
    names = list(modes)
    assert len(names) == len(set(names)) > 4
    for name in names:
        find_place(ballet.corpus, name)
    (known,) = modes._known
    assert len(known) == N_COMPARED
    assert rot.angle(known[[0, -1]], first.rotations[[0, -1]]).max() < 1e-7


# --- alternatives -----------------------------------------------------------------------------------------------------


def rows_of(tween: Tween, count: int = 61) -> Floats:
    """A motion's rotations at even times."""
    motion = tween.motion
    return rotation_spline(motion.times, motion.rotations, np.linspace(motion.times[0], motion.times[-1], count))


def check(found: Sequence[Tween]) -> None:
    """Check that movements follow passages of their own, differ, and are proven to be the best that do."""
    names = [tween.request.passage for tween in found]
    assert names[0] is None
    assert len(set(names)) == len(names)
    assert len({tween.moves for tween in found}) == 1
    for number, tween in enumerate(found):
        assert len(tween.differs) == number
        assert min(tween.differs, default=1.0) >= 0.2 - 1e-9
        assert tween.lower_bound <= tween.cost + OPTIMAL_WITHIN_NATS


def check_again(engine: Engine, ends: tuple[Posture, Posture], found: Sequence[Tween], number: int) -> None:
    """Check that a movement is found again by its passage and what it is unlike."""
    asked: dict[str, Any] = {"passage": found[number].request.passage, "unlike": found[:number]}
    again = engine.tween(*ends, **asked)
    np.testing.assert_array_equal(again.path, found[number].path)
    np.testing.assert_array_equal(again.motion.rotations, found[number].motion.rotations)
    np.testing.assert_array_equal(again.motion.root, found[number].motion.root)


def test_alternatives_of_ballet_follow_other_passages(ballet: Engine, ends: tuple[Posture, Posture]) -> None:
    found = list(ballet.alternatives(*ends, 4))
    check(found)
    check_again(ballet, ends, found, 2)
    shown = [rows_of(tween) for tween in found]
    off = [np.degrees(rot.angle(one, other).mean()) for one, other in combinations(shown, 2)]
    assert min(off) >= 5.0
    for tween in found[1:]:
        assert tween.request.passage is not None
        place = find_place(ballet.corpus, tween.request.passage)
        assert {source.clip for source in tween.detail} == {ballet.corpus.clips[place.clip].name}


def test_alternatives_of_recorded_dance_follow_other_passages(cmu05: Engine) -> None:
    ends = posture(cmu05.corpus, 40), posture(cmu05.corpus, 300)
    found = list(cmu05.alternatives(*ends, 4))
    check(found)
    check_again(cmu05, ends, found, 3)


@pytest.mark.parametrize("count", [2, 3, 8])
def test_alternatives_of_a_single_short_clip_are_variants_or_refused(count: int) -> None:
    engine = Engine.fit([dance("alone", count)], discretization=Codebook(15.0))
    ends = posture(engine.corpus, 0), posture(engine.corpus, count - 1)
    several = engine.alternatives(*ends, 3, differ=0.05)
    found = [next(several)]
    with suppress(NoPathError):
        found.extend(several)
    assert len(found) == 3 or count < 8
    for tween in found:
        assert rot.angle(tween.motion.rotations[-1], ends[1].rotations).max() < 1e-7


# --- what dancing leaves as it is -------------------------------------------------------------------------------------


@pytest.mark.parametrize("liveliness", [0.0, 0.3, 1.0])
def test_ends_are_exact_however_lively(cmu05: Engine, liveliness: float) -> None:
    ends = posture(cmu05.corpus, 40), posture(cmu05.corpus, 300)
    motion = cmu05.tween(*ends, liveliness=liveliness).motion
    for end, frame in zip(ends, (0, -1), strict=True):
        assert rot.angle(end.rotations, motion.rotations[frame]).max() < 1e-7
    np.testing.assert_allclose(motion.root[0], ends[0].root, atol=1e-9)


@pytest.mark.parametrize("joint", ["left_elbow", "left_wrist"])
def test_a_pinned_joint_stays_however_lively(ballet: Engine, ends: tuple[Posture, Posture], joint: str) -> None:
    free, pinned = (ballet.tween(*ends, liveliness=1.0, pin=pin) for pin in ({}, {joint: "A"}))
    chain = pinned.joints.index(joint)
    assert set(pinned.path[:-1, chain]) == {free.path[0, chain]}
    assert pinned.followed[:-1, chain].all()


def test_a_held_joint_stays_however_lively(cmu05: Engine) -> None:
    ends = posture(cmu05.corpus, 40), posture(cmu05.corpus, 300)
    free = cmu05.tween(*ends, liveliness=1.0)
    away = rot.angle(free.motion.rotations, free.motion.rotations[0]).max(axis=0)
    away[(free.path[0] != free.path[-1])[: len(away)]] = 0.0
    joint = free.joints[int(away.argmax())]
    assert away.max() > np.radians(5.0)
    held = cmu05.tween(*ends, liveliness=1.0, hold=[joint])
    chain = held.joints.index(joint)
    assert set(held.path[:, chain]) == {held.path[0, chain]}
    assert held.followed[:, chain].all()


def test_no_joint_leaves_its_states_to_dance(
    ballet: Engine, ends: tuple[Posture, Posture], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[tuple[tuple[Any, ...], Danced]] = []
    danced_as = reference._follow_passage

    def spy(*arguments: Any) -> Danced | None:
        found = danced_as(*arguments)
        assert found is not None
        calls.append((arguments, found))
        return found

    monkeypatch.setattr(reference, "_follow_passage", spy)
    ballet.tween(*ends, liveliness=1.0, pin={"left_elbow": "A"})
    ballet.tween(*ends[::-1], liveliness=1.0)
    assert len(calls) == 2
    for (walk, clock, _, states, style, wishes), danced in calls:
        chains, tolerances, fixed = walk.chains(style.corpus, clock.moves), style.tolerances, wishes.fixed
        moved = danced.move(chains, clock.moves)
        joints = danced.off.shape[1]
        before, after = (rot.angle(found[:, :joints], states[:, :joints]) for found in (chains, moved))
        within = tolerances[:joints] + 1e-6
        assert np.all((after <= within) | (before > within))
        # Who is outside goes hardly farther: moves fall between the times of the displacements.
        assert np.all((after <= within) | (after <= before + np.radians(0.5)))
        np.testing.assert_array_equal(danced.off[:, fixed[:joints]], 0.0)
        assert rot.norm(danced.off).max() > np.radians(5.0)
    assert calls[0][0][-1].fixed.any()
