"""Who attests what: corpus, clip and posture of each transition, of corpora that are mirrored, reversed and mixed."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from ingredients import assert_reported
from saved_corpora import entries, put_entries
from walks import dance

from motionmind.body.human import human23
from motionmind.body.mirror import find_sides, mirrored
from motionmind.corpus.gather import gather
from motionmind.discretize.codebook import Codebook
from motionmind.errors import FormatError
from motionmind.tween.certificate import Source
from motionmind.tween.engine import Engine
from motionmind.tween.result import Tween


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> Engine:
    """People of two corpora, one of them mirrored already, all mirrored and reversed."""
    folder = tmp_path_factory.mktemp("home")
    other = Engine.fit([dance("solo", 3), dance("duet", 4)], name="other", mirror=True, discretization=Codebook(20.0))
    other.save(folder / "corpora" / "other")
    return Engine.fit(
        [dance("solo", 1), dance("trio", 2)],
        name="mine",
        mirror=True,
        reverse=1.0,
        mix={"other": 0.3},
        home=folder,
        discretization=Codebook(20.0),
    )


def assert_attested(engine: Engine, source: Source, chain: int, before: int, after: int) -> None:
    """That the source's postures are in the states of the transition."""
    (clip,) = (
        clip
        for clip in engine.corpus.clips
        if (clip.name, clip.corpus or engine.corpus.name, clip.mirrored)
        == (source.clip, source.corpus, source.mirrored)
    )
    to = source.posture + (-1 if source.reversed else 1)
    assert min(source.posture, to) >= 0
    assert max(source.posture, to) < len(clip)
    seen = engine.states[[clip.start + source.posture, clip.start + to], chain].astype(int)
    if engine.corpus.chains[chain] == "facing":  # pooled: by how many steps it turns
        assert (seen[1] - seen[0] - (after - before)) % engine.space.sizes[chain] == 0
    else:
        assert seen.tolist() == [before, after]
    if source.reversed:
        assert clip.reverse is not None


def test_every_transition_is_attested_where_it_is_said_to_be(everything: Engine) -> None:
    graph, corpus = everything.grammar.transitions, everything.corpus
    kinds = set()
    for chain in range(len(corpus.chains)):
        for row in range(graph.starts[chain], graph.starts[chain + 1]):
            for edge in range(graph.indptr[row], graph.indptr[row + 1]):
                posture, to = int(graph.attests[edge]), int(graph.arrives[edge])
                clip = corpus.clip_of(posture)
                source = Source(
                    clip.name, posture - clip.start, clip.corpus or corpus.name, clip.mirrored, to < posture
                )
                kinds.add((source.corpus, source.mirrored, source.reversed))
                assert_attested(everything, source, chain, row - int(graph.starts[chain]), int(graph.targets[edge]))
    assert kinds == {(name, m, r) for name in ("mine", "other") for m in (False, True) for r in (False, True)}


def test_nothing_is_said_to_be_reversed_that_is_attested_as_it_was_made(everything: Engine) -> None:
    graph, states = everything.grammar.transitions, everything.states.astype(int)
    forward = everything.corpus.moves.begins[everything.corpus.moves.ends > everything.corpus.moves.begins]
    for chain in range(len(human23())):
        made = {(states[n, chain], states[n + 1, chain]) for n in forward}
        for edge in range(graph.indptr[graph.starts[chain]], graph.indptr[graph.starts[chain + 1]]):
            move = int(graph.sources[edge] - graph.starts[chain]), int(graph.targets[edge])
            assert (graph.arrives[edge] > graph.attests[edge]) == (move in made)


def tweens(engine: Engine) -> list[Tween]:
    ends = [(dance("a", 1), 12, dance("b", 2), 1), (dance("a", 3), 9, dance("b", 1), 2)]
    ends.append((mirrored(dance("a", 1)), 10, dance("b", 4), 3))
    return [engine.tween(a.posture(i), b.posture(k)) for a, i, b, k in ends]


@pytest.mark.long
def test_a_tween_tells_corpus_clip_and_posture_and_what_is_mirrored_and_reversed(everything: Engine) -> None:
    kinds = set()
    for tween in tweens(everything):
        report = json.loads(json.dumps(tween.report()))
        for move, (before, after) in enumerate(pairwise(tween.path.tolist())):
            for chain, source in enumerate(tween.sources[move]):
                edge = everything.grammar.transitions.edge(chain, before[chain], after[chain])
                followed = tween.followed[move, chain] and tween.followed[move + 1, chain]
                assert (source is None) == (edge < 0 or not followed)
                said = report["sources"][move][chain]
                if source is None:
                    assert said is None
                    continue
                assert set(said) == {*("clip", "posture", "corpus", "mirrored", "reversed", "seconds", "reconstructed")}
                assert Source(**said) == source
                assert_attested(everything, source, chain, before[chain], after[chain])
                kinds.add((source.corpus, source.mirrored, source.reversed))
    assert {corpus for corpus, _, _ in kinds} == {"mine", "other"}
    assert any(is_mirrored for _, is_mirrored, _ in kinds)
    assert any(is_reversed for _, _, is_reversed in kinds)


@pytest.mark.long
def test_the_written_problem_of_mixed_corpora_is_made_of_what_is_reported(everything: Engine) -> None:
    for tween in tweens(everything):
        assert_reported(tween)


def test_what_a_corpus_was_made_of_is_said(everything: Engine) -> None:
    origins = json.loads(json.dumps(everything.info(), allow_nan=False))["origins"]
    assert [(row["corpus"], row["mirrored"], row["reversed"]) for row in origins] == [
        *(("mine", False, False), ("other", False, False), ("other", True, False), ("mine", True, False)),
        *(("mine", False, True), ("other", False, True), ("other", True, True), ("mine", True, True)),
    ]
    back = math.exp(-1.0)
    assert [row["weight"] for row in origins] == pytest.approx([1.0, 0.3, 0.3, 1.0, back, 0.3 * back, 0.3 * back, back])
    assert {(row["clips"], row["postures"], row["moves"]) for row in origins} == {(2, 28, 26)}
    assert sum(row["share"] for row in origins) == pytest.approx(1.0)
    assert origins[1]["share"] == pytest.approx(0.3 / (2.6 * (1.0 + back)))
    assert everything.info()["moves"] == sum(row["moves"] for row in origins)
    assert everything.check(20)["origins"] == origins
    assert [entry["name"] for entry in everything.info()["clips"]][:4] == ["solo", "trio", "other: solo", "other: duet"]


@pytest.mark.long
def test_what_is_loaded_answers_as_what_was_saved(everything: Engine, tmp_path: Path) -> None:
    everything.save(tmp_path / "corpora" / "mine")
    loaded = Engine.load("mine", tmp_path)
    assert loaded.info() == everything.info()
    assert loaded.corpus.clips == everything.corpus.clips
    for name in ("begins", "ends", "seconds", "weights"):
        np.testing.assert_array_equal(getattr(loaded.corpus.moves, name), getattr(everything.corpus.moves, name))
    np.testing.assert_array_equal(loaded.corpus.weights, everything.corpus.weights)
    for one, other in zip(tweens(loaded), tweens(everything), strict=True):
        assert one.sources == other.sources
        assert one.problem() == other.problem()
        np.testing.assert_array_equal(one.motion.rotations, other.motion.rotations)
    cpds = (engine.network().get_cpds("left_knee").get_values() for engine in (loaded, everything))
    np.testing.assert_array_equal(*cpds)


def test_a_manifest_that_lacks_an_array_or_has_no_such_weight_is_refused(everything: Engine, tmp_path: Path) -> None:
    everything.save(tmp_path / "old")
    manifest = json.loads((tmp_path / "old" / "manifest.json").read_text("utf-8"))
    del manifest["arrays"]["states"]
    (tmp_path / "old" / "manifest.json").write_text(json.dumps(manifest), "utf-8")
    with pytest.raises(FormatError, match=r"lists no array states; rebuild it: motionmind"):
        Engine.load(str(tmp_path / "old"))
    everything.save(tmp_path / "bent")
    clips = entries(tmp_path / "bent")
    for key, value in (("weight", 0.0), ("weight", -2.0), ("reverse", -1.0), ("reverse", 1e9)):
        put_entries(tmp_path / "bent", [clips[0], clips[1] | {key: value}, *clips[2:]])
        with pytest.raises(FormatError, match="trio weighs"):
            Engine.load(str(tmp_path / "bent"))


def test_a_mirrored_corpus_is_the_same_on_both_sides() -> None:
    """As many states, moves and turns on one side as on the other, each with its image's weight."""
    engine = Engine.fit([dance("solo", 1), dance("duet", 2)], mirror=True, discretization=Codebook(20.0))
    graph, names = engine.grammar.transitions, human23().names
    partners = find_sides(human23()).partners
    for chain, name in enumerate(names):
        if not name.startswith("left_"):
            continue
        assert engine.space.sizes[chain] == engine.space.sizes[partners[chain]]
        one, other = (
            sorted(graph.counts[graph.indptr[graph.starts[side]] : graph.indptr[graph.starts[side + 1]]])
            for side in (chain, partners[chain])
        )
        assert one == other
    turns: dict[int, float] = defaultdict(float)
    facing, size = len(names), int(engine.space.sizes[-1])
    first = int(graph.starts[facing])
    for edge in range(graph.indptr[first], graph.indptr[first + 1]):
        turns[int(graph.targets[edge])] += float(graph.counts[edge])
    assert all(turns[turn] == turns[-turn % size] for turn in list(turns))


def test_gathered_clips_are_mirrored_and_priced() -> None:
    corpus = gather("people", [dance("solo", 1)], mirror=True, reverse=2.0)
    assert [(clip.label, clip.weight, clip.reverse) for clip in corpus.clips] == [
        ("solo", 1.0, 2.0),
        ("solo (mirrored)", 1.0, 2.0),
    ]
    moves = corpus.moves
    assert len(moves.begins) == 4 * 13
    np.testing.assert_array_equal(np.abs(moves.ends - moves.begins), 1)
    assert np.array_equal(moves.weights, np.repeat([1.0, math.exp(-2.0)], 26))
    np.testing.assert_allclose(moves.seconds, 0.2)
