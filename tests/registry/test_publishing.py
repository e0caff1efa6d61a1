"""What is published says what it is and whose, in the words of Croissant, with the same bytes on any day."""

from __future__ import annotations

import hashlib
import json
import os
import re
import tarfile
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urljoin

import pytest
from bundled_clips import ballet_clip

from motionmind.corpus import store
from motionmind.corpus.versions import locked
from motionmind.credits.credit import Origin
from motionmind.errors import CorpusError, FormatError, MotionMindWarning
from motionmind.registry.fetching import fetch, look_up
from motionmind.registry.index import parse_index
from motionmind.registry.publishing import publish
from motionmind.tween.engine import Engine

ABOUT = {"url": "https://example.org/dances", "date": "2026-11-23", "licence_text": "Do what you like."}
INSECT = "walk-hexapod"


@pytest.fixture(scope="module")
def published(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("public")
    publish(INSECT, folder, **ABOUT)
    return folder


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_same_corpus_gives_the_same_bytes(published: Path, tmp_path: Path) -> None:
    mask = os.umask(0o077)
    try:
        publish(INSECT, tmp_path / "a" / "b", **ABOUT)
    finally:
        os.umask(mask)
    assert content(tmp_path / "a" / "b") == content(published)


def test_the_index_is_true(published: Path) -> None:
    (entry,) = parse_index((published / "index.json").read_bytes(), "here").corpora
    archive = published / entry.archive.url
    assert entry.archive.size == archive.stat().st_size
    assert entry.archive.sha256 == hashlib.sha256(archive.read_bytes()).hexdigest()
    with tarfile.open(archive, "r:") as tar:
        files = {member.name: tar.extractfile(member) for member in tar}
        data = {name: file.read() for name, file in files.items() if file}
    assert data.keys() == files.keys() == {file.name for file in entry.files}
    for file in entry.files:
        assert (file.size, file.sha256) == (len(data[file.name]), hashlib.sha256(data[file.name]).hexdigest())
    assert data["LICENCE.txt"] == entry.licence_text.encode()
    manifest = json.loads(data["manifest.json"])
    assert [manifest[key] for key in ("title", "source", "licence")] == [entry.title, entry.source, entry.licence]


def test_others_in_the_index_stay_and_one_of_the_name_is_replaced(tmp_path: Path) -> None:
    publish(INSECT, tmp_path, **ABOUT)
    publish("hands", tmp_path, **ABOUT)
    changed = publish(INSECT, tmp_path, **ABOUT | {"licence_text": "No."})
    corpora = parse_index((tmp_path / "index.json").read_bytes(), "here").corpora
    assert [entry.name for entry in corpora] == ["hands", INSECT]
    assert corpora[1] == changed.entry
    assert (tmp_path / corpora[1].archive.url).is_file()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"date": "23.11.2026"}, "'23.11.2026' is not a day"),
        ({"date": "2026-02-30"}, "'2026-02-30' is not a day"),
        ({"url": "http://example.org/"}, "addresses begin with https"),
        ({"licence_url": "see below"}, "addresses begin with https"),
        ({"licence_text": " \n"}, "the licence's text is empty"),
        ({"licence_text": "x" * 100_001}, "licence_text"),
    ],
)
def test_what_cannot_be_published_leaves_nothing(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises((CorpusError, FormatError), match=re.escape(message)):
        publish(INSECT, tmp_path / "public", **ABOUT | change)
    assert [*tmp_path.rglob("*.*")] == []


def test_a_corpus_that_does_not_say_whose_it_is_is_not_published(tmp_path: Path) -> None:
    Engine.load(INSECT).save(tmp_path / "mine")
    manifest = tmp_path / "mine" / store.MANIFEST
    manifest.write_text(json.dumps(json.loads(manifest.read_text("utf-8")) | {"licence": "", "author": ""}), "utf-8")
    with pytest.raises(CorpusError, match="states no author, licence; build it again with --author --licence"):
        publish(str(tmp_path / "mine"), tmp_path / "public", **ABOUT)
    assert not (tmp_path / "public").exists()


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a corpus of two performers, with a part under a licence that forbids changes."""
    folder = tmp_path_factory.mktemp("mixed")
    clips = [replace(ballet_clip("plies"), name=name) for name in ("one", "two")]
    other = Engine.fit(clips[:1], name="other", source="there", licence="CC BY-ND 4.0", citation="Cite them.")
    other.save(folder / "corpora" / "other")
    by = {"one": "Ada", "two": "Bea"}
    about = {"title": "Plies", "author": "Us", "source": "here", "licence": "CC0", "citation": "Cite us."}
    with pytest.warns(MotionMindWarning, match="other forbids derivatives"):
        engine = Engine.fit(clips, name="mixed", mix={"other": 1.0}, home=folder, performer=by, **about)
    engine.save(folder / "corpora" / "mixed")
    return folder


def test_performers_citation_and_parts_go_with_a_corpus(mixed: Path, tmp_path: Path) -> None:
    with pytest.warns(MotionMindWarning, match="other forbids derivatives"):
        entry = publish("mixed", tmp_path / "public", home=mixed, **ABOUT).entry
    assert entry.performers == ("Ada", "Bea")
    assert entry.citation == "Cite us."
    assert entry.origins == (Origin("other", source="there", licence="CC BY-ND 4.0", citation="Cite them."),)
    described = json.loads((tmp_path / "public" / "mixed.croissant.json").read_text("utf-8"))
    assert described["citeAs"] == "Cite us."
    assert [one["name"] for one in described["creator"]] == ["Us", "Ada", "Bea"]
    found, source = look_up("mixed", str(tmp_path / "public" / "index.json"))
    assert found == entry
    fetch(entry, source, home=tmp_path)
    fetched = Engine.load("mixed", tmp_path).corpus
    assert fetched.origins == entry.origins
    assert fetched.citation == "Cite us."
    assert {clip.performer for clip in fetched.clips} == {"Ada", "Bea", ""}


def test_an_index_that_cannot_be_read_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "index.json").write_text("mine", "utf-8")
    with pytest.raises(FormatError, match="is not an index"):
        publish(INSECT, tmp_path, **ABOUT)
    assert content(tmp_path) == {"index.json": b"mine"}


def test_two_processes_do_not_publish_to_one_folder_at_once(tmp_path: Path) -> None:
    with locked(tmp_path, alone=True), pytest.raises(CorpusError, match="another process is publishing there"):
        publish(INSECT, tmp_path, **ABOUT)
    assert content(tmp_path) == {}


# --- Croissant ------------------------------------------------------------------------------------------------------

# What "Croissant Format Specification", version 1.0, requires of every data set.
REQUIRED = ["@context", "@type", "conformsTo", "name", "description", "license", "url", "creator", "datePublished"]


def test_metadata_holds_what_croissant_requires(published: Path) -> None:
    described = json.loads((published / f"{INSECT}.croissant.json").read_text("utf-8"))
    assert [key for key in [*REQUIRED, "distribution"] if not described.get(key)] == []
    assert described["@type"] == "sc:Dataset"
    assert described["conformsTo"] == "http://mlcommons.org/croissant/1.0"
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", described["datePublished"])
    assert re.fullmatch(r"\d+\.\d+\.\d+", described["version"])
    assert all(one["@type"] in ("sc:Person", "sc:Organization") and one["name"] for one in described["creator"])


def test_metadata_names_each_file_with_its_hash(published: Path) -> None:
    described = json.loads((published / f"{INSECT}.croissant.json").read_text("utf-8"))
    (entry,) = parse_index((published / "index.json").read_bytes(), "here").corpora
    archive, *members = described["distribution"]
    for one in described["distribution"]:
        assert one["@type"] == "cr:FileObject"
        assert all(one[key] for key in ("@id", "name", "contentUrl", "contentSize", "encodingFormat"))
        assert re.fullmatch("[0-9a-f]{64}", one["sha256"])
        assert re.fullmatch(r"\d+ B", one["contentSize"])
    assert archive["contentUrl"] == urljoin("https://example.org/dances/", entry.archive.url)
    assert archive["sha256"] == entry.archive.sha256
    assert {one["containedIn"]["@id"] for one in members} == {archive["@id"]}
    assert {one["contentUrl"]: one["sha256"] for one in members} == {file.name: file.sha256 for file in entry.files}
    identifiers = [one["@id"] for one in described["distribution"]]
    assert len(set(identifiers)) == len(identifiers)


def test_every_term_of_the_metadata_has_a_meaning(published: Path) -> None:
    described = json.loads((published / f"{INSECT}.croissant.json").read_text("utf-8"))
    context = described.pop("@context")
    prefixes = {key for key, value in context.items() if isinstance(value, str) and value.startswith("http")}
    text = json.dumps(described)
    assert set(re.findall(r'"(\w+):[A-Z]\w+"', text)) <= prefixes
    meanings = [value["@id"] if isinstance(value, dict) else value for value in context.values()]
    assert {meaning.partition(":")[0] for meaning in meanings if re.match(r"[a-z]+:(?!//)", meaning)} <= prefixes


def test_a_licence_is_named_by_its_address_or_by_its_text(tmp_path: Path, published: Path) -> None:
    address = "https://creativecommons.org/publicdomain/zero/1.0/"
    publish(INSECT, tmp_path, licence_url=address, **ABOUT)
    assert json.loads((tmp_path / f"{INSECT}.croissant.json").read_text("utf-8"))["license"] == address
    told = json.loads((published / f"{INSECT}.croissant.json").read_text("utf-8"))["license"]
    assert (told["name"], told["text"]) == ("CC0-1.0", "Do what you like.")
