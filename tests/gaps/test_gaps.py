"""Laws of what to record next: what is said to be saved is saved when the transition is in the corpus."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from PIL import Image
from PIL.ImageDraw import ImageDraw

from motionmind.body.motion import Motion
from motionmind.corpus.corpus import Corpus, Facing
from motionmind.discretize.spec import make_discretization
from motionmind.errors import MotionMindError
from motionmind.gaps.candidates import _Bounds, _danceable, choose_candidates
from motionmind.gaps.gaps import find_gaps
from motionmind.gaps.sample import draw_pairs, solve_pairs
from motionmind.gaps.transition import Transition, with_transitions
from motionmind.geometry import rotations as rot
from motionmind.synthesis.timeline import usual
from motionmind.tween.engine import Engine

PAIRS = 6


def learn(facing: Facing, *recorded: Motion) -> Engine:
    clips = [ballet_clip(name) for name in ("tendus", "degages", "jump")]
    grid = make_discretization("quaternion", 25.0)
    return Engine.fit([*clips, *recorded], name="few", rate=None, facing=facing, discretization=grid)


@cache
def few(facing: Facing = "stage") -> Engine:
    return learn(facing)


def record(corpus: Corpus, postures: tuple[int, int], seconds: float) -> Motion:
    """The movement from one posture to another, as it would be recorded."""
    rotations = np.array(corpus.rotations[list(postures)])
    if corpus.facing == "free":
        turn = rot.heading(rotations[0, 0]) - rot.heading(rotations[1, 0])
        rotations[1, 0] = rot.mul(rot.about_vertical(turn), rotations[1, 0])
    return Motion(corpus.skeleton, rot.normalise(rotations), corpus.root[list(postures)], np.array([0.0, seconds]))


def tween_costs(engine: Engine, corpus: Corpus, pairs: np.ndarray) -> tuple[float, float]:
    """Mean cost and bridges of plain tweens between postures of a corpus."""
    motion = Motion(corpus.skeleton, corpus.rotations, corpus.root, np.arange(len(corpus), dtype=float))
    tweens = [
        engine.tween(motion.posture(a), motion.posture(b), guide=0.0, without=("pace",)) for a, b in pairs.tolist()
    ]
    return float(np.mean([one.cost for one in tweens])), float(np.mean([len(one.bridges) for one in tweens]))


@pytest.mark.parametrize("facing", ["stage", "free"])
def test_recording_the_transitions_lowers_the_energy_by_what_was_said(facing: Facing) -> None:
    engine = few(facing)
    gaps = find_gaps(engine, PAIRS, 2, seed=1)
    sample = draw_pairs(engine.corpus, PAIRS, 1)
    assert tween_costs(engine, engine.corpus, sample) == pytest.approx((gaps.energy.cost, gaps.energy.bridges))
    recorded, before = list[Motion](), gaps.energy.cost
    assert len(gaps.transitions) == 2
    for one in gaps.transitions:
        recorded.append(record(engine.corpus, one.postures, usual(engine.grammar.transitions)))
        again = learn(facing, *recorded)
        found = tween_costs(again, engine.corpus, sample)
        assert found == pytest.approx((one.energy.cost, one.energy.bridges), abs=1e-6)
        assert found[0] < before
        assert one.energy.lower_bound <= one.energy.cost + 1e-6
        before = found[0]


def test_bounds_by_which_candidates_are_chosen_are_below_the_costs() -> None:
    engine = few()
    sample = draw_pairs(engine.corpus, PAIRS, 0)
    solved = solve_pairs(engine, sample)
    bounds = _Bounds(engine, sample, int(solved.moves.max()))
    assert (bounds._total(bounds._chains) <= solved.costs + 1e-6).all()


def test_candidates_are_new_and_can_be_danced_in_one_move() -> None:
    engine = few()
    corpus, moves = engine.corpus, engine.corpus.moves
    sample = draw_pairs(corpus, PAIRS, 0)
    found = choose_candidates(engine, sample, 4, 6, 0)
    assert found
    for one in found:
        turns = rot.angle(corpus.rotations[one.begin], corpus.rotations[one.end])
        farthest = rot.angle(corpus.rotations[moves.begins], corpus.rotations[moves.ends]).max(axis=0)
        assert (turns <= farthest + 1e-6).all()
        assert not any(moves.begins[moves.ends == one.end] == one.begin)
    assert len({one.begin for one in found}) == len({one.end for one in found}) == len(found)


def test_a_move_that_is_attested_promises_nothing() -> None:
    engine = few()
    moves, sample = engine.corpus.moves, draw_pairs(engine.corpus, PAIRS, 0)
    bounds = _Bounds(engine, sample, 4)
    assert bounds.gain(Transition(int(moves.begins[0]), int(moves.ends[0]))) == 0.0
    assert not _danceable(engine, np.arange(5)).diagonal().any()


def test_nothing_recorded_is_what_there_was() -> None:
    assert with_transitions(few(), []) is few()


def test_the_same_seed_says_the_same_and_another_draws_other_pairs() -> None:
    engine = few()
    assert find_gaps(engine, 4, 1, seed=3) == find_gaps(engine, 4, 1, seed=3)
    assert not np.array_equal(draw_pairs(engine.corpus, 20, 0), draw_pairs(engine.corpus, 20, 1))
    pairs = draw_pairs(engine.corpus, 500, 0)
    assert (pairs[:, 0] != pairs[:, 1]).all()
    assert pairs.min() >= 0
    assert pairs.max() < len(engine.corpus)


def test_worst_joint_graphs_come_first() -> None:
    engine = few()
    joints = find_gaps(engine, PAIRS, 0).joints
    assert {one.joint for one in joints} == set(engine.corpus.chains)
    assert [one.apart for one in joints] == sorted((one.apart for one in joints), reverse=True)


def test_an_insect_has_gaps_too() -> None:
    engine = Engine.load("walk-hexapod")
    gaps = find_gaps(engine, 4, 1)
    assert len(gaps.joints) == len(engine.corpus.chains)
    for one in gaps.transitions:
        assert one.begin.near == ""
        assert one.energy.cost < gaps.energy.cost


@pytest.mark.parametrize(("numbers", "words"), [({"pairs": 0}, "pairs must be from 1"), ({"count": -1}, "count must")])
def test_numbers_out_of_range_are_refused(numbers: dict[str, int], words: str) -> None:
    with pytest.raises(MotionMindError, match=words):
        find_gaps(few(), **numbers)


def test_a_single_posture_has_no_pair() -> None:
    corpus = few().corpus
    single = replace(
        corpus,
        clips=(replace(corpus.clips[0], start=0, stop=1),),
        rotations=corpus.rotations[:1],
        root=corpus.root[:1],
        times=corpus.times[:1],
        detail=corpus.detail[:1],
    )
    with pytest.raises(MotionMindError, match="one posture"):
        draw_pairs(single, 3, 0)


def test_the_command_names_postures_and_draws_them(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written = list[str]()
    write = ImageDraw.text
    monkeypatch.setattr(
        ImageDraw,
        "text",
        lambda pen, xy, text, *rest, **how: (written.append(text), write(pen, xy, text, *rest, **how)),
    )
    ran = run("corpus", "gaps", "macarena", "--pairs", 6, "--count", 1, "-o", tmp_path / "gaps.png")
    assert ran.code == 0, ran.err
    assert "record next" in ran.out or "no single move" in ran.out
    same = run("corpus", "gaps", "macarena", "--pairs", 6, "--count", 1, "--json")
    found = json.loads(same.out)
    assert found["pairs"] == 6
    assert found["transitions"][0]["begin"]["corpus"] == "macarena"
    assert found["transitions"][0]["begin"]["near"]
    with Image.open(tmp_path / "gaps.png") as picture:
        assert picture.width > 500
        assert picture.height > 100
    clip = found["transitions"][0]["begin"]["clip"]
    assert any(
        re.match(rf"1\. -?\d+\.\d\d nats less a tween: {clip} at \S+ s to \S+ at \S+ s$", text) for text in written
    )


def test_bad_input_is_one_line(run: Run, tmp_path: Path) -> None:
    for words in (("nowhere",), ("ballet", "--pairs", "0"), ("ballet", "-o", tmp_path / "gaps.xyz")):
        ran = run("corpus", "gaps", *words)
        assert ran.code == 2
        assert ran.err.count("\n") == 1
