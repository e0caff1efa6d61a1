"""Trails, onion skin and the legend in the viewer: by mouse and keys, kept by the browser, without cost when off."""

from __future__ import annotations

from typing import Any

import pytest
from piece_page import until
from studio_server import LARGE

pytestmark = pytest.mark.long

TUBES = "studio.viewer.stage.trails?.mesh.visible ? studio.viewer.stage.trails.mesh.geometry.instanceCount : 0"
GHOSTS = "studio.viewer.stage.ghosts.cones.geometry.instanceCount / studio.viewer.motion.body.cones.length"
PHONE = (390, 844)


@pytest.fixture
def viewed(studio_server: Any, studio_page: Any) -> Any:
    """The page with a piece in the viewer, in the middle of it."""
    studio_server.insert("b1", "ballet/adagio", 0, 40)
    _see_piece(studio_page)
    studio_page.evaluate("studio.viewer.player.seek(10)")
    return studio_page


def _see_piece(page: Any) -> None:
    """Wait for the piece, and go back to it: the gallery may have shown a posture meanwhile."""
    until(page, "window.studio?.viewer.piece?.end > 0 && studio.viewer.stage")
    page.evaluate("studio.viewer.back()")


@pytest.mark.parametrize("studio_page", [LARGE, PHONE], ids=["large", "phone"], indirect=True)
def test_trails_and_ghosts_are_chosen_by_mouse_and_the_browser_keeps_them(viewed: Any, axe_faults: Any) -> None:
    page = viewed
    until(page, f"{GHOSTS} === 0")
    page.get_by_test_id("sights").click()
    for part, joints in (("hands", 2), ("feet", 4), ("pelvis", 5)):
        page.get_by_test_id(f"trail-{part}").click()
        until(page, f"({TUBES}) > 0 && ({TUBES}) % {joints} === 0")
    page.get_by_test_id("onion").click()
    until(page, f"{GHOSTS} === 6")
    page.get_by_test_id("colours").click()
    assert page.get_by_test_id("legend").locator("li").all_inner_texts()[:2] == [" left", " right"]
    stage = page.locator(".stage").bounding_box()
    box = page.locator(".sights").bounding_box()
    assert box["x"] >= stage["x"]
    assert box["x"] + box["width"] <= stage["x"] + stage["width"]
    assert box["y"] >= stage["y"]
    assert axe_faults(page) == []
    page.reload()
    _see_piece(page)
    page.evaluate("studio.viewer.player.seek(0)")
    until(page, f"({TUBES}) > 0 && {GHOSTS} === 3")  # at the start, nothing is before
    assert page.get_by_test_id("legend").is_visible()
    page.get_by_test_id("trail-feet").click()
    page.reload()
    until(page, "window.studio?.viewer.stage")
    assert page.evaluate("studio.viewer.ghosts.trails") == ["hands", "pelvis"]
    page.evaluate("localStorage.removeItem('motionmind-sights')")


def test_keys_choose_and_what_is_off_costs_nothing(viewed: Any) -> None:
    page = viewed
    assert page.evaluate("studio.viewer.stage.trails === undefined")
    for key, drawn in (
        ("H", ["hands"]),
        ("P", ["hands", "pelvis"]),
        ("H", ["pelvis"]),
        ("F", ["feet", "pelvis"]),
    ):
        page.keyboard.press(f"Shift+{key}")
        assert page.evaluate("studio.viewer.ghosts.trails") == drawn
    page.keyboard.press("Shift+P")
    until(page, f"({TUBES}) > 0")
    page.keyboard.press("o")
    until(page, f"{GHOSTS} === 6")
    page.keyboard.press("c")
    assert page.get_by_test_id("legend").is_visible()
    for key in ("o", "c", "Shift+F"):
        page.keyboard.press(key)
    until(page, f"({TUBES}) === 0 && {GHOSTS} === 0")
    assert page.get_by_test_id("legend").count() == 0
    assert not page.evaluate("studio.viewer.stage.trails.mesh.visible")
    page.keyboard.press("?")
    assert "trails of the hands" in page.get_by_test_id("keys").inner_text()
    page.evaluate("localStorage.removeItem('motionmind-sights')")


def test_what_the_browser_keeps_of_another_version_is_no_fault(viewed: Any) -> None:
    for kept in ("nonsense", "null", '{"trails": 3}', '{"trails": ["hands", "ears"], "apart": -1}'):
        viewed.evaluate("(kept) => localStorage.setItem('motionmind-sights', kept)", kept)
        viewed.reload()
        until(viewed, "window.studio?.viewer.stage")
        assert set(viewed.evaluate("studio.viewer.ghosts.trails")) <= {"hands"}
        assert viewed.evaluate("studio.viewer.ghosts.onion") == 0
    viewed.evaluate("localStorage.removeItem('motionmind-sights')")
