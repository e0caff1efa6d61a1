"""Laws of corpora that are mixed, and building them by commands."""

from __future__ import annotations

import json
import math
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bodies import insect, renamed, tumble
from command_line import Run
from walks import (
    POLE,
    STEP,
    assert_rows_sum_to_one,
    counted,
    dance,
    edges,
    expected,
    learned,
    steps,
    walk,
    weights,
)

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.gather import gather
from motionmind.errors import CorpusError, SkeletonError
from motionmind.formats import write_motion, write_posture
from motionmind.geometry import rotations as rot
from motionmind.grammar.coordination import PRIOR_WEIGHT
from motionmind.tween.engine import Engine

BALLET = Path(__file__).parents[2] / "corpora" / "ballet"


@dataclass(frozen=True)
class Home:
    """A folder of corpora."""

    folder: Path

    def keep(self, name: str, clips: Sequence[Motion], **options: Any) -> Engine:
        engine = learned(clips, name=name, home=self.folder, **options)
        engine.save(self.folder / "corpora" / name)
        return engine

    def mix(self, name: str, clips: Sequence[Motion], mix: Mapping[str, float], **options: Any) -> Engine:
        return learned(clips, name=name, mix=mix, home=self.folder, **options)


@pytest.fixture
def home(tmp_path: Path) -> Home:
    return Home(tmp_path / "home")


ONE, TWO = [0, 1, 2, 1, 0, 1], [1, 0, -1, 0, 1, 1, 2]


@pytest.mark.parametrize("weight", [0.25, 0.3, 1.0, 7.0, 1e-6, 1e6])
def test_a_mix_is_the_weighted_union_of_counts(home: Home, weight: float) -> None:
    home.keep("other", [walk("two", TWO)])
    engine = home.mix("mixed", [walk("one", ONE)], {"other": weight})
    counts: dict[tuple[int, int], float] = defaultdict(float, counted([ONE]))
    for move, number in counted([TWO]).items():
        counts[move] += weight * number
    for chain in (0, 1):
        assert weights(engine, chain) == pytest.approx(expected(counts), rel=1e-9, abs=1e-9)
    assert_rows_sum_to_one(engine)
    # P(1 | 0) by hand, so that the counting is checked as well: both of one's moves out of 0, and one of two's two.
    p = math.exp(-weights(engine)[0, 1])
    assert p == pytest.approx((2.0 + weight * 1.0) / (2.0 + weight * 2.0))


def test_how_long_a_move_takes_and_where_it_leads_is_weighed_alike(home: Home) -> None:
    home.keep("other", [walk("two", [0, 1, 0], seconds=0.5)])
    steps_twice = replace(walk("one", [0, 1]), root=np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]]))
    engine = home.mix("mixed", [steps_twice], {"other": 0.25})
    assert edges(engine, engine.grammar.transitions.seconds) == pytest.approx({(0, 1): 0.26, (1, 0): 0.5})
    visits = dict(zip(steps(engine), engine.grammar.transitions.visits[:2].tolist(), strict=True))
    assert visits == {0: 1.5, 1: 1.25}
    np.testing.assert_allclose(engine.statistics.travel[:, 0], 0.5 * np.array([3.0, 1.0, -1.0]))
    np.testing.assert_allclose(engine.statistics.weights, [1.0, 1.0, 0.25, 0.25, 0.25, 1.0, 0.25, 0.25])


def test_the_movement_of_a_mix_goes_the_way_of_the_corpus_that_weighs_more(home: Home) -> None:
    """Both corpora lean the pole by the same steps; one leans the flag to one side, the other to the other."""
    pole, aside = [0, 1, 2, 1, 0], [0, 2, 0, 2, 0]
    home.keep("other", [walk("left", pole, [-flag for flag in aside])])
    leans = []
    for weight in (0.01, 0.2, 1.0, 5.0, 100.0):
        engine = home.mix("mixed", [walk("right", pole, aside)], {"other": weight})
        a, b = (walk("ends", [0, 2], [0, 0]).posture(end) for end in (0, 1))
        tween = engine.tween(a, b, moves=2, liveliness=0.0)
        middle = tween.motion.at(tween.motion.insertions[0].times).rotations[1, 1]
        leans.append(math.degrees(float(rot.log(middle)[2])) / STEP)
    assert np.all(np.diff(leans) < -1e-4)
    assert leans[0] > 0.9 > -0.9 > leans[-1]
    np.testing.assert_allclose(leans, -np.array(leans)[::-1], atol=0.02)  # what one gains the other loses


def test_on_the_way_too_a_movement_hardly_shows_what_weighs_a_hundredth(home: Home) -> None:
    """Both corpora hold the flag alike until half the way is gone, so that walks may go over from one to the other."""
    pole, late = list(range(9)), [0, 0, 0, 0, 1, 2, 2, 2, 0]
    clip = walk("right", pole, late)
    home.keep("other", [walk("left", pole, [-flag for flag in late])])

    def leans(engine: Engine) -> Floats:
        a, b = (walk("ends", [0, 8], [0, 0]).posture(end) for end in (0, 1))
        tween = engine.tween(a, b, moves=8, liveliness=0.0)
        return np.degrees(rot.log(tween.motion.at(tween.motion.insertions[0].times).rotations[4:8, 1])[:, 2])

    alone = leans(learned([clip]))
    assert np.all(alone > 5.0)
    shares = np.array([leans(home.mix("mixed", [clip], {"other": w})) / alone for w in (0.01, 0.2, 1.0, 5.0, 100.0)])
    assert np.all(np.diff(shares.mean(axis=1)) < 0.0)
    assert shares[0].min() > 0.95
    assert shares[-1].max() < -0.95
    assert 0.4 < shares[1].mean() < 0.95


def test_how_joints_stand_together_is_weighed_alike(home: Home) -> None:
    weight, called = 0.3, {}
    one, two = ([0, 1, 1, 0], [0, 0, 1, 1]), ([0, 1, 0], [1, 1, 2])
    home.keep("other", [walk("two", *two)])
    engine = home.mix("mixed", [walk("one", *one)], {"other": weight})
    pairs: dict[tuple[int, int], float] = defaultdict(float)
    for (poles, flags), each in ((one, 1.0), (two, weight)):
        for pole, flag in zip(poles, flags, strict=True):
            pairs[pole, flag] += each
    total = sum(pairs.values())
    called = {"pole": steps(engine, 0), "flag": steps(engine, 1)}
    cpd = engine.network().get_cpds("flag").get_values()
    table = engine.grammar.coordination.table(1, engine.grammar.transitions.starts)
    for p, pole in enumerate(called["pole"]):
        above = sum(number for (above, _), number in pairs.items() if above == pole)
        for c, flag in enumerate(called["flag"]):
            marginal = sum(number for (_, below), number in pairs.items() if below == flag) / total
            probability = (pairs[pole, flag] + PRIOR_WEIGHT * marginal) / (above + PRIOR_WEIGHT)
            assert cpd[c, p] == pytest.approx(probability)
            assert table[p, c] == pytest.approx(-math.log(probability))


def test_of_weight_1_a_mix_is_what_both_files_give(home: Home) -> None:
    home.keep("other", [walk("two", TWO), walk("three", [2, 2, -2])])
    mixed = home.mix("mixed", [walk("one", ONE)], {"other": 1.0})
    plain = learned([walk("one", ONE), walk("two", TWO), walk("three", [2, 2, -2])])
    assert_same_grammar(mixed, plain)
    assert [(clip.name, clip.corpus, clip.weight) for clip in mixed.corpus.clips] == [
        ("one", "", 1.0),
        ("two", "other", 1.0),
        ("three", "other", 1.0),
    ]


def test_only_the_ratios_of_weights_matter(home: Home) -> None:
    home.keep("one", [walk("a", ONE)])
    home.keep("two", [walk("a", TWO)])
    mixes = [home.mix("mixed", [], {"one": w, "two": w / 4.0}, reverse=1.0) for w in (1.0, 4.0, 1e-3)]
    for other in mixes[1:]:
        assert_same_grammar(mixes[0], other)
    assert [clip.weight for clip in mixes[1].corpus.clips] == [1.0, 0.25]
    # The heaviest counts whole, whether it is what is built or what is mixed in.
    assert_same_grammar(mixes[0], home.mix("mixed", [walk("a", ONE)], {"two": 0.25}, reverse=1.0))


def assert_same_grammar(one: Engine, other: Engine) -> None:
    for part in ("transitions", "bridges", "coordination"):
        for name, array in vars(getattr(one.grammar, part)).items():
            np.testing.assert_allclose(getattr(getattr(other.grammar, part), name), array, rtol=1e-12, err_msg=name)
    np.testing.assert_allclose(other.statistics.travel, one.statistics.travel, rtol=1e-12, atol=1e-12)


def test_a_mix_of_mixes_remembers_where_each_clip_is_from(home: Home) -> None:
    home.keep("one", [walk("a", ONE)])
    home.keep("two", [walk("a", TWO)], mix={"one": 0.5}, reverse=2.0)
    engine = home.mix("three", [walk("a", [0, 2])], {"two": 0.5})
    assert [(c.corpus, c.name, c.weight, c.reverse) for c in engine.corpus.clips] == [
        ("", "a", 1.0, None),
        ("two", "a", 0.5, 2.0),
        ("one", "a", 0.25, 2.0),
    ]
    priced = home.mix("three", [walk("a", [0, 2])], {"two": 0.5}, reverse=1.0)
    assert [clip.reverse for clip in priced.corpus.clips] == [1.0, 1.0, 1.0]
    assert [clip.label for clip in engine.corpus.clips] == ["a", "two: a", "one: a"]


def test_what_a_mixed_corpus_has_mirrored_is_not_mirrored_again(home: Home) -> None:
    body = insect()
    home.keep("two", [replace(tumble(body, 0, 4), name="a")], mirror=True)
    engine = home.mix("three", [replace(tumble(body, 1, 4), name="a")], {"two": 1.0}, mirror=True)
    assert [clip.label for clip in engine.corpus.clips] == ["a", "two: a", "two: a (mirrored)", "a (mirrored)"]
    image = mirrored(engine.corpus.motion(engine.corpus.clips[1]))
    np.testing.assert_array_equal(image.rotations, engine.corpus.motion(engine.corpus.clips[2]).rotations)


def test_detail_goes_with_a_corpus_that_is_mixed_in_at_its_rate_or_another(home: Home) -> None:
    shaken = shaking_dance("a")
    one = gather("one", [shaken], rate=5.0)
    for rate in (5.0, None, 2.5):
        mix = gather("two", [], mix=[(one, 0.5)], rate=rate, mirror=True)
        for clip, exact in zip(mix.clips, (shaken, mirrored(shaken)), strict=True):
            found = mix.recording(clip)
            assert rot.angle(found.rotations, exact.at(found.times).rotations).max() < 2e-4


def shaking_dance(name: str) -> Motion:
    """Human23 for 8 s at 30 frames a second, shaking faster than 5 postures a second tell."""
    times = np.arange(241) / 30.0
    phase = np.random.default_rng(1).uniform(0.0, 6.0, (2, 23, 3))
    turns = 0.3 * np.sin(times[:, None, None] + phase[0]) + 0.03 * np.sin(40.0 * times[:, None, None] + phase[1])
    return Motion(human23(), rot.exp(turns), np.zeros((241, 3)), times, name)


def test_postures_of_a_mixed_corpus_are_brought_to_the_rate(home: Home) -> None:
    home.keep("even", [walk("a", range(-4, 5), seconds=0.1)], rate=10.0)
    home.keep("keys", [walk("b", [0, 2], seconds=0.4)])
    engine = home.mix("mixed", [walk("c", [0, 1], seconds=0.2)], {"even": 1.0, "keys": 1.0}, rate=5.0)
    assert engine.corpus.rate == 5.0
    assert [len(clip) for clip in engine.corpus.clips] == [2, 5, 3]
    np.testing.assert_allclose(engine.corpus.seconds, 0.2)
    assert home.mix("mixed", [], {"even": 1.0}).corpus.rate == 10.0
    assert home.mix("mixed", [walk("c", [0, 1])], {"keys": 1.0}).corpus.rate is None
    with pytest.raises(
        CorpusError, match=r"the recordings and corpus 'even' are of different rates \(frame by frame, 10"
    ):
        home.mix("mixed", [walk("c", [0, 1])], {"even": 1.0})
    with pytest.raises(CorpusError, match="corpus 'keys' and corpus 'even' are of different rates"):
        home.mix("mixed", [], {"keys": 1.0, "even": 1.0}, rate=None)
    with pytest.raises(CorpusError, match="corpus 'even' has 10 postures a second; 20 cannot be made of them"):
        home.mix("mixed", [], {"even": 1.0}, rate=20.0)


def test_corpora_are_brought_to_the_recordings_rate_unless_one_is_given(
    home: Home, caplog: pytest.LogCaptureFixture
) -> None:
    home.keep("even", [walk("a", range(-4, 5), seconds=0.1)], rate=10.0)
    home.keep("keys", [walk("b", [0, 2], seconds=0.4)])
    film = walk("c", [0] * 31, seconds=1 / 30)
    with caplog.at_level("INFO"):
        engine = home.mix("mixed", [film], {"keys": 1.0, "even": 1.0}, rate="auto")
    assert "corpus mixed: 5 postures a second, also of 'keys', 'even'" in caplog.messages
    given = home.mix("mixed", [film], {"keys": 1.0, "even": 1.0}, rate=5.0)
    assert engine.corpus.rate == 5.0
    assert np.array_equal(engine.corpus.rotations, given.corpus.rotations)
    assert engine.corpus.clips == given.corpus.clips
    alone = home.mix("mixed", [], {"keys": 1.0, "even": 1.0}, rate="auto")
    assert alone.corpus.rate == 10.0
    assert [len(clip) for clip in alone.corpus.clips] == [5, 9]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"mix": {"other": 0.0}}, "the weight of corpus 'other' must be from 1e-06 to 1e\\+06, not 0"),
        ({"mix": {"other": -1.0}}, "the weight of corpus 'other'"),
        ({"mix": {"other": math.nan}}, "the weight of corpus 'other'"),
        ({"mix": {"other": math.inf}}, "the weight of corpus 'other'"),
        ({"mix": {"nobody": 1.0}}, "no corpus 'nobody'; there are again, "),
        ({"mix": {"ballet": 1.0}}, "corpus 'ballet' is on another skeleton than pole: human23 lacks"),
        ({"mix": {"other": 1.0}, "name": "other"}, "corpus 'other' cannot be mixed into itself"),
        ({"mix": {"other": 1.0, "again": 1.0}}, "two of the corpora to mix are called 'other'"),
        ({"reverse": -0.1}, "the price of a move backwards must be from 0 to 100 nats, not -0.1"),
        ({"reverse": math.nan}, "the price of a move backwards"),
        ({"reverse": 101.0}, "the price of a move backwards"),
    ],
)
def test_what_cannot_be_mixed_is_refused(home: Home, options: dict[str, Any], words: str) -> None:
    home.keep("other", [walk("two", TWO)]).save(home.folder / "corpora" / "again")
    with pytest.raises(CorpusError, match=words):
        learned([walk("one", ONE)], home=home.folder, **options)
    with pytest.raises(CorpusError, match="no recordings given"):
        learned([])


def test_what_cannot_be_mirrored_names_the_clip() -> None:
    arm = Skeleton("arm", ("shoulder", "elbow"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]))
    with pytest.raises(SkeletonError, match=r"^wave: arm cannot be mirrored: elbow has no partner"):
        learned([replace(walk("wave", ONE), skeleton=arm)], mirror=True)


# --- the command line -------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_corpus_is_built_of_files_and_another_corpus_and_tells_it(run: Run) -> None:
    write_motion("walk.json", dance("walk", 1))
    write_motion("spin.json", dance("spin", 2))
    assert run("corpus", "build", "theirs", "spin.json", "--rate", 5).code == 0
    built = run(
        *("corpus", "build", "mine", "walk.json", "--rate", 5, "--tolerance", 20),
        *("--mirror", "--reverse", 1.5, "--mix", "theirs:0.3"),
    )
    assert built.code == 0, built.err
    assert built.err == ""
    table = [line for line in built.out.splitlines() if line.startswith(("learned from", "mine (", "mine ", "theirs"))]
    assert [line.split("  ")[0] for line in table] == [
        *("learned from", "mine", "theirs", "mine (mirrored)", "theirs (mirrored)", "mine (reversed)"),
        *("theirs (reversed)", "mine (mirrored, reversed)", "theirs (mirrored, reversed)"),
    ]
    assert f"{100 / (2.6 * (1.0 + math.exp(-1.5))):.1f}%" in table[1]
    for command in ("check", "info"):
        assert "theirs (mirrored, reversed)" in run("corpus", command, "mine").out
        origins = json.loads(run("corpus", command, "mine", "--json").out)["origins"]
        assert {(row["corpus"], row["weight"]) for row in origins if not row["reversed"]} == {
            ("mine", 1.0),
            ("theirs", 0.3),
        }
    write_posture("A.json", dance("walk", 1).posture(10))
    write_posture("B.json", dance("spin", 2).posture(3))
    tween = run("tween", "A.json", "B.json", "--corpus", "mine", "--report", "report.json", "--details")
    assert tween.code == 0
    assert re.search(r" occur in (mine, theirs|theirs, mine)\b", tween.out)
    assert "transitions occur in the corpus: " in tween.out
    sources = [source for row in json.loads(Path("report.json").read_text("utf-8"))["sources"] for source in row]
    assert {source["corpus"] for source in sources if source} == {"mine", "theirs"}


@pytest.mark.long
def test_a_corpus_is_built_of_other_corpora_alone(run: Run, tmp_path: Path) -> None:
    write_motion("walk.json", dance("walk", 1))
    assert run("corpus", "build", "walks", "walk.json").code == 0
    built = run("corpus", "build", "both", "--mix", "ballet", "--mix", f"{tmp_path / 'home' / 'corpora' / 'walks'}:0.5")
    assert built.code == 0, built.err
    info = json.loads(run("corpus", "info", "both", "--json").out)
    assert [(row["corpus"], row["weight"]) for row in info["origins"]] == [("ballet", 1.0), ("walks", 0.5)]
    assert info["clips"][-1]["name"] == "walks: walk"
    assert (info["skeleton"], info["facing"], info["rate"]) == ("human23", "free", None)


def test_a_stranger_from_a_file_is_mirrored(run: Run) -> None:
    body = renamed("suffix of Blender")
    write_motion("walk.bvh", replace(dance("walk", 1), skeleton=body))
    built = run("corpus", "build", "strangers", "walk.bvh", "--mirror")
    assert built.code == 0, built.err
    states = json.loads(run("corpus", "info", "strangers", "--json").out)["states"]
    assert "knee.L" in states
    assert all(states[name] == states[name.replace(".L", ".R")] for name in states if name.endswith(".L"))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("corpus build mine", r"Missing argument 'FILES\.\.\.', or --mix"),
        (
            "corpus build mine walk.json --mix theirs:some",
            "--mix theirs:some: give a corpus and its weight, such as ball",
        ),
        ("corpus build mine walk.json --mix theirs:", "--mix theirs:: give a corpus and its weight"),
        ("corpus build mine walk.json --mix theirs:0", "the weight of corpus 'theirs' must be from 1e-06"),
        ("corpus build mine walk.json --mix theirs:-2", "the weight of corpus 'theirs' must be from 1e-06"),
        ("corpus build mine walk.json --mix theirs:nan", "the weight of corpus 'theirs' must be from 1e-06"),
        ("corpus build mine walk.json --mix theirs --mix theirs:2", "--mix theirs:2: theirs is given twice"),
        ("corpus build mine walk.json --mix nobody:0.3", "no corpus 'nobody'; there are ballet, "),
        ("corpus build theirs walk.json --mix theirs:0.3 --replace", "corpus 'theirs' cannot be mixed into itself"),
        ("corpus build mine walk.json --mix theirs", "are of different rates .frame by frame, 5 postures a second"),
        ("corpus build mine walk.json --mix theirs --rate 10", "has 5 postures a second; 10 cannot be made of them"),
        (
            "corpus build mine pole.json --mix theirs --rate 5",
            "corpus 'theirs' is on another skeleton than pole: human23",
        ),
        (
            "corpus build mine pole.json --mirror",
            "pole: pole cannot be mirrored: flag has no partner: it stands 1 m off",
        ),
        ("corpus build mine walk.json --reverse -1", "'--reverse': -1.0 is not in the range"),
        ("corpus build mine walk.json --reverse nan", "'--reverse': nan is not a finite number"),
        ("corpus build mine --reverse walk.json", "'--reverse': 'walk.json' is not a valid"),
    ],
)
def test_what_cannot_be_built_is_one_line(line: str, message: str, run: Run, tmp_path: Path) -> None:
    write_motion("walk.json", dance("walk", 1))
    aside = replace(POLE, offsets=np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    write_motion("pole.json", replace(walk("pole", ONE), skeleton=aside))
    assert run("corpus", "build", "theirs", "walk.json", "--rate", 5).code == 0
    before = sorted(tmp_path.rglob("*"))
    ran = run(*line.split())
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.count("\n") == 1
    assert ran.err.startswith("error: ")
    assert re.search(message, ran.err)
    assert sorted(tmp_path.rglob("*")) == before
