"""What each restriction costs: against the same tween without it, and on the command line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Run
from toys import best, random_toy

from motionmind._typing import Floats
from motionmind.bundled import bundled
from motionmind.cli.printing import format_what_if
from motionmind.errors import MotionMindError
from motionmind.formats import read_posture
from motionmind.search.length import choose_length
from motionmind.search.solve import solve
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS
from motionmind.synthesis.timeline import usual
from motionmind.tween.engine import Engine
from motionmind.tween.report import read_report
from motionmind.tween.request import TweenRequest
from motionmind.tween.result import Tween
from motionmind.tween.what_if import Answer, WhatIf, find_what_if

POSTURES = bundled("corpora") / "ballet" / "postures"
A, B, PASSE = POSTURES / "arabesque.json", POSTURES / "fifth.json", POSTURES / "passe.json"
ENDS = read_posture(A), read_posture(B)
SAME = 4 * OPTIMAL_WITHIN_NATS
MOVES = 5


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


_FOUND: dict[str, Tween] = {}


def tween_of(engine: Engine, **asked: Any) -> Tween:
    """The engine's tween between both ends, found once for all that ask for the same."""
    key = repr(TweenRequest.of(**asked))
    if key not in _FOUND:
        _FOUND[key] = engine.tween(*ENDS, **asked)
    return _FOUND[key]


def without(asked: dict[str, Any], name: str) -> dict[str, Any]:
    """The same request without what a name says."""
    kind, _, rest = name.partition(" ")
    if kind == "pin":
        joint = rest.partition("=")[0]
        return asked | {"pin": {other: end for other, end in asked["pin"].items() if other != joint}}
    if kind == "avoid":
        return asked | {"avoid": [pair for pair in asked["avoid"] if f"{pair[0]}={pair[1]}" != rest]}
    if kind == "via":
        return asked | {"via": []}
    return asked | {"moves": None, "duration": None}


def check_prices_on_toy(seed: int, gap: float) -> list[bool]:
    """Check what it costs chain 0 to avoid a state in a given number of moves; return which prices are proven.

    Certificates are off by up to `gap` nats, as those of searches that ended early.
    """
    toy, rng = random_toy(seed, frustrated=True), np.random.default_rng(seed)
    costs = rng.uniform(-2.0, 3.0, (MOVES - 1, sum(toy.sizes)))
    free = rng.random(sum(toy.sizes)) >= 0.1
    avoiding = free & (np.arange(len(free)) != 0)
    asked = TweenRequest(moves=MOVES, avoid=[("chain0", 0)])

    def guide(moves: int) -> Floats:
        return costs[: moves - 1]

    def answer(request: TweenRequest) -> Answer:
        rules = toy.rules(*((1, MOVES) if request.moves is None else request.move_range))
        problem = toy.problem(rules, guide=guide, allowed=avoiding if request.avoid else free)
        found, (dearer, lower) = solve(problem), gap * rng.random(2)
        return Answer(request, problem, replace(found, cost=found.cost + dearer, lower_bound=found.lower_bound - lower))

    if best(toy, [MOVES], avoiding, [], guide) == np.inf:
        return []
    found = find_what_if(answer(asked), answer)
    assert [one.without for one in found] == ["avoid chain0=0", f"moves {MOVES}"]
    for one, allowed, counts in zip(found, (free, avoiding), ([MOVES], range(1, MOVES + 1)), strict=True):
        assert (one.compared == "cost") == (one.moves == 0)
        judge = guide if one.compared == "cost" else None
        freed = best(toy, [MOVES] if one.compared == "cost" else counts, allowed, [], judge)
        assert one.least - SAME <= best(toy, [MOVES], avoiding, [], judge) - freed <= one.most + SAME
        assert one.least >= 0.0
    return [bool(one.proven) for one in found]


def test_on_toys_the_true_difference_lies_between_the_bounds() -> None:
    exact = [proven for seed in range(60) for proven in check_prices_on_toy(seed, gap=0.0)]
    early = [proven for seed in range(60) for proven in check_prices_on_toy(seed, gap=1.0)]
    assert all(exact)
    assert len(exact) == len(early) > 50
    assert 0.0 < np.mean(early) < 0.9  # those of other lengths are searched anew


@pytest.mark.long
@pytest.mark.parametrize("budget", [1, 200_000])
@pytest.mark.parametrize(
    "asked",
    [
        {"moves": 7, "pin": {"left_wrist": "A", "right_knee": "B"}, "avoid": [("left_knee", "plie 56")]},
        {"via": [read_posture(PASSE)], "pin": {"left_wrist": "B"}},
        {"duration": 3.0, "pin": {"left_wrist": "A"}, "strict": True},
        {"moves": (6, 9), "guide": 0.0, "coordination": "progression"},
    ],
)
def test_a_price_is_the_difference_to_the_tween_without_the_restriction(
    ballet: Engine, asked: dict[str, Any], budget: int
) -> None:
    found = ballet.tween(*ENDS, what_if=True, node_budget=budget, **asked)
    kinds = {"moves" if key == "duration" else key for key in asked} & {"pin", "avoid", "via", "moves"}
    assert {one.without.split()[0].replace("duration", "moves") for one in found.what_if} == kinds
    best = tween_of(ballet, **asked)
    for one in found.what_if:
        freed = tween_of(ballet, **without(asked, one.without))
        assert one.moves == freed.moves - found.moves
        if one.without.startswith(("moves", "duration")):
            assert freed.length is not None
            difference = choose_length(best.search_problem).cost - freed.length.cost
        else:
            stops = zip((via for via, *_ in found.request.vias), found.passed, strict=True)
            alike = without(asked | {"via": [*stops]}, one.without) | {"moves": best.moves}
            difference = best.cost - tween_of(ballet, **alike).cost
        assert 0.0 <= one.least <= one.most
        assert one.least - SAME <= difference <= one.most + SAME
        assert one.proven == (one.most - one.least <= 2 * OPTIMAL_WITHIN_NATS)


def test_a_duration_of_as_many_moves_is_priced_without_the_guide(ballet: Engine) -> None:
    """In another time walks expect something else, so that costs with the guide do not compare."""
    free = ballet.tween(*ENDS)
    seconds = usual(ballet.grammar.transitions)
    found = ballet.tween(*ENDS, duration=(free.moves + 0.3) * seconds, what_if=True)
    assert found.moves == free.moves
    (one,) = found.what_if
    assert (one.moves, one.compared, one.proven) == (0, "haste and pace", True)
    assert one.most == pytest.approx(0.0, abs=SAME)


def test_vias_are_named_by_their_moves_where_they_have_one(ballet: Engine) -> None:
    passe = read_posture(PASSE)
    found = ballet.tween(*ENDS, via=[passe, (passe, 9)], moves=14, what_if=True)
    assert [one.without for one in found.what_if] == ["via 1", "via 2 after move 9", "moves 14"]


def test_without_a_given_number_of_moves_as_many_are_searched_at_least(ballet: Engine) -> None:
    found = ballet.tween(*ENDS, moves=9, max_moves=2, what_if=True, strict=True)
    (one,) = found.what_if
    assert one.moves == ballet.tween(*ENDS, max_moves=9, strict=True).moves - 9


def test_a_held_joint_has_its_price(ballet: Engine) -> None:
    clip = ballet.corpus.motion(ballet.corpus.clips[0])
    a, b = clip.posture(0), clip.posture(6)
    states = ballet.space.assign(ballet.corpus.to_chains(clip.rotations[[0, 6]]))
    joints = [joint for joint, *ends in zip(ballet.space.names, *states, strict=True) if ends[0] == ends[1]]
    found = ballet.tween(a, b, hold=joints[:2], moves=6, what_if=True)
    assert [one.without for one in found.what_if] == [f"hold {joints[0]}", f"hold {joints[1]}", "moves 6"]


def test_nothing_is_reported_unless_it_is_asked_for(ballet: Engine) -> None:
    assert ballet.tween(*ENDS, moves=6).what_if == ()
    assert ballet.tween(*ENDS, what_if=True).what_if == ()
    first, second = ballet.alternatives(*ENDS, 2, moves=6, what_if=True)
    assert (len(first.what_if), len(second.what_if)) == (1, 0)
    with pytest.raises(MotionMindError, match="what_if prices the restrictions of the best tween"):
        ballet.tween(*ENDS, unlike=[first], what_if=True)


def test_an_interrupted_search_prices_nothing(ballet: Engine) -> None:
    found = ballet.tween(*ENDS, pin={"left_wrist": "A"}, what_if=True, watch=lambda _: True)
    assert (found.status, found.what_if) == ("interrupted", ())


@pytest.mark.parametrize(
    ("one", "text"),
    [
        (WhatIf("hold neck", 12.4, 12.4, True, -1, "cost"), "hold neck: 12.400 nats and 1 move less"),
        (WhatIf("via 1", 10.1, 12.4, False, 0, "cost"), "via 1: at least 10.100, at most 12.400 nats less"),
        (WhatIf("pin neck=A", 0.0, 1e-9, True, 0, "cost"), "pin neck=A: no nats less"),
        (
            WhatIf("moves 8", 5.0, 5.0, True, 2, "haste and pace"),
            "moves 8: 5.000 nats less, 2 moves more (haste and pace)",
        ),
        (
            WhatIf("moves 8", 5.0, 5.0, True, 2, "costs without the guide"),
            "moves 8: 5.000 nats less, 2 moves more (costs without the guide)",
        ),
    ],
)
def test_a_price_in_words(one: WhatIf, text: str) -> None:
    assert format_what_if(one) == text


@pytest.mark.parametrize("without", [[], ["pace"]])
def test_what_a_length_costs_is_named_though_no_guide_leads(ballet: Engine, without: list[str]) -> None:
    (one,) = ballet.tween(*ENDS, moves=12, guide=0.0, without=without, what_if=True).what_if
    assert one.compared == ("cost" if without else "haste and pace")


def test_the_command_line_prints_a_line_for_each_restriction_and_the_report_has_them(run: Run) -> None:
    asked = ("--what-if", "--pin", "left_wrist", "--via", f"{PASSE}@4", "--moves", 8)
    ran = run("tween", A, B, "--corpus", "ballet", *asked, "--report", "r.json")
    assert ran.code == 0, ran.err
    lines = [line[10:] for line in ran.out.splitlines() if line.startswith("without   ")]
    report = read_report(Path("r.json"))
    assert [one.without for one in report.what_if] == ["pin left_wrist=A", "via 1 after move 4", "moves 8"]
    assert lines == [format_what_if(one) for one in report.what_if]
    assert json.loads(Path("r.json").read_text())["what_if"][1].keys() == {
        *("without", "least", "most", "proven", "moves", "compared"),
    }
