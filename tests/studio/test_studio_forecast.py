"""The forecast of a variation's length: what it knows is exact, what it estimates is uncertain, and both come true."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from piece_page import wait_for
from studio_server import Served, serving

from motionmind.studio import edits as e
from motionmind.studio.findings import Finding, Found
from motionmind.studio.forecast import USUAL_RATIO, _ratio, forecast
from motionmind.studio.project import Project
from motionmind.studio.studio import Studio
from motionmind.studio.view import layout_of

pairs = st.lists(st.tuples(st.floats(0.2, 5.0), st.floats(0.2, 5.0)), max_size=12)


@given(pairs)
def test_the_ratio_lies_between_the_usual_and_the_found_one(found) -> None:
    ratio, spread = _ratio(found)
    estimated, actual = (sum(pair[side] for pair in found) for side in (0, 1))
    own = actual / estimated if found else USUAL_RATIO
    assert min(own, USUAL_RATIO) - 1e-9 <= ratio <= max(own, USUAL_RATIO) + 1e-9
    assert 0.0 < _ratio([*found, (1.0, 1.0)])[1] < spread


@pytest.fixture
def project(make_project: Callable[..., Project]) -> Project:
    project = make_project()
    for name, clip, first, last in (("b1", "plies", 0, 12), ("b2", "adagio-barre", 9, 15), ("b3", "tendus", 11, 18)):
        project.edit("w", e.Insert(name, f"ballet/{clip}", first, last))
    return project


def judged(project: Project, place: int, seconds: float) -> None:
    """Say that the engine found an insertion of this length at a seam."""
    movement = project.movements.get("ballet/valse").slice(0, 3).at(np.linspace(0.0, seconds, 4))
    found = Found(project.movements.keep(movement), seconds, "usual")
    project.keep_finding(Finding(project.question(project.state.seams[place]), True, "", (found,)))


def test_what_is_found_is_foreseen_exactly(project: Project) -> None:
    studio = Studio(project)
    before = forecast(studio, project.state)
    assert before.least < before.seconds < before.most
    assert 0.0 < before.inserted < 1.0
    judged(project, 0, 2.5)
    between = forecast(studio, project.state)
    assert between.most - between.least < before.most - before.least
    judged(project, 1, 1.5)
    after = forecast(studio, project.state)
    length = layout_of(project.state, project.finding, project.marks).seconds
    assert after.least == after.seconds == after.most == pytest.approx(length)
    assert after.inserted == pytest.approx(4.0 / length)


def test_insertions_between_repeats_are_foreseen_each_time(project: Project) -> None:
    studio = Studio(project)
    once = forecast(studio, project.state)
    project.edit("w", e.Play("b1", 1.0, 4))
    assert forecast(studio, project.state).most > once.most + 3 * 6.0  # the stretch lasts six seconds
    for place in range(3):
        judged(project, place, 1.0 + place)
    found = forecast(studio, project.state)
    length = layout_of(project.state, project.finding, project.marks).seconds
    assert found.least == found.seconds == found.most == pytest.approx(length)
    assert found.inserted == pytest.approx((3 * 1.0 + 2.0 + 3.0) / length)


def test_long_insertions_make_the_forecast_of_others_longer(project: Project) -> None:
    def foreseen(seconds: float) -> float:
        judged(project, 0, seconds)
        found = project.finding(project.state.seams[0])
        assert found is not None
        assert found.insertions is not None
        project.edit("w", e.Choose("b1", "b2", len(found.insertions)))  # the one that was found last
        return forecast(Studio(project), project.state).seconds - seconds

    assert foreseen(1.0) < foreseen(3.0) < foreseen(9.0)


def test_wishes_and_decisions_count(project: Project) -> None:
    studio = Studio(project)
    plain = forecast(studio, project.state)
    project.edit("w", e.Wish("b1", "b2", seconds=7.0))
    wished = forecast(studio, project.state)
    project.edit("w", e.Wish("b1", "b2", seconds=9.0))
    assert forecast(studio, project.state).seconds - wished.seconds == pytest.approx(2.0)
    assert wished.most - wished.least < plain.most - plain.least
    project.edit("w", e.Decide("b1", "b2", "discarded"))
    assert forecast(studio, project.state).seconds < plain.seconds


def test_an_empty_piece_lasts_no_time(make_project: Callable[..., Project]) -> None:
    project = make_project()
    found = forecast(Studio(project), project.state)
    assert (found.seconds, found.least, found.most, found.inserted) == (0.0, 0.0, 0.0, 0.0)


@pytest.fixture
def studio_server(tmp_path: Path) -> Iterator[Served]:
    """A studio with a whole clip."""
    with serving(Project.create(tmp_path / "piece.motionmind", "ballet")) as served:
        served.insert("b1", "ballet/valse", 0, 48)
        yield served


def smoothed(served: Served) -> Any:
    """The piece once all its seams are smooth."""
    with served.listening() as events:
        while any(seam["state"] in ("waiting", "abrupt") for seam in served.project()["piece"]["seams"]):
            next(events)
    return served.project()["piece"]


@pytest.mark.long
def test_variations_come_out_as_foreseen_and_are_mostly_recorded(studio_server: Served) -> None:
    wish = {"depart": 0.12, "stretch": 4, "inserted": 0.3}  # of the page
    lengths = []
    for start in (None, [-5.0, -8.0, 30.0]):
        found = studio_server.post("/api/vary", {**wish, "start": start})
        foreseen = found["forecast"]
        blocks = [{name: one[name] for name in e.Block.__struct_fields__} for one in found["piece"]["blocks"]]
        order = {"edit": "arrange", "blocks": blocks, "about": found["about"]}
        studio_server.post("/api/vary/accept", {"window": "w1", "edit": order, "basis": found["basis"]})
        piece = smoothed(studio_server)
        inserted = sum(seam["seconds"] for seam in piece["seams"] if seam["state"] == "inserted")
        assert len(piece["blocks"]) > 2
        assert inserted / piece["seconds"] < 0.3
        assert foreseen["least"] - 0.5 < piece["seconds"] < foreseen["most"] + 0.5
        lengths.append(piece["seconds"])
        now = studio_server.post("/api/vary", {**wish, "start": start})["forecast"]
        assert now["least"] == now["most"] == pytest.approx(piece["seconds"])
    assert lengths[0] != lengths[1]


@pytest.mark.long
def test_the_page_tells_how_long_a_variation_will_be(studio_page: Any) -> None:
    page = studio_page
    page.get_by_test_id("open-vary").click()
    length = page.get_by_test_id("length")
    length.get_by_text("% inserted").wait_for()
    said = length.inner_text()
    assert " s (" in said
    assert "about" in said
    # By keys: fewer insertions.
    page.get_by_test_id("inserted").focus()
    page.keyboard.press("End")
    wait_for(page, f"document.querySelector('[data-testid=length]').innerText !== {said!r}")
    share = int(length.inner_text().split(" %")[0].split()[-1])
    assert share < int(said.split(" %")[0].split()[-1])
    page.get_by_test_id("vary").click()
    wait_for(
        page, "piece.blocks.length > 1 && piece.seams.every(({ state }) => state === 'inserted' || state === 'smooth')"
    )
    wait_for(page, "!document.querySelector('[data-testid=length]').innerText.includes('about')")
    seconds = page.evaluate("studio.store.state.piece.seconds")
    assert f"{seconds:.0f} s · " in length.inner_text()
