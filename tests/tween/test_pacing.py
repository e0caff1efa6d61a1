"""A duration of its own: it grows with the way, keeps within the corpus's speeds, and `pace` scales it."""

from __future__ import annotations

import re
import warnings
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from command_line import Run

from motionmind.body.contact import lowest_height
from motionmind.body.motion import Posture
from motionmind.bundled import bundled
from motionmind.errors import MotionMindError, MotionMindWarning, NoPathError
from motionmind.formats import read_posture
from motionmind.geometry import rotations as rot
from motionmind.learned.pace import way_between, way_of
from motionmind.synthesis.detour import detour
from motionmind.synthesis.retime import JOINT_SPEED_RATIO
from motionmind.tween.engine import Engine
from motionmind.tween.pacing import usual_times
from motionmind.tween.report import read_report
from motionmind.tween.request import TweenRequest
from motionmind.tween.result import Tween
from motionmind.variation.variation import vary

POSTURES = bundled("corpora") / "ballet" / "postures"
A, B, PASSE = POSTURES / "arabesque.json", POSTURES / "fifth.json", POSTURES / "passe.json"
ENDS = read_posture(A), read_posture(B)
FRAMES = 1.5 / 30.0  # seconds: a length is rounded to half a frame, and twice another by a whole one


@pytest.fixture(scope="module", params=["ballet", "walk-hexapod"])
def engine(request: pytest.FixtureRequest) -> Engine:
    return Engine.load(request.param)


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


_FOUND: dict[tuple[object, ...], Tween] = {}


def tween_of(engine: Engine, a: Posture, b: Posture, **asked: Any) -> Tween:
    """The engine's tween, found once for all tests that ask for the same, for it would be the same to the byte."""
    ends = tuple(array.tobytes() for end in (a, b) for array in (end.rotations, end.root))
    key = (engine.corpus.name, *ends, repr(TweenRequest.of(**asked)))
    if key not in _FOUND:
        _FOUND[key] = engine.tween(a, b, **asked)
    return _FOUND[key]


def seconds(tween: Tween) -> float:
    return float(tween.motion.times[-1])


def ends(engine: Engine, seed: int = 0) -> tuple[Posture, Posture]:
    corpus = engine.corpus
    pair = np.random.default_rng(seed).integers(len(corpus), size=2)
    a, b = (Posture(corpus.skeleton, corpus.rotations[k], corpus.root[k]) for k in pair)
    return a, b


def moved(posture: Posture, heights: float, radians: float) -> Posture:
    """The posture elsewhere, facing elsewhere."""
    rotations = posture.rotations.copy()
    rotations[0] = rot.mul(rot.about_vertical(np.array(radians)), rotations[0])
    return Posture(posture.skeleton, rotations, posture.root + np.array([heights * posture.skeleton.height, 0.0, 0.0]))


def test_in_the_least_time_the_smoothest_movement_has_the_fastest_speeds(engine: Engine) -> None:
    """The smoothest movement goes 10 s^3 - 15 s^4 + 6 s^5 of its way: Flash and Hogan (1985)."""
    a, b = ends(engine)
    (time,) = usual_times(engine, (a, b))
    share = np.linspace(0.0, 1.0, 1001)
    peak = np.gradient(10.0 * share**3 - 15.0 * share**4 + 6.0 * share**5, share).max()
    parts, fastest = way_between(a, b).parts, engine.pace.fastest
    assert (peak * parts / time.least / fastest).max() == pytest.approx(1.0, abs=1e-3)
    slowest = [*engine.corpus.skeleton.names, "turning", "travel"].index(time.slowest)
    assert (parts / fastest).argmax() == slowest


@pytest.mark.long
@pytest.mark.parametrize("by", [(1.0, 0.0), (0.0, 1.0)])
def test_the_farther_the_longer(engine: Engine, by: tuple[float, float]) -> None:
    a, b = ends(engine)
    here = Posture(b.skeleton, b.rotations, a.root)
    heading = float(rot.heading(here.rotations[0]) - rot.heading(a.rotations[0]))
    here = moved(here, 0.0, -heading)  # so that every turn is a longer one
    taken = [seconds(engine.tween(a, moved(here, by[0] * far, by[1] * far))) for far in (0.0, 1.0, 3.0)]
    # Moves take as long as the corpus takes for those that a path makes, which is another one each time.
    assert all(after > 0.9 * before for before, after in pairwise(taken))
    assert taken[-1] > 1.2 * taken[0]


@pytest.mark.long
def test_it_takes_about_as_long_as_the_corpus_does(engine: Engine) -> None:
    off = []
    for seed in range(8):
        tween = tween_of(engine, *ends(engine, seed))
        (time,) = tween.times
        off.append(np.log(seconds(tween) / max(time.median, time.least)))
    assert abs(np.median(off)) < 0.25


@pytest.mark.long
def test_without_pace_fewer_moves_are_made(engine: Engine) -> None:
    own = [tween_of(engine, *ends(engine, seed)).moves for seed in range(4)]
    fewer = [engine.tween(*ends(engine, seed), without=["pace"]).moves for seed in range(4)]
    assert np.mean(fewer) < np.mean(own)


@pytest.mark.long
def test_the_choice_does_not_depend_on_what_else_might_have_been_chosen(engine: Engine) -> None:
    own = tween_of(engine, *ends(engine))
    more = engine.tween(*ends(engine), max_moves=2 * own.moves + 30)
    assert own.length is not None
    assert more.length is not None
    assert (more.moves, more.length.cost) == (own.moves, pytest.approx(own.length.cost))
    assert engine.tween(*ends(engine), max_moves=own.moves - 1).moves == own.moves - 1
    assert engine.tween(*ends(engine), moves=(own.moves + 1, own.moves + 4)).moves == own.moves + 1


@pytest.mark.long
@pytest.mark.parametrize("asked", [{"guide": 0.0}, {"coordination": "progression"}, {"pin": {"left_wrist": "A"}}])
def test_it_is_chosen_in_the_same_way_whatever_else_is_asked(ballet: Engine, asked: dict[str, Any]) -> None:
    found = ballet.tween(*ENDS, **asked)
    assert found.length is not None
    assert found.length.lower_bound_elsewhere >= found.length.cost - 1e-6
    assert abs(found.moves - tween_of(ballet, *ENDS).moves) <= 1
    assert found.status == "optimal"


@pytest.mark.long
def test_each_segment_between_vias_has_its_time(ballet: Engine) -> None:
    near, far = read_posture(PASSE), moved(read_posture(PASSE), 2.0, 0.0)
    usual = ballet.tween(*ENDS, via=[near])
    goes = ballet.tween(*ENDS, via=[far])
    assert usual.moves > tween_of(ballet, *ENDS).moves
    assert len(usual.times) == len(goes.times) == 2
    legs = [np.diff([0, *tween.passed, tween.moves]) for tween in (usual, goes)]
    assert np.all(legs[1] >= legs[0])
    assert legs[1].sum() > legs[0].sum()


@pytest.mark.long
@pytest.mark.parametrize("pace", [0.5, 1.25, 2.0])
def test_pace_scales_the_time_and_not_the_moves(engine: Engine, pace: float) -> None:
    own, other = (tween_of(engine, *ends(engine), pace=one) for one in (1.0, pace))
    assert other.moves == own.moves
    # Feet and knees need something else at another pace, and the clock waits for them.
    assert seconds(other) == pytest.approx(seconds(own) / pace, rel=0.05, abs=1.0 / 30.0)
    for end, frame in (("a", 0), ("b", -1)):
        np.testing.assert_array_equal(other.motion.rotations[frame], own.motion.rotations[frame], err_msg=end)
    given = engine.tween(*ends(engine), pace=pace, moves=4)
    assert seconds(given) == pytest.approx(seconds(tween_of(engine, *ends(engine), moves=4)) / pace, abs=FRAMES)


@pytest.mark.long
@pytest.mark.parametrize("pace", [0.5, 0.3, 0.15])
@pytest.mark.parametrize("name", ["karate", "ballet"])
def test_who_is_slower_takes_no_longer_than_in_proportion(name: str, pace: float) -> None:
    """Feet, falls and the weight are as quick at any pace: they do not make a slow movement slower still."""
    known = Engine.load(name)
    drawn = np.random.default_rng(3).integers(len(known.corpus), size=(2, 2))
    for pair in drawn:
        a, b = (Posture(known.corpus.skeleton, known.corpus.rotations[k], known.corpus.root[k]) for k in pair)
        own, other = (seconds(tween_of(known, a, b, pace=one)) for one in (1.0, pace))
        assert 0.85 < other * pace / own < 1.1


@pytest.mark.long
def test_nothing_sinks_into_the_floor_before_the_end() -> None:
    known = Engine.load("karate")
    clips = {clip.label: known.corpus.motion(clip) for clip in known.corpus.clips}
    pairs = ("heian-shodan", 53, "taikyoku-shodan", 48), ("taikyoku-shodan", 90, "heian-sandan", 47)
    for a, frame, b, to in pairs:
        motion = known.tween(clips[a].posture(frame), clips[b].posture(to)).motion
        low = lowest_height(motion.skeleton, motion.rotations, motion.root)
        assert low.min() > min(low[0], low[-1], 0.0) - 0.0035


@pytest.mark.long
@pytest.mark.parametrize("long", [7.0, 12.0, 30.0])
def test_who_has_time_is_nowhere_faster_than_the_corpus(ballet: Engine, long: float) -> None:
    tween = ballet.tween(*ENDS, duration=long)
    assert tween.motion.times[-1] == pytest.approx(long)
    speeds = way_of(tween.motion).parts / np.diff(tween.motion.times)[:, None]
    assert np.all(speeds.max(axis=0) < 1.05 * ballet.pace.greatest)


@pytest.mark.parametrize("asked", [{"pace": 0.0}, {"pace": -1.0}, {"pace": np.inf}, {"pace": 1.2, "duration": 2.0}])
def test_a_pace_that_cannot_be_is_refused(asked: dict[str, float]) -> None:
    with pytest.raises(MotionMindError, match="pace"):
        TweenRequest.of(**asked)  # type: ignore[arg-type]


@pytest.mark.long
def test_insertions_of_variations_take_it(ballet: Engine) -> None:
    piece = ballet.corpus.motion(ballet.corpus.clips[0])
    times = {}
    for pace in (1.0, 2.0):
        variation = vary(piece, ballet, nudge=1.0, length=30, alternatives=1, pace=pace)
        made = [seam.insertion.motion for seam in variation.seams if seam.insertion]
        assert made
        times[pace] = [float(motion.times[-1]) for motion in made]
    np.testing.assert_allclose(times[1.0], np.multiply(2.0, times[2.0]), atol=FRAMES)


@pytest.mark.long
def test_the_command_line_takes_it(run: Run) -> None:
    own, fast, old = (
        run("tween", A, B, "--corpus", "ballet", *asked, "--report", "-").json
        for asked in ((), ("--pace", 2), ("--without", "pace"))
    )
    assert fast["times"][-1] == pytest.approx(own["times"][-1] / 2.0, abs=FRAMES)
    assert (fast["asked"]["pace"], fast["moves"]) == (2.0, own["moves"])
    assert old["moves"] < own["moves"]
    assert run("tween", A, B, "--corpus", "ballet", "--pace", 0).code == 2


# --- forced --------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_duration_that_its_moves_cannot_make_is_made_from_the_fewest_that_can(engine: Engine) -> None:
    usual = float(np.median(engine.corpus.moves.seconds))
    more = 0
    for seed in range(6):
        a, b = ends(engine, seed)
        tween = engine.tween(a, b, duration=usual)
        assert seconds(tween) == pytest.approx(usual)
        if tween.tempo.usual_moves is None:
            assert tween.moves == 1
            continue
        more += 1
        assert tween.tempo.usual_moves == 1 < tween.moves
        for moves in range(1, tween.moves):
            with pytest.raises(NoPathError):
                engine.tween(a, b, duration=usual, moves=moves)
    assert more > 3


def test_a_given_number_of_moves_that_is_impossible_stays_an_error(ballet: Engine) -> None:
    with pytest.raises(NoPathError, match="allow more moves"):
        ballet.tween(*ENDS, moves=3)


def test_who_is_hurried_is_told_of_it_by_part(ballet: Engine) -> None:
    with pytest.warns(MotionMindWarning, match=r"faster than anything in the corpus: \w+ \d\.\d times"):
        tween = ballet.tween(*ENDS, duration=0.3)
    pace, way = ballet.pace, way_of(tween.motion)
    times = (way.parts / np.diff(tween.motion.times)[:, None]).max(axis=0) / pace.greatest
    worst = tween.tempo.faster[0]
    assert worst.part == [*ballet.corpus.skeleton.names, "turning", "travel"][times.argmax()]
    assert worst.times == pytest.approx(times.max())
    assert [one.times for one in tween.tempo.faster] == sorted((one.times for one in tween.tempo.faster), reverse=True)


@pytest.mark.long
def test_what_takes_its_own_time_is_not_faster_than_the_corpus(engine: Engine) -> None:
    """Of the corpus's own frames a hundredth is; what holds the feet moves the legs as it must."""
    shares = []
    for without in (["bounce", "balance", "flight", "steps", "limbs"], ["pace"]):
        fast = []
        with warnings.catch_warnings():
            warnings.simplefilter("error", MotionMindWarning)
            for seed in range(6):
                motion = engine.tween(*ends(engine, seed), without=without).motion
                speeds = way_of(motion).parts / np.diff(motion.times)[:, None]
                fast.append(speeds[:, : len(motion.skeleton)] > engine.pace.fastest[: len(motion.skeleton)])
        shares.append(np.concatenate(fast).mean())
    assert shares[0] < 0.01 < 0.5 * shares[1]


@pytest.mark.long
def test_no_joint_is_much_faster_than_nearly_all_of_the_corpus(ballet: Engine) -> None:
    """Of the adagio's postures, between which steps that the feet take are quick."""
    corpus, (start,) = ballet.corpus, [clip.start for clip in ballet.corpus.clips if clip.name == "adagio"]
    for pair in ((56, 43), (39, 22), (20, 39), (54, 43)):
        a, b = (Posture(corpus.skeleton, corpus.rotations[start + k], corpus.root[start + k]) for k in pair)
        motion = ballet.tween(a, b).motion
        speeds = way_of(motion).parts / np.diff(motion.times)[:, None]
        assert (speeds / ballet.pace.fastest)[:, : len(corpus.skeleton)].max() < 1.02 * JOINT_SPEED_RATIO


@pytest.mark.long
def test_who_has_too_much_time_fills_it_as_the_corpus_does(engine: Engine) -> None:
    still, filled = [], []
    for seed in range(4):
        a, b = ends(engine, seed)
        long = 4.0 * seconds(tween_of(engine, a, b))
        plain, tween = (engine.tween(a, b, duration=long, without=names, liveliness=0.0) for names in (["pace"], []))
        assert not plain.tempo.detours
        assert seconds(tween) == pytest.approx(long)
        np.testing.assert_array_equal(tween.motion.rotations[[0, -1]], [a.rotations, b.rotations])
        if tween.tempo.detours:
            still.append(plain.tempo.creeps)
            filled.append(tween.tempo.creeps)
    assert filled
    assert np.mean(filled) < 0.85 * np.mean(still)


def test_a_detour_goes_on_from_its_beginning_and_comes_to_its_end_as_the_corpus_does(engine: Engine) -> None:
    corpus, joints = engine.corpus, len(engine.corpus.skeleton)
    clip = max(corpus.clips, key=len)
    chains = corpus.to_chains(corpus.rotations)
    first, last = clip.start, clip.stop - 1
    path = detour(corpus, engine.statistics, (chains[first], chains[last]), 12, 4)
    assert path.shape == (13, joints, 4)
    shown = chains[:, :joints]
    off = [float(rot.angle(shown, pose).mean(axis=1).min()) for pose in path]
    assert sum(degrees < 1e-6 for degrees in off) >= 9  # as recorded, but for the four moves that join
    np.testing.assert_allclose(rot.angle(path[[0, -1]], shown[[first, last]]), 0.0, atol=1e-6)


def test_the_report_and_the_summary_say_why_it_takes_so_long(run: Run) -> None:
    ran = run("tween", A, B, "--corpus", "ballet", "--duration", 0.3, "--report", "r.json", "--details")
    assert "note: faster than anything in the corpus" in ran.err
    line = next(line for line in ran.out.splitlines() if line.startswith("pace "))
    assert re.search(r"typical duration for this distance: 2\.\d+ s", line)
    assert "1 move of typical length fits the duration but does not reach B" in line
    tempo = read_report("r.json").tempo
    assert tempo is not None
    assert tempo.usual_moves == 1
    assert tempo.faster[0].part == "pelvis"
    assert tempo.usual > tempo.least > 0.0
