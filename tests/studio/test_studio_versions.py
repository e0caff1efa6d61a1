"""Named versions of a piece: what is kept, compared and brought back."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from piece_page import blocks, until, wait_for
from studio_server import Served

from motionmind.errors import MotionMindError
from motionmind.studio import edits as e
from motionmind.studio.neighbours import Verdict
from motionmind.studio.piece import State, apply, apply_all
from motionmind.studio.versions import Version, differences

IDS = [f"b{number}" for number in range(6)]
BEGIN = State(
    blocks=tuple(e.Block(name, "ballet/adagio", 2, 8) for name in IDS[:4]),
    used=frozenset(IDS[:4]),
    verdicts={("b0", "b1"): Verdict(chosen=2)},
)
changes = st.one_of(
    st.builds(e.Insert, st.sampled_from(IDS[4:]), st.just("ballet/plies"), st.just(1), st.just(3)),
    st.builds(e.Move, st.sampled_from(IDS), st.none() | st.sampled_from(IDS)),
    st.builds(e.Trim, st.sampled_from(IDS), st.integers(2, 4), st.integers(5, 8)),
    st.builds(e.Delete, st.sampled_from(IDS)),
    st.builds(e.Mirror, st.sampled_from(IDS)),
    st.builds(
        e.Annotate, st.builds(e.Note, st.just("n1"), st.just("note"), st.just("x"), st.sampled_from(IDS), st.just(3))
    ),
)


def played(state: State, history: list[e.Edit]) -> State:
    for edit in history:
        try:
            state = apply(state, edit)
        except MotionMindError:
            continue
    return state


def version_of(state: State) -> Version:
    return Version(state.blocks, state.verdicts, state.notes, state.about)


@given(st.lists(changes, max_size=4), st.lists(changes, max_size=6))
def test_going_back_brings_back_all_that_was_kept_and_frees_no_id(earlier, later):
    kept = apply(played(BEGIN, earlier), e.SaveVersion("before"))
    after = played(kept, later)
    back = apply(after, e.GoBack("before"))
    assert version_of(back) == version_of(kept)
    assert differences(version_of(kept), version_of(back), (1.0, 1.0)) == []
    assert back.used == after.used >= kept.used
    assert apply(back, e.SaveVersion("before", keep=False)).versions == {}


@given(st.permutations(IDS[:4]), st.sets(st.sampled_from(IDS[:4])), st.integers(0, 2))
def test_what_changed_is_counted(order, removed, added):
    new = tuple(e.Block(name, "ballet/adagio", 2, 8) for name in order if name not in removed)
    new += tuple(e.Block(name, "ballet/plies", 0, 4) for name in IDS[4 : 4 + added])
    words = differences(version_of(State(blocks=BEGIN.blocks)), version_of(State(blocks=new)), (5.0, 5.0))
    counts = {line.split()[-1]: int(line.split()[0]) for line in words}
    assert counts.get("added", 0) == added
    assert counts.get("removed", 0) == len(removed)
    kept = [name for name in order if name not in removed]
    stays = max(len(some) for n in range(len(kept) + 1) for some in combinations(kept, n) if list(some) == sorted(some))
    assert counts.get("moved", 0) == len(kept) - stays  # as few as lead from one order to the other


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (e.Trim("b2", 3, 8), "1 stretch trimmed"),
        (e.Several((e.Mirror("b2"), e.Mirror("b3"))), "2 stretches mirrored"),
        (e.Decide("b1", "b2", "discarded"), "1 insertion changed"),
        (e.Choose("b1", "b2", 2), "1 insertion changed"),
        (e.Annotate(e.Note("n1", "note", "x", "b1", 3)), "1 note changed"),
    ],
)
def test_what_else_changed_is_said(edit, words):
    assert differences(version_of(BEGIN), version_of(apply(BEGIN, edit)), (5.0, 5.0)) == [words]


def test_a_decision_that_was_taken_back_is_no_change():
    same = apply_all([e.Decide("b1", "b2", "discarded"), e.Decide("b1", "b2", "open")], BEGIN)
    assert differences(version_of(BEGIN), version_of(same), (5.0, 5.0)) == []


def test_a_note_that_follows_its_movement_is_no_change_of_its_own():
    noted = apply(BEGIN, e.Annotate(e.Note("n1", "note", "x", "b1", 3)))
    gone = apply(noted, e.Delete("b1"))
    assert gone.notes != noted.notes
    assert differences(version_of(noted), version_of(gone), (5.0, 5.0)) == ["1 stretch removed"]
    other = apply(noted, e.Annotate(e.Note("n1", "note", "x", "b1", 4)))
    assert differences(version_of(noted), version_of(other), (5.0, 5.0)) == ["1 note changed"]


def test_the_length_is_compared():
    one = version_of(BEGIN)
    assert differences(one, one, (5.0, 6.25)) == ["1.25 s longer"]
    assert differences(one, one, (5.0, 4.5)) == ["0.50 s shorter"]


def test_a_missing_version_is_named():
    for edit in (e.GoBack("before"), e.SaveVersion("before", keep=False)):
        with pytest.raises(MotionMindError, match="there is no version “before”"):
            apply_all([edit])


def test_versions_are_kept_in_the_project_and_going_back_is_undone(studio_server: Served) -> None:
    studio_server.insert("b1", "ballet/adagio", 0, 20)
    studio_server.edit(edit="version", name="before rehearsal")
    assert studio_server.get("/api/versions")[0]["changes"] == []
    studio_server.insert("b2", "ballet/adagio", 21, 30)
    (found,) = studio_server.get("/api/versions")
    assert found["name"] == "before rehearsal"
    longer = studio_server.project()["piece"]["seconds"] - found["seconds"]
    assert found["changes"] == ["1 stretch added", f"{longer:.2f} s longer"]
    studio_server.edit(edit="goback", name="before rehearsal")
    assert [one["id"] for one in studio_server.project()["piece"]["blocks"]] == ["b1"]
    assert studio_server.project()["undo"] == "go back to before rehearsal"
    studio_server.post("/api/undo", {"window": "w1"})
    assert [one["id"] for one in studio_server.project()["piece"]["blocks"]] == ["b1", "b2"]


@pytest.mark.long
@pytest.mark.parametrize("by", ["mouse", "keys"])
def test_a_version_is_kept_compared_and_brought_back(studio_server: Served, studio_page: Any, by: str) -> None:
    page = studio_page
    studio_server.insert("b1", "ballet/adagio", 0, 10)
    wait_for(page, "piece.blocks.length === 1", 15.0)
    begun = blocks(page)
    page.get_by_test_id("open-take").click()

    def press(name: str) -> None:
        button = page.get_by_test_id(name)
        button.click() if by == "mouse" else button.press("Enter")

    page.get_by_test_id("version-name").fill("before rehearsal")
    if by == "mouse":
        press("version-keep")
    else:
        page.keyboard.press("Enter")
    page.get_by_text("As the piece is now.").wait_for()
    studio_server.insert("b2", "ballet/adagio", 11, 20)
    page.get_by_text("1 stretch added").wait_for()
    press("version-back")
    wait_for(page, "piece.blocks.length === 1", 15.0)
    assert blocks(page) == begun
    press("undo")
    wait_for(page, "piece.blocks.length === 2", 15.0)
    press("version-delete")
    until(page, "document.querySelectorAll('[data-testid=version-back]').length === 0", seconds=15.0)
