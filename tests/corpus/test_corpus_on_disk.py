"""Corpora on disk: what is saved is loaded, what is damaged is named, and where each is found."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Run
from numpy.typing import NDArray

from motionmind.corpus import store
from motionmind.corpus.fingerprint import fingerprint
from motionmind.corpus.manifest import SourceManifest, count_clips, parse_manifest
from motionmind.errors import CorpusError, FormatError

MANIFEST = {"name": "arms", "title": "Übung", "clips": [{"name": "a", "start": 0}], "rate": None}


def arrays(seed: int = 0) -> dict[str, NDArray[Any]]:
    rng = np.random.default_rng(seed)
    return {
        "rotations": rng.normal(size=(7, 3, 4)),
        "part.states": rng.integers(0, 9, (7, 3)).astype(np.int32),
        "empty": np.zeros((0, 3)),
        "strided": rng.normal(size=(8, 4))[::2, 1:],
    }


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_what_is_saved_is_loaded_exactly(tmp_path: Path) -> None:
    store.save(tmp_path / "deep" / "arms", MANIFEST, arrays())
    manifest, found, *_ = store.load(tmp_path / "deep" / "arms")
    assert {key: manifest[key] for key in MANIFEST} == MANIFEST
    assert found.keys() == arrays().keys()
    for name, array in arrays().items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["arms"]


def test_the_same_things_are_saved_as_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one", "two"):
        store.save(tmp_path / name, MANIFEST, arrays())
    assert contents(tmp_path / "one") == contents(tmp_path / "two")


def test_an_older_one_is_replaced_whole(tmp_path: Path) -> None:
    store.save(tmp_path / "arms", MANIFEST, arrays() | {"more": np.zeros(3)})
    for seed in (1, 2):  # the last but one is kept
        store.save(tmp_path / "arms", MANIFEST, arrays(seed))
    np.testing.assert_array_equal(store.load(tmp_path / "arms").arrays["rotations"], arrays(2)["rotations"])
    assert not list(tmp_path.rglob("more.npy"))
    assert [path.name for path in tmp_path.iterdir()] == ["arms"]


def test_a_folder_that_is_no_built_corpus_is_never_replaced(tmp_path: Path) -> None:
    diary = tmp_path / "home" / "diary.txt"
    diary.parent.mkdir()
    diary.write_text("dear diary")
    with pytest.raises(CorpusError, match=r"holds diary.txt, .*; it is not replaced"):
        store.save(diary.parent, MANIFEST, arrays())
    with pytest.raises(CorpusError, match="cannot be written"):
        store.save(diary, MANIFEST, arrays())
    assert diary.read_text() == "dear diary"
    assert [path.name for path in tmp_path.iterdir()] == ["home"]


def test_a_place_that_cannot_be_written_is_one_error(tmp_path: Path) -> None:
    for place in (tmp_path / ("x" * 300), Path("/proc/nowhere/arms")):
        with pytest.raises(CorpusError, match="cannot be written"):
            store.save(place, MANIFEST, arrays())


def test_a_corpus_that_is_damaged_is_a_format_error(
    tmp_path: Path, mutate: Callable[[str, random.Random], bytes]
) -> None:
    good = tmp_path / "good"
    store.save(good, MANIFEST, arrays())
    rng = random.Random(0)
    for trial in range(300):
        folder = tmp_path / f"bad{trial}"
        shutil.copytree(good, folder)
        file = rng.choice(sorted(path for path in folder.rglob("*") if path.is_file()))
        if file.name == store.MANIFEST:
            file.write_bytes(mutate(file.read_text("utf-8"), rng))
        else:
            data = bytearray(file.read_bytes())
            for _ in range(rng.randint(1, 4)):
                data[rng.randrange(min(140, len(data)))] = rng.randrange(256)
            file.write_bytes(data[: rng.choice([len(data), rng.randrange(len(data))])])
        with contextlib.suppress(FormatError):
            _, found, *_ = store.load(folder)
            for name, array in arrays().items():
                assert found.get(name, array).shape == array.shape


@pytest.mark.parametrize("name", ["rotations.npy", "part.states.npy"])
@pytest.mark.parametrize("how", ["gone", "empty", "another", "folder"])
def test_an_array_that_is_missing_or_another_is_named(tmp_path: Path, name: str, how: str) -> None:
    store.save(tmp_path / "arms", MANIFEST, arrays())
    file = tmp_path / "arms" / "1" / name
    file.unlink()
    if how == "empty":
        file.write_bytes(b"")
    elif how == "another":
        np.save(file, np.zeros((6, 3, 4)))
    elif how == "folder":
        file.mkdir()
    with pytest.raises(FormatError, match=name):
        store.load(tmp_path / "arms")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"format": "motionmind-corpus", "version": 2}', "its `version` is 2; version 1 can be read"),
        ('{"format": "motionmind-built-corpus", "version": 11, "folder": 3}', "there is no folder 3 beside it"),
        ('{"format": "motionmind-built-corpus", "version": 11}', "there is no key `folder`"),
        ('{"format": "motionmind-motion", "version": 1}', "its `format` is 'motionmind-motion'"),
        ("{}", "its `format` is no text"),
        ("[]", "cannot be read as a corpus's manifest"),
        ('{"format": ', "cannot be read as a corpus's manifest"),
        ("", "cannot be read as a corpus's manifest"),
        ("\udcff", "cannot be read as a corpus's manifest"),
        ("[" * 100_000, "cannot be read as a corpus's manifest"),
        ('{"format": "motionmind-built-corpus", "version": "1"}', "its `version` is not a small number; version 11"),
        (f'{{"format": "motionmind-corpus", "version": {"9" * 1000}}}', "its `version` is not a small number"),
        (f'{{"format": {"[" * 300}{"]" * 300}}}', "its `format` is no text"),
    ],
)
def test_a_manifest_that_is_none_is_a_format_error(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "manifest.json").write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(FormatError, match=words):
        store.load(tmp_path)


@pytest.mark.parametrize(("version", "age"), [(1, "an earlier"), (10, "an earlier"), (12, "a later")])
def test_a_corpus_of_another_version_is_one_line_with_the_command_that_rebuilds_it(
    run: Run, tmp_path: Path, version: int, age: str
) -> None:
    folder = tmp_path / "home" / "corpora" / "mine"
    (folder / "3").mkdir(parents=True)
    for file in (folder / "states.npy", folder / "3" / "states.npy"):
        np.save(file, np.zeros(3))
    (folder / store.MANIFEST).write_text(json.dumps({"format": store.BUILT, "version": version, "folder": 3}), "utf-8")
    command = "motionmind corpus build mine FILES --replace"
    remedy = f"{folder}/manifest.json: a corpus of {age} version; rebuild it: {command}\n"
    ran = run("corpus", "info", "mine")
    assert (ran.code, ran.out, ran.err) == (2, "", f"error: {remedy}")
    listed = run("corpus", "list")
    assert (listed.code, listed.err) == (0, f"note: {remedy}")
    store.save(folder, MANIFEST, arrays())
    assert [path.name for path in folder.iterdir() if path.is_dir()] == ["4"]
    assert not (folder / "states.npy").exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"../../etc/passwd": {"type": "<f8", "shape": [3], "sha256": ""}}, "is not the name of an array"),
        ({"a": {"type": "|O8", "shape": [3], "sha256": ""}}, "type"),
        ({"a": {"type": "<f8", "shape": [-1], "sha256": ""}}, "shape"),
        ({"a": None}, "Expected `object`"),
        ({"a\nb": {"type": "<f8", "shape": [3], "sha256": ""}}, "is not the name of an array"),
    ],
)
def test_an_entry_of_an_array_that_is_none_is_a_format_error(tmp_path: Path, change: object, words: str) -> None:
    store.save(tmp_path / "arms", MANIFEST, arrays())
    path = tmp_path / "arms" / store.MANIFEST
    path.write_text(json.dumps(json.loads(path.read_text("utf-8")) | {"arrays": change}), "utf-8")
    with pytest.raises(FormatError, match=rf"^.*manifest.json: .*{words}.*; rebuild it: "):
        store.load(tmp_path / "arms")


@pytest.mark.parametrize(
    "shape",
    [
        *(None, 7, "7", {"0": 7}, [7.0], ["7"], [True], [None], [-1], [[7]], [2**41], [10**30], ["9" * 9]),
        *([1] * 9, [9] * 10_000, [[[]]], [{"shape": [7]}], [7, "x\ny"]),
    ],
    ids=lambda shape: repr(shape)[:20],
)
def test_shapes_are_non_negative_whole_numbers(tmp_path: Path, shape: object) -> None:
    store.save(tmp_path / "arms", MANIFEST, arrays() | {"clips.order": np.zeros(7, np.int32)})
    path = tmp_path / "arms" / store.MANIFEST
    manifest = json.loads(path.read_text("utf-8"))
    assert count_clips(manifest) == 7
    for name in ("rotations", "clips.order"):
        changed = manifest["arrays"] | {name: manifest["arrays"][name] | {"shape": shape}}
        path.write_text(json.dumps(manifest | {"arrays": changed}), "utf-8")
        with pytest.raises(FormatError, match=r"^.*manifest.json: .*shape.*; rebuild it: [^\n]*\Z") as caught:
            store.load(tmp_path / "arms")
        assert len(str(caught.value)) < 400
        assert count_clips(json.loads(path.read_text("utf-8"))) == 0


@pytest.mark.parametrize("kind", ["<f1", "|f8", "<f8\n", "<b1", ">f8", "|O8", "f8", "<i16", "<U1", ""])
@pytest.mark.parametrize("shape", [(3,), (0, 3)])
def test_types_are_those_of_numbers(tmp_path: Path, kind: str, shape: tuple[int, ...]) -> None:
    store.save(tmp_path / "arms", MANIFEST, {"a": np.zeros(shape)})
    path, file = tmp_path / "arms" / store.MANIFEST, tmp_path / "arms" / "1" / "a.npy"
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": kind, "fortran_order": False, "shape": shape})
    file.write_bytes(header.getvalue() + bytes(24))
    entry = {"type": kind, "shape": shape, "sha256": hashlib.sha256(file.read_bytes()).hexdigest()}
    path.write_text(json.dumps(json.loads(path.read_text("utf-8")) | {"arrays": {"a": entry}}), "utf-8")
    with pytest.raises(FormatError, match=r"manifest.json: .*type.*; rebuild it: "):
        store.load(tmp_path / "arms")


def test_a_flipped_byte_is_noticed(tmp_path: Path) -> None:
    store.save(tmp_path / "arms", MANIFEST, arrays())
    file = tmp_path / "arms" / "1" / "rotations.npy"
    data = bytearray(file.read_bytes())
    data[-1] ^= 1
    file.write_bytes(data)
    with pytest.raises(FormatError, match=r"rotations.npy: its checksum is not the manifest's; rebuild it: "):
        store.load(tmp_path / "arms")


SOURCE: dict[str, Any] = {
    "format": store.FORMAT,
    "version": store.VERSIONS[store.FORMAT],
    "name": "arms",
    "title": "Arms",
    "author": "us",
    "source": "here",
    "licence": "CC0-1.0",
    "facing": "stage",
    "rate": None,
    "discretization": {"kind": "codebook"},
    "clips": [{"name": "a", "file": "a.json", "about": ""}],
}


def test_what_a_persons_manifest_lacks_is_named() -> None:
    path = Path("arms/manifest.json")
    assert parse_manifest(SOURCE, SourceManifest, path).clips[0].file == "a.json"
    for key in SOURCE.keys() - {"format", "version"}:
        short = {name: value for name, value in SOURCE.items() if name != key}
        with pytest.raises(FormatError, match=f"^arms/manifest.json: there is no key `{key}`"):
            parse_manifest(short, SourceManifest, path)
    for key in ("name", "file", "about"):
        clip = {name: value for name, value in SOURCE["clips"][0].items() if name != key}
        with pytest.raises(FormatError, match=rf"there is no key `{key}` - at `\$.clips\[0\]`"):
            parse_manifest(SOURCE | {"clips": [clip]}, SourceManifest, path)


@pytest.mark.parametrize("name", ["/dev/zero", "../.netrc", "insect.score/../secret", ""])
def test_a_persons_manifest_names_no_files_but_scores(name: str) -> None:
    manifest = {key: value for key, value in SOURCE.items() if key != "clips"} | {"scores": ["a.score", name]}
    with pytest.raises(FormatError, match=r"is not a score, whose name ends in \.score"):
        parse_manifest(manifest, SourceManifest, Path("manifest.json"))


@pytest.mark.parametrize(("key", "value"), [("facing", "north"), ("rate", "5"), ("clips", {}), ("discretization", "x")])
def test_what_is_wrong_in_a_persons_manifest_is_named(key: str, value: object) -> None:
    with pytest.raises(FormatError, match=rf"at `\$.{key}`"):
        parse_manifest(SOURCE | {key: value}, SourceManifest, Path("manifest.json"))


# --- names and places -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["cmu-05", "mine", "Übung_2", "v1.2", "a" * 64])
def test_a_name_is_a_place(tmp_path: Path, name: str) -> None:
    assert store.place_for(name, tmp_path) == tmp_path / "corpora" / name


@pytest.mark.parametrize("name", ["", ".", "..", "../x", "a/b", "/etc", ".x", "-x", "a b", "a\0b", "a\n", "a" * 300])
def test_a_name_that_is_none_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(CorpusError, match="cannot be a corpus's name"):
        store.place_for(name, tmp_path)


DEVICES = ["CON", "nul.x", "Aux.tar.gz", "com1", "LPT9.v2", "prn", "com\u00b2", "mine.", "v1..."]


@pytest.mark.parametrize("name", DEVICES)
def test_a_name_that_windows_cannot_have_is_refused_for_a_new_corpus(tmp_path: Path, name: str) -> None:
    with pytest.raises(CorpusError, match="cannot be a folder on Windows; choose another name"):
        store.place_for(name, tmp_path)
    place = tmp_path / "corpora" / name  # of an earlier version: it can be renamed and deleted
    store.save(place, MANIFEST, arrays())
    assert store.own_place(name, tmp_path) == place
    store.rename(name, "other", tmp_path)
    assert (list(store.list_corpora(tmp_path)).count("other"), place.exists()) == (1, False)


@pytest.mark.parametrize("name", ["console", "nully", "com", "com10", "lpt", "a.con", "con-1", "v1.nul"])
def test_a_name_that_only_resembles_a_device_is_a_place(tmp_path: Path, name: str) -> None:
    assert store.place_for(name, tmp_path).name == name


@pytest.mark.parametrize(("new", "known"), [("Ballet", "ballet"), ("MINE", "mine"), ("STRASSE", "straße")])
def test_names_that_differ_only_by_case_are_refused(tmp_path: Path, new: str, known: str) -> None:
    if known != "ballet":
        store.save(store.place_for(known, tmp_path), MANIFEST, arrays())
        assert store.place_for(known, tmp_path).is_dir()  # its own name is none of another
    with pytest.raises(CorpusError, match=f"{new!r} differs from the corpus {known!r} only by case"):
        store.place_for(new, tmp_path)


def test_a_bundled_corpus_keeps_its_name(tmp_path: Path) -> None:
    with pytest.raises(CorpusError, match="'ballet' is the name of a bundled corpus"):
        store.place_for("ballet", tmp_path)


def test_corpora_are_found_by_name_and_by_folder(tmp_path: Path) -> None:
    store.save(tmp_path / "corpora" / "arms", MANIFEST, arrays())
    assert store.locate("arms", tmp_path) == tmp_path / "corpora" / "arms"
    assert store.locate(str(tmp_path / "corpora" / "arms")) == tmp_path / "corpora" / "arms"
    assert list(store.list_corpora(tmp_path))[:2] == ["arms", "ballet"]
    assert store.locate("ballet", tmp_path).parent.name == "corpora"


@pytest.mark.parametrize("name", ["", "nobody", "a" * 5000, "a\0b", "../corpora"])
def test_an_unknown_corpus_is_answered_with_the_known_ones(tmp_path: Path, name: str) -> None:
    with pytest.raises(CorpusError, match="there are ballet"):
        store.locate(name, tmp_path)


def test_home_is_what_is_asked_for_then_the_environments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MOTIONMIND_HOME", str(tmp_path / "environment"))
    assert store.home(tmp_path) == tmp_path
    assert store.home() == tmp_path / "environment"
    monkeypatch.delenv("MOTIONMIND_HOME")
    assert store.home().name == "motionmind"


def test_a_fingerprint_tells_files_apart(tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    one.write_bytes(b"ab")
    two.write_bytes(b"c")
    before = fingerprint([one, two])
    assert fingerprint([one, two]) == before
    two.write_bytes(b"d")
    assert fingerprint([one, two]) != before
    with pytest.raises(FormatError, match="three"):
        fingerprint([tmp_path / "three"])
