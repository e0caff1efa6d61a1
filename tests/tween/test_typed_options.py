"""The types of `**options`: they agree with the request and with `gather`, and type checkers catch mistakes by them."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import pytest
from bundled_clips import ballet_clip

from motionmind import Engine, Motion, vary
from motionmind.corpus.gather import Gathering, gather
from motionmind.errors import WrongTypeError
from motionmind.tween.options import SearchOptions
from motionmind.tween.request import SeamOptions, SmoothOptions, TweenOptions, TweenRequest
from motionmind.variation.variation import Variation

ROOT = Path(__file__).parents[2]

SNIPPET = """\
from motionmind import Engine, Motion, Posture, SearchOptions, TweenRequest, vary


def right(engine: Engine, clip: Motion, a: Posture, b: Posture) -> None:
    Engine.fit([clip], name="mine", skip=1, mirror=True, reverse=None)
    tween = engine.tween(a, b, duration=2.0, hold=["left_ankle"], via=[a, (b, 3)], tau=0.5)
    next(engine.alternatives(a, b, 3, moves=(3, 5), unlike=[tween], what_if=True))
    TweenRequest.of(pin={"left_wrist": "B"}, coordination="none", search=SearchOptions(seed=3))
    vary(clip, engine, seed=3, novelty=0.5).smooth(engine, seed=4, whole_body=True, without=["pace"])


def wrong(engine: Engine, clip: Motion, a: Posture, b: Posture) -> None:
    Engine.fit([clip], mirrored=True)
    Engine.fit([clip], skip="1")
    engine.tween(a, b, noveltie=1.0)
    engine.tween(a, b, via=["a"])
    engine.alternatives(a, b, 3, duraton=2.0)
    engine.alternatives(a, b, 3, hold=3)
    TweenRequest.of(lamda_=1.0)
    TweenRequest.of(coordination="all")
    vary(clip, engine, unlike=[])
    vary(clip, engine, novelty="1")
    vary(clip).smooth(engine, what_if=True)
    vary(clip).smooth(engine, without=["peace"])
"""


def types_of(options: type) -> dict[str, str]:
    """The options of a TypedDict with their types, as written."""
    return {name: type_.__forward_arg__ for name, type_ in options.__annotations__.items()}


def test_the_types_of_options_are_those_of_the_request() -> None:
    every = {field.name: field.type for field in (*fields(TweenRequest), *fields(SearchOptions))}
    assert types_of(TweenOptions) == every


@pytest.mark.parametrize(
    ("options", "function"),
    [(SeamOptions, vary), (SmoothOptions, Variation.smooth), (Gathering, Engine.fit)],
)
def test_a_function_has_each_option_once(options: type, function: Callable[..., object]) -> None:
    assert not options.__annotations__.keys() & inspect.signature(function).parameters.keys()


def test_the_types_of_gathering_are_those_of_gather() -> None:
    own = {"name", "motions", "mix", "workshop"}
    parameters = inspect.signature(gather).parameters
    assert types_of(Gathering) == {name: one.annotation for name, one in parameters.items() if name not in own}


@pytest.mark.long
def test_a_type_checker_reports_misspelt_and_wrongly_typed_options_alone(tmp_path: Path) -> None:
    (tmp_path / "snippet.py").write_text(SNIPPET)
    check = [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", "--follow-imports=silent"]
    check += ["--config-file=", f"--cache-dir={tmp_path / 'cache'}", str(tmp_path / "snippet.py")]
    ran = subprocess.run(check, cwd=ROOT, capture_output=True, text=True, check=False)
    reported = {int(line) for line in re.findall(r"^\S*snippet\.py:(\d+): error: ", ran.stdout, re.M)}
    lines = SNIPPET.splitlines()
    first = lines.index(next(line for line in lines if line.startswith("def wrong"))) + 2
    assert reported == set(range(first, len(lines) + 1)), ran.stdout + ran.stderr


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda clip: Engine.fit([clip], mirrored=True), "fit has no option 'mirrored'; did you mean mirror?"),
        (lambda clip: Engine.fit([clip], homes="."), "fit has no option 'homes'; did you mean home?"),
        (lambda clip: vary(clip, noveltie=1.0), "vary has no option 'noveltie'; did you mean novelty?"),
        (lambda clip: vary(clip, nugde=1.0), "vary has no option 'nugde'; did you mean nudge?"),
        (
            lambda clip: vary(clip).smooth(Engine.load("ballet"), alternative=1),
            "smooth has no option 'alternative'; did you mean alternatives?",
        ),
    ],
)
def test_a_misspelt_option_is_one_line_with_the_nearest(call: Callable[[Motion], object], message: str) -> None:
    with pytest.raises(WrongTypeError) as error:
        call(ballet_clip("jump"))
    assert str(error.value) == message
