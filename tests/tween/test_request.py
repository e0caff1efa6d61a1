"""The request: one description, checked by itself, offered by the command line, and repeated by the report."""

from __future__ import annotations

import json
from dataclasses import FrozenInstanceError, fields, replace
from pathlib import Path
from typing import Any

import pytest
from bundled_clips import BALLET
from command_line import Run

from motionmind.cli import app
from motionmind.errors import FormatError, MotionMindError
from motionmind.formats import read_posture
from motionmind.tween.engine import Engine
from motionmind.tween.options import OPTIONS, SearchOptions
from motionmind.tween.report import TweenReport, encode_report, read_report
from motionmind.tween.request import TweenRequest
from motionmind.tween.result import report_of

FIRST, PLIE = (read_posture(BALLET / "postures" / f"{name}.json") for name in ("first", "plie"))


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def test_a_request_and_its_options_ask_for_the_same(ballet: Engine) -> None:
    by_options = ballet.tween(FIRST, PLIE, moves=4, novelty=0.5)
    request = TweenRequest(moves=4, novelty=0.5)
    by_request = ballet.tween(FIRST, PLIE, request)
    assert by_options.path.tobytes() == by_request.path.tobytes()
    assert by_options.asked == by_request.asked
    changed = ballet.tween(FIRST, PLIE, request, novelty=0.0)
    assert (changed.request.moves, changed.request.novelty) == (4, 0.0)
    assert request.novelty == 0.5


def test_a_request_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        TweenRequest().moves = 3  # type: ignore[misc]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"moves": 0}, "moves must be a whole number from 1"),
        ({"moves": (5, 4)}, "not from 5 to 4"),
        ({"moves": 2.5}, "moves must be a whole number"),
        ({"max_moves": 10**6}, "max_moves must be a whole number"),
        ({"node_budget": 0}, "node_budget"),
        ({"memory": 0}, "memory"),
        ({"coordination": "all"}, "coordination must be 'posture', 'progression' or 'none'"),
        ({"weights": "even"}, "weights must be 'conditional' or 'printed'"),
        ({"seed": -1}, "seed"),
        ({"fps": 0.0}, "fps"),
        ({"novelty": float("nan")}, "novelty"),
        ({"lambda_": -1.0}, "lambda must be"),
        ({"tau": float("inf")}, "tau must be"),
        ({"via": [(FIRST, 0)]}, "via 1: the move"),
        (
            {"reach": [("left_wrist", (0.0, float("nan"), 0.0), 1.0)]},
            "reach left_wrist: metres and seconds are numbers",
        ),
        ({"reach": [("left_wrist", (0.0, 1.0), 1.0)]}, "three coordinates, x, y and z, not 2"),
        ({"stay": [("left_wrist", 0.5, 0.5)]}, "stay left_wrist: it must end after it begins, not at 0.5 and 0.5"),
        ({"stay": [("left_wrist", -0.1, 0.5)]}, "a share of the duration must be a number from 0 to 1, not -0.1"),
        ({"reach": [("left_wrist", (0.0, 1.0, 0.0), 0.0)]}, "the time must be more than 0 s"),
        ({"reach": [("left_wrist", (0.0, 1.0, 0.0), 2.0)], "duration": 2.0}, "2 s is not between A and B"),
        ({"whole_body": True, "sample": True}, "whole_body"),
        ({"whole_body": True, "coordination": "progression"}, "whole_body"),
    ],
)
def test_what_cannot_be_asked_is_refused_at_once(options: dict[str, Any], words: str) -> None:
    with pytest.raises(MotionMindError, match=words):
        TweenRequest.of(**options)


def test_an_option_that_is_none_is_named_with_the_nearest() -> None:
    with pytest.raises(TypeError, match="no option 'noveltie'; did you mean novelty"):
        TweenRequest.of(noveltie=1.0)


@pytest.mark.parametrize("command", ["tween", "vary", "review"])
def test_the_command_line_offers_every_field_with_its_default(command: str) -> None:
    options = {option.name: option for option in app.commands[command].params}
    defaults = {field.name: field.default for field in (*fields(TweenRequest), *fields(SearchOptions))}
    asked = OPTIONS.keys() - {"unlike", "what_if", "reach", "stay", "to", "along"}  # those of `tween` alone
    assert asked <= options.keys()
    for name in asked - {"pin", "hold", "avoid", "via", "node_budget"}:
        assert options[name].default == defaults[name], name


def test_the_report_repeats_every_field(ballet: Engine) -> None:
    tween = ballet.tween(FIRST, PLIE, duration=2.0, pin={"left_wrist": "B"}, memory=10**8)
    asked = tween.report()["asked"]
    both = {field.name.rstrip("_") for field in (*fields(TweenRequest), *fields(SearchOptions))}
    assert asked.keys() == both - {"search"} | {"before", "after"}
    assert (asked["duration"], asked["pin"], asked["memory"]) == (2.0, {"left_wrist": "B"}, 10**8)
    assert asked["node_budget"] == tween.node_budget > 0
    assert asked["guide"] == 1.0


# --- the report ------------------------------------------------------------------------------------------------------


def test_a_report_that_was_written_is_read_again(ballet: Engine, tmp_path: Path) -> None:
    tween = ballet.tween(FIRST, PLIE, via=[ballet.corpus.motion(ballet.corpus.clips[0]).posture(2)])
    report = report_of(tween)
    (tmp_path / "report.json").write_bytes(encode_report(report))
    again = read_report(tmp_path / "report.json")
    assert encode_report(again) == encode_report(report)
    assert again.sources == report.sources
    assert list(tween.report()) == list(TweenReport.__struct_fields__)


def test_a_report_of_an_earlier_version_is_refused_with_the_command_that_makes_it(ballet: Engine, run: Run) -> None:
    report = ballet.tween(FIRST, PLIE).report()
    del report["gave"]
    Path("old.json").write_text(json.dumps(report), "utf-8")
    ran = run("explain", "old.json")
    assert ran.code == 2
    told = "a tween report of an earlier version; make it again: motionmind tween A B --corpus NAME --report old.json"
    assert ran.err == f"error: old.json: {told}\n"


def test_a_motion_is_no_report(run: Run) -> None:
    with pytest.raises(FormatError, match="is no report of a tween"):
        read_report(BALLET / "postures" / "first.json")


def test_equal_requests_of_another_engine_give_their_own_answers(ballet: Engine) -> None:
    """Costs are kept from one request to the next; never those of another corpus."""
    karate = Engine.load("karate")
    first = karate.tween(FIRST, PLIE).cost
    assert ballet.tween(FIRST, PLIE).cost != first
    assert replace(karate, load_seconds=0.0).tween(FIRST, PLIE).cost == first
