"""The laban command: what it writes, prints and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import Run
from scores import BENDS

SIGNS = """laban   1
title   A raise
body    human23
tempo   60
bar     3
counts  2

left support
  start | place middle
  0 2   | hold

right support
  start | place middle
  0 2   | hold

left arm
  start | place low
  0 2   | left middle
"""


def test_a_score_is_drawn_and_written_as_signs_at_once(run: Run) -> None:
    Path("bends.score").write_text(BENDS)
    done = run(
        "laban", "bends.score", "--bar", "3", "-o", "a.svg", "-o", "a.png", "-o", "a.laban", "--report", "a.json"
    )
    assert done.out.startswith("bends: 4 signs in 2 counts\n")
    assert "place low" in Path("a.laban").read_text()
    assert "bar     3" in Path("a.laban").read_text()
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    for off in json.loads(Path("a.json").read_bytes()):
        assert set(off) == {"column", "count", "sign", "degrees", "most", "bend"}


def test_a_clip_of_a_corpus_says_how_far_its_signs_are_off(run: Run) -> None:
    done = run("laban", "ballet/centre.score", "--clip", "pirouettes", "-o", "a.svg")
    assert done.code == 0
    assert done.out.startswith("pirouettes: 220 signs in 64 counts\n")  # at a tempo of its own
    assert "left arm      22 degrees off at most: forward high bent, at 43 counts; bent by" in done.out


def test_a_change_of_tempo_is_noted(run: Run) -> None:
    Path("bends.score").write_text(BENDS + "  tempo 120\n  4 | bend\n")
    done = run("laban", "bends.score", "-o", "a.svg")
    assert "the signs state its mean, 90.0 counts a minute" in done.err
    assert "in 6 counts" in done.out


def test_signs_are_drawn_and_become_a_score_that_can_be_composed(run: Run) -> None:
    Path("a.laban").write_text(SIGNS)
    assert run("laban", "a.laban", "-o", "a.pdf", "-o", "b.laban", "-o", "a.score").code == 0
    assert Path("b.laban").read_text() == SIGNS
    assert Path("a.pdf").read_bytes().startswith(b"%PDF")
    assert run("compose", "a.score", "-o", "a.bvh").code == 0
    assert run("laban", "a.score", "--bar", "3", "-o", "c.laban").code == 0
    signs = Path("c.laban").read_text()
    assert signs.partition("left arm")[2].partition("\n\n")[0] == SIGNS.partition("left arm")[2].rstrip("\n")


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("laban ballet/centre.score -o a.svg", "choose one: port-de-bras"),
        ("laban ballet/centre.score --clip piroette -o a.svg", "did you mean pirouettes?"),
        ("laban bends.score -o a.gif", "the name must end in one of .svg, .png, .pdf, .laban, .score"),
        ("laban bends.score --bar 0 -o a.svg", "0 is not in the range 1<=x<=64"),
        ("laban nowhere.score -o a.svg", "nowhere.score: cannot be read"),
        ("laban nowhere.laban -o a.svg", "nowhere.laban: cannot be read"),
        ("laban bends.score -o bends.score", "it is read from"),
        ("laban walk-hexapod/insect.score --clip tripod -o a.svg", "Labanotation is drawn of people"),
        ("laban bad.laban -o a.svg -o b.png", "bad.laban:18: 'lefft middle' is not a sign; did you mean left?"),
        ("laban lean.laban -o a.svg -o a.score", "the body cannot follow the signs: the left fingers would be"),
        ("laban bad.laban --clip a -o a.svg", "--clip, --bar and --report are for a score"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(run: Run, command: str, words: str) -> None:
    Path("bends.score").write_text(BENDS)
    Path("bad.laban").write_text(SIGNS.replace("left middle", "lefft middle"))
    Path("lean.laban").write_text(
        SIGNS.replace("left arm", "torso").replace("left middle", "forward low").replace("place low", "place high")
    )
    before = sorted(Path().iterdir())
    done = run(*command.split())
    assert done.code == 2
    assert words in done.err
    assert len(done.err.strip().splitlines()) == 1
    assert sorted(Path().iterdir()) == before
