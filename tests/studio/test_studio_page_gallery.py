"""The gallery: what its clicks and keys set, and what stays in view while it scrolls."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any

import pytest
from piece_page import until
from studio_server import LARGE, SMALL

pytestmark = pytest.mark.long

ENDS = "[studio.desk.ends.a?.title ?? '', studio.desk.ends.b?.title ?? ''].join(' ')"
FOCUSED = "document.activeElement.dataset.testid ?? ''"


def press(page: Any, *keys: str) -> str:
    for key in keys:
        page.keyboard.press(key)
    return str(page.evaluate(FOCUSED))


def test_each_further_click_replaces_b_and_set_a_moves_it_there(studio_page: Any) -> None:
    page = studio_page
    for posture, ends in [
        ("first", "first "),
        ("first", "first "),
        ("second", "first second"),
        ("fourth", "first fourth"),
        ("first", "first fourth"),  # A stays A
        ("fifth", "first fifth"),
    ]:
        page.get_by_test_id(f"posture-{posture}").click()
        assert page.evaluate(ENDS) == ends
    page.get_by_test_id("set-a").click()
    assert page.evaluate(ENDS) == "fifth fourth"
    page.get_by_test_id("set-b").click()  # on purpose, both are the same
    assert page.evaluate(ENDS) == "fifth fifth"
    page.get_by_test_id("posture-passe").click()
    page.get_by_test_id("set-b").click()
    page.get_by_test_id("set-a").click()  # B was set since the click: it stays
    assert page.evaluate(ENDS) == "passe passe"


def test_arrow_keys_go_through_the_gallery_and_tab_leaves_it(studio_page: Any) -> None:
    page = studio_page
    page.get_by_test_id("posture-first").wait_for()
    page.get_by_label("Search postures and clips").focus()
    page.evaluate("studio.viewer.player.time = 0")
    assert press(page, "Tab") == "posture-first"
    items = page.evaluate("[...document.querySelectorAll('.thumb, .clip')].map((one) => one.dataset.testid)")
    assert press(page, "ArrowLeft") == items[0]
    assert [press(page, "ArrowRight") for _ in items[1:]] == items[1:]
    assert press(page, "ArrowRight") == items[-1]
    assert press(page, "Home") == items[0]
    # Down and up lead through the rows, and back the same way.
    down = [items[0]]
    while (name := press(page, "ArrowDown")) != down[-1]:
        down.append(name)
    assert down[-1] == items[-1]
    assert [press(page, "ArrowUp") for _ in down[1:]] == down[-2::-1]
    boxes = [page.get_by_test_id(name).bounding_box() for name in down]
    assert all(one["y"] + one["height"] <= other["y"] for one, other in pairwise(boxes))
    assert len({box["x"] for box in boxes[:4]}) == 1
    assert press(page, "End") == items[-1]
    assert press(page, "Tab") not in items
    assert press(page, "Shift+Tab") == items[-1]  # where it was left
    page.keyboard.press("Enter")
    page.get_by_test_id("frames").wait_for()
    page.get_by_label("Search postures and clips").fill("arabesque")
    assert press(page, "ArrowDown") == "posture-arabesque"
    page.keyboard.press("Enter")
    until(page, f"{ENDS} === 'arabesque '")


@pytest.mark.parametrize("studio_page", [LARGE, SMALL, (390, 844)], ids=["large", "small", "phone"], indirect=True)
def test_what_has_the_focus_and_the_way_onto_the_time_line_are_in_view(studio_page: Any) -> None:
    page = studio_page
    page.get_by_test_id("posture-first").focus()
    page.keyboard.press("Enter")
    button = page.get_by_test_id("insert-posture")
    until(page, "document.querySelector('[data-testid=insert-posture]').textContent.includes('first')")
    is_met = """(one) => {
      const { left, right, top, bottom } = one.getBoundingClientRect();
      const middle = (left + right) / 2;
      return [top + 2, bottom - 2].every((y) => one.contains(document.elementFromPoint(middle, y)));
    }"""
    for keys in (["ArrowDown"] * 8, ["End"], ["ArrowUp"] * 4, ["Home"]):
        for key in keys:
            page.keyboard.press(key)
            assert page.evaluate(f"({is_met})(document.activeElement)"), page.evaluate(FOCUSED)
            assert button.evaluate(is_met)
    button.click()
    until(page, "studio.store.state.piece.blocks.length === 1")


def test_postures_are_there_before_the_clips_are_composed(studio_page: Any) -> None:
    page = studio_page
    held: list[Any] = []

    def early(route: Any) -> None:
        found = route.fetch().json()
        corpora = [corpus | {"clips": []} for corpus in found["corpora"]]
        route.fulfill(json=found | {"corpora": corpora, "whole": False})

    def hold(route: Any) -> None:
        held.append(route)

    page.route(re.compile(r"/api/gallery$"), early)
    page.route(re.compile(r"/api/gallery\?whole$"), hold)
    page.reload()
    page.get_by_test_id("posture-fifth").click()
    until(page, f"{ENDS} === 'fifth '")
    assert page.locator(".clip").count() == 0
    page.get_by_text("Composing the clips…").wait_for()
    held[0].continue_()
    page.get_by_test_id("clip-adagio").wait_for()
    assert page.get_by_text("Composing the clips…").count() == 0
