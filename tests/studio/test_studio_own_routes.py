"""Variations and one's own movement over HTTP."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from scores import BENDS
from studio_server import Served, serving

from motionmind import Motion, human23, write_motion
from motionmind.geometry import rotations as rot
from motionmind.studio.project import Project


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    """A studio with a piece of two clips, and a home of its own."""
    home = tmp_path / "home"
    with serving(Project.create(tmp_path / "piece.motionmind", "ballet", home), home) as found:
        found.insert("b1", "ballet/adagio", 0, 40)
        found.insert("b2", "ballet/petit-allegro", 0, 25, mirrored=True)
        yield found


def bring(served: Served, name: str, data: bytes) -> Any:
    return served.send("POST", "/api/imports", data, X_Name=quote(name))


def frames(blocks: Any) -> list[tuple[str, bool, int]]:
    return [(b["source"], b["mirrored"], i) for b in blocks for i in range(b["first"], b["last"] + 1)]


# --- variations -------------------------------------------------------------------------------------------------------


def test_a_variation_becomes_the_piece_and_is_taken_back(served: Served) -> None:
    piece = served.project()["piece"]
    found = served.post("/api/vary", {"depart": 0.2})
    assert len(found["piece"]["blocks"]) > 2
    assert set(frames(found["piece"]["blocks"])) <= set(frames(piece["blocks"]))
    assert served.project()["piece"]["blocks"] == piece["blocks"]  # it is only a proposal
    blocks = [
        {name: b[name] for name in ("id", "source", "first", "last", "mirrored")} for b in found["piece"]["blocks"]
    ]
    state = served.edit(edit="arrange", blocks=blocks, about=found["about"])
    assert frames(state["piece"]["blocks"]) == frames(found["piece"]["blocks"])
    assert state["undo"] == "vary the piece"
    # Varied again, it is the piece that it was at first that is varied: the same wish gives the same.
    again = served.post("/api/vary", {"depart": 0.2})
    assert [b["id"] for b in again["piece"]["blocks"]] == [b["id"] for b in state["piece"]["blocks"]]
    back = served.post("/api/vary", {"nudge": 0.0})
    assert frames(back["piece"]["blocks"]) == frames(piece["blocks"])
    assert [part["key"] for part in back["original"]] == [part["key"] for part in piece["parts"]]
    assert served.post("/api/undo", {"window": "w1"})["piece"]["blocks"] == piece["blocks"]


def test_insertions_are_limited_where_they_can_be_estimated(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    wish = {"depart": 0.2, "stretch": 4}
    free, limited = (served.post("/api/vary", wish | {"inserted": share}) for share in (None, 0.3))
    assert 0.0 < limited["departs"] < free["departs"]
    assert (free["unlimited"], limited["unlimited"]) == ("", "")
    monkeypatch.setattr("motionmind.studio.varied._MAX_ESTIMATED_UNITS", 60)
    found = served.post("/api/vary", wish | {"inserted": 0.3})
    assert found["unlimited"] == "Insertions are not limited: the piece has 67 postures, more than 60."
    assert found["departs"] == free["departs"]


def test_an_order_is_taken_only_by_the_piece_that_it_was_proposed_for(served: Served) -> None:
    found = served.post("/api/vary", {"depart": 0.2})
    blocks = [
        {name: b[name] for name in ("id", "source", "first", "last", "mirrored")} for b in found["piece"]["blocks"]
    ]
    order = {"edit": {"edit": "arrange", "blocks": blocks, "about": found["about"]}, "window": "w1"}
    other = served.another("w2")
    trim = {"edit": "trim", "block": "b1", "first": 0, "last": 30}
    lock = {"edit": "decide", "left": "b1", "right": "b2", "decision": "locked"}
    for edit in (trim, lock):
        other.edit(**edit)
        before = served.project()
        answer = served.send("POST", "/api/vary/accept", order | {"basis": found["basis"]})
        assert (answer.status, "the piece has changed" in answer.value["error"]) == (412, True)
        assert served.project() == before
        other.post("/api/undo", {"window": "w2"})
    # What no variation rests on may change meanwhile.
    other.edit(edit="title", title="Swan")
    state = served.post("/api/vary/accept", order | {"basis": found["basis"]})
    assert (frames(state["piece"]["blocks"]), state["undo"]) == (frames(found["piece"]["blocks"]), "vary the piece")
    assert served.send("POST", "/api/vary/accept", order | {"basis": found["basis"]}).status == 412


def test_what_is_locked_and_what_is_kept_stays(served: Served) -> None:
    served.edit(edit="split", block="b1", at=20, id="b3")
    served.edit(edit="split", block="b2", at=10, id="b4")
    served.edit(edit="decide", left="b3", right="b2", decision="locked")
    found = served.post("/api/vary", {"depart": 0.3, "start": [12.0, 10.0, 40.0]})
    assert set(found["locked"]) == {"b3", "b2"} <= set(found["kept"])
    names = [block["id"] for block in found["piece"]["blocks"]]
    assert names.index("b2") == names.index("b3") + 1
    number = next(i for i, name in enumerate(names) if name not in ("b3", "b2"))
    block = {name: found["piece"]["blocks"][number][name] for name in ("id", "source", "first", "last", "mirrored")}
    kept = [{"block": block, "place": found["places"][number]}]
    again = served.post("/api/vary", {"depart": 0.3, "start": [-5.0, -8.0, 30.0], "kept": kept})
    where = [one["id"] for one in again["piece"]["blocks"]].index(block["id"])
    assert again["places"][where] == found["places"][number]
    assert again["piece"]["blocks"] != found["piece"]["blocks"]


def test_the_map(served: Served) -> None:
    found = served.get("/api/vary/map?flow=rossler")
    assert found["axes"] == [0, 1, 2]
    assert len(found["points"]) > 10_000


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        ({"flow": "opera"}, "no attractor"),
        ({"depart": 7}, "invalid request"),
        ({"start": [1e300, 0, 0]}, "diverges"),
        (
            {"kept": [{"block": {"id": "x", "source": "ballet/adagio", "first": 0, "last": 10**6}, "place": 0}]},
            "kept stretch",
        ),
        ({"kept": [{"block": {"id": "x", "source": "/etc/passwd", "first": 0, "last": 1}, "place": 0}]}, "no movement"),
    ],
)
def test_wishes_that_cannot_be_met(served: Served, wish: dict[str, Any], words: str) -> None:
    answer = served.send("POST", "/api/vary", wish)
    assert answer.status == 400
    assert words in answer.value["error"]
    assert "\n" not in answer.value["error"]


def test_nothing_to_vary(studio_server: Served) -> None:
    answer = studio_server.send("POST", "/api/vary", {})
    assert (answer.status, "nothing left to vary" in answer.value["error"]) == (400, True)


# --- one's own movement -----------------------------------------------------------------------------------------------


def test_a_score_is_brought_looked_at_and_put_on_the_time_line(served: Served) -> None:
    upload = bring(served, "Bends ☺.score", BENDS.encode()).value
    assert (upload["name"], upload["facts"]["clips"][0]["name"]) == ("Bends ☺.score", "bends")
    assert "body" not in upload["facts"]
    assert served.get("/api/imports") == [upload]
    shown = served.get(f"/api/imports/{upload['id']}/0/movement")
    assert shown["skeleton"]["names"]
    kept = served.post(f"/api/imports/{upload['id']}/0/keep", {})
    assert kept["frames"] == 3
    state = served.insert("b9", kept["key"], 0, 2)
    assert state["piece"]["blocks"][-1]["title"] == "bends"
    assert served.send("DELETE", f"/api/imports/{upload['id']}").status == 200
    assert served.get("/api/imports") == []
    assert served.get(f"/api/movements/{kept['key']}")["name"] == "bends"  # the project keeps it


@pytest.mark.long
def test_a_corpus_is_learned_looked_through_and_deleted(served: Served) -> None:
    upload = bring(served, "bends.score", BENDS.encode()).value
    wish = {"name": "mine", "title": "Bends", "parts": [{"upload": upload["id"]}], "mix": [{"name": "ballet"}]}
    job = served.wait_for(served.post("/api/corpora", wish)["job"])
    assert job["state"] == "done", job
    assert job["result"]["name"] == "mine"
    entry = next(one for one in served.get("/api/corpora") if one["name"] == "mine")
    assert (entry["title"], entry["own"]) == ("Bends", True)
    sheet = served.get("/api/corpora/mine")
    assert sheet["clips"][0]["title"] == "bends"
    picture = served.send("GET", f"/api/thumbnails/{sheet['clips'][0]['key']}/0.png?height=72")
    assert (picture.status, picture.body[:4]) == (200, b"\x89PNG")
    again = served.send("POST", "/api/corpora", wish)
    assert (again.status, "already" in again.value["error"]) == (400, True)
    assert served.send("DELETE", "/api/corpora/mine").status == 200
    assert all(one["name"] != "mine" for one in served.get("/api/corpora"))


@pytest.mark.long
def test_a_recording_is_mixed_with_a_corpus_of_keyframes(served: Served, tmp_path: Path) -> None:
    times = np.arange(61) / 30.0
    turns = np.zeros((61, 23, 3))
    turns[:, 5, 0] = 0.5 * np.sin(3.0 * times)
    path = tmp_path / "swing.bvh"
    write_motion(path, Motion(human23(), rot.exp(turns), np.tile([0.0, 1.0, 0.0], (61, 1)), times))
    upload = bring(served, "swing.bvh", path.read_bytes()).value
    wish = {"name": "both", "parts": [{"upload": upload["id"]}], "mix": [{"name": "ballet"}]}
    job = served.wait_for(served.post("/api/corpora", wish)["job"])
    assert job["state"] == "done", job
    assert served.get("/api/corpora/both")["rate"] == 5.0
    # Mixed with that, keyframes are taken as often.
    upload = bring(served, "bends.score", BENDS.encode()).value
    wish = {"name": "more", "parts": [{"upload": upload["id"]}], "mix": [{"name": "both"}]}
    job = served.wait_for(served.post("/api/corpora", wish)["job"])
    assert job["state"] == "done", job
    assert served.get("/api/corpora/more")["rate"] == 5.0


def test_learning_is_cancelled_and_leaves_nothing(served: Served) -> None:
    upload = bring(served, "bends.score", BENDS.encode()).value
    wish = {"name": "mine", "parts": [{"upload": upload["id"]}], "mix": [{"name": "ballet"}]}
    job = served.post("/api/corpora", wish)["job"]
    served.send("DELETE", f"/api/jobs/{job}")
    assert served.wait_for(job)["state"] == "cancelled"
    assert all(one["name"] != "mine" for one in served.get("/api/corpora"))


def test_what_cannot_be_learned_says_why(served: Served) -> None:
    upload = bring(served, "bends.score", BENDS.encode()).value
    for wish, words in (
        ({"name": "ballet", "parts": [{"upload": upload["id"]}]}, "bundled"),
        ({"name": "../up", "parts": [{"upload": upload["id"]}]}, "cannot be a corpus's name"),
        ({"name": "mine", "parts": [{"upload": upload["id"], "clip": 4}]}, "has no clip"),
        ({"name": "mine", "parts": [{"upload": "../.."}]}, "this file is gone"),
    ):
        answer = served.send("POST", "/api/corpora", wish)
        assert answer.status == 400
        assert words in answer.value["error"]


@pytest.mark.parametrize("name", ["ballet", "karate", "nowhere", "..%2F..%2Fetc", "%2Fetc"])
def test_only_corpora_of_ones_own_are_deleted(served: Served, name: str) -> None:
    assert served.send("DELETE", f"/api/corpora/{name}").status in (400, 404)
    assert "ballet" in [one["name"] for one in served.get("/api/corpora")]


@pytest.mark.parametrize(
    "path", ["/api/imports/..%2F..%2Fetc/0/movement", "/api/imports/nowhere/0/movement", "/api/corpora/%2Fetc"]
)
def test_names_are_no_paths(served: Served, path: str) -> None:
    answer = served.send("GET", path)
    assert answer.status in (400, 404)
    assert "root" not in answer.body.decode()


def test_bad_files_are_one_line_each(served: Served) -> None:
    refused = bring(served, "dance.fbx", b"anything")
    assert (refused.status, "Blender" in refused.value["error"]) == (400, True)
    broken = bring(served, "broken.bvh", b"HIERARCHY\nROOT Hips\n{\n")
    assert broken.status == 200
    assert broken.value["facts"] is None
    assert broken.value["error"].startswith("broken.bvh:")
    assert "\n" not in broken.value["error"]
    assert served.get("/health") == {"ready": True}
