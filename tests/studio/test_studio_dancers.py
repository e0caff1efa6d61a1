"""Several dancers of a piece: what a project keeps of them, how they play, and the files they come from and become."""

from __future__ import annotations

import io
import json
import zipfile
from math import degrees
from pathlib import Path
from threading import Barrier, Thread
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from studio_server import Served, running, serving

from motionmind import read_motion
from motionmind.body.rates import MAX_POSITIONS
from motionmind.ensemble.dancers import Ensemble
from motionmind.ensemble.reading import read_ensemble
from motionmind.errors import MotionMindError
from motionmind.studio.casting import cast_of, check_tempo, staged, take_in_ensemble
from motionmind.studio.dancers import Cast, Change, Dancer, PutDancer, RemoveDancer, SetFormations, recast
from motionmind.studio.edits import Insert
from motionmind.studio.project import Project
from motionmind.studio.renewal import Link
from motionmind.tween.counts import counts_to_seconds

TRIO = """
piece = "ballet/adagio"
tempo = 108
piece_tempo = 120
canon = 8
formation = "V"
stage = [8, 6]

[[dancer]]
name = "Anna"
facing = 90

[[dancer]]
name = "Ben"
mirrored = true

[[dancer]]
name = "Chloe"
piece = "ballet/plies"

[[change]]
at = 17
counts = 4
formation = "line"
"""


@pytest.fixture(scope="module")
def adagio(tmp_path_factory: pytest.TempPathFactory) -> Any:
    from motionmind.studio.journal import Journal
    from motionmind.studio.movements import Movements

    path = tmp_path_factory.mktemp("held") / "held.motionmind"
    movements = Movements(Journal.create(path, title="", corpus="ballet", corpora={}), None)
    return movements.get("ballet/adagio").slice(0, 24)


def spots(count: int) -> Any:
    """Places of dancers on a grid of metres, no two on one spot."""
    places = st.tuples(st.integers(-9, 9), st.integers(-9, 9))
    return st.lists(places, min_size=count, max_size=count, unique=True)


@st.composite
def casts(draw: Any) -> Cast:
    count = draw(st.integers(1, 4))
    dancers = tuple(
        Dancer(
            f"d{i}",
            f"Dancer {i}",
            (float(x), float(z)),
            float(draw(st.integers(-360, 360))),
            1.0 + draw(st.integers(0, 24)),
            draw(st.booleans()),
        )
        for i, (x, z) in enumerate(draw(spots(count)))
    )
    changes, at = [], 1.0
    for _ in range(draw(st.integers(0, 3))):
        at += draw(st.integers(0, 9))
        counts = float(draw(st.integers(1, 8)))
        if draw(st.booleans()):
            changes.append(Change(at, counts, draw(st.sampled_from(["line", "circle", "V", "grid"]))))
        else:
            some = zip(dancers[draw(st.integers(0, count)) :], draw(spots(count)), strict=False)
            changes.append(Change(at, counts, places={one.id: place for one, place in some}))
        at += counts
    return Cast(dancers, tuple(changes))


def gap(one: Ensemble, other: Ensemble) -> float:
    """The greatest distance between a joint of a dancer and the same one in another ensemble, metres."""
    times = one.times()
    pairs = zip(one.motions(times), other.motions(times), strict=True)
    return max(float(np.abs(a.positions() - b.positions()).max()) for a, b in pairs)


@settings(max_examples=40, deadline=None)
@given(casts(), st.sampled_from([60.0, 108.0]))
def test_a_cast_becomes_an_ensemble_and_again_the_cast(adagio: Any, cast: Cast, tempo: float) -> None:
    ensemble = staged(cast, adagio, lambda key: adagio, tempo)
    again = cast_of(ensemble, [one.source for one in cast.dancers])
    for one, other, dancer in zip(cast.dancers, again.dancers, ensemble.dancers, strict=True):
        assert (other.name, other.place, other.mirrored) == (one.name, one.place, one.mirrored)
        assert other.facing == pytest.approx(one.facing) == pytest.approx(degrees(dancer.facing))
        assert counts_to_seconds(other.entry - 1.0, tempo) == pytest.approx(dancer.entry)
    assert [(one.at, one.counts) for one in again.changes] == [(one.at, one.counts) for one in cast.changes]
    assert gap(ensemble, staged(again, adagio, lambda key: adagio, tempo)) < 1e-6


def test_all_dance_the_piece_and_one_a_movement_of_its_own(adagio: Any) -> None:
    other = adagio.slice(3, 9)
    cast = Cast((Dancer("a", "A"), Dancer("b", "B", (2.0, 0.0), source="m-0123456789abcdef")))
    ensemble = staged(cast, adagio, {"m-0123456789abcdef": other}.__getitem__, 120.0)
    assert [one.piece for one in ensemble.dancers] == [adagio, other]


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (PutDancer(Dancer("d2", "Anna", (5.0, 0.0))), "two dancers are named Anna"),
        (PutDancer(Dancer("d2", "Ben", (0.01, 0.0))), "Anna and Ben begin on one spot, 0, 0"),
        (RemoveDancer("d9"), "this dancer is no longer there"),
        (
            SetFormations((Change(5.0, 4.0, "line"), Change(8.0, 1.0, "V"))),
            "change 2 of formation begins at count 8, before the last one has ended, at 9",
        ),
    ],
)
def test_an_edit_that_cannot_be_is_refused_in_one_line(edit: Any, words: str) -> None:
    with pytest.raises(MotionMindError, match=f"^{words}$"):
        recast(Cast((Dancer("d1", "Anna"),)), edit)


@settings(max_examples=40, deadline=None)
@given(casts(), st.floats(20.0, 300.0), st.floats(0.0, 1.0))
def test_a_cast_that_was_an_ensemble_is_a_cast_again(adagio: Any, cast: Cast, tempo: float, shift: float) -> None:
    at, changes = 1.0 + shift, []
    for change in cast.changes:  # each begins as the last one ends
        changes.append(msgspec.structs.replace(change, at=at, counts=change.counts / 3.0))
        at = changes[-1].at + changes[-1].counts
    ensemble = staged(cast._replace(changes=tuple(changes)), adagio, lambda key: adagio, tempo)
    again = cast_of(ensemble, [""] * len(cast.dancers))
    assert recast(Cast(), SetFormations(again.changes)).changes == again.changes


@settings(max_examples=40, deadline=None)
@given(casts(), st.lists(st.floats(0.0, 40.0), min_size=1, max_size=4))
def test_a_dancer_is_where_its_movement_is(adagio: Any, cast: Cast, times: list[float]) -> None:
    for one in staged(cast, adagio, lambda key: adagio, 108.0).dancers:
        for time in times:
            assert one.where(time) == pytest.approx(one.at(np.array([time])).root[0, [0, 2]], abs=1e-9)


@given(casts(), st.integers(0, 3))
def test_a_removed_dancer_leaves_no_places(cast: Cast, which: int) -> None:
    gone = cast.dancers[which % len(cast.dancers)].id
    left = recast(cast, RemoveDancer(gone))
    assert all(set(one.places) <= {dancer.id for dancer in left.dancers} for one in left.changes)
    for one in left.dancers:
        left = recast(left, RemoveDancer(one.id))
    assert left == Cast()


def put(server: Served, name: str, **fields: Any) -> Any:
    return server.edit(edit="dancer", dancer={"id": name, "name": name, **fields})


def names(server: Served) -> list[str]:
    return [one["id"] for one in server.project()["cast"]["dancers"]]


@pytest.fixture
def canon(studio_server: Served) -> Served:
    """A piece of two dancers in canon, without a search."""
    studio_server.send("DELETE", "/api/seams")
    studio_server.insert("b1", "ballet/adagio", 0, 30)
    put(studio_server, "anna")
    put(studio_server, "ben", place=[1.5, 0.0], entry=9.0, mirrored=True)
    return studio_server


def test_dancers_are_undone_redone_kept_in_versions_and_opened_again(canon: Served, tmp_path: Path) -> None:
    canon.edit(edit="version", name="duet")
    canon.edit(edit="dismiss", dancer="ben")
    assert names(canon) == ["anna"]
    assert canon.get("/api/versions")[0]["changes"] == ["1 dancer changed"]
    assert canon.project()["undo"] == "remove a dancer"
    canon.post("/api/undo", {"window": "w1"})
    assert names(canon) == ["anna", "ben"]
    canon.post("/api/redo", {"window": "w1"})
    canon.edit(edit="goback", name="duet")
    assert names(canon) == ["anna", "ben"]
    copy = tmp_path / "again.motionmind"
    copy.write_bytes(canon.send("GET", "/api/export/project").body)
    project = Project.open(copy)
    assert project.state.cast == canon.studio.project.state.cast
    project.close()


def test_editing_the_piece_changes_all_dancers(canon: Served) -> None:
    before = canon.get("/api/ensemble")["dancers"]
    canon.edit(edit="trim", block="b1", first=0, last=20)
    after = canon.get("/api/ensemble")["dancers"]
    shorter = [one["end"] - other["end"] for one, other in zip(before, after, strict=True)]
    assert shorter[0] > 1.0
    assert shorter[0] == pytest.approx(shorter[1])


def test_a_long_piece_is_viewed_and_its_dancers_looked_at(canon: Served) -> None:
    put(canon, "ben", place=[0.2, 0.0], entry=9001.0)  # 4500 s later: more frames than are made at once
    found = canon.get("/api/ensemble")
    assert found["frames"] == round(found["seconds"] * found["rate"]) + 1
    assert found["frames"] * 2 * 22 > MAX_POSITIONS
    (near,) = canon.get("/api/ensemble/near")
    assert near["names"] == ["anna", "ben"]


def test_movements_asked_for_by_two_threads_are_held_once(canon: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    movements, together = canon.studio.movements, Barrier(2)
    read = movements._split
    monkeypatch.setattr(movements, "_split", lambda key: (together.wait(30.0), read(key))[1])
    threads = [Thread(target=movements.get, args=("ballet/plies",)) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert movements._size == sum(
        one.rotations.nbytes + one.root.nbytes + one.times.nbytes for one in movements._held.values()
    )


def test_who_comes_too_near_is_told_with_the_count(canon: Served) -> None:
    put(canon, "ben", place=[0.2, 0.0], entry=1.0)
    (near,) = canon.get("/api/ensemble/near")
    assert near["names"] == ["anna", "ben"]
    assert near["metres"] < 0.7
    assert near["count"] == pytest.approx(1.0 + near["seconds"] * 2.0)
    put(canon, "ben", place=[9.0, 0.0], entry=1.0)
    assert canon.get("/api/ensemble/near") == []


def test_without_dancers_or_movement_there_is_no_ensemble(studio_server: Served) -> None:
    answer = studio_server.send("GET", "/api/ensemble")
    assert (answer.status, answer.value["error"]) == (400, "the piece has no dancers: add one first")
    put(studio_server, "anna")
    answer = studio_server.send("GET", "/api/ensemble")
    assert (answer.status, answer.value["error"]) == (400, "the piece is empty: nothing to export")


def test_a_movement_of_ones_own_is_in_the_project(canon: Served) -> None:
    edit = {"edit": "dancer", "dancer": {"id": "c", "name": "c", "place": [4, 0], "source": "m-0123456789abcdef"}}
    answer = canon.send("POST", "/api/edits", {"window": "w1", "edit": edit})
    assert answer.status == 409


def opened(server: Served, text: str, name: str = "trio.toml") -> Any:
    return server.send("POST", "/api/ensemble?window=w1", text.encode(), X_NAME=name)


def as_read(server: Served, text: str, folder: Path) -> Ensemble:
    path = folder / "trio.toml"
    path.write_text(text, encoding="utf-8")
    return read_ensemble(path, server.studio.movements.get)


def ensemble_in(server: Served) -> Ensemble:
    project = server.studio.project
    piece = project.movements.get(project.state.blocks[0].source)
    state = project.state
    return staged(state.cast, piece, project.movements.get, state.tempo, state.stage)


def test_an_ensemble_file_opens_as_one_edit(canon: Served, tmp_path: Path) -> None:
    answer = opened(canon, TRIO)
    assert answer.status == 200, answer
    state = answer.value
    assert [one["name"] for one in state["cast"]["dancers"]] == ["Anna", "Ben", "Chloe"]
    assert [bool(one["source"]) for one in state["cast"]["dancers"]] == [False, False, True]
    assert (state["tempo"], state["undo"], len(state["piece"]["blocks"])) == (108.0, "open the ensemble trio", 1)
    assert gap(as_read(canon, TRIO, tmp_path), ensemble_in(canon)) < 1e-6
    state = canon.post("/api/undo", {"window": "w1"})
    assert names(canon) == ["anna", "ben"]
    assert [one["id"] for one in state["piece"]["blocks"]] == ["b1"]
    assert opened(canon, TRIO).status == 200  # ids of stretches are not used twice


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('piece = "ballet/adagio"\n[[dancers]]\n', "duo.toml: Object contains unknown field `dancers`; did you mean"),
        ('piece = "solo.bvh"\n[[dancer]]\n', "solo.bvh: upload this movement first"),
        ('piece = "ballet/adagio"\ntempo = 10\n[[dancer]]\n', "duo: the studio counts 20 to 300 a minute, not 10"),
    ],
)
def test_a_file_that_cannot_be_opened_changes_nothing(canon: Served, text: str, words: str) -> None:
    before = canon.project()["sequence"]
    answer = opened(canon, text, "duo.toml")
    assert answer.status == 400
    assert answer.value["error"].startswith(words)
    assert canon.project()["sequence"] == before


def test_an_ensemble_finds_uploads_by_their_names(canon: Served, tmp_path: Path) -> None:
    path = tmp_path / "solo.json"
    path.write_bytes(canon.send("GET", "/api/export/json").body)
    canon.send("POST", "/api/imports", path.read_bytes(), X_NAME="solo.json")
    assert opened(canon, 'piece = "pieces/solo.json"\n[[dancer]]\n[[dancer]]\n').status == 200
    assert [one["title"] for one in canon.project()["piece"]["blocks"]] == ["solo"]


def archive(server: Served, form: str) -> zipfile.ZipFile:
    answer = server.send("GET", f"/api/ensemble/{form}")
    assert answer.status == 200, answer
    assert answer.headers["content-disposition"].endswith(f"''piece.{form}.zip")
    assert answer.body == server.send("GET", f"/api/ensemble/{form}").body
    return zipfile.ZipFile(io.BytesIO(answer.body))


def test_the_exported_ensemble_is_read_again(canon: Served, tmp_path: Path) -> None:
    assert opened(canon, TRIO).status == 200
    archive(canon, "toml").extractall(tmp_path)
    assert sorted(one.name for one in tmp_path.iterdir() if one.suffix in (".toml", ".json")) == [
        "piece-1.json",
        "piece-2.json",
        "piece.toml",
    ]
    again = read_ensemble(tmp_path / "piece.toml", lambda piece: read_motion(tmp_path / piece))
    assert (again.tempo, again.stage) == (108.0, (8.0, 6.0))
    assert gap(ensemble_in(canon), again) < 1e-4


def test_two_who_end_on_one_spot_are_no_file(canon: Served) -> None:
    canon.edit(edit="formations", changes=[{"at": 3, "counts": 2, "places": {"anna": [5, 5], "ben": [5, 5]}}])
    answer = canon.send("GET", "/api/ensemble/toml")
    assert (answer.status, answer.value["error"]) == (
        400,
        "change 1 of formation: anna and ben end on one spot, 5, 5",
    )


def test_page_glb_and_bvh_hold_all_dancers(canon: Served, tmp_path: Path) -> None:
    html = canon.send("GET", "/api/ensemble/html").body.decode()
    data = json.loads(html.split('id="data">', 1)[1].split("</script>", 1)[0])
    assert [one["name"] for one in data["dancers"]] == ["anna", "ben"]
    assert "/api/" not in html
    glb = canon.send("GET", "/api/ensemble/glb")
    assert glb.headers["content-disposition"].endswith("''piece.glb")
    assert b"anna" in glb.body
    assert b"ben" in glb.body
    files = archive(canon, "bvh")
    assert files.namelist() == ["piece-1.bvh", "piece-2.bvh"]
    files.extractall(tmp_path)
    ensemble = canon.get("/api/ensemble")
    for name, x in (("piece-1.bvh", 0.0), ("piece-2.bvh", 1.5)):
        motion = read_motion(tmp_path / name)
        assert len(motion) == ensemble["frames"]
        assert motion.root[0, [0, 2]] == pytest.approx([x, 0.0], abs=1e-5)
    answer = canon.send("GET", "/api/ensemble/fbx")
    assert answer.status == 400
    assert "'fbx'" in answer.value["error"]


def test_the_film_shows_all_dancers(canon: Served, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from motionmind.render import film
    from motionmind.render.group import GroupStage
    from motionmind.studio.filming import Direction, draw_film

    seen = []
    monkeypatch.setattr(
        film, "encode_mp4", lambda path, stage, rate, frames, sound: seen.append((stage, next(iter(frames))))
    )
    project = canon.studio.project
    piece = project.movements.get("ballet/adagio").slice(0, 3)
    motions = staged(project.state.cast, piece, project.movements.get, 120.0).motions(np.array([0.0, 0.1]))
    draw_film(lambda *_: None, motions, Direction(0.0, 20.0), tmp_path / "film.mp4", None)
    ((stage, picture),) = seen
    assert isinstance(stage, GroupStage)
    assert len(stage.stages) == 2
    assert picture.std() > 1.0


def test_the_look_only_link_sees_all_dancers_and_nothing_else_of_them(make_project: Any, tmp_path: Path) -> None:
    project = make_project()
    project.edit("w1", Insert("b1", "ballet/adagio", 0, 9))
    project.edit("w1", PutDancer(Dancer("d1", "Anna", mirrored=True)))
    with serving(project, link=Link(project.path, "http://127.0.0.1:1", tmp_path)) as server:
        assert server.keys.link
        looking = server.look(server.keys.link.key)
        assert looking.project()["cast"]["dancers"][0]["name"] == "Anna"
        assert looking.get("/api/ensemble")["dancers"][0]["mirrored"]
        looking.get("/api/movements/~ballet/adagio")
        for path in ("/api/ensemble/near", "/api/ensemble/toml", "/api/movements/~ballet/plies"):
            assert looking.send("GET", path).status in (403, 404)


def test_a_terminal_opens_an_ensemble(tmp_path: Path) -> None:
    path = tmp_path / "trio.toml"
    path.write_text(TRIO, encoding="utf-8")
    with running(path, home=tmp_path / "home") as (_, page):
        assert [one["name"] for one in page.project()["cast"]["dancers"]] == ["Anna", "Ben", "Chloe"]
    assert (tmp_path / "trio.motionmind").exists()


def test_a_tempo_that_the_studio_cannot_count_is_refused(adagio: Any, make_project: Any) -> None:
    ensemble = Ensemble("slow", staged(Cast((Dancer("a", "A"),)), adagio, lambda key: adagio, 60.0).dancers, 10.0)
    with pytest.raises(MotionMindError, match="slow: the studio counts 20 to 300 a minute, not 10"):
        check_tempo(ensemble)
    project = make_project()
    with pytest.raises(MotionMindError):
        take_in_ensemble(project, ensemble, "w1")
    assert project.changes == ()
