"""The plan command: what it prints and refuses."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Run


def test_a_plan_says_how_much_floor_a_movement_needs(run: Run) -> None:
    done = run("plan", "ballet/temps-lie", "-o", "plan.svg", "--tempo", "108")
    assert done.out.startswith("plan.svg: path of ")
    assert "on a floor of" in done.out
    assert "counts at 108 a minute" in Path("plan.svg").read_text("utf-8")


def test_a_movement_that_leaves_the_stage_is_noted(run: Run) -> None:
    done = run("plan", "ballet/temps-lie", "-o", "plan.png", "--stage", "1x1")
    assert "ballet/temps-lie leaves the stage" in done.err
    assert "edge at" in done.err


def test_a_plan_counts_by_music(run: Run) -> None:
    Path("beats.txt").write_text("0.4 4\n1.0 1\n1.7 2\n2.2 3\n2.7 4\n", "utf-8")
    done = run("plan", "ballet/temps-lie", "-o", "plan.svg", "--music", "beats.txt")
    assert done.code == 0
    assert "count 1 comes at 1.000 s" in done.err
    drawn = Path("plan.svg").read_text("utf-8")
    assert "counts of music, 109.1 a minute" in drawn
    assert ">counts 1" in drawn


def test_a_page_holds_the_edge_of_the_stage_and_films_refuse_it(run: Run) -> None:
    done = run("render", "ballet/temps-lie", "-o", "page.html", "--stage", "1x1.5")
    assert "ballet/temps-lie leaves the stage" in done.err
    assert '"stage":[1.0,1.5]' in Path("page.html").read_text("utf-8")
    Path("page.html").unlink()
    for output, stage, words in (
        ("film.gif", "8x6", "--stage is for the floor plan of a page"),
        ("page.html", "0x6", "1 to 200"),
    ):
        done = run("render", "ballet/temps-lie", "-o", output, "--stage", stage)
        assert done.code == 2
        assert words in done.err
        assert not Path(output).exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--stage", "8"], "'8' is not a width and a depth in metres such as 8x6"),
        (["--stage", "8x"], "such as 8x6"),
        (["--stage", "0x6"], "from 1 to 200 m"),
        (["--stage", "8x999"], "from 1 to 200 m"),
        (["--tempo", "0"], "0"),
        (["--every", "0"], "0"),
        (["--music", "none.txt"], "none.txt"),
        (["--offset", "1"], "--offset needs --music"),
        (["--from", "9999"], "9999"),
    ],
)
def test_bad_options_are_refused_and_nothing_is_written(run: Run, options: list[str], words: str) -> None:
    done = run("plan", "ballet/adagio", "-o", "plan.svg", *options)
    assert done.code == 2
    assert words in done.err
    assert not Path("plan.svg").exists()


def test_a_plan_is_svg_or_png(run: Run) -> None:
    done = run("plan", "ballet/adagio", "-o", "plan.gif")
    assert done.code == 2
    assert ".svg" in done.err
