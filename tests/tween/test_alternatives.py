"""Alternatives: tweens that differ from each other by a share of their states, each with its certificate."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Run

from motionmind.body.motion import Posture
from motionmind.bundled import bundled
from motionmind.errors import MotionMindError, NoPathError
from motionmind.formats import read_posture
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS
from motionmind.tween.engine import Engine
from motionmind.tween.result import Tween

POSTURES = bundled("corpora") / "ballet" / "postures"
A, B = POSTURES / "arabesque.json", POSTURES / "fifth.json"


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def share(one: Tween, other: Tween) -> float:
    """Share of the states on the way that are not the same."""
    return float(np.mean(one.path[1:-1] != other.path[1:-1]))


def find(engine: Engine, ends: tuple[Posture, Posture], count: int, **asked: Any) -> list[Tween]:
    return list(engine.alternatives(*ends, count, **asked))


def check(found: list[Tween], differ: float, gap: float) -> None:
    """Check the constraint, and the certificates: no bound is above the cost of what was found later."""
    for one, other in combinations(found, 2):
        assert len(one.path) == len(other.path)
        assert share(one, other) >= differ - 1e-9
        if one.request.passage == other.request.passage:  # else they are solutions of different problems
            assert one.lower_bound <= other.cost + OPTIMAL_WITHIN_NATS
    for k, tween in enumerate(found):
        assert tween.lower_bound <= tween.cost + OPTIMAL_WITHIN_NATS
        assert tween.gap < gap
        assert tween.costs.total == pytest.approx(tween.cost, abs=1e-6)
        assert tween.differs == pytest.approx([share(tween, other) for other in found[:k]])
        assert (tween.status == "optimal") == (tween.cost - tween.lower_bound <= OPTIMAL_WITHIN_NATS)
        assert tween.asked["unlike"] == k


@pytest.mark.parametrize("names", [("arabesque", "fifth"), ("passe", "plie"), ("bow", "arabesque")])
def test_four_ballet_tweens_differ_and_are_nearly_proven(ballet: Engine, names: tuple[str, str]) -> None:
    a, b = (read_posture(POSTURES / f"{name}.json") for name in names)
    check(find(ballet, (a, b), 4), 0.2, gap=0.05)


def test_four_tweens_of_recorded_dance_differ_and_are_nearly_proven(cmu05: Engine) -> None:
    rng = np.random.default_rng(7)
    ends = []
    for clip in rng.choice(cmu05.corpus.clips, size=2):
        motion = cmu05.corpus.motion(clip)
        ends.append(motion.posture(int(rng.integers(len(motion)))))
    check(find(cmu05, (ends[0], ends[1]), 4), 0.2, gap=0.02)


@pytest.mark.parametrize("asked", [{"differ": 0.5}, {"coordination": "progression"}, {"guide": 0.0}, {"strict": True}])
def test_alternatives_keep_what_else_is_asked(ballet: Engine, asked: dict[str, Any]) -> None:
    ends = read_posture(A), read_posture(B)
    plain = ballet.tween(*ends, **asked)
    check(find(ballet, ends, 2, **asked), asked.get("differ", 0.2), gap=0.05)
    passe = read_posture(POSTURES / "passe.json")
    found = find(ballet, ends, 2, via=[passe], moves=9, pin={"left_wrist": "A"}, **asked)
    check(found, asked.get("differ", 0.2), gap=0.05)
    for tween in found:
        assert len(tween.passed) == 1
        chain = tween.joints.index("left_wrist")
        assert set(tween.path[:-1, chain]) == {plain.path[0, chain]}


def test_samples_differ_by_their_seeds(ballet: Engine) -> None:
    ends = read_posture(A), read_posture(B)
    found = find(ballet, ends, 3, sample=True, seed=5)
    assert [tween.request.search.seed for tween in found] == [5, 6, 7]
    np.testing.assert_array_equal(found[2].path, ballet.tween(*ends, sample=True, seed=7).path)


def test_where_nothing_differs_by_so_much_the_error_says_how_much_can(ballet: Engine) -> None:
    ends = read_posture(A), read_posture(B)
    pinned = {"left_wrist": "A"}
    plain = ballet.tween(*ends, pin=pinned)
    words = r"no path of 7 moves was found that differs by 100\.0% from the earlier one; none can by more than 95\.7%"
    with pytest.raises(NoPathError, match=words) as fault:
        ballet.tween(*ends, pin=pinned, unlike=[plain], differ=1.0)
    most = 22 / 23  # of the joints
    assert fault.value.diagnosis == {"differ": 1.0, "most": pytest.approx(most)}
    farthest = ballet.tween(*ends, pin=pinned, unlike=[plain], differ=most)
    assert farthest.differs == (pytest.approx(most),)
    with pytest.raises(NoPathError):
        ballet.tween(*ends, pin=pinned, unlike=[plain], differ=most + 0.001)
    still = ballet.tween(ends[0], ends[0])
    with pytest.raises(NoPathError, match="in 0 moves nothing on the way can differ; ask for more"):
        ballet.tween(ends[0], ends[0], unlike=[still])


def test_what_contradicts_is_refused(ballet: Engine) -> None:
    ends = read_posture(A), read_posture(B)
    short, long = ballet.tween(*ends, moves=4), ballet.tween(*ends, moves=6)
    with pytest.raises(MotionMindError, match="must have one number of moves, not 4 and 6"):
        ballet.tween(*ends, unlike=[short, long])
    with pytest.raises(MotionMindError, match="the tweens have 4 moves, which moves=6 rules out"):
        ballet.tween(*ends, unlike=[short], moves=6)
    with pytest.raises(MotionMindError, match="samples differ by their seeds"):
        ballet.tween(*ends, unlike=[short], sample=True)
    assert ballet.tween(*ends, unlike=[short], duration=3.0).moves == 4


def test_the_command_line_prints_a_table_and_says_where_there_are_no_more(run: Run) -> None:
    asked = ("tween", A, B, "--corpus", "ballet", "--alternatives", 3)
    printed = run(*asked, "--details").out.splitlines()
    lines = [line for line in printed if line.split()[0] not in ("feet", "warning")]
    assert [line.split()[0] for line in lines] == ["1", "2", "3", "moves", "1", "2", "3", "written"]
    assert ". Path proven optimal, all from ballet. Motion reaches " in lines[0]
    assert printed[1] == "    feet      the left foot stays in place"
    assert " among paths that differ this much" in lines[1]
    assert "; follows " not in lines[0]
    assert all("; follows " in line for line in lines[1:3])
    shares = [int(word.rstrip("%,")) for word in lines[2].split()[-2:]]
    assert min(shares) >= 20
    assert lines[4].endswith("optimal        100.0%        0")
    plain = [line for line in run(*asked).out.splitlines() if line.split()[0] not in ("feet", "warning")]
    assert plain == [*lines[:3], lines[-1]]
    ran = run(*asked, "--differ", 0.9, "-o", "out.json")
    assert ran.code == 0
    assert "note: 2 of 3 found: no path of 7 moves was found that differs by 90.0% from each of 2" in ran.err
    assert [path.name for path in sorted(Path().glob("*.json"))] == ["out-1.json", "out-2.json"]
