"""The engine end to end: on a body of six segments, on human23, and on recorded ballet."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bodies import insect
from saved_corpora import entries, put_entries

from motionmind.body.human import human23
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.corpus import cache, store
from motionmind.discretize.codebook import Codebook
from motionmind.errors import (
    CorpusError,
    FormatError,
    MotionMindError,
    MotionMindWarning,
    NoPathError,
    SkeletonError,
    WrongTypeError,
)
from motionmind.footing.root import stand
from motionmind.formats import read_motion, read_posture, write_motion, write_posture
from motionmind.geometry import rotations as rot
from motionmind.names.postures import find_posture
from motionmind.retarget.retarget import own_skeleton
from motionmind.tween.engine import Engine
from motionmind.tween.result import Tween


def scurry(name: str, seed: int, frames: int = 40) -> Motion:
    """A tripod gait along a curve, with a pause in it."""
    body, rng = insect(), np.random.default_rng(seed)
    t = np.arange(frames) * 0.1
    phase = np.cumsum(np.where((np.arange(frames) % 20) < 5, 0.0, 0.9)) + rng.uniform(0.0, 6.0)
    q = np.tile(rot.IDENTITY, (frames, len(body), 1))
    for segment in range(6):
        beat = phase + np.pi * (segment % 2)
        q[:, 2 + 2 * segment] = rot.about_vertical(0.5 * np.sin(beat))
        q[:, 3 + 2 * segment] = rot.from_axis_angle([0.0, 0.0, 1.0], 0.4 * np.maximum(np.cos(beat), 0.0))
    q[:, 1] = rot.from_axis_angle([1.0, 0.0, 0.0], 0.5 * np.sin(0.7 * t))
    q[:, 0] = rot.about_vertical(rng.uniform(-0.5, 0.5) * t)
    root = np.stack([0.0 * t, 0.0 * t, 0.01 * phase], axis=1)
    return Motion(body, q, stand(body, q, root, np.zeros(frames)), t, name)


def dance(name: str, seed: int, frames: int = 30) -> Motion:
    """A person who moves every joint a little, on the floor."""
    body, rng = human23(), np.random.default_rng(seed)
    t = np.arange(frames) * 0.2
    q = rot.exp(0.4 * np.sin(1.1 * t[:, None, None] + np.random.default_rng(0).uniform(0.0, 6.0, (23, 3))))
    q[:, 0] = rot.mul(rot.about_vertical(rng.uniform(-0.5, 0.5) * t), q[:, 0])
    root = np.stack([np.sin(t), 0.0 * t, np.cos(t)], axis=1)
    return Motion(body, rot.normalise(q), stand(body, q, root, np.zeros(frames)), t, name)


CLIPS = [scurry("scurry", 0), scurry("hurry", 1)]


@pytest.fixture(scope="module")
def six_segments() -> Engine:
    return Engine.fit(CLIPS, name="insects", discretization=Codebook(15.0), licence="CC0-1.0")


@pytest.fixture(scope="module")
def person() -> Engine:
    return Engine.fit([dance("one", 1), dance("two", 2)], name="people", facing="stage", discretization=Codebook(20.0))


@pytest.fixture(scope="module")
def joined(six_segments: Engine) -> Tween:
    return six_segments.tween(CLIPS[0].posture(3), CLIPS[1].posture(30))


def assert_sound(tween: Tween, a: Posture, b: Posture) -> None:
    motion = tween.motion
    np.testing.assert_array_equal(motion.rotations[[0, -1]], [a.rotations, b.rotations])
    np.testing.assert_array_equal(motion.root[[0, -1]], [a.root, b.root])
    np.testing.assert_allclose(np.linalg.norm(motion.rotations, axis=-1), 1.0, atol=1e-9)
    assert np.isfinite(motion.root).all()
    (insertion,) = motion.insertions
    assert len(insertion.times) == tween.moves + 1
    assert (insertion.times[0], insertion.times[-1]) == (motion.times[0], motion.times[-1])
    root = motion.skeleton.names[0]
    assert set(insertion.bridged) == {(root if b.joint == "facing" else b.joint, b.move) for b in tween.bridges}
    assert tween.path.shape == (tween.moves + 1, len(tween.joints))
    assert tween.lower_bound <= tween.cost
    assert (tween.status == "optimal") == (tween.cost - tween.lower_bound <= 1e-6)
    assert 0.0 <= tween.attested <= 1.0


# --- tweens -----------------------------------------------------------------------------------------------------------


def test_six_segments_are_joined_from_a_to_b(joined: Tween) -> None:
    assert_sound(joined, CLIPS[0].posture(3), CLIPS[1].posture(30))
    assert joined.joints == (*insect().names, "facing")
    assert joined.moves >= 1
    assert joined.motion.times[-1] >= 0.1 * joined.moves - 0.02  # longer where it would be too fast


@pytest.mark.long
@pytest.mark.parametrize("pair", [(0, 20), (5, 11), (29, 2)])
def test_people_are_joined_from_a_to_b(person: Engine, pair: tuple[int, int]) -> None:
    a, b = dance("one", 1).posture(pair[0]), dance("two", 2).posture(pair[1])
    tween = person.tween(a, b)
    assert_sound(tween, a, b)
    assert tween.joints == human23().names


def test_a_clip_is_found_again_between_two_of_its_postures(six_segments: Engine) -> None:
    tween = six_segments.tween(CLIPS[0].posture(6), CLIPS[0].posture(10), strict=True, moves=4)
    assert tween.attested == 1.0
    assert tween.bridges == ()
    assert tween.moves == 4


def test_a_equal_to_b_is_no_move_at_no_cost(six_segments: Engine) -> None:
    a = CLIPS[0].posture(7)
    tween = six_segments.tween(a, Posture(a.skeleton, -a.rotations, a.root))
    assert (tween.moves, tween.cost, tween.lower_bound, tween.gap, tween.status) == (0, 0.0, 0.0, 0.0, "optimal")
    assert len(tween.motion) == 1
    np.testing.assert_array_equal(tween.motion.rotations[0], a.rotations)
    assert tween.motion.insertions[0].times.tolist() == [0.0]
    assert (tween.bridges, tween.waits, tween.sources, tween.attested) == ((), (), (), 1.0)
    assert json.loads(json.dumps(tween.report()))["path"] == tween.path.tolist()


def test_a_equal_to_b_is_left_for_a_posture_to_pass_through(six_segments: Engine) -> None:
    a, via = CLIPS[0].posture(7), CLIPS[0].posture(10)
    tween = six_segments.tween(a, a, via=[via])
    assert 0 < tween.passed[0] < tween.moves
    states = six_segments.space.assign(six_segments.corpus.to_chains(via.rotations[None]))[0]
    np.testing.assert_array_equal(tween.path[tween.passed[0]], states)


def test_the_same_posture_elsewhere_is_a_move(six_segments: Engine) -> None:
    a = CLIPS[0].posture(7)
    b = replace(a, root=a.root + np.array([0.1, 0.0, 0.0]))
    tween = six_segments.tween(a, b)
    assert tween.moves >= 1
    assert_sound(tween, a, b)


@pytest.mark.parametrize("moves", [2, 5, 9])
def test_as_many_moves_as_are_asked_for(six_segments: Engine, moves: int) -> None:
    a, b = CLIPS[0].posture(6), CLIPS[0].posture(7)
    tween = six_segments.tween(a, b, moves=moves)
    assert tween.moves == moves
    assert_sound(tween, a, b)
    still = six_segments.tween(a, a, moves=moves)
    assert still.moves == moves


def test_without_pace_no_number_of_moves_is_cheaper_than_the_best(six_segments: Engine) -> None:
    a, b = CLIPS[0].posture(3), CLIPS[1].posture(30)
    joined = six_segments.tween(a, b, without=["pace"])
    assert joined.length is not None
    for moves in range(max(1, joined.moves - 2), joined.moves + 3):
        try:
            assert six_segments.tween(a, b, moves=moves, guide=0.0).cost >= joined.length.cost - 1e-6
        except NoPathError:
            assert moves < joined.moves


def test_without_a_way_through_the_joint_is_named() -> None:
    clips = [scurry("scurry", 0), scurry("hurry", 1)]
    head = clips[1].rotations.copy()
    head[:, 1] = rot.mul(rot.from_axis_angle([0.0, 0.0, 1.0], 1.5), head[:, 1])  # states that nothing leads to
    clips[1] = replace(clips[1], rotations=head)
    engine = Engine.fit(clips, discretization=Codebook(15.0))
    a, b = clips[0].posture(3), clips[1].posture(30)
    with pytest.raises(
        NoPathError, match=r"no path from A to B in at most 60 moves \(without strict(.|\n)*  head: state"
    ):
        engine.tween(a, b, strict=True)
    bridged = engine.tween(a, b)
    assert "head" in {bridge.joint for bridge in bridged.bridges}
    assert bridged.attested < 1.0
    with pytest.raises(NoPathError, match=r"in at most 1 move \(allow more moves\)(.|\n)* needs \d+ moves"):
        engine.tween(a, b, moves=1)


@pytest.mark.parametrize(
    ("option", "values", "words"),
    [
        ("moves", (0, -1, 2.5, 10**9), "moves must be a whole number from 1"),
        ("max_moves", (0, 10**9), "max_moves must be a whole number"),
        ("node_budget", (0, -5, 10**12), "node_budget must be a whole number"),
        ("fps", (0.0, -30.0, np.nan, np.inf, 1e9, 1e-9), "fps must be a number of frames a second"),
        ("weights", ("heavy",), "weights must be 'conditional' or 'printed', not 'heavy'"),
        ("lambda_", (-1.0, np.nan), "lambda must be a number of nats"),
        ("beta", (-1.0, np.inf), "beta must be"),
        ("tau", (-1.0, np.nan), "tau must be"),
        ("bridge_price", (-1.0, np.nan), "bridge_price must be"),
    ],
)
def test_options_out_of_range_are_named(six_segments: Engine, option: str, values: tuple[Any, ...], words: str) -> None:
    for value in values:
        with pytest.raises(MotionMindError, match=words):
            six_segments.tween(CLIPS[0].posture(3), CLIPS[0].posture(9), **{option: value})


def test_another_skeleton_is_refused_and_the_difference_named(six_segments: Engine, person: Engine) -> None:
    fly, man = CLIPS[0].posture(3), dance("one", 1).posture(3)
    with pytest.raises(SkeletonError, match="posture B is on another skeleton than corpus 'insects': human23 lacks"):
        six_segments.tween(fly, man)
    with pytest.raises(SkeletonError, match="posture A is on another skeleton than corpus 'people': insect lacks"):
        person.tween(fly, man)
    with pytest.raises(CorpusError, match="one is on another skeleton than scurry"):
        Engine.fit([CLIPS[0], dance("one", 1)])


def test_more_states_than_can_be_held_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motionmind.learned.learning.MAX_STATES_LEARNED", 12)
    monkeypatch.setattr("motionmind.learned.learning.MAX_FACINGS", 12)
    with pytest.raises(CorpusError, match=r"'many': \w+ has \d+ states within 0.5 degrees, and a joint can have 12"):
        Engine.fit(CLIPS, name="many", discretization=Codebook(0.5), facing="stage")
    with pytest.raises(CorpusError, match=r"'many': the facing has 720 states within 0\.5 degrees, and can have 12"):
        Engine.fit(CLIPS, name="many", discretization=Codebook(0.5))
    Engine.fit(CLIPS, name="few", discretization=Codebook(35.0))


def test_a_body_of_one_joint_is_a_body() -> None:
    pole = Skeleton("pole", ("pole",), (-1,), np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]]))
    q = rot.from_axis_angle([0.0, 0.0, 1.0], np.linspace(0.0, 2.0, 20))[:, None]
    swing = Motion(pole, q, np.zeros((20, 3)), np.arange(20) * 0.1, "swing")
    for facing in ("free", "stage"):
        engine = Engine.fit([swing], facing=facing, discretization=Codebook(10.0))  # type: ignore[arg-type]
        assert_sound(engine.tween(swing.posture(0), swing.posture(12)), swing.posture(0), swing.posture(12))


# --- what it says -----------------------------------------------------------------------------------------------------

REPORT = [
    "asked",
    "status",
    "cost",
    "lower_bound",
    "gap",
    "moves",
    "length",
    "tempo",
    "expansions",
    "peak_nodes",
    "node_budget",
    "seconds",
    "joints",
    "parts",
    "path",
    "attested",
    "motion_attested",
    "bridges",
    "waits",
    "differs",
    "what_if",
    "vias",
    "snap_degrees",
    "path_degrees",
    "followed",
    "sources",
    "detail",
    "left_out",
    "gave",
    "reached",
    "accented",
    "travelled",
    "stayed",
    "shown",
    "times",
    "names",
    "degrees",
    "changes",
    "likelihood",
    "costs",
    "credits",
    "motion_sha256",
]


def test_a_report_has_the_documented_keys_and_is_json(joined: Tween) -> None:
    report = json.loads(json.dumps(joined.report(), allow_nan=False))
    assert list(report) == REPORT
    assert list(report["seconds"]) == ["load", "problem", "bound", "search", "realise"]
    assert report["moves"] == len(report["path"]) - 1 == len(report["sources"])
    assert report["snap_degrees"].keys() == {"A", "B"}
    assert list(report["snap_degrees"]["A"]) == list(joined.joints) == report["joints"]
    assert max(report["snap_degrees"]["A"].values()) <= 15.0 + 1e-6


def test_sources_attest_what_they_are_said_to(six_segments: Engine, joined: Tween) -> None:
    starts = {clip.name: clip for clip in six_segments.corpus.clips}
    attested, named = 0, 0
    for move, (before, after) in enumerate(pairwise(joined.path)):
        for chain, source in enumerate(joined.sources[move]):
            edge = six_segments.grammar.transitions.edge(chain, before[chain], after[chain])
            attested += edge >= 0
            shown = joined.followed[move, chain] and joined.followed[move + 1, chain]
            assert (source is None) == (edge < 0 or not shown)
            if source is None:
                continue
            named += 1
            clip = starts[source.clip]
            assert 0 <= source.posture < clip.stop - clip.start - 1
            seen = six_segments.states[clip.start + source.posture : clip.start + source.posture + 2, chain].astype(int)
            if joined.joints[chain] == "facing":  # pooled: by how many steps it turns
                assert (seen[1] - seen[0] - (int(after[chain]) - int(before[chain]))) % six_segments.space.sizes[
                    chain
                ] == 0
            else:
                assert seen.tolist() == [before[chain], after[chain]]
    assert joined.attested == attested / (joined.moves * len(joined.joints))
    assert 0 < named < attested


def test_bridges_and_waits_are_what_is_not_attested(six_segments: Engine, joined: Tween) -> None:
    goal = joined.path[-1]
    for wait in joined.waits:
        chain = joined.joints.index(wait.joint)
        assert joined.path[wait.move, chain] == joined.path[wait.move + 1, chain] == goal[chain]
    edges = six_segments.grammar.transitions.edges(joined.path)
    unattested = {(joined.joints[chain], int(move)) for move, chain in np.argwhere(edges < 0)}
    flagged = {(thing.joint, thing.move) for thing in (*joined.bridges, *joined.waits)}
    assert unattested <= flagged
    for bridge in joined.bridges:
        chain = joined.joints.index(bridge.joint)
        before, after = six_segments.space.of(chain)[joined.path[bridge.move : bridge.move + 2, chain]]
        assert bridge.degrees == pytest.approx(np.degrees(rot.angle(before, after)), abs=1e-4)


def test_a_joint_graph_is_the_counts(six_segments: Engine) -> None:
    states = six_segments.states[:, six_segments.space.index("head")]
    graph = six_segments.joint_graph("head")
    pairs = [(int(states[i]), int(states[i + 1])) for i in six_segments.corpus.begins]
    assert {(s, t): data["count"] for s, t, data in graph.edges(data=True)} == {
        pair: float(pairs.count(pair)) for pair in set(pairs)
    }
    for state, data in graph.nodes(data=True):
        assert data["visits"] == np.sum(states == state)
        assert rot.angle(np.array(data["orientation"]), six_segments.space.of("head")[state]) < 1e-12
        leaving = [np.exp(-edge["weight"]) for _, _, edge in graph.out_edges(state, data=True)]
        assert sum(leaving) == pytest.approx(1.0) or not leaving
    with pytest.raises(SkeletonError, match="no joint 'wing'"):
        six_segments.joint_graph("wing")
    ring = six_segments.joint_graph("facing")
    assert len({ring.out_degree(state) for state in ring}) == 1


def test_what_is_searched_is_the_network_entry_by_entry(six_segments: Engine, person: Engine) -> None:
    for engine in (six_segments, person):
        network, skeleton = engine.network(), engine.corpus.skeleton
        assert network.check_model()
        assert set(network.nodes) == set(skeleton.names)
        for chain, (joint, parent) in enumerate(zip(skeleton.names, skeleton.parents, strict=True)):
            if parent < 0:
                assert network.get_parents(joint) == []
                continue
            cpd = network.get_cpds(joint)
            assert cpd.variables == [joint, skeleton.names[parent]]
            table = engine.grammar.coordination.table(chain, engine.grammar.transitions.starts)
            np.testing.assert_allclose(np.exp(-table).T, cpd.get_values(), rtol=1e-9)


def test_what_the_corpus_holds_is_said(six_segments: Engine) -> None:
    info = json.loads(json.dumps(six_segments.info(), allow_nan=False))
    assert (info["name"], info["licence"], info["postures"], info["moves"]) == ("insects", "CC0-1.0", 80, 78)
    assert info["joints"] == list(insect().names)
    assert info["states"]["head"] == six_segments.space.sizes[1]
    check = json.loads(json.dumps(six_segments.check(pairs=50, seed=3), allow_nan=False))
    assert {key: check[key] for key in info} == info
    assert 0.0 <= check["joinable"] <= 1.0
    assert check == six_segments.check(pairs=50, seed=3)
    for options in ({"pairs": 0}, {"seed": -1}):
        with pytest.raises(MotionMindError, match="must be"):
            six_segments.check(**options)


# --- on disk ----------------------------------------------------------------------------------------------------------


def test_what_is_loaded_answers_as_what_was_saved(six_segments: Engine, joined: Tween, tmp_path: Path) -> None:
    six_segments.save(tmp_path / "corpora" / "insects")
    loaded = Engine.load("insects", tmp_path)
    a, b = CLIPS[0].posture(3), CLIPS[1].posture(30)
    again = loaded.tween(a, b)
    for name, tween in (("fitted", joined), ("loaded", again)):
        write_motion(tmp_path / f"{name}.json", tween.motion)
    assert (tmp_path / "fitted.json").read_bytes() == (tmp_path / "loaded.json").read_bytes()
    assert again.problem() == joined.problem()
    assert [again.report()[key] for key in REPORT if key != "seconds"] == [
        joined.report()[key] for key in REPORT if key != "seconds"
    ]
    assert loaded.info() == six_segments.info()
    assert loaded.check(20) == six_segments.check(20)
    assert loaded.corpus.skeleton == six_segments.corpus.skeleton
    assert loaded.load_seconds > 0.0
    loaded.save(tmp_path / "again")
    saved = tmp_path / "corpora" / "insects"
    for path in saved.rglob("*.*"):
        assert path.read_bytes() == (tmp_path / "again" / path.relative_to(saved)).read_bytes()


def test_a_built_corpus_that_is_damaged_is_a_clear_error(six_segments: Engine, tmp_path: Path) -> None:
    good = tmp_path / "good"
    six_segments.save(good)
    manifest = json.loads((good / "manifest.json").read_text("utf-8"))

    def refused(change: Callable[[dict[str, Any]], object], words: str) -> None:
        broken = json.loads(json.dumps(manifest))
        change(broken)
        (good / "manifest.json").write_text(json.dumps(broken), "utf-8")
        with pytest.raises(MotionMindError, match=words):
            Engine.load(str(good))

    for key in manifest.keys() - {"format", "version", "skip"}:
        refused(lambda broken, key=key: broken.pop(key), "object" if key == "arrays" else f"no key `{key}`")
    for name in manifest["arrays"]:
        refused(lambda broken, name=name: broken["arrays"].pop(name), f"lists no array {name}")
    refused(lambda broken: broken["skeleton"]["names"].pop(), "joints need as many parents")
    refused(lambda broken: broken["skeleton"].update(parents=[0] * 14), "must be the root")
    refused(lambda broken: broken["space"].update(starts=[0, 1]), "state space")
    refused(lambda broken: broken.update(facing="north"), r"\$.facing")
    (good / "manifest.json").write_text(json.dumps(manifest), "utf-8")
    clips = entries(good)
    put_entries(good, [*clips[:-1], clips[-1] | {"stop": clips[-1]["stop"] - 1}])
    with pytest.raises(MotionMindError, match="clips do not follow one another"):
        Engine.load(str(good))
    put_entries(good, clips[:-1])
    with pytest.raises(FormatError, match=r"clips\.starts is of the shape"):
        Engine.load(str(good))
    put_entries(good, clips)
    Engine.load(str(good))
    (good / "1" / "root.npy").unlink()
    with pytest.raises(FormatError, match=r"root\.npy"):
        Engine.load(str(good))


@pytest.fixture
def written(tmp_path: Path, empty_cache: Path) -> Path:
    """A corpus as a person writes it; what is learned from it is kept in tmp_path / "cache"."""
    folder = tmp_path / "corpora" / "mine"
    (folder / "clips").mkdir(parents=True)
    for clip in CLIPS:
        write_motion(folder / "clips" / f"{clip.name}.json", clip)
    manifest = {
        "format": store.FORMAT,
        "version": store.VERSIONS[store.FORMAT],
        **{"name": "mine", "title": "Insects", "author": "us", "source": "here", "licence": "CC0-1.0"},
        **{"facing": "free", "rate": None, "discretization": {"kind": "codebook", "tolerance": 15}},
        "clips": [{"name": f"the {c.name}", "file": f"clips/{c.name}.json", "about": "segments"} for c in CLIPS],
    }
    (folder / "manifest.json").write_text(json.dumps(manifest), "utf-8")
    return folder


def test_a_written_corpus_is_learned_once_and_again_when_it_changes(written: Path, tmp_path: Path) -> None:
    first = Engine.load("mine", tmp_path)
    assert first.info()["clips"][0] == {"name": "the scurry", "postures": 40, "about": "segments", "performer": "us"}
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.*")}
    assert Engine.load("mine", tmp_path).info() == first.info()
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.*")} == before
    write_motion(written / "clips" / "hurry.json", CLIPS[1].slice(0, 30))
    assert Engine.load("mine", tmp_path).info()["postures"] == 70


def test_a_damaged_cache_is_learned_again(written: Path, tmp_path: Path) -> None:
    info = Engine.load("mine", tmp_path).info()
    (built,) = (tmp_path / "cache" / "corpora").iterdir()
    for damage, words in (
        (
            lambda: next(built.rglob("states.npy")).unlink(),
            r"states\.npy: cannot be read .*; learning from mine",
        ),
        (lambda: (built / "manifest.json").write_text("{"), r"manifest\.json: cannot be read .*; learning from mine"),
    ):
        damage()
        with pytest.warns(MotionMindWarning, match=words) as warned:
            assert Engine.load("mine", tmp_path).info() == info
        assert len(warned) == 1
        store.load(built)
    shutil.rmtree(built)
    assert Engine.load("mine", tmp_path).info() == info


def test_a_cache_that_cannot_be_written_is_done_without(
    written: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cache, "cache_folder", lambda room: Path("/proc/nowhere") / room)
    with pytest.warns(MotionMindWarning, match=r"cannot be written: .*; each command will learn mine again") as warned:
        assert Engine.load("mine", tmp_path).info()["postures"] == 80
    assert len(warned) == 1


def test_what_is_wrong_with_a_written_corpus_is_named(written: Path, tmp_path: Path) -> None:
    path = written / "manifest.json"
    manifest = json.loads(path.read_text("utf-8"))
    for change, words in (
        ({"discretization": None}, "discretization"),
        ({"discretization": {"kind": "sieve"}}, "manifest.json: discretization: the kind must be"),
        ({"discretization": {"kind": "codebook", "tolerance": -1}}, "manifest.json: discretization"),
        ({"clips": []}, "nor `scores` with a score"),
        ({"clips": [{"name": "a", "file": "gone.json", "about": ""}]}, "gone.json: cannot be read"),
        ({"rate": -5}, "a rate must be"),
    ):
        path.write_text(json.dumps(manifest | change), "utf-8")
        with pytest.raises(MotionMindError, match=words):
            Engine.load("mine", tmp_path)
    for key in manifest.keys() - {"format", "version"}:
        path.write_text(json.dumps({name: value for name, value in manifest.items() if name != key}), "utf-8")
        with pytest.raises(FormatError, match=f"manifest.json: there is no key `{key}`"):
            Engine.load("mine", tmp_path)


# --- the same everywhere ----------------------------------------------------------------------------------------------

SCRIPT = """
import sys
from motionmind.tween.engine import Engine
from motionmind.formats import read_posture, write_motion
engine = Engine.load(sys.argv[1])
tween = engine.tween(read_posture(sys.argv[2]), read_posture(sys.argv[3]))
write_motion(sys.argv[4] + ".bvh", tween.motion)
write_motion(sys.argv[4] + ".json", tween.motion)
heavy = {"pgmpy", "networkx", "pandas", "matplotlib", "torch", "sklearn"} & set(sys.modules)
assert not heavy, heavy
"""


@pytest.mark.long
def test_fresh_processes_write_the_same_bytes_and_import_nothing_heavy(six_segments: Engine, tmp_path: Path) -> None:
    from motionmind.formats import write_posture

    six_segments.save(tmp_path / "insects")
    write_posture(tmp_path / "a.json", CLIPS[0].posture(3))
    write_posture(tmp_path / "b.json", CLIPS[1].posture(30))
    for seed in ("1", "2"):
        subprocess.run(
            [sys.executable, "-c", SCRIPT, *(str(tmp_path / name) for name in ("insects", "a.json", "b.json", seed))],
            env=os.environ | {"PYTHONHASHSEED": seed},
            check=True,
        )
    for suffix in ("bvh", "json"):
        assert (tmp_path / f"1.{suffix}").read_bytes() == (tmp_path / f"2.{suffix}").read_bytes()


STUBBED = """
import sys
from motionmind import Engine, read_motion
sys.modules[sys.argv[3]] = None  # importing it raises ModuleNotFoundError
motion = read_motion(sys.argv[2])
print(Engine.load(sys.argv[1]).tween(motion.posture(0), motion.posture(3)).status)
try:
    Engine.fit([motion])
except ModuleNotFoundError as error:
    print("no", error.name.partition(".")[0])
"""


@pytest.mark.long
@pytest.mark.parametrize("library", ["pgmpy", "networkx"])
def test_a_corpus_is_learned_with_pgmpy_and_networkx_and_a_tween_found_without(
    six_segments: Engine, tmp_path: Path, library: str
) -> None:
    six_segments.save(tmp_path / "insects")
    write_motion(tmp_path / "clip.json", CLIPS[0])
    command = [sys.executable, "-c", STUBBED, str(tmp_path / "insects"), str(tmp_path / "clip.json"), library]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert done.stdout.split("\n") == ["optimal", f"no {library}", ""]


def test_the_network_and_the_joint_graphs_of_a_loaded_corpus_are_those_that_were_learned(
    six_segments: Engine, tmp_path: Path
) -> None:
    six_segments.save(tmp_path / "insects")
    loaded = Engine.load(str(tmp_path / "insects"))
    for joint in six_segments.corpus.chains:
        one, other = (engine.joint_graph(joint) for engine in (six_segments, loaded))
        assert (one.graph, one.nodes, one.adj) == (other.graph, other.nodes, other.adj)
    theirs = loaded.network()
    assert theirs.check_model()
    for cpd in six_segments.network().get_cpds():
        assert cpd == theirs.get_cpds(cpd.variable)
        np.testing.assert_array_equal(cpd.get_values(), theirs.get_cpds(cpd.variable).get_values())


# --- recorded movement ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def recorded(shared_data: Path) -> list[Motion]:
    """Files on their own joints."""
    return [read_motion(path) for path in sorted((shared_data / "cmu-05").glob("*.bvh"))]


@pytest.fixture(scope="module")
def ballet(recorded: list[Motion]) -> Engine:
    return Engine.fit([own_skeleton(motion) for motion in recorded], name="cmu-05", rate=5.0, skip=1)


@pytest.mark.long
def test_recorded_postures_are_joined_mostly_by_what_was_recorded(ballet: Engine) -> None:
    rng, corpus = np.random.default_rng(5), ballet.corpus
    tweens = []
    for i, k in rng.integers(0, len(corpus), (10, 2)):
        a, b = (Posture(corpus.skeleton, corpus.rotations[n], corpus.root[n]) for n in (i, k))
        tweens.append(ballet.tween(a, b))
        assert_sound(tweens[-1], a, b)
    assert np.mean([tween.attested for tween in tweens]) > 0.9
    assert np.mean([tween.status == "optimal" for tween in tweens]) >= 0.9


def test_postures_on_the_files_own_joints_are_taken_to_human23(ballet: Engine, recorded: list[Motion]) -> None:
    raw = recorded[0]
    assert raw.skeleton.difference(human23()) is not None
    tween = ballet.tween(raw.posture(100), raw.posture(160))
    assert tween.motion.skeleton.names == human23().names
    assert_sound(tween, own_skeleton(raw.posture(100)), own_skeleton(raw.posture(160)))


@pytest.mark.long
def test_any_file_is_learned_from_or_refused_by_name(shared_data: Path) -> None:
    learned, refused = [], []
    for path in sorted((shared_data / "importer").glob("*.bvh")):
        try:
            with warnings.catch_warnings(action="ignore"):
                motion = own_skeleton(read_motion(path))
            engine = Engine.fit([motion.slice(0, 60)], rate=5.0, discretization=Codebook(25.0))
            a, b = motion.posture(0), motion.posture(min(len(motion) - 1, 12))
            assert_sound(engine.tween(a, b), a, b)
            learned.append(path.name)
        except MotionMindError as error:
            refused.append(f"{path.name}: {error}")
    assert len(learned) >= 5, refused


def test_postures_of_the_bundled_corpus_are_joined() -> None:
    engine = Engine.load("ballet")
    folder = Path(__file__).parents[2] / "corpora" / "ballet" / "postures"
    a, b = read_posture(folder / "arabesque.json"), read_posture(folder / "fifth.json")
    assert_sound(engine.tween(a, b), a, b)


def test_ends_may_be_found_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    engine = Engine.load("ballet")
    monkeypatch.chdir(tmp_path)
    b = find_posture("ballet/fifth").posture
    write_posture("B.json", b)
    a = engine.posture("ballet/arabesque")
    named, given = engine.tween(a, engine.posture("B.json")), engine.tween(a, b)
    np.testing.assert_array_equal(named.path, given.path)
    with pytest.raises(MotionMindError, match="did you mean arabesque"):
        engine.posture("ballet/arabesk")


def test_a_bare_name_belongs_to_the_engines_corpus(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    engine = Engine.load("ballet")
    monkeypatch.chdir(tmp_path)
    for name in ("arabesque", "adagio@23", "adagio@-1", "adagio@2.0s", "adagio@23~"):
        own, full = engine.posture(name), find_posture(f"ballet/{name}").posture
        np.testing.assert_array_equal(own.rotations, full.rotations)
        np.testing.assert_array_equal(own.root, full.root)
    with pytest.raises(MotionMindError, match=r"^ballet: no posture or clip 'arabesk'; did you mean arabesque\?$"):
        engine.posture("arabesk")
    with pytest.raises(MotionMindError, match=r"^hands: holds 3 clips"):  # a corpus
        engine.posture("hands")
    with pytest.raises(MotionMindError, match=r"^arabesque\.json: cannot be read: there is no such file"):
        engine.posture("arabesque.json")
    write_posture("arabesque.json", find_posture("ballet/fifth").posture)
    Path("arabesque.json").rename("arabesque")
    with pytest.raises(MotionMindError, match="suffix"):  # a file
        engine.posture("arabesque")
    fitted = Engine.fit([engine.corpus.motion(engine.corpus.clips[0])], name="fitted")
    with pytest.raises(MotionMindError, match=r"^fifth: there is no such file or corpus; did you mean ballet/fifth\?$"):
        fitted.posture("fifth")


def test_a_name_in_place_of_a_posture_is_refused_with_what_finds_it() -> None:
    engine = Engine.load("ballet")
    b = engine.posture("ballet/fifth")
    with pytest.raises(WrongTypeError, match=r"a must be a Posture \(find_posture finds one by name\), not 'ballet/x'"):
        engine.tween("ballet/x", b)  # type: ignore[arg-type]
    with pytest.raises(WrongTypeError, match="b must be a Posture"):
        [*engine.alternatives(b, "ballet/x", 1)]  # type: ignore[arg-type]
