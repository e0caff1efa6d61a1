"""Clips of a corpus on disk: which there are, which are read, and the moves between their postures."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bodies import insect

from motionmind.body.motion import Motion
from motionmind.corpus.clip import Clip
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.entries import Columns, Entries, Packed, StoredClips
from motionmind.corpus.gather import gather
from motionmind.discretize.codebook import Codebook
from motionmind.geometry import rotations as rot
from motionmind.learned.model import LearnedCorpus
from motionmind.names.postures import find_posture
from motionmind.tween.engine import Engine


def wander(name: str, frames: int, seed: int) -> Motion:
    """An insect's movement through a few postures, again and again."""
    body, rng = insect(), np.random.default_rng(seed)
    few = rot.exp(rng.normal(0.0, 0.4, (4, len(body), 3)))
    return Motion(body, few[np.arange(frames) % 4], np.zeros((frames, 3)), 0.2 * np.arange(frames), name)


@pytest.fixture(scope="module")
def gathered() -> Corpus:
    """Clips of three corpora of which two have names in common, some backwards, one of a single posture."""
    one = gather("one", [wander("a", 5, 1), wander("b: c", 1, 2)], rate=None, reverse=2.0, performer="Zoë")
    two = gather("two", [wander("a", 4, 3), wander("b", 6, 4)], rate=None)
    motions = [wander("b", 7, 5), wander("b", 3, 6), wander("Übung", 8, 7)]
    return gather("mine", motions, rate=None, mix=[(one, 0.5), (two, 2.0)], about={"b": "the first"})


@pytest.fixture(scope="module")
def saved(gathered: Corpus, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the user's corpora, with these clips, which were checked once."""
    home = tmp_path_factory.mktemp("home")
    LearnedCorpus.learn(gathered, Codebook(15.0)).save(home / "corpora" / "mine")
    time.sleep(2.1)  # files as new as this are checked each time
    LearnedCorpus.load("mine", home)
    return home


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The numbers of the entries that are read."""
    numbers: list[int] = []
    original = Entries._read

    def noted(self: Entries[object], number: int) -> object:
        numbers.append(number)
        return original(self, number)

    monkeypatch.setattr(Entries, "_read", noted)
    return numbers


def test_a_corpus_that_was_checked_is_loaded_without_a_look_at_its_clips(saved: Path, read: list[int]) -> None:
    engine = Engine.load("mine", saved)
    assert (len(engine.corpus), len(engine.corpus.clips)) == (34, 7)
    assert len(engine.corpus.moves.begins) == engine.info()["moves"]
    read.clear()
    engine = Engine.load("mine", saved)
    assert engine.corpus.weights.max() == engine.corpus.moves.weights.max() == 1.0
    assert repr(engine)
    assert read == []


def test_clips_on_disk_are_those_that_were_gathered(gathered: Corpus, saved: Path) -> None:
    clips = LearnedCorpus.load("mine", saved).corpus.clips
    assert clips == gathered.clips
    assert gathered.clips == clips
    assert clips != gathered.clips[1:]
    assert list(clips) == list(gathered.clips)
    assert clips[-2:] == gathered.clips[-2:]
    assert (clips[0], clips[-1], len(clips)) == (gathered.clips[0], gathered.clips[-1], 7)
    assert gathered.clips[4] in clips
    with pytest.raises(IndexError):
        clips[7]


def test_a_clip_is_found_by_its_name_its_label_and_its_postures(gathered: Corpus, saved: Path) -> None:
    for corpus in (gathered, LearnedCorpus.load("mine", saved).corpus):
        for clip in gathered.clips:
            assert corpus.clips_named(clip.corpus or "mine", clip.name) == [clip]
            assert corpus.clip_labelled(clip.label) == clip
            assert {corpus.clip_of(number).label for number in range(clip.start, clip.stop)} == {clip.label}
        assert corpus.clips_named("two", "Übung") == corpus.clips_named("zwei", "a") == []
        for label in ("c", "one: d", "one: a (mirrored)", "zzz", ""):
            with pytest.raises(KeyError):
                corpus.clip_labelled(label)
        with pytest.raises(IndexError):
            corpus.clip_of(34)
    posture = find_posture("mine/one: b: c@0", saved).posture
    np.testing.assert_array_equal(posture.rotations, gathered.rotations[gathered.clip_labelled("one: b: c").start])


def test_to_find_a_clip_takes_a_look_at_few(gathered: Corpus, read: list[int]) -> None:
    clips = tuple(Clip(f"clip {n}", 2 * n, 2 * n + 2) for n in range(1000))
    arrays = {name: getattr(gathered, name) for name in ("rotations", "root", "times", "detail")}
    stored = StoredClips(Packed.of(clips), Columns.of(clips))
    arrays = {name: np.resize(array, (2000, *array.shape[1:])) for name, array in arrays.items()}
    corpus = replace(gathered, clips=stored, **arrays)
    assert corpus.clip_labelled("clip 777") == clips[777]
    assert corpus.clip_of(1999) == clips[999]
    assert corpus.credit_of(corpus.clips_named("mine", "clip 3")[0]).clip == "clip 3"
    assert len(read) < 50


def test_a_mirror_image_has_a_label_of_its_own() -> None:
    corpus = Engine.load("ballet").corpus
    both = gather("both", [corpus.motion(clip) for clip in corpus.clips[:2]], mirror=True)
    for clip in both.clips:
        assert both.clip_labelled(clip.label) == clip
    assert [clip.mirrored for clip in both.clips_named("both", both.clips[0].name)] == [False, True]


def test_moves_lead_on_in_each_clip_and_back_in_those_learned_backwards(gathered: Corpus, saved: Path) -> None:
    forward = [(at, at + 1, clip.weight) for clip in gathered.clips for at in range(clip.start, clip.stop - 1)]
    backward = [
        (at + 1, at, clip.reverse_weight)
        for clip in gathered.clips
        if clip.reverse is not None
        for at in range(clip.start, clip.stop - 1)
    ]
    assert len(backward) == 4
    begins, ends, weights = map(np.array, zip(*forward, *backward, strict=True))
    for corpus in (gathered, LearnedCorpus.load("mine", saved).corpus):
        moves = corpus.moves
        some = np.array([len(begins) - 1, 0, 5, 5, 26])
        taken = moves.take(some)
        for these, chosen in ((moves, slice(None)), (taken, some), (taken.take(np.array([1])), some[1:2])):
            assert len(these) == len(begins[chosen])
            np.testing.assert_array_equal(these.begins, begins[chosen])
            np.testing.assert_array_equal(these.ends, ends[chosen])
            np.testing.assert_array_equal(these.weights, weights[chosen])
            np.testing.assert_allclose(these.seconds, 0.2)


def test_entries_are_lines_of_json() -> None:
    text, lines = Packed.of([{"a": "é\n"}, {"a": ""}])
    assert text.tobytes().decode().splitlines() == ['{"a":"é\\n"}', '{"a":""}']
    assert lines.tolist() == [0, 13, 22]
