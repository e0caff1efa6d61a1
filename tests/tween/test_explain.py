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
from bodies import insect
from command_line import Run

from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.human import human23, human44
from motionmind.body.motion import Posture
from motionmind.body.noticeable import NOTICEABLE_DEG
from motionmind.discretize.states import StateSpace
from motionmind.errors import FormatError
from motionmind.geometry import rotations as rot
from motionmind.tween.changes import describe_changes, name_parts
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
    text = explain(read_report(report_of(bridged, tmp_path))).details()
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
        for t, (move, part) in enumerate(zip(told.moves, told.details().split("\nmove ")[1:], strict=True)):
            dear = int(tween.costs.coordination[t].argmax())
            words = (
                f"least expected beside its parent: {tween.joints[dear]} ({tween.costs.coordination[t, dear]:.2f} nats)"
            )
            assert part.count("least expected") == part.count(words) == (tween.costs.coordination[t, dear] > 0.0)
            for chain, step in enumerate(move.joints):
                assert step.followed == (tween.followed[t, chain] and tween.followed[t + 1, chain])
    assert "(reversed)" in told.details()
    assert " ()" not in told.details()


def test_no_move_is_told_too(insects: Engine, tmp_path: Path) -> None:
    still = between(insects, 3, 3)
    told = explain(read_report(report_of(still, tmp_path)))
    assert told.moves == []
    assert told.details().splitlines()[0] == "0 moves in 0.00 s, optimal, gap 0.00%"
    assert str(told) == "0 moves in 0.00 s; path optimal"


def test_the_command_names_states_by_their_names(run: Run) -> None:
    ran = run("tween", *ENDS, "--corpus", "ballet", "--report", "report.json")
    assert ran.code == 0
    shown, report = run("explain", "report.json", "--all"), json.loads(Path("report.json").read_text("utf-8"))
    assert (shown.code, shown.err) == (0, "")
    assert "arabesque" in shown.out
    assert f"\n{report['cost']:.3f} nats: " in f"\n{shown.out}"
    told = run("explain", "report.json", "--json").json
    assert [len(move["joints"]) for move in told["moves"]] == [len(report["joints"])] * report["moves"]


# --- a page -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("moves", [4, 9, 40])
def test_a_page_shows_what_turns_farthest_and_nothing_that_is_still(insects: Engine, moves: int) -> None:
    told = explain(between(insects, 12, 7, moves=moves))
    first, *lines = str(told).splitlines()
    assert first.startswith(f"{moves} move")
    assert (
        f"; motion reaches {told.followed:.0%} of the path's joint states; {told.motion_attested:.0%} of the motion's"
        in first
    )
    assert len(lines) <= max(30 + moves, 2 * moves)
    shown = "\n".join(lines)
    for move in told.moves:
        turning = [step for step in move.joints if step.moved and step.degrees >= NOTICEABLE_DEG]
        if turning:
            farthest = max(turning, key=lambda step: step.degrees)
            row = next(line for line in lines if line.startswith(f"{move.begins:.2f} to {move.ends:.2f} s"))
            assert f" {farthest.joint.removeprefix('left_').removeprefix('right_')} {farthest.degrees:.0f} deg" in row
    moved = {step.joint for move in told.moves for step in move.joints if step.moved}
    for name in {step.joint for step in told.moves[0].joints} - moved:
        assert f" {name} " not in shown


def test_directions_are_those_of_the_anatomy() -> None:
    skeleton, anatomy = human23(), anatomy_named("human23")
    rest = {"left_elbow": [0.0, 0.0, 0.0]}
    for joint, degrees, words in (
        ("left_elbow", [0.0, -40.0, 0.0], "toward flexion"),
        ("right_elbow", [0.0, -40.0, 0.0], "toward flexion"),
        ("right_hip", [0.0, 0.0, 30.0], "toward abduction"),
        ("left_hip", [0.0, -30.0, 0.0], "toward inward rotation"),
        ("thorax", [0.0, 20.0, 0.0], "toward turn left"),
        ("thorax", [0.0, 0.0, 20.0], "toward bend right"),
        ("left_ankle", [-20.0, 0.0, 0.0], "toward dorsiflexion"),
    ):
        turned = anatomy.rotations({name: np.array([given]) for name, given in (rest | {joint: degrees}).items()})
        ends = np.concatenate([anatomy.rotations({joint: np.zeros((1, 3))}), turned])
        space = StateSpace(
            skeleton.names, ends.transpose(1, 0, 2).reshape(-1, 4), 2 * np.arange(24), "codebook", np.full(23, 15.0)
        )
        path, chain = np.zeros((2, 23), np.int32), skeleton.index(joint)
        path[1, chain] = 1
        (row,) = describe_changes(space, skeleton, path, space.decode(path))
        assert row[chain] == words, joint
        assert set(row[:chain] + row[chain + 1 :]) == {""}
        (back,) = describe_changes(space, skeleton, path[::-1], space.decode(path[::-1]))
        assert back[chain] != words
        named = replace(space, labels=tuple(("bas", "second") for _ in range(23)))
        assert describe_changes(named, skeleton, path, named.decode(path))[0][chain] == "to second"


def test_parts_are_what_a_viewer_calls_them() -> None:
    parts = dict(zip(human44().names, name_parts(human44(), human44().names), strict=True))
    assert {parts[name] for name in ("left_clavicle", "left_elbow", "left_wrist")} == {"left arm"}
    assert (parts["right_thumb"], parts["right_toes"], parts["pelvis"]) == ("right hand", "right leg", "torso")
    assert parts["atlantal"] == "head"
    insect_parts = set(name_parts(insect(), (*insect().names, "facing")))
    assert {"trunk", "left front coxa", "whole body"} <= insect_parts


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
