"""What is published and fetched is the same corpus; what is wrong on the way leaves none, and an error in a line."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import signal
import tarfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Run
from file_server import Files, serving_files
from saved_corpora import kill_before, put_array

from motionmind.corpus import store
from motionmind.corpus.versions import locked
from motionmind.errors import CorpusError, FormatError
from motionmind.registry import fetching
from motionmind.registry.archive import pack
from motionmind.registry.fetching import fetch, look_up
from motionmind.registry.index import Entry, parse_index
from motionmind.registry.publishing import publish
from motionmind.tween.engine import Engine

ABOUT = {"url": "https://example.org/dances/", "date": "2026-11-23", "licence_text": "Do what you like.\n"}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The home of a user who has built a corpus."""
    home = tmp_path_factory.mktemp("author")
    Engine.load("walk-hexapod").save(home / "corpora" / "insect")
    manifest = home / "corpora" / "insect" / store.MANIFEST
    manifest.write_text(manifest.read_text("utf-8").replace('"walk-hexapod"', '"insect"'), "utf-8")
    return home


@pytest.fixture(scope="module")
def published(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("public")
    publish("insect", folder, home=built, **ABOUT)
    return folder


@pytest.fixture(autouse=True)
def archives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of archives that were fetched, of this test alone."""
    monkeypatch.setattr(fetching, "archives", lambda: tmp_path / "archives")
    return tmp_path / "archives"


@pytest.fixture
def files(published: Path, tmp_path: Path) -> Iterator[Files]:
    shutil.copytree(published, tmp_path / "served")
    with serving_files(tmp_path / "served") as served:
        yield served


def fetched(wanted: str, home: Path, index: str | None = None, name: str | None = None) -> Path:
    found, source = look_up(wanted, index)
    assert isinstance(found, Entry)
    return fetch(found, source, name=name, home=home)


def names(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


# --- what is right --------------------------------------------------------------------------------------------------


def test_a_fetched_corpus_is_the_one_that_was_published(files: Files, built: Path, tmp_path: Path) -> None:
    place = fetched(f"{files.address}/index.json", tmp_path)
    assert place == tmp_path / "corpora" / "insect"
    theirs, ours = (store.load(home / "corpora" / "insect") for home in (built, tmp_path))
    assert ours.manifest == theirs.manifest
    assert ours.arrays.keys() == theirs.arrays.keys()
    for name, array in ours.arrays.items():
        assert np.array_equal(array, theirs.arrays[name], equal_nan=array.dtype.kind == "f"), name
    assert len(Engine.load("insect", tmp_path).corpus) == len(Engine.load("walk-hexapod").corpus)


def test_an_archive_is_downloaded_once(files: Files, tmp_path: Path) -> None:
    index = f"{files.address}/index.json"
    fetched("insect", tmp_path, index)
    fetched("insect", tmp_path, index, name="other")
    assert [path for path, _ in files.asked].count("/index.json") == 2
    assert len(files.asked) == 3
    assert Engine.load("other", tmp_path).corpus.name == "other"


def test_without_a_network_what_was_kept_is_of_use(files: Files, tmp_path: Path) -> None:
    local = tmp_path / "index.json"
    data = json.loads((files.folder / "index.json").read_text("utf-8"))
    archive = data["corpora"][0]["archive"]
    archive["url"] = f"{files.address}/{archive['url']}"
    local.write_text(json.dumps(data), "utf-8")
    fetched("insect", tmp_path, str(local))
    files.folder.rename(tmp_path / "gone")
    fetched("insect", tmp_path, str(local), name="other")
    (damaged,) = (tmp_path / "archives").glob("*/archive.tar")
    damaged.write_bytes(b"damaged")
    with pytest.raises(CorpusError, match="404"):
        fetched("insect", tmp_path, str(local), name="third")


def test_an_index_on_disk_lies_beside_its_archives(published: Path, tmp_path: Path) -> None:
    fetched("insect", tmp_path, str(published / "index.json"))
    assert names(tmp_path / "archives") == []


@pytest.mark.parametrize("kind", ["none", "cut", "other", "endless", "folder"])
def test_a_file_on_disk_that_is_not_the_archive_is_named(kind: str, published: Path, tmp_path: Path) -> None:
    shutil.copytree(published, tmp_path / "copy")
    (archive,) = (tmp_path / "copy").glob("*.tar")
    data = archive.read_bytes()
    archive.unlink()
    match kind:
        case "cut":
            archive.write_bytes(data[:-1])
        case "other":
            archive.write_bytes(bytes(len(data)))
        case "endless":
            archive.symlink_to("/dev/zero")
        case "folder":
            archive.mkdir()
    with pytest.raises(CorpusError, match=r"\.tar: is not the archive that the index names"):
        fetched("insect", tmp_path, str(tmp_path / "copy" / "index.json"))
    assert not (tmp_path / "corpora").exists()


def test_what_a_killed_process_left_is_removed(files: Files, tmp_path: Path) -> None:
    entry, _ = look_up(f"{files.address}/index.json")
    assert isinstance(entry, Entry)
    left = tmp_path / "archives" / entry.archive.sha256 / "unpacked" / "insect"
    left.mkdir(parents=True)
    (left / "manifest.json").write_text("{", "utf-8")
    fetched(f"{files.address}/index.json#insect", tmp_path)
    assert names(tmp_path / "archives") == [f"{entry.archive.sha256}/archive.tar"]


def test_two_processes_do_not_fetch_one_archive_at_once(files: Files, tmp_path: Path) -> None:
    entry, source = look_up(f"{files.address}/index.json")
    assert isinstance(entry, Entry)
    folder = tmp_path / "archives" / entry.archive.sha256
    folder.mkdir(parents=True)
    with locked(folder, alone=True), pytest.raises(CorpusError, match="is being fetched by another process"):
        fetch(entry, source, home=tmp_path)


# --- names ----------------------------------------------------------------------------------------------------------


def test_a_corpus_that_is_there_is_not_replaced(files: Files, tmp_path: Path) -> None:
    index = f"{files.address}/index.json"
    fetched("insect", tmp_path, index)
    for name, message in [(None, "already"), ("ballet", "bundled"), ("../insect", "cannot be")]:
        with pytest.raises(CorpusError, match=message):
            fetched("insect", tmp_path, index, name=name)


def test_names_that_no_index_holds_are_answered_with_those_it_holds(files: Files) -> None:
    with pytest.raises(CorpusError, match="no corpus 'insects' in the index; did you mean insect"):
        look_up("insects", f"{files.address}/index.json")
    with pytest.raises(CorpusError, match="no corpus 'opera' in the index; there are 100style, aist, "):
        look_up("opera")
    with pytest.raises(CorpusError, match="no corpus 'b' in the index; there are insect"):
        look_up(f"{files.address}/index.json#b")


def test_an_address_of_several_corpora_needs_a_name(files: Files, built: Path) -> None:
    shutil.copytree(built / "corpora" / "insect", built / "corpora" / "second", dirs_exist_ok=True)
    manifest = built / "corpora" / "second" / store.MANIFEST
    manifest.write_text(manifest.read_text("utf-8").replace('"insect"', '"second"'), "utf-8")
    publish("second", files.folder, home=built, **ABOUT)
    with pytest.raises(CorpusError, match=r"holds 2 corpora \(insect, second\); add #NAME"):
        look_up(f"{files.address}/index.json")
    entry, _ = look_up(f"{files.address}/index.json#second")
    assert entry.name == "second"


# --- what is wrong --------------------------------------------------------------------------------------------------


def republish(files: Files, change: Callable[[dict[str, Any], Path], None]) -> str:
    """Let the server publish another archive: the good one, unpacked and changed; its index states true hashes.

    Args:
        files: the server.
        change: changes the entry, and the files in the folder.
    """
    data = json.loads((files.folder / "index.json").read_text("utf-8"))
    entry, folder = data["corpora"][0], files.folder / "unpacked"
    filtered = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}  # since Python 3.11.4
    shutil.unpack_archive(files.folder / entry["archive"]["url"], folder, **filtered)
    change(entry, folder)
    paths = {file["name"]: folder / file["name"] for file in entry["files"] if (folder / file["name"]).is_file()}
    for file in entry["files"]:
        if file["name"] in paths:
            content = paths[file["name"]].read_bytes()
            file |= {"size": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    pack(paths, files.folder / "bad.tar")
    whole = (files.folder / "bad.tar").read_bytes()
    entry["archive"] = {"url": "bad.tar", "size": len(whole), "sha256": hashlib.sha256(whole).hexdigest()}
    (files.folder / "index.json").write_text(json.dumps(data), "utf-8")
    return f"{files.address}/index.json"


def array(name: str, at: Any, value: float) -> Callable[[dict[str, Any], Path], None]:
    """Set numbers in an array."""

    def change(_: dict[str, Any], folder: Path) -> None:
        found = np.load(folder / "1" / f"{name}.npy")
        found[at] = value
        put_array(folder, name, found)

    return change


def manifest(key: str, value: Any) -> Callable[[dict[str, Any], Path], None]:
    """Set a key in the manifest."""

    def change(_: dict[str, Any], folder: Path) -> None:
        path = folder / store.MANIFEST
        path.write_text(json.dumps(json.loads(path.read_text("utf-8")) | {key: value}), "utf-8")

    return change


def pickled(_: dict[str, Any], folder: Path) -> None:
    np.save(folder / "1" / "root.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)


def flipped(_: dict[str, Any], folder: Path) -> None:
    file = folder / "1" / "root.npy"
    data = bytearray(file.read_bytes())
    data[-1] ^= 1
    file.write_bytes(data)


def lacking(entry: dict[str, Any], folder: Path) -> None:
    (folder / "1" / "states.npy").unlink()
    entry["files"] = [file for file in entry["files"] if file["name"] != "1/states.npy"]


ENTRY = {"type": "<f8", "shape": [1], "sha256": ""}
WRONG: dict[str, tuple[Callable[[dict[str, Any], Path], None], str]] = {
    "no number": (array("rotations", 0, np.nan), "rotations holds a number that is not from"),
    "no rotation": (array("rotations", 0, 0.5 + 1e-3), "rotations holds a quaternion that is not of unit length"),
    "no state": (array("states", (0, 0), 9999), "states holds an index out of range"),
    "no order in time": (array("times", 1, -1.0), "times does not rise"),
    "objects that run": (pickled, "cannot be read as an array"),
    "an array lacks": (lacking, "cannot be read as an array"),
    "a version to come": (manifest("version", 999), "a corpus of a later version"),
    "another checksum": (flipped, "its checksum is not the manifest's"),
    "no such clips": (array("clips.starts", 1, 0), "clips.starts does not rise from 0 to"),
    "another folder": (manifest("folder", 2), "there is no folder 2"),
    "arrays elsewhere": (manifest("arrays", {"../../../etc/passwd": ENTRY}), "is not the name of an array"),
    "another licence": (manifest("licence", "all rights reserved"), "states another licence than the index"),
    "no manifest": (lambda _, folder: (folder / store.MANIFEST).write_text("[]", "utf-8") and None, "manifest"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_archives_that_hold_no_valid_corpus_become_none(kind: str, files: Files, run: Run, tmp_path: Path) -> None:
    change, message = WRONG[kind]
    result = run("corpus", "fetch", republish(files, change))
    assert result.code == 2
    assert message in result.err
    assert result.err.count("\n") == 1
    assert "archives" not in result.err  # where it was unpacked, and is no more
    assert not (tmp_path / "home").exists()
    assert [name for name in names(tmp_path / "archives") if not name.endswith("/archive.tar")] == []


def listed(**changes: Any) -> Callable[[dict[str, Any]], None]:
    return lambda data: data["corpora"][0].update(changes)


HASH = "0" * 64
INDEXES: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "a later version": (lambda data: data.update(version=2), "version"),
    "another format": (lambda data: data.update(format="recipes"), "format"),
    "no format": (lambda data: data.pop("format"), "there is no key `format`"),
    "a file that climbs out": (listed(files=[{"name": "../a.npy", "size": 1, "sha256": HASH}]), "name"),
    "a file from the root": (listed(files=[{"name": "/a.npy", "size": 1, "sha256": HASH}]), "name"),
    "a program": (listed(files=[{"name": "1/a.py", "size": 1, "sha256": HASH}]), "name"),
    "no files": (listed(files=[]), "files"),
    "a file twice": (listed(files=[{"name": "manifest.json", "size": 1, "sha256": HASH}] * 2), "listed twice"),
    "a bomb": (listed(files=[{"name": "1/a.npy", "size": 10**12, "sha256": HASH}]), "larger than its archive"),
    "no size": (listed(archive={"url": "a.tar", "size": -1, "sha256": HASH}), "size"),
    "no hash": (listed(archive={"url": "a.tar", "size": 1, "sha256": "abc"}), "sha256"),
    "a name that climbs out": (listed(name="../insect"), "name"),
    "no licence": (listed(licence=""), "licence"),
    "two of a name": (lambda data: data["corpora"].append(data["corpora"][0]), "two corpora 'insect'"),
}


@pytest.mark.parametrize("kind", INDEXES)
def test_indexes_that_are_none_are_refused(kind: str, published: Path) -> None:
    change, message = INDEXES[kind]
    data = json.loads((published / "index.json").read_text("utf-8"))
    change(data)
    with pytest.raises(FormatError, match=f"^here: is not an index of corpora, version 1: .*{message}"):
        parse_index(json.dumps(data).encode(), "here")


@pytest.mark.parametrize("data", [b"", b"{", b"[" * 10**5, b"\xff", b"null", b"{}"])
def test_what_is_no_index_at_all_is_refused(data: bytes) -> None:
    with pytest.raises(FormatError, match=r"^here: is not an index"):
        parse_index(data, "here")


def test_an_index_without_end_is_not_read_to_the_end(files: Files, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motionmind.registry.index.MAX_INDEX_BYTES", 100)
    with pytest.raises(CorpusError, match="is larger than"):
        look_up(f"{files.address}/index.json")


def test_a_corpus_of_a_later_version_is_not_downloaded(files: Files, tmp_path: Path) -> None:
    data = json.loads((files.folder / "index.json").read_text("utf-8"))
    listed(corpus_version=999)(data)
    (files.folder / "index.json").write_text(json.dumps(data), "utf-8")
    with pytest.raises(CorpusError, match="is a corpus of version 999"):
        fetched(f"{files.address}/index.json", tmp_path)
    assert len(files.asked) == 1


@pytest.mark.parametrize("url", ["http://example.org/a.tar", "file:///etc/passwd"])
def test_archives_elsewhere_are_asked_for_over_tls_alone(url: str, files: Files, tmp_path: Path) -> None:
    data = json.loads((files.folder / "index.json").read_text("utf-8"))
    data["corpora"][0]["archive"]["url"] = url
    (files.folder / "index.json").write_text(json.dumps(data), "utf-8")
    for index in (f"{files.address}/index.json", str(files.folder / "index.json")):
        with pytest.raises(CorpusError, match="addresses begin with https"):
            fetched("insect", tmp_path, index)


# --- the command line -----------------------------------------------------------------------------------------------


def test_commands_publish_list_and_fetch(run: Run, tmp_path: Path) -> None:
    (tmp_path / "CC0.txt").write_text("CC0 1.0 Universal\n", "utf-8")
    options = ["--url", "https://example.org/a", "--date", "2026-11-23", "--licence-file", "CC0.txt"]
    result = run("corpus", "publish", "walk-hexapod", "-o", "public", *options)
    assert result.code == 0, result.err
    written = [line.split()[-1] for line in result.out.splitlines()]
    assert [Path(path).suffix for path in written] == [".tar", ".json", ".json"]
    assert all((tmp_path / path).is_file() for path in written)
    listing = run("corpus", "list", "--remote", "--index", "public/index.json")
    assert listing.out.splitlines()[0].startswith("walk-hexapod")
    assert "lafan1" in listing.out
    whole = run("corpus", "list", "--remote", "--index", "public/index.json", "--json").json
    assert whole["corpora"][0]["licence_text"] == "CC0 1.0 Universal\n"
    refused = run("corpus", "fetch", "walk-hexapod", "--index", "public/index.json")
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    result = run("corpus", "fetch", "walk-hexapod", "--index", "public/index.json", "--as", "insect")
    assert (result.code, result.err) == (0, "")
    assert "licence      CC0" in result.out
    assert "insect" in run("corpus", "list").out


def test_what_an_index_says_is_displayed_and_not_acted_on(run: Run, published: Path, tmp_path: Path) -> None:
    data = json.loads((published / "index.json").read_text("utf-8"))
    listed(title="\x1b[31mred", licence="\u202efree", citation="\x07", source="a\nb")(data)
    (tmp_path / "index.json").write_text(json.dumps(data), "utf-8")
    for words in (["list", "--remote"], ["fetch", "insect"]):
        result = run("corpus", *words, "--index", "index.json")
        assert not set("\x1b\u202e\x07") & set(result.out + result.err)


def test_a_recipe_is_printed_and_is_no_corpus(run: Run) -> None:
    result = run("corpus", "fetch", "lafan1")
    assert result.code == 2
    assert result.err == "error: lafan1 may not be redistributed; the steps above build it\n"
    assert "CC BY-NC-ND 4.0" in result.out
    assert "\nstep 2       motionmind corpus build lafan1 " in result.out
    assert "https://github.com/ubisoft/ubisoft-laforge-animation-dataset" in result.out.split()  # in one piece


def test_no_network_is_an_error_in_a_line(run: Run) -> None:
    result = run("corpus", "fetch", "http://127.0.0.1:1/index.json")
    assert (result.code, result.err.count("\n")) == (2, 1)
    assert "127.0.0.1:1/index.json: cannot be reached: " in result.err


def test_an_index_that_is_not_there_is_named(run: Run) -> None:
    result = run("corpus", "list", "--remote", "--index", "none.json")
    assert (result.code, result.err) == (2, "error: none.json: cannot be read: there is no such file or folder\n")


# --- kills ----------------------------------------------------------------------------------------------------------

EVERY = 13  # of the changes of the disk, one is the last of a process


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
def test_a_kill_before_a_change_of_the_disk_leaves_no_corpus_or_the_whole(published: Path, tmp_path: Path) -> None:
    index, home = str(published / "index.json"), tmp_path / "home"
    fetched("insect", tmp_path / "other", index)
    whole = store.load(tmp_path / "other" / "corpora" / "insect")
    for change in range(1, 10_000, EVERY):
        if (child := os.fork()) == 0:
            with suppress(BaseException):
                kill_before(change)
                fetched("insect", home, index)
            os._exit(0)
        _, status = os.waitpid(child, 0)
        if os.WIFEXITED(status):  # there are no more changes
            break
        assert "insect" not in store.list_corpora(home) or store.load(home / "corpora" / "insect").arrays.keys() == (
            whole.arrays.keys()
        )
    assert change > 5 * EVERY
    assert store.load(home / "corpora" / "insect").manifest["arrays"] == whole.manifest["arrays"]
    assert Engine.load("insect", home).corpus.name == "insect"
    fetched("insect", home, index, name="second")  # which clears away what is left of the first
    assert names(tmp_path / "archives") == []


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
@pytest.mark.parametrize("most", [1_000, 60_000])
def test_a_full_disk_is_an_error_and_leaves_no_corpus(most: int, files: Files, tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    index = f"{files.address}/index.json"
    reading, writing = os.pipe()
    if (child := os.fork()) == 0:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))  # no file may become longer
        try:
            fetched("insect", tmp_path, index)
        except CorpusError as error:
            os.write(writing, str(error).encode())
        finally:
            os._exit(0)
    os.waitpid(child, 0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        message = pipe.read().decode()
    assert re.search("bytes have come: File too large|cannot be unpacked: |cannot be written: ", message)
    assert "\n" not in message
    assert "insect" not in store.list_corpora(tmp_path)
    assert not [name for name in names(tmp_path / "archives") if "unpacked" in name]
    fetched("insect", tmp_path, index)
    assert Engine.load("insect", tmp_path).corpus.name == "insect"
