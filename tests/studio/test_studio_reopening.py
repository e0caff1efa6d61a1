"""Projects that are opened again: with the corpora that they were made with, with others, and without them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from bundled_clips import ballet_clip
from studio_server import serving

from motionmind.corpus import store
from motionmind.errors import MotionMindError
from motionmind.studio.edits import Insert
from motionmind.studio.findings import Finding
from motionmind.studio.project import Project, RefusedError
from motionmind.studio.settings import SetCorpus
from motionmind.tween.engine import Engine


def learn(home: Path, *clips: str) -> None:
    """Learn the corpus `mine` anew."""
    Engine.fit([ballet_clip(clip) for clip in clips], name="mine").save(store.place_for("mine", home))


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A home with a corpus."""
    learn(tmp_path, "plies", "tendus")
    return tmp_path


@pytest.fixture
def path(home: Path) -> Path:
    """A project of that corpus, with two stretches and what is known of their seam."""
    project = Project.create(home / "piece.motionmind", "mine", home)
    last = len(project.movements.get("mine/tendus")) - 1
    for name in ("b1", "b2"):
        project.edit("w1", Insert(name, "mine/tendus", 0, last))
    (seam,) = project.state.seams
    project.keep_finding(Finding(project.question(seam), abrupt=False, words="it knows this", insertions=None))
    project.close()
    return project.path


def test_with_the_same_corpus_there_is_nothing_to_say(home: Path, path: Path) -> None:
    project = Project.open(path, home)
    assert project.words == []
    assert project.finding(project.state.seams[0]) is not None
    project.close()


def test_a_corpus_that_was_built_again_alike_is_the_same(home: Path, path: Path) -> None:
    learn(home, "plies", "tendus")
    project = Project.open(path, home)
    assert project.words == []
    project.close()


def test_a_corpus_that_has_changed_is_said_once_and_its_seams_are_judged_anew(home: Path, path: Path) -> None:
    learn(home, "plies", "tendus", "jump")
    project = Project.open(path, home)
    assert project.words == ["mine has changed since this piece was made: its seams will be checked again"]
    assert project.finding(project.state.seams[0]) is None
    project.close()
    again = Project.open(path, home)
    assert again.words == []
    again.close()


def test_a_corpus_that_is_missing_is_named(home: Path, path: Path) -> None:
    data = path.read_bytes()
    store.delete("mine", home)
    project = Project.open(path, home)
    assert project.missing == ["corpus mine is missing: build it again under that name"]
    (seam,) = project.state.seams
    assert project.lacks(seam)
    assert project.finding(seam) is not None  # what was found stays
    with pytest.raises(RefusedError, match="no movement mine/tendus"):
        project.edit("w1", Insert("b3", "mine/tendus", 0, 0))
    assert path.read_bytes() == data
    learn(home, "plies", "tendus")
    project.look_again("mine")
    assert (project.missing, project.words, project.lacks(seam)) == ([], [], False)
    project.edit("w1", Insert("b3", "mine/tendus", 0, 0))
    project.close()


def test_a_piece_without_its_corpus_is_shown_and_edited(home: Path, path: Path) -> None:
    store.delete("mine", home)
    with serving(Project.open(path, home), home) as client:
        view = client.project()
        assert view["missing"] == ["corpus mine is missing: build it again under that name"]
        assert [block["missing"] for block in view["piece"]["blocks"]] == [True, True]
        assert [corpus["name"] for corpus in client.get("/api/gallery")["corpora"]] == []
        refused = client.send("GET", "/api/export/bvh")
        assert (refused.status, "corpus mine is missing" in refused.value["error"]) == (400, True)
        client.edit(edit="corpus", name="ballet")
        client.edit(edit="delete", block="b1")
        view = client.insert("b3", "ballet/plies", 0, 9)
        assert [block["missing"] for block in view["piece"]["blocks"]] == [True, False]
        client.edit(edit="delete", block="b2")
        assert client.project()["missing"] == []


def test_a_stretch_that_its_corpus_lacks_now_is_named(home: Path, path: Path) -> None:
    learn(home, "plies")
    project = Project.open(path, home)
    last = project.state.blocks[0].last
    assert project.missing == [f"the piece needs frame {last} of mine/tendus, which is missing"]
    project.close()


def test_a_corpus_that_there_is_not_is_refused(home: Path, path: Path) -> None:
    project = Project.open(path, home)
    before = path.read_bytes()
    with pytest.raises(MotionMindError, match="no corpus 'nothing'"):
        project.edit("w1", SetCorpus("nothing"))
    with pytest.raises(RefusedError):
        project.edit("w1", Insert("b3", "nothing/clip", 0, 0))
    assert path.read_bytes() == before
    project.edit("w1", SetCorpus("ballet"))
    assert set(project.versions) == {"ballet", "mine"}
    project.close()


def test_the_page_says_what_is_missing(home: Path, path: Path, browser: Any) -> None:
    store.delete("mine", home)
    with serving(Project.open(path, home), home) as client:
        context = browser.new_context(
            viewport={"width": 1440, "height": 900}, device_scale_factor=0.5, reduced_motion="reduce"
        )
        page = context.new_page()
        errors: list[str] = []
        page.on("console", lambda message: message.type == "error" and errors.append(message.text))
        try:
            page.goto(client.entry)
            page.get_by_text("corpus mine is missing").wait_for()
            page.locator(".stretch.missing").nth(1).wait_for()
            assert page.locator(".stretch.missing").count() == 2
            assert "missing" in page.get_by_test_id("block-b1").get_attribute("aria-label")
            page.wait_for_timeout(300)
            assert errors == []
        finally:
            context.close()
