"""vary --dancers: variations at nearby starting points, and the ensemble that dances them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import Run

from motionmind import read_variation

ASKED = ("vary", "ballet/jump", "--attractor", "lorenz")


@pytest.mark.parametrize("nudge", [(), ("--nudge", "0.05")])
def test_dancers_begin_together_each_as_far_from_the_last(run: Run, nudge: tuple[str, ...]) -> None:
    assert run(*ASKED, *nudge, "-o", "alone.json").code == 0
    ran = run(*ASKED, *nudge, "--dancers", "3", "-o", "trio.toml")
    assert ran.code == 0, ran.err
    found = [read_variation(f"trio-{number}.json") for number in (1, 2, 3)]
    np.testing.assert_array_equal(found[0].first_order, read_variation("alone.json").first_order)
    nudges = np.array([one.course.nudge for one in found if one.course])
    np.testing.assert_allclose(nudges, nudges[0] * np.arange(1, 4)[:, None])
    assert len({one.first_order[0] for one in found}) == 1, "they begin together"
    assert len({one.kept is None for one in found}) == 1, "limits are those of all"
    assert ran.out.splitlines()[0] == "trio-1.json: leads"
    for number, one in enumerate(found[1:], start=2):
        same = np.array_equal(one.first_order, found[0].first_order)
        assert f"trio-{number}.json: {'with the first to the end' if same else 'parts at posture'}" in ran.out


def test_their_ensemble_is_drawn(run: Run) -> None:
    assert run(*ASKED, "--nudge", "0.05", "--dancers", "2", "-o", "\U0001fa70.toml").code == 0
    assert run("plan", "\U0001fa70.toml", "-o", "duo.svg").code == 0
    assert "dancer 2" in Path("duo.svg").read_text("utf-8")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("-o", "trio.json"), "give one output, such as -o trio.toml"),
        (("-o", "trio.toml", "-o", "other.toml"), "give one output"),
        (("-o", "trio.toml", "--by", "shuffle"), "follows the attractor"),
        (("-o", "trio.toml", "--json"), "no report"),
        (("-o", "trio.toml", "--stage", "8x6"), "keeps to no stage"),
    ],
)
def test_what_dancers_cannot_be_written_as_is_refused(run: Run, options: tuple[str, ...], words: str) -> None:
    ran = run(*ASKED, "--dancers", "3", *options)
    assert (ran.code, ran.out) == (2, "")
    assert words in ran.err
    assert not list(Path().glob("trio*"))
