"""Scores that repeat themselves without end are refused in a line, and long ones that mean it are quick."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from bounded_runs import run_bounded

from motionmind.errors import FormatError
from motionmind.notation.compose import compose, motions
from motionmind.notation.read import read_score
from motionmind.notation.rows import MAX_CLIP_POSTURES, MAX_DEPTH

HEAD = """body   human23
legs
  stand = stand out 10 turn 8
  bend  = stand out 10 turn 8, bend 30
arms
  low   = shoulder flexion 10
  high  = shoulder flexion 90 abduction 20
torso
  up    = neutral
head
  turned = head turn 20
"""
STEP = "phrase s\n  1 turn 10 left | bend\n  1 | stand\n"
START = "phrase s\n  start | stand\n"


def written(folder: Path, text: str, name: str = "hostile.score") -> Path:
    path = folder / name
    path.write_text(HEAD + text)
    return path


def chain(line: str, depth: int = 26, first: str = STEP) -> str:
    """Return phrases p0, p1, ... each of which says `line` of the one before, and a clip of the last."""
    lines = [first, "phrase p0\n  s\n"]
    lines += [f"phrase p{i}\n  {line.replace('P', f'p{i - 1}')}\n" for i in range(1, depth)]
    return "".join([*lines, f"clip c\n  start | stand\n  p{depth - 1}\n"])


HOSTILE = {
    "a thousand times a thousand times": START + "clip c\n  s" + ", 1000 times" * 8 + "\n",
    "a thousand times of nothing": chain("P, 1000 times", first=START),
    "layers of layers": chain("P, with arms of P"),
    "a phrase twice": chain("P\n  P"),
    "there and back again": chain("P, there and back"),
    "words that double": "phrase q0 (W)\n  1 | W\n"
    + "".join(f"phrase q{i} (W)\n  q{i - 1} (W W)\n" for i in range(1, 40))
    + "clip c\n  start | stand\n  q39 (stand)\n",
    "ways without number": STEP + "clip c\n  start | stand\n  s" + ", other side" * 5000 + "\n",
    "commas": STEP + "clip c\n  start | stand\n  s" + "," * 300_000 + "\n",
    "brackets": STEP + "clip c\n  start | stand\n  s" + " (" * 300_000 + "\n",
    "an unknown word of half a megabyte": STEP + "clip c\n  " + "s" * 500_000 + "\n",
    "a cell without end": "clip c\n  start | " + "bend " * 100_000 + "|" * 20 + "\n",
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=list(HOSTILE))
def test_a_score_that_repeats_without_end_is_refused(text: str, tmp_path: Path) -> None:
    done = run_bounded("compose", written(tmp_path, text), "-o", "out.json", folder=tmp_path)
    assert done.code == 2, done
    assert done.within_bounds, done
    assert done.error.startswith("error: hostile.score:") or str(tmp_path) in done.error
    assert len(done.error.strip().splitlines()) == 1


LONG = {
    "phrases": "".join(f"phrase p{i}\n  1 | stand\n" for i in range(30_000)) + "clip c\n  start | stand\n  p7\n",
    "positions": "arms\n" + "".join(f"  a{i} = low\n" for i in range(60_000)) + "clip c\n  start | stand | a7\n",
    "a line that goes on": "arms\n  a =\n" + "    low,\n" * 100_000 + "    low\nclip c\n  start | stand | a\n",
}


@pytest.mark.parametrize("text", LONG.values(), ids=list(LONG))
def test_reading_takes_time_in_proportion_to_length(text: str, tmp_path: Path) -> None:
    assert len(text) < 10**6
    done = run_bounded("compose", written(tmp_path, text.replace("a =\n    ", "a = ")), "-o", "o.json", folder=tmp_path)
    assert done.code == 0, done
    assert done.within_bounds, done


def test_backwards_is_played_once(tmp_path: Path) -> None:
    """An even number of times backwards is forwards, however often; the time does not double with each."""
    ways = MAX_DEPTH - 10 - MAX_DEPTH % 2
    turning = "phrase t\n  start | stand\n  1 turn 10 left | bend\n  1 | stand\n"
    once, often = (
        f"clip {name}\n  start | stand\n  t{', backwards' * n}\n" for name, n in (("once", 2), ("often", ways))
    )
    score = written(tmp_path, turning + once + often)
    began = time.process_time()
    twice, many = motions(read_score(score))
    assert time.process_time() - began < 5.0
    assert (twice.rotations == many.rotations).all()
    assert (twice.root == many.root).all()


def test_a_score_is_read_once_however_often_it_is_included(tmp_path: Path) -> None:
    """Each of 25 scores includes the one before twice: 2^25 readings, if each of them were read again."""
    written(tmp_path, STEP, "s0.score")
    for i in range(1, 25):
        written(tmp_path, f"include s{i - 1}.score as a\ninclude s{i - 1}.score as b\n", f"s{i}.score")
    path = written(
        tmp_path, "include s24.score as a\ninclude s24.score\ninclude s0.score\nclip c\n  start | stand\n  s\n"
    )
    done = run_bounded("compose", path, "-o", "out.json", folder=tmp_path)
    assert done.code == 0, done
    assert done.within_bounds
    score = read_score(path)
    assert score.included["a"] is not None
    assert score.included["a"].included["a"] is score.included["a"].included["b"]


def test_scores_that_include_without_end_are_refused(tmp_path: Path) -> None:
    for i in range(1500):
        written(tmp_path, f"include s{i + 1}.score\n", f"s{i}.score")
    written(tmp_path, STEP, "s1500.score")
    with pytest.raises(FormatError, match="scores are included"):
        read_score(tmp_path / "s0.score")
    with pytest.raises(FormatError, match="scores are included"):
        read_score(written(tmp_path, "include s1500.score\n" * 1000))


@pytest.mark.parametrize("turn", ["", " turn 10 left"])
def test_a_hundred_thousand_postures_take_a_second(turn: str, tmp_path: Path) -> None:
    lines = "".join(
        f"  1{turn} | {legs} | {arms} | | {head}\n"
        for legs in ("bend", "stand")
        for arms in ("low", "high")
        for head in ("turned left", "turned right")
    )
    plays = ["p, 999 times", "p, other side, 999 times", *["p, there and back, 500 times"] * 8]
    text = f"phrase p\n{lines}clip c\n  start | stand | low | up | turned left\n  " + "\n  ".join(plays) + "\n"
    path = written(tmp_path, text)
    compose(written(tmp_path, STEP + "clip c\n  start | stand\n  s\n", "small.score"))  # loads the modules
    began = time.process_time()
    motion = compose(path)
    taken = time.process_time() - began
    assert 0.75 * MAX_CLIP_POSTURES < len(motion) <= MAX_CLIP_POSTURES
    assert taken < 2.0, f"{taken:.1f} s"  # 0.6 s of work on an idle machine


LONG_LINES = {
    "a line that calls nothing": "clip c\n  start | stand\n  " + "what is this " * 3000 + "\n",
    "a line with an open word left empty": "phrase q (W)\n  1 | W\nclip c\n  q (" + "stand " * 3000 + ",)\n",
    "a cell": "clip c\n  start | " + "stand still " * 3000 + "\n",
    "a first cell": "clip c\n  start | stand\n  " + "turn slowly " * 3000 + " | stand\n",
    "a side": "clip c\n  start | stand left right " + "stand " * 3000 + "\n",
    "a way to do a phrase": STEP + "clip c\n  start | stand\n  s, " + "very slowly " * 3000 + "\n",
    "a tempo": "clip c\n  tempo " + "very slow " * 3000 + "\n",
    "a heading": "legs " + "and arms " * 3000 + "\n",
    "a phrase's name": "phrase " + "one two " * 3000 + "\n  1 | stand\n",
    "a position": "arms\n  " + "one two " * 3000 + "= low\n",
    "an angle": "arms\n  a = shoulder " + "up and down " * 3000 + "\n",
    "an unknown heading": "and so on " * 3000 + "\n",
}


@pytest.mark.parametrize("text", LONG_LINES.values(), ids=list(LONG_LINES))
def test_a_message_quotes_no_more_of_a_line_than_shows_which(text: str, tmp_path: Path) -> None:
    path = written(tmp_path, text)
    with pytest.raises(FormatError) as refused:
        motions(read_score(path))
    assert len(str(refused.value)) < len(str(path)) + 400
