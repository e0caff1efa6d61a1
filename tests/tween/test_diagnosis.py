"""What is said where nothing joins A and B, and that what is said to help does."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
from bundled_clips import BALLET, ballet_clip
from command_line import Run

from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion, Posture
from motionmind.discretize.codebook import Codebook
from motionmind.errors import NoPathError
from motionmind.formats import read_posture, write_motion, write_posture
from motionmind.tween.engine import Engine

Found = list[tuple[Posture, Posture, dict[str, Any]]]
CUT = {"jump": (0, 9), "plies": (0, 7), "tendus": (4, 16), "developpes": (0, 15), "adagio": (10, 40)}


def clips() -> list[Motion]:
    """Parts of clips, which do not come back to where they began; of one, beginning and end on the other side."""
    parts = [ballet_clip(name).slice(*part) for name, part in CUT.items()]
    other = [replace(mirrored(parts[2].slice(*part)), name=f"other {part[0]}") for part in ((0, 2), (10, 12))]
    return [*parts, *(replace(part, skeleton=parts[0].skeleton) for part in other)]


def fit(**options: Any) -> Engine:
    return Engine.fit(clips(), name="few", **options)


@pytest.fixture(scope="module")
def few() -> Engine:
    return fit()


@pytest.fixture(scope="module")
def found(few: Engine) -> Found:
    """Pairs of postures that attested moves do not join, with what is said of each."""
    corpus, out = few.corpus, []
    for a, b in np.random.default_rng(0).integers(len(corpus), size=(22, 2)):
        ends = [Posture(corpus.skeleton, corpus.rotations[i], corpus.root[i]) for i in (a, b)]
        try:
            few.tween(*ends, strict=True)
        except NoPathError as error:
            out.append((*ends, error.diagnosis or {}))
    assert len(out) > 5
    return out


def at_fault(engine: Engine, a: Posture, b: Posture) -> set[str]:
    try:
        engine.tween(a, b, strict=True)
    except NoPathError as error:
        return {fault["joint"] for fault in (error.diagnosis or {})["faults"]}
    return set()


def test_the_joints_at_fault_are_those_without_a_way(few: Engine, found: Found) -> None:
    for a, b, diagnosis in found:
        faults = {fault["joint"]: fault for fault in diagnosis["faults"]}
        states = few.space.assign(few.corpus.to_chains(np.stack([a.rotations, b.rotations])))
        for chain, joint in enumerate(few.corpus.chains):
            graph, (start, goal) = few.joint_graph(joint), map(int, states[:, chain])
            assert (joint in faults) == (not nx.has_path(graph, start, goal))
            if joint in faults:
                fault = faults[joint]
                assert fault["needs"] is None
                ahead, behind = nx.descendants(graph, start) | {start}, nx.ancestors(graph, goal) | {goal}
                assert (fault["ahead"], fault["behind"]) == (len(ahead), len(behind))
                centres = few.space.of(chain)
                cosine = np.abs(centres[sorted(ahead)] @ centres[sorted(behind)].T).max()
                assert fault["gap"]["degrees"] == pytest.approx(np.degrees(2.0 * np.arccos(min(1.0, cosine))))
                assert (fault["start"], fault["goal"]) == (f"state {start}", f"state {goal}")


def test_what_would_join_all_is_what_would_join_each(found: Found) -> None:
    joints_apart = 0
    for _, _, diagnosis in found:
        each = [{remedy["what"] for remedy in fault["remedies"]} for fault in diagnosis["faults"]]
        assert {*diagnosis["helps"]} == set.intersection(*each)
        joints_apart += set.intersection(*each) != set.union(*each)
    assert joints_apart


@pytest.mark.long
def test_what_is_said_to_help_does(few: Engine, found: Found) -> None:
    backwards, both_sides = fit(reverse=1.0), fit(mirror=True)
    tried: dict[str, int] = {}
    for a, b, diagnosis in found:
        for fault in diagnosis["faults"]:
            joint, helps = fault["joint"], {remedy["what"]: remedy["moves"] for remedy in fault["remedies"]}
            for what in helps:
                kind = what.split(" ")[0] if what.startswith(("bridges", "a ")) else what
                tried[kind] = tried.get(kind, 0) + 1
            # Backwards the states are what they were, so it is known both ways.
            assert (joint in at_fault(backwards, a, b)) == ("the corpus learned backwards too (--reverse)" not in helps)
            if "the corpus learned in a mirror too (--mirror)" in helps:
                assert joint not in at_fault(both_sides, a, b)
            assert "bridges, without strict" in helps
        assert few.tween(a, b).moves <= 60
    assert len(tried) == 4


def test_a_tolerance_that_is_said_to_help_does(found: Found) -> None:
    tried = 0
    for a, b, diagnosis in found[:6]:
        for fault in diagnosis["faults"]:
            for what in (remedy["what"] for remedy in fault["remedies"] if remedy["what"].startswith("a tolerance")):
                degrees = float(what.split()[3])
                coarser = fit(discretization=Codebook(15.0, {fault["joint"]: degrees}))
                assert fault["joint"] not in at_fault(coarser, a, b)
                tried += 1
            if tried:  # each takes a corpus of its own
                return
    assert tried


def test_too_few_moves_are_diagnosed_with_how_many_it_takes(few: Engine) -> None:
    corpus = few.corpus
    ends = [Posture(corpus.skeleton, corpus.rotations[i], corpus.root[i]) for i in (3, 60)]
    with pytest.raises(NoPathError, match=r"in at most 1 move \(allow more moves\)") as refused:
        few.tween(*ends, moves=1)
    assert refused.value.diagnosis is not None
    faults = refused.value.diagnosis["faults"]
    for fault in faults:
        assert fault["needs"] > 1
        assert fault["gap"] is None
        assert f"{fault['joint']} needs {fault['needs']} moves from {fault['start']} to {fault['goal']}" in str(
            refused.value
        )
    assert few.tween(*ends, moves=max(fault["needs"] for fault in faults)).moves > 1


def test_named_states_are_called_by_their_names() -> None:
    ballet = Engine.load("ballet")
    a, b = (read_posture(BALLET / "postures" / name) for name in ("arabesque.json", "fifth.json"))
    with pytest.raises(NoPathError, match=r"needs \d moves from state \d+ \(.+\) to state \d+ \(.+\)"):
        ballet.tween(a, b, max_moves=1)


def test_the_report_holds_the_diagnosis(run: Run, found: Found, few: Engine) -> None:
    names = [f"{clip.name}.json" for clip in clips()]
    for name, clip in zip(names, clips(), strict=True):
        write_motion(name, clip)
    assert run("corpus", "build", "few", *names).code == 0
    a, b, diagnosis = found[0]
    write_posture("a.json", a)
    write_posture("b.json", b)
    ran = run("tween", "a.json", "b.json", "--corpus", "few", "--strict", "--report", "report.json", "-o", "out.json")
    assert (ran.code, ran.out) == (3, "")
    report = json.loads(Path("report.json").read_text("utf-8"))
    assert report.keys() == {"status", "message", "diagnosis"}
    assert (report["status"], report["message"]) == ("no path", ran.err.removeprefix("error: ").rstrip("\n"))
    told = json.loads(json.dumps(diagnosis))
    for fault in (*told["faults"], *report["diagnosis"]["faults"]):  # files round
        fault["gap"]["degrees"] = round(fault["gap"]["degrees"], 3)
    assert report["diagnosis"] == told
    assert not Path("out.json").exists()
    explained = run("explain", "report.json")
    assert (explained.code, explained.out) == (0, f"{report['message']}\n")
    assert run("explain", "report.json", "--json").json == json.loads(Path("report.json").read_text("utf-8"))
    alone = run("tween", "a.json", "b.json", "--corpus", "few", "--strict", "--report", "-")
    assert (alone.code, alone.json["message"]) == (3, report["message"])
    assert "would join them: bridges, without strict (in " in ran.err
