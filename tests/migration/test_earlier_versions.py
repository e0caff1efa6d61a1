"""Files that earlier versions wrote are read, or refused with the command that mends it; see earlier/README.md."""

from __future__ import annotations

import hashlib
import json
import re
import shlex
import zipfile
from pathlib import Path

import numpy as np
import pytest
from command_line import Ran, Run

from motionmind.corpus import store
from motionmind.errors import MotionMindError
from motionmind.formats import read_motion, read_posture
from motionmind.learned import persistence
from motionmind.learned.validity import ENTRIES, FORMS, MOVEMENT, TRUST
from motionmind.tween.engine import Engine
from motionmind.tween.report import read_report
from motionmind.variation.variation import Variation
from motionmind.variation.variation_json import read_variation

MANIFEST = "corpora/piece/manifest.json"
HERE = Path(__file__).parent
PIECE = HERE / "piece.bvh"
EARLIER = sorted((HERE / "earlier").glob("*.zip"))
ROUNDING = 1e-5  # of numbers in files, radians and metres; the piece's BVH has degrees with 6 digits


def holding(*names: str) -> pytest.MarkDecorator:
    """Give a test each archive that holds one of these files, and the file's name."""
    found = [(path, name) for path in EARLIER for name in names if name in zipfile.ZipFile(path).namelist()]
    assert found
    return pytest.mark.parametrize(("archive", "name"), found, ids=[f"{path.stem}-{name}" for path, name in found])


CORPORA = [path for path in EARLIER if MANIFEST in zipfile.ZipFile(path).namelist()]
OF_EACH_VERSION = {json.loads(zipfile.ZipFile(path).read(MANIFEST))["version"]: path for path in CORPORA}  # its last
each_corpus = pytest.mark.parametrize("archive", CORPORA, ids=lambda path: path.stem)


def unpacked(archive: Path, folder: Path) -> Path:
    zipfile.ZipFile(archive).extractall(folder)
    return folder


def contents(folder: Path) -> dict[Path, str]:
    """The hash of each file in a folder."""
    return {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.rglob("*") if path.is_file()}


def judged(variation: Variation) -> list[tuple[object, ...]]:
    """What was found for each seam of a variation."""
    return [
        (
            seam.start,
            seam.end,
            seam.abrupt_joints,
            one.cost,
            one.lower_bound,
            one.path.tolist(),
            one.motion.root.tolist(),
        )
        for seam in variation.transitions
        for one in seam.candidates
    ]


def mended_by(run: Run, told: str) -> Ran:
    """Run the command that a message names, with what it leaves open filled in."""
    _, _, command = told.strip().splitlines()[-1].partition(": motionmind ")
    stands_for = {"FILES": str(PIECE), "A": f"{PIECE}@0", "B": f"{PIECE}@6", "NAME": "piece"}
    return run(*(stands_for.get(word, word) for word in shlex.split(command)))


@pytest.fixture(autouse=True)
def no_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "cache", lambda: tmp_path / "cache")


# --- corpora ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def today() -> Engine:
    """What this version learns from the piece."""
    return Engine.fit([read_motion(PIECE)], name="piece")


@each_corpus
def test_a_corpus_is_as_if_it_were_built_today_and_what_was_learned_again_is_kept(
    archive: Path, today: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = unpacked(archive, tmp_path / "home") / "corpora" / "piece"
    before = contents(folder)
    engine = Engine.load("piece", tmp_path / "home")
    np.testing.assert_array_equal(engine.states, today.states)
    np.testing.assert_allclose(engine.corpus.rotations, today.corpus.rotations, atol=ROUNDING)
    for part in ("transitions", "bridges", "coordination"):
        for name, array in vars(getattr(today.grammar, part)).items():
            np.testing.assert_allclose(getattr(getattr(engine.grammar, part), name), array, atol=1e-3, err_msg=name)
    a, b = (read_motion(PIECE).posture(frame) for frame in (0, 6))
    tween, other = engine.tween(a, b), today.tween(a, b)
    # Clusters stay as an earlier version drew them: a few states on the way may be others.
    assert np.mean(tween.path == other.path) > 0.95
    assert tween.status == "optimal"
    assert {path: name for path, name in contents(folder).items() if path.name != "checked"} == before
    monkeypatch.setattr(persistence, "learn_from_states", lambda *_: pytest.fail("it was learned once more"))
    again = Engine.load("piece", tmp_path / "home")
    np.testing.assert_array_equal(again.carriage.orientations, engine.carriage.orientations)


@pytest.mark.parametrize("archive", CORPORA[-2:], ids=lambda path: path.stem)
def test_a_corpus_that_keeps_all_that_is_learned_is_not_learned_again(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = unpacked(archive, tmp_path / "home") / "corpora" / "piece"
    monkeypatch.setattr(persistence, "learn_from_states", lambda *_: pytest.fail("it was learned again"))
    engine = Engine.load("piece", tmp_path / "home")
    assert [clip.name for clip in engine.corpus.clips] == ["piece"]
    assert store.rename("piece", "other", tmp_path / "home") == folder.with_name("other")
    assert Engine.load("other", tmp_path / "home").corpus.clips == engine.corpus.clips
    assert not store.cache().exists()


@pytest.mark.parametrize("archive", OF_EACH_VERSION.values(), ids=lambda path: path.stem)
def test_a_build_takes_the_place_of_a_corpus(archive: Path, run: Run, tmp_path: Path) -> None:
    folder = unpacked(archive, tmp_path / "home") / "corpora" / "piece"
    assert run("corpus", "build", "piece", PIECE).code == 0
    assert store.load(folder).is_current
    assert list(folder.glob("*.npy")) == []
    assert len([entry for entry in folder.iterdir() if entry.is_dir()]) == 1


@pytest.mark.parametrize("fault", ["cut", "altered", "lost", "unlisted", "manifest"])
@pytest.mark.parametrize(
    "archive", [CORPORA[0], *CORPORA[-2:]], ids=lambda path: path.stem
)  # each layout of the folder
def test_a_damaged_corpus_is_refused_with_the_command_that_mends_it(
    archive: Path, fault: str, run: Run, tmp_path: Path
) -> None:
    folder = unpacked(archive, tmp_path / "home") / "corpora" / "piece"
    (array,) = folder.rglob("states.npy")
    manifest = folder / store.MANIFEST
    match fault:
        case "cut":
            array.write_bytes(array.read_bytes()[:-1])
        case "altered":
            np.save(array, np.load(array) + 1000)
        case "lost":
            array.unlink()
        case "unlisted":
            parts = json.loads(manifest.read_text("utf-8"))
            del parts["arrays"]
            manifest.write_text(json.dumps(parts), "utf-8")
        case "manifest":
            manifest.write_bytes(manifest.read_bytes()[:100])
    refused = run("corpus", "info", "piece")
    assert refused.code == 2
    assert len(refused.err.strip().splitlines()) == 1
    assert mended_by(run, refused.err).code == 0
    assert run("corpus", "info", "piece").code == 0


def test_the_newest_of_these_corpora_is_what_this_version_writes(today: Engine, tmp_path: Path) -> None:
    """Whoever changes what a corpus keeps gives it a new version, and adds one of the old to these."""
    kept = store.load(unpacked(CORPORA[-1], tmp_path) / "corpora" / "piece")
    today.save(tmp_path / "today")
    now = store.load(tmp_path / "today")
    assert kept.manifest.keys() <= now.manifest.keys()  # a key that may lack is no other form
    assert kept.manifest["version"] == now.manifest["version"]
    assert list(kept.manifest["arrays"]) == list(now.manifest["arrays"])
    assert set(MOVEMENT) | set(ENTRIES) < set(FORMS) | set(TRUST) == set(now.arrays)


# --- postures, movement and variations --------------------------------------------------------------------------------


@holding("posture.json")
def test_a_posture_is_read(archive: Path, name: str, tmp_path: Path) -> None:
    posture, piece = read_posture(unpacked(archive, tmp_path) / name), read_motion(PIECE)
    np.testing.assert_allclose(posture.rotations, piece.rotations[0], atol=ROUNDING)
    np.testing.assert_allclose(posture.root, piece.root[0], atol=ROUNDING)


@holding("motion.json")
def test_movement_is_read(archive: Path, name: str, tmp_path: Path) -> None:
    motion, piece = read_motion(unpacked(archive, tmp_path) / name), read_motion(PIECE)
    np.testing.assert_allclose(motion.rotations, piece.rotations, atol=ROUNDING)
    np.testing.assert_allclose(motion.root, piece.root, atol=ROUNDING)
    np.testing.assert_allclose(motion.times, piece.times, atol=ROUNDING)


@holding("tween.json")
def test_a_tween_says_what_the_engine_inserted(archive: Path, name: str, tmp_path: Path) -> None:
    motion = read_motion(unpacked(archive, tmp_path) / name)
    (insertion,) = motion.insertions
    assert len(insertion.times) == 6
    assert (insertion.times[0], insertion.times[-1]) == (motion.times[0], motion.times[-1])


@holding("variation.json", "reviewed.json")
def test_a_variation_is_read_reviewed_and_written(archive: Path, name: str, run: Run, tmp_path: Path) -> None:
    file = unpacked(archive, tmp_path) / name
    before = read_variation(file)
    assert len(before.transitions) == 2
    assert len(before.edits) == (2 if name == "reviewed.json" else 0)
    assert run("corpus", "build", "piece", PIECE).code == 0
    assert run("review", file, "--approve", "1,2", "--cut", "0..1", "--paste", "3", "-o", "again.json").code == 0
    after = read_variation(tmp_path / "again.json")
    assert judged(after) == judged(before)
    assert after.edits[: len(before.edits)] == before.edits
    assert len(after.edits) == len(before.edits) + 2
    np.testing.assert_array_equal(after.order, before.order)
    np.testing.assert_allclose(read_motion(file).rotations, before.motion().rotations, atol=ROUNDING)


# --- reports ----------------------------------------------------------------------------------------------------------


@holding("tween-report.json")
def test_a_report_is_explained_or_refused_with_the_command_that_mends_it(
    archive: Path, name: str, run: Run, tmp_path: Path
) -> None:
    file = unpacked(archive, tmp_path) / name
    explained = run("explain", file)
    if explained.code:
        assert len(explained.err.strip().splitlines()) == 1
        with pytest.raises(MotionMindError, match="a tween report of an earlier version; make it again"):
            read_report(file)
        assert run("corpus", "build", "piece", PIECE).code == 0
        assert mended_by(run, explained.err).code == 0
        explained = run("explain", file)
    assert explained.code == 0
    assert re.search(r"left_knee", explained.out)
    report = read_report(file)
    assert report.status == "optimal"
    assert len(report.path) == report.moves + 1 > 2
