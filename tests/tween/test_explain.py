"""What a tween is made of, taken apart: that it adds up, that it is what was counted, and how it is told."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Run

from motionmind.body.motion import Posture
from motionmind.errors import FormatError
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine
from motionmind.tween.narrative import explain
from motionmind.tween.report import read_report
from motionmind.tween.result import Tween

ENDS = [Path(__file__).parents[2] / "corpora/ballet/postures" / name for name in ("arabesque.json", "fifth.json")]


@pytest.fixture(scope="module")
def insects() -> Engine:
    """Six segments, with a chain for the facing, learned backwards too; the head of one clip is never as in the others,
    so that it must be bridged."""
    clips = [replace(motion, name=clip.name) for clip, motion in _clips(Engine.load("walk-hexapod"))]
    turned = clips[1].rotations.copy()
    turned[:, 1] = rot.mul(rot.from_axis_angle([0.0, 0.0, 1.0], 1.2), turned[:, 1])
    clips[1] = replace(clips[1], rotations=turned)
    return Engine.fit(clips, name="insects", reverse=1.0)


def _clips(engine: Engine) -> list[Any]:
    return [(clip, engine.corpus.motion(clip)) for clip in engine.corpus.clips]


def between(engine: Engine, a: int, b: int, **options: Any) -> Tween:
    corpus = engine.corpus
    ends = [Posture(corpus.skeleton, corpus.rotations[i], corpus.root[i]) for i in (a, b)]
    return engine.tween(*ends, **options)


@pytest.fixture(scope="module")
def bridged(insects: Engine) -> Tween:
    tween = between(insects, 5, insects.corpus.clips[1].start + 9)
    assert tween.bridges
    return tween


def report_of(tween: Tween, folder: Path) -> Path:
    path = folder / "report.json"
    path.write_text(json.dumps(tween.report()), "utf-8")
    return path


# --- the account ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"lambda_": 0.3, "beta": 0.25, "tau": 2.0, "bridge_price": 0.5},
        {"lambda_": 0.0, "tau": 0.0},
        {"weights": "printed"},
        {"moves": 9},
        {"beta": 0.0, "moves": 12},
    ],
)
def test_what_is_charged_adds_up_to_the_cost(insects: Engine, options: dict[str, Any]) -> None:
    rng = np.random.default_rng(1)
    for a, b in rng.integers(len(insects.corpus), size=(4, 2)):
        tween = between(insects, a, b, **options)
        assert tween.costs.total == pytest.approx(tween.cost, abs=1e-6)
        report = tween.report()
        costs = report["costs"]
        told = sum(sum(map(sum, costs[name])) for name in ("moves", "coordination", "guide"))
        assert told + costs["per_move"] * tween.moves == pytest.approx(report["cost"], abs=1e-6)
        for thing in (*tween.bridges, *tween.waits):
            charged = tween.costs.moves[thing.move, tween.joints.index(thing.joint)]
            assert charged == pytest.approx(thing.price)


def test_likelihoods_are_what_was_counted(insects: Engine, bridged: Tween) -> None:
    moves, states = insects.corpus.moves, insects.states
    for t, (before, after) in enumerate(pairwise(bridged.path)):
        for chain, joint in enumerate(bridged.joints):
            if joint == "facing":
                size = insects.space.sizes[chain]
                turned = (states[moves.ends, chain] - states[moves.begins, chain]) % size
                left, made = np.ones(len(turned), dtype=bool), turned == (after[chain] - before[chain]) % size
            else:
                left = states[moves.begins, chain] == before[chain]
                made = left & (states[moves.ends, chain] == after[chain])
            counted = moves.weights[made].sum() / moves.weights[left].sum() if left.any() else 0.0
            assert bridged.costs.likelihood[t, chain] == pytest.approx(counted)
            shown = bridged.followed[t, chain] and bridged.followed[t + 1, chain]
            assert (bridged.sources[t][chain] is None) == (counted == 0.0 or not shown)


def test_coordination_is_what_the_network_says(insects: Engine, bridged: Tween) -> None:
    network, skeleton = insects.network(), insects.corpus.skeleton
    for t, row in enumerate(bridged.path[1:]):
        for chain, joint in enumerate(bridged.joints):
            parent = skeleton.parents[chain] if joint != "facing" else -1
            cost = -np.log(network.get_cpds(joint).get_values()[row[chain], row[parent]]) if parent >= 0 else 0.0
            assert bridged.costs.coordination[t, chain] == pytest.approx(cost, abs=1e-9)


def test_the_report_says_how_far_each_end_is_from_its_states(insects: Engine) -> None:
    rotations = insects.corpus.rotations[[5, 9]]
    a, b = rot.mul(rotations, rot.exp(np.array([[[0.02, 0.0, 0.0]], [[0.0, 0.05, 0.0]]])))
    tween = insects.tween(*(Posture(insects.corpus.skeleton, end, insects.corpus.root[5]) for end in (a, b)))
    told = tween.report()["snap_degrees"]
    for end, rotations, states in (("A", a, tween.path[0]), ("B", b, tween.path[-1])):
        off = insects.space.distance(insects.corpus.to_chains(rotations[None]), states[None])[0]
        assert list(told[end].values()) == pytest.approx(off.tolist(), abs=1e-9)
        assert off.mean() > 0.5


def test_a_source_says_when_it_was(insects: Engine, bridged: Tween) -> None:
    starts = {clip.name: clip.start for clip in insects.corpus.clips}
    for source in (source for row in bridged.sources for source in row if source):
        assert source.seconds == insects.corpus.times[starts[source.clip] + source.posture]


# --- told -------------------------------------------------------------------------------------------------------------


def test_the_explanation_adds_up_move_by_move(bridged: Tween, tmp_path: Path) -> None:
    told = explain(read_report(report_of(bridged, tmp_path)))
    assert sum(move.cost for move in told.moves) == pytest.approx(bridged.cost, abs=1e-6)
    assert told.moved + told.coordinated + told.guided + told.tolls == pytest.approx(bridged.cost, abs=1e-6)
    assert [(move.begins, move.ends) for move in told.moves] == list(pairwise(bridged.motion.insertions[0].times))
    for how, things in (("bridge", bridged.bridges), ("wait", bridged.waits)):
        found = {(step.joint, move.move - 1) for move in told.moves for step in move.joints if step.how == how}
        assert found == {(thing.joint, thing.move) for thing in things}
    for t, move in enumerate(told.moves):
        assert [step.moved for step in move.joints] == (bridged.path[t] != bridged.path[t + 1]).tolist()
    assert json.loads(json.dumps(told.plain(), allow_nan=False))["moves"][0]["joints"][0]["joint"] == "thorax"


def test_people_read_who_moves_how_likely_and_where_it_was_seen(bridged: Tween, tmp_path: Path) -> None:
    text = str(explain(read_report(report_of(bridged, tmp_path))))
    assert text.count("\nmove ") == bridged.moves
    for bridge in bridged.bridges:
        part = text.split("\nmove ")[bridge.move + 1]
        line = next(line for line in part.splitlines() if line.split()[:1] == [bridge.joint])
        assert f"{bridge.degrees:.0f} degrees  never seen, {bridge.price:.2f} nats" in line
        assert line.endswith("bridge")
    move, chain = next((t, j) for t, row in enumerate(bridged.sources) for j, source in enumerate(row)
                      if source and bridged.path[t, j] != bridged.path[t + 1, j])  # fmt: skip
    source = bridged.sources[move][chain]
    assert source is not None
    assert f"{source.clip}" in text.split("\nmove ")[move + 1]
    assert f"posture {source.posture} ({source.seconds:.2f} s)" in text.split("\nmove ")[move + 1]


def test_what_is_least_expected_and_what_the_motion_passes_by_is_told(
    insects: Engine, bridged: Tween, tmp_path: Path
) -> None:
    for tween in (bridged, between(insects, 12, 7, moves=5)):
        told = explain(read_report(report_of(tween, tmp_path)))
        for t, (move, part) in enumerate(zip(told.moves, str(told).split("\nmove ")[1:], strict=True)):
            dear = int(tween.costs.coordination[t].argmax())
            words = (
                f"least expected beside its parent: {tween.joints[dear]} ({tween.costs.coordination[t, dear]:.2f} nats)"
            )
            assert part.count("least expected") == part.count(words) == (tween.costs.coordination[t, dear] > 0.0)
            for chain, step in enumerate(move.joints):
                assert step.followed == (tween.followed[t, chain] and tween.followed[t + 1, chain])
    assert "(reversed)" in str(told)
    assert " ()" not in str(told)


def test_no_move_is_told_too(insects: Engine, tmp_path: Path) -> None:
    still = between(insects, 3, 3)
    told = explain(read_report(report_of(still, tmp_path)))
    assert told.moves == []
    assert str(told).splitlines()[0] == "0 moves in 0.00 s, optimal, gap 0.00%"


def test_the_command_names_states_by_their_names(run: Run) -> None:
    ran = run("tween", *ENDS, "--corpus", "ballet", "--report", "report.json")
    assert ran.code == 0
    shown, report = run("explain", "report.json"), json.loads(Path("report.json").read_text("utf-8"))
    assert (shown.code, shown.err) == (0, "")
    assert "arabesque" in shown.out
    assert f"\n{report['cost']:.3f} nats: " in f"\n{shown.out}"
    told = run("explain", "report.json", "--json").json
    assert [len(move["joints"]) for move in told["moves"]] == [len(report["joints"])] * report["moves"]


# --- bad input --------------------------------------------------------------------------------------------------------


def test_what_is_no_report_is_refused(bridged: Tween, tmp_path: Path, run: Run) -> None:
    report = bridged.report()
    path = tmp_path / "bad.json"
    for change, words in (
        ({"costs": None}, r"costs"),
        ({"path": report["path"][:-1]}, "tables are not of"),
        ({"degrees": []}, "tables are not of"),
        ({"names": report["names"][:-1]}, "tables are not of"),
        ({"times": [0.0]}, "postures and 1 times"),
        ({"times": report["times"][:-1]}, f"postures and {len(report['times']) - 1} times"),
        ({"path": [], "names": []}, "tables"),
    ):
        path.write_text(json.dumps(report | change), "utf-8")
        with pytest.raises(FormatError, match=words):
            read_report(path)
    for text in ("[]", "{", "", "\udcff"):
        path.write_bytes(text.encode("utf-8", "surrogateescape"))
        ran = run("explain", path)
        assert (ran.code, ran.out) == (2, "")
        assert ran.err.startswith(f"error: {path}: is no report of a tween: ")
        assert ran.err.count("\n") == 1
    assert run("explain", tmp_path / "gone.json").code == 2


def test_advice_for_movement_does_not_write_over_it(run: Run) -> None:
    assert run("posture", "ballet/first", "-o", "first.json").code == 0
    ran = run("explain", "first.json")
    assert ran.err.endswith("tween writes one: motionmind tween A B --corpus NAME --report first-report.json\n")


def test_damaged_reports_are_told_or_refused(
    bridged: Tween, tmp_path: Path, mutate: Callable[[str, random.Random], bytes]
) -> None:
    text, rng, path = json.dumps(bridged.report()), random.Random(0), tmp_path / "bad.json"
    refused = 0
    for _ in range(150):
        path.write_bytes(mutate(text, rng))
        try:
            str(explain(read_report(path)))
        except FormatError:
            refused += 1
    assert refused > 50
