"""Postures of one's own on the page: renamed and deleted, while what was made of them stays whole."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from piece_page import blocks, wait_for, wait_for_alternatives

if TYPE_CHECKING:
    from studio_server import Served


def save(served: Served, name: str, source: str) -> None:
    told = served.post("/api/pose/open", {"key": source})
    pose = {"key": source, "rotations": told["rotations"], "root": told["root"]}
    key = served.post("/api/pose/keep", {"pose": pose, "name": name})["key"]
    served.edit(edit="posture", name=name, posture=key)


def saved(page: Any) -> list[str]:
    return [one["name"] for one in page.evaluate("studio.store.state.postures")]


@pytest.mark.long
def test_a_posture_is_renamed_and_what_was_made_of_it_stays(studio_server: Served, studio_page: Any) -> None:
    page = studio_page
    save(studio_server, "reach", "ballet/arabesque")
    save(studio_server, "rest", "ballet/fifth")
    page.get_by_test_id("posture-reach").click()
    page.get_by_test_id("insert-posture").click()
    wait_for(page, "piece.blocks.length === 1")
    page.get_by_test_id("manage-postures").click()
    field = page.get_by_test_id("name-reach")
    field.fill("rest")
    field.press("Enter")
    page.get_by_text("rest already exists").wait_for()
    assert field.input_value() == "reach"
    assert saved(page) == ["reach", "rest"]
    field.fill("far away")
    field.press("Tab")
    page.get_by_test_id("name-far away").wait_for()
    page.keyboard.press("Escape")
    page.get_by_test_id("posture-far away").wait_for()
    assert sorted(saved(page)) == ["far away", "rest"]
    assert blocks(page) == ["reach 0-0"]
    # It is A still, and what it leads to is found.
    page.get_by_test_id("posture-rest").click()
    wait_for_alternatives(page)
    page.get_by_test_id("undo").click()
    page.get_by_test_id("posture-reach").wait_for()
    assert sorted(saved(page)) == ["reach", "rest"]


@pytest.mark.long
def test_a_posture_is_deleted_and_comes_back(studio_server: Served, studio_page: Any) -> None:
    page = studio_page
    save(studio_server, "rest", "ballet/fifth")
    page.get_by_test_id("open-pose").click()
    page.get_by_test_id("handle-pelvis").wait_for()
    page.get_by_test_id("pose-from").select_option(label="rest")
    wait_for(page, "studio.viewer.title === 'rest, being edited'")
    page.get_by_test_id("posture-to-timeline").click()
    wait_for(page, "piece.blocks.length === 1")
    page.get_by_test_id("open-between").click()
    page.get_by_test_id("manage-postures").click()
    page.get_by_test_id("delete-rest").click()
    page.get_by_text("Deleted rest").wait_for()
    assert saved(page) == []
    assert len(blocks(page)) == 1
    assert page.evaluate("document.activeElement.dataset.testid") == "restore"
    page.keyboard.press("Enter")
    page.get_by_test_id("name-rest").wait_for()
    page.get_by_test_id("delete-rest").click()
    page.get_by_test_id("restore").wait_for()
    page.keyboard.press("Escape")
    page.get_by_test_id("posture-rest").wait_for(state="detached")
    # Whoever poses what it was goes on.
    page.get_by_test_id("open-pose").click()
    page.get_by_test_id("to-floor").click()
    page.get_by_test_id("posture-name").fill("again")
    page.get_by_test_id("save-posture").click()
    wait_for(page, "studio.store.state.postures.some(({ name }) => name === 'again')")
