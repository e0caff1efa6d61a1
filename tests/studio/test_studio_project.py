from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import pytest
from bundled_clips import ballet_clip
from studio_server import Served

from motionmind.errors import MotionMindError
from motionmind.studio import piece
from motionmind.studio.dancers import Change, Dancer, PutDancer, SetFormations
from motionmind.studio.edits import Decide, Delete, Edit, Insert, Mirror, Move, Several, Trim
from motionmind.studio.findings import Finding, Found
from motionmind.studio.journal import OpenElsewhereError
from motionmind.studio.project import Project, RefusedError
from motionmind.studio.settings import SetCorpus, SetMusic, SetTempo
from motionmind.studio.view import chosen_at

Make = Callable[..., Project]


def block(number: int) -> Insert:
    return Insert(f"b{number}", "ballet/adagio", 10 * number, 10 * number + 5)


def order(project: Project) -> list[str]:
    return [one.id for one in project.state.blocks]


def test_a_project_opens_as_it_was_closed(make_project: Make) -> None:
    project = make_project()
    for number in range(40):
        project.edit("w1", Insert(f"b{number}", "ballet/adagio", number, number + 3))
    for _ in range(5):
        project.undo("w1")
    project.redo("w1")
    state, sequence, undo = project.state, project.sequence, project.undoable("w1")
    project.close()
    again = make_project()
    assert (again.state, again.sequence, again.undoable("w1")) == (state, sequence, undo)
    assert again.redoable("w1") == "insert a stretch"
    for _ in range(4):
        again.redo("w1")
    assert len(again.state.blocks) == 40
    for _ in range(3):
        again.undo("w1")
    for _ in range(3):
        again.redo("w1")
    assert len(again.state.blocks) == 40


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (
            SetMusic("/beats.txt", 0.0, (500.0, 41_000.0)),
            "cannot change the music: beats[1]: expected a number <= 36000.0",
        ),
        (SetMusic(begins=float("nan")), "cannot change the music: begins: expected a number"),
        (
            Several((SetTempo(90.0), PutDancer(Dancer("d1", "Anna", entry=118_001.0)))),
            "cannot change the dancer Anna: dancer.entry: expected a number <= 100000.0",
        ),
        (
            SetFormations((Change(1.0, 0.0, "line"),)),
            "cannot change the formations: changes[0].counts: expected a number > 0.0",
        ),
    ],
)
def test_an_edit_that_the_file_cannot_hold_is_refused_and_loses_nothing(
    make_project: Make, edit: Edit, words: str
) -> None:
    project = make_project()
    with pytest.raises(RefusedError) as refused:
        project.edit("w1", edit)
    assert str(refused.value).startswith(words)
    project.edit("w1", block(1))
    project.close()
    assert make_project().state == project.state


def test_undo_takes_back_this_windows_edit_and_no_other(make_project: Make) -> None:
    project = make_project()
    project.edit("w1", block(1))
    project.edit("w2", block(2))
    project.undo("w1")
    assert order(project) == ["b2"]
    with pytest.raises(RefusedError, match="nothing to undo"):
        project.undo("w1")
    project.redo("w1")
    assert order(project) == ["b1", "b2"]


def test_undo_is_refused_where_a_later_edit_rests_on_it(make_project: Make) -> None:
    project = make_project()
    project.edit("w1", block(1))
    project.edit("w2", Mirror("b1"))
    before = project.state
    with pytest.raises(RefusedError, match="mirror a stretch”, depends on it"):
        project.undo("w1")
    assert project.state == before
    project.undo("w2")
    project.undo("w1")
    assert order(project) == []
    with pytest.raises(RefusedError):
        project.redo("w2")  # what it mirrors is gone
    project.redo("w1")
    project.redo("w2")
    assert project.state == before


def test_what_a_window_did_that_has_closed_others_take_back(make_project: Make) -> None:
    project = make_project()
    project.edit("w1", block(1))
    project.edit("w2", Mirror("b1"))
    assert project.forget("w2")
    assert not project.forget("w2")
    assert project.undoable("w1") == "mirror a stretch"
    project.undo("w1")
    project.undo("w1")
    assert order(project) == []
    project.greet("w2")
    assert project.undoable("w2") is None


def with_insertion(project: Project) -> Found:
    """Let something be inserted between two stretches."""
    project.edit("w1", block(1))
    project.edit("w1", block(3))
    (seam,) = project.state.seams
    motion = ballet_clip("plies").slice(0, 9)
    found = Found(project.movements.keep(motion), 2.0, "usual")
    project.keep_finding(Finding(project.question(seam), True, "too fast", (found,)))
    return found


def test_insertions_stay_where_they_were_when_more_are_found(make_project: Make) -> None:
    project = make_project()
    first = with_insertion(project)
    (seam,) = project.state.seams
    second = Found(project.movements.keep(ballet_clip("plies").slice(10, 19)), 1.0, "rare")
    question = project.question(seam)
    again = Found(first.key, first.seconds, "in other words")
    whole = Finding(question, True, "too fast", (first, second))
    assert project.keep_finding(Finding(question, True, "from one to the other", (second, again))) == whole
    count = project.sequence
    assert project.keep_finding(Finding(question, True, "too fast", None)) == whole  # judged late
    assert project.keep_finding(Finding(question, True, "no movement found", ())) == whole
    assert project.sequence == count
    project.close()
    assert make_project().finding(seam) == whole


def test_a_locked_insertion_stays_whatever_the_corpus(make_project: Make) -> None:
    project = make_project()
    found = with_insertion(project)
    project.edit("w1", Decide("b1", "b3", "locked"))
    project.edit("w1", SetCorpus("karate"))
    assert chosen_at(project.state.seams[0], project.finding(project.state.seams[0])) == found
    project.close()
    again = make_project()
    (seam,) = again.state.seams
    assert chosen_at(seam, again.finding(seam)) == found
    assert again.corpus_at(seam) == "ballet"
    again.edit("w1", Decide("b1", "b3", "open"))
    (seam,) = again.state.seams
    assert again.finding(seam) is None
    assert again.corpus_at(seam) == "karate"


def test_an_insertion_stands_until_the_other_corpus_has_its_own(make_project: Make) -> None:
    project = make_project()
    found = with_insertion(project)
    project.edit("w1", SetCorpus("karate"))
    (seam,) = project.state.seams
    assert project.finding(seam) is None
    assert project.standing(seam) == found
    project.edit("w1", Trim("b3", 31, 35))
    assert project.standing(project.state.seams[0]) is None  # it begins elsewhere now


def test_a_new_edit_ends_what_could_be_done_again_in_its_window_alone(make_project: Make) -> None:
    project = make_project()
    for window, number in (("w1", 1), ("w2", 2)):
        project.edit(window, block(number))
        project.undo(window)
    project.edit("w1", block(3))
    assert project.redoable("w1") is None
    assert project.redoable("w2") == "insert a stretch"


def test_after_reopening_a_new_window_takes_back_what_closed_ones_did(make_project: Make) -> None:
    project = make_project()
    project.edit("w1", block(1))
    project.close()
    again = make_project()
    again.undo("w9")
    assert order(again) == []


@pytest.mark.parametrize("seed", range(6))
def test_the_state_is_that_of_the_edits_that_are_not_undone(make_project: Make, seed: int) -> None:
    rng, project = random.Random(seed), make_project()
    start, refused, made = project.state, 0, 0
    for _ in range(150):
        window = rng.choice(["w1", "w2", "w3"])
        names = order(project)
        try:
            match rng.randrange(8):
                case 0 | 1:
                    made += 1
                    project.edit(window, Insert(f"b{made}", "ballet/adagio", 0, 9, before=rng.choice([None, *names])))
                case 2 if names:
                    project.edit(window, rng.choice([Mirror, Move, Delete])(rng.choice(names)))
                case 3 if len(names) > 1:
                    place = rng.randrange(len(names) - 1)
                    project.edit(window, Decide(names[place], names[place + 1], rng.choice(["locked", "open"])))
                case 4 | 5 | 6:
                    project.undo(window)
                case 7:
                    project.redo(window)
        except RefusedError:
            refused += 1
        assert project.state == piece.apply_all((one.edit for one in project.changes if not one.undone), start)
    assert refused > 5
    assert made > 20
    state, said = project.state, [(project.undoable(name), project.redoable(name)) for name in ("w1", "w2", "w3")]
    project.close()
    again = make_project()
    for name in ("w1", "w2", "w3"):
        again.greet(name)
    assert again.state == state
    assert [(again.undoable(name), again.redoable(name)) for name in ("w1", "w2", "w3")] == said


def test_what_cannot_be_applied_changes_nothing(make_project: Make) -> None:
    project = make_project()
    project.edit("w1", block(1))
    state, data = project.state, project.path.read_bytes()
    for edit in (Delete("b9"), Move("b1", "b9"), Trim("b1", 0, 10_000), Insert("b2", "ballet/nothing", 0, 0)):
        with pytest.raises(RefusedError):
            project.edit("w1", edit)
    assert project.state == state
    assert project.path.read_bytes() == data


def test_one_process_holds_a_project(make_project: Make) -> None:
    project = make_project()
    with pytest.raises(OpenElsewhereError, match="already open in a studio"):
        Project.open(project.path)


def test_a_torn_last_line_is_dropped_with_a_word(make_project: Make) -> None:
    project = make_project()
    project.edit("w1", block(1))
    whole = project.path.read_bytes()
    project.edit("w1", block(2))
    torn = project.path.read_bytes()
    project.close()
    for length in range(len(whole) + 1, len(torn) - 1):
        project.path.write_bytes(torn[:length])
        again = Project.open(project.path)
        assert order(again) == ["b1"]
        assert again.words == ["the last edit was lost: the studio ended while writing it"]
        assert again.path.read_bytes() == whole
        again.close()
    project.path.write_bytes(torn[:-1])  # all but its end: nothing is lost
    again = Project.open(project.path)
    assert order(again) == ["b1", "b2"]
    again.edit("w1", block(3))
    again.close()
    assert order(make_project()) == ["b1", "b2", "b3"]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "not a studio project"),
        (b"HIERARCHY\nROOT hips\n", "not a studio project"),
        (b'{"format": "motionmind studio", "version": 2}\n', "version 1 can be read"),
        (b"\x00" * 5000, "not a studio project"),
        (b"[" * 100_000, "not a studio project"),
    ],
)
def test_what_is_no_project_is_refused_in_a_line(tmp_path: Path, data: bytes, words: str) -> None:
    path = tmp_path / "x.motionmind"
    path.write_bytes(data)
    with pytest.raises(MotionMindError, match=words) as error:
        Project.open(path)
    assert "\n" not in str(error.value)
    assert path.read_bytes() == data


def test_a_damaged_line_is_named(make_project: Make) -> None:
    project = make_project()
    project.edit("w1", block(1))
    project.edit("w1", block(2))
    project.close()
    lines = project.path.read_bytes().splitlines(keepends=True)
    project.path.write_bytes(lines[0] + b'{"edit": {"edit": "explode"}, "number": 1, "window": "w1"}\n' + lines[2])
    with pytest.raises(MotionMindError, match=r"2: is damaged|line 2"):
        Project.open(project.path)


def test_a_kept_movement_is_kept_once_and_exactly(make_project: Make) -> None:
    project = make_project()
    motion = project.movements.get("~ballet/adagio")
    key = project.movements.keep(motion, "another way")
    size = project.path.stat().st_size
    assert project.movements.keep(motion) == key
    assert project.path.stat().st_size == size
    project.close()
    found = make_project().movements.get(key)
    assert found.skeleton == motion.skeleton
    for name in ("rotations", "root", "times"):
        assert (getattr(found, name) == getattr(motion, name)).all()


def test_the_project_over_http(studio_server: Served) -> None:
    assert studio_server.send("GET", "/health").value == {"ready": True}
    state = studio_server.insert("b1", "ballet/adagio", 0, 9)
    assert [one["id"] for one in state["piece"]["blocks"]] == ["b1"]
    assert state["undo"] == "insert a stretch"
    state = studio_server.post("/api/undo", {"window": "w1"})
    assert state["piece"]["blocks"] == []
    refused = studio_server.send("POST", "/api/undo", {"window": "w1"})
    assert (refused.status, refused.value["error"]) == (409, "nothing to undo in this window")
    assert studio_server.post("/api/redo", {"window": "w1"})["piece"]["blocks"] != []


def test_two_windows_see_each_others_edits(studio_server: Served) -> None:
    other = studio_server.another("w2")
    with other.listening() as events:
        first = next(events)
        assert first == ("project", {"sequence": other.project()["sequence"], "notices": 0})
        sequence = studio_server.insert("b1", "ballet/adagio", 0, 9)["sequence"]
        assert next(events) == ("project", {"sequence": sequence, "notices": 0})
    assert [one["id"] for one in other.project()["piece"]["blocks"]] == ["b1"]
    assert other.project()["undo"] is None


def test_the_studio_notices_that_a_window_has_closed(studio_server: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motionmind.studio.api._WINDOW_GONE_S", 0.05)
    other = studio_server.another("w2")
    studio_server.insert("b1", "ballet/adagio", 0, 9)
    with studio_server.listening() as events:
        assert next(events)[0] == "project"
        with other.listening() as told:
            next(told)
            other.edit(edit="mirror", block="b1")
            assert studio_server.send("POST", "/api/undo", {"window": "w1"}).status == 409
            with other.listening() as second:  # as long as one of its streams is open it is there
                next(second)
        studio_server.edit(edit="title", title="another")
        left = next(data for kind, data in events if kind == "project" and "left" in data)
    assert left["left"] == "w2"
    assert studio_server.post("/api/undo", {"window": "w1"})["undo"] == "mirror a stretch"


def test_movements_and_pictures(studio_server: Served) -> None:
    data = studio_server.get("/api/movements/ballet/arabesque")
    assert len(data["skeleton"]["names"]) == 23
    picture = studio_server.send("GET", "/api/thumbnails/ballet/adagio/3.png?height=64")
    assert (picture.status, picture.headers["content-type"]) == (200, "image/png")
    assert picture.body.startswith(b"\x89PNG")
    assert studio_server.send("GET", "/api/movements/ballet/nothing").status == 404
    assert studio_server.send("GET", "/api/thumbnails/ballet/adagio/9999.png").status == 400
