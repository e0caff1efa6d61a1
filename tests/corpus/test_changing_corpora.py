"""Adding clips to a corpus and removing them is the same as building it afresh, in the same states."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from hypothesis import given, settings
from hypothesis import strategies as st
from same import assert_learned_alike

from motionmind.body.motion import Motion
from motionmind.corpus import store
from motionmind.corpus.changing import add_recordings, remove_clips
from motionmind.corpus.clip import Clip
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.gather import gather
from motionmind.corpus.kept import Kept
from motionmind.corpus.recordings import Flips
from motionmind.discretize.codebook import Codebook
from motionmind.errors import CorpusError
from motionmind.executors.workshop import Workshop
from motionmind.formats import write_motion
from motionmind.geometry import rotations as rot
from motionmind.learned import pace, persistence, posture_statistics
from motionmind.learned.learning import Learned, learn, learn_changed, learn_in, outside
from motionmind.tween.engine import Engine

STATES = Codebook(20.0)
WAYS = "mirrored, backwards", "mixed", "on stage"


@pytest.fixture(scope="module")
def dances() -> list[Motion]:
    """Four short recordings, at 30 frames a second, two of them with a flip that is mended or cut at."""
    out = []
    for number, name in enumerate(("tendus", "degages", "fondus", "jump")):
        motion = replace(ballet_clip(name).resample(30.0).slice(0, 90), name=name, keyframed=False)
        rotations = motion.rotations.copy()
        if number % 2:
            rotations[40:, 4] = rot.mul(rotations[40:, 4], rot.from_axis_angle(np.array([0.0, 1.0, 0.0]), 2.5))
        out.append(replace(motion, rotations=rotations))
    return out


def gathered(motions: Sequence[Motion], way: str) -> Corpus:
    """A corpus that was built in one of some ways."""
    if way == "mirrored, backwards":
        return gather("dances", motions, mirror=True, reverse=2.0)
    if way == "mixed":
        other = gather("other", [replace(ballet_clip("jump").resample(30.0), name="jump", keyframed=False)])
        return gather("dances", motions, mirror=True, mix=[(other, 0.5)])
    return gather("dances", motions, facing="stage", skip=2, flips="keep")


@pytest.mark.parametrize("way", WAYS)
def test_what_is_added_or_removed_is_as_if_it_were_built_so(dances: list[Motion], way: str) -> None:
    flips: Flips = "keep" if way == "on stage" else "repair"
    before = learn(gathered(dances[:2], way), STATES)
    added = add_recordings(before.corpus, dances[2:], flips=flips)
    assert_learned_alike(learn_in(added, before.space), learn_in(gathered(dances, way), before.space))
    left = remove_clips(added, ["tendus", "fondus"])
    assert_learned_alike(learn_in(left, before.space), learn_in(gathered(dances[1::2], way), before.space))
    # And there and back again is where one was.
    assert_learned_alike(learn_in(remove_clips(added, ["fondus", "jump"]), before.space), before)


def changed(before: Learned, corpus: Corpus) -> Learned:
    """What is learned from a changed corpus, given what was learned before."""
    return learn_changed(before, Kept.find(corpus, before.corpus))


@pytest.fixture(scope="module")
def built(dances: list[Motion]) -> Callable[[str], Learned]:
    """What is learned from the first two dances, by the way."""
    return {way: learn(gathered(dances[:2], way), STATES) for way in WAYS}.__getitem__


@pytest.mark.long
@settings(max_examples=12, deadline=None)
@given(way=st.sampled_from(WAYS), turns=st.lists(st.integers(0, 3), min_size=1, max_size=4), trees=st.booleans())
def test_in_any_order_it_is_as_if_it_were_built_so(
    dances: list[Motion], built: Callable[[str], Learned], way: str, turns: list[int], trees: bool
) -> None:
    """Each turn removes a dance that is there, or adds it at the end; what was known is taken as it was."""
    there = [0, 1]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(posture_statistics, "MAX_FULL_SEARCH", 20 if trees else posture_statistics.MAX_FULL_SEARCH)
        learned = learn_in(built(way).corpus, built(way).space)
        for dance in turns:
            if dance not in there:
                there.append(dance)
                flips: Flips = "keep" if way == "on stage" else "repair"
                corpus = add_recordings(learned.corpus, [dances[dance]], flips=flips)
            elif len(there) > 1:
                there.remove(dance)
                corpus = remove_clips(learned.corpus, [dances[dance].name])
            else:
                continue
            afresh = learn_in(gathered([dances[number] for number in there], way), learned.space)
            learned = changed(learned, corpus)
            assert (learned.statistics.trees is not None) == trees
            assert_learned_alike(learned, afresh)


def test_files_are_those_of_a_corpus_that_is_built_afresh(
    dances: list[Motion], built: Callable[[str], Learned], tmp_path: Path
) -> None:
    persistence.save(built("mixed"), tmp_path / "dances")
    before = persistence.load(str(tmp_path / "dances"))
    persistence.save(changed(before, add_recordings(before.corpus, dances[2:3])), tmp_path / "dances")
    persistence.save(learn_in(gathered(dances[:3], "mixed"), before.space), tmp_path / "afresh")
    one, other = (store.load(tmp_path / name) for name in ("dances", "afresh"))
    assert store.replaced(one.manifest) is not None
    free = {"folder": 0, "previous": None}
    assert one.manifest | free == other.manifest | free  # with the arrays' checksums
    assert_learned_alike(
        persistence.load(str(tmp_path / "dances")), learn_in(gathered(dances[:3], "mixed"), before.space)
    )


def test_what_is_kept_is_not_measured_again(
    dances: list[Motion], built: Callable[[str], Learned], monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []
    measured: list[str] = []
    show, measure = pace._show, posture_statistics._measure_samples

    def showing(corpus: Corpus, clip: Clip) -> object:
        shown.append(clip.name)
        return show(corpus, clip)

    def measuring(corpus: Corpus, workshop: Workshop) -> object:
        measured.extend(clip.name for clip in corpus.clips)
        return measure(corpus, workshop)

    monkeypatch.setattr(pace, "_show", showing)
    monkeypatch.setattr(posture_statistics, "_measure_samples", measuring)
    before = built("on stage")
    added = changed(before, add_recordings(before.corpus, dances[2:3], flips="keep"))
    assert shown == measured == ["fondus"]
    assert_learned_alike(changed(added, remove_clips(added.corpus, ["fondus"])), before)
    assert shown == measured == ["fondus"]


def test_a_clip_is_kept_if_it_is_the_same_to_the_last_bit(built: Callable[[str], Learned]) -> None:
    corpus = built("on stage").corpus
    first, second = corpus.clips
    for name in ("rotations", "root", "times", "detail"):
        array = getattr(corpus, name).copy()
        last = array[second.stop - 2 : second.stop - 1].reshape(-1)
        last[-1:] = np.nextafter(last[-1:], last.dtype.type(9.0))
        kept = Kept.find(replace(corpus, **{name: array}), corpus)
        assert (kept.numbers.tolist(), kept.places.tolist()) == ([0, -1], [0, 0]), name
        assert kept.new is not None
        assert [clip.name for clip in kept.new.clips] == [second.name]
    lighter = replace(corpus, clips=(replace(first, weight=0.5), second))
    assert Kept.find(lighter, corpus).new is None
    taller = replace(corpus.skeleton, offsets=1.1 * corpus.skeleton.offsets)
    for other in (replace(corpus, skeleton=taller), replace(corpus, facing="free")):
        assert Kept.find(other, corpus).numbers.tolist() == [-1, -1]
    turned = replace(corpus, clips=(first, replace(second, reverse=1.0)))
    assert Kept.find(turned, corpus).numbers.tolist() == [0, -1]


def test_how_much_is_outside_of_all_states_is_told(dances: list[Motion]) -> None:
    before = learn(gather("dances", dances[:1]), STATES)
    assert outside(before.corpus, before.space)[0] == 0.0
    turned = dances[0].rotations.copy()
    turned[:, 9] = rot.mul(turned[:, 9], rot.from_axis_angle(np.array([1.0, 0.0, 0.0]), 3.0))
    other = replace(dances[0], rotations=turned, name="other")
    share, joint, degrees = outside(add_recordings(before.corpus, [other]), before.space)
    assert share == pytest.approx(0.5 / len(before.corpus.skeleton), rel=0.05)
    assert joint == dances[0].skeleton.names[9]
    assert degrees > 60.0


def test_what_cannot_be_added_or_removed_is_refused(dances: list[Motion]) -> None:
    corpus = gather("dances", dances[:2])
    with pytest.raises(CorpusError, match=r"has a clip 'tendus' already: `corpus remove` it first"):
        add_recordings(corpus, dances[:1])
    with pytest.raises(CorpusError, match=r"has no clip 'tendu' of its own; did you mean tendus"):
        remove_clips(corpus, ["tendu"])
    with pytest.raises(CorpusError, match="without these clips there is no move left"):
        remove_clips(corpus, ["tendus", "degages"])
    with pytest.raises(CorpusError, match="is of keyframes"):
        add_recordings(gather("keys", [ballet_clip("jump")]), dances[:1])


def test_what_is_added_is_repaired_as_the_rest_was(run: Run, dances: list[Motion], tmp_path: Path) -> None:
    for dance in dances[:2]:
        write_motion(tmp_path / f"{dance.name}.bvh", dance)
    home, files = ("--home", str(tmp_path / "home")), [str(tmp_path / f"{dance.name}.bvh") for dance in dances[:2]]
    assert run("corpus", "build", "mine", files[0], "--flip-angle", 170, *home).code == 0
    assert run("corpus", "add", "mine", files[1], *home).code == 0
    corpus = Engine.load("mine", tmp_path / "home").corpus
    assert (corpus.flip_degrees, corpus.faults) == (170.0, ())
    assert gather("dances", dances[1:2]).faults  # at the usual angle there are some
    assert add_recordings(gather("dances", dances[:1], flip_degrees=170.0), dances[1:2]).faults == ()


def test_a_corpus_is_added_to_and_taken_from_in_place(run: Run, dances: list[Motion], tmp_path: Path) -> None:
    for dance in dances:
        write_motion(tmp_path / f"{dance.name}.bvh", dance)
    home = ("--home", str(tmp_path / "home"))
    names = [str(tmp_path / f"{dance.name}.bvh") for dance in dances]
    assert run("corpus", "build", "mine", *names[:2], *home).code == 0
    ran = run("corpus", "add", "mine", *names[2:], *home)
    assert ran.code == 0, ran.err
    assert "added 2 files to" in ran.out
    assert "are in no state" in ran.err
    assert {clip.name for clip in Engine.load("mine", tmp_path / "home").corpus.clips} >= {"tendus", "fondus"}
    ran = run("corpus", "remove", "mine", "fondus", "jump", *home)
    assert ran.code == 0, ran.err
    manifest = tmp_path / "home/corpora/mine/manifest.json"
    before = manifest.read_bytes()
    for wrong in (("remove", "mine", "nobody"), ("add", "mine", names[0]), ("add", "ballet", names[0])):
        ran = run("corpus", *wrong, *home)
        assert (ran.code, ran.err.count("error:")) == (2, 1), ran.err
    assert manifest.read_bytes() == before
