"""From A to B over HTTP: the gallery, alternatives as they come, and what accepting one does to the piece."""

from __future__ import annotations

import threading
from base64 import b64decode
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from studio_server import Served

from motionmind.learned import persistence
from motionmind.studio.alternatives import MAX_ALTERNATIVES
from motionmind.studio.asks import Ask
from motionmind.studio.between import Between, Place, accepted
from motionmind.studio.edits import Choose, Insert, Several, Wish
from motionmind.studio.piece import State, apply

A, B = {"key": "ballet/arabesque", "frame": 0}, {"key": "ballet/fifth", "frame": 0}


def found(server: Served, a: Any = A, b: Any = B, **options: Any) -> tuple[str, list[Any]]:
    """The job of a search, once it is over, and what it found."""
    job = server.post("/api/between", {"a": a, "b": b, "options": options})["job"]
    over = server.wait_for(job)
    assert over["state"] == "done", over
    return job, over["partial"]


def test_the_gallery_lists_what_the_corpus_has(studio_server: Served) -> None:
    (ballet,) = studio_server.get("/api/gallery")["corpora"]
    assert {"key": "ballet/arabesque", "title": "arabesque"} in ballet["postures"]
    adagio = next(clip for clip in ballet["clips"] if clip["key"] == "ballet/adagio")
    motion = studio_server.studio.movements.get("ballet/adagio")
    assert (adagio["frames"], adagio["seconds"]) == (len(motion), pytest.approx(motion.times[-1]))


def test_the_studio_answers_while_a_corpus_is_composed_for_the_gallery(
    studio_server: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    load, composed = persistence.load_corpus, threading.Event()

    def compose(*given: Any) -> Any:
        assert composed.wait(60.0)
        return load(*given)

    monkeypatch.setattr(persistence, "load", lambda *_: pytest.fail("the gallery needs nothing learned"))
    monkeypatch.setattr(persistence, "load_corpus", compose)
    with ThreadPoolExecutor(1) as pool:
        gallery = pool.submit(studio_server.another("w2").get, "/api/gallery?whole")
        for _ in range(20):
            assert studio_server.project()["corpus"] == "ballet"
            assert not gallery.done()
        early = studio_server.get("/api/gallery")
        assert early["whole"] is False
        assert early["corpora"][0]["clips"] == []
        assert {"key": "ballet/arabesque", "title": "arabesque"} in early["corpora"][0]["postures"]
        assert studio_server.send("GET", "/api/thumbnails/ballet/arabesque/0.png").status == 200
        composed.set()
        whole = gallery.result(60.0)
        assert (whole["whole"], whole["corpora"][0]["name"]) == (True, "ballet")
        assert whole["corpora"][0]["clips"]


def test_alternatives_come_one_by_one_and_lead_from_a_to_b(studio_server: Served) -> None:
    job, accounts = found(studio_server)
    assert [one["number"] for one in accounts] == list(range(1, MAX_ALTERNATIVES + 1))
    ends = [studio_server.studio.movements.get(place["key"]).posture(0) for place in (A, B)]
    search = studio_server.studio.movements  # the movements that were found are not kept in the project
    assert not any(key.startswith("m-") for key in search._kept)
    for one in accounts:
        data = studio_server.get(f"/api/between/{job}/{one['number']}")
        assert data["skeleton"]["names"] == list(ends[0].skeleton.names)
        assert len(one["joints"]) == len(ends[0].skeleton)
    assert studio_server.send("GET", f"/api/between/{job}/{MAX_ALTERNATIVES + 1}").status == 400


def test_each_alternative_has_small_pictures_over_its_length(studio_server: Served) -> None:
    job, _ = found(studio_server)
    frames = len(b64decode(studio_server.get(f"/api/between/{job}/2")["times"])) // 8
    first, last = (studio_server.send("GET", f"/api/between/{job}/2/{frame}.png") for frame in (0, frames - 1))
    assert [one.headers["content-type"] for one in (first, last)] == ["image/png"] * 2
    assert first.body != last.body
    posture = studio_server.send("GET", "/api/thumbnails/ballet/arabesque/0.png?height=96")
    assert first.body == posture.body
    for path in (f"{job}/2/{frames}", f"{job}/9/0", "j0/1/0"):
        assert studio_server.send("GET", f"/api/between/{path}.png").status == 400


@pytest.mark.long
def test_the_next_four_go_nearer_or_farther(studio_server: Served) -> None:
    ask = {"a": A, "b": B}
    words = {}
    for spread in ("near", "far"):
        job = studio_server.wait_for(studio_server.post("/api/between", ask | {"spread": spread})["job"])
        words[spread] = [one["differs"] for one in job["partial"]]
        assert len(words[spread]) == MAX_ALTERNATIVES
    assert words["near"] != words["far"]
    assert studio_server.send("POST", "/api/between", ask | {"spread": "farthest"}).status == 400


def test_accepting_puts_both_postures_and_the_choice_into_the_piece(studio_server: Served) -> None:
    job, accounts = found(studio_server)
    state = studio_server.post("/api/between/accept", {"job": job, "alternative": 3, "window": "w1"})
    blocks, (seam,) = state["piece"]["blocks"], state["piece"]["seams"]
    assert [block["key"] for block in blocks] == [A["key"], B["key"]]
    assert (seam["state"], seam["chosen"], len(seam["alternatives"])) == ("inserted", 3, MAX_ALTERNATIVES)
    assert seam["seconds"] == pytest.approx(accounts[2]["seconds"])
    assert state["undo"] == "go from A to B"
    motion = studio_server.studio.movements.get(seam["alternatives"][2]["key"])
    for frame, place in ((0, A), (-1, B)):
        posture = studio_server.studio.movements.get(place["key"]).posture(0)
        assert np.allclose(abs(np.sum(motion.rotations[frame] * posture.rotations, axis=-1))[1:], 1.0, atol=1e-9)


def test_accepting_is_taken_back_and_done_again_as_one(studio_server: Served) -> None:
    job, _ = found(studio_server)
    accepted = studio_server.post("/api/between/accept", {"job": job, "alternative": 1, "window": "w1"})
    assert studio_server.post("/api/undo", {"window": "w1"})["piece"]["blocks"] == []
    assert studio_server.post("/api/redo", {"window": "w1"})["piece"] == accepted["piece"]


@pytest.mark.long
def test_accepting_nearer_or_farther_leaves_the_insertions_before(studio_server: Served) -> None:
    def accept(alternative: int, **ask: Any) -> Any:
        job = studio_server.post("/api/between", {"a": A, "b": B} | ask)["job"]
        assert studio_server.wait_for(job)["state"] == "done"
        body = {"job": job, "alternative": alternative, "window": "w1"}
        seam = studio_server.post("/api/between/accept", body)["piece"]["seams"][-1]
        data = studio_server.get(f"/api/between/{job}/{alternative}")
        chosen = seam["alternatives"][seam["chosen"] - 1]
        assert studio_server.get(f"/api/movements/{chosen['key']}")["rotations"] == data["rotations"]
        return seam

    def chosen() -> list[str]:
        seams = [one for one in studio_server.project()["piece"]["seams"] if one["alternatives"]]
        return [one["alternatives"][one["chosen"] - 1]["key"] for one in seams]

    first = accept(3)
    studio_server.edit(edit="decide", left=first["left"], right=first["right"], decision="locked")
    (kept,) = chosen()
    far = accept(2, spread="far")
    assert far["alternatives"][:MAX_ALTERNATIVES] == first["alternatives"]
    assert len({one["key"] for one in far["alternatives"]}) == len(far["alternatives"])
    near = accept(4, spread="near")
    assert chosen()[0] == kept
    assert len(set(chosen())) == len(chosen()) == 3
    whole = chosen()
    for _ in range(4):
        studio_server.post("/api/undo", {"window": "w1"})
    assert chosen() == []
    for _ in range(4):
        studio_server.post("/api/redo", {"window": "w1"})
    assert chosen() == whole
    assert near["alternatives"][: len(far["alternatives"])] == far["alternatives"]


def test_the_next_movement_goes_on_where_the_piece_ends(studio_server: Served) -> None:
    for a, b in ((A, B), (B, {"key": "ballet/second", "frame": 0})):
        job, _ = found(studio_server, a, b)
        state = studio_server.post("/api/between/accept", {"job": job, "alternative": 1, "window": "w1"})
    assert [block["title"] for block in state["piece"]["blocks"]] == ["arabesque", "fifth", "second"]
    assert [seam["state"] for seam in state["piece"]["seams"]] == ["inserted", "inserted"]


def test_a_length_is_kept_to(studio_server: Served) -> None:
    job, accounts = found(studio_server, seconds=3.0)
    assert all(one["seconds"] == pytest.approx(3.0) for one in accounts)
    state = studio_server.post("/api/between/accept", {"job": job, "alternative": 2, "window": "w1"})
    (seam,) = state["piece"]["seams"]
    assert (seam["ask"]["seconds"], seam["state"], seam["chosen"]) == (3.0, "inserted", 2)


@pytest.mark.long
def test_the_piece_names_the_places_that_are_missed(studio_server: Served) -> None:
    far = {"joint": "right_wrist", "place": [0.0, 9.0, 0.0], "at": 1.0}
    job, accounts = found(studio_server, seconds=2.0, reaches=[far])
    state = studio_server.post("/api/between/accept", {"job": job, "alternative": 1, "window": "w1"})
    ((seam,), flaws) = state["piece"]["seams"], accounts[0]["beyond"]
    assert any("from its place at 1 s" in flaw for flaw in flaws)
    assert set(flaws) <= set(seam["alternatives"][0]["words"].split("; "))


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"a": {"key": "ballet/nothing"}, "b": B}, "nothing"),
        ({"a": {"key": "ballet/adagio", "frame": 100000}, "b": B}, "frames 0 to"),
        ({"a": A}, "b"),
        ({"a": A, "b": B, "options": {"seconds": -1}}, "seconds"),
        ({"a": {"key": "own/bow"}, "b": B}, "no posture is saved as bow"),
        ({"a": {"key": "../../etc/passwd"}, "b": B}, "no movement"),
    ],
)
def test_what_cannot_be_asked_is_refused_in_one_line(studio_server: Served, body: Any, words: str) -> None:
    answer = studio_server.send("POST", "/api/between", body)
    assert answer.status == 400
    assert words in answer.value["error"]
    assert "\n" not in answer.value["error"]


def test_an_alternative_that_is_not_there_is_not_accepted(studio_server: Served) -> None:
    ask = {"job": "j99", "alternative": 1, "window": "w1"}
    answer = studio_server.send("POST", "/api/between/accept", ask)
    assert (answer.status, "search again" in answer.value["error"]) == (400, True)
    assert studio_server.project()["piece"]["blocks"] == []


def test_accepting_leaves_a_out_only_where_the_piece_ends_in_it() -> None:
    asked = Between(Place("ballet/first", 0), Place("ballet/fifth", 0))
    edit = accepted(State(), asked, 2)
    assert isinstance(edit, Several)
    assert [type(one) for one in edit.edits] == [Insert, Insert, Choose]
    once = apply(State(), edit)
    on = accepted(once, Between(Place("ballet/fifth", 0), Place("ballet/first", 0)), 1)
    assert isinstance(on, Several)
    assert [type(one) for one in on.edits] == [Insert, Choose]
    again = accepted(once, asked, 1)
    assert isinstance(again, Several)
    assert [type(one) for one in again.edits] == [Insert, Insert, Choose]
    for other in (on, again):
        assert len({block.id for block in apply(once, other).blocks}) == len(apply(once, other).blocks)
    longer = accepted(State(), Between(asked.a, asked.b, Ask(seconds=2.0)), 1)
    assert isinstance(longer, Several)
    assert [type(one) for one in longer.edits] == [Insert, Insert, Wish, Choose]
