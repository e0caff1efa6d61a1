"""Names of postures and movement: ballet/arabesque, ballet/adagio@23, clip.bvh@2.0s, centre.score/tendu, FILE."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import BALLET, ballet_clip

from motionmind.body.motion import Posture
from motionmind.corpus import store
from motionmind.errors import MotionMindError
from motionmind.formats import read_motion, read_posture, write_motion, write_posture
from motionmind.learned import persistence
from motionmind.learned.model import LearnedCorpus
from motionmind.names import finding
from motionmind.names.finding import find_motion, locate_score, open_collection
from motionmind.names.postures import find_posture
from motionmind.names.spelling import Moment, parse_posture, parse_source
from motionmind.notation.compose import posture
from motionmind.notation.read import read_score, read_scores
from motionmind.notation.score import Score

CENTRE = BALLET / "centre.score"
BUNDLED = ("ballet", "hands", "karate", "macarena", "medley", "walk-hexapod")


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MOTIONMIND_HOME", str(tmp_path / "home"))


def assert_same(one: Posture, other: Posture, within: float = 0.0) -> None:
    assert one.skeleton.difference(other.skeleton) is None
    np.testing.assert_allclose(one.rotations, other.rotations, atol=within, rtol=0.0)
    np.testing.assert_allclose(one.root, other.root, atol=within, rtol=0.0)


# --- how they are spelled ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("word", "kind", "place", "name", "moment", "is_moving"),
    [
        ("A.json", "file", "A.json", "", None, False),
        ("clip.bvh@240", "file", "clip.bvh", "", Moment(240), False),
        ("clip.bvh@-1", "file", "clip.bvh", "", Moment(-1), False),
        ("clip.bvh@0~", "file", "clip.bvh", "", Moment(0), True),
        ("clip.bvh@2.0s", "file", "clip.bvh", "", Moment(seconds=2.0), False),
        ("clip.bvh@2s~", "file", "clip.bvh", "", Moment(seconds=2.0), True),
        ("clip.bvh@2.s", "file", "clip.bvh@2.s", "", None, False),
        ("b@home/clip.bvh@7", "file", "b@home/clip.bvh", "", Moment(7), False),
        ("b@home/A.json", "file", "b@home/A.json", "", None, False),
        ("clip.bvh@3@4", "file", "clip.bvh@3", "", Moment(4), False),
        ("A.json~", "file", "A.json", "", None, True),
        ("@3", "file", "@3", "", None, False),
        ("ballet", "corpus", "ballet", "", None, False),
        ("ballet/arabesque", "corpus", "ballet", "arabesque", None, False),
        ("ballet/adagio@23~", "corpus", "ballet", "adagio", Moment(23), True),
        ("ballet/a/b@1", "corpus", "ballet", "a/b", Moment(1), False),
        (f"{BALLET}/arabesque", "corpus", str(BALLET), "arabesque", None, False),
        ("a/centre.score/tendu", "score", "a/centre.score", "tendu", None, False),
        ("centre.score@3", "score", "centre.score", "", Moment(3), False),
        ("opera/arabesque", "file", "opera/arabesque", "", None, False),
    ],
)
def test_a_word_is_a_place_a_name_and_a_moment(
    word: str, kind: str, place: str, name: str, moment: Moment | None, is_moving: bool
) -> None:
    found = parse_posture(word)
    assert (found.source.kind, found.source.place, found.source.name) == (kind, place, name)
    assert (found.word, found.moment, found.is_moving) == (word, moment, is_moving)


def test_a_file_goes_first_then_a_corpus_by_name_then_by_folder() -> None:
    for name in ("ballet/arabesque", "jump.bvh@3", "A.json~", "x.score/tendu"):
        assert parse_posture(name).source.place != name
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).touch()
        assert parse_posture(name).source.place == name
        assert parse_posture(name).source.kind == "file"
    shutil.copytree(BALLET, "ballet", dirs_exist_ok=True)
    assert parse_source("ballet/fifth").place == "ballet"
    assert parse_source("./ballet/fifth").place == "./ballet"
    assert_same(find_posture("./ballet/fifth").posture, find_posture("ballet/fifth").posture)


# --- what they name ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("corpus", BUNDLED)
def test_every_posture_that_a_corpus_names_is_that_of_its_scores(corpus: str) -> None:
    found = open_collection(parse_source(corpus))
    written = {
        name: score
        for path in sorted((store.locate(corpus)).glob("*.score"))
        for score in [read_score(path)]
        for name in score.postures
    }
    assert set(found.postures) == set(written)
    for name, score in written.items():
        assert_same(find_posture(f"{corpus}/{name}").posture, posture(score, name))


@pytest.mark.parametrize(
    ("corpus", "name", "file", "old", "new"),
    [
        ("ballet", "arms-fifth", "vocabulary.score", "posture arms-fifth   = first", "posture arms-fifth   = second"),
        ("walk-hexapod", "stand", "hexapod.toml", "offset = [0.0, 0.0, -0.14]", "offset = [0.0, 0.0, -0.15]"),
    ],
)
def test_a_posture_is_as_its_files_have_it_now(
    corpus: str, name: str, file: str, old: str, new: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files that scores include, and their bodies' too; they are read again only after a change."""
    shutil.copytree(store.locate(corpus), "mine")
    read: list[object] = []

    def counted(places: Iterable[Path]) -> tuple[list[Score], list[Path]]:
        read.append(places)
        return read_scores(places)

    monkeypatch.setattr(finding, "read_scores", counted)
    word = f"{Path('mine').resolve()}/{name}"
    before, again = find_posture(word).posture, find_posture(word).posture
    assert len(read) == 1
    assert_same(before, again)
    path = Path("mine", file)
    text = path.read_text("utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), "utf-8")
    after = find_posture(word).posture
    assert len(read) == 2
    shape = [np.concatenate([one.rotations.ravel(), one.skeleton.offsets.ravel()]) for one in (before, after)]
    assert not np.array_equal(*shape)


@pytest.mark.parametrize("corpus", BUNDLED)
def test_the_clips_of_a_corpus_are_those_that_are_learned_from_in_order(corpus: str) -> None:
    learned = [(clip.label, clip.about) for clip in LearnedCorpus.load(corpus).corpus.clips]
    assert list(open_collection(parse_source(corpus)).clips.items()) == learned


def test_a_name_that_nobody_wrote_is_an_error_before_the_corpus_is_learned(monkeypatch: pytest.MonkeyPatch) -> None:
    def learn(*_: object) -> LearnedCorpus:
        raise AssertionError("learned")

    monkeypatch.setattr(persistence, "load", learn)
    for word in ("ballet/adagoi", "ballet/adagoi@3"):
        with pytest.raises(MotionMindError, match=r"ballet: no posture or clip 'adagoi'; did you mean adagio\?"):
            find_posture(word)
    with pytest.raises(MotionMindError, match=r"ballet: no clip 'arabesk'; did you mean arabesques\?"):
        open_collection(parse_source("ballet")).choose(["arabesk"])


@pytest.mark.long
def test_a_clip_whose_score_changes_while_a_corpus_is_open_is_an_error() -> None:
    shutil.copytree(store.locate("karate"), "mine")
    source = parse_source(str(Path("mine").resolve()))
    found, score = open_collection(source), Path("mine", "kata.score")
    assert "heian-nidan" in found.clips
    score.write_text(score.read_text("utf-8").replace("clip heian-nidan:", "clip heian-anew:"), "utf-8")
    with pytest.raises(MotionMindError, match="no clip 'heian-nidan' any more, for its files have changed"):
        found.find("heian-nidan", as_clip=True)
    assert len(open_collection(source).find("heian-anew", as_clip=True)) > 1


@pytest.mark.parametrize("corpus", ["ballet", "walk-hexapod"])
def test_every_posture_of_a_clip_is_the_one_that_is_learned_from(corpus: str) -> None:
    learned = LearnedCorpus.load(corpus).corpus
    clips = {clip.label: clip for clip in learned.clips}
    for label in list(clips)[::9]:
        motion = learned.motion(clips[label])
        for frame in (0, len(motion) // 2, -1):
            assert_same(find_posture(f"{corpus}/{label}@{frame}").posture, motion.posture(frame))
        assert_same(find_posture(f"{corpus}/{label}@{motion.times[3]:.6f}s").posture, motion.posture(3))
        assert len(find_motion(parse_source(f"{corpus}/{label}"))) == len(motion)


def test_a_posture_of_a_score_is_its_own_or_one_that_it_includes() -> None:
    assert_same(find_posture(f"{CENTRE}/tendu").posture, find_posture("ballet/tendu").posture)
    assert_same(find_posture(f"{CENTRE}/adagio@23").posture, ballet_clip("adagio").posture(23))
    Path("mine.score").write_text(
        f"title Mine\ninclude {CENTRE}\nposture tendu = first | bas | upright | front\n"
        "clip first: Of one posture\n  start | second | bas | upright | front\n",
        "utf-8",
    )
    assert_same(
        find_posture("mine.score/tendu").posture, find_posture("ballet/first").posture
    )  # what it says goes first
    assert_same(find_posture("mine.score/fifth").posture, find_posture("ballet/fifth").posture)
    assert_same(find_posture("mine.score/first").posture, find_posture("ballet/first").posture)  # of two, the posture
    assert_same(find_posture("mine.score/first@0").posture, find_motion(parse_source("mine.score/first")).posture(0))
    assert_same(find_posture("mine.score@0").posture, find_posture("mine.score/first@0").posture)
    assert (
        np.abs(find_posture("mine.score@0").posture.rotations - find_posture("ballet/first").posture.rotations).max()
        > 0.05
    )


def test_a_score_of_a_corpus_needs_no_path_and_a_file_of_that_name_goes_first() -> None:
    word = "ballet/centre.score/tendu"
    assert_same(find_posture(parse_posture(word)).posture, posture(read_score(CENTRE), "tendu"))
    assert locate_score("ballet/nothing.score") == Path("ballet/nothing.score")
    assert locate_score("ballet/../karate/kata.score") == Path("ballet/../karate/kata.score")
    Path("ballet").mkdir()
    shutil.copy(BALLET / "barre.score", "ballet/centre.score")
    assert locate_score("ballet/centre.score") == Path("ballet/centre.score")
    assert locate_score("nothing.score") == Path("nothing.score")
    shutil.copy(BALLET / "centre.score", "centre.score")
    assert locate_score("centre.score") == Path("centre.score")


@pytest.mark.long
def test_a_posture_of_a_file_is_a_frame_or_the_frame_nearest_to_a_time() -> None:
    clip = ballet_clip("jump").resample(30.0)
    write_motion("clip.bvh", clip)
    write_posture("A.json", clip.posture(3))
    whole = read_motion("clip.bvh")
    assert_same(find_posture("A.json").posture, read_posture("A.json"))
    assert_same(find_posture("A.json@0").posture, read_posture("A.json"))
    for frame in range(len(whole)):
        assert_same(find_posture(f"clip.bvh@{frame}").posture, whole.posture(frame))
        assert_same(find_posture(f"clip.bvh@{frame - len(whole)}").posture, whole.posture(frame))
        for off in (-0.016, 0.0, 0.016):
            if whole.times[frame] + off >= 0.0:
                assert_same(find_posture(f"clip.bvh@{whole.times[frame] + off:.6f}s").posture, whole.posture(frame))


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("arabesque", r"^arabesque: there is no such file or corpus; did you mean ballet/arabesque\?$"),
        ("balet", r"^balet: there is no such file or corpus; did you mean ballet\?$"),
        ("zzz", r"^zzz: there is no such file or corpus; corpora are ballet, .*, a posture of one is CORPUS/NAME$"),
        ("zzz@x", r"^zzz@x: there is no such file; frames are spelled clip\.bvh@240 or clip\.bvh@2\.0s$"),
        ("ballet/adagio@2x", r"^ballet/adagio: @2x is neither a frame, such as @240, nor seconds, such as @2\.0s$"),
        ("balet/fifth", r"balet/fifth: there is no such file, and no corpus 'balet'; did you mean ballet\?$"),
        ("opera/fifth", r"no corpus 'opera'; there are ballet, hands, "),
        ("ballet/fith", r"^ballet: no posture or clip 'fith'; did you mean fifth\?$"),
        ("ballet/adagoi@3", r"^ballet: no posture or clip 'adagoi'; did you mean adagio\?$"),
        ("hands/zzz", r"^hands: no posture or clip 'zzz'; there are rows, wave, roll$"),
        ("ballet", r"^ballet: holds 38 clips; name a posture or a clip, such as ballet/first$"),
        ("ballet/adagio", r"ballet/adagio: 68 frames, .* say which, from ballet/adagio@0 to ballet/adagio@67$"),
        ("ballet/adagio@68", r"^ballet/adagio: frames are 0 to 67, there is no frame 68$"),
        ("ballet/fifth@1", r"^ballet/fifth: frames are 0 to 0, there is no frame 1$"),
        ("ballet/adagio@34s", r"^ballet/adagio: its frames are from 0\.00 to 33\.50 s, there is none at 34 s$"),
        (f"{CENTRE}/tendue", r"centre\.score: no posture or clip 'tendue'; did you mean tendus\?|tendu\?"),
        ("centre.score/tendu", r"^centre\.score: there is no such file; did you mean ballet/centre\.score\?$"),
        ("nothing.score/tendu", r"^nothing\.score: cannot be read: there is no such file or folder$"),
        ("nothing.bvh@3", r"^nothing\.bvh: cannot be read: there is no such file or folder$"),
        (str(BALLET / "postures"), r"postures: is a folder, and no corpus"),
        (".", r"^\.: is a folder, and no corpus"),
        ("x\0y", r"there is no such file"),
        ("A" * 5000, r"there is no such file"),
        ("/" * 5000, r"is a folder|there is no such file"),
    ],
)
def test_what_names_nothing_is_told_with_what_there_is(word: str, message: str) -> None:
    with pytest.raises(MotionMindError, match=message) as raised:
        find_posture(word)
    assert "\n" not in str(raised.value)


def test_a_score_that_is_saved_while_it_is_read_is_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "mine.score"
    text = (BALLET / "vocabulary.score").read_text("utf-8")
    path.write_text(text, "utf-8")
    read = finding.read_scores

    def saved_meanwhile(places: tuple[Path, ...]) -> tuple[list[Score], list[Path]]:
        found = read(places)
        path.write_text(text + "\n# and more\n", "utf-8")
        return found

    monkeypatch.setattr(finding, "read_scores", saved_meanwhile)
    first = finding._read_once((path,))
    monkeypatch.setattr(finding, "read_scores", read)
    again = finding._read_once((path,))
    assert again is not first
    assert finding._read_once((path,)) is again


def test_scores_of_few_files_are_kept(tmp_path: Path) -> None:
    text = (BALLET / "vocabulary.score").read_text("utf-8")
    for number in range(21):
        path = tmp_path / f"{number}.score"
        path.write_text(text, "utf-8")
        finding._read_once((path,))
        path.unlink()
    assert len(finding._kept) == 16
